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


@dataclass(frozen=True, kw_only=True, eq=False)
class Gap:
    """Distance between the paper's two model runs, (..., 4) m: root mean square, least and most over the tensions."""

    rms: np.ndarray
    least: np.ndarray
    most: np.ndarray

    def margins(self, bracket: np.ndarray) -> np.ndarray:
        """(..., 8) m: by how much the distances exceed the least of Table I, then stay below the most, at each place.

        ``bracket`` (2, 4): the two bounds. All are met where none is negative.
        """
        return np.concatenate([self.rms - bracket[0], bracket[1] - self.rms], axis=-1)

    def margins_at_any_tensions(self, bracket: np.ndarray) -> np.ndarray:
        """(..., 8) as `margins`, but where none is negative, some tensions of the range would do, others by place."""
        return np.concatenate([self.most - bracket[0], bracket[1] - self.least], axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Region:
    """Which tilts and masses, or tilts towards gravity and sideways, keep the bounds of Table I: one case.

    tilts: (n,) rad. values: (m,) kg or rad. margins, margins_at_any_tensions: (n, m, 8) m, as those of `Gap`.
    closest: largest margin (m) that all bounds can be kept by; negative: by how much one is missed at best.
    least: (tilt, value) with the least sum of squares of tilt / 1 degree and mass / 0.5 g, None where none will do;
    edge: which of the eight bounds it stands at.
    """

    tilts: np.ndarray
    values: np.ndarray
    margins: np.ndarray
    margins_at_any_tensions: np.ndarray
    closest: float
    least: tuple[float, float] | None
    edge: int | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """One cause alone. values: (n,) in reading units; margins, margins_at_any_tensions: (n, 8) m, as of `Gap`."""

    values: np.ndarray
    margins: np.ndarray
    margins_at_any_tensions: np.ndarray

    def windows(self, place: int | None = None, any_tensions: bool = False) -> list[tuple[float, float]]:
        """Intervals of ``values`` where the bounds are kept at one of the four places, None for all of them."""
        margins = self.margins_at_any_tensions if any_tensions else self.margins
        return positive(self.values, margins if place is None else margins[:, [place, place + 4]])


@dataclass(frozen=True, kw_only=True, eq=False)
class Forensics:
    """One prototype: bracket (2, 4) m of Table I, causes alone by name, regions in tilt and mass by case, tilts."""

    name: str
    bracket: np.ndarray
    scans: dict[str, Scan]
    regions: dict[str, Region]
    sideways: Region


def positive(x: np.ndarray, margins: np.ndarray) -> list[tuple[float, float]]:
    """Intervals of ``x`` (n,) where none of the broken lines through ``margins`` (n, m) is negative."""
    a, b = margins[:-1], margins[1:]
    crossing = a / np.where(a == b, 1.0, a - b)
    low = np.where(a < 0.0, np.where(b < 0.0, np.inf, crossing), 0.0).max(axis=1)
    high = np.where(b < 0.0, np.where(a < 0.0, -np.inf, crossing), 1.0).min(axis=1)
    found: list[tuple[float, float]] = []
    for k in np.flatnonzero(low <= high):
        first, last = (float(x[k] + share[k] * (x[k + 1] - x[k])) for share in (low, high))
        if found and low[k] == 0.0 and found[-1][1] == float(x[k]):
            found[-1] = found[-1][0], last
        else:
            found.append((first, last))
    return found
