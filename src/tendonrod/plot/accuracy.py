"""Figures of an `Accuracy`: measured points and model over tension and in space, errors, bias and scatter."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from ..measurement.accuracy import WITH, WITHOUT, Accuracy, Place
from ..measurement.errorvectors import VARIES
from ..measurement.posture import posture
from ..robot import Robot
from ..rotation import exp_so3
from ..statics.shape import Shape
from .style import BLUE, COLOURS, INK, MM, PALE, QUIET, VERMILION, draw, labelled, new_figure, space, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEVELS = 4  # bodies in space
MAGNIFICATIONS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
LONGEST_ARROW = 0.2  # of the longest distance from the exit
MODEL: dict[str, dict[str, Any]] = {
    WITH: {"color": BLUE, "ls": "-", "lw": 1.2},
    WITHOUT: {"color": VERMILION, "ls": (0, (3.5, 1.5)), "lw": 1.2},
}
LEAST_SPAN = 1.0  # mm, of an axis of coordinates: less is noise
MOST_DRAWN = 1500  # samples of a place that are drawn one by one


def components_figure(found: Accuracy, robot: Robot | None = None) -> Figure:
    """x, y and z of each place against what drives the tendon, measured and modelled, as the paper's Fig. 6(b)."""
    shown = _places(found, robot)
    with styled():
        figure = new_figure(5.0)
        grid: Any = figure.subplots(3, len(shown), sharex=True, squeeze=False)
        figure.subplots_adjust(0.075, 0.085, 0.985, 0.895, 0.34, 0.16)
        for column, place in enumerate(shown):
            values, label = drive(place)
            for row, axes in enumerate(grid[:, column]):
                _component(axes, found, place, values, row)
            grid[0, column].set_title(f"({'abcdefgh'[column % 8]}) s = {place_text(place)}")
            grid[-1, column].set_xlabel(label)
        for axes, name in zip(grid[:, 0], "xyz", strict=True):
            axes.set_ylabel(f"{name} (mm)")
        handles = [_dots(), *(_line(run) for run in reversed(found.runs))]
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.06, 1.0), ncols=3)
    return figure


def space_figure(found: Accuracy, robot: Robot | None = None) -> Figure:
    """Bodies of the model at a few readings in space, measured points, and error vectors from the model's points.

    Vectors longer than true are to one scale, which the legend tells.
    """
    from matplotlib import colormaps

    shown = _places(found, robot)
    chosen, bodies = _levels(found, shown)
    factor = _magnification(found, shown, chosen)
    colours = colormaps["viridis"](np.linspace(0.85, 0.0, len(bodies)))
    arrows = [_arrows(found, shown, each, factor) for each in chosen]
    with styled():
        figure = new_figure(3.3)
        axes = space(figure, (0.0, 0.0, 1.0, 0.90), [*(MM * each.centerline for each in bodies), *chain(*arrows)])
        for each, lines, colour, samples in zip(bodies, arrows, colours, chosen, strict=True):
            draw(axes, MM * each.centerline, color=colour, lw=1.6, solid_capstyle="round", label=_level(shown, samples))
            for line, (k, i) in zip(lines, samples, strict=True):
                draw(axes, line, color=VERMILION, lw=0.9)
                draw(axes, MM * shown[k].measured[i : i + 1], color=colour, ls="", marker="o", ms=4.0, mec=INK, mew=0.5)
        figure.text(
            0.01, 0.985, f"{shown[0].robot.name}: bodies in space, tube axis", weight="bold", size=8.5, va="top"
        )
        handles = [*axes.get_legend_handles_labels()[0], *_space_legend(factor)]
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.005, 0.955), ncols=3)
    return figure


def error_figure(found: Accuracy, robot: Robot | None = None) -> Figure:
    """Length of the error vectors of each place against what drives the tendon, a panel for each run."""
    shown = _places(found, robot)
    with styled():
        figure = new_figure(2.9)
        grid: Any = figure.subplots(1, len(found.runs), sharey=True, squeeze=False)
        figure.subplots_adjust(0.075, 0.15, 0.985, 0.82, 0.1)
        for letter, axes, run in zip("ab", grid[0], found.runs, strict=False):
            for place, colour in zip(shown, _colours(shown), strict=True):
                dots: dict[str, Any] = {"ls": "", "marker": ".", "color": colour, "ms": 4.0} | faint(place.n)
                axes.plot(drive(place)[0], MM * place.errors[run].distances, **dots)
                axes.axhline(MM * place.errors[run].rmse, color=colour if not many(place.n) else INK, lw=0.8)
            titled(axes, letter, f"measured − model, {run}")
            labelled(axes, drive(shown[0])[1], "error (mm)" if letter == "a" else "")
            axes.set_ylim(0.0)
        handles = [
            _dots(f"s = {place_text(each)}", colour) for each, colour in zip(shown, _colours(shown), strict=True)
        ]
        figure.legend(
            handles=[*handles, _plain_line(INK, "RMSE")], loc="upper left", bbox_to_anchor=(0.06, 1.0), ncols=6
        )
    return figure


def bias_figure(found: Accuracy, robot: Robot | None = None) -> Figure:
    """Mean error vector and scatter about it along the robot, beside what a lean of the whole model would give."""
    shown = _places(found, robot)
    own = shown[0].robot
    with styled():
        figure = new_figure(2.9)
        grid: Any = figure.subplots(1, 2)
        figure.subplots_adjust(0.075, 0.15, 0.985, 0.82, 0.2)
        at = np.array([each.share for each in shown])
        for run in found.runs:
            errors = [each.errors[run] for each in shown]
            style = {"color": MODEL[run]["color"], "lw": 1.0}
            grid[0].plot(at, [MM * np.linalg.norm(each.bias) for each in errors], marker="o", **style)
            grid[0].plot(at, [MM * each.scatter for each in errors], marker="s", mfc="white", ls=(0, (1, 1.2)), **style)
        _lean(grid[0], found, own)
        _bias_components(grid[1], found, shown, at)
        labelled(grid[0], "s / $L_{na}$", "error (mm)").set_ylim(0.0)
        labelled(grid[1], "s / $L_{na}$", "mean error (mm)")
        titled(grid[0], "a", "bias and scatter")
        titled(grid[1], "b", f"bias by axis, {found.best_known}")
        for axes in grid:
            axes.set_xlim(0.0, 1.04)
        where: Any = {"loc": "upper left", "bbox_to_anchor": (0.055, 1.0), "ncols": 5}
        figure.legend(handles=_bias_legend(found, own), columnspacing=1.0, handletextpad=0.5, **where)
    return figure


def drive(place: Place) -> tuple[np.ndarray, str]:
    """(n,) what the samples of a place are drawn against, and its name.

    Insertion where it varies, else tension, pulled length, or their number.
    """
    insertion = next(iter(place.errors.values())).insertion
    if np.ptp(insertion) > VARIES:
        return 100.0 * insertion, "insertion (%)"
    if place.tensions.shape[1] == 1 and np.isfinite(place.tensions).all():
        return place.tensions[:, 0], "tension τ (N)"
    if place.displacements.shape[1] == 1 and np.isfinite(place.displacements).all():
        return MM * place.displacements[:, 0], "displacement (mm)"
    return np.arange(1.0, place.n + 1.0), "sample"


def place_text(place: Place) -> str:
    """Such as 0.25 L_na."""
    return f"{place.share:.3g} $L_{{na}}$"


def _places(found: Accuracy, robot: Robot | None) -> tuple[Place, ...]:
    return found.of(found.robots[0] if robot is None else robot)


def many(n: int) -> dict[str, Any]:
    """How to draw n samples: too many to tell apart become pixels, for a page that still opens."""
    return {"rasterized": True} if n > MOST_DRAWN else {}


def faint(n: int) -> dict[str, Any]:
    """How to draw n dots: of many, such that they darken where they are dense."""
    return {"rasterized": True, "ms": 2.0, "alpha": 0.25, "mew": 0.0} if n > MOST_DRAWN else {}


def _colours(places: Sequence[Place]) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(len(places))]


def _component(axes: Axes, found: Accuracy, place: Place, values: np.ndarray, k: int) -> None:
    order = np.arange(place.n) if place.robot.friction.any() else np.argsort(values, kind="stable")
    dots: dict[str, Any] = {"ls": "", "marker": "o", "ms": 2.4, "mfc": PALE, "mec": QUIET, "mew": 0.4}
    axes.plot(values, MM * place.measured[:, k], **dots | many(place.n))
    for run in found.runs:
        axes.plot(values[order], MM * place.errors[run].model[order, k], **MODEL[run], **many(place.n))
    low, high = axes.get_ylim()
    if high - low < LEAST_SPAN:
        axes.set_ylim(0.5 * (low + high - LEAST_SPAN), 0.5 * (low + high + LEAST_SPAN))


def _levels(found: Accuracy, shown: Sequence[Place]) -> tuple[list[list[tuple[int, int]]], list[Shape]]:
    """For each level (place, sample) pairs of nearly the same reading, and the body at the last of them."""
    values = [drive(each)[0] for each in shown]
    low, high = max(each.min() for each in values), min(each.max() for each in values)
    levels = np.linspace(low, high, LEVELS) if high > low else [values[-1][0]]
    chosen = [[(k, int(np.argmin(np.abs(each - level)))) for k, each in enumerate(values)] for level in levels]
    last = shown[-1]
    picked = [samples[-1][1] for samples in chosen]
    setup = found.setup if found.best_known == WITH else found.setup.weightless()
    return chosen, [posture(found.trials[last.trial[i]], int(last.sample[i]), setup) for i in picked]


def _magnification(found: Accuracy, shown: Sequence[Place], chosen: Sequence[Sequence[tuple[int, int]]]) -> int:
    """The largest of `MAGNIFICATIONS` at which no arrow is too long."""
    errors = [each.errors[found.best_known] for each in shown]
    longest = max(errors[k].distances[i] for samples in chosen for k, i in samples)
    room = LONGEST_ARROW * max(np.linalg.norm(each.model, axis=1).max() for each in errors)
    return max((each for each in MAGNIFICATIONS if each * longest <= room), default=1)


def _arrows(
    found: Accuracy, shown: Sequence[Place], samples: Sequence[tuple[int, int]], factor: int
) -> list[np.ndarray]:
    """(2, 3) mm, from the model's point on."""
    arrows = []
    for k, i in samples:
        errors = shown[k].errors[found.best_known]
        arrows.append(MM * np.array([errors.model[i], errors.model[i] + factor * errors.vectors[i]]))
    return arrows


def _level(shown: Sequence[Place], samples: Sequence[tuple[int, int]]) -> str:
    k, i = samples[-1]
    value, label = drive(shown[k])
    name, _, unit = label.partition(" (")
    return f"{name.split(' ')[-1]} = {value[i]:.3g} {unit.rstrip(')')}".rstrip()


def _space_legend(factor: int) -> list[Any]:
    times = "true length" if factor == 1 else f"{factor} × true length"
    return [
        _dots("measured, tube axis", QUIET),
        _plain_line(VERMILION, f"error vector from the model's point, {times}"),
    ]


def _lean(axes: Axes, found: Accuracy, robot: Robot) -> None:
    """Mean distance by which the lean moves the model's points, a line from the exit on."""
    turn, _ = found.lean(robot)
    places = found.of(robot)
    models = [each.errors[found.best_known].model for each in places]
    moved = [MM * float(np.linalg.norm((each @ exp_so3(turn).T - each).mean(axis=0))) for each in models]
    axes.plot([0.0, *(each.share for each in places)], [0.0, *moved], color=QUIET, lw=4.0, alpha=0.35, zorder=1.5)


def _bias_components(axes: Axes, found: Accuracy, shown: Sequence[Place], at: np.ndarray) -> None:
    biases = MM * np.array([each.errors[found.best_known].bias for each in shown])
    axes.axhline(0.0, color=QUIET, lw=0.6)
    for k, (name, colour) in enumerate(zip("xyz", COLOURS[2:5], strict=True)):
        axes.plot(at, biases[:, k], color=colour, marker="o", lw=1.0, label=name)
    axes.legend(ncols=3)


def _bias_legend(found: Accuracy, robot: Robot) -> list[Any]:
    from matplotlib.lines import Line2D

    angle = np.degrees(np.linalg.norm(found.lean(robot)[0]))
    runs = [_plain_line(MODEL[run]["color"], run) for run in reversed(found.runs)]
    return [
        *runs,
        _dots("bias: mean vector", INK),
        Line2D([], [], color=INK, ls=(0, (1, 1.2)), lw=1.0, marker="s", mfc="white", label="scatter about it"),
        Line2D([], [], color=QUIET, lw=4.0, alpha=0.35, label=f"a lean of {angle:.3g}°"),
    ]


def _dots(label: str = "measured", colour: str = QUIET) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], ls="", marker="o", ms=3.5, color=colour, label=label)


def _line(run: str) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], label=f"model, {run}", **MODEL[run])


def _plain_line(colour: str, label: str) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, lw=1.2, label=label)
