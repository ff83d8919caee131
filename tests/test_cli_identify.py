"""`tendonrod identify` from files to files, on trials whose truth is known."""

import csv
import json
import os
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from tendonrod import load_robot
from tendonrod.measurement.names import GROUPS, MEANINGS

FREE = ("--free", "youngs_modulus,tip_mass")
DOCS = Path(__file__).parent.parent / "docs"


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    """Three trials of a softer robot with a mass at its tip, of one base."""
    from tendonrod.cli import main

    folder = tmp_path_factory.mktemp("trials")
    bench = ["--youngs-modulus-gpa", "68", "--tip-mass-g", "0.3", "--noise-mm", "0.1", "--tension-noise-mN", "0"]
    assert main(["experiment", "exonav-1", *bench, "--samples", "4", "--output", str(folder)]) == 0
    return [str(folder / f"exonav-1-{name}.nc") for name in ("base", "s50", "s75", "s100")]


def test_numbers_intervals_and_files(run, trials, tmp_path):
    status, out, err = run("identify", *trials, *FREE, "--output", tmp_path / "fit")
    assert status == 0, err
    record = json.loads((tmp_path / "fit" / "fit.json").read_text())
    robot = load_robot(tmp_path / "fit" / "fitted-exonav-1.toml")
    by = {each["name"]: each for each in record["free"]}
    for name, true in (("youngs_modulus", 68e9), ("tip_mass", 3e-4)):
        each = by[name]
        assert abs(each["value"] - true) < 3.0 * each["standard_error"]
        assert each["profile_low"] == pytest.approx(each["low"], abs=0.2 * each["standard_error"])
    assert robot.parameters() == record["robot_numbers"]
    assert robot.parameters()["youngs_modulus"] == pytest.approx(by["youngs_modulus"]["value"], rel=1e-15)
    assert record["rmse"] < 2e-4 < 1e-3 < record["rmse_before"]
    assert record["rmse"] < record["rmse_held_out"] < 3e-4
    assert [each["held_out"] for each in record["cross_validation"]["folds"]] == [
        "exonav-1-s50", "exonav-1-s75", "exonav-1-s100",
    ]  # fmt: skip
    for said in ("torsion homogenized", "by likelihood", "held out (trial by trial)", "times the noise", "virtual"):
        assert said in out
    for name in ("index.html", "numbers.csv", "profiles.png", "predictions.svg", "residuals.csv", "profiles.csv"):
        assert (tmp_path / "fit" / name).stat().st_size > 0
    page = (tmp_path / "fit" / "index.html").read_text()
    assert "not a measurement" in page
    assert 'src="http' not in page
    assert all((tmp_path / "fit" / link).is_file() for link in re.findall(r'href="([^"#:]+)"', page))


def test_the_scene_and_robot_serve_the_shape_command(result, run, trials, tmp_path):
    status, _, err = run("identify", *trials, *FREE, "--no-profiles", "--folds", "0", "--output", tmp_path)
    assert status == 0, err
    rows = list(csv.DictReader((tmp_path / "residuals.csv").open()))
    tip = next(row for row in rows if row["tracker"] == "s100")
    files = (tmp_path / "fitted-exonav-1.toml", "--scene", tmp_path / "fitted-scene.toml")
    shape = result("shape", *files, "--tension", tip["tension_1_N"], "--gravity=-9.81,0,0")
    assert shape["torsion"] == "homogenized"
    record = json.loads((tmp_path / "fit.json").read_text())
    assert shape["scene"] is not None
    np.testing.assert_allclose(record["exit_pose"], np.eye(4))
    assert record["bench"]["tip_mass"] == pytest.approx(record["free"][1]["value"])


def test_json_is_the_record(result, trials):
    found = result("identify", *trials, *FREE, "--no-profiles", "--folds", "2")
    m = len(found["free"])
    assert np.shape(found["covariance"]) == np.shape(found["correlation"]) == (m, m)
    assert found["profiles"] == []
    assert len(found["cross_validation"]["folds"]) == 2
    assert found["poses"] == 3 * 7
    np.testing.assert_allclose(np.diag(found["covariance"]) ** 0.5, [each["standard_error"] for each in found["free"]])
    assert found["units"]["masses"] == "kg"
    assert {each["file"] for each in found["trials"]} == {Path(path).name for path in trials}


def test_what_is_held_is_told_and_where_a_number_starts_does_not_matter(result, trials):
    fixed = ("--no-profiles", "--folds", "0", "--hold", "youngs_modulus=68 GPa, base_tilt_y=0.1deg")
    near = result("identify", *trials, "--free", "tip_mass", *fixed)
    far = result("identify", *trials, "--free", "tip_mass", *fixed, "--start", "tip_mass=1.5")
    assert near["given"] == ["youngs_modulus", "base_tilt_y"]
    assert near["bench"]["base_tilt_y"] == pytest.approx(np.radians(0.1))
    assert near["robot_numbers"]["youngs_modulus"] == pytest.approx(68e9)
    assert far["free"][0]["start"] == pytest.approx(1.5e-3)
    assert far["free"][0]["value"] == pytest.approx(
        near["free"][0]["value"], abs=0.02 * near["free"][0]["standard_error"]
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--free = missing: must be names of numbers to identify"),
        (("--free", "tip_mas"), "did you mean tip_mass?"),
        (("--free", "tip_mass,tip_mass"), "--free = 'tip_mass': must be given once"),
        (("--free", "base_tilt,base_tilt_x"), "--free = 'base_tilt_x': must be given once"),
        (("--free", "displacement_zero"), "--free = displacement_zero: must be left out: the data do not depend on it"),
        (("--free", "torsion_factor", "--torsion", "published"), "only homogenized has"),
        (("--free", "tip_mass", "--hold", "tip_mass=1"), "--hold = tip_mass: must be a number that is not in --free"),
        (("--free", "tip_mass", "--start", "base_x=1"), "--start = base_x: must be a number that is in --free"),
        (("--free", "tip_mass", "--start", "tip_mass=1mm"), "--start tip_mass = 1mm: must be a number in g"),
        (("--free", "tip_mass", "--start", "tip_mass"), "--start = tip_mass: must be NAME=VALUE"),
        (("--free", "tip_mass", "--start", "tip_mass=-1"), "--start tip_mass = -1: must be >= 0"),
        (("--free", "tip_mass", "--hold", "no=1"), "--hold = no: must be a number of the bench"),
        (("--free", "tip_mass", "--loss", "l1"), "--loss = 'l1': must be one of huber, squares"),
        (("--free", "tip_mass", "--folds", "1"), "--folds = 1: must be 0 for none, or a whole number from 2 to 7"),
    ],
)
def test_refusals_by_name(refused, trials, options, said):
    assert said in refused("identify", trials[-1], *options)


def test_trials_are_needed(refused, tmp_path):
    assert refused("identify", *FREE).startswith("TRIAL = missing: must be given")
    assert "no.nc" in refused("identify", tmp_path / "no.nc", *FREE)


def test_names_are_listed_with_units_and_values(run, trials):
    status, out, _ = run("identify", "--names")
    assert status == 0
    assert all(name in out for name in (*MEANINGS, *GROUPS))
    _, out, _ = run("identify", "--names", trials[0])
    assert re.search(r"youngs_modulus +75 +GPa", out)
    _, out, _ = run("identify", "--names", "--robot", "exonav-4")
    assert "Of the robot, exonav-4" in out


def test_the_documentation_has_every_name():
    text = (DOCS / "identification.rst").read_text()
    assert all(f"`{name}`" in text for name in (*MEANINGS, *GROUPS))


def test_an_interrupt_after_the_fit_keeps_it(run, trials, tmp_path, monkeypatch):
    """The interrupt comes as the second profile begins."""
    import tendonrod.cli.output

    class Interrupting:
        def watch(self, done, total, what=None):
            if what == "profile of tip_mass":
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.01)

    monkeypatch.setattr(tendonrod.cli.output, "_Lines", lambda what: Interrupting())
    status, out, err = run("identify", *trials, *FREE, "--output", tmp_path)
    assert status == 130
    assert re.search(r"youngs_modulus +75\.\d* .* to .* to ", out)
    assert re.search(r"tip_mass .* to .* not computed +g", out)
    assert err.splitlines()[-2:] == [
        f"tendonrod: stopped after the fit, with 1 of 2 profiles; what is done is in {tmp_path}",
        "tendonrod: interrupted",
    ]
    record = json.loads((tmp_path / "fit.json").read_text())
    assert [each["name"] for each in record["profiles"]] == ["youngs_modulus"]
    assert record["cross_validation"] is None
    assert load_robot(tmp_path / "fitted-exonav-1.toml").parameters() == record["robot_numbers"]
    assert (tmp_path / "index.html").is_file()
    assert not [each for each in tmp_path.iterdir() if each.name.startswith(".")]
