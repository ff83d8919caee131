"""What can go wrong while an Aurora tracks: each in one line, in a stated time, and the bench goes on."""

import os
import signal
import time

import pytest

from rig.aurora_emulator import emulated
from tendonrod.rig.aurora import Aurora
from tendonrod.rig.interfaces import DeviceError

pytest.importorskip("ndicapy")
pytest.importorskip("serial")
each_transport = pytest.mark.parametrize("transport", ["pty", "tcp"])
SOON = {"limit": 0.4}


def read_for(duration: float, aurora: Aurora, found: list) -> None:
    """Read as a loop of 200 Hz does, into ``found``."""
    end = time.monotonic() + duration
    while time.monotonic() < end:
        found += aurora.read()
        time.sleep(0.005)


def fails_while_tracking(says: str, within: float, **script) -> None:
    """The first error of an open tracker, which stays; frames that came before it are handed out first."""
    with emulated(**script) as told, Aurora(told["port"], tools={"tip": None}, **SOON) as aurora:
        found = []
        with pytest.raises(DeviceError, match=says) as error:
            read_for(within, aurora, found)
        assert found
        assert "\n" not in str(error.value)
        with pytest.raises(DeviceError, match=says):
            aurora.read()


@each_transport
def test_a_tracker_that_falls_silent(transport):
    """Over TCP ndicapi would wait for ever."""
    fails_while_tracking("no answer from the tracker for 0.4 s", 20.0, transport=transport, mute_at=20)


@each_transport
def test_a_tracker_that_is_unplugged(transport):
    fails_while_tracking("gone", 20.0, transport=transport, die_at=20)


@each_transport
def test_noise_without_end(transport):
    """ndicapi's buffer of 2 KB is overrun: its process fails, not the bench's."""
    fails_while_tracking("ndicapi failed|damaged answers only|no answer", 20.0, transport=transport, flood_at=20)


def test_a_tool_that_is_unplugged():
    fails_while_tracking("tool tip is unplugged", 20.0, unplug_at=20)


@pytest.mark.parametrize(
    ("number", "says"),
    [(signal.SIGKILL, "ended by another program .SIGKILL"), (signal.SIGSEGV, "ndicapi failed .SIGSEGV")],
)
def test_a_process_that_dies_says_of_what(number, says):
    with emulated(transport="tcp") as told, Aurora(told["port"], **SOON) as aurora:
        os.kill(aurora._process.pid, number)
        with pytest.raises(DeviceError, match=says):
            read_for(20.0, aurora, [])


def test_a_closed_tracker_says_so():
    with emulated(transport="tcp") as told:
        aurora = Aurora(told["port"])
        aurora.close()
        aurora.close()
        with pytest.raises(DeviceError, match="closed"):
            read_for(1.0, aurora, [])
