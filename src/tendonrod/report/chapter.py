"""Values that a report is made of: numbers with their rounding, tables, figures, chapters; and how they are written."""

from __future__ import annotations

import base64
import csv
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import unescape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Number:
    """A computed value in reading units and the digits that it is shown with; written in full to the CSV."""

    value: float
    digits: int = 3

    def __str__(self) -> str:
        """With a true minus sign; < 0.01 where rounding would leave nothing."""
        text = f"{self.value:.{self.digits}f}"
        if self.value != 0.0 and float(text) == 0.0:
            return f"< {10.0**-self.digits:.{self.digits}f}"
        return text.replace("-", "−")


Cell = str | Number


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table: ``name`` is its file's; ``header`` and ``rows`` may hold inline HTML. Its caption is in the template."""

    name: str
    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def write(self, path: Path) -> None:
        """Write as CSV: numbers in full, text without markup."""
        with path.open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(plain(title) for title in self.header)
            rows.writerows(
                [cell.value if isinstance(cell, Number) else plain(cell) for cell in row] for row in self.rows
            )


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A figure: ``name`` is its files', ``draw`` makes it when it is needed. Its caption is in the template."""

    name: str
    draw: Callable[[], Figure]
    inline: str = ".svg"

    def write(self, folder: Path) -> str:
        """Draw, write name.png and name.svg into ``folder``, and return the data URI for the page."""
        from ..plot.style import write

        figure = self.draw()
        for suffix in (".png", ".svg"):
            write(figure, folder / f"{self.name}{suffix}")
        figure.clear()
        kind = {".svg": "image/svg+xml", ".png": "image/png"}[self.inline]
        return f"data:{kind};base64," + base64.b64encode((folder / f"{self.name}{self.inline}").read_bytes()).decode()


@dataclass(frozen=True, kw_only=True)
class Chapter:
    """A chapter: its template is ``name``.html.j2 and sees ``facts``."""

    name: str
    title: str
    facts: Mapping[str, object] = field(default_factory=dict)
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()


def plain(text: str) -> str:
    """Inline HTML as plain text: tags dropped, a subscript marked by _."""
    text = re.sub(r"\s+", " ", text.replace("<br>", " ").replace("<sub>", "_"))
    return unescape(re.sub(r"<[^>]+>", "", text)).replace("−", "-").replace("\u00a0", " ")


def mm(metres: float, digits: int = 2) -> Number:
    """A length in mm."""
    return Number(1e3 * float(metres), digits)


def interval(values: Iterable[float], digits: int = 2) -> str:
    """The range of ``values`` as text, such as 0.90–1.31, or one number where both ends read alike."""
    numbers = [float(value) for value in values]
    low, high = (str(Number(end, digits)) for end in (min(numbers), max(numbers)))
    return low if low == high else f"{low}–{high}"


def listed(items: Iterable[object]) -> str:
    """a, b and c."""
    *first, last = (str(item) for item in items)
    return f"{', '.join(first)} and {last}" if first else last


def title_of(robot: str) -> str:
    """Prototype 1 for exonav-1, not to be broken."""
    return f"Prototype\u00a0{robot.removeprefix('exonav-')}"


def short(robot: str) -> str:
    """P1 for exonav-1."""
    return f"P{robot.removeprefix('exonav-')}"
