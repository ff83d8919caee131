"""NDI's track files: the same frames in each form are the same poses, and what drove the robot is found by time."""

import numpy as np
import pytest

from tendonrod.errors import InvalidInput
from tendonrod.measurement.loading import load_trials
from tendonrod.measurement.ndifile import read_ndi
from tendonrod.measurement.nditrack import is_ndi, read_track
from tendonrod.measurement.trial import KEPT, MISSING_POSE, NO_DRIVE, REPEATED_TIME, Tracker

BAD = ",".join(["-3.697314E28"] * 7)
BLOCK = "Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error"
TIP, BASE = Tracker(name="tip"), Tracker(name="base", on="base")
# Two tools, three frames; of the first tool the second is missing. Written as each program writes it.
FORMS = {
    "NDI Track": (
        f"Tools,Port 10: tip  s/n:12AB,{BLOCK},Port 11: base  s/n:34CD,{BLOCK}\n"
        "2,Port 10,400,OK,0.8,0,0.6,0,10.5,-3.25,-120,0.2,Port 11,400,OK,1,0,0,0,1,2,-150,0.1\n"
        "2,Port 10,401,MISSING,,,,,,,,,Port 11,401,OK,1,0,0,0,1,2,-150,0.1\n"
        "2,Port 10,402,OK,0.8,0,0.6,0,11.5,-3.25,-120,0.3,Port 11,402,OK,1,0,0,0,1,2,-150,0.1\n"
    ),
    "NDI Track with date, time, faces and markers": (
        "Date:=17:08:2026,09:30:00.000\n"
        "Tools,Port 0x0A: tip  s/n:1,Frame,Time [sec],Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers,State,Tx,Ty,Tz,"
        "Port 0x0B: base  s/n:2,Frame,Time [sec],Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers,State,Tx,Ty,Tz\n"
        "2,Port 0x0A: tip,400,10,1,OK,0.8,0,0.6,0,10.5,-3.25,-120,0.2,1,OK,1,2,3,"
        "Port 0x0B,400,10,1,OK,1,0,0,0,1,2,-150,0.1,1,OK,1,2,3\n"
        f"2,Port 0x0A: tip,401,10.025,1,Too Few Markers,{BAD},0.0,1,Off Angle,1,2,3,"
        "Port 0x0B,401,10.025,1,OK,1,0,0,0,1,2,-150,0.1,1,OK,1,2,3\n"
        "2,Port 0x0A: tip,402,10.05,1,OK,0.8,0,0.6,0,11.5,-3.25,-120,0.3,1,OK,1,2,3,"
        "Port 0x0B,402,10.05,1,OK,1,0,0,0,1,2,-150,0.1,1,OK,1,2,3\n"
    ),
    "the sample program of NDI's Combined API": (
        "#Tools,ToolInfo,Frame#,PortHandle,Face#,TransformStatus,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers,State,Tx,Ty,Tz\n"
        "2,tip s/n:1,400,Port:10,0,Enabled,0.8,0,0.6,0,10.5,-3.25,-120,0.2,1,OK,1,2,3,"
        "base s/n:2,400,Port:11,0,Enabled,1,0,0,0,1,2,-150,0.1,0\n"
        "2,tip s/n:1,401,Port:10,0,Missing,,,,,,,,,1,Missing,,,,"
        "base s/n:2,401,Port:11,0,Enabled,1,0,0,0,1,2,-150,0.1,0\n"
        "2,tip s/n:1,402,Port:10,0,PartiallyOutOfVolume,0.8,0,0.6,0,11.5,-3.25,-120,0.3,0,"
        "base s/n:2,402,Port:11,0,Enabled,1,0,0,0,1,2,-150,0.1,0\n"
    ),
    "WaveFront": (
        "Wav Time\tSensor 1 Id\tSensor 1 Frame\tSensor 1 State\tQ0\tQx\tQy\tQz\tTx\tTy\tTz\t \t"
        "Sensor 2 Id\tSensor 2 Frame\tSensor 2 State\tQ0.1\tQx.1\tQy.1\tQz.1\tTx.1\tTy.1\tTz.1\n"
        "10\t1\t400\tOK\t0.8\t0\t0.6\t0\t10.5\t-3.25\t-120\t\t2\t400\tOK\t1\t0\t0\t0\t1\t2\t-150\n"
        "10.025\t1\t401\tBad Fit\t1\t0\t0\t0\t0\t0\t0\t\t2\t401\tOK\t1\t0\t0\t0\t1\t2\t-150\n"
        "10.05\t1\t402\tOK\t0.8\t0\t0.6\t0\t11.5\t-3.25\t-120\t\t2\t402\tOK\t1\t0\t0\t0\t1\t2\t-150\n"
    ),
}
OLD = (
    "Collection Data : Port 01 ( Traxtal Tech S/N: 343BBC0E Type: 01000000 Rev: 000 ) [August 17, 2002 02:16AM]\n\n"
    "Frame, Q0, Qx, Qy, Qz, x, y, z,\n"
    "400, 0.8, 0, 0.6, 0, 10.5, -3.25, -120,\n401, , , , , , , ,\n402, 0.8, 0, 0.6, 0, 11.5, -3.25, -120,\n"
)


@pytest.fixture
def file(tmp_path):
    """Path of a file with this text."""

    def write(text: str, name: str = "track.csv") -> str:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def read(path, **options):
    return read_ndi(path, **({"robot": "exonav-1", "trackers": (TIP, BASE)} | options))


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_the_same_frames_in_each_form_are_the_same_poses(file, form):
    path = file(form)
    assert is_ndi(path)
    trial = read(path, tensions=np.full((3, 1), 0.5))
    np.testing.assert_allclose(trial.time, [10.0, 10.025, 10.05], rtol=1e-14)
    nothing = [np.nan] * 3
    np.testing.assert_array_equal(trial.position[:, 0], [[0.0105, -0.00325, -0.12], nothing, [0.0115, -0.00325, -0.12]])
    np.testing.assert_array_equal(trial.position[:, 1], [[0.001, 0.002, -0.15]] * 3)
    np.testing.assert_array_equal(trial.orientation[0, 0], [0.8, 0.0, 0.6, 0.0])
    assert trial.fates[:, 0].tolist() == [KEPT, MISSING_POSE, KEPT]
    assert trial.fates[:, 1].tolist() == [KEPT] * 3


def test_a_tool_per_file_as_older_programs_write_it(file):
    track = read_track(file(OLD))
    assert (track.tools, track.frame.tolist()) == (("Port 01",), [400.0, 401.0, 402.0])
    trial = read(file(OLD), trackers=None, tensions=np.full((3, 1), 0.5))
    assert [each.name for each in trial.trackers] == ["tip"]  # the only tool
    assert trial.fates[:, 0].tolist() == [KEPT, MISSING_POSE, KEPT]


@pytest.mark.parametrize(
    ("form", "tools"),
    list(zip(FORMS.values(), [("tip", "base")] * 3 + [("Sensor 1", "Sensor 2")], strict=True)),
    ids=FORMS,
)
def test_tools_have_their_names(file, form, tools):
    assert read_track(file(form)).tools == tools


def test_trackers_are_found_by_the_name_or_number_of_their_tool(file):
    path = file(FORMS["NDI Track"])
    swapped = read(path, trackers={"base": BASE, 1: TIP})
    assert [each.name for each in swapped.trackers] == ["base", "tip"]
    assert swapped.position[0, 1, 0] == 0.0105
    alone = read(path, trackers={"tip": TIP})
    assert alone.origin["tools left out"] == "base"
    with pytest.raises(InvalidInput, match=r"tool of tip = 'top': must be one of 1 tip, 2 base"):
        read(path, trackers={"top": TIP})
    with pytest.raises(InvalidInput, match=r"tools = tip, base: must be told what they are"):
        read(path, trackers=None)


def test_each_tool_has_one_tracker_and_is_asked_for_by_a_name_of_its_own(file):
    path = file(FORMS["NDI Track"])
    toml = file('robot = "exonav-1"\n[[trackers]]\nname = "tip"\n[[trackers]]\nname = "mid"\ntool = 1\n', "two.toml")
    with pytest.raises(InvalidInput, match=r"tool of mid = 1: must be another than that of tip, of 1 tip, 2 base"):
        read_ndi(path, toml)
    with pytest.raises(InvalidInput, match=r"tool of base = 1: must be another than that of tip"):
        read(path, trackers={"tip": TIP, 1: BASE})
    alike = file(FORMS["NDI Track"].replace("base  s/n", "tip  s/n"))
    with pytest.raises(InvalidInput, match=r"tool of tip = 'tip': must be told by its number.*1 tip, 2 tip"):
        read(alike, trackers={"tip": TIP})
    np.testing.assert_array_equal(read(alike, trackers={2: TIP}).position[:, 0], [[0.001, 0.002, -0.15]] * 3)


NO_FRAME = {
    "NDI Track": ("Port 10,401,MISSING", "Port 10,,MISSING"),
    "NDI Track, a zero": ("Port 10,401,MISSING", "Port 10,0,MISSING"),
    "the sample program of NDI's Combined API": ("tip s/n:1,401,Port:10,0", "tip s/n:1,,Port:10,"),
    "NDI Track with date, time, faces and markers": ("Port 0x0A: tip,401,10.025", "Port 0x0A: tip,,"),
}


@pytest.mark.parametrize(("form", "change"), NO_FRAME.items(), ids=NO_FRAME)
def test_a_missing_tool_without_a_frame_leaves_the_row_to_the_others(file, form, change):
    text = FORMS[form.removesuffix(", a zero")]
    assert change[0] in text
    trial = read(file(text.replace(*change)), tensions=np.full((3, 1), 0.5))
    np.testing.assert_allclose(trial.time, [10.0, 10.025, 10.05], rtol=1e-14)
    assert trial.fates.tolist() == [[KEPT, KEPT], [MISSING_POSE, KEPT], [KEPT, KEPT]]
    assert "rows whose tools have different frames" not in trial.origin


def test_the_frame_0_of_a_missing_tool_is_its_frame_where_there_is_no_other(file):
    track = read_track(file(frames(3).replace("1,Port 1,0,OK", "1,Port 1,0,MISSING")))
    assert track.frame.tolist() == [0.0, 1.0, 2.0]


def test_a_map_names_robot_tools_and_columns_of_the_drive(file):
    file(
        'robot = "exonav-1"\ngravity_m_s2 = [-9.81, 0, 0]\n[columns]\ntension = "cell [mN]"\n'
        '[[trackers]]\nname = "tip"\ntool = "tip"\n',
        "track.toml",
    )
    drive = file("time_s,cell [mN]\n10,100\n10.1,200\n", "drive.csv")
    (trial,) = load_trials(file(FORMS["NDI Track"]), drive=drive)
    np.testing.assert_allclose(trial.tensions[:, 0], [0.1, 0.125, 0.15])
    assert trial.gravity == (-9.81, 0.0, 0.0)
    assert trial.origin["drive"] == drive


def frames(count: int, start: int = 0) -> str:
    rows = (f"1,Port 1,{start + k},OK,1,0,0,0,1,2,3,0.1" for k in range(count))
    return f"Tools,Port 1,{BLOCK}\n" + "\n".join(rows) + "\n"


def test_a_drive_is_interpolated_within_its_ends_and_not_over_gaps(file):
    drive = file(
        "time_s,tension_N,insertion\n0.05,0.1,0.5\n0.15,0.3,0.7\n0.2,nan,0.8\n0.25,0.5,0.9\n1.0,2.0,1\n", "d.csv"
    )
    trial = read(file(frames(41)), trackers=None, drive=drive)
    time, tension = trial.time, trial.tensions[:, 0]
    within = (time >= 0.05 - 1e-12) & (time <= 0.25 + 1e-12)
    np.testing.assert_allclose(tension[within], 2.0 * time[within], atol=1e-12)  # over the missing value too
    np.testing.assert_allclose(trial.insertion[within], 0.4 + 2.0 * time[within], atol=1e-12)
    assert tension[40] == 2.0
    assert np.isnan(tension[~within][:-1]).all()
    assert (trial.fates[:, 0] == KEPT).sum() == within.sum() + 1
    assert (trial.fates[np.isnan(tension), 0] != KEPT).all()
    wide = read(file(frames(41)), trackers=None, drive=drive, max_gap=1.0)
    assert np.isfinite(wide.tensions[2:]).all()


def test_clocks_may_be_apart(file):
    drive = file("time_s,tension_N\n100,0\n101,1\n", "d.csv")
    track = file(frames(5, start=4000))  # 100 s at 40 frames per second
    same = read(track, trackers=None, drive=drive, max_gap=2.0)
    np.testing.assert_allclose(same.tensions[:, 0], np.arange(5) / 40.0, atol=1e-12)
    late = read(track, trackers=None, drive=drive, max_gap=2.0, offset=0.5)
    np.testing.assert_allclose(late.tensions, same.tensions + 0.5, atol=1e-12)
    first = read(file(frames(5, start=7), "late.csv"), trackers=None, drive=drive, max_gap=2.0, align="first")
    np.testing.assert_allclose(first.tensions, same.tensions, atol=1e-12)
    numbers = file("frame,tension_N\n4000,0\n4040,1\n", "f.csv")
    np.testing.assert_allclose(
        read(track, trackers=None, drive=numbers, max_gap=2.0).tensions, same.tensions, atol=1e-12
    )


def test_frames_are_counted_at_the_rate(file):
    trial = read(file(frames(4)), trackers=None, rate=60.0)
    np.testing.assert_allclose(trial.time, np.arange(4) / 60.0)
    assert trial.fates[:, 0].tolist() == [NO_DRIVE] * 4


def test_a_repeated_frame_has_its_fate(file):
    text = frames(2) + "1,Port 1,1,OK,1,0,0,0,1,2,3,0.1\n"
    assert read(file(text), trackers=None, tensions=np.ones((3, 1))).fates[2, 0] == REPEATED_TIME


def test_rows_whose_tools_have_different_frames_are_counted(file):
    text = FORMS["NDI Track"].replace("Port 11,401", "Port 11,402")
    assert read(file(text)).origin["rows whose tools have different frames"] == "1"


def test_errors_name_row_and_column(file):
    path = file(FORMS["NDI Track"].replace("10.5,-3.25", "10.5,here"))
    with pytest.raises(InvalidInput, match=r"row 1 \(line 2\), column 10 Ty = 'here': must be a number"):
        read(path)
    path = file(FORMS["NDI Track"].replace("OK,0.8,0,0.6", "OK,0.8,0,0.7"))
    with pytest.raises(
        InvalidInput, match=r"row 1 \(line 2\), column 5 Q0 = 0.8: must be Q0 of a quaternion of length 1"
    ):
        read(path)
    with pytest.raises(InvalidInput, match="without such a header: must be a track file of NDI's"):
        read(file("time_s,tension_N\n0,1\n"))
    sample = FORMS["the sample program of NDI's Combined API"]
    with pytest.raises(InvalidInput, match=r"row 1 \(line 2\), column 1 #Tools = 3"):
        read(file(sample.replace("\n2,tip", "\n3,tip", 1)))


def test_bad_drives_are_refused(file):
    track = file(frames(3))
    cases = {
        "time_s,tension_N\n0,1\n0,2\n": r"row 2 \(line 3\), time = 0.0: must be a number, after that of the row before",
        "clock,tension_N\n0,1\n": "column time = missing",
        "time_s,force_N\n0,1\n": "column tension = missing",
    }
    for text, said in cases.items():
        with pytest.raises(InvalidInput, match=said):
            read(track, trackers=None, drive=file(text, "d.csv"))
    with pytest.raises(InvalidInput, match="align = 'both': must be one of clock, first"):
        read(track, trackers=None, align="both")
