"""Thinning: only some samples count, none is dropped, and all is said."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import ROBOT, along, blank
from measurement.trials import some_trial
from tendonrod import InvalidInput
from tendonrod.measurement.prediction import predict
from tendonrod.measurement.thinning import ordinal, shortened, thinned
from tendonrod.measurement.trial import KEPT, LEFT_OUT, SAMPLED
from tendonrod.measurement.trialfile import read_trial, write_trial


def used(trial):
    return np.flatnonzero((trial.kept & trial.on_robot).any(axis=1))


def test_every_third_used_sample_counts_from_the_first_on():
    trial = some_trial()
    found = thinned(trial, 3)
    np.testing.assert_array_equal(used(found), used(trial)[::3])
    changed = found.fates != trial.fates
    assert (trial.fates[changed] == KEPT).all()
    assert (found.fates[changed] == LEFT_OUT).all()
    for name in set(SAMPLED) - {"state"}:
        np.testing.assert_array_equal(getattr(found, name), getattr(trial, name))


def test_trackers_on_the_base_keep_all():
    trial = some_trial()
    np.testing.assert_array_equal(thinned(trial, 4).kept[:, 0], trial.kept[:, 0])
    assert (thinned(trial, 4).state[:, 0] == trial.state[:, 0]).all()


def test_every_one_changes_nothing():
    trial = some_trial()
    np.testing.assert_array_equal(thinned(trial, 1).fates, trial.fates)


def test_seconds_are_kept_between_samples_that_count():
    time = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.04, 200))
    rows = used(thinned(blank(np.linspace(0.1, 0.5, 200), time=time), seconds=0.1))
    apart = np.diff(time[rows])
    assert rows[0] == 0
    assert apart.min() >= 0.1
    assert apart.max() < 0.1 + 0.04


def test_a_pace_that_the_samples_have_leaves_all():
    trial = blank(np.linspace(0.1, 0.5, 50))  # 40 in a second
    assert used(thinned(trial, seconds=1.0 / 40.0)).size == 50


def test_what_is_left_out_is_still_on_file(tmp_path):
    found = thinned(some_trial(), 3)
    write_trial(found, tmp_path / "a.nc")
    again = read_trial(tmp_path / "a.nc")
    np.testing.assert_array_equal(again.fates, found.fates)
    assert again.counts() == found.counts()


def test_shortened_holds_the_same_used_samples_and_all_that_were_never_used():
    trial = replace(some_trial(), trackers=tuple(each for each in some_trial().trackers))
    found, thin = shortened(trial, 3), thinned(trial, 3)
    assert set(found.time.tolist()) >= set(trial.time[used(thin)].tolist())
    dropped = ~np.isin(trial.time, found.time)
    assert (thin.fates[dropped] != KEPT).all()
    robot_only = blank(np.linspace(0.1, 0.5, 40))
    found = shortened(robot_only, seconds=0.25)
    np.testing.assert_array_equal(found.time, robot_only.time[::10])
    assert found.origin["thinned"] == "one used sample in 0.25 s; 36 others are not in this file"


@pytest.mark.parametrize(
    ("how", "field"),
    [({}, "every"), ({"every": 2, "seconds": 1.0}, "every"), ({"every": 0}, "every"), ({"seconds": 0.0}, "seconds")],
)
def test_what_makes_no_sense_is_named(how, field):
    with pytest.raises(InvalidInput) as error:
        thinned(blank([0.1, 0.2]), **how)
    assert error.value.field == field


def test_where_tendons_rub_a_turn_that_is_left_out_is_still_felt():
    """The tension rises and falls between two samples that count: the body remembers where it came from."""
    tension = np.concatenate([np.linspace(0.1, 0.6, 24), np.linspace(0.58, 0.4, 12)])
    trial = replace(blank(tension, along([1.0]), robot=ROBOT.replace(tendon_friction=0.2)), tension_noise=0.0)
    whole, thin = predict([trial]), predict([thinned(trial, 35)])
    rows = [0, 35]
    np.testing.assert_allclose(thin.position[0][rows], whole.position[0][rows], atol=2e-5)
    assert thin.solves == 3  # the two and the turn
    straight = predict([trial.rows(rows)]).position[0]
    assert np.linalg.norm(straight[1] - whole.position[0][35]) > 1e-3


def test_ordinals():
    assert [ordinal(k) for k in (1, 2, 3, 4, 11, 12, 21, 102, 111)] == [
        "1st", "2nd", "3rd", "4th", "11th", "12th", "21st", "102nd", "111th"
    ]  # fmt: skip
