"""`Hub`: the connected pages. Each gets the newest state as fast as it takes them, and never a queue of old ones."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from ..errors import TendonrodError
from . import asked, told
from .dead_man import DEADLINE
from .messages import CLIENT, LARGEST
from .ration import Ration
from .seat import Seat
from .service import Refused, Service

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

_log = logging.getLogger(__name__)

MOST_CLIENTS = 32
MOST_WAITING = 64  # events that a client may be behind with before it is sent away
PER_SECOND, BURST = 120.0, 240.0  # messages of one client
FAULTS_PER_SECOND, FAULTS = 1.0, 20.0  # refused messages of one client, after which it is sent away
BAD, BUSY = 1008, 1013  # WebSocket close codes: policy violated, try again later


class Client:
    """One connected page. must_let_go: whether what it holds moves nothing until it was let go once."""

    def __init__(self, name: str) -> None:
        self.name, self.wake = name, asyncio.Event()
        self.waiting: deque[str] = deque()
        self.state: str | None = None
        self.seq, self.jogged = -1, -inf
        self.is_holding = self.must_let_go = False
        self.closing: tuple[int, str] | None = None
        self.messages, self.faults = Ration(PER_SECOND, BURST), Ration(FAULTS_PER_SECOND, FAULTS)

    def tell(self, message: BaseModel | str) -> None:
        if self.closing is not None:
            return
        self.waiting.append(message if isinstance(message, str) else message.model_dump_json())
        if len(self.waiting) > MOST_WAITING:
            self.send_away(BUSY, "too slow")
        self.wake.set()

    def holds(self, jog: asked.Jog, now: float) -> bool:
        """Whether ``jog``, heard at ``now`` (s), is one to move by: newer than the last, and let go since a stop.

        A pause of `DEADLINE` counts as letting go, for clients that just fall silent.
        """
        is_new, paused = jog.seq > self.seq, now - self.jogged > DEADLINE
        self.seq, self.jogged = max(self.seq, jog.seq), now
        self.is_holding = jog.hold
        self.must_let_go = self.must_let_go and jog.hold and not paused
        return jog.hold and is_new and not self.must_let_go

    def stop(self) -> None:
        """What it holds now moves nothing any more."""
        self.must_let_go = self.is_holding

    def show(self, state: str) -> None:
        """The newest state takes the place of one that was not sent yet."""
        self.state = state
        self.wake.set()

    def send_away(self, code: int, reason: str) -> None:
        self.closing = self.closing or (code, reason)
        self.wake.set()


class Hub:
    """Between the sockets of the pages and the `Service`. Lives on one event loop; `show` and `tell` may be called
    from any thread."""

    def __init__(self, service: Service) -> None:
        self.service, self.clients = service, dict[str, Client]()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._newest: str | None = None
        self._was_free, self._count = True, 0

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """From now on the service's news go to the clients."""
        self._loop = loop
        self.service.show, self.service.tell = self.show, self.tell
        self.service.control_changed = lambda: self._soon(self._tell_control)

    def show(self, state: str) -> None:
        """A new state for everybody; where the loop is behind, only the newest."""
        first, self._newest = self._newest is None, state
        if first:
            self._soon(self._pass_on)

    def tell(self, message: BaseModel) -> None:
        self._soon(self._tell_all, message.model_dump_json())

    def new_name(self, kind: str) -> str:
        self._count += 1
        return f"{kind}-{self._count}"

    async def serve(self, socket: WebSocket) -> None:
        """One connection, from its welcome to its end."""
        await socket.accept()
        if len(self.clients) >= MOST_CLIENTS:
            await socket.close(BUSY, f"{MOST_CLIENTS} pages are connected already")
            return
        client = Client(self.new_name("page"))
        self.clients[client.name] = client
        self._greet(client)
        tasks = [asyncio.ensure_future(work(client, socket)) for work in (self._send, self._receive)]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            del self.clients[client.name]
            self.service.leave(client.name, "connection closed")
            self._tell_control()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _greet(self, client: Client) -> None:
        client.tell(told.Welcome.model_validate(self.service.welcome(client.name)))
        self._tell_control()
        client.show(self.service.state())

    async def _send(self, client: Client, socket: WebSocket) -> None:
        while True:
            await client.wake.wait()
            client.wake.clear()
            if client.closing is not None:
                await socket.close(*client.closing)
                return
            while client.waiting:
                await socket.send_text(client.waiting.popleft())
            if client.state is not None:
                state, client.state = client.state, None
                await socket.send_text(state)

    async def _receive(self, client: Client, socket: WebSocket) -> None:
        while True:
            received = await socket.receive()
            if received["type"] == "websocket.disconnect":
                return
            await self.heard(client, received)

    async def heard(self, client: Client, received: Mapping[str, Any]) -> None:
        """Do what a message says, ``received`` as ASGI gives it, or tell the client why not."""
        try:
            await self._answer(client, received.get("text"))
        except TendonrodError as error:
            self._refuse(client, str(error), is_fault=False)
        except Exception:  # noqa: BLE001 - the robot stands still, the client is told, the server goes on
            _log.exception("a message failed")
            self._refuse(client, "this failed inside the program; the server's log has the details")

    async def _answer(self, client: Client, text: str | None) -> None:
        if not client.messages.spend():
            self._refuse(client, f"too many messages: at most {PER_SECOND:g} per second")
            return
        if text is None:
            self._refuse(client, "text, one JSON object per message, not bytes")
            return
        if len(text) > LARGEST:
            self._refuse(client, f"a message of at most {LARGEST} characters, this one has {len(text)}")
            return
        try:
            message = CLIENT.validate_json(text)
        except ValidationError as error:
            self._refuse(client, sentence(error.errors(include_url=False, include_context=False, include_input=False)))
            return
        self.service.seat.heard(client.name)
        await self._do(client, message)

    async def _do(self, client: Client, message: Any) -> None:
        service, who = self.service, client.name
        match message:
            case asked.Jog():
                self._jog(client, message)
            case asked.Ping():
                client.tell(told.Pong(id=message.id))
                if service.seat.is_free != self._was_free:
                    self._tell_control()
            case asked.Stop():
                client.stop()
                service.stopped_by(who)
            case asked.Take():
                service.take(who)
            case asked.Release():
                service.leave(who, "control released")
            case asked.Rates():
                service.set_rates(who, message)
            case _:
                client.stop()
                await asyncio.wrap_future(self._change(who, message))

    def _change(self, who: str, message: Any) -> Any:
        service = self.service
        match message:
            case asked.Reset():
                return service.reset(who)
            case asked.Place():
                return service.place(who, message.tube)
            case asked.Acknowledge():
                return service.acknowledge(who, message.home)
            case asked.Coupling():
                return service.couple(who, message.on)
            case asked.Record():
                return service.set_recording(who, message.on)
            case asked.Replay():
                return service.play(who, message.name, message.speed)
            case asked.ReplaySet():
                return service.set_playback(who, message)
            case asked.ReplayStop():
                return service.stop_playing(who)
        raise Refused(f"{message.type} is not known")

    def _jog(self, client: Client, jog: asked.Jog) -> None:
        """Older ones than the newest are dropped; letting go needs no order."""
        has = self.service.seat.has(client.name)
        if client.holds(jog, self.service.pilot.clock()) or (jog.hold and not has):
            self.service.jog(client.name, jog)
        elif has and not jog.hold:
            self.service.pilot.dead_man.let_go()

    def _refuse(self, client: Client, text: str, is_fault: bool = True) -> None:
        """Whatever is refused moves nothing, and stops what its sender was moving.

        is_fault: whether a page as it should be would never have sent this; one that jogs on into a replay may.
        """
        if self.service.seat.has(client.name):
            client.stop()
            self.service.stop("stopped: a message was refused")
        client.tell(told.Error(text=text[:400]))
        if is_fault and not client.faults.spend():
            client.send_away(BAD, "too many refused messages")

    def _tell_control(self) -> None:
        seat: Seat = self.service.seat
        self._was_free = seat.is_free
        for client in self.clients.values():
            you = seat.has(client.name)
            watchers = len(self.clients) - sum(seat.has(name) for name in self.clients)
            client.tell(told.Control(operator=seat.holder, you=you, watchers=watchers, free=self._was_free))

    def _tell_all(self, text: str) -> None:
        for client in self.clients.values():
            client.tell(text)

    def _pass_on(self) -> None:
        state, self._newest = self._newest, None
        if state is not None:
            for client in self.clients.values():
                client.show(state)

    def _soon(self, call: Any, *arguments: Any) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *arguments)


def sentence(errors: Sequence[Any]) -> str:
    """What is wrong with a message, in one line; errors: of pydantic or FastAPI."""
    first = errors[0]
    where = ".".join(str(each) for each in first["loc"])
    return f"{where or 'message'}: {first['msg'][0].lower()}{first['msg'][1:]}"
