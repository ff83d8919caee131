"""`World`: the truth of a virtual bench. It owns time, drives, robot and tendon, and what goes wrong with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, pi
from typing import TYPE_CHECKING

import numpy as np

from ...rotation import exp_so3
from ..interfaces import DeviceError
from .axes import Drive
from .injection import AXES, InjectionKind, Schedule
from .mechanics import OuterTube, mechanics_of

if TYPE_CHECKING:
    from .sensors import VirtualTracker
    from .setup import VirtualSetup

LONGEST_STEP = 0.01  # s, between two states of robot and tendon
BROKEN = -1.0  # m, pulled length of a tendon that pulls no more


@dataclass(frozen=True, kw_only=True, slots=True)
class Truth:
    """What no sensor knows: tension (N) at the load cell; z (m), insertion and rotation (rad, beside the turns of
    follow-the-leader motion) at the outer tube's exit; true positions of the loads of the three drives.
    """

    time: float
    tension: float
    z: float
    insertion: float
    rotation: float
    screw: float
    translation: float
    turn: float


class World:
    """Moves on only by `advance`, step by step: drives, outer tube, tendon, load cell's filter, tracker's frames."""

    def __init__(self, setup: VirtualSetup) -> None:
        self.setup, self.time = setup, 0.0
        self.schedule = Schedule(setup.injections)
        self.drives = {name: Drive(getattr(setup, name), setup.command_timeout) for name in AXES}
        self.mechanics, self.tube = mechanics_of(setup), OuterTube(setup.robot, setup.outer_friction)
        self.tracker: VirtualTracker | None = None
        self.felt = 0.0  # tension behind the load cell's filter, N
        self._length, self._turns = setup.robot.section.L, 2.0 * pi * setup.robot.turns
        self._exit_z = exp_so3(np.array([*setup.exit_tilt, 0.0]))[:, 2]
        self._now: Callable[[], float] | None = None
        self._rolled = self.drives["translation"].load, self.drives["rotation"].load
        self._lag = 0.0, 0.0
        self._settle()
        self._step(0.0)  # a tendon that is taut from the start holds its axes on their flanks
        self.felt = self.mechanics.tension

    @property
    def tension(self) -> float:
        """Tension at the load cell in truth, N."""
        return self.mechanics.tension

    @property
    def truth(self) -> Truth:
        """Everything that no sensor knows."""
        z, insertion, rotation = self._exit()
        screw, translation, turn = (self.drives[name].load for name in AXES)
        return Truth(
            time=self.time, tension=self.tension, z=z, insertion=insertion, rotation=rotation,
            screw=screw, translation=translation, turn=turn,
        )  # fmt: skip

    def tip(self) -> tuple[np.ndarray, np.ndarray]:
        """(3,) tube's axis at the tip (m) and (3, 3) section frame there; beyond its ends the robot moves as a rod."""
        z, insertion, _ = self._exit()
        axis, R = self.mechanics.pose()
        return axis + (z - insertion * self._length) * self._exit_z, R

    def advance(self, to: float) -> None:
        """Let time pass until ``to`` (s); nothing happens where it has passed."""
        while self.time < to:
            until = min(to, self.time + LONGEST_STEP, self.schedule.next_change(self.time))
            frame = self.tracker.next_frame if self.tracker is not None else until
            until = max(self.time, min(until, frame))
            self._step(until)
            if self.tracker is not None and until >= frame:
                self.tracker.capture(until)

    def follow_clock(self, now: Callable[[], float]) -> None:
        """In real time: the world is where this clock is whenever a device is asked."""
        self._now = now

    def catch_up(self) -> None:
        """Advance to the clock's time, where one is followed."""
        if self._now is not None:
            self.advance(self._now())

    def must_answer(self, device: str) -> None:
        """Raise `DeviceError` while an injection keeps a device from answering."""
        if self.schedule.active(InjectionKind.DEVICE_ERROR, self.time, device):
            raise DeviceError(f"{device} does not answer (injected)")

    def _step(self, until: float) -> None:
        dt = until - self.time
        for name, drive in self.drives.items():
            stalled = self.schedule.active(InjectionKind.STALL, self.time, name) is not None
            runaway = self.schedule.active(InjectionKind.RUNAWAY, self.time, name)
            drive.advance(self.time, dt, stalled, runaway.value if runaway else None, self._pressed(name))
        self.time = until
        self._settle()
        self.felt += (self.tension - self.felt) * (1.0 - exp(-2.0 * pi * self.setup.load_cell.bandwidth * dt))

    def _pressed(self, name: str) -> bool:
        """Whether the tendon holds an axis on one flank of its play, against friction in the outer tube."""
        return self.tension > (self.setup.outer_friction if name == "translation" else 0.0)

    def _settle(self) -> None:
        """Where exit, robot and tendon come to rest."""
        rolled = self.drives["translation"].load, self.drives["rotation"].load
        moved, self._rolled = (rolled[0] - self._rolled[0], rolled[1] - self._rolled[1]), rolled
        self._lag = self.tube.follow(*moved, min(1.0, max(0.0, rolled[0] / self._length)))
        z, insertion, rotation = self._exit()
        pulled = z - self.drives["screw"].load - self.setup.slack
        if self.schedule.active(InjectionKind.TENDON_BREAK, self.time):
            pulled = BROKEN
        self.mechanics.follow(insertion, rotation, pulled)

    def _exit(self) -> tuple[float, float, float]:
        """z (m), insertion, and rotation (rad) of the section frame at the exit."""
        z, turn = self._rolled[0] - self._lag[0], self._rolled[1] - self._lag[1]
        insertion = min(1.0, max(0.0, z / self._length))
        return z, insertion, turn - self._turns * (insertion - 1.0)
