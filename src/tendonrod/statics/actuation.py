"""What drives the tendons of a trial: given tensions or pulled lengths, with friction between tendon and tube.

Pulled length: d = L* - L + c tau, with L the path's length, L* that of the straight robot, c the compliance of the
whole tendon; a tendon never pushes. Friction: what arrives at a section lies between tau exp(-mu Theta) and
tau exp(mu Theta), Theta = integral of |u x t + t'|, and stays as it was between them. Source: docs/method, Tendons.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .problem import History, RodProblem
    from .trial import Trial

MIDDLE = 3**0.5 / 6  # offset of the Gauss nodes from the middle of a step, in steps
WITHIN = np.array([[0.25, 0.25 - MIDDLE], [0.25 + MIDDLE, 0.25]])  # integrals from the step's start to its stages
ROUNDS = 60


class Strands:
    """The tendons' paths through one trial."""

    def __init__(self, problem: RodProblem, trial: Trial, rubs: bool) -> None:
        robot, T = problem.robot, trial.n_tendons
        self.problem = problem
        self.q, self.pull = np.empty((2 * trial.n, T, 3)), np.empty((2 * trial.n, T, 6))
        self.along(trial, np.ascontiguousarray(trial.station[:, 6:12]))
        self.rest = np.linalg.norm(self.q, axis=2)  # |q| of the straight robot
        self.compliance = robot.tendon_compliance
        self.outside = robot.free_lengths + robot.tendon_lengths - trial.weights @ self.rest  # the part not exposed
        self.rubs = rubs or bool((robot.friction > 0.0).any())
        self.driven = np.flatnonzero(~np.isnan(problem.pulled))
        self.slopes = self.held = None
        if self.rubs:
            s, marks = trial.stages, np.sort(np.concatenate([problem.robot.breaks - problem.s_exit, trial.kinks]))
            part = np.searchsorted(marks, s)
            self.slopes = _cubics(s, part, s, part, 1)
            if problem.request.history is not None:
                self.held = _remembered(problem.request.history, s + problem.s_exit)

    def along(self, trial: Trial, x: np.ndarray) -> None:
        """q = u x r + r' + v and the pull (t, r x t) of every tendon for strains x (2n, 6)."""
        trial.kernel.strands(trial.station, trial.n_tendons, trial.grid, x, self.q, self.pull)

    def shorter(self, trial: Trial) -> np.ndarray:
        """(T,) by how much the path through the exposed robot is shorter than in the straight one, m."""
        return trial.weights @ (self.rest - np.linalg.norm(self.q, axis=2))

    def stretch(self, trial: Trial) -> np.ndarray:
        """(T,) elongation of the tendons per tension at the exit, m/N."""
        return self.compliance * (self.outside + trial.weights @ (self.rest * trial.share))

    def turn(self, trial: Trial) -> np.ndarray:
        """(2n, T) angle Theta through which each tendon has turned from the exit to each stage, rad."""
        size = np.linalg.norm(self.q, axis=2, keepdims=True)
        t = np.divide(self.q, size, out=np.zeros_like(self.q), where=size > 0.0)
        index, weight = self.slopes  # pyright: ignore[reportGeneralTypeIssues] - set where a tendon rubs
        dq = np.einsum("jk,jkti->jti", weight, self.q[index])
        dt = np.divide(dq - t * (t * dq).sum(axis=2, keepdims=True), size, out=np.zeros_like(t), where=size > 0.0)
        bent = np.linalg.norm(np.cross(trial.x[:, None, 3:], t) + dt, axis=2)
        per_step = np.diff(trial.grid)[:, None, None] * bent.reshape(trial.n, 2, -1)
        before = np.cumsum(per_step.mean(axis=1), axis=0) - per_step.mean(axis=1)
        return (before[:, None] + np.einsum("ij,kjt->kit", WITHIN, per_step)).reshape(2 * trial.n, -1)

    def field(self, trial: Trial) -> np.ndarray:
        """(2n, T) tensions at the stages that friction leaves of those at the exit, N."""
        self.along(trial, trial.x)
        low, high = self._bounds(trial)
        return low if self.held is None else np.clip(self._held(trial), low, high)

    def update(self, trial: Trial) -> float:
        """Correct the tensions of a balanced trial; returns by how much tendons still move because of it, m."""
        self.along(trial, trial.x)
        before = trial.share * trial.tensions
        if self.driven.size:
            trial.tensions = self._corrected(trial)
        if self.rubs:
            tau = self.field(trial)
            trial.share = np.divide(tau, trial.tensions, out=np.ones_like(tau), where=trial.tensions > 0.0)
        trial.place()
        soft = np.einsum("jti,ji->jt", self.pull**2, 1.0 / trial.station[:, :6])
        return float(np.abs(trial.weights @ (soft * (trial.share * trial.tensions - before))).max(initial=0.0))

    def guess(self, trial: Trial) -> None:
        """Tensions that the straight robot's compliance gives for the pulled lengths."""
        soft = np.einsum("jti,ji->jt", self.pull**2, 1.0 / trial.station[:, :6])
        per_newton = trial.weights @ soft + self.stretch(trial)
        for i in self.driven:
            trial.tensions[i] = max(0.0, self.problem.pulled[i] / per_newton[i])
        trial.place()

    def missing(self, trial: Trial) -> np.ndarray:
        """(T,) pulled length that the shape does not account for, m; NaN where the tension is given."""
        return self.problem.pulled - self.shorter(trial) - self.stretch(trial) * trial.tensions

    def _corrected(self, trial: Trial) -> np.ndarray:
        """Tensions by Newton's method in the pulled lengths, slack tendons left out."""
        missing, tensions = self.missing(trial), trial.tensions.copy()
        trial.factor()
        active = [i for i in self.driven if tensions[i] > 0.0 or missing[i] > 0.0]
        forced = {i: (trial.share[:, i, None] * self.pull[:, i]) for i in active}
        answers = {i: trial.respond(forced[i])[0].copy() for i in active}
        while active:
            by = [[-(trial.weights[:, None] * self.pull[:, i] * answers[j]).sum() for j in active] for i in active]
            slope = np.array(by) + np.diag(self.stretch(trial)[active])
            change = np.linalg.solve(slope, missing[active])
            slack = [i for i, by in zip(active, change, strict=True) if tensions[i] + by < 0.0]
            if not slack:
                tensions[active] += change
                break
            for i in slack:
                tensions[i] = 0.0
                active.remove(i)
        return tensions

    def kinks(self, trial: Trial) -> np.ndarray:
        """Arc lengths where slip meets stick, m: there the tension's slope jumps."""
        found, s = [], trial.stages
        low, high = self._bounds(trial)
        for away in (self._held(trial) - low, high - self._held(trial)) if self.held is not None else ():
            for each in away.T:
                j = np.flatnonzero((each[:-1] < 0.0) != (each[1:] < 0.0))
                found.append(s[j] + (s[j + 1] - s[j]) * each[j] / (each[j] - each[j + 1]))
        return np.unique(np.concatenate(found)) if found else np.zeros(0)

    def _bounds(self, trial: Trial) -> tuple[np.ndarray, np.ndarray]:
        """(2n, T) tensions at the stages with all the tendon slipping in, and slipping out."""
        rubbed = self.problem.robot.friction * self.turn(trial)
        return trial.tensions * np.exp(-rubbed), trial.tensions * np.exp(rubbed)

    def _held(self, trial: Trial) -> np.ndarray:
        """(2n, T) tensions before, at the stages."""
        index, weight = self.held  # pyright: ignore[reportGeneralTypeIssues] - set where there is a history
        return np.einsum("jk,jkt->jt", weight, self.problem.request.history.tau[index])  # pyright: ignore


def _remembered(history: History, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places in a history, and their weights, that give its tensions at material coordinates ``at``."""
    if history.s_m.size == 1:
        return np.zeros((at.size, 1), dtype=int), np.ones((at.size, 1))
    beyond = (0.5 / MIDDLE - 1.0) / 2.0  # of the spacing of the outer stages: how far the rod reaches beyond them
    first, last = history.s_m[:2], history.s_m[-2:]
    inside = np.clip(at, first[0] - beyond * (first[1] - first[0]), last[1] + beyond * (last[1] - last[0]))
    return _cubics(history.s_m, np.searchsorted(history.kinks, history.s_m), inside,
                   np.searchsorted(history.kinks, inside), 0)  # fmt: skip


def _cubics(s, part, at, part_at, order: int) -> tuple[np.ndarray, np.ndarray]:
    """(k, 4) places in s and weights for a value (order 0) or slope (1) at ``at``, by cubics that stay in one part."""
    first = np.searchsorted(part, part_at, side="left")
    last = np.searchsorted(part, part_at, side="right") - 4
    index = np.clip(np.searchsorted(s, at) - 2, first, np.maximum(first, last))[:, None] + np.arange(4)
    index = np.minimum(index, len(s) - 1)
    apart = s[index] - at[:, None]
    scale = np.abs(apart).max(axis=1)
    powers = (apart / scale[:, None])[:, None, :] ** np.arange(4)[:, None]
    wanted = np.zeros((at.size, 4, 1))
    wanted[:, order] = 1.0
    return index, np.linalg.solve(powers, wanted)[..., 0] / scale[:, None] ** order
