"""A bench of plain devices for tests of safety: axes that obey exactly, a spring for a tendon, settable readings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf, nan, pi
from typing import Any

from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import AxisLimits, AxisState, Bench, Command, Force, PoseFrame, Sample
from tendonrod.rig.limits import Limits

PERIOD = 5e-3
COMPLIANCE = 3.3e-3  # m/N


class PlainClock:
    """Time that passes by waiting only."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def wait_until(self, time: float) -> None:
        self.time = max(self.time, time)


class PlainAxis:
    """Does at once what it is told. ``change``: fields of its next states; ``sent``: every velocity, "stop", "home"."""

    def __init__(self, name: str, clock: PlainClock, limits: AxisLimits) -> None:
        self.name, self.limits, self.clock = name, limits, clock
        self.position = self.velocity = self.since = 0.0
        self.homed, self.obeys, self.error = False, True, None
        self.change: dict = {}
        self.sent: list = []
        self.homing = 0  # periods that homing takes

    def read(self) -> AxisState:
        if self.error is not None:
            raise self.error
        self.advance()
        state = AxisState(time=self.clock.time, position=self.position, velocity=self.velocity, homed=self.homed)
        return replace(state, **self.change)

    def advance(self) -> None:
        if self.obeys:
            self.position += self.velocity * (self.clock.time - self.since)
        self.since = self.clock.time

    def move(self, velocity: float) -> None:
        self.sent.append(velocity)
        if self.error is not None:
            raise self.error
        self.advance()
        self.velocity = velocity

    def stop(self) -> None:
        self.sent.append("stop")
        if self.error is not None:
            raise self.error
        self.advance()
        self.velocity = 0.0

    def home(self, should_stop: Callable[[], bool] | None = None) -> None:
        if self.error is not None:
            raise self.error
        self.sent.append("home")
        self.homed = False
        for _ in range(self.homing):
            if should_stop is not None and should_stop():
                return
            self.clock.time += PERIOD
        self.position, self.homed = 0.0, True


@dataclass
class PlainCell:
    """Tension of a spring between translation and screw; ``change``: fields of its next readings."""

    screw: PlainAxis
    translation: PlainAxis
    clock: PlainClock
    full_scale: float = 22.24
    change: dict = field(default_factory=dict)
    error: Exception | None = None
    offset: float = 0.0  # m, pulled length

    def read(self) -> Force:
        if self.error is not None:
            raise self.error
        pulled = self.translation.position - self.screw.position + self.offset
        return replace(Force(time=self.clock.time, tension=max(0.0, pulled / COMPLIANCE)), **self.change)


@dataclass
class PlainTracker:
    """One frame per reading unless it is lost."""

    clock: PlainClock
    tools: tuple[str, ...] = ("tip",)
    rate: float = 40.0
    is_lost: bool = False
    error: Exception | None = None

    def read(self) -> tuple[PoseFrame, ...]:
        if self.error is not None:
            raise self.error
        x = nan if self.is_lost else 0.0
        return (PoseFrame(time=self.clock.time, frame=0, tool="tip", position=(x, x, x), quaternion=(1.0, 0, 0, 0)),)


@dataclass(frozen=True, kw_only=True)
class PlainBench(Bench):
    """Counts how often it was closed. Its devices are of any type, so that tests may set what they like."""

    screw: Any
    translation: Any
    rotation: Any
    load_cell: Any
    tracker: Any
    clock: Any
    closed: list = field(default_factory=list)

    @property
    def axes(self) -> Any:
        return self.screw, self.translation, self.rotation

    def close(self) -> None:
        self.closed.append(self.clock.now())
        super().close()


def plain_bench(acceleration: float = inf) -> PlainBench:
    clock = PlainClock()
    screw = PlainAxis("screw", clock, AxisLimits(low=-30e-3, high=110e-3, speed=3e-3, acceleration=acceleration))
    z = PlainAxis("translation", clock, AxisLimits(low=-10e-3, high=110e-3, speed=5e-3, acceleration=acceleration))
    turn = PlainAxis("rotation", clock, AxisLimits(low=-6 * pi, high=6 * pi, speed=2.0, acceleration=acceleration))
    cell, tracker = PlainCell(screw, z, clock), PlainTracker(clock)
    return PlainBench(
        name="plain",
        screw=screw,
        translation=z,
        rotation=turn,
        load_cell=cell,
        tracker=tracker,
        clock=clock,
    )


def running(limits: Limits | None = None, strain=None) -> tuple[PlainBench, GuardedBench]:
    """A bench that is homed, armed and running, one period in."""
    bench = plain_bench()
    guarded = GuardedBench(bench, limits, strain)
    guarded.home()
    guarded.interlock.arm()
    guarded.interlock.start()
    period(guarded)
    return bench, guarded


def taut(tension: float = 0.7, limits: Limits | None = None) -> tuple[PlainBench, GuardedBench]:
    """Running, under tension (N)."""
    bench, guarded = running(limits)
    bench.load_cell.offset = tension * COMPLIANCE
    guarded.interlock._watch.restart()  # the step is no part of what is tested
    period(guarded)
    return bench, guarded


def period(guarded: GuardedBench, command: Command = Command(), dt: float = PERIOD) -> tuple[Sample, Command]:  # noqa: B008
    """One control period."""
    guarded.clock.wait_until(guarded.clock.now() + dt)
    sample = guarded.sense()
    return sample, guarded.act(command)


def run(guarded: GuardedBench, command: Command, seconds: float) -> float:
    """Periods with ``command`` until a fault or for ``seconds``; the time that passed."""
    begun = guarded.clock.now()
    while guarded.interlock.fault is None and guarded.clock.now() - begun < seconds - 1e-9:
        period(guarded, command)
    return guarded.clock.now() - begun
