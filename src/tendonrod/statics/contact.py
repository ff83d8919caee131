"""Frictionless contact of the tube with a surface: augmented Lagrangian in the gaps at the stages and at the tip.

The tube of radius r_out about `Shape.centerline` may not enter the surface: gap = d(c) - r_out >= 0, line force p >= 0
along the gradient of d, p gap = 0. Source: docs/method.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, cast

import numpy as np

from ..errors import InvalidInput

if TYPE_CHECKING:
    from ..surface import Surface
    from .problem import RodProblem
    from .trial import Trial

STIFFNESS = 1e6  # of the augmented Lagrangian, in units of EI / L^4
AT_ONCE = 4  # iterations with one model of the surface
NOTABLE = 1e-3  # of the length: what a model must miss for its step to be taken back when it leads up
KICK = 1e-3  # of 1 / length: curvature that moves a trial off a saddle
ROUNDS = 100  # of models of the surface and of multipliers
TOUCH = 4.0  # root of tolerance times length: a stretch of contact that is shorter is one touch
NEAR = 3.0  # radii of the tube within which a surface's curvature is taken
FAR = 1e3  # m, relief at which nothing is touched
CLOSEST = 1.0 / 64  # of the way of an approaching surface, below which the way counts as closed
SHORTER = (0.5, 0.25, 0.1, 0.03, 0.01, 0.001)  # shares of a step that are tried when the whole leads up


@dataclass(frozen=True, kw_only=True, eq=False)
class Contacts:
    """Where a robot touches the surface: at the integrator's stages and at the tip, those with force. World frame, SI.

    s (k,) m; point (k, 3) on the tube's surface, m; normal (k, 3) into the free space; gap (k,) m, negative inside the
    surface; line_force (k,) N/m along the normal, 0 at the tip; force (k,) N, that of the stretch each place stands
    for; pressure (k,) Pa, line force over the tube's diameter, NaN at the tip. total (3,) N: sum of all forces.
    """

    s: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    line_force: np.ndarray
    force: np.ndarray
    pressure: np.ndarray

    def __repr__(self) -> str:
        return f"Contacts({self.s.size} places, {1e3 * np.linalg.norm(self.total):.4g} mN)"

    @property
    def total(self) -> np.ndarray:
        """(3,) sum of all contact forces on the robot, N."""
        return self.force @ self.normal


class Contact:
    """Gaps and forces of one trial. The last of the 2n + 1 places is the tip, where the force is in N, not N/m."""

    def __init__(self, problem: RodProblem, trial: Trial) -> None:
        self.surface = cast("Surface", problem.request.surface)
        at = np.append(trial.stages, problem.length) + problem.s_exit
        self.radius = problem.robot.outer_radius(at)
        if np.isnan(self.radius).any():
            allowed = "left out for a rod without a radius, given by area and inertia"
            raise InvalidInput("surface", self.surface, allowed)
        self.s, self.origin = np.append(trial.stages, problem.length), problem.frame[:3]
        self.share = np.append(trial.weights, trial.weights.min())  # m of the rod that each place stands for
        axis = trial.station[:, trial.kernel.AXIS : trial.kernel.AXIS + 2]
        self.axis = np.vstack([axis, axis[-1:]])
        self.held = np.zeros(at.size)  # multipliers, N/m
        self.stiffness = STIFFNESS * trial.station[:, 3:5].min() / problem.length**4  # N/m^2
        self.pinned = np.full(at.size, -1.0)
        self.looks = 0  # so far, each with a few iterations: what a solution costs
        self.relief = 0.0  # m by which the surface stands back for the while
        self.model = np.zeros((at.size, 16))  # of the gaps, see `kernel_newton.touched`
        self.model[:, 3] = 1.0  # m: far away until `look` is called

    @property
    def arrays(self) -> tuple:
        """Arguments of the kernel's `touched`."""
        return self.model, self.held, self.stiffness, self.share, self.pinned

    @property
    def gap(self) -> np.ndarray:
        """(2n + 1,) gaps where `look` was called last, m."""
        return self.model[:, 3]

    @property
    def press(self) -> np.ndarray:
        """(2n + 1,) line force there, N/m."""
        press = self.held - np.where(self.pinned < 2.0, self.stiffness, 0.0) * self.gap
        return np.where((self.pinned > 0.0) | ((self.pinned < 0.0) & (press > 0.0)), press, 0.0)

    def look(self, trial: Trial) -> float:
        """Take the surface's distances where the trial stands; returns by how much the model missed them, m."""
        g, model = np.vstack([trial.frame, trial.end[-1:]]), self.model
        self.looks += 1
        at = g[:, :3] + self.axis[:, :1] * g[:, 3::3] + self.axis[:, 1:] * g[:, 4::3]
        d, normal = self.surface.distance(at + self.origin)
        gap, moved = d - self.radius + self.relief, at - model[:, :3]
        bent = (model[:, 7:].reshape(-1, 3, 3) * moved[:, None]).sum(axis=2)
        guessed = model[:, 3] + ((model[:, 4:7] + 0.5 * bent) * moved).sum(axis=1)
        near = np.minimum(gap, guessed) < NEAR * self.radius
        model[:, :3], model[:, 3], model[:, 4:7], model[:, 7:] = at, gap, normal, 0.0
        if near.any():
            model[near, 7:] = self.surface.curvature(at[near] + self.origin).reshape(-1, 9)
        return float(np.abs(gap - guessed)[near].max(initial=0.0))

    def deepest(self, trial: Trial) -> float:
        """How far the robot enters the surface anywhere, looked at between the stages too, m."""
        grid = trial.grid
        at = np.append((grid[:-1, None] + np.diff(grid)[:, None] * np.arange(4) / 4.0).ravel(), grid[-1])
        rows, s_m = trial.rows(at), at + trial.problem.s_exit
        x, y = trial.problem.robot.axis_offset(s_m).T[:, :, None]
        gap = self.surface.distance(rows[:, :3] + x * rows[:, 3:12:3] + y * rows[:, 4:12:3])[0]
        return float(np.max(trial.problem.robot.outer_radius(s_m) - gap))

    def begin(self, other: Contact) -> None:
        """Take over the forces of another grid as multipliers."""
        press = other.press
        self.held[:-1] = np.interp(self.s[:-1], other.s[:-1], press[:-1])
        self.held[-1] = press[-1] * other.share[-1] / self.share[-1]

    def pin(self, factor: float, length: float, tolerance: float) -> None:
        """Pin the places that are pressed now, and no others, so much more stiffly with the same forces.

        A short stretch of them is one touch of a curved rod, which may roll on it: of these only the hardest pressed
        place is pinned, and the others keep their force.
        """
        press = self.press
        on = press > 0.0
        self.pinned = np.where(on, 1.0, 0.0)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if self.s[last - 1] - self.s[first] < max(
                3.0 * self.share[first:last].max(), TOUCH * np.sqrt(tolerance * length)
            ):
                self.pinned[first:last] = 2.0
                self.pinned[first + int(np.argmax((press * self.share)[first:last]))] = 1.0
        rigid = self.pinned == 1.0
        self.held = np.where(rigid, press + factor * self.stiffness * self.gap, press)
        self.stiffness *= factor

    def same_as(self, other: Contact) -> None:
        """Take over everything from the contact of another trial on the same grid."""
        self.held, self.stiffness, self.pinned = other.held.copy(), other.stiffness, other.pinned
        self.model = other.model.copy()
        self.model[:, :3] += other.origin - self.origin

    def found(self) -> Contacts:
        """The places with force, where `look` was called last."""
        press = self.press
        on = press > 0.0
        normal = self.model[on, 4:7].copy()
        point = self.model[on, :3] + self.origin - self.radius[on, None] * normal
        line = np.where(np.arange(on.size) < on.size - 1, press, 0.0)[on]
        pressure = np.where(line > 0.0, line / (2.0 * self.radius[on]), np.nan)
        arrays = self.s[on], point, normal, self.gap[on], line, (press * self.share)[on], pressure
        for array in arrays:
            array.setflags(write=False)
        names = ("s", "point", "normal", "gap", "line_force", "force", "pressure")
        return Contacts(**dict(zip(names, arrays, strict=True)))


def press(trial: Trial, tolerance: float, most: float = inf) -> int:
    """Bring a trial into balance without entering the surface by more than the tolerance that was asked for.

    Down in energy where the loads have a potential, against a quadratic model of the gaps which is renewed until it
    holds. tolerance: of the balance, m. most: looks at the surface before it is given up. Returns the number of
    iterations, negative or 0 where they lead nowhere.
    """
    contact, asked, count, kicks = cast(Contact, trial.contact), trial.problem.request, 0, 3
    most += contact.looks
    inherited = bool(contact.held.any())  # forces of another shape, which must be looked at once at least
    trial.walk()
    contact.look(trial)
    trial.walk()
    for _ in range(ROUNDS):
        if contact.looks > most:
            break
        before, energy = trial.x.copy(), trial.energy
        found = trial.descend(tolerance, AT_ONCE) if trial.problem.conservative else trial.settle(tolerance, AT_ONCE)
        count += abs(found) or AT_ONCE
        if found < 0:
            return -count
        missed = contact.look(trial)
        trial.walk()
        if trial.problem.conservative and missed > NOTABLE * trial.problem.length:
            _back(trial, before, energy)
        if found == 0 or missed > 0.1 * asked.contact_tolerance:
            continue
        gap = contact.gap
        apart = (contact.press > 0.0) & (gap > asked.contact_tolerance)
        if gap.min() >= -asked.contact_tolerance and not apart.any() and not inherited:
            if kicks == 0 or not trial.problem.conservative or trial.factor() == 0:
                return count
            kicks -= 1  # on a saddle: a little bend, ever different, shows which way is down
            bend = np.cos(np.arange(trial.x.shape[0])[:, None] + [0.0, 1.0 + kicks])
            trial.x[:, 3:5] += KICK / trial.problem.length * bend
            trial.walk()
            continue
        contact.held, inherited = contact.press, False
        trial.walk()
    return -count


def approach(trial: Trial, tolerance: float) -> int:
    """As `press`, from the shape without contact: the surface comes on step by step from where it just touches that."""
    contact, relief = cast(Contact, trial.contact), 1.0
    contact.relief, contact.held = FAR, np.zeros_like(contact.held)
    if press(trial, tolerance) <= 0:
        return 0
    contact.relief = 0.0
    contact.look(trial)
    deepest, stride, count = max(0.0, -contact.gap.min()), 0.25, 0
    while relief > 0.0:
        to, x, held = max(0.0, relief - stride), trial.x.copy(), contact.held
        contact.relief = to * deepest
        found = press(trial, tolerance)
        count += abs(found)
        if found > 0:
            relief, stride = to, 1.5 * stride
            continue
        trial.x[:], contact.held, stride = x, held, 0.5 * stride
        if stride < CLOSEST:
            contact.relief = 0.0
            return -count
    return count


def _back(trial: Trial, before: np.ndarray, energy: float) -> None:
    """Go back towards the strains ``before`` until the energy is lower than there."""
    whole = trial.x - before
    for shorter in SHORTER:
        if trial.energy <= energy:
            return
        np.add(before, shorter * whole, out=trial.x)
        trial.walk()
        trial.contact.look(trial)  # pyright: ignore[reportOptionalMemberAccess]
        trial.walk()
