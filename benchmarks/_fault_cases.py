"""What can go wrong in the trials of bench_faults.py, and what is then asked of the bench."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from tendonrod.rig.states import FaultKind
from tendonrod.rig.tasks import Phase
from tendonrod.rig.virtual.injection import DEVICES, Injection, InjectionKind
from tendonrod.rig.virtual.setup import roller_translation

AXES = ("screw", "translation", "rotation")
ANY_TIME = ((Phase.START, 1.0), (Phase.TAKE_UP, 1.0), (Phase.INSERT, 3.0))  # phase, s: longest time after its start
TAUT = ((Phase.INSERT, 3.0),)
MOVING = ((Phase.INSERT, 1.4),)  # of motion at the full rate, which lasts on for half a second
EASED = 0.7  # s, after which the screw is near its rate
WINDING = ((Phase.TAKE_UP, 0.02),)
AT_END = ((Phase.SETTLE, 0.1),)
OFF = {"screw": 0.5e-3, "translation": 0.5e-3, "rotation": 0.15}  # least difference of a runaway from the motion
TOP = {"screw": 3e-3, "translation": 5e-3, "rotation": 1.0}  # fastest runaway
GOING = {"screw": 2e-3, "translation": 2.1e-3, "rotation": 0.17}  # at full rate
JUMPS = {"screw": (0.7e-3, 150e-3), "translation": (0.7e-3, 50e-3), "rotation": (0.15, 3.0)}


@dataclass(frozen=True, kw_only=True)
class Ill:
    """What goes wrong in one trial. SI.

    finds: the fault that must be found. injected: kind and fields of an `Injection`; deed: else what the program, a
    person or the disk does. when: phases and longest times after their start, one is drawn; least: s, shortest time.
    tension: N, of the profile, from and to. shows: s beyond one period until a sample shows it; period: longest of the
    loop meanwhile, s, None for the usual. may_hold: whether the tendon may keep its tension in the end. setup, limits:
    changes of the bench's.
    """

    finds: FaultKind | None
    injected: tuple[InjectionKind, dict[str, Any]] | None = None
    deed: str = ""
    when: tuple[tuple[Phase, float], ...] = ANY_TIME
    least: float = 0.0
    tension: tuple[float, float] = (0.2, 0.85)
    shows: float = 0.0
    period: float | None = None
    may_hold: bool = False
    setup: dict[str, Any] = field(default_factory=dict)
    limits: dict[str, Any] = field(default_factory=dict)

    def injection(self, time: float) -> Injection:
        """The injection at ``time`` (s)."""
        assert self.injected is not None
        kind, fields = self.injected
        return Injection(kind=kind, time=time, **fields)


def _lasting(rng: np.random.Generator) -> float:
    """For good, or for a while after which the device is as it should be."""
    return inf if rng.uniform() < 0.5 else float(rng.uniform(1.0, 2.0))


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.uniform() < 0.5 else -1.0


def _cell(kind: InjectionKind, finds: FaultKind):
    def made(rng: np.random.Generator) -> Ill:
        return Ill(finds=finds, injected=(kind, {"duration": _lasting(rng)}))

    return made


def _cell_jump(finds: FaultKind, low: float, high: float, tension: tuple[float, float], both: bool = False, **more):
    def made(rng: np.random.Generator) -> Ill:
        value = float(rng.uniform(low, high)) * (_sign(rng) if both else 1.0)
        fields = {"value": value, "duration": _lasting(rng)}
        return Ill(
            finds=finds, injected=(InjectionKind.CELL_JUMP, fields), tension=tension, when=TAUT, least=0.3, **more
        )

    return made


def _encoder_jump(axis: str):
    def made(rng: np.random.Generator) -> Ill:
        low, high = JUMPS[axis]
        value = _sign(rng) * low * (high / low) ** float(rng.uniform())
        return Ill(finds=FaultKind.ENCODER_JUMP, injected=(InjectionKind.ENCODER_JUMP, {"value": value, "where": axis}))

    return made


def _travel(rng: np.random.Generator) -> Ill:
    """An encoder that is off by less than a jump, at the end of the travel."""
    injected = InjectionKind.ENCODER_JUMP, {"value": float(rng.uniform(0.35e-3, 0.45e-3)), "where": "translation"}
    overrun = (0.5e-3, 0.1e-3, 0.05)
    return Ill(finds=FaultKind.TRAVEL, injected=injected, when=AT_END, limits={"overrun": overrun, "ends": 0.1e-3})


def _axis(kind: InjectionKind, axis: str, shows: float = 0.0):
    def made(rng: np.random.Generator) -> Ill:
        injected = kind, {"where": axis, "duration": _lasting(rng)}
        held = axis in ("screw", "")
        return Ill(finds=FaultKind.STALL, injected=injected, when=MOVING, least=EASED, shows=shows, may_hold=held)

    return made


def _runaway(axis: str):
    def made(rng: np.random.Generator) -> Ill:
        speed, top = GOING[axis], TOP[axis]
        while abs(abs(speed) - GOING[axis]) < OFF[axis]:  # neither as commanded nor as when the motion turns round
            speed = float(rng.uniform(-top, top))
        injected = InjectionKind.RUNAWAY, {"where": axis, "value": speed}
        held = axis == "screw"
        return Ill(finds=FaultKind.STALL, injected=injected, when=MOVING, least=EASED, may_hold=held)

    return made


def _speed(rng: np.random.Generator) -> Ill:
    """A stiff motor that runs off faster than its limit: it is too fast before it is far from where it should be."""
    injected = InjectionKind.RUNAWAY, {"where": "translation", "value": _sign(rng) * float(rng.uniform(7e-3, 10e-3))}
    stiff = {"translation": roller_translation(acceleration=10.0, braking=10.0)}
    return Ill(finds=FaultKind.SPEED, injected=injected, when=TAUT, setup=stiff)


def _tracker(rng: np.random.Generator) -> Ill:
    """Shows late by half of the spread of its delay: that is how well the time of a frame is known."""
    return Ill(
        finds=FaultKind.TRACKER_LOST, injected=(InjectionKind.TRACKER_LOST, {"duration": _lasting(rng)}), shows=12.5e-3
    )


def _silent(rng: np.random.Generator) -> Ill:
    where = str(rng.choice(DEVICES))
    injected = InjectionKind.DEVICE_ERROR, {"where": where, "duration": _lasting(rng)}
    return Ill(finds=FaultKind.DEVICE, injected=injected, may_hold=where == "screw")


def _late(rng: np.random.Generator) -> Ill:
    late = float(rng.uniform(8e-3, 60e-3))
    injected = InjectionKind.CLOCK_LATE, {"value": late, "duration": _lasting(rng)}
    return Ill(finds=FaultKind.LATE, injected=injected, period=late)


def _pause(rng: np.random.Generator) -> Ill:
    """One pause of the whole process."""
    pause = float(rng.uniform(0.12, 0.5))
    injected = InjectionKind.CLOCK_LATE, {"value": pause, "duration": 6e-3}
    return Ill(finds=FaultKind.COMMAND_TIMEOUT, injected=injected, period=pause)


def _break(rng: np.random.Generator) -> Ill:
    return Ill(
        finds=FaultKind.TENSION_RATE, injected=(InjectionKind.TENDON_BREAK, {}), tension=(0.4, 0.85), when=TAUT,
        least=0.3,
    )  # fmt: skip


def _weak(kind: InjectionKind):
    """A tendon that breaks, or a cell that dies, at a small tension: no jump shows."""

    def made(rng: np.random.Generator) -> Ill:
        return Ill(finds=FaultKind.TENSION_LOST, injected=(kind, {}), tension=(0.14, 0.27), when=TAUT)

    return made


def _dead(rng: np.random.Generator) -> Ill:
    """A cell that is dead from the start: as much is pulled as a slack tendon may need."""
    return Ill(finds=FaultKind.TENSION_LOST, injected=(InjectionKind.CELL_DEAD, {}), when=WINDING)


def _frozen(rng: np.random.Generator) -> Ill:
    """The reading stays where it was, up or down the profile."""
    ends = (0.2, 0.85) if rng.uniform() < 0.5 else (0.85, 0.3)
    return Ill(
        finds=FaultKind.TENSION_LOST, injected=(InjectionKind.CELL_FROZEN, {}), tension=ends, when=MOVING, least=EASED
    )


def _deed(deed: str, finds: FaultKind | None, **more):
    def made(rng: np.random.Generator) -> Ill:
        return Ill(finds=finds, deed=deed, **more)

    return made


CASES: dict[str, Callable[[np.random.Generator], Ill]] = {
    "cell gives no number": _cell(InjectionKind.CELL_NAN, FaultKind.NAN_SENSOR),
    "cell repeats itself": _cell(InjectionKind.CELL_STALE, FaultKind.STALE_SENSOR),
    "cell saturated": _cell(InjectionKind.CELL_SATURATED, FaultKind.SATURATION),
    "cell above limit": _cell_jump(FaultKind.TENSION, 0.22, 0.28, (0.85, 0.88)),
    "cell jumps": _cell_jump(FaultKind.TENSION_RATE, 0.4, 3.0, (0.2, 0.85), both=True),
    "strain above limit": _cell_jump(FaultKind.STRAIN, 0.24, 0.28, (0.56, 0.58), limits={"strain_at": 0.75}),
    "cell reads zero, below 0.3 N": _weak(InjectionKind.CELL_DEAD),
    "cell reads zero from the start": _dead,
    "cell stands still": _frozen,
    "tendon breaks": _break,
    "tendon breaks, below 0.3 N": _weak(InjectionKind.TENDON_BREAK),
    **{f"encoder jumps, {axis}": _encoder_jump(axis) for axis in AXES},
    "beyond travel": _travel,
    "too fast": _speed,
    **{f"stalls, {axis}": _axis(InjectionKind.STALL, axis) for axis in AXES},
    **{f"runs away, {axis}": _runaway(axis) for axis in AXES},
    **{f"commands lost, {axis or 'all'}": _axis(InjectionKind.COMMAND_LOSS, axis, 0.1) for axis in (*AXES, "")},
    "tracker lost": _tracker,
    "device silent": _silent,
    "periods late": _late,
    "pause of the process": _pause,
    "disk full": _deed("disk full", FaultKind.RECORD),
    "controller raises": _deed("raise", FaultKind.CONTROLLER),
    "controller says NaN": _deed("nan", FaultKind.CONTROLLER),
    "controller stuck": _deed("stuck", FaultKind.STUCK, when=TAUT, shows=0.1, limits={"patience": 8.0}),
    "emergency stop": _deed("emergency", FaultKind.EMERGENCY, may_hold=True),
    "Ctrl-C": _deed("interrupt", FaultKind.EMERGENCY),
    "process killed": _deed("kill", None),
}
