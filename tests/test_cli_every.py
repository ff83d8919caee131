"""`--every` of validate, identify and rig export: what counts, what is said of the rest, and what makes no sense."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import blank, seen
from tendonrod.cli.every import asked
from tendonrod.measurement.setup import Setup
from tendonrod.measurement.trial import LEFT_OUT
from tendonrod.measurement.trialfile import read_trial, write_trial

COUNT = 120


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    """The file of a robot on its way out, a frame of it missing, whose base is tilted."""
    eta = np.linspace(0.1, 1.0, COUNT)
    trial = blank(0.5 + 0.1 * np.cos(30.0 * eta), insertion=eta, position_noise=5e-4)
    (trial,) = seen([trial], Setup(base_tilt_y=0.05), seed=1)
    position = trial.position.copy()
    position[3] = np.nan
    path = tmp_path_factory.mktemp("moving") / "moving.nc"
    write_trial(replace(trial, position=position), path)
    return path


def test_counts_and_seconds():
    assert asked("10") == {"every": 10}
    assert asked("0.5s") == {"seconds": 0.5}
    assert asked(" 2 s ") == {"seconds": 2.0}
    assert asked(None) == {}


def test_validate_compares_what_counts_and_tells_the_rest(run, result, moving):
    status, out, err = run("validate", moving, "--every", "7", "--no-why")
    assert status == 0
    assert "--every 7: 17 samples count, 102 more are left out" in err
    assert f"17 of {COUNT} samples compared" in out
    assert LEFT_OUT in out
    told = result("validate", moving, "--every", "7", "--no-why")
    assert told["trials"][0]["fates"] == {"tip": {"kept": 17, "missing pose": 1, LEFT_OUT: 102}}
    whole = result("validate", moving, "--no-why")
    one, other = (each["places"][0]["gravity_modelled"]["rmse"] for each in (told, whole))
    assert one == pytest.approx(other, rel=0.2)


def test_validate_tells_errors_by_what_is_out_and_per_cent_of_the_whole_length(run, result, moving):
    place = result("validate", moving, "--no-why")["places"][0]["gravity_modelled"]
    length = read_trial(moving).robot.length_na
    assert place["share"] == pytest.approx(place["rmse"] / length)
    out = run("validate", moving, "--no-why")[1]
    for name in ("0 to 25 %", "25 to 50 %", "50 to 75 %", "75 to 100 %", "all of it"):
        assert name in out


def test_identify_fits_what_counts(result, moving):
    options = ("--free", "base_tilt_y", "--no-profiles", "--folds", "0", "--json")
    few, all_of_them = (result("identify", moving, *options, *more) for more in (("--every", "0.1s"), ()))
    errors = [each["free"][0]["standard_error"] for each in (few, all_of_them)]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.3)  # a quarter of the samples
    assert abs(few["free"][0]["value"] - 0.05) < 4.0 * errors[0]


def test_a_page_has_the_table_by_insertion(run, moving, tmp_path):
    assert run("validate", moving, "--no-why", "--output", tmp_path)[0] == 0
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Errors by how much of the robot was out" in text
    assert (tmp_path / "insertions.csv").read_text(encoding="utf-8").count("\n") == 6
    assert "of the exposed length" not in text


@pytest.mark.parametrize("text", ["0", "-3", "2.5", "s", "", "10 Hz", "0s", "ten"])
def test_what_makes_no_sense_is_named(refused, moving, text):
    assert refused("validate", moving, f"--every={text}").startswith("--every")
