"""`neighbour`: the equilibrium next to one that is known, found in bounded time or not at all.

`solve` leaves no stone unturned: where a start leads nowhere it begins anew from the unloaded robot, which takes long
and may end on another branch. A loop that runs in real time wants the branch it is on, or to hear soon that it ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from ..errors import InvalidInput, whole
from ..robot import Robot
from .equilibrium import prepare
from .newton import CONTACT_STEPS, NewtonSolution
from .problem import problem_of
from .shape import Shape, Status
from .solution import CONVERGED, RETRACTED, Solution

TRUSTED = 0.25  # of the accuracy asked for: error of a start up to which its grid serves again
HELP = 0.5  # of an error that is left by twice the steps, above which more are no help
PLENTY = 0.1  # of the accuracy asked for: error below which half the steps may do


@dataclass(frozen=True, kw_only=True, slots=True)
class Effort:
    """How much work is done for a shape.

    most_steps: of the finest grid. content: m, error to be content with where finer grids do not help, as where the
    robot slides over an edge that is sharper than they are; the shape's error_estimate tells. is_checked: False takes
    the grid and the error of the start for this shape's too, where that error is well below the accuracy, in about half
    the time: for shapes so near that the error cannot have grown much. most_looks: at the surface on each
    grid, before a solve is given up; those that arrive take 2, seldom more than 10, those that do not hundreds.
    """

    most_steps: int = 160  # 0.5 mm each of ExoNav 1
    content: float = 0.0
    is_checked: bool = True
    most_looks: float = inf


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
    known = start is not None and start.converged and start.length >= RETRACTED
    near = start._solution if start is not None and known else None
    if solution.length < RETRACTED:
        status = Status.CONVERGED if solution.run(None) == CONVERGED else Status.STALLED
    else:
        solution, status = _found(NewtonSolution(problem_of(solution), most_looks=effort.most_looks), near, effort)
    rows = solution.rows(s) if status is Status.CONVERGED else np.full((s.size, 24), np.nan)
    for array in (s, rows):
        array.setflags(write=False)
    return Shape(robot=robot, s=s, status=status, load_factor=1.0, _rows=rows, _solution=solution)


def _found(
    asked: NewtonSolution, near: Solution | NewtonSolution | None, effort: Effort
) -> tuple[NewtonSolution, Status]:
    """On the neighbour's grid alone, else on finer and finer grids until two agree."""
    request = asked.problem.request
    goal = asked.accuracy if request.surface is None else max(asked.accuracy, request.contact_tolerance)
    if near is not None and not effort.is_checked and near.error < TRUSTED * goal:
        same = asked.again(near.steps)
        if same.run(near) == CONVERGED and not _enters(same):
            same.error = near.error
            return same, Status.CONVERGED
    coarse = asked.again(_first_steps(near, goal))
    if coarse.run(near) != CONVERGED:
        return coarse, Status.STALLED
    while 2 * coarse.steps <= effort.most_steps:
        fine = asked.again(2 * coarse.steps)
        if fine.run(coarse) != CONVERGED:
            return fine, Status.STALLED
        fine.error = _error(fine, coarse)
        helps = not fine.error > HELP * coarse.error  # NaN of the first
        last = not helps or 4 * coarse.steps > effort.most_steps
        if fine.error <= goal or (fine.error <= effort.content and last):
            return fine, Status.CONVERGED
        coarse = fine
    return coarse, Status.TOO_FINE


def _first_steps(near: Solution | NewtonSolution | None, goal: float) -> int:
    """Of the coarser grid: half of what the neighbour took, or a quarter where that was much more than enough."""
    if near is None:
        return CONTACT_STEPS
    return max(CONTACT_STEPS, near.steps // (4 if near.error < PLENTY * goal else 2))


def _error(fine: NewtonSolution, coarse: NewtonSolution) -> float:
    """Position error, m: without bound where the robot enters the surface between the stages."""
    return inf if _enters(fine) else coarse.trial.distance(fine.trial)


def _enters(solution: NewtonSolution) -> bool:
    contact, tolerance = solution.trial.contact, solution.problem.request.contact_tolerance
    return contact is not None and contact.deepest(solution.trial) > tolerance
