"""CSV files of measurements: what is written is read again to the last bit, however a bench spells it."""

from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest

from measurement.trials import some_trial
from tendonrod import load_robot
from tendonrod.errors import InvalidInput
from tendonrod.measurement.columnmap import ColumnMap, read_column_map
from tendonrod.measurement.csvfile import read_csv, write_csv
from tendonrod.measurement.loading import load_trials
from tendonrod.measurement.trial import KEPT, MISSING_POSE, NO_DRIVE, REPEATED_TIME, SAMPLED, Tracker
from tendonrod.measurement.units import parsed_title

HEADER = "time_s,tension_N,tip_x_mm,tip_y_mm,tip_z_mm"
ROWS = "0,0.5,1,2,70\n0.1,0.6,1,2,71\n"


@pytest.fixture
def file(tmp_path):
    """Path of a file with this text."""

    def write(text: str, name: str = "bench.csv") -> str:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def read(path, **options):
    return read_csv(path, **({"robot": "exonav-1"} | options))


def error(path, **options) -> str:
    with pytest.raises(InvalidInput) as caught:
        read(path, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def same(first, second) -> bool:
    return bool(np.all((first == second) | ((first != first) & (second != second))))


def test_what_is_written_is_read_again_to_the_last_bit(tmp_path):
    trial, path = some_trial(), tmp_path / "trial.csv"
    write_csv(trial, path)
    again = read_csv(path, path.with_suffix(".toml"))
    np.testing.assert_allclose(again.robot.section_table, trial.robot.section_table, rtol=1e-12, atol=1e-30)
    np.testing.assert_allclose(again.robot.tendon_table, trial.robot.tendon_table, rtol=1e-12, atol=1e-12)
    for name in SAMPLED:
        assert same(getattr(trial, name), getattr(again, name)), name
    for name in ("name", "gravity", "quality_limit", "position_noise", "tension_noise", "notes", "origin"):
        assert getattr(trial, name) == getattr(again, name), name
    np.testing.assert_allclose(again.T_world_field, trial.T_world_field, atol=1e-15)
    for one, other in zip(trial.trackers, again.trackers, strict=True):
        assert (one.name, one.on, one.at, one.point, one.offset, one.mass) == (
            other.name, other.on, other.at, other.point, other.offset, other.mass,
        )  # fmt: skip
        np.testing.assert_allclose(one.turn or 0.0, other.turn or 0.0, atol=1e-15)
    assert same(trial.fates, again.fates)


def test_a_preset_is_named_and_the_map_beside_is_found(file, tmp_path):
    trial = read(file(f"{HEADER}\n{ROWS}"), gravity=(-9.81, 0.0, 0.0))
    write_csv(trial, tmp_path / "again.csv")
    (again,) = load_trials(tmp_path / "again.csv")
    assert again.robot == load_robot("exonav-1")
    assert again.gravity == trial.gravity
    assert same(again.position, trial.position)


MAP = """
delimiter = ";"
[columns]
time = "t"
tension = "load cell"
[units]
t = "s"
"load cell" = "kgf"
px = "mm"
py = "mm"
[[trackers]]
name = "tip"
x = "px"
y = "py"
z = "pz"
"""
SPELLINGS = {
    "default": (f"{HEADER}\n{ROWS}", ""),
    "brackets": (
        "Time (ms),Tension [mN],tip x [m],TIP Y (cm),tip-z (um)\n0,500,.001,.2,7e4\n100,600,1e-3,2E-1,71000\n",
        "",
    ),
    "semicolons and decimal commas": (
        "time_s;tension_N;tip_x_mm;tip_y_mm;tip_z_mm\n0;0,5;1;2;70\n0,1;,6;1,0;2;71\n",
        "",
    ),
    "tabs": (f"{HEADER}\n{ROWS}".replace(",", "\t"), ""),
    "a comment, blank lines and an ending delimiter": (f"# bench 2\n{HEADER},\n\n{ROWS}".replace("\n0", ",\n0"), ""),
    "a map": (
        f"t;load cell;px;py;pz (mm)\n0;{0.5 / 9.80665};1;2;70\n0.1;{0.6 / 9.80665};1;2;71\n",
        MAP,
    ),
}


@pytest.mark.parametrize(("text", "toml"), SPELLINGS.values(), ids=SPELLINGS)
def test_a_file_says_the_same_in_any_spelling(file, text, toml):
    trial = read(file(text), columns=file(toml, "map.toml") if toml else None)
    np.testing.assert_allclose(trial.time, [0.0, 0.1], rtol=1e-15)
    np.testing.assert_allclose(trial.tensions[:, 0], [0.5, 0.6], rtol=1e-14)
    np.testing.assert_allclose(trial.position[:, 0], [[1e-3, 2e-3, 0.070], [1e-3, 2e-3, 0.071]], rtol=1e-15)
    assert (trial.fates == KEPT).all()


def test_what_is_shorter_than_the_robot_is_a_share_of_its_length(file):
    robot = load_robot("exonav-1")
    text = f"{HEADER},insertion_mm,rotation_deg\n0,0.5,1,2,3,{500 * robot.section.L!r},180\n1,0.5,1,2,3,0,-\n"
    trial = read(file(text))
    np.testing.assert_allclose(trial.insertion, [0.5, 0.0])
    np.testing.assert_allclose(trial.rotation, [np.pi, np.nan])


def test_missing_words_are_missing_values_and_have_their_fates(file):
    rows = "0,0.5,1,2,70\n1,nan,1,2,70\n2,-,1,2,70\n3,0.5,MISSING,2,70\n4,0.5,,,\n-,0.5,1,2,3\n"
    rows += "4,0.5,1,2,3\n5,.5,1,2,-3.697314E28\n"
    fates = read(file(f"{HEADER}\n{rows}")).fates[:, 0].tolist()
    missing = [MISSING_POSE] * 2
    assert fates == [KEPT, NO_DRIVE, NO_DRIVE, *missing, REPEATED_TIME, REPEATED_TIME, MISSING_POSE]


def test_states_are_told_and_decide_only_if_the_map_says_so(file):
    path = file(f"{HEADER},tip_state\n0,0.5,1,2,70,OK\n1,0.5,1,2,70,OUT\n2,0.5,,,,LOST\n")
    assert read(path).counts()["tip"] == {KEPT: 2, "missing pose (LOST)": 1}
    decided = read(path, columns=ColumnMap(usable_states=frozenset({"OK"})))
    assert decided.counts()["tip"] == {KEPT: 1, "missing pose (LOST)": 1, "missing pose (OUT)": 1}


def test_turns_as_quaternions_and_rotation_vectors_are_the_same(file):
    half = np.sqrt(0.5)
    quaternion = read(file(f"{HEADER},tip_qw,tip_qx,tip_qy,tip_qz\n0,1,1,2,3,{half},{half},0,0\n1,1,1,2,3,0,0,0,0\n"))
    vector = read(file(f"{HEADER},tip_rx_deg,tip_ry_deg,tip_rz_deg\n0,1,1,2,3,90,0,0\n1,1,1,2,3,,,\n"))
    np.testing.assert_allclose(quaternion.orientation, vector.orientation, atol=1e-15)
    assert quaternion.fates.tolist() == [[KEPT], [MISSING_POSE]]  # a quaternion of zeros fills a gap


def test_the_only_other_tracker_is_the_tip_and_several_must_be_told(file):
    one = read(file("time_s,base_x_mm,base_y_mm,base_z_mm,t1_x_mm,t1_y_mm,t1_z_mm\n0,1,2,3,4,5,6\n"))
    assert [(each.name, each.on, each.at) for each in one.trackers] == [("base", "base", None), ("t1", "robot", None)]
    two = file("time_s,a_x_mm,a_y_mm,a_z_mm,b_x_mm,b_y_mm,b_z_mm\n0,1,2,3,4,5,6\n")
    assert "trackers = a, b: must be told where they sit" in error(two)
    told = read(two, trackers=(Tracker(name="b"), Tracker(name="a", at=0.02)))
    np.testing.assert_allclose(told.position[0, :, 0], [0.004, 0.001])


def test_a_share_of_the_length_is_a_place(file):
    path = file('robot = "exonav-1"\n[[trackers]]\nname = "tip"\nat_share = 0.5\n', "map.toml")
    trial = read_csv(file(f"{HEADER}\n{ROWS}"), path)
    assert trial.places[0] == 0.5 * trial.robot.length_na


def test_columns_that_are_not_read_are_told(file):
    trial = read(file(f"{HEADER},room\n0,0.5,1,2,3,green\n"))
    assert trial.origin["columns not read"] == "room"


@pytest.mark.parametrize(
    ("title", "said"),
    [
        ("tension (N)", ("tension", "n")),
        ("Load cell [mN]", ("load_cell", "mn")),
        ("tip_x_mm", ("tip_x", "mm")),
        ("time ms", ("time", "ms")),
        ("tension_2_gf", ("tension_2", "gf")),
        ("tip_qw", ("tip_qw", None)),
        ("tension_1", ("tension_1", None)),
    ],
)
def test_titles_hold_a_name_and_a_unit(title, said):
    assert parsed_title(title) == said


BAD = {
    "no unit": (
        f"{HEADER}\n{ROWS}".replace("tension_N", "tension"),
        "column 2 tension = without a unit: must be one of N, mN",
    ),
    "grams": (
        f"{HEADER}\n{ROWS}".replace("tension_N", "tension (g)"),
        "in g: must be in one of N, mN, kgf, gf; write gf",
    ),
    "pounds": (
        f"{HEADER}\n{ROWS}".replace("tension_N", "tension_lbf"),
        "column 2 = 'tension_lbf': must be tension in one of N, mN",
    ),
    "no time": ("tension_N,tip_x_mm,tip_y_mm,tip_z_mm\n1,1,2,3\n", "column time = missing: must be in the header"),
    "no z": ("time_s,tension_N,tip_x_mm,tip_y_mm\n1,1,2,3\n", "column tip_x = missing"),
    "two times": (
        f"{HEADER},time_ms\n0,0.5,1,2,3,0\n",
        "column 6 = 'time_ms': must be given once; column 1 has time too",
    ),
    "a word": (
        f"{HEADER}\n0,0.5,1,2,3\n1,half,1,2,3\n",
        "row 2 (line 3), column 2 tension_N = 'half': must be a number",
    ),
    "underscores": (f"{HEADER}\n0,1_0,1,2,3\n", "row 1 (line 2), column 2 tension_N = '1_0'"),
    "infinite": (f"{HEADER}\n0,inf,1,2,3\n", "column 2 tension_N = 'inf'"),
    "short row": (f"{HEADER}\n0,0.5,1,2\n", "row 1 (line 2): cells = 4: must be 5, as many as the header has"),
    "decimal commas and commas": (f"{HEADER}\n0,0,5,1,2,3\n", "cells = 6: must be 5"),
    "both decimals": ("time_s;tension_N;tip_x_mm;tip_y_mm;tip_z_mm\n0;0,5;1.5;2;3\n", "numbers = 0,5 and 1.5"),
    "insertion": (
        f"{HEADER},insertion\n0,0.5,1,2,3,50\n",
        "row 1 (line 2), column 6 insertion = 50: must be from 0 to 1",
    ),
    "quality": (
        f"{HEADER},tip_quality_mm\n0,1,1,2,3,0\n1,1,1,2,3,-1\n",
        "row 2 (line 3), column 6 tip_quality_mm = -1",
    ),
    "quaternion": (
        f"{HEADER},tip_qw,tip_qx,tip_qy,tip_qz\n0,1,1,2,3,1,1,0,0\n",
        "row 1 (line 2), column 6 tip_qw = 1: must be of a quaternion",
    ),
    "three of four": (f"{HEADER},tip_qw,tip_qx,tip_qy\n0,1,1,2,3,1,0,0\n", "column tip_qz = missing"),
    "empty": ("", "empty: must be a header and rows"),
    "no rows": (HEADER, "rows = none: must be given below the header"),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=BAD)
def test_bad_files_are_refused_by_row_and_column(file, text, said):
    path = file(text)
    message = error(path)
    assert message.startswith(path)
    assert said in message, message


BAD_MAPS = {
    "unknown key": ('robots = "x"\n', "robots = 'x': must be one of the keys at the top"),
    "title": ("[columns]\ntime = 3\n", "columns.time = 3: must be a text in quotes"),
    "titles": ("[columns]\ntension = [1]\n", "columns.tension = [1]: must be a title in quotes, or a list of them"),
    "place": ('[[trackers]]\nname = "tip"\non = "wall"\n', "trackers[0].on = 'wall': must be one of robot, base"),
    "both places": (
        '[[trackers]]\nname = "tip"\nat_mm = 1\nat_share = 0.1\n',
        "at_share = 0.1: must be left out where at_mm",
    ),
    "mass": ('[[trackers]]\nname = "tip"\nmass_g = -1\n', "trackers[0].mass_g = -1.0: must be >= 0"),
    "share": ('[[trackers]]\nname = "tip"\nat_share = 2\n', "at_share of tip = 2.0: must be from 0 to 1"),
    "delimiter": ('delimiter = "|"\n', "delimiter = '|': must be one of"),
    "two decimals": ('delimiter = ","\ndecimal = ","\n', "decimal = ',': must be"),
    "quaternion": ('[[trackers]]\nname = "t"\nquaternion = ["a"]\n', "must be the titles of 4 columns"),
    "two brackets": ('[trackers]\nname = "t"\n', "must be tables, [[trackers]], with two brackets"),
}


@pytest.mark.parametrize(("toml", "said"), BAD_MAPS.values(), ids=BAD_MAPS)
def test_bad_maps_are_refused_by_key(file, toml, said):
    path = file(toml, "map.toml")
    with pytest.raises(InvalidInput) as caught:
        read_column_map(path)
    assert str(caught.value).startswith(path)
    assert said in str(caught.value), str(caught.value)


def test_a_column_of_the_map_must_be_there(file):
    toml = file('[columns]\ntime = "clock"\n', "map.toml")
    assert "column clock = missing: must be in the header, which has time_s, tension_N" in error(
        file(f"{HEADER}\n{ROWS}"), columns=toml
    )


def test_robot_and_fields_must_be_known(file):
    path = file(f"{HEADER}\n{ROWS}")
    with pytest.raises(InvalidInput, match="robot = missing"):
        read_csv(path)
    with pytest.raises(InvalidInput, match="robt = 1: must be a field of Trial"):
        read(path, robt=1)


def test_drive_is_for_track_files(file):
    path = file(f"{HEADER}\n{ROWS}")
    with pytest.raises(InvalidInput, match="drive"):
        load_trials([path], robot="exonav-1", drive=path)


def test_the_map_of_the_documentation_is_a_column_map(file):
    page = (Path(__file__).parents[2] / "docs" / "trials.rst").read_text(encoding="utf-8")
    block = page.partition(".. code-block:: toml\n")[2].partition("\n`tendonrod trial")[0]
    given = read_column_map(file(dedent(block), "docs.toml"))
    trial = read_csv(
        file(
            "t;Load cell 1 (mN);motor [mm];stage;turn [deg];Tx1 (mm);Ty1 (mm);Tz1 (mm);w1;i1;j1;k1;err1 (mm);flag1\n"
            "5;500;0,5;60;90;1;2;3;1;0;0;0;0,2;OK\n10;500;0,5;60;90;1;2;3;1;0;0;0;0,2;lost\n"
        ),
        ColumnMap(**{**vars(given), "delimiter": None}),
    )
    np.testing.assert_allclose(trial.time, [0.005, 0.01])
    assert (trial.tensions[0, 0], trial.displacements[0, 0]) == (0.5, 5e-4)
    assert trial.fates[:, 0].tolist() == [KEPT, MISSING_POSE]
