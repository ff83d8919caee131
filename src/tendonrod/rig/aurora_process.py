"""The process that talks to the tracker through ndicapi, and hands on what it hears; started by `aurora.Aurora` alone.

It is a process of its own for what ndicapi 3.7.6 does: its socket has no time limit (a tracker that falls silent is
waited for without end), a reply without end overruns its buffer of 2 KB, a refused connection is used as if it stood.
None of that may happen where motors are controlled. Here, whatever takes longer than its limit ends the process by
SIGALRM, and `Aurora` says so.

One JSON object a line goes to standard output: {"ready": ...}, then {"reply": text of TX, "from": s, "to": s}
(monotonic time; see `aurora_time`) for each new frame, {"damaged": true} for each reply that has to be asked for again,
and in the end {"error": text}. It ends when its standard input is closed, so also when the bench's process is no more.
"""

from __future__ import annotations

import json
import select
import signal
import sys
from contextlib import suppress
from random import uniform
from time import monotonic, sleep

from .aurora_link import Link, NoAnswer, open_link
from .aurora_reply import UNPLUGGED, DamagedReply, Plugged, handles, plugged, tracked
from .aurora_tools import assigned, rom_pages
from .interfaces import DeviceError

POLL = 0.003, 0.005  # s between two questions for the newest frame; by chance, so as not to beat with the frames
TO_FREE, TO_INITIALISE, TO_ENABLE = 1, 2, 3  # what PHSR lists
ROUNDS = 2


def main(arguments: list[str]) -> int:
    """Run with one argument, a JSON object: port, tools, limit, setup_limit (s), baud."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C stops the bench first; the bench then ends this process
    wanted = json.loads(arguments[0])
    try:
        return _serve(wanted)
    except DeviceError as error:
        _tell(error=str(error))
    except BrokenPipeError:  # the bench is gone
        pass
    return 1


def _serve(wanted: dict) -> int:
    link = open_link(wanted["port"], limit=wanted["limit"], setup_limit=wanted["setup_limit"])
    try:
        firmware = link.greet(wanted["baud"])
        tools = _prepared(link, wanted["tools"])
        link.ask("TSTART:")
        _tell(ready={"firmware": firmware, "tools": {name: [t.handle, t.place] for name, t in tools.items()}})
        link.hurry()
        _watch(link, {tool.handle: name for name, tool in tools.items()})
        return 0
    except DeviceError as error:
        _tell(error=str(error))  # at once: taking leave of a tracker that is gone takes time
        return 1
    finally:
        with suppress(DeviceError):
            link.leave()


def _prepared(link: Link, wanted: dict[str, str | None] | None) -> dict[str, Plugged]:
    """Free what is left of earlier tools, initialise what is plugged in, choose and enable what is wanted."""
    for handle in _handles(link, TO_FREE):
        link.ask(f"PHF:{handle:02X}")
    roms = _roms(link, wanted or {})
    for _ in range(ROUNDS):  # of a plug with two sensors, the second has a handle once the first is initialised
        for handle in _handles(link, TO_INITIALISE):
            for page in rom_pages(roms.get(handle)):
                link.ask(f"PVWR:{handle:02X}{page}")
            link.ask(f"PINIT:{handle:02X}")
    by_name = assigned(link.port, _plugged(link, TO_ENABLE), wanted)
    for tool in by_name.values():
        link.ask(f"PENA:{tool.handle:02X}D")
    return by_name


def _roms(link: Link, wanted: dict[str, str | None]) -> dict[int, str]:
    """The .rom files by handles; nothing is asked of the tracker where there are none."""
    if not any(wanted.values()):
        return {}
    by_name = assigned(link.port, _plugged(link, TO_INITIALISE), wanted)
    return {tool.handle: rom for name, tool in by_name.items() if (rom := wanted[name])}


def _plugged(link: Link, kind: int) -> list[Plugged]:
    try:
        return [plugged(handle, link.ask(f"PHINF:{handle:02X}0021")) for handle in _handles(link, kind)]
    except DamagedReply as error:
        raise DeviceError(f"{link.port}: {error}") from None


def _handles(link: Link, kind: int) -> tuple[int, ...]:
    try:
        return handles(link.ask(f"PHSR:{kind:02X}"))
    except DamagedReply as error:
        raise DeviceError(f"{link.port}: {error}") from None


def _watch(link: Link, names: dict[int, str]) -> None:
    """Ask for the newest frame until standard input is closed, and hand on those that are new.

    The first answer only tells what is old: nobody knows since when it has been there.
    """
    newest: dict[int, int] | None = None
    before = good = monotonic()
    while not select.select([sys.stdin], [], [], 0.0)[0]:
        asked = monotonic()
        try:
            text = link.ask("TX:0001")
            answered = monotonic()
            frames = {tool.handle: tool.frame for tool in _all_there(link.port, text, names)}
        except (NoAnswer, DamagedReply) as error:
            _tell(damaged=True)
            if monotonic() - good > link.limit:
                what = "damaged answers only" if _is_damaged(error) else "no answer"
                raise DeviceError(f"{link.port}: {what} from the tracker for {link.limit:g} s") from None
            continue
        if newest not in (None, frames):
            _tell(reply=text, **{"from": before, "to": answered})
        newest, before, good = frames, asked, answered
        sleep(max(0.0, asked + uniform(*POLL) - monotonic()))


def _is_damaged(error: NoAnswer | DamagedReply) -> bool:
    return not isinstance(error, NoAnswer) or error.is_damaged


def _all_there(port: str, text: str, names: dict[int, str]):
    found = tracked(text).tools
    for tool in found:
        if tool.gone and tool.handle in names:
            how = "is unplugged" if tool.gone == UNPLUGGED else "is disabled"
            raise DeviceError(f"{port}: tool {names[tool.handle]} {how}")
    if missing := names.keys() - {tool.handle for tool in found}:
        raise DeviceError(f"{port}: the tracker no longer reports tool {names[min(missing)]}")
    return found


def _tell(**what: object) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
