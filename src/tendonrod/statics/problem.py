"""`Request`: what a user asks of a rod; `RodProblem`: the same in the arrays of `kernel_newton`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, sin
from typing import TYPE_CHECKING, cast

import numpy as np

from ..loads import Load, load_tables
from ..robot import Robot
from ..rotation import exp_so3
from ..surface import Surface

if TYPE_CHECKING:
    from .newton import NewtonSolution
    from .solution import Solution

SAME_PLACE = 1e-9  # of the exposed length: nodes closer than this are one
ZERO, STRAIGHT = (0.0, 0.0, 0.0), (0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class History:
    """Tensions tau (k, T) before, at material coordinates s_m (k,), smooth between ``kinks``, where slip met stick."""

    s_m: np.ndarray
    tau: np.ndarray
    kinks: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Request:
    """Checked arguments of `solve`; there they are described. pose is None for the identity.

    pulled (T,): lengths, NaN where the tension is given. history: None where all tendons were pulled from slack.
    """

    robot: Robot
    tensions: np.ndarray
    pulled: np.ndarray
    gravity: tuple[float, ...] = ZERO
    tip_force: tuple[float, ...] = ZERO
    tip_moment: tuple[float, ...] = ZERO
    distributed_force: tuple[float, ...] = ZERO
    distributed_moment: tuple[float, ...] = ZERO
    insertion: float = 1.0
    rotation: float = 0.0
    pose: np.ndarray | None = None
    tilt: tuple[float, ...] = STRAIGHT
    offset: tuple[float, ...] = STRAIGHT
    loads: tuple[Load, ...] = ()
    centroid_weight: bool = False
    history: History | None = None
    surface: Surface | None = None
    contact_tolerance: float = 1e-5
    accuracy: float = 1e-6
    steps: int = 0

    @property
    def length(self) -> float:
        """Exposed length of the neutral axis, m."""
        return self.insertion * self.robot.length_na

    @property
    def s_exit(self) -> float:
        """Material coordinate of the exit, m."""
        return (1.0 - self.insertion) * self.robot.length_na

    @property
    def answers(self) -> bool:
        """Whether tensions depend on the shape: some tendon is driven by its length or rubs."""
        return bool((~np.isnan(self.pulled)).any() or self.robot.friction.any())


def exit_frame(robot: Robot, s_exit: float, rotation: float, pose, tilt, offset) -> tuple[float, ...]:
    """p[3] R[9] of the first exposed section, its tube axis in the middle of the outer tube's exit."""
    c, d = cos(rotation), sin(rotation)
    inside = s_exit + SAME_PLACE * (robot.length_na - s_exit)  # beyond a joint that lies at the exit
    x, y = (robot.section.r_na, 0.0) if robot.is_uniform else robot.axis_offset(np.array([inside]))[0].tolist()
    frame = (-x * c + y * d, -x * d - y * c, 0.0, c, -d, 0.0, d, c, 0.0, 0.0, 0.0, 1.0)
    if pose is None and tilt == STRAIGHT and offset == STRAIGHT:
        return frame
    T = np.eye(4) if pose is None else pose
    R = T[:3, :3] @ exp_so3(np.array([*tilt, 0.0]))
    p = T[:3, 3] + T[:3, :3] @ np.array([*offset, 0.0]) + R @ frame[:3]
    return *p.tolist(), *(R @ np.reshape(frame[3:], (3, 3))).ravel().tolist()


@dataclass(frozen=True, kw_only=True, eq=False)
class RodProblem:
    """A request in arrays; layouts in `kernel_newton`, `Robot` and `load_tables`.

    tensions (T,) at the exit; world (10,); points (p, 12) with the material coordinate in front; spread (a, 15);
    frame (12,).
    """

    request: Request
    robot: Robot
    tensions: np.ndarray
    pulled: np.ndarray
    world: np.ndarray
    points: np.ndarray
    spread: np.ndarray
    frame: np.ndarray
    length: float
    s_exit: float
    steps: int

    @property
    def loaded(self) -> bool:
        """Whether any load acts, weight included."""
        return bool(self.world[:9].any() or self.points[:, 1:7].any() or self.spread[:, 2:14].any())

    @cached_property
    def conservative(self) -> bool:
        """Whether all loads have a potential: neither moments fixed in the world nor loads that turn with the body."""
        turning = self.points[:, 10] * np.abs(self.points[:, 1:7]).sum(axis=1), self.spread[:, 14]
        return not any(part.any() for part in (self.world[6:9], self.points[:, 4:7], self.spread[:, 8:14], *turning))

    def dead(self) -> RodProblem:
        """The same without what has no potential."""
        world, points, spread = self.world.copy(), self.points.copy(), self.spread.copy()
        world[6:9] = points[:, 4:7] = spread[:, 8:14] = 0.0
        points[points[:, 10] != 0.0, 1:4] = spread[spread[:, 14] != 0.0, 2:8] = 0.0
        return replace(self, world=world, points=points, spread=spread)

    def scaled(self, load: float, tension: float, steps: int) -> RodProblem:
        """The same with loads and tensions multiplied, with at least so many steps."""
        world, points, spread = self.world.copy(), self.points.copy(), self.spread.copy()
        world[:9] *= load
        points[:, 1:7] *= load
        spread[:, 2:14] *= load
        return replace(
            self, world=world, points=points, spread=spread, tensions=tension * self.tensions,
            pulled=tension * self.pulled, steps=max(steps, self.steps),
        )  # fmt: skip

    def with_steps(self, steps: int) -> RodProblem:
        """The same with a fixed number of steps."""
        return replace(self, steps=steps)

    def grid(self, n: int, kinks=()) -> np.ndarray:
        """Nodes 0..length in about n even steps, and at every break, joint, point load, end of a load and kink."""
        marks = [self.robot.breaks, self.robot.joints[:, 0], self.points[:, 0], self.spread[:, :2].ravel(), kinks]
        at = (np.concatenate(marks) - self.s_exit) / self.length
        at = np.sort(at[(at > SAME_PLACE) & (at < 1.0 - SAME_PLACE)])
        at = np.concatenate([[0.0], at[np.diff(at, prepend=0.0) > SAME_PLACE], [1.0]])
        least = 2 if self.robot.friction.any() else 1  # differences along a tendon take four stages
        counts = np.maximum(least, np.rint(n * np.diff(at)).astype(int))
        parts = [np.linspace(a, b, c, endpoint=False) for a, b, c in zip(at[:-1], at[1:], counts, strict=True)]
        return self.length * np.concatenate([*parts, [1.0]])


def rod_problem(request: Request) -> RodProblem:
    """The request in arrays. Raises `InvalidInput` where a load does not lie on the robot."""
    robot, tip = request.robot, (*request.tip_force, *request.tip_moment)
    points, spread = load_tables(robot, request.loads, request.gravity)
    if any(tip):
        points = np.concatenate([points, [[robot.length_na, *tip, 0.0, 0.0, 0.0, 0.0, 0.0]]])
    uniform = (*request.gravity, *request.distributed_force, *request.distributed_moment)
    place = (request.rotation, request.pose, request.tilt, request.offset)
    return RodProblem(
        request=request, robot=robot, tensions=request.tensions.copy(), pulled=request.pulled,
        world=np.array([*uniform, float(request.centroid_weight)]), points=points, spread=spread,
        frame=np.array(exit_frame(robot, request.s_exit, *place)), length=request.length, s_exit=request.s_exit,
        steps=request.steps,
    )  # fmt: skip


def request(asked: tuple, **more) -> Request:
    """A `Request` from what every solve keeps: robot, gravity, F, M, f, couple, insertion, place of the exit."""
    robot, g, F, M, f, c, insertion, (rotation, pose, tilt, offset) = asked
    return Request(
        robot=robot, gravity=tuple(g), tip_force=tuple(F), tip_moment=tuple(M), distributed_force=tuple(f),
        distributed_moment=tuple(c), insertion=insertion, rotation=rotation, pose=pose, tilt=tilt, offset=offset,
        **more,
    )  # fmt: skip


def problem_of(solution: Solution | NewtonSolution) -> RodProblem:
    """What was asked of a solution, whichever way it was found."""
    if isinstance(solution.problem, RodProblem):
        return solution.problem
    solution = cast("Solution", solution)
    T, known = solution.tensions.copy(), {"accuracy": solution.accuracy, "steps": int(solution.problem[27])}
    pulled = np.full(T.size, np.nan)
    if solution.pull is not None:
        pulled[int(solution.pull[0])], T[int(solution.pull[0])] = solution.pull[1], 0.0
    return rod_problem(request(solution.asked, tensions=T, pulled=pulled, **known))  # pyright: ignore[reportArgumentType] - asked is kept by every solve
