"""Profiles: values and slopes against the plan, the paper's numbers and finite differences; the tendon paid out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendonrod import load_robot, solve
from tendonrod.errors import InvalidInput
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.rig.commandfile import read_commands
from tendonrod.rig.payout import compliances, paid_out, shortening, tendon_compliance
from tendonrod.rig.profiles import EVEN, NAMES, Cubics, Polynomial, Profile, profile
from tendonrod.rig.virtual.mechanics import TableMechanics
from virtual_setups import ideal

ROBOT, DOWN = load_robot("exonav-1"), (-9.81, 0.0, 0.0)


@pytest.fixture(scope="module")
def plan():
    return plan_follow_leader(ROBOT, 0.7, DOWN, steps=10)


@pytest.mark.parametrize("name", NAMES)
def test_slopes_are_those_of_the_values(name, plan):
    found = profile(name, ROBOT, 0.7, DOWN, plan)
    for function in (found.tension, found.rotation, found.paid_out):
        for x in (0.13, 0.37, 0.77, 0.99):
            slope = (function.value(x + 1e-6) - function.value(x - 1e-6)) / 2e-6
            assert function.slope(x) == pytest.approx(slope, abs=1e-6)


def test_the_plan_is_met_at_its_steps_and_held_before_them(plan):
    found = profile("plan", ROBOT, 0.7, DOWN, plan)
    assert [found.tension.value(x) for x in plan.insertion.tolist()] == pytest.approx(plan.tension, abs=1e-12)
    assert found.tension.value(0.0) == found.tension.value(0.1) == pytest.approx(plan.tension[0])
    assert found.tension.slope(0.01) == 0.0
    assert found.rotation.value(0.4) == 0.0


def test_the_quadratic_is_the_plans_own_fit(plan):
    found = profile("polynomial", ROBOT, 0.7, DOWN, plan).tension
    assert [found.value(x) for x in (0.0, 0.4, 1.0)] == pytest.approx(np.polyval(plan.polynomial(2), [0.0, 0.4, 1.0]))


def test_the_papers_quadratic_at_its_ends():
    found = profile("paper", ROBOT).tension
    assert found.value(0.0) == 0.6088
    assert found.value(1.0) == pytest.approx(0.7421)
    assert found.slope(0.5) == pytest.approx(0.6492 - 0.5159)


def test_a_plans_file_gives_the_same_profile(plan, tmp_path):
    file = plan.write(tmp_path / "plan.csv")
    a, b = profile("plan", ROBOT, plan=plan, gravity=DOWN), profile("plan", ROBOT, plan=file, gravity=DOWN)
    for x in (0.05, 0.3, 0.95):
        assert a.tension.value(x) == b.tension.value(x)
        assert a.pay_rate(x) == b.pay_rate(x)


def test_a_file_for_another_robot_is_refused(plan, tmp_path):
    file = plan.write(tmp_path / "plan.csv")
    with pytest.raises(InvalidInput, match=rf"plan = .*plan\.csv, made for {ROBOT.name}: must be a plan for exonav-3"):
        profile("plan", load_robot("exonav-3"), plan=file)
    old = "".join(line for line in file.read_text().splitlines(keepends=True) if not line.startswith("#"))
    file.write_text(old)
    assert profile("plan", ROBOT, plan=file, gravity=DOWN).tension.value(0.5) > 0.0
    assert read_commands(file).origin is None


def test_a_plan_with_rotation_hands_it_on():
    turned = plan_follow_leader(ROBOT, 0.7, DOWN, steps=4, freedom="full")
    found = profile("plan", ROBOT, 0.7, DOWN, turned)
    values = [found.rotation.value(x) for x in turned.insertion.tolist()]
    assert values == pytest.approx(turned.rotation, abs=1e-12)
    assert max(map(abs, values)) > 1e-3


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=12))
def test_cubics_stay_between_their_points(values):
    x = np.linspace(0.0, 1.0, len(values))
    cubics = Cubics(x, values)
    for k in range(len(values) - 1):
        low, high = sorted(values[k : k + 2])
        for at in np.linspace(x[k], x[k + 1], 9).tolist():
            assert low - 1e-12 <= cubics.value(at) <= high + 1e-12


def test_about_0_974_of_the_insertion_is_paid_out(plan):
    found = profile("plan", ROBOT, 0.7, DOWN, plan)
    assert [found.pay_rate(x) for x in (0.02, 0.3, 0.6, 1.0)] == pytest.approx([0.974] * 4, abs=2e-3)


def test_the_tendon_paid_out_undoes_the_pulled_length():
    """solve() pulled by displacement d = Delta + c tau gives that tension: the pulled length is z - x_t."""
    tendon = ROBOT.tendons[0]
    soft = ROBOT.replace(tendons=(type(tendon)(**vars(tendon) | {"axial_stiffness": 600.0, "free_length": 0.3}),))
    c = tendon_compliance(soft)
    assert c == pytest.approx((0.3 + soft.tendon_lengths[0]) / 600.0)
    pulled = 0.5 * soft.section.L - float(paid_out(soft, [0.5], 0.7, 0.0, DOWN, c)[0])
    shape = solve(soft, displacements=pulled, gravity=DOWN, insertion=0.5)
    assert shape.tensions[0] == pytest.approx(0.7, abs=1e-6)
    assert shortening(shape) == pytest.approx(pulled - 0.7 * c, abs=1e-9)


def test_the_axes_of_a_virtual_bench_that_move_so_find_the_profiles_tension():
    """An independent route: translation to eta L, screw to what is paid out, tension by the bench's mechanics."""
    setup = ideal(robot=ROBOT, gravity=DOWN)
    elastic = setup.tendon_length / setup.tendon_stiffness
    eta, tau = np.linspace(0.1, 1.0, 10), np.linspace(0.6, 0.7, 10)
    screw, mechanics = paid_out(ROBOT, eta, tau, 0.0, DOWN, elastic), TableMechanics(setup)
    for insertion, tension, out in zip(eta.tolist(), tau.tolist(), screw.tolist(), strict=True):
        pulled = insertion * ROBOT.section.L - out
        assert mechanics.follow(insertion, 0.0, pulled) == pytest.approx(tension, abs=2e-5)


def test_the_compliance_at_full_insertion_is_that_of_the_bench():
    free, tied = (compliances(ROBOT, [1.0], 0.7, DOWN, c)[0] for c in (0.0, 0.51e-3))
    assert free * 0.974 == pytest.approx(2.79e-3, rel=0.01)
    assert (tied - free) * 0.974 == pytest.approx(0.51e-3, rel=0.01)


def test_feed_forward_keeps_the_tension_on_the_profile(plan):
    """dx_t = pay_rate dz along the profile: the integral of the rate is what the statics say is paid out."""
    found = profile("plan", ROBOT, 0.7, DOWN, plan, compliance=0.5e-3)
    eta = np.linspace(0.2, 0.9, 701)
    rate = np.array([found.pay_rate(x) for x in eta.tolist()])
    tension = [found.tension.value(x) for x in (0.2, 0.9)]
    exact = np.diff(paid_out(ROBOT, [0.2, 0.9], tension, 0.0, DOWN, 0.5e-3))[0]
    assert np.trapezoid(rate, eta) * ROBOT.section.L == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: profile("best", ROBOT), "profile"),
        (lambda: Profile(name="x", tension=Polynomial((1.0, -0.5))), "tension of the profile"),
        (lambda: Cubics([0.1, 0.1], [1.0, 2.0]), "insertion"),
        (lambda: Cubics([0.1, 0.2], [1.0, np.nan]), "profile"),
        (lambda: Polynomial((np.inf,)), "polynomial[0]"),
    ],
)
def test_bad_profiles_are_refused_by_name(make, field):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.field == field


def test_an_even_pay_out_is_one_to_one():
    assert Profile(name="x", tension=Polynomial((0.7,))).pay_rate(0.4) == EVEN.slope(0.4) == 1.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty"),
        ("insertion\n0.1\n", "column tension_N"),
        ("insertion,tension_N\n0.1,x\n", "row 1, column tension_N"),
        ("insertion,tension_N\n1.1,0\n", "row 1, column insertion"),
        ("insertion,tension_N\n0.1\n", "row 1, column tension_N = missing"),
        ("insertion,tension_N,tension_N\n0.1,1,1\n", "given twice"),
        ("insertion,tension_N,rotation_deg,rotation_rad\n0.1,1,1,1\n", "one of the two"),
    ],
)
def test_bad_files_are_refused_by_row_and_column(tmp_path, text, said):
    file = tmp_path / "motion.csv"
    file.write_text(text)
    with pytest.raises(InvalidInput) as caught:
        read_commands(file)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_are_read_in_si(tmp_path):
    file = tmp_path / "motion.csv"
    file.write_text("time_s,insertion,Tension_N,rotation_deg,note\n0,0.1,0.3,180,a\n\n2.5,0.2,0.4,-90,b\n")
    found = read_commands(file)
    assert (found.time, found.insertion, found.tension) == ([0.0, 2.5], [0.1, 0.2], [0.3, 0.4])
    assert found.rotation == pytest.approx([np.pi, -np.pi / 2])
