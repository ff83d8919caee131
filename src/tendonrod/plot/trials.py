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
_HEAD, _ROW, _GAP, _FOOT, _LINE = 0.5, 0.95, 0.3, 0.42, 0.16  # inches
FAR = 8.0  # standard deviations of the noise beside both neighbours, at which a frame is suspect
STEPS = 4.0  # usual steps from frame to frame that it must be away as well: a turning point is no error
_SUSPECT: dict[str, Any] = {"ls": "", "marker": "o", "ms": 6.5, "mfc": "none", "mec": INK, "mew": 0.8, "clip_on": False}


def trial_figure(trial: Trial) -> Figure:
    """Figure of a `Trial`: tensions or pulled lengths, insertion and rotation, then x, y, z of each tracker, over time.

    Positions are in the frame of the field. A sample that is not used has the mark of its fate; where it has no
    position the mark stands on the lower edge. Frames that are `suspect` are ringed; they are used all the same.
    """
    reasons = sorted(set(trial.fates.ravel().tolist()) - {KEPT})
    looks = {reason: (_MARKS[i % 6], _HUES[i % 6]) for i, reason in enumerate(reasons)}
    time = trial.time - np.nanmin(trial.time) if np.isfinite(trial.time).any() else trial.time
    doubtful = suspect(trial)
    with styled():
        head = _HEAD + _LINE * -(-(1 + len(reasons) + bool(doubtful.any())) // _COLUMNS)
        figure = new_figure(head + (1 + len(trial.trackers)) * (_ROW + _GAP) - _GAP + _FOOT)
        for axes, draw in zip(_row(figure, 0, head), (_drive, _insertion, _rotation), strict=True):
            draw(axes, trial, time)
        for j in range(len(trial.trackers)):
            row = _row(figure, 1 + j, head)
            _positions(row, trial, time, j, looks)
            _rings(row, trial, time, j, doubtful[:, j])
        _finish(figure, trial)
        _legend(figure, trial, looks, int(doubtful.sum()))
    return figure


def suspect(trial: Trial) -> np.ndarray:
    """(n, k) whether a kept frame stands alone: far outside the span of the kept frames before and after it.

    Far is more than `FAR` standard deviations of the noise, which is estimated from how frames scatter about the
    middle of their neighbours, and `STEPS` of the usual steps between frames. Only a hint for the eye.
    """
    found = np.zeros(trial.kept.shape, dtype=bool)
    for j in range(len(trial.trackers)):
        rows = np.flatnonzero(trial.kept[:, j])
        rows = rows[np.argsort(trial.time[rows], kind="stable")]
        found[rows, j] = _alone(trial.position[rows, j])
    return found


def _alone(points: np.ndarray) -> np.ndarray:
    """(n,) of points (n, 3) in the order of time; the first and the last have one neighbour and are never alone."""
    found = np.zeros(len(points), dtype=bool)
    if len(points) < 5:
        return found
    before, here, after = points[:-2], points[1:-1], points[2:]
    inside = np.clip(here, np.minimum(before, after), np.maximum(before, after))
    noise = 1.4826 * np.median(np.abs(here - 0.5 * (before + after))) / np.sqrt(1.5)
    step = np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))
    found[1:-1] = np.linalg.norm(here - inside, axis=1) > max(FAR * noise, STEPS * step)
    return found


def _row(figure: Figure, k: int, head: float) -> list[Axes]:
    """Three panels side by side in row ``k`` from the top, below ``head`` inches."""
    height = figure.get_figheight()
    bottom = 1.0 - (head + k * (_ROW + _GAP) + _ROW) / height
    return [figure.add_axes((0.075 + 0.328 * i, bottom, 0.255, _ROW / height)) for i in range(3)]


def _drive(axes: Axes, trial: Any, time: np.ndarray) -> None:
    pulled = np.isnan(trial.tensions).all()
    values = MM * trial.displacements if pulled else trial.tensions
    for i in range(values.shape[1]):
        axes.plot(time, values[:, i], ".-", color=COLOURS[i % 6], lw=0.8, ms=2.0, label=f"tendon {i + 1}")
    if values.shape[1] > 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.3 * (high - low))  # room for the names
        axes.legend(loc="upper left", ncols=2, handlelength=1.0, columnspacing=0.8, handletextpad=0.4)


def _insertion(axes: Axes, trial: Trial, time: np.ndarray) -> None:
    axes.plot(time, trial.insertion, ".-", color=INK, lw=0.8, ms=2.0)
    axes.set_ylim(-0.04, 1.04)


def _rotation(axes: Axes, trial: Trial, time: np.ndarray) -> None:
    axes.plot(time, np.degrees(trial.rotation), ".-", color=INK, lw=0.8, ms=2.0)


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


def _rings(row: list[Axes], trial: Trial, time: np.ndarray, j: int, doubtful: np.ndarray) -> None:
    for i, axes in enumerate(row):
        axes.plot(time[doubtful], MM * trial.position[doubtful, j, i], **_SUSPECT)


def _finish(figure: Figure, trial: Trial) -> None:
    """Over each panel what it shows and its unit; all share the times, whose numbers stand below the last row."""
    drive = "pulled (mm)" if np.isnan(trial.tensions).all() else "tension (N)"
    titles = [drive, "insertion η", "rotation (deg)"]
    titles += [f"{each.name}: {axis} (mm)" for each in trial.trackers for axis in _AXES]
    low, high = (min(each) for each in zip(*(axes.get_xlim() for axes in figure.axes), strict=True))
    high = max(axes.get_xlim()[1] for axes in figure.axes)
    for k, (axes, title) in enumerate(zip(figure.axes, titles, strict=True)):
        titled(axes, chr(ord("a") + k % 26), title)
        axes.set_xlim(low, high)
        if k < len(titles) - 3:
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time from the first sample (s)")


def _legend(figure: Figure, trial: Trial, looks: dict[str, tuple[str, str]], doubtful: int) -> None:
    from matplotlib.lines import Line2D

    counts = {reason: int((trial.fates == reason).sum()) for reason in (KEPT, *looks)}
    handles = [Line2D([], [], ls="", marker=".", color=BLUE, label=f"kept ({counts[KEPT]})")]
    for reason, (mark, hue) in looks.items():
        label = f"{reason} ({counts[reason]})"
        handles.append(Line2D([], [], ls="", marker=mark, color=hue, mfc="none", ms=4.5, label=label))
    if doubtful:
        handles.append(Line2D([], [], label=f"kept, but far from its neighbours ({doubtful})", **_SUSPECT))
    size = f"{trial.time.size} sample{'s' * (trial.time.size != 1)}"
    title = f"{trial.name}: {trial.robot.name}, {size}; positions in the frame of the field"
    figure.text(0.01, 1.0 - 0.06 / figure.get_figheight(), title, weight="bold", size=8.5, va="top")
    place = (0.0, 1.0 - 0.2 / figure.get_figheight())
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=place, ncols=_COLUMNS, columnspacing=1.0,
                  handletextpad=0.2, labelspacing=0.25)  # fmt: skip
