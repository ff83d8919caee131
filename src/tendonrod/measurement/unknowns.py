"""What may be identified: every number of `Setup` and of the robot; the unit it is told in, and what is plausible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, radians

from ..errors import InvalidInput
from ..parameters import TENDON_KEYS, body_keys, tendon_names
from ..robot import Robot
from .setup import BENCH, NOT_BELOW_ZERO, Setup, the_robot
from .trial import Trial

_UNITS = {  # of a robot file's key: (as told, per SI unit)
    "mm": ("mm", 1e3),
    "mm2": ("mm2", 1e6),
    "mm4": ("mm4", 1e12),
    "gpa": ("GPa", 1e-9),
    "deg": ("deg", 1.0 / radians(1.0)),
    "m3": ("kg/m3", 1.0),
    "m": ("1/m", 1.0),
    "n": ("N", 1.0),
}
_LENGTH, _ANGLE, _MASS = ("mm", 1e3), ("deg", 1.0 / radians(1.0)), ("g", 1e3)
_BENCH = {  # unit, plausible departure from the start in SI units
    **dict.fromkeys(("base_x", "base_y", "base_z", "holder_x", "holder_y", "holder_z"), (_LENGTH, 10e-3)),
    **dict.fromkeys(("base_tilt_x", "base_tilt_y", "base_roll"), (_ANGLE, radians(30.0))),
    **dict.fromkeys(("gravity_tilt_x", "gravity_tilt_y", "gravity_tilt_z"), (_ANGLE, radians(30.0))),
    **dict.fromkeys(("tip_mass", "tracker_mass"), (_MASS, 5e-3)),
    "tension_scale": (("", 1.0), 0.5),
    "tension_zero": (("N", 1.0), 0.5),
    "displacement_zero": (_LENGTH, 5e-3),
}


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """A number to be identified. SI: start, plausible (departure from the start that would surprise nobody), low, high.

    unit, per_si: in what it is told, and the factor from SI.
    """

    name: str
    start: float
    plausible: float
    low: float
    high: float
    unit: str
    per_si: float

    def told(self, value: float, digits: int = 4) -> str:
        """``value`` (SI) with its unit."""
        return f"{value * self.per_si:.{digits}g} {self.unit}".rstrip()


def unknowns(free: Sequence[str], trials: Sequence[Trial], setup: Setup) -> tuple[Unknown, ...]:
    """One of each name. Raises `InvalidInput` for names that are not known, are given twice, or where there is none."""
    if isinstance(free, str) or not isinstance(free, Sequence) or not free:
        raise InvalidInput("free", free, "one or more names of numbers to identify")
    for i, name in enumerate(free):
        if name in free[:i]:
            raise InvalidInput("free", name, "given once")
    return tuple(_unknown(name, setup.value(name, trials), setup, trials) for name in free)


def _unknown(name: str, start: float, setup: Setup, trials: Sequence[Trial]) -> Unknown:
    if name in BENCH:
        (unit, per_si), plausible = _BENCH[name]
        low = 0.0 if name in NOT_BELOW_ZERO else 1e-3 if name == "tension_scale" else -inf
        high = inf
    else:
        unit, per_si = unit_of(the_robot(setup, trials), name)
        plausible = 0.5 * abs(start) or _WITHOUT_SCALE.get(unit, 1.0)
        low, high = (1e-3 * start, inf) if start > 0.0 else (-inf, inf)
        if name.endswith("friction"):
            plausible, low, high = 0.3, 0.0, 3.0
        if unit == "deg" or "turns" in name or "precurvature" in name:
            low, high = -inf, inf
    return Unknown(name=name, start=start, plausible=plausible, low=low, high=high, unit=unit, per_si=per_si)


_WITHOUT_SCALE = {"mm": 1e-3, "deg": radians(30.0), "1/m": 10.0}


def unit_of(robot: Robot, name: str) -> tuple[str, float]:
    """(unit, factor from SI) in which a number of ``robot`` is told, as its file has it."""
    keys = body_keys(robot.body) | {flat: TENDON_KEYS[own] for flat, (_, own) in tendon_names(robot.tendons).items()}
    key = keys.get(name) or keys.get(name.rpartition("_")[0]) or ""  # precurvature_x stands in a vector
    return _UNITS.get(key.rpartition("_")[2], ("", 1.0))
