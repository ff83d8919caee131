"""Limits from the model: the strain table against direct solves, and limits that follow from it."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rig.plain_bench import period, plain_bench
from tendonrod import load_robot, solve
from tendonrod.errors import InvalidInput
from tendonrod.loads import LumpedMass, PointLoad
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.limits import Limits
from tendonrod.rig.model_limits import SHARE, bench_limits, strain_limit
from tendonrod.rig.states import FaultKind
from tendonrod.statics.limits import PLATEAU_STRAIN, fibre_strain
from tendonrod.statics.tension_limits import tension_limits

GRAVITY = (0.0, -9.81, 0.0)
TRACKER = (LumpedMass(mass=0.5e-3),)


@pytest.fixture(scope="module")
def robot():
    return load_robot("exonav-1").replace(torsion="homogenized")


@pytest.fixture(scope="module")
def table(robot):
    return strain_limit(robot, GRAVITY, TRACKER)


def test_table_is_near_the_solve_and_never_much_below_it(robot, table):
    rng = np.random.default_rng(3)
    for eta, tau in zip(rng.uniform(0.02, 1.0, 60), rng.uniform(0.0, 1.3, 60), strict=True):
        shape = solve(robot, tau, GRAVITY, insertion=eta, loads=TRACKER)
        error = table(eta, tau) / PLATEAU_STRAIN - fibre_strain(shape).max() / PLATEAU_STRAIN
        assert -0.002 < error < (0.006 if tau > 0.8 else 0.05)


@pytest.mark.parametrize("name", ["exonav-1", "exonav-2", "exonav-3", "exonav-4"])
def test_without_load_the_limit_is_the_plateau_at_every_insertion(name):
    robot = load_robot(name)
    plateau = next(limit.tension for limit in tension_limits(robot) if limit.name == "plateau")
    unloaded = strain_limit(robot, insertions=3)
    for eta in (0.02, 0.3, 1.0):
        assert unloaded.limit(eta) == pytest.approx(plateau, rel=1e-4)


def test_limit_is_where_the_table_says_so(table):
    for eta in (0.1, 0.5, 0.93):
        assert table(eta, table.limit(eta)) == pytest.approx(PLATEAU_STRAIN, rel=1e-9)


def test_weight_takes_from_the_limit(robot, table):
    limits = [table.limit(eta) for eta in table.insertions]
    assert all(a > b for a, b in pairwise(limits))
    assert strain_limit(robot, GRAVITY).limit(1.0) > table.limit(1.0)


def test_table_beyond_its_ends(table):
    assert table(-1.0, 0.5) == table(0.02, 0.5)
    assert table(7.0, 0.5) == table(1.0, 0.5)
    assert table(0.5, -3.0) == table(0.5, 0.0)
    assert table(0.5, 30.0) > table(0.5, 10.0) > table(0.5, float(table.tensions[-1]))
    with pytest.raises(ValueError, match="read-only"):
        table.strain[0, 0] = 0.0


def test_bench_limits_come_from_the_robot(robot, table):
    limits = bench_limits(robot, table, target=0.7, release_travel=5e-3)
    assert limits.tension == pytest.approx(SHARE * table.limit(1.0), rel=1e-12)
    assert limits.length == robot.section.L < limits.translation.high < robot.section.L + 2e-3
    assert limits.release_travel == 5e-3
    with pytest.raises(InvalidInput, match=r"target = 0\.9"):
        bench_limits(robot, table, target=0.9)
    with pytest.raises(InvalidInput, match="target"):  # a limit set higher leaves that of the strain
        bench_limits(robot, table, target=0.99 * table.limit(1.0), tension=10.0)


def test_interlock_watches_the_strain_of_the_model(robot, table):
    bench = plain_bench()
    guarded = GuardedBench(bench, bench_limits(robot, table, tension=3.0), table)
    guarded.home()
    bench.translation.position = robot.section.L
    bench.load_cell.change = {"tension": table.limit(1.0) * 1.01}
    guarded.interlock._watch.restart()
    period(guarded)
    assert guarded.interlock.fault.kind is FaultKind.STRAIN


def test_other_robots_are_refused(robot):
    with pytest.raises(InvalidInput, match="exactly one tendon"):
        strain_limit(replace(robot, tendons=()))


def test_default_limits_are_those_of_the_first_prototype(robot):
    assert Limits().strain == pytest.approx(PLATEAU_STRAIN, rel=1e-3)
    assert Limits().tension < (tension_limits(load_robot("exonav-1"))[0].tension or 0.0)
    assert Limits().length == pytest.approx(robot.section.L, rel=2e-3)


def test_a_load_that_leaves_no_room_is_named_with_what_would_be_borne(robot):
    """What it says is borne has limits, a tenth more has none."""
    table = strain_limit(robot, GRAVITY, (LumpedMass(mass=5e-3),))
    with pytest.raises(InvalidInput, match=r"load = 5 g, gravity \(0, -9.81, 0\) m/s2: must be less") as found:
        bench_limits(robot, table)
    borne = re.search(r"it bears ([\d.]+) g, or all of it with ([\d.]+) of this gravity", str(found.value))
    assert borne is not None
    mass, share = 1e-3 * float(borne[1]), float(borne[2])
    assert bench_limits(robot, strain_limit(robot, GRAVITY, (LumpedMass(mass=mass),))).tension > 0.0
    weaker = [share * x for x in GRAVITY]
    assert bench_limits(robot, strain_limit(robot, weaker, (LumpedMass(mass=5e-3),))).tension > 0.0
    with pytest.raises(InvalidInput, match="load"):
        bench_limits(robot, strain_limit(robot, GRAVITY, (LumpedMass(mass=1.1 * mass),)))


def test_its_own_weight_and_a_force_can_be_too_much(robot):
    with pytest.raises(InvalidInput, match=r"load = gravity \(-981, 0, 0\) m/s2: .*it bears 0\.\d+ of this gravity"):
        bench_limits(robot, strain_limit(robot, (-981.0, 0.0, 0.0)))
    with pytest.raises(InvalidInput, match=r"load = 1 other load, gravity .*it bears 0\.\d+ of the loads$"):
        bench_limits(robot, strain_limit(robot, loads=(PointLoad(force=(0.0, 0.05, 0.0)),)))
