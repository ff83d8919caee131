"""Figures of a `Fit`: profiles, correlations, measured and modelled sensors, residuals, held-out errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..measurement.crossvalidation import CrossValidation
from ..measurement.identification import Fit
from ..measurement.profiles import Profile
from ..measurement.rounding import with_error
from .style import BLUE, COLOURS, INK, MM, PALE, QUIET, SKY, VERMILION, labelled, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ACROSS = 3  # profiles beside each other
MOST_PLACES = 4
LEAST_SPAN = 1.0  # mm, of an axis of coordinates: less is noise
BEFORE: dict[str, Any] = {"color": VERMILION, "ls": (0, (3.5, 1.5)), "lw": 1.2}
AFTER: dict[str, Any] = {"color": BLUE, "ls": "-", "lw": 1.2}


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


def profile_figure(fit: Fit, profiles: Sequence[Profile]) -> Figure:
    """For each number the rise of the squares where it is held elsewhere, beside the fit's own parabola."""
    down = -(-len(profiles) // ACROSS)
    height = 1.75 * down + 0.75
    with styled():
        figure = new_figure(height)
        grid: Any = figure.subplots(down, ACROSS, squeeze=False).ravel()
        figure.subplots_adjust(0.075, 0.45 / height, 0.985, 1.0 - 0.55 / height, 0.24, 0.72)
        for axes, each in zip(grid, profiles, strict=False):
            _profile(axes, fit, each)
        for axes in grid[len(profiles) :]:
            axes.set_visible(False)
        for axes in grid[::ACROSS]:
            axes.set_ylabel("rise of squares")
        figure.legend(handles=_profile_legend(), loc="upper left", bbox_to_anchor=(0.06, 1.0), ncols=4)
    return figure


def correlation_figure(fit: Fit) -> Figure:
    """The correlation matrix of the identified numbers."""
    m = len(fit.names)
    height = 1.0 + 0.42 * m
    with styled():
        figure = new_figure(height)
        width = min(0.62, 0.12 + 0.085 * m)
        axes: Any = figure.add_axes((0.2, 0.14 + 0.3 / height, width, 0.80 - 0.3 / height))
        image = axes.imshow(fit.correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0, aspect="auto")
        for i, j in np.ndindex(m, m):
            rho = fit.correlation[i, j]
            axes.text(j, i, _minus(f"{rho:.2f}"), ha="center", va="center", color="white" if abs(rho) > 0.6 else INK)
        axes.set_xticks(range(m), fit.names, rotation=25.0, ha="right", rotation_mode="anchor")
        axes.set_yticks(range(m), fit.names)
        axes.tick_params(length=0.0)
        axes.grid(False)
        for side in axes.spines.values():
            side.set_visible(False)
        beside = figure.add_axes((0.2 + width + 0.03, 0.14 + 0.3 / height, 0.018, 0.80 - 0.3 / height))
        figure.colorbar(image, beside, ticks=[-1.0, -0.5, 0.0, 0.5, 1.0]).outline.set_visible(False)  # pyright: ignore
        beside.set_ylabel("correlation")
    return figure


def prediction_figure(fit: Fit) -> Figure:
    """x, y and z of the sensors at each place against what drives the tendon: measured, modelled before and after."""
    found = tracked_places(fit)
    shown = [found[k] for k in np.unique(np.linspace(0, len(found) - 1, min(len(found), MOST_PLACES)).round().astype(int))]
    measured, before = _measured(fit), _before(fit)
    values, label = _drive(fit)
    with styled():
        figure = new_figure(5.0)
        grid: Any = figure.subplots(3, len(shown), sharex=True, squeeze=False)
        figure.subplots_adjust(0.075, 0.085, 0.985, 0.895, 0.34, 0.16)
        for column, place in enumerate(shown):
            for row, axes in enumerate(grid[:, column]):
                paths = (each[:, row] for each in (measured, before, measured - fit.errors))
                _component(axes, fit, place, values, *paths)
            titled(grid[0, column], "abcd"[column], place.told)
            grid[-1, column].set_xlabel(label)
        for axes, name in zip(grid[:, 0], "xyz", strict=True):
            axes.set_ylabel(f"{name} (mm)")
        handles = [*_dots(fit), _line("model before", BEFORE), _line("model, fitted", AFTER)]
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
        handles = [_marker(each.told, colour) for each, colour in zip(found, _colours(found), strict=True)]
        handles += [_cross()] if not fit.used.all() else []
        figure.legend(handles=handles[:8], loc="upper left", bbox_to_anchor=(0.06, 1.0), ncols=5, columnspacing=1.2)
    return figure


def validation_figure(fit: Fit, found: CrossValidation) -> Figure:
    """RMSE of each held-out part before, in the fit and held out; and what each fit without it found."""
    f, m = len(found.folds), len(fit.names)
    height = 1.25 + 0.24 * max(f + 1, m)
    with styled():
        figure = new_figure(height)
        place = 0.45 / height, 1.0 - 1.0 / height
        left = figure.add_axes((0.16, place[0], 0.36, place[1]))
        _held_out(left, fit, found)
        titled(left, "a", "root mean square error")
        right = figure.add_axes((0.68, place[0], 0.305, place[1]))
        _moved(right, fit, found)
        titled(right, "b", "numbers found without each part")
        handles = [_marker("before", VERMILION), _marker("in the fit", SKY), _marker("held out", BLUE)]
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.15, 1.0), ncols=3)
    return figure


def _profile(axes: Axes, fit: Fit, profile: Profile) -> None:
    i = fit.index(profile.name)
    unknown, best, error = fit.unknowns[i], fit.values[i], fit.standard_errors[i]
    level, per = fit.quantile**2, unknown.per_si
    reach = np.linspace(min(profile.values.min(), best - 2.5 * error), max(profile.values.max(), best + 2.5 * error), 101)
    if np.isfinite([profile.low, profile.high]).all():
        axes.axvspan(per * profile.low, per * profile.high, color=BLUE, alpha=0.10, lw=0.0)
    axes.plot(per * reach, ((reach - best) / error) ** 2, color=QUIET, lw=1.0, ls=(0, (3.5, 1.5)))
    axes.plot(per * profile.values, profile.rise, color=BLUE, marker="o", lw=1.2)
    axes.axhline(level, color=VERMILION, lw=0.8)
    axes.set_ylim(-0.4, 10.5)
    axes.set_title(f"{profile.name}\n{_minus(with_error(unknown, best, error))}", fontsize=7.5)
    axes.set_xlabel(unknown.unit or "1", labelpad=1.0)
    axes.locator_params(axis="x", nbins=5)


def _profile_legend() -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Line2D([], [], color=BLUE, marker="o", lw=1.2, label="profile"),
        _line("parabola of the fit", {"color": QUIET, "ls": (0, (3.5, 1.5)), "lw": 1.0}),
        _line("95 % level", {"color": VERMILION, "lw": 0.8}),
        Patch(color=BLUE, alpha=0.10, lw=0.0, label="95 % by likelihood"),
    ]


def _measured(fit: Fit) -> np.ndarray:
    """(N, 3) measured sensors, world, m."""
    return fit.problem.misfit.position


def _before(fit: Fit) -> np.ndarray:
    """(N, 3) sensors as the model had them with the numbers before."""
    found = fit.problem.predictor(fit.before)
    return _measured(fit) - fit.problem.misfit.errors(found)[:, :3]


def _drive(fit: Fit) -> tuple[np.ndarray, str]:
    """(N,) what poses are drawn against, and its name: tension, pulled length, or their number in the trial."""
    rows = [(fit.trials[i], row) for i, row, _ in fit.where]
    if all(each.robot.n_tendons == 1 for each in fit.trials):
        tension = np.array([each.tensions[row, 0] for each, row in rows])
        if np.isfinite(tension).all():
            return tension, "tension τ (N)"
        pulled = np.array([each.displacements[row, 0] for each, row in rows])
        if np.isfinite(pulled).all():
            return MM * pulled, "displacement (mm)"
    return fit.where[:, 1] + 1.0, "sample"


def _component(
    axes: Axes, fit: Fit, place: TrackedPlace, values: np.ndarray, measured: np.ndarray, before: np.ndarray, after: np.ndarray
) -> None:
    used = fit.used[place.rows]
    kept, lost = place.rows[used], place.rows[~used]
    axes.plot(values[kept], MM * measured[kept], ls="", marker="o", ms=2.4, mfc=PALE, mec=QUIET, mew=0.4)
    for i in np.unique(fit.where[place.rows, 0]):
        rows = place.rows[fit.where[place.rows, 0] == i]
        rubs = fit.setup.robot_of(fit.trials[i]).friction.any()
        rows = rows if rubs else rows[np.argsort(values[rows], kind="stable")]
        axes.plot(values[rows], MM * before[rows], **BEFORE)
        axes.plot(values[rows], MM * after[rows], **AFTER)
    low, high = axes.get_ylim()
    if high - low < LEAST_SPAN:
        low, high = 0.5 * (low + high - LEAST_SPAN), 0.5 * (low + high + LEAST_SPAN)
    axes.plot(values[lost], np.clip(MM * measured[lost], low, high), **_LOST)
    axes.set_ylim(low, high)


_LOST: dict[str, Any] = {"ls": "", "marker": "x", "ms": 3.5, "mec": VERMILION, "mew": 0.9, "clip_on": False}


def _dots(fit: Fit) -> list[Any]:
    from matplotlib.lines import Line2D

    measured = Line2D([], [], ls="", marker="o", ms=3.5, mfc=PALE, mec=QUIET, mew=0.4, label="measured")
    return [measured, *([_cross()] if not fit.used.all() else [])]


def _cross() -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], label="does not count", **_LOST)


def _marker(label: str, colour: str) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], ls="", marker="o", ms=4.0, color=colour, label=label)


def _line(label: str, style: dict[str, Any]) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **style)


def _normal(axes: Axes, fit: Fit, found: Sequence[TrackedPlace]) -> None:
    """Sorted whitened errors of the poses that count against what normal noise of the stated size would give."""
    from scipy.stats import norm

    misfit, (sigma, G) = fit.problem.misfit, fit.noise
    e = np.hstack([fit.errors, np.zeros((len(fit.errors), misfit.d - 3))])
    white = misfit.whitened(e[..., None], sigma, G, np.ones(len(e))).reshape(len(e), -1)[:, :3]
    owner = np.zeros(len(e), dtype=int)
    for k, each in enumerate(found):
        owner[each.rows] = k
    flat, which = white[fit.used].ravel(), np.repeat(owner[fit.used], 3)
    order = np.argsort(flat)
    expected = norm.ppf((np.arange(flat.size) + 0.5) / flat.size)
    axes.plot(expected, expected, color=QUIET, lw=1.0)
    axes.plot(expected, fit.scale * expected, color=INK, lw=0.8, ls=(0, (1, 1.2)))
    colours = np.array(_colours(found))[which[order]]
    axes.scatter(expected, flat[order], s=5.0, c=colours.tolist(), lw=0.0)
    labelled(axes, "of the normal distribution", "error / noise")
    titled(axes, "a", "errors against normal noise")
    end = float(expected[-1])
    axes.annotate("as stated", (end, end), (2.0, -9.0), textcoords="offset points", ha="right", color=QUIET, fontsize=7.0)


def _error_component(axes: Axes, fit: Fit, found: Sequence[TrackedPlace], values: np.ndarray, k: int) -> None:
    errors = MM * fit.errors[:, k]
    bound = 1.15 * float(np.abs(errors[fit.used]).max(initial=1e-6))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    for each, colour in zip(found, _colours(found), strict=True):
        kept = each.rows[fit.used[each.rows]]
        axes.plot(values[kept], errors[kept], ls="", marker=".", ms=3.5, color=colour)
    lost = ~fit.used
    axes.plot(values[lost], np.clip(errors[lost], -bound, bound), **_LOST)
    axes.set_ylim(-bound, bound)


def _held_out(axes: Axes, fit: Fit, found: CrossValidation) -> None:
    names = [*found.folds, "all"]
    parts = [found.used & (found.fold == k) for k in range(len(found.folds))]
    parts.append(found.used)
    at = np.arange(len(names))[::-1]
    for distance, colour, size in ((fit.distance_before, VERMILION, 5.0), (fit.distance, SKY, 6.0), (found.distance, BLUE, 4.0)):
        axes.plot([_rms(distance[part]) for part in parts], at, ls="", marker="o", ms=size, color=colour)
    axes.axhline(0.5, color=QUIET, lw=0.6)
    axes.set_yticks(at, names)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlabel("RMSE (mm)")
    axes.set_xscale("log")
    _plain_ticks(axes)


def _plain_ticks(axes: Axes) -> None:
    """Marks of a logarithmic axis as numbers, few enough to be read."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_xlim()
    few = (1.0, 2.0, 5.0) if high / low < 300.0 else (1.0,)
    if high / low < 5.0:
        middle = np.sqrt(low * high)
        axes.set_xlim(middle / 5.0**0.5, middle * 5.0**0.5)
    axes.xaxis.set_major_locator(LogLocator(subs=few))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _moved(axes: Axes, fit: Fit, found: CrossValidation) -> None:
    """Each fold's numbers in standard errors from those of the whole fit."""
    moved = (found.values - fit.values) / fit.standard_errors
    at = np.arange(len(fit.names))[::-1]
    axes.axvspan(-fit.quantile, fit.quantile, color=BLUE, alpha=0.10, lw=0.0)
    axes.axvline(0.0, color=QUIET, lw=0.6)
    for row in moved:
        axes.plot(row, at, ls="", marker="o", ms=4.0, color=BLUE, alpha=0.7)
    axes.set_yticks(at, fit.names)
    axes.set_ylim(-0.6, len(fit.names) - 0.4)
    widest = max(3.0, 1.1 * float(np.nanmax(np.abs(moved), initial=0.0)))
    axes.set_xlim(-widest, widest)
    axes.set_xlabel("standard errors from the fit; band: 95 %")


def _rms(distance: np.ndarray) -> float:
    known = distance[np.isfinite(distance)]
    return MM * float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def _colours(found: Sequence[TrackedPlace]) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(len(found))]


def _minus(text: str) -> str:
    return text.replace("-", "−")
