"""What tasks are put together from: the machine's limits, axes driven to a position, conditions that must last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import ceil, floor, inf, pi
from typing import Any

from ..errors import InvalidInput, TendonrodError, finite, positive
from .control import Ramp, TensionController, braked
from .interfaces import AxisLimits, AxisState, Bench

TURN = 2.0 * pi
POSITION_GAIN = 10.0  # 1/s, of an axis driven to a position
NEAR, TURNED = 20e-6, 2e-3  # m, rad: an axis so near to its goal has arrived
WINDING: dict[str, Any] = {
    "kp": 5e-3,
    "ki": 2.5e-3,
}  # of the lead screw: ten times slower than the roller gear
PACE, PACE_SHARE = 1e-3, 0.8  # m/s, 1: of the screw along a profile; below its speed, for the way to catch up
SCREW_SPEED = 1e-3  # m/s, of the screw while it takes the tendon up, where its limits name none


class TaskFailed(TendonrodError):
    """A task that cannot go on; the message is one line."""


@dataclass(frozen=True, kw_only=True)
class Machine:
    """What a task knows of bench and robot: the tube's length L (m), turns of the helix, limits of the axes.

    Raises `InvalidInput`.
    """

    length: float
    turns: float = 1.0
    screw: AxisLimits = field(default_factory=AxisLimits)
    translation: AxisLimits = field(default_factory=AxisLimits)
    rotation: AxisLimits = field(default_factory=AxisLimits)

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", positive("length", self.length))
        object.__setattr__(self, "turns", finite("turns", self.turns))

    @classmethod
    def of(cls, bench: Bench, length: float, turns: float) -> Machine:
        """The machine of an open bench with a robot of L = ``length`` (m) whose backbone makes ``turns``."""
        limits = {"screw": bench.screw.limits, "translation": bench.translation.limits}
        return cls(length=length, turns=turns, rotation=bench.rotation.limits, **limits)

    @property
    def joint(self) -> AxisLimits:
        """Of the translation while the screw goes along with it: no faster than the slower of the two."""
        both = self.translation, self.screw
        slower = {name: min(getattr(axis, name) for axis in both) for name in ("speed", "acceleration")}
        return replace(self.translation, **slower)

    def turn(self, insertion: float, rotation: float) -> float:
        """The motor's angle (rad) for the section's ``rotation`` at the exit: it follows the helix, full out at 0."""
        return rotation + TURN * self.turns * (insertion - 1.0)

    def controller(self, **changes) -> TensionController:
        """Of the tension through the translation, within its limits; changes: arguments of `TensionController`."""
        speed = self.translation.speed
        limits: dict[str, Any] = {
            "limit": 5e-3 if speed == inf else speed,
            "acceleration": self.translation.acceleration,
        }
        return TensionController(**limits | changes)

    def winder(self, **changes) -> TensionController:
        """Of the tension through the lead screw, within its limits."""
        limits: dict[str, Any] = {"limit": min(self.screw.speed, SCREW_SPEED), "acceleration": self.screw.acceleration}
        return TensionController(**WINDING | limits | changes)


class AxisDrive:
    """Drives one axis to a position or at a velocity, within its speed, acceleration and travel."""

    __slots__ = ("limits", "ramp")

    def __init__(self, limits: AxisLimits) -> None:
        self.limits, self.ramp = limits, Ramp(limits.speed, limits.acceleration)

    def to(self, goal: float, at: AxisState, dt: float, ahead: float = 0.0) -> float:
        """The velocity that brings the axis to ``goal``; ahead: that of the goal itself."""
        missing = goal - at.position
        back = braked(POSITION_GAIN * missing, abs(missing), self.limits.acceleration, dt)
        return self.at(ahead + back, at, dt)

    def at(self, velocity: float, at: AxisState, dt: float) -> float:
        """``velocity`` as far as the limits allow it."""
        return within_travel(self.ramp.update(velocity, dt), at, self.limits, dt)


def within_travel(velocity: float, at: AxisState, limits: AxisLimits, dt: float) -> float:
    """``velocity`` braked before the ends of the travel; beyond an end only the way back is left."""
    room = limits.high - at.position if velocity > 0.0 else at.position - limits.low
    return braked(velocity, room, limits.acceleration, dt)


class Lasting:
    """Whether something has been so for ``time`` seconds without a break."""

    __slots__ = ("since", "time")

    def __init__(self, time: float) -> None:
        self.time, self.since = time, 0.0

    def update(self, is_so: bool, dt: float) -> bool:
        """Count dt (s) more, or start again."""
        self.since = self.since + max(dt, 0.0) if is_so else 0.0
        return is_so and self.since >= self.time


def full_turn(angle: float, way: Sequence[float], limits: AxisLimits) -> float:
    """Full turns (rad) to add to all of ``way``: its start is then nearest to ``angle``, all of it within the travel.

    They leave the robot as it is. Raises `TaskFailed` where the travel is too short for the way.
    """
    lowest = ceil((limits.low - min(way)) / TURN - 1e-9) if limits.low != -inf else -inf
    highest = floor((limits.high - max(way)) / TURN + 1e-9) if limits.high != inf else inf
    if lowest > highest:
        asked, there = f"{min(way):.4g} to {max(way):.4g}", f"{limits.low:.4g} to {limits.high:.4g}"
        raise TaskFailed(f"rotation from {asked} rad is asked for, its travel is {there} rad")
    return TURN * min(max(round((angle - way[0]) / TURN), lowest), highest)


def pace(rate: float | None, limits: AxisLimits) -> float:
    """The lead screw's rate (m/s), None: ``PACE``, or ``PACE_SHARE`` of its speed. Raises `InvalidInput`."""
    if rate is None:
        return min(PACE, PACE_SHARE * limits.speed)
    if positive("screw_rate", rate) > limits.speed:
        raise InvalidInput("screw_rate", rate, f"at most the axis' speed, {limits.speed:g}, in m/s")
    return rate
