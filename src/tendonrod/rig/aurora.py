"""NDI Aurora, an electromagnetic tracker, over serial or TCP through ndicapi, which runs in a process of its own.

The bench's loop never waits for the tracker: `Aurora.read` takes what a background thread has received from that
process (`aurora_process`, which also says why it is one). A tracker that falls silent, is unplugged or sends noise
without end costs that process, and here one `DeviceError`. The emulator of tests/rig is all that this has met so far.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from threading import Event, Thread
from time import monotonic

from ..errors import InvalidInput, finite, nonnegative, positive
from .aurora_link import BAUDS, MARGIN, tcp_address
from .aurora_reply import NO_POSITION, NO_QUATERNION, ToolReply, tracked
from .aurora_time import FrameTimes
from .aurora_tools import checked_tools
from .interfaces import DeviceError, PoseFrame

RATE = 40.0  # Hz
KEPT = 40_000  # frames that may wait to be read: 1000 s of one tool
OPENING_LONGEST = 60.0  # s
CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGILL, signal.SIGFPE}


@dataclass(kw_only=True, slots=True)
class AuroraCounts:
    """What happened so far, over all tools."""

    frames: int = 0
    lost: int = 0  # frames without a pose
    skipped: int = 0  # frame numbers that never came
    damaged: int = 0  # replies that had to be asked for again
    overrun: int = 0  # frames that nobody read in time


class Aurora:
    """A tracker that tracks, an `interfaces.PoseTracker`.

    Attributes: ``tools`` (names), ``handles`` (port handle and place by name), ``firmware``, ``rate`` (Hz, as
    its frames come), ``counts``, ``delay``.
    """

    def __init__(
        self,
        port: str,
        *,
        tools: Mapping[str, str | Path | None] | None = None,
        now: Callable[[], float] = monotonic,
        rate: float = RATE,
        delay: float = 0.0,
        largest_error: float = inf,
        limit: float = 1.0,
        setup_limit: float = 5.0,
        baud: int = 115_200,
    ) -> None:
        """Open the tracker, initialise its tools and start tracking; takes some seconds.

        port: "/dev/ttyUSB0" or "tcp://host:port". tools: names, each with its tool definition file (.rom), or None for
        the one in the plug. A name such as "0A" is that port handle, "port 1" or "port 1.2" that place; other
        names are the tools that remain, in the order of their ports. None: all that are plugged in, by place.
        now: the bench's clock, s (``Clock.now``), which must run as fast as real time. rate: Hz, until frames tell.
        delay: s from measuring to being offered, which the protocol does not tell, taken off the frames' times.
        largest_error: m, of the tracker's error indicator; poses above it are lost as "bad fit". limit, setup_limit: s
        for one answer, when tracking and before. baud: of a serial line, after the first words at 9600.

        Raises `InvalidInput`, and `DeviceError` in one line: no such port, taken, nothing answers, no NDI Aurora, tools
        that are not there, a refused command.
        """
        check_options(
            port, rate=rate, delay=delay, largest_error=largest_error, limit=limit, setup_limit=setup_limit, baud=baud
        )
        self._port, self._now, self._limit = port, now, float(limit)
        self._times, self.delay = FrameTimes(float(rate)), float(delay)
        self._largest_error = float(largest_error)
        wanted = {"port": port, "tools": checked_tools(tools), "baud": baud}
        wanted |= {"limit": self._limit, "setup_limit": float(setup_limit)}
        self._prepare()
        self._process = _started(wanted)
        self._thread = Thread(target=self._listen, name="aurora", daemon=True)
        self._thread.start()
        self._await_ready()

    def _prepare(self) -> None:
        self.counts = AuroraCounts()
        self.tools: tuple[str, ...] = ()
        self.handles: dict[str, list] = {}
        self.firmware = ""
        self._names: dict[int, str] = {}
        self._numbers: dict[int, int] = {}
        self._frames: deque[PoseFrame] = deque(maxlen=KEPT)
        self._failure, self._is_ready, self._is_closing = "", Event(), False

    def __enter__(self) -> Aurora:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def rate(self) -> float:
        """Frames per second, as they come."""
        return self._times.rate

    def read(self) -> tuple[PoseFrame, ...]:
        """All frames since the last call, oldest first. Never waits. Raises `DeviceError` once the tracker is lost."""
        has_failed = bool(self._failure)  # asked first: what came before the failure is handed out before it
        found = []
        with suppress(IndexError):
            while True:
                found.append(self._frames.popleft())
        if has_failed and not found:
            raise DeviceError(self._failure)
        return tuple(found)

    def close(self) -> None:
        """Stop tracking and let the tracker go; a second time does nothing."""
        self._is_closing = True
        with suppress(OSError, ValueError):
            self._process.stdin.close()  # pyright: ignore[reportOptionalMemberAccess]
        try:
            self._process.wait(self._limit + MARGIN + 2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._thread.join()
        self._failure = self._failure or f"{self._port}: the tracker is closed"

    def _await_ready(self) -> None:
        try:
            if not self._is_ready.wait(OPENING_LONGEST):
                raise DeviceError(f"{self._port}: the tracker is not ready after {OPENING_LONGEST:.0f} s")
            if self._failure:
                raise DeviceError(self._failure)
        except BaseException:
            self.close()
            raise

    def _listen(self) -> None:
        """In the background: take what the process tells, until it ends."""
        try:
            for line in self._process.stdout:  # pyright: ignore[reportOptionalIterable]
                self._take(json.loads(line))
        except (ValueError, KeyError, TypeError) as error:
            self._failure = f"{self._port}: the tracker's process tells nonsense ({error})"
        finally:
            self._failure = self._failure or self._how_it_ended()
            self._is_ready.set()

    def _take(self, told: dict) -> None:
        if "reply" in told:
            self._took_reply(told["reply"], told["from"], told["to"])
        elif "damaged" in told:
            self.counts.damaged += 1
        elif "error" in told:
            self._failure = " ".join(told["error"].split())
        elif "ready" in told:
            self.firmware, self.handles = told["ready"]["firmware"], told["ready"]["tools"]
            self.tools = tuple(self.handles)
            self._names = {handle: name for name, (handle, _) in self.handles.items()}
            self._is_ready.set()

    def _took_reply(self, text: str, earliest: float, latest: float) -> None:
        offset = self._now() - monotonic()
        reply = tracked(text)
        for tool in reply.tools:
            if tool.handle in self._names and tool.frame != self._numbers.get(tool.handle):
                time = self._times.time(tool.frame, earliest, latest) + offset - self.delay
                self._add(tool, time, reply.words)

    def _add(self, tool: ToolReply, time: float, system: tuple[str, ...]) -> None:
        skipped = max(0, tool.frame - self._numbers.get(tool.handle, tool.frame) - 1)
        self._numbers[tool.handle] = tool.frame
        is_bad = tool.error > self._largest_error
        words = [*(("bad fit",) if is_bad else ()), *tool.words, *system]
        if skipped:
            words.append(f"{skipped} frame{'s' if skipped > 1 else ''} before it skipped")
        frame = PoseFrame(
            time=time,
            frame=tool.frame,
            tool=self._names[tool.handle],
            position=NO_POSITION if is_bad else tool.position,
            quaternion=NO_QUATERNION if is_bad else tool.quaternion,
            quality=tool.error,
            state=", ".join(words),
        )
        self.counts.frames += 1
        self.counts.lost += frame.is_lost
        self.counts.skipped += skipped
        self.counts.overrun += len(self._frames) == KEPT
        self._frames.append(frame)

    def _how_it_ended(self) -> str:
        code = self._process.wait()
        if self._is_closing:
            return f"{self._port}: the tracker is closed"
        if code == -signal.SIGALRM and not self._is_ready.is_set():
            return f"{self._port}: no tracker answers there"
        if code == -signal.SIGALRM:
            return f"{self._port}: no answer from the tracker for {self._limit:g} s"
        if code < 0:
            name = signal.Signals(-code).name
            if -code in CRASHES:
                return f"{self._port}: ndicapi failed ({name}), as it does on noise without end"
            return f"{self._port}: the tracker's process was ended by another program ({name})"
        said = self._process.stderr.read().strip().rpartition("\n")[2]  # pyright: ignore[reportOptionalMemberAccess]
        return f"{self._port}: the tracker's process ended ({said or f'exit status {code}'})"


def _started(wanted: dict) -> subprocess.Popen[str]:
    source = str(Path(__file__).parents[2])  # the child imports the same tendonrod, however this one was found
    path = os.pathsep.join(filter(None, (source, os.environ.get("PYTHONPATH"))))
    return subprocess.Popen(
        [sys.executable, "-m", "tendonrod.rig.aurora_process", json.dumps(wanted)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )


def check_options(
    port: object, *, rate: object = RATE, delay: object = 0.0, largest_error: object = inf, limit: object = 1.0,
    setup_limit: object = 5.0, baud: object = 115_200,
) -> None:  # fmt: skip
    """Raise `InvalidInput` by name for what `Aurora` cannot work with."""
    is_address = isinstance(port, str) and "://" in port
    if not isinstance(port, str) or not port or (is_address and tcp_address(port) is None):
        raise InvalidInput("port", port, "a serial port such as '/dev/ttyUSB0', or 'tcp://host:port'")
    finite("delay", delay)
    for name, value in {"rate": rate, "limit": limit, "setup_limit": setup_limit}.items():
        positive(name, value)
    if largest_error != inf:
        nonnegative("largest_error", largest_error)
    if baud not in BAUDS:
        raise InvalidInput("baud", baud, "one of " + ", ".join(map(str, BAUDS)))
