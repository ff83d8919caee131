"""`tendonrod rig replay`, `export`, `design`: what needs no bench."""

from __future__ import annotations

from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import Fact, InvalidInput, nonnegative, one_of, positive
from . import output as out
from .arguments import Json, RobotName, number
from .every import Every, asked
from .rig_arguments import BenchTorsion, Output, RecordName, ScrewRate, option
from .rig_bench import Asked, chosen
from .rig_ending import fresh
from .rig_limits import admit, limits_for

if TYPE_CHECKING:
    from ..rig.asked_again import Verdict
    from ..rig.record import Record


def replay(record: RecordName, json: Json = False) -> None:
    """Replay a record sample by sample, and say what is in it.

    RECORD: a file of rig ftl, run, hold or retract, also one that a crash has cut off or that is still being written.
    States, faults and messages come in the order of time. The interlock is asked again about every sample: the same
    samples give the same states and faults. Exit status 1 where they do not, or the record is not complete.
    """
    from ..rig.record import read_record
    from ..rig.replay import replay as replayed
    from .rig_page import record_dict, record_page

    found = read_record(record)
    count = sum(1 for _ in replayed(found))
    verdict = _asked_again(found)
    if json:
        out.say_json(record_dict(found, count, verdict))
    else:
        out.say(record_page(found, count, verdict))
    if not found.is_complete or not (isinstance(verdict, str) or verdict.agrees):
        raise typer.Exit(1)


def _asked_again(record: Record) -> Verdict | str:
    """What the interlock says to the samples today; why it cannot be asked, where the header does not tell."""
    from ..errors import TendonrodError
    from ..rig.asked_again import ask_again

    try:
        return ask_again(record)
    except TendonrodError as error:
        return f"not asked again: {error}"


def export(
    record: RecordName,
    output: Annotated[
        str,
        option("FILE", "A .nc, as tendonrod validate reads it; or a .csv, .frames.csv beside it.", "--output", "-o"),
    ],
    at: Annotated[
        str | None,
        option(
            "NAME",
            "A sample of the .nc is one of frames, of the tracker, as left out; samples, of the controller.",
            "--at",
        ),
    ] = None,
    every: Every = None,
) -> None:
    """Write a record as a trial (.nc), or as it is (.csv).

    RECORD: a file of rig ftl, run, hold or retract. The CSV has every control period to the last bit, SI, and a second
    file with the tracker's frames.
    """
    one_of("--at", at or "frames", ("frames", "samples"))
    file = out.target("--output", output, (".nc", ".csv"))
    assert file is not None
    kind = file.suffix.lower()
    if kind == ".csv" and at is not None:
        raise InvalidInput("--at", Fact(at), "left out for CSV, which has every control period")
    if every is not None and (kind == ".csv" or at == "samples"):
        raise InvalidInput("--every", Fact(every), "left out but for a .nc of the tracker's frames")
    thinner = asked(every)
    for each in (file, file.with_suffix(".frames.csv")) if kind == ".csv" else (file,):
        if each.exists():
            raise InvalidInput("--output", Fact(str(each)), "a new file: nothing is overwritten")

    from ..rig.export import export as write
    from ..rig.record import read_record

    found = read_record(record)
    fields = {"at": at or "frames", **thinner} if kind == ".nc" else {}
    with out.written("--output", file):
        trial = write(found, file, **fields)
    if trial is not None and thinner:
        out.note(f"--every {every}: {trial.origin['thinned']}")
    if not found.is_complete:
        out.warn([f"{record}: {found.condition}"])


def design(
    robot: RobotName,
    output: Output,
    tension: Annotated[str, option("N", "At which the loop is looked at, N.", "--tension")] = "0.7",
    gravity: Annotated[str, option("X,Y,Z", "Gravity in the world frame, m/s2.", "--gravity")] = "0,0,0",
    compliance_mm_n: Annotated[str, option("MM/N", "Of the tendon itself, from screw to tip.")] = "0.51",
    screw_rate_mm_s: ScrewRate = "0.45",
    compare: Annotated[
        bool, typer.Option("--compare", help="Also run a virtual trial with PI and one with PI + feed-forward.")
    ] = False,
    torsion: BenchTorsion = None,
    json: Json = False,
) -> None:
    """Gains of the tension loop, on a page: diagram, margins, steps.

    ROBOT: a preset, or the path of a robot's TOML file. The paper's gains, and those with a phase margin of 60 degrees
    where the body is shortest and no swing where it is longest; rig ftl takes them as --kp and --ki. DIR gets
    index.html.
    """
    tau = number("--tension", tension, positive)
    soft = 1e-3 * number("--compliance-mm-n", compliance_mm_n, nonnegative)
    pace = 1e-3 * number("--screw-rate-mm-s", screw_rate_mm_s, positive)
    place = chosen(robot, Asked(torsion=torsion, gravity=gravity))
    admit(limits_for(place), place, "--tension", tau)

    from ..report.loop_design import command, design_page
    from ..rig.design import designed
    from .rig_design import compared, design_dict, design_text

    body, pull = place.source.robot, place.source.gravity
    typed = quote(robot) + ("" if torsion is None else f" --torsion {torsion}")
    with fresh(output, ["index.html"]) as directory:
        found = designed(body, tau, pull, soft)
        traces = compared(body, tau, pull, pace) if compare else {}
        page = design_page(directory, found, pace, traces, source=typed)
    told = (found, pace, command(found, typed))
    if json:
        out.say_json(design_dict(*told))
    else:
        out.say(design_text(*told))
    out.note(f"wrote {page}, and the figures and tables beside it")
