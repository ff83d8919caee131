"""`tendonrod experiment`: trials on file that say what they are, and what was true."""

import json

import numpy as np
import pytest

from tendonrod import load_robot
from tendonrod.measurement.csvfile import read_csv
from tendonrod.measurement.registration import body_positions
from tendonrod.measurement.trialfile import read_trial

NAMES = ["base", "s25", "s50", "s75", "s100"]


@pytest.mark.parametrize("kind", ["nc", "csv"])
def test_trials_on_file_are_those_that_it_prints(run, tmp_path, kind):
    options = ("--tilt-deg", "10", "--tip-mass-g", "0.5", "--seed", "1", "--samples", "4", "--format", kind)
    status, out, err = run("experiment", "exonav-3", *options, "--output", tmp_path / "new")
    assert status == 0, err
    assert "virtual, not a measurement" in out
    assert "torsion homogenized" in out
    for name in NAMES:
        path = tmp_path / "new" / f"exonav-3-{name}.{kind}"
        assert f"tendonrod: wrote {path}" in err
        assert path.name in out
        trial = read_trial(path) if kind == "nc" else read_csv(path, path.with_suffix(".toml"))
        assert "not a measurement" in trial.origin["made by"]
        assert trial.robot == load_robot("exonav-3").replace(torsion="homogenized")
        truth = json.loads(trial.origin["truth"])
        assert truth["tip_mass"] == 5e-4
        np.testing.assert_allclose(truth["base_tilt"], [0.0, np.radians(-10.0), 0.0])


def test_one_seed_one_file(run, tmp_path):
    for name in ("a", "b"):
        run("experiment", "exonav-3", "--seed", 3, "--samples", 3, "--format", "csv", "--output", tmp_path / name)
    one, other = (sorted((tmp_path / name).iterdir()) for name in ("a", "b"))
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in other]


@pytest.mark.parametrize("gravity", ["-9.81,0,0", "0,9.81,0", "3,-4,1"])
def test_one_angle_leans_the_tip_towards_gravity(result, gravity):
    told = result("experiment", "exonav-3", "--tilt-deg", "10", "--gravity", gravity, "--samples", 2, "--cycles", 0)
    from tendonrod.rotation import exp_so3

    axis = exp_so3(np.array(told["truth"]["base_tilt"]))[:, 2]
    side = np.array([float(each) for each in gravity.split(",")]) * [1, 1, 0]
    np.testing.assert_allclose(axis @ side / np.linalg.norm(side), np.sin(np.radians(10.0)))
    assert axis[2] == pytest.approx(np.cos(np.radians(10.0)))


def test_options_reach_the_bench(result):
    told = result(
        "experiment", "exonav-1", "--tilt-deg", "1,-2", "--base-offset-mm", "1,2,3", "--tracker-mass-g", "0.2",
        "--holder-error-mm", "0.1,0,0", "--friction", "0.1", "--youngs-modulus-gpa", "60", "--noise-mm", "0.2",
        "--noise-deg", "0.1", "--tension-noise-mN", "2", "--dropout", "0.9", "--outliers", "0.1", "--level", "base",
        "--protocol", "fixed", "--samples", "3", "--cycles", "2", "--tension-max", "0.4", "--tension-min", "0.1",
    )  # fmt: skip
    truth = told["truth"]
    np.testing.assert_allclose(truth["base_tilt"], np.radians([1.0, -2.0, 0.0]))
    assert truth["base_offset"] == pytest.approx([1e-3, 2e-3, 3e-3])
    assert truth["tracker_mass"] == pytest.approx(2e-4)
    assert (truth["robot"]["tendon_friction"], truth["robot"]["youngs_modulus"]) == (0.1, 60e9)
    assert truth["noise"]["position"] == pytest.approx(2e-4)
    assert truth["noise"]["tension"] == pytest.approx(2e-3)
    assert [(each["name"], each["samples"], each["file"]) for each in told["trials"]] == [("exonav-1-all", 9, None)]
    assert sum(told["trials"][0]["counts"]["s100"].values()) == 9


def test_without_noise_the_tip_is_that_of_the_command_shape(run, result, tmp_path):
    quiet = ("--noise-mm", 0, "--noise-deg", 0, "--tension-noise-mN", 0, "--samples", 2, "--cycles", 0)
    run("experiment", "exonav-1", *quiet, "--torsion", "published", "--output", tmp_path)
    trial = read_trial(tmp_path / "exonav-1-s100.nc")
    shape = result("shape", "exonav-1", "--tension", "0.7", "--gravity", "-9.81,0,0")
    np.testing.assert_allclose(body_positions(trial)[-1, 0], shape["centerline"][-1], atol=1e-7)


def test_it_draws(run, tmp_path):
    status, _, err = run("experiment", "exonav-3", "--samples", 3, "--figure", tmp_path / "x.svg", "--dropout", "0.2")
    assert status == 0, err
    assert (tmp_path / "x.svg").read_text().startswith("<?xml")


def test_a_robot_without_tendons_only_hangs(run, tmp_path):
    (tmp_path / "rod.toml").write_text(
        'name = "a rod/b"\n[rod]\nlength_mm = 100\nradius_mm = 0.3\n'
        "[material]\nyoungs_modulus_gpa = 75\nshear_modulus_gpa = 25\ndensity_kg_m3 = 6255\n"
    )
    options = ("--samples", 2, "--output", tmp_path, "--figure", tmp_path / "a.png")
    status, _, err = run("experiment", tmp_path / "rod.toml", *options)
    assert status == 0, err
    assert (tmp_path / "a_rod_b-s50.nc").exists()


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (("--format", "xls"), "--format = 'xls': must be one of nc, csv"),
        (("--protocol", "both"), "--protocol = 'both': must be one of movable, fixed"),
        (("--level", "x"), "--level = 'x': must be one of field, base, origin"),
        (("--seed", "-1"), "--seed = -1: must be a whole number from 0 to 9223372036854775807"),
        (("--tension-max", "0.01"), "--tension-max = 0.01: must be at least --tension-min, 0.05"),
        (("--dropout", "1"), "--dropout = 1.0: must be from 0 to 0.95"),
        (("--tilt-deg", "1,2,3"), "--tilt-deg = 1,2,3: must be one number, or two with a comma between them, degrees"),
        (("--tilt-deg", "x"), "--tilt-deg = 'x': must be a finite number"),
        (
            ("--tilt-deg", "5", "--gravity", "0,0,-9.81"),
            "--tilt-deg = 5: must be two numbers, about x and y, where gravity has no side",
        ),
        (("--noise-mm", "-1"), "--noise-mm = -1.0: must be >= 0"),
        (("--torsion", "soft"), "--torsion = 'soft': must be one of published, open_section, homogenized"),
    ],
)
def test_bad_options_are_refused_by_name(refused, options, line):
    assert refused("experiment", "exonav-1", *options) == line


def test_a_file_is_no_directory(refused, tmp_path):
    (tmp_path / "x").write_text("")
    assert refused("experiment", "exonav-1", "--output", tmp_path / "x").endswith("must be a directory, not a file")
