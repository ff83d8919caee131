"""Robot and scene files as written: they read back as what they were written from."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from measurement.trials import some_robot
from tendonrod import InvalidInput, load_robot, preset_names
from tendonrod.body import Segments, TaperedRod
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.parameters import file_values
from tendonrod.robot import Robot
from tendonrod.robotfile_writing import (
    file_number,
    robot_from_text,
    robot_text,
    rounded_in_file,
    with_exact,
    write_robot,
)
from tendonrod.rotation import exp_so3
from tendonrod.scenefile import read_scene
from tendonrod.scenefile_writing import scene_text, write_scene
from tendonrod.section import NotchedTube, PlainRod, StiffnessFactors
from tendonrod.tendon import Tendon

MATERIAL = {"youngs_modulus": 75e9, "shear_modulus": 25e9, "density": 6255.0}
TUBE = NotchedTube(
    inner_radius=0.457e-3,
    outer_radius=0.572e-3,
    length=0.03,
    notch_width=0.4e-3,
    notch_spacing=0.2e-3,
    uncut_angle=radians(107.0),
    turns=-0.75,
    **MATERIAL,
)
ROD = PlainRod(length=0.05, radius=0.4e-3, inner_radius=0.1e-3, precurvature=(0.0, 12.5, -0.1), **MATERIAL)
BY_AREA = PlainRod(length=0.2, area=1.2e-6, ix=1.3e-13, iy=2.6e-13, j=1.7e-13, **MATERIAL)
TAPER = TaperedRod(length=0.1, base_radius=0.8e-3, tip_radius=0.4e-3, tip_inner_radius=0.1e-3, **MATERIAL)
HELIX = Tendon.helical(offset=0.3e-3, angle=radians(30.0), turns=1.5, end=0.04, friction=0.1, radius=0.05e-3)
SAMPLED = Tendon.sampled([0.0, 0.02, 0.05], [1e-3, 2e-3, 0.0], [0.0, -1e-3, 1.5e-3], end=0.05, axial_stiffness=1500.0)
ROBOTS = {
    "tube with factors": Robot(
        name='a "quoted" \\ name\nµ',
        body=replace(
            TUBE,
            torsion="homogenized",
            stiffness_factors=StiffnessFactors(axial=1.012, bending_x=1.035, bending_y=1.067, torsion=1.3),
        ),
        tendons=(Tendon.opposite_backbone(radius=0.05e-3, wall="free", free_length=0.3),),
    ),
    "rod": Robot(name="rod", body=ROD, tendons=(HELIX, SAMPLED, Tendon.constant(x=1e-3, y=-2e-3))),
    "rod by area": Robot(name="by area", body=BY_AREA),
    "taper": Robot(name="taper", body=TAPER, tendons=(SAMPLED,)),
    "segments": Robot(name="mixed", body=Segments(segments=(TUBE, ROD, TAPER), angles=(radians(40.0), -0.0))),
    "one segment": Robot(name="one", body=Segments(segments=(ROD,))),
}
SHARED = """name = "shared"
[material]
youngs_modulus_gpa = 75.0
shear_modulus_gpa = 25.0
density_kg_m3 = 6255.0
[[segments]]
rod = { length_mm = 30.0, radius_mm = 0.5 }
[[segments]]
rod = { length_mm = 20.0, radius_mm = 0.4 }
material = { youngs_modulus_gpa = 60.0, shear_modulus_gpa = 25.0, density_kg_m3 = 6255.0 }
[[tendons]]
routing = "constant"
x_mm = 1.0
y_mm = 0.0
friction = 0.0
[sources]
name = "chosen"
"material.youngs_modulus_gpa" = "of all but one"
"segments[1].material.youngs_modulus_gpa" = "measured"
"tendons[0].friction" = "neglected"
"tendons[0].wall" = "never said"
"""


@pytest.mark.parametrize("name", preset_names())
def test_presets_with_their_sources(tmp_path, name):
    robot = load_robot(name)
    write_robot(robot, tmp_path / "robot.toml", comments=("a copy", "of two lines\nand a third"))
    again = load_robot(tmp_path / "robot.toml")
    assert again == robot
    assert again.sources == robot.sources
    assert (tmp_path / "robot.toml").read_text("utf-8").startswith("# a copy\n# of two lines\n# and a third\n")


@pytest.mark.parametrize("name", ROBOTS)
def test_every_kind_of_body_and_tendon(name):
    robot = ROBOTS[name]
    assert robot_from_text(robot_text(robot)) == robot
    assert rounded_in_file(robot) == {}


def test_shared_material_and_defaults_keep_their_sources():
    robot = robot_from_text(SHARED.replace('"tendons[0].wall" = "never said"\n', ""))
    again = robot_from_text(robot_text(robot))
    assert again == robot
    assert again.sources == robot.sources
    assert robot_text(again) == robot_text(robot)


def test_numbers_are_as_people_write_them():
    assert file_number("length_mm", 0.0754) == 75.4
    assert file_number("youngs_modulus_gpa", 75e9) == 75.0
    assert file_number("angle_deg", radians(107.0)) == 107.0
    assert file_number("ix_mm4", 1.3e-13) == 0.13
    assert "youngs_modulus_gpa = 75.0\n" in robot_text(load_robot("exonav-1"))


def test_numbers_that_a_unit_cannot_say_are_exact_apart():
    robot = some_robot()
    again, lost = robot_from_text(robot_text(robot)), rounded_in_file(robot)
    assert "material.youngs_modulus_gpa" in lost
    assert with_exact(again, lost) == robot
    assert with_exact(again, lost).sources == robot.sources


@pytest.mark.parametrize(
    ("exact", "said"),
    [
        ({"material.density_kg_m3": 6256.0}, "material.density_kg_m3 = 6256.0: must be 6255.0 but for rounding"),
        ({"tube.length": 0.1}, "tube.length = 0.1: must be under a key of the robot file"),
        ({"tube.length_mm": "long"}, "tube.length_mm = 'long'"),
    ],
)
def test_exact_numbers_must_be_those_of_the_file(exact, said):
    with pytest.raises(InvalidInput) as error:
        with_exact(load_robot("exonav-1"), exact)
    assert str(error.value).startswith(said)


positive = st.floats(1e-5, 1.0)
modulus = st.floats(1e6, 1.9e12)
bend = st.tuples(*[st.floats(-100.0, 100.0)] * 3)
rods = st.builds(
    PlainRod,
    length=positive,
    radius=positive,
    youngs_modulus=modulus,
    shear_modulus=modulus,
    density=st.floats(0.0, 3e4),
    precurvature=bend,
)
tapers = st.builds(
    TaperedRod,
    length=positive,
    base_radius=positive,
    tip_radius=positive,
    youngs_modulus=modulus,
    shear_modulus=modulus,
    density=st.floats(0.0, 3e4),
    precurvature=bend,
)
tubes = st.builds(
    lambda inner, wall, length, width, angle, turns, E: NotchedTube(
        inner_radius=inner,
        outer_radius=inner * wall,
        length=length,
        notch_width=width * length,
        notch_spacing=width * length,
        uncut_angle=angle,
        turns=turns,
        youngs_modulus=E,
        shear_modulus=0.4 * E,
        density=6255.0,
    ),
    positive,
    st.floats(1.05, 2.0),
    positive,
    st.floats(1e-3, 0.3),
    st.floats(0.5, 2.0 * pi - 0.5),
    st.floats(-5.0, 5.0),
    modulus,
)
singles = st.one_of(rods, tapers, tubes)


@st.composite
def bodies(draw):
    if draw(st.booleans()):
        return draw(singles)
    segments = draw(st.lists(singles, min_size=1, max_size=3))
    angles = draw(st.lists(st.floats(-4.0, 4.0), min_size=len(segments) - 1, max_size=len(segments) - 1))
    return Segments(segments=tuple(segments), angles=tuple(angles))


tendons = st.builds(
    Tendon.constant,
    x=st.floats(-1.0, 1.0),
    y=st.floats(-1.0, 1.0),
    friction=st.floats(0.0, 1.0),
    free_length=st.floats(0.0, 2.0),
)


@settings(max_examples=60, deadline=None)
@given(body=bodies(), tendons=st.lists(tendons, max_size=2), name=st.text(min_size=1).filter(str.strip))
def test_any_robot_to_the_last_digit(body, tendons, name):
    """As text within rounding, with the numbers that the text cannot hold exactly the same."""
    robot = Robot(name=name, body=body, tendons=tuple(tendons))
    again, lost = robot_from_text(robot_text(robot)), rounded_in_file(robot)
    written = file_values(again.body, again.tendons)
    for key, value in file_values(robot.body, robot.tendons).items():
        assert written[key] == (value if key not in lost else pytest.approx(value, rel=5e-16, abs=0.0)), key
    assert with_exact(again, lost) == robot


@given(digits=st.integers(-(10**15) + 1, 10**15 - 1), power=st.integers(-25, 0))
def test_short_decimals_are_said_exactly(digits, power):
    value = float(f"{digits}e{power}")
    for key in ("x_mm", "area_mm2", "mass_g", "modulus_gpa", "stiffness_n", "turns"):
        text = repr(file_number(key, value))
        scale = {"x_mm": 3, "area_mm2": 6, "mass_g": 3, "modulus_gpa": -9}.get(key, 0)
        assert float(text) == float(f"{digits}e{power + scale}")


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        (Robot(name="long", body=PlainRod(length=1e3, radius=0.1, **MATERIAL)), "robot: rod.length_mm = 1000000.0"),
        (load_robot("exonav-1").replace(density=4e4), "robot: material.density_kg_m3 = 40000.0"),
        (Robot(name="far", body=ROD, sources={"length": "a ruler"}), "robot: sources.length = 'a ruler'"),
        ("exonav-1", "robot = 'exonav-1'"),
    ],
)
def test_what_no_robot_file_can_say_is_refused(robot, said):
    with pytest.raises(InvalidInput) as error:
        robot_text(robot)
    assert str(error.value).startswith(said)


def test_files_are_toml_and_complete_or_not_there(tmp_path):
    with pytest.raises(InvalidInput, match=r"robot file = .*must be a file name that ends in \.toml"):
        write_robot(ROBOTS["rod"], tmp_path / "robot.txt")
    with pytest.raises(InvalidInput, match=r"robot file = .*must be writable"):
        write_robot(ROBOTS["rod"], tmp_path / "nowhere" / "robot.toml")
    with pytest.raises(InvalidInput, match="UTF-8"):
        write_robot(Robot(name="half \ud83d", body=ROD), tmp_path / "robot.toml")
    assert list(tmp_path.iterdir()) == []


LOADS = (
    DistributedLoad(force=(0.0, 0.1, 0.0), force_end=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 1e-4), start=0.01, end=0.05),
    PointLoad(force=(0.0, 0.0, -0.002), moment=(1e-5, 0.0, 0.0), frame="body", offset=(3e-4, 0.0, 0.0)),
    LumpedMass(mass=0.572e-3, at=0.06, offset=(0.3e-3, 0.0, 0.0)),
    LumpedMass(mass=1e-3 / 3.0),
    PointLoad(at=0.03),
)


@settings(max_examples=60, deadline=None)
@given(turn=st.tuples(*[st.floats(-1.8, 1.8)] * 3), place=st.tuples(*[st.floats(-2.0, 2.0)] * 3))
def test_any_exit_pose_of_a_scene(tmp_path_factory, turn, place):
    T, path = np.eye(4), tmp_path_factory.mktemp("scene") / "scene.toml"
    T[:3, :3], T[:3, 3] = exp_so3(np.array(turn)), place
    write_scene(path, exit_pose=T, comments=["found"])
    found = read_scene(path).exit_pose
    assert np.allclose(np.eye(4) if found is None else found, T, rtol=0.0, atol=1e-12)


def test_loads_of_a_scene(tmp_path):
    write_scene(tmp_path / "scene.toml", loads=LOADS)
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.exit_pose is None
    assert scene.loads[:3] == (LOADS[1], LOADS[4], LOADS[2])
    assert vars(scene.loads[3])["mass"] == pytest.approx(1e-3 / 3.0, rel=1e-12)
    assert scene.loads[4] == LOADS[0]


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"exit_pose": np.eye(3)}, "exit_pose"),
        ({"exit_pose": np.diag([1.0, 1.0, -1.0, 1.0])}, "exit_pose"),
        ({"exit_pose": np.diag([1.0, 1.0, 1.1, 1.0])}, "exit_pose"),
        ({"exit_pose": np.full((4, 4), np.nan)}, r"exit_pose\[0\]\[0\]"),
        ({"loads": [LOADS[0], 3.0]}, r"loads\[1\]"),
    ],
)
def test_bad_scenes_by_name(given, field):
    with pytest.raises(InvalidInput, match=f"^{field} = "):
        scene_text(**given)
