"""`tendonrod navigate` as a process of its own: its addresses, its end, and what is left when it is killed."""

import json
import math
import re
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager

import httpx
import pytest
from websockets.sync.client import connect

from navigate.served import Page, served
from tendonrod.navigate.addresses import own_addresses
from tendonrod.navigate.replay import replay
from tendonrod.navigate.scenario import load_scenario
from tendonrod.navigate.session import Session
from tendonrod.robot import load_robot


@contextmanager
def navigating(folder, *options):
    """The process and its address."""
    command = [sys.executable, "-m", "tendonrod", "navigate", "--no-browser", "--port", "0", "--output", str(folder)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen([*command, *options], **pipes) as process:
        try:
            first = re.fullmatch(r"open (\S+)\n", process.stdout.readline())  # an installation's first start compiles
            assert first is not None
            yield process, first[1]
        finally:
            process.kill()


@contextmanager
def steered(url):
    """A page that has moved the robot for a second and holds it moving."""
    with connect(url.replace("http", "ws") + "ws", max_queue=None, close_timeout=0.2) as found:
        page = Page(found)
        page.take()
        page.hold_for(1.0, insertion=1.0, tension=0.5)
        yield page, page.wait("state", lambda each: each["insertion"] > 0.0)


@pytest.mark.slow
def test_a_killed_server_leaves_a_record_that_replays(tmp_path):
    with navigating(tmp_path) as (process, url), steered(url) as (page, seen):
        page.jog(insertion=1.0)
        page.wait("state", lambda each: each["time"] >= seen["time"] + 0.1)
        process.kill()
        page.read_to_the_end()
    (record,) = tmp_path.glob("*.jsonl")
    again = {round(each.time, 6): each.insertion for each in replay(record)}  # as messages say it
    told = {each["time"]: each["insertion"] for each in page.found if each["type"] == "state"}
    both = again.keys() & told.keys()
    assert max(both) >= max(told) - 0.3
    assert all(again[time] == pytest.approx(told[time], abs=1e-6) for time in both)
    last = list(again.values())[-1]
    assert last > 0.0
    with served(Session(load_scenario()), tmp_path) as server:
        shown_again(server, record.name, last)


def shown_again(server, name, last):
    """Another server shows the record to its pages, and nothing can be moved meanwhile."""
    page = server.connect()
    page.take()
    page.send("replay", name=name, speed=4.0)
    page.wait("state", lambda each: each["mode"] == "replay")
    page.jog(insertion=1.0)
    assert "end the replay" in page.wait("error")["text"]
    page.wait("state", lambda each: each["mode"] == "replay" and each["insertion"] > 0.9 * last)
    page.send("replay_stop")
    page.wait("state", lambda each: each["mode"] == "live" and each["insertion"] == 0.0)


def test_an_interrupt_ends_it_cleanly_and_the_record_is_named(tmp_path):
    with navigating(tmp_path) as (process, url), steered(url):
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30.0)
    (record,) = tmp_path.glob("*.jsonl")
    assert process.returncode == 0
    assert told.splitlines()[-1] == f"tendonrod: ended; the session is in {record}"
    assert f"tendonrod: the session is recorded in {record}; Ctrl-C here ends it" in told.splitlines()
    assert "Traceback" not in told
    assert json.loads(record.read_text().splitlines()[-1]) == {"event": "end"}
    assert list(replay(record))[-1].insertion > 0.0


def test_beyond_this_machine_a_token_is_asked_for_and_a_termination_is_clean_too(tmp_path):
    with navigating(tmp_path, "--host", "0.0.0.0") as (process, url):
        assert "?token=" in url
        for own in own_addresses():
            elsewhere = url.replace("127.0.0.1", own)
            assert f"from another machine {elsewhere}\n" == process.stdout.readline()
            assert httpx.get(elsewhere).status_code == 200
        assert httpx.get(url).status_code == 200
        assert httpx.get(url.partition("?")[0]).status_code == 401
        process.terminate()
        _, told = process.communicate(timeout=30.0)
    assert process.returncode == 0
    assert "ended; the session is in" in told


def test_a_taken_port_is_named(refused, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        said = refused("navigate", "--port", port, "--no-browser", "--output", tmp_path)
    assert f"--port = {port}" in said
    assert "free" in said


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--port", "http"], "--port"),
        (["--port", "70000"], "--port"),
        (["--host", "192.0.2.1"], "--host"),
        (["--host", "nonsense.invalid"], "--host = nonsense.invalid: must be an address of this machine"),
        (["--host", "192.0.2.1"], "it is not one of this machine's"),
        (["--host", ""], "--host = '': must be an address of this machine"),
        (["--script", "moves.csv"], "--script"),
        (["--headless"], "--headless"),
        (["--json"], "--json"),
        (["--script", "missing.csv", "--headless"], "missing.csv"),
        (["--phantom", "mermaid"], "mermaid"),
        (["--robot", "mermaid"], "mermaid"),
    ],
)
def test_bad_options_are_named_in_one_line(refused, tmp_path, options, named):
    assert named in refused(
        "navigate", *options, "--output", tmp_path, *([] if "--port" in options else ["--port", "0"])
    )


SCRIPT = "duration_s,insertion_mm_per_s,rotation_deg_per_s,tension_n_per_s\n1,3,0,0.1\n0.5,0,10,0\n"


def test_a_script_without_a_page_gives_metrics_a_record_and_no_web_import(tmp_path):
    script = tmp_path / "moves.csv"
    script.write_text(SCRIPT)
    program = (
        "import sys, tendonrod.cli\n"
        f"status = tendonrod.cli.main(['navigate', '--script', {str(script)!r}, '--headless', '--json', "
        f"'--output', {str(tmp_path)!r}])\n"
        "assert not {'fastapi', 'uvicorn', 'starlette', 'websockets'} & set(sys.modules)\n"
        "sys.exit(status)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    said = json.loads(done.stdout)
    assert said["duration"] == pytest.approx(1.5, rel=1e-9)
    (record,) = tmp_path.glob("*.jsonl")
    assert json.loads(record.with_suffix(".json").read_text()) == said
    last = list(replay(record))[-1]
    assert last.insertion == pytest.approx(3e-3 / load_robot("exonav-1").section.L, rel=1e-9)
    assert last.rotation == pytest.approx(math.radians(5.0), rel=1e-9)
