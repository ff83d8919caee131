"""What the commands of `tendonrod rig` print."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from . import output as out
from .shape_page import listed

if TYPE_CHECKING:
    from ..rig.asked_again import Verdict
    from ..rig.benches import BenchSource
    from ..rig.inserted import Inserted
    from ..rig.record import Record
    from ..rig.states import Fault
    from ..rig.trials import Followed, Performed

_LEGEND = (
    "By projection: rms distance of the tracked tip from the reference, the whole robot's\n"
    "tube axis at the target; at insertion: from its point at the same insertion. The\n"
    "paper does not say which it means. Tension: error of the loop while inserting."
)


def fault_line(fault: Fault | None) -> str:
    """Which fault, when, value and limit with their unit, and the reaction."""
    if fault is None:
        return "ended by whoever watched"
    place = f" ({fault.where})" if fault.where else ""
    values = f": {fault.passed}" if fault.passed else ""
    return f"{fault.kind.value}{place} at {fault.time:.3f} s{values}; {fault.reaction.value}"


def fault_dict(fault: Fault | None) -> dict[str, Any] | None:
    """A fault for JSON, SI."""
    if fault is None:
        return None
    said = {"kind": fault.kind.value, "where": fault.where, "time": fault.time, "reaction": fault.reaction.value}
    return said | {"value": plain(fault.value), "limit": plain(fault.limit)}


def plain(value: float) -> float | None:
    """A number for JSON, None for what is none."""
    return float(value) if isfinite(value) else None


def ended(done: Performed) -> str:
    """How it ended, in words for a table."""
    outcome = done.outcome
    return "done" if outcome.is_done else outcome.fault.kind.value if outcome.fault else "ended"


def bench_line(source: BenchSource, done: Performed) -> str:
    """What kind of bench, with friction and mass where they are known."""
    setup: Any = getattr(source, "setup", None)
    if setup is None:
        return str(done.record.header["bench"])
    tracker = "no tracker" if setup.tracker is None else f"tracker {1e3 * setup.tracker.mass:g} g"
    return (
        f"virtual bench, not a measurement: friction of the tendon {setup.tendon_friction:g}, "
        f"of the outer tube {setup.outer_friction:g} N, {tracker}"
    )


def title(source: BenchSource, *more: str) -> str:
    """Robot, torsion, gravity and more, for a heading."""
    robot = source.robot
    facts = [robot.name, f"torsion {robot.torsion}", *more, f"gravity ({listed(source.gravity)}) m/s2"]
    return ", ".join(facts)


def followed_page(found: Sequence[Followed], ways: Sequence[Inserted], source: BenchSource) -> str:
    """Follow-the-leader trials beside the paper's."""
    columns = ["trial\n", "seed\n", "ended\n", "bench\ns", "by projec-\ntion mm", "at inser-\ntion mm"]
    columns += ["tension\nrms mN", "tension\nmax mN", "poses\n", "lost\n"]
    rows = []
    for k, (each, way) in enumerate(zip(found, ways, strict=True), 1):
        run = [str(k), str(each.record.header.get("seed", "-")), ended(each), f"{each.outcome.duration:.1f}"]
        tip = [_digits(1e3 * value, 3) for value in way.tip_rmse]
        tension = [_digits(1e3 * value, 1) for value in (way.error_rms, way.error_max)]
        rows.append([*run, *tip, *tension, str(way.frames), str(way.lost)])
    first = found[0]
    return "\n\n".join([
        out.heading(title(source, f"target {first.target:g} N", f"profile {first.profile.name}")),
        paragraph(f"{bench_line(source, first)}; {_gains(first)}."),
        out.table(columns, rows, words=(2,)),
        out.table(("", "", ""), _printed(first), words=(0, 1, 2)),
        paragraph(_LEGEND),
    ])  # fmt: skip


def paragraph(text: str) -> str:
    """``text``, broken between its words where the terminal ends; in a pipe as it is."""
    return out.table(("",), [(" ".join(text.split()) if sys.stdout.isatty() else text,)], words=(0,))


def _printed(first: Followed) -> list[tuple[str, str, str]]:
    """What the paper prints, and of which case where that is another than here."""
    from ..report import paper
    from ..report.bench import is_papers

    here = is_papers(first.robot.name, first.target, first.gravity, first.record.header.get("end", 1.0))
    case = "prototype 1, 0.7 N, gravity, to full insertion" + ("" if here else ": another case than here")
    printed = ", ".join(f"{1e3 * each:.2f}" for each in paper.FTL_TIP_RMSE_TRIALS)
    return [
        ("the paper's trials", f"{printed} mm", f"tip RMSE, {case}"),
        ("its simulation", f"{1e3 * paper.FTL_TIP_RMSE_SIMULATED:.2f} mm", "the same"),
    ]


def followed_dict(found: Sequence[Followed], ways: Sequence[Inserted], source: BenchSource) -> dict[str, Any]:
    """The same for JSON, SI."""
    from ..report import paper

    first = found[0]
    header = {key: first.record.header[key] for key in ("kp", "ki", "feed_forward", "rate", "screw_rate", "end")}
    trials = [
        _performed_dict(each)
        | {"tip_rmse": plain(way.tip_rmse[0]), "tip_rmse_at_insertion": plain(way.tip_rmse[1])}
        | {"tension_error_rms": plain(way.error_rms), "tension_error_max": plain(way.error_max)}
        | {"frames": way.frames, "frames_lost": way.lost}
        for each, way in zip(found, ways, strict=True)
    ]
    printed = {"trials": list(paper.FTL_TIP_RMSE_TRIALS), "simulated": paper.FTL_TIP_RMSE_SIMULATED}
    return _source_dict(source) | {
        "bench": first.record.header["bench"],
        "target": first.target,
        "profile": first.profile.name,
        **header,
        "trials": trials,
        "paper": {"tip_rmse": printed},
    }


def performed_page(done: Performed, source: BenchSource, *phases: str) -> str:
    """One task that is no trial."""
    error = 1e3 * done.tension_error(*phases)
    outcome = done.outcome
    rows = [
        ("bench", bench_line(source, done)),
        ("ended", "done" if outcome.is_done else fault_line(outcome.fault)),
        ("took", f"{outcome.duration:.1f} s, {outcome.periods} periods, the longest {1e3 * outcome.longest:.3g} ms"),
    ]
    if error.size:
        told = f"{np.sqrt(np.mean(error**2)):.1f} mN rms, {np.abs(error).max():.1f} mN at most ({', '.join(phases)})"
        rows.append(("tension error", told))
    rows.append(("record", f"{done.path}, {done.record.condition}"))
    return "\n\n".join([out.heading(f"{title(source)}: {outcome.task}"), out.table(("", ""), rows, words=(0, 1))])


def performed_json(done: Performed, source: BenchSource, *phases: str) -> dict[str, Any]:
    """The same for JSON, SI."""
    error = done.tension_error(*phases)
    rms, largest = (np.sqrt(np.mean(error**2)), np.abs(error).max()) if error.size else (np.nan, np.nan)
    told = {"tension_error_rms": plain(rms), "tension_error_max": plain(largest)}
    return _source_dict(source) | {"bench": done.record.header["bench"]} | _performed_dict(done) | told


def _performed_dict(done: Performed) -> dict[str, Any]:
    outcome = done.outcome
    return {
        "task": outcome.task,
        "seed": done.record.header.get("seed"),
        "record": str(done.path),
        "condition": done.record.condition,
        "done": outcome.is_done,
        "fault": fault_dict(outcome.fault),
        "duration": outcome.duration,
        "periods": outcome.periods,
        "longest_period": outcome.longest,
    }


def _source_dict(source: BenchSource) -> dict[str, Any]:
    robot = source.robot
    return {"robot": robot.name, "torsion": robot.torsion, "gravity": list(source.gravity)}


def _gains(first: Followed) -> str:
    header = first.record.header
    kp, ki, ahead = 1e3 * header["kp"], 1e3 * header["ki"], "with" if header["feed_forward"] else "no"
    return f"kP {kp:g}, kI {ki:g}, {ahead} feed-forward, {header['rate']:g} Hz"


def _digits(value: float, digits: int) -> str:
    return out.fixed(value, digits) if isfinite(value) else "-"


def record_page(record: Record, count: int, verdict: Verdict | str) -> str:
    """What is in a record; count: of the samples that were replayed; verdict: the interlock's, or why there is none."""
    header = record.header
    made = header.get("recorder", {})
    time = record.time
    facts = [
        ("task", str(header.get("task", "not said"))),
        ("bench", str(header.get("bench", "not said"))),
        ("seed", str(header.get("seed", "none"))),
        ("recorded", f"{made.get('started', 'not said')}, tendonrod {made.get('tendonrod', 'not said')}"),
        ("samples", f"{count} replayed, {_span(time)}"),
        ("frames", f"{len(record.frames)} of {listed_words(dict.fromkeys(record.tools.tolist()))}"),
        ("integrity", f"{record.condition}; {_end(record)}"),
        ("interlock", str(verdict)),
    ]
    events = [[f"{at:.3f}", kind, text] for at, kind, text in timeline(record)]
    blocks = [out.heading(record.name), out.table(("", ""), facts, words=(0, 1))]
    if events:
        blocks.append(out.table(("s", "", ""), events, words=(1, 2)))
    return "\n\n".join(blocks)


def record_dict(record: Record, count: int, verdict: Verdict | str) -> dict[str, Any]:
    """The same for JSON, SI, with the header as it is but for the robot's text."""
    hidden = ("robot", "robot_exact", "limits", "setup")
    return _plainly({
        "record": record.name,
        "complete": record.is_complete,
        "condition": record.condition,
        "samples": count,
        "duration": plain(float(np.ptp(record.time))) if len(record.time) else 0.0,
        "frames": len(record.frames),
        "header": {key: value for key, value in record.header.items() if key not in hidden},
        "states": [[at, text] for at, kind, text in timeline(record) if kind == "state"],
        "faults": [fault_dict(each) for each in record.faults],
        "messages": [list(each) for each in record.messages],
        "interlock": verdict if isinstance(verdict, str) else _verdict_dict(verdict),
    })  # fmt: skip


def _plainly(value: Any) -> Any:
    """With None for numbers that JSON does not have, at any depth: a header may hold what was unlimited."""
    if isinstance(value, dict):
        return {key: _plainly(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plainly(each) for each in value]
    return plain(value) if isinstance(value, float) else value


def _verdict_dict(verdict: Verdict) -> dict[str, Any]:
    differences = [each._asdict() for each in verdict.differences]
    told = [fault_dict(each) for each in verdict.told]
    return {"asked": verdict.asked, "agrees": verdict.agrees, "differences": differences, "told": told}


def timeline(record: Record) -> list[tuple[float, str, str]]:
    """(time s, "state", "fault" or level of the message, text) of all that is told, in the order of time."""
    states = record.states
    changes = np.flatnonzero(np.r_[True, states[1:] != states[:-1]]) if len(states) else np.zeros(0, dtype=int)
    found = [(float(record.time[k]), "state", str(states[k])) for k in changes]
    found += [(each.time, "fault", fault_line(each)) for each in record.faults]
    found += [(each.time, each.level, each.text) for each in record.messages]
    return sorted(found, key=lambda each: each[0])


def listed_words(words) -> str:
    """Words with commas between them."""
    return ", ".join(words) or "no tracker"


def _span(time: np.ndarray) -> str:
    return f"{time[0]:.3f} to {time[-1]:.3f} s" if len(time) else "none"


def _end(record: Record) -> str:
    return str(record.end.get("reason", "no end"))
