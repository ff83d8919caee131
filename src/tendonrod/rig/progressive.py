"""`Progressive`: any motion of insertion, rotation and tension over time, as in the files of `tendonrod motion`."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi
from os import PathLike

import numpy as np

from ..errors import InvalidInput, finite, nonnegative, numbers, within
from .commandfile import read_commands
from .control import Ramp, TensionController
from .drives import Lasting, Machine, TaskFailed, full_turn
from .interfaces import Command, Sample
from .profiles import Cubics
from .staged import START, TOLERANCE, Phase, Staged

SHARE = 1 / 3  # of the axes' speeds that a file without times uses: the cubics are up to three times as steep
SPEED, TURN_RATE, TENSION_RATE = 1e-3, 0.5, 0.1  # m/s, rad/s, N/s: where the limits name none
EASE = 0.25  # s: in which the clock of the commands starts and stands still, half of it is lost
WAIT, PATIENCE = 0.1, 10.0  # N, s: the clock of the commands stands while the tension is further off, but not for ever


class Progressive(Staged):
    """Follow insertion, rotation and tension over time: axes by position, the tension by the screw.

    - insertion (n,), rotation (n,) rad of the section at the exit, or one number, tension (n,) N; time (n,) s,
      increasing, None: as fast as ``SHARE`` of the axes' speeds allows. Between the points monotone cubics.
    - First the axes go to the first point and the tendon is taken up there; while the tension is further than ``WAIT``
      from its target, the motion waits, so that a slow screw delays it and does not spoil it.

    Raises `InvalidInput` by row; `update` raises `TaskFailed`.
    """

    name = "progressive motion"

    def __init__(
        self, insertion: Sequence[float], tension: Sequence[float], machine: Machine, *,
        rotation: Sequence[float] | float = 0.0, time: Sequence[float] | None = None,
        winder: TensionController | None = None, tolerance: float = TOLERANCE,
    ) -> None:  # fmt: skip
        limit = machine.screw.speed if machine.screw.speed != inf else 4 * SPEED
        winder = winder if winder is not None else machine.winder(limit=limit, feed_forward=True)
        super().__init__(machine, winder, tolerance)
        rows = _rows(insertion, rotation, tension)
        at = _paced(rows, machine) if time is None else _times(time, len(rows))
        self.end, self._clock, self._ahead = float(at[-1]), 0.0, 0.0
        self._eta, self._rotation, self._tension = (Cubics(at, column) for column in rows.T)
        self._way = [machine.turn(eta, phi) for eta, phi in rows[:, :2].tolist()]
        self._turned, self._waiting, self._rate = 0.0, Lasting(PATIENCE), Ramp(1.0, 1.0 / EASE)
        self._in_phases(
            {
                Phase.START: self._starting,
                Phase.TAKE_UP: self._taking_up,
                Phase.FOLLOW: self._following,
                Phase.SETTLE: self._settling,
            }
        )

    @classmethod
    def read(cls, path: str | PathLike[str], machine: Machine, **options) -> Progressive:
        """From a file with insertion, tension_N, rotation_deg or rotation_rad, and time_s if it says when."""
        found = read_commands(path)
        given = {"rotation": found.rotation, "time": found.time}
        return cls(found.insertion, found.tension, machine, **given | options)

    def _share(self) -> float:
        return self._clock / self.end if self.end > 0.0 else 1.0

    def _begin(self, sample: Sample) -> None:
        super()._begin(sample)
        is_out = self._z > START * self.machine.length
        here = sample.rotation.position if is_out else self._way[0]
        self._turned = full_turn(here, self._way, self.machine.rotation)
        self._aim()

    def _aim(self) -> None:
        """Where the axes belong at this time of the commands."""
        eta = self._eta.value(self._clock)
        self._z = eta * self.machine.length
        self._phi = self.machine.turn(eta, self._rotation.value(self._clock)) + self._turned

    def _starting(self, sample: Sample, dt: float) -> Command:
        if self._has_arrived(sample):
            self._next(sample)
        return self._moved(sample, dt)

    def _taking_up(self, sample: Sample, dt: float) -> Command:
        target = self._tension.value(self._clock)
        if self._is_at(target, sample, dt):
            self._next(sample)
        return self._wound(sample, dt, target)

    def _following(self, sample: Sample, dt: float) -> Command:
        target = self._tension.value(self._clock)
        late = not abs(target - sample.force.tension) <= WAIT
        if self._waiting.update(late, dt):
            raise TaskFailed(f"{self.phase.value}: tension {sample.force.tension:.3g} N, wanted {target:.3g} N")
        if self._clock >= self.end:
            self._next(sample)
        rate = self._rate.update(0.0 if late else 1.0, dt)
        self._clock = min(self._clock + rate * max(dt, 0.0), self.end)
        self._aim()
        speed = rate * self._eta.slope(self._clock) * self.machine.length
        turn = 2.0 * pi * self.machine.turns * speed / self.machine.length + rate * self._rotation.slope(self._clock)
        return self._wound(sample, dt, target, speed, turn)

    def _settling(self, sample: Sample, dt: float) -> Command:
        return self._taking_up(sample, dt)


def _rows(insertion, rotation, tension) -> np.ndarray:
    """(n, 3) insertion, rotation, tension."""
    columns = [numbers(name, x) for name, x in (("insertion", insertion), ("tension", tension))]
    turned = np.full(columns[0].size, finite("rotation", rotation)) if np.ndim(rotation) == 0 else rotation
    columns.insert(1, numbers("rotation", turned))
    if not columns[0].size == columns[1].size == columns[2].size > 0:
        sizes = [column.size for column in columns]
        raise InvalidInput("insertion, rotation, tension", sizes, "as many numbers each, one or more")
    for k, (eta, tau) in enumerate(zip(columns[0].tolist(), columns[2].tolist(), strict=True), 1):
        within(f"row {k}: insertion", eta, 0.0, 1.0)
        nonnegative(f"row {k}: tension", tau)
    return np.stack(columns, axis=1)


def _times(time, count: int) -> np.ndarray:
    at = numbers("time", time)
    if at.size != count or not np.all(np.diff(at) > 0.0):
        raise InvalidInput("time", time, f"{count} increasing numbers")
    return at - at[0]


def _paced(rows: np.ndarray, machine: Machine) -> np.ndarray:
    """(n,) times at which each row can be reached, none nearer to the last than a hundredth of a second."""
    eta, _, tau = np.abs(np.diff(rows, axis=0)).T
    turned = np.abs(np.diff(rows[:, 1] + 2.0 * pi * machine.turns * rows[:, 0]))
    speeds = [limits.speed for limits in (machine.screw, machine.translation)]
    forward, turning = min(*(SHARE * each for each in speeds), SPEED), min(SHARE * machine.rotation.speed, TURN_RATE)
    spans = np.stack([eta * machine.length / forward, turned / turning, tau / TENSION_RATE, np.full(eta.size, 0.01)])
    return np.concatenate([[0.0], np.cumsum(spans.max(axis=0))])
