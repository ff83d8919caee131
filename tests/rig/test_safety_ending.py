"""The way out of a session, whatever ends it: slack, still, recorded, devices let go."""

import os
import signal
import time

import pytest

from rig.plain_bench import COMPLIANCE, period, taut
from tendonrod.rig import ending
from tendonrod.rig.ending import leave_slack, safely
from tendonrod.rig.guarded import AT_REST
from tendonrod.rig.interfaces import Command, DeviceError
from tendonrod.rig.loop import drive
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
        _, sent = period(guarded, FORWARD)
        assert sent == Command(screw=guarded.interlock.limits.release_rate, target=0.0)
        assert guarded.interlock.fault.kind is FaultKind.EMERGENCY
    assert bench.load_cell.read().tension < SLACK
    assert signal.getsignal(number) is handler


def test_second_interrupt_stops_at_once():
    bench, guarded = taut()

    def session():
        with safely(guarded, Memory()):
            os.kill(os.getpid(), signal.SIGINT)
            period(guarded)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.0)

    with pytest.raises(KeyboardInterrupt):
        session()
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


def test_a_second_interrupt_while_the_devices_are_let_go_cuts_nothing_off(monkeypatch):
    bench, guarded = taut()
    record, stopped, close = Memory(), [], ending._close

    def stop(name: str) -> None:
        stopped.append(name)
        if len(stopped) == 1:
            os.kill(os.getpid(), signal.SIGINT)

    def closing(*given) -> None:
        for axis in bench.axes:
            axis.stop = lambda name=axis.name: stop(name)
        close(*given)

    monkeypatch.setattr(ending, "_close", closing)
    with safely(guarded, record):
        os.kill(os.getpid(), signal.SIGINT)
        period(guarded)
    assert set(stopped) == {"screw", "translation", "rotation"}
    assert (record.closed, len(bench.closed)) == (1, 1)


class Endless:
    """A task that never ends by itself."""

    name, is_done, progress = "endless", False, 0.0

    def update(self, sample, dt):
        return FORWARD


@pytest.mark.parametrize("word", ["release", "shutdown"])
def test_a_loop_ends_once_a_person_has_let_the_tendon_go(word):
    bench, guarded = taut(0.2)
    guarded.interlock.finish()
    seen = []

    def watch(moment):
        seen.append(moment)
        assert len(seen) < 5000, "loops for ever"
        if len(seen) == 5:
            getattr(guarded.interlock, word)()

    outcome = drive(guarded, Endless(), watch=watch)
    assert not outcome.is_done
    assert outcome.fault is None
    assert bench.load_cell.read().tension < SLACK


class Undecided(Endless):
    """A task that can't say whether it is done."""

    @property
    def is_done(self):
        raise ValueError("a bug")


def test_a_task_that_cannot_say_whether_it_is_done_is_a_fault_of_the_controller():
    _, guarded = taut(0.2)
    guarded.interlock.finish()
    outcome = drive(guarded, Undecided())
    assert outcome.fault.kind is FaultKind.CONTROLLER
