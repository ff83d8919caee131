"""Emergency stop by program, key and signal, and the way out of a session: slack, still, recorded, terminal as before."""

import json
import os
import pty
import signal
import subprocess
import sys
import termios
import threading
import time

import pytest

from rig.plain_bench import COMPLIANCE, period, running
from tendonrod.rig.emergency import EmergencyStop, KeyboardStop
from tendonrod.rig.ending import leave_slack, safely
from tendonrod.rig.guarded import AT_REST
from tendonrod.rig.interfaces import STILL, Command, DeviceError
from tendonrod.rig.states import FaultKind, Reaction, State

FORWARD = Command(translation=1e-3)
SLACK = 0.05


class Memory:
    """A recorder that keeps everything, or fails at everything."""

    def __init__(self, broken: bool = False) -> None:
        self.rows, self.closed, self.broken = [], 0, broken

    def write(self, sample, command, state, fault=None) -> None:
        if self.broken:
            raise OSError("disk full")
        self.rows.append((sample, command, state, fault))

    def close(self) -> None:
        self.closed += 1


def taut(tension=0.7):
    bench, guarded = running()
    bench.load_cell.offset = tension * COMPLIANCE
    guarded.interlock._watch.restart()
    period(guarded)
    return bench, guarded


def until(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "in vain"
        time.sleep(0.002)


def test_button_from_another_thread_stops_within_a_period():
    bench, guarded = taut()
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
    bench, guarded = taut()
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
        try:
            os.close(end)
        except OSError:
            pass


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


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError("a bug\nof a task"), SystemExit, None])
def test_every_way_out_is_slack_still_and_recorded(error):
    bench, guarded = taut()
    record = Memory()

    def session():
        with safely(guarded, record):
            for _ in range(50):
                period(guarded, FORWARD)
            if error is not None:
                raise error

    if error is None:
        session()
    else:
        with pytest.raises(error if isinstance(error, type) else type(error)):
            session()
    assert bench.load_cell.read().tension < SLACK
    assert all(abs(axis.velocity) <= AT_REST for axis in bench.axes)
    assert (record.closed, len(bench.closed)) == (1, 1)
    assert record.rows[-1][0].force.tension < SLACK
    assert guarded.interlock.state is (State.HELD if error is None else State.FAULT)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_release_without_cutting_the_loop(number):
    bench, guarded = taut()
    handler = signal.getsignal(number)
    with safely(guarded, Memory()):
        period(guarded, FORWARD)
        os.kill(os.getpid(), number)
        assert guarded.interlock.is_asked_to_stop
        sample, sent = period(guarded, FORWARD)
        assert sent == Command(screw=guarded.interlock.limits.release_rate, target=0.0)
        assert guarded.interlock.fault.kind is FaultKind.EMERGENCY
    assert bench.load_cell.read().tension < SLACK
    assert signal.getsignal(number) is handler


def test_second_interrupt_stops_at_once():
    bench, guarded = taut()
    with pytest.raises(KeyboardInterrupt), safely(guarded, Memory()):
        os.kill(os.getpid(), signal.SIGINT)
        period(guarded)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1.0)
    assert guarded.interlock.reaction is Reaction.STOP
    assert bench.load_cell.read().tension > SLACK
    assert len(bench.closed) == 1


def test_after_an_emergency_stop_leaving_moves_nothing():
    bench, guarded = taut()
    with safely(guarded):
        guarded.interlock.emergency()
        period(guarded)
        at = [axis.position for axis in bench.axes]
    assert [axis.position for axis in bench.axes] == at
    assert bench.load_cell.read().tension > SLACK


@pytest.mark.parametrize("device", ["screw", "translation", "rotation", "load_cell", "tracker"])
def test_a_device_that_fails_keeps_nothing_else_from_being_done(device):
    bench, guarded = taut()
    record = Memory()
    with safely(guarded, record):
        period(guarded, FORWARD)
        getattr(bench, device).error = DeviceError("gone")
        begun = guarded.clock.now()
        period(guarded)
    limits = guarded.interlock.limits
    assert guarded.clock.now() - begun <= limits.release_timeout + 1.1
    assert (record.closed, len(bench.closed)) == (1, 1)
    if device != "screw":
        assert bench.screw.position > (0.7 - 2.0 * SLACK) * COMPLIANCE
    assert all(axis.velocity == 0.0 or axis.error for axis in bench.axes)


def test_record_that_fails_does_not_keep_the_tendon_tense():
    bench, guarded = taut()
    record = Memory(broken=True)
    with safely(guarded, record):
        period(guarded, FORWARD)
    assert bench.load_cell.read().tension < SLACK
    assert record.closed == 1


def test_leaving_is_bounded_where_time_stands_still():
    bench, guarded = taut()
    bench.clock.wait_until = lambda time: None
    leave_slack(guarded)
    assert guarded.interlock.state in (State.HELD, State.FAULT)


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
