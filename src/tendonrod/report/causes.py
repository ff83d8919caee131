"""What a tilted base, a tracker's mass and other moduli make of the distance between the paper's two model runs.

The run with gravity is solved with the cause, the run without gravity without it. Positions are analytic in tension,
tilt, mass and modulus, so few solves at Chebyshev nodes give them everywhere, to less than a micrometre (tests).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from ..loads import LumpedMass
from ..robot import Robot
from ..rotation import exp_so3
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from . import paper
from .gravity import TENSIONS, bounds, places
from .results import Gap

LARGEST_TILT = np.radians(20.0)  # rad, either way
MODULI = (0.5, 1.5)  # share of the printed modulus
_NODES = {"exonav-1": (7, 5, 7)}  # along tension, tilt, mass; the softest needs more
_USUAL_NODES = (5, 5, 6)
_MODULUS_NODES = 11
_STEPS = 16  # of the integrator, under a mass: 0.3 µm, in half the time of an estimated accuracy
_SLENDER = {"exonav-1": 0.6e-3, "exonav-2": 1.0e-3}  # kg; more moves their tips beyond all bounds
_G = np.array(paper.GRAVITY)

Range = tuple[float, float, int]
Starts = dict[tuple[float, float], Shape]


@dataclass(frozen=True, kw_only=True)
class Case:
    """How the runs are solved.

    torsion: model. modulus: share of the printed Young's and shear moduli. in_both: whether both runs have it, or only
    that with gravity. at_tip: whether the mass sits at the tip, or, as the paper's tracker, at the place measured.
    """

    torsion: str = "published"
    modulus: float = 1.0
    in_both: bool = True
    at_tip: bool = False

    def heavy(self, robot: Robot) -> Robot:
        """The robot of the run with gravity."""
        return scaled(robot.replace(torsion=self.torsion), self.modulus)

    def still(self, robot: Robot) -> Robot:
        """The robot of the run without gravity."""
        return self.heavy(robot) if self.in_both else robot.replace(torsion=self.torsion)


def bracket(name: str) -> np.ndarray:
    """(2, 4) least and most distance between the two model runs by Table I, root mean square over the tensions, m.

    RMSE is the distance from the same measurements in that norm: |a - b| <= distance of the runs <= a + b.
    """
    both = 1e-3 * np.array([table[name] for table in (paper.RMSE_WITH_GRAVITY_MM, paper.RMSE_WITHOUT_GRAVITY_MM)])
    return np.array([bounds(name), both.sum(axis=0)])


def largest_mass(robot: Robot) -> float:
    """Upper end of the masses looked at, kg."""
    return _SLENDER.get(robot.name, 2e-3)


def scaled(robot: Robot, modulus: float) -> Robot:
    """``robot`` with both moduli times ``modulus``, Poisson's ratio kept."""
    given = {name: getattr(robot.body, name) for name in ("youngs_modulus", "shear_modulus")}
    return robot.replace(**{name: modulus * value for name, value in given.items()})


def leaning(tilt: float, sideways: float = 0.0) -> np.ndarray:
    """(3, 3) R_world_exit of a base that leans by ``tilt`` towards gravity, -x, and by ``sideways`` towards y, rad."""
    return exp_so3(np.array([-sideways, -tilt, 0.0]))


def gap(robot: Robot, tension: float, case: Case, tilt=0.0, sideways=0.0, mass=0.0) -> np.ndarray:
    """(4,) distances (m) between the two runs at one tension (N): tilts in rad, mass in kg; by direct solves."""
    heavy = _heavy(case.heavy(robot), tension, tilt, sideways, mass, at_tip=case.at_tip)
    return np.linalg.norm(heavy @ leaning(tilt, sideways).T - _still(case.still(robot), tension), axis=1)


def _still(robot: Robot, tension: float) -> np.ndarray:
    return solve(robot, tension, s=places(robot)).position


def _heavy(
    robot: Robot, tension: float, tilt=0.0, sideways=0.0, mass=0.0, at_tip: bool = False, starts: Starts | None = None
) -> np.ndarray:
    """(4, 3) positions in the frame of the exit, where not the base but gravity is turned.

    starts: shapes by place and mass, of a neighbouring tilt, to start from; replaced by those found.
    """
    s, gravity = places(robot), tuple(leaning(tilt, sideways).T @ _G)
    if mass == 0.0:
        return solve(robot, tension, gravity, s=s).position
    starts, found = {} if starts is None else starts, []
    for at in s[-1:] if at_tip else s:
        load, report = LumpedMass(mass=mass, at=at), s if at_tip else [at]
        start = starts.get((at, mass))
        shape = solve(robot, tension, gravity, s=report, loads=(load,), steps=_STEPS, start=start)
        starts[at, mass] = shape
        found.append(shape.position)
    return np.concatenate(found)


class Polynomial:
    """Chebyshev interpolation of an array-valued function of a few numbers, on the tensor grid of ``ranges``."""

    def __init__(self, ranges: Sequence[Range], function: Callable[..., np.ndarray]) -> None:
        self.ranges = tuple(ranges)
        unit = [-np.cos(np.pi * (np.arange(n) + 0.5) / n) for _, _, n in ranges]
        nodes = [low + 0.5 * (high - low) * (x + 1.0) for x, (low, high, _) in zip(unit, ranges, strict=True)]
        values = np.array([function(*map(float, point)) for point in product(*nodes)])
        values = values.reshape(*(x.size for x in nodes), *values.shape[1:])
        self.coefficients = _along(values, [np.linalg.inv(chebvander(x, x.size - 1)) for x in unit])

    def __call__(self, *points: np.ndarray) -> np.ndarray:
        """Values on the tensor grid of ``points``, one (n,) array per number."""
        pairs = zip(points, self.ranges, strict=True)
        return _along(
            self.coefficients, [chebvander(2.0 * (x - low) / (high - low) - 1.0, n - 1) for x, (low, high, n) in pairs]
        )


def _along(values: np.ndarray, matrices: Sequence[np.ndarray]) -> np.ndarray:
    """Apply one matrix to each of the leading axes."""
    for k, matrix in enumerate(matrices):
        values = np.moveaxis(np.tensordot(matrix, values, (1, k)), 0, k)
    return values


class Gaps:
    """Distances between the two runs of one case over tilt and a second quantity, mass or sideways tilt."""

    def __init__(self, robot: Robot, case: Case, second: str) -> None:
        heavy, still = case.heavy(robot), case.still(robot)
        self.second, self.end = second, LARGEST_TILT if second == "sideways" else largest_mass(robot)
        self.still = np.array([_still(still, tension) for tension in TENSIONS])
        how: Any = {"at_tip": case.at_tip, "starts": {}}
        nodes = _NODES.get(robot.name, _USUAL_NODES)
        low = (0.0, -LARGEST_TILT, -self.end if second == "sideways" else 0.0)
        self.heavy = Polynomial(
            list(zip(low, (paper.LARGEST_TENSION, LARGEST_TILT, self.end), nodes, strict=True)),
            lambda tension, tilt, value: _heavy(heavy, tension, tilt, **{second: value}, **how),
        )

    def __call__(self, tilts: np.ndarray, values: np.ndarray) -> Gap:
        """On the grid of ``tilts`` (n,) rad and ``values`` (m,) kg or rad; TENSIONS count alike."""
        sideways = values if self.second == "sideways" else np.zeros(1)
        turns = np.array([[leaning(tilt, side) for side in sideways] for tilt in tilts])
        heavy = self.heavy(TENSIONS, tilts, values)
        world = (turns @ np.swapaxes(heavy, -1, -2)).swapaxes(-1, -2)
        return _gap(np.linalg.norm(world - self.still[:, None, None], axis=-1))


def modulus_gap(robot: Robot, moduli: np.ndarray, in_both: bool) -> Gap:
    """Over ``moduli`` (n,), shares of the printed ones, with neither tilt nor mass."""
    over = ((0.0, paper.LARGEST_TENSION, max(_NODES.get(robot.name, _USUAL_NODES))), (*MODULI, _MODULUS_NODES))
    heavy = Polynomial(over, lambda tension, share: _heavy(scaled(robot, share), tension))
    still = Polynomial(over, lambda tension, share: _still(scaled(robot, share), tension))
    return _gap(np.linalg.norm(heavy(TENSIONS, moduli) - still(TENSIONS, moduli if in_both else np.ones(1)), axis=-1))


def _gap(distances: np.ndarray) -> Gap:
    """From (tensions, ..., 4) distances."""
    return Gap(rms=np.sqrt(np.mean(distances**2, axis=0)), least=distances.min(axis=0), most=distances.max(axis=0))
