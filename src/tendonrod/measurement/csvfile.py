"""Trials as CSV files: `read_csv` of whatever columns a bench writes, `write_csv` of all that a trial holds."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MISSING, Fact, InvalidInput
from ..files import complete, file_name
from ..robot import Robot, load_robot, preset_names
from ..robotfile_words import flat_name
from ..robotfile_writing import file_number, toml, write_robot, write_text
from .columnmap import QUATERNION, VECTOR, ColumnMap, column_map, in_map_words
from .columns import Columns, decimal_text, drive, tendon_quantities
from .placing import Places, of_columns
from .sheet import Sheet, read_sheet
from .trial import UNIT, Tracker, Trial
from .units import check_apart, plain

WRITTEN = "Written by tendonrod"  # how the files beside a CSV file begin; what does not is never replaced
MM = 3  # decimal places from metres to millimetres
AXES = ("x", "y", "z")


def read_csv(
    path: str | PathLike[str],
    columns: ColumnMap | str | PathLike[str] | None = None,
    *,
    places: Places | None = None,
    **overrides: Any,
) -> Trial:
    """The trial in a CSV file; rows are samples, in SI once read.

    columns: a `ColumnMap` or the path of one, for columns that are not called by their default names and for what the
    file does not say. overrides: fields of `Trial`, in place of the map's; robot may be a preset or the path of a robot
    file. Trackers are those of overrides, else of the map, else those whose columns NAME_x, NAME_y, NAME_z are there;
    then one called base sits on the base and the only other one at the tip. places: tracker -> where it sits instead;
    its holder and mass stay, and a tracker that the map does not have is added.
    Raises `InvalidInput` that names file, row and column.
    """
    name, given = fspath(path), column_map(columns)
    found = Columns(read_sheet(name, given.delimiter, given.decimal, given.encoding), given)
    _check_measurements(found.sheet)
    robot, values = settings(given, overrides)
    trackers = values.pop("trackers", None) or of_columns(found, robot, places or {})
    time = found.numbers("time", "time")
    if time is None:
        raise found.needed("time")
    each = [_poses(found, tracker) for tracker in trackers]
    measured: dict[str, Any] = {key: np.stack([pose[key] for pose in each], axis=1) for key in each[0]}
    measured |= {"time": time, **drive(found, robot)}
    origin = {"file": name, "columns not read": ", ".join(found.others)}
    origin = {key: text for key, text in origin.items() if text} | dict(values.pop("origin", {}))
    fields: dict[str, Any] = {"name": Path(name).stem, "origin": origin, "robot": robot, "trackers": trackers}
    with in_rows(found, overrides):
        check_apart(each.name for each in trackers)
        return Trial(**(fields | measured | values))


def _check_measurements(sheet: Sheet) -> None:
    """Tables of this package's results have titles that look like a tracker's."""
    if set(sheet.header) >= {"trial", "tracker", "sample", "s_mm"}:
        allowed = "measurements; these are results that tendonrod identify or validate wrote"
        raise InvalidInput(sheet.name, Fact("a table of errors"), allowed)


def settings(given: ColumnMap, overrides: dict[str, Any]) -> tuple[Robot, dict[str, Any]]:
    """The robot, and the fields of `Trial` that the map or the caller gives."""
    unknown = next((key for key in overrides if key not in Trial.__dataclass_fields__), None)
    if unknown is not None:
        raise InvalidInput(unknown, overrides[unknown], f"a field of Trial: {', '.join(Trial.__dataclass_fields__)}")
    values = dict(given.values) | {key: value for key, value in overrides.items() if value is not None}
    robot = values.pop("robot", given.robot)
    if robot is None:
        raise InvalidInput("robot", MISSING, "given, or told by the column map")
    return robot if isinstance(robot, Robot) else load_robot(robot), values


def _poses(columns: Columns, tracker: Tracker) -> dict[str, np.ndarray]:
    """position (n, 3), orientation (n, 4), quality (n,), state (n,) of one tracker."""
    start, size = plain(tracker.name), len(columns.sheet.cells)
    across = [columns.numbers(f"{start}_{axis}", "length") for axis in AXES]
    missing = next((axis for axis, each in zip(AXES, across, strict=True) if each is None), None)
    if missing is not None:
        raise columns.needed(f"{start}_{missing}")
    quality, state = columns.numbers(f"{start}_quality", "length"), columns.texts(f"{start}_state")
    position = np.stack([each for each in across if each is not None], axis=1)
    orientation = _orientation(columns, start, size)
    nothing = ~orientation.any(axis=1)  # loggers fill with zeros what was not measured; no quaternion is zero
    position[nothing], orientation[nothing] = np.nan, np.nan
    if state is not None and columns.given.usable_states is not None:
        position[[each not in columns.given.usable_states for each in state]] = np.nan
    return {
        "position": position,
        "orientation": orientation,
        "quality": np.full(size, np.nan) if quality is None else quality,
        "state": np.array([""] * size if state is None else state, dtype=object),
    }


def _orientation(columns: Columns, start: str, size: int) -> np.ndarray:
    """(n, 4) unit quaternions, NaN where there are none."""
    parts = [columns.numbers(f"{start}_{name}", "number") for name in QUATERNION]
    vector = [columns.numbers(f"{start}_{name}", "angle") for name in VECTOR]
    for names, found in ((QUATERNION, parts), (VECTOR, vector)):
        lacking = [name for name, each in zip(names, found, strict=True) if each is None]
        if 0 < len(lacking) < len(names):
            raise columns.needed(f"{start}_{lacking[0]}")
    if parts[0] is not None:
        return np.stack([each for each in parts if each is not None], axis=1)
    return np.full((size, 4), np.nan) if vector[0] is None else _turned(np.stack(vector, axis=1))  # pyright: ignore


def _turned(vectors: np.ndarray) -> np.ndarray:
    """(n, 4) quaternions of rotation vectors (n, 3), rad."""
    from scipy.spatial.transform import Rotation

    known, found = np.isfinite(vectors).all(axis=1), np.full((len(vectors), 4), np.nan)
    if known.any():
        found[known] = Rotation.from_rotvec(vectors[known]).as_quat(scalar_first=True)
    return found


@contextmanager
def in_rows(columns: Columns, overrides: Collection[str] = ()) -> Iterator[None]:
    """Errors of `Trial` about a sample, by row and column of the file; of the map, by its key; others by the file."""
    try:
        yield
    except InvalidInput as error:
        raise in_map_words(columns.given, error, overrides) or _in_rows(columns.sheet, columns.read, error) from None


def _in_rows(sheet: Sheet, read: dict[int, str], error: InvalidInput) -> InvalidInput:
    found = re.fullmatch(r"(\w+)\[(\d+)\](?:\[(\d+)\])?", error.field)
    if not found or found[1] not in ("insertion", "rotation", "orientation", "quality"):
        return InvalidInput(f"{sheet.name}: {error.field}", error.value, error.allowed)
    k, ending = int(found[2]), {"orientation": "qw"}.get(found[1], found[1])
    titles = [(j, quantity) for j, quantity in read.items() if quantity == ending or quantity.endswith(f"_{ending}")]
    j = titles[int(found[3] or 0)][0] if len(titles) > int(found[3] or 0) else None
    if j is None:
        return InvalidInput(f"{sheet.name}: {sheet.where[k]}, {found[1]}", error.value, error.allowed)
    if found[1] == "orientation":
        allowed = f"of a quaternion of length 1 (to {UNIT:g}); this one's is {error.value:.6g}"
        return InvalidInput(sheet.at(k, j), Fact(sheet.cells[k][j]), allowed)
    return InvalidInput(sheet.at(k, j), Fact(sheet.cells[k][j]), error.allowed)


def write_csv(trial: Trial, path: str | PathLike[str]) -> None:
    """Write ``trial`` to ``path`` and its column map beside it, NAME.toml: `read_csv` of both gives the same samples.

    What is no preset becomes a robot file, NAME-robot.toml. Angles of trackers and of the field are the same to
    rounding, states but for spaces at their ends, all else to the last bit. Raises `InvalidInput` where a file cannot
    be written, where another hand wrote one of the two beside, and for trackers whose columns would be the same.
    """
    table, written = file_name("path", path, (".csv",)), _columns(trial)
    columns, own = beside(table)
    robot, others = trial.robot.name, written_with(table, trial)
    foreign = next((each.name for each in others if not _is_ours(each)), None)
    if foreign is not None:
        allowed = f"of another name: {foreign}, which goes with it, is there already and was not written by tendonrod"
        raise InvalidInput("path", Fact(str(table)), allowed)
    note = f"{WRITTEN} with {table.name}, and replaced when that is: keep changes of yours under another name."
    with complete("path", table) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(written)
        writer.writerows(zip(*written.values(), strict=True))
    if own in others:
        write_robot(trial.robot, own, [note])
        robot = own.name
    write_text("path", columns, toml(_document(trial, robot), [note]))


def beside(table: Path) -> tuple[Path, Path]:
    """The files that `write_csv` puts beside ``table``: the column map, and the robot's where that is no preset."""
    return table.with_suffix(".toml"), table.with_name(f"{table.stem}-robot.toml")


def written_with(table: Path, trial: Trial) -> tuple[Path, ...]:
    """Those of `beside` that ``trial`` needs."""
    name = trial.robot.name
    preset = name in preset_names() and load_robot(name) == trial.robot
    return beside(table)[:1] if preset else beside(table)


def _is_ours(path: Path) -> bool:
    """Whether nothing stands at ``path``, or what `write_csv` wrote."""
    try:
        return path.read_bytes().startswith(f"# {WRITTEN}".encode())
    except FileNotFoundError:
        return True
    except OSError:
        return False


def _columns(trial: Any) -> dict[str, Sequence[str]]:
    """Title -> cells; those that hold nothing are left out."""
    check_apart(each.name for each in trial.trackers)
    found: dict[str, Sequence[str]] = {"time_s": [each or "nan" for each in _texts(trial.time)]}  # no row is blank
    T = trial.robot.n_tendons
    for stem, unit, values, places in (
        ("tension", "N", trial.tensions, 0),
        ("displacement", "mm", trial.displacements, MM),
    ):
        if T and not np.isnan(values).all():
            titles = [f"{stem}_{unit}"] if T == 1 else [f"{each}_{unit}" for each in tendon_quantities(stem, T)]
            found |= {title: _texts(values[:, i], places) for i, title in enumerate(titles)}
    found |= {"insertion": _texts(trial.insertion), "rotation_rad": _texts(trial.rotation)}
    for j, each in enumerate(trial.trackers):
        start = plain(each.name)
        found |= {f"{start}_{axis}_mm": _texts(trial.position[:, j, i], MM) for i, axis in enumerate(AXES)}
        if not np.isnan(trial.orientation[:, j]).all():
            found |= {f"{start}_{name}": _texts(trial.orientation[:, j, i]) for i, name in enumerate(QUATERNION)}
        if not np.isnan(trial.quality[:, j]).all():
            found[f"{start}_quality_mm"] = _texts(trial.quality[:, j], MM)
        if any(trial.state[:, j]):
            found[f"{start}_state"] = trial.state[:, j].tolist()
    return found


def _texts(values: np.ndarray, places: int = 0) -> list[str]:
    return [decimal_text(value, places) for value in values.tolist()]


def _document(trial: Trial, robot: str) -> dict[Any, Any]:
    """The column map, as tables with their keys."""
    found: dict[Any, Any] = {"name": trial.name, "robot": robot, "gravity_m_s2": list(trial.gravity)}
    for key in ("quality_limit_mm", "position_noise_mm", "orientation_noise_deg", "tension_noise_n"):
        value = getattr(trial, flat_name(key))
        found |= {} if value is None else {key: file_number(key, value)}
    found |= {"notes": trial.notes} if trial.notes else {}
    if trial.T_world_field is not None:
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_matrix(trial.T_world_field[:3, :3]).as_rotvec()
        place = {"position_mm": trial.T_world_field[:3, 3].tolist(), "rotation_deg": turn.tolist()}
        found["field"] = {key: file_number(key, value) for key, value in place.items()}
    found |= {"origin": dict(trial.origin)} if trial.origin else {}
    return found | {"trackers": {i: _tracker_table(each) for i, each in enumerate(trial.trackers)}}


def _tracker_table(tracker: Tracker) -> dict[str, Any]:
    table: dict[str, Any] = {"name": tracker.name, "on": tracker.on}
    for key in ("at_mm", "point_mm", "offset_mm", "turn_deg", "mass_g"):
        value = getattr(tracker, flat_name(key))
        if value is not None:
            table[key] = file_number(key, list(value) if isinstance(value, tuple) else value)
    return table
