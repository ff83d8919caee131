"""A robot: a body, its tendons, and where each number comes from."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from os import PathLike
from types import MappingProxyType

import numpy as np

from .errors import MISSING, InvalidInput, vector
from .section import NotchedTube, PlainRod, Section, StiffnessFactors
from .tendon import Tendon

_FACTORS = ("axial", "bending_x", "bending_y", "torsion")
_MATERIAL_KEYS = {
    "youngs_modulus": "material.youngs_modulus_gpa",
    "shear_modulus": "material.shear_modulus_gpa",
    "density": "material.density_kg_m3",
}
TUBE_KEYS = {
    "inner_radius": "tube.inner_radius_mm",
    "outer_radius": "tube.outer_radius_mm",
    "length": "tube.length_mm",
    "notch_width": "notches.width_mm",
    "notch_spacing": "notches.spacing_mm",
    "uncut_angle": "notches.uncut_angle_deg",
    "turns": "notches.turns",
    **_MATERIAL_KEYS,
    "torsion": "material.torsion",
    **{f"{name}_factor": f"material.stiffness_factors.{name}" for name in _FACTORS},
}
ROD_KEYS = {
    "length": "rod.length_mm",
    "radius": "rod.radius_mm",
    "area": "rod.area_mm2",
    "ix": "rod.ix_mm4",
    "iy": "rod.iy_mm4",
    "j": "rod.j_mm4",
    "precurvature": "rod.precurvature_per_m",
    **_MATERIAL_KEYS,
}
_PRECURVATURE = ("precurvature_x", "precurvature_y", "precurvature_z")


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A rod with tendons, SI units; immutable, hashable and picklable.

    name: text. body: `NotchedTube` or `PlainRod`. tendons: tuple of `Tendon`, may be empty. sources: robot-file key ->
    where that number comes from. Raises `InvalidInput` where a tendon does not fit the body.
    """

    name: str
    body: NotchedTube | PlainRod
    tendons: tuple[Tendon, ...] = ()
    sources: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput("name", self.name, "a text that is not empty")
        if not isinstance(self.body, (NotchedTube, PlainRod)):
            raise InvalidInput("body", self.body, "a NotchedTube or a PlainRod")
        if not isinstance(self.tendons, Sequence) or not all(isinstance(each, Tendon) for each in self.tendons):
            raise InvalidInput("tendons", self.tendons, "a sequence of Tendon")
        object.__setattr__(self, "tendons", tuple(self.tendons))
        if not isinstance(self.sources, Mapping):
            raise InvalidInput("sources", self.sources, "a mapping from keys of the robot file to texts")
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        _ = self.routing  # a tendon that does not fit is refused here, not at the first solve

    def __reduce__(self):
        values = {"name": self.name, "body": self.body, "tendons": self.tendons, "sources": dict(self.sources)}
        return partial(Robot, **values), ()

    @cached_property
    def section(self) -> Section:
        """Constants of the cross section."""
        return self.body.section

    @property
    def length_na(self) -> float:
        """Length of the neutral axis, L_na (m)."""
        return self.section.L_na

    @property
    def turns(self) -> float:
        """Turns of the uncut arc around the tube's axis; 0 for a plain rod."""
        return self.body.turns if isinstance(self.body, NotchedTube) else 0.0

    @property
    def torsion(self) -> str:
        """Name of the notched tube's torsion model; "GJ" for a plain rod."""
        return self.body.torsion if isinstance(self.body, NotchedTube) else "GJ"

    @property
    def n_tendons(self) -> int:
        """Number of tendons."""
        return len(self.tendons)

    @cached_property
    def routing(self) -> np.ndarray:
        """(n_tendons, 6) rows [cx, cy, rho, angle, omega, s_end], read-only; m, rad, 1/m; see `tendonrod.tendon`."""
        rows = [tendon.resolve(self.body, f"tendons[{i}]") for i, tendon in enumerate(self.tendons)]
        table = np.array(rows, dtype=float).reshape(-1, 6)
        table.setflags(write=False)
        return table

    @cached_property
    def rod_constants(self) -> np.ndarray:
        """(13,) Kse[3] Kbt[3] v_star[3] u_star[3] reach, SI, as the compiled kernel takes them.

        reach (m): the farthest that any tendon lies from the neutral axis, 0 without tendons. Not to be changed; not
        read-only either, since Numba compiles anew for read-only arrays.
        """
        section, routing = self.section, self.routing
        reach = np.hypot(routing[:, 0], routing[:, 1]) + routing[:, 2]
        return np.concatenate([section.Kse, section.Kbt, section.v_star, section.u_star, [reach.max(initial=0.0)]])

    def tendon_position(self, i: int, s_m) -> np.ndarray:
        """r_i (n, 3) in the section frame (m) at material coordinates ``s_m`` (n,) in m; defined beyond the end too."""
        cx, cy, rho, angle, omega, _ = self.routing[i]
        phase = angle + omega * np.atleast_1d(np.asarray(s_m, dtype=float))
        return np.stack([cx + rho * np.cos(phase), cy + rho * np.sin(phase), np.zeros_like(phase)], axis=-1)

    def parameters(self) -> dict[str, float]:
        """Every number of the body by flat SI name, as `replace` takes it; tendon_radius of a lone wall tendon."""
        numbers = _numbers(self.body)
        if self._has_one_wall_tendon:
            numbers["tendon_radius"] = self.tendons[0].radius
        return numbers

    def replace(self, **changes) -> Robot:
        """A copy with the numbers of `parameters` changed; also name, tendons, and torsion or precurvature as a whole.

        The sources of changed numbers are dropped. Raises `InvalidInput` for unknown names, listing the valid ones.
        """
        valid = self._replaceable()
        for name, value in changes.items():
            if name not in valid:
                raise InvalidInput(name, value, "called by one of the names " + ", ".join(valid))
        if {"tendons", "tendon_radius"} <= changes.keys():
            raise InvalidInput("tendon_radius", changes["tendon_radius"], "left out where tendons is given")
        tendons = changes.get("tendons", self.tendons)
        if "tendon_radius" in changes:
            tendons = (dataclasses.replace(self.tendons[0], radius=changes["tendon_radius"]),)
        stale = self._stale_sources(changes)
        return Robot(
            name=changes.get("name", self.name),
            body=_changed_body(self.body, changes),
            tendons=tendons,
            sources={key: text for key, text in self.sources.items() if not key.startswith(stale)},
        )

    @property
    def _has_one_wall_tendon(self) -> bool:
        return len(self.tendons) == 1 and self.tendons[0].routing == "opposite_backbone"

    def _replaceable(self) -> list[str]:
        names = ["name", "tendons", *self.parameters()]
        if isinstance(self.body, PlainRod):
            return [*names, "precurvature"]
        return list(dict.fromkeys([*names, "torsion", "stiffness_factors", *(f"{name}_factor" for name in _FACTORS)]))

    def _stale_sources(self, changes: Mapping[str, object]) -> tuple[str, ...]:
        keys = TUBE_KEYS if isinstance(self.body, NotchedTube) else ROD_KEYS
        special = {"tendon_radius": "tendons[0].radius_mm", "tendons": "tendons[", "name": "name"}
        special |= {"stiffness_factors": "material.stiffness_factors."}
        special |= dict.fromkeys(_PRECURVATURE, keys.get("precurvature", ""))
        return tuple(keys.get(name) or special[name] for name in changes)


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


def _numbers(body: NotchedTube | PlainRod) -> dict[str, float]:
    numbers = {each.name: getattr(body, each.name) for each in dataclasses.fields(body)}
    numbers = {name: value for name, value in numbers.items() if isinstance(value, float)}
    if isinstance(body, PlainRod):
        return numbers | dict(zip(_PRECURVATURE, body.precurvature, strict=True))
    return numbers | _factor_numbers(body.stiffness_factors)


def _factor_numbers(factors: StiffnessFactors | None) -> dict[str, float]:
    return {} if factors is None else {f"{name}_factor": getattr(factors, name) for name in _FACTORS}


def _changed_body(body: NotchedTube | PlainRod, changes: Mapping[str, object]) -> NotchedTube | PlainRod:
    own = {each.name for each in dataclasses.fields(body)}
    direct = {name: value for name, value in changes.items() if name in own}
    if isinstance(body, PlainRod):
        if any(name in changes for name in _PRECURVATURE):
            current = vector("precurvature", direct.get("precurvature", body.precurvature), 3)
            entries = zip(_PRECURVATURE, current.tolist(), strict=True)
            direct["precurvature"] = tuple(changes.get(name, value) for name, value in entries)
    elif any(f"{name}_factor" in changes for name in _FACTORS):
        given = _factor_numbers(direct.get("stiffness_factors", body.stiffness_factors)) | changes  # pyright: ignore
        direct["stiffness_factors"] = StiffnessFactors(
            **{name: given.get(f"{name}_factor", MISSING) for name in _FACTORS}  # pyright: ignore[reportArgumentType]
        )
    return dataclasses.replace(body, **direct)
