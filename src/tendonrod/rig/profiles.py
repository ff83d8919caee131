"""`profile`: what tension, rotation and tendon pay-out go with each insertion of a follow-the-leader motion.

A `Profile` itself knows no rods: three functions of the insertion eta with their slopes, quick enough to be asked in
every control period. `profile` makes one from a plan, from the quadratic that fits it, or from the paper's quadratic.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..errors import InvalidInput, finite, one_of
from .commandfile import read_commands

if TYPE_CHECKING:
    from ..motion.plan import Plan
    from ..robot import Robot

NAMES = ("plan", "polynomial", "paper")
PAPER = (0.6492, -0.5159, 0.6088)  # N, highest power first: the paper's fit for prototype 1, 0.7 N, gravity (II-D)
PAY_OUT_NODES = 41  # of the tendon paid out, evenly spread over the insertion


class Function(Protocol):
    """A function of one number, with its slope."""

    def value(self, x: float) -> float: ...

    def slope(self, x: float) -> float: ...


class Cubics:
    """Monotone cubic interpolation (Fritsch and Carlson) through points (x, y); beyond the ends constant.

    x increases. Between two points the function stays between their values, so that a plan gets no bumps that it does
    not have. Raises `InvalidInput`.
    """

    __slots__ = ("_pieces", "_x")

    def __init__(self, x: Sequence[float] | np.ndarray, y: Sequence[float] | np.ndarray) -> None:
        at, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        if at.ndim != 1 or at.shape != values.shape or at.size < 1 or not np.all(np.diff(at) > 0.0):
            raise InvalidInput("insertion", at, "one or more increasing numbers, with one value each")
        if not (np.isfinite(at).all() and np.isfinite(values).all()):
            raise InvalidInput("profile", values, "finite numbers")
        self._x: list[float] = at.tolist()
        self._pieces: list[list[float]] = _pieces(at, values).tolist()

    def value(self, x: float) -> float:
        """The function at ``x``."""
        t, (a, b, c, d) = self._local(x)
        return a + t * (b + t * (c + t * d))

    def slope(self, x: float) -> float:
        """Its derivative, 0 beyond the ends."""
        if not self._x[0] <= x <= self._x[-1]:
            return 0.0
        t, (_, b, c, d) = self._local(x)
        return b + t * (2.0 * c + t * 3.0 * d)

    def _local(self, x: float) -> tuple[float, list[float]]:
        at = min(max(x, self._x[0]), self._x[-1])
        k = min(max(bisect_right(self._x, at) - 1, 0), len(self._pieces) - 1)
        return at - self._x[k], self._pieces[k]


class Polynomial:
    """coefficients, highest power first, from insertion 0 to 1; beyond them constant."""

    __slots__ = ("coefficients",)

    def __init__(self, coefficients: Sequence[float] | np.ndarray) -> None:
        self.coefficients = tuple(finite(f"polynomial[{i}]", float(c)) for i, c in enumerate(coefficients))

    def value(self, x: float) -> float:
        """The polynomial at ``x``, by Horner's rule."""
        at, found = min(max(x, 0.0), 1.0), 0.0
        for c in self.coefficients:
            found = found * at + c
        return found

    def slope(self, x: float) -> float:
        """Its derivative, 0 beyond the ends."""
        found, degree = 0.0, len(self.coefficients) - 1
        for k, c in enumerate(self.coefficients[:-1]):
            found = found * x + (degree - k) * c
        return found if 0.0 <= x <= 1.0 else 0.0


ZERO = Polynomial((0.0,))
EVEN = Polynomial((1.0, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """A follow-the-leader motion over the insertion: tension (N), rotation (rad), tendon paid out (share of L).

    The rotation is that of the section at the outer tube's exit, as plans have it: the motor turns by
    2 pi turns (insertion - 1) more. name says where it came from; tension must not be negative anywhere.
    """

    name: str
    tension: Function
    rotation: Function = ZERO
    paid_out: Function = EVEN

    def __post_init__(self) -> None:
        least = min(self.tension.value(x) for x in np.linspace(0.0, 1.0, 201).tolist())
        if least < 0.0:
            raise InvalidInput("tension of the profile", least, ">= 0 at every insertion")

    def pay_rate(self, insertion: float) -> float:
        """Tendon paid out per translation, dx_t/dz, without unit: 1 - dDelta/dz - c_t dtau/dz along the profile."""
        return self.paid_out.slope(min(max(insertion, 0.0), 1.0))


def profile(
    name: str,
    robot: Robot,
    target: float = 0.7,
    gravity=(0.0, 0.0, 0.0),
    plan: Plan | str | PathLike[str] | None = None,
    steps: int = 20,
    freedom: str = "tension",
    compliance: float = 0.0,
) -> Profile:
    """The profile called ``name`` for ``robot``.

    - "plan": tensions and rotations of a plan, interpolated monotonically over its insertion; held below its first
      step. "polynomial": the quadratic that fits its tensions best, as the paper uses it; "paper": the paper's own,
      whatever the target is. Neither of them turns the robot.
    - target: N, of the plan; gravity: (3,) m/s2, world frame; steps, freedom: of the plan that is made.
    - plan: one that is there already, or the path of its .csv file, for "plan" and "polynomial"; a file that says it is
      for a robot of another name is refused.
    - compliance: of the tendon (m/N), for the tendon paid out, which only feed-forward asks for.

    Raises `InvalidInput`, `NotConverged`. Source: paper II-D.
    """
    kind = one_of("profile", name, NAMES)
    if kind == "paper":
        return _with_pay_out(kind, Polynomial(PAPER), ZERO, robot, gravity, compliance)
    eta, tau, phi = _planned(robot, target, gravity, plan, steps, freedom)
    if kind == "plan":
        return _with_pay_out(kind, Cubics(eta, tau), Cubics(eta, phi), robot, gravity, compliance)
    fitted = Polynomial(np.polyfit(eta, tau, min(2, len(eta) - 1)))
    return _with_pay_out(kind, fitted, ZERO, robot, gravity, compliance)


def _planned(robot: Robot, target: float, gravity, plan, steps: int, freedom: str):
    """insertion, tension (N) and rotation (rad) of a plan's steps."""
    if isinstance(plan, (str, PathLike)):
        read = read_commands(plan)
        if read.origin is not None:
            read.origin.check_robot("plan", fspath(plan), robot)
        return read.insertion, read.tension, read.rotation
    if plan is None:
        from ..motion.follow_leader import plan_follow_leader

        plan = plan_follow_leader(robot, target, gravity, steps=steps, freedom=freedom)
    return plan.insertion, plan.tension, plan.rotation


def _with_pay_out(
    name: str, tension: Function, rotation: Function, robot: Robot, gravity, compliance: float
) -> Profile:
    from .payout import paid_out

    made = Profile(name=name, tension=tension, rotation=rotation)  # refuses negative tensions before they are solved
    eta = np.linspace(0.0, 1.0, PAY_OUT_NODES)
    tau, phi = ([function.value(x) for x in eta.tolist()] for function in (made.tension, made.rotation))
    out = paid_out(robot, eta, tau, phi, gravity, compliance)
    out[0] = -compliance * tau[0]  # the tendon is taken up before the insertion starts
    return Profile(name=name, tension=tension, rotation=rotation, paid_out=Cubics(eta, out / robot.section.L))


def _pieces(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(n, 4) coefficients of each piece in t = x - x_k, constant first; one constant piece for a single point."""
    if x.size == 1:
        return np.array([[y[0], 0.0, 0.0, 0.0]])
    from scipy.interpolate import PchipInterpolator

    return np.ascontiguousarray(PchipInterpolator(x, y).c[::-1].T)
