"""`task_figure`: what a bench did in one task that is no follow-the-leader trial, over time, as its record says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..rig.record import Record
from ..rig.staged import Phase
from ..rig.states import State
from ..rig.trials import Performed
from .style import BLUE, INK, MM, QUIET, VERMILION, labelled, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TARGET: Any = {"color": INK, "lw": 1.0, "ls": (0, (1, 2.0)), "label": "target"}
LIMIT: Any = {"color": QUIET, "lw": 0.8, "ls": (0, (5, 2)), "label": "soft limit"}
FAULT: Any = {"color": VERMILION, "lw": 0.9, "ls": (0, (3, 2))}
BETWEEN: Any = {"color": QUIET, "lw": 0.6}
HEADROOM = 0.14  # of the tension's panel, for the names of the phases
STILL = 5.0  # deg: an angle that changes by less is shown as standing still
LETTER = 0.0075  # share of the panel's width that a letter of a phase's name takes


def task_figure(done: Performed) -> Figure:
    """Tension with its target; insertion and screw; rotation, over time, with the task's phases and its faults."""
    record = done.record
    time = record.time - record.time[0] if len(record.time) else record.time
    with styled():
        figure = new_figure(5.2)
        figure.subplots_adjust(left=0.09, right=0.985, top=0.93, bottom=0.085, hspace=0.42)
        panels: Any = figure.subplots(3, 1, sharex=True, height_ratios=(1.4, 1.0, 0.8))
        _tension(panels[0], record, time)
        _lengths(panels[1], record, time)
        _rotation(panels[2], record, time)
        for axes, letter, title, unit in zip(panels, "abc", _TITLES, _UNITS, strict=True):
            titled(axes, letter, title)
            labelled(axes, "time from the start of the record (s)" if axes is panels[2] else "", unit)
            _events(axes, record)
            axes.set_xlim(0.0, max(time[-1:], default=1.0))
        _phases(panels[0], record)
        for axes in panels[:2]:
            handles, names = axes.get_legend_handles_labels()
            axes.legend(handles, names, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, borderaxespad=0.1)
    return figure


_TITLES = ("tension", "insertion and lead screw", "rotation of the motor")
_UNITS = ("tension τ (N)", "position (mm)", "rotation (deg)")


def _tension(axes: Axes, record: Record, time: np.ndarray) -> None:
    running = record.states == State.RUNNING
    target = np.where(running, record.samples["command"]["target"], np.nan)
    axes.plot(time, record.samples["force"]["tension"], color=BLUE, lw=0.6, alpha=0.75, label="load cell")
    axes.plot(time, target, **TARGET)
    limits = record.header.get("limits") or {}
    top = limits.get("soft", np.nan) * limits.get("tension", np.nan)
    if axes.get_ylim()[1] > 0.5 * top:
        axes.axhline(top, **LIMIT)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + HEADROOM * (high - low))


def _lengths(axes: Axes, record: Record, time: np.ndarray) -> None:
    for name, label, colour in (("translation", "robot pushed out", BLUE), ("screw", "tendon paid out", VERMILION)):
        axes.plot(time, MM * record.samples[name]["position"], color=colour, lw=1.0, label=label)


def _rotation(axes: Axes, record: Record, time: np.ndarray) -> None:
    angle = np.degrees(record.samples["rotation"]["position"])
    axes.plot(time, angle, color=BLUE, lw=1.0)
    if len(angle) and np.ptp(angle) < STILL:
        middle = float(np.mean(angle))
        axes.set_ylim(middle - STILL, middle + STILL)


def _events(axes: Axes, record: Record) -> None:
    """Where one phase ends and the next begins, and where there was a fault."""
    start = record.time[0] if len(record.time) else 0.0
    for at, _ in _changes(record)[1:]:
        axes.axvline(at - start, **BETWEEN, zorder=0)
    for k, fault in enumerate(record.faults):
        axes.axvline(fault.time - start, **FAULT, label=None if k else fault.kind.value)


def _phases(axes: Axes, record: Record) -> None:
    """The names of those that last, above the panel."""
    changes = _changes(record)
    if not changes:
        return
    start, last = record.time[0], record.time[-1]
    ends = [*(at for at, _ in changes[1:]), last]
    for (at, name), end in zip(changes, ends, strict=True):
        if name != Phase.DONE and end - at >= LETTER * len(name) * (last - start):
            axes.annotate(
                name, (0.5 * (at + end) - start, 1.0), (0.0, -2.0), xycoords=axes.get_xaxis_transform(),
                textcoords="offset points", ha="center", va="top", size=6.5, color=QUIET,
            )  # fmt: skip


def _changes(record: Record) -> list[tuple[float, str]]:
    """(time s, phase) of each beginning; after the last, or a fault, the tendon is let go."""
    return [(each.time, each.text) for each in record.messages if each.text in set(Phase)]
