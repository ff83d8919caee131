"""`Teleoperate`: the task of a bench that is steered by hand: goals move at the operator's rates, the axes follow.

Translation and rotation are driven to their goals, the lead screw keeps the tension with the winder's PI. Goals never
run more than `LEAD` ahead of what was measured, so that a robot that is held back does not catch up with a leap later.
"""

from __future__ import annotations

from math import nan, radians

from ..rig.drives import TURN, Machine
from ..rig.interfaces import Command, Sample
from ..rig.staged import TOLERANCE, Phase, Staged
from .commands import Jog
from .limits import NavigationLimits

LEAD = (1e-3, radians(5.0), 0.2)  # m, rad, N
SLACK = 0.05  # N: a tendon that is found with less is left as it is
DEAD_MAN = 0.15  # s, after which a jog that was not renewed ends
STAND = Jog()


class Teleoperate(Staged):
    """Follows `steer` until `finish`. coupled: whether the motor turns with the insertion, see `Scenario`."""

    name = "teleoperate"

    def __init__(self, machine: Machine, limits: NavigationLimits, coupled: bool = True) -> None:
        super().__init__(machine, None, TOLERANCE)
        self.limits, self.coupled, self.target = limits, coupled, 0.0
        self._jog, self._left, self._turned, self._moves = STAND, 0.0, nan, False
        self._in_phases({Phase.FOLLOW: self._following})

    def steer(self, jog: Jog, time: float = DEAD_MAN) -> None:
        """Move at ``jog`` for the next ``time`` s of the bench, unless told otherwise before."""
        self._jog, self._left = jog, time

    def watch(self, sample: Sample, dt: float) -> None:
        """Follow the tension of a bench that does not run, so that what is shown stays true."""
        self.smooth.update(sample.force.tension, dt)

    def resume(self, homed: bool) -> None:
        """Begin again, on a bench that stood meanwhile: nothing moves until it is steered, the tension stays.

        homed: whether it has looked for its references; the motor's full turns are then counted anew.
        """
        self.steer(STAND, 0.0)
        self._z = nan  # the next update begins where the axes are
        self.target, self._moves = self.tension if self.tension > SLACK else 0.0, False
        self.winder.reset()
        for each in self._drives:
            each.ramp.velocity = 0.0
        if homed:
            self._turned = nan

    def finish(self) -> None:
        """There is nothing more to do."""
        self.phase = Phase.DONE

    @property
    def tension(self) -> float:
        """Of the tendon, filtered, N; 0 before the first reading."""
        value = self.smooth.value
        return max(value, 0.0) if value == value else 0.0

    def section_rotation(self, sample: Sample) -> float:
        """Of the section frame at the exit, rad; full turns of the motor that it began with do not count."""
        if self._turned != self._turned:
            self._turned = TURN * round((sample.rotation.position - self._along(sample)) / TURN)
        return sample.rotation.position - self._along(sample) - self._turned

    def _along(self, sample: Sample) -> float:
        """Motor's angle of follow-the-leader motion at this insertion, rad."""
        return self.machine.turn(self._insertion(sample), 0.0)

    def _share(self) -> float:
        return nan  # only the operator knows how much is left, so that the loop never takes a rest for being stuck

    def _following(self, sample: Sample, dt: float) -> Command:
        jog = self._jog if self._left > 0.0 else STAND
        span, self._left = min(max(dt, 0.0), DEAD_MAN), self._left - dt
        if jog.insertion == jog.rotation == 0.0 and self._moves:  # what is still to be caught up with is dropped
            self._z, self._phi = sample.translation.position, sample.rotation.position
        self._moves = not jog.insertion == jog.rotation == 0.0
        speed, turn = self._goals(jog, sample, span)
        if self.target <= 0.0 and self.tension <= 0.0 and jog.tension <= 0.0:
            return self._loose(sample, dt, speed, turn)
        return self._wound(sample, dt, self.target, speed, turn)

    def _loose(self, sample: Sample, dt: float, speed: float, turn: float) -> Command:
        """Axes to their goals, which move at ``speed`` and ``turn``; the screw goes along, the tendon stays slack."""
        z = self.translation.to(self._z, sample.translation, dt, speed)
        screw = self.screw.at(z, sample.screw, dt)
        return Command(screw=screw, translation=z, rotation=self.rotation.to(self._phi, sample.rotation, dt, turn))

    def _goals(self, jog: Jog, sample: Sample, dt: float) -> tuple[float, float]:
        """Move the goals on by ``dt`` s; returns the speeds (m/s, rad/s) at which those of the axes move."""
        z, phi, length = self._z, self._phi, self.machine.length
        high = min(self.limits.insertion * length, self.machine.translation.high)
        self._z = _near(z + jog.insertion * dt, sample.translation.position, LEAD[0], 0.0, high)
        ahead = self.machine.turn((self._z - z) / length, 0.0) - self.machine.turn(0.0, 0.0) if self.coupled else 0.0
        travel = self.machine.rotation
        wanted = phi + ahead + jog.rotation * dt
        self._phi = _near(wanted, sample.rotation.position, LEAD[1], travel.low, travel.high)
        tension = self.target + jog.tension * dt
        self.target = _near(tension, max(self.tension, 0.0), LEAD[2], 0.0, self.limits.tension)
        return ((self._z - z) / dt, (self._phi - phi) / dt) if dt > 0.0 else (0.0, 0.0)


def _near(goal: float, measured: float, lead: float, low: float, high: float) -> float:
    """``goal`` no further than ``lead`` from what was measured, within low to high."""
    return min(max(goal, measured - lead, low), measured + lead, high)
