"""`tendonrod ftl`: a follow-the-leader plan."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import Fact, InvalidInput, nonnegative, one_of, positive
from . import output
from .arguments import Figure, Gravity, Json, RobotName, Torsion, chosen_robot, number, vector, whole
from .shape_page import listed

if TYPE_CHECKING:
    from ..motion.plan import Plan

MOST_STEPS = 10_000
_LEGEND = (
    "p: progress, the share of the way out. Distances from the exposed body to the\n"
    "reference curve; tip at p: from the tip to the reference's point at the same\n"
    "progress; %: of the exposed length."
)


def ftl(
    robot: RobotName,
    target: Annotated[str, typer.Option(metavar="N", help="Tension at full insertion, N, >= 0.")],
    gravity: Gravity = "0,0,0",
    steps: Annotated[str, typer.Option(metavar="COUNT", help="Steps of equal insertion, 1 or more.")] = "20",
    freedom: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Free at each step: tension; full, that is tension and rotation, insertion matched; paper, the "
            "paper's own search of the tension.",
        ),
    ] = "tension",
    tension_step: Annotated[
        str | None, typer.Option(metavar="N", help="Step of the search of paper, N. Left out: 0.005.")
    ] = None,
    tolerance_mm: Annotated[
        str | None,
        typer.Option(metavar="MM", help="Distance that ends the search of paper, mm. Left out: 0.5."),
    ] = None,
    torsion: Torsion = None,
    json: Json = False,
    output_file: Annotated[
        str | None, typer.Option("--output", metavar="FILE", help="Write the plan to a .csv or .json file.")
    ] = None,
    figure: Figure = None,
) -> None:
    """Plan follow-the-leader motion: body along the tip's path.

    ROBOT: a preset, or the path of a robot's TOML file. The reference is the neutral axis at full insertion and
    --target; distances are from the exposed body to that curve. A plan's .csv is read by tendonrod motion.
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
        with output.written("--output", file):
            plan.write(file)
    if picture is not None:
        from ..plot import plan_figure

        output.write_figure("--figure", picture, lambda: plan_figure(plan))
    if json:
        output.say_json(plan.to_dict())
    else:
        output.say(_page(plan))
    output.warn_steps("p =", [f"{eta:.4g}" for eta in plan.progress], plan.warnings)


def _page(plan: Plan) -> str:
    full = plan.freedom == "full"
    columns = ["p\n", *(["insertion\n", "rotation\ndeg"] if full else []), "tension\nN"]
    columns += ["body\nrms mm", "body\nmax mm", "tip\nmm", "tip at p\nmm", "tip\n%"]
    rows = []
    for k, eta in enumerate(plan.progress):
        turned = [f"{plan.insertion[k]:.5f}", f"{degrees(plan.rotation[k]):.3f}"] if full else []
        errors = (plan.body_rms, plan.body_max, plan.tip_error, plan.tip_error_at_progress)
        millimetres = [output.fixed(1e3 * error[k], 5) for error in errors]
        rows.append([f"{eta:.4g}", *turned, f"{plan.tension[k]:.5f}", *millimetres, f"{plan.tip_error_percent[k]:.3f}"])
    return "\n\n".join(
        [
            output.heading(
                f"{plan.robot.name}, torsion {plan.robot.torsion}, target {plan.target_tension:g} N, "
                f"gravity ({listed(plan.gravity)}) m/s2, {plan.freedom}"
            ),
            output.table(columns, rows),
            _LEGEND,
            _summary(plan),
        ]
    )


def _summary(plan: Plan) -> str:
    degree = min(2, plan.progress.size - 1)
    terms = [
        f"{c:+.5g}{power}" for c, power in zip(plan.polynomial(degree), (" p^2", " p", "")[-degree - 1 :], strict=True)
    ]
    rows = [
        ("tension", f"{' '.join(terms)} N", "least squares"),
        ("tip rmse", f"{1e3 * plan.tip_rmse:.5f} mm", "by projection"),
        ("", f"{1e3 * plan.tip_rmse_at_progress:.5f} mm", "to the reference at p"),
    ]
    if plan.freedom == "paper":
        rows.append(("search", "our assumptions", "tension step, tolerance and a reference of 400 points"))
    return output.table(("", "", ""), rows, words=(0, 1, 2))
