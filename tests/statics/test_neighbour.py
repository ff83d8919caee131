"""`neighbour` finds what `solve` finds, from a start or from nothing, in bounded work or not at all."""

from math import radians

import numpy as np
import pytest

from tendonrod import InvalidInput, load_robot, solve
from tendonrod.statics import neighbour as neighbouring
from tendonrod.statics.neighbour import Effort, motion, neighbour
from tendonrod.statics.newton import NewtonSolution
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


@pytest.mark.parametrize("most", [40, 80, 160])
def test_from_a_start_on_a_finer_grid_than_allowed_the_finest_two_are_tried(robot, most):
    asked = {"gravity": GRAVITY, "accuracy": 1e-12}
    start = neighbour(robot, 0.4, None, 21, Effort(most_steps=320, content=1e-6), **asked)
    assert start.steps == 320
    found = neighbour(robot, 0.41, start, 21, Effort(most_steps=most, content=1e-4), **asked)
    assert found.converged
    assert found.steps == most
    assert neighbour(robot, 0.41, start, 21, Effort(most_steps=most), **asked).status is Status.TOO_FINE


def test_without_room_for_two_grids_nothing_is_given(robot):
    assert neighbour(robot, 0.4, None, 21, Effort(most_steps=30)).status is Status.TOO_FINE


def test_only_what_two_grids_find_far_away_is_given_early(robot, monkeypatch):
    """Here one grid alone finds it far."""
    monkeypatch.setattr(neighbouring, "motion", lambda start, shape: float(shape.steps == 40))
    asked = {"gravity": GRAVITY, "accuracy": 1e-12}
    start = neighbour(robot, 0.4, None, 21, gravity=GRAVITY)
    assert neighbour(robot, 0.41, start, 21, Effort(farthest=0.5, content=1e-6), **asked).steps == 160


def test_on_the_grid_of_the_start_alone_few_looks_are_allowed(robot, monkeypatch):
    wall, allowed, real = Plane(point=(0.0, 6e-3, 0.0), normal=(0.0, -1.0, 0.0)), [], NewtonSolution.run
    asked = {"surface": wall, "contact_tolerance": 1e-4}
    start = neighbour(robot, 0.4, None, 21, surface=wall, contact_tolerance=1e-5)

    def noted(self, start):
        allowed.append(self.most_looks)
        return real(self, start)

    monkeypatch.setattr(NewtonSolution, "run", noted)
    for looks in (24, 5):
        assert neighbour(robot, 0.401, start, 21, Effort(is_checked=False, most_looks=looks), **asked).converged
    assert allowed == [neighbouring.FEW_LOOKS, 5]
    assert 5 < neighbouring.FEW_LOOKS < 24


@pytest.mark.parametrize("samples", [21, 48])
def test_what_two_grids_find_far_away_is_given_without_finer_ones(robot, samples):
    """The tip goes round by 30 degrees, which is some 10 mm."""
    asked = {"gravity": GRAVITY, "rotation": radians(30.0), "accuracy": 1e-12}
    start = neighbour(robot, 0.4, None, samples, gravity=GRAVITY)
    near, far = (
        neighbour(robot, 0.4, start, 21, Effort(farthest=each, content=1e-6), **asked) for each in (20e-3, 5e-3)
    )
    assert 5e-3 < np.linalg.norm(near.tip - start.tip) < 20e-3
    assert far.converged
    assert far.steps < near.steps == 160
    assert np.linalg.norm(far.tip - near.tip) < 4.0 * far.error_estimate


def test_finer_grids_are_allowed_fewer_looks_at_the_surface(robot, monkeypatch):
    wall, allowed, real = Plane(point=(0.0, 6e-3, 0.0), normal=(0.0, -1.0, 0.0)), {}, NewtonSolution.run

    def noted(self, start):
        allowed[self.problem.steps] = self.most_looks
        return real(self, start)

    monkeypatch.setattr(NewtonSolution, "run", noted)
    neighbour(robot, 0.4, None, 21, Effort(most_looks=24), surface=wall, accuracy=1e-8, contact_tolerance=1e-8)
    assert {steps: allowed[steps] for steps in (20, 40, 80, 160)} == {20: 24, 40: 24, 80: 24, 160: 12}


def test_motion_is_the_largest_of_the_axis(robot):
    start, turned = (neighbour(robot, 0.4, None, 21, rotation=turn) for turn in (0.0, 0.1))
    chord = 2.0 * np.sin(0.05) * np.hypot(*start.centerline[:, :2].T).max()
    assert motion(start, turned) == pytest.approx(chord, rel=1e-6)
    retracted = neighbour(robot, 0.4, None, 21, insertion=0.0)
    assert motion(retracted, start) == pytest.approx(robot.length_na)


def test_input_is_checked(robot):
    with pytest.raises(InvalidInput, match="start"):
        neighbour(robot, 0.4, "last", 21)  # pyright: ignore[reportArgumentType] - the wrong type on purpose
    with pytest.raises(InvalidInput, match="samples"):
        neighbour(robot, 0.4, None, 1)
    with pytest.raises(InvalidInput, match="tensions"):
        neighbour(robot, -0.4, None, 21)
