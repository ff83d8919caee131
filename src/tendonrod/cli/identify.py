"""`tendonrod identify`: numbers of robot and bench from measured trials, and how sure they are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import MISSING, Fact, InvalidInput, finite, one_of
from . import output
from .arguments import Json, chosen_robot, chosen_trials, whole
from .identify_page import names_page, page

if TYPE_CHECKING:
    from ..measurement.crossvalidation import CrossValidation
    from ..measurement.fittedfile import Provenance
    from ..measurement.identification import Fit
    from ..measurement.profiles import Profile
    from ..measurement.setup import Setup
    from ..measurement.trial import Trial
    from ..robot import Robot

MOST_FOLDS = 10_000
_IN_WORDS = {
    "free": "--free",
    "trials": "TRIAL",
    "folds": "--folds",
    "orientations": "--orientations",
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
    json: Json = False,
) -> None:
    """Identify numbers of robot and bench from measured trials, and say how sure they are.

    TRIAL: a file as tendonrod trial reads it; all of one bench together, the one with the tracker on the base too.
    Refused by name: what the data cannot determine. An interrupt after the fit keeps what is written.
    """
    model = None if robot is None else chosen_robot(robot, torsion)
    if not trials and not names:
        raise InvalidInput("TRIAL", MISSING, "given; see tendonrod identify --help")
    given = chosen_trials(trials, model, torsion) if trials else []
    if names:
        output.say(names_page(given, model))
        return
    one_of("--loss", loss, ("huber", "squares"))
    blocks = None if folds is None else whole("--folds", folds, 0, MOST_FOLDS)
    wanted, setup, held = _asked(given, model, free or [], start or [], hold or [])
    task = Task(profiles=not no_profiles, folds=blocks)
    if output_directory is not None:
        task.directory = output.directory("--output", output_directory)
    with _in_words():
        fit = _fitted(given, wanted, setup, orientations, loss)
        from ..measurement.fittedfile import Provenance, checksums

        told = Provenance(files=checksums(trials or []), given=held)
        task.run(fit, told)
    if json:
        from ..measurement.fitrecord import as_dict

        output.say_json(as_dict(fit, told, task.found, task.validation))
    else:
        output.say(page(fit, told, task.found, task.validation))


@contextmanager
def _in_words() -> Iterator[None]:
    """The library's fields as the options that they came from."""
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(_IN_WORDS.get(error.field, error.field), error.value, error.allowed) from None


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
    with _in_words():
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


def _fitted(trials: Sequence[Trial], wanted: Sequence[str], setup: Setup, orientations: bool, loss: str) -> Fit:
    from ..measurement.identification import identify as fit_to

    with output.progress_bar("fitting") as watch:
        return fit_to(trials, wanted, setup=setup, orientations=orientations, loss=loss, watch=watch)


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

        if first:
            for path in write_fitted(fit, self.directory, told):
                output.note(f"wrote {path}")
        write_record(fit, self.directory, told, self.found, self.validation)
        with output.progress_bar("drawing") as watch:
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

        write_record(fit, self.directory, told, self.found, self.validation)
        done = f"{len(self.found)} of {len(fit.names)} profiles" if self.profiles else "no profiles"
        output.note(f"stopped after the fit, with {done}; what is done is in {self.directory}")
