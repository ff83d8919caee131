"""`solve`: from a robot and its loads to a `Shape`. The mathematics is in `kernel`; here are checks and
continuation.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite, isnan, nan

import numpy as np

from ..errors import InvalidInput, NotConverged, finite, positive, vector, whole, within
from ..loads import Load, load_tables
from ..robot import Robot, as_robot
from ..surface import Surface, as_surface
from .arguments import (
    check_exit,
    check_reach,
    checked_loads,
    pull_of,
    pulled_lengths,
    rigid_motion,
    stretched,
    tendon_table,
    tensions_before,
    three,
)
from .continuation import NO_EQUILIBRIUM_ON_BRANCH, follow_load
from .newton import NewtonSolution
from .problem import STRAIGHT, ZERO, exit_frame, problem_of, request, rod_problem
from .shape import Shape, Status, arc_lengths
from .solution import CONVERGED, MOST_STEPS, RETRACTED, STALLED, TOO_SMALL, Solution, worked_accuracy

Vector = Sequence[float] | np.ndarray
_OUTCOME = {0: Status.CONVERGED, 1: Status.LOCAL_FAILED, 2: Status.STALLED, 3: Status.TOO_FINE}
_OUTCOME[NO_EQUILIBRIUM_ON_BRANCH] = Status.NO_EQUILIBRIUM_ON_BRANCH


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
    *,
    loads: Sequence[Load] = (),
    exit_pose: np.ndarray | Sequence[Sequence[float]] | None = None,
    exit_tilt: Sequence[float] | np.ndarray = STRAIGHT,
    exit_offset: Sequence[float] | np.ndarray = STRAIGHT,
    centroid_weight: bool = False,
    displacements: float | Sequence[float | None] | np.ndarray | None = None,
    history: Shape | None = None,
    surface: Surface | None = None,
    contact_tolerance: float = 1e-5,
) -> Shape:
    """Static equilibrium of the exposed robot under tendon tensions and loads.

    - tensions: N, >= 0, one number (for every tendon) or (n_tendons,).
    - gravity: (3,) m/s2, world frame.
    - tip_force (3,) N, tip_moment (3,) N m, distributed_force (3,) N/m, distributed_moment (3,) N m per metre of s:
      dead loads on the neutral axis, world frame.
    - insertion: exposed share eta in [0, 1].
    - rotation: angle (rad) of the section frame at the outer tube's exit about its z, R(0) = Rz(rotation),
      p(0) = Rz(rotation) [-r_na, 0, 0]; 0 is what follow-the-leader motion gives.
    - s: arc lengths (m) from the exit at which to report, None for the integrator's nodes.
    - accuracy: position error (m) anywhere on the body, from 1e-12 to 1; what is worked with is never more than 3e-6 of
      the exposed length, and less by length / 5 cm where that is short.
    - steps: fixes the number of integration steps instead, without an error estimate (NaN).
    - start: a neighbouring solution to start from; the accuracy stays the one asked for.
    - loads: `PointLoad`, `LumpedMass`, `DistributedLoad` anywhere on the robot, dead or turning with it.
    - exit_pose: (4, 4) T_world_exit of the outer tube's exit, None for the identity.
    - exit_tilt (2,) rad about the exit's x and y, exit_offset (2,) m along them: clearance in the outer tube.
    - displacements: pulled length of each tendon from slack (m), one number or (n_tendons,), None for a tendon whose
      tension is given; with the tendons' axial_stiffness and free_length. Negative is slack.
    - history: the shape before, whose tensions friction holds on to; None where all tendons were pulled from slack.
    - surface: what the tube may not enter (`tendonrod.surface`); contact_tolerance: by how much at most, m.
    - centroid_weight: weight acts at the mass centroid of the section (docs/derivations), not on the neutral axis.

    Returns a `Shape`. Raises `InvalidInput`; `NotConverged` unless ``throw`` is False, which returns the status
    instead. Source: Cosserat rod of the paper's eqs. 1-5 with the corrections of docs/derivations, in total-force form.
    """
    if not (start is None or isinstance(start, Shape)):
        raise InvalidInput("start", start, "a Shape or None")
    solution = prepare(
        robot, tensions, gravity, tip_force, tip_moment, distributed_force, distributed_moment, insertion, rotation,
        accuracy, steps, loads=loads, exit_pose=exit_pose, exit_tilt=exit_tilt, exit_offset=exit_offset,
        centroid_weight=centroid_weight, displacements=displacements, history=history, surface=surface,
        contact_tolerance=contact_tolerance,
    )  # fmt: skip
    at = None if s is None else arc_lengths(s, solution.length)
    solution, reached = _solved(solution, start)
    status = _OUTCOME[solution.code]
    if status is Status.CONVERGED:
        if at is None:
            at = np.zeros(1) if solution.length < RETRACTED else solution.grid
        rows = solution.rows(at)
    elif throw:
        raise _failure(status, reached, solution.residual)
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
    *,
    loads: Sequence[Load] = (),
    exit_pose: np.ndarray | Sequence[Sequence[float]] | None = None,
    exit_tilt: Sequence[float] | np.ndarray = STRAIGHT,
    exit_offset: Sequence[float] | np.ndarray = STRAIGHT,
    centroid_weight: bool = False,
    displacements: float | Sequence[float | None] | np.ndarray | None = None,
    history: Shape | None = None,
    surface: Surface | None = None,
    contact_tolerance: float = 1e-5,
) -> Solution | NewtonSolution:
    """The checked problem in the kernel's arrays, ready to `run`; arguments and errors as `solve`.

    A `Solution` (three shooting unknowns) where the section is uniform and the loads are the uniform dead ones, a
    `NewtonSolution` for everything else.
    """
    table = tendon_table(as_robot(robot), tensions)
    F, M = three("tip_force", tip_force), three("tip_moment", tip_moment)
    f, c = three("distributed_force", distributed_force), three("distributed_moment", distributed_moment)
    g, eta = three("gravity", gravity), within("insertion", insertion, 0.0, 1.0)
    place = (
        rotation if type(rotation) is float and isfinite(rotation) else finite("rotation", rotation),
        None if exit_pose is None else rigid_motion("exit_pose", exit_pose),
        exit_tilt if exit_tilt is STRAIGHT else tuple(vector("exit_tilt", exit_tilt, 2).tolist()),
        exit_offset if exit_offset is STRAIGHT else tuple(vector("exit_offset", exit_offset, 2).tolist()),
    )
    accuracy = within("accuracy", accuracy, 1e-12, 1.0)
    steps = 0 if steps is None else whole("steps", steps, 1, MOST_STEPS)
    pulled = pulled_lengths(robot, displacements, table[:, 6])
    asked = robot, g, F, M, f, c, eta, place
    driven = [] if pulled is None else [i for i, length in enumerate(pulled.tolist()) if not isnan(length)]
    plain = robot.is_uniform and len(driven) < 2 and surface is None and not robot.friction.any()
    length, s_exit = eta * robot.length_na, (1.0 - eta) * robot.length_na
    loads = checked_loads(loads, centroid_weight, history)
    check_reach(robot, driven, pulled, s_exit)
    contact_tolerance = positive("contact_tolerance", contact_tolerance)
    if surface is not None:
        surface = as_surface(surface)
        check_exit(robot, surface, s_exit, exit_frame(robot, s_exit, *place), contact_tolerance)
    if length < RETRACTED:
        load_tables(robot, loads, g)  # for its complaints
    if length < RETRACTED and pulled is not None:
        table[:, 6] = stretched(robot, table[:, 6], pulled)
    if length < RETRACTED or (plain and not len(loads) and not centroid_weight):
        weight, frame = robot.section.line_density, exit_frame(robot, s_exit, *place)
        problem = np.array([
            *F, *M, weight * g[0] + f[0], weight * g[1] + f[1], weight * g[2] + f[2], *c,
            length, s_exit, *frame, worked_accuracy(accuracy, length), steps, 0.0, inf,
        ])  # fmt: skip
        pull = None if pulled is None or not driven else pull_of(robot, driven[0], pulled[driven[0]], length, s_exit)
        return Solution(robot.rod_constants, table, problem, asked, pull)
    return NewtonSolution(
        rod_problem(
            request(
                asked, tensions=table[:, 6].copy(), pulled=np.full(len(table), nan) if pulled is None else pulled,
                loads=loads, centroid_weight=bool(centroid_weight),
                history=None if history is None else tensions_before(robot, history),
                surface=surface, contact_tolerance=contact_tolerance,
                accuracy=worked_accuracy(accuracy, length), steps=steps,
            )
        )
    )  # fmt: skip


def _solved(solution: Solution | NewtonSolution, start: Shape | None) -> tuple[Solution | NewtonSolution, float]:
    """(solution, load factor reached): from ``start``, else cold, else by continuation."""
    near = None
    if (
        start is not None
        and start.converged
        and start.length >= RETRACTED
        and start.robot.n_tendons == solution.tensions.size
    ):
        near = start._solution
        if isinstance(solution, Solution) and not isinstance(near, Solution):
            solution = NewtonSolution(problem_of(solution))  # so that the start is used
    if solution.run(near) in (CONVERGED, TOO_SMALL):  # pyright: ignore[reportArgumentType] - checked above
        return solution, 1.0
    found, reached = follow_load(solution)
    if found.code == STALLED and isinstance(solution, Solution):  # three unknowns were too few to find the way with
        general, all_the_way = follow_load(NewtonSolution(problem_of(solution)))
        if general.code == CONVERGED:
            return general, all_the_way
    return found, reached


def _failure(status: Status, reached: float, residual: float) -> NotConverged:
    what, _, advice = status.partition("; ")
    if status is Status.NO_EQUILIBRIUM_ON_BRANCH:
        what = f"{what}: critical load factor {reached:.7g} of the load asked for"
    return NotConverged(status=what, load_factor=reached, residual=float(residual), advice=advice)
