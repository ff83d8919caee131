"""The tables of physics.md section 2, to the digits printed there, for the package and for the oracle."""

import numpy as np
import pytest

import rucker_webster
from tendonrod import Tendon, solve
from textbook import GRAVITY, four_tendon_rod, prototype, rod

LAST_DIGIT = 0.5e-5 * 1e-3 * 1.001  # half a unit of the fifth decimal of a millimetre

TIPS = [  # prototype, tension, gravity, tip by published torsion, tip by open section; mm
    (1, 0.7, False, (-0.16690, 21.97105, 66.55789), (-0.33623, 22.86280, 66.02597)),
    (1, 0.2, False, (-0.46435, 7.48258, 74.34330), (-0.46504, 7.60151, 74.32406)),
    (1, 1.5, False, (5.80154, 30.41593, 50.00918), (4.66748, 30.69183, 48.51382)),
    (3, 0.7, False, (-0.80859, 8.74223, 61.25737), (-0.70293, 10.12380, 60.91831)),
    (1, 0.7, True, (-1.14080, 21.75197, 66.56249), (-1.54675, 22.49294, 66.07358)),
    (1, 0.2, True, (-1.69335, 7.17254, 74.33657), (-1.72276, 7.26892, 74.31945)),
]
CASES = [
    pytest.param(
        number, torsion, tension, heavy * GRAVITY, np.array(tip) * 1e-3, id=f"{number}-{torsion}-{tension}-{heavy}"
    )
    for number, tension, heavy, *tips in TIPS
    for torsion, tip in zip(("published", "open_section"), tips, strict=True)
]
each_tip = pytest.mark.parametrize(("number", "torsion", "tension", "gravity", "tip"), CASES)

SECTIONS = [  # A mm2, r_na mm, I_x mm4, I_y mm4, L_na mm, lambda g/m
    (0.0929401, 0.465141, 0.00452581, 0.000275489, 75.45662, 1.162681),
    (0.110495, 0.444772, 0.00722482, 0.000531345, 75.45177, 1.235886),
    (0.144520, 0.812951, 0.0214317, 0.00101450, 63.47585, 1.920936),
    (0.202327, 0.731698, 0.0521941, 0.00462400, 63.43681, 2.146928),
]


@pytest.mark.parametrize(("number", "row"), list(enumerate(SECTIONS, start=1)))
def test_sections(number, row):
    section = prototype(number).section
    computed = [
        1e6 * section.A, 1e3 * section.r_na, 1e12 * section.I_x, 1e12 * section.I_y, 1e3 * section.L_na,
        1e3 * section.line_density,
    ]  # fmt: skip
    np.testing.assert_allclose(computed, row, rtol=5e-6)


@each_tip
def test_tip(number, torsion, tension, gravity, tip):
    shape = solve(prototype(number, torsion), tension, gravity=gravity, accuracy=1e-9)
    assert np.abs(shape.tip - tip).max() < LAST_DIGIT


@each_tip
def test_oracle_tip(number, torsion, tension, gravity, tip):
    problem = rucker_webster.from_robot(prototype(number, torsion), tension, gravity=gravity)
    assert np.abs(rucker_webster.solve(problem).tip - tip).max() < LAST_DIGIT


@pytest.mark.parametrize(
    ("heavy", "tip"), [(True, (54.39105, 0.0, 25.11293)), (False, (54.61858, 0.0, 24.31735))], ids=["gravity", "none"]
)
def test_straight_rod_with_one_tendon(heavy, tip):
    """The line load is that of exonav-1, given to six decimals."""
    robot = rod(Tendon.constant(x=0.873e-3, y=0.0), length=75.4e-3, radius=0.1357437e-3)
    load = heavy * 1.162681e-3 * GRAVITY
    problem = rucker_webster.from_robot(robot, 0.7, force=load)
    package = solve(robot, 0.7, distributed_force=load, accuracy=1e-9).tip
    oracle = rucker_webster.solve(problem).tip
    assert np.abs(oracle - package).max() < 1e-9
    assert np.abs(package - np.array(tip) * 1e-3).max() < 3e-8  # the radius is printed to 7 digits


@pytest.mark.parametrize(("turns", "tip"), [(0.0, (0.182212, 0.0, 0.453229)), (1.0, (0.0122099, 0.0581888, 0.493348))])
def test_four_tendon_rod(turns, tip):
    robot, tensions, gravity = four_tendon_rod(turns), (15.0, 0.0, 0.0, 0.0), (9.81, 0.0, 0.0)
    shape = solve(robot, tensions, gravity=gravity, accuracy=1e-9)
    digits = 0.5 * 10.0 ** -np.array([6 if turns == 0.0 or abs(x) > 0.1 else 7 for x in tip]) * 1.001
    assert np.all(np.abs(shape.tip - tip) < digits)
    oracle = rucker_webster.solve(rucker_webster.from_robot(robot, tensions, gravity=gravity))
    assert np.all(np.abs(oracle.tip - tip) < digits)
