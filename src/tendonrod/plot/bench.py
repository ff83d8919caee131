"""Figures of follow-the-leader trials on a bench, the paper's Fig. 8: tension, tip, its path, bodies; and control."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..rig.inserted import Inserted, inserted
from ..rig.profiles import PAPER
from ..rig.trials import Followed
from .bench_lines import (
    BODY,
    DOTS,
    PLANNED,
    REFERENCE,
    binned,
    colour,
    furthest,
    head_room,
    is_running,
    legend_above,
    line,
    planned_tip,
    postures,
    spread,
    tip_errors,
)
from .shapes import fine
from .style import (
    INK,
    MM,
    PALE,
    QUIET,
    draw,
    labelled,
    new_figure,
    space,
    styled,
    titled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ABOVE = np.array([2.2, 0.0, 0.0])  # mm, from a tip to its text
INSERTIONS = np.linspace(0.0, 1.0, 201)
PAPERS: Any = {"color": QUIET, "lw": 1.0, "ls": (0, (5, 1.5, 1, 1.5))}
TARGET: Any = {"color": INK, "lw": 0.9, "ls": (0, (1, 2.5)), "zorder": 5, "label": "target, as recorded"}
_ETA = "progress η"


def tension_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """Measured and wanted tension over the insertion, and the error between them, as the paper's Fig. 8(a)."""
    ways = [inserted(each) for each in found]
    with styled():
        figure = new_figure(4.6)
        top, low = _rows(figure, (1.7, 1.0), len(found) + 3)
        profile = [found[0].profile.tension.value(x) for x in INSERTIONS]
        top.plot(INSERTIONS, profile, color=PALE, lw=4.5, label=f"profile: {found[0].profile.name}", zorder=1)
        for k, (way, name) in enumerate(zip(ways, names, strict=True)):
            spread(top, way.insertion, way.tension, k, name)
            spread(low, way.insertion, MM * way.error, k)
        longest = ways[furthest(ways)]
        top.plot(*line(longest.insertion, longest.target), **TARGET)
        if found[0].profile.name != "paper":
            top.plot(INSERTIONS, np.polyval(PAPER, INSERTIONS), **PAPERS, label="the paper's polynomial")
        low.axhline(0.0, color=QUIET, lw=0.6)
        labelled(top, "", "tension τ (N)")
        labelled(low, _ETA, r"$\tau_{FTL} - \tau$ (mN)")
        titled(top, "a", "tension at the load cell")
        titled(low, "b", "error")
        for axes in (top, low):
            axes.set_xlim(-0.01, 1.01)
        legend_above(figure, top)
    return figure


def tip_figure(found: Sequence[Followed], names: Sequence[str], marks: Sequence[float] = ()) -> Figure:
    """x, y, z of the tip over the insertion with the reference, and its distance from it, as the paper's Fig. 8(c).

    marks: root mean square distances of others (m), to compare with.
    """
    ways, first = [inserted(each) for each in found], found[0]
    reference = MM * first.reference.at(INSERTIONS * first.reference.s[-1])
    at, planned = planned_tip(first)
    with styled():
        figure = new_figure(5.4)
        grid: Any = figure.subplots(2, 2, sharex=True)
        top = 1.0 - head_room(len(found) + 2) / figure.get_figheight()
        figure.subplots_adjust(left=0.08, right=0.985, top=top, bottom=0.08, hspace=0.24, wspace=0.2)
        for i, axes in enumerate(grid.flat[:3]):
            axes.plot(INSERTIONS, reference[:, i], **REFERENCE, label="reference", zorder=1)
            for k, (way, name) in enumerate(zip(ways, names, strict=True)):
                axes.plot(way.tip_insertion, MM * way.tip[:, i], color=colour(k), **DOTS)
                axes.plot(*line(way.tip_insertion, MM * way.tip[:, i]), color=colour(k), lw=1.0, label=name, zorder=3)
            axes.plot(at, MM * planned[:, i], **PLANNED, label="model at the profile's tension", zorder=4)
            labelled(axes, _ETA if i == 2 else "", f"{'xyz'[i]} of the tip (mm)")
            titled(axes, "abc"[i], "xyz"[i])
        _distances(grid[1, 1], first, ways, marks)
        legend_above(figure, grid[0, 0])
    return figure


def path_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """Measured paths of the tip in space, with the reference, as the paper's Fig. 8(d)."""
    ways, first = [inserted(each) for each in found], found[0]
    reference, (_, planned) = MM * first.reference.points, planned_tip(first)
    with styled():
        figure = new_figure(3.2)
        axes = space(figure, (0.0, -0.02, 1.0, 0.94), [reference, *(MM * way.tip for way in ways)])
        draw(axes, reference, **REFERENCE, label="reference: the whole robot")
        for k, (way, name) in enumerate(zip(ways, names, strict=True)):
            draw(axes, MM * way.tip, color=colour(k), **DOTS)
            mean = np.stack([line(way.tip_insertion, MM * way.tip[:, i])[1] for i in range(3)], axis=1)
            draw(axes, mean, color=colour(k), lw=1.0, label=name)
        draw(axes, MM * planned, **PLANNED, label="model at the profile's tension")
        legend_above(figure, axes)
    return figure


def bodies_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """Bodies on the way: the model at the readings of a few frames of one trial, as the paper's Fig. 8(b).

    The trial is the first of those that came furthest. Rings: where the tracker saw the tips of all trials then.
    """
    from matplotlib import colormaps

    ways = [inserted(each) for each in found]
    which = furthest(ways)
    reference, shapes = MM * found[which].reference.points, postures(found[which], ways[which])
    paths = [MM * fine(shape).centerline for _, shape in shapes]
    with styled():
        figure = new_figure(3.2)
        axes: Any = space(figure, (0.0, -0.02, 1.0, 0.94), [reference, *paths])
        draw(axes, reference, **REFERENCE, label="reference: the whole robot")
        for j in reversed(range(len(paths))):  # the longest first, below all others
            shade = colormaps["viridis_r"](shapes[j][0])
            draw(axes, paths[j], **BODY, color=shade, label=None if j else f"model at the readings of {names[which]}")
            axes.text(*(paths[j][-1] + ABOVE), f"η = {shapes[j][0]:.2f}", size=6.8, ha="center", clip_on=False)
        for k, (way, name) in enumerate(zip(ways, names, strict=True)):
            tips = MM * np.array([_tip_near(way, insertion) for insertion, _ in shapes]).reshape(-1, 3)
            mark: Any = {"color": colour(k), "marker": "o", "ms": 5.0 - k % 3, "mfc": "none", "mew": 0.9, "ls": ""}
            draw(axes, tips, **mark, label=f"tip, {name}")
        legend_above(figure, axes)
    return figure


def control_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """What the controller did: tension error, velocities of screw and translation over time, and control periods."""
    with styled():
        figure = new_figure(6.6)
        *panels, low = _rows(figure, (1.2, 1.0, 1.2, 0.9), len(found), hspace=0.62)
        shown: tuple[Callable[..., Any], ...] = (_error, _screw, _translation)
        for k, (each, name) in enumerate(zip(found, names, strict=True)):
            time = each.record.time - each.record.time[0]
            for axes, values in zip(panels, shown, strict=True):
                spread(axes, time, MM * values(each), k, name)
            fault = each.outcome.fault
            if fault is not None:
                for axes in panels:
                    axes.axvline(fault.time - each.record.time[0], color=colour(k), lw=0.8, ls=(0, (3, 2)))
        _fit_error(panels[0], [inserted(each) for each in found])
        _periods(low, found)
        texts = ("τ_FTL − τ (mN)", "screw (mm/s)", "translation (mm/s)")
        titles = ("tension error", "lead screw, tendon paid out", "translation of the robot")
        for axes, letter, title, text in zip(panels, "abc", titles, texts, strict=True):
            titled(axes, letter, title)
            labelled(axes, "", text.replace("τ_FTL", r"$\tau_{FTL}$"))
            axes.axhline(0.0, color=QUIET, lw=0.6)
            axes.sharex(panels[0])
        panels[0].set_xlim(0.0, max(float(np.ptp(each.record.time)) for each in found))
        panels[2].set_xlabel("time from the start of the record (s)")
        legend_above(figure, panels[0])
    return figure


def _rows(figure: Figure, heights: Sequence[float], names: int, hspace: float = 0.3) -> list[Axes]:
    room = figure.get_figheight()
    top = 1.0 - head_room(names) / room
    figure.subplots_adjust(left=0.085, right=0.985, top=top, bottom=0.42 / room, hspace=hspace)
    return list(figure.subplots(len(heights), 1, height_ratios=heights).flat)


def _distances(axes: Axes, first: Followed, ways: Sequence[Inserted], marks: Sequence[float]) -> None:
    """Root mean square distance by bin of insertion, of the trials and the plan."""
    for k, way in enumerate(ways):
        at, squares, *_ = binned(way.tip_insertion, way.tip_error[:, 0] ** 2, 50)
        axes.plot(at, MM * np.sqrt(squares), color=colour(k), lw=1.0)
    at, planned = planned_tip(first)
    axes.plot(at, MM * tip_errors(first, at, planned)[:, 0], **PLANNED)
    for mark in marks:
        axes.axhline(MM * mark, **PAPERS)
    if marks:
        axes.text(0.0, MM * max(marks), "the paper's three trials, RMSE", size=7.0, color=QUIET, va="bottom")
    axes.set_ylim(0.0, 1.12 * max(axes.get_ylim()[1], *(MM * mark for mark in marks), 0.1))
    labelled(axes, _ETA, "distance (mm)")
    titled(axes, "d", "tip from the reference, by projection")


def _tip_near(way: Inserted, insertion: float) -> np.ndarray:
    """The tip in the frame nearest to ``insertion``, NaN where the trial did not come so far."""
    if not len(way.tip) or insertion > way.tip_insertion.max() + 0.01:
        return np.full(3, np.nan)
    return way.tip[np.argmin(np.abs(way.tip_insertion - insertion))]


def _error(each: Followed) -> np.ndarray:
    error = each.record.samples["command"]["target"] - each.record.samples["force"]["tension"]
    return np.where(is_running(each), error, np.nan)


def _screw(each: Followed) -> np.ndarray:
    return each.record.samples["screw"]["velocity"]


def _translation(each: Followed) -> np.ndarray:
    return each.record.samples["translation"]["velocity"]


def _fit_error(axes: Axes, ways: Sequence[Inserted]) -> None:
    """Room for the way out; taking up the tendon starts with the whole tension missing, which would hide all else."""
    largest = [way.error_max for way in ways if np.isfinite(way.error_max)]
    if largest:
        axes.set_ylim(-1.3 * MM * max(largest), 1.3 * MM * max(largest))


def _periods(axes: Axes, found: Sequence[Followed]) -> None:
    """How often a control period was how long, all trials beside each other."""
    periods = [MM * np.diff(each.record.time[is_running(each)]) for each in found]
    every = np.concatenate(periods)
    if every.size:
        nominal = MM / float(found[0].record.header.get("rate", MM / np.median(every)))
        widest = 1.05 * max(np.abs(every - nominal).max(), 0.1 * nominal)
        edges = nominal + widest * np.arange(-30.5, 31.0) / 30.5  # the nominal period is in the middle of a bin
        axes.hist(periods, bins=list(edges), color=[colour(k) for k in range(len(found))], log=True)
        axes.set_ylim(0.5, 4.0 * axes.get_ylim()[1])
    titled(axes, "d", "control periods while it ran")
    labelled(axes, "period (ms)", "how often")
