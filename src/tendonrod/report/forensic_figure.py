"""The figure of `forensics`: tilts and masses, and tilts in both directions, that Table I admits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..plot.style import (
    BLUE,
    GREEN,
    INK,
    MM,
    ORANGE,
    PURPLE,
    QUIET,
    SKY,
    VERMILION,
    labelled,
    new_figure,
    styled,
    titled,
)  # fmt: skip
from .chapter import short, title_of
from .results import Forensics, Region

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PLACE_COLOUR = {"¼": GREEN, "½": ORANGE, "¾": PURPLE, "1": VERMILION}
_AT_LEAST, _AT_MOST = "-", (0, (3.5, 1.6))
_MODULI = {"moduli × 0.6": (0, (1, 1.1)), "moduli × 1.4": (0, (6, 1.5, 1, 1.5))}
_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9}
_ROOM = 1.15  # of the tilts shown, about those at which some bound is met
_FINER = 4  # margins are smooth, their least is not: it is taken between the nodes
_ABOVE = {"top": 0.918, "bottom": 0.315, "left": 0.075, "right": 0.985, "hspace": 0.36, "wspace": 0.13}
_BELOW = {"top": 0.235, "bottom": 0.05, "left": 0.075, "right": 0.985, "wspace": 0.24}


def forensic_figure(found: Sequence[Forensics], printed: str = "as printed") -> Figure:
    """Regions in tilt and mass with the bounds that limit them, above those in both directions of tilt."""
    with styled():
        figure = new_figure(8.0)
        upper: Any = figure.subplots(2, 2, gridspec_kw=_ABOVE)
        lower: Any = figure.subplots(1, len(found), gridspec_kw=_BELOW)
        for k, (each, axes, below) in enumerate(zip(found, upper.flat, lower, strict=True)):
            _over_mass(axes, each, printed)
            labelled(axes, "base tilt towards gravity (deg)", "mass, carried along (g)" if k % 2 == 0 else "")
            titled(axes, "abcd"[k], title_of(each.name))
            _over_directions(below, each.sideways)
            labelled(below, "tilt towards gravity (deg)", "tilt sideways, to y (deg)" if k == 0 else "")
            titled(below, "efgh"[k], f"{short(each.name)}, no mass")
        figure.legend(handles=_legend(), loc="upper center", ncols=5, columnspacing=1.4)
    return figure


def _over_mass(axes: Axes, each: Forensics, printed: str) -> None:
    region = each.regions[printed]
    _bounds(axes, region, 1e3)
    for name, dashes in _MODULI.items():
        x, y, margins = _finer(each.regions[name], each.regions[name].margins)
        kept = margins.min(axis=-1).T
        if kept.max() > 0.0:
            axes.contour(np.degrees(x), 1e3 * y, kept, levels=[0.0], colors=[INK], linewidths=1.0, linestyles=[dashes])
    axes.set_xlim(*_shown(region))
    if region.least is None:
        text = f"no tilt and mass do:\na bound is missed\nby at least {-MM * region.closest:.2f} mm"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=INK, bbox=_BOX)
    else:
        axes.plot(
            np.degrees(region.least[0]),
            1e3 * region.least[1],
            color=INK,
            marker="o",
            mfc="none",
            ms=6.0,
            clip_on=False,
            zorder=5,
        )


def _over_directions(axes: Axes, region: Region) -> None:
    _bounds(axes, region, np.degrees(1.0))
    low, high = _shown(region)
    limit = max(-low, high)
    axes.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal", anchor="S")


def _shown(region: Region) -> tuple[float, float]:
    """Tilts (degrees) between which any bound is met without the second quantity, or all of them with it."""
    without = region.margins[:, np.abs(region.values).argmin()]
    met = (np.diff(np.sign(without), axis=0) != 0).any(axis=1)
    used = np.degrees(region.tilts[:-1][met | (region.margins.min(axis=-1) >= 0.0).any(axis=1)[1:]])
    return _ROOM * float(used.min()), _ROOM * float(used.max())


def _bounds(axes: Axes, region: Region, factor: float) -> None:
    """Bounds by place, and what keeps all of them; ``factor``: from SI to the unit of the second axis."""
    x, y, margins = _finer(region, region.margins)
    loose = _finer(region, region.margins_at_any_tensions)[2].min(axis=-1).T
    x, y = np.degrees(x), factor * y
    coarse = np.degrees(region.tilts), factor * region.values
    axes.contourf(x, y, loose, levels=[0.0, np.inf], colors=[SKY], alpha=0.4)
    axes.contourf(x, y, margins.min(axis=-1).T, levels=[0.0, np.inf], colors=[BLUE], alpha=0.6)
    for k, colour in enumerate(_PLACE_COLOUR.values()):
        for place, dashes in ((k, _AT_LEAST), (k + 4, _AT_MOST)):
            line = region.margins[..., place].T
            if line.min() < 0.0 < line.max():
                axes.contour(*coarse, line, levels=[0.0], colors=[colour], linewidths=0.8, linestyles=[dashes])


def _finer(region: Region, margins: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tilts, values and margins with more points between, linear."""
    for axis in (0, 1):
        n = margins.shape[axis]
        rows = np.arange((n - 1) * _FINER + 1) / _FINER
        low = np.minimum(rows.astype(int), n - 2)
        share = (rows - low).reshape(-1, *(1,) * (2 - axis))
        first, second = margins.take(low, axis), margins.take(low + 1, axis)
        margins = first + share * (second - first)
    x, y = (np.linspace(at[0], at[-1], (at.size - 1) * _FINER + 1) for at in (region.tilts, region.values))
    return x, y, margins


def _legend() -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def line(name: str, colour: str, dashes: Any) -> Line2D:
        return Line2D([], [], color=colour, lw=1.1, ls=dashes, label=name)

    return [
        Patch(color=BLUE, alpha=0.6, label="all bounds kept"),
        Patch(color=SKY, alpha=0.4, label="kept at some tensions"),
        *(line(f"all kept, {name}", INK, dashes) for name, dashes in _MODULI.items()),
        *(line(f"bounds at {place} $L_{{na}}$", colour, "-") for place, colour in _PLACE_COLOUR.items()),
        line("least distance met", QUIET, _AT_LEAST),
        line("largest distance met", QUIET, _AT_MOST),
    ]
