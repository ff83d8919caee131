"""Figures of the errors of a `Fit`: measured sensors and the model before and after, and what is left over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..measurement.errorvectors import VARIES
from ..measurement.identification import Fit
from .accuracy import faint, many
from .style import BLUE, COLOURS, INK, MM, PALE, QUIET, VERMILION, labelled, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PLACES = 4
LEAST_SPAN = 1.0  # mm, of an axis of coordinates: less is noise
BEFORE: dict[str, Any] = {"color": VERMILION, "ls": (0, (3.5, 1.5)), "lw": 1.2}
AFTER: dict[str, Any] = {"color": BLUE, "ls": "-", "lw": 1.2}
_LOST: dict[str, Any] = {"ls": "", "marker": "x", "ms": 3.5, "mec": INK, "mew": 0.9, "clip_on": False}


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackedPlace:
    """The poses ``rows`` of a fit at one share of the robot's length."""

    share: float
    rows: np.ndarray

    @property
    def told(self) -> str:
        """Such as s = 0.25 L_na."""
        return f"s = {self.share:.3g} $L_{{na}}$"


def tracked_places(fit: Fit) -> tuple[TrackedPlace, ...]:
    """The tracked places, from the base to the tip."""
    shares = [fit.trials[i].places[j] / fit.trials[i].robot.length_na for i, _, j in fit.where]
    rounded = np.round(shares, 4)
    return tuple(TrackedPlace(share=float(x), rows=np.flatnonzero(rounded == x)) for x in np.unique(rounded))


def prediction_figure(fit: Fit) -> Figure:
    """x, y and z of the sensors at each place against what drives the tendon: measured, modelled before and after."""
    found = tracked_places(fit)
    shown = [
        found[k] for k in np.unique(np.linspace(0, len(found) - 1, min(len(found), MOST_PLACES)).round().astype(int))
    ]
    measured, before = _measured(fit), _before(fit)
    values, label = _drive(fit)
    with styled():
        figure = new_figure(5.0)
        grid: Any = figure.subplots(3, len(shown), sharex=True, squeeze=False)
        figure.subplots_adjust(0.075, 0.085, 0.985, 0.895, 0.34, 0.16)
        for column, place in enumerate(shown):
            for row, axes in enumerate(grid[:, column]):
                paths = [each[:, row] for each in (measured, before, measured - fit.errors)]
                _component(axes, fit, place, values, paths)
            titled(grid[0, column], "abcd"[column], place.told)
            grid[-1, column].set_xlabel(label)
        for axes, name in zip(grid[:, 0], "xyz", strict=True):
            axes.set_ylabel(f"{name} (mm)")
        handles = [*_dots(fit), line("model before", BEFORE), line("model, fitted", AFTER)]
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.06, 1.0), ncols=4)
    return figure


def residual_figure(fit: Fit) -> Figure:
    """Errors of the fit: whitened ones against the normal distribution, and each component against the drive."""
    found = tracked_places(fit)
    with styled():
        figure = new_figure(3.7)
        _normal(figure.add_axes((0.075, 0.12, 0.36, 0.70)), fit, found)
        values, label = _drive(fit)
        for k, name in enumerate("xyz"):
            axes = figure.add_axes((0.535, 0.12 + 0.245 * (2 - k), 0.45, 0.21))
            _error_component(axes, fit, found, values, k)
            labelled(axes, label if k == 2 else "", f"{name} (mm)")
            if k == 0:
                titled(axes, "b", "measured − fitted, by axis")
            if k < 2:
                axes.tick_params(labelbottom=False)
        handles = [marker(each.told, colour) for each, colour in zip(found, _colours(found), strict=True)]
        handles += [_cross()] if not fit.used.all() else []
        figure.legend(handles=handles[:8], loc="upper left", bbox_to_anchor=(0.06, 1.0), ncols=5, columnspacing=1.2)
    return figure


def _measured(fit: Fit) -> np.ndarray:
    """(N, 3) measured sensors, world, m."""
    return fit.problem.misfit.position


def _before(fit: Fit) -> np.ndarray:
    """(N, 3) sensors as the model had them with the numbers before."""
    found = fit.problem.predictor(fit.before)
    return _measured(fit) - fit.problem.misfit.errors(found)[:, :3]


def _drive(fit: Fit) -> tuple[np.ndarray, str]:
    """(N,) what poses are drawn against, and its name.

    Insertion where it varies, else tension, pulled length, or their number in the trial.
    """
    rows = [(fit.trials[i], row) for i, row, _ in fit.where]
    insertion = np.array([each.insertion[row] for each, row in rows])
    if np.ptp(insertion) > VARIES:
        return 100.0 * insertion, "insertion (%)"
    if all(each.robot.n_tendons == 1 for each in fit.trials):
        tension = np.array([each.tensions[row, 0] for each, row in rows])
        if np.isfinite(tension).all():
            return tension, "tension τ (N)"
        pulled = np.array([each.displacements[row, 0] for each, row in rows])
        if np.isfinite(pulled).all():
            return MM * pulled, "displacement (mm)"
    return fit.where[:, 1] + 1.0, "sample"


def _component(axes: Axes, fit: Fit, place: TrackedPlace, values: np.ndarray, paths: Sequence[np.ndarray]) -> None:
    """One coordinate of a place; paths: (N,) measured, before, after, m."""
    measured, before, after = paths
    used = fit.used[place.rows]
    kept, lost = place.rows[used], place.rows[~used]
    axes.plot(values[kept], MM * measured[kept], ls="", marker="o", ms=2.4, mfc=PALE, mec=QUIET, mew=0.4, **_many(fit))
    for i in np.unique(fit.where[place.rows, 0]):
        rows = place.rows[fit.where[place.rows, 0] == i]
        rubs = fit.setup.robot_of(fit.trials[i]).friction.any()
        rows = rows if rubs else rows[np.argsort(values[rows], kind="stable")]
        axes.plot(values[rows], MM * before[rows], **BEFORE, **_many(fit))
        axes.plot(values[rows], MM * after[rows], **AFTER, **_many(fit))
    low, high = axes.get_ylim()
    if high - low < LEAST_SPAN:
        low, high = 0.5 * (low + high - LEAST_SPAN), 0.5 * (low + high + LEAST_SPAN)
    axes.plot(values[lost], np.clip(MM * measured[lost], low, high), **_LOST)
    axes.set_ylim(low, high)


def _dots(fit: Fit) -> list[Any]:
    from matplotlib.lines import Line2D

    measured = Line2D([], [], ls="", marker="o", ms=3.5, mfc=PALE, mec=QUIET, mew=0.4, label="measured")
    return [measured, *([_cross()] if not fit.used.all() else [])]


def _cross() -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], label="does not count", **_LOST)


def _normal(axes: Axes, fit: Fit, found: Sequence[TrackedPlace]) -> None:
    """Sorted whitened errors of the poses that count against what normal noise of the stated size would give."""
    from scipy.stats import norm

    misfit, (sigma, G) = fit.problem.misfit, fit.noise
    e = misfit.errors(fit.problem.predictor(fit.setup))
    white = misfit.whitened(e[..., None], sigma, G, np.ones(len(e))).reshape(len(e), -1)[:, :3]
    owner = np.zeros(len(e), dtype=int)
    for k, each in enumerate(found):
        owner[each.rows] = k
    flat, which = white[fit.used].ravel(), np.repeat(owner[fit.used], 3)
    order = np.argsort(flat)
    expected = norm.ppf((np.arange(flat.size) + 0.5) / flat.size)
    said = "as stated" if any(each.position_noise for each in fit.trials) else "as estimated"
    axes.plot(expected, expected, color=QUIET, lw=1.0, label=f"noise {said}")
    axes.plot(expected, fit.scale * expected, color=INK, lw=0.9, ls=(0, (1, 1.2)), label=f"{fit.scale:.2f} times it")
    colours = np.array(_colours(found))[which[order]]
    axes.scatter(expected, flat[order], s=5.0, c=colours.tolist(), lw=0.0, **_many(fit))
    labelled(axes, "of the normal distribution", "error / noise")
    titled(axes, "a", "errors against normal noise")
    axes.legend(loc="upper left")


def _error_component(axes: Axes, fit: Fit, found: Sequence[TrackedPlace], values: np.ndarray, k: int) -> None:
    errors = MM * fit.errors[:, k]
    bound = 1.15 * float(np.abs(errors[fit.used]).max(initial=1e-6))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    for each, colour in zip(found, _colours(found), strict=True):
        kept = each.rows[fit.used[each.rows]]
        dots: dict[str, Any] = {"ls": "", "marker": ".", "ms": 3.5, "color": colour}
        axes.plot(values[kept], errors[kept], **dots | faint(len(fit.where)))
    lost = ~fit.used
    axes.plot(values[lost], np.clip(errors[lost], -bound, bound), **_LOST)
    axes.set_ylim(-bound, bound)


def _many(fit: Fit) -> dict[str, Any]:
    return many(len(fit.where))


def _colours(found: Sequence[TrackedPlace]) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(len(found))]


def line(label: str, style: dict[str, Any]) -> Any:
    """A line for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **style)


def marker(label: str, colour: str, **style: Any) -> Any:
    """A dot for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], ls="", marker="o", ms=4.0, color=colour, label=label, **style)
