"""`tendonrod rig replay` and `export`: what they say of a record and make of it."""

import json

import numpy as np
import pytest

from rig.short_trials import robot
from tendonrod.measurement.trialfile import read_trial
from tendonrod.rig.record import read_record
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.replay import replay


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    """A record of a second."""
    from tendonrod.cli import main

    out = tmp_path_factory.mktemp("held")
    assert main(["rig", "hold", "--tension", "0.2", "--duration", "0.2", "--output", str(out)]) == 0
    return out / "hold.rec"


def test_replay_says_what_is_there_and_what_is_not(run, held, tmp_path):
    status, said, _ = run("rig", "replay", held)
    record = read_record(held)
    assert status == 0
    assert f"{len(record.samples)} replayed" in said
    for text in ("taking up the tendon", "holding the tension", "complete; closed", "running", "held"):
        assert text in said
    assert f"asked again about {len(record.samples)} samples, finds the same states and faults" in said
    torn = tmp_path / "torn.rec"
    torn.write_bytes(held.read_bytes()[: held.stat().st_size // 2])
    status, said, _ = run("rig", "replay", torn)
    assert status == 1
    assert "not closed" in said


def test_replay_says_where_the_interlock_finds_something_else(run, held, tmp_path):
    """The same record under a limit that it passed: the header says 0.15 N."""
    record, other = read_record(held), tmp_path / "other.rec"
    header = {**record.header, "limits": {**record.header["limits"], "tension": 0.15, "soft": 1.0}}
    with Recorder(other, header) as recorder:
        for each in replay(record):
            recorder.write(*each)
    status, said, _ = run("rig", "replay", other)
    assert status == 1
    first = int(np.argmax(record.samples["force"]["tension"] > 0.15))
    assert f"asked again, differs after {first} of {len(record.samples)} samples: state" in " ".join(said.split())
    status, said, _ = run("rig", "replay", other, "--json")
    assert status == 1
    told = json.loads(said)["interlock"]
    assert not told["agrees"]
    assert told["asked"] == first + 1
    assert {each["what"] for each in told["differences"]} == {"state", "fault"}


def test_what_json_cannot_say_is_null(run, tmp_path):
    with Recorder(tmp_path / "odd.rec", {"launchpad": {"max_age": float("inf")}}) as recorder:
        recorder.log(float("nan"), "when?")
    status, said, _ = run("rig", "replay", tmp_path / "odd.rec", "--json")
    assert status == 0
    found = json.loads(said)
    assert found["header"]["launchpad"] == {"max_age": None}
    assert found["messages"] == [[None, "info", "when?"]]
    assert found["interlock"].startswith("not asked again: limits = None")


def test_export(run, refused, held, tmp_path):
    assert run("rig", "export", held, "-o", tmp_path / "a.nc", "--at", "samples")[0] == 0
    assert read_trial(tmp_path / "a.nc").robot == robot()
    status, _, noted = run("rig", "export", held, "-o", tmp_path / "a.csv")
    assert (status, f"wrote {tmp_path / 'a.csv'}" in noted) == (0, True)
    assert len((tmp_path / "a.csv").read_text().splitlines()) == len(read_record(held).samples) + 1
    assert (tmp_path / "a.frames.csv").is_file()
    assert "nothing is overwritten" in refused("rig", "export", held, "-o", tmp_path / "a.csv")
    assert "ends in .nc or .csv" in refused("rig", "export", held, "-o", tmp_path / "a.txt")
    assert "--at = samples: must be left out for CSV" in refused(
        "rig", "export", held, "-o", tmp_path / "b.csv", "--at", "samples"
    )


def test_only_frames_of_the_tracker_are_thinned(run, refused, held, tmp_path):
    status, _, noted = run("rig", "export", held, "-o", tmp_path / "a.nc", "--every", "0.1s")
    assert status == 0
    assert "--every 0.1s: one used sample in 0.1 s; " in noted
    for more in (("-o", tmp_path / "b.csv"), ("-o", tmp_path / "b.nc", "--at", "samples")):
        assert refused("rig", "export", held, *more, "--every", "4").startswith("--every = 4: must be left out")
    assert refused("rig", "export", held, "-o", tmp_path / "b.nc", "--every", "often").startswith("--every = often")


def test_a_suffix_in_capitals_is_the_same_suffix(run, refused, held, tmp_path):
    assert run("rig", "export", held, "-o", tmp_path / "a.NC", "--at", "samples")[0] == 0
    assert read_trial(tmp_path / "a.NC").origin["one sample is"] == "sample"
    (tmp_path / "a.frames.csv").write_text("of another record")
    assert "nothing is overwritten" in refused("rig", "export", held, "-o", tmp_path / "a.CSV")
