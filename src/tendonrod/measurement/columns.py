"""Which column of a sheet holds a quantity, under its default name or the one that the column map gives; in SI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from difflib import get_close_matches

import numpy as np

from ..errors import MISSING, Fact, InvalidInput
from ..robot import Robot
from .columnmap import ColumnMap
from .sheet import Sheet
from .units import FACTORS, SHOWN, factor, parsed_title, plain

_UNIT_LIKE = re.compile(r"[a-z%]{1,3}")  # what stands after a quantity's name and is no unit: most likely meant as one


class Columns:
    """The columns of a sheet by quantity; remembers which were asked for."""

    def __init__(self, sheet: Sheet, given: ColumnMap) -> None:
        self.sheet, self.given = sheet, given
        self.parsed = [parsed_title(title) for title in sheet.header]
        self.read: dict[int, str] = {}

    @property
    def others(self) -> list[str]:
        """Titles of columns that nobody asked for."""
        return [title for j, title in enumerate(self.sheet.header) if j not in self.read and title]

    def place(self, quantity: str, kind: str | None = None) -> int | None:
        """Number of the column of ``quantity``; None where there is none. Raises `InvalidInput` for two of them."""
        title = self.given.titles.get(quantity)
        found = self._called(quantity, kind) if title is None else self._titled(quantity, title)
        if len(found) > 1:
            first, second = found[:2]
            at = f"{self.sheet.name}: column {second + 1}"
            raise InvalidInput(at, self.sheet.header[second], f"given once; column {first + 1} has {quantity} too")
        for j in found:
            if self.read.setdefault(j, quantity) != quantity:
                raise InvalidInput(self._column(j), Fact("taken twice"), f"{self.read[j]} or {quantity}, not both")
        return found[0] if found else None

    def numbers(self, quantity: str, kind: str, robot: Robot | None = None) -> np.ndarray | None:
        """(n,) SI, NaN where nothing was measured; None without such a column. A share in a unit of length is of L."""
        j = self.place(quantity, kind)
        if j is None:
            return None
        unit = self.parsed[j][1]
        if unit is None:
            unit = self.given.units.get(plain(self.sheet.header[j]))
            unit = None if unit is None else unit.lower()
        if kind == "share" and robot is not None and unit in FACTORS["length"]:
            return self.sheet.numbers(j, factor(self._column(j), "length", unit)) / robot.section.L
        return self.sheet.numbers(j, factor(self._column(j), kind, unit))

    def texts(self, quantity: str) -> list[str] | None:
        """(n,) texts; None without such a column."""
        j = self.place(quantity)
        return None if j is None else self.sheet.texts(j)

    def needed(self, quantity: str) -> InvalidInput:
        """The error of a quantity without a column."""
        listed = ", ".join(title for title in self.sheet.header if title)
        title = self.given.titles.get(quantity, quantity)
        near = self._near(title)
        hint = "" if near is None else f"; did you mean {near}?"
        return InvalidInput(f"{self.sheet.name}: column {title}", MISSING, f"in the header, which has {listed}{hint}")

    def _near(self, title: str) -> str | None:
        """The title that is most like ``title``, first one that has another unit or none."""
        names = {name: self.sheet.header[j] for j, (name, _) in enumerate(self.parsed) if name}
        near = get_close_matches(parsed_title(title)[0], names, n=1, cutoff=0.8)
        return names[near[0]] if near else None

    def _titled(self, quantity: str, title: str) -> list[int]:
        """The column of this very title, or of this name whatever its unit."""
        header = [each.lower() for each in self.sheet.header]
        wanted = title.strip().lower()
        found = [j for j, each in enumerate(header) if each == wanted]
        found = found or [j for j, (name, _) in enumerate(self.parsed) if name == plain(title)]
        if not found:
            raise self.needed(quantity)
        return found

    def _called(self, quantity: str, kind: str | None) -> list[int]:
        """The columns of this name; one that adds an unknown unit to it is refused, not passed over."""
        found = [j for j, (name, _) in enumerate(self.parsed) if name == quantity]
        if found or kind is None:
            return found
        named = {parsed_title(title)[0] for title in self.given.titles.values()}
        for j, (name, _) in enumerate(self.parsed):
            start, _, rest = name.rpartition("_")
            if start == quantity and _UNIT_LIKE.fullmatch(rest) and name not in named:
                allowed = f"{quantity} in one of {SHOWN[kind]}; or a column map says what it is"
                raise InvalidInput(f"{self.sheet.name}: column {j + 1}", self.sheet.header[j], allowed)
        return found

    def _column(self, j: int) -> str:
        return f"{self.sheet.name}: column {j + 1} {self.sheet.header[j]}"


def drive(columns: Columns, robot: Robot) -> dict[str, np.ndarray]:
    """What drives the robot, as far as the sheet tells: tensions, displacements (n, T), insertion, rotation (n,)."""
    found = {name: _per_tendon(columns, stem, kind, robot.n_tendons) for name, stem, kind in _TENDONS}
    _check_complete(columns, robot, found)
    arrays = {name: np.stack(each, axis=1) for name, each in found.items() if each}
    insertion = columns.numbers("insertion", "share", robot)
    rotation = columns.numbers("rotation", "angle")
    return arrays | {k: v for k, v in (("insertion", insertion), ("rotation", rotation)) if v is not None}


_TENDONS = (("tensions", "tension", "force"), ("displacements", "displacement", "length"))


def tendon_quantities(stem: str, n_tendons: int) -> list[str]:
    """tension_1, tension_2, ..."""
    return [f"{stem}_{i + 1}" for i in range(n_tendons)]


def _per_tendon(columns: Columns, stem: str, kind: str, n_tendons: int) -> list[np.ndarray]:
    """(n,) of each tendon, NaN for one without a column; empty where none has one."""
    found = [columns.numbers(each, kind) for each in tendon_quantities(stem, n_tendons)]
    if n_tendons == 1 and found[0] is None and f"{stem}_1" not in columns.given.titles:
        found = [columns.numbers(stem, kind)]  # the one tendon needs no number
    if all(each is None for each in found):
        return []
    size = len(columns.sheet.cells)
    return [np.full(size, np.nan) if each is None else each for each in found]


def _check_complete(columns: Columns, robot: Robot, found: Mapping[str, list[np.ndarray]]) -> None:
    """Every tendon has a column once any has one."""
    if not any(found.values()):
        return
    driven = set(columns.read.values())
    for i in range(robot.n_tendons):
        if not {f"{stem}_{i + 1}" for _, stem, _ in _TENDONS} & driven and not {"tension", "displacement"} & driven:
            raise columns.needed(f"tension_{i + 1}")


def decimal_text(value: float, per_unit: int = 0) -> str:
    """``value`` times 10**per_unit, all its digits: what `Sheet.numbers` reads is ``value`` again. "" for NaN."""
    if np.isnan(value):
        return ""
    return f"{Decimal(repr(float(value))).scaleb(per_unit):f}"
