"""A fault campaign on the virtual bench: short trials, in each of which one thing goes wrong at a random time.

    python benchmarks/bench_faults.py [TRIALS] [SEED]      # 1000 trials of seed 1 by default, in two processes
    python benchmarks/bench_faults.py --only 51 1          # one item of seed 1, in full

Item i of a seed depends on (seed, i) alone; its case is number i modulo the number of cases (`_fault_cases.CASES`). It
is a follow-the-leader insertion of 7 % of exonav-1 (homogenized torsion, gravity along -x) from a random insertion of 5
to 20 %, under a profile of 0.2 to 0.85 N unless the case needs another, on the bench's defaults but for a lead screw
six times faster, to save time, and a tracker without natural bursts of lost frames, which are a fault themselves. The
fault comes at a random time of going to the start, taking up the tendon or inserting, for good or for one to two
seconds.

What must hold in every trial:

- The true tension is never above its limit by more than one period's worth: what the fastest motion of both axes in one
  period and the load cell's delay, and the ways on which they brake, could add on the bare tendon.
- The fault is found, as what it is, within the time that `tendonrod.rig.detection.DETECTION` states, after the first
  period that can show it. What shows later by its nature says so in `_fault_cases`.
- The trial ends within 40 s of the bench's time, all axes stand, and the tendon is slack. It may keep its tension after
  an emergency stop, which is what that is for, and where the screw itself is what failed.
- The record is complete. Where the process is killed, what is on the disk must open without damage and end less than
  0.2 s (real time) before; the axes must stop by their own time-out, and a second session must slacken the tendon.

An axis that runs away obeys a hard stop alone, which takes the power from its motor's bridge. A bridge that conducts
for good cannot be stopped by any software; only a switch in its supply can.

The exit status is 0 if everything held.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from _bench_trials import GRAVITY, machine, robot, spread
from _fault_cases import CASES
from _fault_result import Result
from _fault_trial import SCREW, known, run, worth
from tendonrod.rig.states import FaultKind
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.setup import VirtualSetup

SHOWN = 20  # trials that are listed


def campaign(count: int, seed: int) -> list[Result]:
    """Results of the items 0 to count - 1, by item."""
    known()
    virtual_bench(VirtualSetup(robot=robot(), gravity=GRAVITY, screw=SCREW), 0)  # compiles, and makes the robot's table
    return sorted(spread(run, [(seed, item) for item in range(count)]), key=lambda each: each.item)


def table(results: list[Result]) -> str:
    """A line per case: how many, found, times beside the bound, highest tension, how they ended."""
    head = f"{'case':30s}{'trials':>7s}{'found':>7s}{'median':>9s}{'worst':>9s}{'bound':>9s}{'highest':>9s}"
    lines = [f"{head}  ended", f"{'':44s}{'(ms)':>9s}{'(ms)':>9s}{'(ms)':>9s}{'(N)':>9s}"]
    for case in CASES:
        of = [each for each in results if each.case == case]
        if of:
            lines.append(_line(case, of))
    return "\n".join(lines)


def _line(case: str, of: list[Result]) -> str:
    times = np.array([each.found for each in of if each.found == each.found])
    worst = max(of, key=lambda each: each.found / each.bound if each.found == each.found else np.inf)
    median = f"{1e3 * np.median(times):9.1f}" if times.size else f"{'-':>9s}"
    ended = {how: sum(each.ended == how for each in of) for how in ("slack", "held", "moving")}
    said = ", ".join(f"{how} {n}" for how, n in ended.items() if n)
    numbers = f"{median}{1e3 * worst.found:9.1f}{1e3 * worst.bound:9.1f}{max(each.peak for each in of):9.3f}"
    return f"{case:30s}{len(of):7d}{times.size:7d}{numbers}  {said}"


def report(results: list[Result], seed: int, seconds: float) -> str:
    """Everything that is to be said of a campaign."""
    bad, kinds = [each for each in results if each.wrong], {name for each in results for name in each.kinds}
    first, bench_time = results[0], sum(each.duration for each in results)
    lines = [
        f"{len(results)} trials of seed {seed} in {seconds:.0f} s; {bench_time:.0f} s of bench time",
        table(results),
        "worst and bound: of the trial that came nearest to its own bound; process killed: until all axes stand",
        f"tension limit {first.limit:.3f} N, with one period's worth {first.limit + _worth():.3f} N",
        f"highest tension {max(each.peak for each in results):.3f} N",
        f"longest trial {max(each.duration for each in results):.1f} s of bench time",
        f"kinds of faults found: {len(kinds)} of {len(FaultKind)}",
    ]
    lines += [f"item {each.item}, {each.case}: {'; '.join(each.wrong)}" for each in bad[:SHOWN]]
    lines += [f"and {len(bad) - SHOWN} more"] * (len(bad) > SHOWN)
    return "\n".join([*lines, f"{len(bad)} trials in which something is not as it should be"])


def _worth() -> float:
    return worth(VirtualSetup(robot=robot(), gravity=GRAVITY, screw=SCREW))


def main(arguments: list[str] | None = None) -> int:
    """Run the campaign; 0 if everything held."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("count", nargs="?", type=int, default=1000)
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("--only", action="store_true", help="COUNT is the number of an item: show that one in full")
    given = parser.parse_args(arguments)
    if given.only:
        result = run((given.seed, given.count))
        print("\n".join(f"{name} = {getattr(result, name)}" for name in result.__dataclass_fields__))
        return 1 if result.wrong else 0
    print(machine(), flush=True)
    began = time.perf_counter()
    results = campaign(given.count, given.seed)
    print(report(results, given.seed, time.perf_counter() - began))
    return 1 if any(each.wrong for each in results) else 0


if __name__ == "__main__":
    sys.exit(main())
