"""`tendonrod experiment`: trials of a bench that does not exist."""

from __future__ import annotations

import re
from math import hypot, radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, nonnegative, one_of, positive, within
from . import output as out
from .arguments import Figure, Json, RobotName, bench_robot, number, vector, whole
from .experiment_page import as_dict, page

if TYPE_CHECKING:
    from ..measurement.noise import Noise
    from ..measurement.trial import Trial
    from ..robot import Robot

MOST_SAMPLES, MOST_CYCLES = 100_000, 1000
FORMATS = ("nc", "csv")


def _option(metavar: str, text: str, name: str | None = None) -> Any:
    return typer.Option(*([name] if name else []), metavar=metavar, help=text)


def experiment(
    robot: RobotName,
    output: Annotated[str | None, _option("DIR", "Write the trials there; made if need be.")] = None,
    file_format: Annotated[str, _option("NAME", "Of the files: nc or csv.", "--format")] = "nc",
    seed: Annotated[str, _option("WHOLE", "The same seed gives the same trials, bit for bit.")] = "0",
    tension_max: Annotated[str, _option("N", "Largest tension, of every tendon.")] = "0.7",
    tension_min: Annotated[str, _option("N", "Least tension, of every tendon.")] = "0.05",
    samples: Annotated[str, _option("COUNT", "Samples of each rise and each fall of the tension, 2 or more.")] = "30",
    cycles: Annotated[str, _option("COUNT", "Rises and falls; 0 for one rise only.")] = "1",
    gravity: Annotated[str, _option("X,Y,Z", "Gravity in the world frame, m/s2.")] = "-9.81,0,0",
    protocol: Annotated[
        str,
        _option("NAME", "movable: one tracker, on the base, then at each quarter, in 5 trials; fixed: all at once."),
    ] = "movable",
    level: Annotated[
        str,
        _option("NAME", "What is known of the field: field, its pose; base, nothing; origin, that its axes are level."),
    ] = "field",
    torsion: Annotated[
        str | None,
        _option("MODEL", "Of the truth and of the claim. Left out: homogenized, where the robot has the factors."),
    ] = None,
    tilt_deg: Annotated[
        str, _option("DEG[,DEG]", "True tilt of the outer tube: towards gravity, or about its x and y.")
    ] = "0",
    base_offset_mm: Annotated[str, _option("X,Y,Z", "True place of the outer tube's exit, mm.")] = "0,0,0",
    tip_mass_g: Annotated[str, _option("G", "True mass at the tip, of which the trials say nothing.")] = "0",
    tracker_mass_g: Annotated[str, _option("G", "Mass of each tracker with its holder, which the trials tell.")] = "0",
    holder_error_mm: Annotated[
        str, _option("X,Y,Z", "By how much sensors sit beside the holder's offset, section frame, mm.")
    ] = "0,0,0",
    friction: Annotated[str | None, _option("MU", "True friction of the tendons. Left out: the robot's.")] = None,
    youngs_modulus_gpa: Annotated[str | None, _option("GPA", "True modulus. Left out: the robot's.")] = None,
    noise_mm: Annotated[str, _option("MM", "Standard deviation of each measured coordinate.")] = "0.5",
    noise_deg: Annotated[str, _option("DEG", "Standard deviation of orientations, about each axis.")] = "0.3",
    tension_noise_mn: Annotated[
        str, _option("MN", "Standard deviation of measured tensions, millinewtons.", "--tension-noise-mN")
    ] = "5",
    dropout: Annotated[str, _option("SHARE", "Of frames without a pose, in bursts; at most 0.95.")] = "0",
    outliers: Annotated[str, _option("SHARE", "Of frames 10 mm off.")] = "0",
    json: Json = False,
    figure: Figure = None,
) -> None:
    """Make trials of a virtual experiment, whose truth is known: not measurements.

    ROBOT: a preset, or the path of a robot's TOML file; the trials name it, while --friction and --youngs-modulus-gpa
    change the robot that is measured. One file per trial, ROBOT-base, ROBOT-s25 ... (s: per cent of the length), or
    ROBOT-all; each says that it is virtual, and holds the truth.
    """
    one_of("--format", file_format, FORMATS)
    picture = out.target("--figure", figure, out.FIGURES)
    drawn_by, pull = whole("--seed", seed, 0, 2**63 - 1), vector("--gravity", gravity)
    claimed = bench_robot(robot, torsion)

    from ..measurement.bench import LEVELS, PROTOCOLS, Experiment
    from ..measurement.experiment import measured, simulate

    bench = Experiment(
        robot=_true_robot(claimed, friction, youngs_modulus_gpa),
        claimed=claimed,
        gravity=pull,
        protocol=one_of("--protocol", protocol, PROTOCOLS),
        level=one_of("--level", level, LEVELS),
        base_tilt=_tilt(tilt_deg, pull),
        base_offset=_millimetres("--base-offset-mm", base_offset_mm),
        holder_error=_millimetres("--holder-error-mm", holder_error_mm),
        tip_mass=1e-3 * number("--tip-mass-g", tip_mass_g, nonnegative),
        tracker_mass=1e-3 * number("--tracker-mass-g", tracker_mass_g, nonnegative),
        noise=_noise(noise_mm, noise_deg, tension_noise_mn, dropout, outliers),
        **_programme(tension_max, tension_min, samples, cycles),
    )
    directory = None if output is None else out.directory("--output", output)
    with out.progress_bar("simulating") as watch:
        true = simulate(bench, watch)
    trials = measured(bench, true, drawn_by)
    files = [] if directory is None else [directory / f"{_file_name(each.name)}.{file_format}" for each in trials]
    for trial, path in zip(trials, files, strict=False):  # none without a directory
        _write(trial, path)
    if picture is not None:
        from ..plot.experiments import experiment_figure

        out.write_figure("--figure", picture, lambda: experiment_figure(bench, true, trials, drawn_by))
    if json:
        out.say_json(as_dict(bench, trials, files))
    else:
        out.say(page(bench, trials, files))
    if directory is None and picture is None:
        out.note("nothing was written: name a directory with --output")


def _true_robot(claimed: Robot, friction: str | None, youngs_modulus_gpa: str | None) -> Robot:
    asked = {}
    if friction is not None:
        asked["friction"] = number("--friction", friction, nonnegative)
    if youngs_modulus_gpa is not None:
        asked["youngs_modulus"] = 1e9 * number("--youngs-modulus-gpa", youngs_modulus_gpa, positive)
    names = claimed.parameters()
    if "friction" in asked and not claimed.n_tendons:
        raise InvalidInput("--friction", Fact(str(friction)), f"left out: {claimed.name} has no tendons")
    changes = {name: value for end, value in asked.items() for name in names if name == end or name.endswith(f"_{end}")}
    return claimed.replace(**changes) if changes else claimed


def _noise(noise_mm: str, noise_deg: str, tension_noise_mn: str, dropout: str, outliers: str) -> Noise:
    from ..measurement.noise import Noise

    missing = number("--dropout", dropout, within, 0.0, 0.95)
    return Noise(
        position=1e-3 * number("--noise-mm", noise_mm, nonnegative),
        orientation=radians(number("--noise-deg", noise_deg, nonnegative)),
        tension=1e-3 * number("--tension-noise-mN", tension_noise_mn, nonnegative),
        dropouts=missing,
        burst=max(Noise.burst, missing / (1.0 - missing)),
        outliers=number("--outliers", outliers, within, 0.0, 1.0),
    )


def _programme(tension_max: str, tension_min: str, samples: str, cycles: str) -> dict[str, Any]:
    low, high = number("--tension-min", tension_min, nonnegative), number("--tension-max", tension_max, nonnegative)
    if high < low:
        raise InvalidInput("--tension-max", high, f"at least --tension-min, {low:g}")
    return {
        "largest_tension": high,
        "least_tension": low,
        "samples": whole("--samples", samples, 2, MOST_SAMPLES),
        "cycles": whole("--cycles", cycles, 0, MOST_CYCLES),
    }


def _tilt(text: str, gravity: tuple[float, float, float]) -> tuple[float, float, float]:
    """Rotation vector of the exit, rad; one angle leans the tip towards gravity, two are about the exit's x and y."""
    parts = text.split(",")
    angles = [radians(number("--tilt-deg", each)) for each in parts]
    if len(angles) == 2:
        return angles[0], angles[1], 0.0
    if len(angles) != 1:
        raise InvalidInput("--tilt-deg", Fact(text), "one number, or two with a comma between them, degrees")
    x, y, _ = gravity
    across = hypot(x, y)
    if across == 0.0 and angles[0] != 0.0:
        raise InvalidInput("--tilt-deg", Fact(text), "two numbers, about x and y, where gravity has no side")
    if across == 0.0 or angles[0] == 0.0:
        return 0.0, 0.0, 0.0
    return 0.0 - angles[0] * y / across, angles[0] * x / across, 0.0


def _millimetres(option: str, text: str) -> tuple[float, float, float]:
    x, y, z = vector(option, text)
    return 1e-3 * x, 1e-3 * y, 1e-3 * z


def _file_name(name: str) -> str:
    """``name`` without what has a meaning in a path."""
    return re.sub(r"[^\w.+-]+", "_", name)


def _write(trial: Trial, path: Path) -> None:
    if path.suffix == ".csv":
        from ..measurement.csvfile import write_csv, written_with

        with out.written("--output", path):
            write_csv(trial, path)
        for each in written_with(path, trial):
            out.note(f"wrote {each}, which {path.name} is read with")
        return
    from ..measurement.trialfile import write_trial

    with out.written("--output", path):
        write_trial(trial, path)
