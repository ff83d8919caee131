"""Rods whose section or routing changes along the way, and where they leave the outer tube."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from tendonrod import InvalidInput, NotchedTube, PlainRod, Robot, Tendon, solve
from tendonrod.body import Segments, TaperedRod
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.statics.balance import balance_error
from textbook import GRAVITY, farthest, four_tendon_rod, helix_rod, prototype, rod

STEEL = {"youngs_modulus": 200e9, "shear_modulus": 80e9, "density": 8000.0}
SAMPLES = np.linspace(0.0, 0.2, 5), (-4e-3, -2.8e-3, 0.0, 2e-3, 2.5e-3), (0.0, 2.5e-3, 3.4e-3, 1.8e-3, 0.0)


def taper(*tendons: Tendon, base: float = 0.8e-3, tip: float = 0.4e-3, **more) -> Robot:
    body = TaperedRod(length=0.2, base_radius=base, tip_radius=tip, **(STEEL | more))
    return Robot(name="taper", body=body, tendons=tendons)


def cut(robot: Robot, share: float = 0.5) -> Robot:
    """The same robot, its body in two segments."""
    body = robot.body
    if isinstance(body, NotchedTube):
        parts = tuple(
            dataclasses.replace(body, length=each * body.length, turns=each * body.turns) for each in (share, 1 - share)
        )
    elif isinstance(body, TaperedRod):
        radius = float(body.outer_radius_at(share * body.length))
        inner = body.base_inner_radius + share * (body.tip_inner_radius - body.base_inner_radius)
        parts = (
            dataclasses.replace(body, length=share * body.length, tip_radius=radius, tip_inner_radius=inner),
            dataclasses.replace(body, length=(1 - share) * body.length, base_radius=radius, base_inner_radius=inner),
        )
    else:
        assert isinstance(body, PlainRod)
        parts = tuple(dataclasses.replace(body, length=each * body.length) for each in (share, 1 - share))
    return Robot(name="cut", body=Segments(segments=parts), tendons=robot.tendons)


LOADS = {
    "gravity": GRAVITY, "tip_force": (1e-3, 2e-3, -1e-3),
    "loads": [PointLoad(force=(2e-3, 0.0, 1e-3), at=0.03, frame="body")],
}  # fmt: skip


# ---- segments


@pytest.mark.parametrize(
    "robot",
    [prototype(1), prototype(3, "open_section"), helix_rod(), taper(Tendon.constant(x=2e-3, y=0.0))],
    ids=["P1", "P3", "helix", "taper"],
)
@pytest.mark.parametrize("insertion", [1.0, 0.7, 0.4])
def test_a_body_cut_in_two_is_the_whole(robot, insertion):
    """A point load of nothing where the cut is gives the whole the same nodes."""
    tensions = np.linspace(0.7, 1.5, robot.n_tendons)
    node = PointLoad(at=0.5 * robot.length_na)
    load = LOADS | {"loads": [*LOADS["loads"], node], "insertion": insertion, "steps": 40, "accuracy": 1e-11}
    whole, parts = (solve(each, tensions, **load) for each in (robot, cut(robot)))
    tolerance = 1e-11 if isinstance(robot.body, TaperedRod) else 1e-12
    assert farthest(parts.tip, whole.tip) < tolerance


@pytest.mark.parametrize("share", [0.3, 0.5, 0.77])
def test_wherever_it_is_cut(share):
    robot = prototype(1)
    whole = solve(robot, 0.7, **LOADS, accuracy=1e-9)
    assert farthest(solve(cut(robot, share), 0.7, **LOADS, accuracy=1e-9).tip, whole.tip) < 2e-9


def two_tubes(angle: float) -> Robot:
    body = Segments(segments=(prototype(1).body, prototype(3).body), angles=(angle,))
    return Robot(name="two tubes", body=body, tendons=(Tendon.opposite_backbone(radius=5e-5),))


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5])
@pytest.mark.parametrize("insertion", [1.0, 0.8, 0.3])
def test_a_joint_balances_and_the_tube_s_axis_goes_through(angle, insertion):
    robot = two_tubes(angle)
    shape = solve(robot, 0.6, gravity=GRAVITY, tip_force=(1e-3, 0.0, 1e-3), insertion=insertion, accuracy=1e-9)
    assert balance_error(shape) < 1e-6
    joint = robot.joints[0, 0] - (1.0 - insertion) * robot.length_na
    if joint <= 0.0:
        return
    beside = shape.at([joint * (1 - 1e-9), joint])
    assert farthest(*beside.centerline) < 1e-9
    assert farthest(*beside.position) == pytest.approx(np.hypot(*robot.joints[0, 1:3]), rel=1e-5)
    turned = beside.rotation[0].T @ beside.rotation[1]
    assert Rotation.from_matrix(turned).as_rotvec() == pytest.approx((0.0, 0.0, angle), abs=1e-6)
    np.testing.assert_allclose(*beside.force, atol=1e-10)
    lever = np.cross(beside.position[1] - beside.position[0], beside.force[0])
    np.testing.assert_allclose(beside.moment[0], beside.moment[1] + lever, atol=1e-11)


def test_segments_turned_against_each_other_bend_in_their_own_planes():
    """Two straight notched tubes, the second turned by 90 deg, one tendon each: what one bends the other does not."""
    body = dataclasses.replace(prototype(1).body, turns=0.0, length=0.03)
    both = Segments(segments=(body, body), angles=(0.5 * np.pi,))
    robot = Robot(name="crossed", body=both, tendons=(Tendon.opposite_backbone(radius=5e-5, end=0.03),))
    shape = solve(robot, 0.5, s=[0.0, 0.015, 0.03, 0.06])
    one = solve(Robot(name="one", body=body, tendons=(Tendon.opposite_backbone(radius=5e-5),)), 0.5)
    assert farthest(shape.at([0.03]).centerline, one.centerline[-1:]) < 1e-9
    assert np.abs(shape.centerline[:, 1]).max() < 1e-12
    straight = one.centerline[-1] + 0.03 * one.rotation[-1][:, 2]
    assert farthest(shape.centerline[-1], straight) < 1e-9


# ---- tapers


def test_a_taper_of_equal_ends_is_a_plain_rod():
    tendon = Tendon.helical(offset=2e-3, angle=0.3, turns=0.7)
    body = PlainRod(length=0.2, radius=0.5e-3, **STEEL)
    plain = Robot(name="plain", body=body, tendons=(tendon,))
    even = taper(tendon, base=0.5e-3, tip=0.5e-3)
    assert farthest(solve(even, 5.0, gravity=GRAVITY).tip, solve(plain, 5.0, gravity=GRAVITY).tip) < 1e-12


def test_small_deflection_of_a_cone():
    """w = F L^3 / (3 E I_base) r_base / r_tip of a cone under a tip force, to first order, without shear."""
    robot, F = taper(base=0.8e-3, tip=0.4e-3, shear_modulus=1e16), 1e-6
    EI = 200e9 * np.pi / 4 * 0.8e-3**4
    tip = solve(robot, (), tip_force=(F, 0.0, 0.0), accuracy=1e-12).tip
    assert tip[0] == pytest.approx(F * 0.2**3 / (3.0 * EI) * 2.0, rel=1e-7)


def test_a_hollow_taper_pulled_and_twisted():
    body = TaperedRod(
        length=0.2, base_radius=1e-3, tip_radius=0.6e-3, base_inner_radius=0.5e-3, tip_inner_radius=0.4e-3, **STEEL
    )
    robot = Robot(name="hollow", body=body)
    s = np.linspace(0.0, 0.2, 20001)
    ro, ri = 1e-3 - 2e-3 * s, 0.5e-3 - 0.5e-3 * s
    longer = np.trapezoid(20.0 / (200e9 * np.pi * (ro**2 - ri**2)), s)
    angle = np.trapezoid(1e-2 / (80e9 * 0.5 * np.pi * (ro**4 - ri**4)), s)
    shape = solve(robot, (), tip_force=(0.0, 0.0, 20.0), accuracy=1e-11)
    np.testing.assert_allclose(shape.tip, [0.0, 0.0, 0.2 + longer], rtol=0, atol=1e-10)
    twisted = solve(robot, (), tip_moment=(0.0, 0.0, 1e-2), steps=60)
    assert np.arctan2(twisted.rotation[-1, 1, 0], twisted.rotation[-1, 0, 0]) == pytest.approx(angle, rel=1e-7)


def test_a_taper_as_many_short_rods():
    """Midpoint segments: the difference falls with the square of their number."""
    tendon = Tendon.constant(x=3e-3, y=1e-3)
    exact, missed = solve(taper(tendon), 5.0, gravity=GRAVITY, accuracy=1e-9).tip, []
    for n in (10, 20):
        radius = 0.8e-3 - 0.4e-3 * (np.arange(n) + 0.5) / n
        segments = tuple(PlainRod(length=0.2 / n, radius=r, **STEEL) for r in radius)
        stairs = Robot(name="stairs", body=Segments(segments=segments), tendons=(tendon,))
        missed.append(farthest(solve(stairs, 5.0, gravity=GRAVITY, accuracy=1e-9).tip, exact))
    assert missed[1] < 2e-4
    assert missed[0] / missed[1] == pytest.approx(4.0, rel=0.1)


# ---- sampled tendons


@pytest.mark.parametrize("turns", [0.5, 1.0])
def test_a_helix_sampled_finely_is_the_helix(turns):
    robot = four_tendon_rod(turns)
    missed = []
    for count in (20, 40, 80):
        s = np.linspace(0.0, 0.5, count + 1)
        tendons = []
        for i in range(4):
            x, y, _ = robot.tendon_position(i, s).T
            tendons.append(Tendon.sampled(s, x, y))
        sampled = robot.replace(tendons=tuple(tendons))
        tips = [
            solve(each, (15.0, 0.0, 6.0, 3.0), gravity=(9.81, 0, 0), accuracy=1e-9).tip for each in (robot, sampled)
        ]
        missed.append(farthest(*tips))
    assert missed[2] < 2e-8
    assert missed[1] / missed[2] > 7.0


def test_two_samples_are_a_line_and_one_line_is_a_constant_tendon():
    constant, line = rod(Tendon.constant(x=1e-3, y=2e-3)), rod(Tendon.sampled([0.0, 0.2], [1e-3] * 2, [2e-3] * 2))
    a, b = (solve(each, 5.0, gravity=GRAVITY, steps=30, accuracy=1e-10).tip for each in (constant, line))
    assert farthest(a, b) < 1e-11
    slanted = rod(Tendon.sampled([0.0, 0.1, 0.2], [1e-3, 0.0, -1e-3], [0.0] * 3))
    assert np.abs(solve(slanted, 5.0).tip[1]) < 1e-12


# ---- where the robot leaves the outer tube


def random_pose(seed: int) -> np.ndarray:
    rng, T = np.random.default_rng(seed), np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    return T


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("robot", [prototype(1), two_tubes(0.7)], ids=["P1", "two"])
def test_everything_turned_with_the_world(seed, robot):
    T = random_pose(seed)
    R = T[:3, :3]
    force, weight, spread = np.array([2e-3, 1e-3, -1e-3]), np.array([-9.0, 3.0, 2.0]), np.array([0.01, 0.02, 0.0])
    more = {"insertion": 0.8, "rotation": 0.4, "exit_tilt": (0.02, -0.03), "exit_offset": (1e-4, 2e-4), "steps": 40}

    def shape(turn, pose):
        loads = [
            PointLoad(force=turn @ force, at=0.05, offset=(1e-3, 0, 0)), PointLoad(force=force, frame="body"),
            LumpedMass(mass=2e-4, offset=(0, 1e-3, 0)), DistributedLoad(force=turn @ spread, start=0.03),
        ]  # fmt: skip
        return solve(robot, 0.6, gravity=turn @ weight, tip_force=turn @ force, loads=loads, exit_pose=pose, **more)

    a, b = shape(np.eye(3), None), shape(R, T)
    assert farthest(b.position, a.position @ R.T + T[:3, 3]) < 1e-12
    assert np.abs(b.rotation - R @ a.rotation).max() < 1e-11
    assert farthest(b.force, a.force @ R.T) < 1e-13


@pytest.mark.parametrize("general", [False, True])
def test_tilt_and_offset_are_a_pose_of_the_exit(general):
    """The tube's axis passes through the exit's middle, moved by the offset, in the tilted direction."""
    robot, tilt, offset = prototype(1), (0.05, -0.08), (2e-4, -1e-4)
    loads = {"loads": [PointLoad()]} if general else {}
    shape = solve(robot, 0.7, gravity=GRAVITY, exit_tilt=tilt, exit_offset=offset, rotation=0.3, steps=30, **loads)
    R = Rotation.from_rotvec([*tilt, 0.0]).as_matrix()
    np.testing.assert_allclose(shape.centerline[0], [*offset, 0.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(shape.rotation[0][:, 2], R[:, 2], rtol=0, atol=1e-15)
    pose = np.eye(4)
    pose[:3, :3], pose[:2, 3] = R, offset
    same = solve(robot, 0.7, gravity=GRAVITY, exit_pose=pose, rotation=0.3, steps=30, **loads)
    assert farthest(shape.position, same.position) < 1e-14


def test_a_tilt_without_load_turns_the_robot_as_a_whole():
    robot = prototype(2)
    R = Rotation.from_rotvec([0.1, 0.2, 0.0]).as_matrix()
    straight, tilted = solve(robot, 0.7), solve(robot, 0.7, exit_tilt=(0.1, 0.2))
    s = np.linspace(0.0, straight.length, 9)
    assert farthest(tilted.at(s).position, straight.at(s).position @ R.T) < 1e-14


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("exit_pose", np.eye(3)),
        ("exit_pose", 2.0 * np.eye(4)),
        ("exit_pose", np.diag([1.0, 1.0, -1.0, 1.0])),
        ("exit_pose", np.full((4, 4), np.nan)),
        ("exit_pose", "here"),
        ("exit_pose", [[1.0, 0.0], [0.0]]),
        ("exit_tilt", (0.1,)),
        ("exit_tilt", 0.1),
        ("exit_tilt", (0.1, float("nan"))),
        ("exit_offset", (1.0, 2.0, 3.0)),
        ("exit_offset", "left"),
    ],
)
def test_bad_exits_are_named(field, value):
    with pytest.raises(InvalidInput, match=f"^{field} = "):
        solve(prototype(1), 0.5, **{field: value})


# ---- one case by plain integration: taper, sampled and half-way tendon, changing and following loads, a mass


LENGTH, HALF, MASS, ARM = 0.2, 0.1, 4e-3, np.array([1e-3, -2e-3, 1e-3])
SPREAD = np.array([0.3, 0.0, 0.1]), np.array([0.0, -0.4, 0.0]), 0.04, 0.16  # N/m, N/m, m, m
FOLLOWER, TENSIONS = np.array([0.05, 0.03, 0.0]), (6.0, 4.0)
SPLINE = CubicSpline(SAMPLES[0], np.array(SAMPLES[1:]).T, bc_type="not-a-knot")


def stiffness(s: float) -> tuple[np.ndarray, float]:
    """(Kse, Kbt) (6,) and mass per metre, from the radius alone."""
    r = 0.8e-3 - 2e-3 * s
    A, J = np.pi * r * r, np.pi / 2 * r**4
    return np.array([80e9 * A, 80e9 * A, 200e9 * A, 100e9 * J, 100e9 * J, 80e9 * J]), 8000.0 * A


def strains(s: float, K: np.ndarray, carried: np.ndarray, at: float) -> np.ndarray:
    """(v, u) that carry the wrench (n, m); ``at`` says on which side of the half-way anchor."""
    tendons = [(np.append(SPLINE(s), 0.0), np.append(SPLINE(s, 1), 0.0), TENSIONS[1])]
    if at < HALF:
        tendons.append((np.array([4e-3, 0.0, 0.0]), np.zeros(3), TENSIONS[0]))
    x = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    rest = x.copy()
    for _ in range(50):
        g, H = K * (x - rest) - carried, np.diag(K)
        for r, dr, tau in tendons:
            q = np.cross(x[3:], r) + dr + x[:3]
            size = np.linalg.norm(q)
            t = q / size
            J = np.hstack([np.eye(3), -np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])])
            g, H = g + tau * J.T @ t, H + tau / size * J.T @ (np.eye(3) - np.outer(t, t)) @ J
        step = np.linalg.solve(H, g)
        x = x - step
        if np.abs(step * [1, 1, 1, LENGTH, LENGTH, LENGTH]).max() < 1e-14:
            break
    return x


def from_tip(turn: np.ndarray, rtol: float) -> np.ndarray:
    """State (p, R, n, m) at the base of the rod whose tip stands at the origin with R = turn."""

    def derivative(s, y, at):
        R, n, m = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        K, density = stiffness(s)
        x = strains(s, K, y[12:18], at)
        v, u, f = x[:3], x[3:], density * np.array(GRAVITY)
        if SPREAD[2] < at < SPREAD[3]:
            f = f + SPREAD[0] + (s - SPREAD[2]) / (SPREAD[3] - SPREAD[2]) * (SPREAD[1] - SPREAD[0])
        hat = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        return np.concatenate([R @ v, (R @ hat).ravel(), -np.cross(u, n) - R.T @ f, -np.cross(u, m) - np.cross(v, n)])

    weight = MASS * np.array(GRAVITY)
    y = np.concatenate([np.zeros(3), turn.ravel(), turn.T @ weight, np.cross(ARM, turn.T @ weight)])
    stops = np.unique([LENGTH, *SAMPLES[0], SPREAD[2], SPREAD[3], HALF, 0.12, 0.0])[::-1]
    for a, b in pairwise(stops):
        if a == 0.12:
            y[12:15] += FOLLOWER
        run = solve_ivp(derivative, (a, b), y, args=(0.5 * (a + b),), method="DOP853", rtol=rtol, atol=1e-3 * rtol)
        y = run.y[:, -1].copy()
    return y


def test_plain_integration_finds_the_same():
    robot = taper(Tendon.constant(x=4e-3, y=0.0, end=HALF), Tendon.sampled(*SAMPLES))
    loads = [
        DistributedLoad(force=SPREAD[0], force_end=SPREAD[1], start=SPREAD[2], end=SPREAD[3]),
        PointLoad(force=FOLLOWER, at=0.12, frame="body"), LumpedMass(mass=MASS, offset=ARM),
    ]  # fmt: skip
    shape = solve(robot, TENSIONS, gravity=GRAVITY, loads=loads, accuracy=1e-9)
    found = shape.at([LENGTH]).rotation[0]

    def miss(w):
        base = from_tip(Rotation.from_rotvec(w).as_matrix() @ found, 1e-9)
        return Rotation.from_matrix(base[3:12].reshape(3, 3)).as_rotvec()

    w = root(miss, np.zeros(3), tol=1e-10).x
    base = from_tip(Rotation.from_rotvec(w).as_matrix() @ found, 1e-10)
    R0 = base[3:12].reshape(3, 3)
    assert np.abs(R0 - np.eye(3)).max() < 1e-8
    assert farthest(shape.tip, -R0.T @ base[:3]) < 3e-9
    np.testing.assert_allclose(shape.at([0.0]).moment[0], base[15:18], rtol=0, atol=1e-9)
    assert balance_error(shape) < 1e-6


def test_order_of_convergence():
    robot = taper(Tendon.constant(x=4e-3, y=0.0, end=HALF), Tendon.helical(offset=3e-3, angle=0.0, turns=0.5))
    tips = [solve(robot, TENSIONS, gravity=GRAVITY, steps=n, accuracy=1e-12).tip for n in (16, 32, 64, 128)]
    errors = np.array([farthest(a, b) for a, b in pairwise(tips)])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize("accuracy", [1e-5, 1e-7])
def test_the_accuracy_asked_for(accuracy):
    robot = taper(Tendon.constant(x=4e-3, y=0.0, end=HALF), Tendon.sampled(*SAMPLES))
    exact = solve(robot, TENSIONS, gravity=GRAVITY, accuracy=1e-11).tip
    assert farthest(solve(robot, TENSIONS, gravity=GRAVITY, accuracy=accuracy).tip, exact) < accuracy
