"""Independent oracle: planar rods between two straight frictionless walls, by exact multi-arc shooting.

The rod is clamped at the origin along z and bends in the x-z plane, theta from z towards x (a rotation about y, as
u = (0, theta', 0)). The walls are x = lower and x = upper; the positions are those of the rod's axis, so a tube of
outer radius r in a channel of half width R has lower, upper = -(R - r), R - r. Equilibrium, with n the internal force:

    EI (theta' - curvature) = M      M' = -(z' n_x - x' n_z)      n(s) = tip force + line (L - s) + forces of the walls
    local stretch 1 + n_t / EA, local shear n_n / GA, (n_n, n_t) = n in the frame of the section

Unknown are M(0), the force and the place of every touch. A touch inside the rod is tangent to the wall; with shear, in
the mean of both sides, since the axis has a kink of P / GA there, an error of about (P / GA)^2 / curvature (an
estimate). A rod that lies flat on the wall from s = a to its free end has x = wall, x' = 0 at a. Without shear the wall
presses there with a concentrated force, and M(a) = 0; with shear the reaction decays over l = sqrt(EI / GA), and
M(a) = n_x(a) l tanh((L - a) / l). Touches come and go along a path of growing load (natural curvature, line load and
tip force together), so that the result is the equilibrium which the unloaded straight rod is led to.

Everything returned is SI. Shooting is done in units of the length and of EI / length^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

CLEAR = 1e-9  # of the length: depth in a wall, outside the kinks of shear, that counts as a new touch
CONVERGED = 1e-10


@dataclass(frozen=True, kw_only=True)
class PlanarRod:
    """m, N m2, N, N, 1/m; ``line`` (f_x, f_z) N/m and ``tip_force`` (F_x, F_z) N are dead; walls in m."""

    length: float
    EI: float
    EA: float = np.inf
    GA: float = np.inf
    curvature: float = 0.0
    line: tuple[float, float] = (0.0, 0.0)
    tip_force: tuple[float, float] = (0.0, 0.0)
    lower: float = -np.inf
    upper: float = np.inf

    def scaled(self) -> PlanarRod:
        """The same rod with length 1 and EI 1."""
        L, unit = self.length, self.EI / self.length**2
        f, F = np.array(self.line) * L / unit, np.array(self.tip_force) / unit
        return PlanarRod(
            length=1.0, EI=1.0, EA=self.EA / unit, GA=self.GA / unit, curvature=self.curvature * L,
            line=(f[0], f[1]), tip_force=(F[0], F[1]), lower=self.lower / L, upper=self.upper / L,
        )  # fmt: skip

    def loaded(self, share: float) -> PlanarRod:
        f, F = share * np.array(self.line), share * np.array(self.tip_force)
        return replace(self, curvature=share * self.curvature, line=(f[0], f[1]), tip_force=(F[0], F[1]))


@dataclass(frozen=True, kw_only=True)
class Touch:
    """A touch at ``s`` with the wall on ``side`` (-1 lower, +1 upper) that presses with ``force`` N >= 0.

    kind: "point" inside the rod, "tip", or "flat": the rod lies on the wall from ``s`` to its end, ``force`` is the
    concentrated one at ``s`` and ``line`` N/m of the rod beyond is carried by the wall as well.
    """

    s: float
    side: int
    force: float
    kind: str = "point"


@dataclass(frozen=True, kw_only=True)
class PlanarShape:
    """Equilibrium of a `PlanarRod`: ``touches`` in the order of s, base moment (N m), scaled shooting residual."""

    rod: PlanarRod
    touches: tuple[Touch, ...]
    base_moment: float
    residual: float

    def at(self, s) -> dict[str, np.ndarray]:
        """x, z (m), theta (rad), moment (N m, internal) at arc lengths ``s`` (n,), increasing, m."""
        rod, L = self.rod, self.rod.length
        touches = _scaled_touches(self)
        rows = _sample(rod.scaled(), self.base_moment * L / rod.EI, touches, np.asarray(s, dtype=float) / L)
        return {"x": L * rows[0], "z": L * rows[1], "theta": rows[2], "moment": rows[3] * rod.EI / L}

    @property
    def contact_length(self) -> float:
        """Length (m) that lies flat on a wall."""
        return sum(self.rod.length - each.s for each in self.touches if each.kind == "flat")

    @property
    def base_force(self) -> np.ndarray:
        """Internal force (n_x, n_z) N at the clamp: everything that acts on the rod beyond it."""
        return _force(self.rod, self.touches, 0.0)


def equilibrium(rod: PlanarRod, steps: int = 10) -> PlanarShape:
    """The equilibrium on the path of growing load, in ``steps`` or more. Raises RuntimeError where it is lost."""
    scaled = rod.scaled()
    share, stride, base_moment, touches, residual = 0.0, 1.0 / steps, 0.0, (), 0.0
    while share < 1.0:
        target = min(1.0, share + stride)
        found = _settled(scaled.loaded(target), base_moment, touches)
        if found is None:
            stride *= 0.5
            if stride < 1e-4:
                raise RuntimeError(f"no equilibrium beyond {share:.4f} of the load, touches {touches}")
            continue
        (base_moment, touches, residual), share = found, target
    L, unit = rod.length, rod.EI / rod.length**2
    touches = tuple(replace(each, s=each.s * L, force=each.force * unit) for each in touches)
    return PlanarShape(rod=rod, touches=touches, base_moment=base_moment * unit * L, residual=residual)


def floor_contact(length: float, EI: float, q: float, gap: float, EA: float = np.inf, GA: float = np.inf):
    """Cantilever under a uniform dead line load ``q`` N/m towards +x, over a floor at x = ``gap`` m: a `PlanarShape`.

    No touch, a "tip" touch, or a "flat" one. Beam theory: the tip touches where q L^4 = 8 EI gap and lies down where
    q L^4 = 72 EI gap; then a = (72 EI gap / q)^(1/4), the force at a is q a / 3 and the base moment q a^2 / 6.
    """
    return equilibrium(PlanarRod(length=length, EI=EI, EA=EA, GA=GA, line=(q, 0.0), upper=gap))


def channel_contact(length: float, EI: float, curvature: float, clearance: float, **more):
    """Precurved cantilever in a channel of half width ``clearance`` m around its clamped tangent: a `PlanarShape`.

    ``more``: EA, GA, line, tip_force of `PlanarRod`. Beam theory: the tip touches where curvature L^2 = 2 clearance,
    with 3 EI (curvature L^2 / 2 - clearance) / L^3.
    """
    rod = PlanarRod(length=length, EI=EI, curvature=curvature, lower=-clearance, upper=clearance, **more)
    return equilibrium(rod)


def _settled(rod: PlanarRod, base_moment: float, touches: tuple[Touch, ...]):
    """Base moment, touches and residual at this load, with touches added and dropped until none is wrong."""
    for _ in range(6):
        solved = _shoot(rod, base_moment, touches)
        if solved is None:
            return None
        base_moment, touches, residual = solved
        better = _mended(rod, base_moment, touches)
        if better == touches:
            return base_moment, touches, residual
        touches = better
    return None


def _mended(rod: PlanarRod, base_moment: float, touches: tuple[Touch, ...]) -> tuple[Touch, ...]:
    """The touches without one that pulls, with one where the rod is in a wall; changed in one place at most."""
    pulling = [each for each in touches if each.force < 0.0]
    if pulling:
        worst = min(pulling, key=lambda each: each.force)
        return tuple(each for each in touches if each is not worst)
    last = touches[-1] if touches else None
    if last is not None and last.kind == "flat" and last.s > 1.0:
        return (*touches[:-1], replace(last, s=1.0, kind="tip"))
    s = np.linspace(0.0, 1.0, 2001)
    x, _, theta, _ = _sample(rod, base_moment, touches, s)
    if last is not None and last.kind == "tip" and last.side * _slope(rod, touches, 1.0, theta[-1]) < 0.0:
        return (*touches[:-1], replace(last, s=1.0 - 1e-3, kind="flat"))
    depth = np.maximum(x - rod.upper, rod.lower - x)
    depth -= sum((10.0 * (each.force / rod.GA) ** 2 for each in touches), CLEAR)
    worst = int(np.argmax(depth))
    if depth[worst] <= 0.0:
        return touches
    side = 1 if x[worst] > 0.0 else -1
    new = Touch(s=s[worst], side=side, force=0.0, kind="tip" if worst == s.size - 1 else "point")
    return tuple(sorted((*touches, new), key=lambda each: each.s))


def _shoot(rod: PlanarRod, base_moment: float, touches: tuple[Touch, ...]):
    def placed(unknown: np.ndarray) -> tuple[Touch, ...]:
        free = iter(unknown[1:])
        return tuple(
            replace(each, force=next(free), s=each.s if each.kind == "tip" else next(free)) for each in touches
        )

    def missed(unknown: np.ndarray) -> np.ndarray:
        here = placed(unknown)
        s = np.array([each.s for each in here])
        if np.any(np.diff(s, prepend=0.0) <= 0.0) or np.any(np.abs(unknown) > 1e6) or np.any(s > 1.5):
            return np.full(unknown.size, 1e3)
        return _residual(rod, unknown[0], here)

    start = [base_moment]
    for each in touches:
        start += [each.force] if each.kind == "tip" else [each.force, each.s]
    found = root(missed, start, method="hybr", options={"xtol": 1e-13, "maxfev": 60 * len(start)})
    residual = float(np.abs(found.fun).max())
    return (float(found.x[0]), placed(found.x), residual) if residual < CONVERGED else None


def _residual(rod: PlanarRod, base_moment: float, touches: tuple[Touch, ...]) -> np.ndarray:
    """Distance from the wall and slope at the touches, moment at the free end or where the rod lies down."""
    state, begin, missed = np.array([0.0, 0.0, 0.0, base_moment]), 0.0, []
    for each in touches:
        state, begin = _integrate(rod, touches, begin, each.s, state)[0], each.s
        missed.append(state[0] - (rod.upper if each.side > 0 else rod.lower))
        if each.kind != "tip":
            before, after = (_slope(rod, touches, each.s, state[2], toward) for toward in (-1, 1))
            missed.append(before if each.kind == "flat" else 0.5 * (before + after))
    if touches and touches[-1].kind == "flat":
        reach, n_x = np.sqrt(rod.EI / rod.GA), -touches[-1].side * touches[-1].force
        end = n_x * reach * np.tanh((1.0 - begin) / reach) if reach else 0.0
        return np.array([*missed, state[3] - end])
    if begin < 1.0:
        state = _integrate(rod, touches, begin, 1.0, state)[0]
    return np.array([*missed, state[3]])


def _force(rod: PlanarRod, touches: tuple[Touch, ...], s: float, toward: int = 1) -> np.ndarray:
    """Internal force (n_x, n_z) just beyond ``s`` (toward = 1) or just before it (-1)."""
    flat = bool(touches) and touches[-1].kind == "flat"
    end = touches[-1].s if flat else rod.length
    walls = -sum(each.side * each.force for each in touches if each.s > s or (each.s == s and toward < 0))
    return np.array(rod.tip_force) + np.array(rod.line) * (end - s) + np.array([walls, 0.0])


def _strain(rod: PlanarRod, n_x: float, n_z: float, theta: float) -> tuple[float, float]:
    """x', z' of the axis."""
    cos, sin = math.cos(theta), math.sin(theta)
    shear, stretch = (cos * n_x - sin * n_z) / rod.GA, 1.0 + (sin * n_x + cos * n_z) / rod.EA
    return sin * stretch + cos * shear, cos * stretch - sin * shear


def _slope(rod: PlanarRod, touches: tuple[Touch, ...], s: float, theta: float, toward: int = -1) -> float:
    n_x, n_z = _force(rod, touches, s, toward)
    return _strain(rod, n_x, n_z, theta)[0]


def _integrate(rod: PlanarRod, touches: tuple[Touch, ...], begin: float, end: float, state, at=()):
    """x, z, theta, M at ``end``, and their rows (4, n) at ``at``, over an arc without touches inside."""
    (n_x0, n_z0), (f_x, f_z) = _force(rod, touches, begin).tolist(), rod.line

    def slope(s, y):
        n_x, n_z = n_x0 - f_x * (s - begin), n_z0 - f_z * (s - begin)
        x, z = _strain(rod, n_x, n_z, y[2])
        return x, z, rod.curvature + y[3], n_z * x - n_x * z

    arc = solve_ivp(slope, (begin, end), state, method="DOP853", rtol=1e-13, atol=1e-14, dense_output=len(at) > 0)
    return arc.y[:, -1], arc.sol(at) if arc.sol else np.empty((4, 0))


def _sample(rod: PlanarRod, base_moment: float, touches: tuple[Touch, ...], s: np.ndarray) -> np.ndarray:
    """Rows x, z, theta, M (4, n) at ``s``."""
    state, rows = np.array([0.0, 0.0, 0.0, base_moment]), []
    flat = bool(touches) and touches[-1].kind == "flat"
    ends = [each.s for each in touches if each.kind != "tip"] + ([] if flat else [1.0])
    begin = 0.0
    for i, end in enumerate(ends):
        last = i == len(ends) - 1 and not flat
        inside = s[(s >= begin) & ((s <= end) if last else (s < end))]
        state, arc = _integrate(rod, touches, begin, end, state, inside)
        rows.append(arc)
        begin = end
    if flat:
        beyond = s[s >= begin]
        still = np.zeros(beyond.size)
        rows.append(np.array([state[0] + still, state[1] + beyond - begin, still, still]))
    return np.concatenate(rows, axis=1)


def _scaled_touches(shape: PlanarShape) -> tuple[Touch, ...]:
    L, unit = shape.rod.length, shape.rod.EI / shape.rod.length**2
    return tuple(replace(each, s=each.s / L, force=each.force / unit) for each in shape.touches)
