"""`shape_figure`: one shape or several in space, from the sides, and their strains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput
from ..statics.shape import Shape
from .style import BLUE, COLOURS, GREEN, MM, ORANGE, QUIET, draw, labelled, new_figure, space, styled, titled
from .surroundings import Surroundings, draw_in_space, draw_in_view, legend_handles, surroundings
from .views import ABOVE, SIDE, TIP

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SAMPLES, FRAMES = 161, 9
FRAME_GREYS = ("#374151", "#9ca3af")
_VIEWS = {"b": SIDE, "c": ABOVE, "d": TIP}


def shape_figure(shape_or_shapes: Shape | Sequence[Shape], labels: Sequence[str] | None = None) -> Figure:
    """Figure of one `Shape` or several: in space with tendons and section frames, three projections, strains u along s.

    Surfaces near the body, contact forces, point loads and masses are drawn too, arrows to one scale for each kind.

    labels: one text per shape. Raises `InvalidInput` for no shape, one that did not converge, or too few labels.
    """
    given = [shape_or_shapes] if isinstance(shape_or_shapes, Shape) else list(shape_or_shapes)
    names = _checked_labels(given, labels)
    shapes = [fine(shape) for shape in given]
    around = surroundings(shapes)
    with styled():
        figure = new_figure(7.0)
        _in_space(figure, shapes, names, around)
        _projections(figure, shapes, around)
        _strains(figure, shapes)
    return figure


def fine(shape: Shape, samples: int = SAMPLES) -> Shape:
    """The shape at evenly spread sections, enough for a smooth line."""
    return shape.at(np.linspace(0.0, shape.length, samples)) if shape.length > 0.0 else shape


def strain_curve(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """s (n,) in m and u (n, 3) in 1/m for a plot: NaN where the strain jumps, at a tendon's end within the body."""
    start = shape.material_coordinate[0] - shape.s[0]
    ends = [tendon.end - start for tendon in shape.robot.tendons if tendon.end is not None]
    jumps = np.unique([end for end in ends if 0.0 < end < shape.length * (1.0 - 1e-9)])
    if not jumps.size:
        return shape.s, shape.u
    near = 1e-9 * shape.length
    s = np.unique(np.concatenate([shape.s[~np.isin(shape.s, jumps)], jumps - near, jumps + near]))
    at = np.searchsorted(s, jumps)
    return np.insert(s, at, jumps), np.insert(shape.at(s).u, at, np.nan, axis=0)


def body_paths(shape: Shape) -> list[tuple[str, np.ndarray]]:
    """(name, path (k, 3) in mm) of what is drawn of a body, the thickest first."""
    tendons = [("tendon", MM * shape.tendon_path(i)) for i in range(shape.robot.n_tendons)]
    if shape.robot.section.r_na == 0.0:
        return [("axis of the rod", MM * shape.position), *tendons]
    return [("tube axis", MM * shape.centerline), ("neutral axis", MM * shape.position), *tendons]


def check_converged(shapes: Sequence[Shape]) -> None:
    """Raise `InvalidInput` that names the first shape which did not converge."""
    for k, shape in enumerate(shapes):
        if not shape.converged:
            raise InvalidInput(f"shapes[{k}]", shape.status.name.lower(), "converged")


def _checked_labels(shapes: list[Shape], labels: Sequence[str] | None) -> list[str]:
    if not shapes:
        raise InvalidInput("shapes", shapes, "one Shape or more")
    check_converged(shapes)
    names = list(labels) if labels is not None else [_load_text(shape) for shape in shapes]
    if len(names) != len(shapes):
        raise InvalidInput("labels", labels, f"one text for each of the {len(shapes)} shapes")
    return names


def _load_text(shape: Shape) -> str:
    tensions = ", ".join(f"{tension:.3g}" for tension in shape.tensions)
    pulled = f" at ({tensions}) N" if len(shape.tensions) > 1 else f" at {tensions} N" if tensions else ""
    return shape.robot.name + pulled + (", with load" if shape.loaded else "")


def _style(name: str, colour: str, alone: bool) -> dict[str, Any]:
    if name == "tendon":
        return {"color": GREEN if alone else colour, "lw": 0.9, "ls": (0, (4, 1.5))}
    if name == "neutral axis":
        return {"color": ORANGE if alone else colour, "lw": 1.0, "ls": (0, (1, 1.2))}
    return {"color": colour, "lw": 2.4, "solid_capstyle": "round"}


def _draw_bodies(axes: Axes, shapes: Sequence[Shape], project: Callable[[np.ndarray], np.ndarray]) -> None:
    for k, shape in enumerate(shapes):
        for name, path in body_paths(shape):
            draw(axes, project(path), **_style(name, COLOURS[k % len(COLOURS)], len(shapes) == 1))


def _in_space(figure: Figure, shapes: Sequence[Shape], names: Sequence[str], around: Surroundings) -> None:
    paths = [path for shape in shapes for _, path in body_paths(shape)]
    axes = space(figure, (0.0, 0.57, 1.0, 0.36), [*paths, *around.paths])
    _draw_bodies(axes, shapes, np.asarray)
    if len(shapes) == 1 and shapes[0].s.size > 1:
        _frames(axes, shapes[0], 0.06 * np.ptp(np.concatenate(paths), axis=0).max())
    draw_in_space(axes, around)
    title = f"(a) {names[0]}: in space" if len(shapes) == 1 else "(a) in space"
    figure.text(0.01, 0.985, title, weight="bold", size=8.5, va="top")
    figure.legend(
        handles=[*_legend(shapes, names), *legend_handles(around)],
        loc="upper left", bbox_to_anchor=(0.005, 0.965), handlelength=2.4, ncols=3,
    )  # fmt: skip


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
    handles += [Line2D([], [], label=name, **_style(name, BLUE if alone else QUIET, alone)) for name in parts]
    frames = zip("xy", FRAME_GREYS, strict=True) if alone else ()
    return handles + [Line2D([], [], color=grey, lw=0.8, label=f"{name} of the section frame") for name, grey in frames]


def _projections(figure: Figure, shapes: Sequence[Shape], around: Surroundings) -> None:
    places = {"b": (0.085, 0.375, 0.40, 0.165), "c": (0.575, 0.375, 0.40, 0.165), "d": (0.085, 0.065, 0.25, 0.22)}
    for letter, view in _VIEWS.items():
        axes = view.prepare(figure.add_axes(places[letter]))
        _draw_bodies(axes, shapes, view.project)
        draw_in_view(axes, around, view.project)
        axes.set_aspect("equal", adjustable="datalim")
        titled(axes, letter, view.title)


def _strains(figure: Figure, shapes: Sequence[Shape]) -> None:
    axes = figure.add_axes((0.46, 0.065, 0.515, 0.22))
    dashes = ("-", (0, (5, 1.5)), (0, (1, 1)))
    for k, shape in enumerate(shapes):
        s, u = strain_curve(shape)
        for i, name in enumerate("xyz"):
            colour = COLOURS[i] if len(shapes) == 1 else COLOURS[k % len(COLOURS)]
            label = f"$u_{name}$" if k == 0 else None
            axes.plot(MM * s, u[:, i], color=colour, ls=dashes[i], label=label)
    labelled(axes, "s (mm)", "strain u (1/m)")
    titled(axes, "e", "bending $u_x, u_y$ and twist $u_z$")
    axes.legend(ncols=3, loc="best")
