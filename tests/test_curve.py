"""Curves: exact where they can be, closest points against brute force, the same wherever the world has its origin."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tendonrod import InvalidInput, solve
from tendonrod.curve import Curve
from tendonrod.rotation import exp_so3
from textbook import farthest, prototype

RADIUS, RISE = 0.02, 0.01  # m; rise per radian
SPEED = float(np.hypot(RADIUS, RISE))
RNG = np.random.default_rng(5)
small = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


def helix_at(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and unit tangents of a helix at arc lengths ``s``."""
    angle = np.asarray(s) / SPEED
    points = np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), RISE * angle], axis=-1)
    slopes = np.stack([-RADIUS * np.sin(angle), RADIUS * np.cos(angle), RISE + 0 * angle], axis=-1) / SPEED
    return points, slopes


def helix(intervals: int, length: float = 0.1) -> Curve:
    s = np.linspace(0.0, length, intervals + 1)
    points, slopes = helix_at(s)
    return Curve(s=s, points=points, slopes=slopes)


def brute_force(curve: Curve, points: np.ndarray, samples: int = 200_001) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and distances of the nearest of many samples; the distance is too large by at most 0.01 um for points
    1 mm away."""
    from scipy.spatial import KDTree

    s = np.linspace(curve.s[0], curve.s[-1], samples)
    distance, nearest = KDTree(curve.at(s)).query(points)
    return s[nearest], distance


def scattered(curve: Curve, n: int, spread: float) -> np.ndarray:
    return curve.at(RNG.uniform(curve.s[0], curve.s[-1], n)) + RNG.uniform(-spread, spread, (n, 3))


@pytest.mark.parametrize("spread", [1e-6, 1e-3, 8e-3])
def test_closest_points_are_those_of_a_search_by_brute_force(spread):
    curve = helix(60)
    points = scattered(curve, 300, spread)
    near = curve.project(points)
    s, distance = brute_force(curve, points)
    assert np.all(near.distance <= distance + 1e-15)
    np.testing.assert_allclose(near.distance, distance, rtol=0, atol=3e-7)
    np.testing.assert_allclose(near.s, s, rtol=0, atol=2e-6)


def test_offset_is_perpendicular_to_the_curve_at_an_inner_foot():
    curve, arm = helix(60), 1e-6
    points = scattered(curve, 300, 3e-3)
    near = curve.project(points)
    inside = (near.s > 1e-3) & (near.s < curve.s[-1] - 1e-3)
    tangent = (curve.at(near.s + arm) - curve.at(near.s - arm)) / (2 * arm)
    along = np.einsum("nj,nj->n", points - near.point, tangent)
    assert inside.sum() > 200
    assert np.abs(along[inside]).max() < 1e-11
    np.testing.assert_array_equal(near.point, curve.at(near.s))
    np.testing.assert_array_equal(near.distance, np.linalg.norm(points - near.point, axis=1))


def test_on_the_curve_the_distance_is_zero_and_the_foot_is_the_point():
    curve = helix(40)
    s = np.linspace(curve.s[0], curve.s[-1], 333)
    near = curve.project(curve.at(s))
    assert near.distance.max() < 1e-16
    np.testing.assert_allclose(near.s, s, rtol=0, atol=1e-15)


@pytest.mark.parametrize("beyond", [1e-9, 1e-3, 1.0])
def test_a_foot_beyond_an_end_is_the_end(beyond):
    curve = helix(40)
    ends, tangents = curve.points[[0, -1]], curve.slopes[[0, -1]]
    near = curve.project(ends + beyond * np.array([[-1.0], [1.0]]) * tangents)
    np.testing.assert_array_equal(near.s, curve.s[[0, -1]])
    np.testing.assert_array_equal(near.point, ends)
    np.testing.assert_allclose(near.distance, beyond, rtol=1e-6)


def test_a_guess_gives_the_same_foot():
    curve = helix(60)
    points = scattered(curve, 200, 1e-3)
    cold = curve.project(points)
    warm = curve.project(points, guess=cold.s + RNG.uniform(-5e-4, 5e-4, 200))
    np.testing.assert_allclose(warm.s, cold.s, rtol=0, atol=1e-14)


@given(st.floats(0.0, 0.1), small, st.floats(0.0, 5e-3))
def test_never_farther_than_the_nearest_node(s, direction, distance):
    curve = helix(25)
    point = curve.at(s) + distance * direction
    assert curve.project(point).distance[0] <= np.linalg.norm(curve.points - point, axis=1).min() + 1e-16


def test_cubics_are_exact():
    coefficients = RNG.normal(size=(4, 3))
    powers = np.arange(4)

    def cubic(t, degree=0):
        factors = np.array([1.0, 1.0, 1.0, 1.0]) if degree == 0 else powers
        return (factors * np.asarray(t)[:, None] ** np.clip(powers - degree, 0, None)) @ coefficients

    nodes = np.array([-1.0, -0.3, 0.4, 2.0])
    curve = Curve(s=nodes, points=cubic(nodes), slopes=cubic(nodes, 1))
    t = np.linspace(-1.0, 2.0, 31)
    np.testing.assert_allclose(curve.at(t), cubic(t), rtol=0, atol=1e-13)


def test_error_falls_with_the_fourth_power_and_stays_below_its_bound():
    s = np.linspace(0.0, 0.1, 4001)
    exact, steps = helix_at(s)[0], (10, 20, 40, 80)
    errors = np.array([farthest(helix(n).at(s), exact) for n in steps])
    fourth_derivative = RADIUS / SPEED**4
    bounds = np.array([(0.1 / n) ** 4 * fourth_derivative / 384 for n in steps])
    assert np.all(errors <= bounds * (1 + 1e-6))
    assert np.all(errors >= 0.9 * bounds)
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 4.0, atol=0.06)


def test_a_robot_in_200_intervals_is_a_curve_to_a_tenth_of_a_nanometre():
    robot = prototype(1)
    fine = solve(robot, 0.7, s=np.linspace(0.0, robot.length_na, 1001), accuracy=1e-10)
    slopes = np.einsum("nij,nj->ni", fine.rotation, fine.v)
    curve = Curve(s=fine.s[::5], points=fine.position[::5], slopes=slopes[::5])
    assert farthest(curve.at(fine.s), fine.position) < 1e-10


@settings(max_examples=40)
@given(small, small, st.floats(-3.0, 3.0), small)
def test_moving_everything_moves_the_foot(turn, shift, start, offset):
    curve = helix(30)
    points = curve.points[::3] + 2e-3 * offset
    R = exp_so3(3.0 * turn)
    moved = Curve(s=curve.s + start, points=curve.points @ R.T + shift, slopes=curve.slopes @ R.T)
    before, after = curve.project(points), moved.project(points @ R.T + shift)
    np.testing.assert_allclose(after.distance, before.distance, rtol=0, atol=1e-14)
    np.testing.assert_allclose(after.s - start, before.s, rtol=0, atol=1e-8)  # the foot is flat in s: rounding's root
    np.testing.assert_allclose(after.point, before.point @ R.T + shift, rtol=0, atol=1e-8)


def test_parameters_of_any_shape():
    curve = helix(10)
    s = np.linspace(0.0, 0.1, 6)
    assert curve.at(0.05).shape == (3,)
    np.testing.assert_array_equal(curve.at(s.reshape(2, 3)), curve.at(s).reshape(2, 3, 3))
    assert curve.project([0.0, 0.0, 0.0]).s.shape == (1,)


def test_arrays_are_copies_and_read_only():
    s, (points, slopes) = np.array([0.0, 0.1]), helix_at(np.array([0.0, 0.1]))
    curve = Curve(s=s, points=points, slopes=slopes)
    s[0] = points[0, 0] = 7.0
    assert curve.s[0] == 0.0
    assert curve.points[0, 0] == RADIUS
    for array in (curve.s, curve.points, curve.slopes):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


NAN, INF = float("nan"), float("inf")
GOOD = {"s": [0.0, 1.0], "points": [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], "slopes": [[0.0, 0.0, 1.0]] * 2}
BAD = [
    ("s", [0.0]),
    ("s", [1.0, 0.0]),
    ("s", [0.0, 0.0]),
    ("s", [0.0, NAN]),
    ("s", [0.0, INF]),
    ("s", [[0.0, 1.0]]),
    ("points", [[0.0, 0.0, 0.0]]),
    ("points", [[0.0, 0.0], [0.0, 1.0]]),
    ("points", [[0.0, 0.0, 0.0], [0.0, NAN, 1.0]]),
    ("slopes", [[0.0, 0.0, 1.0]] * 3),
    ("slopes", [[0.0, 0.0, INF]] * 2),
]


@pytest.mark.parametrize(("field", "value"), BAD, ids=[f"{field}-{value}" for field, value in BAD])
def test_bad_input_is_named(field, value):
    with pytest.raises(InvalidInput) as caught:
        Curve(**{**GOOD, field: value})
    assert caught.value.field == field
    assert "\n" not in str(caught.value)
