"""The operator's seat: one at a time, taken explicitly, never from somebody who is there."""

from __future__ import annotations

import time
from collections.abc import Callable

from ..errors import Fact, InvalidInput

ABSENCE = 10.0  # s without a word, after which another may take control


class Refused(InvalidInput):
    """A client asked for what it may not have; the sentence says why."""

    def __init__(self, reason: str) -> None:
        super().__init__("control", Fact(reason), "yours")
        self.reason = reason

    def __str__(self) -> str:
        return self.reason


class Seat:
    """Who has control. Clients are known by a text each."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, absence: float = ABSENCE) -> None:
        self.clock, self.absence = clock, absence
        self.holder: str | None = None
        self._heard = 0.0

    @property
    def is_free(self) -> bool:
        """Whether anybody could take control now: nobody has it, or who has it is absent."""
        return self.holder is None or self.clock() - self._heard >= self.absence

    def take(self, who: str) -> str:
        """Give control to ``who``: "" if granted, else a sentence that says why not."""
        if self.holder != who and not self.is_free:
            return (
                f"{self.holder} has control: it must release it first, "
                f"or say nothing for {self.absence:g} s (now {self.clock() - self._heard:.1f} s)"
            )
        self.holder, self._heard = who, self.clock()
        return ""

    def leave(self, who: str) -> bool:
        """``who`` gives control back or is gone; whether it had it."""
        had = self.has(who)
        if had:
            self.holder = None
        return had

    def heard(self, who: str) -> None:
        """``who`` said something."""
        if self.has(who):
            self._heard = self.clock()

    def has(self, who: str) -> bool:
        return self.holder is not None and self.holder == who

    def refusal(self, who: str) -> str:
        """ "" where ``who`` may steer, else a sentence that says why not."""
        if self.has(who):
            return ""
        return "nobody has control: take it first" if self.holder is None else f"{self.holder} has control"
