"""`News`: what happens to a session that moves, as sentences for everybody: a target reached, a move refused, a limit
passed, a fault of the bench.
"""

from __future__ import annotations

import re
from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .snapshot import Snapshot

BURST = 1.0  # s of the session, in which what goes on, with breaks shorter than this, is told once
NUMBER = re.compile(r"[\d.]+")
OUTSIDE = frozenset({"lift-off"})  # codes of the mere warnings that put the robot outside the model's range

Told = tuple[str, str]  # severity and text


class News:
    """Compares the snapshots of one session, or of one record that is shown, in their order."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._reached = frozenset(snapshot.reached)
        self._trouble = ""
        self._last: dict[str, float] = {}

    def of(self, snapshot: Snapshot) -> list[Told]:
        """What is new."""
        return [*self._arrivals(snapshot), *self._refusals(snapshot), *self._limits(snapshot)]

    def trouble(self, text: str) -> list[Told]:
        """Each fault of a bench once, and that it is over; text: of the present one, "" for none."""
        if text == self._trouble:
            return []
        self._trouble = text
        return [("limit", text) if text else ("info", "the bench obeys again")]

    def _arrivals(self, snapshot: Snapshot) -> list[Told]:
        reached = frozenset(snapshot.reached)
        new, self._reached = reached - self._reached, reached
        return [("info", f"target {name} is reached") for name in sorted(new)]

    def _refusals(self, snapshot: Snapshot) -> list[Told]:
        """Each motion and each reason for itself; a fault of the bench is told as such."""
        text = snapshot.blocked
        if not text or (self._trouble and self._trouble in text):
            return []
        return [("limit", text)] if self._begins(NUMBER.sub("", text), snapshot.time) else []

    def _limits(self, snapshot: Snapshot) -> list[Told]:
        found = [each for each in snapshot.warnings if each.severity == "limit" or each.code in OUTSIDE]
        return [(each.severity, each.text) for each in found if self._begins(each.code, snapshot.time)]

    def _begins(self, what: str, time: float) -> bool:
        """Whether it was not so a moment ago."""
        last, self._last[what] = self._last.get(what, -inf), time
        return time - last > BURST
