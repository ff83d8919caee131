"""The devices behind a motor board: axes and load cell as the bench knows them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import InvalidInput, finite, positive, whole
from .board_protocol import COMMAND_UNITS, NAMES, STATE_UNITS, Flag
from .interfaces import AxisLimits, AxisState, Force

if TYPE_CHECKING:
    from .launchpad import LaunchPad


@dataclass(frozen=True, kw_only=True, slots=True)
class Calibration:
    """Load cell behind its amplifier: tension = (counts - zero) / counts_per_newton.

    The defaults are those of the emulated board, 22.24 N (5 lbf, as the paper's MDB-5) over a 16-bit converter; a real
    bench is calibrated with weights, and its zero set by `BoardLoadCell.tare`.
    """

    counts_per_newton: float = 1349.0
    zero: float = 32768.0
    full_scale: float = 22.24  # N

    def __post_init__(self) -> None:
        if finite("counts_per_newton", self.counts_per_newton) == 0.0:
            raise InvalidInput("counts_per_newton", 0.0, "finite and not zero (negative where tension lowers them)")
        finite("zero", self.zero)
        positive("full_scale", self.full_scale)


class BoardAxis:
    """One axis of the board, an `interfaces.Axis`."""

    def __init__(self, board: LaunchPad, index: int) -> None:
        self.name, self._board, self._index = NAMES[index], board, index
        low, high, speed, acceleration = (each / COMMAND_UNITS[index] for each in board.limits.axes[index])
        self.limits = AxisLimits(low=low, high=high, speed=speed, acceleration=acceleration)

    def read(self) -> AxisState:
        """The newest state. Raises `DeviceError` where the board does not answer."""
        at, i = self._board.read(self.name), self._index
        state = at.state
        return AxisState(
            time=at.time,
            position=state.positions[i] / STATE_UNITS[i],
            velocity=state.velocities[i] / STATE_UNITS[i],
            homed=state.has(Flag.HOMED, i),
            at_limit=state.has(Flag.HIGH, i) - state.has(Flag.LOW, i),
            stalled=state.has(Flag.STALLED, i),
        )

    def move(self, velocity: float) -> None:
        """Move at ``velocity`` (m/s or rad/s), cut to the axis's speed, until the next command; a stalled axis stands
        still until the board is stopped. Raises `InvalidInput` for NaN, `DeviceError` where the board refuses."""
        self._board.move(self._index, velocity)

    def stop(self) -> None:
        """Stop, and the other axes of the board with it."""
        self._board.stop()

    def home(self, should_stop: Callable[[], bool] | None = None) -> None:
        """Stop all axes, find the reference switch and make it zero; blocks until done, or until ``should_stop`` says
        so, which stops the axes and leaves this one not homed. Raises `DeviceError`."""
        self._board.home(self._index, should_stop)

    def close(self) -> None:
        """Let the whole board go."""
        self._board.close()


class BoardLoadCell:
    """The load cell of the board, an `interfaces.LoadCell`."""

    def __init__(self, board: LaunchPad, calibration: Calibration) -> None:
        self._board, self._calibration, self._zero = board, calibration, calibration.zero
        self.full_scale = calibration.full_scale

    def read(self) -> Force:
        """The newest reading. Raises `DeviceError`."""
        at = self._board.read("load cell")
        low, high = self._board.limits.counts
        tension = (at.state.counts - self._zero) / self._calibration.counts_per_newton
        is_railed = not low < at.state.counts < high
        return Force(time=at.time, tension=tension, saturated=is_railed or abs(tension) > self.full_scale)

    def tare(self, readings: int = 100) -> float:
        """Take the mean of ``readings`` states, with the tendon slack, for zero tension; the new zero in counts."""
        count = whole("readings", readings, 1)
        self._zero = sum(self._read_counts() for _ in range(count)) / count
        return self._zero

    def _read_counts(self) -> int:
        return self._board.read("load cell").state.counts

    def close(self) -> None:
        """Let the whole board go."""
        self._board.close()
