"""Ways to targets: planned for the free robot, shown with contact, and what is said where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from tendonrod import InvalidInput, solve
from tendonrod.navigate.planner import approach, moves_of
from tendonrod.navigate.reach import reach
from tendonrod.navigate.scenario import Scenario, load_scenario
from tendonrod.navigate.script import read_script, write_script

TARGET = "lateral-right@T10"


@pytest.fixture(scope="module")
def printed() -> Scenario:
    return load_scenario("exonav-1", "printed")


def test_the_way_to_a_lateral_target_is_carried_out_inside_all_limits(printed):
    found = reach(printed, TARGET)
    assert found.approach.reached
    assert found.reached
    assert found.within_limits
    assert found.limited_by == ()
    assert found.pressed is None
    assert found.nearest <= printed.phantom.targets[TARGET].tolerance
    assert found.end.insertion == pytest.approx(found.approach.insertion, abs=1e-9)
    assert found.end.rotation == pytest.approx(found.approach.rotation, abs=1e-9)
    assert found.end.tension == pytest.approx((found.approach.tension,), abs=1e-9)


def test_the_plan_says_of_its_end_what_a_solve_of_its_own_says(printed):
    way = approach(printed, TARGET)
    shape = solve(
        printed.robot, way.tension, gravity=printed.gravity, insertion=way.insertion, rotation=way.rotation,
        exit_pose=way.tube.pose,
    )  # fmt: skip
    tip = shape.at(np.array([shape.length])).centerline[0]
    assert np.linalg.norm(tip - np.array(printed.phantom.targets[TARGET].position)) == pytest.approx(way.miss, abs=3e-5)


def test_the_same_seed_gives_the_same_way_and_another_seed_another(printed):
    first, again, other = (approach(printed, TARGET, seed) for seed in (3, 3, 4))
    assert first == again
    assert first.tube != other.tube


def test_a_script_on_file_is_the_way(printed, tmp_path):
    way = approach(printed, TARGET)
    moves = moves_of(way, printed.robot)
    write_script(tmp_path / "way.csv", moves)
    read = read_script(tmp_path / "way.csv")
    exposed = sum(move.duration * move.jog.insertion for move in read)
    assert exposed == pytest.approx(way.insertion * printed.robot.section.L, rel=1e-9)
    assert sum(move.duration * move.jog.tension for move in read) == pytest.approx(way.tension, rel=1e-9)
    assert sum(move.duration * move.jog.rotation for move in read) == pytest.approx(way.rotation, rel=1e-9)
    assert read[0].tube == pytest.approx(moves[0].tube)


def test_what_a_robot_is_too_short_for_is_told_with_the_nearest_approach(printed, monkeypatch):
    """5 mm of robot cannot go round the cord, whatever is left out and however long one looks."""
    monkeypatch.setattr("tendonrod.navigate.planner.GENERATIONS", 5)
    short = replace(printed, limits=replace(printed.limits, insertion=0.06))
    found = reach(short, "ventral@T10")
    assert not found.reached
    assert found.limited_by == ()
    assert found.nearest > printed.phantom.targets["ventral@T10"].tolerance
    assert found.end.exposed <= 0.06 * printed.robot.length_na + 1e-9


def test_an_unknown_target_is_named_with_those_there_are(printed):
    with pytest.raises(InvalidInput, match=r"target.*ventral@C1.*ventral@T8"):
        approach(printed, "ventral@C1")
