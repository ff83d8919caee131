"""Cord, sac, roots and ganglia as solids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .column import Column
from .solids import ellipsoid, loft, ring, tube, union
from .targets import SIDES, mouth

if TYPE_CHECKING:
    from manifold3d import Manifold

TAKE_OFF = np.radians(54.5)  # of a root from the axis of the sac, caudally; 50-59 deg, PMC4337191
AWAY = 8e-3  # m by which a root goes on beyond its ganglion
VENTRAL = 0.2  # of half the foramen's depth, by which ganglia lie in front of its middle


def cord(column: Column, low: float, high: float) -> Manifold:
    """The cord, or its filum, between two heights."""
    z = column.heights(low, high)
    sections = column.cord(z)
    return loft(ring(sections.middle, sections.depth, sections.width), z)


def dura(column: Column, low: float, high: float) -> Manifold:
    """The sac between two heights, full."""
    z = column.heights(low, high)
    sections = column.dura(z)
    return loft(ring(sections.middle, sections.depth, sections.width), z)


def ganglion(column: Column, name: str, sign: float) -> tuple[np.ndarray, np.ndarray]:
    """Middle (3,) m of the ganglion on the side of ``sign``, and the direction (3,) of its root there, outwards."""
    middle, half = column.foramen(name)
    x = middle[0] - VENTRAL * half[0]
    y = mouth(column, x, middle[2], sign) + sign * column.numbers.of("ganglion_inside", name)
    return np.array([x, y, middle[2]]), np.array([0.0, sign * np.sin(TAKE_OFF), -np.cos(TAKE_OFF)])


def ganglia(column: Column) -> Manifold:
    """All ganglia, ellipsoids along their roots."""
    found = []
    for name in column.names:
        half = 0.5 * np.array([column.numbers.of(f"ganglion_{each}", name) for each in ("width", "width", "length")])
        for sign in SIDES.values():
            middle, along = ganglion(column, name, sign)
            axes = np.stack([[1.0, 0.0, 0.0], np.cross(along, [1.0, 0.0, 0.0]), along], axis=1)
            found.append(ellipsoid(middle, axes, half))
    return union(found)


def roots(column: Column) -> Manifold:
    """All roots, from within the sac past the ganglion."""
    found = []
    for name in column.names:
        radius = 0.5 * column.numbers.of("root_width", name)
        for sign in SIDES.values():
            middle, along = ganglion(column, name, sign)
            sac = column.dura([middle[2]])
            start = sac.middle[0, 1] + sign * (sac.width[0] - 1.5 * radius)
            back = (middle[1] - start) / along[1]
            found.append(tube([middle - back * along, middle, middle + AWAY * along], radius))
    return union(found)
