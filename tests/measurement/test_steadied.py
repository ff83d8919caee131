"""Readings steadied: noise does not turn, programmes do, and what is steady stays as it is."""

import numpy as np
import pytest

from tendonrod.measurement.steadied import steadied

RAMPS = np.concatenate([np.linspace(0.05, 0.7, 100), np.linspace(0.69, 0.05, 99), np.linspace(0.06, 0.4, 50)])
NOISE = 5e-3


@pytest.mark.parametrize("stated", [NOISE, None])
def test_noise_turns_nowhere_and_is_nearer_to_the_truth_after(stated):
    noisy = RAMPS + NOISE * np.random.default_rng(0).normal(size=RAMPS.size)
    found = steadied(noisy, stated)
    way = np.sign(np.diff(found))
    assert np.count_nonzero(np.diff(way[way != 0])) == 2
    assert np.abs(found - RAMPS).mean() < 0.9 * np.abs(noisy - RAMPS).mean()
    assert abs((found - RAMPS).mean()) < 1e-3


def test_what_is_steady_or_unknown_stays():
    np.testing.assert_array_equal(steadied(RAMPS), RAMPS)
    np.testing.assert_array_equal(steadied(RAMPS[:2], NOISE), RAMPS[:2])
    gaps = np.where(np.arange(RAMPS.size) % 7 == 3, np.nan, RAMPS)
    np.testing.assert_array_equal(steadied(gaps, NOISE), gaps)
    assert np.isnan(steadied(np.full(5, np.nan), NOISE)).all()
