"""Independent oracle: rods in space in frictionless contact, as the minimum of a discretised energy.

A rod of N elements of constant strain, clamped at the origin with the identity (z along the base tangent), carries dead
forces at its nodes and keeps a signed distance >= 0 at its nodes. The unknowns are the strains themselves, so that the
elastic energy is a plain sum of squares; the nodes follow by

    R_{j+1} = R_j exp(h u_j^)      p_{j+1} = p_j + h R_j exp(h u_j^ / 2) v_j

SciPy's exact trust region in an augmented Lagrangian for the gaps leads from the straight rod, if nothing else is said,
towards the minimum, Newton's method on the active set into it: a stable equilibrium, though not always the only one.
No code and no formulation is shared with a shooting solve. The error is of second order in the length of an element:
the chords are (u h)^2 / 24 too long, loads and contacts sit at nodes, and the rod may be u h^2 / 8 deep in a wall
between two of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

Gap = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
STRAIGHT = np.array([0.0, 0.0, 1.0])
STIFFNESSES = (1e3, 3e3, 1e4, 3e4, 1e5)  # of the walls, EI / L^3, one after the other until the contacts settle


@dataclass(frozen=True, kw_only=True)
class EnergyRod:
    """SI, world frame = base frame. ``Kbt`` (3,) N m2 diagonal; ``Kse`` (3,) N diagonal, or None for a rod that neither
    stretches nor shears; ``u_star`` (3,) or (N, 3) 1/m in the section frame; dead loads ``line`` (3,) N/m and
    ``tip_force`` (3,) N.

    ``gap``: points (n, 3) -> (distance (n,) less the rod's radius, unit gradient (n, 3)); None without contact.
    ``free`` are the bending and twisting strains that may change: (1,) keeps the rod in the x-z plane.
    """

    length: float
    Kbt: tuple[float, float, float]
    Kse: tuple[float, float, float] | None = None
    u_star: np.ndarray = field(default_factory=lambda: np.zeros(3))
    line: np.ndarray = field(default_factory=lambda: np.zeros(3))
    tip_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gap: Gap | None = None
    free: tuple[int, ...] = (0, 1, 2)


@dataclass(frozen=True, kw_only=True)
class EnergyShape:
    """Nodes ``p`` (N+1, 3) m at ``s``, frames ``R`` (N+1, 3, 3), strains ``u``, ``v`` (N, 3) of the elements, ``force``
    (N+1,) N >= 0 by which the wall presses each node along ``normal`` (N+1, 3), ``gap`` (N+1,) m, ``energy`` J, and
    ``residual``: gradient of the energy and of the contact forces' work, in units of EI / L."""

    s: np.ndarray
    p: np.ndarray
    R: np.ndarray
    u: np.ndarray
    v: np.ndarray
    force: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    energy: float
    residual: float


def inside_tube(clearance: float) -> Gap:
    """The axis of a rod stays within ``clearance`` m of the z axis."""

    def gap(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        off = points * [1.0, 1.0, 0.0]
        rho = np.maximum(np.linalg.norm(off, axis=1), 1e-12 * clearance)
        return clearance - rho, -off / rho[:, None]

    return gap


def above_plane(distance: float, normal=(-1.0, 0.0, 0.0)) -> Gap:
    """The axis of a rod stays on the side of ``normal`` of the plane that is ``distance`` m from the origin."""
    n = np.asarray(normal, dtype=float)
    return lambda points: (points @ n + distance, np.tile(n, (len(points), 1)))


class _Chain:
    """The rod in units of L and EI = Kbt[0]: energy, its gradient and Hessian in q = sqrt(K h) (strain - strain*)."""

    def __init__(self, rod: EnergyRod, elements: int) -> None:
        self.N, self.h, self.rod = elements, 1.0 / elements, rod
        L, unit = rod.length, rod.Kbt[0] / rod.length**2
        self.columns = [*rod.free, *([3, 4, 5] if rod.Kse is not None else [])]
        K = np.array([*np.array(rod.Kbt) / rod.Kbt[0], *(np.array(rod.Kse or (1.0, 1.0, 1.0)) / unit)])
        self.scale = np.sqrt(K * self.h)[self.columns]
        u_star = np.broadcast_to(np.asarray(rod.u_star, dtype=float) * L, (elements, 3))
        self.rest = np.hstack([u_star, np.broadcast_to(STRAIGHT, (elements, 3))])
        self.load = np.tile(np.asarray(rod.line) * L / unit * self.h, (elements, 1))
        self.load[-1] *= 0.5
        self.load[-1] += np.asarray(rod.tip_force) / unit
        self.pressure, self.stiffness = np.zeros(elements), 0.0

    def strains(self, q: np.ndarray) -> np.ndarray:
        """(b, N, 6) of ``q`` (b, n)."""
        strain = np.tile(self.rest, (q.shape[0], 1, 1))
        strain[:, :, self.columns] += q.reshape(q.shape[0], self.N, -1) / self.scale
        return strain

    def gaps(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(b, N) and (b, N, 3) at the nodes beyond the base."""
        if self.rod.gap is None:
            return np.ones(p.shape[:2]), np.zeros(p.shape)
        d, normal = self.rod.gap(p.reshape(-1, 3) * self.rod.length)
        return d.reshape(p.shape[:2]) / self.rod.length, normal.reshape(p.shape)

    def shape(self, q: np.ndarray):
        """Frames (b, N+1, 3, 3), chords (b, N, 3) and nodes (b, N, 3) beyond the base."""
        strain = self.strains(q)
        u, v = strain[..., :3] * self.h, strain[..., 3:]
        half = _exp(0.5 * u)
        step = half @ half
        R = np.empty((q.shape[0], self.N + 1, 3, 3))
        R[:, 0] = np.eye(3)
        for j in range(self.N):
            np.matmul(R[:, j], step[:, j], out=R[:, j + 1])
        middle = R[:, :-1] @ half
        chords = self.h * (middle @ v[..., None])[..., 0]
        return u, R, middle, chords, np.cumsum(chords, axis=1)

    def press(self, d: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self.pressure - self.stiffness * d)

    def energy(self, q: np.ndarray) -> float:
        p = self.shape(q[None])[-1]
        total = 0.5 * q @ q - np.sum(self.load * p[0])
        if self.stiffness:
            total += np.sum(self.press(self.gaps(p)[0][0]) ** 2) / (2.0 * self.stiffness)
        return float(total)

    def gradients(self, q: np.ndarray) -> np.ndarray:
        """(b, n) of ``q`` (b, n)."""
        u, R, middle, chords, p = self.shape(q)
        d, normal = self.gaps(p)
        force = self.load + self.press(d)[..., None] * normal
        N = _sums_from_the_tip(force)
        turn = np.cross(chords, N)
        M = _sums_from_the_tip(turn) - turn
        back = R[:, :-1].swapaxes(-1, -2)
        by_u = 0.5 * _turned(_slope(0.5 * u), back, turn) + _turned(_slope(u), back, M)
        by_v = (middle.swapaxes(-1, -2) @ N[..., None])[..., 0]
        work = self.h * np.concatenate([by_u, by_v], axis=-1)[..., self.columns] / self.scale
        return q - work.reshape(q.shape)

    def gradient(self, q: np.ndarray) -> np.ndarray:
        return self.gradients(q[None])[0]

    def gap_slopes(self, q: np.ndarray, step: float = 1e-6) -> tuple[np.ndarray, np.ndarray]:
        """Gaps (N,) and their derivatives (N, n)."""
        shifts = step * np.concatenate([np.zeros((1, q.size)), np.eye(q.size), -np.eye(q.size)])
        d = self.gaps(self.shape(q + shifts)[-1])[0]
        return d[0], (d[1 : q.size + 1] - d[q.size + 1 :]).T / (2.0 * step)

    def hessian(self, q: np.ndarray, step: float = 1e-6) -> np.ndarray:
        shifts = step * np.eye(q.size)
        H = (self.gradients(q + shifts) - self.gradients(q - shifts)) / (2.0 * step)
        return 0.5 * (H + H.T)


def least_energy(rod: EnergyRod, elements: int = 60, u_start: np.ndarray | None = None) -> EnergyShape:
    """A minimum of the energy of ``rod``; ``u_start`` (3,) or (N, 3) 1/m, None for straight.

    Raises RuntimeError unless the gradient is below 1e-7 EI / L and the contacts settle.
    """
    chain = _Chain(rod, elements)
    start = np.zeros((elements, 6))
    start[:, :3] = 0.0 if u_start is None else np.asarray(u_start) * rod.length
    start[:, 3:] = STRAIGHT
    q = ((start - chain.rest)[:, chain.columns] * chain.scale).ravel()
    settled = False
    for stiffness in STIFFNESSES if rod.gap else (0.0,):
        chain.stiffness = stiffness
        options = {"gtol": 1e-3, "maxiter": 150, "initial_trust_radius": 0.5}
        q = minimize(chain.energy, q, jac=chain.gradient, hess=chain.hessian, method="trust-exact", options=options).x
        chain.pressure = chain.press(chain.gaps(chain.shape(q[None])[-1])[0][0]) if rod.gap else chain.pressure
        exact = _newton(chain, q, chain.pressure, stiffness)
        if exact is not None:
            (q, chain.pressure), settled = exact, True
            break
    chain.stiffness = 0.0
    residual = float(np.abs(chain.gradient(q)).max())
    if not settled or residual > 1e-7:
        raise RuntimeError(f"no minimum found: gradient {residual:.2g}, settled {settled}")
    return _result(rod, chain, q, residual)


def _newton(chain: _Chain, q: np.ndarray, pressure: np.ndarray, stiffness: float):
    """``q`` and pressures with the touching nodes exactly on the wall (primal-dual active set), None without success.

    The energy must rise in every direction that keeps these nodes on the wall: a minimum, no saddle.
    """
    before, chain.stiffness = None, 0.0
    for _ in range(40):
        d, slopes = chain.gap_slopes(q)
        on = pressure > stiffness * d if stiffness else np.zeros(d.size, dtype=bool)
        chain.pressure = np.where(on, pressure, 0.0)
        H, J, n = chain.hessian(q), slopes[on], q.size
        chain.pressure = np.zeros(d.size)
        A = np.block([[H, -J.T], [J, np.zeros((len(J), len(J)))]])
        solved = np.linalg.solve(A, np.concatenate([-chain.gradient(q), -d[on]]))
        step, pressure = solved[:n], np.zeros(d.size)
        pressure[on] = solved[n:]
        if np.abs(step).max() > 5.0:
            return None
        q = q + step
        if np.abs(step).max() < 1e-9 and np.array_equal(on, before) and pressure.min() >= 0.0:
            tangent = np.linalg.svd(J)[2][len(J) :] if len(J) else np.eye(n)
            return (q, pressure) if np.linalg.eigvalsh(tangent @ H @ tangent.T)[0] > 0.0 else None
        before = on
    return None


def _result(rod: EnergyRod, chain: _Chain, q: np.ndarray, residual: float) -> EnergyShape:
    L, unit = rod.length, rod.Kbt[0] / rod.length**2
    _, R, _, _, p = chain.shape(q[None])
    d, normal = chain.gaps(p)
    strain, base = chain.strains(q[None])[0], np.zeros((1, 3))
    touching = rod.gap is not None
    return EnergyShape(
        s=np.linspace(0.0, L, chain.N + 1), p=L * np.concatenate([base, p[0]]), R=R[0],
        u=strain[:, :3] / L, v=strain[:, 3:], normal=np.concatenate([base, normal[0]]),
        force=np.concatenate([[0.0], chain.pressure * unit * touching]),
        gap=np.concatenate([[np.nan], L * d[0]]) if touching else np.full(chain.N + 1, np.nan),
        energy=unit * L * float(0.5 * q @ q - np.sum(chain.load * p[0])), residual=residual,
    )  # fmt: skip


def _sums_from_the_tip(a: np.ndarray) -> np.ndarray:
    return np.cumsum(a[:, ::-1], axis=1)[:, ::-1]


def _turned(slope: np.ndarray, back: np.ndarray, a: np.ndarray) -> np.ndarray:
    """slope^T back a."""
    return (slope.swapaxes(-1, -2) @ (back @ a[..., None]))[..., 0]


def _hat(a: np.ndarray) -> np.ndarray:
    A = np.zeros((*a.shape, 3))
    A[..., 2, 1], A[..., 0, 2], A[..., 1, 0] = a[..., 0], a[..., 1], a[..., 2]
    return A - A.swapaxes(-1, -2)


def _exp(a: np.ndarray) -> np.ndarray:
    """Rotation (…, 3, 3) by the vector ``a`` (…, 3)."""
    x, A = np.linalg.norm(a, axis=-1)[..., None, None], _hat(a)
    return np.eye(3) + np.sinc(x / np.pi) * A + 0.5 * np.sinc(0.5 * x / np.pi) ** 2 * (A @ A)


def _slope(a: np.ndarray) -> np.ndarray:
    """J with d exp(a) = (J da)^ exp(a)."""
    x, A = np.linalg.norm(a, axis=-1)[..., None, None], _hat(a)
    x2 = np.maximum(x * x, 1e-30)
    third = np.where(x < 1e-2, 1 / 6 - x * x / 120 + x**4 / 5040, (1.0 - np.sinc(x / np.pi)) / x2)
    return np.eye(3) + 0.5 * np.sinc(0.5 * x / np.pi) ** 2 * A + third * (A @ A)
