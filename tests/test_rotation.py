"""Rotations and rigid motions, and the compiled exponential of the integrator against them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from tendonrod.rotation import exp_se3, exp_so3, hat, left_jacobian_so3, log_se3, log_so3, vee
from tendonrod.statics import kernel

size = st.one_of(st.floats(0.0, 3.1), st.floats(0.0, 1e-7), st.sampled_from([0.0, 1e-2, 0.0099999999, 1e-8]))
unit = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: np.linalg.norm(a) > 0.1)


def vectors():
    return st.builds(lambda a, n: n * np.array(a) / np.linalg.norm(a), unit, size)


@given(vectors(), unit)
def test_hat_is_the_cross_product_and_vee_its_inverse(a, b):
    assert np.allclose(hat(a) @ np.array(b), np.cross(a, b), atol=1e-15)
    assert np.array_equal(vee(hat(a)), a)


@given(vectors())
def test_rotation_is_proper_and_is_the_matrix_exponential(a):
    R = exp_so3(a)
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert abs(np.linalg.det(R) - 1.0) < 1e-14
    assert np.allclose(R, expm(hat(a)), atol=1e-14)


@given(vectors())
def test_log_inverts_exp(a):
    assert np.allclose(log_so3(exp_so3(a)), a, atol=1e-12)


@given(vectors(), unit)
def test_left_jacobian_is_the_mean_of_the_turns_on_the_way_and_says_how_a_small_change_turns(a, b):
    nodes, weights = np.polynomial.legendre.leggauss(16)
    mean = np.einsum("k,kij->ij", 0.5 * weights, exp_so3(np.multiply.outer(0.5 * (nodes + 1.0), a)))
    assert np.allclose(left_jacobian_so3(a), mean, atol=1e-14)
    step = 1e-4 * np.array(b)
    turn = log_so3(exp_so3(a + step) @ exp_so3(a - step).T)
    assert np.allclose(left_jacobian_so3(a) @ (2.0 * step), turn, atol=1e-11)


@given(vectors(), vectors())
def test_pose_is_the_matrix_exponential_and_log_inverts_it(v, u):
    twist = np.concatenate([v, u])
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = hat(u), v
    assert np.allclose(exp_se3(twist), expm(generator), atol=1e-13)
    assert np.allclose(log_se3(exp_se3(twist)), twist, atol=1e-11)


@given(vectors(), vectors(), vectors())
def test_compiled_move_is_the_exponential_of_the_twist(v, u, turn):
    start, out = np.concatenate([[0.1, -0.2, 0.3], exp_so3(turn).ravel()]), np.empty(12)
    kernel.move(start, 0, *v, *u, out, 0)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_so3(turn), start[:3]
    moved = T @ exp_se3(np.concatenate([v, u]))
    assert np.allclose(out[:3], moved[:3, 3], atol=2e-15 * 10)
    assert np.allclose(out[3:].reshape(3, 3), moved[:3, :3], atol=2e-15 * 10)


def test_leading_axes_are_batch_axes():
    rng = np.random.default_rng(3)
    twists = rng.normal(size=(2, 5, 6))
    poses = exp_se3(twists)
    assert poses.shape == (2, 5, 4, 4)
    assert np.allclose(poses[1, 3], exp_se3(twists[1, 3]), atol=1e-15)
    assert np.allclose(left_jacobian_so3(twists[..., 3:])[1, 3], left_jacobian_so3(twists[1, 3, 3:]), atol=1e-15)
    small = 0.5 * twists
    assert np.allclose(log_se3(exp_se3(small)), small, atol=1e-12)
