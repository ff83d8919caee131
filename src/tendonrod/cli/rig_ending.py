"""What the commands of `tendonrod rig` do where their results lie, and how they end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..errors import Fact, InvalidInput
from . import output as out

if TYPE_CHECKING:
    from ..rig.loop import Outcome
    from ..rig.record import Record
    from ..rig.states import Fault
    from .rig_bench import Chosen


@contextmanager
def fresh(path: str, names: Sequence[str]) -> Iterator[Path]:
    """The directory ``path``, made if need be, in which none of ``names`` may be there yet.

    One that was made, and in which nothing came to be, is taken away again.
    """
    was_there = Path(path).is_dir()
    found = out.directory("--output", path)
    there = [name for name in names if (found / name).exists()]
    if there:
        allowed = f"a directory without {there[0]}: nothing is overwritten; name another, or move away what is there"
        raise InvalidInput("--output", Fact(path), allowed)
    try:
        yield found
    finally:
        if not was_there:
            with suppress(OSError):  # it is not empty
                found.rmdir()


def export_beside(record: Record, path: Path) -> Path | None:
    """The record's trial as .nc beside it, by frame of the tracker, or by period where it gave none; None if empty."""
    from ..rig.export import FRAMES, SAMPLES, export

    if not len(record.samples):
        return None
    target = path.with_suffix(".nc")
    with out.written("--output", target):
        export(record, target, at=FRAMES if len(record.frames) else SAMPLES)
    return target


@contextmanager
def kept(path: Path, place: Chosen) -> Iterator[None]:
    """Around a task: where a second Ctrl-C cuts it off, what there is of it is kept, and what is to be done is said."""
    try:
        yield
    except KeyboardInterrupt:
        if path.is_file():
            _keep(path, place)
        raise


def _keep(path: Path, place: Chosen) -> None:
    from ..rig.record import read_record

    record = read_record(path)
    out.note(f"wrote {path}, {record.condition}")
    export_beside(record, path)
    if len(record.samples):
        tension = float(record.samples["force"]["tension"][-1])
        out.note(f"all axes were stopped where they stood, the tendon has {tension:.3g} N{_let_go(place)}")


def _let_go(place: Chosen) -> str:
    """How a tendon that is left taut is let go."""
    if place.is_virtual:
        return ", on a bench that is gone with its program"
    rehearse = f" --rehearse {place.asked.rehearse}" if place.asked.rehearse else ""
    robot = "" if place.robot == "exonav-1" else f" --robot {place.robot}"
    return f": tendonrod rig release --bench {place.file}{rehearse}{robot} lets it go"


def end(place: Chosen, outcomes: Sequence[tuple[str, Outcome]], record: Callable[[int], Record]) -> None:
    """Leave with the exit status that the last of the named outcomes asks for, a line that says why, and what helps."""
    from ..rig.states import FaultKind, Reaction

    name, last = outcomes[-1]
    if last.is_done:
        return
    fault, kept_record = last.fault, record(len(outcomes) - 1)
    if fault is not None and fault.kind is FaultKind.EMERGENCY and fault.reaction is Reaction.RELEASE:
        raise typer.Exit(130)
    from .rig_page import fault_line

    file = Path(kept_record.name).name
    out.note(f"error: {name}: {fault_line(fault)}; {file} is {kept_record.condition}")
    for text in advice(place, fault):
        out.note(text)
    raise typer.Exit(1)


def advice(place: Chosen, fault: Fault | None) -> list[str]:
    """What to do about a fault, where there is something that can be done."""
    from ..rig.states import FaultKind, Reaction

    if fault is None:
        return []
    said = []
    if fault.reaction is Reaction.STOP and not place.is_virtual:
        said.append(f"the tendon keeps its tension{_let_go(place)}")
    held_up = (FaultKind.COMMAND_TIMEOUT, FaultKind.LATE, FaultKind.STALE_SENSOR)
    if fault.kind in held_up and (place.asked.real_time or not place.is_virtual):
        said.append(
            "this program may have been held up by others on this machine: end them, or give it precedence, as "
            "chrt --fifo 50 tendonrod rig ... does; see the docs, Devices of the bench, Real time"
        )
    return said
