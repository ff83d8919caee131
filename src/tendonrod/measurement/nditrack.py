"""Track files as NDI's software writes them: `read_track`.

Four forms, all of one block of columns per tool, are told apart by their header; docs/trials.rst says where each is
known from. Lengths in mm, quaternions Q0 (scalar), Qx, Qy, Qz; a pose whose state does not say that it was measured
counts as missing, and so does -3.697314E28, NDI's BAD_FLOAT.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from os import PathLike, fspath

import numpy as np

from ..errors import Fact, InvalidInput
from .sheet import SAVE_OR_SAY, Sheet, cell_lines
from .trial import UNIT

USABLE = frozenset({"", "ok", "okay", "valid", "enabled", "partiallyoutofvolume"})  # letters only, lower case
_MM = Decimal("1e-3")
_POSE = ("q0", "qx", "qy", "qz")
_PLACES = (("tx", "ty", "tz"), ("x", "y", "z"))
_LOOK = 12  # lines in which a header may stand
_OF_ONE = "#tools"  # how the header of NDI's sample program begins: it names the columns of the first tool only


@dataclass(frozen=True, kw_only=True)
class Block:
    """Where a tool's columns are: first (Q0), state, frame, time, error; None where there is none."""

    tool: str
    first: int
    state: int | None = None
    frame: int | None = None
    time: int | None = None
    error: int | None = None


@dataclass(frozen=True, kw_only=True)
class Track:
    """What an NDI file holds: n rows of k tools. time (n,) s, counted by the tracker; NaN without a time column.

    frame (n,) NaN without numbers. Both are those of the first tool that has them in a row. position (n, k, 3) m,
    orientation (n, k, 4), quality (n, k) m, state (n, k).
    apart: rows in which the tools' frame numbers differ.
    """

    name: str
    tools: tuple[str, ...]
    frame: np.ndarray
    time: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    quality: np.ndarray
    state: np.ndarray
    apart: int


def is_ndi(path: str | PathLike[str], encoding: str | None = None) -> bool:
    """Whether a header of NDI's stands in the first lines. encoding: of `text_of`."""
    return _header(cell_lines("path", fspath(path), encoding=encoding, hint=SAVE_OR_SAY)) is not None


def read_track(path: str | PathLike[str], encoding: str | None = None) -> Track:
    """The poses of an NDI track file, before anything is known of the robot."""
    name = fspath(path)
    lines = cell_lines("path", name, encoding=encoding, hint=SAVE_OR_SAY)
    head = _header(lines)
    if head is None:
        allowed = "a track file of NDI's: columns Q0, Qx, Qy, Qz, Tx, Ty, Tz for each tool"
        raise InvalidInput(name, Fact("without such a header"), allowed)
    rows = [(line, [cell.strip() for cell in cells]) for line, cells in lines[head + 1 :]]
    if not rows:
        raise InvalidInput(f"{name}: rows", Fact("none"), "given below the header")
    header = [cell.strip() for cell in lines[head][1]]
    if header[0].lower() == _OF_ONE:
        header, rows = _spread(name, rows)
    blocks = _blocks(header, [cells for _, cells in lines[:head]], rows[0][1])
    return _track(_as_sheet(name, header, rows), blocks)


def _header(lines: list[tuple[int, list[str]]]) -> int | None:
    for i, (_, cells) in enumerate(lines[:_LOOK]):
        if _starts(cells):
            return i
    return None


def _starts(cells: Sequence[str]) -> list[int]:
    """Where Q0, Qx, Qy, Qz, Tx, Ty, Tz begin."""
    names = [_word(cell) for cell in cells]
    return [
        i for i in range(len(names) - 6) if tuple(names[i : i + 4]) == _POSE and tuple(names[i + 4 : i + 7]) in _PLACES
    ]


def _word(title: str) -> str:
    """The last word of a title, without a number at its end: "Sensor 1 Q0", "Q0.1" and "Q0" are q0."""
    words = re.split(r"[\s_]+", re.sub(r"[._ ]\d+$", "", title.strip().lower()))
    return words[-1]


def _blocks(header: list[str], above: list[list[str]], row: list[str]) -> list[Block]:
    blocks, begin = [], 0
    for k, first in enumerate(_starts(header)):
        before = range(first - 1, begin - 1, -1)
        places = {key: next((j for j in before if _word(header[j]) in words), None) for key, words in _WORDS.items()}
        if places["time"] is None and k == 0:
            places["time"] = next((j for j in range(first) if "time" in header[j].lower()), None)
        after = _word(header[first + 7]) if first + 7 < len(header) else ""
        error = first + 7 if after in ("error", "rms", "quality") else None
        blocks.append(Block(tool=_tool(k, header, begin, first, above, row), first=first, error=error, **places))
        begin = first + 7
    return blocks


_WORDS = {"state": ("state", "status", "transformstatus"), "frame": ("frame", "frame#"), "time": ("time", "[sec]")}


def _tool(k: int, header: list[str], begin: int, first: int, above: list[list[str]], row: list[str]) -> str:
    """The tool's name: of its port, else the port's, else of the sensor, else its number."""
    for text in (*header[begin:first], *(cell for cells in above for cell in cells)):
        if found := re.search(r"\bport\s*:?\s*(\w+)\s*(?::\s*(.*?))?\s*(?:s/n:.*|\(.*)?$", text, re.IGNORECASE):
            return found[2] or f"Port {found[1]}"
    sensors = (re.match(r"sensor\s*\w+", text, re.IGNORECASE) for text in header[begin:first])
    return next((found[0] for found in sensors if found), f"tool {k + 1}")


def _spread(name: str, rows: list[tuple[int, list[str]]]) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Rows of NDI's sample program in the form of the others: markers, whose number changes, are left out."""
    header, found = ["Tools"], []
    for k, (line, cells) in enumerate(rows, 1):
        at, row, tools = 1, cells[:1], []
        while at + 13 <= len(cells):
            info, frame, port, _, state = cells[at : at + 5]
            tools.append((info.partition(" s/n:")[0].strip() or port).replace(":", " "))
            row += [info, frame, state, *cells[at + 5 : at + 13]]
            markers = cells[at + 13] if at + 13 < len(cells) else "0"
            at += 14 + 4 * (int(markers) if markers.isdigit() else 0)
        if not tools or cells[0] != str(len(tools)):
            allowed = "as many tools as the first cell says, of 13 cells and their markers each"
            raise InvalidInput(f"{name}: row {k} (line {line}), column 1 #Tools", Fact(cells[0]), allowed)
        found.append((line, row))
        if k == 1:
            titles = ["Frame", "State", "Q0", "Qx", "Qy", "Qz", "Tx", "Ty", "Tz", "Error"]
            header += [each for i, tool in enumerate(tools) for each in (f"Port {i + 1}: {tool}", *titles)]
    return header, found


def _as_sheet(name: str, header: list[str], rows: list[tuple[int, list[str]]]) -> Sheet:
    """Rows filled up, or cut where they are longer, to the header: empty cells at their ends come and go."""
    where = [f"row {k} (line {line})" for k, (line, _) in enumerate(rows, 1)]
    size = len(header)
    cells = []
    for at, (_, row) in zip(where, rows, strict=True):
        if any(row[size:]):
            raise InvalidInput(f"{name}: {at}: cells", len(row), f"{size} at most, as many as the header has")
        cells.append([*row, *[""] * (size - len(row))][:size])
    return Sheet(name=name, header=header, cells=cells, where=where)


def _track(sheet: Sheet, blocks: list[Block]) -> Track:
    n, nothing = len(sheet.cells), np.full(len(sheet.cells), np.nan)
    frames = np.stack([nothing if b.frame is None else sheet.numbers(b.frame) for b in blocks], axis=1)
    state = np.array([[""] * n if b.state is None else sheet.texts(b.state) for b in blocks], dtype=object).T
    pose = np.stack([[sheet.numbers(b.first + i) for i in range(7)] for b in blocks]).transpose(2, 0, 1)
    place = np.stack([[sheet.numbers(b.first + i, _MM) for i in (4, 5, 6)] for b in blocks]).transpose(2, 0, 1)
    wrong = np.array([[re.sub(r"[^a-z]", "", each.lower()) not in USABLE for each in row] for row in state])
    wrong |= ~pose[..., :4].any(axis=-1)  # no quaternion is zero
    place[wrong] = np.nan
    pose[wrong] = np.nan
    _check_turns(sheet, blocks, pose[..., :4])
    times = np.stack([nothing if b.time is None else sheet.numbers(b.time) for b in blocks], axis=1)
    counted = _counted(frames, wrong)
    return Track(
        name=sheet.name,
        tools=tuple(b.tool for b in blocks),
        frame=_first_known(counted, frames),
        time=_first_known(_counted(times, wrong), times),
        position=place,
        orientation=pose[..., :4],
        quality=np.stack([nothing if b.error is None else np.abs(sheet.numbers(b.error, _MM)) for b in blocks], axis=1),
        state=state,
        apart=int((np.fmax.reduce(counted, axis=1) > np.fmin.reduce(counted, axis=1)).sum()),
    )


def _counted(stamps: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """``stamps`` (n, k), frames or times, without the 0 that stands where a missing tool has none."""
    return np.where(wrong & (stamps == 0.0), np.nan, stamps)


def _first_known(*stamps: np.ndarray) -> np.ndarray:
    """(n,) the first number in each row of arrays (n, k); NaN where there is none."""
    row = np.concatenate(stamps, axis=1)
    return row[np.arange(len(row)), np.isfinite(row).argmax(axis=1)]


def _check_turns(sheet: Sheet, blocks: list[Block], turns: np.ndarray) -> None:
    length = np.linalg.norm(turns, axis=-1)
    wrong = np.argwhere(np.abs(length - 1.0) > UNIT)  # NaN is not
    if wrong.size:
        k, j = (int(i) for i in wrong[0])
        allowed = f"Q0 of a quaternion of length 1; this one's is {length[k, j]:.6g}"
        raise InvalidInput(sheet.at(k, blocks[j].first), Fact(sheet.cells[k][blocks[j].first]), allowed)
