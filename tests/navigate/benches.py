"""Virtual benches for the tests of sessions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from tendonrod.navigate.bench_aside import _pickled
from tendonrod.navigate.bench_process import Start
from tendonrod.navigate.scenario import Scenario
from tendonrod.rig.benches import BenchSource, VirtualSource
from tendonrod.rig.virtual.injection import Injection
from tendonrod.rig.virtual.setup import VirtualSetup


def virtual(scenario: Scenario, *injections: Injection, real_time: bool = False, **limits: Any) -> VirtualSource:
    """A bench of the scenario's robot with these faults; limits: as bench files have them, in SI."""
    setup = replace(VirtualSetup(robot=scenario.robot), injections=injections)
    return VirtualSource(setup=setup, real_time=real_time, limits=limits)


def start(scenario: Scenario, source: BenchSource, rate: float) -> bytes:
    """What the process of a bench reads first."""
    given: dict[str, Any] = {"robot": scenario.robot, "limits": scenario.limits, "coupled": True}
    return _pickled(Start(**given, source=source, seed=0, rate=rate))
