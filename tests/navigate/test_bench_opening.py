"""A bench whose opening nobody waits for any more: its homing stops, the tendon is let go, the devices are closed."""

import json
import os
import signal
import subprocess
import time
from dataclasses import replace

import pytest

from navigate.benches import start, virtual
from tendonrod import TendonrodError
from tendonrod.navigate import bench_process
from tendonrod.navigate.bench_aside import PROGRAM
from tendonrod.navigate.bench_drive import BenchDrive
from tendonrod.rig import firmware
from tendonrod.rig.benches import DeviceSource, VirtualSource
from tendonrod.rig.board_devices import Calibration
from tendonrod.rig.launchpad import LaunchPad
from tendonrod.rig.safety import Interlock
from tendonrod.rig.states import FaultKind

PATIENCE = 40.0  # s; the homings here take minutes
RATE = 50.0


def slow(scenario):
    """A virtual bench whose robot is all out, and takes five minutes to be drawn in."""
    source = virtual(scenario, real_time=True)
    setup = source.setup
    axis = replace(setup.translation, start=75e-3, speed=0.5e-3)
    screw = replace(setup.screw, start=80e-3)  # a slack tendon
    return replace(source, setup=replace(setup, translation=axis, screw=screw))


def ended(scenario, source, after):
    """(exit status, what it said last) of the process whose standard input ends ``after`` s."""
    with subprocess.Popen(PROGRAM, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        process.stdin.write(start(scenario, source, RATE))
        process.stdin.flush()
        time.sleep(after)
        try:
            said, noted = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
    assert noted == b""
    return process.returncode, json.loads(said.splitlines()[-1])


@pytest.mark.parametrize("after", [0.0, 4.0])
def test_a_homing_ends_with_the_session_that_began_it(scenario, after):
    status, said = ended(scenario, slow(scenario), after)
    assert status == 1
    assert said == {"error": "the bench is not ready: emergency stop (nobody steers any more); release tension"}


def test_the_boards_axes_stand_and_its_port_is_free(scenario, tmp_path):
    config = tmp_path / "slow.c"
    config.write_text(firmware.CONFIG_OF_REHEARSAL.read_text().replace("-8000", "-100"))
    with firmware.rehearsal(config, "--watchdog", "5000") as board:
        limits = {"sensor_age": 5.0, "command_timeout": 5.0}
        source = DeviceSource(
            robot=scenario.robot, gravity=scenario.gravity, launchpad={"port": board.port}, calibration=Calibration(),
            limits=limits,
        )  # fmt: skip
        status, said = ended(scenario, source, 4.0)
        with LaunchPad(board.port) as pad:
            axes = [axis.read() for axis in (pad.screw, pad.translation, pad.rotation)]
    assert (status, "nobody steers any more" in said["error"]) == (1, True)
    assert [axis.homed for axis in axes] == [False] * 3
    assert [axis.velocity for axis in axes] == [0.0] * 3


def test_nothing_is_left_of_a_start_that_was_cut_off():
    with subprocess.Popen(PROGRAM, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        said, noted = process.communicate(b"\x80\x04", timeout=PATIENCE)
    assert (process.returncode, noted) == (1, b"")
    assert list(json.loads(said)) == ["error"]


def test_a_termination_while_it_opens_is_a_release_and_later_an_exit(monkeypatch):
    read, write = os.pipe()
    before, lock = signal.getsignal(signal.SIGTERM), Interlock()
    with os.fdopen(read) as stdin, os.fdopen(write, "w"):
        monkeypatch.setattr(bench_process.sys, "stdin", stdin)
        try:
            with bench_process.opening(lock):
                os.kill(os.getpid(), signal.SIGTERM)
                assert lock.is_asked_to_stop
            with pytest.raises(SystemExit):
                os.kill(os.getpid(), signal.SIGTERM)
        finally:
            signal.signal(signal.SIGTERM, before)


def test_a_bench_that_does_not_get_ready_is_left_slack(scenario, monkeypatch):
    """Its homing pulled the tendon taut: then somebody asked for the end."""
    source = virtual(scenario)
    bench = source.open(0)
    monkeypatch.setattr(type(bench.screw), "home", lambda axis, should_stop=None: pulled(bench))
    monkeypatch.setattr(VirtualSource, "open", lambda source, seed: bench)

    def opening(interlock):
        locks.append(interlock)
        return bench_process.suppress()

    def pulled(bench):
        while bench.load_cell.read().tension < 0.2:
            bench.screw.move(-0.5e-3)
            bench.clock.wait_until(bench.clock.now() + 0.01)
        locks[0].interrupt("nobody steers any more")

    locks = []
    with pytest.raises(TendonrodError, match=r"not ready: emergency stop \(nobody steers any more\)"):
        BenchDrive(scenario, source, opening=opening)
    assert bench.load_cell.read().tension < 0.05
    assert bench.screw.read().velocity == pytest.approx(0.0, abs=1e-6)
    assert locks[0].fault.kind is FaultKind.EMERGENCY
