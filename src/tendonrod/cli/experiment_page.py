"""What `tendonrod experiment` prints."""

from __future__ import annotations

from collections.abc import Sequence
from json import loads
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import output as out
from .shape_page import listed

if TYPE_CHECKING:
    from ..measurement.bench import Experiment
    from ..measurement.trial import Trial
    from ..robot import Robot


def as_dict(bench: Experiment, trials: Sequence[Trial], files: Sequence[Path]) -> dict[str, Any]:
    """What was made and what was true, SI, for JSON."""
    origin = trials[0].origin
    return {
        "made_by": origin["made by"],
        "robot": bench.believed.name,
        "torsion": bench.believed.torsion,
        "seed": int(origin["seed"]),
        "trials": [
            {
                "name": trial.name,
                "file": None if path is None else str(path),
                "samples": trial.time.size,
                "counts": {name: dict(counts) for name, counts in trial.counts().items()},
            }
            for trial, path in zip(trials, files or [None] * len(trials), strict=True)
        ],
        "truth": loads(origin["truth"]),
    }


def page(bench: Experiment, trials: Sequence[Trial], files: Sequence[Path]) -> str:
    """The same as text for people."""
    from ..measurement.bench import LEVELS, PROTOCOLS

    origin, robot = trials[0].origin, bench.believed
    title = f"{robot.name}, torsion {robot.torsion}, seed {origin['seed']}: virtual, not a measurement"
    rows = []
    for trial, path in zip(trials, files or [None] * len(trials), strict=True):
        used = f"{int(trial.kept.sum())} of {trial.kept.size}"
        rows.append([trial.name, str(trial.time.size), used, "not written" if path is None else path.name])
    made = out.table(["trial", "samples", "poses used", "file"], rows, words=(0, 3))
    chosen = {"protocol": (bench.protocol, PROTOCOLS), "level": (bench.level, LEVELS)}
    said = [(name, f"{choice}: {words[choice]}") for name, (choice, words) in chosen.items()]
    told = out.table(["", ""], [*said, *_truth(bench)], words=(0, 1))
    return "\n\n".join([out.heading(title), made, out.heading("What was true"), told])


def _truth(bench: Experiment) -> list[tuple[str, str]]:
    """What differs from what the trials say, and the noise, in units for reading."""
    x, y, z = (degrees(each) for each in bench.base_tilt)
    true, claimed, noise = bench.robot.parameters(), bench.believed.parameters(), bench.noise
    different = {name: value for name, value in true.items() if value != claimed[name]}
    changed = [(name, _changed(bench.robot, name, value, claimed[name])) for name, value in different.items()]
    return [
        ("gravity", f"({listed(bench.gravity)}) m/s2"),
        ("tilt of the base", f"({_plain(x)}, {_plain(y)}, {_plain(z)}) deg, rotation vector"),
        ("place of the base", f"({listed([1e3 * each for each in bench.base_offset])}) mm"),
        ("mass at the tip", f"{1e3 * bench.tip_mass:g} g, not told"),
        ("mass of a tracker", f"{1e3 * bench.tracker_mass:g} g, told"),
        ("holder", f"({listed([1e3 * each for each in bench.holder_error])}) mm beside what is told"),
        *changed,
        ("noise", f"{1e3 * noise.position:g} mm, {degrees(noise.orientation):g} deg, {1e3 * noise.tension:g} mN"),
        ("missing, outliers", f"{noise.dropouts:g}, {noise.outliers:g} of the frames"),
    ]


def _changed(robot: Robot, name: str, true: float, claimed: float) -> str:
    """Both numbers in the unit that the robot's file has."""
    from ..measurement.unknowns import unit_of

    unit, per_si = unit_of(robot, name)
    return f"{true * per_si:.6g}{f' {unit}' if unit else ''}, claimed {claimed * per_si:.6g}"


def _plain(angle: float) -> str:
    return f"{angle + 0.0:.4g}"
