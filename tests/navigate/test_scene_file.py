"""Scene files: what they say is what the scenario has, in SI; what is wrong is told by file and key."""

from math import radians

import pytest

from navigate import round_phantom
from tendonrod import InvalidInput, anatomy
from tendonrod.navigate.limits import limits_of, plateau_tension
from tendonrod.navigate.scenariofile import read_scenario, scenario_data, scenario_from
from tendonrod.statics.equilibrium import solve
from tendonrod.statics.limits import PLATEAU_STRAIN, fibre_strain

SCENE = """
robot = "exonav-2"
torsion = "open_section"
phantom = "somewhere"
gravity_m_per_s2 = [0, -9.81, 0]
coupled = false
[tube]
depth_mm = 5.3
tilt_deg = 15
[limits]
tension_n = 0.8
rotation_deg = 90
pressure_kpa = 3.2
strain_percent = 0.5
insertion_percent = 80
snap_mm = 1.5
"""


@pytest.fixture(autouse=True)
def asked(monkeypatch):
    """The round phantom under every name; which were asked for."""
    names = []

    def load(source="printed", *, levels=None):
        names.append(source)
        return round_phantom.round_phantom()

    monkeypatch.setattr(anatomy, "load_phantom", load)
    return names


@pytest.fixture
def scene(tmp_path):
    """Write a scene file and read it."""

    def call(text, **options):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return read_scenario(path, **options)

    return call


def test_a_scene_is_what_its_file_says(scene, asked):
    found = scene(SCENE)
    assert (found.robot.name, found.robot.torsion, asked) == ("exonav-2", "open_section", ["somewhere"])
    assert (found.gravity, found.coupled) == ((0.0, -9.81, 0.0), False)
    assert (found.tube.depth, found.tube.tilt) == (5.3e-3, radians(15))
    limits = found.limits
    assert (limits.tension, limits.rotation, limits.pressure) == (0.8, radians(90), 3.2e3)
    assert (limits.strain, limits.insertion, limits.snap) == (0.005, 0.8, 1.5e-3)


def test_without_a_file_all_is_as_by_default_and_options_go_before_the_file(scene, asked):
    found = read_scenario()
    assert (found.robot.name, found.robot.torsion, asked) == ("exonav-1", "homogenized", ["printed"])
    assert read_scenario(robot="exonav-2", torsion=None).robot.name == "exonav-2"
    assert scene(SCENE, robot="exonav-1", coupled=None).robot.name == "exonav-1"


def test_files_are_beside_the_scene(scene, asked, tmp_path):
    scene('phantom = "patient.toml"\n')
    assert asked == [str(tmp_path / "patient.toml")]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("colour = 1\n", "scene.toml: colour = unknown: must be one of robot, torsion, phantom"),
        ("[tube]\nheight = 1\n", "tube.height = unknown: must be one of height_mm"),
        ("[tube]\nheight_mm = 'high'\n", "tube.height_mm = 'high': must be from -200 to 800"),
        ("[tube]\ntilt_deg = 100\n", r"scene.toml: tube.tilt_deg = 100\.0: must be from -80 to 80"),
        ("tube = 3\n", "tube = 3: must be a table"),
        ("coupled = 1\n", "coupled = 1: must be true or false"),
        ("gravity_m_per_s2 = [0, 1]\n", "gravity_m_per_s2 = .*: must be a vector of 3"),
        ("[limits]\ntension_n = -1\n", r"scene.toml: limits.tension_n = -1\.0: must be > 0"),
        ("[tube]\ndepth_mm = 4.2\n", "the nearest, cord, is 0.2 mm away"),
        ("[tube]\ndepth_mm = 3.5\n", "from every wall; it lies 0.5 mm inside the nearest wall, cord$"),
        ("[tube]\ndepth_mm = 7.8\n", "from every wall; it lies 0.5 mm inside the nearest wall, canal$"),
        ("robot = \n", "scene.toml, line 1"),
        ("robot = 'nobody'\n", "robot = 'nobody'"),
    ],
)
def test_what_is_wrong_is_told_by_key(scene, text, message):
    with pytest.raises(InvalidInput, match=message):
        scene(text)


def test_a_scenario_comes_back_from_its_data_to_the_last_bit():
    given = round_phantom.scenario(coupled=False)
    again = scenario_from(scenario_data(given), "record")
    for name in ("robot", "tube", "gravity", "limits", "coupled"):
        assert getattr(again, name) == getattr(given, name)
    assert again.phantom.fingerprint == given.phantom.fingerprint


def test_limits_come_from_the_robots_plateau():
    robot = round_phantom.scenario().robot
    tension = plateau_tension(robot)
    below, above = (float(fibre_strain(solve(robot, tension + off)).max()) for off in (0.0, 2e-3))
    assert below <= PLATEAU_STRAIN < above
    assert limits_of(robot).tension == pytest.approx(0.9 * tension)
    with pytest.raises(InvalidInput, match="limits = 'speed': must be one of insertion"):
        limits_of(robot, speed=1.0)
