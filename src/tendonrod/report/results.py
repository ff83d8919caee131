"""What the chapters compute, as values: what figures and tables are drawn from. It knows neither of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..motion.plan import Plan
from ..robot import Robot
from ..statics.shape import Shape
from . import paper
from .misprints import Body

TENSIONS = (0.0, *paper.TARGET_TENSIONS, 1.0)  # N; 1 N is the edge of the linear range of prototype 1
SWEPT = np.linspace(0.0, 1.5, 31)  # N, of the torsion models
TOLERANCES = (0.1e-3, 0.5e-3, 2.0e-3)  # m, of the paper's search; it prints none


@dataclass(frozen=True, kw_only=True, eq=False)
class Fan:
    """Shapes of one prototype at `TENSIONS`, without and with gravity, and the way of its tip as the tension rises.

    swept: (n,) N. deflection: (n,) m, of the tip from where it is without tension. radius: (n,) m, of the
    helix that the tube's axis follows, without load. lift_off, plateau: tensions (N), ends of the linear model's range.
    """

    robot: Robot
    still: tuple[Shape, ...]
    heavy: tuple[Shape, ...]
    swept: np.ndarray
    deflection: np.ndarray
    radius: np.ndarray
    lift_off: float | None
    plateau: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Commanded:
    """What a tension polynomial does when it is commanded: errors of the tip against a plan's reference, m."""

    tension: np.ndarray
    tip_error: np.ndarray
    tip_error_at_progress: np.ndarray
    body_rms: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Plans:
    """All plans of the chapter, prototype 1; still: without gravity, heavy: with it; searches: by tolerance (m)."""

    still: tuple[Plan, ...]
    heavy: tuple[Plan, ...]
    full: Plan
    searches: dict[float, Plan]
    homogenized: Plan
    fitted: Commanded
    printed: Commanded


@dataclass(frozen=True, kw_only=True, eq=False)
class Misprints:
    """Prototype 1 at 0.7 N, pairs without and with gravity. right: this package; others: printed equations.

    check: the same integrator with every misprint corrected. weight_per_length: with the mass per length of the tube.
    """

    robot: Robot
    right: tuple[Shape, ...]
    check: tuple[Body, ...]
    moment_term: tuple[Body, ...]
    inertia: tuple[Body, ...]
    centroid: tuple[Body, ...]
    weight_per_length: tuple[Shape, ...]
    open_section: tuple[Shape, ...]
    homogenized: tuple[Shape, ...]

    def moved(self, name: str) -> list[float]:
        """Distances (m) of the tip from the right one, without and with gravity."""
        return [
            float(np.linalg.norm(body.position[-1] - shape.tip))
            for body, shape in zip(getattr(self, name), self.right, strict=True)
        ]


@dataclass(frozen=True, kw_only=True, eq=False)
class GravityEffect:
    """One prototype; every array's last axis is the four places s of Table I, lengths in m.

    bound: (4,) what the two model runs must differ by at least. weight: (models, tensions, 4) motion by self-weight.
    beyond: largest motion of the tip by self-weight up to the plateau, either torsion. tilt: (4,) motion
    by one degree of base tilt; mass: (models, 4) motion that a mass at the tip adds; both at the largest tension.
    """

    name: str
    bound: np.ndarray
    weight: np.ndarray
    beyond: float
    tilt: np.ndarray
    mass: np.ndarray

    @property
    def tilt_needed(self) -> float:
        """Base tilt (degrees) that would move the tip by the bound."""
        return float(self.bound[-1] / self.tilt[-1])
