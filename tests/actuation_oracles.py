"""Independent oracle: a uniform rod without external load and one tendon whose displacement, friction or place decides.

Without load the local balance Kse (v - v*) + tau t = n, Kbt (u - u*) + r x tau t = m stands alone at every s. With
q = v + u x r = |q| t and C = Kse^-1 - r^ Kbt^-1 r^ it reads (|q| 1 + tau C) t = q0, where q0 is q at tau = 0. As
|t| = 1, one scalar equation for |q| remains, sum_i c_i^2 / (|q| + tau d_i)^2 = 1 in the eigenbasis of C. Derivatives
with respect to tau follow in closed form. The package iterates on the six strains instead, so nothing is shared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, root

ZERO = np.zeros(3)
SLIP_IN, SLIP_OUT, STUCK = "slips in", "slips out", "stuck"


def hat(x) -> np.ndarray:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def cross(a, b) -> np.ndarray:
    """As np.cross for two vectors, which costs ten times more."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True, kw_only=True)
class Rod:
    """Uniform rod with one tendon at the constant place r = (X, Y, 0) of its section; SI, field symbols."""

    length: float
    Kse: np.ndarray
    Kbt: np.ndarray
    v_star: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    u_star: np.ndarray = field(default_factory=lambda: np.zeros(3))
    r: np.ndarray = field(default_factory=lambda: np.zeros(3))
    p0: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for name in ("Kse", "Kbt", "v_star", "u_star", "r", "p0"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))

    def at(self, X: float, Y: float = 0.0) -> Rod:
        return replace(self, r=np.array([X, Y, 0.0]))

    @cached_property
    def q_star(self) -> float:
        """Length of the slack tendon per unit of s."""
        return float(np.linalg.norm(self.v_star + cross(self.u_star, self.r)))

    @cached_property
    def eigen(self) -> tuple[np.ndarray, np.ndarray]:
        d, V = np.linalg.eigh(np.diag(1 / self.Kse) - hat(self.r) @ np.diag(1 / self.Kbt) @ hat(self.r))
        return d, V

    @property
    def crushing_tension(self) -> float:
        """Above it |q| would be negative: the tendon has pulled its own path to nothing."""
        d, V = self.eigen
        return float(np.linalg.norm(V.T @ (self.v_star + cross(self.u_star, self.r)) / d))


def rod_of(robot, tendon: int = 0) -> Rod:
    """The Rod of a tendonrod Robot, from its section numbers and one row of its routing table alone."""
    section = robot.section
    cx, cy, rho, angle, omega, end = np.asarray(robot.routing, dtype=float).reshape(-1, 6)[tendon]
    assert rho * omega == 0.0, "the tendon must not wind in the section"
    assert end >= section.L_na * (1 - 1e-12), "the tendon must reach the tip"
    return Rod(
        length=section.L_na, Kse=section.Kse, Kbt=section.Kbt, v_star=section.v_star, u_star=section.u_star,
        r=np.array([cx + rho * np.cos(angle), cy + rho * np.sin(angle), 0.0]), p0=np.array([-section.r_na, 0.0, 0.0]),
    )  # fmt: skip


@dataclass(frozen=True)
class Local:
    """Strains and tendon of one section: `q` = |v + u x r|, `dq`, `dt` derivatives with respect to the tension.

    `shorter`: what the tension takes from |q|, without cancellation.
    """

    v: np.ndarray
    u: np.ndarray
    t: np.ndarray
    q: float
    dq: float
    dt: np.ndarray
    shorter: float


def local(rod: Rod, tau: float, n: np.ndarray = ZERO, m: np.ndarray = ZERO) -> Local:
    """The section at which rod and tendon together carry the wrench (n, m), section frame."""
    d, V = rod.eigen
    v, u = rod.v_star + n / rod.Kse, rod.u_star + m / rod.Kbt
    c = V.T @ (v + cross(u, rod.r))
    size = float(np.linalg.norm(c))
    if tau > 0.0 and np.linalg.norm(c / (tau * d)) <= 1.0:
        raise ArithmeticError(f"the tension {tau} N crushes the rod")
    q = max(size - tau * d[-1], 0.0)
    for _ in range(100):  # Newton on 1/|t| - 1, concave here, so it comes from the left
        t = c / (q + tau * d)
        t2 = t @ t
        step = (t2**1.5 - t2) / (t * t / (q + tau * d)).sum() if t2 > 0.0 else 0.0
        q += step
        if abs(step) <= 1e-16 * size:
            break
    t = c / (q + tau * d)
    weight = t * t / (q + tau * d)
    dq = -float(weight @ d / weight.sum())
    shorter = tau * float(t * d @ (2.0 * q * t + tau * d * t)) / (size + q)
    dt, t = V @ (-t * (dq + d) / (q + tau * d)), V @ t
    return Local(v - tau * t / rod.Kse, u - tau * cross(rod.r, t) / rod.Kbt, t, q, dq, dt, shorter)


def helix(rod: Rod, v: np.ndarray, u: np.ndarray, s: float) -> np.ndarray:
    """Pose (4, 4) at s of a rod with constant strains."""
    twist, base = np.zeros((4, 4)), np.eye(4)
    twist[:3, :3], twist[:3, 3], base[:3, 3] = hat(u), v, rod.p0
    return base @ expm(s * twist)


def tip(rod: Rod, tau: float) -> np.ndarray:
    """Tip of the rod pulled by tau without friction, m."""
    state = local(rod, tau)
    return helix(rod, state.v, state.u, rod.length)[:3, 3]


# ---- displacement as input: pulled length d from slack; the tendon stretches over free length and path


def displacement(rod: Rod, tau: float, EA_t: float = np.inf, free_length: float = 0.0) -> float:
    """Length (m) to pull from slack for the tension tau (N)."""
    return rod.length * local(rod, tau).shorter + tau * (free_length + rod.length * rod.q_star) / EA_t


def tension(rod: Rod, d: float, EA_t: float = np.inf, free_length: float = 0.0) -> float:
    """Tension (N) after pulling the length d (m) from slack; 0 where the tendon is slack."""
    if d <= 0.0:
        return 0.0
    compliance = (free_length + rod.length * rod.q_star) / EA_t
    top = (1 - 1e-12) * rod.crushing_tension
    tau = float(brentq(lambda x: displacement(rod, x, EA_t, free_length) - d, 0.0, top, xtol=1e-9 * top))  # type: ignore[arg-type]
    for _ in range(3):
        state = local(rod, tau)
        miss = rod.length * state.shorter + tau * compliance - d
        tau -= miss / (compliance - rod.length * state.dq)
    return tau


# ---- friction: tau(s) = clip(before(s), tau0 exp(-mu Theta), tau0 exp(mu Theta)), Theta' = |u x t + t'|


def slip_rate(state: Local, tau: float, mu: float, sign: int) -> tuple[float, float]:
    """(tau', Theta') where the tendon slips, tau' = -sign mu Theta' tau: a quadratic, as t' = dt/dtau tau'."""
    a, b, k = cross(state.u, state.t), state.dt, (mu * tau) ** 2
    if k == 0.0:
        return 0.0, float(np.linalg.norm(a))
    A, B, C = 1.0 - k * (b @ b), -k * (a @ b), -k * (a @ a)
    x = (-B - sign * np.sqrt(B * B - A * C)) / A
    return float(x), float(np.linalg.norm(a + b * x))


@dataclass(frozen=True)
class Profile:
    """A rod whose tendon rubs: `at(s)` gives the state (Theta, shortening, integral of tau, p[3], R[9])."""

    rod: Rod
    mu: float
    tau0: float
    before: Profile | None
    pieces: tuple[tuple[float, str, Callable[[float], Any]], ...]  # end, mode, dense output

    def _piece(self, s: float):
        return next((piece for piece in self.pieces if s <= piece[0]), self.pieces[-1])

    def at(self, s: float) -> np.ndarray:
        return self._piece(s)[2](s)

    def tau(self, s: float) -> float:
        """Tension at s, N."""
        _, mode, dense = self._piece(s)
        return _tension(self, mode, s, dense(s)[0])

    def rates(self, s: float, mode: str, tau: float, state: Local) -> tuple[float, float]:
        """(tau', Theta') at s."""
        if mode != STUCK:
            return slip_rate(state, tau, self.mu, 1 if mode == SLIP_IN else -1)
        rate = self.before.rate(s)
        return rate, float(np.linalg.norm(cross(state.u, state.t) + state.dt * rate))

    def rate(self, s: float) -> float:
        tau = self.tau(s)
        return self.rates(s, self._piece(s)[1], tau, local(self.rod, tau))[0]

    @property
    def modes(self) -> tuple[str, ...]:
        return tuple(mode for _, mode, _ in self.pieces)

    @property
    def tip(self) -> np.ndarray:
        return self.at(self.rod.length)[3:6]

    @property
    def bending(self) -> float:
        """Theta at the tip, rad."""
        return float(self.at(self.rod.length)[0])

    def displacement(self, EA_t: float = np.inf, free_length: float = 0.0) -> float:
        """Length pulled from slack: the path's shortening and the stretch of the tendon, section by section."""
        _, shorter, pull = self.at(self.rod.length)[:3]
        return float(shorter + (self.rod.q_star * pull + self.tau0 * free_length) / EA_t)


def _tension(profile: Profile, mode: str, s: float, Theta: float) -> float:
    if mode == STUCK:
        return profile.before.tau(s)
    return profile.tau0 * float(np.exp((-1.0 if mode == SLIP_IN else 1.0) * profile.mu * Theta))


def _derivative(profile: Profile, mode: str, s: float, y: np.ndarray) -> np.ndarray:
    rod, tau = profile.rod, _tension(profile, mode, s, y[0])
    state, R = local(rod, tau), y[6:].reshape(3, 3)
    Theta_rate = profile.rates(s, mode, tau, state)[1]
    return np.concatenate([[Theta_rate, state.shorter, tau], R @ state.v, (R @ hat(state.u)).ravel()])


def _events(profile: Profile, mode: str) -> list[Callable]:
    """Where the bound meets the old tension: a slipping part gets stuck, a stuck one starts to slip."""
    before = profile.before
    if before is None:
        return []

    def gap(slip: str, sign: float) -> Callable:
        def event(s, y):
            return sign * (_tension(profile, slip, s, y[0]) - before.tau(s))

        vars(event).update(terminal=True, direction=-1.0)
        return event

    leaving = {SLIP_IN: 1.0, SLIP_OUT: -1.0}
    return [gap(mode, leaving[mode])] if mode != STUCK else [gap(each, -sign) for each, sign in leaving.items()]


def rubbed(rod: Rod, tau0: float, mu: float, before: Profile | None = None) -> Profile:
    """The profile after the base tension went to tau0 (N) from `before`, None for a slack tendon."""
    old = 0.0 if before is None else before.tau0
    mode = STUCK if before is not None and tau0 == old else SLIP_IN if tau0 >= old else SLIP_OUT
    profile = Profile(rod, mu, tau0, before, ())
    s, y = 0.0, np.concatenate([ZERO, rod.p0, np.eye(3).ravel()])
    for _ in range(20):
        run = solve_ivp(
            lambda at, state, now=profile, mode=mode: _derivative(now, mode, at, state), (s, rod.length), y,
            method="DOP853", rtol=1e-12, atol=1e-15, max_step=rod.length / 20, dense_output=True,
            events=_events(profile, mode),
        )  # fmt: skip
        assert run.sol is not None, run.message
        s, y = run.t[-1], run.y[:, -1]
        profile = replace(profile, pieces=(*profile.pieces, (s, mode, run.sol)))
        if run.status == 0:
            return profile
        hit = [bool(each.size) for each in run.t_events]
        mode = STUCK if mode != STUCK else SLIP_IN if hit[0] else SLIP_OUT
    raise ArithmeticError("the tendon changes between slip and stick without end")


def rubbed_to(
    rod: Rod, d: float, mu: float, before: Profile | None = None, EA_t: float = np.inf, free_length: float = 0.0
) -> Profile:
    """The profile after the pulled length went to d (m) from `before`."""
    if d <= 0.0:
        return rubbed(rod, 0.0, mu, before)
    miss = lambda tau0: rubbed(rod, tau0, mu, before).displacement(EA_t, free_length) - d  # noqa: E731
    low, high = 0.0, 1.05 * tension(rod, d, EA_t, free_length)
    while miss(high) < 0.0:
        low, high = high, 1.3 * high
    tau0 = float(brentq(miss, low, high, xtol=1e-13, rtol=1e-13))  # type: ignore[arg-type]
    return rubbed(rod, tau0, mu, before)


# ---- true arm: the tendon is free in the lumen and takes the place of least energy


@dataclass(frozen=True)
class Arm:
    """Place r (3,) of the free tendon, the section there, and whether the tendon touches the wall."""

    r: np.ndarray
    state: Local
    on_wall: bool


def pull_on_place(rod: Rod, tau: float, x: float, y: float) -> np.ndarray:
    """-1/tau dE/d(X, Y) of the least energy over v, u: (u x t) in the section, 1/m."""
    state = local(rod.at(x, y), tau)
    return cross(state.u, state.t)[:2]


def free_arm(rod: Rod, tau: float, centre: float, radius: float, steps: int = 8) -> Arm:
    """Where a tendon of tension tau lies in the lumen |(X, Y) - (centre, 0)| <= radius (both to the tendon's axis).

    The place that is reached from the straight line through the slack robot, followed as tau grows: stationary energy
    inside, on the wall the angle at which the pull is normal and outward.
    """
    place = root(lambda r: cross(rod.u_star, rod.v_star + cross(rod.u_star, [*r, 0.0]))[:2], [centre, 0.0]).x
    for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
        found = root(lambda r, part=part: pull_on_place(rod, part * tau, *r), place, tol=1e-14, options={"xtol": 1e-14})
        place = found.x
        if np.hypot(place[0] - centre, place[1]) > radius:
            return _on_wall(rod, tau, centre, radius)
        if np.abs(found.fun).max() > 1e-9:
            raise ArithmeticError("the free tendon's place was lost; take more steps")
    return Arm(np.array([*place, 0.0]), local(rod.at(*place), tau), False)


def _on_wall(rod: Rod, tau: float, centre: float, radius: float) -> Arm:
    def along(angle: float) -> float:
        pull = pull_on_place(rod, tau, centre + radius * np.cos(angle), radius * np.sin(angle))
        return float(pull @ [-np.sin(angle), np.cos(angle)])

    angle = root(lambda x: along(x[0]), [0.0], tol=1e-14).x[0]
    x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
    if pull_on_place(rod, tau, x, y) @ [np.cos(angle), np.sin(angle)] < 0.0:
        raise ArithmeticError("the tendon leaves the wall where it was expected to touch")
    return Arm(np.array([x, y, 0.0]), local(rod.at(x, y), tau), True)


def lift_off_tension(rod: Rod, centre: float, radius: float) -> float:
    """Tension (N) at which the tendon at the wall (centre + radius, 0) neither presses nor lifts."""
    pressure = lambda tau: pull_on_place(rod, tau, centre + radius, 0.0)[0]  # noqa: E731
    return float(brentq(pressure, 1e-6, 10.0, xtol=1e-15, rtol=1e-14))  # type: ignore[arg-type]


def energy(rod: Rod, tau: float, v: np.ndarray, u: np.ndarray, r: np.ndarray) -> float:
    """Energy per unit of s of strains and tendon place together, J/m."""
    dv, du = v - rod.v_star, u - rod.u_star
    return float(0.5 * dv @ (rod.Kse * dv) + 0.5 * du @ (rod.Kbt * du) + tau * np.linalg.norm(v + cross(u, r)))
