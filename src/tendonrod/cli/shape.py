"""`tendonrod shape`: one equilibrium."""

from __future__ import annotations

from math import radians
from typing import Annotated, Any

import typer

from ..errors import InvalidInput, finite, within
from . import output
from .arguments import (
    CentroidWeight,
    Figure,
    Gravity,
    Json,
    RobotName,
    SceneFile,
    Torsion,
    chosen_robot,
    chosen_scene,
    displacements,
    number,
    tensions,
    vector,
    whole,
)
from .derivatives import compliance_table, derivatives, jacobian_inputs, jacobian_table
from .shape_data import UNITS, as_dict, jacobian_dict, scene_dict
from .shape_page import page

MOST_SAMPLES = 100_000


def shape(
    robot: RobotName,
    tension: Annotated[
        list[str] | None,
        typer.Option(metavar="N", help="Tension, N, >= 0; repeat for each tendon. Left out: 0."),
    ] = None,
    displacement: Annotated[
        str | None,
        typer.Option(
            metavar="MM[,MM...]",
            help="Pulled length of each tendon from slack, mm, instead of its tension; nothing or - for a tendon "
            "driven by its tension.",
        ),
    ] = None,
    gravity: Gravity = "0,0,0",
    tip_force: Annotated[str, typer.Option(metavar="X,Y,Z", help="Force at the tip, world frame, N.")] = "0,0,0",
    tip_moment: Annotated[str, typer.Option(metavar="X,Y,Z", help="Moment at the tip, world frame, N m.")] = "0,0,0",
    distributed_force: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Force per metre of the body, world frame, N/m.")
    ] = "0,0,0",
    distributed_moment: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Moment per metre of the body, world frame, N.")
    ] = "0,0,0",
    scene: SceneFile = None,
    centroid_weight: CentroidWeight = False,
    insertion: Annotated[str, typer.Option(metavar="ETA", help="Exposed share of the robot, from 0 to 1.")] = "1",
    rotation_deg: Annotated[
        str, typer.Option(metavar="DEG", help="Turn of the section at the outer tube's exit about its z, degrees.")
    ] = "0",
    samples: Annotated[
        str, typer.Option(metavar="COUNT", help="Sections evenly spread over the exposed length, 2 or more.")
    ] = "101",
    jacobian: Annotated[
        str | None,
        typer.Option(
            metavar="NAME[,NAME...]",
            help="Derivatives of the tip by tensions, displacements, gravity, tip_force, insertion, rotation, "
            "exit_position, exit_tilt, mass[0].mass, a parameter of the robot or the like.",
        ),
    ] = None,
    compliance: Annotated[
        bool, typer.Option("--compliance", help="Motion of the tip by a force and a moment there.")
    ] = False,
    torsion: Torsion = None,
    json: Json = False,
    figure: Figure = None,
) -> None:
    """Shape under tendon tensions or displacements, gravity and other loads, touching surfaces.

    ROBOT: a preset, or the path of a robot's TOML file. JSON keys are the attributes of tendonrod.Shape and the
    arguments of tendonrod.solve; base_rotation is the angle (rad) of --rotation-deg, rotation the body's frames.
    """
    chosen, around = chosen_robot(robot, torsion), chosen_scene(scene)
    taus, pulled = tensions(chosen, tension or []), displacements(chosen, displacement)
    loads: dict[str, Any] = {
        "gravity": vector("--gravity", gravity),
        "tip_force": vector("--tip-force", tip_force),
        "tip_moment": vector("--tip-moment", tip_moment),
        "distributed_force": vector("--distributed-force", distributed_force),
        "distributed_moment": vector("--distributed-moment", distributed_moment),
    }
    eta = number("--insertion", insertion, within, 0.0, 1.0)
    angle = radians(number("--rotation-deg", rotation_deg, finite))
    count = whole("--samples", samples, 2, MOST_SAMPLES)
    picture = output.target("--figure", figure, output.FIGURES)
    inputs = None if jacobian is None else jacobian_inputs(jacobian, around)
    for option, asked in (("--jacobian", inputs is not None), ("--compliance", compliance)):
        if asked and eta == 0.0:
            raise InvalidInput("--insertion", eta, f"> 0 where {option} is given")

    import numpy as np

    from ..statics.equilibrium import solve

    more: dict[str, Any] = around.arguments | ({"centroid_weight": True} if centroid_weight else {})
    more |= {} if pulled is None else {"displacements": pulled}
    s = np.linspace(0.0, eta * chosen.length_na, count)
    with around.in_words():
        solved = solve(chosen, taus, **loads, insertion=eta, rotation=angle, s=s, **more)
    slopes = None if inputs is None else derivatives(solved, inputs)
    if picture is not None:
        from ..plot import shape_figure

        output.write_figure("--figure", picture, lambda: shape_figure(solved))
    if json:
        told = {name: list(value) for name, value in loads.items()}
        told |= {"insertion": eta, "base_rotation": angle, "displacements": pulled, "centroid_weight": centroid_weight}
        told |= {"scene": scene_dict(around), "jacobian": None if slopes is None else jacobian_dict(slopes)}
        told |= {"tip_compliance": solved.tip_compliance.tolist() if compliance else None, "units": UNITS}
        output.say_json(as_dict(solved) | told)
    else:
        blocks = page(solved, loads, angle, pulled, around)
        blocks += [] if slopes is None else [jacobian_table(slopes, chosen, around)]
        output.say("\n\n".join(blocks + ([compliance_table(solved.tip_compliance)] if compliance else [])))
    output.warn(solved.warnings)
    if any(each.startswith("mass") for each in around.names) and not any(loads["gravity"]):
        output.note(f"{around.name}: the masses weigh nothing, --gravity is 0,0,0")
