"""Intervals hold the truth as often as they say: 20 seeds of the study of benchmarks/identification.py.

Were all as it should be, the number of seeds whose interval of one number holds the truth would be binomial (20, 0.95):
14 or fewer have a chance of 3.3e-4, any of five numbers then of at most 1.7e-3 (Bonferroni; the five go together). The
squared distances of the values from the truth, in the fit's own covariance, would sum to chi-squared with 100 degrees
of freedom, which sees intervals that are too wide as well; it is given 1e-3 on each side.
"""

import sys
from pathlib import Path
from time import thread_time

import numpy as np
import pytest
from scipy.stats import binom, chi2

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import identification as study  # pyright: ignore[reportMissingImports]

SEEDS, LEVEL = 20, 1e-3


@pytest.fixture(scope="module")
def outcomes():
    """Started at the truth, which saves half of the time; that a fit comes there from afar is tested elsewhere."""
    began = thread_time()
    found = [study.outcome(seed, study.TRUTH) for seed in range(SEEDS)]
    assert thread_time() - began < 40.0
    return found


def test_intervals_hold_the_truth_as_often_as_they_say(outcomes):
    m = len(study.FREE)
    least = int(binom.ppf(2.0 * LEVEL / m, SEEDS, 0.95))
    assert m * binom.cdf(least - 1, SEEDS, 0.95) <= 2.0 * LEVEL
    assert least == 15
    assert (np.sum([each.holds for each in outcomes], axis=0) >= least).all()


def test_the_covariance_is_neither_too_small_nor_too_large(outcomes):
    total, freedom = sum(each.distance2 for each in outcomes), SEEDS * len(study.FREE)
    assert chi2.ppf(LEVEL, freedom) < total < chi2.isf(LEVEL, freedom)


def test_the_scale_of_the_noise_is_one(outcomes):
    """The median of 120 distances scatters by 6 %, the mean of 20 by 1.4 %."""
    assert np.mean([each.scale for each in outcomes]) == pytest.approx(1.0, abs=0.05)


def test_standard_errors_reach_the_cramer_rao_bound(outcomes):
    """Huber's weights cost 1 %, and the bound is taken at the truth: within a few per cent."""
    least = np.sqrt(np.diag(study.bound()))
    found = np.sqrt(np.mean([each.errors**2 for each in outcomes], axis=0))
    np.testing.assert_allclose(found / least, 1.0, atol=0.12)


def test_from_what_is_believed_the_fit_comes_to_the_same_end(outcomes):
    far = study.outcome(0)
    assert (np.abs(far.values - outcomes[0].values) < 0.03 * outcomes[0].errors).all()
