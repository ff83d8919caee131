"""`tendonrod rig replay`, `export`, `design`: what needs no bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, nonnegative, one_of, positive
from . import output as out
from .arguments import Json, RobotName, bench_robot, number, vector
from .rig_bench import BenchTorsion, Output, fresh, option

if TYPE_CHECKING:
    from ..plot.loop_design import Trace
    from ..robot import Robot

RecordName = Annotated[str, typer.Argument(metavar="RECORD", hidden=True)]


def replay(record: RecordName, json: Json = False) -> None:
    """Replay a record sample by sample, and say what is in it.

    RECORD: a file of rig ftl, run, hold or retract, also one that a crash has cut off or that is still being written.
    States, faults and messages come in the order of time. Exit status 1 where the record is not complete.
    """
    from ..rig.record import read_record
    from ..rig.replay import replay as replayed
    from .rig_page import record_dict, record_page

    found = read_record(record)
    count = sum(1 for _ in replayed(found))
    if json:
        out.say_json(record_dict(found, count))
    else:
        out.say(record_page(found, count))
    if not found.is_complete:
        raise typer.Exit(1)


def export(
    record: RecordName,
    output: Annotated[
        str,
        option("FILE", "A .nc, as tendonrod validate reads it; or a .csv, .frames.csv beside it.", "--output", "-o"),
    ],
    at: Annotated[
        str, option("NAME", "A sample of the .nc is one of frames, of the tracker; samples, of the controller.", "--at")
    ] = "frames",
) -> None:
    """Write a record as a trial (.nc), or as it is (.csv).

    RECORD: a file of rig ftl, run, hold or retract. The CSV has every control period to the last bit, SI, and a second
    file with the tracker's frames.
    """
    one_of("--at", at, ("frames", "samples"))
    file = out.target("--output", output, (".nc", ".csv"))
    assert file is not None
    for each in (file, file.with_suffix(".frames.csv")) if file.suffix == ".csv" else (file,):
        if each.exists():
            raise InvalidInput("--output", Fact(str(each)), "a new file: nothing is overwritten")

    from ..rig.export import export as write
    from ..rig.record import read_record

    found = read_record(record)
    fields = {"at": at} if file.suffix == ".nc" else {}
    with out.written("--output", file):
        write(found, file, **fields)
    if not found.is_complete:
        out.warn([f"{record}: {found.condition}"])


def design(
    robot: RobotName,
    output: Output,
    tension: Annotated[str, option("N", "At which the loop is looked at, N.", "--tension")] = "0.7",
    gravity: Annotated[str, option("X,Y,Z", "Gravity in the world frame, m/s2.", "--gravity")] = "0,0,0",
    compliance_mm_n: Annotated[str, option("MM/N", "Of the tendon itself, from screw to tip.")] = "0.51",
    screw_rate_mm_s: Annotated[str, option("MM/S", "At which the screw pays the tendon out.")] = "0.45",
    compare: Annotated[
        bool, typer.Option("--compare", help="Also run a virtual trial with PI and one with PI + feed-forward.")
    ] = False,
    torsion: BenchTorsion = None,
) -> None:
    """Gains of the tension loop, on a page: diagram, margins, steps.

    ROBOT: a preset, or the path of a robot's TOML file. The paper's gains, and those with a phase margin of 60 degrees
    where the body is shortest and no swing where it is longest. DIR gets index.html.
    """
    tau, pull = number("--tension", tension, positive), vector("--gravity", gravity)
    soft = 1e-3 * number("--compliance-mm-n", compliance_mm_n, nonnegative)
    pace = 1e-3 * number("--screw-rate-mm-s", screw_rate_mm_s, positive)
    body = bench_robot(robot, torsion)
    directory = fresh(output, ["index.html"])

    from ..report.loop_design import design_page

    traces = _compared(body, tau, pull, pace) if compare else {}
    page = design_page(directory, body, tau, pull, soft, screw_rate=pace, traces=traces)
    out.say(f"{body.name}, torsion {body.torsion}: {page}")


def _compared(robot: Robot, tension: float, gravity: Any, pace: float) -> dict[str, Trace]:
    """A virtual trial with PI and one with PI + feed-forward; their records are not kept."""
    from tempfile import TemporaryDirectory

    from ..plot.loop_design import Trace
    from ..rig.inserted import way_out
    from ..rig.profiles import profile
    from ..rig.trials import follow_leader
    from ..rig.virtual.setup import VirtualSetup

    setup, found = VirtualSetup(robot=robot, gravity=gravity), {}
    soft = setup.tendon_length / setup.tendon_stiffness
    wanted = profile("plan", robot, tension, gravity, compliance=soft)
    with TemporaryDirectory() as folder, out.progress_bar("comparing") as watch:
        for k, name in enumerate(("PI", "PI + feed-forward")):
            watch(k, 2)
            path = Path(folder) / f"{k}.rec"
            done = follow_leader(setup, wanted, tension, path, screw_rate=pace, feed_forward=bool(k))
            way = done.record.samples[way_out(done.record)]
            z = way["translation"]["position"]
            found[name] = Trace(
                time=way["time"] - way["time"][0], insertion=z / robot.section.L, tension=way["force"]["tension"],
                target=way["command"]["target"], velocity=way["command"]["translation"],
            )  # fmt: skip
    return found
