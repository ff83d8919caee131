"""The motor board (a LAUNCHXL-F28379D in the paper): three axes and the load cell over one serial line.

One exchange a period is enough: MOVE sets all three velocities and answers with the state. `BoardAxis.move` therefore
holds a velocity back until the others have theirs, or until somebody reads; a command to stand still goes out at once.
Reading asks the board only where the newest state was read by this device before, or is older than ``max_age``.
The board's own watchdog stops all axes 0.1 s after the last MOVE; nothing else satisfies it, since a host that merely
reads has lost its controller. The emulated board (`tendonrod.rig.firmware`) is all that this has met so far.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from threading import RLock
from time import monotonic, sleep

from ..errors import InvalidInput, nonnegative, whole, within
from .board_devices import BoardAxis, BoardLoadCell, Calibration
from .board_link import BoardLink, LinkCounts, Refused, Reply
from .board_protocol import AXES, FIRMWARE, NAMES, PROTOCOL, BoardLimits, BoardState, DamagedLine, Flag, limits
from .board_time import BoardTime
from .board_velocities import Velocities
from .interfaces import DeviceError

BAUD = 921_600
BAUDS = 1200, 12_000_000
TIMEOUTS = 0.001, 1.0  # s for one answer: the loop waits for it
MOST_TRIES = 100
LOST_IN_A_ROW = 3  # MOVEs that may get lost before that is an error
HOMING_LONGEST = 120.0  # s; the board gives up by itself after twice the axis's travel


@dataclass(frozen=True, kw_only=True, slots=True)
class Snapshot:
    """A state of the board and when it was (s of the bench's clock)."""

    time: float
    state: BoardState


class LaunchPad:
    """A motor board that was found and greeted; its axes stand still. One object a port; calls from any thread.

    Attributes: ``screw``, ``translation``, ``rotation`` (`BoardAxis`), ``load_cell`` (`BoardLoadCell`), ``firmware``
    (name and version), ``limits`` (as the board tells them), ``counts`` (of the line: repeated, lost, damaged).
    """

    def __init__(
        self,
        port: str,
        *,
        now: Callable[[], float] = monotonic,
        baud: int = BAUD,
        timeout: float = 0.05,
        tries: int = 5,
        max_age: float = 0.002,
        calibration: Calibration | None = None,
    ) -> None:
        """Open ``port`` for this program alone and greet the board.

        now: the bench's clock, s (``Clock.now``). timeout: s for one answer; tries: how often a question is asked.
        max_age: s; inf for strictly one exchange a period, on states that are one period old. calibration: of the load
        cell. Raises `InvalidInput`, and `DeviceError` in one line: no such port, no permission, taken, no board there,
        other firmware.
        """
        check_options(port, baud=baud, timeout=timeout, tries=tries, max_age=max_age)
        self._now, self._max_age = now, max_age
        self._lock, self._time = RLock(), BoardTime()
        self._commands, self._lost = Velocities(), 0
        self._snapshot: Snapshot | None = None
        self._seen: set[str] = set()
        self._link = BoardLink(port, baud, now=now, timeout=timeout, tries=tries)
        try:
            self.firmware = self._greet()
            self.limits = self._ask_limits()
        except BaseException:
            self._link.close()
            raise
        self._commands.watchdog = self.limits.watchdog * 1e-6
        self.screw, self.translation, self.rotation = (BoardAxis(self, i) for i in range(AXES))
        self.load_cell = BoardLoadCell(self, calibration or Calibration())

    def __enter__(self) -> LaunchPad:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def counts(self) -> LinkCounts:
        """What happened on the line so far."""
        return self._link.counts

    def transact(self, screw: float, translation: float, rotation: float) -> Snapshot:
        """Set three velocities (m/s, m/s, rad/s) and get the state: one exchange. Raises `DeviceError`."""
        with self._lock:
            for axis, velocity in enumerate((screw, translation, rotation)):
                self._commands.stage(axis, velocity, self._now())
            return self._send()

    def move(self, axis: int, velocity: float) -> None:
        """Set one velocity; it goes out with those of the other axes, before the next state is read."""
        with self._lock:
            if self._commands.is_staged(axis):
                self._send()
            is_halt = velocity == 0.0 and self._commands.is_moving(axis)
            if self._commands.stage(axis, velocity, self._now()) or is_halt:
                self._send()

    def read(self, reader: str) -> Snapshot:
        """The newest state that ``reader`` has not had before. Raises `DeviceError`."""
        with self._lock:
            newest = self._snapshot
            if self._commands.any_staged:
                newest = self._send()
            elif newest is None or reader in self._seen or self._now() - newest.time > self._max_age:
                newest = self._took(self._link.ask("READ"))
            self._seen.add(reader)
            return newest

    def stop(self) -> Snapshot:
        """Stop all axes as fast as they can; ends homing, forgives a stall and a watchdog. Raises `DeviceError`."""
        with self._lock:
            self._commands.forget()
            return self._took(self._link.ask("STOP"))

    def home(self, axis: int, should_stop: Callable[[], bool] | None = None) -> None:
        """Stop, home one axis and wait for it.

        should_stop: asked about every 10 ms, in this thread, between two exchanges, so that it may ask the board
        itself. Once it says so the axes are stopped, and this returns with the axis not homed. Raises `DeviceError` and
        whatever ``should_stop`` raises; the axes are stopped then too.
        """
        try:
            last = self._home(axis, monotonic() + HOMING_LONGEST, should_stop or _never)
        except BaseException:
            with suppress(DeviceError):
                self.stop()
            raise
        if last is not None and not last.has(Flag.HOMED, axis):
            raise DeviceError(f"{self._link.port}: {NAMES[axis]} is not homed: {_why_not_homed(last, axis)}")

    def close(self) -> None:
        """Stop the axes if the board still answers, and let the port go; a second time does nothing."""
        with self._lock:
            with suppress(DeviceError):
                self.stop()
            self._snapshot = None
            self._link.close()

    def _greet(self) -> str:
        try:
            words = self._link.ask("HELLO").answer.words
        except Refused:
            raise
        except DeviceError:
            what = "what answers there is no motor board" if self.counts.damaged else "no motor board answers there"
            raise DeviceError(f"{self._link.port}: {what} (firmware {FIRMWARE})") from None
        if len(words) != 3 or words[0] != FIRMWARE or words[2] != str(PROTOCOL):
            wanted = f"must be {FIRMWARE} with protocol {PROTOCOL}"
            raise DeviceError(f"{self._link.port}: firmware is {' '.join(words)[:80]!r}: {wanted}")
        return f"{words[0]} {words[1]}"

    def _ask_limits(self) -> BoardLimits:
        try:
            return limits(self._link.ask("LIMITS").answer.words)
        except DamagedLine as error:
            raise DeviceError(f"{self._link.port}: {error}") from None

    def _send(self) -> Snapshot:
        """MOVE. One that got lost is not repeated: the next period brings a newer one; several are an error."""
        units = self._commands.take(self._now(), [axis[2] for axis in self.limits.axes])
        try:
            reply = self._link.tell("MOVE", *units)
        except Refused as error:
            self._commands.forget()
            if error.code == "WATCHDOG":
                self.stop()  # acknowledged: told once, as this error; the next command moves again
            raise
        self._lost = 0 if reply else self._lost + 1
        if self._lost >= LOST_IN_A_ROW:
            raise DeviceError(f"{self._link.port}: {self._lost} commands in a row did not reach the board")
        return self._took(reply or self._link.ask("READ"))

    def _took(self, reply: Reply) -> Snapshot:
        state = reply.state
        time = self._time.host(state.micros, reply.asked, reply.answered)
        self._snapshot = Snapshot(time=time, state=state)
        self._seen.clear()
        return self._snapshot

    def _home(self, axis: int, deadline: float, should_stop: Callable[[], bool]) -> BoardState | None:
        """The state after homing, whether it succeeded or not; None where it was stopped."""
        self.stop()
        began = False
        while not should_stop():
            began = began or self._began_homing(axis)
            if began and not (state := self._ask_state()).has(Flag.HOMING, axis):
                return state
            self._pause(axis, deadline)
        self.stop()
        return None

    def _began_homing(self, axis: int) -> bool:
        with self._lock:
            try:
                return self._link.tell("HOME", axis + 1) is not None
            except Refused as error:
                if error.code == "BUSY":  # still coming to rest
                    return False
                raise

    def _pause(self, axis: int, deadline: float) -> None:
        if monotonic() > deadline:
            raise DeviceError(f"{self._link.port}: homing of {NAMES[axis]} takes longer than {HOMING_LONGEST:.0f} s")
        sleep(0.01)

    def _ask_state(self) -> BoardState:
        with self._lock:
            return self._took(self._link.ask("READ")).state


def _never() -> bool:
    return False


def check_options(
    port: object, *, baud: object = BAUD, timeout: object = 0.05, tries: object = 5, max_age: object = 0.002
) -> None:
    """Raise `InvalidInput` by name for what `LaunchPad` cannot work with. A time that is no number would never end."""
    if not isinstance(port, str) or not port:
        raise InvalidInput("port", port, "the name of a serial port, such as '/dev/ttyACM0'")
    whole("baud", baud, *BAUDS)
    within("timeout", timeout, *TIMEOUTS)
    whole("tries", tries, 1, MOST_TRIES)
    if max_age != inf:
        nonnegative("max_age", max_age)


def _why_not_homed(state: BoardState, axis: int) -> str:
    if state.has(Flag.STALLED, axis):
        return "it does not move"
    if state.has(Flag.WATCHDOG):
        return "this program was held up for longer than the board waits"
    return "the board did not find its reference" if state.has(Flag.HOME_FAILED, axis) else "it was stopped"
