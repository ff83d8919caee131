"""Derivatives of shapes against differences of solves, closed forms, reciprocity and chain rules."""

import dataclasses

import numpy as np
import pytest

from tendonrod import InvalidInput, Robot, Segments, Shape, Tendon, solve
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.rotation import exp_so3, log_so3
from tendonrod.surface import Plane
from textbook import GRAVITY, helix_rod, prototype, rod

FIXED = {"steps": 16, "accuracy": 1e-11}
STEP = {  # of the differences, where the input has no size of its own
    "tensions": 1e-3, "displacements": 1e-5, "gravity": 0.05, "tip_force": 1e-4, "tip_moment": 3e-6,
    "distributed_force": 2e-3, "distributed_moment": 1e-4, "insertion": 5e-4, "rotation": 5e-3, "exit_position": 1e-3,
    "exit_rotation": 5e-3, "exit_tilt": 5e-3, "exit_offset": 1e-4,
}  # fmt: skip
STEP_OF_LOAD = {"force": 1e-4, "moment": 3e-6, "mass": 1e-5, "offset": 1e-4, "at": 2e-4}
SIZES = {"tensions": None, "displacements": None, "exit_tilt": 2, "exit_offset": 2}
POSE = np.eye(4)
POSE[:3, :3], POSE[:3, 3] = exp_so3(np.array([0.3, -0.5, 0.2])), (0.01, 0.02, -0.03)


def shifted(robot: Robot, asked: dict, column: str, by: float) -> tuple[Robot, dict]:
    """The robot and the arguments of `solve` with one number changed."""
    asked, (stem, _, index) = dict(asked), column.partition("[")
    if stem == "loads":
        number, _, field = index.partition("].")
        field, _, part = field.partition("[")
        loads = list(asked["loads"])
        value = getattr(loads[int(number)], field)
        value = np.array(value) + by * np.eye(3)[int(part[:-1])] if part else value + by
        loads[int(number)] = dataclasses.replace(loads[int(number)], **{field: value})
        return robot, asked | {"loads": loads}
    if stem in ("exit_position", "exit_rotation"):
        pose, along = np.array(asked.get("exit_pose", np.eye(4))), by * np.eye(3)[int(index[:-1])]
        if stem == "exit_position":
            pose[:3, 3] += along
        else:
            pose[:3, :3] = exp_so3(along) @ pose[:3, :3]
        return robot, asked | {"exit_pose": pose}
    if stem in ("insertion", "rotation"):
        return robot, asked | {stem: asked.get(stem, 1.0 if stem == "insertion" else 0.0) + by}
    if stem in STEP:
        value = asked.get(stem, 0.0)
        if stem == "displacements" and isinstance(value, list):
            return robot, asked | {stem: [each + by * (i == int(index[:-1])) if each is not None else None
                                          for i, each in enumerate(value)]}  # fmt: skip
        size = SIZES.get(stem, 3) or robot.n_tendons
        return robot, asked | {stem: np.broadcast_to(value, size) + by * np.eye(size)[int(index[:-1])]}
    return robot.replace(**{column: robot.parameters()[column] + by}), asked


def differences(shape: Shape, asked: dict, column: str, s: np.ndarray) -> dict[str, np.ndarray]:
    """Fourth-order central differences of solves on the same grid; material points are followed."""
    robot, stem = shape.robot, column.partition("[")[0]
    size = robot.parameters().get(column, 0.0)
    h = STEP_OF_LOAD[column.partition("].")[2].partition("[")[0]] if stem == "loads" else STEP.get(stem)
    h = h or 2e-3 * (abs(size) or 0.05)

    def at(times: float) -> Shape:
        changed, given = shifted(robot, asked, column, times * h)
        length = given.get("insertion", 1.0) * changed.length_na
        where = s + (length - shape.length) if changed is robot else s * (length / shape.length)
        return solve(changed, **given).at(np.clip(where, 0.0, length))

    at_the_edge = size == 0.0 and column.endswith(("friction", "free_length", "radius"))
    rule = {0: -25, 1: 48, 2: -36, 3: 16, 4: -3} if at_the_edge else {-2: 1, -1: -8, 1: 8, 2: -1}
    shapes = [(weight / (12.0 * h), at(times)) for times, weight in rule.items()]
    names = ("position", "v", "u", "tensions")
    found = {name: np.array(sum(weight * getattr(each, name) for weight, each in shapes)) for name in names}
    middle = shape.at(s).rotation.transpose(0, 2, 1)
    found["noise"] = np.array([1e-4 / h])  # below which differences of solves say nothing, in natural units
    found["rotation"] = np.array(sum(weight * log_so3(each.rotation @ middle) for weight, each in shapes))
    return found


def assert_exact(robot: Robot, asked: dict, inputs, share=(1.0,), tolerance=1e-6, **more) -> dict:
    """Every column against differences of solves; returns the worst relative error of each."""
    asked = FIXED | asked
    shape = solve(robot, **asked)
    s = shape.length * np.array(share)
    J, missed = shape.jacobian(*inputs, s=s), {}
    for i, column in enumerate(J.names):
        expected = differences(shape, asked, column, s)
        noise = float(expected.pop("noise")[0])
        natural = {"position": shape.length, "rotation": 1.0, "u": 1.0 / shape.length, "v": 1e-3, "tensions": 1.0}
        size = max(np.abs(each).max() / natural[name] for name, each in expected.items() if each.size)
        for name, each in expected.items():
            got = getattr(J, name)[..., i]
            unit = max(np.abs(each).max(initial=0.0), max(1e-2 * size, noise) * natural[name])
            missed[column] = max(missed.get(column, 0.0), np.abs(got - each).max(initial=0.0) / unit)
    worst = max(missed, key=lambda name: missed[name])
    assert missed[worst] < more.get(worst, tolerance), {k: f"{v:.1e}" for k, v in missed.items() if v > tolerance}
    return missed


def numbers(robot: Robot) -> list[str]:
    """All but friction, whose derivative at 0 has its own test."""
    return [name for name in robot.parameters() if not name.endswith("friction")]


EVERYWHERE = (
    "gravity", "tip_force", "tip_moment", "distributed_force", "distributed_moment", "insertion", "rotation",
    "exit_position", "exit_rotation", "exit_tilt", "exit_offset",
)  # fmt: skip
LOADED = {
    "gravity": (-9.0, 3.0, 2.0),
    "tip_force": (2e-3, 1e-3, -1e-3),
    "tip_moment": (2e-5, -1e-5, 1e-5),
    "distributed_force": (0.02, -0.01, 0.01),
    "distributed_moment": (1e-4, 2e-4, -1e-4),
    "insertion": 0.8,
    "rotation": 0.3,
    "exit_pose": POSE,
    "exit_tilt": (0.02, -0.01),
    "exit_offset": (1e-4, 2e-4),
}
LOADS = (
    PointLoad(force=(1e-3, 2e-3, -1e-3), moment=(1e-5, 0, 1e-5), at=0.045, offset=(1e-3, 0, 2e-3)),
    PointLoad(force=(1e-3, -2e-3, 1e-3), moment=(1e-5, 2e-5, 0), at=0.05, frame="body"),
    LumpedMass(mass=2e-4, at=0.06, offset=(1e-3, 2e-3, 0)),
    DistributedLoad(force=(0.02, 0.01, 0), moment=(1e-4, 0, 1e-4), start=0.03, end=0.06, frame="body"),
)
OF_LOADS = (
    "loads[0].force", "loads[0].moment", "loads[0].offset", "loads[0].at", "loads[1].force", "loads[1].moment",
    "loads[1].at", "loads[2].mass", "loads[2].offset", "loads[3].force", "loads[3].moment",
)  # fmt: skip


def tube() -> Robot:
    return prototype(1, "homogenized")


def two_tubes(**more) -> Robot:
    body = Segments(segments=(tube().body, prototype(3, "open_section").body), angles=(0.7,))
    first = Tendon.opposite_backbone(radius=5e-5, end=0.8 * tube().length_na, **more)
    return Robot(name="two", body=body, tendons=(first, Tendon.constant(x=-4e-4, y=2e-4, **more)))


def rubbing(**more) -> Robot:
    return tube().replace(
        tendons=(dataclasses.replace(tube().tendons[0], axial_stiffness=600.0, free_length=0.3, **more),)
    )


def test_every_input_of_a_notched_tube():
    asked = LOADED | {"tensions": 0.6, "loads": [PointLoad()]}
    assert_exact(tube(), asked, ("tensions", *EVERYWHERE, *numbers(tube())))


def test_every_input_at_the_tip_of_a_shape_of_the_shooting_kernel():
    asked = LOADED | {"tensions": 0.6}
    assert_exact(tube(), asked, ("tensions", *EVERYWHERE, "youngs_modulus", "turns", "length"))


@pytest.mark.parametrize("robot", [tube(), helix_rod()], ids=lambda robot: robot.name)
def test_between_the_nodes_derivatives_are_of_the_integrator_s_order(robot):
    inputs, worst = ("tensions", "gravity", "tip_force", "insertion", "rotation", "youngs_modulus"), []
    for steps in (16, 32):
        asked = LOADED | {"tensions": 0.6, "loads": [PointLoad()], "insertion": 1.0 if robot.n_tendons > 1 else 0.8}
        asked |= {"steps": steps}
        names = inputs if robot.n_tendons == 1 else [name for name in inputs if name != "insertion"]
        worst.append(max(assert_exact(robot, asked, names, (0.31, 0.62), tolerance=1e-3).values()))
    assert worst[1] < 1e-5
    assert worst[1] < max(worst[0] / 8.0, 1e-6)


def test_every_input_of_loads_anywhere():
    asked = LOADED | {"tensions": 0.6, "loads": list(LOADS), "centroid_weight": True}
    assert_exact(tube(), asked, ("tensions", "gravity", "insertion", "rotation", *OF_LOADS))


def test_every_input_of_a_precurved_rod_with_three_tendons():
    robot = helix_rod().replace(precurvature=(2.0, 1.0, 3.0), inner_radius=2e-4)
    asked = LOADED | {"tensions": [0.6, 0.3, 0.8], "tip_force": (0.02, 0.01, -0.02), "loads": [PointLoad()]}
    assert_exact(robot, asked, ("tensions", *EVERYWHERE, *numbers(robot)))


def test_every_input_of_segments():
    robot = two_tubes()
    asked = LOADED | {"tensions": [0.3, 0.2]}
    thin = {f"segment{i}_{side}_radius": 1e-5 for i in (1, 2) for side in ("inner", "outer")}  # walls of 0.1 mm
    assert_exact(robot, asked, ("tensions", *EVERYWHERE, *numbers(robot)), **thin)


SOME = ("gravity", "tip_force", "insertion", "rotation", "youngs_modulus", "turns", "uncut_angle")


def test_pulled_lengths():
    more = ("tendon_axial_stiffness", "tendon_free_length")
    assert_exact(rubbing(), {"displacements": 2e-3, "gravity": GRAVITY, "insertion": 0.8, "loads": [PointLoad()]},
                 ("displacements", *SOME, *more))  # fmt: skip


def test_pulled_lengths_beside_tensions():
    robot = two_tubes(axial_stiffness=600.0)
    asked = {"displacements": [1e-3, None], "tensions": [0.0, 0.2], "gravity": GRAVITY, "insertion": 0.8}
    inputs = ("displacements[0]", "tensions[1]", "gravity", "segment1_turns", "tendon1_axial_stiffness")
    assert_exact(robot, asked, inputs)


@pytest.mark.parametrize("drive", [{"tensions": 0.6}, {"displacements": 2e-3}], ids=["tension", "displacement"])
def test_friction(drive):
    inputs = (*drive, *SOME, "tendon_friction")
    assert_exact(rubbing(friction=0.1), drive | {"gravity": GRAVITY, "insertion": 0.8}, inputs, tolerance=3e-6)


def test_friction_begins_with_a_slope():
    """From none on, one-sided: tension is lost in proportion to the friction and the angle turned through."""
    assert_exact(tube(), {"tensions": 0.6, "loads": [PointLoad()]}, ("tendon_friction",), tolerance=1e-4)


@pytest.mark.parametrize("tension", [0.05, 0.8])
def test_a_tendon_free_in_the_lumen(tension):
    asked = {"tensions": tension, "gravity": GRAVITY, "insertion": 0.8}
    assert_exact(rubbing(wall="free"), asked, ("tensions", *SOME), tolerance=1e-5)  # kinks where it leaves the wall


def test_tip_contact():
    """While the same places touch; the tip alone here."""
    wall = Plane(point=(8e-3, 0, 0), normal=(-1, 0, 0))
    asked = {"tensions": (), "distributed_force": (3.0, 0.1, 0), "surface": wall, "contact_tolerance": 1e-9}
    asked |= {"accuracy": 1e-8}
    inputs = ("distributed_force", "tip_force", "youngs_modulus", "exit_offset")
    robot = rod(length=0.1, radius=0.5e-3)
    assert solve(robot, **asked).contacts.s.size == 1
    assert_exact(robot, asked, inputs, tolerance=1e-4)


# Compliance


def loaded(robot: Robot, **more) -> Shape:
    return solve(robot, **(LOADED | {"tip_moment": (0, 0, 0), "distributed_moment": (0, 0, 0)} | FIXED | more))


@pytest.mark.parametrize("robot", [tube(), two_tubes(), helix_rod(), rubbing(wall="free")], ids=lambda r: r.name)
def test_compliance_is_symmetric_under_loads_with_a_potential(robot):
    asymmetry = []
    for steps in (16, 32, 64):
        C = loaded(robot, tensions=0.3, steps=steps).tip_compliance
        C = C / np.sqrt(np.outer(np.diag(C), np.diag(C)))
        assert (np.linalg.eigvalsh(0.5 * (C + C.T)) > 0.0).all()
        asymmetry.append(np.abs(C - C.T).max())
    assert asymmetry[-1] < 1e-6
    assert asymmetry[-1] < 0.01 * asymmetry[0] + 1e-9  # of the integrator's order, four


def test_compliance_is_the_columns_of_the_tip_wrench():
    shape = loaded(tube(), tensions=0.6, loads=LOADS)
    J = shape.jacobian("tip_force", "tip_moment", s=[shape.length])
    np.testing.assert_allclose(shape.tip_compliance[:3], J.position[0], rtol=0, atol=1e-9 * np.abs(J.position).max())
    np.testing.assert_allclose(shape.tip_compliance[3:], J.rotation[0], rtol=0, atol=1e-9 * np.abs(J.rotation).max())
    np.testing.assert_allclose(shape.tip_stiffness @ shape.tip_compliance, np.eye(6), rtol=0, atol=1e-8)
    assert not shape.tip_compliance.flags.writeable


def test_straight_rod_has_the_compliance_of_beam_theory():
    length = 0.2
    robot = rod(length=length)
    (EI, _, GJ), (GA, _, EA) = robot.section.Kbt, robot.section.Kse
    bend, turn = length**3 / (3 * EI) + length / GA, length**2 / (2 * EI)
    C = np.diag([bend, bend, length / EA, length / EI, length / EI, length / GJ])
    C[0, 4] = C[4, 0] = turn
    C[1, 3] = C[3, 1] = -turn
    np.testing.assert_allclose(solve(robot, ()).tip_compliance, C, rtol=1e-9, atol=1e-12)
    half = solve(robot, (), insertion=0.5).tip_compliance
    np.testing.assert_allclose(half[3, 3], 0.5 * length / EI, rtol=1e-9)


def test_axial_load_softens_a_column_as_euler_says():
    """Tip stiffness under a thrust P: P / (tan(kL)/k - L) with k^2 = P / EI; the rod hardly stretches or shears."""
    robot = rod(length=0.2, G=75e11)  # no shear
    EI, P = robot.section.Kbt[0], 0.15
    k = np.sqrt(P / EI)
    exact = (np.tan(k * 0.2) / k - 0.2) / P
    np.testing.assert_allclose(solve(robot, (), tip_force=(0, 0, -P)).tip_compliance[0, 0], exact, rtol=5e-5)


# Chain rules


def test_the_pose_of_the_exit_moves_an_unloaded_robot_rigidly():
    shape = solve(tube(), 0.6, exit_pose=POSE, **FIXED)
    s = shape.length * np.array([0.0, 0.4, 1.0])
    J, at, o = shape.jacobian("exit_position", "exit_rotation", "rotation", s=s), shape.at(s), POSE[:3, 3]
    for k in range(3):
        arm = at.position[k] - o
        np.testing.assert_allclose(J["exit_position"].position[k], np.eye(3), rtol=0, atol=1e-8)
        np.testing.assert_allclose(J["exit_position"].rotation[k], 0.0, rtol=0, atol=1e-7)
        np.testing.assert_allclose(J["exit_rotation"].rotation[k], np.eye(3), rtol=0, atol=1e-8)
        turning = np.cross(np.eye(3), arm).T  # columns e_i x arm
        np.testing.assert_allclose(J["exit_rotation"].position[k], turning, rtol=0, atol=1e-9)
        z = POSE[:3, 2]
        np.testing.assert_allclose(J["rotation"].position[k, :, 0], np.cross(z, arm), rtol=0, atol=1e-9)
        np.testing.assert_allclose(J["rotation"].rotation[k, :, 0], z, rtol=0, atol=1e-8)
    np.testing.assert_allclose(J.u, 0.0, rtol=0, atol=1e-5)
    np.testing.assert_allclose(J.v, 0.0, rtol=0, atol=1e-7)


def test_moving_the_exit_moves_everything_with_it_under_dead_loads_too():
    J = loaded(tube(), tensions=0.6).jacobian("exit_position")
    np.testing.assert_allclose(J.position, np.broadcast_to(np.eye(3), J.position.shape), rtol=0, atol=1e-8)


def test_uniform_force_and_weight_agree():
    shape = loaded(tube(), tensions=0.6)
    J = shape.jacobian("gravity", "distributed_force")
    weight = tube().section.line_density
    np.testing.assert_allclose(J["gravity"].position, weight * J["distributed_force"].position, rtol=0, atol=1e-12)


def test_tension_and_pulled_length_are_reciprocal():
    """The tip's motion by a length at held displacements is that by the tension over the length's change by it."""
    shape = solve(rubbing(), displacements=2e-3, gravity=GRAVITY, **FIXED)
    by_length = shape.jacobian("displacements", s=[shape.length])
    same = solve(rubbing(), float(shape.tensions[0]), gravity=GRAVITY, **FIXED, loads=[PointLoad()])
    by_tension = same.jacobian("tensions", s=[shape.length])
    np.testing.assert_allclose(by_length.position, by_tension.position * by_length.tensions[0, 0], rtol=1e-6)
    assert by_length.tensions[0, 0] > 0.0
    np.testing.assert_array_equal(by_tension.tensions, [[1.0]])


def test_work_of_tendon_and_tip_is_reciprocal():
    """d tau / dF = - dp / d(pulled length), second derivatives of one energy (Maxwell-Betti)."""
    shape = solve(rubbing(), displacements=2e-3, tip_force=(2e-3, 1e-3, 0), steps=64, accuracy=1e-11)
    J = shape.jacobian("tip_force", "displacements", s=[shape.length])
    by_force, by_length = J["tip_force"].tensions[0], J["displacements"].position[0, :, 0]
    np.testing.assert_allclose(by_force, -by_length, rtol=0, atol=1e-6 * np.abs(by_length).max())


# What is asked and how


def test_columns_have_names():
    shape = solve(helix_rod(), 0.3, loads=LOADS[:1])
    J = shape.jacobian("tip_force", "insertion", "tensions", "loads[0].force", "gravity[1]")
    force = ("tip_force[0]", "tip_force[1]", "tip_force[2]")
    pulls = ("tensions[0]", "tensions[1]", "tensions[2]")
    loads = tuple(f"loads[0].force[{i}]" for i in range(3))
    assert J.names == (*force, "insertion", *pulls, *loads, "gravity[1]")
    assert J["tip_force"].names == force
    assert J["insertion"].position.shape == (shape.s.size, 3, 1)
    assert J["loads[0].force"].names == loads
    assert J.tensions.shape == (3, len(J.names))
    np.testing.assert_array_equal(J["tip_force"].position, J.position[..., :3])
    np.testing.assert_array_equal(J.s, shape.s)
    assert not J.position.flags.writeable
    assert J["tensions[1]"].names == ("tensions[1]",)
    with pytest.raises(InvalidInput, match="name"):
        J["tip_moment"]


@pytest.mark.parametrize(
    "name",
    ["nonsense", "tip_force[3]", "tip_force[x]", "tensions[1]", "displacements", "loads[1].force", "loads[0].mass",
     "loads[0].frame", "loads[x].force", "loads[0].force[7]", "loads[0]", "insertion[0]", "name", "torsion",
     "length[0]"],
)  # fmt: skip
def test_wrong_names_are_refused_by_name(name):
    shape = solve(tube(), 0.3, loads=LOADS[:1])
    with pytest.raises(InvalidInput) as error:
        shape.jacobian(name)
    assert error.value.field == "inputs"
    assert str(error.value.value) in f"{name}[0]"


def test_derivatives_of_nothing_are_refused():
    with pytest.raises(InvalidInput, match="jacobian"):
        solve(tube(), 0.3, insertion=0.0).jacobian("tensions")
    failed = solve(tube(), 1e4, throw=False)
    assert not failed.converged
    with pytest.raises(InvalidInput, match="tip_compliance"):
        _ = failed.tip_compliance
    with pytest.raises(InvalidInput, match="s = "):
        solve(tube(), 0.3).jacobian("tensions", s=[1.0])
