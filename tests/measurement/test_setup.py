"""Setups: every number by its name, the pose of the exit, gravity, and the masses that hang on the robot."""

import numpy as np
import pytest

from measurement.known_bench import GRAVITY, ROBOT, along, blank
from tendonrod import InvalidInput, PlainRod, Robot
from tendonrod.measurement.setup import BENCH, NOT_BELOW_ZERO, Setup, places, the_robot
from tendonrod.measurement.trial import BASE, Tracker
from tendonrod.measurement.unknowns import unknowns
from tendonrod.rotation import exp_so3

TRACKERS = (Tracker(name="base", on=BASE), *along([0.5], mass=1e-4, offset=(1e-3, 2e-3, 0.0)), Tracker(name="tip"))
TRIAL = blank([0.1, 0.4], TRACKERS)
NUMBERS = [name for name, value in ROBOT.parameters().items() if value != 0.0]


@pytest.mark.parametrize("name", BENCH)
def test_every_number_of_the_bench_is_changed_alone(name):
    before = Setup(base_tilt_x=0.1, tip_mass=2e-4, tracker_mass=1e-4, tension_scale=1.1)
    after = before.changed({name: 0.25}, [TRIAL])
    assert after.value(name, [TRIAL]) == 0.25
    for other in set(BENCH) - {name}:
        assert after.value(other, [TRIAL]) == before.value(other, [TRIAL])
    assert after.robot is None


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_of_the_robot_is_changed_alone(name):
    value = ROBOT.parameters()[name]
    assert Setup().value(name, [TRIAL]) == value
    after = Setup(tip_mass=1e-4).changed({name: 1.01 * value, "base_x": 1e-3}, [TRIAL])
    assert after.robot_of(TRIAL) == ROBOT.replace(**{name: 1.01 * value})
    assert (after.base_x, after.tip_mass) == (1e-3, 1e-4)


def test_all_numbers_may_be_asked_for_and_names_that_are_not_known_list_them():
    names = (*BENCH, *ROBOT.parameters())
    assert tuple(each.name for each in unknowns(names, [TRIAL], Setup())) == names
    with pytest.raises(InvalidInput) as error:
        Setup().value("stiffness", [TRIAL])
    assert error.value.field == "free"
    assert all(name in str(error.value) for name in names)
    rod = PlainRod(length=0.1, radius=1e-3, youngs_modulus=2e11, shear_modulus=8e10, density=8e3)
    with pytest.raises(InvalidInput, match="stiffness factors belong to the torsion model homogenized"):
        Setup(robot=Robot(name="rod", body=rod)).value("torsion_factor", [TRIAL])


def test_bounds_keep_numbers_where_there_are_robots_and_benches():
    for each in unknowns((*BENCH, *NUMBERS), [TRIAL], Setup()):
        assert each.low <= each.start <= each.high
        assert each.plausible > 0.0
        if each.name in NOT_BELOW_ZERO:
            assert each.low == 0.0


@pytest.mark.parametrize(
    ("free", "said"),
    [
        ("youngs_modulus", "free = 'youngs_modulus': must be one or more names"),
        ((), "free = (): must be one or more names"),
        (("tip_mass", "tip_mass"), "free = 'tip_mass': must be given once"),
    ],
)
def test_what_cannot_be_freed_is_named(free, said):
    with pytest.raises(InvalidInput) as error:
        unknowns(free, [TRIAL], Setup())
    assert str(error.value).startswith(said)


def test_the_robot_of_several_trials_must_be_one():
    other = blank([0.1], robot=ROBOT.replace(youngs_modulus=60e9), trackers=TRACKERS[2:])
    assert the_robot(Setup(), [TRIAL, TRIAL]) is ROBOT
    assert the_robot(Setup(robot=ROBOT), [TRIAL, other]) is ROBOT
    with pytest.raises(InvalidInput, match=r"trials = .*of one robot"):
        Setup().value("youngs_modulus", [TRIAL, other])
    assert Setup(tip_mass=1e-4).value("tip_mass", [TRIAL, other]) == 1e-4


def test_the_exit_is_turned_about_itself_and_shifted():
    assert Setup().exit_pose is None
    pose = Setup(base_x=1e-3, base_z=-2e-3, base_tilt_x=0.1, base_tilt_y=-0.2, base_roll=0.3).exit_pose
    assert pose is not None
    np.testing.assert_allclose(pose[:3, :3], exp_so3(np.array([0.1, -0.2, 0.3])), atol=1e-15)
    np.testing.assert_array_equal(pose[:, 3], [1e-3, 0.0, -2e-3, 1.0])
    shifted = Setup(base_y=1e-3).exit_pose
    assert shifted is not None
    np.testing.assert_array_equal(shifted[:3, :3], np.eye(3))


def test_gravity_is_turned_and_may_be_left_out():
    assert Setup(base_tilt_x=0.5).gravity_of(TRIAL) == GRAVITY
    turned = Setup(gravity_tilt_z=np.pi / 2).gravity_of(TRIAL)
    np.testing.assert_allclose(turned, [0.0, -9.81, 0.0], atol=1e-14)
    assert Setup(gravity_tilt_z=0.3).weightless().gravity_of(TRIAL) == (0.0, 0.0, 0.0)


def test_masses_hang_where_they_are_and_only_where_they_weigh():
    (middle,) = Setup(holder_x=5e-4).loads(TRIAL)
    assert (middle.mass, middle.at) == (1e-4, pytest.approx(0.5 * ROBOT.length_na))
    np.testing.assert_allclose(middle.offset, [1.5e-3, 2e-3, 0.0])
    tip, middle, end = Setup(tip_mass=3e-4, tracker_mass=2e-4).loads(TRIAL)
    assert (tip.mass, tip.at, tip.offset) == (3e-4, None, (0.0, 0.0, 0.0))
    assert [middle.mass, end.mass] == pytest.approx([3e-4, 2e-4])
    assert end.at is None


def test_masses_that_are_to_be_changed_are_there_though_they_weigh_nothing():
    assert [each.mass for each in Setup().loads(TRIAL, ("tip_mass", "tracker_mass"))] == [0.0, 1e-4, 0.0]


def test_trackers_keep_their_share_of_a_robot_that_is_longer():
    longer = ROBOT.replace(length=1.2 * ROBOT.parameters()["length"])
    found = places(TRIAL, longer)
    assert np.isnan(found[0])
    np.testing.assert_allclose(found[1:], [0.5 * longer.length_na, longer.length_na])
    (middle,) = Setup(robot=longer).loads(TRIAL)
    assert middle.at == pytest.approx(0.5 * longer.length_na)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"robot": "exonav-1"}, "robot = 'exonav-1': must be a Robot, or None"),
        ({"weight": 0}, "weight = 0: must be True or False"),
        ({"tension_scale": 0.0}, "tension_scale = 0.0: must be > 0"),
        ({"tip_mass": -1e-4}, "tip_mass = -0.0001: must be >= 0"),
        ({"tracker_mass": np.nan}, "tracker_mass = nan: must be "),
        ({"base_x": "1 mm"}, "base_x = '1 mm': must be a finite number"),
    ],
)
def test_bad_input_is_named(fields, said):
    with pytest.raises(InvalidInput) as error:
        Setup(**fields)
    assert str(error.value).startswith(said)
