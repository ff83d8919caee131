"""`Staged`: a task in phases, and the moves that phases are made of."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from math import nan

from ..errors import positive
from .control import LowPass, TensionController
from .drives import NEAR, TURNED, AxisDrive, Lasting, Machine, TaskFailed, within_travel
from .interfaces import STILL, Command, Sample

START = 0.05  # insertion at which the tendon is taken up: of a shorter body the tension says little
TOLERANCE = 0.02  # N: a tension so near to its target counts as reached
LASTING = 0.2  # s: for how long it must stay there
SMOOTHING = 0.1  # s: time constant of the tension that is compared with the tolerance, against the cell's noise
LARGEST_ERROR, LOST_AFTER = 0.3, 0.5  # N, s: more than this for so long, and the tendon is no longer under control
LONGEST_WINDING = 10e-3  # m, of the screw to take up the tendon


class Phase(StrEnum):
    """Where a task is; for the live view and the record."""

    START = "going to the start"
    TAKE_UP = "taking up the tendon"
    INSERT = "inserting"
    RETRACT = "retracting"
    FOLLOW = "following the commands"
    HOLD = "holding the tension"
    SETTLE = "settling"
    RELEASE = "releasing the tendon"
    DONE = "done"


class Staged:
    """A task in phases: `_in_phases` names the method of each in order; a method moves on by `_next`."""

    name = ""

    def __init__(self, machine: Machine, winder: TensionController | None, tolerance: float) -> None:
        self.machine, self.tolerance = machine, positive("tolerance", tolerance)
        self.winder = winder if winder is not None else machine.winder()
        self._drives = tuple(map(AxisDrive, (machine.screw, machine.joint, machine.rotation)))
        self.screw, self.translation, self.rotation = self._drives
        self.smooth, self.reached, self.lost = LowPass(SMOOTHING), Lasting(LASTING), Lasting(LOST_AFTER)
        self._phases: dict[Phase, Callable[[Sample, float], Command]] = {}
        self._z = self._phi = self._screw_from = nan  # set in the first period: where the axes are held, the screw was
        self.phase = Phase.START

    def _in_phases(self, phases: dict[Phase, Callable[[Sample, float], Command]]) -> None:
        self._phases, self.phase = phases, next(iter(phases))

    @property
    def is_done(self) -> bool:
        """Whether there is nothing left to do."""
        return self.phase is Phase.DONE

    @property
    def progress(self) -> float:
        """Share that is done, 0 to 1."""
        return 1.0 if self.is_done else min(max(self._share(), 0.0), 1.0)

    def update(self, sample: Sample, dt: float) -> Command:
        """Velocities for the next period. Raises `TaskFailed`."""
        if self._z != self._z:
            self._begin(sample)
        self.smooth.update(sample.force.tension, dt)
        return STILL if self.is_done else self._phases[self.phase](sample, dt)

    def _begin(self, sample: Sample) -> None:
        self._z, self._phi = sample.translation.position, sample.rotation.position
        self._screw_from = sample.screw.position

    def _share(self) -> float:
        raise NotImplementedError

    def _next(self, sample: Sample) -> None:
        order = [*self._phases, Phase.DONE]
        self.phase = order[order.index(self.phase) + 1]
        self._screw_from, self.reached.since, self.lost.since = sample.screw.position, 0.0, 0.0
        self.winder.reset(-sample.screw.velocity if self.phase is Phase.SETTLE else 0.0)
        for drive, at in zip(self._drives, (sample.screw, sample.translation, sample.rotation), strict=True):
            drive.ramp.velocity = at.velocity

    def _insertion(self, sample: Sample) -> float:
        return sample.translation.position / self.machine.length

    def _moved(self, sample: Sample, dt: float) -> Command:
        """Translation and rotation to where they are wanted; the screw goes along and leaves the tendon as it is."""
        z = self.translation.to(self._z, sample.translation, dt)
        screw = self.screw.at(z, sample.screw, dt)
        return Command(screw=screw, translation=z, rotation=self.rotation.to(self._phi, sample.rotation, dt))

    def _has_arrived(self, sample: Sample) -> bool:
        return (
            abs(self._z - sample.translation.position) <= NEAR and abs(self._phi - sample.rotation.position) <= TURNED
        )

    def _wound(self, sample: Sample, dt: float, target: float, speed: float = 0.0, turn: float = 0.0) -> Command:
        """Axes to where they are wanted, which moves at ``speed`` and ``turn``; the screw gives ``target`` (N)."""
        z = self.translation.to(self._z, sample.translation, dt, speed)
        velocity = -self.winder.update(target - sample.force.tension, dt, -z)
        screw = within_travel(velocity, sample.screw, self.machine.screw, dt)
        turning = self.rotation.to(self._phi, sample.rotation, dt, turn)
        return Command(screw=screw, translation=z, rotation=turning, target=target)

    def _is_at(self, target: float, sample: Sample, dt: float) -> bool:
        """Whether the tension has stayed at ``target``; fails where the screw winds and winds."""
        wound = abs(sample.screw.position - self._screw_from)
        if wound > LONGEST_WINDING:
            raise TaskFailed(
                f"{self.phase.value}: {self.smooth.value:.3g} N after {1e3 * wound:.3g} mm of winding, "
                f"wanted {target:.3g} N; is the tendon attached?"
            )
        return self.reached.update(abs(target - self.smooth.value) <= self.tolerance, dt)

    def _watch(self, error: float, dt: float) -> None:
        """Fails where the tension has left its target for good, as where a tendon breaks."""
        if self.lost.update(abs(error) > LARGEST_ERROR, dt):
            raise TaskFailed(f"{self.phase.value}: tension {abs(error):.3g} N off its target for {LOST_AFTER:g} s")
