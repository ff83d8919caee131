"""`tendonrod trial`: what options change and what they leave, and whose word an error takes."""

import json
from dataclasses import replace

import numpy as np
import pytest

from measurement.trials import some_trial
from tendonrod import load_robot
from tendonrod.measurement.csvfile import write_csv
from tendonrod.measurement.trial import Trial
from tendonrod.measurement.trialfile import write_trial

NDI = "Tools,Port 1,Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Port 2,Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error\n" + "".join(
    f"2,Port 1,{k},OK,1,0,0,0,1,2,3,0.1,Port 2,{k},OK,1,0,0,0,7,8,9,0.1\n" for k in range(1000, 1005)
)
CSV = "time_s,tension_N,tip_x_mm,tip_y_mm,tip_z_mm\n0,0.5,1,2,70\n1,0.6,1,2,71\n"
ROBOT = ("--robot", "exonav-1")


@pytest.fixture
def file(tmp_path):
    def make(text: str | bytes, name: str) -> str:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return str(path)

    return make


@pytest.fixture(params=[".nc", ".csv"])
def bench(request, tmp_path) -> tuple[Trial, str]:
    """A trial and its file, which tells of holders and masses."""
    trial, path = some_trial(), tmp_path / f"bench{request.param}"
    (write_trial if request.param == ".nc" else write_csv)(trial, path)
    return trial, str(path)


def trackers(out: str) -> dict[str, dict]:
    return {each["name"]: each for each in json.loads(out)[0]["trackers"]}


def test_a_tracker_that_is_moved_keeps_its_holder_and_the_others_stay(run, bench):
    trial, path = bench
    before = trackers(run("trial", path, "--json")[1])
    for place, at in (("30mm", 0.03), ("30", 0.03), ("50 %", 0.5 * trial.robot.length_na), ("tip", None)):
        status, out, err = run("trial", path, "--tracker", f"middle={place}", "--json")
        assert status == 0, err
        after = trackers(out)
        assert after["middle"].pop("at") == pytest.approx(at)
        assert after["middle"] == {key: value for key, value in before["middle"].items() if key != "at"}
        assert {name: after[name] for name in ("base", "tip")} == {name: before[name] for name in ("base", "tip")}


def test_a_tracker_that_is_not_there_is_refused(refused, bench):
    _, path = bench
    said = refused("trial", path, "--tracker", "foo=30")
    assert "foo" in said
    assert "middle" in said
    assert refused("trial", path, "--tracker", "tip=95").startswith("--tracker = tip at 95 mm: must be on the robot")


@pytest.mark.parametrize(
    ("place", "said"),
    [("1", "with its unit, 1mm, or 100% of L_na"), ("-5", ">= 0"), ("middle", "tip, base"), ("120%", "from 0 to 100")],
)
def test_a_place_says_what_it_is(refused, file, place, said):
    told = refused("trial", file(CSV, "a.csv"), *ROBOT, "--tracker", f"tip={place}")
    assert told.startswith("--tracker tip = ")
    assert said in told


def test_tools_of_ndi_are_called_by_their_names(run, refused, file):
    path = file(NDI, "track.csv")
    for name in ("Port 2", "2"):
        status, out, _ = run("trial", path, *ROBOT, "--tracker", f"{name}=tip")
        assert status == 0
        assert "Port 2 as Port 2" in out
        assert "tools left out" in out
    said = refused("trial", path, *ROBOT, "--tracker", "Port 3=tip")
    assert said == (
        "--tracker = Port 3: must be one for each tool, in their order, or called as the tool; they are Port 1, Port 2"
    )
    _, out, _ = run("trial", path, *ROBOT, "--tracker", "base=base", "--tracker", "tip=tip")
    assert "Port 1 as base, Port 2 as tip" in out


def test_tools_of_the_map_keep_their_holders(run, file):
    path = file(NDI, "track.csv")
    file('robot = "exonav-1"\n[[trackers]]\nname = "t"\ntool = "Port 2"\noffset_mm = [0, 2, 0]\n', "track.toml")
    status, out, err = run("trial", path, "--tracker", "t=40", "--json")
    assert status == 0, err
    (told,) = json.loads(out)
    assert told["origin"]["tools"] == "Port 2 as t"
    np.testing.assert_allclose(told["trackers"][0]["arm"], [0.0, 0.002, 0.0])
    assert told["trackers"][0]["at"] == pytest.approx(0.04)


def test_clocks_that_do_not_meet_are_refused_and_part_of_them_is_told(run, refused, file):
    path, both = file(NDI, "track.csv"), ("--tracker", "base=base", "--tracker", "tip=tip")
    drive = ("--drive", file("time_s,tension_N\n100,0\n100.05,0.1\n", "drive.csv"))
    said = refused("trial", path, *ROBOT, *both, *drive)
    for part in ("100 to 100.05 s", "25 to 25.1 s", "--align", "--drive-offset"):
        assert part in said
    status, _, err = run("trial", path, *ROBOT, *both, *drive, "--align", "first")
    assert status == 0
    assert "samples outside the drive's times: 2 of 5" in err
    assert "--drive names the CSV file" in run("trial", path, *ROBOT, *both)[2]


def test_what_a_file_says_itself_needs_no_map_and_is_not_replaced_unseen(run, refused, tmp_path, file):
    path, other = tmp_path / "bench.nc", load_robot("exonav-2")
    trial = some_trial()
    robot = replace(load_robot("exonav-1"), name="exonav-1")
    some = {name: getattr(trial, name)[:, :1] for name in ("tensions", "displacements")}
    write_trial(replace(trial, robot=robot, **some), path)
    columns = file('robot = "exonav-2"\n', "other.toml")
    assert refused("trial", path, "--columns", columns).startswith(f"--columns = {columns}: must be left out: ")
    status, out, err = run("trial", path, "--robot", "exonav-2", "--gravity", "0,0,9.81", "--json")
    assert status == 0
    assert json.loads(out)[0]["robot"] == other.name
    assert (
        err
        == f"tendonrod: {path}: replaced by what the command line says: robot exonav-1, gravity (0, -9.81, 0) m/s2\n"
    )
    assert run("trial", path, "--robot", "exonav-1", "--gravity", "0,-9.81,0")[2] == ""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tension_noise_n = -1.0", "tension_noise_n = -1.0: must be >= 0"),
        ('[[trackers]]\nname = "tip"\nat_mm = 95.0', "trackers[0].at_mm = 95.0: must be from 0 to the robot's length"),
        ('delimiter = ":"', 'delimiter = \':\': must be one of ",", ";" and "tab"'),
        ('encoding = "nothing"', "encoding = 'nothing': must be the name of a text encoding"),
    ],
)
def test_errors_of_the_map_name_its_file_key_and_unit(run, file, text, said):
    columns = file(f'robot = "exonav-1"\n{text}\n', "map.toml")
    status, _, err = run("trial", file(CSV, "a.csv"), "--columns", columns)
    assert status == 2
    assert f"error: {columns}: {said}" in err
    assert " m\n" not in err


def test_options_are_named_as_they_are_typed(refused, file):
    path, columns = file(CSV, "a.csv"), file('robot = "exonav-1"\n', "map.toml")
    track = file(NDI, "track.csv")
    for arguments, said in {
        ("no.csv", *ROBOT): "FILE = no.csv: must be an existing CSV file",
        (columns,): f"FILE = {columns}: must be a file of measurements; a column map goes with --columns",
        (path, "--robot", "exonaut"): "--robot = 'exonaut'",
        (track, *ROBOT, "--align", "last"): "--align = 'last'",
        (track, *ROBOT, "--tracker", "a=tip", "--tracker", "b=tip", "--drive", "no.csv"): "--drive = no.csv: must be",
        (path, *ROBOT, "--drive", path): "--drive = ",
    }.items():
        assert refused("trial", *arguments).startswith(said)


def test_other_encodings(run, refused, file):
    text = CSV.replace("time_s", "Zeit (s),Kräfte").replace("\n0,", "\n0,1,").replace("\n1,", "\n1,1,")
    columns = file('robot = "exonav-1"\nencoding = "cp1252"\n[columns]\ntime = "Zeit"\n', "map.toml")
    told = refused("trial", file(text.encode("cp1252"), "lat.csv"), *ROBOT)
    for part in ("lat.csv: must be UTF-8 text; byte ", "CSV UTF-8", 'encoding = "cp1252"'):
        assert part in told
    for name, path in (
        ("lat.csv", columns),
        ("marked.csv", file('robot = "exonav-1"\n[columns]\ntime = "Zeit"\n', "m.toml")),
    ):
        content = text.encode("cp1252" if name == "lat.csv" else "utf-16")
        status, _, err = run("trial", file(content, name), "--columns", path)
        assert status == 0, err
        assert "columns left alone: Kräfte" in err


def test_titles_that_are_missing_or_nearly_there(refused, file):
    bare = "".join(CSV.splitlines(keepends=True)[1:])
    assert "titles = 0, 0.5, 1, ...: must be a row of titles, as time_s" in refused(
        "trial", file(bare, "bare.csv"), *ROBOT
    )
    assert "titles = 0, 0;0, 5: must be a row of titles" in refused(
        "trial", file("0,0;0,5\n1,0;0,6\n", "comma.csv"), *ROBOT
    )
    columns = file('robot = "exonav-1"\n[[trackers]]\nname = "tip"\nx = "Sonde X (mm)"\n', "map.toml")
    path = file(CSV.replace("tip_x_mm", "Sonde X"), "near.csv")
    assert "did you mean Sonde X?" in refused("trial", path, "--columns", columns)


def test_results_of_this_package_are_no_measurements(refused, file):
    header = "trial,tracker,sample,time_s,s_mm,tension_1_N,error_x_mm,error_y_mm,error_z_mm\na,tip,1,0,70,0.5,1,2,3\n"
    assert "tendonrod identify or validate wrote" in refused("trial", file(header, "residuals.csv"), *ROBOT)


def test_long_texts_of_the_origin_are_cut(run, tmp_path):
    path = tmp_path / "long.nc"
    write_trial(some_trial(origin={"truth": "x" * 1300}), path)
    _, out, _ = run("trial", path)
    line = next(each for each in out.splitlines() if each.startswith("truth"))
    assert line.endswith("xx... (1300 characters; --json shows all)")
    assert len(line) < 200
    assert "x" * 1300 in run("trial", path, "--json")[1]


def test_what_is_written_beside_a_csv_file_is_announced(run, bench, tmp_path):
    _, path = bench
    _, _, err = run("trial", path, "--output", tmp_path / "again.csv")
    assert [line.split()[2].rstrip(",").rpartition("/")[2] for line in err.splitlines()] == [
        "again.csv", "again.toml", "again-robot.toml",
    ]  # fmt: skip
