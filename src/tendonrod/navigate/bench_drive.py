"""`BenchDrive`: a session on a bench, virtual or real: the operator steers its axes, the session shows what they do.

The model gets the insertion, rotation and tension that the bench measures, and shows the robot in the phantom with
them. A bench does not know the phantom: a virtual one has no walls, and pushes back at nothing.
"""

from __future__ import annotations

import atexit
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from math import isfinite

from ..errors import TendonrodError, positive
from ..rig.benches import BenchSource, as_source
from ..rig.control import LowPass
from ..rig.drives import TURN, Machine
from ..rig.ending import leave_slack
from ..rig.guarded import GuardedBench
from ..rig.interfaces import STILL, Command, Sample
from ..rig.loop import Moment, drive, prepare
from ..rig.safety import Interlock
from ..rig.states import FaultKind, State
from ..rig.trials import RATE, limits_of
from .commands import FASTEST, Jog, Posture
from .dead_man import GRACE
from .recovery import END, HOMING, OnBench, Trouble, check_acknowledged, made_ready, trouble_of
from .steered import Steered, check_same, highest_tension
from .teleoperate import KEPT, Teleoperate

CUT_TIME, MUCH = 0.3, 0.6  # s, share: an insertion of which the interlock cuts more is told to the operator
SOFTEST = 4e-3  # m/N, compliance of robot and tendon that is reckoned with
RETRACTED = 0.15e-3  # m: a robot that is no further out than after homing counts as retracted; encoders tremble


class BenchDrive(OnBench):
    """Steers a bench through its interlock, ``rate`` periods per second of the bench's clock.

    source: see `rig.benches`; opened here, homed and armed. On a bench that is faster than real time each `advance`
    runs its periods itself, and the same commands give the same session. With ``own_thread`` the loop runs
    beside what steers it, in real time, and stops by itself `GRACE` after the time of the last `advance`: the other
    threads must leave it its time, as those of `bench_process` do. A session does not, for which see `BenchAside`.

    opening: a context that is entered with the interlock before anything moves, and left when the axes are homed. A
    bench that does not get ready is left slack, as one that is closed.

    A fault ends every motion until it is acknowledged, see `recovery`. Meanwhile the bench is still watched: what is
    measured stays true, and a tension that passes its limit is let go.

    Raises `InvalidInput` where the source's robot is not the scenario's, and what opening and homing raise.
    """

    def __init__(
        self, scenario: Steered, source: BenchSource, *, seed: int = 0, rate: float = RATE, own_thread: bool = False,
        opening: Callable[[Interlock], AbstractContextManager] = nullcontext,
    ) -> None:  # fmt: skip
        source = as_source(source)
        check_same(scenario, source)
        self._period, self._length = 1.0 / positive("rate", rate), scenario.robot.section.L
        limits, strain = limits_of(source, rate)
        self.highest = min(scenario.limits.tension, highest_tension(limits, strain))
        self._bench = GuardedBench(source.open(seed), limits, strain)
        self._lock, self._closed, self._broken = threading.Lock(), False, ""
        self._acknowledged: bool | None = None  # whether it may home, once somebody has acknowledged
        self._readying, self._cut = "", LowPass(CUT_TIME)
        self._cut.value = 0.0
        try:
            with opening(self._bench.interlock):
                prepare(self._bench)
            sample = self._bench.sense()
            if (fault := self._bench.interlock.fault) is not None:
                raise TendonrodError(f"the bench is not ready: {fault}")
            self._task = self._teleoperated(scenario)
            self._due, self._owed = self._bench.clock.now(), 0.0
            self._measured = self._homed_at(sample)
        except BaseException:
            self._let_go()
            raise
        atexit.register(self.close)  # a program may end without closing, and the tendon would stay under tension
        self._thread = threading.Thread(target=self._loop, name="bench", daemon=True) if own_thread else None
        if self._thread is not None:
            self._thread.start()
        else:
            self._bench.interlock.start()

    @property
    def posture(self) -> Posture:
        """What the bench measured last."""
        with self._lock:
            return self._measured

    @property
    def fastest(self) -> Jog:
        """What the axes can follow for long: the screw must keep pace with the robot, which the tendon holds to it."""
        limits = self._bench.interlock.limits
        speed = min(limits.screw.speed, limits.translation.speed)
        turns = TURN * abs(self._task.machine.turns) * speed / self._length if self._task.coupled else 0.0
        rotation = max(limits.rotation.speed - turns, 0.1 * limits.rotation.speed)
        return Jog(
            insertion=KEPT * speed, rotation=min(KEPT * rotation, FASTEST["rotation"]),
            tension=min(speed / SOFTEST, FASTEST["tension"]),
        )  # fmt: skip

    @property
    def coupled(self) -> bool:
        """Whether insertion turns the motor."""
        return self._task.coupled

    @coupled.setter
    def coupled(self, on: bool) -> None:
        self._task.coupled = on

    @property
    def held_back(self) -> str:
        """See `OnBench`."""
        if self._cut.value <= MUCH:
            return ""
        soft, found = self._bench.interlock.limits.soft * self._bench.interlock.limits.tension, self._task.tension
        if found < self.highest:
            return "the bench inserts no further: its limits of travel or strain are reached"
        near = f"at {found:.2f} N nothing may raise its tension, with {soft:.2f} N as its limit"
        return f"the bench inserts no further: {near}; pull less"

    @property
    def trouble(self) -> Trouble | None:
        """See `OnBench`."""
        if self._broken:
            return Trouble(text=self._broken, remedy=END)
        if self._readying:
            return Trouble(text=self._readying, remedy=HOMING)
        return trouble_of(self._bench.interlock)

    def acknowledge(self, home: bool = False) -> None:
        """Obey again after a fault; with a loop of its own the bench does so within a period, or once it has homed.

        home: whether the tendon may be let go and the robot drawn in, where positions are not known. Raises
        `TendonrodError`, see `check_acknowledged`.
        """
        with self._lock:
            check_acknowledged(self.trouble, home)
            self._acknowledged = home
        if self._thread is not None:
            return
        self._make_ready()
        self._due, self._owed = self._bench.clock.now(), 0.0
        if self._bench.interlock.state is State.ARMED:
            self._bench.interlock.start()

    def halt(self) -> None:
        """End a homing that was acknowledged; from any thread. Everything else ends with what steers it."""
        if self._recalled():
            self._bench.interlock.emergency("operator")

    def advance(self, jog: Jog, dt: float) -> Posture:
        """Steer at ``jog`` for ``dt`` s of the bench's time, and give what it measured then."""
        if self._thread is not None:
            self.steer(jog, dt + GRACE)
            return self.posture
        self._owed += dt
        periods = max(1, round(self._owed / self._period))
        self._owed -= periods * self._period  # what is left over counts with the next: sessions and bench keep pace
        self._task.steer(jog, (periods + 0.5) * self._period)
        for _ in range(periods):
            self._due += self._period
            self._bench.clock.wait_until(self._due)
            self._run_period()
        return self.posture

    def steer(self, jog: Jog, time: float) -> None:
        """Let the own loop move at ``jog`` for the next ``time`` s."""
        self._task.steer(jog, time)

    def close(self) -> None:
        """Leave the robot slack and standing, and let the devices go."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        self._task.finish()
        if self._recalled():
            self._bench.interlock.interrupt("the session ends")
        if self._thread is not None:
            self._thread.join()
        self._let_go()

    def _let_go(self) -> None:
        try:
            leave_slack(self._bench)
            if self._closed and not self._broken:
                self._look(self._bench.sense())
        finally:
            self._bench.close()

    def _recalled(self) -> bool:
        """Take the operator's word back; whether what it allowed has begun."""
        with self._lock:
            self._acknowledged, has_begun = None, bool(self._readying)
        return has_begun

    def _teleoperated(self, scenario: Steered) -> Teleoperate:
        """The task, within what the opened bench allows."""
        found = self._bench.interlock.limits
        axes = {"screw": found.screw, "translation": found.translation, "rotation": found.rotation}
        machine = Machine(length=self._length, turns=scenario.robot.turns, **axes)
        return Teleoperate(machine, replace(scenario.limits, tension=self.highest), scenario.coupled)

    def _loop(self) -> None:
        """The bench's own loop, until the task is finished."""
        try:
            while not self._task.is_done:
                if self._bench.interlock.state is State.ARMED:
                    drive(self._bench, self._task, rate=1.0 / self._period, watch=self._watch)
                self._stand()
        except Exception as error:  # noqa: BLE001 - a thread that dies must be told, and leave nothing in motion
            self._broken = f"the bench's loop broke: {type(error).__name__}: {error}"
            self._bench.interlock.emergency(self._broken)
            leave_slack(self._bench)

    def _stand(self) -> None:
        """Watch a bench in fault until somebody has acknowledged it, or the task is finished."""
        bench = self._bench
        while bench.interlock.state is not State.ARMED and not self._task.is_done:
            sample = bench.sense()
            bench.act()
            self._look(sample)
            self._make_ready()
            bench.clock.wait_until(sample.time + self._period)

    def _make_ready(self) -> None:
        """Do what was acknowledged, if anything was; steering begins anew."""
        bench, homes = self._bench, self._begun()
        if homes is None:
            return
        try:
            made_ready(bench, self._look)
            self._look(bench.sense())  # the tension that there is now
            self._task.resume(homes)
            self._look(sample := bench.sense())  # with the turns counted anew
            if homes and bench.interlock.state is State.ARMED:
                self._homed_at(sample)
        finally:
            with self._lock:  # a word said twice is no word for the next fault
                self._acknowledged, self._readying = None, ""

    def _begun(self) -> bool | None:
        """Take the operator's word: whether it homes, None for nothing to do. From here on `halt` is an emergency stop.

        A fault that came after the word, and needs more, stays.
        """
        with self._lock:
            home, self._acknowledged, trouble = self._acknowledged, None, self.trouble
            if home is None or trouble is None or not trouble.ready or (trouble.homes and not home):
                return None
            self._readying = "the bench looks for its references" if trouble.homes else ""
            return trouble.homes

    def _watch(self, moment: Moment) -> None:
        self._look(moment.sample)
        self._compare(moment.command)

    def _compare(self, sent: Command) -> None:
        """How much of the insertion that the task asks for the interlock cuts; readings are noisy, so not each time."""
        if self._task.asked.translation > 0.0:
            self._cut.update(float(sent.translation <= 0.0), self._period)
        else:
            self._cut.value = 0.0

    def _run_period(self) -> None:
        """One period of the bench, as `rig.loop.drive` runs them."""
        bench, before = self._bench, self._time
        sample = bench.sense()
        command = STILL
        if bench.interlock.state is State.RUNNING:
            try:
                command = self._task.update(sample, sample.time - before)
            except TendonrodError as error:
                bench.interlock.trip(FaultKind.CONTROLLER, where=str(error))
        sent = bench.act(command)
        self._look(sample)
        self._compare(sent)

    def _look(self, sample: Sample) -> None:
        if self._bench.interlock.state is not State.RUNNING:
            self._task.watch(sample, sample.time - self._time)
        seen = self._seen(sample)
        with self._lock:
            self._measured = seen

    def _homed_at(self, sample: Sample) -> Posture:
        """What is seen first of a retracted robot; the axes of a board stand a little off their references then."""
        z = sample.translation.position
        self._retracted = RETRACTED + (max(z, 0.0) if isfinite(z) else 0.0)
        return self._seen(sample)

    def _seen(self, sample: Sample) -> Posture:
        """A sample in the words of the session. A reading that is missing leaves the last one."""
        self._time, z = sample.time, sample.translation.position
        if not isfinite(z + sample.rotation.position):
            return self._measured
        insertion = 0.0 if z <= self._retracted else min(z / self._length, 1.0)
        rotation = self._task.section_rotation(sample)
        return Posture(insertion=insertion, rotation=rotation, tension=(self._task.tension,))
