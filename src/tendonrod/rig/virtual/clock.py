"""The clock of a virtual bench: as fast as it can be computed, or in step with real time."""

from __future__ import annotations

import time as system
from math import inf
from typing import TYPE_CHECKING

from ...errors import finite
from .injection import InjectionKind

if TYPE_CHECKING:
    from .world import World


class VirtualClock:
    """Time of a `World`. Waiting moves the world on; in real time it sleeps, and the world catches up when asked.

    What the world computes would make the wait end late, and a controller's periods uneven, if it were done here.
    ahead: s, by which real time runs on beyond the end of the last wait; where whoever uses the bench is held up for
    longer, its time stands still until the next wait, and is behind from then on.
    """

    def __init__(self, world: World, real_time: bool, ahead: float = inf) -> None:
        self.world, self.real_time, self._ahead = world, real_time, ahead
        self._opened, self._farthest = system.perf_counter(), ahead
        if real_time:
            world.follow_clock(self._passed)

    def now(self) -> float:
        """Seconds since the bench was opened."""
        return self._passed() if self.real_time else self.world.time

    def wait_until(self, time: float) -> None:
        """Return at ``time``, later where the injection "control periods late" acts; at once where it has passed."""
        finite("time", time)
        late = self.world.schedule.active(InjectionKind.CLOCK_LATE, self.now())
        until = max(time, self.now()) + (late.value if late else 0.0)
        if self.real_time:
            self._farthest = until + self._ahead
            while (left := until - self._passed()) > 0.0:
                system.sleep(left)
        else:
            self.world.advance(until)

    def _passed(self) -> float:
        passed = system.perf_counter() - self._opened
        if passed > self._farthest:
            self._opened += passed - self._farthest
            return self._farthest
        return passed
