"""`write_navigation`: the page of a session in a phantom, as the paper's Fig. 9, with its numbers, frames and movie."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from html import escape
from math import degrees, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ..navigate.metrics import Meter, Metrics, Nearest, since_start
from ..navigate.scenario import Scenario
from ..navigate.snapshot import Snapshot
from ..plot.course import Course, Taker
from .chapter import Cell, Number, Picture, Table, listed, mm
from .navigation_frames import write_frames
from .page import write_page

CLOSE = 10e-3  # m: targets that the tip came so near to are told of though it did not reach them
TOUCHING = 1e-5  # m: the contact's tolerance
_FOLLOWED = "deviation from follow-the-leader motion, on the way in"
_PRESSURE = "<b>engineering choice</b>: no limit is accepted; that of CSF on the dura"
_PUSH = "<b>engineering choice</b>: one end free, softest stiffness"
_COUPLED = "so that the section at the exit keeps its direction"
Watch = Callable[[int, int, str], None]


@dataclass(frozen=True, kw_only=True)
class Told:
    """Where a session comes from: name of its record, how it was had again (a sentence), the command of this page."""

    record: str = ""
    again: str = ""
    command: str = ""
    versions: Mapping[str, str] | None = None


def write_navigation(
    snapshots: Iterable[Snapshot],
    scenario: Scenario,
    out: str | os.PathLike[str],
    told: Told | None = None,
    frames: int = 120,
    watch: Watch | None = None,
) -> tuple[Path, Metrics]:
    """Write index.html, figures, tables, metrics.json, frames.nc and animation.gif of a session into ``out``.

    snapshots: in order, as `Session`, `replay` or `play` give them; they are taken one by one and not kept. Times are
    told from the first one's on.
    scenario: of the session. frames: of animation.gif and frames.nc; 0 for neither. watch(done, total, what): called
    before each figure and frame. Returns the page's path and the metrics. Raises `InvalidInput` where there is no
    snapshot, or ``out`` cannot be written.
    """
    found, measured = taken(snapshots, scenario, frames)
    return page_of(found, measured, out, told or Told(), frames, watch), measured


def taken(snapshots: Iterable[Snapshot], scenario: Scenario, frames: int = 120) -> tuple[Course, Metrics]:
    """What the page needs, in one pass over ``snapshots``. Raises `InvalidInput` where there is none."""
    taker, meter = Taker(scenario, frames or 2), Meter()
    for snapshot in taker.passing(since_start(snapshots)):
        meter.add(snapshot)
    return taker.course(), meter.metrics()


def page_of(
    found: Course, measured: Metrics, out: str | os.PathLike[str], told: Told, frames: int, watch: Watch | None = None
) -> Path:
    """The page of what was `taken`."""
    movie = _movie(found, watch) if frames else b""
    files: list[Callable[[Path], object]] = [partial(_write_metrics, measured)]
    if frames:
        files += [lambda folder: write_frames(found, folder / "frames.nc"), partial(_write_movie, movie)]
    return write_page(
        out,
        "navigation.html.j2",
        f"{found.scenario.robot.name} in a phantom of the spine",
        [target_table(found, measured), metrics_table(found, measured), *_warnings(found), scenario_table(found)],
        _pictures(found),
        facts(found, measured, told),
        more=files,
        watch=watch,
        movie="data:image/gif;base64," + base64.b64encode(movie).decode() if movie else "",
    )


def _pictures(found: Course) -> list[Picture]:
    from ..plot.navigation import lines_figure, map_figure, scenes_figure

    return [
        Picture(name="scenes", draw=partial(scenes_figure, found), inline=".png"),
        Picture(name="map", draw=partial(map_figure, found)),
        Picture(name="lines", draw=partial(lines_figure, found)),
    ]


def _movie(found: Course, watch: Watch | None) -> bytes:
    from ..plot.navigation_movie import animation

    return animation(found, watch)


def _write_movie(movie: bytes, folder: Path) -> None:
    (folder / "animation.gif").write_bytes(movie)


def _write_metrics(measured: Metrics, folder: Path) -> None:
    text = json.dumps(measured.to_dict() | {"units": "SI"}, indent=1, allow_nan=False)
    (folder / "metrics.json").write_text(text + "\n", encoding="utf-8")


def target_table(found: Course, measured: Metrics) -> Table:
    """Targets reached, in order, then those nearly reached."""
    targets = found.scenario.phantom.targets
    rows: list[list[Cell]] = []
    for name, arrival in measured.targets.items():
        kept = "yes" if arrival.within_limits else "<b>no</b>"
        rows.append([_whole(name), Number(arrival.time, 1), mm(arrival.nearest), mm(targets[name].tolerance, 1), kept,
                     escape(targets[name].description)])  # fmt: skip
    near = [name for name, far in measured.nearest.items() if far < CLOSE and name not in measured.targets]
    rows += [
        [_whole(name), "–", mm(measured.nearest[name]), mm(targets[name].tolerance, 1), "–",
         escape(targets[name].description)]
        for name in sorted(near, key=lambda each: measured.nearest[each])
    ]  # fmt: skip
    rows = rows or [["none within 10 mm", "–", "–", "–", "–", "–"]]
    header = ("target", "reached at (s)", "nearest (mm)", "tolerance (mm)", "within limits then", "where it lies")
    return Table(name="targets", header=header, rows=rows)


def _whole(name: str) -> str:
    """Not to be broken."""
    return f'<span style="white-space:nowrap">{escape(name)}</span>'


def metrics_table(found: Course, measured: Metrics) -> Table:
    """The session in numbers, with when and where."""
    peak = int(found.pressure.argmax())
    rows: list[list[Cell]] = [
        ["duration", Number(measured.duration, 1), "s", f"{measured.samples} samples"],
        ["path of the tip", mm(measured.path, 1), "mm", "there and back"],
        ["largest length out", mm(measured.insertion, 1), "mm", "of the neutral axis"],
    ]
    for name, nearest in measured.clearance.items():
        where = f"{'it lay against it ' if nearest.value < TOUCHING else ''}{_place(nearest)}"
        rows.append([f"least clearance to the {escape(name)}", mm(_gap(nearest)), "mm", where])
    rows += [
        ["highest pressure on soft tissue", Number(1e-3 * found.pressure[peak], 2), "kPa", _when(found, peak)],
        ["largest contact force at one place", Number(1e3 * measured.force, 1), "mN", "on any structure"],
        ["largest sum of contact forces", Number(1e3 * measured.total_force, 1), "mN", "as vectors, along the body"],
        ["body from the tip’s path, rms", _or_dash(1e3 * measured.follow_the_leader_rms), "mm", _FOLLOWED],
        ["body from the tip’s path, largest", _or_dash(1e3 * measured.follow_the_leader_max), "mm", _FOLLOWED],
        ["time outside the model’s range", Number(100.0 * measured.outside_model, 1), "%", "of the session"],
        ["time with a limit exceeded", Number(100.0 * measured.outside_limits, 1), "%", _exceeded(measured)],
        ["time with a command refused", Number(100.0 * measured.blocked, 1), "%", "of the session"],
    ]
    return Table(name="metrics", header=("", "value", "unit", "when and where"), rows=rows)


def _gap(nearest: Nearest) -> float:
    """0 where the tube lies against a wall, to the contact's tolerance."""
    return 0.0 if abs(nearest.value) < TOUCHING else nearest.value


def _place(nearest: Nearest) -> str:
    return f"{1e3 * nearest.s:.1f} mm from the exit, at {nearest.time:.1f} s"


def _when(found: Course, k: int) -> str:
    return f"at {found.time[k]:.1f} s" if found.pressure[k] > 0.0 else "no contact"


def _or_dash(value: float) -> Cell:
    return Number(value, 2) if isfinite(value) else "–"


def _exceeded(measured: Metrics) -> str:
    shares = (f"{name.replace('_', ' ')} {100.0 * share:.1f} %" for name, share in measured.exceeded.items())
    return ", ".join(shares) or "of the session"


def _warnings(found: Course) -> list[Table]:
    order = {"limit": 0, "warning": 1, "info": 2}
    rows: list[list[Cell]] = [
        [severity, escape(text), Number(first, 1), Number(seconds, 1)]
        for _, text, severity, first, seconds in sorted(found.warnings, key=lambda each: order[each[2]])
    ]
    header = ("", "as first said", "first at (s)", "in all (s)")
    return [Table(name="warnings", header=header, rows=rows)] if rows else []


def scenario_table(found: Course) -> Table:
    """What was set: robot, phantom, outer tube, limits; engineering choices are marked."""
    scenario, tube, limits = found.scenario, found.scenario.tube, found.scenario.limits
    place = ", ".join(_signed(1e3 * value, 2) for value in (tube.depth, tube.offset, tube.height))
    turned = f"{_signed(degrees(tube.tilt), 1)}° to the right, {_signed(degrees(tube.lean), 1)}° ventrally"
    pull = ", ".join(f"{value:g}" for value in scenario.gravity).replace("-", "−")
    levels, coupled = scenario.phantom.levels, scenario.coupled
    size = f"{1e3 * scenario.robot.length_na:.1f} mm long, {2e3 * scenario.outer_radius:.3f} mm wide"
    ends = f", {levels[0].name} to {levels[-1].name}" if levels else ""
    torsion, own = escape(str(scenario.robot.torsion)), "own correction of the paper’s model"
    again = f"; the last of {found.placings + 1} places" if found.placings else ""
    rows: list[list[Cell]] = [
        ["robot", f"{escape(scenario.robot.name)}, {size}", "neutral axis, outside"],
        ["torsion model", torsion, own if torsion == "homogenized" else "as the robot’s file or the caller says"],
        ["phantom", f"{escape(scenario.phantom.name)}{ends}", f"kind: {scenario.phantom.kind}"],
        ["exit of the outer tube (mm)", place, f"dorsal, right and cranial of the origin on the cord’s axis{again}"],
        ["outer tube points", turned, "from cranial"],
        ["gravity (m/s²)", pull, "dorsal, right, cranial"],
        ["insertion turns the motor", "yes" if coupled else "no", _COUPLED if coupled else "the helix turns the robot"],
        ["limit of contact pressure", f"{1e-3 * limits.pressure:.1f} kPa", _PRESSURE],
        ["limit of tension", f"{limits.tension:.2f} N", "a share of that at the plateau of the material"],
        ["limit of strain", f"{100.0 * limits.strain:.2f} %", "end of the material’s linear range"],
        ["limit of axial push", f"{100.0 * limits.buckling:.0f} % of the Euler load", _PUSH],
    ]  # fmt: skip
    return Table(name="scenario", header=("", "set to", "note"), rows=rows)


def _signed(value: float, digits: int) -> str:
    """With a true minus sign, and none at zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def facts(found: Course, measured: Metrics, told: Told) -> dict[str, Any]:
    """What the page's sentences say."""
    nearest = min(measured.nearest, key=lambda name: measured.nearest[name], default=None)
    limit = found.scenario.limits.pressure
    reached = [(escape(name), Number(arrival.time, 1)) for name, arrival in measured.targets.items()]
    good = sum(arrival.within_limits for arrival in measured.targets.values())
    return {
        "robot": found.scenario.robot.name,
        "torsion": str(found.scenario.robot.torsion),
        "phantom": found.scenario.phantom.name,
        "is_named": found.scenario.phantom.name != found.scenario.phantom.kind,
        "duration": Number(measured.duration, 1),
        "reached": listed(f"<b>{name}</b> after {time} s" for name, time in reached) if reached else "",
        "count": len(reached),
        "good": good,
        "nearest": nearest or "",
        "nearest_distance": mm(measured.nearest[nearest]) if nearest else "",
        "clearance": listed(f"{mm(_gap(each))} mm to the {name}" for name, each in measured.clearance.items()),
        "pressure": Number(1e-3 * float(found.pressure.max()), 1),
        "limit": Number(1e-3 * limit, 1),
        "is_pressed": bool(found.pressure.max() > limit),
        "pressed_share": Number(100.0 * measured.exceeded.get("pressure", 0.0), 0),
        "touches": bool(found.pressure.max() > 0.0),
        "deviation": _or_dash(1e3 * measured.follow_the_leader_rms),
        "outside": Number(100.0 * measured.outside_model, 1),
        "is_outside": bool((~found.in_range).any()),
        "blocked": Number(100.0 * measured.blocked, 0),
        "is_blocked": bool(found.blocked.any()),
        "path": mm(measured.path, 0),
        "moments": listed(f"({each.letter}) {each.title}" for each in found.moments),
        "record": told.record,
        "again": told.again,
        "command": told.command,
        "versions": ", ".join(f"{name} {each}" for name, each in (told.versions or {}).items()),
        "frames": len(found.frames),
        "warned": bool(found.warnings),
        "longest": Number(float(np.max(found.exposed)) * 1e3, 1),
    }
