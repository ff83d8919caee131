"""Branches: buckling loads and folds against exact ones, the way back, derivatives on the way, what a solve says."""

import re
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import fold_oracles as folds
from tendonrod import InvalidInput, NotConverged, PlainRod, Robot, Status, Tendon, load_robot, solve
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.statics.branches import follow_branch
from tendonrod.statics.limits import euler_loads
from tendonrod.surface import Plane
from textbook import GRAVITY, prototype, rod


@cache
def strip(precurvature: float = 0.0, across: float = 1e3, slender: float = 1e12) -> Robot:
    """Length 1 m, EI 1 N m^2 in the plane x-z and ``across`` times that out of it; EA = GA = ``slender``."""
    body = PlainRod(
        length=1.0, area=1.0, ix=across / slender, iy=1.0 / slender, j=2.0 * across / slender, youngs_modulus=slender,
        shear_modulus=slender, density=1.0, precurvature=(0.0, precurvature, 0.0),
    )  # fmt: skip
    return Robot(name="strip", body=body)


def known(array: np.ndarray | None) -> np.ndarray:
    assert array is not None
    return array


def pushing(load: float):
    return lambda angle: {"tip_force": (-load * np.sin(angle), 0.0, -load * np.cos(angle))}


@cache
def turned(factor: float, low: float = 0.0, high: float = 4.0, steps: int | None = None, across: float = 1e3):
    """The branch of a strip under ``factor`` Euler loads, buckled to +x, whose push turns."""
    robot, load = strip(across=across), factor * folds.EULER
    aside = solve(robot, tip_force=(1e-3 * load, 0.0, -load))
    buckled = solve(robot, tip_force=(0.0, 0.0, -load), start=aside)
    return follow_branch(buckled, pushing(load), high if low == 0.0 else (low, high), steps=steps)


# ---- straight rods


@pytest.mark.parametrize("robot", [rod(length=0.3), rod(length=0.1, radius=2e-3), strip(), strip(slender=50.0)])
def test_a_straight_column_loses_directions_at_eulers_loads(robot):
    """Shear and extension included: the first three loads in the soft plane, each direction at its own."""
    Kse, Kbt, L = robot.section.Kse, robot.section.Kbt, robot.length_na
    loads = [folds.euler_load(Kbt[1] * n**2, L, Kse[2], Kse[0]) for n in (1, 3, 5)]
    if robot.section.Kse[0] == 50.0:
        loads = loads[:1]
    branch = follow_branch(solve(robot, ()), "tip_force[2]", -1.1 * loads[-1])
    found = [-each.parameter for each in branch.bifurcations]
    np.testing.assert_allclose(found, loads, rtol=2e-5)
    at_once = 2 if np.isclose(Kbt[0], Kbt[1]) else 1
    assert [each.negative for each in branch.bifurcations] == [
        (i * at_once, (i + 1) * at_once) for i in range(len(loads))
    ]
    assert found[0] == pytest.approx(loads[0], rel=1e-6)
    assert not branch.folds
    between = known(branch.negative)[np.searchsorted(-branch.parameter, 1.05 * np.array(loads))]
    np.testing.assert_array_equal(between, at_once * (1 + np.arange(len(loads))))


@pytest.mark.parametrize("name", ["gravity[2]", "distributed_force[2]", "loads[0].force[2]"])
def test_a_column_buckles_under_its_own_weight(name):
    """Greenhill's load, whichever way it is given."""
    robot = strip()
    given = [DistributedLoad(force=(0.0, 0.0, -1e-3))] if name.startswith("loads") else []
    branch = follow_branch(solve(robot, (), loads=given), name, -9.0)
    assert branch.bifurcations[0].parameter == pytest.approx(-folds.greenhill_load(), rel=1e-6)


def test_a_column_that_grows_buckles_at_the_length_of_its_load():
    """Insertion as the parameter, with a load that stays where it is on the robot."""
    robot = rod()
    load = [PointLoad(force=(0.0, 0.0, -4.0 * euler_loads(robot)[0]), at=0.9 * robot.length_na)]
    start = solve(robot, insertion=0.15, loads=load)
    branch = follow_branch(start, "insertion", 0.7)
    exposed = branch.bifurcations[0].parameter - 0.1  # from the exit to the load
    assert exposed == pytest.approx(0.5, rel=1e-4)
    assert branch.bifurcations[0].negative == (0, 2)


def test_a_rods_own_parameter_can_lead():
    branch = follow_branch(solve(rod(length=0.2), tip_force=(0.0, 0.0, -0.1)), "length", 0.4)
    Kbt = rod().section.Kbt[1]
    assert branch.bifurcations[0].parameter == pytest.approx(0.5 * np.pi * np.sqrt(Kbt / 0.1), rel=1e-5)


# ---- folds


@pytest.mark.parametrize("factor", [1.5, 2.0, 3.0, 5.0])
def test_the_fold_of_a_turned_push_is_that_of_the_elliptic_integrals(factor):
    exact, branch = folds.fold(factor * folds.EULER), turned(factor)
    (fold,) = branch.folds
    assert fold.parameter == pytest.approx(exact.alpha, abs=1e-8)
    np.testing.assert_allclose(fold.tip, [exact.y, 0.0, exact.x], rtol=0, atol=1e-7)
    assert fold.negative == (0, 1)
    assert branch.slope[fold.index] == pytest.approx(0.0, abs=1e-6)
    assert np.abs(branch.parameter).max() == branch.parameter[fold.index]
    assert known(branch.stable)[: fold.index].all()
    assert not known(branch.stable)[fold.index :].any()
    assert branch.ended == "the parameter reached the end of its interval"
    assert branch.parameter[-1] == 0.0


def test_the_stable_part_is_the_elasticas():
    branch = turned(2.0)
    for i in range(0, branch.folds[0].index, 3):
        exact = folds.stable_branch(2.0 * folds.EULER, branch.parameter[i])
        np.testing.assert_allclose(branch.tip[i], [exact.y, 0.0, exact.x], rtol=0, atol=1e-7)


def test_the_fold_converges_with_the_fourth_power_of_the_step():
    exact = folds.fold(2.0 * folds.EULER).alpha
    off = [turned(2.0, steps=n).folds[0].parameter - exact for n in (10, 20, 40)]
    assert off[0] / off[1] == pytest.approx(16.0, rel=0.1)
    assert off[1] / off[2] == pytest.approx(16.0, rel=0.1)


def test_a_round_rod_leaves_the_plane_before():
    """Buckled it may swing round at no cost: turned at all, it is unstable across the plane."""
    branch = turned(2.0, high=1.0, across=1.0)
    assert branch.folds[0].parameter == pytest.approx(folds.fold(2.0 * folds.EULER).alpha, abs=1e-7)
    assert branch.folds[0].negative == (1, 2)
    assert (known(branch.negative)[2:] >= 1).all()


@cache
def snapping():
    """From one buckled side to the other and on: two folds, mirror images."""
    return turned(2.0, -0.8, 0.8)


def test_a_turned_push_snaps_there_and_back():
    branch = snapping()
    there, back = branch.folds
    assert there.parameter == pytest.approx(-back.parameter, rel=1e-9)
    np.testing.assert_allclose(there.tip, back.tip * [-1.0, 1.0, 1.0], rtol=0, atol=1e-8)
    assert (there.negative, back.negative) == ((0, 1), (1, 0))
    assert branch.parameter[-1] == 0.8


def test_the_energy_falls_in_a_snap():
    """It is stationary where the branch turns, and lower at the same load on the other side."""
    branch = snapping()
    there = branch.folds[0]
    final = np.interp(
        there.parameter, branch.parameter[branch.folds[1].index :], known(branch.energy)[branch.folds[1].index :]
    )
    assert final < known(branch.energy)[there.index]


def test_a_branch_is_the_same_when_followed_back():
    branch = snapping()
    load = 2.0 * folds.EULER
    last = branch.shape(-1)
    back = follow_branch(last, pushing(load), (0.8, -0.8), begin=0.8, steps=last.steps)
    assert [fold.parameter for fold in back.folds] == pytest.approx([-0.5449801, 0.5449801], abs=1e-6)
    for one, other in zip(branch.folds, back.folds[::-1], strict=True):
        assert one.parameter == pytest.approx(other.parameter, rel=1e-9)
        np.testing.assert_allclose(one.tip, other.tip, rtol=0, atol=1e-8)
    again = solve(strip(), **pushing(load)(0.0), start=branch.shape(0), loads=[PointLoad()])
    np.testing.assert_allclose(again.tip, branch.tip[0], rtol=0, atol=1e-7)


# ---- robots


def swung(steps: int | None = None):
    """Prototype 1 at 0.2 N, pushed by twice its Euler load in a direction that turns: it snaps, and snaps back."""
    robot = load_robot("exonav-1")
    load = 2.0 * euler_loads(robot)[0]

    def push(angle: float) -> dict:
        return {"tip_force": (0.0, load * np.sin(angle), load * np.cos(angle))}

    start = solve(robot, 0.2, **push(2.0), loads=[PointLoad()])
    return follow_branch(start, push, 4.0, begin=2.0, steps=steps)


def test_a_robot_snaps():
    branch = swung()
    assert [fold.negative for fold in branch.folds] == [(0, 1), (1, 0)]
    assert branch.parameter[branch.folds[1].index] < branch.parameter[branch.folds[0].index]
    finer = swung(160)
    for one, other in zip(branch.folds, finer.folds, strict=True):
        assert one.parameter == pytest.approx(other.parameter, abs=2e-7)
        np.testing.assert_allclose(one.tip, other.tip, rtol=0, atol=1e-8)


def pulled_rod() -> Robot:
    tendon = {"axial_stiffness": 2000.0, "free_length": 0.3}
    return rod(Tendon.constant(x=2e-3, y=0.0, **tendon), Tendon.helical(offset=2e-3, angle=1.0, turns=0.5, **tendon))


CASES = {
    "tensions[0]": (lambda: solve(prototype(1), 0.3, GRAVITY, tip_force=(2e-3, 1e-3, -2e-3)), 0.6),
    "insertion": (lambda: solve(prototype(1), 0.5, GRAVITY, insertion=0.6), 0.8),
    "rotation": (lambda: solve(prototype(1), 0.5, GRAVITY), 1.0),
    "gravity[0]": (lambda: solve(prototype(2), 0.5, GRAVITY), 9.81),
    "exit_tilt[0]": (lambda: solve(prototype(1), 0.5, GRAVITY), 0.2),
    "exit_position[1]": (lambda: solve(prototype(1), 0.5, GRAVITY), 0.01),
    "loads[0].mass": (lambda: solve(prototype(1), 0.5, GRAVITY, loads=[LumpedMass(mass=1e-4)]), 5e-4),
    "tip_moment[1]": (lambda: solve(prototype(1), 0.5, GRAVITY), 1e-4),
    "displacements[0]": (lambda: solve(pulled_rod(), gravity=GRAVITY, displacements=[2e-4, 1e-4]), 8e-4),
    "youngs_modulus": (lambda: solve(prototype(1), 0.5, GRAVITY), 60e9),
}


@pytest.mark.parametrize("name", CASES)
def test_along_a_branch_the_tip_moves_as_the_jacobian_says(name):
    """And each of its shapes is the one that a solve finds there."""
    start, stop = CASES[name][0](), CASES[name][1]
    branch = follow_branch(start, name, stop, steps=40)
    assert branch.parameter[-1] == stop
    assert not branch.folds
    for i in (0, len(branch) // 2, -1):
        shape = branch.shape(i)
        exact = shape.jacobian(name, s=[shape.length]).position[0, :, 0]
        found = branch.tip_slope[i] / branch.slope[i]
        np.testing.assert_allclose(found, exact, rtol=0, atol=2e-6 * np.linalg.norm(exact))
        assert shape.converged
        assert shape.residual < 1e-7
        np.testing.assert_allclose(shape.tip, branch.tip[i], rtol=0, atol=1e-12)
    assert branch.name == name


def test_pulled_tendons_keep_their_length_along_a_branch():
    start = solve(pulled_rod(), gravity=GRAVITY, displacements=[2e-4, 1e-4], steps=40)
    branch = follow_branch(start, "displacements[0]", 8e-4, steps=40)
    straight = solve(pulled_rod(), gravity=GRAVITY, displacements=[8e-4, 1e-4], steps=40)
    np.testing.assert_allclose(branch.shape(-1).tensions, straight.tensions, rtol=1e-6)
    np.testing.assert_allclose(branch.tip[-1], straight.tip, rtol=0, atol=1e-9)
    assert known(branch.stable).all()


def test_a_pulled_tendon_that_falls_slack_and_is_taut_again():
    start = solve(pulled_rod(), displacements=[2e-4, 1e-4], steps=40)
    branch = follow_branch(start, "displacements[0]", -2e-4, steps=40)
    assert branch.shape(-1).tensions[0] == 0.0
    assert branch.parameter[-1] == -2e-4
    back = follow_branch(branch.shape(-1), "displacements[0]", 2e-4, steps=40)
    np.testing.assert_allclose(back.tip[-1], branch.tip[0], rtol=0, atol=1e-9)


def test_loads_without_a_potential_leave_stability_open():
    load = PointLoad(force=(0.0, 0.0, -1e-3), frame="body")
    branch = follow_branch(solve(rod(), loads=[load]), "loads[0].force[0]", 1e-2)
    assert branch.stable is None
    assert branch.negative is None
    assert branch.energy is None


# ---- what a shape says of itself


@pytest.mark.parametrize(
    ("off", "says"), [(-1e-3, "stable"), (-1e-7, "at a fold"), (1e-7, "at a fold"), (1e-3, "unstable")]
)
def test_a_column_says_how_it_stands(off, says):
    column = rod(length=0.3)
    Kse, Kbt = column.section.Kse, column.section.Kbt
    load = folds.euler_load(Kbt[1], 0.3, Kse[2], Kse[0])
    assert solve(column, tip_force=(0.0, 0.0, -(1.0 + off) * load), accuracy=1e-9).stability == says


def test_a_shape_at_a_fold_says_so():
    branch = turned(3.0)
    index = branch.folds[0].index
    assert branch.shape(index).stability == "at a fold"
    assert branch.shape(index - 1).stability == "stable"
    assert branch.shape(index + 1).stability == "unstable"
    assert branch.shape(index).stable is not None


def test_stability_is_silent_where_stable_is():
    assert solve(rod(), tip_moment=(0.0, 1e-3, 0.0)).stability is None
    assert solve(prototype(1), 0.7, tip_force=(1e6, 0.0, -1e7), throw=False).stability is None
    assert solve(prototype(1), 0.7, insertion=0.0).stability == "stable"


# ---- a solve whose branch ends


HOOK, ACROSS = 6.0, -1.9634954084936207  # precurvature (1/m) and direction (rad) of a force that opens the hook


def hook_fold(near: tuple[float, float]) -> float:
    """The force at which a hook under a growing tip force snaps, by shooting from the tip: psi'' = -P sin psi."""

    def at_the_base(guess: np.ndarray) -> np.ndarray:
        load, tip = guess

        def derivative(_, y):
            return [y[1], -load * np.sin(y[0]), y[3], -load * np.cos(y[0]) * y[2]]

        run = solve_ivp(derivative, (1.0, 0.0), [tip, HOOK, 1.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13)
        return np.array([run.y[0, -1] + ACROSS, run.y[2, -1]])

    return float(fsolve(at_the_base, near, xtol=1e-13)[0])


def opened(load: float, general: bool, **more):
    force = (-load * np.sin(ACROSS), 0.0, -load * np.cos(ACROSS))
    given = {"loads": [PointLoad(force=force)]} if general else {"tip_force": force}
    return solve(strip(precurvature=HOOK), **given, **more)


@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("factor", [1.001, 1.5, 5.0])
def test_past_a_fold_a_solve_names_the_critical_load(factor, general):
    critical = hook_fold((5.6, 7.9))
    assert critical == pytest.approx(5.647428, abs=1e-6)
    shape = opened(factor * critical, general, throw=False)
    assert shape.status is Status.NO_EQUILIBRIUM_ON_BRANCH
    assert shape.status.name.lower() == "no_equilibrium_on_branch"
    assert shape.load_factor == pytest.approx(1.0 / factor, rel=1e-6)
    assert np.isnan(shape.position).all()
    with pytest.raises(NotConverged, match=r"critical load factor .* of the load asked for") as caught:
        opened(factor * critical, general)
    said = re.search(r"critical load factor (\S+) of", str(caught.value))
    assert said is not None
    assert float(said[1]) == pytest.approx(1.0 / factor, rel=1e-6)
    assert opened(0.999 * critical, general).stability == "stable"


def test_the_hooks_branch_goes_on_beyond_two_folds():
    start = solve(strip(precurvature=HOOK))
    branch = follow_branch(start, lambda t: {"tip_force": (-t * np.sin(ACROSS), 0.0, -t * np.cos(ACROSS))}, 8.0)
    assert [fold.negative for fold in branch.folds] == [(0, 1), (1, 0)]
    assert branch.folds[0].parameter == pytest.approx(hook_fold((5.6, 7.9)), rel=1e-6)
    assert branch.parameter[-1] == 8.0
    assert known(branch.stable)[-1]


@pytest.mark.parametrize("seed", [35, 43])
def test_where_shooting_is_lost_the_branch_goes_on(seed):
    """Large loads whose branch has no fold, but which single shooting cannot follow to the end."""
    rng = np.random.default_rng(seed)
    robot = prototype(1 + seed % 4, "open_section")
    push = rng.normal(size=3)
    push *= rng.uniform(0.5, 6.0) * euler_loads(robot)[0] / np.linalg.norm(push)
    shape = solve(robot, float(rng.uniform(0.0, 1.0)), GRAVITY, tip_force=push)
    assert shape.stability == "stable"
    assert shape.load_factor == 1.0


# ---- what is asked


BAD = {
    "start": lambda s: follow_branch(1.0, "insertion", 0.5),
    "parameter": lambda s: follow_branch(s, "gravity", 1.0),
    "inputs": lambda s: follow_branch(s, "weight", 1.0),
    "stop": lambda s: follow_branch(s, "insertion", 1.0),
    "stop ": lambda s: follow_branch(s, "insertion", (0.2, 0.4)),
    "step": lambda s: follow_branch(s, "insertion", 0.5, step=0.0),
    "most": lambda s: follow_branch(s, "insertion", 0.5, most=1),
    "steps": lambda s: follow_branch(s, "insertion", 0.5, steps=0),
    "begin": lambda s: follow_branch(s, lambda t: {}, 1.0, begin=float("nan")),
    "parameter ": lambda s: follow_branch(s, lambda t: {"weight": t}, 1.0),
    "parameter  ": lambda s: follow_branch(s, lambda t: t, 1.0),
    "parameter(0)['tip_force']": lambda s: follow_branch(s, lambda t: {"tip_force": (1.0, t, 0.0)}, 1.0),
    "index": lambda s: follow_branch(s, "insertion", 0.9, steps=10).shape(1000),
}


@pytest.mark.parametrize("field", BAD)
def test_bad_input_is_named(field):
    with pytest.raises(InvalidInput) as caught:
        BAD[field](solve(prototype(1), 0.5))
    assert caught.value.field == field.strip()


def test_contact_and_unsolved_shapes_are_refused():
    wall = solve(rod(), tip_force=(1e-3, 0.0, 0.0), surface=Plane(point=(1.0, 0.0, 0.0), normal=(-1.0, 0.0, 0.0)))
    lost = solve(prototype(1), 0.7, tip_force=(1e6, 0.0, -1e7), throw=False)
    for start in (wall, lost, solve(prototype(1), insertion=0.0)):
        with pytest.raises(InvalidInput, match="start"):
            follow_branch(start, "tip_force[0]", 1.0)


def test_progress_is_told_and_most_is_kept():
    told = []
    branch = follow_branch(
        solve(prototype(1), 0.5), "gravity[0]", -9.81, most=4, progress=lambda count, t: told.append((count, t))
    )
    assert branch.ended == "as many points as allowed"
    assert [count for count, _ in told] == [2, 3, 4]
    np.testing.assert_array_equal([t for _, t in told], branch.parameter[1:])


def test_arrays_are_read_only():
    branch = turned(2.0)
    for name in ("parameter", "tip", "arclength", "slope", "tip_slope", "negative", "stable", "energy"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(branch, name)[0] = 0
