"""Live shape and poses to 3D Slicer and other OpenIGTLink clients; needs the extra "slicer" (pyigtl).

pyigtl packs the messages. The server is our own: pyigtl's takes SIGINT and SIGTERM for itself, which here belong to the
emergency stop, serves one client only, and keeps up to 100 stale messages for it. Here any number of clients get the
newest message of each name, and a client that does not read holds nobody up.

Lengths go out in mm, as Slicer expects; the frame is the sender's, and a transform in Slicer brings it to the patient.
"""

from __future__ import annotations

import selectors
import socket
from collections.abc import Iterable
from contextlib import suppress
from threading import Lock, Thread

import numpy as np

from ..errors import InvalidInput, numbers, vector, whole
from .interfaces import DeviceError, PoseFrame

PORT = 18944  # registered for OpenIGTLink
NAME_LONGEST = 20  # bytes of a device name
MM = 1e3
WAKE = b"\0"


class SlicerStream:
    """A server on ``port`` that sends what it is given to all who are connected; sending never waits.

    ``port``: the port it has, for 0 one that was free.
    """

    def __init__(self, port: int = PORT, host: str = "127.0.0.1") -> None:
        """Listen; ``host`` "" for all networks. Raises `InvalidInput`, `DeviceError` (no pyigtl, port taken)."""
        self._messages = _pyigtl()
        try:
            self._listening = socket.create_server((host, whole("port", port, 0, 65535)))
        except OSError as error:
            raise DeviceError(f"OpenIGTLink: cannot listen on {host}:{port}: {error.strerror or error}") from None
        self.port: int = self._listening.getsockname()[1]
        self._lock, self._clients, self._is_open = Lock(), {}, True
        self._wake, self._woken = socket.socketpair()
        for each in (self._listening, self._wake, self._woken):
            each.setblocking(False)
        self._thread = Thread(target=self._serve, name="OpenIGTLink", daemon=True)
        self._thread.start()

    def __enter__(self) -> SlicerStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def send_transform(self, name: str, T: np.ndarray, time: float | None = None) -> None:
        """A TRANSFORM. T (4, 4): rigid, position in m; time: s since 1970, now if None."""
        matrix = numbers("T", T, 2)
        if matrix.shape != (4, 4):
            raise InvalidInput("T", T, "a matrix of shape (4, 4)")
        matrix[:3, 3] *= MM
        self._send(self._messages.TransformMessage(matrix, timestamp=time, device_name=_name(name)))

    def send_pose(self, name: str, position: Iterable, quaternion: Iterable, time: float | None = None) -> None:
        """A TRANSFORM of a pose: position (3,) m, quaternion (w, x, y, z)."""
        T = np.eye(4)
        T[:3, 3] = vector("position", tuple(position), 3)
        T[:3, :3] = _rotation(vector("quaternion", tuple(quaternion), 4))
        self.send_transform(name, T, time)

    def send_frames(self, frames: Iterable[PoseFrame], to: str = "Tracker") -> None:
        """The newest pose of each tool as TRANSFORM "<tool>To<to>"; lost frames leave the last pose where it was."""
        newest = {frame.tool: frame for frame in frames if not frame.is_lost}
        for tool, frame in newest.items():
            self.send_pose(f"{tool}To{to}", frame.position, frame.quaternion)

    def send_shape(
        self, name: str, positions: np.ndarray, time: float | None = None, as_points: bool = False
    ) -> None:  # fmt: skip
        """A centre line: positions (n, 3) in m, n >= 2. A POLYDATA of one line (a model in Slicer), or with
        ``as_points`` a POINT list (markups), which clients on pyigtl can read as well."""
        points = MM * numbers("positions", positions, 2)
        if points.shape[0] < 2 or points.shape[1] != 3:
            raise InvalidInput("positions", positions, "an array of shape (n, 3), n >= 2")
        facts = {"timestamp": time, "device_name": _name(name)}
        if as_points:
            names = [f"{name} {i}"[:63] for i in range(len(points))]
            self._send(self._messages.PointMessage(points, names=names, **facts))
        else:
            line = np.concatenate([[len(points)], np.arange(len(points))])
            self._send(self._messages.PolyDataMessage(points=points, lines=line, **facts))

    def close(self) -> None:
        """Let all clients go; a second time does nothing."""
        self._is_open = False
        self._rouse()
        self._thread.join()

    def _send(self, message) -> None:
        if not self._is_open:
            raise DeviceError("OpenIGTLink: the stream is closed")
        packed = message.pack()
        with self._lock:
            for client in self._clients.values():
                client.waiting[message.device_name] = packed
        self._rouse()

    def _rouse(self) -> None:
        with suppress(OSError):  # full: it will wake anyway; closed: it is gone
            self._wake.send(WAKE)

    def _serve(self) -> None:
        """In the background: take clients, drop what they say, send them what waits."""
        with selectors.DefaultSelector() as chosen:
            chosen.register(self._listening, selectors.EVENT_READ)
            chosen.register(self._woken, selectors.EVENT_READ)
            while self._is_open:
                for key, _ in chosen.select():
                    if key.fileobj is self._listening:
                        self._take_client(chosen)
                    elif not self._hear(key.fileobj):
                        self._drop(key.fileobj, chosen)
                self._send_waiting(chosen)
            for each in (*self._clients, self._listening, self._wake, self._woken):
                each.close()

    def _take_client(self, chosen: selectors.BaseSelector) -> None:
        with suppress(OSError):
            client, _ = self._listening.accept()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            chosen.register(client, selectors.EVENT_READ)
            with self._lock:
                self._clients[client] = _Client()

    def _hear(self, where) -> bool:
        """Drop what came in; False where the other side is gone."""
        try:
            return bool(where.recv(65536))
        except BlockingIOError:  # it is writable, no more
            return True
        except OSError:
            return False

    def _drop(self, client, chosen: selectors.BaseSelector) -> None:
        chosen.unregister(client)
        client.close()
        with self._lock:
            self._clients.pop(client, None)

    def _send_waiting(self, chosen: selectors.BaseSelector) -> None:
        for socket_, client in list(self._clients.items()):
            try:
                while part := self._next_part(client):
                    client.going = part[socket_.send(part) :]
            except BlockingIOError:
                pass
            except OSError:
                self._drop(socket_, chosen)
                continue
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.going else 0)
            chosen.modify(socket_, events)

    def _next_part(self, client: _Client) -> bytes:
        """The rest of the message that is going out, or else the one that has waited longest."""
        if not client.going:
            with self._lock:
                if client.waiting:
                    client.going = client.waiting.pop(next(iter(client.waiting)))
        return client.going


class _Client:
    """What one client has not got yet: the newest message of each name, and the rest of the one that is going out."""

    def __init__(self) -> None:
        self.waiting: dict[str, bytes] = {}
        self.going = b""


def _name(name: str) -> str:
    if not isinstance(name, str) or not 0 < len(name.encode()) <= NAME_LONGEST:
        raise InvalidInput("name", name, f"a text of 1 to {NAME_LONGEST} bytes")
    return name


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    """(3, 3) of (w, x, y, z), of any length but 0."""
    length = float(np.linalg.norm(quaternion))
    if length == 0.0:
        raise InvalidInput("quaternion", quaternion, "not zero")
    w, x, y, z = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _pyigtl():
    try:
        import pyigtl  # pyright: ignore[reportMissingImports] - an extra
    except ImportError:
        raise DeviceError("OpenIGTLink needs pyigtl: pip install 'tendonrod[slicer]'") from None
    return pyigtl
