"""`solve`: from a robot and its loads to a `Shape`. The mathematics is in `kernel`; here are checks and
continuation.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, inf, isfinite, sin

import numpy as np

from ..errors import InvalidInput, NotConverged, finite, nonnegative, vector, whole, within
from ..robot import Robot, as_robot
from .continuation import follow_load
from .shape import Shape, Status, arc_lengths
from .solution import CONVERGED, MOST_STEPS, RETRACTED, TOO_SMALL, Solution

Vector = Sequence[float] | np.ndarray
ZERO = (0.0, 0.0, 0.0)
_OUTCOME = {0: Status.CONVERGED, 1: Status.LOCAL_FAILED, 2: Status.STALLED, 3: Status.TOO_FINE}


def solve(
    robot: Robot,
    tensions: float | Sequence[float] | np.ndarray = 0.0,
    gravity: Vector = ZERO,
    tip_force: Vector = ZERO,
    tip_moment: Vector = ZERO,
    distributed_force: Vector = ZERO,
    distributed_moment: Vector = ZERO,
    insertion: float = 1.0,
    rotation: float = 0.0,
    s: Sequence[float] | np.ndarray | None = None,
    accuracy: float = 1e-6,
    steps: int | None = None,
    start: Shape | None = None,
    throw: bool = True,
) -> Shape:
    """Static equilibrium of the exposed robot under tendon tensions and dead loads.

    - tensions: N, >= 0, one number (for every tendon) or (n_tendons,).
    - gravity: (3,) m/s2, world frame.
    - tip_force (3,) N, tip_moment (3,) N m, distributed_force (3,) N/m, distributed_moment (3,) N m per metre of s:
      dead loads, world frame.
    - insertion: exposed share eta in [0, 1].
    - rotation: angle (rad) of the section frame at the outer tube's exit about world z, R(0) = Rz(rotation),
      p(0) = Rz(rotation) [-r_na, 0, 0]; 0 is what follow-the-leader motion gives.
    - s: arc lengths (m) from the exit at which to report, None for the integrator's nodes.
    - accuracy: position error (m) anywhere on the body, from 1e-12 to 1.
    - steps: fixes the number of integration steps instead, without an error estimate (NaN).
    - start: a neighbouring solution to start from; the accuracy stays the one asked for.

    Returns a `Shape`. Raises `InvalidInput`; `NotConverged` unless ``throw`` is False, which returns the status
    instead. Source: Cosserat rod of the paper's eqs. 1-5 with the corrections of docs/derivations, in total-force form.
    """
    if not (start is None or isinstance(start, Shape)):
        raise InvalidInput("start", start, "a Shape or None")
    solution = prepare(
        robot, tensions, gravity, tip_force, tip_moment, distributed_force, distributed_moment, insertion, rotation,
        accuracy, steps,
    )  # fmt: skip
    at = None if s is None else arc_lengths(s, solution.length)
    solution, reached = _solved(solution, start)
    status = _OUTCOME[solution.code]
    if status is Status.CONVERGED:
        if at is None:
            at = np.zeros(1) if solution.length < RETRACTED else solution.grid
        rows = solution.rows(at)
    elif throw:
        raise _failure(status, reached, solution.stats[0])
    else:
        at = np.linspace(0.0, solution.length, 2) if at is None else at
        rows = np.full((at.size, 24), np.nan)
        rows.setflags(write=False)
    at.setflags(write=False)
    return Shape(robot=robot, s=at, status=status, load_factor=reached, _rows=rows, _solution=solution)


def prepare(
    robot: Robot,
    tensions: float | Sequence[float] | np.ndarray = 0.0,
    gravity: Vector = ZERO,
    tip_force: Vector = ZERO,
    tip_moment: Vector = ZERO,
    distributed_force: Vector = ZERO,
    distributed_moment: Vector = ZERO,
    insertion: float = 1.0,
    rotation: float = 0.0,
    accuracy: float = 1e-6,
    steps: int | None = None,
) -> Solution:
    """The checked problem in the kernel's arrays, ready to `run`; arguments and errors as `solve`."""
    rod, tendons = as_robot(robot).rod_constants, _tendon_table(robot, tensions)
    loads = gravity, tip_force, tip_moment, distributed_force, distributed_moment
    problem = _problem(robot, loads, insertion, rotation)
    problem[26] = within("accuracy", accuracy, 1e-12, 1.0)
    problem[27] = 0 if steps is None else whole("steps", steps, 1, MOST_STEPS)
    return Solution(rod, tendons, problem)


def _three(field: str, value) -> tuple[float, ...] | list[float]:
    if value is ZERO:
        return value
    if type(value) is tuple and len(value) == 3:
        a, b, c = value
        if type(a) is type(b) is type(c) is float and isfinite(a + b + c):
            return value
    return vector(field, value, 3).tolist()


def _tendon_table(robot: Robot, tensions) -> np.ndarray:
    routing = robot.routing
    table = np.empty((routing.shape[0], 7))
    table[:, :6] = routing
    if isinstance(tensions, (list, tuple, np.ndarray)) and np.ndim(tensions) > 0:
        values = vector("tensions", tensions, routing.shape[0])
        for i, tension in enumerate(values.tolist()):
            nonnegative(f"tensions[{i}]", tension)
        table[:, 6] = values
    else:
        table[:, 6] = nonnegative("tensions", tensions)
    return table


def _problem(robot: Robot, loads, insertion: float, rotation: float) -> np.ndarray:
    gravity, tip_force, tip_moment, distributed_force, distributed_moment = loads
    section = robot.section
    eta = within("insertion", insertion, 0.0, 1.0)
    angle = rotation if type(rotation) is float and isfinite(rotation) else finite("rotation", rotation)
    weight = section.line_density
    g, f = _three("gravity", gravity), _three("distributed_force", distributed_force)
    c, d, r, L = cos(angle), sin(angle), section.r_na, section.L_na
    return np.array([
        *_three("tip_force", tip_force),
        *_three("tip_moment", tip_moment),
        weight * g[0] + f[0], weight * g[1] + f[1], weight * g[2] + f[2],
        *_three("distributed_moment", distributed_moment),
        eta * L, (1.0 - eta) * L,
        -r * c, -r * d, 0.0, c, -d, 0.0, d, c, 0.0, 0.0, 0.0, 1.0,
        0.0, 0.0, 0.0, inf,
    ])  # fmt: skip


def _solved(solution: Solution, start: Shape | None) -> tuple[Solution, float]:
    """(solution, load factor reached): from ``start``, else cold, else by continuation."""
    near = None
    if (
        start is not None
        and start.converged
        and start.length >= RETRACTED
        and start.tensions.size == len(solution.tendons)
    ):
        near = start._solution
    if solution.run(near) in (CONVERGED, TOO_SMALL):
        return solution, 1.0
    return follow_load(solution)


def _failure(status: Status, reached: float, residual: float) -> NotConverged:
    what, _, advice = status.partition("; ")
    return NotConverged(status=what, load_factor=reached, residual=float(residual), advice=advice)
