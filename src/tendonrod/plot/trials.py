"""`trial_figure`: what a trial measured over time, samples that are not used marked by the reason."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..measurement.trial import KEPT, Trial
from .style import (
    BLUE,
    COLOURS,
    INK,
    MM,
    ORANGE,
    PALE,
    PURPLE,
    QUIET,
    SKY,
    VERMILION,
    labelled,
    new_figure,
    styled,
    titled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKS = ("x", "+", "v", "s", "D", "|")
_HUES = (VERMILION, PURPLE, ORANGE, SKY, QUIET, INK)
_AXES = ("x", "y", "z")
_COLUMNS = 3  # of the legend
_HEAD, _ROW, _GAP, _FOOT, _LINE = 0.42, 0.95, 0.3, 0.42, 0.16  # inches


def trial_figure(trial: Trial) -> Figure:
    """Figure of a `Trial`: tensions or pulled lengths, insertion and rotation, then x, y, z of each tracker, over time.

    Positions are in the frame of the field. A sample that is not used has the mark of its fate; where it has no
    position the mark stands on the lower edge.
    """
    reasons = sorted(set(trial.fates.ravel().tolist()) - {KEPT})
    looks = {reason: (_MARKS[i % 6], _HUES[i % 6]) for i, reason in enumerate(reasons)}
    time = trial.time - np.nanmin(trial.time) if np.isfinite(trial.time).any() else trial.time
    with styled():
        head = _HEAD + _LINE * -(-(1 + len(reasons)) // _COLUMNS)
        figure = new_figure(head + (1 + len(trial.trackers)) * (_ROW + _GAP) - _GAP + _FOOT)
        for axes, draw in zip(_row(figure, 0, head), (_drive, _insertion, _rotation), strict=True):
            draw(axes, trial, time)
        for j in range(len(trial.trackers)):
            _positions(_row(figure, 1 + j, head), trial, time, j, looks)
        _finish(figure, trial)
        _legend(figure, trial, looks)
    return figure


def _row(figure: Figure, k: int, head: float) -> list[Axes]:
    """Three panels side by side in row ``k`` from the top, below ``head`` inches."""
    height = figure.get_figheight()
    bottom = 1.0 - (head + k * (_ROW + _GAP) + _ROW) / height
    return [figure.add_axes((0.085 + 0.325 * i, bottom, 0.25, _ROW / height)) for i in range(3)]


def _drive(axes: Axes, trial: Any, time: np.ndarray) -> None:
    pulled = np.isnan(trial.tensions).all()
    values, unit = (MM * trial.displacements, "pulled (mm)") if pulled else (trial.tensions, "tension (N)")
    for i in range(values.shape[1]):
        axes.plot(time, values[:, i], ".-", color=COLOURS[i % 6], lw=0.8, ms=2.0, label=f"tendon {i + 1}")
    if values.shape[1] > 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.3 * (high - low))  # room for the names
        axes.legend(loc="upper left", ncols=2, handlelength=1.0, columnspacing=0.8, handletextpad=0.4)
    labelled(axes, "", unit)


def _insertion(axes: Axes, trial: Trial, time: np.ndarray) -> None:
    axes.plot(time, trial.insertion, ".-", color=INK, lw=0.8, ms=2.0)
    axes.set_ylim(-0.04, 1.04)
    labelled(axes, "", "insertion η (-)")


def _rotation(axes: Axes, trial: Trial, time: np.ndarray) -> None:
    axes.plot(time, np.degrees(trial.rotation), ".-", color=INK, lw=0.8, ms=2.0)
    labelled(axes, "", "rotation (deg)")


def _positions(row: list[Axes], trial: Trial, time: np.ndarray, j: int, looks: dict[str, tuple[str, str]]) -> None:
    kept = trial.kept[:, j]
    for i, axes in enumerate(row):
        along = MM * trial.position[:, j, i]
        axes.plot(time, along, color=PALE, lw=0.7)
        axes.plot(time[kept], along[kept], ".", color=BLUE, ms=3.0)
        for reason, (mark, hue) in looks.items():
            here = trial.fates[:, j] == reason
            shown, gone = here & np.isfinite(along), here & np.isnan(along)
            axes.plot(time[shown], along[shown], mark, color=hue, ms=4.0, mfc="none", mew=0.9)
            edge = axes.get_xaxis_transform()
            axes.plot(time[gone], np.full(gone.sum(), 0.03), mark, color=hue, ms=4.0, mew=0.9, transform=edge)
        labelled(axes, "", f"{_AXES[i]} (mm)")


def _finish(figure: Figure, trial: Trial) -> None:
    """A title over each panel; all share the times, whose numbers stand below the last row."""
    titles = ["drive", "insertion", "rotation"]
    titles += [f"{each.name}: {axis}" for each in trial.trackers for axis in _AXES]
    low, high = (min(each) for each in zip(*(axes.get_xlim() for axes in figure.axes), strict=True))
    high = max(axes.get_xlim()[1] for axes in figure.axes)
    for k, (axes, title) in enumerate(zip(figure.axes, titles, strict=True)):
        titled(axes, chr(ord("a") + k % 26), title)
        axes.set_xlim(low, high)
        if k < len(titles) - 3:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time from the first sample (s)")


def _legend(figure: Figure, trial: Trial, looks: dict[str, tuple[str, str]]) -> None:
    from matplotlib.lines import Line2D

    counts = {reason: int((trial.fates == reason).sum()) for reason in (KEPT, *looks)}
    handles = [Line2D([], [], ls="", marker=".", color=BLUE, label=f"kept ({counts[KEPT]})")]
    for reason, (mark, hue) in looks.items():
        label = f"{reason} ({counts[reason]})"
        handles.append(Line2D([], [], ls="", marker=mark, color=hue, mfc="none", ms=4.5, label=label))
    size = f"{trial.time.size} sample{'s' * (trial.time.size != 1)}"
    title = f"{trial.name}: {trial.robot.name}, {size}; positions in the frame of the field"
    figure.text(0.01, 1.0 - 0.06 / figure.get_figheight(), title, weight="bold", size=8.5, va="top")
    place = (0.0, 1.0 - 0.2 / figure.get_figheight())
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=place, ncols=_COLUMNS, columnspacing=1.0,
                  handletextpad=0.2, labelspacing=0.25)  # fmt: skip
