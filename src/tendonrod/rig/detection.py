"""How faults are found: `DETECTION`, the rule, time bound and reaction of each kind, and `Watch`, which finds them.

Each fault is found in at most the time after its first sample, in control periods beside what `Limits` says:

===============  ==================================================  ======================  ========
fault            rule                                                found within            reaction
===============  ==================================================  ======================  ========
TENSION          reading > tension                                   1 period                release
TENSION_RATE     change over rate_window > tension_rate              rate_window + 1 period  release
TENSION_LOST     no reading that a pulled tendon gives [3]_          1 period                hold
STRAIN           strain(z / length, reading) > strain                1 period                release
SATURATION       flag of the cell, or 98 % of full_scale             1 period                release
TRAVEL           beyond travel by more than overrun                  1 period                hold
SPEED            above speed_margin * speed                          1 period                hold
ENCODER_JUMP     moved farther than it can, or reference lost        1 period                hold
STALL            off its command by more than lag [1]_               stall_time + 1 period   hold
NAN_SENSOR       a reading or its time is no finite number           1 period                hold
STALE_SENSOR     a reading's time is off by more than sensor_age,    sensor_age + 1 period   hold
                 or the clock goes back
TRACKER_LOST     no pose for tracker_time while running              tracker_time + 1 p.     hold
COMMAND_TIMEOUT  no command for command_timeout while running        command_timeout + 1 p.  hold
LATE             late_in_row late periods in a row while running     late_in_row + 1 p.      hold
DEVICE           its driver raised an error                          1 period                hold
RECORD           the recorder says so                                1 period                hold
CONTROLLER       it raised an error, or its command is no number     1 period                hold
STUCK            no progress of the task for patience                patience + 1 period     hold
EMERGENCY        asked for by a person, key or signal                1 period                stop [2]_
===============  ==================================================  ======================  ========

.. [1] For an axis that is off by at least 1.6 (lag + two periods of its speed) / stall_time: by default 0.1, 0.17 mm/s
   and 0.034 rad/s; what is slower may be forgotten as fast as it grows. An axis that calls itself stalled is found
   within one period.
.. [2] Ctrl-C and signals that end the process release instead: they leave a slack robot.
.. [3] By how much translation less screw has grown since the reading was last above twice slack: lost_pull while a
   tension above that is aimed at, and take_up whatever is aimed at, also where the tendon was never taut. So show a
   tendon that breaks at a small tension and a cell that reads zero, from the beginning too. Further a reading below
   -4 slack, as of a cell that is connected the wrong way round, and one above slack that stays the same to the last bit
   over half of lost_pull. Until then the tension rises unseen, by at most the pull over the compliance: on the bare
   tendon and a short robot (0.65 mm/N) 0.23 N for a reading that stands still, 0.5 N for lost_pull, 1.2 N for take_up.

`Watch` looks at one sample per period. What it needs of the past is small and of fixed size, so that a check costs
microseconds. No comparison lets a NaN pass: each asks whether a value is within its limit, not whether it is beyond.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, isfinite, nan

from .axis_watch import AxisWatch
from .interfaces import Command, Sample
from .limits import AXES, Limits
from .states import FaultKind, Finding, Reaction
from .tension_watch import StrainOf, TensionWatch

HOLD, RELEASE, STOP = Reaction.HOLD, Reaction.RELEASE, Reaction.STOP


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
        rule="reading < slack though pulled by lost_pull since it was 2 slack, which is aimed at; not above 2 slack "
        "though pulled by take_up; < -4 slack; the very same above slack though pulled by lost_pull / 2", reaction=HOLD
    ),
    FaultKind.TRAVEL: Detection(rule="position beyond travel by more than overrun", reaction=HOLD),
    FaultKind.SPEED: Detection(rule="|velocity| > speed_margin * speed", reaction=HOLD),
    FaultKind.STRAIN: Detection(rule="strain(z / length, reading) > strain", reaction=RELEASE),
    FaultKind.STALE_SENSOR: Detection(
        rule="|now - time of a reading| > sensor_age, or now before the last", after="sensor_age", reaction=HOLD
    ),
    FaultKind.NAN_SENSOR: Detection(rule="a reading or its time is not finite", reaction=HOLD),
    FaultKind.TRACKER_LOST: Detection(
        rule="no pose of a tool for tracker_time while running", after="tracker_time", reaction=HOLD
    ),
    FaultKind.ENCODER_JUMP: Detection(
        rule="|change| > jump + speed_margin * speed * time between readings, or no reference any more", reaction=HOLD
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
    FaultKind.STUCK: Detection(rule="no progress of the task for patience", after="patience", reaction=HOLD),
}  # fmt: skip


class Watch:
    """Finds the faults that show in samples. strain: None for no strain limit; tools: those that must be tracked."""

    def __init__(self, limits: Limits, strain: StrainOf | None = None, tools: tuple[str, ...] = ()) -> None:
        self.limits, self.strain, self.tools = limits, strain, tools
        self.restart()

    def restart(self) -> None:
        """Forget what was: after homing and after an acknowledgement, when positions and readings may have jumped."""
        self._axes = tuple(map(AxisWatch, AXES, self.limits.axes, [self.limits] * 3, range(3)))
        self._tension = TensionWatch(self.limits, self.strain)
        self._late, self._time = 0, -inf
        self._running_since = nan
        self._seen = dict.fromkeys(self.tools, -inf)

    @property
    def strain_at(self):
        """Strain at a translation (m) and a tension (N); see `TensionWatch.strain_at`."""
        return self._tension.strain_at

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
        if sample.time < self._time:
            yield Finding(FaultKind.STALE_SENSOR, sample.time - self._time, 0.0, "clock")
        self._time = sample.time
        yield from self._of_time(dt, since_command, running)
        yield from self._tension.found(sample)
        of_axes = [
            each
            for axis, state, velocity in zip(self._axes, states, velocities, strict=True)
            for each in axis.found(state, velocity, sample.time)
        ]
        yield from of_axes
        if any(each.kind is FaultKind.ENCODER_JUMP for each in of_axes):
            self._tension.forget_pull()
        yield from self._tension.found_by_pull(sample, running, sent.target)
        yield from self._of_tracker(sample, running)

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
