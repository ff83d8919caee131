"""`Limits`: what a bench may do, with the reasons for ExoNav's defaults. It knows no rods: `rig.model_limits` does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf, isnan, pi, sqrt

from ..errors import InvalidInput, positive, whole, within
from .interfaces import AxisLimits

LATENCY = 2  # control periods from a command to its effect, with which delays and stopping distances are reckoned
AXES = ("screw", "translation", "rotation")
NUMBERS = (
    "tension", "slack", "tension_rate", "rate_window", "lost_pull", "take_up", "strain", "length", "full_scale",
    "sensor_age", "tracker_time", "stall_time", "command_timeout", "period", "release_rate", "release_travel",
    "patience",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What a bench may do before its interlock steps in; SI. Triples are for (screw, translation, rotation).

    Of the tendon and the robot:
    - tension: 1.0 N. ExoNav 1 leaves linear elasticity at 1.09 N (docs/limitations) and is meant for 0.7 N; the other
      prototypes bear more, see `rig.model_limits.bench_limits`. soft: share of it, and of the strain, above which no
      motion that raises tension gets through. slack: 0.05 N, below which the tendon counts as slack: three to four
      times the noise of a 22 N cell (0.05 % of full scale, 11 mN), and below the 67 mN at which the tendon lifts off.
    - tension_rate: 15 N/s over rate_window, 20 ms. Even screw and translation at full speed against each other (8 mm/s)
      on the bare tendon (0.51 mm/N, 0.3 m of 0.1 mm nitinol) make about this: beyond it something broke, slipped or
      jumped. The noise of the cell makes 0.8 N/s. A tendon that breaks shows if it held more than 0.3 N.
    - lost_pull: 0.3 mm by which a tendon that was taut may be pulled further without a tension that shows, before it
      counts as broken or the cell as dead: three times the play of a printed roller gear, in which nothing is pulled.
      Half of it is what a reading may stay the same to the last bit for.
    - take_up: 0.8 mm by which the tendon may be pulled in all before its tension shows first. 0.1 N shows on ExoNav 1
      after 0.1 to 0.4 mm, and play and references add 0.2 mm. A cell that is dead from the beginning lets the tension
      rise by what this pull gives, 1.2 N on a robot that is hardly out (0.65 mm/N): where the tendon hangs slack by
      more at the references, set the references rather than this.
    - strain: 0.67 %, where nitinol leaves linear elasticity (500 MPa / 75 GPa). length: m, exposed at insertion 1, by
      which the strain's insertion is counted.
    - full_scale: 22.24 N, the 5 lbf of the paper's MDB-5; a reading from 98 % of it counts as saturated.

    Of the axes: travel, speed and acceleration, each narrowed by what the device itself allows.
    - screw: pays out 0.974 mm per mm of insertion, 74 mm for all of ExoNav 1, and 10 mm more to go slack; back 20 mm to
      take slack up. 3 mm/s: it is the slow one of the paper's bench, and most devices narrow this further.
    - translation: from the exit to the whole robot; 5 mm/s, which the paper's kP reaches at an error of 0.1 N.
    - rotation: a helix of one turn needs -2 pi to 0; half a turn more on either side is for the plan's rotation.
    - overrun: by how much travel may be passed (stopping, resolution) before it is a fault. speed_margin: measured
      speed, as a multiple of the limit. jump: what an encoder may differ by from any possible motion. lag: by how much
      an axis may be off its command, its stated acceleration and two periods of delay, as long as they were, allowed
      for; older motion is forgotten with stall_time. They find an axis that stands still in a follow-the-leader trial
      at 0.5 mm/s.

    Of time: sensor_age 50 ms (ten periods at 200 Hz). tracker_time 1 s, 40 frames at 40 Hz: the tracker measures and
    does not control, so that waiting costs what is inserted blindly meanwhile, 0.45 mm at the usual rate, and not
    waiting a trial, wherever a burst of frames is lost, which is normal. No source gives the lengths of an EM tracker's
    bursts: with the virtual one's own estimate (0.1 s on average, 0.05 per second of sight) and its delay, 0.5 s would
    end one trial of 155 s in ten, 1 s ends one in 2,500. command_timeout 0.1 s, as the board's watchdog has it. period:
    of the loop, s; a period is late above late_share of it, and late_in_row of them in a row are a fault.

    Of the release: the screw pays out at release_rate (as fast as it can, if that is less) until slack, for no longer
    than release_travel takes. 8 mm is twice what ExoNav 1 and its tendon give at 1 N.

    patience: s without progress, after which a task counts as stuck, where a limit stands in its way for instance: far
    more than any phase stands still, and no danger meanwhile, as all other limits hold.

    Raises `InvalidInput` by field.
    """

    tension: float = 1.0
    soft: float = 0.9
    slack: float = 0.05
    tension_rate: float = 15.0
    rate_window: float = 0.02
    lost_pull: float = 0.3e-3
    take_up: float = 0.8e-3
    strain: float = 6.67e-3
    length: float = 75.4e-3
    full_scale: float = 22.24
    screw: AxisLimits = field(default_factory=lambda: AxisLimits(low=-20e-3, high=100e-3, speed=3e-3))
    translation: AxisLimits = field(default_factory=lambda: AxisLimits(low=0.0, high=76e-3, speed=5e-3))
    rotation: AxisLimits = field(default_factory=lambda: AxisLimits(low=-3 * pi, high=pi, speed=2.0))
    overrun: tuple[float, float, float] = (0.5e-3, 0.5e-3, 0.05)
    speed_margin: float = 1.25
    jump: tuple[float, float, float] = (0.5e-3, 0.5e-3, 0.1)
    lag: tuple[float, float, float] = (0.03e-3, 0.05e-3, 0.01)
    sensor_age: float = 0.05
    tracker_time: float = 1.0
    stall_time: float = 0.5
    command_timeout: float = 0.1
    period: float = 5e-3
    late_share: float = 1.5
    late_in_row: int = 5
    release_rate: float = 3e-3
    release_travel: float = 8e-3
    patience: float = 120.0

    def __post_init__(self) -> None:
        for name in NUMBERS:
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        within("soft", self.soft, 0.05, 1.0)
        within("speed_margin", self.speed_margin, 1.0, 10.0)
        within("late_share", self.late_share, 1.0, 100.0)
        whole("late_in_row", self.late_in_row, 1)
        if not self.slack < self.soft * self.tension:
            raise InvalidInput("slack", self.slack, f"below soft * tension = {self.soft * self.tension:.4g}")
        if not self.release_rate <= self.screw.speed:
            raise InvalidInput("release_rate", self.release_rate, f"at most screw.speed = {self.screw.speed:.4g}")
        for name in AXES:
            _check_axis(name, getattr(self, name))
        for name in ("overrun", "jump", "lag"):
            object.__setattr__(self, name, _triple(name, getattr(self, name)))

    @property
    def axes(self) -> tuple[AxisLimits, AxisLimits, AxisLimits]:
        """Of lead screw, translation, rotation."""
        return self.screw, self.translation, self.rotation

    @property
    def release_timeout(self) -> float:
        """Longest time of a release, s: its travel, and half a second to get going."""
        return self.release_travel / self.release_rate + 0.5

    def narrowed(self, axes: Sequence[AxisLimits], full_scale: float = inf) -> Limits:
        """These limits as far as devices with ``axes`` (screw, translation, rotation) and ``full_scale`` (N) allow."""
        narrow = dict(zip(AXES, map(_narrower, self.axes, axes), strict=True))
        return replace(
            self, **narrow,
            full_scale=min(self.full_scale, full_scale), release_rate=min(self.release_rate, narrow["screw"].speed),
        )  # fmt: skip


def room_speed(room: float, acceleration: float, delay: float) -> float:
    """The speed (per s) from which an axis comes to rest within ``room`` (m or rad), ``delay`` (s) after the command.

    From v delay + v^2 / (2 acceleration) = room; 0 where there is no room.
    """
    if not room > 0.0:
        return 0.0
    if acceleration == inf:
        return room / delay
    return 2.0 * room / (delay + sqrt(delay * delay + 2.0 * room / acceleration))


def _narrower(mine: AxisLimits, device: AxisLimits) -> AxisLimits:
    return AxisLimits(
        low=max(mine.low, device.low), high=min(mine.high, device.high),
        speed=min(mine.speed, device.speed), acceleration=min(mine.acceleration, device.acceleration),
    )  # fmt: skip


def _check_axis(name: str, axis: AxisLimits) -> None:
    if not isinstance(axis, AxisLimits):
        raise InvalidInput(name, axis, "AxisLimits")
    if not axis.low < axis.high:
        raise InvalidInput(name, (axis.low, axis.high), "a travel whose low end is below its high end")
    positive(f"{name}.speed", axis.speed)
    if isnan(axis.acceleration) or axis.acceleration <= 0.0:
        raise InvalidInput(f"{name}.acceleration", axis.acceleration, "> 0")


def _triple(name: str, values: object) -> tuple[float, float, float]:
    if not isinstance(values, Sequence) or len(values) != 3:
        raise InvalidInput(name, values, "three numbers: screw, translation, rotation")
    first, second, third = (positive(f"{name}[{i}]", each) for i, each in enumerate(values))
    return first, second, third
