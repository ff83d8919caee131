"""How fast a session steps, free and in contact, and whether an hour of it leaves memory flat.

    python benchmarks/navigation.py [--steps N] [--random N] [--phantom NAME]... [--soak SECONDS]

ExoNav 1 is steered at 200 steps per second of the session. "free": inserted at 0.4 N through the dorsal space.
"contact": at 0.7 N, wound onto cord or dura, then jogged in and out and round there, so that every step solves contact.
"random": keys pressed at random, more often inwards than outwards, at the page's 60 steps per second, and of these the
steps in which a move was refused, each with the share of steps that took more than 16.7, 50 and 100 ms.
Times of a step are told as wall time and as this thread's own CPU time, which other load on the machine changes less. A
step is all that `Session.step` does: statics with gravity and contact, clearances, pressures, gauges; no record, no
page.

--soak: seconds of a session, 3600 for an hour, at 200 steps per second without a pause: in and out of contact again and
again, recorded to a file and measured, while the memory of the process is looked at. The exit status is 1 where memory
still grows after the first tenth, by more than 4 MB.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import cycle
from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import tendonrod
from tendonrod.navigate.commands import Jog, Rates
from tendonrod.navigate.metrics import Meter
from tendonrod.navigate.record import SessionRecord
from tendonrod.navigate.scenario import Scenario, load_scenario
from tendonrod.navigate.session import Session

STEP = 5e-3  # s
PULL, PUSH, BACK = Jog(tension=0.1), Jog(insertion=3e-3), Jog(insertion=-3e-3)
TURN, RETURN, EASE = Jog(rotation=radians(20)), Jog(rotation=radians(-20)), Jog(tension=-0.1)
Part = tuple[Jog, float]  # for how long, s
ROUND = ((PUSH, 0.25), (TURN, 0.5), (BACK, 0.25), (RETURN, 0.5))
TOUR = ((PULL, 6.0), (PUSH, 8.0), (TURN, 0.5), (RETURN, 1.0), (TURN, 0.5), (Jog(), 1.0), (BACK, 8.2), (EASE, 6.2))
FRAME, OVER = 1.0 / 60.0, (16.7, 50.0, 100.0)  # s; ms
GROWTH = 4.0  # MB after the first tenth
LOOKS = 60  # at the memory
MIDLINE = {"offset": 0.0, "tilt": radians(21), "lean": 0.0}  # an outer tube from which the robot winds onto the cord
DEPTH = {"printed": 5.7375e-3, "anatomical": 8.625e-3}  # m, the middle of the dorsal gap
PERCENTILES = (50, 90, 99, 100)


def jogs(parts: Sequence[Part], forever: bool = False) -> Iterator[Jog]:
    """One jog per step."""
    for jog, seconds in cycle(parts) if forever else parts:
        yield from [jog] * round(seconds / STEP)


def pressing(phantom: str) -> Scenario:
    """A scenario in which the robot meets walls."""
    depth = {"depth": DEPTH[phantom]} if phantom in DEPTH else {}
    return load_scenario(phantom=phantom, tube=MIDLINE | depth)


def timed(session: Session, steps: int, parts: Sequence[Part]) -> np.ndarray:
    """(steps, 3) wall time (s), CPU time (s), and how many places touched, of each step that moved the robot."""
    rows = []
    for jog in jogs(parts, forever=True):
        wall, cpu = time.perf_counter(), time.thread_time()
        shown = session.step(jog, STEP)
        rows.append((time.perf_counter() - wall, time.thread_time() - cpu, len(shown.contact_pressure)))
        if len(rows) == steps:
            return np.array(rows)
    raise AssertionError


def keys(rng: np.random.Generator) -> Iterator[Jog]:
    """Of a page on which keys are pressed at random, each choice for 0.2 to 1 s."""
    while True:
        way = rng.choice([-1, 0, 1], size=3, p=[0.25, 0.25, 0.5])
        turn = rng.choice([-1, 1]) * way[1]
        jog = Rates().jog(float(way[0]), float(turn), float(way[2]))
        yield from [jog] * int(rng.integers(12, 61))


def wander(name: str, scenario: Scenario, steps: int) -> None:
    """Two lines: of all steps, and of those refused."""
    session, times, refused = Session(scenario), np.empty(steps), np.empty(steps, bool)
    for k, jog in zip(range(steps), keys(np.random.default_rng(0)), strict=False):
        begun = time.perf_counter()
        refused[k] = bool(session.step(jog, FRAME).blocked)
        times[k] = 1e3 * (time.perf_counter() - begun)
    for what, some in (("all", times), ("refused", times[refused])):
        median, high, most = np.percentile(some, [50, 99, 100])
        over = "  ".join(f"{100.0 * np.mean(some > limit):5.2f} % > {limit:.3g} ms" for limit in OVER)
        print(f"{name:22}{what:8}{some.size:6} steps, {median:5.2f} {high:6.1f} {most:6.1f} ms; {over}")


def report(name: str, rows: np.ndarray) -> None:
    """One line."""
    touching = 100.0 * np.mean(rows[:, 2] > 0)
    wall, cpu = (1e3 * np.percentile(rows[:, k], PERCENTILES) for k in (0, 1))
    shown = ["  ".join(f"{each:6.2f}" for each in times) for times in (wall, cpu)]
    rates = "".join(f"{1.0 / rows[:, k].mean():8.0f}" for k in (0, 1))
    print(f"{name:22}{rates}{touching:7.0f}   {shown[0]}   {shown[1]}")


def speed(phantoms: Sequence[str], steps: int) -> None:
    """Free and in contact, in each phantom."""
    parts = "    50 %    90 %    99 %     max"
    print(f"{'':25}steps/s    touching   ms per step, wall {'':15}CPU")
    print(f"{'':24}wall     CPU      %{parts}{parts}")
    for phantom in phantoms:
        scenario = pressing(phantom)
        free, bound = Session(scenario), Session(scenario)
        for jog in jogs([(PULL, 4.0), (PUSH, 1.0)]):
            free.step(jog, STEP)
        report(f"{phantom}, free", timed(free, steps, [(PUSH, 2.0), (BACK, 2.0)]))
        for jog in jogs([(PULL, 7.0), (PUSH, 8.0)]):
            bound.step(jog, STEP)
        report(f"{phantom}, contact", timed(bound, steps, ROUND))


def memory() -> float:
    """Of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def soak(phantom: str, seconds: float) -> bool:
    """Steer for so long; whether memory stayed flat."""
    count, begun, looks = round(seconds / STEP), time.monotonic(), []
    with TemporaryDirectory() as folder:
        path, meter = Path(folder) / "soak.jsonl", Meter()
        session = Session(pressing(phantom), record=SessionRecord(path))
        for k, jog in enumerate(jogs(TOUR, forever=True)):
            if k % max(1, count // LOOKS) == 0:
                looks.append(memory())
                told = f"{k * STEP:7.0f} s of the session, {time.monotonic() - begun:6.0f} s passed"
                print(f"{told}, {looks[-1]:7.1f} MB, record {path.stat().st_size / 1e6:6.1f} MB", flush=True)
            if k == count:
                break
            meter.add(session.step(jog, STEP))
        session.close()
    found = meter.metrics()
    settled = looks[LOOKS // 10 :]
    growth = max(settled) - settled[0]
    print(f"{count} steps, {count / (time.monotonic() - begun):.0f} per second; path {found.path:.2f} m,", end=" ")
    print(f"blocked {100 * found.blocked:.2g} % of the time; memory grew by {growth:.1f} MB after the first tenth")
    return growth <= GROWTH


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Steps per second of a session.")
    parser.add_argument("--steps", type=int, default=600, help="measured in each case")
    parser.add_argument("--phantom", action="append", help="printed and anatomical if left out")
    parser.add_argument("--random", type=int, default=5000, help="steps with keys pressed at random")
    parser.add_argument("--soak", type=float, metavar="SECONDS", help="of a session, in place of the speed")
    asked = parser.parse_args()
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    versions = f"tendonrod {tendonrod.__version__}, Python {platform.python_version()}, NumPy {np.__version__}"
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {load}; {versions}\n")
    phantoms = asked.phantom or ["printed", "anatomical"]
    if asked.soak is not None:
        return 0 if soak(phantoms[0], asked.soak) else 1
    speed(phantoms, asked.steps)
    print(f"\n{'keys at random':42}median   99 %    max")
    for phantom in phantoms:
        wander(phantom, pressing(phantom), asked.random)
    return 0


if __name__ == "__main__":
    sys.exit(main())
