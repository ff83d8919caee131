"""A record in the words of others: `to_trial` for everything in `measurement`, `export` to netCDF and CSV.

The bench knows axes, a trial knows the robot: insertion is translation / L; rotation is that of the section at the
outer tube's exit, which is the motor's angle less the helix's, 2 pi turns (insertion - 1).
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Fact, InvalidInput, finite, one_of
from ..files import complete, file_name
from .record import Record

if TYPE_CHECKING:
    from ..measurement.trial import Tracker, Trial
    from ..robot import Robot

FRAMES, SAMPLES = "frames", "samples"
AXES = ("screw", "translation", "rotation")
OVERSHOOT = 1e-3  # of the insertion: what a controller may miss either end by; it is then taken to be there
_TRIAL = ("gravity", "T_world_field", "quality_limit", "position_noise", "orientation_noise", "tension_noise", "notes")
_KNOWN = {*_TRIAL, "robot", "robot_exact", "trackers", "tracker_delay", "record_version"}


def header_of(robot: Robot, trackers: Sequence[Tracker] = (), tracker_delay: float = 0.0, **more: Any) -> dict:
    """The header of a record that `to_trial` can read without being told anything else.

    robot: sources and all. trackers: by the names of the tracker's tools. tracker_delay: s, see `to_trial`. more:
    fields of a trial (gravity, T_world_field, quality_limit, position_noise, orientation_noise, tension_noise, notes),
    and whatever else is to be kept (seed, setup, task, limits). Raises `InvalidInput` for a robot that no file can say.
    """
    from dataclasses import asdict

    from ..robotfile_writing import robot_text, rounded_in_file

    known = {"robot": robot_text(robot), "robot_exact": rounded_in_file(robot)}
    places = {"trackers": [asdict(each) for each in trackers], "tracker_delay": finite("tracker_delay", tracker_delay)}
    return known | places | more


def to_trial(
    record: Record,
    *,
    at: str = FRAMES,
    delay: float | None = None,
    slack: float | None = None,
    robot: Robot | None = None,
    trackers: Sequence[Tracker] | None = None,
    **fields: Any,
) -> Trial:
    """The record as a `measurement.trial.Trial`; nothing is dropped, and what is not known is NaN.

    at: "frames": a sample is a frame of the tracker, at the time of its pose, with tension, insertion and rotation
    interpolated between the readings around it. "samples": one per control period, at the times of the load cell's
    readings, with no poses, for what the controller saw.
    delay: s that poses are older than their frames say, taken off their times; the header's "tracker_delay" if None.
    slack: translation less screw (m) at which the tendon just lies taut; displacements follow from it, NaN if None.
    robot, trackers, fields: in place of what the header says; trackers by the names of the tools, as `header_of`.

    An insertion that misses [0, 1] by up to `OVERSHOOT` is taken to be there, beyond it is NaN.
    Raises `InvalidInput` where the header does not tell and nothing is given, for a tool that has no tracker, for a
    robot of several tendons, and by field of the trial.
    """
    from ..measurement.trial import Trial

    one_of("at", at, (FRAMES, SAMPLES))
    robot = robot_of(record) if robot is None else robot
    if robot.n_tendons != 1:
        raise InvalidInput("robot", Fact(f"{robot.name}, {robot.n_tendons} tendons"), "of one, as the bench has")
    sitting = _with_tools(record, trackers)
    late = finite("delay", record.header.get("tracker_delay", 0.0) if delay is None else delay)
    poses = _poses(record, [each.name for each in sitting], late) if at == FRAMES else _no_poses(record, len(sitting))
    header = {name: record.header[name] for name in _TRIAL if record.header.get(name) is not None}
    if "T_world_field" in header:
        header["T_world_field"] = np.array(header["T_world_field"], dtype=float)
    known: dict[str, Any] = {"name": Path(record.name).stem, "origin": _origin(record, at, late), **header}
    known |= poses | _driven(record, poses["time"], robot, slack)
    return Trial(robot=robot, trackers=sitting, **(known | fields))


def robot_of(record: Record) -> Robot:
    """The robot in the record's header. Raises `InvalidInput`."""
    from ..robotfile_writing import robot_from_text, with_exact

    text = record.header.get("robot")
    if not isinstance(text, str):
        raise InvalidInput("robot", text, "given, or the text of a robot file in the record's header")
    return with_exact(robot_from_text(text, f"{record.name}: robot"), record.header.get("robot_exact", {}))


def trackers_of(record: Record) -> tuple[Tracker, ...]:
    """The trackers in the record's header, none where it has none. Raises `InvalidInput`."""
    from ..measurement.trial import Tracker

    try:
        return tuple(Tracker(**each) for each in record.header.get("trackers", ()))
    except TypeError:
        raise InvalidInput("trackers", record.header["trackers"], "fields of Tracker in the record's header") from None


def _with_tools(record: Record, given: Sequence[Tracker] | None) -> tuple[Tracker, ...]:
    """The trackers, given or told; one for each tool. Raises `InvalidInput`."""
    from ..measurement.trial import Tracker

    told = trackers_of(record) if given is None else tuple(given)
    tools = list(dict.fromkeys(record.tools.tolist()))
    missing = [each for each in tools if each not in {tracker.name for tracker in told}]
    if missing:
        raise InvalidInput("trackers", [each.name for each in told], f"with one for each tool: {', '.join(tools)}")
    return told or (Tracker(name="tip"),)


def _poses(record: Record, names: list[str], delay: float) -> dict[str, np.ndarray]:
    """time, position, orientation, quality and state by frame and tracker."""
    row, column = _rows(record), np.array([names.index(each) for each in record.tools], dtype=int)
    n = int(row[-1]) + 1 if row.size else 0
    if n == 0:
        raise InvalidInput("record", Fact(record.name), "one with frames of a tracker; at='samples' needs none")
    found = _empty(n, len(names))
    time = np.empty(n)
    time[row[::-1]] = record.frames["time"][::-1] - delay
    given = {"position": "position", "orientation": "quaternion", "quality": "quality"}
    for name, field in given.items():
        found[name][row, column] = record.frames[field]
    found["state"][row, column] = record.frame_states
    return {"time": time, **_measured(found)}


def _measured(found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """With NaN in place of what no tracker can measure: its frame says so in words, and the others keep theirs."""
    from ..measurement.trial import UNIT

    wrong = {
        "position": np.isinf(found["position"]).any(axis=-1),
        "orientation": np.abs(np.linalg.norm(found["orientation"], axis=-1) - 1.0) > UNIT,
        "quality": np.isinf(found["quality"]) | (found["quality"] < 0.0),
    }
    for name, where in wrong.items():
        found[name][where] = np.nan
        found["state"][where] = [", ".join(filter(None, (text, f"no {name}"))) for text in found["state"][where]]
    return found


def _rows(record: Record) -> np.ndarray:
    """(m,) the row of each frame: tools that were measured together, by number and time, share one."""
    row, last, seen, rows = -1, None, set(), []
    frames = record.frames
    for key in zip(frames["frame"].tolist(), frames["time"].tolist(), frames["tool"].tolist(), strict=True):
        if key[:2] != last or key[2] in seen:
            row, last, seen = row + 1, key[:2], set()
        seen.add(key[2])
        rows.append(row)
    return np.array(rows, dtype=int)


def _no_poses(record: Record, k: int) -> dict[str, np.ndarray]:
    force = record.samples["force"]
    time = force["time"][_later(force["time"])]
    if not time.size:
        raise InvalidInput("record", Fact(record.name), "one with a reading of the load cell")
    return {"time": time, **_empty(time.size, k)}


def _empty(n: int, k: int) -> dict[str, np.ndarray]:
    nothing = {name: np.full((n, k, *rest), np.nan) for name, rest in (("position", (3,)), ("orientation", (4,)))}
    return nothing | {"quality": np.full((n, k), np.nan), "state": np.full((n, k), "", dtype=object)}


def _driven(record: Record, when: np.ndarray, robot: Robot, slack: float | None) -> dict[str, np.ndarray]:
    """tensions, insertion, rotation and displacements at these times."""
    samples = record.samples
    screw, z, angle = (_between(samples[name]["time"], samples[name]["position"], when) for name in AXES)
    tension = _between(samples["force"]["time"], samples["force"]["tension"], when)
    insertion = z / robot.section.L
    found = {
        "tensions": tension[:, None],
        "insertion": _placed(insertion),
        "rotation": angle - 2.0 * np.pi * robot.turns * (insertion - 1.0),
    }
    if slack is not None:
        found["displacements"] = (z - screw - finite("slack", slack))[:, None]
    return found


def _placed(insertion: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        beyond = np.abs(insertion - 0.5) > 0.5 + OVERSHOOT
    return np.where(beyond, np.nan, np.clip(insertion, 0.0, 1.0))


def _between(times: np.ndarray, values: np.ndarray, when: np.ndarray) -> np.ndarray:
    """Values interpolated between readings; NaN where one beside is NaN, and more than a period before or after all."""
    new = _later(times)
    times, values = times[new], values[new]
    if times.size == 0:
        return np.full(when.shape, np.nan)
    values = np.where(np.isinf(values), np.nan, values)
    period = float(np.median(np.diff(times))) if times.size > 1 else 0.0
    with np.errstate(invalid="ignore"):
        known = (when >= times[0] - period) & (when <= times[-1] + period)
    return np.where(known, np.interp(when, times, values), np.nan)


def _later(times: np.ndarray) -> np.ndarray:
    """(n,) whether a reading is newer than all before: a device that has nothing new repeats itself."""
    before = np.fmax.accumulate(np.concatenate([[-np.inf], times[:-1]])) if times.size else times
    return (times > before) & np.isfinite(times)


def _origin(record: Record, at: str, delay: float) -> dict[str, str]:
    rest = {key: value for key, value in record.header.items() if key not in _KNOWN}
    said = {key: value if isinstance(value, str) else json.dumps(value) for key, value in rest.items()}
    own = {"record": Path(record.name).name, "condition of the record": record.condition, "one sample is": at[:-1]}
    late = {"tracker delay": f"{delay:g} s, taken off the times of its frames"} if at == FRAMES else {}
    faults = {"faults": "; ".join(f"{each.time:.6g} s: {each}" for each in record.faults)} if record.faults else {}
    return said | own | late | faults


def export(
    record: Record, path: str | PathLike[str], *, every: int | None = None, seconds: float | None = None, **fields: Any
) -> Trial | None:
    """Write to ``path``: .nc, the trial of `to_trial` with its ``fields``; .csv, every control period as recorded, with
    the tracker's frames beside it in NAME.frames.csv. every, seconds: only such used samples, as `thinning.shortened`
    has it. Returns the trial, None for CSV. Raises `InvalidInput` where that cannot be done.
    """
    target = file_name("path", path, (".nc", ".csv"))
    if target.suffix.lower() == ".nc":
        from ..measurement.thinning import shortened
        from ..measurement.trialfile import write_trial

        trial = to_trial(record, **fields)
        trial = trial if every is None and seconds is None else shortened(trial, every, seconds=seconds)
        write_trial(trial, target)
        return trial
    told = {"every": every, "seconds": seconds, **fields}
    if fields := {name: value for name, value in told.items() if value is not None}:
        raise InvalidInput("fields", sorted(fields), "left out for CSV, which is written as recorded")
    _write_table(target, _sample_columns(record))
    if len(record.frames):
        _write_table(target.with_suffix(".frames.csv"), _frame_columns(record))
    return None


def _sample_columns(record: Record) -> dict[str, np.ndarray]:
    samples, found = record.samples, {"time_s": record.time}
    for name in AXES:
        unit = "rad" if name == "rotation" else "m"
        for field, ending in (("time", "s"), ("position", unit), ("velocity", f"{unit}_per_s")):
            found[f"{name}_{field}_{ending}"] = samples[name][field]
        for field in ("homed", "at_limit", "stalled"):
            found[f"{name}_{field}"] = samples[name][field].astype(int)
    force, command = samples["force"], samples["command"]
    found |= {"force_time_s": force["time"], "tension_n": force["tension"]}
    found |= {"saturated": force["saturated"].astype(int), "state": record.states}
    found |= {f"command_{name}_{'rad' if name == 'rotation' else 'm'}_per_s": command[name] for name in AXES}
    return found | {"target_n": command["target"], "fault": _fault_texts(record)}


def _fault_texts(record: Record) -> np.ndarray:
    from .record import fault_of

    told = np.full(len(record.samples), "", dtype=object)
    told[record.fault_sample] = [str(fault_of(row, record.texts)) for row in record.fault_rows.tolist()]
    return told


def _frame_columns(record: Record) -> dict[str, np.ndarray]:
    frames = record.frames
    found = {"time_s": frames["time"], "frame": frames["frame"], "tool": record.tools}
    found |= {f"{axis}_m": frames["position"][:, i] for i, axis in enumerate("xyz")}
    found |= {f"q{axis}": frames["quaternion"][:, i] for i, axis in enumerate("wxyz")}
    found |= {"quality_m": frames["quality"], "state": record.frame_states}
    return found | {"arrived_s": record.time[record.frame_sample]}


def _write_table(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Numbers to the last bit, nothing for NaN."""
    with complete("path", path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(columns)
        table.writerows(zip(*(map(_cell, each.tolist()) for each in columns.values()), strict=True))


def _cell(value: Any) -> Any:
    return "" if value != value else repr(value) if isinstance(value, float) else value
