"""The tension loop as a linear system: margins, step responses and gains, with python-control.

    e = tau_FTL - tau,  v = (kp + ki / s) e,  dz/dt = v behind the actuator's lag,  tau = (z - x_t) / c

c (m/N): translation per tension at a still screw, of robot and tendon, `payout.compliances`; it grows with the
insertion, so that the loop is fastest, and its margins least, where the body is short. The delay is that of the control
period: one period until a command acts and half a period for its being held. A tension that is wanted to change along
the profile takes its slope off the stiffness 1 / c. Needs the extra "bench".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan, degrees, inf, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidInput, nonnegative, numbers, positive, within
from .control import KI, KP

if TYPE_CHECKING:
    from ..robot import Robot

RATE = 200.0  # Hz
PERIODS = 1.5  # of delay: one for the computation, half of one for the hold
PADE = 5  # order of the delay in transfer functions; off by less than 1e-6 up to a phase of 90 degrees
LAG = 0.01  # s: assumed of a small geared DC motor under velocity control; the paper gives none
FILTER = 0.0016  # s: a load cell's amplifier with a bandwidth of 100 Hz; the paper gives none
DAMPING = 1.0  # wanted where the body is longest: nothing swings, though the zero of PI lets a step overshoot
PHASE_MARGIN = 60.0  # degrees, wanted
INSERTIONS = (0.05, 0.25, 0.5, 0.75, 1.0)
TENDON = 0.51e-3  # m/N: 0.3 m of a 0.1 mm nitinol tendon
SAMPLES = 2001  # of a step response


@dataclass(frozen=True, kw_only=True)
class Loop:
    """One tension loop. kp (m/s)/N, ki (m/s2)/N, compliance m/N, slope dtau_FTL/dz N/m, lag, delay and filter s.

    Raises `InvalidInput`.
    """

    compliance: float
    kp: float = KP
    ki: float = KI
    slope: float = 0.0
    lag: float = LAG
    delay: float = PERIODS / RATE
    filter: float = FILTER

    def __post_init__(self) -> None:
        for name in ("compliance", "kp"):
            positive(name, getattr(self, name))
        for name in ("ki", "lag", "delay", "filter"):
            nonnegative(name, getattr(self, name))
        if not self.stiffness > 0.0:
            raise InvalidInput("slope", self.slope, f"below the stiffness 1 / compliance = {1 / self.compliance:.4g}")

    @property
    def stiffness(self) -> float:
        """Change of -e per translation, N/m."""
        return 1.0 / self.compliance - self.slope

    @property
    def natural_frequency(self) -> float:
        """Of the loop without lag and delay, rad/s."""
        return sqrt(self.ki * self.stiffness)

    @property
    def damping(self) -> float:
        """Of the loop without lag and delay: kp / 2 sqrt(ki c); above 1 nothing swings."""
        return 0.5 * self.kp * sqrt(self.stiffness / self.ki) if self.ki > 0.0 else inf

    def open(self, omega: np.ndarray) -> np.ndarray:
        """(n,) complex open-loop response at ``omega`` (n,) rad/s, exact, delay included."""
        s = 1j * np.asarray(omega, dtype=float)
        slow = (1.0 + self.lag * s) * (1.0 + self.filter * s)
        return (self.kp + self.ki / s) * self.stiffness / s * np.exp(-self.delay * s) / slow

    def transfer(self, to: str = "target") -> Any:
        """python-control's closed loop to the tension: from "target" (N), or from the screw's velocity, "screw" (m/s).

        The delay is a Pade approximation of order ``PADE``.
        """
        import control

        s: Any = control.tf("s")
        late = self._late()
        forward = (self.kp + self.ki / s) * late / (1.0 + self.lag * s)
        plant, measured = self.stiffness / s, 1.0 / (1.0 + self.filter * s)
        if to == "target":
            return control.minreal(control.feedback(forward * plant, measured), verbose=False)
        return control.minreal(control.feedback(plant, forward * measured), verbose=False)

    def _late(self) -> Any:
        import control

        return control.tf(*control.pade(self.delay, PADE)) if self.delay > 0.0 else 1.0

    def step(self, time: np.ndarray, to: str = "target", ahead: float = 0.0) -> np.ndarray:
        """(n,) tension (N) after a step of the target by 1 N, or the error after one of the screw's rate by 1 m/s.

        time: (n,) s, evenly spaced from 0.
        ahead: share of the screw's rate that feed-forward gives to the translation, to which actuator and delay apply.
        """
        import control

        if to == "target":
            return np.asarray(control.step_response(self.transfer(), time).outputs)
        s: Any = control.tf("s")
        left = (1.0 - ahead * self._late() / (1.0 + self.lag * s)) * self.transfer("screw")
        return np.asarray(control.step_response(control.minreal(left, verbose=False), time).outputs)


def largest_error(loop: Loop, rate: float, ahead: float = 0.0) -> float:
    """Largest tension error (N) after the screw has started at ``rate`` (m/s) in no time; ahead: as in `Loop.step`.

    Without lag and delay it is below rate / kp, which it comes near where the loop is well damped.
    """
    slow = 20.0 * (loop.lag + loop.delay + loop.filter)
    settling = 10.0 / (loop.kp * loop.stiffness)
    peak = 2.0 / loop.natural_frequency if loop.ki > 0.0 else settling  # of PI alone it is before 1 / frequency
    time = np.linspace(0.0, slow + max(peak, settling), SAMPLES)
    return abs(rate) * float(np.abs(loop.step(time, "screw", ahead)).max())


@dataclass(frozen=True, kw_only=True)
class Margins:
    """gain: factor; phase: degrees; crossover, bandwidth (-3 dB of the closed loop): rad/s; delay: s of more delay."""

    gain: float
    phase: float
    crossover: float
    bandwidth: float
    delay: float


def margins(loop: Loop) -> Margins:
    """Stability margins by python-control from the exact frequency response, the delay not approximated."""
    import control

    omega = np.geomspace(0.05, 60.0, 800) * loop.kp * loop.stiffness
    open_ = loop.open(omega)
    gain, phase, _, _, crossover, _ = control.stability_margins(control.frd(open_, omega, smooth=True))
    closed = np.abs(open_ / (1.0 + open_))
    bandwidth = omega[np.flatnonzero(closed > sqrt(0.5))[-1]]
    return Margins(
        gain=float(gain), phase=float(phase), crossover=float(crossover), bandwidth=float(bandwidth),
        delay=float(np.radians(phase) / crossover),
    )  # fmt: skip


def suggested(
    compliances: Sequence[float], margin: float = PHASE_MARGIN, damping: float = DAMPING, **rest: float
) -> Loop:
    """The fastest constant gains that keep a phase ``margin`` (degrees) at the smallest and ``damping`` at the largest.

    compliances: m/N, over all insertions of the motion; rest: lag, delay, filter of `Loop`. With
    ki = kp^2 / 4 damping^2 c_max, kp is raised until the phase margin at c_min is used up.
    Returns the loop at c_min. Raises `InvalidInput`.
    """
    soft, stiff = max(compliances), min(compliances)
    wanted = within("margin", margin, 1.0, 89.0)
    ratio = 1.0 / (4.0 * positive("damping", damping) ** 2 * soft)

    def loop(kp: float) -> Loop:
        return Loop(compliance=stiff, kp=kp, ki=ratio * kp**2, **rest)

    low, high = 1e-6 * stiff, 1e4 * stiff
    for _ in range(60):  # the phase margin falls as kp rises
        middle = sqrt(low * high)
        low, high = (middle, high) if phase_margin(loop(middle)) > wanted else (low, middle)
    return loop(low)


def phase_margin(loop: Loop) -> float:
    """Degrees, exact and quick: the crossover by bisection, since |L| falls everywhere."""
    low, high = 1e-9, 1e9
    for _ in range(120):
        middle = sqrt(low * high)
        low, high = (middle, high) if abs(loop.open(np.array([middle]))[0]) > 1.0 else (low, middle)
    w = low
    lead = atan(loop.kp * w / loop.ki) if loop.ki > 0.0 else 0.5 * pi
    return degrees(lead - w * loop.delay - atan(w * loop.lag) - atan(w * loop.filter))


def at_insertions(
    robot: Robot, insertion: Sequence[float], tension: float = 0.7, gravity=(0.0, 0.0, 0.0),
    compliance: float = 0.0, **rest: float,
) -> list[Loop]:  # fmt: skip
    """A `Loop` for each of ``insertion``; tension (N), compliance of the tendon (m/N), rest: fields of `Loop`."""
    from .payout import compliances

    return [Loop(compliance=float(c), **rest) for c in compliances(robot, insertion, tension, gravity, compliance)]


def with_gains(loops: Sequence[Loop], kp: float, ki: float) -> list[Loop]:
    """The same loops with other gains."""
    return [replace(loop, kp=kp, ki=ki) for loop in loops]


@dataclass(frozen=True, kw_only=True)
class Designed:
    """The loops of a robot at ``insertions``, with the paper's gains and with the `suggested` ones.

    tension N; gravity m/s2, world frame; compliance: of the tendon itself, m/N.
    """

    robot: Robot
    tension: float
    gravity: tuple[float, float, float]
    compliance: float
    insertions: tuple[float, ...]
    paper: tuple[Loop, ...]
    suggested: tuple[Loop, ...]

    @property
    def gains(self) -> tuple[float, float]:
        """Suggested kp (m/s)/N and ki (m/s2)/N."""
        return self.suggested[0].kp, self.suggested[0].ki


def designed(
    robot: Robot, tension: float = 0.7, gravity=(0.0, 0.0, 0.0), compliance: float = TENDON,
    insertions: Sequence[float] = INSERTIONS, **rest: float,
) -> Designed:  # fmt: skip
    """Loops along a motion and gains for all of them; rest: lag, delay, filter of `Loop`, s. Raises `InvalidInput`."""
    eta = tuple(sorted(numbers("insertions", insertions).tolist()))
    paper = at_insertions(robot, eta, tension, gravity, compliance, **rest)
    best = suggested([each.compliance for each in paper], **rest)
    x, y, z = numbers("gravity", gravity).tolist()
    return Designed(
        robot=robot, tension=tension, gravity=(x, y, z), compliance=compliance, insertions=eta, paper=tuple(paper),
        suggested=tuple(with_gains(paper, best.kp, best.ki)),
    )  # fmt: skip
