"""`tendonrod navigate --script --headless`: a script's moves, without page or server."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import TendonrodError
from . import output as out
from .arguments import in_words

if TYPE_CHECKING:
    from ..navigate.drive import Drive
    from ..navigate.metrics import Metrics
    from ..navigate.scenario import Scenario
    from ..navigate.script import Move
    from ..navigate.session import Session
    from ..navigate.snapshot import Snapshot


def run_script(
    made: Callable[[], Scenario], driven: Callable[[Scenario], Drive | None], script: str, output: str, json: bool
) -> None:
    """Play the script, record it, print its metrics and write them beside the record.

    Raises `TendonrodError` after all that where a bench has stopped before the script was over.
    """
    from ..navigate.bench_aside import BenchAside
    from ..navigate.bench_drive import BenchDrive
    from ..navigate.record import SessionRecord
    from ..navigate.records import Records
    from ..navigate.script import read_script, slowed
    from ..navigate.session import Session

    with in_words({"script": "--script"}):
        moves = read_script(script)  # before the phantom is built, so that a bad one is told at once
    path = Records(out.directory("--output", output)).fresh()
    scenario = made()
    drive = driven(scenario)
    if isinstance(drive, BenchDrive | BenchAside):
        moves = slowed(moves, drive.fastest)
    session = Session(scenario, drive, SessionRecord(path))
    try:
        found, refused, ended = _played(session, moves)
    finally:
        session.close()
    out.note(f"wrote {path}")
    values = {"script": script, "record": str(path), **found.to_dict()}
    _write(path.with_suffix(".json"), values)
    if json:
        out.say_json(values)
    else:
        out.say(metrics_page(scenario, script, found))
    out.warn([f"at {time:.2f} s {each}" for each, time in refused.items() if each not in ended])
    if ended:
        raise TendonrodError(ended)


def _played(session: Session, moves: Sequence[Move]) -> tuple[Metrics, dict[str, float], str]:
    """Metrics, what was refused (each sentence once, with the time in s when it first was), and what ended it early."""
    from ..navigate.metrics import metrics
    from ..navigate.script import play

    refused, ended = dict[str, float](), ""
    total = sum(move.duration for move in moves)

    def watched() -> Iterator[Snapshot]:
        nonlocal ended
        for snapshot in play(session, moves):
            watch(snapshot.time, total)
            if snapshot.blocked:
                refused.setdefault(snapshot.blocked, snapshot.time)
            yield snapshot
            if (trouble := session.trouble) is not None:  # a bench that stands would make nothing of the rest
                ended = f"the script ends at {snapshot.time:.2f} s: {trouble.text}"
                return

    with out.progress_bar("navigating") as watch:
        found = metrics(watched())
    return found, refused, ended


def _write(path: Path, values: dict[str, Any]) -> None:
    from json import dumps

    from ..files import complete

    with out.written("--output", path), complete("--output", path) as draft:
        draft.write_text(dumps(values, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def metrics_page(scenario: Scenario, script: str, found: Metrics) -> str:
    head = f"{scenario.robot.name}, torsion {scenario.robot.torsion}, in {scenario.phantom.name}: {script}"
    parts = [
        out.heading(head),
        out.table(("", "", ""), _rows(scenario, found), words=(0, 2)),
        _targets(scenario, found),
    ]
    return "\n\n".join(parts)


def _rows(scenario: Scenario, found: Metrics) -> list[tuple[str, str, str]]:
    from ..navigate.touch import SOFT

    rows = [
        ("time", f"{found.duration:.2f}", "s"),
        ("path of the tip", f"{1e3 * found.path:.2f}", "mm"),
        ("insertion", f"{1e3 * found.insertion:.2f}", "mm, at most"),
    ]
    for name, each in found.clearance.items():
        where = f"mm, at {each.time:.2f} s, {1e3 * each.s:.1f} mm from the exit"
        rows.append((f"clearance to {name}", out.fixed(1e3 * each.value, 3), where))
    if found.pressure is not None:
        hard = "" if scenario.phantom.structures[found.pressed].role in SOFT else ", for which there is no limit"
        where = f"kPa, on the {found.pressed}{hard}, at {found.pressure.time:.2f} s"
        rows.append(("peak pressure", f"{1e-3 * found.pressure.value:.3f}", where))
    rows.append(("contact force", f"{1e3 * found.force:.3f}", "mN, at most at one place"))
    if found.follow_the_leader_rms == found.follow_the_leader_rms:
        most = f"mm rms, {1e3 * found.follow_the_leader_max:.3f} mm at most"
        rows.append(("follow-the-leader", f"{1e3 * found.follow_the_leader_rms:.3f}", most))
    shares = {
        "outside the model": found.outside_model,
        "beyond a limit": found.outside_limits,
        "refused": found.blocked,
    }
    return rows + [(name, f"{100 * share:.1f}", "% of the time") for name, share in shares.items()]


def _targets(scenario: Scenario, found: Metrics) -> str:
    """Those reached, in their order, else the nearest."""
    if found.targets:
        rows = [
            (name, f"{each.time:.2f}", f"{1e3 * each.nearest:.3f}", "yes" if each.within_limits else "no")
            for name, each in found.targets.items()
        ]
        return out.table(("target reached", "at\ns", "nearest\nmm", "within limits"), rows, words=(0, 3))
    name = min(found.nearest, key=lambda each: found.nearest[each], default="")
    if not name:
        return "the phantom has no targets"
    needed = f"{1e3 * scenario.phantom.targets[name].tolerance:g} mm needed"
    return f"no target reached; the nearest, {name}, was {1e3 * found.nearest[name]:.3f} mm away, {needed}"
