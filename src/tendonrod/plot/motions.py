"""`motion_figure` and `plan_figure`: bodies on their way out, what was commanded, and how well the plan follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput
from ..motion.plan import Plan
from ..motion.progression import Motion
from ..statics.shape import Shape
from .shapes import check_converged, fine
from .style import COLOURS, INK, MM, PALE, draw, labelled, new_figure, reading_unit, space, styled, titled
from .surroundings import draw_walls, walls_around

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SNAPSHOTS = 12
_PROGRESS = "progress η"


def motion_figure(motion: Motion) -> Figure:
    """Figure of a `Motion`: bodies coloured by insertion with the path of the tip, and the commands of each step.

    Raises `InvalidInput` for a shape that did not converge.
    """
    check_converged(motion.shapes)
    with styled():
        figure = new_figure(5.4)
        _bodies(figure, motion)
        _commands(figure, motion)
    return figure


def plan_figure(plan_or_plans: Plan | Sequence[Plan], labels: Sequence[str] | None = None) -> Figure:
    """Figure of one `Plan` or several: tension with its fit, errors, bodies against the reference, rotation if free.

    labels: one text per plan, else what tells them apart. Raises `InvalidInput` for no plan, a shape that did not
    converge, or too few labels.
    """
    plans = [plan_or_plans] if isinstance(plan_or_plans, Plan) else list(plan_or_plans)
    if not plans:
        raise InvalidInput("plans", plans, "one Plan or more")
    for plan in plans:
        check_converged(plan.shapes)
    names = list(labels) if labels is not None else [_plan_name(plan, plans) for plan in plans]
    if len(names) != len(plans):
        raise InvalidInput("labels", labels, f"one text for each of the {len(plans)} plans")
    turning = any(np.any(plan.rotation != 0.0) for plan in plans)
    with styled():
        figure = new_figure(5.4)
        panels = _lower_panels(figure, 3 if turning else 2)
        _tensions(panels[0], plans)
        _errors(panels[1], plans)
        if turning:
            _rotations(panels[2], plans)
        _against_reference(figure, plans, names)
    return figure


def snapshots(count: int) -> np.ndarray:
    """Indices of at most `SNAPSHOTS` evenly spread rows, first and last included."""
    return np.unique(np.linspace(0, count - 1, min(count, SNAPSHOTS)).round().astype(int))


def _lower_panels(figure: Figure, count: int) -> list[Axes]:
    """``count`` panels along the lower edge."""
    gap, left, right = 0.09, 0.075, 0.985
    width = (right - left - gap * (count - 1)) / count
    return [figure.add_axes((left + k * (width + gap), 0.085, width, 0.30)) for k in range(count)]


def _bodies(figure: Figure, motion: Motion) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    shown = snapshots(len(motion.shapes))
    bodies = [MM * fine(motion.shapes[k]).centerline for k in shown]
    tips = MM * np.array([shape.centerline[-1] for shape in motion.shapes])
    walls = walls_around(motion.shapes)
    axes = space(figure, (0.0, 0.46, 0.93, 0.49), [*bodies, tips, *walls])
    draw_walls(axes, walls)
    scale = ScalarMappable(Normalize(0.0, 1.0), colormaps["viridis_r"])
    for k, body in sorted(zip(shown, bodies, strict=True), key=lambda pair: -motion.insertion[pair[0]]):
        draw(axes, body, color=scale.to_rgba(motion.insertion[k]), lw=1.1)  # the longest first, below all others
    tube = " (tube axis)" if motion.robot.section.r_na else ""
    draw(axes, tips, color=INK, lw=0.7, marker=".", ms=3.0, label="path of the tip" + tube)
    figure.text(0.01, 0.985, f"(a) {motion.robot.name}: bodies in space", weight="bold", size=8.5, va="top")
    figure.legend(loc="upper left", bbox_to_anchor=(0.005, 0.955))
    bar = figure.colorbar(scale, cax=figure.add_axes((0.92, 0.55, 0.014, 0.36)))
    bar.set_label("insertion η")


def _commands(figure: Figure, motion: Motion) -> None:
    from matplotlib.ticker import MaxNLocator

    insertion, rotation, tension = panels = _lower_panels(figure, 3)
    steps = np.arange(1, motion.insertion.size + 1)
    mark = {"marker": ".", "lw": 1.0}
    insertion.plot(steps, motion.insertion, color=INK, **mark)
    rotation.plot(steps, np.degrees(motion.rotation), color=INK, **mark)
    for i in range(motion.tension.shape[1]):
        colour = COLOURS[i % len(COLOURS)]
        tension.plot(steps, motion.tension[:, i], color=colour, label=f"tendon {i + 1}", **mark)
    if motion.tension.shape[1] > 1:
        tension.legend()
    titles = ("insertion η (-)", "rotation (deg)", "tension (N)")
    for letter, axes, title in zip("bcd", panels, titles, strict=True):
        labelled(axes, "step", title)
        titled(axes, letter, title.split(" ")[0])
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


def _tensions(axes: Axes, plans: Sequence[Plan]) -> None:
    fine_progress = np.linspace(0.0, 1.0, 101)
    for k, plan in enumerate(plans):
        mark = _mark(k, len(plans))
        axes.plot(plan.progress, plan.tension, **{**mark, "ls": ""})
        if plan.progress.size > 2:
            axes.plot(fine_progress, np.polyval(plan.polynomial(2), fine_progress), **{**mark, "marker": ""})
    axes.set_ylim(0.0, 1.15 * max(plan.tension.max() for plan in plans) or 1.0)
    labelled(axes, _PROGRESS, "tendon tension τ (N)")
    titled(axes, "b", "tension, quadratic fit")


def _errors(axes: Axes, plans: Sequence[Plan]) -> None:
    unit, factor = reading_unit(max(max(plan.body_max.max(), plan.tip_error.max()) for plan in plans))
    for k, plan in enumerate(plans):
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(plan.progress, factor * plan.body_rms, color=colour)
        axes.plot(plan.progress, factor * plan.tip_error, color=colour, lw=1.0, ls=(0, (3, 1.2)))
    axes.set_ylim(0.0, max(1.2 * axes.get_ylim()[1], 1.0 if unit == "nm" else 0.0))  # below 1 nm there is only rounding
    labelled(axes, _PROGRESS, f"error ({unit})")
    titled(axes, "c", "distance from the reference")
    axes.legend(handles=_error_legend(), loc="upper center", ncols=2, columnspacing=1.0, handlelength=1.4)


def _mark(k: int, count: int) -> dict[str, Any]:
    """Marks of plan k that stay visible where a later plan has the same values: wider rings below narrower ones."""
    last = k == count - 1
    colour, size = COLOURS[k % len(COLOURS)], 2.6 + 1.8 * (count - 1 - k)
    dashes = ("-", (0, (4, 2)), (0, (1, 1.2)))[k % 3]
    return {
        "color": colour,
        "marker": "o",
        "ms": size,
        "mfc": colour if last else "none",
        "mew": 0.8,
        "lw": 0.9,
        "ls": dashes,
    }


def _rotations(axes: Axes, plans: Sequence[Plan]) -> None:
    for k, plan in enumerate(plans):
        axes.plot(plan.progress, np.degrees(plan.rotation), **_mark(k, len(plans)))
    labelled(axes, _PROGRESS, "rotation (deg)")
    titled(axes, "d", "rotation")


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
