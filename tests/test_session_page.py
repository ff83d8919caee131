"""The page of a session: its numbers are those of the session, it stands alone, and its frames hold what was seen."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from recorded_session import plain_figures, recorded
from tendonrod import InvalidInput
from tendonrod.navigate.metrics import metrics
from tendonrod.plot.course import course
from tendonrod.report.navigation import Told, taken, write_navigation
from tendonrod.report.navigation_frames import POINTS, frames_dataset


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("records") / "session.jsonl")


@pytest.fixture(scope="module")
def page(session, tmp_path_factory):
    scenario, snapshots = session
    told = Told(record="<session>.jsonl", again="Computed again.", command="tendonrod session X --output Y")
    with pytest.MonkeyPatch.context() as patch:
        plain_figures(patch)
        found, _ = write_navigation(iter(snapshots), scenario, tmp_path_factory.mktemp("page"), told, frames=3)
    return found


@pytest.fixture(scope="module")
def text(page):
    return page.read_text(encoding="utf-8")


def rows(page, name):
    return list(csv.DictReader((page.parent / f"{name}.csv").open(encoding="utf-8")))


def value(page, what):
    return float(next(row["value"] for row in rows(page, "metrics") if row[""] == what))


def test_the_tables_are_the_metrics(session, page):
    found = metrics(session[1])
    assert value(page, "duration") == found.duration
    assert value(page, "path of the tip") == pytest.approx(1e3 * found.path)
    assert value(page, "largest contact force at one place") == pytest.approx(1e3 * found.force)
    assert value(page, "least clearance to the canal") == pytest.approx(1e3 * found.clearance["canal"].value)
    assert value(page, "time with a limit exceeded") == pytest.approx(100.0 * found.outside_limits)
    peak = max(each.limits["pressure"].value for each in session[1])
    assert value(page, "highest pressure on soft tissue") == pytest.approx(1e-3 * peak)
    assert json.loads((page.parent / "metrics.json").read_text()) == found.to_dict() | {"units": "SI"}


def test_times_are_those_of_the_record_where_it_began_later(session):
    scenario, snapshots = session
    late, _ = taken([replace(each, time=each.time + 64.0) for each in snapshots], scenario, 3)
    own, _ = taken(snapshots, scenario, 3)
    assert late.time == pytest.approx(own.time)
    assert [time for _, time in late.reached] == pytest.approx([time for _, time in own.reached])
    assert [each.snapshot.time for each in late.moments] == pytest.approx([each.snapshot.time for each in own.moments])


def test_targets_reached_come_first_then_the_near_ones(session, page):
    found = metrics(session[1])
    told = rows(page, "targets")
    names = [row["target"] for row in told]
    assert names[: len(found.targets)] == list(found.targets)
    assert [float(row["reached at (s)"]) for row in told[: len(found.targets)]] == [
        each.time for each in found.targets.values()
    ]
    assert set(names) == set(found.targets) | {name for name, far in found.nearest.items() if far < 10e-3}
    for row in told:
        assert float(row["nearest (mm)"]) == pytest.approx(1e3 * found.nearest[row["target"]])


def test_the_page_says_what_was_reached_and_that_nothing_was_measured(session, text):
    for name in metrics(session[1]).targets:
        assert f"<b>{name}</b>" in text
    assert "no measurement" in text
    assert "engineering choice" in text
    assert "4.8 kPa" in text
    assert "tendonrod session X --output Y" in text


def test_the_page_stands_alone_and_escapes_what_it_is_told(page, text):
    assert "&lt;session&gt;.jsonl" in text
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert all(each.startswith(("data:image/", "#")) or (page.parent / each).is_file() for each in sources)
    assert "data:image/gif;base64," in text
    assert not re.search(r"\{\{|\{%|\bnan\b|None", re.sub(r'"data:[^"]*"', "", text))


def test_everything_lies_beside_it(page):
    names = {each.name for each in page.parent.iterdir()}
    figures = {f"{name}{suffix}" for name in ("scenes", "map", "lines") for suffix in (".png", ".svg")}
    assert names >= figures | {"metrics.json", "frames.nc", "animation.gif", "targets.csv", "scenario.csv"}


def test_frames_hold_what_was_seen(session, page):
    scenario, snapshots = session
    frames = course(snapshots, scenario, 3).frames
    with xr.open_dataset(page.parent / "frames.nc", engine="h5netcdf", decode_timedelta=False) as found:
        found.load()
    assert found.sizes["frame"] == 3
    assert found.sizes["point"] == POINTS
    assert all(each.attrs.get("units") for each in found.data_vars.values())
    for k, now in enumerate(frames):
        here = found.isel(frame=k)
        assert float(here.time) == now.time
        assert np.array_equal(here.centerline[-1], now.tip)
        assert np.allclose(here.exit_pose, now.tube.pose)
        assert float(here.arc_length[-1]) == now.exposed
        gap = here.clearance.sel(structure="cord")
        assert float(gap[-1]) == now.clearance["cord"][-1]
        assert gap.min() >= now.clearance["cord"].min() - 1e-12
        for name, far in now.target_distance.items():
            assert float(here.target_distance.sel(target=name)) == far
    tip = found.centerline.isel(point=-1).values[:, None] - found.target_position.values
    assert np.allclose(np.linalg.norm(tip, axis=-1), found.target_distance)


def test_a_retracted_robot_is_a_point_at_the_exit(session):
    scenario, snapshots = session
    found = frames_dataset(course(snapshots[:3], scenario, 2))
    assert np.array_equal(found.centerline, np.broadcast_to(scenario.tube.position, found.centerline.shape))


def test_without_frames_there_is_neither_movie_nor_netcdf(session, tmp_path, monkeypatch):
    plain_figures(monkeypatch)
    scenario, snapshots = session
    page, _ = write_navigation(snapshots[:25], scenario, tmp_path, frames=0)
    assert not (tmp_path / "animation.gif").exists()
    assert not (tmp_path / "frames.nc").exists()
    assert "<b>No target was reached</b>" in page.read_text(encoding="utf-8")


def test_nothing_is_no_session(session, tmp_path):
    with pytest.raises(InvalidInput, match="snapshots = none"):
        taken([], session[0])
    with pytest.raises(InvalidInput, match="snapshots = none"):
        write_navigation([], session[0], tmp_path / "page")
    assert not (tmp_path / "page").exists()
