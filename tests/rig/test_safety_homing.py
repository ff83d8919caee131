"""Homing: refused unless the tendon is known to be slack, stopped at once, and looked at meanwhile."""

import signal

import pytest

from rig.plain_bench import PERIOD, plain_bench
from tendonrod.errors import TendonrodError
from tendonrod.rig.ending import safely
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import DeviceError
from tendonrod.rig.states import FaultKind, Reaction, State
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.injection import Injection, InjectionKind
from virtual_setups import usual, with_faults


@pytest.mark.parametrize(
    "change",
    [
        {"tension": 0.3},
        {"tension": float("nan")},
        {"tension": -22.0, "saturated": True},
        {"tension": 0.0, "saturated": True},
        {"tension": -1.0},  # a tendon does not push: the cell is the wrong way round, or was tared taut
        {"tension": 0.0, "time": 0.0},  # what it said long ago
    ],
)
def test_nothing_moves_unless_the_tendon_is_known_to_be_slack(change):
    bench = plain_bench()
    bench.clock.time = 10.0
    bench.load_cell.change = change
    guarded = GuardedBench(bench)
    with pytest.raises(TendonrodError, match="cannot home") as error:
        guarded.home()
    assert "\n" not in str(error.value)
    assert not any("home" in axis.sent for axis in bench.axes)
    assert guarded.interlock.state is State.IDLE


def homing(at: int, deed):
    """A bench whose translation takes 100 periods to home; ``deed`` (bench, interlock) happens after ``at`` of them."""
    bench = plain_bench()
    guarded = GuardedBench(bench)
    bench.translation.homing, read, begun = 100, bench.load_cell.read, bench.clock.now()

    def reading():
        if bench.clock.now() >= begun + (at - 0.5) * PERIOD:
            deed(bench, guarded.interlock)
        return read()

    bench.load_cell.read = reading
    guarded.home()
    return bench, guarded, round((bench.clock.now() - begun) / PERIOD)


@pytest.mark.parametrize(
    ("deed", "kind"),
    [
        (lambda bench, lock: lock.emergency("Esc") if not lock.is_asked_to_stop else None, FaultKind.EMERGENCY),
        (lambda bench, lock: bench.load_cell.change.update(tension=1.2), FaultKind.TENSION),
        (lambda bench, lock: bench.load_cell.change.update(tension=-1.2), FaultKind.TENSION),
        (lambda bench, lock: bench.load_cell.change.update(tension=float("nan")), FaultKind.NAN_SENSOR),
        (lambda bench, lock: setattr(bench.load_cell, "error", DeviceError("gone")), FaultKind.DEVICE),
    ],
)
def test_homing_ends_within_a_step(deed, kind):
    bench, guarded, periods = homing(20, deed)
    assert periods <= 22
    assert kind in {each.kind for each in guarded.interlock.faults}
    assert guarded.interlock.state is State.FAULT
    assert not guarded.interlock.is_homed
    assert "home" not in bench.rotation.sent + bench.screw.sent


def test_a_reading_that_grows_old_ends_homing():
    _, guarded, periods = homing(20, lambda bench, lock: bench.load_cell.change.setdefault("time", bench.clock.now()))
    limits = guarded.interlock.limits
    assert periods * PERIOD <= 22 * PERIOD + limits.sensor_age
    assert guarded.interlock.fault.kind is FaultKind.STALE_SENSOR


@pytest.mark.parametrize("when", [0.05, 1.0, 3.0])
def test_a_virtual_axis_stands_a_moment_after_the_stop(when):
    """The robot is half way out: homing takes 15 s and more."""
    bench = virtual_bench(usual(), 0)
    guarded = GuardedBench(bench)
    wait = bench.clock.wait_until

    def waited(time: float) -> None:
        wait(time)
        if time >= when and not guarded.interlock.is_asked_to_stop:
            guarded.interlock.emergency("Esc")

    object.__setattr__(bench.clock, "wait_until", waited)
    guarded.home()
    assert guarded.interlock.reaction is Reaction.STOP
    assert bench.clock.now() <= when + 0.02
    wait(bench.clock.now() + 0.1)
    assert all(axis.read().velocity == 0.0 for axis in bench.axes)
    assert not bench.translation.read().homed


def test_ctrl_c_while_homing_leaves_a_stopped_bench():
    bench = virtual_bench(usual(), 0)
    guarded = GuardedBench(bench)
    wait = bench.clock.wait_until

    def waited(time: float) -> None:
        wait(time)
        if 1.0 <= time < 1.005:
            signal.raise_signal(signal.SIGINT)

    object.__setattr__(bench.clock, "wait_until", waited)
    with safely(guarded):
        guarded.home()
        assert bench.clock.now() < 1.03
    assert guarded.interlock.fault.where == "Ctrl-C"
    assert all(abs(drive.velocity) < 1e-9 for drive in bench.world.drives.values())


def test_a_virtual_axis_that_fails_in_homing_is_stopped():
    fault = Injection(kind=InjectionKind.STALL, time=0.5, where="translation")
    bench = virtual_bench(with_faults(usual(), fault), 0)
    guarded = GuardedBench(bench)
    with pytest.raises(DeviceError, match="translation does not come to its reference"):
        guarded.home()
    assert bench.world.drives["translation"].told == 0.0
    assert not bench.translation.read().homed
