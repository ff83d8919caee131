"""What can go wrong when an Aurora is opened: each in one line."""

import socket

import pytest

from rig.aurora_emulator import emulated
from tendonrod.errors import InvalidInput
from tendonrod.rig.aurora import Aurora
from tendonrod.rig.interfaces import DeviceError

pytest.importorskip("ndicapy")
pytest.importorskip("serial")
each_transport = pytest.mark.parametrize("transport", ["pty", "tcp"])
SOON = {"limit": 0.3, "setup_limit": 0.2}


def opening_fails(port: str, says: str, **options) -> None:
    with pytest.raises(DeviceError, match=says) as told:
        Aurora(port, **{**SOON, **options})
    assert "\n" not in str(told.value)
    assert str(told.value).startswith(port)


@each_transport
def test_something_else_answers(transport):
    with emulated(transport=transport, echo=True) as told:
        opening_fails(told["port"], "no NDI tracker")


@each_transport
def test_nothing_answers(transport):
    with emulated(transport=transport, mute="INIT") as told:
        opening_fails(told["port"], "no tracker answers")


@each_transport
def test_another_tracker_of_ndi(transport):
    with emulated(transport=transport, version="Polaris Vega Control Firmware\nNDI S/N: P9") as told:
        opening_fails(told["port"], "'Polaris Vega Control Firmware NDI S/N: P9': must be an NDI Aurora")


@pytest.mark.parametrize(
    ("command", "code", "says"),
    [
        ("PINIT", "13", "PINIT refused: Unable to initialize Tool-in-Port .*ERROR13"),
        ("PENA", "28", "PENA refused: Too many tools"),
        ("TSTART", "12", "TSTART refused: Unable to start tracking"),
    ],
)
def test_a_refused_command_is_told_with_the_reason(command, code, says):
    with emulated(transport="tcp", refuse={command: code}) as told:
        opening_fails(told["port"], says)


def test_tools_that_are_not_there():
    with emulated(transport="tcp", tools=[]) as told:
        opening_fails(told["port"], "no tool is plugged in")
    with emulated(transport="tcp", tools=[[10, 1, 0], [11, 2, 0]]) as told:
        opening_fails(told["port"], "2 tools are plugged in", tools={"tip": None})


def test_a_port_that_is_taken():
    with emulated() as told, Aurora(told["port"]):
        opening_fails(told["port"], "taken")


def test_ports_that_are_none():
    opening_fails("/dev/no-such-port", "no such port")
    with socket.create_server(("127.0.0.1", 0)) as closed:
        number = closed.getsockname()[1]
    opening_fails(f"tcp://127.0.0.1:{number}", "refused")
    for port in ("tcp://host", "http://host:1", "", 3):
        with pytest.raises(InvalidInput, match=r"^port"):
            Aurora(port)


@pytest.mark.parametrize("options", [{"rate": 0.0}, {"baud": 1200}, {"limit": -1.0}, {"delay": float("nan")}])
def test_wrong_options_are_told_by_name(options):
    with pytest.raises(InvalidInput, match=f"^{next(iter(options))}"):
        Aurora("/dev/no-such-port", **options)
