"""Serial ports: opened for one program alone, with errors of one line that list what there is."""

from __future__ import annotations

import errno
import os
from typing import TYPE_CHECKING

from .interfaces import DeviceError

if TYPE_CHECKING:
    from serial import Serial

READ_SLICE = 0.005  # s that one read waits at most; deadlines are kept by the caller
WRITE_LIMIT = 0.05  # s


def open_port(port: str, baud: int) -> Serial:
    """Open ``port`` (eight bits, no parity, one stop bit) for this program alone.

    Other programs are kept out by an advisory lock (flock), which those on pyserial respect, and by TIOCEXCL, which the
    kernel holds against all but root. Raises `DeviceError`: no such port, no permission, taken, no serial port at all.
    """
    serial = _pyserial()
    try:
        # pyserial's own lock comes first: TIOCEXCL stays with a terminal until its last close.
        opened = serial.Serial(port, baud, timeout=READ_SLICE, write_timeout=WRITE_LIMIT, exclusive=True)
    except (OSError, ValueError) as error:  # SerialException is an OSError
        if "baud" in str(error).lower():
            raise DeviceError(f"{port}: cannot run at {baud} baud") from None
        raise DeviceError(f"{port}: {_reason(port, error)}; {_what_there_is(port)}") from None
    _keep_others_out(opened)
    _lower_latency(opened)
    return opened


def close_port(opened: Serial) -> None:
    """Let the port go; nothing is raised, whatever state it is in."""
    import fcntl
    import termios
    from contextlib import suppress

    with suppress(OSError, ValueError, TypeError):
        fcntl.ioctl(opened.fileno(), termios.TIOCNXCL)
    with suppress(OSError):
        opened.close()


def serial_ports() -> tuple[str, ...]:
    """Names of the serial ports of this machine, with what is known of them."""
    _pyserial()
    from serial.tools.list_ports import comports

    found = sorted((each.device, each.description or "") for each in comports())
    return tuple(device if text in ("", "n/a") else f"{device} ({text})" for device, text in found)


def _pyserial():
    try:
        import serial
    except ImportError:
        raise DeviceError("serial devices need pyserial: pip install 'tendonrod[bench]'") from None
    return serial


def _keep_others_out(opened: Serial) -> None:
    import fcntl
    import termios

    fcntl.ioctl(opened.fileno(), termios.TIOCEXCL)


def _lower_latency(opened: Serial) -> None:
    """USB bridges of FTDI's make hold bytes back for 16 ms unless told otherwise; not all ports know of it."""
    try:
        opened.set_low_latency_mode(True)
    except (OSError, ValueError, AttributeError, NotImplementedError):
        return


def _reason(port: str, error: OSError | ValueError) -> str:
    number = getattr(error, "errno", None)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return "there is no such port"
    if number in (errno.EACCES, errno.EPERM):
        return f"no permission; it belongs to group {_group(port)}"
    if number in (errno.EBUSY, errno.EWOULDBLOCK) or "exclusively lock" in str(error):
        return "taken by another program"
    if os.path.exists(port):
        return "not a serial port"
    return "there is no such port"


def _group(port: str) -> str:
    import grp

    try:
        return grp.getgrgid(os.stat(port).st_gid).gr_name
    except (OSError, KeyError):
        return "unknown"


def _what_there_is(port: str) -> str:
    others = [each for each in serial_ports() if each.split(" ")[0] != port]
    return "other serial ports here: " + (", ".join(others) or "none")
