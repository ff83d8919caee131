"""`Work`: one batch under way, its threads and the arrays that they fill."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from functools import cache

import numpy as np

from .batch_inputs import Inputs
from .shape import Shape, Status
from .solution import CONVERGED, PATIENCE, RETRACTED, START_CAPACITY, TOO_SMALL, compiled

STATUSES = tuple(Status)  # the codes of a batch count through these
DONE, WAITING = STATUSES.index(Status.CONVERGED), STATUSES.index(Status.NOT_REACHED)
NOTICE = "tendonrod: compiling the loop over batches, a few seconds, once per installation"
CHUNK, MOST_ROWS = 128, 8192  # items, and sampled points, that a thread solves in one go
ROOM = 2048  # steps for which a thread keeps room; an item that needs more is solved alone
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
FACTS = ("code", "load_factor", "residual", "error_estimate", "steps")


class _Space:
    """What one thread works in: room for the solution of one item and for the results of one chunk."""

    def __init__(self, chunk: int, n_tendons: int, k: int, scratch: int) -> None:
        self.tendons, self.state, self.at = np.empty((n_tendons, 7)), np.empty(2 * (40 * ROOM + 19)), np.empty(k)
        self.jacobian, self.scratch = np.empty((3, 3)), np.empty(scratch)
        self.tips, self.rows, self.facts = np.empty((chunk, 12)), np.empty((chunk, k, 24)), np.empty((chunk, 8))


class Work:
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

    def facts(self) -> dict[str, np.ndarray]:
        """What is known of every item, by name; all arrays are read-only from now on."""
        facts = {name: getattr(self, name) for name in FACTS}
        for array in (*facts.values(), *self.arrays.values(), self.fractions):
            array.setflags(write=False)
        return facts

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
        loop = kernel.sampled_equilibria if self.sampled.size else kernel.equilibria
        reached = loop(
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
