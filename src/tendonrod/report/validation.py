"""The page of `tendonrod validate`: measured trials against the model, as the paper's Table I and Fig. 6(b)."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..measurement.accuracy import WITH, WITHOUT, Accuracy, Errors, Place
from ..measurement.diagnosis import Diagnosis
from ..measurement.registration import seen_exit
from ..measurement.trial import KEPT, MISSING_POSE, Trial
from ..rotation import log_so3
from .chapter import Cell, Number, Picture, Table, listed, mm
from .explanation import explanations
from .origin import assumed, virtual
from .page import write_page
from .typeset import minus, whole

FIGURES = ("components", "space", "errors", "bias")
_L = "<i>L</i><sub>na</sub>"


def write_validation(
    found: Accuracy,
    out: str | os.PathLike[str],
    causes: Mapping[str, Diagnosis] | None = None,
    watch: Callable[[int, int, str], None] | None = None,
) -> Path:
    """Write index.html with Table I, figures, and errors.csv, every sample's error vector, into the directory ``out``.

    causes: what would explain the errors, by the robot's name; left out, the page says nothing of it. Returns the path
    of the page. Raises `InvalidInput` where ``out`` cannot be written.
    """
    why = explanations(causes or {})
    by_insertion = insertion_table(found)
    tables = [accuracy_table(found), *([by_insertion] if by_insertion is not None else []), bias_table(found)]
    tables += [*(each["table"] for each in why), sample_table(found)]
    robots = ", ".join(robot.name for robot in found.robots)
    return write_page(
        out,
        "validation.html.j2",
        f"{robots}: measured and modelled",
        tables,
        [*_pictures(found), *(each["picture"] for each in why if each["picture"])],
        facts(found) | {"why": why, "by_insertion": by_insertion is not None},
        more=[lambda folder: write_errors(found, folder / "errors.csv")],
        watch=watch,
    )


def facts(found: Accuracy) -> dict[str, Any]:
    """What the page's sentences say."""
    return {
        "runs": found.runs,
        "best": found.best_known,
        "with_gravity": WITH in found.runs,
        "torsion": listed(f"{robot.name}: {robot.torsion}" for robot in found.robots),
        "robots": [_robot_facts(found, robot) for robot in found.robots],
        "used": found.counts[0],
        "measured": found.counts[1],
        "trials": len(found.trials),
        "virtual": virtual(found.trials),
        "assumed": assumed(found.trials),
        "registrations": registration_lines(found),
        "exits": exit_lines(found),
        "gravities": listed(sorted({_vector(each.gravity) for each in found.trials})),
        "departures": departures(found),
    }


def registration_lines(found: Accuracy) -> list[str]:
    """A line for each way in which trials came into the world."""
    by: dict[str, list[str]] = {}
    for trial, each in zip(found.trials, found.registrations, strict=True):
        by.setdefault(str(each), []).append(trial.name)
    return [f"{', '.join(names)}: {text}" for text, names in by.items()]


def exit_lines(found: Accuracy) -> list[str]:
    """What base trackers say of the outer tube's exit, where they do not themselves define the world."""
    return [
        f"{trial.name}: the base tracker sees the exit ({_vector(1e3 * pose[:3, 3], 2)}) mm beside the world’s origin, "
        f"turned by ({_vector(np.degrees(log_so3(pose[:3, :3])), 2)})°"
        for trial in found.trials
        if _given(trial) and (pose := seen_exit(trial)) is not None
    ]


def departures(found: Accuracy) -> list[str]:
    """Numbers of the setup that are not what the trials say."""
    from ..measurement.setup import BENCH, Setup

    usual = Setup()
    return [
        f"{name} = {getattr(found.setup, name):.6g}"
        for name in BENCH
        if getattr(found.setup, name) != getattr(usual, name)
    ]


def accuracy_table(found: Accuracy) -> Table:
    """The paper's Table I, and mean, share of the length, bias and scatter of the run that models gravity."""
    per_run = [f"{name}, {run} (mm)" for run in found.runs for name in ("MED", "RMSE")]
    more = ["MAE (mm)", "RMSE, % of " + _L, "bias (mm)", "scatter (mm)", "angle, rms (deg)"]
    if not _angles(found):
        more = more[:-1]
    return Table(
        name="accuracy", header=("", f"<i>s</i> / {_L}", "<i>n</i>", *per_run, *more), rows=_rows(found, len(more))
    )


def insertion_table(found: Accuracy) -> Table | None:
    """Errors by how much of the robot is out; None where that does not vary."""
    rows: list[list[Cell]] = []
    for place in found.places:
        parts = {run: each.by_insertion() for run, each in place.errors.items()}
        for k, (name, best) in enumerate(parts[found.best_known]):
            per_run = [mm(value) for each in parts.values() for value in (each[k][1].med, each[k][1].rmse)]
            start: list[Cell] = [
                whole(place.robot.name),
                Number(place.share, 2),
                whole(name),
                Number(len(best.vectors), 0),
            ]
            rows.append([*start, *per_run, mm(float(np.linalg.norm(best.bias))), mm(best.scatter)])
    per_run = [f"{name}, {run} (mm)" for run in found.runs for name in ("MED", "RMSE")]
    header = ("", f"<i>s</i> / {_L}", "out", "<i>n</i>", *per_run, "bias (mm)", "scatter (mm)")
    return Table(name="insertions", header=header, rows=rows) if rows else None


def bias_table(found: Accuracy) -> Table:
    """Mean error vector and scatter, by run."""
    rows: list[list[Cell]] = []
    for place in found.places:
        for run, errors in place.errors.items():
            bias = [mm(value) for value in errors.bias]
            size = mm(float(np.linalg.norm(errors.bias)))
            rows.append([whole(place.robot.name), Number(place.share, 2), run, *bias, size, mm(errors.scatter)])
    header = ("", f"<i>s</i> / {_L}", "model", *(f"<i>{x}</i> (mm)" for x in "xyz"), "|bias| (mm)", "scatter (mm)")
    return Table(name="bias", header=header, rows=rows)


def sample_table(found: Accuracy) -> Table:
    """How many samples of each tracker were used, and why others were not."""
    rows: list[list[Cell]] = []
    for trial, fates in zip(found.trials, found.fates, strict=True):
        for (name, count), at in zip(fates.items(), trial.places, strict=True):
            lost = ", ".join(f"{reason} {n}" for reason, n in count.most_common() if reason != KEPT)
            place = "base" if np.isnan(at) else Number(at / trial.robot.length_na, 2)
            rows.append(
                [trial.name, name, place, Number(sum(count.values()), 0), Number(count[KEPT], 0), lost or "none"]
            )
    rows.sort(key=lambda row: row[2] == "base")  # the base last
    header = ("trial", "tracker", f"<i>s</i> / {_L}", "samples", "used", "not used")
    return Table(name="samples", header=header, rows=rows)


def write_errors(found: Accuracy, path: Path) -> None:
    """CSV: every sample of each tracker on the robot with its fate; measured and model points and error vectors, mm."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(_error_header(found))
        rows.writerows(_error_rows(found))


def _error_header(found: Accuracy) -> list[str]:
    drives = range(1, 1 + max(each.robot.n_tendons for each in found.trials))
    header = ["robot", "trial", "tracker", "sample", "time_s", "s_mm", "insertion", "rotation_deg"]
    header += [f"{name}_{i}_{unit}" for name, unit in (("tension", "N"), ("displacement", "mm")) for i in drives]
    header += ["fate", *(f"measured_{x}_mm" for x in "xyz")]
    for run in found.runs:
        short = run.replace(" ", "_")
        header += [*(f"{what}_{x}_mm_{short}" for what in ("model", "error") for x in "xyz"), f"error_mm_{short}"]
    return header


def _error_rows(found: Accuracy) -> Iterator[list[object]]:
    where = {
        key: (place, k)
        for place in found.places
        for k, key in enumerate(zip(place.trial.tolist(), place.sample.tolist(), place.tracker.tolist(), strict=True))
    }
    T = max(each.robot.n_tendons for each in found.trials)
    for i, trial in enumerate(found.trials):
        for j in np.flatnonzero(trial.on_robot).tolist():
            for row in range(trial.time.size):
                yield [*_sample_cells(trial, row, j, T), *_compared_cells(found, trial, row, j, where.get((i, row, j)))]


def _sample_cells(trial: Trial, row: int, j: int, T: int) -> list[object]:
    lacking = [np.nan] * (T - trial.robot.n_tendons)
    names = ("tensions", "displacements", "insertion", "rotation")
    tensions, pulled, insertion, rotation = (np.asarray(getattr(trial, name))[row] for name in names)
    drives = [*tensions, *lacking, *(1e3 * pulled), *lacking]
    numbers = [trial.time[row], 1e3 * trial.places[j], insertion, np.degrees(rotation), *drives]
    time, *others = [_cell(each) for each in numbers]
    return [trial.robot.name, trial.name, trial.trackers[j].name, row + 1, time, *others]


def _compared_cells(
    found: Accuracy, trial: Trial, row: int, j: int, known: tuple[Place, int] | None
) -> Iterator[object]:
    from ..measurement.accuracy import NO_ORIENTATION

    fate = str(trial.fates[row, j])
    if known is None:
        state = np.asarray(trial.state)[row, j]
        said = f" ({state})" if fate == MISSING_POSE and state else ""
        yield NO_ORIENTATION if fate == KEPT else fate + said
        yield from [""] * (3 + 7 * len(found.runs))
        return
    place, k = known
    yield fate
    yield from map(_cell, 1e3 * place.measured[k])
    for run in found.runs:
        errors = place.errors[run]
        yield from map(_cell, 1e3 * np.array([*errors.model[k], *errors.vectors[k], errors.distances[k]]))


def _cell(value: float) -> float | str:
    return "" if np.isnan(value) else float(value)


def _rows(found: Accuracy, more: int) -> list[list[Cell]]:
    rows: list[list[Cell]] = []
    for place in found.places:
        errors = place.errors[found.best_known]
        per_run = [mm(value) for each in place.errors.values() for value in (each.med, each.rmse)]
        rest: list[Cell] = [
            mm(errors.mae),
            Number(100.0 * errors.share, 2),
            mm(float(np.linalg.norm(errors.bias))),
            mm(errors.scatter),
            _angle(errors),
        ]
        start: list[Cell] = [whole(place.robot.name), Number(place.share, 2), Number(place.n, 0)]
        rows.append([*start, *per_run, *rest[:more]])
    return rows


def _angle(errors: Errors) -> Cell:
    return "–" if np.isnan(errors.angle_rms) else Number(float(np.degrees(errors.angle_rms)), 2)


def _angles(found: Accuracy) -> bool:
    return any(np.isfinite(each.errors[found.best_known].turns).any() for each in found.places)


def _robot_facts(found: Accuracy, robot) -> Mapping[str, Any]:
    last = found.of(robot)[-1]
    turn, share = found.lean(robot)
    number = found.robots.index(robot) + 1
    best = last.errors[found.best_known]
    return {
        "name": robot.name,
        "figures": {name: _figure_name(found, name, number) for name in FIGURES},
        "share": Number(last.share, 2),
        "rmse": {run: mm(each.rmse) for run, each in last.errors.items()},
        "med": {run: mm(each.med) for run, each in last.errors.items()},
        "percent": Number(100.0 * best.share, 1),
        "bias": mm(float(np.linalg.norm(best.bias))),
        "scatter": mm(best.scatter),
        "lean": Number(float(np.degrees(np.linalg.norm(turn))), 2),
        "lean_vector": _vector(np.degrees(turn), 2),
        "lean_share": Number(100.0 * share, 1),
        "without": mm(last.errors[WITHOUT].rmse) if WITHOUT in last.errors else None,
    }


def _pictures(found: Accuracy) -> list[Picture]:
    from ..plot import accuracy as plots

    draw = (plots.components_figure, plots.space_figure, plots.error_figure, plots.bias_figure)
    return [
        Picture(name=_figure_name(found, name, k), draw=partial(each, found, robot))
        for k, robot in enumerate(found.robots, 1)
        for name, each in zip(FIGURES, draw, strict=True)
    ]


def _figure_name(found: Accuracy, name: str, number: int) -> str:
    return name if len(found.robots) == 1 else f"{name}-{number}"


def _given(trial: Trial) -> bool:
    """Whether the trial itself knows its place in the world, so that its base tracker is free to contradict."""
    return "registration" not in trial.origin or not trial.origin["registration"].startswith("tracker ")


def _vector(vector, digits: int = 3) -> str:
    return ", ".join(minus(f"{round(float(value), digits) + 0.0:.{digits + 3}g}") for value in vector)
