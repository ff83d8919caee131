"""`Pilot`: runs a session in real time on a thread of its own, and shows records on the same screen.

The thread moves the robot only by what the dead-man's switch still holds; everything else that changes the session is
asked of it and done between two steps. One round is `tick`, which needs neither thread nor real clock.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from ..errors import InvalidInput, TendonrodError
from .commands import Jog
from .dead_man import DeadMan
from .film import Film, Happened, Playing
from .mechanics import seconds

if TYPE_CHECKING:
    from .session import Session
    from .snapshot import Snapshot

PERIOD = 1.0 / 60.0  # s, of a step and of a state to the clients while something moves
STILL = 0.08  # s, of the same while nothing does
SHORTEST = 1e-3  # s of motion in one step, right after a late one
LONGEST = 3.0 * PERIOD  # s of motion in one step: a late step moves no further
BEHIND = 0.2  # s: states that a long step has kept back are made up for, as many as belong in so long
HASTE = 0.5 * PERIOD  # s, from one such state to the next
STRIDES = 5  # of the mechanics in one step, so that it takes no longer than its period: beyond 300 deg/s it is slower
MOST_REQUESTS = 32
FAILED = "the step failed inside the program, and nothing moved; the server's log has the details"
LAPSED = "no command for 150 ms: stopped"  # at the latest then

_log = logging.getLogger(__name__)


class Frame(NamedTuple):
    """What is to be seen now. moving: whether a command is being carried out. film: of a record that is shown,
    news: what happened in it since the last frame.
    """

    snapshot: Snapshot
    moving: bool
    mode: Literal["live", "replay"]
    film: Playing | None = None
    news: Sequence[Happened] = ()


class Pilot:
    """The only one who touches the session.

    show: called with a `Frame`, on average at 60 Hz while something moves, else at 12 Hz. tell: called with a severity
    and a sentence. runs_still: whether the session's clock runs on while nothing moves. All are called on this thread.
    """

    def __init__(
        self,
        session: Session,
        *,
        show: Callable[[Frame], None],
        tell: Callable[[str, str], None],
        runs_still: Callable[[], bool] = lambda: True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.session, self.clock = session, clock
        self.dead_man: DeadMan[Jog] = DeadMan(clock)
        self._show, self._tell, self._runs_still = show, tell, runs_still
        self._requests: Queue[tuple[Callable[[], Any], Future[Any]]] = Queue(MOST_REQUESTS)
        self._film: Film | None = None
        self._due = self._beat = self._last = clock()
        self._moving, self._failing, self._ended, self._wake = False, False, False, Event()
        self._thread = Thread(target=self._run, name="pilot", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop, and end the thread after its present step."""
        self.dead_man.let_go()
        self._ended = True
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(10.0)

    @property
    def is_replaying(self) -> bool:
        return self._film is not None

    def hold(self, jog: Jog, seconds: float | None = None) -> int:
        """Move at ``jog`` until it is let go or not renewed in time; see `DeadMan.hold`."""
        serial = self.dead_man.hold(jog) if seconds is None else self.dead_man.hold(jog, seconds)
        self._wake.set()
        return serial

    def ask(self, work: Callable[[Session], Any]) -> Future[Any]:
        """Let the thread call ``work`` with the session, between two steps; nothing moves before it is done.

        Raises `InvalidInput` while a record is shown, and where too much is waiting already.
        """
        return self._ask(lambda: self._live(work))

    def settled(self) -> Future[Any]:
        """Done once the step that is being made now has been shown."""
        return self._ask(lambda: None)

    def play(self, frames: Iterator[Snapshot], speed: float, name: str = "", span: float = 0.0) -> Future[Any]:
        """Show ``frames``, ``speed`` times as fast as they were recorded; span: s that they take, if it is known."""
        return self._ask(lambda: self._begin_film(frames, name, span, speed))

    def set_film(self, **changes: Any) -> Future[Any]:
        """Another speed, pause or place of the record that is shown; see `Film.change`."""
        return self._ask(lambda: self._change_film(changes))

    def stop_playing(self) -> Future[Any]:
        return self._ask(self._end_film)

    def tick(self) -> float:
        """One round, if one is due; returns the seconds until the next."""
        self._do_requests()
        now = self.clock()
        waiting = self.dead_man.is_held and not self._moving and self._film is None
        if now < self._due and not waiting:
            return self._due - now
        if self._film is not None:
            self._show_film(now)
        else:
            self._advance(now)
        return max(0.0, self._due - self.clock())

    def _run(self) -> None:
        try:
            self.session.rehearse()
        except Exception:  # noqa: BLE001 - as below
            self._fail()
        while not self._ended:
            try:
                wait = self.tick()
            except Exception:  # noqa: BLE001 - the robot stands still, the clients are told, the server goes on
                self._fail()
                wait = STILL
            self._wake.wait(wait)
            self._wake.clear()

    def _fail(self) -> None:
        """Stand still, tell the clients once, and try again."""
        _log.exception("a step of the session failed")
        self.dead_man.let_go(FAILED)
        self._film, self._moving = None, False
        self._due = self.clock() + STILL
        if not self._failing:
            self._tell("limit", FAILED)
        self._failing = True

    def _ask(self, work: Callable[[], Any]) -> Future[Any]:
        self.dead_man.let_go("another request came")
        future: Future[Any] = Future()
        try:
            self._requests.put_nowait((work, future))
        except Full:
            raise InvalidInput("request", MOST_REQUESTS + 1, f"at most {MOST_REQUESTS} waiting; try again") from None
        self._wake.set()
        return future

    def _do_requests(self) -> None:
        while True:
            try:
                work, future = self._requests.get_nowait()
            except Empty:
                return
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(work())
            except Exception as error:  # noqa: BLE001 - it is whoever asked who hears of it
                future.set_exception(error)
            self._due = self.clock()

    def _live(self, work: Callable[[Session], Any]) -> Any:
        if self._film is not None:
            raise InvalidInput("mode", "replay", "live: end the replay first")
        return work(self.session)

    def _advance(self, now: float) -> None:
        """A step as long as the time since the last round, the first of a motion no longer than a period."""
        dt = min(max(now - self._last, SHORTEST), LONGEST if self._moving else PERIOD)
        found = self.dead_man.spend(dt, lambda jog: seconds(jog, STRIDES))
        if self.dead_man.lapsed():
            self._tell("warning", LAPSED)
        self._last = now
        if found is None:
            self._rest(now)
            return
        command, dt = found
        snapshot = self.session.step(command, dt)
        self._failing = False
        self._beat = (max(self._beat, now - BEHIND) if self._moving else now) + PERIOD
        self._due = max(self._beat, now + HASTE)
        self._moving = not command.is_still
        self._show(Frame(snapshot, self._moving, "live"))

    def _rest(self, now: float) -> None:
        """What moved is told to stand, whoever has control by now: a bench goes on for a moment by itself."""
        runs = self._moving or self._runs_still()
        snapshot = self.session.step(Jog(), STILL) if runs else self.session.snapshot
        self._moving = self._failing = False
        self._due = now + STILL
        self._show(Frame(snapshot, False, "live"))

    def _begin_film(self, frames: Iterator[Snapshot], name: str, span: float, speed: float) -> None:
        self._film = Film(frames, name=name, span=span, speed=speed, clock=self.clock)
        if self._moving:
            self._rest(self.clock())

    def _change_film(self, changes: dict[str, Any]) -> None:
        if self._film is None:
            raise InvalidInput("mode", "live", "replay: no record is shown")
        self._film.change(**changes)

    def _end_film(self) -> None:
        self._film = None

    def _show_film(self, now: float) -> None:
        film = self._film
        assert film is not None
        try:
            snapshot = film.look()
        except TendonrodError as error:
            self._tell("warning", f"the replay ended: {error}")
            self._film, self._due = None, now
        else:
            self._due = now + (STILL if film.is_idle else PERIOD)
            self._show(Frame(snapshot, film.is_moving, "replay", film.playing, film.passed()))
