"""The pages of a served session: one steers, the others watch, and everything that ends a connection stops it."""

import contextlib
import json
import socket
import time

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from navigate.pretend import LENGTH, PretendSession
from navigate.served import served
from tendonrod.navigate.hub import FAULTS, PER_SECOND
from tendonrod.navigate.messages import LARGEST, SERVER
from tendonrod.navigate.server import listening


@pytest.fixture
def server(tmp_path):
    with served(PretendSession(), tmp_path) as found:
        yield found


def insertion(server) -> float:
    return server.session.snapshot.insertion


def test_the_operator_moves_and_what_it_sees_is_what_is(server):
    page = server.connect()
    page.take()
    page.hold_for(0.3, insertion=1.0)
    page.jog(hold=False)
    state = page.settled()
    assert state["insertion"] == pytest.approx(insertion(server), abs=1e-6)
    assert 0.0 < insertion(server) * LENGTH <= 0.45 * 3e-3
    for message in page.found:
        SERVER.validate_json(json.dumps(message))


def test_who_watches_cannot_steer(server):
    first, second = server.connect(), server.connect()
    second.jog(insertion=1.0)
    assert "nobody has control" in second.wait("error")["text"]
    first.take()
    second.send("take")
    assert f"{first.name} has control" in second.wait("error")["text"]
    for command in ({"type": "reset"}, {"type": "coupling", "on": False}, {"type": "record", "on": False}):
        second.send(**{"kind": command.pop("type"), **command})
        assert "has control" in second.wait("error")["text"]
    second.hold_for(0.2, insertion=1.0)
    second.settled()
    assert insertion(server) == 0.0
    assert not server.session.moved


def test_control_is_released_and_taken(server):
    first, second = server.connect(), server.connect()
    first.take()
    first.send("release")
    assert second.wait("control", lambda each: each["operator"] is None)["watchers"] == 2
    second.take()
    second.hold_for(0.1, rotation=1.0)
    second.settled()
    assert server.session.snapshot.rotation > 0.0


def test_an_older_command_after_a_newer_one_is_dropped(server):
    page = server.connect()
    page.take()
    page.seq = 10
    page.jog(hold=False)
    page.seq = 5
    page.jog(insertion=1.0)
    page.settled()
    assert not server.session.moved


BAD = [
    "", "nonsense", "[]", "null", "1", '{"type":"jog"}', '{"type":"fly"}', '{"type":"take","extra":1}',
    '{"type":"jog","seq":1,"insertion":NaN,"rotation":0,"tension":0,"hold":true}',
    '{"type":"jog","seq":1,"insertion":1e999,"rotation":0,"tension":0,"hold":true}',
    '{"type":"jog","seq":1,"insertion":1.01,"rotation":0,"tension":0,"hold":true}',
    '{"type":"jog","seq":1,"insertion":"1","rotation":0,"tension":0,"hold":true}',
    '{"type":"jog","seq":1,"insertion":true,"rotation":0,"tension":0,"hold":true}',
    '{"type":"jog","seq":1,"insertion":1,"rotation":0,"tension":0,"hold":1}',
    '{"type":"jog","seq":-1,"insertion":1,"rotation":0,"tension":0,"hold":true}',
    '{"type":"jog","seq":1.5,"insertion":1,"rotation":0,"tension":0,"hold":true}',
    '{"type":"rates","insertion":1.0,"rotation":1.0,"tension":0.1}',
    '{"type":"replay","name":"../../etc/passwd"}', '{"type":"replay","name":"missing.jsonl"}',
    '{"type":"place","tube":{"height":99}}', '{"type":"place","tube":{"tilt":1.57}}',
    "[" * 1000, '{"type":"ping","id":1}' + " " * LARGEST,
]  # fmt: skip


def test_what_is_not_understood_is_refused_in_a_sentence_and_moves_nothing(server):
    before = server.session.snapshot
    for text in BAD:
        page = server.connect()
        page.take()
        page.socket.send(text)
        told = page.wait("error")["text"]
        assert told, text
        assert "\n" not in told
        page.send("release")
        page.wait("control", lambda each: not each["you"])
    assert not server.session.moved
    assert server.session.snapshot.posture == before.posture
    assert server.session.snapshot.tube == before.tube


def test_a_state_does_not_wait_for_an_answer_to_the_one_before():
    """Nagle's algorithm would hold back every second one from a page that sends commands, for up to 40 ms."""
    with listening("127.0.0.1", 0) as at, socket.create_connection(at.getsockname()):
        connection, _ = at.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_bytes_are_refused(server):
    page = server.connect()
    page.socket.send(b'{"type":"take"}')
    assert "bytes" in page.wait("error")["text"]


@pytest.mark.parametrize(("text", "count"), [("nonsense", 3 * int(FAULTS)), ('{"type":"ping","id":1}', 2000)])
def test_who_goes_on_and_on_is_sent_away_and_the_others_stay(server, text, count):
    other, page = server.connect(), server.connect()
    with contextlib.suppress(ConnectionClosed):
        for _ in range(count):
            page.socket.send(text)
    closed = page.read_to_the_end()
    assert closed.rcvd is None or closed.rcvd.code in (1008, 1013)
    other.take()


def test_who_jogs_without_control_is_told_and_not_sent_away(server):
    page = server.connect()
    for _ in range(3 * int(FAULTS)):
        page.jog(insertion=1.0)
    page.settled()
    assert sum(each["type"] == "error" for each in page.found) == 3 * int(FAULTS)
    page.take()


def test_a_page_at_its_normal_rate_is_not_sent_away(server):
    """Keys and gamepad send 30 commands a second, and a ping now and then."""
    assert PER_SECOND >= 2 * 31.0


def test_a_huge_message_ends_the_connection_only(server):
    other, page = server.connect(), server.connect()
    with contextlib.suppress(ConnectionClosed):
        page.socket.send("x" * 2_000_000)
    page.read_to_the_end()
    other.settled()


def test_a_client_that_does_not_read_holds_nobody_up(server):
    slow, page = server.connect(max_queue=1), server.connect()
    page.take()
    page.hold_for(1.0, rotation=1.0)
    page.jog(hold=False)
    assert page.settled()["rotation"] == pytest.approx(server.session.snapshot.rotation, abs=1e-5)
    slow.socket.close()


def test_the_tube_is_placed_retracted_only_and_what_is_left_out_stays(server):
    page = server.connect()
    page.take()
    page.send("place", tube={"tilt": 0.3})
    page.wait("event", lambda each: "placed" in each["text"])
    assert page.wait("state", lambda each: each["tube"]["tilt"] == 0.3)["tube"]["depth"] == 4.9e-3
    page.hold_for(0.1, insertion=1.0)
    page.settled()
    page.send("place", tube={"tilt": 0.1})
    assert "0 while the outer tube is placed" in page.wait("error")["text"]
    page.send("reset")
    page.wait("event", lambda each: "reset" in each["text"])
    assert page.wait("state", lambda each: each["insertion"] == 0.0)["tube"]["tilt"] == 0.3


def test_rates_and_coupling_go_to_everybody(server):
    watcher, page = server.connect(), server.connect()
    page.take()
    page.send("rates", insertion=1e-3, rotation=0.1, tension=0.05)
    assert watcher.wait("settings")["rates"] == {"insertion": 1e-3, "rotation": 0.1, "tension": 0.05}
    page.send("coupling", on=False)
    assert watcher.wait("settings")["coupled"] is False
    page.hold_for(0.3, insertion=1.0)
    page.settled()
    assert {jog.insertion for jog, _ in server.session.moved} == {1e-3}


def test_a_target_is_told_when_it_is_reached(server):
    page = server.connect()
    page.take()
    page.send("rates", insertion=0.02, rotation=0.1, tension=0.05)
    end = time.monotonic() + 10.0
    while not server.session.snapshot.reached and time.monotonic() < end:
        page.jog(insertion=1.0)
        time.sleep(1 / 30)
    assert "lateral-left@T12" in page.wait("event", lambda each: "reached" in each["text"])["text"]
    assert page.settled()["reached"] == ["lateral-left@T12"]


def test_a_reload_finds_the_session_where_it_was(server):
    page = server.connect()
    page.take()
    page.hold_for(0.2, insertion=1.0)
    before = page.settled()
    page.socket.close()
    again = server.connect()
    assert again.wait("state")["insertion"] == before["insertion"]
    again.take()


def test_pages_of_other_origins_are_refused(server):
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1", "http://localhost.evil.example"):
        with pytest.raises(InvalidStatus) as refused:
            server.connect(origin=origin)
        assert refused.value.response.status_code == 403


def test_the_page_itself_is_let_in(server):
    server.connect(origin=server.url).take()


def test_a_name_that_only_resolves_here_is_refused(server):
    with pytest.raises(InvalidStatus):
        server.connect(additional_headers={"Host": f"rebound.example:{server.port}"})


def test_the_token_is_asked_for(tmp_path):
    with served(PretendSession(), tmp_path, token="a-secret") as server:
        for headers in ({}, {"Authorization": "Bearer wrong"}, {"Cookie": f"tendonrod_{server.port}=wrong"}):
            with pytest.raises(InvalidStatus):
                server.connect(additional_headers=headers)
        server.connect(additional_headers={"Authorization": "Bearer a-secret"}).take()
        server.connect(additional_headers={"Cookie": f"tendonrod_{server.port}=a-secret"})
