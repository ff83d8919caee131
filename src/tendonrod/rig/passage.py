"""What gets through to the axes: a controller's command within the limits, and the speed of a release."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan

from .interfaces import AxisLimits, AxisState, Command, Sample
from .limits import LATENCY, Limits, room_speed
from .states import Fault, FaultKind

INWARD = -1e-4  # m/s, below which the screw winds in


def finite_command(command: object) -> Command | None:
    """``command`` in plain floats, None where it is no command or a velocity is not finite."""
    try:
        velocities = [float(getattr(command, name)) for name in ("screw", "translation", "rotation")]
        target = float(command.target)  # pyright: ignore[reportAttributeAccessIssue]
    except Exception:  # noqa: BLE001 - an attribute may be code of the controller's, and raise whatever it likes
        return None
    if not all(map(isfinite, velocities)):
        return None
    screw, translation, rotation = velocities
    return Command(screw=screw, translation=translation, rotation=rotation, target=target)


def possible(command: Command, sample: Sample, limits: Limits, taut: bool) -> Command:
    """``command`` within speeds and travel; where the tendon is ``taut``, without what raises its tension."""
    screw = within(command.screw, sample.screw, limits.screw, limits.period)
    translation = within(command.translation, sample.translation, limits.translation, limits.period)
    rotation = within(command.rotation, sample.rotation, limits.rotation, limits.period)
    if taut:
        screw, translation = max(screw, 0.0), min(translation, 0.0)
    return Command(screw=screw, translation=translation, rotation=rotation, target=command.target)


def within(velocity: float, state: AxisState, axis: AxisLimits, period: float) -> float:
    """``velocity`` no faster than allowed, nor than what still stops inside the travel; 0 where that is not known."""
    ahead = axis.high - state.position if velocity > 0.0 else state.position - axis.low
    if velocity == 0.0 or ahead != ahead or velocity * state.at_limit > 0.0:
        return 0.0
    most = min(axis.speed, room_speed(ahead, axis.acceleration, LATENCY * period))
    return min(max(velocity, -most), most)


class Release:
    """The screw pays out until the tendon is slack, for no longer than the time that the limits give.

    Once slack it waits, and pays out again where the tension comes back to twice slack, as where another axis is slow
    to stop. Out of time is final. A screw that winds in is stopped first; one that winds in though it is told to pay
    out is stopped for good, since every further command would only give it the power to pull.

    is_braking: whether the screw is to stand before it pays out.
    """

    def __init__(self, limits: Limits, now: float) -> None:
        self._limits, self._since, self._was_slack = limits, now, False
        self._farthest = nan  # m, of the screw since it was told to pay out
        self._runs_in = self.is_braking = False

    def speed(self, sample: Sample, now: float, is_homed: bool, faults: Sequence[Fault] = ()) -> float:
        """Velocity of the screw, 0 where there is nothing left to do, or while it brakes.

        Without a reading, or where ``faults`` say that it may be too low, it pays out for the whole time. Not so on a
        bench that is not homed, where nobody knows by how much it may. There the travel is not known either: limit
        switch and time end the motion; so it is where the screw's encoder jumped.
        """
        has_place = is_homed and not any(map(_spoils_place, faults))
        velocity = self._wanted(sample, now, has_place, not any(map(_spoils_reading, faults)))
        self.is_braking = False
        return self._turned_out(velocity, sample.screw, now) if velocity > 0.0 else velocity

    def _turned_out(self, velocity: float, screw: AxisState, now: float) -> float:
        """``velocity`` once the screw does not wind in any more."""
        is_known = abs(now - screw.time) <= self._limits.sensor_age and isfinite(screw.position)
        winds_in = is_known and screw.velocity < INWARD
        if is_known and self._farthest == self._farthest:
            self._farthest = max(self._farthest, screw.position)
            self._runs_in |= winds_in and self._farthest - screw.position > self._limits.lag[0]
        elif not winds_in:
            self._farthest = screw.position
        self.is_braking = self._farthest != self._farthest and winds_in
        return 0.0 if self._runs_in or self.is_braking else velocity

    def _wanted(self, sample: Sample, now: float, is_homed: bool, is_believed: bool) -> float:
        limits, force, screw = self._limits, sample.force, sample.screw
        fresh = abs(now - force.time) <= limits.sensor_age
        known = is_believed and isfinite(force.tension) and not force.saturated and fresh
        if known and force.tension < (2.0 * limits.slack if self._was_slack else limits.slack):
            self._since, self._was_slack = now, True
            return 0.0
        self._was_slack = self._was_slack and not known  # known and not slack: it came back
        if not known and (self._was_slack or not is_homed):
            return 0.0
        if not now - self._since <= limits.release_timeout or screw.at_limit > 0:
            return 0.0
        if not (is_homed and isfinite(screw.position)):
            return limits.release_rate
        return within(limits.release_rate, screw, limits.screw, limits.period)


def _spoils_reading(fault: Fault) -> bool:
    """Whether the load cell may read less than there is: it fell too fast, or did not rise as it must."""
    return fault.kind is FaultKind.TENSION_LOST or (fault.kind is FaultKind.TENSION_RATE and fault.value < 0.0)


def _spoils_place(fault: Fault) -> bool:
    """Whether the screw may be elsewhere than its encoder says."""
    return fault.kind is FaultKind.ENCODER_JUMP and fault.where == "screw"
