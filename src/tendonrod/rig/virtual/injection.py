"""Faults that a virtual bench is told to have: what, when, for how long, where."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import inf, isnan, nan

from ...errors import InvalidInput, finite, one_of

AXES = ("screw", "translation", "rotation")
DEVICES = (*AXES, "load_cell", "tracker")


class InjectionKind(StrEnum):
    """What can be made to go wrong; ``where`` and ``value`` as said."""

    CELL_NAN = "load cell gives no number"
    CELL_STALE = "load cell repeats its last reading"  # with its old time
    CELL_FROZEN = "load cell stands still"  # the same value with new times, as where a converter hangs
    CELL_SATURATED = "load cell at its full scale"
    CELL_JUMP = "load cell jumps"  # by value, N
    CELL_DEAD = "load cell reads zero"  # whatever pulls at it, as with a broken wire
    ENCODER_JUMP = "encoder jumps"  # where: an axis; by value, m or rad
    STALL = "axis stalls"  # where: an axis
    RUNAWAY = "axis runs away"  # where: an axis; at value, m/s or rad/s, whatever it is told but a hard stop
    TRACKER_LOST = "tracker lost"
    DEVICE_ERROR = "device does not answer"  # where: a device; an axis that hears nothing stops by its time-out
    CLOCK_LATE = "control periods late"  # by value, s, at every wait
    TENDON_BREAK = "tendon breaks"
    COMMAND_LOSS = "commands do not arrive"  # where: an axis, or "" for all


AT_AXIS = (InjectionKind.ENCODER_JUMP, InjectionKind.STALL, InjectionKind.RUNAWAY)
VALUED = (InjectionKind.CELL_JUMP, InjectionKind.ENCODER_JUMP, InjectionKind.RUNAWAY, InjectionKind.CLOCK_LATE)


@dataclass(frozen=True, kw_only=True)
class Injection:
    """A fault from ``time`` (s by the bench's clock) for ``duration`` (s); value, where: see `InjectionKind`.

    Raises `InvalidInput`.
    """

    kind: InjectionKind
    time: float
    duration: float = inf
    value: float = nan
    where: str = ""

    def __post_init__(self) -> None:
        kinds = [each.value for each in InjectionKind]
        object.__setattr__(self, "kind", InjectionKind(one_of("kind", self.kind, kinds)))
        finite("time", self.time)
        if not self.duration > 0.0:
            raise InvalidInput("duration", self.duration, "> 0")
        if (self.kind in VALUED) == isnan(self.value):
            raise InvalidInput("value", self.value, f"{'' if self.kind in VALUED else 'not '}given for {self.kind}")
        if self.kind in AT_AXIS:
            one_of("where", self.where, AXES)
        elif self.kind is InjectionKind.DEVICE_ERROR:
            one_of("where", self.where, DEVICES)
        elif self.kind is InjectionKind.COMMAND_LOSS:
            one_of("where", self.where, ("", *AXES))

    @property
    def end(self) -> float:
        """When it is over, s."""
        return self.time + self.duration


class Schedule:
    """The injections of a bench, asked by kind, place and time."""

    def __init__(self, injections: Iterable[Injection]) -> None:
        self._by_kind: dict[InjectionKind, list[Injection]] = {}
        for each in injections:
            self._by_kind.setdefault(each.kind, []).append(each)
        times = {t for found in self._by_kind.values() for each in found for t in (each.time, each.end)}
        self._times = sorted(times - {inf})

    def active(self, kind: InjectionKind, time: float, where: str = "") -> Injection | None:
        """The injection of this kind that acts at ``time`` on ``where``, None for none."""
        for each in self._by_kind.get(kind, ()):
            if each.time <= time < each.end and (not each.where or each.where == where):
                return each
        return None

    def next_change(self, time: float) -> float:
        """The first time after ``time`` at which an injection begins or ends, s."""
        while self._times and self._times[0] <= time:
            self._times.pop(0)
        return self._times[0] if self._times else inf
