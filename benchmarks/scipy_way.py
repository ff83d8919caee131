"""The plain SciPy way: what a lab writes when it types in the paper's equations. It is the yardstick for our speed.

The differential form in (p, R, v, u), `solve_ivp` (RK45, rtol 1e-6) inside `scipy.optimize.root` on six unknowns, in
ordinary NumPy: nothing slowed down on purpose, nothing tuned. Two ways to ask the same question:

- plain (default): the unknowns are v(0), u(0), from the unloaded robot's strains, the residual the tip's force and
  moment as they stand. Its Newton meets a stiffness ratio of EA : EI/L^2, about 2e6, and needs about 100 integrations.
- scaled: the unknowns are the base's total force and moment by EI/L^2 and EI/L, from the tendon-only state, with the
  tip's residual in the same units. This is physics.md's advice, not what is usually found; it needs about 16.

    python benchmarks/scipy_way.py
"""

from __future__ import annotations

import os
import platform
import time

import numpy as np
import scipy
from scipy.integrate import solve_ivp
from scipy.optimize import root

from tendonrod import load_robot

REFERENCE_MM = (-1.14080, 21.75197, 66.56249)  # physics.md section 2: exonav-1, 0.7 N, gravity along -x
STANDARD_GRAVITY = (-9.81, 0.0, 0.0)


def hat(x: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


class Rod:
    """The paper's equations for one robot, tension and gravity; tendons constant in the section frame."""

    def __init__(self, robot, tension, gravity) -> None:
        section = robot.section
        self.Kse, self.Kbt = np.diag(section.Kse), np.diag(section.Kbt)
        self.v_star, self.u_star = np.array(section.v_star), np.array(section.u_star)
        self.length, self.r_na = section.L_na, section.r_na
        self.f_e = section.line_density * np.asarray(gravity, dtype=float)
        offsets = [np.array([row[0], row[1], 0.0]) for row in robot.routing]
        self.tendons = list(zip(offsets, np.broadcast_to(tension, len(offsets)), strict=True))

    def rate(self, s: float, y: np.ndarray) -> np.ndarray:
        R, v, u = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        u_hat = hat(u)
        K = np.zeros((6, 6))
        K[:3, :3], K[3:, 3:] = self.Kse, self.Kbt
        n = self.Kse @ (v - self.v_star)
        a = -u_hat @ n - R.T @ self.f_e
        b = -u_hat @ self.Kbt @ (u - self.u_star) - hat(v) @ n
        for r, tau in self.tendons:
            r_hat = hat(r)
            p_t = u_hat @ r + v
            p_hat = hat(p_t)
            K11 = -tau * p_hat @ p_hat / np.linalg.norm(p_t) ** 3
            K[:3, :3] += K11
            K[:3, 3:] -= K11 @ r_hat
            K[3:, :3] += r_hat @ K11
            K[3:, 3:] -= r_hat @ K11 @ r_hat
            push = K11 @ (u_hat @ p_t)
            a -= push
            b -= r_hat @ push
        strain_rate = np.linalg.solve(K, np.concatenate([a, b]))
        return np.concatenate([R @ v, (R @ u_hat).ravel(), strain_rate])

    def wrench(self, v: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Total force and moment, rod and tendons, in the section frame; zero at a free tip."""
        n, m = self.Kse @ (v - self.v_star), self.Kbt @ (u - self.u_star)
        for r, tau in self.tendons:
            p_t = np.cross(u, r) + v
            t = tau * p_t / np.linalg.norm(p_t)
            n, m = n + t, m + np.cross(r, t)
        return np.concatenate([n, m])

    def strains(self, wrench: np.ndarray) -> np.ndarray:
        """v, u at which the section carries `wrench`."""
        return root(lambda x: self.wrench(x[:3], x[3:]) - wrench, self.unloaded, tol=1e-13).x

    @property
    def unloaded(self) -> np.ndarray:
        return np.concatenate([self.v_star, self.u_star])

    @property
    def wrench_unit(self) -> np.ndarray:
        stiffness = self.Kbt.diagonal()[:2].min()
        return np.repeat([stiffness / self.length**2, stiffness / self.length], 3)

    def tip_state(self, base_strains: np.ndarray) -> np.ndarray:
        y0 = np.concatenate([[-self.r_na, 0.0, 0.0], np.eye(3).ravel(), base_strains])
        return solve_ivp(self.rate, (0.0, self.length), y0, method="RK45", rtol=1e-6).y[:, -1]

    def tip_wrench(self, base_strains: np.ndarray) -> np.ndarray:
        y = self.tip_state(base_strains)
        return self.wrench(y[12:15], y[15:18])


def scipy_solve(robot, tension, gravity, scaled: bool = False) -> np.ndarray:
    """Tip position (3,) in metres. Raises ArithmeticError where `root` gives up."""
    rod = Rod(robot, tension, gravity)
    if scaled:
        unit = rod.wrench_unit
        found = root(lambda x: rod.tip_wrench(rod.strains(x * unit)) / unit, np.zeros(6))
        base_strains = rod.strains(found.x * unit)
    else:
        found = root(rod.tip_wrench, rod.unloaded)
        base_strains = found.x
    if not found.success:
        raise ArithmeticError(found.message)
    return rod.tip_state(base_strains)[:3]


def show(name: str, scaled: bool) -> None:
    robot = load_robot("exonav-1")
    start = time.perf_counter()
    tip = 1e3 * scipy_solve(robot, 0.7, STANDARD_GRAVITY, scaled)
    seconds = time.perf_counter() - start
    error = 1e6 * np.linalg.norm(tip - REFERENCE_MM)
    print(f"{name:8s} {seconds:7.3f} s   tip {tip.round(5)} mm   error {error:.0f} nm")


if __name__ == "__main__":
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, "
          f"NumPy {np.__version__}, SciPy {scipy.__version__}")  # fmt: skip
    show("plain", scaled=False)
    show("scaled", scaled=True)
