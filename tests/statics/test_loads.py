"""Loads anywhere: point loads, masses with their offset, distributed loads, the weight's centroid."""

import itertools

import numpy as np
import pytest

import rucker_webster
from tendonrod import InvalidInput, NotchedTube, Robot, Tendon, solve
from tendonrod.body import Segments
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.statics.balance import balance_error
from textbook import GRAVITY, about_z, farthest, helix_rod, prototype, rod

FORCE, MOMENT = (3e-3, -2e-3, 1e-3), (2e-5, 1e-5, -1e-5)


def two_tubes(angle: float = 0.7) -> Robot:
    """P1 and P3 in a row: the neutral axes lie at different places of the tube."""
    body = Segments(segments=(prototype(1).body, prototype(3).body), angles=(angle,))
    return Robot(name="two tubes", body=body, tendons=(Tendon.opposite_backbone(radius=5e-5),))


@pytest.mark.parametrize("tau", [0.0, 0.9])
@pytest.mark.parametrize("insertion", [1.0, 0.4])
def test_a_dead_point_load_at_the_tip_is_the_tip_wrench(tau, insertion):
    robot = prototype(1)
    more = {"gravity": GRAVITY, "insertion": insertion, "accuracy": 1e-9}
    on_axis = PointLoad(force=FORCE, moment=MOMENT, offset=(-robot.section.r_na, 0.0, 0.0))
    found = solve(robot, tau, loads=[on_axis], **more)
    assert farthest(found.tip, solve(robot, tau, tip_force=FORCE, tip_moment=MOMENT, **more).tip) < 2e-9


@pytest.mark.parametrize("share", [0.25, 0.6])
def test_beyond_a_dead_force_the_wrench_is_gone(share):
    robot = rod(length=0.2)
    at = share * 0.2
    shape = solve(robot, (), loads=[PointLoad(force=(0.2, 0.1, 0.0), at=at)], s=[0.5 * at, at, 0.2], accuracy=1e-10)
    np.testing.assert_allclose(shape.force, [(0.2, 0.1, 0.0), (0, 0, 0), (0, 0, 0)], rtol=0, atol=1e-13)
    lever = np.cross(shape.position[1] - shape.position[0], (0.2, 0.1, 0.0))
    np.testing.assert_allclose(shape.moment[0], lever, rtol=0, atol=1e-11)
    cut = solve(rod(length=at), (), tip_force=(0.2, 0.1, 0.0), accuracy=1e-10)
    straight = cut.tip + (0.2 - at) * cut.rotation[-1][:, 2]
    assert farthest(shape.tip, straight) < 1e-9


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (2e-3, -1e-3, 3e-3)])
@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize("tau", [0.0, 0.7])
def test_a_mass_is_its_weight_with_its_lever(offset, share, tau):
    """Equal to a dead force on the neutral axis and the moment (R offset) x m g, found by iteration."""
    robot, mass, g = prototype(1), 0.3e-3, np.array([-7.0, 5.0, 3.0])
    at = share * robot.length_na
    tracker = solve(robot, tau, gravity=g, loads=[LumpedMass(mass=mass, at=at, offset=offset)], accuracy=1e-9)
    arm = np.array([robot.section.r_na, 0.0, 0.0]) + offset
    weight, moment, shape = mass * g, np.zeros(3), tracker
    for _ in range(30):
        where = {"at": at, "offset": (-robot.section.r_na, 0.0, 0.0)}
        shape = solve(robot, tau, gravity=g, loads=[PointLoad(force=weight, moment=moment, **where)], accuracy=1e-10)
        last, moment = moment, np.cross(shape.at([at]).rotation[0] @ arm, weight)
        if np.abs(moment - last).max() < 1e-15:
            break
    assert farthest(tracker.tip, shape.tip) < 2e-9
    assert tracker.stable is True


def test_a_mass_and_a_force_of_its_weight_are_the_same_and_without_gravity_a_mass_is_nothing():
    robot, offset = prototype(2), (1e-3, 2e-3, -1e-3)
    mass = LumpedMass(mass=4e-4, offset=offset, at=0.05)
    force = PointLoad(force=4e-4 * GRAVITY, offset=offset, at=0.05)
    a, b = (solve(robot, 0.8, gravity=GRAVITY, loads=[each], steps=30).tip for each in (mass, force))
    assert farthest(a, b) < 1e-12
    assert farthest(solve(robot, 0.8, loads=[mass]).tip, solve(robot, 0.8).tip) < 1e-9


@pytest.mark.parametrize("frame", ["world", "body"])
def test_a_linear_density_is_the_sum_of_many_small_loads(frame):
    """The middle rule: the difference falls with the square of their number."""
    robot, a, b = prototype(1), 0.02, 0.06
    first, last = np.array([0.1, 0.0, 0.05]), np.array([-0.05, 0.15, 0.0])
    first_m, last_m = np.array([1e-4, 0.0, 2e-4]), np.array([0.0, -2e-4, 0.0])
    spread = DistributedLoad(
        force=first, force_end=last, moment=first_m, moment_end=last_m, start=a, end=b, frame=frame
    )
    exact = solve(robot, 0.6, loads=[spread], accuracy=1e-9).tip
    tips = []
    for count in (25, 50):
        share = (np.arange(count) + 0.5) / count
        loads = [
            PointLoad(
                force=(first + c * (last - first)) * (b - a) / count, at=a + c * (b - a), frame=frame,
                moment=(first_m + c * (last_m - first_m)) * (b - a) / count, offset=(-robot.section.r_na, 0.0, 0.0),
            )
            for c in share
        ]  # fmt: skip
        tips.append(solve(robot, 0.6, loads=loads, accuracy=1e-9).tip)
    assert farthest(tips[1], exact) < 2e-6
    assert farthest(tips[0], exact) / farthest(tips[1], exact) == pytest.approx(4.0, rel=0.05)
    assert farthest((4.0 * tips[1] - tips[0]) / 3.0, exact) < 2e-8


@pytest.mark.parametrize("tau", [0.0, 0.8])
def test_a_uniform_density_is_the_distributed_argument(tau):
    robot = prototype(3, "open_section")
    f, m = (0.05, 0.1, -0.1), (1e-4, -2e-4, 3e-4)
    spread = [DistributedLoad(force=f, moment=m)]
    for more in ({}, {"insertion": 0.6, "rotation": 0.4}):
        expected = solve(robot, tau, distributed_force=f, distributed_moment=m, gravity=GRAVITY, accuracy=1e-9, **more)
        found = solve(robot, tau, loads=spread, gravity=GRAVITY, accuracy=1e-9, **more)
        assert farthest(found.tip, expected.tip) < 2e-9


def test_pieces_of_a_distributed_load_are_the_whole():
    robot = helix_rod()
    f, last = np.array([0.5, 0.0, 0.1]), np.array([0.0, -0.5, 0.3])
    middle = f + 0.37 * (last - f)
    whole = [DistributedLoad(force=f, force_end=last)]
    cut = [
        DistributedLoad(force=f, force_end=middle, end=0.074),
        DistributedLoad(force=middle, force_end=last, start=0.074),
    ]
    a, b = (solve(robot, (6.0, 3.0, 8.0), loads=loads, accuracy=1e-9).tip for loads in (whole, cut))
    assert farthest(a, b) < 2e-9


def test_loads_add_up_in_any_order():
    robot, rng = helix_rod(), np.random.default_rng(5)
    loads = [
        PointLoad(force=0.05 * rng.normal(size=3), at=0.04), PointLoad(force=0.02 * rng.normal(size=3)),
        DistributedLoad(force=0.2 * rng.normal(size=3), start=0.01, end=0.15),
        LumpedMass(mass=2e-3, at=0.04, offset=(1e-3, 0, 0)), PointLoad(moment=1e-3 * rng.normal(size=3), at=0.11),
    ]  # fmt: skip
    tips = [solve(robot, (6.0, 3.0, 8.0), gravity=GRAVITY, loads=order, steps=40).tip for order in (loads, loads[::-1])]
    assert farthest(*tips) < 1e-11
    double = solve(robot, (6.0, 3.0, 8.0), loads=[loads[0], loads[0]], steps=40).tip
    once = PointLoad(force=2.0 * np.array(loads[0].force), at=0.04)
    assert farthest(double, solve(robot, (6.0, 3.0, 8.0), loads=[once], steps=40).tip) < 1e-11


@pytest.mark.parametrize("insertion", [0.3, 0.75])
def test_what_lies_inside_the_outer_tube_does_nothing(insertion):
    robot = prototype(1)
    exit_ = (1.0 - insertion) * robot.length_na
    inside = [
        PointLoad(force=(1.0, 2.0, 3.0), moment=(0.1, 0.2, 0.3), at=0.5 * exit_),
        PointLoad(force=(1.0, 2.0, 3.0), at=exit_),
        LumpedMass(mass=1.0, at=0.9 * exit_),
        DistributedLoad(force=(10.0, 10.0, 10.0), end=exit_),
        PointLoad(force=(1.0, 0.0, 0.0), at=0.0, frame="body"),
    ]
    more = {"gravity": GRAVITY, "insertion": insertion, "steps": 30}
    assert farthest(solve(robot, 0.7, loads=inside, **more).tip, solve(robot, 0.7, **more).tip) < 1e-10


def test_a_distributed_load_acts_on_what_is_exposed_of_it():
    robot, exit_ = prototype(1), 0.6 * prototype(1).length_na
    f, last = np.array([0.2, 0.0, 0.0]), np.array([0.0, 0.2, 0.0])
    at_exit = f + 0.6 * (last - f)
    a = solve(robot, 0.7, loads=[DistributedLoad(force=f, force_end=last)], insertion=0.4, accuracy=1e-9)
    b = DistributedLoad(force=at_exit, force_end=last, start=exit_)
    assert farthest(a.tip, solve(robot, 0.7, loads=[b], insertion=0.4, accuracy=1e-9).tip) < 2e-9


@pytest.mark.parametrize("frame", ["world", "body"])
@pytest.mark.parametrize("what", ["force", "moment"])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_load_at_a_joint_is_between_loads_beside_it(frame, what, angle):
    """On the tube's axis, which goes through the joint; with the angle 0 there is one direction for followers too."""
    if frame == "body" and angle != 0.0:
        pytest.skip("a follower's direction has two meanings at a joint that turns")
    robot = two_tubes(angle)
    joint = robot.joints[0, 0]
    value = (8e-4, 5e-4, -4e-4) if what == "force" else (1e-5, -5e-6, 5e-6)
    tips = [
        solve(robot, 0.5, loads=[PointLoad(**{what: value}, at=at, frame=frame)], accuracy=1e-9).tip
        for at in (joint - 1e-8, joint, joint + 1e-8)
    ]
    assert farthest(tips[0], tips[2]) < 2e-7
    assert farthest(tips[1], tips[0]) < 2e-7


def test_a_mass_at_a_joint():
    robot = two_tubes()
    joint, offset = robot.joints[0, 0], (0.0, 0.0, 2e-3)
    tips = [
        solve(robot, 0.5, gravity=GRAVITY, loads=[LumpedMass(mass=2e-3, at=at, offset=offset)], accuracy=1e-9).tip
        for at in (joint - 1e-8, joint, joint + 1e-8)
    ]
    assert max(farthest(tips[0], tip) for tip in tips[1:]) < 2e-7


@pytest.mark.parametrize("beside", [-1e-12, 0.0, 1e-12, 1e-8])
def test_a_load_where_a_tendon_ends(beside):
    robot = helix_rod()
    load = [PointLoad(force=(0.1, 0.05, 0.0), at=0.11 + beside)]
    expected = solve(
        robot, (6.0, 3.0, 8.0), loads=[PointLoad(force=(0.1, 0.05, 0.0), at=0.11 - 1e-5)], accuracy=1e-9
    ).tip
    shape = solve(robot, (6.0, 3.0, 8.0), loads=load, accuracy=1e-9)
    assert farthest(shape.tip, expected) < 1e-5
    assert balance_error(shape) < 1e-6


def test_offset_is_measured_from_the_axis_of_the_tube():
    """A force along the tube's axis has the lever r_na about the neutral axis."""
    robot = prototype(1)
    pull = solve(robot, 0.0, loads=[PointLoad(force=(0.0, 0.0, 1e-4))], steps=40)
    on_axis = solve(robot, 0.0, loads=[PointLoad(force=(0.0, 0.0, 1e-4), offset=(-robot.section.r_na, 0, 0))], steps=40)
    assert farthest(on_axis.tip, solve(robot, 0.0, tip_force=(0.0, 0.0, 1e-4), steps=40).tip) < 1e-11
    arm = pull.rotation[-1] @ [robot.section.r_na, 0.0, 0.0]
    same = solve(robot, 0.0, tip_force=(0, 0, 1e-4), tip_moment=np.cross(arm, (0, 0, 1e-4)), steps=40)
    assert farthest(pull.tip, same.tip) < 1e-10


# ---- weight at the mass centroid


def body_moment(robot, shape, gravity):
    """(R r_c) x lambda g at every place, world frame, N m/m."""
    arm = np.array([robot.body.mass_centroid_offset, 0.0, 0.0])
    return np.cross(shape.rotation @ arm, robot.section.line_density * np.asarray(gravity))


@pytest.mark.parametrize("number", [1, 3])
@pytest.mark.parametrize("tau", [0.0, 0.7])
def test_centroid_weight_is_a_distributed_moment(number, tau):
    """Small moments at 120 places that are those of the shape found: the middle rule, and Richardson's step."""
    robot, g, tips = prototype(number), np.array([-9.81, 3.0, 2.0]), []
    shape = solve(robot, tau, gravity=g, centroid_weight=True, accuracy=1e-10)
    for count in (60, 120):
        s = (np.arange(count) + 0.5) / count * robot.length_na
        moments = body_moment(robot, shape.at(s), g) * robot.length_na / count
        loads = [PointLoad(moment=moment, at=at) for moment, at in zip(moments, s, strict=True)]
        tips.append(solve(robot, tau, gravity=g, loads=loads, accuracy=1e-10).tip)
    plain = solve(robot, tau, gravity=g, accuracy=1e-10).tip
    assert farthest(shape.tip, plain) > 2e-7
    assert farthest((4.0 * tips[1] - tips[0]) / 3.0, shape.tip) < 1e-9


def test_centroid_weight_of_physics():
    """physics.md, section 1: the centroid lies r_na pi d / (pi d + psi w / 2) from the neutral axis."""
    body = prototype(1).body
    assert isinstance(body, NotchedTube)
    d, w, psi = body.notch_spacing, body.notch_width, body.uncut_angle
    expected = prototype(1).section.r_na * np.pi * d / (np.pi * d + 0.5 * psi * w)
    assert body.mass_centroid_offset == pytest.approx(expected, rel=1e-12)
    assert solve(prototype(1), 0.5, gravity=GRAVITY, centroid_weight=True).stable is True
    upright, same = (solve(rod(), (), gravity=GRAVITY, centroid_weight=each, steps=30).tip for each in (True, False))
    assert farthest(upright, same) < 1e-9


# ---- the general driver and the fast path are one


def random_problem(seed: int) -> dict:
    rng = np.random.default_rng(seed)
    robot = (prototype(1), prototype(2, "open_section"), prototype(3), helix_rod())[seed % 4]
    EI, L = robot.section.Kbt[:2].min(), robot.length_na
    size = 0.5 * EI / L**2
    return {
        "robot": robot, "tensions": rng.uniform(0.0, 1.2, robot.n_tendons), "gravity": 9.81 * rng.uniform(-1, 1, 3),
        "tip_force": size * rng.normal(size=3), "distributed_force": size / L * rng.normal(size=3),
        "rotation": rng.uniform(-3, 3), "insertion": rng.uniform(0.2, 1.0),
        "tip_moment": 0.3 * size * L * rng.normal(size=3) * (seed % 2),
        "distributed_moment": size * rng.normal(size=3) * (seed % 2),
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(24))
def test_the_general_driver_is_the_fast_path(seed):
    """At equal steps the discrete equations are the same: PointLoad of nothing, and the tip force as a load."""
    problem = random_problem(seed)
    fast = solve(**problem, steps=24, accuracy=1e-11)
    nothing = solve(**problem, steps=24, accuracy=1e-11, loads=[PointLoad()])
    assert farthest(nothing.position, fast.position) < 1e-11
    assert farthest(nothing.u, fast.u) < 1e-7
    assert np.abs(nothing.rotation - fast.rotation).max() < 1e-9
    assert nothing.stable == fast.stable
    force = problem.pop("tip_force")
    r_na = problem["robot"].section.r_na
    as_load = solve(**problem, steps=24, accuracy=1e-11, loads=[PointLoad(force=force, offset=(-r_na, 0.0, 0.0))])
    assert farthest(as_load.position, fast.position) < 1e-11
    s = np.linspace(0.0, fast.length, 9)
    assert farthest(nothing.at(s).position, fast.at(s).position) < 1e-8


@pytest.mark.parametrize("seed", range(0, 24, 5))
def test_the_general_driver_keeps_its_accuracy_and_balances(seed):
    problem = random_problem(seed)
    exact = solve(**problem, accuracy=1e-11).tip
    for accuracy in (1e-5, 1e-7, 1e-9):
        shape = solve(**problem, accuracy=accuracy, loads=[PointLoad()])
        assert shape.error_estimate <= accuracy
        assert farthest(shape.tip, exact) < accuracy
        assert balance_error(shape) < 1e-5


@pytest.mark.parametrize(("load", "stable"), [(0.5, True), (0.98, True), (1.02, False), (5.0, False)])
def test_euler_s_column(load, stable):
    robot = rod(length=0.2)
    critical = 0.25 * np.pi**2 * robot.section.Kbt[0] / 0.04
    push = PointLoad(force=(0.0, 0.0, -load * critical))
    assert solve(robot, (), loads=[push]).stable is stable


@pytest.mark.parametrize("seed", range(4))
def test_order_of_convergence(seed):
    problem = random_problem(seed)
    L = problem["robot"].length_na
    problem["insertion"] = 1.0
    spread = DistributedLoad(force=problem["distributed_force"], start=0.3 * L)
    loads = [PointLoad(force=1.5 * problem["tip_force"], at=0.55 * L), spread]
    tips = [solve(**problem, loads=loads, steps=n, accuracy=1e-12).tip for n in (20, 40, 80, 160)]
    errors = np.array([farthest(a, b) for a, b in itertools.pairwise(tips)])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(4.0, abs=0.5)


def test_the_general_driver_against_rucker_and_webster():
    robot, loads = (
        helix_rod(),
        {"gravity": (0, -9.81, 0), "tip_force": (0.1, 0.05, -0.05), "tip_moment": (2e-3, 0, 1e-3)},
    )
    oracle = rucker_webster.solve(rucker_webster.from_robot(robot, (6.0, 3.0, 8.0), **loads))
    shape = solve(robot, (6.0, 3.0, 8.0), **loads, loads=[PointLoad()], accuracy=1e-9)
    assert farthest(shape.tip, oracle.tip) < 3e-9


def test_a_neighbour_to_start_from_changes_nothing():
    robot, load = prototype(1), [PointLoad(force=(2e-3, 0.0, 0.0), at=0.05)]
    near = solve(robot, 0.7, gravity=GRAVITY, loads=load, accuracy=1e-9)
    for start in (near, solve(robot, 0.6, gravity=GRAVITY), solve(robot, 0.2, insertion=0.5)):
        for tau, insertion in ((0.75, 1.0), (0.7, 0.8)):
            problem = {"tensions": tau, "insertion": insertion, "gravity": GRAVITY, "loads": load, "accuracy": 1e-9}
            warm, cold = solve(robot, **problem, start=start), solve(robot, **problem)
            assert farthest(warm.tip, cold.tip) < 2e-9
    fast = solve(robot, 0.7, gravity=GRAVITY, start=near, accuracy=1e-9)
    assert farthest(fast.tip, solve(robot, 0.7, gravity=GRAVITY, accuracy=1e-9).tip) < 2e-9


def test_turning_the_world_with_the_loads():
    robot, turn = prototype(1), about_z(0.9)
    force, moment = np.array([3e-3, 1e-3, -2e-3]), np.array([1e-5, 2e-5, 0.0])
    a = solve(robot, 0.7, gravity=GRAVITY, loads=[PointLoad(force=force, moment=moment, at=0.04)], accuracy=1e-9)
    b = solve(
        robot, 0.7, gravity=turn @ GRAVITY, rotation=0.9, accuracy=1e-9,
        loads=[PointLoad(force=turn @ force, moment=turn @ moment, at=0.04)],
    )  # fmt: skip
    assert farthest(b.position, a.position @ turn.T) < 1e-11


# ---- bad input


@pytest.mark.parametrize(
    ("field", "make"),
    [
        ("force", lambda: PointLoad(force=1.0)),
        ("force", lambda: PointLoad(force=(0.0, 0.0, float("inf")))),
        ("offset", lambda: PointLoad(offset=(0.0, 0.0))),
        ("at", lambda: PointLoad(at=-1e-3)),
        ("at", lambda: LumpedMass(mass=1.0, at="tip")),
        ("mass", lambda: LumpedMass(mass=-1.0)),
        ("mass", lambda: LumpedMass(mass=None)),
        ("offset", lambda: LumpedMass(mass=1.0, offset="here")),
        ("end", lambda: DistributedLoad(start=0.05, end=0.05)),
        ("end", lambda: DistributedLoad(end=0.0)),
        ("start", lambda: DistributedLoad(start=-0.01)),
        ("force_end", lambda: DistributedLoad(force_end=(1.0,))),
        ("moment_end", lambda: DistributedLoad(moment_end=(float("nan"), 0.0, 0.0))),
    ],
)
def test_bad_loads_are_named(field, make):
    with pytest.raises(InvalidInput, match=f"^{field} = "):
        make()


@pytest.mark.parametrize(
    ("field", "load"),
    [
        (r"loads\[1\]\.at", PointLoad(at=0.08)),
        (r"loads\[1\]\.at", LumpedMass(mass=1e-3, at=1.0)),
        (r"loads\[1\]\.end", DistributedLoad(end=0.08)),
        (r"loads\[1\]\.start", DistributedLoad(start=0.08)),
        (r"loads\[1\]", (0.0, 0.0, 1.0)),
        (r"loads\[1\]", None),
    ],
)
@pytest.mark.parametrize("insertion", [1.0, 0.0])
def test_loads_that_do_not_fit_are_named_by_their_place(field, load, insertion):
    with pytest.raises(InvalidInput, match=f"^{field} = "):
        solve(prototype(1), 0.5, loads=[PointLoad(), load], insertion=insertion)


@pytest.mark.parametrize("loads", [PointLoad(), None, 3.0])
def test_loads_is_a_sequence(loads):
    with pytest.raises(InvalidInput, match=r"^loads"):
        solve(prototype(1), 0.5, loads=loads)


def test_a_load_at_the_tip_by_its_number_is_at_the_tip():
    robot = prototype(1)
    a, b = (solve(robot, 0.5, loads=[PointLoad(force=FORCE, at=at)], steps=30).tip for at in (None, robot.length_na))
    assert farthest(a, b) == 0.0
