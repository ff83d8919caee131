"""Chapter: the four prototypes, their section numbers and limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from math import degrees
from types import MappingProxyType

import numpy as np

from ..device import notched_tube
from ..device_figure import draw_device
from ..robot import Robot
from ..section import TORSION_MODELS, NotchedTube
from ..statics.limits import euler_loads
from ..statics.tension_limits import Limit, tension_limits
from . import paper
from .chapter import Cell, Chapter, Number, Picture, Table, listed, title_of

_G = float(np.linalg.norm(paper.GRAVITY))  # m/s2
DRAWN = ("exonav-1", "exonav-3")  # one of each tube


def chapter(robots: Sequence[Robot]) -> Chapter:
    """Section table, table of limits, and a drawing of each of the two tubes."""
    return Chapter(
        name="devices",
        title="The prototypes",
        tables=(_section_table(robots), _limit_table(robots)),
        pictures=[_drawing(robot) for robot in robots if robot.name in DRAWN],
        facts={
            "lift_off_3": _at(limits_of(robots[2])["tendon lift-off"]),
            "torsion_ratio": listed(Number(ratio, 0) for ratio in _torsion_ratios(robots)),
        },
    )


@cache
def limits_of(robot: Robot) -> Mapping[str, Limit]:
    """Limits of the one tendon by name; found once per robot, since several chapters ask and each takes a search."""
    return MappingProxyType({limit.name: limit for limit in tension_limits(robot)})


def torsion_stiffness(robot: Robot, model: str) -> float:
    """Torsion stiffness (N m2) of ``robot`` with another torsion model."""
    return robot.replace(torsion=model).section.torsion_stiffness


def _torsion_ratios(robots: Sequence[Robot]) -> list[float]:
    """How much stiffer the published torsion is than the homogenized one, per prototype."""
    return [torsion_stiffness(robot, "published") / torsion_stiffness(robot, "homogenized") for robot in robots]


def _drawing(robot: Robot) -> Picture:
    return Picture(
        name=f"device-{robot.name}",
        draw=partial(draw_device, robot),
        inline=".png",
    )


_ROWS: tuple[tuple[str, int, Callable[[Robot, NotchedTube], float]], ...] = (
    ("uncut angle <i>ψ</i> (deg)", 0, lambda robot, tube: degrees(tube.uncut_angle)),
    ("inner radius <i>r</i><sub>in</sub> (mm)", 3, lambda robot, tube: 1e3 * tube.inner_radius),
    ("outer radius <i>r</i><sub>out</sub> (mm)", 3, lambda robot, tube: 1e3 * tube.outer_radius),
    ("length <i>L</i> (mm)", 2, lambda robot, tube: 1e3 * tube.length),
    ("notch width <i>w</i> (mm)", 1, lambda robot, tube: 1e3 * tube.notch_width),
    ("notch spacing <i>d</i> (mm)", 1, lambda robot, tube: 1e3 * tube.notch_spacing),
    ("area of the arc <i>A</i> (mm²)", 5, lambda robot, tube: 1e6 * robot.section.A),
    ("neutral axis to tube axis <i>r</i><sub>na</sub> (mm)", 5, lambda robot, tube: 1e3 * robot.section.r_na),
    ("length of the neutral axis <i>L</i><sub>na</sub> (mm)", 3, lambda robot, tube: 1e3 * robot.section.L_na),
    ("<i>I</i><sub>x</sub> (mm⁴)", 7, lambda robot, tube: 1e12 * robot.section.I_x),
    ("<i>I</i><sub>y</sub> (mm⁴)", 7, lambda robot, tube: 1e12 * robot.section.I_y),
    ("<i>EI</i><sub>x</sub> (N mm²)", 1, lambda robot, tube: 1e6 * robot.section.Kbt[0]),
    ("<i>EI</i><sub>y</sub>, towards the tendon (N mm²)", 2, lambda robot, tube: 1e6 * robot.section.Kbt[1]),
    *(
        (f"torsion, {model} (N mm²)", 2, lambda robot, tube, model=model: 1e6 * torsion_stiffness(robot, model))
        for model in TORSION_MODELS
    ),
    ("line density <i>λ</i> (g/m)", 4, lambda robot, tube: 1e3 * robot.section.line_density),
    ("weight (mN)", 3, lambda robot, tube: 1e3 * _G * robot.section.line_density * robot.section.L_na),
)


def _section_table(robots: Sequence[Robot]) -> Table:
    rows = [
        [title, *(Number(of(robot, notched_tube(robot)), digits) for robot in robots)] for title, digits, of in _ROWS
    ]
    return Table(
        name="sections",
        header=("", *(title_of(robot.name) for robot in robots)),
        rows=rows,
    )


def _limit_table(robots: Sequence[Robot]) -> Table:
    by_robot = [limits_of(robot) for robot in robots]
    euler = [euler_loads(robot) for robot in robots]
    rows = [
        ["tendon on the wall from (N)", *(_at(limits["tendon lift-off"]) for limits in by_robot)],
        ["superelastic plateau, 0.67 % strain (N)", *(_at(limits["plateau"]) for limits in by_robot)],
        [
            "recoverable strain, 6 % (N, beyond the linear model)",
            *(_at(limits["recoverable strain"]) for limits in by_robot),
        ],
        ["notches closed (N, beyond the linear model)", *(_at(limits["notch closure"]) for limits in by_robot)],
        ["curvature that closes the notches (1/m)", *(Number(limits["notch closure"].value, 0) for limits in by_robot)],
        [
            "Euler load of the extended robot, softer bending stiffness alone: lower bound (mN)",
            *(Number(1e3 * low, 1) for low, _ in euler),
        ],
        [
            "Euler load if the section turned many times, harmonic mean of both stiffnesses (mN)",
            *(Number(1e3 * high, 1) for _, high in euler),
        ],
    ]
    return Table(
        name="limits",
        header=("", *(title_of(robot.name) for robot in robots)),
        rows=rows,
    )


def _at(limit: Limit) -> Cell:
    return "not reached" if limit.tension is None else Number(limit.tension, 3 if limit.tension < 10 else 1)
