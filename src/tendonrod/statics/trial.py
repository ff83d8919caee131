"""`Trial`: a rod on one grid, a possible shape of it, and Newton's method that brings it into balance."""

from __future__ import annotations

from math import inf
from types import ModuleType
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .actuation import Strands
from .contact import Contact
from .problem import RodProblem
from .solution import compiled_newton

if TYPE_CHECKING:
    from .newton import NewtonSolution
    from .solution import Solution

GAUSS = 0.5 - 3**0.5 / 6  # nodes of the two-point Gauss rule: GAUSS and 1 - GAUSS
ITERATIONS = 60


class Strained(Protocol):
    """What a trial can begin from."""

    @property
    def grid(self) -> np.ndarray: ...

    @property
    def strains(self) -> np.ndarray: ...


class Trial:
    """A rod on one grid: its strains x (2n, 6), and what follows from them; arrays as in `kernel_newton`."""

    def __init__(
        self, problem: RodProblem, grid: np.ndarray, kinks: np.ndarray | None = None, rubs: bool = False
    ) -> None:
        self.problem, self.grid = problem, grid
        self.kinks = np.zeros(0) if kinks is None else kinks  # arc lengths, nodes of the grid, where tensions bend
        n = self.n = len(grid) - 1
        T = self.n_tendons = problem.robot.n_tendons
        self.station = np.empty((2 * n, self.kernel.TENDON + self.kernel.TENDON_WIDTH * T))
        self.tensions = problem.tensions.copy()
        self.share = np.ones((2 * n, T))  # of the tension at the exit that arrives at a stage
        self.x = np.empty((2 * n, 6))
        self.start, self.end, self.frame = np.empty((n, 12)), np.empty((n, 12)), np.empty((2 * n, 12))
        self.start[0] = problem.frame
        self.start[0, :3] = 0.0
        self.touch = np.zeros((2 * n + 1, 12))
        self.wrench, self.inner, self.left = np.empty((n + 1, 6)), np.empty((2 * n, 6)), np.empty((2 * n, 6))
        self.hessian, self.work = np.empty((2 * n, 6, 6)), np.empty((4, 12, 12))
        self.E, self.Q, self.X = np.empty((n, 3, 6, 12)), np.empty((n, 12, 12)), np.empty((n, 12, 6))
        self.K, self.S = np.empty((2 * n, 6, 6)), np.empty((n + 1, 6, 6))
        self.strain, self.twist, self.y = np.empty((2 * n, 6)), np.empty((n + 1, 6)), np.empty((n, 12))
        self.push = np.empty((n + 1, 6))
        self.at_rest = np.zeros((2 * n, 6)), np.zeros((n, 3, 6)), np.zeros((n + 1, 6)), np.zeros(6)
        self.points, self.joints = self._at_nodes(problem.points), self._at_nodes(problem.robot.joints)
        none = np.empty(0)
        self.no_contact = (np.empty((0, 16)), none, 1.0, none, none)
        self.energy, self.negative = inf, 0
        self.place()
        self.contact = None if problem.request.surface is None else Contact(problem, self)
        self.strands = Strands(problem, self, rubs) if rubs or problem.request.answers else None

    @property
    def kernel(self) -> ModuleType:
        """The compiled functions; no attribute, so that trials can be pickled."""
        return compiled_newton()

    @property
    def strains(self) -> np.ndarray:
        """(2n, 6) strains of the stages."""
        return self.x

    @property
    def stages(self) -> np.ndarray:
        """(2n,) arc lengths of the stages, m."""
        return (self.grid[:-1, None] + np.diff(self.grid)[:, None] * np.array([GAUSS, 1.0 - GAUSS])).ravel()

    @property
    def weights(self) -> np.ndarray:
        """(2n,) weights of the stages in an integral over s, m."""
        return np.repeat(0.5 * np.diff(self.grid), 2)

    def place(self) -> None:
        """Sections, tendons and dead loads at the stages."""
        p = self.problem
        self.kernel.place(
            p.robot.section_table, p.robot.tendon_table, p.robot.tendon_ends, self.share * self.tensions, p.spread,
            p.world, p.robot.axis_table, p.s_exit, self.grid, self.n, self.station,
        )  # fmt: skip

    def rest(self) -> bool:
        """Take the strains of the rod under its tendons alone. False where there are none."""
        if self.strands is not None:
            self.strands.guess(self)
        self.x[0] = self.station[0, 6:12]
        p = self.problem
        return self.kernel.relax(self.station, self.n_tendons, p.length, p.robot.rod_constants[12], self.x, self.work)

    def begin(self, other: Strained) -> None:
        """Take over the strains of another grid, linear within each of its steps and stretched to this length."""
        if self.contact is not None and isinstance(other, Trial) and other.contact is not None:
            self.contact.begin(other.contact)
        if isinstance(other, Trial) and self.strands is not None:
            self.tensions = np.where(np.isnan(self.problem.pulled), self.problem.tensions, other.tensions)
            if self.strands.rubs:
                self.share = other.share_at(self.stages)
            self.place()
        if len(other.strains) == len(self.x):
            self.x[:] = other.strains
            return
        grid = other.grid * (self.grid[-1] / other.grid[-1])
        k = np.clip(np.searchsorted(grid, 0.5 * (self.grid[:-1] + self.grid[1:])) - 1, 0, len(grid) - 2).repeat(2)
        c = ((self.stages - grid[k]) / np.diff(grid)[k] - GAUSS) / (1.0 - 2.0 * GAUSS)
        one, two = other.strains[2 * k], other.strains[2 * k + 1]
        self.x[:] = one + c[:, None] * (two - one)

    def take(self, solution: Solution | NewtonSolution) -> None:
        """Take over a solution on the same grid."""
        self.x[:], self.tensions = solution.strains, solution.tensions.copy()
        if isinstance(solution.problem, RodProblem):
            other = solution.trial  # pyright: ignore[reportAttributeAccessIssue]
            self.share = other.share.copy()
            if self.contact is not None and other.contact is not None:
                self.contact.same_as(other.contact)
        self.place()
        if self.strands is not None:
            self.strands.along(self, self.x)

    def share_at(self, s: np.ndarray) -> np.ndarray:
        """(k, T) shares of the tensions that arrive at arc lengths ``s`` (k,)."""
        return np.stack([np.interp(s, self.stages, self.share[:, i]) for i in range(self.n_tendons)], axis=1)

    @property
    def _arrays(self) -> tuple:
        """Arguments by which the kernel knows this trial."""
        touching = self.no_contact if self.contact is None else self.contact.arrays
        return (
            self.grid, self.n, self.station, self.n_tendons, self.points, self.joints, touching, self.x, self.start,
            self.end, self.frame, self.touch, self.wrench, self.inner, self.left, self.hessian,
        )  # fmt: skip

    @property
    def _linear(self) -> tuple:
        """Arguments of the linearised rod."""
        zero, no_twist, no_load, at_rest = self.at_rest
        return (
            self.E, self.Q, self.X, self.K, self.S, zero, no_twist, no_load, at_rest, self.strain, self.twist,
            self.push, self.y, self.work, np.empty_like(self.x), np.empty_like(self.x),
        )  # fmt: skip

    def walk(self) -> None:
        """Frames, contact forces, wrenches, imbalance and energy of the strains."""
        self.energy = self.kernel.walk(*self._arrays, self.work)

    def factor(self) -> int:
        """Factors of the linearised rod; returns the number of directions in which the energy falls."""
        self.negative = self.kernel.factor(
            self.grid, self.n, self.station, self.points, self.x, self.start, self.end, self.frame, self.touch,
            self.inner, self.hessian, self.E, self.Q, self.X, self.K, self.S, self.work,
        )  # fmt: skip
        return self.negative

    def respond(self, left: np.ndarray | None = None, node_load: np.ndarray | None = None):
        """(strains (2n, 6), twists of the nodes (n+1, 6)) that answer the forcing; see `kernel_newton.respond`."""
        zero, no_twist, no_load, at_rest = self.at_rest
        left, node_load = zero if left is None else left, no_load if node_load is None else node_load
        self.kernel.respond(
            self.grid, self.n, self.frame, self.E, self.Q, self.X, self.K, self.S, self.inner, left, no_twist, zero,
            node_load, at_rest, self.strain, self.twist, self.push, self.y, self.work,
        )  # fmt: skip
        return self.strain, self.twist

    def settle(self, tolerance: float, most: int = ITERATIONS) -> int:
        """Newton's method, damped so that every correction is smaller than the one before.

        tolerance: size of the last correction, m. Returns the number of iterations, negative where they lead nowhere,
        0 where ``most`` were not enough.
        """
        return self.kernel.settle(*self._arrays, *self._linear, self.problem.length, tolerance, most)

    def descend(self, tolerance: float, most: int = ITERATIONS) -> int:
        """Newton's method that goes down in energy, for loads with a potential. Arguments and result as `settle`."""
        stiff = np.empty_like(self.hessian)
        return self.kernel.descend(*self._arrays, *self._linear, stiff, self.problem.length, tolerance, most)

    def distance(self, finer: Trial) -> float:
        """Largest distance of the nodes from the same places of a finer trial."""
        same = finer.n == 2 * self.n and np.array_equal(finer.grid[::2], self.grid)
        there = finer.end[1::2, :3] if same else finer.rows(self.grid[1:])[:, :3] - finer.problem.frame[:3]
        return float(np.linalg.norm(self.end[:, :3] - there, axis=1).max())

    def line_force(self, at: np.ndarray) -> np.ndarray:
        """(n, 3) dead force per metre at arc lengths ``at``, weight included, N/m."""
        row, p, found = np.empty(self.station.shape[1]), self.problem, np.empty((at.size, 3))
        for i, s in enumerate(at):
            k = min(int(np.searchsorted(self.grid, s, side="right")), self.n) - 1
            middle = p.s_exit + 0.5 * (self.grid[k] + self.grid[k + 1])
            self.kernel.fill(
                p.robot.section_table, p.robot.tendon_table, p.spread, p.world, p.robot.axis_table, p.s_exit + s,
                middle, row,
            )  # fmt: skip
            found[i] = row[self.kernel.WEIGHT : self.kernel.WEIGHT + 3] + row[self.kernel.DEAD : self.kernel.DEAD + 3]
        return found

    @property
    def _where(self) -> tuple:
        """Arguments by which the kernel knows this rod at any arc length."""
        p = self.problem
        return (
            p.robot.section_table, p.robot.tendon_table, p.robot.tendon_ends, self.share * self.tensions, p.spread,
            p.world, p.robot.axis_table, p.s_exit, self.grid, self.n, self.station, self.x, self.start, self.frame,
            self.touch, self.wrench,
        )  # fmt: skip

    def rows(self, at: np.ndarray) -> np.ndarray:
        """(n, 24) read-only rows p[3] R[9] v[3] u[3] N[3] M[3] at arc lengths ``at`` (n,), m."""
        p, rows, row, at = self.problem, np.empty((at.size, 24)), np.empty(self.station.shape[1]), np.array(at)
        self.kernel.sample(
            *self._where, self.end, p.length, p.robot.rod_constants[12], at, row, rows, np.empty_like(self.work)
        )
        rows[:, :3] += p.frame[:3]
        rows.setflags(write=False)
        return rows

    def unbalanced(self, at: np.ndarray, strains: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(frames (n, 12) relative to the base's place, imbalance (n, 6)) at ``at`` (n,) for strains (n, 6) there."""
        frames, left, at = np.empty((at.size, 12)), np.empty((at.size, 6)), np.array(at)
        self.kernel.unbalanced(
            *self._where, at, strains, np.empty(self.station.shape[1]), frames, left, np.empty_like(self.work)
        )
        return frames, left

    def response_at(self, at: np.ndarray, strains: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(twists, strains) (n, 6) of the last `respond` at ``at`` (n,); left (n, 6): explicit imbalance there."""
        moved, strained = np.empty((at.size, 6)), np.empty((at.size, 6))
        self.kernel.response_at(
            *self._where, self.E, self.K, self.S, self.strain, self.twist, self.push, self.at_rest[0], np.array(at),
            strains, left, np.empty(self.station.shape[1]), moved, strained, np.empty_like(self.work),
        )  # fmt: skip
        return moved, strained

    def columns(self, changes: np.ndarray, at: np.ndarray, strains: np.ndarray) -> np.ndarray:
        """(c, n, 12) twists and strains at ``at`` (n,) by c linear changes, see `kernel_newton.columns`."""
        zero, no_twist, *_ = self.at_rest
        q, pull = np.empty((2 * self.n, self.n_tendons, 3)), np.empty((2 * self.n, self.n_tendons, 6))
        found = np.empty((len(changes), at.size, 12))
        self.kernel.columns(
            *self._where, self.E, self.Q, self.X, self.K, self.S, self.inner, self.end, self.points, self.share,
            changes, np.array(at), strains, no_twist, np.empty_like(zero), np.empty_like(zero),
            np.empty((self.n + 1, 6)), q, pull, self.strain, self.twist, self.push, self.y,
            np.empty(self.station.shape[1]), np.empty((at.size, 6)), np.empty((at.size, 6)), np.empty((at.size, 6)),
            found, self.work,
        )  # fmt: skip
        return found

    def _at_nodes(self, rows: np.ndarray) -> np.ndarray:
        """``rows`` that act on the exposed rod, sorted, with the number of the node in place of the coordinate."""
        if not len(rows):
            return rows
        at = rows[:, 0] - self.problem.s_exit
        order = np.argsort(at, kind="stable")
        order = order[at[order] > 1e-9 * self.problem.length]
        found = np.ascontiguousarray(rows[order])
        found[:, 0] = np.abs(self.grid - at[order, None]).argmin(axis=1)
        return found
