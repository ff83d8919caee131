"""How regular the control loop is in real time at 200 Hz, on an idle and on a loaded machine.

    python benchmarks/bench_periods.py [--seconds S] [--rate HZ]

The virtual bench in step with real time inserts exonav-1 at 0.5 N by the paper's loop, whose integral takes the
measured dt, and records: for 20 s as the machine is, and for 20 s beside one process per core that computes without a
pause; both once more with the system's real-time priority (SCHED_FIFO), where it is allowed, which also shows what the
loop does on a machine that others use. A period is the time between two samples, as the record has it.

The fault for late periods in a row is switched off, so that the distribution is seen to its end; the longest such row
is printed beside what the interlock allows, and whatever else ended a run. The world's own computing is part of
every period here; on devices a board does that, and waits for nobody.

The exit status is 1 where fewer than 99 % of the periods of the first run are within 20 % and the machine was idle
before it (load below a quarter of its cores): on a busy machine the numbers say how busy it was.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import groupby, product
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from _bench_trials import GRAVITY, machine, robot
from tendonrod.rig.benches import VirtualSource
from tendonrod.rig.drives import Machine
from tendonrod.rig.interfaces import Command, Sample
from tendonrod.rig.limits import Limits
from tendonrod.rig.profiles import Cubics, Profile
from tendonrod.rig.tasks import FollowLeader, Phase
from tendonrod.rig.trials import run
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.setup import VirtualSetup, lead_screw

TENSION = 0.5  # N
SCREW = lead_screw(speed=3e-3, acceleration=30e-3, braking=0.1)  # fast, for the way to the start
SCREW_RATE = 0.45e-3  # m/s, the usual one
WITHIN = 0.2  # of the period
ASKED = 0.99  # share of the periods, idle
PERCENTILES = (0.1, 1.0, 50.0, 99.0, 99.9)
NEVER = 10**6  # late periods in a row


@dataclass(frozen=True, kw_only=True)
class Run:
    """Times between samples (n,) s; tension errors (m,) N while inserting; how it ended."""

    name: str
    period: float
    periods: np.ndarray
    errors: np.ndarray
    ended: str

    @property
    def regular(self) -> float:
        """Share of the periods within 20 %."""
        return float(np.mean(np.abs(self.periods - self.period) <= WITHIN * self.period))

    @property
    def late_in_row(self) -> int:
        """Longest row of periods that the interlock calls late."""
        late = self.periods > Limits().late_share * self.period
        return max((len(list(row)) for is_late, row in groupby(late) if is_late), default=0)

    def __str__(self) -> str:
        shares = ", ".join(f"{q:g} %: {1e3 * each:.2f}" for q, each in self._percentiles())
        errors = 1e3 * self.errors if self.errors.size else np.array([np.nan])
        rms, largest = np.sqrt(np.mean(errors**2)), np.abs(errors).max()
        return "\n".join(
            [
                f"{self.name}: {self.periods.size} periods of {1e3 * self.period:g} ms, {self.ended}",
                f"  within {100 * WITHIN:.0f} %: {100 * self.regular:.2f} %",
                f"  percentiles (ms): {shares}; largest {1e3 * self.periods.max():.2f}",
                f"  late in a row: {self.late_in_row} at most, fault at {Limits().late_in_row}",
                f"  tension error, inserting: rms {rms:.1f} mN, largest {largest:.1f} mN of {1e3 * TENSION:g} mN",
            ]
        )

    def _percentiles(self) -> Iterator[tuple[float, float]]:
        return zip(PERCENTILES, np.percentile(self.periods, PERCENTILES).tolist(), strict=True)


class Timed(FollowLeader):
    """An insertion that is done after ``seconds``, wherever it is."""

    seconds, spent = 20.0, 0.0

    def update(self, sample: Sample, dt: float) -> Command:
        self.spent += dt
        return super().update(sample, dt)

    @property
    def is_done(self) -> bool:
        return super().is_done or self.spent >= self.seconds


def measured(name: str, seconds: float, rate: float) -> Run:
    """One run in real time."""
    setup = VirtualSetup(robot=robot(), gravity=GRAVITY, screw=SCREW)
    source = VirtualSource(setup=setup, real_time=True, limits={"late_in_row": NEVER})
    along = Profile(name="constant", tension=Cubics([0.0, 1.0], [TENSION, TENSION]))

    def make(known: Machine) -> Timed:
        task = Timed(along, known, screw_rate=SCREW_RATE)
        task.seconds = seconds
        return task

    with TemporaryDirectory() as folder:
        done = run(source, make, Path(folder) / "periods.rec", rate=rate)
        time, running = done.record.time, done.record.states == "running"
    gaps = np.diff(time)[running[1:] & running[:-1]]
    return Run(
        name=name, period=1.0 / rate, periods=gaps, errors=done.tension_error(Phase.INSERT), ended=str(done.outcome)
    )


@contextmanager
def busy() -> Iterator[None]:
    """A process per core that computes all the time."""
    context = get_context("spawn")
    others = [context.Process(target=_compute, daemon=True) for _ in range(os.cpu_count() or 1)]
    for each in others:
        each.start()
    try:
        yield
    finally:
        for each in others:
            each.terminate()
            each.join()


@contextmanager
def real_time_priority(wanted: bool) -> Iterator[bool]:
    """Run before all processes of usual priority, if ``wanted``; whether it is as wanted."""
    is_allowed = wanted and _scheduled("SCHED_FIFO", 1)
    try:
        yield is_allowed == wanted
    finally:
        if is_allowed:
            _scheduled("SCHED_OTHER", 0)


def _scheduled(policy: str, priority: int) -> bool:
    try:
        os.sched_setscheduler(0, getattr(os, policy), os.sched_param(priority))
    except (PermissionError, AttributeError):
        return False
    return True


def _compute() -> None:
    x = 0
    while True:
        x = (x * 1103515245 + 12345) % 2147483648


def main(arguments: list[str] | None = None) -> int:
    """Measure and print both runs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rate", type=float, default=200.0)
    given = parser.parse_args(arguments)
    print(machine(), flush=True)
    idle_before = os.getloadavg()[0] < 0.25 * (os.cpu_count() or 1)
    virtual_bench(VirtualSetup(robot=robot(), gravity=GRAVITY, screw=SCREW), 0)  # makes the robot's table
    runs = []
    for (name, load), wanted in product((("as it is", nullcontext), ("loaded", busy)), (False, True)):
        with load(), real_time_priority(wanted) as is_so:
            if not is_so:
                print(f"{name}: real-time priority is not allowed here")
                continue
            said = f"{name}, real-time priority" if wanted else name
            runs.append(measured(said, given.seconds, given.rate))
        print(runs[-1], flush=True)
    print(f"{100 * ASKED:.0f} % asked on an idle machine; it was {'idle' if idle_before else 'NOT idle'} before")
    return 1 if idle_before and runs[0].regular < ASKED else 0


if __name__ == "__main__":
    sys.exit(main())
