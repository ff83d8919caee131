"""Figures of follow-the-leader trials in space, the paper's Fig. 8(b), (d): the tip's path, bodies on the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..rig.inserted import Inserted, inserted
from ..rig.trials import Followed
from ..statics.shape import Shape
from .bench_lines import (
    COLUMNS,
    DOTS,
    PLANNED,
    REFERENCE,
    colour,
    furthest,
    head_room,
    legend_above,
    line,
    look,
    named,
    planned_tip,
    postures,
)
from .shapes import fine
from .style import MM, WIDTH, draw, labelled, new_figure, space, styled, titled
from .views import ABOVE, SIDE, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEFT, ACROSS = 0.6, 6.45  # inches: where plane views begin, and how wide they are at most
TALLEST = 4.5  # inches, of both plane views together
GAP, FOOT = 0.52, 0.42  # inches: between panels, and below the last for its labels
SPACE = 2.35  # inches, height of the view in space
BODY: Any = {"lw": 1.3}
_TO_TEXT = np.array([1.5, 0.0, 1.0])  # mm, from a tip to its text


def path_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """Measured paths of the tip in space and from two sides, with the reference, as the paper's Fig. 8(d)."""
    ways, first = [inserted(each) for each in found], found[0]
    reference, (_, planned) = MM * first.reference.points, planned_tip(first)
    means = [np.stack([line(way.tip_insertion, MM * way.tip[:, i])[1] for i in range(3)], axis=1) for way in ways]
    frames = np.concatenate([MM * way.tip for way in ways])
    with styled():
        low, high = _limits([reference, *means])
        scale = min(ACROSS / (high - low)[2], TALLEST / (high - low)[:2].sum())
        head = head_room(named(names) + 2) - 0.1
        side, above = scale * (high - low)[:2]
        figure = new_figure(head + SPACE + side + above + 1.3 * GAP + FOOT)
        in_space = _in_space(figure, [reference, *means], head)
        views = [
            _view(figure, SIDE, (low, high), scale, FOOT + above + GAP),
            _view(figure, ABOVE, (low, high), scale, FOOT),
        ]
        for axes, project in ((in_space, np.asarray), (views[0], SIDE.project), (views[1], ABOVE.project)):
            draw(axes, project(reference), **REFERENCE, label="reference: the whole robot", zorder=1)
            draw(axes, project(frames), **DOTS)
            for k, mean in enumerate(means):
                draw(axes, project(mean), **look(k, names))
            draw(axes, project(MM * planned), **PLANNED, label="model at the profile's tension", zorder=4)
        titled(views[0], "b", SIDE.title)
        titled(views[1], "c", ABOVE.title)
        views[0].set_xlabel("")
        legend_above(figure, in_space)
    return figure


def bodies_figure(found: Sequence[Followed], names: Sequence[str]) -> Figure:
    """Bodies on the way: the model at the readings of a few frames of one trial, as the paper's Fig. 8(b).

    The trial is the first of those that came furthest. Rings: where the tracker saw the tips of all trials then. Below,
    how far each body is from the reference along its length.
    """
    ways = [inserted(each) for each in found]
    which = furthest(ways)
    reference, shapes = found[which].reference, postures(found[which], ways[which])
    paths = [fine(shape).centerline for _, shape in shapes]
    with styled():
        head, below = head_room(min(len(names), COLUMNS) + 2, 5) - 0.1, 1.35
        figure = new_figure(head + SPACE + 0.4 * GAP + below + FOOT)
        axes = _in_space(figure, [MM * reference.points, *(MM * path for path in paths)], head)
        draw(axes, MM * reference.points, **REFERENCE, label="reference: the whole robot")
        _bodies(axes, shapes, paths, f"model at the readings of {names[which]}")
        for k, (way, name) in enumerate(zip(ways, names, strict=True)):
            if k < COLUMNS:
                _rings(axes, way, k, f"tip, {name}", [insertion for insertion, _ in shapes])
        low = figure.add_axes(_place(figure, LEFT, FOOT, ACROSS, below))
        for (insertion, shape), path in zip(shapes, paths, strict=True):
            off = MM * reference.project(path).distance
            low.plot(MM * fine(shape).s, off, **BODY, color=_shade(insertion), label=f"η = {insertion:.2f}")
        labelled(low, "arc length from the outer tube's exit, s (mm)", "distance (mm)")
        low.set(xlim=(0.0, None), ylim=(0.0, None))
        low.legend(loc="upper left", ncols=2)
        titled(low, "b", f"the same bodies: distance from the reference, {names[which]}")
        legend_above(figure, axes, 5)
    return figure


def _in_space(figure: Figure, paths: Sequence[np.ndarray], head: float) -> Any:
    """The view in space below ``head`` inches of legend."""
    room = figure.get_figheight()
    figure.text(0.012, 1.0 - head / room, "(a) in space", weight="bold", size=8.5, va="top")
    return space(figure, _place(figure, 0.0, room - head - SPACE, WIDTH, SPACE), paths)


def _view(figure: Figure, view: View, limits: tuple[np.ndarray, np.ndarray], scale: float, bottom: float) -> Axes:
    """Axes of a plane view, ``scale`` inches per mm along both, ``bottom`` inches above the lower edge."""
    (left, low), (right, high) = (view.project(each[None])[0] for each in limits)
    axes = figure.add_axes(_place(figure, LEFT, bottom, scale * (right - left), scale * (high - low)))
    axes.set(xlim=(left, right), ylim=(low, high))
    return view.prepare(axes)


def _place(figure: Figure, *inches: float) -> tuple[float, float, float, float]:
    """left, bottom, width, height as shares of the figure."""
    left, bottom, width, height = inches
    across, up = figure.get_size_inches()
    return left / across, bottom / up, width / across, height / up


def _limits(paths: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate(paths)
    margin = 0.02 * np.ptp(points[:, 2]) + 0.5
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _bodies(axes: Any, shapes: Sequence[tuple[float, Shape]], paths: Sequence[np.ndarray], name: str) -> None:
    for j in reversed(range(len(paths))):  # the longest first, below all others
        insertion = shapes[j][0]
        draw(axes, MM * paths[j], **BODY, color=_shade(insertion), label=None if j else name)
        axes.text(*(MM * paths[j][-1] + _TO_TEXT), f"η = {insertion:.2f}", size=6.8, ha="left", clip_on=False)


def _rings(axes: Any, way: Inserted, k: int, name: str, insertions: Sequence[float]) -> None:
    tips = MM * np.array([_tip_near(way, insertion) for insertion in insertions]).reshape(-1, 3)
    mark: Any = {"color": colour(k), "marker": "o", "ms": 5.0 - k % 3, "mfc": "none", "mew": 0.9, "ls": ""}
    draw(axes, tips, **mark, label=name)


def _tip_near(way: Inserted, insertion: float) -> np.ndarray:
    """The tip in the frame nearest to ``insertion``, NaN where the trial did not come so far."""
    if not len(way.tip) or insertion > way.tip_insertion.max() + 0.01:
        return np.full(3, np.nan)
    return way.tip[np.argmin(np.abs(way.tip_insertion - insertion))]


def _shade(insertion: float) -> Any:
    from matplotlib import colormaps

    return colormaps["viridis_r"](0.1 + 0.9 * insertion)
