"""What the engine's features cost, in cold solves of the same run: python benchmarks/engine.py

Displacement drive, contact with 40 and 80 places, warm contact as a navigator asks for it, ten derivatives, friction,
general loads and robots. Ratios are of the best of many interleaved rounds; times are this machine's.
"""

import platform
import sys
from time import perf_counter

import numba
import numpy as np

import tendonrod
from tendonrod import PointLoad, load_robot, solve
from tendonrod.statics.problem import problem_of
from tendonrod.statics.trial import Trial
from tendonrod.surface import Cylinder, Plane, Tube

GRAVITY = (-9.81, 0.0, 0.0)
ROUNDS, SECONDS = 40, 0.004
ROBOT = load_robot("exonav-1")
PLANE = Plane(point=np.array([0.0, 10e-3, 0.0]), normal=np.array([0.0, -1.0, 0.0]))
TUBE = Tube(point=np.zeros(3), axis=np.array([0.0, 0.0, 1.0]), radius=5e-3)
CORD = Cylinder(point=np.array([0.0, 12e-3, 0.0]), axis=np.array([0.3, 0.0, 1.0]), radius=5e-3)
POINT = PointLoad(force=(1e-3, 0.0, 0.0), at=0.04)
TEN = ("tensions", "tip_force", "tip_moment", "gravity")


def cases() -> dict:
    """What is timed, by name."""
    cold = solve(ROBOT, 0.7, GRAVITY)
    rubbing = ROBOT.replace(tendon_friction=0.1)
    touching = solve(ROBOT, 0.7, GRAVITY, surface=PLANE, steps=20)
    trial = Trial(problem_of(cold._solution), cold._solution.grid.copy())
    trial.take(cold._solution)
    trial.walk()
    trial.factor()
    strains, changes = trial.rows(cold.s)[:, 12:18].copy(), np.zeros((10, 22))
    changes[:, :10] = np.eye(10)
    return {
        "cold solve": lambda: solve(ROBOT, 0.7, GRAVITY),
        "driven by length": lambda: solve(ROBOT, displacements=2e-3, gravity=GRAVITY),
        "on a plane, 40 places": lambda: solve(ROBOT, 0.7, GRAVITY, surface=PLANE, steps=20),
        "in a tube, 40 places": lambda: solve(ROBOT, 0.7, GRAVITY, surface=TUBE, steps=20),
        "over a cylinder, 40 places": lambda: solve(ROBOT, 0.7, GRAVITY, surface=CORD, steps=20),
        "on a plane, error controlled": lambda: solve(ROBOT, 0.7, GRAVITY, surface=PLANE),
        "on a plane, 40 places, warm": lambda: solve(ROBOT, 0.701, GRAVITY, surface=PLANE, steps=20, start=touching),
        "ten derivatives": lambda: cold.jacobian(*TEN),
        "ten derivatives, compiled part": lambda: (trial.factor(), trial.columns(changes, cold.s, strains)),
        "with friction": lambda: solve(rubbing, 0.7, GRAVITY),
        "a point load, general driver": lambda: solve(ROBOT, 0.7, GRAVITY, loads=[POINT]),
    }


def best_times(timed: dict) -> dict:
    """Best time of one call (s), rounds interleaved so that all see the same machine."""
    counts, best = {}, dict.fromkeys(timed, float("inf"))
    for name, call in timed.items():
        call()
        start = perf_counter()
        call()
        counts[name] = max(1, int(SECONDS / (perf_counter() - start)))
    for _ in range(ROUNDS):
        for name, call in timed.items():
            start = perf_counter()
            for _ in range(counts[name]):
                call()
            best[name] = min(best[name], (perf_counter() - start) / counts[name])
    return best


def main() -> None:
    """Print machine, versions, times and ratios."""
    machine = platform.processor() or platform.machine()
    versions = f"Python {platform.python_version()}, numba {numba.__version__}, tendonrod {tendonrod.__version__}"
    print(f"{machine}, {versions}")
    best = best_times(cases())
    cold = best["cold solve"]
    print(f"\n{'':34s}{'us':>10s}{'cold solves':>14s}")
    for name, each in best.items():
        print(f"{name:34s}{1e6 * each:10.1f}{each / cold:14.2f}")
    for name, most in (("driven by length", 2.0), ("on a plane, 40 places", 25.0), ("ten derivatives", 3.0)):
        ratio = best[name] / cold
        print(f"{name}: {ratio:.1f} cold solves, asked at most {most:.0f}: {'met' if ratio <= most else 'MISSED'}")


if __name__ == "__main__":
    sys.exit(main())
