"""Reading scene files: what acts on a robot and what surrounds it, TOML with units in its keys, converted to SI once.

Loads, the place of the outer tube's exit, surfaces. Like `robotfile`, whose checks it shares, this module knows
pydantic; ranges are checked by the domain classes, whose messages are put into the words of the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from os import PathLike, fspath
from typing import Annotated, Any

import numpy as np
from pydantic import Field, StrictStr

from .errors import Fact, InvalidInput, one_of, positive
from .files import text_of
from .loads import DistributedLoad, Load, LumpedMass, PointLoad
from .robotfile import validated
from .robotfile_tables import Number, Table
from .robotfile_words import at, flat_name, in_file_words, parsed, si
from .rotation import exp_so3
from .surface import Cavity, Cylinder, Plane, Sphere, Surface, Tube, Walls

SHAPE = "a scene: [[point]], [[mass]], [[distributed]], [exit], [[surface]] and tolerance_mm, as needed"
Three = Annotated[list[Number], Field(min_length=3, max_length=3)]
Two = Annotated[list[Number], Field(min_length=2, max_length=2)]
ZERO = [0.0, 0.0, 0.0]


class PointTable(Table):
    force_n: Three = ZERO
    moment_nm: Three = ZERO
    at_mm: Number | None = None
    offset_mm: Three = ZERO
    frame: StrictStr = "world"


class MassTable(Table):
    mass_g: Number
    at_mm: Number | None = None
    offset_mm: Three = ZERO


class DistributedTable(Table):
    force_n_per_m: Three = ZERO
    moment_nm_per_m: Three = ZERO
    force_end_n_per_m: Three | None = None
    moment_end_nm_per_m: Three | None = None
    start_mm: Number = 0.0
    end_mm: Number | None = None
    frame: StrictStr = "world"


class ExitTable(Table):
    position_mm: Three = ZERO
    rotation_deg: Three = ZERO
    tilt_deg: Two = Field(default=[0.0, 0.0])
    offset_mm: Two = Field(default=[0.0, 0.0])


class PlaneTable(Table):
    type: StrictStr
    point_mm: Three
    normal: Three


class AxisTable(Table):
    type: StrictStr
    point_mm: Three
    axis: Three
    radius_mm: Number


class CenterTable(Table):
    type: StrictStr
    center_mm: Three
    radius_mm: Number


class SceneTable(Table):
    tolerance_mm: Number | None = None
    exit: ExitTable | None = None
    point: list[PointTable] = Field(default=[])
    mass: list[MassTable] = Field(default=[])
    distributed: list[DistributedTable] = Field(default=[])
    surface: list[dict[str, Any]] = Field(default=[])


LOADS = {"point": PointLoad, "mass": LumpedMass, "distributed": DistributedLoad}
SURFACES = {
    "plane": (PlaneTable, Plane),
    "tube": (AxisTable, Tube),
    "cylinder": (AxisTable, Cylinder),
    "sphere": (CenterTable, Sphere),
    "cavity": (CenterTable, Cavity),
}
_UNITS = ("_n_per_m", "_nm_per_m", "_nm")  # those in SI already, which `flat_name` does not know


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """What a scene file says, SI, world frame; `arguments` are those of `tendonrod.solve`.

    loads: points, masses and distributed ones, in this order; names: what each is called in the file, "mass[0]".
    exit_pose (4, 4), exit_tilt (2,) rad, exit_offset (2,) m, contact_tolerance (m): None where not given.
    """

    name: str
    loads: tuple[Load, ...] = ()
    names: tuple[str, ...] = ()
    exit_pose: np.ndarray | None = None
    exit_tilt: tuple[float, ...] | None = None
    exit_offset: tuple[float, ...] | None = None
    surfaces: tuple[Surface, ...] = ()
    contact_tolerance: float | None = None
    _table: Any = field(default=None, repr=False)

    @property
    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of `tendonrod.solve`; only those that the file gives."""
        several = len(self.surfaces) > 1
        surface = Walls(surfaces=self.surfaces) if several else next(iter(self.surfaces), None)
        found = {"exit_pose": self.exit_pose, "exit_tilt": self.exit_tilt, "exit_offset": self.exit_offset}
        found |= {"loads": self.loads or None, "surface": surface, "contact_tolerance": self.contact_tolerance}
        return {name: value for name, value in found.items() if value is not None}

    @contextmanager
    def in_words(self) -> Iterator[None]:
        """Errors of a solve with this scene, where they are about it, in the words of the file."""
        try:
            yield
        except InvalidInput as error:
            raise self._in_words(error) from None

    def _in_words(self, error: InvalidInput) -> InvalidInput:
        if error.field == "surface":
            what = error.value if isinstance(error.value, Fact) else Fact("given")
            return InvalidInput(f"{self.name}: surface", what, error.allowed)
        tables = {f"loads[{i}].": name for i, name in enumerate(self.names)}
        keys = {start + flat: key for start, name in tables.items() for flat, key in _keys(self._table, name).items()}
        return in_file_words(self.name, error, self._table, keys) if error.field in keys else error


def read_scene(source: str | PathLike[str], field: str = "scene") -> Scene:
    """The scene on file. Raises `InvalidInput` that names the file, the key, the value and what is allowed.

    field: what the file is called in the error of one that cannot be read.
    """
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput(field, source, "the path of a scene file")
    name = fspath(source)
    checked = validated(name, SceneTable, parsed(name, text_of(field, name, "TOML"), SHAPE), expected=_expected)
    tables = [_surface_table(name, k, each) for k, each in enumerate(checked.surface)]
    checked = checked.model_copy(update={"surface": tables})
    names = tuple(f"{kind}[{i}]" for kind in LOADS for i in range(len(getattr(checked, kind))))
    loads = tuple(_made(name, checked, LOADS[each.partition("[")[0]], each) for each in names)
    walls = [_made(name, checked, SURFACES[each.type][1], f"surface[{k}]") for k, each in enumerate(tables)]
    if checked.tolerance_mm is not None and not walls:
        raise InvalidInput(f"{name}: tolerance_mm", checked.tolerance_mm, "left out where no [[surface]] is given")
    known = {"loads": loads, "names": names, "surfaces": tuple(walls), "contact_tolerance": _tolerance(name, checked)}
    return Scene(name=name, **known, **_place(checked), _table=checked)


def _surface_table(name: str, k: int, table: dict[str, Any]) -> PlaneTable | AxisTable | CenterTable:
    if "type" not in table:
        raise InvalidInput(f"{name}: surface[{k}].type", Fact("missing"), "one of " + ", ".join(SURFACES))
    kind = one_of(f"{name}: surface[{k}].type", table["type"], SURFACES)
    return validated(name, SURFACES[kind][0], table, ("surface", k), _expected)


def _made(name: str, checked: SceneTable, domain: type, place: str) -> Any:
    """The load or surface that the table at ``place`` describes."""
    keys = _keys(checked, place)
    values = {flat: si(checked, key) for flat, key in keys.items() if flat != "type"}
    try:
        return domain(**{flat: value for flat, value in values.items() if value is not None})
    except InvalidInput as error:
        raise in_file_words(name, error, checked, keys) from None


def _keys(checked: SceneTable, place: str) -> dict[str, str]:
    """Name in the domain -> key in the file, of one table."""
    return {_flat(key): f"{place}.{key}" for key in type(at(checked, place)).model_fields}


def _flat(key: str) -> str:
    unit = next((unit for unit in _UNITS if key.endswith(unit)), "")
    return key.removesuffix(unit) if unit else flat_name(key)


def _tolerance(name: str, checked: SceneTable) -> float | None:
    if checked.tolerance_mm is None:
        return None
    positive(f"{name}: tolerance_mm", checked.tolerance_mm)
    return si(checked, "tolerance_mm")


def _place(checked: SceneTable) -> Mapping[str, Any]:
    """Place of the outer tube's exit."""
    table = checked.exit
    if table is None:
        return {}
    found: dict[str, Any] = {}
    if any(table.position_mm) or any(table.rotation_deg):
        pose = np.eye(4)
        pose[:3, :3] = exp_so3(np.array(si(table, "rotation_deg")))
        pose[:3, 3] = si(table, "position_mm")
        pose.setflags(write=False)
        found["exit_pose"] = pose
    for key, flat in (("tilt_deg", "exit_tilt"), ("offset_mm", "exit_offset")):
        if any(getattr(table, key)):
            found[flat] = tuple(si(table, key))
    return found


def _expected(error: Any) -> str:
    where, kind = error["loc"], error["type"]
    if kind == "string_type":
        return "a text in quotes"
    if where[-1] in ("exit", *LOADS, "surface"):
        return "a table, [exit]" if where[-1] == "exit" else f"tables, [[{where[-1]}]], with two brackets"
    if kind in ("model_type", "dict_type"):
        return f"a table, [[{where[0]}]]"
    if kind in ("list_type", "too_short", "too_long"):
        return f"a list of {2 if where[0] == 'exit' and where[-1] in ('tilt_deg', 'offset_mm') else 3} finite numbers"
    return "a finite number"
