"""Frictionless contact of the tube with a surface: augmented Lagrangian in the gaps at the stages and at the tip.

The tube of radius r_out about `Shape.centerline` may not enter the surface: gap = d(c) - r_out >= 0, line force p >= 0
along the gradient of d, p gap = 0. Source: docs/method.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidInput

if TYPE_CHECKING:
    from .problem import RodProblem
    from .trial import Trial

STIFFNESS = 1e6  # of the augmented Lagrangian, in units of EI / L^4
ROUNDS = 30  # of multiplier updates


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

    @property
    def total(self) -> np.ndarray:
        """(3,) sum of all contact forces on the robot, N."""
        return self.force @ self.normal


class Contact:
    """Gaps and forces of one trial. The last of the 2n + 1 places is the tip, where the force is in N, not N/m."""

    def __init__(self, problem: RodProblem, trial: Trial) -> None:
        self.surface = problem.request.surface
        at = np.append(trial.stages, problem.length) + problem.s_exit
        self.radius = problem.robot.outer_radius(at)
        if np.isnan(self.radius).any():
            raise InvalidInput("surface", self.surface, "left out for a rod without a radius, given by area and inertia")
        self.s = at - problem.s_exit
        self.share = np.append(trial.weights, trial.weights.min())  # m of the rod that each place stands for
        axis = trial.station[:, trial.kernel.AXIS : trial.kernel.AXIS + 2]
        self.axis = np.vstack([axis, axis[-1:]])
        self.held = np.zeros(len(at))  # multipliers, N/m
        self.stiffness = STIFFNESS * trial.station[:, 3:5].min() / problem.length**4  # N/m^2
        self.gap, self.press = np.zeros(len(at)), np.zeros(len(at))
        self.normal = np.zeros((len(at), 3))
        self.on: np.ndarray | None = None  # places that are held whatever their force, None for those with force

    def places(self, trial: Trial) -> np.ndarray:
        """(2n + 1, 3) points of the tube's axis, world frame, m."""
        g = np.vstack([trial.frame, trial.end[-1:]])
        return g[:, :3] + self.axis[:, :1] * g[:, 3::3] + self.axis[:, 1:] * g[:, 4::3] + trial.problem.frame[:3]

    def touch(self, trial: Trial) -> None:
        """Forces on the trial where it stands."""
        where = self.places(trial)
        d, self.normal = self.surface.distance(where)
        self.gap = d - self.radius
        press = self.held - self.stiffness * self.gap
        on = press > 0.0 if self.on is None else self.on
        self.press, touch = np.where(on, press, 0.0), trial.touch
        touch[:] = 0.0
        if on.any():
            n, p = self.normal[on], self.press[on, None]
            D = p[:, :, None] * self.surface.curvature(where[on]) - self.stiffness * n[:, :, None] * n[:, None, :]
            touch[on, :3], touch[on, 3:] = p * n, D.reshape(-1, 9)
            touch[-1] *= self.share[-1]

    def rigid(self, factor: float) -> None:
        """Hold the places that are pressed now, and no others, so much more stiffly with the same forces."""
        self.on = self.press > 0.0
        self.held = np.where(self.on, self.press + factor * self.stiffness * self.gap, 0.0)
        self.stiffness *= factor

    @property
    def potential(self) -> float:
        """Energy of the augmented Lagrangian, J."""
        return float(self.share @ (self.press**2 - self.held**2)) / (2.0 * self.stiffness)

    def begin(self, other: Contact) -> None:
        """Take over the forces of another grid as multipliers."""
        self.held[:-1] = np.interp(self.s[:-1], other.s[:-1], other.press[:-1])
        self.held[-1] = other.press[-1] * other.share[-1] / self.share[-1]

    def found(self, trial: Trial) -> Contacts:
        """The places with force."""
        on = self.press > 0.0
        point = self.places(trial)[on] - self.radius[on, None] * self.normal[on]
        line = np.where(np.arange(on.size) < on.size - 1, self.press, 0.0)[on]
        pressure = np.where(line > 0.0, line / (2.0 * self.radius[on]), np.nan)
        arrays = self.s[on], point, self.normal[on], self.gap[on], line, (self.press * self.share)[on], pressure
        for array in arrays:
            array.setflags(write=False)
        names = ("s", "point", "normal", "gap", "line_force", "force", "pressure")
        return Contacts(**dict(zip(names, arrays, strict=True)))


def press(trial: Trial, tolerance: float) -> int:
    """Bring a trial into balance without entering the surface by more than the problem's tolerance.

    tolerance: of the balance, m. Returns the number of iterations, negative where they lead nowhere.
    """
    contact, count = trial.contact, 0
    for _ in range(ROUNDS):
        found = trial.descend(tolerance) if trial.problem.request.conservative else trial.settle(tolerance)
        count += abs(found)
        if found < 0:
            return -count
        slack = contact.held * np.maximum(contact.gap, 0.0) > contact.held.max() * trial.problem.request.contact_tolerance
        if contact.gap.min() >= -trial.problem.request.contact_tolerance and not slack.any():
            return count
        contact.held = contact.press.copy()
    return -count
