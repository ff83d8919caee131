"""The look of every figure, set through a context and never globally; space axes with true proportions; saving."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import complete, file_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

MM = 1e3
# Okabe and Ito's palette, told apart by colour-blind readers; yellow left out as too light for lines.
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
INK, QUIET, PALE = "#1a1a1a", "#6b7280", "#c9ced6"
WIDTH = 7.2  # inches, every figure
FORMATS = (".png", ".svg", ".pdf")
ELEVATION, AZIMUTH = 19.0, 25.0  # degrees, of the eye above the z-y plane, and from y towards z
_LABEL_ROOM = np.array([1.5, 0.5])  # inches
_TICK_ROOM = np.array([24.0, 8.5])  # points, width and height of a tick's number
_LABEL_SHIFT = {"x": (-38.0, 0.0), "y": (38.0, -21.0), "z": (-4.0, -25.0)}  # points, from the middle of the axis
_RC: Any = {
    "font.size": 8.0,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "mathtext.fontset": "dejavusans",
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.5,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "lines.linewidth": 1.4,
    "lines.markersize": 3.5,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "legend.borderaxespad": 0.3,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "tendonrod",  # the same figure gives the same file
}


def styled() -> AbstractContextManager:
    """Context in which figures are drawn and saved; matplotlib's own settings are untouched outside."""
    import matplotlib as mpl

    return mpl.rc_context(_RC)


def new_figure(height: float) -> Figure:
    """An empty figure of the common width, ``height`` in inches; not known to pyplot, so it needs no display."""
    from matplotlib.figure import Figure

    return Figure(figsize=(WIDTH, height), dpi=160)


def save(figure: Figure, path) -> Path:
    """Write ``figure`` as .png, .svg or .pdf, by the suffix of ``path``, then close it.

    Raises `InvalidInput` for another suffix and where the file cannot be written.
    """
    path = write(figure, path)
    figure.clear()
    return path


def write(figure: Figure, path) -> Path:
    """As `save`, but the figure stays open for another format."""
    path = file_name("figure", path, FORMATS)
    undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    with styled(), complete("figure", path) as draft:
        figure.savefig(draft, metadata=undated.get(path.suffix.lower()))
    return path


def titled(axes: Axes, letter: str, title: str) -> None:
    """Panel title such as "(a) tension"."""
    axes.set_title(f"({letter}) {title}")


def labelled(axes: Axes, x: str, y: str) -> Axes:
    """Name both axes, units included."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    return axes


def reading_unit(largest: float) -> tuple[str, float]:
    """(unit, factor) in which a length of ``largest`` metres reads well: mm, µm or nm."""
    for unit, factor in (("mm", 1e3), ("µm", 1e6)):
        if not largest * factor < 0.01:
            return unit, factor
    return "nm", 1e9


def space(figure: Figure, place: tuple[float, float, float, float], paths: Sequence[np.ndarray]) -> Axes3D:
    """Empty 3D axes at ``place`` (left, bottom, width, height in shares of the figure) around ``paths`` (k, 3) in mm.

    One millimetre is equally long along x, y and z. World z, the insertion, runs to the right and x upwards, as on a
    bench where gravity acts along -x; y runs towards the eye.
    """
    axes: Any = figure.add_axes(place, projection="3d")
    axes.set_proj_type("ortho")
    axes.view_init(elev=ELEVATION, azim=AZIMUTH, vertical_axis="x")
    low, high = _box(paths)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    zoom = _zoom(axes, high - low, place, figure)
    axes.set_box_aspect(high - low, zoom=zoom)
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", strict=True):
        _space_axis(axis, name, zoom)
    _thin_ticks(axes, low, high, _points_per_unit(axes, place, figure))
    _name_axes(axes, low, high)
    axes.patch.set_alpha(0.0)
    return axes


def draw(axes: Axes, path: np.ndarray, **style) -> list[Any]:
    """Plot a path (k, 3) or (k, 2). Not clipped: 3D axes are drawn beyond the square that matplotlib gives them."""
    return axes.plot(*np.asarray(path).T, clip_on=False, **style)


def _box(paths: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Limits that hold all paths, with a margin; no side is shorter than a seventh of the longest."""
    points = np.concatenate([np.asarray(path).reshape(-1, 3) for path in paths])
    points = points[np.isfinite(points).all(axis=1)]
    low, high = (points.min(axis=0), points.max(axis=0)) if points.size else (-np.ones(3), np.ones(3))
    middle, size = 0.5 * (low + high), high - low
    half = 0.52 * np.maximum(size, max(size.max() / 7.0, 0.1))
    return middle - half, middle + half


def _zoom(axes: Any, size: np.ndarray, place: tuple[float, float, float, float], figure: Figure) -> float:
    """The zoom at which the box of ``size`` fills its place but for the room that ticks and labels need."""
    from mpl_toolkits.mplot3d import proj3d

    axes.set_box_aspect(size)
    corners = list(itertools.product(axes.get_xlim(), axes.get_ylim(), axes.get_zlim()))
    x, y, _ = proj3d.proj_transform(*np.array(corners).T, axes.get_proj())  # pyright: ignore[reportCallIssue]
    room = figure.get_size_inches() * place[2:]
    inch = room.min() / axes.viewLim.width  # the view is square, as large as fits
    extent = inch * np.array([np.ptp(x), np.ptp(y)])
    return float(((room - _LABEL_ROOM) / extent).min())


def _points_per_unit(axes: Any, place: tuple[float, float, float, float], figure: Figure) -> float:
    """Points on paper per unit of the projection."""
    return 72.0 * float((figure.get_size_inches() * place[2:]).min()) / axes.viewLim.width


def _thin_ticks(axes: Any, low: np.ndarray, high: np.ndarray, scale: float) -> None:
    """Ticks as many as fit beside each other on paper: none is printed over its neighbour on a foreshortened axis."""
    from matplotlib.ticker import MaxNLocator

    size, matrix = high - low, axes.get_proj()
    shrink = np.abs(matrix[:2, :3] / matrix[3, 3])  # of a parallel projection
    for k, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        few = MaxNLocator(nbins=max(3, round(7 * size[k] / size.max())), steps=[1, 2, 4, 5, 10])
        ticks = few.tick_values(low[k], high[k])
        ticks = ticks[(ticks >= low[k]) & (ticks <= high[k])]
        across, up = scale * shrink[:, k] * (ticks[1] - ticks[0] if len(ticks) > 1 else size[k])
        apart = max(across / _TICK_ROOM[0], up / _TICK_ROOM[1], 1e-3)
        axis.set_ticks(ticks[:: int(np.ceil(1.0 / apart))])


def _space_axis(axis: Any, name: str, zoom: float) -> None:
    """Quiet panes and ticks near their axis: matplotlib blows the distance up with the zoom."""
    axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    axis.line.set_color(QUIET)
    axis.set_tick_params(pad=11.0 / zoom - 8.0, labelsize=7.0)
    axis.set_label_text(f"{name} (mm)", visible=False)


def _name_axes(axes: Any, low: np.ndarray, high: np.ndarray) -> None:
    """The labels, at the three edges where matplotlib draws the axes for the eye's position of `space`."""
    from mpl_toolkits.mplot3d import proj3d

    x, y, z = 0.5 * (low + high)
    middles = {"x": (x, high[1], low[2]), "y": (low[0], y, high[2]), "z": (low[0], high[1], z)}
    for name, point in middles.items():
        across, up, _ = proj3d.proj_transform(*point, axes.get_proj())
        axes.annotate(
            f"{name} (mm)", (across, up), _LABEL_SHIFT[name], textcoords="offset points", ha="center", va="center",
            rotation=90.0 if name == "x" else 0.0, annotation_clip=False,
        )  # fmt: skip
