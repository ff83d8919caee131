"""The command line: what it prints is what the library returns, and bad input gets one line that names it."""

import csv
import json
import os
import pty
import signal
import subprocess
import sys
import termios
import time
from importlib.resources import files
from math import radians
from pathlib import Path

import numpy as np
import pytest

import tendonrod
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.motion.progression import progress
from tendonrod.statics.tension_limits import tension_limits

GRAVITY = (-9.81, 0.0, 0.0)
COMMAND = [sys.executable, "-m", "tendonrod"]

FOUR_TENDONS = """
name = "four"
[rod]
length_mm = 500.0
radius_mm = 1.0
[material]
youngs_modulus_gpa = 200.0
shear_modulus_gpa = 80.0
density_kg_m3 = 8000.0
""" + "".join(
    f'[[tendons]]\nrouting = "constant"\nx_mm = {x}\ny_mm = {y}\n'
    for x, y in ((15.06, 0.0), (0.0, 15.06), (-15.06, 0.0), (0.0, -15.06))
)


@pytest.fixture
def exonav1() -> tendonrod.Robot:
    return tendonrod.load_robot("exonav-1")


@pytest.fixture
def variant(tmp_path):
    """Path of exonav-1's file with one text replaced by another."""

    def write(old: str, new: str) -> str:
        text = (files("tendonrod") / "robots" / "exonav-1.toml").read_text("utf-8")
        assert old in text
        path = tmp_path / "mine.toml"
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        return str(path)

    return write


@pytest.fixture
def table(tmp_path):
    """Path of a CSV file with this text."""

    def write(text: str) -> str:
        path = tmp_path / "commands.csv"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


# ---- what is printed is what the library returns ----


def test_shape_json_is_the_solved_shape_to_the_last_bit(result, exonav1):
    told = result(
        *("shape", "exonav-1", "--tension", "0.7", "--gravity", "-9.81,0,0", "--tip-force", "0,1e-3,0"),
        *("--tip-moment=-1e-6,0,0", "--insertion", "0.8", "--rotation-deg", "-5", "--samples", "31"),
    )
    s = np.linspace(0.0, 0.8 * exonav1.length_na, 31)
    shape = tendonrod.solve(
        exonav1, 0.7, GRAVITY, (0.0, 1e-3, 0.0), (-1e-6, 0.0, 0.0), insertion=0.8, rotation=radians(-5.0), s=s
    )
    for name in ("s", "position", "centerline", "rotation", "v", "u", "force", "moment", "tip", "tensions"):
        np.testing.assert_array_equal(np.array(told[name]), getattr(shape, name), err_msg=name)
    for name in ("converged", "status", "residual", "iterations", "insertion"):
        assert told[name] == getattr(shape, name), name
    assert tuple(told["warnings"]) == shape.warnings
    assert (told["robot"], told["torsion"], told["gravity"]) == ("exonav-1", "published", [-9.81, 0.0, 0.0])
    assert (told["distributed_force"], told["distributed_moment"]) == ([0.0] * 3, [0.0] * 3)
    assert (told["units"]["tip"], told["units"]["moment"], told["units"]["u"]) == ("m", "N m", "1/m")
    assert told["units"].keys() < told.keys()
    assert (told["tip_force"], told["tip_moment"]) == ([0.0, 1e-3, 0.0], [-1e-6, 0.0, 0.0])
    assert told["base_rotation"] == radians(-5.0)
    np.testing.assert_array_equal(told["tendon_path"][0], shape.tendon_path(0))


def test_distributed_loads_are_those_of_solve(result, run, exonav1):
    loads = ("--distributed-force", "0,0.01,0", "--distributed-moment", "0,0,1e-4")
    s = np.linspace(0.0, exonav1.length_na, 101)
    shape = tendonrod.solve(exonav1, distributed_force=(0.0, 0.01, 0.0), distributed_moment=(0.0, 0.0, 1e-4), s=s)
    told = result("shape", "exonav-1", *loads)
    assert told["tip"] == shape.tip.tolist()
    assert (told["distributed_force"], told["distributed_moment"]) == ([0.0, 0.01, 0.0], [0.0, 0.0, 1e-4])
    assert (told["units"]["distributed_force"], told["units"]["distributed_moment"]) == ("N/m", "N")
    assert "distributed moment" in run("shape", "exonav-1", *loads)[1]


def test_torsion_option_is_the_torsion_model(result, exonav1):
    told = result("shape", "exonav-1", "--tension", "0.7", "--torsion", "open_section")
    assert told["torsion"] == "open_section"
    np.testing.assert_allclose(1e3 * np.array(told["tip"]), (-0.33623, 22.86280, 66.02597), atol=5e-6)
    assert told["tip"] == tendonrod.solve(exonav1.replace(torsion="open_section"), 0.7).tip.tolist()


def test_one_tension_per_tendon_in_order(result, tmp_path):
    path = tmp_path / "four.toml"
    path.write_text(FOUR_TENDONS)
    taus = ("--tension", "15", "--tension", "0", "--tension", "0", "--tension", "0")
    told = result("shape", path, *taus, "--gravity", "9.81,0,0")
    np.testing.assert_allclose(told["tip"], (0.182212, 0.0, 0.453229), atol=2e-6)
    assert told["torsion"] == "GJ"
    assert told["tensions"] == [15.0, 0.0, 0.0, 0.0]
    assert len(told["tendon_path"]) == 4


def test_empty_and_slack_shapes(result, exonav1):
    assert np.ptp(result("shape", "exonav-1", "--insertion", "0")["position"], axis=0).max() == 0.0
    assert result("shape", "exonav-1")["tensions"] == [0.0]


def test_shape_table_holds_the_tip_and_no_boxes(run, exonav1):
    status, out, err = run("shape", "exonav-1", "--tension", "0.7")
    assert (status, err) == (0, "")
    assert ", ".join(f"{1e3 * x:.4f}" for x in tendonrod.solve(exonav1, 0.7).tip) in out
    assert out.isascii()
    assert all(line == line.rstrip() for line in out.splitlines())


def test_warnings_go_to_standard_error_and_into_the_json(run):
    status, out, err = run("shape", "exonav-1", "--tension", "0.05", "--json")
    assert status == 0
    assert "lifts off" in json.loads(out)["warnings"][0]
    assert err.startswith("tendonrod: warning: tendon 1 lifts off")


def test_warnings_of_many_steps_are_told_once(run, table):
    given = table("insertion,tension_n\n" + "".join(f"{eta / 10},3\n" for eta in range(1, 11)))
    status, _, err = run("motion", given)
    assert status == 0
    assert err.startswith("tendonrod: warning: 10 steps, row 1 to 10; the last: strain ")
    assert err.count("\n") == 1


@pytest.mark.parametrize("freedom", ["tension", "full", "paper"])
def test_ftl_json_is_the_plan(result, exonav1, freedom):
    told = result("ftl", "exonav-1", "--target", "0.45", "--gravity", "-9.81,0,0", "--steps", 4, "--freedom", freedom)
    plan = plan_follow_leader(exonav1, 0.45, GRAVITY, steps=4, freedom=freedom)
    assert told == json.loads(json.dumps(plan.to_dict()))
    for name in ("insertion", "rotation", "tension", "body_rms", "tip_error", "tip_error_at_progress"):
        np.testing.assert_array_equal(told[name], getattr(plan, name))


def test_ftl_paper_search_takes_its_step_and_tolerance(result, exonav1):
    given = ("--freedom", "paper", "--tension-step", "0.02", "--tolerance-mm", "0.3", "--steps", "3")
    told = result("ftl", "exonav-1", "--target", "0.45", *given)
    plan = plan_follow_leader(exonav1, 0.45, steps=3, freedom="paper", tension_step=0.02, tolerance=0.3e-3)
    assert told["tension"] == plan.tension.tolist()


@pytest.mark.parametrize("freedom", ["tension", "full"])
def test_a_plan_on_file_is_a_motion(run, result, exonav1, tmp_path, freedom):
    plan_file, pull = tmp_path / "plan.csv", ("--gravity", "-9.81,0,0")
    status, _, err = run(
        *("ftl", "exonav-1", "--target", "0.7", *pull, "--steps", "5"),
        *("--freedom", freedom, "--output", plan_file),
    )
    assert (status, err) == (0, f"tendonrod: wrote {plan_file}\n")
    told = result("motion", plan_file, *pull, "--samples", "7")
    plan = plan_follow_leader(exonav1, 0.7, GRAVITY, steps=5, freedom=freedom)
    motion = progress(exonav1, plan.insertion, plan.rotation, plan.tension, samples=7, gravity=GRAVITY)
    for name in ("insertion", "rotation", "tension", "tip"):
        np.testing.assert_array_equal(told[name], getattr(motion, name))
    for one, shape in zip(told["shapes"], motion.shapes, strict=True):
        np.testing.assert_array_equal(one["position"], shape.position)


def test_motion_writes_millimetres_and_reads_them_again(run, result, table, tmp_path):
    given = table("insertion,rotation_deg,tension_n,time_s\n0,0,0.5,0\n0.5,-10,0.6,1\n\n1,0,0.7,2\n")
    tips, bodies = tmp_path / "tips.csv", tmp_path / "bodies.csv"
    status, out, err = run("motion", given, "--output", tips, "--bodies", bodies, "--samples", "5")
    assert status == 0
    assert "columns left alone: time_s" in err
    assert len([line for line in out.splitlines() if line[:3].strip().isdigit()]) == 3
    told = result("motion", tips, "--samples", "5")
    rows = list(csv.DictReader(tips.open()))
    np.testing.assert_allclose(
        [[float(row[f"tip_{x}_mm"]) for x in "xyz"] for row in rows], 1e3 * np.array(told["tip"]), atol=1e-8
    )
    np.testing.assert_allclose(told["rotation"], np.radians([0.0, -10.0, 0.0]), rtol=1e-15)
    sections = list(csv.DictReader(bodies.open()))
    assert len(sections) == 3 * 5
    assert float(sections[-1]["axis_z_mm"]) == pytest.approx(1e3 * told["shapes"][2]["centerline"][-1][2], abs=1e-8)


def test_motion_with_a_column_per_tendon(result, table, tmp_path):
    robot = tmp_path / "four.toml"
    robot.write_text(FOUR_TENDONS)
    given = table("tension_2_n,insertion,tension_1_n,tension_3_n,tension_4_n\n0,0.5,5,1,2\n")
    assert result("motion", given, "--robot", robot)["tension"] == [[5.0, 0.0, 1.0, 2.0]]


def test_robots_lists_every_preset(run, result):
    status, out, _ = run("robots")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines() if line.startswith("exonav")] == tendonrod.preset_names()


def test_robot_json_is_section_sources_and_limits(result, exonav1):
    told = result("robots", "exonav-1")
    for name in ("A", "r_na", "I_x", "I_y", "L_na", "line_density", "torsion_stiffness"):
        assert told["section"][name] == getattr(exonav1.section, name)
    assert told["section"]["Kbt"] == exonav1.section.Kbt.tolist()
    assert told["parameters"] == exonav1.parameters()
    assert told["sources"] == dict(exonav1.sources)
    assert [(each["name"], each["tension"]) for each in told["limits"]] == [
        (limit.name, limit.tension) for limit in tension_limits(exonav1)
    ]


def test_robot_page_shows_units_sources_and_limits(run, exonav1):
    status, out, _ = run("robots", "exonav-1", "--torsion", "open_section")
    assert status == 0
    assert "0.09294009  mm2" in out
    assert "1.162681  g/m" in out
    assert "tube.inner_radius_mm = 0.457" in out
    assert exonav1.sources["tube.inner_radius_mm"] in out
    assert "material.torsion = open_section" in out
    for limit in tension_limits(exonav1.replace(torsion="open_section")):
        shown = "not reached" if limit.tension is None else f"{limit.tension:.4g} N"
        assert any(line.startswith(limit.name) and shown in line for line in out.splitlines())


def test_robot_files_for_workshop_and_drawing(run, tmp_path):
    drawing, sheet, solid = (tmp_path / name for name in ("device.png", "cut.dxf", "tube.stl"))
    status, _, err = run("robots", "exonav-3", "--figure", drawing, "--notch-pattern", sheet, "--mesh", solid)
    assert status == 0
    assert [line.split()[-1] for line in err.splitlines()] == [str(drawing), str(sheet), str(solid)]
    assert drawing.read_bytes().startswith(b"\x89PNG")
    assert "NOTCHES" in sheet.read_text()
    assert solid.stat().st_size > 10_000
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_figures(run, tmp_path, table, suffix):
    given = table("insertion,tension_n\n0.5,0.5\n1,0.7\n")
    for k, command in enumerate(
        (
            ("shape", "exonav-1", "--tension", "0.7"),
            ("motion", given),
            ("ftl", "exonav-1", "--target", "0.5", "--steps", "3"),
        )
    ):
        picture = tmp_path / f"{k}.{suffix}"
        status, _, err = run(*command, "--figure", picture)
        assert status == 0, err
        assert picture.stat().st_size > 5_000


# ---- bad input: one line, status 2, nothing on standard output ----


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("inner_radius_mm = 0.457", "inner_radius_mm = -0.457", "tube.inner_radius_mm = -0.457: must be > 0"),
        ("length_mm = 75.4", "length_mm = 0.0", "tube.length_mm = 0.0: must be > 0"),
        ("width_mm = 0.4 ", "width_mm = -1 ", "notches.width_mm = -1.0: must be > 0"),
        ("outer_radius_mm = 0.572", "outer_radius_mm = 0.457", "must be > inner_radius_mm = 0.457"),
        ("uncut_angle_deg = 90.0", "uncut_angle_deg = 360.0", "must be inside (0, 2 pi) rad"),
        ("uncut_angle_deg = 90.0", "uncut_angle_deg = 0", "notches.uncut_angle_deg = 0.0: must be inside"),
        ("youngs_modulus_gpa = 75.0", "youngs_modulus_gpa = nan", "youngs_modulus_gpa = nan: must be a finite number"),
        ("density_kg_m3 = 6255.0", "density_kg_m3 = inf", "density_kg_m3 = inf: must be a finite number"),
        ("[notches]", "[notches", "mine.toml, line 11 = [notches: must be valid TOML"),
        ("length_mm = 75.4", "lenght_mm = 75.4", "tube.lenght_mm = 75.4: must be one of the keys"),
    ],
)
@pytest.mark.parametrize("command", [("robots",), ("shape", "--tension", "0.7"), ("ftl", "--target", "0.7")])
def test_bad_robot_files(refused, variant, command, old, new, said):
    line = refused(command[0], variant(old, new), *command[1:])
    assert "mine.toml" in line
    assert said in line


def test_empty_robot_file_and_unknown_preset(refused, tmp_path):
    empty = tmp_path / "empty.toml"
    empty.write_text("")
    assert f"{empty} = empty: must be a robot: name" in refused("shape", empty)
    for name in ("exonav-9", tmp_path / "nofile.toml"):
        assert all(preset in refused("robots", name) for preset in tendonrod.preset_names())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--tension", "-0.1"), "--tension = -0.1: must be >= 0"),
        (("--tension", "nan"), "--tension = nan: must be a finite number >= 0"),
        (
            ("--tension", "0,7"),
            "--tension = 0,7: must be a finite number >= 0, written with a decimal point, not a comma",
        ),
        (("--distributed-force", "1"), "--distributed-force = 1: must be 3 finite numbers"),
        (("--tension", "0.7N"), "--tension = '0.7N': must be a finite number >= 0"),
        (
            ("--tension", "0.7", "--tension", "0.2"),
            "--tension = 0.7,0.2: must be given once per tendon; exonav-1 has 1",
        ),
        (("--insertion", "1.2"), "--insertion = 1.2: must be from 0 to 1"),
        (("--insertion=-0.1",), "--insertion = -0.1: must be from 0 to 1"),
        (("--gravity", "-9.81,0"), "--gravity = -9.81,0: must be 3 finite numbers"),
        (("--gravity", "-9.81,0,inf"), "--gravity = -9.81,0,inf: must be 3 finite numbers"),
        (("--tip-force", "0,0,0,0"), "--tip-force = 0,0,0,0: must be 3 finite numbers"),
        (("--tip-moment", ""), "--tip-moment = '': must be 3 finite numbers"),
        (("--rotation-deg", "inf"), "--rotation-deg = inf: must be a finite number"),
        (("--samples", "1"), "--samples = 1: must be a whole number from 2 to"),
        (("--samples", "2.5"), "--samples = 2.5: must be a whole number from 2 to"),
        (("--torsion", "stiff"), "--torsion = 'stiff': must be one of published, open_section, homogenized"),
        (("--figure", "shape.jpg"), "--figure = shape.jpg: must be a file name that ends in .png, .svg or .pdf"),
        (("--figure", "no/such/place.png"), "--figure = no/such/place.png: must be in a directory that exists"),
        (("--gravty", "0,0,0"), "option = --gravty: must be an option of tendonrod shape: did you mean --gravity?"),
        (("--tension",), "--tension = missing: must be followed by a value"),
        (("--json=1",), "--json = ...: must be given without a value"),
        (("exonav-2",), "argument = 'exonav-2': must be left out: tendonrod shape takes ROBOT"),
    ],
)
def test_bad_shape_options(refused, options, said):
    assert refused("shape", "exonav-1", *options).startswith(said)
    assert refused("shape", "exonav-1", "--json", *options).startswith(said)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("shap", "exonav-1"), "command = 'shap': must be one of robots, shape, batch, motion, ftl, experiment, trial"),
        (("--jsn",), "option = --jsn: must be an option of tendonrod: see tendonrod --help"),
        (("shape",), "ROBOT = missing: must be given"),
        (("motion",), "FILE.csv = missing: must be given"),
        (("ftl", "exonav-1"), "--target = missing: must be given"),
        (("ftl", "exonav-1", "--target", "-1"), "--target = -1.0: must be >= 0"),
        (("ftl", "exonav-1", "--target", "0.7", "--steps", "0"), "--steps = 0: must be a whole number from 1 to"),
        (("ftl", "exonav-1", "--target", "0.7", "--freedom", "all"), "--freedom = 'all': must be one of tension, full"),
        (("ftl", "exonav-1", "--target", "0.7", "--tension-step", "0.1"), "--tension-step = 0.1: must be left out"),
        (
            ("ftl", "exonav-1", "--target", "1", "--freedom", "paper", "--tolerance-mm", "0"),
            "--tolerance-mm = 0.0: must",
        ),
        (
            ("ftl", "exonav-1", "--target", "0.7", "--output", "plan.txt"),
            "--output = plan.txt: must be a file name that",
        ),
        (("robots", "--figure", "all.png"), "--figure = all.png: must be given together with ROBOT"),
        (("robots", "exonav-1", "--mesh", "tube.obj"), "--mesh = tube.obj: must be a file name that ends in .stl"),
        (("reproduce", "--output", __file__), f"--output = {__file__}: must be a directory, not a file"),
    ],
)
def test_bad_usage(refused, arguments, said):
    assert refused(*arguments).startswith(said)


def test_what_a_robot_cannot_do(refused, tmp_path):
    path = tmp_path / "four.toml"
    path.write_text(FOUR_TENDONS)
    assert "plain rod" in refused("shape", path, "--torsion", "published")
    assert "four with 4 tendons" in refused("ftl", path, "--target", "1")
    assert "a plain rod has no notches" in refused("robots", path, "--notch-pattern", tmp_path / "cut.dxf")
    assert "--tension = 1: must be given once per tendon; four has 4" in refused("shape", path, "--tension", "1")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "commands.csv = empty: must be a header and rows: insertion, tension_N"),
        ("insertion,tension_n\n", "commands.csv: rows = none: must be given below the header"),
        ("insertion,rotation_deg\n1,0\n", "commands.csv: column tension_N = missing: must be in the header"),
        (
            "insertion,tension\n1,0\n",
            "column 2 = 'tension': must be one of insertion, tension_N, rotation_deg, rot",
        ),
        ("insertion,tension_1_n\n1,0\n", "column 2 = 'tension_1_n': must be one of insertion"),
        ("insertion,tension_n,insertion\n1,0,1\n", "column 3 = 'insertion': must be given once; column 1 has it"),
        ("insertion,rotation_deg,rotation_rad,tension_n\n1,0,0,1\n", "column 3 = 'rotation_rad': must be given once"),
        ("insertion,tension_n\n0.5,0.1\n\n1.5,0\n", "row 2 (line 4), column 1 insertion = 1.5: must be from 0 to 1"),
        ("insertion,tension_n\n0.5,-0.1\n", "row 1 (line 2), column 2 tension_n = -0.1: must be >= 0"),
        ("insertion,tension_n\n0.5,abc\n", "row 1 (line 2), column 2 tension_n = 'abc': must be a finite number >= 0"),
        ("insertion,tension_n\n0.5,\n", "row 1 (line 2), column 2 tension_n = empty: must be a finite number >= 0"),
        ("insertion,tension_n,rotation_deg\n1,1,nan\n", "column 3 rotation_deg = nan: must be a finite number"),
        ("insertion,tension_n\n0.5\n", "row 1 (line 2): cells = 1: must be 2, as many as the header has"),
        ("insertion;tension_n\n0.5;1\n", "column 1 = 'insertion;tension_n': must be one of"),
    ],
)
def test_bad_motion_files(refused, table, text, said):
    line = refused("motion", table(text))
    assert "commands.csv" in line
    assert said in line


def test_motion_writes_over_nothing_that_it_reads_or_writes(refused, table, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "insertion,tension_n\n0.5,0.1\n"
    given = table(text)
    (tmp_path / "link.csv").symlink_to(given)
    for option, path in (("--output", "commands.csv"), ("--bodies", given), ("--output", "link.csv")):
        assert refused("motion", given, option, path) == f"{option} = {path}: must be another file than FILE.csv"
    line = refused("motion", given, "--output", "new.csv", "--bodies", "./new.csv")
    assert line == "--bodies = ./new.csv: must be another file than --output"
    assert (tmp_path / "commands.csv").read_text() == text


def test_motion_of_one_step_is_one_step(run, table):
    assert "m/s2, 1 step\n" in run("motion", table("Insertion,TENSION_N\n1,0.1\n"))[1]


def test_missing_motion_file(refused, tmp_path):
    assert "must be an existing CSV file" in refused("motion", tmp_path / "nofile.csv")
    assert "must be a readable file: Is a directory" in refused("motion", tmp_path)


def test_no_equilibrium_is_one_line_and_status_1(run, refused):
    line = refused("shape", "exonav-1", "--tip-moment", "1e6,0,0", status=1)
    assert "of the load" in line


# ---- front door ----


def test_alone_it_prints_its_help(run):
    status, out, err = run()
    assert (status, err) == (0, "")
    assert all(name in out for name in ("robots", "shape", "batch", "motion", "ftl", "reproduce"))
    assert run("--help")[1].split() == out.split()
    assert run("--version")[:2] == (0, f"tendonrod {tendonrod.__version__}\n")


@pytest.mark.parametrize("command", ["robots", "shape", "batch", "motion", "ftl", "reproduce"])
def test_every_command_has_help_with_an_example(run, command):
    status, out, _ = run(command, "--help")
    assert status == 0
    assert f"  tendonrod {command}" in out
    assert out.startswith(f"Usage: tendonrod {command} [OPTIONS]")


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from tendonrod.cli import main; main(['shape', '--help']); "
        "sys.exit(' '.join({'numba', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == ""


def test_reproduce_says_where_the_report_is(run, tmp_path, monkeypatch):
    import tendonrod.report

    asked = []

    def reproduce(out, watch):
        for k in range(3):
            watch(k + 1, 3, f"part {k + 1}")
        asked.append(out)
        return out / "index.html"

    monkeypatch.setattr(tendonrod.report, "reproduce", reproduce, raising=False)
    status, out, err = run("reproduce", "--output", tmp_path / "new" / "place")
    assert (status, err) == (0, "")
    assert asked == [tmp_path / "new" / "place"]
    assert out.splitlines()[-1] == f"Report: {tmp_path / 'new' / 'place' / 'index.html'}"


def test_progress_is_told_in_lines_where_there_is_no_terminal(run, tmp_path, monkeypatch):
    import tendonrod.cli.output
    import tendonrod.report

    def reproduce(out, watch):
        for k in range(3):
            watch(k + 1, 3, f"part {k + 1}")
        return out

    monkeypatch.setattr(tendonrod.report, "reproduce", reproduce, raising=False)
    monkeypatch.setattr(tendonrod.cli.output, "BETWEEN_LINES", 0.0)
    assert run("reproduce", "--output", tmp_path)[2] == "tendonrod: part 1: 33 %\ntendonrod: part 2: 67 %\n"


def test_interrupt_inside_a_callback_is_answered(run, tmp_path, monkeypatch):
    """There Python reports it and goes on; here it comes again."""
    import ctypes

    import tendonrod.report

    def reproduce(out, watch):
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()
        time.sleep(20)

    monkeypatch.setattr(tendonrod.report, "reproduce", reproduce, raising=False)
    status, out, err = run("reproduce", "--output", tmp_path)
    assert (status, out, err.strip()) == (130, "", "tendonrod: interrupted")


# ---- the real process ----


def test_process_prints_results_and_errors_apart():
    done = subprocess.run(
        [*COMMAND, "shape", "exonav-1", "--tension", "0.7", "--json"], capture_output=True, check=True
    )
    np.testing.assert_allclose(
        1e3 * np.array(json.loads(done.stdout)["tip"]), (-0.16690, 21.97105, 66.55789), atol=6e-6
    )
    done = subprocess.run([*COMMAND, "shape", "exonav-1", "--insertion", "2"], capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr == b"tendonrod: error: --insertion = 2.0: must be from 0 to 1\n"


@pytest.mark.parametrize("arguments", [("robots",), ("robots", "--json"), ("--help",), ("robots", "--help")])
def test_full_disk_is_one_line(arguments):
    with open("/dev/full", "wb") as full:
        done = subprocess.run([*COMMAND, *arguments], stdout=full, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 1
    assert done.stderr == b"tendonrod: error: standard output cannot be used: No space left on device\n"


def test_interrupt_while_the_commands_are_imported_is_one_line():
    code = """
import sys
from tendonrod import cli
class Stop:
    def find_spec(self, name, *_):
        if name == "typer":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Stop())
sys.exit(cli.main(["robots"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "tendonrod: interrupted\n")


INTERRUPTED_AT_IMPORT = """
import os, runpy, signal, sys
class Watching:
    def find_spec(self, name, *_):
        if name == sys.argv[0]:
            os.kill(os.getpid(), signal.SIGINT)
sys.argv = [NAME, "robots"]
sys.meta_path.insert(0, Watching())
runpy.run_module("tendonrod", run_name="__main__")
"""


@pytest.mark.parametrize(
    "name", ["tendonrod.cli.app", "typer", "numpy", "tendonrod.cli.process", "tendonrod.robotfile"]
)
def test_interrupt_while_anything_is_imported_is_one_line(name):
    """From the first import of the command line on, wherever it comes; before that there is only Python's own start."""
    code = INTERRUPTED_AT_IMPORT.replace("NAME", repr(name))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "tendonrod: interrupted\n")


@pytest.mark.parametrize("delay", [0.05, 0.2, 0.4, 0.7, 1.0])
def test_interrupt_at_any_time_leaves_no_traceback_of_ours(delay):
    """On a slow machine Python's own start may be what is interrupted; the package never shows its inside."""
    code = "from tendonrod.cli import main; raise SystemExit(main())"  # as the installed command
    command = [sys.executable, "-c", code, "ftl", "exonav-1", "--target", "0.7", "--steps", "10000"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert out == ""
    assert str(Path(tendonrod.__file__).parent) not in err
    assert err.count("tendonrod: interrupted") <= 1


def test_notes_are_one_line_in_a_pipe_and_broken_between_words_on_a_terminal():
    """A terminal of 40 columns breaks long lines wherever they reach its edge."""
    words = " ".join(f"word{k}" for k in range(40)) + " /a/path/that-is/longer/than/the/whole/line/of/this/terminal"
    code = f"from tendonrod.cli.streams import note; note({words!r})"
    piped = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert piped.stderr == f"tendonrod: {words}\n"
    leader, follower = pty.openpty()
    termios.tcsetwinsize(follower, (24, 40))
    subprocess.run([sys.executable, "-c", code], stderr=follower, check=True)
    os.close(follower)
    shown = os.read(leader, 65536).decode()
    os.close(leader)
    assert shown.split() == ["tendonrod:", *words.split()]
    assert all(len(line) <= 40 or len(line.split()) == 1 for line in shown.splitlines())


def test_process_ends_silently_when_nobody_reads():
    command = [*COMMAND, "shape", "exonav-1", "--json", "--samples", "20000"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.read(10)
        process.stdout.close()
        err = process.stderr.read()
    assert (process.returncode, err) == (141, b"")


def test_interrupt_leaves_one_line_and_no_file(tmp_path):
    """Interrupted once the progress bar, on a terminal, shows that planning has begun."""
    plan = tmp_path / "plan.csv"
    command = [*COMMAND, "ftl", "exonav-1", "--target", "0.7", "--gravity", "-9.81,0,0", "--steps", "10000"]
    leader, follower = pty.openpty()
    with subprocess.Popen([*command, "--output", str(plan)], stdout=subprocess.PIPE, stderr=follower) as process:
        os.close(follower)
        seen, until = b"", time.monotonic() + 60
        while b"planning" not in seen and time.monotonic() < until:
            seen += os.read(leader, 4096)
        process.send_signal(signal.SIGINT)
        assert process.stdout is not None
        out = process.stdout.read()
    rest = os.read(leader, 65536)
    os.close(leader)
    assert (process.returncode, out) == (130, b"")
    assert rest.rstrip().endswith(b"tendonrod: interrupted")
    assert b"Traceback" not in rest
    assert list(tmp_path.iterdir()) == []
