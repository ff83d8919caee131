"""A bench of real drivers against emulators of their devices, each in a process of its own, through `trials.run`."""

import os

import numpy as np
import pytest

from rig.aurora_emulator import emulated
from rig.short_trials import DOWN, robot
from tendonrod.measurement.trial import Tracker
from tendonrod.rig import firmware
from tendonrod.rig.benches import DeviceSource
from tendonrod.rig.board_devices import Calibration
from tendonrod.rig.interfaces import DeviceError
from tendonrod.rig.states import State
from tendonrod.rig.tasks import Phase, TensionHold
from tendonrod.rig.trials import run

pytest.importorskip("serial")
PATIENT = ("--homed", "--watchdog", "3000")  # so that a busy machine, which holds up these tests, is no fault
LIMITS = {"late_in_row": 1000, "sensor_age": 1.0, "command_timeout": 1.0, "tracker_time": 3.0}
EMULATED = LIMITS | {"screw": {"low": -65e-3, "high": 0.0}}  # the emulated board's signs and travel


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return firmware.build(tmp_path_factory.mktemp("board"))


def devices(port, **changes):
    given = {"robot": robot(), "gravity": DOWN, "launchpad": {"port": port}, "calibration": Calibration()}
    return DeviceSource(**given | {"limits": EMULATED} | changes)


def holding(tension, duration):
    return lambda machine: TensionHold(tension, duration, machine)


@pytest.mark.parametrize("rate", [100.0, 200.0])
def test_the_loop_holds_a_tension_on_the_board(program, tmp_path, rate):
    with firmware.running(program, *PATIENT) as board:
        source = devices(board.port, tare_readings=20)
        done = run(source, holding(0.3, 0.5), tmp_path / "a.rec", rate=rate, home=False)
    assert done.outcome.is_done
    assert done.record.is_complete
    error = done.tension_error(Phase.HOLD)
    assert error.size > 20
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert done.record.samples["force"]["tension"][-1] < 0.05
    assert done.record.states[-1] == State.HELD
    header = done.record.header
    assert header["virtual"] is False
    assert "tendonrod-bench" in header["bench"]
    assert np.median(np.diff(done.record.time)) == pytest.approx(1 / rate, rel=0.5)


def test_board_and_tracker_share_one_clock_and_one_record(program, tmp_path):
    pytest.importorskip("ndicapy")
    with firmware.running(program, *PATIENT) as board, emulated(transport="tcp") as tracker:
        aurora = {"port": tracker["port"], "tools": {"tip": None}}
        source = devices(board.port, aurora=aurora, trackers=(Tracker(name="tip", mass=2e-4),))
        done = run(source, holding(0.3, 0.5), tmp_path / "a.rec", home=False)
    assert done.outcome.is_done
    frames = done.record.frames
    assert len(frames) > 20
    assert set(done.record.tools) == {"tip"}
    arrived = done.record.time[done.record.frame_sample]
    late = arrived - frames["time"]
    assert 0.0 < np.median(late) < 0.2
    trial = done.trial()
    assert trial.trackers[0].mass == 2e-4
    assert np.isfinite(trial.tensions[5:-5]).all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--firmware", "other"), "firmware is 'other"),
        (("--protocol", "2"), "protocol 1"),
        (("--mute",), "no motor board"),
    ],
)
def test_a_board_that_is_none_is_told_before_anything_is_written(program, tmp_path, options, said):
    with firmware.running(program, *options) as board, pytest.raises(DeviceError, match=said) as error:
        run(devices(board.port), holding(0.3, 0.5), tmp_path / "a.rec")
    assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


def test_a_port_that_is_taken_is_told(program, tmp_path):
    from tendonrod.rig.launchpad import LaunchPad

    taken = pytest.raises(DeviceError, match="taken by another program")
    with firmware.running(program, *PATIENT) as board, LaunchPad(board.port), taken:
        run(devices(board.port), holding(0.3, 0.5), tmp_path / "a.rec")


def test_the_board_is_let_go_where_the_tracker_fails(program, tmp_path):
    pytest.importorskip("ndicapy")
    with firmware.running(program, *PATIENT) as board:
        nobody = {"port": str(tmp_path / "no-tracker"), "tools": {"tip": None}}
        with pytest.raises(DeviceError, match="no-tracker"):
            devices(board.port, aurora=nobody, trackers=(Tracker(name="tip"),)).open(0)
        devices(board.port).open(0).close()  # free again


def test_a_zero_is_not_taken_from_a_taut_tendon(program):
    with firmware.running(program, *PATIENT) as board:
        off = Calibration(zero=32768.0 - 0.5 * 1349.0)  # reads half a newton too much
        with pytest.raises(DeviceError, match="before taring, must be within"):
            devices(board.port, calibration=off, tare_readings=20).open(0)
        near = Calibration(zero=32768.0 - 0.1 * 1349.0)
        bench = devices(board.port, calibration=near, tare_readings=100).open(0)
        try:
            assert abs(bench.load_cell.read().tension) < 0.02
        finally:
            bench.close()


def test_a_board_that_goes_away_is_a_fault_and_the_record_complete(program, tmp_path):
    with firmware.running(program, *PATIENT) as board:
        at = []

        def watch(moment):
            at.append(moment.sample.time)
            if len(at) == 50:
                board.process.kill()

        done = run(devices(board.port), holding(0.3, 60.0), tmp_path / "a.rec", home=False, watch=watch)
    assert done.outcome.fault is not None
    assert done.outcome.fault.kind.value == "device does not answer"
    assert done.record.is_complete
    assert os.path.getsize(done.path) > 0
