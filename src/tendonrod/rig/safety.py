"""`Interlock`: the state machine of a bench and what it lets through; no command reaches an axis but through it.

States: idle -home-> homed -arm-> armed -start-> running -hold-> held -resume-> running; finish: running or held ->
armed; release: any -> held, the screw pays out until the tendon is slack; a fault: any -> fault; acknowledge: fault or
released -> homed, or idle where a position can no longer be trusted; shutdown: release, and nothing more after it.
Only ``running`` obeys a controller. The first fault is latched until it is acknowledged; later ones are listed.

How each fault is found, in what time, and with which reaction: `rig.detection`.

Why hold is the rule: tension does not change while nothing moves, so an unknown state is best left as it is; too much
tension, however found, is let go. Reactions grow (hold, then release, then stop) and never shrink: a held bench whose
tension passes its limit releases. Stop is a person's word: nothing moves after it until a person acknowledges it.

What is not here: loss of this process. No check of a process survives it, so axes must stop by themselves when commands
stay away: the board's watchdog (`rig.firmware`) and the virtual axes do, within command_timeout. They then stand still
with the tendon under its tension; `Interlock.release` slackens it from any state of the next session, idle too. Homing
moves inside the devices: there `rig.guarded` looks at the load cell and at who asks for a stop, and refuses to begin
unless the tendon is slack. Rotation is not counted as raising tension.
"""

from __future__ import annotations

from collections import deque
from math import nan

from ..errors import TendonrodError
from .detection import DETECTION, StrainOf, Watch
from .interfaces import STILL, Clock, Command, Sample
from .limits import AXES, Limits
from .passage import Release, finite_command, possible
from .states import Fault, FaultKind, Reaction, State

__all__ = ["DETECTION", "IllegalTransition", "Interlock", "Limits"]

SEVERITY = {Reaction.HOLD: 0, Reaction.RELEASE: 1, Reaction.STOP: 2}


class IllegalTransition(TendonrodError):
    """A step of the state machine that is not possible where it stands; one line: what, where it stands, what is."""


class Interlock:
    """Watches every sample, and decides on every command; see the module's table. One thread, `emergency` excepted.

    limits: already narrowed by the devices' own. clock: the bench's; without one (replay) samples are never too old.
    strain: (insertion, tension in N) -> strain, None for no such limit. tools: that the tracker must see.
    """

    def __init__(
        self, limits: Limits | None = None, clock: Clock | None = None, strain: StrainOf | None = None,
        tools: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        self.limits = limits or Limits()
        self._clock = clock
        self._watch = Watch(self.limits, strain, tools)
        self._requests: deque[tuple[str, Reaction]] = deque()  # filled by other threads and signal handlers
        self._state, self._faults = State.IDLE, list[Fault]()
        self._homed = self._closing = False
        self._reaction, self._settled = Reaction.HOLD, True
        self._release: Release | None = None
        self._sample: Sample | None = None
        self._sent, self._last_command = STILL, nan

    # What it says

    @property
    def state(self) -> State:
        """Where the bench is."""
        return self._state

    @property
    def fault(self) -> Fault | None:
        """The first fault since the last acknowledgement."""
        return self._faults[0] if self._faults else None

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The first fault and, once each, those found after it, until acknowledged."""
        return tuple(self._faults)

    @property
    def reaction(self) -> Reaction | None:
        """What moves or does not move while held or in fault, None otherwise."""
        return self._reaction if self._state in (State.HELD, State.FAULT) else None

    @property
    def is_settled(self) -> bool:
        """Whether a reaction has nothing left to do: slack, timed out, or standing."""
        return self._settled

    @property
    def is_homed(self) -> bool:
        """Whether positions can be trusted."""
        return self._homed

    @property
    def is_asked_to_stop(self) -> bool:
        """Whether a fault stands, or a stop was asked for that the next check or command will act on."""
        return bool(self._requests) or self._state is State.FAULT

    # Steps of the state machine

    def require_home(self) -> None:
        """Raise `IllegalTransition` where `home` would."""
        self._step("home", State.IDLE, State.HOMED)

    def home(self) -> None:
        """The axes have found their references: idle or homed -> homed."""
        self.require_home()
        self._homed = True
        self._restart(State.HOMED)

    def arm(self) -> None:
        """Homed -> armed. The newest sample must be whole, with every axis at its reference."""
        self._step("arm", State.HOMED)
        if self._sample is None or not all(axis.homed for axis in _axes(self._sample)):
            raise IllegalTransition("cannot arm: there is no sample yet in which every axis is homed")
        self._state = State.ARMED

    def start(self) -> None:
        """Armed -> running: from here on the controller's commands get through."""
        self._step("start", State.ARMED)
        self._run()

    def hold(self) -> None:
        """Running -> held: all stand still under tension."""
        self._step("hold", State.RUNNING)
        self._state = State.HELD

    def resume(self) -> None:
        """Held -> running; not after a release."""
        self._step("resume", State.HELD)
        if self._release is not None:
            raise IllegalTransition("cannot resume: the tendon was released; acknowledge, arm and start instead")
        self._run()

    def finish(self) -> None:
        """Running or held -> armed: a task is done and another may start."""
        self._step("finish", State.RUNNING, State.HELD)
        if self._release is not None:
            raise IllegalTransition("cannot finish: the tendon was released; acknowledge instead")
        self._state = State.ARMED

    def release(self) -> None:
        """Any -> held, or a fault's hold -> release: the screw pays out until slack. Not after an emergency stop."""
        if self._state is State.FAULT and self._reaction is Reaction.STOP:
            raise IllegalTransition("cannot release: after an emergency stop nothing moves; acknowledge it first")
        self._state = State.FAULT if self._state is State.FAULT else State.HELD
        self._react(Reaction.RELEASE)

    def acknowledge(self) -> None:
        """Fault, or held after a release, -> homed or idle, once the reaction has settled."""
        self._take_requests()
        self._step("acknowledge", State.FAULT, State.HELD)
        if self._state is State.HELD and self._release is None:
            raise IllegalTransition("cannot acknowledge: the bench is held without fault; resume or finish instead")
        if not self._settled:
            raise IllegalTransition(f"cannot acknowledge: {self._reaction.value} has not finished")
        self._homed = self._homed and not any(map(loses_reference, self._faults))
        self._faults.clear()
        self._restart(State.HOMED if self._homed else State.IDLE)

    def shutdown(self) -> None:
        """Any -> the end: releases, unless a person stopped the bench; no step is possible after it."""
        if self._reaction is Reaction.HOLD:
            self.release()
        self._closing = True

    # Faults from outside

    def emergency(self, source: str = "API") -> None:
        """Stop everything; from any thread and from signal handlers. Acts with the next check or command."""
        self._requests.append((source, Reaction.STOP))

    def interrupt(self, source: str = "Ctrl-C") -> None:
        """Release tension, then stop, for good reason to end; from any thread and from signal handlers."""
        self._requests.append((source, Reaction.RELEASE))

    def failed(self, device: str, error: BaseException | str) -> None:
        """A device's driver raised ``error``."""
        self.trip(FaultKind.DEVICE, where=f"{device}: {' '.join(str(error).split())}" if str(error) else device)

    def trip(
        self, kind: FaultKind, value: float = nan, limit: float = nan, where: str = "",
        reaction: Reaction | None = None,
    ) -> None:  # fmt: skip
        """A fault found by whom it may be: latched if it is the first, listed if it is new; its reaction takes over."""
        reaction = DETECTION[kind].reaction if reaction is None else reaction
        key = where.partition(":")[0]
        if all(each.kind is not kind or each.where.partition(":")[0] != key for each in self._faults):
            fault = Fault(kind=kind, time=self._now(), reaction=reaction, value=value, limit=limit, where=where)
            self._faults.append(fault)
        if self._state not in (State.HELD, State.FAULT):
            self._reaction, self._settled = Reaction.HOLD, False
        self._state = State.FAULT
        if SEVERITY[reaction] > SEVERITY[self._reaction]:
            self._react(reaction)

    # Each period

    def check(self, sample: Sample, dt: float | None = None) -> Fault | None:
        """Look at a new sample; dt: s since the last, as measured, None to take it from the samples' times.

        Returns the latched fault. A sample that was checked before is not counted twice.
        """
        self._take_requests()
        if sample is self._sample:
            return self.fault
        before, self._sample = self._sample, sample
        if dt is None:
            dt = 0.0 if before is None else sample.time - before.time
        if self._homed:
            since = sample.time - self._last_command
            found = self._watch.found(sample, self._sent, dt, since, self._state is State.RUNNING)
            for kind, value, limit, where in found:
                self.trip(kind, value, limit, where)
        return self.fault

    def allowed(self, command: Command, sample: Sample) -> Command:
        """What may be sent: running, ``command`` within speeds, travel and soft limits; else the reaction's own."""
        self.check(sample)
        if self._state is State.RUNNING and not self._now() - sample.time <= self.limits.command_timeout:
            self.trip(FaultKind.STALE_SENSOR, self._now() - sample.time, self.limits.command_timeout, "sample")
        if self._state is State.RUNNING:
            command = self._possible(command, sample)
        if self._state is not State.RUNNING:
            command = self._own(sample)
        self._sent, self._last_command = command, self._now()
        return command

    def _possible(self, command: Command, sample: Sample) -> Command:
        """``command`` as far as limits let it, STILL with a fault where it is no command."""
        finite = finite_command(command)
        if finite is None:
            self.trip(FaultKind.CONTROLLER, where="its command is no finite number")
            return STILL
        return possible(finite, sample, self.limits, self._is_taut(sample))

    def _is_taut(self, sample: Sample) -> bool:
        """Whether tension must not rise any more: above a soft limit, or not known."""
        limits, tension = self.limits, sample.force.tension
        if not tension <= limits.soft * limits.tension:
            return True
        return not self._watch.strain_at(sample.translation.position, tension) <= limits.soft * limits.strain

    def _own(self, sample: Sample) -> Command:
        """The reaction's own command."""
        if self._state not in (State.HELD, State.FAULT):
            return STILL
        if self._reaction is not Reaction.RELEASE:
            self._settled = True
            return STILL
        assert self._release is not None
        velocity = self._release.speed(sample, self._now(), self._homed, self._faults)
        self._settled = velocity == 0.0 and not self._release.is_braking
        return STILL if velocity == 0.0 else Command(screw=velocity, target=0.0)

    # Inside

    def _take_requests(self) -> None:
        while self._requests:
            source, reaction = self._requests.popleft()
            self.trip(FaultKind.EMERGENCY, where=source, reaction=reaction)

    def _react(self, reaction: Reaction) -> None:
        self._reaction, self._settled = reaction, False
        if reaction is Reaction.RELEASE:
            self._release = Release(self.limits, self._now())

    def _run(self) -> None:
        self._state, self._last_command = State.RUNNING, self._now()

    def _restart(self, state: State) -> None:
        self._state, self._reaction, self._release, self._settled = state, Reaction.HOLD, None, True
        self._sent = STILL
        self._watch.restart()

    def _step(self, name: str, *possible: State) -> None:
        if self._closing:
            raise IllegalTransition(f"cannot {name}: the bench is shut down")
        if self._state not in possible:
            places = " or ".join(each.value for each in possible)
            raise IllegalTransition(f"cannot {name}: the bench is {self._state.value}; possible when {places}")

    def _now(self) -> float:
        if self._clock is not None:
            return self._clock.now()
        return self._sample.time if self._sample is not None else 0.0


def _axes(sample: Sample):
    return sample.screw, sample.translation, sample.rotation


def loses_reference(fault: Fault) -> bool:
    """Whether positions can't be trusted after ``fault``: an encoder jumped, or an axis may have lost its power."""
    return fault.kind is FaultKind.ENCODER_JUMP or (
        fault.kind is FaultKind.DEVICE and fault.where.partition(":")[0] in AXES
    )
