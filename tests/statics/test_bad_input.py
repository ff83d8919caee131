"""Bad input is named: field, value, what is allowed, on one line."""

import numpy as np
import pytest

from tendonrod import InvalidInput, TendonrodError, solve
from textbook import helix_rod, prototype

NAN, INF = float("nan"), float("inf")
VECTORS = ("gravity", "tip_force", "tip_moment", "distributed_force", "distributed_moment")
BAD_VECTORS = [(0.0, 0.0), (0.0, 0.0, 0.0, 0.0), (0.0, NAN, 0.0), (INF, 0.0, 0.0), 9.81, "down", None, np.zeros((3, 1))]
BAD = [
    *(("tensions", value) for value in (-0.1, NAN, INF, -INF, "0.7", None, (0.1, 0.2), (), [-0.1], [NAN])),
    *((name, value) for name in VECTORS for value in BAD_VECTORS),
    *(("insertion", value) for value in (-1e-9, 1.0 + 1e-9, NAN, INF, "all", None)),
    *(("rotation", value) for value in (NAN, INF, "half", None)),
    *(("accuracy", value) for value in (0.0, -1e-6, NAN, INF, "fine", None)),
    *(("steps", value) for value in (0, -3, 2.5, NAN, "many")),
    *(("s", value) for value in ([-1e-6], [0.0, 0.1], [NAN], [INF], [[0.0, 0.01]], "all")),
    ("start", "yesterday"),
    ("start", np.zeros(3)),
]


@pytest.mark.parametrize(("name", "value"), BAD, ids=[f"{name}-{value!r}" for name, value in BAD])
def test_bad_value_is_named(name, value):
    arguments = {"tensions": 0.7, name: value}
    with pytest.raises(InvalidInput) as caught:
        solve(prototype(1), **arguments)
    assert caught.value.field.startswith(name)
    assert caught.value.allowed
    assert str(caught.value).startswith(name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), (1.0, -2.0, 3.0), (1.0, 2.0, NAN), -1.0])
def test_tensions_of_several_tendons(value):
    with pytest.raises(InvalidInput, match="tensions"):
        solve(helix_rod(), value)


@pytest.mark.parametrize("robot", ["exonav-1", None, 3])
def test_robot_must_be_a_robot(robot):
    with pytest.raises(InvalidInput, match="robot"):
        solve(robot, 0.7)


def test_bad_input_is_an_error_of_the_package_and_a_value_error():
    assert issubclass(InvalidInput, TendonrodError)
    assert issubclass(InvalidInput, ValueError)


def test_sample_beyond_the_exposed_length_is_refused():
    robot = prototype(1)
    length = robot.section.L_na
    assert solve(robot, 0.7, s=[0.0, length]).s[-1] == length
    with pytest.raises(InvalidInput, match="s"):
        solve(robot, 0.7, insertion=0.5, s=[0.0, length])
