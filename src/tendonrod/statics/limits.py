"""Where the linear model leaves its range: superelastic plateau, closed notches, a lifted tendon (docs/limitations)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from ..errors import NotConverged
from ..robot import Robot, as_robot
from ..section import NotchedTube
from .equilibrium import solve

if TYPE_CHECKING:
    from .shape import Shape

PLATEAU_STRAIN = 500e6 / 75e9  # nitinol leaves linear elasticity near 500 MPa (E = 75 GPa): 0.67 %
RECOVERABLE_STRAIN = 0.06  # lower end of 6 to 8 %
SEARCHED = np.concatenate([[0.0], np.geomspace(1e-8, 0.3, 301)])  # tensions, as shares of EA


@dataclass(frozen=True, kw_only=True)
class Limit:
    """A limit of the linear model and the tension (N) of one tendon alone, without load, at which it is met.

    tension is None where it is not reached. value, unit: the limiting quantity itself.
    """

    name: str
    meaning: str
    value: float
    unit: str
    tendon: int
    tension: float | None


def tension_limits(robot: Robot) -> tuple[Limit, ...]:
    """Limits of ``robot`` as `Limit`, for each tendon pulled alone without external load; physics from
    docs/limitations.
    """
    return tuple(limit for i in range(as_robot(robot).n_tendons) for limit in _tendon_limits(robot, i))


def euler_loads(robot: Robot) -> tuple[float, float]:
    """Buckling load (N) of the straight extended robot, clamped and free: with the softer bending stiffness, and with
    the harmonic mean of both, which a section that turns along the rod approaches."""
    x, y = robot.section.Kbt[:2].tolist()
    scale = (0.5 * pi / robot.section.L_na) ** 2
    return scale * min(x, y), scale * 2.0 * x * y / (x + y)


def fibre_strain(shape: Shape) -> np.ndarray:
    """(n,) largest axial strain over the section; NaN where its outline is not known (a rod given by area)."""
    section = shape.robot.section
    du, dv = shape.u - section.u_star, shape.v - section.v_star
    strain = shape.robot.body.fibre_strain(du[:, 0], du[:, 1], dv[:, 2])
    return np.full(shape.s.shape, np.nan) if strain is None else strain


def wall_pressure(shape: Shape, i: int) -> np.ndarray:
    """(n,) (u x q)_x of tendon ``i``, 1/m: positive where the tendon presses on the notched wall, negative where it
    lifts.
    """
    routing = shape.robot.routing[i]
    x, y, _ = shape.robot.tendon_position(i, shape.material_coordinate).T
    slope = routing[4] * np.stack([routing[1] - y, x - routing[0], 0.0 * x], axis=1)
    q = np.cross(shape.u, np.stack([x, y, 0.0 * x], axis=1)) + slope + shape.v
    end = routing[5] * (1.0 - 1e-9) if routing[5] < shape.robot.length_na else np.inf  # at its end it has let go
    reach = shape.material_coordinate < end
    return np.cross(shape.u, q)[reach, 0]


def shape_warnings(shape: Shape) -> tuple[str, ...]:
    """One sentence for each limit that ``shape`` passes anywhere on its body; see `tendonrod.Shape.warnings`."""
    if not shape.converged:
        return ()
    whole = shape.at(np.linspace(0.0, shape.length, max(16, shape.steps) + 1))
    return tuple(
        _stability_warnings(shape) + _strain_warnings(whole) + _closure_warnings(whole) + _lift_warnings(whole)
    )


def _stability_warnings(shape: Shape) -> list[str]:
    return [] if shape.stable else ["this equilibrium is unstable: the rod would buckle away from it"]


def _strain_warnings(shape: Shape) -> list[str]:
    strain = fibre_strain(shape)
    if not strain.max() > PLATEAU_STRAIN:
        return []
    where, limit = 1e3 * shape.s[strain.argmax()], 100 * PLATEAU_STRAIN
    found = f"strain {100 * strain.max():.3g} % at s = {where:.3g} mm is past the superelastic plateau"
    return [f"{found}, {limit:.2f} %, beyond which the linear model is wrong"]


def _closure_warnings(shape: Shape) -> list[str]:
    body = shape.robot.body
    if not isinstance(body, NotchedTube) or shape.u[:, 1].max() < body.closure_curvature:
        return []
    return [f"curvature {shape.u[:, 1].max():.4g} 1/m closes the notches (at {body.closure_curvature:.4g} 1/m)"]


def _lift_warnings(shape: Shape) -> list[str]:
    found = []
    for i, tendon in enumerate(shape.robot.tendons):
        if tendon.routing != "opposite_backbone" or shape.tensions[i] == 0.0:
            continue
        if wall_pressure(shape, i).min(initial=np.inf) <= 0.0:
            found.append(
                f"tendon {i + 1} lifts off the notched wall and runs shorter than modelled, below its lift-off tension"
            )
    return found


def _tendon_limits(robot: Robot, i: int) -> list[Limit]:
    body = robot.body
    found = []
    if body.fibre_strain(0.0, 0.0, 0.0) is not None:
        strains = (
            ("plateau", "largest fibre strain at which nitinol leaves linear elasticity", PLATEAU_STRAIN),
            ("recoverable strain", "largest fibre strain that nitinol surely recovers", RECOVERABLE_STRAIN),
        )
        for name, meaning, value in strains:
            tension = _crossing(robot, i, lambda shape, v=value: fibre_strain(shape).max() - v)
            found.append((name, meaning, value, "1", tension))
    if isinstance(body, NotchedTube):
        tension = _crossing(robot, i, lambda shape: shape.u[:, 1].max() - body.closure_curvature)
        found.append(("notch closure", "curvature at which notch edges meet", body.closure_curvature, "1/m", tension))
    if robot.tendons[i].routing == "opposite_backbone":
        tension = _crossing(robot, i, lambda shape: wall_pressure(shape, i).min(initial=np.inf))
        found.append(("tendon lift-off", "below this tension the tendon leaves the notched wall", 0.0, "1/m", tension))
    return [Limit(name=a, meaning=b, value=c, unit=d, tendon=i, tension=e) for a, b, c, d, e in found]


def _crossing(robot: Robot, i: int, excess) -> float | None:
    """Smallest searched tension at which ``excess(shape)`` turns positive, to 1e-12 N; None where it never does."""

    def at(tension: float) -> float:
        tensions = np.zeros(robot.n_tendons)
        tensions[i] = tension
        return float(excess(solve(robot, tensions, insertion=1.0)))

    before, low = -np.inf, 0.0
    for tension in (SEARCHED * robot.section.Kse[2]).tolist():
        try:
            now = at(tension)
        except NotConverged:
            return None
        if now > 0.0:
            return _root(at, low, tension) if before < 0.0 else None
        before, low = now, tension
    return None


def _root(function, low: float, high: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(function, low, high, xtol=1e-12))  # pyright: ignore[reportArgumentType] - stub of full_output
