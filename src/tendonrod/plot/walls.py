"""Surfaces as grids of points: the part of each that lies near a body, for the eye."""

from __future__ import annotations

import numpy as np

from ..surface import Cavity, Cylinder, Plane, Sphere, Surface, Tube, Walls

NEAR = 0.35  # of the body's size: how far from the body a surface is still drawn
MARGIN = 0.12  # of the body's size, beyond what lies nearest to the body
CAP = 0.35  # of the body's size: radius of the cap that is drawn of a sphere
WHOLE = 2.0  # rad to either side, from which on a round surface is drawn all round
LINES = 25  # points across a patch


def near_walls(surface: Surface | None, body: np.ndarray) -> list[np.ndarray]:
    """Grids (m, n, 3) in m of the surfaces near the ``body`` (k, 3) m; none for those that have no simple shape."""
    if surface is None:
        return []
    if isinstance(surface, Walls):
        return [grid for each in surface.surfaces for grid in near_walls(each, body)]
    size = max(float(np.ptp(body, axis=0).max()), 1e-6)
    near = body[surface.distance(body)[0] < NEAR * size]
    if not len(near):
        return []
    if isinstance(surface, Plane):
        return [_plane(surface, near, MARGIN * size)]
    if isinstance(surface, (Tube, Cylinder)):
        return [_around_axis(surface, near, MARGIN * size)]
    return [_around_center(surface, near, size)] if isinstance(surface, (Sphere, Cavity)) else []


def silhouette(grid: np.ndarray) -> np.ndarray:
    """(k, 2) outline of a projected grid (m, n, 2), closed: the convex hull, which fits these patches."""
    points = np.unique(np.round(grid.reshape(-1, 2), 9), axis=0)
    points = points[np.lexsort(points.T[::-1])]
    lower, upper = _chain(points), _chain(points[::-1])
    return np.array([*lower[:-1], *upper[:-1], lower[0]])


def _chain(points: np.ndarray) -> list[np.ndarray]:
    """One half of the convex hull of sorted points."""
    chain: list[np.ndarray] = []
    for point in points:
        while len(chain) > 1 and np.linalg.det([chain[-1] - chain[-2], point - chain[-2]]) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain


def _plane(plane: Plane, near: np.ndarray, margin: float) -> np.ndarray:
    """A rectangle below the body."""
    across, along = _spanning(plane.normal)
    a, b = (near - plane.point) @ across, (near - plane.point) @ along
    u, v = _span(a, margin), _span(b, margin)
    return plane.point + u[:, None, None] * across + v[None, :, None] * along


def _around_axis(surface: Tube | Cylinder, near: np.ndarray, margin: float) -> np.ndarray:
    """The stretch beside the body, all round or, of a wide one, the side where the body is."""
    first, second = _spanning(surface.axis)
    arm = near - surface.point
    z = _span(arm @ surface.axis, margin)
    angle = _angles(arm @ first, arm @ second, margin / surface.radius)
    round_it = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    return surface.point + surface.radius * round_it[:, None] + z[None, :, None] * surface.axis


def _around_center(surface: Sphere | Cavity, near: np.ndarray, size: float) -> np.ndarray:
    """The whole of a small sphere; of a large one the cap at the place that comes nearest to the body."""
    arm = near[int(np.argmin(surface.distance(near)[0]))] - surface.center
    length = np.linalg.norm(arm)
    pole = arm / length if length > 1e-9 * surface.radius else np.eye(3)[0]
    first, second = _spanning(pole)
    widest = CAP * size / surface.radius
    theta = np.linspace(0.0, np.pi if widest > WHOLE else widest, LINES)[:, None, None]
    phi = np.linspace(0.0, 2.0 * np.pi, 2 * LINES)[None, :, None]
    outward = np.cos(theta) * pole + np.sin(theta) * (np.cos(phi) * first + np.sin(phi) * second)
    return surface.center + surface.radius * outward


def _angles(x: np.ndarray, y: np.ndarray, margin: float) -> np.ndarray:
    middle = float(np.arctan2(y.mean(), x.mean()))
    off = (np.arctan2(y, x) - middle + np.pi) % (2.0 * np.pi) - np.pi
    half = float(np.abs(off).max()) + margin
    half = np.pi if half > WHOLE else half
    return np.linspace(middle - half, middle + half, 2 * LINES - 1)


def _span(values: np.ndarray, margin: float) -> np.ndarray:
    return np.linspace(values.min() - margin, values.max() + margin, LINES)


def _spanning(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across ``direction``, along the world's axes where that is possible."""
    first = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    first = first / np.linalg.norm(first)
    return first, np.cross(direction, first)
