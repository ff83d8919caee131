"""Whatever stops the robot of a served session, and that it stays stopped: pages, watchers, defects, the end."""

import contextlib
import socket
import threading
import time

import pytest
from websockets.exceptions import ConnectionClosed

from navigate.pretend import LENGTH, PretendSession
from navigate.served import eventually, served
from tendonrod.navigate import hub
from tendonrod.navigate.recovery import Trouble
from tendonrod.navigate.service import Refused, Service


@pytest.fixture
def server(tmp_path):
    with served(PretendSession(), tmp_path) as found:
        yield found


def test_silence_stops(server):
    page = server.connect()
    page.take()
    page.jog(insertion=1.0)
    assert "150 ms" in page.wait("event", lambda each: "stopped" in each["text"])["text"]
    page.settled()
    assert sum(dt for _, dt in server.session.moved) <= 0.15


@pytest.mark.parametrize("end", ["close", "drop", "stop", "let go", "refused"])
def test_everything_else_stops_too(server, end):
    watcher, page = server.connect(), server.connect()
    page.take()
    page.hold_for(0.1, insertion=1.0)
    page.jog(insertion=1.0)
    if end == "close":
        page.socket.close()
    elif end == "drop":
        page.socket.socket.shutdown(socket.SHUT_RDWR)
    elif end == "stop":
        watcher.send("stop")
    elif end == "let go":
        page.jog(insertion=1.0, hold=False)
    else:
        page.socket.send("{nonsense")
    state = watcher.wait("state", lambda each: each["insertion"] > 0.0 and not each["moving"])
    moved = len(server.session.moved)
    assert eventually(lambda: end not in ("close", "drop") or server.service.seat.holder is None)
    watcher.settled()
    assert len(server.session.moved) == moved
    assert state["insertion"] * LENGTH <= 0.3 * 3e-3


def test_a_stop_by_somebody_else_holds_though_the_key_stays_down(server):
    watcher, page = server.connect(), server.connect()
    page.take()
    page.hold_for(0.2, insertion=1.0)
    watcher.send("stop")
    page.wait("control", lambda each: not each["you"])
    moved = len(server.session.moved)
    page.hold_for(0.4, insertion=1.0)
    assert "nobody has control" in page.wait("error")["text"]
    assert len(server.session.moved) == moved
    page.take()


def homing():
    """A service at rest whose session can be acknowledged, steered by "page"; its pilot runs by `tick` alone."""
    session = PretendSession()
    session.trouble = Trouble(text="the bench stopped", remedy="acknowledge and home", ready=True, homes=True)
    service = Service(session)
    service.take("page")
    return session, service


def test_what_waits_for_a_step_to_end_is_dropped_by_a_stop():
    session, service = homing()
    waiting = [service.acknowledge("page", True), service.reset("page")]
    service.stopped_by("watcher")
    service.pilot.tick()
    for each in waiting:
        with pytest.raises(Refused, match="stopped before"):
            each.result(0)
    assert session.acknowledged == []


def test_a_stop_while_a_homing_is_begun_comes_after_it(monkeypatch):
    session, service = homing()
    real, order = session.acknowledge, []

    def acknowledge(home):
        service.stopped_by("watcher")
        order.append("home")
        real(home)

    monkeypatch.setattr(session, "acknowledge", acknowledge)
    monkeypatch.setattr(session, "halt", lambda: order.append("halt"))
    service.acknowledge("page", True)
    service.pilot.tick()
    assert order == ["halt", "home", "halt"]


@pytest.mark.parametrize("what", ["stop", "reset", "coupling", "nonsense"])
def test_what_is_held_through_a_stop_or_a_change_must_be_let_go_first(server, what, monkeypatch):
    monkeypatch.setattr(hub, "DEADLINE", 60.0)  # on a loaded machine this page may fall silent, which is letting go
    page = server.connect()
    page.take()
    page.hold_for(0.2, rotation=1.0)
    if what == "nonsense":
        page.socket.send(what)
    else:
        page.send(what, **({"on": False} if what == "coupling" else {}))
    page.jog(rotation=1.0)
    page.send("ping", id=1)
    page.wait("pong")
    time.sleep(0.05)  # a step that had begun
    moved = len(server.session.moved)
    page.hold_for(0.4, rotation=1.0)
    assert len(server.session.moved) == moved
    page.jog(hold=False)
    page.hold_for(0.2, rotation=1.0)
    assert len(server.session.moved) > moved


def test_a_defect_in_a_step_stops_the_robot_and_not_the_server(server, caplog):
    page = server.connect()
    page.take()
    server.session.fail = True
    page.jog(insertion=1.0)
    assert "failed inside the program" in page.wait("event", lambda each: each["severity"] == "limit")["text"]
    server.session.fail = False
    page.hold_for(0.2, insertion=1.0)
    assert page.settled()["insertion"] > 0.0
    assert "ZeroDivisionError" in caplog.text


def test_nothing_moves_once_the_end_of_the_server_is_asked_for(tmp_path):
    with served(PretendSession(), tmp_path) as server:
        page = server.connect()
        page.take()
        page.hold_for(0.2, insertion=1.0)
        server.ending.end()
        assert eventually(lambda: server.service.is_ending)
        moved = len(server.session.moved) + 1  # a step that had begun
        with contextlib.suppress(ConnectionClosed):
            page.hold_for(0.5, insertion=1.0)
        assert len(server.session.moved) <= moved


def test_the_end_of_the_server_closes_the_session_and_its_pages(tmp_path):
    session = PretendSession()
    with served(session, tmp_path) as server:
        page = server.connect()
        page.take()
        page.jog(insertion=1.0)
    assert session.closed
    page.read_to_the_end()


def test_opening_a_record_silences_nobody(server, monkeypatch):
    """Its phantom may take seconds to build; a page takes silence for a lost connection and gives control up."""
    go_on = threading.Event()

    def slow(path):
        go_on.wait(10.0)
        yield server.session.snapshot

    monkeypatch.setattr("tendonrod.navigate.replay.replay", slow)
    page = server.connect()
    page.take()
    page.send("replay", name=server.service.record.name)
    assert eventually(lambda: server.service._is_opening)
    count = server.session.snapshot.index
    assert eventually(lambda: server.session.snapshot.index > count + 3)  # the session goes on meanwhile
    go_on.set()
    page.wait("event", lambda each: "is shown" in each["text"])
    page.wait("state", lambda each: each["mode"] == "replay" and each["replay"]["paused"])
    page.send("replay_stop")
    page.wait("state", lambda each: each["mode"] == "live")
