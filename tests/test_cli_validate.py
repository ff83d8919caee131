"""`tendonrod validate`: what it prints and writes is what `accuracy` finds; files that make no sense are named."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest

from tendonrod import load_robot, solve
from tendonrod.measurement.accuracy import WITH, WITHOUT, accuracy
from tendonrod.measurement.diagnosis import diagnose
from tendonrod.measurement.trial import BASE, Tracker, Trial
from tendonrod.measurement.trialfile import write_trial
from tendonrod.report.validation import write_validation

ROBOT = load_robot("exonav-3")
GRAVITY = (-9.81, 0.0, 0.0)
TENSIONS = np.linspace(0.1, 0.7, 5)
SHIFT = np.array([-2e-3, 0.5e-3, 0.0])


def moved(name, share, **more):
    """The paper's one tracker at a share of the length, everything shifted, one frame missing."""
    s = share * ROBOT.length_na
    position = np.array([solve(ROBOT, T, GRAVITY, s=[s]).centerline[0] for T in TENSIONS])[:, None] + SHIFT * share
    position[1] = np.nan
    return Trial(
        name=name, robot=ROBOT, trackers=(Tracker(name="sensor", at=s),), time=np.arange(5.0), position=position,
        tensions=TENSIONS, gravity=GRAVITY, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def trials():
    sensor = Tracker(name="sensor", on=BASE, turn=(0.0, 0.0, 0.0))
    base = Trial(
        name="base", robot=ROBOT, trackers=(sensor,), time=np.arange(3.0),
        position=np.zeros((3, 1, 3)), orientation=np.tile([1.0, 0.0, 0.0, 0.0], (3, 1, 1)), gravity=GRAVITY,
    )  # fmt: skip
    return base, moved("half", 0.5), moved("tip", 1.0)


@pytest.fixture(scope="module")
def files(trials, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials")
    for each in trials:
        write_trial(each, folder / f"{each.name}.nc")
    return [str(folder / f"{each.name}.nc") for each in trials]


@pytest.fixture(scope="module")
def page(trials, tmp_path_factory):
    return write_validation(accuracy(trials), tmp_path_factory.mktemp("page"), {"exonav-3": diagnose(trials[1:])})


def test_it_prints_table_1(run, files, trials):
    status, out, err = run("validate", *files)
    assert (status, err) == (0, "")
    found = accuracy(trials)
    assert out.startswith("exonav-3, torsion published: 8 of 10 samples compared")
    for place in found.places:
        still, heavy = (place.errors[each] for each in (WITHOUT, WITH))
        shown = [1e3 * each for each in (still.med, still.rmse, heavy.med, heavy.rmse)]
        shown += [100.0 * heavy.share, 1e3 * np.linalg.norm(heavy.bias), 1e3 * heavy.scatter]
        assert [f"{place.share:g}", "4", *(f"{each:.2f}" for each in shown), "-"] in map(str.split, out.splitlines())
    assert found.places[1].errors[WITH].rmse == pytest.approx(np.linalg.norm(SHIFT), rel=1e-3)
    assert re.search(r"half +sensor +missing pose +1", out)
    assert "base, half, tip: tracker sensor on the base: 3 samples" in out


def test_json_is_the_same_in_si(result, files, trials):
    told, found = result("validate", *files), accuracy(trials)
    assert [each["torsion"] for each in told["robots"]] == ["published"]
    for place, each in zip(told["places"], found.places, strict=True):
        assert (place["at"], place["n"]) == (each.at, 4)
        assert place["gravity_modelled"]["rmse"] == pytest.approx(each.errors[WITH].rmse, rel=1e-9)
        assert place["gravity_modelled"]["angle_rms"] is None
    assert told["trials"][1]["fates"] == {"sensor": {"kept": 4, "missing pose": 1}}
    assert told["trials"][2]["T_world_field"] == np.eye(4).tolist()


def test_it_says_why(result, files):
    """A shift that grows along the robot looks as a tilted base, and as little else does."""
    why = result("validate", *files)["why"]["exonav-3"]
    best, second = why["alone"][:2]
    assert best["name"] == "tilted base"
    assert best["explained"] > max(0.8, second["explained"])
    assert any("tilted base alone" in each for each in why["sentences"])
    assert result("validate", *files, "--no-why")["why"] == {}


def test_torsion_and_robot_are_the_models(result, files):
    by_torsion, by_robot, soft = (
        result("validate", *files, *options)
        for options in (("--torsion", "open_section"), ("--robot", "exonav-3", "--torsion", "open_section"), ())
    )
    assert by_torsion["places"] == by_robot["places"] != soft["places"]
    assert by_torsion["robots"][0]["torsion"] == "open_section"
    (only,) = (each.keys() for each in result("validate", *files, "--gravity", "without")["places"][:1])
    assert "gravity_not_modelled" in only
    assert "gravity_modelled" not in only


def test_the_directory_has_page_tables_and_figures(run, files, tmp_path):
    status, _, err = run("validate", *files, "--output", tmp_path / "new" / "accuracy")
    assert (status, err.splitlines()[-1]) == (0, f"tendonrod: wrote {tmp_path / 'new' / 'accuracy' / 'index.html'}")
    names = {each.name for each in (tmp_path / "new" / "accuracy").iterdir()}
    figures = {
        f"{name}.{kind}" for name in ("components", "space", "errors", "bias", "causes") for kind in ("png", "svg")
    }
    assert names == {"index.html", "accuracy.csv", "bias.csv", "causes.csv", "samples.csv", "errors.csv"} | figures


def test_every_samples_error_is_on_file(page, trials):
    rows = list(csv.DictReader((page.parent / "errors.csv").open(encoding="utf-8")))
    assert [row["fate"] for row in rows] == ["kept", "missing pose", "kept", "kept", "kept"] * 2
    tip = accuracy(trials).places[1]
    kept = [row for row in rows if row["trial"] == "tip" and row["fate"] == "kept"]
    written = [[1e-3 * float(row[f"error_{x}_mm_gravity_modelled"]) for x in "xyz"] for row in kept]
    np.testing.assert_allclose(written, tip.errors[WITH].vectors, atol=1e-15)
    np.testing.assert_allclose([float(row["tension_1_N"]) for row in kept], TENSIONS[[0, 2, 3, 4]])
    assert rows[1]["measured_x_mm"] == rows[1]["error_mm_gravity_modelled"] == ""


def test_the_table_on_file_is_the_table(page, trials):
    rows = list(csv.DictReader((page.parent / "accuracy.csv").open(encoding="utf-8")))
    rmse = [1e3 * each.errors[WITH].rmse for each in accuracy(trials).places]
    np.testing.assert_allclose([float(row["RMSE, gravity modelled (mm)"]) for row in rows], rmse, rtol=1e-12)


def test_the_page_stands_by_itself_and_says_why(page):
    text = page.read_text(encoding="utf-8")
    assert "What would explain the errors" in text
    assert re.search(r"Tilted base alone \(.*\) would explain [89]\d(\.\d)?\u00a0% of the squared error", text)
    assert (page.parent / "causes.csv").is_file()
    assert "exonav-3: published" in text
    shown = re.findall(r'class="label">(Table|Figure) (\d+)\.', text)
    for kind in ("Table", "Figure"):
        numbers = [int(number) for each, number in shown if each == kind]
        assert numbers == list(range(1, len(numbers) + 1))  # in the order of the page
    assert text.count("Tilted base alone") == 1  # said in the summary, and not again
    links = set(re.findall(r'(?:href|src)="([^"#]+)"', text))
    assert all(each.startswith("data:") or (page.parent / each).is_file() for each in links)
    assert not re.search(r"https?://", re.sub(r'"data:[^"]*"', "", text))


def test_several_robots_have_their_own_figures(trials, tmp_path):
    stiff = replace(trials[2], name="stiff", robot=ROBOT.replace(name="stiff", youngs_modulus=90e9))
    found = accuracy([*trials, stiff], gravity="with")
    page = write_validation(found, tmp_path)
    assert [robot.name for robot in found.robots] == ["exonav-3", "stiff"]
    assert {"bias-1.svg", "bias-2.svg"} <= {each.name for each in tmp_path.iterdir()}
    assert "Bias and scatter along stiff" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("none.nc",), "none.nc"),
        (("--gravity", "off"), "--gravity = 'off': must be one of both, with, without"),
        (("--torsion", "soft"), "--torsion = 'soft': must be one of published, open_section, homogenized"),
        (("--robot", "exonav-9"), "exonav-9"),
    ],
)
def test_bad_input_is_one_line(refused, files, options, said):
    given = options if options[0].endswith(".nc") else (*files, *options)
    assert said in refused("validate", *given)


def test_a_file_given_twice_is_refused(refused, files):
    assert "TRIAL = tip: must be given once" in refused("validate", *files, files[2])


def test_a_base_alone_is_nothing_to_compare(refused, files):
    assert refused("validate", files[0]).startswith("TRIAL = none: must be of one or more used samples of a tracker")
