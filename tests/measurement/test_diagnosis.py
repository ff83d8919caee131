"""Diagnosis: a single cause is found for what it is, noise for what it is, and what cannot be told says why."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import NOISE, ROBOT, along, blank, seen
from tendonrod import InvalidInput
from tendonrod.measurement.diagnosis import CAUSES, MOST, diagnose
from tendonrod.measurement.identification import identify
from tendonrod.measurement.setup import Setup

TRIAL = blank(np.linspace(0.1, 0.7, 7), along([0.4, 0.7, 1.0], offset=(1e-3, 2e-3, 0.0), turn=(0.1, 0.2, 0.3)))
TILT = Setup(base_tilt_x=0.03, base_tilt_y=0.1)


@pytest.fixture(scope="module")
def tilted():
    return diagnose(seen([TRIAL], TILT, seed=1))


@pytest.fixture(scope="module")
def clean():
    return diagnose(seen([TRIAL], Setup(), seed=1))


def test_a_tilted_base_explains_what_a_tilted_base_has_done(tilted):
    first = tilted.alone[0]
    assert first.name == "tilted base"
    assert first.explained > 0.95 > 0.92 > tilted.alone[1].explained
    assert first.rmse == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.25)
    np.testing.assert_allclose(first.fit.values, (0.03, 0.1), atol=4.0 * first.fit.standard_errors.max())
    assert [each.name for each in tilted.together] == ["tilted base"]
    assert tilted.sentences[1].startswith("tilted base alone (base_tilt_x ")
    assert first.told in tilted.sentences[1]


def test_noise_alone_has_no_cause(clean):
    assert clean.rmse == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.25)
    assert any("no single cause would explain" in each for each in clean.sentences)
    assert not any(" alone (" in each for each in clean.sentences)
    assert len(clean.together) == 1


@pytest.mark.parametrize("seed", [0, 2])
def test_noise_of_other_seeds_has_none_either(seed):
    assert any("no single cause" in each for each in diagnose(seen([TRIAL], Setup(), seed=seed)).sentences)


def test_every_cause_is_listed_by_what_it_explains(tilted, clean):
    for found in (tilted, clean):
        assert {each.name for each in found.alone} <= set(CAUSES)
        explained = [each.explained for each in found.alone]
        assert explained == sorted(explained, reverse=True)
        assert all(0.0 <= each <= 1.0 for each in explained)
        assert 1 <= len(found.together) <= MOST
    assert {each.name for each in tilted.alone} == set(CAUSES)


def test_what_a_cause_explains_is_the_share_of_the_squared_error_of_its_fit(tilted):
    trials = seen([TRIAL], TILT, seed=1)
    for name in ("stiffness", "tension zero"):
        fit = identify(trials, CAUSES[name], loss="squares")
        (cause,) = [each for each in tilted.alone if each.name == name]
        assert cause.explained == pytest.approx(max(0.0, 1.0 - (fit.rmse / fit.rmse_before) ** 2), abs=1e-3)


def test_a_soft_tube_or_a_wrong_scale_is_one_of_two_that_explain_nearly_the_same():
    found = diagnose(seen([TRIAL], Setup(robot=ROBOT.replace(youngs_modulus=60e9)), seed=0))
    assert {each.name for each in found.alone[:2]} == {"stiffness", "tension scale"}
    assert found.alone[0].explained - found.alone[1].explained < 0.05
    assert found.sentences[-1].endswith("does not show that it is the cause: measure it where you can")


def test_outliers_are_left_out_of_all_comparisons_and_a_watcher_is_told_of_each():
    (trial,), told = seen([TRIAL], Setup(), seed=1), []
    position = trial.position.copy()
    position[2, 2] += (20e-3, 0.0, 0.0)
    found = diagnose([replace(trial, position=position)], watch=lambda *each: told.append(each))
    assert (found.outliers, found.count) == (1, 20)
    assert any("no single cause" in each for each in found.sentences)
    assert all(each.fit is None or len(each.fit.where) == 20 for each in found.alone)
    assert told[0][2] == "looking for outliers"
    done = [each[0] / each[1] for each in told]
    assert done[0] == 0.0
    assert (np.diff(done) >= 0.0).all()
    assert done[-1] < 1.0
    assert set(CAUSES) <= {each[2] for each in told}
    assert all(done <= total for done, total, _ in told)


def test_of_many_poses_some_are_looked_at_and_that_is_said():
    trial = blank(np.linspace(0.1, 0.7, 3500), insertion=np.linspace(0.4, 1.0, 3500))
    found = diagnose(seen([trial], TILT, seed=1))
    assert (found.every, found.count) == (2, 1750)
    assert "1750 poses, of every 2nd used sample" in found.sentences[0]
    assert found.alone[0].name == "tilted base"
    assert found.alone[0].explained > 0.9


def test_without_gravity_causes_that_weigh_are_not_asked_and_what_is_not_told_says_why():
    weightless = replace(TRIAL, gravity=(0.0, 0.0, 0.0), robot=ROBOT.replace(torsion="published"))
    found = diagnose(seen([weightless], TILT, seed=1))
    names = {each.name for each in found.alone}
    assert not names & {"tilted gravity", "mass at the tip", "mass of the trackers", "torsion"}
    assert found.alone[0].name == "tilted base"
    assert all(each.why and each.told == each.why for each in found.alone if each.fit is None)


def test_bad_trials_are_named():
    with pytest.raises(InvalidInput, match=r"trials = .*one or more Trial"):
        diagnose([])
