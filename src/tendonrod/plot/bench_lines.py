"""What figures of bench trials are made of: thousands of readings as a band and lines, and what the model says.

Trials that agree lie on top of each other. So the first is drawn widest and the last narrowest, which leaves all of
them to be seen; the scatter of their readings is one grey band; and there are panels with what is left when the
reference or the target is taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..measurement.posture import posture
from ..measurement.registration import registered
from ..rig.inserted import Inserted
from ..rig.states import State
from ..rig.trials import Followed
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from .style import BLUE, COLOURS, INK, PALE, QUIET

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS, READINGS = 240, 20  # of a line at most, in each of them at least
MOST = 0.9  # of the readings are in a band
PLANNED_AT, BODIES, APART, COLUMNS = 60, 6, 0.15, 6
NARROW, NESTED = 0.9, 4  # points, a line's width; so many trials are told apart by width
SMOOTHED = 1.0  # s: over which readings are averaged before a body is drawn from them
REFERENCE: Any = {"color": PALE, "lw": 5.5, "solid_capstyle": "round"}
PLANNED: Any = {"color": INK, "lw": 0.9, "ls": (0, (4, 1.6))}
DOTS: Any = {"ls": "", "marker": ".", "ms": 1.6, "mew": 0.0, "alpha": 0.16, "rasterized": True, "color": QUIET}
NOT_YET = "#eef1f5"


def look(k: int, names: Sequence[str], nested: bool = True) -> dict[str, Any]:
    """How the line of trial k of ``names`` is drawn; its label is None where the legend would hold too many.

    nested: the first widest, so that lines on top of each other are all seen; else all narrow.
    """
    count = len(names)
    if count > COLUMNS:
        label = None if k else f"{names[0]} to {names[-1]}"
        return {"color": BLUE, "lw": 0.6, "alpha": max(0.15, 3.0 / count), "zorder": 3, "label": label}
    width = NARROW * (max(1, min(count, NESTED) - k) if nested else 1)
    return {"color": colour(k), "lw": width, "zorder": 3 + 0.01 * k, "label": names[k]}


def colour(k: int) -> str:
    """Of trial k."""
    return COLOURS[k % len(COLOURS)]


def binned(x: np.ndarray, y: np.ndarray, bins: int = BINS, share: float = 1.0) -> tuple[np.ndarray, ...]:
    """x (k,), mean, lower and upper end of y (k,) in evenly spread bins of ``x``; what is not finite is left out.

    share: of a bin's readings that are between the ends, as many above as below; 1 for all of them.
    """
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if x.size == 0:
        return (np.empty(0),) * 4
    bins = max(1, min(bins, x.size // READINGS))
    edges = np.linspace(x.min(), x.max(), bins + 1)
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    order = np.argsort(which, kind="stable")
    starts = np.flatnonzero(np.diff(which[order], prepend=-1))
    parts = [np.split(each[order], starts[1:]) for each in (x, y)]
    means = [np.array([part.mean() for part in each]) for each in parts]
    ends = (0.5 - 0.5 * share, 0.5 + 0.5 * share)
    return *means, *np.transpose([np.quantile(part, ends) for part in parts[1]])


def line(x: np.ndarray, y: np.ndarray, bins: int = BINS) -> tuple[np.ndarray, np.ndarray]:
    """Means of bins."""
    return binned(x, y, bins)[:2]  # pyright: ignore[reportReturnType]


def band(axes: Axes, x: Sequence[np.ndarray], y: Sequence[np.ndarray], label: str | None = None) -> None:
    """One grey band that holds `MOST` of the readings of all trials nearby."""
    at, _, low, high = binned(np.concatenate(x), np.concatenate(y), BINS // 3, MOST)
    axes.fill_between(at, low, high, color=PALE, alpha=0.6, lw=0.0, zorder=1.5, label=label)


def not_yet(axes: Axes, ways: Sequence[Inserted], label: bool = False) -> None:
    """The insertions from which no trial set out, shaded."""
    start = min((float(each.insertion.min()) for each in ways if each.insertion.size), default=0.0)
    if start > 0.01:
        name = f"η < {start:.2f}: before the start" if label else None
        axes.axvspan(-1.0, start, color=NOT_YET, lw=0.0, zorder=0.2, label=name)


def span_of(ways: Sequence[Inserted]) -> tuple[float, float]:
    """Limits of an axis of insertions: up to 1, or some way beyond where the last trial ended."""
    reached = max((float(each.insertion.max()) for each in ways if each.insertion.size), default=1.0)
    return -0.012, min(1.012, 1.3 * reached)


def named(names: Sequence[str]) -> int:
    """How many entries of a legend `look` gives the trials."""
    return len(names) if len(names) <= COLUMNS else 1


def head_room(count: int, columns: int = COLUMNS) -> float:
    """Inches above the panels for a legend of ``count`` names and a title."""
    return 0.28 + 0.165 * -(-count // columns)


def legend_above(figure: Figure, axes: Axes, columns: int = COLUMNS) -> None:
    """One legend along the upper edge, of what ``axes`` shows."""
    handles, names = axes.get_legend_handles_labels()
    place: Any = {"loc": "upper left", "bbox_to_anchor": (0.01, 1.0), "ncols": min(columns, len(names))}
    figure.legend(handles, names, **place, columnspacing=1.2, borderaxespad=0.1, labelspacing=0.25)


def is_running(found: Followed) -> np.ndarray:
    """(n,) whether a sample was taken while the task ran."""
    return found.record.states == State.RUNNING


def furthest(ways: Sequence[Inserted]) -> int:
    """The first of the trials that came out furthest, to a percent; those with poses of the tip go before."""
    reached = [(len(each.tip) > 0, round(float(each.insertion.max(initial=0.0)), 2)) for each in ways]
    return reached.index(max(reached))


def planned_tip(found: Followed) -> tuple[np.ndarray, np.ndarray]:
    """insertion (k,), tube axis at the tip (k, 3) m: the model along the trial's profile, nothing of a bench in it."""
    at = np.linspace(1.0 / PLANNED_AT, 1.0, PLANNED_AT)
    profile = found.profile
    shapes = [
        solve(found.robot, profile.tension.value(x), found.gravity, insertion=x, rotation=profile.rotation.value(x))
        for x in at.tolist()
    ]
    return at, np.array([shape.centerline[-1] for shape in shapes])


def tip_errors(found: Followed, insertion: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """(k, 2) distances (m) of ``tip`` (k, 3) from the reference: by projection, and from its point at ``insertion``."""
    there = found.reference.at(insertion * found.reference.s[-1])
    return np.stack([found.reference.project(tip).distance, np.linalg.norm(tip - there, axis=1)], axis=1)


def postures(found: Followed, way: Inserted) -> list[tuple[float, Shape]]:
    """(insertion, shape) as the model has it at the readings around frames that are evenly spread over the way.

    Tensions are averaged over `SMOOTHED` seconds: the robot is so soft that the load cell's noise alone would show.
    """
    if not len(way.tip_insertion):
        return []
    (trial,) = registered([found.trial()])
    on_it = (trial.time >= way.time[0]) & (trial.time <= way.time[-1])
    usable = np.flatnonzero(trial.kept[:, 0] & on_it)
    low, high = way.tip_insertion.min(), way.tip_insertion.max()
    wanted = np.linspace(low, high, 1 + min(BODIES, max(1, int((high - low) / APART))))[1:]
    rows = sorted({int(usable[np.argmin(np.abs(trial.insertion[usable] - x))]) for x in wanted})
    calm = replace(trial, tensions=_averaged(np.where(on_it[:, None], trial.tensions, np.nan), trial.time))
    return [(float(trial.insertion[k]), posture(calm, k)) for k in rows]


def _averaged(values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Mean of the finite ``values`` (n, k) within `SMOOTHED` seconds; ``time`` (n,) increases."""
    known = np.isfinite(values)
    sums = np.cumsum(np.where(known, values, 0.0), axis=0)
    counts = np.cumsum(known, axis=0)
    before = np.searchsorted(time, time - 0.5 * SMOOTHED)
    after = np.searchsorted(time, time + 0.5 * SMOOTHED, side="right") - 1
    sums, counts = (np.concatenate([np.zeros_like(each[:1]), each]) for each in (sums, counts))
    with np.errstate(invalid="ignore"):
        return np.where(known, (sums[after + 1] - sums[before]) / (counts[after + 1] - counts[before]), np.nan)
