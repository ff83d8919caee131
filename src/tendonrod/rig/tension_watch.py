"""What the load cell says, compared with limits, strain and pull: the part of `detection` that looks at the tendon."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from math import isfinite, nan

from .axis_watch import of_age
from .interfaces import Force, Sample
from .limits import Limits
from .states import BELOW_ZERO, FaultKind, Finding

SATURATED = 0.98  # share of the full scale
PUSHED = 4.0  # times slack: so far below zero no zero and no drift of a cell that was tared brings a reading
FROZEN = 0.5  # share of lost_pull, by which the pull may change beside a reading that stays the same to the last bit

StrainOf = Callable[[float, float], float]  # (insertion, tension in N) -> strain


class TensionWatch:
    """Finds the faults of tendon and load cell. strain: None for no strain limit."""

    __slots__ = ("_aimed_at", "_limits", "_readings", "_same", "_strain", "_taut_at")

    def __init__(self, limits: Limits, strain: StrainOf | None = None) -> None:
        self._limits, self._strain = limits, strain
        self._readings: deque[tuple[float, float]] = deque()
        self.forget_pull()

    def forget_pull(self) -> None:
        """Where positions have jumped they do not say any more by how much was pulled."""
        self._taut_at = nan  # m, pulled length when the tendon was last seen taut, or when the watch began
        self._aimed_at = nan  # the same, since a tension is aimed at that must show
        self._same = nan, nan  # the last reading, and the pulled length (m) at which it began

    def found(self, sample: Sample) -> Iterator[Finding]:
        """What is wrong with the reading itself."""
        limits, force, position = self._limits, sample.force, sample.translation.position
        if force.saturated or abs(force.tension) >= SATURATED * limits.full_scale:
            yield Finding(FaultKind.SATURATION, force.tension, SATURATED * limits.full_scale, "load cell")
        if isfinite(force.tension):
            yield from self._of_tension(force, position)
        elif not force.saturated:  # a saturated cell need not give a number
            yield Finding(FaultKind.NAN_SENSOR, force.tension, where="load cell")
        yield from of_age(force.time, sample.time, limits.sensor_age, "load cell")

    def found_by_pull(self, sample: Sample, running: bool, target: float) -> Iterator[Finding]:
        """Whether the reading answers the pull; target: the tension (N) that the controller aims at, NaN for none."""
        pulled, tension = sample.translation.position - sample.screw.position, sample.force.tension
        if isfinite(pulled) and isfinite(tension):
            yield from self._of_pull(pulled, tension, running, running and target > 2.0 * self._limits.slack)

    def strain_at(self, position: float, tension: float) -> float:
        """Strain at translation ``position`` (m) and ``tension`` (N); 0 without a model, NaN where the model fails."""
        if self._strain is None:
            return 0.0
        try:
            return float(self._strain(position / self._limits.length, tension))
        except Exception:  # noqa: BLE001 - whatever the caller's model raises, it must not stop the interlock
            return nan

    def _of_tension(self, force: Force, position: float) -> Iterator[Finding]:
        limits, tension = self._limits, force.tension
        if tension > limits.tension:
            yield Finding(FaultKind.TENSION, tension, limits.tension)
        if isfinite(position) and not (strain := self.strain_at(position, tension)) <= limits.strain:
            yield Finding(FaultKind.STRAIN, strain, limits.strain)
        if isfinite(force.time) and not abs(rate := self._rate(force.time, tension)) <= limits.tension_rate:
            yield Finding(FaultKind.TENSION_RATE, rate, limits.tension_rate)
        if tension < -PUSHED * limits.slack:
            yield Finding(FaultKind.TENSION_LOST, tension, -PUSHED * limits.slack, BELOW_ZERO)

    def _rate(self, time: float, tension: float) -> float:
        """N/s, between the newest reading and the newest of those at least rate_window older; 0 before there is one."""
        kept, window = self._readings, self._limits.rate_window * (1.0 - 1e-6)
        if kept and time < kept[-1][0]:
            kept.clear()
        if not kept or time > kept[-1][0]:
            kept.append((time, tension))
        while len(kept) > 2 and time - kept[1][0] >= window:
            kept.popleft()
        span = time - kept[0][0]
        return (tension - kept[0][1]) / span if span >= window else 0.0

    def _of_pull(self, pulled: float, tension: float, running: bool, aimed: bool) -> Iterator[Finding]:
        """aimed: whether a tension is aimed at that must show."""
        limits = self._limits
        if tension > 2.0 * limits.slack:
            self._taut_at = self._aimed_at = pulled
        elif self._taut_at != self._taut_at:
            self._taut_at = pulled
        if not aimed:
            self._aimed_at = nan
        if tension != self._same[0]:
            self._same = tension, pulled
        if not running:
            return
        if tension < limits.slack and (lost := pulled - self._aimed_at) > limits.lost_pull:
            yield Finding(FaultKind.TENSION_LOST, lost, limits.lost_pull, "tendon or load cell")
        elif (lost := pulled - self._taut_at) > limits.take_up:
            yield Finding(FaultKind.TENSION_LOST, lost, limits.take_up, "tendon or load cell")
        if tension > limits.slack and (most := FROZEN * limits.lost_pull) < abs(lost := pulled - self._same[1]):
            yield Finding(FaultKind.TENSION_LOST, lost, most, "load cell stands still")
