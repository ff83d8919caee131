"""Writing CSV files: nothing is lost, neither of the trial nor of what stands beside the file."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.trials import some_trial
from tendonrod.errors import InvalidInput
from tendonrod.measurement.columnmap import read_column_map
from tendonrod.measurement.csvfile import read_csv, write_csv
from tendonrod.measurement.loading import load_trials
from tendonrod.measurement.trial import SAMPLED, Tracker


@pytest.fixture
def file(tmp_path):
    """Path of a file with this text."""

    def write(text: str, name: str = "bench.csv") -> str:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def test_what_another_hand_wrote_is_not_replaced(file, tmp_path):
    trial, path = some_trial(), tmp_path / "lab.csv"
    for name in ("lab.toml", "lab-robot.toml"):
        file("# mine\n", name)
        with pytest.raises(InvalidInput, match=rf"lab.csv: must be of another name: {name}, .*not written by tend"):
            write_csv(trial, path)
        assert [each.name for each in tmp_path.iterdir()] == [name]
        (tmp_path / name).unlink()
    write_csv(trial, path)
    written = [each.read_text(encoding="utf-8") for each in sorted(tmp_path.iterdir())]
    write_csv(trial, path)  # its own may be
    assert [each.read_text(encoding="utf-8") for each in sorted(tmp_path.iterdir())] == written
    assert len(written) == 3


def test_trackers_whose_columns_would_be_the_same_are_refused(file, tmp_path):
    alike = (Tracker(name="A b", at=0.03), Tracker(name="a_b"))
    text = "time_s,tension_N,a_b_x_mm,a_b_y_mm,a_b_z_mm\n0,0.5,1,2,70\n"
    said = r"trackers = \['A b', 'a_b'\]: must be of names whose columns differ; a_b_x, a_b_y and so on"
    with pytest.raises(InvalidInput, match=said):
        read_csv(file(text), robot="exonav-1", trackers=alike)
    toml = '[[trackers]]\nname = "A b"\nat_mm = 3\nx = "p"\n[[trackers]]\nname = "a_b"\nx = "q"\n'
    with pytest.raises(InvalidInput, match=f"map.toml: {said}"):
        read_column_map(file(toml, "map.toml"))
    trial = replace(
        read_csv(file(text), robot="exonav-1"),
        trackers=alike,
        position=np.zeros((1, 2, 3)),
        orientation=None,
        quality=None,
        state=None,
    )
    with pytest.raises(InvalidInput, match=said):
        write_csv(trial, tmp_path / "alike.csv")
    assert not (tmp_path / "alike.csv").exists()
    with pytest.raises(InvalidInput, match="must be of names with a letter or a digit"):
        write_csv(replace(trial, trackers=(Tracker(name="*"), Tracker(name="tip"))), tmp_path / "none.csv")


def test_a_sample_of_which_nothing_is_known_is_a_row_too(file, tmp_path):
    text, path = "time_s,tension_N,tip_x_mm,tip_y_mm,tip_z_mm\n0,0.5,1,2,70\n-,,,,\n", tmp_path / "out.csv"
    unknown = {"insertion": np.array([1.0, np.nan]), "rotation": np.array([0.0, np.nan])}
    trial = read_csv(file(text), robot="exonav-1", **unknown)
    write_csv(trial, path)
    (again,) = load_trials(path)
    for name in SAMPLED:
        one, other = getattr(trial, name), getattr(again, name)
        assert np.all((one == other) | ((one != one) & (other != other))), name
