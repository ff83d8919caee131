"""`tendonrod batch`: a row is what `solve` gives for it, bad rows are named, and an interrupt loses nothing."""

import csv
import os
import signal
import subprocess
import sys
import threading
import time
from math import radians
from pathlib import Path

import numpy as np
import pytest

import tendonrod
from tendonrod.scenefile import read_scene

EXAMPLES = Path(__file__).parents[1] / "examples"
CORD = EXAMPLES / "cord.toml"
FOUR = EXAMPLES / "four-tendon.toml"
COMMAND = [sys.executable, "-m", "tendonrod"]


@pytest.fixture
def table(tmp_path):
    """Path of a CSV file with this text."""

    def write(text: str) -> str:
        path = tmp_path / "table.csv"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


@pytest.fixture
def solved(run, tmp_path):
    """The rows that a batch writes, and what it prints; it must end well."""

    def call(robot, path, *options) -> tuple[list[dict[str, str]], str]:
        output = tmp_path / "results.csv"
        status, out, err = run("batch", robot, path, "--output", output, *options)
        assert (status, err.splitlines()[-1]) == (0, f"tendonrod: wrote {output}"), err
        return list(csv.DictReader(output.open(encoding="utf-8"))), out

    return call


def tip(row: dict[str, str]) -> list[float]:
    return [1e-3 * float(row[f"tip_{x}_mm"]) for x in "xyz"]


def axis(row: dict[str, str]) -> list[float]:
    return [float(row[f"tip_axis_{x}"]) for x in "xyz"]


def test_every_row_is_solved_as_solve_does(solved, table):
    path = table(
        "name,tension_N,insertion,rotation_deg,gravity_x_m_s2,tip_force_y_N,tip_moment_z_Nm,distributed_force_x_N_per_m,"
        "distributed_moment_y_Nm_per_m\n"
        "first,0.7,1,0,-9.81,0,0,0,0\n\n"
        'second,0.3,0.5,-10,0,1e-3,1e-6,0.01,1e-5\n"last, not least",0,0,0,0,0,0,0,0\n'
    )
    rows, out = solved("exonav-1", path, "--threads", "2")
    robot = tendonrod.load_robot("exonav-1")
    loads = {"tip_force": (0.0, 1e-3, 0.0), "tip_moment": (0.0, 0.0, 1e-6), "distributed_force": (0.01, 0.0, 0.0)}
    shapes = [
        tendonrod.solve(robot, 0.7, (-9.81, 0.0, 0.0)),
        tendonrod.solve(
            robot, 0.3, **loads, distributed_moment=(0.0, 1e-5, 0.0), insertion=0.5, rotation=radians(-10.0)
        ),
        tendonrod.solve(robot, insertion=0.0),
    ]
    assert [row["name"] for row in rows] == ["first", "second", "last, not least"]
    assert [row["tension_N"] for row in rows] == ["0.7", "0.3", "0"]
    for row, shape in zip(rows, shapes, strict=True):
        assert (row["status"], row["load_factor"]) == ("converged", "1.000000")
        np.testing.assert_allclose(tip(row), shape.tip, atol=1e-11)
        np.testing.assert_allclose(axis(row), shape.rotation[-1][:, 2], atol=1e-8)
    assert out.startswith("exonav-1, torsion published, 3 rows, ")
    assert "converged     3" in out


def test_gravity_and_scene_hold_for_all_rows(solved, table):
    rows, _ = solved("exonav-1", table("tension_n\n0.7\n0.6\n"), "--gravity", "-9.81,0,0", "--scene", CORD)
    robot, scene = tendonrod.load_robot("exonav-1"), read_scene(CORD)
    for row, tau in zip(rows, (0.7, 0.6), strict=True):
        np.testing.assert_allclose(
            tip(row), tendonrod.solve(robot, tau, (-9.81, 0.0, 0.0), **scene.arguments).tip, atol=1e-11
        )


def test_centroid_weight_and_torsion_hold_for_all_rows(solved, table):
    given = ("--gravity", "-9.81,0,0", "--centroid-weight", "--torsion", "open_section")
    rows, _ = solved("exonav-1", table("tension_N\n0.7\n"), *given)
    robot = tendonrod.load_robot("exonav-1").replace(torsion="open_section")
    np.testing.assert_allclose(
        tip(rows[0]), tendonrod.solve(robot, 0.7, (-9.81, 0.0, 0.0), centroid_weight=True).tip, atol=1e-11
    )


def test_rows_by_displacement_or_tension(solved, table):
    rows, _ = solved("exonav-1", table("displacement_mm,tension_n\n2.5,0\n,0.5\n-,0.7\n"))
    robot = tendonrod.load_robot("exonav-1")
    shapes = [tendonrod.solve(robot, displacements=0.0025), *(tendonrod.solve(robot, tau) for tau in (0.5, 0.7))]
    for row, shape in zip(rows, shapes, strict=True):
        np.testing.assert_allclose(tip(row), shape.tip, atol=1e-11)
        assert float(row["solved_tension_N"]) == pytest.approx(shape.tensions[0], abs=1e-8)


def test_several_tendons(solved, table):
    path = table("tension_1_N,tension_2_N,tension_4_N,tension_3_N\n15,0,2,0\n")
    rows, _ = solved(FOUR, path)
    shape = tendonrod.solve(tendonrod.load_robot(FOUR), (15.0, 0.0, 0.0, 2.0))
    np.testing.assert_allclose(tip(rows[0]), shape.tip, atol=1e-11)
    rows, _ = solved(FOUR, table("displacement_1_mm\n3\n"))
    assert float(rows[0]["solved_tension_1_N"]) > 0.0
    assert float(rows[0]["solved_tension_2_N"]) == 0.0


def test_what_a_batch_wrote_can_be_read_again(solved, run, table, tmp_path):
    first, again = solved("exonav-1", table("note,tension_N\na,0.7\n"))[0], tmp_path / "again.csv"
    assert run("batch", "exonav-1", tmp_path / "results.csv", "--output", again)[0] == 0
    assert list(csv.DictReader(again.open())) == first


def test_a_row_without_equilibrium_is_told_and_the_others_are_written(run, table, tmp_path):
    output = tmp_path / "results.csv"
    path = table("tension_n,tip_moment_x_nm\n0.7,0\n0,1e6\n0.5,0\n")
    status, out, err = run("batch", "exonav-1", path, "--output", output)
    rows = list(csv.DictReader(output.open()))
    assert status == 1
    assert [row["status"] == "converged" for row in rows] == [True, False, True]
    assert (rows[1]["tip_x_mm"], rows[1]["error_mm"]) == ("", "")
    assert err.endswith(f"error: row 2: no equilibrium found; the column status of {output} says why\n")
    assert rows[1]["status"] in out


def test_json_is_a_summary(run, result, table, tmp_path):
    output = tmp_path / "results.csv"
    told = result("batch", "exonav-1", table("tension_n\n0.7\n0.5\n"), "--output", output)
    assert (told["robot"], told["torsion"], told["rows"]) == ("exonav-1", "published", 2)
    assert (told["counts"], told["failed"], told["output"]) == ({"converged": 2}, [], str(output))
    assert told["seconds"] > 0.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "table.csv = empty: must be a header and rows: any of tension_N, displacement_mm, insertion"),
        ("tension_n\n", "table.csv: rows = none: must be given below the header"),
        ("name,colour\na,b\n", "table.csv: header = name, colour: must be any of tension_N, displacement_mm"),
        ("tension\n1\n", "column 1 = 'tension': must be one of tension_N, displacement_mm"),
        ("gravity_x\n1\n", "column 1 = 'gravity_x': must be one of tension_N"),
        ("tip_force_x_mN\n1\n", "column 1 = 'tip_force_x_mN': must be one of tension_N"),
        ("tension_n,tension_N\n1,1\n", "column 2 = 'tension_N': must be given once; column 1 has it"),
        ("tension_n\n0.5\n-1\n", "row 2 (line 3), column 1 tension_n = -1.0: must be >= 0"),
        ("tension_n\nabc\n", "row 1 (line 2), column 1 tension_n = 'abc': must be a finite number >= 0"),
        ("insertion,tension_n\n2,1\n", "row 1 (line 2), column 1 insertion = 2.0: must be from 0 to 1"),
        ("tension_n,gravity_z_m_s2\n1,nan\n", "row 1 (line 2), column 2 gravity_z_m_s2 = nan: must be a finite number"),
        ("tension_n,gravity_z_m_s2\n1,\n", "row 1 (line 2), column 2 gravity_z_m_s2 = empty: must be a finite number"),
        ("tension_n,insertion\n1\n", "row 1 (line 2): cells = 1: must be 2, as many as the header has"),
        ("displacement_mm\nfar\n", "row 1 (line 2), column 1 displacement_mm = 'far': must be a finite number, or"),
        (
            "displacement_mm,tension_n\n1,0\n2,0.5\n",
            "row 2 (line 3), column 2 tension_n = 0.5: must be 0 where displacement_mm is given",
        ),
    ],
)
def test_bad_tables(refused, table, tmp_path, text, said):
    line = refused("batch", "exonav-1", table(text), "--output", tmp_path / "results.csv")
    assert "table.csv" in line
    assert said in line
    assert not (tmp_path / "results.csv").exists()


def test_one_column_per_tendon_or_none(refused, table, tmp_path):
    line = refused("batch", FOUR, table("tension_1_n\n1\n"), "--output", tmp_path / "out.csv")
    assert "table.csv: column tension_2_N = missing: must be in the header, with the others' tensions" in line


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--output = missing: must be given; see tendonrod batch --help"),
        (("--output", "out.txt"), "--output = out.txt: must be a file name that ends in .csv"),
        (("--output", "table.csv"), "--output = table.csv: must be another file than TABLE.csv"),
        (("--output", "out.csv", "--threads", "0"), "--threads = 0: must be a whole number from 1 to 1024"),
        (("--output", "out.csv", "--scene", "no.toml"), "--scene = no.toml: must be an existing TOML file"),
        (("--output", "out.csv", "--gravity", "0,0,-9.81"), "--gravity = 0,0,-9.81: must be left out where table.csv"),
    ],
)
def test_bad_options(refused, table, tmp_path, monkeypatch, options, said):
    monkeypatch.chdir(tmp_path)
    text = "tension_n,gravity_x_m_s2\n0.5,1\n"
    table(text)
    assert refused("batch", "exonav-1", "table.csv", *options).startswith(said)
    assert (tmp_path / "table.csv").read_text() == text


def test_a_missing_table_is_named(refused, tmp_path):
    line = refused("batch", "exonav-1", tmp_path / "no.csv", "--output", tmp_path / "out.csv")
    assert line == f"TABLE.csv = {tmp_path / 'no.csv'}: must be an existing CSV file"
    assert refused("batch", "exonav-1") == "TABLE.csv = missing: must be given; see tendonrod batch --help"


@pytest.mark.parametrize("column", ["tension_n", "displacement_mm"])
def test_an_interrupt_writes_what_is_done(run, table, tmp_path, monkeypatch, column):
    """The interrupt comes once the first rows are reported."""
    import tendonrod.cli.output

    class Interrupting:
        sent = False

        def watch(self, done, total, what=None):
            if not self.sent:
                self.sent = True
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.01)

    monkeypatch.setattr(tendonrod.cli.output, "_Lines", lambda what: Interrupting())
    output = tmp_path / "results.csv"
    given = table(f"{column},gravity_x_m_s2\n" + "0.5,-9.81\n" * 3000)
    before = signal.getsignal(signal.SIGINT)
    status, out, err = run("batch", "exonav-1", given, "--output", output, "--threads", "1")
    rows = list(csv.DictReader(output.open()))
    done = [row for row in rows if row["status"] == "converged"]
    assert (status, len(rows)) == (130, 3000)
    assert 0 < len(done) < 3000
    assert {row["status"] for row in rows} == {"converged", "not_reached"}
    assert all(row["tip_x_mm"] for row in done)
    assert err.splitlines()[-2:] == [
        f"tendonrod: stopped with {len(done)} of 3000 rows done; they are in {output}",
        "tendonrod: interrupted",
    ]
    assert "not_reached" in out
    assert signal.getsignal(signal.SIGINT) is before


def test_it_runs_outside_the_main_thread_too(run, table, tmp_path):
    got = []
    given = ("batch", "exonav-1", table("tension_n\n0.5\n"), "--output", tmp_path / "results.csv")
    thread = threading.Thread(target=lambda: got.append(run(*given)[0]))
    thread.start()
    thread.join()
    assert got == [0]


def test_the_process_prints_progress_and_results_apart(table, tmp_path):
    output = tmp_path / "results.csv"
    command = [*COMMAND, "batch", "exonav-1", table("tension_n\n0.7\n"), "--output", str(output), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert '"rows": 1' in done.stdout
    assert f"tendonrod: wrote {output}" in done.stderr
