"""`Trail`: the path that the tip took while the robot was inserted, and how far the body lies from it.

Follow-the-leader motion keeps the body on that path. It is kept by exposed length, one point per `SPACING`: where the
tip was when the robot was first that long. Retraction forgets what lies beyond.
"""

from __future__ import annotations

import numpy as np

from ..curve import Curve
from .snapshot import Snapshot

SPACING = 0.25e-3  # m of exposed length between kept points
APART = 1e-6  # m, below which two lengths are one


class Trail:
    """Collects the tip's path from snapshots in order."""

    def __init__(self) -> None:
        self._length: list[float] = []
        self._tip: list[np.ndarray] = []

    def add(self, snapshot: Snapshot) -> None:
        """Look at the next snapshot."""
        length = snapshot.exposed
        while self._length and self._length[-1] > length:
            self._length.pop()
            self._tip.pop()
        if not self._length or length >= self._length[-1] + SPACING:
            self._length.append(length)
            self._tip.append(snapshot.tip)

    def deviation(self, snapshot: Snapshot) -> np.ndarray | None:
        """(n,) distance of the body's points from the path and its way to the tip now, m; None before there is one."""
        length, tip = self._length, self._tip
        if snapshot.exposed > length[-1] + APART:
            length, tip = [*length, snapshot.exposed], [*tip, snapshot.tip]
        if len(length) < 4:
            return None
        s, points = np.array(length), np.array(tip)
        path = Curve(s=s, points=points, slopes=np.gradient(points, s, axis=0, edge_order=2))
        return path.project(snapshot.centerline).distance
