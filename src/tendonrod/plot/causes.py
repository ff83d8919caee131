"""Figure of a `Diagnosis`: what each cause would explain, alone and together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..measurement.diagnosis import Cause, Diagnosis
from .style import BLUE, GREEN, INK, MM, PALE, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOM = 0.235  # inches, of a bar
COLUMN = 1.17  # of the axes' width, where the numbers beside the bars end


def causes_figure(found: Diagnosis) -> Figure:
    """Bars: RMSE that is left with each cause fitted alone, then with causes taken together, one after the other."""
    shown = [each for each in found.alone if each.fit is not None]
    together = found.together[1:]
    bars = [*reversed(together), *reversed(shown)]
    with styled():
        figure = new_figure(0.75 + ROOM * (len(bars) + 0.6))
        axes = figure.subplots()
        figure.subplots_adjust(0.30, 0.5 / figure.get_figheight(), 0.85, 1.0 - 0.28 / figure.get_figheight())
        where = [k + (0.6 if k >= len(together) else 0.0) for k in range(len(bars))]
        colours = [GREEN if each in together else BLUE for each in bars]
        axes.barh(where, [MM * each.rmse for each in bars], color=colours, height=0.72)
        axes.set_yticks(where, [_name(each, found) for each in bars])
        axes.axvline(MM * found.rmse, color=INK, lw=0.9, ls=(0, (3.5, 1.5)))
        axes.set_xlim(0.0, 1.03 * MM * max([found.rmse, *(each.rmse for each in bars)]))
        _shares(axes, where, bars)
        above: Any = {"size": 7, "va": "bottom", "ha": "right", "transform": axes.get_xaxis_transform()}
        axes.text(MM * found.rmse, 1.01, "as it stands ", color=INK, **above)
        axes.set_xlabel("RMSE left (mm)")
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_color(PALE)
    return figure


def _shares(axes: Axes, where: Sequence[float], bars: Sequence[Cause]) -> None:
    """What each cause explains, in a column beside the axes, where no line runs through it."""
    edge = axes.get_yaxis_transform()
    for y, each in zip(where, bars, strict=True):
        axes.text(COLUMN, y, f"{100.0 * each.explained:.1f} %", ha="right", va="center", size=7.5, transform=edge)
    axes.text(COLUMN, 1.01, "squared error\nexplained", ha="right", va="bottom", size=7, transform=axes.transAxes)


def _name(cause: Cause, found: Diagnosis) -> str:
    if cause not in found.together[1:]:
        return cause.name
    return " + ".join(each.name for each in found.together[: found.together.index(cause) + 1])
