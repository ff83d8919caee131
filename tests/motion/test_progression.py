"""Progressive motion: where the exposed robot begins, and that it follows its leader where nothing pulls at it."""

import numpy as np
import pytest

from tendonrod import InvalidInput, NotConverged, Robot, solve
from tendonrod.motion.progression import progress
from textbook import GRAVITY, PROTOTYPES, about_z, farthest, four_tendon_rod, helix_rod, prototype

NUMBERS = range(1, len(PROTOTYPES) + 1)
INSERTIONS = np.linspace(0.0, 1.0, 6)


def straight(robot: Robot, s: float) -> np.ndarray:
    """T*(s), the pose of the unloaded, fully inserted robot (paper, p* and R*), as a matrix."""
    r, L, angle = robot.section.r_na, robot.section.L, 2 * np.pi * robot.turns * s / robot.length_na
    T = np.eye(4)
    T[:3, :3] = about_z(angle)
    T[:3, 3] = [-r * np.cos(angle), -r * np.sin(angle), L * s / robot.length_na]
    return T


def motor(angle: float, shift: float) -> np.ndarray:
    """What the motors do to the robot in its outer tube: turn it about z and move it along z."""
    T = np.eye(4)
    T[:3, :3], T[2, 3] = about_z(angle), shift
    return T


def placed(T: np.ndarray, shape) -> np.ndarray:
    """Positions of ``shape`` if its first section had the pose ``T``."""
    return (shape.position - shape.position[0]) @ (T[:3, :3] @ shape.rotation[0].T).T + T[:3, 3]


# ---- where the exposed robot begins (physics.md, section 1) ----


@pytest.mark.parametrize("number", NUMBERS)
def test_base_stands_at_the_exit(number):
    robot = prototype(number)
    rotation = np.linspace(-1.0, 2.0, INSERTIONS.size)
    motion = progress(robot, INSERTIONS, rotation, 0.7, gravity=GRAVITY)
    for phi, shape in zip(rotation, motion.shapes, strict=True):
        np.testing.assert_allclose(shape.position[0], about_z(phi) @ [-robot.section.r_na, 0, 0], rtol=0, atol=1e-18)
        np.testing.assert_allclose(shape.rotation[0], about_z(phi), rtol=0, atol=1e-16)
        np.testing.assert_allclose(shape.centerline[0], 0.0, atol=1e-18)


@pytest.mark.parametrize("turns", [1.0, -1.0, 0.0, 2.5])
def test_base_is_where_the_motors_bring_it(turns):
    """phi_p = rotation + 2 pi turns (eta - 1) and a pull-back by (1 - eta) L act on T*((1 - eta) L_na)."""
    robot = prototype(1).replace(turns=turns)
    for eta, phi in ((0.0, 0.3), (0.25, -1.0), (0.8, 0.0), (1.0, 2.0)):
        phi_p = phi + 2 * np.pi * turns * (eta - 1)
        moved = motor(phi_p, -(1 - eta) * robot.section.L)
        expected = moved @ straight(robot, (1 - eta) * robot.length_na)
        shape = solve(robot, 0.0, insertion=eta, rotation=phi)
        np.testing.assert_allclose(shape.position[0], expected[:3, 3], rtol=0, atol=1e-16)
        np.testing.assert_allclose(shape.rotation[0], expected[:3, :3], rtol=0, atol=1e-14)


def test_nothing_exposed_is_a_valid_empty_shape():
    robot = prototype(1)
    motion = progress(robot, [0.0, 1e-9, 0.5, 0.0], 0.4, 0.7, gravity=GRAVITY)
    exit_point = about_z(0.4) @ [-robot.section.r_na, 0.0, 0.0]
    for shape in (motion.shapes[0], motion.shapes[3]):
        assert shape.converged
        assert (shape.length, shape.insertion) == (0.0, 0.0)
        np.testing.assert_array_equal(shape.s, [0.0])
        np.testing.assert_allclose(shape.tip, exit_point, rtol=0, atol=1e-18)
        np.testing.assert_allclose(shape.position, [exit_point], rtol=0, atol=1e-18)
        assert np.all(np.isfinite(shape.centerline))
        assert shape.tendon_path(0).shape == (1, 3)
    np.testing.assert_allclose(motion.tip[1], exit_point, rtol=0, atol=1e-9)


@pytest.mark.parametrize("eta", [0.0, 1e-12, 1e-6])
def test_tip_leaves_the_exit_without_a_jump(eta):
    robot = prototype(2)
    moved = np.linalg.norm(solve(robot, 0.7, GRAVITY, insertion=eta).tip - [-robot.section.r_na, 0.0, 0.0])
    assert moved == pytest.approx(eta * robot.length_na, rel=1e-3, abs=1e-18)


# ---- constant tension is follow-the-leader motion where nothing pulls ----


@pytest.mark.parametrize("torsion", ["published", "open_section", "homogenized"])
@pytest.mark.parametrize("number", NUMBERS)
def test_without_load_the_body_lies_on_its_leader(number, torsion):
    robot = prototype(number, torsion)
    whole = solve(robot, 0.7)
    motion = progress(robot, INSERTIONS, 0.0, 0.7, samples=41)
    for shape in motion.shapes:
        leader = whole.at(shape.s)
        assert farthest(shape.position, leader.position) < 1e-10
        np.testing.assert_allclose(shape.rotation, leader.rotation, rtol=0, atol=1e-10)


@pytest.mark.parametrize("number", NUMBERS)
def test_the_printed_base_would_miss_the_leader(number):
    """p(0) = p*((1 - eta) L_na) as printed: the base drifts by (1 - eta) L. Pulled back and turned, it is right."""
    robot = prototype(number)
    whole = solve(robot, 0.7)
    for eta in (0.2, 0.5, 0.9):
        shape = solve(robot, 0.7, insertion=eta, s=np.linspace(0.0, eta * robot.length_na, 41))
        leader = whole.at(shape.s).position
        at_exit, law = straight(robot, (1 - eta) * robot.length_na), 2 * np.pi * (eta - 1)
        printed = placed(at_exit, shape)
        assert printed[0, 2] == pytest.approx((1 - eta) * robot.section.L, rel=1e-12)
        assert np.linalg.norm(printed - leader, axis=1).min() > 0.5 * (1 - eta) * robot.section.L
        corrected = placed(motor(law, -(1 - eta) * robot.section.L) @ at_exit, shape)
        assert farthest(corrected, leader) < 1e-10


def test_with_gravity_constant_tension_does_not_follow():
    robot = prototype(1)
    whole, shape = (solve(robot, 0.7, GRAVITY, insertion=eta) for eta in (1.0, 0.7))
    assert farthest(shape.tip, whole.at([shape.length]).position) > 0.3e-3


# ---- rotation ----


@pytest.mark.parametrize("angle", [0.3, -2.0, np.pi, 7.0])
def test_rotation_turns_the_shape_where_nothing_pulls(angle):
    straight_on, turned = (progress(prototype(1), INSERTIONS, phi, 0.7, samples=11) for phi in (0.0, angle))
    for a, b in zip(straight_on.shapes, turned.shapes, strict=True):
        assert farthest(b.position, a.position @ about_z(angle).T) < 1e-14
        np.testing.assert_allclose(b.rotation, about_z(angle) @ a.rotation, rtol=0, atol=1e-13)
        np.testing.assert_allclose(b.u, a.u, rtol=0, atol=1e-9)


def test_rotation_together_with_gravity_turns_the_shape():
    R, loads = about_z(0.8), {"samples": 11, "accuracy": 1e-9}
    still = progress(prototype(1), INSERTIONS, 0.0, 0.7, gravity=GRAVITY, **loads)
    turned = progress(prototype(1), INSERTIONS, 0.8, 0.7, gravity=R @ GRAVITY, **loads)
    for a, b in zip(still.shapes, turned.shapes, strict=True):
        assert farthest(b.position, a.position @ R.T) < 2e-9


def test_a_full_turn_changes_nothing():
    once, again = (progress(prototype(1), 0.6, phi, 0.7, gravity=GRAVITY).tip for phi in (0.0, 2 * np.pi))
    assert farthest(once, again) < 1e-11


# ---- sequences ----


def test_a_warm_sequence_gives_the_single_cold_solves():
    insertion = [0.1, 0.5, 1.0, 0.9, 0.0, 0.4]  # forwards, backwards, through nothing
    rotation, tension = [0.0, 0.5, 0.4, -3.0, 0.0, 1.0], [0.1, 0.7, 0.7, 1.0, 0.5, 0.0]
    loads = {"gravity": GRAVITY, "tip_force": (2e-3, 0.0, -1e-3), "accuracy": 1e-9}
    motion = progress(prototype(1), insertion, rotation, tension, samples=21, **loads)
    for k, shape in enumerate(motion.shapes):
        cold = solve(prototype(1), tension[k], insertion=insertion[k], rotation=rotation[k], s=shape.s, **loads)
        assert farthest(shape.position, cold.position) < 2e-9
        assert farthest(motion.tip[k], cold.tip) < 2e-9


def test_a_single_number_holds_throughout():
    motion = progress(prototype(1), INSERTIONS, 0.2, 0.7)
    assert motion.insertion.shape == motion.rotation.shape == (INSERTIONS.size,)
    assert motion.tension.shape == (INSERTIONS.size, 1)
    assert np.all(motion.rotation == 0.2)
    assert np.all(motion.tension == 0.7)
    pulled = progress(prototype(1), 1.0, 0.0, [0.2, 0.7])
    np.testing.assert_array_equal(pulled.insertion, [1.0, 1.0])
    assert progress(prototype(1), 1.0, 0.0, 0.7).tip.shape == (1, 3)


def test_one_column_per_tendon():
    robot = four_tendon_rod(0.0)
    table = np.array([[15.0, 0.0, 0.0, 0.0], [0.0, 0.0, 7.0, 2.0]])
    motion = progress(robot, [1.0, 0.5], 0.0, table)
    for k, shape in enumerate(motion.shapes):
        np.testing.assert_array_equal(shape.tensions, table[k])
        assert farthest(shape.tip, solve(robot, table[k], insertion=motion.insertion[k]).tip) < 2e-6
    assert motion.tip[0, 0] > 0.1  # tendon 1 lies on +x
    equal = progress(robot, 1.0, 0.0, 3.0)
    np.testing.assert_array_equal(equal.tension, [[3.0] * 4])
    assert abs(equal.tip[0, 0]) < 1e-9


def test_samples_are_spread_evenly_and_do_not_move_the_robot():
    robot = prototype(3)
    nodes, evenly = (progress(robot, INSERTIONS[1:], 0.0, 0.7, samples=n, gravity=GRAVITY) for n in (None, 17))
    np.testing.assert_allclose(nodes.tip, evenly.tip, rtol=0, atol=1e-9)
    for eta, shape in zip(INSERTIONS[1:], evenly.shapes, strict=True):
        np.testing.assert_allclose(shape.s, np.linspace(0.0, eta * robot.length_na, 17), rtol=1e-15)
        np.testing.assert_array_equal(shape.position[-1], shape.tip)


def test_no_tendons_and_no_rows():
    rod = helix_rod().replace(tendons=())
    assert progress(rod, [0.5, 1.0], 0.0, 0.0).tension.shape == (2, 0)
    assert progress(prototype(1), [], [], []).tip.shape == (0, 3)


def test_watch_is_called_after_each_step():
    calls = []
    progress(prototype(1), INSERTIONS, 0.0, 0.7, watch=lambda done, n: calls.append((done, n)))
    assert calls == [(k, INSERTIONS.size) for k in range(1, INSERTIONS.size + 1)]


# ---- bad input ----

NAN, INF = float("nan"), float("inf")
BAD_ROWS = [
    ({"insertion": [0.5, 1.2]}, "row 2: insertion = 1.2: must be from 0 to 1"),
    ({"insertion": [-0.1, 1.2]}, "row 1: insertion = -0.1: must be from 0 to 1"),
    ({"insertion": [0.5, NAN, 1.0]}, "insertion[1] = nan"),
    ({"rotation": [0.0, 0.0, INF]}, "rotation[2] = inf: must be a finite number"),
    ({"tension": [0.7, -0.1]}, "row 2: tension[0] = -0.1: must be >= 0"),
    ({"tension": [NAN]}, "tension[0] = nan"),
    ({"gravity": (0.0, 0.0)}, "row 1: gravity = (0.0, 0.0): must be a vector of 3 finite numbers"),
    ({"insertion": [0.1, 0.2], "tension": [0.7] * 3}, "insertion = 2 rows: must be 1 row, or as many as the others, 3"),
    ({"tension": [[0.7, 0.1]]}, "tension = 2 columns: must be one column per tendon, 1"),
    ({"insertion": "all"}, "insertion = 'all': must be "),
    ({"rotation": [0.0, [1.0, 2.0]]}, "rotation = [0.0, [1.0, 2.0]]: must be "),
]


@pytest.mark.parametrize(("given", "message"), BAD_ROWS, ids=[message for _, message in BAD_ROWS])
@pytest.mark.parametrize("samples", [None, 5])
def test_errors_name_row_and_field(given, message, samples):
    arguments = {"insertion": 0.5, "rotation": 0.0, "tension": 0.7, "samples": samples, **given}
    with pytest.raises(InvalidInput) as caught:
        progress(prototype(1), **arguments)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


BAD_SHAPES = [
    ("insertion", {"insertion": [[0.5, 1.0]]}),
    ("rotation", {"rotation": [[0.0, 1.0]]}),
    ("tension", {"tension": [[[0.7]]]}),
    ("samples", {"samples": -1}),
    ("samples", {"samples": 2.5}),
    ("samples", {"samples": "many"}),
    ("robot", {"robot": "exonav-1"}),
]


@pytest.mark.parametrize(("field", "given"), BAD_SHAPES, ids=[f"{field}-{given}" for field, given in BAD_SHAPES])
def test_what_is_no_table_is_named(field, given):
    arguments = {"robot": prototype(1), "insertion": 0.5, "rotation": 0.0, "tension": 0.7, **given}
    with pytest.raises(InvalidInput, match=field):
        progress(**arguments)


def test_a_step_without_equilibrium_names_its_row():
    with pytest.raises(NotConverged, match=r"^row 3: "):
        progress(prototype(1), 1.0, 0.0, [0.1, 0.2, 1e6])
