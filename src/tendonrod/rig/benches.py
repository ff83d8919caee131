"""Which bench: `VirtualSource` and `DeviceSource` open one for each trial, and know what its record must say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..errors import InvalidInput
from ..loads import LumpedMass
from ..measurement.trial import ROBOT, Tracker
from ..robot import Robot, as_robot
from .clock import SystemClock
from .interfaces import Bench, DeviceError

if TYPE_CHECKING:
    from .board_devices import BoardLoadCell, Calibration
    from .virtual.setup import VirtualSetup

TARED = 0.2  # N: a zero that is further off is a tendon that is not slack, or another calibration
Vector = tuple[float, float, float]


class BenchSource(Protocol):
    """What trials need of a bench that is not open yet.

    limits: fields of `Limits` that differ from the model's; of an axis, the fields of its `AxisLimits` that do.
    """

    @property
    def robot(self) -> Robot: ...
    @property
    def gravity(self) -> Vector: ...
    @property
    def trackers(self) -> tuple[Tracker, ...]: ...
    @property
    def limits(self) -> Mapping[str, Any]: ...

    def open(self, seed: int) -> Bench:
        """The bench; whoever opens it closes it. Raises `InvalidInput`, `DeviceError`."""
        ...

    def known(self, seed: int) -> dict[str, Any]:
        """For the record's header."""
        ...


def loads_of(source: BenchSource) -> tuple[LumpedMass, ...]:
    """What hangs on the robot beside itself: the trackers' masses."""
    return masses_of(source.trackers)


def masses_of(trackers: Sequence[Tracker]) -> tuple[LumpedMass, ...]:
    """The masses of those that sit on the robot."""
    on_it = [each for each in trackers if each.on == ROBOT and each.mass > 0.0]
    return tuple(LumpedMass(mass=each.mass, at=each.at, offset=each.arm) for each in on_it)


@dataclass(frozen=True, kw_only=True)
class VirtualSource:
    """A virtual bench, faster than real time or in step with it; ahead: s, see `VirtualClock`.

    With ``ahead`` below half a control period no busy machine makes the periods late: the bench is slower instead.
    """

    setup: VirtualSetup
    real_time: bool = False
    ahead: float = inf
    limits: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def robot(self) -> Robot:
        """The robot, with its torsion model."""
        return self.setup.robot

    @property
    def gravity(self) -> Vector:
        """m/s2, world frame."""
        return self.setup.gravity

    @property
    def trackers(self) -> tuple[Tracker, ...]:
        """The one at the tip, if any."""
        sensor = self.setup.tracker
        if sensor is None:
            return ()
        return (Tracker(name=sensor.name, offset=sensor.offset, turn=sensor.turn, mass=sensor.mass),)

    def open(self, seed: int) -> Bench:
        """See `BenchSource`; the same seed gives the same bench."""
        from .virtual.bench import virtual_bench

        return virtual_bench(self.setup, seed, self.real_time, self.ahead)

    def known(self, seed: int) -> dict[str, Any]:
        """See `BenchSource`; "setup" has every number of it."""
        parts = {each.name: _plain(getattr(self.setup, each.name)) for each in fields(self.setup)}
        del parts["robot"]
        said = {"notes": "Virtual bench, not a measurement.", "virtual": True, "seed": seed, "setup": parts}
        if self.setup.tracker is None:
            return said
        rows = self.setup.tracker.T_world_field
        return said | {"T_world_field": (np.eye(4) if rows is None else np.array(rows)).tolist()}


@dataclass(frozen=True, kw_only=True)
class DeviceSource:
    """A bench of devices: a motor board, and an Aurora where ``aurora`` is given.

    launchpad: arguments of `LaunchPad` ("port" and others), aurora: of `Aurora`, both but for the clock. calibration:
    of the load cell; tare_readings: how many are taken for its zero before homing, with a slack tendon, 0 for none.
    trackers: the tools and their holders. T_world_field: (4, 4) as rows, None where nobody knows. is_rehearsal: whether
    an emulated board stands in for the real one, see `rehearsed`. Raises `InvalidInput` for another than one tendon.
    """

    robot: Robot
    gravity: Vector
    launchpad: Mapping[str, Any]
    calibration: Calibration
    tare_readings: int = 0
    aurora: Mapping[str, Any] | None = None
    trackers: tuple[Tracker, ...] = ()
    T_world_field: tuple[tuple[float, ...], ...] | None = None
    limits: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    is_rehearsal: bool = False

    def __post_init__(self) -> None:
        if as_robot(self.robot).n_tendons != 1:
            raise InvalidInput("robot", f"{self.robot.name} with {self.robot.n_tendons} tendons", "of one tendon")

    def check_port(self) -> None:
        """Raise `DeviceError` where the board's port cannot be opened now; nothing is said to the board."""
        from .launchpad import BAUD
        from .serial_port import close_port, open_port

        close_port(open_port(self.launchpad["port"], self.launchpad.get("baud", BAUD)))

    def open(self, seed: int = 0) -> Bench:
        """See `BenchSource`; real devices have no seed. What was opened is closed again where another fails."""
        from .launchpad import LaunchPad

        clock = SystemClock()
        with ExitStack() as opened:
            board = LaunchPad(**self.launchpad, now=clock.now, calibration=self.calibration)
            opened.callback(board.close)
            if self.tare_readings:
                tare(board.load_cell, self.tare_readings)
            tracker = self._tracker(clock)
            opened.pop_all()
        kind = "rehearsal without hardware, not a measurement; " if self.is_rehearsal else ""
        robot, port = f"{self.robot.name}, torsion {self.robot.torsion}", self.launchpad["port"]
        name = f"{kind}bench of {robot}: {board.firmware} at {port}"
        axes = {"screw": board.screw, "translation": board.translation, "rotation": board.rotation}
        return Bench(
            name=name if tracker is None else f"{name}, {tracker.firmware.strip().splitlines()[0]}",
            **axes, load_cell=board.load_cell, tracker=tracker, clock=clock,
        )  # fmt: skip

    def _tracker(self, clock: SystemClock) -> Any:
        if self.aurora is None:
            return None
        from .aurora import Aurora

        return Aurora(**self.aurora, now=clock.now)

    def known(self, seed: int = 0) -> dict[str, Any]:
        """See `BenchSource`."""
        said = {"virtual": False, "launchpad": dict(self.launchpad), "calibration": asdict(self.calibration)}
        if self.is_rehearsal:
            said |= {"rehearsal": True, "notes": "Rehearsal on an emulated board, not a measurement."}
        if self.aurora is not None:
            said["aurora"] = {name: str(value) for name, value in self.aurora.items()}
        return said | ({} if self.T_world_field is None else {"T_world_field": [*map(list, self.T_world_field)]})


def rehearsed(source: DeviceSource, port: str) -> DeviceSource:
    """The same bench with the emulated board at ``port``, as `firmware.rehearsal` runs it, and without its tracker.

    The load cell is the emulated one, with its calibration; limits, tools and their masses are the bench's own.
    """
    from .board_devices import Calibration

    cell = Calibration(full_scale=source.calibration.full_scale)
    board = MappingProxyType({**source.launchpad, "port": port})
    return replace(source, launchpad=board, aurora=None, calibration=cell, is_rehearsal=True)


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return asdict(value) if is_dataclass(value) and not isinstance(value, (type, Robot)) else value


def tare(cell: BoardLoadCell, readings: int) -> None:
    """Take the load cell's zero from ``readings`` of a slack tendon. Raises `DeviceError` where it can't be slack."""
    tension = cell.read().tension
    if not abs(tension) <= TARED:
        raise DeviceError(
            f"load cell: {tension:.3g} N before taring, must be within {TARED:g} N: "
            "let the tendon go slack, or correct zero_counts and counts_per_newton"
        )
    cell.tare(readings)


def as_source(bench: BenchSource | VirtualSetup, real_time: bool = False) -> BenchSource:
    """A virtual setup as the source of such benches; a source as it is."""
    from .virtual.setup import VirtualSetup

    if isinstance(bench, VirtualSetup):
        return VirtualSource(setup=bench, real_time=real_time)
    if real_time:
        raise InvalidInput("real_time", True, "left out with a source, which says so itself")
    return bench
