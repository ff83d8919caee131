"""`tendonrod rig`: what the commands print, write and refuse, and how they end."""

import json

import numpy as np
import pytest

from rig.short_trials import DOWN, FAST_FILE, bench_file, robot
from tendonrod.cli import rig_page
from tendonrod.measurement.trialfile import read_trial
from tendonrod.rig.record import read_record
from tendonrod.rig.states import Fault, FaultKind, Reaction, State

FTL = ("rig", "ftl", "exonav-1", "--target", "0.7")
FAST = ("--end", "0.1", "--screw-rate-mm-s", "2")
JUMP = '[[fault]]\nkind = "load cell jumps"\ntime_s = 3\nvalue_n = 0.8\n'


@pytest.fixture
def bench(tmp_path):
    """Writes a bench file: the fast one, and what is added."""
    return lambda more="": bench_file(tmp_path, more)


@pytest.fixture(autouse=True)
def pages(monkeypatch):
    """The page takes seconds and has its own tests: which trials went to it, and where."""
    asked = []

    def write_bench(found, out, watch=None):
        asked.append((list(found), out))
        (out / "index.html").write_text("page")
        return out / "index.html"

    monkeypatch.setattr("tendonrod.report.bench.write_bench", write_bench)
    return asked


def test_trials_are_run_recorded_exported_and_reported(run, bench, tmp_path, pages):
    out = tmp_path / "new"
    status, said, noted = run(*FTL, *FAST, "--bench", bench(), "--trials", 2, "--seed", 4, "--output", out)
    assert status == 0, noted
    (found, where) = pages[0]
    assert (len(found), where) == (2, out)
    for k in (1, 2):
        record, trial = read_record(out / f"trial-{k}.rec"), read_trial(out / f"trial-{k}.nc")
        assert record.is_complete
        assert record.header["seed"] == 3 + k
        assert trial.time.size == len(record.frames)
        for name in (f"trial-{k}.rec", f"trial-{k}.nc"):
            assert f"wrote {out / name}" in noted
    assert "torsion homogenized" in said
    assert "virtual bench, not a measurement" in said
    assert "3.64, 3.63, 3.75 mm" in said
    assert "1.07 mm" in said
    rows = [line.split() for line in said.splitlines() if line[:5].strip() in ("1", "2")]
    assert [row[:3] for row in rows] == [["1", "4", "done"], ["2", "5", "done"]]
    assert float(rows[0][4]) == pytest.approx(1e3 * found[0].rmse[0], abs=6e-4)


def test_the_same_seed_gives_the_same_samples_and_options_reach_the_bench(result, bench, tmp_path):
    options = ("--tendon-friction", "0.2", "--outer-friction-n", "0.1", "--tracker-mass-g", "0.5", "--kp", "40")
    told = [result(*FTL, *FAST, "--bench", bench(), "--seed", 7, *options, "--output", tmp_path / x) for x in "ab"]
    one, other = (read_record(tmp_path / x / "trial-1.rec") for x in "ab")
    assert one.samples.tobytes() == other.samples.tobytes()
    assert one.frames.tobytes() == other.frames.tobytes()
    assert told[0]["trials"][0]["tip_rmse"] == told[1]["trials"][0]["tip_rmse"]
    setup = one.header["setup"]
    assert (setup["tendon_friction"], setup["outer_friction"], setup["tracker"]["mass"]) == (0.2, 0.1, 5e-4)
    assert (told[0]["kp"], told[0]["ki"], told[0]["feed_forward"]) == (0.04, 0.05, False)
    assert told[0]["gravity"] == list(DOWN)
    assert told[0]["paper"]["tip_rmse"]["trials"] == [3.6433e-3, 3.6288e-3, 3.7481e-3]


@pytest.mark.parametrize(("profile", "more"), [("paper", ()), ("polynomial", ("--feed-forward", "--rate-hz", "100"))])
def test_profiles(result, bench, tmp_path, profile, more):
    told = result(*FTL, *FAST, "--profile", profile, "--bench", bench(), *more, "--output", tmp_path / "o")
    (trial,) = told["trials"]
    assert (told["profile"], trial["done"], trial["fault"]) == (profile, True, None)
    assert trial["tension_error_rms"] < 0.05
    assert told["rate"] == (100.0 if more else 200.0)


def test_torsion_and_gravity_can_be_chosen(result, bench, tmp_path):
    options = ("--torsion", "open_section", "--gravity", "0,0,0", "--bench", bench())
    told = result(*FTL, *FAST, *options, "--output", tmp_path / "o")
    assert (told["torsion"], told["gravity"]) == ("open_section", [0.0, 0.0, 0.0])


def test_a_fault_is_one_line_and_the_record_complete(run, bench, tmp_path, pages):
    out = tmp_path / "o"
    status, said, noted = run(*FTL, *FAST, "--bench", bench(JUMP), "--trials", 3, "--output", out)
    assert status == 1
    (line,) = [line for line in noted.splitlines() if "error" in line]
    assert line.startswith("tendonrod: error: trial 1: tension changes too fast at 3.0")
    assert "N/s, allowed 15 N/s; release tension; trial-1.rec is complete" in line
    assert read_record(out / "trial-1.rec").is_complete
    assert not (out / "trial-2.rec").exists()
    assert len(pages[0][0]) == 1
    assert "tension changes too fast" in said
    replayed = run("rig", "replay", out / "trial-1.rec")
    assert replayed[0] == 0
    assert "fault" in replayed[1]
    told = json.loads(run("rig", "replay", out / "trial-1.rec", "--json")[1])
    assert told["complete"]
    assert [each["kind"] for each in told["faults"]] == ["tension changes too fast"]
    assert [text for _, text in told["states"]] == ["running", "fault"]


def test_no_frames_no_poses_but_a_trial_all_the_same(run, tmp_path, bench):
    blind = FAST_FILE.replace('kind = "virtual"', 'kind = "virtual"\ntracker = false')
    bench().write_text(blind)
    status, said, noted = run(*FTL, *FAST, "--bench", tmp_path / "bench.toml", "--output", tmp_path / "o")
    assert status == 0, noted
    trial = read_trial(tmp_path / "o" / "trial-1.nc")
    assert np.isnan(trial.position).all()
    assert np.isfinite(trial.tensions).any()
    row = next(line.split() for line in said.splitlines() if line[:5].strip() == "1")
    assert row[4:6] == ["-", "-"]


def test_nothing_is_overwritten(run, refused, bench, tmp_path):
    out = tmp_path / "o"
    out.mkdir()
    (out / "trial-2.nc").write_text("mine")
    said = refused(*FTL, *FAST, "--bench", bench(), "--trials", 2, "--output", out)
    assert said == (
        f"--output = {out}: must be a directory without trial-2.nc: nothing is overwritten; name another, "
        "or move away what is there"
    )
    assert [each.name for each in out.iterdir()] == ["trial-2.nc"]
    (out / "index.html").write_text("mine")
    assert "without index.html" in refused("rig", "design", "exonav-1", "--output", out)


def test_a_motion_from_a_file(result, bench, tmp_path):
    (tmp_path / "motion.csv").write_text("insertion,tension_N,rotation_deg,time_s\n0,0.1,0,0\n0.05,0.3,10,2\n")
    told = result("rig", "run", tmp_path / "motion.csv", "--bench", bench(), "--output", tmp_path / "o")
    assert (told["done"], told["task"]) == (True, "progressive motion")
    assert told["tension_error_max"] < 0.1
    samples = read_record(tmp_path / "o" / "run.rec").samples
    assert samples["translation"]["position"].max() == pytest.approx(0.05 * robot().section.L, abs=1e-4)
    assert (tmp_path / "o" / "run.nc").is_file()


@pytest.mark.parametrize(("axis", "insertion"), [("screw", 0.0), ("translation", 0.06)])
def test_a_tension_is_held(run, bench, tmp_path, axis, insertion):
    options = ("--axis", axis, "--insertion", insertion, "--bench", bench(), "--output", tmp_path / "o")
    status, said, noted = run("rig", "hold", "--tension", "0.3", "--duration", "1", *options)
    assert status == 0, noted
    assert "holding the tension" in said
    record = read_record(tmp_path / "o" / "hold.rec")
    held = record.time >= next(each.time for each in record.messages if each.text == "holding the tension")
    running = held & (record.states == State.RUNNING)
    assert np.mean(record.samples["force"]["tension"][running]) == pytest.approx(0.3, abs=0.02)


def test_a_virtual_robot_is_inserted_and_retracted(result, bench, tmp_path):
    options = ("--from", "0.1", "--screw-rate-mm-s", "2", "--bench", bench(), "--output", tmp_path / "o")
    told = result("rig", "retract", "--target", "0.7", *options)
    assert (told["done"], told["task"]) == (True, "follow the leader, then retract")


def test_a_tendon_is_released(run, bench, tmp_path):
    taut = bench("[tendon]\nslack_mm = -1\n")
    assert "release it first" in run(*FTL, *FAST, "--bench", taut, "--output", tmp_path / "a")[2]
    status, said, noted = run("rig", "release", "--bench", taut, "--output", tmp_path / "b")
    assert status == 0, noted
    assert "release the tendon" in said


def test_design(run, tmp_path):
    pytest.importorskip("control")
    status, said, noted = run("rig", "design", "exonav-1", "--output", tmp_path / "o")
    assert status == 0, noted
    assert "torsion homogenized" in said
    assert (tmp_path / "o" / "index.html").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((*FTL, "--trials", "0"), "--trials = 0: must be a whole number from 1 to 1000"),
        ((*FTL, "--rate-hz", "50"), "--rate-hz = 50.0: must be from 100 to 1000"),
        ((*FTL, "--kp", "0"), "--kp = 0.0: must be > 0"),
        ((*FTL, "--profile", "best"), "--profile = 'best': must be one of plan, polynomial, paper"),
        ((*FTL, "--plan", "a.csv", "--profile", "paper"), "--plan = a.csv: must be left out with --profile paper"),
        ((*FTL, "--seed", "-1"), "--seed = -1: must be a whole number from 0"),
        ((*FTL, "--bench", "none.toml"), "--bench = none.toml: must be an existing TOML file"),
        ((*FTL, "--tracker-mass-g", "-1"), "--tracker-mass-g = -1.0: must be >= 0"),
        ((*FTL, "--torsion", "mine"), "--torsion = 'mine': must be one of published"),
        ((*FTL, "--homed"), "--homed = given: must be left out with a virtual bench"),
        ((*FTL[:3], "--target", "3"), "--target = 3 N: must be at most"),
        ((*FTL, "--screw-rate-mm-s", "30"), "--screw-rate-mm-s = 30: must be at most the screw's speed"),
        (("rig", "ftl", "exonav-9", "--target", "0.7"), "did you mean exonav-"),
        (("rig", "hold", "--tension", "2", "--duration", "1"), "--tension = 2 N: must be at most"),
        (("rig", "hold", "--tension", "1", "--duration", "0"), "--duration = 0.0: must be > 0"),
        (("rig", "run", "none.csv"), "file = none.csv: must be an existing CSV file"),
    ],
)
def test_bad_input_is_one_line_before_anything_is_written(refused, tmp_path, arguments, said):
    assert said in refused(*arguments, "--output", tmp_path / "o")
    assert not list(tmp_path.glob("o/*.rec"))


def test_options_of_a_virtual_bench_are_refused_with_devices(refused, tmp_path):
    path = tmp_path / "bench.toml"
    cell = "[load_cell]\ncounts_per_newton = 1349\nzero_counts = 32768\nfull_scale_n = 22.24\n"
    path.write_text('[bench]\nkind = "devices"\n[launchpad]\nport = "/dev/none"\n' + cell)
    for option in (("--tendon-friction", "0.1"), ("--tracker-mass-g", "1"), ("--real-time",)):
        said = refused(*FTL, "--bench", path, *option, "--output", tmp_path / "o")
        assert said.startswith(f"{option[0]} = ")
        assert "left out with the devices of" in said
    pytest.importorskip("serial")
    said = refused(*FTL, "--bench", path, "--output", tmp_path / "o", status=1)
    assert said.startswith("/dev/none: there is no such port")


def test_help_tells_the_commands(run):
    status, said, _ = run("rig")
    assert status == 0
    for name in ("ftl", "run", "hold", "retract", "release", "replay", "export", "design"):
        assert f"\n  {name} " in said
        status, help_text, _ = run("rig", name, "--help")
        assert status == 0
        assert f"tendonrod rig {name}" in help_text
        assert "Examples:" in help_text
    assert "did you mean ftl?" in run("rig", "flt")[2]


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (
            Fault(kind=FaultKind.TRAVEL, time=1.5, reaction=Reaction.HOLD, value=3.2, limit=3.15, where="rotation"),
            "axis beyond its travel (rotation) at 1.500 s: 3.2 rad, allowed 3.15 rad; hold",
        ),
        (
            Fault(kind=FaultKind.SPEED, time=1.0, reaction=Reaction.HOLD, value=0.01, limit=0.006, where="screw"),
            "axis faster than allowed (screw) at 1.000 s: 0.01 m/s, allowed 0.006 m/s; hold",
        ),
        (
            Fault(kind=FaultKind.EMERGENCY, time=2.0, reaction=Reaction.STOP, where="space"),
            "emergency stop (space) at 2.000 s; stop",
        ),
    ],
)
def test_a_faults_line_has_the_unit(fault, said):
    assert rig_page.fault_line(fault) == said
    assert json.dumps(rig_page.fault_dict(fault), allow_nan=False)
