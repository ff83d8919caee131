"""A served session for the tests: the real server on a free port of this machine, in a thread; quick clients."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tendonrod.navigate.doors import Door
from tendonrod.navigate.records import Records
from tendonrod.navigate.server import Ending, listening, serve
from tendonrod.navigate.service import Service

PATIENCE = 10.0  # s, on a loaded machine


class Served:
    """url: of the page. service, session: those being served. token: as the door asks for it."""

    def __init__(self, session: Any, folder: Path | None, token: str | None, **options: Any) -> None:
        self.session = session
        self.service = Service(session, None if folder is None else Records(folder), **options)
        at = listening("127.0.0.1", 0)
        self.port = at.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        self.ending, ready = Ending(), threading.Event()
        door = Door(port=self.port, token=token)
        arguments = (self.service, at, door, ready.set, self.ending)
        self.thread = threading.Thread(target=serve, args=arguments, daemon=True)
        self.thread.start()
        self._pages = ExitStack()
        assert ready.wait(PATIENCE)

    def connect(self, **options: Any) -> Page:
        """A new page. Raises what `websockets` raises where it is not let in."""
        options = {"max_queue": None, "close_timeout": 0.2, **options}
        return Page(self._pages.enter_context(connect(f"ws://127.0.0.1:{self.port}/ws", **options)))

    def close(self) -> None:
        self.ending.end()
        self._pages.close()
        self.thread.join(PATIENCE)
        assert not self.thread.is_alive()


class Page:
    """A connection as the page has it. found: every message so far."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket, self.found, self.seq = socket, [], 0
        self.name = self.wait("welcome")["client"]

    def send(self, kind: str, **what: Any) -> None:
        self.socket.send(json.dumps({"type": kind, **what}))

    def jog(self, insertion: float = 0.0, rotation: float = 0.0, tension: float = 0.0, hold: bool = True) -> None:
        self.seq += 1
        self.send("jog", seq=self.seq, insertion=insertion, rotation=rotation, tension=tension, hold=hold)

    def hold_for(self, seconds: float, **shares: float) -> None:
        """Hold a command for so long, 30 times a second."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.jog(**shares)
            time.sleep(1 / 30)

    def take(self) -> None:
        self.send("take")
        self.wait("control", lambda each: each["you"])

    def wait(self, kind: str, fits: Callable[[Any], bool] = lambda each: True) -> Any:
        """The next message of this kind that fits."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            message = json.loads(self.socket.recv(PATIENCE))
            self.found.append(message)
            if message["type"] == kind and fits(message):
                return message
        raise AssertionError(f"no such {kind}; the last was {self.found[-1]}")

    def read_to_the_end(self) -> ConnectionClosed:
        """Read until the server closes the connection, which it must."""
        try:
            for _ in range(10_000):
                self.found.append(json.loads(self.socket.recv(PATIENCE)))
        except ConnectionClosed as closed:
            return closed
        raise AssertionError("the connection goes on")

    def settled(self) -> Any:
        """The state once everything that was sent before is done."""
        self.send("ping", id=len(self.found))
        self.wait("pong")
        return self.wait("state", lambda each: not each["moving"])


def eventually(fact: Callable[[], bool]) -> bool:
    """Whether it becomes true within `PATIENCE`."""
    end = time.monotonic() + PATIENCE
    while not fact() and time.monotonic() < end:
        time.sleep(0.01)
    return fact()


@contextmanager
def served(session: Any, folder: Path | None = None, token: str | None = None, **options: Any) -> Iterator[Served]:
    found = Served(session, folder, token, **options)
    try:
        yield found
    finally:
        found.close()
