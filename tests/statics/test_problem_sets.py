"""Problems of the literature that need more than one straight rod: Princeton beam, routings, anchors half way."""

import numpy as np
import pytest
from scipy.optimize import brentq

import fold_oracles as folds
import princeton as bench
from tendonrod import PlainRod, Robot, Tendon, solve
from tendonrod.body import Segments, TaperedRod
from tendonrod.loads import PointLoad
from textbook import farthest, four_tendon_rod, rod


def bar() -> Robot:
    """The Princeton bar, by area and inertia."""
    given = bench.Bar()
    body = PlainRod(
        length=given.length, area=given.area, ix=given.I_x, iy=given.I_y, j=given.J, youngs_modulus=given.E,
        shear_modulus=given.G, density=0.0,
    )  # fmt: skip
    return Robot(name="princeton", body=body)


def loaded(force, general: bool) -> dict:
    return {"loads": [PointLoad(force=force)]} if general else {"tip_force": force}


@pytest.mark.parametrize("general", [False, True])
@pytest.mark.parametrize("weight", bench.WEIGHTS)
@pytest.mark.parametrize("angle", [0.0, 30.0, 60.0, 90.0])
def test_princeton_beam_by_collocation(weight, angle, general):
    force = bench.weight_force(weight, np.radians(angle))
    shape = solve(bar(), (), **loaded(force, general), accuracy=1e-9)
    found = bench.tip_motion(shape.tip, shape.at([shape.length]).rotation[0], bench.Bar().length)
    exact = bench.princeton(weight, np.radians(angle))
    for name in ("flap", "chord", "axial", "twist"):
        assert getattr(found, name) == pytest.approx(getattr(exact, name), abs=2e-7)


@pytest.mark.parametrize("weight", sorted(bench.ANSYS))
def test_princeton_beam_of_ansys(weight):
    for angle, chord, flap in zip(bench.ANSYS_ANGLES, *bench.ANSYS[weight], strict=True):
        force = bench.weight_force(weight, np.radians(angle))
        shape = solve(bar(), (), loads=[PointLoad(force=force)])
        assert 1e3 * shape.tip[0] == pytest.approx(chord, rel=0.014, abs=2e-3)
        assert 1e3 * shape.tip[1] == pytest.approx(flap, rel=0.004, abs=2e-3)


def general(robot: Robot) -> Robot:
    """The same rod in two segments, which only the general driver takes."""
    body = robot.body
    assert isinstance(body, PlainRod)
    halves = tuple(body.__class__(**{**vars_of(body), "length": 0.5 * body.length}) for _ in range(2))
    return Robot(name="halves", body=Segments(segments=halves), tendons=robot.tendons)


def vars_of(body: PlainRod) -> dict:
    names = ("radius", "youngs_modulus", "shear_modulus", "density", "precurvature")
    return {name: getattr(body, name) for name in names}


BOTH = pytest.mark.parametrize("form", [lambda robot: robot, general], ids=["fast", "general"])


@BOTH
@pytest.mark.parametrize("tau", [1.0, 20.0])
def test_two_tendons_in_opposition(form, tau):
    robot = form(rod(Tendon.constant(x=2e-3, y=1e-3), Tendon.constant(x=-2e-3, y=-1e-3)))
    tip = solve(robot, tau, accuracy=1e-11).tip
    np.testing.assert_allclose(tip, bench.opposed_tendons(0.2, robot.section.Kse[2], tau), rtol=0, atol=1e-11)


@BOTH
@pytest.mark.parametrize("end", [0.05, 0.1, 0.17])
def test_a_tendon_that_ends_half_way(form, end):
    robot = form(rod(Tendon.constant(x=1.5e-3, y=0.0, end=end)))
    section = robot.section
    exact = bench.half_way_tendon(0.2, section.Kbt[1], section.Kse[2], 1.5e-3, 6.0, end)
    tip = solve(robot, 6.0, accuracy=1e-11).tip
    assert farthest(np.abs(tip), np.abs(exact)) < 1e-10
    assert tip[0] > 0.0


@BOTH
@pytest.mark.parametrize("turns", [0.0, 0.4, 1.0, -2.0])
def test_helical_routing_is_an_exact_helix_in_the_tendon_s_frame(form, turns):
    angle, offset, tau = 0.7, 2e-3, 5.0
    robot = form(rod(Tendon.helical(offset=offset, angle=angle, turns=turns)))
    section = robot.section
    tip, R = bench.helical_tendon(0.2, section.Kse, section.Kbt, offset, angle, 2 * np.pi * turns / 0.2, tau)
    shape = solve(robot, tau, accuracy=1e-10)
    assert farthest(shape.tip, tip) < 1e-10
    assert np.abs(shape.at([0.2]).rotation[0] - R).max() < 1e-6


@pytest.mark.parametrize(("turns", "tip"), [(0.0, (0.182212, 0.0, 0.453229)), (1.0, (0.0122099, 0.0581888, 0.493348))])
def test_straight_and_helical_routing_of_rucker_and_webster(turns, tip):
    """physics.md, section 2: 15 N on tendon 1, own weight, by the general driver."""
    load = {"gravity": (9.81, 0.0, 0.0), "loads": [PointLoad()], "accuracy": 1e-8}
    shape = solve(four_tendon_rod(turns), (15.0, 0.0, 0.0, 0.0), **load)
    np.testing.assert_allclose(shape.tip, tip, rtol=0, atol=6e-7)
    assert farthest(shape.tip, solve(four_tendon_rod(turns), (15.0, 0, 0, 0), gravity=(9.81, 0, 0)).tip) < 2e-6


@pytest.mark.parametrize("load", [0.97, 1.03])
def test_a_heavy_column_buckles_at_greenhill_s_height(load):
    robot = rod(length=0.2)
    Kse, Kbt = robot.section.Kse, robot.section.Kbt
    q = load * folds.heavy_column_load(Kbt[0], 0.2, Kse[2], Kse[0])
    gravity = (0.0, 0.0, -q / robot.section.line_density)
    assert solve(robot, (), gravity=gravity, loads=[PointLoad()]).stable is (load < 1.0)


def test_the_fold_of_a_turned_compression():
    """Stable up to the fold: followed in steps from the buckled state, the tip is that of the elliptic functions."""
    load = 2.0 * folds.EULER
    body = PlainRod(
        length=1.0, area=1.0, ix=1e-8, iy=1e-10, j=1e-8, youngs_modulus=1e10, shear_modulus=1e10, density=0.0
    )
    robot, shape = Robot(name="strip", body=body), None
    shape = solve(robot, (), loads=[PointLoad(force=(0.05, 0.0, -load))])
    assert shape.converged
    fold = folds.fold(load).alpha
    for share in (0.0, 0.3, 0.6, 0.9):
        alpha = share * fold
        force = (-load * np.sin(alpha), 0.0, -load * np.cos(alpha))
        shape = solve(robot, (), loads=[PointLoad(force=force)], start=shape, accuracy=1e-8)
        exact = folds.stable_branch(load, alpha)
        np.testing.assert_allclose(shape.tip, [exact.y, 0.0, exact.x], rtol=0, atol=1e-6)
        assert shape.stable is True


def test_a_cone_buckles_between_its_ends():
    """Clamped at the thick end: between Euler's load of the thinnest and of the thickest section."""
    body = TaperedRod(
        length=0.2, base_radius=0.8e-3, tip_radius=0.4e-3, youngs_modulus=200e9, shear_modulus=80e9, density=0.0
    )
    robot = Robot(name="cone", body=body)
    EI = 200e9 * np.pi / 4 * np.array([0.4e-3, 0.8e-3]) ** 4
    low, high = folds.EULER * EI / 0.04
    stable = [solve(robot, (), loads=[PointLoad(force=(0.0, 0.0, -F))]).stable for F in (low, high)]
    assert stable == [True, False]
    critical = cone_load()
    near = [solve(robot, (), loads=[PointLoad(force=(0, 0, -f * critical))]).stable for f in (0.995, 1.005)]
    assert near == [True, False]


def cone_load() -> float:
    """Buckling load of the cone above: EI = EI_tip z^4, z from 1 at the tip to 2 at the clamp.

    EI w'' + P w = 0 with w measured from the tip: w = z (A cos(k / z) + B sin(k / z)), w(1) = 0, w'(2) = 0.
    """

    def slope(k):
        f = lambda z: z * np.sin(k / z - k)  # noqa: E731 - zero at z = 1
        return (f(2.0 + 1e-5) - f(2.0 - 1e-5)) / 2e-5

    k = float(brentq(slope, 2.2, 5.0))  # type: ignore[arg-type]
    EI_tip, a = 200e9 * np.pi / 4 * 0.4e-3**4, 0.2  # metres per unit of z
    return k * k * EI_tip / a**2
