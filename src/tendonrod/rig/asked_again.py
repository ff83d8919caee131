"""`ask_again`: what the interlock finds, asked again about the samples of a record, beside what it found then.

Samples, commands and limits are on file, and the interlock decides by nothing else; so the same samples give the same
faults and states, or something is wrong: another version of tendonrod wrote them, or the record was changed. What no
sample shows is taken from the record: the steps that a program asks for (hold, resume, release, ...), and the faults in
`TOLD`. Of several faults that stood together a record has the first.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import Fact, InvalidInput
from .benches import masses_of
from .export import robot_of, trackers_of
from .interfaces import AxisLimits, Command, Sample
from .limits import AXES, Limits
from .model_limits import strain_limit
from .record import Record
from .replay import replay
from .safety import IllegalTransition, Interlock
from .states import Fault, FaultKind, State

TOLD = {FaultKind.DEVICE, FaultKind.EMERGENCY, FaultKind.RECORD, FaultKind.CONTROLLER, FaultKind.STUCK}
SAME_VALUE = 1e-9  # relative: sums of the past begin a sample or two later than they did then


class Difference(NamedTuple):
    """Where the two part: sample, its time (s), what differs ("state", "fault" or "command"), then and now."""

    sample: int
    time: float
    what: str
    recorded: str
    found: str

    def __str__(self) -> str:
        return f"{self.what} at {self.time:.3f} s: {self.recorded} then, {self.found} now"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What came of it.

    asked: samples that the interlock was asked about; of: samples of the record. differences: in the order of time;
    after one of a state the rest is not asked, since the two then went different ways. told: faults that no sample
    shows.
    """

    asked: int
    of: int
    differences: tuple[Difference, ...]
    told: tuple[Fault, ...]

    @property
    def agrees(self) -> bool:
        """Whether it finds what it found then, for every sample."""
        return not self.differences

    def __str__(self) -> str:
        if self.agrees:
            given = f"; {len(self.told)} told, not seen in samples" if self.told else ""
            return f"asked again about {self.asked} samples, finds the same states and faults{given}"
        first, more = self.differences[0], len(self.differences) - 1
        rest = f", and {more} more" if more else ""
        return f"asked again, differs after {first.sample} of {self.of} samples: {first}{rest}"


def ask_again(record: Record) -> Verdict:
    """Ask the interlock of today about every sample. Raises `InvalidInput` where the record does not say its limits."""
    asked = _AskedAgain(_interlock(record), record)
    for i, each in enumerate(replay(record)):
        if not asked.follow(i, *each):
            break
    return asked.verdict(len(record.samples))


def limits_of_record(record: Record) -> Limits:
    """The limits, narrowed by the devices, that the record's header has. Raises `InvalidInput`."""
    told = record.header.get("limits")
    if not isinstance(told, Mapping):
        raise InvalidInput("limits", told, "in the record's header, as `trials.perform` writes them")
    try:
        axes: dict[str, Any] = {name: AxisLimits(**told[name]) for name in AXES}
        triples = {name: tuple(value) for name, value in told.items() if isinstance(value, list)}
        return Limits(**{**told, **triples, **axes})
    except (TypeError, KeyError) as error:
        raise InvalidInput("limits", Fact(record.name), f"those of this version of tendonrod: {error}") from None


def _interlock(record: Record) -> Interlock:
    limits, trackers = limits_of_record(record), trackers_of(record)
    robot, gravity = robot_of(record), record.header.get("gravity", (0.0, 0.0, 0.0))
    strain = strain_limit(robot, gravity, masses_of(trackers))
    return Interlock(limits, None, strain, tuple(each.name for each in trackers))


class _AskedAgain:
    """An interlock that is led through a record."""

    def __init__(self, interlock: Interlock, record: Record) -> None:
        self._interlock = interlock
        self._releases = _releasing(record)
        self._before: Fault | None = None
        self._differences: list[Difference] = []
        self._told: list[Fault] = []
        self._asked = 0

    def follow(self, i: int, sample: Sample, sent: Command, state: State, fault: Fault | None) -> bool:
        """One period; whether the two are still in the same state after it."""
        lock = self._interlock
        with suppress(IllegalTransition):  # the states then differ, which is told
            self._lead(i, sample, state, fault)
        lock.check(sample)
        allowed = lock.allowed(sent, sample)
        self._asked, self._before = self._asked + 1, fault
        self._compare(i, sample.time, "state", state.value, lock.state.value)
        self._compare(i, sample.time, "fault", _said(fault), _said(lock.fault), _is_same(fault, lock.fault))
        if state is State.RUNNING is lock.state:
            self._compare(i, sample.time, "command", _velocities(sent), _velocities(allowed))
        return lock.state is state and (lock.fault is None) is (fault is None)

    def verdict(self, of: int) -> Verdict:
        return Verdict(asked=self._asked, of=of, differences=tuple(self._differences), told=tuple(self._told))

    def _lead(self, i: int, sample: Sample, state: State, fault: Fault | None) -> None:
        """What no sample shows. Raises `IllegalTransition`."""
        lock = self._interlock
        if fault is None and self._before is not None and lock.fault is not None:
            lock.acknowledge()
        if fault is None and lock.fault is None:
            self._step(i, sample, state)
        elif fault is not None and lock.fault is None and _is_told(fault):
            lock.trip(fault.kind, fault.value, fault.limit, fault.where, fault.reaction)
            self._told.append(fault)

    def _step(self, i: int, sample: Sample, state: State) -> None:
        lock = self._interlock
        if lock.state is state:
            return
        if state is State.HELD:
            lock.release() if self._releases[i] or lock.state is not State.RUNNING else lock.hold()
        elif lock.state is State.HELD and state is State.RUNNING:
            lock.resume()
        elif state is State.ARMED and lock.state in (State.RUNNING, State.HELD):
            lock.finish()
        else:
            self._rise(sample, state)

    def _rise(self, sample: Sample, state: State) -> None:
        """idle -> homed -> armed -> running, as far as it goes."""
        lock = self._interlock
        if lock.state is State.IDLE:
            lock.home()
        if lock.state is State.HOMED and state is not State.HOMED:
            lock.check(sample)
            lock.arm()
        if lock.state is State.ARMED and state is State.RUNNING:
            lock.start()

    def _compare(self, i: int, time: float, what: str, then: str, now: str, is_same: bool | None = None) -> None:
        if not (then == now if is_same is None else is_same):
            self._differences.append(Difference(i, time, what, then, now))


def _releasing(record: Record) -> np.ndarray:
    """(n,) whether a sample is in a stretch of one state in which the screw pays out without a controller."""
    states = record.states
    moves = (record.samples["command"]["screw"] != 0.0) & (states == State.HELD.value)
    stretch = np.cumsum(np.concatenate([[0], states[1:] != states[:-1]])) if len(states) else np.zeros(0, dtype=int)
    return np.isin(stretch, stretch[moves])


def _is_told(fault: Fault) -> bool:
    """Whether no sample shows it; a sample that is too old when its command goes out is the clock's word."""
    return fault.kind in TOLD or (fault.kind is FaultKind.STALE_SENSOR and fault.where == "sample")


def _is_same(then: Fault | None, now: Fault | None) -> bool:
    if then is None or now is None:
        return then is now
    words = (then.kind, then.where, then.reaction) == (now.kind, now.where, now.reaction)
    numbers = np.allclose([then.value, then.limit], [now.value, now.limit], SAME_VALUE, 0.0, equal_nan=True)
    return words and bool(numbers)


def _said(fault: Fault | None) -> str:
    return "none" if fault is None else str(fault)


def _velocities(command: Command) -> str:
    return f"{command.screw!r}, {command.translation!r}, {command.rotation!r}"
