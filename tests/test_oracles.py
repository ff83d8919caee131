"""The oracles themselves: against closed forms, published numbers, balance laws and each other, never the package."""

import numpy as np
import pytest
from scipy.integrate import quad, simpson
from scipy.optimize import brentq
from scipy.special import ellipk

import actuation_oracles as act
import fold_oracles as folds
import follower_oracles as follow
import princeton as bench
import rucker_webster
from tendonrod import NotchedTube
from textbook import PROTOTYPES, prototype

TORSIONS = ("published", "open_section")
LIFT_OFF = {  # physics.md, section 4, N; the digits beyond the published ones are these oracles'
    "published": (0.06709499, 0.13249746, 0.36412911, 1.74928109),
    "open_section": (0.06662239, 0.13100846, 0.33148061, 1.37575991),
}
FOLDS = {  # load over Euler's: alpha (rad) of the fold, tip angle, x / L, y / L
    1.5: (0.236221168388, 1.250931894222, 0.649437428259, 0.660352142171),
    2.0: (0.544980118672, 1.862202028818, 0.321029922745, 0.773323727150),
    3.0: (1.094594211011, 2.767321926116, -0.109452357631, 0.636470146960),
    5.0: (1.810226451444, 3.914932678275, -0.261159977710, 0.184765271348),
}


def p1(torsion: str = "published") -> act.Rod:
    return act.rod_of(prototype(1, torsion))


def lumen(number: int) -> tuple[float, float]:
    robot = prototype(number)
    assert isinstance(robot.body, NotchedTube)
    return robot.section.r_na, robot.body.inner_radius - robot.tendons[0].radius


def planar(**more) -> act.Rod:
    return act.Rod(**{"length": 0.2, "Kse": [1e4, 1e4, 3e4], "Kbt": [3e-3, 3e-3, 2e-3], "r": [8e-4, 0, 0], **more})


# ---- local balance, displacement


@pytest.mark.parametrize("wrench", [np.zeros(6), np.array([0.3, -0.2, 0.5, 1e-4, -2e-4, 1e-4])])
def test_a_section_carries_its_wrench(wrench):
    rod, n, m = p1(), wrench[:3], wrench[3:]
    state = act.local(rod, 0.9, n, m)
    assert np.abs(rod.Kse * (state.v - rod.v_star) + 0.9 * state.t - n).max() < 1e-11
    assert np.abs(rod.Kbt * (state.u - rod.u_star) + np.cross(rod.r, 0.9 * state.t) - m).max() < 1e-16
    assert np.abs(state.q * state.t - state.v - np.cross(state.u, rod.r)).max() < 1e-15
    near = [act.local(rod, 0.9 + h, n, m) for h in (1e-5, -1e-5)]
    assert state.dq == pytest.approx((near[0].q - near[1].q) / 2e-5, rel=1e-8)
    assert state.dt == pytest.approx((near[0].t - near[1].t) / 2e-5, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(
    ("torsion", "tau", "tip"),
    [
        ("published", 0.7, (-0.16690, 21.97105, 66.55789)),
        ("published", 1.5, (5.80154, 30.41593, 50.00918)),
        ("open_section", 0.7, (-0.33623, 22.86280, 66.02597)),
    ],
)
def test_the_unloaded_robot_has_its_published_tip(torsion, tau, tip):
    assert 1e3 * act.tip(p1(torsion), tau) == pytest.approx(tip, abs=6e-6)


@pytest.mark.parametrize("elastic", [(np.inf, 0.0), (589.0, 0.3)])
@pytest.mark.parametrize("number", range(1, len(PROTOTYPES) + 1))
def test_displacement_and_tension_are_inverse(number, elastic):
    rod = act.rod_of(prototype(number))
    for tau in (1e-3, 0.2, 0.7, 1.5):
        d = act.displacement(rod, tau, *elastic)
        assert act.tension(rod, d, *elastic) == pytest.approx(tau, rel=1e-13, abs=0.0)
    assert act.tension(rod, -1e-4, *elastic) == 0.0


def test_compliance_is_the_published_one():
    assert -1e3 * p1().length * act.local(p1(), 0.7).dq == pytest.approx(2.79, abs=5e-3)  # physics.md, section 5


def test_displacement_of_a_straight_rod_in_closed_form():
    rod, tau = planar(), 0.8
    shorter = rod.length * tau * (1 / rod.Kse[2] + rod.r[0] ** 2 / rod.Kbt[1])
    assert act.displacement(rod, tau) == pytest.approx(shorter, rel=1e-12)
    assert act.displacement(rod, tau, 500.0, 0.1) == pytest.approx(shorter + tau * 0.3 / 500.0, rel=1e-12)


# ---- friction


@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_friction_on_a_straight_rod_in_closed_form(mu):
    """t stays (0, 0, 1), so Theta' = X tau / EI: tau = tau0 / (1 + mu tau0 X s / EI), Theta the bending angle."""
    rod, tau0 = planar(), 4.0
    k = mu * tau0 * rod.r[0] / rod.Kbt[1]
    found = act.rubbed(rod, tau0, mu)
    tau = lambda s: tau0 / (1.0 + k * s)  # noqa: E731
    angle = lambda s: np.log1p(k * s) / mu  # noqa: E731
    x = quad(lambda s: (1 - tau(s) / rod.Kse[2]) * np.sin(angle(s)), 0.0, rod.length, epsabs=1e-14)[0]
    z = quad(lambda s: (1 - tau(s) / rod.Kse[2]) * np.cos(angle(s)), 0.0, rod.length, epsabs=1e-14)[0]
    assert found.bending == pytest.approx(angle(rod.length), rel=1e-11)
    assert found.tip == pytest.approx((x, 0.0, z), abs=1e-12)
    pull = tau0 * np.log1p(k * rod.length) / k
    shorter = pull * (1 / rod.Kse[2] + rod.r[0] ** 2 / rod.Kbt[1])
    assert found.displacement(500.0, 0.1) == pytest.approx(shorter + (pull + 0.1 * tau0) / 500.0, rel=1e-11)


def test_bending_angle_of_the_first_prototype():
    free = act.rubbed(p1(), 0.7, 0.0)
    assert free.tip == pytest.approx(act.tip(p1(), 0.7), abs=1e-13)
    assert free.bending == pytest.approx(2.0, abs=0.01)  # physics.md, section 4
    assert np.exp(-0.1 * free.bending) == pytest.approx(0.82, abs=5e-3)
    assert np.exp(-0.2 * free.bending) == pytest.approx(0.67, abs=5e-3)
    # what arrives when the shape is the rubbed one, which is bent less
    assert act.rubbed(p1(), 0.7, 0.1).tau(p1().length) / 0.7 == pytest.approx(0.834197698395, abs=1e-10)
    assert act.rubbed(p1(), 0.7, 0.2).tau(p1().length) / 0.7 == pytest.approx(0.717705906607, abs=1e-10)


@pytest.mark.parametrize("torsion", TORSIONS)
def test_friction_by_quadrature_and_by_what_the_tendon_does_in_space(torsion):
    rod, mu = p1(torsion), 0.2
    found = act.rubbed(rod, 0.7, mu)
    end = found.tau(rod.length)
    travelled = quad(
        lambda tau: 1 / act.slip_rate(act.local(rod, tau), tau, mu, 1)[0], 0.7, end, epsabs=1e-15, epsrel=1e-13
    )[0]
    assert travelled == pytest.approx(rod.length, rel=1e-11)
    s, h = 0.6 * rod.length, 1e-4 * rod.length

    def tangent(at):
        return found.at(at)[6:].reshape(3, 3) @ act.local(rod, found.tau(at)).t

    turn = np.linalg.norm(tangent(s + h) - tangent(s - h)) / (2 * h)
    drop = (found.tau(s + h) - found.tau(s - h)) / (2 * h)
    assert drop == pytest.approx(-mu * turn * found.tau(s), rel=1e-7)


def test_hysteresis_obeys_the_clip():
    rod, mu = p1(), 0.1
    pulled = act.rubbed(rod, 0.7, mu)
    released = act.rubbed(rod, 0.62, mu, pulled)
    again = act.rubbed(rod, 0.66, mu, released)
    assert pulled.modes == (act.SLIP_IN,)
    assert released.modes == (act.SLIP_OUT, act.STUCK)
    assert again.modes == (act.SLIP_IN, act.STUCK)
    for new, old in ((released, pulled), (again, released)):
        for s in np.linspace(0.0, rod.length, 41):
            bound = np.exp(mu * new.at(s)[0])
            assert new.tau(s) == pytest.approx(np.clip(old.tau(s), new.tau0 / bound, new.tau0 * bound), abs=1e-11)
    assert act.rubbed(rod, 0.8, mu, again).tip == pytest.approx(act.rubbed(rod, 0.8, mu).tip, abs=1e-13)
    assert released.tip == pytest.approx((-0.86452923e-3, 21.28151654e-3, 67.6266719e-3), abs=1e-11)
    low = act.rubbed(rod, 0.4, mu, pulled)  # all of it slips out
    assert low.modes == (act.SLIP_OUT,)
    assert low.displacement() > act.displacement(rod, 0.4)  # tendon still further in than without friction


def test_friction_under_displacement():
    rod, elastic = planar(), (500.0, 0.1)
    pulled = act.rubbed(rod, 2.0, 0.3)
    released = act.rubbed(rod, 1.7, 0.3, pulled)
    assert act.rubbed_to(rod, pulled.displacement(*elastic), 0.3, None, *elastic).tau0 == pytest.approx(2.0, rel=1e-11)
    assert act.rubbed_to(rod, released.displacement(), 0.3, pulled).tau0 == pytest.approx(1.7, rel=1e-11)


# ---- true arm


@pytest.mark.parametrize("torsion", TORSIONS)
@pytest.mark.parametrize("number", range(1, len(PROTOTYPES) + 1))
def test_the_free_tendon_goes_from_the_axis_to_the_wall(number, torsion):
    rod, (centre, radius) = act.rod_of(prototype(number, torsion)), lumen(number)
    threshold = act.lift_off_tension(rod, centre, radius)
    assert threshold == pytest.approx(LIFT_OFF[torsion][number - 1], abs=2e-8)
    assert act.free_arm(rod, 1e-9 * threshold, centre, radius).r == pytest.approx((centre, 0.0, 0.0), abs=1e-11)
    just_below = act.free_arm(rod, threshold * (1 - 1e-9), centre, radius)
    above = act.free_arm(rod, 1.2 * threshold, centre, radius)
    assert not just_below.on_wall
    assert just_below.r[0] == pytest.approx(centre + radius, abs=1e-10)
    assert above.on_wall
    assert above.r == pytest.approx((centre + radius, 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("torsion", TORSIONS)
def test_the_free_tendon_is_straight_and_of_least_energy(torsion):
    """Inside the lumen nothing turns the tendon: it is the screw axis, t parallel to u, which leaves two equations."""
    rod, (centre, radius) = p1(torsion), lumen(1)
    tau = 0.05
    arm = act.free_arm(rod, tau, centre, radius)
    X, state = arm.r[0], arm.state
    assert state.t == pytest.approx(state.u / np.linalg.norm(state.u), abs=1e-13)
    u = np.array([0.0, tau * X * state.t[2] / rod.Kbt[1], rod.u_star[2] - tau * X * state.t[1] / rod.Kbt[2]])
    v = rod.v_star - tau * state.t / rod.Kse
    assert (v[2] * u[1] - v[1] * u[2]) / (u @ u) == pytest.approx(X, abs=1e-15)
    least = act.energy(rod, tau, state.v, state.u, arm.r)
    rng = np.random.default_rng(3)
    for size in (1e-3, 1e-1):
        for _ in range(200):
            dv, du, dr = size * rng.normal(size=(3, 3)) * [[1e-3], [50.0], [1e-4]]
            assert act.energy(rod, tau, state.v + dv, state.u + du, arm.r + dr * [1, 1, 0]) > least


# ---- loads that turn with the section, dead loads, point loads


@pytest.mark.parametrize("load", [0.5, 2.0, 5.0, 13.0, 20.0])
def test_follower_forces_have_their_plane_solutions(load):
    rod = act.Rod(length=1.0, Kse=[1e10] * 3, Kbt=[1.0] * 3)
    cases = (
        (
            follow.transverse_follower(load),
            follow.Loads(points=(follow.PointLoad(s=1.0, force=np.array([load, 0, 0])),)),
        ),
        (follow.pressure(load), follow.Loads(body_force=[load, 0.0, 0.0])),
    )
    for plane, loads in cases:
        found = follow.solve(rod, loads)
        assert found.tip == pytest.approx((plane.y, 0.0, plane.x), abs=2e-8)
        x_axis = found.rotation[-1][:, 2]
        assert (x_axis[0], x_axis[2]) == pytest.approx((np.sin(plane.angle), np.cos(plane.angle)), abs=2e-8)


def test_the_tip_turns_by_pi_under_a_transverse_follower():
    assert 4.0 * ellipk(0.5) ** 2 == pytest.approx(13.750371636, abs=1e-9)
    assert follow.transverse_follower(4.0 * ellipk(0.5) ** 2).angle == pytest.approx(np.pi, abs=1e-7)
    small = follow.transverse_follower(1e-4)
    assert small.y == pytest.approx(1e-4 / 3.0, rel=1e-7)
    assert follow.pressure(1e-4).y == pytest.approx(1e-4 / 8.0, rel=1e-7)


def test_follower_forces_reach_the_base():
    """Sum of forces and moments over the deformed rod, by quadrature in the world frame."""
    rod, s = p1(), np.linspace(0.0, p1().length, 801)
    point = follow.PointLoad(s=s[300], force=np.array([2e-3, 1e-3, -1e-3]), moment=np.array([1e-5, -2e-5, 1e-5]))
    loads = follow.Loads(body_force=[0.05, -0.1, 0.02], body_moment=[1e-4, 2e-4, -1e-4], points=(point,))
    found = follow.solve(rod, loads, 0.5, s)
    f, turn = found.rotation @ loads.body_force, found.rotation[300]
    moment = np.cross(found.position - rod.p0, f) + found.rotation @ loads.body_moment
    N = simpson(f, x=s, axis=0) + turn @ point.force
    M = simpson(moment, x=s, axis=0) + turn @ point.moment + np.cross(found.position[300] - rod.p0, turn @ point.force)
    assert found.force[0] == pytest.approx(N, abs=1e-11)
    assert found.moment[0] == pytest.approx(M, abs=1e-12)
    assert found.rotation[0] == pytest.approx(np.eye(3), abs=1e-13)


def test_a_follower_half_way_leaves_the_rest_straight():
    rod, load = act.Rod(length=1.0, Kse=[1e10] * 3, Kbt=[1.0] * 3), 12.0
    half = follow.transverse_follower(0.25 * load)
    found = follow.solve(rod, follow.Loads(points=(follow.PointLoad(s=0.5, force=np.array([load, 0, 0])),)))
    end = 0.5 * np.array([half.y + np.sin(half.angle), 0.0, half.x + np.cos(half.angle)])
    assert found.tip == pytest.approx(end, abs=2e-8)


def test_dead_loads_agree_with_rucker_and_webster():
    robot, force, moment = prototype(1), np.array([2e-3, -1e-3, 1e-3]), np.array([1e-5, 2e-5, -2e-5])
    problem = rucker_webster.from_robot(robot, 0.9, gravity=(0, 0, -9.81), tip_force=force, tip_moment=moment)
    weight = robot.section.line_density * np.array([0.0, 0.0, -9.81])
    point = follow.PointLoad(s=robot.section.L_na, force=force, moment=moment, follows=False)
    found = follow.solve(p1(), follow.Loads(dead_force=weight, points=(point,)), 0.9, steps=1)
    assert found.tip == pytest.approx(rucker_webster.solve(problem).tip, abs=1e-12)


# ---- folds and buckling


@pytest.mark.parametrize("ratio", sorted(FOLDS))
def test_the_fold_by_elliptic_functions_and_by_shooting(ratio):
    load = ratio * folds.EULER
    found = folds.fold(load)
    again = folds.fold_by_shooting(load, 2.0 * np.arcsin(found.modulus))
    for each in (found, again):
        assert (each.alpha, each.tip_angle, each.x, each.y) == pytest.approx(FOLDS[ratio], abs=2e-12)
    p = np.linspace(1e-3, folds.buckled(load).modulus, 400)
    assert max(folds.elastica(load, each).alpha for each in p) <= found.alpha
    assert folds.stable_branch(load, 0.5 * found.alpha).modulus > found.modulus


@pytest.mark.parametrize(
    ("load", "across", "shorter"), [(1, 0.3017207738, 0.0564332363), (10, 0.8106090249, 0.5549955978)]
)
def test_the_elastica_of_the_textbooks(load, across, shorter):
    """A transverse dead force is alpha = -pi/2 (physics.md, section 2)."""
    p = brentq(lambda x: folds.elastica(load, x).alpha + 0.5 * np.pi, np.sqrt(0.5), 1 - 1e-12, xtol=1e-15)
    found = folds.elastica(load, p)
    assert (found.y, 1.0 - found.x) == pytest.approx((across, shorter), abs=1e-10)


def test_buckling_loads():
    assert folds.greenhill_load() == pytest.approx(7.837347438943, abs=1e-12)
    assert folds.heavy_column_load(2.0, 0.5) == pytest.approx(16.0 * folds.greenhill_load(), rel=1e-11)
    assert folds.euler_load(2.0, 0.5) == pytest.approx(8.0 * folds.EULER, rel=1e-15)
    assert folds.buckled(1.0001 * folds.EULER).tip_angle < 0.03


def test_buckling_with_extension_and_shear_is_that_of_the_whole_theory():
    """The tip a little turned, dead compression on it: at the critical load the base stays upright."""
    rod = act.Rod(length=1.0, Kse=[50.0, 50.0, 100.0], Kbt=[1.0] * 3)
    small = act.helix(rod, np.zeros(3), np.array([0.0, 1e-4, 0.0]), 1.0)[:3, :3]
    critical = folds.euler_load(1.0, 1.0, EA=100.0, GA=50.0)
    push = follow.PointLoad(s=1.0, force=np.array([0.0, 0.0, -critical]), follows=False)
    column = follow.Loads(dead_force=[0.0, 0.0, -folds.heavy_column_load(1.0, 1.0, EA=100.0, GA=50.0)])
    for loads in (follow.Loads(points=(push,)), column):
        base = follow.from_tip(rod, 0.0, loads, small, np.zeros(1))[0, 3:12].reshape(3, 3)
        assert abs(base[0, 2]) < 1e-11


# ---- Princeton beam, closed forms


@pytest.mark.parametrize("weight", sorted(bench.ANSYS))
def test_princeton_beam_against_ansys(weight):
    for angle, chord, flap in zip(bench.ANSYS_ANGLES, *bench.ANSYS[weight], strict=True):
        found = bench.princeton(weight, np.radians(angle))
        assert 1e3 * found.chord == pytest.approx(chord, rel=1.3e-2, abs=1e-6)
        assert 1e3 * found.flap == pytest.approx(flap, rel=2.5e-3, abs=1e-6)


def test_princeton_beam_by_collocation_and_from_the_tip():
    bar, angle = bench.Bar(), np.radians(45.0)
    point = follow.PointLoad(s=bar.length, force=bench.weight_force(13.345, angle), follows=False)
    found = follow.solve(bar.rod, follow.Loads(points=(point,)))
    other = bench.tip_motion(found.tip, found.rotation[-1], bar.length)
    assert vars(bench.princeton(13.345, angle)) == pytest.approx(vars(other), abs=1e-11)
    assert (other.flap, other.chord) == pytest.approx((0.15658714241, 0.01534140048), abs=1e-11)
    assert (other.axial, other.twist) == pytest.approx((-0.03036087649, -0.06081941864), abs=1e-11)


def test_closed_forms_without_load_agree_with_rucker_and_webster():
    rod, Tendon = {"length": 0.2, "Kse": [2e4, 2e4, 5e4], "Kbt": [4e-3, 4e-3, 3e-3]}, rucker_webster.Tendon

    def tip(*tendons, tension):
        return rucker_webster.solve(rucker_webster.Problem(**rod, tendons=tendons, tension=tension)).tip

    opposed = tip(Tendon(cx=1e-3), Tendon(cx=-1e-3), tension=(5.0, 5.0))
    assert bench.opposed_tendons(0.2, 5e4, 5.0) == pytest.approx(opposed, abs=1e-13)
    half = tip(Tendon(cx=1e-3, end=0.12), tension=(5.0,))
    assert bench.half_way_tendon(0.2, 4e-3, 5e4, 1e-3, 5.0, 0.12) == pytest.approx(half, abs=1e-12)
    wound = tip(Tendon(rho=2e-3, angle=0.4, omega=30.0), tension=(4.0,))
    found, R = bench.helical_tendon(0.2, rod["Kse"], rod["Kbt"], 2e-3, 0.4, 30.0, 4.0)
    assert found == pytest.approx(wound, abs=1e-12)
    assert pytest.approx(np.eye(3), abs=1e-14) == R @ R.T


def test_an_end_moment_closes_the_circle():
    s = np.linspace(0.0, 0.3, 7)
    circle = bench.end_moment(0.3, 2e-3, 2.0 * np.pi * 2e-3 / 0.3, s)
    assert circle[-1] == pytest.approx(np.zeros(3), abs=1e-16)
    assert circle[3] == pytest.approx((0.3 / np.pi, 0.0, 0.0), abs=1e-16)
    rod = act.Rod(length=0.3, Kse=[1e4] * 3, Kbt=[2e-3] * 3)
    push = follow.PointLoad(s=0.3, moment=np.array([0.0, 2.0 * np.pi * 2e-3 / 0.3, 0.0]))
    assert follow.solve(rod, follow.Loads(points=(push,)), s=s).position == pytest.approx(circle, abs=1e-12)
