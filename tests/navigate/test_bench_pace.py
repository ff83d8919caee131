"""A script's steps on a bench that moves by itself: each is made for its own time, however long a session computes."""

import random

import pytest

from tendonrod.navigate.commands import Jog
from tendonrod.navigate.pace import MOST, Pace

IN, TURN, STAND = Jog(insertion=1e-3), Jog(rotation=0.1), Jog()
STEP = 1 / 60


class Bench:
    """Time, and a bench that moves at the last jog for as long as it was told."""

    def __init__(self):
        self.now, self.ends, self.jog, self.made, self.stood = 0.0, 0.0, STAND, {}, 0.0

    def clock(self):
        return self.now

    def pass_time(self, seconds):
        moving = min(seconds, max(self.ends - self.now, 0.0))
        self.made[self.jog] = self.made.get(self.jog, 0.0) + moving
        self.stood += seconds - moving
        self.now += seconds

    def steer(self, jog, seconds):
        self.jog, self.ends = jog, self.now + seconds


def played(steps, computing):
    """The bench after these steps (jog, count); computing(): s that the session takes for one."""
    bench = Bench()
    pace = Pace(bench.clock, bench.pass_time)
    for jog, count in steps:
        for _ in range(count):
            bench.steer(jog, pace.begin(jog, STEP))
            pace.wait()
            bench.pass_time(computing())
    pace.finish()
    return bench


@pytest.mark.parametrize("slowest", [0.0, 0.5 * STEP, 0.9 * STEP, 3.0 * STEP, 2.0 * MOST])
def test_every_step_is_made_for_its_own_time(slowest):
    chance = random.Random(3)
    bench = played([(IN, 90), (TURN, 30), (IN, 30)], lambda: chance.uniform(0.0, slowest))
    assert bench.made[IN] == pytest.approx(120 * STEP)
    assert bench.made[TURN] == pytest.approx(30 * STEP)


def test_a_bench_need_not_stand_while_the_session_computes():
    bench = played([(IN, 120)], lambda: 0.7 * STEP)
    assert bench.stood < 2 * STEP  # until it is known how long a step takes
    assert bench.now < 123 * STEP
