"""`Session`: a robot steered through a phantom, step by step; headless, and the same again for the same commands."""

from __future__ import annotations

from dataclasses import replace

from ..errors import Fact, InvalidInput, TendonrodError, within
from .commands import FASTEST, NAMES, Jog, Posture
from .drive import Drive, IdealDrive, Untroubled, limited
from .mechanics import SNAP, STRIDE, Body, Travel, move, rest
from .observation import observed
from .outer_tube import OuterTube
from .record import SessionRecord
from .recovery import Trouble
from .refusals import Refusals
from .scenario import Scenario
from .snapshot import Notice, Snapshot

LONGEST = 60.0  # s of one step
HOMED = 2e-3  # m: a bench that draws in more than this from one step to the next looks for its references
OWN = ("record", "snap")  # codes of the session's own warnings


class Session:
    """Steers the robot of a `Scenario` with a `Drive`; ``record``, if given, keeps every command.

    No wall time enters: `snapshot` depends on the scenario and the commands alone, bit for bit.
    """

    def __init__(self, scenario: Scenario, drive: Drive | None = None, record: SessionRecord | None = None) -> None:
        if not isinstance(scenario, Scenario):
            raise InvalidInput("scenario", scenario, "a Scenario")
        self._drive: Drive = IdealDrive(scenario) if drive is None else drive
        self.scenario, self._record = limited(scenario, self._drive), record
        self._body = rest(self.scenario, self._drive.posture)
        self._refusals = Refusals()
        self._snapped = 0.0
        self._apart: Posture | None = None  # what a real drive holds, where the model could not follow it
        self.snapshot: Snapshot = observed(self.scenario, self._body, index=0, time=0.0, blocked="")
        if record is not None:
            record.begin(self.scenario, type(self._drive).__name__, self.snapshot)

    @property
    def coupled(self) -> bool:
        """Whether insertion turns the motor by the follow-the-leader law."""
        return self._drive.coupled

    @property
    def can_reset(self) -> bool:
        """Whether `reset` is possible: on a bench the robot takes its time to retract."""
        return isinstance(self._drive, Untroubled)

    @property
    def fastest(self) -> Jog:
        """Rates that the drive can follow for long."""
        return self._drive.fastest

    @property
    def trouble(self) -> Trouble | None:
        """What keeps a bench from moving, and what to do about it; None where nothing does."""
        return self._drive.trouble

    def acknowledge(self, home: bool = False) -> Snapshot:
        """Let a bench obey again after a fault; the next steps show where it then is.

        home: whether the robot may be let go and drawn in, where positions are not known. Raises `TendonrodError`.
        """
        self._drive.acknowledge(home)
        return self.snapshot

    def halt(self) -> None:
        """End a homing that `acknowledge` has begun; from any thread."""
        self._drive.halt()

    def step(self, jog: Jog, dt: float) -> Snapshot:
        """The session ``dt`` s later, moved at ``jog`` meanwhile.

        Raises `InvalidInput` for what is no `Jog` or no time in (0, 60] s; whatever an operator can do is carried out
        or refused, and the snapshot says so.
        """
        if not isinstance(jog, Jog):
            raise InvalidInput("jog", jog, "a Jog")
        dt = within("dt", dt, 1e-6, LONGEST)
        before = self._body
        blocked = self._advanced(jog, dt)
        self._show(before, dt, blocked)
        if self._record is not None:
            self._record.step(jog, dt, self.snapshot, self._apart)
        return self.snapshot

    def rehearse(self) -> None:
        """Compute a few steps of another session of this scenario, so that the first of this one need not wait for
        compiled code to be loaded.
        """
        other, length = Session(self.scenario), self.scenario.robot.section.L
        for share in (0.02, 0.05, 0.05):
            other.step(Jog(insertion=min(share * length / 0.5, FASTEST["insertion"])), 0.5)

    def place(self, tube: OuterTube) -> Snapshot:
        """Put the outer tube elsewhere. Raises `InvalidInput` unless the robot is retracted and the place is free."""
        if self._body.posture.insertion > 0.0:
            exposed = Fact(f"{1e3 * self.snapshot.exposed:.1f} mm of robot out")
            raise InvalidInput("insertion", exposed, "0 while the outer tube is placed: retract the robot first")
        self._resume(self.scenario.placed(tube), self._body.posture, self.snapshot.reached)
        if self._record is not None:
            self._record.placed(tube)
        return self.snapshot

    def reset(self) -> Snapshot:
        """Retract the robot at once, without tension, and forget the targets reached; index and time go on.

        Raises `TendonrodError` on a bench.
        """
        if not self._drive.retract():
            raise TendonrodError("on a bench the robot cannot be retracted at once: drive it back instead")
        self._resume(self.scenario, self._drive.posture, ())
        if self._record is not None:
            self._record.reset()
        return self.snapshot

    def couple(self, on: bool) -> Snapshot:
        """Let insertion turn the motor by the follow-the-leader law (True), or let the motor stand (False)."""
        if not isinstance(on, bool):
            raise InvalidInput("on", on, "True or False")
        self._drive.coupled = on
        self.scenario, self._refusals = replace(self.scenario, coupled=on), Refusals()
        if self._record is not None:
            self._record.coupled(on)
        return self.snapshot

    def start_recording(self, record: SessionRecord) -> None:
        """Keep every command from now on. Raises `InvalidInput` unless the robot is retracted: a replay starts so."""
        if self._body.posture.insertion > 0.0:
            exposed = Fact(f"robot {1e3 * self.snapshot.exposed:.1f} mm out")
            raise InvalidInput("record", exposed, "started with the robot retracted, from where it can be replayed")
        self.stop_recording()
        self._resume(self.scenario, self._body.posture, self.snapshot.reached)  # as a replay begins, without history
        record.begin(self.scenario, type(self._drive).__name__, self.snapshot)
        self._record = record

    def stop_recording(self) -> None:
        """End the record, if there is one."""
        record, self._record = self._record, None
        if record is not None:
            record.close()

    def close(self) -> None:
        """Stop the drive and end the record."""
        self._drive.close()
        self.stop_recording()

    def _advanced(self, jog: Jog, dt: float) -> str:
        """Carry out a jog as far as it goes; returns why not further, "" where it went all the way."""
        self._snapped, self._apart = 0.0, None
        goal = self._drive.advance(jog, dt)
        if goal == self._body.posture:
            self._refusals.pause()
            return self._drive.fault
        if goal.insertion == 0.0 and self.snapshot.exposed > HOMED:  # what is all in has no history
            self._body = rest(self.scenario, goal)
            return self._drive.fault
        travel = self._moved(goal)
        self._body, self._snapped = travel.body, travel.snapped
        if travel.body.posture != goal and not self._drive.go_back(travel.body.posture):
            self._apart = goal
        why = travel.refused or self._ahead()
        if not why:
            return self._drive.fault
        if self._apart is not None:
            return f"the model cannot follow the robot: {why}"
        left = [name for name in NAMES if getattr(travel.body.posture, name) != getattr(goal, name)]
        return f"{jog.words(left)} refused: {travel.refused}; go back, or another way"

    def _ahead(self) -> str:
        """Whether the shape shown is that of a robot withdrawn further than the real one, by more than a stride."""
        if self._apart is None:
            return ""
        ahead = (self._apart.insertion - self._body.posture.insertion) * self.scenario.robot.length_na
        return f"its next equilibrium has {1e3 * ahead:.1f} mm less out" if ahead > STRIDE["insertion"] else ""

    def _moved(self, goal: Posture) -> Travel:
        """Towards ``goal``; of what is known to be refused only the part that withdraws the robot, if any."""
        body = self._body
        why, allowed = self._refusals.known(self.scenario, body, goal)
        travel = Travel(body=body) if allowed == body.posture else move(self.scenario, body, allowed)
        if not why:
            self._refusals.add(self.scenario, body, goal, travel)
            return travel
        if travel.body is body:
            self._refusals.add_stuck(self.scenario, body, goal)
        return replace(travel, refused=why)

    def _show(self, before: Body, dt: float, blocked: str) -> None:
        old, told = self.snapshot, self._told()
        course = {"index": old.index + 1, "time": old.time + dt, "blocked": blocked}
        if self._body is before and told == tuple(each for each in old.warnings if each.code in OWN):
            self.snapshot = replace(old, **course)
        else:
            self.snapshot = observed(self.scenario, self._body, reached=old.reached, warnings=told, **course)

    def _resume(self, scenario: Scenario, posture: Posture, reached: tuple[str, ...]) -> None:
        """Begin anew at ``posture``, which must have no history: retracted."""
        body, old = rest(scenario, posture), self.snapshot
        shown = observed(scenario, body, index=old.index, time=old.time, blocked="", reached=reached)
        self.scenario, self._body, self._refusals, self.snapshot = scenario, body, Refusals(), shown

    def _told(self) -> tuple[Notice, ...]:
        """Warnings of the session's own."""
        fault, snapped = "" if self._record is None else self._record.fault, self._snapped
        told = [Notice(code="record", text=fault, severity="limit")] if fault else []
        if snapped > SNAP:
            text = f"the robot snapped by {1e3 * snapped:.1f} mm"
            told.append(Notice(code="snap", text=text, severity="limit"))
        return tuple(told)
