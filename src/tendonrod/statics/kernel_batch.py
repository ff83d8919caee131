"""Compiled loop over the items of a batch: the single solve's kernel, item after item, without Python's lock.

Arrays as in `kernel`, here one row per item; m items, n tendons, k points, U robots.
"""

import math

from .kernel import CONVERGED, TOO_SMALL, capacity, equilibrium, parts, sample
from .kernel_jit import jit


def _loop(sampled: bool):
    """The loop over items. Without sampling it is a function of its own: code that is not called made it 1.7 times slower."""

    @jit
    def equilibria(rods, routing, which, tensions, problems, fractions, room, halted,
                   tendons, state, at, J, w, tips, rows, facts, codes):  # fmt: skip
        """Solve items until all are done or ``halted[0]`` is set; returns how many were looked at.

        rods (U, 13), routing (U, n, 6), which (m,) robot of each item, tensions (m, n), problems (m, 30), fractions (k,) of
        the exposed length at which to sample, room: steps for which a single solve makes room at first.
        Work space: tendons (n, 7), state, at (k,), J (3, 3), w (SCRATCH,). Out: tips (m, 12) frames, rows (m, k, 24),
        facts (m, 8) stats, all NaN where codes (m,) is not CONVERGED; an item with codes < 0 is left alone.
        Each item gets as much of ``state`` as `Solution.run` would make, for the grids depend on it, until it is used up.
        """
        spare, most = 2 * tendons.shape[0] + 2, capacity(state)
        for i in range(problems.shape[0]):
            if halted[0] != 0:
                return i
            rod, problem, stats, own = rods[which[i]], problems[i], facts[i], state
            for j in range(tendons.shape[0]):
                for q in range(6):
                    tendons[j, q] = routing[which[i], j, q]
                tendons[j, 6] = tensions[i, j]
            cap = max(room, int(problem[27]) + spare)
            while codes[i] == TOO_SMALL and cap <= most:
                own = state[: 2 * (40 * cap + 19)]
                codes[i] = equilibrium(rod, tendons, problem, own, J, stats, w)
                cap = int(stats[4]) + spare
            if codes[i] == CONVERGED:
                n, half = int(stats[4]), int(stats[5])
                frames = parts(own, capacity(own), half)[1]
                for q in range(12):
                    tips[i, q] = frames[12 * n + q]
                for j in range(fractions.shape[0]):
                    at[j] = fractions[j] * problem[12]
                if sampled:
                    sample(rod, tendons, problem, own, half, n, at, 0.05 * problem[26], rows[i], w)
            else:
                tips[i, :] = math.nan
                rows[i, :, :] = math.nan
                facts[i, :] = math.nan
        return problems.shape[0]

    return equilibria


equilibria, sampled_equilibria = _loop(False), _loop(True)


def compile_all() -> None:
    """Compile the loop, or load it from the cache on disk."""
    line, table, block, whole = "float64[::1]", "float64[:,::1]", "float64[:,:,::1]", "int64[::1]"
    given = f"{table}, {block}, {whole}, {table}, {table}, {line}, int64, uint8[::1]"
    work = f"{table}, {line}, {line}, {table}, {line}"
    for loop in (equilibria, sampled_equilibria):
        loop.compile(f"({given}, {work}, {table}, {block}, {table}, {whole})")
