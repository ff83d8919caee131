"""Axes of the virtual bench: `Drive`, a motor with play in truth; `VirtualAxis`, the device that a program sees."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import TYPE_CHECKING

from ...errors import finite
from ..interfaces import AxisLimits, AxisState, DeviceError
from .injection import InjectionKind

if TYPE_CHECKING:
    import numpy as np

    from .clock import VirtualClock
    from .setup import AxisModel
    from .world import World

HOMING_STEP = 5e-3  # s
HOMING_SPEED = 0.5  # of the largest speed


class Drive:
    """Motor, play and load of one axis; motor and load are true positions (m or rad), velocity is the motor's.

    A hard stop takes the power from the motor's bridge, and the next velocity that is not 0 gives it back: an axis that
    runs away stands while its bridge is off, whatever went wrong in its speed loop.
    """

    def __init__(self, model: AxisModel, timeout: float) -> None:
        self.model, self.timeout = model, timeout
        self.motor = self.load = model.start
        self.velocity, self.told, self.told_at = 0.0, 0.0, 0.0
        self.hard = False  # braking instead of slowing down
        self.powered = True  # the bridge: without it nothing drives the motor

    def command(self, velocity: float, time: float, hard: bool = False) -> None:
        """What the motor aims at from ``time`` (s) on, until told otherwise or ``timeout`` has passed."""
        self.told = max(-self.model.speed, min(self.model.speed, velocity))
        self.told_at, self.hard = time, hard
        self.powered = not hard and (self.powered or velocity != 0.0)

    def advance(self, time: float, dt: float, stalled: bool, runaway: float | None, pressed: bool) -> None:
        """From ``time`` on by ``dt`` (s). pressed: whether the tendon is taut enough to hold the load on its flank."""
        if stalled:
            self.velocity = 0.0
        elif runaway is not None and self.powered:
            self._move(dt, runaway, self.model.acceleration)
        else:
            heard = min(dt, max(0.0, self.told_at + self.timeout - time))
            self._move(heard, self.told, self.model.braking if self.hard else self.model.acceleration)
            self._move(dt - heard, 0.0, self.model.braking)
        self._drag(pressed)

    @property
    def stop(self) -> int:
        """-1 or 1 where the motor stands at a hard stop."""
        return (self.motor >= self.model.high) - (self.motor <= self.model.low)

    def _move(self, dt: float, target: float, acceleration: float) -> None:
        """Velocity goes to ``target`` at constant acceleration and stays there: exact over any dt."""
        if dt <= 0.0:
            return
        ramp = min(dt, abs(target - self.velocity) / acceleration)
        a = acceleration if target > self.velocity else -acceleration
        self.motor += self.velocity * ramp + 0.5 * a * ramp * ramp
        if ramp < dt:
            self.motor += target * (dt - ramp)
            self.velocity = target
        else:
            self.velocity += a * ramp
        if not self.model.low < self.motor < self.model.high:
            self.motor = max(self.model.low, min(self.model.high, self.motor))
            self.velocity = 0.0

    def _drag(self, pressed: bool) -> None:
        """The load follows within the play, or lies on the flank that the tendon presses it to."""
        half = 0.5 * self.model.backlash
        if pressed and self.model.pressed != "free":
            self.load = self.motor + (half if self.model.pressed == "high" else -half)
        else:
            self.load = max(self.motor - half, min(self.motor + half, self.load))


class VirtualAxis:
    """An `Axis` of a virtual bench. Its encoder counts from where it was switched on, until it is homed."""

    def __init__(self, name: str, world: World, clock: VirtualClock, rng: np.random.Generator) -> None:
        self.name, self._world, self._clock, self._rng = name, world, clock, rng
        self._drive: Drive = world.drives[name]
        model = self._drive.model
        self._zero, self._homed = model.start, False
        self.limits = AxisLimits(low=model.low, high=model.high, speed=model.speed, acceleration=model.acceleration)

    def read(self) -> AxisState:
        """See `Axis`; velocity is the motor's, as its board knows it. A stall shows only in what does not move."""
        self._answer()
        return AxisState(
            time=self._world.time, position=self._position(), velocity=self._drive.velocity,
            homed=self._homed, at_limit=self._drive.stop,
        )  # fmt: skip

    def move(self, velocity: float) -> None:
        """See `Axis`; faster than the axis can is as fast as it can. Raises `InvalidInput` for what is no number."""
        velocity = finite("velocity", velocity)
        self._answer()
        self._tell(velocity, False)

    def stop(self) -> None:
        """See `Axis`."""
        self._answer()
        self._tell(0.0, True)

    def home(self, should_stop: Callable[[], bool] | None = None) -> None:
        """See `Axis`; time passes. Raises `DeviceError` where the axis does not come to its reference."""
        self._answer()
        self._homed, is_there = False, False
        try:
            is_there = self._sought(should_stop or (lambda: False))
        finally:
            if not is_there:
                self._tell(0.0, True)
        if is_there:
            jump = self._jump()  # the encoder counts from its reference anew, whatever it had jumped by
            self._zero, self._homed = float(self._rng.normal(0.0, self._drive.model.home_error)) + jump, True

    def _sought(self, should_stop: Callable[[], bool]) -> bool:
        """Moved to the reference; False where it was stopped on the way."""
        drive, model, world = self._drive, self._drive.model, self._world
        speed = HOMING_SPEED * model.speed
        give_up = world.time + 2.0 * abs(drive.motor) / speed + 2.0 * speed / model.acceleration + 1.0
        near = max(model.resolution, 1e-9)
        while abs(drive.motor) > near or drive.velocity:
            if should_stop():
                return False
            if world.time > give_up:
                raise DeviceError(f"{self.name} does not come to its reference")
            left = abs(drive.motor)
            aim = min(speed, 0.5 * left / HOMING_STEP, sqrt(model.acceleration * left))
            self._tell(0.0 if left <= near else -aim if drive.motor > 0.0 else aim, False)
            self._clock.wait_until(world.time + HOMING_STEP)
            self._answer()
        return True

    def _tell(self, velocity: float, hard: bool) -> None:
        if not self._world.schedule.active(InjectionKind.COMMAND_LOSS, self._world.time, self.name):
            self._drive.command(velocity, self._world.time, hard)

    def _position(self) -> float:
        count, position = self._drive.model.resolution, self._drive.motor - self._zero + self._jump()
        return round(position / count) * count if count else position

    def _jump(self) -> float:
        """By how much the encoder is off by an injection, m or rad."""
        jump = self._world.schedule.active(InjectionKind.ENCODER_JUMP, self._world.time, self.name)
        return jump.value if jump else 0.0

    def _answer(self) -> None:
        self._world.catch_up()
        self._world.must_answer(self.name)
