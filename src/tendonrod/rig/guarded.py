"""`GuardedBench`: the only way from a controller to the axes, and it leads through the interlock.

It keeps the devices to itself and offers `sense` and `act`: a task sees samples and gives commands, it never holds an
axis. Whatever a driver raises becomes a fault, so that one broken device does not keep the others from being stopped.
"""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import TypeVar

from ..errors import TendonrodError
from .answers import as_force, as_frames, as_state
from .interfaces import STILL, AxisState, Bench, Command, Force, PoseFrame, Sample
from .limits import AXES, Limits
from .safety import Interlock
from .states import FaultKind, State
from .tension_watch import PUSHED, StrainOf

HOMING = (1, 2, 0)  # translation draws the robot in, then rotation, then the screw, with a slack tendon
AT_REST = 1e-4  # m/s or rad/s, below which an axis counts as standing
AGAIN = 5.0  # times command_timeout, after which an axis that still moves is stopped hard once more
UNKNOWN_AXIS = AxisState(time=nan, position=nan, velocity=nan, homed=False)
UNKNOWN_FORCE = Force(time=nan, tension=nan)

Answer = TypeVar("Answer")


class GuardedBench:
    """A bench behind its interlock. limits: narrowed here by what the devices allow; strain: see `Interlock`.

    One thread uses it; `Interlock.emergency` and `Interlock.interrupt` may be called from any.
    """

    __slots__ = (
        "__bench", "__force", "__moves_since", "__sample", "__states", "clock",
        "interlock", "name",
    )  # fmt: skip

    def __init__(self, bench: Bench, limits: Limits | None = None, strain: StrainOf | None = None) -> None:
        self.__bench = bench
        self.__moves_since: list[float] | None = None  # s, of each axis that stands in fault; None without a fault
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
            self.__states[i] = self.__ask(AXES[i], lambda axis=axis: as_state(axis.read()), self.__states[i])
        self.__force = self.__ask("load cell", lambda: as_force(bench.load_cell.read()), self.__force)
        frames: tuple[PoseFrame, ...] = ()
        if bench.tracker is not None:
            tracker = bench.tracker
            frames = self.__ask("tracker", lambda: as_frames(tracker.read()), frames)
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

        The axes move by themselves here: the tendon must be slack before each, and its tension is looked at meanwhile,
        as is whether somebody asks for a stop. What is found then is the interlock's fault.
        """
        self.interlock.require_home()
        for i in HOMING:
            self.__require_slack()
            try:
                self.__bench.axes[i].home(should_stop=self.__must_not_home)
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
        """Which axes to stop hard: those that are to stand in fault, at its first act and while they move.

        An axis may share its board's stop with the others, so that beside a moving screw this ends after a while, and
        is tried again from time to time.
        """
        now, timeout = self.clock.now(), self.interlock.limits.command_timeout
        if self.interlock.state is not State.FAULT:
            self.__moves_since = None
            return [False] * 3
        is_first = self.__moves_since is None
        since = self.__moves_since = self.__moves_since or [now] * 3
        hard = []
        for i, (velocity, axis) in enumerate(zip(velocities, self.__states, strict=True)):
            moves = not abs(axis.velocity) <= AT_REST
            since[i] = since[i] if moves else now
            is_due = not any(velocities) or not (now - since[i]) % (AGAIN * timeout) > timeout
            hard.append(velocity == 0.0 and (is_first or (moves and is_due)))
        return hard

    def __require_slack(self) -> None:
        limits, force = self.interlock.limits, as_force(self.__bench.load_cell.read())
        if force.saturated or not abs(self.clock.now() - force.time) <= limits.sensor_age:
            what = "saturated" if force.saturated else f"of {force.time:.4g} s, at {self.clock.now():.4g} s"
            raise TendonrodError(f"cannot home: the load cell's reading is {what}; nobody knows whether it is slack")
        if not -PUSHED * limits.slack <= force.tension < limits.slack:
            raise TendonrodError(
                f"cannot home: the tension is {force.tension:.3g} N, and must be below {limits.slack:.3g} N and not "
                f"below {-PUSHED * limits.slack:.3g} N; release it first, or tare the load cell"
            )

    def __must_not_home(self) -> bool:
        """Whether homing must stop: somebody asks for it, or the tension passes its limit or is not known."""
        lock, limits = self.interlock, self.interlock.limits
        force = self.__ask("load cell", lambda: as_force(self.__bench.load_cell.read()), None)
        if force is not None and not abs(force.tension) <= limits.tension:
            kind = FaultKind.TENSION if abs(force.tension) > limits.tension else FaultKind.NAN_SENSOR
            lock.trip(kind, force.tension, limits.tension, "homing")
        elif force is not None and not abs(age := self.clock.now() - force.time) <= limits.sensor_age:
            lock.trip(FaultKind.STALE_SENSOR, age, limits.sensor_age, "load cell")
        return lock.is_asked_to_stop
