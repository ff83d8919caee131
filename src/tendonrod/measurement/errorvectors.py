"""`Errors`: measured minus model of samples, and what is said of them: the paper's MED and RMSE, bias, scatter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

VARIES = 0.05  # of the insertion, above which errors are told by insertion too
OUT = 1e-3  # of the insertion that may lack where all of the robot counts as out
QUARTERS = ("0 to 25 %", "25 to 50 %", "50 to 75 %", "75 to 100 %", "all of it")


@dataclass(frozen=True, kw_only=True, eq=False)
class Errors:
    """Measured minus model of n samples, in the world; SI.

    model: (n, 3) m, the points that the model has. vectors: (n, 3) m. turns: (n, 3) rad, rotation vectors of measured
    against model orientations, NaN where not known. insertion: (n,), exposed share of the robot. length: m, L_na of
    the whole robot.
    """

    model: np.ndarray
    vectors: np.ndarray
    turns: np.ndarray
    insertion: np.ndarray
    length: float

    @property
    def distances(self) -> np.ndarray:
        """(n,) Euclidean, m."""
        return np.linalg.norm(self.vectors, axis=1)

    @property
    def med(self) -> float:
        """Maximum Euclidean distance, m: what the paper calls MED."""
        return float(self.distances.max())

    @property
    def rmse(self) -> float:
        """Root mean square distance, m; rmse^2 = |bias|^2 + scatter^2."""
        return _root_mean_square(self.distances)

    @property
    def mae(self) -> float:
        """Mean distance, m."""
        return float(self.distances.mean())

    @property
    def share(self) -> float:
        """rmse over the robot's length L_na. Of what is exposed, noise alone would be much where that is little."""
        return self.rmse / self.length

    def part(self, which: np.ndarray) -> Errors:
        """Those of some of the samples."""
        arrays = {name: getattr(self, name)[which] for name in ("model", "vectors", "turns", "insertion")}
        return replace(self, **arrays)

    @property
    def bias(self) -> np.ndarray:
        """(3,) mean of the vectors, m: what all samples have in common."""
        return self.vectors.mean(axis=0)

    @property
    def scatter(self) -> float:
        """Root mean square distance from the mean vector, m."""
        return _root_mean_square(np.linalg.norm(self.vectors - self.bias, axis=1))

    @property
    def angle_rms(self) -> float:
        """Root mean square angle between measured and model orientation, rad; NaN where none is known."""
        known = np.isfinite(self.turns).all(axis=1)
        return _root_mean_square(np.linalg.norm(self.turns[known], axis=1)) if known.any() else float("nan")

    def by_insertion(self) -> list[tuple[str, Errors]]:
        """Errors with each quarter of the robot out, and with all of it; none where the insertion hardly varies."""
        if np.ptp(self.insertion) < VARIES:
            return []
        full = self.insertion >= 1.0 - OUT
        quarter = np.where(full, 4, np.minimum(3, np.floor(4.0 * self.insertion))).astype(int)
        return [(name, self.part(quarter == k)) for k, name in enumerate(QUARTERS) if (quarter == k).any()]


def _root_mean_square(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))
