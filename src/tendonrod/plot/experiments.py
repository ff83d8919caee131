"""`experiment_figure`: a virtual experiment, what was true and what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput
from ..measurement.bench import Experiment, place_name
from ..measurement.experiment import TrueTrial, field_pose
from ..measurement.trial import Trial
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from .shapes import fine
from .style import COLOURS, INK, MM, QUIET, draw, labelled, new_figure, space, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BODIES = 4  # drawn, from the least tension to the largest
DOT: Any = {"ls": "none", "marker": "o", "ms": 1.8, "mew": 0.0, "alpha": 0.55}


def experiment_figure(experiment: Experiment, true: Sequence[TrueTrial], trials: Sequence[Trial], seed: int) -> Figure:
    """Figure of trials that `measured` gave: (a) bodies and measured sensors in space, (b-d) the sensors by tension.

    Measured positions are put into the world with the true pose of the field; lines are the truth. The grey body is
    the robot at its largest tension as the trials claim it. Raises `InvalidInput` where ``trials``
    are not those of ``true``.
    """
    if [each.name for each in true] != [each.name for each in trials]:
        raise InvalidInput("trials", [each.name for each in trials], f"of the names {[each.name for each in true]}")
    T, driven = field_pose(experiment, seed), experiment.robot.n_tendons > 0
    found = [
        (place, _Track(one, trial, j, T, driven))
        for one, trial in zip(true, trials, strict=True)
        for j, place in enumerate(one.places)
    ]
    places = list(dict.fromkeys(place for place, _ in found))
    colours = {place: QUIET if place is None else COLOURS[(len(places) - 1 - k) % len(COLOURS)]
               for k, place in enumerate(places)}  # fmt: skip
    with styled():
        figure = new_figure(6.0)
        _in_space(figure, experiment, true[-1], [(colours[place], track) for place, track in found])
        for k, name in enumerate("xyz"):
            axes = figure.add_axes((0.085 + 0.325 * k, 0.075, 0.255, 0.31))
            _against_drive(axes, k, [(colours[place], track) for place, track in found if place is not None])
            labelled(axes, "measured tension (N)" if driven else "time (s)", f"{name} (mm)")
            titled(axes, "bcd"[k], f"{name} of the sensors, world")
        where: Any = {"loc": "upper left", "columnspacing": 1.4, "handletextpad": 0.5}
        figure.legend(handles=_sensor_legend(colours), bbox_to_anchor=(0.005, 0.967), ncols=len(places) + 1, **where)
        figure.legend(handles=_body_legend(driven), bbox_to_anchor=(0.005, 0.937), ncols=2, **where)
    return figure


class _Track:
    """One tracker of one trial: true and measured positions (n, 3) in mm, over the first tendon's tension or time."""

    def __init__(self, true: TrueTrial, trial: Trial, j: int, T: np.ndarray, driven: bool) -> None:
        self.at = true.tensions[:, 0] if driven else true.time
        self.read = np.asarray(trial.tensions)[:, 0] if driven else trial.time
        self.true = MM * true.position[:, j]
        self.measured = MM * (trial.position[:, j] @ T[:3, :3].T + T[:3, 3])
        self.measured[~trial.kept[:, j]] = np.nan


def _in_space(figure: Figure, experiment: Experiment, true: TrueTrial, tracks: list[tuple[str, _Track]]) -> None:
    shown = _shown(true)
    bodies = [MM * fine(shape).centerline for shape in shown]
    believed = MM * fine(_believed(experiment, shown[-1])).centerline
    dots = np.concatenate([track.measured for _, track in tracks])
    axes = space(figure, (0.0, 0.45, 1.0, 0.44), [*bodies, believed, dots[np.isfinite(dots).all(axis=1)]])
    draw(axes, believed, color=QUIET, lw=1.4, ls=(0, (3, 1.5)))
    for k, path in enumerate(bodies):
        draw(axes, path, color=INK, lw=0.8 + 1.2 * (k + 1) / len(bodies), solid_capstyle="round")
    for colour, track in tracks:
        draw(axes, track.measured, color=colour, **DOT)
    figure.text(0.01, 0.99, f"(a) {experiment.believed.name}: virtual, not measured", weight="bold", size=8.5, va="top")


def _shown(true: TrueTrial) -> list[Shape]:
    """Bodies of the first rise, evenly spread from the least tension to the largest."""
    last = int(true.tensions[:, 0].argmax()) if true.tensions.shape[1] else len(true.shapes) - 1
    return [true.shapes[i] for i in np.unique(np.linspace(0, last, BODIES).round().astype(int))]


def _believed(experiment: Experiment, true: Shape) -> Shape:
    return solve(experiment.believed, true.tensions, experiment.gravity, insertion=true.insertion)


def _against_drive(axes: Axes, k: int, tracks: list[tuple[str, _Track]]) -> None:
    for colour, track in tracks:
        axes.plot(track.read, track.measured[:, k], color=colour, **DOT)
        axes.plot(track.at, track.true[:, k], color=colour, lw=1.0)


def _sensor_legend(colours: dict[float | None, str]) -> list[Any]:
    from matplotlib.lines import Line2D

    dots = [Line2D([], [], color=colour, label=place_name(place), **DOT | {"ms": 4.0, "alpha": 1.0})
            for place, colour in colours.items()]  # fmt: skip
    return [*dots, Line2D([], [], color=QUIET, lw=1.0, label="true place of the sensor, without noise")]


def _body_legend(driven: bool) -> list[Any]:
    from matplotlib.lines import Line2D

    said, last = ("the more tension", "at the largest tension") if driven else ("the later", "at the end")
    bodies = Line2D([], [], color=INK, lw=1.6, label=f"true body, the thicker, {said}")
    return [bodies, Line2D([], [], color=QUIET, lw=1.4, ls=(0, (3, 1.5)), label=f"body as claimed, {last}")]
