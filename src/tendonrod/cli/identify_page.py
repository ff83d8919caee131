"""What `tendonrod identify` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import output
from .trials_page import assumptions, made_by

if TYPE_CHECKING:
    from ..measurement.crossvalidation import CrossValidation
    from ..measurement.fittedfile import Provenance
    from ..measurement.identification import Fit
    from ..measurement.profiles import Profile
    from ..measurement.trial import Trial
    from ..robot import Robot


def page(fit: Fit, told: Provenance, profiles: Sequence[Profile], validation: CrossValidation | None) -> str:
    """The fit as text for people."""
    from ..report.identification import registration_lines

    notes = assumptions(fit.trials)
    blocks = [output.heading(_title(fit)), *notes, _numbers(fit, profiles), "\n".join(_errors(fit, validation))]
    blocks += [_correlations(fit)] if len(fit.names) > 1 else []
    blocks += [lost] if (lost := _lost(fit)) else []
    blocks.append("\n".join([*registration_lines(fit), *_given(fit, told), *made_by(fit.trials)]))
    if fit.sentences:
        blocks.append("\n".join(fit.sentences))
    return "\n\n".join(blocks)


def _title(fit: Fit) -> str:
    models = dict.fromkeys(fit.setup.robot_of(each) for each in fit.trials)
    robots = ", ".join(f"{each.name}, torsion {each.torsion}" for each in models)
    used, m, k = int(fit.used.sum()), len(fit.names), len(fit.trials)
    numbers, trials = (f"{n} {what}{'s' if n != 1 else ''}" for n, what in ((m, "number"), (k, "trial")))
    return f"{robots}: {numbers} from {used} of {len(fit.where)} poses of {trials}"


def _numbers(fit: Fit, profiles: Sequence[Profile]) -> str:
    from ..measurement.rounding import number, span

    by, rows = {each.name: each for each in profiles}, []
    for i, unknown in enumerate(fit.unknowns):
        value, error, low, high = (float(each[i]) for each in (fit.values, fit.standard_errors, fit.low, fit.high))
        cells = [number(unknown, each, error) for each in (unknown.start, value, error)]
        between = [span(unknown, low, high, error)]
        if by:
            of = by.get(unknown.name)  # an interrupt leaves some out
            between.append("not computed" if of is None else span(unknown, of.low, of.high, error))
        rows.append([unknown.name, *cells, *between, unknown.unit])
    likelihood = ["95 %\nby likelihood"] if by else []
    columns = ["\n", "\nstart", "\nvalue", "standard\nerror", "\n95 %", *likelihood, "\nunit"]
    return output.table(columns, rows, words=(0,))


def _errors(fit: Fit, validation: CrossValidation | None) -> list[str]:
    lines = [f"RMSE {1e3 * fit.rmse_before:.3f} mm before, {1e3 * fit.rmse:.3f} mm fitted, poses that count"]
    if validation is not None:
        parts = "trial by trial" if not validation.folds[0].startswith("block ") else f"{len(validation.folds)} blocks"
        lines.append(f"RMSE {1e3 * validation.rmse:.3f} mm held out ({parts})")
        lines += [
            f"without {name}: {note}" for name, note in zip(validation.folds, validation.notes, strict=True) if note
        ]
    stated = any(each.position_noise for each in fit.trials)
    what = f"{fit.scale:.3g} times the noise that the trials state" if stated else "noise, for the trials state none"
    return [*lines, f"left over: {what}"]


def _correlations(fit: Fit) -> str:
    """The lower triangle; columns are numbered as rows are, since names are long."""
    rows = [
        [f"{i + 1} {name}", *(output.fixed(float(rho), 2) if j <= i else "" for j, rho in enumerate(row))]
        for i, (name, row) in enumerate(zip(fit.names, fit.correlation, strict=True))
    ]
    return output.table(["correlation", *(str(j + 1) for j in range(len(rows)))], rows, words=(0,))


def _lost(fit: Fit) -> str:
    """Why samples were not used; "" where all were."""
    from ..measurement.trial import KEPT

    rows = []
    for i, trial in enumerate(fit.trials):
        for j, (name, count) in enumerate(trial.counts().items()):
            outliers = int(((fit.where[:, 0] == i) & (fit.where[:, 2] == j) & ~fit.used).sum())
            lost = [(reason, n) for reason, n in count.most_common() if reason != KEPT]
            lost += [("outlier", outliers)] if outliers else []
            rows += [(trial.name, name, reason, str(n)) for reason, n in lost]
    return output.table(("trial", "tracker", "not used", "samples"), rows, words=(0, 1, 2)) if rows else ""


def _given(fit: Fit, told: Provenance) -> list[str]:
    from ..report.identification import given

    return [f"given by hand: {name} = {text}" for name, text in given(fit, told)]


def names_page(trials: Sequence[Trial], robot: Robot | None) -> str:
    """All names that --free takes, with units and meanings; of the robot too, if there is one."""
    from ..measurement.names import GROUPS, MEANINGS
    from ..measurement.setup import Setup, the_robot
    from ..measurement.unknowns import unknowns

    rows = [[each.name, each.unit, MEANINGS[each.name]] for each in unknowns(tuple(MEANINGS), (), Setup())]
    groups = [[name, ", ".join(each)] for name, each in GROUPS.items()]
    blocks = [output.heading("Of the bench"), output.table(["", "unit", ""], rows, words=(0, 1, 2))]
    blocks += [output.heading("Several at once"), output.table(["", ""], groups, words=(0, 1))]
    if robot is None and trials:
        robot = the_robot(Setup(), trials)
    if robot is None:
        blocks.append("Of the robot: the numbers of its file, as youngs_modulus; with TRIAL they are listed.")
    else:
        blocks += [output.heading(f"Of the robot, {robot.name}"), _robot_numbers(robot)]
    return "\n\n".join(blocks)


def _robot_numbers(robot: Robot) -> str:
    from ..measurement.unknowns import unit_of

    rows = []
    for name, value in robot.parameters().items():
        unit, per_si = unit_of(robot, name)
        rows.append([name, f"{value * per_si:.6g}", unit])
    return output.table(["", "now", "unit"], rows, words=(0, 2))


def names_dict(trials: Sequence[Trial], robot: Robot | None) -> dict[str, Any]:
    """The same for JSON. unit: of --start and --hold; per_si: how many of it are one of SI; value: SI."""
    from ..measurement.names import GROUPS, MEANINGS
    from ..measurement.setup import Setup, the_robot
    from ..measurement.unknowns import unit_of, unknowns

    known = the_robot(Setup(), trials) if robot is None and trials else robot
    bench = [
        {"name": each.name, "unit": each.unit, "per_si": each.per_si, "meaning": MEANINGS[each.name]}
        for each in unknowns(tuple(MEANINGS), (), Setup())
    ]
    numbers = []
    for name, value in known.parameters().items() if known is not None else ():
        unit, per_si = unit_of(known, name)  # pyright: ignore[reportArgumentType]
        numbers.append({"name": name, "unit": unit, "per_si": per_si, "value": value})
    groups = {name: list(each) for name, each in GROUPS.items()}
    return {"bench": bench, "groups": groups, "robot": None if known is None else known.name, "robot_numbers": numbers}
