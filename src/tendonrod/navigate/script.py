"""Scripts: moves.csv, rows of a duration and three rates, played through a session step by step.

Columns: duration_s, insertion_mm_per_s, rotation_deg_per_s, tension_n_per_s; optional, in rows where the robot is
retracted and blank elsewhere, tube_height_mm, tube_offset_mm, tube_depth_mm, tube_tilt_deg, tube_lean_deg. Lines that
begin with # are comments. Errors name file, line and column, in the units of the columns.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from math import ceil, degrees, radians
from os import PathLike, fspath
from types import MappingProxyType

from ..errors import MISSING, Fact, InvalidInput, finite, within
from ..files import complete, file_name, text_of
from .commands import FASTEST, Jog
from .outer_tube import RANGES
from .session import Session
from .snapshot import Snapshot

STEP = 1.0 / 60.0  # s
LONGEST = 3600.0  # s of one row
RATES = {"insertion_mm_per_s": "insertion", "rotation_deg_per_s": "rotation", "tension_n_per_s": "tension"}
TUBE = {f"tube_{name}_{'deg' if name in ('tilt', 'lean') else 'mm'}": name for name in RANGES}
NEEDED = ("duration_s", *RATES)
SHORTEST = 1e-3  # s
BOUNDS = {
    "duration_s": (SHORTEST, LONGEST),
    **{column: (-FASTEST[name], FASTEST[name]) for column, name in RATES.items()},
    **{column: RANGES[name] for column, name in TUBE.items()},
}  # SI


@dataclass(frozen=True, kw_only=True)
class Move:
    """For ``duration`` s at ``jog``; tube: what of the outer tube is changed before (m, rad), empty for nothing.

    place: file and line that it was read from, for errors.
    """

    duration: float
    jog: Jog
    tube: Mapping[str, float] = field(default_factory=dict)
    place: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        within("duration", self.duration, SHORTEST, LONGEST)
        object.__setattr__(self, "tube", MappingProxyType(dict(self.tube)))


def read_script(path: str | PathLike[str]) -> tuple[Move, ...]:
    """The moves of a CSV file. Raises `InvalidInput` by file, line and column."""
    name = fspath(path)
    text = text_of("script", name, "CSV")
    numbered = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    rows = [next(csv.reader([line])) for _, line in numbered]
    if len(rows) < 2:
        raise InvalidInput(name, Fact("empty"), f"a header with {', '.join(NEEDED)}, and rows below it")
    header = [cell.strip().lower() for cell in rows[0]]
    _check_header(name, header)
    return tuple(_move(f"{name}, line {k}", header, row) for (k, _), row in zip(numbered[1:], rows[1:], strict=True))


def write_script(path: str | PathLike[str], moves: Sequence[Move], comments: Sequence[str] = ()) -> None:
    """Write ``moves`` as `read_script` reads them, angles to rounding; ``comments`` are lines on top."""
    target = file_name("path", path, (".csv",))
    used = [column for column, name in TUBE.items() if any(name in move.tube for move in moves)]
    with complete("path", target) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {line}\n" for line in comments)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*NEEDED, *used])
        for move in moves:
            jog = [_in_file(column, getattr(move.jog, name)) for column, name in RATES.items()]
            tube = [_in_file(column, move.tube[TUBE[column]]) if TUBE[column] in move.tube else "" for column in used]
            writer.writerow([f"{move.duration:.12g}", *jog, *tube])


def play(session: Session, moves: Sequence[Move], step: float = STEP) -> Iterator[Snapshot]:
    """Carry ``moves`` out in even steps of at most ``step`` s, and give each snapshot, that before the first one too.

    Raises `InvalidInput` by file and line, else by number, where a move places the outer tube and the robot is not
    retracted, or the place not free.
    """
    within("step", step, 1e-4, 1.0)
    yield session.snapshot
    for k, move in enumerate(moves, 1):
        if move.tube:
            try:
                yield session.place(session.scenario.tube.changed(**move.tube))
            except InvalidInput as error:
                raise InvalidInput(f"{move.place or f'move {k}'}: {error.field}", error.value, error.allowed) from None
        count = ceil(move.duration / step - 1e-9)
        for _ in range(count):
            yield session.step(move.jog, move.duration / count)


def slowed(moves: Sequence[Move], fastest: Jog) -> tuple[Move, ...]:
    """The same ways, each row slowed as a whole where it is faster than ``fastest`` in any of its three rates."""
    found = []
    for move in moves:
        rates = [(getattr(move.jog, name), getattr(fastest, name)) for name in RATES.values()]
        share = max(1.0, *(abs(asked) / most for asked, most in rates))
        jog = Jog(**{name: getattr(move.jog, name) / share for name in RATES.values()})
        found.append(Move(duration=share * move.duration, jog=jog, tube=move.tube, place=move.place))
    return tuple(found)


def _check_header(name: str, header: Sequence[str]) -> None:
    if len(header) == 1 and ";" in header[0]:
        raise InvalidInput(name, Fact("semicolons between cells"), "commas, and points in numbers")
    for column in NEEDED:
        if column not in header:
            raise InvalidInput(f"{name}: column {column}", MISSING, "in the header")
    for column in header:
        if column not in (*NEEDED, *TUBE):
            raise InvalidInput(f"{name}: column", column, f"one of {', '.join((*NEEDED, *TUBE))}")
        if header.count(column) > 1:
            raise InvalidInput(f"{name}: column {column}", Fact("given twice"), "given once")


def _move(place: str, header: Sequence[str], row: Sequence[str]) -> Move:
    if len(row) != len(header):
        raise InvalidInput(place, Fact(f"{len(row)} cells"), f"{len(header)} cells, as the header has")
    cells = dict(zip(header, row, strict=True))
    values = {
        column: _number(f"{place}, column {column}", text, column) for column, text in cells.items()
        if text.strip() or column in NEEDED
    }  # fmt: skip
    jog = Jog(**{name: _si(column, values[column]) for column, name in RATES.items()})
    tube = {TUBE[column]: _si(column, value) for column, value in values.items() if column in TUBE}
    return Move(duration=values["duration_s"], jog=jog, tube=tube, place=place)


def _number(where: str, text: str, column: str) -> float:
    """In the unit of the column."""
    low, high = (_scaled(column, bound) for bound in BOUNDS[column])
    allowed = f"a number from {low:.6g} to {high:.6g}"
    try:
        number = finite(where, float(text))
    except ValueError:  # InvalidInput is one too
        raise InvalidInput(where, text.strip() or Fact("empty"), allowed) from None
    if not low <= number <= high:
        raise InvalidInput(where, number, allowed)
    return number


def _si(column: str, value: float) -> float:
    """In SI units, as one does on paper: 0.3 mm is the float 0.0003."""
    unit = column.removesuffix("_per_s").rpartition("_")[2]
    if unit == "mm":
        return float(Decimal(repr(value)).scaleb(-3))
    return radians(value) if unit == "deg" else value


def _in_file(column: str, value: float) -> str:
    return f"{_scaled(column, value):.12g}"


def _scaled(column: str, value: float) -> float:
    """An SI value in the unit of the column."""
    unit = column.removesuffix("_per_s").rpartition("_")[2]
    return 1e3 * value if unit == "mm" else degrees(value) if unit == "deg" else value
