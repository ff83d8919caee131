"""The bifurcation diagram: it shows the branch that was computed, in words, units and values, and writes files."""

import numpy as np
import pytest

from fold_oracles import EULER
from tendonrod import InvalidInput, PlainRod, Robot, load_robot, solve
from tendonrod.loads import PointLoad
from tendonrod.plot import save
from tendonrod.plot.branches import branch_figure, curve, parameter_label, stretches
from tendonrod.statics.branches import follow_branch
from tendonrod.statics.limits import euler_loads


@pytest.fixture(scope="module")
def snapping():
    """A buckled strip whose push turns: two folds."""
    body = PlainRod(
        length=1.0, area=1.0, ix=1e-9, iy=1e-12, j=2e-9, youngs_modulus=1e12, shear_modulus=1e12, density=0.0
    )
    robot, load = Robot(name="strip", body=body), 2.0 * EULER
    aside = solve(robot, tip_force=(1e-3 * load, 0.0, -load))
    start = solve(robot, tip_force=(0.0, 0.0, -load), start=aside)
    return follow_branch(start, lambda a: {"tip_force": (-load * np.sin(a), 0.0, -load * np.cos(a))}, (-0.8, 0.8))


@pytest.fixture(scope="module")
def column():
    """A straight column: bifurcations only."""
    body = PlainRod(length=0.3, radius=5e-4, youngs_modulus=75e9, shear_modulus=25e9, density=0.0)
    robot = Robot(name="rod", body=body)
    return follow_branch(solve(robot), "tip_force[2]", -12.0 * euler_loads(robot)[0])


def texts(figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_folds_are_marked_with_their_values(snapping):
    figure = branch_figure(snapping, label="angle (deg)", factor=180.0 / np.pi)
    assert "31.225 deg" in texts(figure)
    assert "\N{MINUS SIGN}31.225 deg" in texts(figure)
    diagram, bodies = figure.axes
    assert diagram.get_xlabel() == "angle (deg)"
    assert diagram.get_ylabel() == "x of the tip (mm)"
    assert {bodies.get_xlabel(), bodies.get_ylabel()} == {"z (mm)", "x (mm)"}
    words = [each.get_text() for each in figure.legends[0].get_texts()]
    assert words == ["stable", "unstable", "start", "fold"]


def test_the_texts_stay_inside_the_panel(snapping, column):
    for figure in (branch_figure(snapping, label="angle (deg)", factor=180.0 / np.pi), branch_figure(column)):
        figure.draw_without_rendering()
        axes = figure.axes[0]
        box = axes.get_window_extent()
        for text in axes.texts:
            if text.get_text():
                extent = text.get_window_extent()
                assert box.x0 <= extent.x0 < extent.x1 <= box.x1


def test_what_is_unstable_is_dashed(snapping):
    diagram = branch_figure(snapping).axes[0]
    kinds = [stable for _, stable in stretches(snapping)]
    assert kinds == [True, False, True]
    dashed = [line.is_dashed() for line in diagram.lines[:3]]
    assert dashed == [False, True, False]


def test_the_line_runs_through_all_points_and_turns_at_the_folds(snapping):
    t, height = curve(snapping, "x")
    np.testing.assert_array_equal(t[:, 0], snapping.parameter[:-1])
    np.testing.assert_allclose(height[:, -1], snapping.tip[1:, 0], rtol=1e-14, atol=1e-14)
    fold = snapping.folds[0].parameter
    assert t[: snapping.folds[1].index].max() == pytest.approx(fold, abs=1e-6)


def test_bifurcations_of_a_straight_column(column):
    figure = branch_figure(column)
    assert sum(" N" in text for text in texts(figure)) == 2
    assert figure.axes[0].get_xlabel() == "tip force $F_z$ (N)"
    assert "distance" in figure.axes[0].get_ylabel()


def test_without_a_potential_nothing_is_said_of_stability(tmp_path):
    robot = load_robot("exonav-1")
    follower = PointLoad(force=(1e-3, 0.0, 0.0), frame="body")
    branch = follow_branch(solve(robot, 0.4, loads=[follower]), "tensions[0]", 0.6)
    figure = branch_figure(branch, tip="deflection")
    assert [each.get_text() for each in figure.legends[0].get_texts()] == ["equilibria", "start"]
    assert figure.axes[0].get_xlabel() == "tension of tendon 1 (N)"
    assert save(figure, tmp_path / "branch.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("name", "label", "factor"),
    [
        ("insertion", "insertion η (-)", 1.0),
        ("displacements[1]", "pulled length of tendon 2 (mm)", 1e3),
        ("gravity[0]", "gravity $g_x$ (m/s²)", 1.0),
        ("youngs_modulus", "youngs_modulus (SI)", 1.0),
        ("loads[0].force[1]", "loads[0].force[1] (SI)", 1.0),
        ("t", "parameter t (-)", 1.0),
    ],
)
def test_parameters_have_names_and_units(name, label, factor):
    assert parameter_label(name) == (label, factor)


def test_bad_input_is_named(column):
    with pytest.raises(InvalidInput, match="branch"):
        branch_figure(1.0)
    with pytest.raises(InvalidInput, match="tip"):
        branch_figure(column, tip="w")
