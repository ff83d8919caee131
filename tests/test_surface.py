"""Surfaces: slopes against differences, the same wherever the world lies, grids against the shapes they sample."""

from types import SimpleNamespace

import numpy as np
import pytest

from tendonrod import InvalidInput
from tendonrod.rotation import exp_so3
from tendonrod.surface import Cavity, Cylinder, DistanceGrid, Plane, Sphere, Surface, Tube, Walls, as_surface

RNG = np.random.default_rng(11)
POINTS = RNG.uniform(-0.02, 0.02, (60, 3))
POINT, AXIS = (0.03, -0.01, 0.004), (1.0, -2.0, 3.0)
PLANE = Plane(point=POINT, normal=AXIS)
ROUND = {
    "tube": Tube(point=POINT, axis=AXIS, radius=0.04),
    "cylinder": Cylinder(point=POINT, axis=AXIS, radius=0.005),
    "sphere": Sphere(center=POINT, radius=0.008),
    "cavity": Cavity(center=POINT, radius=0.05),
}
FLOOR, BALL = Plane(point=(0, 0, -0.015), normal=(0, 0, 1)), Sphere(center=(0.01, 0.01, 0.01), radius=0.004)
WALLS = Walls(surfaces=[FLOOR, ROUND["tube"], BALL])
SHAPES = {"plane": PLANE, **ROUND, "walls": WALLS}
each_shape = pytest.mark.parametrize("surface", SHAPES.values(), ids=SHAPES.keys())
each_round = pytest.mark.parametrize("surface", ROUND.values(), ids=ROUND.keys())


def sampled(surface: Surface, nodes: int = 41, half: float = 0.025) -> DistanceGrid:
    """``surface`` on a grid of unequal spacing around the origin."""
    axes = [np.linspace(-half, half, nodes + i) for i in range(3)]
    at = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = surface.distance(at.reshape(-1, 3))[0].reshape(at.shape[:3])
    return DistanceGrid(origin=at[0, 0, 0], spacing=[axis[1] - axis[0] for axis in axes], values=values)


def slopes(function, points: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Central differences of ``function`` along x, y, z, on the last axis."""
    shifts = step * np.eye(3)
    return np.stack([(function(points + h) - function(points - h)) / (2 * step) for h in shifts], axis=-1)


@each_shape
def test_gradient_is_the_slope_of_the_distance_and_of_unit_length(surface):
    d, gradient = surface.distance(POINTS)
    assert d.shape == (60,)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(gradient, slopes(lambda p: surface.distance(p)[0], POINTS), rtol=0, atol=1e-7)


@each_shape
def test_curvature_is_the_slope_of_the_gradient(surface):
    H = surface.curvature(POINTS)
    np.testing.assert_allclose(H, slopes(lambda p: surface.distance(p)[1], POINTS), rtol=0, atol=1e-4)
    np.testing.assert_allclose(Surface.curvature(surface, POINTS), H, rtol=0, atol=1e-4)


def test_grid_is_twice_differentiable_and_its_slopes_are_its_own():
    grid = sampled(ROUND["tube"])
    nodes = grid.origin + grid.spacing * np.array([[3, 5, 8], [20, 1, 30], [0, 0, 0], [40, 41, 42]])
    d, gradient = grid.distance(POINTS)
    np.testing.assert_allclose(gradient, slopes(lambda p: grid.distance(p)[0], POINTS), rtol=0, atol=1e-8)
    np.testing.assert_allclose(grid.curvature(POINTS), slopes(lambda p: grid.distance(p)[1], POINTS), rtol=0, atol=1e-4)
    assert d.shape == (60,)
    np.testing.assert_allclose(grid.distance(nodes)[0], ROUND["tube"].distance(nodes)[0], rtol=0, atol=1e-15)
    step = 1e-10
    jump = grid.curvature(nodes[:2] + step) - grid.curvature(nodes[:2] - step)
    assert np.abs(jump).max() < 1e-3 * np.abs(grid.curvature(nodes[:2])).max()


@pytest.mark.parametrize("name", ["plane", "tube", "cylinder", "sphere", "cavity"])
def test_grid_comes_back_to_the_shape_at_fourth_order(name):
    surface, half = SHAPES[name], 0.008  # m, away from the round shapes' own centres
    points = RNG.uniform(-half, half, (400, 3))
    errors = []
    for nodes in (12, 24):
        grid = sampled(surface, nodes=nodes, half=half)
        wrong = [a - b for a, b in zip(grid.distance(points), surface.distance(points), strict=True)]
        errors.append([np.abs(each).max() for each in wrong])
    (d_coarse, g_coarse), (d_fine, g_fine) = errors
    assert d_fine < 1e-7
    assert g_fine < 1e-4
    if name != "plane":
        assert d_coarse / d_fine > 10.0
        assert g_coarse / g_fine > 5.0
    else:
        assert d_fine < 1e-16
        assert g_fine < 1e-12


def test_grid_reproduces_cubic_polynomials_up_to_its_border():
    axes = [np.linspace(-1.0, 1.0, n) for n in (4, 5, 9)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    grid = DistanceGrid(origin=(-1, -1, -1), spacing=(2 / 3, 0.5, 0.25), values=0.1 * x**3 + x * y**2 * z**3 - 0.3 * y)
    points = np.concatenate([RNG.uniform(-1, 1, (50, 3)), [[-1, -1, -1], [1, 1, 1], [1, -1, 0.3]]])
    x, y, z = points.T
    d, gradient = grid.distance(points)
    np.testing.assert_allclose(d, 0.1 * x**3 + x * y**2 * z**3 - 0.3 * y, rtol=0, atol=1e-14)
    expected = [0.3 * x**2 + y**2 * z**3, 2 * x * y * z**3 - 0.3, 3 * x * y**2 * z**2]
    np.testing.assert_allclose(gradient, np.stack(expected, axis=1), rtol=0, atol=1e-13)
    bend = [0.6 * x, 2 * x * z**3, 6 * x * y**2 * z, 2 * y * z**3, 3 * y**2 * z**2, 6 * x * y * z**2]
    H = grid.curvature(points)
    np.testing.assert_allclose(H[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], np.stack(bend, axis=1), rtol=0, atol=1e-12)


def test_distances_known_by_hand():
    at = [[0.0, 3.0, 7.0]]
    axis = {"point": (0, 0, 5), "axis": (0, 0, -2)}
    known = [
        (Plane(point=(0, 1, 0), normal=(0, 5, 0)), 2.0, (0, 1, 0)),
        (Tube(**axis, radius=4.0), 1.0, (0, -1, 0)),
        (Cylinder(**axis, radius=1.0), 2.0, (0, 1, 0)),
        (Sphere(center=(0, 3, 3), radius=1.0), 3.0, (0, 0, 1)),
        (Cavity(center=(0, 3, 3), radius=9.0), 5.0, (0, 0, -1)),
    ]
    for surface, distance, gradient in known:
        d, g = surface.distance(at)
        np.testing.assert_allclose(d, [distance], rtol=1e-15)
        np.testing.assert_allclose(g, [gradient], rtol=0, atol=1e-15)


def test_distance_turns_and_moves_with_the_world():
    R, shift = exp_so3([0.4, -1.1, 0.7]), np.array([0.1, -0.2, 0.05])
    moved_point, moved_axis = R @ POINT + shift, R @ AXIS
    moved = {
        "plane": Plane(point=moved_point, normal=moved_axis),
        "tube": Tube(point=moved_point, axis=moved_axis, radius=0.04),
        "sphere": Sphere(center=moved_point, radius=0.008),
    }
    for name, surface in moved.items():
        there, here = surface.distance(POINTS @ R.T + shift), SHAPES[name].distance(POINTS)
        np.testing.assert_allclose(there[0], here[0], rtol=0, atol=1e-14)
        np.testing.assert_allclose(there[1], here[1] @ R.T, rtol=0, atol=1e-12)
        H = SHAPES[name].curvature(POINTS)
        np.testing.assert_allclose(surface.curvature(POINTS @ R.T + shift), R @ H @ R.T, rtol=0, atol=1e-9)


def test_length_of_axis_and_place_along_it_do_not_matter():
    other = Tube(point=np.add(POINT, np.multiply(0.3, AXIS)), axis=np.multiply(-7.0, AXIS), radius=0.04)
    for a, b in zip(other.distance(POINTS), ROUND["tube"].distance(POINTS), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


@each_round
def test_axis_and_centre_have_finite_answers(surface):
    at = np.add(POINT, np.outer([0.0, 1e-300, 1e-18], AXIS))
    d, gradient = surface.distance(at)
    np.testing.assert_allclose(np.abs(d), surface.radius, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, rtol=1e-14)
    assert np.all(np.isfinite(surface.curvature(at)))


def test_walls_take_the_nearest():
    parts = [each.distance(POINTS) for each in WALLS.surfaces]
    d, gradient = WALLS.distance(POINTS)
    np.testing.assert_array_equal(d, np.min([part[0] for part in parts], axis=0))
    for each, (distance, slope) in zip(WALLS.surfaces, parts, strict=True):
        mine = distance == d
        assert mine.any()
        np.testing.assert_array_equal(gradient[mine], slope[mine])
        np.testing.assert_array_equal(WALLS.curvature(POINTS)[mine], each.curvature(POINTS)[mine])


def test_no_points_give_no_distances():
    for surface in (*SHAPES.values(), sampled(PLANE, nodes=5)):
        d, gradient = surface.distance(np.empty((0, 3)))
        assert d.shape == (0,)
        assert gradient.shape == (0, 3)
        assert surface.curvature(np.empty((0, 3))).shape == (0, 3, 3)


def test_arrays_are_the_surface_s_own_and_read_only():
    point = np.zeros(3)
    plane = Plane(point=point, normal=(0, 0, 1))
    point[2] = 1.0
    assert plane.distance([[0, 0, 3]])[0] == 3.0
    with pytest.raises(ValueError, match="read-only"):
        plane.normal[0] = 1.0
    with pytest.raises(AttributeError):
        plane.point = point  # pyright: ignore[reportAttributeAccessIssue]


def answering(d, gradient, **more) -> SimpleNamespace:
    return SimpleNamespace(distance=lambda points: (d(points), gradient(points)), **more)


def upward(points) -> np.ndarray:
    return np.tile([0.0, 0.0, 1.0], (len(points), 1))


def test_surface_of_the_callers_own_is_completed_and_checked_at_every_answer():
    own = as_surface(answering(lambda p: p[:, 2], upward))
    np.testing.assert_array_equal(own.distance(POINTS)[0], POINTS[:, 2])
    np.testing.assert_array_equal(own.curvature(POINTS), np.zeros((60, 3, 3)))
    assert as_surface(PLANE) is PLANE
    ball = ROUND["sphere"]
    own = as_surface(SimpleNamespace(distance=ball.distance))
    np.testing.assert_allclose(own.curvature(POINTS), ball.curvature(POINTS), rtol=0, atol=1e-5)
    later = as_surface(answering(lambda p: np.where(p[:, 2] > 0.01, np.nan, p[:, 2]), upward))
    with pytest.raises(InvalidInput, match="finite numbers of shape"):
        later.distance(POINTS)
    wrong = as_surface(answering(lambda p: p[:, 2], upward, curvature=lambda p: np.zeros(3)))
    with pytest.raises(InvalidInput, match=r"curvature\(points\)"):
        wrong.curvature(POINTS)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (None, "a method distance"),
        (3.0, "a method distance"),
        (Plane, "a method distance"),
        (SimpleNamespace(distance=1.0), "a method distance"),
        (SimpleNamespace(distance=lambda points: points[:, 2]), "a pair"),
        (answering(lambda p: p[:, 2:], upward), r"finite numbers of shape \(2,\)"),
        (answering(lambda p: p[0, 2], upward), r"finite numbers of shape \(2,\)"),
        (answering(lambda p: p[:, 2], lambda p: np.ones(3)), r"finite numbers of shape \(2, 3\)"),
        (answering(lambda p: p[:, 2] + np.nan, upward), r"finite numbers"),
        (answering(lambda p: ["far", "near"], upward), r"finite numbers"),
        (answering(lambda p: p[:, 2], lambda p: 1e3 * upward(p)), "unit length"),
    ],
)
def test_what_is_no_surface_is_refused(value, message):
    with pytest.raises(InvalidInput, match=message):
        as_surface(value)
    with pytest.raises(InvalidInput, match=r"surfaces\[1\]"):
        Walls(surfaces=[PLANE, value])


GRID = {"origin": (0, 0, 0), "spacing": 1.0, "values": np.zeros((4, 4, 4))}


@pytest.mark.parametrize(
    ("kind", "arguments", "field"),
    [
        (Plane, {"point": (0, 0), "normal": (0, 0, 1)}, "point"),
        (Plane, {"point": (0, 0, 0), "normal": (0, 0, 0)}, "normal"),
        (Tube, {"point": (0, 0, 0), "axis": (0, 0, np.nan), "radius": 1.0}, "axis"),
        (Tube, {"point": (0, 0, 0), "axis": (0, 0, 1), "radius": 0.0}, "radius"),
        (Sphere, {"center": "here", "radius": 1.0}, "center"),
        (Cavity, {"center": (0, 0, 0), "radius": -1.0}, "radius"),
        (Walls, {"surfaces": ()}, "surfaces"),
        (Walls, {"surfaces": PLANE}, "surfaces"),
        (DistanceGrid, GRID | {"origin": (0, 0)}, "origin"),
        (DistanceGrid, GRID | {"spacing": 0.0}, "spacing"),
        (DistanceGrid, GRID | {"spacing": (1, 1)}, "spacing"),
        (DistanceGrid, GRID | {"spacing": (1, 1, -1)}, "spacing"),
        (DistanceGrid, GRID | {"values": np.zeros((4, 4))}, "values"),
        (DistanceGrid, GRID | {"values": np.zeros((4, 4, 3))}, "values"),
        (DistanceGrid, GRID | {"values": np.full((4, 4, 4), np.nan)}, "values"),
        (DistanceGrid, GRID | {"values": 1e3 * np.indices((4, 4, 4))[0]}, "values"),
    ],
)
def test_bad_input_is_refused_by_name(kind, arguments, field):
    with pytest.raises(InvalidInput) as refused:
        kind(**arguments)
    assert refused.value.field.startswith(field)


@pytest.mark.parametrize("outside", [(0.026, 0, 0), (0, 0, -0.1), (np.nan, 0, 0)])
def test_point_outside_the_grid_is_refused_with_the_grid_s_limits(outside):
    points = [(0, 0, 0), outside]
    with pytest.raises(InvalidInput, match=r"points\[1\].*x from -0.025 to 0.025") as refused:
        sampled(PLANE, nodes=5).distance(points)
    assert refused.value.field == "points[1]"
