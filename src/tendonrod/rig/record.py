"""`read_record`: a record as arrays, whole or as far as it goes; what is missing is told, not guessed."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..errors import Fact, InvalidInput
from .record_layout import END, HEADER, LINE, MESSAGE, SAMPLE_PIECE, TEXT, VERSION, Piece, pieces
from .record_tables import Tables, tables
from .states import Fault, FaultKind, Reaction

COMPLETE = "complete"
NONSENSE = (ValueError, TypeError, OverflowError, RecursionError, struct.error)  # what reading it may raise


class Message(NamedTuple):
    """A message of ``time`` (s, the bench's clock)."""

    time: float
    level: str
    text: str


class Damage(NamedTuple):
    """Bytes of a record that are no piece of one."""

    at: int
    size: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """What a recorder wrote; SI, arrays read-only, in the order of writing.

    header: as given to the recorder. samples (n,): structured, fields as `record_layout.SAMPLE`, such as
    samples["screw"]["position"]. frames (m,): structured, as `record_layout.FRAME`; frame_sample (m,): index of the
    sample that brought each. fault_rows (f,), fault_sample (f,): the same of faults. texts: by the ids in these arrays;
    `states`, `tools`, `frame_states` have them in words. messages: of the log. end: what was written at the close,
    nothing where the record was not closed.

    damage: stretches inside the record that are unreadable. torn: bytes of a last piece that was not written to its
    end. reserved: bytes of room behind it. lost: pieces that are missing by their numbers. unreadable: samples that
    refer to what is lost, or that a newer tendonrod wrote; they are left out. strange: pieces that are whole and yet
    nothing that this version knows, or that stand where an earlier one should: no recorder of tendonrod wrote that.
    """

    name: str
    header: Mapping[str, Any]
    samples: np.ndarray
    frames: np.ndarray
    frame_sample: np.ndarray
    fault_rows: np.ndarray
    fault_sample: np.ndarray
    texts: Mapping[int, str]
    messages: tuple[Message, ...] = ()
    end: Mapping[str, Any] = field(default_factory=dict)
    damage: tuple[Damage, ...] = ()
    torn: int = 0
    reserved: int = 0
    lost: int = 0
    unreadable: int = 0
    strange: int = 0

    def __post_init__(self) -> None:
        for name in ("samples", "frames", "frame_sample", "fault_rows", "fault_sample"):
            getattr(self, name).setflags(write=False)

    def __repr__(self) -> str:
        return f"Record({self.name}: {self.samples.size} samples, {self.frames.size} frames; {self.condition})"

    @property
    def is_complete(self) -> bool:
        """Whether it was closed and everything that was ever written is here."""
        return self.condition == COMPLETE

    @property
    def condition(self) -> str:
        """What is wrong with the record, in words; "complete" if nothing is."""
        spoilt = sum(each.size for each in self.damage)
        dropped, refused = self.end.get("lost_bytes", 0), self.end.get("refused", 0)
        said = {
            "not closed": not self.end,
            f"{_count(self.torn, 'byte')} of a torn last piece left out": self.torn,
            f"damaged in {_count(len(self.damage), 'place')}, {_count(spoilt, 'byte')}": spoilt,
            f"{_count(self.lost, 'piece')} missing": self.lost,
            f"{_count(self.unreadable, 'sample')} unreadable": self.unreadable,
            f"{_count(self.strange, 'piece')} of unknown content or out of place": self.strange,
            f"{_count(dropped, 'byte')} never written": dropped,
            f"{_count(refused, 'sample')} of wrong types, told in the messages": refused,
        }
        return "; ".join(text for text, holds in said.items() if holds) or COMPLETE

    @property
    def time(self) -> np.ndarray:
        """(n,) of the control periods, s."""
        return self.samples["time"]

    @property
    def states(self) -> np.ndarray:
        """(n,) of the bench, texts."""
        return self._words(self.samples["state"])

    @property
    def tools(self) -> np.ndarray:
        """(m,) of the frames, texts."""
        return self._words(self.frames["tool"])

    @property
    def frame_states(self) -> np.ndarray:
        """(m,) what the tracker said of each frame, texts."""
        return self._words(self.frames["state"])

    @property
    def faults(self) -> tuple[Fault, ...]:
        """All that differ, in the order in which they came."""
        found = {row.tobytes(): row.item() for row in self.fault_rows}
        return tuple(fault_of(row, self.texts) for row in found.values())

    def _words(self, ids: np.ndarray) -> np.ndarray:
        names, where = np.unique(ids, return_inverse=True)
        return np.array([self.texts[each] for each in names.tolist()], dtype=object)[where]


def read_record(path: str | PathLike[str]) -> Record:
    """The record on file, as far as it goes: `Record.condition` tells whether that is all of it.

    A record that is still being written may be read too. Raises `InvalidInput` where there is no such file, it is no
    record at all, or of a newer version.
    """
    name = fspath(path)
    try:
        data = Path(name).read_bytes()
    except (FileNotFoundError, ValueError):
        raise InvalidInput("record file", Fact(name or "''"), "an existing record") from None
    except OSError as error:
        raise InvalidInput("record file", Fact(name), f"readable: {error.strerror or error}") from None
    found = _Found(data)
    if not found.pieces and not data.startswith(LINE) and not LINE.startswith(data.rstrip(b"\0")):
        raise InvalidInput("record file", Fact(name), f"a record, which starts with {LINE.decode().strip()!r}")
    return found.record(name)


@dataclass
class _Found:
    """What is in the bytes of a record."""

    data: bytes
    header: Mapping[str, Any] = field(default_factory=dict)
    texts: dict[int, str] = field(default_factory=dict)
    samples: list[Piece] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    end: Mapping[str, Any] = field(default_factory=dict)
    damage: list[Damage] = field(default_factory=list)
    pieces: int = 0
    lost: int = 0
    torn: int = 0
    reserved: int = 0
    strange: int = 0

    def __post_init__(self) -> None:
        expected = 0
        for each in pieces(self.data):
            if isinstance(each, Piece):
                self.pieces += 1
                self._count_missing((each.number - expected) & 0xFFFFFFFF)
                expected = each.number + 1
                self._take(each)
            else:
                self._skip(*each)

    def _count_missing(self, gap: int) -> None:
        """A number may be ahead of the one expected; one that is behind has been there, or belongs elsewhere."""
        if gap < 1 << 31:
            self.lost += gap
        else:
            self.strange += 1

    def _take(self, piece: Piece) -> None:
        if piece.kind == SAMPLE_PIECE:
            self.samples.append(piece)
            return
        try:
            self._understand(piece.kind, self.data[piece.start : piece.stop])
        except NONSENSE:  # its checksum is right: no accident, but another program's or a newer version's
            self.strange += 1

    def _understand(self, kind: int, content: bytes) -> None:
        """Raises ValueError and TypeError for what is no content of its kind."""
        if kind == TEXT:
            number, text = content[:4], content[4:].decode("utf-8", "surrogatepass")
            self.texts[struct.unpack("<I", number)[0]] = text
        elif kind == MESSAGE:
            time, level, text = json.loads(content)
            self.messages.append(Message(float(time), str(level), str(text)))
        elif kind == HEADER:
            self.header = _mapping(content)
        elif kind == END:
            told = _mapping(content)
            self.end = told | {name: int(told.get(name, 0)) for name in ("lost_bytes", "refused")}
        else:
            raise ValueError(kind)

    def _skip(self, start: int, stop: int) -> None:
        if stop < len(self.data):
            self.damage.append(Damage(start, stop - start))
        else:
            self.torn = len(self.data[start:].rstrip(b"\0"))
            self.reserved = stop - start - self.torn

    def record(self, name: str) -> Record:
        version = self.header.get("record_version", VERSION)
        if version != VERSION:
            allowed = f"{VERSION}; a newer tendonrod reads this file"
            raise InvalidInput(f"{name}: record_version", version, allowed)
        found = tables(self.data, self.samples)
        return self._record(name, found.only(found.understood(self.texts)))

    def _record(self, name: str, found: Tables) -> Record:
        return Record(
            name=name,
            header=MappingProxyType(dict(self.header)),
            **found._asdict(),
            texts=MappingProxyType(self.texts),
            messages=tuple(self.messages),
            end=MappingProxyType(dict(self.end)),
            damage=tuple(self.damage),
            torn=self.torn,
            reserved=self.reserved,
            lost=self.lost,
            unreadable=len(self.samples) - len(found.samples),
            strange=self.strange,
        )


def _mapping(content: bytes) -> dict[str, Any]:
    found = json.loads(content)
    if not isinstance(found, dict):
        raise TypeError(found)
    return found


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"


def fault_of(row: tuple, texts: Mapping[int, str]) -> Fault:
    """The fault in a row of `FAULT`."""
    kind, reaction, where, time, value, limit = row
    words = {"kind": FaultKind(texts[kind]), "reaction": Reaction(texts[reaction]), "where": texts[where]}
    return Fault(time=time, value=value, limit=limit, **words)  # pyright: ignore[reportArgumentType]
