"""A record gives the session again bit for bit, survives whatever ends it, and says why it can't be replayed."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from navigate import round_phantom
from tendonrod import InvalidInput, anatomy
from tendonrod.navigate import record as recording
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.outer_tube import OuterTube
from tendonrod.navigate.record import SessionRecord, digest
from tendonrod.navigate.replay import ReplayDiffers, read_header, replay
from tendonrod.navigate.session import Session

STEP = 1.0 / 60.0


@pytest.fixture(autouse=True)
def _known_by_name(monkeypatch):
    """A replay finds the round phantom by its name, as it finds the others."""
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom())


def played(path):
    """A recorded session with every kind of event; the digests of its snapshots."""
    session = Session(round_phantom.scenario(), record=SessionRecord(path))
    shown = [session.snapshot]
    jogs = [Jog(tension=0.9)] * 30 + [Jog()] * 20 + [Jog(insertion=9e-3, rotation=0.1)] * 25
    shown += [session.step(jog, STEP) for jog in jogs]
    shown += [session.couple(False), session.step(Jog(insertion=5e-3), 0.1), session.reset()]
    shown += [session.place(OuterTube(depth=5.4e-3, tilt=0.3)), session.step(Jog(insertion=2e-3), 0.2)]
    session.close()
    return [(each.index, each.time, each.reached, digest(each)) for each in shown]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "session.jsonl"


def test_a_replay_gives_the_same_bits(path):
    shown = played(path)
    assert [(each.index, each.time, each.reached, digest(each)) for each in replay(path)] == shown


def test_the_header_says_what_was_run(path):
    played(path)
    header = read_header(path)
    assert header["scenario"]["phantom"] == "round"
    assert "exonav-1" in header["scenario"]["robot"]
    assert {"tendonrod", "numpy", "numba", "python"} <= header["software"].keys()
    assert header["drive"] == "IdealDrive"


def test_what_was_cut_off_at_the_end_is_left_out(path):
    shown = played(path)
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    cut = path.with_name("cut.jsonl")
    cut.write_bytes(b"".join(lines[:10]) + lines[10][:-7])
    found = [digest(each) for each in replay(cut)]
    assert found == [each[-1] for each in shown[: len(found)]]
    assert len(found) > 8


def test_an_edited_record_is_told_by_step(path):
    played(path)
    lines = path.read_text().splitlines()
    at = next(k for k, line in enumerate(lines) if '"jog":[0.009' in line)
    lines[at] = lines[at].replace('"jog":[0.009', '"jog":[0.008')
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ReplayDiffers, match=r"step 51 of .*: insertion \(share\) 0.00\d+ in the record, 0.00"):
        list(replay(path))


TOLD = {
    "at": ([1e-12 + 0.9 / 60.0 * 30, 0, 0], "insertion (share) 0.45", "0.0000 computed"),
    "tip": (
        [0.0049, 0.0, 1e-7],
        "(4.9000, 0.0000, 0.0001) in the record",
        "(4.9000, 0.0000, 0.0000) computed",
    ),
    "digest": ("0" * 16, "hash of the whole shape 0000000000000000 in the record", "computed"),
    "blocked": ("too far", "command refused in the record", "carried out computed"),
    "index": (7, "index 7 in the record", "1 computed"),
}


@pytest.mark.parametrize("field", TOLD)
def test_whatever_was_edited_is_named_with_both_values(path, field):
    played(path)
    lines = path.read_text().splitlines()
    value, recorded, computed = TOLD[field]
    lines[1] = json.dumps(json.loads(lines[1]) | {field: value})
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ReplayDiffers) as found:
        list(replay(path))
    assert recorded in str(found.value)
    assert computed in str(found.value)


@pytest.mark.parametrize("apart", [1e-3, 1e-7, 1e-13, 2.3e-16])
def test_both_values_are_told_with_digits_enough_to_differ(path, apart):
    played(path)
    lines = path.read_text().splitlines()
    k, line = next((k, json.loads(line)) for k, line in enumerate(lines) if '"jog":[0.009' in line)
    line["at"][2] += apart
    lines[k] = json.dumps(line)
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(ReplayDiffers) as found:
        list(replay(path))
    said = re.search(r"tension 1 \(N\) (\S+) in the record, (\S+) computed", str(found.value))
    assert said is not None
    then, now = map(float, said.groups())
    assert then > now
    assert now == pytest.approx(0.45)


def test_other_versions_are_named(path):
    played(path)
    lines = path.read_text().splitlines()
    header = json.loads(lines[0])
    header["software"]["numpy"] = "0.1"
    header["start"]["digest"] = "0" * 16
    path.write_text("\n".join([json.dumps(header), *lines[1:]]) + "\n")
    with pytest.raises(ReplayDiffers, match=r"numpy 0\.1 then, .* now"):
        next(replay(path))


def test_another_phantom_is_named(path, monkeypatch):
    played(path)
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom(cord=3e-3))
    with pytest.raises(InvalidInput, match="phantom round: must be the phantom that the session was recorded with"):
        next(replay(path))


@pytest.mark.parametrize("content", [b"", b"\x00\xff\n", b'{"format": "other"}\n', b"[1]\n", b"insertion,tension\n"])
def test_what_is_no_record_is_refused(path, content):
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match="must be a record that a session of tendonrod wrote"):
        next(replay(path))


def test_a_header_that_lacks_something_is_told(path):
    played(path)
    lines = path.read_text().splitlines()
    header = json.loads(lines[0])
    del header["scenario"]["levels"]
    path.write_text("\n".join([json.dumps(header), *lines[1:]]) + "\n")
    with pytest.raises(InvalidInput, match="without 'levels': must be that of this tendonrod"):
        next(replay(path))


def test_a_broken_line_is_told_by_number(path):
    played(path)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b"{]\n" + b"".join(lines[1:]))
    with pytest.raises(InvalidInput, match="line 2"):
        list(replay(path))


def test_records_are_never_overwritten(path):
    played(path)
    with pytest.raises(InvalidInput, match="never overwritten"):
        played(path)


def test_a_record_begins_with_the_robot_retracted(path):
    session = Session(round_phantom.scenario())
    session.step(Jog(insertion=5e-3, tension=0.5), 0.5)
    with pytest.raises(InvalidInput, match="retracted"):
        session.start_recording(SessionRecord(path))
    session.step(Jog(insertion=-5e-3, rotation=0.2), 1.0)
    session.start_recording(SessionRecord(path))
    shown = [session.snapshot, session.step(Jog(insertion=5e-3), 0.2)]
    session.stop_recording()
    session.step(Jog(insertion=5e-3), 0.2)
    assert [(e.index, e.time, digest(e)) for e in replay(path)] == [(e.index, e.time, digest(e)) for e in shown]


@pytest.mark.parametrize("out", [5, 6, 7, 8])
def test_what_went_before_a_record_does_not_matter_to_its_replay(path, out):
    """How many shapes in a row were trusted is history too: it decides which of the next is solved on two grids."""
    session = Session(round_phantom.scenario())
    for jog in [Jog(tension=1.0)] * 30 + [Jog(insertion=5e-3)] * out + [Jog(insertion=-5e-3)] * (out + 2):
        session.step(jog, STEP)
    session.start_recording(SessionRecord(path))
    shown = [session.snapshot] + [session.step(Jog(insertion=3e-3, rotation=0.2), STEP) for _ in range(20)]
    session.close()
    assert [digest(each) for each in replay(path)] == [digest(each) for each in shown]


LINES = {
    "a step without its count": {"count": None}, "a count that is none": {"count": 1.5}, "no duration": {"dt": "1"},
    "two velocities": {"jog": [0.0, 0.0]}, "no velocities": {"jog": None}, "no result": {"digest": None},
    "no time": {"dt": True}, "no posture": {"at": []},
}  # fmt: skip
EVENTS = [
    {"event": "place"}, {"event": "place", "tube": {"height": 0.0}}, {"event": "place", "tube": None},
    {"event": "couple"}, {"event": "couple", "on": 1}, {"event": []}, {"event": None}, {"jog": 1},
]  # fmt: skip


@pytest.mark.parametrize("change", [*LINES.values(), *EVENTS], ids=str)
def test_whatever_a_line_lacks_is_told_by_its_number(path, change):
    played(path)
    lines = path.read_text().splitlines()
    edited = change if change in EVENTS else json.loads(lines[1]) | change
    path.write_text("\n".join([lines[0], json.dumps(edited)]) + "\n")
    with pytest.raises(InvalidInput, match=r"line 2.*must be a record that a session of tendonrod wrote"):
        list(replay(path))


@pytest.mark.parametrize("place", [("start", "index"), ("start", "time"), ("start", "digest"), ("scenario", "robot")])
def test_whatever_a_header_has_wrong_is_one_sentence(path, place):
    played(path)
    lines = path.read_text().splitlines()
    header = json.loads(lines[0])
    header[place[0]][place[1]] = None if place[1] != "digest" else header[place[0]].pop("digest")[:0]
    path.write_text("\n".join([json.dumps(header), *lines[1:]]) + "\n")
    with pytest.raises((InvalidInput, ReplayDiffers)) as found:
        next(replay(path))
    assert "\n" not in str(found.value)


def test_a_full_disk_ends_the_record_and_not_the_session(path, monkeypatch):
    session = Session(round_phantom.scenario(), record=SessionRecord(path))
    session.step(Jog(tension=0.5), 0.2)

    def full(descriptor, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(recording.os, "write", full)
    session.step(Jog(insertion=1e-3), 0.2)
    shown = session.step(Jog(insertion=1e-3), 0.2)
    assert shown.insertion > 0.0
    assert [each.text for each in shown.warnings if each.code == "record"] == [
        "the record session.jsonl ends here, the session goes on: No space left on device"
    ]
    monkeypatch.undo()
    assert "record" in [each.code for each in session.step(Jog(), 0.2).warnings]


KILLED = """
import sys, time
from navigate.round_phantom import scenario
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.record import SessionRecord
from tendonrod.navigate.session import Session
session = Session(scenario(), record=SessionRecord(sys.argv[1]))
while True:
    shown = session.step(Jog(tension=0.1), 0.02)
    print(shown.time, flush=True)
    time.sleep(0.002)
"""


def test_a_killed_process_loses_less_than_a_fifth_of_a_second(path):
    tests = Path(__file__).parents[1]
    run = [sys.executable, "-c", KILLED, str(path)]
    with subprocess.Popen(run, stdout=subprocess.PIPE, text=True, cwd=tests) as process:
        assert process.stdout is not None
        told = []
        for line in process.stdout:
            told.append(float(line))
            if told[-1] > 1.0:
                break
        os.kill(process.pid, signal.SIGKILL)
        told += map(float, process.stdout.read().split())
    kept = list(replay(path))
    assert told[-1] - kept[-1].time < 0.2
    assert len(kept) > 40
