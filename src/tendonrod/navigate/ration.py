"""How many messages a client may send: a bucket that fills at a steady rate."""

from __future__ import annotations

import time
from collections.abc import Callable


class Ration:
    """``rate`` per second in the long run, ``burst`` at once."""

    def __init__(self, rate: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.rate, self.burst, self.clock = rate, burst, clock
        self._left, self._at = burst, clock()

    def spend(self) -> bool:
        """Take one; False where there is none left."""
        now = self.clock()
        self._left, self._at = min(self.burst, self._left + self.rate * (now - self._at)), now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
