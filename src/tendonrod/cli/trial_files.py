"""Which files `tendonrod trial` reads and which it writes: no file is both."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ..errors import Fact, InvalidInput


def check_targets(
    targets: Mapping[str, str | None], files: Sequence[str], columns: str | None, named: Mapping[str, str | None]
) -> None:
    """One FILE where one is written, and nothing written that is read. Raises `InvalidInput` for an option.

    targets: option -> file to be written. files, columns: FILE and --columns. named: other options -> what they read.
    """
    wanted = {option: path for option, path in targets.items() if path is not None}
    if not wanted:
        return
    if len(files) > 1:
        option, path = next(iter(wanted.items()))
        raise InvalidInput(option, Fact(path), f"given with one FILE; there are {len(files)}")
    read: dict[str, str] = {}
    for what, path in _read(files[0], columns, named):
        read.setdefault(os.path.realpath(path), what)
    for option, path in wanted.items():
        for each in _written(path):
            if what := read.get(os.path.realpath(each)):
                with_it = "" if each == path else f": {os.path.basename(each)} is written with it"
                raise InvalidInput(option, Fact(path), f"another file than {what}{with_it}")


def _read(file: str, columns: str | None, named: Mapping[str, str | None]) -> Iterator[tuple[str, str]]:
    """(what it is, path) of each file that is read."""
    from ..measurement.columnmap import read_column_map
    from ..measurement.loading import beside

    yield "FILE", file
    yield from ((option, path) for option, path in named.items() if path is not None)
    found = None if Path(file).suffix.lower() == ".nc" else beside(file)
    what, source = ("--columns", columns) if columns is not None else ("the column map of FILE", found)
    if source is not None:
        yield what, str(source)
        if robot := read_column_map(source, what).robot_file:
            yield "the robot's file, which the column map names", robot


def _written(path: str) -> tuple[str, ...]:
    """The file and, of a CSV file, the two that may be written beside it."""
    if not path.lower().endswith(".csv"):
        return (path,)
    from ..measurement.csvfile import beside

    return (path, *map(str, beside(Path(os.path.realpath(path)))))
