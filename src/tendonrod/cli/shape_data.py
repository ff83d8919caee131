"""A shape, what acted on it and its derivatives as plain numbers for JSON; SI units."""

from __future__ import annotations

from dataclasses import fields
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..scenefile import Scene
    from ..statics.contact import Contacts
    from ..statics.derivatives import Jacobian
    from ..statics.shape import Shape

LOADS = {
    "gravity": "m/s2",
    "tip_force": "N",
    "tip_moment": "N m",
    "distributed_force": "N/m",
    "distributed_moment": "N",
}
BODY_UNITS = {
    **dict.fromkeys(("s", "position", "centerline", "tip", "tendon_path", "length", "error_estimate"), "m"),
    **dict.fromkeys(("insertion", "rotation", "v"), "1"),
    "u": "1/m",
    **dict.fromkeys(("force", "tensions"), "N"),
    "moment": "N m",
    "contacts": {
        **dict.fromkeys(("s", "point", "gap"), "m"),
        **dict.fromkeys(("force", "total"), "N"),
        "normal": "1",
        "line_force": "N/m",
        "pressure": "Pa",
    },
}
UNITS = {
    **BODY_UNITS,
    **LOADS,
    "base_rotation": "rad",
    "displacements": "m",
    **dict.fromkeys(("scene", "jacobian", "tip_compliance"), "SI"),
}
_ARRAYS = ("s", "position", "centerline", "rotation", "v", "u", "force", "moment", "tip")
_OF_CONTACTS = ("s", "point", "normal", "gap", "line_force", "force", "pressure", "total")


def as_dict(solved: Shape) -> dict[str, Any]:
    """A shape as plain numbers, SI, keys as the attributes; tendon_path has one list per tendon."""
    return {
        "robot": solved.robot.name,
        "torsion": solved.robot.torsion,
        "tensions": solved.tensions.tolist(),
        "insertion": solved.insertion,
        "length": solved.length,
        "converged": solved.converged,
        "status": str(solved.status),
        "residual": solved.residual,
        "iterations": solved.iterations,
        "error_estimate": solved.error_estimate if isfinite(solved.error_estimate) else None,
        "warnings": list(solved.warnings),
        **{name: getattr(solved, name).tolist() for name in _ARRAYS},
        "tendon_path": [solved.tendon_path(i).tolist() for i in range(solved.robot.n_tendons)],
        "contacts": None if solved.contacts is None else _contacts(solved.contacts),
    }


def scene_dict(scene: Scene) -> dict[str, Any] | None:
    """What a scene file says, None for none."""
    if not scene.name:
        return None
    loads = [{"name": name, **_numbers(load)} for name, load in zip(scene.names, scene.loads, strict=True)]
    return {
        "file": scene.name,
        "loads": loads,
        "exit_pose": None if scene.exit_pose is None else scene.exit_pose.tolist(),
        "exit_tilt": scene.exit_tilt,
        "exit_offset": scene.exit_offset,
        "surfaces": [{"type": type(each).__name__.lower(), **_numbers(each)} for each in scene.surfaces],
        "contact_tolerance": scene.contact_tolerance,
    }


def jacobian_dict(found: Jacobian) -> dict[str, Any]:
    """The derivatives at every section, names and arrays as in `Jacobian`."""
    arrays = ("s", "position", "rotation", "v", "u", "tensions")
    return {"names": list(found.names), **{name: getattr(found, name).tolist() for name in arrays}}


def _contacts(found: Contacts) -> dict[str, Any]:
    values = {name: getattr(found, name).tolist() for name in _OF_CONTACTS}
    return values | {"pressure": [each if isfinite(each) else None for each in values["pressure"]]}


def _numbers(value: Any) -> dict[str, Any]:
    """The public fields of a dataclass, arrays as lists."""
    found = {each.name: getattr(value, each.name) for each in fields(value) if not each.name.startswith("_")}
    return {name: each.tolist() if hasattr(each, "tolist") else each for name, each in found.items()}
