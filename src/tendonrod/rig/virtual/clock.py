"""The clock of a virtual bench: as fast as it can be computed, or in step with real time."""

from __future__ import annotations

import time as system
from typing import TYPE_CHECKING

from ...errors import finite
from .injection import InjectionKind

if TYPE_CHECKING:
    from .world import World


class VirtualClock:
    """Time of a `World`. Waiting moves the world on; in real time it sleeps, and the world catches up when asked.

    What the world computes would make the wait end late, and a controller's periods uneven, if it were done here.
    """

    def __init__(self, world: World, real_time: bool) -> None:
        self.world, self.real_time = world, real_time
        self._opened = system.perf_counter()
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
            while (left := until - self._passed()) > 0.0:
                system.sleep(left)
        else:
            self.world.advance(until)

    def _passed(self) -> float:
        return system.perf_counter() - self._opened
