"""`GuardedBench`: the only way from a controller to the axes, and it leads through the interlock.

It keeps the devices to itself and offers `sense` and `act`: a task sees samples and gives commands, it never holds an
axis. Whatever a driver raises becomes a fault, so that one broken device does not keep the others from being stopped.
"""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import TypeVar

from ..errors import TendonrodError
from .detection import StrainOf
from .interfaces import STILL, AxisState, Bench, Command, Force, PoseFrame, Sample
from .limits import AXES, Limits
from .safety import Interlock
from .states import State

HOMING = (1, 2, 0)  # translation draws the robot in, then rotation, then the screw, with a slack tendon
AT_REST = 1e-4  # m/s or rad/s, below which an axis counts as standing
UNKNOWN_AXIS = AxisState(time=nan, position=nan, velocity=nan, homed=False)
UNKNOWN_FORCE = Force(time=nan, tension=nan)

Answer = TypeVar("Answer")


class GuardedBench:
    """A bench behind its interlock. limits: narrowed here by what the devices allow; strain: see `Interlock`.

    One thread uses it; `Interlock.emergency` and `Interlock.interrupt` may be called from any.
    """

    __slots__ = ("__bench", "__fault_since", "__force", "__sample", "__states", "clock", "interlock", "name")

    def __init__(self, bench: Bench, limits: Limits | None = None, strain: StrainOf | None = None) -> None:
        self.__bench, self.__fault_since = bench, nan
        self.__states: list[AxisState] = [UNKNOWN_AXIS] * 3
        self.__force, self.__sample = UNKNOWN_FORCE, None
        self.name, self.clock = bench.name, bench.clock
        narrowed = (limits or Limits()).narrowed([axis.limits for axis in bench.axes], bench.load_cell.full_scale)
        tools = () if bench.tracker is None else tuple(bench.tracker.tools)
        self.interlock = Interlock(narrowed, bench.clock, strain, tools)

    def sense(self) -> Sample:
        """Read every device, and let the interlock look at it.

        A device that fails is a fault, and its last reading stands in for the new one, with its old time.
        """
        now, bench = self.clock.now(), self.__bench
        for i, axis in enumerate(bench.axes):
            self.__states[i] = self.__ask(AXES[i], axis.read, self.__states[i])
        self.__force = self.__ask("load cell", bench.load_cell.read, self.__force)
        frames: tuple[PoseFrame, ...] = ()
        if bench.tracker is not None:
            frames = self.__ask("tracker", bench.tracker.read, frames)
        screw, translation, rotation = self.__states
        before = self.__sample
        self.__sample = Sample(
            time=now, screw=screw, translation=translation, rotation=rotation, force=self.__force, frames=frames
        )
        self.interlock.check(self.__sample, 0.0 if before is None else now - before.time)
        return self.__sample

    def act(self, command: Command = STILL) -> Command:
        """Send what the interlock allows of ``command``, and return it. In fault the axes that stand are stopped hard.

        Where an axis does not take its command, the reaction to that goes out to all in the same call.
        """
        sample = self.__sample or self.sense()
        sent = self.interlock.allowed(command, sample)
        if not self.__send(sent):
            sent = self.interlock.allowed(STILL, sample)
            self.__send(sent)
        return sent

    def home(self) -> None:
        """Home all axes, one after the other. Raises `DeviceError` where one fails, `TendonrodError` if not slack.

        The axes move by themselves here, so the tendon must be slack before, and is looked at between axes.
        """
        self.interlock.require_home()
        for i in HOMING:
            self.__require_slack()
            try:
                self.__bench.axes[i].home()
            except Exception as error:
                self.interlock.failed(AXES[i], error)
                self.act()
                raise
            if self.interlock.is_asked_to_stop:
                break
        self.sense()
        self.act()
        if self.interlock.state is not State.FAULT:
            self.interlock.home()

    def close(self) -> None:
        """Stop everything and let the devices go; `rig.ending.safely` releases the tendon before.

        A device that fails in this is a fault of the interlock, and keeps no axis from being stopped.
        """
        for name, axis in zip(AXES, self.__bench.axes, strict=True):
            self.__ask(name, axis.stop, None)
        self.__ask("closing", self.__bench.close, None)

    def __ask(self, name: str, question: Callable[[], Answer], otherwise: Answer) -> Answer:
        try:
            return question()
        except Exception as error:  # noqa: BLE001 - a driver's bug must not leave the other axes moving
            self.interlock.failed(name, error)
            return otherwise

    def __send(self, command: Command) -> bool:
        """Stops first, then motion; False where an axis failed. All are tried."""
        velocities = (command.screw, command.translation, command.rotation)
        hard = self.__stands_hard(velocities)
        failed = False
        for i in sorted(range(3), key=lambda i: velocities[i] != 0.0):
            axis = self.__bench.axes[i]
            try:
                if hard[i]:
                    axis.stop()
                else:
                    axis.move(velocities[i])
            except Exception as error:  # noqa: BLE001 - as in reading
                self.interlock.failed(AXES[i], error)
                failed = True
        return not failed

    def __stands_hard(self, velocities: tuple[float, float, float]) -> list[bool]:
        """Which axes to stop hard: those that are to stand in fault, at its first act and while they still move.

        An axis may share its board's stop with the others, so that beside a moving screw this ends after a while.
        """
        now = self.clock.now()
        if self.interlock.state is not State.FAULT:
            self.__fault_since = nan
            return [False] * 3
        is_first = self.__fault_since != self.__fault_since
        if is_first:
            self.__fault_since = now
        if any(velocities) and now - self.__fault_since > self.interlock.limits.command_timeout:
            return [False] * 3
        return [
            v == 0.0 and (is_first or not abs(axis.velocity) <= AT_REST)
            for v, axis in zip(velocities, self.__states, strict=True)
        ]

    def __require_slack(self) -> None:
        slack = self.interlock.limits.slack
        force = self.__bench.load_cell.read()
        if not force.tension < slack:
            raise TendonrodError(
                f"cannot home: the tension is {force.tension:.3g} N, and must be below {slack:.3g} N; release it first"
            )
