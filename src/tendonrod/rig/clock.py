"""The clock of a real bench."""

from __future__ import annotations

import time as system

from ..errors import finite


class SystemClock:
    """Seconds since it was made, by the machine's monotonic clock; an `interfaces.Clock`."""

    def __init__(self) -> None:
        self._opened = system.monotonic()

    def now(self) -> float:
        """See `Clock`."""
        return system.monotonic() - self._opened

    def wait_until(self, time: float) -> None:
        """See `Clock`."""
        finite("time", time)
        while (left := time - self.now()) > 0.0:
            system.sleep(left)
