"""`Shape`: the solved configuration of a robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidInput, numbers, whole
from .contact import Contacts
from .limits import shape_warnings
from .newton import NewtonSolution
from .solution import RETRACTED, Solution

if TYPE_CHECKING:
    from ..robot import Robot
    from .derivatives import Jacobian


class Status(StrEnum):
    """How a solve ended; each value is a sentence that says what to do."""

    CONVERGED = "force and moment balance within the tolerance"
    STALLED = (
        "no equilibrium found on the way from the unloaded robot to the full load, "
        "where it may buckle, fold or be pulled straight; "
        "lower the load, or go there in small steps, each started from the last"
    )
    NO_EQUILIBRIUM_ON_BRANCH = (
        "the branch that starts at the unloaded robot ends at a fold before the full load, where the robot snaps to "
        "a distant shape, if there is one; "
        "stay below the critical load, or follow the branch with tendonrod.statics.branches.follow_branch"
    )
    LOCAL_FAILED = (
        "the strain of a section could not be balanced, because the tensions crush the rod; "
        "lower the tensions or check the section"
    )
    NOT_REACHED = "not solved, because the batch was stopped before; solve the rest in another batch"
    TOO_FINE = "the accuracy asked for needs more steps than allowed; ask for a larger accuracy"


class Stability(StrEnum):
    """Sign of the energy's second variation at an equilibrium."""

    STABLE = "stable"
    UNSTABLE = "unstable"
    AT_A_FOLD = "at a fold"


AT_A_FOLD = 1e-5  # of `Linear.softest`: below it which a shape stands at a fold or bifurcation


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Shape:
    """Configuration of the exposed robot at the arc lengths ``s`` (n,), 0 at the outer tube's exit; SI, world frame.

    Made by `tendonrod.solve`. It also holds ``robot``, ``status`` (`Status`) and ``load_factor``, the share of the load
    that was reached, the critical one where the branch ends at a fold. All arrays are read-only. A shape that did not
    converge holds NaN.
    """

    robot: Robot
    s: np.ndarray
    status: Status
    load_factor: float
    _rows: np.ndarray
    _solution: Solution | NewtonSolution

    def __repr__(self) -> str:
        tip = ", ".join(f"{1e3 * x:.4g}" for x in self.tip)
        return f"Shape({self.robot.name}, {self.s.size} sections, tip ({tip}) mm, {self.status.name.lower()})"

    @property
    def converged(self) -> bool:
        """Whether force and moment balance within the tolerance."""
        return self.status is Status.CONVERGED

    @property
    def tensions(self) -> np.ndarray:
        """(n_tendons,) at the exit, N."""
        return _frozen(self._solution.tensions.copy())

    @property
    def residual(self) -> float:
        """Imbalance left over, as a share of EI / length of the softest stiffness; dimensionless."""
        return self._solution.residual

    @property
    def iterations(self) -> int:
        """Trial base moments, over all grids; of the last solve, where continuation led to it."""
        return self._solution.iterations

    @property
    def error_estimate(self) -> float:
        """Estimated position error (m) anywhere on the body; 0 in closed form, NaN where ``steps`` were fixed."""
        return self._solution.error if self.converged else float("nan")

    @property
    def steps(self) -> int:
        """Steps of the integrator."""
        return self._solution.steps

    @property
    def position(self) -> np.ndarray:
        """(n, 3) neutral axis p, m."""
        return self._rows[:, 0:3]

    @property
    def rotation(self) -> np.ndarray:
        """(n, 3, 3) section frame R, its columns the axes in the world frame; x points from neutral to tube axis."""
        return self._rows[:, 3:12].reshape(-1, 3, 3)

    @property
    def v(self) -> np.ndarray:
        """(n, 3) shear and extension strain, section frame, p' = R v."""
        return self._rows[:, 12:15]

    @property
    def u(self) -> np.ndarray:
        """(n, 3) bending and twist, section frame, 1/m, R' = R u^."""
        return self._rows[:, 15:18]

    @property
    def force(self) -> np.ndarray:
        """(n, 3) total internal force N (rod and tendons), world frame, N."""
        return self._rows[:, 18:21]

    @property
    def moment(self) -> np.ndarray:
        """(n, 3) total internal moment M (rod and tendons), world frame, N m."""
        return self._rows[:, 21:24]

    @cached_property
    def centerline(self) -> np.ndarray:
        """(n, 3) axis of the tube, c = p + R [r_na, 0, 0], m; what trackers, clearance and contact refer to."""
        x, y = self.robot.axis_offset(self.material_coordinate).T
        return _frozen(self.position + x[:, None] * self.rotation[:, :, 0] + y[:, None] * self.rotation[:, :, 1])

    @property
    def tip(self) -> np.ndarray:
        """(3,) end of the neutral axis, m, whether or not ``s`` reaches it."""
        return _frozen(self._solution.nodes[-1].copy() if self.converged else np.full(3, np.nan))

    @property
    def length(self) -> float:
        """Exposed length of the neutral axis, insertion * L_na, m."""
        return self._solution.length

    @property
    def insertion(self) -> float:
        """Exposed share of the robot, 0 to 1."""
        return self.length / self.robot.length_na

    @property
    def loaded(self) -> bool:
        """Whether any load acts, weight included."""
        return self._solution.loaded

    @property
    def line_force(self) -> np.ndarray:
        """(n, 3) dead force per metre of s, weight included, world frame, N/m."""
        return _frozen(self._solution.line_force(self.s))

    @property
    def material_coordinate(self) -> np.ndarray:
        """(n,) s_m = s + (1 - insertion) L_na, m."""
        return self.s + self._solution.s_exit

    @cached_property
    def stable(self) -> bool | None:
        """Whether the energy's second variation is positive (Jacobi's condition, docs/method).

        Tendons pulled by length are held at that length. None if not solved, and where what acts has no potential:
        moments fixed in the world, loads that turn with the body, friction.
        """
        if not self.converged or self.robot.friction.any():
            return None
        if self._solution.is_driven and self.length > RETRACTED and self._solution.is_stable() is not None:
            from .second_variation import linearised

            return linearised(self._solution).negative == 0
        return self._solution.is_stable()

    @cached_property
    def stability(self) -> Stability | None:
        """Sign of the energy's second variation: "stable", "unstable", or "at a fold" or bifurcation; None as `stable`.

        The sign is that of `stable`. At a fold: the second variation vanishes in some direction if the stiffness of all
        sections, tendons included, is changed by less than 1e-5 of itself: for a column, within 1e-5 of Euler's load.
        """
        if self.stable is None:
            return None
        if self.length > RETRACTED:
            from .second_variation import linearised

            if abs(linearised(self._solution).softest()) < AT_A_FOLD:
                return Stability.AT_A_FOLD
        return Stability.STABLE if self.stable else Stability.UNSTABLE

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on where the model ends (plateau, closed notches, lifted tendon) and whether it is unstable."""
        return shape_warnings(self)

    @cached_property
    def contacts(self) -> Contacts | None:
        """Where the robot touches the surface that was given, with what force; None without a surface or a solution."""
        known = isinstance(self._solution, NewtonSolution) and self.converged
        return self._solution.contacts if known else None  # pyright: ignore[reportAttributeAccessIssue]

    def balance_error(self) -> float:
        """Largest relative error of the equations that it should obey, by a check that shares nothing with the solver.

        Dimensionless, NaN if it did not converge; parts, units and places: `tendonrod.statics.balance.balance_errors`.
        """
        from .balance import balance_error  # it imports this module's solver

        return balance_error(self)

    def section_point(self, x: float, y: float) -> np.ndarray:
        """(n, 3) path of the point (x, y) of the section, measured from the neutral axis, m."""
        rotation = self._rows[:, 3:12]
        return _frozen(self.position + x * rotation[:, 0::3] + y * rotation[:, 1::3])

    def tendon_path(self, i: int = 0) -> np.ndarray:
        """(k, 3) path of tendon ``i`` through the exposed robot, k <= n points up to where it ends, m."""
        if self.robot.n_tendons == 0:
            raise InvalidInput("i", i, f"left alone: {self.robot.name} has no tendons")
        i = whole("i", i, 0, self.robot.n_tendons - 1)
        s_m = self.material_coordinate
        reach = s_m <= self.robot.tendon_ends[i] * (1 + 1e-12)
        offset = self.robot.tendon_position(i, s_m[reach])
        return _frozen(self.position[reach] + np.einsum("nij,nj->ni", self.rotation[reach], offset))

    def jacobian(self, *inputs: str, s=None) -> Jacobian:
        """Derivatives of position, rotation and strains by ``inputs``, at arc lengths ``s`` (m), None for those here.

        Inputs: tensions or displacements, gravity, tip_force, tip_moment, distributed_force, distributed_moment,
        insertion, rotation, exit_position and exit_rotation (world frame, about the exit), exit_tilt, exit_offset,
        loads[i].force and the like, and every name of `Robot.parameters`; a vector stands for all its entries,
        "tip_force[0]" for one. Exact for the equations on the solution's grid (docs/method). Raises `InvalidInput` by
        name.
        """
        from .derivatives import jacobian

        self._must_be_solved("jacobian")
        return jacobian(self, inputs, self.s if s is None else arc_lengths(s, self.length))

    @cached_property
    def tip_compliance(self) -> np.ndarray:
        """(6, 6) motion of the tip (m, rad; world frame, at the neutral axis) by a force (N) and moment (N m) there."""
        from .derivatives import compliance

        self._must_be_solved("tip_compliance")
        return _frozen(compliance(self))

    @cached_property
    def tip_stiffness(self) -> np.ndarray:
        """(6, 6) inverse of `tip_compliance`: N/m, N, N, N m."""
        return _frozen(np.linalg.inv(self.tip_compliance))

    def _must_be_solved(self, what: str) -> None:
        if not self.converged or self.length == 0.0:
            raise InvalidInput(what, self.status.name.lower(), "asked of a solved shape with something exposed")

    def at(self, s) -> Shape:
        """The same configuration at other arc lengths ``s`` (m, from 0 to `length`), equally accurate."""
        at = arc_lengths(s, self.length)
        rows = self._solution.rows(at) if self.converged else np.full((at.size, 24), np.nan)
        return replace(self, s=_frozen(at), _rows=_frozen(rows))

    def __setstate__(self, state: dict) -> None:
        vars(self).update(state)
        _frozen(self.s)
        _frozen(self._rows)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def arc_lengths(s, length: float) -> np.ndarray:
    """``s`` as (n,) floats within [0, length]; a rounding error beyond the end is taken for the end."""
    at = numbers("s", s)
    if at.size == 0 or at.min() < 0.0 or at.max() > length * (1.0 + 1e-9):
        raise InvalidInput("s", s, f"one or more numbers from 0 to the exposed length {length:.6g} m")
    return np.minimum(at, length, out=at)
