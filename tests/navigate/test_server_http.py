"""The HTTP interface: what it shows, what it asks for, what it refuses."""

import contextlib
import dataclasses
import json
import struct
import threading

import httpx
import numpy as np
import pytest

from navigate.pretend import LENGTH, PretendSession
from navigate.served import eventually, served
from tendonrod.navigate.doors import LARGEST_BODY, Door, is_loopback
from tendonrod.navigate.told import Scene, State


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(PretendSession(), tmp_path_factory.mktemp("records")) as found:
        yield found


@pytest.fixture
def web(server):
    with httpx.Client(base_url=server.url, timeout=20.0) as client:
        yield client


@pytest.fixture
def script(web):
    """A client that has control of the session, as it was at its beginning."""
    seated = web.post("/api/take", json={"name": "test"}).json()
    web.headers["X-Key"] = seated["key"]
    assert web.post("/api/reset", json={}).status_code == 200
    yield web
    web.post("/api/release", json={})


def test_scene_and_state_are_what_the_schema_says(web):
    Scene.model_validate_json(web.get("/api/scene").content)
    State.model_validate_json(web.get("/api/state").content)


def test_a_mesh_comes_as_the_triangles_that_it_is(server, web):
    content = web.get("/api/meshes/cord.stl").content
    vertices, faces = server.session.scenario.phantom.structures["cord"].mesh
    assert struct.unpack("<I", content[80:84]) == (len(faces),)
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows = np.frombuffer(content[84:], kind)
    np.testing.assert_allclose(rows["corners"], vertices[faces], atol=1e-8)
    outward = np.einsum("ij,ij->i", rows["normal"], rows["corners"].mean(axis=1) - vertices.mean(axis=0))
    assert (outward > 0.0).all()
    assert web.get("/api/meshes/none.stl").status_code == 404


def test_a_script_moves_as_far_as_it_asks(server, script):
    state = script.post("/api/step", json={"insertion": 1.0, "duration": 0.4}).json()
    assert (state["seconds_done"], state["ended_early"]) == (0.4, None)
    assert state["insertion"] * LENGTH == pytest.approx(0.4 * 3e-3, rel=1e-6)
    assert server.session.snapshot.insertion == pytest.approx(state["insertion"], abs=1e-6)


def test_a_script_that_goes_on_does_not_outdo_a_stop(server, script):
    moved = len(server.session.moved)
    httpx.post(f"{server.url}/api/stop", json={})
    refused = script.post("/api/step", json={"insertion": 1.0, "duration": 0.1})
    assert refused.status_code == 403
    assert "take it first" in refused.json()["detail"]
    assert len(server.session.moved) == moved


def test_a_script_that_stops_itself_keeps_control(server, script):
    assert script.post("/api/stop", json={}).status_code == 204
    assert script.post("/api/step", json={"insertion": 1.0, "duration": 0.05}).status_code == 200


def test_a_step_that_is_being_made_does_not_outlive_the_end_of_the_server(tmp_path):
    with served(PretendSession(), tmp_path) as server, httpx.Client(base_url=server.url, timeout=20.0) as web:

        def end():
            eventually(lambda: bool(server.session.moved))
            server.ending.end()

        key = web.post("/api/take", json={}).json()["key"]
        threading.Thread(target=end).start()
        with contextlib.suppress(httpx.HTTPError):
            web.post("/api/step", json={"insertion": 0.1, "duration": 10.0}, headers={"X-Key": key})
        server.thread.join(10.0)
        assert sum(dt for _, dt in server.session.moved) < 1.0  # uvicorn would wait 2 s for the open request


def test_a_record_that_somebody_deleted_is_missing_and_no_failure(tmp_path):
    with served(PretendSession(), tmp_path) as server:
        server.service.record.unlink()
        assert httpx.get(f"{server.url}/api/record").status_code == 404


def test_a_step_ends_where_somebody_stops_it(server, script):
    def stop():
        eventually(lambda: bool(server.session.moved))
        httpx.post(f"{server.url}/api/stop", json={})

    server.session.steps.clear()
    threading.Thread(target=stop).start()
    state = script.post("/api/step", json={"insertion": 1.0, "duration": 5.0}).json()
    assert state["ended_early"] == "stopped by a script"
    assert 0.0 < state["seconds_done"] < 5.0
    assert state["insertion"] * LENGTH == pytest.approx(state["seconds_done"] * 3e-3, rel=1e-4)


def test_a_server_that_was_too_busy_for_a_sign_of_life_stands_still_then_goes_on(server, script):
    switch, lapses = server.service.pilot.dead_man, []

    def late():
        eventually(lambda: bool(server.session.moved))
        with switch._lock:  # as if nobody had come for a while
            switch._held = switch._held and dataclasses.replace(switch._held, at=switch._held.at - 1.0)
        lapses.append(1)

    server.session.steps.clear()
    threading.Thread(target=late).start()
    state = script.post("/api/step", json={"insertion": 1.0, "duration": 0.5}).json()
    assert lapses
    assert (state["seconds_done"], state["ended_early"]) == (0.5, None)
    assert state["insertion"] * LENGTH == pytest.approx(0.5 * 3e-3, rel=1e-6)


def test_what_needs_no_words_takes_no_body(server, script):
    for path, status in (("reset", 200), ("replay/stop", 204), ("stop", 204), ("release", 204)):
        assert script.post(f"/api/{path}").status_code == status, path


def test_the_answer_to_a_change_is_the_state_after_it(script):
    for k in range(20):
        height = 0.02 + 1e-3 * k
        assert script.post("/api/place", json={"height": height}).json()["tube"]["height"] == pytest.approx(height)


def test_a_script_needs_no_name(web, script):
    web.post("/api/release", headers=dict(script.headers)).raise_for_status()
    answer = web.post("/api/take")
    assert answer.json()["operator"].startswith("script-")
    web.post("/api/release", headers={"X-Key": answer.json()["key"]}).raise_for_status()


def test_rates_are_changed_one_by_one(server, script):
    before = script.post("/api/rates", json={}).json()["rates"]
    found = script.post("/api/rates", json={"rotation": 0.25}).json()["rates"]
    assert found == before | {"rotation": 0.25}
    assert script.post("/api/rates", json=before).json()["rates"] == before
    assert script.post("/api/rates", json={"speed": 1.0}).status_code == 422


def test_a_step_ends_with_its_connection(server, script):
    with pytest.raises(httpx.ReadTimeout):
        script.post("/api/step", json={"insertion": 1.0, "duration": 10.0}, timeout=0.3)
    assert eventually(lambda: not server.service.pilot.dead_man.is_held)
    assert server.session.snapshot.insertion * LENGTH < 8.0 * 3e-3


def test_nothing_is_changed_without_control(server, web):
    before = server.session.snapshot
    paths = ("step", "place", "reset", "rates", "coupling", "recording", "replay", "replay/set", "replay/stop")
    paths += ("release",)
    bodies = ({"duration": 1.0, "insertion": 1.0}, {}, {}, {"insertion": 1e-3, "rotation": 1.0, "tension": 0.1})
    bodies += ({"on": False}, {"on": False}, {"name": "x.jsonl"}, {"paused": True}, {}, {})
    for path, body in zip(paths, bodies, strict=True):
        for headers in ({}, {"X-Key": "wrong"}):
            answer = web.post(f"/api/{path}", json=body, headers=headers)
            assert answer.status_code == 403, path
            assert "control" in answer.json()["detail"]
    assert server.session.snapshot.posture == before.posture


def test_one_script_at_a_time(script, server):
    other = httpx.post(f"{server.url}/api/take", json={"name": "other"})
    assert other.status_code == 403
    assert "has control" in other.json()["detail"]
    assert script.get("/api/control").json()["operator"].startswith("test-")


def test_the_key_of_one_who_left_opens_nothing(script):
    assert script.post("/api/release", json={}).status_code == 204
    assert script.post("/api/reset", json={}).status_code == 403


@pytest.mark.parametrize(
    ("path", "body", "named"),
    [
        ("step", {"duration": 11.0}, "duration"),
        ("step", {"duration": 1.0, "insertion": 2.0}, "insertion"),
        ("step", {"duration": 1.0, "speed": 2.0}, "speed"),
        ("step", {"duration": "1"}, "duration"),
        ("place", {"depth": 0.9}, "depth"),
        ("place", {"tilt": 1.57}, "tilt"),
        ("rates", {"insertion": 1.0, "rotation": 1.0, "tension": 0.1}, "insertion"),
        ("replay", {"name": "../secret"}, "name"),
    ],
)
def test_a_value_outside_is_refused_by_name_in_one_line(script, path, body, named):
    answer = script.post(f"/api/{path}", json=body)
    assert answer.status_code == 422
    assert named in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]


@pytest.mark.parametrize(
    "text", ["NaN", "[NaN]", '{"duration": NaN}', '{"duration": 1e999}', "{", "[" * 5000, '"\\ud800"']
)
def test_malformed_json_is_refused(script, text):
    answer = script.post("/api/step", content=text, headers={"Content-Type": "application/json"})
    assert answer.status_code in (400, 422)
    assert answer.json()["detail"]


def test_forms_of_other_pages_are_no_json(script):
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
        answer = script.post("/api/stop", content="{}", headers={"Content-Type": kind})
        assert answer.status_code == 415


def test_large_bodies_are_refused(script):
    big = json.dumps({"name": "x" * LARGEST_BODY})
    assert script.post("/api/take", content=big, headers={"Content-Type": "application/json"}).status_code == 413


@pytest.mark.parametrize("odd", ["/;script-src *", "?x", "#x", ";x", ",x", "\\x"])
def test_nothing_of_a_strange_host_gets_into_the_policy(odd):
    door = Door(port=8420)
    scope = {"type": "http", "method": "GET", "path": "/", "headers": [(b"host", f"localhost:8420{odd}".encode())]}
    refused = door.refusal(scope)
    assert refused is not None
    assert refused[0] == 400
    assert dict(door.headers(scope))[b"content-security-policy"] == b"default-src 'none'"


def test_origin_host_and_fetch_site_are_checked(web, server):
    assert web.post("/api/stop", json={}, headers={"Origin": server.url}).status_code == 204
    for headers in ({"Origin": "http://evil.example"}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"}):
        assert web.post("/api/stop", json={}, headers=headers).status_code == 403
    assert web.get("/api/state", headers={"Sec-Fetch-Site": "cross-site"}).status_code == 403
    for host in (
        "evil.example",
        f"evil.example:{server.port}",
        "127.0.0.1",
        "",
        "127.0.0.1:x",
        f"a@127.0.0.1:{server.port}",
    ):
        assert web.get("/api/state", headers={"Host": host}).status_code == 400


def test_every_answer_keeps_the_page_to_this_server(web):
    for path in ("/", "/api/state", "/api/nothing", "/static/nothing"):
        policy = web.get(path).headers["Content-Security-Policy"]
        assert "default-src 'self'" in policy
        assert "http:" not in policy
        assert "unsafe" not in policy


def test_the_page_is_served(web):
    answer = web.get("/")
    assert answer.status_code == 200
    assert "text/html" in answer.headers["Content-Type"]


def test_static_files_do_not_lead_out_of_their_folder(web):
    for path in ("../server.py", "..%2fserver.py", "%2e%2e/server.py", "....//server.py"):
        assert web.get(f"/static/{path}").status_code == 404


def test_the_interface_is_described_with_units(web):
    described = web.get("/api/openapi.json").json()
    assert set(described["paths"]) >= {
        f"/api/{name}" for name in ("scene", "state", "step", "place", "reset", "records")
    }
    step = described["components"]["schemas"]["Step"]["properties"]
    assert step["duration"]["description"] == "s"
    for path in described["paths"].values():
        for operation in path.values():
            assert operation["summary"]


def test_a_record_is_listed_downloaded_ended_and_begun(script, server):
    first = script.get("/api/records").json()
    assert first[0]["name"] == server.service.record.name
    assert script.get("/api/record").content == server.service.record.read_bytes()
    assert script.get("/api/record", params={"name": first[0]["name"]}).status_code == 200
    for name in ("../x", "none.jsonl", "/etc/passwd", "a" * 99):
        assert script.get("/api/record", params={"name": name}).status_code in (404, 422)
    assert script.post("/api/replay", json={"name": "none.jsonl"}).status_code == 404
    assert script.post("/api/recording", json={"on": True}).status_code == 403
    assert script.post("/api/recording", json={"on": False}).json()["recording"] is None
    assert script.get("/api/record").status_code == 404
    again = script.post("/api/recording", json={"on": True}).json()["recording"]
    assert again not in [each["name"] for each in first]


def test_a_token_is_made_where_others_can_reach_the_server_and_nowhere_else():
    for host in ("127.0.0.1", "localhost", "::1", "127.0.0.2"):
        assert is_loopback(host)
        assert Door.at(host, 80).token is None
    tokens = {Door.at(host, 80).token for host in ("0.0.0.0", "::", "192.168.1.5", "bench.local")}
    assert len(tokens) == 4
    assert all(len(token) >= 32 for token in tokens)


def test_the_token_opens_by_address_cookie_or_header_and_the_cookie_is_strict():
    with served(PretendSession(), None, token="a-secret") as server, httpx.Client(base_url=server.url) as web:
        assert web.get("/api/state").status_code == 401
        assert web.get("/api/state", params={"token": "wrong"}).status_code == 401
        assert web.get("/api/state", params={"token": "ä"}).status_code == 401
        opened = web.get("/api/state", params={"token": "a-secret"})
        assert opened.status_code == 200
        assert "HttpOnly; SameSite=Strict" in opened.headers["Set-Cookie"]
        assert web.get("/api/state").status_code == 200
        other = httpx.get(f"{server.url}/api/state", headers={"Authorization": "Bearer a-secret"})
        assert other.status_code == 200
        assert httpx.get(f"{server.url}/static/app.js").status_code == 401
