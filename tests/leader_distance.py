"""How far a body is from its leader, reckoned apart from the package's planner: both are only solved for and sampled.

Nothing here uses `tendonrod.curve` or `tendonrod.motion`. SI units.
"""

import numpy as np
from scipy.spatial import KDTree

from tendonrod import Robot, solve

SAMPLES = 20_001  # of the leader: 4 um apart, the parabola through three of them is good to 1e-16 m
BODY = 201  # sections of the body; Simpson's rule


class Leader:
    """The fully inserted robot as a cloud of points, and the rms distance of exposed bodies from it."""

    def __init__(self, robot: Robot, tension: float, gravity) -> None:
        self.robot, self.gravity = robot, gravity
        self.s = np.linspace(0.0, robot.length_na, SAMPLES)
        self.points = solve(robot, tension, gravity, s=self.s, accuracy=1e-10).position
        self.tree = KDTree(self.points)

    def nearest(self, points):
        """(distance, s) from ``points`` (n, 3): nearest sample, then the parabola through it and its neighbours."""
        k = np.clip(self.tree.query(points)[1], 1, SAMPLES - 2)
        before, here, after = self.points[k - 1], self.points[k], self.points[k + 1]
        slope, bend = 0.5 * (after - before), after - 2 * here + before
        t = np.zeros(len(points))
        for _ in range(8):
            offset = here + t[:, None] * slope + 0.5 * t[:, None] ** 2 * bend - points
            rate = slope + t[:, None] * bend
            step = np.sum(offset * rate, axis=1) / (np.sum(rate**2, axis=1) + np.sum(offset * bend, axis=1))
            t = np.clip(t - step, -1.0, 1.0)
        offset = here + t[:, None] * slope + 0.5 * t[:, None] ** 2 * bend - points
        return np.linalg.norm(offset, axis=1), self.s[k] + t * (self.s[1] - self.s[0])

    def body(self, insertion: float, tension: float, rotation: float = 0.0) -> np.ndarray:
        s = np.linspace(0.0, insertion * self.robot.length_na, BODY)
        at = {"insertion": insertion, "rotation": rotation, "s": s}
        return solve(self.robot, tension, self.gravity, accuracy=1e-9, **at).position

    def mean_square(self, insertion: float, tension: float, rotation: float = 0.0) -> float:
        """Mean of the squared distance over the exposed length, m^2."""
        weights = np.ones(BODY)
        weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
        return float(weights @ self.nearest(self.body(insertion, tension, rotation))[0] ** 2 / weights.sum())

    def foot(self, insertion: float, tension: float, rotation: float = 0.0) -> float:
        """Where on the leader the tip's closest point lies, m."""
        return float(self.nearest(self.body(insertion, tension, rotation)[-1:])[1][0])

    def matched(self, eta: float, tension: float, rotation: float) -> float:
        """The insertion at which the tip's foot point lies at eta L_na, by the secant method."""
        wanted, a, b = eta * self.robot.length_na, eta, eta - 1e-4
        missed_a, missed_b = self.foot(a, tension, rotation) - wanted, self.foot(b, tension, rotation) - wanted
        for _ in range(8):
            if abs(missed_b) < 1e-13 or missed_a == missed_b:
                break
            a, missed_a, b = b, missed_b, min(1.0, b - missed_b * (b - a) / (missed_b - missed_a))
            missed_b = self.foot(b, tension, rotation) - wanted
        return b

    def matched_mean_square(self, eta: float, tension: float, rotation: float) -> float:
        return self.mean_square(self.matched(eta, tension, rotation), tension, rotation)
