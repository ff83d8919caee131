"""Follow-the-leader trials of a few seconds of bench time, which tests of trials and of the command line share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from tendonrod import Robot, load_robot
from tendonrod.rig.profiles import Profile, profile
from tendonrod.rig.trials import Followed, follow_leader
from tendonrod.rig.virtual.injection import Injection
from tendonrod.rig.virtual.setup import VirtualSetup, lead_screw

DOWN = (-9.81, 0.0, 0.0)
TARGET = 0.7  # N
SHORT: dict[str, Any] = {"end": 0.1, "screw_rate": 2e-3}
FAST_FILE = """[bench]
kind = "virtual"
gravity_m_s2 = [-9.81, 0, 0]
[screw]
speed_mm_s = 3
acceleration_mm_s2 = 30
"""


@cache
def robot() -> Robot:
    return load_robot("exonav-1").replace(torsion="homogenized")


@cache
def plan() -> Profile:
    return profile("plan", robot(), TARGET, DOWN, steps=8)


def setup(*injections: Injection, **changes: Any) -> VirtualSetup:
    """With a fast screw, as `FAST_FILE`."""
    made = VirtualSetup(robot=robot(), gravity=DOWN, screw=lead_screw(speed=3e-3, acceleration=30e-3))
    return replace(made, injections=injections, **changes)


def short(path: Path, *injections: Injection, seed: int = 1, **options: Any) -> Followed:
    """One trial to a tenth of the way."""
    return follow_leader(setup(*injections), plan(), TARGET, path, seed=seed, **SHORT | options)


def bench_file(folder: Path, more: str = "") -> Path:
    """`FAST_FILE` and what is added, on file."""
    path = folder / "bench.toml"
    path.write_text(FAST_FILE + more, encoding="utf-8")
    return path
