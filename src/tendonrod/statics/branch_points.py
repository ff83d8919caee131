"""What a branch is made of: `State`, `Point`, `Place` and `Way`; how one is found is in `arclength`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class State:
    """Strains x (2n, 6), tensions tau (T,) and parameter t."""

    x: np.ndarray
    tau: np.ndarray
    t: float

    def plus(self, by: float, other: State) -> State:
        """This and ``by`` times the other."""
        return State(self.x + by * other.x, self.tau + by * other.tau, self.t + by * other.t)


@dataclass(frozen=True, eq=False)
class Point(State):
    """A balanced state and what is known there. tangent: of unit length; tip_slope: motion of the tip along it."""

    tangent: State
    tip: np.ndarray
    tip_slope: np.ndarray
    negative: int
    energy: float
    iterations: int


@dataclass(frozen=True)
class Place:
    """A point of a way, and what happens there; sides: the numbers of unstable directions before and after."""

    point: Point
    kind: str = ""
    sides: tuple[int, int] = (0, 0)


@dataclass
class Way:
    """Places in order, and why there are no more."""

    places: list[Place]
    ended: str

    @property
    def count(self) -> int:
        """Number of points that are no folds or bifurcations."""
        return sum(not each.kind for each in self.places)
