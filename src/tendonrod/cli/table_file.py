"""Reading a CSV file of known columns; every error names file, row and column."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..errors import MISSING, Fact, InvalidInput
from ..measurement.sheet import cell_lines


@dataclass(frozen=True, kw_only=True)
class Column:
    """What a column holds: quantity (its name in a row), check(field, value), conversion to SI."""

    quantity: str
    check: Callable[[str, object], float]
    convert: Callable[[float], float] = float


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The columns of a kind of file.

    file: what the help calls such a file. known: by name in lower case. needed: those that must be there, by name as
    written. wanted: what a file needs, in words; listed: the names in words. ours: what looks like one of them and is
    refused if unknown; results: what tendonrod itself wrote and is passed over.
    """

    file: str
    known: Mapping[str, Column]
    needed: tuple[str, ...]
    wanted: str
    listed: str
    ours: re.Pattern[str]
    results: re.Pattern[str]


@dataclass(frozen=True, kw_only=True)
class Table:
    """header and cells as in the file, without blank lines; rows: the quantities of each; where: "row 1 (line 2)".

    places: column of each quantity. others: columns that were not read; results are not among them. comments: lines
    above the header that begin with #.
    """

    name: str
    header: list[str]
    cells: list[list[str]]
    rows: list[dict[str, float]]
    where: list[str]
    places: dict[str, int]
    others: list[int]
    comments: list[str]


def tension_columns(n_tendons: int) -> list[str]:
    """Names of the tension columns: tension_N for one tendon, tension_1_N ... for more; read in any case."""
    return per_tendon("tension", "N", n_tendons)


def per_tendon(stem: str, unit: str, n_tendons: int) -> list[str]:
    """Names of columns that each tendon has: stem_unit for one tendon, stem_1_unit ... for more."""
    return [f"{stem}_{unit}"] if n_tendons == 1 else [f"{stem}_{i + 1}_{unit}" for i in range(n_tendons)]


def read_table(name: str, columns: Columns) -> Table:
    """The rows of the CSV file ``name``. Raises `InvalidInput` by row and column."""
    lines, comments = cell_lines(columns.file, name, ","), list[str]()
    while lines and lines[0][1][0].startswith("#"):
        comments.append(",".join(lines.pop(0)[1]))
    if not lines:
        raise InvalidInput(name, Fact("empty"), f"a header and rows: {columns.wanted}")
    header = [cell.strip() for cell in lines[0][1]]
    places, others = _places(name, header, columns)
    where = [f"row {k} (line {line})" for k, (line, _) in enumerate(lines[1:], 1)]
    cells = [cells for _, cells in lines[1:]]
    rows = [_row(f"{name}: {at}", each, header, places) for at, each in zip(where, cells, strict=True)]
    if not rows:
        raise InvalidInput(f"{name}: rows", Fact("none"), "given below the header")
    found = {quantity: j for quantity, (j, _) in places.items()}
    return Table(
        name=name, header=header, cells=cells, rows=rows, where=where, places=found, others=others, comments=comments
    )


def _places(name: str, header: list[str], columns: Columns) -> tuple[dict[str, tuple[int, Column]], list[int]]:
    """Where each quantity stands, and the columns not read."""
    places: dict[str, tuple[int, Column]] = {}
    others = []
    for j, title in enumerate(header):
        column = columns.known.get(title.lower())
        if column is not None:
            if column.quantity in places:
                first = places[column.quantity][0] + 1
                raise InvalidInput(f"{name}: column {j + 1}", title, f"given once; column {first} has it")
            places[column.quantity] = (j, column)
        elif columns.results.match(title.lower()):
            continue
        elif columns.ours.match(title.lower()):
            raise InvalidInput(f"{name}: column {j + 1}", title, f"one of {columns.listed}")
        else:
            others.append(j)
    for title in columns.needed:
        if columns.known[title.lower()].quantity not in places:
            raise InvalidInput(f"{name}: column {title}", MISSING, f"in the header, which needs {columns.wanted}")
    return places, others


def _row(where: str, cells: list[str], header: list[str], places: dict[str, tuple[int, Column]]) -> dict[str, float]:
    if len(cells) != len(header):
        raise InvalidInput(f"{where}: cells", len(cells), f"{len(header)}, as many as the header has")
    values = {}
    for quantity, (j, column) in places.items():
        text = cells[j].strip()
        try:
            value: object = float(text)
        except ValueError:
            value = text or Fact("empty")
        values[quantity] = column.convert(column.check(f"{where}, column {j + 1} {header[j]}", value))
    return values
