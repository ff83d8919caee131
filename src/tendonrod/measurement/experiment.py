"""Virtual experiments: `simulate` a bench whose truth is known, `measured` what its instruments say of it, `run` both.

The truth does not depend on the seed: a study of many seeds simulates once. The trials say what a lab would know; how
the bench stood in truth is in their origin, under "truth".
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import whole
from ..loads import LumpedMass
from ..statics.equilibrium import solve
from ..statics.shape import Shape
from .bench import FIELD_LEVEL, ORIGIN_LEVEL, Experiment
from .noise import Kind, Noise, random_rotation, read_tensions, stream, track, written_frames
from .trial import Trial

ACCURACY, RUBBING = 1e-9, 1e-7  # m, of the truth; where tendons rub a nanometre would take ten times as long
FAR = 0.25  # m, from the world's origin to that of the field
VIRTUAL = "tendonrod's virtual experiment, not a measurement"
MISSING = "MISSING"  # what the tracker says of a frame without a pose
Watch = Callable[[float, float], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueTrial:
    """What happens in one trial before anybody measures it; SI, world frame.

    places: of its trackers, shares of the length, None for the base. time (n,), tensions (n, T), insertion (n,),
    rotation (n,): as they are then. position (n, k, 3), turned (n, k, 3, 3): of the sensors when their frame was taken,
    the experiment's delay before; NaN inside the outer tube. shapes: the n robots of the frames.
    """

    name: str
    places: tuple[float | None, ...]
    time: np.ndarray
    tensions: np.ndarray
    insertion: np.ndarray
    rotation: np.ndarray
    position: np.ndarray
    turned: np.ndarray
    shapes: tuple[Shape, ...]


def run(experiment: Experiment, seed: int, watch: Watch | None = None) -> tuple[Trial, ...]:
    """The trials of an experiment, `measured` of `simulate`; errors as there. watch(done, total) is told of solves."""
    return measured(experiment, simulate(experiment, watch), seed)


def simulate(experiment: Experiment, watch: Watch | None = None) -> tuple[TrueTrial, ...]:
    """The truth of each trial; errors of the instruments have no part in it.

    Raises `NotConverged` where the robot has no equilibrium under the true loads.
    """
    programs = [_program(experiment, places) for _, places in experiment.plans]
    total, found = sum(map(len, programs)), []
    for (name, places), drive in zip(experiment.plans, programs, strict=True):
        before = sum(len(each.time) for each in found)
        tell = None if watch is None else lambda k, before=before: watch(before + k, total)
        found.append(_true_trial(experiment, name, places, drive, tell))
    return tuple(found)


def measured(experiment: Experiment, true: Sequence[TrueTrial], seed: int) -> tuple[Trial, ...]:
    """What the instruments say of the truth, which `simulate` gave for this experiment; noise may be another.

    seed: whole number, 0 or more: the same trials for the same seed, bit for bit.
    """
    seed = whole("seed", seed, 0)
    T_world_field = field_pose(experiment, seed)
    return tuple(_measured(experiment, each, i, T_world_field, seed) for i, each in enumerate(true))


def field_pose(experiment: Experiment, seed: int) -> np.ndarray:
    """(4, 4) true T_world_field, drawn by the seed; its axes are the world's for level "origin"."""
    draws, pose = stream(seed, Kind.FIELD), np.eye(4)
    turn, away = random_rotation(draws), draws.standard_normal(3)
    pose[:3, :3] = np.eye(3) if experiment.level == ORIGIN_LEVEL else turn
    pose[:3, 3] = FAR * away / np.linalg.norm(away)
    return pose


def _program(experiment: Experiment, places: tuple[float | None, ...]) -> np.ndarray:
    """(n, T + 2) as `Experiment.program`; at rest while the one tracker sits on the base."""
    drive = experiment.program
    return drive if any(each is not None for each in places) else np.repeat(drive[:1], experiment.base_frames, axis=0)


def _true_trial(
    experiment: Experiment,
    name: str,
    places: tuple[float | None, ...],
    drive: np.ndarray,
    tell: Callable[[int], None] | None,
) -> TrueTrial:
    time, T = np.arange(len(drive)) / experiment.rate, experiment.robot.n_tendons
    then = np.column_stack([np.interp(time - experiment.delay, time, column) for column in drive.T])
    shapes = _solved(experiment, places, then, tell)
    position, turned = _sensors(experiment, places, shapes)
    return TrueTrial(
        name=name, places=places, time=time, tensions=drive[:, :T], insertion=drive[:, T], rotation=drive[:, T + 1],
        position=position, turned=turned, shapes=shapes,
    )  # fmt: skip


def _solved(
    experiment: Experiment,
    places: tuple[float | None, ...],
    drive: np.ndarray,
    tell: Callable[[int], None] | None,
) -> tuple[Shape, ...]:
    """One after the other, each started from the last, which friction holds on to."""
    robot, found = experiment.robot, []
    rubs = bool(robot.friction.any())
    fixed: dict[str, Any] = {"gravity": experiment.gravity, "exit_pose": experiment.exit_pose}
    fixed |= {"loads": _masses(experiment, places), "accuracy": RUBBING if rubs else ACCURACY}
    for k, (*tensions, insertion, rotation) in enumerate(drive.tolist()):
        last = found[-1] if found else None
        if last is not None and (drive[k] == drive[k - 1]).all():
            found.append(last)
        else:
            place = {"insertion": insertion, "rotation": rotation}
            found.append(solve(robot, tensions, **fixed, **place, start=last, history=last if rubs else None))
        if tell is not None:
            tell(k + 1)
    return tuple(found)


def _masses(experiment: Experiment, places: tuple[float | None, ...]) -> tuple[LumpedMass, ...]:
    arm, length = tuple(experiment.sensor[0].tolist()), experiment.robot.length_na
    masses = [LumpedMass(mass=experiment.tip_mass)] if experiment.tip_mass > 0.0 else []
    if experiment.tracker_mass > 0.0:
        on_robot = [each for each in places if each is not None]
        masses += [LumpedMass(mass=experiment.tracker_mass, at=each * length, offset=arm) for each in on_robot]
    return tuple(masses)


def _sensors(
    experiment: Experiment, places: tuple[float | None, ...], shapes: Sequence[Shape]
) -> tuple[np.ndarray, np.ndarray]:
    """(n, k, 3), (n, k, 3, 3) of the sensors in the world."""
    arm, turn = experiment.sensor
    n, k, length = len(shapes), len(places), experiment.robot.length_na
    body, frame = np.full((n, k, 3), np.nan), np.full((n, k, 3, 3), np.nan)
    on = [j for j, each in enumerate(places) if each is not None]
    for i, shape in enumerate(shapes if on else ()):
        s = np.array([places[j] for j in on]) * length - (length - shape.length)
        out = s >= -1e-9 * length
        if out.any():
            there = shape.at(np.maximum(s[out], 0.0))
            body[i, np.array(on)[out]], frame[i, np.array(on)[out]] = there.centerline, there.rotation
    base = [j for j, each in enumerate(places) if each is None]
    body[:, base], frame[:, base] = experiment.exit_pose[:3, 3], experiment.exit_pose[:3, :3]
    return body + frame @ arm, frame @ turn


def _measured(experiment: Experiment, true: TrueTrial, number: int, T_world_field: np.ndarray, seed: int) -> Trial:
    noise, robot = experiment.noise, experiment.believed
    frame = written_frames(noise, len(true.time), seed, number)
    seen = {name: array[frame] for name, array in _seen(noise, true, number, T_world_field, seed).items()}
    return Trial(
        name=true.name,
        robot=robot,
        trackers=tuple(experiment.tracker(each) for each in true.places),
        time=true.time[frame],
        **seen,
        tensions=read_tensions(noise, true.tensions, seed, number),
        insertion=true.insertion,
        rotation=true.rotation,
        gravity=experiment.gravity,
        T_world_field=T_world_field if experiment.level == FIELD_LEVEL else None,
        position_noise=noise.position or None,
        orientation_noise=noise.orientation or None,
        tension_noise=noise.tension or None,
        notes=f"{VIRTUAL[0].upper()}{VIRTUAL[1:]}, seed {seed}. What was true is told under origin.",
        origin={
            "made by": VIRTUAL,
            "seed": str(seed),
            "truth": json.dumps(experiment.truth() | {"T_world_field": T_world_field.tolist()}),
        },
    )


def _seen(noise: Noise, true: TrueTrial, number: int, T_world_field: np.ndarray, seed: int) -> dict[str, Any]:
    """position, orientation, quality and state as in `Trial`, of the frames that the tracker takes."""
    R, (n, k) = T_world_field[:3, :3], true.position.shape[:2]
    position, turned = (true.position - T_world_field[:3, 3]) @ R, R.T @ true.turned
    orientation, quality = np.full((n, k, 4), np.nan), np.full((n, k), np.nan)
    state = np.full((n, k), "", dtype=object)
    for j in range(k):
        frames = track(noise, position[:, j], turned[:, j], seed, number, j)
        gone = frames.missing | np.isnan(frames.position[:, 0])
        position[:, j], quality[:, j] = frames.position, frames.quality
        orientation[~gone, j] = quaternions(frames.turned[~gone])
        position[gone, j], quality[gone, j], state[gone, j] = np.nan, np.nan, MISSING
    return {"position": position, "orientation": orientation, "quality": quality, "state": state}


def quaternions(turned: np.ndarray) -> np.ndarray:
    """(n, 4) unit quaternions (w, x, y, z), w >= 0, of rotations (n, 3, 3)."""
    from scipy.spatial.transform import Rotation

    if not len(turned):
        return np.empty((0, 4))
    return Rotation.from_matrix(turned).as_quat(canonical=True, scalar_first=True)
