"""`tension_limits`: the tension at which each limit of the linear model is met."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import NotConverged
from ..robot import Robot, as_robot
from ..section import NotchedTube
from .equilibrium import solve
from .limits import PLATEAU_STRAIN, RECOVERABLE_STRAIN, fibre_strain, wall_pressure

SEARCHED = np.concatenate([[0.0], np.geomspace(1e-8, 0.3, 301)])  # tensions, as shares of EA


@dataclass(frozen=True, kw_only=True)
class Limit:
    """A limit of the linear model and the tension (N) of one tendon alone, without load, at which it is met.

    tension is None where it is not reached before the tension crushes the section. value, unit: the limiting quantity.
    """

    name: str
    meaning: str
    value: float
    unit: str
    tendon: int
    tension: float | None


def tension_limits(robot: Robot) -> tuple[Limit, ...]:
    """Limits of ``robot``, for each tendon pulled alone without external load; physics in docs/limitations."""
    return tuple(limit for i in range(as_robot(robot).n_tendons) for limit in _tendon_limits(robot, i))


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
