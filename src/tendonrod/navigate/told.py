"""What the server says: scene, state of the robot, control, errors. See `messages`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from .asked import Message, Point, Severity

PROTOCOL = 1
MOST_POINTS = 64  # of the centre line on the wire
MOST_CONTACTS = 32  # the strongest

Number = float | None  # null where a number would not be finite
Ends = Annotated[list[float], Field(min_length=2, max_length=2)]


class TubePose(Message):
    """Pose of the outer tube's exit, m and rad, as in `Tube`."""

    height: float
    offset: float
    depth: float
    tilt: float
    lean: float


class RobotScene(Message):
    name: str
    torsion: str
    length: Annotated[float, Field(description="Of the part that can leave the outer tube, m")]
    outer_radius: Annotated[float, Field(description="m")]
    tendons: int


class StructureScene(Message):
    name: str
    role: str
    is_wall: Annotated[bool, Field(description="Whether the robot may not enter it")]
    url: Annotated[str, Field(description="Binary STL, vertices in m, world frame")]


class TargetScene(Message):
    name: str
    level: str
    position: Point
    tolerance: Annotated[float, Field(description="m")]
    side: str
    description: str


class LevelScene(Message):
    name: str
    z_low: float
    z_high: float
    entry_height: Annotated[Number, Field(description="z of an exit in the window of this level, m")] = None
    entry_depth: Annotated[Number, Field(description="x of such an exit, m")] = None
    tube: Annotated[TubePose | None, Field(description="Outer tube to begin with, in that window")] = None


class PhantomScene(Message):
    name: str
    kind: str
    structures: list[StructureScene]
    targets: list[TargetScene]
    levels: Annotated[list[LevelScene], Field(description="Cranial to caudal, m")]


class LimitScene(Message):
    name: str
    low: Number
    high: Number
    unit: str


class Scene(Message):
    """What stays as it is for the whole session."""

    robot: RobotScene
    phantom: PhantomScene
    limits: list[LimitScene]
    gravity: Annotated[Point, Field(description="m/s2")]
    tube: Annotated[TubePose, Field(description="Where the session began")]


class RateValues(Message):
    insertion: Annotated[float, Field(description="m/s")]
    rotation: Annotated[float, Field(description="rad/s")]
    tension: Annotated[float, Field(description="N/s")]


class RateRanges(Message):
    """Lowest and highest of each rate."""

    insertion: Ends
    rotation: Ends
    tension: Ends


class TubeRanges(Message):
    """Lowest and highest of each number of a `Tube`, m and rad."""

    height: Ends
    offset: Ends
    depth: Ends
    tilt: Ends
    lean: Ends


class Event(Message):
    """Something happened that an operator wants to know."""

    type: Literal["event"] = "event"
    severity: Severity
    text: str
    time: Annotated[float, Field(description="s, of the session; of a record's event from that record's beginning")]
    record: Annotated[bool, Field(description="Whether it happened in the record that is shown")] = False


class PastEvent(Event):
    ago: Annotated[float, Field(description="s, of real time")]


class Past(Message):
    """What was told and shown before: events oldest first, and curves over ``ago`` (s of real time, at most 60)."""

    events: list[PastEvent]
    ago: list[float]
    insertion: Annotated[list[float], Field(description="Share of the length")]
    tension: Annotated[list[float], Field(description="The largest, N")]
    clearance: Annotated[list[Number], Field(description="The least, m")]
    in_range: list[bool]
    live: Annotated[list[bool], Field(description="false where a record was shown")]


class Welcome(Message):
    """The first message of a connection."""

    type: Literal["welcome"] = "welcome"
    protocol: int = PROTOCOL
    client: str
    scene: Scene
    rates: RateValues
    allowed_rates: RateRanges
    coupled: bool
    allowed_tube: TubeRanges
    can_reset: Annotated[bool, Field(description="Whether the robot can be retracted at once: not on a bench")]
    past: Past


class Settings(Message):
    """Rates and coupling, after a change."""

    type: Literal["settings"] = "settings"
    rates: RateValues
    coupled: bool


class Control(Message):
    """Who has control, after every change; that its holder has fallen silent is told with a pong."""

    type: Literal["control"] = "control"
    operator: str | None
    you: bool
    watchers: int
    free: Annotated[bool, Field(description="Whether another may take control: nobody has it, or has been silent")]


class Contact(Message):
    point: Point
    force: Annotated[Point, Field(description="On the robot, N")]
    pressure: Annotated[Number, Field(description="Pa")]


class GaugeState(Message):
    value: Number
    low: Number
    high: Number
    unit: str
    exceeded: bool


class WarningState(Message):
    code: str
    text: str
    severity: Severity


class Replaying(Message):
    """The record that is shown; times in s from its beginning."""

    name: str
    at: float
    span: Annotated[float, Field(description="Of the whole record")]
    known: Annotated[float, Field(description="Computed so far; what lies beyond has to be computed first")]
    speed: Annotated[float, Field(description="1: as fast as it was recorded")]
    paused: bool
    pace: Annotated[Number, Field(description="How fast it really goes: at most as fast as it is computed")] = None


class FaultState(Message):
    """What keeps the bench from moving."""

    text: str
    remedy: Annotated[str, Field(description="What to do next")]
    ready: Annotated[bool, Field(description="Whether it can be acknowledged now")]
    homes: Annotated[bool, Field(description="Whether that needs home: the robot is let go and drawn in by it")]


class State(Message):
    """The robot now. At 60 Hz while it moves, at least at 10 Hz when still; a slow client skips to the newest."""

    type: Literal["state"] = "state"
    index: int
    time: Annotated[float, Field(description="s, of the session")]
    insertion: Annotated[float, Field(description="Share of the length, 0 to 1")]
    rotation: Annotated[float, Field(description="Of the section at the exit, rad")]
    tension: Annotated[list[float], Field(description="One per tendon, N")]
    tube: TubePose
    centerline: Annotated[list[Point], Field(max_length=MOST_POINTS, description="Of the robot, from the exit on, m")]
    clearance: Annotated[dict[str, list[Number]], Field(description="Wall to structure at each point, m; < 0: inside")]
    pressure: Annotated[list[Number], Field(description="At each point of the centre line, Pa")]
    contacts: Annotated[list[Contact], Field(max_length=MOST_CONTACTS, description="The strongest")]
    tip: Point
    tip_direction: Annotated[Point, Field(description="Unit vector")]
    targets: Annotated[dict[str, float], Field(description="Distance of each, m")]
    reached: list[str]
    gauges: dict[str, GaugeState]
    warnings: list[WarningState]
    in_range: Annotated[bool, Field(description="Whether the model holds here")]
    blocked: Annotated[str, Field(description="Why the last command was not carried out; empty if it was")]
    fault: Annotated[
        FaultState | None, Field(description="Of the bench; null where nothing stops it, or there is none")
    ]
    moving: bool
    mode: Literal["live", "replay"]
    recording: Annotated[str | None, Field(description="Name of the record")]
    replay: Annotated[Replaying | None, Field(description="What is shown in the mode replay")]


class Error(Message):
    """A message of this client was refused; nothing moves because of it."""

    type: Literal["error"] = "error"
    text: str


class Pong(Message):
    type: Literal["pong"] = "pong"
    id: int


# ---- answers of the HTTP interface


class Stepped(State):
    """The robot after a step of a script, and how far that got."""

    seconds_done: Annotated[float, Field(description="s of the duration that were moved; `blocked` is of the last")]
    ended_early: Annotated[str | None, Field(description="Why it ended before its duration; null where it did not")]


class RecordEntry(Message):
    name: str
    size: Annotated[int, Field(description="bytes")]
    modified: Annotated[float, Field(description="s since 1970, UTC")]


class Seated(Message):
    """Control is given; the key goes with every request that needs it, as the header X-Key."""

    operator: str
    key: str


class Who(Message):
    """Who has control, and how many pages are connected."""

    operator: str | None
    clients: int


class Refusal(Message):
    """Why a request was not carried out."""

    detail: str
