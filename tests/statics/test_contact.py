"""Contact with surfaces: exact planar oracles, least energy in space, balance, invariance, many random problems."""

from functools import cache

import numpy as np
import pytest

from contact_energy import EnergyRod, inside_tube, least_energy
from contact_oracles import PlanarRod, PlanarShape, equilibrium
from tendonrod import InvalidInput, PlainRod, Robot, Segments, Shape, Status, solve
from tendonrod.loads import PointLoad
from tendonrod.rotation import exp_so3
from tendonrod.statics.balance import balance_error
from tendonrod.statics.limits import PLATEAU_STRAIN, fibre_strain
from tendonrod.surface import Cavity, Cylinder, DistanceGrid, Plane, Sphere, Tube, Walls
from textbook import GRAVITY, PROTOTYPES, farthest, prototype, rod

L, R_OUT = 0.1, 0.5e-3  # m
TOL = 1e-6  # m, contact_tolerance and accuracy of the comparisons with oracles
# Stiff in torsion and to shear, so that a precurved rod between two planes does not roll over and the oracle's shear
# estimate does not matter.
ROD = rod(length=L, radius=R_OUT, G=750e9)
EI, (GA, _, EA) = float(ROD.section.Kbt[0]), ROD.section.Kse.tolist()
UNIT = EI * 0.01 / L**4  # N/m, line load that lowers a tip by L / 80
PLANAR = {
    "tip on the floor": PlanarRod(length=L, EI=EI, EA=EA, GA=GA, line=(20 * UNIT, 0.0), upper=0.01),
    "flat on the floor": PlanarRod(length=L, EI=EI, EA=EA, GA=GA, line=(150 * UNIT, 0.0), upper=0.01),
    "tip in the channel": PlanarRod(length=L, EI=EI, EA=EA, GA=GA, curvature=6.0, lower=-2e-3, upper=2e-3),
    "light point in the channel": PlanarRod(length=L, EI=EI, EA=EA, GA=GA, curvature=8.0, lower=-2e-3, upper=2e-3),
    "point in the channel": PlanarRod(length=L, EI=EI, EA=EA, GA=GA, curvature=12.0, lower=-2e-3, upper=2e-3),
    "loads and two walls": PlanarRod(
        length=L, EI=EI, EA=EA, GA=GA, curvature=14.0, line=(1.0, 2.0), tip_force=(0.05, -0.1), lower=-3e-3, upper=1e-3
    ),
}  # fmt: skip
KINDS = [["tip"], ["flat"], ["tip"], ["point", "tip"], ["point", "tip"], ["point", "tip"]]
EXACT = cache(equilibrium)


def pose(rotation=(0.0, 0.0, 0.0), position=(0.0, 0.0, 0.0)) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_so3(np.array(rotation)), position
    return T


POSES = {"as it is": None, "turned": pose((0.4, -1.9, 0.7), (0.3, -0.2, 0.1)), "upside down": pose((np.pi, 0.0, 0.0))}


def walls(problem: PlanarRod, T: np.ndarray, radius: float = R_OUT) -> Plane | Walls:
    """Planes in the world that keep a tube's axis between the walls of ``problem``."""
    places = [(problem.lower - radius, 1.0), (problem.upper + radius, -1.0)]
    planes = [
        Plane(point=T[:3, :3] @ [x, 0.0, 0.0] + T[:3, 3], normal=T[:3, :3] @ [side, 0.0, 0.0])
        for x, side in places
        if np.isfinite(x)
    ]
    return planes[0] if len(planes) == 1 else Walls(surfaces=planes)


def planar(problem: PlanarRod, where: np.ndarray | None = None, **more) -> Shape:
    T = np.eye(4) if where is None else where
    (f_x, f_z), (F_x, F_z) = problem.line, problem.tip_force
    given = {
        "distributed_force": T[:3, :3] @ [f_x, 0.0, f_z],
        "tip_force": T[:3, :3] @ [F_x, 0.0, F_z],
        "surface": walls(problem, T),
        "contact_tolerance": TOL,
        "accuracy": TOL,
    }
    return solve(ROD.replace(precurvature=(0.0, problem.curvature, 0.0)), (), exit_pose=where, **(given | more))


def in_exit(shape: Shape, T: np.ndarray | None) -> np.ndarray:
    return shape.position if T is None else (shape.position - T[:3, 3]) @ T[:3, :3]


def oracle_position(exact: PlanarShape, s: np.ndarray) -> np.ndarray:
    at = exact.at(s)
    return np.stack([at["x"], 0.0 * s, at["z"]], axis=1)


def depth(shape: Shape, surface) -> float:
    """By how much the tube is inside the surface anywhere, m."""
    there = shape.at(np.linspace(0.0, shape.length, 1001))
    return float((shape.robot.outer_radius(there.material_coordinate) - surface.distance(there.centerline)[0]).max())


def assert_lawful(shape: Shape, surface, tolerance: float) -> None:
    """Not inside, forces push and act only where there is no gap, all forces together are carried by the base."""
    assert depth(shape, surface) < tolerance
    found = shape.contacts
    assert (found.force > 0.0).all()
    # on the wall to the tolerance, and complementary: where there is force there is no gap worth mentioning
    assert np.abs(found.gap).max(initial=0.0) < 2.0 * tolerance
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=0.02)
    if not isinstance(surface, DistanceGrid):
        d, normal = surface.distance(found.point)
        np.testing.assert_allclose(d, found.gap, rtol=0, atol=1e-9)
        np.testing.assert_allclose(normal, found.normal, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.total, (found.force[:, None] * found.normal).sum(axis=0), atol=1e-15)
    inside = found.s < shape.length * (1.0 - 1e-9)
    assert (found.line_force[inside] > 0.0).all()
    assert (found.line_force[~inside] == 0.0).all()
    width = 2.0 * shape.robot.outer_radius(found.s[inside] + shape.material_coordinate[0] - shape.s[0])
    np.testing.assert_allclose(found.pressure[inside], found.line_force[inside] / width, rtol=1e-12)


# Planar, exact


@pytest.mark.parametrize("where", POSES.values(), ids=POSES.keys())
@pytest.mark.parametrize(("problem", "kinds"), list(zip(PLANAR.values(), KINDS, strict=True)), ids=PLANAR.keys())
def test_planar_contact_is_that_of_the_exact_oracle(problem, kinds, where):
    exact, shape = EXACT(problem), planar(problem, where)
    assert [each.kind for each in exact.touches] == kinds
    s = np.linspace(0.0, L, 401)
    assert farthest(in_exit(shape.at(s), where), oracle_position(exact, s)) < 3.0 * TOL
    R = np.eye(3) if where is None else where[:3, :3]
    found, force, moment = shape.contacts, R.T @ shape.force[0], R.T @ shape.moment[0]
    size = sum(each.force for each in exact.touches)
    np.testing.assert_allclose(force, [exact.base_force[0], 0.0, exact.base_force[1]], rtol=0, atol=1e-3 * size)
    np.testing.assert_allclose(moment, [0.0, exact.base_moment, 0.0], rtol=0, atol=1e-3 * abs(exact.base_moment))
    carried = problem.line[0] * exact.contact_length + sum(each.force for each in exact.touches)
    np.testing.assert_allclose(found.force.sum(), carried, rtol=2e-3)
    sides = np.sign(-found.normal @ R[:, 0])
    for each in exact.touches:
        own = sides == each.side
        flat = each.kind == "flat"
        pushed = each.force + flat * problem.line[0] * exact.contact_length
        np.testing.assert_allclose(found.force[own].sum(), pushed, rtol=2e-3, atol=1e-4 * size)
        first = found.s[own].min() if flat else (found.force @ (own * found.s)) / found.force[own].sum()
        assert abs(first - each.s) < 3e-3  # one step of the integrator
    assert shape.stable
    assert_lawful(shape, walls(problem, np.eye(4) if where is None else where), TOL)


def test_a_flat_touch_converges_with_the_grid():
    """Slower than without contact: where it begins lies between the stages."""
    problem, s = PLANAR["flat on the floor"], np.linspace(0.0, L, 201)
    exact = oracle_position(EXACT(problem), s)
    wrong = [farthest(planar(problem, steps=n).at(s).position, exact) for n in (10, 20, 40, 80)]
    assert wrong[-1] < 2.0 * TOL  # which bounds how deep the surface is entered, not how far the shape is off
    assert wrong[-1] < 0.2 * wrong[0]


@pytest.mark.parametrize("name", ["tip on the floor", "tip in the channel"])
def test_a_touch_of_the_tip_keeps_the_order_of_the_integrator(name):
    s = np.array([0.5 * L, L])
    exact = oracle_position(EXACT(PLANAR[name]), s)
    more = {"contact_tolerance": 1e-9, "accuracy": 1e-11}
    wrong = [farthest(planar(PLANAR[name], steps=n, **more).at(s).position, exact) for n in (10, 20)]
    assert wrong[1] < 1e-8
    assert wrong[0] > 10.0 * wrong[1]


# In space

HELIX = EnergyRod(
    length=L, Kbt=(1e-3, 1e-3, 0.77e-3), u_star=(0, 25.0, 20.0), line=(0.05, 0.1, 0), tip_force=(0, 0.02, -0.02),
    gap=inside_tube(0.003),
)  # fmt: skip
ARC = EnergyRod(length=L, Kbt=(1e-3, 1e-3, 0.77e-3), u_star=(0, 4.0, 0), gap=inside_tube(0.002))


def in_tube(problem: EnergyRod, clearance: float) -> Shape:
    E = problem.Kbt[0] / (0.25 * np.pi * R_OUT**4)
    robot = rod(length=L, radius=R_OUT, E=E, G=0.5 * 0.77 * E, precurvature=problem.u_star)
    surface = Tube(point=(0, 0, 0), axis=(0, 0, 1), radius=clearance + R_OUT)
    given = {"distributed_force": problem.line, "tip_force": problem.tip_force}
    shape = solve(robot, (), **given, surface=surface, contact_tolerance=TOL, accuracy=TOL)
    assert_lawful(shape, surface, TOL)
    assert shape.stable
    return shape


def test_arc_in_a_tube_is_the_least_energy():
    shape, coarse, fine = in_tube(ARC, 0.002), least_energy(ARC, 16), least_energy(ARC, 32)
    limit = (4.0 * fine.p[::2] - coarse.p) / 3.0  # the oracle's error is of second order
    assert farthest(shape.at(coarse.s).position, limit) < 1e-6
    np.testing.assert_allclose(shape.contacts.total, (fine.force[:, None] * fine.normal).sum(axis=0), atol=1e-4)


def test_helix_in_a_tube_is_the_least_energy():
    shape, oracle = in_tube(HELIX, 0.003), least_energy(HELIX, 20)
    assert farthest(shape.at(oracle.s).position, oracle.p) < 1e-4
    total = (oracle.force[:, None] * oracle.normal).sum(axis=0)
    np.testing.assert_allclose(shape.contacts.total, total, atol=0.01 * np.linalg.norm(total))


# Robots

PLANE = Plane(point=(0.0, 10e-3, 0.0), normal=(0.0, -1.0, 0.0))
TUBE = Tube(point=(0.0, 0.0, 0.0), axis=(0.0, 0.1, 1.0), radius=4e-3)


@cache
def plateau(number: int) -> float:
    """Tension (N) at which the robot meets the superelastic plateau, about."""
    return float(PLATEAU_STRAIN / fibre_strain(solve(prototype(number), 1.0)).max())


def radius_of(number: int) -> float:
    return float(prototype(number).outer_radius(0.0)[0])


@cache
def cord(number: int) -> Cylinder:
    """A cord along z beside the free robot, which it pushes 0.5 mm aside: so little that it is clear to which side."""
    free, radius = solve(prototype(number), 0.8 * plateau(number), s=[0.04]), radius_of(number)
    beside = free.centerline[0] * [1.0, 1.0, 0.0]
    outward = beside / np.linalg.norm(beside)
    return Cylinder(point=beside + (3e-3 + radius - 0.5e-3) * outward, axis=(0.0, 0.0, 1.0), radius=3e-3)


SURFACES = {"plane": lambda number: PLANE, "tube": lambda number: TUBE, "cord": cord}


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), GRAVITY], ids=["weightless", "heavy"])
@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())
@pytest.mark.parametrize("number", range(1, len(PROTOTYPES) + 1))
def test_robot_against_surface_is_balanced(number, surface, gravity):
    surface, robot, force = surface(number), prototype(number), np.array([2e-3, 1e-3, -1e-3])
    shape = solve(robot, 0.8 * plateau(number), gravity=gravity, tip_force=force, surface=surface)
    free = solve(robot, 0.8 * plateau(number), gravity=gravity, tip_force=force)
    assert (depth(free, surface) > 0.0) == (shape.contacts.force.size > 0)
    assert shape.stable
    assert_lawful(shape, surface, 1e-5)
    assert balance_error(shape) < 2e-3  # a touch is as wide as a step of the integrator
    # the base carries everything: integrals over the whole robot, moments about its exit
    s, weight = np.polynomial.legendre.leggauss(40)
    s, weight = 0.5 * shape.length * (s + 1.0), 0.5 * shape.length * weight
    along, heavy = shape.at(s), robot.section.line_density * np.array(gravity)
    found, base = shape.contacts, shape.position[0]
    pushes = found.force[:, None] * found.normal
    np.testing.assert_allclose(shape.force[0], force + shape.length * heavy + pushes.sum(axis=0), rtol=0, atol=1e-10)
    moment = np.cross(shape.tip - base, force) + np.cross(weight @ (along.position - base), heavy)
    moment += np.cross(found.point - base, pushes).sum(axis=0)
    np.testing.assert_allclose(shape.moment[0], moment, rtol=0, atol=1e-6 * max(1e-2, np.abs(moment).max()))


def test_moments_that_have_no_potential_press_too():
    shape = solve(prototype(1), 0.5, tip_moment=(2e-4, 0.0, 1e-4), surface=PLANE)
    assert_lawful(shape, PLANE, 1e-5)
    assert shape.contacts.force.size
    assert shape.stable is None


def turned(surface, T: np.ndarray):
    R, p = T[:3, :3], T[:3, 3]
    if isinstance(surface, Plane):
        return Plane(point=R @ surface.point + p, normal=R @ surface.normal)
    return type(surface)(point=R @ surface.point + p, axis=R @ surface.axis, radius=surface.radius)


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())
def test_turning_world_and_surface_turns_the_answer(surface):
    surface = surface(1)
    T, g = pose((1.2, 0.4, -2.0), (0.05, -0.02, 0.3)), np.array([3.0, -2.0, 9.0])
    shape = solve(prototype(1), 0.9, gravity=g, surface=surface, steps=40)
    there = solve(prototype(1), 0.9, gravity=T[:3, :3] @ g, surface=turned(surface, T), exit_pose=T, steps=40)
    assert shape.contacts.force.size
    assert farthest(there.position, shape.position @ T[:3, :3].T + T[:3, 3]) < 1e-8
    np.testing.assert_allclose(there.contacts.total, T[:3, :3] @ shape.contacts.total, rtol=0, atol=1e-5)


def test_a_mirrored_robot_presses_the_mirrored_wall():
    shape = solve(prototype(1), 0.9, surface=PLANE)
    mirror = Plane(point=-PLANE.point, normal=-PLANE.normal)
    other = solve(prototype(1).replace(turns=-1.0), 0.9, surface=mirror)
    assert farthest(other.position, shape.position * [1, -1, 1]) < 1e-8
    np.testing.assert_allclose(other.contacts.total, shape.contacts.total * [1, -1, 1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), GRAVITY], ids=["weightless", "heavy"])
def test_a_surface_far_away_changes_nothing(gravity):
    far = Plane(point=(0, 0, -1.0), normal=(0, 0, 1))
    more = {"gravity": gravity, "steps": 40, "accuracy": 1e-10}
    shape = solve(prototype(1), 0.9, surface=far, **more)
    free = solve(prototype(1), 0.9, loads=[PointLoad()], **more)
    assert shape.contacts.force.size == 0
    np.testing.assert_array_equal(shape.contacts.total, np.zeros(3))
    np.testing.assert_allclose(shape.position, free.position, rtol=0, atol=1e-13)
    assert farthest(shape.at(free.s).position, solve(prototype(1), 0.9, **more).at(free.s).position) < 1e-9


def test_without_a_surface_there_are_no_contacts():
    assert solve(prototype(1), 0.5).contacts is None
    assert solve(prototype(1), 0.5, loads=[PointLoad()]).contacts is None


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())
def test_a_warm_start_leads_to_the_same(surface):
    surface = surface(1)
    more = {"surface": surface, "contact_tolerance": TOL, "accuracy": TOL}
    near = solve(prototype(1), 0.85, gravity=GRAVITY, **more)
    warm = solve(prototype(1), 0.9, gravity=GRAVITY, start=near, **more)
    cold = solve(prototype(1), 0.9, gravity=GRAVITY, **more)
    free = solve(prototype(1), 0.9, gravity=GRAVITY, start=solve(prototype(1), 0.9), **more)
    s = np.linspace(0.0, cold.length, 51)
    for shape in (warm, free):
        assert farthest(shape.at(s).position, cold.at(s).position) < 5.0 * TOL
        np.testing.assert_allclose(shape.contacts.total, cold.contacts.total, rtol=0.01, atol=1e-5)


def test_insertion_past_a_wall():
    wall = Plane(point=(0.0, 10e-3, 0.0), normal=(0.0, -1.0, 0.0))
    last, pressed = None, []
    for insertion in np.linspace(0.3, 1.0, 15):
        cold = solve(prototype(1), 0.9, insertion=insertion, surface=wall)
        last = solve(prototype(1), 0.9, insertion=insertion, surface=wall, start=last)
        assert_lawful(last, wall, 1e-5)
        assert np.linalg.norm(last.tip - cold.tip) < 5e-5
        pressed.append(bool(last.contacts.force.size))
    assert not pressed[0]
    assert pressed[-1]
    assert np.diff(np.array(pressed, dtype=int)).tolist().count(1) >= 1


def test_segments_touch_with_their_own_radius():
    thick = PlainRod(length=0.05, radius=1e-3, youngs_modulus=75e9, shear_modulus=25e9, density=0.0)
    thin = PlainRod(length=0.05, radius=0.4e-3, youngs_modulus=75e9, shear_modulus=25e9, density=0.0)
    robot = Robot(name="two", body=Segments(segments=(thick, thin)))
    floor = Plane(point=(2e-3, 0, 0), normal=(-1, 0, 0))
    shape = solve(robot, (), distributed_force=(4.0, 0, 0), surface=floor)
    assert_lawful(shape, floor, 1e-5)
    assert shape.contacts.s.min() > 0.05
    np.testing.assert_allclose(shape.centerline[-1, 0], 2e-3 - 0.4e-3, rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    "surface",
    [
        Sphere(center=(6e-3, 6e-3, 25e-3), radius=5e-3),
        Cavity(center=(0.0, 0.0, 34e-3), radius=37e-3),
        Walls(surfaces=[PLANE, Plane(point=(0, 0, 65e-3), normal=(0, 0, -1))]),
    ],
    ids=["sphere", "cavity", "walls"],
)
def test_other_surfaces(surface):
    shape = solve(prototype(1), 0.9, surface=surface)
    assert shape.contacts.force.size
    assert shape.stable
    assert_lawful(shape, surface, 1e-5)


class Foreign:
    """A caller's own plane, without a curvature."""

    def distance(self, points):
        return PLANE.distance(points)


def gridded(surface, spacing: float, low=(-30e-3, -30e-3, -5e-3), high=(30e-3, 30e-3, 90e-3)) -> DistanceGrid:
    axes = [np.arange(a, b + spacing, spacing) for a, b in zip(low, high, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = surface.distance(nodes.reshape(-1, 3))[0].reshape(nodes.shape[:3])
    return DistanceGrid(origin=low, spacing=spacing, values=values)


def test_a_surface_of_the_caller_s_own_is_as_good():
    own, shape = solve(prototype(1), 0.9, surface=Foreign()), solve(prototype(1), 0.9, surface=PLANE)
    assert farthest(own.position, shape.position) < 1e-8


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())
def test_a_grid_of_distances_is_as_good_as_its_interpolation(surface):
    surface = surface(1)
    grid = gridded(surface, 1e-3)
    shape, other = solve(prototype(1), 0.7, surface=surface), solve(prototype(1), 0.7, surface=grid)
    missed = np.abs(grid.distance(shape.centerline)[0] - surface.distance(shape.centerline)[0]).max()
    assert farthest(other.at(shape.s).position, shape.position) < 1e-5 + 20.0 * missed
    assert np.linalg.norm(other.contacts.total - shape.contacts.total) < 1e-4 + 0.02 * np.linalg.norm(
        shape.contacts.total
    )
    assert_lawful(other, grid, 1e-5)


# Many


def unit(random: np.random.Generator) -> np.ndarray:
    direction = random.normal(size=3)
    return direction / np.linalg.norm(direction)


def some_problem(seed: int):
    """(robot, arguments, surface): up to the plateau; the free robot would enter the surface, its exit does not."""
    random = np.random.default_rng(seed)
    number = int(random.integers(4)) + 1
    robot, radius = prototype(number), radius_of(number)
    asked = {
        "tensions": random.uniform() * plateau(number),
        "insertion": random.uniform(0.3, 1.0),
        "rotation": random.uniform(-3.0, 3.0),
        "gravity": 9.81 * unit(random) * float(random.random() < 0.5),
    }
    kind = random.integers(3)
    free = solve(robot, **asked, s=np.linspace(0.0, asked["insertion"] * robot.length_na, 60))
    for _ in range(500):
        near = free.centerline[random.integers(10, 60)]
        if kind == 0:
            surface = Plane(point=near - unit(random) * random.uniform(0.0, 4e-3), normal=unit(random))
        elif kind == 1:
            size = random.uniform(1.3, 10.0) * radius
            middle, axis = np.zeros(3), np.array([0.0, 0.0, 1.0])
            middle[:2], axis[:2] = 0.2 * size * random.normal(size=2), 0.1 * random.normal(size=2)
            surface = Tube(point=middle, axis=axis, radius=size)
        else:
            size = random.uniform(1e-3, 8e-3)
            surface = Cylinder(point=near + 3e-3 * random.normal(size=3), axis=unit(random), radius=size)
        room = surface.distance(np.zeros((1, 3)))[0][0] - radius
        if room > 2e-4 and surface.distance(free.centerline)[0].min() < radius - 1e-4:
            return robot, asked, surface
    raise RuntimeError(f"no problem of seed {seed}")


@cache
def campaign() -> dict[int, tuple[Shape, object]]:
    found = {}
    for seed in range(100):
        robot, asked, surface = some_problem(seed)
        found[seed] = solve(robot, **asked, surface=surface, throw=False), surface
    return found


def test_random_problems_converge_or_say_that_they_stalled():
    stalled = [seed for seed, (shape, _) in campaign().items() if not shape.converged]
    assert all(campaign()[seed][0].status in (Status.STALLED, Status.TOO_FINE) for seed in stalled), stalled
    assert len(stalled) <= 3, stalled


def test_random_problems_keep_the_law():
    for seed, (shape, surface) in campaign().items():
        if shape.converged:
            found = shape.contacts
            deep = depth(shape, surface)
            assert deep < 1e-5, f"seed {seed}: {1e6 * deep:.3g} um deep"
            assert shape.stable, f"seed {seed}"
            assert (found.force > 0.0).all(), f"seed {seed}"
            assert found.gap.max(initial=0.0) < 1e-5, f"seed {seed}"


# Bad input


class Silent:
    """Not a surface."""


class Unsure:
    """Knows no distance beyond z = 20 mm."""

    def __init__(self, limit: float) -> None:
        self.limit = limit

    def distance(self, points):
        d, normal = PLANE.distance(points)
        return np.where(points[:, 2] > self.limit, np.nan, d), normal


BY_AREA = Robot(
    name="by area",
    body=PlainRod(
        length=0.1, area=1e-6, ix=1e-13, iy=1e-13, j=2e-13, youngs_modulus=75e9, shear_modulus=25e9, density=0.0
    ),
)


@pytest.mark.parametrize("insertion", [1.0, 0.0])
@pytest.mark.parametrize(
    ("field", "robot", "more"),
    [
        ("surface", prototype(1), {"surface": Silent()}),
        ("surface", prototype(1), {"surface": 3.0}),
        ("surface", prototype(1), {"surface": Plane}),
        ("surface.distance(points)[0]", prototype(1), {"surface": Unsure(-1.0)}),
        ("surface", BY_AREA, {"surface": PLANE}),
        ("contact_tolerance", prototype(1), {"surface": PLANE, "contact_tolerance": 0.0}),
        ("contact_tolerance", prototype(1), {"surface": PLANE, "contact_tolerance": -1e-6}),
        ("contact_tolerance", prototype(1), {"surface": PLANE, "contact_tolerance": np.nan}),
    ],
)
def test_bad_input_is_named(field, robot, more, insertion):
    with pytest.raises(InvalidInput) as error:
        solve(robot, insertion=insertion, **more)
    assert error.value.field == field


def test_a_surface_that_loses_its_distance_on_the_way_is_named():
    with pytest.raises(InvalidInput) as error:
        solve(prototype(1), 0.9, surface=Unsure(20e-3))
    assert error.value.field == "surface.distance(points)[0]"


@pytest.mark.parametrize(
    "surface",
    [
        Plane(point=(0, 1e-4, 0), normal=(0, -1, 0)),
        Plane(point=(0, -5e-3, 0), normal=(0, -1, 0)),
        Tube(point=(0, 0, 0), axis=(0, 0, 1), radius=0.4e-3),
        Cylinder(point=(0, 1e-3, 0), axis=(1, 0, 0), radius=2e-3),
    ],
    ids=["plane through the exit", "behind the plane", "tube too narrow", "in the cord"],
)
def test_an_exit_inside_the_surface_is_named(surface):
    with pytest.raises(InvalidInput) as error:
        solve(prototype(1), 0.5, surface=surface)
    assert error.value.field == "surface"


def test_a_touch_rolls_on_the_wall_in_derivatives():
    """A touch spread over neighbouring stages does not clamp the rod there; against differences of solves."""
    robot, wall, h = prototype(1), Plane(point=(0.0, 0.015, 0.0), normal=(0.0, -1.0, 0.0)), 1e-5
    for tolerance in (1e-4, 1e-5, 1e-6):
        asked = {"tensions": 0.7, "gravity": (-9.81, 0.0, 0.0), "surface": wall, "contact_tolerance": tolerance}
        shape = solve(robot, **asked)
        pushed = [[sign * h * axis for sign in (1, -1)] for axis in np.eye(3)]
        sides = [[solve(robot, tip_force=force, start=shape, **asked).tip for force in pair] for pair in pushed]
        expected = np.array([(up - down) / (2 * h) for up, down in sides]).T
        np.testing.assert_allclose(shape.tip_compliance[:3, :3], expected, atol=0.04 * abs(expected[1:, 1:]).max())
