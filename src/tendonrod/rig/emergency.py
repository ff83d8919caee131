"""Emergency stop from program and keyboard: a word left with the interlock, which acts on it within a period.

Space and Esc stop; so does any key that sends an escape sequence, such as an arrow, on the safe side. Ctrl-C releases
and ends; a terminal that goes away does the same, since with it goes the way to stop. POSIX terminals only.
"""

from __future__ import annotations

import atexit
import os
import select
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

from .safety import Interlock

STOP_KEYS = {b" ": "space", b"\x1b": "Esc"}
INTERRUPT = b"\x03"
NO_CHARACTER = b"\x00"  # switches a control character off (_POSIX_VDISABLE on Linux)


class EmergencyStop:
    """A button: `press` from any thread, as often as one likes. source: what records say of it."""

    def __init__(self, interlock: Interlock, source: str = "API") -> None:
        self._interlock, self.source, self._pressed = interlock, source, False

    @property
    def is_pressed(self) -> bool:
        """Whether it was pressed since it was made."""
        return self._pressed

    def press(self) -> None:
        """Stop the bench at its next period."""
        self._pressed = True
        self._interlock.emergency(self.source)


class KeyboardStop:
    """Reads a terminal key by key in a thread of its own, as a context; the terminal is as before when it ends.

    terminal: file descriptor, None for standard input. other: called in that thread with every other key, a character.
    Ctrl-Z and Ctrl-\\ do nothing meanwhile, since they would leave the bench without its process; Ctrl-C still makes a
    signal, for which `rig.ending.safely` is there. Without a terminal nothing is read, and `is_active` is False.
    """

    def __init__(
        self, interlock: Interlock, terminal: int | None = None, other: Callable[[str], None] | None = None
    ) -> None:
        self._interlock, self._terminal, self._other = interlock, terminal, other
        self._before: list | None = None
        self._thread: threading.Thread | None = None
        self._wake: tuple[int, int] | None = None

    @property
    def is_active(self) -> bool:
        """Whether keys are being read."""
        return self._thread is not None and self._thread.is_alive()

    def __enter__(self) -> KeyboardStop:
        if self._terminal is None:
            self._terminal = _standard_input()
        if self._terminal is None or not os.isatty(self._terminal):
            return self
        self._open(self._terminal)
        return self

    def __exit__(self, *_) -> None:
        if self._wake is not None:
            os.write(self._wake[1], b".")
        if self._thread is not None:
            self._thread.join(timeout=1.0)
        self._restore()
        for end in self._wake or ():
            os.close(end)
        self._thread = self._wake = None

    def _open(self, terminal: int) -> None:
        import termios

        self._before = termios.tcgetattr(terminal)
        atexit.register(self._restore)  # also where a thread's end keeps the context from closing
        now = termios.tcgetattr(terminal)
        now[3] &= ~(termios.ICANON | termios.ECHO)
        for character in (termios.VSUSP, termios.VQUIT):
            now[6][character] = NO_CHARACTER
        termios.tcsetattr(terminal, termios.TCSANOW, now)
        self._wake = os.pipe()
        self._thread = threading.Thread(
            target=self._read, args=(terminal, self._wake[0]), name="emergency keys", daemon=True
        )
        self._thread.start()

    def _restore(self) -> None:
        import termios

        before, self._before = self._before, None
        if before is not None and self._terminal is not None:
            with suppress(termios.error, OSError):  # the terminal may be gone
                termios.tcsetattr(self._terminal, termios.TCSANOW, before)
        atexit.unregister(self._restore)

    def _read(self, terminal: int, wake: int) -> None:
        while True:
            try:
                ready, _, _ = select.select([terminal, wake], [], [])
                keys = b"" if wake in ready else os.read(terminal, 64)
            except (OSError, ValueError):  # closed meanwhile
                ready, keys = [], b""
            if wake in ready:
                return
            if not keys:
                self._interlock.interrupt("terminal gone")
                return
            self._take(keys)

    def _take(self, keys: bytes) -> None:
        for key, name in STOP_KEYS.items():
            if key in keys:
                self._interlock.emergency(name)
                return
        if INTERRUPT in keys:
            self._interlock.interrupt("Ctrl-C")
        elif self._other is not None:
            for character in keys.decode(errors="ignore"):
                with suppress(Exception):  # an error of the caller's must not end the thread that stops the bench
                    self._other(character)


def _standard_input() -> int | None:
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # closed, or replaced by what is no file
        return None
