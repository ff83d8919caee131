"""Signed distance: exact at the nodes, right between them, everywhere of the right sign, kept on disk."""

import numpy as np
import pytest

from anatomy.meshes import HEIGHT, RADIUS, by_brute_force, cylinder, solid_angle
from tendonrod import InvalidInput
from tendonrod.anatomy import distances
from tendonrod.anatomy.distances import distance_grid
from tendonrod.surface import DistanceGrid


def test_long_work_is_told_once_and_what_is_kept_is_not(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("TENDONROD_CACHE", str(tmp_path))
    monkeypatch.setattr(distances, "PATIENCE", 0.0)
    mesh, box = cylinder(), ([-2e-3] * 3, [2e-3] * 3)
    distance_grid(*mesh, *box)
    assert f"computing the distances to a mesh of {len(mesh[1])} triangles" in capsys.readouterr().err
    distance_grid(*mesh, *box)
    assert capsys.readouterr().err == ""


LOW, HIGH = np.array([-8e-3, -8e-3, -4e-3]), np.array([8e-3, 8e-3, 24e-3])


@pytest.fixture(scope="module")
def around_cylinder():
    return distance_grid(*cylinder(), LOW, HIGH)


def scattered(n, seed=0, low=LOW, high=HIGH):
    return np.random.default_rng(seed).uniform(low, high, (n, 3))


def test_nodes_hold_the_distance_that_brute_force_finds(around_cylinder):
    vertices, faces = cylinder()
    grid = around_cylinder
    for i in np.random.default_rng(1).integers(0, grid.values.shape, (12, 3)):
        node = grid.origin + grid.spacing * i
        assert abs(grid.values[tuple(i)]) == pytest.approx(by_brute_force(node, vertices, faces), abs=2e-9)


def test_nodes_are_negative_inside_and_nowhere_else(around_cylinder):
    vertices, faces = cylinder()
    grid = around_cylinder
    for i in np.random.default_rng(2).integers(0, grid.values.shape, (300, 3)):
        inside = solid_angle(grid.origin + grid.spacing * i, vertices, faces) > 0.5
        assert (grid.values[tuple(i)] < 0.0) == inside


def test_between_nodes_it_is_the_distance_of_the_round_cylinder(around_cylinder):
    """Beside the mantle, away from edges and axis: the polygon of 96 sides differs by 1 - cos(pi / 96)."""
    p = scattered(2000, low=(-8e-3, -8e-3, 6e-3), high=(8e-3, 8e-3, 14e-3))
    rho = np.hypot(p[:, 0], p[:, 1])
    p, rho = p[rho > 2.5e-3], rho[rho > 2.5e-3]
    d, gradient = around_cylinder.distance(p)
    sagitta = RADIUS * (1.0 - np.cos(np.pi / 96))
    assert np.abs(d - (rho - RADIUS)).max() < 1.5 * sagitta
    outward = np.column_stack([p[:, :2] / rho[:, None], np.zeros(len(p))])
    assert np.abs(gradient - outward).max() < 0.05
    assert np.abs(np.linalg.norm(gradient, axis=1) - 1.0).max() < 0.02


def test_the_compiled_spline_is_that_of_the_distance_grid(around_cylinder):
    p = scattered(200, seed=3)
    d, gradient = around_cylinder.distance(p)
    d0, gradient0 = DistanceGrid.distance(around_cylinder, p)
    np.testing.assert_allclose(d, d0, atol=1e-15)
    np.testing.assert_allclose(gradient, gradient0, atol=1e-12)
    H, H0 = around_cylinder.curvature(p), DistanceGrid.curvature(around_cylinder, p)
    np.testing.assert_allclose(H, H0, atol=1e-8 * np.abs(H0).max())


def test_gradient_and_hessian_are_the_derivatives(around_cylinder):
    p, h = scattered(50, seed=4), 1e-7
    gradient = around_cylinder.distance(p)[1]
    for k, step in enumerate(h * np.eye(3)):
        ahead, back = around_cylinder.distance(p + step), around_cylinder.distance(p - step)
        np.testing.assert_allclose((ahead[0] - back[0]) / (2 * h), gradient[:, k], atol=1e-6)
        np.testing.assert_allclose((ahead[1] - back[1]) / (2 * h), around_cylinder.curvature(p)[:, k], atol=0.05)


def test_beyond_the_box_it_goes_on_without_a_step(around_cylinder):
    edge, last = scattered(40, seed=5), (np.array(around_cylinder.values.shape) - 1) * around_cylinder.spacing
    for axis, sign in ((0, 1), (1, -1), (2, 1), (2, -1)):
        edge[:, axis] = around_cylinder.origin[axis] + (last[axis] if sign > 0 else 0.0)
        out = edge + 1e-6 * sign * np.eye(3)[axis]
        d, gradient = around_cylinder.distance(edge)
        np.testing.assert_allclose(around_cylinder.distance(out)[0], d + 1e-6 * sign * gradient[:, axis], atol=1e-12)
    far = np.array([[0.1, 0.0, 0.01], [0.0, -0.3, 0.01], [0.0, 0.0, 0.5]])
    assert (around_cylinder.distance(far)[0] > 0.05).all()


def test_points_that_are_no_places_are_refused(around_cylinder):
    with pytest.raises(InvalidInput, match="must be finite"):
        around_cylinder.distance([[0.0, np.nan, 0.0]])


def test_a_lining_is_positive_inside_and_its_caps_are_no_walls():
    vertices, faces = cylinder()
    z = vertices[faces][:, :, 2]
    caps = np.all(z == 0.0, axis=1) | np.all(z == HEIGHT, axis=1)
    low, high = LOW.copy(), HIGH.copy()
    low[2], high[2] = 0.0, HEIGHT
    lining = distance_grid(vertices, faces, low, high, caps=caps)
    p = np.array([[1e-3, 0.5e-3, 0.1e-3], [0.0, 2e-3, 10e-3], [2e-3, 0.0, 25e-3]])
    np.testing.assert_allclose(lining.distance(p)[0], RADIUS - np.hypot(p[:, 0], p[:, 1]), atol=5e-6)


def test_what_is_kept_on_disk_gives_the_same_numbers_and_damage_only_costs_time(tmp_path, monkeypatch):
    monkeypatch.setenv("TENDONROD_CACHE", str(tmp_path))
    mesh, box = cylinder(sides=24, rings=3), (LOW / 2, HIGH / 2)
    first = distance_grid(*mesh, *box)
    (kept,) = tmp_path.iterdir()
    monkeypatch.setattr(distances, "_signed", None)  # a second computation would fail
    assert np.array_equal(distance_grid(*mesh, *box).values, first.values)
    monkeypatch.undo()
    monkeypatch.setenv("TENDONROD_CACHE", str(tmp_path))
    kept.write_bytes(kept.read_bytes()[:1000])
    assert np.array_equal(distance_grid(*mesh, *box).values, first.values)


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("TENDONROD_CACHE", str(tmp_path / "file" / "below"))
    assert distance_grid(*cylinder(sides=24, rings=3), LOW / 2, HIGH / 2).values.min() < 0.0


def test_another_mesh_is_another_file(tmp_path, monkeypatch):
    monkeypatch.setenv("TENDONROD_CACHE", str(tmp_path))
    for radius in (3e-3, 3.001e-3):
        distance_grid(*cylinder(radius, sides=24, rings=3), LOW / 2, HIGH / 2)
    assert len(list(tmp_path.iterdir())) == 2


def test_a_mesh_as_long_as_a_person_is_refused_by_its_nodes():
    with pytest.raises(InvalidInput, match=r"nodes 0.5 mm apart: must be at most 3e\+07"):
        distance_grid(*cylinder(), [-0.2, -0.2, 0.0], [0.2, 0.2, 2.0])
