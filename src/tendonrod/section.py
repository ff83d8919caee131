"""Cross sections: from a notched tube or a plain rod to the constants that the rod mechanics needs.

The section frame has its origin on the neutral axis; x points from the neutral axis to the tube's axis, away from the
uncut arc, and z along the tube. SI units. Formulas: the paper's section II-B, I_x and I_y corrected (docs).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from math import cos, hypot, isfinite, pi, sin

import numpy as np
from numpy.typing import ArrayLike

from .errors import MISSING, InvalidInput, finite, nonnegative, one_of, positive, vector

TORSION_MODELS = ("published", "open_section", "homogenized")


@dataclass(frozen=True, kw_only=True)
class StiffnessFactors:
    """Measured or computed stiffness relative to EA, EI_x, EI_y and G psi r_m t^3/3 of the uncut arc."""

    axial: float
    bending_x: float
    bending_y: float
    torsion: float

    def __post_init__(self) -> None:
        for field in fields(self):
            _set(self, field.name, positive(f"{field.name}_factor", getattr(self, field.name)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """Constants of a rod whose section does not change along s. Arrays are read-only.

    ============================ ========= ==========================================================
    ``L``, ``L_na``              m         length along the tube, length of the neutral axis
    ``A``                        m^2       area of the uncut arc ("effective area")
    ``r_na``                     m         distance of the neutral axis from the tube's axis
    ``I_x``, ``I_y``             m^4       second moments about the neutral axis
    ``J``                        m^4       torsion constant as used: torsion_stiffness / G
    ``torsion_stiffness``        N m^2     last entry of Kbt
    ``Kse``                      N         (3,) diagonal: GA, GA, EA
    ``Kbt``                      N m^2     (3,) diagonal: EI_x, EI_y, torsion
    ``line_density``             kg/m      mass per length of s
    ``v_star``, ``u_star``       -, 1/m    (3,) strains of the straight, unloaded robot
    ============================ ========= ==========================================================
    """

    L: float
    L_na: float
    A: float
    r_na: float
    I_x: float
    I_y: float
    J: float
    torsion_stiffness: float
    Kse: np.ndarray
    Kbt: np.ndarray
    line_density: float
    v_star: np.ndarray
    u_star: np.ndarray

    def __post_init__(self) -> None:
        for name in ("Kse", "Kbt", "v_star", "u_star"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            _set(self, name, array)
        for name in ("L_na", "A", "I_x", "I_y", "torsion_stiffness"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InvalidInput(f"section {name}", getattr(self, name), "a finite number > 0: check the dimensions")

    def __setstate__(self, state: dict) -> None:
        self.__dict__.update(state)
        self.__post_init__()


@dataclass(frozen=True, kw_only=True)
class NotchedTube:
    """A tube with asymmetric notches whose uncut arc winds ``turns`` times around the axis over ``length`` (paper, II).

    - inner_radius, outer_radius, length, notch_width (w), notch_spacing (d): m.
    - uncut_angle (psi): rad, in (0, 2 pi).
    - turns: any finite number, right-handed positive, 0 for straight notches.
    - youngs_modulus, shear_modulus: Pa; density: kg/m^3.
    - torsion: "published" E(I_x+I_y), "open_section" G psi r_m t^3/3, or "homogenized", which scales EA, EI_x, EI_y and
      the open section's torsion by ``stiffness_factors``.

    Raises `InvalidInput` by field name.
    """

    inner_radius: float
    outer_radius: float
    length: float
    notch_width: float
    notch_spacing: float
    uncut_angle: float
    turns: float
    youngs_modulus: float
    shear_modulus: float
    density: float
    torsion: str = "published"
    stiffness_factors: StiffnessFactors | None = None

    def __post_init__(self) -> None:
        for name in ("inner_radius", "outer_radius", "length", "notch_width", "notch_spacing"):
            _set(self, name, positive(name, getattr(self, name)))
        _check_materials(self)
        _set(self, "uncut_angle", finite("uncut_angle", self.uncut_angle, _ANGLE_ALLOWED))
        _set(self, "turns", finite("turns", self.turns))
        self._check_geometry()
        one_of("torsion", self.torsion, TORSION_MODELS)
        if self.torsion == "homogenized" and self.stiffness_factors is None:
            raise InvalidInput("stiffness_factors", MISSING, _FACTORS_NEEDED)

    def _check_geometry(self) -> None:
        if self.outer_radius <= self.inner_radius:
            raise InvalidInput("outer_radius", self.outer_radius, f"> inner_radius = {self.inner_radius!r}")
        if not 0.0 < self.uncut_angle < 2.0 * pi:
            raise InvalidInput("uncut_angle", self.uncut_angle, _ANGLE_ALLOWED)
        if self.notch_width + 2.0 * self.notch_spacing > self.length:
            raise InvalidInput(
                "notch_width",
                self.notch_width,
                f"such that one notch with two spacings fits: notch_spacing = {self.notch_spacing!r}, "
                f"length = {self.length!r}",
            )

    @cached_property
    def section(self) -> Section:
        """Constants for the mechanics (paper II-B; I_x and I_y corrected)."""
        (A, r_na, I_x, I_y), k = self._arc, 2.0 * pi * self.turns
        L_na = hypot(self.length, k * r_na)
        EA, EI_x, EI_y, GI_z = self._stiffness
        GA = self.shear_modulus * A
        return Section(
            L=self.length,
            L_na=L_na,
            A=A,
            r_na=r_na,
            I_x=I_x,
            I_y=I_y,
            J=GI_z / self.shear_modulus,
            torsion_stiffness=GI_z,
            Kse=np.array([GA, GA, EA]),
            Kbt=np.array([EI_x, EI_y, GI_z]),
            line_density=self._line_density,
            v_star=np.array([0.0, -k * r_na / L_na, self.length / L_na]),
            u_star=np.array([0.0, 0.0, k / L_na]),
        )

    @property
    def closure_curvature(self) -> float:
        """Curvature (1/m) of the neutral axis at which the edges of a notch meet on the tendon side."""
        return self.notch_width / ((self.notch_width + self.notch_spacing) * (self.outer_radius + self._arc[1]))

    @property
    def mass_centroid_offset(self) -> float:
        """x (m) of the cell's mass centroid in the section frame; the full rings pull it towards the tube's axis."""
        ring, arc = pi * self.notch_spacing, 0.5 * self.uncut_angle * self.notch_width
        return self._arc[1] * ring / (ring + arc)

    def fibre_strain(self, du_x, du_y, de_z, s_m: ArrayLike = 0.0):
        """Largest |axial strain| over the uncut arc, exact, for curvatures du_x, du_y (1/m) and extension de_z.

        It is the same at every ``s_m``.

        The strain e_z + u_x y - u_y x is affine, so that on the annular sector it is extreme at a corner or, where
        the arc contains its gradient's direction, on the inner or outer edge. Broadcasts over leading axes.
        """
        slope = np.hypot(du_x, du_y)
        towards = np.arctan2(du_x, np.negative(du_y)) - pi  # direction of steepest strain, from the arc's middle
        at_centre = np.asarray(de_z) - np.asarray(du_y) * self._arc[1]
        steepest, flattest = self._cosine_range(towards)
        highest = at_centre + slope * steepest * np.where(steepest > 0.0, self.outer_radius, self.inner_radius)
        lowest = at_centre + slope * flattest * np.where(flattest < 0.0, self.outer_radius, self.inner_radius)
        return np.maximum(highest, -lowest)

    def _cosine_range(self, towards):
        """Largest and smallest cos(theta - towards) for theta from -psi/2 to psi/2."""
        half = 0.5 * self.uncut_angle
        ends = np.stack([np.cos(towards - half), np.cos(towards + half)])
        largest = np.where(np.cos(towards) >= cos(half), 1.0, ends.max(axis=0))
        smallest = np.where(-np.cos(towards) >= cos(half), -1.0, ends.min(axis=0))
        return largest, smallest

    @cached_property
    def _arc(self) -> tuple[float, float, float, float]:
        """A, r_na, I_x, I_y of the uncut arc; paper II-B, with the signs of sin(psi) in I_x and I_y put right."""
        r_i, r_o, psi = self.inner_radius, self.outer_radius, self.uncut_angle
        A = 0.5 * psi * (r_o - r_i) * (r_o + r_i)
        r_na = (4.0 / 3.0) * sin(0.5 * psi) / psi * (r_o * r_o + r_o * r_i + r_i * r_i) / (r_o + r_i)
        q = 0.125 * (r_o - r_i) * (r_o + r_i) * (r_o * r_o + r_i * r_i)
        return A, r_na, (psi - sin(psi)) * q, (psi + sin(psi)) * q - A * r_na * r_na

    @property
    def _open_section_torsion(self) -> float:
        r_m, t = 0.5 * (self.inner_radius + self.outer_radius), self.outer_radius - self.inner_radius
        return self.shear_modulus * self.uncut_angle * r_m * t * t * t / 3.0

    @property
    def _stiffness(self) -> tuple[float, float, float, float]:
        """EA, EI_x, EI_y and the torsion stiffness of the chosen model."""
        E, (A, _, I_x, I_y) = self.youngs_modulus, self._arc
        if self.torsion == "published":
            return E * A, E * I_x, E * I_y, E * (I_x + I_y)
        if self.torsion == "open_section" or self.stiffness_factors is None:
            return E * A, E * I_x, E * I_y, self._open_section_torsion
        by = self.stiffness_factors
        return E * A * by.axial, E * I_x * by.bending_x, E * I_y * by.bending_y, self._open_section_torsion * by.torsion

    @property
    def _line_density(self) -> float:
        r_i, r_o, w, d = self.inner_radius, self.outer_radius, self.notch_width, self.notch_spacing
        return (pi * d + 0.5 * self.uncut_angle * w) * (r_o - r_i) * (r_o + r_i) / (d + w) * self.density


@dataclass(frozen=True, kw_only=True)
class PlainRod:
    """A rod without notches; the neutral axis is its axis (r_na = 0), torsion stiffness GJ.

    - length: m.
    - Either ``radius`` (m, circle), hollow where ``inner_radius`` (m) > 0, or all of ``area`` (m^2), ``ix``, ``iy``,
      ``j`` (m^4).
    - youngs_modulus, shear_modulus: Pa; density: kg/m^3.
    - precurvature: u* (1/m), three numbers.

    Raises `InvalidInput` by field name.
    """

    length: float
    radius: float | None = None
    inner_radius: float = 0.0
    area: float | None = None
    ix: float | None = None
    iy: float | None = None
    j: float | None = None
    youngs_modulus: float
    shear_modulus: float
    density: float
    precurvature: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _set(self, "length", positive("length", self.length))
        _check_materials(self)
        _set(self, "precurvature", tuple(vector("precurvature", self.precurvature, 3).tolist()))
        for name in ("radius",) if self.radius is not None else _ROD_CONSTANTS:
            value = getattr(self, name)
            _set(self, name, positive(name, MISSING if value is None else value))
        for name in _ROD_CONSTANTS if self.radius is not None else ():
            if getattr(self, name) is not None:
                raise InvalidInput(name, getattr(self, name), "left out where radius is given")
        _set(self, "inner_radius", nonnegative("inner_radius", self.inner_radius))
        if self.inner_radius > 0.0 and self.radius is None:
            raise InvalidInput("inner_radius", self.inner_radius, "left out where radius is")
        if self.radius is not None and self.inner_radius >= self.radius:
            raise InvalidInput("inner_radius", self.inner_radius, f"< radius = {self.radius!r}")

    @cached_property
    def section(self) -> Section:
        """Constants for the mechanics."""
        A, I_x, I_y, J = self._constants
        E, G = self.youngs_modulus, self.shear_modulus
        return Section(
            L=self.length,
            L_na=self.length,
            A=A,
            r_na=0.0,
            I_x=I_x,
            I_y=I_y,
            J=J,
            torsion_stiffness=G * J,
            Kse=np.array([G * A, G * A, E * A]),
            Kbt=np.array([E * I_x, E * I_y, G * J]),
            line_density=self.density * A,
            v_star=np.array([0.0, 0.0, 1.0]),
            u_star=np.array(self.precurvature),
        )

    @property
    def mass_centroid_offset(self) -> float:
        """Zero, since the mass centroid lies on the neutral axis."""
        return 0.0

    def fibre_strain(self, du_x, du_y, de_z, s_m: ArrayLike = 0.0):
        """Largest |axial strain| over the circle, from curvatures (1/m) and extension; None without a radius."""
        if self.radius is None:
            return None
        return np.abs(de_z) + self.radius * np.hypot(du_x, du_y)

    @property
    def _constants(self) -> tuple[float, float, float, float]:
        if self.radius is None:
            return self.area, self.ix, self.iy, self.j  # pyright: ignore[reportReturnType] - checked at construction
        return round_section(self.radius, self.inner_radius)


def round_section(radius, inner_radius):
    """A (m^2), I_x, I_y, J (m^4) of a circle of ``radius`` with a hole of ``inner_radius`` (m)."""
    outer, inner = radius * radius, inner_radius * inner_radius
    moment = 0.25 * pi * (outer - inner) * (outer + inner)
    return pi * (outer - inner), moment, moment, 2.0 * moment


_ROD_CONSTANTS = ("area", "ix", "iy", "j")
_ANGLE_ALLOWED = "inside (0, 2 pi) rad, that is between 0 and 360 degrees"
_FACTORS_NEEDED = 'given (axial, bending_x, bending_y, torsion) where torsion = "homogenized"'


def _set(frozen: object, name: str, value: object) -> None:
    object.__setattr__(frozen, name, value)


def _check_materials(body: NotchedTube | PlainRod) -> None:
    _set(body, "youngs_modulus", positive("youngs_modulus", body.youngs_modulus))
    _set(body, "shear_modulus", positive("shear_modulus", body.shear_modulus))
    _set(body, "density", nonnegative("density", body.density))
