"""Chapters: shape against tension for all prototypes, and the torsion models side by side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ..robot import Robot
from ..section import TORSION_MODELS
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from . import paper
from .chapter import Chapter, Number, Picture, Table, listed, mm, title_of
from .devices import limits_of, torsion_stiffness
from .figures import deflection_figure, fan_figure, torsion_figure
from .results import SWEPT, TENSIONS, Fan

SAMPLES = 121
_STILL = (0.0, 0.0, 0.0)


def fan(robot: Robot) -> Fan:
    """Solve one prototype at all tensions."""
    s = np.linspace(0.0, robot.length_na, SAMPLES)
    still, heavy = (
        tuple(solve(robot, tension, gravity, s=s) for tension in TENSIONS) for gravity in (_STILL, paper.GRAVITY)
    )
    swept = np.linspace(0.0, 4.5, 91)
    shapes = [solve(robot, tension) for tension in swept]
    return Fan(
        robot=robot,
        still=still,
        heavy=heavy,
        swept=swept,
        deflection=np.array([np.linalg.norm(shape.tip - shapes[0].tip) for shape in shapes]),
        radius=np.array([helix_radius(shape) for shape in shapes]),
        lift_off=limits_of(robot)["tendon lift-off"].tension,
        plateau=limits_of(robot)["plateau"].tension,
    )


def helix_radius(shape: Shape) -> float:
    """Radius (m) of the helix that the tube's axis describes; without load only, where the strains are constant."""
    v = shape.v[0] + np.cross(shape.u[0], [shape.robot.section.r_na, 0.0, 0.0])
    return float(np.linalg.norm(np.cross(shape.u[0], v)) / (shape.u[0] @ shape.u[0]))


def bending_chapter(fans: Sequence[Fan]) -> Chapter:
    """Shapes and tips of all prototypes against tension."""
    return Chapter(
        name="bending",
        title="Shape against tension",
        tables=(_tip_table(fans),),
        pictures=(
            Picture(
                name="shapes",
                draw=partial(fan_figure, fans),
            ),
            Picture(
                name="deflection",
                draw=partial(deflection_figure, fans),
            ),
        ),
        facts={"radius_at_plateau": listed(_radius_at_plateau(each) for each in fans)},
    )


def torsion_chapter(robots: Sequence[Robot]) -> Chapter:
    """The three torsion models side by side."""
    still, heavy = ({robot.name: _by_model(robot, gravity) for robot in robots} for gravity in (_STILL, paper.GRAVITY))
    moved = {robot.name: _moved(robot) for robot in robots}
    apart = {
        model: [distance(by_model[model], by_model["published"]) for by_model in still.values()]
        for model in TORSION_MODELS
    }
    sag = [distance(heavy[name]["published"], still[name]["published"]) for name in still]
    return Chapter(
        name="torsion",
        title="Torsion models side by side",
        tables=(_torsion_table(robots, still, heavy),),
        pictures=(Picture(name="torsion-models", draw=partial(torsion_figure, still, moved)),),
        facts={
            "open_section": listed(mm(value) for value in apart["open_section"]),
            "homogenized": listed(mm(value) for value in apart["homogenized"]),
            "homogenized_1": mm(apart["homogenized"][0]),
            "sag": listed(mm(value) for value in sag),
        },
    )


def _radius_at_plateau(each: Fan) -> Number:
    return mm(helix_radius(solve(each.robot, each.plateau)) if each.plateau else np.nan, 1)


def _by_model(robot: Robot, gravity) -> dict[str, Shape]:
    s = np.linspace(0.0, robot.length_na, SAMPLES)
    return {model: solve(robot.replace(torsion=model), paper.LARGEST_TENSION, gravity, s=s) for model in TORSION_MODELS}


def distance(one: Shape, other: Shape) -> float:
    """Distance (m) between two tips."""
    return float(np.linalg.norm(one.tip - other.tip))


def _moved(robot: Robot) -> dict[str, np.ndarray]:
    """Distance (m) of the tip from where the published model has it, at `SWEPT`, without load, by torsion model."""
    tips = {
        model: np.array([solve(robot.replace(torsion=model), tension).tip for tension in SWEPT])
        for model in TORSION_MODELS
    }
    return {model: np.linalg.norm(tips[model] - tips["published"], axis=1) for model in TORSION_MODELS[1:]}


def _tip_table(fans: Sequence[Fan]) -> Table:
    rows = []
    for each in fans:
        for tension, still, heavy in zip(TENSIONS[1:], each.still[1:], each.heavy[1:], strict=True):
            sag = mm(distance(heavy, still), 3)
            tips = [mm(value, 3) for value in (*still.tip, *heavy.tip)]
            rows.append([title_of(each.robot.name), Number(tension, 2), *tips, sag])
    return Table(
        name="tips",
        header=(
            "",
            "<i>τ</i> (N)",
            *(f"<i>{axis}</i> (mm)" for axis in "xyz"),
            *(f"<i>{axis}</i>, gravity (mm)" for axis in "xyz"),
            "moved by gravity (mm)",
        ),
        rows=rows,
    )


def _torsion_table(robots: Sequence[Robot], still: dict, heavy: dict) -> Table:
    rows = []
    for robot in robots:
        published = still[robot.name]["published"]
        for model in TORSION_MODELS:
            shape = still[robot.name][model]
            stiffness = 1e6 * torsion_stiffness(robot, model)
            tip = [mm(value, 3) for value in shape.tip]
            moved = mm(distance(shape, published), 3)
            sag = mm(distance(heavy[robot.name][model], shape), 3)
            rows.append([title_of(robot.name), model, Number(stiffness, 2), *tip, moved, sag])
    return Table(
        name="torsion",
        header=(
            "",
            "torsion model",
            "stiffness (N mm²)",
            *(f"tip <i>{axis}</i> (mm)" for axis in "xyz"),
            "from published (mm)",
            "moved by gravity (mm)",
        ),
        rows=rows,
    )
