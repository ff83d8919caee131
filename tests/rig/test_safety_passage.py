"""What gets through: the release until slack, soft limits, and the ends of travel."""

from math import inf, nan

import pytest

from rig.plain_bench import COMPLIANCE, PERIOD, period, plain_bench, run, running, taut
from tendonrod.errors import TendonrodError
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import STILL, Command
from tendonrod.rig.limits import Limits, room_speed
from tendonrod.rig.safety import IllegalTransition
from tendonrod.rig.states import FaultKind, Reaction, State

FORWARD = Command(translation=2e-3, rotation=0.1)


def test_release_pays_out_until_slack_and_moves_nothing_else():
    bench, guarded = taut(0.7)
    bench.load_cell.offset += 0.4 * COMPLIANCE
    run(guarded, FORWARD, 1.0)
    at = bench.translation.position, bench.rotation.position
    assert guarded.interlock.reaction is Reaction.RELEASE
    with pytest.raises(IllegalTransition, match="has not finished"):
        guarded.interlock.acknowledge()
    sent = [period(guarded, FORWARD)[1] for _ in range(400)]
    limits = guarded.interlock.limits
    assert {each.screw for each in sent} == {0.0, limits.release_rate}
    assert all(each.translation == each.rotation == 0.0 for each in sent)
    assert (bench.translation.position, bench.rotation.position) == at
    assert bench.load_cell.read().tension < limits.slack
    assert bench.load_cell.read().tension > limits.slack - 2 * limits.release_rate * PERIOD / COMPLIANCE
    assert guarded.interlock.is_settled


def test_release_without_a_reading_ends_with_its_time():
    bench, guarded = taut(0.7)
    bench.load_cell.change = {"tension": nan, "saturated": True}
    run(guarded, FORWARD, 1.0)
    for _ in range(1000):
        period(guarded)
    limits = guarded.interlock.limits
    paid = bench.screw.position
    assert limits.release_travel <= paid <= limits.release_timeout * limits.release_rate + 1e-4
    assert guarded.interlock.is_settled
    assert bench.screw.velocity == 0.0


def test_release_does_not_pass_the_travel():
    bench, guarded = taut(0.7)
    bench.screw.position = 0.0995
    bench.load_cell.offset += 0.101
    guarded.interlock._watch.restart()
    for _ in range(1000):
        period(guarded)
    assert 0.0999 < bench.screw.position <= 0.1


def test_tension_that_rises_while_held_is_released():
    bench, guarded = taut(0.3)
    bench.translation.change = {"stalled": True}
    run(guarded, FORWARD, 1.0)
    assert guarded.interlock.reaction is Reaction.HOLD
    bench.load_cell.offset += COMPLIANCE
    for _ in range(500):
        period(guarded)
    assert guarded.interlock.fault.kind is FaultKind.STALL
    assert FaultKind.TENSION in {fault.kind for fault in guarded.interlock.faults}
    assert bench.load_cell.read().tension < guarded.interlock.limits.slack


def test_tension_that_comes_back_after_the_release_is_released_again():
    bench, guarded = taut(0.5)
    guarded.interlock.release()
    for _ in range(400):
        period(guarded)
    assert guarded.interlock.is_settled
    bench.load_cell.offset += 1.2 * COMPLIANCE
    period(guarded)
    assert not guarded.interlock.is_settled
    for _ in range(500):
        period(guarded)
    assert bench.load_cell.read().tension < guarded.interlock.limits.slack


def test_held_bench_keeps_its_tension_and_goes_on():
    bench, guarded = taut(0.5)
    guarded.interlock.hold()
    before = bench.load_cell.read().tension
    for _ in range(100):
        assert period(guarded, FORWARD)[1] == STILL
    assert bench.load_cell.read().tension == before
    guarded.interlock.resume()
    assert period(guarded, FORWARD)[1].translation == FORWARD.translation


def test_released_bench_does_not_resume():
    _, guarded = taut(0.5)
    guarded.interlock.release()
    with pytest.raises(IllegalTransition, match="released"):
        guarded.interlock.resume()
    for _ in range(400):
        period(guarded)
    guarded.interlock.acknowledge()
    assert guarded.interlock.state is State.HOMED


def test_tense_bench_of_a_process_that_died_can_be_slackened_then_homed():
    bench = plain_bench()
    bench.load_cell.offset = 0.7 * COMPLIANCE
    guarded = GuardedBench(bench)
    with pytest.raises(TendonrodError, match=r"^cannot home: the tension is 0.7 N"):
        guarded.home()
    assert not any(axis.sent for axis in bench.axes)
    guarded.interlock.release()
    for _ in range(400):
        period(guarded)
    guarded.interlock.acknowledge()
    assert guarded.interlock.state is State.IDLE
    bench.load_cell.offset = 0.0
    guarded.home()
    assert guarded.interlock.state is State.HOMED


def test_unknown_tension_is_not_released_before_homing():
    bench = plain_bench()
    bench.load_cell.change = {"tension": nan}
    guarded = GuardedBench(bench)
    guarded.interlock.release()
    for _ in range(400):
        period(guarded)
    assert bench.screw.position == 0.0
    with pytest.raises(TendonrodError, match="cannot home"):
        guarded.home()


def test_soft_limit_lets_only_lowering_motion_through():
    bench, guarded = taut(0.95)
    raising = Command(screw=-1e-3, translation=1e-3, rotation=0.1, target=0.7)
    lowering = Command(screw=1e-3, translation=-1e-3, rotation=0.1)
    bench.translation.position += 0.01
    bench.load_cell.offset -= 0.01
    guarded.interlock._watch.restart()
    sent = period(guarded, raising)[1]
    assert (sent.screw, sent.translation, sent.rotation, sent.target) == (0.0, 0.0, 0.1, 0.7)
    sent = period(guarded, lowering)[1]
    assert (sent.screw, sent.translation) == (1e-3, -1e-3)


def test_soft_limit_of_strain():
    _, guarded = running(strain=lambda insertion, tension: 0.95 * 6.67e-3)
    assert period(guarded, FORWARD)[1].translation == 0.0


@pytest.mark.parametrize("v", [1.0, -1.0, 1e300])
def test_travel_ends_softly(v):
    """At full speed towards the end of its travel an axis stops inside it, without a fault."""
    bench, guarded = running(Limits(take_up=0.1))
    bench.translation.position = 0.07 if v > 0 else 0.005
    bench.load_cell.change = {"tension": 0.0}
    guarded.interlock._watch.restart()
    for _ in range(1000):
        period(guarded, Command(translation=v))
        assert 0.0 <= bench.translation.position <= 0.076
    assert guarded.interlock.fault is None
    assert min(bench.translation.position, 0.076 - bench.translation.position) < 1e-6


def test_pressed_switch_stops_motion_into_it_only():
    bench, guarded = running()
    bench.translation.position, bench.translation.change = 0.02, {"at_limit": 1}
    bench.load_cell.change = {"tension": 0.0}
    guarded.interlock._watch.restart()
    assert period(guarded, FORWARD)[1].translation == 0.0
    assert period(guarded, Command(translation=-1e-3))[1].translation == -1e-3


def test_room_speed_stops_in_the_room():
    for room, a, delay in [(1e-3, 0.05, 0.01), (1e-6, 0.05, 0.01), (0.1, 2.0, 1e-3)]:
        v = room_speed(room, a, delay)
        assert v * delay + v * v / (2 * a) == pytest.approx(room, rel=1e-9)
    assert room_speed(1e-3, inf, 0.01) == pytest.approx(0.1)
    assert room_speed(-1.0, 1.0, 0.01) == room_speed(nan, 1.0, 0.01) == 0.0
