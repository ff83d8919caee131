"""Tendons: the table against r and its slope, sampled routings, where they end, and bad tendons by name."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendonrod.errors import InvalidInput
from tendonrod.robot import Robot, load_robot
from tendonrod.section import PlainRod
from tendonrod.tendon import Tendon

ROD = PlainRod(length=0.2, radius=1e-3, youngs_modulus=2e11, shear_modulus=8e10, density=8000.0)
KNOTS = np.array([0.0, 0.03, 0.09, 0.12, 0.2])


def rod(*tendons: Tendon) -> Robot:
    return Robot(name="rod", body=ROD, tendons=tendons)


def from_table(table: np.ndarray, i: int, s: float) -> np.ndarray:
    """X, Y as the table's docstring says, by the row that holds s."""
    row = next(row for row in table if row[0] == i and row[1] <= s <= row[2])
    powers, phase = (s - row[1]) ** np.arange(4), row[13] + row[14] * s
    return np.array([row[4:8] @ powers + row[12] * np.cos(phase), row[8:12] @ powers + row[12] * np.sin(phase)])


def test_the_table_says_where_the_tendons_run():
    sampled = Tendon.sampled(KNOTS, 1e-3 * np.sin(9 * KNOTS), 2e-3 * np.cos(7 * KNOTS), end=0.15)
    robot = rod(Tendon.constant(x=1e-3, y=-2e-3), sampled, Tendon.helical(offset=2e-3, angle=0.3, turns=2, end=0.11))
    for i, end in enumerate((0.2, 0.15, 0.11)):
        s = np.linspace(0.0, end, 50)
        by_rows = np.array([from_table(robot.tendon_table, i, each) for each in s])
        np.testing.assert_allclose(robot.tendon_position(i, s)[:, :2], by_rows, atol=1e-17)
        rows = robot.tendon_table[robot.tendon_table[:, 0] == i]
        np.testing.assert_array_equal(rows[1:, 1], rows[:-1, 2])
        assert (rows[0, 1], rows[-1, 2]) == (0.0, end)
    np.testing.assert_array_equal(robot.breaks, [0.11, 0.15])
    np.testing.assert_array_equal(robot.tendon_ends, [0.2, 0.15, 0.11])
    np.testing.assert_array_equal(robot.routing[:, 5], robot.tendon_ends)
    assert not robot.is_uniform


@pytest.mark.parametrize(
    "tendon",
    [Tendon.helical(offset=2e-3, angle=0.3, turns=-1.5), Tendon.sampled(KNOTS, 1e-3 * KNOTS**2, np.sin(20 * KNOTS))],
)
def test_the_slope_is_the_derivative(tendon):
    robot, s, h = rod(tendon), np.linspace(0.01, 0.19, 41), 1e-6
    numeric = (robot.tendon_position(0, s + h) - robot.tendon_position(0, s - h)) / (2.0 * h)
    np.testing.assert_allclose(robot.tendon_slope(0, s), numeric, rtol=1e-6, atol=1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4), st.integers(4, 9), st.floats(0.02, 0.2))
def test_points_of_a_cubic_give_the_cubic(c, count, end):
    s = np.linspace(-0.05, 0.25, count)
    robot = rod(Tendon.sampled(s, np.polyval(c, s), -np.polyval(c, s), end=end))
    at = np.linspace(0.0, end, 17)
    np.testing.assert_allclose(robot.tendon_position(0, at)[:, 0], np.polyval(c, at), atol=1e-12)
    np.testing.assert_allclose(robot.tendon_slope(0, at)[:, 1], -np.polyval(np.polyder(c), at), atol=1e-10)


@pytest.mark.parametrize("count", [2, 3])
def test_two_points_give_a_line_and_three_a_parabola(count):
    s = np.linspace(0.0, 0.2, count)
    robot = rod(Tendon.sampled(s, s ** (count - 1), 0.0 * s))
    assert robot.tendon_position(0, 0.05)[0, 0] == pytest.approx(0.05 ** (count - 1), rel=1e-13)


def test_a_sampled_routing_bends_without_jumps():
    robot = rod(Tendon.sampled(KNOTS, np.sin(30 * KNOTS), np.cos(30 * KNOTS)))
    inner = KNOTS[1:-1]
    np.testing.assert_allclose(robot.tendon_position(0, inner)[:, 0], np.sin(30 * inner), atol=1e-15)
    for value in (robot.tendon_position, robot.tendon_slope):
        np.testing.assert_allclose(value(0, inner - 1e-12), value(0, inner), atol=1e-8)
    slopes = [robot.tendon_slope(0, inner + d) for d in (-2e-7, -1e-7, 1e-7, 2e-7)]
    np.testing.assert_allclose(slopes[1] - slopes[0], slopes[3] - slopes[2], atol=1e-7)


def test_a_free_tendon_has_the_lumen_as_its_room():
    robot = load_robot("exonav-1").replace(tendon_wall="free")
    np.testing.assert_allclose(robot.tendon_table[0, 15], 0.457e-3 - 0.05e-3)
    assert robot.tendon_table[0, 4] - robot.tendon_table[0, 15] == pytest.approx(robot.section.r_na, rel=1e-14)
    assert not robot.is_uniform
    assert load_robot("exonav-1").is_uniform


def test_tables_are_as_the_kernel_takes_them():
    robot = rod(Tendon.sampled(KNOTS, KNOTS, KNOTS), Tendon.constant(x=0.0, y=0.0, end=0.1))
    names = ("section_table", "tendon_table", "joints", "breaks", "friction", "tendon_compliance", "free_lengths")
    for table in (getattr(robot, name) for name in (*names, "rod_constants", "tendon_ends")):
        assert table.dtype == float
        assert table.flags.c_contiguous
        assert table.flags.writeable
    bare = rod()
    assert [getattr(bare, name).shape for name in names[1:]] == [(0, 16), (0, 4), (0,), (0,), (0,), (0,)]


def test_reach_bounds_the_farthest_tendon():
    robot = rod(Tendon.sampled([0.0, 0.1, 0.2], [0.0, 3e-3, 0.0], [0.0, 0.0, 0.0]), Tendon.constant(x=1e-3, y=0.0))
    assert robot.rod_constants[-1] == pytest.approx(3e-3, rel=0.02)


def test_an_end_at_the_tip_but_for_rounding_is_the_tip():
    robot = rod(Tendon.constant(x=0.0, y=0.0, end=0.2 * (1.0 - 1e-15)))
    assert robot.breaks.size == 0
    assert robot.tendon_ends[0] == robot.length_na


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: rod(Tendon.sampled([0.0, 0.1], [0, 0], [0, 0])),
            "tendons[0].s = from 0 to 0.1 m: must be covering the",
        ),
        (lambda: rod(Tendon.sampled([0.1, 0.3], [0, 0], [0, 0])), "tendons[0].s = from 0.1 to 0.3 m: must be covering"),
        (lambda: Tendon.sampled([0.0, 0.0], [0, 0], [0, 0]), "s = (0.0, 0.0): must be two or more numbers that incre"),
        (lambda: Tendon.sampled([0.0], [0], [0]), "s = (0.0,): must be two or more numbers that increase"),
        (lambda: Tendon.sampled([0.0, 1.0], [0, 0, 0], [0, 0]), "x = (0.0, 0.0, 0.0): must be as many numbers as s, 2"),
        (lambda: Tendon.sampled([0.0, 1.0], [0, "1"], [0, 0]), "x[1] = '1': must be a finite number"),
        (lambda: Tendon.sampled([0.0, 1.0], 0.0, [0, 0]), "x = 0.0: must be a sequence of finite numbers"),
        (lambda: Tendon(routing="sampled", s=(0.0, 1.0), x=(0.0, 0.0)), "y = missing: must be a sequence of finite"),
        (lambda: Tendon(routing="constant", x=0.0, y=0.0, s=(0.0,)), "s = (0.0,): must be left out where routing = "),
        (lambda: Tendon(routing="constant", x=(0.0,), y=0.0), "x = (0.0,): must be a finite number"),
        (lambda: Tendon.constant(x=0.0, y=0.0, friction=-1.0), "friction = -1.0: must be >= 0"),
        (lambda: Tendon.constant(x=0.0, y=0.0, axial_stiffness=0.0), "axial_stiffness = 0.0: must be > 0"),
        (lambda: Tendon.constant(x=0.0, y=0.0, free_length=-0.1), "free_length = -0.1: must be >= 0"),
        (
            lambda: Tendon.constant(x=0.0, y=0.0, wall="free"),
            'wall = \'free\': must be "held" where routing = "constant',
        ),
        (lambda: Tendon.opposite_backbone(radius=1e-4, wall=True), "wall = True: must be one of held, free"),
    ],
)
def test_bad_tendons_are_refused_by_field(make, message):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert str(caught.value).startswith(message)


def test_a_helix_of_the_whole_body_turns_as_often_as_said():
    robot = rod(Tendon.helical(offset=1e-3, angle=0.0, turns=3.0))
    assert robot.tendon_table[0, 14] * robot.length_na == pytest.approx(6.0 * pi)
