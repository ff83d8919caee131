"""`safely`: whatever ends a session, the robot is left slack and standing, and the record closed."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import ceil
from typing import Protocol

from .guarded import AT_REST, GuardedBench
from .interfaces import STILL, Command, Sample
from .safety import Interlock
from .states import Fault, FaultKind, State

ENDING = ("SIGINT", "SIGTERM", "SIGHUP")
SPARE = 1.0  # s, for stopping, beside the release's own time


class Recording(Protocol):
    """What is needed of a recorder."""

    def write(self, sample: Sample, command: Command, state: State, fault: Fault | None = None) -> None:
        """Keep one period."""
        ...

    def close(self) -> None:
        """Write the end."""
        ...


@contextmanager
def safely(bench: GuardedBench, recorder: Recording | None = None) -> Iterator[GuardedBench]:
    """Around a control loop: on any way out release the tendon, stop all, close the record, let the devices go.

    Ctrl-C, SIGTERM and SIGHUP become a fault with the reaction release, so that the loop is never cut in the middle of
    a transaction: it goes on, or sees ``interlock.is_asked_to_stop`` and ends. A second one stops at once and raises
    KeyboardInterrupt. What the loop raises is a fault of the controller, and is raised again after the release. After
    an emergency stop nothing moves any more: the tendon then keeps its tension, as the person wanted who stopped it.

    An exception of the record or the devices on the way out never keeps the rest from being done.
    """
    with _signals(bench.interlock) as asked:
        try:
            yield bench
        except KeyboardInterrupt:
            bench.interlock.interrupt("Ctrl-C")
            raise
        except BaseException as error:
            bench.interlock.trip(FaultKind.CONTROLLER, where=f"{type(error).__name__}: {' '.join(str(error).split())}")
            raise
        finally:
            try:
                leave_slack(bench, recorder)
            finally:
                asked.can_raise = False
                _close(bench, recorder)


def leave_slack(bench: GuardedBench, recorder: Recording | None = None) -> None:
    """Shut the interlock down and drive the bench until it stands; bounded by the release's time, then stops.

    Nothing that happens here is raised before the axes were told to stop.
    """
    interlock, limits = bench.interlock, bench.interlock.limits
    interlock.shutdown()
    end = bench.clock.now() + limits.release_timeout + SPARE
    for _ in range(ceil((limits.release_timeout + SPARE) / limits.period)):
        sample = bench.sense()
        command = bench.act(STILL)
        if recorder is not None:
            with suppress(Exception):  # the record failed: the release goes on
                recorder.write(sample, command, interlock.state, interlock.fault)
        if (interlock.is_settled and _stands(sample)) or sample.time >= end:
            return
        bench.clock.wait_until(sample.time + limits.period)


def _stands(sample: Sample) -> bool:
    axes = (sample.screw, sample.translation, sample.rotation)
    return not any(abs(axis.velocity) > AT_REST for axis in axes)


def _close(bench: GuardedBench, recorder: Recording | None) -> None:
    try:
        bench.close()
    finally:
        if recorder is not None:
            recorder.close()


class _Asked:
    """Handles signals that end a process: the first asks for the release, a second stops at once.

    can_raise: whether the loop may be left in the middle; not while the devices are let go, which must not be cut off.
    """

    def __init__(self, interlock: Interlock) -> None:
        self._interlock, self._came, self.can_raise = interlock, 0, True

    def __call__(self, number: int, _frame: object) -> None:
        self._came += 1
        name = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
        if self._came == 1:
            self._interlock.interrupt(name)
            return
        self._interlock.emergency(name)
        if self._came == 2 and self.can_raise:
            raise KeyboardInterrupt


@contextmanager
def _signals(interlock: Interlock) -> Iterator[_Asked]:
    """Signals that end a process ask for the release instead; only the main thread may set them."""
    asked = _Asked(interlock)
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = {number: signal.signal(number, asked) for number in (getattr(signal, name) for name in ENDING)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)  # None: not set from Python
