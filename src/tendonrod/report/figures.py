"""The report's own figures, in the style of `tendonrod.plot`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..plot.style import (
    BLUE,
    COLOURS,
    GREEN,
    INK,
    MM,
    ORANGE,
    PALE,
    PURPLE,
    QUIET,
    VERMILION,
    labelled,
    new_figure,
    styled,
    titled,
)  # fmt: skip
from ..plot.views import ABOVE, TIP
from ..section import TORSION_MODELS
from ..statics.shape import Shape
from . import paper
from .chapter import short, title_of
from .results import SWEPT, TENSIONS, Fan, GravityEffect, Misprints, Plans

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MODEL_COLOUR = {"published": BLUE, "open_section": VERMILION, "homogenized": GREEN}
_ROBOT_COLOUR: dict[str, str] = dict(zip(paper.PROTOTYPES, COLOURS[:4], strict=True))


def tension_figure(found: Plans) -> Figure:
    """Tension laws for the largest target with gravity, and the error of the tip when they are commanded."""
    best, eta = found.heavy[-1], np.linspace(0.0, 1.0, 201)
    with styled():
        figure = new_figure(3.2)
        left, right = figure.subplots(1, 2)
        figure.subplots_adjust(0.075, 0.14, 0.985, 0.90, 0.22)
        for colour, (tolerance, plan) in zip((ORANGE, GREEN, PURPLE), found.searches.items(), strict=True):
            name = f"paper's search, {MM * tolerance:g} mm"
            left.plot(plan.progress, plan.tension, color=colour, lw=0.9, marker=".", label=name)
            right.plot(plan.progress, MM * plan.tip_error, color=colour, lw=0.9, marker=".")
        left.plot(eta, np.polyval(paper.FTL_POLYNOMIAL, eta), color=INK, label="paper's fit")
        right.plot(best.progress, MM * found.printed.tip_error, color=INK)
        left.plot(best.progress, best.tension, color=BLUE, ls="", marker="o", label="optimum")
        left.plot(eta, np.polyval(best.polynomial(2), eta), color=BLUE, lw=0.9, label="its quadratic fit")
        right.plot(best.progress, MM * best.tip_error, color=BLUE, ls="", marker="o")
        right.plot(best.progress, MM * found.fitted.tip_error, color=BLUE, lw=0.9)
        printed = MM * paper.FTL_TIP_RMSE_SIMULATED
        right.axhline(printed, color=INK, ls=(0, (1, 1.5)), lw=0.9, label=f"RMSE that the paper prints, {printed:g} mm")
        right.legend(loc="upper left")
        left.set_ylim(0.0, 0.85)
        right.set_ylim(0.0, 1.2 * MM * found.printed.tip_error.max())  # room for the legend
        labelled(left, "progress η", "tendon tension τ (N)").legend(loc="lower right")
        labelled(right, "progress η", "tip to reference (mm)")
        titled(left, "a", f"tension, {best.target_tension:g} N with gravity")
        titled(right, "b", "error of the tip")
    return figure


def fan_figure(fans: Sequence[Fan]) -> Figure:
    """Tube axes of all prototypes at several tensions, from above and from the tip, to one scale."""
    from matplotlib import colormaps

    colours = colormaps["viridis"](np.linspace(0.88, 0.0, len(TENSIONS)))
    with styled():
        figure = new_figure(7.6)
        grid: Any = figure.subplots(len(fans), 2, sharex="col", sharey="col", width_ratios=[1.62, 1.0])
        figure.subplots_adjust(0.075, 0.05, 0.985, 0.925, 0.16, 0.15)
        for k, (each, (above, end)) in enumerate(zip(fans, grid, strict=True)):
            for shapes, dashes in ((each.still, "-"), (each.heavy, (0, (3, 1.2)))):
                for shape, colour in zip(shapes, colours, strict=True):
                    for axes, view in ((above, ABOVE), (end, TIP)):
                        axes.plot(*view.project(MM * shape.centerline).T, color=colour, ls=dashes, lw=1.1)
            titled(above, "aceg"[k], f"{title_of(each.robot.name)}, {ABOVE.title}")
            titled(end, "bdfh"[k], TIP.title)
            ABOVE.prepare(above)
            TIP.prepare(end)
        for axes in grid[:-1].flat:
            axes.set_xlabel("")
        _one_scale(grid)
        figure.legend(handles=_fan_legend(colours), loc="upper center", ncols=len(TENSIONS) + 2, columnspacing=1.3)
    return figure


def deflection_figure(fans: Sequence[Fan]) -> Figure:
    """Deflection of the tip and radius of the helix against tension, with the linear model's range."""
    with styled():
        figure = new_figure(3.1)
        left, right = figure.subplots(1, 2)
        figure.subplots_adjust(0.075, 0.145, 0.985, 0.90, 0.22)
        for each in fans:
            colour = _ROBOT_COLOUR[each.robot.name]
            _ranged(left, each, each.deflection, colour)
            _ranged(right, each, each.radius, colour)
        for axes in (left, right):
            axes.set_xlim(0.0, 4.7)
            axes.set_ylim(0.0)
        labelled(left, "tendon tension τ (N)", "deflection of the tip (mm)")
        labelled(right, "tendon tension τ (N)", "radius of the helix (mm)")
        titled(left, "a", "deflection of the tip")
        titled(right, "b", "helix of the tube's axis")
    return figure


def torsion_figure(shapes: Mapping[str, Mapping[str, Shape]], moved: Mapping[str, Mapping[str, np.ndarray]]) -> Figure:
    """Tube axes by torsion model, from the tip, and how far the tip is from the published model's against tension."""
    with styled():
        figure = new_figure(4.9)
        lower: Any = figure.subplots(
            1, 2, sharey=True, gridspec_kw={"top": 0.42, "bottom": 0.09, "left": 0.075, "right": 0.985}
        )
        upper = [figure.add_axes((0.075 + 0.2415 * k, 0.57, 0.178, 0.30)) for k in range(len(shapes))]
        for k, (end, (name, by_model)) in enumerate(zip(upper, shapes.items(), strict=True)):
            for model, shape in by_model.items():
                dashes = (0, (3, 1.2)) if model == "homogenized" else "-"
                path = TIP.project(MM * shape.centerline)
                end.plot(*path.T, color=_MODEL_COLOUR[model], ls=dashes, label=model)
            TIP.prepare(end).set_aspect("equal", adjustable="datalim")
            end.set_ylabel("x (mm)" if k == 0 else "")
            titled(end, "abcd"[k], title_of(name))
            for axes, by_tension in zip(lower, moved[name].values(), strict=True):
                axes.plot(SWEPT, MM * by_tension, color=_ROBOT_COLOUR[name], label=short(name))
        for letter, axes, model in zip("ef", lower, TORSION_MODELS[1:], strict=True):
            labelled(axes, "tendon tension τ (N)", "tip from published (mm)" if letter == "e" else "")
            titled(axes, letter, f"{model} against published")
        lower[0].legend(loc="upper left")
        figure.legend(*upper[0].get_legend_handles_labels(), loc="upper center", ncols=3)
    return figure


def gravity_figure(effects: Sequence[GravityEffect]) -> Figure:
    """Bounds of Table I along the robots, against self-weight, one degree of tilt and half a gram at the tip."""
    at = np.array(paper.MEASURED_AT)
    with styled():
        figure = new_figure(3.3)
        panels: Any = figure.subplots(1, len(effects), sharex=True, sharey=True)
        figure.subplots_adjust(0.075, 0.135, 0.985, 0.80, 0.08)
        for k, (each, axes) in enumerate(zip(effects, panels, strict=True)):
            low, high = (MM * bound for bound in (each.weight.min(axis=(0, 1)), each.weight.max(axis=(0, 1))))
            axes.fill_between(
                at,
                low,
                high,
                color=BLUE,
                alpha=0.35,
                lw=1.0,
                label=f"self-weight, 0 to {paper.LARGEST_TENSION:g} N, both torsions",
            )
            axes.plot(at, MM * each.tilt, color=QUIET, ls=(0, (4, 1.5)), lw=1.1, label="1° of base tilt")
            axes.plot(at, MM * each.mass[0], color=GREEN, ls=(0, (1, 1.2)), lw=1.3, label="0.5 g at the tip")
            axes.plot(at, MM * each.bound, color=VERMILION, ls="", marker="D", ms=4.5, label="demanded by Table I")
            axes.set_yscale("log")
            axes.set_xticks(at, ["¼", "½", "¾", "1"])
            axes.set_xlim(0.18, 1.07)
            labelled(axes, "s / $L_{na}$", "distance between model runs (mm)" if k == 0 else "")
            titled(axes, "abcd"[k], title_of(each.name))
            axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="upper center", ncols=4, columnspacing=1.3)
    return figure


def misprint_figure(found: Misprints) -> Figure:
    """Bodies and strains of prototype 1 by the printed and the right equations, without load."""
    right, moment, inertia = found.right[0], found.moment_term[0], found.inertia[0]
    named = [("right", right.position, BLUE), ("printed $\\hat{u} K_{se}$", moment.position, VERMILION)]
    named.append(("printed $I_y$ < 0", inertia.position, PURPLE))
    with styled():
        figure = new_figure(4.7)
        above, end = figure.add_axes((0.075, 0.60, 0.55, 0.34)), figure.add_axes((0.71, 0.60, 0.275, 0.34))
        strain = figure.add_axes((0.075, 0.10, 0.91, 0.36))
        for name, position, colour in named:
            for axes, view in ((above, ABOVE), (end, TIP)):
                axes.plot(*view.project(MM * position).T, color=colour, lw=1.8, label=name)
        for axes, view in ((above, ABOVE), (end, TIP)):
            view.prepare(axes).set_aspect("equal", adjustable="datalim")
        above.legend(loc="lower left")
        for s, u, colour in ((moment.s, moment.u, VERMILION), (right.s, right.u, BLUE), (inertia.s, inertia.u, PURPLE)):
            shown = s <= 12e-3
            strain.plot(MM * s[shown], u[shown, 1], color=colour)
        labelled(strain, "s (mm)", "$u_y$ (1/m)")
        for letter, axes, title in (
            ("a", above, ABOVE.title),
            ("b", end, TIP.title),
            ("c", strain, "bending towards the tendon, first 12 mm"),
        ):
            titled(axes, letter, title)
    return figure


def _one_scale(grid: Any) -> None:
    """One millimetre is equally long on both axes; shared limits make all panels of a column alike."""
    for axes in grid.flat:
        axes.set_aspect("equal", adjustable="box", anchor="NW")


def _fan_legend(colours: np.ndarray) -> list[Any]:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, lw=2.0, label=f"{tension:g} N")
        for tension, colour in zip(TENSIONS, colours, strict=True)
    ]
    handles.append(Line2D([], [], color=INK, lw=1.1, label="no load"))
    return [*handles, Line2D([], [], color=INK, lw=1.1, ls=(0, (3, 1.2)), label="gravity")]


def _ranged(axes: Axes, each: Fan, values: np.ndarray, colour: str) -> None:
    """A curve, thick within the linear model's range and marked at its ends."""
    low, high = each.lift_off or 0.0, each.plateau or each.swept[-1]
    axes.plot(each.swept, MM * values, color=colour, lw=0.7, alpha=0.7)
    inside = np.concatenate([[low], each.swept[(each.swept > low) & (each.swept < high)], [high]])
    axes.plot(inside, MM * np.interp(inside, each.swept, values), color=colour, lw=2.2)
    ends = MM * np.interp([low, high], each.swept, values)
    axes.plot([low], ends[:1], color=colour, marker="o", mfc="white", ms=4.5)
    axes.plot([high], ends[1:], color=colour, marker="s", mec=PALE, mew=0.6, ms=4.5)
    name = short(each.robot.name)
    axes.annotate(name, (high, ends[1]), (5, -9), textcoords="offset points", color=colour, weight="bold")
