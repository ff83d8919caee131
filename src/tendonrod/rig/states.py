"""States of a bench, faults and reactions: words that control, safety and record share."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


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


@dataclass(frozen=True, kw_only=True, slots=True)
class Fault:
    """What was found, when (s), the value and the limit it passed, and what is done about it."""

    kind: FaultKind
    time: float
    reaction: Reaction
    value: float = float("nan")
    limit: float = float("nan")
    where: str = ""

    def __str__(self) -> str:
        place = f" ({self.where})" if self.where else ""
        passed = "" if self.value != self.value else f": {self.value:.4g}, allowed {self.limit:.4g}"
        return f"{self.kind.value}{place}{passed}; {self.reaction.value}"
