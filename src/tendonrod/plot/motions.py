"""`motion_figure` and `plan_figure`: bodies on their way out, what was commanded, and how well the plan follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput
from ..motion.plan import Plan
from ..motion.progression import Motion
from ..statics.shape import Shape
from .shapes import fine
from .style import COLOURS, INK, MM, PALE, draw, labelled, letters, new_figure, reading_unit, space, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SNAPSHOTS = 12
_PROGRESS = "progress η"


def motion_figure(motion: Motion) -> Figure:
    """Figure of a `Motion`: bodies coloured by insertion with the path of the tip, and the commands against the row."""
    with styled():
        figure = new_figure(5.4)
        _bodies(figure, motion)
        _commands(figure, motion)
    return figure


def plan_figure(plan_or_plans: Plan | Sequence[Plan], labels: Sequence[str] | None = None) -> Figure:
    """Figure of one `Plan` or several: tension with its fit, errors, bodies against the reference, rotation if free.

    labels: one text per plan, else what tells them apart. Raises `InvalidInput` for no plan or too few labels.
    """
    plans = [plan_or_plans] if isinstance(plan_or_plans, Plan) else list(plan_or_plans)
    if not plans:
        raise InvalidInput("plans", plans, "one Plan or more")
    names = list(labels) if labels is not None else [_plan_name(plan, plans) for plan in plans]
    if len(names) != len(plans):
        raise InvalidInput("labels", labels, f"one text for each of the {len(plans)} plans")
    turning = any(np.any(plan.rotation != 0.0) for plan in plans)
    with styled():
        figure = new_figure(5.4)
        panels, name = _lower_panels(figure, 3 if turning else 2, "b")
        _tensions(panels[0], plans, next(name))
        _errors(panels[1], plans, next(name))
        if turning:
            _rotations(panels[2], plans, next(name))
        _against_reference(figure, plans, names)
    return figure


def snapshots(count: int) -> np.ndarray:
    """Indices of at most `SNAPSHOTS` evenly spread rows, first and last included."""
    return np.unique(np.linspace(0, count - 1, min(count, SNAPSHOTS)).round().astype(int))


def _lower_panels(figure: Figure, count: int, first: str) -> tuple[list[Axes], Any]:
    """``count`` panels along the lower edge, and the letters for their titles."""
    gap, left, right = 0.09, 0.075, 0.985
    width = (right - left - gap * (count - 1)) / count
    panels = [figure.add_axes((left + k * (width + gap), 0.085, width, 0.30)) for k in range(count)]
    name = letters()
    while next(name) != chr(ord(first) - 1):
        pass
    return panels, name


def _bodies(figure: Figure, motion: Motion) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    shown = snapshots(len(motion.shapes))
    bodies = [MM * fine(motion.shapes[k]).centerline for k in shown]
    tips = MM * np.array([shape.centerline[-1] for shape in motion.shapes])
    axes = space(figure, (0.0, 0.46, 0.93, 0.49), [*bodies, tips])
    scale = ScalarMappable(Normalize(0.0, 1.0), colormaps["viridis_r"])
    for k, body in zip(shown, bodies, strict=True):
        draw(axes, body, color=scale.to_rgba(motion.insertion[k]), lw=1.6)
    draw(axes, tips, color=INK, lw=0.9, marker=".", ms=3.0, label="path of the tip (tube axis)")
    figure.text(0.01, 0.985, f"(a) {motion.robot.name}: bodies in space", weight="bold", size=8.5, va="top")
    figure.legend(loc="upper left", bbox_to_anchor=(0.005, 0.955))
    bar = figure.colorbar(scale, cax=figure.add_axes((0.92, 0.55, 0.014, 0.36)))
    bar.set_label("insertion η")


def _commands(figure: Figure, motion: Motion) -> None:
    from matplotlib.ticker import MaxNLocator

    (insertion, rotation, tension), name = _lower_panels(figure, 3, "b")
    rows = np.arange(1, motion.insertion.size + 1)
    mark = {"marker": ".", "lw": 1.0}
    insertion.plot(rows, motion.insertion, color=INK, **mark)
    rotation.plot(rows, np.degrees(motion.rotation), color=INK, **mark)
    for i in range(motion.tension.shape[1]):
        colour = COLOURS[i % len(COLOURS)]
        tension.plot(rows, motion.tension[:, i], color=colour, label=f"tendon {i + 1}", **mark)
    if motion.tension.shape[1] > 1:
        tension.legend()
    for axes, title in ((insertion, "insertion η (-)"), (rotation, "rotation (deg)"), (tension, "tension (N)")):
        labelled(axes, "row (-)", title)
        titled(axes, next(name), title.split(" ")[0])
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _plan_name(plan: Plan, plans: Sequence[Plan]) -> str:
    """What tells this plan from the others."""
    parts = {
        f"$\\tau_{{des}}$ = {plan.target_tension:.3g} N": {each.target_tension for each in plans},
        plan.robot.name: {each.robot.name for each in plans},
        getattr(plan.robot.body, "torsion", ""): {getattr(each.robot.body, "torsion", "") for each in plans},
        f"freedom {plan.freedom}": {each.freedom for each in plans},
        "gravity" if np.any(plan.gravity) else "no gravity": {bool(np.any(each.gravity)) for each in plans},
    }
    return ", ".join(text for text, values in parts.items() if len(values) > 1) or next(iter(parts))


def _tensions(axes: Axes, plans: Sequence[Plan], letter: str) -> None:
    fine_progress = np.linspace(0.0, 1.0, 101)
    for k, plan in enumerate(plans):
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(plan.progress, plan.tension, color=colour, marker="o", ls="")
        if plan.progress.size > 2:
            axes.plot(fine_progress, np.polyval(plan.polynomial(2), fine_progress), color=colour, lw=0.9)
    axes.set_ylim(0.0, 1.15 * max(plan.tension.max() for plan in plans) or 1.0)
    labelled(axes, _PROGRESS, "tendon tension τ (N)")
    titled(axes, letter, "tension, quadratic fit")


def _errors(axes: Axes, plans: Sequence[Plan], letter: str) -> None:
    unit, factor = reading_unit(max(max(plan.body_max.max(), plan.tip_error.max()) for plan in plans))
    for k, plan in enumerate(plans):
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(plan.progress, factor * plan.body_rms, color=colour)
        axes.plot(plan.progress, factor * plan.tip_error, color=colour, lw=1.0, ls=(0, (3, 1.2)))
    axes.set_ylim(0.0, max(1.2 * axes.get_ylim()[1], 1.0 if unit == "nm" else 0.0))  # below 1 nm there is only rounding
    labelled(axes, _PROGRESS, f"error ({unit})")
    titled(axes, letter, "distance from the reference")
    axes.legend(handles=_error_legend(), loc="upper center", ncols=2, columnspacing=1.0, handlelength=1.4)


def _rotations(axes: Axes, plans: Sequence[Plan], letter: str) -> None:
    for k, plan in enumerate(plans):
        axes.plot(plan.progress, np.degrees(plan.rotation), color=COLOURS[k % len(COLOURS)], marker="o", lw=0.9)
    labelled(axes, _PROGRESS, "rotation (deg)")
    titled(axes, letter, "rotation")


def _against_reference(figure: Figure, plans: Sequence[Plan], names: Sequence[str]) -> None:
    references = [MM * plan.reference.points for plan in plans]
    axes = space(figure, (0.0, 0.46, 1.0, 0.46), references)
    for reference in references:
        draw(axes, reference, color=PALE, lw=5.0, solid_capstyle="round")
    for k, plan in enumerate(plans):
        _plan_bodies(axes, plan, COLOURS[k % len(COLOURS)])
    figure.text(0.01, 0.985, "(a) bodies (neutral axis) and tips on the way", weight="bold", size=8.5, va="top")
    handles = _plan_legend(names)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.005, 0.96), ncols=-(-len(handles) // 2))


def _plan_bodies(axes: Axes, plan: Plan, colour: str) -> None:
    shapes: list[Shape] = [fine(plan.shapes[k]) for k in snapshots(len(plan.shapes))]
    for shape in shapes:
        draw(axes, MM * shape.position, color=colour, lw=0.7)
    tips = MM * np.array([shape.tip for shape in plan.shapes])
    draw(axes, tips, color=colour, ls="", marker="o", ms=2.6)


def _plan_legend(names: Sequence[str]) -> list[Any]:
    from matplotlib.lines import Line2D

    plans = [Line2D([], [], color=COLOURS[k % len(COLOURS)], lw=2.4, label=name) for k, name in enumerate(names)]
    return [
        Line2D([], [], color=PALE, lw=5.0, label="reference: the fully inserted robot"),
        Line2D([], [], color=INK, lw=0.7, marker="o", ms=2.6, label="exposed body, with its tip"),
        *plans,
    ]


def _error_legend() -> list[Any]:
    from matplotlib.lines import Line2D

    body = Line2D([], [], color=INK, label="body, rms")
    return [body, Line2D([], [], color=INK, lw=1.0, ls=(0, (3, 1.2)), label="tip")]
