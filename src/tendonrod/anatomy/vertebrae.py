"""Vertebrae, discs and yellow ligaments around a canal: simple solids, recognisable, with the canal cut out exactly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import printed
from .column import BELOW, Column
from .solids import common, ellipsoid, hull, loft, loft_through, minus, ring, union

if TYPE_CHECKING:
    from manifold3d import Manifold

WAIST = 0.08  # by which a body is narrower at its middle
OVERLAP = 2e-3  # m by which a body reaches over the front of the canal, which is then cut out of it
PEDICLE = 0.45  # share of a body's height above which its pedicles stand
FACET = np.radians(52.0)  # of the joints between arches, from dorsal towards lateral
JOIN = 0.5e-3  # m
BEHIND = 1e-3  # m, of a lamina, to which its window is cut
CUT = 30e-3  # m, beyond every wall


def vertebrae(column: Column) -> Manifold:
    """All vertebrae, with canal, foramina and interlaminar windows open."""
    return _opened(column, minus(_bones(column), _windows(column)))


def discs(column: Column) -> Manifold:
    """The discs below all levels."""
    return _opened(column, union(_disc(column, name) for name in column.names))


def ligaments(column: Column) -> Manifold:
    """The yellow ligaments, which close the interlaminar windows flush with the canal."""
    return _opened(column, common(_sheet(column), union(_windows(column))))


def spine(column: Column) -> Manifold:
    """Vertebrae, discs and ligaments in one piece, to print: the parts overlap by ``JOIN``."""
    windows = common(_sheet(column), union(_windows(column, JOIN)))
    bones = minus(_bones(column), _windows(column))
    return _opened(column, union([bones, windows, *(_disc(column, name, JOIN) for name in column.names)]))


def _bones(column: Column) -> Manifold:
    return union(part for name in column.names for part in (_body(column, name), *_arch(column, name)))


def _disc(column: Column, name: str, join: float = 0.0) -> Manifold:
    level, share = column.level(name), np.linspace(0.0, 1.0, 7)
    z = level.z_low - level.disc - join + share * (level.disc + 2.0 * join)
    return _plate(column, name, z, 0.98 + 0.03 * np.sin(np.pi * share))


def _sheet(column: Column) -> Manifold:
    """The canal's surroundings, as thick as the ligaments are."""
    z = column.heights(-2.0 * CUT, column.top + CUT)
    canal, thick = column.canal(z), column.at("ligament", z)
    return loft(ring(canal.middle, canal.depth + thick, canal.width + thick), z)


def _opened(column: Column, whole: Manifold) -> Manifold:
    """What lies between the ends of the phantom, with canal and foramina cut out."""
    cutters = [printed.void(column, -3.0 * CUT, column.top + 3.0 * CUT), *printed.foramina(column, CUT)]
    between = minus(whole, cutters).trim_by_plane((0.0, 0.0, 1.0), -1e3 * BELOW)
    return between.trim_by_plane((0.0, 0.0, -1.0), -1e3 * column.top)


def wall(column: Column, low: float, high: float) -> Manifold:
    """What bounds the canal from outside, in one: bone, discs and ligaments, open at the foramina and at both ends."""
    z = column.heights(low, high)
    canal = column.canal(z).grown(2.0 * CUT / 3.0)
    whole = loft(ring(canal.middle, canal.depth, canal.width), z)
    return minus(whole, [printed.void(column, low - 1e-3, high + 1e-3), *printed.foramina(column, CUT)])


def _body(column: Column, name: str) -> Manifold:
    level = column.level(name)
    share = np.linspace(0.0, 1.0, 13)
    rim = 1.0 - 0.02 * np.exp(-np.minimum(share, 1.0 - share) / 0.03)
    size = rim * (1.0 - WAIST * np.sin(np.pi * share))
    return _plate(column, name, level.z_low + share * (level.z_high - level.z_low), size)


def _plate(column: Column, name: str, z: np.ndarray, size: np.ndarray) -> Manifold:
    """Ellipses in front of the canal, scaled by ``size``; their back stays where it is."""
    depth, width = 0.5 * column.numbers.of("body_depth", name), 0.5 * column.numbers.of("body_width", name)
    canal = column.canal([column.level(name).middle])
    back = canal.ventral[0] + OVERLAP
    middle = np.stack([back - depth * np.ones_like(size), np.full(size.shape, canal.middle[0, 1])], axis=1)
    return loft(ring(middle, depth * size, width * size), z)


def _arch(column: Column, name: str) -> list[Manifold]:
    level, numbers = column.level(name), column.numbers
    height = level.z_high - level.z_low
    pedicle, thick = level.z_low + PEDICLE * height, numbers.of("lamina", name)
    upper = _ring(column, pedicle, level.z_high - 0.05 * height, thick)
    lower = _ring(column, level.z_low - 0.8 * level.disc, pedicle + 1e-3, thick)
    x = column.foramen(name)[0][0] + 0.5 * numbers.of("foramen_depth", name)
    return [upper, lower.trim_by_plane((1.0, 0.0, 0.0), 1e3 * x), *_processes(column, name), *_facets(column, name)]


def _ring(column: Column, low: float, high: float, thick: float) -> Manifold:
    z = column.heights(low, high)
    canal = column.canal(z).grown(thick)
    return loft(ring(canal.middle, canal.depth, canal.width), z)


def _processes(column: Column, name: str) -> list[Manifold]:
    level, numbers = column.level(name), column.numbers
    height, thick = level.z_high - level.z_low, numbers.of("lamina", name)
    canal = column.canal([level.middle])
    (x, y), depth, width = canal.middle[0], canal.depth[0], canal.width[0]
    root, tip = x + depth + 0.5 * thick, x + depth + thick + numbers.of("spinous_length", name)
    low, drop = level.z_low + 0.1 * height, numbers.of("spinous_drop", name)
    blade = [(root, y + s * 2.5e-3, low + h * height) for s in (-1, 1) for h in (0.0, 0.65)]
    blade += [(tip, y + s * 2.0e-3, low + h * height - drop) for s in (-1, 1) for h in (0.08, 0.5)]
    found, z = [hull(blade)], level.z_low + 0.68 * height
    for sign in (-1.0, 1.0):
        side = sign * (width + 0.6 * thick)
        far = side + sign * numbers.of("transverse_length", name)
        wing = [(x + 0.1 * depth + a, y + side, z + b) for a in (-3e-3, 3e-3) for b in (-4e-3, 4e-3)]
        wing += [(x + 0.9 * depth + a, y + far, z + b) for a in (-2e-3, 2e-3) for b in (-2.5e-3, 2.5e-3)]
        found.append(hull(wing))
    return found


def _facets(column: Column, name: str) -> list[Manifold]:
    """The joint with the arch below, one lump on each side."""
    level = column.level(name)
    z, half = level.z_low - 0.35 * level.disc, 0.6 * level.disc  # clear of the arch below
    canal, thick, found = column.canal([z]), column.numbers.of("lamina", name), []
    for sign in (-1.0, 1.0):
        away = np.array([np.cos(FACET) * (canal.depth[0] + thick), sign * np.sin(FACET) * (canal.width[0] + thick)])
        found.append(ellipsoid((*(canal.middle[0] + away), z), np.eye(3), (thick, thick, half)))
    return found


def _windows(column: Column, grown: float = 0.0) -> list[Manifold]:
    """An elliptic channel through each interlaminar window and no further: spinous processes overhang it."""
    found = []
    for name in column.names:
        z, height, width = column.window(name)
        canal = column.canal([z])
        (x, y), angle = canal.middle[0], 2.0 * np.pi * np.arange(48) / 48
        length = canal.depth[0] + column.numbers.of("lamina", name) + BEHIND
        outline = np.stack(
            [np.full(48, x), y + (width + grown) * np.cos(angle), z + (height + grown) * np.sin(angle)], axis=1
        )
        found.append(loft_through(np.stack([outline, outline + np.array([length, 0.0, 0.0])])))
    return found
