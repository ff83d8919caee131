"""`load_trials`: trials from files of any kind that this package reads, told apart by name and content."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ..errors import Fact, InvalidInput
from ..robot import Robot, load_robot
from .columnmap import ColumnMap, column_map
from .placing import Places, moved
from .trial import Trial

_OF_NDI = frozenset({"drive", "rate", "offset", "align", "max_gap"})


def load_trials(
    paths: str | PathLike[str] | Iterable[str | PathLike[str]],
    columns: ColumnMap | str | PathLike[str] | None = None,
    *,
    places: Places | None = None,
    **options: Any,
) -> tuple[Trial, ...]:
    """The trials on file: .nc as `write_trial` writes it, else track files of NDI's by their content, else CSV.

    columns: the column map of all that are not .nc; None: for each the .toml of the same name beside it, if there is
    one. places: tracker -> where it sits, in place of what file or map says; its holder and mass stay. options: those
    of `read_ndi` for its files, and fields of `Trial` for all; what they replace is told in `Trial.origin`.
    Raises `InvalidInput` in one line with file, row and column.
    """
    each = [paths] if isinstance(paths, (str, PathLike)) else list(paths)
    if not each:
        raise InvalidInput("paths", [], "one file of a trial or more")
    if columns is not None and all(map(_is_whole, each)):
        allowed = f"left out: {fspath(each[0])} says itself what it holds, and of which robot"
        raise InvalidInput("columns", Fact(_source(columns)), allowed)
    return tuple(_loaded(path, columns, places or {}, options) for path in each)


def _is_whole(path: str | PathLike[str]) -> bool:
    return Path(fspath(path)).suffix.lower() == ".nc"


def _source(columns: ColumnMap | str | PathLike[str]) -> str:
    return columns.source or "a map" if isinstance(columns, ColumnMap) else fspath(columns)


def _loaded(path: str | PathLike[str], columns: Any, places: Places, options: dict[str, Any]) -> Trial:
    fields = {key: value for key, value in options.items() if key not in _OF_NDI and value is not None}
    if _is_whole(path):
        _check_no_drive(path, options)
        return _whole(path, places, fields)
    if Path(fspath(path)).suffix.lower() == ".toml":
        raise InvalidInput("path", Fact(fspath(path)), "a file of measurements; a column map goes with --columns")
    given = column_map(beside(path) if columns is None else columns)
    from .nditrack import is_ndi

    if is_ndi(path, given.encoding):
        from .ndifile import read_ndi

        known = {key: value for key, value in options.items() if value is not None}
        return _with_replaced(read_ndi(path, given, places=places, **known), given.robot, given.values, fields)
    from .csvfile import read_csv

    _check_no_drive(path, options)
    return _with_replaced(read_csv(path, given, places=places, **fields), given.robot, given.values, fields)


def _whole(path: str | PathLike[str], places: Places, fields: dict[str, Any]) -> Trial:
    """A trial that is on file as a whole, with other ``fields``."""
    from .trialfile import read_trial

    trial = read_trial(path)
    if isinstance(fields.get("robot"), (str, PathLike)):
        fields = fields | {"robot": load_robot(fields["robot"])}
    if places:
        robot = fields.get("robot", trial.robot)
        fields = {**fields, "trackers": moved(fields.get("trackers", trial.trackers), places, robot, fspath(path))}
    known = {"gravity": trial.gravity} if any(trial.gravity) else {}
    return _with_replaced(replace(trial, **fields), trial.robot, known, fields) if fields else trial


def _with_replaced(trial: Trial, robot: Robot | None, known: Mapping[str, Any], fields: dict[str, Any]) -> Trial:
    """``trial``, which tells what its file or map said and the caller replaced."""
    lost = [f"robot {robot.name}"] if robot is not None and "robot" in fields and robot != trial.robot else []
    gravity = known.get("gravity")
    if gravity is not None and "gravity" in fields and tuple(gravity) != trial.gravity:
        lost.append(f"gravity ({', '.join(f'{each:g}' for each in gravity)}) m/s2")
    return replace(trial, origin={**trial.origin, "replaced": ", ".join(lost)}) if lost else trial


def _check_no_drive(path: str | PathLike[str], options: dict[str, Any]) -> None:
    if options.get("drive") is not None:
        given = Fact(fspath(options["drive"]))
        raise InvalidInput("drive", given, f"left out: {fspath(path)} is no track file of NDI's and says it itself")


def beside(path: str | PathLike[str]) -> Path | None:
    """The column map of the same name beside a file; None where there is none."""
    found = Path(fspath(path))
    found = found.with_suffix(".toml") if found.name else found
    return found if found.is_file() else None
