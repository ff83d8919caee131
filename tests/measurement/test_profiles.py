"""Profiles: quadratic where the model is nearly linear, and at the ends of the interval as much worse as they say."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import ROBOT, along, blank, seen
from tendonrod import InvalidInput
from tendonrod.measurement.identification import identify
from tendonrod.measurement.profiles import REACH, profile
from tendonrod.measurement.setup import Setup

TRIALS = (blank(np.linspace(0.1, 0.7, 7), along([0.4, 0.7, 1.0])),)
FREE = ("youngs_modulus", "base_tilt_x", "base_tilt_y", "base_x")
TRUTH = Setup(robot=ROBOT.replace(youngs_modulus=68e9), base_tilt_x=0.1, base_tilt_y=-0.05, base_x=1e-3)


@pytest.fixture(scope="module")
def fit():
    return identify(seen(TRIALS, TRUTH, seed=2), FREE)


@pytest.fixture(scope="module")
def profiles(fit):
    return {name: profile(fit, name) for name in FREE}


@pytest.mark.parametrize("name", FREE)
def test_where_the_model_is_nearly_linear_the_rise_is_the_square_of_the_distance(fit, profiles, name):
    found, i = profiles[name], fit.index(name)
    np.testing.assert_allclose(np.diff(found.values), fit.standard_errors[i])
    best = found.values[REACH.index(0.0)]
    assert abs(best - fit.values[i]) < 0.15 * fit.standard_errors[i]  # weights are all 1 here, Huber's in the fit
    np.testing.assert_allclose(np.sqrt(found.rise), np.abs(REACH), rtol=0.1, atol=1e-3)
    np.testing.assert_allclose([found.low, found.high], [fit.low[i], fit.high[i]], atol=0.15 * fit.standard_errors[i])


@pytest.mark.parametrize("name", FREE)
def test_the_others_adapt_as_their_correlation_says(fit, profiles, name):
    found, i = profiles[name], fit.index(name)
    np.testing.assert_array_equal(found.others[:, i], found.values)
    expected = fit.values + np.outer(found.values - fit.values[i], fit.covariance[i] / fit.covariance[i, i])
    assert (np.abs(found.others - expected) < 0.15 * fit.standard_errors).all()


@pytest.mark.parametrize("end", ["low", "high"])
def test_at_the_ends_of_the_interval_the_rise_is_the_quantile_squared(fit, profiles, end):
    """The number is held there and all others are fitted anew."""
    held, problem, weights = getattr(profiles["youngs_modulus"], end), fit.problem, fit.used.astype(float)
    z = fit.values / problem.unit
    _, least = problem.minimise(z, *fit.noise, weights)
    z[0] = held / problem.unit[0]
    _, squares = problem.minimise(z, *fit.noise, weights, held=0)
    X, _ = problem.misfit.slopes(problem.at(fit.values / problem.unit))
    white = problem.misfit.whitened(X, *fit.noise, weights)
    per = fit.covariance[0, 0] / np.linalg.inv(white.T @ white)[0, 0]
    assert (squares - least) / per == pytest.approx(fit.quantile**2, rel=0.05)


def test_a_side_that_a_bound_cuts_off_ends_there():
    trials = seen(TRIALS, replace(TRUTH, tip_mass=1e-5), seed=2)
    fit = identify(trials, ["tip_mass"], setup=replace(TRUTH, tip_mass=1e-5))
    found = profile(fit, "tip_mass")
    assert fit.low[0] == 0.0 == found.low < found.high
    assert found.values.min() > 0.0 or fit["tip_mass"] < 1e-9


def test_of_one_number_alone_the_rise_is_that_of_the_errors():
    fit = identify(seen(TRIALS, TRUTH, seed=3), ["youngs_modulus"], setup=TRUTH, loss="squares")
    found, (sigma, G) = profile(fit, "youngs_modulus"), fit.noise
    misfit, squares = fit.problem.misfit, []
    for value in found.values:
        e = misfit.errors(fit.problem.at(np.array([value]) / fit.problem.unit))
        squares.append(np.sum(misfit.whitened(e[..., None], sigma, G, fit.weights) ** 2))
    n = 3 * len(fit.where)
    expected = (np.array(squares) - min(squares)) / (fit.scale**2 * n / (n - 1))
    np.testing.assert_allclose(found.rise, expected, rtol=1e-2, atol=1e-3)


def test_another_name_is_refused(fit):
    with pytest.raises(InvalidInput, match="name = 'tip_mass': must be one of youngs_modulus, base_tilt_x"):
        profile(fit, "tip_mass")
