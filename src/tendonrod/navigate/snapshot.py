"""`Snapshot`: all that is known of a session at one instant, with its `Gauge` and `Notice` types; SI, world frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .commands import Posture
from .outer_tube import OuterTube

Severity = Literal["info", "warning", "limit"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Gauge:
    """A value between limits, in ``unit``; exceeded where it passes one of them (the stops of a drive never are)."""

    value: float
    low: float
    high: float
    unit: str
    is_exceeded: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class Notice:
    """A sentence with numbers for the operator; code: short and stable, for programs."""

    code: str
    text: str
    severity: Severity


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """The session at one instant. Arrays are read-only; n points along the exposed tube, one where it is retracted.

    - index: steps made; time: s, the sum of their durations.
    - posture: insertion, rotation, tension, also as properties; tube: the outer tube.
    - s (n,) m from the exit; centerline (n, 3) m, the tube's axis; frames (n, 3, 3); radius (n,) m.
    - clearance: structure -> (n,) m between the tube's wall and it, negative where it enters.
    - contact_point (k, 3) m, contact_force (k, 3) N on the robot, contact_pressure (k,) Pa (`touch`), and
      contact_structure (k,) names; pressure (n,) Pa along the body, 0 where free.
    - tip (3,) m, of the tube's axis; tip_direction (3,).
    - target_distance: name -> m from the tip; reached: names in the order in which they were reached.
    - limits: name -> `Gauge`; warnings; in_range: whether the model holds here (`ranges`).
    - blocked: why the last command was not carried out, "" where it was.
    """

    index: int
    time: float
    posture: Posture
    tube: OuterTube
    s: np.ndarray
    centerline: np.ndarray
    frames: np.ndarray
    radius: np.ndarray
    clearance: Mapping[str, np.ndarray]
    contact_point: np.ndarray
    contact_force: np.ndarray
    contact_pressure: np.ndarray
    contact_structure: tuple[str, ...]
    pressure: np.ndarray
    target_distance: Mapping[str, float]
    reached: tuple[str, ...]
    limits: Mapping[str, Gauge]
    warnings: tuple[Notice, ...]
    in_range: bool
    blocked: str

    @property
    def insertion(self) -> float:
        """Exposed share of the robot, 0 to 1."""
        return self.posture.insertion

    @property
    def rotation(self) -> float:
        """Of the section frame at the exit, rad."""
        return self.posture.rotation

    @property
    def tension(self) -> np.ndarray:
        """(n_tendons,) N."""
        return np.array(self.posture.tension)

    @property
    def tip(self) -> np.ndarray:
        """(3,) end of the tube's axis, m."""
        return self.centerline[-1]

    @property
    def tip_direction(self) -> np.ndarray:
        """(3,) unit vector along the tube at its tip."""
        return self.frames[-1, :, 2]

    @property
    def exposed(self) -> float:
        """Exposed length of the neutral axis, m."""
        return float(self.s[-1])
