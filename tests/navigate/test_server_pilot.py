"""The pilot on a clock that the test turns: what moves, for how long, and what stops it."""

from math import radians
from threading import Event

import numpy as np
import pytest

from navigate.pretend import PretendSession
from tendonrod.errors import InvalidInput
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.dead_man import DEADLINE
from tendonrod.navigate.mechanics import STRIDE
from tendonrod.navigate.pilot import BEHIND, LONGEST, MOST_REQUESTS, PERIOD, STILL, STRIDES, Pilot

IN = Jog(insertion=1e-3)


class Bridge:
    """A pilot, its session, its clock, and what it showed and told."""

    def __init__(self) -> None:
        self.now, self.shown, self.told, self.runs = 0.0, [], [], True
        self.session = PretendSession()
        self.pilot = Pilot(
            self.session, show=self.shown.append, tell=lambda severity, text: self.told.append(text),
            runs_still=lambda: self.runs, clock=lambda: self.now,
        )  # fmt: skip

    def run(self, seconds: float, held: Jog | None = None, every: float = 0.03) -> None:
        """Let time pass; ``held`` comes again and again as from a page."""
        end, sent = self.now + seconds, -1.0
        while self.now < end - 1e-9:
            if held is not None and self.now - sent >= every:
                self.pilot.hold(held)
                sent = self.now
            wait = self.pilot.tick()  # in which steps may let the clock run on
            self.now += min(max(wait, 1e-4), 0.005)


@pytest.fixture
def bridge() -> Bridge:
    return Bridge()


def test_a_held_command_moves_in_real_time(bridge):
    bridge.run(2.0, IN)
    bridge.pilot.dead_man.let_go()
    assert sum(dt for _, dt in bridge.session.moved) == pytest.approx(2.0, abs=3 * PERIOD)
    assert all(jog == IN and dt <= LONGEST for jog, dt in bridge.session.moved)


def test_states_come_at_60_hz_while_moving_and_above_10_hz_when_still(bridge):
    bridge.run(1.0, IN)
    assert 55 <= len(bridge.shown) <= 66
    bridge.run(0.3)
    before = len(bridge.shown)
    bridge.run(1.0)
    assert 10 <= len(bridge.shown) - before <= 14


def test_states_that_a_long_step_kept_back_are_made_up_for_and_motion_stays_real_time(bridge):
    """Of every 20 steps one takes 70 ms, as those do that find that a move leads nowhere."""
    quick, begun = bridge.session.step, []

    def step(jog, dt):
        begun.append(bridge.now)
        bridge.now += 0.07 if len(bridge.shown) % 20 == 0 else 0.002
        return quick(jog, dt)

    bridge.session.step = step
    bridge.run(2.0, IN)
    assert 119 <= len(bridge.shown) <= 122
    assert sum(dt for _, dt in bridge.session.moved) == pytest.approx(2.0 - 6 * (0.07 - LONGEST), abs=3 * PERIOD)
    assert np.diff(begun).min() >= PERIOD / 2 - 1e-9


def test_nothing_is_made_up_for_where_nothing_moved(bridge):
    bridge.run(0.5, IN)
    bridge.pilot.dead_man.let_go()
    bridge.run(0.5)
    before = len(bridge.shown)
    bridge.run(0.5, IN)
    assert len(bridge.shown) - before <= 0.5 / PERIOD + 2


def test_a_step_that_took_longer_than_can_be_made_up_for_is_not(bridge):
    quick, long = bridge.session.step, 5 * BEHIND

    def step(jog, dt):
        bridge.now += long if len(bridge.shown) == 30 else 0.0
        return quick(jog, dt)

    bridge.session.step = step
    bridge.run(2.0, IN)
    assert len(bridge.shown) == pytest.approx((2.0 - long + BEHIND) / PERIOD, abs=2)


def test_keys_pressed_again_and_again_move_no_further_than_real_time(bridge):
    """Every eighth step takes 70 ms, and where states are made up for, a key comes up and down between two of them."""
    quick, times = bridge.session.step, []

    def step(jog, dt):
        times.append((bridge.now, 0.0 if jog.is_still else dt))
        bridge.now += 0.07 if len(times) % 8 == 0 else 0.001
        return quick(jog, dt)

    bridge.session.step = step
    for _ in range(400):
        bridge.run(0.011, IN)
        bridge.pilot.dead_man.let_go()
        bridge.run(0.006)
    for k, (begun, _) in enumerate(times):
        moved = np.cumsum([dt for _, dt in times[k + 1 :]])
        assert (moved <= [at - begun + 1e-9 for at, _ in times[k + 1 :]]).all()


def test_silence_stops_within_the_deadline_and_is_told(bridge):
    bridge.run(0.5, IN)
    bridge.pilot.hold(IN)
    held_at, before = bridge.now, len(bridge.session.moved)
    bridge.run(1.0)
    assert sum(dt for _, dt in bridge.session.moved[before:]) <= DEADLINE
    assert not bridge.shown[-1].moving
    assert any("no command" in text for text in bridge.told)
    assert bridge.now > held_at + DEADLINE


def test_what_moved_is_told_to_stand_though_nobody_has_control_any_more(bridge):
    """A bench with a loop of its own goes on for a moment with what it was told last."""
    bridge.run(0.3, IN)
    bridge.runs = False
    bridge.pilot.dead_man.let_go()
    bridge.run(0.3)
    assert bridge.session.steps[-1][0].is_still
    count = len(bridge.session.steps)
    bridge.run(0.5)
    assert len(bridge.session.steps) == count


def test_a_slow_step_does_not_lead_to_a_longer_motion(bridge):
    slow = bridge.session.step

    def step(jog, dt):
        bridge.now += 0.4
        return slow(jog, dt)

    bridge.session.step = step
    bridge.pilot.hold(IN)
    for _ in range(5):
        bridge.pilot.tick()
        bridge.now += 0.01
    assert len(bridge.session.moved) == 1


def test_a_fast_motion_is_slower_rather_than_its_steps_longer_than_their_period(bridge):
    fast = Jog(rotation=radians(360.0))
    bridge.run(1.0, fast)
    most = max(seconds * fast.rotation for _, seconds in bridge.session.moved)
    assert most == pytest.approx(STRIDES * STRIDE["rotation"])


def test_compiled_code_is_loaded_before_the_first_command(bridge, monkeypatch):
    begun = Event()
    monkeypatch.setattr(bridge.session, "rehearse", begun.set)
    bridge.pilot.start()
    assert begun.wait(10.0)
    bridge.pilot.close()


def test_letting_go_stops_at_once(bridge):
    bridge.run(0.5, IN)
    bridge.pilot.dead_man.let_go()
    before = len(bridge.session.moved)
    bridge.run(0.5)
    assert len(bridge.session.moved) == before


def test_a_command_does_not_wait_for_the_slow_rhythm_of_standing_still(bridge):
    bridge.run(1.0)
    bridge.pilot.hold(IN)
    bridge.pilot.tick()
    assert len(bridge.session.moved) == 1


def test_the_clock_of_the_session_stands_where_nobody_has_control(bridge):
    bridge.runs = False
    bridge.run(1.0)
    assert bridge.session.snapshot.time == 0.0
    bridge.runs = True
    bridge.run(1.0)
    assert bridge.session.snapshot.time == pytest.approx(1.0, abs=2 * STILL)


def test_a_request_stops_the_motion_and_is_answered_between_steps(bridge):
    bridge.run(0.5, IN)
    future = bridge.pilot.ask(lambda session: session.reset())
    assert not bridge.pilot.dead_man.is_held
    bridge.pilot.tick()
    assert future.result(0).insertion == 0.0
    assert bridge.session.snapshot.insertion == 0.0


def test_a_request_that_is_refused_is_told_to_who_asked(bridge):
    future = bridge.pilot.ask(lambda session: session.nothing_like_this)
    bridge.pilot.tick()
    assert isinstance(future.exception(0), AttributeError)
    bridge.run(0.2, IN)
    assert bridge.session.moved


def test_too_many_requests_are_refused(bridge):
    for _ in range(MOST_REQUESTS):
        bridge.pilot.ask(lambda session: None)
    with pytest.raises(InvalidInput, match="waiting"):
        bridge.pilot.ask(lambda session: None)


def test_a_record_is_shown_at_its_pace_and_nothing_moves_meanwhile(bridge):
    other = PretendSession()
    frames = [other.step(IN, PERIOD) for _ in range(120)]
    bridge.pilot.play(iter(frames), speed=2.0)
    bridge.run(0.5, IN)
    assert bridge.pilot.is_replaying
    assert not bridge.session.moved
    shown = [frame.snapshot for frame in bridge.shown if frame.mode == "replay"]
    assert shown[-1].time == pytest.approx(frames[0].time + 2.0 * 0.5, abs=5 * PERIOD)
    refused = bridge.pilot.ask(lambda session: session.reset())
    bridge.run(1.0)
    assert "end the replay" in str(refused.exception(0))
    assert bridge.shown[-1].snapshot.time == pytest.approx(frames[-1].time)  # the end of the record stays in sight
    bridge.pilot.stop_playing()
    bridge.run(0.2)
    assert bridge.shown[-1].mode == "live"
    assert bridge.shown[-1].snapshot.insertion == 0.0


def test_a_replay_that_begins_in_a_motion_ends_it(bridge):
    """A bench is told to stand, and the first step afterwards is the first of a motion."""
    bridge.run(0.3, IN)
    other = PretendSession()
    bridge.pilot.play((other.step(IN, 1.0) for _ in range(100)), speed=1.0)
    bridge.run(0.2)
    assert bridge.session.steps[-1][0].is_still
    bridge.pilot.stop_playing()
    before = len(bridge.session.moved)
    bridge.pilot.hold(IN)
    bridge.pilot.tick()
    bridge.pilot.hold(IN)
    bridge.pilot.tick()
    assert [seconds for _, seconds in bridge.session.moved[before:]] == [pytest.approx(PERIOD)]


def test_a_replay_can_be_ended(bridge):
    other = PretendSession()
    bridge.pilot.play((other.step(IN, 1.0) for _ in range(100)), speed=1.0)
    bridge.run(0.2)
    bridge.pilot.stop_playing()
    bridge.run(0.2)
    assert bridge.shown[-1].mode == "live"
