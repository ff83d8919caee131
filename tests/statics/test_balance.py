"""Force and moment balance of the whole body beyond each s, by a quadrature that knows only the returned arrays."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from tendonrod import Tendon, solve
from textbook import GRAVITY, helix_rod, prototype, rod

LOADS = {
    "gravity": (prototype(1), 0.7, {"gravity": GRAVITY}),
    "tip": (prototype(2, "open_section"), 0.5, {"tip_force": (2e-3, -3e-3, 1e-3), "tip_moment": (2e-5, 1e-5, -3e-5)}),
    "everything": (
        prototype(3),
        0.9,
        {
            "gravity": (3.0, -8.0, 4.0),
            "tip_force": (0.01, 0.0, 0.02),
            "tip_moment": (1e-4, -1e-4, 2e-4),
            "distributed_force": (0.1, 0.05, -0.1),
            "distributed_moment": (1e-3, 2e-3, -1e-3),
            "insertion": 0.8,
            "rotation": 0.7,
        },
    ),
    "helical": (helix_rod(), (6.0, 3.0, 0.0), {"gravity": (0.0, -9.81, 0.0), "tip_moment": (2e-3, 0.0, 1e-3)}),
    "no tendon": (rod(), (), {"gravity": GRAVITY, "tip_force": (0.1, 0.2, -0.1)}),
}
each_load = pytest.mark.parametrize(("robot", "tension", "loads"), LOADS.values(), ids=LOADS.keys())
ZERO = np.zeros(3)


def dense(robot, tension, loads, count=801, accuracy=1e-10):
    s = np.linspace(0.0, loads.get("insertion", 1.0) * robot.section.L_na, count)
    return solve(robot, tension, **loads, s=s, accuracy=accuracy)


def line_force(robot, loads) -> np.ndarray:
    own_weight = robot.section.line_density * np.asarray(loads.get("gravity", ZERO))
    return own_weight + np.asarray(loads.get("distributed_force", ZERO))


@each_load
def test_force_balance(robot, tension, loads):
    shape = dense(robot, tension, loads)
    beyond = (shape.s[-1] - shape.s)[:, None]
    expected = np.asarray(loads.get("tip_force", ZERO)) + beyond * line_force(robot, loads)
    np.testing.assert_allclose(shape.force, expected, rtol=0, atol=1e-9 * max(1e-3, np.abs(expected).max()))


@each_load
def test_moment_balance(robot, tension, loads):
    """M(s) = M_tip + (p(L) - p(s)) x F_tip + integral over the body beyond of (p - p(s)) x f + l."""
    shape = dense(robot, tension, loads)
    p, beyond, f = shape.position, (shape.s[-1] - shape.s)[:, None], line_force(robot, loads)
    first = cumulative_simpson(p, x=shape.s, axis=0, initial=0)
    first_moment = first[-1] - first - beyond * p
    expected = (
        np.asarray(loads.get("tip_moment", ZERO))
        + np.cross(p[-1] - p, np.asarray(loads.get("tip_force", ZERO)))
        + np.cross(first_moment, f)
        + beyond * np.asarray(loads.get("distributed_moment", ZERO))
    )
    np.testing.assert_allclose(shape.moment, expected, rtol=0, atol=2e-8 * np.abs(expected).max())


@each_load
def test_rod_and_tendons_together_carry_the_wrench(robot, tension, loads):
    """Kse (v - v*) + sum tau t = R^T N and Kbt (u - u*) + sum r x tau t = R^T M at every s."""
    shape, section = dense(robot, tension, loads, count=41), robot.section
    force, moment = section.Kse * (shape.v - section.v_star), section.Kbt * (shape.u - section.u_star)
    material = shape.s + (1.0 - loads.get("insertion", 1.0)) * section.L_na
    for row, tau in zip(robot.routing, np.broadcast_to(tension, len(robot.routing)), strict=True):
        cx, cy, rho, angle, omega, _ = row
        phase, zero = angle + omega * material, 0.0 * material
        r = np.stack([cx + rho * np.cos(phase), cy + rho * np.sin(phase), zero], axis=-1)
        slope = omega * rho * np.stack([-np.sin(phase), np.cos(phase), zero], axis=-1)
        q = np.cross(shape.u, r) + slope + shape.v
        pull = tau * q / np.linalg.norm(q, axis=-1, keepdims=True)
        force, moment = force + pull, moment + np.cross(r, pull)
    local_force = np.einsum("nji,nj->ni", shape.rotation, shape.force)
    local_moment = np.einsum("nji,nj->ni", shape.rotation, shape.moment)
    unit_force = section.Kbt[:2].min() / shape.s[-1] ** 2
    assert np.abs(force - local_force).max() < 1e-8 * unit_force + 1e-12 * section.Kse.max()
    assert np.abs(moment - local_moment).max() < 1e-7 * unit_force * shape.s[-1]


@each_load
def test_strains_are_those_of_the_shape(robot, tension, loads):
    """p' = R v and R' = R u^, by splines through the returned points."""
    shape = dense(robot, tension, loads, count=401)
    inner = slice(8, -8)  # a spline's ends are poorer
    p_rate = CubicSpline(shape.s, shape.position)(shape.s, 1)
    np.testing.assert_allclose(p_rate[inner], np.einsum("nij,nj->ni", shape.rotation, shape.v)[inner], atol=1e-6)
    R_rate = CubicSpline(shape.s, shape.rotation)(shape.s, 1)
    spin = np.einsum("nji,njk->nik", shape.rotation, R_rate)
    u = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    np.testing.assert_allclose(u[inner], shape.u[inner], atol=2e-6 * max(1.0, np.abs(shape.u).max()))


@each_load
def test_frames_are_rotations(robot, tension, loads):
    R = dense(robot, tension, loads, count=41).rotation
    np.testing.assert_allclose(np.einsum("nji,njk->nik", R, R), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-12)


def test_force_and_moment_are_continuous_where_a_tendon_ends():
    end = 0.11
    robot = rod(Tendon.constant(x=1.5e-3, y=0.0, end=end))
    s = np.array([end - 1e-9, end, end + 1e-9])
    shape = solve(robot, 4.0, gravity=(0.0, 9.81, 0.0), s=s, accuracy=1e-9)
    assert np.ptp(shape.force, axis=0).max() < 1e-8
    assert np.ptp(shape.moment, axis=0).max() < 1e-10
    jump = 4.0 * 1.5e-3 / robot.section.Kbt[1]
    assert abs(shape.u[0, 1] - shape.u[2, 1] - jump) < 0.02 * jump  # the rod's share jumps by tau r
