"""Loads that turn with the body: plane solutions, tip-to-base integration, what stays, what is refused."""

import itertools

import numpy as np
import pytest

import actuation_oracles as act
import follower_oracles as follow
from tendonrod import InvalidInput, PlainRod, Robot, solve
from tendonrod.loads import DistributedLoad, PointLoad
from textbook import GRAVITY, about_z, farthest, prototype, rod

TORSIONS = ("published", "open_section")


def beam() -> Robot:
    """1 m, EI = 1 N m^2, no extension or shear to speak of."""
    body = PlainRod(
        length=1.0, area=1.0, ix=1e-10, iy=1e-10, j=2e-10, youngs_modulus=1e10, shear_modulus=1e10, density=0.0
    )
    return Robot(name="beam", body=body)


def on_axis(robot: Robot, force, moment=(0.0, 0.0, 0.0), at=None, frame="body") -> PointLoad:
    """A load on the neutral axis, which is where the oracles put it."""
    return PointLoad(force=force, moment=moment, at=at, frame=frame, offset=(-robot.section.r_na, 0.0, 0.0))


@pytest.mark.parametrize("load", [0.5, 2.0, 5.0, 13.0, 20.0])
def test_transverse_tip_force(load):
    plane = follow.transverse_follower(load)
    shape = solve(beam(), (), loads=[PointLoad(force=(load, 0.0, 0.0), frame="body")], accuracy=1e-8)
    np.testing.assert_allclose(shape.tip, [plane.y, 0.0, plane.x], rtol=0, atol=4e-8)
    tangent = shape.rotation[-1][:, 2]
    np.testing.assert_allclose(tangent[[0, 2]], [np.sin(plane.angle), np.cos(plane.angle)], rtol=0, atol=2e-7)


@pytest.mark.parametrize("load", [0.5, 5.0, 20.0, 40.0])
@pytest.mark.parametrize("direction", [0.0, 2.0])
def test_pressure(load, direction):
    plane, turn = follow.pressure(load), about_z(direction)
    shape = solve(beam(), (), loads=[DistributedLoad(force=turn @ [load, 0.0, 0.0], frame="body")], accuracy=1e-8)
    assert farthest(shape.tip, turn @ [plane.y, 0.0, plane.x]) < 4e-8


def test_half_way_the_rest_stays_straight():
    plane = follow.transverse_follower(3.0)
    load = PointLoad(force=(12.0, 0.0, 0.0), at=0.5, frame="body")
    shape = solve(beam(), (), loads=[load], accuracy=1e-8, s=np.linspace(0.5, 1.0, 5))
    end = 0.5 * np.array([plane.y + np.sin(plane.angle), 0.0, plane.x + np.cos(plane.angle)])
    assert farthest(shape.tip, end) < 4e-8
    assert np.abs(shape.u).max() < 1e-9


POINTS = {
    "tip": ((2e-3, 1e-3, -1e-3), (1e-5, -2e-5, 1e-5), 1.0),
    "middle": ((4e-3, -3e-3, 2e-3), (0.0, 3e-5, 1e-5), 0.5),
    "base": ((0.1, 0.0, 0.0), (0.0, 1e-4, 0.0), 1e-3),
}


@pytest.mark.parametrize(("force", "moment", "share"), POINTS.values(), ids=POINTS.keys())
@pytest.mark.parametrize("torsion", TORSIONS)
@pytest.mark.parametrize("tau", [0.0, 0.5, 1.2])
def test_point_load_on_the_prototype(force, moment, share, torsion, tau):
    robot = prototype(1, torsion)
    at = share * robot.length_na
    s = robot.length_na * np.array([0.3, 0.7, 1.0])
    oracle = follow.solve(
        act.rod_of(robot), follow.Loads(points=(follow.PointLoad(s=at, force=force, moment=moment),)), tau, s
    )
    shape = solve(robot, tau, loads=[on_axis(robot, force, moment, at)], accuracy=1e-9, s=s)
    assert farthest(shape.position, oracle.position) < 2e-9
    assert np.abs(shape.rotation - oracle.rotation).max() < 1e-6
    if share < 1.0:
        assert farthest(np.einsum("nji,nj->ni", shape.rotation, shape.force), oracle.force) < 1e-9


@pytest.mark.parametrize(("torsion", "tau"), [("published", 0.7), ("open_section", 0.0)])
def test_everything_that_follows_and_everything_dead_at_once(torsion, tau):
    robot, L = prototype(1, torsion), prototype(1).length_na
    points = (
        follow.PointLoad(s=0.4 * L, force=np.array([3e-3, -2e-3, 1e-3]), moment=np.array([1e-5, 0.0, -1e-5])),
        follow.PointLoad(
            s=0.7 * L, force=np.array([-1e-3, 2e-3, 0.0]), moment=np.array([0.0, 1e-5, 0.0]), follows=False
        ),
        follow.PointLoad(s=L, force=np.array([1e-3, 0.0, -1e-3]), follows=False),
    )
    given = follow.Loads(
        body_force=[0.02, -0.03, 0.01], body_moment=[1e-4, -1e-4, 2e-4], dead_force=[-0.01, 0.02, 0.0],
        dead_moment=[1e-4, 0.0, 1e-4], points=points,
    )  # fmt: skip
    s = L * np.array([0.25, 0.5, 0.75, 1.0])
    oracle = follow.solve(act.rod_of(robot), given, tau, s)
    loads = [on_axis(robot, p.force, p.moment, p.s, "body" if p.follows else "world") for p in points]
    loads.append(DistributedLoad(force=given.body_force, moment=given.body_moment, frame="body"))
    shape = solve(
        robot, tau, loads=loads, distributed_force=given.dead_force, distributed_moment=given.dead_moment, s=s,
        accuracy=1e-9,
    )  # fmt: skip
    assert farthest(shape.position, oracle.position) < 2e-9
    np.testing.assert_allclose(np.einsum("nji,nj->ni", shape.rotation, shape.moment)[1], oracle.moment[1], atol=1e-11)


def test_a_follower_turns_with_the_exit():
    """Nothing but the base holds a follower's direction: turned exit, turned shape."""
    robot = prototype(2)
    loads = {"loads": [PointLoad(force=(3e-3, -1e-3, 0.0), frame="body", at=0.05)], "accuracy": 1e-9}
    a, b = solve(robot, 0.6, **loads), solve(robot, 0.6, rotation=1.1, **loads)
    assert farthest(b.position, a.position @ about_z(1.1).T) < 1e-12


def test_small_followers_are_dead_loads():
    """They part with the square of the load."""
    robot, parted = prototype(1), []
    for size in (1e-5, 1e-6):
        body, world = ([PointLoad(force=(size, size, 0.0), frame=frame)] for frame in ("body", "world"))
        straight = [solve(robot, 0.0, loads=load, steps=40, accuracy=1e-12).tip for load in (body, world)]
        parted.append(farthest(*straight))
    assert parted[0] / parted[1] == pytest.approx(100.0, rel=0.1)


def test_an_axial_follower_does_not_buckle_a_straight_column():
    """Beck's column: straight beyond Euler's load, and no other static answer."""
    shape = solve(beam(), (), loads=[PointLoad(force=(0.0, 0.0, -10.0), frame="body")])
    np.testing.assert_allclose(shape.tip, [0.0, 0.0, 1.0], atol=1e-8)
    assert shape.stable is None


def test_stability_is_not_told_where_loads_have_no_potential():
    force, moment = {"force": (1e-3, 0.0, 0.0)}, {"moment": (1e-5, 0.0, 0.0)}
    robot = prototype(1)
    assert solve(robot, 0.5, loads=[PointLoad(**force, frame="body")]).stable is None
    assert solve(robot, 0.5, loads=[PointLoad(**moment)]).stable is None
    assert solve(robot, 0.5, loads=[DistributedLoad(**force, frame="body")]).stable is None
    assert solve(robot, 0.5, loads=[DistributedLoad(**moment)]).stable is None
    assert solve(robot, 0.5, loads=[PointLoad(**force), DistributedLoad(**force)]).stable is True


@pytest.mark.parametrize("tau", [0.0, 0.8])
def test_order_of_convergence(tau):
    robot = prototype(1)
    load = [PointLoad(force=(4e-3, 2e-3, 0.0), frame="body"), DistributedLoad(force=(0.05, 0.0, 0.0), frame="body")]
    tips = [solve(robot, tau, loads=load, gravity=GRAVITY, steps=n, accuracy=1e-11).tip for n in (16, 32, 64, 128)]
    errors = np.array([farthest(a, b) for a, b in itertools.pairwise(tips)])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(4.0, abs=0.3)


def test_a_growing_follower_curls_the_rod():
    """Far beyond what one Newton step takes: the rod is led there."""
    robot = rod(length=0.2)
    EI = robot.section.Kbt[0]
    for load in (30.0, 60.0):
        plane = follow.transverse_follower(load)
        shape = solve(robot, (), loads=[PointLoad(force=(load * EI / 0.04, 0.0, 0.0), frame="body")], accuracy=1e-8)
        assert farthest(shape.tip, 0.2 * np.array([plane.y, 0.0, plane.x])) < 5e-5  # extension and shear


@pytest.mark.parametrize(
    ("field", "make"),
    [
        ("frame", lambda: PointLoad(frame="tool")),
        ("frame", lambda: DistributedLoad(frame=None)),
        ("force", lambda: PointLoad(force=(1.0, 0.0), frame="body")),
        ("moment", lambda: PointLoad(moment=(1.0, 0.0, float("nan")))),
    ],
)
def test_bad_followers_are_named(field, make):
    with pytest.raises(InvalidInput, match=f"^{field} = "):
        make()
