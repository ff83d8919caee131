"""`Linear`: a rod linearised where it stands, with its tendons, and its second variation (docs/method)."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np

from .problem import problem_of
from .trial import Trial

if TYPE_CHECKING:
    from .newton import NewtonSolution
    from .solution import Solution


class Linear:
    """A balanced or nearly balanced trial, factored; tendons pulled by length answer too."""

    def __init__(self, trial: Trial) -> None:
        self.trial, strands = trial, trial.strands
        self.negative = trial.factor()
        self.missing, self.active, self.answers = np.empty(0), np.empty(0, dtype=int), []
        if strands is None:
            return
        strands.along(trial, trial.x)
        missing = strands.missing(trial)
        self.active = np.array([i for i in strands.driven if trial.tensions[i] > 0.0 or missing[i] > 0.0], dtype=int)
        self.missing = missing
        self.answers = [self._rod(trial.share[:, i, None] * strands.pull[:, i]) for i in self.active]
        by = [[-self._length(i, strain) for strain, _ in self.answers] for i in self.active]
        self.slope = np.reshape(by, (len(by), len(by))) + np.diag(strands.stretch(trial)[self.active])
        self.negative -= int((np.linalg.eigvals(self.slope).real < 0.0).sum()) if len(by) else 0

    def solve(self, left: np.ndarray, missing: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(strains (2n, 6), tensions (T,), motion of the tip (3,)) that remove an imbalance and missing lengths."""
        (strain, tip), tau = self._rod(left), np.zeros(self.trial.n_tendons)
        if len(self.active):
            want = np.broadcast_to(missing, tau.shape)[self.active]
            tau[self.active] = np.linalg.solve(self.slope, want + [self._length(i, strain) for i in self.active])
            strain = strain + sum(tau[i] * each for i, (each, _) in zip(self.active, self.answers, strict=True))
            tip = tip + sum(tau[i] * each for i, (_, each) in zip(self.active, self.answers, strict=True))
        return strain, tau, tip

    def softest(self) -> float:
        """The smallest share mu, in size, such that the rod would be singular were all sections softer by it.

        J phi = mu H phi with the Hessian H of the sections alone, by inverse iteration: 1 without load, 1 - P / P_c for
        a column, 0 at a fold or bifurcation, negative beyond.
        """
        trial, w = self.trial, self.trial.weights[:, None]
        phi, found = np.random.default_rng(1).normal(size=trial.x.shape), inf
        phi /= np.sqrt(trial.station[:, :6])
        for _ in range(40):
            push = np.einsum("jab,jb->ja", trial.hessian, phi)
            answer = -self.solve(push)[0]
            work = float((w * push * answer).sum())
            before, found = found, float((w * push * phi).sum()) / work if work else 0.0
            if abs(found - before) <= 1e-3 * abs(found):
                break
            phi = answer / np.abs(answer[:, 3:]).max()
        return found

    def _rod(self, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        strain, twist = self.trial.respond(left)
        return strain.copy(), twist[-1, :3] + np.cross(twist[-1, 3:], self.trial.end[-1, :3])

    def _length(self, i: int, strain: np.ndarray) -> float:
        trial = self.trial
        return float((trial.weights[:, None] * trial.strands.pull[:, i] * strain).sum())  # pyright: ignore


def linearised(solution: Solution | NewtonSolution) -> Linear:
    """A solution linearised; the tendons that are pulled by length answer."""
    trial = Trial(problem_of(solution), solution.grid.copy())
    trial.take(solution)
    trial.walk()
    return Linear(trial)
