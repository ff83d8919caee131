"""`Service`: what clients may do with the session and in which order; knows no sockets, see `hub` and `routes`.

Everything that stops the robot comes first and needs no control; everything that moves or changes it needs control.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import asdict, replace
from functools import partial
from itertools import chain
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from . import asked, told, wire
from .commands import FASTEST, Rates
from .film import span_of
from .news import News
from .outer_tube import RANGES
from .past import Past
from .pilot import Frame, Pilot
from .seat import Refused, Seat

if TYPE_CHECKING:
    from .records import Records
    from .session import Session

Tell = Callable[[told.Event | told.Settings], None]
ENDING = "the server ends"


class Service:
    """A session and those who see and steer it.

    The session must be at its beginning. records: where its records go, the first of them at once; None for none.
    show: called with the text of each state. tell: called with events and settings for everybody. control_changed:
    called after each change of who has control. The first two may be called on the pilot's thread.
    """

    def __init__(
        self,
        session: Session,
        records: Records | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.is_ending = self._is_opening = False
        self.records: Records | None = records
        self.record: Path | None = None
        self.seat, self.rates = Seat(clock), Rates().limited(session.fastest)
        self.show: Callable[[str], None] = lambda text: None
        self.tell: Tell = lambda message: None
        self.control_changed: Callable[[], None] = lambda: None
        if records is not None:
            self._begin_record(session)
        self.begun, self.gauges = session.scenario, session.snapshot.limits
        self._stops = 0
        self._news, self._past = News(session.snapshot), Past(clock)
        self.newest = Frame(session.snapshot, moving=False, mode="live")
        self.pilot = Pilot(session, show=self._seen, tell=self.event, runs_still=self._runs_still, clock=clock)

    # ---- what is

    def scene(self) -> dict[str, Any]:
        """As `told.Scene`."""
        return wire.scene(self.begun, self.gauges)

    def state(self) -> str:
        """The newest `told.State`, as text."""
        frame = self.newest
        name = None if self.record is None else self.record.name
        shown = {"moving": frame.moving, "mode": frame.mode, "film": frame.film}
        return wire.state(frame.snapshot, recording=name, trouble=self.pilot.session.trouble, **shown)

    def settings(self) -> told.Settings:
        rates = told.RateValues(**asdict(self.rates))
        return told.Settings(rates=rates, coupled=self.pilot.session.coupled)

    def welcome(self, client: str) -> dict[str, Any]:
        """As `told.Welcome`."""
        settings = self.settings().model_dump()
        most = asdict(self._most())
        allowed = {name: [low, most[name]] for name, (low, _) in Rates.allowed().items()}
        return {
            "type": "welcome", "protocol": told.PROTOCOL, "client": client, "scene": self.scene(),
            "rates": settings["rates"], "allowed_rates": allowed, "coupled": settings["coupled"],
            "allowed_tube": {name: list(ends) for name, ends in RANGES.items()}, "past": self._past.told(),
            "can_reset": self.pilot.session.can_reset,
        }  # fmt: skip

    def _most(self) -> Rates:
        """The highest rates of this session."""
        return Rates(**FASTEST).limited(self.pilot.session.fastest)

    # ---- what stops

    def stop(self, why: str = "stopped") -> None:
        """Nothing moves from now on; an event tells ``why`` if anything did."""
        did, self._stops = self.pilot.dead_man.is_held, self._stops + 1
        self.pilot.dead_man.let_go(why)
        self.pilot.session.halt()
        if did:
            self.event("info", why)

    def stopped_by(self, who: str) -> None:
        """``who`` wants everything to stand. Where that is not the operator, control is lost: whoever holds a key or
        runs a script would move on with the next command.
        """
        self.stop(f"stopped by {who}")
        holder = self.seat.holder
        if holder is not None and holder != who:
            self._unseat(holder, f"{who} stopped {holder}, which has to take control to go on")

    def end(self) -> None:
        """Nothing moves any more: the server ends."""
        if not self.is_ending:
            self.is_ending = True
            self.stop("the server ends: stopped")

    def leave(self, who: str, why: str) -> None:
        """``who`` gives control back or is gone."""
        if not self.seat.has(who):
            return
        self.stop(f"{why}: stopped")
        self._unseat(who, f"{who}: {why}")

    # ---- what needs control

    def take(self, who: str) -> None:
        """Raises `Refused` while somebody else has control and is there."""
        before = self.seat.holder
        if reason := ENDING if self.is_ending else self.seat.take(who):
            raise Refused(reason)
        if before != who:
            self.pilot.dead_man.let_go()
            self.event("info", f"{who} has control" + (f"; {before} was silent" if before else ""))
            self.control_changed()

    def jog(self, who: str, jog: asked.Jog | asked.Step, seconds: float | None = None) -> int:
        """Hold a command; see `Pilot.hold`. Raises `Refused`, and in a replay."""
        self._needs_control(who)
        if self.pilot.is_replaying:
            raise Refused("a record is shown: end the replay first")
        return self.pilot.hold(self.rates.jog(jog.insertion, jog.rotation, jog.tension), seconds)

    def set_rates(self, who: str, rates: asked.SomeRates | asked.Rates) -> None:
        """What is left out stays, and a bench goes no faster than it can. Raises `InvalidInput` outside all rates."""
        self._needs_control(who)
        asked_for = replace(self.rates, **rates.model_dump(exclude={"type"}, exclude_none=True))
        self.rates = asked_for.limited(self.pilot.session.fastest)
        self.tell(self.settings())

    def reset(self, who: str) -> Future[Any]:
        return self._change(who, lambda session: session.reset(), "reset: the robot is retracted")

    def place(self, who: str, tube: asked.Tube) -> Future[Any]:
        changes = tube.model_dump(exclude_none=True)
        return self._change(
            who, lambda session: session.place(session.snapshot.tube.changed(**changes)), "the outer tube is placed"
        )

    def acknowledge(self, who: str, home: bool) -> Future[Any]:
        """Raises `Refused`; the future `InvalidInput`, see `recovery`."""
        return self._change(who, lambda session: session.acknowledge(home), "the fault is acknowledged")

    def couple(self, who: str, on: bool) -> Future[Any]:
        text = "insertion turns the robot along its helix" if on else "the motor stands still while inserting"
        return self._change(who, lambda session: session.couple(on), text, settings=True)

    def set_recording(self, who: str, on: bool) -> Future[Any]:
        """Begin a new record, which needs a retracted robot, or end the present one."""
        if self.records is None:
            raise Refused("this server keeps no records")
        name = "" if self.record is None else self.record.name
        if on == bool(name):
            raise Refused(f"{name} is being recorded already" if name else "nothing is being recorded")
        text = "a new record begins" if on else f"the record {name} is ended"
        return self._change(who, self._begin_record if on else self._end_record, text)

    def play(self, who: str, name: str, speed: float) -> Future[Any]:
        """Raises `InvalidInput` where there is no such record.

        Its phantom may have to be built first: on a thread of its own, for the pages would take a silence of seconds
        for a lost connection.
        """
        self._needs_control(who)
        if self.records is None:
            raise Refused("this server keeps no records")
        if self._is_opening:
            raise Refused("a record is being opened already")
        path, opened = self.records.path(name), Future[Any]()
        self._is_opening = opened.set_running_or_notify_cancel()  # from now on nobody cancels it
        Thread(target=self._open, args=(who, path, speed, opened), name="replay", daemon=True).start()
        return opened

    def set_playback(self, who: str, change: asked.Playback) -> Future[Any]:
        """Speed, pause or place of the record that is shown."""
        self._needs_control(who)
        return self.pilot.set_film(speed=change.speed, paused=change.paused, at=change.at)

    def stop_playing(self, who: str) -> Future[Any]:
        self._needs_control(who)
        was_shown = self.pilot.is_replaying
        future = self.pilot.stop_playing()
        if was_shown:
            self.event("info", "back to the live session")
        return future

    def close(self) -> Path | None:
        """End thread, session and record; the path of the record."""
        self.pilot.close()
        self.pilot.session.close()
        return self.record

    # ---- inside

    def event(self, severity: str, text: str, at: float | None = None) -> None:
        """Tell everybody; at: s from the beginning of the record that is shown, for what happened in it."""
        time = self.pilot.session.snapshot.time if at is None else at
        what = {"severity": severity, "text": text, "time": round(time, 6), "record": at is not None}
        event = told.Event.model_validate(what)
        self._past.note(event)
        self.tell(event)

    def _needs_control(self, who: str) -> None:
        if reason := ENDING if self.is_ending else self.seat.refusal(who):
            raise Refused(reason)

    def _unseat(self, who: str, why: str) -> None:
        self.seat.leave(who)
        self.event("info", why)
        self.control_changed()

    def _change(self, who: str, work: Callable[[Session], Any], text: str, settings: bool = False) -> Future[Any]:
        self._needs_control(who)
        future = self.pilot.ask(partial(self._unless_stopped, work, self._stops))
        future.add_done_callback(partial(self._changed, f"{who}: {text}", settings))
        return future

    def _unless_stopped(self, work: Callable[[Session], Any], stops: int, session: Session) -> Any:
        """A stop drops what still waits, and ends what ``work`` begins."""
        if self._stops != stops:
            raise Refused("stopped before it was done")
        done = work(session)
        if self._stops != stops:
            session.halt()
        self._seen(Frame(session.snapshot, moving=False, mode="live"))  # before whoever asked hears that it is done
        return done

    def _changed(self, text: str, settings: bool, future: Future[Any]) -> None:
        if future.cancelled() or future.exception() is not None:
            return
        self.event("info", text)
        if settings:
            self.tell(self.settings())

    def _open(self, who: str, path: Path, speed: float, opened: Future[Any]) -> None:
        from .replay import replay

        try:
            frames = replay(path)
            first, span = next(frames), span_of(path)
            self._needs_control(who)
            shown = self.pilot.play(chain([first], frames), speed, path.name, span)
            self.event("info", f"{path.name} is shown")
            found = shown.result()
        except Exception as error:  # noqa: BLE001 - it is whoever asked who hears of it
            self._is_opening = False
            opened.set_exception(error)
        else:
            self._is_opening = False
            opened.set_result(found)

    def _begin_record(self, session: Session) -> None:
        from .record import SessionRecord

        assert self.records is not None
        path = self.records.fresh()
        session.start_recording(SessionRecord(path))
        self.record = path

    def _end_record(self, session: Session) -> None:
        session.stop_recording()
        self.record = None

    def _runs_still(self) -> bool:
        """While somebody steers, or a bench that stopped is still to be seen letting go."""
        return self.seat.holder is not None or self.pilot.session.trouble is not None

    def _seen(self, frame: Frame) -> None:
        self.newest = frame
        self._past.see(frame)
        trouble = self.pilot.session.trouble
        faults = self._news.trouble("" if trouble is None else trouble.text)
        live = self._news.of(frame.snapshot) if frame.mode == "live" else []  # a fault that is known is no refusal
        for severity, text in [*faults, *live]:
            self.event(severity, text)
        for at, severity, text in frame.news:
            self.event(severity, text, at)
        self.show(self.state())
