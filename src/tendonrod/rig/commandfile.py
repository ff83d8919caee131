"""Commands of a motion from the CSV files that `tendonrod motion` and `tendonrod ftl` read and write, with times."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from itertools import pairwise
from math import radians
from os import PathLike, fspath

from ..errors import MISSING, Fact, InvalidInput, finite, nonnegative, within
from ..files import text_of, with_comments_apart
from ..motion.plan_origin import Origin, read_origin

NEEDED = ("insertion", "tension_n")
KNOWN = (*NEEDED, "rotation_deg", "rotation_rad", "time_s")


@dataclass(frozen=True, kw_only=True)
class Commands:
    """One row per point: insertion, rotation (rad), tension (N), and time (s), None where the file has no time_s.

    rotation_column: what the file calls its rotation, "rotation_deg" also where it has none. origin: what it was made
    for, None where it does not say.
    """

    insertion: list[float]
    rotation: list[float]
    tension: list[float]
    time: list[float] | None = None
    rotation_column: str = "rotation_deg"
    origin: Origin | None = None


def read_commands(path: str | PathLike[str]) -> Commands:
    """The columns insertion, tension_N, rotation_deg or rotation_rad (0 if left out) and time_s.

    Others are passed over, as are lines above the header that begin with #. Raises `InvalidInput` by file, row and
    column.
    """
    name = fspath(path)
    comments, text = with_comments_apart(text_of("file", name, "CSV"))
    rows = [row for row in csv.reader(io.StringIO(text)) if any(row)]
    if len(rows) < 2:
        raise InvalidInput(name, Fact("empty"), "a header with insertion and tension_N, and rows below it")
    header = [cell.strip().lower() for cell in rows[0]]
    places = _places(name, header)
    values = {title: [_number(name, k, row, j, title) for k, row in enumerate(rows[1:], 1)] for title, j in places}
    _check_times(name, values.get("time_s", []))
    turned = values.get("rotation_rad", [0.0] * (len(rows) - 1))
    return Commands(
        insertion=values["insertion"],
        rotation=[radians(x) for x in values["rotation_deg"]] if "rotation_deg" in values else turned,
        tension=values["tension_n"],
        time=values.get("time_s"),
        rotation_column="rotation_rad" if "rotation_rad" in values else "rotation_deg",
        origin=read_origin(comments),
    )


def _check_times(name: str, times: list[float]) -> None:
    for k, (before, at) in enumerate(pairwise(times), 2):
        if not at > before:
            raise InvalidInput(f"{name}: row {k}, column time_s", at, f"later than {before:g}, that of the row above")


def _places(name: str, header: list[str]) -> list[tuple[str, int]]:
    for title in KNOWN:
        if title in NEEDED and title not in header:
            raise InvalidInput(f"{name}: column {title.replace('_n', '_N')}", MISSING, "in the header")
        if header.count(title) > 1:
            raise InvalidInput(f"{name}: column {title}", Fact("given twice"), "given once")
    if "rotation_deg" in header and "rotation_rad" in header:
        raise InvalidInput(f"{name}: rotation_deg and rotation_rad", Fact("both"), "one of the two")
    return [(title, header.index(title)) for title in KNOWN if title in header]


def _number(name: str, k: int, row: list[str], j: int, title: str) -> float:
    field = f"{name}: row {k}, column {title.replace('_n', '_N')}"
    if j >= len(row):
        raise InvalidInput(field, MISSING, "a finite number")
    text = row[j].strip()
    try:
        value: object = float(text)
    except ValueError:
        value = text or Fact("empty")
    if title == "insertion":
        return within(field, value, 0.0, 1.0)
    return nonnegative(field, value) if title in ("tension_n", "time_s") else finite(field, value)
