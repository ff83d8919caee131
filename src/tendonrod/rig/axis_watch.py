"""What one axis did, compared with what it can and what it was told: the part of `detection` that looks at axes."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, isfinite

from .interfaces import AxisLimits, AxisState
from .limits import LATENCY, Limits
from .states import FaultKind, Finding


class AxisWatch:
    """What one axis did, compared with what it can and what it was told."""

    __slots__ = (
        "_delay", "_error", "_followed", "_jump", "_lag", "_last", "_least", "_overrun", "_peak", "_stall_time", "age",
        "axis", "name", "top",
    )  # fmt: skip

    def __init__(self, name: str, axis: AxisLimits, limits: Limits, i: int) -> None:
        self.name, self.axis, self.age = name, axis, limits.sensor_age
        self.top = limits.speed_margin * axis.speed
        self._overrun, self._jump, self._lag = limits.overrun[i], limits.jump[i], limits.lag[i]
        self._stall_time = limits.stall_time
        self._last: AxisState | None = None
        self._followed = 0.0  # velocity of an ideal axis that obeys the commands with the stated acceleration
        self._peak = 0.0  # its speed, forgotten with stall_time
        self._least = self._delay = LATENCY * limits.period  # s, in which a command takes effect
        self._error = 0.0  # by how much the motion differs from that axis', forgotten with stall_time

    def found(self, state: AxisState, sent: float, now: float) -> Iterator[Finding]:
        position, velocity, axis = state.position, state.velocity, self.axis
        if not (isfinite(position) and isfinite(velocity)):
            yield Finding(FaultKind.NAN_SENSOR, position, where=self.name)
        yield from of_age(state.time, now, self.age, self.name)
        if position > axis.high + self._overrun:
            yield Finding(FaultKind.TRAVEL, position, axis.high, self.name)
        if position < axis.low - self._overrun:
            yield Finding(FaultKind.TRAVEL, position, axis.low, self.name)
        if abs(velocity) > self.top:
            yield Finding(FaultKind.SPEED, velocity, self.axis.speed, self.name)
        if state.stalled:
            yield Finding(FaultKind.STALL, where=self.name)
        if self._last is not None and self._last.homed and not state.homed:
            yield Finding(FaultKind.ENCODER_JUMP, where=self.name)
        if isfinite(position) and isfinite(state.time):
            yield from self._of_motion(state, sent)

    def _of_motion(self, state: AxisState, sent: float) -> Iterator[Finding]:
        last, self._last = self._last, state
        if last is None or not (step := state.time - last.time) > 0.0:
            return
        change = state.position - last.position
        if not abs(change) <= (possible := self._jump + self.top * step):
            yield Finding(FaultKind.ENCODER_JUMP, change, possible, self.name)
            return
        error = self._behind(change, sent, step)
        if not abs(error) <= (most := self._lag + self._delay * self._peak):
            self._error = 0.0 if error != error else error
            yield Finding(FaultKind.STALL, error, most, self.name)

    def _behind(self, change: float, sent: float, step: float) -> float:
        """Motion beyond that of an axis which obeys, m or rad; its mean velocity over ``step`` is exact for a ramp."""
        before, most = self._followed, self.axis.acceleration * step
        self._followed = min(max(sent, before - most), before + most)
        expected = self._followed * step
        if 0.0 < self.axis.acceleration < inf:
            expected -= 0.5 * (self._followed - before) * abs(self._followed - before) / self.axis.acceleration
        if sent == 0.0:  # it may stop faster than it accelerates
            expected = _between(change, expected)
            self._followed = _between(change / step, self._followed)
        fading = 1.0 + step / self._stall_time
        self._delay = max(self._least, LATENCY * step, self._delay / fading)  # a late period's command comes late too
        self._peak = max(abs(self._followed), self._peak / fading)
        self._error = (self._error + change - expected) / fading
        return self._error


def _between(value: float, end: float) -> float:
    """``value``, held between 0 and ``end``."""
    return min(max(value, min(end, 0.0)), max(end, 0.0))


def of_age(time: float, now: float, limit: float, where: str) -> Iterator[Finding]:
    """A reading's ``time`` that is no number, or too far from ``now``."""
    if not isfinite(time):
        yield Finding(FaultKind.NAN_SENSOR, time, where=where)
    elif not (age := abs(now - time)) <= limit:
        yield Finding(FaultKind.STALE_SENSOR, age, limit, where)
