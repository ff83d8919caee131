"""`tendonrod trial`: what files of measurements hold, which samples count, and the same as another kind of file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, nonnegative, positive, within
from . import output
from .arguments import Json, chosen_robot, in_words, number, vector
from .trial_files import check_targets
from .trial_page import as_dict, page

if TYPE_CHECKING:
    from ..measurement.placing import Place
    from ..measurement.trial import Trial
    from ..robot import Robot

_WORDS = {
    "path": "FILE",
    "columns": "--columns",
    "robot": "--robot",
    "places": "--tracker",
    "drive": "--drive",
    "align": "--align",
}
_PLACES = "tip, base, millimetres along L_na, as 40mm, or a share of it, as 50%"
KINDS = (".nc", ".csv")


def trial(
    files: Annotated[list[str], typer.Argument(metavar="FILE", hidden=True)],
    columns: Annotated[
        str | None, typer.Option(metavar="MAP.toml", help="Column map of CSV and track files; a .nc needs none.")
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="Preset, or path of a TOML file, instead of that of file or map."),
    ] = None,
    tracker: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=PLACE",
            help="Where a tracker sits, instead of what file or map says; its holder stays. Once per tracker: tip=tip, "
            "base=base, mid=40mm along L_na, or mid=50%.",
        ),
    ] = None,
    gravity: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Gravity in the world frame, m/s2, instead of file's or map's.")
    ] = None,
    drive: Annotated[
        str | None, typer.Option(metavar="FILE.csv", help="What drove the robot, for a track file of NDI's.")
    ] = None,
    drive_offset: Annotated[
        str, typer.Option(metavar="SECONDS", help="What the drive's clock shows when the tracker's shows 0.")
    ] = "0",
    align: Annotated[
        str, typer.Option(metavar="HOW", help="clock, or first: both clocks start at first rows.")
    ] = "clock",
    rate: Annotated[str, typer.Option(metavar="HZ", help="Frames per second of the tracker.")] = "40",
    output_file: Annotated[
        str | None,
        typer.Option("--output", metavar="FILE", help="Write the trial, .nc or .csv with a column map."),
    ] = None,
    figure: Annotated[str | None, typer.Option(metavar="FILE", help="Draw to a .png, .svg or .pdf file.")] = None,
    json: Json = False,
) -> None:
    """Read measurements, tell which samples count and why others do not, convert.

    FILE: a trial as .nc, a CSV file with columns such as time_s, tension_N, insertion, rotation_deg, tip_x_mm,
    tip_y_mm, tip_z_mm, tip_qw, tip_qx, tip_qy, tip_qz, or a track file of NDI's software with --drive. MAP.toml says
    which columns hold what, and what the file does not say; left out, the .toml of the same name beside FILE counts, if
    there is one.
    """
    written = output.target("--output", output_file, KINDS)
    picture = output.target("--figure", figure, output.FIGURES)
    targets = {"--output": output_file, "--figure": figure}
    check_targets(targets, files, columns, {"--drive": drive, "--robot": robot})
    options: dict[str, Any] = {
        "robot": None if robot is None else _robot(robot),
        "places": dict(_place_of(each) for each in tracker or ()),
        "gravity": None if gravity is None else vector("--gravity", gravity),
        "drive": drive,
        "offset": number("--drive-offset", drive_offset),
        "align": align,
        "rate": number("--rate", rate, positive),
    }

    from ..measurement.columnmap import read_column_map
    from ..measurement.loading import load_trials

    with in_words(_WORDS):
        trials = load_trials(files, None if columns is None else read_column_map(columns, "--columns"), **options)
    if written is not None:
        _write(trials[0], written)
    if picture is not None:
        from ..plot.trials import trial_figure

        output.write_figure("--figure", picture, lambda: trial_figure(trials[0]))
    if json:
        output.say_json([as_dict(each) for each in trials])
    else:
        output.say("\n\n".join(page(each) for each in trials))
    for path, each in zip(files, trials, strict=True):
        for sentence in _notes(each):
            output.note(f"{path}: {sentence}")


def _robot(source: str) -> Robot:
    with in_words({"robot": "--robot"}):
        return chosen_robot(source)


def _notes(found: Trial) -> Iterator[str]:
    """What should not go unseen."""
    from ..measurement.ndifile import OUTSIDE
    from ..measurement.trial import NO_DRIVE

    told, riding = found.origin, found.fates[:, found.on_robot]
    if "replaced" in told:
        yield f"replaced by what the command line says: {told['replaced']}"
    if "columns not read" in told:
        yield f"columns left alone: {told['columns not read']}"
    if OUTSIDE in told:
        yield f"{OUTSIDE}: {told[OUTSIDE]}"
    if riding.size and (riding == NO_DRIVE).all():
        source = "--drive names the CSV file of what drove the robot" if "tools" in told else "no column tells it"
        yield f"no sample on the robot counts, for none has a tension or displacement: {source}"


def _place_of(text: str) -> tuple[str, Place]:
    from ..measurement.placing import Place
    from ..measurement.trial import BASE

    name, equals, place = (part.strip() for part in text.rpartition("="))
    if not name or not equals or not place:
        raise InvalidInput("--tracker", Fact(text or "''"), f"NAME=PLACE, with {_PLACES}")
    if place in ("tip", BASE):
        return name, Place(on=BASE) if place == BASE else Place()
    found = re.fullmatch(r"([-+.\deE]+)\s*(mm|%|)", place)
    if not found:
        raise InvalidInput(f"--tracker {name}", Fact(place), _PLACES)
    if found[2] == "%":
        return name, Place(share=0.01 * number(f"--tracker {name}", found[1], within, 0.0, 100.0))
    at = number(f"--tracker {name}", found[1], nonnegative)
    if not found[2] and 0.0 < at <= 1.0:
        raise InvalidInput(f"--tracker {name}", Fact(place), f"with its unit, {at:g}mm, or {100 * at:g}% of L_na")
    return name, Place(at=1e-3 * at)


def _write(found: Trial, path: Any) -> None:
    if path.suffix.lower() == ".nc":
        from ..measurement.trialfile import write_trial

        with output.written("--output", path):
            write_trial(found, path)
        return
    from ..measurement.csvfile import write_csv, written_with

    with output.written("--output", path):
        write_csv(found, path)
    for each in written_with(path, found):
        output.note(f"wrote {each}, which {path.name} is read with")
