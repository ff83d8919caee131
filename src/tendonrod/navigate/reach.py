"""`reach`: whether a target can be reached, shown by a session with contact; else how near, and what is in the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from .metrics import Meter, Metrics
from .planner import Approach, approach, moves_of
from .scenario import Scenario
from .script import Move, play
from .session import Session
from .snapshot import Snapshot

STEP = 0.1  # s of a session's step
Watch = Callable[[str, int, int], object]


@dataclass(frozen=True, kw_only=True, eq=False)
class Reach:
    """What came of an attempt at a target.

    scenario: with the outer tube in its place. approach, moves: the way, as planned for the free robot and as a script.
    metrics, end: of the session that carried it out, with contact. limited_by: structures without any of which there
    would be a way for the free robot. pressed: where the target was not reached, the attempt that came nearer by being
    pressed along the walls, if one did.
    """

    scenario: Scenario
    target: str
    approach: Approach
    moves: tuple[Move, ...]
    metrics: Metrics
    end: Snapshot
    limited_by: tuple[str, ...] = ()
    pressed: Reach | None = None

    @property
    def reached(self) -> bool:
        """Whether the tip came within the tolerance."""
        return self.target in self.metrics.targets

    @property
    def within_limits(self) -> bool:
        """Whether no limit was exceeded and the model held, all the way."""
        return self.metrics.outside_limits == 0.0 and self.metrics.outside_model == 0.0

    @property
    def nearest(self) -> float:
        """Smallest distance of the tip to the target, m."""
        return self.metrics.nearest[self.target]


def reach(scenario: Scenario, target: str, seed: int = 0, watch: Watch | None = None) -> Reach:
    """Plan a way to ``target``, and carry it out in a session.

    Where the free robot has no way, the ways that there would be without one of the structures are carried out too, as
    its walls may guide the robot there; of those within all limits, the one that comes nearest is given. watch(what,
    done, all) follows it. The same seed gives the same answer. Raises `InvalidInput`.
    """

    def search(without: str = "") -> Approach:
        what = f"{target} without {without}" if without else target
        return approach(scenario, target, seed, None if watch is None else partial(watch, what), without)

    best = search()
    if best.reached:
        return _attempted(scenario, best)
    others = [other for other in map(search, best.clearance) if other.reached]
    tried = sorted((_attempted(scenario, way) for way in (best, *others)), key=lambda each: each.nearest)
    chosen = min(tried, key=lambda each: not each.within_limits)
    pressed = tried[0] if tried[0] is not chosen else None
    if chosen.reached and chosen.within_limits:
        return chosen
    return replace(chosen, limited_by=tuple(other.without for other in others), pressed=pressed)


def _attempted(scenario: Scenario, way: Approach) -> Reach:
    session, meter, moves = Session(scenario), Meter(), moves_of(way, scenario.robot)
    for snapshot in play(session, moves, STEP):
        meter.add(snapshot)
    return Reach(
        scenario=session.scenario, target=way.target, approach=way, moves=moves, metrics=meter.metrics(),
        end=session.snapshot,
    )  # fmt: skip
