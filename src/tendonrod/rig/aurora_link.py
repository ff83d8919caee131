"""Commands to an NDI tracker through ndicapi, over serial or TCP, each within a time limit that ends the process."""

from __future__ import annotations

import os
import re
import signal
import stat
from collections.abc import Callable
from contextlib import suppress

from .interfaces import DeviceError

BAUDS = {9600: "0", 19200: "2", 38400: "3", 57600: "4", 115_200: "5", 230_400: "A"}  # of COMM, as far as ndicapi goes
POWER_UP = 9600  # baud, and after a reset
RESET_LIMIT = 12.0  # s that a tracker may take to reset
MARGIN = 1.0  # s in which ndicapi may still tell by itself that time is over, before tracking
PATIENCE = 0.2  # s after which a lost answer on a serial line is asked for again, when tracking
_CODE = re.compile(r"(?:POLARIS|Error) 0x([0-9a-fA-F]+): (.*)")
_NO_ANSWER, _DAMAGED = 0x103, 0x100
_MISHEARD = range(0x01, 0x06)  # refusals of a command that came damaged: unknown, too long or short, bad CRC, time-out


class NoAnswer(DeviceError):
    """A command without a whole answer: none in time, or a damaged one (``is_damaged``)."""

    def __init__(self, message: str, is_damaged: bool) -> None:
        super().__init__(message)
        self.is_damaged = is_damaged


class Link:
    """A tracker that ndicapi has open. Subclasses know how it is reached."""

    def __init__(self, port: str, limit: float, setup_limit: float) -> None:
        self.port, self.limit, self.setup_limit = port, limit, setup_limit
        self._ndi = _ndicapi()
        self._now_limit, self._tries = setup_limit + MARGIN, 3
        self._device: object = None

    def ask(self, command: str) -> str:
        """The answer to one command, its CRC checked and taken off. Raises `DeviceError`, `NoAnswer` among them.

        Until `hurry`, a command whose answer is damaged is given again.
        """
        for last in range(self._tries - 1, -1, -1):
            try:
                return self._ask(command)
            except NoAnswer as error:
                if not (last and error.is_damaged):
                    raise
        raise AssertionError

    def _ask(self, command: str) -> str:
        with _Deadline(self._now_limit):
            try:
                answer = self._ndi.ndiCommand(self._device, command)
            except OSError as error:
                raise self._failed(command, str(error)) from None
            except UnicodeDecodeError:  # noise with a right CRC
                raise NoAnswer(f"{self.port}: {command} is answered by noise", is_damaged=True) from None
        return answer or ""

    def greet(self, baud: int) -> str:
        """Initialise the tracker and see that it is an Aurora; what it says of its firmware, in one line."""
        self._initialise()
        says = self._version()
        firmware = " ".join(says.split())[:100]
        if "aurora" not in says.lower():
            raise DeviceError(f"{self.port}: what answers there is {firmware!r}: must be an NDI Aurora")
        self._speed_up(baud)
        return firmware

    def hurry(self) -> None:
        """From now on answers come within ``limit``, and whoever asks sees to damaged ones."""
        self._now_limit, self._tries = self.limit, 1

    def leave(self) -> None:
        """Stop tracking, and leave the tracker as it was found."""
        self.hurry()
        with suppress(DeviceError):
            self.ask("TSTOP:")

    def _initialise(self) -> None:
        try:
            self._init()
        except NoAnswer as error:
            raise self._nobody(error.is_damaged) from None

    def _init(self) -> None:
        if (answer := self.ask("INIT:")) != "OKAY":
            raise NoAnswer(f"{self.port}: INIT is answered by {answer[:40]!r}", is_damaged=True)

    def _nobody(self, was_heard: bool) -> DeviceError:
        what = "what answers there is no NDI tracker" if was_heard else "no tracker answers there"
        return DeviceError(f"{self.port}: {what}")

    def _version(self) -> str:
        for command in ("VER:4", "VER:0"):
            with suppress(DeviceError):
                return self.ask(command)
        return "a tracker that does not say which"

    def _speed_up(self, baud: int) -> None:
        """Raise the line's speed where it has one."""

    def _failed(self, command: str, text: str) -> DeviceError:
        found = _CODE.match(text)
        code, what = (int(found[1], 16), found[2]) if found else (_DAMAGED, text)
        name = command.partition(":")[0]
        if code in (_NO_ANSWER, _DAMAGED, *_MISHEARD):
            return NoAnswer(f"{self.port}: {name}: {what}", is_damaged=code != _NO_ANSWER)
        if code > 0xFF:
            return DeviceError(f"{self.port}: the tracker is gone ({name}: {what})")
        return DeviceError(f"{self.port}: {name} refused: {what} (ERROR{code:02X})")


class SerialLink(Link):
    """Over a serial port. The port is held for this program by a second opening of it, which no byte goes through."""

    def __init__(self, port: str, limit: float, setup_limit: float) -> None:
        super().__init__(port, limit, setup_limit)
        import fcntl
        import termios

        from .serial_port import open_port

        self._held = open_port(port, POWER_UP)
        # ndicapi opens the port too: let it, then keep others out again.
        fcntl.ioctl(self._held.fileno(), termios.TIOCNXCL)
        with _Deadline(setup_limit + MARGIN):
            self._device = self._ndi.ndiOpen(port)
        fcntl.ioctl(self._held.fileno(), termios.TIOCEXCL)
        if self._device is None:
            raise DeviceError(f"{port}: ndicapi cannot open it")
        self._wait_at_most(setup_limit)

    def hurry(self) -> None:
        super().hurry()
        self._wait_at_most(min(PATIENCE, 0.5 * self.limit))

    def leave(self) -> None:
        super().leave()
        self.ask(f"COMM:{BAUDS[POWER_UP]}0000")  # power-up speed, at which the next program begins

    def _initialise(self) -> None:
        """INIT at the power-up speed, at the speed an earlier program may have left, and after a reset by a break."""
        was_heard = False
        for prepare in (lambda: self._set_speed(POWER_UP), lambda: self._set_speed(115_200), self._reset):
            prepare()
            try:
                return self._init()
            except NoAnswer as error:
                was_heard = was_heard or error.is_damaged
        raise self._nobody(was_heard)

    def _reset(self) -> None:
        self._wait_at_most(min(RESET_LIMIT, 2.0 * self.setup_limit))
        with _Deadline(RESET_LIMIT + MARGIN), suppress(OSError):
            self._ndi.ndiCommand(self._device, None)
        self._wait_at_most(self.setup_limit)

    def _speed_up(self, baud: int) -> None:
        self.ask(f"COMM:{BAUDS[baud]}0000")

    def _set_speed(self, baud: int) -> None:
        import termios

        def change(attributes: list) -> None:
            attributes[4] = attributes[5] = getattr(termios, f"B{baud}")

        self._change(change)

    def _wait_at_most(self, seconds: float) -> None:
        """Set after how much silence ndicapi gives up; tenths of a second, 25.5 s at most."""
        import termios

        def change(attributes: list) -> None:
            attributes[6][termios.VMIN] = 0
            attributes[6][termios.VTIME] = max(1, min(255, round(10.0 * seconds)))

        self._change(change)

    def _change(self, change: Callable[[list], None]) -> None:
        """Change the port's settings, which ndicapi's opening shares; a port that is gone shows at the next command."""
        import termios

        with suppress(termios.error):
            attributes = termios.tcgetattr(self._held.fileno())
            change(attributes)
            termios.tcsetattr(self._held.fileno(), termios.TCSANOW, attributes)


class TcpLink(Link):
    """Over TCP: a tracker with a network port, or one behind a serial server that has the line's speed set."""

    def __init__(self, port: str, limit: float, setup_limit: float) -> None:
        super().__init__(port, limit, setup_limit)
        host, number = tcp_address(port) or ("", 0)
        before = _sockets()
        with _Deadline(setup_limit + MARGIN):
            self._device = self._ndi.ndiOpenNetwork(host, number)
        if self._device is None or not _sockets() - before:  # ndicapi gives a device also for a refused connection
            raise DeviceError(f"{port}: {_why_not(host, number, setup_limit)}")


def open_link(port: str, *, limit: float, setup_limit: float) -> Link:
    """Open "tcp://host:port" or a serial port. Raises `DeviceError`."""
    kind = TcpLink if tcp_address(port) else SerialLink
    return kind(port, limit, setup_limit)


def tcp_address(port: str) -> tuple[str, int] | None:
    """Host and port of "tcp://host:port"; None for anything else."""
    found = re.fullmatch(r"tcp://([^:/\s]+):(\d{1,5})", port)
    return (found[1], int(found[2])) if found and 0 < int(found[2]) < 1 << 16 else None


class _Deadline:
    """Ends the process by SIGALRM where what it encloses takes longer than ``seconds``."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    def __enter__(self) -> None:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, self._seconds)

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _ndicapi():
    try:
        import ndicapy
    except ImportError:
        raise DeviceError("an NDI tracker needs ndicapi: pip install 'tendonrod[bench]'") from None
    return ndicapy


def _sockets() -> set[int]:
    """Open sockets of this process."""
    found = set()
    for name in os.listdir("/proc/self/fd"):
        with suppress(OSError):
            if stat.S_ISSOCK(os.fstat(int(name)).st_mode):
                found.add(int(name))
    return found


def _why_not(host: str, number: int, limit: float) -> str:
    import socket

    try:
        socket.create_connection((host, number), timeout=limit).close()
    except socket.gaierror:
        return f"there is no host {host!r}"
    except TimeoutError:
        return "nothing answers there"
    except OSError as error:
        return f"cannot connect: {error.strerror or error}"
    return "ndicapi cannot connect"
