"""Means of points and of rotations in which outliers, up to half of all, have no part."""

from __future__ import annotations

import numpy as np

from ..rotation import log_so3

MEDIAN_OF_CHI_3 = 1.5382  # of the length of a vector whose three coordinates are standard normal
FARTHEST = 4.5  # standard deviations of a coordinate; one sound sample in 6000 lies beyond
ROUNDS = 50
ROUNDING = 1e-12  # of the largest coordinate; samples that agree to rounding are all kept
CANDIDATES = 200


def mean_rotation(given: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean without outliers, (m,) which took part or had none to give, (m, 3) rotation vectors from each to the mean.

    It starts at the given rotation that is nearest to all others in the sum, as a median is.
    """
    known = np.asarray(np.isfinite(given).all(axis=(1, 2)))
    sound, turns = np.logical_not(known), np.full((len(given), 3), np.nan)
    if not known.any():
        return np.eye(3), sound, turns
    each = given[known]
    some = each[np.unique(np.linspace(0, len(each) - 1, min(len(each), CANDIDATES)).astype(int))]
    apart = np.linalg.norm(some[:, None] - some[None], axis=(2, 3)).sum(axis=1)
    R, near = some[np.argmin(apart)], np.ones(len(each), bool)
    for _ in range(ROUNDS):
        before, near = near, _near(log_so3(R @ np.swapaxes(each, -1, -2)), 1.0)
        R = chordal_mean(each[near])
        if (near == before).all():
            break
    sound[known], turns[known] = near, log_so3(R @ np.swapaxes(each, -1, -2))
    return R, sound, turns


def chordal_mean(rotations: np.ndarray) -> np.ndarray:
    """The rotation with the least squared Frobenius distance to all (Hartley et al. 2013, 5.3)."""
    U, _, Vt = np.linalg.svd(rotations.mean(axis=0))
    return U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt


def robust_mean(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean (3,) without outliers and (m,) which took part, from the median on."""
    mean, near = np.median(points, axis=0), np.ones(len(points), bool)
    for _ in range(ROUNDS):
        before, near = near, _near(points - mean, float(np.abs(points).max()))
        mean = points[near].mean(axis=0)
        if (near == before).all():
            break
    return mean, near


def _near(errors: np.ndarray, scale: float) -> np.ndarray:
    """(m,) whether a vector (m, 3) is no outlier; the standard deviation is told from the median length."""
    length = np.linalg.norm(errors, axis=1)
    return length <= FARTHEST * np.median(length) / MEDIAN_OF_CHI_3 + ROUNDING * scale
