"""Follow-the-leader planning: the tensions (and rotations) that keep the exposed body on the path of the full robot.

The reference is the neutral axis of the fully inserted robot at the desired tension (paper, II-C). The exposed body at
progress eta is compared with it by projection, uniformly in arc length; the plan minimises the root mean square
distance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..curve import Curve
from ..errors import InvalidInput, NotConverged, nonnegative, one_of, positive, vector, whole
from ..robot import Robot, as_robot
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from .plan import Plan

FREEDOMS = ("tension", "full", "paper")
REFERENCE_SAMPLES = 257
PLANNING_ACCURACY = 1e-8  # m, of the body; the number of steps is then fixed, so that the cost is smooth to rounding


def plan_follow_leader(
    robot: Robot,
    target_tension: float,
    gravity=(0.0, 0.0, 0.0),
    steps: int = 20,
    freedom: str = "tension",
    tension_step: float = 0.005,
    tolerance: float = 0.5e-3,
    reference_samples: int = 400,
    watch: Callable[[int, int], None] | None = None,
) -> Plan:
    """Plan follow-the-leader motion to ``target_tension`` under ``gravity``.

    - target_tension: N, at full insertion; gravity: (3,) m/s2, world frame; steps: of equal insertion.
    - freedom "tension": insertion = progress, rotation 0, the tension that minimises the body's rms distance from the
      reference curve.
    - freedom "full": tension and rotation free; the insertion is matched so that the tip's foot point on the reference
      lies at eta L_na (clamped at full insertion), never free, since retracting would always win.
    - freedom "paper": the paper's own search, ascending tension, first shape whose body lies within ``tolerance`` (m)
      of the reference's ``reference_samples`` points everywhere, else the closest; ``tension_step`` (N). The paper
      prints none of these three numbers: they are our assumptions.
    - watch(done, steps) is called after each step.

    Returns a `Plan`. Raises `InvalidInput`, `NotConverged`. Source: paper II-C, II-D; docs/derivations.
    """
    if as_robot(robot).n_tendons != 1:
        raise InvalidInput("robot", f"{robot.name} with {robot.n_tendons} tendons", "a robot with exactly one tendon")
    target = nonnegative("target_tension", target_tension)
    pull = tuple(vector("gravity", gravity, 3).tolist())
    steps = whole("steps", steps, 1, 10_000)
    raised_by, near = positive("tension_step", tension_step), positive("tolerance", tolerance)
    leader = _Leader(robot, target, pull)
    match one_of("freedom", freedom, FREEDOMS):
        case "tension":
            search = _Optimal(leader, 1)
        case "full":
            search = _Optimal(leader, 2)
        case _:
            search = _Ascending(leader, raised_by, near, whole("reference_samples", reference_samples, 2))
    found: list = [None] * steps
    for done, k in enumerate(reversed(range(steps)), 1):  # from the full robot backwards: there the answer is known
        found[k] = search.step((k + 1) / steps)
        if watch is not None:
            watch(done, steps)
    return _plan(leader, freedom, steps, found)


class _Leader:
    """The reference curve, and the exposed body at any command compared with it."""

    def __init__(self, robot: Robot, target: float, gravity) -> None:
        self.robot, self.target, self.gravity, self.length = robot, target, gravity, robot.length_na
        shape = solve(robot, target, gravity, accuracy=0.1 * PLANNING_ACCURACY)
        self.steps = 2 * max(16, -(-shape.steps // 4))
        self.sigma = np.linspace(0.0, 1.0, self.steps + 1)  # the integrator's own nodes; Simpson's rule over them
        self.weights = np.ones(self.steps + 1)
        self.weights[1:-1:2], self.weights[2:-1:2] = 4.0, 2.0
        self.weights /= self.weights.sum()
        self.shape = shape.at(np.linspace(0.0, self.length, REFERENCE_SAMPLES))
        slopes = np.einsum("nij,nj->ni", self.shape.rotation, self.shape.v)
        self.curve = Curve(s=self.shape.s, points=self.shape.position, slopes=slopes)
        self._last: Shape | None = None

    def body(self, insertion: float, tension: float, rotation: float = 0.0) -> Shape:
        """Exposed shape at evenly spread sections; started from the last one asked for."""
        s = insertion * self.length * self.sigma
        shape = solve(
            self.robot, tension, self.gravity, insertion=insertion, rotation=rotation, s=s,
            accuracy=PLANNING_ACCURACY, steps=self.steps, start=self._last,
        )  # fmt: skip
        self._last = shape
        return shape

    def forget(self) -> None:
        """Start the next body afresh."""
        self._last = None

    def deviation(self, shape: Shape):
        """(n, 3) vectors from the reference's closest points to the body, and the tip's foot point parameter (m)."""
        near = self.curve.project(shape.position, guess=shape.s)
        return shape.position - near.point, float(near.s[-1])


class _Optimal:
    """Gauss-Newton on the tension (one freedom) or tension and rotation (two), to a gradient of zero."""

    SPREAD = np.array([1e-3, 1e-4])  # N, rad: arms of the central differences, relative error about 1e-7

    def __init__(self, leader: _Leader, freedoms: int) -> None:
        self.leader, self.freedoms = leader, freedoms
        self.best = np.array([leader.target, 0.0])[:freedoms]
        self.scale = np.array([max(leader.target, 1e-3), 1.0])[:freedoms]  # N, rad

    def step(self, eta: float):
        """(insertion, rotation, tension, shape) of the optimum at progress ``eta``."""
        x = self.best
        insertion, shape, offset = self._exposed(eta, x)
        for _ in range(40):
            move = self._move(x, offset, self._slopes(eta, x, insertion), shape)
            if np.all(np.abs(move) <= 1e-8 * self.scale):
                break
            better = self._shortened(eta, x, move, insertion, self._cost(offset))
            if better is None or np.array_equal(better[0], x):
                break
            x, insertion, shape, offset = better
        self.best = x
        return insertion, float(x[1]) if self.freedoms == 2 else 0.0, float(x[0]), shape

    def _shortened(self, eta: float, x, move, insertion: float, cost: float):
        """(x, insertion, shape, deviations) after as much of ``move`` as does not raise the cost, None if none does."""
        for _ in range(30):
            trial = x - move
            trial[0] = max(trial[0], 0.0)
            try:
                found = self._exposed(eta, trial, insertion)
                if self._cost(found[2]) <= cost * (1 + 1e-9) + 1e-24:
                    return trial, *found
            except NotConverged:  # so far that nothing stands there
                self.leader.forget()
            move = 0.5 * move
        return None

    def _exposed(self, eta: float, x, insertion: float | None = None):
        """(insertion, shape, deviations); with two freedoms the insertion is matched by the secant method."""
        leader, tension, rotation = self.leader, float(x[0]), float(x[1]) if self.freedoms == 2 else 0.0
        insertion = eta if insertion is None else insertion
        shape = leader.body(insertion, tension, rotation)
        offset, foot = leader.deviation(shape)
        if self.freedoms == 1:
            return insertion, shape, offset
        slope, last, missed = leader.length, insertion, foot - eta * leader.length
        for _ in range(30):
            target = min(1.0, max(0.5 * insertion, insertion - missed / slope))
            if abs(target - insertion) < 1e-13:
                break
            last, before, insertion = insertion, missed, target
            shape = leader.body(insertion, tension, rotation)
            offset, foot = leader.deviation(shape)
            missed = foot - eta * leader.length
            if missed != before:
                slope = (missed - before) / (insertion - last)
        return insertion, shape, offset

    def _slopes(self, eta: float, x, insertion: float):
        columns = []
        for i in range(self.freedoms):
            arm = np.zeros(self.freedoms)
            arm[i] = self.SPREAD[i]
            low = x - arm
            low[0] = max(low[0], 0.0)
            ahead, behind = self._body(eta, x + arm, insertion), self._body(eta, low, insertion)
            columns.append((ahead.position - behind.position) / (x + arm - low)[i])
        return columns

    def _body(self, eta: float, x, insertion: float) -> Shape:
        if self.freedoms == 1:
            return self.leader.body(eta, float(x[0]))
        return self._exposed(eta, x, insertion)[1]

    def _move(self, x, offset, slopes, shape: Shape):
        """Gauss-Newton step to be subtracted; only what is normal to the body counts in the Hessian.

        A freedom that hardly moves the body sideways, such as the tension of a tendon on the axis, stays as it is. A
        tension that would turn negative goes to zero, and the rotation is then the best for that.
        """
        weights = self.leader.weights
        tangent = np.matmul(shape.rotation, shape.v[:, :, None])[:, :, 0]
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        normal = [slope - np.einsum("nj,nj->n", slope, tangent)[:, None] * tangent for slope in slopes]
        gradient = np.array([np.einsum("n,nj,nj->", weights, offset, slope) for slope in slopes])
        hessian = np.array([[np.einsum("n,nj,nj->", weights, a, b) for b in normal] for a in normal])
        free = np.sqrt(np.diag(hessian)) * self.scale > 1e-6 * shape.length
        move = np.zeros(self.freedoms)
        move[free] = np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
        if move[0] > x[0]:
            move[0] = x[0]
            if self.freedoms == 2 and free[1]:
                move[1] = (gradient[1] - hessian[1, 0] * move[0]) / hessian[1, 1]
        return move

    def _cost(self, offset) -> float:
        return float(np.einsum("n,nj,nj->", self.leader.weights, offset, offset))


class _Ascending:
    """The paper's search: raise the tension from zero until the body is near enough to the sampled reference."""

    def __init__(self, leader: _Leader, tension_step: float, tolerance: float, samples: int) -> None:
        self.leader, self.tension_step, self.tolerance = leader, tension_step, tolerance
        self.samples = leader.curve.at(np.linspace(0.0, leader.length, samples))

    def step(self, eta: float):
        closest, kept = np.inf, None
        for i in range(int(2.0 * self.leader.target / self.tension_step) + 2):
            tension = i * self.tension_step
            shape = self.leader.body(eta, tension)
            offsets = shape.position[:, None, :] - self.samples[None, :, :]
            farthest = float(np.sqrt(np.einsum("nkj,nkj->nk", offsets, offsets).min(axis=1).max()))
            if farthest < closest:
                closest, kept = farthest, (eta, 0.0, tension, shape)
            if farthest <= self.tolerance:
                break
        return kept


def _plan(leader: _Leader, freedom: str, steps: int, found) -> Plan:
    eta = np.arange(1, steps + 1) / steps
    insertion, rotation, tension, shapes = zip(*found, strict=True)
    offsets = [leader.deviation(shape)[0] for shape in shapes]
    distances = np.linalg.norm(offsets, axis=2)
    tips = np.array([shape.tip for shape in shapes])
    return Plan(
        robot=leader.robot,
        target_tension=leader.target,
        gravity=np.array(leader.gravity),
        freedom=freedom,
        reference=leader.curve,
        progress=eta,
        insertion=np.array(insertion),
        rotation=np.array(rotation),
        tension=np.array(tension),
        body_rms=np.sqrt(distances**2 @ leader.weights),
        body_max=distances.max(axis=1),
        tip_error=distances[:, -1],
        tip_error_at_progress=np.linalg.norm(tips - leader.curve.at(eta * leader.length), axis=1),
        shapes=tuple(shapes),
    )
