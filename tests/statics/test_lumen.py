"""Tendons that leave the wall at low tension: where they lie, when, and that they are those of the wall above that."""

import dataclasses
from itertools import pairwise, product

import numpy as np
import pytest

import actuation_oracles as act
from tendonrod import InvalidInput, Robot, Tendon, solve
from tendonrod.body import Segments
from tendonrod.section import NotchedTube
from textbook import GRAVITY, PROTOTYPES, farthest, prototype

TORSIONS = ("published", "open_section")
LIFT_OFF = {  # physics.md, section 4, N
    "published": (0.0671, 0.1325, 0.3641, 1.749),
    "open_section": (0.0666, 0.1310, 0.3315, 1.376),
}
ROBOTS = list(product(range(1, len(PROTOTYPES) + 1), TORSIONS))


def free(robot: Robot, **more) -> Robot:
    return robot.replace(tendons=tuple(dataclasses.replace(each, wall="free", **more) for each in robot.tendons))


def lumen(robot: Robot) -> tuple[float, float]:
    """x of the tube's axis and how far from it the tendon can go, m."""
    assert isinstance(robot.body, NotchedTube)
    return robot.section.r_na, robot.body.inner_radius - robot.tendons[0].radius


@pytest.mark.parametrize(("number", "torsion"), ROBOTS)
@pytest.mark.parametrize("share", [0.02, 0.3, 0.9, 0.999])
def test_below_the_threshold_it_lies_where_the_oracle_says(number, torsion, share):
    robot = free(prototype(number, torsion))
    rod, (centre, radius) = act.rod_of(robot), lumen(robot)
    tau = share * act.lift_off_tension(rod, centre, radius)
    arm = act.free_arm(rod, tau, centre, radius)
    shape = solve(robot, tau, accuracy=1e-10)
    assert not arm.on_wall
    assert farthest(shape.tip, act.helix(rod, arm.state.v, arm.state.u, rod.length)[:3, 3]) < 1e-10
    assert np.abs(shape.u - arm.state.u).max() < 1e-7


@pytest.mark.parametrize(("number", "torsion"), ROBOTS)
def test_at_the_published_threshold_it_leaves_the_wall(number, torsion):
    held, robot = prototype(number, torsion), free(prototype(number, torsion))
    threshold = LIFT_OFF[torsion][number - 1]
    above, below = 1.003 * threshold, 0.99 * threshold
    assert farthest(solve(robot, above, accuracy=1e-10).tip, solve(held, above, accuracy=1e-10).tip) < 1e-12
    assert farthest(solve(robot, below, accuracy=1e-10).tip, solve(held, below, accuracy=1e-10).tip) > 1e-9


@pytest.mark.parametrize(("number", "torsion"), ROBOTS)
def test_above_the_threshold_it_is_the_held_tendon_under_load_too(number, torsion):
    held, robot = prototype(number, torsion), free(prototype(number, torsion))
    tau, loads = 2.0 * LIFT_OFF[torsion][number - 1], {"gravity": 0.3 * GRAVITY, "tip_force": (1e-4, 0.0, 0.0)}
    assert farthest(solve(robot, tau, **loads, steps=40).tip, solve(held, tau, **loads, steps=40).tip) < 1e-10


@pytest.mark.parametrize(("number", "torsion"), ROBOTS)
@pytest.mark.parametrize("gravity", [GRAVITY, (0.0, 9.81, 0.0), (0.0, 0.0, -9.81)])
def test_finite_and_continuous_under_gravity(number, torsion, gravity):
    robot = free(prototype(number, torsion))
    threshold = LIFT_OFF[torsion][number - 1]
    tips = [solve(robot, tau, gravity=gravity).tip for tau in np.linspace(0.0, 1.5, 16) * threshold]
    steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    assert np.isfinite(tips).all()
    assert steps.max() < 5.0 * np.median(steps) + 1e-4
    at_rest = solve(prototype(number, torsion), 0.0, gravity=gravity).tip
    assert farthest(tips[0], at_rest) < 3e-6


def test_the_threshold_is_smooth():
    """Where it meets the wall the shape's slope by tension jumps, the shape does not."""
    robot, rod = free(prototype(1)), act.rod_of(prototype(1))
    threshold = act.lift_off_tension(rod, *lumen(robot))
    tips = [solve(robot, threshold * (1.0 + h), accuracy=1e-11).tip for h in (-1e-6, 1e-6)]
    assert farthest(*tips) < 1e-8


def test_the_free_tendon_bends_less_and_needs_no_more_length():
    """Of all places the tendon takes the one of least energy, so that its path is the shortest."""
    held, robot = prototype(1), free(prototype(1))
    for tau in (0.01, 0.03, 0.06):
        a, b = solve(robot, tau).at([0.0]), solve(held, tau).at([0.0])
        assert np.linalg.norm(a.u - held.section.u_star) < np.linalg.norm(b.u - held.section.u_star)


@pytest.mark.parametrize("tau", [0.02, 0.06, 0.2])
def test_length_drive_of_a_free_tendon(tau):
    """Pulled length: from the straight line through the slack robot, the shortest that there is."""
    robot = free(prototype(1))
    rod, (centre, radius) = act.rod_of(robot), lumen(robot)
    slack, arm = act.free_arm(rod, 1e-12, centre, radius), act.free_arm(rod, tau, centre, radius)
    d = rod.length * (slack.state.q - arm.state.q)
    shape = solve(robot, displacements=d, accuracy=1e-10)
    assert shape.tensions[0] == pytest.approx(tau, rel=1e-6)


@pytest.mark.parametrize("loads", [{"gravity": GRAVITY}, {"gravity": (0.0, 5.0, 0.0), "tip_force": (1e-4, 2e-4, 0.0)}])
def test_converges_with_the_steps(loads):
    robot = free(prototype(2))
    tips = [solve(robot, 0.08, **loads, steps=n, accuracy=1e-9).tip for n in (16, 32, 64, 128)]
    errors = np.array([farthest(a, b) for a, b in pairwise(tips)])
    assert errors[-1] < 2e-7
    assert errors[-1] < errors[0]


def test_in_segments_each_has_its_own_lumen():
    body = prototype(1).body
    assert isinstance(body, NotchedTube)
    halves = tuple(dataclasses.replace(body, length=0.5 * body.length, turns=0.5 * body.turns) for _ in range(2))
    cut = Robot(name="cut", body=Segments(segments=halves), tendons=free(prototype(1)).tendons)
    for tau in (0.03, 0.3):
        whole = solve(free(prototype(1)), tau, gravity=GRAVITY, steps=40)
        assert farthest(solve(cut, tau, gravity=GRAVITY, steps=40).tip, whole.tip) < 1e-11


@pytest.mark.parametrize("routing", ["constant", "helical"])
def test_only_a_tendon_on_the_wall_can_leave_it(routing):
    where = {"x": 0.0, "y": 0.0} if routing == "constant" else {"offset": 1e-3, "angle": 0.0, "turns": 1.0}
    with pytest.raises(InvalidInput, match="wall"):
        getattr(Tendon, routing)(**where, wall="free")


def test_the_wall_is_held_or_free():
    with pytest.raises(InvalidInput, match="wall"):
        Tendon.opposite_backbone(radius=5e-5, wall="loose")
