"""`Refusals`: which moves were refused lately, so that a key that is held does not have them computed again and again.

To find that a move leads nowhere takes ten times as long as a move. From the very state in which it was refused it is
refused again, with the same words. Where something of it is carried out every time, as a withdrawal is, the state
changes; then the whole is tried after one step, and each time it is refused again after twice as many.

It knows no clock and is part of the session's state: the same commands find the same answers, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .commands import Posture
from .mechanics import QUARTERS, Body, Travel, apart, strides, withdrawal
from .scenario import Scenario

ALIKE = 0.05  # of their length: two moves that differ by less are one, as the noise of a stick differs
SHORTER = 0.5  # of the length of the shortest part that was refused, below which another may well succeed
MOST = 8  # moves that are remembered
LONGEST = 32  # steps from one try to the next


@dataclass(frozen=True, kw_only=True, eq=False)
class _Refused:
    """move: the shortest part that was tried, in strides of `mechanics`. body: that stayed as it was, None where
    something was carried out.

    wait: steps until it is tried again, at first ``period``. stuck: body from which not even the withdrawal led on.
    """

    move: np.ndarray
    why: str
    body: Body | None
    wait: int
    period: int
    stuck: Body | None = None

    def covers(self, move: np.ndarray) -> bool:
        length, mine = float(np.linalg.norm(move)), float(np.linalg.norm(self.move))
        return length >= SHORTER * mine and float(np.linalg.norm(move / length - self.move / mine)) < ALIKE


class Refusals:
    """Of one session, in order."""

    def __init__(self) -> None:
        self._found: list[_Refused] = []

    def known(self, scenario: Scenario, body: Body, goal: Posture) -> tuple[str, Posture]:
        """Why the move from ``body`` to ``goal`` is refused without a try, "" where it is to be tried; where to go."""
        k = self._place(apart(scenario, body.posture, goal))
        if k is None:
            return "", goal
        each = self._found[k]
        if each.body is body:
            return each.why, body.posture
        if each.wait == 0:
            return "", goal
        self._found[k] = replace(each, wait=each.wait - 1)
        eased = withdrawal(body.posture, goal)
        return each.why, body.posture if eased == goal or each.stuck is body else eased

    def add(self, scenario: Scenario, body: Body, goal: Posture, travel: Travel) -> None:
        """Trying to move from ``body`` to ``goal`` led to ``travel``."""
        if not travel.refused:
            self._found = []
            return
        move, period = apart(scenario, body.posture, goal), 1
        k = self._place(move)
        if k is not None:
            period = min(2 * self._found.pop(k).period, LONGEST)
        stayed = body if travel.body is body else None
        part = move / (strides(scenario, body.posture, goal) * QUARTERS)
        new = _Refused(move=part, why=travel.refused, body=stayed, wait=period, period=period)
        self._found = [*self._found[1 - MOST :], new]

    def add_stuck(self, scenario: Scenario, body: Body, goal: Posture) -> None:
        """What withdraws of the known move from ``body`` to ``goal`` was tried alone, and led nowhere either."""
        k = self._place(apart(scenario, body.posture, goal))
        if k is not None:
            self._found[k] = replace(self._found[k], stuck=body)

    def pause(self) -> None:
        """Nothing is asked for: who asks again after it shall not wait."""
        self._found = [each for each in self._found if each.body is not None]

    def _place(self, move: np.ndarray) -> int | None:
        return next((k for k, each in enumerate(self._found) if each.covers(move)), None)
