"""`Spread`: smooth values at many samples from few of them, chosen where least is known.

Kernel interpolation in Newton's form (Müller, Schaback 2009) at samples that the P-greedy rule picks (De Marchi,
Schaback, Wendland 2005): the next one is that with the largest power function P, the worst case of the error there.
Each is told before it is asked for, so that its residual is an error that nobody has fitted; as P is nowhere larger
than at the chosen sample, no other value changes by more than that residual. It ends when `AGREE` in a row were right.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

AGREE, ENOUGH = 10, 3  # values in a row told to the tolerance before they are asked for; where none is left to ask for
MOST = 200  # values asked for
WIDTHS = (0.5, 0.25, 0.12)  # of the Gaussian kernel, in units of the features: the next where one cannot tell more
LEAST = 1e-13  # square of P at which rounding takes over: no sample is left that is not known

Value = Callable[[int, int], np.ndarray]


class Spread:
    """Samples at ``features`` (q, f), in which values are smooth over a length of one, in the order of asking."""

    def __init__(self, features: np.ndarray) -> None:
        self.features = features
        self._begin(0)

    def _begin(self, narrowed: int) -> None:
        self.narrowed, q = narrowed, len(self.features)
        self.basis = np.empty((0, q))  # Newton's, at all samples
        self.rest = np.ones(q)  # P squared
        self.chosen: list[int] = []

    def interpolated(self, value: Value, tolerance: np.ndarray) -> np.ndarray | None:
        """(q, …) values of all samples; None where they are not smooth enough for `MOST` of them to tell the others.

        value(n, k): (places, c) of sample k, the n-th that is asked for. tolerance (t,): of the first t of the c.
        """
        known: dict[int, np.ndarray] = {}

        def asked(n: int, k: int) -> np.ndarray:
            if k not in known:
                known[k] = value(n, k)
            return known[k]

        while (found := self._attempt(asked, tolerance)) is None:
            if len(self.chosen) == MOST or self.narrowed + 1 == len(WIDTHS):
                return None
            self._begin(self.narrowed + 1)
        return found

    def _attempt(self, value: Value, tolerance: np.ndarray) -> np.ndarray | None:
        factors: list[np.ndarray] = []
        agreed, t = 0, len(tolerance)
        while agreed < AGREE:
            n = len(factors)
            if n == len(self.chosen) and not self._choose():
                if agreed < ENOUGH:
                    return None
                break
            k = self.chosen[n]
            found = value(n, k)
            residual = found - np.tensordot(self.basis[:n, k], factors, 1) if n else found
            agreed = agreed + 1 if (np.abs(residual[..., :t]) < tolerance).all() else 0
            factors.append(residual / self.basis[n, k])
        return np.tensordot(self.basis[: len(factors)].T, factors, 1)

    def _choose(self) -> bool:
        """Take one more sample; False where none is left."""
        k, n = int(np.argmax(self.rest)), len(self.chosen)
        if n == MOST or self.rest[k] < LEAST:
            return False
        if n == len(self.basis):
            self.basis = np.concatenate([self.basis, np.empty((max(24, n // 2), len(self.rest)))])
        apart = ((self.features - self.features[k]) ** 2).sum(axis=1)
        kernel = np.exp(-0.5 * apart / WIDTHS[self.narrowed] ** 2)
        self.basis[n] = (kernel - self.basis[:n, k] @ self.basis[:n]) / np.sqrt(self.rest[k])
        self.rest = np.maximum(0.0, self.rest - self.basis[n] ** 2)
        self.rest[k] = 0.0
        self.chosen.append(k)
        return True
