"""Chapter: the paper's Table I, and what self-weight, a tilted base or a mass at the tip can explain of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ..robot import Robot
from ..rotation import exp_so3
from ..statics.equilibrium import solve
from . import paper
from .chapter import Cell, Chapter, Number, Picture, Table, interval, listed, mm, short, title_of
from .devices import limits_of
from .figures import gravity_figure
from .results import GravityEffect

TENSIONS = np.linspace(0.0, paper.LARGEST_TENSION, 15)  # N
MODELS = ("published", "open_section")
TILT = np.radians(1.0)
TIP_MASS = 0.5e-3  # kg, of a tracker and its holder
_G = np.array(paper.GRAVITY)


def bounds(name: str) -> np.ndarray:
    """(4,) |RMSE_with - RMSE_without| of Table I, m.

    RMSE is a norm over the measured points; so the two model runs, compared with the same measurements, differ from
    each other by at least this much in the root mean square, and hence somewhere at least by this much.
    """
    with_gravity, without = (
        np.array(table[name]) for table in (paper.RMSE_WITH_GRAVITY_MM, paper.RMSE_WITHOUT_GRAVITY_MM)
    )
    return 1e-3 * np.abs(with_gravity - without)


def effect(robot: Robot) -> GravityEffect:
    """Everything about one prototype."""
    by_model = [robot.replace(torsion=model) for model in MODELS]
    return GravityEffect(
        name=robot.name,
        bound=bounds(robot.name),
        weight=np.array([[self_weight(each, tension) for tension in TENSIONS] for each in by_model]),
        beyond=max(_largest_motion(each) for each in by_model),
        tilt=_tilted(robot),
        mass=np.array([_by_tip_mass(each) for each in by_model]),
    )


def places(robot: Robot) -> np.ndarray:
    """(4,) arc lengths at which the paper measured, m."""
    return robot.length_na * np.array(paper.MEASURED_AT)


def self_weight(robot: Robot, tension: float) -> np.ndarray:
    """(4,) distances between the runs with and without gravity, m."""
    s = places(robot)
    still, heavy = (solve(robot, tension, gravity, s=s) for gravity in ((0.0, 0.0, 0.0), paper.GRAVITY))
    return np.linalg.norm(heavy.position - still.position, axis=1)


def _largest_motion(robot: Robot) -> float:
    end = limits_of(robot)["plateau"].tension or paper.LARGEST_TENSION
    return max(self_weight(robot, tension)[-1] for tension in np.linspace(0.0, end, 25))


def _tilted(robot: Robot) -> np.ndarray:
    """(4,) motion when the base leans by `TILT` towards gravity, about y through p(0); gravity stays in the world."""
    s, turn = places(robot), exp_so3(np.array([0.0, -TILT, 0.0]))
    level = solve(robot, paper.LARGEST_TENSION, paper.GRAVITY, s=s).position
    base = np.array([-robot.section.r_na, 0.0, 0.0])
    leaning = solve(robot, paper.LARGEST_TENSION, tuple(turn.T @ _G), s=s).position
    return np.linalg.norm(base + (leaning - base) @ turn.T - level, axis=1)


def _by_tip_mass(robot: Robot) -> np.ndarray:
    s = places(robot)
    bare, laden = (
        solve(robot, paper.LARGEST_TENSION, paper.GRAVITY, tip_force=tuple(mass * _G), s=s) for mass in (0.0, TIP_MASS)
    )
    return np.linalg.norm(laden.position - bare.position, axis=1)


def chapter(effects: Sequence[GravityEffect]) -> Chapter:
    """Table I with its bounds, what could explain them, and a figure of both."""
    by_name = {each.name: each for each in effects}
    return Chapter(
        name="gravity",
        title="The paper’s Table I: what the printed parameters can and cannot explain",
        tables=(_bound_table(effects), _cause_table(effects)),
        pictures=(
            Picture(
                name="table-1",
                draw=partial(gravity_figure, effects),
            ),
        ),
        facts={
            "bounds": listed(mm(each.bound[-1]) for each in effects),
            "weights": listed(_range(each.weight[..., -1]) for each in effects),
            "beyond": listed(mm(each.beyond) for each in effects),
            "masses": listed(_range(each.mass[:, -1], 1) for each in effects),
            "tilts": listed(f"{Number(each.tilt_needed, 1)}°" for each in effects),
            "ratio_3": Number(by_name["exonav-3"].bound[-1] / by_name["exonav-3"].weight[..., -1].max(), 0),
            "ratio_4": Number(by_name["exonav-4"].bound[-1] / by_name["exonav-4"].weight[..., -1].max(), 0),
            "explained": [short(each.name) for each in effects if each.weight[..., -1].max() >= each.bound[-1]],
            "growth_3": _growth(paper.RMSE_WITHOUT_GRAVITY_MM["exonav-3"]),
            "growth_tilt": _growth(by_name["exonav-3"].tilt),
            "growth_mass": _growth(by_name["exonav-3"].mass[0]),
        },
    )


def _range(metres: np.ndarray, digits: int = 2) -> str:
    return interval(1e3 * np.ravel(metres), digits)


def _growth(along: Sequence[float] | np.ndarray) -> str:
    """Values along s relative to the tip's."""
    return " : ".join(str(Number(float(value) / float(along[-1]), 2)) for value in along)


def _bound_table(effects: Sequence[GravityEffect]) -> Table:
    rows: list[list[Cell]] = []
    for each in effects:
        for k, place in enumerate(paper.MEASURED_AT):
            given = (table[each.name][k] for table in (paper.RMSE_WITHOUT_GRAVITY_MM, paper.RMSE_WITH_GRAVITY_MM))
            weight = [_range(each.weight[model, :, k]) for model in range(len(MODELS))]
            reached = "yes" if each.weight[..., k].max() >= each.bound[k] else "no"
            printed = [Number(value, 2) for value in given]
            rows.append([title_of(each.name), Number(place, 2), *printed, mm(each.bound[k]), *weight, reached])
    return Table(
        name="table-1",
        header=(
            "",
            "<i>s</i> / <i>L</i><sub>na</sub>",
            "<i>printed</i> RMSE, gravity not modelled (mm)",
            "<i>printed</i> RMSE, modelled (mm)",
            "runs differ by at least (mm)",
            "self-weight moves by, published (mm)",
            "open section (mm)",
            "enough?",
        ),
        rows=rows,
    )


def _cause_table(effects: Sequence[GravityEffect]) -> Table:
    rows: list[list[Cell]] = [
        [
            title_of(each.name),
            mm(each.bound[-1]),
            _range(each.weight[..., -1]),
            mm(each.beyond),
            mm(each.tilt[-1]),
            Number(each.tilt_needed, 1),
            _range(each.mass[:, -1]),
        ]
        for each in effects
    ]
    return Table(
        name="causes",
        header=(
            "",
            "demanded at the tip (mm)",
            f"self-weight, 0 – {paper.LARGEST_TENSION:g} N (mm)",
            "self-weight, most up to the plateau (mm)",
            "1° of base tilt (mm)",
            "tilt that would do (deg)",
            "0.5 g at the tip adds (mm)",
        ),
        rows=rows,
    )
