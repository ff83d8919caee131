"""The web server of `tendonrod navigate`: uvicorn around `routes`, behind `doors`, with a clean end on a signal."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import uvicorn

from ..errors import Fact, InvalidInput
from .doors import Door, Guarded
from .hub import Hub
from .routes import make_app
from .service import Service

LARGEST_FRAME = 1 << 16  # bytes; longer ones close the connection
ADDRESS = "an address of this machine, as 127.0.0.1 for itself alone or 0.0.0.0 for its networks"
SWITCH = 1e-3  # s, after which the pilot's thread lets the sockets work
PATIENCE = 2  # s for open connections at the end


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens there; port 0 for any free one. Raises `InvalidInput` where that cannot be had."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    if not host.strip():  # which would listen on every address, without a word
        raise InvalidInput("--host", Fact("''"), ADDRESS)
    found = socket.socket(family, socket.SOCK_STREAM)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # of its connections: states do not wait
        found.bind((host, port))
        found.listen(64)
    except OSError as error:
        found.close()
        if error.errno == errno.EADDRINUSE:
            raise InvalidInput("--port", port, "free: another program listens on it; 0 takes any free one") from None
        if error.errno == errno.EACCES:
            raise InvalidInput("--port", port, "one that this user may listen on, above 1023") from None
        why = "its name is not known" if isinstance(error, socket.gaierror) else "it is not one of this machine's"
        raise InvalidInput("--host", Fact(host), f"{ADDRESS}; {why}") from None
    return found


class Ending:
    """How a server is told to end: `end`, from any thread; a second time without waiting for open connections."""

    def __init__(self) -> None:
        self.server: uvicorn.Server | None = None
        self.is_asked = False

    def end(self) -> None:
        if self.server is not None:
            self.server.force_exit = self.is_asked
        self.is_asked = True


def serve(
    service: Service,
    at: socket.socket,
    door: Door,
    ready: Callable[[], Any] = lambda: None,
    ending: Ending | None = None,
) -> Path | None:
    """Serve until a signal or ``ending`` ends it, then close the session. Returns the path of its record.

    ready: called once when pages can connect.
    """
    hub = Hub(service)
    config = uvicorn.Config(
        Guarded(make_app(service, hub), door), lifespan="off", log_config=None, access_log=False, server_header=False,
        ws_max_size=LARGEST_FRAME, ws_per_message_deflate=False, ws_ping_interval=5.0, ws_ping_timeout=10.0,
        timeout_graceful_shutdown=PATIENCE,
    )  # fmt: skip
    server = _Server(config, ending or Ending(), service.end)
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    try:
        with contextlib.closing(at), _ended_by_signals(server.ending):
            asyncio.run(_serve(server, hub, at, ready))
    finally:
        sys.setswitchinterval(before)
        record = service.close()
    return record


class _Server(uvicorn.Server):
    """Leaves the signals to `_ended_by_signals`; uvicorn would raise them once more at its end.

    stand: called as soon as the end is asked for, before open connections are waited for, which may be in motion.
    """

    def __init__(self, config: uvicorn.Config, ending: Ending, stand: Callable[[], None]) -> None:
        super().__init__(config)
        self.ending, self.stand, ending.server = ending, stand, self

    async def on_tick(self, counter: int) -> bool:
        self.should_exit = self.should_exit or self.ending.is_asked
        if self.should_exit:
            self.stand()
        return await super().on_tick(counter)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


async def _serve(server: uvicorn.Server, hub: Hub, at: socket.socket, ready: Callable[[], Any]) -> None:
    hub.attach(asyncio.get_running_loop())
    hub.service.pilot.start()
    serving = asyncio.ensure_future(server.serve([at]))
    while not server.started and not serving.done():
        await asyncio.sleep(0.01)
    if server.started:
        ready()
    await serving


@contextlib.contextmanager
def _ended_by_signals(ending: Ending) -> Iterator[None]:
    """SIGINT and SIGTERM end the server."""

    def end(number: int, frame: Any) -> None:
        ending.end()

    try:
        before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    except ValueError:  # not the main thread: whoever started it ends it
        yield
        return
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
