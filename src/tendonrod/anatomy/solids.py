"""Closed solids from rings, ellipsoids and boxes, their unions and differences. Metres outside, millimetres inside."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from manifold3d import Manifold

MM = 1e3
SIDES = 96  # of a ring
GRID = 1e-4  # mm: corners lie on it, which files of single precision can hold


def ring(center, depth, width, sides: int = SIDES) -> np.ndarray:
    """(m, sides, 2) points x, y of m ellipses about ``center`` (m, 2) with half axes ``depth`` (x), ``width`` (y)."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    across = np.stack(np.broadcast_arrays(np.asarray(depth)[..., None], np.asarray(width)[..., None]), axis=-1)
    return np.asarray(center)[:, None] + across * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def loft(rings, z) -> Manifold:
    """The solid through plane rings (m, n, 2) m at heights ``z`` (m,) m that grow, with flat ends."""
    rings = np.asarray(rings)
    return loft_through(
        np.concatenate([rings, np.broadcast_to(np.asarray(z)[:, None, None], (*rings.shape[:2], 1))], 2)
    )


def loft_through(rings) -> Manifold:
    """The solid through rings (m, n, 3) m, each counter-clockwise seen from the next, with flat ends."""
    rings = np.asarray(rings, dtype=float)
    m, n, _ = rings.shape
    here = np.arange(n)
    after = np.roll(here, -1)
    faces = []
    for k in range(m - 1):
        a, b, c, d = k * n + here, k * n + after, (k + 1) * n + here, (k + 1) * n + after
        faces += [np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)]
    bottom, top, last = np.full(n, m * n), np.full(n, m * n + 1), (m - 1) * n
    faces += [np.stack([after, here, bottom], axis=1), np.stack([last + here, last + after, top], axis=1)]
    ends = rings[[0, -1]].mean(axis=1)
    return solid(np.vstack([rings.reshape(-1, 3), ends]), np.concatenate(faces))


def solid(vertices, faces) -> Manifold:
    """A closed mesh (n, 3) m, (m, 3) as a solid."""
    from manifold3d import Manifold, Mesh64

    mesh = Mesh64(
        vert_properties=np.ascontiguousarray(MM * np.asarray(vertices), dtype=np.float64),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
    )
    return Manifold(mesh)


def ellipsoid(center, axes, half, sides: int = 48) -> Manifold:
    """About ``center`` (3,) m with half axes ``half`` (3,) m along the columns of ``axes`` (3, 3)."""
    from manifold3d import Manifold

    matrix = np.column_stack([np.asarray(axes) * (MM * np.asarray(half)), MM * np.asarray(center)])
    return Manifold.sphere(1.0, sides).transform(matrix)


def tube(path, radius, sides: int = 32) -> Manifold:
    """A rod around ``path`` (m, 3) m with ``radius`` (m,) or one, m."""
    path = np.asarray(path, dtype=float)
    t = np.gradient(path, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    side = np.cross(t, np.eye(3)[np.argmin(np.abs(t).max(axis=0))])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(t, side)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    around = np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * up[:, None]
    return loft_through(path[:, None] + np.broadcast_to(radius, len(path))[:, None, None] * around)


def box(low, high) -> Manifold:
    """The box from corner ``low`` (3,) to ``high`` (3,), m."""
    from manifold3d import Manifold

    low, high = MM * np.asarray(low, dtype=float), MM * np.asarray(high, dtype=float)
    return Manifold.cube(tuple(high - low)).translate(tuple(low))


def hull(points) -> Manifold:
    """The convex hull of points (n, 3) m."""
    from manifold3d import Manifold

    return Manifold.hull_points(MM * np.asarray(points, dtype=float))


def union(parts) -> Manifold:
    """All in one."""
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean(list(parts), OpType.Add)


def common(first: Manifold, second: Manifold) -> Manifold:
    """What is in both."""
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean([first, second], OpType.Intersect)


def minus(whole: Manifold, parts) -> Manifold:
    """``whole`` without ``parts``."""
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean([whole, *parts], OpType.Subtract)


def mesh_of(whole: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) m and faces (m, 3) of a solid, closed; corners on a fine grid."""
    mesh = whole.to_mesh64()
    points = np.round(np.asarray(mesh.vert_properties)[:, :3] / GRID) * GRID
    points, merged = np.unique(points, axis=0, return_inverse=True)
    faces = merged.reshape(-1)[np.asarray(mesh.tri_verts, dtype=np.int64)]
    a, b, c = faces.T
    return points / MM, faces[(a != b) & (b != c) & (c != a)]
