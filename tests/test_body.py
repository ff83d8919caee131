"""Bodies that change along the rod: tables against sections, bodies cut in two, joints, and bad bodies by name."""

import copy
import pickle
from dataclasses import replace
from math import cos, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tendonrod.body import Segments, TaperedRod, evaluate, joints, parts, section_at, section_table
from tendonrod.errors import InvalidInput
from tendonrod.robot import Robot, load_robot
from tendonrod.section import NotchedTube, PlainRod
from tendonrod.tendon import Tendon

STEEL: dict[str, Any] = {"youngs_modulus": 200e9, "shear_modulus": 80e9, "density": 8000.0}
ROD = PlainRod(length=0.1, radius=1e-3, inner_radius=0.5e-3, **STEEL)
TAPER = TaperedRod(length=0.2, base_radius=1e-3, tip_radius=0.3e-3, precurvature=(0.0, 2.0, 0.0), **STEEL)


def tube(**changes) -> NotchedTube:
    body = load_robot("exonav-1").body
    assert isinstance(body, NotchedTube)
    return replace(body, **changes)


def halves(body: NotchedTube) -> Segments:
    half = replace(body, length=0.5 * body.length, turns=0.5 * body.turns)
    return Segments(segments=(half, half))


def by_hand(section, centroid=0.0) -> np.ndarray:
    return np.array([*section.Kse, *section.Kbt, *section.v_star, *section.u_star, section.line_density, centroid, 0.0])


# ---- section table ----


@pytest.mark.parametrize("body", [tube(), ROD, PlainRod(length=0.1, area=1e-6, ix=1e-13, iy=2e-13, j=3e-13, **STEEL)])
def test_a_uniform_body_is_one_row_of_its_section(body):
    table = section_table(body)
    assert table.shape == (1, 62)
    np.testing.assert_array_equal(table[0, :2], [0.0, body.section.L_na])
    np.testing.assert_array_equal(table[0, 2:17], by_hand(body.section, body.mass_centroid_offset))
    assert not table[0, 17:].any()


radii = st.tuples(st.floats(1e-4, 5e-3), st.floats(0.02, 1.0))
shares = st.floats(0.0, 0.95)


@given(radii, shares, shares, st.booleans())
@example((5e-4, 0.078125), 0.6875, 0.0, True)  # a hole that ends at the tip, where rounding made it negative
@settings(max_examples=60, deadline=None)
def test_a_taper_is_in_its_table_to_1e_8_in_every_quantity(radius, base_hole, tip_hole, swapped):
    base, tip = (radius[0], radius[0] * radius[1])[:: -1 if swapped else 1]
    hollow = {"base_inner_radius": base_hole * base, "tip_inner_radius": tip_hole * tip}
    rod = TaperedRod(length=0.3, base_radius=base, tip_radius=tip, **hollow, **STEEL)
    s, table = np.linspace(0.0, 0.3, 173), section_table(rod)
    exact = np.array([by_hand(rod.section_at(each)) for each in s])
    np.testing.assert_allclose(evaluate(table, s), exact, rtol=1e-8)


def test_a_taper_is_continuous_and_takes_few_pieces():
    table = section_table(TAPER)
    assert len(table) <= 64
    ends = table[:-1, 1]
    np.testing.assert_array_equal(ends, table[1:, 0])
    before = np.array([evaluate(table[k : k + 1], [s])[0] for k, s in enumerate(ends)])
    np.testing.assert_allclose(before, evaluate(table, ends), rtol=1e-13)
    assert (table[0, 0], table[-1, 1]) == (0.0, 0.2)


def test_a_taper_that_is_none_is_the_plain_rod():
    hollow = {"base_inner_radius": 5e-4, "tip_inner_radius": 5e-4}
    taper = TaperedRod(length=0.1, base_radius=1e-3, tip_radius=1e-3, **hollow, **STEEL)
    np.testing.assert_array_equal(section_table(taper), section_table(ROD))
    assert Robot(name="rod", body=taper).is_uniform


def test_a_tapers_middle_is_the_rod_of_mean_radius():
    middle = PlainRod(length=0.2, radius=0.65e-3, precurvature=(0.0, 2.0, 0.0), **STEEL).section
    np.testing.assert_allclose(TAPER.section_at(0.1).Kbt, middle.Kbt, rtol=1e-14)
    assert TAPER.section_at(0.1).line_density == pytest.approx(middle.line_density, rel=1e-14)
    assert TAPER.fibre_strain(3.0, 4.0, 0.01, 0.1) == pytest.approx(0.01 + 5.0 * 0.65e-3)


@given(st.floats(1e-4, 1e-2), st.floats(0.0, 0.99))
def test_a_hollow_rod_is_the_solid_one_less_its_core(radius, share):
    solid = PlainRod(length=0.1, radius=radius, **STEEL).section
    hollow = PlainRod(length=0.1, radius=radius, inner_radius=share * radius, **STEEL).section
    np.testing.assert_allclose(hollow.A, solid.A * (1.0 - share**2), rtol=1e-12)
    np.testing.assert_allclose(hollow.Kbt, solid.Kbt * (1.0 - share**4), rtol=1e-12)


# ---- segments ----


@pytest.mark.parametrize("turns", [0.0, 1.0, -2.5])
def test_a_tube_cut_in_two_has_the_same_tables(turns):
    tendons = (
        Tendon.opposite_backbone(radius=5e-5),
        Tendon.helical(offset=3e-4, angle=0.4, turns=1.5, end=0.06),
        Tendon.constant(x=1e-4, y=-2e-4),
        Tendon.sampled([0.0, 0.02, 0.05, 0.08], [0.0, 1e-4, 2e-4, 1e-4], [1e-4, 2e-4, 0.0, 0.0]),
    )
    whole = Robot(name="whole", body=tube(turns=turns), tendons=tendons)
    cut = replace(whole, body=halves(tube(turns=turns)))
    assert cut.length_na == pytest.approx(whole.length_na, rel=1e-15)
    assert cut.turns == pytest.approx(turns)
    assert cut.joints.shape == (0, 4)
    s = np.linspace(0.0, whole.length_na, 41)
    np.testing.assert_allclose(cut.section_values(s), whole.section_values(s), rtol=1e-13)
    for i in range(4):
        np.testing.assert_allclose(cut.tendon_position(i, s), whole.tendon_position(i, s), rtol=1e-13, atol=1e-18)
        np.testing.assert_allclose(cut.tendon_slope(i, s), whole.tendon_slope(i, s), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(cut.tendon_table, whole.tendon_table, rtol=1e-13)
    np.testing.assert_allclose(cut.breaks, [0.5 * whole.length_na, 0.06], rtol=1e-14)
    np.testing.assert_array_equal(whole.breaks, [0.06])


def test_sections_of_segments_are_their_own():
    body = Segments(segments=(tube(), ROD, TAPER))
    starts = np.cumsum([0.0, tube().section.L_na, 0.1])
    whole = starts[-1] + 0.2
    assert (body.section.L_na, body.section.L) == pytest.approx((whole, 0.0754 + 0.3), rel=1e-15)
    np.testing.assert_array_equal(body.section.Kbt, tube().section.Kbt)
    own = {0.0: tube().section, starts[1]: ROD.section, starts[2]: TAPER.section, whole: TAPER.section_at(0.2)}
    for s, section in own.items():
        there = section_at(body, s)
        np.testing.assert_array_equal(there.Kbt, section.Kbt)
        assert there.L_na == pytest.approx(whole, rel=1e-15)
        np.testing.assert_allclose(evaluate(section_table(body), [s])[0, :12], by_hand(there)[:12], rtol=1e-8)


def test_at_a_joint_but_for_rounding_the_segment_beyond_counts():
    body = Segments(segments=(tube(), ROD))
    joint, robot = tube().section.L_na, Robot(name="both", body=body)
    for s in (joint, joint * (1.0 - 1e-15), joint * (1.0 + 1e-15)):
        np.testing.assert_array_equal(robot.axis_offset(s), [[0.0, 0.0]])
        np.testing.assert_array_equal(robot.outer_radius(s), [1e-3])
        np.testing.assert_array_equal(robot.section_values(s)[0, :3], ROD.section.Kse)
    np.testing.assert_array_equal(robot.axis_offset([0.0, joint - 1e-9])[:, 0], [tube().section.r_na] * 2)


@given(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))
def test_tube_axes_and_tendons_meet_at_the_joints(first, second):
    """Followed frame by frame: p + R (r_na, 0) and p + R r are the same on both sides of a joint."""
    body = Segments(segments=(tube(turns=0.0), ROD, tube(turns=0.0, uncut_angle=2.0)), angles=(first, second))
    tendons = (
        Tendon.helical(offset=3e-4, angle=0.4, turns=1.5),
        Tendon.sampled([-0.1, 0.0, 0.1, 0.2, 0.4], [0.0, 1e-4, 2e-4, 1e-4, 0.0], [1e-4, 2e-4, 0.0, 0.0, 3e-4]),
    )
    robot = Robot(name="three", body=body, tendons=tendons)
    np.testing.assert_array_equal(robot.breaks, [part.end for part in parts(body)[:-1]])
    rows = {row[0]: row[1:] for row in robot.joints.tolist()}
    for s in robot.breaks.tolist():
        dx, dy, angle = rows[s]
        ca, sa = cos(angle), sin(angle)
        turn, before = np.array([[ca, -sa], [sa, ca]]), s * (1.0 - 1e-9)
        beyond = [dx, dy] + turn @ robot.axis_offset(s)[0]
        np.testing.assert_allclose(beyond, robot.axis_offset(before)[0], atol=1e-16)
        for i in range(2):
            beyond = [dx, dy] + turn @ robot.tendon_position(i, s)[0, :2]
            np.testing.assert_allclose(beyond, robot.tendon_position(i, before)[0, :2], atol=1e-11)


def test_a_wall_tendon_follows_each_segments_wall():
    wide = tube(turns=0.0, inner_radius=0.5e-3, outer_radius=0.6e-3)
    body = Segments(segments=(ROD, wide), angles=(0.5,))
    robot = Robot(name="both", body=body, tendons=(Tendon.opposite_backbone(radius=1e-4, wall="free"),))
    table = robot.tendon_table
    np.testing.assert_allclose(table[:, 1:3], [[0.0, 0.1], [0.1, 0.1 + wide.length]])
    np.testing.assert_allclose(table[:, 4], [0.4e-3, wide.section.r_na + 0.4e-3])
    np.testing.assert_allclose(table[:, 15], 0.4e-3)
    assert not table[:, 5:15].any()
    held = robot.replace(tendon_wall="held")
    assert not held.tendon_table[:, 15].any()


def test_no_joint_row_where_nothing_jumps():
    assert joints(Segments(segments=(ROD, TAPER))).shape == (0, 4)
    np.testing.assert_array_equal(joints(Segments(segments=(ROD, TAPER), angles=(0.3,))), [[0.1, 0.0, 0.0, 0.3]])


def test_one_segment_is_the_body_itself():
    robot = load_robot("exonav-1")
    alone = replace(robot, body=Segments(segments=(robot.body,)))
    assert alone.is_uniform
    np.testing.assert_array_equal(alone.section_table, robot.section_table)
    np.testing.assert_array_equal(alone.rod_constants, robot.rod_constants)
    np.testing.assert_array_equal(alone.routing, robot.routing)


def test_fibre_strain_is_that_of_the_segment_at_hand():
    unknown = PlainRod(length=0.1, area=1e-6, ix=1e-13, iy=1e-13, j=2e-13, **STEEL)
    body = Segments(segments=(tube(), ROD, TAPER, unknown))
    starts = [part.start for part in parts(body)]
    s = np.array(starts) + 0.01
    strain = body.fibre_strain(np.full(4, 3.0), np.full(4, 4.0), np.zeros(4), s)
    own = [tube().fibre_strain(3.0, 4.0, 0.0), 5e-3, 5.0 * TAPER.outer_radius_at(0.01), np.nan]
    np.testing.assert_allclose(strain, own, rtol=1e-13)
    assert Segments(segments=(unknown,)).fibre_strain(0.0, 0.0, 0.0) is None
    np.testing.assert_allclose(Robot(name="x", body=body).outer_radius(s)[[1, 3]], [1e-3, np.nan])


# ---- numbers by name ----


@pytest.mark.parametrize(
    "body", [TAPER, Segments(segments=(tube(), ROD, TAPER), angles=(0.5, -1.0)), Segments(segments=(ROD,))]
)
def test_replace_with_its_own_parameters_changes_nothing(body):
    robot = Robot(name="body", body=body, tendons=(Tendon.constant(x=1e-3, y=0.0, end=0.05, friction=0.1),))
    assert robot.replace(**robot.parameters()) == robot
    twin = pickle.loads(pickle.dumps(robot))
    assert twin == copy.deepcopy(robot)
    assert hash(twin) == hash(robot)


def test_numbers_of_segments_and_tendons_are_reached_by_flat_names():
    tendons = (Tendon.opposite_backbone(radius=5e-5, end=0.05), Tendon.constant(x=0.0, y=0.0))
    body = Segments(segments=(tube(), PlainRod(length=0.1, radius=1e-3, **STEEL)), angles=(0.2,))
    robot = Robot(name="body", body=body, tendons=tendons)
    changed = robot.replace(
        segment1_length=0.08, segment1_torsion="open_section", segment2_precurvature_y=3.0, segment2_angle=0.5,
        tendon1_end=0.04, tendon2_x=2e-4, tendon2_axial_stiffness=900.0, tendon1_wall="free", tendon1_friction=0.2,
    )  # fmt: skip
    assert isinstance(changed.body, Segments)
    first, second = changed.body.segments
    assert isinstance(first, NotchedTube)
    assert isinstance(second, PlainRod)
    assert (first.length, first.torsion, second.precurvature) == (0.08, "open_section", (0.0, 3.0, 0.0))
    assert changed.body.angles == (0.5,)
    assert changed.tendons[0] == Tendon.opposite_backbone(radius=5e-5, end=0.04, wall="free", friction=0.2)
    assert changed.tendons[1] == Tendon.constant(x=2e-4, y=0.0, axial_stiffness=900.0)
    assert changed.torsion == "open_section, GJ"
    np.testing.assert_array_equal(changed.friction, [0.2, 0.0])
    np.testing.assert_array_equal(changed.tendon_compliance, [0.0, 1.0 / 900.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"segment1_length": -1.0}, "segment1_length = -1.0: must be > 0"),
        ({"segment2_inner_radius": 1.0}, "segment2_inner_radius = 1.0: must be < radius = 0.001"),
        (
            {"segment3_length": 1.0},
            "segment3_length = 1.0: must be called by one of the names name, tendons, segment1_",
        ),
        ({"length": 1.0}, "length = 1.0: must be called by one of the names"),
        ({"tendon_friction": -0.1}, "tendon_friction = -0.1: must be >= 0"),
        ({"tendon_axial_stiffness": 0.0}, "tendon_axial_stiffness = 0.0: must be > 0"),
        ({"tendon_wall": "loose"}, "tendon_wall = 'loose': must be one of held, free"),
        ({"tendon_friction": 0.1, "tendons": ()}, "tendon_friction = 0.1: must be left out where tendons is given"),
    ],
)
def test_bad_changes_are_refused_by_flat_name(change, message):
    robot = Robot(name="body", body=Segments(segments=(tube(), ROD)), tendons=(Tendon.opposite_backbone(radius=5e-5),))
    with pytest.raises(InvalidInput) as caught:
        robot.replace(**change)
    assert str(caught.value).startswith(message)


# ---- bad bodies ----


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: replace(TAPER, tip_radius=0.0), "tip_radius = 0.0: must be > 0"),
        (lambda: replace(TAPER, base_inner_radius=1e-3), "base_inner_radius = 0.001: must be < base_radius = 0.001"),
        (lambda: replace(TAPER, tip_inner_radius=-1.0), "tip_inner_radius = -1.0: must be >= 0"),
        (lambda: replace(TAPER, precurvature=(1.0,)), "precurvature = (1.0,): must be a vector of 3"),
        (lambda: replace(ROD, inner_radius=1e-3), "inner_radius = 0.001: must be < radius = 0.001"),
        (
            lambda: PlainRod(length=0.1, inner_radius=1e-3, area=1e-6, ix=1e-13, iy=1e-13, j=2e-13, **STEEL),
            "inner_radius = 0.001: must be left out where radius is",
        ),
        (lambda: Segments(segments=()), "segments = (): must be one or more of NotchedTube, PlainRod, TaperedRod"),
        (lambda: Segments(segments=(ROD, Segments(segments=(ROD,)))), "segments[1] = Segments("),
        (lambda: Segments(segments=(ROD, ROD), angles=()), "angles = (): must be one number (rad) for each of the 1"),
        (lambda: Segments(segments=(ROD, ROD), angles=(0.1, 0.2)), "angles = (0.1, 0.2): must be one number (rad)"),
        (lambda: Segments(segments=(ROD, ROD), angles=(float("nan"),)), "angles[0] = nan: must be a finite number"),
        (lambda: Segments(segments=(ROD, ROD), angles=0.5), "angles = 0.5: must be one number"),
    ],
)
def test_bad_bodies_are_refused_by_field(make, message):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert str(caught.value).startswith(message)


def test_even_a_needle_keeps_to_the_error():
    needle = TaperedRod(length=1.0, base_radius=1e-3, tip_radius=1e-6, **STEEL)
    s = np.concatenate([np.linspace(0.0, 1.0, 997), 1.0 - np.geomspace(1e-9, 1e-3, 97)])
    exact = np.array([by_hand(needle.section_at(each)) for each in s])
    np.testing.assert_allclose(evaluate(section_table(needle), s), exact, rtol=1e-8)
    assert len(section_table(needle)) <= 512
