"""Meshes of one's own: read as written, placed, asked like any phantom; unsound ones refused in one plain sentence."""

import numpy as np
import pytest

from anatomy.meshes import RADIUS, cylinder
from tendonrod import InvalidInput
from tendonrod.anatomy import load_phantom
from tendonrod.anatomy.meshfile import read_mesh, stl_bytes, write_stl
from tendonrod.anatomy.soundness import check_mesh, mesh_volume, open_edges

LINING = 9e-3  # m


def obj(vertices, faces):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    return "\n".join([*lines, *(f"f {a}//1 {b}//1 {c}//1" for a, b, c in (faces + 1).tolist())])


def text_stl(vertices, faces):
    rows = ["solid text"]
    for corners in vertices[faces].tolist():
        rows += ["facet normal 0 0 0", "outer loop", *(f"vertex {x!r} {y!r} {z!r}" for x, y, z in corners)]
        rows += ["endloop", "endfacet"]
    return "\n".join([*rows, "endsolid text"])


@pytest.fixture
def folder(tmp_path):
    """cord.stl in mm and lining.obj in m, with the phantom file that names them."""
    write_stl(tmp_path / "cord.stl", *cylinder(sides=48, rings=5), scale=1e3)
    (tmp_path / "lining.obj").write_text(obj(*cylinder(LINING, sides=48, rings=5)))
    write_file(tmp_path)
    return tmp_path


FILE = """
name = "mine"
kind = "meshes"
distance_spacing_mm = 0.8
[[structure]]
name = "cord"
role = "cord"
file = "cord.stl"
[[structure]]
name = "canal"
role = "canal"
file = "lining.obj"
unit = "m"
robot_is = "inside"
[[target]]
name = "beside"
position_mm = [0.0, 6.5, 10.0]
tolerance_mm = 1.0
side = "right"
"""


def write_file(folder, text=FILE, **replaced):
    for old, new in replaced.items():
        text = text.replace(old, new)
    (folder / "mine.toml").write_text(text)


def load(folder):
    return load_phantom(folder / "mine.toml")


def refused(folder):
    with pytest.raises(InvalidInput) as error:
        load(folder)
    said = str(error.value)
    assert "\n" not in said
    return said.replace(f"{folder}/", "")


@pytest.mark.parametrize("suffix", [".stl", ".STL", ".obj", "text"])
def test_a_mesh_comes_back_from_every_format(tmp_path, suffix):
    vertices, faces = cylinder(sides=24, rings=3)
    path = tmp_path / f"mesh{suffix if suffix != 'text' else '.stl'}"
    contents = {".obj": obj(vertices, faces).encode(), "text": text_stl(vertices, faces).encode()}
    path.write_bytes(contents.get(suffix, stl_bytes(vertices, faces)))
    found, triangles = read_mesh("mesh", path)
    assert len(found) == len(vertices)
    assert len(triangles) == len(faces)
    assert len(open_edges(triangles)) == 0
    assert mesh_volume(found, triangles) == pytest.approx(mesh_volume(vertices, faces), rel=1e-6)


def test_faces_of_four_corners_become_triangles(tmp_path):
    corners = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "-7 -3 -1 -5")
    (tmp_path / "box.obj").write_text("\n".join([*corners, *(f"f {each}" for each in quads)]))
    vertices, faces = read_mesh("mesh", tmp_path / "box.obj")
    assert len(faces) == 12
    assert abs(mesh_volume(vertices, faces)) == pytest.approx(1.0)
    assert len(open_edges(faces)) == 0


def test_a_phantom_of_meshes_answers_like_any_other(folder):
    phantom = load(folder)
    p = np.array([[0.0, 6.5e-3, 10e-3], [5e-3, 0.0, 12e-3], [0.0, -8e-3, 8e-3]])
    rho = np.hypot(p[:, 0], p[:, 1])
    clearance = phantom.clearance(p)
    np.testing.assert_allclose(clearance["cord"], rho - RADIUS, atol=3e-5)
    np.testing.assert_allclose(clearance["canal"], LINING - rho, atol=5e-5)
    np.testing.assert_allclose(phantom.free().distance(p)[0], np.minimum(rho - RADIUS, LINING - rho), atol=5e-5)
    assert phantom.target("beside").position == pytest.approx((0.0, 6.5e-3, 10e-3))
    assert phantom.sources["cord"] == "cord.stl, in mm"


def test_placing_turns_and_moves_everything(folder):
    write_file(folder, FILE + "[placing]\nposition_mm = [1.0, 2.0, 3.0]\nrotation_deg = [0.0, 90.0, 0.0]\n")
    with pytest.raises(InvalidInput, match="room"):
        load(folder).check_robot(2e-3)  # the target is where it was, and the cord has turned away from below it
    cord = load(folder).structures["cord"]
    np.testing.assert_allclose(cord.vertices.min(axis=0), [1e-3, -2e-3, -1e-3], atol=1e-7)
    np.testing.assert_allclose(cord.vertices.max(axis=0), [21e-3, 6e-3, 7e-3], atol=1e-7)


def test_a_cord_in_a_dura_is_no_wall(folder):
    write_stl(folder / "dura.stl", *cylinder(6e-3, sides=48, rings=5), scale=1e3)
    write_file(folder, FILE + '[[structure]]\nname = "dura"\nrole = "dura"\nfile = "dura.stl"\n')
    assert {name: each.is_wall for name, each in load(folder).structures.items()} == {
        "cord": False, "canal": True, "dura": True,
    }  # fmt: skip


def test_a_robot_without_room_at_any_target_is_refused(folder):
    phantom = load(folder)
    phantom.check_robot(2.4e-3)
    with pytest.raises(
        InvalidInput, match=r"tube of 7\.200 mm: must be thinner: beside has room for a tube of .* mm at most"
    ):
        phantom.check_robot(3.6e-3)


def test_metres_taken_for_millimetres_are_noticed_both_ways(folder):
    write_stl(folder / "cord.stl", *cylinder(sides=48, rings=5))
    said = refused(folder)
    assert "cord (cord.stl) = 0.02 mm long, read with unit = mm: must be from 5 to 1500 mm" in said
    assert said.endswith('its numbers look like m: unit = "m"')
    write_stl(folder / "cord.stl", *cylinder(sides=48, rings=5), scale=1e3)
    write_file(folder, FILE.replace('file = "cord.stl"', 'file = "cord.stl"\nunit = "m"'))
    said = refused(folder)
    assert "2e+04 mm long, read with unit = m: must be from 5 to 1500 mm" in said
    assert said.endswith('its numbers look like mm: unit = "mm"')


def test_a_hole_is_counted_and_placed(folder):
    vertices, faces = cylinder(sides=48, rings=5)
    write_stl(folder / "cord.stl", vertices, faces[1:], scale=1e3)
    said = refused(folder)
    assert "structure cord (cord.stl) = not watertight: 3 open or doubled edges, the first at" in said
    assert "mm: must be closed" in said


def test_a_face_the_wrong_way_round_is_no_closed_mesh(folder):
    vertices, faces = cylinder(sides=48, rings=5)
    faces[7] = faces[7, ::-1]
    write_stl(folder / "cord.stl", vertices, faces, scale=1e3)
    assert "not watertight: " in refused(folder)


def test_a_mesh_inside_out_is_told_by_its_volume(folder):
    vertices, faces = cylinder(sides=48, rings=5)
    write_stl(folder / "cord.stl", vertices, faces[:, ::-1], scale=1e3)
    assert "structure cord (cord.stl) = inside out: it encloses -1002 mm3: must be > 0 mm3" in refused(folder)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("cord.stl", b"", "structure cord = cord.stl, empty: must be a mesh"),
        ("cord.stl", b"solid nothing\nendsolid nothing\n", "structure cord = cord.stl without a triangle"),
        ("cord.stl", b"no mesh at all", "structure cord = cord.stl, 14 bytes: must be an STL file of 84 bytes or more"),
        ("cord.stl", bytes(80) + b"\x02\0\0\0" + bytes(50), "134 bytes: must be an STL file of 184 bytes, as"),
        ("cord.stl", b"solid x\nvertex 1 2\n", "a corner that is no number: must be three numbers to a corner"),
        ("cord.stl", b"solid x\nvertex 1 2 nan\nvertex 1 2 3\nvertex 2 3 1\n", "1 triangles with corners nowhere"),
        ("lining.obj", b"v 0 0 0\nf 1 2 3\n", "lining.obj: f 1 2 3: must be a face of 3 or more corners from 1 to 1"),
        ("lining.obj", b"v 0 0 0\nf a b c\n", "lining.obj: f a b c: must be a face by numbers of corners"),
        ("lining.obj", b"\x89PNG\xff\xfe", "structure canal = lining.obj without a triangle: must be a mesh"),
    ],
)  # fmt: skip
def test_unreadable_meshes_are_named(folder, name, content, said):
    (folder / name).write_bytes(content)
    assert said in refused(folder)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"cord.stl"', '"gone.stl"', "structure cord = 'gone.stl': must be an existing mesh file"),
        ('"cord.stl"', '"cord.ply"', "structure cord = 'cord.ply': must be a file name that ends in .stl or .obj"),
        ('role = "cord"', 'role = "heart"', "structure[0].role = 'heart': must be one of cord, dura, canal"),
        ('unit = "m"', 'unit = "km"', "structure[1].unit = 'km': must be one of mm, cm, m, inch"),
        ('robot_is = "inside"', 'is_wall = 1', "structure[1].is_wall = 1: must be true or false"),
        ("name = \"canal\"", "name = \"cord\"", "structures = ['cord', 'cord']: must be of different names"),
        ("tolerance_mm = 1.0", "tolerance = 1.0", "target[0]: tolerance = 1.0: must be left out, or under"),
        ("tolerance_mm = 1.0", "", "target[0].tolerance_mm = missing: must be given"),
        ("tolerance_mm = 1.0", "tolerance_mm = 0", "target[0].tolerance_mm = 0.0: must be > 0"),
        ("[0.0, 6.5, 10.0]", "[0.0, 6.5]", "target[0].position_mm = [0.0, 6.5]: must be a vector of 3 finite numbers"),
        ("spacing_mm = 0.8", "spacing_mm = 0.01", "distance_spacing_mm = 0.01: must be from 0.1 to 2"),
        ('kind = "meshes"', 'kind = "mesh"', "kind = 'mesh': must be one of printed, anatomical, meshes"),
        ('kind = "meshes"', "", "kind = missing: must be one of printed, anatomical, meshes"),
        ('kind = "meshes"', 'kind = "printed"', "must be left out, or under one of the keys name, kind"),
    ],
)  # fmt: skip
def test_wrong_keys_are_named(folder, old, new, said):
    write_file(folder, FILE.replace(old, new))
    assert said in refused(folder)


def test_a_sound_mesh_passes():
    check_mesh("cord", *cylinder())


SECOND = """
[[target]]
name = "second"
position_mm = [0.0, 0.0, 10.0]
tolerance_mm = 1.0
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("second", "beside", "target[1].name = 'beside': must be a name of its own; target[0] has this one"),
        ("[0.0, 0.0, 10.0]", "[1.0, 0.0, 10.0]", "target[1].position_mm = [1.0, 0.0, 10.0]: must be outside the cord"),
    ],
)
def test_a_target_inside_the_cord_or_named_twice_is_refused(folder, old, new, said):
    write_file(folder, FILE + SECOND.replace(old, new))
    assert said in refused(folder)


@pytest.mark.parametrize(
    ("position", "said"),
    [
        ([0.0, 9.5, 10.0], "target second lies 0.50 mm inside canal, though its tolerance reaches out of it"),
        ([0.0, 11.0, 10.0], "target second lies 2.00 mm inside canal"),
        ([300.0, 0.0, 10.0], "target second lies 291.0 mm outside the box around all structures"),
    ],
)
def test_a_target_in_a_wall_or_far_from_everything_is_told(folder, position, said):
    write_file(folder, FILE + SECOND.replace("[0.0, 0.0, 10.0]", str(position)))
    assert load(folder).doubts() == (said,)


def test_targets_in_free_space_leave_no_doubt(folder):
    assert load(folder).doubts() == ()
    for source in ("printed", "anatomical"):
        assert load_phantom(source, levels="L2").doubts() == ()
