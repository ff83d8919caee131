"""`Setup`: how the bench stood in truth, beside what the trials say: numbers that `identify` may free, by flat name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import Fact, InvalidInput, finite, nonnegative, positive
from ..loads import LumpedMass
from ..robot import Robot
from ..rotation import exp_so3
from .trial import Trial

ABOVE_ZERO = ("tension_scale",)
NOT_BELOW_ZERO = ("tip_mass", "tracker_mass")


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Departures of the bench from what the trials say; SI, all zero by default.

    robot: None for that of each trial. weight: False leaves gravity out.
    base_x, base_y, base_z (m), base_tilt_x, base_tilt_y, base_roll (rotation vector, rad): of the outer tube's exit in
    the world in which trackers are measured and gravity is known.
    gravity_tilt_x, gravity_tilt_y, gravity_tilt_z: rotation vector (rad) by which gravity is turned in that world, for
    worlds that hang on the base tracker, whose own tilt cannot be seen in positions.
    tip_mass: kg, in every trial. tracker_mass: kg, of each tracker on the robot beside its own, where it sits.
    holder_x, holder_y, holder_z: m, of every sensor beside its own offset, in the section's frame.
    tension_scale, tension_zero: true tension = scale * (reading - zero), N. displacement_zero: m, taken off readings.
    """

    robot: Robot | None = None
    weight: bool = True
    base_x: float = 0.0
    base_y: float = 0.0
    base_z: float = 0.0
    base_tilt_x: float = 0.0
    base_tilt_y: float = 0.0
    base_roll: float = 0.0
    gravity_tilt_x: float = 0.0
    gravity_tilt_y: float = 0.0
    gravity_tilt_z: float = 0.0
    tip_mass: float = 0.0
    tracker_mass: float = 0.0
    holder_x: float = 0.0
    holder_y: float = 0.0
    holder_z: float = 0.0
    tension_scale: float = 1.0
    tension_zero: float = 0.0
    displacement_zero: float = 0.0

    def __post_init__(self) -> None:
        if not (self.robot is None or isinstance(self.robot, Robot)):
            raise InvalidInput("robot", self.robot, "a Robot, or None for that of each trial")
        if not isinstance(self.weight, bool):
            raise InvalidInput("weight", self.weight, "True or False")
        for name in BENCH:
            check = positive if name in ABOVE_ZERO else nonnegative if name in NOT_BELOW_ZERO else finite
            object.__setattr__(self, name, check(name, getattr(self, name)))

    def weightless(self) -> Setup:
        """The same without gravity."""
        return replace(self, weight=False)

    def robot_of(self, trial: Trial) -> Robot:
        """The robot that a trial is predicted with."""
        return trial.robot if self.robot is None else self.robot

    def gravity_of(self, trial: Trial) -> tuple[float, float, float]:
        """(3,) m/s2, world frame."""
        x, y, z = exp_so3(self.gravity_tilt) @ trial.gravity if self.weight else np.zeros(3)
        return float(x), float(y), float(z)

    @property
    def base_turn(self) -> np.ndarray:
        """(3,) rotation vector of the exit, rad."""
        return np.array([self.base_tilt_x, self.base_tilt_y, self.base_roll])

    @property
    def gravity_tilt(self) -> np.ndarray:
        """(3,) rotation vector of gravity, rad."""
        return np.array([self.gravity_tilt_x, self.gravity_tilt_y, self.gravity_tilt_z])

    @property
    def holder(self) -> np.ndarray:
        """(3,) of sensors beside their own offset, m."""
        return np.array([self.holder_x, self.holder_y, self.holder_z])

    @property
    def exit_pose(self) -> np.ndarray | None:
        """(4, 4) T_world_exit, None for the identity."""
        base = np.array([self.base_x, self.base_y, self.base_z])
        if not self.base_turn.any() and not base.any():
            return None
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = exp_so3(self.base_turn), base
        return pose

    def loads(self, trial: Trial, free: Sequence[str] = ()) -> tuple[LumpedMass, ...]:
        """Masses on the robot of ``trial``: at the tip first, then of each tracker; without those that weigh nothing.

        free: names of numbers that are to be changed, whose masses are there even where they are zero now.
        """
        robot, masses = self.robot_of(trial), []
        if self.tip_mass > 0.0 or "tip_mass" in free:
            masses.append(LumpedMass(mass=self.tip_mass))
        for tracker, place in zip(trial.trackers, places(trial, robot), strict=True):
            mass = tracker.mass + self.tracker_mass
            if np.isfinite(place) and (mass > 0.0 or "tracker_mass" in free):
                arm = tuple((np.array(tracker.arm) + self.holder).tolist())
                at = None if tracker.at is None else float(place)
                masses.append(LumpedMass(mass=mass, at=at, offset=arm))  # pyright: ignore[reportArgumentType]
        return tuple(masses)

    def value(self, name: str, trials: Sequence[Trial]) -> float:
        """The number ``name``, of the bench or of the robot. Raises `InvalidInput` that lists the names there are."""
        if name in BENCH:
            return getattr(self, name)
        numbers = the_robot(self, trials).parameters()
        if name not in numbers:
            allowed = "one of " + ", ".join([*BENCH, *numbers]) + _advice(name)
            raise InvalidInput("free", name, allowed)
        return numbers[name]

    def changed(self, values: Mapping[str, float], trials: Sequence[Trial]) -> Setup:
        """With other numbers; those that are not of the bench change the robot."""
        own = {name: float(value) for name, value in values.items() if name in BENCH}
        other = {name: float(value) for name, value in values.items() if name not in BENCH}
        if not other:
            return replace(self, **own)
        return replace(self, robot=the_robot(self, trials).replace(**other), **own)


BENCH = tuple(each.name for each in dataclasses.fields(Setup) if each.name not in ("robot", "weight"))


def the_robot(setup: Setup, trials: Sequence[Trial]) -> Robot:
    """The one robot of the trials. Raises `InvalidInput` where they have several."""
    robots = list(dict.fromkeys(setup.robot_of(each) for each in trials))
    if len(robots) != 1:
        names = ", ".join(dict.fromkeys(each.name for each in robots))
        raise InvalidInput(
            "trials", Fact(names), f"of one robot: {_difference(*robots[:2])}; give the one that is meant"
        )
    return robots[0]


def _difference(a: Robot, b: Robot) -> str:
    """The first thing in which two robots differ."""
    if a.name != b.name:
        return f"there are {a.name} and {b.name}"
    if a.torsion != b.torsion:
        return f"{a.name} comes with torsion {a.torsion} and with torsion {b.torsion}"
    one, other = a.parameters(), b.parameters()
    for name in {**one, **other}:
        if one.get(name) != other.get(name):
            return f"{a.name} comes with {name} {one.get(name)} and {other.get(name)}"
    return f"{a.name} comes with two routings of tendons"


def places(trial: Trial, robot: Robot) -> np.ndarray:
    """(k,) s_m of the trackers on ``robot``, m: the same share of its length as on the trial's own; NaN on the base."""
    return trial.places * (robot.length_na / trial.robot.length_na)


def _advice(name: str) -> str:
    return "; stiffness factors belong to the torsion model homogenized" if name.endswith("_factor") else ""
