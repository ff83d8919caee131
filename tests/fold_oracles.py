"""Independent oracle: the fold of a planar cantilever under a dead tip force that turns, and buckling loads.

Inextensible elastica, clamped at the origin along +x. The tip force is -P (cos alpha, sin alpha): compression at
alpha = 0, where the rod has buckled towards +y; alpha > 0 turns it against the bend. With psi = theta - alpha and
k^2 = P / EI, psi'' = -k^2 sin psi from psi(L) = psi_L, psi'(L) = 0: a pendulum, sin(psi / 2) = p sn(k (s - L) + K(p)),
p = sin(psi_L / 2). The clamp asks for psi(0) = -alpha, hence all equilibria in one formula,

    alpha(p) = 2 asin(p sn(k L - K(p), p)),   tip angle = 2 asin(p) + alpha,

and the stable branch ends where alpha(p) is largest. Out of the plane the rod needs to be stiffer (EI_x, GJ >> EI_y):
an isotropic one would swing round instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipj, ellipk, jv

EULER = 0.25 * np.pi**2  # EI / L^2, clamped and free


@dataclass(frozen=True)
class Elastica:
    """One equilibrium, lengths over L: turning angle alpha, tip angle theta_L (rad), tip, modulus p, base curvature."""

    alpha: float
    tip_angle: float
    x: float
    y: float
    modulus: float
    base_curvature: float


def elastica(load: float, p: float) -> Elastica:
    """The equilibrium with modulus p = sin((theta_L - alpha) / 2) under the load P L^2 / EI; elliptic functions."""
    k, m = np.sqrt(load), p * p
    sn, cn, _, am = ellipj(ellipk(m) - k, m)
    alpha = -2.0 * np.arcsin(p * sn)
    curvature = 2.0 * k * p * cn
    along = 2.0 / k * (ellipeinc(0.5 * np.pi, m) - ellipeinc(am, m)) - 1.0  # integral of cos psi
    across = curvature / k**2  # integral of sin psi, as psi'' = -k^2 sin psi
    x, y = np.cos(alpha) * along - np.sin(alpha) * across, np.sin(alpha) * along + np.cos(alpha) * across
    return Elastica(float(alpha), float(2 * np.arcsin(p) + alpha), float(x), float(y), float(p), float(curvature))


def buckled(load: float) -> Elastica:
    """The buckled state under pure compression, alpha = 0: k L = K(p)."""
    k = np.sqrt(load)
    return elastica(load, float(np.sqrt(brentq(lambda m: ellipk(m) - k, 0.0, 1.0 - 1e-15, xtol=1e-16))))  # type: ignore[arg-type]


def _alpha_slope(load: float, p: float) -> float:
    """d alpha / d p by a central difference of sixth order (error near 1e-11 of the formula's scale)."""
    h = 1e-3 * min(p, 1.0 - p)
    weights = ((1, 45.0), (2, -9.0), (3, 1.0))
    return sum(w * (elastica(load, p + i * h).alpha - elastica(load, p - i * h).alpha) for i, w in weights) / (60 * h)


def fold(load: float) -> Elastica:
    """End of the stable branch that starts at `buckled(load)`, load > EULER: the largest alpha."""
    p = buckled(load).modulus
    before = p
    while _alpha_slope(load, p) < 0.0:
        before, p = p, p - 0.02 * min(p, 1.0 - p)
    return elastica(load, float(brentq(lambda x: _alpha_slope(load, x), p, before, xtol=1e-14)))  # type: ignore[arg-type]


def stable_branch(load: float, alpha: float) -> Elastica:
    """The stable equilibrium at the turning angle alpha, from 0 to the fold's."""
    start, end = buckled(load).modulus, fold(load).modulus
    p = brentq(lambda x: elastica(load, x).alpha - alpha, end, start, xtol=1e-15)
    return elastica(load, float(p))  # type: ignore[arg-type]


def shot(load: float, psi_tip: float) -> np.ndarray:
    """(alpha, d alpha / d psi_L, along, across) by integration from the tip to the base, with the variation."""

    def derivative(_, y):
        return [y[1], -load * np.sin(y[0]), y[3], -load * np.cos(y[0]) * y[2], np.cos(y[0]), np.sin(y[0])]

    run = solve_ivp(derivative, (0.0, 1.0), [psi_tip, 0, 1, 0, 0, 0], method="DOP853", rtol=1e-12, atol=1e-14)
    psi, _, varied, _, along, across = run.y[:, -1]
    return np.array([-psi, -varied, along, across])


def fold_by_shooting(load: float, near: float) -> Elastica:
    """The fold again, without elliptic functions; `near`: an angle psi_L within 0.02 rad of it."""
    psi = float(brentq(lambda x: shot(load, x)[1], near - 0.02, near + 0.02, xtol=1e-14))  # type: ignore[arg-type]
    alpha, _, along, across = shot(load, psi)
    x, y = np.cos(alpha) * along - np.sin(alpha) * across, np.sin(alpha) * along + np.cos(alpha) * across
    return Elastica(alpha, psi + alpha, x, y, float(np.sin(0.5 * psi)), load * across)


# ---- straight states that buckle, clamped and free


def euler_load(EI: float, L: float, EA: float = np.inf, GA: float = np.inf) -> float:
    """Buckling force (N) of a Cosserat rod: P (1 - P / EA + P / GA) = (pi/2)^2 EI / L^2.

    At the rotation theta the shear force is P theta, the axis leans by (1 - P / EA) theta + P theta / GA, and
    EI theta'' + P (that) = 0; nu = L is the unloaded length. The smaller positive root; ArithmeticError if none.
    """
    target, c = EULER * EI / L**2, 1.0 / GA - 1.0 / EA
    disc = 1.0 + 4.0 * c * target
    if disc < 0.0:
        raise ArithmeticError("a rod this easily compressed does not buckle")
    return 2.0 * target / (1.0 + np.sqrt(disc))


def greenhill_load() -> float:
    """q L^3 / EI at which a column buckles under its own weight q per metre: 9/4 j^2, j first zero of J_(-1/3)."""
    return 2.25 * float(brentq(lambda x: jv(-1.0 / 3.0, x), 1.5, 2.2, xtol=1e-15)) ** 2  # type: ignore[arg-type]


def heavy_column_load(EI: float, L: float, EA: float = np.inf, GA: float = np.inf) -> float:
    """Line load (N/m) along the axis at which the column buckles, with extension and shear; by integration.

    EI theta'' + P (1 + c P) theta = 0, P = q (L - s), c = 1 / GA - 1 / EA, theta(0) = 0, theta'(L) = 0. For c = 0 it
    is `greenhill_load`.
    """
    c = (1.0 / GA - 1.0 / EA) * EI / L**2

    def base_angle(q: float) -> float:
        def derivative(z, y):
            return [y[1], -q * z * (1.0 + c * q * z) * y[0]]

        return solve_ivp(derivative, (0.0, 1.0), [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-15).y[0, -1]

    high = 1.0
    while base_angle(high) > 0.0:
        high *= 1.2
    return float(brentq(base_angle, high / 1.2, high, xtol=1e-13)) * EI / L**3  # type: ignore[arg-type]
