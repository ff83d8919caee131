"""`Film`: a record on the screen, with pause, speed and a place to go to.

Its snapshots come one after the other, each computed from the last, as `replay` does it; so what was computed is kept,
thinned, and the film can go back at once, but forward only as fast as it is computed. That goes on ahead of what is
shown, also in a pause.
"""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from operator import itemgetter
from os import PathLike
from typing import TYPE_CHECKING, NamedTuple

from ..errors import TendonrodError
from .news import News

if TYPE_CHECKING:
    from .snapshot import Snapshot

MOST_KEPT = 6000  # snapshots, evenly over the record; about 10 kB each
FINEST = 1.0 / 60.0  # s between two that are kept
BUDGET = 8e-3  # s of computing in one round, of 1/60 s
WAITED = 40e-3  # s of the same where the place to go to is not computed yet
AHEAD, AHEAD_WAITED = 20, 400  # snapshots computed in one round at most
EDGE = 1e-9  # s
MEASURED = 1.0  # s, of its pace

Happened = tuple[float, str, str]  # s from the record's beginning, severity, text


class Playing(NamedTuple):
    """What of a record is shown: at and span in s from its beginning; known: up to where it is computed; pace: how
    fast it really went lately, None where that is not known yet.
    """

    name: str
    at: float
    span: float
    known: float
    speed: float
    paused: bool
    pace: float | None = None


class Film:
    """``frames`` against the clock, ``speed`` times as fast as they were recorded; at its end it pauses.

    span: s, as far as it is known beforehand.
    """

    def __init__(
        self,
        frames: Iterator[Snapshot],
        *,
        name: str = "",
        span: float = 0.0,
        speed: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._frames, self._clock, self._now = frames, clock, clock()
        self._name, self._span, self._speed, self._paused = name, span, speed, False
        self._apart = max(FINEST, span / MOST_KEPT)
        first = next(frames)
        self._kept, self._times = [first], [0.0]
        self._newest, self._begun, self._known, self._is_whole = first, first.time, 0.0, False
        self._at = 0.0
        self._goal: float | None = None
        self._fault: TendonrodError | None = None
        self._shown = first
        self._news, self._happened, self._told = News(first), list[Happened](), 0.0
        self._pace: float | None = None
        self._since: tuple[float, float] | None = None  # from when on it is measured, and what was shown then
        self.is_moving = False

    @property
    def playing(self) -> Playing:
        at = self._at if self._goal is None else self._goal
        return Playing(self._name, at, max(self._span, self._known), self._known, self._speed, self._paused, self._pace)

    @property
    def is_idle(self) -> bool:
        """Whether the next round would show the same again."""
        return self._paused and self._goal is None and self._is_whole

    def change(self, speed: float | None = None, paused: bool | None = None, at: float | None = None) -> None:
        """Another speed, a pause or its end, another place (s from the beginning, at most its end)."""
        self._speed = self._speed if speed is None else speed
        self._paused = self._paused if paused is None else paused
        self._pace = self._since = None
        if at is not None:
            self._goal = min(at, max(self._span, self._known))
        elif paused is False and self._is_whole and self._at >= self._known - EDGE:
            self._goal = 0.0  # once more, from the beginning

    def look(self) -> Snapshot:
        """What is to be seen now. Raises the `TendonrodError` at which the record's replay ends, once it is there."""
        now = self._clock()
        passed, self._now = now - self._now, now
        wanted = self._goal if self._goal is not None else self._at + (0.0 if self._paused else passed * self._speed)
        self._compute(wanted)
        if self._goal is not None and (self._known >= self._goal or self._is_whole):
            self._goal = None
        self._at = min(wanted, self._known)  # too slow for this speed: it goes on from here
        if self._is_whole and self._goal is None and self._at >= self._known - EDGE:
            self._rest()
        self._measure(now)
        return self._show()

    def passed(self) -> Sequence[Happened]:
        """What happened in the record between what was shown when this was asked last, and now."""
        first = bisect_right(self._happened, self._told + EDGE, key=itemgetter(0))
        self._told = self._at
        return self._happened[first : bisect_right(self._happened, self._at + EDGE, key=itemgetter(0))]

    def _measure(self, now: float) -> None:
        """Over a second at a time, at least."""
        if self._paused or self._goal is not None:
            self._pace = self._since = None
        elif self._since is None:
            self._since = (now, self._at)
        elif now - self._since[0] >= MEASURED:
            self._pace = round((self._at - self._since[1]) / (now - self._since[0]), 3)
            self._since = (now, self._at)

    def _rest(self) -> None:
        """At the end."""
        if self._fault is not None:
            raise self._fault
        self._paused = True

    def _show(self) -> Snapshot:
        k = bisect_right(self._times, self._at + EDGE) - 1
        found = self._newest if self._at >= self._known - EDGE else self._kept[k]
        self.is_moving = found.posture != self._shown.posture
        self._shown = found
        return found

    def _compute(self, wanted: float) -> None:
        is_waited = self._goal is not None and wanted > self._known
        end, most = (WAITED, AHEAD_WAITED) if is_waited else (BUDGET, AHEAD)
        end += self._clock()
        for _ in range(most):
            if self._is_whole or self._clock() > end:
                return
            self._take()

    def _take(self) -> None:
        try:
            newest = next(self._frames, None)
        except TendonrodError as error:
            newest, self._fault = None, error
        if newest is None:
            self._is_whole = True
            self._span = self._known
            return
        self._newest, self._known = newest, newest.time - self._begun
        self._happened += [(self._known, severity, text) for severity, text in self._news.of(newest)]
        if self._known - self._times[-1] >= self._apart - EDGE:
            self._kept.append(newest)
            self._times.append(self._known)


def span_of(path: str | PathLike[str]) -> float:
    """s that a record takes. Raises `InvalidInput` for lines that no session wrote."""
    from .replay import lines

    return sum(line["count"] * line["dt"] for line in lines(path) if "event" not in line)
