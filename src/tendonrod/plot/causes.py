"""Figure of a `Diagnosis`: what each cause would explain, alone and together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..measurement.diagnosis import Cause, Diagnosis
from .style import BLUE, GREEN, INK, MM, PALE, QUIET, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAPER = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
ROOM = 0.235  # inches, of a bar


def causes_figure(found: Diagnosis) -> Figure:
    """Bars: RMSE that is left with each cause fitted alone, then with causes taken together, one after the other."""
    shown = [each for each in found.alone if each.fit is not None]
    together = found.together[1:]
    bars = [*reversed(together), *reversed(shown)]
    with styled():
        figure = new_figure(0.75 + ROOM * (len(bars) + 0.6))
        axes = figure.subplots()
        figure.subplots_adjust(0.30, 0.5 / figure.get_figheight(), 0.97, 1.0 - 0.28 / figure.get_figheight())
        where = [k + (0.6 if k >= len(together) else 0.0) for k in range(len(bars))]
        colours = [GREEN if each in together else BLUE for each in bars]
        axes.barh(where, [MM * each.rmse for each in bars], color=colours, height=0.72)
        axes.set_yticks(where, [_name(each, found) for each in bars])
        axes.axvline(MM * found.rmse, color=INK, lw=0.9, ls=(0, (3.5, 1.5)))
        right = 1.28 * MM * found.rmse
        axes.set_xlim(0.0, right)
        for y, each in zip(where, bars, strict=True):
            said = f"{100 * each.explained:.{1 if each.explained > 0.95 else 0}f} %"
            axes.text(MM * each.rmse + 0.006 * right, y, said, va="center", size=7, color=QUIET, bbox=PAPER)
        axes.text(
            MM * found.rmse, 1.0, " as it stands", color=INK, size=7, transform=axes.get_xaxis_transform(), va="bottom"
        )
        axes.set_xlabel("RMSE left (mm); in grey the share of the squared error that is explained")
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_color(PALE)
    return figure


def _name(cause: Cause, found: Diagnosis) -> str:
    if cause not in found.together[1:]:
        return cause.name
    return " + ".join(each.name for each in found.together[: found.together.index(cause) + 1])
