"""All of a fit as plain numbers for JSON, and its tables: residuals.csv, pose by pose, and profiles.csv."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..files import complete
from .crossvalidation import CrossValidation
from .fittedfile import Provenance, fitted_robot
from .identification import Fit
from .profiles import Profile
from .setup import BENCH

RECORD, RESIDUALS, PROFILES = "fit.json", "residuals.csv", "profiles.csv"


def write_record(
    fit: Fit,
    directory: str | PathLike[str],
    provenance: Provenance | None = None,
    profiles: Sequence[Profile] = (),
    validation: CrossValidation | None = None,
) -> tuple[Path, ...]:
    """Write fit.json, residuals.csv and, where there are profiles, profiles.csv into ``directory``; the paths written.

    Raises `InvalidInput` where they cannot be written.
    """
    folder = Path(directory)
    record = as_dict(fit, provenance, profiles, validation)
    with complete("record", folder / RECORD) as draft:
        draft.write_text(_json(record), encoding="utf-8")
    _write_rows(folder / RESIDUALS, residual_rows(fit, validation))
    if profiles:
        _write_rows(folder / PROFILES, profile_rows(fit, profiles))
    return (folder / RECORD, folder / RESIDUALS, *([folder / PROFILES] if profiles else []))


def _json(record: dict[str, Any]) -> str:
    """One line for each key, so that people can read it too."""
    lines = (f" {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in record.items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _write_rows(path: Path, rows: Iterator[list[Any]]) -> None:
    with complete("table", path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def as_dict(
    fit: Fit,
    provenance: Provenance | None = None,
    profiles: Sequence[Profile] = (),
    validation: CrossValidation | None = None,
) -> dict[str, Any]:
    """Everything about a fit, SI, None for what is not known; floats in full precision."""
    from .. import __version__

    told = provenance or Provenance()
    robot, pose = fitted_robot(fit, told), fit.setup.exit_pose
    return {
        "made_by": f"tendonrod {__version__}",
        "date": told.date,
        "units": {"lengths": "m", "angles": "rad", "masses": "kg", "tensions": "N", "gravity": "m/s2"},
        "robot": None if robot is None else robot.name,
        "torsion": None if robot is None else robot.torsion,
        "trials": [_trial(fit, i, told) for i in range(len(fit.trials))],
        "free": [_number(fit, i, profiles) for i in range(len(fit.unknowns))],
        "given": list(told.given),
        "covariance": fit.covariance.tolist(),
        "correlation": fit.correlation.tolist(),
        "quantile": fit.quantile,
        "scale": fit.scale,
        "loss": fit.loss,
        "orientations": fit.orientations,
        "poses": len(fit.where),
        "poses_used": int(fit.used.sum()),
        "outliers": [_pose(fit, k) for k in np.flatnonzero(~fit.used).tolist()],
        "rmse_before": fit.rmse_before,
        "rmse": fit.rmse,
        "rmse_held_out": None if validation is None else _known(validation.rmse),
        "sentences": list(fit.sentences),
        "evaluations": fit.evaluations,
        "solves": fit.solves,
        "bench": {name: getattr(fit.setup, name) for name in BENCH},
        "exit_pose": (np.eye(4) if pose is None else pose).tolist(),
        "robot_numbers": None if robot is None else robot.parameters(),
        "profiles": [_profile(each) for each in profiles],
        "cross_validation": None if validation is None else _validation(fit, validation),
    }


def _trial(fit: Fit, i: int, provenance: Provenance) -> dict[str, Any]:
    trial = fit.trials[i]
    file, digest = provenance.files[i] if i < len(provenance.files) else (None, None)
    return {
        "name": trial.name,
        "file": file,
        "sha256": digest,
        "made_by": trial.origin.get("made by"),
        "gravity": list(trial.gravity),
        "gravity_identified": list(fit.setup.gravity_of(trial)),
        "registration": trial.origin.get("registration"),
        "fates": {name: dict(count) for name, count in trial.counts().items()},
        "noise": {name: getattr(trial, f"{name}_noise") or None for name in ("position", "orientation", "tension")},
    }


def _number(fit: Fit, i: int, profiles: Sequence[Profile]) -> dict[str, Any]:
    unknown = fit.unknowns[i]
    of = next((each for each in profiles if each.name == unknown.name), None)
    return {
        "name": unknown.name,
        "start": unknown.start,
        "value": float(fit.values[i]),
        "standard_error": float(fit.standard_errors[i]),
        "low": float(fit.low[i]),
        "high": float(fit.high[i]),
        "profile_low": None if of is None else _known(of.low),
        "profile_high": None if of is None else _known(of.high),
        "told_in": unknown.unit,
        "per_si": unknown.per_si,
    }


def _pose(fit: Fit, k: int) -> dict[str, Any]:
    i, row, j = (int(each) for each in fit.where[k])
    trial = fit.trials[i]
    named = {"trial": trial.name, "sample": row + 1, "tracker": trial.trackers[j].name}
    return named | {"distance": float(fit.distance[k])}


def _profile(profile: Profile) -> dict[str, Any]:
    ends = {"low": _known(profile.low), "high": _known(profile.high)}
    arrays = {name: getattr(profile, name).tolist() for name in ("values", "rise", "others")}
    return {"name": profile.name, **ends, **arrays}


def _validation(fit: Fit, found: CrossValidation) -> dict[str, Any]:
    return {
        "rmse": _known(found.rmse),
        "folds": [
            {
                "held_out": name,
                "poses": int((found.used & (found.fold == k)).sum()),
                "rmse": _known(float(found.rmse_by_fold[k])),
                "values": {each: _known(float(x)) for each, x in zip(fit.names, found.values[k], strict=True)},
                "failed": found.notes[k] or None,
            }
            for k, name in enumerate(found.folds)
        ],
    }


def residual_rows(fit: Fit, validation: CrossValidation | None = None) -> Iterator[list[Any]]:
    """A header and a row for each pose; errors are measured less predicted positions of sensors, in the world.

    Distances are those of body points. held_out_mm is empty without cross-validation, samples count from 1.
    """
    T = max(each.robot.n_tendons for each in fit.trials)
    drives = [
        f"{name}_{i}_{unit}" for name, unit in (("tension", "N"), ("displacement", "mm")) for i in range(1, T + 1)
    ]
    yield [
        *("trial", "tracker", "sample", "time_s", "s_mm", "insertion", "rotation_deg"), *drives,
        *("error_x_mm", "error_y_mm", "error_z_mm", "distance_before_mm", "distance_mm", "held_out_mm"),
        *("weight", "used"),
    ]  # fmt: skip
    held = np.full(len(fit.where), np.nan) if validation is None else validation.distance
    for k, (i, row, j) in enumerate(fit.where.tolist()):
        lengths = 1e3 * np.array([*fit.errors[k], fit.distance_before[k], fit.distance[k], held[k]])
        weight = float(fit.weights[k])
        yield [*_sample(fit, i, row, j, T), *map(_cell, lengths), weight, "yes" if weight > 0.0 else "no"]


def _sample(fit: Fit, i: int, row: int, j: int, T: int) -> list[Any]:
    trial = fit.trials[i]
    lacking = [np.nan] * (T - trial.robot.n_tendons)
    drives = [*trial.tensions[row], *lacking, *(1e3 * trial.displacements[row]), *lacking]
    numbers = [1e3 * trial.places[j], trial.insertion[row], np.degrees(trial.rotation[row]), *drives]
    return [trial.name, trial.trackers[j].name, row + 1, _cell(trial.time[row]), *map(_cell, numbers)]


def profile_rows(fit: Fit, profiles: Sequence[Profile]) -> Iterator[list[Any]]:
    """A header and a row for each point: the number held, by how much the squares rise, and all numbers, SI."""
    yield ["number", "held_at", "rise", *fit.names]
    for each in profiles:
        for value, rise, others in zip(each.values, each.rise, each.others, strict=True):
            yield [each.name, float(value), float(rise), *map(float, others)]


def _cell(value: float) -> float | str:
    return "" if np.isnan(value) else float(value)


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
