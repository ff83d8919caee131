"""The motor board's driver against the emulated board, in a process of its own behind a pseudo-terminal."""

import os
import signal
import statistics
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep

import pytest

from tendonrod.rig import firmware
from tendonrod.rig.board_devices import Calibration
from tendonrod.rig.board_protocol import BoardState, Flag
from tendonrod.rig.interfaces import Axis, DeviceError, LoadCell
from tendonrod.rig.launchpad import LaunchPad

pytest.importorskip("serial")


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    return firmware.build(tmp_path_factory.mktemp("board"))


PATIENCE = ("--watchdog", "3000")  # so that a busy machine, which holds up these tests, is no fault
PATIENT = ("--homed", *PATIENCE)


@pytest.fixture
def emulator(program) -> Iterator[firmware.Emulator]:
    with firmware.running(program, *PATIENT) as running:
        yield running


@pytest.fixture
def board(emulator) -> Iterator[LaunchPad]:
    with LaunchPad(emulator.port) as found:
        yield found


def drive(board: LaunchPad, duration: float, *velocities: float) -> None:
    """What the bench's loop does: read everything, then move all axes, 200 times a second."""
    end = monotonic() + duration
    while monotonic() < end:
        for device in (board.screw, board.translation, board.rotation, board.load_cell):
            device.read()
        for axis, velocity in zip((board.screw, board.translation, board.rotation), velocities, strict=True):
            axis.move(velocity)
        sleep(0.005)


def test_devices_are_those_of_the_interfaces(board):
    assert all(isinstance(axis, Axis) for axis in (board.screw, board.translation, board.rotation))
    assert isinstance(board.load_cell, LoadCell)
    assert board.firmware == "tendonrod-bench 1.0.0"
    assert (board.translation.limits.speed, board.translation.limits.high) == (0.01, 0.065)
    assert board.rotation.limits.speed == 3.0


def test_axes_go_at_their_velocities_and_stop(board):
    start = [axis.read() for axis in (board.screw, board.translation, board.rotation)]
    drive(board, 0.5, -0.0005, 0.002, 0.3)
    states = [axis.read() for axis in (board.screw, board.translation, board.rotation)]
    assert [each.velocity for each in states] == pytest.approx([-0.0005, 0.002, 0.3], rel=0.05)
    means = [(b.position - a.position) / (b.time - a.time) for a, b in zip(start, states, strict=True)]
    assert means == pytest.approx([-0.0005, 0.002, 0.3], rel=0.2)  # the ramp, and this process's own delays
    board.translation.stop()
    sleep(0.1)
    assert board.read("test").state.velocities == pytest.approx([0, 0, 0], abs=3000)  # one step of the encoders


def test_a_control_loop_holds_a_tension(board):
    """The bench's own loop: the screw pays out, translation follows the tension. 0.3 N/mm, kP = kI = 50 in mm."""
    integral, readings, end = 0.0, [], monotonic() + 2.0
    while monotonic() < end:
        tension = board.load_cell.read().tension
        integral += (0.3 - tension) * 0.005
        board.transact(0.0005, 0.050 * (0.3 - tension) + 0.050 * integral, 0.0)
        readings.append(tension)
        sleep(0.005)
    assert statistics.mean(readings[-50:]) == pytest.approx(0.3, abs=0.01)
    assert board.translation.read().velocity == pytest.approx(0.0005, abs=0.0002)
    assert max(readings) < 0.45


def test_one_exchange_sets_three_axes_and_brings_the_state(board):
    """But for commands that a held-up board leaves unanswered in time: each of these is followed by another."""
    before, unanswered = board.counts.commands, board.counts.unanswered
    for _ in range(500):
        board.transact(0.0, 0.001, 0.0)
    assert board.counts.commands - before - (board.counts.unanswered - unanswered) == 500


@pytest.mark.parametrize(("max_age", "exchanges"), [(0.002, 2), (float("inf"), 1)])
def test_a_period_of_the_loop_takes_two_exchanges_or_one(emulator, max_age, exchanges):
    with LaunchPad(emulator.port, max_age=max_age) as board:
        drive(board, 0.02, 0.0, 0.001, 0.0)
        before, periods = board.counts.commands, 20
        for _ in range(periods):
            devices = (board.screw, board.translation, board.rotation, board.load_cell)
            times = {device.read().time for device in devices}
            assert len(times) == 1 or max_age < 1  # one snapshot for all, unless this process was held up
            for axis in (board.screw, board.translation, board.rotation):
                axis.move(0.001)
            sleep(0.004)
        used = board.counts.commands - before
        assert used == periods if exchanges == 1 else exchanges * periods <= used <= 2 * exchanges * periods


def test_time_is_that_of_the_bench_and_never_goes_back(board):
    last = monotonic()
    for _ in range(200):
        asked = monotonic()
        at = board.transact(0.0, 0.0, 0.0).time
        assert asked <= at <= monotonic()
        assert at >= last
        last = at


def test_a_single_axis_moves_and_a_command_to_stand_still_goes_out_at_once(board):
    for _ in range(20):
        board.translation.move(0.002)
        sleep(0.005)
        assert board.translation.read().position > 0.0
    assert board.translation.read().velocity == pytest.approx(0.002, rel=0.1)
    before = board.counts.commands
    board.translation.move(0.0)
    assert board.counts.commands == before + 1


def test_an_axis_stops_at_the_end_of_its_travel(board):
    drive(board, 0.1, 0.0, 0.0, 0.0)
    end = monotonic() + 8.0
    while not board.translation.read().at_limit and monotonic() < end:
        board.transact(0.0, 0.01, 0.0)
        sleep(0.005)
    drive(board, 0.2, 0.0, 0.01, 0.0)
    state = board.translation.read()
    assert (state.at_limit, state.velocity) == (1, pytest.approx(0.0, abs=1e-4))
    assert state.position == pytest.approx(0.065, abs=2e-5)
    assert board.load_cell.read().tension == pytest.approx(0.3 * 35, abs=0.1)


def last_command(board: LaunchPad) -> BoardState:
    """Bring all axes to speed; what the last command answered. Once more where this process was held up."""
    for _ in range(10):
        with suppress(DeviceError):
            end, last = monotonic() + 0.3, board.transact(-0.001, 0.005, 1.0)
            while monotonic() < end:
                last = board.transact(-0.001, 0.005, 1.0)
            return last.state
    pytest.fail("this machine is too busy")


def test_when_commands_stay_away_the_axes_stop_within_150_ms(program):
    """By the board's own clock and encoders, so that it does not matter how busy this machine is."""
    with firmware.running(program, "--homed") as emulator, LaunchPad(emulator.port) as board:
        told, trace, end = last_command(board), [], monotonic() + 0.4
        while monotonic() < end:
            trace.append(board.read("test").state)
            sleep(0.002)
        rest = trace[-1].positions
        assert told.velocities == pytest.approx([-1e6, 5e6, 1e6], rel=0.1)
        moving = [each for each in trace if max(abs(a - b) for a, b in zip(each.positions, rest, strict=True)) > 1000]
        assert max((each.micros for each in moving), default=told.micros) - told.micros < 150_000
        assert trace[-1].has(Flag.WATCHDOG)
        with pytest.raises(DeviceError, match="no command came in time"):
            board.transact(0.0, 0.001, 0.0)
        assert not board.read("test").state.has(Flag.WATCHDOG)  # told once, and acknowledged by that


CONTROL_PROCESS = """
import sys, time
from tendonrod.rig.launchpad import LaunchPad
board = LaunchPad(sys.argv[1])
for k in range(10**6):
    try:
        board.transact(0.0, 0.002, 0.0)
    except Exception:
        continue
    if k == 40:
        print("moving", flush=True)
    time.sleep(0.002)
"""


def test_when_the_control_process_is_killed_the_axes_stop_within_150_ms(program):
    with firmware.running(program, "--homed") as emulator:
        command = [sys.executable, "-c", CONTROL_PROCESS, emulator.port]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
            assert process.stdout.readline() == b"moving\n"
            process.kill()
        sleep(0.15)
        with LaunchPad(emulator.port) as board:  # greeting stops them too, but they stand already
            first = board.read("test").state
            assert max(map(abs, first.velocities)) <= 3000
            assert first.positions[1] > 30.1e6
            sleep(0.1)
            assert board.read("test").state.positions == pytest.approx(first.positions, abs=100)  # nm


def test_an_axis_that_jams_is_told_by_its_state_and_by_homing(program):
    with firmware.running(program, *PATIENT, "--jam", "2") as emulator, LaunchPad(emulator.port) as board:
        drive(board, 0.4, 0.0, 0.002, 0.0)
        assert board.translation.read().stalled
        assert not board.screw.read().stalled
        with pytest.raises(DeviceError, match="translation is not homed: it does not move"):
            board.translation.home()


def test_tare_makes_the_mean_reading_zero(board):
    board.load_cell.tare(50)
    assert statistics.mean(board.load_cell.read().tension for _ in range(50)) == pytest.approx(0.0, abs=1e-3)


def test_a_load_beyond_full_scale_is_told(program):
    with firmware.running(program, *PATIENT) as emulator:
        small = Calibration(full_scale=0.1)
        with LaunchPad(emulator.port, calibration=small) as board:
            assert not board.load_cell.read().saturated
            drive(board, 0.5, 0.0, 0.005, 0.0)
            assert board.load_cell.read().saturated


def test_over_a_noisy_line_the_loop_goes_on(program):
    """One byte in 3000 is disturbed, either way: some 5 % of the exchanges. None is made up, none is done twice."""
    with firmware.running(program, *PATIENT, "--noise", "3000", "11") as emulator:
        with LaunchPad(emulator.port, timeout=0.02) as board:
            for _ in range(1500):
                state = board.transact(0.0, 0.001, 0.0).state
                assert 30e6 <= state.positions[1] <= 36e6
                assert abs(state.velocities[1]) <= 1.1e6
            counts = board.counts
        assert counts.damaged + counts.lost > 20
        assert counts.unanswered > 20


def test_a_board_that_restarts_is_not_taken_for_the_same(board, emulator):
    drive(board, 0.05, 0.0, 0.001, 0.0)
    emulator.process.send_signal(signal.SIGUSR1)
    sleep(0.05)
    with pytest.raises(DeviceError, match="the board was restarted; open it again and home the axes"):
        board.translation.read()


def test_a_board_that_hangs_is_told_in_time_and_found_again(board, emulator):
    os.kill(emulator.process.pid, signal.SIGSTOP)
    began = monotonic()
    with pytest.raises(DeviceError, match="no answer from the board to READ, asked 5 times"):
        board.translation.read()
    assert monotonic() - began < 2.0
    os.kill(emulator.process.pid, signal.SIGCONT)
    sleep(0.05)
    assert board.translation.read().homed


def test_a_board_that_is_unplugged_is_told(board, emulator):
    emulator.process.kill()
    emulator.process.wait()
    with pytest.raises(DeviceError, match="the board is gone"):
        board.translation.read()
