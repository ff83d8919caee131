"""Registration: known motions come back, noise leaves what theory says, outliers and unknown turns are dealt with."""

from dataclasses import replace

import numpy as np
import pytest

from tendonrod import InvalidInput, load_robot
from tendonrod.measurement.registration import (
    AXES_OF_FIELD,
    GIVEN,
    UNKNOWN,
    base_registration,
    body_positions,
    registered,
    registrations,
    rigid_registration,
    seen_exit,
    world_poses,
)
from tendonrod.measurement.trial import BASE, Tracker, Trial
from tendonrod.rotation import exp_so3, log_so3

ROBOT = load_robot("exonav-1")
BASE_TRACKER = Tracker(name="base", on=BASE, offset=(3e-3, -1e-3, 2e-3), turn=(0.4, -0.2, 1.0))
TIP = Tracker(name="tip", point=(1e-3, 0.0), offset=(0.0, 2e-3, 1e-3), turn=(0.0, 0.5, 0.0))


def motion(turn, shift):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_so3(np.array(turn)), shift
    return T


WORLD_FIELD = motion((0.3, -1.1, 0.4), (0.12, -0.03, 0.25))


def moved(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def quaternions(R):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat(scalar_first=True)


def seen(trackers, position, R, field=WORLD_FIELD, **more):
    """A trial of sensors at (n, k, 3), (n, k, 3, 3) in the world, as they look from the field."""
    n, inverse = len(position), np.linalg.inv(field)
    turned = inverse[:3, :3] @ R
    more = {"time": np.arange(n) / 40.0, "tensions": np.full((n, 1), 0.3), "name": "seen"} | more
    return Trial(
        robot=ROBOT, trackers=trackers, position=moved(inverse, position),
        orientation=quaternions(turned.reshape(-1, 3, 3)).reshape(n, len(trackers), 4), **more,
    )  # fmt: skip


def of_base(n=40, noise=0.0, noise_angle=0.0, seed=3, tracker=BASE_TRACKER, **more):
    rng = np.random.default_rng(seed)
    position = np.array(tracker.arm) + rng.normal(size=(n, 1, 3)) * noise
    R = exp_so3(np.array(tracker.turn or (0.0, 0.0, 0.0))) @ exp_so3(rng.normal(size=(n, 1, 3)) * noise_angle)
    return seen((tracker,), position, R, **more)


@pytest.mark.parametrize("flat", [False, True])
def test_a_known_motion_comes_back(flat):
    points = np.random.default_rng(1).normal(size=(7, 3)) * (1.0, 1.0, 0.0 if flat else 1.0)
    found = rigid_registration(points, moved(WORLD_FIELD, points))
    np.testing.assert_allclose(found.T, WORLD_FIELD, atol=1e-12)
    assert found.rms < 1e-14
    assert np.linalg.det(found.T[:3, :3]) == pytest.approx(1.0, abs=1e-14)


def test_a_mirror_image_is_never_taken():
    points = np.random.default_rng(1).normal(size=(9, 3))
    found = rigid_registration(points, points * (1.0, 1.0, -1.0))
    assert np.linalg.det(found.T[:3, :3]) == pytest.approx(1.0, abs=1e-12)
    assert found.rms > 0.1


def test_noise_leaves_what_theory_says():
    """E rms^2 = 3 sigma^2 (1 - 2 / n): six of the 3 n numbers go into the motion (Sibson 1979)."""
    rng, n, sigma = np.random.default_rng(7), 6, 1e-3
    points = rng.normal(size=(n, 3))
    squares = [
        rigid_registration(points, moved(WORLD_FIELD, points) + sigma * rng.normal(size=(n, 3))).rms ** 2
        for _ in range(600)
    ]
    expected = 3.0 * sigma**2 * (1.0 - 2.0 / n)
    spread = expected * np.sqrt(2.0 / (3 * n - 6) / len(squares))
    assert abs(np.mean(squares) - expected) < 4.0 * spread


def test_moving_both_frames_moves_the_answer_only():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 8, 3))
    A, B = motion((1.0, 0.2, -2.0), (3.0, 1.0, 0.5)), motion((0.1, 2.0, 0.3), (-1.0, 4.0, 2.0))
    plain, other = rigid_registration(a, b), rigid_registration(moved(A, a), moved(B, b))
    np.testing.assert_allclose(other.T, B @ plain.T @ np.linalg.inv(A), atol=1e-12)
    assert other.rms == pytest.approx(plain.rms, rel=1e-12)


def test_a_weight_counts_as_often_as_it_says():
    a, b = np.random.default_rng(4).normal(size=(2, 5, 3))
    twice = [0, 1, 1, 2, 3, 3, 3]
    found = rigid_registration(a, b, weights=[1.0, 2.0, 1.0, 3.0, 0.0])
    expected = rigid_registration(a[twice], b[twice])
    np.testing.assert_allclose(found.T, expected.T, atol=1e-12)
    assert found.rms == pytest.approx(expected.rms)
    assert found.used.tolist() == [True] * 4 + [False]


@pytest.mark.parametrize(
    ("measured", "true", "weights", "said"),
    [
        (np.eye(3)[:2], np.eye(3)[:2], None, "measured = '2 points': must be 3 points or more"),
        (np.eye(3), np.eye(3), [1.0, 1.0, 0.0], "weights = '2 points': must be 3 points or more"),
        (np.eye(3), np.eye(3), [1.0, -1.0, 1.0], "weights[1] = -1.0: must be >= 0"),
        (np.eye(3), np.eye(3), [1.0, 1.0], "weights = '2 values': must be 3"),
        (np.outer([0, 1, 2, 3], [1, 2, 3]), np.ones((4, 3)), None, "measured = 'points on one line'"),
        (np.eye(3), np.outer([0, 1, 2], [1, 2, 3]), None, "true = 'points on one line'"),
        (np.eye(3), np.eye(3)[:2], None, "true = 'an array of shape (2, 3)': must be of shape (3, 3)"),
        (np.eye(3)[:, :2], np.eye(3), None, "measured = 'an array of shape (3, 2)': must be of shape (n, 3)"),
    ],
)
def test_what_cannot_be_registered_is_named(measured, true, weights, said):
    with pytest.raises(InvalidInput) as error:
        rigid_registration(measured, true, weights)
    assert str(error.value).startswith(said)


def test_the_base_tracker_shows_the_field():
    found = base_registration([of_base()])
    np.testing.assert_allclose(found.T, WORLD_FIELD, atol=1e-12)
    assert (found.count, found.note) == (40, "")
    assert max(found.rms, found.angle_rms) < 1e-12


def test_scatter_and_standard_error_are_those_of_the_noise():
    n, sigma, angle = 4000, 5e-4, 5e-3
    found = base_registration([of_base(n, sigma, angle)])
    lever = np.linalg.norm(WORLD_FIELD[:3, 3]) * 4.0 * angle / np.sqrt(n)
    assert found.rms == pytest.approx(np.sqrt(3.0) * sigma, rel=0.03)
    assert found.angle_rms == pytest.approx(np.sqrt(3.0) * angle, rel=0.03)
    np.testing.assert_allclose(found.standard_error, (sigma / np.sqrt(n), angle / np.sqrt(n)), rtol=0.03)
    assert np.linalg.norm(log_so3(found.T[:3, :3] @ WORLD_FIELD[:3, :3].T)) < 4.0 * angle / np.sqrt(n) * np.sqrt(3)
    assert np.linalg.norm(found.T[:3, 3] - WORLD_FIELD[:3, 3]) < 4.0 * sigma / np.sqrt(n) * np.sqrt(3) + lever
    at_base = found.T @ np.linalg.inv(WORLD_FIELD) @ [*BASE_TRACKER.arm, 1.0]
    assert np.linalg.norm(at_base[:3] - BASE_TRACKER.arm) < 4.0 * sigma / np.sqrt(n) * np.sqrt(3)  # no lever there


def test_a_third_of_outliers_has_no_part():
    clean = of_base(60, 2e-4, 2e-3)
    position, orientation = clean.position.copy(), clean.orientation.copy()
    rng = np.random.default_rng(8)
    position[:10] += rng.normal(size=(10, 1, 3)) * 0.05
    orientation[10:20] = quaternions(exp_so3(rng.normal(size=(10, 3)))).reshape(10, 1, 4)
    found = base_registration([replace(clean, position=position, orientation=orientation)])
    expected = base_registration([clean.rows(slice(20, None))])
    assert not found.used[:20].any()
    assert found.count >= 39
    np.testing.assert_allclose(found.T, expected.T, atol=3e-4)
    assert "outliers left out" in str(found)


def test_moving_the_field_changes_nothing_in_the_world():
    A = motion((1.0, 0.2, -2.0), (0.3, -0.1, 0.05))
    trials = [of_base(noise=3e-4, noise_angle=3e-3, field=T) for T in (WORLD_FIELD, WORLD_FIELD @ A)]
    one, other = (world_poses(registered([each])[0]) for each in trials)
    np.testing.assert_allclose(one[0], other[0], atol=1e-13)
    np.testing.assert_allclose(one[1], other[1], atol=1e-12)


@pytest.mark.parametrize("lacking", ["turn", "orientation"])
def test_without_orientation_the_fields_axes_are_the_worlds_and_a_note_says_so(lacking):
    trial = of_base(tracker=replace(BASE_TRACKER, turn=None) if lacking == "turn" else BASE_TRACKER)
    trial = replace(trial, orientation=None) if lacking == "orientation" else trial
    found = base_registration([trial])
    assert found.note == AXES_OF_FIELD
    np.testing.assert_array_equal(found.T[:3, :3], np.eye(3))
    np.testing.assert_allclose(found.T[:3, 3] + trial.position[0, 0], BASE_TRACKER.arm, atol=1e-15)
    assert seen_exit(replace(trial, T_world_field=np.eye(4))) is None


def test_one_base_trial_registers_the_others_as_in_the_paper():
    other = seen((TIP,), np.ones((3, 1, 3)), np.tile(np.eye(3), (3, 1, 1, 1)))
    kept = replace(other, name="knows", T_world_field=np.eye(4))
    base, plain, known = registered([of_base(), other, kept])
    np.testing.assert_allclose(plain.T_world_field, WORLD_FIELD, atol=1e-12)
    np.testing.assert_array_equal(base.T_world_field, plain.T_world_field)
    np.testing.assert_array_equal(known.T_world_field, np.eye(4))
    assert known.origin["registration"] == GIVEN
    assert plain.origin["registration"].startswith("tracker base on the base: 40 samples")
    again = registrations([base, plain, known])
    assert [str(each) for each in again] == [each.origin["registration"] for each in (base, plain, known)]


def test_a_trials_own_base_tracker_goes_before_that_of_others():
    far = motion((0.0, 0.0, 1.0), (1.0, 2.0, 3.0))
    one, other = registered([of_base(), of_base(field=far)])
    np.testing.assert_allclose(one.T_world_field, WORLD_FIELD, atol=1e-12)
    np.testing.assert_allclose(other.T_world_field, far, atol=1e-12)


def test_without_any_base_tracker_the_field_is_the_world_and_a_note_says_so():
    trial = seen((TIP,), np.ones((3, 1, 3)), np.tile(np.eye(3), (3, 1, 1, 1)))
    (found,) = registrations([trial])
    assert (str(found), found.note) == (UNKNOWN, UNKNOWN)
    np.testing.assert_array_equal(found.T, np.eye(4))
    with pytest.raises(InvalidInput, match="tracker on the base"):
        base_registration([trial])


def test_in_a_known_world_the_base_tracker_shows_how_the_exit_stands():
    leaning = motion((0.01, -0.17, 0.02), (1e-3, 0.0, -2e-3))
    field = WORLD_FIELD
    shown = replace(of_base(field=np.linalg.inv(leaning) @ field), T_world_field=field)
    np.testing.assert_allclose(seen_exit(shown), leaning, atol=1e-12)


def test_offsets_come_off_by_the_measured_orientation():
    rng = np.random.default_rng(6)
    R, c = exp_so3(rng.normal(size=(5, 1, 3))), rng.normal(size=(5, 1, 3))
    arm = np.array(TIP.arm)
    trial = seen((TIP,), c + R @ arm, R @ exp_so3(np.array(TIP.turn)), T_world_field=WORLD_FIELD)
    np.testing.assert_allclose(body_positions(trial), c + R @ [*TIP.point, 0.0], atol=1e-14)
    unknown = replace(trial, trackers=(replace(TIP, turn=None),))
    assert np.isnan(body_positions(unknown)).all()
    bare = replace(trial, trackers=(replace(TIP, turn=None, offset=(0.0, 0.0, 0.0)),), orientation=None)
    np.testing.assert_allclose(body_positions(bare), c + R @ arm, atol=1e-14)
    with pytest.raises(InvalidInput, match="must be registered"):
        body_positions(replace(trial, T_world_field=None))
