"""The page of bench trials: its numbers are those of the records, and it says what bench they come from."""

import csv
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tendonrod import load_robot
from tendonrod.errors import InvalidInput
from tendonrod.plot.bench_lines import binned, planned_tip, postures, tip_errors
from tendonrod.report import paper
from tendonrod.report.bench import departures, facts, is_papers, trial_names, write_bench
from tendonrod.rig.benches import VirtualSource
from tendonrod.rig.inserted import inserted, way_out
from tendonrod.rig.profiles import Polynomial, Profile, profile
from tendonrod.rig.record_layout import SAMPLE
from tendonrod.rig.trials import follow_leader, reference_of
from tendonrod.rig.virtual.injection import Injection
from tendonrod.rig.virtual.setup import TrackerModel, VirtualSetup, lead_screw

ROBOT = load_robot("exonav-1").replace(torsion="homogenized")
SETUP = VirtualSetup(
    robot=ROBOT, gravity=paper.GRAVITY, screw=lead_screw(speed=5e-3, acceleration=50e-3),
    tracker=TrackerModel(position_noise=1e-3, mass=0.1e-3),
)  # fmt: skip
DEAF = Injection(kind="load cell gives no number", time=0.3)  # pyright: ignore[reportArgumentType]


@pytest.fixture(scope="module")
def follow(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("records"), profile("paper", ROBOT, 0.7, paper.GRAVITY)

    def one(name, setup=SETUP):
        return follow_leader(setup, made, 0.7, folder / f"{name}.rec", screw_rate=3e-3, end=0.15)

    return one


@pytest.fixture(scope="module")
def trial(follow):
    return follow("whole")


@pytest.fixture(scope="module")
def short(follow):
    return follow("short", replace(SETUP, injections=(DEAF,)))


@pytest.fixture(scope="module")
def page(trial, short, tmp_path_factory):
    return write_bench([trial, short], tmp_path_factory.mktemp("page"))


def rows(page, name):
    return list(csv.DictReader((page.parent / f"{name}.csv").open(encoding="utf-8")))


def record(z, target, state="running"):
    samples = np.zeros(len(z), dtype=SAMPLE)
    samples["translation"]["position"], samples["command"]["target"] = z, target
    return SimpleNamespace(samples=samples, states=np.full(len(z), state, dtype=object), time=np.arange(len(z)) * 5e-3)


def test_the_way_out_leaves_out_take_up_and_release():
    rng = np.random.default_rng(1)
    still, way, there = np.full(100, 4e-3), np.linspace(4e-3, 20e-3, 400), np.full(60, 20e-3)
    z = np.concatenate([np.linspace(0, 4e-3, 50), still, way, there]) + rng.uniform(-1e-5, 1e-5, 610)
    target = np.where(np.arange(610) < 50, np.nan, 0.7)
    found = way_out(record(z, target))
    assert abs(found.start - 150) <= 4
    assert abs(found.stop - 550) <= 4
    assert way_out(record(z, np.nan)) == slice(0, 0)
    assert way_out(record(z, target, "fault")) == slice(0, 0)
    assert way_out(record(still, 0.7)) == slice(0, 0)


def test_the_way_out_is_the_phase_of_inserting(trial):
    when = {each.text: each.time for each in trial.record.messages}
    way = inserted(trial)
    assert 0.0 <= way.time[0] - when["inserting"] < 0.3
    assert abs(way.time[-1] - when["settling"]) < 0.5
    assert way.insertion[[0, -1]] == pytest.approx([0.05, 0.15], abs=2e-3)
    assert way.target == pytest.approx(np.polyval(paper.FTL_POLYNOMIAL, way.insertion), abs=1e-3)


def test_errors_of_the_tip_are_those_of_its_frames_on_the_way(trial):
    way, (time, _, tip) = inserted(trial), trial.tip()
    on_it = (time >= way.time[0]) & (time <= way.time[-1])
    assert 0 < on_it.sum() == len(way.tip) < len(time)
    nearest = np.linalg.norm(tip[on_it][:, None] - trial.reference.at(np.linspace(0, 0.03, 20001)), axis=2).min(axis=1)
    assert way.tip_rmse[0] == pytest.approx(np.sqrt(np.mean(nearest**2)), rel=1e-4)
    assert way.tip_rmse[1] >= way.tip_rmse[0]


def test_tension_errors_are_means_over_time(trial):
    way = inserted(trial)
    crowded = np.concatenate([np.linspace(0, 1, 11), np.linspace(1.001, 2, 1000)])
    uneven = replace(way, time=crowded, target=0.7 + 0 * crowded, tension=0.7 - 0.1 * (crowded <= 1.0))
    assert uneven.error_rms == pytest.approx(0.1 * np.sqrt(0.5), rel=1e-2)
    assert uneven.error_max == pytest.approx(0.1)
    assert np.isnan(replace(way, target=np.nan * way.target).error_rms)


def test_without_load_the_model_follows_exactly(trial):
    """A constant tension without gravity: every exposed part is a part of one helix (paper, II-C)."""
    even = Profile(name="even", tension=Polynomial((0.5,)))
    free = replace(
        trial, profile=even, gravity=(0.0, 0.0, 0.0), target=0.5, reference=reference_of(ROBOT, 0.5, (0, 0, 0))
    )
    assert tip_errors(free, *planned_tip(free)).max() < 1e-7


def test_bins_keep_mean_and_extremes():
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, 1, 5000), rng.normal(size=5000)
    y[7] = np.nan
    at, mean, low, high = binned(x, y, 10)
    assert np.all((low < mean) & (mean < high))
    assert (low.min(), high.max()) == (np.nanmin(y), np.nanmax(y))
    counts = np.histogram(x[np.isfinite(y)], np.linspace(x.min(), x.max(), 11))[0]
    assert counts @ mean == pytest.approx(np.nansum(y))
    assert np.all(np.diff(at) > 0.0)
    assert [each.size for each in binned(np.empty(0), np.empty(0))] == [0] * 4


def test_bodies_are_those_of_the_readings(trial):
    way = inserted(trial)
    for insertion, shape in postures(trial, way):
        near = np.abs(way.insertion - insertion).argmin()
        assert shape.length == pytest.approx(insertion * ROBOT.length_na)
        around = np.abs(way.time - way.time[near]) < 0.5
        assert float(np.ravel(shape.tensions)[0]) == pytest.approx(way.tension[around].mean(), abs=5e-3)
        assert shape.centerline[-1] == pytest.approx(way.tip[np.abs(way.tip_insertion - insertion).argmin()], abs=4e-3)


def test_the_page_has_the_numbers_of_the_records(page, trial, short):
    (first, second, *_), (whole, cut) = rows(page, "tip"), rows(page, "trials")
    way = inserted(trial)
    assert [float(first[name]) for name in ("by projection", "at the same insertion")] == pytest.approx(
        [1e3 * each for each in way.tip_rmse]
    )
    assert second["by projection"] == "–"
    assert float(whole["tension error, rms (mN)"]) == pytest.approx(1e3 * way.error_rms)
    assert (whole["ended"], float(whole["lost"])) == ("done", way.lost)
    assert str(short.outcome.fault.kind.value) in cut["ended"]
    printed = [float(row["metric not stated"]) for row in rows(page, "tip")[3:]]
    assert printed == pytest.approx([1e3 * each for each in (*paper.FTL_TIP_RMSE_TRIALS, paper.FTL_TIP_RMSE_SIMULATED)])


def test_the_page_says_what_bench_it_was(page):
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", page.read_text(encoding="utf-8")))
    for said in (
        "This is a virtual bench and no measurement.",
        "none was adjusted to land on the paper’s numbers",
        "Torsion model: homogenized",
        "friction coefficient of the tendon: 0.1; as friction of the robot in the outer tube: 0.05 N",
        "mass of tracker and holder: 0.1 g",
        "screw.speed_mm_s = 5.0",
        "Faults were injected on purpose, in 1 of 2",
        "1 of 2 ran to the end; trial 2: fault: sensor gives no number",
        "trial 2 never set out",
        "3.64, 3.63 and 3.75 mm",
    ):
        assert said in text, said
    names = {f"{name}.{kind}" for name in ("tip", "path", "bodies", "tension", "control") for kind in ("png", "svg")}
    assert {each.name for each in page.parent.iterdir()} == names | {"index.html", "tip.csv", "trials.csv"}


def test_trials_without_a_tracker_have_a_page_without_the_tip(follow, tmp_path):
    blind = follow("blind", replace(SETUP, tracker=None))
    header = blind.record.header | {"virtual": False, "rehearsal": True}
    page = write_bench([replace(blind, record=replace(blind.record, header=header))], tmp_path)
    assert not (tmp_path / "path.png").exists()
    assert (tmp_path / "tension.png").exists()
    text = page.read_text(encoding="utf-8")
    assert "nothing can be said of how well it followed" in text
    assert "This is a rehearsal on an emulated board and no measurement." in text


def test_only_the_papers_case_is_called_the_papers_experiment(trial, short):
    way = [inserted(each) for each in (trial, short)]
    told = facts([trial, short], ["a", "b"], way)
    assert (told["is_papers"], told["set_out"]) == (False, True)  # it ends at 0.15
    whole = replace(trial, record=replace(trial.record, header=trial.record.header | {"end": 1.0}))
    assert facts([whole], ["a"], way[:1])["is_papers"]
    assert not facts([short], ["b"], way[1:])["set_out"]
    assert not is_papers("exonav-3", 0.7, paper.GRAVITY)
    assert not is_papers("exonav-1", 0.7, (0.0, 0.0, 0.0))


def test_departures_name_what_is_not_the_default():
    usual, changed = (VirtualSource(setup=each).known(0)["setup"] for each in (VirtualSetup(robot=ROBOT), SETUP))
    assert departures(usual) == []
    assert departures(changed) == [
        "screw.speed_mm_s = 5.0", "screw.acceleration_mm_s2 = 50.0", "tracker.position_noise_mm = 1.0",
        "tracker.mass_g = 0.1",
    ]  # fmt: skip


def test_trials_that_do_not_belong_together_are_refused(trial, tmp_path):
    with pytest.raises(InvalidInput, match="trials"):
        write_bench([], tmp_path)
    with pytest.raises(InvalidInput, match="of one robot, torsion, target and gravity"):
        write_bench([trial, replace(trial, target=0.45)], tmp_path)
    ahead = replace(trial, record=replace(trial.record, header=trial.record.header | {"feed_forward": True}))
    assert trial_names([trial, ahead]) == ["trial 1 (no feed-forward)", "trial 2 (with feed-forward)"]
