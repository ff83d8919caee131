"""`LiveShape` and `--slicer`: what Slicer is shown is where the robot is, and no picture ends a trial."""

import socket
import sys
import time
from contextlib import contextmanager, suppress
from math import pi
from threading import Event, Thread
from types import SimpleNamespace

import numpy as np
import pytest

from rig.igtl_messages import line_of, matrix_of, message
from rig.short_trials import bench_file, robot
from tendonrod import InvalidInput, solve
from tendonrod.cli import main
from tendonrod.rig.interfaces import AxisState, DeviceError, Force, PoseFrame, Sample

pytest.importorskip("pyigtl")
from tendonrod.rig.igtl import SlicerStream
from tendonrod.rig.live_shape import LiveShape

DOWN = (0.0, -9.81, 0.0)
SILENT = SimpleNamespace(clients=1)
NAN = float("nan")


def moment(translation: float, rotation: float, tension: float, frames=()):
    at = {"screw": 0.0, "translation": translation, "rotation": rotation}
    axes = {name: AxisState(time=0.0, position=x, velocity=0.0) for name, x in at.items()}
    return SimpleNamespace(sample=Sample(time=0.0, **axes, force=Force(time=0.0, tension=tension), frames=frames))


@contextmanager
def connected():
    with SlicerStream(port=0) as stream, socket.create_connection(("127.0.0.1", stream.port), timeout=10.0) as client:
        deadline = time.monotonic() + 10.0
        while not stream.clients:
            assert time.monotonic() < deadline
            time.sleep(0.005)
        yield stream, client


def test_the_shape_is_the_models_for_what_was_measured():
    """Half out, the helix has turned the motor by half a turn less; the section at the exit has not turned then."""
    body = robot()
    live = LiveShape(SILENT, body, DOWN)
    z, angle = 0.5 * body.section.L, -pi * body.turns
    found, expected = live.shape(z, angle, 0.4), solve(body, 0.4, DOWN, insertion=0.5)
    assert found.centerline[-1] == pytest.approx(expected.centerline[-1], abs=2e-5)
    straight = LiveShape(SILENT, body).shape(z, angle, -0.02)
    assert np.abs(straight.centerline[:, :2]).max() < 1e-6  # a reading below zero is a slack tendon


def test_a_turned_motor_turns_the_shape():
    """Without gravity, by the same angle about the tube's axis."""
    body = robot()
    live = LiveShape(SILENT, body)
    one, turned = (live.shape(body.section.L, angle, 0.5).centerline for angle in (0.0, 0.7))
    c, s = np.cos(0.7), np.sin(0.7)
    assert turned == pytest.approx(one @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), abs=2e-5)


def test_shape_poses_and_their_place_go_out():
    T = np.array([[0.0, -1.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.3], [0.0, 0.0, 0.0, 1.0]])
    frame = PoseFrame(time=0.0, frame=1, tool="tip", position=(0.01, 0.02, 0.03), quaternion=(1.0, 0.0, 0.0, 0.0))
    with connected() as (stream, client), LiveShape(stream, robot(), DOWN, tools=("tip",), T_world_field=T) as live:
        live.watch(moment(0.05, 0.0, 0.3, (frame,)))
        got = {name: (kind, body) for kind, name, body in (message(client) for _ in range(3))}
    assert {name: kind for name, (kind, _) in got.items()} == {
        "tipToTracker": "TRANSFORM", "TrackerToExit": "TRANSFORM", "robot": "POLYDATA",
    }  # fmt: skip
    assert matrix_of(got["TrackerToExit"][1]) == pytest.approx(T, abs=1e-7)
    assert matrix_of(got["tipToTracker"][1])[:3, 3] == pytest.approx(frame.position)
    assert line_of(got["robot"][1]) == pytest.approx(live.shape(0.05, 0.0, 0.3).centerline, abs=1e-7)


@pytest.mark.parametrize(
    "strange",
    [moment(NAN, 0.0, 0.3), moment(0.01, 0.0, NAN), moment(0.01, float("inf"), 0.3), moment(-1.0, 0.0, 0.1),
     moment(0.01, 0.0, 500.0), SimpleNamespace(sample=None)],
)  # fmt: skip
def test_nothing_strange_ends_a_trial(strange):
    """Nor does a frame that cannot be sent, or a stream that is closed."""
    frame = PoseFrame(time=0.0, frame=1, tool="tip", position=(0.0, 0.0, 0.0), quaternion=(0.0, 0.0, 0.0, 0.0))
    with connected() as (stream, client):
        live = LiveShape(stream, robot())
        live.watch(strange)
        live.watch(moment(0.01, 0.0, 0.1, (frame,)))
        live._shown = -1.0
        live.watch(moment(0.02, 0.0, 0.1))
        while message(client)[1] != "robot":  # it still shows what there is
            pass
    live.watch(moment(0.01, 0.0, 0.1))
    live.close()
    live.close()


def test_a_tool_whose_name_does_not_fit_is_told_at_once():
    with pytest.raises(InvalidInput, match="tool = 'a far too long name': must be a name of 11 bytes"):
        LiveShape(SILENT, robot(), tools=("a far too long name",))


def heard(port: int, got: dict, done) -> None:
    """Connect as soon as there is a server; the newest message of each name, until the stream ends."""
    while not done.is_set():
        with suppress(OSError, AssertionError), socket.create_connection(("127.0.0.1", port), timeout=1.0) as client:
            while True:
                kind, name, body = message(client)
                got.setdefault(name, []).append((kind, body))
        time.sleep(0.01)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return taken.getsockname()[1]


def test_the_shown_shape_ends_where_the_tracker_sees_the_tip(tmp_path):
    """`rig hold --slicer` in step with time; model and tracker agree to within friction, noise and delay."""
    port, got, done = free_port(), {}, Event()
    listener = Thread(target=heard, args=(port, got, done), daemon=True)
    listener.start()
    asked = ["rig", "hold", "--tension", "0.3", "--duration", "0.6", "--insertion", "0.08", "--real-time"]
    asked += ["--bench", str(bench_file(tmp_path)), "--output", str(tmp_path / "o"), "--slicer", str(port)]
    assert main(asked) == 0
    done.set()
    listener.join(5.0)
    newest = {name: messages[-1][1] for name, messages in got.items()}
    end = line_of(newest["robot"])[-1]
    tip = (matrix_of(newest["TrackerToExit"]) @ matrix_of(newest["tipToTracker"]))[:3, 3]
    assert end[2] == pytest.approx(0.08 * robot().length_na, rel=0.05)
    assert np.linalg.norm(end - tip) < 1.5e-3
    assert len(got["robot"]) >= 5


def test_a_port_that_is_taken_and_a_missing_library_are_told_in_one_line(monkeypatch):
    with SlicerStream(port=0) as other, pytest.raises(DeviceError, match=f"cannot listen on .*:{other.port}") as told:
        SlicerStream(port=other.port)
    assert "\n" not in str(told.value)
    monkeypatch.setitem(sys.modules, "pyigtl", None)
    with pytest.raises(DeviceError, match=r"needs pyigtl: pip install 'tendonrod\[slicer\]'"):
        SlicerStream(port=0)
