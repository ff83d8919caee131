"""`Pace`: a script's steps in real time, on a bench that moves on its own while the session computes.

A step is told for as long as it lasts and no longer, so that a session that takes its time leaves the bench standing
instead of moving on. So that it need not stand, the next step is computed while this one is still made.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from .commands import Jog

MOST = 0.1  # s, by which a step may be computed before the one before it is over
FORGOTTEN = 0.9  # share of an old delay that is still reckoned with a step later
STAND = Jog()


class Pace:
    """Tells when steps begin: `begin` before a step is sent, `wait` after it; each step's motion ends with the next.

    clock, sleep: of the machine.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._clock, self._sleep = clock, sleep
        self._end, self._left_at, self._ahead = 0.0, clock(), 0.0
        self._jog = STAND

    def begin(self, jog: Jog, dt: float) -> float:
        """For how long (s) to move at ``jog`` from now on; waits until a step at another jog is over."""
        took = self._clock() - self._left_at
        self._ahead = min(max(took, FORGOTTEN * self._ahead), MOST)
        if jog != self._jog:
            self.finish()
            self._jog = jog
        now = self._clock()
        self._end = max(self._end, now) + dt
        return self._end - now

    def wait(self) -> None:
        """Return when the next step is to be computed, so that it can begin as this one ends."""
        self._until(self._end - self._ahead)
        self._left_at = self._clock()

    def finish(self) -> None:
        """Return when all steps are over."""
        self._until(self._end)

    def _until(self, then: float) -> None:
        if (left := then - self._clock()) > 0.0:
            self._sleep(left)
