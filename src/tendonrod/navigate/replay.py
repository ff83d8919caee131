"""`replay`: the snapshots of a recorded session again, checked bit for bit against what the record says of each."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from operator import index
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ..errors import Fact, InvalidInput, TendonrodError
from .commands import NAMES, Jog, Posture
from .drive import IdealDrive, Untroubled
from .outer_tube import RANGES, OuterTube
from .record import FORMAT, VERSION, outcome, software
from .scenario import Scenario
from .scenariofile import scenario_from
from .session import Session
from .snapshot import Snapshot

SHAPE = f"a record that a session of tendonrod wrote: JSON lines, the first with format {FORMAT!r}"
HELD = ("insertion (share)", "rotation (rad)")  # what a step's "at" begins with; then come the tensions


class ReplayDiffers(TendonrodError):
    """A replay that gives other bits than its record; the message is one sentence."""


class RecordedDrive(Untroubled):
    """Gives again what a real drive held, step by step."""

    def __init__(self, posture: Posture, coupled: bool) -> None:
        self.posture, self.coupled = posture, coupled
        self.next = posture

    def advance(self, jog: Jog, dt: float) -> Posture:
        """What was held after the step; jog and dt were the operator's."""
        self.posture = self.next
        return self.posture

    def go_back(self, posture: Posture) -> bool:
        """What a real drive did is done."""
        return False

    def retract(self) -> bool:
        """Hold the retracted robot again."""
        self.posture = self.next
        return True

    def close(self) -> None:
        """Nothing to do."""


def read_header(path: str | PathLike[str]) -> dict[str, Any]:
    """The first line of a record. Raises `InvalidInput` for what is no record, or one of a later version."""
    name = fspath(path)
    try:
        with Path(name).open("rb") as file:
            header = _parsed(file.readline())
    except OSError as error:
        raise InvalidInput("record", name, f"a readable file: {error.strerror}") from None
    if header.get("format") != FORMAT or "scenario" not in header:
        raise InvalidInput("record", name, SHAPE)
    if not all(isinstance(header.get(key, {}), dict) for key in ("scenario", "start", "software")):
        raise InvalidInput(f"header of {name}", Fact("edited"), SHAPE)
    if header.get("version") != VERSION:
        found = Fact(f"version {header.get('version')}")
        raise InvalidInput(f"record {name}", found, f"version {VERSION}, which this tendonrod reads")
    return header


def lines(path: str | PathLike[str]) -> Iterator[dict[str, Any]]:
    """The lines after the header, one by one. A last one that was cut off is left out.

    Raises `InvalidInput` by line for anything else that is wrong.
    """
    name = fspath(path)
    with Path(name).open("rb") as file:
        file.readline()
        for number, line in enumerate(file, 2):
            if not line.endswith(b"\n"):
                return
            found = _parsed(line)
            if not (_is_step(found) or _is_event(found)):
                raise InvalidInput(f"record {name}, line {number}", line[:60].decode(errors="replace"), SHAPE)
            yield found


def replay(path: str | PathLike[str], check: bool = True) -> Iterator[Snapshot]:
    """Every snapshot of a record in order, from the start on, computed again.

    check: compare each with the record. Raises `InvalidInput` where the file is no record or the phantom has changed,
    `ReplayDiffers` where the software computes other bits than that which recorded.
    """
    name, header = fspath(path), read_header(path)
    session, drive = _begun(name, header)
    if check:
        _compare(name, header, header["start"], session.snapshot)
    yield session.snapshot
    for line in lines(path):
        if "event" in line:
            if line["event"] in EVENTS:
                EVENTS[line["event"]](session, line)
                yield session.snapshot
            continue
        if isinstance(drive, RecordedDrive):
            drive.next, drive.fault = _posture(line.get("held", line["at"])), line.get("blocked", "")
        jog = Jog(**dict(zip(NAMES, line["jog"], strict=True)))
        for _ in range(line["count"]):
            yield session.step(jog, line["dt"])
        if check:
            _compare(name, header, line, session.snapshot)


def _begun(name: str, header: Mapping[str, Any]) -> tuple[Session, IdealDrive | RecordedDrive]:
    try:
        scenario, start = scenario_from(header["scenario"], name), header["start"]
        drive = _drive(scenario, header["drive"], _posture(start["at"]))
        course = {"index": index(start["index"]), "time": 0.0 + start["time"], "reached": tuple(start["reached"])}
        _ = start["digest"], start["tip"], header["software"]
    except (KeyError, TypeError, IndexError, AttributeError) as error:  # of another build, or edited
        allowed = "that of this tendonrod; the record is of another build, or was edited"
        raise InvalidInput(f"header of {name}", Fact(f"without {error}"), allowed) from None
    session = Session(scenario, drive)
    session.snapshot = replace(session.snapshot, **course)
    return session, drive


def _drive(scenario: Scenario, kind: str, posture: Posture) -> IdealDrive | RecordedDrive:
    if kind != IdealDrive.__name__:
        return RecordedDrive(posture, scenario.coupled)
    drive = IdealDrive(scenario)
    drive.posture = posture
    return drive


EVENTS: dict[str, Callable[[Session, Mapping[str, Any]], Snapshot]] = {
    "place": lambda session, line: session.place(OuterTube(**line["tube"])),
    "reset": lambda session, line: session.reset(),
    "couple": lambda session, line: session.couple(line["on"]),
}


def _compare(name: str, header: Mapping[str, Any], line: Mapping[str, Any], snapshot: Snapshot) -> None:
    """Raises `ReplayDiffers` where anything that ``line`` says of its last step is another in ``snapshot``."""
    found = [*_differences(line, snapshot)]
    if not found:
        return
    then, now = header["software"], software()
    changed = [f"{key} {then.get(key)} then, {now[key]} now" for key in now if now[key] != then.get(key)]
    why = "; ".join(changed) or "with the same versions, so the record was edited or the program changed"
    raise ReplayDiffers(f"step {snapshot.index} of {name}: {', '.join(found)}: {why}")


def _differences(line: Mapping[str, Any], snapshot: Snapshot) -> Iterator[str]:
    """Each field that differs, with what was recorded and what is computed now."""
    now = outcome(snapshot)
    if len(line["at"]) != len(now["at"]):
        yield _differs("drives", f"{len(line['at'])} numbers", f"{len(now['at'])}")
    names = (*HELD, *(f"tension {k} (N)" for k in range(1, len(now["at"]) - 1)))
    for field, then, is_now in zip(names, line["at"], now["at"], strict=False):
        if then != is_now:
            yield _differs(field, *_told_apart([then], [is_now]))
    if line["tip"] != now["tip"]:
        then, is_now = _told_apart(*([1e3 * x for x in tip] for tip in (line["tip"], now["tip"])))
        yield _differs("tip (mm)", f"({then})", f"({is_now})")
    if bool(line.get("blocked")) != bool(snapshot.blocked):
        words = ("carried out", "refused")
        yield _differs("command", words[bool(line.get("blocked"))], words[bool(snapshot.blocked)])
    first = snapshot.index - line.get("count", 1) + 1
    if line.get("index", first) != first:
        yield _differs("index", f"{line['index']}", f"{first}")
    if line["digest"] != now["digest"] and (line["at"], line["tip"]) == (now["at"], now["tip"]):
        yield _differs("hash of the whole shape", line["digest"], now["digest"])


def _differs(field: str, then: str, now: str) -> str:
    return f"{field} {then} in the record, {now} computed"


def _told_apart(then: Sequence[float], now: Sequence[float]) -> tuple[str, str]:
    """Both with as few decimals, at least four, as show that they differ."""
    texts = [", ".join(f"{x:.4f}" for x in each) for each in (then, now)]
    for digits in range(5, 18):
        if texts[0] != texts[1]:
            break
        texts = [", ".join(f"{x:.{digits}f}" for x in each) for each in (then, now)]
    return (texts[0], texts[1]) if texts[0] != texts[1] else (f"{[*then]!r}", f"{[*now]!r}")


def _posture(at: list[float]) -> Posture:
    return Posture(insertion=at[0], rotation=at[1], tension=tuple(at[2:]))


def _is_step(line: Mapping[str, Any]) -> bool:
    """Whether a line has all that a run of steps has. Their ranges are checked where they are used."""
    numbers = all(_are_numbers(line.get(key), least) for key, least in (("jog", 3), ("tip", 3), ("at", 2)))
    numbers = numbers and _are_numbers(line.get("held", [0, 0]), 2)
    texts = isinstance(line.get("digest"), str)
    counted = type(line.get("count")) is int and line["count"] > 0 and _are_numbers([line.get("dt")], 1)
    return numbers and texts and counted and len(line["jog"]) == len(line["tip"]) == 3


def _is_event(line: Mapping[str, Any]) -> bool:
    """Whether a line has all that its event has; of one that is not known, its name."""
    kind, tube = line.get("event"), line.get("tube")
    if kind == "place":
        return isinstance(tube, dict) and tube.keys() == RANGES.keys() and _are_numbers([*tube.values()], 1)
    return isinstance(line.get("on"), bool) if kind == "couple" else isinstance(kind, str)


def _are_numbers(values: Any, least: int) -> bool:
    kinds = (int, float)
    return isinstance(values, list) and len(values) >= least and all(type(each) in kinds for each in values)


def _parsed(line: bytes) -> dict[str, Any]:
    try:
        found = json.loads(line)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
