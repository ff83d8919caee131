"""`tendonrod trial`: what files of measurements hold, which samples count, and the same as another kind of file."""

from __future__ import annotations

import os
from math import degrees
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, nonnegative, positive
from . import output
from .arguments import Json, chosen_robot, number, vector
from .shape_page import listed

if TYPE_CHECKING:
    import numpy as np

    from ..measurement.trial import Tracker, Trial

SHOWN = 8  # row numbers told of each fate
KINDS = (".nc", ".csv")


def trial(
    files: Annotated[list[str], typer.Argument(metavar="FILE", hidden=True)],
    columns: Annotated[str | None, typer.Option(metavar="MAP.toml", help="Column map of CSV and track files.")] = None,
    robot: Annotated[str | None, typer.Option(metavar="ROBOT", help="Preset, or path of a robot's TOML file.")] = None,
    tracker: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=PLACE", help="Once per tracker: tip=tip, base=base, or mid=40, mm along L_na."),
    ] = None,
    gravity: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Gravity in the world frame, m/s2, where files do not say.")
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
    _check_targets(files, {"--output": output_file, "--figure": figure})
    options: dict[str, Any] = {
        "robot": None if robot is None else chosen_robot(robot),
        "trackers": tuple(_tracker(each) for each in tracker or ()) or None,
        "gravity": None if gravity is None else vector("--gravity", gravity),
        "drive": drive,
        "offset": number("--drive-offset", drive_offset),
        "align": align,
        "rate": number("--rate", rate, positive),
    }

    from ..measurement.columnmap import read_column_map
    from ..measurement.loading import load_trials

    trials = load_trials(files, None if columns is None else read_column_map(columns, "--columns"), **options)
    if written is not None:
        _write(trials[0], written)
    if picture is not None:
        from ..plot.trials import trial_figure

        output.write_figure("--figure", picture, lambda: trial_figure(trials[0]))
    if json:
        output.say_json([_as_dict(each) for each in trials])
    else:
        output.say("\n\n".join(_page(each) for each in trials))
    for path, each in zip(files, trials, strict=True):
        if left := each.origin.get("columns not read"):
            output.note(f"{path}: columns left alone: {left}")


def _check_targets(files: list[str], targets: dict[str, str | None]) -> None:
    """One file where one is written, and never one that is read."""
    read = {os.path.realpath(each) for each in files}
    for option, path in targets.items():
        if path is not None and len(files) > 1:
            raise InvalidInput(option, Fact(path), f"given with one FILE; there are {len(files)}")
        if path is not None and os.path.realpath(path) in read:
            raise InvalidInput(option, Fact(path), "another file than FILE")


def _tracker(text: str) -> Tracker:
    from ..measurement.trial import BASE, ROBOT, Tracker

    name, equals, place = (part.strip() for part in text.partition("="))
    if not name or not equals or not place:
        raise InvalidInput("--tracker", Fact(text or "''"), "NAME=PLACE, with tip, base or millimetres along L_na")
    if place in ("tip", BASE):
        return Tracker(name=name, on=BASE if place == BASE else ROBOT)
    return Tracker(name=name, at=1e-3 * number("--tracker", place, nonnegative))


def _write(found: Trial, path: Any) -> None:
    if path.suffix.lower() == ".nc":
        from ..measurement.trialfile import write_trial

        with output.written("--output", path):
            write_trial(found, path)
        return
    from ..measurement.csvfile import write_csv

    with output.written("--output", path):
        write_csv(found, path)
    output.note(f"wrote {path.with_suffix('.toml')}, which {path.name} is read with")


def _fates(found: Any) -> list[tuple[str, str, int, list[int]]]:
    """(tracker, fate, how many, their row numbers from 1), the kept ones first; missing poses by what was said."""
    from ..measurement.trial import KEPT, MISSING_POSE

    told = []
    for each, fates, states in zip(found.trackers, found.fates.T, found.state.T, strict=True):
        rows: dict[str, list[int]] = {}
        for k, (fate, state) in enumerate(zip(fates, states, strict=True), 1):
            said = f"{fate} ({state})" if fate == MISSING_POSE and state else fate
            rows.setdefault(said, []).append(k)
        order = sorted(rows, key=lambda fate: (fate != KEPT, -len(rows[fate])))
        told += [(each.name, fate, len(rows[fate]), rows[fate]) for fate in order]
    return told


def _place(found: Trial, tracker: Tracker) -> str:
    from ..measurement.trial import BASE

    if tracker.on == BASE:
        return "base, fixed"
    return "tip" if tracker.at is None else f"{1e3 * tracker.at:.6g} mm of {1e3 * found.robot.length_na:.6g} mm"


def _ranges(found: Any) -> list[tuple[str, str, str, int]]:
    """(quantity, from, to, how many samples have it)."""
    import numpy as np

    T = found.robot.n_tendons
    rows = [("time (s)", found.time)]
    rows += [(f"tension{_of(i, T)} (N)", found.tensions[:, i]) for i in range(T)]
    rows += [(f"displacement{_of(i, T)} (mm)", 1e3 * found.displacements[:, i]) for i in range(T)]
    rows += [("insertion", found.insertion), ("rotation (deg)", np.degrees(found.rotation))]
    return [(name, *_ends(values)) for name, values in rows]


def _of(i: int, T: int) -> str:
    return f" {i + 1}" if T > 1 else ""


def _ends(values: np.ndarray) -> tuple[str, str, int]:
    import numpy as np

    known = values[np.isfinite(values)]
    if not known.size:
        return "-", "-", 0
    return f"{known.min():.6g}", f"{known.max():.6g}", int(known.size)


def _rate(found: Trial) -> float | None:
    """Samples per second: one over the median step between times."""
    import numpy as np

    steps = np.diff(found.time)
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    return float(1.0 / np.median(steps)) if steps.size else None


def _page(found: Trial) -> str:
    n, rate = found.time.size, _rate(found)
    title = f"{found.name}: {found.robot.name}, {n} sample{'s' * (n != 1)}" + (f", {rate:.4g} per s" if rate else "")
    known = "known" if found.T_world_field is not None else "not known: positions are in the frame of the field"
    facts = [("gravity", f"({listed(found.gravity)}) m/s2, world"), ("T_world_field", known)]
    if found.quality_limit is not None:
        facts.append(("quality limit", f"{1e3 * found.quality_limit:.6g} mm"))
    facts += [(f"tracker {each.name}", _tracker_text(found, each)) for each in found.trackers]
    facts += [(key, text) for key, text in found.origin.items() if key != "columns not read"]
    fates = [(name, fate, str(count), _rows(rows, count, n)) for name, fate, count, rows in _fates(found)]
    ranges = [(name, low, high, str(count)) for name, low, high, count in _ranges(found)]
    return "\n\n".join(
        (
            output.heading(title),
            output.table(("", ""), facts, words=(0, 1)),
            output.table(("", "from", "to", "samples"), ranges, words=(0,)),
            output.table(("tracker", "fate", "samples", "rows"), fates, words=(0, 1, 3)),
        )
    )


def _tracker_text(found: Trial, each: Tracker) -> str:
    parts = [_place(found, each)]
    if any(each.offset) or any(each.point):
        parts.append(f"sensor ({', '.join(f'{1e3 * value:.6g}' for value in each.arm)}) mm from the tube's axis")
    parts.append("turn not known" if each.turn is None else f"turn ({listed([degrees(a) for a in each.turn])}) deg")
    return ", ".join([*parts, *([f"{1e3 * each.mass:.6g} g"] if each.mass else [])])


def _rows(rows: list[int], count: int, n: int) -> str:
    if count == n:
        return "all"
    return ", ".join(str(row) for row in rows[:SHOWN]) + (", ..." if count > SHOWN else "")


def _as_dict(found: Trial) -> dict[str, Any]:
    plain = {name: getattr(found, name) for name in ("name", "quality_limit", "position_noise", "orientation_noise")}
    known = None if found.T_world_field is None else found.T_world_field.tolist()
    return {
        **plain,
        "robot": found.robot.name,
        "samples": found.time.size,
        "rate": _rate(found),
        "gravity": list(found.gravity),
        "T_world_field": known,
        "tension_noise": found.tension_noise,
        "trackers": [
            {
                "name": each.name,
                "on": each.on,
                "at": each.at,
                "arm": list(each.arm),
                "turn": each.turn,
                "mass": each.mass,
            }
            for each in found.trackers
        ],
        "ranges": {name: [low, high, count] for name, low, high, count in _numbers(found)},
        "fates": [
            {"tracker": name, "fate": fate, "samples": count, "rows": rows} for name, fate, count, rows in _fates(found)
        ],
        "origin": dict(found.origin),
        "notes": found.notes,
        "units": "SI",
    }


def _numbers(found: Trial):
    import numpy as np

    for name in ("time", "tensions", "displacements", "insertion", "rotation"):
        values = getattr(found, name)
        known = values[np.isfinite(values)]
        yield name, *((float(known.min()), float(known.max())) if known.size else (None, None)), int(known.size)
