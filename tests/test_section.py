"""Sections: the audited table of the four prototypes, the arc by direct integration, and laws that always hold."""

from dataclasses import fields, replace
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad

from tendonrod.errors import InvalidInput
from tendonrod.robot import load_robot
from tendonrod.section import NotchedTube, PlainRod, StiffnessFactors

TABLE = {  # physics, section 2: mm^2, mm, mm^4, mm^4, mm, g/m
    "exonav-1": ("0.0929401", "0.465141", "0.00452581", "0.000275489", "75.45662", "1.162681"),
    "exonav-2": ("0.110495", "0.444772", "0.00722482", "0.000531345", "75.45177", "1.235886"),
    "exonav-3": ("0.144520", "0.812951", "0.0214317", "0.00101450", "63.47585", "1.920936"),
    "exonav-4": ("0.202327", "0.731698", "0.0521941", "0.00462400", "63.43681", "2.146928"),
}
CLOSURE = {"exonav-1": 643, "exonav-2": 656, "exonav-3": 354, "exonav-4": 371}

tubes = st.builds(
    lambda inner, wall, psi, turns, **rest: NotchedTube(
        inner_radius=inner, outer_radius=inner * (1.0 + wall), uncut_angle=psi, turns=turns, **rest
    ),
    inner=st.floats(1e-4, 1e-2),
    wall=st.floats(0.01, 2.0),
    psi=st.floats(0.05, 6.2),
    turns=st.floats(-3.0, 3.0),
    length=st.floats(0.02, 1.0),
    notch_width=st.floats(1e-4, 5e-3),
    notch_spacing=st.floats(1e-4, 5e-3),
    youngs_modulus=st.floats(1e9, 3e11),
    shear_modulus=st.floats(1e9, 1e11),
    density=st.floats(0.0, 2e4),
    torsion=st.sampled_from(["published", "open_section"]),
)


@pytest.mark.parametrize("name", TABLE)
def test_printed_section_numbers(name):
    section = load_robot(name).section
    values = (
        1e6 * section.A,
        1e3 * section.r_na,
        1e12 * section.I_x,
        1e12 * section.I_y,
        1e3 * section.L_na,
        1e3 * section.line_density,
    )
    for value, printed in zip(values, TABLE[name], strict=True):
        assert value == pytest.approx(float(printed), abs=0.5001 * 10.0 ** -len(printed.split(".")[1]))


@pytest.mark.parametrize("name", TABLE)
def test_moments_of_the_arc_by_integration(name):
    tube = load_robot(name).body
    assert isinstance(tube, NotchedTube)
    section, half = tube.section, 0.5 * tube.uncut_angle

    def moment(integrand):
        """Over the arc about angle pi, in the tube's axis frame shifted to the neutral axis; unit outer radius."""
        scale, r_na = tube.outer_radius, section.r_na / tube.outer_radius
        return dblquad(
            lambda radius, angle: integrand(r_na + radius * cos(angle), radius * sin(angle)) * radius,
            pi - half, pi + half, tube.inner_radius / scale, 1.0, epsabs=1e-13, epsrel=1e-12,
        )[0]  # fmt: skip

    unit = tube.outer_radius
    assert moment(lambda x, y: 1.0) * unit**2 == pytest.approx(section.A, rel=1e-10)
    assert moment(lambda x, y: x) == pytest.approx(0.0, abs=1e-12)
    assert moment(lambda x, y: y * y) * unit**4 == pytest.approx(section.I_x, rel=1e-10)
    assert moment(lambda x, y: x * x) * unit**4 == pytest.approx(section.I_y, rel=1e-8)


@pytest.mark.parametrize("name", TABLE)
def test_torsion_models(name):
    robot = load_robot(name)
    tube, section = robot.body, robot.section
    assert isinstance(tube, NotchedTube)
    assert tube.stiffness_factors is not None
    assert section.torsion_stiffness == pytest.approx(75e9 * (section.I_x + section.I_y), rel=1e-14)
    wall, mean = tube.outer_radius - tube.inner_radius, 0.5 * (tube.outer_radius + tube.inner_radius)
    open_section = robot.replace(torsion="open_section").section
    assert open_section.torsion_stiffness == pytest.approx(25e9 * tube.uncut_angle * mean * wall**3 / 3.0, rel=1e-12)
    homogenized, by = robot.replace(torsion="homogenized").section, tube.stiffness_factors
    expected = open_section.Kbt * [by.bending_x, by.bending_y, by.torsion]
    np.testing.assert_allclose(homogenized.Kbt, expected, rtol=1e-14)
    np.testing.assert_allclose(homogenized.Kse, open_section.Kse * [1.0, 1.0, by.axial], rtol=1e-14)
    assert pytest.approx(homogenized.torsion_stiffness / 25e9, rel=1e-15) == homogenized.J
    assert 27 < section.torsion_stiffness / homogenized.torsion_stiffness < 119


@pytest.mark.parametrize("name", CLOSURE)
def test_notch_closure_curvature(name):
    tube = load_robot(name).body
    assert isinstance(tube, NotchedTube)
    assert round(tube.closure_curvature) == CLOSURE[name]


@given(tubes)
def test_second_moments_are_positive_and_ordered(tube):
    section = tube.section
    assert section.I_y > 0.0
    assert section.I_x > 0.0
    assert 0.0 < section.r_na < tube.outer_radius
    assert section.L_na >= tube.length
    assert np.linalg.norm(section.v_star) == pytest.approx(1.0, rel=1e-12)
    assert 0.0 < tube.mass_centroid_offset < section.r_na


@given(tubes, st.floats(0.1, 10.0))
def test_scaling_all_lengths(tube, factor):
    lengths = ("inner_radius", "outer_radius", "length", "notch_width", "notch_spacing")
    larger = replace(tube, **{name: factor * getattr(tube, name) for name in lengths})
    small, large = tube.section, larger.section
    np.testing.assert_allclose(large.Kse, factor**2 * small.Kse, rtol=1e-9)
    np.testing.assert_allclose(large.Kbt, factor**4 * small.Kbt, rtol=1e-7)
    np.testing.assert_allclose(large.v_star, small.v_star, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(large.u_star * factor, small.u_star, rtol=1e-9)
    assert large.line_density == pytest.approx(factor**2 * small.line_density, rel=1e-9)


@given(tubes)
def test_left_and_right_handed_tubes_are_mirror_images(tube):
    right, left = tube.section, replace(tube, turns=-tube.turns).section
    assert left.L_na == right.L_na
    np.testing.assert_array_equal(left.u_star, -right.u_star)
    np.testing.assert_array_equal(left.v_star, right.v_star * [1.0, -1.0, 1.0])
    np.testing.assert_array_equal(left.Kbt, right.Kbt)


@given(tubes, st.floats(-200.0, 200.0), st.floats(-200.0, 200.0), st.floats(-0.05, 0.05))
@settings(max_examples=60)
def test_fibre_strain_is_the_extreme_over_the_arc(tube, du_x, du_y, de_z):
    half = 0.5 * tube.uncut_angle
    radius, angle = np.meshgrid([tube.inner_radius, tube.outer_radius], np.linspace(pi - half, pi + half, 4001))
    x, y = tube.section.r_na + radius * np.cos(angle), radius * np.sin(angle)
    sampled = np.abs(de_z + du_x * y - du_y * x).max()
    exact = float(tube.fibre_strain(du_x, du_y, de_z))
    room = 1e-12 + np.hypot(du_x, du_y) * tube.outer_radius * (tube.uncut_angle / 4000.0) ** 2
    assert sampled - 1e-12 <= exact <= sampled + room


def test_fibre_strain_of_plain_bending():
    tube = load_robot("exonav-1").body
    assert isinstance(tube, NotchedTube)
    inner = tube.section.r_na - tube.inner_radius * cos(0.5 * tube.uncut_angle)
    strains = tube.fibre_strain(np.zeros((2, 3)), np.full((2, 3), 50.0), np.zeros((2, 3)))
    np.testing.assert_allclose(strains, 50.0 * inner, rtol=1e-12)


def test_round_rod():
    rod = PlainRod(length=0.5, radius=1e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8000.0)
    section = rod.section
    np.testing.assert_allclose(section.Kbt, [200e9 * pi * 1e-12 / 4] * 2 + [80e9 * pi * 1e-12 / 2], rtol=1e-14)
    np.testing.assert_allclose(section.Kse, [80e9 * pi * 1e-6] * 2 + [200e9 * pi * 1e-6], rtol=1e-14)
    assert (section.r_na, section.L_na, rod.mass_centroid_offset) == (0.0, 0.5, 0.0)
    assert section.line_density == pytest.approx(8000.0 * pi * 1e-6)
    assert rod.fibre_strain(3.0, 4.0, -0.01) == pytest.approx(0.015)


def test_rod_by_its_constants_equals_the_round_rod():
    material: dict[str, Any] = {"length": 0.5, "youngs_modulus": 200e9, "shear_modulus": 80e9, "density": 8000.0}
    by_radius = PlainRod(radius=1e-3, **material).section
    rod = PlainRod(area=by_radius.A, ix=by_radius.I_x, iy=by_radius.I_y, j=by_radius.J, **material)
    np.testing.assert_allclose(rod.section.Kbt, by_radius.Kbt, rtol=1e-15)
    assert rod.fibre_strain(1.0, 0.0, 0.0) is None


def test_arrays_are_read_only():
    section = load_robot("exonav-1").section
    for field in fields(section):
        value = getattr(section, field.name)
        if isinstance(value, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                value[0] = 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": 0.0}, "length = 0.0: must be > 0"),
        ({"notch_width": -1e-4}, "notch_width = -0.0001: must be > 0"),
        ({"outer_radius": 4e-4}, "outer_radius = 0.0004: must be > inner_radius = 0.000457"),
        ({"outer_radius": 4.57e-4}, "outer_radius = 0.000457: must be > inner_radius = 0.000457"),
        ({"uncut_angle": 2 * pi}, "uncut_angle = 6.28"),
        ({"uncut_angle": 0.0}, "uncut_angle = 0.0: must be inside (0, 2 pi) rad"),
        ({"turns": float("inf")}, "turns = inf: must be a finite number"),
        ({"density": float("nan")}, "density = nan: must be a finite number >= 0"),
        ({"length": True}, "length = True: must be a finite number > 0"),
        ({"length": "75"}, "length = '75': must be a finite number > 0"),
        ({"torsion": "soft"}, "torsion = 'soft': must be one of published, open_section, homogenized"),
        ({"torsion": "homogenized", "stiffness_factors": None}, "stiffness_factors = missing: must be given"),
        ({"length": 7e-4}, "notch_width = 0.0004: must be such that one notch with two spacings fits"),
    ],
)
def test_bad_tubes_are_refused_by_field(change, message):
    with pytest.raises(InvalidInput) as caught:
        replace(load_robot("exonav-1").body, **change)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_bad_factors_and_rods_are_refused_by_field():
    with pytest.raises(InvalidInput, match=r"bending_y_factor = 0.0: must be > 0"):
        StiffnessFactors(axial=1.0, bending_x=1.0, bending_y=0.0, torsion=1.0)
    material: dict[str, Any] = {"length": 0.5, "youngs_modulus": 2e11, "shear_modulus": 8e10, "density": 8000.0}
    with pytest.raises(InvalidInput, match=r"area = missing: must be a finite number > 0"):
        PlainRod(**material)
    with pytest.raises(InvalidInput, match=r"ix = 1.0: must be left out where radius is given"):
        PlainRod(radius=1e-3, ix=1.0, **material)
    with pytest.raises(InvalidInput, match=r"precurvature = .* a vector of 3 finite numbers"):
        PlainRod(**{"radius": 1e-3, "precurvature": (0.0, 1.0), **material})
