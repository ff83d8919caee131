"""The drawing of a robot as the paper's Figs 2 and 3: the solid, its notches with dimensions, and the section.

True proportions throughout, in millimetres. The solid is a parallel projection of small plane facets, sorted by depth.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, pi, radians
from typing import TYPE_CHECKING, Any

import numpy as np

from .device import MM, Notch, notch_pattern
from .device_solid import STEEL, Facets, Projection, cord_facets, joined, tube_facets
from .errors import InvalidInput
from .robot import Robot
from .section import NotchedTube, PlainRod
from .section_figure import INK, NEUTRAL, QUIET, TENDON, draw_section, rod_radius, shown_radius

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STYLE: Any = {"font.size": 8.0, "font.family": "sans-serif", "mathtext.fontset": "dejavusans"}
_PITCHES = 8


def draw_device(robot: Robot) -> Figure:
    """Figure (7.2 inch wide) of the unloaded robot: (a) the whole, (b) eight pitches with w and d, (c) the section.

    A plain rod has (a) the rod with its tendons, drawn straight, and (b) the section. No global state of matplotlib is
    touched; the caller saves the figure. Raises `InvalidInput` for other bodies.
    """
    if not isinstance(robot.body, (NotchedTube, PlainRod)):
        raise InvalidInput("robot", robot.name, "a notched tube or a plain rod, the bodies that can be drawn")
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(7.2, 4.1 if isinstance(robot.body, NotchedTube) else 3.4), dpi=200, facecolor="white")
        if isinstance(robot.body, NotchedTube):
            _draw_tube(figure, robot, robot.body)
        else:
            _draw_rod(figure, robot, robot.body)
    return figure


def _draw_tube(figure: Figure, robot: Robot, tube: NotchedTube) -> None:
    notches = notch_pattern(robot)
    shown = _zoom(notches)
    whole = _panel(figure, (0.0, 0.74, 1.0, 0.25), f"(a)  {robot.name}: the unloaded tube, to scale")
    _whole_tube(whole, tube, notches, shown)
    zoom = _panel(figure, (0.0, 0.0, 0.57, 0.71), f"(b)  {len(shown)} of {len(notches)} notches, to scale")
    _zoomed_tube(zoom, robot, tube, shown)
    draw_section(_panel(figure, (0.575, 0.0, 0.425, 0.71), "(c)  section, seen from the tip"), robot)


def _zoom(notches: list[Notch]) -> list[Notch]:
    """Up to eight notches about one third of the way along."""
    count = min(_PITCHES, len(notches))
    first = (len(notches) - count) // 3
    return notches[first : first + count]


def _whole_tube(axes: Axes, tube: NotchedTube, notches: list[Notch], shown: list[Notch]) -> None:
    facing = shown[len(shown) // 2].cut_angle
    view = Projection.along_z(up_angle=facing - radians(40), yaw=radians(12), elevation=0.0)
    scene = _Scene(axes, view)
    scene.paint(tube_facets(tube, notches, (0.0, tube.length), radians(10)))
    length, r_o = MM * tube.length, MM * tube.outer_radius
    scene.central_axis(-2.0 * r_o, length + 3.0 * r_o)
    scene.neutral_axis(tube, 0.0, length)
    below = -1.3 * r_o - 1.4
    scene.dimension((0.0, 0.0, 0.0), (0.0, 0.0, length), f"$L$ = {length:.4g} mm", below, gap=1.5 * r_o)
    middle = 0.5 * MM * (shown[0].z_start + shown[-1].z_end)
    half = 0.5 * MM * (shown[-1].z_end - shown[0].z_start) + 0.3
    scene.box((0.0, 0.0, middle), half, 1.45 * r_o, "(b)")
    scene.fit(-0.03 * length - 2.0 * r_o, 1.02 * length + 3.0 * r_o, 2.0 * r_o + 2.0, 2.0 * r_o + 3.5)


def _zoomed_tube(axes: Axes, robot: Robot, tube: NotchedTube, notches: list[Notch]) -> None:
    facing = notches[len(notches) // 2].cut_angle
    view = Projection.along_z(up_angle=facing - radians(38), yaw=radians(24), elevation=radians(16))
    scene = _Scene(axes, view)
    gap, r_o = 0.5 * tube.notch_spacing, MM * tube.outer_radius
    ends = (notches[0].z_start - gap, notches[-1].z_end + gap)
    low, high = MM * ends[0], MM * ends[1]
    z = np.linspace(low - 0.4 * r_o, high + 0.8 * r_o, 240)
    paths = _tendon_paths(robot, z)
    cords = [cord_facets(path, radius) for path, radius in paths]
    scene.paint(joined([tube_facets(tube, notches, ends, radians(4)), *cords]))
    scene.central_axis(low - 0.9 * r_o, high + 1.5 * r_o)
    scene.line(_on_neutral_axis(tube, np.linspace(low, high, 200)), color=NEUTRAL, lw=1.4, zorder=5)
    _notch_dimensions(scene, tube, notches)
    scene.note(_on_neutral_axis(tube, low + 0.2 * (high - low)), "neutral axis", NEUTRAL, (-0.2 * r_o, -1.35 * r_o))
    scene.note((0.0, 0.0, high + 1.35 * r_o), "tube axis", QUIET, (-0.1 * r_o, -0.55 * r_o))
    if paths:
        name = "tendon" if robot.n_tendons == 1 else "tendon 1"
        scene.note(paths[0][0][-min(12, len(paths[0][0]))], name, TENDON, (0.1 * r_o, 0.8 * r_o))
    scene.fit(low - 1.2 * r_o, high + 1.9 * r_o, 2.3 * r_o, 2.4 * r_o)


def _notch_dimensions(scene: _Scene, tube: NotchedTube, notches: list[Notch]) -> None:
    w, d, r_o = MM * tube.notch_width, MM * tube.notch_spacing, MM * tube.outer_radius
    apart = len(notches) == _PITCHES
    places = [(notches[2 if apart else 0], 0.0, w, "w", 0.7), (notches[4 if apart else -1], w, d, "d", 0.7)]
    if not apart:
        places[1] = (*places[1][:4], 1.3)
    for notch, start, size, name, lift in places:
        x, y = r_o * scene.topmost(notch)
        z = MM * notch.z_start + start
        scene.dimension((x, y, z), (x, y, z + size), f"${name}$ = {size:.4g} mm", lift * r_o, gap=0.08 * r_o)


def _draw_rod(figure: Figure, robot: Robot, rod: PlainRod) -> None:
    axes = _panel(
        figure, (0.0, 0.70, 1.0, 0.29), f"(a)  {robot.name}: the rod with its tendons, drawn straight, to scale"
    )
    length, radius = MM * rod.length, rod_radius(rod)
    view = Projection.along_z(up_angle=radians(20), yaw=radians(12), elevation=0.0)
    scene = _Scene(axes, view)
    z = np.linspace(0.0, length, 400)
    core = cord_facets(np.column_stack([0.0 * z, 0.0 * z, z]), radius, STEEL, 24)
    paths = _tendon_paths(robot, z)
    scene.paint(joined([core, *(cord_facets(path, thickness) for path, thickness in paths)]))
    reach = max([radius, *(float(np.hypot(path[:, 0], path[:, 1]).max()) + thickness for path, thickness in paths)])
    scene.central_axis(-0.02 * length, 1.03 * length)
    below = -1.2 * reach - 0.02 * length
    scene.dimension((0.0, 0.0, 0.0), (0.0, 0.0, length), f"$L$ = {length:.4g} mm", below, gap=1.2 * reach)
    scene.fit(-0.03 * length, 1.04 * length, 1.2 * reach + 0.03 * length, 1.2 * reach + 0.05 * length)
    draw_section(_panel(figure, (0.0, 0.0, 1.0, 0.66), "(b)  section, seen from the tip"), robot)


def _tendon_paths(robot: Robot, z: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Centre lines (n, 3) in the unloaded robot at heights z, about the tube's axis, and radii to draw; mm."""
    section = robot.section
    s = z / MM * section.L_na / section.L
    turn = 2.0 * pi * robot.turns * z / (MM * section.L)
    paths = []
    for i, tendon in enumerate(robot.tendons):
        x, y, _ = MM * robot.tendon_position(i, s).T
        x = x - MM * section.r_na
        inside = s <= (np.inf if tendon.end is None else tendon.end)
        turned = np.column_stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), z])
        if inside.sum() > 1:
            paths.append((turned[inside], shown_radius(robot, tendon)))
    return paths


def _on_neutral_axis(tube: NotchedTube, z) -> np.ndarray:
    angle = pi + 2.0 * pi * tube.turns * np.asarray(z) / (MM * tube.length)
    r_na = MM * tube.section.r_na
    return np.stack([r_na * np.cos(angle), r_na * np.sin(angle), np.asarray(z)], axis=-1)


def _panel(figure: Figure, place: tuple[float, float, float, float], title: str) -> Axes:
    axes = figure.add_axes(place)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.text(0.012, 0.985, title, transform=_fixed(figure, place), ha="left", va="top", color=INK, weight="bold")
    return axes


def _fixed(figure: Figure, place: tuple[float, float, float, float]):
    """Coordinates of the panel's place; those of the axes shrink when the aspect is kept equal."""
    from matplotlib.transforms import Affine2D

    x, y, width, height = place
    return Affine2D().scale(width, height).translate(x, y) + figure.transFigure


@dataclass(frozen=True)
class _Scene:
    """Axes that show a projection."""

    axes: Axes
    view: Projection

    def paint(self, facets: Facets) -> None:
        from matplotlib.collections import PolyCollection

        polygons, colours = self.view.polygons(facets)
        solid = PolyCollection(list(polygons), facecolors=colours, edgecolors=colours, linewidths=0.25, zorder=2)
        solid.set_rasterized(True)
        self.axes.add_collection(solid, autolim=False)

    def line(self, path, **style) -> None:
        x, y = self.view.points(np.asarray(path, dtype=float)).T
        self.axes.plot(x, y, solid_capstyle="round", **style)

    def central_axis(self, low: float, high: float) -> None:
        self.line([(0.0, 0.0, low), (0.0, 0.0, high)], color=QUIET, lw=0.6, ls=(0, (9, 2.5, 1.5, 2.5)), zorder=3)

    def neutral_axis(self, tube: NotchedTube, low: float, high: float) -> None:
        """Full line where the uncut arc faces the eye, thin and dashed where it lies behind."""
        path = _on_neutral_axis(tube, np.linspace(low, high, 600))
        near = self.view.facing(path * np.array([1.0, 1.0, 0.0]))[:, None]
        self.line(np.where(near, path, np.nan), color=NEUTRAL, lw=1.3, zorder=5)
        self.line(np.where(near, np.nan, path), color=NEUTRAL, lw=1.0, ls=(0, (3, 1.6)), zorder=5)

    def topmost(self, notch: Notch) -> np.ndarray:
        """Unit direction (2,) within the removed part that is highest in the picture."""
        away = (atan2(self.view.axes[1, 1], self.view.axes[1, 0]) - notch.cut_angle + pi) % (2.0 * pi) - pi
        angle = notch.cut_angle + min(max(away, -notch.half_cut), notch.half_cut)
        return np.array([np.cos(angle), np.sin(angle)])

    def dimension(self, start, end, text: str, lift: float, gap: float) -> None:
        """A dimension between two points, its line raised by ``lift`` (mm in the picture), extended from ``gap`` on."""
        ends = self.view.points(np.array([start, end], dtype=float))
        line = ends + np.array([0.0, lift])
        for point, foot in zip(line, ends, strict=True):
            tail = 0.12 * lift
            y = [foot[1] + np.sign(lift) * gap, point[1] + tail]
            self.axes.plot([foot[0], foot[0]], y, color=INK, lw=0.5, zorder=6)
        self._arrows(line)
        slope = np.degrees(np.arctan2(*(line[1] - line[0])[::-1]))
        where = line.mean(axis=0)
        self.axes.annotate(
            text, where, (0.0, 4.0 if lift > 0 else -4.0), textcoords="offset points", ha="center", color=INK, zorder=7,
            va="bottom" if lift > 0 else "top", rotation=slope, rotation_mode="anchor",
        )  # fmt: skip

    def _arrows(self, line: np.ndarray) -> None:
        style = {"arrowstyle": "<|-|>", "color": INK, "lw": 0.6, "mutation_scale": 5, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", line[1], line[0], arrowprops=style, zorder=6)

    def note(self, point, text: str, colour: str, shift: tuple[float, float]) -> None:
        x, y = self.view.points(np.asarray(point, dtype=float))
        style = {"arrowstyle": "-", "color": colour, "lw": 0.6, "shrinkA": 0, "shrinkB": 0}
        side = "bottom" if shift[1] > 0 else "top"
        place = (x + shift[0], y + shift[1])
        self.axes.annotate(text, (x, y), place, arrowprops=style, color=colour, ha="center", va=side, zorder=7)

    def box(self, centre, half_width: float, half_height: float, name: str) -> None:
        from matplotlib.patches import Rectangle

        x, y = self.view.points(np.asarray(centre, dtype=float))
        corner = (x - half_width, y - half_height)
        frame = Rectangle(corner, 2 * half_width, 2 * half_height, fill=False, ec=INK, lw=0.7, zorder=6)
        self.axes.add_patch(frame)
        self.axes.annotate(
            name, (x, y + half_height), (0, 2), textcoords="offset points", ha="center", va="bottom", color=INK
        )

    def fit(self, low: float, high: float, above: float, below: float) -> None:
        """Show the axis from ``low`` to ``high`` with room above and below; mm."""
        ends = self.view.points(np.array([[0.0, 0.0, low], [0.0, 0.0, high]]))
        self.axes.set_xlim(ends[:, 0].min(), ends[:, 0].max())
        self.axes.set_ylim(ends[:, 1].min() - below, ends[:, 1].max() + above)
