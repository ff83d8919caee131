"""What a bench is to do: `FollowLeader`, `Retract`, `Progressive`, `TensionHold`; all are `interfaces.Task`.

In follow-the-leader motion the lead screw pays out at a steady rate and the controller drives the translation on
e = tau_FTL(eta) - tau; eta = z / L, and the rotation follows eta (paper, II-D). Everywhere else the translation is
driven to a position and the screw keeps the tension.
"""

from __future__ import annotations

from math import nan, pi

from ..errors import InvalidInput, nonnegative, one_of, positive, within
from .control import Ramp, TensionController, braked
from .drives import NEAR, Machine, full_turn, pace, within_travel
from .interfaces import STILL, Command, Sample
from .profiles import Profile
from .progressive import Progressive
from .staged import START, TOLERANCE, Phase, Staged

__all__ = ["FollowLeader", "Phase", "Progressive", "Retract", "TensionHold"]

EASE = 1.0  # s: in which the screw comes up to its rate and slows down again, kp / ki of the paper's loop
WAY = tuple(k / 20 for k in range(21))  # shares of the way at which the rotation's travel is looked at
CREEP = 0.05  # of its rate: the screw's least speed before the end
SLACK = 0.02  # N: a tendon below it is slack
LONGEST_RELEASE = 3e-3  # m, of the screw to let the tendon go: 4 N of a body at `START`


class _Along(Staged):
    """Motion along a follow-the-leader profile: the screw at its rate, the translation by the controller."""

    def __init__(
        self, profile: Profile, machine: Machine, controller: TensionController | None, screw_rate: float | None,
        goal: float, direction: int, winder: TensionController | None, tolerance: float,
    ) -> None:  # fmt: skip
        super().__init__(machine, winder, tolerance)
        self.profile, self.direction = profile, direction
        self.controller = controller if controller is not None else machine.controller()
        self.screw_rate = pace(screw_rate, machine.screw)
        if 1.1 * self.screw_rate > self.controller.limit:
            raise InvalidInput(
                "screw_rate", self.screw_rate, "well below the controller's limit, so that it can follow"
            )
        self.goal, self._from, self._eta, self._turned = within("end", goal, 0.0, 1.0), nan, nan, 0.0
        self._feed = Ramp(self.screw_rate, self.screw_rate / EASE)

    def _share(self) -> float:
        return (self._eta - self._from) / (self.goal - self._from) if self.goal != self._from else 0.0

    def _begin(self, sample: Sample) -> None:
        super()._begin(sample)
        self._eta = self._from = self._insertion(sample)
        way = [self._angle(self._eta + share * (self.goal - self._eta)) for share in WAY]
        here = way[0] if self._eta <= START else sample.rotation.position
        self._turned = full_turn(here, way, self.machine.rotation)

    def _angle(self, eta: float) -> float:
        """Where the rotation belongs at ``eta``, rad."""
        return self.machine.turn(eta, self.profile.rotation.value(eta)) + self._turned

    def _taking_up(self, sample: Sample, dt: float) -> Command:
        self._phi = self._angle(self._z / self.machine.length)
        target = self.profile.tension.value(self._z / self.machine.length)
        if self._is_at(target, sample, dt) and self._has_arrived(sample):
            self._next(sample)
            self.controller.reset()
            self._feed.velocity = 0.0
        return self._wound(sample, dt, target)

    def _going(self, sample: Sample, dt: float) -> Command:
        """One period of the loop of the paper's Fig. 7."""
        machine, eta = self.machine, self._insertion(sample)
        self._eta, room = eta, self.direction * (self.goal * machine.length - sample.translation.position)
        if room <= NEAR:
            self._next(sample)
            self._z = self.goal * machine.length
        screw = self._paid(sample, room, dt)
        target = self.profile.tension.value(eta)
        error = target - sample.force.tension
        self._watch(error, dt)
        z = self.controller.update(error, dt, screw / self.profile.pay_rate(eta))
        if z * self.direction > 0.0:
            z = braked(z, room, machine.translation.acceleration, dt)
        z = within_travel(z, sample.translation, machine.translation, dt)
        ahead = (2.0 * pi * machine.turns + self.profile.rotation.slope(eta)) * z / machine.length
        self._phi = self._angle(eta)
        turning = self.rotation.to(self._phi, sample.rotation, dt, ahead)
        return Command(screw=screw, translation=z, rotation=turning, target=target)

    def _paid(self, sample: Sample, room: float, dt: float) -> float:
        """The screw's velocity: its rate, eased in and out."""
        rate = min(self.screw_rate, max(CREEP * self.screw_rate, room / EASE)) if room > 0.0 else 0.0
        return within_travel(self._feed.update(self.direction * rate, dt), sample.screw, self.machine.screw, dt)


class FollowLeader(_Along):
    """Follow-the-leader insertion from ``start`` to ``end``, done once the tension has settled there.

    - profile: tension and rotation over the insertion; machine: `Machine.of` the bench.
    - screw_rate: m/s at which the tendon is paid out, eased in and out, None: 1 mm/s or 0.8 of its speed. controller:
      of the translation, the paper's if left out; its feed_forward adds screw_rate / (tendon paid out per translation).
    - start: insertion at which the tendon is taken up first; a robot that is further out starts from where it is.
    - winder: controller of the screw for taking up; tolerance: N, within which a tension counts as reached.

    Full turns of the rotation leave the robot as it is: further out than `START` it keeps the turn that it has, and the
    travel of the rotation may ask for another. Raises `InvalidInput`; `update` raises `TaskFailed` where the tension
    can't be taken up or is lost.
    """

    name = "follow the leader"

    def __init__(
        self, profile: Profile, machine: Machine, *, screw_rate: float | None = None,
        controller: TensionController | None = None, start: float = START, end: float = 1.0,
        winder: TensionController | None = None, tolerance: float = TOLERANCE,
    ) -> None:  # fmt: skip
        super().__init__(profile, machine, controller, screw_rate, end, 1, winder, tolerance)
        self.start = within("start", start, 0.0, end)
        self._in_phases(
            {
                Phase.START: self._starting,
                Phase.TAKE_UP: self._taking_up,
                Phase.INSERT: self._going,
                Phase.SETTLE: self._settling,
            }
        )

    def _starting(self, sample: Sample, dt: float) -> Command:
        self._z = max(self.start * self.machine.length, self._from * self.machine.length)
        self._phi = self._angle(self._z / self.machine.length)
        if self._has_arrived(sample):
            self._next(sample)
            self._from = self._eta = self._insertion(sample)
        return self._moved(sample, dt)

    def _settling(self, sample: Sample, dt: float) -> Command:
        self._phi = self._angle(self.goal)
        target = self.profile.tension.value(self.goal)
        if self._is_at(target, sample, dt) and self._has_arrived(sample):
            self._next(sample)
        return self._wound(sample, dt, target)


class Retract(_Along):
    """Follow-the-leader motion backwards: the screw winds in, the tension follows the profile back, the end is slack.

    end: insertion at which the robot stays. The rest as for `FollowLeader`.
    """

    name = "retract"

    def __init__(
        self, profile: Profile, machine: Machine, *, screw_rate: float | None = None,
        controller: TensionController | None = None, end: float = START,
        winder: TensionController | None = None, tolerance: float = TOLERANCE,
    ) -> None:  # fmt: skip
        super().__init__(profile, machine, controller, screw_rate, end, -1, winder, tolerance)
        self._in_phases(
            {
                Phase.TAKE_UP: self._taking_up,
                Phase.RETRACT: self._going,
                Phase.RELEASE: self._releasing,
            }
        )

    def _releasing(self, sample: Sample, dt: float) -> Command:
        wound = abs(sample.screw.position - self._screw_from)
        if self.reached.update(self.smooth.value <= SLACK, dt) or wound > LONGEST_RELEASE:
            self._next(sample)
            return STILL
        screw = self.screw.at(self.screw_rate, sample.screw, dt)
        return Command(screw=screw, translation=self.translation.to(self._z, sample.translation, dt), target=0.0)


class TensionHold(Staged):
    """Bring the tension to ``tension`` (N) and hold it for ``duration`` (s).

    axis "screw": the robot stays where it is; "translation": by the paper's loop, at a still screw, within its travel.
    """

    name = "hold the tension"

    def __init__(
        self, tension: float, duration: float, machine: Machine, *, axis: str = "screw",
        controller: TensionController | None = None, winder: TensionController | None = None,
        tolerance: float = TOLERANCE,
    ) -> None:  # fmt: skip
        super().__init__(machine, winder, tolerance)
        self.tension, self.duration = nonnegative("tension", tension), positive("duration", duration)
        self.axis = one_of("axis", axis, ("screw", "translation"))
        self.controller = controller if controller is not None else machine.controller()
        self._held = 0.0
        self._in_phases({Phase.TAKE_UP: self._taking_up, Phase.HOLD: self._holding})

    def _share(self) -> float:
        return self._held / self.duration

    def _taking_up(self, sample: Sample, dt: float) -> Command:
        if self._is_at(self.tension, sample, dt):
            self._next(sample)
            self.controller.reset()
        return self._wound(sample, dt, self.tension)

    def _holding(self, sample: Sample, dt: float) -> Command:
        self._held += max(dt, 0.0)
        error = self.tension - sample.force.tension
        self._watch(error, dt)
        if self._held >= self.duration:
            self._next(sample)
        if self.axis == "screw":
            return self._wound(sample, dt, self.tension)
        velocity = self.controller.update(error, dt)
        z = within_travel(velocity, sample.translation, self.machine.translation, dt)
        return Command(translation=z, rotation=self.rotation.to(self._phi, sample.rotation, dt), target=self.tension)
