"""Figures of follow-the-leader trials on a bench, the paper's Fig. 8(a), (c): tension, tip; and what the loop did."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..rig.inserted import Inserted, inserted
from ..rig.profiles import PAPER
from ..rig.trials import Followed
from .bench_lines import (
    PLANNED,
    REFERENCE,
    band,
    binned,
    colour,
    furthest,
    head_room,
    is_running,
    legend_above,
    line,
    look,
    named,
    not_yet,
    planned_tip,
    span_of,
    tip_errors,
)
from .style import INK, MM, PALE, QUIET, labelled, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INSERTIONS = np.linspace(0.0, 1.0, 201)
FEW = 50  # bins of what is left when the reference is taken off
PAPERS: Any = {"color": QUIET, "lw": 1.0, "ls": (0, (5, 1.5, 1, 1.5))}
TARGET: Any = {"color": INK, "lw": 0.9, "ls": (0, (1, 2.5)), "zorder": 5, "label": "target, as recorded"}
NOISE: Any = {"color": QUIET, "lw": 0.8, "ls": (0, (1, 1.5))}
_ETA = "progress η"
_ERROR = r"$\tau_{FTL} - \tau$ (mN)"


def tension_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """Measured and wanted tension over the insertion, as the paper's Fig. 8(a); the error's readings; their means."""
    ways = [inserted(each) for each in found]
    with styled():
        figure = new_figure(5.6)
        top, readings, means = _rows(figure, (1.8, 0.9, 0.9), head_room(named(names) + 5, 4), hspace=0.36)
        _tensions(top, found, ways, names)
        band(readings, [way.insertion for way in ways], [MM * way.error for way in ways])
        for k, way in enumerate(ways):
            means.plot(*line(way.insertion, MM * way.error, 2 * FEW), **look(k, names, nested=False))
            _mark_largest(readings, way, k)
        for axes in (readings, means):
            axes.axhline(0.0, color=QUIET, lw=0.6)
            labelled(axes, "", _ERROR)
        titled(top, "a", "tension at the load cell")
        titled(readings, "b", "error: 90 % of the readings of all trials, and the largest of each")
        titled(means, "c", "error: means of each trial")
        for axes in (top, readings, means):
            not_yet(axes, ways, label=axes is top)
            axes.set_xlim(*span_of(ways))
        means.set_xlabel(_ETA)
        legend_above(figure, top, 4)
    return figure


def tip_figure(found: Sequence[Followed], names: Sequence[str], marks: Sequence[float] = ()) -> Figure:
    """x, y, z of the tip over the insertion with the reference, and what it is off, as the paper's Fig. 8(c).

    marks: root mean square distances of others (m), to compare with.
    """
    ways, first = [inserted(each) for each in found], found[0]
    with styled():
        figure = new_figure(6.8)
        top = 1.0 - head_room(named(names) + 3) / figure.get_figheight()
        grid = figure.add_gridspec(
            3, 3, height_ratios=(1.2, 1.0, 1.1), hspace=0.42, wspace=0.22,
            left=0.075, right=0.985, top=top, bottom=0.065,
        )  # fmt: skip
        upper = [figure.add_subplot(grid[0, i]) for i in range(3)]
        lower: list[Axes] = []
        for i in range(3):
            lower.append(figure.add_subplot(grid[1, i], sharey=lower[0] if i else None))
        _places(upper, first, ways, names)
        _departures(lower, first, ways, names)
        distance = figure.add_subplot(grid[2, :])
        _distances(distance, first, ways, names, marks)
        for axes in (*upper, *lower, distance):
            not_yet(axes, ways, label=axes is upper[0])
            axes.set_xlim(*span_of(ways))
        legend_above(figure, upper[0])
    return figure


def control_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """What the loop did over time: tension, velocities of screw and translation; control periods where they vary."""
    periods = [np.diff(each.record.time[is_running(each)]) for each in found]
    vary = np.ptp(np.concatenate(periods)) > 1e-6 if any(map(len, periods)) else False
    with styled():
        figure = new_figure(6.8 if vary else 4.9)
        heights = (1.3, 1.0, 1.0, 0.9) if vary else (1.3, 1.0, 1.0)
        faults = sum(each.outcome.fault is not None for each in found)
        *panels, low = _rows(figure, heights, head_room(named(names) + 1 + faults, 4), hspace=0.62 if vary else 0.5)
        panels = panels if vary else [*panels, low]
        times = [each.record.time - each.record.time[0] for each in found]
        _over_time(panels, found, times, names)
        for axes, letter, title, text in zip(panels, "abc", _TITLES, _VELOCITIES, strict=True):
            titled(axes, letter, title)
            labelled(axes, "", text)
            axes.axhline(0.0, color=QUIET, lw=0.6)
            axes.set_xlim(0.0, max(float(time[-1]) for time in times))
        panels[2].set_xlabel("time from the start of the record (s)")
        if vary:
            _periods(low, found, periods)
        legend_above(figure, panels[0], 4)
    return figure


_TITLES = ("tension: take-up, way out, release", "lead screw, tendon paid out", "translation of the robot")
_VELOCITIES = ("tension τ (N)", "screw (mm/s)", "robot (mm/s)")


def _rows(figure: Figure, heights: Sequence[float], head: float, hspace: float) -> list[Axes]:
    """Panels below each other, ``head`` inches below the upper edge."""
    room = figure.get_figheight()
    figure.subplots_adjust(left=0.085, right=0.985, top=1.0 - head / room, bottom=0.42 / room, hspace=hspace)
    return list(figure.subplots(len(heights), 1, height_ratios=heights).flat)


def _tensions(axes: Axes, found: Sequence[Followed], ways: Sequence[Inserted], names: Sequence[str]) -> None:
    profile, eta = found[0].profile, _within(ways)
    axes.plot(
        eta, [profile.tension.value(x) for x in eta], color=PALE, lw=5.5, label=f"profile: {profile.name}", zorder=1
    )
    band(axes, [way.insertion for way in ways], [way.tension for way in ways], "90 % of the readings")
    for k, way in enumerate(ways):
        axes.plot(*line(way.insertion, way.tension), **look(k, names))
    longest = ways[furthest(ways)]
    axes.plot(*line(longest.insertion, longest.target), **TARGET)
    if profile.name != "paper" and _is_papers(found[0]):
        axes.plot(eta, np.polyval(PAPER, eta), **PAPERS, label="the paper's polynomial")
    labelled(axes, "", "tension τ (N)")


def _within(ways: Sequence[Inserted]) -> np.ndarray:
    """Insertions that are shown: what lies beyond would set the scales."""
    return INSERTIONS[span_of(ways)[1] >= INSERTIONS]


def _planned(first: Followed, ways: Sequence[Inserted]) -> tuple[np.ndarray, np.ndarray]:
    """`planned_tip` as far as it is shown."""
    at, planned = planned_tip(first)
    shown = at <= span_of(ways)[1]
    return at[shown], planned[shown]


def _is_papers(found: Followed) -> bool:
    """Whether the paper's polynomial is of this robot and target."""
    return found.robot.name == "exonav-1" and abs(found.target - 0.7) < 1e-9


def _mark_largest(axes: Axes, way: Inserted, k: int) -> None:
    if np.isfinite(way.error).any():
        worst = int(np.nanargmax(np.abs(way.error)))
        axes.plot(way.insertion[worst], MM * way.error[worst], ls="", marker="o", ms=3.0, color=colour(k), zorder=4)


def _places(panels: Sequence[Axes], first: Followed, ways: Sequence[Inserted], names: Sequence[str]) -> None:
    """x, y and z of the tip: means of the frames, the reference below them, the model above."""
    eta, (at, planned) = _within(ways), _planned(first, ways)
    reference = MM * first.reference.at(eta * first.reference.s[-1])
    for i, axes in enumerate(panels):
        axes.plot(eta, reference[:, i], **REFERENCE, label="reference", zorder=1)
        for k, way in enumerate(ways):
            axes.plot(*line(way.tip_insertion, MM * way.tip[:, i]), **look(k, names))
        axes.plot(at, MM * planned[:, i], **PLANNED, label="model at the profile's tension", zorder=4)
        titled(axes, "abc"[i], f"{'xyz'[i]} of the tip (mm)")


def _departures(panels: Sequence[Axes], first: Followed, ways: Sequence[Inserted], names: Sequence[str]) -> None:
    """The same without the reference at the same insertion."""
    s, (at, planned) = first.reference.s[-1], _planned(first, ways)
    off = [MM * (way.tip - first.reference.at(way.tip_insertion * s)) for way in ways]
    model = MM * (planned - first.reference.at(at * s))
    for i, axes in enumerate(panels):
        band(axes, [way.tip_insertion for way in ways], [each[:, i] for each in off])
        for k, (way, each) in enumerate(zip(ways, off, strict=True)):
            axes.plot(*line(way.tip_insertion, each[:, i], FEW), **look(k, names, nested=False))
        axes.plot(at, model[:, i], **PLANNED, zorder=4)
        axes.axhline(0.0, color=QUIET, lw=0.6)
        axes.tick_params(labelleft=i == 0)
        axes.set_xlabel(_ETA)
        titled(axes, "def"[i], f"{'xyz'[i]} − reference (mm)")


def _distances(
    axes: Axes, first: Followed, ways: Sequence[Inserted], names: Sequence[str], marks: Sequence[float]
) -> None:
    """Root mean square distance by bin of insertion, of the trials and the plan."""
    for k, way in enumerate(ways):
        at, squares, *_ = binned(way.tip_insertion, way.tip_error[:, 0] ** 2, FEW)
        axes.plot(at, MM * np.sqrt(squares), **look(k, names, nested=False))
    at, planned = _planned(first, ways)
    axes.plot(at, MM * tip_errors(first, at, planned)[:, 0], **PLANNED)
    noise = ((first.record.header.get("setup") or {}).get("tracker") or {}).get("position_noise")
    if noise:
        level = MM * np.sqrt(2.0 / 3.0) * noise
        axes.axhline(level, **NOISE)
        place: Any = {"xycoords": axes.get_yaxis_transform(), "textcoords": "offset points", "va": "top"}
        axes.annotate("the tracker's noise alone", (0.07, level), (0.0, -6.0), size=7.0, color=QUIET, **place)
    _mark(axes, marks)
    labelled(axes, _ETA, "distance (mm)")
    titled(axes, "g", "tip from the reference, by projection: root mean square")


def _mark(axes: Axes, marks: Sequence[float]) -> None:
    """Others' distances as lines, or in words where they are far above all that is shown."""
    top = 1.12 * max(axes.get_ylim()[1], 0.1)
    if marks and MM * max(marks) < 2.0 * top:
        top = max(top, 1.12 * MM * max(marks))
        for mark in marks:
            axes.axhline(MM * mark, **PAPERS)
        axes.text(0.07, MM * max(marks), "the paper's three trials", size=7.0, color=QUIET, va="bottom")
    elif marks:
        text = f"↑ the paper's three trials: {MM * min(marks):.2f} to {MM * max(marks):.2f} mm"
        axes.text(0.5, 0.99, text, size=7.5, color=QUIET, va="top", ha="center", transform=axes.transAxes)
    axes.set_ylim(0.0, top)


def _over_time(
    panels: Sequence[Axes], found: Sequence[Followed], times: Sequence[np.ndarray], names: Sequence[str]
) -> None:
    tension, screw, translation = panels
    speeds = [MM * each.record.samples["translation"]["velocity"] for each in found]
    band(translation, times, speeds)
    for k, (each, time, speed) in enumerate(zip(found, times, speeds, strict=True)):
        samples = each.record.samples
        tension.plot(*line(time, samples["force"]["tension"]), **look(k, names))
        screw.plot(*line(time, MM * samples["screw"]["velocity"]), **look(k, names))
        translation.plot(*line(time, speed), **look(k, names))
        if each.outcome.fault is not None:
            label = f"{names[k]}: {each.outcome.fault.kind.value}"
            for axes in panels:
                at = each.outcome.fault.time - each.record.time[0]
                axes.axvline(at, color=colour(k), lw=0.8, ls=(0, (3, 2)), label=label)
    k = int(np.argmax([time[-1] for time in times]))
    target = np.where(is_running(found[k]), found[k].record.samples["command"]["target"], np.nan)
    tension.plot(*line(times[k], target), **TARGET)


def _periods(axes: Axes, found: Sequence[Followed], periods: Sequence[np.ndarray]) -> None:
    """How often a control period was how long, all trials beside each other."""
    every = MM * np.concatenate(periods)
    nominal = MM / float(found[0].record.header.get("rate", MM / np.median(every)))
    widest = 1.05 * max(np.abs(every - nominal).max(), 0.1 * nominal)
    edges = nominal + widest * np.arange(-30.5, 31.0) / 30.5  # the nominal period is in the middle of a bin
    axes.hist([MM * each for each in periods], bins=list(edges), color=[colour(k) for k in range(len(found))], log=True)
    axes.set_ylim(0.5, 4.0 * axes.get_ylim()[1])
    titled(axes, "d", "control periods while it ran")
    labelled(axes, "period (ms)", "how often")
