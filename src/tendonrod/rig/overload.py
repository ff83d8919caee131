"""`overloaded`: the refusal of a load under which a robot leaves linear elasticity by itself, and what it bears."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import Fact, InvalidInput
from ..loads import Load, LumpedMass
from ..robot import Robot
from ..statics.equilibrium import solve
from ..statics.limits import PLATEAU_STRAIN, fibre_strain

if TYPE_CHECKING:
    from .model_limits import StrainTable

SCALED = ("mass", "force", "moment", "force_end", "moment_end")  # fields of loads


class Hanging(NamedTuple):
    """A robot with gravity (3,) m/s2 and loads, as in `tendonrod.solve`."""

    robot: Robot
    gravity: tuple[float, ...]
    loads: tuple[Load, ...]

    @property
    def mass(self) -> float:
        """Of all that hangs on the robot, kg."""
        return sum(each.mass for each in self.loads if isinstance(each, LumpedMass))

    @property
    def load(self) -> str:
        """The load in words."""
        others = sum(not isinstance(each, LumpedMass) for each in self.loads)
        parts = [f"{1e3 * self.mass:g} g"] if self.mass else []
        parts += [f"{others} other load{'s' if others > 1 else ''}"] if others else []
        return ", ".join([*parts, f"gravity ({', '.join(f'{x:g}' for x in self.gravity)}) m/s2"])

    def bears(self, tension: float, insertions: Sequence[float]) -> bool:
        """Whether linear elasticity holds with a slack tendon and at ``tension`` (N), at all these insertions."""
        robot, gravity, loads = self
        each = ((tau, eta) for eta in insertions for tau in (0.0, tension))  # tension may lift what gravity bends
        found = (solve(robot, tau, gravity, insertion=eta, loads=loads) for tau, eta in each)
        return all(fibre_strain(shape).max() < PLATEAU_STRAIN for shape in found)


def overloaded(table: StrainTable, tension: float) -> InvalidInput:
    """The error that says which load leaves no room for ``tension`` (N), by how much, and what would be borne."""
    worst = int(table.strain[:, 0].argmax())
    robot, eta, strain = table.hanging.robot, table.insertions[worst], table.strain[worst, 0]
    allowed = (
        f"less: {robot.name}, torsion {robot.torsion}, leaves linear elasticity with its tendon slack, or nearly so "
        f"(strain {100 * strain:.3g} % at insertion {eta:.2g}, allowed {100 * PLATEAU_STRAIN:.3g} %); "
        f"it bears {_borne(table.hanging, tension, table.insertions.tolist())}"
    )
    return InvalidInput("load", Fact(table.hanging.load), allowed)


def _borne(hanging: Hanging, tension: float, insertions: list[float]) -> str:
    """What of the load would be borne, in words: of what hangs on the robot, and of the gravity."""
    loads = _largest(lambda k: _with_loads(hanging, k).bears(tension, insertions)) if hanging.loads else 0.0
    pull = _largest(lambda k: _with_gravity(hanging, k).bears(tension, insertions)) if any(hanging.gravity) else 0.0
    only_masses = all(isinstance(each, LumpedMass) for each in hanging.loads)
    words = [f"{1e3 * loads * hanging.mass:.3g} g" if only_masses else f"{loads:.3g} of the loads"] if loads else []
    words += [f"{'all of it with ' if hanging.loads else ''}{pull:.3g} of this gravity"] if pull else []
    return ", or ".join(words) or "nothing like it"


def _largest(is_borne: Callable[[float], bool]) -> float:
    """The largest share from 0 to 1 that is borne, up to 3 % too small; 0 where not even a thousandth is."""
    low, high = 0.0, 1.0
    while high - low > 0.01 * high and high > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_borne(middle) else (low, middle)
    return 0.98 * low  # what is shown is rounded, and the limits come from a table


def _with_loads(hanging: Hanging, share: float) -> Hanging:
    return hanging._replace(loads=tuple(_scaled(each, share) for each in hanging.loads))


def _with_gravity(hanging: Hanging, share: float) -> Hanging:
    return hanging._replace(gravity=tuple(share * x for x in hanging.gravity))


def _scaled(load: Load, share: float) -> Load:
    changes: dict[str, Any] = {}
    for name in SCALED:
        value = getattr(load, name, None)
        if value is not None:
            changes[name] = share * value if isinstance(value, float) else [share * float(x) for x in value]
    return replace(load, **changes)
