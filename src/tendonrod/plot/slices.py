"""Closed meshes cut for pictures: outlines at a height z for axial sections, and what is left beyond planes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]  # vertices (n, 3) and faces (m, 3), counter-clockwise seen from outside
Plane = tuple[np.ndarray, float]  # normal and offset: the part where normal . p >= offset stays
ON = 1e-3  # of a cut: vertices so near to the plane (mm) lie on it


def cut(vertices: np.ndarray, faces: np.ndarray, planes: Iterable[Plane]) -> Mesh:
    """The part of a closed mesh beyond all ``planes``, closed again; the mesh as it is where it is not closed."""
    from manifold3d import Manifold
    from manifold3d import Mesh as Solid

    if not len(faces):
        return vertices, faces
    points, triangles = np.ascontiguousarray(vertices, dtype=np.float32), np.ascontiguousarray(faces, dtype=np.uint32)
    solid = Manifold(Solid(vert_properties=points, tri_verts=triangles))
    if solid.is_empty():
        return vertices, faces
    for normal, offset in planes:
        size = float(np.linalg.norm(normal))
        solid = solid.trim_by_plane(tuple((np.asarray(normal) / size).tolist()), offset / size)
    left = solid.to_mesh()
    return np.array(left.vert_properties[:, :3], dtype=float), np.array(left.tri_verts, dtype=np.int64)


def part(mesh: Mesh, plane: Plane) -> Mesh:
    """The faces that lie in ``plane``, where the mesh was cut."""
    vertices, faces = mesh
    normal, offset = plane
    on = np.abs(vertices @ normal - offset) < ON * np.linalg.norm(normal)
    return vertices, faces[on[faces].all(axis=1)]


def outlines(vertices: np.ndarray, faces: np.ndarray, z: float) -> list[np.ndarray]:
    """Closed outlines (k, 2) m, x and y, first point repeated, of a closed mesh at height ``z``.

    vertices (n, 3) m, faces (m, 3) counter-clockwise seen from outside: an outline runs clockwise or counter-clockwise
    seen from +z, and one around a hole the other way, so that the rule of nonzero winding fills the solid.
    """
    above = vertices[:, 2] >= z  # a vertex in the plane counts as above, so every cut crosses edges between vertices
    cut = faces[np.ptp(above[faces].astype(int), axis=1) > 0]
    after = np.roll(cut, -1, axis=1)
    down, up = above[cut] & ~above[after], ~above[cut] & above[after]
    starts, ends = np.stack([cut[down], after[down]], axis=1), np.stack([after[up], cut[up]], axis=1)
    points = _crossings(vertices, starts, z)
    return _chained(list(map(tuple, starts.tolist())), list(map(tuple, ends.tolist())), points)


def _crossings(vertices: np.ndarray, edges: np.ndarray, z: float) -> np.ndarray:
    """(k, 2) where edges from above to below meet the plane."""
    top, bottom = vertices[edges[:, 0]], vertices[edges[:, 1]]
    share = ((top[:, 2] - z) / (top[:, 2] - bottom[:, 2]))[:, None]
    return ((1.0 - share) * top + share * bottom)[:, :2]


def _chained(starts: list[tuple], ends: list[tuple], points: np.ndarray) -> list[np.ndarray]:
    """Each triangle leads from the edge where its outline goes down to the one where it comes up."""
    following = dict(zip(starts, ends, strict=True))
    place = {edge: k for k, edge in enumerate(starts)}
    found = []
    while following:
        first = edge = next(iter(following))
        chain = []
        while edge in following:
            chain.append(place[edge])
            edge = following.pop(edge)
        if edge == first and len(chain) > 2:
            found.append(points[[*chain, chain[0]]])
    return found
