"""The panels over which `balance` integrates, and what a shape gives at their Gauss-Legendre nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre

from .newton import NewtonSolution
from .problem import SAME_PLACE, problem_of

if TYPE_CHECKING:
    from .shape import Shape
    from .trial import Trial

NODES = 12  # in a panel
TURN = 3.0  # rad by which a section may turn within a panel of the first quadrature

X, WEIGHTS = legendre.leggauss(NODES)
SERIES = np.linalg.inv(legendre.legvander(X, NODES - 1))  # Legendre coefficients from values at the nodes
INTEGRAL = legendre.legvander(X, NODES) @ legendre.legint(SERIES, lbnd=-1)  # from -1 to each node
SLOPE = legendre.legvander(X, NODES - 2) @ legendre.legder(SERIES)  # derivatives at the nodes


class Places:
    """A shape, its problem and the stretches between the places where something ends or acts."""

    def __init__(self, shape: Shape) -> None:
        self.shape, solution = shape, shape._solution
        self.problem = problem_of(solution)
        self.length, self.exit, robot = solution.length, solution.s_exit, shape.robot
        self.tensions, self.reach = solution.tensions, robot.tendon_ends - self.exit
        self.frame = self.problem.frame
        touches = isinstance(solution, NewtonSolution) and self.problem.request.surface is not None
        self.touching: Trial | None = solution.trial if touches else None  # pyright: ignore[reportAttributeAccessIssue]
        tables = [robot.section_table[:, 0], robot.tendon_table[:, 1], robot.breaks, robot.joints[:, 0]]
        tables += [self.touching.grid + self.exit] if self.touching is not None else []
        marks = np.concatenate([*tables, self.problem.points[:, 0], self.problem.spread[:, :2].ravel()]) - self.exit
        near = SAME_PLACE * self.length
        marks = np.sort(marks[(marks > near) & (marks < self.length - near)])
        self.marks = np.concatenate([[0.0], marks[np.diff(marks, prepend=0.0) > near], [self.length]])
        helix = np.abs(robot.tendon_table[:, 14]).max(initial=0.0)
        rate = np.linalg.norm(solution.strains[:, 3:], axis=1).max() + helix  # only tells how fine to look
        self.panels = np.maximum(1, np.ceil(rate * np.diff(self.marks) / TURN)).astype(int)

    def count(self, split: int) -> int:
        """Panels when each of the coarsest is split."""
        return split * int(self.panels.sum())

    def starts(self, split: int) -> np.ndarray:
        """Start of each panel, and the end of the last."""
        spans = zip(self.marks[:-1], self.marks[1:], split * self.panels, strict=True)
        parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in spans]
        return np.concatenate([*parts, self.marks[-1:]])


class Samples:
    """What the shape gives at the start and the nodes of each of P panels and at the tip, in a row."""

    def __init__(self, places: Places, split: int) -> None:
        self.edges = edges = places.starts(split)
        self.width, self.middle = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
        self.panel = np.append(np.repeat(np.arange(len(self.width)), NODES + 1), len(self.width) - 1)
        nodes = edges[:-1, None] + 0.5 * self.width[:, None] * np.concatenate([[0.0], 1.0 + X])
        self.s = np.append(nodes, edges[-1])
        held = places.shape.s
        rows = places.shape.at(np.concatenate([self.s, held]))._rows
        self.held, rows = rows[len(self.s) :], rows[: len(self.s)]
        self.p, self.R = rows[:, :3] - places.frame[:3], rows[:, 3:12].reshape(-1, 3, 3)
        self.v, self.u, self.N, self.M = rows[:, 12:15], rows[:, 15:18], rows[:, 18:21], rows[:, 21:24]
        self.section = places.shape.robot.section_values(self.s + places.exit)

    def at_nodes(self, values: np.ndarray) -> np.ndarray:
        """(P, NODES, d) the values at the nodes of the panels."""
        return values[:-1].reshape(len(self.width), NODES + 1, -1)[:, 1:]


def edge(x: Samples, s: float) -> int:
    """Number of the edge that is nearest to an arc length."""
    return int(np.abs(x.edges - s).argmin())


def spread_out(start: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Values (n, d) at all samples, from those at the edges (P + 1, d) and the growth within (P, NODES, d)."""
    first = start[:-1, None]
    return np.concatenate([np.concatenate([first, first + inner], axis=1).reshape(-1, start.shape[1]), start[-1:]])
