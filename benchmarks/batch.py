"""How fast `solve_batch` is, and what a second thread brings, measured within one run.

    python benchmarks/batch.py

Problems: exonav-1 at tensions from 0 to 1 N under gravity in random directions, position error at most 1 um, unless a
row says otherwise. Rounds with one and two threads and a Python loop over `solve` take turns, so that drift of the
machine meets all alike. Two threads can be twice as fast only while two cores are free: ``cores`` is what they got,
processor time over wall time, in their best round.
"""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numba
import numpy as np

import tendonrod
from tendonrod.statics.batch import solve_batch

ROBOT = tendonrod.load_robot("exonav-1")
ROUNDS, ITEMS, LOOP = 40, 2000, 1000


@dataclass
class Times:
    """Wall time (s) per item of every round, and processor time over wall time."""

    wall: list[float] = field(default_factory=list)
    cores: list[float] = field(default_factory=list)

    def take(self, call: Callable[[], object], items: int) -> None:
        used, start = time.process_time(), time.perf_counter()
        call()
        wall = time.perf_counter() - start
        self.wall.append(wall / items)
        self.cores.append((time.process_time() - used) / wall)


def loop(loads: dict[str, np.ndarray]) -> None:
    for i in range(LOOP):
        tendonrod.solve(ROBOT, **{name: values[i] for name, values in loads.items()})


def measure(loads: dict[str, np.ndarray], **more) -> tuple[Times, Times, Times]:
    one, two, single = Times(), Times(), Times()
    solve_batch(ROBOT, **loads, **more)
    for _ in range(ROUNDS):
        one.take(lambda: solve_batch(ROBOT, **loads, **more, threads=1), ITEMS)
        two.take(lambda: solve_batch(ROBOT, **loads, **more, threads=2), ITEMS)
        single.take(lambda: loop(loads), LOOP)
    return one, two, single


def main() -> None:
    rng = np.random.default_rng(0)
    gravity = rng.normal(size=(ITEMS, 3))
    gravity *= 9.81 / np.linalg.norm(gravity, axis=1, keepdims=True)
    pulled = {"tensions": rng.uniform(0.0, 1.0, ITEMS)}
    loaded = pulled | {"gravity": gravity}
    cases: dict[str, tuple[dict[str, np.ndarray], dict]] = {
        "loaded": (loaded, {}),
        "loaded, 50 points": (loaded, {"points": 50}),
        "loaded, 1 nm": (loaded, {"accuracy": 1e-9}),
        "no load": (pulled, {}),
    }
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, NumPy {np.__version__},")
    print(f"Numba {numba.__version__}, tendonrod {tendonrod.__version__}; {ITEMS} items, {ROUNDS} rounds\n")
    print("                        items/s, best        two threads / one           cores of   one thread /")
    print("                        one        two       best    median    target    two        Python loop")
    for name, (loads, more) in cases.items():
        one, two, single = measure(loads, **more)
        best = min(one.wall) / min(two.wall)
        median = statistics.median(a / b for a, b in zip(one.wall, two.wall, strict=True))
        against = min(single.wall) / min(one.wall) if not more else float("nan")
        target = ">= 1.8" if name.startswith("loaded") else ""
        print(
            f"{name:20s} {1.0 / min(one.wall):10.0f} {1.0 / min(two.wall):10.0f} {best:10.2f} {median:9.2f}"
            f"    {target:8s} {two.cores[int(np.argmin(two.wall))]:5.2f} {against:14.2f}"
        )


if __name__ == "__main__":
    main()
