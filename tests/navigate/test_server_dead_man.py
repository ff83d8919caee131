"""The dead-man's switch, the operator's seat and the ration, on a clock that the test turns."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendonrod.navigate.dead_man import DEADLINE, GRACE, DeadMan
from tendonrod.navigate.ration import Ration
from tendonrod.navigate.seat import ABSENCE, Seat


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_the_deadline_is_what_the_issue_asks_for():
    """With what a bench of its own loop may go on by itself."""
    assert DEADLINE + GRACE <= 0.15 + 1e-12


@given(st.lists(st.tuples(st.floats(0.0, 0.5), st.sampled_from(["hold", "let go", "spend"])), max_size=40))
def test_no_motion_ends_later_than_the_deadline_after_the_last_command(moments):
    clock = Clock()
    switch = DeadMan(clock)
    last = None
    for pause, what in moments:
        clock.now += pause
        if what == "hold":
            switch.hold("on")
            last = clock.now
        elif what == "let go":
            switch.let_go()
            last = None
        elif switch.spend(1 / 60) is not None:
            assert last is not None
            assert clock.now + 1 / 60 <= last + DEADLINE + 1e-12


def test_a_command_that_ran_out_is_told_once_and_one_let_go_is_not(clock):
    switch = DeadMan(clock)
    switch.hold("on")
    switch.let_go()
    clock.now += 1.0
    assert switch.spend(0.01) is None
    assert not switch.lapsed()
    switch.hold("on")
    clock.now += 1.0
    assert switch.spend(0.01) is None
    assert switch.lapsed()
    assert not switch.lapsed()


def test_a_bounded_command_moves_exactly_its_seconds(clock):
    switch = DeadMan(clock)
    serial = switch.hold("on", 0.5)
    moved = 0.0
    while switch.renew(serial):
        found = switch.spend(0.03)
        assert found is not None
        assert found[0] == "on"
        moved += found[1]
        clock.now += 0.03
    assert moved == pytest.approx(0.5, abs=1e-9)
    assert switch.spend(0.03) is None


def test_an_old_command_is_not_renewed_once_another_is_held_or_it_ran_out(clock):
    switch = DeadMan(clock)
    first = switch.hold("first", 9.0)
    second = switch.hold("second", 9.0)
    assert not switch.renew(first)
    assert switch.renew(second)
    clock.now += 0.2
    assert not switch.renew(second)


def test_a_command_that_ran_out_is_resumed_and_one_that_was_ended_is_not(clock):
    switch = DeadMan(clock)
    serial = switch.hold("on", 1.0)
    assert switch.spend(0.03) == ("on", 0.03)
    clock.now += 0.2
    assert not switch.renew(serial)
    assert switch.outcome(serial) == (0.03, "no sign of life for 150 ms")
    assert switch.resume(serial)
    assert switch.outcome(serial) == (0.03, "")
    clock.now += 0.2
    assert switch.spend(0.03) is None
    switch.let_go("stopped by b")
    assert not switch.resume(serial)
    assert switch.outcome(serial) == (0.03, "stopped by b")
    other = switch.hold("off", 1.0)
    clock.now += 0.2
    assert switch.spend(0.03) is None
    newest = switch.hold("newest")
    assert not switch.resume(other)
    assert switch.outcome(other) == (0.0, "another command came")
    assert switch.renew(newest)


def test_one_step_is_no_longer_than_its_command_allows(clock):
    switch = DeadMan(clock)
    switch.hold("on", 0.05)
    assert switch.spend(0.03, lambda command: 0.01) == ("on", 0.01)
    assert switch.spend(0.03) == ("on", 0.03)
    last = switch.spend(0.03)
    assert last is not None
    assert last[1] == pytest.approx(0.01)
    assert switch.spend(0.03) is None


def test_control_goes_to_one_and_stays_until_released(clock):
    seat = Seat(clock)
    assert seat.refusal("a") == "nobody has control: take it first"
    assert seat.take("a") == ""
    assert "a has control" in seat.take("b")
    assert seat.refusal("b") == "a has control"
    assert seat.refusal("a") == ""
    assert not seat.leave("b")
    assert seat.leave("a")
    assert seat.take("b") == ""


def test_control_can_be_taken_from_one_who_is_absent_only(clock):
    seat = Seat(clock)
    seat.take("a")
    clock.now += 0.9 * ABSENCE
    seat.heard("a")
    clock.now += 0.9 * ABSENCE
    seat.heard("b")
    assert seat.take("b") != ""
    clock.now += 0.2 * ABSENCE
    assert seat.take("b") == ""
    assert not seat.has("a")


def test_a_ration_holds_in_the_long_run_and_allows_a_burst(clock):
    ration = Ration(10.0, 20.0, clock)
    assert sum(ration.spend() for _ in range(50)) == 20
    given = 0
    for _ in range(1000):
        clock.now += 0.01
        given += ration.spend()
    assert given == pytest.approx(100, abs=1)
