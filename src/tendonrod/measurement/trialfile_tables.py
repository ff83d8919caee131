"""The variables of a trial on file, and how they are taken out of a dataset: checked, by name; see `trialfile`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import MISSING, Fact, InvalidInput
from . import trial as fates
from .trial import BASE, ROBOT

if TYPE_CHECKING:
    import xarray as xr

FATES = (  # in the order of their numbers on file
    fates.KEPT,
    fates.MISSING_POSE,
    fates.POOR_QUALITY,
    fates.REPEATED_TIME,
    fates.NO_DRIVE,
    fates.NO_PLACE,
    fates.RETRACTED,
    fates.LEFT_OUT,
)
LABELS = {"axis": ("x", "y", "z"), "plane": ("x", "y"), "quaternion": ("w", "x", "y", "z")}
PLACES = (ROBOT, BASE)
EACH = ("sample", "tracker")
# name: (dimensions, unit, what it is); of a trial's samples, of the trial, of its trackers
SAMPLES = {
    "time": (("sample",), "s", "time"),
    "position": ((*EACH, "axis"), "m", "position of the sensor in the frame of the field"),
    "orientation": ((*EACH, "quaternion"), "1", "orientation of the sensor in the frame of the field"),
    "quality": (EACH, "m", "error indicator of the tracker"),
    "tensions": (("sample", "tendon"), "N", "tension of the tendon at the exit"),
    "displacements": (("sample", "tendon"), "m", "displacement of the tendon, pulled from slack"),
    "insertion": (("sample",), "1", "exposed share of the robot"),
    "rotation": (("sample",), "rad", "rotation of the robot about its base"),
}
WHOLE = {
    "gravity": (("axis",), "m s-2", "gravity in the world"),
    "T_world_field": (("row", "column"), "1", "rigid motion from the field to the world; translation in m"),
    "quality_limit": ((), "m", "error indicator above which a sample is not used"),
    "position_noise": ((), "m", "standard deviation of each coordinate"),
    "orientation_noise": ((), "rad", "standard deviation about each axis"),
    "tension_noise": ((), "N", "standard deviation of a tension"),
}
TRACKERS = {
    "at": (("tracker",), "m", "place along the neutral axis from the robot's base; NaN for the tip"),
    "point": (("tracker", "plane"), "m", "point of the section that the tracker belongs to, from the tube's axis"),
    "offset": (("tracker", "axis"), "m", "offset of the sensor from that point, in the section's frame"),
    "turn": (("tracker", "axis"), "rad", "rotation vector of the sensor's frame in the section's; NaN if not known"),
    "mass": (("tracker",), "kg", "mass of tracker and holder"),
}
ONE_FOR_ALL = ("insertion", "rotation")  # may be one number on file
NEEDED = ("time", "position", "tracker")


class Values:
    """The variables of a dataset, checked: dimensions by name, numbers or texts."""

    def __init__(self, dataset: xr.Dataset, where: str) -> None:
        self.dataset, self.where = dataset, where

    def array(self, name: str, dims: tuple[str, ...]) -> np.ndarray | None:
        """Numbers (float), their axes in the order of ``dims``; None where the variable may be left out and is."""
        found = self._found(name, dims)
        if found is not None and found.dtype.kind not in "fiu":
            raise InvalidInput(f"{self.where}: {name}", Fact(f"of type {found.dtype}"), "numbers")
        return None if found is None else found.astype(float)

    def numbers(self, name: str, dims: tuple[str, ...]) -> np.ndarray | float | None:
        """As `array`, but one number as such: where there are no ``dims``, and one for all samples."""
        if name in ONE_FOR_ALL and name in self.dataset.variables and not self.dataset[name].dims:
            dims = ()
        found = self.array(name, dims)
        return float(found) if found is not None and not dims else found

    def texts(self, name: str, dims: tuple[str, ...]) -> np.ndarray | None:
        """Texts (object), as `array`."""
        found = self._found(name, dims)
        if found is None:
            return None
        texts = [_decoded(each).rstrip(" \0") if isinstance(each, bytes) else each for each in found.flat]
        if not all(isinstance(each, str) for each in texts):
            raise InvalidInput(f"{self.where}: {name}", Fact(f"of type {found.dtype}"), "texts")
        return np.array([str(each) for each in texts], dtype=object).reshape(found.shape)

    def _found(self, name: str, dims: tuple[str, ...]) -> np.ndarray | None:
        if name not in self.dataset.variables:
            if name in NEEDED:
                raise InvalidInput(f"{self.where}: {name}", MISSING, f"a variable of dimensions {_named(dims)}")
            return None
        variable = self.dataset[name].variable
        if set(variable.dims) != set(dims) or len(variable.dims) != len(dims):
            raise InvalidInput(f"{self.where}: {name}", Fact(_named(variable.dims)), f"of dimensions {_named(dims)}")
        return np.asarray(variable.transpose(*dims).values)


def _decoded(characters: bytes) -> str:
    return characters.decode("utf-8", "replace")


def _named(dims: tuple[Any, ...]) -> str:
    return f"({', '.join(map(str, dims))})"


def in_order(dataset: xr.Dataset, where: str) -> xr.Dataset:
    """``dataset`` with axis, plane and quaternion in the order of LABELS, which their own labels tell."""
    for dim, labels in LABELS.items():
        if dim in dataset.dims and dataset.sizes[dim] != len(labels):
            raise InvalidInput(f"{where}: {dim}", Fact(f"of length {dataset.sizes[dim]}"), f"of length {len(labels)}")
        if dim in dataset.dims and dim in dataset.coords:
            given = Values(dataset, where).texts(dim, (dim,))
            order = [] if given is None else given.tolist()
            if sorted(order) != sorted(labels):
                raise InvalidInput(f"{where}: {dim}", order, "the labels " + ", ".join(labels))
            dataset = dataset.isel({dim: [order.index(label) for label in labels]})
    return dataset


def text(dataset: xr.Dataset, where: str, name: str, default: str | None = None) -> str:
    """An attribute of the file."""
    value = dataset.attrs.get(name, default)
    if isinstance(value, bytes):
        value = _decoded(value)
    if value is None:
        raise InvalidInput(f"{where}: {name}", MISSING, "given, a text attribute of the file")
    if not isinstance(value, str):
        raise InvalidInput(f"{where}: {name}", value, "a text")
    return str(value)


def mapping(dataset: xr.Dataset, where: str, name: str) -> Mapping[str, Any] | None:
    """An attribute that holds a JSON object; None where there is none."""
    said = text(dataset, where, name, "")
    try:
        found = json.loads(said) if said else None
    except ValueError:
        found = said
    if found is not None and not isinstance(found, dict):
        raise InvalidInput(f"{where}: {name}", said, "a JSON object")
    return found
