"""`Misfit`: measured less predicted poses, whitened by the noise of trackers and of the tension that drove the model.

A wrong reading of the tension moves all trackers of a sample together, along the model's slope G: their covariance is
C = diag(sigma^2) + sigma_tau^2 G G^T. Robust weights stretch the trackers' part of it. A registration that is a little
off moves all poses that hang on it: a further part B B^T of the covariance, which all samples share.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import Fact, InvalidInput
from ..rotation import hat, log_so3
from .prediction import Prediction
from .registration import Registration, without_offset, world_poses
from .trial import Trial

MEDIAN_3 = 2.365974  # of chi-squared with three degrees of freedom
SMALLEST = 2e-6  # m and rad, of an estimated noise: the model itself is no better
IGNORED = 1e-9  # weight of a pose that does not count


class Misfit:
    """All N used poses of ``trials``, which are registered; d = 3 numbers each, or 6 with orientations.

    where: (N, 3) trial, sample and tracker.
    """

    def __init__(self, trials: Sequence[Trial], orientations: bool = False, known: Sequence[Registration] = ()) -> None:
        self.trials, self.orientations = tuple(trials), orientations
        if not self.trials:
            raise InvalidInput("trials", Fact("none"), "one or more with used samples on the robot")
        found = [np.argwhere(each.kept & each.on_robot) for each in trials]
        self.where = np.concatenate([np.insert(rows, 0, i, axis=1) for i, rows in enumerate(found)])
        if not len(self.where):
            raise InvalidInput("trials", [each.name for each in trials], "with one or more used samples on the robot")
        poses = [world_poses(each) for each in trials]
        self.position = np.concatenate([p[tuple(at.T)] for (p, _), at in zip(poses, found, strict=True)])
        self.rotation = np.concatenate([R[tuple(at.T)] for (_, R), at in zip(poses, found, strict=True)])
        self.turned = np.array([each.turn is not None for each in self._trackers()])
        self.turned &= np.isfinite(self.rotation).all(axis=(1, 2))
        if orientations and not self.turned.any():
            raise InvalidInput("orientations", True, "False: no tracker has both its turn and measured orientations")
        _, which, counts = np.unique(self.where[:, :2], axis=0, return_inverse=True, return_counts=True)
        self.sample, self.counts = which.ravel(), counts
        self.loose = self._loose(known)

    def _loose(self, known: Sequence[Registration]) -> np.ndarray:
        """(N, d, q) how poses move, one standard error each, with what registrations do not know of the world.

        A registration by the base tracker is off by the same motion for all that hangs on it: shifts and turns about
        the world's origin.
        """
        columns = [np.empty((len(self.where), self.d, 0))]
        for each in {id(each): each for each in known}.values():
            shift, turn = np.nan_to_num(each.standard_error)
            mine = np.array([known[i] is each for i in self.where[:, 0]])
            if not mine.any() or shift == turn == 0.0:
                continue
            block = np.zeros((len(self.where), self.d, 6))
            block[mine, :3, :3], block[mine, :3, 3:] = shift * np.eye(3), -turn * hat(self.position[mine])
            if self.orientations:
                block[mine & self.turned, 3:, 3:] = turn * np.eye(3)
            columns.append(block)
        return np.concatenate(columns, axis=2)

    def _trackers(self):
        return [self.trials[i].trackers[j] for i, _, j in self.where]

    @property
    def d(self) -> int:
        """Numbers of each pose."""
        return 6 if self.orientations else 3

    def errors(self, found: Prediction) -> np.ndarray:
        """(N, d) measured less predicted: m, and rotation vectors, rad; those of unknown orientations are zero."""
        e = self.position - self._picked(found.position)
        if not self.orientations:
            return e
        turns = np.zeros_like(e)
        R = self._picked(found.rotation)[self.turned]
        turns[self.turned] = log_so3(self.rotation[self.turned] @ R.transpose(0, 2, 1))
        return np.hstack([e, turns])

    def slopes(self, found: Prediction) -> tuple[np.ndarray, np.ndarray]:
        """(N, d, m) derivatives of the prediction by the unknowns, (N, d, T) by the readings, padded with zeros."""
        T = max(each.shape[-1] for each in found.slope)
        padded = [np.pad(np.nan_to_num(each), [(0, 0)] * 3 + [(0, T - each.shape[-1])]) for each in found.slope]
        X, G = self._picked(found.columns)[:, : self.d].copy(), self._picked(padded)[:, : self.d].copy()
        for each in (X, G):
            each[~self.turned, 3:] = 0.0
        return X, G

    def _picked(self, arrays: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate([each[tuple(self.where[self.where[:, 0] == i, 1:].T)] for i, each in enumerate(arrays)])

    def noise(self, e: np.ndarray) -> np.ndarray:
        """(N, d) standard deviations as the trials state them; where they do not, by the median of the errors."""
        found = np.empty_like(e)
        for name, part in (("position_noise", slice(0, 3)), ("orientation_noise", slice(3, 6)))[: self.d // 3]:
            stated = np.array([getattr(self.trials[i], name) or np.nan for i in self.where[:, 0]])
            rows = self.turned if part.start else np.ones(len(e), bool)
            typical = np.sqrt(np.median((e[rows, part] ** 2).sum(axis=1)) / MEDIAN_3)
            found[:, part] = np.where(np.isnan(stated), max(SMALLEST, typical), stated)[:, None]
        return found

    @property
    def reading_noise(self) -> np.ndarray:
        """(N,) standard deviation of the tension's reading, N; zero where it is not known."""
        stated = np.array([each.tension_noise or 0.0 for each in self.trials])
        return stated[self.where[:, 0]]

    def distances(self, e: np.ndarray, sigma: np.ndarray, G: np.ndarray) -> np.ndarray:
        """(N,) Mahalanobis distance of each pose alone."""
        C = self._covariances(sigma, self.reading_noise[:, None, None] * G)
        return np.sqrt(np.einsum("ni,ni->n", e, np.linalg.solve(C, e[..., None])[..., 0]))

    def whitened(self, a: np.ndarray, sigma: np.ndarray, G: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(N d, m) of ``a`` (N, d, m): unit covariance, poses weighted; G (N, d, T).

        What registrations do not know, `loose`, is a part of the covariance that all poses share.
        """
        white = self._blockwise(a, sigma, G, weights)
        if not self.loose.shape[2]:
            return white
        U, S, _ = np.linalg.svd(self._blockwise(self.loose, sigma, G, weights), full_matrices=False)
        return white - U @ ((1.0 - 1.0 / np.sqrt(1.0 + S**2))[:, None] * (U.T @ white))

    def _blockwise(self, a: np.ndarray, sigma: np.ndarray, G: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """`whitened`, sample by sample."""
        found = np.empty_like(a)
        spread = sigma / np.sqrt(np.maximum(weights, IGNORED))[:, None]
        G = self.reading_noise[:, None, None] * G
        order = np.argsort(self.sample, kind="stable")
        count = self.counts[self.sample[order]]
        for k in np.unique(self.counts):
            rows = order[count == k].reshape(-1, k)
            stacked = (len(rows), k * self.d, -1)
            C = self._covariances(spread[rows].reshape(stacked[:2]), G[rows].reshape(stacked))
            found[rows] = np.linalg.solve(np.linalg.cholesky(C), a[rows].reshape(stacked)).reshape(a[rows].shape)
        return found.reshape(-1, a.shape[-1])

    @staticmethod
    def _covariances(sigma: np.ndarray, G: np.ndarray) -> np.ndarray:
        """(…, d, d) diag(sigma^2) + G G^T."""
        return sigma[..., None] ** 2 * np.eye(sigma.shape[-1]) + G @ np.swapaxes(G, -1, -2)

    def body_distances(self, found: Prediction, holder: np.ndarray) -> np.ndarray:
        """(N,) distance between measured and predicted point of the body, as tables of accuracy have it, m."""
        R, predicted = self._picked(found.rotation), self._picked(found.position)
        distances = np.linalg.norm(self.position - predicted, axis=1)
        for i, j in np.unique(self.where[:, [0, 2]], axis=0):
            rows = (self.where[:, 0] == i) & (self.where[:, 2] == j)
            pairs = (self.position[rows], self.rotation[rows]), (predicted[rows], R[rows])
            a, b = (without_offset(*pair, self.trials[i].trackers[j], holder) for pair in pairs)
            apart = np.linalg.norm(a - b, axis=1)
            distances[rows] = np.where(np.isfinite(apart), apart, distances[rows])
        return distances
