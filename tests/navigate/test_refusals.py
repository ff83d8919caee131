"""Moves that are refused: known without a solve where nothing has changed, given up in bounded time."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from navigate.round_phantom import scenario
from tendonrod.navigate import mechanics
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.record import digest
from tendonrod.navigate.refusals import LONGEST
from tendonrod.navigate.session import Session
from tendonrod.statics.contact import Contact

STEP = 1.0 / 60.0
AT_ONCE = 8  # looks that one round may take beyond the bound
PUSH, BACK = Jog(insertion=9e-3), Jog(insertion=-9e-3)


@pytest.fixture
def solves(monkeypatch):
    """The postures that were solved for, in order; clear it at will."""
    found, real = [], mechanics._solved

    def counted(here, posture, *rest):
        found.append(posture)
        return real(here, posture, *rest)

    monkeypatch.setattr(mechanics, "_solved", counted)
    return found


@pytest.fixture
def stuck(monkeypatch):
    """A session 9 mm out at 0.5 N where every move counts as a snap, so that all but withdrawals are refused."""
    session = Session(scenario())
    session.step(Jog(tension=0.5), 1.0)
    session.step(PUSH, 1.0)
    monkeypatch.setattr(mechanics, "SNAP", 1e-9)
    return session


def test_a_refused_move_is_refused_again_in_the_same_words_without_a_solve(stuck, solves):
    first = stuck.step(PUSH, STEP)
    assert solves
    solves.clear()
    assert first.blocked
    for dt, share in ((STEP, 1.0), (0.3 * STEP, 1.0), (1.3 * STEP, 1.0), (0.7 * STEP, 1.0), (STEP, 1.01)):
        jog = Jog(insertion=share * PUSH.insertion, rotation=0.01 * (share - 1.0))
        again = stuck.step(jog, dt)
        assert again.blocked.partition(": ")[2] == first.blocked.partition(": ")[2]  # before it stands what was asked
        assert digest(again) == digest(first)
    stuck.step(Jog(), STEP)
    assert stuck.step(PUSH, STEP).blocked == first.blocked
    assert not solves


def test_of_a_long_move_only_as_much_counts_as_refused_as_was_tried_at_once(stuck, solves):
    """Six strides were asked for, and a quarter of the first is what the last try was for."""
    assert stuck.step(PUSH, 10 * STEP).blocked
    solves.clear()
    assert stuck.step(PUSH, 0.3 * STEP).blocked
    assert not solves
    assert stuck.step(PUSH, 0.1 * STEP).blocked
    assert solves


@pytest.mark.parametrize(
    "jog", [replace(PUSH, insertion=0.1 * PUSH.insertion), replace(PUSH, rotation=0.2), Jog(rotation=0.2), BACK]
)
def test_another_move_and_a_much_shorter_one_are_tried(stuck, solves, jog):
    stuck.step(PUSH, STEP)
    solves.clear()
    stuck.step(jog, STEP)
    assert solves


def test_after_a_change_of_the_state_a_refused_move_is_tried_again(stuck, solves):
    stuck.step(PUSH, STEP)
    stuck.step(BACK, STEP)
    solves.clear()
    assert stuck.step(PUSH, STEP).blocked
    assert solves


def test_what_withdraws_goes_on_while_the_rest_is_tried_more_and_more_seldom(stuck, solves):
    before = stuck.snapshot
    jog, steps, tried = Jog(insertion=3e-3, tension=-0.05), 4 * LONGEST, 0
    for _ in range(steps):
        solves.clear()
        at, goal = stuck.snapshot.posture, stuck.snapshot.insertion
        shown = stuck.step(jog, STEP)
        tried += any(each.insertion > goal for each in solves)
        assert shown.blocked
        assert shown.posture.insertion == at.insertion
        assert shown.tension[0] < at.tension[0]
    assert before.tension[0] - stuck.snapshot.tension[0] == pytest.approx(0.05 * steps * STEP, rel=0.2)
    assert 1 < tried <= 10  # after 1, 2, 4, 8, 16, 32 and again 32 steps
    stuck.step(Jog(), STEP)
    solves.clear()
    stuck.step(jog, STEP)
    assert any(each.insertion > stuck.snapshot.insertion for each in solves)  # who asks anew need not wait


@pytest.mark.parametrize("strides", [1, 2, 4, 32, 64])
def test_a_retraction_that_small_steps_refuse_is_made_by_whole_strides(monkeypatch, strides):
    session = Session(scenario())
    session.step(Jog(tension=0.5), 1.0)
    before, real = session.step(PUSH, 1.0), mechanics._solved
    length = session.scenario.robot.length_na

    def sharp(here, posture, *rest):
        near = abs(before.insertion - posture.insertion) * length < 0.9 * strides * mechanics.STRIDE["insertion"]
        return (None, "an edge") if near and posture.insertion else real(here, posture, *rest)

    monkeypatch.setattr(mechanics, "_solved", sharp)
    assert "an edge" in session.step(Jog(insertion=3e-3), STEP).blocked
    shown = session.step(Jog(insertion=-3e-3), STEP)
    assert shown.blocked == ""
    assert before.exposed - shown.exposed == pytest.approx(min(strides * mechanics.STRIDE["insertion"], before.exposed))
    assert (strides == 1) == (session._snapped == 0.0)  # a stride that is found as any other is no snap
    if shown.exposed == 0.0:
        return
    monkeypatch.setattr(mechanics, "_solved", real)
    after = session.step(Jog(insertion=-3e-3), STEP)  # from there, not from where it had asked to be
    assert shown.exposed - after.exposed == pytest.approx(3e-3 * STEP, rel=0.01)


def test_a_withdrawal_that_leads_nowhere_is_not_tried_again_from_there_either(stuck, solves, monkeypatch):
    jog, real = Jog(insertion=3e-3, tension=-0.05), mechanics._solved
    for _ in range(40):  # so that the whole is tried but every 32 steps
        stuck.step(jog, STEP)

    def nowhere(here, posture, *rest):
        real(here, posture, *rest)
        return None, "an edge"

    monkeypatch.setattr(mechanics, "_solved", nowhere)
    tried = []
    for _ in range(2 * LONGEST):
        solves.clear()
        assert stuck.step(jog, STEP).blocked
        tried.append(bool(solves))
    assert 2 <= sum(tried) <= 4  # alone once; with the rest once more, after which all is known
    monkeypatch.setattr(mechanics, "_solved", real)
    at = stuck.snapshot.tension[0]
    stuck.step(Jog(tension=-0.05), STEP)
    assert stuck.snapshot.tension[0] < at


def test_letting_go_and_turning_back_are_lengthened_by_no_more_than_a_stride(stuck, solves, monkeypatch):
    monkeypatch.setattr(
        mechanics, "_solved", lambda here, posture, *rest: (solves.append(posture), (None, "an edge"))[1]
    )
    at = stuck.snapshot.posture
    assert stuck.step(Jog(tension=-0.05), STEP).blocked
    assert at.tension[0] - min(each.tension[0] for each in solves) == pytest.approx(mechanics.STRIDE["tension"])
    assert stuck.snapshot.posture == at


def test_a_longer_withdrawal_goes_no_further_than_nothing():
    start = replace(scenario_posture(), insertion=1e-3, tension=(2e-3,), rotation=radians(0.1))
    goal = replace(start, insertion=0.9e-3, tension=(1e-3,), rotation=radians(0.09))
    found = mechanics._lengthened(scenario(), start, goal, 1)
    assert (found.tension, found.insertion) == ((0.0,), 0.0)
    assert 0.0 <= found.rotation <= start.rotation


def scenario_posture():
    """Of a session at its beginning."""
    return Session(scenario()).snapshot.posture


def test_a_solve_is_given_up_after_so_many_looks_at_the_walls(monkeypatch):
    """From a robot wound onto the cord to one that is turned by a quarter, with enough looks and with 1."""
    looks, real = [], Contact.look

    def counted(self, trial):
        found = real(self, trial)
        looks.append(self.looks)
        return found

    monkeypatch.setattr(Contact, "look", counted)
    session = Session(scenario())
    session.step(Jog(tension=0.7), 1.0)
    body = (session.step(PUSH, 3.3), session._body)[1]
    assert max(looks) <= mechanics.FAR_LOOKS + AT_ONCE
    goal = replace(body.posture, rotation=body.posture.rotation + radians(90))
    for most, arrives in ((100, True), (1, False)):
        looks.clear()
        shape, why = mechanics._solved(session.scenario, goal, body.shape, replace(mechanics.FAR, most_looks=most))
        assert (shape is not None) == arrives, why
        assert max(looks) <= most + AT_ONCE


@pytest.mark.parametrize("jog", [Jog(insertion=9e-3), Jog(rotation=-6.0), Jog(tension=0.3, rotation=0.1)])
def test_seconds_are_those_of_so_many_strides(jog):
    here, last = scenario(), scenario_posture()
    time = mechanics.seconds(jog, 5)
    goal = replace(
        last, insertion=jog.insertion * time / here.robot.length_na, rotation=jog.rotation * time,
        tension=(jog.tension * time,),
    )  # fmt: skip
    assert mechanics.strides(here, last, goal) == 5
    assert mechanics.seconds(Jog(), 5) == np.inf
