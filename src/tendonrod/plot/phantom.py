"""Figure of a phantom: an oblique view with its targets, the section along the midline, sections across, a legend."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..anatomy import Phantom, Structure, Target
from .eye import Eye, blank, faded, picture, stacked
from .navigation_scene import TINT
from .slices import Plane, cut, outlines
from .style import BLUE, GREEN, INK, MM, PURPLE, QUIET, VERMILION, WIDTH, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KINDS = {"lateral": ("lateral", GREEN), "ventral": ("ventral", VERMILION), "drg": ("ganglion", PURPLE)}
OTHER = ("target", BLUE)
SOFT = ("cord", "root", "ganglion")
BACK, DURA, FRONT = 0.9, 0.4, 0.14  # opacities
PIXEL = 0.12  # mm
EDGE, TITLE, GAP = 0.12, 0.3, 0.28  # inches
LEGEND = 0.45  # inches, two rows
WORDS = {"bone": "vertebra", "canal": "wall of the canal", "ligament": "yellow ligament", "root": "nerve root"}
ACROSS = 4  # sections across
HALF = 21.0  # mm, half of what they show
FOOT = 7.0  # mm below the section along the midline
REVOLVED = [2, 0, 1]  # (x, y, z) as (z, x, y): a section at y of the one is one at height z of the other


def phantom_figure(phantom: Phantom, outer_radius: float | None = None) -> Figure:
    """The phantom from outside and cut; targets are rings of their tolerance.

    outer_radius (m): of a robot, which is drawn to scale at each target that a section across meets.
    """
    with styled():
        eye = Eye()
        window = _window(phantom, eye)
        long = _extent(phantom)
        width = WIDTH - 2.0 * EDGE
        heights = [width * (window[3] - window[2]) / (window[1] - window[0]), width * long[1] / long[0]]
        across = (width - (ACROSS - 1) * 0.1) / ACROSS
        total = TITLE + heights[0] + GAP + TITLE + heights[1] + GAP + TITLE + across + GAP + LEGEND
        figure = new_figure(total)
        top = total
        places = []
        for height in (*heights, across):
            top -= TITLE + height
            places.append(top / total)
            top -= GAP
        oblique = figure.add_axes((EDGE / WIDTH, places[0], width / WIDTH, heights[0] / total))
        _draw_oblique(oblique, phantom, eye, window)
        along = figure.add_axes((EDGE / WIDTH, places[1], width / WIDTH, heights[1] / total))
        _draw_along(along, phantom)
        for k, (z, title) in enumerate(_heights(phantom)):
            left = EDGE + k * (across + 0.1)
            axes = figure.add_axes((left / WIDTH, places[2], across / WIDTH, across / total))
            _draw_across(axes, phantom, z, outer_radius)
            titled(axes, "cdef"[k], title)
        _explain(figure, phantom, outer_radius, (LEGEND + 0.1) / total)
        return figure


def _explain(figure: Figure, phantom: Phantom, outer_radius: float | None, top: float) -> None:
    """A legend of the colours, the rings, and the robot's disc, from ``top`` (share of the height) downwards."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    roles = dict.fromkeys(each.role for each in phantom.structures.values())
    handles: list[Any] = [
        Patch(fc=TINT[role], ec=QUIET, lw=0.4, label=WORDS.get(role, role), **_look(role)) for role in roles
    ]
    style: Any = {"ls": "", "marker": "o"}
    if phantom.targets:
        sizes = sorted({round(MM * each.tolerance, 3) for each in phantom.targets.values()})
        ends = " to ".join(f"{each:g}" for each in dict.fromkeys((sizes[0], sizes[-1])))
        handles.append(Line2D([], [], mfc="none", mec=INK, ms=9.0, label=f"target, within {ends} mm", **style))
    if outer_radius is not None:
        name = f"robot's tube at a target, {2.0 * MM * outer_radius:.2f} mm"
        handles.append(Line2D([], [], mfc=BLUE, mec="white", ms=6.0, label=name, **style))
    figure.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, top), ncols=min(5, len(handles)), columnspacing=1.6,
        handletextpad=0.5, frameon=False,
    )  # fmt: skip


def _kind(target: Target) -> tuple[str, str]:
    """Name and colour."""
    return KINDS.get(target.name.partition("@")[0].partition("-")[0], OTHER)


def _window(phantom: Phantom, eye: Eye) -> tuple[float, float, float, float]:
    seen = np.concatenate([eye.project(MM * each.vertices) for each in phantom.structures.values()])[:, :2]
    low, high = seen.min(axis=0) - 1.0, seen.max(axis=0) + 1.0
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def _extent(phantom: Phantom) -> np.ndarray:
    """(2,) lengths along z and x, mm, of the section along the midline."""
    points = MM * np.concatenate([each.vertices for each in phantom.structures.values()])
    return np.array([np.ptp(points[:, 2]), np.ptp(points[:, 0]) + FOOT - 1.0]) + 2.0


def _draw_oblique(axes: Axes, phantom: Phantom, eye: Eye, window: tuple[float, float, float, float]) -> None:
    titled(axes, "a", f"{phantom.name}: dorsal is up, cranial to the right")
    axes.set(xlim=window[:2], ylim=window[2:], aspect="equal")
    axes.set_axis_off()
    axes.imshow(_rendered(phantom, eye, window), extent=window, aspect="equal", interpolation="antialiased")
    for name, colour in dict.fromkeys(_kind(each) for each in phantom.targets.values()):
        same = [each.position for each in phantom.targets.values() if _kind(each) == (name, colour)]
        at = eye.project(MM * np.array(same))
        axes.plot(at[:, 0], at[:, 1], "o", mfc=colour, mec="white", mew=0.5, ms=4.2, ls="", label=name, zorder=3)
    for level in phantom.levels:
        at = eye.project(MM * np.array([0.0, 0.0, level.middle]))
        axes.text(at[0], window[2], level.name, size=7.0, color=QUIET, ha="center", va="top")
    if phantom.targets:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, handletextpad=0.2, columnspacing=1.2)


def _rendered(phantom: Phantom, eye: Eye, window: tuple[float, float, float, float]) -> np.ndarray:
    """Walls behind the axis, what they enclose, and walls before it, as glass."""
    outward = eye.axes[2] * np.array([1.0, 1.0, 0.0])
    structures = phantom.structures.values()

    def drawn(found: list[Structure], *planes: Plane) -> np.ndarray:
        meshes = [(each.role, cut(MM * each.vertices, each.faces, planes)) for each in found]
        images = [picture(eye, *mesh, TINT[role], window, PIXEL) for role, mesh in meshes]
        return stacked([blank(window, PIXEL), *images])

    walls = [each for each in structures if each.role not in (*SOFT, "dura")]
    back, front = drawn(walls, (-outward, 0.0)), drawn(walls, (outward, 0.0))
    soft = drawn([each for each in structures if each.role in SOFT])
    dura = drawn([each for each in structures if each.role == "dura"])
    return stacked([faded(back, BACK), soft, faded(dura, DURA), faded(front, FRONT)])


def _draw_along(axes: Axes, phantom: Phantom) -> None:
    titled(axes, "b", "along the midline")
    middle = _midline(phantom)
    for each in phantom.structures.values():
        _fill(axes, outlines(each.vertices[:, REVOLVED], each.faces, middle), each.role)
    for target in phantom.targets.values():
        if target.side == "middle":
            _ring(axes, MM * target.position[2], MM * target.position[0], target)
    points = MM * np.concatenate([each.vertices for each in phantom.structures.values()])
    (low, _, caudal), (high, _, cranial) = points.min(axis=0), points.max(axis=0)
    for level in phantom.levels:
        axes.text(MM * level.middle, low - 1.5, level.name, size=7.0, color=QUIET, ha="center", va="top")
    _scale_bar(axes, (caudal, caudal + 10.0), low - 2.5)
    axes.set(xlim=(caudal - 1.0, cranial + 1.0), ylim=(low - FOOT, high + 1.0), aspect="equal")
    axes.set_axis_off()


def _midline(phantom: Phantom) -> float:
    """y of the plane of the patient's symmetry, m, a little aside so that it meets no vertices."""
    offsets = [each.offset for each in phantom.entries.values()]
    return float(np.mean(offsets)) + 1.234e-5 if offsets else 1.234e-5


def _scale_bar(axes: Axes, ends: tuple[float, float], y: float) -> None:
    """10 mm."""
    axes.plot(ends, [y, y], color=INK, lw=1.2, solid_capstyle="butt")
    axes.text(sum(ends) / 2.0, y - 0.7, "10 mm", size=6.5, color=INK, ha="center", va="top")


def _heights(phantom: Phantom) -> list[tuple[float, str]]:
    """Where sections across are taken: z (m) and a title."""
    found = [(each.position[2], each.name) for each in phantom.targets.values()]
    if not phantom.levels:
        return [(z, name) for z, name in found[:: max(1, len(found) // ACROSS)]][:ACROSS]
    names = [each.name for each in phantom.levels]
    picked = [names[round(k)] for k in np.linspace(0, len(names) - 1, ACROSS - 1)]
    heights = [(each.middle, f"{each.name}, body") for each in phantom.levels if each.name in picked]
    name = picked[len(picked) // 2]
    drg = [(z, f"{name}, foramen") for z, target in found if target in (f"drg-left@{name}", f"drg-right@{name}")]
    return sorted(set(heights + drg[:1]), key=lambda each: -each[0])[:ACROSS]


def _draw_across(axes: Axes, phantom: Phantom, z: float, outer_radius: float | None) -> None:
    """Seen from the head, dorsal up: the patient's right is on the left."""
    from matplotlib.patches import Circle

    middle = MM * _midline(phantom)
    axes.set(xlim=(middle + HALF, middle - HALF), ylim=(-0.9 * HALF, 1.1 * HALF), aspect="equal", xticks=[], yticks=[])
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set(visible=True, color=QUIET, lw=0.5)
    for each in phantom.structures.values():
        _fill(axes, outlines(each.vertices, each.faces, z), each.role, swap=True)
    for target in phantom.targets.values():
        x, y, height = target.position
        if abs(height - z) < 0.5 * target.tolerance:
            _ring(axes, MM * y, MM * x, target)
            if outer_radius is not None:
                axes.add_patch(Circle((MM * y, MM * x), MM * outer_radius, fc=BLUE, ec="white", lw=0.4, zorder=4))
    style: Any = {"size": 6.5, "color": INK, "transform": axes.transAxes, "va": "center"}
    _scale_bar(axes, (middle - 5.0, middle + 5.0), 3.6 - 0.9 * HALF)
    axes.text(0.04, 0.06, "R", ha="left", **style)
    axes.text(0.96, 0.06, "L", ha="right", **style)


def _ring(axes: Axes, across: float, up: float, target: Target) -> None:
    from matplotlib.patches import Circle

    colour = _kind(target)[1]
    axes.add_patch(Circle((across, up), MM * target.tolerance, fc="none", ec=colour, lw=1.0, zorder=3))
    axes.plot(across, up, marker="o", ms=1.4, color=colour, zorder=3)


def _fill(axes: Axes, rings: list[np.ndarray], role: str, swap: bool = False) -> None:
    """Outlines (k, 2) m filled where they wind around; swap: second column across."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not rings:
        return
    path = Path.make_compound_path(*(Path(MM * (ring[:, ::-1] if swap else ring), closed=True) for ring in rings))
    order = 0.9 if role == "dura" else 1.0
    axes.add_patch(PathPatch(path, fc=TINT[role], ec=QUIET, lw=0.4, zorder=order, **_look(role)))


def _look(role: str) -> dict[str, Any]:
    return {"alpha": 0.5} if role == "dura" else {}
