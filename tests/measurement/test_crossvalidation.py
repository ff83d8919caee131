"""Cross-validation: every pose is predicted once, by a fit that has not seen it, and a little worse for that."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import ROBOT, along, blank, seen
from tendonrod import InvalidInput
from tendonrod.measurement.crossvalidation import cross_validate
from tendonrod.measurement.identification import identify
from tendonrod.measurement.prediction import predict
from tendonrod.measurement.setup import Setup

TRIALS = tuple(blank(np.linspace(0.1, 0.7, 6), along([share]), name=f"at {share}") for share in (0.4, 0.7, 1.0))
FREE = ("youngs_modulus", "base_tilt_x", "base_tilt_y", "base_x")
TRUTH = Setup(robot=ROBOT.replace(youngs_modulus=68e9), base_tilt_x=0.1, base_tilt_y=-0.05, base_x=1e-3)


@pytest.fixture(scope="module")
def fit():
    return identify(seen(TRIALS, TRUTH, seed=1), FREE)


@pytest.fixture(scope="module")
def found(fit):
    return cross_validate(fit)


def test_of_three_trials_each_is_held_out_once(fit, found):
    assert found.folds == ("at 0.4", "at 0.7", "at 1.0")
    np.testing.assert_array_equal(found.fold, fit.where[:, 0])
    assert found.notes == ("", "", "")
    assert np.isfinite(found.distance).all()


def test_a_fold_is_predicted_by_the_fit_to_all_others(fit, found):
    for k in range(3):
        others = [trial for i, trial in enumerate(fit.trials) if i != k]
        part = identify(others, FREE, setup=TRUTH)
        assert (np.abs(found.values[k] - part.values) < 0.05 * part.standard_errors).all()
        p = predict([fit.trials[k]], part.setup).position[0]
        direct = np.linalg.norm(fit.trials[k].position - p, axis=2)[:, 0]
        np.testing.assert_allclose(found.distance[found.fold == k], direct, atol=2e-5)
        assert found.rmse_by_fold[k] == pytest.approx(np.sqrt(np.mean(direct**2)), abs=2e-5)


def test_what_was_not_seen_is_predicted_worse_on_average():
    ratios = []
    for seed in range(5):
        fit = identify(seen(TRIALS, TRUTH, seed=seed), FREE, setup=TRUTH)
        ratios.append(cross_validate(fit, folds=3).rmse / fit.rmse)
    assert np.mean(ratios) > 1.0
    assert np.mean(ratios) < 2.0


def test_blocks_are_contiguous_shares_of_each_trial(fit):
    found = cross_validate(fit, folds=3)
    assert found.folds == ("block 1", "block 2", "block 3")
    for i in range(3):
        np.testing.assert_array_equal(found.fold[fit.where[:, 0] == i], [0, 0, 1, 1, 2, 2])


def test_of_fewer_trials_blocks_are_held_out():
    one = blank(np.linspace(0.1, 0.7, 10), along([0.5, 1.0]))
    fit = identify(seen([one], TRUTH, seed=1), FREE[:3], setup=TRUTH)
    found = cross_validate(fit)
    assert len(found.folds) == 5
    np.testing.assert_array_equal(found.fold, fit.where[:, 1] // 2)  # both trackers of a sample go together


def test_outliers_are_predicted_but_do_not_count(fit):
    position = fit.trials[2].position.copy()
    position[3] += (0.0, 20e-3, 0.0)
    spoilt = identify([*fit.trials[:2], replace(fit.trials[2], position=position)], FREE, setup=TRUTH)
    found = cross_validate(spoilt)
    assert found.used.sum() == found.distance.size - 1
    assert found.distance.max() > 15e-3 > 3.0 * found.rmse


def test_a_fold_that_cannot_be_missed_says_why(fit):
    """Only one trial has gravity: without it the mass is not told."""
    weightless = [replace(trial, gravity=(0.0, 0.0, 0.0)) for trial in TRIALS[:2]]
    trials = seen([*weightless, TRIALS[2]], replace(TRUTH, tip_mass=3e-4), seed=2)
    whole = identify(trials, ["youngs_modulus", "tip_mass"], setup=TRUTH)
    found = cross_validate(whole)
    assert found.notes[:2] == ("", "")
    assert "tip_mass: must be left out" in found.notes[2]
    assert np.isnan(found.values[2]).all()
    assert np.isnan(found.distance[found.fold == 2]).all()
    assert np.isfinite([found.rmse, *found.rmse_by_fold[:2]]).all()
    assert np.isnan(found.rmse_by_fold[2])


def test_a_watcher_is_told_before_each_fold(fit):
    told = []
    cross_validate(fit, folds=2, watch=lambda *each: told.append(each))
    assert told == [(0, 2, "held out: block 1"), (1, 2, "held out: block 2")]


@pytest.mark.parametrize("folds", [1, 19, 2.5, "all"])
def test_folds_are_two_or_more_and_no_more_than_samples(fit, folds):
    with pytest.raises(InvalidInput) as error:
        cross_validate(fit, folds=folds)
    assert error.value.field == "folds"
