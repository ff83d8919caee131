"""When the board measured something, in the host's time: from when it was asked, and when it had answered."""

from __future__ import annotations

from collections import deque

TURN = 1 << 32  # the board's microseconds count modulo this: 71.6 minutes


class BoardTime:
    """Maps the board's microseconds to the host's seconds.

    Each exchange bounds the difference of the two clocks: the board answered after it was asked and before its answer
    came. The newest exchanges together bound it more closely than any one; crystals differ by some 50 ppm, which over
    ``window`` = 64 exchanges of a control loop is less than the width of those bounds. Where they contradict each other
    all the same, the newest one begins anew. Times never go back, and lie within their exchange.
    """

    def __init__(self, window: int = 64) -> None:
        self._bounds: deque[tuple[float, float]] = deque(maxlen=window)
        self._micros: int | None = None
        self._elapsed = 0.0  # s of the board since its first answer

    def host(self, micros: int, asked: float, answered: float) -> float:
        """Host time (s) of ``micros``, which the board gave in an exchange from ``asked`` to ``answered`` (s)."""
        if self._micros is not None:
            self._elapsed += (micros - self._micros) % TURN * 1e-6
        self._micros = micros
        return min(max(self._elapsed + self._offset(asked, answered), asked), answered)

    def _offset(self, asked: float, answered: float) -> float:
        newest = asked - self._elapsed, answered - self._elapsed
        self._bounds.append(newest)
        low, high = max(low for low, _ in self._bounds), min(high for _, high in self._bounds)
        if low > high:
            self._bounds.clear()
            self._bounds.append(newest)
            low, high = newest
        return 0.5 * (low + high)
