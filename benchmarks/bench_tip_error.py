"""A map: how far the tip strays in follow-the-leader trials on the virtual bench, over friction and tracker mass.

    python benchmarks/bench_tip_error.py [--output FIGURE.png] [--rate HZ] [--seed N]

exonav-1 (homogenized torsion) follows the plan for 0.7 N under gravity along -x, on the bench's defaults but for

- the tendon's Coulomb friction, 0 to 0.3: 0.1 to 0.2 is the usual range for steel or nitinol on nitinol (own estimate,
  as the default of 0.1);
- the robot's Coulomb friction in the outer tube, 0 to 0.3 N: 0.16 N is what a coefficient of 0.2 gives on half of the
  robot held straight by the tube, 0.05 N (the default) what it gives at the exit alone (own estimate; the paper names
  this friction as a cause and gives no number);
- the mass of tracker and holder at the tip, 0 to 1 g: own estimates are 0.03 g for a sensor of 0.8 mm by 9 mm and 0.1
  to 0.5 g for a printed holder; the paper names this weight as a cause and gives no number. The default is 0.

The error is that of the tip, seen by the tracker with its noise, on the way out, to the reference: the shape of the
whole robot at 0.7 N without tracker. It is given twice, as distance from the reference curve (projection) and from the
curve's point of the same insertion; the paper does not say which of them its 3.63 to 3.75 mm are. Nothing is fitted and
no default is moved to land on them. A second table says what feed-forward changes, a third what the profiles do.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from _bench_trials import GRAVITY, machine, robot, spread
from tendonrod.errors import TendonrodError
from tendonrod.report.paper import FTL_TIP_RMSE_SIMULATED, FTL_TIP_RMSE_TRIALS
from tendonrod.rig.benches import VirtualSource
from tendonrod.rig.inserted import inserted
from tendonrod.rig.profiles import NAMES, Profile, profile
from tendonrod.rig.trials import follow_leader
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.setup import TrackerModel, VirtualSetup

TARGET = 0.7  # N
FRICTION = (0.0, 0.1, 0.3)
OUTER = (0.0, 0.1, 0.3)  # N
MASS = (0.0, 0.1e-3, 0.25e-3, 0.5e-3, 1e-3)  # kg
DEFAULT = (0.1, 0.05, 0.0)  # friction, outer tube (N), mass (kg)
AHEAD = ((0.0, 0.0, 0.0), DEFAULT, (0.3, 0.3, 0.0), (0.1, 0.05, 0.5e-3))  # with and without feed-forward
LIMITS = {"tension": 1.2, "strain": 0.012}  # N, 1
PAPER = min(FTL_TIP_RMSE_TRIALS), max(FTL_TIP_RMSE_TRIALS)
MEASURES = ("by projection", "at the same insertion")


@dataclass(frozen=True, kw_only=True)
class Asked:
    """One trial: tendon friction, friction in the outer tube (N), mass (kg), feed-forward, profile, rate (Hz), seed."""

    friction: float
    outer: float
    mass: float
    ahead: bool
    rate: float
    seed: int
    profile: str = "plan"

    @property
    def plain(self) -> bool:
        """Whether it is of the map."""
        return not self.ahead and self.profile == "plan"


@dataclass(frozen=True, kw_only=True)
class Found:
    """What came of it: tip RMSE (m) by both measures, rms and largest tension error (N), how it ended."""

    asked: Asked
    rmse: tuple[float, float]
    tension: tuple[float, float]
    ended: str


@cache
def along(name: str) -> Profile:
    """What the trials follow, made once; its tendon paid out, for feed-forward, is that of the bench."""
    setup = VirtualSetup(robot=robot())
    compliance = setup.tendon_length / setup.tendon_stiffness
    return profile(name, robot(), TARGET, gravity=GRAVITY, compliance=compliance)


def setup_of(asked: Asked) -> VirtualSetup:
    """The bench of a trial. The tracker loses no frames, so that all trials see the same ones."""
    return VirtualSetup(
        robot=robot(), gravity=GRAVITY, tendon_friction=asked.friction, outer_friction=asked.outer,
        tracker=TrackerModel(mass=asked.mass, burst_rate=0.0),
    )  # fmt: skip


def source_of(asked: Asked) -> VirtualSource:
    """Its limits are wider than the model's, which refuses 0.7 N where 1 g hangs at the tip and strains the robot."""
    return VirtualSource(setup=setup_of(asked), limits=LIMITS)


def run(asked: Asked) -> Found:
    """One trial."""
    with TemporaryDirectory() as folder:
        options = {"seed": asked.seed, "rate": asked.rate, "feed_forward": asked.ahead}
        source, path = source_of(asked), Path(folder) / "trial.rec"
        try:
            trial = follow_leader(source, along(asked.profile), TARGET, path, **options)
        except TendonrodError as error:
            return Found(asked=asked, rmse=(np.nan, np.nan), tension=(np.nan, np.nan), ended=str(error))
        way = inserted(trial)
    ended = "done" if trial.outcome.is_done else str(trial.outcome.fault)
    return Found(asked=asked, rmse=way.tip_rmse, tension=(way.error_rms, way.error_max), ended=ended)


def jobs(rate: float, seed: int) -> list[Asked]:
    """The grid, the pairs of trials that show feed-forward, and the profiles."""
    grid = [(*place, False) for place in product(FRICTION, OUTER, MASS)]
    more = [(*place, ahead) for place in AHEAD for ahead in (False, True)]
    every = dict.fromkeys([*grid, *more])  # in order, each once
    given = {"rate": rate, "seed": seed}
    found = [Asked(friction=f, outer=o, mass=m, ahead=a, **given) for f, o, m, a in every]
    friction, outer, mass = DEFAULT
    more = [Asked(friction=friction, outer=outer, mass=mass, ahead=False, profile=name, **given) for name in NAMES]
    return list(dict.fromkeys([*found, *more]))


def tables(found: list[Found]) -> str:
    """Both maps, where the paper's errors lie, and what feed-forward changes."""
    of_plan = [each for each in found if each.asked.profile == "plan"]
    at = {_place(each): each for each in of_plan}
    lines = []
    for k, measure in enumerate(MEASURES):
        lines += [f"tip RMSE {measure}, mm", _head()]
        for friction, outer in product(FRICTION, OUTER):
            row = [at[friction, outer, mass, False].rmse[k] for mass in MASS]
            cells = "".join(f"{1e3 * each:9.2f}" for each in row)
            lines.append(f"{friction:8.2f}{outer:9.2f}{cells}   {where_paper_lies(row)}")
    lines += [
        "feed-forward off and on: tip RMSE by projection, at the same insertion (mm); tension error rms, largest (mN)"
    ]
    for place in AHEAD:
        pair = " -> ".join(_numbers(at[(*place, ahead)]) for ahead in (False, True))
        lines.append(f"friction {place[0]:g}, outer tube {place[1]:g} N, {1e3 * place[2]:g} g: {pair}")
    lines.append("profiles at the bench's defaults: the same numbers")
    for name in NAMES:
        (one,) = [each for each in found if each.asked.profile == name and _place(each) == (*DEFAULT, False)]
        lines.append(f"{name}: {_numbers(one)}")
    bad = [f"{each.asked}: {each.ended}" for each in found if each.ended != "done"]
    return "\n".join([*lines, *bad, f"{len(bad)} of {len(found)} trials did not end as they should"])


def _place(found: Found) -> tuple[float, float, float, bool]:
    asked = found.asked
    return asked.friction, asked.outer, asked.mass, asked.ahead


def _head() -> str:
    masses = "".join(f"{f'{1e3 * mass:g} g':>9s}" for mass in MASS)
    return f"{'friction':>8s}{'tube (N)':>9s}{masses}   {1e3 * PAPER[0]:.2f} to {1e3 * PAPER[1]:.2f} mm at"


def _numbers(found: Found) -> str:
    tip, tension = (f"{1e3 * pair[0]:.2f}, {1e3 * pair[1]:.2f}" for pair in (found.rmse, found.tension))
    return f"{tip}; {tension}"


def where_paper_lies(row: list[float]) -> str:
    """Masses at which the paper's smallest and largest error lie, by straight lines between those of the row."""
    places = [_crossings(row, level) for level in PAPER]
    if any(places):
        return " and ".join(", ".join(f"{1e3 * mass:.3f}" for mass in each) or "none" for each in places) + " g"
    return "nowhere: all " + ("above" if np.nanmin(row) > PAPER[1] else "below")


def _crossings(row: list[float], level: float) -> list[float]:
    pairs = zip(zip(MASS, row, strict=True), zip(MASS[1:], row[1:], strict=True), strict=False)
    return [m + (level - a) / (b - a) * (n - m) for (m, a), (n, b) in pairs if (a - level) * (b - level) < 0.0]


def draw(found: list[Found], path: Path) -> None:
    """Left: error over mass, the band that all frictions span. Right: error over frictions, without mass."""
    from tendonrod.plot.style import labelled, new_figure, save, styled, titled

    with styled():
        figure = new_figure(2.9)
        left, right = figure.subplots(1, 2, sharey=False)
        _over_mass(left, found)
        _over_friction(right, found)
        labelled(left, "tracker and holder at the tip (g)", "tip RMSE (mm)")
        labelled(right, "tendon friction", "tip RMSE (mm)")
        titled(left, "a", "mass, over all frictions")
        titled(right, "b", "frictions, without mass")
        figure.tight_layout(w_pad=2.0)
        save(figure, path)


def _over_mass(axes, found: list[Found]) -> None:
    from tendonrod.plot.style import COLOURS, MM

    for k, colour in zip(range(len(MEASURES)), COLOURS, strict=False):
        rows = np.array([[MM * e.rmse[k] for e in _grid(found) if e.asked.mass == mass] for mass in MASS])
        grams = [1e3 * mass for mass in MASS]
        axes.fill_between(grams, rows.min(axis=1), rows.max(axis=1), color=colour, alpha=0.35, lw=0.0)
        axes.plot(grams, rows.mean(axis=1), "o-", color=colour, lw=0.9, label=MEASURES[k])
    axes.set(xlim=(0.0, 1.02), ylim=(0.0, 12.5))
    _paper(axes, 1.0, "right")
    axes.legend(loc="upper left")


def _over_friction(axes, found: list[Found]) -> None:
    from tendonrod.plot.style import COLOURS, MM

    for outer, colour in zip(OUTER, COLOURS[2:], strict=False):
        of = [e for e in _grid(found) if (e.asked.outer, e.asked.mass) == (outer, 0.0)]
        of.sort(key=lambda e: e.asked.friction)
        for k, style in enumerate(("o-", "o--")):
            label = f"outer tube {outer:g} N" if k == 0 else None
            axes.plot([e.asked.friction for e in of], [MM * e.rmse[k] for e in of], style, color=colour, label=label)
    axes.set(xlim=(-0.005, 0.305), ylim=(0.0, 4.2))
    _paper(axes, 0.3, "right")
    note = "solid: by projection\ndashed: at the same insertion"
    axes.annotate(note, (0.0, 2.0), fontsize=7, va="center")
    axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.5))


def _grid(found: list[Found]) -> list[Found]:
    places = set(product(FRICTION, OUTER, MASS))
    return [e for e in found if e.asked.plain and (e.asked.friction, e.asked.outer, e.asked.mass) in places]


def _paper(axes, x: float, side: str) -> None:
    """The paper's levels, named at ``x``."""
    from tendonrod.plot.style import MM, QUIET

    low, high, simulated = MM * PAPER[0], MM * PAPER[1], MM * FTL_TIP_RMSE_SIMULATED
    axes.axhspan(low, high, color=QUIET, alpha=0.45, lw=0.0)
    axes.axhline(simulated, color=QUIET, lw=0.9, ls=":")
    for name, y in (("paper, trials", low), ("paper, simulated", simulated)):
        down = name == "paper, trials"
        axes.annotate(
            name, (x, y), (0, -2 if down else 2), textcoords="offset points", ha=side, va="top" if down else "bottom",
            fontsize=7, color=QUIET,
        )  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Run the map; 0 if all trials ended as they should."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("out/bench-tip-error.png"))
    parser.add_argument("--rate", type=float, default=100.0, help="control periods per second; fewer take less time")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    print(machine(), flush=True)
    began, work = time.perf_counter(), jobs(given.rate, given.seed)
    for name in NAMES:
        along(name)
    for mass in MASS:  # the robot's table depends on the mass, and takes seconds
        virtual_bench(setup_of(Asked(friction=0.0, outer=0.0, mass=mass, ahead=False, rate=given.rate, seed=0)), 0)
    found = list(spread(run, work))
    print(tables(found))
    given.output.parent.mkdir(parents=True, exist_ok=True)
    draw(found, given.output)
    print(f"{len(found)} trials at {given.rate:g} Hz in {time.perf_counter() - began:.0f} s; figure: {given.output}")
    return 0 if all(each.ended == "done" for each in found) else 1


if __name__ == "__main__":
    sys.exit(main())
