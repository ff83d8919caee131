"""The figure of a task on a bench: its lines are the record's, phases and faults stand where the record has them."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rig.short_trials import bench_file
from tendonrod.cli import main
from tendonrod.plot.bench_task import task_figure
from tendonrod.rig.record import read_record

JUMP = '[[fault]]\nkind = "load cell jumps"\ntime_s = 1\nvalue_n = 0.8\n'


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    """A tension held for half a second, and a try that a fault ended; (path of the figure, record) of each."""

    def one(name, more, status):
        folder = tmp_path_factory.mktemp(name)
        options = ["--bench", str(bench_file(folder, more)), "--figure", str(folder / "a.png")]
        command = ["rig", "hold", "--tension", "0.3", "--duration", "0.5", *options, "--output", str(folder / "o")]
        assert main(command) == status
        return folder / "a.png", read_record(folder / "o" / "hold.rec")

    return {"whole": one("whole", "", 0), "cut": one("cut", JUMP, 1)}


@pytest.mark.parametrize("name", ["whole", "cut"])
def test_the_lines_are_the_records(held, name):
    path, record = held[name]
    assert path.stat().st_size > 10_000
    tension, lengths, turned = task_figure(SimpleNamespace(record=record)).axes
    time = record.time - record.time[0]
    cell, target = tension.get_lines()[:2]
    assert np.array_equal(cell.get_xydata(), np.stack([time, record.samples["force"]["tension"]], axis=1))
    assert np.nanmax(target.get_ydata()) == 0.3
    screw = lengths.get_lines()[1].get_ydata()
    assert screw == pytest.approx(1e3 * record.samples["screw"]["position"])
    assert turned.get_lines()[0].get_ydata() == pytest.approx(np.degrees(record.samples["rotation"]["position"]))


def test_a_fault_stands_where_it_came(held):
    _, record = held["cut"]
    fault = record.faults[0]
    for axes in task_figure(SimpleNamespace(record=record)).axes:
        at = [line.get_xdata() for line in axes.get_lines() if str(line.get_label()) == fault.kind.value]
        assert np.array_equal(at, [[fault.time - record.time[0]] * 2])


def test_phases_that_last_are_named(held):
    _, record = held["whole"]
    names = {text.get_text() for text in task_figure(SimpleNamespace(record=record)).axes[0].texts}
    assert "holding the tension" in names
    assert "done" not in names


def test_a_figure_that_cannot_be_written_is_refused_before_anything_moves(tmp_path):
    command = ["rig", "hold", "--tension", "0.3", "--duration", "0.5", "--output", str(tmp_path / "o")]
    assert main([*command, "--figure", "a.txt"]) == 2
    assert not Path(tmp_path / "o").exists()
