"""Tendon routings in the section frame, measured from the neutral axis, and the table of them that the kernel takes.

r(s_m) = [X(s_m), Y(s_m), 0] with s_m the material coordinate, s_m = s + (1 - insertion) L_na. In a body of several
segments X, Y of constant, helical and sampled routings are those of the first segment's frame, carried on along the
body so that the path is continuous at the joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from .body import ROUNDING, Body, Part, Segments, TaperedRod, parts
from .errors import MISSING, Fact, InvalidInput, finite, nonnegative, numbers, one_of, positive
from .section import NotchedTube

ROUTINGS = {
    "opposite_backbone": (),
    "constant": ("x", "y"),
    "helical": ("offset", "angle", "turns"),
    "sampled": ("s", "x", "y"),
}
WALLS = ("held", "free")
ROW = 16  # numbers in a row of the table


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """A tendon as its user describes it; build it with `opposite_backbone`, `constant`, `helical` or `sampled`.

    - radius: m; x, y, offset: m from the neutral axis; angle: rad; turns: over the whole body, right-handed positive.
    - s, x, y of a sampled routing: tuples of equal length (m).
    - end: material coordinate (m, in (0, L_na]) where the tendon is anchored, None for the tip.
    - friction: Coulomb coefficient along its path, >= 0.
    - axial_stiffness: EA of the tendon (N, > 0), None for an inextensible one.
    - free_length: m, >= 0, of the tendon between the actuator and the base of the robot's body.
    - wall: "held", the tendon runs where it is routed; "free" (opposite_backbone only), at low tension it leaves the
      wall and runs within the lumen.

    Raises `InvalidInput` by field name.
    """

    routing: str
    radius: float = 0.0
    x: float | tuple[float, ...] | None = None
    y: float | tuple[float, ...] | None = None
    offset: float | None = None
    angle: float | None = None
    turns: float | None = None
    s: tuple[float, ...] | None = None
    end: float | None = None
    friction: float = 0.0
    axial_stiffness: float | None = None
    free_length: float = 0.0
    wall: str = "held"

    def __post_init__(self) -> None:
        needed = ROUTINGS[one_of("routing", self.routing, ROUTINGS)]
        check_radius = positive if self.routing == "opposite_backbone" else nonnegative
        self._set("radius", check_radius("radius", self.radius))
        for name in ("s", "x", "y", "offset", "angle", "turns"):
            self._check_number(name, name in needed)
        if self.s is not None:
            self._check_samples(self.s)
        for name in ("end", "axial_stiffness"):
            if getattr(self, name) is not None:
                self._set(name, positive(name, getattr(self, name)))
        for name in ("friction", "free_length"):
            self._set(name, nonnegative(name, getattr(self, name)))
        if one_of("wall", self.wall, WALLS) == "free" and self.routing != "opposite_backbone":
            raise InvalidInput("wall", self.wall, f'"held" where routing = "{self.routing}"')

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _check_number(self, name: str, needed: bool) -> None:
        value = getattr(self, name)
        if not needed and value is not None:
            raise InvalidInput(name, value, f'left out where routing = "{self.routing}"')
        if needed and self.routing == "sampled":
            samples = numbers(name, MISSING if value is None else value)
            self._set(name, tuple(samples.tolist()))
        elif needed:
            check = nonnegative if name == "offset" else finite
            self._set(name, check(name, MISSING if value is None else value))

    def _check_samples(self, s: tuple[float, ...]) -> None:
        if len(s) < 2 or not all(a < b for a, b in pairwise(s)):
            raise InvalidInput("s", s, "two or more numbers that increase")
        for name in ("x", "y"):
            if len(getattr(self, name)) != len(s):
                raise InvalidInput(name, getattr(self, name), f"as many numbers as s, {len(s)}")

    @classmethod
    def opposite_backbone(cls, *, radius: float, end: float | None = None, **more) -> Tendon:
        """Along the inner wall opposite the uncut arc, x = r_na + r_in - radius (paper, II-B); needs a notched tube.

        In a body of several segments it follows each one's own wall, in hollow rods on the side of their +x; where the
        walls do not meet at a joint it crosses over within the joint. ``more``: friction, axial_stiffness, free_length,
        wall, as in all four.
        """
        return cls(routing="opposite_backbone", radius=radius, end=end, **more)

    @classmethod
    def constant(cls, *, x: float, y: float, radius: float = 0.0, end: float | None = None, **more) -> Tendon:
        """At a fixed point (x, y) of the section frame."""
        return cls(routing="constant", x=x, y=y, radius=radius, end=end, **more)

    @classmethod
    def helical(
        cls, *, offset: float, angle: float, turns: float, radius: float = 0.0, end: float | None = None, **more
    ) -> Tendon:
        """At distance ``offset`` from the neutral axis, at angle + 2 pi turns s_m / L_na in the section frame."""
        return cls(routing="helical", offset=offset, angle=angle, turns=turns, radius=radius, end=end, **more)

    @classmethod
    def sampled(cls, s, x, y, *, radius: float = 0.0, end: float | None = None, **more) -> Tendon:
        """Through the points (x, y) (n,) at the material coordinates s (n,), m, that cover [0, end]; n >= 2.

        In between runs the cubic spline with continuous second derivative and not-a-knot ends: from points of a cubic
        it gives that cubic.
        """
        return cls(routing="sampled", s=s, x=x, y=y, radius=radius, end=end, **more)

    def resolve(self, body: Body, field: str = "tendon") -> tuple[float, ...]:
        """The row (cx, cy, rho, angle, omega, s_end) of this tendon in a uniform ``body``; SI units.

        In other bodies it is that of the base; cx to omega of a sampled tendon are NaN. Raises `InvalidInput` (fields
        prefixed with ``field``) where the tendon does not fit the body.
        """
        L_na, end = body.section.L_na, self.end_in(body, field)
        if self.routing == "helical":
            return 0.0, 0.0, self.offset or 0.0, self.angle or 0.0, 2.0 * pi * (self.turns or 0.0) / L_na, end
        if self.routing == "constant":
            return _number(self.x), _number(self.y), 0.0, 0.0, 0.0, end
        if self.routing == "sampled":
            return *(float("nan"),) * 5, end
        return self._wall_distance(body, 0, field), 0.0, 0.0, 0.0, 0.0, end

    def end_in(self, body: Body, field: str = "tendon") -> float:
        """Material coordinate (m) of the anchor. Raises `InvalidInput` where it lies beyond the tip."""
        L_na = body.section.L_na
        end = L_na if self.end is None else self.end
        if end > L_na * (1.0 + ROUNDING):
            raise InvalidInput(f"{field}.end", end, f"> 0 and <= L_na = {L_na:.6g} m")
        joints = [part.end for part in parts(body)]
        return next((joint for joint in joints if abs(end - joint) <= ROUNDING * L_na), end)

    def rows(self, body: Body, i: int = 0, field: str = "tendon") -> np.ndarray:
        """(k, 16) rows [i, s_a, s_b, 0, x[4], y[4], a, phi, w, lumen] from 0 to the end; see `Robot.tendon_table`.

        Raises `InvalidInput` (fields prefixed with ``field``) where the tendon does not fit the body.
        """
        end = self.end_in(body, field)
        reached = [part for part in parts(body) if part.start < end]
        if self.routing == "opposite_backbone":
            rows = [self._wall_row(body, k, field) for k in range(len(reached))]
        else:
            pieces, frames = self._pieces(body, end, field), _frames(reached)
            cut = [(piece, frame) for frame in frames for piece in pieces if _overlap(piece, frame)]
            rows = [_carried(piece, frame, parts(body)[0].r_na) for piece, frame in cut]
        table = _joined(np.array(rows))
        table[:, 0], table[-1, 2] = i, end
        return table

    def _pieces(self, body: Body, end: float, field: str) -> list[_Piece]:
        """The routing in the frame of the first segment."""
        if self.routing == "sampled":
            return self._spline(end, field)
        cx, cy, rho, angle, omega, _ = self.resolve(body, field)
        return [_Piece(0.0, end, np.array([[cx, 0.0, 0.0, 0.0], [cy, 0.0, 0.0, 0.0]]), rho, angle, omega)]

    def _spline(self, end: float, field: str) -> list[_Piece]:
        from scipy.interpolate import CubicSpline

        s, allowed = np.array(self.s), f"covering the tendon from 0 to its end, {end:.6g} m"
        if s[0] > 0.0 or s[-1] < end * (1.0 - 1e-9):
            raise InvalidInput(f"{field}.s", Fact(f"from {s[0]:.6g} to {s[-1]:.6g} m"), allowed)
        spline = CubicSpline(s, np.array([self.x, self.y]).T, bc_type="not-a-knot")
        descending = spline.c  # (order, piece, x and y)
        c = np.zeros((s.size - 1, 2, 4))
        c[:, :, : len(descending)] = np.moveaxis(descending[::-1], 0, -1)
        s[-1] = max(s[-1], end)
        pieces = [_Piece(float(a), float(b), each) for a, b, each in zip(s[:-1], s[1:], c, strict=True)]
        return [piece for piece in pieces if piece.end > 0.0 and piece.start < end]

    def _wall_row(self, body: Body, k: int, field: str) -> list[float]:
        x, part = self._wall_distance(body, k, field), parts(body)[k]
        lumen = x - part.r_na if self.wall == "free" else 0.0
        return [0.0, part.start, part.end, 0.0, x, *(0.0,) * 10, lumen]

    def _wall_distance(self, body: Body, k: int, field: str) -> float:
        part = parts(body)[k]
        if not any(isinstance(each.body, NotchedTube) for each in parts(body)):
            kind = "a body without notches" if isinstance(body, (Segments, TaperedRod)) else "a plain rod"
            raise InvalidInput(f"{field}.routing", self.routing, f'"constant", "helical" or "sampled" in {kind}')
        if part.lumen_radius == 0.0:
            allowed = '"constant", "helical" or "sampled" where it passes a segment without a hole of constant radius'
            raise InvalidInput(f"{field}.routing", self.routing, allowed)
        if self.radius >= part.lumen_radius:
            name = f"segment{k + 1}_inner_radius" if isinstance(body, Segments) else "inner_radius"
            raise InvalidInput(f"{field}.radius", self.radius, f"< {name} = {part.lumen_radius!r}")
        return part.r_na + part.lumen_radius - self.radius


class _Piece(NamedTuple):
    """Stretch of a routing: c (2, 4) of X and Y in powers of s_m - start, and a helix of radius a about that."""

    start: float
    end: float
    c: np.ndarray
    a: float = 0.0
    phi: float = 0.0
    w: float = 0.0


def _frames(reached: list[Part]) -> list[Part]:
    """Parts in a row whose frames continue each other, taken as one."""
    merged: list[Part] = []
    for part in reached:
        if merged and (merged[-1].r_na, merged[-1].angle) == (part.r_na, part.angle):
            part = Part(body=part.body, start=merged.pop().start, end=part.end, angle=part.angle)
        merged.append(part)
    return merged


def _overlap(piece: _Piece, frame: Part) -> bool:
    return min(piece.end, frame.end) > max(piece.start, frame.start)


def _carried(piece: _Piece, frame: Part, base_r_na: float) -> list[float]:
    """The row of ``piece`` within ``frame``: turned back by its angle about the tube's axis, measured from its p."""
    start, end = max(piece.start, frame.start), min(piece.end, frame.end)
    c = _shifted(piece.c, start - piece.start)
    if frame.angle != 0.0 or frame.r_na != base_r_na:
        ca, sa = cos(frame.angle), sin(frame.angle)
        c[0, 0] -= base_r_na
        c = np.array([[ca, sa], [-sa, ca]]) @ c
        c[0, 0] += frame.r_na
    return [0.0, start, end, 0.0, *c[0], *c[1], piece.a, piece.phi - frame.angle, piece.w, 0.0]


def _shifted(c: np.ndarray, t) -> np.ndarray:
    """Coefficients (.., 4) of the same cubics about a point ``t`` further on; t broadcasts over c[..., 0]."""
    c0, c1, c2, c3 = np.moveaxis(c, -1, 0)
    return np.stack([c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2 * c2 + 3 * t * c3), c2 + 3 * t * c3, c3], axis=-1)


def _joined(rows: np.ndarray) -> np.ndarray:
    """Rows without polynomial terms that continue each other as one."""
    kept = [rows[0].copy()]
    for row in rows[1:]:
        if not row[[5, 6, 7, 9, 10, 11]].any() and np.array_equal(row[4:], kept[-1][4:]):
            kept[-1][2] = row[2]
        else:
            kept.append(row.copy())
    return np.array(kept)


def routed(table: np.ndarray, s_m, order: int = 0) -> np.ndarray:
    """(n, 3) r of one tendon's rows at ``s_m`` (n,), or its slope dr/ds_m with ``order`` 1; the last row goes on."""
    at = np.atleast_1d(np.asarray(s_m, dtype=float))
    row = table[np.searchsorted(table[1:, 1] * (1.0 - ROUNDING), at, side="right")]
    t, a, phase, w = (at - row[:, 1])[:, None], row[:, 12], row[:, 13] + row[:, 14] * at, row[:, 14]
    c = _shifted(np.stack([row[:, 4:8], row[:, 8:12]], axis=1), t)
    turn = (-a * w * np.sin(phase), a * w * np.cos(phase)) if order else (a * np.cos(phase), a * np.sin(phase))
    return np.stack([c[:, 0, order] + turn[0], c[:, 1, order] + turn[1], np.zeros_like(at)], axis=-1)


def _number(value) -> float:
    return 0.0 if value is None else value
