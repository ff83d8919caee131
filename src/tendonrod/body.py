"""Bodies whose section changes along the rod, and the table of sections that the kernel takes (docs/robot_files).

The material coordinate s_m runs along the neutral axis from 0 at the base of the whole body to L_na at its tip.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import cos, log, pi, sin

import numpy as np
from numpy.typing import ArrayLike

from .errors import InvalidInput, finite, nonnegative, positive, vector
from .section import NotchedTube, PlainRod, Section, round_section

TABLE_ERROR = 5e-9  # of a taper's section table, relative, in every quantity
ROUNDING = 1e-12  # of the length: material coordinates closer than this are one
_PIECES = tuple(2**k for k in range(13))
_CUBIC_NODES = np.array([0.0, 0.5 - 0.5 * sin(pi / 8) / cos(pi / 8), 0.5 + 0.5 * sin(pi / 8) / cos(pi / 8), 1.0])


@dataclass(frozen=True, kw_only=True)
class TaperedRod:
    """A round rod whose radius changes linearly from base to tip; solid, or with a hole that tapers linearly too.

    - length, base_radius, tip_radius: m, > 0.
    - base_inner_radius, tip_inner_radius: m, 0 for a solid rod.
    - youngs_modulus, shear_modulus: Pa; density: kg/m^3.
    - precurvature: u* (1/m), three numbers.

    The neutral axis is the rod's axis, torsion stiffness GJ. Raises `InvalidInput` by field name.
    """

    length: float
    base_radius: float
    tip_radius: float
    base_inner_radius: float = 0.0
    tip_inner_radius: float = 0.0
    youngs_modulus: float
    shear_modulus: float
    density: float
    precurvature: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("length", "base_radius", "tip_radius", "youngs_modulus", "shear_modulus"):
            _set(self, name, positive(name, getattr(self, name)))
        for name in ("base_inner_radius", "tip_inner_radius", "density"):
            _set(self, name, nonnegative(name, getattr(self, name)))
        _set(self, "precurvature", tuple(vector("precurvature", self.precurvature, 3).tolist()))
        for end in ("base", "tip"):
            inner, outer = getattr(self, f"{end}_inner_radius"), getattr(self, f"{end}_radius")
            if inner >= outer:
                raise InvalidInput(f"{end}_inner_radius", inner, f"< {end}_radius = {outer!r}")

    @cached_property
    def section(self) -> Section:
        """Constants at the base; L and L_na of the whole rod."""
        return self.section_at(0.0)

    @property
    def mass_centroid_offset(self) -> float:
        """Zero, since the mass centroid lies on the neutral axis."""
        return 0.0

    def section_at(self, s_m: float) -> Section:
        """Constants of the section at ``s_m`` (m); L and L_na of the whole rod."""
        rod = PlainRod(
            length=self.length,
            radius=float(self.outer_radius_at(s_m)),
            inner_radius=float(self._between(self.base_inner_radius, self.tip_inner_radius, s_m)),
            youngs_modulus=self.youngs_modulus,
            shear_modulus=self.shear_modulus,
            density=self.density,
            precurvature=self.precurvature,
        )
        return rod.section

    def outer_radius_at(self, s_m):
        """Radius (m) at ``s_m`` (m); broadcasts."""
        return self._between(self.base_radius, self.tip_radius, s_m)

    def fibre_strain(self, du_x, du_y, de_z, s_m: ArrayLike = 0.0):
        """Largest |axial strain| over the circle at ``s_m`` (m), from curvatures (1/m) and extension; broadcasts."""
        return np.abs(de_z) + self.outer_radius_at(s_m) * np.hypot(du_x, du_y)

    def _between(self, base: float, tip: float, s_m):
        share = np.clip(np.asarray(s_m, dtype=float) / self.length, 0.0, 1.0)
        return (1.0 - share) * base + share * tip

    def _quantities(self, s_m: np.ndarray) -> np.ndarray:
        """(n, 15) columns of the section table, exact."""
        inner = self._between(self.base_inner_radius, self.tip_inner_radius, s_m)
        A, I_x, I_y, J = round_section(self.outer_radius_at(s_m), inner)
        E, G = self.youngs_modulus, self.shear_modulus
        zero, one = np.zeros_like(A), np.ones_like(A)
        u_star = [u * one for u in self.precurvature]
        columns = [G * A, G * A, E * A, E * I_x, E * I_y, G * J, zero, zero, one, *u_star, self.density * A, zero, zero]
        return np.stack(columns, axis=-1)

    @cached_property
    def _rows(self) -> np.ndarray:
        """(m, 62) of the section table: continuous cubics, as many as keep to TABLE_ERROR."""
        if (self.base_radius, self.base_inner_radius) == (self.tip_radius, self.tip_inner_radius):
            return _uniform_rows(self.section, 0.0)
        rows = np.empty((0, 62))
        for pieces in _PIECES:
            rows = self._interpolated(pieces)
            if self._table_error(rows) < TABLE_ERROR:
                break
        return rows

    def _interpolated(self, pieces: int) -> np.ndarray:
        """Cubics through the section at both ends of a piece and at two points within, stretched Chebyshev nodes."""
        ratio = self.tip_radius / self.base_radius
        share = np.arange(pieces + 1) / pieces
        even = abs(log(ratio)) < 1e-3
        edges = self.length * (share if even else (ratio**share - 1.0) / (ratio - 1.0))  # equal ratios of the radius
        edges[0], edges[-1] = 0.0, self.length
        rows = np.empty((pieces, 62))
        rows[:, 0], rows[:, 1] = edges[:-1], edges[1:]
        size = np.diff(edges)
        at = edges[:-1, None] + size[:, None] * _CUBIC_NODES
        values = self._quantities(at.ravel()).reshape(pieces, 4, 15)
        coefficients = np.einsum("kj,pjq->pkq", np.linalg.inv(np.vander(_CUBIC_NODES, increasing=True)), values)
        coefficients[:, 0] = values[:, 0]
        constant = np.ptp(values, axis=1) == 0.0
        coefficients[:, 1:] = np.where(constant[:, None], 0.0, coefficients[:, 1:])
        rows[:, 2:] = (coefficients / size[:, None, None] ** np.arange(4)[:, None]).reshape(pieces, 60)
        return rows

    def _table_error(self, rows: np.ndarray) -> float:
        at = (rows[:, :1] + (rows[:, 1:2] - rows[:, :1]) * np.linspace(0.0, 1.0, 11)).ravel()
        exact = self._quantities(at)
        missed = np.abs(evaluate(rows, at) - exact)
        return float(np.max(missed / np.where(exact == 0.0, 1.0, np.abs(exact))))


@dataclass(frozen=True, kw_only=True)
class Segments:
    """Bodies joined rigidly end to end, their axes in one line at every joint.

    - segments: one or more of `NotchedTube`, `PlainRod`, `TaperedRod`, from base to tip.
    - angles: one number (rad) for each joint: by how much the section frame beyond it is turned about the axis from the
      frame before it; all 0 if left out. Right-handed about z, which points to the tip.

    Raises `InvalidInput`.
    """

    segments: tuple[NotchedTube | PlainRod | TaperedRod, ...]
    angles: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.segments, Sequence) or isinstance(self.segments, str) or not self.segments:
            raise InvalidInput("segments", self.segments, "one or more of NotchedTube, PlainRod, TaperedRod")
        _set(self, "segments", tuple(self.segments))
        for k, segment in enumerate(self.segments):
            if not isinstance(segment, (NotchedTube, PlainRod, TaperedRod)):
                raise InvalidInput(f"segments[{k}]", segment, "a NotchedTube, a PlainRod or a TaperedRod")
        joints = len(self.segments) - 1
        given = (0.0,) * joints if self.angles is None else self.angles
        if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != joints:
            raise InvalidInput("angles", given, f"one number (rad) for each of the {joints} joints")
        _set(self, "angles", tuple(finite(f"angles[{k}]", angle) for k, angle in enumerate(given)))

    @cached_property
    def section(self) -> Section:
        """Constants of the first segment at the base; L and L_na of the whole body."""
        sections = [segment.section for segment in self.segments]
        whole = {"L": sum(each.L for each in sections), "L_na": parts(self)[-1].end}
        return dataclasses.replace(sections[0], **whole)

    @property
    def mass_centroid_offset(self) -> float:
        """x (m) of the first segment's mass centroid in the section frame."""
        return self.segments[0].mass_centroid_offset

    def fibre_strain(self, du_x, du_y, de_z, s_m: ArrayLike = 0.0):
        """Largest |axial strain| at ``s_m`` (m), by the segment there; NaN where its outline is not known, broadcasts.

        None if no outline is known.
        """
        du_x, du_y, de_z, s_m = np.broadcast_arrays(du_x, du_y, de_z, np.asarray(s_m, dtype=float))
        where, found, known = part_at(self, s_m), np.full(s_m.shape, np.nan), False
        for k, part in enumerate(parts(self)):
            at = where == k
            strain = part.body.fibre_strain(du_x[at], du_y[at], de_z[at], s_m[at] - part.start)
            if strain is not None:
                known, found[at] = True, strain
        return found if known else None


Segment = NotchedTube | PlainRod | TaperedRod
Body = Segment | Segments


@dataclass(frozen=True, kw_only=True)
class Part:
    """A segment within the whole body: from ``start`` to ``end`` (m, material coordinate).

    angle (rad): sum of the joints' angles up to here. r_na (m): the tube's axis lies at (r_na, 0) in the section.
    """

    body: Segment
    start: float
    end: float
    angle: float

    @property
    def r_na(self) -> float:
        return self.body.section.r_na

    @property
    def lumen_radius(self) -> float:
        """Radius (m) of the hole through it, 0 where it has none or one that changes."""
        return 0.0 if isinstance(self.body, TaperedRod) else self.body.inner_radius


def parts(body: Body) -> tuple[Part, ...]:
    """The segments of a body from base to tip; a body that is no `Segments` is one part."""
    if not isinstance(body, Segments):
        return (Part(body=body, start=0.0, end=body.section.L_na, angle=0.0),)
    ends = np.cumsum([segment.section.L_na for segment in body.segments]).tolist()
    angles = np.cumsum([0.0, *(body.angles or ())]).tolist()
    spans = zip(body.segments, [0.0, *ends[:-1]], ends, angles, strict=True)
    return tuple(Part(body=each, start=start, end=end, angle=angle) for each, start, end, angle in spans)


def part_at(body: Body, s_m) -> np.ndarray:
    """Index of the part at each ``s_m``; at a joint the distal one."""
    starts = np.array([part.start for part in parts(body)])
    return row_at(starts, s_m)


def row_at(starts: np.ndarray, s_m) -> np.ndarray:
    """Index of the last of the sorted ``starts`` that is not beyond ``s_m``, but at least 0; equal but for rounding."""
    return np.searchsorted(starts[1:] * (1.0 - ROUNDING), np.asarray(s_m, dtype=float), side="right")


def section_table(body: Body) -> np.ndarray:
    """(m, 62) rows [s_a, s_b, c0[15], c1[15], c2[15], c3[15]]: from s_a to s_b, quantity = sum ck (s_m - s_a)^k.

    The fifteen: Kse[3] (N), Kbt[3] (N m^2), v_star[3], u_star[3] (1/m), mass per metre of s_m (kg/m), mass centroid x
    and y (m) in the section frame. Exact for uniform bodies, to 5e-9 of each quantity in tapers.
    """
    tables = []
    for part in parts(body):
        each = part.body
        tapered = isinstance(each, TaperedRod)
        rows = each._rows.copy() if tapered else _uniform_rows(each.section, each.mass_centroid_offset)
        rows[:, :2] += part.start
        rows[-1, 1] = part.end
        tables.append(rows)
    return np.ascontiguousarray(np.concatenate(tables))


def evaluate(table: np.ndarray, s_m) -> np.ndarray:
    """(n, 15) quantities of a section table at ``s_m`` (n,); where two rows meet, the distal one's."""
    at = np.asarray(s_m, dtype=float)
    row = table[row_at(table[:, 0], at)]
    t = (at - row[:, 0])[:, None]
    c0, c1, c2, c3 = (row[:, 2 + 15 * k : 17 + 15 * k] for k in range(4))
    return c0 + t * (c1 + t * (c2 + t * c3))


def joints(body: Body) -> np.ndarray:
    """(q, 4) rows [s_m, dx, dy, angle] where p jumps or the section frame turns (m, m, m, rad).

    The frame beyond is the one before, displaced by R (dx, dy, 0) and then turned by ``angle`` about its z.
    """
    rows = []
    for before, beyond in pairwise(parts(body)):
        angle = beyond.angle - before.angle
        dx, dy = before.r_na - beyond.r_na * cos(angle), -beyond.r_na * sin(angle)
        if (dx, dy, angle) != (0.0, 0.0, 0.0):
            rows.append((beyond.start, dx, dy + 0.0, angle))
    return np.array(rows, dtype=float).reshape(-1, 4)


def section_at(body: Body, s_m: float) -> Section:
    """Constants of the section at ``s_m`` (m), at a joint those beyond it; L and L_na of the whole body."""
    part = parts(body)[int(part_at(body, s_m))]
    local = part.body.section_at(s_m - part.start) if isinstance(part.body, TaperedRod) else part.body.section
    return dataclasses.replace(local, L=body.section.L, L_na=body.section.L_na)


def outer_radius(body: Body, s_m: np.ndarray) -> np.ndarray:
    """(n,) radius (m) of the outline at ``s_m`` (n,); NaN for a rod given by area."""
    where, found = part_at(body, s_m), np.full(s_m.shape, np.nan)
    for k, part in enumerate(parts(body)):
        at, each = where == k, part.body
        if isinstance(each, TaperedRod):
            found[at] = each.outer_radius_at(s_m[at] - part.start)
        else:
            radius = each.outer_radius if isinstance(each, NotchedTube) else each.radius
            found[at] = np.nan if radius is None else radius
    return found


def _uniform_rows(section: Section, centroid: float) -> np.ndarray:
    row = np.zeros((1, 62))
    row[0, 1] = section.L_na
    row[0, 2:17] = *section.Kse, *section.Kbt, *section.v_star, *section.u_star, section.line_density, centroid, 0.0
    return row


def _set(frozen: object, name: str, value: object) -> None:
    object.__setattr__(frozen, name, value)
