"""Figures of the tension loop: diagram (the paper's Fig. 7), margins, steps, PI beside PI + feed-forward."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput, numbers
from ..rig.control import KI, KP
from ..rig.design import Loop, phase_margin
from .bench_lines import band, line, look
from .style import BLUE, INK, MM, QUIET, VERMILION, WIDTH, labelled, new_figure, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DASHES = ("-", (0, (4, 1.6)), (0, (1.2, 1.2)))
SMOOTHED = 0.25  # s
EARLY, FEW, MOST = 6.0, 100, 4  # s, bins, traces of one figure
_ERROR = r"$\tau_{FTL} - \tau$ (mN)"
LAGS = np.linspace(0.0, 0.04, 41)  # s


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """A follow-the-leader run over time, all (n,): time s, insertion, tension and target N, velocity m/s of z."""

    time: np.ndarray
    insertion: np.ndarray
    tension: np.ndarray
    target: np.ndarray
    velocity: np.ndarray

    def __post_init__(self) -> None:
        for name in vars(self):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        if len({array.shape for array in vars(self).values()}) != 1 or numbers("time", self.time).size < 2:
            raise InvalidInput(
                "trace", [array.shape for array in vars(self).values()], "arrays of one length, 2 or more"
            )

    @property
    def error(self) -> np.ndarray:
        """target - tension, N."""
        return self.target - self.tension

    @property
    def rms(self) -> float:
        """Root mean square of the error over time, N."""
        return float(np.sqrt(np.trapezoid(self.error**2, self.time) / np.ptp(self.time)))

    def smoothed(self, values: np.ndarray) -> np.ndarray:
        """Running mean of ``values`` (n,) over ``SMOOTHED`` seconds, for the eye."""
        window = min(max(1, round(SMOOTHED * self.time.size / np.ptp(self.time))), self.time.size)
        kernel = np.ones(window)
        return np.convolve(values, kernel, "same") / np.convolve(np.ones(values.size), kernel, "same")

    @property
    def largest(self) -> float:
        """Largest error either way, N."""
        return float(np.abs(self.error).max())


def comparison_figure(traces: Mapping[str, Trace]) -> Figure:
    """Runs of one profile, such as PI and PI + feed-forward: error of each, their means, their first seconds.

    rms and largest errors are those of the samples. Raises `InvalidInput` for none, or more than a row holds.
    """
    if not 1 <= len(traces) <= MOST:
        raise InvalidInput("traces", list(traces), f"1 to {MOST} Traces by name")
    with styled():
        figure, names = new_figure(6.2), list(traces)
        grid: Any = figure.add_gridspec(3, 2, left=0.085, right=0.985, top=0.955, bottom=0.07, hspace=0.42, wspace=0.2)
        row = grid[0, :].subgridspec(1, len(names), wspace=0.08).subplots(sharey=True, squeeze=False)[0]
        for axes, letter, name in zip(row, "abcd", names, strict=False):
            _scatter(axes, traces[name])
            titled(axes, letter, f"{name}: error")
        means, early, speed = (figure.add_subplot(place) for place in (grid[1, :], grid[2, 0], grid[2, 1]))
        for k, trace in enumerate(traces.values()):
            _beside(means, early, speed, trace, look(k, names))
        letters = "abcdefg"[len(names) :]
        titled(means, letters[0], "means of the error over the insertion")
        titled(early, letters[1], f"the first {EARLY:g} s: error")
        titled(speed, letters[2], f"the first {EARLY:g} s: translation")
        for axes in (*row, means):
            labelled(axes, "insertion η", _ERROR if axes in (row[0], means) else "")
        labelled(early, "time (s)", _ERROR)
        labelled(speed, "time (s)", "velocity (mm/s)")
        means.legend(loc="upper right", ncols=len(names))
    return figure


def _scatter(axes: Axes, trace: Trace) -> None:
    """Band and means of the error's readings."""
    band(axes, [trace.insertion], [MM * trace.error])
    axes.plot(*line(trace.insertion, MM * trace.error), color=INK, lw=0.8)
    told = f"rms {MM * trace.rms:.1f} mN, largest {MM * trace.largest:.1f} mN"
    axes.text(0.985, 0.98, told, size=7.5, ha="right", va="top", transform=axes.transAxes)
    axes.margins(y=0.22)


def _beside(means: Axes, early: Axes, speed: Axes, trace: Trace, style: dict[str, Any]) -> None:
    """One trace in the panels that all share."""
    means.plot(*line(trace.insertion, MM * trace.error, FEW), **style)
    is_early = trace.time <= trace.time[0] + EARLY
    for axes, values in ((early, trace.error), (speed, trace.velocity)):
        axes.plot(trace.time[is_early] - trace.time[0], MM * trace.smoothed(values)[is_early], **style)
    for axes in (means, early):
        axes.axhline(0.0, color=QUIET, lw=0.6)


def margins_figure(paper: Sequence[Loop], chosen: Sequence[Loop], insertion: Sequence[float]) -> Figure:
    """Open loop at several insertions, with the paper's gains and with others; phase margin against the lag."""
    with styled():
        figure = new_figure(4.6)
        grid: Any = figure.subplots(2, 2, sharex="col", width_ratios=(1.25, 1.0))
        figure.subplots_adjust(left=0.085, right=0.985, top=0.94, bottom=0.10, hspace=0.34, wspace=0.24)
        for loops, dashes in ((paper, DASHES[0]), (chosen, DASHES[1])):
            for k, (loop, eta) in enumerate(zip(loops, insertion, strict=True)):
                look = {"color": _shade(k, len(loops)), "ls": dashes, "lw": 1.1}
                _bode(grid[:, 0], loop, f"η = {eta:g}" if loops is paper else None, look)
        for axes, loops, letter, name in zip(
            grid[:, 1], (paper, chosen), "cd", _gain_names(paper, chosen), strict=True
        ):
            _against_lag(axes, loops)
            titled(axes, letter, f"margin, {name}")
        grid[1, 1].set_xlabel("lag of the actuator (ms)")
        titled(grid[0, 0], "a", "open loop: solid as in (c), dashed as in (d)")
        titled(grid[1, 0], "b", "its phase, delay included")
        labelled(grid[0, 0], "", "|L|").legend(loc="lower left", ncols=2)
        labelled(grid[1, 0], "ω (rad/s)", "phase (deg)")
    return figure


def step_figure(paper: Sequence[Loop], chosen: Sequence[Loop], insertion: Sequence[float], rate: float) -> Figure:
    """Tension after a step of its target, and its error after the screw has started at ``rate`` (m/s)."""
    time = np.linspace(0.0, 1.5, 751)
    with styled():
        figure = new_figure(4.8)
        grid: Any = figure.subplots(2, 2, sharex=True, sharey="row")
        figure.subplots_adjust(left=0.085, right=0.985, top=0.94, bottom=0.095, hspace=0.34, wspace=0.10)
        for column, loops, name in zip(grid.T, (paper, chosen), _gain_names(paper, chosen), strict=True):
            for k, (loop, eta) in enumerate(zip(loops, insertion, strict=True)):
                look = {"color": _shade(k, len(loops)), "lw": 1.1}
                column[0].plot(time, loop.step(time), label=f"η = {eta:g}", **look)
                column[1].plot(time, MM * rate * loop.step(time, "screw"), **look)
                column[1].plot(time, MM * rate * loop.step(time, "screw", 1.0), **look | {"ls": DASHES[2]})
            titled(column[0], "ab"[loops is chosen], f"step of the target, {name}")
            titled(column[1], "cd"[loops is chosen], f"screw starts at {MM * rate:g} mm/s")
            column[1].set_xlabel("time (s)")
        labelled(grid[0, 0], "", "tension / step (-)").legend(loc="lower right", ncols=2)
        labelled(grid[1, 0], "time (s)", "tension error (mN)")
        grid[1, 1].legend(handles=_ahead_legend(), loc="upper right")
    return figure


def loop_diagram() -> Figure:
    """The loop as the paper's Fig. 7 has it: the screw sets the pace, PI drives translation, rotation follows eta."""
    with styled():
        figure = new_figure(3.0)
        axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(0.0, WIDTH), ylim=(0.0, 3.0))
        axes.axis("off")
        for middle, text, width in _BLOCKS:
            _block(axes, middle, text, width)
        for middle in (_SUM, _AHEAD):
            axes.plot(*middle, marker="o", ms=11, mfc="white", mec=INK, mew=0.9)
        for path, label, at, *style in _WIRES:
            _wire(axes, np.array(path), label, at, *style)
        for x, y, sign in ((0.86, 1.44, "+"), (1.15, 1.06, "−"), (2.86, 1.44, "+"), (3.13, 1.60, "+")):
            axes.text(x, y, sign, ha="center", va="center", size=8.5)
    return figure


_SUM, _AHEAD = (1.05, 1.30), (3.00, 1.30)
_BLOCKS = (  # middle (inches), text, width
    ((0.42, 1.30), "profile\n$\\tau_{FTL}(\\eta)$", 0.66),
    ((2.02, 1.30), "PI, limits,\nanti-windup", 0.98),
    ((3.78, 1.30), "roller gear:\ntranslation", 1.00),
    ((5.62, 1.30), "robot and\ntendon", 1.00),
    ((3.78, 2.55), "lead screw,\nsteady rate", 1.00),
    ((2.02, 2.55), "÷ tendon paid out\nper translation", 1.24),
    ((3.78, 0.42), "load cell", 1.00),
    ((4.46, 1.92), "roller gear: rotation\n$2\\pi\\,$turns$\\,(\\eta-1)$ + plan", 1.50),
)
_FORWARD = ((1.40, 2.55), (1.22, 2.55), (1.22, 1.92), (3.00, 1.92), (3.00, 1.41))
_WIRES: tuple[Any, ...] = (  # corners, text, where it stands, 1 where the wire is optional
    (((0.75, 1.30), (0.94, 1.30)), "", None),
    (((1.16, 1.30), (1.53, 1.30)), "$e$", (1.33, 1.41)),
    (((2.51, 1.30), (2.89, 1.30)), "", None),
    (((3.11, 1.30), (3.28, 1.30)), "", None),
    (((4.28, 1.30), (5.12, 1.30)), "$z$", (4.98, 1.41)),
    (((6.12, 1.30), (7.05, 1.30)), r"$\tau$", (6.92, 1.41)),
    (((6.55, 1.30), (6.55, 0.42), (4.28, 0.42)), "", None),
    (((3.28, 0.42), (1.05, 0.42), (1.05, 1.19)), r"measured $\tau$", (2.10, 0.53)),
    (((4.28, 2.55), (5.90, 2.55), (5.90, 1.56)), "$x_t$: tendon paid out", (5.05, 2.66)),
    (((4.60, 1.30), (4.60, 0.90), (0.42, 0.90), (0.42, 1.04)), r"$\eta = z\,/\,L$", (2.10, 0.80)),
    (((4.60, 1.30), (4.60, 1.69)), "", None),
    (((5.21, 1.92), (5.45, 1.92), (5.45, 1.56)), r"$\varphi$", (5.58, 1.75)),
    (((3.28, 2.55), (2.64, 2.55)), "", None, 1),
    (_FORWARD, "feed-forward, off by default", (2.11, 2.02), 1),
)  # fmt: skip


def _block(axes: Axes, middle, text: str, width: float) -> None:
    from matplotlib.patches import FancyBboxPatch

    x, y = middle
    low, style = (x - 0.5 * width, y - 0.26), "round,pad=0,rounding_size=0.05"
    axes.add_patch(FancyBboxPatch(low, width, 0.52, boxstyle=style, fc="#f2f5f8", ec=INK, lw=0.9))
    axes.text(x, y, text, ha="center", va="center", size=7.6)


def _wire(axes: Axes, path: np.ndarray, label: str, at, is_optional: int = 0) -> None:
    colour, dashes = (VERMILION, (0, (3, 2))) if is_optional else (INK, "-")
    axes.plot(*path.T, color=colour, lw=0.9, ls=dashes, solid_joinstyle="miter", zorder=0)
    arrow = {"arrowstyle": "-|>", "color": colour, "lw": 0.9, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}
    near = path[-1] - 0.02 * (path[-1] - path[-2]) / np.linalg.norm(path[-1] - path[-2])
    axes.annotate("", path[-1], near, arrowprops=arrow)
    if label:
        axes.text(at[0], at[1], label, ha="center", va="center", size=7.6, color=colour)


def _bode(panels, loop: Loop, label: str | None, look: dict[str, Any]) -> None:
    omega = np.geomspace(0.3, 300.0, 400)
    response = loop.open(omega)
    panels[0].loglog(omega, np.abs(response), label=label, **look)
    panels[1].semilogx(omega, np.degrees(np.unwrap(np.angle(response))), **look)
    for axes, level in zip(panels, (1.0, -180.0), strict=True):
        axes.axhline(level, color=QUIET, lw=0.6)
    panels[1].set(ylim=(-270.0, -70.0), yticks=(-270, -225, -180, -135, -90))


def _against_lag(axes: Axes, loops: Sequence[Loop]) -> None:
    from dataclasses import replace

    for k, loop in enumerate(loops):
        phases = [phase_margin(replace(loop, lag=float(lag))) for lag in LAGS]
        axes.plot(MM * LAGS, phases, color=_shade(k, len(loops)), lw=1.1)
        axes.plot(MM * loop.lag, phase_margin(loop), "o", color=_shade(k, len(loops)))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    labelled(axes, "", "phase margin (deg)").set_ylim(-20.0, 95.0)


def _gain_names(paper: Sequence[Loop], chosen: Sequence[Loop]) -> list[str]:
    texts = [f"$k_P$ = {MM * loops[0].kp:.3g}, $k_I$ = {MM * loops[0].ki:.3g}" for loops in (paper, chosen)]
    is_papers = (paper[0].kp, paper[0].ki) == (KP, KI)
    return [texts[0] + (" (paper)" if is_papers else ""), texts[1]]


def _ahead_legend() -> list[Any]:
    from matplotlib.lines import Line2D

    named = (("PI", DASHES[0]), ("PI + feed-forward", DASHES[2]))
    return [Line2D([], [], color=INK, lw=1.1, ls=dashes, label=name) for name, dashes in named]


def _shade(k: int, count: int) -> Any:
    """From vermilion, the shortest body, to blue."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("", [VERMILION, QUIET, BLUE])(k / max(count - 1, 1))
