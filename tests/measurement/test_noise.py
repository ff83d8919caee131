"""Errors of virtual instruments: of the size that is stated, each with draws of its own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tendonrod import InvalidInput, load_robot
from tendonrod.measurement.bench import Experiment
from tendonrod.measurement.experiment import measured, run, simulate
from tendonrod.measurement.noise import Noise, dropped
from tendonrod.measurement.registration import world_poses
from tendonrod.measurement.trial import MISSING_POSE, REPEATED_TIME
from tendonrod.rotation import log_so3

ROBOT = load_robot("exonav-3").replace(torsion="homogenized")


def still(n: int, noise: Noise, **more) -> tuple:
    """(truth, trial) of one tracker that sits on the base for n frames."""
    bench = Experiment(robot=ROBOT, samples=2, cycles=0, places=(1.0,), base_frames=n, noise=noise, **more)
    true = simulate(bench)
    return true[0], measured(bench, true, 7)[0]


def is_standard(errors: np.ndarray) -> bool:
    """Whether Gaussian errors of mean 0 and variance 1 would scatter so; wrong once in a million."""
    square, n = float((errors**2).sum()), errors.size
    low, high = chi2.isf([1.0 - 5e-7, 5e-7], n)
    return bool(low < square < high) and abs(errors.mean()) < 5.0 / np.sqrt(n)


def test_one_kind_of_error_does_not_change_the_draws_of_another():
    bench = Experiment(robot=ROBOT, samples=20)
    true = simulate(bench)
    plain = measured(bench, true, 3)[-1]
    errors = Noise(dropouts=0.3, outliers=0.2, tension=0.1)
    noisy = measured(replace(bench, noise=errors), true, 3)[-1]
    far = np.linalg.norm(noisy.position - plain.position, axis=-1)
    there = noisy.kept
    np.testing.assert_allclose(far[there & (far > 0)], Noise.outlier_size, rtol=1e-9)
    assert 0 < (there & (far == 0)).sum() < there.size
    np.testing.assert_array_equal(noisy.turned[there], plain.turned[there])
    louder, quieter = (np.subtract(each.tensions, true[-1].tensions) for each in (noisy, plain))
    np.testing.assert_allclose(louder, 20.0 * quieter)


def test_more_samples_and_more_places_leave_the_draws_of_the_first():
    few = Experiment(robot=ROBOT, tensions=(0.1, 0.2, 0.3), places=(0.5,))
    many = Experiment(robot=ROBOT, tensions=(0.1, 0.2, 0.3, 0.4, 0.5), places=(0.5, 1.0))
    for one, other in zip(run(few, 1), run(many, 1), strict=False):
        n = min(one.time.size, other.time.size)
        for name in ("time", "position", "orientation", "quality", "tensions"):
            np.testing.assert_array_equal(getattr(one, name)[:n], getattr(other, name)[:n])


def test_noise_has_the_size_that_the_trial_states():
    true, trial = still(20_000, Noise(tension=7e-3))
    position, rotation = world_poses(trial)
    assert is_standard((position - true.position) / trial.position_noise)
    turns = log_so3(np.swapaxes(true.turned, -1, -2) @ rotation)
    assert is_standard(turns / trial.orientation_noise)
    assert is_standard((trial.tensions - true.tensions) / trial.tension_noise)
    together = np.corrcoef(np.concatenate([position - true.position, turns], axis=2)[:, 0].T)
    assert np.abs(together - np.eye(6)).max() < 5.0 / np.sqrt(20_000)


@pytest.mark.parametrize("correlation", [0.0, 0.7, 1.0])
def test_quality_tells_of_the_error_as_much_as_it_is_said_to(correlation):
    true, trial = still(20_000, Noise(quality_correlation=correlation))
    error = np.linalg.norm(world_poses(trial)[0] - true.position, axis=-1)[:, 0]
    seen = np.corrcoef(error**2, trial.quality[:, 0] ** 2)[0, 1]
    assert seen == pytest.approx(correlation**2, abs=5.0 / np.sqrt(20_000))
    assert np.mean(trial.quality**2) == pytest.approx(trial.position_noise**2, rel=0.05)


def test_shares_of_missing_repeated_and_far_frames():
    n, noise = 20_000, Noise(dropouts=0.1, burst=5.0, outliers=0.03, repeats=0.04)
    true, trial = still(n, noise)
    counts = trial.counts()["base"]
    missing = sum(count for fate, count in counts.items() if fate.startswith(MISSING_POSE))
    effective = n / (2.0 * noise.burst)  # frames of a burst go together
    assert missing / n == pytest.approx(0.1, abs=5.0 * np.sqrt(0.1 * 0.9 / effective))
    repeated = counts[REPEATED_TIME] / 0.9
    assert repeated / n == pytest.approx(0.04, abs=5.0 * np.sqrt(0.04 / n))
    far = np.linalg.norm(world_poses(trial)[0] - true.position, axis=-1)[trial.kept] > 0.5 * noise.outlier_size
    assert far.mean() == pytest.approx(0.03, abs=5.0 * np.sqrt(0.03 / n))
    assert (trial.state[np.isnan(trial.position[..., 0])] == "MISSING").all()


def test_dropouts_come_in_bursts_of_the_mean_length():
    gone = dropped(Noise(dropouts=0.2, burst=6.0), 200_000, np.random.default_rng(1))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], gone, [False]]).astype(int)))
    lengths = edges[1::2] - edges[::2]
    assert lengths.mean() == pytest.approx(6.0, abs=5.0 * 6.0 / np.sqrt(lengths.size))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"dropouts": 1.0}, "dropouts"),
        ({"dropouts": 0.9, "burst": 2.0}, "burst"),
        ({"position": -1.0}, "position"),
        ({"tension_scale": 0.0}, "tension_scale"),
        ({"quality_correlation": 1.1}, "quality_correlation"),
    ],
)
def test_bad_noise_is_refused_by_name(changes, field):
    with pytest.raises(InvalidInput) as error:
        Noise(**changes)
    assert error.value.field == field
