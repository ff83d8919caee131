"""What a bench is made of: axes, load cell, tracker and clock, the same for virtual and real devices. It knows no rods.

SI units. Signs: the lead screw's position x_t > 0 pays tendon out; translation z = insertion * L > 0 pushes the robot
out of the outer tube; rotation (rad) turns it about the tube's axis. Times are those of the bench's clock, s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Protocol, runtime_checkable

from ..errors import TendonrodError


class DeviceError(TendonrodError):
    """A device that does not answer, answers wrongly, or is not what it should be; the message is one line."""


@dataclass(frozen=True, kw_only=True, slots=True)
class AxisLimits:
    """Travel from low to high (m or rad), largest speed and acceleration (per s, per s2)."""

    low: float = -inf
    high: float = inf
    speed: float = inf
    acceleration: float = inf


@dataclass(frozen=True, kw_only=True, slots=True)
class AxisState:
    """An axis at ``time``: position (m or rad, by its encoder), velocity (per s); faults as the device reports them."""

    time: float
    position: float
    velocity: float
    homed: bool = True
    at_limit: int = 0  # -1 or 1 where a limit switch is pressed
    stalled: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class Force:
    """A reading of the load cell: tension, N, NaN where there is none; saturated beyond its full scale."""

    time: float
    tension: float
    saturated: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class PoseFrame:
    """One tool in one frame of the tracker: position (m), quaternion (w, x, y, z) in the tracker's frame; NaN if lost.

    time: when it was measured, by the bench's clock as well as is known. frame: the tracker's own number. quality: its
    error indicator, m. state: what it says of the frame, "" for nothing amiss.
    """

    time: float
    frame: int
    tool: str
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    quality: float = float("nan")
    state: str = ""

    @property
    def is_lost(self) -> bool:
        """Whether the frame has no pose."""
        return self.position[0] != self.position[0]


@runtime_checkable
class Clock(Protocol):
    """Time of a bench: real, or as fast as it can be computed."""

    def now(self) -> float:
        """Seconds since the bench was opened; never goes back."""
        ...

    def wait_until(self, time: float) -> None:
        """Return at ``time`` or as soon after it as possible."""
        ...


@runtime_checkable
class Axis(Protocol):
    """A motor with an encoder that is commanded by velocity."""

    name: str
    limits: AxisLimits

    def read(self) -> AxisState:
        """The newest state. Raises `DeviceError` where the device does not answer."""
        ...

    def move(self, velocity: float) -> None:
        """Move at ``velocity`` until the next command; devices stop by themselves when commands stay away."""
        ...

    def stop(self) -> None:
        """Stop as fast as the axis can."""
        ...

    def home(self, should_stop: Callable[[], bool] | None = None) -> None:
        """Find the reference position and make it zero; blocks until done.

        should_stop: asked every few milliseconds meanwhile, in the same thread, and may read other devices; where it
        says so, or raises, the axis stops at once, and `AxisState.homed` is False then.
        """
        ...


@runtime_checkable
class LoadCell(Protocol):
    """Measures the tendon's tension."""

    full_scale: float  # N

    def read(self) -> Force:
        """The newest reading. Raises `DeviceError`."""
        ...


@runtime_checkable
class PoseTracker(Protocol):
    """Measures poses of tools, frame by frame."""

    tools: tuple[str, ...]
    rate: float  # frames per second

    def read(self) -> tuple[PoseFrame, ...]:
        """All frames since the last call, oldest first; none are made up. Never blocks for longer than a frame."""
        ...


@dataclass(frozen=True, kw_only=True)
class Bench:
    """The devices of one bench, open; ``tracker`` None where there is none. close() is called once, in the end."""

    name: str
    screw: Axis
    translation: Axis
    rotation: Axis
    load_cell: LoadCell
    tracker: PoseTracker | None
    clock: Clock

    @property
    def axes(self) -> tuple[Axis, Axis, Axis]:
        """Lead screw, translation, rotation."""
        return self.screw, self.translation, self.rotation

    def close(self) -> None:
        """Stop everything and let the devices go: all, even where one fails, whose error is raised in the end."""
        first: Exception | None = None
        steps = [axis.stop for axis in self.axes]
        devices = (*self.axes, self.load_cell, self.tracker)
        steps += [device.close for device in devices if hasattr(device, "close")]  # pyright: ignore
        for step in steps:
            try:
                step()
            except Exception as error:  # noqa: BLE001 - whatever a driver raises, the others are still to be stopped
                first = first or error
        if first is not None:
            raise first


@dataclass(frozen=True, kw_only=True, slots=True)
class Sample:
    """Everything that was known in one control period: states, reading, frames, and what was commanded then."""

    time: float
    screw: AxisState
    translation: AxisState
    rotation: AxisState
    force: Force
    frames: tuple[PoseFrame, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True)
class Command:
    """Velocities of the three axes, m/s, m/s, rad/s; target: the tension (N) aimed at, NaN for none."""

    screw: float = 0.0
    translation: float = 0.0
    rotation: float = 0.0
    target: float = float("nan")


STILL = Command()


class Task(Protocol):
    """What a bench is to do: asked once a period while it runs."""

    name: str

    def update(self, sample: Sample, dt: float) -> Command:
        """Velocities for the next period; dt: s since the last call, as measured."""
        ...

    @property
    def is_done(self) -> bool:
        """Whether there is nothing left to do."""
        ...

    @property
    def progress(self) -> float:
        """Share that is done, 0 to 1."""
        ...
