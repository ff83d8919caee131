"""What a page that comes later is told of the time before: bounded, and in the clock of its curves."""

from dataclasses import replace

import numpy as np
import pytest

from navigate.pretend import PretendSession
from tendonrod.navigate import told
from tendonrod.navigate.past import APART, MOST, SPAN, Past
from tendonrod.navigate.pilot import Frame

FIRST = PretendSession().snapshot


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def past(clock):
    return Past(clock)


def see(past, mode="live", **what):
    past.see(Frame(replace(FIRST, **what), moving=True, mode=mode))


def test_it_keeps_one_minute_however_often_it_is_shown(past, clock):
    for k in range(20_000):
        clock.now = 100.0 + k / 60.0
        see(past)
    found = past.told()
    assert len(found.ago) <= SPAN / APART
    assert SPAN - 2 * APART <= max(found.ago) - min(found.ago) <= SPAN
    assert found.ago == sorted(found.ago, reverse=True)


def test_it_forgets_what_is_older_than_a_minute(past, clock):
    see(past)
    clock.now += SPAN + 1.0
    assert past.told().ago == []


def test_a_sample_says_what_was_shown(past, clock):
    nowhere = np.full(2, np.inf)
    see(past, clearance={"cord": np.array([2e-3, 0.5e-3]), "canal": nowhere}, in_range=False)
    clock.now += 1.0
    see(past, mode="replay", clearance={"canal": nowhere})
    found = past.told()
    assert (found.ago, found.live, found.in_range) == ([1.0, 0.0], [True, False], [False, True])
    assert found.clearance == [pytest.approx(0.5e-3), None]


def test_it_keeps_the_last_events_in_their_order(past, clock):
    for k in range(3 * MOST):
        clock.now += 1.0
        past.note(told.Event(severity="info", text=str(k), time=float(k)))
    found = past.told().events
    assert [each.text for each in found] == [str(k) for k in range(2 * MOST, 3 * MOST)]
    assert (found[-1].ago, found[0].ago) == (0.0, MOST - 1.0)
