"""Tendons that rub: against the oracle that integrates slip and stick along the rod, hysteresis, limits, history."""

import dataclasses
from functools import cache

import numpy as np
import pytest

import actuation_oracles as act
from tendonrod import InvalidInput, Robot, Tendon, solve
from tendonrod.loads import PointLoad
from textbook import GRAVITY, PROTOTYPES, farthest, four_tendon_rod, prototype, rod

ELASTIC = {"axial_stiffness": 589.0, "free_length": 0.3}
CYCLES = {  # base tensions, one after the other
    "slip back in part": (0.7, 0.62),
    "slip back by little": (0.7, 0.68),
    "slip back as a whole": (0.7, 0.4),
    "three turns": (0.7, 0.62, 0.66),
    "four turns": (0.7, 0.6, 0.66, 0.63),
    "pulled on": (0.5, 0.8),
    "let go": (0.7, 0.0),
}


def rubbing(robot: Robot, mu: float, **more) -> Robot:
    return robot.replace(tendons=tuple(dataclasses.replace(each, friction=mu, **more) for each in robot.tendons))


@cache
def profile(tensions, mu: float, torsion: str = "published", number: int = 1) -> act.Profile:
    *earlier, last = tensions
    before = profile(tuple(earlier), mu, torsion, number) if earlier else None
    return act.rubbed(act.rod_of(prototype(number, torsion)), last, mu, before)


def along(robot: Robot, tensions, accuracy=1e-9, **more):
    """The shape after these base tensions in a row."""
    shape = None
    for tau in tensions:
        shape = solve(robot, tau, history=shape, accuracy=accuracy, **more)
    return shape


@pytest.mark.parametrize("mu", [0.05, 0.1, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("torsion", ["published", "open_section"])
def test_first_pull(mu, torsion):
    robot, oracle = rubbing(prototype(1, torsion), mu), profile((0.7,), mu, torsion)
    shape = solve(robot, 0.7, accuracy=1e-9)
    assert farthest(shape.tip, oracle.tip) < 1e-9
    s = shape.length * np.array([0.1, 0.37, 0.6, 0.95])
    assert farthest(shape.at(s).position, [oracle.at(each)[3:6] for each in s]) < 1e-9


@pytest.mark.parametrize("number", range(2, len(PROTOTYPES) + 1))
def test_first_pull_of_the_other_prototypes(number):
    shape = solve(rubbing(prototype(number), 0.15), 1.5, accuracy=1e-9)
    assert farthest(shape.tip, profile((1.5,), 0.15, "published", number).tip) < 1e-9


@pytest.mark.parametrize("tensions", CYCLES.values(), ids=CYCLES.keys())
@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_loading_and_unloading(tensions, mu):
    shape, oracle = along(rubbing(prototype(1), mu), tensions), profile(tensions, mu)
    assert farthest(shape.tip, oracle.tip) < 1e-8
    s = shape.length * np.array([0.2, 0.45, 0.7, 0.9])
    assert farthest(shape.at(s).position, [oracle.at(each)[3:6] for each in s]) < 1e-8


@pytest.mark.parametrize("tensions", [(0.7, 0.68), (0.7, 0.62), (0.7, 0.62, 0.66), (0.7, 0.6, 0.66, 0.63)])
@pytest.mark.parametrize("accuracy", [1e-5, 1e-6, 1e-7])
def test_the_accuracy_asked_for_holds_after_unloading(tensions, accuracy):
    tip = along(rubbing(prototype(1), 0.1), tensions, accuracy).tip
    assert farthest(tip, profile(tensions, 0.1).tip) < 1.5 * accuracy


def test_straight_rod_in_closed_form():
    """t stays along z: tau = tau0 / (1 + mu tau0 X s / EI), and the curvature is tau X / EI."""
    mu, tau0, X = 0.4, 4.0, 8e-4
    robot = rod(Tendon.constant(x=X, y=0.0, friction=mu))
    shape = solve(robot, tau0, accuracy=1e-10, s=np.linspace(0.0, 0.2, 9))
    EI = robot.section.Kbt[1]
    curvature = tau0 * X / EI / (1.0 + mu * tau0 * X * shape.s / EI)
    assert np.abs(np.abs(shape.u[:, 1]) / curvature - 1.0).max() < 1e-5
    angle = np.log1p(mu * tau0 * X * 0.2 / EI) / mu
    assert np.arccos(shape.rotation[-1, 2, 2]) == pytest.approx(angle, abs=1e-8)


@pytest.mark.parametrize("tensions", [(2.0,), (2.0, 1.7), (2.0, 1.7, 1.9)])
def test_length_drive(tensions):
    mu, given = 0.3, (500.0, 0.1)
    tendon = Tendon.constant(x=8e-4, y=0.0, friction=mu, axial_stiffness=500.0, free_length=0.1)
    robot, oracle, shape = rod(tendon), None, None
    plain = act.rod_of(robot)
    for tau in tensions:
        oracle = act.rubbed(plain, tau, mu, oracle)
        shape = solve(robot, displacements=oracle.displacement(*given), history=shape, accuracy=1e-9)
    assert shape.tensions[0] == pytest.approx(tensions[-1], rel=1e-6)
    assert farthest(shape.tip, oracle.tip) < 1e-8


@pytest.mark.parametrize("tensions", [(0.7,), (0.7, 0.62), (0.7, 0.4)])
def test_length_drive_of_the_prototype(tensions):
    robot, shape = rubbing(prototype(1), 0.1, **ELASTIC), None
    for k in range(1, len(tensions) + 1):
        d = profile(tensions[:k], 0.1).displacement(589.0, 0.3)
        shape = solve(robot, displacements=d, history=shape, accuracy=1e-9)
    assert shape.tensions[0] == pytest.approx(tensions[-1], abs=1e-6)
    assert farthest(shape.tip, profile(tensions, 0.1).tip) < 1e-8


LOADED = {
    "weight": {"gravity": GRAVITY},
    "tip": {"gravity": (0.0, 9.81, 0.0), "tip_force": (2e-3, -1e-3, 1e-3)},
    "part": {"gravity": GRAVITY, "insertion": 0.5, "rotation": 1.0},
    "follower": {"loads": [PointLoad(force=(2e-3, 0.0, 0.0), frame="body")]},
}


@pytest.mark.parametrize("loads", LOADED.values(), ids=LOADED.keys())
def test_without_friction_history_means_nothing(loads):
    """mu = 0 gives what is found without friction, and mu -> 0 goes there linearly."""
    free = solve(prototype(1), 0.7, **loads, steps=40)
    before = solve(rubbing(prototype(1), 0.2), 1.2, **loads, steps=40)
    zero = solve(rubbing(prototype(1), 0.0), 0.7, **loads, steps=40, history=before)
    assert farthest(zero.tip, free.tip) < 1e-12
    small = [farthest(solve(rubbing(prototype(1), mu), 0.7, **loads, steps=40).tip, free.tip) for mu in (1e-6, 1e-7)]
    assert small[0] < 1e-7
    assert small[0] / small[1] == pytest.approx(10.0, rel=1e-2)


@pytest.mark.parametrize("loads", LOADED.values(), ids=LOADED.keys())
def test_hysteresis(loads):
    """Going down the tip lags: more bent than going up at the same tension, the loop closed, its area a loss."""
    robot, shape, tips = rubbing(prototype(1), 0.15), None, []
    up, down = (0.3, 0.5, 0.7, 0.9), (0.8, 0.6, 0.4, 0.3)
    again = (0.5, 0.7, 0.9)
    for tau in (*up, *down, *again):
        shape = solve(robot, tau, history=shape, **loads)
        tips.append(shape.tip)
    bent = np.linalg.norm(np.array(tips) - solve(robot, 0.0, **loads).tip, axis=1)
    assert (np.diff(bent[:4]) > 0.0).all()
    assert (np.diff(bent[3:8]) < 0.0).all()
    assert (np.diff(bent[7:]) > 0.0).all()
    assert farthest(tips[-1], tips[3]) < 5e-6  # return-point memory
    tau = np.array([*up, *down])
    closed = np.append(tau, tau[0]), np.append(bent[:8], bent[0])
    area = 0.5 * np.sum(closed[0][:-1] * closed[1][1:] - closed[0][1:] * closed[1][:-1])
    assert area > 1e-6


def test_the_work_of_a_closed_cycle_is_lost():
    """Integral of tau dd over a cycle of the pulled length > 0, and 0 without friction."""
    lengths = [*np.linspace(4e-4, 2e-3, 9), *np.linspace(2e-3, 4e-4, 9)[1:]]
    lengths += [*np.linspace(4e-4, 2e-3, 9)[1:]]
    for mu, low, high in ((0.2, 1e-5, 1e-2), (0.0, -1e-9, 1e-9)):
        robot, shape, tau = rubbing(prototype(1), mu), None, []
        for d in lengths:
            shape = solve(robot, displacements=d, gravity=GRAVITY, history=shape)
            tau.append(shape.tensions[0])
        d, tau = np.array(lengths[8:]), np.array(tau[8:])
        work = np.sum(0.5 * (tau[1:] + tau[:-1]) * np.diff(d))
        assert low < work < high


@pytest.mark.parametrize("tau", [0.3, 0.7, 0.71])
def test_pulling_on_forgets_what_was_before(tau):
    robot = rubbing(prototype(1), 0.1)
    before = along(robot, (0.5, 0.2, 0.25), gravity=GRAVITY)
    if tau > 0.5:
        found = solve(robot, tau, history=before, gravity=GRAVITY, accuracy=1e-9)
        assert farthest(found.tip, solve(robot, tau, gravity=GRAVITY, accuracy=1e-9).tip) < 2e-9
    same = solve(robot, 0.25, history=before, gravity=GRAVITY, accuracy=1e-9)
    assert farthest(same.tip, before.tip) < 1e-8


def test_friction_arrives_only_as_far_as_the_tendon_turns():
    """A tendon along the axis of a straight rod turns nowhere: no friction; a helical one turns without bending."""
    straight = rod(Tendon.constant(x=0.0, y=0.0, friction=0.5))
    assert farthest(solve(straight, 5.0).tip, solve(rod(Tendon.constant(x=0.0, y=0.0)), 5.0).tip) < 1e-12
    helical = rod(Tendon.helical(offset=1e-3, angle=0.0, turns=3.0, friction=0.5), radius=5e-3)
    stiff = solve(helical, 1.0, accuracy=1e-9)
    b, w = 1e-3, 2.0 * np.pi * 3.0 / 0.2
    turn = b * w * w / np.sqrt(1.0 + (b * w) ** 2) * 0.2  # |t'| of a helix, times its length
    expected = np.exp(-0.5 * turn)
    local = stiff.at([0.0, stiff.length]).u[:, :2]
    assert np.linalg.norm(local[1]) / np.linalg.norm(local[0]) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_sampled_tendon_as_helical_one(mu):
    given = four_tendon_rod(0.7)
    given = given.replace(tendons=given.tendons[:1])
    s = np.linspace(0.0, 0.5, 161)
    r = given.tendon_position(0, s)
    sampled = given.replace(tendons=(Tendon.sampled(s, r[:, 0], r[:, 1], friction=mu),))
    loads = {"gravity": (9.81, 0.0, 0.0), "accuracy": 1e-7}
    first, again = solve(rubbing(given, mu), 12.0, **loads), solve(sampled, 12.0, **loads)
    assert farthest(first.tip, again.tip) < 1e-6
    back, again = solve(rubbing(given, mu), 10.0, history=first, **loads), solve(sampled, 10.0, history=again, **loads)
    assert farthest(back.tip, again.tip) < 1e-6


def test_helical_tendon_in_the_frame_that_turns_with_it():
    """A round rod with a helical tendon is one with u* = (0, 0, omega) and a tendon that stays where it is."""
    turns, mu, X = 0.6, 0.25, 2e-3
    robot = rod(Tendon.helical(offset=X, angle=0.0, turns=turns, friction=mu))
    section, omega = robot.section, 2.0 * np.pi * turns / 0.2
    oracle = act.Rod(length=0.2, Kse=section.Kse, Kbt=section.Kbt, u_star=[0, 0, omega], r=[X, 0, 0])
    pulled = act.rubbed(oracle, 4.0, mu)
    released = act.rubbed(oracle, 3.6, mu, pulled)
    up = solve(robot, 4.0, accuracy=1e-9)
    down = solve(robot, 3.6, accuracy=1e-9, history=up)
    assert farthest(up.tip, pulled.tip) < 2e-9
    assert farthest(down.tip, released.tip) < 1e-8


def test_order_of_convergence_of_the_first_pull():
    robot, exact = rubbing(prototype(1), 0.2), profile((0.7,), 0.2).tip
    errors = np.array([farthest(solve(robot, 0.7, steps=n, accuracy=1e-9).tip, exact) for n in (8, 16, 32, 64)])
    assert (np.log2(errors[:-1] / errors[1:]) > 2.7).all()


def test_a_neighbour_to_start_from_changes_nothing():
    robot = rubbing(prototype(1), 0.1)
    near = solve(robot, 0.7, gravity=GRAVITY, accuracy=1e-9)
    for tau, history in ((0.5, None), (0.5, near), (0.9, near)):
        cold = solve(robot, tau, gravity=GRAVITY, accuracy=1e-9, history=history)
        warm = solve(robot, tau, gravity=GRAVITY, accuracy=1e-9, history=history, start=near)
        assert warm.tensions[0] == tau
        assert farthest(warm.tip, cold.tip) < 3e-9


@pytest.mark.parametrize(
    ("mu", "tau", "force"),
    [
        (0.1, 0.7, (0.05, 0.0, 0.0)),
        (0.1, 2.9512452714421067, (0.02108730457123883, -0.028459979210066353, -0.11665589855913265)),
        (0.1, 2.898542351435829, (-0.03981211189824282, -0.03680507091684169, -0.09630896381310682)),
        (4.0, 10.0, (0.0, 0.0, 0.0)),
    ],
)
def test_what_needs_continuation_keeps_the_tension(mu, tau, force):
    """Loads far beyond what one Newton step takes: a shape that is returned has the tension that was asked for."""
    shape = solve(rubbing(prototype(1), mu), tau, tip_force=force, throw=False)
    if shape.converged:
        assert shape.tensions[0] == tau


def test_history_with_another_insertion_keeps_what_was_exposed():
    """Retracting at the same tension: no reversal in the tendon's turning, the share at each place is kept or slips."""
    robot = rubbing(prototype(1), 0.1)
    full = solve(robot, 0.7, gravity=GRAVITY)
    half = solve(robot, 0.7, gravity=GRAVITY, insertion=0.6, history=full)
    fresh = solve(robot, 0.7, gravity=GRAVITY, insertion=0.6)
    assert half.converged
    assert farthest(half.tip, fresh.tip) < 3e-3
    assert farthest(half.tip, solve(robot.replace(tendon_friction=0.0), 0.7, gravity=GRAVITY, insertion=0.6).tip) < 5e-3


@pytest.mark.parametrize("history", ["before", 3, np.zeros(3)])
@pytest.mark.parametrize("mu", [0.0, 0.1])
def test_history_must_be_a_shape(history, mu):
    with pytest.raises(InvalidInput, match="history"):
        solve(rubbing(prototype(1), mu), 0.7, history=history)


def test_history_of_another_robot_is_refused():
    other = solve(rod(), ())
    with pytest.raises(InvalidInput, match="history"):
        solve(rubbing(prototype(1), 0.1), 0.7, history=other)


@pytest.mark.parametrize("mu", [-0.1, float("nan"), "rough", None])
def test_bad_friction_is_named(mu):
    with pytest.raises(InvalidInput, match="friction"):
        Tendon.constant(x=0.0, y=0.0, friction=mu)
