"""Which pairs of causes keep all bounds of Table I: on a grid, the least pair, and the pair that keeps them best.

Margins are smooth in tilt and mass, their least is not; so both searches are smooth problems with eight constraints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .causes import LARGEST_TILT, Gaps
from .gravity import TILT, TIP_MASS
from .results import Region

_TILTS = np.linspace(-LARGEST_TILT, LARGEST_TILT, 121)
_MASSES = 51

Pair = tuple[float, float]


def region(gaps: Gaps, limits: np.ndarray) -> Region:
    """Margins over tilts and the second quantity, what keeps the bounds best, and the least pair that keeps them."""
    values = _TILTS if gaps.second == "sideways" else np.linspace(0.0, gaps.end, _MASSES)
    gap = gaps(_TILTS, values)
    margins = gap.margins(limits)
    search = _Search(gaps, values, limits)
    least = search.least(margins.min(axis=-1))
    return Region(
        tilts=_TILTS,
        values=values,
        margins=margins,
        margins_at_any_tensions=gap.margins_at_any_tensions(limits),
        closest=1e-3 * search.closest(margins.min(axis=-1)),
        least=None if least is None else search.pair(least),
        edge=None if least is None else int(search.margins(least).argmin()),
    )


class _Search:
    """In x = (tilt / 1 degree, mass / 0.5 g) and mm; a second tilt counts as the first."""

    def __init__(self, gaps: Gaps, values: np.ndarray, limits: np.ndarray) -> None:
        self.gaps, self.limits = gaps, limits
        self.units = TILT, TILT if gaps.second == "sideways" else TIP_MASS
        self.axes = _TILTS / self.units[0], values / self.units[1]
        self.ends = [(x[0], x[-1]) for x in self.axes]

    def pair(self, x: np.ndarray) -> Pair:
        return float(x[0] * self.units[0]), float(x[1] * self.units[1])

    def margins(self, x: np.ndarray) -> np.ndarray:
        """(8,) mm."""
        tilt, value = self.pair(x)
        return 1e3 * self.gaps(np.array([tilt]), np.array([value])).margins(self.limits).ravel()

    def closest(self, kept: np.ndarray) -> float:
        """The largest least margin, mm: the largest t that no margin is below."""
        found = [
            self._minimum(lambda x: -x[2], lambda x: self.margins(x[:2]) - x[2], [*start, self.margins(start).min()])
            for start in self._starts(-kept)
        ]
        return max(float(x[2]) for x in found)

    def least(self, kept: np.ndarray) -> np.ndarray | None:
        """The x of least length where no margin is negative, None where there is none on the grid."""
        length = self.axes[0][:, None] ** 2 + self.axes[1] ** 2
        found = [
            self._minimum(lambda x: x @ x, self.margins, start)
            for start in self._starts(np.where(kept >= 0.0, length, np.inf))
        ]
        return min(found, key=lambda x: x @ x, default=None)

    def _starts(self, cost: np.ndarray) -> list[np.ndarray]:
        """The cheapest nodes at tilts to either side."""
        half, starts = len(_TILTS) // 2, []
        for first, part in ((0, cost[: half + 1]), (half, cost[half:])):
            i, k = np.unravel_index(part.argmin(), part.shape)
            if np.isfinite(part[i, k]):
                starts.append(np.array([self.axes[0][first + i], self.axes[1][k]]))
        return starts

    def _minimum(self, cost: Callable, kept: Callable, start: Any) -> np.ndarray:
        """From ``start``, which is kept where the search does not end in something that keeps the bounds."""
        from scipy.optimize import minimize

        ends = [*self.ends, (None, None)][: len(start)]
        found = minimize(cost, start, bounds=ends, constraints={"type": "ineq", "fun": kept}, options={"ftol": 1e-9})
        good = found.success and kept(found.x).min() > -1e-4 and found.fun <= cost(np.asarray(start))
        return found.x if good else np.asarray(start)
