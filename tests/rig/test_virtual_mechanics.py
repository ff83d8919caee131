"""Robot and tendon of the virtual bench: the table against the engine, signs, compliances, friction."""

from dataclasses import replace
from itertools import pairwise
from math import exp, hypot, pi

import numpy as np
import pytest

from tendonrod import InvalidInput, solve
from tendonrod.loads import LumpedMass
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.mechanics import EngineMechanics, OuterTube, TableMechanics, driven_robot
from tendonrod.rig.virtual.table import robot_table
from virtual_setups import DOWN, QUIET_TRACKER, drive, ideal, pull_to, robot, usual

TIP_HEAVY = replace(QUIET_TRACKER, mass=0.1e-3, offset=(1e-3, -2e-3, 1.5e-3))
PLACES = [(1.0, 0.0, 2.5e-3), (0.73, 0.4, 2e-3), (0.31, -1.9, 1e-3), (0.07, 3.0, 0.4e-3), (0.5, 9.0, 1.2e-3)]


@pytest.mark.parametrize("tracker", [QUIET_TRACKER, TIP_HEAVY], ids=["bare", "with a tracker"])
@pytest.mark.parametrize(("insertion", "rotation", "pulled"), PLACES)
def test_table_gives_the_engines_tension_and_pose(tracker, insertion, rotation, pulled):
    setup = ideal(gravity=DOWN, exit_tilt=(0.02, -0.01), tracker=tracker)
    table = TableMechanics(setup)
    tension = table.follow(insertion, rotation, pulled)
    shape = solve(
        driven_robot(setup), displacements=pulled, gravity=DOWN, exit_tilt=(0.02, -0.01), insertion=insertion,
        rotation=rotation, loads=[LumpedMass(mass=tracker.mass, offset=tracker.offset)] if tracker.mass else (),
    )  # fmt: skip
    axis, R = table.pose()
    assert tension == pytest.approx(shape.tensions[0], abs=1e-4)
    assert tension > 0.05
    assert axis == pytest.approx(shape.centerline[-1], abs=1e-6)
    assert pytest.approx(shape.rotation[-1], abs=1e-4) == R
    assert pytest.approx(np.eye(3), abs=1e-12) == R @ R.T


def test_table_knows_its_own_error():
    table = TableMechanics(ideal(gravity=DOWN, exit_tilt=(0.02, -0.01), tracker=TIP_HEAVY)).table
    assert 0.0 < table.error < 1e-6


def test_table_is_refused_where_it_would_not_hold():
    uneven = robot().replace(tendon_end=0.05)
    with pytest.raises(InvalidInput, match="engine"):
        robot_table(uneven, DOWN, (0.0, 0.0), 0.0, (0.0, 0.0, 0.0), 1.5)


def test_both_mechanics_agree_along_a_motion():
    places = [(0.5 + 0.01 * k, 0.02 * k, 1e-3 + 1e-4 * k) for k in range(15)]
    setup = ideal(gravity=DOWN, exit_tilt=(0.02, -0.01), tracker=TIP_HEAVY)
    table, engine = TableMechanics(setup), EngineMechanics(setup)
    for place in places:
        assert table.follow(*place) == pytest.approx(engine.follow(*place), abs=1e-5)


def test_compliance_is_that_of_robot_and_tendon():
    """2.79 mm/N of prototype 1 at 0.7 N (published torsion) and 0.51 mm/N of 0.3 m of tendon: physics of the bench."""
    table = TableMechanics(ideal(robot=robot("published")))
    pulled = np.array([_pulled(table, tension) for tension in (0.69, 0.71)])
    robot_alone = np.diff(pulled)[0] / 0.02 - 0.3 / 589.0
    assert 1e3 * robot_alone == pytest.approx(2.79, abs=0.005)
    assert pytest.approx(0.51, abs=0.001) == 1e3 * 0.3 / 589.0


def test_pay_out_of_follow_the_leader_motion():
    """0.974 mm of tendon per mm of insertion keeps 0.7 N, the published robot weightless."""
    table = TableMechanics(ideal(robot=robot("published")))
    advance = 1e3 * (_pulled(table, 0.7, 1.0) - _pulled(table, 0.7, 0.5)) / (0.5 * 75.4)
    assert 1.0 - advance == pytest.approx(0.974, abs=1e-3)


def _pulled(table: TableMechanics, tension: float, insertion: float = 1.0) -> float:
    """Pulled length at which the tension is ``tension``, by bisection."""
    low, high = 0.0, 10e-3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if table.follow(insertion, 0.0, middle) < tension else (low, middle)
    return low


def test_beyond_the_highest_tension_it_goes_on_rising():
    table = TableMechanics(ideal(highest_tension=0.8))
    tensions = [table.follow(1.0, 0.0, pulled) for pulled in np.linspace(2e-3, 12e-3, 21)]
    assert np.all(np.diff(tensions) > 0.0)
    assert tensions[-1] > 1.5


def test_pushing_out_and_taking_up_raise_tension_and_paying_out_lowers_it():
    bench = virtual_bench(ideal(0.6, gravity=DOWN), 1)
    pull_to(bench, 0.4)
    tensions = [bench.world.tension]
    for motion in ({"translation": 1e-3}, {"screw": 0.4e-3}, {"screw": -0.4e-3}, {"translation": -1e-3}):
        drive(bench, 0.3, **motion)
        drive(bench, 0.1)
        tensions.append(bench.world.tension)
    assert [b > a for a, b in pairwise(tensions)] == [True, False, True, False]


def test_a_slack_tendon_has_no_tension():
    bench = virtual_bench(ideal(0.6, slack=5e-3), 1)
    drive(bench, 0.5, screw=0.4e-3)
    assert bench.world.tension == 0.0
    assert bench.load_cell.read().tension == 0.0


@pytest.mark.parametrize("mechanics", ["table", "engine"])
def test_friction_opens_a_loop_and_returns_to_it(mechanics):
    """A cycle of pulled length: more tension on the way in than on the way out, and the same when repeated."""
    found = _cycle(mechanics, 0.2)
    assert found[5] > found[15] + 0.02  # the same pulled length, on the way in and on the way out
    assert found[22] == pytest.approx(found[10], abs=2e-3)
    assert found[27] == pytest.approx(found[15], abs=2e-3)
    for here, there in zip(_cycle(mechanics, 0.0), found, strict=True):
        assert there == pytest.approx(here, rel=0.35, abs=0.05)


def test_reduced_friction_is_near_the_engines_while_the_tendon_slips():
    table, engine = np.array(_cycle("table", 0.1)), np.array(_cycle("engine", 0.1))
    assert np.abs(table - engine)[:11].max() < 0.01 * engine.max()  # pulled from slack: slips all along
    assert np.abs(table - engine).max() < 0.12 * engine.max()  # turning round: lets go at once, or from the exit on


def _cycle(mechanics: str, friction: float) -> list[float]:
    setup = ideal(gravity=DOWN, tendon_friction=friction)
    robot = TableMechanics(setup) if mechanics == "table" else EngineMechanics(setup)
    up = np.linspace(0.2e-3, 2.4e-3, 11)
    return [robot.follow(1.0, 0.0, pulled) for pulled in (*up, *up[-2:4:-1], *up[4:], *up[-2:4:-1])]


def test_friction_of_a_tendon_that_turns_through_an_angle():
    """Within the bounds that a rope on a drum gives, exp(+-mu Theta) of what is felt."""
    table = TableMechanics(ideal(tendon_friction=0.2))
    tension = table.follow(1.0, 0.0, 2.4e-3)
    theta = float(table.table.weights(1.0, 0.0) @ table.table.turning @ _taus(table))
    assert 1.0 < theta < 3.0
    assert table.felt < tension < table.felt * exp(0.2 * theta)


def _taus(table: TableMechanics) -> np.ndarray:
    return np.cos(np.arccos(2.0 * table.felt / table.table.highest - 1.0) * np.arange(table.table.sizes[2]))


def test_a_robot_that_is_only_turned_winds_up_and_one_that_slides_hardly_does():
    friction, inside = 0.05, 0.5 * robot().length_na
    tube = OuterTube(robot(), friction)
    torsional = 2.0 * float(robot().section.Kbt[2]) / inside
    radius = 0.572e-3
    lag = sliding = 0.0
    for _ in range(200):
        lag = tube.follow(0.0, 0.01, 0.5)[1]
    assert lag == pytest.approx(friction * radius / torsional, rel=1e-9)
    pitch = 2.0 * pi / robot().section.L
    for _ in range(2000):
        sliding = tube.follow(1e-5, pitch * 1e-5, 0.5)[1]
    assert 0.0 < sliding < 0.06 * lag


def test_friction_in_the_outer_tube_never_exceeds_its_bound_nor_gives_energy_back():
    rng, tube, stored, given = np.random.default_rng(4), OuterTube(robot(), 0.05), 0.0, 0.0
    k_z, k_t = 2.0 * tube.axial / tube.length, 2.0 * tube.torsional / tube.length  # half way out
    for dz, turn in rng.normal(0.0, (1e-5, 0.02), (500, 2)):
        tube.follow(dz, turn, 0.5)
        f_z, f_t = k_z * tube.z, k_t * tube.turn
        assert hypot(f_z, f_t) <= 0.05 * (1.0 + 1e-9)
        given += f_z * dz + f_t * turn * tube.radius
        stored = 0.5 * (f_z * tube.z + f_t * tube.turn)
        assert given >= stored - 1e-15


def test_without_outer_friction_the_exit_follows():
    tube = OuterTube(robot(), 0.0)
    assert tube.follow(1e-3, 0.5, 0.3) == (0.0, 0.0)


def test_insertion_beyond_its_ends_moves_the_robot_as_a_rod():
    setup = ideal(1.0, slack=3e-3)
    bench = virtual_bench(setup, 0)
    before, R = bench.world.tip()
    drive(bench, 0.5, screw=0.5e-3, translation=0.5e-3)
    after, turned = bench.world.tip()
    moved = bench.world.truth.z - setup.robot.section.L
    assert bench.world.truth.insertion == 1.0
    assert moved > 2e-4
    assert after - before == pytest.approx([0.0, 0.0, moved], abs=1e-9)
    assert turned == pytest.approx(R, abs=1e-9)


def test_a_setup_says_what_is_wrong_with_it():
    for field, value in (("tendon_length", 0.01), ("mechanics", "guess"), ("gravity", (0.0, 1.0)), ("screw", 3)):
        with pytest.raises(InvalidInput, match=field):
            usual(**{field: value})


def test_a_bench_that_stands_stays_as_it_is_from_the_first_moment():
    """Taut from the start: the play of screw and rollers is on the flanks that the tendon presses."""
    bench = virtual_bench(usual(slack=-1.5e-3), 3)
    before = bench.world.truth
    drive(bench, 2.0, period=3.7e-3)
    after = bench.world.truth
    assert replace(after, time=0.0) == before
    assert before.tension > 0.5


@pytest.mark.parametrize("mechanics", [TableMechanics, EngineMechanics])
@pytest.mark.parametrize(("insertion", "rotation", "pulled"), [(0.3, 0.4, 0.4e-3), (1.0, 0.0, 2e-3)])
def test_tension_is_that_whose_tendon_is_so_much_shorter(mechanics, insertion, rotation, pulled):
    """The tendon's length as a polygon through many points of the loaded robot, with the tracker's weight."""
    setup = ideal(gravity=DOWN, exit_tilt=(0.02, -0.01), tracker=TIP_HEAVY)
    found = mechanics(setup).follow(insertion, rotation, pulled)
    loads = (LumpedMass(mass=TIP_HEAVY.mass, offset=TIP_HEAVY.offset),)
    place = {"insertion": insertion, "rotation": rotation, "exit_tilt": setup.exit_tilt}
    bent = solve(robot(), found, DOWN, loads=loads, **place)
    drawn = polygon(solve(robot(), 0.0, insertion=insertion)) - polygon(bent)
    assert drawn + found * setup.tendon_length / setup.tendon_stiffness == pytest.approx(pulled, abs=1e-8)


def polygon(shape, points: int = 2001) -> float:
    """Length (m) of the tendon through the exposed robot."""
    at = shape.at(np.linspace(0.0, shape.length, points))
    arms = np.broadcast_to(shape.robot.tendon_position(0, at.material_coordinate), at.position.shape)
    path = at.position + np.einsum("nij,nj->ni", at.rotation, arms)
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
