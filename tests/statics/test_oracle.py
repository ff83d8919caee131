"""Two formulations, one answer: the package against Rucker & Webster's differential form, within 10 nm."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import rucker_webster
from tendonrod import solve
from textbook import farthest, four_tendon_rod, helix_rod, prototype


@dataclass(frozen=True)
class Case:
    robot: object
    tension: object
    loads: dict = field(default_factory=dict)


CASES = {
    "1-gravity-x": Case(prototype(1), 0.7, {"gravity": (-9.81, 0, 0)}),
    "1-open-gravity-y-insertion": Case(
        prototype(1, "open_section"), 0.35, {"gravity": (0, 9.81, 0), "insertion": 0.6, "rotation": 0.5}),
    "1-tip-force": Case(prototype(1), 0.9, {"gravity": (0, 0, -9.81), "tip_force": (2e-3, -1e-3, 1e-3)}),
    "1-open-tip-moment": Case(prototype(1, "open_section"), 0.2, {"tip_moment": (4e-5, -6e-5, 3e-5)}),
    "2-gravity-z-up": Case(prototype(2), 1.4, {"gravity": (0, 0, 9.81), "insertion": 0.85, "rotation": -1.2}),
    "2-open-all": Case(
        prototype(2, "open_section"), 0.5,
        {"gravity": (5.0, -6.0, 6.0), "tip_force": (-1e-3, 3e-3, 0), "tip_moment": (1e-5, 2e-5, -2e-5)}),
    "3-gravity": Case(prototype(3), 1.2, {"gravity": (0, -9.81, 0), "tip_force": (0, 0, -5e-3)}),
    "3-open-distributed": Case(
        prototype(3, "open_section"), 0.7,
        {"distributed_force": (0.05, 0.1, -0.1), "distributed_moment": (1e-4, -2e-4, 3e-4)}),
    "4-tip-force": Case(prototype(4), 4.0, {"gravity": (-9.81, 0, 0), "tip_force": (0.05, 0.03, 0.02)}),
    "4-open-retracted": Case(prototype(4, "open_section"), 2.0, {"gravity": (9.81, 0, 0), "insertion": 0.15}),
    "four-tendons-helical": Case(
        four_tendon_rod(1.0), (15.0, 0.0, 6.0, 3.0), {"gravity": (9.81, 0, 0), "tip_force": (0.2, -0.3, 0.1)}),
    "three-routings": Case(helix_rod(), (6.0, 3.0, 8.0), {"gravity": (0, -9.81, 0), "tip_moment": (2e-3, 0, 1e-3)}),
    "three-routings-inserted": Case(
        helix_rod(), (4.0, 6.0, 5.0), {"tip_force": (0.1, 0.05, -0.05), "insertion": 0.7, "rotation": 2.0}),
}  # fmt: skip


def oracle_of(case: Case, s: np.ndarray) -> rucker_webster.Solution:
    names = {"distributed_force": "force", "distributed_moment": "moment"}
    loads = {names.get(name, name): value for name, value in case.loads.items()}
    return rucker_webster.solve(rucker_webster.from_robot(case.robot, case.tension, **loads), s)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_formulations_agree(case):
    L = case.loads.get("insertion", 1.0) * case.robot.section.L_na
    s = L * np.array([0.0, 0.21, 0.5, 0.83, 1.0])
    oracle = oracle_of(case, s)
    shape = solve(case.robot, case.tension, **case.loads, s=s, accuracy=1e-9)
    stiffness = case.robot.section.Kbt[:2].min()
    unit = np.repeat([stiffness / L**2, stiffness / L], 3)
    assert farthest(shape.position, oracle.position) < 10e-9
    assert np.abs(shape.rotation - oracle.rotation).max() < 1e-6
    base = np.concatenate([shape.force[0], shape.moment[0]])
    assert np.abs((base - oracle.base_wrench) / unit).max() < 1e-5
    np.testing.assert_allclose(shape.u, oracle.u, rtol=0, atol=1e-5 / L)


def test_oracle_is_converged_far_below_what_it_judges():
    """A tenfold tighter tolerance moves it by less than 10 pm."""
    case = CASES["2-open-all"]
    problem = rucker_webster.from_robot(case.robot, case.tension, **case.loads)
    loose, tight = (rucker_webster.solve(replace(problem, rtol=rtol)).tip for rtol in (1e-12, 1e-13))
    assert farthest(loose, tight) < 1e-11
