"""Writing scene files: the text that `scenefile` reads back, from the place of the exit and loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING as NO_DEFAULT
from dataclasses import fields
from os import PathLike
from typing import Any

import numpy as np

from .errors import InvalidInput, numbers
from .loads import DistributedLoad, Load, LumpedMass, PointLoad
from .robotfile_writing import file_number, toml, write_text
from .rotation import exp_so3, log_so3
from .scenefile import DistributedTable, MassTable, PointTable

_TABLES = {
    PointLoad: ("point", PointTable),
    LumpedMass: ("mass", MassTable),
    DistributedLoad: ("distributed", DistributedTable),
}


def scene_text(*, exit_pose: np.ndarray | None = None, loads: Sequence[Load] = (), comments: Sequence[str] = ()) -> str:
    """The scene file of an exit at ``exit_pose`` (4, 4; world, m) with ``loads``; ``comments`` are lines on top.

    `read_scene` gives the same to rounding (1e-12): the loads as points, masses, distributed ones, and no exit pose for
    the identity. Raises `InvalidInput` for what is no rigid motion or no load.
    """
    document: dict[Any, Any] = {"exit": _exit(np.eye(4) if exit_pose is None else exit_pose)}
    for i, load in enumerate(loads):
        if type(load) not in _TABLES:
            raise InvalidInput(f"loads[{i}]", load, "a PointLoad, a LumpedMass or a DistributedLoad")
        tables = document.setdefault(_TABLES[type(load)][0], {})
        tables[len(tables)] = _load(load)
    return toml(document, comments)


def write_scene(
    path: str | PathLike[str],
    *,
    exit_pose: np.ndarray | None = None,
    loads: Sequence[Load] = (),
    comments: Sequence[str] = (),
) -> None:
    """Write `scene_text` to ``path`` (.toml), complete or not at all. Raises `InvalidInput`."""
    write_text("scene file", path, scene_text(exit_pose=exit_pose, loads=loads, comments=comments))


def _exit(exit_pose: np.ndarray) -> dict[str, list[float]]:
    allowed = "a (4, 4) array: a rotation, a translation and the last row 0 0 0 1"
    given = numbers("exit_pose", exit_pose, 2)
    if given.shape != (4, 4):
        raise InvalidInput("exit_pose", exit_pose, allowed)
    turn, read_back = log_so3(_rotation(given[:3, :3], allowed)), np.eye(4)
    read_back[:3, :3], read_back[:3, 3] = exp_so3(turn), given[:3, 3]
    if not np.allclose(read_back, given, rtol=0.0, atol=1e-8):
        raise InvalidInput("exit_pose", exit_pose, allowed)
    values = {"position_mm": given[:3, 3], "rotation_deg": turn}
    return {key: file_number(key, (value + 0.0).tolist()) for key, value in values.items()}


def _rotation(R: np.ndarray, allowed: str) -> np.ndarray:
    """``R``, where SciPy takes it for a matrix of a rotation."""
    if not np.linalg.det(R) > 0.0:
        raise InvalidInput("exit_pose", R, allowed)
    return R


def _load(load: Load) -> dict[str, Any]:
    """Key -> value of all that is no default."""
    said = {}
    known = {each.name: each.default for each in fields(load)}
    for key in _TABLES[type(load)][1].model_fields:
        name = max((each for each in known if key == each or key.startswith(f"{each}_")), key=len)
        value = getattr(load, name)
        if known[name] is NO_DEFAULT or value != known[name]:
            said[key] = file_number(key, value)
    return said
