"""Trials on a bench, recorded: `perform` any task, `follow_leader` as in the paper, and how well the tip followed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..curve import Curve
from ..errors import positive
from ..robot import Robot
from .control import TensionController
from .drives import Machine
from .ending import safely
from .export import header_of, to_trial
from .guarded import GuardedBench
from .interfaces import Bench, Task
from .limits import Limits
from .loop import Outcome, Watch, drive, prepare
from .model_limits import bench_limits, strain_limit
from .profiles import Profile
from .record import Record, read_record
from .recorder import Recorder
from .tasks import FollowLeader

if TYPE_CHECKING:
    from ..measurement.trial import Trial
    from .virtual.bench import VirtualBench
    from .virtual.setup import VirtualSetup

RATE = 200.0  # Hz
SCREW_RATE = 0.45e-3  # m/s: near the fastest of the screw, which sets the pace
Making = Callable[[Machine], Task]


@dataclass(frozen=True, kw_only=True, eq=False)
class Performed:
    """A task that was run: how it ended, and the record of it, read back from ``path``."""

    robot: Robot
    outcome: Outcome
    path: Path
    record: Record

    def trial(self, **fields: Any) -> Trial:
        """The record as a `measurement.trial.Trial`, a sample for each frame of the tracker."""
        return to_trial(self.record, robot=self.robot, **fields)


@dataclass(frozen=True, kw_only=True, eq=False)
class Followed(Performed):
    """A follow-the-leader trial beside its reference; SI, world frame.

    reference: tube axis of the whole robot at the target tension, which its tip is to follow. profile: of the tension.
    """

    target: float
    gravity: tuple[float, float, float]
    profile: Profile
    reference: Curve

    def tip(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(time (m,) s, insertion (m,), tube axis at the tip (m, 3) m) of all used frames of the tracker."""
        from ..measurement.registration import body_positions, registered

        (trial,) = registered([self.trial()])
        used = trial.kept[:, 0]
        return trial.time[used], trial.insertion[used], body_positions(trial)[used, 0]

    def errors(self) -> np.ndarray:
        """(m, 2) distances (m) of the tip from the reference: by projection, and from its point at the same insertion."""
        _, eta, tip = self.tip()
        there = self.reference.at(eta * self.reference.s[-1])
        return np.stack([self.reference.project(tip).distance, np.linalg.norm(tip - there, axis=1)], axis=1)

    @property
    def rmse(self) -> tuple[float, float]:
        """Root mean square of both `errors`, m; NaN without frames."""
        found = self.errors()
        if not len(found):
            return float("nan"), float("nan")
        by_projection, at_progress = np.sqrt(np.mean(found**2, axis=0)).tolist()
        return by_projection, at_progress


def perform(
    bench: Bench, robot: Robot, make: Making, path: str | PathLike[str], *, limits: Limits | None = None,
    gravity=(0.0, 0.0, 0.0), rate: float = RATE, watch: Watch | None = None, strain=None, **known: Any,
) -> Performed:  # fmt: skip
    """Home, arm, and run the task that ``make`` gives for the machine; whatever happens, leave the robot slack.

    path: of the record, .rec. known: kept in the record's header; trackers, T_world_field and the like for its trial.
    limits: `model_limits.bench_limits` if None. Raises what the steps raise before the motion; a fault is no exception,
    it is the `Outcome`'s.
    """
    rate = positive("rate", rate)
    if limits is None:
        table = strain_limit(robot, gravity)
        limits, strain = bench_limits(robot, table, period=1.0 / rate), table
    guarded = GuardedBench(bench, limits, strain)
    narrowed = guarded.interlock.limits
    axes = {"screw": narrowed.screw, "translation": narrowed.translation, "rotation": narrowed.rotation}
    task = make(Machine(length=robot.section.L, turns=robot.turns, **axes))
    header = header_of(robot, **{"gravity": list(gravity), "task": task.name, "rate": rate} | known)
    header |= {"bench": bench.name, "limits": asdict(narrowed), "full_scale": bench.load_cell.full_scale}
    recorder = Recorder(path, header)
    with safely(guarded, recorder):
        prepare(guarded)
        outcome = drive(guarded, task, recorder, rate=rate, watch=watch)
        recorder.log(bench.clock.now(), str(outcome), "info" if outcome.is_done else "error")
    return Performed(robot=robot, outcome=outcome, path=Path(path), record=read_record(path))


def follow_leader(
    setup: VirtualSetup, profile: Profile, target: float, path: str | PathLike[str], *, seed: int = 0,
    screw_rate: float = SCREW_RATE, feed_forward: bool = False, rate: float = RATE, real_time: bool = False,
    watch: Watch | None = None,
) -> Followed:  # fmt: skip
    """One follow-the-leader trial on a virtual bench, as the paper's III-C; the same seed gives the same trial.

    target: N, of the reference: the whole robot's shape at that tension. Raises as `perform`.
    """
    from .virtual.bench import virtual_bench

    bench: VirtualBench = virtual_bench(setup, seed, real_time)
    robot = setup.robot

    def make(machine: Machine) -> Task:
        controller: TensionController = machine.controller(feed_forward=feed_forward)
        return FollowLeader(profile, machine, screw_rate=screw_rate, controller=controller)

    known = _known_of(setup) | {"seed": seed, "profile": profile.name, "target": target, "feed_forward": feed_forward}
    done = perform(bench, robot, make, path, gravity=setup.gravity, rate=rate, watch=watch, **known)
    fields = {"robot": robot, "outcome": done.outcome, "path": done.path, "record": done.record}
    return Followed(
        **fields, target=target, gravity=setup.gravity, profile=profile, reference=reference_of(robot, target, setup.gravity)
    )


def reference_of(robot: Robot, target: float, gravity) -> Curve:
    """The tube axis of the whole robot at ``target`` (N), from the outer tube's exit."""
    from ..statics.equilibrium import solve

    shape = solve(robot, target, gravity, s=np.linspace(0.0, robot.length_na, 401))
    arm = np.array([robot.section.r_na, 0.0, 0.0])
    slopes = np.einsum("nij,nj->ni", shape.rotation, shape.v + np.cross(shape.u, arm))
    return Curve(s=shape.s, points=shape.centerline, slopes=slopes)


def _known_of(setup: VirtualSetup) -> dict[str, Any]:
    """What a record needs of a virtual bench to become a trial."""
    from ..measurement.trial import Tracker

    told: dict[str, Any] = {"notes": "Virtual bench, not a measurement.", "torsion": setup.robot.torsion}
    sensor = setup.tracker
    if sensor is not None:
        told["trackers"] = (Tracker(name=sensor.name, offset=sensor.offset, turn=sensor.turn, mass=sensor.mass),)
        field = np.eye(4) if sensor.T_world_field is None else np.array(sensor.T_world_field)
        told["T_world_field"] = field.tolist()
    return told
