"""`News`: what happens to a session that moves, as sentences for everybody: a target reached, a move refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .snapshot import Snapshot

REFUSED = "not moved further: "  # as a session says it
BURST = 1.0  # s of the session within which refusals are told once


class News:
    """Compares the snapshots of one session, in their order; those of a record that is shown are not for it."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._reached = frozenset(snapshot.reached)
        self._refused, self._at = "", -BURST

    def of(self, snapshot: Snapshot) -> list[tuple[str, str]]:
        """Severity and text of what is new."""
        return [*self._arrivals(snapshot), *self._refusals(snapshot)]

    def _arrivals(self, snapshot: Snapshot) -> list[tuple[str, str]]:
        reached = frozenset(snapshot.reached)
        new, self._reached = reached - self._reached, reached
        return [("info", f"target {name} is reached") for name in sorted(new)]

    def _refusals(self, snapshot: Snapshot) -> list[tuple[str, str]]:
        """One for a burst: as long as moves go on being refused, for whatever reason."""
        if not snapshot.blocked:
            return []
        is_new, self._at = snapshot.time - self._at > BURST, snapshot.time
        return [("limit", f"refused: {snapshot.blocked.removeprefix(REFUSED)}")] if is_new else []
