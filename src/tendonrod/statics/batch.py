"""`solve_batch`: many equilibria at once, on all cores, as arrays; every item is what `solve` would give."""

from __future__ import annotations

import os
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InvalidInput, numbers, one_of, whole
from ..robot import Robot
from .batch_inputs import VECTORS, Inputs, Numbers, check_range
from .batch_work import DONE, ITEM_OUTPUTS, OUTPUTS, POINT_OUTPUTS, STATUSES, Work
from .problem import ZERO
from .shape import Shape, Status
from .solution import MOST_STEPS

MOST_THREADS = 1024
USUAL = ("position", "rotation", "v", "u", "centerline")


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

    What is listed here may have a leading axis of length B; what has none, or one of length 1, holds for all items, and
    so does everything else that `solve` takes, loads and surface for instance. Units and frames as in `solve`.

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
    work = Work(inputs, _fractions(points), _output_names(outputs, points is not None))
    count = _cores() if threads is None else whole("threads", threads, 1, MOST_THREADS)
    work.run(count, progress or _silent, _asker(stop))
    return Batch(**work.facts(), fractions=work.fractions, arrays=work.arrays, _inputs=inputs)


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

    - code (B,): place of each item's status among those of `Status`; `status` spells it out.
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
        counts = ", ".join(f"{n} {status.name.lower()}" for status, n in self.counts.items())
        return f"Batch({len(self)} items: {counts or 'none'})"

    @property
    def converged(self) -> np.ndarray:
        """(B,) whether force and moment balance within the tolerance."""
        return self.code == DONE

    @cached_property
    def status(self) -> np.ndarray:
        """(B,) objects: a `Status`."""
        return _frozen(np.array(STATUSES, dtype=object)[self.code])

    @property
    def counts(self) -> dict[Status, int]:
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


def _fractions(points: int | Sequence[float] | np.ndarray | None) -> np.ndarray:
    if points is None:
        return np.empty(0)
    if np.ndim(points) == 0:
        return np.linspace(0.0, 1.0, whole("points", points, 2))
    fractions = numbers("points", points)
    if not fractions.size:
        raise InvalidInput("points", points, "one or more fractions of the exposed length, or None")
    check_range("points", fractions, 0.0, 1.0)
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
