"""Phantoms as STL files in millimetres: one per structure in place, and the parts to print one from.

A stretch longer than the printer's plate is cut across into equal pieces. Those of the printed phantom are pinned
together through four holes; two end plates hold the cord in the canal.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from math import ceil
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidInput, within
from . import nerves, printed, vertebrae
from .column import BELOW, Column
from .meshfile import write_stl as write_mesh
from .phantom import Phantom
from .solids import box, common, loft, mesh_of, minus, ring, tube
from .soundness import mesh_volume, open_edges

if TYPE_CHECKING:
    from manifold3d import Manifold

PLATE = 220e-3  # m, side of a common printer's plate
SHORTEST_PLATE, LONGEST_PLATE = 50e-3, 2.0
HOLDER = 4e-3  # m, thickness of an end plate
PLAY = 0.15e-3  # m between parts that fit into each other
HUB, SPOKE = 2.5e-3, 3e-3  # m, width of an end plate's ring around the cord and of the spokes that hold it
PIN = 1.1e-3  # m, radius of the holes, for pins of 2 mm
PIN_FROM_EDGE, PIN_DEPTH = 4.5e-3, 8e-3  # m
MM = 1e3


@dataclass(frozen=True, kw_only=True)
class Part:
    """One file: what it is, its size (mm) along x, y and z, its volume and whether it is closed."""

    file: str
    what: str
    size_mm: tuple[float, ...]
    volume_mm3: float
    is_watertight: bool


def write_stl(phantom: Phantom, folder: str | PathLike[str], plate: float = PLATE) -> tuple[Part, ...]:
    """Writes the phantom to ``folder``, made if need be, with manifest.json that says what is what.

    plate: longest side (m) of what the printer takes. Raises `InvalidInput` where nothing can be written there.
    """
    within("plate", plate, SHORTEST_PLATE, LONGEST_PLATE)
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("folder", str(folder), f"a directory that can be made: {error.strerror}") from None
    files = [(each.name, f"{each.role}, in place", *each.mesh) for each in phantom.structures.values()]
    files += [(name, what, *mesh_of(whole)) for name, what, whole in _printable(phantom, plate)]
    parts = tuple(_written(folder, phantom, *each) for each in files)
    from ..files import complete

    with complete("folder", folder / "manifest.json") as draft:
        draft.write_text(json.dumps(_manifest(phantom, plate, parts), indent=1) + "\n", encoding="utf-8")
    return parts


def _written(folder: Path, phantom: Phantom, name: str, what: str, vertices, faces) -> Part:
    write_mesh(folder / f"{name}.stl", vertices, faces, MM, f"tendonrod {phantom.name}: {name}, mm", field="folder")
    return Part(
        file=f"{name}.stl",
        what=what,
        size_mm=tuple(round(MM * float(side), 3) for side in np.ptp(vertices, axis=0)),
        volume_mm3=round(1e9 * mesh_volume(vertices, faces), 3),
        is_watertight=not len(open_edges(faces)),
    )


def _manifest(phantom: Phantom, plate: float, parts: tuple[Part, ...]) -> dict:
    pins = {"pins": "2 mm, through the holes at the corners"} if phantom.kind == "printed" else {}
    return {
        "phantom": phantom.name,
        "kind": phantom.kind,
        "unit": "mm",
        "frame": "x dorsal, y the patient's right, z cranial; origin on the axis of the cord",
        "plate_mm": MM * plate,
        **pins,
        "levels": [{"name": e.name, "z_low_mm": MM * e.z_low, "z_high_mm": MM * e.z_high} for e in phantom.levels],
        "targets": [{"name": e.name, "position_mm": [MM * x for x in e.position]} for e in phantom.targets.values()],
        "files": [asdict(part) for part in parts],
    }


def _printable(phantom: Phantom, plate: float) -> Iterator[tuple[str, str, Manifold]]:
    column = phantom.plan
    if not isinstance(column, Column):
        return
    low, high = -BELOW, column.top
    if phantom.kind == "printed":
        yield from _pieces("print-cord", "the mock cord", nerves.cord(column, low - HOLDER, high + HOLDER), plate)
        whole = minus(printed.block(column, low, high), _pin_holes(column, [low, high]))
        yield from _pieces("print-canal", "the canal, pinned at its ends", whole, plate, column)
        for name, z in (("caudal", low - HOLDER), ("cranial", high)):
            yield f"print-end-{name}", f"end plate, {name}, which holds the cord", _holder(column, z)
        return
    yield from _pieces("print-spine", "vertebrae, discs and ligaments in one", vertebrae.spine(column), plate)
    yield from _pieces("print-dura", "the sac, full", nerves.dura(column, low, high), plate)


def _pieces(name: str, what: str, whole: Manifold, plate: float, column: Column | None = None) -> Iterator:
    """``whole`` cut across so that each piece fits the plate, with holes for pins at the cuts of the canal."""
    (x0, y0, z0), (x1, y1, z1) = np.array(whole.bounding_box()).reshape(2, 3) / MM
    count = ceil((z1 - z0) / plate - 1e-9)
    cuts = np.linspace(z0, z1, count + 1)
    if count == 1:
        yield name, what, whole
        return
    if column is not None:
        whole = minus(whole, _pin_holes(column, cuts[1:-1]))
    for i in range(count):
        slab = box((x0 - 1e-3, y0 - 1e-3, cuts[i]), (x1 + 1e-3, y1 + 1e-3, cuts[i + 1]))
        yield f"{name}-{i + 1}", f"{what}, piece {i + 1} of {count} from below", common(whole, slab)


def _pin_holes(column: Column, heights) -> list[Manifold]:
    low, high = printed.block_size(column)
    corners = [(x, y) for x in (low[0] + PIN_FROM_EDGE, high[0] - PIN_FROM_EDGE) for y in _inset(low[1], high[1])]
    return [tube([(x, y, z - PIN_DEPTH), (x, y, z + PIN_DEPTH)], PIN, 24) for z in heights for x, y in corners]


def _inset(low: float, high: float) -> tuple[float, float]:
    return low + PIN_FROM_EDGE, high - PIN_FROM_EDGE


def _holder(column: Column, z: float) -> Manifold:
    """An end plate from z up: the canal is open but for a ring around the cord on three spokes."""
    ends = [z, z + HOLDER]
    plate = loft(np.broadcast_to(printed.outline(column), (2, 8, 2)), ends)
    canal, cord = column.canal([z]), column.cord([z])
    through = [z - 1e-3, z + HOLDER + 1e-3]
    opening = loft(np.repeat(ring(canal.middle, canal.depth, canal.width), 2, axis=0), through)
    hub = loft(np.repeat(ring(cord.middle, cord.depth + HUB, cord.width + HUB), 2, axis=0), through)
    (x0, y0), (_, y1) = printed.block_size(column)
    x, half = cord.middle[0, 0], 0.5 * SPOKE
    spokes = [
        box((x - half, y0, through[0]), (x + half, y1, through[1])),
        box((x0, -half, through[0]), (x, half, through[1])),
    ]
    opening = minus(opening, [hub, *spokes])
    hole = loft(np.repeat(ring(cord.middle, cord.depth + PLAY, cord.width + PLAY), 2, axis=0), through)
    return minus(plate, [opening, hole, *_pin_holes(column, [z])])
