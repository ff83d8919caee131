"""The paper's differential equations as printed, integrated on their own, to see what each misprint does.

The strains v, u are states; their tip values follow from the tendon's end (paper, last equations of II-B). Integrating
from the tip towards the base leaves only the tip's orientation to be found. SciPy only; shares no code with `statics`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import sin

import numpy as np

from ..device import notched_tube
from ..errors import NotConverged
from ..robot import Robot

SAMPLES = 2001  # enough for the ringing that the printed moment balance causes


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A solution of `PaperEquations`: arc lengths s (n,), neutral axis position (n, 3), strain u (n, 3), SI."""

    s: np.ndarray
    position: np.ndarray
    u: np.ndarray


@dataclass(frozen=True, kw_only=True)
class PaperEquations:
    """One robot with one constant tendon under its own weight, SI.

    length: L_na. r: tendon in the section (3,). force: line load (3,), world. base: p(0). r_c: point of the section at
    which the line load acts (3,). moment_term: "v" for -v^ Kse (v - v*) in the moment balance, "u" for the printed -u^.
    """

    length: float
    Kse: np.ndarray
    Kbt: np.ndarray
    v_star: np.ndarray
    u_star: np.ndarray
    r: np.ndarray
    tension: float
    force: np.ndarray
    base: np.ndarray
    r_c: np.ndarray
    moment_term: str = "v"

    def tip_strains(self) -> tuple[np.ndarray, np.ndarray]:
        """v(L_na), u(L_na) from the tendon's end, by Newton from the unloaded strains."""
        v, u = self.v_star.copy(), self.u_star.copy()
        for _ in range(100):
            matrix, q, _ = self._stiffness(v, u)
            pull = self.tension * q / np.linalg.norm(q)
            force, moment = self.Kse * (v - self.v_star) + pull, self.Kbt * (u - self.u_star) + np.cross(self.r, pull)
            step = np.linalg.solve(matrix, np.concatenate([force, moment]))
            v, u = v - step[:3], u - step[3:]
            if np.abs(step).max() < 1e-12 * np.abs(u).max():
                return v, u
        raise NotConverged(
            status="the tip's strains were not found", load_factor=0.0, residual=np.nan, advice="lower the tension"
        )

    def rates(self, _s: float, state: np.ndarray) -> np.ndarray:
        """p', R', v', u' of eqs. 1 to 3 with a and b of eqs. 4, 5."""
        R, v, u = state[3:12].reshape(3, 3), state[12:15], state[15:18]
        u_hat, lever = _skew(u), _skew({"v": v, "u": u}[self.moment_term])
        matrix, q, K11 = self._stiffness(v, u)
        n, load, pull = self.Kse * (v - self.v_star), self.force @ R, K11 @ u_hat @ q
        a = -u_hat @ n - load - pull
        b = -u_hat @ (self.Kbt * (u - self.u_star)) - lever @ n - _skew(self.r_c) @ load - _skew(self.r) @ pull
        return np.concatenate([R @ v, (R @ u_hat).ravel(), np.linalg.solve(matrix, np.concatenate([a, b]))])

    def body(self) -> Body:
        """The solution; the tip is turned until the base points along the outer tube, R(0) = 1."""
        from scipy.spatial.transform import Rotation

        v, u = self.tip_strains()
        tip, base = Rotation.identity(), Rotation.identity()
        for _ in range(40):
            states = self._towards_base(tip.as_matrix(), v, u)
            base = Rotation.from_matrix(states[-1, 3:12].reshape(3, 3))
            if base.magnitude() < 1e-7:
                path, s = states[::-1, :3], np.linspace(0.0, self.length, SAMPLES)
                return Body(s=s, position=path - path[0] + self.base, u=states[::-1, 15:18])
            tip = base.inv() * tip  # exact without weight, and near enough with it
        raise NotConverged(
            status="the printed equations found no tip orientation",
            load_factor=0.0,
            residual=float(base.magnitude()),
            advice="lower the load",
        )

    def _towards_base(self, tip: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
        """(SAMPLES, 18) states from the tip to the base."""
        from scipy.integrate import solve_ivp

        start = np.concatenate([np.zeros(3), tip.ravel(), v, u])
        at = np.linspace(self.length, 0.0, SAMPLES)
        return solve_ivp(self.rates, (self.length, 0.0), start, "DOP853", at, rtol=1e-7, atol=1e-11).y.T

    def _stiffness(self, v: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """[[Kse + K11, K12], [K21, Kbt + K22]], q = u^ r + v and K11."""
        q, r_hat = _skew(u) @ self.r + v, _skew(self.r)
        q_hat = _skew(q)
        K11 = (-self.tension / (q @ q) ** 1.5) * q_hat @ q_hat
        matrix = np.empty((6, 6))
        matrix[:3, :3], matrix[:3, 3:], matrix[3:, :3] = K11, -K11 @ r_hat, r_hat @ K11
        matrix[3:, 3:] = r_hat @ matrix[:3, 3:]
        matrix.flat[::7] += self._diagonal
        return matrix, q, K11

    @cached_property
    def _diagonal(self) -> np.ndarray:
        return np.concatenate([self.Kse, self.Kbt])


def equations(robot: Robot, tension: float, gravity=(0.0, 0.0, 0.0)) -> PaperEquations:
    """The paper's equations for ``robot`` with every misprint corrected and gravity on the neutral axis."""
    section = robot.section
    return PaperEquations(
        length=section.L_na,
        Kse=section.Kse,
        Kbt=section.Kbt,
        v_star=section.v_star,
        u_star=section.u_star,
        r=robot.tendon_position(0, 0.0)[0],
        tension=tension,
        force=section.line_density * np.asarray(gravity, dtype=float),
        base=np.array([-section.r_na, 0.0, 0.0]),
        r_c=np.zeros(3),
    )


def with_printed_moment_term(given: PaperEquations) -> PaperEquations:
    """b with -u^ Kse (v - v*), as printed."""
    return replace(given, moment_term="u")


def with_printed_inertia(given: PaperEquations, robot: Robot) -> PaperEquations:
    """Kbt from I_x and I_y as printed; their sum, the torsion, is the same."""
    E = notched_tube(robot).youngs_modulus
    return replace(given, Kbt=E * np.array([*printed_inertia(robot), sum(printed_inertia(robot))]))


def with_weight_at_centroid(given: PaperEquations, robot: Robot) -> PaperEquations:
    """Gravity at the mass centroid of the cell instead of the neutral axis."""
    return replace(given, r_c=np.array([robot.body.mass_centroid_offset, 0.0, 0.0]))


def printed_inertia(robot: Robot) -> tuple[float, float]:
    """I_x, I_y (m^4) by the paper's formulas, signs of sin(psi) as printed."""
    tube, section = notched_tube(robot), robot.section
    q = (tube.outer_radius**4 - tube.inner_radius**4) / 8.0
    psi = tube.uncut_angle
    return (psi + sin(psi)) * q, (psi - sin(psi)) * q - section.A * section.r_na**2


def base_drift(robot: Robot, insertion: float) -> float:
    """Distance (m) from the exit at which p*((1 - eta) L_na) puts the base, unshifted as printed."""
    return (1.0 - insertion) * robot.section.L


def _skew(x: np.ndarray) -> np.ndarray:
    """Matrix of the cross product; in this inner loop several times faster than the batched `rotation.hat`."""
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])
