"""A bench file of devices, tried without hardware: `tendonrod rig` on the emulated board, on a pseudo-terminal."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rig.short_trials import robot
from tendonrod.rig import firmware
from tendonrod.rig.benches import rehearsed
from tendonrod.rig.benchfile import read_bench
from tendonrod.rig.interfaces import DeviceError
from tendonrod.rig.launchpad import LaunchPad
from tendonrod.rig.record import read_record
from tendonrod.rig.states import State

pytest.importorskip("serial")
EXAMPLE = Path(__file__).parents[1] / "examples" / "device-bench.toml"
# A busy machine, which holds these tests up, is no fault of theirs.
PATIENT = "late_in_row = 10000\nsensor_age_ms = 5000\ncommand_timeout_ms = 5000\n"
SLACK, TENDON, BODY = 0.2e-3, 0.51e-3, 2.8e-3  # m, m/N: the emulated tendon, as hal_emulator.h has it


@pytest.fixture(scope="module")
def port():
    with firmware.rehearsal(firmware.CONFIG_OF_REHEARSAL, "--watchdog", "5000") as board:
        yield board.port


@pytest.fixture
def bench(tmp_path):
    path = tmp_path / "my-bench.toml"
    path.write_text(EXAMPLE.read_text(encoding="utf-8") + PATIENT, encoding="utf-8")
    return path


def test_a_tension_is_held_on_the_example_bench(run, bench, port, tmp_path):
    options = ("--bench", bench, "--rehearse", port, "--output", tmp_path / "o")
    status, said, noted = run("rig", "hold", "--tension", "0.3", "--duration", "0.5", *options)
    assert status == 0, noted
    assert "rehearsal without hardware, not a measurement" in said
    record = read_record(tmp_path / "o" / "hold.rec")
    assert record.header["rehearsal"] is True
    since = next(each.time for each in record.messages if each.text == "holding the tension")
    held = record.samples[(record.time >= since + 0.1) & (record.states == State.RUNNING)]
    tension, z = held["force"]["tension"].mean(), held["translation"]["position"].mean()
    assert tension == pytest.approx(0.3, abs=0.01)
    pulled = z - held["screw"]["position"].mean()
    assert pulled == pytest.approx(SLACK + tension * (TENDON + BODY * z / robot().length_na), abs=20e-6)


def test_a_trial_follows_the_leader_on_the_example_bench_from_wherever_it_stands(result, bench, port, tmp_path, pages):
    """After the other test, or alone: the axes find their references again."""
    options = ("--end", "0.07", "--screw-rate-mm-s", "2", "--rate-hz", "100", "--bench", bench, "--rehearse", port)
    told = result("rig", "ftl", "exonav-1", "--target", "0.7", *options, "--output", tmp_path / "o")
    (trial,) = told["trials"]
    assert (trial["done"], trial["fault"]) == (True, None)
    assert trial["tension_error_rms"] < 0.1
    record = read_record(tmp_path / "o" / "trial-1.rec")
    length = robot().section.L
    assert record.samples["translation"]["position"].max() == pytest.approx(0.07 * length, abs=1e-4)
    assert record.samples["force"]["tension"][-1] < 0.05
    assert np.ptp(record.samples["rotation"]["position"]) > 0.9 * 2 * np.pi  # along the helix
    assert len(pages) == 1


@pytest.fixture
def pages(monkeypatch):
    """The page takes seconds and has its own tests."""
    asked = []

    def write_bench(found, out, watch=None):
        asked.append(found)
        return out / "index.html"

    monkeypatch.setattr("tendonrod.report.bench.write_bench", write_bench)
    return asked


def test_a_rehearsal_takes_the_emulated_board_and_no_tracker(bench):
    source = rehearsed(read_bench(bench).source(robot(), (0.0, 0.0, 0.0)), "/dev/pts/7")
    assert (source.launchpad["port"], source.launchpad["baud"], source.aurora) == ("/dev/pts/7", 921600, None)
    assert [each.name for each in source.trackers] == ["tip", "base"]  # their masses hang on the robot all the same
    assert source.limits["tension"] == 0.9
    assert source.known()["rehearsal"] is True


def test_what_may_be_hardware_is_no_rehearsal(refused, bench, tmp_path):
    hold = ("rig", "hold", "--tension", "0.1", "--duration", "1", "--output", tmp_path / "o")
    assert refused(*hold, "--bench", bench, "--rehearse", "/dev/ttyACM0").startswith(
        "--rehearse = /dev/ttyACM0: must be"
    )
    assert "left out with a virtual bench" in refused(*hold, "--rehearse", "/dev/pts/0")


def test_the_board_to_rehearse_on_runs_until_ctrl_c_and_says_where():
    command = [sys.executable, "-m", "tendonrod.rig.firmware"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        port = process.stdout.readline().strip()
        assert os.path.exists(port)
        process.send_signal(signal.SIGINT)
        _, noted = process.communicate(timeout=20)
    assert process.returncode == 130
    assert f"--rehearse {port}" in noted
    assert "Traceback" not in noted
    assert not os.path.exists(port)


def test_a_boards_own_numbers_can_be_rehearsed(tmp_path):
    mine = tmp_path / "mine.c"
    mine.write_text(firmware.CONFIG_OF_REHEARSAL.read_text().replace("100000, 3000", "90000, 1500"))
    with firmware.rehearsal(mine) as board, LaunchPad(board.port) as pad:
        assert pad.limits.axes[0] == (-20000, 90000, 1500, 100000)


def test_a_file_that_is_no_config_is_told(tmp_path):
    board = firmware.rehearsal(tmp_path / "none.c")
    with pytest.raises(DeviceError, match="refuses the firmware"), board:
        pass
