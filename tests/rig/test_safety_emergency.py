"""Emergency stop by program and by key; the terminal is as before in the end."""

import json
import os
import pty
import subprocess
import sys
import termios
import threading
import time
from contextlib import suppress

import pytest

from rig.plain_bench import period, taut
from tendonrod.rig.emergency import EmergencyStop, KeyboardStop
from tendonrod.rig.interfaces import STILL, Command
from tendonrod.rig.states import FaultKind, Reaction

FORWARD = Command(translation=1e-3)
SLACK = 0.05


def until(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "in vain"
        time.sleep(0.002)


def test_button_from_another_thread_stops_within_a_period():
    _, guarded = taut()
    stop = EmergencyStop(guarded.interlock)
    assert not stop.is_pressed
    thread = threading.Thread(target=stop.press)
    thread.start()
    thread.join()
    assert stop.is_pressed
    assert period(guarded, FORWARD)[1] == STILL
    assert guarded.interlock.fault.kind is FaultKind.EMERGENCY
    assert guarded.interlock.reaction is Reaction.STOP


def test_buttons_pressed_by_many_threads_meanwhile():
    _, guarded = taut()
    threads = [threading.Thread(target=EmergencyStop(guarded.interlock, f"button {k}").press) for k in range(20)]
    for thread in threads:
        thread.start()
        period(guarded, FORWARD)
    for thread in threads:
        thread.join()
    period(guarded)
    assert len(guarded.interlock.faults) == 20


def test_emergency_stop_ends_a_release():
    _, guarded = taut()
    guarded.interlock.interrupt()
    assert period(guarded)[1].screw > 0.0
    guarded.interlock.emergency()
    for _ in range(20):
        assert period(guarded)[1] == STILL


@pytest.fixture
def terminal():
    master, slave = pty.openpty()
    yield master, slave
    for end in (master, slave):
        with suppress(OSError):  # closed already
            os.close(end)


@pytest.mark.parametrize(
    ("keys", "source", "reaction"),
    [(b" ", "space", Reaction.STOP), (b"\x1b", "Esc", Reaction.STOP), (b"\x1b[A", "Esc", Reaction.STOP)],
)
def test_keys_stop_and_the_terminal_is_restored(terminal, keys, source, reaction):
    master, slave = terminal
    before = termios.tcgetattr(slave)
    _, guarded = taut()
    with KeyboardStop(guarded.interlock, terminal=slave) as keyboard:
        assert keyboard.is_active
        assert not termios.tcgetattr(slave)[3] & termios.ICANON
        os.write(master, keys)
        until(lambda: guarded.interlock.is_asked_to_stop)
    assert period(guarded, FORWARD)[1] == STILL
    assert (guarded.interlock.fault.where, guarded.interlock.reaction) == (source, reaction)
    assert termios.tcgetattr(slave) == before
    assert not keyboard.is_active


def test_interrupt_as_a_byte_releases(terminal):
    master, slave = terminal
    _, guarded = taut()
    attributes = termios.tcgetattr(slave)
    attributes[3] &= ~termios.ISIG  # else it would be a signal
    termios.tcsetattr(slave, termios.TCSANOW, attributes)
    with KeyboardStop(guarded.interlock, terminal=slave):
        os.write(master, b"\x03")
        until(lambda: guarded.interlock.is_asked_to_stop)
    assert period(guarded)[1].screw > 0.0
    assert guarded.interlock.fault.where == "Ctrl-C"


def test_other_keys_are_handed_on(terminal):
    master, slave = terminal
    _, guarded = taut()
    keys = []
    with KeyboardStop(guarded.interlock, terminal=slave, other=keys.append):
        os.write(master, "hr\xe9".encode())
        until(lambda: len(keys) == 3)
    assert keys == ["h", "r", "\xe9"]
    assert not guarded.interlock.is_asked_to_stop


def test_an_error_over_another_key_does_not_end_the_emergency_keys(terminal):
    master, slave = terminal
    _, guarded = taut()
    with KeyboardStop(guarded.interlock, terminal=slave, other=lambda key: int(key)) as keyboard:
        os.write(master, b"h")
        time.sleep(0.05)
        os.write(master, b" ")
        until(lambda: guarded.interlock.is_asked_to_stop)
        assert keyboard.is_active
    assert period(guarded)[1] == STILL


def test_terminal_that_goes_away_releases(terminal):
    master, slave = terminal
    _, guarded = taut()
    with KeyboardStop(guarded.interlock, terminal=slave):
        os.close(master)
        until(lambda: guarded.interlock.is_asked_to_stop)
    assert period(guarded)[1].screw > 0.0
    assert guarded.interlock.fault.where == "terminal gone"


def test_terminal_is_restored_after_an_error(terminal):
    _, slave = terminal
    before = termios.tcgetattr(slave)
    _, guarded = taut()
    with pytest.raises(ZeroDivisionError), KeyboardStop(guarded.interlock, terminal=slave):
        raise ZeroDivisionError
    assert termios.tcgetattr(slave) == before


def test_no_terminal_no_keys():
    _, guarded = taut()
    read, write = os.pipe()
    with KeyboardStop(guarded.interlock, terminal=read) as keyboard:
        assert not keyboard.is_active
    os.close(read)
    os.close(write)


SESSION = """
import json, sys, time
sys.path.insert(0, {tests!r})
from rig.plain_bench import COMPLIANCE, PERIOD, period, running
from tendonrod.rig.ending import safely
from tendonrod.rig.emergency import KeyboardStop
from tendonrod.rig.interfaces import Command
bench, guarded = running()
bench.load_cell.offset = 0.7 * COMPLIANCE
guarded.interlock._watch.restart()
rows = []
class Record:
    def write(self, *row): rows.append(row)
    def close(self): rows.append("closed")
with safely(guarded, Record()), KeyboardStop(guarded.interlock):
    period(guarded)
    print("ready", flush=True)
    while not guarded.interlock.is_asked_to_stop:
        time.sleep(PERIOD)
        period(guarded, Command(rotation=0.01))
print(json.dumps({{"tension": bench.load_cell.read().tension, "velocity": [axis.velocity for axis in bench.axes],
                  "fault": str(guarded.interlock.fault), "closed": rows[-1] == "closed" and len(bench.closed) == 1}}))
"""


@pytest.mark.parametrize(("key", "fault"), [(b"\x03", "Ctrl-C"), (b" ", "space")])
def test_session_on_a_terminal(terminal, key, fault):
    """A process of its own on its own terminal: the keys of a person, and what is left after them."""
    master, slave = terminal
    before = termios.tcgetattr(slave)
    program = SESSION.format(tests=os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    attach = "import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0)\n"  # so that Ctrl-C makes a signal
    process = subprocess.Popen(
        [sys.executable, "-c", attach + program], stdin=slave, stdout=subprocess.PIPE, start_new_session=True
    )
    try:
        assert process.stdout.readline() == b"ready\n"
        os.write(master, key)
        said, _ = process.communicate(timeout=10.0)
    finally:
        process.kill()
        process.wait()
    told = json.loads(said)
    assert process.returncode == 0
    assert fault in told["fault"]
    assert told["closed"]
    assert told["velocity"] == [0.0] * 3
    assert (told["tension"] < SLACK) is (fault == "Ctrl-C")  # an emergency stop lets nothing move
    assert termios.tcgetattr(slave) == before
