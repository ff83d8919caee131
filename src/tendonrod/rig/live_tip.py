"""`LiveTip`: how far the tip is from its reference while a trial runs, by what the tracker says of it."""

from __future__ import annotations

from collections import deque
from math import nan

import numpy as np

from ..curve import Curve
from ..measurement.registration import without_offset
from ..measurement.trial import Tracker
from ..rotation import hat
from .loop import Moment
from .staged import Phase

FRAMES = 10  # that are averaged: a quarter of a second of a tracker at 40 Hz, in which the tip moves 0.1 mm
FOLLOWING = {Phase.INSERT, Phase.SETTLE, Phase.RETRACT}  # else the tendon is slack, or being taken up


class LiveTip:
    """Gathers the frames of one tool and compares their mean with the reference; for the eye, not for the record.

    reference: the tube's axis that the tip is to follow, m, in the frame of the outer tube's exit. tracker: the tool.
    T_world_field: (4, 4), the tracker's frame in that of the exit.
    """

    def __init__(self, reference: Curve, tracker: Tracker, T_world_field: np.ndarray) -> None:
        self._reference, self._tracker, self._T = reference, tracker, np.array(T_world_field, dtype=float)
        self._tips: deque[np.ndarray] = deque(maxlen=FRAMES)

    def watch(self, moment: Moment) -> None:
        """Take what the tracker gave in this period."""
        for frame in moment.sample.frames:
            if frame.tool == self._tracker.name and not frame.is_lost:
                self._tips.append(self._tip(frame.position, frame.quaternion))

    def error(self, moment: Moment) -> float:
        """Distance (m) of the newest frames' mean from the reference, by projection; NaN where none follows it."""
        if not self._tips or getattr(moment.task, "phase", "") not in FOLLOWING:
            return nan
        tip = np.mean(self._tips, axis=0)
        return float(self._reference.project(tip).distance[0]) if np.isfinite(tip).all() else nan

    def _tip(self, position: tuple[float, ...], quaternion: tuple[float, ...]) -> np.ndarray:
        """(3,) the tube's axis below the sensor, m, in the frame of the exit."""
        R = self._T[:3, :3]
        place = R @ np.array(position) + self._T[:3, 3]
        turned = R @ _rotation(*quaternion)
        return without_offset(place[None], turned[None], self._tracker)[0]


def _rotation(w: float, x: float, y: float, z: float) -> np.ndarray:
    """(3, 3) of a unit quaternion."""
    axis = hat(np.array([x, y, z]))
    return np.eye(3) + 2.0 * w * axis + 2.0 * axis @ axis
