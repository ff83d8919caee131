"""Load cell and tracker of the virtual bench: what they say of the truth, and when."""

from __future__ import annotations

from collections import deque
from math import exp, nan, sqrt
from typing import TYPE_CHECKING

import numpy as np

from ...rotation import exp_so3
from ..interfaces import Force, PoseFrame
from .injection import InjectionKind

if TYPE_CHECKING:
    from .setup import LoadCellModel, TrackerModel
    from .world import World

LOST = (nan, nan, nan), (nan, nan, nan, nan)
MISSING = "missing"  # what the tracker says of a frame without pose
ROOT3 = sqrt(3.0)


class VirtualLoadCell:
    """A `LoadCell`; it makes one reading per 1 / rate, which stays the same until the next."""

    def __init__(self, model: LoadCellModel, world: World, rng: np.random.Generator) -> None:
        self.model, self._world, self._rng = model, world, rng
        self.full_scale = model.full_scale
        self._drift, self._last = 0.0, (-1, 0.0)
        self._force = Force(time=0.0, tension=0.0)

    def read(self) -> Force:
        """See `LoadCell`."""
        world, kind = self._world, InjectionKind
        world.catch_up()
        world.must_answer("load_cell")
        time = world.time
        if world.schedule.active(kind.CELL_STALE, time):
            return self._force
        reading = self._reading(time)
        if world.schedule.active(kind.CELL_FROZEN, time):
            reading = self._force.tension
        if world.schedule.active(kind.CELL_DEAD, time):
            reading = 0.0
        if jump := world.schedule.active(kind.CELL_JUMP, time):
            reading += jump.value
        if world.schedule.active(kind.CELL_SATURATED, time):
            reading = self.full_scale
        saturated = abs(reading) >= self.full_scale
        reading = max(-self.full_scale, min(self.full_scale, reading))
        if world.schedule.active(kind.CELL_NAN, time):
            reading, saturated = nan, False
        self._force = Force(time=time, tension=reading, saturated=saturated)
        return self._force

    def _reading(self, time: float) -> float:
        m, index = self.model, int(time * self.model.rate + 1e-6)
        before, reading = self._last
        if index == before:
            return reading
        noise, drift = self._rng.standard_normal(2).tolist()
        self._drift += m.drift * sqrt((index - max(before, 0)) / m.rate) * drift
        reading = m.scale * self._world.felt + m.zero + self._drift + m.noise * noise
        if m.resolution:
            reading = round(reading / m.resolution) * m.resolution
        self._last = index, reading
        return reading


class VirtualTracker:
    """A `PoseTracker` with one tool. Frames are taken at their times, and arrive in order, each after its delay.

    A frame's time is what a program can know of it: its arrival less the middle of the delay. Bursts of lost
    frames begin and end as a process without memory (Gilbert's).
    """

    def __init__(self, model: TrackerModel, world: World, rng: np.random.Generator) -> None:
        self.model, self._world, self._rng = model, world, rng
        self.tools, self.rate = (model.name,), model.rate
        self._phase, self._number = float(rng.uniform(0.0, 1.0 / model.rate)), 0
        self._queue: deque[tuple[float, PoseFrame]] = deque()
        self._arrived, self._lost = 0.0, False
        rates = model.burst_rate, _inverse(model.burst_length)
        self._begins, self._ends = (1.0 - exp(-each / model.rate) for each in rates)
        self._offset, self._turn = np.array(model.offset), exp_so3(np.array(model.turn))
        self._field = None if model.T_world_field is None else np.linalg.inv(np.array(model.T_world_field))

    @property
    def next_frame(self) -> float:
        """When the next frame is taken, s."""
        return self._phase + self._number / self.rate

    def capture(self, time: float) -> None:
        """Take the frame that is due; the world stands at its time."""
        chance, late, size = self._rng.uniform(size=3).tolist()
        noise = self._rng.standard_normal(6)
        self._lost = chance < self._begins if not self._lost else chance >= self._ends
        lost = self._lost or self._world.schedule.active(InjectionKind.TRACKER_LOST, time) is not None
        low, high = self.model.delay
        self._arrived = max(self._arrived, time + low + late * (high - low))
        position, quaternion = LOST if lost else self._measured(noise)
        frame = PoseFrame(
            time=max(0.0, self._arrived - 0.5 * (low + high)), frame=self._number, tool=self.model.name,
            position=position, quaternion=quaternion, quality=nan if lost else self.model.quality * (0.5 + size),
            state=MISSING if lost else "",
        )  # fmt: skip
        self._queue.append((self._arrived, frame))
        self._number += 1

    def read(self) -> tuple[PoseFrame, ...]:
        """See `PoseTracker`."""
        self._world.catch_up()
        self._world.must_answer("tracker")
        found = []
        while self._queue and self._queue[0][0] <= self._world.time:
            found.append(self._queue.popleft()[1])
        return tuple(found)

    def _measured(self, noise: np.ndarray) -> tuple:
        """Position and quaternion of the sensor in the tracker's field, with noise (6,)."""
        axis, R = self._world.tip()
        position, R = axis + R @ self._offset, R @ self._turn
        if self._field is not None:
            position, R = self._field[:3, :3] @ position + self._field[:3, 3], self._field[:3, :3] @ R
        position = position + self.model.position_noise / ROOT3 * noise[:3]
        R = R @ exp_so3(self.model.orientation_noise / ROOT3 * noise[3:])
        return tuple(position.tolist()), quaternion_of(R)


def quaternion_of(R: np.ndarray) -> tuple[float, float, float, float]:
    """(w, x, y, z), w >= 0, of a rotation matrix, from its largest component (Shepperd 1978)."""
    a, b, c, t = R[0, 0], R[1, 1], R[2, 2], R[0, 0] + R[1, 1] + R[2, 2]
    squares = np.array([1.0 + t, 1.0 + 2.0 * a - t, 1.0 + 2.0 * b - t, 1.0 + 2.0 * c - t])
    sums = np.array(
        [
            [squares[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [R[2, 1] - R[1, 2], squares[1], R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]],
            [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], squares[2], R[2, 1] + R[1, 2]],
            [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2], squares[3]],
        ]
    )
    row = sums[int(squares.argmax())]
    w, x, y, z = (row / np.linalg.norm(row) * (1.0 if row[0] >= 0.0 else -1.0)).tolist()
    return w, x, y, z


def _inverse(duration: float) -> float:
    return 1.0 / duration if duration > 0.0 else 1e9
