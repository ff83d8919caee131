"""`tendonrod robots`: the presets, or one robot with its section, sources and limits."""

from __future__ import annotations

import dataclasses
from math import degrees
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..body import Segments, TaperedRod, parts
from ..errors import Fact, InvalidInput
from ..section import NotchedTube, PlainRod
from . import output
from .arguments import Json, Torsion, chosen_robot

if TYPE_CHECKING:
    from ..robot import Robot
    from ..section import Section
    from ..statics.tension_limits import Limit

_KINDS = {NotchedTube: "notched tube", PlainRod: "plain rod", TaperedRod: "tapered rod", Segments: "segments"}
_UNITS = {"mm": 1e3, "mm2": 1e6, "mm4": 1e12, "gpa": 1e-9, "deg": degrees(1.0)}
_SECTION = (  # symbol, factor, unit, what it is
    ("A", 1e6, "mm2", "area"),
    ("r_na", 1e3, "mm", "neutral axis from the tube's axis"),
    ("I_x", 1e12, "mm4", "second moment about x"),
    ("I_y", 1e12, "mm4", "second moment about y"),
    ("J", 1e12, "mm4", "torsion constant in use: torsion stiffness / G"),
    ("L", 1e3, "mm", "length along the tube's axis"),
    ("L_na", 1e3, "mm", "length of the neutral axis"),
    ("line_density", 1e3, "g/m", "lambda, mass per length"),
)
_STIFFNESS = (
    ("Kse", 1.0, "N", ("shear x, G A", "shear y, G A", "extension, E A")),
    ("Kbt", 1e6, "N mm2", ("bending x, E I_x", "bending y, E I_y", "torsion")),
)


def robots(
    robot: Annotated[str | None, typer.Argument(metavar="ROBOT", hidden=True)] = None,
    torsion: Torsion = None,
    figure: Annotated[
        str | None, typer.Option(metavar="FILE", help="Draw tube and section to a .png, .svg or .pdf file.")
    ] = None,
    notch_pattern: Annotated[
        str | None, typer.Option(metavar="FILE.dxf", help="Write the unrolled cutting pattern, mm.")
    ] = None,
    mesh: Annotated[str | None, typer.Option(metavar="FILE.stl", help="Write the notched tube as a solid, mm.")] = None,
    json: Json = False,
) -> None:
    """List the presets, or show one robot in full.

    ROBOT: a preset, or the path of a robot's TOML file. Shown are its section, the limits of the linear model with the
    tension at which each is met when one tendon pulls alone, and where each number comes from.
    """
    if robot is None:
        given = {"--torsion": torsion, "--figure": figure, "--notch-pattern": notch_pattern, "--mesh": mesh}
        for option, value in given.items():
            if value is not None:
                raise InvalidInput(option, Fact(value), "given together with ROBOT")
        _list(json)
        return
    chosen = chosen_robot(robot, torsion)
    _write(chosen, figure, notch_pattern, mesh)
    if json:
        output.say_json(_described(chosen))
    else:
        output.say(_page(chosen, torsion is not None))


def _write(robot: Robot, figure: str | None, notch_pattern: str | None, mesh: str | None) -> None:
    from ..device import write_dxf, write_mesh

    drawing = output.target("--figure", figure, output.FIGURES)
    sheet = output.target("--notch-pattern", notch_pattern, (".dxf",))
    solid = output.target("--mesh", mesh, (".stl",))
    if drawing is not None:
        from ..device_figure import draw_device

        output.write_figure("--figure", drawing, lambda: draw_device(robot))
    if sheet is not None:
        with output.written("--notch-pattern", sheet):
            write_dxf(robot, sheet)
    if solid is not None:
        with output.written("--mesh", solid):
            write_mesh(robot, solid)


def _list(json: bool) -> None:
    from ..robot import load_robot, preset_names

    presets = [load_robot(name) for name in preset_names()]
    if json:
        output.say_json([_constants(robot) for robot in presets])
        return
    columns = ("robot", "psi\ndeg", "r_in\nmm", "r_out\nmm", "L\nmm", "w\nmm", "d\nmm", "turns", "tendons", "torsion")
    names = ("uncut_angle", "inner_radius", "outer_radius", "length", "notch_width", "notch_spacing")
    scales = (degrees(1.0), 1e3, 1e3, 1e3, 1e3, 1e3)
    rows = []
    for robot in presets:
        numbers = [f"{scale * getattr(robot.body, name):.6g}" for name, scale in zip(names, scales, strict=True)]
        rows.append([robot.name, *numbers, f"{robot.turns:g}", str(robot.n_tendons), robot.torsion])
    output.say(output.table(columns, rows, words=(0, 9)))
    output.say("\nOne robot in full: tendonrod robots exonav-1")


def _constants(robot: Robot) -> dict[str, Any]:
    return {
        "name": robot.name,
        "body": _KINDS[type(robot.body)],
        "torsion": robot.torsion,
        "parameters": robot.parameters(),
        "tendons": [dataclasses.asdict(tendon) for tendon in robot.tendons],
    }


def _described(robot: Robot) -> dict[str, Any]:
    places = _places(robot)
    return {
        **_constants(robot),
        "section": _numbers(robot.section),
        "sections": [{"place": name, "at": s_m, **_numbers(robot.section_at(s_m))} for name, s_m in places.items()],
        "limits": [dataclasses.asdict(limit) for limit in _limits(robot)],
        "sources": dict(robot.sources),
    }


def _numbers(section: Section) -> dict[str, Any]:
    values = {each.name: getattr(section, each.name) for each in dataclasses.fields(section)}
    return {name: value.tolist() if hasattr(value, "tolist") else value for name, value in values.items()}


def _limits(robot: Robot) -> tuple[Limit, ...]:
    from ..statics.tension_limits import tension_limits

    return tension_limits(robot)


def _page(robot: Robot, torsion_given: bool) -> str:
    blocks = [output.heading(f"{robot.name}: {_KINDS[type(robot.body)]}, torsion {robot.torsion}")]
    columns = _places(robot)
    rows, last = _section_rows(robot), 1 + len(columns)
    blocks += [output.table(("section", *columns, "", ""), rows, words=(0, last, last + 1))]
    if limits := [_limit_row(limit, robot.n_tendons > 1) for limit in _limits(robot)]:
        blocks.append(output.table(("limit", "tension", "at", "of"), limits, words=(0, 3)))
    blocks.append(output.table(("from the file", "source"), _source_rows(robot, torsion_given), words=(0, 1)))
    return "\n\n".join(blocks)


def _limit_row(limit: Limit, several: bool) -> tuple[str, str, str, str]:
    name = f"{limit.name}, tendon {limit.tendon + 1}" if several else limit.name
    tension = "not reached" if limit.tension is None else f"{limit.tension:.4g} N"
    value = f"{100 * limit.value:.3g} %" if limit.unit == "1" else f"{limit.value:.4g} {limit.unit}"
    return name, tension, value, limit.meaning


def _places(robot: Robot) -> dict[str, float]:
    """Where sections are told: heading -> material coordinate (m); of a uniform robot without a heading."""
    where: dict[str, float] = {}
    several = len(parts(robot.body)) > 1
    for k, part in enumerate(parts(robot.body)):
        name = f"segment {k + 1}" if several else ""
        tapered = isinstance(part.body, TaperedRod)
        where[f"{name} base".strip() if tapered else name] = part.start
        if tapered:
            where[f"{name} tip".strip()] = part.end * (1.0 - 1e-9)  # at a joint it would be the section beyond
    return where


def _section_rows(robot: Robot) -> list[tuple[str, ...]]:
    """Symbol, number at each place, unit and meaning; the lengths are of the whole body."""
    sections = [robot.section_at(s_m) for s_m in _places(robot).values()]
    rows: list[tuple[str, ...]] = []
    for name, scale, unit, what in _SECTION:
        if name == "A" and all(isinstance(part.body, NotchedTube) for part in parts(robot.body)):
            what = "area, of the uncut part"
        values = [f"{scale * getattr(section, name):.7g}" for section in sections]
        whole = name in ("L", "L_na")
        rows.append((name, *([values[0], *[""] * (len(values) - 1)] if whole else values), unit, what))
    for name, scale, unit, meanings in _STIFFNESS:
        for i, what in enumerate(meanings):
            values = [f"{scale * getattr(section, name)[i]:.7g}" for section in sections]
            rows.append((f"{name}[{i}]", *values, unit, what))
    return rows


def _source_rows(robot: Robot, torsion_given: bool) -> list[tuple[str, str]]:
    sources = {**robot.sources, **({"material.torsion": "given as --torsion"} if torsion_given else {})}
    return [(f"{key} = {value}", sources.get(key, "")) for key, value in _file_values(robot)]


def _file_values(robot: Robot) -> list[tuple[str, str]]:
    """The robot in the words of its file: key with unit, number in that unit."""
    from ..parameters import file_values

    return [(key, _in_unit(key, value)) for key, value in file_values(robot.body, robot.tendons).items()]


def _in_unit(key: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    scale = _UNITS.get(key.rpartition("_")[2], 1.0)
    if isinstance(value, tuple):
        return ", ".join(f"{scale * each:.6g}" for each in value)
    return f"{scale * value:.8g}"
