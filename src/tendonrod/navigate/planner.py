"""`approach`: outer tube, tension, rotation and insertion that bring the tip to a target with the body clear of walls.

At constant tension and without weight a robot of uniform strain follows its own tip, so the way in is as clear as the
place where it ends; what weight adds is looked at in `STAGES` of the way. The search is global, seeded, and for the
free robot: it asks for clearance instead of solving contact. A `Session` that runs the script has the last word.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, pi, radians
from types import MappingProxyType

import numpy as np

from ..errors import Fact, InvalidInput, one_of, whole
from ..robot import Robot
from ..statics.batch import solve_batch
from .commands import Jog, Rates
from .outer_tube import RANGES as PLACE
from .outer_tube import OuterTube
from .scenario import Scenario
from .script import Move

STAGES = np.array([0.25, 0.5, 0.7, 0.85, 1.0])  # of the insertion, at which the body is looked at
POINTS = 33  # along the exposed body
CLOSE = 0.4  # of a target's tolerance: nearer is not better
ROOM = 1e-4  # m of clearance that a plan keeps, and the scale on which a lack of it counts
ASIDE, DEEPER, SHALLOWER = 2e-3, 1.5e-3, 1.5e-3  # m around the middle of the dorsal gap, where the tube may end
LEAN, TILT = (radians(-10), radians(25)), (radians(-45), radians(45))
# A way round the cord lies in a small part of the ranges, so it is looked for there first, then everywhere.
RANGES = ({"lean": (radians(-4), radians(4)), "rotation": (radians(-45), radians(45))}, {})
GENERATIONS, PER_NUMBER = 120, 8  # of differential evolution, and candidates in each for every number
GRAIN = (5e-5, 5e-5, 5e-5, radians(0.1), radians(0.1), radians(0.1), 5e-3, 5e-5)  # m, rad, N; insertion in m
FAILED = 1e6
RATES = Rates()
Watch = Callable[[int, int], object]


@dataclass(frozen=True, kw_only=True)
class Approach:
    """The best way to ``target`` that was found, for the free robot.

    tube, tension (N, of every tendon), rotation (rad), insertion (share): where it ends. miss: m, from the tube's axis
    at the tip to the target. clearance: m, least of each structure on the way, negative where the free robot would have
    to enter it. reached: within the tolerance, and no clearance negative but of ``without``, the structure left out.
    """

    target: str
    tube: OuterTube
    tension: float
    rotation: float
    insertion: float
    miss: float
    clearance: MappingProxyType[str, float]
    reached: bool
    without: str = ""


def approach(scenario: Scenario, target: str, seed: int = 0, watch: Watch | None = None, without: str = "") -> Approach:
    """Search for the way to ``target`` (a name of the phantom's) within the scenario's limits of the drives.

    The scenario's outer tube is left aside: its exit lies near the middle of the dorsal gap at any height (`ASIDE`,
    `DEEPER`, `SHALLOWER`), and tilts and leans freely. watch(done, all) is called after each generation. without: a
    structure that counts as air. The same seed gives the same answer. Raises `InvalidInput`.
    """
    one_of("target", target, tuple(scenario.phantom.targets))
    return _Search(scenario, target, without).best(whole("seed", seed, 0), watch)


def moves_of(found: Approach, robot: Robot, rates: Rates = RATES) -> tuple[Move, ...]:
    """The script that goes there from a retracted, slack robot: tension and rotation first, then insertion.

    Raises `InvalidInput`.
    """
    tube = {name: getattr(found.tube, name) for name in PLACE}
    turning = copysign(rates.rotation, found.rotation)
    exposed = found.insertion * robot.section.L  # as drives count it
    rows = [Move(duration=found.tension / rates.tension, jog=Jog(tension=rates.tension), tube=tube)]
    if found.rotation:
        rows.append(Move(duration=found.rotation / turning, jog=Jog(rotation=turning)))
    return (*rows, Move(duration=exposed / rates.insertion, jog=Jog(insertion=rates.insertion)))


class _Search:
    """What candidates (m, 8) come to: below, offset, depth, tilt, lean, rotation, tension, insertion; SI."""

    def __init__(self, scenario: Scenario, target: str, without: str) -> None:
        if not scenario.robot.n_tendons:
            raise InvalidInput("robot", Fact("no tendon"), "a robot with a tendon, which bends it")
        self.scenario, self.name, self.without = scenario, target, without
        self.target = scenario.phantom.targets[target]

    def best(self, seed: int, watch: Watch | None) -> Approach:
        """The best of the searches in `RANGES`, in their order, until one reaches the target."""
        costs, found = [], []
        for ranges in RANGES:
            candidate, cost = self.run(list(self.bounds(**ranges).values()), seed, watch)
            costs, found = [*costs, cost], [*found, candidate]
            if cost <= 0.0:
                break
        return self.result(found[int(np.argmin(costs))])

    def run(self, bounds: list[tuple[float, float]], seed: int, watch: Watch | None) -> tuple[np.ndarray, float]:
        """The best candidate of one global search, and its cost."""
        from scipy.optimize import differential_evolution

        done = 0

        def told(intermediate_result) -> bool:
            nonlocal done
            done += 1
            if watch is not None:
                watch(done, GENERATIONS)
            return bool(intermediate_result.fun <= 0.0)

        found = differential_evolution(
            lambda columns: self.cost(columns.T), bounds, maxiter=GENERATIONS, popsize=PER_NUMBER, rng=seed,
            tol=0, atol=0, vectorized=True, updating="deferred", polish=False, callback=told,
        )  # fmt: skip
        return found.x, float(found.fun)

    def bounds(self, **narrower: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """Ranges of the eight numbers, by name."""
        limits, length = self.scenario.limits, self.scenario.robot.length_na
        depth = self.scenario.phantom.entry(self.target.level).depth
        turn = min(pi, limits.rotation)
        whole_ranges = {
            "below": (-5e-3, length), "offset": (-ASIDE, ASIDE), "depth": (depth - DEEPER, depth + SHALLOWER),
            "tilt": TILT, "lean": LEAN, "rotation": (-turn, turn), "tension": (0.05 * limits.tension, limits.tension),
            "insertion": (0.05 * limits.insertion, limits.insertion),
        }  # fmt: skip
        return whole_ranges | narrower

    def cost(self, candidates: np.ndarray) -> np.ndarray:
        """(m,) zero where the target is reached with room to spare."""
        miss, clearance = self.facts(candidates)
        lack = sum(np.maximum(0.0, ROOM - room) for name, room in clearance.items() if name != self.without)
        cost = np.maximum(0.0, miss / self.target.tolerance - CLOSE) + 2.0 * lack / ROOM
        return np.where(np.isfinite(cost) & self.has_room(candidates), cost, FAILED)

    def has_room(self, candidates: np.ndarray) -> np.ndarray:
        """(m,) whether the exit is clear of every wall, the structure left out included: a session begins there."""
        exits = np.array([self.tube(each).position for each in candidates])
        return self.scenario.surface.distance(exits)[0] - self.scenario.outer_radius >= ROOM

    def facts(self, candidates: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """(m,) how far the tip misses, NaN where no shape was found, and (m,) least clearance of each structure."""
        axes = self.axes(candidates)
        known = np.all(np.isfinite(axes), axis=(1, 2, 3))
        miss = np.where(known, np.linalg.norm(axes[:, -1, -1] - np.array(self.target.position), axis=1), np.nan)
        places = np.where(known[:, None, None, None], axes, 0.0).reshape(-1, 3)
        walls = self.scenario.phantom.clearance(places)
        rooms = {name: room.reshape(known.size, -1).min(axis=1) for name, room in walls.items()}
        return miss, {name: room - self.scenario.outer_radius for name, room in rooms.items()}

    def axes(self, candidates: np.ndarray) -> np.ndarray:
        """(m, stages, points, 3) axis of the tube in the world, at each stage of the insertion."""
        robot, poses = self.scenario.robot, np.array([self.tube(each).pose for each in candidates])
        gravity = np.einsum("mji,j->mi", poses[:, :3, :3], self.scenario.gravity)
        stages = len(STAGES)
        batch = solve_batch(
            robot, np.repeat(candidates[:, 6:7], stages, axis=0) * np.ones(robot.n_tendons),
            np.repeat(gravity, stages, axis=0), insertion=(candidates[:, 7:8] * STAGES).ravel(),
            rotation=np.repeat(candidates[:, 5], stages), points=POINTS, accuracy=2e-5, outputs=("centerline",),
        )  # fmt: skip
        there = batch.centerline.reshape(-1, stages, POINTS, 3)
        return np.einsum("mij,mskj->mski", poses[:, :3, :3], there) + poses[:, None, None, :3, 3]

    def tube(self, candidate: np.ndarray) -> OuterTube:
        """The outer tube of one candidate."""
        below, offset, depth, tilt, lean = candidate[:5].tolist()
        height = float(self.target.position[2]) - below
        return OuterTube(height=height, offset=offset, depth=depth, tilt=tilt, lean=lean)

    def rounded(self, candidate: np.ndarray) -> np.ndarray:
        """The candidate in numbers that people can set: `GRAIN`."""
        length, height = self.scenario.robot.section.L, float(self.target.position[2])
        grain = np.array([*GRAIN[:7], GRAIN[7] / length])
        near = np.array([height - candidate[0], *candidate[1:]])
        near = np.round(near / grain) * grain
        return np.array([height - near[0], *near[1:7], min(near[7], self.scenario.limits.insertion)])

    def result(self, candidate: np.ndarray) -> Approach:
        """One candidate in words."""
        candidate = self.rounded(candidate)
        miss, rooms = self.facts(candidate[None])
        clearance = {name: float(room[0]) for name, room in rooms.items()}
        clear = all(room >= 0.0 for name, room in clearance.items() if name != self.without)
        rotation, tension, insertion = candidate[5:].tolist()
        return Approach(
            target=self.name, tube=self.tube(candidate), tension=tension, rotation=rotation, insertion=insertion,
            miss=float(miss[0]), clearance=MappingProxyType(clearance),
            reached=clear and bool(miss[0] <= self.target.tolerance), without=self.without,
        )  # fmt: skip
