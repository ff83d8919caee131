"""`neighbour` finds what `solve` finds, from a start or from nothing, in bounded work or not at all."""

from math import radians

import numpy as np
import pytest

from tendonrod import InvalidInput, load_robot, solve
from tendonrod.statics.neighbour import Effort, neighbour
from tendonrod.statics.shape import Status
from tendonrod.surface import Plane

GRAVITY = (-9.81, 0.0, 0.0)


@pytest.fixture(scope="module")
def robot():
    return load_robot("exonav-1").replace(torsion="homogenized")


@pytest.mark.parametrize("surface", [None, Plane(point=(0.0, 6e-3, 0.0), normal=(0.0, -1.0, 0.0))])
def test_it_is_the_shape_that_solve_finds(robot, surface):
    asked = {"gravity": GRAVITY, "surface": surface}
    start = neighbour(robot, 0.4, None, 21, **asked)
    found = neighbour(robot, 0.42, start, 21, rotation=radians(2.0), **asked)
    trusted = neighbour(robot, 0.42, start, 21, Effort(is_checked=False), rotation=radians(2.0), **asked)
    alone = solve(robot, 0.42, rotation=radians(2.0), s=found.s, **asked)
    assert start.converged
    for each in (found, trusted):
        assert each.converged
        assert np.linalg.norm(each.centerline - alone.centerline, axis=1).max() < 2e-5
        assert each.error_estimate < 1e-5
    np.testing.assert_allclose(found.s, np.linspace(0.0, robot.length_na, 21))


def test_a_retracted_robot_is_one_point(robot):
    found = neighbour(robot, 0.4, None, 21, insertion=0.0)
    assert (found.s.tolist(), found.converged) == ([0.0], True)


def test_what_takes_more_steps_is_refused(robot):
    asked = {"gravity": GRAVITY, "accuracy": 1e-12}
    found = neighbour(robot, 0.7, None, 21, Effort(most_steps=40), **asked)
    assert found.status is Status.TOO_FINE
    assert np.isnan(found.centerline).all()
    content = neighbour(robot, 0.7, None, 21, Effort(most_steps=40, content=1e-6), **asked)
    assert content.converged
    assert 1e-12 < content.error_estimate < 1e-6


def test_input_is_checked(robot):
    with pytest.raises(InvalidInput, match="start"):
        neighbour(robot, 0.4, "last", 21)  # pyright: ignore[reportArgumentType] - the wrong type on purpose
    with pytest.raises(InvalidInput, match="samples"):
        neighbour(robot, 0.4, None, 1)
    with pytest.raises(InvalidInput, match="tensions"):
        neighbour(robot, -0.4, None, 21)
