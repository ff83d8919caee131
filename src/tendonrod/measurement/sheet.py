"""A text file of rows and columns as it stands: cells, where each row is, which delimiter and which decimal sign."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from decimal import Decimal
from math import isfinite, nan, radians

import numpy as np

from ..errors import Fact, InvalidInput
from ..files import text_of

DELIMITERS = ("\t", ";", ",")
MISSING_WORDS = frozenset({"", "-", "nan", "missing"})
LEAST = -1e28  # NDI's software writes -3.697314E28 for a number that it does not have
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
WITH_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
WITH_POINT = re.compile(r"[-+]?\d*\.\d+([eE][-+]?\d+)?")
_SAVE = ": save it as CSV UTF-8"
SAVE_OR_SAY = f'{_SAVE}, or say encoding = "cp1252" (Western Windows) in the column map'
FORM = 'a number, or nothing, "-", "nan" or "missing" where nothing was measured'


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """name of the file; header; cells without blank rows; where: "row 1 (line 2)"; decimal: "." or ","."""

    name: str
    header: list[str]
    cells: list[list[str]]
    where: list[str]
    decimal: str = "."

    def texts(self, j: int) -> list[str]:
        """Column ``j``."""
        return [row[j] for row in self.cells]

    def numbers(self, j: int, factor: Decimal | None = Decimal(1)) -> np.ndarray:
        """Column ``j`` times ``factor`` (None: from degrees to radians), NaN where nothing was measured.

        The product is taken in decimals, so that 0.572 mm is the float 0.000572. Raises `InvalidInput` by row.
        """
        return np.array([self._number(k, j, factor) for k in range(len(self.cells))])

    def _number(self, k: int, j: int, factor: Decimal | None) -> float:
        text = self.cells[k][j]
        if text.lower() in MISSING_WORDS:
            return nan
        plain = text.replace(",", ".") if self.decimal == "," else text
        if not NUMBER.fullmatch(plain):
            raise InvalidInput(self.at(k, j), text, FORM)
        value = radians(float(plain)) if factor is None else float(Decimal(plain) * factor)
        if not isfinite(value):
            raise InvalidInput(self.at(k, j), text, FORM)
        return nan if value < LEAST * float(factor or 1) else value

    def at(self, k: int, j: int) -> str:
        """The place of a cell, for an error."""
        return f"{self.name}: {self.where[k]}, column {j + 1} {self.header[j]}"


def cell_lines(
    field: str, name: str, delimiter: str | None = None, encoding: str | None = None, hint: str = _SAVE
) -> list[tuple[int, list[str]]]:
    """(line, cells) of the rows of the file ``name`` that are not blank; delimiter None: found in the first line.

    encoding, hint: of `text_of`.
    """
    text = text_of(field, name, "CSV", encoding, hint)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter or delimiter_of(text))
    try:
        return [(reader.line_num, cells) for cells in reader if any(cells)]
    except csv.Error as error:
        raise InvalidInput(f"{name}, line {reader.line_num}", Fact("unreadable"), f"a row of cells: {error}") from None


def delimiter_of(text: str) -> str:
    """Tab, semicolon or comma: the one that the first line with any has most of."""
    for line in text.splitlines():
        if any(each in line for each in DELIMITERS):
            return max(DELIMITERS, key=line.count)
    return ","


def read_sheet(
    name: str,
    delimiter: str | None = None,
    decimal: str | None = None,
    encoding: str | None = None,
    field: str = "path",
) -> Sheet:
    """The CSV file ``name``; lines before the header that start with # are passed over.

    delimiter, decimal, encoding: None where they are to be found; a decimal comma needs another delimiter. field: what
    the file is called in the error of one that cannot be read. Raises `InvalidInput` by row.
    """
    found = cell_lines(field, name, delimiter, encoding, SAVE_OR_SAY)
    lines = [(line, [cell.strip() for cell in cells]) for line, cells in found]
    while lines and lines[0][1][0].startswith("#"):
        lines.pop(0)
    if not lines:
        raise InvalidInput(name, Fact("empty"), "a header and rows")
    header = lines[0][1]
    while header and not header[-1]:  # a delimiter at the line's end
        header.pop()
    _check_titles(name, header)
    where = [f"row {k} (line {line})" for k, (line, _) in enumerate(lines[1:], 1)]
    cells = [_fitted(f"{name}: {at}", row, header) for at, (_, row) in zip(where, lines[1:], strict=True)]
    if not cells:
        raise InvalidInput(f"{name}: rows", Fact("none"), "given below the header")
    return Sheet(name=name, header=header, cells=cells, where=where, decimal=decimal or _decimal(name, cells))


def _check_titles(name: str, header: list[str]) -> None:
    """A file without titles would lose its first row, and say that columns are missing."""
    parts = [part.strip() for each in header for part in each.split(";")]  # of decimal commas taken for delimiters
    if parts and all(NUMBER.fullmatch(each) or WITH_COMMA.fullmatch(each) for each in parts):
        shown = ", ".join(header[:3]) + (", ..." if len(header) > 3 else "")
        raise InvalidInput(
            f"{name}: titles", Fact(shown), "a row of titles, as time_s; here the first row holds numbers"
        )


def _fitted(where: str, row: list[str], header: list[str]) -> list[str]:
    """``row`` without empty cells beyond the header."""
    size = len(header)
    if len(row) < size or any(row[size:]):
        raise InvalidInput(f"{where}: cells", len(row), f"{size}, as many as the header has")
    return row[:size]


def _decimal(name: str, cells: list[list[str]]) -> str:
    """The decimal sign of the file; where both are used nothing tells 1,500 from 1.5."""
    comma = next((each for row in cells for each in row if WITH_COMMA.fullmatch(each)), None)
    if comma is None:
        return "."
    point = next((each for row in cells for each in row if WITH_POINT.fullmatch(each)), None)
    if point is not None:
        allowed = 'written with one decimal sign, or told by decimal = "," or "." in the column map'
        raise InvalidInput(f"{name}: numbers", Fact(f"{comma} and {point}"), allowed)
    return ","
