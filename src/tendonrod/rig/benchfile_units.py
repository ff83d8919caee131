"""Units of a bench file, at the ends of its keys: to SI, and back for what is said of SI numbers in its words."""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from math import degrees, radians
from typing import Any

from .benchfile_tables import VirtualFile

_ANGLES = ("deg_s2", "deg_s", "deg")
_MILLI = ("mm_s2", "mm_s", "mm", "mn_per_sqrt_s", "mn", "ms", "g")
_PLAIN = ("n_s", "n", "s", "hz", "m_s2", "counts")
_UNITS = sorted((*_ANGLES, *_MILLI, *_PLAIN), key=len, reverse=True)
_ALONE = {  # fields of a `VirtualSetup` that are no table of the file: their keys there
    "slack": "tendon.slack_mm",
    "outer_friction": "outer_tube.friction_n",
    "exit_tilt": "outer_tube.tilt_deg",
}
_NUMBER = r"[-+]?\d[\d.]*(?:e[-+]?\d+)?"


def unit_of(key: str) -> str:
    """mm_s of speed_mm_s, "" where there is none."""
    return next((unit for unit in _UNITS if key.endswith(f"_{unit}")), "")


def flat(key: str) -> str:
    """The name without its unit."""
    unit = unit_of(key)
    return key.removesuffix(f"_{unit}") if unit else key


def to_si(key: str, value: Any) -> Any:
    """``value``, a number or a list of them, as the key's unit has it in SI; other values as they are."""
    return _each(_scaled(-3), radians, key, value)


def in_file_units(field: str, value: Any) -> tuple[str, Any]:
    """(key, value) as a bench file says them of a field of `VirtualSetup`, dotted below one of its parts."""
    key = _keys().get(field, field)
    return key, from_si(key, value)


def in_unit(key: str, allowed: str) -> str:
    """What is allowed of an SI number, in the key's unit: "from 0.001 to 1" is "from 1 to 1000" of a key in ms."""

    def said(number: str) -> str:
        return f"{from_si(key, float(number)):.6g}"

    if ends := re.fullmatch(f"from ({_NUMBER}) to ({_NUMBER})", allowed):
        return f"from {said(ends[1])} to {said(ends[2])}"
    bound = rf"(^(?:[<>]=?|at most|below) |\bscrew\.speed = )({_NUMBER})( m\b| s\b)?"
    return re.sub(bound, lambda found: found[1] + said(found[2]) + (f" {unit_of(key)}" if found[3] else ""), allowed)


def from_si(key: str, value: Any) -> Any:
    """The reverse of `to_si`."""
    return _each(_scaled(3), lambda angle: float(f"{degrees(angle):.9g}"), key, value)


def _each(milli: Callable[[float], float], angle: Callable[[float], float], key: str, value: Any) -> Any:
    unit = unit_of(key)
    if isinstance(value, list):
        return [_each(milli, angle, key, each) for each in value]
    if not unit or isinstance(value, (str, bool)) or value is None:
        return value
    return angle(value) if unit in _ANGLES else milli(value) if unit in _MILLI else float(value)


def _scaled(digits: int) -> Callable[[float], float]:
    """Times 10**digits as on paper, so that 0.45 mm is the float 0.00045."""
    return lambda value: float(Decimal(repr(value)).scaleb(digits))


def _keys() -> dict[str, str]:
    """Field of `VirtualSetup`, dotted below one of its parts, -> key of the file."""
    found = {}
    for table, info in VirtualFile.model_fields.items():
        for key in getattr(info.annotation, "model_fields", ()):
            name = {"tendon": f"tendon_{flat(key)}", "bench": flat(key)}.get(table, f"{table}.{flat(key)}")
            found[name] = f"{table}.{key}"
    return found | _ALONE
