"""Phantoms of a user's own meshes: what a file names, read, checked, placed in the world, with distances."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import Fact, InvalidInput, one_of, vector, within
from ..rotation import exp_so3
from ..surface import Surface
from .distances import SPACING, distance_grid
from .levels import Level
from .meshfile import read_mesh
from .phantom import ROLES, Phantom, Structure, Target
from .soundness import UNITS, check_mesh

MARGIN = 8e-3  # m around what the robot goes round, within which distances are held
SPACINGS = 0.1e-3, 2e-3  # m, between nodes of a distance grid
FLAT = 1e-4  # m: how even the end of a canal is that counts as cut off there
WALLS = ("dura", "canal", "bone", "disc")


@dataclass(frozen=True, kw_only=True)
class MeshSource:
    """One mesh file: role of the structure, unit of its numbers, and on which side of it the robot is.

    robot_is: "outside", or "inside" for the lining of a canal, whose flat ends along z then count as open.
    is_wall: None for what its role says; the cord is a wall where there is no dura.
    """

    name: str
    role: str
    file: Path
    unit: str = "mm"
    robot_is: str = "outside"
    is_wall: bool | None = None

    def __post_init__(self) -> None:
        one_of("role", self.role, ROLES)
        one_of("unit", self.unit, UNITS)
        one_of("robot_is", self.robot_is, ("outside", "inside"))
        if self.is_wall is not None and not isinstance(self.is_wall, bool):
            raise InvalidInput("is_wall", self.is_wall, "true or false")


@dataclass(frozen=True, kw_only=True, eq=False)
class Placing:
    """Where the meshes' frame lies in the world: turned by a rotation vector (rad), then moved to ``position`` (m)."""

    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    rotation: tuple[float, ...] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("position", "rotation"):
            object.__setattr__(self, name, tuple(vector(name, getattr(self, name), 3).tolist()))

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the meshes in the world."""
        return points @ exp_so3(np.array(self.rotation)).T + self.position


def mesh_phantom(
    name: str,
    sources: tuple[MeshSource, ...],
    targets: tuple[Target, ...],
    levels: tuple[Level, ...] = (),
    placing: Placing | None = None,
    spacing: float = SPACING,
) -> Phantom:
    """A phantom of meshes, in the order given. Raises `InvalidInput` for a mesh that is not sound or wrongly scaled.

    spacing: m between the nodes at which distances are exact.
    """
    within("spacing", spacing, *SPACINGS)
    if not sources:
        raise InvalidInput("structures", Fact("none"), "at least the cord, or the dura")
    meshes = {each.name: _read(each, placing or Placing()) for each in sources}
    if len(meshes) < len(sources):
        raise InvalidInput("structures", [each.name for each in sources], "of different names")
    low, high = _region(sources, meshes)
    has_dura = any(each.role == "dura" for each in sources)
    structures = {each.name: _structure(each, meshes[each.name], has_dura, low, high, spacing) for each in sources}
    return Phantom(
        name=name,
        kind="meshes",
        structures=structures,
        targets={each.name: each for each in targets},
        levels=levels,
        sources={each.name: f"{each.file.name}, in {each.unit}" for each in sources},
    )


def _read(source: MeshSource, placing: Placing) -> tuple[np.ndarray, np.ndarray]:
    field = f"structure {source.name}"
    vertices, faces = read_mesh(field, source.file)
    vertices = placing.placed(UNITS[source.unit] * vertices)
    check_mesh(f"{field} ({source.file.name})", vertices, faces, source.unit)
    return vertices, faces


def _region(sources: tuple[MeshSource, ...], meshes: dict) -> tuple[np.ndarray, np.ndarray]:
    """Box in which distances are held: around what the robot goes round, else around all that it may not enter."""
    inner = [each.name for each in sources if each.role in ("dura", "cord") or each.robot_is == "inside"]
    points = np.concatenate([meshes[name][0] for name in inner or meshes])
    return points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN


def _structure(source: MeshSource, mesh, has_dura: bool, low, high, spacing: float) -> Structure:
    vertices, faces = mesh
    is_wall = source.is_wall
    if is_wall is None:
        is_wall = source.role in WALLS or (source.role == "cord" and not has_dura)
    surface = _surface(source, vertices, faces, low, high, spacing) if is_wall or source.role == "cord" else None
    return Structure(
        name=source.name, role=source.role, vertices=vertices, faces=faces, surface=surface, is_wall=is_wall
    )


def _surface(source: MeshSource, vertices, faces, low, high, spacing: float) -> Surface:
    if source.robot_is == "outside":
        return distance_grid(vertices, faces, low, high, spacing)
    ends = vertices[:, 2].min(), vertices[:, 2].max()
    z = vertices[faces][:, :, 2]
    caps = np.any([np.all(np.abs(z - end) < FLAT, axis=1) for end in ends], axis=0)
    low, high = low.copy(), high.copy()
    low[2], high[2] = ends[0] + FLAT, ends[1] - FLAT  # beyond, the lining goes on as it is at its ends
    return distance_grid(vertices, faces, low, high, spacing, caps=caps)
