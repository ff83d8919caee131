"""A load cell that lies: dead from the start, the wrong way round, standing still. What it hides stays small."""

from math import nan

import pytest

from rig.plain_bench import COMPLIANCE, PERIOD, period, run, running, taut
from tendonrod.rig.axis_watch import AxisWatch
from tendonrod.rig.interfaces import AxisLimits, AxisState, Command, DeviceError
from tendonrod.rig.limits import Limits
from tendonrod.rig.states import FaultKind, State
from tendonrod.rig.tension_watch import FROZEN, PUSHED

LIMITS = Limits()
WIND = 1e-3  # m/s
STEP = 2.0 * WIND * PERIOD  # what one period, and one more for the reaction, add
PULLS = [
    Command(screw=-WIND, target=0.5),
    Command(screw=-WIND),  # a controller that does not say what it aims at
    Command(translation=WIND, target=0.01),
]


def pulled_until_found(bench, guarded, command, seconds=5.0) -> float:
    """m that is pulled before the interlock stops it."""
    start = bench.translation.position - bench.screw.position
    run(guarded, command, seconds)
    assert guarded.interlock.fault.kind is FaultKind.TENSION_LOST
    return abs(bench.translation.position - bench.screw.position - start)


@pytest.mark.parametrize("command", PULLS)
@pytest.mark.parametrize("zero", [0.0, 0.04, -0.06])
def test_a_cell_that_is_dead_from_the_start_is_found_within_the_take_up(command, zero):
    bench, guarded = running()
    bench.load_cell.change = {"tension": zero}
    guarded.interlock._watch.restart()
    period(guarded)
    assert LIMITS.take_up < pulled_until_found(bench, guarded, command) <= LIMITS.take_up + STEP


@pytest.mark.parametrize("command", PULLS[:2])
def test_a_cell_the_wrong_way_round_is_found_before_it_hides_much(command):
    bench, guarded = running()
    read = bench.load_cell.read

    def reversed_reading():
        force = read()
        return type(force)(time=force.time, tension=-force.tension)

    bench.load_cell.read = reversed_reading
    pulled = pulled_until_found(bench, guarded, command)
    assert pulled / COMPLIANCE == pytest.approx(PUSHED * LIMITS.slack, abs=2.0 * STEP / COMPLIANCE)


@pytest.mark.parametrize("command", [*PULLS, Command(screw=WIND, target=0.5)])
def test_a_reading_that_stands_still_is_found_within_a_small_pull(command):
    bench, guarded = taut(0.5)
    bench.load_cell.change = {"tension": 0.5}
    period(guarded)
    pulled = pulled_until_found(bench, guarded, command)
    assert FROZEN * LIMITS.lost_pull < pulled <= FROZEN * LIMITS.lost_pull + STEP


def test_a_constant_reading_is_no_fault_where_nothing_is_pulled():
    """Screw and translation go along with each other, as they do in follow-the-leader motion."""
    _, guarded = taut(0.5)
    run(guarded, Command(screw=WIND, translation=WIND, target=0.5), 5.0)
    assert guarded.interlock.fault is None


def test_a_slack_tendon_may_be_taken_up():
    bench, guarded = running()
    bench.load_cell.offset = -0.5 * LIMITS.take_up
    guarded.interlock._watch.restart()
    for _ in range(round(1.2 / PERIOD)):
        period(guarded, Command(screw=-WIND, target=0.3))
    assert guarded.interlock.fault is None
    assert bench.load_cell.read().tension > 2.0 * LIMITS.slack


def test_an_encoder_that_jumps_is_no_pull():
    """Else the reading, which is right, would not be believed in the release."""
    bench, guarded = taut(0.5)
    bench.translation.change = {"position": 0.05}
    run(guarded, PULLS[0], 0.2)
    assert [each.kind for each in guarded.interlock.faults] == [FaultKind.ENCODER_JUMP]


# Other readings that must not pass


def test_a_clock_that_goes_back_is_found_at_once():
    bench, guarded = taut(0.2)
    period(guarded, PULLS[2])
    for axis in bench.axes:
        axis.since -= 0.02
    bench.clock.time -= 0.02
    guarded.sense()
    assert str(guarded.interlock.fault) == "sensor value too old (clock): -0.02 s, allowed 0 s; hold"


@pytest.mark.parametrize("axis", ["screw", "translation", "rotation"])
def test_an_axis_that_loses_its_reference_is_found_at_once(axis):
    """A board that starts anew in mid-motion, near zero, where no jump shows."""
    bench, guarded = taut(0.2)
    getattr(bench, axis).change = {"homed": False}
    period(guarded)
    assert (guarded.interlock.fault.kind, guarded.interlock.fault.where) == (FaultKind.ENCODER_JUMP, axis)
    run(guarded, Command(), 0.1)
    guarded.interlock.acknowledge()
    assert guarded.interlock.state is State.IDLE


@pytest.mark.parametrize(("window", "dt"), [(1.5, 1e-3), (0.02, 1e-3), (0.02, 1e-2)])
def test_a_tension_that_changes_too_fast_is_found_with_any_window(window, dt):
    limits = Limits(rate_window=window, tension_rate=0.4, tension=3.0, strain=1.0, period=dt)
    bench, guarded = taut(0.5, limits)
    begun = guarded.clock.now()
    while guarded.interlock.fault is None and guarded.clock.now() - begun < 3.0:
        bench.load_cell.offset += 0.5 * dt * COMPLIANCE
        period(guarded, Command(), dt)
    assert guarded.interlock.fault.kind is FaultKind.TENSION_RATE
    assert guarded.interlock.fault.time - begun <= window + 2.0 * dt


def test_an_axis_that_stops_faster_than_said_and_moves_again_is_no_stall():
    """As after a hard stop: it must not be held to the slow stop that its acceleration allows."""
    axis = AxisLimits(low=-0.1, high=0.1, speed=5e-3, acceleration=0.01)
    watch = AxisWatch("screw", axis, LIMITS, 0)
    sent, position, velocity, found = 0.0, 0.0, 0.0, []
    told = [1.5e-3] * 100 + [0.0] * 2 + [-1.5e-3] * 100
    for k, command in enumerate(told):
        state = AxisState(time=PERIOD * k, position=position, velocity=velocity)
        found += watch.found(state, sent, PERIOD * k)
        sent, before = command, velocity
        most = axis.acceleration * PERIOD
        velocity = 0.0 if command == 0.0 else min(max(command, before - most), before + most)
        position += 0.5 * (before + velocity) * PERIOD if command else 0.0
    assert LIMITS.lag[0] < 1.5e-3**2 / axis.acceleration  # what a slow stop would take of the way
    assert not found


def test_an_axis_that_obeys_is_no_stall_where_a_period_was_late():
    """The host was held up for three periods and sent its command late; the axis did as it was told, when it was."""
    axis = AxisLimits(low=-9.0, high=9.0, speed=2.0, acceleration=100.0)
    watch = AxisWatch("rotation", axis, LIMITS, 2)
    now, position, velocity, sent, found = 0.0, 0.0, 0.0, 0.0, []
    for k in range(100):
        found += watch.found(AxisState(time=now, position=position, velocity=velocity), sent, now)
        late, sent = sent, 2.0 if k > 10 else 0.0
        step = 3.2 * PERIOD if k == 11 else PERIOD  # the new command only comes at the end of it
        before, most = velocity, axis.acceleration * step
        velocity = min(max(late if k == 11 else sent, before - most), before + most)
        ramp = abs(velocity - before) / axis.acceleration
        position += 0.5 * (before + velocity) * ramp + velocity * (step - ramp)
        now += step
    assert LIMITS.lag[2] + 2 * PERIOD * 2.0 < 3.2 * PERIOD * 2.0  # more than two periods' worth
    assert not found


# What a driver or a controller may hand over


@pytest.mark.parametrize("answer", [None, 0.1, "0.1"])
@pytest.mark.parametrize("device", ["screw", "load_cell", "tracker"])
def test_an_answer_that_is_none_is_the_drivers_fault_and_stops_the_others(device, answer):
    bench, guarded = taut(0.2)
    period(guarded, Command(screw=1e-4, translation=1e-4))
    getattr(bench, device).read = lambda: answer
    period(guarded, Command(screw=1e-4, translation=1e-4))
    assert guarded.interlock.fault.kind is FaultKind.DEVICE
    assert str(guarded.interlock.fault).count("\n") == 0
    assert bench.translation.velocity == bench.rotation.velocity == 0.0


@pytest.mark.parametrize("field", ["position", "velocity", "time"])
def test_a_state_without_a_number_is_the_drivers_fault(field):
    bench, guarded = taut(0.2)
    bench.translation.change = {field: None}
    period(guarded)
    assert guarded.interlock.fault.kind is FaultKind.DEVICE


class Evil:
    """Looks like a command, and is code."""

    target = nan

    @property
    def screw(self) -> float:
        raise DeviceError("not a number at all")


def test_a_command_that_raises_when_it_is_looked_at_moves_nothing():
    bench, guarded = taut(0.2)
    period(guarded, Command(translation=1e-4))
    period(guarded, Evil())  # pyright: ignore[reportArgumentType]
    assert guarded.interlock.fault.kind is FaultKind.CONTROLLER
    assert [axis.velocity for axis in bench.axes] == [0.0] * 3


def test_an_axis_that_starts_to_move_late_in_a_release_is_stopped_hard():
    """Two faults: the tendon is being let go when an axis runs away; a hard stop is the only one it may obey."""
    bench, guarded = taut(0.5)
    guarded.interlock.trip(FaultKind.SATURATION)

    def told(seconds: float) -> set:
        """What translation is told in the next ``seconds``."""
        bench.translation.sent.clear()
        for _ in range(round(seconds / PERIOD)):
            period(guarded)
        assert bench.screw.velocity > 0.0
        return set(bench.translation.sent)

    told(0.02)
    assert told(0.15) == {0.0}
    bench.translation.change = {"velocity": 2e-3}
    assert told(0.05) == {"stop"}
    told(0.1)  # in vain: the screw must get its turn, since its board may share the stop
    assert told(0.05) == {0.0}
