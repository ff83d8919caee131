"""How faults are found: `DETECTION`, the rule, time bound and reaction of each kind, and `Watch`, which finds them.

Each fault is found in at most the time after its first sample, in control periods beside what `Limits` says:

===============  ==================================================  ======================  ========
fault            rule                                                found within            reaction
===============  ==================================================  ======================  ========
TENSION          reading > tension                                   1 period                release
TENSION_RATE     change over rate_window > tension_rate              rate_window + 1 period  release
TENSION_LOST     < slack after a pull of lost_pull [3]_              1 period                hold
STRAIN           strain(z / length, reading) > strain                1 period                release
SATURATION       flag of the cell, or 98 % of full_scale             1 period                release
TRAVEL           beyond travel by more than overrun                  1 period                hold
SPEED            above speed_margin * speed                          1 period                hold
ENCODER_JUMP     moved farther than it can since the last reading    1 period                hold
STALL            off its command by more than lag [1]_               stall_time + 1 period   hold
NAN_SENSOR       a reading or its time is no finite number           1 period                hold
STALE_SENSOR     a reading's time is off by more than sensor_age     sensor_age + 1 period   hold
TRACKER_LOST     no pose for tracker_time while running              tracker_time + 1 p.     hold
COMMAND_TIMEOUT  no command for command_timeout while running        command_timeout + 1 p.  hold
LATE             late_in_row late periods in a row while running     late_in_row + 1 p.      hold
DEVICE           its driver raised an error                          1 period                hold
RECORD           the recorder says so                                1 period                hold
CONTROLLER       it raised an error, or its command is no number     1 period                hold
EMERGENCY        asked for by a person, key or signal                1 period                stop [2]_
===============  ==================================================  ======================  ========

.. [1] For an axis that is off by at least 1.6 (lag + two periods of its speed) / stall_time: by default 0.1, 0.17 mm/s
   and 0.034 rad/s; what is slower may be forgotten as fast as it grows. An axis that calls itself stalled is found
   within one period.
.. [2] Ctrl-C and signals that end the process release instead: they leave a slack robot.
.. [3] While a tension above twice slack is aimed at: by how much translation less screw has grown since the reading was
   last above twice slack. A tendon broken at a small tension shows so, and a cell that reads zero.

`Watch` looks at one sample per period. What it needs of the past is small and of fixed size, so that a check costs
microseconds. No comparison lets a NaN pass: each asks whether a value is within its limit, not whether it is beyond.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import NamedTuple

from .interfaces import AxisLimits, AxisState, Command, Force, Sample
from .limits import AXES, LATENCY, Limits
from .states import FaultKind, Reaction

HOLD, RELEASE, STOP = Reaction.HOLD, Reaction.RELEASE, Reaction.STOP
SATURATED = 0.98  # share of the full scale

StrainOf = Callable[[float, float], float]  # (insertion, tension in N) -> strain


@dataclass(frozen=True, kw_only=True)
class Detection:
    """How a kind of fault is found: the rule, the time it takes at most, and the reaction.

    after: the field of `Limits` that says how long the condition must last, s (or a number of periods), "" for none;
    periods: how many control periods come on top.
    """

    rule: str
    reaction: Reaction
    after: str = ""
    periods: int = 1

    def bound(self, limits: Limits, period: float | None = None) -> float:
        """Longest time (s) from the first sample that shows the condition; period: longest in it, s."""
        period = limits.period if period is None else period
        lasting = getattr(limits, self.after) if self.after else 0.0
        return self.periods * period + (lasting * period if isinstance(lasting, int) else lasting)


DETECTION: dict[FaultKind, Detection] = {
    FaultKind.TENSION: Detection(rule="reading > tension", reaction=RELEASE),
    FaultKind.TENSION_RATE: Detection(
        rule="|change over rate_window| / rate_window > tension_rate", after="rate_window", reaction=RELEASE
    ),
    FaultKind.TENSION_LOST: Detection(
        rule="reading < slack though pulled by lost_pull since it was 2 slack, which is aimed at", reaction=HOLD
    ),
    FaultKind.TRAVEL: Detection(rule="position beyond travel by more than overrun", reaction=HOLD),
    FaultKind.SPEED: Detection(rule="|velocity| > speed_margin * speed", reaction=HOLD),
    FaultKind.STRAIN: Detection(rule="strain(z / length, reading) > strain", reaction=RELEASE),
    FaultKind.STALE_SENSOR: Detection(
        rule="|now - time of a reading| > sensor_age", after="sensor_age", reaction=HOLD
    ),
    FaultKind.NAN_SENSOR: Detection(rule="a reading or its time is not finite", reaction=HOLD),
    FaultKind.TRACKER_LOST: Detection(
        rule="no pose of a tool for tracker_time while running", after="tracker_time", reaction=HOLD
    ),
    FaultKind.ENCODER_JUMP: Detection(
        rule="|change| > jump + speed_margin * speed * time between readings", reaction=HOLD
    ),
    FaultKind.SATURATION: Detection(rule="cell says so, or |reading| >= 98 % of full_scale", reaction=RELEASE),
    FaultKind.STALL: Detection(
        rule="motion differs from the command by more than lag (forgotten with stall_time), or the axis says so",
        after="stall_time", reaction=HOLD,
    ),
    FaultKind.COMMAND_TIMEOUT: Detection(
        rule="no command for command_timeout while running", after="command_timeout", reaction=HOLD
    ),
    FaultKind.LATE: Detection(
        rule="late_in_row periods longer than late_share * period while running", after="late_in_row", reaction=HOLD
    ),
    FaultKind.DEVICE: Detection(rule="its driver raised an error", reaction=HOLD),
    FaultKind.EMERGENCY: Detection(rule="asked for by key, signal or API", reaction=STOP),
    FaultKind.RECORD: Detection(rule="the recorder said so", reaction=HOLD),
    FaultKind.CONTROLLER: Detection(rule="it raised an error or commanded what is no finite number", reaction=HOLD),
}  # fmt: skip


class Finding(NamedTuple):
    """A condition found: its kind, the value, the limit that it passed, and where."""

    kind: FaultKind
    value: float = nan
    limit: float = nan
    where: str = ""


class Watch:
    """Finds the faults that show in samples. strain: None for no strain limit; tools: those that must be tracked."""

    def __init__(self, limits: Limits, strain: StrainOf | None = None, tools: tuple[str, ...] = ()) -> None:
        self.limits, self.strain, self.tools = limits, strain, tools
        self.restart()

    def restart(self) -> None:
        """Forget what was: after homing and after an acknowledgement, when positions and readings may have jumped."""
        self._axes = tuple(map(_AxisWatch, AXES, self.limits.axes, [self.limits] * 3, range(3)))
        self._readings: deque[tuple[float, float]] = deque(maxlen=1024)
        self._late = 0
        self._taut_at = nan  # m, pulled length when the tendon was last seen taut
        self._running_since = nan
        self._seen = dict.fromkeys(self.tools, -inf)

    def found(self, sample: Sample, sent: Command, dt: float, since_command: float, running: bool) -> Iterator[Finding]:
        """What is wrong with ``sample``, causes before what follows from them.

        sent: the command that the axes had since the sample before; dt: s since then; since_command: s since the last
        command; running: whether a controller has the bench.
        """
        if not isfinite(sample.time):
            yield Finding(FaultKind.NAN_SENSOR, sample.time, where="clock")
            return
        states, velocities = (sample.screw, sample.translation, sample.rotation), (
            sent.screw, sent.translation, sent.rotation,
        )  # fmt: skip
        yield from self._of_time(dt, since_command, running)
        yield from self._of_force(sample.force, sample.time, sample.translation.position)
        yield from self._of_pull(sample, running and sent.target > 2.0 * self.limits.slack)
        for axis, state, velocity in zip(self._axes, states, velocities, strict=True):
            yield from axis.found(state, velocity, sample.time)
        yield from self._of_tracker(sample, running)

    def strain_at(self, position: float, tension: float) -> float:
        """Strain at translation ``position`` (m) and ``tension`` (N); 0 without a model, NaN where the model fails."""
        if self.strain is None:
            return 0.0
        try:
            return float(self.strain(position / self.limits.length, tension))
        except Exception:  # noqa: BLE001 - whatever the caller's model raises, it must not stop the interlock
            return nan

    def _of_force(self, force: Force, now: float, position: float) -> Iterator[Finding]:
        limits, tension = self.limits, force.tension
        if force.saturated or abs(tension) >= SATURATED * limits.full_scale:
            yield Finding(FaultKind.SATURATION, tension, SATURATED * limits.full_scale, "load cell")
        if isfinite(tension):
            yield from self._of_tension(force, position)
        elif not force.saturated:  # a saturated cell need not give a number
            yield Finding(FaultKind.NAN_SENSOR, tension, where="load cell")
        yield from _of_age(force.time, now, limits.sensor_age, "load cell")

    def _of_tension(self, force: Force, position: float) -> Iterator[Finding]:
        limits, tension = self.limits, force.tension
        if tension > limits.tension:
            yield Finding(FaultKind.TENSION, tension, limits.tension)
        if isfinite(position) and not (strain := self.strain_at(position, tension)) <= limits.strain:
            yield Finding(FaultKind.STRAIN, strain, limits.strain)
        if isfinite(force.time) and not abs(rate := self._rate(force.time, tension)) <= limits.tension_rate:
            yield Finding(FaultKind.TENSION_RATE, rate, limits.tension_rate)

    def _rate(self, time: float, tension: float) -> float:
        """N/s, between the newest reading and the newest of those at least rate_window older; 0 before there is one."""
        kept, window = self._readings, self.limits.rate_window * (1.0 - 1e-6)
        if kept and time < kept[-1][0]:
            kept.clear()
        if not kept or time > kept[-1][0]:
            kept.append((time, tension))
        while len(kept) > 2 and time - kept[1][0] >= window:
            kept.popleft()
        span = time - kept[0][0]
        return (tension - kept[0][1]) / span if span >= window else 0.0

    def _of_pull(self, sample: Sample, aimed: bool) -> Iterator[Finding]:
        """aimed: whether a tension is aimed at that must show."""
        pulled, tension = sample.translation.position - sample.screw.position, sample.force.tension
        if not aimed:
            self._taut_at = nan
        elif tension > 2.0 * self.limits.slack:
            self._taut_at = pulled
        elif tension < self.limits.slack and (lost := pulled - self._taut_at) > self.limits.lost_pull:
            yield Finding(FaultKind.TENSION_LOST, lost, self.limits.lost_pull, "tendon or load cell")

    def _of_tracker(self, sample: Sample, running: bool) -> Iterator[Finding]:
        for frame in sample.frames:
            if frame.tool in self._seen and not frame.is_lost and frame.time > self._seen[frame.tool]:
                self._seen[frame.tool] = min(frame.time, sample.time)
        if not running:
            self._running_since = nan
            return
        if self._running_since != self._running_since:
            self._running_since = sample.time
        for tool, seen in self._seen.items():
            if not (age := sample.time - max(seen, self._running_since)) <= self.limits.tracker_time:
                yield Finding(FaultKind.TRACKER_LOST, age, self.limits.tracker_time, tool)

    def _of_time(self, dt: float, since_command: float, running: bool) -> Iterator[Finding]:
        limits = self.limits
        longest = limits.late_share * limits.period
        self._late = self._late + 1 if running and not dt <= longest else 0
        if running and not since_command <= limits.command_timeout:
            yield Finding(FaultKind.COMMAND_TIMEOUT, since_command, limits.command_timeout)
        if self._late >= limits.late_in_row:
            yield Finding(FaultKind.LATE, dt, longest)


class _AxisWatch:
    """What one axis did, compared with what it can and what it was told."""

    __slots__ = (
        "_delay", "_error", "_followed", "_jump", "_lag", "_last", "_overrun", "_peak", "_stall_time", "age", "axis",
        "name", "top",
    )  # fmt: skip

    def __init__(self, name: str, axis: AxisLimits, limits: Limits, i: int) -> None:
        self.name, self.axis, self.age = name, axis, limits.sensor_age
        self.top = limits.speed_margin * axis.speed
        self._overrun, self._jump, self._lag = limits.overrun[i], limits.jump[i], limits.lag[i]
        self._stall_time = limits.stall_time
        self._last: AxisState | None = None
        self._followed = 0.0  # velocity of an ideal axis that obeys the commands with the stated acceleration
        self._peak = 0.0  # its speed, forgotten with stall_time
        self._delay = LATENCY * limits.period
        self._error = 0.0  # by how much the motion differs from that axis', forgotten with stall_time

    def found(self, state: AxisState, sent: float, now: float) -> Iterator[Finding]:
        position, velocity, axis = state.position, state.velocity, self.axis
        if not (isfinite(position) and isfinite(velocity)):
            yield Finding(FaultKind.NAN_SENSOR, position, where=self.name)
        yield from _of_age(state.time, now, self.age, self.name)
        if position > axis.high + self._overrun:
            yield Finding(FaultKind.TRAVEL, position, axis.high, self.name)
        if position < axis.low - self._overrun:
            yield Finding(FaultKind.TRAVEL, position, axis.low, self.name)
        if abs(velocity) > self.top:
            yield Finding(FaultKind.SPEED, velocity, self.axis.speed, self.name)
        if state.stalled:
            yield Finding(FaultKind.STALL, where=self.name)
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
            expected = min(max(change, min(expected, 0.0)), max(expected, 0.0))
        fading = 1.0 + step / self._stall_time
        self._peak = max(abs(self._followed), self._peak / fading)
        self._error = (self._error + change - expected) / fading
        return self._error


def _of_age(time: float, now: float, limit: float, where: str) -> Iterator[Finding]:
    if not isfinite(time):
        yield Finding(FaultKind.NAN_SENSOR, time, where=where)
    elif not (age := abs(now - time)) <= limit:
        yield Finding(FaultKind.STALE_SENSOR, age, limit, where)
