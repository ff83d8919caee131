"""Scripts on a bench: an emulated board moves for as long as they say, and ends slack; a fault ends the script."""

import json
from math import degrees

import pytest

from navigate import round_phantom
from tendonrod import anatomy
from tendonrod.navigate.replay import read_header, replay
from tendonrod.rig import firmware
from tendonrod.rig.launchpad import LaunchPad

pytest.importorskip("serial")
# A busy machine, which holds these tests up, is no fault of theirs.
PATIENT = "late_in_row = 10000\nsensor_age_ms = 5000\ncommand_timeout_ms = 5000\n"
BENCH = """[bench]
kind = "devices"
[launchpad]
port = "{port}"
[load_cell]
counts_per_newton = 1349
zero_counts = 32768
full_scale_n = 22.24
tare_readings = 20
[limits]
"""
SCRIPT = """duration_s,insertion_mm_per_s,rotation_deg_per_s,tension_n_per_s
1,0,0,0.2
1.5,1,0,0
0.5,0,20,0
0.5,0,0,0
"""


@pytest.fixture
def port():
    with firmware.rehearsal(firmware.CONFIG_OF_REHEARSAL, "--watchdog", "5000") as board:
        yield board.port


@pytest.fixture
def scripted(run, port, tmp_path, monkeypatch):
    """(exit status, what it printed, what it noted) of this script on the board."""
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom())
    bench, script = tmp_path / "bench.toml", tmp_path / "moves.csv"

    def call(text, limits=PATIENT):
        bench.write_text(BENCH.format(port=port) + limits)
        script.write_text(text)
        options = ("--script", script, "--headless", "--json", "--bench", bench, "--output", tmp_path)
        return run("navigate", *options)

    return call


def test_a_script_moves_the_devices_is_recorded_and_ends_slack(scripted, port):
    status, said, noted = scripted(SCRIPT)
    assert status == 0, noted  # how long each step is made for, exactly: test_bench_pace
    found = json.loads(said)
    assert found["blocked"] == 0.0, noted
    assert read_header(found["record"])["drive"] == "BenchAside"
    shown = list(replay(found["record"]))
    assert shown[0].insertion == 0.0  # although the board's axes clear their switches by 0.3 mm
    inserted, last = shown[150], shown[-1]
    assert (inserted.time, last.time) == pytest.approx((2.5, 3.5))
    assert last.tension[0] == pytest.approx(0.2, abs=0.15)  # an insertion raises it
    assert 1e3 * last.exposed == pytest.approx(0.3 + 1.5, abs=0.6)  # axes go on while a busy machine's loop is late
    assert degrees(last.rotation - inserted.rotation) == pytest.approx(10.0, abs=4.0)
    with LaunchPad(port) as board:
        assert board.load_cell.read().tension < 0.05
        assert board.translation.read().position == pytest.approx(last.exposed, abs=0.1e-3)
        assert [axis.read().velocity for axis in (board.screw, board.translation, board.rotation)] == [0.0] * 3


def test_a_script_ends_where_the_bench_stops_and_says_so(run, tmp_path, monkeypatch):
    """What the script would do next is not done, and neither shown nor counted as if it were."""
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom())
    (tmp_path / "bench.toml").write_text(
        '[bench]\nkind = "virtual"\n[[fault]]\nkind = "load cell gives no number"\ntime_s = 1.5\n'
    )
    (tmp_path / "moves.csv").write_text("duration_s,insertion_mm_per_s,rotation_deg_per_s,tension_n_per_s\n60,0,5,0\n")
    options = ("--headless", "--json", "--bench", tmp_path / "bench.toml", "--output", tmp_path)
    status, said, noted = run("navigate", "--script", tmp_path / "moves.csv", *options)
    assert status == 1
    assert noted.splitlines()[-1].startswith("tendonrod: error: the script ends at ")
    assert ": the bench stopped: sensor gives no number (load cell)" in noted.splitlines()[-1]
    assert "Traceback" not in noted
    found = json.loads(said)
    assert found["duration"] < 10.0
    assert list(replay(found["record"]))[-1].time == pytest.approx(found["duration"])
