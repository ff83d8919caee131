"""`LiveShape`: what a bench does, to 3D Slicer as it happens: the model's shape at each moment, the tracker's poses.

The shape is the model's for the insertion, rotation and tension that were measured, in the frame of the outer tube's
exit, in which gravity is given too; the poses are in the tracker's own. Where it is known how the two lie to each other
that goes out as a transform, by which Slicer shows both together.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import isfinite, pi
from threading import Event, Thread
from time import monotonic

import numpy as np

from ..errors import InvalidInput
from ..loads import Load
from ..robot import Robot
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from .igtl import NAME_LONGEST, SlicerStream
from .interfaces import Sample
from .loop import Moment

EVERY = 0.1  # s between two shapes
POINTS = 41
ROUGH = 1e-5  # m: what the eye sees, a tenth of a millimetre, ten times over
ROBOT, TRACKER, PLACED = "robot", "Tracker", "TrackerToExit"


class LiveShape:
    """Shows a bench to the clients of ``stream``; `watch` is what the control loop calls. A context.

    A thread solves the shapes: with a mass at the tip one takes up to 10 ms, most of it without Python's lock.

    robot, gravity (m/s2) and loads: of the model. tools: names of the tracker's. T_world_field: (4, 4), the tracker's
    frame in that of the exit, None where nobody knows. Raises `InvalidInput` for a tool whose name is too long.
    """

    def __init__(
        self, stream: SlicerStream, robot: Robot, gravity: Sequence[float] = (0.0, 0.0, 0.0), *,
        loads: Sequence[Load] = (), tools: Sequence[str] = (), T_world_field: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        for tool in tools:
            if len(f"{tool}To{TRACKER}".encode()) > NAME_LONGEST:
                raise InvalidInput("tool", tool, f"a name of {NAME_LONGEST - len(f'To{TRACKER}')} bytes at most")
        self._stream, self._robot, self._loads = stream, robot, tuple(loads)
        x, y, z = gravity
        self._gravity = (float(x), float(y), float(z))
        self._T = None if T_world_field is None else np.array(T_world_field, dtype=float)
        self._before = self.shape(0.5 * robot.section.L, 0.0, 0.1)  # what compiling there is to be done is done now
        self._newest: Sample | None = None
        self._shown, self._is_due, self._is_open = -EVERY, Event(), True
        self._thread = Thread(target=self._show_on, name="live shape", daemon=True)
        self._thread.start()

    def __enter__(self) -> LiveShape:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Show nothing more; a second time does nothing."""
        self._is_open = False
        self._is_due.set()
        self._thread.join()

    def watch(self, moment: Moment) -> None:
        """Send a moment's poses, and every `EVERY` s have its shape sent. Raises nothing and waits for nobody."""
        if not self._stream.clients:
            return
        with suppress(Exception):  # a picture that fails must not end a trial
            self._stream.send_frames(moment.sample.frames, TRACKER)
            now = monotonic()
            if now - self._shown >= EVERY:
                self._shown, self._newest = now, moment.sample
                self._is_due.set()

    def shape(self, translation: float, rotation: float, tension: float, start: Shape | None = None) -> Shape:
        """The model's for the axes' positions (m, rad) and a tension (N); slack where the cell says less than nothing.

        The section at the exit has turned by the motor's angle less the helix's. Does not raise where there is no
        equilibrium: `Shape.status` tells. start: a shape that is near.
        """
        robot = self._robot
        eta = min(max(translation / robot.section.L, 0.0), 1.0)
        turned = rotation - 2.0 * pi * robot.turns * (eta - 1.0)
        return solve(
            robot, max(tension, 0.0), self._gravity, insertion=eta, rotation=turned, loads=self._loads, start=start,
            s=np.linspace(0.0, eta * robot.length_na, POINTS), accuracy=ROUGH, throw=False,
        )  # fmt: skip

    def _show_on(self) -> None:
        """In the background: the newest sample's shape, each time that one is due."""
        while self._is_due.wait() and self._is_open:
            self._is_due.clear()
            with suppress(Exception):  # as above
                if self._newest is not None:
                    self._show(self._newest)

    def _show(self, sample: Sample) -> None:
        if self._T is not None:
            self._stream.send_transform(PLACED, self._T)
        at = sample.translation.position, sample.rotation.position, sample.force.tension
        if not all(map(isfinite, at)):
            return
        found = self.shape(*at, start=self._before)
        if found.converged:
            self._before = found
            self._stream.send_shape(ROBOT, found.centerline)
