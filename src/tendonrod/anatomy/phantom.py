"""The phantom: structures, targets, levels, and the questions a robot has for them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from ..errors import Fact, InvalidInput, one_of, positive
from ..surface import DistanceGrid, Surface, Walls
from .levels import Level

ROLES = ("cord", "dura", "canal", "bone", "disc", "root", "ganglion", "ligament")
KINDS = ("printed", "anatomical", "meshes")
PRESSURE_LIMIT = 4.8e3  # Pa, on the cord or dura; engineering choice: that of CSF on the dura
FAR = 10e-3  # m beyond the box around all structures, from which a target looks misplaced
INDENTATION_LIMIT = 1e-3  # m; engineering choice: pig cord showed changes at 3.2 +- 0.9 mm


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """One body of the phantom: a closed mesh, vertices (n, 3) m and faces (m, 3), world frame.

    surface: signed distance to it, positive where the robot may be; None where nothing asks for it.
    is_wall: whether the robot may not enter.
    """

    name: str
    role: str
    vertices: np.ndarray
    faces: np.ndarray
    surface: Surface | None = None
    is_wall: bool = False

    def __post_init__(self) -> None:
        one_of("role", self.role, ROLES)
        if self.is_wall and self.surface is None:
            raise InvalidInput("surface", None, "given for a wall")
        for name, kind in (("vertices", float), ("faces", np.int64)):
            array = np.array(getattr(self, name), dtype=kind)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        return f"Structure({self.name!r}, {self.role}, {len(self.faces)} triangles)"

    @property
    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (n, 3) m and faces (m, 3), counter-clockwise seen from outside."""
        return self.vertices, self.faces


@dataclass(frozen=True, kw_only=True)
class Target:
    """Where the middle of the robot's tip shall be: within ``tolerance`` (m) of ``position`` (3,) m, world frame.

    side: "left", "right" or "middle".
    """

    name: str
    level: str
    position: tuple[float, float, float]
    tolerance: float
    side: str
    description: str

    def __post_init__(self) -> None:
        positive("tolerance", self.tolerance)
        one_of("side", self.side, ("left", "right", "middle"))
        object.__setattr__(self, "position", tuple(float(each) for each in self.position))

    def distance(self, tip) -> float:
        """From ``tip`` (3,) m to the target's middle, m."""
        return float(np.linalg.norm(np.asarray(tip, dtype=float) - self.position))


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Where an outer tube may end that comes through the interlaminar window below a level's lamina.

    height: z of the window's middle, m. depth: x of the middle of the dorsal epidural space there (without dura: of the
    space dorsal of the cord), m. offset: y of the midline. window: half height and half width of the window, m.
    """

    level: str
    height: float
    depth: float
    offset: float
    window: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Phantom:
    """Structures in drawing order, targets by name ("ventral@T11"), levels from the head down, sources of numbers.

    gaps: by level, the room between what the robot goes round and the canal's wall, m: dorsal, ventral, left, right.
    source: what `load_phantom` takes to make it again, with ``level_range``.
    pressure_limit (Pa) and cord_indentation_limit (m) are engineering choices: no limit is accepted for epidural force.
    """

    name: str
    kind: str
    structures: Mapping[str, Structure]
    targets: Mapping[str, Target]
    levels: tuple[Level, ...]
    sources: Mapping[str, str]
    entries: Mapping[str, Entry] = field(default_factory=dict)
    gaps: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    pressure_limit: float = PRESSURE_LIMIT
    cord_indentation_limit: float = INDENTATION_LIMIT
    source: str = ""
    plan: Any = field(default=None, repr=False)  # what parametric phantoms are made from: a `Column`
    _free: Surface = field(init=False, repr=False)

    def __post_init__(self) -> None:
        one_of("kind", self.kind, KINDS)
        positive("pressure_limit", self.pressure_limit)
        positive("cord_indentation_limit", self.cord_indentation_limit)
        for name in ("structures", "targets", "sources", "entries", "gaps"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        walls = [each.surface for each in self.structures.values() if each.is_wall]
        if not walls:
            raise InvalidInput("structures", Fact("no wall"), "at least one that the robot may not enter, as the cord")
        object.__setattr__(self, "_free", walls[0] if len(walls) == 1 else Walls(surfaces=walls))

    def __repr__(self) -> str:
        ends = f"{self.levels[0].name}-{self.levels[-1].name}, " if self.levels else ""
        return (
            f"Phantom({self.name!r}, {self.kind}, {ends}{len(self.structures)} structures, {len(self.targets)} targets)"
        )

    @property
    def level_range(self) -> str | None:
        """What `load_phantom` takes as levels to make it again; None for meshes, whose file tells them."""
        return f"{self.levels[0].name}-{self.levels[-1].name}" if self.plan is not None else None

    def free(self) -> Surface:
        """All walls as one surface, for `tendonrod.solve`: distance to the nearest, positive where the robot may be."""
        return self._free

    @cached_property
    def fingerprint(self) -> str:
        """Of all that decides what a robot meets: meshes, which of them are walls, distances, targets, limits."""
        digest = hashlib.sha256()
        for name, each in self.structures.items():
            digest.update(repr((name, each.role, each.is_wall)).encode())
            digest.update(each.vertices.tobytes() + each.faces.tobytes())
            if isinstance(each.surface, DistanceGrid):
                digest.update(each.surface.origin.tobytes() + each.surface.values.tobytes())
        digest.update(repr(list(self.targets.values())).encode())
        digest.update(repr((self.pressure_limit, self.cord_indentation_limit)).encode())
        return digest.hexdigest()[:32]

    def clearance(self, points) -> dict[str, np.ndarray]:
        """By structure, the signed distance (n,) m of ``points`` (n, 3) m to it, positive outside."""
        measured = {name: each.surface for name, each in self.structures.items() if each.surface is not None}
        return {name: surface.distance(points)[0] for name, surface in measured.items()}

    def entry(self, level: str) -> Entry:
        """The entry below the lamina of ``level``. Raises `InvalidInput` for a level without one."""
        return self.entries[one_of("level", level, self.entries)]

    def target(self, name: str) -> Target:
        """The target of that name, else `InvalidInput` that lists them."""
        return self.targets[one_of("target", name, self.targets)]

    @property
    def narrowest(self) -> tuple[float, str, str] | None:
        """The smallest of `gaps`, m, with its side and level; None where none are known."""
        gaps = [(gap, side, level) for level, each in self.gaps.items() for side, gap in each.items()]
        return min(gaps, default=None)

    def doubts(self) -> tuple[str, ...]:
        """A sentence with numbers for each target that lies inside a wall, or far from everything."""
        points = np.concatenate([each.vertices for each in self.structures.values()])
        low, high = points.min(axis=0), points.max(axis=0)
        found = []
        for target in self.targets.values():
            at = np.array(target.position)
            off = float(np.linalg.norm(np.maximum(0.0, np.maximum(low - at, at - high))))
            if off > FAR:
                found.append(f"target {target.name} lies {1e3 * off:.1f} mm outside the box around all structures")
            elif (room := float(self._free.distance(at[None])[0][0])) < 0.0:
                reach = "" if target.tolerance < -room else ", though its tolerance reaches out of it"
                found.append(f"target {target.name} lies {-1e3 * room:.2f} mm inside {self._wall_at(at)}{reach}")
        return tuple(found)

    def _wall_at(self, at: np.ndarray) -> str:
        """Name of the wall that ``at`` (3,) m is deepest in."""
        walls = {name: each.surface for name, each in self.structures.items() if each.is_wall and each.surface}
        return min(walls, key=lambda name: float(walls[name].distance(at[None])[0][0]))

    def check_robot(self, outer_radius: float, name: str = "") -> None:
        """Raises `InvalidInput` where a tube of ``outer_radius`` (m) fits into no gap beside the cord, or dura.

        It must fit dorsally at some level, where it enters, and beside at some level; among meshes, at some target.
        name: the robot's, for the error.
        """
        width = 2.0 * positive("outer_radius", outer_radius)
        tube = Fact(f"{name}{', ' if name else ''}a tube of {1e3 * width:.3f} mm")
        gaps = [(each[side], side, level) for level, each in self.gaps.items() for side in ("dorsal", "left", "right")]
        for sides in (("dorsal",), ("left", "right")):
            widest = max((each for each in gaps if each[1] in sides), default=None)
            if widest is not None and widest[0] <= width:
                raise _too_narrow(self, tube, "dorsal" if "dorsal" in sides else "lateral", widest[0], widest[2])
        blocked = self.unreachable(outer_radius)
        if self.targets and len(blocked) == len(self.targets):
            raise InvalidInput("robot", tube, f"thinner: {next(iter(blocked.values()))}")

    def unreachable(self, outer_radius: float) -> dict[str, str]:
        """Targets that a tube of ``outer_radius`` (m) cannot reach for want of room, each with a sentence that says so.

        Distances change by 1 m per metre at most, so that none of the places within the tolerance has more room than
        its middle and the tolerance together.
        """
        found = {}
        for name, each in self.targets.items():
            room = float(self._free.distance(np.array([each.position]))[0][0])
            if room + each.tolerance < outer_radius:
                found[name] = (
                    f"{name} has room for a tube of {2e3 * max(room + each.tolerance, 0.0):.3f} mm at most, within "
                    f"{1e3 * each.tolerance:.3f} mm of it, and the robot's is {2e3 * outer_radius:.3f} mm"
                )
        return found


def _too_narrow(phantom: Phantom, tube: Fact, side: str, gap: float, level: str) -> InvalidInput:
    inner = "dura" if "dura" in phantom.structures else "cord"
    allowed = (
        f"thinner than the gap: the widest {side} gap between {inner} and canal in {phantom.name} is "
        f"{1e3 * gap:.3f} mm, at {level}; take a thinner robot or a wider phantom"
    )
    return InvalidInput("robot", tube, allowed)
