"""Metrics of sessions with a known outcome, and the pressure of known forces."""

import json
from dataclasses import replace

import numpy as np
import pytest

from navigate.round_phantom import round_phantom, scenario
from tendonrod import solve
from tendonrod.cli.navigate_script import metrics_page
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.metrics import metrics, since_start
from tendonrod.navigate.ranges import SLACK
from tendonrod.navigate.script import Move, play
from tendonrod.navigate.session import Session
from tendonrod.navigate.touch import patch_pressure
from tendonrod.statics.contact import Contacts

WIDE = {"phantom": round_phantom(0.5e-3, 60e-3), "gravity": (0.0, 0.0, 0.0)}  # nothing near, nothing heavy


STEP = 0.1  # s


def measured(moves, **changes):
    return metrics(play(Session(scenario(**changes)), [Move(duration=t, jog=jog) for t, jog in moves], STEP))


def test_a_straight_robot_goes_as_far_as_it_is_inserted():
    found = measured([(2.0, Jog(insertion=5e-3)), (1.0, Jog(insertion=-5e-3)), (1.0, Jog())], **WIDE)
    assert (found.duration, found.samples) == (pytest.approx(4.0), 41)
    assert found.insertion == pytest.approx(10e-3, rel=1e-3)  # of the neutral axis, 0.07 % longer than the tube
    assert found.path == pytest.approx(15e-3, rel=1e-3)
    assert found.follow_the_leader_max < 1e-9
    assert found.pressure is None
    assert found.force == 0.0


def test_constant_tension_without_weight_follows_the_leader():
    found = measured([(7.0, Jog(tension=0.1)), (6.0, Jog(insertion=5e-3))], **WIDE)
    assert found.follow_the_leader_max < 5e-6
    weighty = measured([(7.0, Jog(tension=0.1)), (6.0, Jog(insertion=5e-3))], phantom=WIDE["phantom"])
    assert weighty.follow_the_leader_max > 10.0 * found.follow_the_leader_max


def test_lateral_motion_is_off_the_leaders_path():
    moves = [(5.0, Jog(tension=0.1)), (6.0, Jog(insertion=5e-3)), (1.0, Jog(rotation=0.5)), (0.2, Jog(insertion=5e-3))]
    assert measured(moves, **WIDE).follow_the_leader_max > 1e-3


def test_clearance_is_the_smallest_and_says_where():
    session = Session(scenario())
    moves = [Move(duration=3.0, jog=Jog(tension=0.2)), Move(duration=3.0, jog=Jog(insertion=5e-3))]
    shown = list(play(session, moves, STEP))
    found = metrics(shown).clearance["cord"]
    assert found.value == min(float(each.clearance["cord"].min()) for each in shown)
    where = next(each for each in shown if each.time == found.time)
    assert found.s in where.s
    assert found.tip == tuple(where.tip)


def test_times_are_counted_from_the_first_snapshot():
    """A record may begin in the middle of a session: its numbers are those of a session of its own."""
    moves = [Move(duration=3.0, jog=Jog(tension=0.2)), Move(duration=3.0, jog=Jog(insertion=5e-3))]
    shown = list(play(Session(scenario()), moves, STEP))
    late = [replace(each, time=each.time + 64.0) for each in shown]  # 64 s: times of 0.1 s lose few bits
    assert [each.time for each in since_start(late)] == pytest.approx([each.time for each in shown])
    own, found = metrics(shown), metrics(late)
    assert found.clearance["cord"].time == pytest.approx(own.clearance["cord"].time)
    assert [each.time for each in found.targets.values()] == pytest.approx([each.time for each in own.targets.values()])
    assert list(since_start(shown)) == shown  # nothing is copied where there is nothing to shift


@pytest.mark.parametrize(("tension", "on", "has_limit"), [(0.0, "canal", False), (0.15, "cord", True)])
def test_the_highest_pressure_says_what_it_is_on(tension, on, has_limit):
    """A straight robot runs into the canal's wall, whose pressure nothing limits; a bent one lies against the cord."""
    here = scenario()
    found = measured([(5.0, Jog(tension=tension)), (6.0, Jog(insertion=5e-3))])
    assert found.pressure is not None
    assert found.pressed == on
    assert min(found.clearance, key=lambda name: found.clearance[name].value) == on
    said = metrics_page(here, "moves.csv", found)
    assert f"kPa, on the {on}" in said
    assert ("for which there is no limit" in said) is not has_limit
    assert measured([(1.0, Jog(insertion=5e-3))], **WIDE).pressed == ""


def test_shares_of_time_are_those_of_the_samples():
    found = measured([(1.0, Jog(insertion=5e-3)), (1.0, Jog(tension=0.05)), (2.0, Jog(tension=0.05))], **WIDE)
    lifted = (0.0666 * 1.067 - SLACK) / 0.05  # s below the lift-off tension: open section, EI_y
    assert found.outside_model == pytest.approx(lifted / 4.0, abs=STEP / 4.0)
    assert found.outside_limits == 0.0


def test_targets_are_told_with_their_time():
    moves = [(1.0, Jog(tension=0.25)), (2.0, Jog(insertion=3e-3))]
    found = measured(moves)
    arrival = found.targets["near@L2"]
    assert 1.0 < arrival.time < 3.0
    assert arrival.nearest == found.nearest["near@L2"] <= 1.5e-3
    assert arrival.within_limits


def test_metrics_are_json():
    found = measured([(0.1, Jog())], **WIDE).to_dict()
    assert json.loads(json.dumps(found, allow_nan=False))["follow_the_leader_rms"] is None


def contacts(s, force):
    """Contacts of these forces (N) at arc lengths s (m)."""
    s, force = np.array(s), np.array(force)
    zeros, up = np.zeros(s.size), np.tile([1.0, 0.0, 0.0], (s.size, 1))
    return Contacts(s=s, point=up, normal=up, gap=zeros, line_force=zeros, force=force, pressure=zeros)


def test_pressure_of_a_point_force_is_spread_over_one_diameter():
    shape = solve(scenario().robot, s=np.linspace(0.0, 75e-3, 301))
    d = 2.0 * float(shape.robot.outer_radius(0.0)[0])
    at = patch_pressure(np.array([30e-3, 30e-3 + 0.5 * d, 30e-3 + d]), contacts([30e-3], [2e-3]), shape)
    np.testing.assert_allclose(at, np.array([1.0, 0.5, 0.0]) * 2e-3 / d**2, rtol=1e-9, atol=1e-9)
    tip = patch_pressure(np.array([shape.length]), contacts([shape.length], [2e-3]), shape)
    np.testing.assert_allclose(tip, 2.0 * 2e-3 / d**2, rtol=1e-9)


def test_pressure_of_a_line_force_does_not_depend_on_the_grid():
    shape = solve(scenario().robot, s=np.linspace(0.0, 75e-3, 301))
    d, line = 2.0 * float(shape.robot.outer_radius(0.0)[0]), 3.0  # m, N/m
    for n in (200, 400, 800):
        s = (np.arange(n) + 0.5) * shape.length / n
        even = contacts(s, np.full(n, line * shape.length / n))
        found = patch_pressure(np.linspace(0.0, shape.length, 50), even, shape)
        np.testing.assert_allclose(found, line / d, rtol=0.06)
