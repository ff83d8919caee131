"""Rods of the textbooks: elastica, Bathe's bend, the closed circle, small deflections."""

import numpy as np
import pytest

from tendonrod import PlainRod, Robot, load_robot, solve
from textbook import farthest, rod

ELASTICA = [  # P L^2 / EI, transverse tip w/L, axial shortening (inextensible)
    (1, 0.3017207738, 0.0564332363),
    (2, 0.4934574804, 0.1606417208),
    (5, 0.7137915236, 0.3876283607),
    (10, 0.8106090249, 0.5549955978),
]
BEND = [(300, (58.77912, 22.24478, 40.19189)), (600, (47.15044, 15.68480, 53.47486))]
BEND_FILE = f"""
name = "bend of 45 degrees"
[rod]
length_mm = {100 * np.pi / 4}
area_mm2 = 1.0
ix_mm4 = {1 / 12}
iy_mm4 = {1 / 12}
j_mm4 = {1 / 6}
precurvature_per_m = [0.0, 10.0, 0.0]
[material]
youngs_modulus_gpa = 1.0e4
shear_modulus_gpa = 0.5e4
density_kg_m3 = 0.0
"""


def slender_rod() -> Robot:
    """1 m, EI = 1 N m^2; EA = GA = 1e12 N, so that stretch and shear stay below 1e-11."""
    body = PlainRod(
        length=1.0, area=1.0, ix=1e-12, iy=1e-12, j=2e-12, youngs_modulus=1e12, shear_modulus=1e12, density=0.0
    )
    return Robot(name="elastica", body=body)


@pytest.mark.parametrize(("load", "transverse", "shortening"), ELASTICA)
@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, -0.8)])
def test_elastica(load, transverse, shortening, direction):
    tip = solve(slender_rod(), (), tip_force=(*(load * np.array(direction)), 0.0), accuracy=1e-11).tip
    expected = [*(transverse * np.array(direction)), 1.0 - shortening]
    np.testing.assert_allclose(tip, expected, rtol=0, atol=6e-11)


@pytest.mark.parametrize(("load", "tip"), BEND)
def test_bathe_bend(load, tip, tmp_path):
    """Bathe & Bolourchi 1979: along z, radially x, load y; one inch there is one millimetre here, a pound a newton."""
    path = tmp_path / "bend.toml"
    path.write_text(BEND_FILE)
    along, radial, across = tip
    shape = solve(load_robot(str(path)), (), tip_force=(0.0, load, 0.0), accuracy=1e-9)
    np.testing.assert_allclose(1e3 * shape.tip, [radial, across, along], rtol=0, atol=0.51e-5)


@pytest.mark.parametrize("turns", [0.5, 1.0, -1.0, 2.0])
def test_end_moment_bends_to_a_circle(turns):
    robot, L = rod(length=0.3), 0.3
    moment = 2.0 * np.pi * turns * robot.section.Kbt[1] / L
    s = np.linspace(0.0, L, 31)
    shape = solve(robot, (), tip_moment=(0.0, moment, 0.0), s=s, accuracy=1e-9)
    radius, angle = L / (2.0 * np.pi * turns), 2.0 * np.pi * turns * s / L
    circle = radius * np.stack([1.0 - np.cos(angle), 0.0 * s, np.sin(angle)], axis=-1)
    assert farthest(shape.position, circle) < 1e-9


def test_axial_pull_stretches_by_hooke():
    robot = rod(length=0.3)
    shape = solve(robot, (), tip_force=(0.0, 0.0, 5.0), accuracy=1e-12)
    np.testing.assert_allclose(shape.tip, [0.0, 0.0, 0.3 * (1.0 + 5.0 / robot.section.Kse[2])], rtol=0, atol=1e-12)


def test_small_deflection_under_own_weight():
    """w = q L^4 / 8EI + q L^2 / 2GA (Timoshenko with GA), to first order in the load."""
    robot, L = rod(length=0.1), 0.1
    section, gravity = robot.section, 0.1
    q = section.line_density * gravity
    bending, shear = q * L**4 / (8.0 * section.Kbt[1]), q * L**2 / (2.0 * section.Kse[0])
    tip = solve(robot, (), gravity=(gravity, 0.0, 0.0), accuracy=1e-12).tip
    np.testing.assert_allclose(tip[0], bending + shear, rtol=1e-6)


def test_twisting_moment_only_twists():
    robot, L, moment = rod(length=0.2), 0.2, 1e-3
    shape = solve(robot, (), tip_moment=(0.0, 0.0, moment), accuracy=1e-10)
    angle = moment * L / robot.section.Kbt[2]
    np.testing.assert_allclose(shape.tip, [0.0, 0.0, L], rtol=0, atol=1e-10)
    np.testing.assert_allclose(shape.rotation[-1][:2, 0], [np.cos(angle), np.sin(angle)], rtol=0, atol=1e-8)
