"""`TensionController`: PI control of the tendon's tension through a velocity, and the ramps and filters beside it.

Nothing here knows a device. Every update takes the time dt since the last one as it was measured, so that a late period
counts for as long as it lasted.
"""

from __future__ import annotations

from math import exp, inf, isfinite, sqrt

from ..errors import finite, nonnegative, one_of, positive

KP, KI = 50e-3, 50e-3  # (m/s)/N, (m/s2)/N: the paper's kP = kI = 50, which it prints without units, as we read them
ANTI_WINDUP = ("conditional", "back-calculation", "none")
LONGEST = 0.1  # s: after a longer pause the error is integrated over no more than this


class TensionController:
    """PI from the tension error e (N) to a velocity (m/s): v = kp e + ki int e dt + feed-forward, within limits.

    - kp: (m/s)/N; ki: (m/s2)/N; limit: largest speed, m/s; acceleration: m/s2.
    - anti_windup "conditional": the integral stands still while the speed is at its limit and the error pushes further.
      It is the default because it has no time constant to choose, leaves the loop inside the limits as it was designed,
      and never holds more than the limit. "back-calculation": the integral follows what the limit left of the output
      with the time constant kp / ki. "none": for comparison.
    - feed_forward: whether the feed-forward velocity given to `update` is used; the paper's loop has none.

    The acceleration limit acts on the output alone: it lasts no longer than 2 limit / acceleration, and freezing the
    integral for it would let the noise of a load cell decide what is integrated. An error that is not a number
    (a reading that is missing) is not integrated, and the velocity runs down to zero. Raises `InvalidInput`.
    """

    __slots__ = (
        "_before", "_integral", "_ramp", "_saturated", "acceleration", "anti_windup", "feed_forward", "ki", "kp",
        "limit",
    )  # fmt: skip

    def __init__(
        self, kp: float = KP, ki: float = KI, limit: float = 5e-3, acceleration: float = inf,
        anti_windup: str = "conditional", feed_forward: bool = False,
    ) -> None:  # fmt: skip
        self.kp, self.ki = nonnegative("kp", kp), nonnegative("ki", ki)
        self.limit = positive("limit", limit)
        self.acceleration = acceleration if acceleration == inf else positive("acceleration", acceleration)
        self.anti_windup = one_of("anti_windup", anti_windup, ANTI_WINDUP)
        self.feed_forward = bool(feed_forward)
        self._ramp = Ramp(limit, acceleration)
        self.reset()

    def __repr__(self) -> str:
        ahead = ", feed_forward=True" if self.feed_forward else ""
        return f"TensionController(kp={self.kp:g}, ki={self.ki:g}, limit={self.limit:g}{ahead})"

    @property
    def velocity(self) -> float:
        """The last output, m/s."""
        return self._ramp.velocity

    @property
    def integral(self) -> float:
        """The integral's share of the output, m/s."""
        return self._integral

    @property
    def is_saturated(self) -> bool:
        """Whether the speed limit cut the last output."""
        return self._saturated

    def reset(self, velocity: float = 0.0) -> None:
        """Start afresh from an axis that moves at ``velocity`` (m/s), without a jump: its ramp goes on from there."""
        self._ramp.velocity = self._clipped(finite("velocity", velocity))
        self._integral, self._before, self._saturated = 0.0, float("nan"), False

    def update(self, error: float, dt: float, feed_forward: float = 0.0) -> float:
        """The velocity (m/s) for tension error ``error`` (N), dt (s) after the last call."""
        if not isfinite(error):
            self._before = float("nan")
            return self._ramp.update(0.0, dt)
        ahead = feed_forward if self.feed_forward and isfinite(feed_forward) else 0.0
        step = min(max(dt, 0.0), LONGEST) if isfinite(dt) else 0.0
        mean = error if self._before != self._before else 0.5 * error + 0.5 * self._before  # trapezoid
        self._before = error
        wanted = self.kp * error + self._integral + self.ki * mean * step + ahead
        possible = self._clipped(wanted)
        self._saturated = possible != wanted
        self._integrate(self.ki * mean * step, wanted, possible, step)
        return self._ramp.update(possible, dt)

    def _integrate(self, growth: float, wanted: float, possible: float, dt: float) -> None:
        """Add ``growth`` to the integral as far as the kind of anti-windup lets it."""
        if self.anti_windup == "conditional":
            self._integral += 0.0 if growth * (wanted - possible) > 0.0 else growth
            self._integral = self._clipped(self._integral)
        else:
            self._integral += growth
            if self.anti_windup == "back-calculation" and self.kp > 0.0:
                self._integral += (possible - wanted) * min(1.0, dt * self.ki / self.kp)

    def _clipped(self, velocity: float) -> float:
        return min(max(velocity, -self.limit), self.limit)


class Ramp:
    """A velocity that keeps to a speed and an acceleration: what is wanted is reached as fast as they allow."""

    __slots__ = ("acceleration", "speed", "velocity")

    def __init__(self, speed: float = inf, acceleration: float = inf) -> None:
        self.speed, self.acceleration, self.velocity = speed, acceleration, 0.0

    def update(self, wanted: float, dt: float) -> float:
        """The velocity dt (s) after the last one; what is no number counts as standing still."""
        goal = min(max(wanted, -self.speed), self.speed) if wanted == wanted else 0.0
        if self.acceleration != inf:
            change = self.acceleration * min(max(dt, 0.0), LONGEST)
            goal = min(max(goal, self.velocity - change), self.velocity + change)
        self.velocity = goal
        return goal


class LowPass:
    """First-order filter with time constant ``time`` (s), 0 for none, that starts from its first value."""

    __slots__ = ("time", "value")

    def __init__(self, time: float = 0.0) -> None:
        self.time, self.value = nonnegative("time", time), float("nan")

    def update(self, value: float, dt: float) -> float:
        """The filtered value dt (s) later, exact for a value that held since; a value that is no number is left out."""
        if value == value:
            fresh = self.time == 0.0 or self.value != self.value
            self.value = value if fresh else value + (self.value - value) * exp(-max(dt, 0.0) / self.time)
        return self.value

    def reset(self) -> None:
        """Forget what was."""
        self.value = float("nan")


def braked(velocity: float, room: float, deceleration: float, dt: float) -> float:
    """``velocity`` as far as it leaves way to stop within ``room`` (m or rad, ahead in its direction).

    No faster than sqrt(deceleration room), half of what the deceleration would just allow, nor than room / dt.
    """
    if not room > 0.0:
        return 0.0
    most = min(sqrt(deceleration * room), room / dt if dt > 0.0 else inf)
    return min(max(velocity, -most), most)
