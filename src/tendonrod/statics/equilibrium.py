"""`solve`: from a robot and its loads to a `Shape`. The mathematics is in `kernel`; here are checks and
continuation.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import cos, inf, isfinite, sin
from pathlib import Path

import numpy as np

from ..errors import InvalidInput, NotConverged, finite, nonnegative, vector, within
from ..robot import Robot, as_robot
from .continuation import follow_load, transfer
from .shape import Shape, Status, state_size

Vector = Sequence[float] | np.ndarray
ZERO = (0.0, 0.0, 0.0)
START_CAPACITY, MOST_STEPS = 24, 20_000
_OUTCOME = {0: Status.CONVERGED, 1: Status.LOCAL_FAILED, 2: Status.STALLED, 3: Status.TOO_FINE}
_kernel = None


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

    tensions: N, >= 0, one number (for every tendon) or (n_tendons,). gravity: (3,) m/s2. tip_force (3,) N, tip_moment
    (3,) N m, distributed_force (3,) N/m and distributed_moment (3,) N per metre of s: dead loads, all in the world
    frame.
    insertion: exposed share eta in [0, 1]. rotation: angle (rad) of the section frame at the outer tube's exit about
    world z, R(0) = Rz(rotation), p(0) = Rz(rotation) [-r_na, 0, 0]; 0 is what follow-the-leader motion gives.
    s: arc lengths (m) from the exit at which to report, None for the integrator's nodes. accuracy: position error (m)
    anywhere on the body. steps: fixes the number of integration steps instead. start: a neighbouring solution.

    Returns a `Shape`. Raises `InvalidInput`; `NotConverged` unless ``throw`` is False, which returns the status
    instead. Source: Cosserat rod of the paper's eqs. 1-5 with the corrections of docs/derivations, in total-force form.
    """
    as_robot(robot)
    if not (start is None or isinstance(start, Shape)):
        raise InvalidInput("start", start, "a Shape or None")
    kernel = _kernel or load_kernel()
    rod, tendons = _rod_constants(robot), _tendon_table(robot, tensions)
    problem = _problem(
        robot, gravity, tip_force, tip_moment, distributed_force, distributed_moment, insertion, rotation
    )
    problem[26] = within("accuracy", accuracy, 1e-12, 1.0)
    if steps is not None:
        problem[27] = _step_count(steps)
    length = problem[12]
    at = None if s is None else arc_lengths(s, length)
    outcome = _empty(rod, problem) if length == 0.0 else _solved(kernel, rod, tendons, problem, start)
    code, reached, stats, state, jacobian = outcome
    n, half = int(stats[4]), int(stats[5])
    if code == 0:
        if at is None:
            at = np.zeros(1) if length == 0.0 else state[half * (state.size // 2) :][: n + 1]
        rows = _rows(kernel, rod, tendons, problem, state, half, n, at, stats)
    elif throw:
        raise _failure(_OUTCOME[code], reached, stats[0])
    else:
        at = np.linspace(0.0, length, 2) if at is None else at
        rows = np.full((at.size, 24), np.nan)
    applied = tendons[:, 6]
    for array in (rows, at, applied):
        array.setflags(write=False)
    return Shape(
        robot=robot,
        tensions=applied,
        s=at,
        status=_OUTCOME[code],
        load_factor=reached,
        _rows=rows,
        _problem=problem,
        _state=state,
        _jacobian=jacobian,
        _stats=stats,
    )


def load_kernel():
    """The compiled kernel; says so on standard error when it has to be compiled first, which happens once."""
    global _kernel
    from . import kernel

    source = Path(kernel.__file__).stat().st_mtime
    cache = Path(str(kernel.equilibrium.stats.cache_path))
    if not any(index.stat().st_mtime >= source for index in cache.glob("kernel.sample-*.nbi")):
        print("tendonrod: compiling the statics kernel, about 20 s, once per installation", file=sys.stderr, flush=True)
    kernel.compile_all()
    _kernel = kernel
    return kernel


def arc_lengths(s, length: float) -> np.ndarray:
    """``s`` as (n,) floats within [0, length]; a rounding error beyond the end is taken for the end."""
    try:
        at = np.array(s, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput("s", s, f"numbers from 0 to the exposed length {length!r} m") from None
    low, high = (at.min(), at.max()) if at.ndim == 1 and at.size else (-inf, inf)
    if not (low >= 0.0 and high <= length * (1.0 + 1e-9)):
        raise InvalidInput("s", s, f"one or more numbers from 0 to the exposed length {length!r} m")
    return np.minimum(at, length, out=at)


def sampled(robot: Robot, tendons, problem, state, half: int, n: int, at) -> np.ndarray:
    """Rows of a solved state at other arc lengths."""
    kernel = _kernel or load_kernel()
    rows = _rows(kernel, _rod_constants(robot), tendons, problem, state, half, n, at, np.zeros(8))
    rows.setflags(write=False)
    return rows


def is_stable(shape: Shape) -> bool:
    """See `Shape.stable`."""
    if shape.length == 0.0:
        return True
    kernel = _kernel or load_kernel()
    rod, tendons, half = _rod_constants(shape.robot), shape._tendons(), shape._half
    return kernel.stability(rod, tendons, shape._problem, shape._state, half, shape.steps, np.empty(kernel.SCRATCH)) > 0


def _rows(kernel, rod, tendons, problem, state, half, n, at, stats) -> np.ndarray:
    rows, scratch = np.empty((at.size, 24)), np.empty(kernel.SCRATCH)
    kernel.sample(rod, tendons, problem, state, half, n, at, 0.05 * problem[26], rows, scratch)
    return rows


def _three(field: str, value) -> tuple[float, ...] | list[float]:
    if value is ZERO:
        return value
    if type(value) is tuple and len(value) == 3:
        a, b, c = value
        if type(a) is type(b) is type(c) is float and isfinite(a + b + c):
            return value
    return vector(field, value, 3).tolist()


def _rod_constants(robot: Robot) -> np.ndarray:
    known = vars(robot).get("_rod_constants")
    if known is None:
        section, routing = robot.section, robot.routing
        reach = np.hypot(routing[:, 0], routing[:, 1]) + routing[:, 2]
        known = np.concatenate([section.Kse, section.Kbt, section.v_star, section.u_star, [reach.max(initial=0.0)]])
        vars(robot)["_rod_constants"] = known
    return known


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


def _problem(robot, gravity, tip_force, tip_moment, distributed_force, distributed_moment, insertion, rotation):
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


def _step_count(steps) -> int:
    if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or not 1 <= steps <= MOST_STEPS:
        raise InvalidInput("steps", steps, f"a whole number from 1 to {MOST_STEPS}")
    return int(steps)


def _empty(rod, problem):
    """State of a fully retracted robot: two nodes at the exit, so close that they are one."""
    state, stats = np.zeros(state_size(1)), np.zeros(8)
    state[1] = 1e-30
    state[2:14] = state[14:26] = problem[14:26]
    state[26:29] = state[29:32] = problem[3:6]
    state[32:38] = state[38:44] = rod[6:12]
    stats[4] = 1
    return 0, 1.0, stats, state, np.eye(3)


def _solved(kernel, rod, tendons, problem, start):
    """(code, load factor reached, stats, state, jacobian): from ``start``, else cold, else by continuation."""
    stats, jacobian, scratch = np.empty(8), np.empty((3, 3)), np.empty(kernel.SCRATCH)
    capacity = max(START_CAPACITY, int(problem[27]))
    if start is not None:
        if start.steps and start.converged and len(start.tensions) == len(tendons):
            capacity = max(capacity, start.steps)
        else:
            start = None
    while True:
        state = np.empty(state_size(capacity))
        if start is not None:
            transfer(start._state, start._half, start.steps, state)
            jacobian[:] = start._jacobian
            problem[28], problem[29] = start.steps, start.error_estimate or inf
        code = kernel.equilibrium(rod, tendons, problem, state, jacobian, stats, scratch)
        if code == 3 and stats[4] <= MOST_STEPS:
            capacity = int(stats[4]) + 2 * len(tendons) + 2
            continue
        if code == 0 or code == 3:
            return code, 1.0, stats, state, jacobian
        return follow_load(kernel, rod, tendons, problem)


def _failure(status: Status, reached: float, residual: float) -> NotConverged:
    what, _, advice = status.partition("; ")
    return NotConverged(status=what, load_factor=reached, residual=float(residual), advice=advice)
