"""`Plan`: its errors are those of its shapes, its polynomial is the least-squares fit, its files read back exactly."""

import csv
import json
from functools import cache

import numpy as np
import pytest

from leader_distance import Leader
from tendonrod import InvalidInput, load_robot, solve
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.motion.plan import COLUMNS, Plan
from tendonrod.motion.plan_origin import read_origin
from textbook import GRAVITY, farthest, prototype

DOWN = tuple(GRAVITY.tolist())


@cache
def plan(freedom="tension", steps=20) -> Plan:
    return plan_follow_leader(prototype(1), 0.7, DOWN, steps, freedom)


@pytest.mark.parametrize("freedom", ["tension", "full", "paper"])
def test_errors_are_those_of_the_shapes(freedom):
    found, down = plan(freedom), Leader(prototype(1), 0.7, DOWN)
    L = prototype(1).length_na
    for k in (4, 13):
        distance, _ = down.nearest(down.body(found.insertion[k], found.tension[k], found.rotation[k]))
        assert found.body_max[k] == pytest.approx(distance.max(), rel=1e-2)
        assert found.tip_error[k] == pytest.approx(distance[-1], abs=1e-8)
        at_progress = solve(prototype(1), 0.7, DOWN, s=[found.progress[k] * L], accuracy=1e-9).position
        missed = farthest(found.shapes[k].tip, at_progress)
        assert found.tip_error_at_progress[k] == pytest.approx(missed, abs=1e-8)
        assert found.tip_error[k] <= found.tip_error_at_progress[k] * (1 + 1e-9)
    assert np.all(found.body_rms <= found.body_max)
    assert found.tip_rmse == pytest.approx(np.sqrt(np.mean(found.tip_error**2)), rel=1e-12)


def test_percentages_are_of_the_exposed_length():
    found = plan("full")
    np.testing.assert_allclose(found.exposed_length, [shape.length for shape in found.shapes], rtol=1e-12)
    for name in ("body_rms", "body_max", "tip_error", "tip_error_at_progress"):
        percent = getattr(found, f"{name}_percent")
        np.testing.assert_allclose(percent * found.exposed_length / 100, getattr(found, name), rtol=1e-12)


def test_commands_reproduce_the_shapes():
    found = plan("full")
    for k in (0, 9, 19):
        command = {"insertion": found.insertion[k], "rotation": found.rotation[k]}
        shape = solve(found.robot, found.tension[k], found.gravity, **command)
        assert farthest(shape.tip, found.shapes[k].tip) < 2e-6


def test_reference_is_the_full_robot():
    reference = plan().reference
    assert reference.s[0] == 0.0
    assert reference.s[-1] == prototype(1).length_na
    s = np.linspace(0.0, reference.s[-1], 501)
    whole = solve(prototype(1), 0.7, DOWN, s=s, accuracy=1e-10)
    assert farthest(reference.at(s), whole.position) < 2e-9


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5])
def test_polynomial_is_the_least_squares_fit(degree):
    expected = np.polyfit(plan().progress, plan().tension, degree)
    np.testing.assert_allclose(plan().polynomial(degree), expected, rtol=1e-9, atol=1e-12)
    design = np.vander(plan().progress, degree + 1)
    residual = design @ plan().polynomial(degree) - plan().tension
    np.testing.assert_allclose(design.T @ residual, 0.0, atol=1e-12)


def test_polynomial_of_the_true_optimum_is_not_the_papers():
    """The paper fits 0.6492 eta^2 - 0.5159 eta + 0.6088, which falls to 0.506 N on the way."""
    printed = np.polyval([0.6492, -0.5159, 0.6088], plan().progress)
    assert np.abs(printed - plan().tension).max() > 0.15
    assert np.abs(np.polyval(plan().polynomial(2), plan().progress) - plan().tension).max() < 2e-3


def test_arrays_are_read_only():
    for name in ("progress", "insertion", "rotation", "tension", "body_rms", "body_max", "tip_error", "gravity"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(plan(steps=2), name)[0] = 1.0


# ---- files ----


def test_csv_round_trip(tmp_path):
    found = plan("full")
    with found.write(tmp_path / "plan.csv").open(newline="") as file:
        header, *rows = csv.reader(line for line in file if not line.startswith("#"))
    values = np.array(rows, dtype=float)
    assert header[:4] == ["progress", "insertion", "rotation_rad", "tension_N"]
    assert all(name.endswith(("_m", "_percent_of_exposed_length")) for name in header[4:])
    for column, name in zip(values.T, COLUMNS, strict=True):
        np.testing.assert_array_equal(column, getattr(found, name))


def test_a_csv_says_what_it_is_for(tmp_path):
    found = plan("full")
    lines = found.write(tmp_path / "plan.csv").read_text().splitlines()
    origin = read_origin(lines)
    assert origin == found.origin
    assert origin is not None
    assert origin.differences(found.robot, found.gravity) == []
    other = found.robot.replace(torsion="homogenized")
    assert origin.differences(other, (0.0, 0.0, -9.81)) == [
        "torsion published, here homogenized",
        "gravity (-9.81, 0, 0) m/s2, here (0, 0, -9.81)",
    ]
    with pytest.raises(InvalidInput, match=r"plan = p\.csv, made for exonav-1: must be a plan for exonav-3"):
        origin.check_robot("plan", "p.csv", load_robot("exonav-3"))


@pytest.mark.parametrize("change", ["", "# robot = exonav-1", '# gravity_m_s2 = [1, "x", 3]', "# freedom"])
def test_comments_that_do_not_tell_all_tell_nothing(change):
    lines = [line for line in plan().origin.lines() if change[:6] not in line] if change else []
    assert read_origin([*lines, change, "# made by hand, 2030"]) is None


def test_json_round_trip(tmp_path):
    found = plan("full")
    document = json.loads(found.write(str(tmp_path / "plan.json")).read_text())
    for name in COLUMNS:
        np.testing.assert_array_equal(document[name], getattr(found, name))
    about = [document[name] for name in ("robot", "torsion", "freedom", "target_tension", "gravity")]
    assert about == ["exonav-1", "published", "full", 0.7, list(DOWN)]
    np.testing.assert_array_equal(document["reference"]["position"], found.reference.points)
    np.testing.assert_array_equal(document["polynomial"], found.polynomial(2))
    assert document["tip_rmse"] == found.tip_rmse
    units = document["units"]
    assert (units["tension"], units["rotation"], units["body_rms"]) == ("N", "rad", "m")
    assert {name for name, value in document.items() if not isinstance(value, str)} == units.keys() | {"units"}


def test_other_files_are_refused(tmp_path):
    for name in ("plan.txt", "plan"):
        with pytest.raises(InvalidInput, match=r"must be a file name that ends in \.csv or \.json"):
            plan().write(tmp_path / name)
        assert not (tmp_path / name).exists()


@pytest.mark.parametrize("stop", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failing_write_leaves_the_old_file(tmp_path, monkeypatch, stop):
    def halfway(self, file):
        file.write("half")
        raise stop

    monkeypatch.setattr(Plan, "_write_table", halfway)
    old = tmp_path / "plan.csv"
    old.write_text("old")
    with pytest.raises((InvalidInput, KeyboardInterrupt)) as caught:
        plan(steps=2).write(old)
    if isinstance(stop, OSError):
        assert str(caught.value) == f"path = '{old}': must be writable: No space left on device"
    assert old.read_text() == "old"
    assert list(tmp_path.iterdir()) == [old]


def test_a_link_stays_a_link(tmp_path):
    real, link = tmp_path / "real.csv", tmp_path / "link.csv"
    link.symlink_to(real)
    assert plan(steps=2).write(link) == link
    assert link.is_symlink()
    assert "\nprogress," in real.read_text()


# ---- polynomial and its edges ----


@pytest.mark.parametrize("degree", [-1, 20, 2.0, True, "2"])
def test_bad_degree_is_named(degree):
    with pytest.raises(InvalidInput, match=r"degree = .*: must be a whole number from 0 to 19"):
        plan().polynomial(degree)


def test_a_plan_of_one_step_is_the_full_robot():
    found = plan(steps=1)
    assert found.progress.tolist() == [1.0]
    np.testing.assert_allclose(found.polynomial(0), [0.7], rtol=0, atol=1e-6)
    assert found.to_dict()["polynomial"] == found.polynomial(0).tolist()
