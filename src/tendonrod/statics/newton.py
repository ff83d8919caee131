"""`NewtonSolution`: any rod under any load, by Newton's method in the strains; mathematics in `kernel_newton`."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, nan

import numpy as np

from .actuation import ROUNDS
from .contact import Contacts, approach, press
from .problem import RodProblem
from .solution import CONVERGED, LOCAL_FAILED, MOST_STEPS, STALLED, TOO_SMALL, Solution
from .trial import Trial

FIRST_STEPS, CONTACT_STEPS = 10, 20
AT_ONCE = 0.15  # of the length: motion of the tip by the loads that a cold start may find at once


@dataclass(eq=False)
class NewtonSolution:
    """A rod's problem and, once `run`, its solution; the same questions can be asked of it as of a `Solution`."""

    problem: RodProblem
    trial: Trial = field(init=False, repr=False)
    code: int = -1
    iterations: int = 0
    error: float = nan
    most_looks: float = inf  # at the surface, on each grid; see `contact.press`

    def run(self, start: NewtonSolution | Solution | None = None) -> int:
        """Solve, from ``start`` if given. Returns and keeps the kernel's code."""
        p, first = self.problem, FIRST_STEPS if self.problem.request.surface is None else CONTACT_STEPS
        steps = p.steps or (max(first, start.steps // 2) if start else first)
        self.trial = trial = self._trial(steps, self._kinks_before)
        if start is not None:
            trial.begin(start.trial if isinstance(start, NewtonSolution) else start)
        elif not trial.rest():
            return self._ended(LOCAL_FAILED)
        elif p.request.surface is not None:  # most of the way on a coarse grid
            dead = p if p.conservative else p.dead()  # the rest turns a shape that has found its side
            coarse = Trial(dead, p.grid(steps // 2 or 1))
            if coarse.rest() and (
                press(coarse, self._goal) > 0 or (coarse.rest() and approach(coarse, self._goal) > 0)
            ):
                trial.begin(coarse)
        code = self._kinked(steps, start is None)
        while code == CONVERGED and not p.steps and not self.error <= self._goal:
            coarse, steps = self.trial, 2 * steps
            if 2 * coarse.n > MOST_STEPS:
                return self._ended(TOO_SMALL)
            self.trial = Trial(p, _halved(coarse.grid), coarse.kinks)
            self.trial.begin(coarse)
            code = self._kinked(steps, False)
            self.error = coarse.distance(self.trial) / 7.0 if self.trial.contact is None else self._touching(coarse)
        return self._ended(code)

    def _touching(self, coarse: Trial) -> float:
        """Error of a shape in contact, without bound where it enters the surface between the stages."""
        contact, tolerance = self.trial.contact, self.problem.request.contact_tolerance
        deep = contact is not None and contact.deepest(self.trial) > tolerance
        return inf if deep else coarse.distance(self.trial)

    @property
    def _kinks_before(self) -> np.ndarray:
        """Arc lengths where the tensions before have their kinks."""
        history = self.problem.request.history
        return np.zeros(0) if history is None else history.kinks - self.s_exit

    def _trial(self, steps: int, kinks: np.ndarray) -> Trial:
        inside = kinks[(kinks > 0.0) & (kinks < self.length)]
        return Trial(self.problem, self.problem.grid(steps, inside + self.s_exit), inside)

    def _kinked(self, steps: int, cold: bool) -> int:
        """Balance on a grid with nodes where slip meets stick."""
        code, trial = self._driven(self.trial, cold), self.trial
        if code == CONVERGED and trial.strands is not None and trial.strands.held is not None:
            kinks = np.concatenate([self._kinks_before, trial.strands.kinks(trial)])
            self.trial = self._trial(steps, np.unique(kinks))
            self.trial.begin(trial)
            code = self._driven(self.trial, False)
        return code

    @property
    def _goal(self) -> float:
        """Position error to be met, m: contact limits it, since its ends lie between the stages."""
        asked = self.problem.request
        return self.accuracy if asked.surface is None else max(self.accuracy, asked.contact_tolerance)

    def _driven(self, trial: Trial, cold: bool) -> int:
        """Balance, and tensions that agree with the pulled lengths and with friction."""
        code, moved = self._settled(trial, cold), inf
        for _ in range(ROUNDS if trial.strands is not None else 0):
            if code != CONVERGED or moved < 0.02 * self._goal:
                return code
            moved = trial.strands.update(trial)  # pyright: ignore[reportOptionalMemberAccess]
            code = self._settled(trial, False)
        return code if trial.strands is None or moved < self._goal else STALLED

    def _settled(self, trial: Trial, cold: bool) -> int:
        p = self.problem
        if p.request.surface is not None:
            count = press(trial, 0.05 * self._goal, self.most_looks)
            self.iterations += abs(count)
            return CONVERGED if count > 0 else STALLED
        if cold:
            trial.walk()
        tip = trial.end[-1, :3].copy()
        count = trial.settle(0.05 * p.request.accuracy)
        self.iterations += abs(count)
        if count <= 0:
            return STALLED
        if cold and p.loaded:
            far = np.linalg.norm(trial.end[-1, :3] - tip) > AT_ONCE * p.length
            if far or (p.conservative and trial.factor() > 0):
                return STALLED  # the answer may lie on another branch: let continuation find the way there
        return CONVERGED

    def _ended(self, code: int) -> int:
        self.code = code
        return code

    @property
    def residual(self) -> float:
        """Largest imbalance of a stage, in units of EI / length of the softest stiffness."""
        if not hasattr(self, "trial"):
            return inf
        return float(np.abs(self.trial.left[:, 3:]).max() * self.length / self.trial.station[:, 3:6].min())

    @property
    def length(self) -> float:
        """Exposed length of the neutral axis, m."""
        return self.problem.length

    @property
    def s_exit(self) -> float:
        """Material coordinate of the exit, m."""
        return self.problem.s_exit

    @property
    def tensions(self) -> np.ndarray:
        """(n_tendons,) at the exit, N."""
        return self.trial.tensions if hasattr(self, "trial") else self.problem.tensions

    @property
    def accuracy(self) -> float:
        """Position error asked for, m."""
        return self.problem.request.accuracy

    @property
    def loaded(self) -> bool:
        """Whether any load acts, weight included."""
        return self.problem.loaded

    @property
    def steps(self) -> int:
        """Steps of the integrator in the solution."""
        return self.trial.n

    @property
    def grid(self) -> np.ndarray:
        """(steps + 1,) arc lengths of the nodes, m."""
        return self.trial.grid.copy()

    @property
    def kinks(self) -> np.ndarray:
        """Arc lengths where tensions bend because slip meets stick, m."""
        return self.trial.kinks

    @property
    def strains(self) -> np.ndarray:
        """(2 steps, 6) strains of the stages."""
        return self.trial.x

    @property
    def nodes(self) -> np.ndarray:
        """(steps + 1, 3) positions of the nodes, m."""
        return np.vstack([np.zeros(3), self.trial.end[:, :3]]) + self.problem.frame[:3]

    def scaled(self, load: float, tension: float, steps: int) -> NewtonSolution:
        """The same problem, unsolved, with loads and tensions multiplied and at least so many steps."""
        return NewtonSolution(self.problem.scaled(load, tension, steps))

    def again(self, steps: int | None = None) -> NewtonSolution:
        """The same problem, unsolved; with a fixed number of steps where it is given."""
        problem = self.problem if steps is None else self.problem.with_steps(steps)
        return NewtonSolution(problem)

    @property
    def is_driven(self) -> bool:
        """Whether a tendon is pulled by length."""
        return bool((~np.isnan(self.problem.pulled)).any())

    def is_stable(self) -> bool | None:
        """Whether the energy's Hessian is positive definite at these tensions; None where loads have no potential."""
        return self.trial.factor() == 0 if self.problem.conservative else None

    @property
    def contacts(self) -> Contacts | None:
        """Where the robot touches the surface; None without one."""
        return None if self.trial.contact is None else self.trial.contact.found()

    def line_force(self, at: np.ndarray) -> np.ndarray:
        """(n, 3) dead force per metre at arc lengths ``at``, weight included, N/m."""
        return self.trial.line_force(at)

    def rows(self, at: np.ndarray) -> np.ndarray:
        """(n, 24) read-only rows p[3] R[9] v[3] u[3] N[3] M[3] at arc lengths ``at`` (n,), m."""
        return self.trial.rows(at)


def _halved(grid: np.ndarray) -> np.ndarray:
    finer = np.empty(2 * len(grid) - 1)
    finer[::2], finer[1::2] = grid, 0.5 * (grid[:-1] + grid[1:])
    return finer
