"""Predictions: each sensor where a direct solve has it, and derivatives by every number as differences have them."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import GRAVITY, ROBOT, along, blank, farthest_from_direct, motion
from tendonrod import InvalidInput, LumpedMass, NotConverged, PlainRod, Robot, Tendon, solve
from tendonrod.measurement.prediction import Predictor, predict
from tendonrod.measurement.setup import BENCH, Setup
from tendonrod.measurement.trial import BASE, Tracker
from tendonrod.rotation import exp_so3, log_so3

LENGTH = ROBOT.length_na
HOLDER = {"point": (3e-4, -2e-4), "offset": (1e-3, 2e-3, 5e-4), "turn": (0.0, 0.3, 0.1)}
WRONG = Setup(
    base_x=1e-3, base_y=-2e-3, base_z=5e-4, base_tilt_x=0.1, base_tilt_y=-0.05, base_roll=0.2, tip_mass=3e-4,
    tracker_mass=1e-4, holder_x=1e-3, holder_z=-4e-4, gravity_tilt_x=0.05, gravity_tilt_y=0.1, gravity_tilt_z=-0.2,
    tension_scale=1.1, tension_zero=-0.02, displacement_zero=1e-4,
)  # fmt: skip


def four_tendons() -> Robot:
    """A plain rod with tendons about it that hold in different places."""
    around = [(2e-3 * np.cos(a), 2e-3 * np.sin(a)) for a in (0.0, 1.6, 3.1, 4.8)]
    body = PlainRod(length=0.1, radius=0.5e-3, youngs_modulus=70e9, shear_modulus=26e9, density=7e3)
    ends = (0.1, 0.07, 0.1, 0.06)
    tendons = tuple(Tendon.constant(x=x, y=y, end=end) for (x, y), end in zip(around, ends, strict=True))
    return Robot(name="four tendons", body=body, tendons=tendons)


TRACKERS = (Tracker(name="base", on=BASE), *along([0.4, 1.0], mass=1e-4, **HOLDER))


@pytest.mark.parametrize("setup", [Setup(), WRONG], ids=["as told", "wrong"])
def test_few_samples_are_solved_one_by_one(setup):
    trial = blank([0.1, 0.7, 0.35, 0.1], TRACKERS, insertion=0.8, rotation=0.4)
    found = predict([trial], setup)
    assert found.solves == 3  # one tension twice
    far, turned = farthest_from_direct(trial, found, 0, setup, [0, 1, 2])
    assert far < 1e-6
    assert turned < 1e-4
    assert np.isnan(found.position[0][:, 0]).all()  # the base is not predicted


def test_many_samples_are_interpolated_to_a_micrometre():
    tensions = np.random.default_rng(0).uniform(0.0, 0.8, 60)
    trial = blank(tensions, TRACKERS)
    found = predict([trial], WRONG)
    assert found.solves < 20
    far, turned = farthest_from_direct(trial, found, 0, WRONG, [*range(0, 60, 6), tensions.argmin(), tensions.argmax()])
    assert far < 1e-6
    assert turned < 1e-4


def test_trials_that_differ_in_their_trackers_alone_share_their_solves():
    trials = [blank(np.linspace(0.1, 0.7, 20) + 1e-3 * k, along([share])) for k, share in enumerate((0.3, 0.6, 1.0))]
    each = [predict([trial], Setup(tip_mass=1e-4)) for trial in trials]
    together = predict(trials, Setup(tip_mass=1e-4))
    assert together.solves == each[0].solves
    for a, b in zip(together.position, each, strict=True):
        np.testing.assert_allclose(a, b.position[0], atol=1e-6)
    heavy = [
        replace(trial, trackers=along([share], mass=1e-4)) for trial, share in zip(trials, (0.3, 0.6, 1.0), strict=True)
    ]
    assert predict(heavy, Setup(tip_mass=1e-4)).solves > 2 * together.solves  # each mass is another load


def test_samples_that_are_not_used_are_not_predicted():
    trial = blank([0.1, 0.2, 0.3, 0.4], along([0.5, 1.0]), insertion=[1.0, 0.5, 0.4, 1.0], time=[0.0, 1.0, 2.0, 2.0])
    known = np.isfinite(predict([trial]).position[0]).all(axis=2)
    np.testing.assert_array_equal(known, trial.kept)


def test_slack_readings_drive_nothing():
    trial = blank([0.1, 0.01, 0.0])
    found = predict([trial], Setup(tension_zero=0.05), ("tension_scale", "tension_zero", "youngs_modulus"))
    np.testing.assert_array_equal(found.position[0][1], found.position[0][2])
    assert (found.columns[0][1:, 0, :, :2] == 0.0).all()
    assert (found.columns[0][0, 0, :3, :2] != 0.0).any()


def differences(trials, setup, name, step):
    """Derivatives (n, k, 6) of each trial's sensors by a number, by central differences of fourth order."""
    value = setup.value(name, trials)
    at = {k: predict(trials, setup.changed({name: value + k * step}, trials)) for k in (-2, -1, 1, 2)}
    found = []
    for i in range(len(trials)):
        sums = []
        for k in (1, 2):
            p = at[k].position[i] - at[-k].position[i]
            R = at[k].rotation[i] @ np.swapaxes(at[-k].rotation[i], -1, -2)
            turn = np.full_like(p, np.nan)
            known = np.isfinite(R).all(axis=(2, 3))
            turn[known] = log_so3(R[known])
            sums.append(np.concatenate([p, turn], axis=2) / (2.0 * k * step))
        found.append((4.0 * sums[0] - sums[1]) / 3.0)
    return found


def step_of(name: str, value: float) -> float:
    if name not in BENCH:
        return 1e-3 * abs(value)
    masses, lengths = ("tip_mass", "tracker_mass", "displacement_zero"), ("base_x", "base_y", "base_z", "holder")
    return 1e-5 if name in masses else 1e-4 if name.startswith(lengths) else 1e-3


def assert_derivatives(trials, setup, names, bound=1e-6):
    found = predict(trials, setup, names)
    for c, name in enumerate(names):
        step = step_of(name, setup.value(name, trials))
        expected = differences(trials, setup, name, step)
        for part in (slice(0, 3), slice(3, 6)):
            exact = [each[..., part, c] for each in found.columns]
            scale = max(np.nanmax(np.abs(each[..., part])) for each in expected)
            off = max(np.nanmax(np.abs(a - b[..., part])) for a, b in zip(exact, expected, strict=True))
            assert off <= bound * scale + 1e-9 * (part.start == 0), (name, part, off / max(scale, 1e-300))


ROBOTS_NUMBERS = (
    "youngs_modulus", "shear_modulus", "density", "torsion_factor", "bending_x_factor", "axial_factor", "outer_radius",
    "length", "notch_width", "uncut_angle", "turns", "tendon_radius",
)  # fmt: skip


def several() -> list:
    """Two trials that share their solves and one with a mass, drawn in and turned."""
    heavy = blank([0.6, 0.2], along([0.7, 1.0], mass=1e-4, **HOLDER), insertion=0.7, rotation=0.8)
    plain = [blank([0.2, 0.5], along([share], **HOLDER)) for share in (0.5, 1.0)]
    return [*plain, heavy]


@pytest.mark.parametrize("name", [name for name in BENCH if name != "displacement_zero"])
def test_derivatives_by_every_number_of_the_bench(name):
    assert_derivatives(several(), WRONG, [name])


@pytest.mark.parametrize("name", ROBOTS_NUMBERS)
def test_derivatives_by_numbers_of_the_robot(name):
    assert_derivatives(several(), WRONG, [name])


def test_derivatives_by_all_at_once_are_those_by_each():
    names = (*[each for each in BENCH if each != "displacement_zero"], *ROBOTS_NUMBERS)
    together = predict(several(), WRONG, names)
    for name in ("tip_mass", "base_roll", "length", "gravity_tilt_z"):
        alone = predict(several(), WRONG, [name])
        for a, b in zip(together.columns, alone.columns, strict=True):
            np.testing.assert_allclose(a[..., names.index(name)], b[..., 0], rtol=1e-6, atol=1e-9)


def test_derivatives_of_interpolated_samples():
    trial = blank(np.linspace(0.1, 0.6, 12), along([0.5, 1.0], **HOLDER))
    names = ("youngs_modulus", "base_tilt_y", "tip_mass", "tension_scale", "tension_zero")
    assert predict([trial], WRONG).solves < 12
    assert_derivatives([trial], WRONG, names, bound=2e-4)  # differences see changes of the interpolation, too


def test_derivatives_with_several_tendons():
    trial = blank([[0.5, 0.0, 0.2, 0.1], [1.0, 0.3, 0.1, 0.4]], along([0.5, 1.0], 0.1, **HOLDER), robot=four_tendons())
    names = ("youngs_modulus", "radius", "tendons[1].x", "base_tilt_x", "tension_scale", "tension_zero", "holder_y")
    names = tuple(each for each in names if each in BENCH or each in trial.robot.parameters())
    assert len(names) >= 6
    assert_derivatives([trial], replace(WRONG, tip_mass=1e-4), names)


def driven(trackers, tensions=(np.nan, np.nan), displacements=None):
    """Two samples of a robot whose tendon stretches."""
    robot = ROBOT.replace(tendons=(replace(ROBOT.tendons[0], axial_stiffness=600.0, free_length=0.3),))
    return blank(tensions, trackers, robot=robot, displacements=displacements)


def test_derivatives_where_lengths_are_pulled():
    trial = driven(along([0.5, 1.0], **HOLDER), displacements=[1e-3, 2.5e-3])
    names = ("displacement_zero", "tendon_axial_stiffness", "youngs_modulus", "tip_mass", "holder_x", "base_tilt_y")
    assert_derivatives([trial], WRONG, names)


def test_slopes_are_derivatives_by_the_reading():
    """Moving the reading by d moves the input by scale * d; below the zero the tendon is slack and nothing moves."""
    values, step = np.array([0.3, 0.6, -0.2]), 1e-5

    def at(change):
        trial = driven(along([1.0], **HOLDER), tensions=values + change)
        return predict([trial], WRONG, ("tip_mass",))

    up, down, found = at(step), at(-step), at(0.0)
    np.testing.assert_allclose(
        found.slope[0][:, 0, :3, 0], (up.position[0] - down.position[0])[:, 0] / (2.0 * step), rtol=1e-4, atol=1e-6
    )
    turn = log_so3(up.rotation[0] @ np.swapaxes(down.rotation[0], -1, -2))[:, 0] / (2.0 * step)
    np.testing.assert_allclose(found.slope[0][:, 0, 3:, 0], turn, rtol=1e-4, atol=1e-4)
    assert not found.slope[0][2].any()


def test_pulled_lengths_have_no_noise_of_tension():
    trial = driven(along([1.0], **HOLDER), displacements=np.array([1e-3, 2e-3]))
    assert not predict([trial], WRONG, ("tip_mass",)).slope[0].any()
    assert np.isnan(predict([trial], WRONG).slope[0]).all()  # not asked


def rubbing_trial():
    robot = ROBOT.replace(tendon_friction=0.1)
    return blank([0.2, 0.6, 0.5, 0.1, 0.3], along([0.5, 1.0], **HOLDER), robot=robot)


def test_where_tendons_rub_each_sample_remembers_the_last():
    trial, setup, shape = rubbing_trial(), Setup(tip_mass=1e-4), None
    found = predict([trial], setup)
    for row, tension in enumerate(trial.tensions[:, 0]):
        masses = [LumpedMass(mass=setup.tip_mass)]
        shape = solve(trial.robot, tension, GRAVITY, loads=masses, history=shape, accuracy=1e-8)
        for j, share in enumerate((0.5, 1.0)):
            there = shape.at([share * LENGTH])
            p = there.centerline[0] + there.rotation[0] @ trial.trackers[j].arm
            assert np.linalg.norm(found.position[0][row, j] - p) < 2e-6
    alone = predict([blank([0.5], trial.trackers, robot=trial.robot)], setup).position[0][0]
    assert np.linalg.norm(found.position[0][2] - alone, axis=1).max() > 1e-3  # it came from a higher tension


def test_where_tendons_rub_a_sample_that_is_not_used_is_still_remembered():
    whole = rubbing_trial()
    position = whole.position.copy()
    position[1] = np.nan
    found = predict([replace(whole, position=position)]).position[0]
    assert np.isnan(found[1]).all()
    np.testing.assert_allclose(found[2:], predict([whole]).position[0][2:], atol=1e-9)


def test_derivatives_where_tendons_rub_are_those_of_whole_runs():
    """They are one-sided differences of runs: good to a per cent or two of the largest."""
    assert_derivatives([rubbing_trial()], WRONG, ("tendon_friction", "youngs_modulus", "base_tilt_x"), bound=2e-2)


def test_a_turned_world_turns_what_is_predicted():
    Q = exp_so3(np.array([0.4, -1.0, 0.7]))
    trial = blank([0.2, 0.6], TRACKERS, insertion=0.9, rotation=0.3)
    setup = Setup(base_tilt_x=0.1, base_roll=0.2, base_y=2e-3, tip_mass=2e-4)
    x, y, z = log_so3(Q @ exp_so3(setup.base_turn))
    bx, by, bz = Q @ (0.0, 2e-3, 0.0)
    moved = replace(setup, base_tilt_x=x, base_tilt_y=y, base_roll=z, base_x=bx, base_y=by, base_z=bz)
    turned = replace(trial, gravity=tuple(Q @ trial.gravity), T_world_field=motion((0.1, 0.2, 0.3), (1.0, 2.0, 3.0)))
    one, other = predict([trial], setup), predict([turned], moved)
    np.testing.assert_allclose(other.position[0][:, 1:], one.position[0][:, 1:] @ Q.T, atol=1e-9)
    np.testing.assert_allclose(other.rotation[0][:, 1:], Q @ one.rotation[0][:, 1:], atol=1e-7)


def test_a_predictor_that_has_solved_before_says_the_same():
    trial = blank(np.linspace(0.1, 0.6, 20), along([0.5, 1.0]))
    predictor = Predictor([trial], ("youngs_modulus",))
    predictor(Setup(tip_mass=5e-4))
    warm, cold = predictor(WRONG), predict([trial], WRONG, ("youngs_modulus",))
    np.testing.assert_allclose(warm.position[0], cold.position[0], atol=2e-6)
    scale = np.abs(cold.columns[0][..., :3, 0]).max()
    np.testing.assert_allclose(warm.columns[0][..., :3, 0], cold.columns[0][..., :3, 0], atol=1e-3 * scale)


def test_what_has_no_equilibrium_or_no_such_number_is_said():
    with pytest.raises(NotConverged):
        predict([blank([0.1, 500.0])], Setup(robot=ROBOT.replace(youngs_modulus=1e8)))
    with pytest.raises(InvalidInput, match="free = 'stiffness'"):
        predict([blank([0.1])], None, ["stiffness"])
