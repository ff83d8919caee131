"""Where the linear model leaves its range: superelastic plateau, closed notches, a lifted tendon (docs/limitations)."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from ..body import part_at, parts
from ..robot import Robot, as_robot
from ..section import NotchedTube

if TYPE_CHECKING:
    from .shape import Shape

PLATEAU_STRAIN = 500e6 / 75e9  # nitinol leaves linear elasticity near 500 MPa (E = 75 GPa): 0.67 %
RECOVERABLE_STRAIN = 0.06  # lower end of 6 to 8 %


def euler_loads(robot: Robot) -> tuple[float, float]:
    """Two estimates (N) of the buckling load of the straight robot at full insertion, clamped and free.

    The first is with the softer bending stiffness, the second with the harmonic mean of both, which a section that
    turns along the rod approaches. Where the section changes along the rod each is with its smallest value anywhere,
    as if the whole rod were so soft.
    """
    x, y = as_robot(robot).section_values(robot.section_table[:, :2].ravel())[:, 3:5].T
    scale = (0.5 * pi / robot.section.L_na) ** 2
    return scale * float(np.minimum(x, y).min()), scale * float((2.0 * x * y / (x + y)).min())


def fibre_strain(shape: Shape) -> np.ndarray:
    """(n,) largest axial strain over the section; NaN where its outline is not known (a rod given by area).

    At a joint of segments it is that of the segment beyond.
    """
    s_m = shape.material_coordinate
    unloaded = shape.robot.section_values(s_m)
    du, dv = shape.u - unloaded[:, 9:12], shape.v - unloaded[:, 6:9]
    strain = shape.robot.body.fibre_strain(du[:, 0], du[:, 1], dv[:, 2], s_m)
    return np.full(shape.s.shape, np.nan) if strain is None else strain


def wall_pressure(shape: Shape, i: int) -> np.ndarray:
    """(u x q)_x of tendon ``i`` where it runs, 1/m; positive where it presses on the wall, negative where it lifts."""
    robot, s_m = shape.robot, shape.material_coordinate
    r = robot.tendon_position(i, s_m)
    q = np.cross(shape.u, r) + robot.tendon_slope(i, s_m) + shape.v
    anchor = robot.tendon_ends[i]
    end = anchor * (1.0 - 1e-9) if anchor < robot.length_na else np.inf  # at its end it has let go
    return np.cross(shape.u, q)[s_m < end, 0]


def shape_warnings(shape: Shape) -> tuple[str, ...]:
    """One sentence for each limit that ``shape`` passes anywhere on its body; see `tendonrod.Shape.warnings`."""
    if not shape.converged:
        return ()
    whole = shape.at(np.linspace(0.0, shape.length, max(16, shape.steps) + 1))
    return tuple(
        _stability_warnings(shape) + _strain_warnings(whole) + _closure_warnings(whole) + _lift_warnings(whole)
    )


def _stability_warnings(shape: Shape) -> list[str]:
    return [] if shape.stable is not False else ["this equilibrium is unstable: the rod would buckle away from it"]


def _strain_warnings(shape: Shape) -> list[str]:
    strain = np.nan_to_num(fibre_strain(shape))
    if not strain.max() > PLATEAU_STRAIN:
        return []
    where, limit = 1e3 * shape.s[strain.argmax()], 100 * PLATEAU_STRAIN
    found = f"strain {100 * strain.max():.3g} % at s = {where:.3g} mm is past the superelastic plateau"
    return [f"{found} of nitinol, {limit:.2f} %, beyond which the linear model is wrong"]


def _closure_warnings(shape: Shape) -> list[str]:
    segments, found = parts(shape.robot.body), []
    where = part_at(shape.robot.body, shape.material_coordinate)
    for k, segment in enumerate(segments):
        limit = segment.body.closure_curvature if isinstance(segment.body, NotchedTube) else np.inf
        largest = shape.u[where == k, 1].max(initial=-np.inf)
        if largest >= limit:
            of = f" of segment {k + 1}" if len(segments) > 1 else ""
            found.append(f"curvature {largest:.4g} 1/m closes the notches{of} (at {limit:.4g} 1/m)")
    return found


def _lift_warnings(shape: Shape) -> list[str]:
    found = []
    for i, tendon in enumerate(shape.robot.tendons):
        if tendon.routing != "opposite_backbone" or tendon.wall == "free" or shape.tensions[i] == 0.0:
            continue
        if wall_pressure(shape, i).min(initial=np.inf) <= 0.0:
            found.append(
                f"tendon {i + 1} lifts off the notched wall and runs shorter than modelled, below its lift-off tension"
            )
    return found
