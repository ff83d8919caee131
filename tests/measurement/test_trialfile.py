"""Trials on file: every field comes back to the last bit, and a file that is no whole trial gets one line."""

import os
import subprocess
import sys
import warnings
from dataclasses import fields, replace
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray as xr

from measurement.trials import some_robot, some_trial
from tendonrod import InvalidInput, PlainRod, Robot
from tendonrod.measurement.trial import Tracker, Trial
from tendonrod.measurement.trialfile import FATES, from_dataset, read_trial, to_dataset, write_trial
from tendonrod.tendon import Tendon

ROD = Robot(name="rod", body=PlainRod(length=0.1, radius=1e-3, youngs_modulus=2e11, shear_modulus=8e10, density=8e3))
LEAST = Trial(name="least", robot=ROD, trackers=(Tracker(name="t"),), time=[0.0], position=np.zeros((1, 1, 3)))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "trial.nc"


def assert_same(a: Trial, b: Trial) -> None:
    for name in (each.name for each in fields(Trial)):
        first, second = getattr(a, name), getattr(b, name)
        if isinstance(first, np.ndarray) and first.dtype == object:
            assert first.tolist() == second.tolist(), name
        elif isinstance(first, np.ndarray):
            assert (first.shape, first.tobytes()) == (second.shape, second.tobytes()), name
        else:
            assert first == second, name
    assert a.robot.sources == b.robot.sources


def refused(call, *arguments) -> str:
    with pytest.raises(InvalidInput) as error:
        call(*arguments)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    "trial",
    [
        some_trial(),
        LEAST,
        replace(LEAST, position=[[[-0.0, 5e-324, 1e300]]], time=[np.nan], insertion=np.nan, quality_limit=0.0),
        some_trial(notes="", origin={}, T_world_field=None, quality_limit=None, tension_noise=None, state=None),
        some_trial(name="ein µ-Versuch 試験", notes='"\\\n\t', origin={"": "empty key", "NUL": "\0", "half": "\ud83d"}),
        some_trial().rows(slice(3, 8)),
    ],
    ids=["some", "least", "odd numbers", "unknowns", "texts", "rows"],
)
def test_every_field_to_the_last_bit(path, trial):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_trial(trial, path)
        again = read_trial(path)
    assert_same(again, trial)
    assert_same(from_dataset(to_dataset(trial)), trial)
    assert (again.fates == trial.fates).all()


def test_a_robot_of_many_points(path):
    """Its text is longer than the 64 KiB that HDF5 once allowed an attribute."""
    s = np.linspace(0.0, 0.1, 4000)
    robot = replace(ROD, tendons=(Tendon.sampled(s, 1e-3 * np.cos(30.0 * s), 1e-3 * np.sin(30.0 * s)),))
    trial = replace(LEAST, robot=robot, tensions=[[0.3]], displacements=None)
    write_trial(trial, path)
    assert_same(read_trial(path), trial)


def test_others_see_units_names_and_fates(path):
    trial = some_trial()
    write_trial(trial, path)
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset.position.dims == ("sample", "tracker", "axis")
        assert dataset.position.sel(tracker="tip", axis="y").values.tobytes() == trial.position[:, 2, 1].tobytes()
        meanings = dataset.fate.attrs["flag_meanings"].split()
        assert dataset.fate.attrs["flag_values"].tolist() == list(range(len(meanings)))
        told = [[meanings[code].replace("_", " ") for code in row] for row in dataset.fate.values]
        assert told == trial.fates.tolist()
        for name, each in dataset.data_vars.items():
            assert each.attrs["long_name"], name
            assert name in ("state", "fate", "tracker_on") or each.attrs["units"], name


def test_every_fate_has_a_number():
    from tendonrod.measurement import trial as words

    texts = {value for name, value in vars(words).items() if name.isupper() and isinstance(value, str)}
    assert set(FATES) == texts - {words.ROBOT, words.BASE}


def test_fates_on_file_are_not_believed():
    dataset = to_dataset(some_trial())
    dataset["fate"][:] = 0
    assert (from_dataset(dataset).fates == some_trial().fates).all()


def test_order_of_dimensions_and_labels_is_free():
    """MATLAB turns the dimensions round; others put the scalar of a quaternion last."""
    dataset = to_dataset(some_trial()).isel(quaternion=[1, 2, 3, 0], axis=[2, 0, 1]).transpose(..., "sample")
    assert_same(from_dataset(dataset), some_trial())


def test_a_small_file_of_another_program(path):
    """Single precision, no labels, characters for texts, one insertion; no more than is needed."""
    trial = some_trial()
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"sample": 12, "tracker": 3, "axis": 3, "tendon": 2, "letter": 8}
        robot = to_dataset(trial).attrs["robot"]
        for name, text in {"tendonrod_format": "trial 1", "name": "theirs", "notes": "", "robot": robot}.items():
            file.attrs[name] = text
        file.create_variable("time", ("sample",), data=np.arange(12, dtype=np.int32))
        file.create_variable("position", ("axis", "tracker", "sample"), data=trial.position.T.astype("f4"))
        tensions = trial.tensions.T.copy()
        tensions[0, 3] = -1.0
        file.create_variable("tensions", ("tendon", "sample"), data=tensions, fillvalue=-1.0)
        file.create_variable("insertion", (), data=0.5)
        names = np.array([list(f"{name:8}") for name in ("base", "mid", "tip")], dtype="S1")
        file.create_variable("tracker", ("tracker", "letter"), data=names)
    found = read_trial(path)
    assert [each.name for each in found.trackers] == ["base", "mid", "tip"]
    assert found.trackers[0] == Tracker(name="base")
    assert np.array_equal(found.position, trial.position.astype("f4"), equal_nan=True)
    assert np.isnan(found.tensions[3, 0])
    assert found.tensions[4].tolist() == trial.tensions[4].tolist()
    assert found.insertion.tolist() == [0.5] * 12
    assert (found.notes, found.state[2, 2], found.T_world_field) == ("", "", None)


def bad_dataset(change) -> str:
    dataset = to_dataset(some_trial())
    return refused(from_dataset, change(dataset), "my.nc")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.drop_vars("time"), "my.nc: time = missing: must be a variable of dimensions (sample)"),
        (lambda d: d.drop_vars("tracker"), "my.nc: tracker = missing"),
        (lambda d: d.isel(axis=0), "my.nc: position = (sample, tracker): must be of dimensions (sample, t"),
        (lambda d: d.isel(axis=[0, 1]), "my.nc: axis = of length 2: must be of length 3"),
        (lambda d: d.rename(sample="frame"), "my.nc: time = (frame): must be of dimensions (sample)"),
        (lambda d: d.assign(time=d.time.astype(str)), "my.nc: time = of type <U"),
        (lambda d: d.assign(state=d.quality), "my.nc: state = of type float64: must be texts"),
        (lambda d: d.assign(quality=-d.quality), "my.nc: quality[0][0] = -"),
        (lambda d: d.assign(tracker_mass=-1.0 - d.tracker_mass), "my.nc: tracker_mass[0] = -1.0: must be >= 0"),
        (lambda d: d.assign(tracker_on=d.tracker_on + 7), "my.nc: tracker_on[0] = 8.0: must be 0 on the robot"),
        (lambda d: d.assign_coords(axis=["x", "y", "w"]), "my.nc: axis = ['x', 'y', 'w']: must be the labels x, y, z"),
        (lambda d: d.assign_coords(tracker=["a", "b", "a"]), "my.nc: trackers = "),
        (lambda d: d.drop_attrs(), "my.nc: tendonrod_format = missing: must be given"),
        (lambda d: d.assign_attrs(name=3), "my.nc: name = 3: must be a text"),
        (lambda d: d.assign_attrs(origin="[1]"), "my.nc: origin = '[1]': must be a JSON object"),
        (lambda d: d.assign_attrs(origin='{"a": 1}'), "my.nc: origin = "),
        (lambda d: d.assign_attrs(robot="name = 3"), "my.nc: robot"),
        (lambda d: d.assign_attrs(robot="name = "), "my.nc: robot, line 1 = "),
        (lambda d: d.assign_attrs(robot_exact='{"tube.length_mm": 0.1}'), "my.nc: robot_exact: tube.length_mm = 0.1"),
        (lambda d: d.assign_attrs(tendonrod_format="trial 2"), "my.nc: tendonrod_format = 'trial 2': must be 'tri"),
        (lambda d: d.assign_attrs(tendonrod_format="plan 1"), "my.nc: tendonrod_format = 'plan 1': must be 'trial 1'"),
        (lambda d: d.time, "my.nc = "),
    ],
)  # fmt: skip
def test_bad_datasets_by_name(change, said):
    assert bad_dataset(change).startswith(said)


CONTENTS = [b"", b"time,tension\n0,1\n", b"CDF\x01" + bytes(100), b"\x89HDF\r\n\x1a\n" + bytes(90)]


@pytest.mark.parametrize("content", CONTENTS, ids=["empty", "CSV", "netCDF-3", "cut short"])
def test_files_that_are_no_trial(path, content):
    path.write_bytes(content)
    said = refused(read_trial, path)
    assert said.startswith(f"trial file = {path}")
    assert "must be a netCDF-4 file of a trial" in said


def test_files_that_cannot_be_read(tmp_path, path):
    assert "must be an existing netCDF file" in refused(read_trial, path)
    assert "must be a readable file: Is a directory" in refused(read_trial, tmp_path)
    assert "must be the path of a netCDF file" in refused(read_trial, 3)
    with h5py.File(path, "w") as file:
        file["time"] = [1.0, 2.0]
    assert refused(read_trial, path).startswith(f"{path}: tendonrod_format = missing")


def test_damaged_files_get_one_line_and_no_other_numbers(path, capfd):
    """Cut short, or with bytes changed: one line, nothing on standard error, or the very samples of the trial."""
    trial = some_trial()
    write_trial(trial, path)
    whole, rng = path.read_bytes(), np.random.default_rng(1)
    for i in range(60):
        data = bytearray(whole[: rng.integers(8, len(whole))] if i % 3 == 0 else whole)
        for at in rng.integers(8, len(data), size=20):
            data[at] ^= 0xFF
        path.write_bytes(data)
        try:
            found = read_trial(path)
        except InvalidInput as error:
            assert "\n" not in str(error)  # noqa: PT017
        else:
            assert found.position.tobytes() == trial.position.tobytes()
    assert capfd.readouterr().err == ""


def test_written_complete_or_not_at_all(tmp_path, path, monkeypatch):
    write_trial(some_trial(), path)
    before = path.read_bytes()

    def fail(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fail)
    assert refused(write_trial, LEAST, path).endswith("must be writable: No space left on device")
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("trial", "said"),
    [
        (3, "trial = 3: must be a Trial"),
        (replace(LEAST, name="a\0b"), "name = 'a\\x00b': must be text that a file can hold"),
        (replace(LEAST, state=[["half \ud83d"]]), "state = "),
        (replace(LEAST, robot=replace(ROD, sources={"length": "a ruler"})), "robot: sources.length = 'a ruler'"),
    ],
)
def test_what_a_file_cannot_hold_by_name(path, trial, said):
    assert refused(write_trial, trial, path).startswith(said)
    assert not path.exists()
    assert "must be a file name that ends in .nc" in refused(write_trial, LEAST, path.with_suffix(".csv"))


def test_the_robot_stays_readable_as_text():
    from tendonrod.robotfile_writing import robot_text

    assert to_dataset(some_trial()).attrs["robot"] == robot_text(some_robot())


def test_a_full_disk_is_an_error_in_one_line(path):
    """A limit on the size of files stands for the disk; in a process of its own, which HDF5 might take down."""
    pytest.importorskip("resource")
    program = (
        "import resource, sys\n"
        "from measurement.trials import some_trial\n"
        "from tendonrod import InvalidInput\n"
        "from tendonrod.measurement.trialfile import write_trial\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "try:\n    write_trial(some_trial(), sys.argv[1])\n"
        "except InvalidInput as error:\n    print(error)\n"
    )
    where = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", program, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, env=where, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"trial file = '{path}': must be writable: ")
    assert done.stdout.count("\n") == 1
    assert list(path.parent.iterdir()) == []
