"""Faults injected into the virtual bench."""

import numpy as np
import pytest

from tendonrod import InvalidInput
from tendonrod.rig.interfaces import DeviceError
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.injection import Injection, InjectionKind
from virtual_setups import drive, ideal, pull_to, usual, with_faults


def test_injected_faults_of_the_load_cell():
    kinds = InjectionKind
    plan = [(kinds.CELL_NAN, 0.1), (kinds.CELL_STALE, 0.2), (kinds.CELL_SATURATED, 0.3), (kinds.CELL_JUMP, 0.4)]
    faults = [
        Injection(kind=kind, time=at, duration=0.05, **({"value": 3.0} if kind is kinds.CELL_JUMP else {}))
        for kind, at in plan
    ]
    bench, seen = virtual_bench(with_faults(usual(), *faults), 0), {}
    for k in range(100):
        bench.clock.wait_until(0.005 * (k + 1))
        seen[k + 1] = bench.load_cell.read()
    assert np.isnan(seen[25].tension)
    assert not np.isnan(seen[31].tension)
    assert seen[48].time == pytest.approx(0.2, abs=0.0051)
    assert seen[65].saturated
    assert seen[65].tension == 22.24
    assert seen[85].tension == pytest.approx(3.0, abs=0.2)
    assert abs(seen[95].tension) < 0.2


def test_injected_faults_of_axes_tracker_clock_and_commands():
    kinds = InjectionKind
    faults = (
        Injection(kind=kinds.STALL, time=0.2, duration=0.2, where="translation"),
        Injection(kind=kinds.RUNAWAY, time=0.4, duration=0.1, where="screw", value=-0.5e-3),
        Injection(kind=kinds.ENCODER_JUMP, time=0.7, where="rotation", value=0.5),
        Injection(kind=kinds.COMMAND_LOSS, time=0.8, duration=0.3),
        Injection(kind=kinds.DEVICE_ERROR, time=1.2, duration=0.1, where="load_cell"),
        Injection(kind=kinds.CLOCK_LATE, time=1.5, duration=0.1, value=0.02),
        Injection(kind=kinds.TRACKER_LOST, time=0.0),
    )
    bench = virtual_bench(with_faults(usual(), *faults), 0)
    drive(bench, 0.19, translation=1e-3)
    drive(bench, 0.11, translation=1e-3)
    assert bench.translation.read().velocity == 0.0
    drive(bench, 0.18)
    assert bench.screw.read().velocity == pytest.approx(-0.4e-3)  # 0.08 s at its 5 mm/s2
    drive(bench, 0.2)
    assert bench.screw.read().velocity == 0.0
    before = bench.rotation.read().position
    drive(bench, 0.03)
    assert bench.rotation.read().position - before == pytest.approx(0.5, abs=2e-3)
    drive(bench, 0.3, translation=1e-3)
    assert bench.translation.read().velocity == 0.0  # the command of 0.79 s has timed out
    drive(bench, 1.25 - bench.clock.now())
    with pytest.raises(DeviceError, match="load_cell"):
        bench.load_cell.read()
    drive(bench, 1.51 - bench.clock.now())
    start = bench.clock.now()
    bench.clock.wait_until(start + 0.005)
    assert bench.clock.now() - start == pytest.approx(0.025)
    assert bench.tracker is not None
    assert all(frame.is_lost for frame in bench.tracker.read())


def test_a_broken_tendon_leaves_robot_and_cell_without_tension():
    for mechanics in ("table", "engine"):
        setup = ideal(0.6, mechanics=mechanics)
        bench = virtual_bench(with_faults(setup, Injection(kind=InjectionKind.TENDON_BREAK, time=3.0)), 0)
        pull_to(bench, 0.3)
        assert bench.world.tip()[0][1] > 1e-3
        drive(bench, 3.1 - bench.clock.now(), period=0.02)
        assert bench.world.tension == 0.0
        assert bench.world.tip()[0][:2] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_injections_say_what_is_wrong_with_them():
    for field, given in (
        ("kind", {"kind": "meteor"}),
        ("where", {"kind": InjectionKind.STALL, "where": "tracker"}),
        ("value", {"kind": InjectionKind.RUNAWAY, "where": "screw"}),
        ("duration", {"kind": InjectionKind.CELL_NAN, "duration": 0.0}),
    ):
        with pytest.raises(InvalidInput, match=field):
            Injection(**{"time": 0.0} | given)
