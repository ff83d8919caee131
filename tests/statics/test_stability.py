"""Second variation: Euler's load, the branch that a loaded rod takes past it, and what a shape says about itself."""

import numpy as np
import pytest

from tendonrod import PlainRod, Robot, solve
from tendonrod.statics.limits import euler_loads
from textbook import GRAVITY, prototype, rod

COLUMN = rod(length=0.3)
EULER = euler_loads(COLUMN)[0]


def pushed(factor: float, sideways: float = 0.0, **more):
    return solve(COLUMN, tip_force=(sideways * factor * EULER, 0.0, -factor * EULER), **more)


@pytest.mark.parametrize("steps", [12, 40])
def test_a_straight_column_loses_stability_at_eulers_load(steps):
    """Clamped and free, within 0.1 %: the rod is stiff in extension and shear, so that Euler's formula holds."""
    assert pushed(0.999, steps=steps).stable
    assert not pushed(1.001, steps=steps).stable
    assert np.allclose(pushed(1.001).tip[:2], 0.0, atol=1e-12)


def test_a_weaker_plane_decides():
    area = {"area": 7.9e-7, "ix": 2e-14, "iy": 5e-14, "j": 7e-14}
    body = PlainRod(length=0.3, youngs_modulus=75e9, shear_modulus=25e9, density=6255.0, **area)
    flat = Robot(name="flat", body=body)
    weak, _ = euler_loads(flat)
    assert solve(flat, tip_force=(0.0, 0.0, -0.999 * weak)).stable
    assert not solve(flat, tip_force=(0.0, 0.0, -1.001 * weak)).stable


@pytest.mark.parametrize(("factor", "x"), [(1.1, 0.1534), (1.5, 0.2366)])
def test_past_eulers_load_an_imperfect_column_takes_the_stable_branch(factor, x):
    """One part in a thousand sideways decides the side; the deflection is near the elastica's own."""
    shape = pushed(factor, 1e-3)
    assert shape.stable
    assert shape.tip[0] == pytest.approx(x, rel=1e-3)
    mirrored = pushed(factor, -1e-3)
    assert mirrored.stable
    assert mirrored.tip[0] == pytest.approx(-shape.tip[0], rel=1e-6)


def test_the_elastica_past_buckling():
    """Exact post-buckling (Timoshenko): a tip angle of 40 degrees, by complete elliptic integrals."""
    from scipy.special import ellipe, ellipk

    m = np.sin(np.deg2rad(20.0)) ** 2
    factor = (2.0 * ellipk(m) / np.pi) ** 2
    shape = pushed(factor, 1e-4, accuracy=1e-8)
    span = 2.0 * np.sqrt(m) / ellipk(m) * COLUMN.section.L_na
    assert shape.stable
    assert shape.tip[0] == pytest.approx(span, rel=2e-3)
    assert shape.tip[2] / COLUMN.section.L_na == pytest.approx(2.0 * ellipe(m) / ellipk(m) - 1.0, rel=2e-3)


def test_the_robot_under_its_own_weight_is_stable_and_a_buckled_one_says_so():
    assert solve(prototype(1), 0.7, GRAVITY).stable
    assert solve(prototype(1), 0.7).stable
    assert solve(prototype(1), 0.7, insertion=0.0).stable
    assert not any("unstable" in sentence for sentence in solve(prototype(1), 0.7, GRAVITY).warnings)
    assert any("unstable" in sentence for sentence in pushed(1.5).warnings)


def test_what_did_not_converge_is_not_called_stable():
    shape = solve(prototype(1), 0.7, tip_force=(1e5, 0.0, -1e6), throw=False)
    assert not shape.converged
    assert shape.stable is None


@pytest.mark.parametrize("seed", [*range(12), 35, 43])  # the last two are beyond single shooting
def test_the_full_load_or_nothing(seed):
    """Pushed past critical loads in any direction, a shape carries the whole load, or is none and says so."""
    rng = np.random.default_rng(seed)
    robot = prototype(1 + seed % 4, "open_section")
    push = rng.normal(size=3)
    push *= rng.uniform(0.5, 6.0) * euler_loads(robot)[0] / np.linalg.norm(push)
    shape = solve(robot, float(rng.uniform(0.0, 1.0)), GRAVITY, tip_force=push, throw=False)
    if shape.converged:
        weight = robot.section.line_density * GRAVITY * robot.length_na
        np.testing.assert_allclose(shape.force[0], push + weight, rtol=1e-12, atol=1e-15)
        np.testing.assert_array_equal(shape.force[-1], push)
        assert np.abs(shape.moment[-1]).max() < 1e-4 * np.abs(shape.moment[0]).max()
        assert shape.load_factor == 1.0
        assert 0.0 < shape.error_estimate <= 1e-6
    else:
        assert np.isnan(shape.position).all()
        assert 0.0 < shape.load_factor < 1.0


@pytest.mark.parametrize("factor", [1.5, 4.0, 5.0, 6.0, 8.9, 9.1, 16.5, 20.0])
def test_no_straight_column_is_stable_past_eulers_load(factor):
    """A round rod's conjugate points come in pairs, which the sign of a determinant would miss."""
    assert pushed(factor).stable is False


def test_far_past_eulers_load_the_stable_branch_is_found():
    shape = pushed(6.0, 1e-3)
    assert shape.stable
    assert shape.tip[0] == pytest.approx(0.3 * 0.518, rel=2e-3)


@pytest.mark.parametrize("curvature", [1.0, 5.0, 20.0])
def test_moments_fixed_in_the_world_have_no_potential(curvature):
    shape = solve(COLUMN, tip_moment=(0.0, curvature * COLUMN.section.Kbt[1], 0.0))
    assert shape.stable is None
    assert not any("unstable" in sentence for sentence in shape.warnings)
