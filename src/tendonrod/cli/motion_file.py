"""Reading the commands of a motion from CSV; every error names file, row and column."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import radians
from typing import TYPE_CHECKING

from ..errors import finite, nonnegative, within
from ..motion.plan_origin import Origin, read_origin
from .table_file import Column, Columns, read_table, tension_columns

if TYPE_CHECKING:
    from ..robot import Robot

_OURS = re.compile(r"insertion|rotation|tension")
_RESULTS = re.compile(r"progress$|body_|tip_(?!force|moment)|row$")  # columns of files that tendonrod writes


@dataclass(frozen=True, kw_only=True)
class Commands:
    """insertion (n,), rotation (n,) rad, tension (n, n_tendons) N, as lists; ignored: columns that were not read.

    origin: of a plan, None where the file does not say what it was made for.
    """

    insertion: list[float]
    rotation: list[float]
    tension: list[list[float]]
    ignored: list[str]
    origin: Origin | None = None


def read_commands(name: str, robot: Robot) -> Commands:
    """The rows of the CSV file ``name``. Raises `InvalidInput` by row and column."""
    table = read_table(name, _columns(robot))
    return Commands(
        insertion=[row["insertion"] for row in table.rows],
        rotation=[row.get("rotation", 0.0) for row in table.rows],
        tension=[[row[f"tension {i}"] for i in range(robot.n_tendons)] for row in table.rows],
        ignored=[table.header[j] for j in table.others],
        origin=read_origin(table.comments),
    )


def command_columns(robot: Robot) -> dict[str, Column]:
    """The columns that command a robot, by name in lower case."""
    known = {
        "insertion": Column(quantity="insertion", check=share),
        "rotation_deg": Column(quantity="rotation", check=finite, convert=radians),
        "rotation_rad": Column(quantity="rotation", check=finite),
    }
    for i, column in enumerate(tension_columns(robot.n_tendons)):
        known[column.lower()] = Column(quantity=f"tension {i}", check=nonnegative)
    return known


def share(field: str, value: object) -> float:
    """``value`` from 0 to 1."""
    return within(field, value, 0.0, 1.0)


def _columns(robot: Robot) -> Columns:
    needed = ("insertion", *tension_columns(robot.n_tendons))
    return Columns(
        file="FILE.csv",
        known=command_columns(robot),
        needed=needed,
        wanted=f"{', '.join(needed)} and, unless it is 0, rotation_deg or rotation_rad",
        listed=", ".join([*needed, "rotation_deg", "rotation_rad"]),
        ours=_OURS,
        results=_RESULTS,
    )
