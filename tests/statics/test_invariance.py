"""What must not change the answer, or must change it in a known way."""

import numpy as np
import pytest

from tendonrod import Tendon, solve
from textbook import GRAVITY, about_z, farthest, helix_rod, prototype, rod

LOADS = {
    "gravity": np.array([3.0, -8.0, 4.0]),
    "tip_force": np.array([1e-3, -2e-3, 1e-3]),
    "tip_moment": np.array([2e-5, -1e-5, 3e-5]),
    "distributed_force": np.array([0.01, 0.0, -0.02]),
    "distributed_moment": np.array([1e-4, 2e-4, -1e-4]),
}
FINE = {"accuracy": 1e-10}
ROBOTS = {"exonav-1": (prototype(1), 0.7), "exonav-4 open": (prototype(4, "open_section"), 1.5),
          "helical": (helix_rod(), (6.0, 3.0, 8.0))}  # fmt: skip
each_robot = pytest.mark.parametrize(("robot", "tension"), ROBOTS.values(), ids=ROBOTS.keys())


def turned(loads: dict, Q: np.ndarray, axial_sign: float = 1.0) -> dict:
    return {name: (axial_sign if "moment" in name else 1.0) * Q @ value for name, value in loads.items()}


def samples(robot, insertion: float = 1.0) -> np.ndarray:
    return np.linspace(0.0, insertion * robot.section.L_na, 13)


@each_robot
@pytest.mark.parametrize("angle", [0.3, -2.1, np.pi])
def test_turning_robot_and_loads_turns_the_shape(robot, tension, angle):
    Q, s = about_z(angle), samples(robot, 0.8)
    here = solve(robot, tension, **LOADS, insertion=0.8, rotation=0.2, s=s, **FINE)
    there = solve(robot, tension, **turned(LOADS, Q), insertion=0.8, rotation=0.2 + angle, s=s, **FINE)
    assert farthest(there.position, here.position @ Q.T) < 1e-10
    assert farthest(there.centerline, here.centerline @ Q.T) < 1e-10
    np.testing.assert_allclose(there.rotation, Q @ here.rotation, rtol=0, atol=1e-8)
    np.testing.assert_allclose(there.u, here.u, rtol=0, atol=1e-6)
    np.testing.assert_allclose(there.force, here.force @ Q.T, rtol=0, atol=1e-12)
    np.testing.assert_allclose(there.moment, here.moment @ Q.T, rtol=0, atol=1e-11)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_a_left_handed_robot_is_the_mirror_image(number):
    """Mirror in the x-z plane: positions and forces as vectors, moments as axial vectors."""
    right = prototype(number)
    left, S, s = right.replace(turns=-right.turns), np.diag([1.0, -1.0, 1.0]), samples(right)
    shape = solve(right, 0.6, **LOADS, s=s, rotation=0.4, **FINE)
    image = solve(left, 0.6, **turned(LOADS, S, -1.0), s=s, rotation=-0.4, **FINE)
    assert farthest(image.position, shape.position @ S) < 1e-10
    np.testing.assert_allclose(image.rotation, S @ shape.rotation @ S, rtol=0, atol=1e-8)
    np.testing.assert_allclose(image.moment, -shape.moment @ S, rtol=0, atol=1e-11)


def test_mirrored_tendons_mirror_a_plain_rod():
    S = np.diag([1.0, -1.0, 1.0])
    right = rod(Tendon.helical(offset=2e-3, angle=0.7, turns=0.8), Tendon.constant(x=1e-3, y=1.2e-3, end=0.1))
    left = rod(Tendon.helical(offset=2e-3, angle=-0.7, turns=-0.8), Tendon.constant(x=1e-3, y=-1.2e-3, end=0.1))
    shape = solve(right, (4.0, 7.0), gravity=(1.0, 2.0, -9.0), s=samples(right), **FINE)
    image = solve(left, (4.0, 7.0), gravity=(1.0, -2.0, -9.0), s=samples(right), **FINE)
    assert farthest(image.position, shape.position @ S) < 1e-10


@pytest.mark.parametrize("factor", [0.1, 3.0])
def test_scaling_all_stiffness_and_load_keeps_the_shape(factor):
    soft = prototype(1)
    names = ("youngs_modulus", "shear_modulus", "density")
    stiff = soft.replace(**{name: factor * soft.parameters()[name] for name in names})
    s = samples(soft)
    a = solve(soft, 0.7, gravity=GRAVITY, s=s, **FINE)
    b = solve(stiff, 0.7 * factor, gravity=GRAVITY, s=s, **FINE)
    assert farthest(a.position, b.position) < 1e-10
    np.testing.assert_allclose(b.force, factor * a.force, rtol=0, atol=1e-12)


@pytest.mark.parametrize("factor", [0.2, 4.0])
def test_a_larger_copy_has_a_similar_shape(factor):
    """All lengths times c: forces by c^2, moments by c^3, gravity by 1/c."""
    small = prototype(2)
    names = ("inner_radius", "outer_radius", "length", "notch_width", "notch_spacing", "tendon_radius")
    large = small.replace(**{name: factor * small.parameters()[name] for name in names})
    force, moment = np.array([1e-3, 2e-3, 0.0]), np.array([0.0, 1e-5, 2e-5])
    a = solve(small, 0.5, gravity=GRAVITY, tip_force=force, tip_moment=moment, s=samples(small), **FINE)
    b = solve(
        large, 0.5 * factor**2, gravity=GRAVITY / factor, tip_force=force * factor**2, tip_moment=moment * factor**3,
        s=factor * samples(small).clip(0.0, large.section.L_na / factor), **FINE,
    )  # fmt: skip
    assert farthest(b.position, factor * a.position) < 2e-10 * max(1.0, factor)


def test_two_tendons_in_one_place_pull_as_one():
    place = {"x": 1.5e-3, "y": 0.4e-3}
    one = rod(Tendon.constant(**place))
    two = rod(Tendon.constant(**place), Tendon.constant(**place))
    a = solve(one, 5.0, **LOADS, s=samples(one), **FINE)
    b = solve(two, (1.5, 3.5), **LOADS, s=samples(one), **FINE)
    assert farthest(a.position, b.position) < 1e-10


def test_a_slack_tendon_does_nothing():
    robot, bare = rod(Tendon.constant(x=1.5e-3, y=0.4e-3)), rod()
    loads = {"gravity": (5.0, 0.0, -8.0), "tip_force": (0.02, 0.03, 0.0)}
    a, b = (solve(each, t, **loads, s=samples(bare), **FINE) for each, t in ((robot, 0.0), (bare, ())))
    assert farthest(a.position, b.position) < 1e-10


def test_one_number_pulls_every_tendon():
    robot = helix_rod()
    a, b = (solve(robot, t, gravity=GRAVITY, s=samples(robot)) for t in (4.0, (4.0, 4.0, 4.0)))
    assert np.array_equal(a.position, b.position)


def test_gravity_is_a_line_load():
    robot = prototype(1)
    weight = robot.section.line_density * GRAVITY
    a = solve(robot, 0.7, gravity=GRAVITY, s=samples(robot), **FINE)
    b = solve(robot, 0.7, distributed_force=weight, s=samples(robot), **FINE)
    assert farthest(a.position, b.position) < 1e-12


def test_material_coordinate_of_a_helical_tendon_moves_with_insertion():
    """Half of the body out: the routing starts at phase angle + omega L/2."""
    L, turns = 0.2, 0.9
    whole = rod(Tendon.helical(offset=2e-3, angle=0.3, turns=turns), length=L)
    half = rod(Tendon.helical(offset=2e-3, angle=0.3 + np.pi * turns, turns=0.5 * turns), length=0.5 * L)
    s = np.linspace(0.0, 0.5 * L, 9)
    a = solve(whole, 6.0, gravity=GRAVITY, insertion=0.5, s=s, **FINE)
    b = solve(half, 6.0, gravity=GRAVITY, s=s, **FINE)
    assert farthest(a.position, b.position) < 1e-10
