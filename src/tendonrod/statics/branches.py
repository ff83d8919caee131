"""`follow_branch`: the equilibria along one parameter, through folds; the mathematics is in `arclength`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Fact, InvalidInput, finite, nonnegative, positive, vector, whole
from .arclength import Curve, Family, carried_over
from .branch_points import Point, Way
from .inputs import LINEAR, change, named, numbers_of, sides, value_of
from .newton import NewtonSolution
from .problem import Request, RodProblem, problem_of, rod_problem
from .shape import Shape, Status
from .solution import CONVERGED, MOST_STEPS

if TYPE_CHECKING:
    from ..robot import Robot

STEP = 0.08  # along the branch
FEWEST_STEPS = 40  # of the integrator
DIFFERENCE = 1e-5  # of the interval, of central differences by a callable's parameter
GIVEN = (*LINEAR, "tensions", "insertion", "rotation", "loads")


@dataclass(frozen=True, kw_only=True, eq=False)
class Critical:
    """A place of a branch where a direction changes between stable and unstable.

    parameter; tip (3,) m; index: number of the point in the `Branch`; negative: number of unstable directions just
    before and just after, None where the loads have no potential.
    """

    parameter: float
    tip: np.ndarray
    index: int
    negative: tuple[int, int] | None


class Fold(Critical):
    """Where the parameter turns round: beyond it this branch has no equilibrium."""


class Bifurcation(Critical):
    """Where directions become unstable, or stable again, without a turn: another branch crosses, as at Euler's load."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """Equilibria in order, from the start; SI, world frame, arrays read-only. Folds and bifurcations are points of it.

    - robot; name of the parameter; ended: a sentence that says why the branch goes no farther.
    - parameter (k,); tip (k, 3) m; arclength (k,), from the start, dimensionless.
    - slope (k,) and tip_slope (k, 3): derivatives of parameter and tip by arclength; slope is 0 at a fold.
    - negative (k,): number of directions in which the energy falls, tendons pulled by length held at that length;
      stable (k,): whether there is none, False at a fold or bifurcation. None where the loads have no potential.
    - energy (k,) J: rod, loads and tendons, those pulled by length with what they store; None as above.
    - folds, bifurcations: in order.
    """

    robot: Robot
    name: str
    parameter: np.ndarray
    tip: np.ndarray
    arclength: np.ndarray
    slope: np.ndarray
    tip_slope: np.ndarray
    negative: np.ndarray | None
    stable: np.ndarray | None
    energy: np.ndarray | None
    folds: tuple[Fold, ...]
    bifurcations: tuple[Bifurcation, ...]
    ended: str
    _points: tuple[Point, ...] = field(repr=False)
    _curve: Curve = field(repr=False)

    def __repr__(self) -> str:
        events = f"{len(self.folds)} folds, {len(self.bifurcations)} bifurcations"
        return f"Branch({self.robot.name} by {self.name}, {len(self)} points, {events}, ended: {self.ended})"

    def __len__(self) -> int:
        return len(self.parameter)

    def shape(self, index: int) -> Shape:
        """The `Shape` of one point, reported at the integrator's nodes. Raises `InvalidInput`."""
        index = whole("index", index, -len(self), len(self) - 1)
        trial = self._curve.trial(self._points[index])
        solution = NewtonSolution(trial.problem.with_steps(trial.n))
        solution.trial, solution.code = trial, CONVERGED
        s = trial.grid.copy()
        s.setflags(write=False)
        return Shape(
            robot=trial.problem.robot, s=s, status=Status.CONVERGED, load_factor=1.0, _rows=solution.rows(s),
            _solution=solution,
        )  # fmt: skip


def follow_branch(
    start: Shape,
    parameter: str | Callable[[float], Mapping[str, Any]],
    stop: float | Sequence[float],
    *,
    begin: float = 0.0,
    step: float | None = None,
    most: int = 400,
    steps: int | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> Branch:
    """The branch of equilibria through ``start`` as one parameter changes, through folds, until the parameter leaves.

    - start: a solved `Shape`, without friction or a surface.
    - parameter: one number named as for `Shape.jacobian`, such as "tip_force[2]", "tensions[0]", "insertion"; or a
      function of t that gives arguments of `solve`, such as ``lambda t: {"tip_force": (sin(t), 0, -cos(t))}``, of
      gravity, tip_force, tip_moment, distributed_force, distributed_moment, tensions, insertion, rotation, loads; at
      ``begin`` it must give those of ``start``. exit_rotation counts from the start.
    - stop: where the parameter ends; or (a, b): the branch sets off towards b and ends where it leaves the interval at
      either end. For both sides of the start call twice. Draw it with `tendonrod.plot.branches.branch_figure`.
    - step: largest step along the branch, measured by the share of the interval and by the rod's root mean square
      turning (rad) together, 0.08 if None; two events closer than a step may hide each other.
    - most: points at most, folds and bifurcations not counted.
    - steps: of the integrator, the same all along; twice the start's and at least 40 if None.
    - progress: called with (number of points, parameter) after each.

    Raises `InvalidInput` by name.
    """
    if not isinstance(start, Shape):
        raise InvalidInput("start", start, "a Shape")
    start._must_be_solved("start")
    asked = problem_of(start._solution).request
    if asked.surface is not None or asked.robot.friction.any():
        raise InvalidInput("start", Fact("a shape with friction or a surface"), "one without, whose branch is smooth")
    largest = STEP if step is None else positive("step", step)
    most = whole("most", most, 2)
    n = whole("steps", max(FEWEST_STEPS, 2 * start.steps) if steps is None else steps, 1, MOST_STEPS)
    if isinstance(parameter, str):
        (stem, i, *_), *others = numbers_of(asked, parameter)
        name = named(stem, i)
        if others:
            raise InvalidInput("parameter", parameter, f"one number, such as {name}")
        t = value_of(asked, name)
        low, high, sense = _interval(stop, t)
        family = _named(asked, name, t)
    elif callable(parameter):
        name, t = "t", finite("begin", begin)
        low, high, sense = _interval(stop, t)
        family = _given(asked, parameter, t, DIFFERENCE * (high - low))
    else:
        raise InvalidInput("parameter", parameter, "the name of an input or a function of one number")
    trial = carried_over(start._solution, family.problem(t), n)
    curve = Curve(family, trial, low, high)
    way = curve.follow(t, sense, largest, most, progress or _silent)
    if not way.places:
        raise InvalidInput("start", start, f"one that can be balanced with {n} steps; give others by steps=")
    return _branch(curve, way, name)


def _branch(curve: Curve, way: Way, name: str) -> Branch:
    points = tuple(place.point for place in way.places)
    known = curve.first.problem.conservative
    gaps = [np.sqrt(curve.dot(b.plus(-1.0, a), b.plus(-1.0, a))) for a, b in pairwise(points)]
    negative = [min(each.sides) if each.kind else each.point.negative for each in way.places]
    arrays = {
        "parameter": [p.t for p in points],
        "tip": [p.tip for p in points],
        "arclength": np.concatenate([[0.0], np.cumsum(gaps)]),
        "slope": [p.tangent.t for p in points],
        "tip_slope": [p.tip_slope for p in points],
        "negative": negative if known else None,
        "stable": [n == 0 and not each.kind for n, each in zip(negative, way.places, strict=True)] if known else None,
        "energy": [p.energy for p in points] if known else None,
    }
    found: dict[str, Any] = {key: value if value is None else _frozen(np.array(value)) for key, value in arrays.items()}
    critical: dict[str, list] = {"fold": [], "bifurcation": []}
    for i, each in enumerate(way.places):
        if each.kind:
            t, tip, sides = float(points[i].t), found["tip"][i], each.sides if known else None
            kind = Fold if each.kind == "fold" else Bifurcation
            critical[each.kind].append(kind(parameter=t, tip=tip, index=i, negative=sides))
    return Branch(
        robot=curve.first.problem.robot, name=name, **found, folds=tuple(critical["fold"]),
        bifurcations=tuple(critical["bifurcation"]), ended=way.ended, _points=points, _curve=curve,
    )  # fmt: skip


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


# ---- what the parameter does


def _named(asked: Request, column: str, at: float) -> Family:
    def request(t: float) -> Request:
        return asked if t == at else change(asked, column, t - at)

    def around(t: float) -> tuple[RodProblem, RodProblem | None, float]:
        up, down, size = sides(request(t), *numbers_of(asked, column)[0])
        return rod_problem(up), None if down is None else rod_problem(down), size

    return Family(lambda t: rod_problem(request(t)), around)


def _given(asked: Request, function: Callable[[float], Mapping[str, Any]], at: float, half: float) -> Family:
    def request(t: float) -> Request:
        return replace(asked, **_checked(asked, function(t)))

    def around(t: float) -> tuple[RodProblem, RodProblem | None, float]:
        try:
            return rod_problem(request(t + half)), rod_problem(request(t - half)), 2.0 * half
        except InvalidInput:  # at the edge of what is allowed
            other = half if t <= at else -half
            return rod_problem(request(t + other)), None, other

    for key, value in _checked(asked, function(at)).items():
        had = getattr(asked, key)
        same = value == had if key == "loads" else np.allclose(value, had, rtol=1e-9, atol=0.0)
        if not same:
            raise InvalidInput(f"parameter({at:.6g})[{key!r}]", value, f"that of the start, {had}")
    return Family(lambda t: rod_problem(request(t)), around)


def _checked(asked: Request, given: Mapping[str, Any]) -> dict[str, Any]:
    if not isinstance(given, Mapping):
        raise InvalidInput("parameter", given, "a function that gives a dictionary of arguments of solve")
    found: dict[str, Any] = {}
    for key, value in given.items():
        if key not in GIVEN:
            raise InvalidInput("parameter", key, "a function that gives " + ", ".join(GIVEN))
        if key in LINEAR:
            found[key] = tuple(vector(key, value, 3).tolist())
        elif key == "tensions":
            T = asked.robot.n_tendons
            values = vector(key, np.full(T, value) if np.ndim(value) == 0 else value, T)
            found[key] = np.array([nonnegative(f"tensions[{i}]", each) for i, each in enumerate(values.tolist())])
        else:
            found[key] = tuple(value) if key == "loads" else finite(key, value)
    return found


def _interval(stop: float | Sequence[float], t: float) -> tuple[float, float, float]:
    """(low, high, sign of the first step)."""
    first, last = (t, finite("stop", stop)) if np.ndim(stop) == 0 else vector("stop", stop, 2).tolist()
    low, high = min(first, last), max(first, last)
    if not low <= t <= high or low == high or last == t:
        raise InvalidInput("stop", stop, f"a number other than the start's {t:.6g}, or two with it between or first")
    return low, high, 1.0 if last > first else -1.0


def _silent(count: int, parameter: float) -> None:
    """No progress is reported."""
