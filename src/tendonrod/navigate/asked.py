"""What a client may send: the messages of the page and of scripts, typed and bounded. See `messages`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from .commands import FASTEST, SLOWEST
from .outer_tube import RANGES


class Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


Share = Annotated[float, Field(ge=-1.0, le=1.0)]
Point = Annotated[list[float], Field(min_length=3, max_length=3, description="m, world frame")]
RecordName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9._-]{0,99}$", examples=["2030-01-31-101500.jsonl"])]
Severity = Literal["info", "warning", "limit"]


def _rate(name: str, unit: str) -> Any:
    return Field(ge=SLOWEST[name], le=FASTEST[name], description=unit)


def _pose(name: str, text: str) -> Any:
    low, high = RANGES[name]
    return Field(ge=low, le=high, description=text)


class Take(Message):
    """Ask for control. Granted if nobody has it, or if who has it is absent."""

    type: Literal["take"] = "take"


class Release(Message):
    """Give control back; the robot stops."""

    type: Literal["release"] = "release"


class Jog(Message):
    """Move, as long as this comes at least every 150 ms and ``hold`` is true. Shares of the rates."""

    type: Literal["jog"] = "jog"
    seq: Annotated[int, Field(ge=0, le=2**53, description="Grows with each jog of a client; older are dropped")]
    insertion: Share
    rotation: Share
    tension: Share
    hold: Annotated[bool, Field(description="The dead-man's switch: false stops at once")]


class Rates(Message):
    """Speeds at full deflection."""

    type: Literal["rates"] = "rates"
    insertion: Annotated[float, _rate("insertion", "m/s")]
    rotation: Annotated[float, _rate("rotation", "rad/s")]
    tension: Annotated[float, _rate("tension", "N/s")]


class Stop(Message):
    """Stop at once. Anybody may; if it was not the operator, control must be taken again before anything moves."""

    type: Literal["stop"] = "stop"


class Reset(Message):
    """Robot retracted at once, without tension, the outer tube where it is; the targets reached are forgotten."""

    type: Literal["reset"] = "reset"


class Tube(Message):
    """Pose of the outer tube's exit; what is left out stays as it is."""

    height: Annotated[float | None, _pose("height", "z of the exit, m")] = None
    offset: Annotated[float | None, _pose("offset", "y of the exit, towards the patient's right, m")] = None
    depth: Annotated[float | None, _pose("depth", "x of the exit, dorsal of the cord's axis, m")] = None
    tilt: Annotated[float | None, _pose("tilt", "In the coronal plane, towards +y, rad")] = None
    lean: Annotated[float | None, _pose("lean", "In the sagittal plane, towards ventral, rad")] = None


class Place(Message):
    """Put the outer tube elsewhere; only with the robot retracted."""

    type: Literal["place"] = "place"
    tube: Tube


class Acknowledgement(Message):
    """That a fault of the bench was seen. It then obeys again; see ``fault`` of the state."""

    home: Annotated[
        bool, Field(description="The bench may let the tendon go and draw the robot in, where the fault says it must")
    ] = False


class Acknowledge(Acknowledgement):
    """Let the bench obey again after a fault; nothing moves by it, unless it must home."""

    type: Literal["acknowledge"] = "acknowledge"


class Coupling(Message):
    """Whether insertion turns the robot by the follow-the-leader law."""

    type: Literal["coupling"] = "coupling"
    on: bool


class Record(Message):
    """Begin a new record, or end the present one."""

    type: Literal["record"] = "record"
    on: bool


class Replay(Message):
    """Show a record to everybody; nothing can be moved meanwhile."""

    type: Literal["replay"] = "replay"
    name: RecordName
    speed: Annotated[float, Field(ge=0.1, le=20.0)] = 1.0


class Playback(Message):
    """How the record that is shown goes on; what is left out stays as it is."""

    speed: Annotated[float | None, Field(ge=0.1, le=20.0)] = None
    paused: bool | None = None
    at: Annotated[float | None, Field(ge=0.0, le=1e7, description="s from the record's beginning")] = None


class ReplaySet(Playback):
    """How the record that is shown goes on; what is left out stays as it is."""

    type: Literal["replay_set"] = "replay_set"


class ReplayStop(Message):
    """Back to the live session, as it was."""

    type: Literal["replay_stop"] = "replay_stop"


class Ping(Message):
    type: Literal["ping"] = "ping"
    id: Annotated[int, Field(ge=0, le=2**53)]


# ---- bodies of the HTTP interface, for scripts


class Nothing(Message):
    """An empty object, {}."""


class SomeRates(Message):
    """Speeds at full deflection; what is left out stays as it is."""

    insertion: Annotated[float | None, _rate("insertion", "m/s")] = None
    rotation: Annotated[float | None, _rate("rotation", "rad/s")] = None
    tension: Annotated[float | None, _rate("tension", "N/s")] = None


class Name(Message):
    """How others see the script that takes control."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,32}$", examples=["my-script"])] = "script"


class Step(Message):
    """One step of a script: deflections, shares of the rates, held for so long; the session moves in real time."""

    insertion: Share = 0.0
    rotation: Share = 0.0
    tension: Share = 0.0
    duration: Annotated[float, Field(gt=0.0, le=10.0, description="s")]


class Switch(Message):
    on: bool


class Played(Message):
    """A record to be shown to everybody."""

    name: RecordName
    speed: Annotated[float, Field(ge=0.1, le=20.0)] = 1.0
