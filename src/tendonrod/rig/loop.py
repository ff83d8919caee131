"""`drive`: the control loop. One period: sense, ask the task, send what the interlock allows, record, wait."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

from ..errors import TendonrodError, positive
from .guarded import GuardedBench
from .interfaces import STILL, Command, Sample, Task
from .states import Fault, FaultKind, Reaction, State

BEHIND = 3  # periods, by which the loop may lag before it gives up catching up
LEAST = 1e-5  # share of a task that counts as progress; encoders that tremble make less
Watch = Callable[["Moment"], None]


class Recording(Protocol):
    """What the loop needs of a recorder."""

    @property
    def failed(self) -> str: ...

    def write(self, sample: Sample, command: Command, state: State, fault: Fault | None = None) -> None: ...


@dataclass(frozen=True, kw_only=True, slots=True)
class Moment:
    """What a period looked like, for whoever watches: the command is the one that was sent."""

    sample: Sample
    command: Command
    state: State
    fault: Fault | None
    task: Task


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a task ended: done, or the fault that ended it. duration: s by the bench's clock; periods: how many.

    longest: s, the longest period.
    """

    task: str
    is_done: bool
    fault: Fault | None
    duration: float
    periods: int
    longest: float

    def __str__(self) -> str:
        if self.is_done:
            return f"{self.task}: done in {self.duration:.3g} s"
        return f"{self.task}: ended after {self.duration:.3g} s by {self.fault or 'whoever watched'}"


def prepare(bench: GuardedBench, home: bool = True) -> Fault | None:
    """From wherever a bench stands without fault to armed; returns the fault, if one came meanwhile.

    home: whether axes that stand idle look for their references first; else they must know them, as the board does
    between two trials. Raises as the steps do.
    """
    interlock = bench.interlock
    if interlock.state is State.IDLE:
        bench.home() if home else interlock.home()
    if interlock.state is State.HOMED:
        bench.sense()
    if interlock.state is State.HOMED:
        interlock.arm()
    return interlock.fault


@contextmanager
def _short_collections() -> Iterator[None]:
    """Spare the garbage collector what was there before: going through all of it takes 50 ms, ten periods."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@_short_collections()
def drive(
    bench: GuardedBench,
    task: Task,
    recorder: Recording | None = None,
    *,
    rate: float = 200.0,
    watch: Watch | None = None,
) -> Outcome:
    """Run ``task`` on an armed bench, at ``rate`` periods per second, until it is done or a fault has settled.

    What a task raises is a fault of the controller. watch(moment) is called at the end of each period; what it raises
    passes through. Leaves the bench armed after a task that is done, in fault otherwise: `ending.safely` around it
    leaves the robot slack whatever happens. Raises `IllegalTransition` where the bench is not armed.
    """
    period, interlock, clock = 1.0 / positive("rate", rate), bench.interlock, bench.clock
    interlock.start()
    began = due = last = clock.now()
    periods, longest, getting_on = 0, 0.0, GettingOn(task, began)
    while True:
        sample = bench.sense()
        dt, last = sample.time - last, sample.time
        periods, longest = periods + 1, max(longest, dt)
        sent = bench.act(_asked(bench, task, sample, dt))
        if recorder is not None:
            recorder.write(sample, sent, interlock.state, interlock.fault)
            if recorder.failed:
                interlock.trip(FaultKind.RECORD, where=recorder.failed)
        if watch is not None:
            state, fault = interlock.state, interlock.fault
            watch(Moment(sample=sample, command=sent, state=state, fault=fault, task=task))
        if _has_ended(bench, task):
            break
        standing, patience = getting_on.stuck_for(sample.time), interlock.limits.patience
        if interlock.state is State.RUNNING and standing > patience:
            interlock.trip(FaultKind.STUCK, standing, patience, getting_on.phase)
        due += period
        if clock.now() > due + BEHIND * period:
            due = clock.now()
        clock.wait_until(due)
    fault = interlock.fault
    done = fault is None and task.is_done
    if done:
        interlock.finish()
    duration = clock.now() - began
    return Outcome(task=task.name, is_done=done, fault=fault, duration=duration, periods=periods, longest=longest)


class GettingOn:
    """For how long a task has neither made progress nor gone on to another phase."""

    def __init__(self, task: Task, now: float) -> None:
        self._task, self._since, self._best, self.phase = task, now, -1.0, ""

    def stuck_for(self, now: float) -> float:
        """s, by the bench's clock."""
        phase, progress = str(getattr(self._task, "phase", "")), self._task.progress
        if phase != self.phase or not progress < self._best + LEAST:
            self._since, self._best, self.phase = now, progress, phase
        return now - self._since


def _asked(bench: GuardedBench, task: Task, sample: Sample, dt: float) -> Command:
    """What the task wants; nothing where the bench does not run."""
    if bench.interlock.state is not State.RUNNING:
        return STILL
    try:
        return STILL if task.is_done else task.update(sample, dt)
    except TendonrodError as error:
        bench.interlock.trip(FaultKind.CONTROLLER, where=str(error))
    except Exception as error:  # noqa: BLE001 - a bug in a task must not leave the axes moving
        bench.interlock.trip(FaultKind.CONTROLLER, where=f"{type(error).__name__}: {error}")
    return STILL


def _has_ended(bench: GuardedBench, task: Task) -> bool:
    interlock = bench.interlock
    if interlock.state is State.RUNNING:
        return task.is_done and not interlock.is_asked_to_stop
    is_pause = interlock.state is State.HELD and interlock.reaction is Reaction.HOLD
    return interlock.is_settled and not is_pause
