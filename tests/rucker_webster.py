"""Independent oracle: tendon-driven rods in the differential form of Rucker & Webster (2011), IEEE T-RO 27(6).

The strains are integrated as states: p' = R v, R' = R u^, [v'; u'] = [[Kse + A, G], [B, Kbt + H]]^-1 [d; c]; the six
base wrench components are found by shooting on the six tip conditions. The package instead keeps the total wrench as
the state and solves the strains algebraically, so the two share no formulation and no code. Signs as in the 2011
paper: the moment equation carries -v^ Kse (v - v*), which the ExoNav paper misprints (physics.md section 1).

The state holds v - v* and u - u*, not v and u: EA (v - v*) would otherwise lose the digits that one nanometre needs.
Derivatives of the shooting residual come from complex steps (one real and six perturbed rods integrated side by side on
the same mesh), hence everything below must stay analytic: no abs, no conj, no norm.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

COMPLEX_STEP = 1e-30


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """r(s) = [cx + rho cos(angle + omega s), cy + rho sin(angle + omega s), 0]; ends (is tied) at `end`, in s."""

    cx: float = 0.0
    cy: float = 0.0
    rho: float = 0.0
    angle: float = 0.0
    omega: float = 0.0
    end: float = np.inf

    def path(self, s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """r, r', r'' in the section frame."""
        cos, sin = np.cos(self.angle + self.omega * s), np.sin(self.angle + self.omega * s)
        radial, around = self.rho * np.array([cos, sin, 0.0]), self.rho * np.array([-sin, cos, 0.0])
        return np.array([self.cx, self.cy, 0.0]) + radial, self.omega * around, -(self.omega**2) * radial


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One static problem, SI. `force`, `moment` are line loads, all loads dead and in the world frame."""

    length: float
    Kse: np.ndarray
    Kbt: np.ndarray
    v_star: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    u_star: np.ndarray = field(default_factory=lambda: np.zeros(3))
    tendons: tuple[Tendon, ...] = ()
    tension: tuple[float, ...] = ()
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    tip_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    tip_moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    p0: np.ndarray = field(default_factory=lambda: np.zeros(3))
    R0: np.ndarray = field(default_factory=lambda: np.eye(3))
    rtol: float = 1e-12

    def __post_init__(self) -> None:
        for name in ("Kse", "Kbt", "v_star", "u_star", "force", "moment", "tip_force", "tip_moment", "p0", "R0"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))

    def loaded(self, factor: float) -> Problem:
        loads = ("force", "moment", "tip_force", "tip_moment")
        return replace(self, **{name: factor * getattr(self, name) for name in loads})

    @property
    def wrench_unit(self) -> np.ndarray:
        """Force by EI/L^2, moment by EI/L (physics.md section 2)."""
        stiffness = min(self.Kbt[0], self.Kbt[1])
        return np.repeat([stiffness / self.length**2, stiffness / self.length], 3)

    def active(self, s: float) -> list[tuple[Tendon, float]]:
        return [(t, tau) for t, tau in zip(self.tendons, self.tension, strict=True) if tau > 0.0 and t.end > s]


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Samples at `s`; wrench is the total (rod and tendons), world frame."""

    s: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    v: np.ndarray
    u: np.ndarray
    base_wrench: np.ndarray
    residual: float

    @property
    def tip(self) -> np.ndarray:
        return self.position[-1]


def hat(x: np.ndarray) -> np.ndarray:
    """x^ for the last axis."""
    out = np.zeros((*x.shape, 3), dtype=x.dtype)
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = x[..., 2], -x[..., 1], x[..., 0]
    return out


def times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return (matrix @ vector[..., None])[..., 0]


def local_system(problem: Problem, s: float, w: np.ndarray, e: np.ndarray, tendons: list):
    """Matrix [[Kse + A, G], [B, Kbt + H]], the tendons' (a; b), and the local wrench of rod and tendons at s.

    w = v - v*, e = u - u*, any leading axes.
    """
    u, v = problem.u_star + e, problem.v_star + w
    matrix = np.zeros((*w.shape[:-1], 6, 6), dtype=w.dtype)
    matrix[..., range(6), range(6)] = np.concatenate([problem.Kse, problem.Kbt])
    push = np.zeros((*w.shape[:-1], 6), dtype=w.dtype)
    wrench = np.concatenate([problem.Kse * w, problem.Kbt * e], axis=-1)
    u_hat = hat(u)
    for tendon, tau in tendons:
        r, dr, ddr = tendon.path(s)
        r_hat, u_dr = hat(r), times(u_hat, dr)
        q = times(u_hat, r) + dr + v
        length = np.sqrt((q * q).sum(-1))[..., None]
        q_hat = hat(q)
        A = -tau * (q_hat @ q_hat) / length[..., None] ** 3
        B = r_hat @ A
        matrix[..., :3, :3] += A
        matrix[..., :3, 3:] -= A @ r_hat
        matrix[..., 3:, :3] += B
        matrix[..., 3:, 3:] -= B @ r_hat
        a = times(A, times(u_hat, q) + u_dr + ddr)
        push += np.concatenate([a, times(r_hat, a)], axis=-1)
        t = tau * q / length
        wrench += np.concatenate([t, times(r_hat, t)], axis=-1)
    return matrix, push, wrench


def derivative(problem: Problem, s: float, y: np.ndarray, tendons: list) -> np.ndarray:
    """Right-hand side for states y (batch, 18) = p, R (row major), v - v*, u - u*."""
    R, w, e = y[:, 3:12].reshape(-1, 3, 3), y[:, 12:15], y[:, 15:18]
    v, u = problem.v_star + w, problem.u_star + e
    matrix, push, _ = local_system(problem, s, w, e, tendons)
    u_hat, n, m = hat(u), problem.Kse * w, problem.Kbt * e
    R_T = R.swapaxes(-1, -2)
    d = -times(u_hat, n) - times(R_T, problem.force) - push[:, :3]
    c = -times(u_hat, m) - times(hat(v), n) - times(R_T, problem.moment) - push[:, 3:]
    strain_rate = np.linalg.solve(matrix, np.concatenate([d, c], axis=-1)[..., None])[..., 0]
    return np.concatenate([times(R, v), (R @ u_hat).reshape(-1, 9), strain_rate], axis=-1)


def strains(problem: Problem, s: float, wrench: np.ndarray, tendons: list) -> np.ndarray:
    """(v - v*, u - u*) at which rod and tendons carry the local `wrench` (batch, 6): a strictly convex problem."""
    x = np.zeros_like(wrench)
    unit = np.concatenate([problem.Kse, problem.Kbt])
    for iteration in range(60):
        matrix, _, carried = local_system(problem, s, x[:, :3], x[:, 3:], tendons)
        step = np.linalg.solve(matrix, (wrench - carried)[..., None])[..., 0]
        far = np.max(np.abs(step.real) * np.sqrt(unit)) / np.sqrt(unit.max() * 0.1)
        x = x + step * min(1.0, 1.0 / max(far, 1e-300))
        if iteration > 2 and np.all(np.abs(step.real) <= 1e-15 * (1e-6 + np.abs(x.real))):
            break
    for _ in range(2):  # the complex parts follow one Newton step behind the real ones
        matrix, _, carried = local_system(problem, s, x[:, :3], x[:, 3:], tendons)
        x = x + np.linalg.solve(matrix, (wrench - carried)[..., None])[..., 0]
    return x


def shoot(problem: Problem, base_wrench: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """States (samples, batch, 18) for base wrenches (batch, 6), total and in the world frame."""
    R0 = problem.R0
    local = np.concatenate([base_wrench[:, :3] @ R0, base_wrench[:, 3:] @ R0], axis=-1)
    tendons = problem.active(0.0)
    frame = np.broadcast_to(np.concatenate([problem.p0, R0.ravel()]), (len(local), 12))
    y = np.concatenate([frame, strains(problem, 0.0, local, tendons)], axis=-1)
    ends = [t.end for t, _ in tendons if t.end < problem.length * (1 - 1e-12)]
    stops = np.unique(np.concatenate([[0.0], ends, samples]))
    small = problem.wrench_unit / np.concatenate([problem.Kse, problem.Kbt])
    atol = problem.rtol * np.concatenate([np.full(3, problem.length), np.ones(9), 1e-2 * small])
    found = {0.0: y}
    for start, stop in pairwise(stops):
        tendons = problem.active(start)
        run = solve_ivp(
            lambda s, flat, t=tendons: derivative(problem, s, flat.reshape(-1, 18), t).ravel(),
            (start, stop), y.ravel(), method="DOP853", rtol=problem.rtol, atol=np.tile(atol, len(y)),
        )  # fmt: skip
        if not run.success:
            raise ArithmeticError(run.message)
        y = run.y[:, -1].reshape(-1, 18)
        found[stop] = y
        if stop in ends:  # total force and moment are continuous where a tendon is tied, the strains jump
            carried = local_system(problem, stop, y[:, 12:15], y[:, 15:18], tendons)[2]
            y = np.concatenate([y[:, :12], strains(problem, stop, carried, problem.active(stop))], axis=-1)
    return np.stack([found[s] for s in samples])


def tip_residual(problem: Problem, y: np.ndarray) -> np.ndarray:
    """Kse (v - v*) + sum tau t - R^T F and the moment's counterpart, scaled; states y (batch, 18) at the tip."""
    at_tip = problem.active(problem.length * (1 - 1e-12))
    carried = local_system(problem, problem.length, y[:, 12:15], y[:, 15:18], at_tip)[2]
    R_T = y[:, 3:12].reshape(-1, 3, 3).swapaxes(-1, -2)
    applied = np.concatenate([times(R_T, problem.tip_force), times(R_T, problem.tip_moment)], axis=-1)
    return (carried - applied) / problem.wrench_unit


def newton(problem: Problem, guess: np.ndarray, iterations: int = 12) -> tuple[np.ndarray, float] | None:
    """Scaled base wrench that meets the tip conditions, and the residual left; None where it does not converge."""
    x, best = guess, np.inf
    unit, tip = problem.wrench_unit, np.array([problem.length])
    for _ in range(iterations):
        probe = np.vstack([np.zeros(6), 1j * COMPLEX_STEP * np.eye(6)]) + x
        residual = tip_residual(problem, shoot(problem, probe * unit, tip)[0])
        value, jacobian = np.real(residual[0]), np.imag(residual[1:]).T / COMPLEX_STEP
        size = np.abs(value).max()
        if not np.isfinite(size) or size > 100 * max(best, 1.0):
            return None
        step = np.linalg.solve(jacobian, -value)
        x = x + step
        rounding_reached = size < 1e-6 and size >= 0.5 * best
        if rounding_reached or (size < 1e-6 and np.abs(step).max() < 1e-10 * (1 + np.abs(x).max())):
            return x, size
        best = min(best, size)
    return None


def base_wrench(problem: Problem) -> tuple[np.ndarray, float]:
    """Scaled base wrench by continuation in the external loads from the tendon-only state, where it is zero."""
    total_force = problem.tip_force + problem.length * problem.force
    total_moment = problem.tip_moment + problem.length * problem.moment
    size = np.abs(np.concatenate([total_force, total_moment]) / problem.wrench_unit).max()
    if size == 0.0:
        return np.zeros(6), 0.0
    rough = replace(problem, rtol=1e-7)
    done, stride, x, before = 0.0, min(1.0, 1.5 / size), np.zeros(6), None
    while done < 1.0:
        factor = 1.0 if done + 1.01 * stride > 1.0 else done + stride
        guess = x if before is None else x + (x - before[1]) * (factor - done) / (done - before[0])
        guess = np.concatenate([factor * total_force / problem.wrench_unit[:3], guess[3:]])
        result = newton(rough.loaded(factor), guess)
        if result is None:
            stride *= 0.5
            if stride < 1e-5:
                raise ArithmeticError(f"the oracle stopped at load factor {done}")
            continue
        before, x, done, stride = (done, x), result[0], factor, 1.4 * stride
    result = newton(problem, x)
    if result is None:
        raise ArithmeticError("the oracle's last Newton did not converge")
    return result


def solve(problem: Problem, s: np.ndarray | None = None) -> Solution:
    """Shape at `s` (default: the tip only)."""
    samples = np.atleast_1d(problem.length if s is None else np.asarray(s, dtype=float))
    x, residual = base_wrench(problem)
    wrench = x * problem.wrench_unit
    y = shoot(problem, wrench[None, :], samples)[:, 0]
    return Solution(
        s=samples, position=y[:, :3], rotation=y[:, 3:12].reshape(-1, 3, 3), v=problem.v_star + y[:, 12:15],
        u=problem.u_star + y[:, 15:18], base_wrench=wrench, residual=residual,
    )  # fmt: skip


def from_robot(
    robot, tension=(), *, gravity=(0, 0, 0), force=(0, 0, 0), moment=(0, 0, 0), tip_force=(0, 0, 0),
    tip_moment=(0, 0, 0), insertion=1.0, rotation=0.0,
) -> Problem:  # fmt: skip
    """The Problem of a tendonrod Robot, read from its section numbers and routing table alone."""
    section = robot.section
    inside = (1.0 - insertion) * section.L_na
    routing = np.asarray(robot.routing, dtype=float).reshape(-1, 6)
    tendons = tuple(
        Tendon(cx=cx, cy=cy, rho=rho, angle=angle + omega * inside, omega=omega, end=end - inside)
        for cx, cy, rho, angle, omega, end in routing
    )
    R0 = Rotation.from_euler("z", rotation).as_matrix()
    return Problem(
        length=insertion * section.L_na, Kse=section.Kse, Kbt=section.Kbt, v_star=section.v_star, u_star=section.u_star,
        tendons=tendons, tension=tuple(np.broadcast_to(np.asarray(tension, dtype=float), len(tendons))),
        force=np.asarray(force, dtype=float) + section.line_density * np.asarray(gravity, dtype=float), moment=moment,
        tip_force=tip_force, tip_moment=tip_moment, p0=R0 @ [-section.r_na, 0.0, 0.0], R0=R0,
    )  # fmt: skip
