"""How much tendon a lead screw has to pay out along a motion, and the compliance of its tension loop: from the statics.

The tendon's stretch is delta = z - x_t - Delta + delta_0 = c_t tau: z = insertion L (the tube's length: what axes move,
and the tendon's path in the straight tube; the neutral axis is a little longer), x_t paid out, Delta the shortening
of the tendon's path through the bent robot, c_t the compliance of the tendon itself (m/N). So along a motion

    x_t = z - Delta(eta, tau) - c_t tau + constant,
    dtau/dz at a still screw = (1 - dDelta/dz) / (c_t + dDelta/dtau).

Source: physics of the bench (docs/method, Tendons). This module joins the bench to the model of the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import nonnegative, positive
from ..robot import Robot
from ..statics.equilibrium import solve
from ..statics.shape import Shape

NODES = 32  # of Gauss and Legendre, over a body that turns through a few radians: to rounding
TENSION_ARM, INSERTION_ARM = 1e-3, 1e-3  # N, 1: arms of the central differences


def tendon_compliance(robot: Robot) -> float:
    """Elongation per tension of the tendon from the screw to its end in the robot, m/N; 0 if it is inextensible.

    The whole tendon carries the tension; that of a robot's file is of ``axial_stiffness`` and ``free_length``.
    """
    return float(robot.tendon_compliance[0] * (robot.free_lengths[0] + robot.tendon_lengths[0]))


def shortening(shape: Shape) -> float:
    """Delta of the first tendon: by how much its path through the exposed robot is shorter than without any load, m."""
    robot, insertion = shape.robot, shape.length / shape.robot.length_na
    rest = solve(robot, 0.0, insertion=insertion)
    return _path(rest) - _path(shape)


def paid_out(
    robot: Robot, insertion, tension, rotation: Any = 0.0, gravity=(0.0, 0.0, 0.0), compliance: float = 0.0
) -> np.ndarray:
    """(n,) tendon paid out (m) at the points of a motion, counted from a slack tendon at insertion 0.

    insertion (n,); tension, rotation: (n,) or one number, N and rad; compliance: of the tendon, m/N.
    """
    soft = nonnegative("compliance", compliance)
    eta, tau, phi = np.broadcast_arrays(np.asarray(insertion, float), tension, rotation)
    found = np.zeros(eta.shape)
    start: Shape | None = None
    for k in range(eta.size):
        if eta[k] > 0.0:
            start = solve(robot, tau[k], gravity, insertion=eta[k], rotation=phi[k], start=start)
            found[k] = eta[k] * robot.section.L - shortening(start) - soft * tau[k]
    return found


def compliances(
    robot: Robot, insertion: Sequence[float], tension: float, gravity=(0.0, 0.0, 0.0), compliance: float = 0.0
) -> np.ndarray:
    """(n,) translation per tension at a still screw, m/N: what the tension controller has to work against.

    It is (c_t + dDelta/dtau) / (1 - dDelta/dz) at each of ``insertion`` and ``tension`` (N), by central differences.
    """
    tau = positive("tension", tension)
    arm, soft = min(TENSION_ARM, 0.5 * tau), nonnegative("compliance", compliance)
    return np.array([soft + _by_tension(robot, eta, tau, arm, gravity) for eta in insertion]) / np.array(
        [1.0 - _by_insertion(robot, eta, tau, gravity) for eta in insertion]
    )


def _by_tension(robot: Robot, eta: float, tau: float, arm: float, gravity) -> float:
    high, low = (shortening(solve(robot, tau + sign * arm, gravity, insertion=eta)) for sign in (1, -1))
    return (high - low) / (2 * arm)


def _by_insertion(robot: Robot, eta: float, tau: float, gravity) -> float:
    ends = max(eta - INSERTION_ARM, 0.5 * eta), min(eta + INSERTION_ARM, 1.0)
    low, high = (shortening(solve(robot, tau, gravity, insertion=end)) for end in ends)
    return (high - low) / ((ends[1] - ends[0]) * robot.section.L)


def _path(shape: Shape) -> float:
    """Length of the first tendon's path through the exposed robot, m: integral of |u x r + r' + v|."""
    x, weights = np.polynomial.legendre.leggauss(NODES)
    hidden = shape.robot.length_na - shape.length
    end = min(shape.length, shape.robot.tendon_ends[0] - hidden)
    if end <= 0.0:
        return 0.0
    inside = shape.at(0.5 * end * (1.0 + x))
    s_m = inside.material_coordinate
    r, slope = shape.robot.tendon_position(0, s_m), shape.robot.tendon_slope(0, s_m)
    q = np.cross(inside.u, r) + slope + inside.v
    return float(0.5 * end * weights @ np.linalg.norm(q, axis=1))
