"""The page of `tendonrod identify`: identified numbers, how sure they are, and the errors that are left."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..measurement.crossvalidation import CrossValidation
from ..measurement.fitrecord import PROFILES
from ..measurement.fittedfile import SCENE, Provenance, fitted_robot, robot_file
from ..measurement.identification import Fit
from ..measurement.names import MEANINGS
from ..measurement.profiles import Profile
from ..measurement.rounding import decimals, number, span, with_error
from ..measurement.trial import KEPT
from ..measurement.unknowns import Unknown
from .chapter import Cell, Number, Picture, Table, listed, mm
from .origin import assumed, virtual
from .page import write_page
from .typeset import minus, typeset, whole

SHORT = 4  # remarks in the summary


def write_identification(
    fit: Fit,
    out: str | os.PathLike[str],
    profiles: Sequence[Profile] = (),
    validation: CrossValidation | None = None,
    provenance: Provenance | None = None,
    watch: Callable[[int, int, str], None] | None = None,
) -> Path:
    """Write index.html with its tables and figures into the directory ``out``; the page's path.

    The sections on profiles and held-out errors are left out where there are none. The files that the page links to,
    fit.json and so on, are written by `fittedfile` and `fitrecord`; profiles.csv of an older page goes with it where
    there are no profiles. Raises `InvalidInput` where ``out`` cannot be written.
    """
    told = provenance or Provenance()
    tables = [number_table(fit, profiles)]  # in the order of the page
    tables += [validation_table(fit, validation)] if validation is not None else []
    tables += [sample_table(fit), correlation_table(fit)]
    return write_page(
        out,
        "identification.html.j2",
        f"{listed(robots(fit))}: identified from {_count(len(fit.trials), 'trial')}",
        tables,
        _pictures(fit, profiles, validation),
        facts(fit, profiles, validation, told),
        watch=watch,
        beside=[PROFILES] if profiles else [],
    )


def robots(fit: Fit) -> list[str]:
    """Names of the robots of the trials, each once."""
    return list(dict.fromkeys(fit.setup.robot_of(each).name for each in fit.trials))


def facts(
    fit: Fit, profiles: Sequence[Profile], validation: CrossValidation | None, provenance: Provenance
) -> dict[str, Any]:
    """What the page's sentences say."""
    robot = fitted_robot(fit)
    models = dict.fromkeys(fit.setup.robot_of(each).torsion for each in fit.trials)
    return {
        "headline": [_headline(fit, i) for i in range(len(fit.unknowns))],
        "sentences": [typeset(each) for each in fit.sentences[:SHORT]],
        "more": [typeset(each) for each in fit.sentences[SHORT:]],
        "torsion": listed(models),
        "poses": len(fit.where),
        "used": int(fit.used.sum()),
        "trials": len(fit.trials),
        "rmse_before": mm(fit.rmse_before),
        "rmse": mm(fit.rmse),
        "held_out": None if validation is None else mm(validation.rmse),
        "failed": [] if validation is None else _failures(validation),
        "scale": Number(fit.scale, 2),
        "stated": any(each.position_noise for each in fit.trials),
        "loss": fit.loss,
        "orientations": fit.orientations,
        "profiles": bool(profiles),
        "virtual": virtual(fit.trials),
        "assumed": assumed(fit.trials),
        "registrations": registration_lines(fit),
        "given": [f"{name} = {text}" for name, text in given(fit, provenance)],
        "date": provenance.date,
        "files": [(name, digest[:12]) for name, digest in provenance.files],
        "robot_file": None if robot is None else robot_file(robot),
        "scene_file": SCENE,
        "evaluations": fit.evaluations,
        "solves": fit.solves,
    }


def registration_lines(fit: Fit) -> list[str]:
    """A line for each way in which trials came into the world."""
    by: dict[str, list[str]] = {}
    for trial in fit.trials:
        by.setdefault(trial.origin.get("registration", "not said"), []).append(trial.name)
    return [f"{', '.join(names)}: {text}" for text, names in by.items()]


def given(fit: Fit, provenance: Provenance) -> list[tuple[str, str]]:
    """(name, value with unit) of the numbers that were held at a value said by hand."""
    from ..measurement.unknowns import unknowns

    held = unknowns(provenance.given, fit.trials, fit.setup) if provenance.given else ()
    return [(each.name, each.told(each.start, 6)) for each in held]


def number_table(fit: Fit, profiles: Sequence[Profile]) -> Table:
    """Each number with its start, standard error, and interval; by likelihood too where there are profiles."""
    by = {each.name: each for each in profiles}
    rows: list[list[Cell]] = []
    for i, unknown in enumerate(fit.unknowns):
        value, error, low, high = (float(each[i]) for each in (fit.values, fit.standard_errors, fit.low, fit.high))
        cells = [_cell(unknown, each, error) for each in (unknown.start, value, error)]
        row: list[Cell] = [unknown.name, *cells, whole(span(unknown, low, high, error))]
        if by:
            of = by.get(unknown.name)
            row.append("not computed" if of is None else whole(span(unknown, of.low, of.high, error)))
        rows.append([*row, unknown.unit or "1", _meaning(unknown)])
    likelihood = ["95 % by likelihood"] if by else []
    header = ("number", "start", "value", "standard error", "95 %", *likelihood, "unit", "what it is")
    return Table(name="numbers", header=header, rows=rows)


def correlation_table(fit: Fit) -> Table:
    """The correlation matrix."""
    rows = [[name, *(Number(float(x), 3) for x in row)] for name, row in zip(fit.names, fit.correlation, strict=True)]
    return Table(name="correlation", header=("", *fit.names), rows=rows)


def sample_table(fit: Fit) -> Table:
    """How many samples of each tracker were used, and why others were not."""
    rows: list[list[Cell]] = []
    for i, trial in enumerate(fit.trials):
        for j, (name, count) in enumerate(trial.counts().items()):
            at = trial.places[j]
            lost = [f"{escape(reason)} {n}" for reason, n in count.most_common() if reason != KEPT]
            of = (fit.where[:, 0] == i) & (fit.where[:, 2] == j) & ~fit.used
            lost += [f"outlier {int(of.sum())}"] if of.any() else []
            place = "base" if np.isnan(at) else Number(at / trial.robot.length_na, 2)
            counted = Number(count[KEPT] - int(of.sum()), 0)
            cells: list[Cell] = [escape(trial.name), escape(name), place, Number(sum(count.values()), 0), counted]
            rows.append([*cells, ", ".join(lost) or "none"])
    header = ("trial", "tracker", "<i>s</i> / <i>L</i><sub>na</sub>", "samples", "used", "not used")
    return Table(name="samples", header=header, rows=rows)


def validation_table(fit: Fit, found: CrossValidation) -> Table:
    """Errors of each part before, in the fit, and held out."""
    rows: list[list[Cell]] = []
    for k, name in enumerate(found.folds):
        part = found.used & (found.fold == k)
        errors = [mm(_rms(each[part]), 3) for each in (fit.distance_before, fit.distance, found.distance)]
        rows.append([escape(name), Number(int(part.sum()), 0), *errors])
    header = ("held out", "poses", "before (mm)", "in the fit (mm)", "held out (mm)")
    return Table(name="held_out", header=header, rows=rows)


def _headline(fit: Fit, i: int) -> str:
    """Such as youngs_modulus = 68.42 ± 0.52 GPa (95 %: 67.40 to 69.44; start 75 GPa)."""
    unknown, error = fit.unknowns[i], float(fit.standard_errors[i])
    value = with_error(unknown, float(fit.values[i]), error)
    between = span(unknown, float(fit.low[i]), float(fit.high[i]), error)
    text = f"<b>{unknown.name} = {value}</b> (95 %: {between}; start {unknown.told(unknown.start)})"
    return minus(text)


def _meaning(unknown: Unknown) -> str:
    return MEANINGS.get(unknown.name, "the robot’s")


def _cell(unknown: Unknown, value: float, error: float) -> Cell:
    places = decimals(error * unknown.per_si)
    return number(unknown, value, error) if places is None else Number(value * unknown.per_si, places)


def _failures(found: CrossValidation) -> list[str]:
    return [f"{name}: {note}" for name, note in zip(found.folds, found.notes, strict=True) if note]


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'s' if n != 1 else ''}"


def _rms(distance: np.ndarray) -> float:
    known = distance[np.isfinite(distance)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def _pictures(fit: Fit, profiles: Sequence[Profile], validation: CrossValidation | None) -> list[Picture]:
    from ..plot import fit_errors, identification

    found = []
    if profiles:
        found.append(Picture(name="profiles", draw=partial(identification.profile_figure, fit, profiles)))
    if len(fit.names) > 1:
        found.append(Picture(name="correlations", draw=partial(identification.correlation_figure, fit)))
    found.append(Picture(name="predictions", draw=partial(fit_errors.prediction_figure, fit)))
    found.append(Picture(name="residuals", draw=partial(fit_errors.residual_figure, fit)))
    if validation is not None:
        found.append(Picture(name="validation", draw=partial(identification.validation_figure, fit, validation)))
    return found
