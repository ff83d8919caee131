"""`tendonrod trial`: every sample is accounted for, and what is converted says the same."""

import json

import numpy as np
import pytest

from measurement.trials import some_trial
from tendonrod.measurement.csvfile import write_csv
from tendonrod.measurement.loading import load_trials
from tendonrod.measurement.trial import SAMPLED
from tendonrod.robotfile_writing import robot_text

HEADER = "time_s,tension_N,tip_x_mm,tip_y_mm,tip_z_mm,tip_state,lamp\n"
ROWS = HEADER + "0,0.5,1,2,70,OK,1\n1,0.6,,,,LOST,1\n1,0.7,1,2,71,OK,1\n"


@pytest.fixture
def bench(tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text(ROWS, encoding="utf-8")
    return str(path)


def test_every_sample_has_its_fate_and_row(run, bench):
    status, out, err = run("trial", bench, "--robot", "exonav-1", "--gravity", "-9.81,0,0")
    assert (status, err) == (0, f"tendonrod: {bench}: columns left alone: lamp\n")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert "tip kept 1 1" in lines
    assert "tip missing pose (LOST) 1 2" in lines
    assert "tip time repeated or out of order 1 3" in lines
    assert "gravity (-9.81, 0, 0) m/s2, world" in lines
    assert "tension (N) 0.5 0.7 3" in lines
    assert any("T_world_field not known" in line for line in lines)


def test_json_accounts_for_every_sample(run, tmp_path):
    trial = some_trial()
    write_csv(trial, tmp_path / "some.csv")
    status, out, _ = run("trial", tmp_path / "some.csv", "--json")
    assert status == 0
    (told,) = json.loads(out)
    assert told["samples"] == 12
    for each, fates in zip(trial.trackers, trial.fates.T, strict=True):
        own = [entry for entry in told["fates"] if entry["tracker"] == each.name]
        assert sorted(row for entry in own for row in entry["rows"]) == list(range(1, 13))
        for entry in own:
            assert entry["samples"] == len(entry["rows"])
            assert all(entry["fate"].startswith(fates[row - 1]) for row in entry["rows"])


@pytest.mark.parametrize("suffix", [".nc", ".csv"])
def test_what_is_converted_says_the_same(run, bench, tmp_path, suffix):
    output, back = tmp_path / f"again{suffix}", tmp_path / "back.csv"
    status, _, err = run("trial", bench, "--robot", "exonav-1", "--output", output)
    assert status == 0
    assert f"wrote {output}" in err
    assert run("trial", output, "--output", back)[0] == 0
    first, second = load_trials([bench, back], robot="exonav-1", trackers=None)
    for name in SAMPLED:
        one, other = getattr(first, name), getattr(second, name)
        assert np.all((one == other) | ((one != one) & (other != other))), name


def test_several_files_are_told_one_after_the_other(run, bench, tmp_path):
    other = tmp_path / "other.csv"
    other.write_text(ROWS, encoding="utf-8")
    status, out, _ = run("trial", bench, other, "--robot", "exonav-1")
    assert status == 0
    assert [line.partition(":")[0] for line in out.splitlines() if "samples, " in line] == ["bench", "other"]


def test_a_figure_is_drawn(run, bench, tmp_path):
    picture = tmp_path / "bench.svg"
    status, _, _ = run("trial", bench, "--robot", "exonav-1", "--figure", picture)
    assert status == 0
    text = picture.read_text(encoding="utf-8")
    assert text.startswith("<?xml")


def test_trackers_are_placed_by_options(run, tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("time_s,a_x_mm,a_y_mm,a_z_mm,b_x_mm,b_y_mm,b_z_mm\n0,1,2,3,4,5,6\n", encoding="utf-8")
    status, out, _ = run("trial", path, "--robot", "exonav-1", "--tracker", "a=base", "--tracker", "b=40", "--json")
    assert status == 0
    places = [(each["name"], each["on"], each["at"]) for each in json.loads(out)[0]["trackers"]]
    assert places == [("a", "base", None), ("b", "robot", 0.04)]


TRACK = (
    "Tools,Port 1: tip,Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error\n"
    "1,Port 1,0,OK,1,0,0,0,1,2,70,0.1\n1,Port 1,1,OK,1,0,0,0,1,2,71,0.1\n"
)


def test_no_file_that_is_read_is_replaced(run, refused, bench, tmp_path):
    """Whatever --output is called: the .csv, and the column map and the robot's file that go with it."""
    assert run("trial", bench, "--robot", "exonav-1", "--output", tmp_path / "own.csv")[0] == 0
    made = (tmp_path / "own.toml").read_text(encoding="utf-8")  # begins like every file that may be replaced
    robot = robot_text(some_trial().robot, ["Written by tendonrod"])
    for name, text in {
        "lab.toml": made, "hand.toml": "# mine\n" + made, "named.toml": made.replace("exonav-1", "named-robot.toml"),
        "named-robot.toml": robot, "track.csv": TRACK, "drive.csv": "time_s,tension_N\n0,0.5\n1,0.6\n",
    }.items():  # fmt: skip
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "link.csv").symlink_to(bench)
    track = (str(tmp_path / "track.csv"), "--robot", "exonav-1", "--drive", str(tmp_path / "drive.csv"))
    cases = {  # arguments and what --output is called -> what it must not be
        (bench, "--columns", str(tmp_path / "lab.toml")): {
            "lab": "--columns: lab.toml is written with it",
            "link": "FILE",
        },
        (bench, "--columns", str(tmp_path / "named.toml")): {"named": "--columns"},
        (bench, "--columns", str(tmp_path / "hand.toml"), "--robot", str(tmp_path / "named-robot.toml")): {
            "named": "--robot: named-robot.toml is written with it"
        },
        track: {"drive": "--drive", "track": "FILE"},
    }
    before = {each: each.read_bytes() for each in tmp_path.iterdir()}
    for arguments, names in cases.items():
        for name, said in names.items():
            target = str(tmp_path / f"{name}.csv")
            message = refused("trial", *arguments, "--output", target)
            assert f"--output = {target}: must be another file than {said}" in message
    assert "hand.toml, which goes with it, is there already and was not written by tendonrod" in refused(
        "trial", bench, "--robot", "exonav-1", "--output", str(tmp_path / "hand.csv")
    )
    own = tmp_path / "own.csv"
    assert "must be another file than FILE" in refused("trial", str(own), "--output", str(own))
    assert {each: each.read_bytes() for each in tmp_path.iterdir()} == before
    assert run("trial", bench, "--robot", "exonav-1", "--output", own)[0] == 0  # its own files may be replaced


def test_the_robot_that_a_map_names_is_not_replaced(refused, bench, tmp_path):
    (tmp_path / "lab-robot.toml").write_text(robot_text(some_trial().robot, ["Written by tendonrod"]), encoding="utf-8")
    (tmp_path / "bench.toml").write_text('robot = "lab-robot.toml"\n', encoding="utf-8")
    said = "the robot's file, which the column map names: lab-robot.toml is written with it"
    assert said in refused("trial", bench, "--output", str(tmp_path / "lab.csv"))


def test_bad_options_are_refused(refused, bench, tmp_path):
    robot = ("--robot", "exonav-1")
    cases = {
        (bench,): "robot = missing: must be given, or told by the column map",
        (bench, *robot, "--tracker", "tip"): "--tracker = tip: must be NAME=PLACE",
        (bench, *robot, "--tracker", "tip=far"): "--tracker tip = far: must be tip, base, millimetres",
        (bench, *robot, "--rate", "0"): "--rate = 0.0: must be > 0",
        (bench, *robot, "--output", bench): "--output = " + bench + ": must be another file than FILE",
        (bench, bench, *robot, "--figure", str(tmp_path / "x.png")): "must be given with one FILE; there are 2",
        (bench, *robot, "--columns", str(tmp_path / "no.toml")): "must be an existing TOML file",
        (bench, *robot, "--drive", bench): "must be left out",
        (str(tmp_path / "no.csv"), *robot): "must be an existing CSV file",
        ("", *robot): "must be a readable file",
        (bench, *robot, "--output", str(tmp_path / "x.txt")): "must be a file name that ends in .nc or .csv",
    }
    for arguments, said in cases.items():
        assert said in refused("trial", *arguments), arguments
