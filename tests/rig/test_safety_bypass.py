"""What holds for any sequence of commands and samples, and that nothing leads round the interlock."""

import inspect
from contextlib import suppress
from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.plain_bench import PERIOD, period, plain_bench, running
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import STILL, Axis, Bench, Command, DeviceError
from tendonrod.rig.safety import IllegalTransition
from tendonrod.rig.states import FaultKind, Reaction, State

NUMBER = st.one_of(
    st.floats(-0.01, 0.01), st.floats(-3.0, 3.0), st.floats(), st.sampled_from([nan, inf, -inf, 1e308, -1e308, 0.0])
)
COMMAND = st.builds(Command, screw=NUMBER, translation=NUMBER, rotation=NUMBER, target=NUMBER)
AXIS_CHANGE = st.fixed_dictionaries(
    {}, optional={
        "position": NUMBER, "velocity": NUMBER, "time": NUMBER, "stalled": st.booleans(),
        "at_limit": st.sampled_from([-1, 0, 1]), "homed": st.booleans(),
    },
)  # fmt: skip
CELL_CHANGE = st.fixed_dictionaries({}, optional={"tension": NUMBER, "time": NUMBER, "saturated": st.booleans()})
ERROR = st.sampled_from([None, None, None, DeviceError("gone"), OSError("broken pipe"), ValueError("a bug")])
WORLD = st.fixed_dictionaries(
    {}, optional={
        "screw": AXIS_CHANGE, "translation": AXIS_CHANGE, "rotation": AXIS_CHANGE, "load_cell": CELL_CHANGE,
        "error": st.tuples(st.sampled_from(["screw", "translation", "rotation", "load_cell", "tracker"]), ERROR),
    },
)  # fmt: skip
WORD = st.sampled_from(["none"] * 6 + ["emergency", "interrupt", "hold", "resume", "release", "acknowledge", "again"])
PERIODS = st.lists(st.tuples(COMMAND, WORLD, WORD, st.sampled_from([PERIOD, PERIOD, 0.0, 0.02, 5.0])), max_size=25)


def tell(guarded, word: str) -> None:
    """A step of the state machine where it is possible."""
    lock = guarded.interlock
    steps = {"again": [lock.acknowledge, lock.arm, lock.start], "none": []}
    for step in steps.get(word) or ([] if word == "none" else [getattr(lock, word)]):
        with suppress(IllegalTransition):
            step()


def disturb(bench, world: dict) -> None:
    for name in ("screw", "translation", "rotation", "load_cell"):
        getattr(bench, name).change = world.get(name, {})
        getattr(bench, name).error = None
    bench.tracker.error = None
    if "error" in world:
        getattr(bench, world["error"][0]).error = world["error"][1]


@settings(max_examples=250, deadline=None)
@given(PERIODS)
def test_whatever_comes(periods):
    """No velocity beyond limits; none in fault but the screw's release; latched; an emergency stops in one act."""
    bench, guarded = running()
    lock, limits = guarded.interlock, guarded.interlock.limits
    for command, world, word, dt in periods:
        before = lock.fault
        disturb(bench, world)
        for axis in bench.axes:
            axis.sent.clear()
        tell(guarded, word)
        sample, sent = period(guarded, command, dt)
        moved = [[v for v in axis.sent if v != "stop"] for axis in bench.axes]
        for velocities, axis in zip(moved, limits.axes, strict=True):
            assert all(abs(v) <= axis.speed for v in velocities)
        if lock.state is not State.RUNNING:
            assert not any(moved[1]) or lock.fault is not before, "a fault within act may follow its first command"
            assert sent.translation == sent.rotation == 0.0
            assert 0.0 <= sent.screw <= limits.release_rate
            assert sent.screw == 0.0 or lock.reaction is Reaction.RELEASE
        if before is not None and word not in ("acknowledge", "again"):
            assert lock.fault is before
            assert lock.state is State.FAULT
        if word == "emergency":
            assert lock.state is State.FAULT
            assert lock.reaction is Reaction.STOP
            assert sent == STILL
            assert not any(v for velocities in moved for v in velocities)
        for velocity, state, axis in zip(
            (sent.screw, sent.translation, sent.rotation),
            (sample.screw, sample.translation, sample.rotation),
            limits.axes,
            strict=True,
        ):
            if lock.state is State.RUNNING:
                assert not (velocity > 0.0 and state.position >= axis.high)
                assert not (velocity < 0.0 and state.position <= axis.low)
        if lock.state is State.RUNNING and not sample.force.tension <= limits.soft * limits.tension:
            assert sent.translation <= 0.0
            assert sent.screw >= 0.0


@settings(max_examples=60, deadline=None)
@given(st.lists(COMMAND, min_size=1, max_size=60))
def test_any_commands_leave_a_sound_bench_inside_its_limits(commands):
    """A tendon that is a spring never gets beyond the limit of tension by more than one period's worth."""
    _, guarded = running()
    limits = guarded.interlock.limits
    fastest = (limits.screw.speed + limits.translation.speed) * PERIOD / 3.3e-3
    for command in commands:
        for _ in range(20):
            sample, _ = period(guarded, command)
            assert sample.force.tension <= limits.soft * limits.tension + fastest
            for state, axis in zip((sample.screw, sample.translation, sample.rotation), limits.axes, strict=True):
                assert axis.low <= state.position <= axis.high
    assert guarded.interlock.fault is None or guarded.interlock.fault.kind is FaultKind.CONTROLLER


def test_emergency_between_sense_and_act_is_in_time():
    bench, guarded = running()
    period(guarded, Command(translation=2e-3))
    guarded.sense()
    guarded.interlock.emergency("button")
    assert guarded.act(Command(translation=2e-3)) == STILL
    assert [axis.velocity for axis in bench.axes] == [0.0] * 3
    assert guarded.interlock.fault.where == "button"


def test_axis_that_refuses_its_command_stops_the_others_in_the_same_act():
    bench, guarded = running()
    guarded.sense()
    bench.screw.error = DeviceError("refused")
    assert guarded.act(Command(screw=1e-3, translation=1e-3, rotation=0.1)) == STILL
    assert bench.translation.velocity == bench.rotation.velocity == 0.0
    assert str(guarded.interlock.fault) == "device does not answer (screw: refused); hold"


def test_fault_stops_hard_once_and_while_it_moves():
    bench, guarded = running()
    period(guarded, Command(translation=2e-3))
    guarded.interlock.trip(FaultKind.RECORD)
    period(guarded)
    assert [axis.sent[-1] for axis in bench.axes] == ["stop"] * 3
    period(guarded)
    assert [axis.sent[-1] for axis in bench.axes] == [0.0] * 3
    bench.rotation.change = {"velocity": 0.5}
    period(guarded)
    assert [axis.sent[-1] for axis in bench.axes] == [0.0, 0.0, "stop"]


def test_release_beside_an_axis_that_shares_its_stop():
    """Stops come first, so that they do not undo the screw's motion; later there are none."""
    bench, guarded = running()
    order = []
    for axis in bench.axes:
        axis.stop = lambda name=axis.name: order.append((name, "stop"))
        axis.move = lambda v, name=axis.name: order.append((name, v))
    bench.load_cell.change = {"tension": 0.5}
    guarded.interlock.interrupt()
    period(guarded)
    assert [name for name, _ in order] == ["translation", "rotation", "screw"]
    assert [what for _, what in order] == ["stop", "stop", guarded.interlock.limits.release_rate]


def test_no_axis_is_to_be_had():
    """Nothing that a guarded bench offers is, or returns, a device."""
    bench, guarded = running()
    devices = {id(each) for each in (bench, *bench.axes, bench.load_cell, bench.tracker)}
    public = [name for name in dir(guarded) if not name.startswith("_")]
    assert set(public) == {"act", "clock", "close", "home", "interlock", "name", "sense"}
    for name in public:
        assert id(getattr(guarded, name)) not in devices
    for value in vars(guarded.interlock).values():
        assert id(value) not in devices
        assert not isinstance(value, (Axis, Bench))
    with pytest.raises(AttributeError):
        setattr(guarded, "screw", bench.screw)  # noqa: B010
    assert not any(isinstance(field, Axis) for field in vars(type(guarded)).values())
    assert "axis" not in inspect.signature(guarded.act).parameters


def test_sample_counts_once():
    """A loop that checks again what `sense` checked changes nothing."""
    _, guarded = running()
    for _ in range(40):
        sample, _ = period(guarded, Command(translation=1e-3), dt=1.6 * PERIOD)
        if guarded.interlock.fault:
            break
        for _ in range(5):
            guarded.interlock.check(sample, 1.6 * PERIOD)
    late = guarded.interlock.limits.late_in_row * 1.6 * PERIOD
    assert guarded.clock.now() == pytest.approx(PERIOD + late)


def test_act_before_sense_senses():
    bench = plain_bench()
    assert GuardedBench(bench).act(Command(translation=1.0)) == STILL


def test_devices_own_limits_hold():
    bench = plain_bench()
    bench.translation.limits = replace(bench.translation.limits, speed=1e-3)
    guarded = GuardedBench(bench)
    guarded.home()
    guarded.interlock.arm()
    guarded.interlock.start()
    assert period(guarded, Command(translation=4e-3))[1].translation == 1e-3


def test_homing_fails_cleanly():
    bench = plain_bench()
    guarded = GuardedBench(bench)
    bench.rotation.error = DeviceError("no reference found")
    with pytest.raises(DeviceError, match="no reference found"):
        guarded.home()
    assert guarded.interlock.state is State.FAULT
    assert "home" not in bench.screw.sent  # what comes after it did not move


def test_emergency_ends_homing():
    bench = plain_bench()
    guarded = GuardedBench(bench)
    home = bench.translation.home
    bench.translation.home = lambda should_stop: home(should_stop) or guarded.interlock.emergency("Esc")
    guarded.home()
    assert guarded.interlock.state is State.FAULT
    assert "home" not in bench.rotation.sent + bench.screw.sent
