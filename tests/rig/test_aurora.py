"""The Aurora driver with its process and ndicapi, against an emulator in a third process, over a pty and TCP."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.aurora_emulator import emulated, pose
from tendonrod.rig.aurora import Aurora
from tendonrod.rig.interfaces import PoseTracker

pytest.importorskip("ndicapy")
pytest.importorskip("serial")
each_transport = pytest.mark.parametrize("transport", ["pty", "tcp"])
LATE = 0.03  # s that a time may be off on a machine that is busy


@contextmanager
def tracking(options: dict | None = None, **script):
    """An Aurora on an emulated tracker, and what the emulator says of itself."""
    with emulated(**script) as told, Aurora(told["port"], **{"tools": {"tip": None}, **(options or {})}) as aurora:
        yield aurora, told


def frames_of(aurora: Aurora, count: int, limit: float = 8.0) -> list:
    """At least ``count`` frames, as a loop of 200 Hz reads them."""
    found, deadline = [], time.monotonic() + limit
    while len(found) < count:
        assert time.monotonic() < deadline, f"{len(found)} of {count} frames in {limit} s"
        found += aurora.read()
        time.sleep(0.005)
    return found


def is_pose_of(frame, handle: int = 0x0A) -> bool:
    """Whether a frame is what the emulator measured, but for rounding to 0.01 mm and 1e-4."""
    quaternion, position, error = pose(handle, frame.frame)
    return (
        frame.position == pytest.approx([1e-3 * x for x in position], abs=0.51e-5)
        and frame.quaternion == pytest.approx(quaternion, abs=0.51e-4)
        and frame.quality == pytest.approx(1e-3 * error)
    )


@each_transport
def test_every_frame_comes_once_in_order_with_its_pose_and_its_time(transport):
    began = time.monotonic()
    with tracking({"now": lambda: time.monotonic() - began}, transport=transport) as (aurora, told):
        found = frames_of(aurora, 60)
        assert isinstance(aurora, PoseTracker)
        assert aurora.tools == ("tip",)
        assert aurora.handles == {"tip": [0x0A, "port 1"]}
        assert "Aurora" in aurora.firmware
        assert aurora.rate == pytest.approx(40.0, rel=0.05)
        assert all(is_pose_of(frame) for frame in found)
        numbers = [frame.frame for frame in found]
        assert numbers == sorted(set(numbers))
        assert numbers[-1] - numbers[0] + 1 - len(numbers) == aurora.counts.skipped <= 3
        for frame in found[5:]:
            assert began + frame.time == pytest.approx(told["zero"] + frame.frame / told["rate"], abs=LATE)


def test_what_is_amiss_with_a_frame_is_said_and_its_pose_is_nan():
    """Ten frames of each kind: a machine that is busy skips some."""
    script = {"missing": [[60, 79]], "out": [[70, 79]], "broken": [[80, 89]], "poor": [[90, 99]]}
    script |= {"partly_out": [[100, 109]]}
    found = {}
    with tracking({"largest_error": 5e-3}, **script) as (aurora, _):
        while not any(number > 110 for number in found):
            found |= {frame.frame: frame for frame in frames_of(aurora, 1)}
    wanted = {60: "missing", 70: "missing, out of volume", 80: "missing, sensor broken", 90: "bad fit"}
    wanted |= {100: "partially out of volume"}
    said = {number: re.sub(r"(, )?[0-9]+ frames? before it skipped", "", each.state) for number, each in found.items()}
    for first, words in wanted.items():
        assert {said[number] for number in range(first, first + 10) if number in said} == {words}
    assert all(found[number].is_lost == (number < 100) for number in found if 60 <= number < 110)


def test_two_sensors_in_one_plug_and_a_second_tool():
    tools = [[0x0A, 1, 0], [0x0B, 1, 1], [0x0C, 2, 0]]
    with tracking({"tools": {"tip": None, "middle": None, "port 2": None}}, tools=tools) as (aurora, _):
        found = frames_of(aurora, 30)
        by_name = {"tip": 0x0A, "middle": 0x0B, "port 2": 0x0C}
        assert {frame.tool for frame in found} == by_name.keys()
        assert all(is_pose_of(frame, by_name[frame.tool]) for frame in found)
    with tracking({"tools": None}, tools=tools) as (aurora, _):
        assert aurora.tools == ("port 1", "port 1.2", "port 2")


def test_reading_never_waits_for_a_slow_tracker():
    """Answers take 80 ms here; three of four frames are skipped, and said to be."""
    with tracking(late=0.08) as (aurora, _):
        found, took, end = [], [], time.monotonic() + 1.2
        while time.monotonic() < end:
            start = time.perf_counter()
            found += aurora.read()
            took.append(time.perf_counter() - start)
            time.sleep(0.005)
        assert sorted(took)[len(took) // 2] < 0.04  # half an answer; a machine that is busy may hold up the rest
        assert len(found) >= 5
        assert sum("skipped" in frame.state for frame in found) >= len(found) // 2
        assert aurora.counts.skipped >= len(found)


def test_noise_costs_replies_but_no_pose_is_wrong():
    with tracking(garble=0.3, seed=3) as (aurora, _):
        found = frames_of(aurora, 40)
        assert all(is_pose_of(frame) for frame in found)
        assert aurora.counts.damaged > 5


def test_cut_replies_are_asked_for_again():
    with tracking({"limit": 2.0}, truncate=0.1, seed=1) as (aurora, _):
        assert all(is_pose_of(frame) for frame in frames_of(aurora, 20, limit=15.0))
        assert aurora.counts.damaged > 0


def test_tool_definitions_are_written_and_the_line_is_left_at_its_first_speed(tmp_path):
    rom = tmp_path / "tool.rom"
    rom.write_bytes(b"NDI\0" + bytes(range(256)))
    log = tmp_path / "commands"
    with tracking({"tools": {"tip": rom}}, log=str(log)):
        pass
    commands = log.read_text().split()
    pages = [line[7:-4] for line in commands if line.startswith("PVWR:0A")]
    assert bytes.fromhex("".join(page[4:] for page in pages))[:260] == rom.read_bytes()
    order = [line.partition(":")[0] for line in commands]
    assert order.index("PVWR") < order.index("PINIT") < order.index("PENA") < order.index("TSTART")
    assert [line[:10] for line in commands if line.startswith("COMM")] == ["COMM:50000", "COMM:00000"]
    assert order[-2:] == ["TSTOP", "COMM"]


def test_a_tracker_left_at_another_speed_is_found():
    with tracking({"setup_limit": 0.3}, baud="5") as (aurora, _):
        assert frames_of(aurora, 1)


def is_running(pid: int) -> bool:
    """Whether a process is there and has not ended; an orphan that ended may stay listed as a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_bench_that_is_killed_takes_the_tracker_process_along():
    code = "import sys, time; from tendonrod.rig.aurora import Aurora; a = Aurora(sys.argv[1])\n"
    code += "print(a._process.pid, flush=True); time.sleep(60)"
    with emulated() as told:
        command = [sys.executable, "-c", code, told["port"]]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as bench:
            child = int(bench.stdout.readline())
            os.kill(bench.pid, signal.SIGKILL)
        deadline = time.monotonic() + 5.0
        while (runs := is_running(child)) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert not runs
