"""A drive that has made its move, as a bench has: the session shows what it can of it, and its record replays."""

import pytest

from navigate import round_phantom
from tendonrod import anatomy
from tendonrod.navigate import mechanics
from tendonrod.navigate import session as sessions
from tendonrod.navigate.commands import Jog, Posture
from tendonrod.navigate.drive import IdealDrive
from tendonrod.navigate.record import SessionRecord, digest
from tendonrod.navigate.replay import replay
from tendonrod.navigate.session import Session

STEP = 1.0 / 60.0


class Stubborn(IdealDrive):
    """What it did, it did."""

    def go_back(self, posture):
        return False


def test_a_session_whose_drive_went_where_the_model_could_not_follow_replays(tmp_path, monkeypatch):
    """No shape is found beyond 9 mm; the drive goes on to 12 mm, stops for a fault that is acknowledged, comes back."""
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom())
    path = tmp_path / "record.jsonl"
    real, length = mechanics._solved, round_phantom.scenario().robot.section.L

    def ending(here, posture, *rest):
        return (None, "the end") if posture.insertion * length > 9e-3 else real(here, posture, *rest)

    monkeypatch.setattr(mechanics, "_solved", ending)
    drive = Stubborn(round_phantom.scenario())
    monkeypatch.setattr(drive, "acknowledge", lambda home=False: None)
    session, shown = Session(round_phantom.scenario(), drive, SessionRecord(path)), []
    jogs = [Jog(tension=0.5)] * 60 + [Jog(insertion=9e-3, rotation=0.2)] * 80
    for jog in [*jogs, None, *[Jog(insertion=9e-3, tension=-0.1)] * 8, *[Jog(insertion=-9e-3)] * 50]:
        shown += [session.acknowledge() if jog is None else session.step(jog, STEP)]
    session.close()
    refused = [each for each in shown if each.blocked]
    assert max(each.exposed for each in refused) * 1e3 == pytest.approx(9.0, abs=0.15)
    assert all(each.blocked == "the model cannot follow the robot: the end" for each in refused)
    assert not shown[-1].blocked
    replayed = [(each.index, each.blocked, digest(each)) for each in replay(path)]
    last = {each.index: each for each in shown}.values()
    assert replayed[1:] == [(each.index, each.blocked, digest(each)) for each in last]


def test_a_robot_whose_next_shape_is_further_back_is_told_so_until_it_is_there(monkeypatch):
    """Between 4 and 6 mm no shape is found: the model is ahead of a robot that is drawn in."""
    real, length, session = mechanics._solved, round_phantom.scenario().robot.section.L, None

    def gap(here, posture, *rest):
        inside = session is not None and 4e-3 < posture.insertion * length < 6e-3
        return (None, "the gap") if inside else real(here, posture, *rest)

    monkeypatch.setattr(mechanics, "_solved", gap)
    drive = Stubborn(round_phantom.scenario())
    bare = Session(round_phantom.scenario(), drive)
    bare.step(Jog(tension=0.5), 1.0)
    bare.step(Jog(insertion=8e-3), 1.0)
    session = bare
    ahead = []
    for _ in range(60):
        shown = session.step(Jog(insertion=-6e-3), STEP)
        robot = drive.posture.insertion * length
        ahead += [robot - shown.exposed]
        assert (4e-3 < robot < 6e-3) or not shown.blocked
        assert ahead[-1] < mechanics.STRIDE["insertion"] or shown.blocked.startswith(
            "the model cannot follow the robot"
        )
    assert max(ahead) > mechanics.STRIDE["insertion"]
    assert ahead[-1] == pytest.approx(0.0, abs=1e-5)


def test_a_model_that_is_ahead_by_less_than_a_stride_is_no_news(monkeypatch):
    """A retraction from 8 mm succeeds only by a whole stride, as over an edge."""
    drive = Stubborn(round_phantom.scenario())
    session, real, length = Session(round_phantom.scenario(), drive), mechanics._solved, drive._length
    session.step(Jog(tension=0.5), 1.0)
    before = session.step(Jog(insertion=8e-3), 1.0)

    def edge(here, posture, *rest):
        near = abs(posture.insertion * length - before.exposed) < 0.9 * mechanics.STRIDE["insertion"]
        return (None, "an edge") if near else real(here, posture, *rest)

    monkeypatch.setattr(mechanics, "_solved", edge)
    shown = session.step(Jog(insertion=-6e-3), STEP)
    assert shown.blocked == ""
    assert 0.0 < drive.posture.insertion * length - shown.exposed < mechanics.STRIDE["insertion"]


def test_a_robot_that_has_drawn_in_at_once_is_shown_so_without_the_way(monkeypatch):
    """As after a homing, of which a session sees the end."""
    drive = Stubborn(round_phantom.scenario())
    session = Session(round_phantom.scenario(), drive)
    session.step(Jog(tension=0.5), 1.0)
    assert session.step(Jog(insertion=9e-3), 1.0).exposed > sessions.HOMED
    monkeypatch.setattr(sessions, "move", None)  # nothing is to be followed
    drive.posture = Posture(insertion=0.0, rotation=0.0, tension=(0.0,))
    shown = session.step(Jog(), STEP)
    assert (shown.exposed, shown.posture, shown.blocked) == (0.0, drive.posture, "")
