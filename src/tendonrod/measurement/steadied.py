"""`steadied`: readings of a tension without the turns that are only noise.

Where tendons rub, every turn of the tension counts: taken at its word, noise between two samples would be a tendon that
slips to and fro, and the hysteresis of the model would shrink. Between turns that stand out of the noise the readings
are therefore replaced by the monotone sequence that fits them best.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

STANDS_OUT = 6.0  # standard deviations of a reading, by which a turn must be undone to count as one
FEWEST = 8  # readings from which their noise can be told


def steadied(readings: np.ndarray, noise: float | None = None) -> np.ndarray:
    """(n,) readings, N, steadied; NaN stays. noise: their standard deviation, None to take it from their own jitter."""
    from scipy.optimize import isotonic_regression

    found, known = readings.copy(), np.flatnonzero(np.isfinite(readings))
    y = readings[known]
    noise = _jitter(y) if noise is None else noise
    if noise <= 0.0 or y.size < 3:
        return found
    turns = _turns(y, STANDS_OUT * noise)
    for first, last in pairwise(turns):
        part = slice(first, last + 1)
        smooth = isotonic_regression(y[part], increasing=bool(y[last] >= y[first])).x
        found[known[part]] = smooth
    return found


def _jitter(y: np.ndarray) -> float:
    """Standard deviation of the noise by second differences, of which steady motion has none."""
    if y.size < FEWEST:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(y, 2))) / 6.0**0.5)


def _turns(y: np.ndarray, band: float) -> list[int]:
    """First, last, and every extreme between that is followed by a change of more than ``band`` the other way."""
    found, extreme, way = [0], 0, 0
    for i, value in enumerate(y.tolist()):
        if way == 0:
            way = 0 if abs(value - y[0]) <= band else 1 if value > y[0] else -1
            extreme = i if way else 0
        elif way * (value - y[extreme]) > 0.0:
            extreme = i
        elif way * (y[extreme] - value) > band:
            found.append(extreme)
            way, extreme = -way, i
    return sorted({*found, y.size - 1})
