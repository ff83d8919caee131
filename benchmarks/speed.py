"""How fast the statics are, as ratios measured within one run: machines differ and drift, ratios much less.

    python benchmarks/speed.py

Problem: exonav-1 at 0.7 N under gravity along -x, position error at most 1 um, unless a row says otherwise. Every time
is the median of many repetitions taken in turn with the others.
"""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import sys
import time

import numba
import numpy as np
import scipy

import tendonrod
from scipy_way import STANDARD_GRAVITY, scipy_solve
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.statics.equilibrium import prepare

ROBOT = tendonrod.load_robot("exonav-1")
ROUNDS, CALLS = 41, 50


def medians(cases: dict) -> dict[str, float]:
    """Median time (s) of each call, rounds interleaved so that drift of the machine meets all alike."""
    times: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(ROUNDS):
        for name, call in cases.items():
            start = time.perf_counter()
            for _ in range(CALLS):
                call()
            times[name].append((time.perf_counter() - start) / CALLS)
    return {name: statistics.median(values) for name, values in times.items()}


def once(call, repeats: int) -> float:
    """Median time (s) of a long call."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def fresh_process(code: str) -> float:
    """Median wall time (s) of a new interpreter running ``code``, less that of an empty one."""
    run = [once(lambda c=c: subprocess.run([sys.executable, "-c", c], check=True), 5) for c in (code, "pass")]
    return run[0] - run[1]


def main() -> None:
    solve, gravity = tendonrod.solve, STANDARD_GRAVITY
    exact = solve(ROBOT, 0.7, gravity, accuracy=1e-11).tip
    start = solve(ROBOT, 0.7, gravity)
    sharp = solve(ROBOT, 0.7, gravity, accuracy=1e-9)
    cases = {
        "compiled, loaded": prepare(ROBOT, 0.7, gravity).run,
        "compiled, no load": prepare(ROBOT, 0.7).run,
        "compiled, 40 steps": prepare(ROBOT, 0.7, gravity, steps=40).run,
        "compiled, 80 steps": prepare(ROBOT, 0.7, gravity, steps=80).run,
        "compiled, 160 steps": prepare(ROBOT, 0.7, gravity, steps=160).run,
        "solve, loaded": lambda: solve(ROBOT, 0.7, gravity),
        "solve, no load": lambda: solve(ROBOT, 0.7),
        "solve, warm, tension +2 %": lambda: solve(ROBOT, 0.714, gravity, start=start),
        "solve, warm, insertion -2 %": lambda: solve(ROBOT, 0.7, gravity, insertion=0.98, start=start),
        "solve, loaded, 1 nm": lambda: solve(ROBOT, 0.7, gravity, accuracy=1e-9),
        "solve, warm, tension +2 %, 1 nm": lambda: solve(ROBOT, 0.714, gravity, start=sharp, accuracy=1e-9),
    }
    t = medians(cases)
    plan = once(lambda: plan_follow_leader(ROBOT, 0.7, gravity), 7)
    plain = once(lambda: scipy_solve(ROBOT, 0.7, gravity), 3)
    scaled = once(lambda: scipy_solve(ROBOT, 0.7, gravity, scaled=True), 5)
    started = fresh_process("import tendonrod")
    errors = np.linalg.norm(start.tip - exact), np.linalg.norm(scipy_solve(ROBOT, 0.7, gravity) - exact)

    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, NumPy {np.__version__},")
    print(f"SciPy {scipy.__version__}, Numba {numba.__version__}, tendonrod {tendonrod.__version__}")
    print(f"tip error: solve {1e9 * errors[0]:.0f} nm, plain SciPy {1e9 * errors[1]:.0f} nm\n")
    for name, value in t.items():
        print(f"{name:34s} {1e6 * value:10.1f} us")
    print(f"{'20-step plan, tension free':34s} {1e3 * plan:10.1f} ms")
    print(f"{'plain SciPy':34s} {1e3 * plain:10.1f} ms")
    print(f"{'SciPy with scaled unknowns':34s} {1e3 * scaled:10.1f} ms")
    print(f"{'import tendonrod':34s} {1e3 * started:10.1f} ms\n")
    loaded, public, fine = t["compiled, loaded"], t["solve, loaded"], t["solve, loaded, 1 nm"]
    ratios = [
        ("compiled solve, times faster than plain SciPy", plain / loaded, ">= 20000"),
        ("public solve, times faster than plain SciPy", plain / public, ">= 10000"),
        ("public solve, times faster than SciPy with scaled unknowns", scaled / public, ""),
        ("whole plan, times faster than one plain SciPy solve", plain / plan, ">= 20"),
        ("no load / loaded, compiled", t["compiled, no load"] / loaded, "<= 0.2"),
        ("no load / loaded, public solve", t["solve, no load"] / public, ""),
        ("warm / cold, tension +2 %, public solve", t["solve, warm, tension +2 %"] / public, "<= 0.4"),
        ("warm / cold, insertion -2 %, public solve", t["solve, warm, insertion -2 %"] / public, "<= 0.4"),
        ("warm / cold, tension +2 %, at 1 nm", t["solve, warm, tension +2 %, 1 nm"] / fine, ""),
        ("80 / 40 steps", t["compiled, 80 steps"] / t["compiled, 40 steps"], "about 2"),
        ("160 / 80 steps", t["compiled, 160 steps"] / t["compiled, 80 steps"], "about 2"),
    ]
    for name, value, target in ratios:
        print(f"{name:60s} {value:10.3g}   {target}")


if __name__ == "__main__":
    main()
