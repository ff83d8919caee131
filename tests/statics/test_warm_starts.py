"""The accuracy holds whatever a solve started from, and the search for the number of steps always ends."""

import numpy as np
import pytest

from tendonrod import Tendon, progress, solve
from textbook import GRAVITY, prototype, rod


def error(shape, **loads) -> float:
    """Distance (m) of the tip from a cold solve at 10 pm."""
    exact = solve(shape.robot, shape.tensions, **loads, accuracy=1e-11)
    return float(np.linalg.norm(shape.tip - exact.tip))


@pytest.mark.parametrize("accuracy", [3.2e-7, 1e-6, 1.8e-6])
def test_a_tendon_that_ends_half_way_does_not_stop_the_refinement(accuracy):
    robot = prototype(1)
    robot = robot.replace(tendons=(Tendon.opposite_backbone(radius=5e-5, end=0.5 * robot.length_na),))
    assert error(solve(robot, 0.7, GRAVITY, accuracy=accuracy), gravity=GRAVITY) <= accuracy


@pytest.mark.parametrize("accuracy", [1e-6, 1e-7, 1e-9])
def test_a_growing_robot_keeps_its_accuracy(accuracy):
    """The estimate that a warm start takes over grows with the length."""
    for insertion in (np.linspace(1e-3, 1.0, 120), np.geomspace(1e-3, 1.0, 80)):
        last = progress(prototype(1), insertion, 0.0, 0.7, gravity=GRAVITY, accuracy=accuracy).shapes[-1]
        assert error(last, gravity=GRAVITY) <= accuracy
        assert 0.0 < last.error_estimate <= accuracy


def test_a_coarse_start_is_not_taken_for_an_accurate_one():
    first = solve(prototype(1), 0.7, GRAVITY)
    coarse = solve(prototype(1), 0.7, GRAVITY, steps=2, start=first)
    assert np.isnan(coarse.error_estimate)
    assert error(coarse, gravity=GRAVITY) > 1e-5
    assert error(solve(prototype(1), 0.7, GRAVITY, start=coarse), gravity=GRAVITY) <= 1e-6


@pytest.mark.parametrize("accuracy", [1e-5, 1e-6, 1e-7])
def test_a_fast_tendon_is_not_aliased(accuracy):
    """Eight turns along the rod: few steps would agree with twice as many by accident."""
    helix = rod(Tendon.helical(offset=1e-3, angle=0.0, turns=8.0), length=0.1)
    assert error(solve(helix, 0.5, accuracy=accuracy)) <= accuracy


def test_a_tendon_end_on_the_way_out_does_not_move_the_base():
    robot = prototype(1).replace(tendons=(Tendon.opposite_backbone(radius=5e-5, end=0.03),))
    for shape in progress(robot, np.linspace(0.02, 1.0, 50), 0.0, 0.7, gravity=GRAVITY, accuracy=1e-8).shapes:
        np.testing.assert_allclose(shape.position[0], [-robot.section.r_na, 0.0, 0.0], atol=1e-15)
