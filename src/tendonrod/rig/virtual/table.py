"""`RobotTable`: tendon path and tip pose of an exposed robot as a polynomial of insertion, rotation and tension.

Chebyshev series in insertion (0 to 1) and tension (0 to the highest), Fourier series in rotation, through static solves
at their nodes. Without gravity a rotation only turns the robot, and three rotations are exact. With c(eta, phi, tau)
smooth the series converge geometrically; what is left over is measured, at places between the nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import acos, pi

import numpy as np

from ...errors import InvalidInput, NotConverged
from ...robot import Robot
from ...statics.equilibrium import solve
from ...statics.shape import Shape

STATIONS = 16  # Gauss points for integrals along the tendon
ACCURACY = 1e-8  # m, of the solves
STILL = 3e-11  # N m, change of the moment of the mass about the neutral axis at which it counts as found
TOLERANCE = 5e-7  # m, last coefficients of shortening and tip (those left out are smaller): above it the table grows
TENSIONS, INSERTIONS = 12, 18  # nodes to begin with
MOST = 40  # nodes in a direction
PROBES = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class RobotTable:
    """Series of what a bench asks of its robot; made by `robot_table`.

    Coefficients: (insertions * harmonics, tensions) of the shortening (m) of the tendon's path and of its whole turn
    (rad); (insertions * harmonics, tensions * 9) of the tip: tube's axis (m), first two columns of the section's frame.
    error: m, largest that was found of shortening and tip position at places between the nodes.
    """

    sizes: tuple[int, int, int]
    highest: float
    shortening: np.ndarray
    turning: np.ndarray
    tip: np.ndarray
    error: float

    def weights(self, insertion: float, rotation: float) -> np.ndarray:
        """(insertions * harmonics,) of the coefficients at a place."""
        eta = np.cos(acos(min(1.0, max(-1.0, 2.0 * insertion - 1.0))) * np.arange(self.sizes[0]))
        return (eta[:, None] * _waves(np.array([rotation]), self.sizes[1])).ravel()

    def pose(self, insertion: float, rotation: float, tension: float) -> tuple[np.ndarray, np.ndarray]:
        """(3,) tube's axis at the tip, m, and (3, 3) section frame there, world."""
        series = (self.weights(insertion, rotation) @ self.tip).reshape(self.sizes[2], 9)
        x = 2.0 * min(tension, self.highest) / self.highest - 1.0
        values = np.cos(acos(max(-1.0, x)) * np.arange(self.sizes[2])) @ series
        first = values[3:6] / np.linalg.norm(values[3:6])
        second = values[6:9] - (first @ values[6:9]) * first
        second /= np.linalg.norm(second)
        return values[:3], np.column_stack([first, second, np.cross(first, second)])


@lru_cache(maxsize=16)
def robot_table(
    robot: Robot, gravity: tuple[float, ...], tilt: tuple[float, ...], mass: float, offset: tuple[float, ...],
    highest: float,
) -> RobotTable:  # fmt: skip
    """The table of a uniform robot under its weight and a mass (kg) at ``offset`` (m) from the tube's axis at its tip.

    Raises `InvalidInput` where the robot is not uniform, or has no equilibrium or no smooth one up to ``highest`` (N).
    """
    if not robot.is_uniform or len(robot.breaks):
        raise InvalidInput("mechanics", "table", '"engine" for a robot that changes along its length')
    bare = robot.replace(tendons=(replace(robot.tendons[0], friction=0.0, axial_stiffness=None, free_length=0.0),))
    probe = _Probe(bare, gravity, tilt, mass, offset)
    sizes = [INSERTIONS, 3 if not any(gravity) else 7 if mass == 0.0 else 11, TENSIONS]
    while True:
        try:
            series = _series(probe, sizes, highest)
        except NotConverged as error:
            reason = f'less for the table, or mechanics "engine": {error.status}'
            raise InvalidInput("highest_tension", highest, reason) from None
        tails = [_tail(series, axis) for axis in range(3)]
        if max(tails) < TOLERANCE or max(sizes) > MOST:
            break
        sizes = [n + _more(tail) for n, tail in zip(sizes, tails, strict=True)]
    if max(tails) > 3.0 * TOLERANCE:
        raise InvalidInput("highest_tension", highest, f"less for the table, whose error is {max(tails):.1g} m")
    found = _packed(series, sizes, highest)
    return replace(found, error=_missed(found, probe))


class _Probe:
    """Static solves of one robot, with what a table asks of them."""

    def __init__(self, robot: Robot, gravity, tilt, mass: float, offset) -> None:
        self.robot, self.gravity, self.tilt = robot, gravity, tilt
        self.weight = mass * np.array(gravity)
        self.arm = np.array([*robot.axis_offset(np.array([robot.length_na]))[0], 0.0]) + offset
        x, w = np.polynomial.legendre.leggauss(STATIONS)
        self.at, self.gauss = np.append(0.5 + 0.5 * x, 1.0), 0.5 * w
        self.slope = _differences(self.at[:-1])
        values = robot.section_values(np.zeros(1))[0]
        self.rest = values[6:9], values[9:12]

    def shape(self, insertion: float, rotation: float, tension: float, start: Shape | None) -> Shape:
        """At the stations and the tip. The mass acts on an arm that turns with the tip: a contraction, to its end."""
        moment = _cross(self.arm if start is None else start.rotation[-1] @ self.arm, self.weight)
        s, before = insertion * self.robot.length_na * self.at, np.full(3, np.inf)
        while np.abs(moment - before).max() > STILL:
            start = solve(
                self.robot, tension, self.gravity, self.weight, moment, insertion=insertion, rotation=rotation, s=s,
                accuracy=ACCURACY, start=start, exit_tilt=self.tilt,
            )  # fmt: skip
            moment, before = _cross(start.rotation[-1] @ self.arm, self.weight), moment
        assert start is not None
        return start

    def values(self, insertion: float, shapes: Sequence[Shape]) -> np.ndarray:
        """(k, 11) shortening, turn, tube's axis at the tip, two columns of its frame; of k shapes, equally exposed."""
        length, s_m = insertion * self.robot.length_na, shapes[0].material_coordinate[:-1]
        r, dr = self.robot.tendon_position(0, s_m), self.robot.tendon_slope(0, s_m)
        u, v = (np.array([getattr(each, name)[:-1] for each in shapes]) for name in ("u", "v"))
        q, straight = _cross(u, r) + dr + v, _cross(self.rest[1], r) + dr + self.rest[0]
        size = np.linalg.norm(q, axis=-1)
        t = q / size[..., None]
        bent = np.linalg.norm(_cross(u, t) + np.einsum("ij,kjx->kix", self.slope, t) / length, axis=-1)
        drawn = np.stack([np.linalg.norm(straight, axis=-1) - size, bent], axis=1) @ self.gauss * length
        tips = [[*each.centerline[-1], *each.rotation[-1, :, 0], *each.rotation[-1, :, 1]] for each in shapes]
        return np.concatenate([drawn, np.array(tips)], axis=1)


def _series(probe: _Probe, sizes, highest: float) -> np.ndarray:
    """(insertions, harmonics, tensions, 11) coefficients, of solves at the nodes, each started from the last."""
    etas, taus = (0.5 + 0.5 * _nodes(n) for n in (sizes[0], sizes[2]))
    values = np.empty((*sizes, 11))
    for j, rotation in enumerate((2.0 * pi * np.arange(sizes[1]) / sizes[1]).tolist()):
        first = None
        for i in range(sizes[0])[::-1]:  # from short robots, which hardly bend, to long ones
            shapes, start = [], first
            for tau in (highest * taus).tolist()[::-1]:
                start = probe.shape(float(etas[i]), rotation, tau, start)
                shapes.append(start)
            first = shapes[0]
            values[i, j] = probe.values(float(etas[i]), shapes[::-1])
    for axis in (0, 2):
        turn = _chebyshev(sizes[axis])
        values = np.moveaxis(np.tensordot(turn, values, (1, axis)), 0, axis)
    return np.moveaxis(np.tensordot(_fourier(sizes[1]), values, (1, 1)), 0, 1)


def _packed(series: np.ndarray, sizes, highest: float) -> RobotTable:
    rows = series.reshape(sizes[0] * sizes[1], sizes[2], 11)
    short, turn, tip = rows[:, :, 0], rows[:, :, 1], rows[:, :, 2:].reshape(len(rows), -1)
    parts = [np.ascontiguousarray(each) for each in (short, turn, tip)]
    for each in parts:
        each.setflags(write=False)
    return RobotTable(
        sizes=tuple(sizes), highest=highest, shortening=parts[0], turning=parts[1], tip=parts[2], error=0.0
    )  # pyright: ignore[reportArgumentType]


def _missed(table: RobotTable, probe: _Probe) -> float:
    """Largest error of shortening and tip position (m) at places that are not nodes."""
    worst = 0.0
    for k in range(PROBES):  # golden ratios fill a cube evenly
        eta, turn, share = ((0.5 + k * g) % 1.0 for g in (0.8191725, 0.6710436, 0.5497005))
        place = eta, 2.0 * pi * turn, share * table.highest
        direct = probe.values(eta, [probe.shape(*place, None)])[0]
        taus = np.cos(acos(2.0 * share - 1.0) * np.arange(table.sizes[2]))
        short = float(table.weights(*place[:2]) @ table.shortening @ taus)
        worst = max(worst, abs(short - direct[0]), float(np.abs(table.pose(*place)[0] - direct[2:5]).max()))
    return worst


def _more(tail: float) -> int:
    """By how many nodes a direction grows; even, since rotation needs an odd number."""
    return 8 if tail > 50.0 * TOLERANCE else 4 if tail > TOLERANCE else 0


def _tail(series: np.ndarray, axis: int) -> float:
    """Size (m) of the last coefficients of shortening and tip position: bounds what the series leaves out."""
    last = np.moveaxis(series, axis, 0)[-2:]
    return float(np.abs(last[..., [0, 2, 3, 4]]).max()) if series.shape[axis] > 3 else 0.0


def _nodes(n: int) -> np.ndarray:
    return np.cos(pi * (np.arange(n) + 0.5) / n)


def _chebyshev(n: int) -> np.ndarray:
    """(n, n) from values at the nodes to coefficients."""
    turn = 2.0 / n * np.cos(np.outer(np.arange(n), pi * (np.arange(n) + 0.5) / n))
    turn[0] *= 0.5
    return turn


def _waves(angle: np.ndarray, n: int) -> np.ndarray:
    """(k, n) 1, cos, sin, cos 2, sin 2 ... of the angles (k,)."""
    order = np.arange(1, n // 2 + 1) * angle[:, None]
    pairs = np.stack([np.cos(order), np.sin(order)], axis=-1).reshape(len(angle), -1)
    return np.concatenate([np.ones((len(angle), 1)), pairs], axis=1)


def _fourier(n: int) -> np.ndarray:
    """(n, n) from values at n (odd) even angles to coefficients of `_waves`."""
    turn = 2.0 / n * _waves(2.0 * pi * np.arange(n) / n, n).T
    turn[0] *= 0.5
    return turn


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b over the last axis, without the overhead of NumPy's."""
    (a0, a1, a2), (b0, b1, b2) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def _differences(x: np.ndarray) -> np.ndarray:
    """(n, n) derivative at the points of the polynomial through them."""
    apart = x[:, None] - x + np.eye(len(x))
    scale = apart.prod(axis=1)
    D = scale[:, None] / (scale * apart)
    np.fill_diagonal(D, 0.0)
    np.fill_diagonal(D, -D.sum(axis=1))
    return D
