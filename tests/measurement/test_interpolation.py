"""Samples of a moving robot are interpolated to what each of them is alone; what is not smooth is not interpolated."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from measurement.known_bench import ROBOT, along, blank, farthest_from_direct
from tendonrod import PlainRod, Robot, Tendon
from tendonrod.measurement import prediction
from tendonrod.measurement.interpolation import MOST, Spread
from tendonrod.measurement.prediction import Predictor, predict
from tendonrod.measurement.setup import BENCH, Setup

HOLDER = {"point": (3e-4, -2e-4), "offset": (1e-3, 2e-3, 5e-4), "turn": (0.0, 0.3, 0.1)}
WRONG = Setup(base_tilt_x=0.1, base_tilt_y=-0.05, base_roll=0.2, base_y=-2e-3, tip_mass=3e-4, gravity_tilt_y=0.1)
TIP = along([1.0], **HOLDER)
FAR = 1e-6, 1e-4  # m, rad


def moving(n=400, trackers=TIP, **fields):
    """A robot on its way out, pulled ever more, with jitter of bench and cells; turned about while still inside."""
    rng, eta = np.random.default_rng(2), np.linspace(0.02, 1.0, n)
    given = {
        "insertion": np.clip(eta + 1e-4 * rng.normal(size=n), 0.0, 1.0),
        "rotation": 6.0 * np.exp(-eta / 0.02) + 1e-3 * rng.normal(size=n),
    }
    tensions = fields.pop("tensions", 0.6 + 0.1 * eta + 5e-3 * rng.normal(size=n))
    return blank(tensions, trackers, **given | fields)


def some_rows(trial, count=12):
    """Some of the used samples, among them the first and the last."""
    rows = np.flatnonzero((trial.kept & trial.on_robot).all(axis=1))
    return rows[np.linspace(0, rows.size - 1, count).astype(int)]


@pytest.mark.parametrize("setup", [Setup(tip_mass=1e-9), WRONG], ids=["as told", "wrong"])
def test_a_robot_on_its_way_out_needs_few_equilibria(setup):
    trial = moving()
    found = predict([trial], setup)
    assert found.solves < 80
    far, turned = farthest_from_direct(trial, found, 0, setup, some_rows(trial))
    assert far < FAR[0]
    assert turned < FAR[1]


def test_every_sample_is_what_it_is_alone(monkeypatch):
    trial = moving(250)
    found = predict([trial], WRONG)
    monkeypatch.setattr(prediction, "FEW", 250)
    alone = predict([trial], WRONG)
    assert found.solves < 80 < 250 <= alone.solves
    assert np.nanmax(np.linalg.norm(found.position[0] - alone.position[0], axis=-1)) < FAR[0]
    np.testing.assert_array_equal(np.isnan(found.position[0]), np.isnan(alone.position[0]))


def test_trackers_that_come_out_one_after_the_other():
    """Where a tracker and its mass pass the exit, the motion of the others has a kink."""
    trial = moving(trackers=along([0.3, 0.7, 1.0], mass=3e-4, **HOLDER))
    found = predict([trial], WRONG)
    np.testing.assert_array_equal(np.isfinite(found.position[0]).all(axis=-1), trial.kept)
    assert found.solves < 250
    assert max(*farthest_from_direct(trial, found, 0, WRONG, some_rows(trial, 8))) < FAR[1]
    assert farthest_from_direct(trial, found, 0, WRONG, some_rows(trial, 8))[0] < FAR[0]


def test_tendons_that_end_on_the_way_and_are_pulled_at_will():
    """Several tensions that have nothing to do with each other; one tendon ends half way along the robot."""
    body = PlainRod(length=0.1, radius=0.5e-3, youngs_modulus=70e9, shear_modulus=26e9, density=7e3)
    tendons = (Tendon.constant(x=2e-3, y=0.0, end=0.1), Tendon.constant(x=0.0, y=2e-3, end=0.05))
    robot = Robot(name="two", body=body, tendons=tendons)
    rng = np.random.default_rng(3)
    fields = {"tensions": rng.uniform(0.0, 2.0, (300, 2)), "robot": robot}
    trial = moving(300, along([1.0], 0.1, **HOLDER), **fields, rotation=np.zeros(300))
    found = predict([trial], WRONG)
    assert found.solves < 220
    assert farthest_from_direct(trial, found, 0, WRONG, some_rows(trial))[0] < FAR[0]


def test_pulled_lengths():
    robot = ROBOT.replace(tendons=(replace(ROBOT.tendons[0], axial_stiffness=600.0, free_length=0.3),))
    eta = np.linspace(0.3, 1.0, 200)
    pulled = 1e-3 + 5e-4 * np.sin(9.0 * eta)
    trial = moving(200, robot=robot, tensions=np.full(200, np.nan), displacements=pulled, insertion=eta)
    found = predict([trial], WRONG)
    assert found.solves < 120
    for row in some_rows(trial, 6):
        drive = {"tensions": 0.0, "displacements": [pulled[row]]}
        assert farthest_from_direct(trial, found, 0, WRONG, [row], **drive)[0] < FAR[0]


def test_without_gravity_turning_costs_nothing():
    """Every rotation is the same equilibrium, turned: as many solves as without it."""
    n, still = 300, (0.0, 0.0, 0.0)
    eta, tension = np.linspace(0.1, 1.0, n), 0.5 + 0.1 * np.cos(np.arange(n))
    turning, straight = (
        moving(n, insertion=eta, tensions=tension, gravity=still, rotation=each)
        for each in (np.linspace(0.0, 40.0, n), np.zeros(n))
    )
    found = predict([turning])
    assert abs(found.solves - predict([straight]).solves) <= 2
    assert farthest_from_direct(turning, found, 0, Setup(), some_rows(turning, 6))[0] < FAR[0]


NAMES = (
    *(name for name in BENCH if name != "displacement_zero"),
    "youngs_modulus", "torsion_factor", "length", "outer_radius",
)  # fmt: skip


def test_derivatives_are_those_of_samples_alone(monkeypatch):
    trial = moving(120, along([0.6, 1.0], **HOLDER), insertion=np.linspace(0.5, 1.0, 120))
    found = predict([trial], WRONG, NAMES)
    assert found.solves < 100
    monkeypatch.setattr(prediction, "FEW", 120)
    alone = predict([trial.rows(slice(0, 120, 10))], WRONG, NAMES)
    for part in (slice(0, 3), slice(3, 6)):
        one, other = found.columns[0][::10, :, part], alone.columns[0][:, :, part]
        scale = np.nanmax(np.abs(other), axis=(0, 1, 2))
        off = np.nanmax(np.abs(one - other), axis=(0, 1, 2))
        assert (off <= 1e-3 * scale + 1e-12).all(), dict(zip(NAMES, off / scale, strict=True))
        np.testing.assert_allclose(found.slope[0][::10, :, part], alone.slope[0][:, :, part], atol=1e-3)


def test_a_fit_solves_the_same_samples_again_and_holds_few_shapes():
    predictor = Predictor([moving(2000)], ("youngs_modulus", "tension_zero"))
    first = predictor(WRONG)
    again = predictor(replace(WRONG, tip_mass=4e-4))
    assert again.solves <= first.solves + 5
    assert len(predictor.shapes) < 100
    moved = predictor(replace(WRONG, tension_zero=0.01))
    assert moved.solves < 100


def test_a_watcher_hears_of_all_samples():
    told, predictor = [], Predictor([moving(200), blank([0.1, 0.2])])
    predictor.watch = lambda done, of: told.append((done, of))
    predictor(WRONG)
    assert told[-1] == (202, 202)
    assert all(a[0] <= b[0] for a, b in pairwise(told))


def places(q=500, f=2, seed=0):
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (q, f))


def test_smooth_values_are_told_from_few():
    x, asked = places(), []

    def value(n, k):
        asked.append(k)
        return np.array([[np.cos(2.0 * x[k, 0]) * np.exp(x[k, 1]), x[k, 0] * x[k, 1]]])

    found = Spread(x).interpolated(value, np.full(2, 1e-6))
    expected = np.stack([np.cos(2.0 * x[:, 0]) * np.exp(x[:, 1]), x.prod(axis=1)], axis=1)
    assert len(asked) == len(set(asked)) < 100
    assert found is not None
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-6)


def test_what_is_not_smooth_is_not_told():
    noise = np.random.default_rng(1).normal(size=1000)
    x, asked = places(1000), []

    def value(n, k):
        asked.append(k)
        return np.array([[noise[k]]])

    assert Spread(x).interpolated(value, np.array([1e-6])) is None
    assert len(set(asked)) <= 3 * MOST


def test_a_kink_is_not_told():
    x = places()
    assert Spread(x).interpolated(lambda _, k: np.array([[abs(x[k, 0] + x[k, 1])]]), np.array([1e-6])) is None


def test_repeated_samples_are_asked_for_once():
    x, asked = np.repeat(places(150), 20, axis=0), []

    def value(n, k):
        asked.append(tuple(x[k]))
        return np.array([[np.sin(x[k, 0] + 2.0 * x[k, 1])]])

    found = Spread(x).interpolated(value, np.array([1e-6]))
    assert len(asked) == len(set(asked))
    assert found is not None
    np.testing.assert_allclose(found[:, 0, 0], np.sin(x @ [1.0, 2.0]), atol=1e-6)
