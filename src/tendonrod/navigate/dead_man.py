"""The dead-man's switch of the server: a command holds for a moment only, and then the robot stands still."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf
from threading import Lock
from typing import Generic, TypeVar

GRACE = (
    1.0 / 60.0
)  # s, by which a drive with a loop of its own may go on after a step, so that steps need not be on time
DEADLINE = 0.15 - GRACE  # s from the last command to the end of the last step: standstill within 150 ms
KEPT = 16  # commands, of which the outcome is known

V = TypeVar("V")


@dataclass(frozen=True, slots=True)
class _Held(Generic[V]):
    command: V
    serial: int
    at: float
    left: float  # s of motion that this command may still make


@dataclass(slots=True)
class _Course:
    """What became of a command: s of motion made, why it ended before its time."""

    seconds: float = 0.0
    why: str = ""
    lapsed: _Held | None = field(default=None, repr=False)


class DeadMan(Generic[V]):
    """Keeps the newest command while it is young enough.

    A motion of ``dt`` seconds is allowed only where it ends within ``deadline`` of the last sign that somebody holds
    the switch, by a clock that never runs backwards. Safe to use from several threads.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic, deadline: float = DEADLINE) -> None:
        self.clock, self.deadline = clock, deadline
        self._lock, self._serial = Lock(), 0
        self._held: _Held[V] | None = None
        self._lapsed, self._courses = False, dict[int, _Course]()

    def hold(self, command: V, seconds: float = inf) -> int:
        """Take ``command`` in the place of the present one; at most ``seconds`` of motion. A number for `renew`."""
        with self._lock:
            self._end("another command came")
            self._serial += 1
            self._held = _Held(command, self._serial, self.clock(), seconds)
            self._courses[self._serial] = _Course()
            self._courses.pop(self._serial - KEPT, None)
            return self._serial

    def renew(self, serial: int) -> bool:
        """Hold the command of this number for another moment; False where it holds no longer."""
        with self._lock:
            held = self._fresh(0.0)
            if held is None or held.serial != serial:
                return False
            self._held = replace(held, at=self.clock())
            return True

    def resume(self, serial: int) -> bool:
        """Hold the command of this number again after it ran out of time; False where that is not how it ended."""
        with self._lock:
            course = self._courses.get(serial)
            if self._held is not None or course is None or course.lapsed is None:
                return False
            self._held = replace(course.lapsed, at=self.clock())
            course.lapsed, course.why = None, ""
            return True

    def let_go(self, why: str = "stopped") -> None:
        """Nothing is held."""
        with self._lock:
            self._end(why)

    def outcome(self, serial: int) -> tuple[float, str]:
        """Of one of the last commands: seconds of motion so far, and why it ended before its time, "" if it did not."""
        with self._lock:
            course = self._courses.get(serial, _Course(why="too long ago"))
            return course.seconds, course.why

    def spend(self, dt: float, longest: Callable[[V], float] = lambda command: inf) -> tuple[V, float] | None:
        """The command to move by now and for how long (s, at most ``dt`` and its ``longest``); None to stand still."""
        with self._lock:
            held = self._fresh(dt)
            if held is None:
                return None
            dt = min(dt, held.left, longest(held.command))
            left = held.left - dt
            self._courses[held.serial].seconds += dt
            self._held = replace(held, left=left) if left > 1e-12 else None
            return held.command, dt

    @property
    def is_held(self) -> bool:
        with self._lock:
            return self._held is not None

    def lapsed(self) -> bool:
        """Whether a command has run out since the last question, with nobody letting go."""
        with self._lock:
            found, self._lapsed = self._lapsed, False
            return found

    def _fresh(self, dt: float) -> _Held[V] | None:
        if self._held is not None and self.clock() + dt - self._held.at > self.deadline:
            held = self._held
            self._end(f"no sign of life for {1e3 * (self.deadline + GRACE):.0f} ms")
            self._courses[held.serial].lapsed, self._lapsed = held, True
        return self._held

    def _end(self, why: str) -> None:
        """What is held is no more, and what ran out stays so."""
        newest = self._courses.get(self._serial)
        if newest is not None and (self._held is not None or newest.lapsed is not None):
            newest.why, newest.lapsed = why, None
        self._held = None
