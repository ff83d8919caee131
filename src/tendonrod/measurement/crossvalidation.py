"""`cross_validate`: the error on samples that a fit has not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import Fact, InvalidInput, TendonrodError, whole
from .fit_problem import Problem
from .identification import Fit, fitted

BLOCKS = 5
Watch = Callable[[int, int, str], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class CrossValidation:
    """f folds, each held out of one fit; SI. folds: what was held out. fold (N,): which fold each pose is in.

    distance (N,): of body points to the fit that has not seen them, m, NaN where that fit failed. values (f, m): what
    each found. notes (f,): why a fit failed, "" for none. used (N,): poses that count, those of the whole fit.
    """

    folds: tuple[str, ...]
    fold: np.ndarray
    distance: np.ndarray
    values: np.ndarray
    notes: tuple[str, ...]
    used: np.ndarray

    @property
    def rmse(self) -> float:
        """Of all held-out poses, m."""
        return self._rms(self.used)

    @property
    def rmse_by_fold(self) -> np.ndarray:
        """(f,) m."""
        return np.array([self._rms(self.used & (self.fold == k)) for k in range(len(self.folds))])

    def _rms(self, which: np.ndarray) -> float:
        known = which & np.isfinite(self.distance)
        return float(np.sqrt(np.mean(self.distance[known] ** 2))) if known.any() else float("nan")


def cross_validate(fit: Fit, folds: int | None = None, watch: Watch | None = None) -> CrossValidation:
    """Each fold is predicted by a fit to all others.

    folds: how many blocks, contiguous in each trial; None: one trial after the other where there are three or more,
    else 5 blocks. watch(done, of, what) is called before each. Raises `InvalidInput`.
    """
    by_trial, count = _plan(fit, folds)
    trial, row = fit.where[:, 0], fit.where[:, 1]
    if by_trial:
        present = np.unique(trial)
        fold, names = np.searchsorted(present, trial), tuple(fit.trials[i].name for i in present)
    else:
        fold, names = _blocks(trial, row, count), tuple(f"block {k + 1}" for k in range(count))
    distance, values, notes = np.full(len(trial), np.nan), [], []
    for k in range(len(names)):
        if watch is not None:
            watch(k, len(names), f"held out: {names[k]}")
        out = fold == k
        try:
            part = _without(fit, out)
            distance[out] = _distances(fit, part)[out]
            values.append(part.values)
            notes.append("")
        except TendonrodError as error:
            values.append(np.full(len(fit.unknowns), np.nan))
            notes.append(str(error))
    each = {"fold": fold, "distance": distance, "values": np.array(values), "used": fit.used}
    return CrossValidation(folds=names, notes=tuple(notes), **each)


def _plan(fit: Fit, folds: int | None) -> tuple[bool, int]:
    trials, samples = np.unique(fit.where[:, 0]).size, len(np.unique(fit.where[:, :2], axis=0))
    if samples < 2:
        raise InvalidInput("trials", Fact(f"{samples} sample"), "of two samples or more, to hold one out")
    if folds is None:
        return trials >= 3, min(BLOCKS, samples)
    return False, whole("folds", folds, 2, max(2, samples))


def _blocks(trial: np.ndarray, row: np.ndarray, count: int) -> np.ndarray:
    """(N,) block of each pose: equal shares of the samples of its trial, in their order."""
    found = np.zeros(trial.size, dtype=int)
    for i in np.unique(trial):
        rows = np.unique(row[trial == i])
        found[trial == i] = np.searchsorted(rows, row[trial == i]) * count // rows.size
    return found


def _without(fit: Fit, out: np.ndarray) -> Fit:
    """The fit without some poses, started from the whole one; samples stay, for tendons that rub remember them."""
    trials, known = [], []
    for i, trial in enumerate(fit.trials):
        position, at = trial.position.copy(), fit.where[out & (fit.where[:, 0] == i)]
        position[at[:, 1], at[:, 2]] = np.nan
        part = replace(trial, position=position)
        if (part.kept & part.on_robot).any():
            trials.append(part)
            known.append(fit.problem.known[i])
    problem = Problem(tuple(trials), fit.names, fit.setup, fit.orientations, tuple(known), fit.problem.prior)
    return fitted(problem, fit.loss)


def _distances(fit: Fit, part: Fit) -> np.ndarray:
    """(N,) of all poses of the whole fit, predicted with the setup of a part."""
    problem = Problem(fit.trials, fit.names, part.setup, fit.orientations)
    return problem.misfit.body_distances(problem.at(problem.start), part.setup.holder)
