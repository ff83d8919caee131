"""The state machine: its steps, what is latched, and what limits are taken."""

from math import nan

import pytest

from rig.plain_bench import COMPLIANCE, period, plain_bench, run, taut
from tendonrod.errors import InvalidInput
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import STILL, AxisLimits, Command, DeviceError
from tendonrod.rig.limits import Limits
from tendonrod.rig.safety import IllegalTransition, Interlock
from tendonrod.rig.states import FaultKind, State

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
