"""`Teleoperate`: the task of a bench that is steered by hand: goals move at the operator's rates, the axes follow.

Translation and rotation are driven to their goals, the lead screw keeps the tension with the winder's PI. Goals never
run more than `LEAD` ahead of what was measured, so that a robot that is held back does not catch up with a leap later.
The turn that goes with the insertion follows what is measured of it, not its goal, which a slow axis never reaches.
"""

from __future__ import annotations

from math import inf, nan, radians

from ..rig.control import TensionController
from ..rig.drives import TURN, Machine
from ..rig.interfaces import STILL, Command, Sample
from ..rig.staged import TOLERANCE, Phase, Staged
from .commands import Jog
from .limits import NavigationLimits

LEAD = (1e-3, radians(5.0), 0.2)  # m, rad, N
SLACK = 0.05  # N: a tendon that is found with less is left as it is
DEAD_MAN = 0.15  # s, after which a jog that was not renewed ends
KEPT = 0.9  # share of an axis' speed that leaves room for control
STAND = Jog()


class Teleoperate(Staged):
    """Follows `steer` until `finish`. coupled: whether the motor turns with the insertion, see `Scenario`."""

    name = "teleoperate"

    def __init__(self, machine: Machine, limits: NavigationLimits, coupled: bool = True) -> None:
        super().__init__(machine, _winder(machine), TOLERANCE)
        self.limits, self.coupled, self.target = limits, coupled, 0.0
        self._jog, self._left, self._turned = STAND, 0.0, nan
        self._last = STAND  # of the period before
        self.asked = STILL  # the last command
        self._out = nan  # m, measured when the motor's goal was last brought along
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
        self.asked = STILL
        self._z = nan  # the next update begins where the axes are
        self.target = self.tension if self.tension > SLACK else 0.0
        self._last = STAND
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

    def _begin(self, sample: Sample) -> None:
        super()._begin(sample)
        self._out = sample.translation.position

    def _following(self, sample: Sample, dt: float) -> Command:
        span = min(max(dt, 0.0), DEAD_MAN)
        jog, span = (self._jog, min(span, self._left)) if self._left > 0.0 else (STAND, span)
        self._left -= dt
        self._drop(jog, sample)
        speed, turn = self._goals(jog, sample, span)
        if self.target <= 0.0 and self.tension <= 0.0 and jog.tension <= 0.0:
            self.asked = self._loose(sample, dt, speed, turn)
        else:
            self.asked = self._wound(sample, dt, self.target, speed, turn)
        return self.asked

    def _drop(self, jog: Jog, sample: Sample) -> None:
        """Where a motion ends or turns back, what is left to catch up with; not the turn that an insertion makes."""
        last, self._last = self._last, jog
        if _ends(last.insertion, jog.insertion):
            self._z = sample.translation.position
        if _ends(last.rotation, jog.rotation):
            self._phi = sample.rotation.position

    def _loose(self, sample: Sample, dt: float, speed: float, turn: float) -> Command:
        """Axes to their goals, which move at ``speed`` and ``turn``; the screw goes along, the tendon stays slack."""
        z = self.translation.to(self._z, sample.translation, dt, speed)
        screw = self.screw.at(z, sample.screw, dt)
        return Command(screw=screw, translation=z, rotation=self.rotation.to(self._phi, sample.rotation, dt, turn))

    def _goals(self, jog: Jog, sample: Sample, dt: float) -> tuple[float, float]:
        """Move the goals on by ``dt`` s; returns the speeds (m/s, rad/s) at which those of the axes move."""
        at, most, travel = sample.translation.position, self._fastest, self.machine.rotation
        speed = min(max(jog.insertion, -most), most)
        high = min(self.limits.insertion * self.machine.length, self.machine.translation.high)
        z, self._z = self._z, _near(self._z + speed * dt, at, LEAD[0], 0.0, high)
        along = self._turn_along(at - self._out)
        self._out = at if at == at else self._out  # a reading that is missing is caught up with by the next
        wanted = self._phi + (along if along == along else 0.0) + jog.rotation * dt
        self._phi = _near(wanted, sample.rotation.position, LEAD[1], travel.low, travel.high)
        tension = self.target + jog.tension * dt
        self.target = _near(tension, max(self.tension, 0.0), LEAD[2], 0.0, self.limits.tension)
        turn = jog.rotation + self._turn_along(self.translation.ramp.velocity)
        return (self._z - z) / dt if dt > 0.0 else 0.0, turn

    @property
    def _fastest(self) -> float:
        """Speed of insertion (m/s) with which translation, screw and, where it goes along, the rotation keep up."""
        turn, speed = abs(self._turn_along(1.0)), self.translation.limits.speed
        return KEPT * (min(speed, self.rotation.limits.speed / turn) if turn > 0.0 else speed)

    def _turn_along(self, inserted: float) -> float:
        """What the motor turns with so much insertion, rad for m or rad/s for m/s."""
        return TURN * self.machine.turns * inserted / self.machine.length if self.coupled else 0.0


def _winder(machine: Machine) -> TensionController:
    """Of the screw, which pays out what is inserted, as fast as it can: else the tension rises with each insertion."""
    limit = {} if machine.screw.speed == inf else {"limit": machine.screw.speed}
    return machine.winder(feed_forward=True, **limit)


def _ends(before: float, now: float) -> bool:
    """Whether a motion at rate ``before`` has ended, or turned back."""
    return before != 0.0 and before * now <= 0.0


def _near(goal: float, measured: float, lead: float, low: float, high: float) -> float:
    """``goal`` no further than ``lead`` from what was measured, within low to high."""
    return min(max(goal, measured - lead, low), measured + lead, high)
