"""Named targets of a stretch of spine: where the middle of the robot's tip shall be, and why there.

lateral-left, lateral-right, ventral: at the middle of a vertebral body, beside and in front of the cord. Without a dura
the tip lies close to the cord, as a lead must that is to stimulate its tracts; with one it lies in the middle of the
epidural gap. drg-left, drg-right: at the medial mouth of the foramen, dorsal of the ganglion, where leads for it lie.
"""

from __future__ import annotations

from .column import Column
from .phantom import Target

SIDES = {"right": 1.0, "left": -1.0}  # sign of y


def all_targets(column: Column) -> dict[str, Target]:
    """By name, "ventral@T11", from the head down."""
    found = [each for name in column.names for each in (*_beside_cord(column, name), *_at_ganglia(column, name))]
    return {target.name: target for target in found}


def _beside_cord(column: Column, name: str) -> list[Target]:
    z = column.level(name).middle
    inner, canal = column.inner([z]), column.canal([z])
    what = "dura" if column.has_dura else "cord"
    middle = inner.middle[0, 1]
    away = {side: column.numbers.of("lead_gap", name) for side in ("ventral", "right", "left")}
    if column.has_dura:
        away = {"ventral": 0.5 * (inner.ventral - canal.ventral)[0]}
        away |= dict.fromkeys(SIDES, 0.5 * column.numbers.of("epidural_lateral", name))
    says = f"{{}} the {what} at the middle of the body of {name}, {{:.2f}} mm from it"
    ventral = (inner.ventral[0] - away["ventral"], middle, z)
    found = [_target(column, "ventral", name, ventral, "middle", says.format("ventral of", 1e3 * away["ventral"]))]
    for side, sign in SIDES.items():
        at = (inner.middle[0, 0], middle + sign * (inner.width[0] + away[side]), z)
        found.append(_target(column, f"lateral-{side}", name, at, side, says.format(f"{side} of", 1e3 * away[side])))
    return found


def _at_ganglia(column: Column, name: str) -> list[Target]:
    middle, half = column.foramen(name)
    x = middle[0] + 0.5 * half[0]
    found = []
    for side, sign in SIDES.items():
        at = (x, mouth(column, x, middle[2], sign), middle[2])
        says = f"in the medial mouth of the foramen below the {side} pedicle of {name}, dorsal of the ganglion"
        found.append(_target(column, f"drg-{side}", name, at, side, says))
    return found


def mouth(column: Column, x: float, z: float, sign: float) -> float:
    """y of the canal's wall at x, z on the side of ``sign``, m."""
    canal = column.canal([z])
    return float(canal.middle[0, 1] + sign * canal.width_at(x)[0])


def _target(column: Column, kind: str, level: str, position, side: str, says: str) -> Target:
    tolerance = column.numbers.of("tolerance", level)
    return Target(
        name=f"{kind}@{level}", level=level, position=position, tolerance=tolerance, side=side, description=says
    )
