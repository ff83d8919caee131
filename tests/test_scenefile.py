"""Scene files: what they say is what `solve` takes, in SI; bad ones get one line that names file, key and value."""

from math import radians

import numpy as np
import pytest

from tendonrod import InvalidInput, load_robot, solve
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.rotation import exp_so3
from tendonrod.scenefile import SURFACES, read_scene
from tendonrod.surface import Walls

WHOLE = """
tolerance_mm = 0.02
[exit]
position_mm = [1, 2.5, -3]
rotation_deg = [0, 30, 0]
tilt_deg = [1, -0.5]
offset_mm = [0.05, 0]
[[mass]]
mass_g = 0.572
at_mm = 60.0
offset_mm = [0.3, 0, 0]
[[point]]
force_n = [0, 0, -0.002]
moment_nm = [1e-5, 0, 0]
frame = "body"
[[point]]
at_mm = 30
[[distributed]]
force_n_per_m = [0, 0.1, 0]
force_end_n_per_m = [0, 0, 0]
moment_nm_per_m = [0, 0, 1e-4]
start_mm = 10
end_mm = 50
[[surface]]
type = "plane"
point_mm = [0, 0, 60]
normal = [0, 0, -2]
[[surface]]
type = "tube"
point_mm = [0, 0, 0]
axis = [0, 0, 1]
radius_mm = 20
[[surface]]
type = "cylinder"
point_mm = [0, 11, 0]
axis = [0, 0, 1]
radius_mm = 6.5
[[surface]]
type = "sphere"
center_mm = [0, 0, 90]
radius_mm = 5
[[surface]]
type = "cavity"
center_mm = [0, 0, 0]
radius_mm = 100
"""
PLANE = '[[surface]]\ntype = "plane"\npoint_mm = [0, 0, 0]\nnormal = [1, 0, 0]\n'


@pytest.fixture
def scene(tmp_path):
    """The scene with this text."""

    def read(text: str):
        path = tmp_path / "here.toml"
        path.write_text(text, encoding="utf-8")
        return read_scene(path)

    return read


def test_all_of_a_file_in_si(scene):
    found = scene(WHOLE)
    assert found.names == ("point[0]", "point[1]", "mass[0]", "distributed[0]")
    assert found.loads == (
        PointLoad(force=(0.0, 0.0, -0.002), moment=(1e-5, 0.0, 0.0), frame="body"),
        PointLoad(at=0.03),
        LumpedMass(mass=0.000572, at=0.06, offset=(0.0003, 0.0, 0.0)),
        DistributedLoad(
            force=(0.0, 0.1, 0.0), force_end=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 1e-4), start=0.01, end=0.05
        ),
    )
    np.testing.assert_array_equal(found.exit_pose[:3, 3], (0.001, 0.0025, -0.003))
    np.testing.assert_array_equal(found.exit_pose[:3, :3], exp_so3(np.array([0.0, radians(30.0), 0.0])))
    assert found.exit_tilt == (radians(1.0), radians(-0.5))
    assert found.exit_offset == (5e-5, 0.0)
    assert found.contact_tolerance == 2e-5
    assert [type(each) for each in found.surfaces] == [domain for _, domain in SURFACES.values()]
    assert found.surfaces[2].radius == 0.0065
    np.testing.assert_array_equal(found.surfaces[0].normal, (0.0, 0.0, -1.0))
    assert isinstance(found.arguments["surface"], Walls)


def test_what_is_left_out_is_left_to_solve(scene):
    assert scene("[[mass]]\nmass_g = 1\n").arguments == {"loads": (LumpedMass(mass=0.001),)}
    assert scene("[exit]\n").arguments == {}
    assert list(scene(PLANE).arguments) == ["surface"]


def test_a_scene_is_solved_as_its_arguments_say(scene):
    robot = load_robot("exonav-1")
    found = scene("[exit]\nposition_mm = [0, 0, 5]\n[[point]]\nforce_n = [0, 0.001, 0]\n")
    shape = solve(robot, 0.3, **found.arguments)
    plain = solve(robot, 0.3, tip_force=(0.0, 0.001, 0.0))
    # the force acts on the tube's axis, r_na beside the neutral axis
    assert np.linalg.norm(shape.tip - plain.tip - (0.0, 0.0, 0.005)) < 2e-4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "here.toml = empty: must be a scene: [[point]], [[mass]]"),
        ("[[mass]\n", "here.toml, line 1 = [[mass]: must be valid TOML"),
        ("gravity = 1\n", "here.toml: gravity = 1: must be one of the keys at the top: tolerance_mm, exit, point"),
        ("[[mass]]\n", "here.toml: mass[0].mass_g = missing: must be given"),
        ("[mass]\nmass_g = 1\n", "here.toml: mass = {'mass_g': 1}: must be tables, [[mass]], with two brackets"),
        (
            "[[mass]]\nmass_kg = 1\n",
            "mass[0].mass_kg = 1: must be one of the keys of [mass[0]]: mass_g, at_mm, offset_mm",
        ),
        (
            "[[mass]]\nmass_g = 1\ncolour = 2\n",
            "mass[0].colour = 2: must be one of the keys of [mass[0]]: mass_g, at_mm",
        ),
        ("[[mass]]\nmass_g = -1\n", "here.toml: mass[0].mass_g = -1.0: must be >= 0"),
        ("[[mass]]\nmass_g = 'a'\n", "here.toml: mass[0].mass_g = 'a': must be a finite number"),
        ("[[mass]]\nmass_g = 1\nat_mm = -3\n", "here.toml: mass[0].at_mm = -3.0: must be >= 0"),
        ("[[point]]\nforce_n = [1, 2]\n", "here.toml: point[0].force_n = [1, 2]: must be a list of 3 finite numbers"),
        ("[[point]]\nforce_n = 1\n", "here.toml: point[0].force_n = 1: must be a list of 3 finite numbers"),
        ("[[point]]\noffset_mm = [1]\n", "here.toml: point[0].offset_mm = [1]: must be a list of 3 finite numbers"),
        ("[[point]]\nforce_n = [1, nan, 2]\n", "here.toml: point[0].force_n[1] = nan: must be a finite number"),
        ("[[point]]\nframe = 'tool'\n", "here.toml: point[0].frame = 'tool': must be one of world, body"),
        ("point = [3]\n", "here.toml: point[0] = 3: must be a table, [[point]]"),
        ("exit = 3\n", "here.toml: exit = 3: must be a table, [exit]"),
        ("[exit]\ntilt_deg = [1, 2, 3]\n", "here.toml: exit.tilt_deg = [1, 2, 3]: must be a list of 2 finite numbers"),
        ("[[distributed]]\nstart_mm = 20\nend_mm = 10\n", "distributed[0].end_mm = 10.0: must be > start_mm = 20.0"),
        ("[[surface]]\nradius_mm = 1\n", "here.toml: surface[0].type = missing: must be one of plane, tube, cylinder"),
        ("[[surface]]\ntype = 'cone'\n", "here.toml: surface[0].type = 'cone': must be one of plane, tube, cylinder"),
        (
            "[[surface]]\ntype = 'plane'\npoint_mm = [0, 0, 0]\n",
            "here.toml: surface[0].normal = missing: must be given",
        ),
        (
            PLANE + "radius_mm = 1\n",
            "surface[0].radius_mm = 1: must be one of the keys of [surface[0]]: type, point_mm",
        ),
        (PLANE.replace("[1, 0, 0]", "[0, 0, 0]"), "here.toml: surface[0].normal = [0.0, 0.0, 0.0]: must be a vector"),
        (
            "[[surface]]\ntype = 'sphere'\ncenter_mm = [0, 0, 9]\nradius_mm = 0\n",
            "surface[0].radius_mm = 0.0: must be > 0",
        ),
        ("tolerance_mm = 0.1\n", "here.toml: tolerance_mm = 0.1: must be left out where no [[surface]] is given"),
        ("tolerance_mm = 0\n" + PLANE, "here.toml: tolerance_mm = 0.0: must be > 0"),
    ],
)
def test_bad_files(scene, text, said):
    with pytest.raises(InvalidInput) as error:
        scene(text)
    assert said in str(error.value)
    assert "here.toml" in str(error.value)
    assert "\n" not in str(error.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InvalidInput, match=r"scene = .*nofile.toml: must be an existing TOML file"):
        read_scene(tmp_path / "nofile.toml")
    with pytest.raises(InvalidInput, match="must be a readable file: Is a directory"):
        read_scene(tmp_path)
    with pytest.raises(InvalidInput, match="scene = 3: must be the path of a scene file"):
        read_scene(3)
    (tmp_path / "latin.toml").write_bytes(b"\xe9")
    with pytest.raises(InvalidInput, match="UTF-8 text; byte 0 is not"):
        read_scene(tmp_path / "latin.toml")


def test_errors_of_the_solve_speak_of_the_file(scene):
    found = scene("[[mass]]\nmass_g = 1\n[[mass]]\nmass_g = 1\nat_mm = 80\n[[distributed]]\nend_mm = 90\n")
    robot = load_robot("exonav-1")
    with pytest.raises(InvalidInput) as error, found.in_words():
        solve(robot, **found.arguments)
    assert "mass[1].at_mm = 80.0: must be from 0 to the robot's length L_na = 75.45" in str(error.value)
    assert str(error.value).endswith(" mm")
    with pytest.raises(InvalidInput, match="insertion = 2"), found.in_words():
        solve(robot, insertion=2)
