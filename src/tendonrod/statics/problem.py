"""`RodProblem`: what is asked of a rod, in the arrays of `kernel_newton`, for any robot and any load."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..loads import Load, load_tables
from ..robot import Robot
from ..surface import Surface
from .solution import Solution

SAME_PLACE = 1e-9  # of the exposed length: nodes closer than this are one


@dataclass(frozen=True, kw_only=True, eq=False)
class RodProblem:
    """A robot, its tensions and loads in arrays; layouts in `kernel_newton`, `Robot` and `load_tables`.

    tensions (T,) at the exit; pulled (T,) lengths, NaN where the tension is given; world (10,); points (p, 12) with the
    material coordinate in front; spread (a, 15); frame (12,). history: tensions before, as (material coordinates (k,),
    tensions (k, T)), None where all were pulled from slack.
    """

    robot: Robot
    tensions: np.ndarray
    pulled: np.ndarray
    world: np.ndarray
    points: np.ndarray
    spread: np.ndarray
    frame: np.ndarray
    length: float
    s_exit: float
    accuracy: float
    steps: int = 0
    history: tuple[np.ndarray, np.ndarray] | None = None
    surface: Surface | None = None
    contact_tolerance: float = 1e-5

    @cached_property
    def axis(self) -> np.ndarray:
        """(m, 2) tube axis in the section frame, by row of the robot's section table."""
        table = self.robot.section_table
        return np.ascontiguousarray(self.robot.axis_offset(0.5 * (table[:, 0] + table[:, 1])))

    @property
    def conservative(self) -> bool:
        """Whether all loads have a potential: neither moments fixed in the world nor forces that turn with the body."""
        turning = (self.world[6:9], self.points[:, 4:7], self.points[:, 10], self.spread[:, 8:])
        return not any(part.any() for part in turning)

    @property
    def answers(self) -> bool:
        """Whether tensions depend on the shape: some tendon is driven by its length or rubs."""
        return bool((~np.isnan(self.pulled)).any() or self.robot.friction.any())

    @property
    def loaded(self) -> bool:
        """Whether any load acts, weight included."""
        return bool(self.world[:9].any() or self.points[:, 1:7].any() or self.spread[:, 2:14].any())

    def scaled(self, load: float, tension: float, steps: int) -> RodProblem:
        """The same with loads and tensions multiplied, with at least so many steps."""
        world, points, spread = self.world.copy(), self.points.copy(), self.spread.copy()
        world[:9] *= load
        points[:, 1:7] *= load
        spread[:, 2:14] *= load
        tensions = tension * self.tensions
        return replace(
            self, world=world, points=points, spread=spread, tensions=tensions, pulled=tension * self.pulled,
            steps=max(steps, self.steps),
        )  # fmt: skip

    def with_steps(self, steps: int) -> RodProblem:
        """The same with a fixed number of steps."""
        return replace(self, steps=steps)

    def grid(self, n: int) -> np.ndarray:
        """Nodes 0..length in about n even steps, with a node at every break, joint, point load and end of a load."""
        marks = [self.robot.breaks, self.robot.joints[:, 0], self.points[:, 0], self.spread[:, :2].ravel()]
        at = (np.concatenate(marks) - self.s_exit) / self.length
        at = np.sort(at[(at > SAME_PLACE) & (at < 1.0 - SAME_PLACE)])
        at = np.concatenate([[0.0], at[np.diff(at, prepend=0.0) > SAME_PLACE], [1.0]])
        counts = np.maximum(1, np.rint(n * np.diff(at)).astype(int))
        parts = [np.linspace(a, b, c, endpoint=False) for a, b, c in zip(at[:-1], at[1:], counts, strict=True)]
        return self.length * np.concatenate([*parts, [1.0]])


def rod_problem(robot: Robot, loads: Iterable[Load], gravity, uniform, tip, centroid: bool, **known) -> RodProblem:
    """The problem of ``robot`` under these loads. uniform: dead f[3] l[3]; tip: dead F[3] M[3] on the neutral axis."""
    points, spread = load_tables(robot, loads, gravity)
    if any(tip):
        row = np.array([[robot.length_na, *tip, 0.0, 0.0, 0.0, 0.0, 0.0]])
        points = np.concatenate([points, row])
    world = np.array([*gravity, *uniform, float(centroid)])
    return RodProblem(robot=robot, world=world, points=points, spread=spread, **known)


def problem_of(robot: Robot, solution: Solution) -> RodProblem:
    """The same problem as a shooting solution's, for what works on every rod."""
    load, weight = solution.problem[:12], robot.section.line_density * np.array(solution.gravity)
    known = {"length": solution.length, "s_exit": solution.s_exit, "accuracy": solution.accuracy, "steps": solution.steps}
    uniform = (*(load[6:9] - weight), *load[9:12])
    return rod_problem(
        robot, (), solution.gravity, uniform, tuple(load[:6]), False, tensions=solution.tensions.copy(),
        pulled=np.full(robot.n_tendons, np.nan), frame=solution.problem[14:26].copy(), **known,
    )  # fmt: skip
