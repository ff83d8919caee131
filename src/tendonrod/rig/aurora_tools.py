"""Which name is which tool of the tracker, and the tool definition files (.rom) that go with them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ..errors import InvalidInput
from .aurora_reply import Plugged
from .interfaces import DeviceError

ROM_LARGEST = 1024  # bytes, as ndicapi takes them
PAGE = 64  # bytes of one PVWR

_EXACT = re.compile(r"[0-9A-F]{2}|port \d+(\.\d+)?")


def checked_tools(tools: Mapping[str, str | Path | None] | None) -> dict[str, str | None] | None:
    """``tools`` with paths as text. Raises `InvalidInput` for no tool, a name that is none, a file that is no .rom."""
    if tools is None:
        return None
    if not isinstance(tools, Mapping) or not tools:
        raise InvalidInput("tools", tools, "names, each with its .rom file or None; None for all that are plugged in")
    for name, rom in tools.items():
        if not isinstance(name, str) or not name or "\n" in name:
            raise InvalidInput("tools", name, "named by text: a name, a handle such as '0A', or 'port 1'")
        _rom(f"tools[{name!r}]", rom)
    return {name: None if rom is None else str(rom) for name, rom in tools.items()}


def assigned(port: str, found: Sequence[Plugged], wanted: Mapping[str, object] | None) -> dict[str, Plugged]:
    """Tools by name: a handle or a place means that tool; other names mean the rest, in the order of their ports.

    Raises `DeviceError` where there is no tool, a named one is not there, or there are not as many as names: a tool is
    never taken for another because one was unplugged.
    """
    there = {each.handle: each for each in sorted(found, key=lambda each: (each.port, each.channel))}
    listed = ", ".join(f"{each.handle:02X} ({each.place})" for each in there.values())
    if not there:
        raise DeviceError(f"{port}: no tool is plugged into the tracker")
    if wanted is None:
        return {each.place: each for each in there.values()}
    by_key = {key: each for each in found for key in (f"{each.handle:02X}", each.place)}
    chosen: dict[str, Plugged] = {}
    for name in filter(_EXACT.fullmatch, wanted):
        if name not in by_key:
            raise DeviceError(f"{port}: no tool at {name}; plugged in: {listed}")
        chosen[name] = by_key[name]
    rest = [each for each in there.values() if each not in chosen.values()]
    names = [name for name in wanted if name not in chosen]
    if names and len(names) != len(rest):
        wants = f"must be {len(wanted)}, {', '.join(wanted)}"
        raise DeviceError(f"{port}: {len(there)} tools are plugged in, {listed}: {wants}")
    chosen |= dict(zip(names, rest, strict=False))
    return {name: chosen[name] for name in wanted}


def rom_pages(path: str | None) -> Iterator[str]:
    """A .rom file as PVWR takes it: address (4 digits) and 64 bytes (128 digits) each; nothing for None."""
    if path is not None:
        data = Path(path).read_bytes().ljust(ROM_LARGEST, b"\0")
        yield from (f"{at:04X}{data[at : at + PAGE].hex().upper()}" for at in range(0, ROM_LARGEST, PAGE))


def _rom(field: str, rom: str | Path | None) -> None:
    if rom is None:
        return
    try:
        data = Path(rom).read_bytes()
    except (OSError, TypeError):
        raise InvalidInput(field, rom, "a tool definition file (.rom) that can be read, or None") from None
    if not data.startswith(b"NDI\0") or len(data) > ROM_LARGEST:
        raise InvalidInput(field, str(rom), f"a tool definition file: begins with 'NDI', {ROM_LARGEST} bytes at most")
