"""Lines between host and motor board: writing, checking, reading. The whole protocol: docs/bench_protocol.rst."""

from __future__ import annotations

from binascii import crc_hqx
from dataclasses import dataclass
from enum import IntFlag

FIRMWARE = "tendonrod-bench"
PROTOCOL = 1
AXES = 3
NAMES = ("screw", "translation", "rotation")
COMMAND_UNITS = (1e6, 1e6, 1e3)  # in MOVE and LIMITS: um, um, mrad and the like per m, m, rad
STATE_UNITS = (1e9, 1e9, 1e6)  # in a state: nm, nm, urad per m, m, rad
SEQUENCES = 65536  # sequence numbers count modulo this
ANSWER_LONGEST = 256  # bytes, newline included

# What the board says of a command that it refuses, in words.
REFUSALS = {
    "FRAME": "the line does not begin as a command",
    "LENGTH": "the line is too long",
    "CRC": "the checksum is wrong",
    "SYNTAX": "the arguments are not those of the command",
    "COMMAND": "the command is unknown",
    "SEQUENCE": "the sequence number is stale or used already",
    "HELLO": "the board was restarted; open it again and home the axes",
    "RANGE": "a value is beyond the board's limits",
    "HOME": "an axis that is to move is not homed",
    "BUSY": "an axis is moving",
    "WATCHDOG": "the board stopped the axes because no command came in time",
}


class Flag(IntFlag):
    """Bits of the state's flags; those of an axis are shifted by its index, 0 to 2 (`Flag.of`)."""

    HOMED = 0x1
    LOW = 0x8
    HIGH = 0x40
    STALLED = 0x200
    HOMING = 0x1000
    HOME_FAILED = 0x8000
    WATCHDOG = 0x40000

    def of(self, axis: int) -> int:
        """The bit of one axis."""
        return self << axis


class DamagedLine(ValueError):
    """A line that is not what a board sends: noise, or part of an answer."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Answer:
    """One answer: the command's sequence number, None where the board could not read it; words after OK or ERR."""

    sequence: int | None
    is_ok: bool
    words: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class BoardState:
    """What READ, MOVE, HOME and STOP answer: raw numbers of the board.

    micros: its time, us, modulo 2**32. positions: nm, nm, urad; velocities the same per second, by the encoders.
    counts: of the load cell. done: sequence number of the newest MOVE, HOME or STOP that was carried out.
    """

    micros: int
    positions: tuple[int, int, int]
    velocities: tuple[int, int, int]
    counts: int
    flags: int
    done: int

    def has(self, flag: Flag, axis: int = 0) -> bool:
        """Whether a flag is set; of an axis where there is one for each."""
        return bool(self.flags & flag.of(axis))


@dataclass(frozen=True, kw_only=True, slots=True)
class BoardLimits:
    """What LIMITS answers.

    axes: of each low, high, speed, acceleration in um or mrad. counts: range of the load cell's converter, saturated at
    both ends. watchdog: us.
    """

    axes: tuple[tuple[int, int, int, int], ...]
    counts: tuple[int, int]
    watchdog: int


def sealed(text: str) -> bytes:
    """A line with its checksum (CRC-16/CCITT-FALSE over everything before the star) and newline."""
    line = text.encode("ascii")
    return b"%s*%04X\n" % (line, crc_hqx(line, 0xFFFF))


def command(sequence: int, name: str, *arguments: int) -> bytes:
    """``>SEQ NAME ARGUMENTS*CRC\\n``."""
    return sealed(" ".join((f">{sequence}", name, *map(str, arguments))))


def answer(line: bytes) -> Answer:
    """Read a line, without its newline. Raises `DamagedLine`."""
    text, star, checksum = line[line.rfind(b"<") :].rpartition(b"*")
    if not star or not text.startswith(b"<") or checksum != b"%04X" % crc_hqx(text, 0xFFFF):
        raise DamagedLine("no line of a board, or one that was damaged on its way")
    number, _, rest = text[1:].decode("ascii", "replace").partition(" ")
    verdict, *words = rest.split(" ")
    if verdict not in ("OK", "ERR") or not (number == "-" or number.isdecimal()):
        raise DamagedLine("no answer of this protocol")
    return Answer(sequence=None if number == "-" else int(number), is_ok=verdict == "OK", words=tuple(words))


def state(words: tuple[str, ...]) -> BoardState:
    """Read the words of a state. Raises `DamagedLine`."""
    try:
        time, x, y, z, u, v, w, counts = map(int, words[:8])
        flags, done = int(words[8], 16), int(words[9])
    except (ValueError, IndexError):
        raise DamagedLine("no state of a board of this protocol") from None
    return BoardState(micros=time, positions=(x, y, z), velocities=(u, v, w), counts=counts, flags=flags, done=done)


def limits(words: tuple[str, ...]) -> BoardLimits:
    """Read the words that answer LIMITS. Raises `DamagedLine`."""
    try:
        numbers = [int(word) for word in words]
        low, high, watchdog = numbers[4 * AXES :]
    except ValueError:
        raise DamagedLine("no limits of a board of this protocol") from None
    axes = tuple((a, b, c, d) for a, b, c, d in zip(*[iter(numbers[: 4 * AXES])] * 4, strict=True))
    return BoardLimits(axes=axes, counts=(low, high), watchdog=watchdog)
