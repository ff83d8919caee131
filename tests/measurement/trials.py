"""A trial as a bench gives it: one tracker on the base and two on the robot, with everything that goes wrong there."""

import numpy as np

from tendonrod import Robot, load_robot
from tendonrod.measurement.trial import BASE, Tracker, Trial
from tendonrod.rotation import exp_so3
from tendonrod.tendon import Tendon

T_WORLD_FIELD = np.eye(4)
T_WORLD_FIELD[:3, :3], T_WORLD_FIELD[:3, 3] = exp_so3(np.array([0.3, -1.1, 0.4])), (0.12, -0.03, 0.25)
TRACKERS = (
    Tracker(name="base", on=BASE, offset=(0.004, 0.0, -0.002), turn=(0.0, 0.0, 0.5)),
    Tracker(name="middle", at=0.04, point=(0.0003, 0.0), offset=(0.0, 0.0006, 0.0), turn=(0.1, 0.0, -2.0), mass=2e-4),
    Tracker(name="tip", mass=2e-4),
)


def some_robot() -> Robot:
    """Prototype 1 with numbers that are round in no unit, and two tendons."""
    free = Tendon.opposite_backbone(radius=0.05e-3, friction=0.07, axial_stiffness=1500.0, free_length=0.3, wall="free")
    path = np.linspace(0.0, 0.05, 6)
    sampled = Tendon.sampled(path, 3e-4 * np.cos(7.0 * path), 3e-4 * np.sin(7.0 * path), end=0.05)
    return load_robot("exonav-1").replace(
        name="mine", youngs_modulus=75e9 / 0.93, length=0.1 / 1.3, tendons=(free, sampled)
    )


def some_trial(**changes) -> Trial:
    """12 samples of 3 trackers on `some_robot`; ``changes`` replace fields, those of another n, k or robot all of them.

    Of the tip: frames 2 and 7 are missing, 4 is of poor quality. Frame 6 repeats a time, frame 9 has no tension of
    tendon 2. The middle tracker is inside the outer tube in the last two. Positions follow no model.
    """
    n, rng = 12, np.random.default_rng(5)
    turn = rng.normal(size=(n, 3, 4))
    time = 1.7e9 + np.arange(n) / 40.0
    tensions, position = rng.uniform(0.0, 1.2, (n, 2)), rng.normal(scale=0.05, size=(n, 3, 3))
    quality, state = rng.uniform(1e-5, 3e-4, (n, 3)), np.full((n, 3), "", dtype=object)
    time[6], tensions[9, 1], quality[4, 2] = time[5], np.nan, 2e-3
    position[[2, 7], 2] = turn[[2, 7], 2] = quality[[2, 7], 2] = np.nan
    state[2, 2], state[7, 2], state[3, 0] = "MISSING", "out of volume, µ-field", "OK"
    values = {
        "name": "some trial",
        "robot": some_robot(),
        "trackers": TRACKERS,
        "time": time,
        "position": position,
        "orientation": turn / np.linalg.norm(turn, axis=-1, keepdims=True),
        "quality": quality,
        "state": state,
        "tensions": tensions,
        "displacements": rng.uniform(0.0, 2e-3, (n, 2)),
        "insertion": np.linspace(0.9, 0.4, n),
        "rotation": np.linspace(0.0, 1.0, n),
        "gravity": (0.0, -9.81, 0.0),
        "T_world_field": T_WORLD_FIELD,
        "quality_limit": 1e-3,
        "position_noise": 5e-4,
        "orientation_noise": 0.3 * np.pi / 180.0,
        "tension_noise": 2e-3,
        "notes": "second day\nnew holder, 0.4 mm",
        "origin": {"made by": "the tests", "file": "no such bench.csv"},
    }
    return Trial(**(values | changes))
