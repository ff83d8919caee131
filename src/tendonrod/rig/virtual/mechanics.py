"""What robot and tendon do when the axes move: from pulled length, insertion and rotation to tension and tip pose.

Pulled length d = z - x_t - slack (docs/method, Tendons): the tendon is taut where d exceeds the shortening
Delta(eta, phi, tau) of its path in the bent robot, and then d = Delta + tau l / EA.

- `TableMechanics` solves this one equation on a `RobotTable`, in tens of microseconds. Without tendon friction it is
  the engine's answer to the table's error. With friction it is a reduced model: the robot feels one mean tension tau
  and sticks while that at the load cell lies between m tau / (exp(m) - 1) and m tau / (1 - exp(-m)), m = friction times
  turn of the tendon; at either bound the tendon slips. The engine's tendon lets go from the exit inwards instead: seen
  against it, 1 % of the tension while the tendon slips, 10 % (friction 0.2) just after it turns round.
- `EngineMechanics` solves the statics at every step, with the shape before as the history that friction holds on to.
"""

from __future__ import annotations

from math import exp, expm1, inf
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...errors import NotConverged
from ...loads import LumpedMass
from ..interfaces import DeviceError

if TYPE_CHECKING:
    from ...robot import Robot
    from ...statics.shape import Shape
    from .setup import VirtualSetup

RETRACTED = 1e-6  # insertion below which the robot counts as wholly inside


class Mechanics(Protocol):
    """Robot and tendon; tension (N) is that at the load cell."""

    tension: float

    def follow(self, insertion: float, rotation: float, pulled: float) -> float:
        """Move to a place (insertion 0 to 1, rad, m) that is near the one before; returns the tension there, N."""
        ...

    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """(3,) tube's axis at the tip (m), (3, 3) section frame there; world, T_world_exit at the origin."""
        ...


def mechanics_of(setup: VirtualSetup) -> Mechanics:
    """The mechanics that a setup asks for. Raises `InvalidInput` where the table cannot be had."""
    return TableMechanics(setup) if setup.mechanics == "table" else EngineMechanics(setup)


def driven_robot(setup: VirtualSetup) -> Robot:
    """The robot with the bench's tendon: stiffness, whole length, friction."""
    from dataclasses import replace

    robot = setup.robot
    free = setup.tendon_length - float(robot.tendon_lengths[0])
    changes = {"axial_stiffness": setup.tendon_stiffness, "free_length": free, "friction": setup.tendon_friction}
    return robot.replace(tendons=(replace(robot.tendons[0], **changes),))


class TableMechanics:
    """One equation for the tension, on a table."""

    def __init__(self, setup: VirtualSetup) -> None:
        from .table import robot_table

        mass, arm = (0.0, (0.0, 0.0, 0.0)) if setup.tracker is None else (setup.tracker.mass, setup.tracker.offset)
        self.table = robot_table(setup.robot, setup.gravity, setup.exit_tilt, mass, arm, setup.highest_tension)
        self.friction = setup.tendon_friction
        self.length, self.inside = setup.tendon_length, float(setup.robot.tendon_lengths[0])
        self.stiffness = setup.tendon_stiffness
        self.tension, self.felt = 0.0, 0.0
        self.place = 0.0, 0.0

    def follow(self, insertion: float, rotation: float, pulled: float) -> float:
        """See `Mechanics`."""
        self.place = insertion, rotation
        weights = self.table.weights(insertion, rotation)
        short = _Series((weights @ self.table.shortening).tolist(), self.table.highest)
        if self.friction == 0.0:
            self.felt = self.tension = _root(short, self.length / self.stiffness, None, pulled, self.felt)
        else:
            turn = _Series((weights @ self.table.turning).tolist(), self.table.highest)
            self._rub(short, turn, self.inside * insertion / self.stiffness, pulled)
        return self.tension

    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Mechanics`."""
        return self.table.pose(*self.place, self.felt)

    def _rub(self, short: _Series, turn: _Series, within: float, pulled: float) -> None:
        """Stick where the load cell's tension lies between both bounds of slip, else slip; ``within``: m/N."""
        outside = self.length / self.stiffness - within
        felt, angle = self.felt, self.friction * max(0.0, turn.value(self.felt)[0])
        tension = (pulled - short.value(felt)[0] - within * felt) / outside
        sign = 1.0 if tension > felt * _gain(angle)[0] else -1.0 if tension < felt * _gain(-angle)[0] else 0.0
        if sign:
            rub = _Rub(turn, sign * self.friction, outside)
            felt = _root(short, within, rub, pulled, felt)
            tension = felt * _gain(rub.angle(felt))[0]
        self.felt, self.tension = felt, max(0.0, tension)


class _Series:
    """A Chebyshev series in tension over [0, highest], carried on in a straight line beyond."""

    def __init__(self, c: list[float], highest: float) -> None:
        self.c, self.highest = c, highest

    def value(self, tension: float) -> tuple[float, float]:
        """The series and its slope, by Clenshaw's recurrence."""
        x = min(2.0 * tension / self.highest - 1.0, 1.0)
        b1 = b2 = d1 = d2 = 0.0
        for c in self.c[:0:-1]:
            b1, b2, d1, d2 = c + 2.0 * x * b1 - b2, b1, 2.0 * b1 + 2.0 * x * d1 - d2, d1
        value, slope = self.c[0] + x * b1 - b2, (b1 + x * d1 - d2) * 2.0 / self.highest
        return value + slope * max(0.0, tension - self.highest), slope


class _Rub:
    """Stretch of the tendon outside the robot, where the load cell's tension is more (or less) than what is felt."""

    def __init__(self, turn: _Series, friction: float, outside: float) -> None:
        self.turn, self.friction, self.outside = turn, friction, outside

    def angle(self, felt: float) -> float:
        """Friction times turn, signed: > 0 where the tendon slips in."""
        return self.friction * max(0.0, self.turn.value(felt)[0])

    def value(self, felt: float) -> tuple[float, float]:
        """Stretch (m) and its slope (m/N)."""
        angle, slope = self.turn.value(felt)
        gain, by = _gain(self.friction * max(0.0, angle))
        bend = by * self.friction * slope if angle > 0.0 else 0.0
        return self.outside * felt * gain, self.outside * (gain + felt * bend)


def _gain(m: float) -> tuple[float, float]:
    """Tension at the exit over its mean along a tendon that loses exp(-m), m / (1 - exp(-m)), and its slope in m."""
    if abs(m) < 1e-4:
        return 1.0 + 0.5 * m, 0.5 + m / 6.0
    below = -expm1(-m)
    return m / below, (below - m * exp(-m)) / below**2


def _root(short: _Series, stretch: float, rub: _Rub | None, pulled: float, guess: float) -> float:
    """Tension >= 0 (N) with shortening + stretch = pulled; Newton, held in a bracket, since the sum only rises."""
    low, high, tension = 0.0, inf, guess
    for _ in range(60):
        value, slope = short.value(tension)
        value, slope = value + stretch * tension - pulled, slope + stretch
        if rub is not None:
            more, steeper = rub.value(tension)
            value, slope = value + more, slope + steeper
        if value > 0.0:
            high = tension
            if tension == 0.0:
                return 0.0
        else:
            low = tension
        step = tension - value / slope if slope > 0.0 else inf
        after = step if low <= step <= high else 0.0 if step <= 0.0 else 0.5 * (low + high) if high < inf else low + 1.0
        if abs(after - tension) <= 1e-12:
            return after
        tension = after
    return tension


class EngineMechanics:
    """A static solve with the tendon pulled by length at every step: 0.1 ms plain, 5 ms with a mass or friction."""

    def __init__(self, setup: VirtualSetup) -> None:
        self.robot, self.given = driven_robot(setup), {"gravity": setup.gravity, "exit_tilt": setup.exit_tilt}
        if setup.tracker is not None and setup.tracker.mass > 0.0:
            self.given["loads"] = (LumpedMass(mass=setup.tracker.mass, offset=setup.tracker.offset),)
        self.tension = 0.0
        self._shape: Shape | None = None
        self._asked: tuple | None = None

    def follow(self, insertion: float, rotation: float, pulled: float) -> float:
        """See `Mechanics`. Raises `DeviceError` where the robot finds no equilibrium."""
        insertion = insertion if insertion > RETRACTED else 0.0
        if (insertion, rotation, pulled) == self._asked:
            return self.tension
        rubs = {"history": self._shape} if self.robot.friction.any() and self._shape is not None else {}
        try:
            shape = solve_at(self.robot, insertion, rotation, pulled, self._shape, **rubs, **self.given)
        except NotConverged as error:
            raise DeviceError(f"virtual robot: {error}") from None
        self._shape, self._asked = shape, (insertion, rotation, pulled)
        self.tension = float(shape.tensions[0])
        return self.tension

    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Mechanics`."""
        if self._shape is None:
            self.follow(0.0, 0.0, 0.0)
        assert self._shape is not None
        return self._shape.centerline[-1], self._shape.rotation[-1]


def solve_at(robot: Robot, insertion: float, rotation: float, pulled: float, start: Shape | None, **more) -> Shape:
    """The shape at its tip only; a tendon that breaks or hangs slack has a pulled length below 0."""
    from ...statics.equilibrium import solve

    tip = [insertion * robot.length_na]
    return solve(robot, insertion=insertion, rotation=rotation, displacements=pulled, start=start, s=tip, **more)


class OuterTube:
    """The robot's passage through the outer tube: elastic up to Coulomb friction, beyond which the exit slides.

    What the rollers do reaches the exit through the part of the robot inside, axial stiffness k_z = 2 EA / l and
    torsional k_phi = 2 GJ / l, l = (1 - insertion) L its length, over which the friction is spread. Friction has one
    bound for both directions, hypot(f_z, f_phi / r) <= friction, and slip goes along the force: a tube that slides
    forward turns almost freely, one that is only turned sticks and springs (associated plasticity, radial return).
    """

    SHORTEST = 1e-3  # m, of the part inside

    def __init__(self, robot: Robot, friction: float) -> None:
        table, radius = robot.section_values(np.zeros(1))[0], float(robot.outer_radius(np.zeros(1))[0])
        self.friction, self.length = friction, robot.length_na
        self.radius = radius if radius == radius else 1e-3  # a rod given by its area has no outline
        self.axial, self.torsional = 2.0 * float(table[2]), 2.0 * float(table[5]) / self.radius**2
        self.z = self.turn = 0.0  # elastic parts, m and m on the circumference

    def follow(self, moved: float, turned: float, insertion: float) -> tuple[float, float]:
        """By how much the exit lags behind the rollers (m, rad) after they moved by so much."""
        if self.friction == 0.0:
            return 0.0, 0.0
        inside = max(self.SHORTEST, (1.0 - insertion) * self.length)
        k_z, k_t = self.axial / inside, self.torsional / inside
        f_z, f_t = k_z * (self.z + moved), k_t * (self.turn + turned * self.radius)
        slip = self._slip(f_z, f_t, k_z, k_t)
        self.z, self.turn = f_z / (1.0 + slip * k_z) / k_z, f_t / (1.0 + slip * k_t) / k_t
        return self.z, self.turn / self.radius

    def _slip(self, f_z: float, f_t: float, k_z: float, k_t: float) -> float:
        """Slip per force (m/N) that brings the force back to the bound; 0 inside it."""
        slip = 0.0
        for _ in range(50):
            a, b = f_z / (1.0 + slip * k_z), f_t / (1.0 + slip * k_t)
            size = (a * a + b * b) ** 0.5
            if size <= self.friction * (1.0 + 1e-12):
                break
            slope = (a * a * k_z / (1.0 + slip * k_z) + b * b * k_t / (1.0 + slip * k_t)) / size**2
            slip += (size / self.friction - 1.0) / slope  # Newton on 1 / size, which is nearly straight
        return slip
