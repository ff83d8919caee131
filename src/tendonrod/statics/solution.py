"""`Solution`: the arrays of one kernel call, and what can be asked of them afterwards; layout in `kernel`."""

from __future__ import annotations

import sys
import tempfile
import threading
from importlib import import_module
from math import inf
from types import ModuleType

import numpy as np

CONVERGED, LOCAL_FAILED, STALLED, TOO_SMALL = 0, 1, 2, 3  # the kernel's codes; it is imported only when needed
START_CAPACITY, MOST_STEPS = 24, 20_000
NOTICE = "tendonrod: compiling {}, about {} s, once per installation"
LONG, COARSEST = 0.05, 3e-6  # m below which a length's share counts; of the length: else a shape fails its own balance
RETRACTED = 1e-200  # m of exposed length below which nothing is exposed
PATIENCE = 2.0  # s after which loading a kernel must be compiling it
_kernels: dict[str, ModuleType] = {}


def compiled() -> ModuleType:
    """The shooting kernel, compiled; says so on standard error when that has to be done first."""
    return _kernels.get("kernel") or _compiled("kernel", "the statics kernel", 20)


def compiled_newton() -> ModuleType:
    """The kernel of Newton's method in the strains, likewise."""
    return _kernels.get("kernel_newton") or _compiled("kernel_newton", "the kernel for contact and general loads", 40)


def _compiled(name: str, what: str, seconds: int) -> ModuleType:
    notice = threading.Timer(PATIENCE, print, [NOTICE.format(what, seconds)], {"file": sys.stderr, "flush": True})
    notice.daemon = True
    notice.start()
    try:
        kernel = _import(name)
        kernel.compile_all()
    finally:
        notice.cancel()
    _kernels[name] = kernel
    return kernel


def _import(name: str) -> ModuleType:
    from numba.core import config

    try:
        return import_module(f".{name}", __package__)
    except RuntimeError:  # neither the package's folder nor the user's can be written: keep the code for this process
        config.CACHE_DIR = tempfile.mkdtemp(prefix="tendonrod-")  # pyright: ignore[reportAttributeAccessIssue]
        return import_module(f".{name}", __package__)


def worked_accuracy(accuracy: float, length: float) -> float:
    """Accuracy (m) that is worked with: as asked for, but never more than a small share of the exposed length (m)."""
    return max(1e-12, min(accuracy * min(1.0, length / LONG), COARSEST * length))


class Solution:
    """A rod's problem in arrays and, once `run`, its solution.

    rod (13,), tendons (n, 7), problem (30,): what is asked; asked: see `problem.request`; pull (4,): see the kernel's
    `haul`. state, jacobian (3, 3), stats (8,): what comes of it.
    """

    __slots__ = ("asked", "code", "jacobian", "problem", "pull", "rod", "state", "stats", "tendons")

    def __init__(
        self, rod: np.ndarray, tendons: np.ndarray, problem: np.ndarray, asked: tuple | None = None,
        pull: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        self.rod, self.tendons, self.problem, self.asked, self.pull = rod, tendons, problem, asked, pull
        self.stats, self.jacobian, self.code = np.zeros(8), np.empty((3, 3)), -1
        self.state = np.empty(0)

    @property
    def length(self) -> float:
        """Exposed length of the neutral axis, m."""
        return float(self.problem[12])

    @property
    def s_exit(self) -> float:
        """Material coordinate of the exit, m."""
        return float(self.problem[13])

    @property
    def tensions(self) -> np.ndarray:
        """(n_tendons,) at the exit, N."""
        return self.tendons[:, 6]

    @property
    def accuracy(self) -> float:
        """Position error asked for, m."""
        return float(self.problem[26])

    @property
    def loaded(self) -> bool:
        """Whether any load acts, weight included."""
        return bool(self.problem[:12].any())

    @property
    def residual(self) -> float:
        """Moment left over at the tip, in units of EI / length of the softest stiffness."""
        return float(self.stats[0])

    @property
    def iterations(self) -> int:
        """Trial base moments, over all grids."""
        return int(self.stats[1])

    @property
    def error(self) -> float:
        """Estimated position error (m); NaN where nothing is known of it."""
        unknown = self.problem[27] > 0.0 and self.iterations > 0
        return float("nan") if unknown else float(self.stats[6])

    @property
    def strains(self) -> np.ndarray:
        """(2 steps, 6) strains of the stages."""
        at = self.half * (self.state.size // 2) + 16 * (self._capacity + 1)
        return self.state[at : at + 12 * self.steps].reshape(-1, 6)

    @property
    def steps(self) -> int:
        """Steps of the integrator in the solution."""
        return int(self.stats[4])

    @property
    def half(self) -> int:
        """Which half of the state holds the solution."""
        return int(self.stats[5])

    @property
    def grid(self) -> np.ndarray:
        """(steps + 1,) arc lengths of the nodes, m."""
        at = self.half * (self.state.size // 2)
        return self.state[at : at + self.steps + 1]

    @property
    def nodes(self) -> np.ndarray:
        """(steps + 1, 3) positions of the nodes, m."""
        at = self.half * (self.state.size // 2) + self._capacity + 1
        return self.state[at : at + 12 * (self.steps + 1)].reshape(-1, 12)[:, :3]

    @property
    def _capacity(self) -> int:
        return (self.state.size // 2 - 19) // 40

    def run(self, start: Solution | None = None) -> int:
        """Solve, from ``start`` if given, with as much room as it takes. Returns and keeps the kernel's code."""
        if self.length < RETRACTED:
            return self._retract()
        kernel, spare = compiled(), 2 * len(self.tendons) + 2
        capacity = max(START_CAPACITY, int(self.problem[27]) + spare, start.steps + spare if start else 0)
        scratch = np.empty(kernel.SCRATCH)
        while True:
            self.state = np.empty(2 * (40 * capacity + 19))
            if start is not None:
                self._take_over(start)
            arrays = self.rod, self.tendons, self.problem, self.state, self.jacobian, self.stats, scratch
            self.code = kernel.equilibrium(*arrays) if self.pull is None else kernel.haul(*arrays, self.pull)
            if self.code != TOO_SMALL or self.steps > MOST_STEPS:
                return self.code
            capacity = self.steps + spare

    def line_force(self, at: np.ndarray) -> np.ndarray:
        """(n, 3) dead force per metre at arc lengths ``at``, weight included, N/m."""
        return np.tile(self.problem[6:9], (at.size, 1))

    def scaled(self, load: float, tension: float, steps: int) -> Solution:
        """The same problem, unsolved, with loads and tensions multiplied and at least so many steps."""
        problem, tendons = self.problem.copy(), self.tendons.copy()
        problem[:12] *= load
        tendons[:, 6] *= tension
        problem[27] = max(steps, int(problem[27]))
        pull = None if self.pull is None else self.pull * np.array([1.0, tension, 1.0, 1.0])
        return Solution(self.rod, tendons, problem, self.asked, pull)

    def again(self, steps: int | None = None) -> Solution:
        """The same problem, unsolved; with a fixed number of steps where it is given."""
        copy = Solution(self.rod, self.tendons.copy(), self.problem.copy(), self.asked, self.pull)
        if steps is not None:
            copy.problem[27] = steps
        return copy

    def rows(self, at: np.ndarray) -> np.ndarray:
        """(n, 24) read-only rows p[3] R[9] v[3] u[3] N[3] M[3] at arc lengths ``at`` (n,), m."""
        kernel, rows = compiled(), np.empty((at.size, 24))
        where = self.rod, self.tendons, self.problem, self.state, self.half, self.steps
        kernel.sample(*where, at, 0.05 * self.problem[26], rows, np.empty(kernel.SCRATCH))
        rows.setflags(write=False)
        return rows

    @property
    def is_driven(self) -> bool:
        """Whether a tendon is pulled by length."""
        return self.pull is not None

    def is_stable(self) -> bool | None:
        """Whether the second variation is positive (docs/method); None where moments act, which have no potential."""
        if self.length < RETRACTED:
            return True
        kernel = compiled()
        if not kernel.conservative(self.problem[:12]):
            return None
        where = self.rod, self.tendons, self.problem, self.state, self.half, self.steps
        return kernel.stability(*where, np.empty(kernel.SCRATCH)) > 0

    def _take_over(self, start: Solution) -> None:
        """Copy the solution of ``start`` into the first half, as the kernel expects a neighbour's."""
        n, old, new = start.steps, start._capacity, self._capacity
        at, to = start.half * (start.state.size // 2), 0
        for width, last in ((1, 1), (12, 12), (3, 3), (12, 0), (12, 3)):  # grid, frames, moments, strains, start
            self.state[to : to + width * n + last] = start.state[at : at + width * n + last]
            to += width * new + last
            at += width * old + last
        self.jacobian[:] = start.jacobian
        if self.pull is not None:
            driven = int(self.pull[0])
            self.tendons[driven, 6] = start.tendons[driven, 6]
        self.problem[28], self.problem[29] = n, start.stats[6] or inf

    def _retract(self) -> int:
        """A fully retracted robot: two nodes at the exit, so close that they are one."""
        self.state, self.code = np.zeros(2 * (40 + 19)), CONVERGED
        self.state[1] = 1e-30
        self.state[2:14] = self.state[14:26] = self.problem[14:26]
        self.state[26:29] = self.state[29:32] = self.problem[3:6]
        self.state[32:38] = self.state[38:44] = self.rod[6:12]
        self.stats[:] = 0.0
        self.stats[4] = 1.0
        self.jacobian[:] = np.eye(3)
        return self.code
