"""`shape_figure`: one shape or several in space, from the sides, and their strains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput
from ..statics.shape import Shape
from .style import BLUE, COLOURS, GREEN, MM, ORANGE, QUIET, draw, labelled, new_figure, space, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLES, FRAMES = 161, 9
FRAME_GREYS = ("#374151", "#9ca3af")
_VIEWS = {"b": ("side view", (2, 0)), "c": ("top view", (2, 1)), "d": ("seen from the tip", (1, 0))}


def shape_figure(shape_or_shapes: Shape | Sequence[Shape], labels: Sequence[str] | None = None) -> Figure:
    """Figure of one `Shape` or several: in space with tendons and section frames, three projections, strains u along s.

    labels: one text per shape. Raises `InvalidInput` for no shape, one that did not converge, or too few labels.
    """
    given = [shape_or_shapes] if isinstance(shape_or_shapes, Shape) else list(shape_or_shapes)
    names = _checked_labels(given, labels)
    shapes = [fine(shape) for shape in given]
    with styled():
        figure = new_figure(7.0)
        _in_space(figure, shapes, names)
        _projections(figure, shapes)
        _strains(figure, shapes)
    return figure


def fine(shape: Shape, samples: int = SAMPLES) -> Shape:
    """The shape at evenly spread sections, enough for a smooth line."""
    return shape.at(np.linspace(0.0, shape.length, samples)) if shape.length > 0.0 else shape


def body_paths(shape: Shape) -> list[tuple[str, np.ndarray]]:
    """(name, path (k, 3) in mm) of what is drawn of a body, the thickest first."""
    tendons = [("tendon", MM * shape.tendon_path(i)) for i in range(shape.robot.n_tendons)]
    if shape.robot.section.r_na == 0.0:
        return [("axis of the rod", MM * shape.position), *tendons]
    return [("tube axis", MM * shape.centerline), ("neutral axis", MM * shape.position), *tendons]


def _checked_labels(shapes: list[Shape], labels: Sequence[str] | None) -> list[str]:
    if not shapes:
        raise InvalidInput("shapes", shapes, "one Shape or more")
    for k, shape in enumerate(shapes):
        if not shape.converged:
            raise InvalidInput(f"shapes[{k}]", shape.status.name.lower(), "converged")
    names = list(labels) if labels is not None else [_load_text(shape) for shape in shapes]
    if len(names) != len(shapes):
        raise InvalidInput("labels", labels, f"one text for each of the {len(shapes)} shapes")
    return names


def _load_text(shape: Shape) -> str:
    tensions = ", ".join(f"{tension:.3g}" for tension in shape.tensions)
    text = shape.robot.name + (f", {tensions} N" if tensions else "")
    return text + (", loaded" if np.any(shape.gravity_load) else "")


def _style(name: str, colour: str, alone: bool) -> dict[str, Any]:
    if name == "tendon":
        return {"color": GREEN if alone else colour, "lw": 0.9, "ls": (0, (4, 1.5))}
    if name == "neutral axis":
        return {"color": ORANGE if alone else colour, "lw": 1.0, "ls": (0, (1, 1.2))}
    return {"color": colour, "lw": 2.4, "solid_capstyle": "round"}


def _draw_bodies(axes: Axes, shapes: Sequence[Shape], columns: tuple[int, ...]) -> None:
    for k, shape in enumerate(shapes):
        for name, path in body_paths(shape):
            draw(axes, path[:, columns], **_style(name, COLOURS[k % len(COLOURS)], len(shapes) == 1))


def _in_space(figure: Figure, shapes: Sequence[Shape], names: Sequence[str]) -> None:
    paths = [path for shape in shapes for _, path in body_paths(shape)]
    axes = space(figure, (0.0, 0.57, 1.0, 0.36), paths)
    _draw_bodies(axes, shapes, (0, 1, 2))
    if len(shapes) == 1 and shapes[0].s.size > 1:
        _frames(axes, shapes[0], 0.06 * np.ptp(np.concatenate(paths), axis=0).max())
    figure.text(0.01, 0.985, "(a) in space", weight="bold", size=8.5, va="top")
    figure.legend(
        handles=_legend(shapes, names), loc="upper left", bbox_to_anchor=(0.005, 0.965), handlelength=2.4, ncols=3
    )


def _frames(axes: Axes, shape: Shape, size: float) -> None:
    for i in np.linspace(0, shape.s.size - 1, FRAMES).astype(int):
        start = MM * shape.position[i]
        for column, grey in enumerate(FRAME_GREYS):
            draw(axes, np.array([start, start + size * shape.rotation[i][:, column]]), color=grey, lw=0.8)


def _legend(shapes: Sequence[Shape], names: Sequence[str]) -> list[Any]:
    from matplotlib.lines import Line2D

    alone, handles = len(shapes) == 1, []
    if not alone:
        handles = [Line2D([], [], color=COLOURS[k % len(COLOURS)], lw=2.4, label=name) for k, name in enumerate(names)]
    parts = dict.fromkeys(name for shape in shapes for name, _ in body_paths(shape))
    for name in parts:
        label = f"{name}, {names[0]}" if alone and name in ("tube axis", "axis of the rod") else name
        handles.append(Line2D([], [], label=label, **_style(name, BLUE if alone else QUIET, alone)))
    frames = zip("xy", FRAME_GREYS, strict=True) if alone else ()
    return handles + [Line2D([], [], color=grey, lw=0.8, label=f"{name} of the section frame") for name, grey in frames]


def _projections(figure: Figure, shapes: Sequence[Shape]) -> None:
    places = {"b": (0.085, 0.375, 0.40, 0.165), "c": (0.575, 0.375, 0.40, 0.165), "d": (0.085, 0.065, 0.25, 0.22)}
    for letter, (title, columns) in _VIEWS.items():
        axes = figure.add_axes(places[letter])
        _draw_bodies(axes, shapes, columns)
        axes.set_aspect("equal", adjustable="datalim")
        labelled(axes, f"{'xyz'[columns[0]]} (mm)", f"{'xyz'[columns[1]]} (mm)")
        titled(axes, letter, title)


def _strains(figure: Figure, shapes: Sequence[Shape]) -> None:
    axes = figure.add_axes((0.46, 0.065, 0.515, 0.22))
    dashes = ("-", (0, (5, 1.5)), (0, (1, 1)))
    for k, shape in enumerate(shapes):
        for i, name in enumerate("xyz"):
            colour = COLOURS[i] if len(shapes) == 1 else COLOURS[k % len(COLOURS)]
            label = f"$u_{name}$" if k == 0 else None
            axes.plot(MM * shape.s, shape.u[:, i], color=colour, ls=dashes[i], label=label)
    labelled(axes, "s (mm)", "strain u (1/m)")
    titled(axes, "e", "bending $u_x, u_y$ and twist $u_z$")
    axes.legend(ncols=3, loc="best")
