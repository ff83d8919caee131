"""How sure identified numbers are, what they cost, and what bad data do to them; on virtual experiments.

    python benchmarks/identification.py [SEEDS]                 # 200 by default, on two processes
    python benchmarks/identification.py 20 --only coverage      # or speed, robustness

The study: Prototype 1 with homogenized torsion, gravity along -x, one tracker in turn at 25, 50, 75 and 100 % of the
length, 30 tensions from 0.05 to 0.7 N at each. Tracker noise is 0.5 mm in each coordinate, noise of the tension's
reading 5 mN. Young's modulus (true 68, believed 75 GPa), two angles by which the base leans (6.9 and -5.7 deg), a mass
at the tip (0.4 g) and the factor on torsion (1.5 for 1) are identified at once, from what is believed. The truth is
solved to 1 nm.

Coverage: the share of 95 % intervals that hold the truth, over seeds of the noise. The Cramér-Rao bound is taken at the
truth, with the exact derivatives and the true covariance; the true tensions count as unknowns of their own, of which
the readings tell (that gives the same matrix as a covariance enlarged along the model's slope by the tension).

Times are processor times of one thread, medians of rounds that take turns.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle

import numba
import numpy as np
import scipy

import tendonrod
from tendonrod import LumpedMass, load_robot, solve
from tendonrod.measurement.bench import Experiment
from tendonrod.measurement.experiment import TrueTrial, measured, simulate
from tendonrod.measurement.identification import Fit, identify
from tendonrod.measurement.noise import Noise
from tendonrod.measurement.prediction import Predictor, predict
from tendonrod.measurement.setup import Setup
from tendonrod.measurement.trial import KEPT, Trial

GRAVITY = (-9.81, 0.0, 0.0)
BELIEVED = load_robot("exonav-1").replace(torsion="homogenized")
TRUE = BELIEVED.replace(youngs_modulus=68e9, torsion_factor=1.5)
STUDY = Experiment(
    robot=TRUE, claimed=BELIEVED, gravity=GRAVITY, samples=30, cycles=0, base_tilt=(0.12, -0.1), tip_mass=4e-4,
    noise=Noise(position=0.5e-3, tension=5e-3),
)  # fmt: skip
TRUTH = Setup(robot=TRUE, base_tilt_x=0.12, base_tilt_y=-0.1, tip_mass=4e-4)
FREE = ("youngs_modulus", "base_tilt_x", "base_tilt_y", "tip_mass", "torsion_factor")
NORMAL = 1.959964  # 97.5 % quantile
PARTS = ("coverage", "speed", "robustness")


@cache
def truth(samples: int = STUDY.samples) -> tuple[TrueTrial, ...]:
    """What happens in the study, simulated once in each process."""
    return simulate(replace(STUDY, samples=samples))


def data(seed: int, **noise) -> tuple[Trial, ...]:
    """The study's trials; ``noise`` replaces some of its kinds, which leaves the draws of the others as they were."""
    return measured(replace(STUDY, noise=replace(STUDY.noise, **noise)), truth(), seed)


def true_values() -> np.ndarray:
    """(m,) SI."""
    return np.array([TRUTH.value(name, data(0)) for name in FREE])


def bound() -> np.ndarray:
    """(m, m) Cramér-Rao bound of the covariance of unbiased estimates, SI."""
    exact = [replace(each, tensions=true.tensions) for each, true in zip(data(0), truth(), strict=True)]
    found, information = predict(exact, TRUTH, FREE), np.zeros((len(FREE), len(FREE)))
    for trial, columns, slope in zip(exact, found.columns, found.slope, strict=True):
        for row, j in np.argwhere(trial.kept & trial.on_robot):
            X, G = columns[row, j, :3], STUDY.noise.tension * slope[row, j, :3]
            information += X.T @ np.linalg.solve(STUDY.noise.position**2 * np.eye(3) + G @ G.T, X)
    return np.linalg.inv(information)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Of one seed: values, standard errors, whether each interval holds the truth (m,); squared Mahalanobis distance
    of the values from the truth; the noise's scale and how many evaluations it took.
    """

    values: np.ndarray
    errors: np.ndarray
    holds: np.ndarray
    distance2: float
    scale: float
    evaluations: int


def outcome(seed: int, setup: Setup | None = None) -> Outcome:
    """The fit to one seed's data, from ``setup``, None for what is believed."""
    fit, true = identify(data(seed), FREE, setup=setup), true_values()
    off = fit.values - true
    return Outcome(
        values=fit.values,
        errors=fit.standard_errors,
        holds=(fit.low <= true) & (true <= fit.high),
        distance2=float(off @ np.linalg.solve(fit.covariance, off)),
        scale=fit.scale,
        evaluations=fit.evaluations,
    )


def outcomes(seeds: int, processes: int = 2) -> list[Outcome]:
    """Of seeds 0, 1, …"""
    outcome(0)  # compiles the kernel once, before the processes start
    found, began = [], time.perf_counter()
    with ProcessPoolExecutor(min(processes, seeds)) as pool:
        for each in pool.map(outcome, range(seeds)):
            found.append(each)
            if len(found) % 20 == 0:
                print(f"{len(found)} of {seeds}, {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    return found


def print_coverage(seeds: int) -> None:
    found, true, least = outcomes(seeds), true_values(), np.sqrt(np.diag(bound()))
    holds, values, errors = (np.array([getattr(o, name) for o in found]) for name in ("holds", "values", "errors"))
    z, wide = (values - true) / errors, half_widths(found).mean(axis=0) / (NORMAL * least)
    spread = values.std(axis=0, ddof=1) / least
    print(f"coverage of 95 % intervals, {seeds} seeds; one standard deviation of what chance does:", end=" ")
    print(f"coverage {100 * np.sqrt(0.95 * 0.05 / seeds):.1f} %, bias {1 / np.sqrt(seeds):.2f} standard errors")
    print(f"{'':16s}    truth  coverage  bias / error  spread / error  half-width / bound  spread / bound")
    for k, name in enumerate(FREE):
        print(
            f"{name:16s} {true[k]:8.3g} {100 * holds[:, k].mean():7.1f} % {z[:, k].mean():13.2f} "
            f"{z[:, k].std(ddof=1):15.2f} {wide[k]:19.3f} {spread[k]:15.3f}"
        )
    print(f"{'all':16s} {'':8s} {100 * holds.mean():7.1f} %")
    print(
        f"squared distance from the truth {np.mean([o.distance2 for o in found]):.2f}, {len(FREE)} expected;", end=" "
    )
    print(f"scale of the noise {np.mean([o.scale for o in found]):.3f}, 1 expected;", end=" ")
    print(f"{min(o.evaluations for o in found)} to {max(o.evaluations for o in found)} evaluations a fit\n")


def half_widths(found: list[Outcome]) -> np.ndarray:
    """(seeds, m) of the intervals; their quantile is that of `Fit`."""
    return np.array([scipy.stats.t.ppf(0.975, 3 * 4 * STUDY.samples - len(FREE)) * each.errors for each in found])


class Direct(Predictor):
    """Every sample solved by itself."""

    def _curve(self, key, family) -> None:
        return None


def medians(cases: dict[str, tuple[Callable[[], object], int]], rounds: int) -> dict[str, float]:
    """Median processor time (s) of a call; (call, calls a round) by name, rounds in turn."""
    times: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(rounds):
        for name, (call, calls) in cases.items():
            start = time.thread_time()
            for _ in range(calls):
                call()
            times[name].append((time.thread_time() - start) / calls)
    return {name: statistics.median(values) for name, values in times.items()}


def print_speed(samples: int = 125, rounds: int = 15) -> None:
    trials = measured(replace(STUDY, samples=samples), truth(samples), 0)[1:]  # that of the base predicts nothing
    near = [TRUTH.changed({"youngs_modulus": 68e9 * (1.0 + 0.01 * k)}, trials) for k in range(8)]
    walk, direct, setups, masses = Predictor(trials, FREE), Direct(trials, FREE), cycle(near), [LumpedMass(mass=4e-4)]
    fit = identify(trials, FREE)
    walk(near[0])
    direct(near[0])  # compiled and started, as they are within a fit
    t = medians(
        {
            "cold solve": (lambda: solve(TRUE, 0.7, GRAVITY), 50),
            "cold solve with the mass": (lambda: solve(TRUE, 0.7, GRAVITY, loads=masses), 20),
            "evaluation": (lambda: walk(next(setups)), 1),
            "fit": (lambda: identify(trials, FREE), 1),
        },
        rounds,
    )
    t["iteration (fit / evaluations)"] = per = t["fit"] / fit.evaluations
    t |= medians({"evaluation, each sample solved": (lambda: direct(near[1]), 1)}, 1)
    cold, laden, each = t["cold solve"], t["cold solve with the mass"], fit.solves / fit.evaluations
    print(f"speed, {len(FREE)} numbers from {4 * samples} samples:", end=" ")
    print(f"{fit.evaluations} evaluations of {each:.0f} equilibria a fit")
    print(f"{'':34s} {'ms':>9s} {'cold solves':>12s} {'of the same, with mass':>23s}")
    for name, value in t.items():
        print(f"{name:34s} {1e3 * value:9.3f} {value / cold:12.1f} {value / laden:23.2f}")
    print(f"asked: an iteration in less than 200 cold solves; found {per / cold:.0f}\n")


def damaged(seed: int) -> dict[str, tuple[Trial, ...]]:
    """The study's trials with what goes wrong on benches, by name."""
    clean, gaps = data(seed), data(seed, dropouts=0.3)
    return {
        "30 % of the frames missing": gaps,
        "one frame 20 mm off": with_outlier(clean),
        "one repeated time": with_repeat(clean),
        "all three": with_repeat(with_outlier(gaps)),
    }


def with_outlier(trials: tuple[Trial, ...]) -> tuple[Trial, ...]:
    """A frame of the tip, the first from the middle on that is there, 20 mm along the field's x."""
    tip = trials[-1]
    position, row = tip.position.copy(), np.flatnonzero(tip.kept[15:, 0])[0] + 15
    position[row] += (20e-3, 0.0, 0.0)
    return (*trials[:-1], replace(tip, position=position))


def with_repeat(trials: tuple[Trial, ...]) -> tuple[Trial, ...]:
    """At 75 %, a frame that is there has the time of the sample before."""
    trial = trials[-2]
    time, row = trial.time.copy(), np.flatnonzero(trial.kept[10:, 0])[0] + 10
    time[row] = time[row - 1]
    return (*trials[:-2], replace(trial, time=time), trials[-1])


def print_robustness(seeds: int = 5) -> None:
    clean = [identify(data(seed), FREE) for seed in range(seeds)]
    print(f"robustness, {seeds} seeds; shift against the same data undamaged, in standard errors of those")
    print(f"{'':28s} {'rms':>6s} {'largest':>8s}   reported for seed 0")
    for name in damaged(0):
        fits = [identify(damaged(seed)[name], FREE) for seed in range(seeds)]
        shift = np.array([(a.values - b.values) / b.standard_errors for a, b in zip(fits, clean, strict=True)])
        print(f"{name:28s} {np.sqrt(np.mean(shift**2)):6.2f} {np.abs(shift).max():8.2f}   {reported(fits[0])}")
    print(f"expected of 30 % missing: rms {np.sqrt(0.3 / 0.7):.2f}, for two fits of which one has 70 % of the data")
    print(f"undamaged, seed 0: {reported(clean[0])}")


def reported(fit: Fit) -> str:
    """What trials and fit tell of data that are not used."""
    fates = sum((count for trial in fit.trials for count in trial.counts().values()), start=Counter[str]())
    fates = {fate: count for fate, count in fates.items() if fate != KEPT}
    told = [each for each in fit.sentences if "outlier" in each]
    return "; ".join([f"{count} {fate}" for fate, count in fates.items()] + told) or "nothing"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("seeds", nargs="?", type=int, default=200)
    parser.add_argument("--only", choices=PARTS, help="one part")
    given = parser.parse_args(arguments)
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, NumPy {np.__version__},")
    print(f"SciPy {scipy.__version__}, Numba {numba.__version__}, tendonrod {tendonrod.__version__}\n")
    calls = {"coverage": lambda: print_coverage(given.seeds), "speed": print_speed, "robustness": print_robustness}
    for name in PARTS if given.only is None else (given.only,):
        calls[name]()


if __name__ == "__main__":
    main()
