"""A bench whose truth is known: trials without positions, and what trackers and load cells would say in truth."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tendonrod import LumpedMass, Robot, load_robot, solve
from tendonrod.measurement.prediction import predict
from tendonrod.measurement.setup import Setup
from tendonrod.measurement.trial import BASE, Tracker, Trial
from tendonrod.rotation import exp_so3, log_so3

ROBOT = load_robot("exonav-1").replace(torsion="homogenized")
GRAVITY = (-9.81, 0.0, 0.0)
NOISE, READING_NOISE, TURN_NOISE = 0.5e-3, 5e-3, 5e-3  # m, N, rad


def motion(turn, shift) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_so3(np.array(turn)), shift
    return T


def blank(tensions, trackers: Sequence[Tracker] = (Tracker(name="tip"),), robot: Robot = ROBOT, **fields) -> Trial:
    """A trial in which all trackers were seen at the origin of the field."""
    n = len(tensions)
    given = {
        "name": "a",
        "robot": robot,
        "trackers": tuple(trackers),
        "time": np.arange(n) / 40.0,
        "position": np.zeros((n, len(trackers), 3)),
        "tensions": tensions,
        "gravity": GRAVITY,
        "T_world_field": np.eye(4),
    }
    return Trial(**(given | fields))


def along(shares: Sequence[float], length: float = ROBOT.length_na, **fields) -> tuple[Tracker, ...]:
    """Trackers at these shares of the length."""
    return tuple(Tracker(name=f"s{100 * share:g}", at=share * length, **fields) for share in shares)


def seen(trials: Sequence[Trial], truth: Setup, seed: int | None = None) -> tuple[Trial, ...]:
    """The trials as instruments would have them, were ``truth`` so; without noise where seed is None.

    Their tensions are the readings of cells without noise; those of the noisy trials scatter about them.
    """
    from scipy.spatial.transform import Rotation

    found, rng, made = predict(trials, truth), np.random.default_rng(seed), []
    level = 0.0 if seed is None else 1.0
    for trial, p, R in zip(trials, found.position, found.rotation, strict=True):
        assert trial.T_world_field is not None
        inverse, (n, k) = np.linalg.inv(trial.T_world_field), p.shape[:2]
        turned = inverse[:3, :3] @ R @ exp_so3(level * TURN_NOISE * rng.normal(size=(n, k, 3)))
        position = p @ inverse[:3, :3].T + inverse[:3, 3] + level * NOISE * rng.normal(size=p.shape)
        read = trial.tensions + level * READING_NOISE * rng.normal(size=trial.tensions.shape)
        quaternion = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat(scalar_first=True).reshape(n, k, 4)
        noises = {"position_noise": NOISE, "tension_noise": READING_NOISE, "orientation_noise": TURN_NOISE}
        made.append(replace(trial, position=position, orientation=quaternion, tensions=read, **noises))
    return tuple(made)


def directly(trial, setup: Setup, row: int, j: int, **more):
    """Position (3,) and rotation (3, 3) of one sensor, by `solve` and the words of `Setup` and `Tracker` alone."""
    tracker, robot = trial.trackers[j], setup.robot or trial.robot
    hidden = (1.0 - trial.insertion[row]) * robot.length_na
    at = robot.length_na if tracker.at is None else tracker.at
    masses = [LumpedMass(mass=setup.tip_mass)]
    for each in trial.trackers:
        arm = np.array([*each.point, 0.0]) + each.offset + setup.holder
        if each.on != BASE:
            masses.append(LumpedMass(mass=each.mass + setup.tracker_mass, at=each.at, offset=tuple(arm)))
    pose = motion(setup.base_turn, (setup.base_x, setup.base_y, setup.base_z))
    given = {"tensions": setup.tension_scale * (trial.tensions[row] - setup.tension_zero)} | more
    shape = solve(
        robot, gravity=exp_so3(setup.gravity_tilt) @ trial.gravity, insertion=trial.insertion[row], s=[at - hidden],
        rotation=trial.rotation[row], loads=masses, exit_pose=pose, accuracy=1e-9, **given,
    )  # fmt: skip
    arm = np.array([*tracker.point, 0.0]) + tracker.offset + setup.holder
    return shape.centerline[0] + shape.rotation[0] @ arm, shape.rotation[0] @ exp_so3(np.array(tracker.turn))


def farthest_from_direct(trial, found, i, setup, rows, **more) -> tuple[float, float]:
    """Largest distance, m, and angle, rad, between predicted and directly solved sensors."""
    far, turned = 0.0, 0.0
    for row in rows:
        for j in np.flatnonzero(trial.on_robot):
            p, R = directly(trial, setup, row, int(j), **more)
            far = max(far, float(np.linalg.norm(found.position[i][row, j] - p)))
            turned = max(turned, float(np.linalg.norm(log_so3(found.rotation[i][row, j].T @ R))))
    return far, turned
