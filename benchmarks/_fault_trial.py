"""One short follow-the-leader trial of bench_faults.py, in which one thing goes wrong at a random time."""

from __future__ import annotations

import shutil
import signal
import time
from dataclasses import replace
from functools import cache
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from _bench_trials import GRAVITY, robot
from _fault_cases import CASES, Ill
from _fault_result import Result, followed
from tendonrod.rig.detection import DETECTION
from tendonrod.rig.drives import Machine
from tendonrod.rig.ending import safely
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import STILL, AxisLimits, Command, Sample
from tendonrod.rig.limits import Limits
from tendonrod.rig.loop import Moment, drive, prepare
from tendonrod.rig.model_limits import StrainTable, bench_limits, strain_limit
from tendonrod.rig.profiles import Cubics, Profile
from tendonrod.rig.record import Record, read_record
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.states import FaultKind
from tendonrod.rig.tasks import FollowLeader
from tendonrod.rig.virtual.bench import VirtualBench, virtual_bench
from tendonrod.rig.virtual.injection import Schedule
from tendonrod.rig.virtual.setup import TrackerModel, VirtualSetup, lead_screw

RATE, PERIOD = 200.0, 5e-3
SCREW = lead_screw(speed=3e-3, acceleration=30e-3, braking=0.1)  # six times faster than by default, to save time
SCREW_RATE = 2e-3  # m/s
WAY = 0.07  # insertion
LONGEST, PATIENCE = 40.0, 60.0  # s of bench time and of real time, beyond which a trial counts as stuck, a disk as well
FILTER = 2.0  # time constants of the load cell's amplifier that count as its delay
AFTER = 0.2  # s, after which the axes must stand
REST = 1e-6  # per s, below which an axis stands
KEPT = 0.2  # s of real time: what a killed process may lose of its record
LATELY = 500  # periods of the bench, about the last 0.2 s of real time
SETTLING = 0.02  # N, by which a slack tendon may be above the limit for slack: noise, braking


class Stuck(Exception):
    """A trial that does not end."""


class Killed(BaseException):
    """The process is gone: nothing of it runs any more."""


@cache
def known() -> tuple[StrainTable, Limits]:
    """Strain and limits of the robot; made once, before processes are forked."""
    table = strain_limit(robot(), GRAVITY)
    return table, bench_limits(robot(), table, period=PERIOD)


def worth(setup: VirtualSetup) -> float:
    """What one period's motion can add to the tension at worst, N.

    Translation out and screw in at their fastest for one period and the delay of the load cell's amplifier, and the
    ways on which both brake, on the bare tendon: a robot can only make it softer.
    """
    delay = PERIOD + FILTER / (2.0 * np.pi * setup.load_cell.bandwidth)
    axes = setup.translation, setup.screw
    way = sum(axis.speed * delay + 0.5 * axis.speed**2 / axis.braking for axis in axes)
    return way * setup.tendon_stiffness / setup.tendon_length


def asked(seed: int, item: int) -> tuple[str, Ill, float]:
    """(case, what goes wrong, insertion at the start) of an item; they depend on (seed, item) alone."""
    rng = np.random.default_rng((seed, item))
    case = list(CASES)[item % len(CASES)]
    return case, CASES[case](rng), float(rng.uniform(0.05, 0.2))


def run(job: tuple[int, int]) -> Result:
    """The trial of (seed, item)."""
    with TemporaryDirectory() as folder:
        return _Trial(*job, Path(folder)).result()


class _Fate:
    """Looks on at the end of each period, and sees to it that things go wrong when it is time."""

    def __init__(self, ill: Ill, rng: np.random.Generator) -> None:
        phase, longest = ill.when[int(rng.integers(len(ill.when)))]
        self.ill, self.phase = ill, phase
        self.delay = float(rng.uniform(min(ill.least, longest), longest))
        self.at = self.struck = nan  # s: when it is due, when it happened

    def follow(self, moment: Moment, trial: _Trial) -> None:
        now = moment.sample.time
        if self.at != self.at and trial.task.phase is self.phase:
            self.at = now + self.delay
            if self.ill.injected is not None:
                self.struck = self.at
                trial.bench.world.schedule = Schedule((self.ill.injection(self.at),))
        if self.ill.deed and self.struck != self.struck and now >= self.at:
            self.struck = now
            self._do(self.ill.deed, trial)

    def _do(self, deed: str, trial: _Trial) -> None:
        if deed == "emergency":
            trial.guarded.interlock.emergency("campaign")
        elif deed == "interrupt":
            signal.raise_signal(signal.SIGINT)
        elif deed == "kill":
            raise Killed
        elif deed == "disk full":
            trial.recorder._file.reserve_ahead = _no_room
            while not trial.recorder.failed:  # the bench's time stands still meanwhile
                time.sleep(2e-3)


def _no_room() -> None:
    raise OSError(28, "No space left on device")


class _Spoilt(FollowLeader):
    """A controller that fails once its trial says so."""

    fate: _Fate

    def update(self, sample: Sample, dt: float) -> Command:
        command, fails = super().update(sample, dt), self.fate.struck == self.fate.struck
        if fails and self.fate.ill.deed == "raise":
            raise ZeroDivisionError("injected")
        if fails and self.fate.ill.deed == "stuck":
            return STILL
        return replace(command, translation=nan) if fails and self.fate.ill.deed == "nan" else command


class _Trial:
    """One trial, from the start to what is left of it."""

    def __init__(self, seed: int, item: int, folder: Path) -> None:
        self.item, self.path, self.wrong = item, folder / "trial.rec", list[str]()
        self.case, self.ill, self.start = asked(seed, item)
        usual = {"robot": robot(), "gravity": GRAVITY, "screw": SCREW, "tracker": TrackerModel(burst_rate=0.0)}
        setup = VirtualSetup(**usual | self.ill.setup)
        self.bench: VirtualBench = virtual_bench(setup, item)
        self.guarded = GuardedBench(self.bench, self._limits(), known()[0])
        self.recorder = Recorder(self.path, {"task": "campaign"}, sync=None, patience=PATIENCE)
        self.fate = _Fate(self.ill, np.random.default_rng((seed, item, 1)))
        self.task, self.stood, self.written = self._task(), nan, list[float]()
        self.real = time.monotonic()

    def _limits(self) -> Limits:
        table, limits = known()
        changes = dict(self.ill.limits)
        if (tension := changes.pop("strain_at", None)) is not None:
            changes["strain"] = table(self.start, tension)
        if (beyond := changes.pop("ends", None)) is not None:
            high = (self.start + WAY) * robot().section.L + beyond
            changes["translation"] = replace(limits.translation, low=-1e-3, high=high)  # homed up to 0.2 mm off
        return replace(limits, **changes)

    def _task(self) -> _Spoilt:
        limits = self.guarded.interlock.limits
        axes: dict[str, AxisLimits] = {name: getattr(limits, name) for name in ("screw", "translation", "rotation")}
        machine, end = Machine(length=robot().section.L, turns=robot().turns, **axes), self.start + WAY
        along = Profile(name="campaign", tension=Cubics([self.start, end], self.ill.tension))
        task = _Spoilt(along, machine, screw_rate=SCREW_RATE, start=self.start, end=end)
        task.fate = self.fate
        return task

    def result(self) -> Result:
        """Run it, and look at what came of it."""
        with followed(self.bench) as tensions:
            try:
                self._killed() if self.ill.deed == "kill" else self._run()
            except Stuck as error:
                self.wrong.append(f"stuck: {error}")
            except Exception as error:  # noqa: BLE001 - a trial that raises is a result too
                self.wrong.append(f"{type(error).__name__}: {error}")
            self.bench.clock.wait_until(self.bench.clock.now() + AFTER)
        limit, peak = self.guarded.interlock.limits.tension, max(tensions)
        allowed, (found, bound), ended = limit + worth(self.bench.world.setup), self._found(), self._ended()
        self._judge(found, bound, peak, allowed, ended)
        return Result(
            item=self.item, case=self.case, found=found, bound=bound, fault=str(self.guarded.interlock.fault),
            kinds=tuple(each.kind.name for each in self.guarded.interlock.faults), peak=peak, limit=limit,
            allowed=allowed, ended=ended, duration=self.bench.world.time, wrong=tuple(self.wrong),
        )  # fmt: skip

    def _run(self) -> None:
        with safely(self.guarded, self.recorder):
            prepare(self.guarded)
            drive(self.guarded, self.task, self.recorder, rate=RATE, watch=self._watch)

    def _watch(self, moment: Moment) -> None:
        if moment.sample.time > LONGEST or time.monotonic() - self.real > PATIENCE:
            raise Stuck(f"{moment.state.value} after {moment.sample.time:.3g} s")
        self.written.append(time.monotonic())
        self.fate.follow(moment, self)

    def _killed(self) -> None:
        """Nobody commands any more: the axes must stop by themselves. A second session then releases the tendon."""
        try:
            prepare(self.guarded)
            drive(self.guarded, self.task, self.recorder, rate=RATE, watch=self._watch)
        except Killed:
            now = time.monotonic()  # what the copy takes is no loss
            self._look_at_rest(Path(shutil.copy(self.path, self.path.with_name("rest.rec"))), now)
        self.recorder.close("killed")
        world, bench = self.bench.world, self.bench
        while not self._stands() and world.time < self.fate.struck + 1.0:
            bench.clock.wait_until(world.time + 1e-3)
        self.stood = world.time
        again = GuardedBench(bench, self.guarded.interlock.limits, known()[0])
        with safely(again, Recorder(self.path.with_name("again.rec"), {"task": "release"}, sync=None)):
            again.interlock.release()
        self._ask_for_whole(read_record(self.path.with_name("again.rec")))

    def _look_at_rest(self, rest: Path, now: float) -> None:
        """What a killed process leaves: whole but for its last moment; the time that it was itself away is no loss."""
        record = read_record(rest)
        newest, away = self.written[max(record.time.size - 1, 0)], max(np.diff(self.written[-LATELY:]), default=0.0)
        if record.damage or record.lost or now - newest > KEPT + away:
            self.wrong.append(f"record of the killed process: {record.condition}, ends {now - newest:.3g} s before")

    def _stands(self) -> bool:
        return all(abs(each.velocity) < REST for each in self.bench.world.drives.values())

    def _ended(self) -> str:
        if not self._stands():
            return "moving"
        return "slack" if self.bench.world.tension <= self.guarded.interlock.limits.slack + SETTLING else "held"

    def _found(self) -> tuple[float, float]:
        """s after the injection, and s that it may take: until a sample shows it, and then what DETECTION states."""
        ill, kind, guarded, setup = self.ill, self.ill.finds, self.guarded, self.bench.world.setup
        if kind is None:
            stopping = max(axis.speed / axis.braking for axis in (setup.screw, setup.translation, setup.rotation))
            return self.stood - self.fate.struck, setup.command_timeout + stopping + 1e-3
        times = [each.time for each in guarded.interlock.faults if each.kind is kind]
        shows = PERIOD + ill.shows if kind is not FaultKind.TENSION_LOST else self._pull_shows() - self.fate.struck
        bound = DETECTION[kind].bound(guarded.interlock.limits, ill.period) + shows
        return (times[0] - self.fate.struck if times else nan), bound

    def _pull_shows(self) -> float:
        """When the record first shows a pull that the reading does not answer, s; written apart from the interlock."""
        limits, samples = self.guarded.interlock.limits, read_record(self.path).samples
        pulled = samples["translation"]["position"] - samples["screw"]["position"]
        tension, target = samples["force"]["tension"], samples["command"]["target"]
        taut, aimed, since = pulled[0], nan, 0
        for k in range(samples.size):
            since = since if tension[k] == tension[since] else k
            aims = k > 0 and target[k - 1] > 2.0 * limits.slack
            if tension[k] > 2.0 * limits.slack:
                taut = aimed = pulled[k]
            aimed = aimed if aims else nan
            stays = tension[k] <= 2.0 * limits.slack and pulled[k] - taut > limits.take_up
            stays |= tension[k] < limits.slack and pulled[k] - aimed > limits.lost_pull
            if stays or (tension[k] > limits.slack and abs(pulled[k] - pulled[since]) > 0.5 * limits.lost_pull):
                return float(samples["time"][k])
        return nan

    def _judge(self, found: float, bound: float, peak: float, allowed: float, ended: str) -> None:
        if self.fate.struck != self.fate.struck:
            self.wrong.append("nothing went wrong")
        if not found <= bound + 1e-9:
            self.wrong.append(f"found after {found:.4g} s, allowed {bound:.4g} s")
        if not peak <= allowed:
            self.wrong.append(f"{peak:.4g} N, allowed {allowed:.4g} N")
        if ended != "slack" and not (ended == "held" and self.ill.may_hold):
            self.wrong.append(f"ended {ended} at {self.bench.world.tension:.3g} N")
        self._ask_for_whole(read_record(self.path))

    def _ask_for_whole(self, record: Record) -> None:
        if not record.is_complete:
            self.wrong.append(f"record {record.condition}")
