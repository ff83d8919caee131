"""States of a bench, faults and reactions: words that control, safety and record share."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import nan
from typing import NamedTuple


class State(StrEnum):
    """Where a bench is: idle -> homed -> armed -> running -> held or fault; only `running` obeys a controller."""

    IDLE = "idle"
    HOMED = "homed"
    ARMED = "armed"
    RUNNING = "running"
    HELD = "held"
    FAULT = "fault"


class Reaction(StrEnum):
    """What a fault does to the motion."""

    HOLD = "hold"  # all axes stand still, the tendon keeps its tension
    RELEASE = "release tension"  # robot stands still, the screw pays out until the tendon is slack, then all stop
    STOP = "stop"  # all axes stop at once; nothing moves any more


class FaultKind(StrEnum):
    """Every fault that the interlock knows; the value is what it is called in records and messages."""

    TENSION = "tension above its limit"
    TENSION_RATE = "tension changes too fast"
    TENSION_LOST = "tension stays away though the tendon is pulled"
    TRAVEL = "axis beyond its travel"
    SPEED = "axis faster than allowed"
    STRAIN = "strain of the robot above its limit"
    STALE_SENSOR = "sensor value too old"
    NAN_SENSOR = "sensor gives no number"
    TRACKER_LOST = "tracker lost for too long"
    ENCODER_JUMP = "encoder jumped"
    SATURATION = "load cell saturated"
    STALL = "axis does not follow its command"
    COMMAND_TIMEOUT = "no command in time"
    LATE = "control periods late in a row"
    DEVICE = "device does not answer"
    EMERGENCY = "emergency stop"
    RECORD = "record cannot be written"
    CONTROLLER = "controller failed"
    STUCK = "task does not get on"


BELOW_ZERO = "load cell below zero"
_UNITS = {
    FaultKind.TENSION: "N",
    FaultKind.TENSION_RATE: "N/s",
    FaultKind.TENSION_LOST: "m",
    FaultKind.SATURATION: "N",
    FaultKind.STALE_SENSOR: "s",
    FaultKind.TRACKER_LOST: "s",
    FaultKind.COMMAND_TIMEOUT: "s",
    FaultKind.LATE: "s",
}
_PER_AXIS = {FaultKind.TRAVEL: "", FaultKind.SPEED: "/s", FaultKind.ENCODER_JUMP: "", FaultKind.STALL: ""}


class Finding(NamedTuple):
    """A condition found: its kind, the value, the limit that it passed, and where."""

    kind: FaultKind
    value: float = nan
    limit: float = nan
    where: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class Fault:
    """What was found, when (s), the value and the limit it passed, and what is done about it."""

    kind: FaultKind
    time: float
    reaction: Reaction
    value: float = nan
    limit: float = nan
    where: str = ""

    @property
    def unit(self) -> str:
        """Of value and limit, "" for a number without."""
        if self.kind in _PER_AXIS:
            return ("rad" if self.where.startswith("rotation") else "m") + _PER_AXIS[self.kind]
        if self.kind is FaultKind.TENSION_LOST and self.where == BELOW_ZERO:
            return "N"  # the reading itself, not the pull that it does not answer
        return _UNITS.get(self.kind, "")

    @property
    def passed(self) -> str:
        """The value and what was allowed, with their unit; "" where there is none."""
        if self.value != self.value:
            return ""
        return ", allowed".join(f" {x:.4g} {self.unit}".rstrip() for x in (self.value, self.limit)).strip()

    def __str__(self) -> str:
        place, passed = f" ({self.where})" if self.where else "", f": {self.passed}" if self.passed else ""
        return f"{self.kind.value}{place}{passed}; {self.reaction.value}"
