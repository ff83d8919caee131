"""Column maps: which column of a CSV file holds what, and what the file itself does not say; TOML, units in its keys.

Like `robotfile`, whose checks it shares, this module knows pydantic; ranges are checked by the domain classes.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from pydantic import Field, PlainValidator, StrictStr

from ..errors import InvalidInput, one_of, within
from ..files import text_of
from ..robot import Robot, load_robot, preset_names
from ..robotfile import validated
from ..robotfile_tables import Number, Table
from ..robotfile_words import flat_name, in_file_words, parsed, si
from ..robotfile_writing import file_number
from ..rotation import exp_so3
from .trial import Tracker
from .units import check_apart, plain

SHAPE = "a column map: robot, [[trackers]], [columns] and so on, as needed"
QUATERNION, VECTOR = ("qw", "qx", "qy", "qz"), ("rx", "ry", "rz")
ZERO = [0.0, 0.0, 0.0]
DELIMITERS = {",": ",", ";": ";", "tab": "\t", "\t": "\t"}
_MAPPED = re.compile(r"trackers\[(\d+)\]\.at|(\w+)")


def _titles(value: Any) -> list[str]:
    each = [value] if isinstance(value, str) else value
    if not isinstance(each, list) or not all(isinstance(title, str) for title in each):
        raise ValueError
    return each


def _tool(value: Any) -> str | int:
    if type(value) not in (str, int):
        raise ValueError
    return value


Three = Annotated[list[Number], Field(min_length=3, max_length=3)]
Two = Annotated[list[Number], Field(min_length=2, max_length=2)]
Titles = Annotated[list[str], PlainValidator(_titles)]


class TrackerTable(Table):
    name: StrictStr
    on: StrictStr = "robot"
    at_mm: Number | None = None
    at_share: Number | None = None
    point_mm: Two = Field(default=[0.0, 0.0])
    offset_mm: Three = ZERO
    turn_deg: Three | None = None
    mass_g: Number = 0.0
    tool: Annotated[Any, PlainValidator(_tool)] = None
    x: StrictStr | None = None
    y: StrictStr | None = None
    z: StrictStr | None = None
    quaternion: Annotated[list[StrictStr], Field(min_length=4, max_length=4)] | None = None
    rotation_vector: Annotated[list[StrictStr], Field(min_length=3, max_length=3)] | None = None
    quality: StrictStr | None = None
    state: StrictStr | None = None


class FieldTable(Table):
    position_mm: Three = ZERO
    rotation_deg: Three = ZERO


class ColumnsTable(Table):
    time: StrictStr | None = None
    frame: StrictStr | None = None
    tension: Titles | None = None
    displacement: Titles | None = None
    insertion: StrictStr | None = None
    rotation: StrictStr | None = None


class MapTable(Table):
    name: StrictStr | None = None
    robot: StrictStr | None = None
    gravity_m_s2: Three | None = None
    encoding: StrictStr | None = None
    delimiter: StrictStr | None = None
    decimal: StrictStr | None = None
    usable_states: list[StrictStr] | None = None
    insertion: Number | None = None
    rotation_deg: Number | None = None
    quality_limit_mm: Number | None = None
    position_noise_mm: Number | None = None
    orientation_noise_deg: Number | None = None
    tension_noise_n: Number | None = None
    notes: StrictStr | None = None
    origin: dict[str, StrictStr] = Field(default={})
    field: FieldTable | None = None
    columns: ColumnsTable = ColumnsTable()
    units: dict[str, StrictStr] = Field(default={})
    trackers: list[TrackerTable] = Field(default=[])


_VALUES = (
    "name", "insertion", "rotation_deg", "quality_limit_mm", "position_noise_mm", "orientation_noise_deg",
    "tension_noise_n", "notes",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ColumnMap:
    """How a file of measurements is to be read; SI.

    titles: quantity -> title of its column, for those that are not called by their default names; quantities are time,
    frame, tension (tension_1, ... of several tendons), displacement, insertion, rotation, and of a tracker named tip
    tip_x, tip_y, tip_z, tip_qw .. tip_qz or tip_rx .. tip_rz, tip_quality, tip_state. units: title -> unit, where the
    title has none. robot: None where the caller gives it. trackers: empty where they are told by the titles;
    shares: tracker -> its place as a share of L_na; tools: tracker -> name or number of its tool in a file of NDI's.
    encoding, delimiter, decimal: None where they are to be found; without a mark of its own a file is UTF-8.
    usable_states: states whose poses count, None for all. values: fields of `Trial` that are the same for all samples.
    source: the map's file, "" for none. robot_file: that of a robot which is no preset, "" for none.
    """

    titles: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    robot: Robot | None = None
    trackers: tuple[Tracker, ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict)
    tools: Mapping[str, str | int] = field(default_factory=dict)
    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    usable_states: frozenset[str] | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""
    robot_file: str = ""

    def __post_init__(self) -> None:
        check_apart(each.name for each in self.trackers)
        for name in ("titles", "units", "shares", "tools", "values"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        _check_encoding(self.encoding)
        if self.delimiter is not None:
            if self.delimiter not in DELIMITERS:
                raise InvalidInput("delimiter", self.delimiter, 'one of ",", ";" and "tab"')
            object.__setattr__(self, "delimiter", DELIMITERS[self.delimiter])
        if self.decimal is not None:
            one_of("decimal", self.decimal, (".", ","))
        if self.decimal == "," and self.delimiter == ",":
            raise InvalidInput("decimal", ",", '"." where the delimiter is ","')
        for name, share in self.shares.items():
            within(f"at_share of {name}", share, 0.0, 1.0)


def _check_encoding(name: str | None) -> None:
    try:
        codecs.lookup("utf-8" if name is None else name)
    except LookupError:
        raise InvalidInput("encoding", name, 'the name of a text encoding, as "utf-8", "cp1252" or "utf-16"') from None


def column_map(given: ColumnMap | str | PathLike[str] | None) -> ColumnMap:
    """``given``, read if it is the path of a TOML file; an empty one for None."""
    if given is None or isinstance(given, ColumnMap):
        return given or ColumnMap()
    if not isinstance(given, (str, PathLike)):
        raise InvalidInput("columns", given, "a ColumnMap, the path of a column map, or None")
    return read_column_map(given)


def read_column_map(source: str | PathLike[str], field: str = "columns") -> ColumnMap:
    """The column map on file. Raises `InvalidInput` that names the file, the key, the value and what is allowed.

    field: what the file is called in the error of one that cannot be read.
    """
    name = fspath(source)
    checked = validated(name, MapTable, parsed(name, text_of(field, name, "TOML"), SHAPE), expected=_expected)
    try:
        return ColumnMap(
            titles=_all_titles(checked),
            units={plain(title): unit for title, unit in checked.units.items()},
            robot=_robot(name, checked.robot),
            trackers=tuple(_tracker(name, checked, i) for i in range(len(checked.trackers))),
            shares={each.name: each.at_share for each in checked.trackers if each.at_share is not None},
            tools={each.name: each.tool for each in checked.trackers if each.tool is not None},
            encoding=checked.encoding,
            delimiter=checked.delimiter,
            decimal=checked.decimal,
            usable_states=None if checked.usable_states is None else frozenset(checked.usable_states),
            values=_values(checked),
            source=name,
            robot_file=_robot_file(name, checked.robot),
        )
    except InvalidInput as error:
        if name in error.field:
            raise
        raise InvalidInput(f"{name}: {error.field}", error.value, error.allowed) from None


def _all_titles(checked: MapTable) -> dict[str, str]:
    columns, found = checked.columns, {}
    for quantity in ("time", "frame", "insertion", "rotation"):
        found[quantity] = getattr(columns, quantity)
    for quantity in ("tension", "displacement"):
        given = getattr(columns, quantity) or []
        found |= {f"{quantity}_{i + 1}": title for i, title in enumerate(given)}
    for each in checked.trackers:
        start = plain(each.name)
        found |= {f"{start}_{name}": getattr(each, name) for name in ("x", "y", "z", "quality", "state")}
        for names, given in ((QUATERNION, each.quaternion), (VECTOR, each.rotation_vector)):
            found |= {f"{start}_{name}": title for name, title in zip(names, given or (), strict=False)}
    return {quantity: title for quantity, title in found.items() if title is not None}


def _robot(name: str, given: str | None) -> Robot | None:
    return None if given is None else load_robot(_robot_file(name, given) or given)


def _robot_file(name: str, given: str | None) -> str:
    """The robot's file, whose path starts at the column map's folder; "" for a preset."""
    return "" if given is None or given in preset_names() else str(Path(name).parent / given)


def _tracker(name: str, checked: MapTable, i: int) -> Tracker:
    table = checked.trackers[i]
    if table.at_mm is not None and table.at_share is not None:
        raise InvalidInput(f"{name}: trackers[{i}].at_share", table.at_share, "left out where at_mm is given")
    own = ("name", "on", "at_mm", "point_mm", "offset_mm", "turn_deg", "mass_g")
    keys = {flat_name(key): f"trackers[{i}].{key}" for key in own}
    try:
        return Tracker(**{flat: si(checked, key) for flat, key in keys.items()})
    except InvalidInput as error:
        raise in_file_words(name, error, checked, keys) from None


def _values(checked: MapTable) -> dict[str, Any]:
    found = {flat_name(key): si(checked, key) for key in _VALUES}
    found["gravity"] = checked.gravity_m_s2
    if checked.field is not None:
        found["T_world_field"] = np.eye(4)
        found["T_world_field"][:3, :3] = exp_so3(np.array(si(checked.field, "rotation_deg")))
        found["T_world_field"][:3, 3] = si(checked.field, "position_mm")
    return {name: value for name, value in found.items() if value is not None} | (
        {"origin": checked.origin} if checked.origin else {}
    )


def in_map_words(given: ColumnMap, error: InvalidInput, overrides: Collection[str] = ()) -> InvalidInput | None:
    """An error of `Trial` about what the map says, by the map's file, key and unit; None for one about other things.

    overrides: fields that the caller gave in place of the map's.
    """
    found = _MAPPED.fullmatch(error.field)
    if not found or not given.source:
        return None
    keys = {flat_name(key): key for key in (*_VALUES, "gravity_m_s2")}
    if found[1] is not None:
        i = int(found[1])
        if "trackers" in overrides or i >= len(given.trackers):
            return None
        key, shown = f"trackers[{i}].at_mm", file_number("at_mm", error.value)
    elif error.field in given.values and error.field in keys and error.field not in overrides:
        key = keys[error.field]
        shown = file_number(key, error.value)
    else:
        return None
    return in_file_words(given.source, InvalidInput(key, shown, error.allowed), None, {})


def _expected(error: Any) -> str:
    where, kind = error["loc"], error["type"]
    if kind == "string_type":
        return "a text in quotes"
    if kind == "value_error":
        return "the tool's name, or its number" if where[-1] == "tool" else "a title in quotes, or a list of them"
    if where[-1] == "trackers":
        return "tables, [[trackers]], with two brackets"
    if kind in ("model_type", "dict_type"):
        return "a table"
    if kind in ("list_type", "too_short", "too_long"):
        return _LISTS.get(where[-1], "a list of 3 finite numbers")
    return "a finite number"


_LISTS = {
    "point_mm": "a list of 2 finite numbers",
    "quaternion": "the titles of 4 columns: w, x, y, z",
    "rotation_vector": "the titles of 3 columns: x, y, z",
    "usable_states": "a list of texts",
}
