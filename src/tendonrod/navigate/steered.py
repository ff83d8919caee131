"""`Steered`: what a bench under a session knows of it, and what the two must have in common."""

from __future__ import annotations

from typing import Protocol

from ..errors import Fact, InvalidInput
from ..rig.benches import BenchSource
from ..rig.limits import Limits
from ..rig.model_limits import StrainTable
from ..robot import Robot
from .limits import NavigationLimits

KEPT_FREE = 0.95  # share of a bench's soft limits that is steered to: noise and the motion itself need the rest


class Steered(Protocol):
    """What is needed of a `Scenario`."""

    @property
    def robot(self) -> Robot: ...

    @property
    def limits(self) -> NavigationLimits: ...

    @property
    def coupled(self) -> bool: ...


def check_same(scenario: Steered, source: BenchSource) -> None:
    """The bench's robot must be the scenario's, or the session would show another."""
    if scenario.robot.n_tendons != 1:
        raise InvalidInput("robot", Fact(f"{scenario.robot.n_tendons} tendons"), "one with one tendon, as the bench is")
    if source.robot.body != scenario.robot.body or source.robot.tendons != scenario.robot.tendons:
        names = f"{source.robot.name}, torsion {source.robot.torsion}"
        mine = f"{scenario.robot.name}, torsion {scenario.robot.torsion}"
        raise InvalidInput("bench", Fact(f"one with {names}"), f"one with the scenario's robot, {mine}")


def highest_tension(limits: Limits, table: StrainTable) -> float:
    """Tension (N) that a bench with these limits can hold and insert under, at any insertion.

    Above its soft limits it lets nothing through that raises the tension: the robot would be stuck there.
    """
    strained = min(table.limit(float(eta), limits.soft * limits.strain) for eta in table.insertions)
    return KEPT_FREE * min(limits.soft * limits.tension, strained)
