"""Meshes for tests: a cylinder along z and a ball, metres, and brute force over their triangles."""

import numpy as np

RADIUS, HEIGHT = 4e-3, 20e-3


def cylinder(radius=RADIUS, low=0.0, high=HEIGHT, sides=96, rings=11):
    """Vertices and faces of a closed cylinder around the z axis."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = np.linspace(low, high, rings)
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, each)]) for each in z])
    here, after = np.arange(sides), np.roll(np.arange(sides), -1)
    faces = []
    for k in range(rings - 1):
        a, b = k * sides + here, k * sides + after
        faces += [np.stack([a, b, b + sides], 1), np.stack([a, b + sides, a + sides], 1)]
    last, n = (rings - 1) * sides, len(vertices)
    faces += [np.stack([after, here, np.full(sides, n)], 1)]
    faces += [np.stack([last + here, last + after, np.full(sides, n + 1)], 1)]
    return np.vstack([vertices, [0.0, 0.0, low], [0.0, 0.0, high]]), np.concatenate(faces)


def by_brute_force(p, vertices, faces):
    """Distance from p to the nearest of all triangles: along the normal of one that p lies above, or to a side."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sides = ((a, b), (b, c), (c, a))
    inside = np.all([_dot(np.cross(y - x, p - x), normal) >= 0.0 for x, y in sides], axis=0)
    above = np.abs(_dot(p - a, normal))[inside]
    return float(min(above.min(initial=np.inf), *(_to_side(p, x, y).min() for x, y in sides)))


def _to_side(p, x, y):
    share = np.clip(_dot(p - x, y - x) / _dot(y - x, y - x), 0.0, 1.0)
    return np.linalg.norm(p - x - share[:, None] * (y - x), axis=1)


def _dot(x, y):
    return np.einsum("ij,ij->i", x, y)


def solid_angle(p, vertices, faces):
    """How often the mesh winds around p (van Oosterom and Strackee 1983): 1 inside, 0 outside."""
    a, b, c = np.moveaxis(vertices[faces] - p, 1, 0)
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a)))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    return float(np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2.0 * np.pi))
