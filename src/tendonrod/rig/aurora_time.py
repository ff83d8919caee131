"""When a frame of the tracker came to be, in the host's time: a line of time over frame number."""

from __future__ import annotations

from collections import deque

import numpy as np

PRIOR = 144.0  # frames^2: of the nominal slope, as much as twelve frames say about it
SHORTEST = 1e-4  # s: no bound is trusted to be closer
STRAY = 2.0  # frames that the line may miss a bound by; beyond, the count was set back or the rate changed


class FrameTimes:
    """Maps frame numbers to the host's seconds by a weighted least-squares line over the newest ``window`` frames.

    The tracker is asked over and over for its newest frame. A frame that is new in an answer became available after the
    answer before was asked for, and before this one had come: bounds some milliseconds apart, wide where the host was
    late. The line goes through the middles of the bounds, each with the weight of its width's inverse square, so that a
    late answer shifts nothing; at first the nominal rate holds its slope. A time is never taken outside its own bounds.

    rate: Hz; the nominal one becomes that of the line.
    """

    def __init__(self, rate: float, window: int = 400) -> None:
        self.rate, self._nominal = rate, 1.0 / rate
        self._points: deque[tuple[int, float, float]] = deque(maxlen=window)  # frame, middle, width
        self._newest = (-1, 0.0)

    def time(self, frame: int, earliest: float, latest: float) -> float:
        """Host time (s) of ``frame``, which became available between the two (s)."""
        if self._points and frame == self._newest[0]:
            return self._newest[1]
        width = max(latest - earliest, SHORTEST)
        if self._points and not self._is_on(frame, earliest, latest):
            self._points.clear()
        self._points.append((frame, 0.5 * (earliest + latest), width))
        found = min(max(self._line(frame), earliest), latest)
        self._newest = frame, found
        return found

    def _is_on(self, frame: int, earliest: float, latest: float) -> bool:
        if frame < self._points[-1][0]:
            return False
        slack = STRAY / self.rate
        return earliest - slack <= self._line(frame) <= latest + slack

    def _line(self, frame: int) -> float:
        points = np.array(self._points)
        numbers, middles, weights = points[:, 0] - frame, points[:, 1], 1.0 / points[:, 2] ** 2
        weights /= weights.sum()
        number, middle = float(weights @ numbers), float(weights @ middles)
        away = len(points) * weights * (numbers - number)
        slope = float((away @ (middles - middle) + PRIOR * self._nominal) / (away @ (numbers - number) + PRIOR))
        self.rate = 1.0 / slope if slope > 0.0 else self.rate
        return middle - slope * number
