"""`Eye`: a parallel view from any side, and closed meshes seen through it as shaded pictures without seams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

LIGHT = np.array([0.35, 0.55, 0.75])  # towards the light: right, up, eye
AMBIENT = 0.5  # share of the light that comes from everywhere


@dataclass(frozen=True, kw_only=True)
class Eye:
    """elevation (rad): above the plane of world y and z; azimuth (rad): in that plane, from y towards z.

    World x points up in the picture and z, for small azimuths, to the right, as in `style.space`.
    """

    elevation: float = np.radians(28.0).item()
    azimuth: float = np.radians(9.0).item()

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) rows: right, up and towards the eye, world frame."""
        flat = np.array([0.0, np.cos(self.azimuth), np.sin(self.azimuth)])
        eye = np.cos(self.elevation) * flat + np.sin(self.elevation) * np.array([1.0, 0.0, 0.0])
        right = np.array([0.0, -np.sin(self.azimuth), np.cos(self.azimuth)])
        return np.array([right, np.cross(eye, right), eye])

    def project(self, points: np.ndarray) -> np.ndarray:
        """(..., 3): to the right, up and towards the eye, in the unit of ``points`` (..., 3)."""
        return np.asarray(points) @ self.axes.T

    def seen_through(self, points: np.ndarray, surface: Any, reach: float, step: float) -> np.ndarray:
        """(n,) whether nothing that ``surface`` bounds lies between ``points`` (n, 3) and the eye, within ``reach``."""
        along = np.arange(step, reach, step)
        sights = points[:, None] + along[:, None] * self.axes[2]
        depth = surface.distance(sights.reshape(-1, 3))[0].reshape(len(points), -1)
        return (depth > 0.0).all(axis=1)


def picture(
    eye: Eye, vertices: np.ndarray, faces: np.ndarray, colour: str, window: tuple[float, ...], pixel: float
) -> np.ndarray:
    """(rows, columns, 4) uint8: the triangles that face the eye, opaque and shaded, on nothing; top row first.

    vertices in mm; window: left, right, bottom, top in mm of the picture; pixel: size of one, mm.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    left, right, bottom, top = window
    rows, columns, _ = blank(window, pixel).shape
    figure = Figure(figsize=(columns / 100.0, rows / 100.0), dpi=100.0, facecolor="none")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), facecolor="none", xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()
    shapes, colours = _facets(eye, vertices, faces, colour)
    if len(shapes):
        # An edge of its own colour closes the seams between neighbours.
        axes.add_collection(PolyCollection(list(shapes), facecolors=colours, edgecolors=colours, linewidths=0.5))
    canvas.draw()
    return np.array(canvas.buffer_rgba())


def blank(window: tuple[float, ...], pixel: float) -> np.ndarray:
    """A picture of nothing, of the size of `picture`."""
    left, right, bottom, top = window
    return np.zeros((max(2, round((top - bottom) / pixel)), max(2, round((right - left) / pixel)), 4), dtype=np.uint8)


def _facets(eye: Eye, vertices: np.ndarray, faces: np.ndarray, colour: str) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (k, 3, 2) that face the eye, the farthest first, and their colours (k, 3)."""
    from matplotlib.colors import to_rgb

    seen = eye.project(vertices)[faces]
    across = np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0])
    size = np.linalg.norm(across, axis=1)
    faces_eye = across[:, 2] > 1e-9 * np.maximum(size, 1e-30)
    seen, normal = seen[faces_eye], across[faces_eye] / size[faces_eye, None]
    order = np.argsort(seen[:, :, 2].mean(axis=1))
    light = AMBIENT + (1.0 - AMBIENT) * np.clip(normal @ (LIGHT / np.linalg.norm(LIGHT)), 0.0, 1.0)
    return seen[order, :, :2], np.clip(light[order, None] * np.array(to_rgb(colour)), 0.0, 1.0)


def faded(image: np.ndarray, alpha: float) -> np.ndarray:
    """``image`` with its opacity times ``alpha``."""
    found = image.copy()
    found[..., 3] = np.round(alpha * found[..., 3]).astype(np.uint8)
    return found


def shaded(image: np.ndarray, light: float) -> np.ndarray:
    """``image`` with its brightness times ``light``."""
    found = image.copy()
    found[..., :3] = np.round(light * found[..., :3]).astype(np.uint8)
    return found


def stacked(images: Sequence[np.ndarray]) -> np.ndarray:
    """Pictures (rows, columns, 4) of one size, the first below all others."""
    from PIL import Image

    found = Image.fromarray(images[0], "RGBA")
    for image in images[1:]:
        found = Image.alpha_composite(found, Image.fromarray(image, "RGBA"))
    return np.array(found)
