"""Loads at and between any places of the robot: `PointLoad`, `LumpedMass`, `DistributedLoad`. SI units.

Places are material coordinates s_m (m): 0 at the robot's base, L_na at its tip. What lies inside the outer tube has no
effect; what stands at a joint between segments acts on the section before it. ``frame`` is "world" for dead loads,
fixed in direction, or "body" for follower loads, which turn with the section.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .errors import InvalidInput, nonnegative, one_of, positive, vector

if TYPE_CHECKING:
    from .robot import Robot

Three = Sequence[float] | np.ndarray
ZERO = (0.0, 0.0, 0.0)
SAME_PLACE = 1e-9  # of the length; a load at a joint acts on the section before it
FRAMES = ("world", "body")


@dataclass(frozen=True, kw_only=True)
class PointLoad:
    """A force (N) and a moment (N m) at s_m = ``at`` (m), None for the tip.

    offset: where the force acts, in the section frame from the tube's axis, m.
    """

    force: Three = ZERO
    moment: Three = ZERO
    at: float | None = None
    offset: Three = ZERO
    frame: str = "world"

    def __post_init__(self) -> None:
        _vectors(self, "force", "moment", "offset")
        _place(self, "at")
        one_of("frame", self.frame, FRAMES)


@dataclass(frozen=True, kw_only=True)
class LumpedMass:
    """A mass (kg), such as a tracker, at s_m = ``at`` (m), None for the tip; it weighs under the gravity of the solve.

    offset: its centre, in the section frame from the tube's axis, m.
    """

    mass: float
    at: float | None = None
    offset: Three = ZERO

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", nonnegative("mass", self.mass))
        _vectors(self, "offset")
        _place(self, "at")


@dataclass(frozen=True, kw_only=True)
class DistributedLoad:
    """Force (N/m) and moment (N m/m) per metre of s from ``start`` to ``end`` (m, None for the tip).

    They act on the neutral axis. Where force_end or moment_end are given, the density changes linearly from start to
    end.
    """

    force: Three = ZERO
    moment: Three = ZERO
    force_end: Three | None = None
    moment_end: Three | None = None
    start: float = 0.0
    end: float | None = None
    frame: str = "world"

    def __post_init__(self) -> None:
        _vectors(self, "force", "moment")
        _vectors(self, *(name for name in ("force_end", "moment_end") if getattr(self, name) is not None))
        object.__setattr__(self, "start", nonnegative("start", self.start))
        if self.end is not None:
            object.__setattr__(self, "end", positive("end", self.end))
            if self.end <= self.start:
                raise InvalidInput("end", self.end, f"> start = {self.start!r}")
        one_of("frame", self.frame, FRAMES)


Load = PointLoad | LumpedMass | DistributedLoad


def load_tables(robot: Robot, loads: Iterable[Load], gravity: Three) -> tuple[np.ndarray, np.ndarray]:
    """(points (b, 12), spread (a, 15)) as the kernel takes them, material coordinates in front.

    Raises `InvalidInput` where a load lies beyond the robot's tip.
    """
    length, points, spread = robot.length_na, [], []
    for i, load in enumerate(loads):
        field = f"loads[{i}]"
        if isinstance(load, DistributedLoad):
            end = length if load.end is None else _within(f"{field}.end", load.end, length)
            _within(f"{field}.start", load.start, length)
            last = (load.force if load.force_end is None else load.force_end,
                    load.moment if load.moment_end is None else load.moment_end)  # fmt: skip
            spread.append([load.start, end, *load.force, *last[0], *load.moment, *last[1], load.frame == "body"])
        elif isinstance(load, (PointLoad, LumpedMass)):
            at = length if load.at is None else _within(f"{field}.at", load.at, length)
            x, y = robot.axis_offset(np.array([max(0.0, at - SAME_PLACE * length)]))[0]
            offset = load.offset[0] + x, load.offset[1] + y, load.offset[2]
            if isinstance(load, LumpedMass):
                points.append([at, *(load.mass * float(g) for g in gravity), *ZERO, *offset, 0.0, load.mass])
            else:
                points.append([at, *load.force, *load.moment, *offset, load.frame == "body", 0.0])
        else:
            raise InvalidInput(field, load, "a PointLoad, a LumpedMass or a DistributedLoad")
    return np.array(points, dtype=float).reshape(-1, 12), np.array(spread, dtype=float).reshape(-1, 15)


def _vectors(load: object, *names: str) -> None:
    for name in names:
        object.__setattr__(load, name, tuple(vector(name, getattr(load, name), 3).tolist()))


def _place(load: object, name: str) -> None:
    if getattr(load, name) is not None:
        object.__setattr__(load, name, nonnegative(name, getattr(load, name)))


def _within(field: str, value: float, length: float) -> float:
    if value > length * (1.0 + 1e-12):
        raise InvalidInput(field, value, f"from 0 to the robot's length L_na = {length:.6g} m")
    return min(value, length)
