"""Where the robot touches, with what force and pressure, and on which structure.

A rod that touches a curved wall presses on it at points too, where a line force per metre would depend on the grid of
the solution. So the pressure here is an average over one diameter of the tube: the forces within a diameter of a place,
weighted by a hat of that half width, over the hat's area within the body times the diameter. Under a uniform line force
p that is p / diameter; under a point force F it is F / diameter^2, and twice that at the tip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..statics.contact import Contacts
from ..statics.shape import Shape
from .scenario import Scenario

SOFT = frozenset({"cord", "dura", "root", "ganglion"})  # roles of structures that a pressure limit is for


@dataclass(frozen=True, kw_only=True, eq=False)
class Touch:
    """Contacts of a shape: point (k, 3) m, force (k, 3) N on the robot, pressure (k,) Pa, structure (k,) names.

    along (n,) Pa at the shape's arc lengths; is_soft (k,): whether the structure is soft tissue.
    """

    point: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    structure: tuple[str, ...]
    is_soft: np.ndarray
    along: np.ndarray


def touch_of(scenario: Scenario, shape: Shape) -> Touch:
    """The contacts of a shape that was sampled along the whole body."""
    found = shape.contacts
    if found is None or found.s.size == 0:
        none = np.zeros((0, 3))
        return Touch(
            point=none, force=none, pressure=np.zeros(0), structure=(), is_soft=np.zeros(0, dtype=bool),
            along=np.zeros(shape.s.size),
        )  # fmt: skip
    names = _touched(scenario, found)
    roles = [scenario.phantom.structures[name].role for name in names]
    return Touch(
        point=found.point, force=found.force[:, None] * found.normal, structure=names,
        is_soft=np.array([role in SOFT for role in roles]),
        pressure=patch_pressure(found.s, found, shape), along=patch_pressure(shape.s, found, shape),
    )  # fmt: skip


def patch_pressure(s: np.ndarray, contacts: Contacts, shape: Shape) -> np.ndarray:
    """(k,) contact pressure averaged over one diameter at arc lengths ``s`` (k,) m, Pa; see the module."""
    width = 2.0 * shape.robot.outer_radius(s + shape.material_coordinate[0] - shape.s[0])
    hat = np.maximum(0.0, 1.0 - np.abs(s[:, None] - contacts.s) / width[:, None])
    cut = sum(np.maximum(0.0, 1.0 - end / width) ** 2 for end in (s, shape.length - s))  # of the hat beyond either end
    return hat @ contacts.force / (width**2 * (1.0 - 0.5 * cut))


def _touched(scenario: Scenario, contacts: Contacts) -> tuple[str, ...]:
    """Name of the wall nearest to each point of contact."""
    clearance = {
        name: distance
        for name, distance in scenario.phantom.clearance(contacts.point).items()
        if scenario.phantom.structures[name].is_wall
    }
    names = tuple(clearance)
    nearest = np.abs(np.array([clearance[name] for name in names])).argmin(axis=0)
    return tuple(names[k] for k in nearest)
