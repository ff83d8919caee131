"""Accuracy: noise-free trials have no error, a shift is pure bias, and the norms are those of a hand calculation."""

from dataclasses import replace

import numpy as np
import pytest

from tendonrod import InvalidInput, load_robot, solve
from tendonrod.loads import LumpedMass
from tendonrod.measurement.accuracy import NO_ORIENTATION, WITH, WITHOUT, Errors, accuracy
from tendonrod.measurement.posture import posture
from tendonrod.measurement.registration import registered
from tendonrod.measurement.setup import Setup
from tendonrod.measurement.trial import Tracker, Trial
from tendonrod.rotation import exp_so3

ROBOT = load_robot("exonav-1")
GRAVITY = (-9.81, 0.0, 0.0)
MIDDLE = Tracker(name="middle", at=0.5 * ROBOT.length_na, offset=(2e-3, 0.0, 1e-3), turn=(0.0, 0.3, 1.0))
TIP = Tracker(name="tip", mass=1e-4)
TENSIONS = (0.1, 0.3, 0.7)


def sensors(trackers, tension, gravity=GRAVITY, robot=ROBOT):
    """(k, 3), (k, 3, 3) by single solves, each tracker's own place and holder."""
    masses = [LumpedMass(mass=each.mass, at=each.at, offset=each.arm) for each in trackers if each.mass]
    s = np.array([robot.length_na if each.at is None else each.at for each in trackers])
    shape = solve(robot, tension, gravity, loads=masses, accuracy=1e-9, s=np.sort(s)).at(s)
    R = shape.rotation
    position = shape.centerline + np.einsum("kij,kj->ki", R, [each.arm for each in trackers])
    return position, R @ np.array([exp_so3(np.array(each.turn or (0.0, 0.0, 0.0))) for each in trackers])


def trial(trackers=(MIDDLE, TIP), gravity=GRAVITY, tensions=TENSIONS, shift=(0.0, 0.0, 0.0), **changes):
    from scipy.spatial.transform import Rotation

    found = [sensors(trackers, each, gravity) for each in tensions]
    R = np.array([each for _, each in found])
    values = {
        "name": "exact",
        "robot": ROBOT,
        "trackers": trackers,
        "time": np.arange(len(tensions)) / 40.0,
        "tensions": np.array(tensions)[:, None],
        "position": np.array([each for each, _ in found]) + shift,
        "orientation": Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(scalar_first=True).reshape(*R.shape[:2], 4),
        "gravity": gravity,
        "T_world_field": np.eye(4),
    }
    return Trial(**(values | changes))


def test_exact_trials_have_no_error_and_gravity_shows():
    found = accuracy([trial()])
    assert found.runs == (WITHOUT, WITH)
    assert [(each.share, each.n) for each in found.places] == [(pytest.approx(0.5), 3), (1.0, 3)]
    for place in found.places:
        assert place.errors[WITH].med < 2e-6  # the solver's own accuracy, and the interpolation's
    sag = [np.linalg.norm(sensors((TIP,), T)[0] - sensors((TIP,), T, (0.0, 0.0, 0.0))[0]) for T in TENSIONS]
    assert found.places[1].errors[WITHOUT].med == pytest.approx(max(sag), rel=1e-3)
    assert found.places[0].errors[WITH].angle_rms < 1e-4


def test_a_shift_is_pure_bias():
    shift = np.array([1e-3, -2e-3, 0.5e-3])
    for place in accuracy([trial(shift=shift)], gravity="with").places:
        errors = place.errors[WITH]
        np.testing.assert_allclose(errors.bias, shift, atol=2e-6)
        assert errors.scatter < 2e-6
        assert errors.rmse == pytest.approx(np.linalg.norm(shift), rel=1e-3)


def test_norms_by_hand():
    vectors = 1e-3 * np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, 2.0], [0.0, 0.0, 0.0]])
    out = np.array([0.5, 1.0, 0.3, 0.0])
    errors = Errors(model=vectors, vectors=vectors, turns=np.full((4, 3), np.nan), insertion=out, length=0.1)
    assert errors.med == pytest.approx(5e-3)
    assert errors.mae == pytest.approx((5.0 + 1.0 + 3.0) / 4 * 1e-3)
    assert errors.rmse == pytest.approx(np.sqrt(35.0 / 4.0) * 1e-3)
    assert errors.share == pytest.approx(errors.rmse / 0.1)  # of the whole length, however little is out
    assert [name for name, _ in errors.by_insertion()] == ["0 to 25 %", "25 to 50 %", "50 to 75 %", "all of it"]
    assert [each.rmse for _, each in errors.by_insertion()] == pytest.approx([0.0, 3e-3, 5e-3, 1e-3])
    np.testing.assert_allclose(errors.bias, 1e-3 * np.array([1.0, 1.5, 0.75]))
    assert errors.rmse**2 == pytest.approx(errors.bias @ errors.bias + errors.scatter**2, rel=1e-14)
    assert np.isnan(errors.angle_rms)


def test_moving_the_field_and_its_data_changes_nothing():
    shifted = trial(shift=(1e-3, 0.0, -1e-3))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_so3(np.array([0.5, -2.0, 0.3])), (0.1, 0.2, -0.4)
    R = T[:3, :3].T
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix((R @ shifted.turned).reshape(-1, 3, 3)).as_quat(scalar_first=True)
    elsewhere = replace(
        shifted, position=(shifted.position - T[:3, 3]) @ R.T, orientation=quaternions.reshape(3, 2, 4), T_world_field=T
    )
    for one, other in zip(accuracy([shifted]).places, accuracy([elsewhere]).places, strict=True):
        np.testing.assert_allclose(other.errors[WITH].vectors, one.errors[WITH].vectors, atol=1e-13)


def test_trackers_at_one_place_are_one_place_over_trials():
    one, two = trial((MIDDLE,)), trial((replace(MIDDLE, name="other"),), shift=(1e-3, 0.0, 0.0), name="second")
    (place,) = accuracy([one, two], gravity="with").places
    assert (place.n, place.trial.tolist()) == (6, [0, 0, 0, 1, 1, 1])
    np.testing.assert_allclose(place.errors[WITH].bias, (0.5e-3, 0.0, 0.0), atol=2e-6)


def test_samples_that_do_not_count_are_told():
    position = trial().position.copy()
    position[1, 0], orientation = np.nan, trial().orientation.copy()
    orientation[2, 0] = np.nan
    found = accuracy([trial(position=position, orientation=orientation)])
    assert found.fates == ({"middle": {"missing pose": 1, "kept": 1, NO_ORIENTATION: 1}, "tip": {"kept": 3}},)
    assert (found.counts, [each.n for each in found.places]) == ((4, 6), [1, 3])


def test_where_no_offset_comes_off_the_sensors_are_compared():
    found = accuracy([trial(orientation=None, shift=(0.0, 1e-3, 0.0))], gravity="with")
    errors = found.places[0].errors[WITH]
    np.testing.assert_allclose(errors.vectors, [(0.0, 1e-3, 0.0)] * 3, atol=2e-6)
    assert np.isnan(errors.angle_rms)
    np.testing.assert_allclose(found.places[0].measured, trial(shift=(0.0, 1e-3, 0.0)).position[:, 0], atol=1e-15)


def test_without_gravity_there_is_one_run():
    found = accuracy([trial(gravity=(0.0, 0.0, 0.0))])
    assert (found.runs, found.best_known) == ((WITHOUT,), WITHOUT)
    assert found.places[0].errors[WITHOUT].med < 2e-6


def test_a_leaning_model_is_found_by_its_lean():
    turn = np.array([0.02, -0.1, 0.03])
    given = trial((replace(MIDDLE, offset=(0.0, 0.0, 0.0)), replace(TIP, mass=0.0)))
    found = accuracy([replace(given, position=given.position @ exp_so3(turn).T, orientation=None)], gravity="with")
    lean, share = found.lean(ROBOT)
    np.testing.assert_allclose(lean, turn, atol=1e-4)
    assert share > 0.9999


def test_another_robot_or_setup_is_the_models():
    stiff = ROBOT.replace(youngs_modulus=1.2 * 75e9)
    found = accuracy([trial()], robot=stiff, setup=Setup(base_x=1e-3), gravity="with")
    assert found.robots == (stiff,)
    expected = sensors((MIDDLE, TIP), 0.7)[0][1] - sensors((MIDDLE, TIP), 0.7, robot=stiff)[0][1] - (1e-3, 0.0, 0.0)
    np.testing.assert_allclose(found.places[1].errors[WITH].vectors[2], expected, atol=2e-6)


def test_the_posture_is_the_solved_body():
    given = registered([trial()])[0]
    body = posture(given, 2)
    np.testing.assert_allclose(body.centerline[-1], given.position[2, 1], atol=2e-6)
    assert posture(given, 2, Setup().weightless()).tip[0] > body.tip[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"trials": []}, "trials = []: must be a sequence of one or more Trial"),
        ({"gravity": "off"}, "gravity = 'off': must be one of both, with, without"),
        ({"trials": [trial(tensions=(0.1,)).rows([0])]}, None),
    ],
)
def test_bad_input_by_name(change, said):
    if said is None:
        blind = replace(change["trials"][0], position=np.full((1, 2, 3), np.nan))
        change, said = {"trials": [blind]}, "trials = {'missing pose': 2}: must be of one or more used samples"
    with pytest.raises(InvalidInput) as error:
        accuracy(**({"trials": [trial(tensions=(0.1,))]} | change))
    assert str(error.value).startswith(said)
