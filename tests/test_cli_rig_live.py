"""The live view of `tendonrod rig`, and the keys of a terminal while it is shown."""

import fcntl
import io
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time
from contextlib import suppress
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from rig.short_trials import bench_file
from tendonrod.cli import live
from tendonrod.rig.record import read_record
from tendonrod.rig.states import Fault, FaultKind, Reaction, State


def moment(**changes):
    axis = {
        name: SimpleNamespace(position=x) for name, x in (("screw", 0.01), ("translation", 0.0377), ("rotation", -1.0))
    }
    sample = SimpleNamespace(**axis, force=SimpleNamespace(tension=0.512))
    task = SimpleNamespace(progress=0.5, phase="inserting", name="follow the leader")
    given = {"sample": sample, "command": SimpleNamespace(target=0.508), "state": State.RUNNING, "fault": None}
    return SimpleNamespace(**given | {"task": task} | changes)


def test_the_live_view_in_words():
    line = live.told(moment(), 0.0754)
    assert line == "50 %, inserting, insertion 0.500, tension 0.512 N, target 0.508 N, error -4 mN, running"
    shown = dict(live.rows(moment(), 0.0754, 83.4))
    assert shown["phase"] == "inserting, 50 %, about 1 min 23 s left"
    assert shown["insertion"] == "0.500, 37.70 mm"
    fault = Fault(kind=FaultKind.LATE, time=1.0, reaction=Reaction.HOLD)
    assert live.told(moment(fault=fault), 0.0754).endswith(f"; {fault}")
    assert dict(live.rows(moment(fault=fault), 0.0754, float("nan")))["fault"] == str(fault)
    assert dict(live.rows(moment(), 0.0754, 1.0, 4.2e-4))["tip"] == "0.42 mm from the reference"
    assert "tip 0.42 mm from the reference, running" in live.told(moment(), 0.0754, 4.2e-4)
    assert "tip" not in dict(live.rows(moment(), 0.0754, 1.0))
    aimless = moment(command=SimpleNamespace(target=float("nan")))
    assert "tension 0.512 N, running" in live.told(aimless, 0.0754)


@pytest.mark.parametrize("width", [110, 60, 46])
def test_the_bar_stands_alone_in_its_line_and_no_word_is_cut(width):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(live.picture("trial 1 of 1", live.rows(moment(), 0.0754, 5.0), 0.5))
    lines = [line.rstrip() for line in console.export_text().splitlines()]
    assert lines[0] == "trial 1 of 1"
    assert set(lines[1]) <= set("━╸╺")
    assert 0 < len(lines[1]) <= live.BAR  # half of it where there is no colour
    assert lines[2].split()[:3] == ["phase", "inserting,", "50"]
    assert [line.split("  ", 1)[0] for line in lines[-2:]] == ["space, Esc", "Ctrl-C"]
    assert lines[-2].endswith("all stand still")
    assert lines[-1].endswith("release the tension and end")


def test_the_time_left_is_told_from_what_goes_on_not_from_what_came_before(monkeypatch):
    """Ten seconds of taking up, in which nothing is done of the task, then a tenth of it in a second."""
    now, view = [0.0], live.LiveView(0.0754)
    monkeypatch.setattr(live.time, "monotonic", lambda: now[0])
    task = SimpleNamespace(progress=0.0, phase="", name="")
    view.begin("")
    for now[0] in np.arange(0.0, 10.0, 0.5).tolist():
        view.watch(moment(task=task))
    now[0], task.progress = 10.5, 0.1
    assert view._left(now[0], 0.1) == pytest.approx(9.0)


def test_a_line_every_few_seconds_where_there_is_no_terminal(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(live.time, "monotonic", lambda: now[0])
    with live.LiveView(0.0754) as view:
        view.begin("trial 1 of 1")
        for now[0] in np.arange(0.0, 11.0, 0.005).tolist():
            view.watch(moment())
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith("tendonrod: trial 1 of 1: 50 %") for line in lines)


SESSION = """import fcntl, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)  # so that Ctrl-C makes a signal
from tendonrod.cli import main
sys.exit(main(sys.argv[1:]))
"""
PATIENT = """[limits]
late_in_row = 10000
sensor_age_ms = 20000
command_timeout_ms = 20000
tracker_time_ms = 20000
"""


@pytest.mark.parametrize(("key", "status", "cause"), [(b"\x03", 130, "Ctrl-C"), (b" ", 1, "space")])
def test_keys_of_a_terminal(tmp_path, key, status, cause):
    """A process of its own on a terminal: the live view, Ctrl-C and the emergency stop, and what is left after them."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
    before = termios.tcgetattr(slave)
    path = bench_file(tmp_path, PATIENT)
    arguments = ["rig", "hold", "--tension", "0.3", "--duration", "60", "--real-time", "--bench", str(path)]
    process = subprocess.Popen(
        [sys.executable, "-c", SESSION, *arguments, "--output", str(tmp_path / "o")],
        stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
    )  # fmt: skip
    try:
        shown = _until(master, b"holding the tension", 60.0)
        os.write(master, key)
        shown += _until(master, b"hold.nc", 30.0)
        assert process.wait(20.0) == status
        after = termios.tcgetattr(slave)
    finally:
        process.kill()
        process.wait()
        os.close(slave)
        os.close(master)
    assert after == before
    assert b"emergency stop, all stand still" in shown
    record = read_record(tmp_path / "o" / "hold.rec")
    assert record.is_complete
    assert [each.where for each in record.faults] == [cause]
    tension = record.samples["force"]["tension"]
    assert (tension[-1] < 0.06) == (status == 130)  # an emergency stop lets nothing move
    assert (tmp_path / "o" / "hold.nc").is_file()


def _until(terminal: int, word: bytes, limit: float) -> bytes:
    shown, end = b"", time.monotonic() + limit
    while word not in shown:
        assert time.monotonic() < end, shown[-2000:]
        if select.select([terminal], [], [], 0.2)[0]:
            with suppress(OSError):
                shown += os.read(terminal, 65536)
    return shown
