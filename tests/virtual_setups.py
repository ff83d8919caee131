"""Virtual benches that several test modules share, and how they are driven."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from tendonrod import load_robot
from tendonrod.rig.virtual.bench import VirtualBench
from tendonrod.rig.virtual.setup import (
    LoadCellModel,
    TrackerModel,
    VirtualSetup,
    lead_screw,
    roller_rotation,
    roller_translation,
)

DOWN = (-9.81, 0.0, 0.0)
QUIET_CELL = LoadCellModel(noise=0.0, drift=0.0, resolution=0.0)
QUIET_TRACKER = TrackerModel(position_noise=0.0, orientation_noise=0.0, burst_rate=0.0)
PERFECT = {"backlash": 0.0, "resolution": 0.0, "home_error": 0.0}


@cache
def robot(torsion: str = "homogenized"):
    return load_robot("exonav-1").replace(torsion=torsion)


def ideal(insertion: float = 1.0, **changes) -> VirtualSetup:
    """No friction, play or noise; the robot stands exposed with its tendon just taut if it were straight."""
    body = changes.get("robot", robot())
    z = insertion * body.section.L
    given = {
        "robot": body,
        "tendon_friction": 0.0,
        "outer_friction": 0.0,
        "screw": lead_screw(start=z, **PERFECT),
        "translation": roller_translation(start=z, **PERFECT),
        "rotation": roller_rotation(start=2.0 * 3.141592653589793 * (insertion - 1.0), **PERFECT),
        "load_cell": QUIET_CELL,
        "tracker": QUIET_TRACKER,
    }
    return VirtualSetup(**given | changes)


def usual(**changes) -> VirtualSetup:
    """Everything at its default, half way out."""
    z = 0.5 * robot().section.L
    given = {"robot": robot(), "gravity": DOWN, "screw": lead_screw(start=z)}
    return VirtualSetup(**given | {"translation": roller_translation(start=z)} | changes)


def drive(bench: VirtualBench, seconds: float, *, screw=0.0, translation=0.0, rotation=0.0, period=5e-3) -> None:
    """Command all axes every period."""
    end = bench.clock.now() + seconds
    while bench.clock.now() < end - 1e-9:
        for axis, speed in zip(bench.axes, (screw, translation, rotation), strict=True):
            axis.move(speed)
        bench.clock.wait_until(min(end, bench.clock.now() + period))


def pull_to(bench: VirtualBench, tension: float) -> None:
    """Take tendon up until the truth says ``tension``, then stand still."""
    while bench.world.tension < tension:
        drive(bench, 0.02, screw=-0.4e-3)
    bench.screw.stop()
    drive(bench, 0.02)


def with_faults(setup: VirtualSetup, *injections) -> VirtualSetup:
    return replace(setup, injections=injections)
