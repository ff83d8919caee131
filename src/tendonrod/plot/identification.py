"""Figures of how sure a `Fit` is: profiles, correlations, held-out errors; `fit_errors` has those of its errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..measurement.crossvalidation import CrossValidation
from ..measurement.identification import Fit
from ..measurement.profiles import Profile
from ..measurement.rounding import with_error
from .fit_errors import line, marker
from .style import BLUE, INK, MM, QUIET, SKY, VERMILION, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_ACROSS = 3  # profiles beside each other
LONGEST = 18  # characters of the name of what was held out
IN_FIT: dict[str, Any] = {"mfc": "white", "mew": 1.4}


def profile_figure(fit: Fit, profiles: Sequence[Profile]) -> Figure:
    """For each number the rise of the squares where it is held elsewhere, beside the fit's own parabola."""
    across = 2 if len(profiles) in (1, 2, 4) else MOST_ACROSS
    down = -(-len(profiles) // across)
    height = 1.75 * down + 0.75
    with styled():
        figure = new_figure(height)
        grid: Any = figure.subplots(down, across, squeeze=False).ravel()
        figure.subplots_adjust(0.075, 0.45 / height, 0.985, 1.0 - 0.55 / height, 0.24, 0.72)
        for axes, each in zip(grid, profiles, strict=False):
            _profile(axes, fit, each)
        for axes in grid[len(profiles) :]:
            axes.set_visible(False)
        for axes in grid[::across]:
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
        titled(right, "b", "numbers, part held out")
        handles = [marker("before", VERMILION), marker("in the fit", SKY, **IN_FIT), marker("held out", BLUE)]
        figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.15, 1.0), ncols=3)
    return figure


def _profile(axes: Axes, fit: Fit, profile: Profile) -> None:
    i = fit.index(profile.name)
    unknown, best, error = fit.unknowns[i], fit.values[i], fit.standard_errors[i]
    level, per = fit.quantile**2, unknown.per_si
    reach = np.linspace(
        min(profile.values.min(), best - 2.5 * error), max(profile.values.max(), best + 2.5 * error), 101
    )
    if np.isfinite([profile.low, profile.high]).all():
        axes.axvspan(per * profile.low, per * profile.high, color=BLUE, alpha=0.10, lw=0.0)
    axes.plot(per * reach, ((reach - best) / error) ** 2, color=QUIET, lw=1.0, ls=(0, (3.5, 1.5)))
    root = np.sign(profile.values - best) * np.sqrt(profile.rise)  # nearly straight, also where the profile is not
    between = np.linspace(profile.values.min(), profile.values.max(), 101)
    axes.plot(per * between, np.interp(between, profile.values, root) ** 2, color=BLUE, lw=1.2)
    axes.plot(per * profile.values, profile.rise, color=BLUE, marker="o", ls="")
    axes.axhline(level, color=VERMILION, lw=0.8)
    axes.set_ylim(-0.4, 10.5)
    axes.set_title(f"{profile.name}\n{_minus(with_error(unknown, best, error))}", fontsize=7.5)
    axes.set_xlabel(unknown.unit or "dimensionless", labelpad=1.0)
    axes.locator_params(axis="x", nbins=5)


def _profile_legend() -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Line2D([], [], color=BLUE, marker="o", lw=1.2, label="profile"),
        line("parabola of the fit", {"color": QUIET, "ls": (0, (3.5, 1.5)), "lw": 1.0}),
        line("95 % level", {"color": VERMILION, "lw": 0.8}),
        Patch(color=BLUE, alpha=0.10, lw=0.0, label="95 % by likelihood"),
    ]


def _held_out(axes: Axes, fit: Fit, found: CrossValidation) -> None:
    names = [*found.folds, "all"]
    parts = [found.used & (found.fold == k) for k in range(len(found.folds))]
    parts.append(found.used)
    at = np.arange(len(names))[::-1]
    series: tuple[tuple[np.ndarray, str, dict[str, Any]], ...] = (
        (fit.distance_before, VERMILION, {"ms": 4.0}),
        (fit.distance, SKY, {"ms": 6.0, **IN_FIT}),
        (found.distance, BLUE, {"ms": 3.0}),
    )
    for distance, colour, style in series:
        axes.plot([_rms(distance[part]) for part in parts], at, ls="", marker="o", color=colour, **style)
    axes.axhline(0.5, color=QUIET, lw=0.6)
    axes.set_yticks(at, [name if len(name) <= LONGEST else "…" + name[1 - LONGEST :] for name in names])
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


def _minus(text: str) -> str:
    return text.replace("-", "−")
