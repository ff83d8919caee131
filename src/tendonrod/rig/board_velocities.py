"""Velocities of the axes on their way to the motor board: gathered, rounded to its units, none kept for too long."""

from __future__ import annotations

from ..errors import InvalidInput, finite
from .board_protocol import AXES, COMMAND_UNITS, NAMES


class Velocities:
    """Velocities on their way to the board, in its whole units.

    What rounding leaves over goes into the axis's next command, so that the mean velocity is the commanded one though
    each command is up to half a unit off. An axis that got no new velocity keeps its last one for as long as the
    watchdog would have let it, and stands still from then on: commands to one axis do not keep another one going.
    """

    def __init__(self) -> None:
        self.watchdog = 0.1  # s
        self._staged: list[float | None] = [None] * AXES
        self.forget()

    def forget(self) -> None:
        """Stand still: nothing staged, nothing left over."""
        self._staged[:] = [None] * AXES
        self._sent, self._carried, self._times = [0] * AXES, [0.0] * AXES, [-float("inf")] * AXES

    @property
    def any_staged(self) -> bool:
        """Whether a velocity waits to be sent."""
        return self._staged != [None] * AXES

    def is_staged(self, axis: int) -> bool:
        """Whether this axis's does."""
        return self._staged[axis] is not None

    def is_moving(self, axis: int) -> bool:
        """Whether the last command sent told the axis to move."""
        return self._sent[axis] != 0

    def stage(self, axis: int, velocity: float, now: float) -> bool:
        """Set one velocity (SI); whether all axes have theirs now. Raises `InvalidInput` for NaN and infinity."""
        try:
            self._staged[axis] = finite(f"velocity of {NAMES[axis]}", velocity)
        except InvalidInput:
            self._staged[:] = [None] * AXES  # nothing of a command that is bad in part goes out
            raise
        self._times[axis] = now
        return None not in self._staged

    def take(self, now: float, fastest: list[int]) -> list[int]:
        """The arguments of MOVE; speeds beyond the board's limits are cut to them."""
        for axis, velocity in enumerate(self._staged):
            if velocity is not None:
                self._sent[axis] = self._rounded(axis, velocity, fastest[axis])
            elif now - self._times[axis] > self.watchdog:
                self._sent[axis] = 0
        self._staged[:] = [None] * AXES
        return list(self._sent)

    def _rounded(self, axis: int, velocity: float, fastest: int) -> int:
        exact = min(max(velocity * COMMAND_UNITS[axis], -fastest), fastest)
        wanted = exact + self._carried[axis] if exact else 0.0
        units = min(max(round(wanted), -fastest), fastest)
        self._carried[axis] = min(max(wanted - units, -0.5), 0.5)
        return units
