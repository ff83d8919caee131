"""Ports and boards that are not what they should be: one line that says so, in bounded time, and what there is."""

import errno
import os
import pty
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Thread
from time import monotonic

import pytest

from tendonrod.errors import InvalidInput
from tendonrod.rig import firmware
from tendonrod.rig.board_devices import Calibration
from tendonrod.rig.interfaces import DeviceError
from tendonrod.rig.launchpad import LaunchPad
from tendonrod.rig.serial_port import open_port

serial = pytest.importorskip("serial")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return firmware.build(tmp_path_factory.mktemp("board"))


def refused(port: str, **options) -> str:
    """The one line of the error with which a port is refused."""
    began = monotonic()
    with pytest.raises(DeviceError) as told:
        LaunchPad(port, **options)
    assert monotonic() - began < 3.0
    text = str(told.value)
    assert text.startswith(f"{port}: ")
    assert "\n" not in text
    return text


@contextmanager
def terminal(answer) -> Iterator[str]:
    """A port with something at its other end: ``answer`` is given what was written, and gives bytes or None to end."""
    master, slave = pty.openpty()

    def serve() -> None:
        with suppress(OSError):
            while (reply := answer(os.read(master, 1000))) is not None:
                os.write(master, reply)

    thread = Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        os.close(slave)
        os.close(master)
        thread.join(1.0)


def test_a_port_that_is_not_there_is_told_with_those_that_are(monkeypatch):
    from serial.tools import list_ports
    from serial.tools.list_ports_common import ListPortInfo

    monkeypatch.setattr(list_ports, "comports", lambda: [ListPortInfo("/dev/ttyUSB7")])
    told = refused("/dev/no-such-port")
    assert told == "/dev/no-such-port: there is no such port; other serial ports here: /dev/ttyUSB7"


def test_where_there_are_no_ports_it_says_none(monkeypatch):
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    assert refused("/dev/no-such-port").endswith("other serial ports here: none")


@pytest.mark.parametrize("port", ["/dev/null", "/"])
def test_what_is_no_serial_port_is_refused(port):
    assert "not a serial port" in refused(port)


def test_missing_permission_is_told_with_the_group_that_has_it(monkeypatch):
    def denied(port, *_, **__):
        raise serial.SerialException(errno.EACCES, f"could not open port {port}: Permission denied")

    monkeypatch.setattr(serial, "Serial", denied)
    assert "/dev/null: no permission; it belongs to group root" in refused("/dev/null")


def test_without_pyserial_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(DeviceError, match="need pyserial: pip install"):
        LaunchPad("/dev/null")


def test_a_port_that_is_taken_is_told_and_its_owner_not_disturbed(program):
    with firmware.running(program, "--homed") as emulator, LaunchPad(emulator.port) as board:
        assert "taken by another program" in refused(emulator.port)
        assert board.translation.read().homed
        script = "import sys; from tendonrod.rig.launchpad import LaunchPad; LaunchPad(sys.argv[1])"
        done = subprocess.run([sys.executable, "-c", script, emulator.port], capture_output=True, text=True, timeout=30)
        assert "taken by another program" in done.stderr
        assert board.translation.read().homed


def test_a_port_is_free_again_after_closing(program):
    with firmware.running(program, "--homed") as emulator:
        for _ in range(3):
            board = LaunchPad(emulator.port)
            board.close()
            board.close()
            with pytest.raises(DeviceError, match="the board is gone"):
                board.translation.read()


def test_a_port_is_free_again_after_a_refusal(program):
    with firmware.running(program, "--firmware", "other") as emulator:
        for _ in range(2):
            assert "firmware is 'other 1.0.0 1'" in refused(emulator.port)
        open_port(emulator.port, 921_600).close()


def test_another_protocol_is_refused(program):
    with firmware.running(program, "--protocol", "2") as emulator:
        told = refused(emulator.port)
    assert "firmware is 'tendonrod-bench 1.0.0 2': must be tendonrod-bench with protocol 1" in told


def test_a_board_that_says_nothing_is_refused(program):
    with firmware.running(program, "--mute") as emulator:
        assert refused(emulator.port).endswith("no motor board answers there (firmware tendonrod-bench)")


@pytest.mark.parametrize(
    "answer",
    [
        lambda written: written,  # an echo
        lambda _: b"login: \r\n",
        lambda _: os.urandom(100) + b"\n",
        lambda _: b"<1 OK tendonrod-bench 1.0.0 1*0000\n",
        lambda _: b"\n" * 500,
    ],
    ids=["echo", "console", "noise", "bad checksum", "newlines"],
)
def test_something_else_that_answers_is_refused(answer):
    with terminal(answer) as port:
        assert refused(port).endswith("what answers there is no motor board (firmware tendonrod-bench)")


@pytest.mark.parametrize("chunk", [b"x" * 256, b"noise\n" * 40], ids=["without newlines", "in lines"])
def test_a_flood_without_end_is_refused_in_time(chunk):
    script = (
        "import os, pty, sys, tty\nmaster, slave = pty.openpty()\ntty.setraw(slave)\n"
        "print(os.ttyname(slave), flush=True)\nwhile True: os.write(master, bytes.fromhex(sys.argv[1]))\n"
    )
    with subprocess.Popen([sys.executable, "-c", script, chunk.hex()], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert "motor board" in refused(process.stdout.readline().strip(), timeout=0.02)
        finally:
            process.kill()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("timeout", float("nan")),  # would wait for an answer without end
        ("timeout", -1.0), ("timeout", 0.0), ("timeout", 3600.0), ("tries", 0), ("tries", 1.5), ("baud", 0),
        ("baud", "fast"), ("max_age", float("nan")), ("max_age", -1.0), ("port", None), ("port", ""),
    ],
)  # fmt: skip
def test_wrong_options_are_told_by_name_before_a_port_is_opened(field, value):
    with pytest.raises(InvalidInput, match=f"^{field} = ") as told:
        LaunchPad(**({"port": "/dev/no-such-port"} | {field: value}))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("facts", [{"counts_per_newton": 0.0}, {"zero": float("nan")}, {"full_scale": -1.0}])
def test_a_calibration_that_is_none_is_refused_by_name(facts):
    with pytest.raises(InvalidInput, match=next(iter(facts))):
        Calibration(**facts)


def test_a_velocity_that_is_no_number_moves_nothing(program):
    with firmware.running(program, "--homed") as emulator, LaunchPad(emulator.port) as board:
        with pytest.raises(InvalidInput, match="velocity of rotation = nan"):
            board.transact(0.001, 0.001, float("nan"))
        assert board.read("test").state.positions == (-30_000_000, 30_000_000, 0)
