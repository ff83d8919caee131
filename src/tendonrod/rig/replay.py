"""`replay`: what was written, sample by sample, bit for bit; `replay_bench`: a bench whose devices say it all again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import Fact, InvalidInput
from .interfaces import AxisLimits, AxisState, Bench, Command, DeviceError, Force, PoseFrame, Sample
from .record import Record, fault_of
from .states import Fault, State

CHUNK = 4096  # samples turned into objects at a time


def replay(record: Record) -> Iterator[tuple[Sample, Command, State, Fault | None]]:
    """What was written, sample by sample, equal to the last bit."""
    n = len(record.samples)
    faults = dict(zip(record.fault_sample.tolist(), record.fault_rows.tolist(), strict=True))
    ends = np.searchsorted(record.frame_sample, np.arange(n), side="right").tolist()
    first = 0
    for start in range(0, n, CHUNK):
        for i, row in enumerate(record.samples[start : start + CHUNK].tolist(), start):
            frames = tuple(_frame(each, record.texts) for each in record.frames[first : ends[i]].tolist())
            first = ends[i]
            fault = fault_of(faults[i], record.texts) if i in faults else None
            yield _sample(row, frames), _command(row[5]), State(record.texts[row[6]]), fault


def _sample(row: Sequence[Any], frames: tuple[PoseFrame, ...]) -> Sample:
    time, screw, translation, rotation, (at, tension, saturated) = row[:5]
    return Sample(
        time=time,
        screw=_axis(screw),
        translation=_axis(translation),
        rotation=_axis(rotation),
        force=Force(time=at, tension=tension, saturated=saturated),
        frames=frames,
    )


def _axis(row: Sequence[Any]) -> AxisState:
    time, position, velocity, homed, at_limit, stalled = row
    words = {"homed": homed, "at_limit": at_limit, "stalled": stalled}
    return AxisState(time=time, position=position, velocity=velocity, **words)


def _command(row: Sequence[float]) -> Command:
    screw, translation, rotation, target = row
    return Command(screw=screw, translation=translation, rotation=rotation, target=target)


def _frame(row: Sequence[Any], texts: Mapping[int, str]) -> PoseFrame:
    time, frame, tool, position, quaternion, quality, state = row
    return PoseFrame(
        time=time,
        frame=frame,
        tool=texts[tool],
        position=tuple(np.asarray(position).tolist()),
        quaternion=tuple(np.asarray(quaternion).tolist()),
        quality=quality,
        state=texts[state],
    )


class Playback:
    """Which sample of a record it is now: the clock of a `replay_bench`. Each wait ends at the next sample.

    now() is the time at which that sample was taken. `is_over` holds at the last one; a wait then raises
    `DeviceError`. `commands` are those that the devices were given since, one per sample, NaN where there was none.
    """

    def __init__(self, record: Record) -> None:
        if not len(record.samples):
            raise InvalidInput("record", Fact(record.name), "a record of one or more samples")
        self._coming = replay(record)
        self._left, self._started = len(record.samples), False
        self.commands: list[list[float]] = []
        self._next()

    def _next(self) -> None:
        self.sample, self.command, self.state, self.fault = next(self._coming)
        self._left -= 1
        self.commands.append([float("nan")] * 3)

    @property
    def is_over(self) -> bool:
        """Whether the last sample is being played."""
        return self._left == 0

    def now(self) -> float:
        """Time of the sample, s."""
        return self.sample.time

    def wait_until(self, time: float) -> None:
        """Go on to the next sample, at the first call to the first, whatever its time."""
        if self._started:
            if self.is_over:
                raise DeviceError("the record is at its end")
            self._next()
        self._started = True


class PlayedAxis:
    """An axis that is where it was; commands move nothing, and are kept in `Playback.commands`."""

    def __init__(self, name: str, column: int, playback: Playback) -> None:
        self.name, self.limits = name, AxisLimits()
        self._column, self._playback = column, playback

    def read(self) -> AxisState:
        """As recorded."""
        return getattr(self._playback.sample, self.name)

    def move(self, velocity: float) -> None:
        """Keep the command."""
        self._playback.commands[-1][self._column] = velocity

    def stop(self) -> None:
        """Keep a velocity of 0."""
        self.move(0.0)

    def home(self, should_stop: Callable[[], bool] | None = None) -> None:
        """Nothing."""


class PlayedLoadCell:
    """A load cell that says what it said."""

    def __init__(self, full_scale: float, playback: Playback) -> None:
        self.full_scale, self._playback = full_scale, playback

    def read(self) -> Force:
        """As recorded."""
        return self._playback.sample.force


class PlayedTracker:
    """A tracker whose frames come again with the samples that they came with, each once."""

    def __init__(self, record: Record, playback: Playback) -> None:
        self.tools = tuple(dict.fromkeys(record.tools.tolist()))
        self.rate = _rate(record)
        self._playback, self._told = playback, None

    def read(self) -> tuple[PoseFrame, ...]:
        """As recorded."""
        sample = self._playback.sample
        if self._told is sample:
            return ()
        self._told = sample
        return sample.frames


def replay_bench(record: Record) -> tuple[Bench, Playback]:
    """A bench that plays a record to whatever controls it, in the loop that controls the real one; and its playback.

    The full scale of the load cell is the header's "full_scale" (N), infinite without it. There is no tracker where
    no frame was recorded. Raises `InvalidInput` for a record without samples.
    """
    playback = Playback(record)
    axes = {name: PlayedAxis(name, i, playback) for i, name in enumerate(("screw", "translation", "rotation"))}
    cell = PlayedLoadCell(float(record.header.get("full_scale", float("inf"))), playback)
    tracker = PlayedTracker(record, playback) if len(record.frames) else None
    return Bench(name=f"replay of {record.name}", **axes, load_cell=cell, tracker=tracker, clock=playback), playback


def _rate(record: Record) -> float:
    """Frames per second of a tool, NaN where fewer than two tell."""
    time = record.frames["time"][record.frames["tool"] == record.frames["tool"][0]]
    steps = np.diff(time)[np.diff(time) > 0.0]
    return float(1.0 / np.median(steps)) if steps.size else float("nan")
