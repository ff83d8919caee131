"""`tendonrod motion`: the shapes of a progressive motion read from a file."""

from __future__ import annotations

import os
from math import degrees
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import Fact, InvalidInput
from . import output
from .arguments import Figure, Gravity, Json, SceneFile, Torsion, chosen_robot, chosen_scene, vector, whole
from .motion_file import read_commands
from .shape import MOST_SAMPLES
from .shape_data import BODY_UNITS, as_dict, scene_dict
from .shape_page import listed
from .table_file import tension_columns

if TYPE_CHECKING:
    from ..motion.progression import Motion
    from ..scenefile import Scene


def motion(
    file: Annotated[
        str,
        typer.Argument(metavar="FILE.csv", hidden=True),
    ],
    robot: Annotated[str, typer.Option(metavar="ROBOT", help="Preset, or path of a robot's TOML file.")] = "exonav-1",
    gravity: Gravity = "0,0,0",
    scene: SceneFile = None,
    samples: Annotated[str, typer.Option(metavar="COUNT", help="Sections per body, evenly spread, 2 or more.")] = "101",
    torsion: Torsion = None,
    json: Json = False,
    output_file: Annotated[
        str | None, typer.Option("--output", metavar="FILE.csv", help="Write commands and tip, mm, one row per step.")
    ] = None,
    bodies: Annotated[
        str | None, typer.Option(metavar="FILE.csv", help="Write every body, mm, one row per section and step.")
    ] = None,
    figure: Figure = None,
) -> None:
    """Shapes of a motion out of the outer tube, from a file.

    FILE.csv has the columns insertion (exposed share, from 0 to 1), tension_N or, for several tendons, tension_1_N,
    tension_2_N, ..., and rotation_deg or rotation_rad (turn of the section at the outer tube's exit; left out: 0, as in
    follow-the-leader motion). The plan that tendonrod ftl writes as .csv is such a file.
    """
    pull, count = vector("--gravity", gravity), whole("--samples", samples, 2, MOST_SAMPLES)
    table = output.target("--output", output_file, (".csv",))
    sections = output.target("--bodies", bodies, (".csv",))
    picture = output.target("--figure", figure, output.FIGURES)
    _keep_apart({"FILE.csv": file, "--output": output_file, "--bodies": bodies})
    chosen, around = chosen_robot(robot, torsion), chosen_scene(scene)
    commands = read_commands(file, chosen)
    if commands.ignored:
        output.note(f"{file}: columns left alone: {', '.join(commands.ignored)}")
    if commands.origin is not None and (others := commands.origin.differences(chosen, pull)):
        output.warn([f"{file} was made for {'; '.join(others)}"])

    from ..motion.progression import progress

    given = commands.insertion, commands.rotation, commands.tension
    with output.progress_bar("solving") as watch, around.in_words():
        moved = progress(chosen, *given, samples=count, watch=watch, gravity=pull, **around.arguments)
    if table is not None:
        output.write_table("--output", table, _tip_header(moved), _tip_rows(moved))
    if sections is not None:
        output.write_table("--bodies", sections, _BODY_HEADER, _body_rows(moved))
    if picture is not None:
        from ..plot import motion_figure

        output.write_figure("--figure", picture, lambda: motion_figure(moved))
    if json:
        output.say_json(_as_dict(moved, pull, around))
    else:
        output.say(_page(moved, pull))
    rows = [str(k + 1) for k in range(len(moved.shapes))]
    output.warn_steps("row", rows, [shape.warnings for shape in moved.shapes])


def _keep_apart(files: dict[str, str | None]) -> None:
    """No file is written over what is read, nor over what was just written."""
    seen: dict[str, str] = {}
    for option, path in files.items():
        if path is not None and (first := seen.setdefault(os.path.realpath(path), option)) != option:
            raise InvalidInput(option, Fact(path), f"another file than {first}")


_UNITS = {"gravity": "m/s2", "scene": "SI", "insertion": "1", "rotation": "rad", "tension": "N", "tip": "m"}
_BODY_HEADER = ["row", "insertion", "s_mm", "x_mm", "y_mm", "z_mm", "axis_x_mm", "axis_y_mm", "axis_z_mm"]


def _tip_header(moved: Motion) -> list[str]:
    return ["insertion", "rotation_deg", *tension_columns(moved.robot.n_tendons), "tip_x_mm", "tip_y_mm", "tip_z_mm"]


def _tip_rows(moved: Motion):
    for eta, phi, tau, tip in zip(moved.insertion, moved.rotation, moved.tension, moved.tip, strict=True):
        yield [float(eta), degrees(phi), *tau.tolist(), *_millimetres(tip)]


def _body_rows(moved: Motion):
    for k, shape in enumerate(moved.shapes):
        for s, p, c in zip(shape.s, shape.position, shape.centerline, strict=True):
            yield [k + 1, float(moved.insertion[k]), *_millimetres([s, *p, *c])]


def _millimetres(values) -> list[str]:
    return [output.fixed(1e3 * value, 9) for value in values]


def _as_dict(moved: Motion, gravity, scene: Scene) -> dict:
    return {
        "robot": moved.robot.name,
        "torsion": moved.robot.torsion,
        "gravity": list(gravity),
        "scene": scene_dict(scene),
        **{name: getattr(moved, name).tolist() for name in ("insertion", "rotation", "tension", "tip")},
        "shapes": [as_dict(shape) for shape in moved.shapes],
        "units": {**_UNITS, "shapes": BODY_UNITS},
    }


def _page(moved: Motion, gravity) -> str:
    tensions = [f"tension{name[7:-2].replace('_', ' ')}\nN" for name in tension_columns(moved.robot.n_tendons)]
    columns = ["row\n", "insertion\n", "rotation\ndeg", *tensions, "tip x\nmm", "tip y\nmm", "tip z\nmm"]
    rows = []
    for k, tip in enumerate(moved.tip):
        taus = [f"{tau:.5f}" for tau in moved.tension[k]]
        place = [output.fixed(1e3 * value, 4) for value in tip]
        rows.append(
            [str(k + 1), f"{moved.insertion[k]:.5f}", output.fixed(degrees(moved.rotation[k]), 3), *taus, *place]
        )
    steps = "1 step" if len(rows) == 1 else f"{len(rows)} steps"
    title = f"{moved.robot.name}, torsion {moved.robot.torsion}, gravity ({listed(gravity)}) m/s2, {steps}"
    return f"{output.heading(title)}\n\n{output.table(columns, rows)}"
