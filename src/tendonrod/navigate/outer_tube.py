"""`OuterTube`: where the straight outer tube ends from which the robot comes out, in the frame of the phantom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np

from ..errors import within

VENTRAL = np.array([-1.0, 0.0, 0.0])
RANGES = {
    "height": (-0.2, 0.8),
    "offset": (-30e-3, 30e-3),
    "depth": (-30e-3, 60e-3),
    "tilt": (-radians(80), radians(80)),
    "lean": (-radians(80), radians(80)),
}  # m and rad: beyond these no tube points along a spine


@dataclass(frozen=True, kw_only=True, slots=True)
class OuterTube:
    """Pose of the outer tube's exit in the world: +x dorsal, +y the patient's right, +z cranial.

    - height: z of the exit, m. offset: y, m. depth: x, m, dorsal of the cord's axis.
    - tilt: rad, turns the tube's direction from cranial towards +y; lean: rad, towards ventral.

    Raises `InvalidInput` outside `RANGES`.
    """

    height: float = 0.0
    offset: float = 0.0
    depth: float = 4.9e-3
    tilt: float = 0.0
    lean: float = 0.0

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            object.__setattr__(self, name, within(name, getattr(self, name), low, high))

    @property
    def direction(self) -> np.ndarray:
        """(3,) unit vector along the tube, out of it."""
        flat = cos(self.lean)
        return np.array([-sin(self.lean), flat * sin(self.tilt), flat * cos(self.tilt)])

    @property
    def position(self) -> np.ndarray:
        """(3,) centre of the exit, m."""
        return np.array([self.depth, self.offset, self.height])

    @property
    def pose(self) -> np.ndarray:
        """(4, 4) T_world_exit: z along the tube, x as ventral as it can be, so that rotation 0 bends ventrally."""
        z = self.direction
        across = VENTRAL - (VENTRAL @ z) * z  # never zero: the ranges keep the tube 10 degrees off ventral
        x = across / np.linalg.norm(across)
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, self.position
        return T

    def changed(self, **changes: float) -> OuterTube:
        """A copy with some numbers changed. Raises `InvalidInput`."""
        return replace(self, **changes)
