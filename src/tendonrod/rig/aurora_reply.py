"""What an NDI tracker answers, as text: replies to TX, PHSR and PHINF taken apart, words for its status bits.

Formats as in ndicapi's parser and header (ndicapi.cxx: ndiTXHelper, ndicapi.h: ndiGetPHINFPortLocation); bits 8 and 12
of a tool's status as public Aurora drivers name them. A reply to TX 0001 is two digits of how many handles follow, each
as handle, then pose or word, status (8 digits) and frame number (8 digits) to the end of a line; in the end the
system's status (4 digits). All digits are hexadecimal but those of the pose: four of the quaternion with four decimals,
three of the position in mm with two, one of the error indicator in mm with four.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import nan

NO_POSITION = (nan, nan, nan)
NO_QUATERNION = (nan, nan, nan, nan)
UNPLUGGED = "UNOCCUPIED"

STATUS = {0x040: "out of volume", 0x080: "partially out of volume", 0x100: "sensor broken", 0x1000: "processing failed"}
UNROUND = 2e-3  # by how much the square of a quaternion's length may be off 1; four decimals make 2e-4 of it
LOST = 0x1140  # of these bits, all but "partially": what is said of the pose then is no measurement
SYSTEM = {
    0x01: "communication out of step",
    0x04: "system CRC error",
    0x08: "system exception",
    0x10: "hardware failed",
}

_POSE = r"(?:[+-]\d{5}){4}(?:[+-]\d{6}){3}[+-]\d{5}"
_TOOL = re.compile(
    rf"(?P<handle>[0-9A-F]{{2}})(?:(?P<gone>UNOCCUPIED|DISABLED)(?:[0-9A-F]{{16}})?"
    rf"|(?:MISSING|(?P<pose>{_POSE}))(?P<status>[0-9A-F]{{8}})(?P<frame>[0-9A-F]{{8}}))\n?"
)
_WIDTHS = (6, 6, 6, 6, 7, 7, 7, 6)
_UNITS = (1e-4, 1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-7)  # the last four in m


class DamagedReply(ValueError):
    """A reply that is none; the message says what it is instead."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ToolReply:
    """One tool in a reply to TX: position (m), quaternion (w, x, y, z), error indicator (m); NaN where it has no pose.

    is_turned: False for a pose whose quaternion is none, which is therefore taken for no pose.
    gone: "UNOCCUPIED" or "DISABLED" where the tool is no longer tracked at all; it has no frame number (-1) then.
    """

    handle: int
    gone: str = ""
    status: int = 0
    frame: int = -1
    position: tuple[float, float, float] = NO_POSITION
    quaternion: tuple[float, float, float, float] = NO_QUATERNION
    error: float = nan
    is_turned: bool = True

    @property
    def words(self) -> tuple[str, ...]:
        """What is amiss with the tool in this frame, nothing where all is well."""
        missing = () if self.position[0] == self.position[0] else ("missing",)
        missing += () if self.is_turned else ("no rotation",)
        return missing + tuple(word for bit, word in STATUS.items() if self.status & bit)


@dataclass(frozen=True, kw_only=True, slots=True)
class Tracked:
    """A reply to TX: tools in the order of the reply, status of the system."""

    tools: tuple[ToolReply, ...]
    system: int

    @property
    def words(self) -> tuple[str, ...]:
        """What is amiss with the system."""
        return tuple(word for bit, word in SYSTEM.items() if self.system & bit)


@dataclass(frozen=True, kw_only=True, slots=True)
class Plugged:
    """A tool that is plugged in: its handle, where (port and, of two sensors in one plug, channel), serial number."""

    handle: int
    port: int
    channel: int = 0
    serial: str = ""

    @property
    def place(self) -> str:
        """As people name it: "port 1", or "port 1.2" for the second sensor of a plug."""
        return f"port {self.port}" + (f".{self.channel + 1}" if self.channel else "")


def tracked(reply: str) -> Tracked:
    """A reply to TX 0001, without its CRC. Raises `DamagedReply`."""
    if not re.match("[0-9A-F]{2}", reply):
        raise DamagedReply(f"{reply[:40]!r} is no reply to TX")
    tools, at = [], 2
    for _ in range(int(reply[:2], 16)):
        found = _TOOL.match(reply, at)
        if found is None:
            raise DamagedReply(f"{reply[at : at + 40]!r} is no tool")
        tools.append(_tool(found))
        at = found.end()
    if not re.fullmatch("[0-9A-F]{4}", reply[at:]):
        raise DamagedReply(f"{reply[at : at + 40]!r} is no status of the system")
    return Tracked(tools=tuple(tools), system=int(reply[at:], 16))


def handles(reply: str) -> tuple[int, ...]:
    """The handles that a reply to PHSR lists: how many, then handle (2 digits) and status (3) each."""
    count = int(reply[:2], 16) if re.match("[0-9A-F]{2}", reply) else -1
    if not re.fullmatch(rf"[0-9A-F]{{{2 + 5 * count}}}" if count >= 0 else "-", reply):
        raise DamagedReply(f"{reply[:40]!r} is no reply to PHSR")
    return tuple(int(reply[i : i + 2], 16) for i in range(2, len(reply), 5))


def plugged(handle: int, reply: str) -> Plugged:
    """A reply to PHINF 0021: type, maker, revision, serial number, status (33 characters), then the place (14)."""
    found = re.fullmatch(r".{23}(?P<serial>.{8}).{2}.{10}(?P<port>.{2})(?P<channel>[0-9A-Fa-f]{2})", reply, re.DOTALL)
    port = found and re.fullmatch(r"0?([0-9A-Ia-i]{1,2})", found["port"])
    if not found or not port:
        raise DamagedReply(f"{reply[:60]!r} is no reply to PHINF")
    number = int(port[1]) if port[1].isdigit() else ord(port[1].upper()[0]) - ord("A") + 1
    return Plugged(handle=handle, port=number, channel=int(found["channel"], 16), serial=found["serial"].strip())


def _tool(found: re.Match[str]) -> ToolReply:
    handle = int(found["handle"], 16)
    if found["gone"]:
        return ToolReply(handle=handle, gone=found["gone"])
    status, frame = int(found["status"], 16), int(found["frame"], 16)
    if found["pose"] is None or status & LOST:
        return ToolReply(handle=handle, status=status, frame=frame)
    w, qx, qy, qz, x, y, z, error = _numbers(found["pose"])
    if abs(w * w + qx * qx + qy * qy + qz * qz - 1.0) > UNROUND:
        return ToolReply(handle=handle, status=status, frame=frame, is_turned=False)
    return ToolReply(
        handle=handle, status=status, frame=frame, position=(x, y, z), quaternion=(w, qx, qy, qz), error=error
    )


def _numbers(pose: str) -> list[float]:
    numbers, at = [], 0
    for width, unit in zip(_WIDTHS, _UNITS, strict=True):
        numbers.append(int(pose[at : at + width]) * unit)
        at += width
    return numbers
