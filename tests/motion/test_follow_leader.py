"""Follow-the-leader planning: the paper's case, optimality by an independent reckoning, bad input by name.

Gravity acts along -x where nothing else is said; P1 is exonav-1 with the paper's torsion.
"""

from functools import cache

import numpy as np
import pytest
from scipy.spatial import KDTree

from leader_distance import Leader
from tendonrod import InvalidInput, Robot, Tendon, solve
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.motion.plan import Plan
from textbook import GRAVITY, PROTOTYPES, helix_rod, prototype, rod

DOWN, NONE = tuple(GRAVITY.tolist()), (0.0, 0.0, 0.0)
SIX_WAYS = [tuple(9.81 * sign * axis) for axis in np.eye(3) for sign in (-1, 1)]
NUMBERS = range(1, len(PROTOTYPES) + 1)


@cache
def plan(freedom="tension", gravity=DOWN, steps=20, target=0.7, number=1, torsion="published", **more) -> Plan:
    return plan_follow_leader(prototype(number, torsion), target, gravity, steps, freedom, **more)


@cache
def leader(gravity=DOWN, target=0.7) -> Leader:
    return Leader(prototype(1), target, gravity)


# ---- the paper's case (physics.md, section 3) ----


def test_tensions_of_the_papers_case():
    """Printed with three digits; the first was found with few sections of a body of 4 mm, hence its wider margin."""
    printed = {0.05: 0.670, 0.2: 0.674, 0.4: 0.684, 0.6: 0.691, 0.8: 0.697, 1.0: 0.700}
    for eta, tension in printed.items():
        assert plan().tension[round(20 * eta) - 1] == pytest.approx(tension, abs=1.5e-3 if eta < 0.1 else 6e-4)
    assert np.all(np.diff(plan().tension) > 0)
    assert plan().tension[-1] == pytest.approx(0.7, abs=1e-6)


def test_tip_error_of_the_papers_case():
    assert plan().tip_rmse == pytest.approx(0.2e-3, rel=0.05)
    assert plan().tip_rmse <= plan().tip_rmse_at_progress < 1.05 * plan().tip_rmse


def test_rotation_cuts_the_body_error_to_a_third():
    """Printed: 0.148 to 0.051 mm at eta = 0.7 with +0.8 degrees; a mean over few samples counts the tip too much."""
    tension, full = plan(), plan("full")
    assert tension.body_rms[13] == pytest.approx(0.148e-3, rel=0.025)
    assert full.body_rms[13] == pytest.approx(0.051e-3, rel=0.025)
    assert np.degrees(full.rotation[13]) == pytest.approx(0.8, abs=0.05)
    assert full.tip_rmse < 0.35 * tension.tip_rmse


@pytest.mark.parametrize("freedom", ["tension", "full"])
@pytest.mark.parametrize(("number", "target"), [(1, 0.2), (1, 0.45), (1, 0.7), (2, 0.7), (3, 0.7), (4, 0.7)])
def test_without_gravity_tension_is_constant_and_the_error_zero(number, target, freedom):
    found = plan(freedom, NONE, 8, target, number)
    np.testing.assert_allclose(found.tension, target, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.insertion, found.progress, rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.rotation, 0.0, atol=1e-6)
    for error in (found.body_rms, found.body_max, found.tip_error, found.tip_error_at_progress):
        assert error.max() < 1e-10


# ---- optimality, reckoned independently ----

SCANNED = [(gravity, eta) for gravity in (DOWN, (0.0, -9.81, 0.0)) for eta in (0.1, 0.4, 0.7, 0.95)]


@pytest.mark.parametrize(("gravity", "eta"), SCANNED)
def test_no_tension_nearby_or_far_away_is_better(gravity, eta):
    k = round(20 * eta) - 1
    best = plan(gravity=gravity).tension[k]
    tensions = best + np.concatenate([np.linspace(-0.6, 0.6, 41), np.linspace(-0.01, 0.01, 21)])
    costs = [leader(gravity).mean_square(eta, tension) for tension in tensions]
    at_best = leader(gravity).mean_square(eta, best)
    assert at_best <= min(costs) * (1 + 1e-9)
    assert abs(tensions[np.argmin(costs)] - best) < 1e-12
    assert np.sqrt(at_best) == pytest.approx(plan(gravity=gravity).body_rms[k], rel=1e-3)


@pytest.mark.parametrize(("gravity", "eta"), SCANNED)
def test_gradient_is_zero(gravity, eta):
    """What Newton's method would still add, from central differences of the independent cost."""
    best, arm = plan(gravity=gravity).tension[round(20 * eta) - 1], 2e-3
    below, here, above = (leader(gravity).mean_square(eta, best + i * arm) for i in (-1, 0, 1))
    gradient, curvature = (above - below) / (2 * arm), (above - 2 * here + below) / arm**2
    assert curvature > 0
    assert abs(gradient / curvature) < 3e-6  # N


@pytest.mark.parametrize("eta", [0.1, 0.3, 0.7])
def test_gradient_is_zero_in_tension_and_rotation(eta):
    """Newton's step in both, scaled to 1 N and 1 rad; the insertion is matched anew for every trial."""
    found, k = plan("full"), round(20 * eta) - 1
    x, arms = np.array([found.tension[k], found.rotation[k]]), np.diag([2e-3, 2e-4])

    def cost(i, j):
        return leader().matched_mean_square(eta, *(x + i * arms[0] + j * arms[1]))

    c = {(i, j): cost(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)}
    gradient = 0.5 * np.array([c[1, 0] - c[-1, 0], c[0, 1] - c[0, -1]])
    mixed = 0.25 * (c[1, 1] - c[1, -1] - c[-1, 1] + c[-1, -1])
    hessian = np.array([
        [c[1, 0] - 2 * c[0, 0] + c[-1, 0], mixed],
        [mixed, c[0, 1] - 2 * c[0, 0] + c[0, -1]],
    ])  # fmt: skip
    assert np.all(np.linalg.eigvalsh(hessian) > 0)
    assert np.all(np.abs(np.linalg.solve(hessian, gradient) @ arms) < [1e-5, 2e-6])
    assert min(c.values()) == c[0, 0]
    assert np.sqrt(c[0, 0]) == pytest.approx(found.body_rms[k], rel=1e-3)


def test_a_slack_tendon_leaves_the_best_rotation_to_be_found():
    """Where the tendon would have to push, the tension is 0 and the rotation the best at tension 0."""
    found, down = plan("full", steps=8, target=0.02), leader(target=0.02)
    assert np.all(found.tension[:3] == 0.0)
    for k in range(3):
        eta, here, arm = found.progress[k], found.rotation[k], 2e-3
        below, middle, above = (down.matched_mean_square(eta, 0.0, here + i * arm) for i in (-1, 0, 1))
        assert abs(0.5 * (above - below) / (above - 2 * middle + below) * arm) < 1e-4  # rad


@pytest.mark.parametrize("gravity", SIX_WAYS)
def test_rotation_never_makes_it_worse(gravity):
    """Strictly so along -x. Elsewhere within 0.1 %: the matched insertion may expose more than the progress."""
    margin = 1.0 if gravity == DOWN else 1.001
    assert np.all(plan("full", gravity).body_rms <= margin * plan(gravity=gravity).body_rms)


# ---- smooth in eta ----


def test_plan_is_smooth():
    """Third differences fall with the third power of the step, as they do for a smooth function."""
    for name in ("tension", "body_rms"):
        coarse, fine = (np.abs(np.diff(getattr(plan(steps=steps), name), 3)).max() for steps in (20, 40))
        assert fine < coarse / 5
        assert coarse < 0.1 * np.ptp(getattr(plan(), name))


@pytest.mark.parametrize("freedom", ["tension", "full"])
def test_more_steps_give_the_same_values(freedom):
    coarse, fine = plan(freedom), plan(freedom, steps=40)
    np.testing.assert_allclose(fine.progress[1::2], coarse.progress, rtol=1e-15)
    np.testing.assert_allclose(fine.tension[1::2], coarse.tension, rtol=0, atol=1e-7)
    np.testing.assert_allclose(fine.rotation[1::2], coarse.rotation, rtol=0, atol=1e-7)
    np.testing.assert_allclose(fine.body_rms[1::2], coarse.body_rms, rtol=0, atol=1e-10)


# ---- insertion ----


def test_with_tension_alone_insertion_is_progress_and_nothing_turns():
    np.testing.assert_array_equal(plan().progress, np.arange(1, 21) / 20)
    np.testing.assert_array_equal(plan().insertion, plan().progress)
    np.testing.assert_array_equal(plan().rotation, np.zeros(20))


def test_insertion_is_matched_to_the_tips_foot_point():
    found, down = plan("full"), leader()
    for k in range(0, 19, 3):
        command = found.insertion[k], found.tension[k], found.rotation[k]
        assert down.foot(*command) == pytest.approx(found.progress[k] * prototype(1).length_na, abs=1e-9)
    np.testing.assert_allclose(found.insertion, found.progress, rtol=0, atol=1e-3)
    assert found.insertion.max() <= 1.0


def test_insertion_is_never_past_the_end():
    up = plan("full", (9.81, 0.0, 0.0))
    assert np.all(up.insertion[:-1] > up.progress[:-1])
    assert up.insertion[-1] <= 1.0


# ---- the paper's own search ----


def first_within(robot: Robot, eta: float, step: float, tolerance: float, samples: int) -> float:
    """Ascending tensions, nearest of the reference's samples, first body that is near enough everywhere."""
    s = np.linspace(0.0, robot.length_na, samples)
    tree = KDTree(solve(robot, 0.7, DOWN, s=s, accuracy=1e-9).position)
    body, tension = np.linspace(0.0, eta * robot.length_na, 401), 0.0
    for i in range(1000):
        tension = i * step
        points = solve(robot, tension, DOWN, insertion=eta, s=body, accuracy=1e-9).position
        if tree.query(points)[0].max() <= tolerance:
            return tension
    raise AssertionError("none found")


def test_paper_search_takes_the_first_shape_near_enough():
    found = plan("paper", steps=10)
    expected = [first_within(prototype(1), eta, 0.005, 0.5e-3, 400) for eta in found.progress]
    np.testing.assert_allclose(found.tension, expected, rtol=1e-12)
    np.testing.assert_array_equal(found.insertion, found.progress)
    np.testing.assert_array_equal(found.rotation, np.zeros(10))
    assert np.all(found.body_rms >= plan(steps=10).body_rms)


def test_paper_search_takes_its_assumptions_as_arguments():
    assumed = {"tension_step": 0.02, "tolerance": 1e-3, "reference_samples": 150}
    found = plan("paper", steps=4, **assumed)
    expected = [first_within(prototype(1), eta, 0.02, 1e-3, 150) for eta in found.progress]
    np.testing.assert_allclose(found.tension, expected, rtol=1e-12)


def test_paper_search_without_a_shape_near_enough_takes_the_closest():
    found = plan("paper", steps=4, tension_step=0.05, tolerance=1e-9)
    assert np.all(np.abs(found.tension - plan(steps=4).tension) <= 0.05)


# ---- other robots ----


def test_torsion_model_changes_the_plan():
    plans = [plan(torsion=torsion) for torsion in ("published", "open_section", "homogenized")]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(plans[i].tension - plans[j].tension).max() > 1e-4  # N
        assert abs(plans[i].tip_rmse - plans[j].tip_rmse) > 2e-5  # m


@pytest.mark.parametrize("gravity", [DOWN, (3.0, -8.0, 4.0)])
@pytest.mark.parametrize("freedom", ["tension", "full"])
def test_mirrored_robot_under_mirrored_gravity(gravity, freedom):
    right = plan(freedom, gravity, 6)
    mirrored = (gravity[0], -gravity[1], gravity[2])
    left = plan_follow_leader(prototype(1).replace(turns=-1.0), 0.7, mirrored, 6, freedom)
    np.testing.assert_allclose(left.tension, right.tension, rtol=0, atol=1e-8)
    np.testing.assert_allclose(left.rotation, -right.rotation, rtol=0, atol=1e-8)
    np.testing.assert_allclose(left.body_rms, right.body_rms, rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(left.reference.points, right.reference.points * [1, -1, 1], rtol=0, atol=1e-12)


def test_a_plain_rod_with_one_tendon_can_be_planned():
    bent = rod(Tendon.constant(x=1e-3, y=0.0))
    found = plan_follow_leader(bent, 5.0, DOWN, 4)
    assert np.all(np.isfinite(found.tension))
    assert found.tension[-1] == pytest.approx(5.0, abs=1e-5)
    still = plan_follow_leader(bent, 5.0, NONE, 4, "full")
    np.testing.assert_allclose(still.tension, 5.0, rtol=1e-6)


@pytest.mark.parametrize("freedom", ["tension", "full", "paper"])
def test_no_tension_and_no_load_is_a_straight_plan(freedom):
    """A straight rod looks the same however it is turned: the best plan does nothing."""
    for robot in (prototype(1), rod(Tendon.constant(x=1e-3, y=0.0))):
        found = plan_follow_leader(robot, 0.0, NONE, 3, freedom)
        np.testing.assert_allclose(found.tension, 0.0, atol=1e-7)
        np.testing.assert_allclose(found.rotation, 0.0, atol=1e-7)
        assert found.body_max.max() < (0.5e-3 if freedom == "paper" else 1e-10)


def test_a_tendon_that_cannot_bend_keeps_its_tension():
    """In the middle of a straight rod a tendon only presses: the cost does not tell tensions apart."""
    pressed = rod(Tendon.constant(x=0.0, y=0.0))
    np.testing.assert_allclose(plan_follow_leader(pressed, 1.0, NONE, 3).tension, 1.0, rtol=1e-3)
    assert np.all(np.isfinite(plan_follow_leader(pressed, 1.0, DOWN, 3).tension))


def test_watch_is_called_after_each_step():
    calls = []
    plan_follow_leader(prototype(1), 0.7, DOWN, 3, watch=lambda done, steps: calls.append((done, steps)))
    assert calls == [(1, 3), (2, 3), (3, 3)]


# ---- bad input ----

NAN, INF = float("nan"), float("inf")
BAD = [
    *(("target_tension", value) for value in (-0.1, NAN, INF, "0.7", None, [0.7])),
    *(("gravity", value) for value in ((0.0, 0.0, NAN), (INF, 0.0, 0.0), (0.0, 0.0), 9.81, None)),
    *(("steps", value) for value in (0, -1, 2.5, "20", None, True, 10_001)),
    *(("freedom", value) for value in ("rotation", "", None, ["full"])),
    *(("robot", value) for value in (helix_rod(), helix_rod().replace(tendons=()), "exonav-1", None)),
]
BAD_SEARCH = [
    *(("tension_step", value) for value in (0.0, -0.005, NAN, "fine")),
    *(("tolerance", value) for value in (0.0, -1e-3, INF, None)),
    *(("reference_samples", value) for value in (1, 0, 2.5, True, "400")),
]


@pytest.mark.parametrize(("name", "value"), BAD + BAD_SEARCH, ids=lambda value: str(value)[:30])
def test_bad_value_is_named(name, value):
    freedom = {"freedom": "paper"} if (name, value) in BAD_SEARCH else {}
    arguments = {"robot": prototype(1), "target_tension": 0.7, **freedom, name: value}
    with pytest.raises(InvalidInput) as caught:
        plan_follow_leader(**arguments)
    assert caught.value.field == name
    assert caught.value.allowed
    assert "\n" not in str(caught.value)
