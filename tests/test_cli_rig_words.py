"""What `tendonrod rig` refuses or warns of, in words that name the option or the file, the unit and the reason."""

from types import SimpleNamespace

import pytest

from rig.short_trials import FAST_FILE, bench_file, robot
from tendonrod.cli import rig_ending
from tendonrod.rig.benches import VirtualSource
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.states import Fault, FaultKind, Reaction
from tendonrod.rig.trials import limits_of
from tendonrod.rig.virtual.setup import VirtualSetup

FTL = ("rig", "ftl", "exonav-1", "--target", "0.7")
DOWN = "--gravity=-9.81,0,0"
DEVICES = """[bench]
kind = "devices"
[launchpad]
port = "x"
timeout_ms = 5000
[load_cell]
counts_per_newton = 1
zero_counts = 1
full_scale_n = 1
"""
VIRTUAL = '[bench]\nkind = "virtual"\n'


@pytest.fixture
def said(refused, tmp_path):
    """The line on a refused command; FILE is a file of the text given, and nothing may be left of the output."""

    def call(*arguments, file="", name="file.toml"):
        (tmp_path / name).write_text(file)
        path = str(tmp_path / name)
        line = refused(*(each.replace("FILE", path) for each in arguments), "--output", tmp_path / "o")
        assert not (tmp_path / "o").exists()
        return line.replace(path, "FILE")

    return call


def test_a_robot_that_its_load_alone_spoils(said):
    heavy = said(*FTL, "--tracker-mass-g", "5", DOWN)
    assert heavy.startswith(
        "--tracker-mass-g = 5 with gravity -9.81,0,0 m/s2: must be less: exonav-1, torsion homogenized"
    )
    assert "leaves linear elasticity with its tendon slack" in heavy
    strong = said(*FTL, "--bench", "FILE", file=f"{VIRTUAL}gravity_m_s2 = [-981, 0, 0]\n")
    assert strong.startswith("FILE: bench.gravity_m_s2 = -981,0,0 m/s2: must be less")
    assert said(*FTL, "--gravity=-981,0,0").startswith("--gravity = -981,0,0 m/s2: must be less")


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("rig", "ftl", "exonav-1", "--target", "2"), "--target = 2 N"),
        (("rig", "ftl", "exonav-1", "--target", "700"), "--target = 700 N"),  # before it is planned, which would buckle
        (("rig", "hold", "--tension", "5", "--duration", "1"), "--tension = 5 N"),
        (("rig", "retract", "--target", "3"), "--target = 3 N"),
        (("rig", "run", "FILE"), "FILE: column tension_N = up to 2 N"),
    ],
)
def test_a_tension_above_the_soft_limit_names_option_unit_and_reason(said, arguments, field):
    line = said(*arguments, file="insertion,tension_N\n0,0.1\n1,2\n", name="motion.csv")
    limits, _ = limits_of(VirtualSource(setup=VirtualSetup(robot=robot())))
    most = f"{limits.soft * limits.tension:.4g} N, the soft limit: {limits.soft:g} of {limits.tension:.4g} N"
    assert line.startswith(f"{field}: must be at most {most}, which is 0.9 of what brings exonav-1")
    assert "end of linear elasticity; limits.tension_n of a bench file" in line


def test_a_limit_of_the_bench_file_is_named(said):
    hold = ("rig", "hold", "--tension", "0.29", "--duration", "1", "--bench", "FILE")
    line = said(*hold, file=f"{VIRTUAL}[limits]\ntension_n = 0.3\n")
    assert line == "--tension = 0.29 N: must be at most 0.27 N, the soft limit: 0.9 of limits.tension_n = 0.3 in FILE"


def test_profiles_are_held_against_the_limit_by_what_made_them(said):
    paper = said(*FTL, DOWN, "--profile", "paper", "--tracker-mass-g", "0.8")
    assert paper.startswith("--profile = paper, up to 0.7421 N: must be at most 0.7")
    plan = said(*FTL, "--plan", "FILE", file="insertion,tension_N\n0,0.1\n1,2\n", name="plan.csv")
    assert plan.startswith("FILE: column tension_N = up to 2 N: must be at most")
    back = said(*FTL, "--plan", "FILE", file="insertion,tension_N\n0.5,0.1\n0.4,0.2\n", name="plan.csv")
    assert back.startswith("FILE: column insertion = [0.5, 0.4]: must be")


@pytest.mark.parametrize(
    ("arguments", "file", "line"),
    [
        (("--end", "0"), "", "--end = 0.0: must be from 0.06 to 1"),
        (
            ("--bench", "FILE", "--gravity", "0,0,0"),
            f"{VIRTUAL}gravity_m_s2 = [0, 0]\n",
            "FILE: bench.gravity_m_s2 = [0.0, 0.0]: must be a vector of 3 finite numbers",
        ),
        (
            ("--bench", "FILE"),
            f"{VIRTUAL}[tendon]\nlength_mm = 0.3\n",
            "FILE: tendon.length_mm = 0.3: must be > 75.4434 mm, its path in the robot",
        ),
        (
            ("--bench", "FILE"),
            f"{VIRTUAL}[fault]\ntime_s = 1\n",
            "FILE: fault = {'time_s': 1}: must be headed by two brackets, [[fault]], once for each",
        ),
        (
            ("--bench", "FILE"),
            DEVICES,
            "FILE: launchpad.timeout_ms = 5000.0: must be from 1 to 1000",
        ),
    ],
)
def test_options_and_keys_speak_their_own_unit(said, arguments, file, line):
    assert said(*FTL, *arguments, file=file) == line


def test_the_screws_rate_is_said_in_its_options_unit(said):
    line = said(*FTL, DOWN, "--profile", "paper", "--screw-rate-mm-s", "3")
    assert line == "--screw-rate-mm-s = 3: must be at most the screw's speed, 0.5 mm/s"


def test_times_of_a_motion_increase(said):
    file = "insertion,tension_N,time_s\n0,0.1,0\n0.1,0.2,2\n0.2,0.2,1\n"
    line = said("rig", "run", "FILE", file=file, name="motion.csv")
    assert line == "FILE: row 3, column time_s = 1.0: must be later than 2, that of the row above"


def test_a_rotation_that_the_motor_cannot_do_is_refused_in_degrees_before_the_bench_opens(said):
    """The natural mistake: the motor's angle in place of the section's, which turns it twice as far."""
    file = "insertion,tension_N,rotation_deg\n0,0.1,0\n1,0.2,360\n"
    line = said("rig", "run", "FILE", file=file, name="motion.csv")
    assert line.startswith("FILE: column rotation_deg = from 0 to 360 deg: must be such that the motor")
    assert "stays from -540 to 180 deg, full turns aside; it would go from -360 to 360 deg" in line
    assert "rotation of the section at the outer tube's exit: 0 throughout follows the leader" in line
    same = said(*FTL, "--plan", "FILE", file=file, name="plan.csv")
    assert same.startswith("FILE: column rotation_deg = from 0 to 360 deg")


def test_a_mass_without_gravity_is_warned_of(run, tmp_path):
    hold = ("rig", "hold", "--tension", "0.1", "--duration", "0.1", "--tracker-mass-g", "500")
    status, _, noted = run(*hold, "--output", tmp_path / "o")
    assert status == 0, noted
    assert "warning: 500 g hang on the robot, but without gravity they weigh nothing; give --gravity" in noted


@pytest.fixture
def no_page(monkeypatch):
    monkeypatch.setattr("tendonrod.report.bench.write_bench", lambda found, out, watch=None: out / "index.html")


def test_mixtures_are_warned_of_and_another_case_than_the_papers_is_called_so(run, tmp_path, no_page):
    (tmp_path / "plan.csv").write_text("insertion,tension_N\n0,0.5\n1,0.7\n")
    short = ("--bench", bench_file(tmp_path), "--end", "0.08", "--screw-rate-mm-s", "2")
    options = ("rig", "ftl", "exonav-1", "--target", "0.4", "--plan", tmp_path / "plan.csv", *short)
    status, said, noted = run(*options, "--output", tmp_path / "o")
    assert status == 0, noted
    assert "plan.csv does not say for which robot, torsion and gravity it was made; here it is exonav-1" in noted
    assert "plan.csv ends at 0.7 N, the tip is measured against the robot at --target 0.4 N" in noted
    assert "to full insertion: another case than here" in " ".join(said.split())
    status, said, noted = run(*FTL[:4], "0.5", "--profile", "paper", *short, "--output", tmp_path / "p")
    assert status == 0, noted
    assert "the paper's profile is of exonav-1 at 0.7 N" in noted
    assert "--target 0.5 N" in noted


def test_without_a_tracker_none_is_told(run, tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(FAST_FILE.replace('kind = "virtual"', 'kind = "virtual"\ntracker = false'))
    hold = ("rig", "hold", "--tension", "0.1", "--duration", "0.1", "--bench", path, "--output", tmp_path / "o")
    assert "no tracker" in " ".join(run(*hold)[1].split())


# How they end


def place(is_virtual=False, real_time=False):
    asked = SimpleNamespace(real_time=real_time, rehearse=None)
    return SimpleNamespace(is_virtual=is_virtual, file="my.toml", robot="exonav-3", asked=asked)


def test_an_output_that_nothing_came_to_be_in_is_taken_away(tmp_path):
    with pytest.raises(KeyboardInterrupt), rig_ending.fresh(str(tmp_path / "new"), ["a.rec"]):
        raise KeyboardInterrupt
    assert not (tmp_path / "new").exists()
    with rig_ending.fresh(str(tmp_path / "new"), ["a.rec"]) as folder:
        (folder / "a.rec").write_text("")
    assert (tmp_path / "new" / "a.rec").exists()
    (tmp_path / "mine").mkdir()
    with rig_ending.fresh(str(tmp_path / "mine"), []):
        pass
    assert (tmp_path / "mine").is_dir()


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    from tendonrod.cli import main

    out = tmp_path_factory.mktemp("held")
    assert main(["rig", "hold", "--tension", "0.2", "--duration", "0.2", "--output", str(out)]) == 0
    return out / "hold.rec"


def test_a_second_ctrl_c_keeps_the_record_and_says_how_to_let_the_tendon_go(held, tmp_path, capsys):
    path = tmp_path / "hold.rec"
    path.write_bytes(held.read_bytes())
    with pytest.raises(KeyboardInterrupt), rig_ending.kept(path, place()):
        raise KeyboardInterrupt
    noted = capsys.readouterr().err
    assert (tmp_path / "hold.nc").is_file()
    assert f"wrote {path}" in noted
    assert " N: tendonrod rig release --bench my.toml --robot exonav-3 lets it go" in noted
    with pytest.raises(KeyboardInterrupt), rig_ending.kept(tmp_path / "none.rec", place()):
        raise KeyboardInterrupt
    assert not capsys.readouterr().err


def test_a_record_without_a_sample_is_kept_too(tmp_path, capsys):
    path = tmp_path / "a.rec"
    Recorder(path, {}).close()
    with pytest.raises(KeyboardInterrupt), rig_ending.kept(path, place()):
        raise KeyboardInterrupt
    assert f"wrote {path}, complete" in capsys.readouterr().err


def test_advice_is_given_where_something_can_be_done():
    late = Fault(kind=FaultKind.COMMAND_TIMEOUT, time=0.2, reaction=Reaction.HOLD)
    stop = Fault(kind=FaultKind.EMERGENCY, time=0.2, reaction=Reaction.STOP, where="space")
    assert rig_ending.advice(place(is_virtual=True), late) == []
    (text,) = rig_ending.advice(place(is_virtual=True, real_time=True), late)
    assert "held up by others on this machine" in text
    assert "chrt" in text
    (text,) = rig_ending.advice(place(), stop)
    assert "tendonrod rig release --bench my.toml --robot exonav-3" in text
    assert rig_ending.advice(place(is_virtual=True), stop) == []


def test_a_plan_for_another_robot_is_refused_and_another_case_is_told(run, said, tmp_path, no_page):
    plan = tmp_path / "plan.csv"
    assert run("ftl", "exonav-1", "--target", "0.4", "--steps", "4", "--output", plan)[0] == 0
    other = said("rig", "ftl", "exonav-3", "--target", "0.4", "--plan", str(plan))
    assert other == f"--plan = {plan}, made for exonav-1: must be a plan for exonav-3"
    short = ("--bench", bench_file(tmp_path), "--end", "0.08", "--screw-rate-mm-s", "2", "--output", tmp_path / "o")
    status, _, noted = run("rig", "ftl", "exonav-1", "--target", "0.4", "--plan", plan, *short)
    assert status == 0, noted
    assert "plan.csv was made for torsion published, here homogenized" in noted
    status, _, noted = run("motion", plan, "--gravity", "0,0,-9.81")
    assert status == 0
    assert "plan.csv was made for gravity (0, 0, 0) m/s2, here (0, 0, -9.81)" in noted
