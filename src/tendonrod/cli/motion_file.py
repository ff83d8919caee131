"""Reading the commands of a motion from CSV; every error names file, row and column."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import MISSING, Fact, InvalidInput, finite, nonnegative, within

if TYPE_CHECKING:
    from ..robot import Robot

_OURS = re.compile(r"insertion|rotation|tension")
_RESULTS = re.compile(r"progress$|body_|tip_|row$")  # columns of files that tendonrod writes


@dataclass(frozen=True, kw_only=True)
class Commands:
    """insertion (n,), rotation (n,) rad, tension (n, n_tendons) N, as lists; ignored: columns that were not read."""

    insertion: list[float]
    rotation: list[float]
    tension: list[list[float]]
    ignored: list[str]


def tension_columns(n_tendons: int) -> list[str]:
    """Names of the tension columns: tension_N for one tendon, tension_1_N ... for more; read in any case."""
    return ["tension_N"] if n_tendons == 1 else [f"tension_{i + 1}_N" for i in range(n_tendons)]


def read_commands(name: str, robot: Robot) -> Commands:
    """The rows of the CSV file ``name``. Raises `InvalidInput` by row and column."""
    lines = [(row.line_num, cells) for row in [csv.reader(io.StringIO(_text(name)))] for cells in row if any(cells)]
    if not lines:
        raise InvalidInput(name, Fact("empty"), f"a header and rows: {_wanted(robot)}")
    header = [cell.strip() for cell in lines[0][1]]
    places, ignored = _places(name, header, robot)
    rows = [_row(name, k, line, cells, places, len(header)) for k, (line, cells) in enumerate(lines[1:], 1)]
    if not rows:
        raise InvalidInput(f"{name}: rows", Fact("none"), "given below the header")
    return Commands(
        insertion=[row["insertion"] for row in rows],
        rotation=[row.get("rotation", 0.0) for row in rows],
        tension=[[row[f"tension {i}"] for i in range(robot.n_tendons)] for row in rows],
        ignored=ignored,
    )


def _text(name: str) -> str:
    try:
        return Path(name).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput("FILE.csv", Fact(name), f"UTF-8 text; byte {error.start} is not") from None
    except (FileNotFoundError, ValueError):
        raise InvalidInput("FILE.csv", Fact(name), "an existing CSV file") from None
    except OSError as error:
        raise InvalidInput("FILE.csv", Fact(name), f"a readable file: {error.strerror}") from None


_Column = tuple[int, str, Callable[[str, object], float], Callable[[float], float]]


def _places(name: str, header: list[str], robot: Robot) -> tuple[dict[str, _Column], list[str]]:
    """What each quantity is read from: column, its name, check, conversion to SI; and the columns not read."""
    known = {"insertion": ("insertion", _share, float), "rotation_deg": ("rotation", finite, radians)}
    known["rotation_rad"] = ("rotation", finite, float)
    for i, column in enumerate(tension_columns(robot.n_tendons)):
        known[column.lower()] = (f"tension {i}", nonnegative, float)
    places, ignored = {}, []
    for j, column in enumerate(header):
        if column.lower() in known:
            quantity, check, convert = known[column.lower()]
            if quantity in places:
                raise InvalidInput(
                    f"{name}: column {j + 1}", column, f"given once; column {places[quantity][0] + 1} has it"
                )
            places[quantity] = (j, column, check, convert)
        elif _OURS.match(column.lower()):
            names = ", ".join([*_needed(robot), "rotation_deg", "rotation_rad"])
            raise InvalidInput(f"{name}: column {j + 1}", column, f"one of {names}")
        elif not _RESULTS.match(column.lower()):
            ignored.append(column)
    for column, quantity in _needed(robot).items():
        if quantity not in places:
            raise InvalidInput(f"{name}: column {column}", MISSING, f"in the header, which needs {_wanted(robot)}")
    return places, ignored


def _wanted(robot: Robot) -> str:
    return f"{', '.join(_needed(robot))} and, unless it is 0, rotation_deg or rotation_rad"


def _needed(robot: Robot) -> dict[str, str]:
    """Columns that must be there, with what is read from them."""
    tensions = {column: f"tension {i}" for i, column in enumerate(tension_columns(robot.n_tendons))}
    return {"insertion": "insertion", **tensions}


def _share(field: str, value: object) -> float:
    return within(field, value, 0.0, 1.0)


def _row(name: str, k: int, line: int, cells: list[str], places: dict[str, _Column], width: int) -> dict[str, float]:
    where = f"{name}: row {k} (line {line})"
    if len(cells) != width:
        raise InvalidInput(f"{where}: cells", len(cells), f"{width}, as many as the header has")
    values = {}
    for quantity, (j, column, check, convert) in places.items():
        text = cells[j].strip()
        try:
            value: object = float(text)
        except ValueError:
            value = text or Fact("empty")
        values[quantity] = convert(check(f"{where}, column {j + 1} {column}", value))
    return values
