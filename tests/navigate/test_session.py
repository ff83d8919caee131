"""A session's truths: the solver's own shapes, walls that are kept, limits that stop, the same bits again."""

import subprocess
import sys
from dataclasses import replace
from math import radians, tau
from pathlib import Path

import numpy as np
import pytest

from navigate.round_phantom import CANAL, CORD, round_phantom, scenario
from tendonrod import InvalidInput, solve
from tendonrod.navigate import mechanics
from tendonrod.navigate.commands import Jog, Posture, Rates
from tendonrod.navigate.limits import NavigationLimits
from tendonrod.navigate.outer_tube import OuterTube
from tendonrod.navigate.ranges import SLACK
from tendonrod.navigate.record import digest
from tendonrod.navigate.scenario import Scenario
from tendonrod.navigate.session import Session
from tendonrod.robot import load_robot
from tendonrod.section import NotchedTube

STEP = 1.0 / 60.0
PULL, PUSH, BACK = Jog(tension=0.5), Jog(insertion=9e-3), Jog(insertion=-9e-3)


def steps(session, jog, count):
    """The last of so many equal steps."""
    for _ in range(count):
        session.step(jog, STEP)
    return session.snapshot


def touching():
    """A session with the robot wound onto the cord: 0.7 N, 30 mm."""
    session = Session(scenario())
    steps(session, PULL, 84)
    steps(session, PUSH, 200)
    return session


@pytest.fixture(scope="module")
def wound():
    """One such session, left as it is."""
    return touching()


def test_a_session_shows_what_the_solver_finds(wound):
    shown, here = wound.snapshot, wound.scenario
    alone = solve(
        here.robot, shown.tension, gravity=here.gravity, insertion=shown.insertion, rotation=shown.rotation,
        exit_pose=here.tube.pose, surface=here.surface, s=shown.s, contact_tolerance=1e-6,
    )  # fmt: skip
    assert np.linalg.norm(alone.centerline - shown.centerline, axis=1).max() < 1e-4
    assert alone.contacts is not None
    assert np.linalg.norm(alone.contacts.total - shown.contact_force.sum(axis=0)) < 5e-4


def test_walls_are_kept_and_forces_point_out_of_them(wound):
    shown = wound.snapshot
    rho = np.hypot(shown.centerline[:, 0], shown.centerline[:, 1])
    np.testing.assert_allclose(shown.clearance["cord"], rho - CORD - shown.radius, atol=1e-12)
    np.testing.assert_allclose(shown.clearance["canal"], CANAL - rho - shown.radius, atol=1e-12)
    assert min(gap.min() for gap in shown.clearance.values()) > -2.5e-5
    assert len(shown.contact_pressure) > 0
    outward = shown.contact_point.copy()
    outward[:, 2] = 0.0
    inner = np.hypot(*shown.contact_point[:, :2].T) < 0.5 * (CORD + CANAL)
    along = np.einsum("ki,ki->k", outward, shown.contact_force)
    assert (np.where(inner, along, -along) > 0.0).all()
    assert [name == "cord" for name in shown.contact_structure] == inner.tolist()


def test_the_same_commands_give_the_same_bits_in_another_process(wound):
    code = "from navigate.test_session import touching, digest; print(digest(touching().snapshot))"
    tests = Path(__file__).parents[1]
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tests)
    assert found.stdout.strip() == digest(wound.snapshot)


def test_one_long_step_is_many_short_ones():
    short, long = Session(scenario()), Session(scenario())
    steps(short, PULL, 60)
    steps(short, PUSH, 60)
    long.step(PULL, 1.0)
    shown = long.step(PUSH, 1.0)
    assert shown.time == 2.0
    assert np.abs(shown.centerline - short.snapshot.centerline).max() < 3e-5


def test_the_way_back_leads_where_the_way_in_came_from(wound):
    session = touching()
    out = steps(session, Jog(insertion=9e-3), 30)
    back = steps(session, BACK, 30)
    assert out.exposed - back.exposed == pytest.approx(30 * STEP * 9e-3, rel=1e-2)
    assert np.abs(back.centerline - wound.snapshot.centerline).max() < 1e-4


def test_standing_still_changes_nothing_but_time(wound):
    before = wound.snapshot
    after = wound.step(Jog(), STEP)
    assert (after.index, after.time) == (before.index + 1, before.time + STEP)
    assert digest(after) == digest(before)


def test_drives_stop_at_their_limits_and_say_so():
    session = Session(scenario())
    shown = session.step(Jog(insertion=-1e-3, tension=-1.0, rotation=6.0), 3.0)
    assert shown.posture == Posture(insertion=0.0, rotation=session.scenario.limits.rotation, tension=(0.0,))
    assert [each.code for each in shown.warnings] == ["rotation-stop"]
    shown = session.step(Jog(tension=2.0), 2.0)
    assert shown.tension == pytest.approx([session.scenario.limits.tension])
    assert "tension-stop" in [each.code for each in shown.warnings]


def test_speed_and_length_are_those_of_the_tube():
    session = Session(scenario())
    shown = session.step(Jog(insertion=3e-3, tension=0.2), 1.0)
    assert shown.insertion == pytest.approx(3e-3 / session.scenario.robot.section.L, rel=1e-12)
    assert shown.exposed == pytest.approx(shown.insertion * session.scenario.robot.length_na, rel=1e-12)


def test_uncoupled_insertion_turns_the_robot_back_by_its_helix():
    session = Session(scenario())
    session.couple(False)
    shown = steps(session, PUSH, 30)
    assert shown.rotation == pytest.approx(-tau * session.scenario.robot.turns * shown.insertion, rel=1e-12)
    session.couple(True)
    assert steps(session, PUSH, 10).rotation == shown.rotation


def test_tension_bends_ventrally_at_rotation_0_whatever_the_tube():
    tube = OuterTube(depth=5.5e-3, tilt=radians(10.0), lean=radians(5.0), height=3e-3)
    session = Session(scenario(tube=tube))
    shown = session.step(Jog(tension=0.4), 1.0)
    shown = session.step(Jog(insertion=4e-3), 1.0)
    straight = tube.position + shown.exposed * tube.direction
    bent = shown.tip - straight
    assert bent[0] < -0.5 * np.linalg.norm(bent[:2])
    np.testing.assert_allclose(shown.frames[0, :, 2], tube.direction, atol=1e-12)


def test_the_tube_is_placed_only_without_the_robot_and_where_there_is_room():
    session = Session(scenario())
    with pytest.raises(InvalidInput, match=r"robot's radius, 0.572 mm, from every wall; the nearest, cord, is 0.3 mm"):
        session.place(OuterTube(depth=4.3e-3))
    shown = session.place(OuterTube(depth=5.5e-3, height=12e-3))
    np.testing.assert_allclose(shown.tip, [5.5e-3, 0.0, 12e-3], atol=1e-15)
    session.step(PUSH, STEP)
    with pytest.raises(InvalidInput, match="mm of robot out: must be 0"):
        session.place(OuterTube())


def test_targets_once_reached_stay_so_until_the_reset():
    session = Session(scenario())
    steps(session, PULL, 30)
    shown = steps(session, PUSH, 40)
    assert shown.reached == ("near@L2",)
    far = steps(session, PUSH, 40)
    assert far.target_distance["near@L2"] > 1.5e-3
    assert far.reached == ("near@L2",)
    fresh = session.reset()
    assert (fresh.reached, fresh.posture) == ((), Posture(tension=(0.0,)))
    assert fresh.index == far.index


def test_a_move_that_would_snap_is_refused_and_a_withdrawal_is_not(monkeypatch):
    session = touching()
    before = session.snapshot
    monkeypatch.setattr(mechanics, "SNAP", 1e-9)
    refused = session.step(PUSH, STEP)
    assert refused.posture == before.posture
    assert digest(refused) == digest(before)
    assert refused.blocked.startswith("insertion refused: the robot would snap")
    assert session.step(PUSH, STEP).blocked == refused.blocked
    assert session.step(Jog(), STEP).blocked == ""
    shown = session.step(BACK, STEP)
    assert shown.blocked == ""
    assert shown.insertion < before.insertion


def test_of_a_refused_move_what_withdraws_is_carried_out_alone(monkeypatch):
    session = touching()
    shown = before = session.snapshot
    monkeypatch.setattr(mechanics, "SNAP", 1e-9)
    for _ in range(3):
        shown = session.step(Jog(insertion=-3e-3, tension=0.1, rotation=0.2), STEP)
        assert shown.blocked.startswith("turning + and pulling refused: the robot would snap")
    assert before.exposed - shown.exposed == pytest.approx(9e-3 * STEP, rel=1e-2)
    assert (shown.tension.tolist(), shown.rotation) == (before.tension.tolist(), before.rotation)


def test_a_snap_is_carried_out_as_far_as_the_limits_say(monkeypatch):
    monkeypatch.setattr(mechanics, "SNAP", 1e-9)
    limits = replace(scenario().limits, snap=1e-3)
    session = Session(scenario(limits=limits))
    shown = session.step(Jog(insertion=1e-3), STEP)
    shown = session.step(Jog(insertion=1e-3), STEP)
    assert shown.blocked == ""
    assert shown.exposed == pytest.approx(2e-3 * STEP, rel=1e-2)
    bound = Session(scenario(limits=replace(limits, snap=1e-6)))
    assert "would snap away" in bound.step(Jog(insertion=1e-3), STEP).blocked
    assert bound.snapshot.exposed == 0.0


def test_strain_beyond_the_plateau_is_out_of_the_models_range():
    limits = scenario().limits
    at_plateau = limits.tension / 0.9
    session = Session(scenario(limits=type(limits)(tension=1.2 * at_plateau), phantom=round_phantom(1e-3, 40e-3)))
    session.step(Jog(insertion=5e-3), 4.0)
    session.step(Jog(tension=0.1), (at_plateau - 0.1) / 0.1)
    assert session.snapshot.in_range
    assert not session.snapshot.limits["strain"].is_exceeded
    shown = session.step(Jog(tension=0.1), 2.0)
    assert shown.limits["strain"].is_exceeded
    assert not shown.in_range
    assert "strain" in [each.code for each in shown.warnings]


def test_a_slack_tendon_lifts_off_and_is_marked():
    session = Session(scenario())
    session.step(Jog(insertion=5e-3), 2.0)
    low, high = session.step(Jog(tension=0.05), 1.0), session.step(Jog(tension=0.05), 1.0)
    assert (low.in_range, high.in_range) == (False, True)  # the tendon lifts off below 0.071 N
    assert [each.code for each in low.warnings] == ["lift-off"]


def test_a_tendon_that_bends_nothing_is_not_told_to_lift_off():
    """A bench at rest reads a few millinewtons, now and then."""
    robot = load_robot("exonav-1").replace(torsion="homogenized")
    slack, pulled = (solve(robot, tension).centerline[-1] for tension in (0.0, SLACK))
    assert np.linalg.norm(pulled - slack) < 0.2e-3
    session = Session(scenario())
    session.step(Jog(insertion=5e-3), 2.0)
    shown = session.step(Jog(tension=0.9 * SLACK), 1.0)
    assert (shown.in_range, shown.warnings) == (True, ())


@pytest.mark.parametrize("changes", [{"insertion": 0.021}, {"rotation": np.nan}, {"tension": "1"}, {"tension": True}])
def test_jogs_are_checked_by_name(changes):
    name = next(iter(changes))
    with pytest.raises(InvalidInput, match=name):
        Jog(**changes)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.inf, np.nan, 61.0])
def test_steps_take_time(wound, dt):
    before = wound.snapshot
    with pytest.raises(InvalidInput, match="dt"):
        wound.step(Jog(), dt)
    assert wound.snapshot is before


def test_rates_turn_deflections_into_jogs():
    rates = Rates(insertion=2e-3, rotation=0.5, tension=0.2)
    assert rates.jog(0.5, -1.0, 0.0) == Jog(insertion=1e-3, rotation=-0.5)
    with pytest.raises(InvalidInput, match="rotation"):
        rates.jog(rotation=1.01)
    with pytest.raises(InvalidInput, match="insertion"):
        Rates(insertion=1.0)


def test_the_robot_must_fit_the_exit():
    with pytest.raises(InvalidInput, match=r"nearest, canal, is 0\.4 mm away"):
        scenario(tube=OuterTube(depth=6.9e-3))


def test_the_mirror_image_of_everything_goes_the_mirrored_way():
    """A left-handed robot, outer tube and commands mirrored at y = 0, between walls that are their own image."""
    right = scenario()
    body, tube = right.robot.body, right.tube
    assert isinstance(body, NotchedTube)
    left = Scenario(
        robot=replace(right.robot, body=replace(body, turns=-body.turns)), phantom=right.phantom,
        tube=tube.changed(offset=-tube.offset, tilt=-tube.tilt),
    )  # fmt: skip
    sessions = Session(right), Session(left)
    moves = [Jog(tension=0.7)] * 20 + [Jog(insertion=9e-3, rotation=0.1)] * 50 + [Jog(rotation=-0.3)] * 10
    touched = False
    for jog in moves:
        one, other = (
            session.step(replace(jog, rotation=sign * jog.rotation), 0.05)
            for session, sign in zip(sessions, (1.0, -1.0), strict=True)
        )
        np.testing.assert_allclose(other.centerline, one.centerline * [1.0, -1.0, 1.0], atol=1e-8)
        carried, mirrored = one.contact_force.sum(axis=0), other.contact_force.sum(axis=0)
        np.testing.assert_allclose(mirrored, carried * [1.0, -1.0, 1.0], atol=1e-6)
        touched |= len(one.contact_force) > 0
    assert touched


def test_the_contacts_carry_what_the_clamp_does_not():
    """Force balance of the exposed robot: what the exit holds is the contacts' force and the weight."""
    session = Session(scenario())
    for jog in [Jog(tension=0.7)] * 20 + [Jog(insertion=9e-3)] * 50:
        session.step(jog, 0.05)
    shown, shape = session.snapshot, session._body.shape
    assert len(shown.contact_force) > 0
    weight = shape.line_force[0] * shape.length
    np.testing.assert_allclose(shape.force[0], shown.contact_force.sum(axis=0) + weight, atol=1e-6)
    assert weight[0] < 0.0


def test_at_the_stop_of_the_rotation_a_motor_that_stands_does_not_turn_secretly():
    """Uncoupled, insertion turns the section at the exit: it ends where the section may turn no further."""
    limits = NavigationLimits(rotation=0.3)
    session = Session(scenario(limits=limits, coupled=False))
    turns = session.scenario.robot.turns
    motor = []
    for jog in [Jog(tension=0.3)] * 5 + [Jog(insertion=9e-3)] * 15 + [Jog(insertion=-9e-3)] * 5:
        session.step(jog, 0.05)
        shown = session.snapshot
        motor.append(shown.rotation + tau * turns * (shown.insertion - 1.0))
        assert abs(shown.rotation) <= 0.3 + 1e-12
    assert motor == pytest.approx([motor[0]] * len(motor), abs=1e-9)
    assert session.snapshot.insertion > 0.0
