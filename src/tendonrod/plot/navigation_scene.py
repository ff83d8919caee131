"""A robot in a phantom for the eye: `Backdrop` of shaded anatomy, the body before and behind it, axial sections."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..navigate.snapshot import Snapshot
from .course import Course
from .eye import Eye, blank, faded, picture, shaded, stacked
from .slices import Mesh, cut, outlines, part
from .style import BLUE, GREEN, INK, MM, ORANGE, QUIET, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..navigate.scenario import Scenario

TINT: Mapping[str, str] = {
    "cord": "#e9b9a0", "dura": "#b9c9dd", "canal": "#dfe5ec", "bone": "#ece3cd", "disc": "#a9c6cf",
    "root": "#e6c35c", "ganglion": "#d79a2b", "ligament": "#d9cfae",
}  # fmt: skip
SOFT = ("cord", "root", "ganglion")  # drawn solid; the dura over it, translucent; all other roles are walls around
FRONT, DURA, SOLID, BACK = 0.13, 0.4, 0.88, 0.9  # opacities
CUT = 0.92  # brightness of faces where walls are cut open
MARGIN, BAND = 0.5, 16.0  # mm around a picture, and above and below the cord's axis at most
TUBE_SHOWN = 9.0  # mm of the outer tube
BEYOND = 8.0  # mm shown beyond what the robot reached
REACH, STEP = 14e-3, 0.3e-3  # m along a sight, for what hides the body


@dataclass(frozen=True, kw_only=True)
class Backdrop:
    """Pictures of the anatomy around a course, behind and before a robot: back, solid, front, (rows, columns, 4) uint8.

    window: left, right, bottom, top in mm of ``eye``'s picture; z: range of world z shown, mm.
    """

    eye: Eye
    window: tuple[float, float, float, float]
    z: tuple[float, float]
    back: np.ndarray
    solid: np.ndarray
    front: np.ndarray

    def show(self, axes: Axes, smoothing: str = "antialiased") -> Axes:
        """Into empty axes, true to scale, bare; smoothing: matplotlib's name of an interpolation."""
        left, right, bottom, top = self.window
        axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
        axes.set_axis_off()
        for image, level in ((self.back, 0.5), (self.solid, 2.0), (self.front, 4.0)):
            axes.imshow(image, extent=self.window, zorder=level, interpolation=smoothing, aspect="equal")
        return axes


def backdrop(found: Course, eye: Eye, pixel: float = 0.06) -> Backdrop:
    """Of the phantom between the outer tube and what the robot reached, with some room; pixel: mm."""
    structures, z = found.scenario.phantom.structures.values(), shown_height(found)
    around = [(each.role, cut(MM * each.vertices, each.faces, _ends(z))) for each in structures]
    walls = [(role, mesh) for role, mesh in around if role not in (*SOFT, "dura")]
    window = _window(eye, walls or around, z)
    outward = eye.axes[2] * np.array([1.0, 1.0, 0.0])

    def drawn(meshes: Iterable[tuple[str, Mesh]]) -> np.ndarray:
        images = [picture(eye, *mesh, TINT[role], window, pixel) for role, mesh in meshes]
        return stacked([blank(window, pixel), *images])

    def half(side: float) -> np.ndarray:
        plane = (side * outward, 0.0)
        meshes = [(role, cut(*mesh, [plane])) for role, mesh in walls]
        faces = [(role, part(mesh, plane)) for role, mesh in meshes]
        return stacked([drawn(meshes), shaded(drawn(faces), CUT)])

    soft = drawn(each for each in around if each[0] in SOFT)
    dura = drawn(each for each in around if each[0] == "dura")
    solid = stacked([faded(soft, SOLID), faded(dura, DURA)])
    back, front = faded(half(-1.0), BACK), faded(half(1.0), FRONT)
    return Backdrop(eye=eye, window=window, z=z, back=back, solid=solid, front=front)


def shown_height(found: Course) -> tuple[float, float]:
    """Range of world z in mm that pictures of a course show."""
    z = [MM * found.tip[:, 2][np.isfinite(found.tip[:, 2])], *(MM * each.centerline[:, 2] for each in found.frames)]
    low, high = min(part.min() for part in z if part.size), max(part.max() for part in z if part.size)
    return float(low - BEYOND), float(max(high, low + 20.0) + BEYOND)


def _ends(z: tuple[float, float]) -> list[tuple[np.ndarray, float]]:
    return [(np.array([0.0, 0.0, 1.0]), z[0]), (np.array([0.0, 0.0, -1.0]), -z[1])]


def _window(eye: Eye, meshes: Iterable[tuple[str, Mesh]], z: tuple[float, float]) -> tuple[float, float, float, float]:
    """Around ``meshes``, but no higher than `BAND` about the cord's axis: bodies of vertebrae take too much room."""
    seen = np.concatenate([eye.project(vertices[np.unique(faces)]) for _, (vertices, faces) in meshes])
    low, high = seen[:, :2].min(axis=0) - MARGIN, seen[:, :2].max(axis=0) + MARGIN
    axis = eye.project(np.array([[0.0, 0.0, z[0]], [0.0, 0.0, z[1]]]))[:, 1]
    return float(low[0]), float(high[0]), max(float(low[1]), axis.min() - BAND), min(float(high[1]), axis.max() + BAND)


def draw_body(axes: Axes, scene: Backdrop, now: Snapshot, found: Course) -> None:
    """Outer tube and robot, pale where tissue hides it; blue free, orange in contact, vermilion above the limit."""
    points_per_mm = _scale(axes)
    _draw_tube(axes, scene, now, points_per_mm, found.scenario.outer_radius)
    if now.exposed <= 0.0:
        return
    path, seen = scene.eye.project(MM * now.centerline), _visible(scene, now, found)
    width = 2.0 * MM * float(now.radius.mean()) * points_per_mm
    colours = body_colours(now, found.scenario.limits.pressure)
    for start, end in runs(list(zip(colours, seen.tolist(), strict=True))):
        stretch, level = path[start : end + 1, :2].T, 3.0 if seen[start] else 1.0
        axes.plot(*stretch, color="white", lw=width + 0.9, solid_capstyle="round", zorder=level)
        axes.plot(*stretch, color=colours[start], lw=width, solid_capstyle="round", zorder=level + 0.1)
        axes.plot(*stretch, color="white", lw=0.3 * width, alpha=0.35, solid_capstyle="butt", zorder=level + 0.2)
    _trace_hidden(axes, path, seen)
    tip = path[-1]
    level = 3.4 if seen[-1] else 1.4
    axes.plot(*tip[:2], marker="o", ms=1.15 * width, mfc="white", mec=colours[-1], mew=1.0, zorder=level)


def runs(looks: Sequence[Any]) -> list[tuple[int, int]]:
    """First and last point of each stretch of equal ``looks``; neighbours share a point, so that no gap is left."""
    starts = [k for k in range(len(looks) - 1) if k == 0 or looks[k] != looks[k - 1]]
    return list(zip(starts, [*starts[1:], len(looks) - 1], strict=True))


def _trace_hidden(axes: Axes, path: np.ndarray, seen: np.ndarray) -> None:
    """A dotted line, over the tissue, where it hides the body."""
    shown = np.where((seen[:-1] & seen[1:])[:, None], np.nan, path[1:, :2])
    axes.plot(*shown.T, color=BLUE, lw=1.0, ls=(0, (1, 1.2)), zorder=2.6)


def body_colours(now: Snapshot, limit: float) -> list[str]:
    """By point of the body: free, in contact, pressed harder than ``limit`` (Pa)."""
    return [VERMILION if p > limit else ORANGE if p > 0.0 else BLUE for p in now.pressure.tolist()]


def _visible(scene: Backdrop, now: Snapshot, found: Course) -> np.ndarray:
    structures = found.scenario.phantom.structures.values()
    hiding = [each.surface for each in structures if each.role in ("cord", "dura") and each.surface is not None]
    seen = [scene.eye.seen_through(now.centerline, surface, REACH, STEP) for surface in hiding]
    return np.all(seen, axis=0) if seen else np.ones(len(now.centerline), dtype=bool)


def _scale(axes: Axes) -> float:
    """Points on paper per unit along x."""
    figure = axes.get_figure()
    assert figure is not None
    axes.apply_aspect()
    box = axes.get_position()
    low, high = axes.get_xlim()
    return 72.0 * box.width * figure.get_size_inches()[0] / abs(high - low)  # pyright: ignore


def _draw_tube(axes: Axes, scene: Backdrop, now: Snapshot, scale: float, radius: float) -> None:
    exit_at = MM * now.tube.position
    ends = scene.eye.project(np.array([exit_at - TUBE_SHOWN * now.tube.direction, exit_at]))[:, :2]
    width = (2.0 * MM * radius + 0.5) * scale
    axes.plot(*ends.T, color=QUIET, lw=width, solid_capstyle="butt", zorder=2.8)
    axes.plot(*ends.T, color="white", lw=0.3 * width, alpha=0.5, solid_capstyle="butt", zorder=2.85)


def draw_targets(axes: Axes, scene: Backdrop, now: Snapshot, found: Course) -> None:
    """Rings of the size of their tolerance; filled green once reached, named then."""
    from matplotlib.patches import Circle

    for name, target in found.scenario.phantom.targets.items():
        at = scene.eye.project(MM * np.array(target.position))
        if not scene.z[0] < MM * target.position[2] < scene.z[1]:
            continue
        look: Any = {"fc": GREEN, "alpha": 0.55} if name in now.reached else {"fc": "none", "alpha": 0.9}
        place = float(at[0]), float(at[1])
        axes.add_patch(Circle(place, MM * target.tolerance, ec=GREEN, lw=0.8, zorder=3.6, **look))


def draw_levels(axes: Axes, scene: Backdrop, found: Course) -> None:
    """Names of the vertebrae along the lower edge, with their ends, and a bar of 10 mm."""
    bottom = scene.window[2]
    for level in found.scenario.phantom.levels:
        low, high = (max(scene.z[0], MM * level.z_low), min(scene.z[1], MM * level.z_high))
        if high - low < 3.0:
            continue
        ends = scene.eye.project(np.array([[0.0, 0.0, low], [0.0, 0.0, high]]))[:, 0]
        axes.plot(ends, [bottom, bottom], color=QUIET, lw=1.0, clip_on=False, solid_capstyle="butt")
        axes.annotate(level.name, (ends.mean(), bottom), (0, -7), textcoords="offset points", size=6.5, color=QUIET,
                      ha="center", va="center", annotation_clip=False)  # fmt: skip


def draw_section(axes: Axes, now: Snapshot, scenario: Scenario, half: float, aim: str = "") -> None:
    """The phantom cut at the tip's height, seen from the tip with dorsal up: the patient's right is on the left.

    aim: the target that is ringed, dashed ones being others; without it, those reached are.
    """
    height = float(now.tip[2])
    axes.set(xlim=(half, -half), ylim=(-half, half), aspect="equal", xticks=[], yticks=[])
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set(visible=True, color=QUIET, lw=0.5)
    for structure in scenario.phantom.structures.values():
        _fill(axes, outlines(structure.vertices, structure.faces, height), structure.role)
    _draw_targets_near(axes, now, scenario, height, (aim,) if aim else now.reached)
    _draw_cut_body(axes, now, scenario)
    style: Any = {"size": 6.0, "color": QUIET, "transform": axes.transAxes, "ha": "center", "va": "center"}
    style |= {"zorder": 4.0, "bbox": {"fc": "white", "ec": "none", "alpha": 0.7, "boxstyle": "round,pad=0.15"}}
    for text, x, y in (("dorsal", 0.5, 0.955), ("R", 0.05, 0.5), ("L", 0.95, 0.5), ("ventral", 0.5, 0.045)):
        axes.text(x, y, text, **style)


def _fill(axes: Axes, rings: list[np.ndarray], role: str) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not rings:
        return
    path = Path.make_compound_path(*(Path(MM * ring[:, ::-1], closed=True) for ring in rings))
    look: Any = {"fc": TINT[role], "ec": QUIET, "lw": 0.4, "zorder": 1.0}
    if role == "dura":
        look |= {"alpha": 0.45, "zorder": 0.9}
    axes.add_patch(PathPatch(path, **look))


def _draw_targets_near(axes: Axes, now: Snapshot, scenario: Scenario, height: float, ringed: Collection[str]) -> None:
    from matplotlib.patches import Circle

    for name, target in scenario.phantom.targets.items():
        x, y, z = target.position
        if abs(z - height) <= 2.0 * target.tolerance:
            done = name in ringed
            axes.add_patch(Circle((MM * y, MM * x), MM * target.tolerance, fc="none", ec=GREEN, zorder=3.0,
                                  lw=1.4 if done else 0.8, ls="-" if done else (0, (3, 2))))  # fmt: skip


def _draw_cut_body(axes: Axes, now: Snapshot, scenario: Scenario) -> None:
    """The body behind the cut, pale, the tip as the disc that it is, and the nearest wall."""
    from matplotlib.patches import Circle

    path = MM * now.centerline[:, 1::-1]
    axes.plot(*path.T, color=BLUE, lw=2.0 * MM * float(now.radius.mean()) * _scale(axes), alpha=0.16, zorder=2.0,
              solid_capstyle="round", solid_joinstyle="round")  # fmt: skip
    axes.plot(*path.T, color=BLUE, lw=0.6, alpha=0.7, zorder=2.1)
    colour = body_colours(now, scenario.limits.pressure)[-1]
    axes.add_patch(Circle(tuple(path[-1]), MM * float(now.radius[-1]), fc=colour, ec="white", lw=0.5, zorder=3.2))
    for name, gap in now.clearance.items():
        surface = scenario.phantom.structures[name].surface
        if surface is not None and 1e-4 < gap[-1] < 2.5e-3:
            _draw_gap(axes, now, surface, float(gap[-1]))


def _draw_gap(axes: Axes, now: Snapshot, surface: Any, gap: float) -> None:
    (way,) = -surface.distance(now.tip[None])[1]
    start = now.tip + float(now.radius[-1]) * way
    ends = MM * np.array([start, start + gap * way])
    axes.plot(ends[:, 1], ends[:, 0], color=INK, lw=0.8, zorder=3.5, solid_capstyle="butt")
