"""One equilibrium after another: the robot's shape along a small move, in parts where the whole is too much.

Contact and large bending make several equilibria possible. Each is started from the last, and one that lies far from it
is not taken: the robot would snap there. So a session shows the branch that slow motion follows, or says that it ends.
A robot that is withdrawn is let snap, to where its energy falls: an operator must always get it out. Another only as
far as `NavigationLimits.snap` says.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, inf, radians

import numpy as np

from ..errors import InvalidInput
from ..statics.neighbour import Effort, motion, neighbour
from ..statics.shape import Shape, Status
from .commands import Jog, Posture
from .scenario import Scenario

ACCURACY = 2e-5  # m, of the shape, and by which the tube may enter a wall
POINTS = 48  # along the body
STRIDE = {"insertion": 0.25e-3, "rotation": radians(1.0), "tension": 0.01}  # m, rad, N: largest move of one solve
SNAP = 1e-3  # m, motion of the body in one solve that small steps cannot explain
LOOSE = 0.3e-3  # m, error to be content with in contact, as on sharp edges of a wall; `observation` tells
LOOKS, FAR_LOOKS = 24, 48  # at the walls, of one solve
CHECKED, TRUSTED = (
    Effort(content=LOOSE, most_steps=80, is_checked=each, most_looks=LOOKS, farthest=SNAP) for each in (True, False)
)
FAR = Effort(content=LOOSE, most_steps=160, most_looks=FAR_LOOKS)  # where a robot is let snap
CHECKED_EVERY = 8  # shapes, of which one is solved on two grids to know its error
WHY_NOT = {
    Status.STALLED: "no equilibrium is found near the present one, the robot would fold or snap away",
    Status.TOO_FINE: f"the contact cannot be computed to {1e3 * LOOSE:g} mm, so where the robot would go is not known",
}
LONGER = tuple(2**k for k in range(13))  # strides of retractions tried where the one asked for leads nowhere: to 1 m
QUARTERS = 4  # parts in which a stride is tried where the whole is refused


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A solved shape at `POINTS` even arc lengths, one where it is retracted, and the posture that it answers to.

    trusted: how many shapes in a row took the error of the one before for theirs.
    """

    posture: Posture
    shape: Shape
    trusted: int = 0

    @property
    def axis(self) -> np.ndarray:
        """(n, 3) the tube's axis, m."""
        return self.shape.centerline


@dataclass(frozen=True, kw_only=True, eq=False)
class Travel:
    """Where a move led: the last body on the way, why not further ("" where it went all the way), and whether it
    snapped on the way, m by how much.
    """

    body: Body
    refused: str = ""
    snapped: float = 0.0


def rest(scenario: Scenario, posture: Posture) -> Body:
    """The body at ``posture`` from nothing. Raises `InvalidInput` where there is none."""
    shape, why = _solved(scenario, posture, None)
    if shape is None:
        raise InvalidInput("posture", posture, f"one with an equilibrium: {why}")
    return Body(posture=posture, shape=shape)


def move(scenario: Scenario, body: Body, goal: Posture) -> Travel:
    """From ``body`` to ``goal`` through neighbouring equilibria, as far as there are any.

    Where the whole is refused, what of it withdraws the robot is carried out alone.
    """
    start, parts, snapped = body.posture, strides(scenario, body.posture, goal), 0.0
    for k in range(1, parts + 1):
        part = start.towards(goal, k / parts)
        travel = _stride(scenario, body, part)
        if travel.refused:
            eased = withdrawal(travel.body.posture, part)
            alone = travel if eased in (travel.body.posture, part) else _snap(scenario, travel, eased, inf)
            return replace(alone, refused=travel.refused, snapped=max(snapped, alone.snapped))
        body, snapped = travel.body, max(snapped, travel.snapped)
    return Travel(body=body, snapped=snapped)


def withdrawal(start: Posture, goal: Posture) -> Posture:
    """What of a move only retracts or relaxes the robot, or brings its rotation nearer to 0."""
    return Posture(
        insertion=min(start.insertion, goal.insertion),
        rotation=goal.rotation if abs(goal.rotation) < abs(start.rotation) else start.rotation,
        tension=tuple(min(a, b) for a, b in zip(start.tension, goal.tension, strict=True)),
    )


def apart(scenario: Scenario, start: Posture, goal: Posture) -> np.ndarray:
    """(2 + n_tendons,) from ``start`` to ``goal`` in insertion, rotation and tensions, in units of `STRIDE`."""
    length = scenario.robot.length_na
    way = [
        (goal.insertion - start.insertion) * length / STRIDE["insertion"],
        (goal.rotation - start.rotation) / STRIDE["rotation"],
    ]
    return np.array(way + [(b - a) / STRIDE["tension"] for a, b in zip(start.tension, goal.tension, strict=True)])


def strides(scenario: Scenario, start: Posture, goal: Posture) -> int:
    """Number of even parts, each within `STRIDE`, at least 1."""
    return max(1, ceil(float(np.abs(apart(scenario, start, goal)).max()) - 1e-9))


def seconds(jog: Jog, parts: int) -> float:
    """How long a motion at ``jog`` may last that takes so many strides, s; infinite where it stands."""
    speed = max(abs(getattr(jog, name)) / stride for name, stride in STRIDE.items())
    return parts / speed if speed > 0.0 else inf


def _stride(scenario: Scenario, body: Body, goal: Posture) -> Travel:
    """One part of a move, in quarters where the whole is refused; it may snap if it is a withdrawal."""
    travel = _part(scenario, body, goal, is_whole=True)
    for k in range(1, QUARTERS + 1) if travel.refused else ():
        travel = _part(scenario, travel.body, body.posture.towards(goal, k / QUARTERS), is_whole=False)
        if travel.refused:
            break
    allowed = inf if withdrawal(body.posture, goal) == goal else scenario.limits.snap
    return _snap(scenario, travel, goal, allowed) if travel.refused and allowed > 0.0 else travel


def _part(scenario: Scenario, body: Body, goal: Posture, is_whole: bool) -> Travel:
    """One solve."""
    trusts = is_whole and body.trusted < CHECKED_EVERY - 1
    shape, why = _solved(scenario, goal, body.shape, TRUSTED if trusts else CHECKED)
    if shape is None:
        return Travel(body=body, refused=why)
    leap = motion(body.shape, shape)
    if leap > SNAP:
        return Travel(body=body, refused=f"the robot would snap away by {1e3 * leap:.2g} mm")
    return Travel(body=Body(posture=goal, shape=shape, trusted=body.trusted + 1 if trusts else 0))


def _snap(scenario: Scenario, travel: Travel, goal: Posture, allowed: float) -> Travel:
    """To ``goal``, down in energy from the last shape wherever that leads, but no further than ``allowed`` (m).

    Where any way is allowed, a whole stride in that direction is tried too, as it often leads over the edge, and longer
    and longer ones of a retraction, at last into the outer tube, so that an operator gets out of everywhere.
    """
    start, goals = travel.body.posture, [goal]
    if allowed == inf:
        most = len(LONGER) if goal.insertion < start.insertion else 1
        longer = [_lengthened(scenario, start, goal, count) for count in LONGER[:most]]
        over = _part(scenario, travel.body, longer[0], is_whole=False)
        if not over.refused:
            return over
        goals += longer
    for each in dict.fromkeys(goals):
        shape, _ = _solved(scenario, each, travel.body.shape, FAR)
        if shape is not None and (leap := motion(travel.body.shape, shape)) <= allowed:
            return Travel(body=Body(posture=each, shape=shape), snapped=leap)
    return travel


def _lengthened(scenario: Scenario, start: Posture, goal: Posture, count: int) -> Posture:
    """A withdrawal to ``goal`` made as long as so many strides, where there is that much left to withdraw."""
    share = max(1.0, count / float(np.abs(apart(scenario, start, goal)).max()))
    return Posture(
        insertion=max(0.0, start.insertion + share * (goal.insertion - start.insertion)),
        rotation=goal.rotation if share * abs(goal.rotation - start.rotation) > abs(start.rotation)
        else start.rotation + share * (goal.rotation - start.rotation),
        tension=tuple(max(0.0, a + share * (b - a)) for a, b in zip(start.tension, goal.tension, strict=True)),
    )  # fmt: skip


def _solved(
    scenario: Scenario, posture: Posture, start: Shape | None, effort: Effort = CHECKED
) -> tuple[Shape | None, str]:
    """The sampled shape, or None and why."""
    try:
        shape = neighbour(
            scenario.robot, posture.tension or 0.0, start, POINTS, effort, gravity=scenario.gravity,
            insertion=posture.insertion, rotation=posture.rotation, exit_pose=scenario.pose,
            surface=scenario.surface, accuracy=ACCURACY, contact_tolerance=ACCURACY,
        )  # fmt: skip
    except InvalidInput as error:  # such as a distance asked for outside a grid
        return None, str(error)
    if not shape.converged:
        return None, WHY_NOT.get(shape.status, shape.status)
    if shape.stable is False:
        return None, "the equilibrium is unstable, the robot would buckle away from it"
    return shape, ""
