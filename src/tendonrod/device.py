"""What is manufactured: the notch pattern of a tube, its unrolled drawing for a laser cutter, and its solid mesh.

Frame: z along the tube's axis from the base (z = 0) to the tip (z = L); angles about z from the world x axis, with the
robot unloaded. SI units; files that leave the program are in millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, pi
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from .errors import InvalidInput, whole
from .files import complete, file_name
from .robot import Robot
from .section import NotchedTube

if TYPE_CHECKING:
    from trimesh import Trimesh

MM = 1e3
MOST_SEGMENTS = 10_000


@dataclass(frozen=True, kw_only=True)
class Notch:
    """One rectangle of the unrolled sheet: z_start to z_end (m), cut_angle -+ half_cut (rad).

    backbone_angle: centre of the uncut arc, opposite to cut_angle (rad, not wrapped).
    """

    z_start: float
    z_end: float
    backbone_angle: float
    half_cut: float

    @property
    def cut_angle(self) -> float:
        """Centre of the removed part (rad, not wrapped)."""
        return self.backbone_angle + pi


def notch_pattern(robot: Robot) -> list[Notch]:
    """Notches from base to tip: as many as fit, centred so that both solid ends are equal and at least d long.

    Each notch has one orientation, that of the uncut arc at its middle: pi + 2 pi turns z / L (paper, section II).
    Raises `InvalidInput` for a plain rod.
    """
    tube = notched_tube(robot)
    w, d = tube.notch_width, tube.notch_spacing
    count = floor((tube.length - d) / (w + d) + 1e-9)
    margin = 0.5 * (tube.length - count * w - (count - 1) * d)
    starts = margin + (w + d) * np.arange(count)
    return [_notch(tube, float(start)) for start in starts]


def notched_tube(robot: Robot) -> NotchedTube:
    """The robot's tube; `InvalidInput` where it is a plain rod."""
    if not isinstance(robot.body, NotchedTube):
        raise InvalidInput("robot", robot.name, "a notched tube; a plain rod has no notches")
    return robot.body


def _notch(tube: NotchedTube, start: float) -> Notch:
    middle = start + 0.5 * tube.notch_width
    return Notch(
        z_start=start,
        z_end=start + tube.notch_width,
        backbone_angle=pi + 2.0 * pi * tube.turns * middle / tube.length,
        half_cut=pi - 0.5 * tube.uncut_angle,
    )


def write_dxf(robot: Robot, path: str | PathLike[str]) -> None:
    """Write the unrolled pattern as DXF (mm): x = r_out theta in [0, 2 pi r_out], y = z; laser cuts on layer NOTCHES.

    A notch that crosses the seam theta = 0 is two closed polylines. Layers: NOTCHES, OUTLINE, NOTE.
    Raises `InvalidInput` for a plain rod, a suffix other than .dxf, or a path that can't be written.
    """
    tube, target = notched_tube(robot), file_name("path", path, (".dxf",))
    from ezdxf import units
    from ezdxf.filemanagement import new

    drawing = new("R2010", setup=False, units=units.MM)
    for layer, colour in (("NOTCHES", 1), ("OUTLINE", 7), ("NOTE", 8)):
        drawing.layers.add(layer, color=colour)
    sheet = drawing.modelspace()
    r, length = MM * tube.outer_radius, MM * tube.length
    sheet.add_lwpolyline(_rectangle(0.0, 2.0 * pi * r, 0.0, length), close=True, dxfattribs={"layer": "OUTLINE"})
    pattern = notch_pattern(robot)
    for notch in pattern:
        for low, high in _unwrapped(notch):
            corners = _rectangle(r * low, r * high, MM * notch.z_start, MM * notch.z_end)
            sheet.add_lwpolyline(corners, close=True, dxfattribs={"layer": "NOTCHES"})
    note = sheet.add_mtext(_note(robot.name, tube, len(pattern)), dxfattribs={"layer": "NOTE", "char_height": 0.5})
    note.set_location((2.0 * pi * r + 1.0, length))
    with complete("path", target) as draft:
        drawing.saveas(draft)


def _unwrapped(notch: Notch) -> list[tuple[float, float]]:
    """Angle intervals of the removed part inside [0, 2 pi]."""
    low = (notch.cut_angle - notch.half_cut) % (2.0 * pi)
    high = low + 2.0 * notch.half_cut
    return [(low, high)] if high <= 2.0 * pi else [(low, 2.0 * pi), (0.0, high - 2.0 * pi)]


def _rectangle(x0: float, x1: float, y0: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def _note(name: str, tube: NotchedTube, count: int) -> str:
    r_o, r_i, length = MM * tube.outer_radius, MM * tube.inner_radius, MM * tube.length
    w, d, psi = MM * tube.notch_width, MM * tube.notch_spacing, np.degrees(tube.uncut_angle)
    notches, turns = ("notch" if count == 1 else "notches"), ("turn" if abs(tube.turns) == 1.0 else "turns")
    lines = (
        f"{name}: unrolled at the outer radius, seen from outside; millimetres",
        f"x = r_out theta, y = z; tube diameters {2 * r_o:.4g} and {2 * r_i:.4g}, length {length:.5g}",
        f"{count} {notches}: width {w:.4g}, spacing {d:.4g}, uncut arc {psi:.5g} deg, {tube.turns:.4g} {turns}",
        "a notch across the seam is drawn as two closed outlines",
    )
    return "\\P".join(lines)


def tube_mesh(robot: Robot, segments: int = 128) -> Trimesh:
    """The notched tube as a watertight mesh in metres, circles of ``segments`` (12 to 10,000) edges.

    Raises `InvalidInput` for a plain rod.
    """
    tube = notched_tube(robot)
    segments = whole("segments", segments, 12, MOST_SEGMENTS)
    from manifold3d import CrossSection, Manifold, OpType
    from trimesh import Trimesh

    length, r_i, r_o = MM * tube.length, MM * tube.inner_radius, MM * tube.outer_radius
    wall = CrossSection.circle(r_o, segments) - CrossSection.circle(r_i, segments)
    cutter = Manifold.extrude(CrossSection([_sector(tube, 2.0 * r_o, segments)]), MM * tube.notch_width)
    cutters = [
        cutter.rotate((0.0, 0.0, np.degrees(notch.cut_angle))).translate((0.0, 0.0, MM * notch.z_start))
        for notch in notch_pattern(robot)
    ]
    solid = Manifold.batch_boolean([Manifold.extrude(wall, length), *cutters], OpType.Subtract).to_mesh64()
    points, faces = _without_slivers(np.asarray(solid.vert_properties)[:, :3], np.asarray(solid.tri_verts))
    return Trimesh(points / MM, faces, process=False)


def _without_slivers(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points on a grid of 0.1 um, which files of single precision can hold, and the faces that keep three corners."""
    points, merged = np.unique(np.round(points, 4), axis=0, return_inverse=True)
    faces = merged.reshape(-1)[faces]
    first, second, third = faces.T
    return points, faces[(first != second) & (second != third) & (third != first)]


def _sector(tube: NotchedTube, radius: float, segments: int) -> np.ndarray:
    """Polygon (n, 2) of the removed sector about angle 0, its apex on the axis and its rim well outside the tube."""
    half = pi - 0.5 * tube.uncut_angle
    angles = np.linspace(-half, half, max(8, segments))
    return np.vstack([np.zeros((1, 2)), radius * np.column_stack([np.cos(angles), np.sin(angles)])])


def write_mesh(robot: Robot, path: str | PathLike[str], segments: int = 128) -> None:
    """Write `tube_mesh` as STL in millimetres. Raises `InvalidInput` as `write_dxf` does, the suffix being .stl."""
    notched_tube(robot)
    target = file_name("path", path, (".stl",))
    mesh = tube_mesh(robot, segments)
    mesh.apply_scale(MM)
    with complete("path", target) as draft:
        mesh.export(draft)
