"""`BenchAside`: a session on a bench whose control loop runs in a process of its own, see `bench_process` for why."""

from __future__ import annotations

import copyreg
import io
import json
import pickle
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from ..errors import TendonrodError, positive
from ..rig.benches import BenchSource, VirtualSource, as_source
from ..rig.trials import RATE
from .bench_drive import check_same
from .bench_process import TOLD_EVERY, Start
from .commands import Jog, Posture
from .dead_man import GRACE
from .pace import Pace
from .recovery import END, OnBench, Trouble, check_acknowledged
from .scenario import Scenario

PROGRAM = (sys.executable, "-m", "tendonrod.navigate.bench_process")
LONGEST_END = 60.0  # s, for letting the tendon go and closing the devices
AHEAD = 0.4  # of a control period: a period that ends later than that takes no longer by a virtual bench's clock
LONGEST_WORD = 0.3  # s, for the word of an operator to be heard
SILENT = 1.0  # s, after which what was measured last says nothing about now
WAIT = "wait, what is shown is old; if it lasts, end this program and start it again: the tendon is then let go"


class BenchAside(OnBench):
    """Steers a bench as `BenchDrive` does with a loop of its own, from another process, which opens it.

    What is shown is what was measured last, up to 10 ms ago. If this process ends, however it does, the other lets the
    tendon go. paced: whether `advance` takes as long as it says, as a script needs it, see `Pace`.

    Raises as `BenchDrive`; all that happens in the other process as `TendonrodError`.
    """

    def __init__(
        self, scenario: Scenario, source: BenchSource, *, seed: int = 0, rate: float = RATE, paced: bool = False
    ) -> None:
        source = _patient(as_source(source), rate)
        check_same(scenario, source)
        self._coupled, self._lock, self._closed = scenario.coupled, threading.Lock(), False
        self._pace, self._heard = Pace() if paced else None, time.monotonic()
        start = Start(
            robot=scenario.robot, limits=scenario.limits, coupled=scenario.coupled, source=source, seed=seed, rate=rate
        )
        self._process = subprocess.Popen(PROGRAM, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._reader = threading.Thread(target=self._read, name="bench", daemon=True)
        try:
            self._write(_pickled(start))
            ready = self._first("ready")
            self.fastest, self.highest = Jog(**ready["fastest"]), float(ready["highest"])
            self._take(self._line())
        except BaseException:
            self._process.terminate()  # never killed at once: it may be homing, and has to stop the axes first
            self.close()
            raise
        self._reader.start()

    @property
    def posture(self) -> Posture:
        """What the bench measured last."""
        insertion, rotation, *tension = self._state["at"]
        return Posture(insertion=insertion, rotation=rotation, tension=tuple(tension))

    @property
    def coupled(self) -> bool:
        """Whether insertion turns the motor."""
        return self._coupled

    @coupled.setter
    def coupled(self, on: bool) -> None:
        self._coupled = on
        self._send(coupled=on)

    @property
    def held_back(self) -> str:
        """See `OnBench`."""
        return self._state["held_back"]

    @property
    def trouble(self) -> Trouble | None:
        """See `OnBench`."""
        if self._process.poll() is not None:
            return Trouble(text=f"the bench's process has ended, status {self._process.returncode}", remedy=END)
        if self._is_silent:
            return Trouble(text="the bench's process says nothing", remedy=WAIT)
        told = self._state["trouble"]
        return None if told is None else Trouble(**told)

    def advance(self, jog: Jog, dt: float) -> Posture:
        """Steer at ``jog`` for ``dt`` s, where not paced from now on and `GRACE` more; what was measured last."""
        lasts = dt + GRACE if self._pace is None else self._pace.begin(jog, dt)
        if not self._is_silent:  # what nobody reads fills the pipe, and then holds up the session
            self._send(steer=[jog.insertion, jog.rotation, jog.tension, lasts])
        if self._pace is not None:
            self._pace.wait()
        return self.posture

    def acknowledge(self, home: bool = False) -> None:
        """See `BenchDrive`; returns once the other process says so, unless the fault lasts."""
        check_acknowledged(self.trouble, home)
        before, end = self._state["trouble"], time.monotonic() + LONGEST_WORD
        self._send(acknowledge=home)
        while self._state["trouble"] == before and time.monotonic() < end:
            time.sleep(TOLD_EVERY)

    def halt(self) -> None:
        """See `BenchDrive`."""
        if self.trouble is not None:
            self._send(halt=True)

    def close(self) -> None:
        """Leave the robot slack and standing, and let the devices go."""
        if self._closed:
            return
        self._closed = True
        if self._pace is not None and self._reader.is_alive():
            self._pace.finish()
        with suppress(OSError):
            self._stdin.close()
        try:
            self._process.wait(LONGEST_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise TendonrodError(f"the bench's process did not end within {LONGEST_END:g} s, and was killed") from None
        finally:
            if self._reader.is_alive():
                self._reader.join(1.0)

    @property
    def _is_silent(self) -> bool:
        return time.monotonic() - self._heard > SILENT

    @property
    def _stdin(self) -> Any:
        return self._process.stdin

    def _line(self) -> bytes:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise TendonrodError(f"the bench's process has ended, status {self._process.wait(LONGEST_END)}")
        return line

    def _first(self, key: str) -> Any:
        """What the first line has under ``key``. Raises `TendonrodError` with the error that it tells instead."""
        said = json.loads(self._line())
        if "error" in said:
            raise TendonrodError(said["error"])
        return said[key]

    def _read(self) -> None:
        """Keep the newest state, until there are no more."""
        with suppress(TendonrodError, ValueError, OSError):
            while True:
                self._take(self._line())

    def _take(self, line: bytes) -> None:
        self._state, self._heard = json.loads(line), time.monotonic()

    def _send(self, **command: Any) -> None:
        self._write(json.dumps(command).encode() + b"\n")

    def _write(self, data: bytes) -> None:
        with self._lock, suppress(OSError, ValueError):  # a process that has ended is told by `trouble`
            self._stdin.write(data)
            self._stdin.flush()


def _patient(source: BenchSource, rate: float) -> BenchSource:
    """A virtual bench that waits for a busy machine: it is there to be steered, not to show how busy that is."""
    return replace(source, ahead=AHEAD / positive("rate", rate)) if isinstance(source, VirtualSource) else source


def _pickled(start: Start) -> bytes:
    """With the read-only mappings that sources have, which pickle itself does not take."""
    out = io.BytesIO()
    pickler = pickle.Pickler(out)
    pickler.dispatch_table = copyreg.dispatch_table | {MappingProxyType: lambda each: (_read_only, (dict(each),))}
    pickler.dump(start)
    return out.getvalue()


def _read_only(values: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    """The mapping again; pickle finds no class by the name of its own."""
    return MappingProxyType(values)
