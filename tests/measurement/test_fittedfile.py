"""Files of a fit: they give back the robot and the bench that were fitted, and say where each number comes from."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from tendonrod import load_robot
from tendonrod.errors import InvalidInput
from tendonrod.loads import LumpedMass
from tendonrod.measurement.fitrecord import as_dict, write_record
from tendonrod.measurement.fittedfile import Provenance, checksums, file_key, fitted_robot, write_fitted
from tendonrod.measurement.identification import identify
from tendonrod.measurement.names import GROUPS, MEANINGS, expanded
from tendonrod.measurement.prediction import predict
from tendonrod.measurement.rounding import decimals, number, span, with_error
from tendonrod.measurement.setup import BENCH, Setup
from tendonrod.measurement.trial import Tracker, Trial
from tendonrod.measurement.unknowns import Unknown
from tendonrod.rotation import log_so3
from tendonrod.scenefile import read_scene
from tendonrod.statics.equilibrium import solve

ROBOT = load_robot("exonav-1").replace(torsion="homogenized")
SOFT = ROBOT.replace(youngs_modulus=68e9)
TRUTH = Setup(robot=SOFT, base_tilt_y=-0.07, base_x=1e-3, tip_mass=3e-4, tension_scale=1.05)
FREE = ("youngs_modulus", "base_x", "base_tilt_y", "tip_mass")
N = 6


def trials_of(setup: Setup, **changes) -> list[Trial]:
    """Two trials, of the middle and the tip, as ``setup`` predicts them, and noise."""
    places = (0.5 * ROBOT.length_na, None)
    blank = [_blank(k, at, **changes) for k, at in enumerate(places)]
    found, rng = predict(blank, setup), np.random.default_rng(3)
    noisy = (p + 1e-4 * rng.normal(size=p.shape) for p in found.position)
    return [replace(each, position=p) for each, p in zip(blank, noisy, strict=True)]


def _blank(k: int, at: float | None, **changes) -> Trial:
    values = {
        "name": f"trial {k}",
        "robot": ROBOT,
        "trackers": (Tracker(name="sensor", at=at),),
        "time": np.arange(N) / 40.0,
        "position": np.zeros((N, 1, 3)),
        "tensions": np.linspace(0.1, 0.7, N),
        "gravity": (-9.81, 0.0, 0.0),
        "T_world_field": np.eye(4),
        "position_noise": 1e-4,
    }
    return Trial(**(values | changes))


@pytest.fixture(scope="module")
def fit():
    start = Setup(tension_scale=TRUTH.tension_scale)
    return identify(trials_of(TRUTH), FREE, setup=start)


@pytest.fixture
def told(tmp_path):
    path = tmp_path / "bench.nc"
    path.write_bytes(b"abc")
    return Provenance(files=checksums([path, path]), given=("tension_scale",), date="2025-01-31")


def test_the_robot_file_gives_back_the_fitted_robot(fit, told, tmp_path):
    path, _ = write_fitted(fit, tmp_path, told)
    read = load_robot(path)
    assert path.name == "fitted-exonav-1.toml"
    assert read == fitted_robot(fit, told)
    assert read.sources == fitted_robot(fit, told).sources
    for name, value in fit.setup.robot.parameters().items():
        assert read.parameters()[name] == pytest.approx(value, rel=1e-15)
    assert read.torsion == "homogenized"


def test_a_source_says_how_sure_and_from_what(fit, told):
    sources = fitted_robot(fit, told).sources
    said = sources["material.youngs_modulus_gpa"]
    assert said.startswith(f"identified: {1e-9 * fit['youngs_modulus']:.2f}")
    assert " GPa (95 %: " in said
    assert "from 2 trials bench.nc, bench.nc (sha256 ba7816bf8f01, ba7816bf8f01), tendonrod " in said
    assert said.endswith(", 2025-01-31, free: youngs_modulus, base_x, base_tilt_y, tip_mass")
    untouched = {key: text for key, text in sources.items() if key != "material.youngs_modulus_gpa"}
    assert untouched == {key: text for key, text in load_robot("exonav-1").sources.items() if key in untouched}


def test_robot_and_scene_reproduce_the_predictions_of_the_fit(fit, told, tmp_path):
    robot_path, scene_path = write_fitted(fit, tmp_path, told)
    robot, scene = load_robot(robot_path), read_scene(scene_path)
    pose = scene.exit_pose
    assert pose is not None
    x, y, z = pose[:3, 3]
    turn = dict(zip(("base_tilt_x", "base_tilt_y", "base_roll"), log_so3(pose[:3, :3]), strict=True))
    (mass,) = scene.loads
    assert isinstance(mass, LumpedMass)
    scale = {"tension_scale": TRUTH.tension_scale}  # no file can say it
    read = Setup(robot=robot, base_x=x, base_y=y, base_z=z, tip_mass=mass.mass, **turn, **scale)
    for a, b in zip(predict(fit.trials, read).position, predict(fit.trials, fit.setup).position, strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-9)
    own = predict(fit.trials, fit.setup).position[1][-1, 0]
    tension = TRUTH.tension_scale * float(fit.trials[1].tensions[-1, 0])
    shape = solve(robot, tension, fit.trials[1].gravity, loads=scene.loads, exit_pose=pose, accuracy=1e-9)
    offset = robot.axis_offset(np.array([robot.length_na]))[0]
    np.testing.assert_allclose(shape.tip + shape.rotation[-1] @ [*offset, 0.0], own, rtol=0.0, atol=1e-6)


def test_what_no_file_can_say_is_in_its_comments(fit, told, tmp_path):
    robot, scene = (path.read_text() for path in write_fitted(fit, tmp_path, told))
    for text in (robot, scene):
        assert "# trial trial 0: bench.nc, sha256 ba7816bf8f01cfea" in text
        assert f"# identified: tip_mass = {1e3 * fit['tip_mass']:.2f}" in text
        assert "# given by hand: tension_scale = 1.05\n" in text
    assert f"# of the bench, not of the robot: base_tilt_y = {np.degrees(fit['base_tilt_y']):.6g} deg" in robot
    assert "# no scene can say: tension_scale = 1.05\n" in scene
    assert "--gravity -9.81,0,0 --scene fitted-scene.toml" in scene
    assert "base" not in scene.split("[exit]")[1]


def test_a_turned_gravity_is_in_the_command_and_masses_of_trackers_are_told(tmp_path):
    trials = [replace(each, trackers=(replace(each.trackers[0], mass=2e-4),)) for each in trials_of(Setup())]
    fit = identify(trials, ("tip_mass",), setup=Setup(gravity_tilt_y=0.1))
    _, scene = write_fitted(fit, tmp_path)
    x, _, z = fit.setup.gravity_of(fit.trials[0])
    assert f"--gravity {x:.9g},0,{z:.9g}" in scene.read_text()
    assert "# not in this scene: tracker sensor of trial 1, 0.2 g at " in scene.read_text()


def test_trials_of_several_robots_leave_a_scene_and_no_robot(tmp_path):
    first, second = trials_of(Setup(base_tilt_x=0.05))
    other = replace(second, robot=ROBOT.replace(name="another"))
    fit = identify([first, other], ("base_tilt_x",))
    assert [path.name for path in write_fitted(fit, tmp_path)] == ["fitted-scene.toml"]
    assert as_dict(fit)["robot"] is None


def test_a_mass_that_ended_at_zero_is_no_load(tmp_path):
    fit = identify(trials_of(Setup()), ("tip_mass",))
    _, scene = write_fitted(fit, tmp_path)
    loads = read_scene(scene).loads
    expected = (LumpedMass(mass=fit["tip_mass"]),) if fit["tip_mass"] > 0.0 else ()
    assert loads == expected


def test_the_record_has_everything_and_the_tables_agree_with_it(fit, told, tmp_path):
    write_record(fit, tmp_path, told)
    record = json.loads((tmp_path / "fit.json").read_text())
    assert record == json.loads(json.dumps(as_dict(fit, told)))
    for i, each in enumerate(record["free"]):
        assert each["name"] == FREE[i]
        assert each["value"] == fit.values[i]
        assert each["low"] < each["value"] < each["high"]
        assert each["profile_low"] is None
    assert record["bench"]["tension_scale"] == 1.05
    assert record["trials"][0]["sha256"].startswith("ba7816bf")
    rows = list(csv.DictReader((tmp_path / "residuals.csv").open()))
    assert len(rows) == record["poses"] == 2 * N
    errors = [[float(row[f"error_{x}_mm"]) for x in "xyz"] for row in rows]
    np.testing.assert_allclose(errors, 1e3 * fit.errors)
    distance = np.array([float(row["distance_mm"]) for row in rows])
    assert np.sqrt(np.mean(distance**2)) == pytest.approx(1e3 * record["rmse"])
    assert {row["tension_1_N"] for row in rows} == {repr(float(x)) for x in fit.trials[0].tensions[:, 0]}


def test_keys_of_a_vector_and_of_several_tendons():
    assert file_key(ROBOT, "tendon_friction") == "tendons[0].friction"
    rod = load_robot("exonav-1").replace(tendons=ROBOT.tendons * 2)
    assert file_key(rod, "tendon2_radius") == "tendons[1].radius_mm"


UNKNOWN = Unknown(name="e", start=75e9, plausible=3e10, low=0.0, high=np.inf, unit="GPa", per_si=1e-9)


@pytest.mark.parametrize(
    ("value", "error", "said"),
    [
        (68.419e9, 0.518e9, "68.42 ± 0.52 GPa"),
        (68.419e9, 12.3e9, "68 ± 12 GPa"),
        (68.419e9, 123.0e9, "68 ± 123 GPa"),
        (-1e5, 0.5e9, "0.00 ± 0.50 GPa"),
        (68.419e9, 0.0, "68.419 ± 0 GPa"),
    ],
)
def test_numbers_have_the_decimals_of_their_errors(value, error, said):
    assert with_error(UNKNOWN, value, error) == said
    assert number(UNKNOWN, value, error) == said.split(" ")[0]


def test_ends_that_are_not_known_are_question_marks():
    assert span(UNKNOWN, float("nan"), 70e9, 1e9) == "? to 70.0"
    assert decimals(float("nan")) is None


def test_every_name_of_the_bench_has_a_meaning_and_groups_are_names():
    assert tuple(MEANINGS) == BENCH
    assert all(name in BENCH for names in GROUPS.values() for name in names)


@pytest.mark.parametrize(
    ("gravities", "left"),
    [
        ([(-9.81, 0, 0), (9.81, 0, 0)], "yz"),
        ([(0, 0, 9.81), (0, 0, 9.81)], "xy"),
        ([(0, -9.0, 3.0), (0, -9.0, 3.0)], "xz"),
        ([(-9.81, 0, 0), (0, 9.81, 0)], "xyz"),
        ([(0, 0, 0), (0, 0, 0)], "xyz"),
    ],
)
def test_gravity_is_not_turned_about_itself(gravities, left):
    trials = [_blank(k, None, gravity=g) for k, g in enumerate(gravities)]
    assert expanded(("gravity_tilt",), trials, Setup()) == tuple(f"gravity_tilt_{x}" for x in left)


def test_names_are_refused_with_what_there_is():
    trials = trials_of(Setup())
    with pytest.raises(InvalidInput, match=r"bench \(base_x.*robot \(inner_radius.*did you mean youngs_modulus\?"):
        expanded(("youngs_modulu",), trials, Setup())
    published = Setup(robot=ROBOT.replace(torsion="published"))
    with pytest.raises(InvalidInput, match="torsion_factor: must be left out: the torsion model published"):
        expanded(("torsion_factor",), trials, published)
    assert expanded(("torsion_factor", "base_tilt"), trials, Setup()) == ("torsion_factor", *GROUPS["base_tilt"])


def test_a_file_that_cannot_be_read_has_no_checksum(tmp_path):
    with pytest.raises(InvalidInput, match=r"paths = '.*no\.nc': must be a readable file"):
        checksums([tmp_path / "no.nc"])
