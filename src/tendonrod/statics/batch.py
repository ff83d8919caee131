"""`solve_batch`: many equilibria at once, on all cores, as arrays; every item is what `solve` would give."""

from __future__ import annotations

import os
import sys
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import cache, cached_property
from math import cos, inf, sin
from typing import Any

import numpy as np

from ..errors import Fact, InvalidInput, numbers, one_of, whole
from ..robot import Robot, as_robot
from .equilibrium import ZERO, solve
from .shape import Shape, Status
from .solution import CONVERGED, MOST_STEPS, PATIENCE, RETRACTED, START_CAPACITY, TOO_SMALL, compiled, worked_accuracy

Numbers = float | Sequence | np.ndarray
NOT_REACHED = "not solved, because the batch was stopped before; solve the rest in another batch"
STATUSES: tuple[str, ...] = (*Status, NOT_REACHED)  # `Batch.code` counts through these
DONE, WAITING = STATUSES.index(Status.CONVERGED), STATUSES.index(NOT_REACHED)
NOTICE = "tendonrod: compiling the loop over batches, a few seconds, once per installation"
CHUNK, MOST_ROWS = 128, 8192  # items, and sampled points, that a thread solves in one go
ROOM = 2048  # steps for which a thread keeps room; an item that needs more is solved alone
MOST_THREADS = 1024
POLL = 0.05  # s, how long at most between two looks at `stop`
ITEM_OUTPUTS = {"tip": (slice(0, 3), (3,)), "tip_rotation": (slice(3, 12), (3, 3))}
POINT_OUTPUTS = {
    "position": (slice(0, 3), (3,)),
    "rotation": (slice(3, 12), (3, 3)),
    "v": (slice(12, 15), (3,)),
    "u": (slice(15, 18), (3,)),
    "force": (slice(18, 21), (3,)),
    "moment": (slice(21, 24), (3,)),
    "centerline": (slice(0, 3), (3,)),
}
OUTPUTS = ITEM_OUTPUTS | POINT_OUTPUTS
USUAL = ("position", "rotation", "v", "u", "centerline")
VECTORS = ("gravity", "tip_force", "tip_moment", "distributed_force", "distributed_moment")
RANGES = {"tensions": (0.0, inf), "insertion": (0.0, 1.0), "accuracy": (1e-12, 1.0)}


def solve_batch(
    robot: Robot | Sequence[Robot],
    tensions: Numbers = 0.0,
    gravity: Numbers = ZERO,
    tip_force: Numbers = ZERO,
    tip_moment: Numbers = ZERO,
    distributed_force: Numbers = ZERO,
    distributed_moment: Numbers = ZERO,
    insertion: Numbers = 1.0,
    rotation: Numbers = 0.0,
    points: int | Sequence[float] | np.ndarray | None = None,
    accuracy: Numbers = 1e-6,
    steps: int | None = None,
    outputs: Iterable[str] | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    stop: threading.Event | Callable[[], bool] | None = None,
    **more: Any,
) -> Batch:
    """Static equilibria of B items, each as `solve` finds it from a cold start, whatever the number of threads.

    Everything that `solve` takes may have a leading axis of length B; what has none, or one of length 1, holds for all
    items. Units and frames as in `solve`.

    - robot: one, or a sequence of B with equally many tendons.
    - tensions: a number, (B, n_tendons), or with one axis (n_tendons,), which for a single tendon is (B,).
    - gravity, tip_force, tip_moment, distributed_force, distributed_moment: (3,) or (B, 3).
    - insertion, rotation, accuracy: a number or (B,). steps: a number.
    - points: where to report along the body: how many points, evenly spaced from the exit to the tip, or (k,) fractions
      of the exposed length from 0 to 1; None for the tip alone.
    - outputs: names of the arrays to make, of tip, tip_rotation, position, rotation, v, u, force, moment, centerline;
      None for the first two and, with ``points``, all but force and moment. Memory grows with these and inputs only.
    - threads: None for one per core.
    - progress: called as progress(done, total) in the calling thread while items are done.
    - stop: an Event, or a function called in the calling thread, that ends the batch early.
    - more: what else `solve` takes by keyword, one value for all items. With it, and for robots that are not uniform,
      the threads call `solve` item by item, and what is wrong with it is raised at the first.

    Returns a `Batch`. An item that fails has its status and NaN; only bad input raises, `InvalidInput`, with the place
    of the value, ``tensions[17]``.
    """
    given = {"tensions": tensions, "insertion": insertion, "rotation": rotation, "accuracy": accuracy}
    loads = gravity, tip_force, tip_moment, distributed_force, distributed_moment
    given |= zip(VECTORS, loads, strict=True)
    inputs = Inputs(robot, given, None if steps is None else whole("steps", steps, 1, MOST_STEPS), more)
    if not (progress is None or callable(progress)):
        raise InvalidInput("progress", progress, "a function or None")
    work = _Work(inputs, _fractions(points), _output_names(outputs, points is not None))
    count = _cores() if threads is None else whole("threads", threads, 1, MOST_THREADS)
    work.run(count, progress or _silent, _asker(stop))
    return work.batch()


def _made(name: str, text: str):
    """Property of a `Batch` that reads the output ``name``."""

    def read(self: Batch) -> np.ndarray:
        if name not in self.arrays:
            also = "" if name in ITEM_OUTPUTS else ", and points given"
            raise InvalidInput("outputs", tuple(self.arrays), f'with "{name}"{also}, for `{name}` to be read')
        return self.arrays[name]

    return property(read, doc=text)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Batch:
    """What `solve_batch` found: read-only arrays, one row per item; SI, world frame; NaN where it did not converge.

    - code (B,): place of each item's status in `STATUSES`; `status` spells it out.
    - load_factor, residual, error_estimate, steps (B,): as in `Shape`; no steps where it did not converge.
    - fractions (k,): of the exposed length, where the points lie.
    - arrays: the outputs by name; each can be read as an attribute too.
    """

    code: np.ndarray
    load_factor: np.ndarray
    residual: np.ndarray
    error_estimate: np.ndarray
    steps: np.ndarray
    fractions: np.ndarray
    arrays: Mapping[str, np.ndarray]
    _inputs: Inputs

    def __len__(self) -> int:
        return self.code.size

    def __repr__(self) -> str:
        counts = ", ".join(f"{n} {getattr(status, 'name', 'not reached').lower()}" for status, n in self.counts.items())
        return f"Batch({len(self)} items: {counts or 'none'})"

    @property
    def converged(self) -> np.ndarray:
        """(B,) whether force and moment balance within the tolerance."""
        return self.code == DONE

    @cached_property
    def status(self) -> np.ndarray:
        """(B,) objects: a `Status`, or `NOT_REACHED` where the batch was stopped before."""
        return _frozen(np.array(STATUSES, dtype=object)[self.code])

    @property
    def counts(self) -> dict[str, int]:
        """How many items ended with each status that occurs."""
        found = Counter(self.code.tolist())
        return {STATUSES[code]: found[code] for code in sorted(found)}

    tip = _made("tip", "(B, 3) end of the neutral axis, m.")
    tip_rotation = _made("tip_rotation", "(B, 3, 3) section frame at the tip.")
    position = _made("position", "(B, k, 3) neutral axis, m.")
    rotation = _made("rotation", "(B, k, 3, 3) section frames, as `Shape.rotation`.")
    v = _made("v", "(B, k, 3) shear and extension strain, section frame.")
    u = _made("u", "(B, k, 3) bending and twist, section frame, 1/m.")
    force = _made("force", "(B, k, 3) total internal force, world frame, N.")
    moment = _made("moment", "(B, k, 3) total internal moment, world frame, N m.")
    centerline = _made("centerline", "(B, k, 3) axis of the tube, m, as `Shape.centerline`.")

    def shape(self, i: int, s: Sequence[float] | np.ndarray | None = None) -> Shape:
        """Item ``i`` as a full `Shape`, solved again, for a batch keeps nothing but its arrays; ``s`` as in `solve`.

        Without ``s`` it reports at the batch's points or, if there are none, at the integrator's nodes.
        """
        i = whole("i", i, -len(self), len(self) - 1) % len(self)
        return self._inputs.solve(i, self.fractions if s is None and self.fractions.size else None, s)

    def __setstate__(self, state: dict) -> None:
        vars(self).update(state)
        for array in (*vars(self).values(), *self.arrays.values()):
            if isinstance(array, np.ndarray):
                _frozen(array)


class Inputs:
    """The checked inputs of a batch: robots, and arrays with one row per item, repeated without copying.

    given: values by the names of `solve`; more: those that hold for all items unseen. Raises `InvalidInput`.
    """

    def __init__(
        self, robot: Robot | Sequence[Robot], given: Mapping[str, Numbers], steps: int | None, more: Mapping[str, Any]
    ) -> None:
        self.robots, lengths = _robots(robot)
        rows = {}
        for field, value in given.items():
            rows[field], has_axis = _rows(field, value, self.robots[0].n_tendons)
            if has_axis:
                lengths[field] = len(rows[field])
        self.size, self.steps, self.more = _common(lengths), steps, more
        self.values = {field: np.broadcast_to(each, (self.size, *each.shape[1:])) for field, each in rows.items()}
        self.which = np.broadcast_to(np.arange(len(self.robots)), (self.size,))

    @cached_property
    def fits_the_loop(self) -> bool:
        """Whether the compiled loop knows all robots and all that acts on them."""
        return not self.more and all(getattr(each, "is_uniform", True) for each in self.robots)

    @cached_property
    def rods(self) -> np.ndarray:
        """(U, 13) `Robot.rod_constants`."""
        return np.array([each.rod_constants for each in self.robots])

    @cached_property
    def routing(self) -> np.ndarray:
        """(U, n, 6) `Robot.routing`."""
        return np.array([each.routing for each in self.robots])

    @cached_property
    def sections(self) -> np.ndarray:
        """(3, U) weight per length over gravity, radius and length of the neutral axis."""
        return np.array([(s.line_density, s.r_na, s.L_na) for s in (each.section for each in self.robots)]).T

    def tensions(self, items: slice) -> np.ndarray:
        """(m, n) tensions of some items, N."""
        return np.array(self.values["tensions"][items])

    def problems(self, items: slice) -> np.ndarray:
        """(m, 30) problems of some items as the kernel takes them, to the bit what `prepare` makes of each."""
        get = {field: each[items] for field, each in self.values.items()}
        weight, r, L = self.sections[:, self.which[items]]
        eta, angles = get["insertion"], get["rotation"].tolist()
        c, d = np.array([cos(a) for a in angles]), np.array([sin(a) for a in angles])
        problems = np.zeros((eta.size, 30))
        problems[:, 0:3], problems[:, 3:6] = get["tip_force"], get["tip_moment"]
        problems[:, 6:9] = weight[:, None] * get["gravity"] + get["distributed_force"]
        problems[:, 9:12] = get["distributed_moment"]
        problems[:, 12], problems[:, 13] = eta * L, (1.0 - eta) * L
        problems[:, 14], problems[:, 15] = -r * c, -r * d
        problems[:, 17], problems[:, 18], problems[:, 20], problems[:, 21], problems[:, 25] = c, -d, d, c, 1.0
        asked = zip(get["accuracy"].tolist(), problems[:, 12].tolist(), strict=True)
        problems[:, 26] = [worked_accuracy(*each) for each in asked]
        problems[:, 27], problems[:, 29] = self.steps or 0, inf
        return problems

    def solve(self, i: int, fractions: np.ndarray | None = None, s=None) -> Shape:
        """Item ``i`` alone, at arc lengths ``s`` or at ``fractions`` of the exposed length."""
        arguments = {field: each[i].tolist() for field, each in self.values.items()}
        robot = self.robots[self.which[i]]
        shape = solve(robot, **arguments, s=s, steps=self.steps, throw=False, **self.more)
        return shape if fractions is None else shape.at(fractions * shape.length)


class _Space:
    """What one thread works in: room for the solution of one item and for the results of one chunk."""

    def __init__(self, chunk: int, n_tendons: int, k: int, scratch: int) -> None:
        self.tendons, self.state, self.at = np.empty((n_tendons, 7)), np.empty(2 * (40 * ROOM + 19)), np.empty(k)
        self.jacobian, self.scratch = np.empty((3, 3)), np.empty(scratch)
        self.tips, self.rows, self.facts = np.empty((chunk, 12)), np.empty((chunk, k, 24)), np.empty((chunk, 8))


class _Work:
    """One batch under way: the arrays that it fills, and the threads that do so."""

    def __init__(self, inputs: Inputs, fractions: np.ndarray, outputs: Sequence[str]) -> None:
        B, k = inputs.size, fractions.size
        shapes = {name: (B, *shape) for name, (_, shape) in ITEM_OUTPUTS.items()}
        shapes |= {name: (B, k, *shape) for name, (_, shape) in POINT_OUTPUTS.items()}
        self.inputs, self.fractions = inputs, fractions
        self.code = np.full(B, WAITING, dtype=np.int8)
        self.load_factor, self.residual, self.error_estimate = (np.full(B, np.nan) for _ in range(3))
        self.steps = np.zeros(B, dtype=np.int64)
        self.arrays = {name: np.full(shapes[name], np.nan) for name in outputs}
        self.sampled = fractions if POINT_OUTPUTS.keys() & self.arrays.keys() else np.empty(0)
        self.halted = np.zeros(1, dtype=np.uint8)
        self.hard: deque[int] = deque()  # items that the compiled loop leaves to `solve`
        self.own = threading.local()

    def run(self, threads: int, progress: Callable[[int, int], object], stop: Callable[[], bool]) -> None:
        """Solve all items, or those that can be until ``stop`` says so; the calling thread only waits and reports."""
        total, done, running = self.inputs.size, 0, set()
        tasks = self._tasks(threads)
        with ThreadPoolExecutor(threads) as pool:
            try:
                while not stop():
                    while len(running) < 3 * threads and (task := self._alone() or next(tasks, None)):
                        running.add(pool.submit(*task))
                    if not running:
                        break
                    ended, running = wait(running, POLL, FIRST_COMPLETED)
                    if count := sum(each.result() for each in ended):
                        done += count
                        progress(done, total)
            finally:
                self.halted[0] = 1
                for each in running:
                    each.cancel()

    def batch(self) -> Batch:
        """The results, read-only."""
        facts = {name: getattr(self, name) for name in ("code", "load_factor", "residual", "error_estimate", "steps")}
        for array in (*facts.values(), *self.arrays.values(), self.fractions):
            _frozen(array)
        return Batch(**facts, fractions=self.fractions, arrays=self.arrays, _inputs=self.inputs)

    def _tasks(self, threads: int) -> Iterator[tuple[Callable[[slice], int], slice]]:
        """All items in chunks, each with what solves it and returns how many it has finished."""
        total = self.inputs.size
        size = max(1, min(CHUNK, MOST_ROWS // max(1, self.sampled.size), total // (4 * threads)))
        for at in range(0, total, size):
            yield self._compiled if self.inputs.fits_the_loop else self._one_by_one, slice(at, min(at + size, total))

    def _alone(self) -> tuple[Callable[[slice], int], slice] | None:
        if not self.hard:
            return None
        i = self.hard.popleft()
        return self._one_by_one, slice(i, i + 1)

    def _one_by_one(self, items: slice) -> int:
        """Items by `solve`, which knows how to take what the compiled loop leaves."""
        for i in range(items.start, items.stop):
            if self.halted[0]:
                return i - items.start
            shape = self.inputs.solve(i)
            if shape.converged:
                self._sample(i, shape)
            self.load_factor[i], self.residual[i] = shape.load_factor, shape.residual
            self.error_estimate[i], self.steps[i] = shape.error_estimate, shape.steps if shape.converged else 0
            self.code[i] = STATUSES.index(shape.status)
        return items.stop - items.start

    def _sample(self, i: int, shape: Shape) -> None:
        for name, array in self.arrays.items():
            if name == "tip":
                array[i] = shape.tip
            elif name == "tip_rotation":
                array[i] = shape.at([shape.length]).rotation[0]
            else:
                array[i] = getattr(shape.at(self.sampled * shape.length), name)

    def _compiled(self, items: slice) -> int:
        """Items by the compiled loop; those that it cannot do are put down as hard, and not counted."""
        inputs, kernel, space = self.inputs, _loop(), self._space()
        problems = inputs.problems(items)
        codes = np.where(problems[:, 12] < RETRACTED, -1, TOO_SMALL)
        m = codes.size
        reached = kernel.equilibria(
            inputs.rods, inputs.routing, np.array(inputs.which[items]), inputs.tensions(items), problems, self.sampled,
            START_CAPACITY, self.halted, space.tendons, space.state, space.at, space.jacobian, space.scratch,
            space.tips[:m], space.rows[:m], space.facts[:m], codes,
        )  # fmt: skip
        good = codes[:reached] == CONVERGED
        self._keep(slice(items.start, items.start + reached), space, good)
        self.hard.extend((items.start + np.flatnonzero(~good)).tolist())
        return int(good.sum())

    def _keep(self, items: slice, space: _Space, good: np.ndarray) -> None:
        """Write the results of a chunk to its place in the arrays; what is not ``good`` is NaN in ``space``."""
        m, facts = good.size, space.facts[: good.size]
        self.residual[items], self.steps[items] = facts[:, 0], np.where(good, facts[:, 4], 0)
        self.error_estimate[items] = np.nan if self.inputs.steps else facts[:, 6]
        self.error_estimate[items][facts[:, 1] == 0.0] = 0.0  # closed form, whatever the number of steps
        self.load_factor[items] = np.where(good, 1.0, np.nan)
        for name, array in self.arrays.items():
            columns, _ = OUTPUTS[name]
            found = (space.tips if name in ITEM_OUTPUTS else space.rows)[:m]
            array[items] = found[..., columns].reshape(m, *array.shape[1:])
            if name == "centerline":
                r_na = self.inputs.sections[1, self.inputs.which[items]]
                array[items] += r_na[:, None, None] * found[..., 3:12:3]
        self.code[items] = np.where(good, DONE, WAITING)

    def _space(self) -> _Space:
        """The calling thread's own."""
        if not hasattr(self.own, "space"):
            self.own.space = _Space(CHUNK, self.inputs.robots[0].n_tendons, self.sampled.size, compiled().SCRATCH)
        return self.own.space


@cache
def _loop():
    """The compiled loop; says so on standard error when that has to be compiled first, once per installation."""
    compiled()
    notice = threading.Timer(PATIENCE, print, [NOTICE], {"file": sys.stderr, "flush": True})
    notice.daemon = True
    notice.start()
    try:
        from . import kernel_batch

        kernel_batch.compile_all()
    finally:
        notice.cancel()
    return kernel_batch


def _robots(robot: Robot | Sequence[Robot]) -> tuple[tuple[Robot, ...], dict[str, int]]:
    """(robots, their number by name, if they are given as a sequence)."""
    if not isinstance(robot, (list, tuple, np.ndarray)):
        return (as_robot(robot),), {}
    robots = tuple(robot)
    if not robots:
        raise InvalidInput("robot", robot, "a Robot or a sequence of one or more")
    for i, each in enumerate(robots):
        if not isinstance(each, Robot):
            raise InvalidInput(f"robot[{i}]", each, "a Robot, as load_robot gives it")
        if each.n_tendons != robots[0].n_tendons:
            allowed = f"a robot with as many tendons as robot[0], {robots[0].n_tendons}"
            raise InvalidInput(f"robot[{i}]", Fact(f"{each.name} with {each.n_tendons}"), allowed)
    return robots, {"robot": len(robots)}


def _rows(field: str, value: Numbers, n_tendons: int) -> tuple[np.ndarray, bool]:
    """(``value`` with a leading axis, whether it had one)."""
    width = 3 if field in VECTORS else n_tendons if field == "tensions" else None
    ndims = (1, 2) if field in VECTORS else (0, 1, 2) if field == "tensions" else (0, 1)
    array = numbers(field, value, ndims)
    if field in RANGES:
        _check_range(field, array, *RANGES[field])
    if field == "tensions" and array.ndim == 0:
        return np.full((1, n_tendons), array), False
    if field == "tensions" and array.ndim == 1 and n_tendons == 1:
        return array[:, None], True
    if width is not None and array.shape[-1] != width:
        raise InvalidInput(field, value, f"{width} finite numbers, or a row of {width} for each item")
    return (array, True) if array.ndim == ndims[-1] else (array[None], False)


def _check_range(field: str, array: np.ndarray, low: float, high: float) -> None:
    wrong = np.argwhere((array < low) | (array > high))
    if len(wrong):
        at = tuple(wrong[0].tolist())
        allowed = f">= {low:.6g}" if high == inf else f"from {low:.6g} to {high:.6g}"
        raise InvalidInput(field + "".join(f"[{i}]" for i in at), array[at], allowed)


def _common(lengths: Mapping[str, int]) -> int:
    """Number of items, from the lengths of the leading axes; 1 fits all."""
    several = {field: length for field, length in lengths.items() if length != 1}
    first, size = next(iter(several.items()), ("", 1))
    for field, length in several.items():
        if length != size:
            raise InvalidInput(field, Fact(f"{length} items"), f"one or {size} items, as {first} has")
    return size


def _fractions(points: int | Sequence[float] | np.ndarray | None) -> np.ndarray:
    if points is None:
        return np.empty(0)
    if np.ndim(points) == 0:
        return np.linspace(0.0, 1.0, whole("points", points, 2))
    fractions = numbers("points", points)
    if not fractions.size:
        raise InvalidInput("points", points, "one or more fractions of the exposed length, or None")
    _check_range("points", fractions, 0.0, 1.0)
    return fractions


def _output_names(outputs: Iterable[str] | None, has_points: bool) -> tuple[str, ...]:
    if outputs is None:
        return (*ITEM_OUTPUTS, *(USUAL if has_points else ()))
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    for name in names:
        if one_of("outputs", name, OUTPUTS) in POINT_OUTPUTS and not has_points:
            raise InvalidInput("points", None, f'given where outputs holds "{name}"')
    return names


def _asker(stop: threading.Event | Callable[[], bool] | None) -> Callable[[], bool]:
    """``stop`` as a function."""
    ask = (lambda: False) if stop is None else stop.is_set if isinstance(stop, threading.Event) else stop
    if not callable(ask):
        raise InvalidInput("stop", stop, "an Event, a function or None")
    return ask


def _silent(done: int, total: int) -> None:
    """No progress is reported."""


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array
