"""`Scenario`: everything that stays as it is during a session: robot, phantom, outer tube, gravity, limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import radians
from os import PathLike
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Fact, InvalidInput, one_of, vector
from ..robot import Robot, as_robot, load_robot
from ..section import NotchedTube
from ..surface import Surface
from .limits import NavigationLimits, limits_of
from .outer_tube import OuterTube

if TYPE_CHECKING:
    from ..anatomy import Phantom

PRONE = (-9.81, 0.0, 0.0)  # m/s2: +x is dorsal
TILT = radians(21.0)  # where nothing is known of the space around the cord
# Outer tubes from which pulling and then inserting ExoNav 1, without turning it, leads to targets: found by a search
# over poses for the free robot, carried out with contact from the windows of T11 to L2 (tests). m and rad.
ROUND_CORD: Mapping[str, float] = MappingProxyType({"offset": 1.5e-3, "tilt": radians(22.0), "lean": radians(8.0)})
TO_GANGLION: Mapping[str, float] = MappingProxyType({"offset": -1.5e-3, "tilt": radians(32.0), "lean": radians(1.0)})
DORSAL = 0.1  # of the dorsal gap, by which that exit lies dorsal of its middle
NOTHING: Mapping[str, float] = MappingProxyType({})
ROOM = 1e-5  # m, by which the tube's wall must clear the walls at the exit: the contact's own tolerance


@dataclass(frozen=True, kw_only=True, eq=False)
class Scenario:
    """What a session is about.

    - robot, phantom, tube: `Robot`, `Phantom`, `OuterTube`. gravity: (3,) m/s2, world frame.
    - limits: None for those of robot and phantom (`limits_of`).
    - coupled: True where insertion turns the motor by the follow-the-leader law, so that the rotation at the exit
      stays; False where the motor stands still, and what of the helix comes out turns the robot.

    Raises `InvalidInput` where the robot does not fit the phantom, or the exit does not lie in its free space.
    """

    robot: Robot
    phantom: Phantom
    tube: OuterTube
    gravity: tuple[float, float, float] = PRONE
    limits: NavigationLimits = None  # pyright: ignore[reportAssignmentType] - set below
    coupled: bool = True

    def __post_init__(self) -> None:
        as_robot(self.robot)
        if not isinstance(self.tube, OuterTube):
            raise InvalidInput("tube", self.tube, "an OuterTube")
        object.__setattr__(self, "gravity", tuple(vector("gravity", self.gravity, 3).tolist()))
        self.phantom.check_robot(self.outer_radius, self.robot.name)
        if self.limits is None:
            object.__setattr__(self, "limits", limits_of(self.robot, pressure=self.phantom.pressure_limit))
        check_tube(self, self.tube)

    @cached_property
    def pose(self) -> np.ndarray:
        """(4, 4) T_world_exit, read-only."""
        pose = self.tube.pose
        pose.setflags(write=False)
        return pose

    @cached_property
    def target_positions(self) -> np.ndarray:
        """(m, 3) where the phantom's targets lie, m."""
        return np.array([each.position for each in self.phantom.targets.values()]).reshape(-1, 3)

    @cached_property
    def outer_radius(self) -> float:
        """Largest radius of the robot, m."""
        return largest_radius(self.robot)

    @property
    def surface(self) -> Surface:
        """What the robot may not enter."""
        return self.phantom.free()

    def placed(self, tube: OuterTube) -> Scenario:
        """The same with another outer tube. Raises `InvalidInput` as at construction."""
        return replace(self, tube=tube)


def check_tube(scenario: Scenario, tube: OuterTube) -> None:
    """Raises `InvalidInput` where the exit leaves no room for the robot in the phantom's free space."""
    exit_at = tube.position[None]
    free = float(scenario.surface.distance(exit_at)[0][0])
    if free >= scenario.outer_radius - ROOM:
        return
    clearance = scenario.phantom.clearance(exit_at)
    near = min(clearance, key=lambda name: abs(float(clearance[name][0]) - free))
    place = ", ".join(f"{1e3 * x:.3g}" for x in tube.position)
    needs = f"at least the robot's radius, {1e3 * scenario.outer_radius:.3g} mm, from every wall"
    away = f"the nearest, {near}, is {1e3 * free:.3g} mm away"
    found = away if free >= 0.0 else f"it lies {-1e3 * free:.3g} mm inside the nearest wall, {near}"
    raise InvalidInput("outer tube's exit (mm)", Fact(f"({place})"), f"{needs}; {found}")


def load_scenario(
    robot: str | PathLike[str] = "exonav-1",
    phantom: str | PathLike[str] = "printed",
    *,
    torsion: str = "homogenized",
    levels: str | None = None,
    entry: str | None = None,
    tube: Mapping[str, float] = NOTHING,
    limits: Mapping[str, float] = NOTHING,
    **settings: Any,
) -> Scenario:
    """A scenario by names or files: robot as `load_robot`, phantom and levels as `load_phantom` take them.

    torsion: model of a notched tube's torsion, "" as the robot file says; other robots have only one. entry: the level
    whose window the outer tube comes through, the lowest if None. tube, limits: what differs from `default_tube` and
    from `limits_of`, SI. settings: gravity, coupled of `Scenario`. Raises `InvalidInput`.
    """
    from ..anatomy import load_phantom

    chosen = load_robot(robot)
    anatomy = load_phantom(phantom) if levels is None else load_phantom(phantom, levels=levels)
    if torsion and isinstance(chosen.body, NotchedTube):
        chosen = chosen.replace(torsion=torsion)
    return Scenario(
        robot=chosen, phantom=anatomy, tube=default_tube(anatomy, entry, chosen).changed(**tube),
        limits=limits_of(chosen, **{"pressure": anatomy.pressure_limit, **limits}), **settings,
    )  # fmt: skip


def default_tube(phantom: Phantom, level: str | None = None, robot: Robot | None = None) -> OuterTube:
    """The outer tube in the interlaminar window of ``level``, the lowest if None, from which a first drive succeeds.

    Without a dura `ROUND_CORD`: 0.7 N of tension, then insertion, lead ExoNav 1 past lateral-right of the same level to
    ventral of the next. With one `TO_GANGLION`: 0.47 N, then insertion, lead to drg-right of the next level. Where
    that leaves no room for ``robot``, None for any, the exit lies in the middle of the space, tilted by `TILT`. A
    phantom without entries gets that at its lowest level, 4.9 mm dorsal of the origin. Raises `InvalidInput`.
    """
    if level is None and not phantom.entries:
        return OuterTube(height=phantom.levels[-1].z_low if phantom.levels else 0.0, tilt=TILT)
    if not phantom.entries:
        raise InvalidInput("entry", level, f"left out: no outer tube's entries are known of the phantom {phantom.name}")
    entry = phantom.entry(one_of("entry", level or phantom.levels[-1].name, phantom.entries))
    middle = OuterTube(height=entry.height, offset=entry.offset, depth=entry.depth, tilt=TILT)
    has_dura = any(each.role == "dura" for each in phantom.structures.values())
    pose = TO_GANGLION if has_dura else ROUND_CORD
    depth = entry.depth + DORSAL * phantom.gaps.get(entry.level, {}).get("dorsal", 0.0)
    found = middle.changed(**{**pose, "offset": entry.offset + pose["offset"], "depth": depth})
    radius = 0.0 if robot is None else largest_radius(robot)
    return found if float(phantom.free().distance(found.position[None])[0][0]) >= radius else middle


def largest_radius(robot: Robot) -> float:
    """Largest outer radius of the robot, m; NaN where its outline is unknown."""
    return float(robot.outer_radius(np.linspace(0.0, robot.length_na, 33)).max())
