"""Recovery of a bench that a fault has stopped: what to tell the operator, `Trouble`, and the way back, `made_ready`.

A fault leaves the robot standing, under its tension or slack. Acknowledging it moves nothing: the bench is armed where
it stands, and obeys the operator again. Only where positions can no longer be trusted the bench must look for its
references, and for that let the tendon go and draw the robot in. The operator has to ask for that in so many words.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from ..errors import InvalidInput, TendonrodError
from ..rig.guarded import GuardedBench
from ..rig.interfaces import Sample
from ..rig.loop import prepare
from ..rig.safety import Interlock, loses_reference
from ..rig.states import FaultKind, Reaction, State
from .commands import Posture

HOMING = "the bench lets the tendon go and draws the robot in to its references; Stop ends that"
HELD_UP = (FaultKind.COMMAND_TIMEOUT, FaultKind.LATE, FaultKind.STALE_SENSOR)  # a control loop that got no time
BUSY = (
    "perhaps this machine was too busy for the bench: end other programs, or allow this user real-time priority "
    "(docs, Devices of the bench, Real time); then"
)
END = "end this program and start it again; the bench stands still"


@dataclass(frozen=True, kw_only=True, slots=True)
class Trouble:
    """Why a bench stands. text: the first fault; remedy: what to do next, both sentences.

    ready: whether it can be acknowledged now. homes: whether that takes homing, which moves the robot.
    """

    text: str
    remedy: str
    ready: bool = False
    homes: bool = False


class OnBench(ABC):
    """What the drives of a bench have in common: what they did is done, and what keeps them from moving is told."""

    @property
    @abstractmethod
    def trouble(self) -> Trouble | None:
        """What keeps the bench from moving, with what to do about it; None where nothing does."""

    @property
    @abstractmethod
    def held_back(self) -> str:
        """Why the bench inserts no further though it is told to, and has no fault; "" where it does what it is told."""

    @property
    def fault(self) -> str:
        """Both in one sentence; "" where the bench does what it is told."""
        trouble = self.trouble
        return self.held_back if trouble is None else trouble.text

    def go_back(self, posture: Posture) -> bool:
        """A bench has made its move."""
        return False

    def retract(self) -> bool:
        """A bench retracts by being steered so."""
        return False


def trouble_of(interlock: Interlock) -> Trouble | None:
    """What the interlock has found, None for nothing."""
    faults = interlock.faults
    if not faults:
        return None
    homes, settled = not interlock.is_homed or any(map(loses_reference, faults)), interlock.is_settled
    if homes:
        remedy = "acknowledge and home: positions are not known, so the tendon is let go and the robot is drawn in"
    else:
        slack = ", its tendon slack" if interlock.reaction is Reaction.RELEASE else ""
        remedy = f"acknowledge: nothing moves by it, the robot stays where it is{slack}"
    if faults[0].kind in HELD_UP:
        remedy = f"{BUSY} {remedy}"
    if not settled:
        remedy = f"wait, the bench still does this: {(interlock.reaction or Reaction.HOLD).value}"
    return Trouble(text=f"the bench stopped: {faults[0]}", remedy=remedy, ready=settled, homes=homes)


def check_acknowledged(trouble: Trouble | None, home: bool) -> None:
    """Raise `TendonrodError` where there is nothing to acknowledge, or not yet; `InvalidInput` where it has to home."""
    if trouble is None:
        raise TendonrodError("there is nothing to acknowledge: the bench has no fault")
    if not trouble.ready:
        raise TendonrodError(f"the fault cannot be acknowledged yet: {trouble.remedy}")
    if trouble.homes and not home:
        raise InvalidInput("home", home, f"true: {trouble.remedy}")


def made_ready(bench: GuardedBench, look: Callable[[Sample], None]) -> None:
    """From a fault that has settled to armed; homes where positions are not known. look: sees every sample.

    What goes wrong on the way is a fault of the interlock, which stays.
    """
    interlock = bench.interlock
    try:
        interlock.acknowledge()
        if interlock.state is State.IDLE:
            _let_go(bench, look)
        if interlock.state in (State.IDLE, State.HOMED):
            prepare(bench)
    except TendonrodError as error:
        if interlock.fault is None:
            interlock.trip(FaultKind.CONTROLLER, where=str(error))
            bench.act()


def _let_go(bench: GuardedBench, look: Callable[[Sample], None]) -> None:
    """Slacken the tendon of a bench that does not know where it is, for its homing. The interlock bounds the time."""
    interlock, clock = bench.interlock, bench.clock
    interlock.release()
    while interlock.state is State.HELD:
        sample = bench.sense()
        bench.act()
        look(sample)
        if interlock.is_settled and interlock.state is State.HELD:
            interlock.acknowledge()
            return
        clock.wait_until(sample.time + interlock.limits.period)
