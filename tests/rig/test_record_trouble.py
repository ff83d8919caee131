"""A recorder in trouble: full disks, errors, disks that hang, programs that end or fork; what is lost is told first."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from rig.records import plain
from tendonrod.rig.interfaces import STILL
from tendonrod.rig.record import read_record
from tendonrod.rig.record_file import RecordFile
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.states import State


@pytest.fixture
def path(tmp_path):
    return tmp_path / "trial.rec"


def wait_for(what, at_most: float = 5.0) -> bool:
    end = time.monotonic() + at_most
    while not what() and time.monotonic() < end:
        time.sleep(0.005)
    return bool(what())


def _run(code: str, path: Path, own: bool = False, status: int = 0) -> str:
    opened = "" if own else "recorder = Recorder(sys.argv[1], {})\n"
    start = (
        "import os, resource, sys, time\nfrom rig.records import plain\nfrom tendonrod.rig.interfaces import STILL\n"
        "from tendonrod.rig.recorder import Recorder\nfrom tendonrod.rig.states import State\n"
    )
    folders = [str(Path(__file__).parents[1]), *sys.path]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:] = {folders!r}\n{start}{opened}{code}", str(path)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == status, done.stderr
    return done.stdout


def test_a_program_that_just_ends_leaves_a_whole_record(path):
    _run("recorder.write(plain(0), STILL, State.RUNNING); raise SystemExit(3)", path, status=3)
    record = read_record(path)
    assert record.end["reason"] == "the program ended"
    assert record.time.size == 1


def test_a_fork_leaves_the_record_alone(path):
    _run("recorder.write(plain(0), STILL, State.RUNNING)\nif os.fork() == 0: sys.exit()\nos.wait()", path)
    assert read_record(path).is_complete


LIMITED = """
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
recorder = Recorder(sys.argv[1], {}, flush=0.01, reserve=64 << 10)
i = 0
while not recorder.failed and i < 10_000:
    recorder.write(plain(i), STILL, State.RUNNING)
    i += 1
    time.sleep(0.0005)
room = os.stat(sys.argv[1]).st_size - recorder._file.size
for i in range(i, i + AFTER):
    recorder.write(plain(i), STILL, State.HELD)
recorder.close("the disk is full")
print(i + 1, room, recorder.failed, sep="|")
"""


def test_a_full_disk_is_told_while_there_is_room_for_the_end(path):
    written, room, failed = _run(LIMITED.replace("AFTER", "200"), path, own=True).split("|")
    assert "no more room" in failed
    assert int(room) > 50_000
    record = read_record(path)
    assert record.is_complete
    assert record.end["reason"] == "the disk is full"
    assert record.end["failed"] == failed.strip()
    assert record.samples["force"]["tension"].tolist() == list(range(int(written)))


def test_a_disk_that_is_full_to_the_last_byte_keeps_what_it_took(path):
    written, _, failed = _run(LIMITED.replace("AFTER", "2000"), path, own=True).split("|")
    assert "no more room" in failed
    record = read_record(path)
    assert not record.is_complete
    n = record.time.size
    assert 500 < n < int(written)
    assert record.samples["force"]["tension"].tolist() == list(range(n))
    assert "not closed" in record.condition


def test_no_room_for_the_reserve_is_told_before_the_start(path):
    said = _run(LIMITED.replace("64 << 10", "1 << 20"), path, own=True, status=1)
    assert said == ""
    assert list(path.parent.iterdir()) == []


def test_a_write_error_is_told_and_nothing_is_lost_once_it_is_over(path, monkeypatch):
    broken, append = threading.Event(), RecordFile.append

    def failing(self, data):
        if broken.is_set():
            append(self, data[: len(data) // 2])  # half of it gets through, as a real disk may have it
            raise OSError(5, "Input/output error")
        append(self, data)

    monkeypatch.setattr(RecordFile, "append", failing)
    with Recorder(path, {}, flush=0.01) as recorder:
        for i in range(300):
            recorder.write(plain(i), STILL, State.RUNNING)
            if i == 100:
                broken.set()
                assert wait_for(lambda: recorder.failed)
                assert "Input/output error" in recorder.failed
            if i == 200:
                broken.clear()
            time.sleep(2e-4)
    record = read_record(path)
    assert record.is_complete
    assert record.samples["force"]["tension"].tolist() == list(range(300))
    assert record.end["failed"] == recorder.failed


def test_a_disk_that_hangs_is_told(path, monkeypatch):
    hung, append = threading.Event(), RecordFile.append
    with Recorder(path, {}, flush=0.01, patience=0.2) as recorder:
        monkeypatch.setattr(RecordFile, "append", lambda self, data: (hung.wait(5.0), append(self, data)))
        began = time.monotonic()
        n = 0
        while not recorder.failed and n < 5000:
            recorder.write(plain(n), STILL, State.RUNNING)
            n += 1
            time.sleep(1e-3)
        took = time.monotonic() - began
        assert "nothing could be written" in recorder.failed
        assert 0.15 < took < 1.5
        hung.set()
    assert read_record(path).time.size == n


def test_a_process_that_was_away_has_no_disk_that_hangs(path):
    with Recorder(path, {}, flush=10.0, patience=0.3) as recorder:
        for i in range(2):
            recorder.write(plain(i), STILL, State.RUNNING)
            time.sleep(0.4)
        recorder.write(plain(2), STILL, State.RUNNING)
        assert recorder.failed == ""
