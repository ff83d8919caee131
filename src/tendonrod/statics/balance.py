"""`balance_errors`: whether a shape obeys the equations of docs/derivations, by a quadrature that the solver lacks.

Nothing here comes from the kernels: the equations are written out again in NumPy and used as integrals, over panels of
Gauss-Legendre nodes between the places where a tendon, a load or a segment ends, of rows that `Shape.at` gives there:

    p(s) = p(0) + integral of R v                   R(s) = R(0) + integral of R u^          rigid jumps at joints
    N(s) = integral beyond s of f + point forces    K(s) = integral beyond s of p x f + l + point moments, K = M + p x N
    Kse (v - v*) + sum tau t = R' N                 Kbt (u - u*) + sum r x tau t = R' M     t along u x r + r' + v
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .panels import INTEGRAL, NODES, SERIES, SLOPE, WEIGHTS, Places, Samples, edge, spread_out
from .problem import SAME_PLACE
from .solution import RETRACTED

if TYPE_CHECKING:
    from .shape import Shape
    from .trial import Trial

MOST_PANELS = 2000
SETTLED = 1e-10  # error that no finer quadrature is needed for
SLENDER = 1e-7  # of EA: force below which the rounding of a strain counts


class Worst(NamedTuple):
    """The largest relative error of one equation, and the arc length s (m) where it is."""

    error: float
    s: float


@dataclass(frozen=True, kw_only=True)
class BalanceErrors:
    """How far a shape is from obeying each equation; all dimensionless, NaN where the shape did not converge.

    With L the exposed length and EI the softest of the stiffnesses Kbt anywhere on it:

    - position: of p, in units of L, and rotation: of R, in units of the angle by which the section turns along the rod
      or of 1 rad if that is larger. Both against the integral of the strains from the exit.
    - force: of N, in units of the largest |N| or of EI / L^2 if that is larger.
    - moment: of M, in units of the largest |M| or of EI / L if that is larger. Both against the loads beyond s.
    - section_force: of the law for v, in units of the largest of |N|, EI / L^2, tension, and 1e-7 of EA.
    - section_moment: of the law for u, in units as ``moment``.
    - rows: distance between the rows that the shape holds and those checked, in L, rad, 1 for v, 1 / L for u, and
      the units above.
    """

    position: Worst
    rotation: Worst
    force: Worst
    moment: Worst
    section_force: Worst
    section_moment: Worst
    rows: Worst

    @property
    def largest(self) -> float:
        """The largest of the errors."""
        return float(np.max([getattr(self, name).error for name in self.__dataclass_fields__]))  # NaN if any is


def balance_error(shape: Shape) -> float:
    """The largest relative error of the equations that ``shape`` should obey, NaN if it did not converge.

    Dimensionless; in which units is said in `BalanceErrors`.
    """
    return balance_errors(shape).largest


def balance_errors(shape: Shape) -> BalanceErrors:
    """Errors of kinematics, of force and moment balance and of the sections' law, each with its place.

    The panels are halved as long as the quadrature's own error shows in the result.
    """
    if not shape.converged or shape.length < RETRACTED:
        nothing = Worst(0.0 if shape.converged else nan, 0.0)
        return BalanceErrors(**dict.fromkeys(BalanceErrors.__dataclass_fields__, nothing))
    places, split, still = Places(shape), 1, 0
    errors, rough = _errors(places, split)
    while errors.largest > SETTLED and rough > 0.1 * errors.largest and places.count(2 * split) <= MOST_PANELS:
        before, split = errors.largest, 2 * split
        errors, rough = _errors(places, split)
        still = still + 1 if errors.largest > 0.7 * before else 0
        if still == 2:  # halved twice without effect: it is the shape's own
            break
    return errors


def _errors(places: Places, split: int) -> tuple[BalanceErrors, float]:
    """The errors with each panel split, and what the quadrature contributes to them at the most."""
    x, L = Samples(places, split), places.length
    EI = x.section[:, 3:6].min()
    force = max(_sizes(x.N).max(), EI / L**2)
    moment = max(_sizes(x.M).max(), EI / L)
    stretch = max(force, places.tensions.max(initial=0.0), SLENDER * x.section[:, :3].max())
    f, couple = _line_load(places, x)
    spin = _cross(x.R, x.u[:, None]).reshape(-1, 9)  # R u^, whose rows are those of R, times u
    rates = np.concatenate([_turned(x.R, x.v), spin, f, _cross(x.p, f) + couple], axis=1)
    y = x.at_nodes(rates)
    inner = 0.5 * x.width[:, None, None] * (INTEGRAL @ y)
    whole = 0.5 * x.width[:, None] * (WEIGHTS @ y)
    turn = max(1.0, float(0.5 * x.width @ (x.at_nodes(_sizes(x.u))[..., 0] @ WEIGHTS)))
    units = np.repeat([L, turn, force, moment], [3, 9, 3, 3])
    rough = (x.width[:, None, None] * np.abs(SERIES[-2:] @ y) / units).max() / NODES
    p, R = _frames(places, x, inner[..., :12], whole[:, :12])
    N, M = _wrenches(places, x, inner[..., 12:], whole[:, 12:])
    n, m = _section_law(places, x)
    row_units = np.repeat([L, 1.0, 1.0, 1.0 / L, force, moment], [3, 9, 3, 3, 3, 3])
    return BalanceErrors(
        position=_worst(x.s, (x.p - p) / L),
        rotation=_worst(x.s, (x.R.reshape(-1, 9) - R) / (2**0.5 * turn)),
        force=_worst(x.s, (x.N - N) / force),
        moment=_worst(x.s, (x.M - M) / moment),
        section_force=_worst(x.s, n / stretch),
        section_moment=_worst(x.s, m / moment),
        rows=_worst(places.shape.s, (places.shape._rows - x.held) / row_units),
    ), float(rough)


def _line_load(places: Places, x: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment (n, 3) per metre of s, in the world, about the neutral axis."""
    world = places.problem.world
    weight = x.section[:, 12:13] * world[:3]
    f, couple = weight + world[3:6], np.broadcast_to(world[6:9], weight.shape)
    if world[9]:
        centroid = np.concatenate([x.section[:, 13:15], np.zeros((len(x.s), 1))], axis=1)
        couple = couple + _cross(_turned(x.R, centroid), weight)
    for row in places.problem.spread:
        a, b = row[:2] - places.exit
        acts = ((a < x.middle) & (x.middle < b))[x.panel, None]
        along = ((x.s - a) / (b - a))[:, None]
        more = [acts * ((1.0 - along) * row[i : i + 3] + along * row[i + 3 : i + 6]) for i in (2, 8)]
        if row[14]:
            more = [_turned(x.R, each) for each in more]
        f, couple = f + more[0], couple + more[1]
    if places.touching is not None:
        push = _pressed(places.touching, x)
        f, couple = f + push, couple + _cross(_axis_arm(places, x), push)
    return f, couple


def _pressed(trial: Trial, x: Samples) -> np.ndarray:
    """(n, 3) force per metre of a surface on the tube's axis: linear in each step through what it is at the stages."""
    one = 2 * (np.searchsorted(trial.grid, x.middle) - 1)[x.panel]
    at, force = trial.stages, trial.touch[:, :3]
    along = (x.s - at[one]) / (at[one + 1] - at[one])
    return force[one] + along[:, None] * (force[one + 1] - force[one])


def _axis_arm(places: Places, x: Samples) -> np.ndarray:
    """(n, 3) from p to the tube's axis, world frame."""
    offset = places.shape.robot.axis_offset(x.s + places.exit)
    return _turned(x.R, np.concatenate([offset, np.zeros((len(offset), 1))], axis=1))


def _frames(places: Places, x: Samples, inner: np.ndarray, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """p (n, 3) from the exit and R (n, 9) that the strains lead to."""
    start = np.concatenate([np.zeros((1, 12)), np.cumsum(whole, axis=0)])
    start[:, 3:] += places.frame[3:]
    for s_m, dx, dy, angle in places.shape.robot.joints:
        if s_m - places.exit > SAME_PLACE * places.length:
            k = edge(x, s_m - places.exit)
            R = start[k, 3:].reshape(3, 3)
            start[k:] += np.concatenate([R @ (dx, dy, 0.0), (R @ _turn(angle) - R).ravel()])
    found = spread_out(start, inner)
    return found[:, :3], found[:, 3:]


def _wrenches(places: Places, x: Samples, inner: np.ndarray, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """N, M (n, 3) that the loads beyond each place ask for. A point load lies beyond its own place only at the tip."""
    start = np.concatenate([whole[::-1].cumsum(axis=0)[::-1], np.zeros((1, 6))])
    for row in places.problem.points:
        s = row[0] - places.exit
        if s > SAME_PLACE * places.length:
            k = edge(x, s)
            p, R = _before_joint(places, x, k)
            F, M = (R @ row[1:4], R @ row[4:7]) if row[10] else (row[1:4], row[4:7])
            tip = k == len(x.width)
            start[: k + tip] += np.concatenate([F, M + np.cross(p + R @ row[7:10], F)])
    if places.touching is not None:
        F = places.touching.touch[-1, :3]
        start += np.concatenate([F, np.cross(x.p[-1] + _axis_arm(places, x)[-1], F)])
    found = spread_out(start, -inner)
    N = found[:, :3]
    return N, found[:, 3:] - _cross(x.p, N)


def _before_joint(places: Places, x: Samples, k: int) -> tuple[np.ndarray, np.ndarray]:
    """p (3,), R (3, 3) at an edge; at a joint those of the section before it, on which loads there act."""
    at = min(k * (NODES + 1), len(x.s) - 1)
    p, R = x.p[at], x.R[at]
    for s_m, dx, dy, angle in places.shape.robot.joints:
        if abs(s_m - places.exit - x.s[at]) <= SAME_PLACE * places.length:
            R = R @ _turn(angle).T
            p = p - R @ (dx, dy, 0.0)
    return p, R


def _turn(angle: float) -> np.ndarray:
    """(3, 3) rotation about z."""
    c, d = np.cos(angle), np.sin(angle)
    return np.array([[c, -d, 0.0], [d, c, 0.0], [0.0, 0.0, 1.0]])


def _section_law(places: Places, x: Samples) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment (n, 3) in the section frame that rod and tendons together miss."""
    n = x.section[:, :3] * (x.v - x.section[:, 6:9]) - np.einsum("nji,nj->ni", x.R, x.N)
    m = x.section[:, 3:6] * (x.u - x.section[:, 9:12]) - np.einsum("nji,nj->ni", x.R, x.M)
    robot, s_m = places.shape.robot, x.s + places.exit
    for i, tension in enumerate(places.tensions):
        acts = (x.middle < places.reach[i])[x.panel]
        if tension == 0.0 or not acts.any():
            continue
        r, slope = robot.tendon_position(i, s_m), robot.tendon_slope(i, s_m)
        if robot.tendons[i].wall == "free":
            r = _shortest(robot, i, s_m, x.u, x.v, r)
        path = _cross(x.u, r) + slope + x.v
        t = path / _sizes(path)[:, None]
        tau = tension * acts if robot.friction[i] == 0.0 else acts * _rubbed(places, x, i, t)
        n, m = n + tau[:, None] * t, m + _cross(r, tau[:, None] * t)
    return n, m


def _rubbed(places: Places, x: Samples, i: int, t: np.ndarray) -> np.ndarray:
    """(n,) tension of a tendon with friction: what held it before, within tau exp(-mu Theta) and tau exp(mu Theta)."""
    at = x.at_nodes(t)
    rate = _cross(x.at_nodes(x.u), at) + 2.0 * (SLOPE @ at) / x.width[:, None, None]
    rate = np.linalg.norm(rate, axis=2, keepdims=True)  # |u x t + t'|, of which Theta is the integral
    whole = np.concatenate([[0.0], np.cumsum(0.5 * x.width * (WEIGHTS @ rate)[:, 0])])[:, None]
    turned = spread_out(whole, 0.5 * x.width[:, None, None] * (INTEGRAL @ rate))[:, 0]
    friction, tension = places.shape.robot.friction[i] * turned, places.tensions[i]
    low, high, before = tension * np.exp(-friction), tension * np.exp(friction), places.problem.request.history
    return low if before is None else np.clip(np.interp(x.s + places.exit, before.s_m, before.tau[:, i]), low, high)


def _shortest(robot, i: int, s_m: np.ndarray, u: np.ndarray, v: np.ndarray, wall: np.ndarray) -> np.ndarray:
    """Where a tendon that is free in the lumen runs: on the diameter through the wall, where its path is shortest."""
    middle = robot.axis_offset(s_m)[:, 0]
    reach = np.abs(wall[:, 0] - middle)
    turn = u[:, 1] ** 2 + u[:, 2] ** 2
    rises = u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1]  # minus half the slope of |path|^2 over x, at x = 0
    best = np.divide(rises, turn, out=np.full_like(turn, np.inf), where=turn > 0.0)
    return np.stack([np.clip(best, middle - reach, middle + reach), wall[:, 1], wall[:, 2]], axis=1)


def _worst(s: np.ndarray, differences: np.ndarray) -> Worst:
    sizes = _sizes(differences)
    at = int(sizes.argmax())  # of NaN the first
    return Worst(float(sizes[at]), float(s[at]))


def _sizes(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))


def _turned(R: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", R, vectors)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]
