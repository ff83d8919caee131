"""`tendonrod ftl`: a follow-the-leader plan."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import Fact, InvalidInput, nonnegative, one_of, positive
from . import output
from .arguments import Figure, Gravity, Json, RobotName, Torsion, chosen_robot, number, torsion_of, vector, whole
from .shape import listed

if TYPE_CHECKING:
    from ..motion.plan import Plan

MOST_STEPS = 10_000


def ftl(
    robot: RobotName,
    target: Annotated[str, typer.Option(metavar="N", help="Tension at full insertion, N, >= 0.")],
    gravity: Gravity = "0,0,0",
    steps: Annotated[str, typer.Option(metavar="COUNT", help="Steps of equal insertion, 1 or more.")] = "20",
    freedom: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="What is free at each step: tension (optimal), full (optimal tension and rotation, insertion matched), "
            "or paper (the paper's search of the tension).",
        ),
    ] = "tension",
    tension_step: Annotated[
        str | None, typer.Option(metavar="N", help="Only with paper: step of the search, N.", show_default="0.005")
    ] = None,
    tolerance_mm: Annotated[
        str | None,
        typer.Option(metavar="MM", help="Only with paper: distance that ends the search, mm.", show_default="0.5"),
    ] = None,
    torsion: Torsion = None,
    json: Json = False,
    output_file: Annotated[
        str | None, typer.Option("--output", metavar="FILE", help="Write the plan to a .csv or .json file.")
    ] = None,
    figure: Figure = None,
) -> None:
    """Plan tension (and rotation) so that the body follows the path of its tip.

    The reference is the neutral axis at full insertion and --target. Distances are from the exposed body to that curve.
    The plan's .csv can be run again with tendonrod motion.
    """
    one_of("--freedom", freedom, ("tension", "full", "paper"))
    search = {}
    for option, text, unit, name in (
        ("--tension-step", tension_step, 1.0, "tension_step"),
        ("--tolerance-mm", tolerance_mm, 1e-3, "tolerance"),
    ):
        if text is not None:
            search[name] = unit * number(option, text, positive)
            if freedom != "paper":
                raise InvalidInput(option, Fact(text), "left out unless --freedom is paper")
    tau, pull = number("--target", target, nonnegative), vector("--gravity", gravity)
    count = whole("--steps", steps, 1, MOST_STEPS)
    file = output.target("--output", output_file, (".csv", ".json"))
    picture = output.target("--figure", figure, output.FIGURES)
    chosen = chosen_robot(robot, torsion)

    from ..motion.follow_leader import plan_follow_leader

    with output.progress_bar("planning") as watch:
        plan = plan_follow_leader(chosen, tau, pull, steps=count, freedom=freedom, watch=watch, **search)
    if file is not None:
        with output.written("--output", file) as draft:
            plan.write(draft)
    if picture is not None:
        from ..plot import plan_figure

        output.write_figure("--figure", picture, lambda: plan_figure(plan))
    output.warn([sentence for shape in plan.shapes for sentence in shape.warnings])
    if json:
        output.say_json(plan.to_dict())
    else:
        output.say(_page(plan))


ftl.examples = (  # pyright: ignore[reportFunctionMemberAccess]
    "  tendonrod ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --output plan.csv\n"
    "  tendonrod ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --freedom full --json"
)


def _page(plan: Plan) -> str:
    full = plan.freedom == "full"
    columns = ["progress", *(["insertion", "rot. deg"] if full else []), "tension N"]
    columns += ["body rms um", "max um", "tip um", "tip at progress um", "tip %"]
    rows = []
    for k, eta in enumerate(plan.progress):
        turned = [f"{plan.insertion[k]:.5f}", f"{degrees(plan.rotation[k]):.3f}"] if full else []
        errors = (plan.body_rms, plan.body_max, plan.tip_error, plan.tip_error_at_progress)
        microns = [f"{1e6 * error[k]:.2f}" for error in errors]
        rows.append([f"{eta:.4g}", *turned, f"{plan.tension[k]:.5f}", *microns, f"{plan.tip_error_percent[k]:.3f}"])
    return "\n\n".join([
        output.heading(
            f"{plan.robot.name}, torsion {torsion_of(plan.robot)}, target {plan.target_tension:g} N, "
            f"gravity {listed(plan.gravity)} m/s2, freedom {plan.freedom}"
        ),
        output.table(columns, rows),
        _summary(plan),
    ])


def _summary(plan: Plan) -> str:
    degree = min(2, plan.progress.size - 1)
    terms = [f"{c:+.5g}{power}" for c, power in zip(plan.polynomial(degree), (" p^2", " p", "")[-degree - 1 :], strict=True)]
    rows = [
        ("tension", f"{' '.join(terms)} N", "least squares, p = progress"),
        ("tip rmse", f"{1e3 * plan.tip_rmse:.5f} mm", "to the curve"),
        ("", f"{1e3 * plan.tip_rmse_at_progress:.5f} mm", "to the reference at the same progress"),
    ]
    if plan.freedom == "paper":
        rows.append(("search", "our assumptions", "tension step, tolerance and a reference of 400 points"))
    return output.table(("", "", ""), rows, words=(0, 1, 2))
