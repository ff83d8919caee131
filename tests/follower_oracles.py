"""Independent oracle: rods under loads that turn with the section, under dead loads, and under point loads anywhere.

The wrench in the section frame is known at the tip, so p' = R v, R' = R u^, n' = -u x n - f, m' = -u x m - v x n - l is
an initial value problem from the tip to the base. Loads fixed in the body need nothing else: the pose found at the base
is moved to where it belongs. Dead loads leave the tip's orientation as three unknowns. The package shoots from the
base with the wrench in the world frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.spatial.transform import Rotation
from scipy.special import ellipeinc, ellipj, ellipk

from actuation_oracles import Rod, cross, hat, local


@dataclass(frozen=True, kw_only=True)
class PointLoad:
    """Force (N) and moment (N m) on the section at s; `follows`: fixed in the section frame, else in the world."""

    s: float
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    follows: bool = True


@dataclass(frozen=True, kw_only=True)
class Loads:
    """Loads per metre of s, fixed in the section (`body_`) or in the world (`dead_`), and point loads."""

    body_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    body_moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    dead_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    dead_moment: np.ndarray = field(default_factory=lambda: np.zeros(3))
    points: tuple[PointLoad, ...] = ()

    def __post_init__(self) -> None:
        for name in ("body_force", "body_moment", "dead_force", "dead_moment"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))

    def times(self, factor: float) -> Loads:
        points = tuple(
            replace(each, force=factor * np.asarray(each.force), moment=factor * np.asarray(each.moment))
            for each in self.points
        )
        names = ("body_force", "body_moment", "dead_force", "dead_moment")
        return Loads(points=points, **{name: factor * getattr(self, name) for name in names})

    @property
    def all_follow(self) -> bool:
        dead = np.abs(np.concatenate([self.dead_force, self.dead_moment])).max()
        return dead == 0.0 and all(each.follows for each in self.points)


@dataclass(frozen=True)
class Found:
    """Samples at s: position (n, 3), rotation (n, 3, 3), total force and moment (n, 3) in the section frame."""

    s: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    force: np.ndarray
    moment: np.ndarray

    @property
    def tip(self) -> np.ndarray:
        return self.position[-1]


def from_tip(rod: Rod, tau: float, loads: Loads, R_tip: np.ndarray, samples: np.ndarray, rtol: float = 1e-12):
    """States (samples, 18) = p, R, n, m of the rod held at its tip, p(L) = 0, R(L) = R_tip.

    At a point load the wrench listed is the one on the base side of it.
    """

    def derivative(s: float, y: np.ndarray) -> np.ndarray:
        R, n, m = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        state = local(rod, tau, n, m)
        f, lm = loads.body_force + R.T @ loads.dead_force, loads.body_moment + R.T @ loads.dead_moment
        dn, dm = -cross(state.u, n) - f, -cross(state.u, m) - cross(state.v, n) - lm
        return np.concatenate([R @ state.v, (R @ hat(state.u)).ravel(), dn, dm])

    y = np.concatenate([np.zeros(3), R_tip.ravel(), np.zeros(6)])
    at_points = [each.s for each in loads.points]
    stops = np.unique(np.concatenate([[0.0, rod.length], at_points, samples]))[::-1]
    unit = min(rod.Kbt[:2]) / rod.length**2
    scale = np.concatenate([np.full(3, rod.length), np.ones(9), np.full(3, unit), np.full(3, unit * rod.length)])
    found = {}
    for start, stop in pairwise([*stops, -1.0]):
        for each in loads.points:
            if each.s == start:
                turn = np.eye(3) if each.follows else y[3:12].reshape(3, 3).T
                y[12:15] += turn @ each.force
                y[15:18] += turn @ each.moment
        found[start] = y.copy()
        if stop < 0.0:
            break
        run = solve_ivp(derivative, (start, stop), y, method="DOP853", rtol=rtol, atol=0.01 * rtol * scale)
        assert run.success, run.message
        y = run.y[:, -1].copy()
    return np.stack([found[s] for s in samples])


def tip_rotation(rod: Rod, tau: float, loads: Loads, R0: np.ndarray, steps: int) -> np.ndarray:
    """R(L) for which the base comes out at R0, loads raised in equal steps from the rod without dead loads."""
    if loads.all_follow:
        return np.eye(3)
    base = np.zeros(1)
    start = from_tip(rod, tau, loads.times(0.0), np.eye(3), base)[0, 3:12].reshape(3, 3)
    R_tip, moved = R0 @ start.T, np.zeros(3)
    for factor in np.linspace(0.0, 1.0, steps + 1)[1:]:
        last, part = factor == 1.0, loads.times(factor)

        def miss(w, R_tip=R_tip, part=part, rtol=1e-12 if last else 1e-8):
            R = from_tip(rod, tau, part, Rotation.from_rotvec(w).as_matrix() @ R_tip, base, rtol)[0, 3:12]
            return Rotation.from_matrix(R.reshape(3, 3) @ R0.T).as_rotvec()

        found = root(miss, moved, tol=1e-13 if last else 1e-7)
        if np.abs(found.fun).max() > (1e-10 if last else 1e-5):
            raise ArithmeticError(f"no tip orientation found at load factor {factor}: {found.message}")
        moved, R_tip = found.x, Rotation.from_rotvec(found.x).as_matrix() @ R_tip
    return R_tip


def solve(rod: Rod, loads: Loads, tau: float = 0.0, s=None, R0=None, steps: int = 4) -> Found:
    """Equilibrium of the rod, clamped at p(0) = rod.p0, R(0) = R0, with its tendon pulled by tau without friction.

    Samples at `s`, by default base and tip. Follower loads have one solution; with dead loads it is the one that
    grows from the rod without external load in `steps` equal steps.
    """
    samples = np.array([0.0, rod.length]) if s is None else np.atleast_1d(np.asarray(s, dtype=float))
    R0 = np.eye(3) if R0 is None else R0
    y = from_tip(rod, tau, loads, tip_rotation(rod, tau, loads, R0, steps), np.concatenate([[0.0], samples]))
    base, rows = y[0], y[1:]
    turn = R0 @ base[3:12].reshape(3, 3).T
    position = rod.p0 + (rows[:, :3] - base[:3]) @ turn.T
    return Found(samples, position, turn @ rows[:, 3:12].reshape(-1, 3, 3), rows[:, 12:15], rows[:, 15:18])


# ---- closed forms in the plane: no extension, no shear


@dataclass(frozen=True)
class Plane:
    """Tip of a cantilever along +x that bends towards +y: coordinates over L, and the tip's angle (rad)."""

    x: float
    y: float
    angle: float


def transverse_follower(load: float) -> Plane:
    """Tip force P normal to the tip's tangent, load = P L^2 / EI.

    Seen from the tip, the angle phi between tangents obeys phi'' = w^2 cos phi from rest, w^2 = load: a pendulum of
    amplitude pi/2, sin((phi - pi/2) / 2) = k sn(w s - K), k^2 = 1/2. The tip turns by pi at load = 4 K^2 = 13.75.
    """
    w, k2 = np.sqrt(load), 0.5
    K = ellipk(k2)
    sn, cn, _, am = ellipj(w - K, k2)
    phi = 0.5 * np.pi + 2.0 * np.arcsin(np.sqrt(k2) * sn)
    along = 2.0 * np.sqrt(k2) * cn / w  # integral of cos phi = phi'(1) / w^2
    across = 2.0 * (ellipeinc(am, k2) + ellipeinc(0.5 * np.pi, k2)) / w - 1.0  # integral of sin phi
    x, y = np.cos(phi) * along + np.sin(phi) * across, np.sin(phi) * along - np.cos(phi) * across
    return Plane(float(x), float(y), float(phi))


def pressure(load: float) -> Plane:
    """Line load q normal to the rod everywhere, load = q L^3 / EI; initial value problem from the tip."""

    def derivative(_, state):
        phi, curvature, shear, axial = state[:4]  # phi: tangent seen from the tip, growing towards the base
        return [curvature, shear, load - curvature * axial, curvature * shear, np.cos(phi), np.sin(phi)]

    run = solve_ivp(derivative, (0.0, 1.0), np.zeros(6), method="DOP853", rtol=1e-13, atol=1e-15)
    phi, *_, along, across = run.y[:, -1]
    x, y = np.cos(phi) * along + np.sin(phi) * across, np.sin(phi) * along - np.cos(phi) * across
    return Plane(float(x), float(y), float(phi))
