"""`tendonrod validate`: measured trials against the model, as the paper's Table I."""

from __future__ import annotations

from functools import partial
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import one_of
from . import output
from .arguments import Json, chosen_robot, chosen_trials, in_words
from .every import Every, thin
from .trials_page import assumptions, made_by

if TYPE_CHECKING:
    from ..measurement.accuracy import Accuracy, Errors, Place
    from ..measurement.diagnosis import Cause, Diagnosis
    from ..measurement.trial import Trial
    from ..robot import Robot

_LEGEND = (
    "with, without: gravity in the model. MED: maximum Euclidean distance; %: RMSE of the\n"
    "robot's length L_na; bias: length of the mean error vector; scatter: rms about it, so that\n"
    "RMSE^2 = bias^2 + scatter^2."
)


def validate(
    trials: Annotated[list[str], typer.Argument(metavar="TRIAL", hidden=True)],
    robot: Annotated[
        str | None, typer.Option(metavar="ROBOT", help="The model's robot, instead of that of the trials.")
    ] = None,
    torsion: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL", help="published, open_section or homogenized, instead of the robot's own torsion."
        ),
    ] = None,
    gravity: Annotated[
        str, typer.Option(metavar="WHICH", help="Gravity in the model: both, that is with and without; with; without.")
    ] = "both",
    output_directory: Annotated[
        str | None,
        typer.Option("--output", metavar="DIR", help="Write index.html, accuracy.csv, errors.csv and figures here."),
    ] = None,
    why: Annotated[
        bool, typer.Option("--why/--no-why", help="Look for what would explain the errors: a tilted base, a mass, ...")
    ] = True,
    every: Every = None,
    json: Json = False,
) -> None:
    """Compare measured trials with the model, place by place.

    TRIAL: a .nc, or a CSV file with its column map beside it; what needs more to be said of it, such as --tracker or
    --drive, goes through tendonrod trial FILE --output TRIAL.nc first. All of one bench together, the one with the
    tracker on the base too: its pose puts the others into the world. Compared are points of the tube's axis at the
    measured tensions, insertions and rotations. Samples that do not count are told, none is dropped unsaid. Then single
    causes are fitted, so that a tilted base or a mass at the tip is not taken for physics.
    """
    one_of("--gravity", gravity, ("both", "with", "without"))
    model = None if robot is None else chosen_robot(robot, torsion)
    directory = None if output_directory is None else output.directory("--output", output_directory)
    given = thin(chosen_trials(trials, model, torsion), every)

    from ..measurement.accuracy import accuracy

    with in_words({"trials": "TRIAL"}), output.progress_bar("comparing") as watch:
        found = accuracy(given, robot=model, gravity=gravity, watch=watch)
    causes = _diagnosed(found) if why and gravity != "without" else {}
    if json:
        output.say_json(_as_dict(found) | {"why": {name: _causes_dict(each) for name, each in causes.items()}})
    else:
        output.say("\n\n".join([_page(found), *(_why(name, each) for name, each in causes.items())]))
    if directory is not None:
        _write(found, causes, directory)


def _diagnosed(found: Accuracy) -> dict[str, Diagnosis]:
    """Robot -> what would explain its errors."""
    from ..measurement.diagnosis import diagnose

    causes = {}
    for robot in found.robots:
        of = [each for each in found.trials if found.setup.robot_of(each) == robot and _rides(each)]
        with output.progress_bar(f"{robot.name}: looking for causes") as watch:
            causes[robot.name] = diagnose(of, found.setup, partial(_cause, watch, robot.name))
    return causes


def _cause(watch: Any, robot: str, done: int, of: int, what: str) -> None:
    watch(done, of, f"{robot}: {what}")


def _rides(trial: Trial) -> bool:
    return bool((trial.kept & trial.on_robot).any())


def _why(name: str, found: Diagnosis) -> str:
    rows = [
        (
            each.name,
            *(("", "") if each.fit is None else (f"{100 * each.explained:.1f}", f"{1e3 * each.rmse:.3g}")),
            told,
        )
        for each in found.alone
        for told in [each.told]
    ]
    for k, each in enumerate(found.together[1:], 2):
        names = " + ".join(cause.name for cause in found.together[:k])
        rows.append((names, f"{100 * each.explained:.1f}", f"{1e3 * each.rmse:.3g}", each.told))
    table = output.table(("cause", "explains %", "leaves mm", "with"), rows, words=(0, 3))
    said = "\n".join(f"{each[0].upper()}{each[1:]}." for each in found.sentences)
    return "\n\n".join([output.heading(f"{name}: what would explain the errors, each cause fitted alone"), table, said])


def _causes_dict(found: Diagnosis) -> dict[str, Any]:
    def told(each: Cause) -> dict[str, Any]:
        values = {} if each.fit is None else dict(zip(each.fit.names, each.fit.values.tolist(), strict=True))
        return {"name": each.name, "explained": each.explained, "rmse": _number(each.rmse), "values": values}

    return {
        "rmse": _number(found.rmse),
        "poses": found.count,
        "every": found.every,
        "outliers": found.outliers,
        "alone": [told(each) | {"refused": each.why} for each in found.alone],
        "together": [told(each) for each in found.together],
        "sentences": list(found.sentences),
    }


def _write(found: Accuracy, causes: dict[str, Diagnosis], directory: Path) -> None:
    from ..report.validation import write_validation

    with output.filling("--output", directory), output.progress_bar("drawing") as watch:
        page = write_validation(found, directory, causes, watch=watch)
    output.note(f"wrote {page}")


def _page(found: Accuracy) -> str:
    from ..report.chapter import plain
    from ..report.validation import departures, exit_lines, registration_lines

    title = ", ".join(f"{robot.name}, torsion {robot.torsion}" for robot in found.robots)
    used, measured = found.counts
    blocks = [output.heading(f"{title}: {used} of {measured} samples compared"), *assumptions(found.trials)]
    blocks += [_table(found), _LEGEND, *_parts(found), _leans(found)]
    blocks += [lost] if (lost := _lost(found)) else []
    seen = [plain(each).replace("’", "'").replace("°", " deg") for each in exit_lines(found)]
    lines = [*registration_lines(found), *seen, *departures(found), *made_by(found.trials)]
    return "\n\n".join([*blocks, "\n".join(lines)])


def _table(found: Accuracy) -> str:
    several = ["robot\n"] if len(found.robots) > 1 else []
    runs = [f"{run}\n{name} mm" for run in map(_short, found.runs) for name in ("MED", "RMSE")]
    columns = [*several, "s / L_na\n", "n\n", *runs, "\n%", "bias\nmm", "scatter\nmm", "angle\ndeg"]
    rows = [[*([each.robot.name] if several else []), *_row(found, each)] for each in found.places]
    return output.table(columns, rows, words=(0,) if several else ())


def _parts(found: Accuracy) -> list[str]:
    """Errors by how much of the robot is out, where that varies."""
    rows = []
    for place in found.places:
        parts = {run: each.by_insertion() for run, each in place.errors.items()}
        for k, (name, best) in enumerate(parts[found.best_known]):
            per_run = [1e3 * value for each in parts.values() for value in (each[k][1].med, each[k][1].rmse)]
            numbers = [output.fixed(value, 2) for value in (*per_run, 1e3 * _size(best.bias), 1e3 * best.scatter)]
            rows.append([place.robot.name, f"{place.share:.3g}", name, str(len(best.vectors)), *numbers])
    if not rows:
        return []
    runs = [f"{run}\n{name} mm" for run in map(_short, found.runs) for name in ("MED", "RMSE")]
    columns = ["robot\n", "s / L_na\n", "out\n", "n\n", *runs, "bias\nmm", "scatter\nmm"]
    return [output.table(columns, rows, words=(0,))]


def _short(run: str) -> str:
    from ..measurement.accuracy import WITH

    return "with" if run == WITH else "without"


def _row(found: Accuracy, place: Place) -> list[str]:
    best = place.errors[found.best_known]
    per_run = [1e3 * value for each in place.errors.values() for value in (each.med, each.rmse)]
    rest = [100.0 * best.share, 1e3 * _size(best.bias), 1e3 * best.scatter]
    angle = "-" if best.angle_rms != best.angle_rms else output.fixed(degrees(best.angle_rms), 2)
    return [f"{place.share:.3g}", str(place.n), *(output.fixed(value, 2) for value in (*per_run, *rest)), angle]


def _leans(found: Accuracy) -> str:
    """How much of the errors a turn of the whole model would take away."""
    lines = []
    for robot in found.robots:
        turn, share = found.lean(robot)
        lines.append(
            f"{robot.name}: turning the whole model by {degrees(_size(turn)):.3g} deg about the exit would take away\n"
            f"{100.0 * share:.0f} % of the squared error of all places ({found.best_known})."
        )
    return "\n".join(lines)


def _lost(found: Accuracy) -> str:
    """Why samples were not used; "" where all were."""
    rows = [
        (trial.name, name, reason, str(n))
        for trial, fates in zip(found.trials, found.fates, strict=True)
        for name, count in fates.items()
        for reason, n in count.most_common()
        if reason != "kept"
    ]
    return output.table(("trial", "tracker", "not used", "samples"), rows, words=(0, 1, 2)) if rows else ""


def _as_dict(found: Accuracy) -> dict[str, Any]:
    from ..report.validation import departures, exit_lines

    return {
        "robots": [{"name": each.name, "torsion": each.torsion, **_lean_dict(found, each)} for each in found.robots],
        "units": {"lengths": "m", "angles": "rad", "tensions": "N", "gravity": "m/s2"},
        "trials": [_trial_dict(found, i) for i in range(len(found.trials))],
        "places": [_place_dict(each) for each in found.places],
        "base_trackers": exit_lines(found),
        "departures": departures(found),
    }


def _lean_dict(found: Accuracy, robot: Robot) -> dict[str, Any]:
    turn, share = found.lean(robot)
    return {"lean": turn.tolist(), "lean_share": share}


def _trial_dict(found: Accuracy, i: int) -> dict[str, Any]:
    trial, registration = found.trials[i], found.registrations[i]
    assert trial.T_world_field is not None
    return {
        "name": trial.name,
        "robot": trial.robot.name,
        "gravity": list(trial.gravity),
        "made_by": trial.origin.get("made by"),
        "fates": {name: dict(count) for name, count in found.fates[i].items()},
        "T_world_field": trial.T_world_field.tolist(),
        "registration": str(registration),
        "registration_samples": registration.count,
        "registration_rms": _number(registration.rms),
        "registration_angle_rms": _number(registration.angle_rms),
    }


def _place_dict(place: Place) -> dict[str, Any]:
    told = {"robot": place.robot.name, "at": place.at, "share": place.share, "n": place.n}
    return told | {run.replace(" ", "_"): _errors_dict(each) for run, each in place.errors.items()}


def _errors_dict(errors: Errors) -> dict[str, Any]:
    names = ("med", "rmse", "mae", "share", "scatter", "angle_rms")
    return {name: _number(getattr(errors, name)) for name in names} | {"bias": errors.bias.tolist()}


def _size(vector) -> float:
    return float((vector @ vector) ** 0.5)


def _number(value: float) -> float | None:
    return float(value) if value == value else None
