"""Trials on file: one trial is one netCDF-4 file (.nc), which holds every field of `Trial` to the last bit.

Whatever reads netCDF-4 or HDF5 reads it (xarray, MATLAB's ncread, Julia, Panoply), and a file written elsewhere is read
if it keeps to this table. SI units; NaN is what was not measured. Dimensions are known by name, so that their order in
a variable is free (MATLAB turns it round); sample (n), tracker (k) and tendon (T) may be of any length.

================== ========================= ======= =================================================================
variable           dimensions                unit    content
================== ========================= ======= =================================================================
time               sample                    s       needed
position           sample, tracker, axis     m       needed; sensor in the frame of the field; axis: x, y, z
orientation        sample, tracker,          1       of the sensor in the frame of the field; quaternion: w, x, y, z
                   quaternion
quality            sample, tracker           m       the tracker's own error indicator
state              sample, tracker           text    what the tracker said of a frame, "" for nothing amiss
tensions           sample, tendon            N       at the exit
displacements      sample, tendon            m       pulled from slack
insertion          sample, or none           1       exposed share, 0 to 1; 1 where left out
rotation           sample, or none           rad     0 where left out
gravity            axis                      m s-2   world; 0 where left out
T_world_field      row, column               1, m    4 by 4, from the field to the world; left out where not known
quality_limit      none                      m       above which a sample is not used; left out for no limit
position_noise     none                      m       standard deviations, each left out where not known: of each
orientation_noise  none                      rad     coordinate, about each axis, of a tension
tension_noise      none                      N
tracker            tracker                   text    needed; names
tracker_on         tracker                   byte    0 on the robot, 1 on the base; 0 where left out
tracker_at         tracker                   m       s_m along the neutral axis from the robot's base; NaN for the tip
tracker_point      tracker, plane            m       x, y in the section, from the tube's axis; 0 where left out
tracker_offset     tracker, axis             m       of the sensor from that point; 0 where left out
tracker_turn       tracker, axis             rad     rotation vector, sensor in the section; NaN where not known
tracker_mass       tracker                   kg      of tracker and holder; 0 where left out
fate               sample, tracker           byte    which samples are used, and why others are not; written for other
                                                     readers and not read: it follows from the rest
================== ========================= ======= =================================================================

Texts are netCDF strings, or characters along a further last dimension (in MATLAB the first), padded with blanks or NUL.
Where axis, plane or quaternion have a coordinate variable of labels ("x", "y", "z"), these tell the order. Dimensions
of length 0 are left out with what has them. The attributes of the file are texts:

- tendonrod_format: needed, "trial 1".
- name: needed.
- robot: needed, the text of a robot file (TOML), sources and all.
- robot_exact: JSON, key of that file -> SI numbers that no decimal number in the key's unit gives to the last bit.
- notes; origin: JSON, texts by key.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from io import BytesIO
from math import isnan
from os import PathLike, fspath
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Fact, InvalidInput
from ..files import complete, file_name
from ..robot import Robot
from .trial import Tracker, Trial
from .trialfile_tables import EACH, FATES, LABELS, PLACES, SAMPLES, TRACKERS, WHOLE, Values, in_order, mapping, text

if TYPE_CHECKING:
    import xarray as xr

FORMAT, VERSION = "trial", 1
_NO_TRIAL = "a netCDF-4 file of a trial, as write_trial writes it"


def write_trial(trial: Trial, path: str | PathLike[str]) -> None:
    """Write ``trial`` to ``path`` (.nc), complete or not at all.

    Raises `InvalidInput` where the file cannot be written, or for a robot that no robot file can describe.
    """
    target = file_name("trial file", path, (".nc",))
    dataset = to_dataset(trial)
    numeric = {name: each for name, each in dataset.variables.items() if each.dtype.kind in "fi"}
    plain = {name: {"_FillValue": None, "fletcher32": bool(each.dims)} for name, each in numeric.items()}
    content = netcdf_bytes(dataset, plain)
    with complete("trial file", target) as draft:
        draft.write_bytes(content)


def netcdf_bytes(dataset: xr.Dataset, encoding: dict[Any, Any]) -> bytes:
    """The file's bytes, made in memory: HDF5 takes the process down where it closes a file on a disk that is full."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    buffer = BytesIO()
    with h5netcdf.File(buffer, "w") as file:
        dataset.dump_to_store(H5NetCDFStore(file), encoding=encoding)  # pyright: ignore[reportArgumentType]
    return buffer.getvalue()


def read_trial(path: str | PathLike[str]) -> Trial:
    """The trial on file. Raises `InvalidInput` that names the file, the variable and what is allowed."""
    import h5py
    import xarray as xr

    if not isinstance(path, (str, PathLike)):
        raise InvalidInput("trial file", path, "the path of a netCDF file")
    name = fspath(path)
    _check_readable(name)
    try:
        with h5py.File(name, "r") as file:
            file.visititems(lambda *_: None)  # h5netcdf prints a traceback where this fails
        with xr.open_dataset(name, engine="h5netcdf", **_AS_STORED) as dataset:
            dataset.load()
    except _BROKEN as error:
        reason = str(error).strip().partition("\n")[0]
        raise InvalidInput("trial file", Fact(name), f"{_NO_TRIAL}, whole; it cannot be read: {reason}") from None
    return from_dataset(dataset, name)


_AS_STORED: dict[str, Any] = {"decode_times": False, "decode_timedelta": False, "phony_dims": "access"}
# What h5py, h5netcdf and xarray raise for a damaged file, and for an HDF5 file that is no netCDF.
_BROKEN = (OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError, MemoryError)


def _check_readable(name: str) -> None:
    try:
        with open(name, "rb") as file:
            start = file.read(8)
    except (FileNotFoundError, ValueError):
        raise InvalidInput("trial file", Fact(name or "''"), "an existing netCDF file") from None
    except OSError as error:
        raise InvalidInput("trial file", Fact(name), f"a readable file: {error.strerror}") from None
    if start != b"\x89HDF\r\n\x1a\n":
        what = f"{name}, netCDF-3" if start.startswith(b"CDF") else name
        raise InvalidInput("trial file", Fact(what if start else f"{name}, empty"), _NO_TRIAL)


def to_dataset(trial: Trial) -> xr.Dataset:
    """``trial`` as a labelled `xarray.Dataset`, as the file holds it. Raises `InvalidInput` as `write_trial` does."""
    import xarray as xr

    if not isinstance(trial, Trial):
        raise InvalidInput("trial", trial, "a Trial")
    tables = {name: (*place, getattr(trial, name)) for name, place in (SAMPLES | WHOLE).items()}
    tables |= {f"tracker_{name}": (*place, _of_trackers(trial, name)) for name, place in TRACKERS.items()}
    known = {name: each for name, each in tables.items() if each[3] is not None and np.size(each[3])}
    variables: dict[str, Any] = {
        name: (dims, np.array(values, dtype=float), {"units": unit, "long_name": said})
        for name, (dims, unit, said, values) in known.items()
    }
    variables["state"] = (EACH, _storable("state", trial.state), {"long_name": "what the tracker said of the frame"})
    variables |= _flags(trial)
    names = {"tracker": _storable("trackers", [each.name for each in trial.trackers]), **_labels()}
    return xr.Dataset(variables, coords=names, attrs=_attributes(trial))


def _of_trackers(trial: Trial, name: str) -> np.ndarray:
    """(k, ...) field ``name`` of the trackers, NaN for None."""
    missing = (np.nan,) * 3 if name == "turn" else np.nan
    values = [getattr(each, name) for each in trial.trackers]
    return np.array([missing if each is None else each for each in values], dtype=float)


def _labels() -> dict[str, Any]:
    return {name: (name, np.array(labels, dtype=object)) for name, labels in LABELS.items()}


def _flags(trial: Trial) -> dict[str, Any]:
    """Choices as numbers with their meaning, as the CF conventions have it."""
    on = [PLACES.index(each.on) for each in trial.trackers]
    fate = np.array([FATES.index(each) for each in trial.fates.flat]).reshape(trial.fates.shape)
    return {
        "tracker_on": (("tracker",), np.array(on, dtype=np.int8), _meaning("what carries the tracker", PLACES)),
        "fate": (EACH, fate.astype(np.int8), _meaning("whether the sample is used, or why not", FATES)),
    }


def _meaning(said: str, choices: tuple[str, ...]) -> dict[str, Any]:
    values = np.arange(len(choices), dtype=np.int8)
    return {"long_name": said, "flag_values": values, "flag_meanings": " ".join(c.replace(" ", "_") for c in choices)}


def _attributes(trial: Trial) -> dict[str, str]:
    from ..robotfile_writing import robot_text, rounded_in_file

    exact = rounded_in_file(trial.robot)
    texts = {
        "Conventions": "CF-1.11",
        "tendonrod_format": f"{FORMAT} {VERSION}",
        "name": trial.name,
        "robot": robot_text(trial.robot),
        "robot_exact": json.dumps(exact) if exact else "",
        "notes": trial.notes,
        "origin": json.dumps(dict(trial.origin)) if trial.origin else "",
    }
    return {name: str(_storable(name, [text])[0]) for name, text in texts.items() if text}


def _storable(field: str, texts: Any) -> np.ndarray:
    """``texts`` as an array of them. Raises `InvalidInput` for those that HDF5 cannot hold."""
    array = np.array(texts, dtype=object)
    for each in set(array.flat):
        if "\0" in each or any("\ud800" <= c <= "\udfff" for c in each):
            raise InvalidInput(field, each, "text that a file can hold: UTF-8, without the character NUL")
    return array


def from_dataset(dataset: xr.Dataset, where: str = "trial") -> Trial:
    """The trial in a dataset, such as `to_dataset` makes; ``where`` is what errors call it. Raises `InvalidInput`."""
    _check_format(dataset, where)
    values = Values(in_order(dataset, where), where)
    fields: dict[str, Any] = {name: values.numbers(name, dims) for name, (dims, _, _) in (SAMPLES | WHOLE).items()}
    fields |= {"trackers": _trackers(values), "state": values.texts("state", EACH)}
    fields |= {"name": text(dataset, where, "name"), "notes": text(dataset, where, "notes", "")}
    fields |= {"robot": _robot(dataset, where), "origin": mapping(dataset, where, "origin")}
    given = {name: value for name, value in fields.items() if value is not None}
    return _made(where, Trial, given)


def _made(where: str, kind: type, fields: dict[str, Any], words: Mapping[str, str] = MappingProxyType({})) -> Any:
    """A ``kind`` of these fields, errors in the words of the file."""
    try:
        return kind(**fields)
    except InvalidInput as error:
        raise InvalidInput(f"{where}: {words.get(error.field, error.field)}", error.value, error.allowed) from None


def _check_format(dataset: xr.Dataset, where: str) -> None:
    import xarray as xr

    if not isinstance(dataset, xr.Dataset):
        raise InvalidInput(where, dataset, "an xarray.Dataset, as to_dataset makes it")
    said = text(dataset, where, "tendonrod_format")
    kind, _, version = said.partition(" ")
    newer = kind == FORMAT and version.isdecimal() and int(version) > VERSION
    if said != f"{FORMAT} {VERSION}":
        hint = "; a newer tendonrod reads this file" if newer else ""
        raise InvalidInput(f"{where}: tendonrod_format", said, f"'{FORMAT} {VERSION}'{hint}")


def _trackers(values: Values) -> tuple[Tracker, ...]:
    names = values.texts("tracker", ("tracker",))
    on = values.array("tracker_on", ("tracker",))
    fields = {name: values.array(f"tracker_{name}", dims) for name, (dims, _, _) in TRACKERS.items()}
    given = {name: array.tolist() for name, array in fields.items() if array is not None}
    trackers = []
    for j, name in enumerate([] if names is None else names):
        each = {field: None if _unknown(field, rows[j]) else rows[j] for field, rows in given.items()}
        place = 0.0 if on is None else float(on[j])
        if place not in (0.0, 1.0):
            raise InvalidInput(f"{values.where}: tracker_on[{j}]", place, "0 on the robot or 1 on the base")
        each |= {"name": name, "on": PLACES[int(place)]}
        words = {"name": f"tracker[{j}]"} | {field: f"tracker_{field}[{j}]" for field in TRACKERS}
        trackers.append(_made(values.where, Tracker, each, words))
    return tuple(trackers)


def _unknown(field: str, value: Any) -> bool:
    return (field == "at" and isnan(value)) or (field == "turn" and all(map(isnan, value)))


def _robot(dataset: xr.Dataset, where: str) -> Robot:
    from ..robotfile_writing import robot_from_text, with_exact

    robot = robot_from_text(text(dataset, where, "robot"), f"{where}: robot")
    exact = mapping(dataset, where, "robot_exact")
    try:
        return with_exact(robot, exact or {})
    except InvalidInput as error:
        raise InvalidInput(f"{where}: robot_exact: {error.field}", error.value, error.allowed) from None
