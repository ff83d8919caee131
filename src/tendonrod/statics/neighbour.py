"""`neighbour`: the equilibrium next to one that is known, found in bounded time or not at all.

`solve` leaves no stone unturned: where a start leads nowhere it begins anew from the unloaded robot, which takes long
and may end on another branch. A loop that runs in real time wants the branch it is on, or to hear soon that it ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from ..errors import InvalidInput, whole
from ..robot import Robot
from .equilibrium import prepare
from .newton import CONTACT_STEPS, NewtonSolution
from .problem import RodProblem, problem_of
from .shape import Shape, Status
from .solution import CONVERGED, RETRACTED, Solution

TRUSTED = 0.25  # of the accuracy asked for: error of a start up to which its grid serves again
LARGE = 80  # steps of a grid above which looks at the surface are so costly that there are fewer
FEW_LOOKS = 8  # at the surface, on the grid of the start alone: where that is not enough, two grids tell more
HELP = 0.5  # of an error that is left by twice the steps, above which more are no help
PLENTY = 0.1  # of the accuracy asked for: error below which half the steps may do


@dataclass(frozen=True, kw_only=True, slots=True)
class Effort:
    """How much work is done for a shape.

    most_steps: of the finest grid. content: m, error to be content with where finer grids do not help, as where the
    robot slides over an edge that is sharper than they are; the shape's error_estimate tells. is_checked: False takes
    the grid and the error of the start for this shape's too, where that error is well below the accuracy, in about half
    the time: for shapes so near that the error cannot have grown much. most_looks: at the surface on a grid of up to 80
    steps, and in proportion fewer on a finer one, before a solve is given up; those that arrive take 2, seldom more
    than 10, those that do not hundreds. farthest: m, motion of a sample from the start beyond which the shape is of no
    use, as after a snap: where two grids agree on that, finer ones are spared, and the shape is given with the error
    that it then has.
    """

    most_steps: int = 160  # 0.5 mm each of ExoNav 1
    content: float = 0.0
    is_checked: bool = True
    most_looks: float = inf
    farthest: float = inf


USUAL = Effort()


def neighbour(
    robot: Robot, tensions: Any, start: Shape | None, samples: int, effort: Effort = USUAL, **asked: Any
) -> Shape:
    """The equilibrium that Newton's method finds from ``start``, at ``samples`` even arc lengths.

    start: a solved shape, or None for the robot without load. asked: keywords of `tendonrod.solve` but s, steps, start
    and throw. The status is `STALLED` where the way ends, `TOO_FINE` where the accuracy takes more steps, and then the
    shape holds NaN. Raises `InvalidInput`.
    """
    if not (start is None or isinstance(start, Shape)):
        raise InvalidInput("start", start, "a Shape or None")
    solution = prepare(robot, tensions, **asked)
    s = np.linspace(0.0, solution.length, whole("samples", samples, 2) if solution.length >= RETRACTED else 1)
    s.setflags(write=False)
    if solution.length < RETRACTED:
        status = Status.CONVERGED if solution.run(None) == CONVERGED else Status.STALLED
        return _shape(robot, s, solution, status)
    near = start if start is not None and start.converged and start.length >= RETRACTED else None

    def is_far(found: NewtonSolution) -> bool:
        if near is None or effort.farthest == inf:
            return False
        before = _shape(robot, np.linspace(0.0, near.length, s.size), near._solution, Status.CONVERGED)
        return motion(before, _shape(robot, s, found, Status.CONVERGED)) > effort.farthest

    found, status = _found(problem_of(solution), None if near is None else near._solution, effort, is_far)
    return _shape(robot, s, found, status)


def _shape(robot: Robot, s: np.ndarray, solution: Solution | NewtonSolution, status: Status) -> Shape:
    rows = solution.rows(s) if status is Status.CONVERGED else np.full((s.size, 24), np.nan)
    rows.setflags(write=False)
    return Shape(robot=robot, s=s, status=status, load_factor=1.0, _rows=rows, _solution=solution)


def motion(start: Shape, shape: Shape) -> float:
    """Largest motion of the tube's axis from one shape to another, sample by sample, m; where one of them is retracted
    and the other is not, the difference of their lengths.
    """
    before, after = start.centerline, shape.centerline
    if before.shape != after.shape:
        return abs(start.length - shape.length)
    step = after - before
    return float(np.sqrt(np.einsum("ij,ij->i", step, step).max()))


def _found(
    problem: RodProblem,
    near: Solution | NewtonSolution | None,
    effort: Effort,
    is_far: Callable[[NewtonSolution], bool],
) -> tuple[NewtonSolution, Status]:
    """On the neighbour's grid alone, else on finer and finer grids until two agree."""
    request = problem.request
    goal = request.accuracy if request.surface is None else max(request.accuracy, request.contact_tolerance)
    if near is not None and not effort.is_checked and near.error < TRUSTED * goal:
        same = _grid(problem, near.steps, min(effort.most_looks, FEW_LOOKS))
        if same.run(near) == CONVERGED and not _enters(same):
            same.error = near.error
            return same, Status.CONVERGED
    coarse = _grid(problem, _first_steps(near, goal, effort.most_steps), effort.most_looks)
    if coarse.run(near) != CONVERGED:
        return coarse, Status.STALLED
    while 2 * coarse.steps <= effort.most_steps:
        fine = _grid(problem, 2 * coarse.steps, effort.most_looks)
        if fine.run(coarse) != CONVERGED:
            return fine, Status.STALLED
        fine.error = _error(fine, coarse)
        helps = not fine.error > HELP * coarse.error  # NaN of the first
        last = not helps or 4 * coarse.steps > effort.most_steps
        if fine.error <= goal or (fine.error <= effort.content and last) or (is_far(coarse) and is_far(fine)):
            return fine, Status.CONVERGED
        coarse = fine
    return coarse, Status.TOO_FINE


def _grid(problem: RodProblem, steps: int, looks: float) -> NewtonSolution:
    """The problem on a grid, unsolved; looks: see `Effort`."""
    return NewtonSolution(problem.with_steps(steps), most_looks=looks * min(1.0, LARGE / steps))


def _first_steps(near: Solution | NewtonSolution | None, goal: float, most: int) -> int:
    """Of the coarser grid: half of what the neighbour took, or a quarter where that was much more than enough; no more
    than half of ``most``, so that a finer one can follow also where the neighbour was granted more.
    """
    if near is None:
        return CONTACT_STEPS
    return max(CONTACT_STEPS, min(near.steps // (4 if near.error < PLENTY * goal else 2), most // 2))


def _error(fine: NewtonSolution, coarse: NewtonSolution) -> float:
    """Position error, m: without bound where the robot enters the surface between the stages."""
    return inf if _enters(fine) else coarse.trial.distance(fine.trial)


def _enters(solution: NewtonSolution) -> bool:
    contact, tolerance = solution.trial.contact, solution.problem.request.contact_tolerance
    return contact is not None and contact.deepest(solution.trial) > tolerance
