"""Virtual experiments: repeatable, their noise as stated, their truth that of the solver, and said to be virtual."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendonrod import InvalidInput, LumpedMass, load_robot, solve
from tendonrod.measurement.bench import LEVELS, Experiment, sweeps
from tendonrod.measurement.experiment import field_pose, measured, run, simulate
from tendonrod.measurement.noise import NONE, Noise
from tendonrod.measurement.prediction import predict
from tendonrod.measurement.registration import body_positions, registered, world_poses
from tendonrod.measurement.setup import Setup
from tendonrod.rotation import exp_so3

EXAMPLES = Path(__file__).parents[2] / "examples"
ROBOT = load_robot("exonav-3").replace(torsion="homogenized")
LENGTH = ROBOT.length_na
TILT = np.array([0.02, -0.17, 0.05])
EVERYTHING = Noise(
    dropouts=0.1, outliers=0.05, repeats=0.1, tension_zero=0.01, tension_scale=1.02, position_step=1e-5,
    tension_step=1e-3,
)  # fmt: skip
ALL_WRONG = Experiment(
    robot=ROBOT, samples=6, base_tilt=TILT, base_offset=(1e-3, -2e-3, 5e-4), tip_mass=3e-4, tracker_mass=2e-4,
    holder_turn=(0.3, -0.2, 1.0), holder_error=(2e-4, 1e-4, -3e-4), turn_error=(0.01, 0.02, 0.0), noise=EVERYTHING,
)  # fmt: skip
ARRAYS = ("time", "position", "orientation", "quality", "tensions", "insertion", "rotation")


def same(one, other) -> bool:
    bits = all(getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ARRAYS)
    return bits and (one.state == other.state).all() and dict(one.origin) == dict(other.origin)


def test_a_seed_gives_the_same_bits_and_another_seed_others():
    first, again, other = run(ALL_WRONG, 5), run(ALL_WRONG, 5), run(ALL_WRONG, 6)
    assert all(same(a, b) for a, b in zip(first, again, strict=True))
    for a, b in zip(first, other, strict=True):
        assert not np.isclose(a.position, b.position).any()
        assert (a.tensions != b.tensions).any()


def test_without_noise_a_trial_is_what_solve_gives():
    bench = replace(ALL_WRONG, noise=NONE, samples=4)
    exit_pose = np.eye(4)
    exit_pose[:3, :3], exit_pose[:3, 3] = exp_so3(TILT), (1e-3, -2e-3, 5e-4)
    arm = np.array([2.2e-3, 1e-4, -3e-4])
    turn = exp_so3(np.array([0.3, -0.2, 1.0])) @ exp_so3(np.array([0.01, 0.02, 0.0]))
    base, *trials = run(bench, 1)
    position, rotation = world_poses(base)
    np.testing.assert_allclose(position[3, 0], exit_pose[:3, 3] + exit_pose[:3, :3] @ arm, atol=1e-12)
    np.testing.assert_allclose(rotation[3, 0], exit_pose[:3, :3] @ turn, atol=1e-12)
    for share, trial in zip((0.25, 0.5, 0.75, 1.0), trials, strict=True):
        position, rotation = world_poses(trial)
        s = share * LENGTH
        masses = LumpedMass(mass=3e-4), LumpedMass(mass=2e-4, at=s, offset=tuple(arm))
        for i, tension in enumerate(0.05 + 0.65 * sweeps(4, 1)):
            shape = solve(ROBOT, tension, (-9.81, 0, 0), s=[s], loads=masses, exit_pose=exit_pose, accuracy=1e-10)
            assert np.asarray(trial.tensions)[i, 0] == pytest.approx(tension, rel=1e-15)
            np.testing.assert_allclose(position[i, 0], shape.centerline[0] + shape.rotation[0] @ arm, atol=1e-9)
            np.testing.assert_allclose(rotation[i, 0], shape.rotation[0] @ turn, atol=1e-7)


def test_a_tilted_base_is_gravity_turned_back():
    R = exp_so3(TILT)
    tilted = Experiment(robot=ROBOT, samples=5, base_tilt=TILT, tracker_mass=3e-4, noise=NONE)
    upright = replace(tilted, base_tilt=(0.0, 0.0), gravity=tuple(R.T @ (-9.81, 0.0, 0.0)))
    for one, other in zip(simulate(tilted), simulate(upright), strict=True):
        np.testing.assert_allclose(one.position, other.position @ R.T, atol=1e-9)
        np.testing.assert_allclose(one.turned, R @ other.turned, atol=1e-7)


def test_registered_on_the_base_the_tilt_is_one_of_gravity():
    tilted = Experiment(robot=ROBOT, samples=5, base_tilt=TILT, level="base", noise=NONE)
    turned = exp_so3(-TILT) @ (-9.81, 0.0, 0.0)
    upright = replace(tilted, base_tilt=(0.0, 0.0), gravity=tuple(turned), level="field")
    for one, other in zip(registered(run(tilted, 2)), run(upright, 9), strict=True):
        assert one.gravity == (-9.81, 0.0, 0.0)
        np.testing.assert_allclose(body_positions(one), body_positions(other), atol=1e-9)


@pytest.mark.parametrize("level", LEVELS)
def test_what_is_known_of_the_field(level):
    bench = Experiment(robot=ROBOT, samples=3, base_tilt=(0.0, -0.1), level=level, noise=NONE)
    trials = run(bench, 4)
    T = field_pose(bench, 4)
    known = [trial.T_world_field for trial in trials]
    assert all(np.array_equal(each, T) for each in known) if level == "field" else known == [None] * 5
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.array_equal(T[:3, :3], np.eye(3)) == (level == "origin")
    true = simulate(bench)[-1].position
    seen = world_poses(registered(trials)[-1])[0]
    expected = {"field": true, "base": true @ exp_so3(np.array([0.0, -0.1, 0.0]))}
    if level == "origin":  # the holder on the tilted base is not where it is thought to be
        arm = np.array([2e-3, 0.0, 0.0])
        expected["origin"] = true + arm - exp_so3(np.array([0.0, -0.1, 0.0])) @ arm
    np.testing.assert_allclose(seen, expected[level], atol=1e-9)


def test_the_model_with_the_true_bench_predicts_what_is_measured():
    """An independent path: `predict`, from the trials and the truth alone."""
    bench = replace(ALL_WRONG, noise=replace(NONE, tension_scale=1.05, tension_zero=0.02), turn_error=(0.0, 0.0, 0.0))
    x, y, z = bench.base_offset
    tilt_x, tilt_y, roll = bench.base_tilt
    hx, hy, hz = bench.holder_error
    setup = Setup(
        base_x=x, base_y=y, base_z=z, base_tilt_x=tilt_x, base_tilt_y=tilt_y, base_roll=roll, tip_mass=bench.tip_mass,
        holder_x=hx, holder_y=hy, holder_z=hz, tension_scale=1.05, tension_zero=0.02,
    )  # fmt: skip
    trials = run(bench, 8)[1:]
    for trial, position in zip(trials, predict(trials, setup).position, strict=True):
        np.testing.assert_allclose(position, world_poses(trial)[0], atol=2e-6)


def test_a_tendon_that_rubs_bends_more_while_it_is_let_go():
    rubbing = ROBOT.replace(tendon_friction=0.15)
    bent = {}
    for name, robot in (("free", ROBOT), ("rubs", rubbing)):
        true = simulate(Experiment(robot=robot, places=(1.0,), samples=8, noise=NONE))[-1]
        bent[name] = np.array([shape.u[:, 1].mean() for shape in true.shapes])
    np.testing.assert_allclose(bent["free"][:7], bent["free"][-1:-8:-1], rtol=1e-6)
    assert (np.abs(bent["rubs"][1:7]) < np.abs(bent["rubs"][-2:-8:-1])).all()
    assert (np.abs(bent["rubs"][:8]) < np.abs(bent["free"][:8])).all()


def test_a_delay_shows_what_was_before():
    bench = Experiment(robot=ROBOT, samples=8, noise=NONE, places=(1.0,))
    late = replace(bench, delay=2.0 / bench.rate)
    now, before = simulate(bench)[-1], simulate(late)[-1]
    np.testing.assert_allclose(before.position[2:], now.position[:-2], atol=1e-9)
    np.testing.assert_array_equal(before.tensions, now.tensions)


def test_a_tracker_in_the_outer_tube_is_not_seen():
    bench = Experiment(robot=ROBOT, tensions=(0.3, 0.3, 0.3), insertion=(0.3, 0.6, 1.0), places=(0.5,), noise=NONE)
    assert run(bench, 0)[-1].kept[:, 0].tolist() == [False, True, True]


def test_fixed_trackers_all_weigh_at_once():
    bench = Experiment(robot=ROBOT, tensions=(0.3,), protocol="fixed", tracker_mass=1e-3, noise=NONE)
    (trial,) = run(bench, 0)
    assert [each.name for each in trial.trackers] == ["base", "s25", "s50", "s75", "s100"]
    masses = [LumpedMass(mass=1e-3, at=share * LENGTH, offset=(2e-3, 0, 0)) for share in (0.25, 0.5, 0.75, 1.0)]
    shape = solve(ROBOT, 0.3, (-9.81, 0, 0), loads=masses, s=[LENGTH])
    np.testing.assert_allclose(body_positions(trial)[0, 4], shape.centerline[0], atol=1e-6)


def test_trials_claim_what_the_lab_believes_and_say_that_they_are_virtual():
    stiff = ROBOT.replace(youngs_modulus=80e9)
    bench = replace(ALL_WRONG, robot=stiff, claimed=ROBOT, claimed_tracker_mass=0.0)
    for trial in run(bench, 11):
        assert trial.robot == ROBOT
        assert trial.gravity == (-9.81, 0.0, 0.0)
        assert trial.trackers[0].mass == 0.0
        assert "not a measurement" in trial.origin["made by"]
        assert "virtual" in trial.notes
        truth = json.loads(trial.origin["truth"])
        assert truth["robot"]["youngs_modulus"] == 80e9
        assert (truth["base_tilt"], truth["tip_mass"]) == (TILT.tolist(), 3e-4)
        assert trial.origin["seed"] == "11"


def test_the_truth_is_solved_once_for_all_seeds():
    told = []
    bench = Experiment(robot=ROBOT, samples=3, base_frames=5)
    true = simulate(bench, watch=lambda done, total: told.append((done, total)))
    assert told == [(k, 25) for k in range(1, 26)]
    for seed in (0, 1):
        assert all(same(a, b) for a, b in zip(measured(bench, true, seed), run(bench, seed), strict=True))


def test_sweeps_rise_and_fall():
    assert sweeps(3, 0).tolist() == [0.0, 0.5, 1.0]
    assert sweeps(3, 2).tolist() == [0.0, 0.5, 1.0, 0.5, 0.0, 0.5, 1.0, 0.5, 0.0]


def test_several_tendons_have_tensions_of_their_own():
    robot = load_robot(EXAMPLES / "four-tendon.toml")
    bench = Experiment(robot=robot, largest_tension=(15.0, 0.0, 4.0, 0.0), least_tension=0.0, samples=3, noise=NONE)
    trial = run(bench, 0)[-1]
    assert np.asarray(trial.tensions)[2].tolist() == [15.0, 0.0, 4.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"robot": "exonav-1"}, "robot = 'exonav-1': must be a Robot, as load_robot gives it"),
        ({"protocol": "both"}, "protocol = 'both': must be one of movable, fixed"),
        ({"level": "none"}, "level = 'none': must be one of field, base, origin"),
        ({"least_tension": 0.8}, "least_tension = 0.8: must be at most largest_tension = 0.7"),
        ({"tensions": (0.1, -0.2)}, "tensions[1][0] = -0.2: must be >= 0"),
        ({"places": (0.5, 1.5)}, "places[1] = 1.5: must be from 0 to 1"),
        ({"places": ()}, "places = (): must be one or more shares of the length, all different"),
        ({"insertion": 1.5}, "insertion = 1.5: must be from 0 to 1"),
        ({"rotation": (0.0, 1.0)}, "rotation = '2 values': must be one number or 59, as many as there are samples"),
        ({"base_tilt": 0.1}, "base_tilt = 0.1: must be a vector of 3 finite numbers"),
        ({"samples": 1}, "samples = 1: must be a whole number >= 2"),
        ({"tip_mass": -1.0}, "tip_mass = -1.0: must be >= 0"),
        ({"noise": 0.5}, "noise = 0.5: must be a Noise"),
    ],
)
def test_bad_benches_are_refused_by_name(changes, line):
    with pytest.raises(InvalidInput) as error:
        Experiment(**({"robot": ROBOT} | changes))
    assert str(error.value) == line


def test_a_seed_is_a_whole_number():
    with pytest.raises(InvalidInput, match=r"seed = -1: must be a whole number >= 0"):
        run(Experiment(robot=ROBOT, samples=2), -1)
