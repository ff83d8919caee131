"""Parametric phantoms put together: meshes, distances, targets, entries, gaps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..surface import Surface
from . import nerves, printed, vertebrae
from .column import BELOW, Column
from .dimensions import QUANTITIES, Dimensions
from .distances import distance_grid
from .phantom import Entry, Phantom, Structure
from .solids import mesh_of, ring, union
from .targets import all_targets

if TYPE_CHECKING:
    from manifold3d import Manifold

REACH = (2.5e-3, 6e-3, 4e-3)  # m to which distances are held beyond the canal's wall, into the foramina, the ends
AROUND = 720  # points of an outline where gaps are measured
LONGEST = 3.0  # mm, edge of a triangle whose distance is asked for: long ones make wide boxes
COARSE = 0.8e-3  # m between nodes around cord and dura, which are smooth, and roots, which are no walls


def printed_phantom(names: tuple[str, ...], numbers: Dimensions, name: str = "printed") -> Phantom:
    """Cord in a canal, as the paper's phantom; see `printed`."""
    column = Column(names=names, numbers=numbers, has_dura=False)
    low, high, more = -BELOW, column.top, printed.BEYOND
    cord, canal = nerves.cord(column, low, high), printed.block(column, low, high)
    walls = {
        "cord": _around(column, nerves.cord(column, low - more, high + more), COARSE),
        "canal": _around(column, printed.block(column, low - more, high + more)),
    }
    structures = [
        _structure("cord", "cord", cord, walls["cord"], is_wall=True),
        _structure("canal", "canal", canal, walls["canal"], is_wall=True),
    ]
    return assembled(name, "printed", structures, column)


def anatomical_phantom(names: tuple[str, ...], numbers: Dimensions, name: str = "anatomical") -> Phantom:
    """Cord, dura, vertebrae with windows and foramina, discs, ligaments, roots and ganglia.

    Walls are the dura and the wall of the canal, of bone, discs and ligaments in one; roots give way, and only their
    clearance is told.
    """
    column = Column(names=names, numbers=numbers, has_dura=True)
    low, high, more = -BELOW, column.top, printed.BEYOND
    roots, ganglia = nerves.roots(column), nerves.ganglia(column)
    cord = _around(column, nerves.cord(column, low - more, high + more), COARSE)
    dura = _around(column, nerves.dura(column, low - more, high + more), COARSE)
    bone = _around(column, vertebrae.wall(column, low - more, high + more))
    structures = [
        _structure("cord", "cord", nerves.cord(column, low, high), cord),
        _structure("dura", "dura", nerves.dura(column, low, high), dura, is_wall=True),
        _structure("bone", "bone", vertebrae.vertebrae(column), bone, is_wall=True),
        _structure("discs", "disc", vertebrae.discs(column)),
        _structure("ligaments", "ligament", vertebrae.ligaments(column)),
        _structure("roots", "root", roots, _around(column, union([roots, ganglia]), COARSE)),
        _structure("ganglia", "ganglion", ganglia),
    ]
    return assembled(name, "anatomical", structures, column)


def assembled(name: str, kind: str, structures: list[Structure], column: Column) -> Phantom:
    """A phantom of ``structures`` with what the column says of targets, entries, gaps and sources."""
    return Phantom(
        name=name,
        kind=kind,
        structures={each.name: each for each in structures},
        targets=all_targets(column),
        levels=column.levels,
        sources=sources(column.numbers),
        entries={each: entry(column, each) for each in column.names if column.has_window(each)},
        gaps={each: gaps(column, each) for each in column.names},
        plan=column,
    )


def sources(numbers: Dimensions) -> dict[str, str]:
    """Of each number, by its name with the unit."""
    return {f"{name}_mm": numbers.quantity(name).source for name in QUANTITIES}


def entry(column: Column, level: str) -> Entry:
    """Through the window below the lamina of ``level``."""
    z, height, width = column.window(level)
    inner, canal = column.inner([z]), column.canal([z])
    depth = 0.5 * float(inner.dorsal[0] + canal.dorsal[0])
    offset = float(canal.middle[0, 1]) + 0.0  # no -0
    return Entry(level=level, height=z, depth=depth, offset=offset, window=(height, width))


def gaps(column: Column, level: str) -> Mapping[str, float]:
    """Room between what the robot goes round and the canal's wall at the middle of a body, m.

    dorsal and ventral: on the midline; left and right: the narrowest within 45 degrees, which the robot must pass.
    """
    z = [column.level(level).middle]
    (inner,), (canal,) = (ring(e.middle, e.depth, e.width, AROUND) for e in (column.inner(z), column.canal(z)))
    free = np.linalg.norm(inner[:, None] - canal, axis=2).min(axis=1)  # of nested outlines
    quarter, eighth = AROUND // 4, AROUND // 8
    right, left = (float(free[i - eighth : i + eighth + 1].min()) for i in (quarter, 3 * quarter))
    return {"dorsal": float(free[0]), "ventral": float(free[2 * quarter]), "left": left, "right": right}


def _structure(
    name: str, role: str, solid: Manifold, surface: Surface | None = None, is_wall: bool = False
) -> Structure:
    vertices, faces = mesh_of(solid)
    return Structure(name=name, role=role, vertices=vertices, faces=faces, surface=surface, is_wall=is_wall)


def _around(column: Column, solid: Manifold, spacing: float | None = None) -> Surface:
    """Signed distance to a solid that goes on beyond the phantom, held wherever a robot can be."""
    z = column.heights(-BELOW, column.top)
    canal = column.canal(z)
    low = [canal.ventral.min(), (canal.middle[:, 1] - canal.width).min()]
    high = [canal.dorsal.max(), (canal.middle[:, 1] + canal.width).max()]
    low, high = np.array([*low, z[0]]) - REACH, np.array([*high, z[-1]]) + REACH
    vertices, faces = mesh_of(solid.refine_to_length(LONGEST))
    return distance_grid(vertices, faces, low, high, **({} if spacing is None else {"spacing": spacing}))
