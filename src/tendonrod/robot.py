"""A robot: a body, its tendons, and where each number comes from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from os import PathLike
from types import MappingProxyType

import numpy as np

from . import body as bodies
from .body import ROUNDING, Body, parts
from .errors import InvalidInput, whole
from .parameters import ROD_KEYS as ROD_KEYS
from .parameters import TUBE_KEYS as TUBE_KEYS
from .parameters import (
    body_numbers,
    changed_body,
    changed_tendons,
    replaceable,
    stale_sources,
    tendon_names,
    tendon_numbers,
)
from .section import NotchedTube, Section
from .tendon import ROW, Tendon, routed


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A rod with tendons, SI units; immutable, hashable and picklable.

    name: text. body: `NotchedTube`, `PlainRod`, `TaperedRod` or `Segments` of them. tendons: tuple of `Tendon`, may be
    empty. sources: robot-file key -> where that number comes from. Raises `InvalidInput` where a tendon does not fit
    the body.

    The arrays without a word on it are not to be changed; they are not read-only either, since Numba compiles anew for
    read-only arrays.
    """

    name: str
    body: Body
    tendons: tuple[Tendon, ...] = ()
    sources: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput("name", self.name, "a text that is not empty")
        if not isinstance(self.body, Body):
            raise InvalidInput("body", self.body, "a NotchedTube, a PlainRod, a TaperedRod or Segments")
        if not isinstance(self.tendons, Sequence) or not all(isinstance(each, Tendon) for each in self.tendons):
            raise InvalidInput("tendons", self.tendons, "a sequence of Tendon")
        object.__setattr__(self, "tendons", tuple(self.tendons))
        if not isinstance(self.sources, Mapping):
            raise InvalidInput("sources", self.sources, "a mapping from keys of the robot file to texts")
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        _ = self.tendon_table  # a tendon that does not fit is refused here, not at the first solve

    def __reduce__(self):
        values = {"name": self.name, "body": self.body, "tendons": self.tendons, "sources": dict(self.sources)}
        return partial(Robot, **values), ()

    @cached_property
    def section(self) -> Section:
        """Constants of the cross section at the base; L and L_na are those of the whole body."""
        return self.body.section

    @property
    def length_na(self) -> float:
        """Length of the neutral axis, L_na (m)."""
        return self.section.L_na

    @property
    def turns(self) -> float:
        """Turns of the uncut arc around the tube's axis, summed over segments; 0 for a plain rod."""
        return sum(part.body.turns for part in parts(self.body) if isinstance(part.body, NotchedTube)) + 0.0

    @property
    def torsion(self) -> str:
        """Name of the notched tube's torsion model; "GJ" for a plain rod; the different ones of segments in a row."""
        models = [part.body.torsion if isinstance(part.body, NotchedTube) else "GJ" for part in parts(self.body)]
        return ", ".join(dict.fromkeys(models))

    @property
    def n_tendons(self) -> int:
        """Number of tendons."""
        return len(self.tendons)

    @cached_property
    def section_table(self) -> np.ndarray:
        """(m, 62) rows [s_a, s_b, c0[15], c1[15], c2[15], c3[15]]: from s_a to s_b, quantity = sum ck (s_m - s_a)^k.

        The fifteen: Kse[3] (N), Kbt[3] (N m^2), v_star[3], u_star[3] (1/m), mass per metre of s_m (kg/m), mass centroid
        x and y (m, section frame). Exact for uniform bodies, to 5e-9 of each quantity in tapers.
        """
        return bodies.section_table(self.body)

    @cached_property
    def tendon_table(self) -> np.ndarray:
        """(k, 16) rows [i, s_a, s_b, 0, x0..x3, y0..y3, a, phi, w, lumen]; those of tendon i in a row, up to its end.

        r_i = (X, Y, 0), X = sum xk (s_m - s_a)^k + a cos(phi + w s_m), Y = sum yk (s_m - s_a)^k + a sin(phi + w s_m).
        lumen (m): 0 where the tendon is held; else the radius of the disc about the tube's axis in which it may lie.
        """
        rows = [tendon.rows(self.body, i, f"tendons[{i}]") for i, tendon in enumerate(self.tendons)]
        return np.concatenate(rows) if rows else np.empty((0, ROW))

    @cached_property
    def joints(self) -> np.ndarray:
        """(q, 4) rows [s_m, dx, dy, angle] where the neutral axis jumps or the section frame turns between segments.

        The frame beyond is the one before, displaced by R (dx, dy, 0), then turned by ``angle`` about its z: m, rad.
        """
        return bodies.joints(self.body)

    @cached_property
    def breaks(self) -> np.ndarray:
        """(nb,) material coordinates (m) inside the body where segments meet or tendons end, sorted."""
        places = np.unique([*(part.end for part in parts(self.body)), *self.tendon_ends])
        return places[places < self.length_na * (1.0 - ROUNDING)].copy()

    @cached_property
    def is_uniform(self) -> bool:
        """Whether nothing changes along the body but helical tendons: `rod_constants` and `routing` then say it all."""
        sampled = any(tendon.routing == "sampled" for tendon in self.tendons)
        table = self.section_table
        return len(table) == 1 and not table[0, 17:].any() and not sampled and not self.tendon_table[:, 15].any()

    @cached_property
    def friction(self) -> np.ndarray:
        """(n_tendons,) Coulomb coefficients."""
        return np.array([tendon.friction for tendon in self.tendons])

    @cached_property
    def tendon_compliance(self) -> np.ndarray:
        """(n_tendons,) 1 / EA (1/N), 0 for inextensible tendons."""
        stiffness = [tendon.axial_stiffness for tendon in self.tendons]
        return np.array([0.0 if each is None else 1.0 / each for each in stiffness])

    @cached_property
    def free_lengths(self) -> np.ndarray:
        """(n_tendons,) length (m) of each tendon between its actuator and the body's base."""
        return np.array([tendon.free_length for tendon in self.tendons])

    @cached_property
    def axis_table(self) -> np.ndarray:
        """(m, 2) tube's axis in the section frame (m), by row of `section_table`."""
        return np.ascontiguousarray(self.axis_offset(0.5 * (self.section_table[:, 0] + self.section_table[:, 1])))

    @cached_property
    def tendon_lengths(self) -> np.ndarray:
        """(n_tendons,) length (m) of each tendon's path from the base to its anchor in the straight, unloaded robot."""
        x, weights = np.polynomial.legendre.leggauss(10)
        found = np.zeros(self.n_tendons)
        for i, rows in enumerate(self._tendon_rows):
            marks = np.unique(np.concatenate([rows[:, 1:3].ravel(), self.breaks[self.breaks < self.tendon_ends[i]]]))
            pieces = np.maximum(1, np.ceil(np.abs(rows[:, 14]).max() * np.diff(marks))).astype(int)
            cuts = [np.linspace(a, b, n + 1) for a, b, n in zip(marks[:-1], marks[1:], pieces, strict=True)]
            for cut in cuts:
                half = 0.5 * np.diff(cut)
                s = (0.5 * (cut[:-1] + cut[1:])[:, None] + half[:, None] * x).ravel()
                values, r = self.section_values(s), self.tendon_position(i, s)
                q = values[:, 6:9] + np.cross(values[:, 9:12], r) + self.tendon_slope(i, s)
                found[i] += (half[:, None] * weights).ravel() @ np.linalg.norm(q, axis=1)
        return found

    @cached_property
    def tendon_ends(self) -> np.ndarray:
        """(n_tendons,) material coordinates (m) of the anchors."""
        return np.array([rows[-1, 2] for rows in self._tendon_rows])

    @cached_property
    def routing(self) -> np.ndarray:
        """(n_tendons, 6) rows [cx, cy, rho, angle, omega, s_end], read-only; m, rad, 1/m.

        r_i = [cx + rho cos(angle + omega s_m), cy + rho sin(angle + omega s_m), 0]. Where the robot is not uniform this
        holds in the first segment only, and is NaN for sampled tendons; s_end holds always.
        """
        rows = [tendon.resolve(self.body, f"tendons[{i}]") for i, tendon in enumerate(self.tendons)]
        table = np.array(rows, dtype=float).reshape(-1, 6)
        table.setflags(write=False)
        return table

    @cached_property
    def rod_constants(self) -> np.ndarray:
        """(13,) Kse[3] Kbt[3] v_star[3] u_star[3] reach, SI, of the section at the base: of all if `is_uniform`.

        reach (m): the farthest that any tendon lies from the neutral axis anywhere, 0 without tendons.
        """
        section = self.section
        return np.concatenate([section.Kse, section.Kbt, section.v_star, section.u_star, [self._reach]])

    @cached_property
    def _reach(self) -> float:
        """Bound of a tendon's distance from the neutral axis, exact where X and Y have no polynomial terms."""
        table = self.tendon_table
        t = (table[:, 2] - table[:, 1])[:, None] * np.linspace(0.0, 1.0, 9)
        x, y = (np.einsum("kj,ktj->kt", table[:, at : at + 4], t[..., None] ** np.arange(4)) for at in (4, 8))
        return float((np.hypot(x, y) + table[:, 12:13]).max(initial=0.0))

    @cached_property
    def _tendon_rows(self) -> tuple[np.ndarray, ...]:
        return tuple(self.tendon_table[self.tendon_table[:, 0] == i] for i in range(self.n_tendons))

    def tendon_position(self, i: int, s_m) -> np.ndarray:
        """r_i (n, 3) in the section frame (m) at material coordinates ``s_m`` (n,) in m; defined beyond the end too.

        At a joint it is the one beyond.
        """
        return routed(self._tendon_rows[whole("i", i, 0, self.n_tendons - 1)], s_m)

    def tendon_slope(self, i: int, s_m) -> np.ndarray:
        """dr_i/ds_m (n, 3) in the section frame, without unit, at ``s_m`` (n,) in m."""
        return routed(self._tendon_rows[whole("i", i, 0, self.n_tendons - 1)], s_m, order=1)

    def section_at(self, s_m: float) -> Section:
        """Constants of the section at ``s_m`` (m), at a joint those beyond it; L and L_na of the whole body."""
        return bodies.section_at(self.body, s_m)

    def section_values(self, s_m) -> np.ndarray:
        """(n, 15) the quantities of `section_table` at ``s_m`` (n,) in m; at a joint those beyond."""
        return bodies.evaluate(self.section_table, np.atleast_1d(np.asarray(s_m, dtype=float)))

    def axis_offset(self, s_m) -> np.ndarray:
        """(n, 2) the tube's axis in the section frame, (r_na, 0) in m, at ``s_m`` (n,); at a joint that beyond it."""
        r_na = np.array([part.r_na for part in parts(self.body)])[bodies.part_at(self.body, np.atleast_1d(s_m))]
        return np.stack([r_na, np.zeros_like(r_na)], axis=-1)

    def outer_radius(self, s_m) -> np.ndarray:
        """(n,) radius of the outline about the tube's axis (m) at ``s_m`` (n,); NaN for a rod given by its area."""
        return bodies.outer_radius(self.body, np.atleast_1d(np.asarray(s_m, dtype=float)))

    def parameters(self) -> dict[str, float]:
        """Every number of body and tendons by flat SI name, as `replace` takes it; names in docs/robot_files.

        ``length``, of segments ``segment1_length``, ``segment2_angle``; ``tendon_radius``, of several tendons
        ``tendon1_radius``.
        """
        return body_numbers(self.body) | tendon_numbers(self.tendons)

    def replace(self, **changes) -> Robot:
        """A copy with the numbers of `parameters` changed; also name, tendons, and torsion or precurvature as a whole.

        The sources of changed numbers are dropped. Raises `InvalidInput` for unknown names, listing the valid ones.
        """
        of_tendons = tendon_names(self.tendons)
        valid = list(dict.fromkeys(["name", "tendons", *replaceable(self.body), *of_tendons]))
        for name, value in changes.items():
            if name not in valid:
                raise InvalidInput(name, value, "called by one of the names " + ", ".join(valid))
            if "tendons" in changes and name in of_tendons:
                raise InvalidInput(name, value, "left out where tendons is given")
        stale = stale_sources(self.body, self.tendons, changes)
        return Robot(
            name=changes.get("name", self.name),
            body=changed_body(self.body, changes),
            tendons=changes["tendons"] if "tendons" in changes else changed_tendons(self.tendons, changes),
            sources={key: text for key, text in self.sources.items() if not key.startswith(stale)},
        )


def as_robot(value: object) -> Robot:
    """``value`` if it is a `Robot`, else `InvalidInput`."""
    if not isinstance(value, Robot):
        raise InvalidInput("robot", value, "a Robot, as load_robot gives it")
    return value


def load_robot(source: str | PathLike[str]) -> Robot:
    """A robot by preset name (`preset_names`) or from a TOML file, SI units.

    Raises `InvalidInput` with one line that names the file, the key, the value and what is allowed.
    """
    from .robotfile import read_robot  # pydantic is imported only here

    return read_robot(source)


def preset_names() -> list[str]:
    """Names of the robots that come with the package."""
    from importlib.resources import files

    found = (entry.name for entry in (files("tendonrod") / "robots").iterdir())
    return sorted(name.removesuffix(".toml") for name in found if name.endswith(".toml"))
