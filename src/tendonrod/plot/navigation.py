"""Figures of a session: the robot in the phantom at its moments, as the paper's Fig. 9; its numbers in time; a map."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .course import Course, Moment, tip_angle
from .eye import Eye
from .navigation_scene import backdrop, draw_body, draw_levels, draw_section, draw_targets, shown_height
from .style import BLUE, COLOURS, GREEN, INK, MM, PALE, QUIET, VERMILION, WIDTH, labelled, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HALF = 10.5  # mm shown to either side in an axial section, at least
OUTSIDE = "#f7d9cc"  # where the model is outside its range
COLUMNS = 900  # of a line over time: beyond it, readings are drawn as their extremes
KPA = 1e-3


def scenes_figure(found: Course) -> Figure:
    """At each moment: the robot in the phantom, seen from the patient's right and above, and the section at its tip."""
    scene = backdrop(found, Eye())
    left, right, bottom, top = scene.window
    side = (WIDTH - 0.1) / (1.0 + (right - left) / (top - bottom))  # the section is as high as the view
    room = side + 0.54
    with styled():
        figure = new_figure(max(1, len(found.moments)) * room + 0.1)
        for k, moment in enumerate(found.moments):
            low = 1.0 - (k * room + 0.34 + side) / figure.get_figheight()
            tall = side / figure.get_figheight()
            view = figure.add_axes((0.005, low, 1.0 - (side + 0.1) / WIDTH, tall))
            _scene(scene.show(view), scene, moment, found)
            cut = figure.add_axes((1.0 - (side + 0.02) / WIDTH, low, side / WIDTH, tall))
            draw_section(cut, moment.snapshot, found.scenario, section_half(found))
            cut.set_title(gaps_text(moment.snapshot.clearance), size=6.8, weight="normal", loc="right", pad=3.0)
    return figure


def section_half(found: Course) -> float:
    """mm to either side that hold the robot at all moments."""
    reach = [MM * float(np.abs(each.snapshot.tip[:2]).max()) for each in found.moments]
    return max([HALF, *(each + 3.0 for each in reach)])


def _scene(view: Axes, scene, moment: Moment, found: Course) -> None:
    now = moment.snapshot
    draw_targets(view, scene, now, found)
    draw_body(view, scene, now, found)
    draw_levels(view, scene, found)
    view.set_title(f"({moment.letter}) {moment.title}", pad=13.0)  # a line for what happened, however long, then one
    view.annotate(state_text(now), (0.0, 1.0), (0, 3), xycoords="axes fraction", textcoords="offset points", size=6.8)


def state_text(now) -> str:
    """Time and drives in one line."""
    tension = ", ".join(f"{x:.2f}" for x in now.posture.tension)
    turned = f"{round(float(np.degrees(now.rotation)))}".replace("-", "−")
    return f"{now.time:.1f} s   {MM * now.exposed:.1f} mm out   {turned}°   {tension} N"


def gaps_text(clearance: Mapping[str, np.ndarray]) -> str:
    """Clearance at the tip, by structure."""
    gaps = (f"{name} {round(MM * float(gap[-1]), 1) + 0.0:.1f}" for name, gap in clearance.items())
    return f"gap {', '.join(gaps)} mm"


def lines_figure(found: Course) -> Figure:
    """Drives, clearance and pressure over time, with moments, targets, and where the model does not hold."""
    with styled():
        figure = new_figure(7.0)
        panels: Any = figure.subplots(5, 1, sharex=True, height_ratios=(1.0, 1.0, 1.0, 1.5, 1.5))
        figure.subplots_adjust(left=0.085, right=0.985, top=0.955, bottom=0.06, hspace=0.42)
        drives, limits = panels[:3], found.scenario.limits
        _step(drives[0], found.time, MM * found.exposed, BLUE)
        _step(drives[1], found.time, np.degrees(found.rotation), BLUE)
        for i in range(found.tension.shape[1]):
            _step(drives[2], found.time, found.tension[:, i], COLOURS[i % len(COLOURS)])
        _clearances(panels[3], found)
        _pressures(panels[4], found, KPA * limits.pressure)
        texts = ("length out (mm)", "rotation (°)", "tension (N)", "clearance (mm)", "pressure (kPa)")
        titles = ("insertion", "rotation at the outer tube’s exit", "tension",
                  "least clearance of the tube’s wall", "highest contact pressure on soft tissue")  # fmt: skip
        for axes, letter, title, text in zip(panels, "abcde", titles, texts, strict=True):
            titled(axes, letter, title)
            labelled(axes, "", text)
            _shade(axes, found)
            _mark(axes, found)
        _letters(panels[0], found)
        panels[-1].set_xlabel("time of the session (s)")
        panels[-1].set_xlim(found.time[0], max(found.time[-1], found.time[0] + 1e-3))
        figure.align_ylabels(panels)
    return figure


def extremes(time: np.ndarray, values: np.ndarray, columns: int = COLUMNS) -> tuple[np.ndarray, np.ndarray]:
    """Few points of a line that look the same: first, least, largest and last of each of ``columns`` stretches."""
    if time.size <= 4 * columns:
        return time, values
    rows = []
    for part in np.array_split(np.arange(time.size), columns):
        ends = part[0], part[values[part].argmin()], part[values[part].argmax()], part[-1]
        rows += sorted(set(map(int, ends)))
    return time[rows], values[rows]


def _step(axes: Axes, time: np.ndarray, values: np.ndarray, colour: str, **style: Any) -> None:
    axes.plot(*extremes(time, values), color=colour, lw=1.1, **style)


def _clearances(axes: Axes, found: Course) -> None:
    for k, (name, gap) in enumerate(found.clearance.items()):
        _step(axes, found.time, MM * gap, COLOURS[k % len(COLOURS)], label=f"to the {name}")
    axes.axhline(0.0, color=INK, lw=0.7)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=len(found.clearance), columnspacing=1.2)


def _pressures(axes: Axes, found: Course, limit: float) -> None:
    pressure = KPA * found.pressure
    _step(axes, found.time, pressure, BLUE)
    axes.fill_between(
        found.time, limit, pressure, where=(pressure > limit).tolist(), color=VERMILION, alpha=0.35, lw=0.0
    )
    axes.axhline(limit, color=VERMILION, lw=0.9, ls=(0, (4, 2)))
    axes.annotate(f"limit {limit:.1f} kPa, an engineering choice", (0.0, limit), (3, 2), textcoords="offset points",
                  xycoords=("axes fraction", "data"), ha="left", va="bottom", size=6.8, color=VERMILION)  # fmt: skip
    axes.set_ylim(0.0, 1.15 * max(limit * 1.25, float(pressure.max())))


def spans(time: np.ndarray, holds: np.ndarray) -> list[tuple[float, float]]:
    """Stretches of ``time`` (n,) over which ``holds`` (n,); each reading stands for the time since the one before."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    return [(float(time[max(a - 1, 0)]), float(time[b - 1])) for a, b in edges.reshape(-1, 2)]


def _shade(axes: Axes, found: Course) -> None:
    for low, high in spans(found.time, ~found.in_range):
        axes.axvspan(low, high, color=OUTSIDE, lw=0.0, zorder=0.1)
    for low, high in spans(found.time, found.blocked):
        axes.axvspan(low, high, facecolor="none", edgecolor=PALE, hatch="////", lw=0.0, zorder=0.2)


def _mark(axes: Axes, found: Course) -> None:
    for moment in found.moments:
        axes.axvline(moment.snapshot.time, color=QUIET, lw=0.5, ls=(0, (1, 2)), zorder=0.5)
    for _, time in found.reached:
        axes.axvline(time, color=GREEN, lw=1.0, zorder=0.6)


def _letters(axes: Axes, found: Course) -> None:
    last = -np.inf
    width = 0.012 * max(found.duration, 1e-3)
    for moment in found.moments:
        at = max(moment.snapshot.time, last + width)
        last = at
        axes.annotate(moment.letter, (at, 1.0), (0, 2), xycoords=("data", "axes fraction"), size=7.0,
                      textcoords="offset points", ha="center", va="bottom", weight="bold", color=QUIET)  # fmt: skip


def map_figure(found: Course) -> Figure:
    """The spine unrolled: angle around the cord over height; the tip's path, the body at each moment, the targets."""
    z = shown_height(found)
    with styled():
        figure = new_figure(3.6)
        axes = figure.add_axes((0.115, 0.13, 0.87, 0.8))
        path = _unrolled(found.tip)
        axes.plot(*path.T, color=PALE, lw=4.0, solid_capstyle="round", label="path of the tip", zorder=2)
        known = path[np.isfinite(path).all(axis=1)]
        bodies = {moment.letter: _unrolled(moment.snapshot.centerline) for moment in found.moments}
        for k, (letter, body) in enumerate(bodies.items()):
            axes.plot(*body.T, color=COLOURS[k % len(COLOURS)], lw=1.1, zorder=3)
            axes.annotate(letter, body[-1], (4, 0), textcoords="offset points", weight="bold", va="center", zorder=6,
                          color=COLOURS[k % len(COLOURS)])  # fmt: skip
        low, high = min([-60.0, *(known[:, 1] - 40.0)]), max([200.0, *(known[:, 1] + 40.0)])
        _map_targets(axes, found, (low, high))
        _map_frame(axes, found, z, (low, high))
    return figure


def _unrolled(points: np.ndarray) -> np.ndarray:
    """(n, 2): z in mm and angle in degrees without jumps, from -180 on; NaN where the points are."""
    angle, known = tip_angle(points), np.isfinite(points).all(axis=1)
    angle = np.where(known, angle, np.nan)
    if known.any():
        angle[known] = np.unwrap(angle[known])
    return np.stack([MM * points[:, 2], np.degrees(angle)], axis=1)


def _map_targets(axes: Axes, found: Course, span: tuple[float, float]) -> None:
    from matplotlib.patches import Ellipse
    from matplotlib.patheffects import withStroke

    reached = dict(found.reached)
    for name, target in found.scenario.phantom.targets.items():
        x, y, z = (MM * each for each in target.position)
        wide, tall = 2.0 * MM * target.tolerance, np.degrees(2.0 * MM * target.tolerance / np.hypot(x, y))
        at = np.degrees(np.arctan2(y, x))
        for angle in (at - 360.0, at, at + 360.0):
            if span[0] + 0.5 * tall < angle < span[1] - 0.5 * tall:
                done = name in reached
                ring = Ellipse((z, angle), wide, tall, fc=GREEN if done else "none", ec=GREEN, lw=0.9, zorder=4)
                ring.set_alpha(0.6 if done else 1.0)
                axes.add_patch(ring)
                axes.annotate(name.partition("@")[0], (z, angle + 0.5 * tall), (0, 2), textcoords="offset points",
                              size=6.2, color=GREEN, ha="center", va="bottom", clip_on=True,
                              path_effects=[withStroke(linewidth=2.0, foreground="white")], zorder=5)  # fmt: skip


def _map_legend(axes: Axes) -> list[Any]:
    """The tip's path, the bodies at the moments, and what rings mean."""
    from matplotlib.colors import to_rgb
    from matplotlib.lines import Line2D

    ring: Any = {"ls": "", "marker": "o", "mec": GREEN, "ms": 7.0, "mew": 0.9}
    path, _ = axes.get_legend_handles_labels()
    return [
        *path,
        Line2D([], [], color=INK, lw=1.1, label="body at a, b, ..."),
        Line2D([], [], mfc="none", label="target", **ring),
        Line2D([], [], mfc=(*to_rgb(GREEN), 0.6), label="reached", **ring),
    ]


def _map_frame(axes: Axes, found: Course, z: tuple[float, float], span: tuple[float, float]) -> None:
    axes.set(xlim=z, ylim=span)
    names = {0: "dorsal", 90: "right", 180: "ventral", 270: "left"}
    ticks = np.arange(np.ceil(span[0] / 90.0), np.floor(span[1] / 90.0) + 1.0) * 90.0
    axes.set_yticks(ticks, [f"{names[int(each) % 360]} {int(each)}°".replace("-", "−") for each in ticks])
    labelled(axes, "z, towards the head (mm)", "")
    axes.set_title("around the cord, unrolled")
    for level in found.scenario.phantom.levels:
        low, high = max(z[0], MM * level.z_low), min(z[1], MM * level.z_high)
        if high > low:
            axes.axvspan(low, high, color="#f3f4f6", lw=0.0, zorder=0.1)
            axes.annotate(level.name, (0.5 * (low + high), 0.0), (0, 3), xycoords=("data", "axes fraction"),
                          textcoords="offset points", size=7.0, color=QUIET, ha="center", va="bottom")  # fmt: skip
    axes.legend(handles=_map_legend(axes), loc="lower right", bbox_to_anchor=(1.01, 0.98), ncols=4, columnspacing=1.2)
