"""Drives of a session: what turns a `Jog` into a `Posture`. `IdealDrive` follows at once; for a bench see `bench`."""

from __future__ import annotations

from dataclasses import replace
from math import inf, tau
from typing import Protocol

from ..errors import TendonrodError
from .commands import FASTEST, Jog, Posture
from .recovery import Trouble
from .scenario import Scenario


class Drive(Protocol):
    """What moves the robot."""

    @property
    def posture(self) -> Posture:
        """What it holds."""
        ...

    @property
    def coupled(self) -> bool:
        """Whether insertion turns it (`Scenario`); can be set."""
        ...

    @coupled.setter
    def coupled(self, on: bool) -> None: ...

    def advance(self, jog: Jog, dt: float) -> Posture:
        """Move at ``jog`` for ``dt`` s, as far as the limits allow; returns what is held then."""
        ...

    def go_back(self, posture: Posture) -> bool:
        """Give up the last move and hold ``posture`` again; False where a real robot has made it already."""
        ...

    def retract(self) -> bool:
        """Hold a retracted robot without tension at rotation 0; False where that takes real motion."""
        ...

    @property
    def fastest(self) -> Jog:
        """Rates that it can follow for long."""
        ...

    @property
    def highest(self) -> float:
        """Tension (N) that it goes to at most, inf where only the scenario limits it."""
        ...

    @property
    def fault(self) -> str:
        """What stopped the drive, a sentence; "" where nothing did."""
        ...

    @property
    def trouble(self) -> Trouble | None:
        """The same with what to do about it; None where nothing did."""
        ...

    def acknowledge(self, home: bool = False) -> None:
        """Obey again after a fault, see `recovery`. Raises `TendonrodError` where there is none."""
        ...

    def halt(self) -> None:
        """End a motion that `acknowledge` has begun; from any thread."""
        ...

    def close(self) -> None:
        """Stop and let go."""
        ...


class Untroubled:
    """What a drive says that knows no faults."""

    fault, trouble, highest, fastest = "", None, inf, Jog(**FASTEST)

    def acknowledge(self, home: bool = False) -> None:
        """Raises `TendonrodError`."""
        raise TendonrodError("there is nothing to acknowledge: there is no bench whose fault it could be")

    def halt(self) -> None:
        """Nothing to end."""


class IdealDrive(Untroubled):
    """A drive without mass, friction or play: integrates the jog within the limits."""

    def __init__(self, scenario: Scenario) -> None:
        self._limits, self._length = scenario.limits, scenario.robot.section.L
        self._twist = tau * scenario.robot.turns
        self._home = Posture(tension=(0.0,) * scenario.robot.n_tendons)
        self.posture, self.coupled = self._home, scenario.coupled

    def advance(self, jog: Jog, dt: float) -> Posture:
        """The posture after ``dt`` s at ``jog``."""
        at, limits = self.posture, self._limits
        insertion = _clamped(at.insertion + jog.insertion * dt / self._length, 0.0, limits.insertion)
        turned = jog.rotation * dt
        if not self.coupled and self._twist != 0.0:  # the motor stands, and what comes out of the helix turns it
            ends = sorted((at.rotation + end) / self._twist for end in (-limits.rotation, limits.rotation))
            insertion = _clamped(insertion, at.insertion + min(ends[0], 0.0), at.insertion + max(ends[1], 0.0))
            turned -= self._twist * (insertion - at.insertion)
        rotation = _clamped(at.rotation + turned, -limits.rotation, limits.rotation)
        tension = tuple(_clamped(each + jog.tension * dt, 0.0, limits.tension) for each in at.tension)
        self.posture = replace(at, insertion=insertion, rotation=rotation, tension=tension)
        return self.posture

    def go_back(self, posture: Posture) -> bool:
        """Hold ``posture`` again."""
        self.posture = posture
        return True

    def retract(self) -> bool:
        """Hold the retracted robot."""
        self.posture = self._home
        return True

    def close(self) -> None:
        """Nothing to do."""


def limited(scenario: Scenario, drive: Drive) -> Scenario:
    """The scenario with no higher limit of the tension than the drive has: it is what the operator is shown."""
    if drive.highest >= scenario.limits.tension:
        return scenario
    return replace(scenario, limits=replace(scenario.limits, tension=drive.highest))


def _clamped(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
