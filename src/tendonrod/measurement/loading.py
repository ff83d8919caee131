"""`load_trials`: trials from files of any kind that this package reads, told apart by name and content."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ..errors import Fact, InvalidInput
from .columnmap import ColumnMap
from .trial import Trial

_OF_NDI = frozenset({"drive", "rate", "offset", "align", "max_gap"})


def load_trials(
    paths: str | PathLike[str] | Iterable[str | PathLike[str]],
    columns: ColumnMap | str | PathLike[str] | None = None,
    **options: Any,
) -> tuple[Trial, ...]:
    """The trials on file: .nc as `write_trial` writes it, else track files of NDI's by their content, else CSV.

    columns: the column map of all that are not .nc; None: for each the .toml of the same name beside it, if there is
    one. options: those of `read_ndi` for its files, and fields of `Trial` for all. Raises `InvalidInput` in one line
    with file, row and column.
    """
    each = [paths] if isinstance(paths, (str, PathLike)) else list(paths)
    if not each:
        raise InvalidInput("paths", [], "one file of a trial or more")
    return tuple(_loaded(path, columns, options) for path in each)


def _loaded(path: str | PathLike[str], columns: Any, options: dict[str, Any]) -> Trial:
    fields = {key: value for key, value in options.items() if key not in _OF_NDI and value is not None}
    if Path(fspath(path)).suffix.lower() == ".nc":
        from .trialfile import read_trial

        _check_no_drive(path, options)
        trial = read_trial(path)
        return replace(trial, **fields) if fields else trial
    given = beside(path) if columns is None else columns
    from .nditrack import is_ndi

    if is_ndi(path):
        from .ndifile import read_ndi

        return read_ndi(path, given, **{key: value for key, value in options.items() if value is not None})
    from .csvfile import read_csv

    _check_no_drive(path, options)
    return read_csv(path, given, **fields)


def _check_no_drive(path: str | PathLike[str], options: dict[str, Any]) -> None:
    if options.get("drive") is not None:
        given = Fact(fspath(options["drive"]))
        raise InvalidInput("drive", given, f"left out: {fspath(path)} is no track file of NDI's and says it itself")


def beside(path: str | PathLike[str]) -> Path | None:
    """The column map of the same name beside a file; None where there is none."""
    found = Path(fspath(path)).with_suffix(".toml")
    return found if found.is_file() else None
