"""`Curve`: a smooth curve through nodes, its closest points and how far other points lie from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .errors import InvalidInput


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """Closest points of a curve: ``s`` (n,) parameter, ``point`` (n, 3), ``distance`` (n,), all m."""

    s: np.ndarray
    point: np.ndarray
    distance: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """Piecewise cubic Hermite curve through ``points`` (n, 3) at increasing parameters ``s`` (n,), with slopes dp/ds.

    Its error is h^4 |p''''| / 384: below 0.1 nm for a robot's neutral axis in 200 intervals. Units m. Raises
    `InvalidInput`.
    """

    s: np.ndarray
    points: np.ndarray
    slopes: np.ndarray

    def __post_init__(self) -> None:
        for name in ("s", "points", "slopes"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.s.ndim != 1 or self.s.size < 2 or not np.all(np.isfinite(self.s)) or not np.all(np.diff(self.s) > 0):
            raise InvalidInput("s", self.s, "two or more increasing numbers")
        for name in ("points", "slopes"):
            array = getattr(self, name)
            if array.shape != (self.s.size, 3) or not np.all(np.isfinite(array)):
                raise InvalidInput(name, array.shape, f"finite numbers of shape ({self.s.size}, 3)")

    @cached_property
    def _cubics(self) -> np.ndarray:
        """(4, n-1, 3) coefficients in t = s - s_k, constant first."""
        h = np.diff(self.s)[:, None]
        a, b = self.points[:-1], self.slopes[:-1]
        rise, end = np.diff(self.points, axis=0) / h, self.slopes[1:]
        return np.stack([a, b, (3 * rise - 2 * b - end) / h, (b + end - 2 * rise) / h**2])

    def _local(self, s):
        k = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, self.s.size - 2)
        return self._cubics[:, k], (s - self.s[k])[..., None]

    def at(self, s) -> np.ndarray:
        """(…, 3) points at parameters ``s`` (…), which is continued by the end pieces beyond the ends."""
        (a, b, c, d), t = self._local(np.asarray(s, dtype=float))
        return a + t * (b + t * (c + t * d))

    def project(self, points, guess=None) -> Projection:
        """Closest points to ``points`` (n, 3): Newton from ``guess`` (n,), else from the closest node.

        A foot beyond either end is the end. Exact to rounding for the piecewise cubic.
        """
        points = np.atleast_2d(np.asarray(points, dtype=float))
        if points.ndim != 2 or points.shape[1] != 3 or not np.all(np.isfinite(points)):
            raise InvalidInput("points", points.shape, "finite numbers of shape (n, 3)")
        if points.size == 0:
            return Projection(s=np.empty(0), point=points, distance=np.empty(0))
        if guess is None:
            offsets = points[:, None, :] - self.points[None, :, :]
            guess = self.s[np.argmin(np.einsum("nkj,nkj->nk", offsets, offsets), axis=1)]
        low, high = self.s[0], self.s[-1]
        s = np.clip(guess, low, high)
        for _ in range(50):
            (a, b, c, d), t = self._local(s)
            offset = a + t * (b + t * (c + t * d)) - points
            slope = b + t * (2 * c + 3 * t * d)
            speed = np.einsum("nj,nj->n", slope, slope)
            bend = np.einsum("nj,nj->n", offset, 2 * c + 6 * t * d)
            step = np.einsum("nj,nj->n", offset, slope) / np.where(bend > -0.5 * speed, speed + bend, speed)
            new = np.clip(s - step, low, high)
            moved, s = np.max(np.abs(new - s)), new
            if moved < 1e-14 * (high - low):
                break
        point = self.at(s)
        return Projection(s=s, point=point, distance=np.linalg.norm(points - point, axis=1))
