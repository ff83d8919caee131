"""A `Scenario` as data: the header of a record, with all that a replay needs, and the scene file that people write.

A scene file is TOML, and every key may be left out:

    robot = "exonav-1"            # preset, or a robot file
    torsion = "homogenized"       # "" as the robot file says
    phantom = "printed"           # "anatomical", or a phantom file
    levels = "T8-L2"              # of the printed and the anatomical phantom
    entry = "L2"                  # level whose window the outer tube comes through
    gravity_m_per_s2 = [-9.81, 0, 0]
    coupled = true                # insertion turns the motor by the follow-the-leader law
    [tube]                        # what differs from that window's
    height_mm = 0.0               # and offset_mm, depth_mm, tilt_deg, lean_deg
    [limits]
    tension_n = 0.9               # and insertion_percent, rotation_deg, strain_percent, pressure_kpa,
    snap_mm = 2.0                 # by which the robot may jump where its equilibrium ends; 0: such moves are refused
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from decimal import Decimal
from math import degrees, radians
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from ..errors import Fact, InvalidInput, positive, vector, within
from ..files import text_of
from ..robotfile_words import parsed
from ..robotfile_writing import robot_from_text, robot_text, rounded_in_file, with_exact
from .limits import RANGES as STOPS
from .limits import NavigationLimits
from .outer_tube import RANGES, OuterTube
from .scenario import Scenario, load_scenario

THREE = object()
Range = tuple[float, float] | None
LENGTH, ANGLE, PLAIN, PERCENT, KILO = -3, None, 0, -2, 3  # powers of ten to SI; degrees
TUBE_KEYS = {f"{name}_deg" if name in ("tilt", "lean") else f"{name}_mm": name for name in RANGES}
LIMIT_KEYS = {
    "tension_n": ("tension", PLAIN), "insertion_percent": ("insertion", PERCENT), "rotation_deg": ("rotation", ANGLE),
    "strain_percent": ("strain", PERCENT), "pressure_kpa": ("pressure", KILO), "snap_mm": ("snap", LENGTH),
}  # fmt: skip
TABLES = {
    "tube": {key: (name, ANGLE if key.endswith("deg") else LENGTH, RANGES[name]) for key, name in TUBE_KEYS.items()},
    "limits": {key: (name, kind, STOPS.get(name)) for key, (name, kind) in LIMIT_KEYS.items()},
}
KEYS: dict[str, tuple[str, Any, Range]] = {
    "robot": ("robot", str, None), "torsion": ("torsion", str, None), "phantom": ("phantom", str, None),
    "levels": ("levels", str, None), "entry": ("entry", str, None), "coupled": ("coupled", bool, None),
    "gravity_m_per_s2": ("gravity", THREE, None),
    **{name: (name, keys, None) for name, keys in TABLES.items()},
}  # fmt: skip
SHAPE = f"a scene: {', '.join(KEYS)}, as needed"


def scenario_data(scenario: Scenario) -> dict[str, Any]:
    """Plain data from which `scenario_from` makes the same scenario again, to the last bit."""
    phantom = scenario.phantom
    return {
        "robot": robot_text(scenario.robot), "robot_exact": rounded_in_file(scenario.robot),
        "phantom": phantom.source, "levels": phantom.level_range, "phantom_fingerprint": phantom.fingerprint,
        "tube": asdict(scenario.tube), "gravity": list(scenario.gravity), "limits": asdict(scenario.limits),
        "coupled": scenario.coupled,
    }  # fmt: skip


def scenario_from(data: dict[str, Any], name: str) -> Scenario:
    """The scenario of `scenario_data`; ``name`` of the file, for errors. Raises `InvalidInput` also where the phantom
    is another by now.
    """
    from ..anatomy import load_phantom

    phantom = load_phantom(data["phantom"], levels=data["levels"])
    if phantom.fingerprint != data["phantom_fingerprint"]:
        was = Fact(f"phantom {data['phantom']}")
        raise InvalidInput(name, was, "the phantom that the session was recorded with; it has changed since")
    return Scenario(
        robot=with_exact(robot_from_text(data["robot"], f"{name}: robot"), data["robot_exact"]), phantom=phantom,
        tube=OuterTube(**data["tube"]), gravity=tuple(data["gravity"]), limits=NavigationLimits(**data["limits"]),
        coupled=data["coupled"],
    )  # fmt: skip


def read_scenario(path: str | PathLike[str] | None = None, **options: Any) -> Scenario:
    """The scenario of a scene file, all defaults if None. Raises `InvalidInput` by file and key.

    options: robot, torsion, phantom, levels, entry, coupled, which go before the file's where they are not None. Names
    of robot and phantom files are relative to the scene file.
    """
    name = "scene" if path is None else fspath(path)
    found = _values(f"{name}: ", {} if path is None else _table(name), KEYS)
    given = {key: value for key, value in options.items() if value is not None}
    try:
        return load_scenario(**found | given)
    except InvalidInput as error:
        if path is None or error.field in given:  # no word of the file
            raise
        raise InvalidInput(f"{name}: {error.field}", error.value, error.allowed) from None


def robot_named(path: str | PathLike[str]) -> str | None:
    """The preset or file of a scene file's robot, None where it names none; nothing else in it is looked at."""
    robot = _table(fspath(path)).get("robot")
    return None if robot is None else str(robot)


def _table(name: str) -> dict[str, Any]:
    """What stands in a scene file, with names of files from where this program runs."""
    table = parsed(name, text_of("scene", name, "TOML"), SHAPE)
    files = {key: table[key] for key in ("robot", "phantom") if str(table.get(key, "")).endswith(".toml")}
    return table | {key: str(Path(name).parent / file) for key, file in files.items()}


def _values(where: str, table: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """SI values by the names of `load_scenario`; ``where``: what stands before a key in errors."""
    found = {}
    for key, value in table.items():
        if key not in keys:
            raise InvalidInput(f"{where}{key}", Fact("unknown"), f"one of {', '.join(keys)}")
        target, kind, bounds = keys[key]
        found[target] = _value(f"{where}{key}", value, kind, bounds)
    return found


def _value(field: str, value: Any, kind: Any, bounds: Range) -> Any:
    if isinstance(kind, Mapping):
        if not isinstance(value, Mapping):
            raise InvalidInput(field, value, f"a table, [{field.rpartition(' ')[2]}], with {', '.join(kind)}")
        return _values(f"{field}.", value, kind)
    if kind is THREE:
        return tuple(vector(field, value, 3).tolist())
    if isinstance(kind, type):
        if not isinstance(value, kind):
            raise InvalidInput(field, value, "a text in quotes" if kind is str else "true or false")
        return value
    number = positive(field, value) if bounds is None else within(field, value, *(_in_file(kind, x) for x in bounds))
    return radians(number) if kind is ANGLE else float(Decimal(repr(number)).scaleb(kind))


def _in_file(kind: int | None, value: float) -> float:
    """An SI value in the unit of the file."""
    return degrees(value) if kind is ANGLE else float(Decimal(repr(value)).scaleb(-kind))  # pyright: ignore
