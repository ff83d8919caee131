"""Trials of NDI's trackers: a track file joined with what drove the robot, `read_ndi`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MISSING, Fact, InvalidInput, finite, one_of, positive
from ..robot import Robot
from .columnmap import ColumnMap, column_map
from .columns import Columns, drive
from .csvfile import placed, settings
from .nditrack import Track, read_track
from .sheet import read_sheet
from .trial import Tracker, Trial

AURORA_RATE = 40.0  # frames per second; Polaris counts 60
MAX_GAP = 0.25  # s
CLOCK, FIRST = "clock", "first"


def read_ndi(
    path: str | PathLike[str],
    columns: ColumnMap | str | PathLike[str] | None = None,
    *,
    drive: str | PathLike[str] | None = None,
    rate: float = AURORA_RATE,
    offset: float = 0.0,
    align: str = CLOCK,
    max_gap: float = MAX_GAP,
    trackers: Sequence[Tracker] | Mapping[str | int, Tracker] | None = None,
    **overrides: Any,
) -> Trial:
    """The trial of an NDI track file and of a CSV file that tells what drove the robot.

    columns: column map; its [[trackers]] name their tools, its [columns] those of the drive. trackers: in the place of
    the map's: one for each tool in order, or by the tool's name or number (from 1); tools without one are left out.
    drive: CSV with time or frame, and tension and so on, read at the tracker's times by linear interpolation: never
    beyond its ends, nor between rows more than ``max_gap`` seconds apart. rate: frames per second, where the tracker's
    file, or the drive's, counts frames. offset: what the drive's clock shows when the tracker's shows 0, s; with
    align = "first" both clocks show 0 at their first row, before the offset.
    overrides: further fields of `Trial`. Raises `InvalidInput` that names file, row and column.
    """
    clocks = (positive("rate", rate), finite("offset", offset), align, positive("max_gap", max_gap))
    one_of("align", align, (CLOCK, FIRST))
    given, track = column_map(columns), read_track(path)
    robot, values = settings(given, overrides)
    chosen = _chosen(track, _asked(trackers, given, robot))
    time = track.time if np.isfinite(track.time).any() else track.frame / rate
    if not np.isfinite(time).any():
        raise InvalidInput(f"{track.name}: column Frame", MISSING, "in the header, or a column of times")
    origin = {"file": track.name, "tools": ", ".join(track.tools), **_told(track, chosen)}
    driven: dict[str, Any] = {}
    if drive is not None:
        driven = _driven(fspath(drive), given, robot, (time, *clocks))
        origin |= {"drive": fspath(drive), "offset of the drive's clock (s)": repr(offset), "clocks": align}
    origin |= dict(values.pop("origin", {}))
    which = list(chosen)
    poses: dict[str, Any] = {
        key: getattr(track, key)[:, which] for key in ("position", "orientation", "quality", "state")
    }
    fields: dict[str, Any] = {"name": Path(track.name).stem, "time": time, "origin": origin}
    fields |= {"robot": robot, "trackers": tuple(chosen.values())}
    try:
        return Trial(**(fields | poses | driven | values))
    except InvalidInput as error:
        raise InvalidInput(f"{track.name}: {error.field}", error.value, error.allowed) from None


def _asked(trackers: Any, given: ColumnMap, robot: Robot) -> Mapping[str | int, Tracker]:
    """Trackers by the name or number of their tool."""
    if isinstance(trackers, Mapping):
        return trackers
    each = placed(given, robot) if trackers is None else tuple(trackers)
    tools = given.tools if trackers is None else {}
    return {tools.get(tracker.name, i + 1): tracker for i, tracker in enumerate(each)}


def _chosen(track: Track, asked: Mapping[str | int, Tracker]) -> dict[int, Tracker]:
    """Tracker of each tool by its place; the only tool of a file without any is at the tip."""
    if not asked and len(track.tools) == 1:
        return {0: Tracker(name="tip")}
    if not asked:
        allowed = "told what they are, by [[trackers]] of a column map or by --tracker, in this order"
        raise InvalidInput(f"{track.name}: tools", Fact(", ".join(track.tools)), allowed)
    found: dict[int, Tracker] = {}
    numbers: dict[str | int, int] = {i + 1: i for i in range(len(track.tools))}
    numbers |= {tool: i for i, tool in enumerate(track.tools)}
    for tool, tracker in asked.items():
        if tool not in numbers:
            listed = ", ".join(f"{i + 1} {name}" for i, name in enumerate(track.tools))
            raise InvalidInput(f"{track.name}: tool of {tracker.name}", tool, f"one of {listed}")
        found[numbers[tool]] = tracker
    return found


def _told(track: Track, chosen: Mapping[int, Tracker]) -> dict[str, str]:
    left = [tool for i, tool in enumerate(track.tools) if i not in chosen]
    said = {"tools left out": ", ".join(left), "rows whose tools have different frames": str(track.apart or "")}
    return {key: text for key, text in said.items() if text}


def _driven(name: str, given: ColumnMap, robot: Robot, clocks: Any) -> dict[str, np.ndarray]:
    """What the CSV file ``name`` tells of the drive, at the tracker's times."""
    time, rate, offset, align, max_gap = clocks
    columns = Columns(read_sheet(name, given.delimiter, given.decimal), given)
    own = columns.numbers("time", "time")
    if own is None:
        frames = columns.numbers("frame", "number")
        if frames is None:
            raise columns.needed("time")
        own = frames / rate
    back = np.flatnonzero(~(np.diff(own) > 0.0))
    if back.size:
        k = int(back[0]) + 1
        field = f"{name}: {columns.sheet.where[k]}, time"
        raise InvalidInput(field, float(own[k]), "a number, after that of the row before")
    start = (np.nanmin(time), own[0]) if align == FIRST else (0.0, 0.0)
    asked = time - start[0] + offset
    found = drive(columns, robot)
    if not found:
        raise columns.needed("tension")
    return {key: _at(asked, own - start[1], each, max_gap) for key, each in found.items()}


def _at(asked: np.ndarray, time: np.ndarray, values: np.ndarray, max_gap: float) -> np.ndarray:
    """``values`` (m,) or (m, T) of ``time`` at the times ``asked``, NaN beyond the ends and in gaps."""
    if values.ndim == 2:
        return np.stack([_at(asked, time, each, max_gap) for each in values.T], axis=1)
    known = np.isfinite(values)
    if not known.any():
        return np.full(asked.size, np.nan)
    t, v = time[known], values[known]
    found = np.interp(asked, t, v, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(t, asked, side="left"), 0, t.size - 1)
    before = np.clip(np.searchsorted(t, asked, side="right") - 1, 0, t.size - 1)
    found[(t[after] - t[before] > max_gap * (1.0 + 1e-9)) | ~np.isfinite(asked)] = np.nan
    return found
