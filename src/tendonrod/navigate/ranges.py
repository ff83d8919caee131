"""Where the model of the robot holds: strain below the plateau, notches open, tendons on their wall, no buckling.

The model solves past buckling, but not plasticity, nor a rod with a plateau; the Euler load is told because a robot
that is pushed with more stays where it is by its walls alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi

import numpy as np

from ..body import part_at, parts
from ..robot import Robot
from ..section import NotchedTube
from ..statics.limits import fibre_strain, wall_pressure
from ..statics.shape import Shape

SLACK = 5e-3  # N, which bends ExoNav 1 by less than 0.2 mm, wherever the tendon runs; a bench at rest reads some of it


@dataclass(frozen=True, kw_only=True, slots=True)
class Condition:
    """How a shape stands towards the ends of the model.

    strain: largest along the body, and strain_at (m) where; 0 where the outline is unknown. push: largest force (N)
    along the tube that compresses it; euler: pi^2 EI / (2 L)^2 (N) of the exposed length L with the softer stiffness,
    inf where retracted. lifted: numbers of the tendons that lift off their wall, from 1, but none that pulls by
    less than `SLACK`. closed: whether notches close.
    """

    strain: float = 0.0
    strain_at: float = 0.0
    push: float = 0.0
    euler: float = inf
    lifted: tuple[int, ...] = ()
    closed: bool = False


def condition_of(shape: Shape) -> Condition:
    """The condition of a shape that was sampled along the whole body."""
    if not shape.length > 0.0:
        return Condition()
    strain = np.nan_to_num(fibre_strain(shape))
    along = np.einsum("ni,ni->n", shape.force, shape.rotation[:, :, 2])
    return Condition(
        strain=float(strain.max()), strain_at=float(shape.s[strain.argmax()]), push=max(0.0, -float(along.min())),
        euler=euler_load(shape.robot, shape.length), lifted=_lifted(shape), closed=_closed(shape),
    )  # fmt: skip


def euler_load(robot: Robot, length: float) -> float:
    """pi^2 EI / (2 L)^2 (N) of the exposed ``length`` (m), clamped and free, with the softest stiffness of the body."""
    ends = robot.section_table[:, :2].ravel()
    return float(robot.section_values(ends)[:, 3:5].min()) * (0.5 * pi / length) ** 2


def _lifted(shape: Shape) -> tuple[int, ...]:
    tensions = shape.tensions
    return tuple(
        i + 1
        for i, tendon in enumerate(shape.robot.tendons)
        if tendon.routing == "opposite_backbone" and tendon.wall != "free" and tensions[i] > SLACK
        and wall_pressure(shape, i).min(initial=inf) <= 0.0
    )  # fmt: skip


def _closed(shape: Shape) -> bool:
    where = part_at(shape.robot.body, shape.material_coordinate)
    limits = [
        each.body.closure_curvature if isinstance(each.body, NotchedTube) else inf for each in parts(shape.robot.body)
    ]
    return bool((shape.u[:, 1] >= np.array(limits)[where]).any())
