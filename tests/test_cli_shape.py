"""`tendonrod shape` with displacements, scenes, contact and derivatives: the library's numbers, in words and JSON."""

from pathlib import Path

import numpy as np
import pytest

import tendonrod
from tendonrod.scenefile import read_scene

EXAMPLES = Path(__file__).parents[1] / "examples"
CORD = EXAMPLES / "cord.toml"
GRAVITY = (-9.81, 0.0, 0.0)
ON_CORD = ("shape", "exonav-1", "--tension", "0.7", "--gravity", "-9.81,0,0", "--scene", CORD)


@pytest.fixture(scope="module")
def exonav1():
    return tendonrod.load_robot("exonav-1")


@pytest.fixture(scope="module")
def on_cord(exonav1):
    s = np.linspace(0.0, exonav1.length_na, 101)
    return tendonrod.solve(exonav1, 0.7, GRAVITY, s=s, **read_scene(CORD).arguments)


@pytest.fixture
def scene(tmp_path):
    """Path of a scene file with this text."""

    def write(text: str) -> str:
        path = tmp_path / "here.toml"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


# ---- displacements ----


def test_a_displacement_pulls_as_its_tension_does(result, exonav1):
    told = result("shape", "exonav-1", "--displacement", "2.5", "--samples", "5")
    shape = tendonrod.solve(exonav1, displacements=0.0025, s=np.linspace(0.0, exonav1.length_na, 5))
    assert told["displacements"] == [0.0025]
    assert told["tensions"] == shape.tensions.tolist()
    assert told["position"] == shape.position.tolist()
    np.testing.assert_allclose(told["tip"], tendonrod.solve(exonav1, told["tensions"]).tip, atol=2e-6)


def test_some_tendons_by_displacement_and_others_by_tension(result, run):
    given = ("shape", EXAMPLES / "tapered-rod.toml", "--tension", "5", "--tension", "0", "--displacement", "-,2")
    told = result(*given)
    assert told["displacements"] == [None, 0.002]
    assert told["tensions"][0] == 5.0
    assert told["tensions"][1] > 0.0
    rows = [line.split() for line in run(*given)[1].splitlines()]
    assert ["displacements", "-,", "2", "mm"] in rows


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--displacement", "1,2"), "--displacement = 1,2: must be a number, mm"),
        (("--displacement", "-"), "--displacement = -: must be a number, mm"),
        (("--displacement", ""), "--displacement = '': must be a number, mm"),
        (("--displacement", "2mm"), "--displacement = '2mm': must be a finite number"),
        (("--displacement", "nan"), "--displacement = nan: must be a finite number"),
        (
            ("--displacement", "2.5", "--tension", "0.7"),
            "tensions[0] = 0.7: must be 0 where displacements[0] = 0.0025 is given",
        ),
    ],
)
def test_bad_displacements(refused, options, said):
    assert refused("shape", "exonav-1", *options).startswith(said)


def test_one_entry_per_tendon(refused):
    line = refused("shape", EXAMPLES / "tapered-rod.toml", "--displacement", "2")
    assert line == (
        "--displacement = 2: must be 2 entries with commas between them, mm, "
        "nothing or - for a tendon driven by its tension"
    )


# ---- scenes ----


def test_a_scene_in_json_is_the_solve_with_it(result, on_cord):
    told = result(*ON_CORD)
    for name in ("position", "force", "tip"):
        assert told[name] == getattr(on_cord, name).tolist(), name
    contacts = on_cord.contacts
    assert told["contacts"].keys() == told["units"]["contacts"].keys()
    for name in ("s", "point", "normal", "gap", "force", "total"):
        assert told["contacts"][name] == getattr(contacts, name).tolist(), name
    assert [each["name"] for each in told["scene"]["loads"]] == ["point[0]", "mass[0]"]
    assert told["scene"]["loads"][1]["mass"] == 0.0005
    assert told["scene"]["surfaces"] == [
        {"type": "cylinder", "point": [0.0, 0.011, 0.0], "axis": [0.0, 0.0, 1.0], "radius": 0.0065}
    ]
    assert told["scene"]["contact_tolerance"] == 5e-6
    assert told["units"].keys() <= told.keys()


def test_the_robot_rests_on_the_cord(on_cord):
    """What the cord and the exit give is what weighs and pulls: forces balance, and the tube stays outside."""
    weight = on_cord.robot.section.line_density * on_cord.length + 0.0005
    left = on_cord.contacts.total + weight * np.array(GRAVITY) + (0.0, 0.0, -0.002)
    np.testing.assert_allclose(on_cord.force[0], left, atol=2e-6)
    assert on_cord.contacts.gap.min() >= -5e-6


def test_contacts_are_a_table(run, on_cord):
    status, out, err = run(*ON_CORD)
    assert (status, err) == (0, "")
    total = on_cord.contacts.total
    assert f"{1e3 * np.linalg.norm(total):.4g} mN in all" in out
    heads = [f"{1e3 * s:.3f}" for s in on_cord.contacts.s]
    lines = [line.split() for line in out.splitlines()]
    found = [line for line in lines if line and line[0] in heads and len(line) == 7]
    assert len(found) == len(heads)
    assert sum(float(line[2]) for line in found) == pytest.approx(1e3 * on_cord.contacts.force.sum(), abs=1e-2)
    assert out.isascii()


def test_a_surface_out_of_reach_is_told_with_its_distance(run, result, scene):
    far = scene('[[surface]]\ntype = "plane"\npoint_mm = [-20, 0, 0]\nnormal = [1, 0, 0]\n')
    out = run("shape", "exonav-1", "--scene", far)[1]
    assert "contact" in out
    assert "nearest 19.43 mm, at s = 0 mm" in out
    assert result("shape", "exonav-1", "--scene", far)["contacts"]["s"] == []
    assert result("shape", "exonav-1")["contacts"] is None


def test_many_contacts_are_thinned_out_on_paper_only(run, result, scene):
    tube = scene('[[surface]]\ntype = "tube"\npoint_mm = [0, 0, 0]\naxis = [0, 0, 1]\nradius_mm = 0.8\n')
    given = ("shape", "exonav-1", "--tension", "0.3", "--scene", tube)
    count = len(result(*given)["contacts"]["s"])
    assert count > 21
    assert f" of {count} places of contact; --json has all." in run(*given)[1]


def test_the_exit_moves_the_robot_as_a_whole(result, scene):
    moved = scene("[exit]\nposition_mm = [1, 2, 3]\nrotation_deg = [0, 0, 90]\n")
    plain, there = (result("shape", "exonav-1", "--tension", "0.5", *more) for more in ((), ("--scene", moved)))
    x, y, z = plain["tip"]
    np.testing.assert_allclose(there["tip"], (0.001 - y, 0.002 + x, 0.003 + z), atol=1e-12)
    assert there["scene"]["exit_pose"][0][3] == 0.001


def test_masses_without_gravity_are_noted(run, scene):
    path = scene("[[mass]]\nmass_g = 1\n")
    status, _, err = run("shape", "exonav-1", "--scene", path)
    assert (status, err) == (0, f"tendonrod: {path}: the masses weigh nothing, --gravity is 0,0,0\n")
    assert run("shape", "exonav-1", "--scene", path, "--gravity", "-9.81,0,0")[2] == ""


def test_bad_scenes(refused, scene, tmp_path):
    assert refused("shape", "exonav-1", "--scene", "no.toml") == "--scene = no.toml: must be an existing TOML file"
    line = refused("shape", "exonav-1", "--scene", scene("[[mass]]\nmass_g = 1\nat_mm = 100\n"))
    assert line.endswith("here.toml: mass[0].at_mm = 100.0: must be from 0 to the robot's length L_na = 75.4566 mm")
    rod = tmp_path / "rod.toml"
    rod.write_text(
        'name = "r"\n[rod]\nlength_mm = 100\narea_mm2 = 1\nix_mm4 = 0.1\niy_mm4 = 0.1\nj_mm4 = 0.2\n[material]\n'
        "youngs_modulus_gpa = 200\nshear_modulus_gpa = 80\ndensity_kg_m3 = 8000\n"
    )
    plane = scene('[[surface]]\ntype = "plane"\npoint_mm = [-9, 0, 0]\nnormal = [1, 0, 0]\n')
    line = refused("shape", rod, "--scene", plane)
    assert "here.toml: surface = given: must be left out for a rod without a radius" in line


def test_weight_at_the_centroid(result, exonav1):
    told = result("shape", "exonav-1", "--gravity", "-9.81,0,0", "--centroid-weight")
    shape = tendonrod.solve(exonav1, 0.0, GRAVITY, centroid_weight=True)
    assert told["centroid_weight"] is True
    np.testing.assert_allclose(told["tip"], shape.tip, atol=1e-9)
    assert told["tip"] != result("shape", "exonav-1", "--gravity", "-9.81,0,0")["tip"]


# ---- derivatives ----


def numbers(out: str, start: str) -> list[float]:
    """Those of the row that begins so, after "per unit"."""
    (row,) = [line for line in out.splitlines() if line.startswith(start) and " per " in line]
    return [float(word) for word in row.partition("per")[2].split() if word.lstrip("-")[0].isdigit()]


def test_jacobian_in_units_of_the_workshop(run, result, on_cord):
    names = "tensions,insertion,mass[0].mass,tip_force[1],length,exit_tilt[0]"
    out = run(*ON_CORD, "--jacobian", names)[1]
    found = on_cord.jacobian(*names.replace("mass[0]", "loads[1]").split(","))
    rows = {
        "tensions[0]": ("N", 1.0),
        "insertion": ("%", 0.01),
        "mass[0].mass": ("g", 1e-3),
        "tip_force[1]": ("N", 1.0),
        "length": ("mm", 1e-3),
        "exit_tilt[0]": ("deg", np.pi / 180),
    }
    for k, (name, (unit, size)) in enumerate(rows.items()):
        assert any(line.split()[:3] == [name, "per", unit] for line in out.splitlines()), name
        want = [*(1e3 * size * found.position[-1, :, k]), *np.degrees(size * found.rotation[-1, :, k])]
        np.testing.assert_allclose(numbers(out, name), want, rtol=1e-3, atol=1e-6)
    told = result(*ON_CORD, "--jacobian", names)["jacobian"]
    assert told["names"] == list(found.names)
    np.testing.assert_allclose(told["position"], found.position, rtol=1e-9, atol=1e-12)
    assert np.shape(told["rotation"]) == (101, 3, 6)


def test_the_jacobian_by_a_displacement_moves_the_tension_too(run, result):
    out = run("shape", "exonav-1", "--displacement", "2", "--jacobian", "displacements")[1]
    step = [result("shape", "exonav-1", "--displacement", d) for d in ("2.01", "1.99")]
    x, y, z, *_, tension = numbers(out, "displacements[0]")
    tip = (np.array(step[0]["tip"]) - step[1]["tip"]) / 2e-5
    np.testing.assert_allclose((x, y, z), tip, rtol=2e-3)
    assert tension == pytest.approx((step[0]["tensions"][0] - step[1]["tensions"][0]) / 0.02, rel=2e-3)


def test_every_parameter_has_its_unit(run):
    names = "inner_radius,uncut_angle,youngs_modulus,density,turns,tendon_friction"
    out = run("shape", "exonav-1", "--tension", "0.5", "--jacobian", names)[1]
    units = [line.split("per ")[1].split()[0] for line in out.splitlines() if " per " in line]
    assert units == ["mm", "deg", "GPa", "kg/m3", "1", "1"]


def test_compliance_is_a_table_and_a_matrix(run, result, exonav1):
    given = ("shape", "exonav-1", "--tension", "0.5", "--compliance")
    C = tendonrod.solve(exonav1, 0.5).tip_compliance
    np.testing.assert_allclose(result(*given)["tip_compliance"], C, rtol=1e-4, atol=1e-9)
    out = run(*given)[1]
    np.testing.assert_allclose(numbers(out, "force x"), [*(1e3 * C[:3, 0]), *np.degrees(C[3:, 0])], rtol=1e-3)
    np.testing.assert_allclose(numbers(out, "moment y"), [*C[:3, 4], *np.degrees(1e-3 * C[3:, 4])], rtol=1e-3)
    assert result("shape", "exonav-1")["tip_compliance"] is None


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--jacobian", "tension"), "--jacobian = tension: must be one of tensions, displacements, gravity"),
        (("--jacobian", "tensions,"), "--jacobian = tensions,: must be names with commas between them"),
        (("--jacobian", "tip_force[3]"), "--jacobian = tip_force[3]: must be with an index from 0 to 2"),
        (("--jacobian", "displacements"), "--jacobian = displacements[0]: must be an input that was given"),
        (("--jacobian", "mass[0].mass"), "--jacobian = mass[0].mass: must be left out: --scene gives no load"),
        (
            ("--scene", CORD, "--jacobian", "mass[1].mass"),
            "--jacobian = mass[1].mass: must be of one of the loads point[0], mass[0]",
        ),
        (("--jacobian", "tensions", "--insertion", "0"), "--insertion = 0.0: must be > 0 where --jacobian is given"),
        (("--compliance", "--insertion", "0"), "--insertion = 0.0: must be > 0 where --compliance is given"),
    ],
)
def test_bad_derivatives(refused, options, said):
    assert refused("shape", "exonav-1", *options).startswith(said)


# ---- figures, motion, robots ----


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_the_figure_of_a_scene_is_written(run, tmp_path, suffix):
    picture = tmp_path / f"cord.{suffix}"
    status, _, err = run(*ON_CORD, "--figure", picture)
    assert (status, err) == (0, f"tendonrod: wrote {picture}\n")
    assert picture.stat().st_size > 20_000


def test_a_motion_within_a_scene(run, result, tmp_path):
    table, picture = tmp_path / "commands.csv", tmp_path / "motion.png"
    table.write_text("insertion,tension_n\n0.5,0.6\n1,0.7\n")
    given = ("motion", table, "--gravity", "-9.81,0,0", "--scene", CORD)
    told = result(*given, "--samples", "3")
    alone = result(*ON_CORD, "--samples", "3")
    np.testing.assert_allclose(told["shapes"][1]["tip"], alone["tip"], atol=5e-6)
    assert told["shapes"][1]["contacts"]["total"][0] > 0.0
    assert told["scene"]["surfaces"][0]["type"] == "cylinder"
    assert run(*given, "--figure", picture)[0] == 0
    assert picture.stat().st_size > 20_000


@pytest.mark.parametrize(
    ("name", "places", "row"),
    [
        ("tapered-rod", ["base", "tip"], ["A", "2.010619", "0.5026548", "mm2", "area"]),
        ("two-segment", ["segment 1", "segment 2"], ["L", "75", "mm", "length"]),
        ("four-tendon", [""], ["A", "3.141593", "mm2", "area"]),
    ],
)
def test_robots_of_every_kind_are_shown_in_full(run, result, name, places, row):
    path = EXAMPLES / f"{name}.toml"
    status, out, _ = run("robots", path)
    assert status == 0
    assert any(line.split()[: len(row)] == row for line in out.splitlines())
    assert all(place in out for place in places)
    told = result("robots", path)
    assert [each["place"] for each in told["sections"]] == places
    assert told["section"]["A"] == told["sections"][0]["A"]
    for key in ("friction", "axial_stiffness_n", "free_length_mm") if name == "tapered-rod" else ():
        assert f"tendons[1].{key} = " in out
    if name == "two-segment":
        assert "tendons[0].wall = free" in out
        assert "tendons[1].end_mm = 30" in out


def test_an_exit_inside_a_surface_is_named(refused, scene):
    inside = scene('[[surface]]\ntype = "cylinder"\npoint_mm = [0, 2, 0]\naxis = [0, 0, 1]\nradius_mm = 3\n')
    line = refused("shape", "exonav-1", "--tension", "0.7", "--scene", inside)
    assert "here.toml: surface = Cylinder: must be at least 0.000572 m, the tube's radius, from the middle of" in line
