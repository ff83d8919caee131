"""Problem sets from the literature: tables and figures of docs/problems.rst.

    python docs/problems [NAME ...]     # print the tables, write the figures to out/problems

Each problem is a module function that computes a `Table`, reference beside result, and a function that draws. The
references are the oracles of tests/, which share no code with the solver, or closed forms. tests/test_problems.py
checks every difference; the documentation computes the tables and draws the figures whenever it is built.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

TESTS = str(Path(__file__).resolve().parents[2] / "tests")
if TESTS not in sys.path:
    sys.path.insert(0, TESTS)


@dataclass(frozen=True, kw_only=True)
class Row:
    """One number: what it is, what it should be, what tendonrod finds, and what a publication prints, if any."""

    case: str
    quantity: str
    reference: float
    computed: float
    printed: str = ""

    @property
    def difference(self) -> float:
        return self.computed - self.reference


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows in ``unit`` with so many ``digits`` after the point; ``within``: the largest difference allowed.

    relative: the difference is a share of the reference. printed: heading of the column of what a publication prints,
    empty where there is none.
    """

    rows: tuple[Row, ...]
    unit: str
    digits: int
    within: float
    relative: bool = False
    printed: str = ""

    def difference(self, row: Row) -> float:
        """What is to be at most ``within``."""
        return row.difference / (abs(row.reference) if self.relative else 1.0)

    @property
    def cells(self) -> list[list[str]]:
        """Head and rows as text."""
        unit = f" ({self.unit})" if self.unit else ""
        head = ["case", "quantity", f"reference{unit}", f"tendonrod{unit}"]
        head.append("relative difference" if self.relative else "difference")
        found = [head + ([self.printed] if self.printed else [])]
        for row in self.rows:
            numbers = [_fixed(x, self.digits) for x in (row.reference, row.computed)]
            line = [row.case, row.quantity, *numbers, _power(self.difference(row))]
            found.append(line + ([row.printed] if self.printed else []))
        return found


def _fixed(x: float, digits: int) -> str:
    """``x`` with so many digits behind the point, without a sign where all are 0."""
    text = f"{x:.{digits}f}"
    return (text if float(text) else text.lstrip("-")).replace("-", "−")


def _power(x: float) -> str:
    """``x`` with one digit behind the point, as people write it; what is below rounding is 0."""
    if abs(x) < 1e-15:
        return "0"
    mantissa, exponent = f"{x:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "−")


@dataclass(frozen=True)
class Problem:
    """compute: the table. draw: a figure on a new matplotlib figure."""

    compute: Callable[[], Table]
    draw: Callable[[], object]


def problems() -> dict[str, Problem]:
    """All problems by name, in the order of the page."""
    from . import beams, contact, tendons

    return {
        "elastica": Problem(beams.elastica, beams.draw_elastica),
        "bend": Problem(beams.bend, beams.draw_bend),
        "circle": Problem(beams.circle, beams.draw_circle),
        "princeton": Problem(beams.princeton, beams.draw_princeton),
        "follower": Problem(beams.follower, beams.draw_follower),
        "fold": Problem(beams.fold, beams.draw_fold),
        "routing": Problem(tendons.routing, tendons.draw_routing),
        "anchors": Problem(tendons.anchors, tendons.draw_anchors),
        "hysteresis": Problem(tendons.hysteresis, tendons.draw_hysteresis),
        "arm": Problem(tendons.arm, tendons.draw_arm),
        "floor": Problem(contact.floor, contact.draw_floor),
        "channel": Problem(contact.channel, contact.draw_channel),
    }


@cache
def table(name: str) -> Table:
    """The table of one problem."""
    return problems()[name].compute()


def draw(name: str) -> None:
    """The figure of one problem, as matplotlib's current one."""
    problems()[name].draw()
