"""The printed phantom: a mock cord in a block with the canal, as the paper's; no dura.

The block has a window between laminae at each level for the dorsal entry and openings at the ganglia.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .column import BELOW, Column
from .solids import box, loft, loft_through, minus, ring

if TYPE_CHECKING:
    from manifold3d import Manifold

BEYOND = 20e-3  # m by which walls go on beyond the phantom where distances are taken
CORNER = 3e-3  # m, bevel of the block
PLAY = 2e-3  # m by which a cutter sticks out


def void(column: Column, low: float, high: float) -> Manifold:
    """The canal between two heights."""
    z = column.heights(low, high)
    sections = column.canal(z)
    return loft(ring(sections.middle, sections.depth, sections.width), z)


def foramina(column: Column, reach: float) -> list[Manifold]:
    """A channel across each foramen, both sides in one, ``reach`` m to either side."""
    found = []
    for name in column.names:
        (x, y, z), half = column.foramen(name)
        angle = 2.0 * np.pi * np.arange(48) / 48
        outline = np.stack([x + half[0] * np.cos(angle), np.full(48, y - reach), z + half[1] * np.sin(angle)], axis=1)
        found.append(_across(outline, 2.0 * reach))
    return found


def _across(outline: np.ndarray, length: float) -> Manifold:
    return loft_through(np.stack([outline, outline + np.array([0.0, length, 0.0])])[:, ::-1])


def windows(column: Column, outside: float) -> list[Manifold]:
    """A dorsal opening between laminae below each level, out to x = ``outside``."""
    found = []
    for name in column.names:
        z, height, width = column.window(name)
        if column.has_window(name):
            canal = column.canal([z])
            x, y = canal.middle[0]
            found.append(box((x, y - width, z - height), (outside, y + width, z + height)))
    return found


def block_size(column: Column) -> tuple[np.ndarray, np.ndarray]:
    """Corners x, y (2,) m of the block's cross-section, which holds the widest canal and the wall."""
    canal = column.canal(column.heights(-BELOW, column.top))
    wall = column.numbers.of("printed_wall", column.names[0])
    low = np.array([canal.ventral.min(), (canal.middle[:, 1] - canal.width).min()]) - wall
    high = np.array([canal.dorsal.max(), (canal.middle[:, 1] + canal.width).max()]) + wall
    return low, high


def outline(column: Column) -> np.ndarray:
    """(8, 2) bevelled rectangle of the block, m, counter-clockwise."""
    (x0, y0), (x1, y1) = block_size(column)
    left, right, below, above = y0 + CORNER, y1 - CORNER, x0 + CORNER, x1 - CORNER
    return np.array(
        [(above, y0), (x1, left), (x1, right), (above, y1), (below, y1), (x0, right), (x0, left), (below, y0)]
    )


def block(column: Column, low: float, high: float) -> Manifold:
    """The block with canal, windows and openings between two heights."""
    (_, y0), (x1, y1) = block_size(column)
    whole = loft(np.broadcast_to(outline(column), (2, 8, 2)), [low, high])
    inside = void(column, low - PLAY, high + PLAY)
    return minus(whole, [inside, *foramina(column, y1 - y0), *windows(column, x1 + PLAY)])
