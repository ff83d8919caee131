"""`Inputs` of a batch: checked, one row per item."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import cos, inf, sin
from typing import Any

import numpy as np

from ..errors import Fact, InvalidInput, numbers
from ..robot import Robot, as_robot
from .equilibrium import solve
from .shape import Shape
from .solution import worked_accuracy

Numbers = float | Sequence | np.ndarray
VECTORS = ("gravity", "tip_force", "tip_moment", "distributed_force", "distributed_moment")
RANGES = {"tensions": (0.0, inf), "insertion": (0.0, 1.0), "accuracy": (1e-12, 1.0)}


class Inputs:
    """The checked inputs of a batch: robots, and arrays with one row per item, repeated without copying.

    given: values by the names of `solve`; more: those that hold for all items unseen. Raises `InvalidInput`.
    """

    def __init__(
        self, robot: Robot | Sequence[Robot], given: Mapping[str, Numbers], steps: int | None, more: Mapping[str, Any]
    ) -> None:
        for name in ("s", "throw"):
            if name in more:
                raise InvalidInput(name, more[name], "left out: a batch reports at `points` and never raises")
        self.robots, lengths = _robots(robot)
        rows = {}
        for field, value in given.items():
            rows[field], has_axis = _rows(field, value, self.robots[0].n_tendons)
            if has_axis:
                lengths[field] = len(rows[field])
        self.size, self.steps, self.more = _common(lengths), steps, more
        self.values = {field: np.broadcast_to(each, (self.size, *each.shape[1:])) for field, each in rows.items()}
        self.which = np.broadcast_to(np.arange(len(self.robots)), (self.size,))

    @cached_property
    def fits_the_loop(self) -> bool:
        """Whether the compiled loop knows all robots and all that acts on them."""
        return not self.more and all(getattr(each, "is_uniform", True) for each in self.robots)

    @cached_property
    def rods(self) -> np.ndarray:
        """(U, 13) `Robot.rod_constants`."""
        return np.array([each.rod_constants for each in self.robots])

    @cached_property
    def routing(self) -> np.ndarray:
        """(U, n, 6) `Robot.routing`."""
        return np.array([each.routing for each in self.robots])

    @cached_property
    def sections(self) -> np.ndarray:
        """(3, U) weight per length over gravity, radius and length of the neutral axis."""
        return np.array([(s.line_density, s.r_na, s.L_na) for s in (each.section for each in self.robots)]).T

    def tensions(self, items: slice) -> np.ndarray:
        """(m, n) tensions of some items, N."""
        return np.array(self.values["tensions"][items])

    def problems(self, items: slice) -> np.ndarray:
        """(m, 30) problems of some items as the kernel takes them, to the bit what `prepare` makes of each."""
        get = {field: each[items] for field, each in self.values.items()}
        weight, r, L = self.sections[:, self.which[items]]
        eta, angles = get["insertion"], get["rotation"].tolist()
        c, d = np.array([cos(a) for a in angles]), np.array([sin(a) for a in angles])
        problems = np.zeros((eta.size, 30))
        problems[:, 0:3], problems[:, 3:6] = get["tip_force"], get["tip_moment"]
        problems[:, 6:9] = weight[:, None] * get["gravity"] + get["distributed_force"]
        problems[:, 9:12] = get["distributed_moment"]
        problems[:, 12], problems[:, 13] = eta * L, (1.0 - eta) * L
        problems[:, 14], problems[:, 15] = -r * c, -r * d
        problems[:, 17], problems[:, 18], problems[:, 20], problems[:, 21], problems[:, 25] = c, -d, d, c, 1.0
        asked = zip(get["accuracy"].tolist(), problems[:, 12].tolist(), strict=True)
        problems[:, 26] = [worked_accuracy(*each) for each in asked]
        problems[:, 27], problems[:, 29] = self.steps or 0, inf
        return problems

    def solve(self, i: int, fractions: np.ndarray | None = None, s=None) -> Shape:
        """Item ``i`` alone, at arc lengths ``s`` or at ``fractions`` of the exposed length."""
        arguments = {field: each[i].tolist() for field, each in self.values.items()}
        robot = self.robots[self.which[i]]
        shape = solve(robot, **arguments, s=s, steps=self.steps, throw=False, **self.more)
        return shape if fractions is None else shape.at(fractions * shape.length)


def _robots(robot: Robot | Sequence[Robot]) -> tuple[tuple[Robot, ...], dict[str, int]]:
    """(robots, their number by name, if they are given as a sequence)."""
    if not isinstance(robot, (list, tuple, np.ndarray)):
        return (as_robot(robot),), {}
    robots = tuple(robot)
    if not robots:
        raise InvalidInput("robot", robot, "a Robot or a sequence of one or more")
    for i, each in enumerate(robots):
        if not isinstance(each, Robot):
            raise InvalidInput(f"robot[{i}]", each, "a Robot, as load_robot gives it")
        if each.n_tendons != robots[0].n_tendons:
            allowed = f"a robot with as many tendons as robot[0], {robots[0].n_tendons}"
            raise InvalidInput(f"robot[{i}]", Fact(f"{each.name} with {each.n_tendons}"), allowed)
    return robots, {"robot": len(robots)}


def _rows(field: str, value: Numbers, n_tendons: int) -> tuple[np.ndarray, bool]:
    """(``value`` with a leading axis, whether it had one)."""
    width = 3 if field in VECTORS else n_tendons if field == "tensions" else None
    ndims = (1, 2) if field in VECTORS else (0, 1, 2) if field == "tensions" else (0, 1)
    array = numbers(field, value, ndims)
    if field in RANGES:
        check_range(field, array, *RANGES[field])
    if field == "tensions" and array.ndim == 0:
        return np.full((1, n_tendons), array), False
    if field == "tensions" and array.ndim == 1 and n_tendons == 1:
        return array[:, None], True
    if width is not None and array.shape[-1] != width:
        raise InvalidInput(field, value, f"{width} finite numbers, or a row of {width} for each item")
    return (array, True) if array.ndim == ndims[-1] else (array[None], False)


def check_range(field: str, array: np.ndarray, low: float, high: float) -> None:
    wrong = np.argwhere((array < low) | (array > high))
    if len(wrong):
        at = tuple(wrong[0].tolist())
        allowed = f">= {low:.6g}" if high == inf else f"from {low:.6g} to {high:.6g}"
        raise InvalidInput(field + "".join(f"[{i}]" for i in at), array[at], allowed)


def _common(lengths: Mapping[str, int]) -> int:
    """Number of items, from the lengths of the leading axes; 1 fits all."""
    several = {field: length for field, length in lengths.items() if length != 1}
    first, size = next(iter(several.items()), ("", 1))
    for field, length in several.items():
        if length != size:
            raise InvalidInput(field, Fact(f"{length} items"), f"one or {size} items, as {first} has")
    return size
