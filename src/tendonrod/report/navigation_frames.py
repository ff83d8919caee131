"""Frames of a session as netCDF-4, for animation programs and analysis: `write_frames`, `frames_dataset`."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import complete, file_name
from ..measurement.trialfile import netcdf_bytes
from ..navigate.snapshot import Snapshot

if TYPE_CHECKING:
    import xarray as xr

    from ..plot.course import Course

POINTS = 61  # along the exposed body
_ALONG = ("frame", "point")
_DRIVES = {
    "time": ("s", "of the session"),
    "insertion": ("1", "exposed share of the robot"),
    "exposed_length": ("m", "of the neutral axis, from the outer tube's exit to the tip"),
    "rotation": ("rad", "of the section frame at the exit"),
}


def write_frames(found: Course, path: str | PathLike[str]) -> None:
    """Write `frames_dataset` to ``path`` (.nc), complete or not at all. Raises `InvalidInput`."""
    target = file_name("frames", path, (".nc",))
    dataset = frames_dataset(found)
    numeric = {name: {"_FillValue": None} for name, each in dataset.variables.items() if each.dtype.kind in "fi"}
    content = netcdf_bytes(dataset, numeric)
    with complete("frames", target) as draft:
        draft.write_bytes(content)


def frames_dataset(found: Course) -> xr.Dataset:
    """The frames of ``found`` as a labelled `xarray.Dataset`, SI, world frame; `POINTS` points along the exposed body.

    While the robot is retracted all points lie at the outer tube's exit.
    """
    import xarray as xr

    frames, phantom = found.frames, found.scenario.phantom
    structures, targets = list(found.clearance), list(phantom.targets)
    known = {name: ("frame", [each(now) for now in frames]) for name, each in _drives().items()}
    variables: dict[str, Any] = {name: (*content, _said(*_DRIVES[name])) for name, content in known.items()}
    variables |= {
        "tension": (("frame", "tendon"), [now.posture.tension for now in frames], _said("N", "of each tendon")),
        "arc_length": (_ALONG, _along(frames, lambda now: now.s), _said("m", "from the exit")),
        "centerline": ((*_ALONG, "axis"), _along(frames, lambda now: now.centerline), _said("m", "tube's axis, world")),
        "radius": (_ALONG, _along(frames, lambda now: now.radius), _said("m", "of the tube, outside")),
        "pressure": (_ALONG, _along(frames, lambda now: now.pressure), _said("Pa", "of contact, 0 where free")),
        "clearance": (("frame", "structure", "point"), _clearance(frames, structures),
                      _said("m", "from the tube's wall, negative where it enters")),
        "target_distance": (("frame", "target"), [[now.target_distance[name] for name in targets] for now in frames],
                            _said("m", "from the tip to the target's middle")),
        "reached": (("frame", "target"), _flags([[name in now.reached for name in targets] for now in frames]),
                    _said("1", "1 once the tip was within the tolerance")),
        "in_range": ("frame", _flags([now.in_range for now in frames]), _said("1", "1 where the model holds")),
        "blocked": ("frame", _flags([now.blocked != "" for now in frames]), _said("1", "1 where it refused a command")),
        "exit_pose": (("frame", "row", "column"), [now.tube.pose for now in frames],
                      _said("1, m in the last column", "T_world_exit of the outer tube, z along it")),
        "target_position": (("target", "axis"), np.reshape([t.position for t in phantom.targets.values()], (-1, 3)),
                            _said("m", "world")),
        "target_tolerance": ("target", [t.tolerance for t in phantom.targets.values()], _said("m", "")),
    }  # fmt: skip
    places = {"axis": list("xyz"), "structure": structures, "target": targets}
    coordinates = {name: (name, _texts(each)) for name, each in places.items()}
    return xr.Dataset(variables, coords=coordinates, attrs=_facts(found))


def _drives() -> dict[str, Callable[[Snapshot], float]]:
    return {
        "time": lambda now: now.time,
        "insertion": lambda now: now.insertion,
        "exposed_length": lambda now: now.exposed,
        "rotation": lambda now: now.rotation,
    }


def _said(units: str, text: str) -> dict[str, str]:
    return {"units": units, "long_name": text} if text else {"units": units}


def _along(frames: tuple[Snapshot, ...], of: Callable[[Snapshot], np.ndarray]) -> np.ndarray:
    """(frames, POINTS, ...) at even shares of the exposed length."""
    return np.array([_resampled(now.s, of(now)) for now in frames])


def _resampled(s: np.ndarray, values: np.ndarray) -> np.ndarray:
    at = np.linspace(0.0, float(s[-1]), POINTS)
    columns = values.reshape(len(s), -1).T
    return np.stack([np.interp(at, s, column) for column in columns], axis=-1).reshape(POINTS, *values.shape[1:])


def _clearance(frames: tuple[Snapshot, ...], names: list[str]) -> np.ndarray:
    return np.array([[_resampled(now.s, now.clearance[name]) for name in names] for now in frames])


def _flags(values: list) -> np.ndarray:
    return np.array(values, dtype=np.int8)


def _texts(values: list[str]) -> np.ndarray:
    return np.array(values, dtype=object)


def _facts(found: Course) -> dict[str, str]:
    from .. import __version__

    scenario = found.scenario
    return {
        "title": f"{scenario.robot.name} in {scenario.phantom.name}",
        "frame": "x dorsal, y the patient's right, z towards the head, prone; origin on the cord's axis",
        "robot": scenario.robot.name,
        "phantom": scenario.phantom.name,
        "source": f"tendonrod {__version__}",
    }
