"""Where the linear model ends: the numbers of physics.md section 4, and warnings on the right side of each limit."""

from dataclasses import replace
from functools import cache
from math import cos, pi
from types import SimpleNamespace

import numpy as np
import pytest

from tendonrod import InvalidInput, Robot, Tendon, solve
from tendonrod.body import Segments, TaperedRod
from tendonrod.section import NotchedTube, PlainRod
from tendonrod.statics.limits import (
    PLATEAU_STRAIN,
    RECOVERABLE_STRAIN,
    euler_loads,
    fibre_strain,
    shape_warnings,
    wall_pressure,
)
from tendonrod.statics.tension_limits import Limit, tension_limits
from textbook import GRAVITY, four_tendon_rod, helix_rod, prototype, rod

NUMBERS = (1, 2, 3, 4)
PLATEAU = (1.09, 1.75, 1.51, 4.34)  # N, published torsion; a search in steps of 0.01 N, so rounded up
CLOSURE = (643, 656, 354, 371)  # 1/m
LIFT_OFF = {  # N
    "published": (0.0671, 0.1325, 0.3641, 1.749),
    "open_section": (0.0666, 0.1310, 0.3315, 1.376),
}
STRAIN, RECOVERABLE, NOTCH, LIFT = "plateau", "recoverable strain", "notch closure", "tendon lift-off"


@cache
def limits(robot: Robot) -> dict[str, Limit]:
    return {limit.name: limit for limit in tension_limits(robot)}


def tube_of(robot: Robot) -> NotchedTube:
    assert isinstance(robot.body, NotchedTube)
    return robot.body


def tension_at(number: int, name: str, torsion: str = "published") -> float:
    tension = limits(prototype(number, torsion))[name].tension
    assert tension is not None
    return tension


def bent(number: int, tension: float, torsion: str = "published"):
    return solve(prototype(number, torsion), tension, s=[0.0])  # the strains are the same everywhere


def warned(shape, word: str) -> bool:
    return any(word in warning for warning in shape.warnings)


# ---- the numbers ----


@pytest.mark.parametrize(("number", "printed"), list(zip(NUMBERS, PLATEAU, strict=True)))
def test_plateau(number, printed):
    tension = tension_at(number, STRAIN)
    assert np.ceil(100 * tension) / 100 == pytest.approx(printed, abs=1e-12)


@pytest.mark.parametrize("torsion", LIFT_OFF)
@pytest.mark.parametrize("number", NUMBERS)
def test_lift_off(number, torsion):
    printed = LIFT_OFF[torsion][number - 1]
    assert tension_at(number, LIFT, torsion) == pytest.approx(printed, abs=0.51e-3 if printed > 1 else 0.51e-4)


@pytest.mark.parametrize(("number", "printed"), list(zip(NUMBERS, CLOSURE, strict=True)))
def test_closure(number, printed):
    robot, limit = prototype(number), limits(prototype(number))[NOTCH]
    tube = tube_of(robot)
    pitch = tube.notch_width + tube.notch_spacing
    assert limit.value == pytest.approx(
        tube.notch_width / (pitch * (tube.outer_radius + robot.section.r_na)), rel=1e-14
    )
    assert limit.value == pytest.approx(printed, abs=0.51)
    assert limit.unit == "1/m"
    assert tension_at(number, NOTCH) > 10 * tension_at(number, STRAIN)  # far past the plateau


def test_euler_loads():
    softest, mean = (1e3 * load for load in euler_loads(prototype(1)))
    assert (round(softest), round(mean)) == (9, 17)  # mN
    softest, mean = euler_loads(prototype(4))
    assert (round(softest, 1), round(mean, 1)) == (0.2, 0.4)  # N
    column = rod(length=0.3)
    np.testing.assert_allclose(euler_loads(column), pi**2 * column.section.Kbt[0] / (4 * 0.3**2), rtol=1e-14)


@pytest.mark.parametrize("share", [0.9, 1.1, 1.5])
def test_a_column_does_not_silently_stand_above_its_euler_load(share):
    """Pushed along its axis and, a thousand times less, to +x. Above the Euler load the nearly straight shapes, which
    lean to -x, are unstable and not connected to the unloaded column: not to be returned without a word."""
    column = rod(length=0.3)
    load = share * euler_loads(column)[0]
    shape = solve(column, (), tip_force=(1e-3 * load, 0.0, -load))
    if share < 1.0:
        assert 0.0 < shape.tip[0] < 0.03 * 0.3
    else:
        assert shape.tip[0] > 0.3 * 0.3 or shape.warnings


# ---- the limiting quantities, reckoned from the formulas of physics.md ----


@pytest.mark.parametrize("tension", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("number", NUMBERS)
def test_strain_of_the_fibres(number, tension):
    robot, shape = prototype(number), bent(number, tension)
    tube, r_na = tube_of(robot), robot.section.r_na
    kappa, press = shape.u[0, 1], -(shape.v - robot.section.v_star)[0, 2]
    corner = tube.outer_radius if tube.uncut_angle > pi else tube.inner_radius
    inner = kappa * (r_na - corner * cos(tube.uncut_angle / 2)) + press
    outer = kappa * (tube.outer_radius - r_na) - press
    assert press > 0
    assert fibre_strain(shape)[0] == pytest.approx(max(inner, outer), rel=1e-3)  # u_x is small, not zero


def test_strain_of_an_arc_past_half_a_circle():
    robot = prototype(1).replace(uncut_angle=4.0)
    shape, tube, r_na = solve(robot, 0.7, s=[0.0]), tube_of(robot), robot.section.r_na
    press = -(shape.v - robot.section.v_star)[0, 2]
    inner = shape.u[0, 1] * (r_na - tube.outer_radius * cos(2.0)) + press
    assert fibre_strain(shape)[0] == pytest.approx(inner, rel=1e-2)


def test_strain_of_a_round_rod():
    robot, radius = rod(radius=0.4e-3), 0.4e-3
    shape = solve(robot, (), tip_moment=(3e-3, 4e-3, 0.0))
    assert fibre_strain(shape)[-1] == pytest.approx(radius * 5e-3 / robot.section.Kbt[0], rel=1e-9)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_tendon_lifts_off_when_the_bend_is_less_than_a_helix_on_the_wall(number):
    """u_y > (r_in - r_t) u_z^2, to first order."""
    robot = prototype(number)
    shape = bent(number, tension_at(number, LIFT))
    arm = tube_of(robot).inner_radius - robot.tendons[0].radius
    assert abs(wall_pressure(shape, 0)[0]) < 1e-9
    assert shape.u[0, 1] == pytest.approx(arm * shape.u[0, 2] ** 2, rel=0.02)


# ---- each warning on its side of its limit ----


@pytest.mark.parametrize("torsion", ["published", "open_section", "homogenized"])
@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize(
    ("name", "word", "above"), [(STRAIN, "plateau", True), (NOTCH, "notches", True), (LIFT, "lifts", False)]
)
def test_warnings_begin_and_end_at_the_limit(number, torsion, name, word, above):
    tension = tension_at(number, name, torsion)
    for side in (-1, 1):
        shape = bent(number, tension * (1 + side * 1e-7), torsion)
        assert warned(shape, word) == (above == (side > 0))


@pytest.mark.parametrize("number", NUMBERS)
def test_between_the_limits_nothing_is_said(number):
    low, high = tension_at(number, LIFT), tension_at(number, STRAIN)
    for tension in np.linspace(1.001 * low, 0.999 * high, 5):
        assert bent(number, tension).warnings == ()


def test_an_idle_tendon_does_not_lift_off():
    assert solve(prototype(1), 0.0).warnings == ()
    assert warned(solve(prototype(1), 0.01), "lifts")


def test_gravity_counts_as_well():
    """Bent by 1 N, prototype 1 is in its linear range; hung with twenty times its weight it is not."""
    assert solve(prototype(1), 1.0, GRAVITY).warnings == ()
    assert warned(solve(prototype(1), 1.0, 20 * GRAVITY), "plateau")


def test_a_warning_names_its_place_and_its_tendon():
    shape = solve(prototype(1), 0.5, tip_force=(0.05, 0.0, 0.0), s=[0.0, 0.03, 0.07])
    place = 1e3 * shape.s[fibre_strain(shape).argmax()]
    assert any(f"at s = {place:.3g} mm" in warning for warning in shape.warnings)
    assert any(warning.startswith("tendon 1 lifts") for warning in solve(prototype(1), 0.01).warnings)


# ---- limits that are not there ----


def test_closure_is_not_reached_where_the_tendon_opens_the_notches():
    """On the backbone's side of the neutral axis the tendon bends the tube the other way."""
    robot = prototype(1).replace(tendons=(Tendon.constant(x=-0.1e-3, y=0.0),))
    found = limits(robot)
    assert found[NOTCH].tension is None
    assert found[STRAIN].tension is not None
    assert solve(robot, 1.0).u[0, 1] < 0
    assert LIFT not in found  # it does not lie on the notched wall


def test_a_tendon_in_straight_notches_never_lifts_off():
    """Nothing winds, so the tendon lies on the inside of a planar bend however weakly it is pulled."""
    robot = prototype(1).replace(turns=0.0)
    assert solve(robot, 1e-6).warnings == ()
    assert limits(robot)[LIFT].tension is None


def test_a_tendon_that_ends_half_way_has_the_limits_of_its_own_half():
    """Up to its end the robot is bent as if the tendon went on; beyond it nothing pulls."""
    robot = prototype(1)
    half = robot.replace(tendons=(Tendon.opposite_backbone(radius=0.05e-3, end=0.04),))
    for name, limit in limits(robot).items():
        assert limits(half)[name].tension == pytest.approx(limit.tension, rel=1e-6)
    assert solve(half, 0.7).warnings == ()
    assert solve(half, 0.7, s=np.linspace(0.0, 0.07, 500)).warnings == ()
    assert solve(half, 0.7, s=[0.04]).warnings == ()


def test_a_limit_below_the_searched_tensions_is_found_or_told():
    """A robot a million times as soft meets its plateau below a millinewton."""
    soft = prototype(1).replace(youngs_modulus=75e3, shear_modulus=25e3)
    expected = 1e-6 * tension_at(1, STRAIN)  # the strains depend on tension over modulus alone
    assert limits(soft)[STRAIN].tension == pytest.approx(expected, rel=1e-6)


def test_rods_have_the_limits_that_apply():
    assert tension_limits(rod()) == ()
    assert [limit.name for limit in tension_limits(rod(Tendon.constant(x=1e-3, y=0.0)))] == [STRAIN, RECOVERABLE]
    body = PlainRod(
        length=0.1, area=1e-6, ix=1e-13, iy=1e-13, j=2e-13, youngs_modulus=75e9, shear_modulus=25e9, density=1
    )
    unknown = Robot(name="outline not known", body=body, tendons=(Tendon.constant(x=1e-3, y=0.0),))
    assert tension_limits(unknown) == ()
    assert np.all(np.isnan(fibre_strain(solve(unknown, 1.0))))


def test_each_tendon_is_pulled_alone():
    found = tension_limits(four_tendon_rod(0.0))
    assert [(limit.tendon, limit.name) for limit in found] == [
        (i, name) for i in range(4) for name in (STRAIN, RECOVERABLE)
    ]
    np.testing.assert_allclose([limit.tension for limit in found[::2]], found[0].tension, rtol=1e-9)
    assert {limit.tendon for limit in tension_limits(helix_rod())} == {0, 1, 2}


# ---- that they are limits of strain ----


@pytest.mark.parametrize("number", NUMBERS)
def test_strain_limits_are_met_where_they_say(number):
    assert pytest.approx(0.0067, abs=5e-5) == PLATEAU_STRAIN
    assert 0.06 <= RECOVERABLE_STRAIN <= 0.08
    for name, strain in ((STRAIN, PLATEAU_STRAIN), (RECOVERABLE, RECOVERABLE_STRAIN)):
        limit = limits(prototype(number))[name]
        assert limit.value == strain
        assert fibre_strain(bent(number, limit.tension))[0] == pytest.approx(strain, rel=1e-9)


@pytest.mark.parametrize("number", NUMBERS)
def test_mirrored_robots_have_the_same_limits(number):
    mirrored = prototype(number).replace(turns=-1.0)
    for name, limit in limits(prototype(number)).items():
        assert limits(mirrored)[name].tension == pytest.approx(limit.tension, rel=1e-9)


def test_robot_must_be_a_robot():
    for bad in ("exonav-1", None):
        with pytest.raises(InvalidInput, match="robot"):
            tension_limits(bad)


# ---- segments: whoever is at s_m ----

STEEL = {"youngs_modulus": 200e9, "shear_modulus": 80e9, "density": 8000.0}


def strained(robot: Robot, s, u, v=(0.0, 0.0, 1.0)):
    """What the limits read of a shape, with strains as given."""
    s = np.asarray(s, dtype=float)
    strains = {"u": np.broadcast_to(u, (s.size, 3)), "v": np.broadcast_to(v, (s.size, 3))}
    shape = SimpleNamespace(robot=robot, s=s, material_coordinate=s, **strains, converged=True, stable=True, steps=16)
    return SimpleNamespace(**vars(shape), length=s[-1], tensions=np.ones(robot.n_tendons), at=lambda _: shape_of(shape))


def shape_of(shape):
    return SimpleNamespace(**vars(shape), tensions=np.ones(shape.robot.n_tendons))


def segmented(*tendons: Tendon) -> Robot:
    straight = replace(tube_of(prototype(1)), turns=0.0)
    wide = replace(straight, notch_width=2.0 * straight.notch_width)
    rod = PlainRod(length=0.05, radius=1e-3, inner_radius=0.457e-3, precurvature=(0.0, 30.0, 0.0), **STEEL)
    return Robot(name="three", body=Segments(segments=(straight, rod, wide)), tendons=tendons)


def two_tubes(robot: Robot) -> tuple[NotchedTube, NotchedTube]:
    assert isinstance(robot.body, Segments)
    straight, _, wide = robot.body.segments
    assert isinstance(straight, NotchedTube)
    assert isinstance(wide, NotchedTube)
    return straight, wide


def test_fibre_strain_of_segments_is_each_ones_own():
    robot = segmented()
    straight, wide = two_tubes(robot)
    s = np.array([0.01, straight.length + 0.01, straight.length + 0.06])
    found = fibre_strain(strained(robot, s, (0.0, 50.0, 0.0)))
    own = [straight.fibre_strain(0.0, 50.0, 0.0), 20.0 * 1e-3, wide.fibre_strain(0.0, 50.0, 0.0)]
    np.testing.assert_allclose(found, own, rtol=1e-13)


def test_strain_of_known_outlines_is_warned_of_beside_unknown_ones():
    unknown = PlainRod(length=0.05, area=1e-6, ix=1e-13, iy=1e-13, j=2e-13, **STEEL)
    known = PlainRod(length=0.05, radius=1e-3, **STEEL)
    robot = Robot(name="two", body=Segments(segments=(unknown, known)))
    assert not shape_warnings(strained(robot, [0.0, 0.04, 0.08], (0.0, 6.0, 0.0)))
    (warning,) = shape_warnings(strained(robot, [0.0, 0.04, 0.08], (0.0, 7.0, 0.0)))
    assert warning.startswith("strain 0.7 % at s = 80 mm")


def test_each_segment_closes_its_own_notches():
    robot = segmented()
    straight, wide = two_tubes(robot)
    assert straight.closure_curvature < wide.closure_curvature
    between = 0.5 * (straight.closure_curvature + wide.closure_curvature)
    s = np.linspace(0.0, robot.length_na, 33)
    closed = [each for each in shape_warnings(strained(robot, s, (0.0, between, 0.0))) if "closes" in each]
    assert len(closed) == 1
    assert "closes the notches of segment 1" in closed[0]
    assert closed[0].endswith(f"(at {straight.closure_curvature:.4g} 1/m)")


def test_wall_pressure_of_segments_and_of_free_tendons():
    held = segmented(Tendon.opposite_backbone(radius=5e-5), Tendon.opposite_backbone(radius=5e-5, end=0.06))
    s = np.linspace(0.0, held.length_na, 40)
    shape = strained(held, s, (0.0, -20.0, 0.0))
    np.testing.assert_allclose(wall_pressure(shape, 0), -20.0 * (1.0 + 20.0 * held.tendon_position(0, s)[:, 0]))
    assert wall_pressure(shape, 1).size == (s < 0.06).sum()
    assert sum("lifts off" in each for each in shape_warnings(shape)) == 2
    free = held.replace(tendon1_wall="free", tendon2_wall="free")
    assert not any("lifts off" in each for each in shape_warnings(strained(free, s, (0.0, -20.0, 0.0))))


def test_euler_loads_take_the_softest_section():
    taper = Robot(name="taper", body=TaperedRod(length=0.3, base_radius=2e-3, tip_radius=1e-3, **STEEL))
    thin = Robot(name="thin", body=PlainRod(length=0.3, radius=1e-3, **STEEL))
    assert euler_loads(taper) == pytest.approx(euler_loads(thin), rel=1e-8)
    assert euler_loads(Robot(name="both", body=Segments(segments=(taper.body, thin.body)))) == pytest.approx(
        np.array(euler_loads(thin)) / 4.0, rel=1e-8
    )
