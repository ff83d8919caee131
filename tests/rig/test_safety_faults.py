"""Every fault is found within the time that its entry in DETECTION states, and has the reaction that it states."""

from dataclasses import replace
from math import inf, nan

import pytest

from rig.plain_bench import PERIOD, period, run, running
from tendonrod.rig import detection
from tendonrod.rig.detection import DETECTION
from tendonrod.rig.interfaces import STILL, Command, DeviceError
from tendonrod.rig.limits import Limits
from tendonrod.rig.states import FaultKind, Reaction, State

GOING = Command(screw=0.5e-3, translation=0.5e-3, rotation=0.04)  # tension stays, all axes move


def steep(insertion: float, tension: float) -> float:
    return 0.01 * tension  # 0.67 % at 0.67 N, the soft limit at 0.60 N


def set_on(device: str, **change):
    return lambda bench: getattr(bench, device).change.update(change)


def disobey(axis: str):
    return lambda bench: setattr(getattr(bench, axis), "obeys", False)


def lose_tracker(bench):
    bench.tracker.is_lost = True


def freeze(device: str):
    """Its readings keep the time they have now."""
    return lambda bench: getattr(bench, device).change.update(time=bench.clock.now())


def runaway(axis: str, speed: float):
    """The encoder shows motion that nobody commanded."""

    def begin(bench):
        device, start = getattr(bench, axis), bench.clock.now()
        device.obeys = False
        at = device.position
        read = device.read
        device.read = lambda: replace(read(), position=at + speed * (bench.clock.now() - start), velocity=speed)

    return begin


def jump(axis: str, by: float):
    return lambda bench: setattr(getattr(bench, axis), "position", getattr(bench, axis).position + by)


def fail(device: str):
    return lambda bench: setattr(getattr(bench, device), "error", DeviceError("does not answer"))


def crash(device: str):
    return lambda bench: setattr(getattr(bench, device), "error", ZeroDivisionError("a bug in\na driver"))


def slacken(bench):
    bench.load_cell.offset = -0.05  # the tendon breaks


def pull(bench):
    bench.load_cell.offset += 1.05 * 3.3e-3


CASES = {
    "tension": (pull, FaultKind.TENSION, ""),
    "break": (slacken, FaultKind.TENSION_RATE, ""),
    "strain": (set_on("load_cell", tension=0.7), FaultKind.STRAIN, ""),
    "beyond travel, high": (set_on("translation", position=0.0801), FaultKind.TRAVEL, "translation"),
    "beyond travel, low": (set_on("rotation", position=-10.0), FaultKind.TRAVEL, "rotation"),
    "too fast": (set_on("translation", velocity=7e-3), FaultKind.SPEED, "translation"),
    "infinitely fast": (set_on("rotation", velocity=-inf), FaultKind.SPEED, "rotation"),
    "stale cell": (freeze("load_cell"), FaultKind.STALE_SENSOR, "load cell"),
    "stale axis": (freeze("rotation"), FaultKind.STALE_SENSOR, "rotation"),
    "cell ahead of time": (set_on("load_cell", time=1e6), FaultKind.STALE_SENSOR, "load cell"),
    "NaN tension": (set_on("load_cell", tension=nan), FaultKind.NAN_SENSOR, "load cell"),
    "infinite tension": (set_on("load_cell", tension=-inf), FaultKind.NAN_SENSOR, "load cell"),
    "NaN position": (set_on("screw", position=nan), FaultKind.NAN_SENSOR, "screw"),
    "NaN velocity": (set_on("screw", velocity=nan), FaultKind.NAN_SENSOR, "screw"),
    "NaN time": (set_on("translation", time=nan), FaultKind.NAN_SENSOR, "translation"),
    "tracker": (lose_tracker, FaultKind.TRACKER_LOST, "tip"),
    "jump of the screw": (jump("screw", 0.6e-3), FaultKind.ENCODER_JUMP, "screw"),
    "jump of the rotation": (jump("rotation", -0.13), FaultKind.ENCODER_JUMP, "rotation"),
    "huge jump": (set_on("translation", position=-1e308), FaultKind.ENCODER_JUMP, "translation"),
    "saturated": (set_on("load_cell", saturated=True, tension=nan), FaultKind.SATURATION, "load cell"),
    "full scale": (set_on("load_cell", tension=-22.0), FaultKind.SATURATION, "load cell"),
    "stalled screw": (disobey("screw"), FaultKind.STALL, "screw"),
    "stalled translation": (disobey("translation"), FaultKind.STALL, "translation"),
    "stalled rotation": (disobey("rotation"), FaultKind.STALL, "rotation"),
    "stall told": (set_on("rotation", stalled=True), FaultKind.STALL, "rotation"),
    "runaway": (runaway("translation", 2e-3), FaultKind.STALL, "translation"),
    "runaway back": (runaway("screw", -1e-3), FaultKind.STALL, "screw"),
    "screw silent": (fail("screw"), FaultKind.DEVICE, "screw"),
    "cell silent": (fail("load_cell"), FaultKind.DEVICE, "load cell"),
    "tracker silent": (fail("tracker"), FaultKind.DEVICE, "tracker"),
    "driver crashed": (crash("rotation"), FaultKind.DEVICE, "rotation"),
}


@pytest.mark.parametrize("case", CASES)
def test_found_within_its_bound(case):
    begin, kind, where = CASES[case]
    bench, guarded = running(strain=steep)
    bench.load_cell.offset = 1.08e-3  # 0.33 N
    guarded.interlock._watch.restart()  # the step to 0.33 N is no part of this
    assert run(guarded, GOING, 0.6) >= 0.6, guarded.interlock.fault
    begin(bench)
    passed = run(guarded, GOING, 2.0)
    found = [fault for fault in guarded.interlock.faults if fault.kind is kind]
    assert found, guarded.interlock.faults
    assert found[0].where.startswith(where)
    assert found[0].reaction is DETECTION[kind].reaction
    assert passed <= DETECTION[kind].bound(guarded.interlock.limits) + 1e-9
    assert guarded.interlock.state is State.FAULT
    assert "\n" not in str(guarded.interlock.fault)


def test_tables_are_complete():
    assert set(DETECTION) == set(FaultKind)
    for kind, entry in DETECTION.items():
        row = next(line for line in detection.__doc__.splitlines() if line.startswith(f"{kind.name} "))
        assert row.split("[2]")[0].strip().endswith(entry.reaction.value.split()[0])
        assert (entry.after or "1 period") in row
        assert entry.bound(Limits()) >= PERIOD


def test_only_a_person_stops_for_good():
    assert {kind for kind, entry in DETECTION.items() if entry.reaction is Reaction.STOP} == {FaultKind.EMERGENCY}


def test_late_periods_in_a_row():
    _, guarded = running()
    late, limit = 1.6 * PERIOD, guarded.interlock.limits.late_in_row
    for _ in range(3):  # one in time between them begins the count again
        for _ in range(limit - 1):
            period(guarded, GOING, late)
        period(guarded, GOING)
    assert guarded.interlock.fault is None
    begun = guarded.clock.now()
    while guarded.interlock.fault is None:
        period(guarded, GOING, late)
    assert guarded.interlock.fault.kind is FaultKind.LATE
    assert guarded.clock.now() - begun <= DETECTION[FaultKind.LATE].bound(guarded.interlock.limits, late)


def test_command_that_stays_away():
    _, guarded = running()
    period(guarded, GOING)
    begun = guarded.clock.now()
    while guarded.interlock.fault is None:  # senses, but does not act
        guarded.clock.wait_until(guarded.clock.now() + PERIOD)
        guarded.sense()
    assert guarded.interlock.fault.kind is FaultKind.COMMAND_TIMEOUT
    bound = DETECTION[FaultKind.COMMAND_TIMEOUT].bound(guarded.interlock.limits)
    assert guarded.clock.now() - begun <= bound + 1e-9


def test_pause_of_the_whole_process():
    bench, guarded = running()
    period(guarded, GOING)
    for axis in bench.axes:
        axis.obeys = False  # as by their own time-out
    _, sent = period(guarded, GOING, dt=3.0)
    assert guarded.interlock.fault.kind is FaultKind.COMMAND_TIMEOUT
    assert sent == STILL


def test_command_on_an_old_sample():
    bench, guarded = running()
    bench.clock.wait_until(bench.clock.now() + 0.2)
    assert guarded.act(GOING) == STILL
    assert guarded.interlock.fault.kind is FaultKind.STALE_SENSOR


@pytest.mark.parametrize("bad", [nan, inf, -inf, None, "fast", 1e400, 10**400])
def test_command_that_is_no_number(bad):
    bench, guarded = running()
    _, sent = period(guarded, Command(translation=bad))
    assert sent == STILL
    assert guarded.interlock.fault.kind is FaultKind.CONTROLLER
    assert bench.translation.velocity == 0.0


def test_command_that_is_no_command():
    _, guarded = running()
    assert period(guarded, None)[1] == STILL
    assert guarded.interlock.fault.kind is FaultKind.CONTROLLER


@pytest.mark.parametrize("kind", [FaultKind.RECORD, FaultKind.CONTROLLER])
def test_told_from_outside(kind):
    bench, guarded = running()
    period(guarded, GOING)
    guarded.interlock.trip(kind, where="disk full")
    assert guarded.act(GOING) == STILL
    assert [axis.velocity for axis in bench.axes] == [0.0] * 3
    assert str(guarded.interlock.fault) == f"{kind.value} (disk full); hold"


def test_strain_model_that_fails_counts_as_strain():
    def broken(insertion, tension):
        raise ValueError

    _, guarded = running(strain=broken)
    assert guarded.interlock.fault.kind is FaultKind.STRAIN


def test_noise_and_short_gaps_are_no_fault():
    """A cell's noise of 11 mN, the tracker lost for less than its time, positions in counts: nothing to react to."""
    import numpy as np

    rng = np.random.default_rng(7)
    bench, guarded = running()
    bench.load_cell.offset = 2.3e-3
    guarded.interlock._watch.restart()
    read = bench.load_cell.read
    bench.load_cell.read = lambda: replace(reading := read(), tension=reading.tension + 0.011 * rng.standard_normal())
    axis = bench.translation.read
    bench.translation.read = lambda: replace(state := axis(), position=round(state.position / 5e-6) * 5e-6)
    for k in range(2000):
        bench.tracker.is_lost = k % 100 < 90
        v = 0.5e-3 + 0.5e-3 * rng.standard_normal()
        period(guarded, Command(screw=0.5e-3, translation=v, rotation=0.04))
        assert guarded.interlock.fault is None, guarded.interlock.fault
