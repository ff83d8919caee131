"""Limits that come from the model of the robot: its strain, and its length. `rig.safety` itself knows no rods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InvalidInput, positive, whole, within
from ..loads import Load
from ..robot import Robot, as_robot
from ..statics.equilibrium import solve
from ..statics.limits import PLATEAU_STRAIN, fibre_strain
from .interfaces import AxisLimits
from .limits import Limits
from .overload import Hanging, overloaded

SMALLEST = 0.02  # exposed share, below which the strain of this share is taken: there is next to nothing to bend
SHARE = 0.9  # of the tension that reaches the strain limit, for a bench's own limit
CLEARANCE = 1e-3  # m, that the translation may go beyond the robot's length


class StrainTable:
    """Largest strain anywhere on the exposed robot, over insertion and tension, from the statics engine.

    `__call__(insertion, tension)` -> strain, bilinear in a table, held at the table's ends in insertion and carried on
    with the last slope in tension; rotation 0, the follow-the-leader law. insertions (n,), tensions (m,) N, strain
    (n, m): read-only. hanging: robot and load that it is of.
    """

    __slots__ = ("_d_eta", "_d_tau", "_eta", "_rows", "hanging", "insertions", "strain", "tensions")

    def __init__(self, insertions: np.ndarray, tensions: np.ndarray, strain: np.ndarray, hanging: Hanging) -> None:
        self.insertions, self.tensions, self.strain, self.hanging = insertions, tensions, strain, hanging
        for array in (insertions, tensions, strain):
            array.setflags(write=False)
        self._rows, self._eta = strain.tolist(), float(insertions[0])  # plain floats: a look-up costs a microsecond
        self._d_eta, self._d_tau = float(insertions[1] - insertions[0]), float(tensions[1])

    def __call__(self, insertion: float, tension: float) -> float:
        """Strain at exposed share ``insertion`` and ``tension`` (N)."""
        rows = self._rows
        x = min(max((insertion - self._eta) / self._d_eta, 0.0), len(rows) - 1.0)
        y = max(tension / self._d_tau, 0.0)
        i, j = min(int(x), len(rows) - 2), int(min(y, len(rows[0]) - 2.0))
        a, b = x - i, y - j
        low, high = rows[i], rows[i + 1]
        return (1.0 - a) * ((1.0 - b) * low[j] + b * low[j + 1]) + a * ((1.0 - b) * high[j] + b * high[j + 1])

    def limit(self, insertion: float, strain: float = PLATEAU_STRAIN) -> float:
        """Tension (N) at which ``strain`` is reached at ``insertion``; inf where no tension of the table reaches it."""
        reached = [self(insertion, tension) for tension in self.tensions.tolist()]
        if max(reached) < strain:
            return float("inf")
        k = next(k for k, each in enumerate(reached) if each >= strain)
        if k == 0:
            return 0.0
        low, high = reached[k - 1], reached[k]
        return float(self.tensions[k - 1] + (strain - low) / (high - low) * self._d_tau)


def strain_limit(
    robot: Robot, gravity=(0.0, 0.0, 0.0), loads: Sequence[Load] = (), tension: float | None = None,
    insertions: int = 9, tensions: int = 17,
) -> StrainTable:  # fmt: skip
    """The strain of ``robot`` with one tendon, solved on a grid of insertion and tension.

    - gravity (3,) m/s2, loads: as in `tendonrod.solve`, such as the tracker's mass.
    - tension: N, the highest of the table; None for twice the tension that reaches the plateau without load.
    - insertions, tensions: numbers of grid points.

    The strain is near linear in tension, so that few points serve. With the defaults and half a gram at the tip it is
    within 0.6 % of the plateau's strain where it is above 70 % of that, and never more than 0.2 % of it too low; at
    small tensions it is up to 5 % too high, which is the safe side. Raises `InvalidInput` also where the
    outline of the section, and so its strain, is not known; `NotConverged`.
    """
    if as_robot(robot).n_tendons != 1:
        raise InvalidInput("robot", f"{robot.name} with {robot.n_tendons} tendons", "a robot with exactly one tendon")
    top = 2.0 * _plateau_tension(robot) if tension is None else positive("tension", tension)
    eta = np.linspace(SMALLEST, 1.0, whole("insertions", insertions, 2, 1000))
    tau = np.linspace(0.0, top, whole("tensions", tensions, 2, 1000))
    strain = np.empty((eta.size, tau.size))
    for i in range(eta.size):
        shape = None
        for j in range(tau.size):
            shape = solve(robot, tau[j], gravity, insertion=eta[i], loads=loads, start=shape)
            strain[i, j] = _strain(robot, shape)
    return StrainTable(eta, tau, strain, Hanging(robot, tuple(gravity), tuple(loads)))


def bench_limits(robot: Robot, table: StrainTable, target: float | None = None, **changes) -> Limits:
    """`Limits` for ``robot``: tension, strain, length and travel from the model, the rest as by default.

    - table: `strain_limit` of the robot as it hangs in the bench. The tension limit is 0.9 of the smallest tension that
      reaches the plateau's strain at any insertion.
    - target: N, that shall be reached; refused above the soft limits of tension and strain that come out.
    - changes: fields of `Limits` that are set otherwise.

    Raises `InvalidInput`, for "load" where the load alone leaves no room for tension.
    """
    length = robot.section.L  # what the translation moves from insertion 0 to 1
    lowest = min(table.limit(float(eta)) for eta in table.insertions)
    tension = SHARE * min(lowest, float(table.tensions[-1]))
    default = Limits()
    if (least := default.slack / (SHARE * default.soft)) >= lowest and "tension" not in changes:
        raise overloaded(table, least)
    chosen = {
        "tension": tension, "strain": PLATEAU_STRAIN, "length": length,
        "translation": AxisLimits(low=0.0, high=length + CLEARANCE, speed=default.translation.speed),
        "screw": AxisLimits(low=default.screw.low, high=length + 25e-3, speed=default.screw.speed),
    }  # fmt: skip
    limits = Limits(**chosen | changes)  # pyright: ignore[reportArgumentType]
    if target is not None:
        within("target", target, 0.0, limits.soft * limits.tension)
        within(
            "target", target, 0.0, min(table.limit(float(eta), limits.soft * limits.strain) for eta in table.insertions)
        )
    return limits


def _plateau_tension(robot: Robot) -> float:
    """Tension (N) that reaches the plateau without load, from the strain's first slope: it is near linear."""
    small = 1e-3 * float(robot.section.Kse[2]) * PLATEAU_STRAIN
    strain = _strain(robot, solve(robot, small))
    return small * PLATEAU_STRAIN / strain


def _strain(robot: Robot, shape) -> float:
    strain = float(fibre_strain(shape).max())
    if strain != strain:
        raise InvalidInput("robot", robot.name, "a robot whose cross section has a known outline, for its strain")
    return max(strain, 0.0)
