"""`Curve`: equilibria along a parameter by pseudo-arclength continuation (docs/method).

Unknowns are the strains x, the tensions of tendons that are pulled by length, and the parameter t. Distances combine
the share of the parameter's interval and the root mean square of turning (rad) and stretching. Predictor: the tangent.
Corrector: Newton in the plane across it, with two right hand sides for the rod's one factorisation. Source: H. B.
Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidInput
from .branch_points import Place, Point, State, Way
from .problem import RodProblem
from .second_variation import Linear
from .trial import Trial

if TYPE_CHECKING:
    from .newton import NewtonSolution
    from .solution import Solution

LEAST_STEP = 1e-7
CORRECTIONS = 8
BALANCED, ALMOST = 1e-11, 1e-8  # last correction: to be met, and enough where rounding holds it up
LARGEST_ANGLE, SMALL_ANGLE = 0.4, 0.12  # rad between tangents: above, the step is halved; below, it grows
LOCATED = 1e-9  # of a step: how well folds and bifurcations are located
BESIDE = 1e-3  # of a step: where the directions on both sides of a fold are counted

Progress = Callable[[int, float], object]


@dataclass(frozen=True)
class Family:
    """problem(t); sides(t): (changed up, changed down or None for unchanged, size of the difference)."""

    problem: Callable[[float], RodProblem]
    sides: Callable[[float], tuple[RodProblem, RodProblem | None, float]]


def by_difference(problem: Callable[[float], RodProblem], half: float) -> Family:
    """A family of problems, differentiated by central differences."""
    return Family(problem, lambda t: (problem(t + half), problem(t - half), 2.0 * half))


def carried_over(solution: Solution | NewtonSolution, problem: RodProblem, n: int) -> Trial:
    """A solution's strains, and tensions of tendons pulled by length, on an even grid of about ``n`` steps."""
    trial = Trial(problem, problem.grid(n))
    trial.begin(getattr(solution, "trial", solution))
    if trial.strands is not None:
        trial.tensions[trial.strands.driven] = solution.tensions[trial.strands.driven]
        trial.place()
    return trial


class Curve:
    """One family of problems on one grid."""

    def __init__(self, family: Family, trial: Trial, low: float, high: float) -> None:
        self.family, self.first, self.low, self.high = family, trial, low, high
        length = trial.problem.length
        self.marks = _marks(trial.problem)
        self.weight = (trial.weights / length)[:, None] * np.array([1.0, 1.0, 1.0, *3 * [length**2]])
        self.driven = trial.strands.driven if trial.strands is not None else np.empty(0, dtype=int)

    def dot(self, a: State, b: State) -> float:
        """Inner product of two differences of states."""
        return float((self.weight * a.x * b.x).sum()) + a.t * b.t / (self.high - self.low) ** 2

    def trial(self, state: State, problem: RodProblem | None = None) -> Trial:
        """The rod with these strains, here or in a neighbouring problem; its steps move with joints and loads."""
        problem = self.family.problem(state.t) if problem is None else problem
        marks = _marks(problem)
        if len(marks) != len(self.marks):
            raise InvalidInput("parameter", state.t, "one that neither exposes nor hides a joint or a load")
        trial = Trial(problem, np.interp(self.first.grid, self.marks, marks))
        trial.x[:] = state.x
        if self.driven.size:
            trial.tensions[self.driven] = np.maximum(state.tau[self.driven], 0.0)
            trial.place()
        trial.walk()
        return trial

    def answer(self, linear: Linear, state: State) -> tuple[State, np.ndarray]:
        """(derivative of strains and tensions by the parameter, that of the tip)."""
        up, down, size = self.family.sides(state.t)
        high, low = self.trial(state, up), linear.trial if down is None else self.trial(state, down)
        missing = 0.0
        if high.strands is not None and low.strands is not None:
            high.strands.along(high, high.x)
            low.strands.along(low, low.x)
            missing = (high.strands.missing(high) - low.strands.missing(low)) / size
        strain, tau, tip = linear.solve((high.left - low.left) / size, missing)
        return State(strain, tau, 1.0), tip + (_tip(high) - _tip(low)) / size

    def corrected(self, guess: State, towards: State, origin: State | None = None, at: float = 0.0) -> Point | None:
        """The balanced point near ``guess``: at its parameter, or across ``towards`` at a distance from ``origin``.

        The tangent points to the side of ``towards``.
        """
        state, before = guess, inf
        for iteration in range(1, CORRECTIONS + 1):
            linear = Linear(self.trial(state))
            strain, tau, _ = linear.solve(linear.trial.left, linear.missing if self.driven.size else 0.0)
            by = State(strain, tau, 0.0)
            if origin is not None:
                along, _ = self.answer(linear, state)
                off = self.dot(towards, state.plus(-1.0, origin)) - at
                by = by.plus(-(off + self.dot(towards, by)) / self.dot(towards, along), along)
            size = np.sqrt(self.dot(by, by))
            if not size < 2.0:
                return None
            state = State(state.x + by.x, np.maximum(state.tau + by.tau, 0.0), state.t + by.t)
            if size < BALANCED or (size < ALMOST and size > 0.25 * before):
                return self.point(state, towards, iteration)
            before = size
        return None

    def point(self, state: State, towards: State, iterations: int) -> Point:
        """What is known of a balanced state."""
        linear = Linear(self.trial(state))
        along, tip_by = self.answer(linear, state)
        unit = np.copysign(1.0 / np.sqrt(self.dot(along, along)), self.dot(along, towards))
        tangent = State(unit * along.x, unit * along.tau, unit)
        trial = linear.trial
        tip = _tip(trial)
        return Point(
            state.x, state.tau, state.t, tangent, tip, unit * tip_by, linear.negative, self._energy(trial), iterations
        )

    def at(self, p: Point, s: float) -> Point | None:
        """The point of the branch in the plane across the tangent of ``p``, at the distance ``s`` from it."""
        try:
            return self.corrected(p.plus(s, p.tangent), p.tangent, p, s)
        except InvalidInput:
            return None

    def _energy(self, trial: Trial) -> float:
        if not self.driven.size:
            return trial.energy
        strands, tau = trial.strands, trial.tensions
        path = trial.weights @ np.linalg.norm(strands.q, axis=2)  # pyright: ignore[reportOptionalMemberAccess]
        stored = 0.5 * strands.stretch(trial) * tau**2 - tau * path  # pyright: ignore[reportOptionalMemberAccess]
        return trial.energy + float(stored[self.driven].sum())

    # ---- along it

    def follow(self, t: float, sense: float, largest: float, most: int, progress: Progress) -> Way:
        """Points from the trial's at ``t`` on, towards larger t or smaller (sense -1), until t leaves the interval."""
        first = self.begin(t, sense)
        if first is None:
            return Way([], "the start could not be balanced on the grid of the branch")
        way, ds = Way([Place(first)], "as many points as allowed"), 0.5 * largest
        while way.count < most:
            p = way.places[-1].point
            q, angle = self._next(p, ds)
            if q is None:
                ds *= 0.5
                if ds < LEAST_STEP:
                    way.ended = "no neighbouring equilibrium was found; a joint or a load may have passed the exit"
                    break
                continue
            q, ds, left = self._held_inside(p, q, ds)
            way.places += [*self._events(p, q, ds), Place(q)]
            progress(way.count, q.t)
            if left:
                way.ended = "the parameter reached the end of its interval"
                break
            ds = min(largest, ds * (1.5 if angle < SMALL_ANGLE and q.iterations <= 4 else 0.8 if angle > 0.25 else 1.0))
        return way

    def begin(self, t: float, sense: float) -> Point | None:
        """The first trial, balanced."""
        x, tau = self.first.x, self.first.tensions
        return self.corrected(State(x, tau, t), State(0.0 * x, 0.0 * tau, sense))

    def ahead(self, t: float, largest: float, most: int) -> Place | None:
        """The first fold from the trial's ``t`` on to larger t, or the interval's end; None if neither is found."""
        p, ds = self.begin(t, 1.0), 0.5 * largest
        if p is None:
            return None
        for _ in range(most):
            q, bent = self._next(p, ds)
            if q is None:
                ds *= 0.5
                if ds < LEAST_STEP:
                    return None
                continue
            q, ds, left = self._held_inside(p, q, ds)
            if left:
                return Place(q)
            if q.tangent.t < 0.0:
                return Place(self._turn(p, ds)[0], "fold")
            p, ds = q, min(largest, 1.5 * ds) if bent < SMALL_ANGLE else ds
        return None

    def _next(self, p: Point, ds: float) -> tuple[Point | None, float]:
        """(point at the distance ``ds``, None where the branch is lost or bends too much, angle it bends by)."""
        q = self.at(p, ds)
        angle = inf if q is None else float(np.arccos(min(1.0, self.dot(p.tangent, q.tangent))))
        return (q if angle <= LARGEST_ANGLE else None), angle

    def _held_inside(self, p: Point, q: Point, ds: float) -> tuple[Point, float, bool]:
        """(``q``, its distance, False); where t leaves its interval on the way: (that place, its distance, True)."""
        if self.low <= q.t <= self.high and p.tangent.t * q.tangent.t < 0.0:
            fold, s = self._turn(p, ds)
            if not self.low <= fold.t <= self.high:
                return *self._edge(p, fold, s), True
        return (q, ds, False) if self.low <= q.t <= self.high else (*self._edge(p, q, ds), True)

    def _edge(self, p: Point, q: Point, ds: float) -> tuple[Point, float]:
        """(point at the end of the interval that lies between ``p`` and ``q``, its distance from p)."""
        edge = self.low if q.t < self.low else self.high
        low, high, beyond = 0.0, ds, q
        for _ in range(30):
            middle = low + (high - low) * min(0.9, max(0.1, (edge - p.t) / (beyond.t - p.t) if low == 0.0 else 0.5))
            found = self.at(p, middle)
            if found is None:
                break
            if self.low <= found.t <= self.high:
                low = middle
            else:
                high, beyond = middle, found
            exact = self.corrected(State(found.x, found.tau, edge), towards=found.tangent)
            away = 2.0 * ds if exact is None else np.sqrt(self.dot(exact.plus(-1.0, p), exact.plus(-1.0, p)))
            if exact is not None and away < 1.5 * ds and self.dot(exact.tangent, p.tangent) > 0.8:
                return exact, self.dot(exact.plus(-1.0, p), p.tangent)
        return beyond, high

    def _events(self, p: Point, q: Point, ds: float) -> list[Place]:
        """Folds and bifurcations between ``p`` and ``q``, which lies at the distance ``ds``."""
        if p.tangent.t * q.tangent.t >= 0.0:
            return self._bifurcations(p, 0.0, ds, p.negative, q.negative)
        fold, s = self._turn(p, ds)
        before, after = (self.at(p, s - BESIDE * ds) or p).negative, (self.at(p, s + BESIDE * ds) or q).negative
        places = self._bifurcations(p, 0.0, s - BESIDE * ds, p.negative, before)
        places.append(Place(fold, "fold", (before, after)))
        return places + self._bifurcations(p, s + BESIDE * ds, ds, after, q.negative)

    def _turn(self, p: Point, ds: float) -> tuple[Point, float]:
        """(the fold between ``p`` and the point at the distance ``ds``, its distance): where the parameter turns."""
        from scipy.optimize import brentq

        def slope(s: float) -> float:
            found = self.at(p, s)
            return 0.0 if found is None else found.tangent.t / abs(p.tangent.t)

        s = float(brentq(slope, 0.0, ds, xtol=LOCATED * ds, rtol=1e-14))  # pyright: ignore[reportArgumentType]
        return self.at(p, s) or p, s

    def _bifurcations(self, p: Point, low: float, high: float, before: int, after: int) -> list[Place]:
        """Where the number of unstable directions changes between two distances from ``p``, by bisection."""
        found: list[Place] = []
        while self._differ(before, after):
            start, end, beyond, last = low, high, after, None
            while end - start > LOCATED * high:
                middle = self.at(p, 0.5 * (start + end))
                if middle is None:
                    return found
                if self._differ(middle.negative, before):
                    end, beyond, last = 0.5 * (start + end), middle.negative, middle
                else:
                    start = 0.5 * (start + end)
            last = last or self.at(p, end)
            if last is None:
                return found
            found.append(Place(last, "bifurcation", (before, beyond)))
            low, before = end, beyond
        return found

    def _differ(self, one: int, other: int) -> bool:
        """Whether directions change sides between the counts; without a potential, the determinant its sign."""
        return one != other if self.first.problem.conservative else (one - other) % 2 != 0


def _marks(problem: RodProblem) -> np.ndarray:
    """Arc lengths of the base, of joints, breaks, point loads and ends of loads that are exposed, and of the tip, m."""
    return problem.grid(0)


def _tip(trial: Trial) -> np.ndarray:
    return trial.end[-1, :3] + trial.problem.frame[:3]
