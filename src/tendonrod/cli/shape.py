"""`tendonrod shape`: one equilibrium."""

from __future__ import annotations

from math import degrees, isfinite, radians
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import finite, within
from . import output
from .arguments import (
    Figure,
    Gravity,
    Json,
    RobotName,
    Torsion,
    chosen_robot,
    number,
    tensions,
    vector,
    whole,
)

if TYPE_CHECKING:
    from ..statics.shape import Shape

MOST_SAMPLES = 100_000
SHOWN = 11  # sections in the printed table
_LEGEND = "x, y, z: neutral axis; axis: centre of the tube; u: curvature and twist in the\nsection frame."
LOADS = {
    "gravity": "m/s2",
    "tip_force": "N",
    "tip_moment": "N m",
    "distributed_force": "N/m",
    "distributed_moment": "N",
}
BODY_UNITS = {
    **dict.fromkeys(("s", "position", "centerline", "tip", "tendon_path", "length", "error_estimate"), "m"),
    **dict.fromkeys(("insertion", "rotation", "v"), "1"),
    "u": "1/m",
    **dict.fromkeys(("force", "tensions"), "N"),
    "moment": "N m",
}
UNITS = {**BODY_UNITS, **LOADS, "base_rotation": "rad"}
_ARRAYS = ("s", "position", "centerline", "rotation", "v", "u", "force", "moment", "tip")


def shape(
    robot: RobotName,
    tension: Annotated[
        list[str] | None,
        typer.Option(metavar="N", help="Tension, N, >= 0; repeat for each tendon. Left out: 0."),
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
    insertion: Annotated[str, typer.Option(metavar="ETA", help="Exposed share of the robot, from 0 to 1.")] = "1",
    rotation_deg: Annotated[
        str, typer.Option(metavar="DEG", help="Turn of the section at the outer tube's exit about world z, degrees.")
    ] = "0",
    samples: Annotated[
        str, typer.Option(metavar="COUNT", help="Sections evenly spread over the exposed length, 2 or more.")
    ] = "101",
    torsion: Torsion = None,
    json: Json = False,
    figure: Figure = None,
) -> None:
    """Shape under tendon tensions, gravity and tip loads.

    ROBOT: a preset, or the path of a robot's TOML file. JSON keys are the attributes of tendonrod.Shape and the
    arguments of tendonrod.solve; base_rotation is the angle (rad) of --rotation-deg, rotation the body's frames.
    """
    chosen = chosen_robot(robot, torsion)
    taus = tensions(chosen, tension or [])
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

    import numpy as np

    from ..statics.equilibrium import solve

    s = np.linspace(0.0, eta * chosen.length_na, count)
    solved = solve(chosen, taus, **loads, insertion=eta, rotation=angle, s=s)
    if picture is not None:
        from ..plot import shape_figure

        output.write_figure("--figure", picture, lambda: shape_figure(solved))
    if json:
        told = {name: list(value) for name, value in loads.items()}
        output.say_json(as_dict(solved) | told | {"insertion": eta, "base_rotation": angle, "units": UNITS})
    else:
        output.say(_page(solved, loads, angle))
    output.warn(solved.warnings)


def as_dict(solved: Shape) -> dict[str, Any]:
    """A shape as plain numbers, SI, keys as the attributes; tendon_path has one list per tendon."""
    return {
        "robot": solved.robot.name,
        "torsion": solved.robot.torsion,
        "tensions": solved.tensions.tolist(),
        "insertion": solved.insertion,
        "length": solved.length,
        "converged": solved.converged,
        "status": str(solved.status),
        "residual": solved.residual,
        "iterations": solved.iterations,
        "error_estimate": solved.error_estimate if isfinite(solved.error_estimate) else None,
        "warnings": list(solved.warnings),
        **{name: getattr(solved, name).tolist() for name in _ARRAYS},
        "tendon_path": [solved.tendon_path(i).tolist() for i in range(solved.robot.n_tendons)],
    }


def listed(values, digits: int = 6) -> str:
    """Numbers with commas between them."""
    return ", ".join(f"{value:.{digits}g}" for value in values)


def _page(solved: Shape, loads: dict[str, tuple[float, float, float]], angle: float) -> str:
    robot, frame = solved.robot, solved.rotation[-1]
    facts = [
        ("tensions", listed(solved.tensions) or "no tendons", "N"),
        ("gravity", listed(loads["gravity"]), "m/s2"),
        *(
            (name.replace("_", " "), listed(loads[name]), unit)
            for name, unit in LOADS.items()
            if name != "gravity" and any(loads[name])
        ),
        ("insertion", f"{solved.insertion:.6g}", f"of {1e3 * robot.length_na:.5f} mm"),
        *([("rotation", f"{degrees(angle):.6g}", "deg")] if angle else []),
        ("tip, neutral axis", _fixed(1e3 * solved.tip), "mm"),
        ("tip, tube axis", _fixed(1e3 * solved.centerline[-1]), "mm"),
        ("tip direction", _fixed(frame[:, 2]), ""),
        ("moment at exit", listed(1e3 * solved.moment[0], 5), "N mm"),
        ("solved in", _effort(solved), ""),
    ]
    columns = (
        "s\nmm",
        "x\nmm",
        "y\nmm",
        "z\nmm",
        "axis x\nmm",
        "axis y\nmm",
        "axis z\nmm",
        "u_x\n1/m",
        "u_y\n1/m",
        "u_z\n1/m",
    )
    return "\n\n".join(
        [
            output.heading(f"{robot.name}, torsion {robot.torsion}"),
            output.table(("", "", ""), facts, words=(0, 1, 2)),
            output.table(columns, _sections(solved)),
            _LEGEND,
        ]
    )


def _effort(solved: Shape) -> str:
    if solved.iterations == 0:
        return "closed form"
    iterations = "1 iteration" if solved.iterations == 1 else f"{solved.iterations} iterations"
    return f"{iterations}, scaled residual {solved.residual:.1e}"


def _sections(solved: Shape) -> list[list[str]]:
    import numpy as np

    rows = []
    for k in np.unique(np.linspace(0, solved.s.size - 1, min(SHOWN, solved.s.size)).round().astype(int)):
        lengths = 1e3 * np.array([solved.s[k], *solved.position[k], *solved.centerline[k]])
        rows.append([output.fixed(value, 3) for value in lengths] + [output.fixed(value, 2) for value in solved.u[k]])
    return rows


def _fixed(values, digits: int = 4) -> str:
    return ", ".join(output.fixed(value, digits) for value in values)
