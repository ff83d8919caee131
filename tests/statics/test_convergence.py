"""Order of the integrator, and `accuracy` kept on problems drawn at random."""

import numpy as np
import pytest

from tendonrod import solve
from textbook import GRAVITY, farthest, four_tendon_rod, helix_rod, prototype

LOADED = {
    "exonav-1": (prototype(1), 0.7, {"gravity": GRAVITY}),
    "exonav-1 open": (prototype(1, "open_section"), 0.5, {"gravity": (0.0, 9.81, 0.0), "tip_force": (1e-3, 0.0, 1e-3)}),
    "exonav-3 retracted": (prototype(3), 1.2, {"gravity": (0.0, -9.81, 0.0), "insertion": 0.6, "rotation": 1.0}),
    "helical": (four_tendon_rod(1.0), (15.0, 0.0, 0.0, 5.0), {"gravity": (9.81, 0.0, 0.0)}),
    "half-way tendon": (helix_rod(), (6.0, 3.0, 8.0), {"gravity": (0.0, -9.81, 0.0), "tip_force": (0.1, 0.0, 0.0)}),
}
each_load = pytest.mark.parametrize(("robot", "tension", "loads"), LOADED.values(), ids=LOADED.keys())


def tip(robot, tension, loads, steps: int) -> np.ndarray:
    return solve(robot, tension, **loads, steps=steps, accuracy=1e-12).tip


@each_load
def test_order_in_steps_is_four(robot, tension, loads):
    exact = tip(robot, tension, loads, 640)
    counts = np.array([10, 20, 40, 80])
    errors = np.array([np.linalg.norm(tip(robot, tension, loads, int(n)) - exact) for n in counts])
    assert np.all(errors > 1e-13), errors  # truncation, not rounding, is what is measured
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order >= 3.8, errors


def test_eight_steps_give_a_micrometre():
    """physics.md section 2: 8 steps about 1 um at the tip of P1, 12 steps about 0.2 um."""
    robot, tension, loads = LOADED["exonav-1"]
    exact = tip(robot, tension, loads, 200)
    assert np.linalg.norm(tip(robot, tension, loads, 8) - exact) < 2e-6
    assert np.linalg.norm(tip(robot, tension, loads, 12) - exact) < 0.4e-6


def test_steps_fixes_the_number_of_steps():
    for steps in (1, 7, 32):
        shape = solve(prototype(1), 0.7, gravity=GRAVITY, steps=steps)
        assert len(shape.s) == steps + 1
        assert (shape.s[0], shape.s[-1]) == (0.0, prototype(1).section.L_na)


def random_problem(seed: int):
    """Prototype, torsion model, tension to 1 N, gravity and tip wrench in any direction, insertion 0.05 to 1."""
    rng = np.random.default_rng(seed)
    robot = prototype(int(rng.integers(1, 5)), ("published", "open_section")[int(rng.integers(2))])
    direction, push, twist = (x / np.linalg.norm(x) for x in rng.normal(size=(3, 3)))
    insertion = float(rng.uniform(0.05, 1.0))
    length = insertion * robot.section.L_na
    unit = robot.section.Kbt[:2].min() / length**2  # EI/L^2: a tip force of 1 bends strongly
    loads = {
        "gravity": 9.81 * direction,
        "tip_force": rng.uniform(0.0, 0.7) * min(unit, 0.2) * push * (rng.random() < 0.6),
        "tip_moment": rng.uniform(0.0, 0.7) * min(unit * length, 5e-4) * twist * (rng.random() < 0.4),
        "insertion": insertion,
        "rotation": float(rng.uniform(-3.0, 3.0)),
    }
    return robot, float(rng.uniform(0.0, 1.0)), loads


@pytest.mark.parametrize("seed", range(48))
def test_accuracy_is_kept_anywhere_on_the_body(seed):
    robot, tension, loads = random_problem(seed)
    s = np.linspace(0.0, loads["insertion"] * robot.section.L_na, 41)
    exact = solve(robot, tension, **loads, s=s, accuracy=1e-10)
    assert farthest(solve(robot, tension, **loads, s=s).position, exact.position) <= 1e-6  # the default
    assert farthest(solve(robot, tension, **loads, s=s, accuracy=1e-8).position, exact.position) <= 1e-8


@each_load
@pytest.mark.parametrize("accuracy", [1e-4, 1e-6, 1e-8])
def test_accuracy_asked_is_accuracy_given(robot, tension, loads, accuracy):
    s = np.linspace(0.0, loads.get("insertion", 1.0) * robot.section.L_na, 53)
    exact = solve(robot, tension, **loads, s=s, accuracy=1e-11)
    assert farthest(solve(robot, tension, **loads, s=s, accuracy=accuracy).position, exact.position) <= accuracy


@each_load
def test_samples_are_points_of_the_same_shape(robot, tension, loads):
    """Nodes asked for by s are the nodes; other s lie between them at the same accuracy; their order is kept."""
    nodes = solve(robot, tension, **loads)
    again = solve(robot, tension, **loads, s=nodes.s)
    assert np.array_equal(again.s, nodes.s)
    assert farthest(again.position, nodes.position) < 1e-12
    assert np.abs(again.rotation - nodes.rotation).max() < 1e-10
    few = solve(robot, tension, **loads, s=nodes.s[[2, -1]])
    assert farthest(few.position, nodes.position[[2, -1]]) < 1e-12
    assert farthest(few.tip, nodes.tip) < 1e-12
    inner = solve(robot, tension, **loads, s=nodes.s[2:4])
    assert farthest(inner.tip, nodes.tip) < 1e-12  # the tip is the robot's, not the last sample's
