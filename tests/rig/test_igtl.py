"""OpenIGTLink on loopback: read by pyigtl's own client, and taken apart byte by byte as the standard says."""

import socket
import struct
import time

import numpy as np
import pytest

from rig.igtl_messages import message
from tendonrod.errors import InvalidInput
from tendonrod.rig.interfaces import DeviceError, PoseFrame

pyigtl = pytest.importorskip("pyigtl")
from tendonrod.rig.igtl import SlicerStream  # noqa: E402

HALF = 0.5**0.5
LINE = np.array([[0.0, 0.0, 0.0], [0.001, 0.0, 0.01], [0.003, -0.002, 0.02]])


@pytest.fixture
def stream():
    with SlicerStream(port=0) as opened:
        yield opened


def connected(stream: SlicerStream, count: int = 1) -> None:
    deadline = time.monotonic() + 5.0
    while stream.clients < count and time.monotonic() < deadline:
        time.sleep(0.005)
    assert stream.clients == count


@pytest.fixture
def raw(stream):
    with socket.create_connection(("127.0.0.1", stream.port), timeout=5.0) as client:
        connected(stream)
        yield client


@pytest.fixture
def client(stream):
    opened = pyigtl.OpenIGTLinkClient("127.0.0.1", stream.port)
    connected(stream)
    yield opened
    opened.stop()


def test_a_pose_arrives_as_a_transform_in_mm(stream, client):
    """A quarter turn about z takes x to y."""
    stream.send_pose("tip", (0.001, 0.002, -0.1), (HALF, 0.0, 0.0, HALF), time=1e9)
    got = client.wait_for_message("tip", timeout=5.0)
    assert got.matrix[:3, 3] == pytest.approx([1.0, 2.0, -100.0])
    assert got.matrix[:3, 0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert got.timestamp == pytest.approx(1e9, abs=1e-3)


def test_a_shape_as_points_is_read_by_pyigtl(stream, client):
    stream.send_shape("shape", LINE, as_points=True)
    got = client.wait_for_message("shape", timeout=5.0)
    assert np.array(got.positions) == pytest.approx(1e3 * LINE)
    assert got.names == ["shape 0", "shape 1", "shape 2"]


def test_a_shape_is_one_line_of_polydata(stream, raw):
    stream.send_shape("shape", LINE)
    kind, name, body = message(raw)
    assert (kind, name) == ("POLYDATA", "shape")
    counts = struct.unpack(">10I", body[:40])
    assert counts == (3, 0, 0, 1, 16, 0, 0, 0, 0, 0)
    points = np.frombuffer(body, ">f4", 9, offset=40).reshape(3, 3)
    assert points == pytest.approx(1e3 * LINE, rel=1e-6)
    assert struct.unpack(">4I", body[76:92]) == (3, 0, 1, 2)


def test_only_the_newest_pose_of_each_tool_goes_out_and_lost_ones_do_not(stream, raw):
    def frame(tool, number, x, **more):
        return PoseFrame(time=0.0, frame=number, tool=tool, position=(x, 0, 0), quaternion=(1, 0, 0, 0), **more)

    stream.send_frames([frame("tip", 1, 0.001), frame("tip", 2, 0.002), frame("tip", 3, float("nan"))])
    kind, name, body = message(raw)
    assert (kind, name) == ("TRANSFORM", "tipToTracker")
    assert struct.unpack(">12f", body[:48])[9] == pytest.approx(2.0)


def test_a_client_that_does_not_read_holds_nobody_up_and_others_get_the_newest(stream, raw):
    """10 MB for a client that takes none of it: it costs two messages of memory, and no time."""
    with socket.create_connection(("127.0.0.1", stream.port), timeout=5.0) as other:
        connected(stream, 2)
        long = np.zeros((10_000, 3))
        for _ in range(60):
            stream.send_shape("long", long)
            assert message(other)[1] == "long"
        start = time.monotonic()
        stream.send_pose("tip", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        slowest = time.monotonic() - start
        assert message(other)[1] == "tip"
    assert slowest < 0.5
    held = [sum(map(len, each.waiting.values())) + len(each.going) for each in stream._clients.values()]
    assert max(held) < 4e5


def test_clients_come_and_go(stream):
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", stream.port), timeout=5.0) as one:
            connected(stream)
            stream.send_pose("tip", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
            assert message(one)[0] == "TRANSFORM"
        deadline = time.monotonic() + 5.0
        while stream.clients and time.monotonic() < deadline:
            time.sleep(0.005)
        assert stream.clients == 0


def test_what_cannot_be_sent_is_told(stream):
    for bad in (
        lambda: stream.send_pose("tip", (0.0, float("nan"), 0.0), (1.0, 0.0, 0.0, 0.0)),
        lambda: stream.send_pose("tip", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        lambda: stream.send_pose("n" * 21, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
        lambda: stream.send_shape("shape", np.zeros((1, 3))),
        lambda: stream.send_transform("T", np.eye(3)),
    ):
        with pytest.raises(InvalidInput):
            bad()
    with pytest.raises(DeviceError, match="cannot listen") as told:
        SlicerStream(port=stream.port)
    assert "\n" not in str(told.value)
    stream.close()
    with pytest.raises(DeviceError, match="closed"):
        stream.send_pose("tip", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
