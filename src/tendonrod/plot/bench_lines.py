"""What figures of bench trials are made of: thousands of readings as a band and a line, and what the model says."""

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
from .style import COLOURS, INK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS, READINGS = 240, 20  # of a line at most, in each of them at least
PLANNED_AT, BODIES, APART, COLUMNS = 60, 6, 0.12, 6
SMOOTHED = 1.0  # s: over which readings are averaged before a body is drawn from them
REFERENCE: Any = {"color": PALE, "lw": 4.5, "solid_capstyle": "round"}
PLANNED: Any = {"color": INK, "lw": 0.9, "ls": (0, (4, 1.6))}
DOTS: Any = {"ls": "", "marker": ".", "ms": 1.6, "mew": 0.0, "alpha": 0.22, "rasterized": True, "zorder": 2}
BODY: Any = {"lw": 1.2}


def colour(k: int) -> str:
    """Of trial k."""
    return COLOURS[k % len(COLOURS)]


def binned(x: np.ndarray, y: np.ndarray, bins: int = BINS) -> tuple[np.ndarray, ...]:
    """x (k,), mean, least and largest y (k,) of evenly spread bins of ``x``; what is not finite is left out."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if x.size == 0:
        return (np.empty(0),) * 4
    bins = max(1, min(bins, x.size // READINGS))
    edges = np.linspace(x.min(), x.max(), bins + 1)
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    order = np.argsort(which, kind="stable")
    starts = np.flatnonzero(np.diff(which[order], prepend=-1))
    counts = np.diff(starts, append=x.size)
    x, y = x[order], y[order]
    means = [np.add.reduceat(each, starts) / counts for each in (x, y)]
    return *means, np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)


def line(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of bins."""
    return binned(x, y)[:2]  # pyright: ignore[reportReturnType]


def spread(axes: Axes, x: np.ndarray, y: np.ndarray, k: int, name: str | None = None) -> None:
    """Trial k: a line of means over a band from the least to the largest reading."""
    at, mean, low, high = binned(x, y)
    axes.fill_between(at, low, high, color=colour(k), alpha=0.16, lw=0.0, zorder=2)
    axes.plot(at, mean, color=colour(k), lw=0.9, label=name, zorder=3)


def head_room(count: int) -> float:
    """Inches above the panels for a legend of ``count`` names and a title."""
    return 0.28 + 0.165 * -(-count // COLUMNS)


def legend_above(figure: Figure, axes: Axes) -> None:
    """One legend along the upper edge, of what ``axes`` shows."""
    handles, names = axes.get_legend_handles_labels()
    place: Any = {"loc": "upper left", "bbox_to_anchor": (0.01, 1.0), "ncols": min(COLUMNS, len(names))}
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
