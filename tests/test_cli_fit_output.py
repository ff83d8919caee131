"""`tendonrod validate` and `tendonrod identify`: results are printed whatever becomes of files; notes go first."""

import json
from dataclasses import replace

import pytest

from tendonrod.measurement.names import GROUPS, MEANINGS
from tendonrod.measurement.registration import UNKNOWN, registered, world_poses
from tendonrod.measurement.trialfile import read_trial, write_trial

FREE = ("--free", "tip_mass", "--no-profiles", "--folds", "0")


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    from tendonrod.cli import main

    folder = tmp_path_factory.mktemp("trials")
    assert main(["experiment", "exonav-1", "--level", "base", "--samples", "3", "--output", str(folder)]) == 0
    return [str(folder / f"exonav-1-{name}.nc") for name in ("base", "s50", "s100")]


@pytest.fixture
def full(monkeypatch):
    """No picture fits on the disk any more."""
    from matplotlib.figure import Figure

    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", fail)


@pytest.mark.parametrize("command", [("validate",), ("identify", *FREE)], ids=["validate", "identify"])
def test_a_full_disk_leaves_the_results_on_the_screen(run, trials, tmp_path, full, command):
    name, *options = command
    status, out, err = run(name, *trials, *options, "--output", tmp_path / "new")
    assert status == 2
    assert "RMSE" in out
    last = err.splitlines()[-1]
    assert last.startswith(f"tendonrod: error: --output = {tmp_path / 'new'}: must be ")
    assert "No space left on device" in last


def test_the_option_is_named_where_its_files_cannot_be_written(run, trials, tmp_path, monkeypatch):
    import tendonrod.measurement.fitrecord as record

    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(record, "_json", fail)
    status, out, err = run("identify", *trials, *FREE, "--output", tmp_path)
    assert status == 2
    assert "RMSE" in out
    assert err.splitlines()[-1].startswith(f"tendonrod: error: --output = {tmp_path}: must be writable: No space")


def test_a_frame_that_is_only_assumed_is_said_before_the_numbers(run, refused, trials, tmp_path):
    base, *others = (read_trial(path) for path in trials)
    here, path = registered([base, *others])[2], str(tmp_path / "here.nc")
    write_trial(replace(here, position=world_poses(here)[0], orientation=None, T_world_field=None, origin={}), path)
    for command in (("validate", "--no-why"), ("identify", *FREE)):
        _, out, _ = run(command[0], path, *command[1:])
        assert 0 < out.index(UNKNOWN) < out.index("RMSE")
        assert UNKNOWN not in run(command[0], *trials, *command[1:])[1]
    assert UNKNOWN in refused("identify", path, "--free", "displacement_zero")


def test_why_no_sample_counts(refused, tmp_path):
    path = tmp_path / "idle.csv"
    path.write_text("time_s,tip_x_mm,tip_y_mm,tip_z_mm\n0,1,2,70\n1,1,2,71\n", encoding="utf-8")
    said = refused("identify", path, "--robot", "exonav-1", *FREE)
    assert said.startswith("TRIAL = ")
    assert said.endswith(": 2 neither tension nor displacement")


@pytest.mark.parametrize("folds", ["1", "-1", "11", "x"])
def test_folds_are_refused_before_the_fit_in_one_way(refused, trials, folds):
    said = refused("identify", *trials, "--free", "tip_mass", "--folds", folds)
    assert said.endswith("must be 0 for none, or a whole number from 2 to 10")


def test_names_as_json(result, trials):
    found = result("identify", "--names", trials[0])
    assert {each["name"]: each["meaning"] for each in found["bench"]} == MEANINGS
    assert found["groups"] == {name: list(each) for name, each in GROUPS.items()}
    (modulus,) = (each for each in found["robot_numbers"] if each["name"] == "youngs_modulus")
    assert modulus["value"] * modulus["per_si"] == pytest.approx(75.0)
    assert result("identify", "--names")["robot"] is None


def test_trials_that_are_made_are_named_beside_measured_ones(run, trials, tmp_path):
    write_trial(replace(read_trial(trials[1]), name="mine", origin={}), tmp_path / "mine.nc")
    _, out, _ = run("validate", trials[0], tmp_path / "mine.nc", trials[2], "--no-why")
    assert "exonav-1-base, exonav-1-s100: made by tendonrod" in out
    _, out, _ = run("validate", *trials, "--no-why")
    assert "\nmade by tendonrod" in out


def test_help_says_how_other_files_come_in(run):
    for command in ("validate", "identify"):
        assert "tendonrod trial FILE" in " ".join(run(command, "--help")[1].split())


def test_what_is_true_has_its_unit(run):
    _, out, _ = run("experiment", "exonav-1", "--youngs-modulus-gpa", "68", "--samples", "2", "--json")
    assert json.loads(out)["truth"]
    _, out, _ = run("experiment", "exonav-1", "--youngs-modulus-gpa", "68", "--samples", "2")
    assert "68 GPa, claimed 75" in out
