"""Trials on a bench, recorded: `perform` or `run` any task, `follow_leader` as in the paper, how the tip followed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import asdict, dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..curve import Curve
from ..errors import TendonrodError, positive
from ..robot import Robot
from .benches import BenchSource, as_source, loads_of
from .control import KI, KP
from .drives import Machine
from .ending import leave_slack, safely
from .export import header_of, to_trial
from .guarded import GuardedBench
from .interfaces import Bench, Task
from .limits import AXES, Limits
from .loop import Moment, Outcome, Watch, drive, prepare
from .model_limits import StrainTable, bench_limits, strain_limit
from .profiles import Profile
from .record import Record, read_record
from .recorder import Recorder
from .safety import Interlock
from .staged import Phase
from .states import State
from .tasks import FollowLeader

if TYPE_CHECKING:
    from ..measurement.trial import Trial
    from .virtual.setup import VirtualSetup

RATE = 200.0  # Hz
RELEASE = "release the tendon"
SCREW_RATE = 0.45e-3  # m/s: near the fastest of the screw, which sets the pace
Making = Callable[[Machine], Task]
Around = Callable[[Interlock], AbstractContextManager]


@dataclass(frozen=True, kw_only=True, eq=False)
class Performed:
    """A task that was run: how it ended, and the record of it, read back from ``path``."""

    robot: Robot
    outcome: Outcome
    path: Path
    record: Record

    def tension_error(self, *phases: str) -> np.ndarray:
        """(n,) target - tension (N) of the control periods in these phases of the task, as the record notes them."""
        noted = [each for each in self.record.messages if each.text in set(Phase)]
        at = np.searchsorted([each.time for each in noted], self.record.time, side="right") - 1
        texts = np.array([*(each.text for each in noted), ""], dtype=object)  # -1: before the first
        samples, running = self.record.samples, self.record.states == State.RUNNING
        error = samples["command"]["target"] - samples["force"]["tension"]
        return error[np.isin(texts[at], phases) & running & np.isfinite(error)]

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
        """(m, 2) distances (m) of the tip from the reference: by projection, and its point at the same insertion."""
        _, eta, tip = self.tip()
        there = self.reference.at(eta * self.reference.s[-1])
        return np.stack([self.reference.project(tip).distance, np.linalg.norm(tip - there, axis=1)], axis=1)

    @property
    def rmse(self) -> tuple[float, float]:
        """Root mean square of both `errors` on the way out, m, see `rig.inserted`; NaN without frames."""
        from .inserted import inserted

        return inserted(self).tip_rmse


def perform(
    bench: Bench, robot: Robot, make: Making | None, path: str | PathLike[str], *, limits: Limits | None = None,
    gravity=(0.0, 0.0, 0.0), rate: float = RATE, watch: Watch | None = None, strain: StrainTable | None = None,
    home: bool = True, around: Around = nullcontext, **known: Any,
) -> Performed:  # fmt: skip
    """Home, arm, and run the task that ``make`` gives for the machine; whatever happens, leave the robot slack.

    make: None to do that alone, from wherever the bench stands, without homing. path: of the record, .rec. known: kept
    in the record's header; trackers, T_world_field and the like for its trial. limits: `model_limits.bench_limits` if
    None. home: False for axes that still know their references. around: a context that is entered with the interlock
    before anything moves, such as `KeyboardStop`.
    Raises what the steps raise before the motion, and closes the bench then too; a fault is no exception, it is the
    `Outcome`'s.
    """
    with ExitStack() as unused:
        unused.callback(bench.close)
        rate = positive("rate", rate)
        if limits is None:
            strain = strain_limit(robot, gravity)
            limits = bench_limits(robot, strain, period=1.0 / rate)
        guarded = GuardedBench(bench, limits, strain)
        narrowed = guarded.interlock.limits
        axes = {"screw": narrowed.screw, "translation": narrowed.translation, "rotation": narrowed.rotation}
        task = None if make is None else make(Machine(length=robot.section.L, turns=robot.turns, **axes))
        name = RELEASE if task is None else task.name
        told = {"gravity": list(gravity), "task": name, "rate": rate, "torsion": robot.torsion}
        header = header_of(robot, **told | known)
        header |= {"bench": bench.name, "limits": asdict(narrowed), "full_scale": bench.load_cell.full_scale}
        recorder = Recorder(path, header)
        unused.callback(recorder.close, "nothing was run")
        with around(guarded.interlock), safely(guarded, recorder):
            unused.pop_all()  # from here on `safely` closes it
            given = (guarded, recorder)
            outcome = _released(*given) if task is None else _driven(*given, task, rate, watch, home)
            recorder.log(bench.clock.now(), str(outcome), "info" if outcome.is_done else "error")
    return Performed(robot=robot, outcome=outcome, path=Path(path), record=read_record(path))


def _released(bench: GuardedBench, recorder: Recorder) -> Outcome:
    """The tendon let go. Raises `TendonrodError` where its tension stays."""
    began, interlock = bench.clock.now(), bench.interlock
    leave_slack(bench, recorder)
    tension, slack = bench.sense().force.tension, interlock.limits.slack
    if interlock.fault is None and not tension < slack:
        travel = 1e3 * interlock.limits.release_travel
        raise TendonrodError(
            f"release: the tension is still {tension:.3g} N after {travel:.3g} mm of the screw, slack is {slack:.3g} N"
        )
    duration, fault = bench.clock.now() - began, interlock.fault
    return Outcome(task=RELEASE, is_done=fault is None, fault=fault, duration=duration, periods=0, longest=0.0)


def _driven(
    bench: GuardedBench, recorder: Recorder, task: Task, rate: float, watch: Watch | None, home: bool
) -> Outcome:
    """Prepared and driven; a fault on the way to armed is an outcome too."""
    began = bench.clock.now()
    fault = prepare(bench, home)
    if fault is None:
        return drive(bench, task, recorder, rate=rate, watch=_noting(recorder, watch))
    duration = bench.clock.now() - began
    return Outcome(task=task.name, is_done=False, fault=fault, duration=duration, periods=0, longest=0.0)


def _noting(recorder: Recorder, watch: Watch | None) -> Watch:
    """``watch``, and every phase of the task as a message of the record."""
    before = ""

    def noted(moment: Moment) -> None:
        nonlocal before
        phase = str(getattr(moment.task, "phase", ""))
        if phase != before:
            recorder.log(moment.sample.time, phase)
            before = phase
        if watch is not None:
            watch(moment)

    return noted


def run(
    source: BenchSource | VirtualSetup, make: Making | None, path: str | PathLike[str], *, seed: int = 0,
    rate: float = RATE, highest: float | None = None, watch: Watch | None = None, home: bool = True,
    around: Around = nullcontext, **known: Any,
) -> Performed:  # fmt: skip
    """Open a bench, `perform` the task on it, close it. The same virtual source and seed give the same samples.

    highest: N, the largest tension that the task will ask for, refused above the soft limit before anything is opened.
    limits come from the model, with what hangs on the robot, and from the source. Raises as `perform`, `InvalidInput`.
    """
    source = as_source(source)
    limits, strain = limits_of(source, rate, highest)
    given = {"limits": limits, "strain": strain, "gravity": source.gravity, "rate": rate, "home": home}
    told: dict[str, Any] = source.known(seed) | {"trackers": source.trackers} | known
    return perform(source.open(seed), source.robot, make, path, watch=watch, around=around, **given, **told)


def limits_of(source: BenchSource, rate: float = RATE, highest: float | None = None) -> tuple[Limits, StrainTable]:
    """The limits of a bench with its robot, and the table of strain behind them. Raises `InvalidInput`."""
    table = strain_limit(source.robot, source.gravity, loads_of(source))
    period = 1.0 / positive("rate", rate)
    axes = {name: given for name, given in source.limits.items() if name in AXES}
    rest = {name: value for name, value in source.limits.items() if name not in AXES}
    found = bench_limits(source.robot, table, highest, **{"period": period} | rest)
    return replace(found, **{name: replace(getattr(found, name), **given) for name, given in axes.items()}), table


def follow_leader(
    bench: BenchSource | VirtualSetup, profile: Profile, target: float, path: str | PathLike[str], *, seed: int = 0,
    screw_rate: float = SCREW_RATE, feed_forward: bool = False, kp: float = KP, ki: float = KI, end: float = 1.0,
    rate: float = RATE, real_time: bool = False, watch: Watch | None = None, home: bool = True,
    around: Around = nullcontext,
) -> Followed:  # fmt: skip
    """One follow-the-leader trial as the paper's III-C, on a virtual bench or on devices, to the insertion ``end``.

    target: N, of the reference: the whole robot's shape at that tension. kp (m/s)/N, ki (m/s2)/N. Raises as `run`.
    """
    source = as_source(bench, real_time)
    robot, gravity = source.robot, source.gravity

    def make(machine: Machine) -> Task:
        controller = machine.controller(kp=kp, ki=ki, feed_forward=feed_forward)
        return FollowLeader(profile, machine, screw_rate=screw_rate, controller=controller, end=end)

    known = {"profile": profile.name, "target": target, "feed_forward": feed_forward, "kp": kp, "ki": ki}
    known |= {"screw_rate": screw_rate, "end": end}
    options: dict[str, Any] = {"seed": seed, "rate": rate, "watch": watch, "home": home, "around": around}
    done = run(source, make, path, highest=highest_of(profile), **options, **known)
    fields: dict[str, Any] = {name: getattr(done, name) for name in ("robot", "outcome", "path", "record")}
    reference = reference_of(robot, target, gravity)
    return Followed(**fields, target=target, gravity=gravity, profile=profile, reference=reference)


def highest_of(profile: Profile) -> float:
    """The largest tension of a profile, N."""
    return max(profile.tension.value(eta) for eta in np.linspace(0.0, 1.0, 201).tolist())


def reference_of(robot: Robot, target: float, gravity) -> Curve:
    """The tube axis of the whole robot at ``target`` (N), from the outer tube's exit."""
    from ..statics.equilibrium import solve

    shape = solve(robot, target, gravity, s=np.linspace(0.0, robot.length_na, 401))
    arm = np.array([robot.section.r_na, 0.0, 0.0])
    slopes = np.einsum("nij,nj->ni", shape.rotation, shape.v + np.cross(shape.u, arm))
    return Curve(s=shape.s, points=shape.centerline, slopes=slopes)
