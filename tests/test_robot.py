"""Robots: presets, routings, changed copies, robot files, and every bad input by name."""

import copy
import pickle
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendonrod.body import Segments, TaperedRod
from tendonrod.errors import InvalidInput, NotConverged, numbers, vector, whole, within
from tendonrod.robot import Robot, load_robot, preset_names
from tendonrod.section import NotchedTube, PlainRod
from tendonrod.tendon import Tendon

TUBE = """name = "mine"
[tube]
inner_radius_mm = 0.457
outer_radius_mm = 0.572
length_mm = 75.4
[notches]
width_mm = 0.4
spacing_mm = 0.2
uncut_angle_deg = 90
turns = 1
[material]
youngs_modulus_gpa = 75
shear_modulus_gpa = 25
density_kg_m3 = 6255
torsion = "published"
[[tendons]]
radius_mm = 0.05
routing = "opposite_backbone"
"""
PRESET = load_robot("exonav-1")
EXAMPLES = Path(__file__).parents[1] / "examples"
TAPERED = (EXAMPLES / "tapered-rod.toml").read_text("utf-8")
SEGMENTS = (EXAMPLES / "two-segment.toml").read_text("utf-8")
ROD = """name = "rod"
[rod]
length_mm = 500
radius_mm = 1
precurvature_per_m = [0, 1.5, 0]
[material]
youngs_modulus_gpa = 200
shear_modulus_gpa = 80
density_kg_m3 = 8000
[[tendons]]
routing = "constant"
x_mm = 15.06
y_mm = 0
[[tendons]]
routing = "helical"
offset_mm = 15.06
angle_deg = 90
turns = 1
end_mm = 250
"""


@pytest.fixture
def robot_file(tmp_path):
    def write(text: str | bytes) -> Path:
        path = tmp_path / "mine.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def test_presets_are_the_four_prototypes_with_sources():
    assert preset_names() == ["exonav-1", "exonav-2", "exonav-3", "exonav-4"]
    for name in preset_names():
        robot = load_robot(name)
        assert robot.name == name
        assert isinstance(robot.body, NotchedTube)
        assert robot.body.torsion == "published"
        assert len(robot.sources) == 17
        assert all(robot.sources.values())


def test_a_users_file_gives_the_preset(robot_file):
    mine, preset = load_robot(robot_file(TUBE)), load_robot("exonav-1")
    for name, value in mine.parameters().items():
        assert preset.parameters()[name] == value
    np.testing.assert_array_equal(mine.routing, preset.routing)


def test_numbers_of_a_file_are_the_decimal_numbers_in_si(robot_file):
    parameters = load_robot(robot_file(TUBE)).parameters()
    assert (parameters["outer_radius"], parameters["length"]) == (0.572e-3, 0.0754)
    assert (parameters["youngs_modulus"], parameters["uncut_angle"]) == (75e9, pi / 2)


def test_a_plain_rod_from_file(robot_file):
    robot = load_robot(robot_file(ROD))
    assert (robot.n_tendons, robot.length_na, robot.turns) == (2, 0.5, 0.0)
    np.testing.assert_array_equal(robot.section.u_star, [0.0, 1.5, 0.0])
    expected = [[0.01506, 0, 0, 0, 0, 0.5], [0, 0, 0.01506, pi / 2, 4 * pi, 0.25]]
    np.testing.assert_allclose(robot.routing, expected, rtol=1e-15)


def test_a_tapered_rod_and_its_tendons_from_file():
    robot = load_robot(EXAMPLES / "tapered-rod.toml")
    steel = {"youngs_modulus": 200e9, "shear_modulus": 80e9, "density": 8000.0}
    body = TaperedRod(length=0.2, base_radius=0.8e-3, tip_radius=0.4e-3, **steel)
    s, x, y = [0.0, 0.05, 0.1, 0.15, 0.2], [-4e-3, -2.8e-3, 0.0, 2e-3, 2.5e-3], [0.0, 2.5e-3, 3.4e-3, 1.8e-3, 0.0]
    more = {"friction": 0.1, "axial_stiffness": 1500.0, "free_length": 0.3}
    tendons = (Tendon.constant(radius=1e-4, x=4e-3, y=0.0, end=0.1), Tendon.sampled(s, x, y, radius=1e-4, **more))
    assert robot == Robot(name="tapered-rod", body=body, tendons=tendons)


def test_segments_from_file(robot_file):
    robot = load_robot(EXAMPLES / "two-segment.toml")
    material = {"youngs_modulus": 75e9, "shear_modulus": 25e9, "density": 6255.0, "torsion": "open_section"}
    tube = {"inner_radius": 0.457e-3, "outer_radius": 0.572e-3, "notch_width": 0.4e-3, "notch_spacing": 0.2e-3}
    straight = NotchedTube(length=0.03, uncut_angle=2 * pi / 3, turns=0.0, **tube, **material)
    helical = NotchedTube(length=0.045, uncut_angle=pi / 2, turns=0.75, **tube, **material)
    tendons = (Tendon.opposite_backbone(radius=5e-5, wall="free"), Tendon.opposite_backbone(radius=5e-5, end=0.03))
    assert robot == Robot(name="two-segment", body=Segments(segments=(straight, helical)), tendons=tendons)
    own = SEGMENTS.replace("angle_deg = 0.0", "angle_deg = 90\nmaterial.youngs_modulus_gpa = 60").replace(
        "gpa = 60", "gpa = 60\nmaterial.shear_modulus_gpa = 20\nmaterial.density_kg_m3 = 0"
    )
    body = load_robot(robot_file(own)).body
    assert isinstance(body, Segments)
    assert (body.angles, body.segments[1].youngs_modulus, body.segments[1].density) == ((pi / 2,), 60e9, 0.0)
    assert body.segments[0] == straight


def test_sources_of_segments(robot_file):
    said = "\n[sources]\n" + "".join(
        f"'{key}' = 'x'\n"
        for key in (
            "segments[0].tube.length_mm",
            "segments[1].notches.turns",
            "material.density_kg_m3",
            "tendons[1].end_mm",
        )
    )
    robot = load_robot(robot_file(SEGMENTS + said))
    changed = robot.replace(segment2_turns=1.0, segment1_density=0.0, tendon2_end=0.02)
    assert set(changed.sources) == {"segments[0].tube.length_mm"}


def test_tendon_positions():
    robot = load_robot("exonav-1")
    tube, tendon = robot.body, robot.tendons[0]
    assert isinstance(tube, NotchedTube)
    x = robot.section.r_na + tube.inner_radius - tendon.radius
    np.testing.assert_allclose(robot.tendon_position(0, [0.0, 0.03]), [[x, 0, 0], [x, 0, 0]], rtol=1e-15)
    helix = robot.replace(tendons=(Tendon.helical(offset=1e-3, angle=0.0, turns=0.25),))
    np.testing.assert_allclose(helix.tendon_position(0, helix.length_na), [[0, 1e-3, 0]], atol=1e-18)


def test_routing_is_read_only_and_may_be_empty():
    robot = load_robot("exonav-1").replace(tendons=())
    assert robot.routing.shape == (0, 6)
    with pytest.raises(ValueError, match="read-only"):
        load_robot("exonav-1").routing[0, 0] = 1.0


@pytest.mark.parametrize("name", ["exonav-1", "exonav-4"])
def test_replace_with_its_own_parameters_changes_nothing(name):
    robot = load_robot(name)
    assert robot.replace(**robot.parameters()) == robot


def test_replace_of_a_rod_and_its_precurvature(robot_file):
    rod = load_robot(robot_file(ROD))
    assert rod.replace(**rod.parameters()) == rod
    assert rod.replace(precurvature_z=2.0) == rod.replace(precurvature=(0.0, 1.5, 2.0))


@given(st.floats(1e-3, 1e3), st.floats(0.05, 6.2), st.floats(-5, 5))
def test_replace_round_trip(modulus, psi, turns):
    robot = PRESET
    changed = robot.replace(youngs_modulus=modulus * 1e9, uncut_angle=psi, turns=turns)
    assert changed.parameters()["uncut_angle"] == psi
    assert changed.replace(**robot.parameters()) == robot


def test_replace_drops_the_sources_of_what_it_changes():
    changed = load_robot("exonav-1").replace(length=0.07, tendon_radius=4e-5)
    gone = load_robot("exonav-1").sources.keys() - changed.sources.keys()
    assert gone == {"tube.length_mm", "tendons[0].radius_mm"}


def test_replace_refuses_unknown_names_and_lists_the_valid():
    with pytest.raises(InvalidInput, match="lenght = 1: must be called by one of the names name, tendons, "):
        load_robot("exonav-1").replace(lenght=1)
    with pytest.raises(InvalidInput, match="radius = 1"):
        load_robot("exonav-1").replace(radius=1)


def test_factors_can_be_replaced_one_by_one_and_all_are_needed(robot_file):
    robot = load_robot("exonav-1").replace(torsion="homogenized", bending_x_factor=2.0)
    assert robot.section.Kbt[0] == pytest.approx(2.0 * 75e9 * robot.section.I_x)
    with pytest.raises(InvalidInput, match="bending_x_factor = missing"):
        load_robot(robot_file(TUBE)).replace(axial_factor=1.0)


def test_robots_travel_between_processes():
    robot = load_robot("exonav-2")
    for twin in (pickle.loads(pickle.dumps(robot)), copy.deepcopy(robot)):
        assert twin == robot
        assert twin.sources == robot.sources
        assert hash(twin) == hash(robot)
        assert not twin.section.Kbt.flags.writeable


def test_torsion_is_the_tubes_model_or_gj(robot_file):
    assert load_robot("exonav-1").replace(torsion="open_section").torsion == "open_section"
    assert load_robot(robot_file(ROD)).torsion == "GJ"


def test_rod_constants_are_the_sections_and_the_farthest_tendon(robot_file):
    robot = load_robot(robot_file(ROD))
    section = robot.section
    expected = [*section.Kse, *section.Kbt, *section.v_star, *section.u_star, 0.01506]
    np.testing.assert_allclose(robot.rod_constants, expected, rtol=1e-15)
    assert robot.rod_constants is robot.rod_constants
    assert robot.rod_constants.flags.writeable
    assert robot.replace(tendons=()).rod_constants[-1] == 0.0


def test_what_contradicts_itself_or_is_no_mapping_is_refused():
    with pytest.raises(InvalidInput, match=r"tendon_radius = 4e-05: must be left out where tendons is given"):
        PRESET.replace(tendon_radius=4e-5, tendons=PRESET.tendons)
    with pytest.raises(InvalidInput, match=r"sources = 3: must be a mapping"):
        Robot(name="x", body=PRESET.body, sources=3)


def test_tendons_that_do_not_fit_are_refused():
    robot = load_robot("exonav-1")
    rod = PlainRod(length=0.1, radius=1e-3, youngs_modulus=1e9, shear_modulus=1e9, density=1.0)
    with pytest.raises(InvalidInput, match=r"tendons\[0\].radius = 0.001: must be < inner_radius = 0.000457"):
        robot.replace(tendon_radius=1e-3)
    with pytest.raises(InvalidInput, match=r"tendons\[0\].end = 0.2: must be > 0 and <= L_na = 0.0754"):
        robot.replace(tendons=(Tendon.constant(x=0.0, y=0.0, end=0.2),))
    with pytest.raises(InvalidInput, match=r"tendons\[0\].routing .* in a plain rod"):
        Robot(name="rod", body=rod, tendons=(Tendon.opposite_backbone(radius=1e-4),))
    with pytest.raises(InvalidInput, match="x = nan: must be a finite number"):
        Tendon.constant(x=float("nan"), y=0.0)


BAD_FILES = [
    ("", "mine.toml = empty: must be a robot: name, then [tube]"),
    ("# only a comment", "mine.toml = empty: must be a robot"),
    ("name = 'x'", "mine.toml: body = neither [tube] nor [rod]: must be a robot"),
    (TUBE.replace("75.4", "= 3"), "mine.toml, line 5 = length_mm = = 3: must be valid TOML (Invalid value, column 13)"),
    (TUBE.replace("[notches]", "[notches"), "mine.toml, line 6 = [notches: must be valid TOML"),
    (TUBE.replace("0.572", "0.4"), "mine.toml: tube.outer_radius_mm = 0.4: must be > inner_radius_mm = 0.457"),
    (TUBE.replace("0.572", "nan"), "mine.toml: tube.outer_radius_mm = nan: must be a finite number"),
    (TUBE.replace("0.572", "inf"), "mine.toml: tube.outer_radius_mm = inf: must be a finite number"),
    (TUBE.replace("0.572", "true"), "mine.toml: tube.outer_radius_mm = True: must be a finite number"),
    (TUBE.replace("0.572", "'1'"), "mine.toml: tube.outer_radius_mm = '1': must be a finite number"),
    (TUBE.replace("75.4", "0"), "mine.toml: tube.length_mm = 0.0: must be > 0"),
    (TUBE.replace("75.4", "-3"), "mine.toml: tube.length_mm = -3.0: must be > 0"),
    (TUBE.replace("75.4", "1" + "0" * 400), "mine.toml: tube.length_mm = 1000"),
    (TUBE.replace("deg = 90", "deg = 360"), "mine.toml: notches.uncut_angle_deg = 360.0: must be inside (0, 2 pi) rad"),
    (TUBE.replace("length_mm", "lenght_mm"), "mine.toml: tube.lenght_mm = 75.4: must be one of the keys of [tube]: "),
    (TUBE.replace("length_mm = 75.4", ""), "mine.toml: tube.length_mm = missing: must be given"),
    (TUBE.replace('"published"', '"soft"'), "mine.toml: material.torsion = 'soft': must be one of published, open"),
    (TUBE.replace('"published"', '"homogenized"'), "mine.toml: material.stiffness_factors = missing: must be given"),
    (TUBE + "end_mm = 80", "mine.toml: tendons[0].end_mm = 80.0: must be > 0 and <= L_na = 75.4566 mm"),
    (TUBE.replace("0.05", "0.5"), "mine.toml: tendons[0].radius_mm = 0.5: must be < inner_radius_mm = 0.457"),
    (TUBE.replace("opposite_backbone", "loose"), "mine.toml: tendons[0].routing = 'loose': must be one of opposite_"),
    (TUBE.replace("opposite_backbone", "constant"), "mine.toml: tendons[0].x_mm = missing: must be a finite number"),
    (TUBE.replace("[[tendons]]", "[tendons]"), "mine.toml: tendons = {"),
    (TUBE + "[sources]\n'tube.depth_mm' = 'x'", "mine.toml: sources.tube.depth_mm = 'x': must be under a key"),
    (TUBE.replace('"mine"', '" "'), "mine.toml: name = ' ': must be a text that is not empty"),
    (ROD.replace("radius_mm = 1\n", "area_mm2 = 1\n"), "mine.toml: rod.ix_mm4 = missing: must be a finite number > 0"),
    (ROD.replace("radius_mm = 1\n", "radius_mm = 1\nj_mm4 = 1\n"), "mine.toml: rod.j_mm4 = 1.0: must be left out"),
    (ROD.replace("[0, 1.5, 0]", "[0, 1]"), "mine.toml: rod.precurvature_per_m = [0, 1]: must be a list of 3 finite"),
    (ROD.replace("[material]", "[material]\ntorsion='published'"), "mine.toml: material.torsion = 'published': must"),
    (ROD.replace('"constant"', '"opposite_backbone"'), "mine.toml: tendons[0].radius_mm = missing: must be > 0"),
    (ROD + "[tube]", "mine.toml: body = [tube] and [rod]: must be a robot"),
    (
        TAPERED.replace("tip_radius_mm = 0.4", "tip_radius_mm = 0"),
        "mine.toml: tapered_rod.tip_radius_mm = 0.0: must be",
    ),
    (
        TAPERED.replace("tip_radius_mm = 0.4", "tip_radius_mm = 0.4\ntip_inner_radius_mm = 0.5"),
        "mine.toml: tapered_rod.tip_inner_radius_mm = 0.5: must be < tip_radius_mm = 0.4",
    ),
    (
        TAPERED.replace("150.0, 200.0]", "150.0, 190.0]"),
        "mine.toml: tendons[1].s_mm = [0.0, 50.0, 100.0, 150.0, 190.0]:",
    ),
    (
        TAPERED.replace("100.0, 150.0", "150.0, 100.0"),
        "mine.toml: tendons[1].s_mm = [0.0, 50.0, 150.0, 100.0, 200.0]: ",
    ),
    (TAPERED.replace("-2.8, ", ""), "mine.toml: tendons[1].x_mm = [-4.0, 0.0, 2.0, 2.5]: must be as many numbers as s"),
    (TAPERED.replace("-2.8, ", "'a', "), "mine.toml: tendons[1].x_mm = [-4.0, 'a', 0.0, 2.0, 2.5]: must be a finite"),
    (TAPERED.replace("x_mm = 4.0", "x_mm = [4.0]"), "mine.toml: tendons[0].x_mm = [4.0]: must be a finite number"),
    (
        TAPERED.replace("-2.8, ", "-2.8e6, "),
        "mine.toml: tendons[1].x_mm = [-4.0, -2800000.0, 0.0, 2.0, 2.5]: must be <=",
    ),
    (TAPERED.replace("n = 0.1", "n = -0.1"), "mine.toml: tendons[1].friction = -0.1: must be >= 0"),
    (TAPERED.replace("n = 0.1", "n = 11"), "mine.toml: tendons[1].friction = 11.0: must be <= 10"),
    (TAPERED.replace("1500.0", "0"), "mine.toml: tendons[1].axial_stiffness_n = 0.0: must be > 0"),
    (TAPERED.replace("= 300.0", "= -1"), "mine.toml: tendons[1].free_length_mm = -1.0: must be >= 0"),
    (TAPERED + "wall = 'free'", "mine.toml: tendons[1].wall = 'free': must be \"held\" where routing"),
    (TAPERED + "[rod]", "mine.toml: body = [rod] and [tapered_rod]: must be a robot"),
    (ROD + "[[segments]]", "mine.toml: body = [rod] and [segments]: must be a robot"),
    ("name = 'x'\nsegments = []", "mine.toml: segments = (): must be one or more of"),
    ("name = 'x'\nsegments = 3", "mine.toml: segments = 3: must be a list"),
    ("name = 'x'\n[[segments]]", "mine.toml: segments[0] = neither [tube] nor [rod]: must be a segment: tube and"),
    (SEGMENTS.replace("angle_deg = 0.0", "rod = {}"), "mine.toml: segments[1] = [tube] and [rod]: must be a segment: "),
    (
        SEGMENTS.replace("angle_deg = 0.0", "angle = 0"),
        "mine.toml: segments[1].angle = 0: must be one of the keys of [",
    ),
    (
        SEGMENTS.replace("angle_deg = 0.0", "angle_deg = 'a'"),
        "mine.toml: segments[1].angle_deg = 'a': must be a finite",
    ),
    (
        SEGMENTS.replace("length_mm = 45.0", "length_mm = -1"),
        "mine.toml: segments[1].tube.length_mm = -1.0: must be > 0",
    ),
    (
        SEGMENTS.replace("0.572, length_mm = 45.0", "0.4, length_mm = 45"),
        "mine.toml: segments[1].tube.outer_radius_mm = 0",
    ),
    (SEGMENTS.replace(", turns = 0.75", ""), "mine.toml: segments[1].notches.turns = missing: must be given"),
    (
        SEGMENTS.replace("[[segments]]", "[[segments]]\nangle_deg = 1", 1),
        "mine.toml: segments[0].angle_deg = 1.0: must be",
    ),
    (SEGMENTS.replace("gpa = 75.0", "gpa = -75.0"), "mine.toml: material.youngs_modulus_gpa = -75.0: must be > 0"),
    (
        SEGMENTS.replace("gpa = 75.0", "gpa = 75e9"),
        "mine.toml: material.youngs_modulus_gpa = 75000000000.0: must be <=",
    ),
    (SEGMENTS.replace("[material]", "[other]"), "mine.toml: other = {"),
    (SEGMENTS.replace('"open_section"', '"homogenized"'), "mine.toml: material.stiffness_factors = missing: must be"),
    (
        SEGMENTS.replace("radius_mm = 0.05", "radius_mm = 0.5"),
        "mine.toml: tendons[0].radius_mm = 0.5: must be < inner_radius_mm = 0.457",
    ),
    (
        SEGMENTS.replace("end_mm = 30", "end_mm = 80"),
        "mine.toml: tendons[1].end_mm = 80.0: must be > 0 and <= L_na = 75.",
    ),
    (b"\xff\xfe", "robot file = "),
    (TUBE.replace("75.4", "75.4e6"), "mine.toml: tube.length_mm = 75400000.0: must be <= 100000 mm"),
    (
        TUBE.replace("gpa = 75", "gpa = 75e9"),
        "mine.toml: material.youngs_modulus_gpa = 75000000000.0: must be <= 2000",
    ),
    (
        TUBE.replace("turns = 1", "turns = -1001"),
        "mine.toml: notches.turns = -1001.0: must be from -1000 to 1000",
    ),
    (
        TUBE.replace("m3 = 6255", "m3 = 6.255e6"),
        "mine.toml: material.density_kg_m3 = 6255000.0: must be <= 30000 kg",
    ),
]


@pytest.mark.parametrize(("text", "message"), BAD_FILES)
def test_bad_robot_files_are_refused_in_one_line(robot_file, text, message):
    path = robot_file(text)
    with pytest.raises(InvalidInput) as caught:
        load_robot(path)
    shown = str(caught.value).replace(str(path), "mine.toml")
    assert shown.startswith(message)
    assert "\n" not in shown


@pytest.mark.parametrize("name", ["exonav-9", "no/such.toml", "nope.toml", "", "a\0b", 3, None])
def test_what_is_no_robot_lists_the_presets(name):
    with pytest.raises(InvalidInput, match="exonav-1, exonav-2, exonav-3, exonav-4"):
        load_robot(name)


@pytest.mark.parametrize("name", ["exonav1", "ExoNav-1", "exonav_1"])
def test_a_misspelt_preset_is_guessed(name):
    with pytest.raises(InvalidInput, match=r"did you mean exonav-1\?$"):
        load_robot(name)


def test_a_byte_order_mark_is_no_error(robot_file):
    assert load_robot(robot_file(b"\xef\xbb\xbf" + TUBE.encode())).name == "mine"


def test_checks_of_numbers():
    np.testing.assert_array_equal(vector("gravity", [0, 1, np.float64(2)], 3), [0.0, 1.0, 2.0])
    assert within("insertion", np.int64(1), 0.0, 1.0) == 1.0
    with pytest.raises(InvalidInput, match=r"gravity = \[0, 1\]: must be a vector of 3 finite numbers"):
        vector("gravity", [0, 1], 3)
    for bad in (1.5, float("nan"), True, "1", None):
        with pytest.raises(InvalidInput, match=r"insertion = .*: must be from 0 to 1"):
            within("insertion", bad, 0.0, 1.0)


@pytest.mark.parametrize("good", [2, np.int64(2), np.array(2), np.uint8(2)])
def test_whole_numbers(good):
    found = whole("n", good, 1, 5)
    assert (found, type(found)) == (2, int)


@pytest.mark.parametrize("bad", [0, 6, 2.0, True, np.True_, "2", None, float("nan"), np.array([2])])
def test_what_is_no_whole_number_in_range(bad):
    with pytest.raises(InvalidInput, match=r"n = .*: must be a whole number from 1 to 5"):
        whole("n", bad, 1, 5)


def test_whole_number_without_upper_bound():
    assert whole("n", 10**6, 1) == 10**6
    with pytest.raises(InvalidInput, match="n = 0: must be a whole number >= 1"):
        whole("n", 0, 1)


@pytest.mark.parametrize("good", [[1, 2.5], (1, np.float64(2.5)), np.array([1, 2.5])])
def test_arrays_of_numbers(good):
    array = numbers("q", good)
    np.testing.assert_array_equal(array, [1.0, 2.5])
    assert array is not good
    assert array.dtype == float


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (["0.5"], "q[0] = '0.5': must be a finite number"),
        ([1.0, True], "q[1] = True: must be a finite number"),
        (np.array([False]), "q[0] = False: must be a finite number"),
        ([[1.0, 2.0], [3.0, float("nan")]], "q[1][1] = nan: must be a finite number"),
        ([[1.0], [2.0, 3.0]], "q = [[1.0], [2.0, 3.0]]: must be a sequence of finite numbers or rows"),
        (0.5, "q = 0.5: must be a sequence of finite numbers or rows"),
        ("abc", "q = 'abc': must be a sequence"),
        ([1j], "q[0] = 1j: must be a finite number"),
    ],
)
def test_what_is_no_array_of_numbers(bad, said):
    with pytest.raises(InvalidInput) as caught:
        numbers("q", bad, (1, 2))
    assert str(caught.value).startswith(said)


def test_messages_show_plain_numbers():
    assert str(InvalidInput("a", [np.float64(1.5), (np.int64(2),)], "b")) == "a = [1.5, (2,)]: must be b"
    with pytest.raises(InvalidInput, match=r"t = \[\[0.7\]\]: must be a vector of 1 finite number$"):
        vector("t", [[0.7]], 1)
    with pytest.raises(InvalidInput, match=r"from 0 to 0\.0754566$"):
        within("s", 1.0, 0.0, 0.07545661908)


@pytest.mark.parametrize("nothing", [0.0, float("nan"), float("inf")])
def test_not_converged_says_only_what_is_known(nothing):
    error = NotConverged(status="No equilibrium.", load_factor=0.0, residual=nothing, advice="pull less")
    assert str(error) == "No equilibrium; reached none of the load; pull less"
    error = NotConverged(status="No equilibrium.", load_factor=0.5, residual=0.01, advice="pull less")
    assert str(error) == "No equilibrium; reached 0.5 of the load, scaled residual 0.01; pull less"


def test_errors_travel_between_processes():
    error = NotConverged(status="No equilibrium", load_factor=0.5, residual=1e-3, advice="use less tension")
    twin = pickle.loads(pickle.dumps(error))
    assert (str(twin), twin.load_factor) == (str(error), 0.5)
    assert str(pickle.loads(pickle.dumps(InvalidInput("a", 1, "> 2")))) == "a = 1: must be > 2"
