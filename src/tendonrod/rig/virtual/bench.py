"""`virtual_bench`: a `Bench` whose devices look at one `World`."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from ...errors import InvalidInput, whole
from ..interfaces import Bench
from .axes import VirtualAxis
from .clock import VirtualClock
from .injection import AXES
from .sensors import VirtualLoadCell, VirtualTracker
from .setup import VirtualSetup
from .world import World


@dataclass(frozen=True, kw_only=True)
class VirtualBench(Bench):
    """A `Bench` that also shows its truth, for tests and campaigns; no controller is to look there."""

    world: World


def virtual_bench(setup: VirtualSetup, seed: int, real_time: bool = False, ahead: float = inf) -> VirtualBench:
    """Open a virtual bench: faster than real time, or in step with it.

    The same setup and seed give the same bench, bit for bit, as long as the same is asked of it at the same times; in
    real time the machine's own clock comes in. Each device draws from a stream of its own. ahead: see `VirtualClock`.
    Raises `InvalidInput`.
    """
    if not isinstance(setup, VirtualSetup):
        raise InvalidInput("setup", setup, "a VirtualSetup")
    streams = [np.random.default_rng(each) for each in np.random.SeedSequence(whole("seed", seed, 0)).spawn(5)]
    world = World(setup)
    if setup.tracker is not None:
        world.tracker = VirtualTracker(setup.tracker, world, streams[4])
    clock = VirtualClock(world, real_time, ahead)
    axes = {name: VirtualAxis(name, world, clock, rng) for name, rng in zip(AXES, streams, strict=False)}
    cell = VirtualLoadCell(setup.load_cell, world, streams[3])
    name = f"virtual bench with {setup.robot.name}, torsion {setup.robot.torsion}"
    return VirtualBench(name=name, **axes, load_cell=cell, tracker=world.tracker, clock=clock, world=world)
