"""`branch_figure`: the bifurcation diagram of a branch of equilibria, and the bodies along it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput, one_of
from ..statics.branches import Branch, Critical, Fold
from .style import BLUE, INK, MM, PALE, QUIET, VERMILION, draw, labelled, new_figure, reading_unit, styled, titled
from .views import ABOVE, SIDE, TIP, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FINE = 12  # pieces of the drawn line between two points
BODIES = 14  # drawn at most, beside those at folds and bifurcations
SAMPLES = 81  # of a body
CHOICES = ("x", "y", "z", "deflection")
_UNITS = {
    "tensions": ("tension of tendon {}", "N", 1.0), "displacements": ("pulled length of tendon {}", "mm", 1e3),
    "tip_force": ("tip force $F_{}$", "N", 1.0), "tip_moment": ("tip moment $M_{}$", "N m", 1.0),
    "gravity": ("gravity $g_{}$", "m/s²", 1.0), "distributed_force": ("line force $f_{}$", "N/m", 1.0),
    "distributed_moment": ("line moment $l_{}$", "N m/m", 1.0), "insertion": ("insertion η", "-", 1.0),
    "rotation": ("rotation", "deg", 180.0 / np.pi),
}  # fmt: skip


def branch_figure(
    branch: Branch, tip: str | None = None, label: str | None = None, factor: float | None = None
) -> Figure:
    """Figure of a `Branch`: (a) a coordinate of the tip over the parameter, (b) bodies along the branch.

    Stable equilibria are drawn solid, unstable ones dashed; folds and bifurcations are marked with their values; an
    arrow shows where the robot snaps to, if that place lies on the branch. Where the loads have no potential nothing is
    said of stability.

    - tip: "x", "y", "z" or "deflection", the distance from the tip at the start; None: the coordinate that changes
      most, the deflection where all hardly change.
    - label: of the parameter, with its unit, and ``factor`` by which it is multiplied; None: from its name.

    Raises `InvalidInput` by name.
    """
    if not isinstance(branch, Branch):
        raise InvalidInput("branch", branch, "a Branch")
    chosen = _telling(branch) if tip is None else one_of("tip", tip, CHOICES)
    text, scale = parameter_label(branch.name)
    text, scale = text if label is None else label, scale if factor is None else factor
    with styled():
        figure = new_figure(3.6)
        _diagram(figure.add_axes((0.095, 0.135, 0.49, 0.735)), branch, chosen, text, scale)
        _bodies(figure.add_axes((0.675, 0.135, 0.315, 0.735)), branch)
        figure.legend(handles=_legend(branch), loc="upper left", bbox_to_anchor=(0.005, 1.0), ncols=6, handlelength=2.2)
    return figure


def _telling(branch: Branch) -> str:
    moved = np.ptp(branch.tip, axis=0)
    return "xyz"[int(moved.argmax())] if moved.max() > 1e-3 * np.abs(branch.tip).max() else "deflection"


def parameter_label(name: str) -> tuple[str, float]:
    """(text with its unit, factor) for a parameter named as for `tendonrod.Shape.jacobian`."""
    stem, _, rest = name.partition("[")
    if stem in _UNITS:
        words, unit, factor = _UNITS[stem]
        index = int(rest.removesuffix("]")) if rest else 0
        return f"{words.format(index + 1 if 'tendon' in words else 'xyz'[index])} ({unit})", factor
    return ("parameter t (-)" if name == "t" else f"{name} (SI)"), 1.0


def curve(branch: Branch, tip: str) -> tuple[np.ndarray, np.ndarray]:
    """(parameter, tip in m), each (k - 1, FINE + 1): cubic pieces that leave and meet the points along the branch."""
    height, slope = _height(branch, tip), _height_slope(branch, tip)
    u = np.linspace(0.0, 1.0, FINE + 1)
    h = np.diff(branch.arclength)[:, None]
    basis = (1 + 2 * u) * (1 - u) ** 2, u * (1 - u) ** 2, u**2 * (3 - 2 * u), u**2 * (u - 1)

    def pieces(value: np.ndarray, by: np.ndarray) -> np.ndarray:
        ends = value[:-1, None], h * by[:-1, None], value[1:, None], h * by[1:, None]
        return sum(b * e for b, e in zip(basis, ends, strict=True))  # pyright: ignore[reportReturnType]

    return pieces(branch.parameter, branch.slope), pieces(height, slope)


def _height(branch: Branch, tip: str) -> np.ndarray:
    if tip != "deflection":
        return branch.tip[:, "xyz".index(tip)]
    return np.linalg.norm(branch.tip - branch.tip[0], axis=1)


def _height_slope(branch: Branch, tip: str) -> np.ndarray:
    if tip != "deflection":
        return branch.tip_slope[:, "xyz".index(tip)]
    away = branch.tip - branch.tip[0]
    size = np.linalg.norm(away, axis=1)
    along = (away * branch.tip_slope).sum(axis=1)
    return np.divide(along, size, out=np.linalg.norm(branch.tip_slope, axis=1), where=size > 1e-9 * size.max())


def stretches(branch: Branch) -> list[tuple[slice, bool | None]]:
    """(pieces of the curve, whether they are stable), as long as they can be."""
    if branch.negative is None:
        return [(slice(0, len(branch) - 1), None)]
    after = branch.negative.copy()
    for each in _critical(branch):
        if each.negative is not None:
            after[each.index] = each.negative[1]
    stable = after[:-1] == 0
    edges = [0, *(np.flatnonzero(np.diff(stable)) + 1).tolist(), len(stable)]
    return [(slice(a, b), bool(stable[a])) for a, b in pairwise(edges)]


def _critical(branch: Branch) -> list[Critical]:
    return sorted([*branch.folds, *branch.bifurcations], key=lambda each: each.index)


def _line(stable: bool | None) -> dict[str, Any]:
    if stable is None:
        return {"color": QUIET, "lw": 1.4}
    return {"color": BLUE, "lw": 1.8} if stable else {"color": VERMILION, "lw": 1.4, "ls": (0, (3.5, 1.8))}


def _mark(each: Critical) -> dict[str, Any]:
    return {
        "ls": "",
        "marker": "o" if isinstance(each, Fold) else "D",
        "ms": 5.0,
        "mfc": "white",
        "mec": INK,
        "mew": 1.1,
    }


def _diagram(axes: Axes, branch: Branch, tip: str, text: str, scale: float) -> None:
    t, height = curve(branch, tip)
    length, factor = reading_unit(np.abs(height).max())
    height = factor * height
    for pieces, stable in stretches(branch):
        axes.plot(scale * t[pieces].ravel(), height[pieces].ravel(), **_line(stable))
    heights = factor * _height(branch, tip)
    axes.plot(scale * branch.parameter[0], heights[0], marker="o", ms=4.0, color=INK, ls="", zorder=4)
    for each in branch.folds:
        _snap(axes, branch, each, t, height, scale)
    unit, ends = text.rpartition("(")[2].removesuffix(")"), np.sort(scale * t.ravel()[[t.argmin(), t.argmax()]])
    room = np.array([0.06, 0.06])  # of the width, left and right
    for each in _critical(branch):
        x = scale * each.parameter
        axes.plot(x, heights[each.index], zorder=4, **_mark(each))
        right = _label_right(branch, each, scale)
        words = f"{x:.5g}{f' {unit}' if unit != '-' else ''}".replace("-", "\u2212", 1)
        axes.annotate(
            words, (x, heights[each.index]), (7.0 if right else -7.0, 0.0), textcoords="offset points",
            ha="left" if right else "right", va="center", size=7.5, color=INK,
        )  # fmt: skip
        free = abs(ends[int(right)] - x) / np.ptp(ends)
        room[int(right)] = max(room[int(right)], 0.36 - free)
    axes.set_xlim(ends[0] - room[0] * np.ptp(ends), ends[1] + room[1] * np.ptp(ends))
    axes.margins(y=0.10)
    axes.ticklabel_format(axis="y", useOffset=False)
    name = "distance of the tip from the start" if tip == "deflection" else f"{tip} of the tip"
    labelled(axes, text, f"{name} ({length})")
    titled(axes, "a", f"{branch.robot.name}: branch of equilibria")


def _label_right(branch: Branch, each: Critical, scale: float) -> bool:
    """Whether the text stands to the right: beside a fold where the branch does not go, else on the wider side."""
    if isinstance(each, Fold):
        return bool(branch.slope[max(each.index - 1, 0)] * scale > 0.0)
    return bool(scale * (2.0 * each.parameter - branch.parameter.min() - branch.parameter.max()) < 0.0)


def _snap(axes: Axes, branch: Branch, fold: Fold, t: np.ndarray, height: np.ndarray, scale: float) -> None:
    """An arrow from a fold where stability ends to a stable equilibrium of the branch at the same parameter."""
    if fold.negative is None or min(fold.negative) > 0:
        return
    for pieces, stable in stretches(branch):
        near = pieces.start <= fold.index <= pieces.stop
        if not stable or near:
            continue
        along, up = t[pieces].ravel(), height[pieces].ravel()
        crossed = np.flatnonzero((along[:-1] - fold.parameter) * (along[1:] - fold.parameter) <= 0.0)
        if crossed.size:
            k = crossed[0]
            share = (fold.parameter - along[k]) / (along[k + 1] - along[k] or 1.0)
            to, x = up[k] + share * (up[k + 1] - up[k]), scale * fold.parameter
            start = height[fold.index - 1, -1] if fold.index else height[0, 0]
            arrow = {
                "arrowstyle": "-|>",
                "color": QUIET,
                "lw": 0.9,
                "ls": (0, (1, 1.5)),
                "shrinkA": 5.0,
                "shrinkB": 1.0,
            }
            axes.annotate("", (x, to), (x, start), arrowprops=arrow)
            return


def _bodies(axes: Axes, branch: Branch) -> None:
    special = {each.index: each for each in _critical(branch)}
    even = np.searchsorted(branch.arclength, np.linspace(0.0, branch.arclength[-1], BODIES))
    shown = sorted({*even.tolist(), *special, 0, len(branch) - 1})
    shapes = {i: branch.shape(i) for i in shown}
    bodies = {i: MM * each.at(np.linspace(0.0, each.length, SAMPLES)).centerline for i, each in shapes.items()}
    view = _widest(np.concatenate(list(bodies.values())))
    view.prepare(axes)
    for i, body in bodies.items():
        if i in special:
            line = {"color": INK, "lw": 1.2}
        elif branch.stable is None:
            line = {"color": PALE, "lw": 1.0}
        else:
            line = {**_line(bool(branch.stable[i])), "lw": 0.9, "alpha": 0.55}
        draw(axes, view.project(body), zorder=3 if i in special else 2, **line)
    for i, each in special.items():
        axes.plot(*view.project(bodies[i][-1:]).T, zorder=4, **_mark(each))
    draw(axes, view.project(bodies[0]), color=INK, lw=1.8, zorder=3)
    axes.plot(*view.project(bodies[0][-1:]).T, marker="o", ms=4.0, color=INK, ls="", zorder=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.locator_params(nbins=5)
    titled(axes, "b", f"bodies, {view.title}")


def _widest(points: np.ndarray) -> View:
    """The view along the axis in which the bodies extend least."""
    return (ABOVE, SIDE, TIP)[int(np.ptp(points, axis=0).argmin())]


def _legend(branch: Branch) -> list[Any]:
    from matplotlib.lines import Line2D

    found = dict.fromkeys(stable for _, stable in stretches(branch))
    names = {True: "stable", False: "unstable", None: "equilibria"}
    handles = [Line2D([], [], label=names[stable], **_line(stable)) for stable in sorted(found, key=str, reverse=True)]
    handles.append(Line2D([], [], label="start", marker="o", ms=4.0, color=INK, ls=""))
    for kind, several in (("fold", branch.folds), ("bifurcation", branch.bifurcations)):
        if several:
            handles.append(Line2D([], [], label=kind, **_mark(several[0])))
    return handles
