"""`Recorder`: everything that a bench says and is told, on file within a moment, without ever holding up control.

- ``write`` packs a sample and puts it in a queue; a thread writes the queue to file every ``flush`` seconds, another
  asks the system every ``sync`` seconds to bring it to the disk itself. Neither holds Python's lock while it waits.
- ``kill -9`` loses what is still in the queue: `lag` seconds, `flush` plus what one write to the page cache takes. A
  crash of the machine loses up to ``sync`` seconds more.
- Room is reserved ahead of what is written. Once the disk gives no more, `failed` says so within `flush`, nothing is
  lost yet, and the reserve takes the end of the trial: 4 MiB are 20 s at 1000 Hz, 100 s at 200 Hz.
- Where writing itself fails, `failed` says so, samples wait in memory and are tried again until the record is closed.
- Where the disk hangs, `failed` says so after ``patience`` seconds.

`failed` stays once it is set. Whoever runs the bench asks for it each period and has the interlock stop the motion.
"""

from __future__ import annotations

import atexit
import os
import platform
import threading
from collections import deque
from collections.abc import Mapping
from datetime import UTC, datetime
from os import PathLike
from time import monotonic
from typing import Any

import numpy as np

from ..errors import InvalidInput, positive, whole
from ..files import file_name
from .interfaces import Command, Sample
from .record_file import RecordFile
from .record_layout import END, HEADER, LINE, MESSAGE, SAMPLE_PIECE, TEXT, VERSION, Texts, as_json, packed, piece
from .states import Fault

SUFFIX = ".rec"
KEPT = 64 << 20  # bytes that wait in memory where the disk takes none; what comes after them is counted and dropped
LEAVE = 10.0  # s that close waits for a disk that hangs


class Recorder:
    """A record being written to ``path`` (.rec), from the first sample to `close`; a context manager.

    header: what is known before the start (robot, setup, seed, versions, task, limits, notes), texts by key to whatever
    JSON can say; `export.header_of` writes what the export to a trial needs. What tendonrod itself knows is added as
    "record_version" and "recorder". flush, sync, patience: s, see above; sync None leaves it to the system. reserve:
    bytes.

    ``write`` from one thread; ``log`` from any, from a signal handler too. Neither raises or waits.
    Raises `InvalidInput` where there is a file at ``path`` already, none can be made, or there is no room for it.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        header: Mapping[str, Any],
        flush: float = 0.05,
        *,
        sync: float | None = 1.0,
        patience: float = 1.0,
        reserve: int = 4 << 20,
    ) -> None:
        self.path = file_name("record file", path, (SUFFIX,))
        self._flush, self._patience = positive("flush", flush), positive("patience", patience)
        self._sync = None if sync is None else positive("sync", sync)
        start = LINE + piece(0, HEADER, _header(header))
        self._file = RecordFile(self.path, start, whole("reserve", reserve, 1 << 12))
        self._queue: deque[tuple[int, bytes]] = deque()
        self._texts = Texts(lambda content: self._queue.append((TEXT, content)))
        self._number, self._lost, self._refused, self._failed = 1, 0, 0, ""
        self._waiting: deque[bytes] = deque()  # what could not be written yet
        self._emptied = self._called = self._excused = monotonic()  # the queue; `write`; a disk that seems to hang
        self._process, self._ended, self._over = os.getpid(), False, threading.Event()
        self._threads = [threading.Thread(target=self._write_on, name="record", daemon=True)]
        if self._sync is not None:
            self._threads.append(threading.Thread(target=self._sync_on, name="record to disk", daemon=True))
        for each in self._threads:
            each.start()
        atexit.register(self.close, "the program ended")

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self.close("closed" if kind is None else f"{kind.__name__}: {error}")

    @property
    def failed(self) -> str:
        """Why the record is not what it should be, in one line; "" as long as it is."""
        return self._failed

    @property
    def lag(self) -> float:
        """How far back the samples reach that are in memory only, s at most."""
        return monotonic() - self._emptied

    def write(self, sample: Sample, command: Command, state: str, fault: Fault | None = None) -> None:
        """Record one control period: what was sensed, commanded, and found."""
        try:
            self._queue.append((SAMPLE_PIECE, packed(sample, command, state, fault, self._texts)))
        except Exception as error:  # noqa: BLE001 - whatever a driver hands over, control goes on to the interlock
            self._refused += 1
            self._fail(f"a sample of wrong types: {error}")
            self.log(_time(sample), f"not recorded, {type(error).__name__}: {error}: {_shown(sample)}", "error")
        self._watch()

    def log(self, time: float, message: str, level: str = "info") -> None:
        """Record a message of ``time`` (s, the bench's clock)."""
        try:
            self._queue.append((MESSAGE, as_json([float(time), str(level), str(message)])))
        except Exception as error:  # noqa: BLE001 - as above
            self._fail(f"a message of wrong types: {error}")

    def close(self, reason: str = "closed") -> None:
        """Write all that waits, the end with its ``reason``, and close; raises nothing, `failed` tells. May be called
        again, and is when the program ends; in a forked process it does nothing.
        """
        if self._ended or os.getpid() != self._process:
            return
        self._over.set()
        for each in self._threads:
            each.join(LEAVE)
        if any(each.is_alive() for each in self._threads):
            self._fail("the disk does not answer; the end is not on file")
            return  # the thread that hangs still uses the file
        self._end(reason)
        self._ended = True
        atexit.unregister(self.close)

    def _end(self, reason: str) -> None:
        self._empty()
        told = {"reason": str(reason), "failed": self._failed, "lost_bytes": self._lost, "refused": self._refused}
        self._queue.append((END, as_json(told)))
        self._empty()
        try:
            if self._sync is not None:
                self._file.to_disk()
        except OSError as error:
            self._fail(f"not brought to the disk: {error.strerror or error}")
        try:
            self._file.close()
        except OSError as error:
            self._fail(f"not closed: {error.strerror or error}")

    def _watch(self) -> None:
        """Notice a disk that hangs. A process that was itself away, suspended or compiling, is no proof of one."""
        now = monotonic()
        if now - self._called > 0.5 * self._patience:
            self._excused = now
        self._called = now
        if self._over.is_set():
            self._fail("a sample came after it was closed")
        elif now - max(self._emptied, self._excused) > self._patience:
            self._fail(f"nothing could be written for {self._patience:.3g} s")

    def _fail(self, reason: str) -> None:
        if not self._failed:
            self._failed = " ".join(f"{self.path.name}: {reason}".split())

    def _write_on(self) -> None:
        while not self._over.wait(self._flush):
            try:
                self._empty()
            except Exception as error:  # noqa: BLE001 - a thread that ends unheard would lose everything after it
                self._fail(f"{type(error).__name__}: {error}")

    def _sync_on(self) -> None:
        self._file.name_to_disk()
        while not self._over.wait(self._sync):
            try:
                self._file.to_disk()
            except OSError as error:
                self._fail(f"not brought to the disk: {error.strerror or error}")

    def _empty(self) -> None:
        """Write what waits, then see to the reserve: what is known goes first."""
        began = monotonic()
        self._hold(self._numbered())
        try:
            self._write_waiting()
            self._emptied = began
        except OSError as error:
            self._fail(f"cannot be written: {error.strerror or error}")
        try:
            self._file.reserve_ahead()
        except OSError as error:
            self._fail(f"the disk gives no more room: {error.strerror or error}")

    def _numbered(self) -> bytes:
        """Everything in the queue as pieces."""
        found = []
        while self._queue:
            kind, content = self._queue.popleft()
            found.append(piece(self._number, kind, content))
            self._number += 1
        return b"".join(found)

    def _hold(self, data: bytes) -> None:
        if sum(map(len, self._waiting)) > KEPT:
            self._lost += len(data)
        elif data:
            self._waiting.append(data)

    def _write_waiting(self) -> None:
        while self._waiting:
            data, size = self._waiting[0], self._file.size
            try:
                self._file.append(data)
            except OSError:
                self._waiting[0] = data[self._file.size - size :]
                raise
            self._waiting.popleft()


def _header(header: Mapping[str, Any]) -> bytes:
    if not isinstance(header, Mapping) or not all(isinstance(key, str) for key in header):
        raise InvalidInput("header", header, "a mapping from texts to what JSON can say")
    try:
        return as_json({**header, "record_version": VERSION, "recorder": _surroundings()})
    except (TypeError, ValueError) as error:
        raise InvalidInput("header", header, f"a mapping to what JSON can say: {error}") from None


def _surroundings() -> dict[str, str]:
    from .. import __version__

    return {
        "tendonrod": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": platform.platform(),
        "started": datetime.now(UTC).isoformat(),
    }


def _time(sample: object) -> float:
    time = getattr(sample, "time", None)
    return time if isinstance(time, float) else float("nan")


def _shown(sample: object) -> str:
    try:
        return repr(sample)
    except Exception as error:  # noqa: BLE001 - a repr may be as wrong as the rest
        return f"no text of it: {error}"
