"""Reading phantom files: TOML with units in its keys, converted to SI once; every error names file and key."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from ..errors import MISSING, Fact, InvalidInput, finite, one_of, positive, vector, within
from ..files import text_of
from .building import anatomical_phantom, printed_phantom
from .dimensions import Dimensions
from .levels import DEFAULT, Level, level_range
from .phantom import Phantom, Target
from .usermeshes import SPACINGS, MeshSource, Placing, mesh_phantom

SHAPE = 'a phantom: name, kind = "printed", "anatomical" or "meshes", then [scale] and [numbers], or [[structure]]'
COMMON = ("name", "kind", "pressure_limit_kpa", "cord_indentation_limit_mm")
PARAMETRIC = (*COMMON, "levels", "scale", "numbers", "sources")
OF_MESHES = (*COMMON, "placing", "structure", "target", "level", "distance_spacing_mm")
MM = 1e-3


def read_phantom(source: str, levels: str | None = None) -> Phantom:
    """The phantom that a file describes. ``levels``: instead of the file's. Raises `InvalidInput`."""
    table = _parsed(source)
    kind = one_of(f"{source}: kind", table.get("kind", MISSING), ("printed", "anatomical", "meshes"))
    _check_keys(source, table, OF_MESHES if kind == "meshes" else PARAMETRIC)
    name = _text(f"{source}: name", table.get("name", Path(source).stem))
    with _in(source):
        limits = _limits(table)
        if kind == "meshes":
            return replace(_of_meshes(source, name, table, levels), **limits)
        numbers = Dimensions(scale=_table(table, "scale"), numbers=_numbers(table), sources_of_numbers=_sources(table))
        build = printed_phantom if kind == "printed" else anatomical_phantom
        made = build(level_range(levels or table.get("levels", DEFAULT)), numbers, name)
        return replace(made, **limits)


def _of_meshes(source: str, name: str, table: Mapping[str, Any], levels: str | None) -> Phantom:
    if levels is not None:
        raise InvalidInput("levels", levels, "left out: meshes have the levels that their file tells")
    folder = Path(source).parent
    structures = tuple(_mesh(folder, i, each) for i, each in enumerate(_tables(table, "structure")))
    targets = tuple(_target(i, each) for i, each in enumerate(_tables(table, "target")))
    spacing = (
        {"spacing": MM * within("distance_spacing_mm", table["distance_spacing_mm"], *(each / MM for each in SPACINGS))}
        if ("distance_spacing_mm" in table)
        else {}
    )
    known = tuple(_level(i, each) for i, each in enumerate(_tables(table, "level")))
    made = mesh_phantom(name, structures, targets, known, _placing(table), **spacing)
    for i, each in enumerate(targets):
        _check_target(f"target[{i}]", each, made, targets[:i])
    return made


def _check_target(where: str, target: Target, phantom: Phantom, before: Sequence[Target]) -> None:
    """Raises `InvalidInput` for a name that was given before, and a place inside the cord or the dura."""
    for k, other in enumerate(before):
        if other.name == target.name:
            raise InvalidInput(f"{where}.name", target.name, f"a name of its own; target[{k}] has this one")
    for name, distance in phantom.clearance([target.position]).items():
        if phantom.structures[name].role in ("cord", "dura") and distance[0] < 0.0:
            place = [round(each / MM, 6) for each in target.position]
            allowed = f"outside the {name}: it lies {-distance[0] / MM:.2f} mm inside, where no tip may be"
            raise InvalidInput(f"{where}.position_mm", place, allowed)


def _mesh(folder: Path, i: int, table: Mapping[str, Any]) -> MeshSource:
    where = f"structure[{i}]"
    _check_keys(where, table, [each.name for each in fields(MeshSource)])
    _need(where, table, ("name", "role", "file"))
    with _in(where, "."):
        return MeshSource(**{**table, "file": folder / _text("file", table["file"])})


def _target(i: int, table: Mapping[str, Any]) -> Target:
    where = f"target[{i}]"
    _check_keys(where, table, ("name", "level", "position_mm", "tolerance_mm", "side", "description"))
    _need(where, table, ("name", "position_mm", "tolerance_mm"))
    return Target(
        name=_text(f"{where}.name", table["name"]),
        level=_text(f"{where}.level", table.get("level", "")),
        position=tuple(MM * vector(f"{where}.position_mm", table["position_mm"], 3)),
        tolerance=MM * positive(f"{where}.tolerance_mm", table["tolerance_mm"]),
        side=one_of(f"{where}.side", table.get("side", "middle"), ("left", "right", "middle")),
        description=_text(f"{where}.description", table.get("description", "")),
    )


def _level(i: int, table: Mapping[str, Any]) -> Level:
    where = f"level[{i}]"
    _check_keys(where, table, ("name", "z_low_mm", "z_high_mm", "disc_mm"))
    _need(where, table, ("name", "z_low_mm", "z_high_mm"))
    z = [MM * finite(f"{where}.{key}", table.get(key, 0.0)) for key in ("z_low_mm", "z_high_mm", "disc_mm")]
    if z[0] >= z[1]:
        raise InvalidInput(f"{where}.z_high_mm", table["z_high_mm"], f"> z_low_mm = {table['z_low_mm']}")
    return Level(name=_text(f"{where}.name", table["name"]), z_low=z[0], z_high=z[1], disc=z[2])


def _placing(table: Mapping[str, Any]) -> Placing:
    place = _table(table, "placing")
    _check_keys("placing", place, ("position_mm", "rotation_deg"))
    position = vector("placing.position_mm", place.get("position_mm", [0.0] * 3), 3)
    rotation = vector("placing.rotation_deg", place.get("rotation_deg", [0.0] * 3), 3)
    return Placing(position=tuple(MM * position), rotation=tuple(math.radians(each) for each in rotation))


def _limits(table: Mapping[str, Any]) -> dict[str, Any]:
    factors = {"pressure_limit": ("kpa", 1e3), "cord_indentation_limit": ("mm", MM)}
    keys = {name: f"{name}_{unit}" for name, (unit, _) in factors.items()}
    return {name: factors[name][1] * positive(key, table[key]) for name, key in keys.items() if key in table}


def _numbers(table: Mapping[str, Any]) -> dict[str, Any]:
    found = _table(table, "numbers")
    for key, value in found.items():
        if not key.endswith("_mm"):
            raise InvalidInput(f"numbers.{key}", value, "under a key that ends in _mm")
    return {key.removesuffix("_mm"): value for key, value in found.items()}


def _sources(table: Mapping[str, Any]) -> dict[str, str]:
    known = {f"numbers.{key}": key.removesuffix("_mm") for key in _table(table, "numbers")}
    for key, said in _table(table, "sources").items():
        if key not in known:
            raise InvalidInput(f"sources.{key}", said, "under a key that this file gives, as numbers.cord_width_mm")
        _text(f"sources.{key}", said)
    return {known[key]: said for key, said in _table(table, "sources").items()}


def _parsed(source: str) -> dict[str, Any]:
    try:
        table = tomllib.loads(text_of("phantom", source, "TOML"))
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(source, Fact("unreadable"), f"valid TOML: {error}") from None
    if not table:
        raise InvalidInput(source, Fact("empty"), SHAPE)
    return table


def _check_keys(where: str, table: Mapping[str, Any], known: Sequence[str]) -> None:
    for key, value in table.items():
        if key not in known:
            raise InvalidInput(f"{where}: {key}", value, f"left out, or under one of the keys {', '.join(known)}")


def _need(where: str, table: Mapping[str, Any], keys: Sequence[str]) -> None:
    for key in keys:
        if key not in table:
            raise InvalidInput(f"{where}.{key}", MISSING, "given")


def _table(table: Mapping[str, Any], key: str) -> dict[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InvalidInput(key, value, f"a table, [{key}]")
    return value


def _tables(table: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    value = table.get(key, [])
    if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
        raise InvalidInput(key, value, f"tables, [[{key}]], with two brackets")
    return value


def _text(field: str, value: object) -> str:
    if not isinstance(value, str):
        raise InvalidInput(field, value, "a text in quotes")
    return value


@contextmanager
def _in(where: str, joint: str = ": ") -> Iterator[None]:
    """Errors inside name the place too."""
    try:
        yield
    except InvalidInput as error:
        if error.field.startswith(where):
            raise
        raise InvalidInput(f"{where}{joint}{error.field}", error.value, error.allowed) from None
