"""What gets through to the axes: a controller's command within the limits, and the speed of a release."""

from __future__ import annotations

from math import isfinite

from .interfaces import AxisLimits, AxisState, Command, Sample
from .limits import LATENCY, Limits, room_speed


def finite_command(command: object) -> Command | None:
    """``command`` in plain floats, None where it is no command or a velocity is not finite."""
    try:
        velocities = [float(getattr(command, name)) for name in ("screw", "translation", "rotation")]
        target = float(command.target)  # pyright: ignore[reportAttributeAccessIssue]
    except (AttributeError, TypeError, ValueError, OverflowError):
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

    Once slack it waits, and pays out again where the tension comes back above its soft limit. Out of time is final.
    """

    def __init__(self, limits: Limits, now: float) -> None:
        self._limits, self._since, self._was_slack = limits, now, False

    def speed(self, sample: Sample, now: float, is_homed: bool) -> float:
        """Velocity of the screw, 0 where there is nothing left to do.

        Without a reading it pays out for the whole time; not so on a bench that is not homed, where nobody knows by how
        much it may. There the travel is not known either: limit switch and time end the motion.
        """
        limits, force, screw = self._limits, sample.force, sample.screw
        known = isfinite(force.tension) and not force.saturated and abs(now - force.time) <= limits.sensor_age
        if known and force.tension < (limits.soft * limits.tension if self._was_slack else limits.slack):
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
