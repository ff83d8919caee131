"""Trials: which samples are used and why others are not; shapes, places and bad input by name."""

import numpy as np
import pytest

from tendonrod import InvalidInput, PlainRod, Robot, load_robot
from tendonrod.measurement.trial import (
    BASE,
    KEPT,
    MISSING_POSE,
    NO_DRIVE,
    NO_PLACE,
    POOR_QUALITY,
    REPEATED_TIME,
    RETRACTED,
    Tracker,
    Trial,
)

ROBOT = load_robot("exonav-1")
LENGTH = ROBOT.length_na
TRACKERS = (Tracker(name="base", on=BASE), Tracker(name="middle", at=0.5 * LENGTH), Tracker(name="tip"))


def trial(n=6, trackers=TRACKERS, **fields) -> Trial:
    """All is well in it but what ``fields`` say."""
    k = len(trackers)
    given = {"name": "a", "robot": ROBOT, "trackers": trackers, "time": np.arange(n) / 40.0}
    given |= {"position": np.zeros((n, k, 3)), "tensions": np.linspace(0.1, 0.6, n), "quality": np.full((n, k), 1e-4)}
    return Trial(**(given | fields))


def with_nan(shape, *where, value=0.0):
    found = np.full(shape, value)
    for each in where:
        found[each] = np.nan
    return found


def test_where_all_is_well_all_is_kept():
    assert (trial().fates == KEPT).all()
    assert trial().counts() == {"base": {KEPT: 6}, "middle": {KEPT: 6}, "tip": {KEPT: 6}}


@pytest.mark.parametrize(
    ("fields", "row", "fates"),
    [
        ({"position": with_nan((6, 3, 3), (2, 2, 0))}, 2, (KEPT, KEPT, MISSING_POSE)),
        ({"time": [0.0, 0.1, 0.2, 0.2, 0.3, 0.4]}, 3, (REPEATED_TIME,) * 3),
        ({"time": [0.0, 0.1, np.nan, 0.2, 0.3, 0.4]}, 2, (REPEATED_TIME,) * 3),
        ({"quality": np.arange(18.0).reshape(6, 3) * 1e-3, "quality_limit": 4.5e-3}, 1, (KEPT, KEPT, POOR_QUALITY)),
        ({"tensions": [0.1, np.nan, 0.2, 0.3, 0.4, 0.5]}, 1, (KEPT, NO_DRIVE, NO_DRIVE)),
        ({"insertion": with_nan(6, 4, value=1.0)}, 4, (KEPT, NO_PLACE, NO_PLACE)),
        ({"rotation": with_nan(6, 4)}, 4, (KEPT, NO_PLACE, NO_PLACE)),
        ({"insertion": [1.0, 0.9, 0.8, 0.5, 0.4, 0.0]}, 3, (KEPT, KEPT, KEPT)),
        ({"insertion": [1.0, 0.9, 0.8, 0.5, 0.4, 0.0]}, 4, (KEPT, RETRACTED, KEPT)),
    ],
)
def test_every_reason_has_its_fate(fields, row, fates):
    found = trial(**fields)
    assert tuple(found.fates[row]) == fates
    assert tuple(found.kept[row]) == tuple(each == KEPT for each in fates)


def test_of_several_reasons_the_first_is_told():
    """What is put right one after the other gives way to the next reason."""
    wrong = {
        "position": np.full((2, 3, 3), np.nan),
        "time": [1.0, 1.0],
        "quality": np.full((2, 3), 1.0),
        "tensions": [0.1, np.nan],
        "rotation": [0.0, np.nan],
        "insertion": [1.0, 0.3],
    }
    told = []
    for name in list(wrong):
        told.append(trial(n=2, quality_limit=0.5, **wrong).fates[1, 1])
        del wrong[name]
    assert told == [MISSING_POSE, REPEATED_TIME, POOR_QUALITY, NO_DRIVE, NO_PLACE, RETRACTED]


@pytest.mark.parametrize(
    ("time", "wrong"),
    [
        ([0.0, 0.5, 0.1, 0.2, 0.5, 0.6], [1]),  # one that runs ahead costs itself only
        ([0.0, 1.0, 1.0, 2.0, 2.0, 3.0], [2, 4]),  # of equal ones the first stands
        ([0.0, 1.0, 2.0, 999.0, 4.0, 5.0], [3]),
        ([3.0, 4.0, np.nan, 0.0, 5.0, 6.0], [2, 3]),
    ],
)
def test_times_increase_along_what_is_kept(time, wrong):
    found = trial(time=time)
    assert np.flatnonzero(found.fates[:, 0] == REPEATED_TIME).tolist() == wrong


def test_without_a_limit_or_an_indicator_no_quality_is_poor():
    assert trial(quality=np.full((6, 3), 1e3)).kept.all()
    assert trial(quality=None, quality_limit=1e-9).kept.all()


def test_a_displacement_drives_as_a_tension_does():
    given = {"tensions": [0.1, np.nan, np.nan, 0.1, 0.1, 0.1], "displacements": [np.nan, 1e-3, np.nan, 0.0, 0.0, 0.0]}
    assert (trial(**given).fates[:, 2] == NO_DRIVE).tolist() == [False, False, True, False, False, False]


def test_a_rod_without_tendons_needs_no_drive():
    body = PlainRod(length=0.1, radius=1e-3, youngs_modulus=2e11, shear_modulus=8e10, density=8e3)
    robot = Robot(name="rod", body=body)
    assert trial(robot=robot, trackers=(Tracker(name="tip"),), tensions=None).kept.all()


def test_counts_say_what_the_tracker_said_of_missing_frames():
    state = np.full((6, 3), "", dtype=object)
    state[1, 2], state[3, 2] = "out of volume", "OK"
    found = trial(position=with_nan((6, 3, 3), (1, 2), (2, 2)), state=state).counts()
    assert found["tip"] == {KEPT: 4, f"{MISSING_POSE} (out of volume)": 1, MISSING_POSE: 1}
    assert sum(found["tip"].values()) == 6


@pytest.mark.parametrize("which", [[4, 1], slice(1, 5, 3), np.arange(6) % 3 == 1, [-2, -5]])
def test_rows_are_the_samples_asked_for(which):
    rng = np.random.default_rng(0)
    state = np.array([[f"{i}{j}" for j in range(3)] for i in range(6)], dtype=object)
    whole = trial(
        position=rng.normal(size=(6, 3, 3)), insertion=rng.uniform(size=6), state=state, quality_limit=1.0,
        gravity=(0.0, 0.0, -9.81), notes="kept",
    )  # fmt: skip
    part = whole.rows(which)
    for name in ("time", "position", "tensions", "insertion", "rotation", "quality", "state"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[which])
    assert (part.robot, part.trackers, part.gravity, part.notes) == (ROBOT, TRACKERS, whole.gravity, "kept")


def test_no_rows_are_refused():
    with pytest.raises(InvalidInput, match=r"which = .*one or more of the 6 samples"):
        trial().rows([])


def test_the_base_is_nowhere_on_the_robot_and_the_tip_at_its_end():
    almost = Tracker(name="end", at=LENGTH * (1.0 - 1e-12))
    found = trial(trackers=(*TRACKERS, almost), position=np.zeros((6, 4, 3)), quality=None)
    np.testing.assert_array_equal(found.places, [np.nan, 0.5 * LENGTH, LENGTH, LENGTH])
    assert found.on_robot.tolist() == [False, True, True, True]
    assert found.trackers[3].at is None


def test_with_one_tracker_or_tendon_a_column_may_be_left_out():
    found = trial(trackers=TRACKERS[2:], position=np.zeros((6, 1, 3)), quality=np.full(6, 2e-4))
    assert (found.quality.shape, found.tensions.shape, found.displacements.shape) == ((6, 1), (6, 1), (6, 1))
    np.testing.assert_array_equal(trial(insertion=0.5, rotation=[0.2]).insertion, np.full(6, 0.5))


def test_quaternions_have_their_scalar_first():
    given = np.full((6, 3, 4), np.nan)
    given[2, 1] = np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)
    turned = trial(orientation=given).turned
    np.testing.assert_allclose(turned[2, 1], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert np.isnan(turned).any(axis=(2, 3)).sum() == 17


def test_arrays_are_read_only_copies():
    position = np.zeros((6, 3, 3))
    found = trial(position=position)
    position[:] = 1.0
    assert (found.position == 0.0).all()
    for name in ("time", "position", "tensions", "fates", "kept", "places", "turned", "state"):
        assert not getattr(found, name).flags.writeable, name


def test_a_trial_says_in_a_line_what_it_is():
    found = trial(position=with_nan((6, 3, 3), 2))
    assert repr(found) == f"Trial(a: {ROBOT.name}, 6 samples of 3, 5 used)"


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"name": " "}, "name = ' ': must be a text that is not empty"),
        ({"robot": "exonav-1"}, "robot = 'exonav-1': must be a Robot"),
        ({"trackers": ()}, "trackers = (): must be a sequence of one or more Tracker"),
        ({"trackers": (TRACKERS[1],) * 3}, "trackers = ['middle', 'middle', 'middle']: must be of different names"),
        ({"trackers": (*TRACKERS[:2], Tracker(name="far", at=1.0))}, "trackers[2].at = 1.0: must be from 0 to the"),
        ({"time": []}, "time = []: must be one or more samples"),
        ({"position": np.zeros((6, 2, 3))}, "position = 'an array of shape (6, 2, 3)': must be of shape (6, 3, 3)"),
        ({"orientation": np.zeros((6, 3, 3))}, "orientation = 'an array of shape (6, 3, 3)': must be of shape (6, 3, "),
        ({"tensions": np.zeros((6, 2))}, "tensions = 'an array of shape (6, 2)': must be of shape (6, 1)"),
        ({"quality": np.zeros(6)}, "quality = 'an array of shape (6,)': must be of shape (6, 3)"),
        ({"quality": np.full((6, 3), -1.0)}, "quality[0][0] = -1.0: must be >= 0"),
        ({"position": np.full((6, 3, 3), np.inf)}, "position[0] = inf: must be finite, or NaN"),
        ({"orientation": np.ones((6, 3, 4))}, "orientation[0][0] = 2.0: must be a quaternion (w, x, y, z) of length 1"),
        ({"insertion": [1.0, 1.0, 1.2, 1.0, 1.0, 1.0]}, "insertion[2] = 1.2: must be from 0 to 1"),
        ({"rotation": [0.0, 1.0]}, "rotation = '2 values': must be one number or 6"),
        ({"state": ["OK"] * 6}, "state = ['OK', 'OK', "),
        ({"gravity": (0.0, 9.81)}, "gravity = "),
        ({"T_world_field": np.diag([1.0, 1.0, -1.0, 1.0])}, "T_world_field = "),
        ({"quality_limit": -1.0}, "quality_limit = -1.0: must be "),
        ({"position_noise": np.nan}, "position_noise = nan: must be "),
        ({"tension_noise": "5 mN"}, "tension_noise = '5 mN': must be "),
        ({"notes": None}, "notes = None: must be a text"),
        ({"origin": {"seed": 1}}, "origin = {'seed': 1}: must be a mapping from texts to texts"),
    ],
)
def test_bad_input_is_named(fields, said):
    with pytest.raises(InvalidInput) as error:
        trial(**fields)
    assert str(error.value).startswith(said)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"name": ""}, "name = '': must be a text that is not empty"),
        ({"on": "holder"}, "on = 'holder': must be one of robot, base"),
        ({"on": BASE, "at": 0.0}, "at = 0.0: must be left out for a tracker on the base"),
        ({"at": -1e-3}, "at = -0.001: must be "),
        ({"point": (0.0,)}, "point = "),
        ({"offset": (0.0, np.nan, 0.0)}, "offset"),
        ({"turn": 0.3}, "turn = 0.3: must be "),
        ({"mass": -1.0}, "mass = -1.0: must be "),
    ],
)
def test_bad_trackers_are_named(fields, said):
    with pytest.raises(InvalidInput) as error:
        Tracker(**({"name": "t"} | fields))
    assert str(error.value).startswith(said)


def test_the_arm_goes_from_the_tubes_axis_to_the_sensor():
    assert Tracker(name="t", point=(1e-3, 2e-3), offset=(3e-3, 5e-3, 7e-3)).arm == (4e-3, 7e-3, 7e-3)
