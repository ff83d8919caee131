"""How a record is laid out on file: pieces that are each complete in themselves, behind one line of text; version 1.

All numbers are little-endian, SI, as the devices gave them to the last bit. After the line ``tendonrod record 1``:

======== ======== =======================================================================
piece    bytes    content
======== ======== =======================================================================
mark     4        AB 72 65 63
checksum 4        CRC-32 of everything after it in the piece
length   4        of the content, bytes
number   4        0, 1, 2, ... modulo 2**32: a gap is what was lost
kind     1        1 header, 2 text, 3 sample, 4 message, 5 end
content  length   of the header: JSON; it is the first piece, "record_version" tells the version
                  of a text: its id (u4), then UTF-8; what follows names it by that id
                  of a sample: `SAMPLE`, then `FAULT` where there is one, then `FRAME` by frame
                  of a message: JSON, [time in s, level, text]
                  of the end: JSON: why it ended, what failed, and what is missing
======== ======== =======================================================================

Zeros behind the last piece are reserved room, given back when a record is closed. No byte is ever written twice.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .interfaces import Command, PoseFrame, Sample
from .states import Fault

VERSION = 1
LINE = b"tendonrod record %d\n" % VERSION
HEADER, TEXT, SAMPLE_PIECE, MESSAGE, END = 1, 2, 3, 4, 5

MARK = b"\xabrec"
_HEAD = struct.Struct("<4sIIIB")
_CHECKED = struct.Struct("<IIB")  # of the head, what the checksum covers
_UNCHECKED = _HEAD.size - _CHECKED.size

AXIS = [
    ("time", "<f8"),
    ("position", "<f8"),
    ("velocity", "<f8"),
    ("homed", "?"),
    ("at_limit", "i1"),
    ("stalled", "?"),
]
SAMPLE = np.dtype(
    [
        ("time", "<f8"),
        ("screw", AXIS),
        ("translation", AXIS),
        ("rotation", AXIS),
        ("force", [("time", "<f8"), ("tension", "<f8"), ("saturated", "?")]),
        ("command", [("screw", "<f8"), ("translation", "<f8"), ("rotation", "<f8"), ("target", "<f8")]),
        ("state", "<u4"),  # id of its text
        ("faulty", "u1"),  # 1 if a fault follows
        ("frames", "<u2"),  # how many follow
    ]
)
FAULT = np.dtype(
    [("kind", "<u4"), ("reaction", "<u4"), ("where", "<u4"), ("time", "<f8"), ("value", "<f8"), ("limit", "<f8")]
)
FRAME = np.dtype(
    [
        ("time", "<f8"),
        ("frame", "<i8"),
        ("tool", "<u4"),
        ("position", "<f8", 3),
        ("quaternion", "<f8", 4),
        ("quality", "<f8"),
        ("state", "<u4"),
    ]
)
_SAMPLE = struct.Struct("<d" + 3 * "ddd?b?" + "dd?" + "4d" + "IBH")
_FAULT = struct.Struct("<IIIddd")
_FRAME = struct.Struct("<dqI3d4ddI")


def piece(number: int, kind: int, content: bytes) -> bytes:
    """A whole piece of a record."""
    checked = _CHECKED.pack(len(content), number & 0xFFFFFFFF, kind)
    checksum = zlib.crc32(content, zlib.crc32(checked))
    return b"".join((MARK, checksum.to_bytes(4, "little"), checked, content))


def as_json(value: object) -> bytes:
    """``value`` as JSON in one line, NumPy's numbers and arrays as plain ones. Raises TypeError and ValueError."""
    return json.dumps(value, default=_plain).encode()


def _plain(value: object) -> object:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is nothing that JSON can say")


class Texts(dict[str, int]):
    """Ids of texts; one that is new is handed to ``tell`` (id, UTF-8) before anything can refer to it."""

    def __init__(self, tell) -> None:
        super().__init__()
        self._tell = tell

    def __missing__(self, text: str) -> int:
        number = len(self)
        self._tell(number.to_bytes(4, "little") + text.encode("utf-8", "surrogatepass"))
        self[text] = number
        return number


def packed(sample: Sample, command: Command, state: str, fault: Fault | None, texts: Texts) -> bytes:
    """The content of a sample's piece. Raises whatever wrong types raise, and `struct.error`."""
    a, b, c, force, frames = sample.screw, sample.translation, sample.rotation, sample.force, sample.frames
    content = _SAMPLE.pack(
        *(sample.time,),
        *(a.time, a.position, a.velocity, a.homed, a.at_limit, a.stalled),
        *(b.time, b.position, b.velocity, b.homed, b.at_limit, b.stalled),
        *(c.time, c.position, c.velocity, c.homed, c.at_limit, c.stalled),
        *(force.time, force.tension, force.saturated),
        *(command.screw, command.translation, command.rotation, command.target),
        *(texts[state], fault is not None, len(frames)),
    )
    if fault is not None:
        content += _packed_fault(fault, texts)
    if frames:
        content += b"".join([_packed_frame(each, texts) for each in frames])
    return content


def _packed_fault(fault: Fault, texts: Texts) -> bytes:
    kind, reaction, where = texts[fault.kind], texts[fault.reaction], texts[fault.where]
    return _FAULT.pack(kind, reaction, where, fault.time, fault.value, fault.limit)


def _packed_frame(frame: PoseFrame, texts: Texts) -> bytes:
    tool, state = texts[frame.tool], texts[frame.state]
    return _FRAME.pack(frame.time, frame.frame, tool, *frame.position, *frame.quaternion, frame.quality, state)


class Piece(NamedTuple):
    """A piece as found: its content is data[start:stop]."""

    number: int
    kind: int
    start: int
    stop: int


def piece_at(data: bytes, at: int) -> Piece | None:
    """The piece that starts at byte ``at``, None where there is none that is whole."""
    start = at + _HEAD.size
    if start > len(data):
        return None
    mark, checksum, length, number, kind = _HEAD.unpack_from(data, at)
    stop = start + length
    if mark != MARK or stop > len(data) or zlib.crc32(data[at + _UNCHECKED : stop]) != checksum:
        return None
    return Piece(number, kind, start, stop)


def pieces(data: bytes) -> Iterator[Piece | tuple[int, int]]:
    """The pieces of a record, and (start, stop) of the bytes between them that are none; the tail is such a stretch."""
    at = len(LINE) if data.startswith(LINE) else 0
    while at < len(data):
        found = piece_at(data, at)
        if found is None:
            following = _next_piece(data, at + 1)
            yield at, following
            at = following
        else:
            yield found
            at = found.stop


def _next_piece(data: bytes, at: int) -> int:
    """Where the next whole piece starts, or the end of the data."""
    while (at := data.find(MARK, at)) >= 0:
        if piece_at(data, at) is not None:
            return at
        at += 1
    return len(data)
