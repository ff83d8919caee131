"""Arguments of `solve`, checked: `InvalidInput` by name for what cannot be, else the arrays of a problem."""

from __future__ import annotations

from math import cos, isfinite, isnan, nan, sin, sqrt

import numpy as np

from ..errors import Fact, InvalidInput, finite, nonnegative, vector
from ..loads import DistributedLoad, Load, LumpedMass, PointLoad
from ..robot import Robot
from ..surface import Surface
from .problem import ZERO, History
from .shape import Shape
from .solution import Solution


def three(field: str, value) -> tuple[float, ...] | list[float]:
    """Three finite numbers; what already is a tuple of them is handed through."""
    if value is ZERO:
        return value
    if type(value) is tuple and len(value) == 3:
        a, b, c = value
        if type(a) is type(b) is type(c) is float and isfinite(a + b + c):
            return value
    return vector(field, value, 3).tolist()


def tendon_table(robot: Robot, tensions) -> np.ndarray:
    """(n_tendons, 7) routing and tension of each tendon."""
    routing = robot.routing
    table = np.empty((routing.shape[0], 7))
    table[:, :6] = routing
    if isinstance(tensions, (list, tuple, np.ndarray)) and np.ndim(tensions) > 0:
        values = vector("tensions", tensions, routing.shape[0])
        for i, tension in enumerate(values.tolist()):
            nonnegative(f"tensions[{i}]", tension)
        table[:, 6] = values
    else:
        tension = nonnegative("tensions", tensions)
        if tension > 0.0 and not robot.n_tendons:
            raise InvalidInput("tensions", tension, f"0 or left out: {robot.name} has no tendons")
        table[:, 6] = tension
    return table


def pulled_lengths(robot: Robot, displacements, tensions: np.ndarray) -> np.ndarray | None:
    """(n_tendons,) pulled lengths, NaN where the tension is given; None where all are."""
    if displacements is None:
        return None
    if robot.n_tendons == 0:
        raise InvalidInput("displacements", displacements, f"left out: {robot.name} has no tendons")
    values = [displacements] * robot.n_tendons if np.ndim(displacements) == 0 else list(displacements)
    if len(values) != robot.n_tendons:
        raise InvalidInput(
            "displacements", displacements, f"one number per tendon, {robot.n_tendons}, None where a tension is given"
        )
    pulled = np.full(robot.n_tendons, nan)
    for i, value in enumerate(values):
        if value is None:
            continue
        pulled[i] = finite(f"displacements[{i}]", value)
        longest = robot.length_na + robot.free_lengths[i]
        if pulled[i] > longest:
            raise InvalidInput(f"displacements[{i}]", value, f"at most the tendon's length, {longest:.4g}, in m")
        if tensions[i] != 0.0:
            raise InvalidInput(f"tensions[{i}]", tensions[i], f"0 where displacements[{i}] = {value!r} is given")
    return pulled


def check_reach(robot: Robot, driven: list[int], pulled: np.ndarray | None, s_exit: float) -> None:
    """Refuse to pull a tendon that ends inside the outer tube and has no stretch."""
    for i in driven:
        rigid = robot.tendon_compliance[i] * (robot.free_lengths[i] + robot.tendon_lengths[i]) == 0.0
        if pulled is not None and pulled[i] > 0.0 and rigid and robot.tendon_ends[i] <= s_exit:
            allowed = "<= 0 where the tendon ends inside the outer tube and has no stretch"
            raise InvalidInput(f"displacements[{i}]", float(pulled[i]), allowed)


def pull_of(robot: Robot, i: int, pulled: float, length: float, s_exit: float) -> np.ndarray:
    """(4,) what the kernel's `haul` asks for."""
    cx, cy, a, angle, w, end = robot.routing[i].tolist()
    v, k = robot.section.v_star, robot.rod_constants
    x, y = cx + a * cos(angle), cy + a * sin(angle)
    sideways = v[0] - k[11] * y - a * w * sin(angle), v[1] + k[11] * x + a * w * cos(angle)
    q = np.array([*sideways, v[2] + k[9] * y - k[10] * x])
    size = sqrt(q @ q)
    t = q / size
    soft = float(t @ (t / k[:3])) + t[2] ** 2 * (y * y / k[3] + x * x / k[4]) + (x * t[1] - y * t[0]) ** 2 / k[5]
    stretch = robot.tendon_compliance[i] * (robot.free_lengths[i] + robot.tendon_lengths[i])
    return np.array([i, pulled, stretch, soft * max(0.0, min(length, end - s_exit))])


def check_exit(robot: Robot, surface: Surface, s_exit: float, frame, tolerance: float) -> None:
    """`InvalidInput` where the surface is within the outer tube's exit."""
    radius = float(robot.outer_radius(np.array([s_exit]))[0])
    if isnan(radius):
        raise InvalidInput("surface", surface, "left out for a rod without a radius, given by area and inertia")
    (x, y), frame = robot.axis_offset(np.array([s_exit]))[0], np.array(frame)
    gap = float(surface.distance((frame[:3] + x * frame[3::3] + y * frame[4::3])[None])[0][0])
    if gap < radius - tolerance:
        allowed = f"at least {radius:.4g} m, the tube's radius, from the middle of the outer tube's exit"
        raise InvalidInput("surface", Fact(type(surface).__name__), f"{allowed}; it is {gap:.4g} m")


def stretched(robot: Robot, tensions: np.ndarray, pulled: np.ndarray) -> np.ndarray:
    """(n_tendons,) tensions where nothing is exposed: pulled lengths only stretch the tendons."""
    found = tensions.copy()
    for i, length in enumerate(pulled.tolist()):
        stretch = robot.tendon_compliance[i] * (robot.free_lengths[i] + robot.tendon_lengths[i])
        if length > 0.0 and stretch == 0.0:
            allowed = "<= 0 where nothing is exposed and the tendon has no stretch"
            raise InvalidInput(f"displacements[{i}]", length, allowed)
        if not isnan(length):
            found[i] = max(0.0, length / stretch) if stretch else 0.0
    return found


def checked_loads(loads, centroid_weight, history) -> tuple[Load, ...]:
    """The loads as a tuple; `InvalidInput` for what is not of its kind."""
    if loads != ():
        if not isinstance(loads, (list, tuple)):
            raise InvalidInput("loads", loads, "a list of PointLoad, LumpedMass and DistributedLoad")
        for i, load in enumerate(loads):
            if not isinstance(load, (PointLoad, LumpedMass, DistributedLoad)):
                raise InvalidInput(f"loads[{i}]", load, "a PointLoad, a LumpedMass or a DistributedLoad")
    if not isinstance(centroid_weight, bool):
        raise InvalidInput("centroid_weight", centroid_weight, "True or False")
    if history is not None and not isinstance(history, Shape):
        raise InvalidInput("history", history, "a solved Shape of this robot")
    return tuple(loads)


def tensions_before(robot: Robot, history: Shape) -> History:
    """What friction remembers of a shape of this robot."""
    same = isinstance(history, Shape) and history.converged and history.robot.n_tendons == robot.n_tendons
    if not same or abs(history.robot.length_na - robot.length_na) > 1e-9 * robot.length_na:
        raise InvalidInput("history", history, "a solved Shape of this robot")
    solution = history._solution
    if isinstance(solution, Solution):
        return History(s_m=np.array([solution.s_exit]), tau=solution.tensions[None].copy(), kinks=np.zeros(0))
    trial = solution.trial
    s_m = trial.stages + solution.s_exit
    return History(s_m=s_m, tau=trial.share * trial.tensions, kinks=trial.kinks + solution.s_exit)


def rigid_motion(field: str, value) -> np.ndarray:
    """(4, 4) homogeneous matrix of a rotation and a translation."""
    try:
        T = np.array(value, dtype=float)
    except (TypeError, ValueError):
        T = np.empty(0)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise InvalidInput(field, value, "a (4, 4) array of finite numbers")
    R = T[:3, :3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-8) or np.linalg.det(R) < 0.0 or (T[3] != [0, 0, 0, 1]).any():
        raise InvalidInput(field, value, "a rigid motion: a rotation, a translation and the last row 0 0 0 1")
    return T
