"""The process that holds a bench under the page; started by `bench_aside.BenchAside` alone.

It is a process of its own because a session computes: a step of it, with contact, takes from 3 to 100 ms, some load
compiled code for half a second, and Python lets only one thread of a process run. A control loop beside it is late
again and again, and a bench that gets no command for 0.1 s rightly stops. Here nothing computes but the loop.

It also outlives the session. Standard input brings a pickled `Start`, then one JSON object a line: {"steer":
[insertion m/s, rotation rad/s, tension N/s, s]}, {"coupled": bool}, {"acknowledge": home}, {"halt": true}. A command to
move ends by itself after its time. When standard input ends, so also when the session's process is killed, the tendon
is let go and the devices are closed; a homing that goes on at that time stops, also the one at the opening. Standard
output brings {"ready": ...} or {"error": text}, then the state 100 times per second.
"""

from __future__ import annotations

import json
import os
import pickle
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from typing import Any

from ..errors import TendonrodError
from ..rig.benches import BenchSource, VirtualSource
from ..rig.safety import Interlock
from ..robot import Robot
from .bench_drive import BenchDrive
from .commands import NAMES, Jog
from .limits import NavigationLimits

TOLD_EVERY = 0.01  # s
LOOKED_EVERY = 0.05  # s: how soon the end of an opening without a stop is noticed, not the stop, which comes at once
PRIORITY = 60  # of real time, above the 50 that the docs give to whole programs
NICER = -10


@dataclass(frozen=True, kw_only=True)
class Start:
    """The bench and how it is steered."""

    robot: Robot
    limits: NavigationLimits
    coupled: bool
    source: BenchSource
    seed: int
    rate: float


def precede(source: BenchSource) -> str:
    """Let no ordinary program hold up the loop of a bench of devices, as far as this user may; what could be had.

    A virtual bench computes instead of waiting for devices, would hold up the session, and waits for a busy machine.
    """
    if isinstance(source, VirtualSource):
        return ""
    with suppress(OSError, AttributeError):  # not allowed, or not on this system
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        return "real time"
    with suppress(OSError, AttributeError):
        os.nice(NICER)
        return "nice"
    return ""


def main() -> int:
    """Hold the bench until standard input ends; 0, or 1 where it did not open."""
    for name in ("SIGINT", "SIGHUP"):  # they reach the session too, which then ends standard input
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    try:
        start: Start = pickle.load(sys.stdin.buffer)
        precede(start.source)  # before there are other threads, which inherit it
        drive = BenchDrive(start, start.source, seed=start.seed, rate=start.rate, own_thread=True, opening=opening)
    except (TendonrodError, EOFError, pickle.UnpicklingError) as error:  # the latter: who started this was killed
        with suppress(BrokenPipeError):
            _tell(error=str(error))
        return 1
    ended = threading.Event()
    teller = threading.Thread(target=_tell_state, args=(drive, ended), daemon=True)
    try:
        with suppress(BrokenPipeError):  # standard input has ended too
            _tell(ready={"fastest": asdict(drive.fastest), "highest": drive.highest})
        teller.start()
        for line in sys.stdin.buffer:
            _do(drive, json.loads(line))
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        ended.set()
        teller.join(1.0)
        drive.close()
        with suppress(BrokenPipeError):
            _tell(**_state(drive))
    return 0


@contextmanager
def opening(interlock: Interlock) -> Iterator[None]:
    """While a bench homes: the end of standard input or SIGTERM stops the axes and lets the tendon go.

    Later SIGTERM ends the process from where it waits for the next command.
    """
    signal.signal(signal.SIGTERM, lambda *_: interlock.interrupt("SIGTERM"))
    over = threading.Event()
    watcher = threading.Thread(target=_watch_input, args=(interlock, over), name="input", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))


def _watch_input(interlock: Interlock, over: threading.Event) -> None:
    """Nothing is said to a bench before it is ready: what there is to read meanwhile is the end."""
    heard: Any = sys.stdin.buffer
    while not over.is_set():
        if select.select([heard], [], [], LOOKED_EVERY)[0]:
            if not heard.peek(1):
                interlock.interrupt("nobody steers any more")
            return


def _do(drive: BenchDrive, command: dict[str, Any]) -> None:
    match command:
        case {"steer": [*jog, time]}:
            drive.steer(Jog(**dict(zip(NAMES, jog, strict=True))), time)
        case {"coupled": on}:
            drive.coupled = on
        case {"acknowledge": home}:
            with suppress(TendonrodError):  # it was over, or had changed, before this came
                drive.acknowledge(home)
        case {"halt": _}:
            drive.halt()


def _tell_state(drive: BenchDrive, ended: threading.Event) -> None:
    """The newest state, again and again. Where nobody reads it, this waits, and the loop goes on."""
    with suppress(BrokenPipeError):
        while not ended.wait(TOLD_EVERY):
            _tell(**_state(drive))


def _state(drive: BenchDrive) -> dict[str, Any]:
    at, trouble = drive.posture, drive.trouble
    told = None if trouble is None else asdict(trouble)
    return {"at": [at.insertion, at.rotation, *at.tension], "trouble": told, "held_back": drive.held_back}


def _tell(**what: Any) -> None:
    """Without a buffer, which Python would try to write once more at its end, where nobody reads any more."""
    os.write(sys.stdout.fileno(), json.dumps(what).encode() + b"\n")


if __name__ == "__main__":
    sys.exit(main())
