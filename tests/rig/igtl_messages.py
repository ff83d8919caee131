"""OpenIGTLink messages taken apart byte by byte, as the standard says."""

import socket
import struct

import numpy as np


def exactly(client: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        got = client.recv(size - len(data))
        assert got, "the stream ended"
        data += got
    return data


def message(client: socket.socket) -> tuple[str, str, bytes]:
    """Type, name and body of one message."""
    version, kind, name, _, size, _ = struct.unpack(">H12s20sQQQ", exactly(client, 58))
    body = exactly(client, size)
    return kind.rstrip(b"\0").decode(), name.rstrip(b"\0").decode(), body[12:] if version == 2 else body


def line_of(body: bytes) -> np.ndarray:
    """(n, 3) points (m) of a POLYDATA."""
    (n,) = struct.unpack(">I", body[:4])
    return 1e-3 * np.frombuffer(body, ">f4", 3 * n, offset=40).reshape(n, 3).astype(float)


def matrix_of(body: bytes) -> np.ndarray:
    """(4, 4), position in m, of a TRANSFORM: the columns of the rotation, then the position."""
    T = np.eye(4)
    T[:3] = np.array(struct.unpack(">12f", body[:48])).reshape(4, 3).T
    T[:3, 3] *= 1e-3
    return T
