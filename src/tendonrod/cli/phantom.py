"""`tendonrod phantom`: the numbers, targets and gaps of a spinal phantom; its figure; its STL files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, within
from . import output
from .arguments import Json, in_words, number

if TYPE_CHECKING:
    from ..anatomy import Phantom
    from ..robot import Robot

MM = 1e3
SIDES = ("dorsal", "ventral", "left", "right")
MARKS = {
    "(m)": "from memory of the literature: plausible, not measured and not looked up",
    "choice": "this package's own, where no source says anything",
}


def phantom(
    source: Annotated[str, typer.Argument(metavar="PHANTOM", hidden=True)] = "printed",
    levels: Annotated[
        str | None, typer.Option(metavar="RANGE", help="Levels from the head down, as T8-L2, instead of its own.")
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="Whether this robot fits, and where; the figure shows its tube."),
    ] = None,
    view: Annotated[str | None, typer.Option(metavar="FILE", help="Draw to a .png, .svg or .pdf file.")] = None,
    export: Annotated[
        str | None, typer.Option(metavar="DIR", help="Write STL files, mm: each structure, and parts to print.")
    ] = None,
    plate: Annotated[str, typer.Option(metavar="MM", help="Longest side that the printer takes, mm.")] = "220",
    json: Json = False,
) -> None:
    """Show a phantom of the spine: dimensions with their sources, gaps, targets.

    PHANTOM is printed (cord in a canal, the default), anatomical (with dura, vertebrae, roots and ganglia) or the path
    of a TOML file: one of these scaled to a patient, or meshes of your own. Numbers are of the world frame: x dorsal,
    y the patient's right, z cranial; origin on the axis of the cord, at the lowest end plate. Sources marked (m) are
    from memory of the literature.
    """
    from ..anatomy import load_phantom

    drawing = output.target("--view", view, output.FIGURES)
    size = 1e-3 * number("--plate", plate, within, 50.0, 2000.0)
    folder = None if export is None else output.directory("--export", export)
    with in_words({"phantom": "PHANTOM", "levels": "--levels"}):
        found = load_phantom(source, levels=levels)
    chosen = None if robot is None else _fitting(found, robot)
    if drawing is not None:
        _draw(found, drawing, chosen)
    if folder is not None:
        _export(found, folder, size)
    if json:
        output.say_json(_described(found) | ({} if chosen is None else {"robot": _fit(found, chosen)}))
    else:
        output.say("\n\n".join([_page(found), *([] if chosen is None else [_fit_in_words(found, chosen)])]))
    output.warn(found.doubts())


def _fitting(found: Phantom, source: str) -> Robot:
    from ..robot import load_robot

    with in_words({"robot": "--robot"}):
        chosen = load_robot(source)
        found.check_robot(_radius(chosen), chosen.name)
    return chosen


def _fit(found: Phantom, robot: Robot) -> dict[str, Any]:
    """How a robot fits that fits at all; SI."""
    radius, narrowest = _radius(robot), found.narrowest
    gap, side, level = (None, None, None) if narrowest is None else narrowest
    return {
        "name": robot.name,
        "outer_diameter": 2.0 * radius,
        "narrowest_gap": {"gap": gap, "side": side, "level": level},
        "without_room": found.unreachable(radius),
    }


def _fit_in_words(found: Phantom, robot: Robot) -> str:
    fit = _fit(found, robot)
    width, narrowest = fit["outer_diameter"], fit["narrowest_gap"]
    said = f"{robot.name}, a tube of {_mm(width, 3)} mm, fits"
    if narrowest["gap"] is not None:
        left = narrowest["gap"] - width
        where = f"{_mm(narrowest['gap'], 2)} mm, {narrowest['side']} at {narrowest['level']}"
        is_wider = f"which leaves {_mm(left, 2)} mm" if left > 0.0 else f"{_mm(-left, 2)} mm too narrow for it"
        said += f"; the smallest gap is {where}, {is_wider}"
    blocked, count = fit["without_room"], len(found.targets)
    room = f" It has room at {count - len(blocked)} of {count} targets." if count else ""
    return f"{said}.{room}" + (f" Not so: {'; '.join(blocked.values())}." if blocked else "")


def _radius(robot: Robot) -> float:
    """The largest outer radius of a robot, m."""
    import numpy as np

    radius = float(np.max(robot.outer_radius(np.linspace(0.0, robot.length_na, 50))))
    if not np.isfinite(radius):
        raise InvalidInput("--robot", Fact(robot.name), "a robot with a radius, not a rod given by area and inertia")
    return radius


def _draw(found: Phantom, path, robot: Robot | None) -> None:
    from ..plot.phantom import phantom_figure

    output.write_figure("--view", path, lambda: phantom_figure(found, None if robot is None else _radius(robot)))


def _export(found: Phantom, folder, plate: float) -> None:
    from ..anatomy import write_stl

    with output.filling("--export", folder), in_words({"folder": "--export"}):
        parts = write_stl(found, folder, plate)
    for part in parts:
        size = " x ".join(f"{side:.1f}" for side in part.size_mm)
        output.note(f"wrote {folder / part.file}: {part.what}; {size} mm, {1e-3 * part.volume_mm3:.2f} cm3")


def _described(found: Phantom) -> dict[str, Any]:
    """SI units."""
    return {
        "name": found.name,
        "kind": found.kind,
        "structures": [
            {"name": name, "role": each.role, "is_wall": each.is_wall, "triangles": len(each.faces)}
            for name, each in found.structures.items()
        ],
        "levels": [
            {"name": each.name, "z_low": each.z_low, "z_high": each.z_high, "disc": each.disc} for each in found.levels
        ],
        "gaps": {level: dict(each) for level, each in found.gaps.items()},
        "entries": {
            level: {"height": each.height, "depth": each.depth, "offset": each.offset, "window": list(each.window)}
            for level, each in found.entries.items()
        },
        "targets": [
            {
                "name": each.name,
                "level": each.level,
                "side": each.side,
                "position": [x + 0.0 for x in each.position],  # no -0
                "tolerance": each.tolerance,
                "room": room(found, each.position),
                "description": each.description,
            }
            for each in found.targets.values()
        ],
        "pressure_limit": found.pressure_limit,
        "cord_indentation_limit": found.cord_indentation_limit,
        "numbers": _numbers(found),
        "sources": dict(found.sources),
        "marks": MARKS,
        "fingerprint": found.fingerprint,
    }


def room(found: Phantom, position) -> float:
    """Largest radius (m) of a tube whose axis may end at ``position`` (3,) m."""
    return float(found.free().distance([position])[0][0])


def _numbers(found: Phantom) -> dict[str, dict[str, float]]:
    """By key of a phantom file, by level, mm."""
    if found.plan is None:
        return {}
    quantities = {key: found.plan.numbers.quantity(key.removesuffix("_mm")) for key in found.sources}
    return {key: dict(each.values) for key, each in quantities.items()}


def _page(found: Phantom) -> str:
    ends = dict.fromkeys(found.levels[i].name for i in (0, -1)) if found.levels else [f"{len(found.structures)} files"]
    what = f"{found.kind} phantom" if found.name == found.kind else f"{found.name}: {found.kind}"
    blocks = [output.heading(f"{what}, {' to '.join(ends)}")]
    if found.gaps:
        blocks.append(_level_table(found))
    blocks.append(_target_table(found))
    blocks.append(_source_table(found))
    used = [f"{mark}: {says}." for mark, says in MARKS.items() if any(mark in each for each in found.sources.values())]
    if used:
        blocks.append("\n".join(used))
    limit = f"{1e-3 * found.pressure_limit:g} kPa, {MM * found.cord_indentation_limit:g} mm of indentation"
    blocks.append(f"Limits on cord and dura: {limit}; engineering choices, no accepted limits.")
    return "\n\n".join(blocks)


def _level_table(found: Phantom) -> str:
    columns = ("level", "z low\nmm", "z high\nmm", *(f"{side}\ngap, mm" for side in SIDES), "window at\nz, mm")
    rows = []
    for each in found.levels:
        entry = found.entries.get(each.name)
        window = "-" if entry is None else _mm(entry.height)
        gaps = [_mm(found.gaps[each.name][side], 2) for side in SIDES]
        rows.append([each.name, _mm(each.z_low), _mm(each.z_high), *gaps, window])
    return output.table(columns, rows, words=(0,))


def _target_table(found: Phantom) -> str:
    columns = ("target", "x\nmm", "y\nmm", "z\nmm", "within\nmm", "room\nmm", "where the tip's middle shall be")
    rows = [
        [each.name, *(_mm(x, 2) for x in each.position), _mm(each.tolerance, 2), _mm(room(found, each.position), 2),
         each.description]
        for each in found.targets.values()
    ]  # fmt: skip
    return output.table(columns, rows, words=(0, 6))


def _source_table(found: Phantom) -> str:
    numbers, rows = _numbers(found), []
    for key, source in found.sources.items():
        values = ", ".join(f"{level} {value:g}" for level, value in numbers.get(key, {}).items())
        rows.append((f"{key} = {values}" if values else key, source))
    return output.table(("number, by level", "source"), rows, words=(0, 1))


def _mm(value: float, digits: int = 1) -> str:
    return output.fixed(MM * value, digits)
