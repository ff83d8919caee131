"""Reference solutions: the Princeton beam, and closed forms for rods without external load.

The Princeton beam (Dowell & Traybar 1975): a rectangular bar of aluminium 7075, clamped, with a weight at its tip,
turned about its axis. x runs along the section's long side (chord), y along its short side (flap), z along the
bar. At the load angle 0 the weight pulls along x, at 90 deg along y. Own weight left out, as in the published runs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp
from scipy.linalg import expm

from actuation_oracles import Rod, hat, local

WEIGHTS = (4.448, 8.896, 13.345)  # N


@dataclass(frozen=True, kw_only=True)
class Bar:
    """Rectangular bar, SI. 12.377 mm is the height that the published runs use, 12.7 mm (1/2 in) the nominal one.

    shear_factor: of both shear stiffnesses, 1 being the package's GA; it moves the tip by less than 2 micrometres.
    """

    length: float = 0.508
    height: float = 12.377e-3
    width: float = 3.2024e-3
    E: float = 71.7e9
    nu: float = 0.31
    shear_factor: float = 1.0

    @property
    def G(self) -> float:
        return 0.5 * self.E / (1.0 + self.nu)

    @property
    def area(self) -> float:
        return self.width * self.height

    @property
    def I_x(self) -> float:
        """Bending about x (flap), the soft one."""
        return self.height * self.width**3 / 12.0

    @property
    def I_y(self) -> float:
        """Bending about y (chord)."""
        return self.width * self.height**3 / 12.0

    @property
    def J(self) -> float:
        """Saint-Venant's torsion constant of the rectangle, from its series."""
        odd = np.arange(1.0, 60.0, 2.0)
        series = (np.tanh(0.5 * np.pi * odd * self.height / self.width) / odd**5).sum()
        return self.height * self.width**3 * (1.0 / 3.0 - 64.0 / np.pi**5 * self.width / self.height * series)

    @property
    def rod(self) -> Rod:
        shear = self.shear_factor * self.G * self.area
        Kbt = [self.E * self.I_x, self.E * self.I_y, self.G * self.J]
        return Rod(length=self.length, Kse=[shear, shear, self.E * self.area], Kbt=Kbt)


@dataclass(frozen=True)
class TipMotion:
    """Displacements (m) along flap, chord and axis; twist (rad): the chord line's turn, seen along the bar."""

    flap: float
    chord: float
    axial: float
    twist: float


def weight_force(weight: float, angle: float) -> np.ndarray:
    """Tip force (N) for the load angle in rad."""
    return weight * np.array([np.cos(angle), np.sin(angle), 0.0])


def tip_motion(position: np.ndarray, rotation: np.ndarray, length: float) -> TipMotion:
    """From the tip's position and rotation of a bar clamped at the origin along z."""
    x, y, z = position
    return TipMotion(float(y), float(x), float(z - length), float(np.arctan2(rotation[1, 0], rotation[0, 0])))


def _rotation(h: np.ndarray) -> np.ndarray:
    """(3, 3, n) of quaternions (4, n), scalar first."""
    w, x, y, z = h / np.sqrt((h * h).sum(0))
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def princeton(weight: float, angle: float, bar: Bar | None = None, tol: float = 1e-9) -> TipMotion:
    """Geometrically exact beam with a dead tip force by collocation (solve_bvp) on p, quaternion and world moment."""
    bar = Bar() if bar is None else bar
    rod, L = bar.rod, bar.length
    unit = min(rod.Kbt) / L
    s, y = np.linspace(0.0, 1.0, 21), np.zeros((10, 21))
    y[2], y[3] = s, 1.0
    for part in (0.5, 1.0):
        F = weight_force(part * weight, angle)

        def equations(_, y, F=F):
            R = _rotation(y[3:7])
            v = np.einsum("jin,j->in", R, F) / rod.Kse[:, None] + rod.v_star[:, None]
            u = L * unit * np.einsum("jin,jn->in", R, y[7:]) / rod.Kbt[:, None]
            slope = np.einsum("ijn,jn->in", R, v)
            w, q = y[3], y[4:7]
            spin = 0.5 * np.vstack([-(q * u).sum(0), w * u + np.cross(q, u, axis=0)])
            return np.vstack([slope, spin, -L * np.cross(slope, F[:, None], axis=0) / unit])

        def ends(base, tip):
            return np.concatenate([base[:3], base[3:7] - [1.0, 0.0, 0.0, 0.0], tip[7:]])

        found = solve_bvp(equations, ends, s, y, tol=tol if part == 1.0 else 1e-3, max_nodes=20000)
        assert found.success, found.message
        s, y = found.x, found.y
    return tip_motion(L * y[:3, -1], _rotation(y[3:7, -1:])[..., 0], L)


# Displacements in mm of ANSYS beam elements (10 to 199 of them): Obrezkov, Mikkola, Matikainen et al., "Performance
# review of locking alleviation methods for continuum ANCF beam elements", Nonlinear Dynamics 109 (2022), as quoted in
# EXUDYN's TestModels/ANCFBeamTest.py (github.com/jgerstmayr/EXUDYN). E 71.7 GPa, nu 0.31, 12.377 x 3.2024 mm. ANSYS
# restrains warping otherwise than a Cosserat rod, hence 1 % in the chord displacement and 0.2 % in flap.
ANSYS_ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)  # deg
ANSYS = {  # weight (N): (chord, flap)
    8.896: (
        (10.71418, 10.61329, 10.11170, 8.83723, 6.60467, 3.53889, 0.0),
        (0.0, 42.08232, 79.39483, 108.98794, 129.88762, 142.19437, 146.24598),
    ),
    13.345: (
        (16.06424, 16.45826, 16.65873, 15.18618, 11.57838, 6.24897, 0.0),
        (0.0, 64.35813, 117.73599, 156.46724, 181.86163, 196.09713, 200.67771),
    ),
}


# ---- closed forms without external load: a straight rod along z from the origin, axes x, y, z


def opposed_tendons(length: float, EA: float, tau: float) -> np.ndarray:
    """Tip of a rod with two equal tensions at r and -r: straight, shorter by 2 tau / EA of its length."""
    return np.array([0.0, 0.0, length * (1.0 - 2.0 * tau / EA)])


def half_way_tendon(length: float, EI: float, EA: float, offset: float, tau: float, end: float) -> np.ndarray:
    """Tip of a rod with a tendon at (offset, 0) ending at `end`: curvature tau offset / EI up to there, then none."""
    curvature, stretch = tau * offset / EI, 1.0 - tau / EA
    turn = curvature * end
    arc = stretch / curvature * np.array([1.0 - np.cos(turn), 0.0, np.sin(turn)])
    return arc + (length - end) * np.array([np.sin(turn), 0.0, np.cos(turn)])


def end_moment(length: float, EI: float, moment: float, s: np.ndarray) -> np.ndarray:
    """(n, 3) axis under a tip moment about +y; a full circle at moment = 2 pi EI / length."""
    curvature = moment / EI
    return np.stack([(1.0 - np.cos(curvature * s)) / curvature, 0.0 * s, np.sin(curvature * s) / curvature], axis=-1)


def helical_tendon(
    length: float, Kse: np.ndarray, Kbt: np.ndarray, offset: float, angle: float, omega: float, tau: float
) -> tuple[np.ndarray, np.ndarray]:
    """Tip (3,) and tip rotation (3, 3) of a straight round rod with the tendon at offset, angle + omega s.

    In the frame that turns with the tendon the rod is one with u* = (0, 0, omega) and the tendon at (offset, 0), which
    a round section (Kse_x = Kse_y, Kbt_x = Kbt_y) does not notice: constant strains, an exact helix.
    """
    turning = Rod(length=length, Kse=Kse, Kbt=Kbt, u_star=[0.0, 0.0, omega], r=[offset, 0.0, 0.0])
    assert turning.Kse[0] == turning.Kse[1], "the section must be round"
    assert turning.Kbt[0] == turning.Kbt[1], "the section must be round"
    state, twist = local(turning, tau), np.zeros((4, 4))
    twist[:3, :3], twist[:3, 3] = length * hat(state.u), length * state.v
    pose = _about_z(angle) @ expm(twist) @ _about_z(-angle - omega * length)
    return pose[:3, 3], pose[:3, :3]


def _about_z(angle: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return pose
