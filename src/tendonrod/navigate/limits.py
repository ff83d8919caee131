"""`NavigationLimits`: hard stops of the drives, and what warns; defaults from the robot and the phantom."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import pi

from ..errors import InvalidInput, one_of, positive, within
from ..robot import Robot, as_robot
from ..statics.equilibrium import solve
from ..statics.limits import PLATEAU_STRAIN, fibre_strain

SHARE = 0.9  # of the tension that brings the free robot to the plateau
HIGHEST = 20.0  # N, where a robot has no plateau within reach
RANGES = {"insertion": (0.01, 1.0), "rotation": (0.0, 20.0 * pi), "snap": (0.0, 1.0)}  # SI; all others are positive
TENSION_STEP = 1e-3  # N, to which the plateau's tension is found


@dataclass(frozen=True, kw_only=True, slots=True)
class NavigationLimits:
    """Hard stops and warning limits of a session; SI.

    - insertion: share of the length; rotation: rad either way; tension: N, of each tendon. Drives stop there.
    - strain: largest axial strain of the section, where nitinol leaves linear elasticity (500 MPa / 75 GPa).
    - pressure: Pa on soft tissue, from the phantom: an engineering choice, not a clinical limit.
    - buckling: share of the Euler load of the exposed length that may push on the robot.
    - snap: m, by which the robot may jump to another equilibrium where the one that it follows ends; 0: a move that
      leads there is refused, unless it withdraws the robot.

    Raises `InvalidInput` by field.
    """

    insertion: float = 1.0
    rotation: float = 3.0 * pi
    tension: float = 0.95
    strain: float = PLATEAU_STRAIN
    pressure: float = 4.8e3
    buckling: float = 1.0
    snap: float = 0.0

    def __post_init__(self) -> None:
        for name in (each.name for each in fields(self)):
            value = getattr(self, name)
            number = within(name, value, *RANGES[name]) if name in RANGES else positive(name, value)
            object.__setattr__(self, name, number)


def plateau_tension(robot: Robot) -> float:
    """Tension (N, of all tendons alike) at which the free, unloaded robot reaches the superelastic plateau.

    At most 20 N, which stands for "not within reach". Raises `InvalidInput` where the section's outline is unknown.
    """
    low, high = 0.0, _above(as_robot(robot))
    if high >= HIGHEST:
        return HIGHEST
    while high - low > TENSION_STEP:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _passes(robot, middle) else (middle, high)
    return low


def limits_of(robot: Robot, **changes: float) -> NavigationLimits:
    """The limits of ``robot``: tension 0.9 of `plateau_tension`, the rest as by default.

    changes: fields that are set otherwise. Raises `InvalidInput`, also for a name that is none of theirs.
    """
    names = [each.name for each in fields(NavigationLimits)]
    for name in changes:
        one_of("limits", name, names)
    if robot.n_tendons and "tension" not in changes:
        changes["tension"] = SHARE * plateau_tension(robot)
    return NavigationLimits(**changes)


def _above(robot: Robot) -> float:
    tension = 0.5
    while tension < HIGHEST and not _passes(robot, tension):
        tension *= 2.0
    return tension


def _passes(robot: Robot, tension: float) -> bool:
    shape = solve(robot, tension, throw=False)
    if not shape.converged:
        return True
    strain = float(fibre_strain(shape).max())
    if strain != strain:
        raise InvalidInput("robot", robot.name, "a robot whose cross section has a known outline, for its strain")
    return strain > PLATEAU_STRAIN
