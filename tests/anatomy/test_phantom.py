"""Phantoms: sound meshes, the right sides, symmetric, as wide as their numbers say; targets where robots can be."""

import numpy as np
import pytest

from anatomy.meshes import by_brute_force, solid_angle
from tendonrod import InvalidInput
from tendonrod.anatomy import load_phantom
from tendonrod.anatomy.building import gaps
from tendonrod.anatomy.column import Column
from tendonrod.anatomy.dimensions import QUANTITIES, SCALES, Dimensions
from tendonrod.anatomy.levels import NAMES, level_range
from tendonrod.anatomy.soundness import mesh_volume, open_edges

P1, P3 = 0.572e-3, 0.953e-3  # outer radii of ExoNav 1 and 3, m


def column(levels="T8-L2", has_dura=True, **numbers):
    return Column(names=level_range(levels), numbers=Dimensions(numbers=numbers), has_dura=has_dura)


def test_every_structure_is_closed_and_right_side_out(either):
    for each in either.structures.values():
        assert len(open_edges(each.faces)) == 0, each
        assert mesh_volume(*each.mesh) > 0.0, each
        assert not each.vertices.flags.writeable


def test_a_structure_s_distance_is_that_to_its_mesh(printed):
    """Away from the ends, where the distance goes on beyond the mesh."""
    random = np.random.default_rng(0)
    for each in printed.structures.values():
        for p in random.uniform((-6e-3, -9e-3, 0.0), (6e-3, 9e-3, 15e-3), (6, 3)):
            sign = -1.0 if solid_angle(p, *each.mesh) > 0.5 else 1.0
            truth = sign * by_brute_force(p, *each.mesh)
            assert each.surface.distance([p])[0][0] == pytest.approx(truth, abs=2.5e-5)


def test_gradients_have_unit_length_beside_walls(either):
    """All of cord and dura; of the canal all but a tenth, which lies at the sharp rims of foramina and windows."""
    p = np.random.default_rng(1).uniform((-8e-3, -1.2e-2, 0.0), (1e-2, 1.2e-2, 2e-2), (4000, 3))
    for each in either.structures.values():
        if each.is_wall:
            d, gradient = each.surface.distance(p)
            off = np.abs(np.linalg.norm(gradient[(d > 0.0) & (d < 0.6e-3)], axis=1) - 1.0)
            assert np.quantile(off, 1.0 if each.role in ("cord", "dura") else 0.9) < 0.03


def test_free_is_the_nearest_wall_and_clearance_has_every_wall(either):
    p = np.random.default_rng(2).uniform((-8e-3, -1.2e-2, -0.05), (1e-2, 1.2e-2, 0.1), (60, 3))
    clearance = either.clearance(p)
    walls = [name for name, each in either.structures.items() if each.is_wall]
    assert set(walls) <= set(clearance)
    np.testing.assert_array_equal(either.free().distance(p)[0], np.min([clearance[name] for name in walls], axis=0))


def test_walls_go_on_beyond_both_ends(either):
    """A canal is open at its ends: no wall across it, above, below or in the range."""
    low, high = -0.013, either.levels[0].z_high
    for end, beyond in ((high, high + 0.05), (low, low - 0.05)):
        p = np.array([[x, y, end] for x in (-6e-3, 4e-3, 7e-3) for y in (-7e-3, 0.0, 7e-3)])
        there, far = (either.clearance(p + np.array([0.0, 0.0, z - end])) for z in (end, beyond))
        for name in there.keys() - {"roots"}:
            np.testing.assert_allclose(far[name], there[name], atol=1e-4, err_msg=name)


def test_left_is_the_mirror_of_right(either):
    p = np.random.default_rng(3).uniform((-8e-3, 0.0, -5e-3), (1e-2, 1.2e-2, 2.5e-2), (500, 3))
    for name, d in either.clearance(p).items():
        np.testing.assert_allclose(either.clearance(p * [1, -1, 1])[name], d, atol=4e-5, err_msg=name)
    for target in either.targets.values():
        if target.side == "right":
            mirrored = either.target(target.name.replace("right", "left"))
            assert mirrored.position == pytest.approx(np.array(target.position) * [1, -1, 1], abs=1e-12)


def test_a_robot_of_p1_fits_at_every_target_of_every_level():
    """Room measured on outlines: the tube's middle in the gap between nested ellipses, or in a foramen."""
    for has_dura in (False, True):
        spine = column("C3-L5", has_dura)
        for level in spine.names:
            assert min(gaps(spine, level).values()) > 2.0 * P1


def test_targets_have_room_for_p1(either):
    for target in either.targets.values():
        assert either.free().distance([target.position])[0][0] > P1, target.name


def test_there_are_five_targets_at_each_level(either):
    kinds = ["ventral", "lateral-right", "lateral-left", "drg-right", "drg-left"]
    assert list(either.targets) == [f"{kind}@T11" for kind in kinds]
    assert either.target("ventral@T11").position[0] < 0.0 < either.target("lateral-right@T11").position[1]


def test_ganglia_lie_beside_their_targets(anatomical):
    ganglia = anatomical.structures["ganglia"]
    for side in ("left", "right"):
        target = np.array(anatomical.target(f"drg-{side}@T11").position)
        gap = by_brute_force(target, *ganglia.mesh)
        assert P1 < gap < 3e-3


def test_layers_are_nested(anatomical):
    """Cord in dura, dura clear of bone and discs, ligaments outside the canal."""
    clearance = anatomical.clearance
    assert (clearance(anatomical.structures["cord"].vertices[::7])["dura"] < -0.1e-3).all()
    assert (clearance(anatomical.structures["dura"].vertices[::7])["bone"] > 1.2e-3).all()
    for name in ("bone", "discs", "ligaments"):
        vertices = anatomical.structures[name].vertices
        near = vertices[(np.abs(vertices[:, 0] - 1e-3) < 9e-3) & (np.abs(vertices[:, 1]) < 13e-3)]
        assert (clearance(near)["bone"] < 0.1e-3).all(), name  # at rims the spline rounds edges off


def test_sections_measure_what_the_table_says(printed):
    z = printed.levels[0].middle
    cord, canal = printed.structures["cord"].surface, printed.structures["canal"].surface
    plan = printed.plan
    for surface, name in ((cord, "cord"), (canal, "canal")):
        for axis, which in ((0, "depth"), (1, "width")):
            half = 0.5 * float(plan.at(f"{name}_{which}", z))
            p = np.array([[0.0, 0.0, z]] * 2)
            p[:, axis] = half, -half
            np.testing.assert_allclose(surface.distance(p)[0], 0.0, atol=8e-6)


def test_published_numbers_come_back_at_their_levels():
    numbers = Dimensions()
    assert numbers.of("cord_width", "T8") == pytest.approx(8.3e-3)
    assert numbers.of("canal_depth", "T12") == pytest.approx(16.7e-3)
    assert numbers.of("canal_depth", "L2") == pytest.approx(0.5 * (16.7e-3 + 15.7e-3))
    assert numbers.of("cord_width", "T1") / numbers.of("canal_width", "T1") == pytest.approx(0.55, abs=0.005)
    assert numbers.of("cord_width", "C5") / numbers.of("canal_width", "C5") == pytest.approx(0.64, abs=0.005)
    assert all(each.source and each.meaning for each in QUANTITIES.values())


def test_levels_stand_on_each_other():
    spine = column("C3-L5")
    assert spine.names == NAMES
    assert spine.levels[-1].z_low == 0.0
    for above, below in zip(spine.levels[:-1], spine.levels[1:], strict=True):
        assert above.z_low == pytest.approx(below.z_high + above.disc)
    assert [spine.place(level.middle).item() for level in spine.levels] == pytest.approx(range(len(NAMES)))


def test_an_offset_cord_stays_at_the_origin_and_the_canal_moves():
    spine = column(has_dura=False, cord_offset=1.5)
    z = spine.levels[3].middle
    assert spine.cord([z]).middle[0, 1] == 0.0
    assert spine.canal([z]).middle[0, 1] == pytest.approx(-1.5e-3)
    room = gaps(spine, "T11")
    straight = gaps(column(has_dura=False), "T11")
    assert room["right"] < straight["right"] < room["left"]
    assert straight["right"] - 1.5e-3 <= room["right"] + 1e-9


@pytest.mark.parametrize("name", SCALES)
def test_a_scale_multiplies_its_lengths_and_no_others(name):
    scaled = Dimensions(scale={name: 1.1})
    for quantity in QUANTITIES:
        factor = 1.1 if quantity in SCALES[name] else 1.0
        assert scaled.of(quantity, "T10") == pytest.approx(factor * Dimensions().of(quantity, "T10"))


def test_the_cord_ends_at_the_disc_below_l1_where_there_is_a_dura():
    spine = column("T12-L2")
    filum = 0.5 * spine.numbers.of("filum_width", "L1")
    z = np.array([spine.conus_tip - 1e-3, spine.level("T12").middle])
    np.testing.assert_allclose(spine.cord(z).width, [filum, 0.5 * spine.at("cord_width", z)[1]])
    np.testing.assert_allclose(column("T12-L2", has_dura=False).cord(z).width, 0.5 * spine.at("cord_width", z))


@pytest.mark.parametrize("levels", ["L2-T8", "T13", "", "T8-L2-L3", 3, "S1"])
def test_wrong_ranges_are_named(levels):
    with pytest.raises(InvalidInput, match=r"^levels = .*as T8-L2"):
        level_range(levels)


@pytest.mark.parametrize("text", ["T8-L2", "t8-l2", " T8 – L2 "])
def test_ranges_may_be_written_in_several_ways(text):
    assert level_range(text) == ("T8", "T9", "T10", "T11", "T12", "L1", "L2")


def test_a_thick_robot_is_refused_with_both_numbers(printed, anatomical):
    printed.check_robot(P3)
    anatomical.check_robot(P1)
    with pytest.raises(
        InvalidInput,
        match=r"a tube of 1.906 mm: must be thinner than the gap: the widest lateral gap .* 1.3\d\d mm, at T11",
    ):
        anatomical.check_robot(P3)
    with pytest.raises(InvalidInput, match=r"widest dorsal gap between cord and canal in printed is 4.675 mm, at T11"):
        printed.check_robot(2.4e-3)


def test_targets_without_room_are_proved_unreachable(anatomical):
    assert anatomical.unreachable(P1) == {}
    blocked = anatomical.unreachable(2.5e-3)
    assert "ventral@T11 has room for a tube of 4." in blocked["ventral@T11"]


def test_a_cord_wider_than_its_canal_is_refused():
    with pytest.raises(InvalidInput, match=r"canal_width_mm less cord_width_mm = -12\.00 mm at T8: must be > 0"):
        column(has_dura=False, canal_width=8.0, cord_width=20.0)
    with pytest.raises(InvalidInput, match=r"dural sac = .* mm at .*: must be room for the cord of"):
        column(cord_depth=12.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"scale": {"cord": 1.1}}, "scale.cord = 1.1: must be left out, or under one of the names cord_width"),
        ({"scale": {"height": 3.0}}, "scale.height = 3.0: must be from 0.4 to 2.5"),
        ({"numbers": {"cord_widht": 9.0}}, "numbers.cord_widht_mm = 9.0: must be one of the numbers cord_width_mm"),
        ({"numbers": {"cord_width": 0.0083}}, "numbers.cord_width_mm = 0.0083: must be from"),
        ({"numbers": {"cord_width": {"T13": 9.0}}}, "numbers.cord_width_mm.T13 = 9.0: must be under a level"),
        ({"numbers": {"cord_offset": 2.5}}, "numbers.cord_offset_mm = 2.5: must be from -2 to 2"),
    ],
)
def test_wrong_numbers_of_a_patient_are_named(given, said):
    with pytest.raises(InvalidInput) as error:
        Dimensions(**given)
    assert str(error.value).startswith(said)


@pytest.mark.parametrize("source", ["print", "", 3, None])
def test_unknown_phantoms_are_named(source):
    with pytest.raises(InvalidInput, match="one of printed, anatomical, or the path of a phantom file"):
        load_phantom(source)


def test_the_same_phantom_has_the_same_fingerprint(printed):
    again = load_phantom("printed", levels=printed.level_range)
    assert again.fingerprint == printed.fingerprint
    assert load_phantom("anatomical", levels="T11").fingerprint != printed.fingerprint


def test_entries_lie_in_the_dorsal_gap(either):
    entry = either.entry("T11")
    p = [(entry.depth, entry.offset, entry.height)]
    clearance = either.clearance(p)
    inner = "dura" if "dura" in clearance else "cord"
    assert clearance[inner][0] > P1
    with pytest.raises(InvalidInput, match="level = 'L4': must be one of T11"):
        either.entry("L4")
