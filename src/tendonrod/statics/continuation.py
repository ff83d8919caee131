"""From the unloaded robot to the full load in steps, for loads that Newton cannot take at once (docs/method)."""

from __future__ import annotations

from itertools import pairwise
from typing import TypeVar

import numpy as np

from .arclength import Curve, by_difference, carried_over
from .newton import NewtonSolution
from .problem import RodProblem, problem_of
from .solution import CONVERGED, LOCAL_FAILED, STALLED, Solution

NO_EQUILIBRIUM_ON_BRANCH = 4  # beside the kernel's codes: the way ends at a fold

S = TypeVar("S", Solution, NewtonSolution)

STEPS = 32  # of the integrator, while under way
FARTHEST = 0.05  # of the length: motion of the body in one step above which the step is halved, lest a branch be jumped
ENOUGH = 1.0 / 16384  # step of the load factor below which a loss of stability is taken for the branch's own
SMALLEST = 1.0 / 65536  # step of the load factor at which the way counts as closed
FINE_STEPS = 80  # of the integrator, from where a way closed: they place a fold to 1e-8
SLIGHT = 1e-6  # change of the load factor in central differences
CURVE_STEP, CURVE_POINTS = 0.1, 300  # along the branch, from where a way closed
# Ways from (load, tension) = (0, .) to (1, 1); the first starts from the tendons alone, where the answer is known.
WAYS = (((0.0, 1.0), (1.0, 1.0)), ((0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)))


def follow_load(target: Solution | NewtonSolution) -> tuple[Solution | NewtonSolution, float]:
    """(solution of ``target``'s problem, 1), or where no way leads there, (``target`` as failed, load factor).

    Code and factor are then those of the first way: the critical load factor where that ends at a fold.
    """
    ways = WAYS if target.loaded and target.tensions.any() else WAYS[1:2]  # else all are the same
    codes, factors = [], []
    for way in ways:
        last, reached, crushed = _walk(target, way)  # pyright: ignore[reportArgumentType] - one of the two, not a mixture
        if last is not None and reached == 1.0:
            arrived = _arrive(target, last)  # pyright: ignore[reportArgumentType]
            if arrived is not None:
                return arrived, 1.0
        code, factor = LOCAL_FAILED if crushed else STALLED, min(reached, 1.0 - SMALLEST)
        if last is not None and reached < 1.0 and len(way) == 2:
            beyond = _beyond(target, way, last, reached)
            if isinstance(beyond, NewtonSolution):
                return beyond, 1.0
            code, factor = (code, factor) if beyond is None else (NO_EQUILIBRIUM_ON_BRANCH, beyond)
        codes.append(code)
        factors.append(factor)
    target.code = NO_EQUILIBRIUM_ON_BRANCH if codes[0] == NO_EQUILIBRIUM_ON_BRANCH else codes[-1]
    return target, factors[0]


def _beyond(
    target: Solution | NewtonSolution, way, last: Solution | NewtonSolution, reached: float
) -> NewtonSolution | float | None:
    """What pseudo-arclength continuation finds where a way in one leg closed.

    The full load's solution, where the branch goes on; the load factor of the fold, where it ends; else None.
    """
    asked = problem_of(target)
    if asked.request.surface is not None or asked.robot.friction.any():
        return None
    (load0, tension0), (load1, tension1) = way

    def at(t: float) -> RodProblem:
        return asked.scaled(load0 + t * (load1 - load0), tension0 + t * (tension1 - tension0), 0)

    trial = carried_over(last, at(reached), max(FINE_STEPS, asked.steps))
    curve = Curve(by_difference(at, SLIGHT), trial, 0.0, 1.0)
    end = curve.ahead(reached, CURVE_STEP, CURVE_POINTS)
    if end is None or end.kind == "fold":
        return None if end is None else end.point.t
    near, arrived = NewtonSolution(at(1.0)), NewtonSolution(asked)
    near.trial = curve.trial(end.point)
    return arrived if arrived.run(near) == CONVERGED else None


def _arrive(target: S, last: S) -> S | None:
    """The full load's solution at the accuracy that was asked for; from finer grids where it is not found at once."""
    for _ in range(5):
        arrived = target.again()
        if arrived.run(last) == CONVERGED:
            return arrived
        finer = target.again(2 * last.steps)
        if finer.run(last) != CONVERGED:
            return None
        last = finer
    return None


def _walk(target: S, way) -> tuple[S | None, float, bool]:
    """Last solution on the way, None if its start has none; share of the way gone; whether its start is crushed."""
    first, done = target.scaled(way[0][0], way[0][1], STEPS), 0.0
    last = first if first.run(None) == CONVERGED else None
    for (load0, tension0), (load1, tension1) in pairwise(way):
        at, stride = 0.0, 0.25
        while last is not None and at < 1.0 and stride >= SMALLEST:
            to = min(1.0, at + stride)
            factors = load0 + to * (load1 - load0), tension0 + to * (tension1 - tension0)
            found = _next(target, *factors, last, stride > ENOUGH)
            if found is not None:
                last, at, stride = found, to, 1.5 * stride
            else:
                stride *= 0.5
        done += at / (len(way) - 1)
        if at < 1.0:
            break
    return last, done, first.code == LOCAL_FAILED


def _next(target: S, load: float, tension: float, last: S, keep_stable: bool) -> S | None:
    """Solution at these factors, if there is one near the last."""
    found = target.scaled(load, tension, STEPS)
    if found.run(last) != CONVERGED:
        return None
    if last.steps != found.steps:
        return found
    if np.linalg.norm(found.nodes - last.nodes, axis=1).max() > FARTHEST * found.length:
        return None
    return None if keep_stable and last.is_stable() and found.is_stable() is False else found
