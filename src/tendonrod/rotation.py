"""Rotations and rigid motions: hat, exponential and logarithm of SO(3) and SE(3).

Leading axes are batch axes. Vectors of SO(3) are rotation vectors (rad); twists of SE(3) are (translation, rotation)
and ``exp_se3(twist)`` is the pose after unit time at that constant body twist, so p' = R v, R' = R u^ give
exp(s (v, u)). Series replace the closed forms near the identity, so that both are exact to rounding there (Murray, Li,
Sastry 1994, 2.3).
"""

from __future__ import annotations

import numpy as np

SMALL = 1e-2  # rad, below which series are used


def hat(a) -> np.ndarray:
    """(…, 3, 3) matrix of the cross product with ``a`` (…, 3)."""
    a = np.asarray(a, dtype=float)
    x, y, z, o = a[..., 0], a[..., 1], a[..., 2], np.zeros(a.shape[:-1])
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*a.shape[:-1], 3, 3)


def vee(A) -> np.ndarray:
    """(…, 3) vector of the skew part of ``A`` (…, 3, 3): inverse of `hat`."""
    A = np.asarray(A, dtype=float)
    lower = np.stack([A[..., 2, 1], A[..., 0, 2], A[..., 1, 0]], axis=-1)
    upper = np.stack([A[..., 1, 2], A[..., 2, 0], A[..., 0, 1]], axis=-1)
    return 0.5 * (lower - upper)


def exp_so3(a) -> np.ndarray:
    """(…, 3, 3) rotation by the vector ``a`` (…, 3): axis times angle."""
    a = np.asarray(a, dtype=float)
    A, (f1, f2, _) = hat(a), _coefficients(np.linalg.norm(a, axis=-1))
    return np.eye(3) + f1 * A + f2 * (A @ A)


def log_so3(R) -> np.ndarray:
    """(…, 3) rotation vector of ``R`` (…, 3, 3), angle in [0, pi]; through the unit quaternion, exact near 0 and near
    pi.
    """
    from scipy.spatial.transform import Rotation

    R = np.asarray(R, dtype=float)
    return Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec().reshape(*R.shape[:-2], 3)


def left_jacobian_so3(a) -> np.ndarray:
    """(…, 3, 3) J with exp(a + da) = exp(J da) exp(a) for small da; ``a`` (…, 3) rotation vectors."""
    a = np.asarray(a, dtype=float)
    A, (_, f2, f3) = hat(a), _coefficients(np.linalg.norm(a, axis=-1))
    return np.eye(3) + f2 * A + f3 * (A @ A)


def exp_se3(twist) -> np.ndarray:
    """(…, 4, 4) pose of the twist (…, 6) = (translation, rotation)."""
    twist = np.asarray(twist, dtype=float)
    a = twist[..., 3:]
    T = np.zeros((*twist.shape[:-1], 4, 4))
    T[..., :3, :3], T[..., 3, 3] = exp_so3(a), 1.0
    T[..., :3, 3] = np.einsum("...ij,...j->...i", left_jacobian_so3(a), twist[..., :3])
    return T


def log_se3(T) -> np.ndarray:
    """(…, 6) twist of the pose ``T`` (…, 4, 4): inverse of `exp_se3` for angles below pi."""
    T = np.asarray(T, dtype=float)
    a = log_so3(T[..., :3, :3])
    return np.concatenate([np.linalg.solve(left_jacobian_so3(a), T[..., :3, 3, None])[..., 0], a], axis=-1)


def _coefficients(angle):
    """sin(x)/x, (1 - cos x)/x^2, (x - sin x)/x^3, shaped to multiply matrices."""
    x2 = (angle * angle)[..., None, None]
    safe = np.where(x2 < SMALL**2, 1.0, x2)
    x = np.sqrt(safe)
    small = x2 < SMALL**2
    f1 = np.where(small, 1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42)), np.sin(x) / x)
    f2 = np.where(small, 0.5 - x2 / 24 * (1 - x2 / 30 * (1 - x2 / 56)), 2.0 * (np.sin(0.5 * x) / x) ** 2)
    f3 = np.where(small, 1 / 6 - x2 / 120 * (1 - x2 / 42 * (1 - x2 / 72)), (1.0 - np.sin(x) / x) / safe)
    return f1, f2, f3
