"""The section of a robot to scale, with what the model calls its parts; millimetres, seen from the tip."""

from __future__ import annotations

from math import cos, degrees, hypot, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from .robot import Robot
from .section import NotchedTube, PlainRod
from .tendon import Tendon

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, QUIET, NEUTRAL, TENDON, FILL = "#1a1a1a", "#6b7280", "#c2410c", "#1d4ed8", "#b9c3d0"
MM = 1e3
_LISTED = 6  # places of tendons that fit beside the section


def draw_section(axes: Axes, robot: Robot) -> None:
    """Draw the section in its own frame: x to the right, y up, the tube's axis or the rod's axis at the origin."""
    if isinstance(robot.body, NotchedTube):
        _tube_section(axes, robot, robot.body)
    elif isinstance(robot.body, PlainRod):
        _rod_section(axes, robot, robot.body)


def rod_radius(rod: PlainRod) -> float:
    """Radius to draw (mm): the rod's own, or that of a circle of the same area."""
    return MM * (sqrt(rod.section.A / pi) if rod.radius is None else rod.radius)


def shown_radius(robot: Robot, tendon: Tendon) -> float:
    """Radius to draw for a tendon (mm); one without thickness is drawn thin."""
    body = robot.body
    scale = rod_radius(body) if isinstance(body, PlainRod) else MM * float(robot.outer_radius(0.0)[0])
    return MM * tendon.radius or 0.12 * scale


def _tube_section(axes: Axes, robot: Robot, tube: NotchedTube) -> None:
    r_i, r_o, r_na = MM * tube.inner_radius, MM * tube.outer_radius, MM * tube.section.r_na
    _arc_and_removed_part(axes, tube, r_i, r_o)
    _angle_psi(axes, tube, r_i)
    _frame(axes, -r_na, 0.42 * r_o)
    _tendons(axes, robot, -r_na)
    axes.plot([0], [0], marker="+", ms=7, mew=0.9, color=INK, zorder=6)
    _leader(axes, (0.0, 0.0), (0.14 * r_o, 1.38 * r_o), "tube axis", INK)
    half = min(0.3 * tube.uncut_angle, 0.9)
    edge = (-0.5 * (r_i + r_o) * cos(half), -0.5 * (r_i + r_o) * sin(half))
    _leader(axes, (-r_na, 0.0), (-1.0 * r_o, 1.22 * r_o), "neutral axis\n(centroid)", NEUTRAL)
    _leader(axes, edge, (-1.08 * r_o, -0.98 * r_o), "uncut arc", INK)
    _leader(axes, _on_circle(r_o, 50), (0.85 * r_o, 1.15 * r_o), f"$r_{{out}}$ = {r_o:.4g} mm", INK)
    _leader(axes, _on_circle(r_i, -42), (0.95 * r_o, -1.0 * r_o), f"$r_{{in}}$ = {r_i:.4g} mm", INK)
    _tendon_note(axes, robot, -r_na, r_o)
    _distance(axes, -r_na, 0.0, -1.27 * r_o, f"$r_{{na}}$ = {r_na:.4g} mm")
    axes.set_xlim(-1.8 * r_o, 2.45 * r_o)
    axes.set_ylim(-1.65 * r_o, 1.75 * r_o)


def _arc_and_removed_part(axes: Axes, tube: NotchedTube, r_i: float, r_o: float) -> None:
    from matplotlib.patches import Wedge

    half, width = 0.5 * degrees(tube.uncut_angle), r_o - r_i
    removed = {"fc": "#f6f7f9", "ec": QUIET, "lw": 0.7, "ls": (0, (4, 2)), "zorder": 2}
    axes.add_patch(Wedge((0, 0), r_o, half - 180, 180 - half, width=width, **removed))
    uncut = {"fc": FILL, "ec": INK, "lw": 0.9, "zorder": 3}
    axes.add_patch(Wedge((0, 0), r_o, 180 - half, 180 + half, width=width, **uncut))


def _angle_psi(axes: Axes, tube: NotchedTube, r_i: float) -> None:
    from matplotlib.patches import Arc

    half = 0.5 * tube.uncut_angle
    for angle in (pi - half, pi + half):
        axes.plot([0.0, r_i * cos(angle)], [0.0, r_i * sin(angle)], color=INK, lw=0.6, zorder=4)
    size = 0.62 * r_i
    axes.add_patch(Arc((0, 0), size, size, theta1=180 - degrees(half), theta2=180 + degrees(half), color=INK, lw=0.7))
    _leader(
        axes,
        (0.5 * size * cos(pi + 0.6 * half), 0.5 * size * sin(pi + 0.6 * half)),
        (0.05 * r_i, -0.42 * r_i),
        f"$\\psi$ = {degrees(2 * half):.4g}°",
        INK,
    )


def _frame(axes: Axes, origin: float, size: float) -> None:
    style = {"arrowstyle": "-|>", "color": NEUTRAL, "lw": 1.1, "mutation_scale": 8, "shrinkA": 0, "shrinkB": 0}
    for name, tip, shift in (("$x$", (origin + size, 0.0), (-1, 3)), ("$y$", (origin, size), (4, -2))):
        axes.annotate("", tip, (origin, 0.0), arrowprops=style, zorder=7)
        axes.annotate(name, tip, shift, textcoords="offset points", color=NEUTRAL, va="bottom", zorder=8)
    axes.plot([origin], [0.0], marker="o", ms=3.4, color=NEUTRAL, zorder=8)


def _tendons(axes: Axes, robot: Robot, shift: float) -> None:
    from matplotlib.patches import Circle

    for i, tendon in enumerate(robot.tendons):
        x, y = MM * robot.tendon_position(i, 0.0)[0, :2] + np.array([shift, 0.0])
        axes.add_patch(Circle((x, y), MM * tendon.radius, fc=TENDON, ec="white", lw=0.4, zorder=6))
        axes.plot([x], [y], marker="o", ms=3.2, mew=0.0, color=TENDON, zorder=6)  # a thin one stays visible


def _tendon_note(axes: Axes, robot: Robot, shift: float, reach: float) -> None:
    if robot.n_tendons > 1:
        _numbered_tendons(axes, robot, shift, reach)
        return
    for i, tendon in enumerate(robot.tendons):
        r_x, r_y = MM * robot.tendon_position(i, 0.0)[0, :2]
        lines = ["tendon"]
        lines += [f"$r_t$ = {MM * tendon.radius:.4g} mm"] if tendon.radius else []
        lines += [f"({r_x:.4g}, {r_y:.4g}) mm"] if isinstance(robot.body, PlainRod) else []
        x = r_x + shift
        _leader(axes, (x, r_y), (max(1.25 * reach, x + 0.25 * reach), r_y), "\n".join(lines), TENDON)


def _numbered_tendons(axes: Axes, robot: Robot, shift: float, reach: float) -> None:
    """Every tendon's number beside its place, those at one place together, and a list of the places."""
    at: dict[tuple[float, float], list[str]] = {}
    for i in range(robot.n_tendons):
        x, y = (MM * robot.tendon_position(i, 0.0)[0, :2]).round(4) + 0.0  # no minus zero
        at.setdefault((float(x), float(y)), []).append(str(i + 1))
    lines = [f"{', '.join(numbers)}: ({x:.3g}, {y:.3g})" for (x, y), numbers in at.items()]
    shown = [*lines[:_LISTED], "..."] if len(lines) > _LISTED else lines
    for (x, y), numbers in at.items():
        out = np.array([x + shift, y]) / max(hypot(x + shift, y), 1e-9)
        off = (9.0 * out[0] + (3.0 if abs(out[1]) < 0.3 else 0.0), 9.0 * out[1] + (6.0 if abs(out[1]) < 0.3 else 0.0))
        axes.annotate(
            ", ".join(numbers), (x + shift, y), off, textcoords="offset points", ha="center", va="center",
            color=TENDON, weight="bold", zorder=8,
        )  # fmt: skip
    shown = [line.replace("-", "\u2212") for line in shown]
    left = (1.4 if isinstance(robot.body, PlainRod) else 1.18) * reach
    axes.text(left, 0.0, "\n".join(["tendons (mm)", *shown]), color=TENDON, va="center")


def _rod_section(axes: Axes, robot: Robot, rod: PlainRod) -> None:
    from matplotlib.patches import Circle

    radius, dashed = rod_radius(rod), rod.radius is None
    style = {"fc": FILL, "ec": INK, "lw": 0.9, "ls": (0, (4, 2)) if dashed else "-", "zorder": 3}
    axes.add_patch(Circle((0, 0), radius, **style))
    if rod.inner_radius > 0.0:
        axes.add_patch(Circle((0, 0), MM * rod.inner_radius, fc="white", ec=INK, lw=0.9, zorder=4))
    spread = [hypot(*(MM * robot.tendon_position(i, 0.0)[0, :2])) for i in range(robot.n_tendons)]
    reach = max([radius, *spread])
    _tendons(axes, robot, 0.0)
    _frame(axes, 0.0, 0.62 * reach if spread and reach > 1.5 * radius else 1.4 * radius)
    text = f"$A$ = {1e6 * rod.section.A:.4g} mm$^2$\n(circle of equal area)" if dashed else f"$r$ = {radius:.4g} mm"
    _leader(axes, _on_circle(radius, 215), (-radius - 0.35 * reach, -0.75 * radius - 0.3 * reach), text, INK)
    _tendon_note(axes, robot, 0.0, reach)
    axes.set_xlim(-2.3 * reach, 2.3 * reach)
    axes.set_ylim(-1.45 * reach, 1.45 * reach)


def _on_circle(radius: float, angle_deg: float) -> tuple[float, float]:
    angle = angle_deg * pi / 180.0
    return radius * cos(angle), radius * sin(angle)


def _leader(axes: Axes, point: tuple[float, float], place: tuple[float, float], text: str, colour: str) -> None:
    style = {"arrowstyle": "-", "color": colour, "lw": 0.6, "shrinkA": 1, "shrinkB": 0}
    side = "left" if place[0] > point[0] else "right"
    axes.annotate(text, point, place, arrowprops=style, color=colour, ha=side, va="center", zorder=8)


def _distance(axes: Axes, left: float, right: float, y: float, text: str) -> None:
    for x in (left, right):
        axes.plot([x, x], [-0.05 * abs(y), 1.06 * y], color=INK, lw=0.4, zorder=5)
    style = {"arrowstyle": "<|-|>", "color": INK, "lw": 0.6, "mutation_scale": 5, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (right, y), (left, y), arrowprops=style, zorder=6)
    axes.annotate(
        text, (0.5 * (left + right), y), (0, -4), textcoords="offset points", ha="center", va="top", color=INK
    )
