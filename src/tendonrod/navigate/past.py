"""`Past`: what a page shows of the time before it came: the last events, and the curves of the last minute."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import isfinite
from threading import Lock
from typing import TYPE_CHECKING

from . import told

if TYPE_CHECKING:
    from .pilot import Frame
    from .snapshot import Snapshot

SPAN = 60.0  # s
APART = 0.2  # s between two samples
MOST = 60  # events


class Past:
    """Collects what is told and seen, from any thread; clock: s, of the real time that the page's curves go by."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock, self._lock = clock, Lock()
        self._events: deque[tuple[float, told.Event]] = deque(maxlen=MOST)
        self._samples: deque[tuple[float, Frame]] = deque(maxlen=round(SPAN / APART))

    def note(self, event: told.Event) -> None:
        """Everybody was told it."""
        with self._lock:
            self._events.append((self._clock(), event))

    def see(self, frame: Frame) -> None:
        """Everybody was shown it; of several within `APART` the first is kept."""
        now = self._clock()
        with self._lock:
            if not self._samples or now - self._samples[-1][0] >= APART:
                self._samples.append((now, frame))

    def told(self) -> told.Past:
        """For a page that comes now."""
        now = self._clock()
        with self._lock:
            events, samples = list(self._events), [each for each in self._samples if now - each[0] <= SPAN]
        frames = [frame for _, frame in samples]
        return told.Past(
            events=[told.PastEvent(**event.model_dump(), ago=_ago(now, at)) for at, event in events],
            ago=[_ago(now, at) for at, _ in samples],
            insertion=[round(float(frame.snapshot.insertion), 5) for frame in frames],
            tension=[round(float(max(frame.snapshot.tension, default=0.0)), 4) for frame in frames],
            clearance=[_clearance(frame.snapshot) for frame in frames],
            in_range=[bool(frame.snapshot.in_range) for frame in frames],
            live=[frame.mode == "live" for frame in frames],
        )


def _ago(now: float, at: float) -> float:
    return round(max(0.0, now - at), 2)


def _clearance(snapshot: Snapshot) -> float | None:
    """The least over the body and all structures, m."""
    least = min((float(each.min()) for each in snapshot.clearance.values() if len(each)), default=float("inf"))
    return round(least, 6) if isfinite(least) else None
