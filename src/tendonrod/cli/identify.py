"""`tendonrod identify`: numbers of robot and bench from measured trials, and how sure they are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import MISSING, Fact, InvalidInput, finite, one_of
from . import output
from .arguments import Json, chosen_robot, chosen_trials, in_words, whole
from .every import Every, thin
from .identify_page import names_dict, names_page, page
from .trials_page import lost

if TYPE_CHECKING:
    from ..measurement.crossvalidation import CrossValidation
    from ..measurement.fittedfile import Provenance
    from ..measurement.identification import Fit
    from ..measurement.profiles import Profile
    from ..measurement.setup import Setup
    from ..measurement.trial import Trial
    from ..robot import Robot

_IN_WORDS = {
    "free": "--free",
    "trials": "TRIAL",
    "folds": "--folds",
    "orientations": "--orientations",
    "base_tracker": "--base-tracker",
}


def identify(
    trials: Annotated[list[str] | None, typer.Argument(metavar="TRIAL", hidden=True)] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME,...", help="Numbers to identify; --names lists them."),
    ] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE,...", help="Where free numbers start, in the units of --names."),
    ] = None,
    hold: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE,...", help="Numbers that are known to be other than said.")
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="ROBOT", help="The model's robot, instead of that of the trials.")
    ] = None,
    torsion: Annotated[
        str | None,
        typer.Option(metavar="MODEL", help="published, open_section or homogenized, instead of the robot's own."),
    ] = None,
    orientations: Annotated[
        bool, typer.Option("--orientations", help="Measured orientations count beside positions.")
    ] = False,
    base_tracker: Annotated[
        bool,
        typer.Option("--base-tracker", help="What a tracker on the base sees of the exit counts for the base's place."),
    ] = False,
    loss: Annotated[
        str, typer.Option(metavar="NAME", help="huber, robust against outliers, or squares, which is not.")
    ] = "huber",
    no_profiles: Annotated[
        bool, typer.Option("--no-profiles", help="Leave out the profiles, which take the longest.")
    ] = False,
    folds: Annotated[
        str | None,
        typer.Option(metavar="COUNT", help="Blocks of cross-validation, 0 for none. Left out: trial by trial, or 5."),
    ] = None,
    output_directory: Annotated[
        str | None,
        typer.Option("--output", metavar="DIR", help="Write fitted robot, scene, page and tables here."),
    ] = None,
    names: Annotated[
        bool, typer.Option("--names", help="List what may be identified, of TRIAL's robot too, and exit.")
    ] = False,
    every: Every = None,
    json: Json = False,
) -> None:
    """Identify numbers of robot and bench from measured trials, and say how sure they are.

    TRIAL: a .nc, or a CSV file with its column map beside it; what needs more to be said of it, such as --tracker or
    --drive, goes through tendonrod trial FILE --output TRIAL.nc first. All of one bench together, the one with the
    tracker on the base too. Refused by name: what the data cannot determine. An interrupt after the fit prints what is
    done and keeps what is written.
    """
    model = None if robot is None else chosen_robot(robot, torsion)
    if not trials and not names:
        raise InvalidInput("TRIAL", MISSING, "given; see tendonrod identify --help")
    given = chosen_trials(trials, model, torsion) if trials else []
    if names:
        output.say_json(names_dict(given, model)) if json else output.say(names_page(given, model))
        return
    given = thin(given, every)
    one_of("--loss", loss, ("huber", "squares"))
    blocks = None if folds is None else _folds(folds, given)
    wanted, setup, held = _asked(given, model, free or [], start or [], hold or [])
    task = Task(profiles=not no_profiles, folds=blocks)
    if output_directory is not None:
        task.directory = output.directory("--output", output_directory)
    from ..measurement.fittedfile import Provenance, checksums

    with in_words(_IN_WORDS):
        fit = _fitted(given, wanted, setup, orientations=orientations, loss=loss, base_tracker=base_tracker)
        told = Provenance(files=checksums(trials or []), given=held)
        try:
            task.run(fit, told)
        finally:  # an interrupt or a full disk does not take the fit away
            _say(fit, told, task, json)


def _say(fit: Fit, told: Provenance, task: Task, json: bool) -> None:
    if json:
        from ..measurement.fitrecord import as_dict

        output.say_json(as_dict(fit, told, task.found, task.validation))
    else:
        output.say(page(fit, told, task.found, task.validation))


def _folds(text: str, trials: Sequence[Trial]) -> int:
    """0, or how many blocks, as many as there are samples at most."""
    import numpy as np

    samples = sum(int(np.any(each.kept & each.on_robot, axis=1).sum()) for each in trials)
    if samples < 2 or text.strip() == "0":
        return whole("--folds", text, 0, 0)
    try:
        return whole("--folds", text, 2, samples)
    except InvalidInput as error:
        raise InvalidInput("--folds", error.value, f"0 for none, or a whole number from 2 to {samples}") from None


def _asked(
    trials: Sequence[Trial], robot: Robot | None, free: Sequence[str], start: Sequence[str], hold: Sequence[str]
) -> tuple[tuple[str, ...], Setup, tuple[str, ...]]:
    """(names to free, setup to start from, names held by hand)."""
    from ..measurement.names import expanded
    from ..measurement.setup import Setup

    typed = [each.strip() for text in free for each in text.split(",")]
    if not any(typed):
        raise InvalidInput("--free", MISSING, "names of numbers to identify; see tendonrod identify --names")
    setup = Setup(robot=robot)
    with in_words(_IN_WORDS):
        wanted = expanded(typed, trials, setup)
        setup, held = _with_values("--hold", hold, trials, setup)
        setup, started = _with_values("--start", start, trials, setup)
    for name in held:
        if name in wanted:
            raise InvalidInput("--hold", Fact(name), "a number that is not in --free; --start says where one starts")
    for name in started:
        if name not in wanted:
            raise InvalidInput("--start", Fact(name), "a number that is in --free; --hold sets others")
    return wanted, setup, held


def _with_values(
    option: str, texts: Sequence[str], trials: Sequence[Trial], setup: Setup
) -> tuple[Setup, tuple[str, ...]]:
    from ..measurement.names import check_name
    from ..measurement.unknowns import unknowns

    given: list[str] = []
    for text in (part.strip() for each in texts for part in each.split(",")):
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise InvalidInput(option, Fact(text or "''"), "NAME=VALUE, as youngs_modulus=70 or base_tilt_y=-4deg")
        check_name(option, name, trials, setup)
        if name in given:
            raise InvalidInput(option, Fact(name), "given once")
        (unknown,) = unknowns((name,), trials, setup)
        number = _number(f"{option} {name}", value, unknown.unit) / unknown.per_si
        try:
            setup = setup.changed({name: number}, trials)
        except InvalidInput as error:
            raise InvalidInput(f"{option} {name}", Fact(value), f"{error.allowed} (in SI units)") from None
        given.append(name)
    return setup, tuple(given)


def _number(option: str, text: str, unit: str) -> float:
    """The number of ``text`` in ``unit``, which may stand after it."""
    bare = re.sub(rf"\s*{re.escape(unit)}$", "", text) if unit else text
    try:
        return finite(option, float(bare))
    except ValueError:
        allowed = f"a number{f' in {unit}' if unit else ''}"
        raise InvalidInput(option, Fact(text or "''"), allowed) from None


def _fitted(trials: Sequence[Trial], wanted: Sequence[str], setup: Setup, **how: Any) -> Fit:
    from ..measurement.identification import identify as fit_to

    try:
        with output.progress_bar("fitting") as watch:
            return fit_to(trials, wanted, setup=setup, **how, watch=watch)
    except InvalidInput as error:
        raise InvalidInput(error.field, error.value, error.allowed + _why(error.field, trials)) from None


def _why(field: str, trials: Sequence[Trial]) -> str:
    """What a refusal of ``field`` may come from."""
    from ..measurement.registration import registrations

    if field == "trials":
        return f": {lost(trials)}"
    notes = dict.fromkeys(each.note for each in registrations(trials) if each.note) if field == "free" else ()
    return "".join(f"; {note}" for note in notes)


@dataclass
class Task:
    """What follows the fit. found, validation: what is done of it; files in ``directory`` always hold that."""

    profiles: bool
    folds: int | None
    directory: Path | None = None
    found: list[Profile] = field(default_factory=list)
    validation: CrossValidation | None = None

    def run(self, fit: Fit, told: Provenance) -> None:
        """Write the fit, then profiles and cross-validation, and the whole again."""
        self.write(fit, told, first=True)
        try:
            self._profiles(fit)
            self._cross_validate(fit)
        except KeyboardInterrupt:
            self._keep(fit, told)
            raise
        if self.found or self.validation is not None:
            self.write(fit, told)
        if self.directory is not None:
            output.note(f"wrote {self.directory / 'index.html'}")

    def write(self, fit: Fit, told: Provenance, first: bool = False) -> None:
        """All files, with what there is of profiles and cross-validation."""
        if self.directory is None:
            return
        from ..measurement.fitrecord import write_record
        from ..measurement.fittedfile import write_fitted
        from ..report.identification import write_identification

        with output.filling("--output", self.directory):
            for path in write_fitted(fit, self.directory, told) if first else ():
                output.note(f"wrote {path}")
            write_record(fit, self.directory, told, self.found, self.validation)
        with output.filling("--output", self.directory), output.progress_bar("drawing") as watch:
            write_identification(fit, self.directory, self.found, self.validation, told, watch)

    def _profiles(self, fit: Fit) -> None:
        from ..measurement.profiles import profile

        with output.progress_bar("profiles") as watch:
            for k, name in enumerate(fit.names if self.profiles else ()):
                watch(k, len(fit.names), f"profile of {name}")
                self.found.append(profile(fit, name))

    def _cross_validate(self, fit: Fit) -> None:
        if self.folds == 0:
            return
        from ..measurement.crossvalidation import cross_validate

        with output.progress_bar("cross-validation") as watch:
            self.validation = cross_validate(fit, self.folds, watch)

    def _keep(self, fit: Fit, told: Provenance) -> None:
        """What is done when an interrupt comes."""
        if self.directory is None:
            return
        from ..measurement.fitrecord import write_record

        with output.filling("--output", self.directory):
            write_record(fit, self.directory, told, self.found, self.validation)
        done = f"{len(self.found)} of {len(fit.names)} profiles" if self.profiles else "no profiles"
        output.note(f"stopped after the fit, with {done}; what is done is in {self.directory}")
