"""The state machine: its steps, what is latched, and what each reaction does."""

from math import inf, nan

import pytest

from rig.plain_bench import COMPLIANCE, PERIOD, period, plain_bench, run, running
from tendonrod.errors import InvalidInput, TendonrodError
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import STILL, AxisLimits, Command, DeviceError
from tendonrod.rig.limits import Limits, room_speed
from tendonrod.rig.safety import IllegalTransition, Interlock
from tendonrod.rig.states import FaultKind, Reaction, State

FORWARD = Command(translation=2e-3, rotation=0.1)
STEPS = ("home", "arm", "start", "hold", "resume", "finish", "acknowledge")
POSSIBLE = {
    State.IDLE: {"home"},
    State.HOMED: {"home", "arm"},
    State.ARMED: {"start"},
    State.RUNNING: {"hold", "finish"},
    State.HELD: {"resume", "finish"},
    State.FAULT: {"acknowledge"},
}


def taut(tension: float, **changes):
    """Running, under tension (N)."""
    bench, guarded = running(Limits(**changes))
    bench.load_cell.offset = tension * COMPLIANCE
    guarded.interlock._watch.restart()
    period(guarded)
    return bench, guarded


def brought_to(state: State):
    bench = plain_bench()
    guarded = GuardedBench(bench)
    lock = guarded.interlock
    steps = {
        State.IDLE: [], State.HOMED: [guarded.home], State.ARMED: [guarded.home, lock.arm],
        State.RUNNING: [guarded.home, lock.arm, lock.start],
        State.HELD: [guarded.home, lock.arm, lock.start, lock.hold],
        State.FAULT: [lambda: lock.trip(FaultKind.RECORD), guarded.act],
    }  # fmt: skip
    for step in steps[state]:
        step()
    assert lock.state is state
    return bench, guarded


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("step", STEPS)
def test_steps_are_possible_where_stated_and_nowhere_else(state, step):
    _, guarded = brought_to(state)
    if step in POSSIBLE[state]:
        getattr(guarded.interlock, step)()
        return
    with pytest.raises(IllegalTransition, match=f"^cannot {step}: ") as raised:
        getattr(guarded.interlock, step)()
    assert "\n" not in str(raised.value)
    assert guarded.interlock.state is state


@pytest.mark.parametrize("state", [each for each in State if each is not State.RUNNING])
def test_only_running_obeys(state):
    bench, guarded = brought_to(state)
    for _ in range(20):
        period(guarded, FORWARD)
    assert [axis.velocity for axis in bench.axes] == [0.0] * 3


def test_nothing_after_shutdown():
    _, guarded = brought_to(State.RUNNING)
    guarded.interlock.shutdown()
    for step in STEPS:
        with pytest.raises(IllegalTransition, match="shut down"):
            getattr(guarded.interlock, step)()


def test_arming_needs_every_axis_homed():
    bench, guarded = brought_to(State.HOMED)
    bench.rotation.homed = False
    period(guarded)
    with pytest.raises(IllegalTransition, match="every axis is homed"):
        guarded.interlock.arm()


def test_first_fault_is_latched_and_later_ones_are_listed_once():
    bench, guarded = taut(0.3)
    bench.load_cell.change = {"tension": nan}
    run(guarded, FORWARD, 1.0)
    bench.rotation.change = {"velocity": 9.0}
    for _ in range(50):
        period(guarded, FORWARD)
    bench.load_cell.change, bench.rotation.change = {}, {}
    for _ in range(50):
        sample, sent = period(guarded, FORWARD)
        assert guarded.interlock.check(sample).kind is FaultKind.NAN_SENSOR
        assert sent == STILL
    assert [fault.kind for fault in guarded.interlock.faults] == [FaultKind.NAN_SENSOR, FaultKind.SPEED]


def test_acknowledged_bench_starts_again():
    bench, guarded = taut(0.3)
    bench.translation.change = {"stalled": True}
    run(guarded, FORWARD, 1.0)
    bench.translation.change = {}
    guarded.interlock.acknowledge()
    assert (guarded.interlock.state, guarded.interlock.fault) == (State.HOMED, None)
    guarded.interlock.arm()
    guarded.interlock.start()
    assert period(guarded, FORWARD)[1].translation == FORWARD.translation


def test_cause_that_stays_trips_again():
    bench, guarded = taut(0.3)
    bench.translation.change = {"stalled": True}
    run(guarded, FORWARD, 1.0)
    guarded.interlock.acknowledge()
    period(guarded)
    assert guarded.interlock.fault.kind is FaultKind.STALL


@pytest.mark.parametrize(
    ("break_it", "state"),
    [
        (lambda bench: bench.screw.change.update(position=0.02), State.IDLE),
        (lambda bench: setattr(bench.screw, "error", DeviceError("gone")), State.IDLE),
        (lambda bench: setattr(bench.tracker, "error", DeviceError("gone")), State.HOMED),
    ],
    ids=["encoder jumped", "axis silent", "tracker silent"],
)
def test_reference_is_lost_with_its_axis_only(break_it, state):
    bench, guarded = taut(0.0)
    break_it(bench)
    run(guarded, STILL, 1.0)
    guarded.interlock.acknowledge()
    assert guarded.interlock.state is state


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
    bench, guarded = running()
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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tension": -1.0}, "tension = -1.0: must be > 0"),
        ({"slack": 2.0}, r"slack = 2.0: must be below soft \* tension = 0.9"),
        ({"soft": 1.2}, "soft = 1.2: must be from 0.05 to 1"),
        ({"late_in_row": 0}, "late_in_row = 0: must be a whole number >= 1"),
        ({"lag": (1.0, 2.0)}, r"lag = \(1.0, 2.0\): must be three numbers"),
        ({"jump": (1.0, nan, 1.0)}, r"jump\[1\] = nan"),
        ({"screw": AxisLimits(low=1.0, high=0.0, speed=1.0)}, "screw = .*low end is below its high end"),
        ({"release_rate": 1.0}, "release_rate = 1.0: must be at most screw.speed = 0.003"),
    ],
)
def test_bad_limits_by_name(change, message):
    with pytest.raises(InvalidInput, match=message):
        Limits(**change)


def test_limits_are_narrowed_by_devices_never_widened():
    slow = AxisLimits(low=0.0, high=1.0, speed=0.5e-3, acceleration=5e-3)
    limits = Limits().narrowed([slow, AxisLimits(), AxisLimits()], full_scale=10.0)
    assert limits.screw == AxisLimits(low=0.0, high=100e-3, speed=0.5e-3, acceleration=5e-3)
    assert limits.translation == Limits().translation
    assert (limits.full_scale, limits.release_rate) == (10.0, 0.5e-3)
    assert limits.release_timeout == pytest.approx(16.5)


def test_interlock_without_clock_replays():
    """On samples alone it comes to the same faults: a record can be checked again."""
    bench, guarded = taut(0.3)
    samples = [period(guarded, FORWARD)[0] for _ in range(20)]
    bench.load_cell.offset += COMPLIANCE
    samples += [period(guarded, FORWARD)[0] for _ in range(5)]
    lock = Interlock(guarded.interlock.limits, tools=("tip",))
    lock.home()
    lock.check(samples[0])
    lock.arm()
    lock.start()
    for sample in samples:
        lock.check(sample)
        lock.allowed(FORWARD, sample)
    assert lock.fault.kind is guarded.interlock.fault.kind
    assert lock.fault.time == guarded.interlock.fault.time
