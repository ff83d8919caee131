"""`tendonrod navigate --bench`: what is wrong with a bench file, or with its robot, is told before all else."""

import pytest

from tendonrod import load_robot
from tendonrod.rig.benchfile import read_bench
from tendonrod.robotfile_writing import robot_text

VIRTUAL = '[bench]\nkind = "virtual"\n'
DEVICES = """[bench]
kind = "devices"
[launchpad]
port = "/dev/ttyACM0"
[load_cell]
counts_per_newton = 1349
zero_counts = 32768
full_scale_n = 22
"""


@pytest.fixture
def told(refused, tmp_path, monkeypatch):
    """The one line on a bench file with this text; the phantom must not be built for it."""
    monkeypatch.setattr("tendonrod.navigate.scenariofile.read_scenario", lambda *_, **__: pytest.fail("built"))
    path = tmp_path / "my.toml"

    def call(text, *options, status=2):
        path.write_text(text)
        more = ("--no-browser", "--port", "0", "--output", tmp_path)
        return refused("navigate", *more, "--bench", path, *options, status=status).replace(str(path), "FILE")

    return call


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[fault]]\nkind = "cell dropout"\ntime_s = 1\nat_s = 1\n', "fault[0].at_s = 1: must be one of the keys"),
        ("[screw]\nspeed_mm_s = -1\n", "screw.speed_mm_s = -1.0: must be > 0"),
        ("[screw]\nstart_mm = 500\n", "screw.start_mm = 500.0: must be from low_mm to high_mm"),
        ("[tendon]\nfriction = -1\n", "tendon.friction = -1.0: must be >= 0"),
        ("[limits]\nsoft = 3\n", "limits.soft = 3.0: must be from 0.05 to 1"),
        ("[limits]\ntension_n = 50\n", "limits.tension_n = 50.0: must be below 21.8 N, 98 % of the load cell's"),
        ("[limits]\ntension_n = 0.04\n", "limits.slack_n = missing: must be below soft * tension = 0.036"),
        ("[limits]\nrelease_rate_mm_s = 30\n", "limits.release_rate_mm_s = 30.0: must be at most screw.speed = 3"),
        (
            "[limits]\nscrew_travel_mm = [120, 300]\n",
            "limits.screw_travel_mm = [120.0, 300.0]: must be a travel that overlaps the axis' own, -30 to 110",
        ),
        (
            "[limits]\nrotation_travel_deg = [100, 200]\n",
            "limits.rotation_travel_deg = [100.0, 200.0]: must be a travel with 0 in it, where the axis stands when it",
        ),
    ],
)
def test_a_virtual_bench_is_looked_through_before_the_phantom_is_built(told, text, said):
    assert told(VIRTUAL + text).startswith(f"FILE: {said}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tare_readings = -1\n", "load_cell.tare_readings = -1: must be a whole number from 0"),
        ("[limits]\ntension_n = 22\n", "limits.tension_n = 22.0: must be below 21.56 N, 98 % of the load cell's full"),
        ("[limits]\ncommand_timeout_ms = 0\n", "limits.command_timeout_ms = 0.0: must be > 0"),
        ("[limits]\ntranslation_travel_mm = [1, 70]\n", "limits.translation_travel_mm = [1.0, 70.0]: must be a travel"),
        ('[[tool]]\nname = "tip"\n', "aurora = missing: must be given where there is a [[tool]]"),
    ],
)
def test_a_bench_of_devices_is_too_and_nothing_is_opened(told, text, said):
    assert told(DEVICES + text).startswith(f"FILE: {said}")


def test_a_port_that_is_not_there_is_told_too(told):
    pytest.importorskip("serial")
    said = told(DEVICES.replace("/dev/ttyACM0", "/dev/nowhere"), status=1)
    assert said.startswith("/dev/nowhere: there is no such port; other serial ports here: ")


def test_a_robot_that_does_not_fit_the_bench_is_told_so_too(told, tmp_path):
    robot = load_robot("exonav-1")
    (tmp_path / "two.toml").write_text(robot_text(robot.replace(tendons=2 * robot.tendons)))
    (tmp_path / "scene.toml").write_text('robot = "two.toml"\n')
    two, scene = tmp_path / "two.toml", tmp_path / "scene.toml"
    for bench in (VIRTUAL, DEVICES):
        for options, place in ((("--robot", two), "--robot"), (("--scene", scene), f"{scene}: robot")):
            assert told(bench, *options) == f"{place} = 'exonav-1 with 2 tendons': must be of one tendon"
    assert told(VIRTUAL, "--robot", "mermaid").startswith("--robot = ")


def test_a_bench_that_is_not_there_is_named_by_its_option(told, tmp_path):
    assert told(VIRTUAL, "--bench", tmp_path / "nope.toml").startswith("--bench = ")


def test_a_slow_screw_releases_as_fast_as_it_can(tmp_path):
    """As the release's own limit has it: no other number needs to be given for that."""
    path = tmp_path / "slow.toml"
    path.write_text(VIRTUAL + "[limits]\nscrew_speed_mm_s = 1\n")
    found = read_bench(path).source(load_robot("exonav-1"), (0.0, 0.0, 0.0)).limits
    assert found == {"release_rate": 1e-3, "screw": {"speed": 1e-3}}
