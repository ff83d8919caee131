"""kill -9 of a process that records, at random moments: the record opens, and 0.2 s at most are missing."""

import mmap
import os
import random
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

from tendonrod.rig.record import read_record

KILLS, LOSS = 24, 0.2
NOTE = struct.Struct("<ddq")  # times of the first and the last sample that were handed over, and how many

# One process that forks the victims, so that Python starts once. Each notes in shared memory what it recorded.
FORKER = """
import mmap, os, struct, sys, time
sys.path[:] = {folders!r}
from rig.records import COMMAND, plain
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.states import State

def record(path, note, pause):
    shared, pack = mmap.mmap(os.open(note, os.O_RDWR), 24), struct.Struct("<ddq").pack_into
    recorder, i = Recorder(path, {{}}), 0
    first = time.monotonic()
    while True:
        now = time.monotonic()
        recorder.write(plain(i, now), COMMAND, State.RUNNING)
        i += 1
        pack(shared, 0, first, now, i)
        time.sleep(pause)

for line in sys.stdin:
    path, note, pause = line.split("|")
    pid = os.fork()
    if pid == 0:
        record(path, note, float(pause))
    print(pid, flush=True)
    os.waitpid(pid, 0)
    print("gone", flush=True)
"""


def test_kill_9_at_random_moments(tmp_path):
    rng, recorded, losses = random.Random(11), 0, []
    folders = [str(Path(__file__).parents[1]), *sys.path]
    command = [sys.executable, "-c", FORKER.format(folders=folders)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as forker:
        try:
            for k in range(KILLS):
                note, path = tmp_path / f"{k}.note", tmp_path / f"{k}.rec"
                note.write_bytes(bytes(NOTE.size))
                pause = rng.choice([0.0005, 0.001, 0.005])
                pid = int(_ask(forker, f"{path}|{note}|{pause}"))
                time.sleep(rng.uniform(0.0, 0.35))
                os.kill(pid, signal.SIGKILL)
                assert forker.stdout.readline() == "gone\n"
                first, last, n = NOTE.unpack(note.read_bytes())
                if not path.exists():  # killed before the recorder was open
                    assert n == 0
                    continue
                losses.append(_loss(path, first, last, n))
                recorded += n > 0
        finally:
            forker.stdin.close()
            forker.kill()
    assert recorded >= KILLS // 2
    assert max(losses) <= LOSS, losses


def _ask(forker: subprocess.Popen, line: str) -> str:
    forker.stdin.write(line + "\n")
    forker.stdin.flush()
    return forker.stdout.readline()


def _loss(path: Path, first: float, last: float, n: int) -> float:
    """s of samples that were handed over and are not on file; what is there must be all from the start, unharmed."""
    record = read_record(path)
    left = record.time.size
    assert not record.end
    assert not record.damage
    assert record.lost == record.unreadable == 0
    assert record.samples["force"]["tension"].tolist() == list(range(left))
    assert left <= n + 1  # the last may be on file and not yet noted
    return 0.0 if left >= n else last - (record.time[-1] if left else first)


def test_memory_of_a_killed_process_can_be_read(tmp_path):
    """The note survives its writer: without that the test above would prove nothing."""
    note = tmp_path / "note"
    note.write_bytes(bytes(NOTE.size))
    pid = os.fork()
    if pid == 0:
        NOTE.pack_into(mmap.mmap(os.open(note, os.O_RDWR), NOTE.size), 0, 1.0, 2.0, 3)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)
    assert NOTE.unpack(note.read_bytes()) == (1.0, 2.0, 3)
