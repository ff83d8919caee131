"""A stress campaign: random problems, each of which must pass the balance check or say why it has no answer.

    python benchmarks/campaign.py [COUNT] [SEED]        # 100000 problems of seed 1 by default, on all cores
    python benchmarks/campaign.py 1000 1 --list         # name every item that is not as it should be, not only some
    python benchmarks/campaign.py --only 4711 1         # one item of seed 1, in full

Item i of a seed depends on (seed, i) alone. It is

- a preset, each with the same chance, with inner radius, wall thickness, length, notch width and notch spacing times
  0.8 to 1.2, each for itself; uncut angle psi 60 to 200 degrees; -2 to 2 turns; any of the three torsion models,
- inserted by 0 to 1; one in a hundred is 0 and one in a hundred is 1 exactly,
- under a tension from 0 to that at which the robot, without load, strains by the superelastic plateau's 0.67 %,
- under its weight, gravity in any direction (not of its tendon, which weighs nothing),
- and a force at the tip in any direction, from 0 to 0.9 of Euler's load of the exposed length, clamped and free, with
  the softer bending stiffness. Where very little is exposed that load would crush the section: it is no more than
  strains the section by the plateau's 0.67 %.

All numbers are uniform within their range, directions on the sphere. The plateau's tension is found by two steps of
rule of three from 1 N, which is within 1 % of `tension_limits`.

Each is solved at the default accuracy. A silent failure is a shape that says it converged and has a balance error
above 1e-5 (`tendonrod.statics.balance`), or one that did not converge and gives no reason, or an exception. The exit
status is 0 if there is none and at least 99.99 % converge.
"""

from __future__ import annotations

import argparse
import os
import platform
import signal
import sys
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from functools import cache

import numpy as np

import tendonrod
from tendonrod import Robot, Shape, solve
from tendonrod.statics.balance import balance_errors
from tendonrod.statics.limits import PLATEAU_STRAIN, euler_loads, fibre_strain
from tendonrod.statics.shape import Status

TOLERANCE = 1e-5  # of the balance error
CONVERGING = 0.9999  # share that must
CHUNK = 250  # items that a process takes at once
SHOWN = 20  # items of a kind that are listed unless all are asked for
QUANTILES = (0.5, 0.9, 0.99, 0.999, 1.0)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One item: what is given to `solve`; SI units."""

    robot: Robot
    tension: float
    gravity: tuple[float, ...]
    tip_force: tuple[float, ...]
    insertion: float

    def solve(self, **more) -> Shape:
        """Its shape, converged or not."""
        given = {"gravity": self.gravity, "tip_force": self.tip_force, "insertion": self.insertion}
        return solve(self.robot, self.tension, **given, throw=False, **more)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What came of an item: "passed", "reported" with its cause, or "silent"; cause is empty where it passed."""

    item: int
    kind: str
    cause: str = ""
    error: float = np.nan
    stable: bool = True
    seconds: float = 0.0


@cache
def presets() -> tuple[Robot, ...]:
    """The robots that the campaign varies."""
    return tuple(tendonrod.load_robot(name) for name in tendonrod.preset_names())


def problem(seed: int, item: int) -> Problem:
    """Item ``item`` of ``seed``, by the distribution in the docstring above."""
    rng = np.random.default_rng((seed, item))
    robot = presets()[rng.integers(len(presets()))]
    size = robot.parameters()
    inner, wall, length, width, spacing = rng.uniform(0.8, 1.2, 5)
    inner *= size["inner_radius"]
    robot = robot.replace(
        inner_radius=inner,
        outer_radius=inner + wall * (size["outer_radius"] - size["inner_radius"]),
        length=length * size["length"],
        notch_width=width * size["notch_width"],
        notch_spacing=spacing * size["notch_spacing"],
        uncut_angle=np.deg2rad(rng.uniform(60.0, 200.0)),
        turns=rng.uniform(-2.0, 2.0),
        torsion=str(rng.choice(["published", "open_section", "homogenized"])),
    )
    insertion = float(np.clip(rng.uniform(-0.01, 1.01), 0.0, 1.0))
    down, push = (each / np.linalg.norm(each) for each in rng.normal(size=(2, 3)))
    euler = euler_loads(robot)[0] / max(insertion, 1e-9) ** 2
    strongest = min(0.9 * euler, PLATEAU_STRAIN * robot.section.Kse[2])
    return Problem(
        robot=robot,
        tension=rng.uniform(0.0, plateau_tension(robot)),
        gravity=tuple((9.81 * down).tolist()),
        tip_force=tuple((rng.uniform(0.0, strongest) * push).tolist()),
        insertion=insertion,
    )


def plateau_tension(robot: Robot) -> float:
    """Tension (N) that strains the robot by the plateau's strain, to 1 %: the strain is nearly proportional to it."""
    tension = 1.0
    for _ in range(2):
        tension *= PLATEAU_STRAIN / fibre_strain(solve(robot, tension, steps=1)).max()
    return float(tension)


def examine(seed: int, item: int, tolerance: float) -> Outcome:
    """Solve an item and check it."""
    asked = problem(seed, item)
    start = time.perf_counter()
    try:
        shape = asked.solve()
        seconds = time.perf_counter() - start
        if not shape.converged:
            known = isinstance(shape.status, Status) and np.isnan(shape.position).all()
            cause = f"{shape.status}; reached {100 * shape.load_factor:.3g} % of the load"
            return Outcome(item=item, kind="reported" if known else "silent", cause=cause, seconds=seconds)
        errors = balance_errors(shape)
        error, stable = errors.largest, shape.stable is not False
    except Exception as failure:  # noqa: BLE001 - whatever it is, it is a failure to be listed
        return Outcome(item=item, kind="silent", cause=f"{type(failure).__name__}: {failure}")
    if error <= tolerance:
        return Outcome(item=item, kind="passed", error=error, stable=stable, seconds=seconds)
    parts = {name: getattr(errors, name) for name in errors.__dataclass_fields__}
    worst = max(parts, key=lambda name: np.nan_to_num(parts[name].error, nan=np.inf))
    where = f"{worst} error {parts[worst].error:.3g} at s = {1e3 * parts[worst].s:.4g} of {1e3 * shape.length:.4g} mm"
    return Outcome(item=item, kind="silent", cause=where, error=error, stable=stable, seconds=seconds)


def examine_chunk(seed: int, items: range, tolerance: float) -> list[Outcome]:
    """Outcomes of some items, in one process."""
    return [examine(seed, item, tolerance) for item in items]


@dataclass
class Tally:
    """Outcomes so far."""

    seed: int
    count: int
    outcomes: list[Outcome] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)

    def of(self, kind: str) -> list[Outcome]:
        """Those of a kind, by item."""
        return sorted((each for each in self.outcomes if each.kind == kind), key=lambda each: each.item)

    @property
    def converged(self) -> int:
        """How many converged, whether or not they pass."""
        return sum(not np.isnan(each.error) for each in self.outcomes)

    @property
    def is_good(self) -> bool:
        """Whether the criteria are met by all items."""
        complete = len(self.outcomes) == self.count > 0
        return complete and not self.of("silent") and self.converged >= CONVERGING * self.count

    def progress(self) -> str:
        """One line on how far it is."""
        done, elapsed = len(self.outcomes), time.perf_counter() - self.began
        rate = max(1, done) / max(elapsed, 1e-9)
        left = f"{done} of {self.count}, {rate:.0f} per second, {(self.count - done) / rate:.0f} s left"
        return f"{left}; {len(self.of('reported'))} not converged, {len(self.of('silent'))} silent failures"

    def report(self, everything: bool) -> str:
        """All that is known of the items done."""
        done, elapsed = len(self.outcomes), time.perf_counter() - self.began
        if not done:
            return "nothing done"
        reported, silent, unstable = self.of("reported"), self.of("silent"), sum(not o.stable for o in self.outcomes)
        lines = [
            f"{done} of {self.count} problems of seed {self.seed} in {elapsed:.0f} s, {os.cpu_count()} cores",
            f"tendonrod {tendonrod.__version__}, Python {platform.python_version()}, NumPy {np.__version__}",
            f"converged {self.converged} ({100 * self.converged / done:.4f} %), not converged {len(reported)}",
            f"silent failures {len(silent)}, unstable equilibria {unstable}",
        ]
        checked = [each for each in self.outcomes if not np.isnan(each.error)]
        if checked:
            errors, times = (np.array([getattr(each, name) for each in checked]) for name in ("error", "seconds"))
            worst = checked[int(errors.argmax())]
            lines.append(f"largest balance error {worst.error:.2e}, item {worst.item}; quantiles {_quantiles(errors)}")
            lines.append(f"time of a solve (s): {_quantiles(times)}")
        for found, title in ((reported, "not converged"), (silent, "silent failure")):
            shown = found if everything else found[:SHOWN]
            lines += [f"{title}: item {each.item} of seed {self.seed}: {each.cause}" for each in shown]
            lines += [f"... and {len(found) - len(shown)} more (--list)"] * (len(found) > len(shown))
        return "\n".join([*lines, "criteria met" if self.is_good else "criteria NOT met"])


def campaign(count: int, seed: int, tolerance: float = TOLERANCE) -> Iterator[Tally]:
    """The tally, after every chunk of items; on as many processes as there are cores."""
    tally, chunks = Tally(seed=seed, count=count), [range(a, min(a + CHUNK, count)) for a in range(0, count, CHUNK)]
    plateau_tension(presets()[0])  # compiles the kernel once, before the processes start
    with ProcessPoolExecutor(min(os.cpu_count() or 1, max(1, len(chunks))), initializer=_ignore_interrupts) as pool:
        pending = {pool.submit(examine_chunk, seed, chunk, tolerance) for chunk in chunks}
        try:
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    tally.outcomes += future.result()
                yield tally
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def describe(seed: int, item: int) -> str:
    """An item in full: what is asked, and every part of the balance error of its shape."""
    asked, lines = problem(seed, item), []
    lines += [f"{name} = {value:.9g}" for name, value in asked.robot.parameters().items()]
    lines.append(f"{asked.robot.name}, torsion {asked.robot.torsion}, L_na = {asked.robot.length_na:.9g} m")
    lines.append(f"tension {asked.tension!r}, insertion {asked.insertion!r}")
    lines.append(f"gravity {asked.gravity}, tip force {asked.tip_force}")
    for accuracy in (1e-6, 1e-10):
        shape = asked.solve(accuracy=accuracy)
        errors = balance_errors(shape)
        parts = {name: getattr(errors, name).error for name in errors.__dataclass_fields__}
        lines.append(f"accuracy {accuracy:.0e}: {shape!r}, {shape.steps} steps, stable {shape.stable}: {shape.status}")
        lines.append("  " + ", ".join(f"{name} {error:.2e}" for name, error in parts.items()))
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign; 0 if the criteria are met."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("count", nargs="?", type=int, default=100_000)
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="list every item that failed, not only some")
    parser.add_argument("--only", action="store_true", help="COUNT is the number of an item: show that one in full")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="largest balance error allowed")
    given = parser.parse_args(arguments)
    if given.only:
        print(describe(given.seed, given.count))
        return 0
    tally, shown = Tally(seed=given.seed, count=given.count), -np.inf
    try:
        for tally in campaign(given.count, given.seed, given.tolerance):
            if time.perf_counter() - shown > 5.0:
                shown = time.perf_counter()
                print(tally.progress(), file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
    print(tally.report(given.list))
    return 0 if tally.is_good else 1


def _quantiles(values: np.ndarray) -> str:
    return ", ".join(f"{100 * q:g} % {v:.2e}" for q, v in zip(QUANTILES, np.quantile(values, QUANTILES), strict=True))


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    sys.exit(main())
