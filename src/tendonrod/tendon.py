"""Tendon routings in the section frame, measured from the neutral axis.

Every routing resolves to one row of six numbers, r(s_m) = [cx + rho cos(angle + omega s_m), cy + rho sin(...), 0], with
s_m the material coordinate, s_m = s + (1 - insertion) L_na.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from .errors import MISSING, InvalidInput, finite, nonnegative, one_of, positive
from .section import NotchedTube, PlainRod

ROUTINGS = {
    "opposite_backbone": (),
    "constant": ("x", "y"),
    "helical": ("offset", "angle", "turns"),
}


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """A tendon as its user describes it; build it with `opposite_backbone`, `constant` or `helical`.

    - radius: m; x, y, offset: m from the neutral axis; angle: rad; turns: over the whole body, right-handed positive.
    - end: material coordinate (m, in (0, L_na]) where the tendon is anchored, None for the tip.
    """

    routing: str
    radius: float = 0.0
    x: float | None = None
    y: float | None = None
    offset: float | None = None
    angle: float | None = None
    turns: float | None = None
    end: float | None = None

    def __post_init__(self) -> None:
        needed = ROUTINGS[one_of("routing", self.routing, ROUTINGS)]
        check_radius = positive if self.routing == "opposite_backbone" else nonnegative
        object.__setattr__(self, "radius", check_radius("radius", self.radius))
        for name in ("x", "y", "offset", "angle", "turns"):
            self._check_number(name, name in needed)
        if self.end is not None:
            object.__setattr__(self, "end", positive("end", self.end))

    def _check_number(self, name: str, needed: bool) -> None:
        value = getattr(self, name)
        if not needed and value is not None:
            raise InvalidInput(name, value, f'left out where routing = "{self.routing}"')
        if needed:
            check = nonnegative if name == "offset" else finite
            object.__setattr__(self, name, check(name, MISSING if value is None else value))

    @classmethod
    def opposite_backbone(cls, *, radius: float, end: float | None = None) -> Tendon:
        """Along the inner wall opposite the uncut arc, x = r_na + r_in - radius (paper, II-B). Notched tubes only."""
        return cls(routing="opposite_backbone", radius=radius, end=end)

    @classmethod
    def constant(cls, *, x: float, y: float, radius: float = 0.0, end: float | None = None) -> Tendon:
        """At a fixed point (x, y) of the section frame."""
        return cls(routing="constant", x=x, y=y, radius=radius, end=end)

    @classmethod
    def helical(
        cls, *, offset: float, angle: float, turns: float, radius: float = 0.0, end: float | None = None
    ) -> Tendon:
        """At distance ``offset`` from the neutral axis, at angle + 2 pi turns s_m / L_na in the section frame."""
        return cls(routing="helical", offset=offset, angle=angle, turns=turns, radius=radius, end=end)

    def resolve(self, body: NotchedTube | PlainRod, field: str = "tendon") -> tuple[float, ...]:
        """The row (cx, cy, rho, angle, omega, s_end) of this tendon in ``body``; SI units.

        Raises `InvalidInput` (fields prefixed with ``field``) where the tendon does not fit the body.
        """
        L_na = body.section.L_na
        end = L_na if self.end is None else self.end
        if end > L_na:
            raise InvalidInput(f"{field}.end", end, f"> 0 and <= L_na = {L_na:.6g} m")
        if self.routing == "helical":
            return 0.0, 0.0, self.offset or 0.0, self.angle or 0.0, 2.0 * pi * (self.turns or 0.0) / L_na, end
        if self.routing == "constant":
            return self.x or 0.0, self.y or 0.0, 0.0, 0.0, 0.0, end
        return self._wall_distance(body, field), 0.0, 0.0, 0.0, 0.0, end

    def _wall_distance(self, body: NotchedTube | PlainRod, field: str) -> float:
        if not isinstance(body, NotchedTube):
            raise InvalidInput(f"{field}.routing", self.routing, '"constant" or "helical" in a plain rod')
        if self.radius >= body.inner_radius:
            raise InvalidInput(f"{field}.radius", self.radius, f"< inner_radius = {body.inner_radius!r}")
        return body.section.r_na + body.inner_radius - self.radius
