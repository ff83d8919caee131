"""Tendons driven by their pulled length: against the closed oracle, round trips with tensions, slack, bad input."""

import dataclasses
import itertools

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

import actuation_oracles as act
from tendonrod import InvalidInput, Robot, Tendon, solve
from tendonrod.body import TaperedRod
from tendonrod.loads import DistributedLoad, PointLoad
from textbook import GRAVITY, PROTOTYPES, farthest, prototype, rod

LOADED_AT = 0.05  # m, where strains may jump
ELASTIC = {"axial_stiffness": 589.0, "free_length": 0.3}  # 0.1 mm of nitinol at 75 GPa


def driven(robot: Robot, **more) -> Robot:
    """The same robot, with these properties of all its tendons."""
    return robot.replace(tendons=tuple(dataclasses.replace(each, **more) for each in robot.tendons))


def antagonists(**more) -> Robot:
    return rod(Tendon.constant(x=1.5e-3, y=0.0, **more), Tendon.constant(x=-1.5e-3, y=0.2e-3, **more))


def three_tendons() -> Robot:
    return rod(
        Tendon.helical(offset=2e-3, angle=0.3, turns=0.7, axial_stiffness=800.0, free_length=0.1),
        Tendon.constant(x=-1.5e-3, y=1e-3, free_length=0.2),
        Tendon.helical(offset=1.8e-3, angle=2.0, turns=-0.4, end=0.11, axial_stiffness=300.0),
    )


def path_lengths(robot: Robot, i: int, start: float, end: float, x=None) -> float:
    """Integral of |u x r + r' + v| between two s_m (m), x(s_m) the strains, None for the straight robot."""
    stops = np.unique(np.clip([start, end, LOADED_AT, *robot.breaks, *np.linspace(start, end, 9)], start, end))
    nodes, weights = leggauss(20)
    s = (stops[:-1, None] + np.diff(stops)[:, None] * 0.5 * (nodes + 1)).ravel()
    values = robot.section_values(s)
    v, u = (values[:, 6:9], values[:, 9:12]) if x is None else x(s)
    q = v + np.cross(u, robot.tendon_position(i, s)) + robot.tendon_slope(i, s)
    return float((np.diff(stops)[:, None] * 0.5 * weights).ravel() @ np.linalg.norm(q, axis=1))


def pulled_length(shape, i: int = 0) -> float:
    """d = L* - L + tau (free + L*) / EA by quadrature of the shape's strains; all of a shape without friction."""
    robot, tendon = shape.robot, shape.robot.tendons[i]
    exit_, end = (1.0 - shape.insertion) * robot.length_na, robot.tendon_ends[i]

    def strains(s_m):
        there = shape.at(np.clip(s_m - exit_, 0.0, shape.length))
        return there.v, there.u

    outside, straight = path_lengths(robot, i, 0.0, exit_), path_lengths(robot, i, exit_, end)
    stretch = (
        0.0 if tendon.axial_stiffness is None else (tendon.free_length + outside + straight) / tendon.axial_stiffness
    )
    return straight - path_lengths(robot, i, exit_, end, strains) + shape.tensions[i] * stretch


@pytest.mark.parametrize("number", range(1, len(PROTOTYPES) + 1))
@pytest.mark.parametrize("torsion", ["published", "open_section"])
@pytest.mark.parametrize("elastic", [{}, ELASTIC])
def test_length_gives_the_tension_of_the_oracle(number, torsion, elastic):
    robot = driven(prototype(number, torsion), **elastic)
    oracle = act.rod_of(robot)
    given = elastic.get("axial_stiffness", np.inf), elastic.get("free_length", 0.0)
    for tau in (1e-3, 0.2, 0.7, 1.5):
        shape = solve(robot, displacements=act.displacement(oracle, tau, *given), accuracy=1e-10)
        assert shape.tensions[0] == pytest.approx(tau, rel=1e-8)
        assert farthest(shape.tip, act.tip(oracle, tau)) < 1e-10


def test_compliances_of_the_bench():
    """physics.md, section 5, at 0.7 N: 2.79 mm/N for P1's bending, 0.51 mm/N for 0.3 m of tendon."""
    stiff, h = driven(prototype(1)), 1e-6
    d = act.displacement(act.rod_of(stiff), 0.7)
    more, less = (solve(stiff, displacements=d + each, accuracy=1e-11).tensions[0] for each in (h, -h))
    assert 1e3 * 2 * h / (more - less) == pytest.approx(2.79, abs=5e-3)
    tendon = solve(driven(stiff, axial_stiffness=589.0), displacements=d, accuracy=1e-11).tensions[0]
    longer = driven(stiff, **ELASTIC)
    same = solve(longer, displacements=d + 0.3 * tendon / 589.0, accuracy=1e-11).tensions[0]
    assert same == pytest.approx(tendon, rel=1e-8)
    assert pytest.approx(0.51, abs=5e-3) == 1e3 * 0.3 / 589.0


LOADED = {
    "weight": {"gravity": GRAVITY},
    "tip": {"gravity": GRAVITY, "tip_force": (2e-3, -1e-3, 1e-3), "tip_moment": (1e-5, 0.0, -1e-5)},
    "part": {"gravity": (0.0, 9.81, 0.0), "insertion": 0.45, "rotation": 0.8},
    "follower": {"loads": [PointLoad(force=(2e-3, 1e-3, 0.0), frame="body", at=LOADED_AT)]},
}


@pytest.mark.parametrize("loads", LOADED.values(), ids=LOADED.keys())
@pytest.mark.parametrize("elastic", [{}, ELASTIC])
def test_tension_to_length_and_back(loads, elastic):
    robot = driven(prototype(1), **elastic)
    by_tension = solve(robot, 0.8, **loads, accuracy=1e-9)
    by_length = solve(robot, displacements=pulled_length(by_tension), **loads, accuracy=1e-9)
    assert by_length.tensions[0] == pytest.approx(0.8, abs=2e-7)
    s = np.linspace(0.0, by_tension.length, 20)
    assert farthest(by_length.at(s).position, by_tension.at(s).position) < 4e-9


@pytest.mark.parametrize("given", [(), (1,), (0, 2), (0, 1, 2)])
def test_some_tendons_by_length_and_some_by_tension(given):
    robot, tensions = three_tendons(), np.array([4.0, 6.0, 5.0])
    loads = {"tip_force": (0.1, 0.05, -0.05), "insertion": 0.7, "rotation": 2.0, "gravity": GRAVITY}
    expected = solve(robot, tensions, **loads, accuracy=1e-9)
    lengths = [None if i in given else pulled_length(expected, i) for i in range(3)]
    left = [tau if i in given else 0.0 for i, tau in enumerate(tensions)]
    found = solve(robot, left, displacements=lengths, **loads, accuracy=1e-9)
    np.testing.assert_allclose(found.tensions, tensions, rtol=0, atol=2e-6)
    assert farthest(found.tip, expected.tip) < 4e-9


def test_the_tendon_in_the_outer_tube_stretches_too():
    """Nine tenths of this tendon's path are retracted, where it runs far steeper than at the exit."""
    s = np.linspace(0.0, 0.2, 41)
    x, y = 5e-3 * np.cos(120.0 * s), 5e-3 * np.sin(120.0 * s)
    x[s > 0.1], y[s > 0.1] = x[20], y[20]
    tendon = Tendon.sampled(s, x, y, axial_stiffness=600.0)
    robot = rod(tendon)
    expected = solve(robot, 3.0, insertion=0.3, accuracy=1e-9)
    found = solve(robot, displacements=pulled_length(expected), insertion=0.3, accuracy=1e-9)
    assert found.tensions[0] == pytest.approx(3.0, rel=3e-6)  # what a length of 1e-9 m, the accuracy, amounts to


def test_a_negative_length_is_slack_and_the_elasticity_of_a_given_tension_means_nothing():
    robot = driven(prototype(1), **ELASTIC)
    for d in (-1e-2, -1e-9, 0.0):
        slack = solve(robot, displacements=d)
        assert slack.tensions[0] == 0.0
        assert farthest(slack.tip, solve(robot, 0.0).tip) < 1e-12
    hanging = solve(robot, displacements=-5e-3, gravity=GRAVITY, accuracy=1e-9)
    assert hanging.tensions[0] == 0.0
    assert farthest(hanging.tip, solve(prototype(1), 0.0, gravity=GRAVITY, accuracy=1e-9).tip) < 2e-9
    assert farthest(solve(robot, 0.7, gravity=GRAVITY).tip, solve(prototype(1), 0.7, gravity=GRAVITY).tip) == 0.0


def test_tension_grows_with_the_pulled_length():
    robot = driven(prototype(1), **ELASTIC)
    tau = [solve(robot, displacements=d, gravity=GRAVITY).tensions[0] for d in np.linspace(-1e-3, 6e-3, 15)]
    assert tau[0] == 0.0
    assert (np.diff(tau) >= 0.0).all()
    assert tau[-1] > 1.0


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("elastic", [{}, {"axial_stiffness": 400.0, "free_length": 0.2}])
def test_a_tendon_is_as_long_as_pulled_or_slack(seed, elastic):
    """tau >= 0, d - d(shape) <= 0 and their product 0, whatever the load and the lengths."""
    rng, robot = np.random.default_rng(seed), antagonists(**elastic)
    lengths = 4e-4 * rng.normal(size=2)
    force = (*(0.02 * rng.normal(size=2)), 0.0)
    shape = solve(robot, displacements=lengths, tip_force=force, accuracy=1e-9)
    for i, d in enumerate(lengths):
        gap = d - pulled_length(shape, i)
        assert shape.tensions[i] >= 0.0
        assert gap < 2e-9
        if shape.tensions[i] > 0.0:
            assert abs(gap) < 2e-9


def test_antagonists_pulled_and_paid_out_alike():
    """What one gives the other takes, to first order: pre-tension stays where the offsets are equal."""
    robot = rod(
        Tendon.constant(x=1.5e-3, y=0.0, **ELASTIC),
        Tendon.constant(x=-1.5e-3, y=0.0, **ELASTIC),
    )
    before = solve(robot, displacements=1e-3)
    after = solve(robot, displacements=(1.1e-3, 0.9e-3))
    assert before.tensions[0] == pytest.approx(before.tensions[1], rel=1e-9)
    assert after.tensions.sum() == pytest.approx(before.tensions.sum(), rel=1e-3)
    assert after.tip[0] > 1e-3


@pytest.mark.parametrize("step", [0.2, 1.0])
def test_a_neighbour_to_start_from_changes_nothing(step):
    robot = driven(prototype(1), **ELASTIC)
    near = solve(robot, displacements=1.5e-3, gravity=GRAVITY, accuracy=1e-9)
    d = 1.5e-3 + step * 1e-3
    warm = solve(robot, displacements=d, gravity=GRAVITY, accuracy=1e-9, start=near)
    cold = solve(robot, displacements=d, gravity=GRAVITY, accuracy=1e-9)
    assert farthest(warm.tip, cold.tip) < 4e-9
    assert warm.tensions[0] == pytest.approx(cold.tensions[0], abs=1e-6)


def test_length_drive_of_a_tapered_rod_with_a_sampled_tendon():
    body = TaperedRod(
        length=0.2, base_radius=0.8e-3, tip_radius=0.4e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8e3
    )
    s = np.linspace(0.0, 0.2, 5)
    tendon = Tendon.sampled(s, [-4e-3, -2.8e-3, 0.0, 2e-3, 2.5e-3], [0.0, 2.5e-3, 3.4e-3, 1.8e-3, 0.0], **ELASTIC)
    robot = Robot(name="taper", body=body, tendons=(tendon, Tendon.constant(x=4e-3, y=0.0, end=0.1)))
    loads = {"gravity": GRAVITY, "loads": [DistributedLoad(force=(0.1, 0, 0), force_end=(0, 0.2, 0), start=LOADED_AT)]}
    expected = solve(robot, (5.0, 3.0), **loads, accuracy=1e-9)
    lengths = pulled_length(expected, 0), pulled_length(expected, 1)
    found = solve(robot, displacements=lengths, **loads, accuracy=1e-9)
    np.testing.assert_allclose(found.tensions, (5.0, 3.0), rtol=0, atol=1e-6)
    assert farthest(found.tip, expected.tip) < 5e-9


def test_order_of_convergence_under_length_drive():
    robot = driven(prototype(1), **ELASTIC)
    run = lambda n: solve(robot, displacements=2.2e-3, gravity=GRAVITY, tip_force=(2e-3, 0, 0), accuracy=1e-10, steps=n)  # noqa: E731
    tips = [run(n).tip for n in (8, 16, 32, 64)]
    errors = [farthest(a, b) for a, b in itertools.pairwise(tips)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4.0, abs=0.4)


@pytest.mark.parametrize(
    ("field", "value", "tensions"),
    [
        ("displacements[0]", float("nan"), 0.0),
        ("displacements[0]", float("inf"), 0.0),
        ("displacements[0]", "far", 0.0),
        ("displacements[0]", True, 0.0),
        ("displacements", (), 0.0),
        ("displacements", (1e-3, 1e-3), 0.0),
        ("displacements", [[1e-3]], 0.0),
        ("tensions[0]", 1e-3, 0.7),
        ("tensions[0]", [1e-3], [0.7]),
    ],
)
def test_bad_lengths_are_named(field, value, tensions):
    with pytest.raises(InvalidInput) as caught:
        solve(prototype(1), tensions, displacements=value)
    assert caught.value.field.startswith(field.split("[")[0])
    assert str(caught.value).startswith(field.split("[")[0])
    assert "\n" not in str(caught.value)


def test_a_robot_without_tendons_has_nothing_to_pull():
    with pytest.raises(InvalidInput, match="displacements"):
        solve(rod(), displacements=1e-3)


def test_a_length_with_nothing_exposed_is_elastic_or_refused():
    """Inside the outer tube only the tendon itself gives: tau = d EA / (free length + L*)."""
    robot = driven(prototype(1), **ELASTIC)
    tau = solve(robot, displacements=1e-3, insertion=0.0).tensions[0]
    assert tau == pytest.approx(1e-3 * 589.0 / (0.3 + path_lengths(robot, 0, 0.0, robot.length_na)), rel=1e-6)
