"""From the unloaded robot to the full load in steps, for loads that Newton cannot take at once."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .shape import capacity, state_size

STEPS = 32  # of the integrator, while under way
FARTHEST = 0.05  # of the length: motion of the body in one step above which the step is halved, lest a branch be jumped
ENOUGH = 1.0 / 16384  # step of the load factor below which a loss of stability is taken for the branch's own
SMALLEST = 1.0 / 65536  # step of the load factor at which the way counts as closed
# Ways from (load, tension) = (0, .) to (1, 1); the first starts from the tendons alone, where the answer is known.
WAYS = (((0.0, 1.0), (1.0, 1.0)), ((0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)))


def follow_load(kernel, rod, tendons, problem):
    """(code, load factor reached on the first way, stats, state, jacobian), as the kernel's own solve."""
    ways = WAYS if problem[:12].any() and tendons[:, 6].any() else WAYS[1:2]  # else all ways are the same
    failures = []
    for way in ways:
        code, reached, walker = _walk(kernel, rod, tendons, problem, way)
        if code == 0:
            code, stats, state, jacobian = walker.arrive()
            if code == 0:
                return code, 1.0, stats, state, jacobian
        failures.append((code, min(reached, 1.0 - SMALLEST), walker.stats, walker.state, walker.jacobian))
    return failures[0]


def _walk(kernel, rod, tendons, problem, way):
    walker = _Walker(kernel, rod, tendons, problem)
    code, done = walker.go(*way[0]), 0.0
    for (load0, tension0), (load1, tension1) in pairwise(way):
        at, stride = 0.0, 0.25
        while code == 0 and at < 1.0:
            to = min(1.0, at + stride)
            factors = load0 + to * (load1 - load0), tension0 + to * (tension1 - tension0)
            if walker.go(*factors, keep_stable=stride > ENOUGH) == 0:
                at, stride = to, 1.5 * stride
            else:
                stride *= 0.5
                if stride < SMALLEST:
                    code = 2
        done += at / (len(way) - 1)
    return code, done, walker


class _Walker:
    """Holds the last good state and tries the next load from it."""

    def __init__(self, kernel, rod, tendons, problem) -> None:
        self.kernel, self.rod, self.tendons, self.problem = kernel, rod, tendons, problem
        self.state, self.jacobian, self.stats = np.empty(0), np.eye(3), np.zeros(8)
        self.scratch, self.wanted, self.stable = np.empty(kernel.SCRATCH), 0, True

    def go(self, load: float, tension: float, keep_stable: bool = False) -> int:
        """Solve at these factors; keep the result if it converged near the last one. Returns the kernel's code."""
        steps = max(STEPS, int(self.problem[27]))
        problem, tendons = self.problem.copy(), self.tendons.copy()
        problem[:12] *= load
        tendons[:, 6] *= tension
        problem[27] = steps
        return self._attempt(problem, tendons, steps + 2 * len(tendons) + 2, keep_stable)

    def arrive(self):
        """Repeat the last solve with the accuracy or the steps that were asked for."""
        problem, capacity = self.problem.copy(), 4 * STEPS
        while True:
            code = self._attempt(problem, self.tendons, max(capacity, int(problem[27]) + 2 * len(self.tendons) + 2))
            if code != 3 or self.wanted > 20_000:
                return code, self.stats, self.state, self.jacobian
            capacity = self.wanted + 2 * len(self.tendons) + 2

    def _attempt(self, problem, tendons, capacity: int, keep_stable: bool = False) -> int:
        state, jacobian, stats = np.empty(state_size(capacity)), self.jacobian.copy(), np.zeros(8)
        if self.state.size:
            transfer(self.state, int(self.stats[5]), int(self.stats[4]), state)
            problem[28] = self.stats[4]
        code = self.kernel.equilibrium(self.rod, tendons, problem, state, jacobian, stats, self.scratch)
        if code == 0 and problem[27] > 0 and self._moved(state, stats) > FARTHEST * problem[12]:
            code = 2
        if code == 0:
            half, n = int(stats[5]), int(stats[4])
            stable = self.kernel.stability(self.rod, tendons, problem, state, half, n, self.scratch) > 0
            if keep_stable and self.stable and not stable:
                return 2
            self.state, self.jacobian, self.stats, self.stable = state, jacobian, stats, stable
        self.wanted = int(stats[4])
        return code

    def _moved(self, state, stats) -> float:
        """Largest distance (m) between the nodes of a new state and of the last good one, 0 if there is none."""
        if not self.state.size or self.stats[4] != stats[4]:
            return 0.0
        new, old = nodes(state, int(stats[5]), int(stats[4])), nodes(self.state, int(self.stats[5]), int(self.stats[4]))
        return float(np.linalg.norm(new - old, axis=1).max())


def nodes(state, half: int, n: int) -> np.ndarray:
    """(n + 1, 3) positions of the nodes of one half of a solved state, m."""
    at = half * (state.size // 2) + capacity(state) + 1
    return state[at : at + 12 * (n + 1)].reshape(-1, 12)[:, :3]


def transfer(source, half: int, n: int, state) -> None:
    """Copy ``n`` steps of one half of a solved state to the first half of another, of other capacity."""
    old, new = capacity(source), capacity(state)
    at, to = half * (source.size // 2), 0
    if old == new:
        state[: state.size // 2] = source[at : at + source.size // 2]
        return
    for width, last in ((1, 1), (12, 12), (3, 3), (12, 0), (12, 3)):
        state[to : to + width * n + last] = source[at : at + width * n + last]
        to += width * new + last
        at += width * old + last
