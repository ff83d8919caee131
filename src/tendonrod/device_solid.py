"""Plane facets of a notched tube, a rod and tendons, and their shaded parallel projection. Millimetres."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from .device import MM, Notch
from .section import NotchedTube

STEEL, BORE, CUT, CORD = 0, 1, 2, 3  # kinds of surface
COLOURS = np.array([[0.80, 0.835, 0.88], [0.60, 0.635, 0.69], [0.93, 0.72, 0.50], [0.25, 0.45, 0.90]])
_LIGHT = np.array([-0.35, 0.75, 0.56])  # in the picture's axes: right, up, towards the eye


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Quadrilaterals: corners (n, 4, 3) in mm, outward normals (n, 3), kind (n,) as an index of `COLOURS`."""

    corners: np.ndarray
    normals: np.ndarray
    kind: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Projection:
    """Axes of the picture in the robot's frame, as rows: right, up, towards the eye."""

    axes: np.ndarray

    @classmethod
    def along_z(cls, *, up_angle: float, yaw: float, elevation: float) -> Projection:
        """z runs to the right; the direction at ``up_angle`` around z points up before turning and tilting (rad).

        Positive yaw turns the far end (+z) towards the eye; positive elevation looks down from above.
        """
        z = np.array([0.0, 0.0, 1.0])
        up = np.array([cos(up_angle), sin(up_angle), 0.0])
        eye = np.cross(z, up)
        right, eye = cos(yaw) * z - sin(yaw) * eye, cos(yaw) * eye + sin(yaw) * z
        up, eye = cos(elevation) * up - sin(elevation) * eye, cos(elevation) * eye + sin(elevation) * up
        return cls(axes=np.array([right, up, eye]))

    def points(self, positions: np.ndarray) -> np.ndarray:
        """(..., 3) positions to (..., 2) points of the picture."""
        return positions @ self.axes[:2].T

    def facing(self, directions: np.ndarray) -> np.ndarray:
        """Whether (..., 3) directions point towards the eye."""
        return directions @ self.axes[2] > 0.0

    def polygons(self, facets: Facets) -> tuple[np.ndarray, np.ndarray]:
        """Facets that face the eye, from far to near: (m, 4, 2) polygons and (m, 3) colours."""
        near = self.facing(facets.normals)
        corners, normals, kind = facets.corners[near], facets.normals[near], facets.kind[near]
        order = np.argsort(corners.mean(axis=1) @ self.axes[2], kind="stable")
        return self.points(corners[order]), self._shaded(normals[order], COLOURS[kind[order]])

    def _shaded(self, normals: np.ndarray, colours: np.ndarray) -> np.ndarray:
        light = _LIGHT / np.linalg.norm(_LIGHT)
        half = light + np.array([0.0, 0.0, 1.0])
        in_picture = normals @ self.axes.T
        diffuse = np.clip(in_picture @ light, 0.0, 1.0)[:, None]
        gloss = np.clip(in_picture @ (half / np.linalg.norm(half)), 0.0, 1.0)[:, None] ** 30
        return np.clip(colours * (0.50 + 0.52 * diffuse) + 0.22 * gloss, 0.0, 1.0)


def tube_facets(tube: NotchedTube, notches: list[Notch], ends: tuple[float, float], step: float) -> Facets:
    """Surface of the tube between the two ``ends`` (m along z), with arcs cut into pieces of at most ``step`` rad.

    ``notches`` are those that lie wholly between the ends.
    """
    r_i, r_o = MM * tube.inner_radius, MM * tube.outer_radius
    low, high = MM * ends[0], MM * ends[1]
    parts, z = [_annulus(r_i, r_o, 0.0, 2.0 * pi, low, -1.0, step)], low
    for notch in notches:
        start, end, centre, half = MM * notch.z_start, MM * notch.z_end, notch.cut_angle, notch.half_cut
        parts += _walls(r_i, r_o, 0.0, 2.0 * pi, z, start, step)
        parts += _walls(r_i, r_o, centre + half, centre + 2.0 * pi - half, start, end, step)
        parts += [_annulus(r_i, r_o, centre - half, centre + half, start, 1.0, step)]
        parts += [_annulus(r_i, r_o, centre - half, centre + half, end, -1.0, step)]
        parts += [_radial(r_i, r_o, centre - half, start, end, 1.0), _radial(r_i, r_o, centre + half, start, end, -1.0)]
        z = end
    parts += _walls(r_i, r_o, 0.0, 2.0 * pi, z, high, step)
    return joined([*parts, _annulus(r_i, r_o, 0.0, 2.0 * pi, high, 1.0, step)])


def cord_facets(path: np.ndarray, radius: float, kind: int = CORD, sides: int = 12) -> Facets:
    """A round cord of ``radius`` along ``path`` (n, 3) that runs mostly along z; mm. Both ends are closed."""
    angles = np.linspace(0.0, 2.0 * pi, sides + 1)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    surface = path[:, None] + radius * ring
    middle = 0.5 * (ring[:-1] + ring[1:])
    normals = np.broadcast_to(middle / np.linalg.norm(middle, axis=1)[:, None], (len(path) - 1, sides, 3))
    side = Facets(corners=_quads(surface), normals=normals.reshape(-1, 3), kind=np.full((len(path) - 1) * sides, kind))
    return joined([side, _cap(surface[0], -1.0, kind), _cap(surface[-1], 1.0, kind)])


def joined(parts: list[Facets]) -> Facets:
    """All facets in one."""
    return Facets(
        corners=np.concatenate([part.corners for part in parts]),
        normals=np.concatenate([part.normals for part in parts]),
        kind=np.concatenate([part.kind for part in parts]),
    )


def _cap(ring: np.ndarray, direction: float, kind: int) -> Facets:
    centre = np.broadcast_to(ring[:-1].mean(axis=0), (len(ring) - 1, 3))
    corners = np.stack([centre, ring[:-1], ring[1:], centre], axis=1)
    return _flat(corners, np.array([0.0, 0.0, direction]), kind)


def _walls(r_i: float, r_o: float, start: float, end: float, low: float, high: float, step: float) -> list[Facets]:
    """Outer and inner wall over angles start to end and heights low to high."""
    angles = _angles(start, end, step)
    middle = 0.5 * (angles[:-1] + angles[1:])
    outward = np.column_stack([np.cos(middle), np.sin(middle), np.zeros_like(middle)])
    pieces = max(1, round((high - low) / (r_o * step * 3.0)))
    heights = np.linspace(low, high, pieces + 1)
    normals = np.tile(outward, (pieces, 1))
    outer, inner = _quads(_ring(r_o, angles, heights)), _quads(_ring(r_i, angles, heights))
    return [
        Facets(corners=outer, normals=normals, kind=np.full(len(outer), STEEL)),
        Facets(corners=inner, normals=-normals, kind=np.full(len(inner), BORE)),
    ]


def _annulus(r_i: float, r_o: float, start: float, end: float, z: float, direction: float, step: float) -> Facets:
    angles = _angles(start, end, step)
    rims = np.stack([_ring(radius, angles, np.array([z]))[0] for radius in (r_i, r_o)])
    return _flat(_quads(rims), np.array([0.0, 0.0, direction]), CUT)


def _radial(r_i: float, r_o: float, angle: float, low: float, high: float, direction: float) -> Facets:
    sheet = np.stack([_ring(radius, np.array([angle]), np.array([low, high]))[:, 0] for radius in (r_i, r_o)])
    return _flat(_quads(sheet), direction * np.array([-sin(angle), cos(angle), 0.0]), CUT)


def _flat(corners: np.ndarray, normal: np.ndarray, kind: int) -> Facets:
    return Facets(corners=corners, normals=np.tile(normal, (len(corners), 1)), kind=np.full(len(corners), kind))


def _angles(start: float, end: float, step: float) -> np.ndarray:
    return np.linspace(start, end, max(2, round((end - start) / step)) + 1)


def _ring(radius: float, angles: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """(heights, angles, 3) points of a cylinder."""
    z, theta = np.meshgrid(heights, angles, indexing="ij")
    return np.stack([radius * np.cos(theta), radius * np.sin(theta), z], axis=-1)


def _quads(grid: np.ndarray) -> np.ndarray:
    """(m, n, 3) grid points to ((m-1)(n-1), 4, 3) corners."""
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2)
    return corners.reshape(-1, 4, 3)
