"""Without external load the strains are constant along s and the shape is exp of a constant twist, exactly."""

import numpy as np
import pytest
from scipy.linalg import expm

import rucker_webster
from tendonrod import Tendon, solve
from textbook import about_z, farthest, prototype, rod

MODELS = [(number, torsion, tension) for number in (1, 2, 3, 4) for torsion in ("published", "open_section")
          for tension in (0.1, 0.7, 1.5)]  # fmt: skip
each_model = pytest.mark.parametrize(("number", "torsion", "tension"), MODELS)


def constant_strains(robot, tension) -> tuple[np.ndarray, np.ndarray]:
    """v, u by an independent root of the local equations with total force and moment zero."""
    problem = rucker_webster.from_robot(robot, tension)
    w, e = np.split(rucker_webster.strains(problem, 0.0, np.zeros((1, 6)), problem.active(0.0))[0], 2)
    return problem.v_star + w, problem.u_star + e


def helix(robot, tension, s, R0, p0) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotations by SciPy's matrix exponential of the twist."""
    v, u = constant_strains(robot, tension)
    twist = np.zeros((4, 4))
    twist[:3, :3], twist[:3, 3] = rucker_webster.hat(u), v
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = R0, p0
    poses = np.stack([base @ expm(twist * each) for each in s])
    return poses[:, :3, 3], poses[:, :3, :3]


@each_model
def test_shape_is_an_exact_helix(number, torsion, tension):
    robot = prototype(number, torsion)
    L = robot.section.L_na
    s = np.linspace(0.0, L, 17)
    shape = solve(robot, tension, s=s)
    position, rotation = helix(robot, tension, s, np.eye(3), [-robot.section.r_na, 0.0, 0.0])
    assert farthest(shape.position, position) < 1e-12 * L
    assert np.abs(shape.rotation - rotation).max() < 1e-12


@each_model
def test_strains_and_wrench_are_constant(number, torsion, tension):
    robot = prototype(number, torsion)
    shape = solve(robot, tension, s=np.linspace(0.0, robot.section.L_na, 9))
    v, u = constant_strains(robot, tension)
    np.testing.assert_allclose(shape.v, np.broadcast_to(v, (9, 3)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(shape.u, np.broadcast_to(u, (9, 3)), rtol=0, atol=1e-12 * np.abs(u).max())
    unit = rucker_webster.from_robot(robot, tension).wrench_unit
    assert np.abs(shape.force).max() < 1e-9 * unit[0]
    assert np.abs(shape.moment).max() < 1e-9 * unit[3]


@pytest.mark.parametrize("insertion", [0.05, 0.37, 0.9])
def test_constant_tension_follows_the_leader(insertion):
    """The exposed body lies on the full shape, whatever is inserted: rotation 0 is the follow-the-leader law."""
    robot = prototype(1)
    L = robot.section.L_na
    s = np.linspace(0.0, insertion * L, 9)
    full, part = solve(robot, 0.7, s=s), solve(robot, 0.7, insertion=insertion, s=s)
    assert farthest(full.position, part.position) < 1e-12 * L
    assert part.s[-1] == s[-1]


@pytest.mark.parametrize("turns", [-2.0, -1.0, 0.0, 0.5, 1.0])
def test_without_tension_the_tube_is_straight(turns):
    robot = prototype(2).replace(turns=turns)
    section = robot.section
    shape = solve(robot, 0.0, s=np.linspace(0.0, section.L_na, 11), rotation=0.4)
    axis = np.stack([0 * shape.s, 0 * shape.s, shape.s * section.L / section.L_na], axis=-1)
    assert farthest(shape.centerline, axis) < 1e-12 * section.L


def test_rotation_turns_the_base_about_world_z():
    robot, angle = prototype(3), 0.8
    section = robot.section
    s = np.linspace(0.0, section.L_na, 9)
    position, rotation = helix(robot, 0.7, s, about_z(angle), about_z(angle) @ [-section.r_na, 0.0, 0.0])
    shape = solve(robot, 0.7, rotation=angle, s=s)
    assert farthest(shape.position, position) < 1e-12 * section.L_na
    assert np.abs(shape.rotation - rotation).max() < 1e-12


def test_tendon_ending_half_way_bends_one_half():
    """An arc to the tendon's end, the tangent beyond: N = M = 0 leaves the free half unstrained."""
    end, L = 0.08, 0.2
    robot = rod(Tendon.constant(x=1.5e-3, y=0.0, end=end), length=L)
    s = np.array([0.0, 0.5 * end, end, 0.5 * (end + L), L])
    shape = solve(robot, 3.0, s=s, accuracy=1e-10)
    v, u = constant_strains(robot, 3.0)
    position, rotation = helix(robot, 3.0, s[:3], np.eye(3), np.zeros(3))
    tangent = rotation[-1][:, 2]
    beyond = position[-1] + (s[3:, None] - end) * tangent
    assert farthest(shape.position, np.vstack([position, beyond])) < 1e-12
    np.testing.assert_allclose(shape.u[[3, 4]], 0.0, atol=1e-10)
    np.testing.assert_allclose(shape.u[1], u, atol=1e-12 * np.abs(u).max())
    np.testing.assert_allclose(shape.v[1], v, rtol=0, atol=1e-13)


def test_tendon_that_ends_inside_the_outer_tube_does_nothing():
    robot = rod(Tendon.constant(x=1.5e-3, y=0.0, end=0.08), length=0.2)
    shape = solve(robot, 3.0, insertion=0.5)  # the exposed material begins at s_m = 0.1
    np.testing.assert_allclose(shape.tip, [0.0, 0.0, 0.1], rtol=0, atol=1e-13)
