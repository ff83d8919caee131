"""The CSV files of `tendonrod batch`: what is asked, row by row, and what is written beside it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan, nan
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Fact, InvalidInput, finite
from . import output
from .motion_file import command_columns
from .table_file import Column, Columns, Table, per_tendon, read_table, tension_columns

if TYPE_CHECKING:
    from ..robot import Robot

VECTORS = {  # argument of `solve` -> columns
    name: tuple(f"{name}_{axis}_{unit}" for axis in "xyz")
    for name, unit in (
        ("gravity", "m_s2"),
        ("tip_force", "N"),
        ("tip_moment", "Nm"),
        ("distributed_force", "N_per_m"),
        ("distributed_moment", "Nm_per_m"),
    )
}
_OURS = re.compile(r"insertion|rotation|tension|displacement|gravity|tip_(force|moment)|distributed")
_RESULTS = re.compile(r"(status|load_factor|error_mm|tip_[xyz]_mm|tip_axis_[xyz]|solved_tension.*)$")


@dataclass(frozen=True, kw_only=True)
class Asked:
    """table: as read. arguments: arrays of `solve_batch` with one row per row of the file, those that have columns.

    displacements: (n, n_tendons) m, NaN where the tension is given; None without such columns.
    """

    table: Table
    arguments: dict[str, np.ndarray]
    displacements: np.ndarray | None


@dataclass(frozen=True, kw_only=True)
class Found:
    """What came of n rows: status (n,) in one word; load_factor, error (n,) m; tip (n, 3) m; axis (n, 3), the tip's
    direction; tensions (n, n_tendons) at the exit, N. NaN where a row has no solution.
    """

    status: list[str]
    load_factor: np.ndarray
    error: np.ndarray
    tip: np.ndarray
    axis: np.ndarray
    tensions: np.ndarray


def read_batch(name: str, robot: Robot) -> Asked:
    """The rows of the CSV file ``name``. Raises `InvalidInput` by row and column."""
    table, T = read_table(name, _columns(robot)), robot.n_tendons
    tension = [f"tension {i}" for i in range(T)]
    displacement = [f"displacement {i}" for i in range(T)]
    _check_drive(table, robot)
    arguments = {each: _column(table, each) for each in ("insertion", "rotation") if each in table.places}
    if any(each in table.places for each in tension):
        arguments["tensions"] = _matrix(table, tension, 0.0)
    for argument, columns in VECTORS.items():
        if any(column in table.places for column in columns):
            arguments[argument] = _matrix(table, columns, 0.0)
    driven = any(each in table.places for each in displacement)
    return Asked(table=table, arguments=arguments, displacements=_matrix(table, displacement, nan) if driven else None)


def written_rows(asked: Asked, found: Found) -> tuple[list[str], Iterator[list[Any]]]:
    """(header, rows) of what is written: the file's own columns as they were, then the results."""
    table, T = asked.table, found.tensions.shape[1]
    kept = sorted([*table.places.values(), *table.others])
    driven = asked.displacements is not None
    header = [table.header[j] for j in kept]
    header += ["status", "load_factor", *(f"tip_{x}_mm" for x in "xyz"), *(f"tip_axis_{x}" for x in "xyz"), "error_mm"]
    header += per_tendon("solved_tension", "N", T) if driven else []

    def rows() -> Iterator[list[Any]]:
        for k, cells in enumerate(table.cells):
            lengths = [*(1e3 * found.tip[k]), *found.axis[k], 1e3 * found.error[k]]
            numbers = [_cell(value, 9) for value in lengths] + [_cell(t, 9) for t in found.tensions[k] if driven]
            yield [*(cells[j].strip() for j in kept), found.status[k], _cell(found.load_factor[k], 6), *numbers]

    return header, rows()


def _columns(robot: Robot) -> Columns:
    T = robot.n_tendons
    known, listed = command_columns(robot), [*tension_columns(T)] if T else []
    if T:
        pulled = per_tendon("displacement", "mm", T)
        known |= {each.lower(): Column(quantity=f"displacement {i}", check=_displacement, convert=_metres)
                  for i, each in enumerate(pulled)}  # fmt: skip
        listed += pulled
    known |= {each.lower(): Column(quantity=each, check=finite) for columns in VECTORS.values() for each in columns}
    listed += ["insertion", "rotation_deg", "rotation_rad", *(each for columns in VECTORS.values() for each in columns)]
    words = ", ".join(listed)
    return Columns(
        file="TABLE.csv",
        known=known,
        needed=(),
        wanted=f"any of {words}",
        listed=words,
        ours=_OURS,
        results=_RESULTS,
    )


def _check_drive(table: Table, robot: Robot) -> None:
    """Something is asked, and every tendon is driven in one way, once."""
    if not table.places:
        raise InvalidInput(f"{table.name}: header", Fact(", ".join(table.header)), _columns(robot).wanted)
    T = robot.n_tendons
    given = [i for i in range(T) if f"tension {i}" in table.places]
    driven = [i for i in range(T) if f"displacement {i}" in table.places]
    if given and not driven and len(given) < T:
        title = tension_columns(T)[next(i for i in range(T) if i not in given)]
        raise InvalidInput(f"{table.name}: column {title}", Fact("missing"), "in the header, with the others' tensions")
    for i in set(given) & set(driven):
        j = table.places[f"tension {i}"]
        for where, row in zip(table.where, table.rows, strict=True):
            if row[f"tension {i}"] != 0.0 and not isnan(row[f"displacement {i}"]):
                beside = table.header[table.places[f"displacement {i}"]]
                field = f"{table.name}: {where}, column {j + 1} {table.header[j]}"
                raise InvalidInput(field, row[f"tension {i}"], f"0 where {beside} is given")


def _displacement(field: str, value: object) -> float:
    """A number, or nothing or "-" for a tendon that is driven by its tension: NaN."""
    if isinstance(value, Fact) or value == "-":
        return nan
    return finite(field, value, 'a finite number, or nothing or "-" where the tension is given')


def _metres(millimetres: float) -> float:
    return 1e-3 * millimetres


def _column(table: Table, quantity: str) -> np.ndarray:
    return np.array([row[quantity] for row in table.rows])


def _matrix(table: Table, quantities, missing: float) -> np.ndarray:
    return np.array([[row.get(each, missing) for each in quantities] for row in table.rows])


def _cell(value: float, digits: int) -> str:
    return "" if isnan(value) else output.fixed(float(value), digits)
