"""Figures of what a robot reaches in a phantom: a map over levels and targets, and the bodies in axial sections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .navigation_scene import draw_section
from .style import GREEN, INK, MM, QUIET, VERMILION, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..anatomy import Phantom
    from ..navigate.reach import Reach

COLUMNS = ("lateral-left", "ventral", "lateral-right", "drg-left", "drg-right")  # as seen by the patient
ROW, SECTION = 0.52, 1.6  # inches
ACROSS, HALF = 5, 16.0  # sections in a row; mm shown to each side


def reach_map(results: Sequence[Reach], phantom: Phantom) -> Figure:
    """Levels from the head down against kinds of target: how near the tip came, and the least gap on the way, mm."""
    levels = [each.name for each in phantom.levels if any(_level(r) == each.name for r in results)]
    kinds = [kind for kind in COLUMNS if any(_kind(r) == kind for r in results)]
    with styled():
        figure = new_figure(0.75 + ROW * len(levels))
        axes = figure.add_axes((0.08, 0.02, 0.9, 0.9 - 0.25 / (1 + len(levels))))
        axes.set(xlim=(0, len(kinds)), ylim=(len(levels), 0), yticks=np.arange(len(levels)) + 0.5, yticklabels=levels)
        axes.set(xticks=np.arange(len(kinds)) + 0.5, xticklabels=kinds)
        axes.xaxis.tick_top()
        axes.tick_params(length=0, labelsize=8.0)
        axes.grid(visible=False)
        for spine in axes.spines.values():
            spine.set_visible(False)
        for each in results:
            _cell(axes, kinds.index(_kind(each)), levels.index(_level(each)), each)
    return figure


def _cell(axes: Axes, column: int, row: int, found: Reach) -> None:
    from matplotlib.patches import Rectangle

    good = found.reached and found.within_limits
    colour = GREEN if good else VERMILION
    axes.add_patch(Rectangle((column + 0.03, row + 0.06), 0.94, 0.88, fc=colour, alpha=0.16, ec="none"))
    axes.add_patch(Rectangle((column + 0.03, row + 0.06), 0.02, 0.88, fc=colour, ec="none"))
    name, gap = least_gap(found)
    first = f"{'reached' if good else 'nearest'}, {MM * found.nearest:.1f} mm"
    second = f"gap to {name} {MM * gap:.2f} mm" if good else f"in the way: {' or '.join(found.limited_by) or 'several'}"
    style: Any = {"ha": "left", "va": "center"}
    axes.text(column + 0.09, row + 0.33, first, size=7.5, color=INK, weight="bold", **style)
    axes.text(column + 0.09, row + 0.69, second, size=6.5, color=QUIET, **style)


def sections_figure(results: Sequence[Reach]) -> Figure:
    """For each target: the phantom cut at the tip's height, and the body on its way there, as seen from the tip."""
    rows = -(-len(results) // ACROSS)
    with styled():
        figure = new_figure(rows * SECTION)
        grid = figure.subplots(rows, ACROSS, squeeze=False)
        figure.subplots_adjust(
            left=0.005, right=0.995, bottom=0.005, top=1.0 - 0.2 / (rows * SECTION), hspace=0.17, wspace=0.05
        )
        for axes in grid.flat[len(results) :]:
            axes.set_axis_off()
        for axes, each in zip(grid.flat, results, strict=False):
            draw_section(axes, each.end, each.scenario, HALF, each.target)
            good = each.reached and each.within_limits
            axes.set_title(each.target, size=7.5, color=INK if good else VERMILION, loc="center", pad=3)
    return figure


def least_gap(found: Reach) -> tuple[str, float]:
    """The structure that the tube came nearest to on the way, and how near, m."""
    gaps = found.metrics.clearance
    name = min(gaps, key=lambda each: gaps[each].value)
    return name, gaps[name].value


def _level(found: Reach) -> str:
    return found.target.partition("@")[2]


def _kind(found: Reach) -> str:
    return found.target.partition("@")[0]
