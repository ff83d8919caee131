"""`tendonrod session`: what a recorded session becomes."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput
from . import output as out
from .arguments import Json, in_words, whole

if TYPE_CHECKING:
    from ..navigate.snapshot import Snapshot
    from ..report.navigation import Told

FRAMES = "120"
_ENDED = "The record is complete."
_CUT = "The record has no end: its session is still open, or its program was stopped; all is shown that it says so far."


def session(
    record: Annotated[str, typer.Argument(metavar="RECORD", hidden=True)],
    output: Annotated[str, typer.Option("--output", metavar="DIR", help="Directory of the page; made if need be.")],
    frames: Annotated[
        str, typer.Option("--frames", metavar="WHOLE", help="Of animation.gif and frames.nc, 2 to 2000; 0: neither.")
    ] = FRAMES,
    unchecked: Annotated[
        bool,
        typer.Option("--unchecked", help="Go on where this installation computes other last bits; the page says so."),
    ] = False,
    json: Json = False,
) -> None:
    """A recorded session as a page with pictures, metrics and animation frames.

    RECORD: a file that tendonrod navigate has written, also one that a crash has cut off. The session is computed again
    from its commands and compared bit for bit with what was recorded. DIR gets index.html, its figures (PNG, SVG) and
    tables (CSV), metrics.json, frames.nc and animation.gif. Running it again is safe.
    """
    count = whole("--frames", frames, 0, 2000)
    if count == 1:
        raise InvalidInput("--frames", Fact("1"), "0 or a whole number from 2 to 2000")

    from ..navigate.replay import read_header
    from ..navigate.scenariofile import scenario_from
    from ..report.navigation import write_navigation
    from .navigate_script import metrics_page

    with in_words({"record": "RECORD"}):
        header, (steps, is_complete) = read_header(record), _length(record)
    directory = out.directory("--output", output)
    with out.progress_bar("replaying") as watch, out.filling("--output", directory):
        scenario = scenario_from(header["scenario"], record)
        snapshots = _counted(record, not unchecked, steps, watch)
        told = _told(record, header, directory, count, unchecked, is_complete)
        page, measured = write_navigation(snapshots, scenario, directory, told, count, watch)
    if json:
        out.say_json({"record": record, "complete": is_complete, "page": str(page)} | measured.to_dict())
    else:
        out.say("\n\n".join([metrics_page(scenario, record, measured), f"Page: {page}"]))
    if not is_complete:
        out.warn([f"{record}: {_CUT}"])


def _length(record: str) -> tuple[int, bool]:
    """Steps and events in a record, and whether its last line says that it ended."""
    from ..navigate.replay import lines

    steps, last = 1, {}
    for last in lines(record):
        steps += last.get("count", 1)
    return steps, last.get("event") == "end"


def _counted(record: str, check: bool, steps: int, watch: Callable[..., None]) -> Iterator[Snapshot]:
    from ..navigate.replay import replay

    for k, snapshot in enumerate(replay(record, check=check)):
        watch(k, steps, "replaying")
        yield snapshot


def _told(
    record: str, header: dict[str, Any], directory: Path, frames: int, unchecked: bool, is_complete: bool
) -> Told:
    """What the page says of where it comes from."""
    from ..report.navigation import Told

    again = "It was computed again from its commands" + (
        ", without comparing each step with the record." if unchecked else " and agrees with the record bit for bit."
    )
    options = (f" --frames {frames}" if frames != int(FRAMES) else "") + (" --unchecked" if unchecked else "")
    command = f"tendonrod session {shlex.quote(record)} --output {shlex.quote(str(directory))}{options}"
    end = _ENDED if is_complete else _CUT
    return Told(record=Path(record).name, again=f"{again} {end}", command=command, versions=header.get("software"))
