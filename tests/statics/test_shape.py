"""The result: its frames, its empty case, warm starts, warnings, and how it fails."""

import numpy as np
import pytest

from tendonrod import NotConverged, Shape, solve
from textbook import GRAVITY, about_z, farthest, four_tendon_rod, helix_rod, prototype, rod

FIELDS = {"s": (), "position": (3,), "centerline": (3,), "rotation": (3, 3), "v": (3,), "u": (3,), "force": (3,),
          "moment": (3,)}  # fmt: skip
LIFT_OFF = [(0.0671, 0.0666), (0.1325, 0.1310), (0.3641, 0.3315), (1.749, 1.376)]  # physics.md section 4, N
PLATEAU = [1.09, 1.75, 1.51, 4.34]  # published torsion, N
CRUSHING = {"tip_force": (1e5, 0.0, -1e6)}


@pytest.mark.parametrize("s", [None, np.linspace(0.0, 0.07, 5)], ids=["nodes", "samples"])
def test_arrays_have_their_shape_and_are_read_only(s):
    shape = solve(prototype(1), 0.7, gravity=GRAVITY, s=s)
    assert isinstance(shape, Shape)
    for name, tail in FIELDS.items():
        array = getattr(shape, name)
        assert array.shape == (len(shape.s), *tail)
        assert np.isfinite(array).all()
        assert not array.flags.writeable
    assert shape.tip.shape == (3,)
    assert shape.converged
    assert str(shape.status)
    assert 0.0 <= shape.residual < 1e-6


def test_nodes_run_from_exit_to_tip():
    robot = prototype(1)
    shape = solve(robot, 0.7, gravity=GRAVITY, insertion=0.4)
    assert shape.s[0] == 0.0
    assert shape.s[-1] == pytest.approx(0.4 * robot.section.L_na, rel=1e-14)
    assert np.all(np.diff(shape.s) > 0.0)
    assert np.array_equal(shape.position[-1], shape.tip)


def test_base_is_clamped_at_the_outer_tubes_exit():
    robot, angle = prototype(3), 0.9
    shape = solve(robot, 0.7, gravity=GRAVITY, rotation=angle, insertion=0.5)
    np.testing.assert_allclose(shape.position[0], about_z(angle) @ [-robot.section.r_na, 0, 0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(shape.rotation[0], about_z(angle), rtol=0, atol=1e-15)


def test_centerline_and_tendon_lie_in_the_section():
    """c = p + R [r_na, 0, 0]; tendon = p + R r."""
    robot = prototype(2)
    shape = solve(robot, 0.7, gravity=GRAVITY)
    x = shape.rotation[:, :, 0]
    np.testing.assert_allclose(shape.centerline, shape.position + robot.section.r_na * x, rtol=0, atol=1e-15)
    np.testing.assert_allclose(shape.tendon_path(0), shape.position + robot.routing[0, 0] * x, rtol=0, atol=1e-15)


def test_helical_tendon_path_follows_the_material():
    robot, insertion = four_tendon_rod(1.0), 0.6
    shape = solve(robot, (15.0, 0.0, 0.0, 0.0), insertion=insertion)
    _, _, rho, angle, omega, _ = robot.routing[1]
    phase = angle + omega * (shape.s + (1.0 - insertion) * 0.5)
    r = rho * np.stack([np.cos(phase), np.sin(phase), 0.0 * phase], axis=-1)
    expected = shape.position + np.einsum("nij,nj->ni", shape.rotation, r)
    np.testing.assert_allclose(shape.tendon_path(1), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("loads", [{}, {"gravity": GRAVITY, "tip_force": (1.0, 2.0, 3.0)}], ids=["free", "loaded"])
def test_nothing_inserted_is_a_valid_shape_without_length(loads):
    robot = prototype(1)
    shape = solve(robot, 0.7, insertion=0.0, rotation=0.5, **loads)
    base = about_z(0.5) @ [-robot.section.r_na, 0.0, 0.0]
    assert shape.converged
    assert np.array_equal(shape.s, np.zeros_like(shape.s))
    assert farthest(shape.position, base) < 1e-15
    assert farthest(shape.tip, base) < 1e-15
    assert np.isfinite(shape.centerline).all()


def test_the_shape_shrinks_continuously_to_nothing():
    robot = prototype(1)
    for insertion in (1e-2, 1e-4, 1e-6, 1e-9):
        shape = solve(robot, 0.7, gravity=GRAVITY, insertion=insertion)
        assert shape.converged
        assert farthest(shape.tip, shape.position[0]) <= 1.001 * insertion * robot.section.L_na


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({"tensions": 0.7}, {"tensions": 0.714}),
        ({"tensions": 0.7, "insertion": 0.9}, {"tensions": 0.7, "insertion": 0.918}),
        ({"tensions": 0.2}, {"tensions": 1.4, "tip_force": (1e-3, -1e-3, 0.0)}),
        ({"tensions": 0.7, "insertion": 0.0}, {"tensions": 0.7, "insertion": 0.05}),
        ({"tensions": 0.7, "insertion": 0.05}, {"tensions": 0.7, "insertion": 0.0}),
        ({"tensions": 0.7, "rotation": 0.0}, {"tensions": 0.7, "rotation": 2.5}),
        ({"tensions": 0.7, "steps": 4}, {"tensions": 0.7}),
    ],
)
def test_warm_start_gives_the_cold_answer(first, second):
    robot = prototype(1)
    start = solve(robot, gravity=GRAVITY, **first)
    cold = solve(robot, gravity=GRAVITY, accuracy=1e-9, **second)
    warm = solve(robot, gravity=GRAVITY, accuracy=1e-9, **second, start=start, s=cold.s)
    assert farthest(warm.position, cold.position) < 2e-9
    assert warm.converged


def test_warm_start_from_another_robot_gives_the_cold_answer():
    start = solve(helix_rod(), 4.0, tip_force=(0.1, 0.0, 0.0))
    s = np.linspace(0.0, prototype(4).section.L_na, 7)
    cold, warm = (solve(prototype(4), 2.0, gravity=GRAVITY, accuracy=1e-9, s=s, start=x) for x in (None, start))
    assert farthest(warm.position, cold.position) < 2e-9


def test_a_near_start_takes_fewer_iterations():
    start = solve(prototype(1), 0.7, gravity=GRAVITY)
    cold, warm = (solve(prototype(1), 0.714, gravity=GRAVITY, start=x) for x in (None, start))
    assert warm.iterations <= 2 < 5 <= cold.iterations


@pytest.mark.parametrize("number", [1, 2, 3, 4])
@pytest.mark.parametrize("torsion", ["published", "open_section"])
def test_tendon_lift_off_is_told_below_its_threshold_only(number, torsion):
    threshold = LIFT_OFF[number - 1][torsion == "open_section"]
    below, above = (solve(prototype(number, torsion), factor * threshold) for factor in (0.997, 1.003))
    assert any("lift" in str(warning).lower() for warning in below.warnings)
    assert not any("lift" in str(warning).lower() for warning in above.warnings)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_plateau_is_told_above_its_threshold_only(number):
    threshold = PLATEAU[number - 1]
    below, above = (solve(prototype(number), threshold + change) for change in (-0.006, 0.006))
    assert not any("plateau" in str(warning).lower() for warning in below.warnings)
    assert any("plateau" in str(warning).lower() for warning in above.warnings)


def test_notch_closure_is_told():
    """Edges meet at 643 1/m (P1): bent there by a moment about the section's y, seen at the base."""
    robot = prototype(1)
    section = robot.section
    for factor, told in ((0.9, False), (1.1, True)):
        moment = factor * 643.0 * section.Kbt[1]
        shape = solve(robot, 0.0, tip_moment=(0.0, moment, 0.0), insertion=0.01)
        assert any("clos" in str(warning).lower() for warning in shape.warnings) is told


def test_absurd_load_is_refused_with_facts():
    with pytest.raises(NotConverged) as caught:
        solve(prototype(1), 0.7, **CRUSHING)
    error = caught.value
    assert 0.0 <= error.load_factor < 1.0
    assert error.status
    assert error.advice
    assert "\n" not in str(error)


def test_absurd_load_without_throw_is_a_status():
    shape = solve(prototype(1), 0.7, **CRUSHING, throw=False)
    assert not shape.converged
    assert str(shape.status) != str(solve(prototype(1), 0.7).status)


def test_high_tension_and_strong_loads_need_no_help():
    """Cold starts far above 1 N and well past EI/L^2, where plain Newton fails (physics.md section 2)."""
    for tension in (3.0, 8.0, 20.0):
        assert solve(prototype(1), tension, gravity=GRAVITY).converged
    stiff = rod()
    unit = stiff.section.Kbt[0] / 0.2**2
    assert solve(stiff, (), tip_force=(30.0 * unit, 0.0, 0.0)).converged
    assert solve(stiff, (), tip_force=(0.0, 8.0 * unit, 20.0 * unit)).converged
