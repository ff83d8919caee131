"""`VirtualSetup`: what a virtual bench is built of, every number with its unit and where its default comes from.

Defaults marked "own estimate" stand in no source: they are of the right order, and are there to be changed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, pi, radians

from ...errors import InvalidInput, finite, nonnegative, numbers, one_of, positive, vector
from ...robot import Robot, as_robot
from .injection import Injection

MECHANICS = ("table", "engine")
SIDES = ("free", "low", "high")


def _set(owner: object, name: str, value: object) -> None:
    object.__setattr__(owner, name, value)


def _is_a(name: str, value: object, kind: type) -> None:
    if not isinstance(value, kind):
        raise InvalidInput(name, value, f"of the type {kind.__name__}")


@dataclass(frozen=True, kw_only=True)
class AxisModel:
    """A geared motor with an encoder on the motor's side of the play; m and s, or rad and s.

    speed, acceleration: largest of motion. braking: deceleration of a stop (a geared small motor stands almost at
    once). backlash: whole play between motor and load. pressed: flank of the play on which a taut tendon holds the load
    ("low", "high"), "free" if it does not. resolution: one count of the encoder. home_error: standard deviation of
    where homing finds the reference. low, high: hard stops, in true positions. start: true position when switched on.
    """

    speed: float
    acceleration: float
    braking: float
    backlash: float = 0.0
    pressed: str = "free"
    resolution: float = 0.0
    home_error: float = 0.0
    low: float = -inf
    high: float = inf
    start: float = 0.0

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "braking"):
            _set(self, name, positive(name, getattr(self, name)))
        for name in ("backlash", "resolution", "home_error"):
            _set(self, name, nonnegative(name, getattr(self, name)))
        one_of("pressed", self.pressed, SIDES)
        _set(self, "start", finite("start", self.start))
        if not self.low < self.high:
            raise InvalidInput("low", self.low, f"< high = {self.high!r}")
        if not self.low <= self.start <= self.high:
            raise InvalidInput("start", self.start, f"from low = {self.low!r} to high = {self.high!r}")


def lead_screw(**changes) -> AxisModel:
    """The lead screw: slow, without play while the tendon pulls its nut on one flank (outwards).

    Own estimate for the paper's motor (maxon RE 8, 0.5 W): with a gear of 256:1 (12,000 to 47 turns a minute) and
    0.5 mm of lead it runs 0.4 mm/s, here 0.5; the resolution is a coarse 1 um. ``changes``: fields of `AxisModel`.
    """
    return replace(SCREW, **changes)


def roller_translation(**changes) -> AxisModel:
    """Translation by the 3D-printed roller gear: faster, with play; a taut tendon holds the tube on the rear flank.

    Own estimate: 0.1 mm of play is common between printed teeth of module 0.5; the resolution is 5 um.
    """
    return replace(TRANSLATION, **changes)


def roller_rotation(**changes) -> AxisModel:
    """Rotation by the same gear; own estimate: 1 degree of play (0.1 mm on a radius of 6 mm), 0.05 degree of count."""
    return replace(ROTATION, **changes)


SCREW = AxisModel(
    speed=0.5e-3, acceleration=5e-3, braking=50e-3, backlash=20e-6, pressed="high", resolution=1e-6,
    home_error=10e-6, low=-30e-3, high=110e-3,
)  # fmt: skip
TRANSLATION = AxisModel(
    speed=5e-3, acceleration=50e-3, braking=200e-3, backlash=0.1e-3, pressed="low", resolution=5e-6,
    home_error=50e-6, low=-10e-3, high=110e-3,
)  # fmt: skip
ROTATION = AxisModel(
    speed=2.0, acceleration=20.0, braking=100.0, backlash=radians(1.0), resolution=radians(0.05),
    home_error=radians(0.3), low=-6.0 * pi, high=6.0 * pi,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class LoadCellModel:
    """A load cell; reading = scale * (tension, low-passed) + zero + drift + noise, in counts of ``resolution``.

    full_scale: N; 22.24 is the paper's MDB-5 (5 lbf). noise: N, standard deviation of a reading; drift: N per square
    root of a second, random walk; zero: N, what taring left; scale: 1 is true; bandwidth: Hz, of its amplifier, first
    order; rate: readings per second. Own estimates: noise 0.02 % of full scale, drift 2 mN in ten minutes (0.01 % of
    full scale per degree), one of 65,536 counts of a converter of 16 bits over both signs.
    """

    full_scale: float = 22.24
    noise: float = 5e-3
    drift: float = 1e-4
    zero: float = 0.0
    scale: float = 1.0
    resolution: float = 0.68e-3
    bandwidth: float = 100.0
    rate: float = 1000.0

    def __post_init__(self) -> None:
        for name in ("full_scale", "scale", "bandwidth", "rate"):
            _set(self, name, positive(name, getattr(self, name)))
        for name in ("noise", "drift", "resolution"):
            _set(self, name, nonnegative(name, getattr(self, name)))
        _set(self, "zero", finite("zero", self.zero))


@dataclass(frozen=True, kw_only=True)
class TrackerModel:
    """An electromagnetic tracker at the robot's tip, with its holder.

    rate: frames per second. position_noise: m, root mean square of the error's length; orientation_noise: rad, of its
    angle: the Aurora's figures for sensors of six freedoms are near 0.5 mm and 0.3 degree, taken wholly as white
    noise. delay: s, from and to, between a frame and its arrival. burst_rate: bursts of lost frames per second of
    sight, burst_length: s, their mean length (own estimates). mass: kg, of sensor and holder, 0 unless it is known
    (0.5 g moves the tip of prototype 1 by 14 to 18 mm). offset: m, of the sensor from the tube's axis at the tip, in
    the section's frame. turn: rotation vector (rad) of the sensor in the section's frame. quality: m, mean of the
    error indicator. T_world_field: (4, 4) as rows, where the tracker's field stands in the world.
    """

    name: str = "tip"
    rate: float = 40.0
    position_noise: float = 0.5e-3
    orientation_noise: float = radians(0.3)
    delay: tuple[float, float] = (0.025, 0.050)
    burst_rate: float = 0.05
    burst_length: float = 0.1
    mass: float = 0.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quality: float = 0.2e-3
    T_world_field: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput("name", self.name, "a text that is not empty")
        _set(self, "rate", positive("rate", self.rate))
        for name in ("position_noise", "orientation_noise", "burst_rate", "burst_length", "mass", "quality"):
            _set(self, name, nonnegative(name, getattr(self, name)))
        for name, size in (("delay", 2), ("offset", 3), ("turn", 3)):
            _set(self, name, tuple(vector(name, getattr(self, name), size).tolist()))
        if not 0.0 <= self.delay[0] <= self.delay[1]:
            raise InvalidInput("delay", self.delay, "two times, 0 <= from <= to")
        if self.T_world_field is not None:
            from ...statics.arguments import rigid_motion

            rows = rigid_motion("T_world_field", numbers("T_world_field", self.T_world_field, 2))
            _set(self, "T_world_field", tuple(tuple(row) for row in rows.tolist()))


@dataclass(frozen=True, kw_only=True)
class VirtualSetup:
    """A virtual bench; SI. Frozen, comparable, and the whole of what a trial depends on beside its seed.

    robot: of one tendon. Its torsion model is the caller's choice: the paper's, which presets carry, is 27 to 118 times
    too stiff; benches use ``load_robot(name).replace(torsion="homogenized")``. Stiffness, length and friction of its
    tendon are those given here.
    gravity: (3,) m/s2, world frame. exit_tilt: (2,) rad, of the robot in the outer tube's exit.
    tendon_stiffness: EA, N; 589 is 0.1 mm of nitinol at 75 GPa. tendon_length: m, from load cell to anchor.
    tendon_friction: Coulomb coefficient between tendon and tube; own estimate, of which 0.1 to 0.2 is the usual range.
    slack: m, pulled length missing when all axes stand at 0; the tendon is taut from there on.
    outer_friction: N, Coulomb friction of the robot in the outer tube; own estimate, 0.2 times the normal force of
    prototype 1 at 0.7 N, whose moment M = 0.6 N mm the tube holds straight: about (2 pi / L)^2 M L / 2 = 0.16 N along
    half its length and 2 pi M / L = 0.05 N at the exit.
    command_timeout: s after the last command, when an axis stops by itself.
    mechanics: "table" (fast) or "engine" (a static solve per step); see `mechanics`. highest_tension: N, up to which
    the table holds; above it the tendon's path shortens on at the same rate and the shape stays.
    injections: what goes wrong, and when.
    """

    robot: Robot
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    exit_tilt: tuple[float, float] = (0.0, 0.0)
    tendon_stiffness: float = 589.0
    tendon_length: float = 0.3
    tendon_friction: float = 0.1
    slack: float = 0.0
    outer_friction: float = 0.05
    screw: AxisModel = field(default_factory=lead_screw)
    translation: AxisModel = field(default_factory=roller_translation)
    rotation: AxisModel = field(default_factory=roller_rotation)
    load_cell: LoadCellModel = field(default_factory=LoadCellModel)
    tracker: TrackerModel | None = field(default_factory=TrackerModel)
    command_timeout: float = 0.1
    mechanics: str = "table"
    highest_tension: float = 1.5
    injections: tuple[Injection, ...] = ()

    def __post_init__(self) -> None:
        if as_robot(self.robot).n_tendons != 1:
            raise InvalidInput("robot", f"{self.robot.name} with {self.robot.n_tendons} tendons", "of one tendon")
        for name, size in (("gravity", 3), ("exit_tilt", 2)):
            _set(self, name, tuple(vector(name, getattr(self, name), size).tolist()))
        for name in ("tendon_stiffness", "tendon_length", "command_timeout", "highest_tension"):
            _set(self, name, positive(name, getattr(self, name)))
        for name in ("tendon_friction", "outer_friction"):
            _set(self, name, nonnegative(name, getattr(self, name)))
        _set(self, "slack", finite("slack", self.slack))
        one_of("mechanics", self.mechanics, MECHANICS)
        path = float(self.robot.tendon_lengths[0])
        if self.tendon_length <= path:
            raise InvalidInput("tendon_length", self.tendon_length, f"> {path:.6g} m, its path in the robot")
        self._check_parts()

    def _check_parts(self) -> None:
        for name in ("screw", "translation", "rotation"):
            _is_a(name, getattr(self, name), AxisModel)
        _is_a("load_cell", self.load_cell, LoadCellModel)
        if self.tracker is not None:
            _is_a("tracker", self.tracker, TrackerModel)
        _set(self, "injections", tuple(self.injections))
        for i, each in enumerate(self.injections):
            _is_a(f"injections[{i}]", each, Injection)
