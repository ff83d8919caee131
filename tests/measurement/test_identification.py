"""Identification: the truth comes back, bad data are dealt with and told, and the covariance is that of theory."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from measurement.known_bench import GRAVITY, NOISE, READING_NOISE, ROBOT, along, blank, motion, seen
from tendonrod import InvalidInput, NotConverged
from tendonrod.measurement.identification import identify
from tendonrod.measurement.prediction import predict
from tendonrod.measurement.setup import Setup
from tendonrod.measurement.trial import BASE, KEPT, MISSING_POSE, REPEATED_TIME, Tracker, Trial
from tendonrod.rotation import exp_so3

HOLDER = {"offset": (1e-3, 2e-3, 0.0), "turn": (0.1, 0.2, 0.3)}
TRIALS = (blank(np.linspace(0.1, 0.7, 20), along([0.4, 0.7, 1.0], **HOLDER)),)
FREE = ("youngs_modulus", "base_tilt_x", "base_tilt_y", "tip_mass")
TRUTH = Setup(robot=ROBOT.replace(youngs_modulus=62e9), base_tilt_x=0.2, base_tilt_y=-0.15, tip_mass=3e-4)
VALUES = np.array([TRUTH.value(name, TRIALS) for name in FREE])
FEW = FREE[:3]
TENSIONS = np.linspace(0.1, 0.8, 12)
LIGHT = replace(TRUTH, tip_mass=0.0)


@pytest.fixture(scope="module")
def noisy():
    return seen(TRIALS, TRUTH, seed=3)


@pytest.fixture(scope="module")
def fit(noisy):
    return identify(noisy, FREE)


def in_errors(fit, values) -> np.ndarray:
    return (fit.values - values) / fit.standard_errors


def test_data_without_noise_give_the_truth_back_from_afar():
    """A sixth off in stiffness, 14 degrees in tilt; the trials' five tensions are solved, not interpolated."""
    trial = blank(np.linspace(0.1, 0.7, 5), along([0.4, 0.7, 1.0], **HOLDER))
    found = identify(seen([trial], TRUTH), FREE)
    np.testing.assert_allclose(found.values[:3], VALUES[:3], rtol=1e-6)
    np.testing.assert_allclose(found["tip_mass"], VALUES[3], rtol=1e-5)  # where 0.5 mm of noise leave 7 %
    assert found.rmse < 1e-7 < 5e-3 < found.rmse_before
    assert found.scale < 1e-3
    assert found.used.all()


def test_a_number_that_the_start_hardly_feels_does_not_run_away():
    """Torsion: no tilt, no torque. Steps that take it to nothing once ended there, 1.8 times the noise away."""
    trial = blank(np.linspace(0.1, 0.7, 7), along([0.4, 0.7, 1.0], **HOLDER))
    truth = {"youngs_modulus": 55e9, "torsion_factor": 1.6, "base_tilt_x": 0.3, "base_tilt_y": -0.2, "tip_mass": 5e-4}
    truth["base_z"] = 2e-3
    found = identify(seen([trial], Setup().changed(truth, [trial])), tuple(truth))
    np.testing.assert_allclose(found.values, list(truth.values()), rtol=1e-5)


@pytest.mark.parametrize(
    ("free", "truth"),
    [
        (("torsion_factor", "base_x", "base_z"), {"base_x": 2e-3, "base_z": -1e-3, "torsion_factor": 1.3}),
        (("holder_x", "holder_y", "base_roll"), {"holder_x": 1e-3, "holder_y": -5e-4, "base_roll": 0.3}),
        (("tension_scale", "tension_zero"), {"tension_scale": 1.2, "tension_zero": 0.05}),
        (("tracker_mass", "gravity_tilt_y"), {"tracker_mass": 2e-4, "gravity_tilt_y": 0.2}),
    ],
)
def test_other_numbers_come_back_too(free, truth):
    trial = blank(np.linspace(0.1, 0.7, 5), along([0.4, 0.7, 1.0], **HOLDER))
    setup = Setup().changed(truth, [trial])
    start = Setup(base_tilt_x=0.1) if "torsion_factor" in free else Setup()
    setup = replace(setup, base_tilt_x=start.base_tilt_x)
    found = identify(seen([trial], setup), free, setup=start)
    np.testing.assert_allclose(found.values, [truth[name] for name in free], rtol=1e-5)


def test_a_pulled_lengths_zero_and_a_tendons_friction_come_back():
    pulled = ROBOT.replace(tendons=(replace(ROBOT.tendons[0], axial_stiffness=600.0, free_length=0.3),))
    trial = blank(np.full(4, np.nan), robot=pulled, displacements=np.linspace(1e-3, 3e-3, 4))
    found = identify(seen([trial], Setup(displacement_zero=4e-4)), ["displacement_zero"])
    assert found["displacement_zero"] == pytest.approx(4e-4, rel=1e-5)
    rubbing = blank([0.2, 0.6, 0.4, 0.2], robot=ROBOT.replace(tendon_friction=0.02))
    found = identify(seen([rubbing], Setup(robot=ROBOT.replace(tendon_friction=0.1))), ["tendon_friction"])
    assert found["tendon_friction"] == pytest.approx(0.1, rel=1e-3)


def test_noisy_data_give_the_truth_within_its_errors_and_the_noise_its_size(fit):
    assert np.abs(in_errors(fit, VALUES)).max() < 3.5
    assert fit.scale == pytest.approx(1.0, abs=0.25)
    assert fit.rmse == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.3)
    assert fit.rmse < 0.3 * fit.rmse_before
    assert not fit.outliers.size


def test_missing_frames_an_outlier_and_a_repeated_time_are_dealt_with_and_told(noisy, fit):
    (trial,), rng = noisy, np.random.default_rng(1)
    position, time = trial.position.copy(), trial.time.copy()
    position[rng.random(position.shape[:2]) < 0.3] = np.nan
    position[7, 2] = trial.position[7, 2] + (0.0, 0.0, 20e-3)
    time[12] = time[11]
    bad = replace(trial, position=position, time=time)
    found = identify([bad], FREE)
    fates = Counter(bad.fates.ravel().tolist())
    assert fates[MISSING_POSE] == np.isnan(position[..., 0]).sum()
    assert fates[REPEATED_TIME] == np.isfinite(position[12, :, 0]).sum() > 0
    assert len(found.where) == fates[KEPT]
    assert found.outliers.tolist() == [[0, 7, 2]]
    (said,) = [each for each in found.sentences if "outlier" in each]
    assert said.startswith(f"1 of {fates[KEPT]} poses was left out as outlier, the furthest ")
    assert said.endswith("a, sample 8, tracker s100")
    assert found.distance[~found.used][0] == pytest.approx(20e-3, abs=3e-3)
    assert np.abs(in_errors(found, VALUES)).max() < 3.5
    assert np.abs(in_errors(found, fit.values)).max() < 2.5  # the data that they share are most of both
    squares = identify([bad], FREE, loss="squares")
    shift = np.abs(squares.values - fit.values) / fit.standard_errors
    assert shift.max() > 2.0 * np.abs((found.values - fit.values) / fit.standard_errors).max()
    assert squares.scale > 1.5


def test_orientations_make_it_surer(noisy, fit):
    found = identify(noisy, FREE, orientations=True)
    assert (found.standard_errors < 0.9 * fit.standard_errors).all()
    assert np.abs(in_errors(found, VALUES)).max() < 3.5
    assert found.scale == pytest.approx(1.0, abs=0.2)


def covariance(trials, setup, names, noise=NOISE) -> np.ndarray:
    """(J^T C^-1 J)^-1 with one block of C for all trackers of a sample; every pose counts."""
    found, information = predict(trials, setup, names), np.zeros((len(names), len(names)))
    for trial, columns, slope in zip(trials, found.columns, found.slope, strict=True):
        for row in range(trial.time.size):
            X, G = columns[row, :, :3].reshape(-1, len(names)), slope[row, :, :3].reshape(-1, 1)
            C = noise**2 * np.eye(len(X)) + (trial.tension_noise or 0.0) ** 2 * G @ G.T
            information += X.T @ np.linalg.solve(C, X)
    return np.linalg.inv(information)


@pytest.mark.parametrize("loss", ["squares", "huber"])
def test_covariance_is_the_inverse_of_the_information_times_the_errors_found(noisy, loss):
    found = identify(noisy, FREE, loss=loss)
    direct = covariance(found.trials, found.setup, FREE)
    factor = found.covariance / direct
    np.testing.assert_allclose(factor, factor[0, 0], rtol=1e-3)
    n, m = 3 * len(found.where), len(FREE)
    if loss == "squares":
        assert factor[0, 0] == pytest.approx(found.scale**2 * n / (n - m), rel=1e-3)
    else:
        squares = identify(noisy, FREE, loss="squares")
        assert factor[0, 0] == pytest.approx(squares.scale**2 * n / (n - m), rel=0.05)  # nearly all weights are 1


def test_least_squares_are_those_of_plain_gauss_newton():
    """An independent way: normal equations of all errors by `predict`, no weights, no noise of the tension."""
    trials = tuple(replace(each, tension_noise=None) for each in seen(TRIALS, LIGHT, seed=4))
    values = np.array([ROBOT.parameters()["youngs_modulus"], 0.0, 0.0])
    for _ in range(12):
        at = predict(trials, Setup().changed(dict(zip(FEW, values.tolist(), strict=True)), trials), FEW)
        e = (trials[0].position - at.position[0]).ravel()
        X = at.columns[0][:, :, :3].reshape(e.size, -1) * [1e9, 1.0, 1.0]
        values = values + np.linalg.lstsq(X, e)[0] * [1e9, 1.0, 1.0]
    found = identify(trials, FEW, loss="squares")
    assert np.abs(in_errors(found, values)).max() < 2e-2
    robust = identify(trials, FEW)
    assert np.abs(in_errors(robust, values)).max() < 0.5  # 2 % of clean poses count for less
    assert found.weights.min() == 1.0 > robust.weights.min() > 0.0


def test_noise_that_is_not_stated_is_told_from_the_errors():
    trials = seen(TRIALS, LIGHT, seed=4)
    stated = identify(trials, FEW)
    silent = identify([replace(each, position_noise=None) for each in trials], FEW)
    assert silent.noise[0][0, 0] == pytest.approx(NOISE, rel=0.25)
    assert np.abs(in_errors(silent, stated.values)).max() < 0.5
    np.testing.assert_allclose(silent.standard_errors, stated.standard_errors, rtol=0.2)


def test_noise_that_is_stated_wrongly_is_told_by_the_scale():
    trials = [replace(each, position_noise=0.5 * NOISE, tension_noise=0.5 * READING_NOISE) for each in
              seen(TRIALS, LIGHT, seed=4)]  # fmt: skip
    found = identify(trials, FEW)
    assert found.scale == pytest.approx(2.0, rel=0.25)
    assert any("times the noise that the trials state" in each for each in found.sentences)


def test_a_mass_ends_at_nothing_where_the_robot_weighs_less_than_believed():
    light = Setup(robot=ROBOT.replace(density=0.5 * ROBOT.parameters()["density"]))
    found = identify(seen(TRIALS, light, seed=5), ["tip_mass", "youngs_modulus"])
    assert found["tip_mass"] == pytest.approx(0.0, abs=1e-9)
    assert any(each.startswith("tip_mass ended at the smallest value there is, 0 g") for each in found.sentences)


def test_turning_the_world_with_its_gravity_and_moving_the_field_change_nothing():
    (trial,) = seen(TRIALS, replace(LIGHT, base_tilt_x=0.0, base_tilt_y=0.0), seed=6)
    free, Q = ("youngs_modulus", "tension_zero"), exp_so3(np.array([0.4, -1.0, 0.7]))
    found = identify([trial], free)
    field = motion((1.0, 0.2, -0.4), (0.3, 0.2, -0.1))
    to_world = motion((0.4, -1.0, 0.7), (0.01, 0.02, -0.03)) @ np.linalg.inv(field)
    seen_there = (trial.position @ Q.T + (0.01, 0.02, -0.03) - to_world[:3, 3]) @ to_world[:3, :3]
    moved = replace(trial, position=seen_there, orientation=None, T_world_field=to_world, gravity=tuple(Q @ GRAVITY))
    start = Setup(base_tilt_x=0.4, base_tilt_y=-1.0, base_roll=0.7, base_x=0.01, base_y=0.02, base_z=-0.03)
    other = identify([moved], free, setup=start)
    np.testing.assert_allclose(other.values, found.values, rtol=1e-5)
    np.testing.assert_allclose(other.standard_errors, found.standard_errors, rtol=1e-4)
    np.testing.assert_allclose(other.errors, found.errors @ Q.T, atol=1e-7)


def test_trials_without_a_world_are_registered_on_their_base():
    field = motion((1.0, 0.2, -0.4), (0.3, 0.2, -0.1))
    base = blank(np.zeros(5), [Tracker(name="base", on=BASE, **HOLDER)], name="base", T_world_field=field)
    (moving,) = seen([replace(TRIALS[0], T_world_field=field)], LIGHT)
    arm, turn = np.array(HOLDER["offset"]), exp_so3(np.array(HOLDER["turn"]))
    R, p = field[:3, :3], field[:3, 3]
    from scipy.spatial.transform import Rotation

    quaternion = Rotation.from_matrix(R.T @ turn).as_quat(scalar_first=True)
    base = replace(
        base, position=np.tile((arm - p) @ R, (5, 1, 1)), orientation=np.tile(quaternion, (5, 1, 1)), T_world_field=None
    )
    found = identify([base, replace(moving, T_world_field=None)], FEW)
    np.testing.assert_allclose(found.values, VALUES[:3], rtol=1e-4)
    assert (found.where[:, 0] == 1).all()
    assert found.trials[1].origin["registration"].startswith("tracker base on the base: 5 samples")


def test_a_fit_is_read_by_name(fit):
    assert fit.names == FREE
    assert fit["tip_mass"] == fit.values[3] == fit.setup.tip_mass
    assert fit.setup.robot.parameters()["youngs_modulus"] == pytest.approx(fit["youngs_modulus"])
    np.testing.assert_allclose(fit.high - fit.low, 2.0 * fit.quantile * fit.standard_errors)
    assert fit.quantile == pytest.approx(1.96, abs=0.02)
    np.testing.assert_allclose(np.diag(fit.correlation), 1.0)
    assert repr(fit).startswith("Fit(youngs_modulus = ")
    assert " GPa ± " in repr(fit)
    assert not fit.values.flags.writeable
    with pytest.raises(InvalidInput, match="name = 'density': must be one of youngs_modulus, base_tilt_x"):
        fit["density"]


def test_a_watcher_is_told_of_every_evaluation(noisy):
    told = []
    found = identify(noisy, FEW, setup=Setup(tip_mass=3e-4), watch=lambda *each: told.append(each))
    assert len(told) == found.evaluations
    assert all(a[0] < b[0] < b[1] for a, b in pairwise(told))
    assert told[0][2].startswith("evaluation 1, median ")


@pytest.mark.parametrize(
    ("trials", "more", "said"),
    [
        ((), {}, "trials = (): must be one or more Trial"),
        ("trial.nc", {}, "trials = 'trial.nc': must be one or more Trial"),
        (TRIALS, {"loss": "cauchy"}, "loss = 'cauchy': must be one of huber, squares"),
        (TRIALS, {"free": ("stiffness",)}, "free = 'stiffness': must be one of base_x"),
        (TRIALS, {"free": ()}, "free = (): must be one or more names"),
        (TRIALS, {"orientations": True}, "orientations = True: must be False"),
        ((replace(TRIALS[0], position=np.full((20, 3, 3), np.nan)),), {}, "trials = ['a']: must be with one or more"),
    ],
)
def test_bad_input_is_named(trials, more, said):
    with pytest.raises(InvalidInput) as error:
        identify(trials, **({"free": FEW} | more))
    assert str(error.value).startswith(said)


def test_a_start_without_an_equilibrium_is_said(noisy):
    with pytest.raises(NotConverged):
        identify(noisy, FEW, setup=Setup(robot=ROBOT.replace(youngs_modulus=1e8), tip_mass=1.0))


def hanging(seed, m):
    """A bench whose world hangs on m noisy frames of the base tracker, and the same one tracker at the tip."""
    motion = np.random.default_rng(seed)
    base = Tracker(name="base", on="base", turn=(0.0, 0.0, 0.0))
    turns = Rotation.from_rotvec(0.01 * motion.normal(size=(m, 3))).as_quat(scalar_first=True)
    shown = Trial(
        name="base", robot=ROBOT, trackers=(base,), time=np.arange(float(m)), gravity=GRAVITY,
        position=0.5e-3 * motion.normal(size=(m, 1, 3)), orientation=turns[:, None],
    )  # fmt: skip
    return [shown, *(replace(each, T_world_field=None) for each in seen([blank(TENSIONS, along([1.0]))], TRUTH, seed))]


def test_intervals_know_how_well_the_world_is_known():
    """What hangs on the base tracker is off by the same motion everywhere; more samples do not help against that."""
    start = replace(TRUTH, tip_mass=1e-4)
    found = [identify(hanging(seed, 6), ["tip_mass"], setup=start) for seed in range(30)]
    off = [(each["tip_mass"] - TRUTH.tip_mass) / each.standard_errors[0] for each in found]
    assert 0.6 < np.std(off) < 1.5  # without, three times as much
    many = identify(hanging(0, 400), ["tip_mass"], setup=start)
    assert many.standard_errors[0] < 0.5 * found[0].standard_errors[0]


def test_what_the_base_tracker_sees_counts_where_it_is_asked_to():
    base = Tracker(name="base", on="base", turn=(0.0, 0.0, 0.0))
    m, rng = 40, np.random.default_rng(3)
    lean = exp_so3(np.array([TRUTH.base_tilt_x, TRUTH.base_tilt_y, 0.0]))
    seen_turn = lean @ exp_so3(0.005 * rng.normal(size=(m, 3)))
    shown = Trial(
        name="base", robot=ROBOT, trackers=(base,), time=np.arange(float(m)), gravity=GRAVITY, T_world_field=np.eye(4),
        position=0.5e-3 * rng.normal(size=(m, 1, 3)),
        orientation=Rotation.from_matrix(seen_turn).as_quat(scalar_first=True)[:, None],
    )  # fmt: skip
    trials = [shown, *seen([blank(TENSIONS, along([1.0]))], TRUTH, 3)]
    free = ["base_tilt_x", "base_tilt_y", "tip_mass"]
    without, with_it = (identify(trials, free, base_tracker=use) for use in (False, True))
    assert with_it.standard_errors[2] < 0.5 * without.standard_errors[2]
    assert (
        np.abs(
            (with_it.values - [TRUTH.base_tilt_x, TRUTH.base_tilt_y, TRUTH.tip_mass]) / with_it.standard_errors
        ).max()
        < 4
    )
    assert any("sees the exit turned" in each for each in without.sentences)
    assert not any("sees the exit turned" in each for each in with_it.sentences)
    with pytest.raises(InvalidInput, match="base_tracker"):
        identify(trials[1:], free, base_tracker=True)
