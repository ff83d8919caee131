"""Trials of NDI's trackers: a track file joined with what drove the robot, `read_ndi`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MISSING, Fact, InvalidInput, finite, one_of, positive
from ..robot import Robot
from .columnmap import ColumnMap, column_map, in_map_words
from .columns import Columns, drive
from .csvfile import settings
from .nditrack import Track, read_track
from .placing import Places, moved, placed
from .sheet import read_sheet
from .trial import Tracker, Trial

AURORA_RATE = 40.0  # frames per second; Polaris counts 60
MAX_GAP = 0.25  # s
OUTSIDE = "samples outside the drive's times"
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
    places: Places | None = None,
    **overrides: Any,
) -> Trial:
    """The trial of an NDI track file and of a CSV file that tells what drove the robot.

    columns: column map; its [[trackers]] name their tools, its [columns] those of the drive. trackers: in the place of
    the map's: one for each tool in order, or by the tool's name or number (from 1); tools without one are left out.
    places: tracker of the map -> where it sits instead; without trackers in the map, one for each tool in order, or
    tool -> where it sits, and the tool's name is the tracker's.
    drive: CSV with time or frame, and tension and so on, read at the tracker's times by linear interpolation: never
    beyond its ends, nor between rows more than ``max_gap`` seconds apart. rate: frames per second, where the tracker's
    file, or the drive's, counts frames. offset: what the drive's clock shows when the tracker's shows 0, s; with
    align = "first" both clocks show 0 at their first row, before the offset.
    overrides: further fields of `Trial`. Raises `InvalidInput` that names file, row and column.
    """
    clocks = (positive("rate", rate), finite("offset", offset), align, positive("max_gap", max_gap))
    one_of("align", align, (CLOCK, FIRST))
    given = column_map(columns)
    track = read_track(path, given.encoding)
    robot, values = settings(given, overrides)
    asked = _asked(trackers, given, robot) if trackers is not None or not places else _at(track, places, given, robot)
    chosen = _chosen(track, asked)
    time = track.time if np.isfinite(track.time).any() else track.frame / rate
    if not np.isfinite(time).any():
        raise InvalidInput(f"{track.name}: column Frame", MISSING, "in the header, or a column of times")
    tools = ", ".join(f"{track.tools[i]} as {each.name}" for i, each in chosen.items())
    origin = {"file": track.name, "tools": tools, **_told(track, chosen)}
    driven: dict[str, Any] = {}
    if drive is not None:
        driven, apart = _driven(fspath(drive), given, robot, (time, *clocks))
        origin |= {"drive": fspath(drive), "offset of the drive's clock (s)": repr(offset), "clocks": align}
        origin |= {OUTSIDE: apart} if apart else {}
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
        told = in_map_words(given, error, {*overrides, *([] if trackers is None else ["trackers"])})
        raise told or InvalidInput(f"{track.name}: {error.field}", error.value, error.allowed) from None


def _asked(trackers: Any, given: ColumnMap, robot: Robot) -> list[tuple[str | int, Tracker]]:
    """The name or number of its tool, and each tracker."""
    if isinstance(trackers, Mapping):
        return list(trackers.items())
    each = placed(given, robot) if trackers is None else tuple(trackers)
    tools = given.tools if trackers is None else {}
    return [(tools.get(tracker.name, i + 1), tracker) for i, tracker in enumerate(each)]


def _at(track: Track, places: Places, given: ColumnMap, robot: Robot) -> list[tuple[str | int, Tracker]]:
    """As `_asked`, by ``places``: of the map's trackers, of tools by their names, or of all tools in order."""
    own = placed(given, robot)
    if own:
        here = moved(own, places, robot, given.source or "the column map")
        return [(given.tools.get(each.name, i), each) for i, each in enumerate(here, 1)]
    numbered = {name: int(name) for name in places if name.isdecimal() and int(name) <= len(track.tools)}
    if numbered.keys() | (places.keys() & set(track.tools)):
        tools = {name: track.tools[numbered[name] - 1] if name in numbered else name for name in places}
        return [
            (numbered.get(name, name), place.of(Tracker(name=tools[name]), robot)) for name, place in places.items()
        ]
    if len(places) != len(track.tools):
        allowed = f"one for each tool, in their order, or called as the tool; they are {', '.join(track.tools)}"
        raise InvalidInput("places", Fact(", ".join(places)), allowed)
    return [(i, place.of(Tracker(name=name), robot)) for i, (name, place) in enumerate(places.items(), 1)]


def _chosen(track: Track, asked: Iterable[tuple[str | int, Tracker]]) -> dict[int, Tracker]:
    """Tracker of each tool by its place; the only tool of a file without any is at the tip.

    Raises `InvalidInput` for a tool that is not there, that two trackers ask for, or whose name is another's too.
    """
    if not asked and len(track.tools) == 1:
        return {0: Tracker(name="tip")}
    if not asked:
        allowed = "told what they are, by [[trackers]] of a column map or by --tracker, in this order"
        raise InvalidInput(f"{track.name}: tools", Fact(", ".join(track.tools)), allowed)
    found: dict[int, Tracker] = {}
    listed = ", ".join(f"{i + 1} {name}" for i, name in enumerate(track.tools))
    for tool, tracker in asked:
        field = f"{track.name}: tool of {tracker.name}"
        places = [i for i, name in enumerate(track.tools) if tool in (i + 1, name)]
        if not places:
            raise InvalidInput(field, tool, f"one of {listed}")
        if len(places) > 1:
            raise InvalidInput(field, tool, f"told by its number, where several have that name: {listed}")
        if places[0] in found:
            raise InvalidInput(field, tool, f"another than that of {found[places[0]].name}, of {listed}")
        found[places[0]] = tracker
    return found


def _told(track: Track, chosen: Mapping[int, Tracker]) -> dict[str, str]:
    left = [tool for i, tool in enumerate(track.tools) if i not in chosen]
    said = {"tools left out": ", ".join(left), "rows whose tools have different frames": str(track.apart or "")}
    return {key: text for key, text in said.items() if text}


def _driven(name: str, given: ColumnMap, robot: Robot, clocks: Any) -> tuple[dict[str, np.ndarray], str]:
    """What the CSV file ``name`` tells of the drive, at the tracker's times, and of how many of them it tells none."""
    time, rate, offset, align, max_gap = clocks
    columns = Columns(read_sheet(name, given.delimiter, given.decimal, given.encoding, "drive"), given)
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
    asked = _snapped(time - start[0] + offset, own - start[1], 4.0 * np.spacing(np.nanmax(np.abs([*own, *time]))))
    found = drive(columns, robot)
    if not found:
        raise columns.needed("tension")
    apart = _outside(name, asked, own - start[1])
    return {key: _between(asked, own - start[1], each, max_gap) for key, each in found.items()}, apart


def _snapped(asked: np.ndarray, own: np.ndarray, error: float) -> np.ndarray:
    """``asked`` with what is beyond the ends of ``own`` by rounding alone put there, s."""
    near = np.clip(asked, own[0], own[-1])
    return np.where(np.abs(asked - near) <= error, near, asked)


def _outside(name: str, asked: np.ndarray, own: np.ndarray) -> str:
    """How many of the times ``asked`` are not among the drive's ``own``; "" for none. Raises `InvalidInput` for all."""
    (low, high), (first, last) = _ends(asked), _ends(own)
    out = int(((asked < own[0]) | (asked > own[-1])).sum())
    ranges = f"the drive {first} to {last} s, the tracker {low} to {high} s on the drive's clock"
    if out == np.isfinite(asked).sum():
        allowed = f"overlapping the tracker's times, {low} to {high} s on this clock; see --drive-offset and --align"
        raise InvalidInput(f"{name}: time", Fact(f"{first} to {last} s"), allowed)
    return f"{out} of {asked.size}: {ranges}" if out else ""


def _ends(time: np.ndarray) -> tuple[str, str]:
    return f"{np.nanmin(time):.6g}", f"{np.nanmax(time):.6g}"


def _between(asked: np.ndarray, time: np.ndarray, values: np.ndarray, max_gap: float) -> np.ndarray:
    """``values`` (m,) or (m, T) of ``time`` at the times ``asked``, NaN beyond the ends and in gaps."""
    if values.ndim == 2:
        return np.stack([_between(asked, time, each, max_gap) for each in values.T], axis=1)
    known = np.isfinite(values)
    if not known.any():
        return np.full(asked.size, np.nan)
    t, v = time[known], values[known]
    found = np.interp(asked, t, v, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(t, asked, side="left"), 0, t.size - 1)
    before = np.clip(np.searchsorted(t, asked, side="right") - 1, 0, t.size - 1)
    found[(t[after] - t[before] > max_gap * (1.0 + 1e-9)) | ~np.isfinite(asked)] = np.nan
    return found
