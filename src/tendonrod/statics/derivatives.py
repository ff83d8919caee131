"""`jacobian`: how a shape answers a change of what was asked, exact through the implicit function theorem.

The discrete equations r(x; input) = 0 on the solution's grid are differentiated: dx = -(dr/dx)^-1 dr/dinput. dr/dx is
factored once; dr/dinput is taken at fixed strains, where r is explicit: by its exact difference where it is linear in
the input, else by a central difference. No solve is ever differenced. Derivation: docs/method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..body import parts
from ..errors import InvalidInput
from ..rotation import log_so3
from .inputs import STEP, Scalar, change, named, numbers_of, sides
from .problem import SAME_PLACE, Request, RodProblem, problem_of, rod_problem
from .trial import GAUSS, Trial

if TYPE_CHECKING:
    from .shape import Shape

RIGID = 1e4  # contact stiffness in derivatives, relative to that of the solve
# Where inputs stand in a change of `Trial.columns`, behind the tensions.
PLACES = {"tensions": 0, "gravity": 0, "distributed_force": 3, "distributed_moment": 6, "tip_force": 9}
PLACES |= {"tip_moment": 12, "exit_position": 15, "exit_rotation": 18, "rotation": 18}
STAGES = np.array([0.0, GAUSS, 1.0 - GAUSS, 1.0 - 1e-13])  # of a step: ends, the last before a jump there, and stages
ROUNDS = 40  # of friction's answer


@dataclass(frozen=True, kw_only=True, eq=False)
class Jacobian:
    """Derivatives of a shape at arc lengths s (n,) by the m inputs ``names``; SI, world frame, columns last.

    position (n, 3, m) of the neutral axis; rotation (n, 3, m): rotation vector of the section; v, u (n, 3, m): strains
    in the section frame; tensions (T, m) at the exit. By insertion, material points are followed: the section that is
    at s moves out with the robot.
    """

    names: tuple[str, ...]
    s: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    v: np.ndarray
    u: np.ndarray
    tensions: np.ndarray

    def __repr__(self) -> str:
        return f"Jacobian({self.s.size} sections by {', '.join(self.names)})"

    def __getitem__(self, name: str) -> Jacobian:
        """The columns of one input, a number such as "insertion" or a vector such as "tip_force"."""
        on = [i for i, each in enumerate(self.names) if each == name or each.startswith(f"{name}[")]
        if not on:
            raise InvalidInput("name", name, "one of " + ", ".join(self.names))
        arrays = {key: getattr(self, key)[..., on] for key in ("position", "rotation", "v", "u", "tensions")}
        return replace(self, names=tuple(self.names[i] for i in on), **arrays)


def jacobian(shape: Shape, inputs: Sequence[str], s: np.ndarray) -> Jacobian:
    """Derivatives of ``shape`` at ``s`` (n,) by ``inputs``; see `Shape.jacobian`."""
    answers = _Answers(shape, s, rubs=any("friction" in name for name in inputs))
    asked = answers.trial.problem.request
    scalars = [scalar for name in inputs for scalar in numbers_of(asked, name)]
    found = np.empty((len(scalars), s.size, 12))
    tensions = np.zeros((len(scalars), asked.robot.n_tendons))
    quick = [i for i, (stem, *_) in enumerate(scalars) if stem in PLACES and answers.strands is None]
    if quick:
        found[quick] = answers.at_once([scalars[i] for i in quick])
    for i in quick:
        if scalars[i][0] == "tensions":
            tensions[i, scalars[i][1]] = 1.0
    for i in sorted({*range(len(scalars))} - {*quick}):
        found[i], tensions[i] = answers.column(*sides(asked, *scalars[i]))
    moved = found.transpose(1, 2, 0)
    position = moved[:, :3] + np.cross(moved[:, 3:6], answers.frames[:, :3, None], axis=1)
    arrays = {"position": position, "rotation": moved[:, 3:6], "v": moved[:, 6:9], "u": moved[:, 9:]}
    arrays["tensions"] = tensions.T
    for array in (s, *arrays.values()):
        array.setflags(write=False)
    return Jacobian(names=tuple(named(stem, i) for stem, i, *_ in scalars), s=s, **arrays)


def compliance(shape: Shape) -> np.ndarray:
    """(6, 6) motion (m, rad) of the tip by a force and moment there; see `Shape.tip_compliance`."""
    answers = _Answers(shape, np.array([shape.length]))
    trial, tip = answers.trial, answers.frames[0, :3]
    found = np.empty((6, 6))
    for i in range(6):
        push = np.zeros((trial.n + 1, 6))
        push[-1, i] = 1.0
        if i < 3:
            push[-1, 3:] = np.cross(tip, push[-1, :3])
        answer = answers.answer({"node_load": push}, np.zeros((4, 6)))
        v, w = answer[-1, :3], answer[-1, 3:6]
        found[:3, i], found[3:, i] = v + np.cross(w, tip), w
    return found


class _Answers:
    """Columns of one solved shape at arc lengths s: exact at nodes and stages of its steps, blended between them."""

    def __init__(self, shape: Shape, s: np.ndarray, rubs: bool = False) -> None:
        solution = shape._solution
        problem, self.rubs = problem_of(solution), rubs or bool(shape.robot.friction.any())
        self.trial = trial = Trial(problem, solution.grid.copy(), getattr(solution, "kinks", None), self.rubs)
        grid = trial.grid
        step = np.clip(np.searchsorted(grid, s, side="right") - 1, 0, trial.n - 1)
        h = np.diff(grid)[step]
        self.at, self.h, self.t = s, h, (s - grid[step]) / h
        self.nodes = bool((np.minimum(self.t, 1.0 - self.t) < 1e-9).all())  # nothing to be blended
        self.s = (grid[step, None] + h[:, None] * STAGES).ravel()  # where the columns are exact, four to a step
        trial.take(solution)
        if trial.contact is not None:
            trial.contact.pin(RIGID, problem.length, problem.request.contact_tolerance)
        trial.walk()
        trial.factor()
        rows = trial.rows(s)
        self.frames, self.strains_at = rows[:, :12].copy(), rows[:, 12:18].copy()
        self.frames[:, :3] -= trial.problem.frame[:3]
        self.strands = trial.strands
        self.units = self._units()

    @cached_property
    def strains(self) -> np.ndarray:
        """(4n, 6) strains at the ends and stages of the steps."""
        return self.trial.rows(self.s)[:, 12:18].copy()

    @cached_property
    def base(self) -> tuple[np.ndarray, np.ndarray]:
        """Frames (4n, 12) and imbalance (4n, 6) there."""
        return self.trial.unbalanced(self.s, self.strains)

    def column(self, up: Request, down: Request | None, size: float) -> tuple[np.ndarray, np.ndarray]:
        """((n, 12) twist and strains at s, (T,) tensions) by one input. ``down`` None: ``up`` is linear in it."""
        answer, missing = self._at_tensions(up, down, size)
        tensions = (up.tensions - (down or self.trial.problem.request).tensions) / size
        if not self.units:
            return answer, tensions
        driven = list(self.units)
        change = np.linalg.solve([[-self.units[j][1][i] for j in driven] for i in driven], missing[driven])
        tensions[driven] = change
        return answer + sum(by * self.units[j][0] for by, j in zip(change, driven, strict=True)), tensions

    def at_once(self, scalars: list[Scalar]) -> np.ndarray:
        """(c, n, 12) answers to numbers that the imbalance is linear in, or that move the base."""
        T, trial = self.trial.n_tendons, self.trial
        changes = np.zeros((len(scalars), T + 21))
        for row, (stem, i, *_) in zip(changes, scalars, strict=True):
            if stem == "tensions":
                row[i] = 1.0
            elif stem in ("rotation", "exit_rotation"):
                R, pose = trial.start[0, 3:].reshape(3, 3), trial.problem.request.pose
                axis = trial.station[0, trial.kernel.AXIS : trial.kernel.AXIS + 2]
                about = (np.zeros(3) if pose is None else pose[:3, 3]) - trial.problem.frame[:3]
                row[-3:], about = (R[:, 2], R[:, :2] @ axis) if stem == "rotation" else (np.eye(3)[i], about)
                row[-6:-3] = np.cross(about, row[-3:])
            else:
                row[T + PLACES[stem] + (i or 0)] = 1.0
        if self.nodes:
            return trial.columns(changes, self.at, self.strains_at)
        found, still = trial.columns(changes, self.s, self.strains), np.zeros(self.at.size)
        return np.array([self._between(each, still, still) for each in found])

    def answer(self, forcing: dict[str, np.ndarray], left: np.ndarray) -> np.ndarray:
        """(n, 12) answer to a forcing of `Trial.respond` at fixed tensions; left (n, 6): explicit imbalance at s."""
        self.trial.respond(**forcing)
        return np.hstack(self.trial.response_at(self.s, self.strains, left))

    def _units(self) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Answers to each tension that is not given but follows from a pulled length."""
        asked, found = self.trial.problem.request, {}
        for i in () if self.strands is None else self.strands.driven:
            if self.trial.tensions[i] > 0.0:
                half = STEP * self.trial.tensions[i]
                sides = change(asked, f"tensions[{i}]", half), change(asked, f"tensions[{i}]", -half)
                found[i] = self._at_tensions(*sides, 2.0 * half)
        return found

    def _at_tensions(self, up: Request, down: Request | None, size: float) -> tuple[np.ndarray, np.ndarray]:
        """((n, 12) answers, (T,) pulled length that goes missing), tensions that follow from lengths held."""
        base, strands = self.trial, self.strands
        high, low = self._moved(up), base if down is None else self._moved(down)
        if strands is None and self._stays(high.problem):
            return self._in_place(high, low, size), np.zeros(base.n_tendons)
        left = (high.left - low.left) / size
        places = self._carried(high.problem, self.s), self._carried(low.problem, self.s)
        frames, left_at = high.unbalanced(places[0], self.strains)
        frames_low, left_low = self.base if down is None else low.unbalanced(places[1], self.strains)
        left_at = (left_at - left_low) / size
        shift = (high.problem.frame[:3] - low.problem.frame[:3]) / size
        explicit = np.hstack([_twists(frames, frames_low, size, shift), np.zeros_like(left_at)])
        answer = explicit + self.answer({"left": left}, left_at)
        stretched = np.diff(((places[0] - places[1]) / size).reshape(-1, 4)[:, ::3], axis=1)[:, 0] / self.h
        ahead = [self._material(each.problem) - self._carried(each.problem, self.at) for each in (high, low)]
        moved = stretched, (ahead[0] - ahead[1]) / size
        if strands is None:
            return self._between(answer, *moved), np.zeros(base.n_tendons)
        strain, rubbed = base.strain.copy(), np.zeros_like(base.share)
        carried = base.share * (high.tensions - low.tensions) / size
        for _ in range(ROUNDS if self.rubs else 0):
            before, rubbed = rubbed, self._rubbed(high, low, size, strain) - carried
            more = np.einsum("jt,jti->ji", rubbed, strands.pull)
            answer = explicit + self.answer({"left": left + more}, left_at + self._left_by(rubbed))
            strain = base.strain.copy()
            if np.abs(rubbed - before).max() <= 1e-11 * np.abs(rubbed).max(initial=1e-300):
                break
        missing = (self._missing(high) - self._missing(low)) / size
        missing += np.einsum("j,jti,ji->t", base.weights, strands.pull, strain)
        missing -= strands.compliance * (base.weights @ (strands.rest * rubbed))
        return self._between(answer, *moved), missing

    def _in_place(self, high: Trial, low: Trial, size: float) -> np.ndarray:
        """(n, 12) answers where nothing moves at fixed strains: stiffness, weight, masses, forces."""
        s, strains = (self.at, self.strains_at) if self.nodes else (self.s, self.strains)
        left_at = (high.unbalanced(s, strains)[1] - low.unbalanced(s, strains)[1]) / size
        self.trial.respond(left=(high.left - low.left) / size)
        found = np.hstack(self.trial.response_at(s, strains, left_at))
        still = np.zeros(self.at.size)
        return found if self.nodes else self._between(found, still, still)

    def _stays(self, problem: RodProblem) -> bool:
        """Whether a changed problem has the exit, the length, all landmarks and kinked joints as they were."""
        base = self.trial.problem
        same = np.array_equal(problem.frame, base.frame) and problem.length == base.length
        same = same and np.array_equal(problem.robot.joints, base.robot.joints)
        return same and np.array_equal(_landmarks(problem), self.landmarks)

    @cached_property
    def landmarks(self) -> np.ndarray:
        """Those of the solution's problem."""
        return _landmarks(self.trial.problem)

    def _between(self, found: np.ndarray, stretched: np.ndarray, ahead: np.ndarray) -> np.ndarray:
        """(n, 12) answers at ``at`` from those at the nodes and stages: twists cubic with their slopes, strains cubic.

        stretched (n,): by how much the step grows with the input, per length; ahead (n,): by how much the material
        point moves on along the body beside that, m.
        """
        found, strains, places = (each.reshape(self.at.size, 4, -1) for each in (found, self.strains, self.base[0]))
        weights, slopes = _cubic(self.t)
        a, b = (_turned(places[:, i], found[:, i, 6:] + stretched[:, None] * strains[:, i]) for i in (0, 3))
        t, h = self.t[:, None], self.h[:, None]
        twist = (1.0 - t) ** 2 * ((1.0 + 2.0 * t) * found[:, 0, :6] + t * h * a)
        twist += t**2 * ((3.0 - 2.0 * t) * found[:, 3, :6] - (1.0 - t) * h * b)
        strain = np.einsum("ni,nij->nj", weights, found[..., 6:])
        here, change = np.einsum("ni,nij->nj", weights, strains), np.einsum("ni,nij->nj", slopes, strains) / h
        return np.hstack([twist + ahead[:, None] * _turned(self.frames, here), strain + ahead[:, None] * change])

    def _moved(self, asked: Request) -> Trial:
        """The solution's strains in a changed request."""
        base, problem = self.trial, rod_problem(asked)
        stays = self._stays(problem)
        grid, kinks = ((each if stays else self._carried(problem, each)) for each in (base.grid, base.kinks))
        trial = Trial(problem, grid, kinks, self.rubs)
        trial.x[:] = base.x
        trial.tensions = base.tensions + asked.tensions - base.problem.request.tensions
        trial.share = base.share
        trial.place()
        if trial.contact is not None and base.contact is not None:
            trial.contact.same_as(base.contact)
        trial.walk()
        return trial

    def _carried(self, problem: RodProblem, s: np.ndarray) -> np.ndarray:
        """Arc lengths ``s`` of nodes in a changed problem: exit, tip and all landmarks between them move along."""
        base = self.trial.problem
        before, after = self.landmarks, _landmarks(problem)
        same = min(len(before), len(after))  # all but a wrench new at the tip
        before, after = before[:same], after[:same]
        inside = np.abs(before / base.length - 0.5) < 0.5 - SAME_PLACE
        before, first = np.unique(before[inside], return_index=True)
        return np.interp(s, [0.0, *before, base.length], [0.0, *after[inside][first], problem.length])

    def _material(self, problem: RodProblem) -> np.ndarray:
        """The arc lengths of the same material points in a changed problem: the same share of the same segment."""
        base = self.trial.problem
        before, after = ([0.0, *(part.end for part in parts(each.robot.body))] for each in (base, problem))
        return np.interp(self.at + base.s_exit, before, after) - problem.s_exit

    def _rubbed(self, high: Trial, low: Trial, size: float, strain: np.ndarray) -> np.ndarray:
        """(2n, T) change of the tensions along the tendons with the inputs and the strains that answer."""
        fields = []
        for trial, sign in ((high, 0.5), (low, -0.5)):
            trial.x[:] = self.trial.x + sign * size * strain
            fields.append(trial.strands.field(trial))  # pyright: ignore[reportOptionalMemberAccess]
            trial.x[:] = self.trial.x
        return (fields[0] - fields[1]) / size

    def _left_by(self, rubbed: np.ndarray) -> np.ndarray:
        """(n, 6) imbalance at s by a change (2n, T) of the tensions along the tendons."""
        trial, share, base = self.trial, self.trial.share, self.base[1]
        size = 1e-3 * np.abs(share).max() / max(1e-300, np.abs(rubbed).max())
        by = np.divide(size * rubbed, trial.tensions, out=np.zeros_like(rubbed), where=trial.tensions > 0.0)
        trial.share = share + by
        left = (trial.unbalanced(self.s, self.strains)[1] - base) / size
        trial.share = share
        return left

    def _missing(self, trial: Trial) -> np.ndarray:
        strands = trial.strands
        strands.along(trial, trial.x)  # pyright: ignore[reportOptionalMemberAccess]
        return np.nan_to_num(strands.missing(trial))  # pyright: ignore[reportOptionalMemberAccess]


def _landmarks(problem: RodProblem) -> np.ndarray:
    """Arc lengths, in a fixed order, of all that a grid has nodes at."""
    robot = problem.robot
    ends = [part.end for part in parts(robot.body)], robot.tendon_ends
    return np.concatenate([*ends, problem.spread[:, :2].ravel(), problem.points[:, 0]]) - problem.s_exit


def _cubic(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 4) weights at t (n,) of the cubic through a step's ends and stages, and those of its slope by t."""
    powers = np.linalg.inv(STAGES ** np.arange(4)[:, None])
    one, none = np.ones_like(t), np.zeros_like(t)
    value, slope = np.stack([one, t, t**2, t**3], axis=1), np.stack([none, one, 2.0 * t, 3.0 * t**2], axis=1)
    return value @ powers.T, slope @ powers.T


def _turned(frames: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """(n, 6) spatial twists Ad_g strain about the base."""
    R = frames[:, 3:].reshape(-1, 3, 3)
    v, w = np.einsum("nij,nj->ni", R, strain[:, :3]), np.einsum("nij,nj->ni", R, strain[:, 3:])
    return np.hstack([v + np.cross(frames[:, :3], w), w])


def _twists(frames: np.ndarray, other: np.ndarray, size: float, shift: np.ndarray) -> np.ndarray:
    """(n, 6) twists from one set of frames (n, 12) to another; ``shift`` (3,): motion of their origin."""
    R, Q = frames[:, 3:].reshape(-1, 3, 3), other[:, 3:].reshape(-1, 3, 3)
    w = log_so3(R @ Q.transpose(0, 2, 1)) / size
    middle = 0.5 * (frames[:, :3] + other[:, :3])
    return np.hstack([(frames[:, :3] - other[:, :3]) / size + shift - np.cross(w, middle), w])
