"""A fault of the bench under a session: it is told, nothing moves before it is acknowledged, and then all goes on."""

import time
from dataclasses import replace

import httpx
import pytest

from navigate import round_phantom
from navigate.benches import virtual
from navigate.pretend import PretendSession
from navigate.served import PATIENCE, served
from tendonrod import InvalidInput, TendonrodError, anatomy
from tendonrod.navigate import bench_drive, recovery
from tendonrod.navigate.bench_drive import BenchDrive
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.record import SessionRecord, digest
from tendonrod.navigate.recovery import Trouble
from tendonrod.navigate.replay import replay
from tendonrod.navigate.session import Session
from tendonrod.rig.states import FaultKind, State
from tendonrod.rig.virtual.injection import Injection

STEP, BEGUN = 0.05, 4.0  # s: of a step; of the bench's time, when the fault comes
FORWARD = Jog(insertion=1e-3)
BLIND = Injection(kind="load cell gives no number", time=BEGUN, duration=0.5)
JUMP = Injection(kind="encoder jumps", where="translation", value=3e-3, time=BEGUN, duration=0.5)
BREAK = Injection(kind="load cell jumps", value=5.0, time=BEGUN, duration=0.5)


def faulty(scenario, *injections, record=None):
    """A session that a fault has stopped, out by some millimetres with 0.2 N, and its drive."""
    drive = BenchDrive(scenario, virtual(scenario, *injections))
    session = Session(scenario, drive, record)
    for _ in range(40):
        session.step(Jog(insertion=1e-3, tension=0.1), STEP)
    for _ in range(600):
        if session.step(Jog(insertion=0.2e-3), STEP).blocked:
            break
    assert session.trouble is not None
    assert session.snapshot.exposed > 1e-3
    return session, drive


def steps(session, jog, count):
    for _ in range(count):
        session.step(jog, STEP)
    return session.snapshot


def test_a_fault_that_holds_is_acknowledged_where_the_robot_stands(scenario):
    session, drive = faulty(scenario, BLIND)
    trouble = session.trouble
    assert trouble is not None
    assert "sensor gives no number" in trouble.text
    assert "nothing moves by it" in trouble.remedy
    assert trouble.ready
    assert not trouble.homes
    stood = steps(session, FORWARD, 40)  # nothing moves before, however long it is asked for
    assert stood.blocked == trouble.text
    session.acknowledge()
    assert session.trouble is None
    still = steps(session, Jog(), 40)
    assert still.blocked == ""
    assert still.exposed == pytest.approx(stood.exposed, abs=0.05e-3)
    assert still.tension == pytest.approx(stood.tension, abs=0.02)
    assert still.tension[0] > 0.1
    assert steps(session, FORWARD, 40).exposed > stood.exposed + 0.5e-3
    assert drive._bench.interlock.state is State.RUNNING
    session.close()


def test_too_much_tension_is_let_go_and_shown_so(scenario):
    session, _ = faulty(scenario, BREAK)
    slack = steps(session, Jog(), 50)
    assert slack.tension[0] < 0.06
    trouble = session.trouble
    assert trouble is not None
    assert trouble.ready
    assert "its tendon slack" in trouble.remedy
    session.acknowledge()
    assert steps(session, Jog(), 20).tension[0] < 0.06
    assert steps(session, Jog(tension=0.1), 40).tension[0] > 0.15
    session.close()


def test_positions_that_are_lost_are_found_again_only_when_that_is_asked_for(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom())
    path = tmp_path / "record.jsonl"
    session, drive = faulty(scenario, JUMP, record=SessionRecord(path))
    steps(session, Jog(), 20)
    trouble = session.trouble
    assert trouble is not None
    assert trouble.homes
    with pytest.raises(InvalidInput, match=r"home = False: must be true: .*the robot is drawn in"):
        session.acknowledge()
    assert drive._bench.interlock.state is State.FAULT
    session.acknowledge(home=True)
    home = steps(session, Jog(), 10)
    assert (session.trouble, home.blocked) == (None, "")
    assert home.exposed < 0.2e-3
    assert abs(home.rotation) < 0.05
    assert home.tension[0] < 0.05
    out = steps(session, FORWARD, 60)
    assert out.exposed > 1e-3
    session.close()
    assert digest(list(replay(path))[-1]) == digest(out)


def test_a_fault_that_lasts_comes_back_and_moves_nothing(scenario):
    session, drive = faulty(scenario, replace(BLIND, duration=1e3))
    before = drive.posture
    session.acknowledge()
    after = steps(session, FORWARD, 20)
    assert "sensor gives no number" in after.blocked
    assert drive.posture.insertion == pytest.approx(before.insertion, abs=1e-3)
    session.close()


def test_without_a_fault_there_is_nothing_to_acknowledge(scenario):
    session = Session(scenario, BenchDrive(scenario, virtual(scenario)))
    with pytest.raises(TendonrodError, match="the bench has no fault"):
        session.acknowledge()
    session.close()
    with pytest.raises(TendonrodError, match="there is no bench"):
        Session(scenario).acknowledge()


# ---- under the page

LATER = 1.5  # s of the bench's time
SHORT = Injection(kind="load cell gives no number", time=LATER, duration=0.3)


@pytest.fixture
def steered(scenario, tmp_path):
    """A served session on a virtual bench in real time, which has a fault after a while."""
    source = virtual(scenario, SHORT, real_time=True)
    session = Session(scenario, BenchDrive(scenario, source, own_thread=True, rate=50.0))
    with served(session, tmp_path) as found:
        yield found


def holds(page, seconds):
    """Hold the key of insertion for so long."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        page.jog(insertion=1.0)
        time.sleep(1 / 30)
    page.jog(hold=False)


def test_a_fault_is_told_to_all_and_ends_by_the_operators_word(steered):
    """On a loaded machine late periods may be a second fault: then the operator acknowledges again."""
    operator, watcher = steered.connect(), steered.connect()
    operator.take()
    for page in (operator, watcher):
        fault = page.wait("state", lambda each: each["fault"] is not None and each["fault"]["ready"])["fault"]
        assert fault["text"].startswith("the bench stopped")
        assert "acknowledge" in fault["remedy"]
        texts = [each["text"] for each in page.found if each["type"] == "event" and each["severity"] == "limit"]
        assert any(text.startswith("the bench stopped") for text in texts)
    stood = steered.session.snapshot.insertion
    holds(operator, 0.4)
    assert steered.session.snapshot.insertion == pytest.approx(stood, abs=1e-3)
    watcher.send("acknowledge")
    assert "has control" in watcher.wait("error")["text"]
    assert steered.session.trouble is not None
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and steered.session.snapshot.insertion < stood + 2e-3:
        if steered.session.trouble is not None:
            operator.send("acknowledge")
            watcher.wait("event", lambda each: each["text"] == "the bench obeys again")
        holds(operator, 0.3)
    assert steered.session.snapshot.insertion > stood + 2e-3


def test_a_script_acknowledges_over_http(tmp_path):
    session = PretendSession()
    session.trouble = Trouble(text="the bench stopped: late", remedy="acknowledge", ready=True, homes=True)
    with served(session, tmp_path) as server:
        with httpx.Client(base_url=server.url) as client:
            assert client.get("/api/state").json()["fault"] == {
                "text": "the bench stopped: late", "remedy": "acknowledge", "ready": True, "homes": True
            }  # fmt: skip
            assert client.post("/api/acknowledge", json={}).status_code == 403
            key = {"X-Key": client.post("/api/take", json={"name": "script"}).json()["key"]}
            assert client.post("/api/acknowledge", json={"home": True}, headers=key).json()["fault"] is None
            session.trouble = Trouble(text="again", remedy="acknowledge", ready=True)
            assert client.post("/api/acknowledge", json={}, headers=key).status_code == 200
            assert session.acknowledged == [True, False]
            assert client.post("/api/stop", json={}).status_code == 204
        assert session.halted > 0


def test_a_word_for_a_small_fault_does_not_home_after_a_great_one(scenario):
    """The encoder jumps between the operator's word and the loop's next period."""
    session, drive = faulty(scenario, BLIND)
    drive._bench.interlock.trip(FaultKind.ENCODER_JUMP, 3e-3, 5e-4, "translation")
    before, drive._acknowledged = drive.posture, False
    drive._make_ready()
    steps(session, Jog(), 20)
    assert drive.trouble is not None
    assert drive.trouble.homes
    assert drive.posture.insertion == pytest.approx(before.insertion, abs=1e-3)
    session.close()


def test_a_word_said_twice_is_no_word_for_the_next_fault(scenario, monkeypatch):
    session, drive = faulty(scenario, BLIND)

    def made_ready(*arguments):
        drive._acknowledged = True  # as a second click, between two periods
        recovery.made_ready(*arguments)

    monkeypatch.setattr(bench_drive, "made_ready", made_ready)
    steps(session, FORWARD, 20)  # so long the cell gives no number
    session.acknowledge()
    assert session.trouble is None
    drive._bench.interlock.trip(FaultKind.ENCODER_JUMP, 3e-3, 5e-4, "translation")
    steps(session, Jog(), 5)
    drive._make_ready()
    assert drive.trouble is not None
    assert drive.trouble.homes
    session.close()


def settled(drive):
    """The trouble that can be acknowledged, once there is one."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        trouble = drive.trouble
        if trouble is not None and trouble.ready:
            return trouble
        time.sleep(0.01)
    raise AssertionError(f"nothing to acknowledge: {drive.trouble}")


def test_homing_is_told_and_ends_where_somebody_stops_it(scenario):
    jump = Injection(kind="encoder jumps", where="translation", value=3e-3, time=1.2, duration=0.2)
    drive = BenchDrive(scenario, virtual(scenario, jump, real_time=True), own_thread=True, rate=50.0)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and not (drive.trouble is not None and drive.trouble.homes):
        drive.advance(Jog(insertion=2e-3), 0.1)
        if drive.trouble is not None and drive.trouble.ready and not drive.trouble.homes:
            drive.acknowledge()  # late periods, on a machine that others use
        time.sleep(0.02)
    drive.halt()  # nothing that it would end: the fault is as it was
    assert settled(drive).homes
    drive.acknowledge(home=True)
    drive.halt()  # before the loop's next period, in which it would have begun
    time.sleep(0.3)
    waiting = drive.trouble
    assert waiting is not None
    assert (waiting.ready, waiting.homes) == (True, True)
    drive.acknowledge(home=True)
    while time.monotonic() < end and not drive._readying:
        time.sleep(0.001)
    told = drive.trouble
    drive.halt()
    assert told is None or "references" in told.text
    again = settled(drive)
    assert "emergency stop (operator)" in again.text
    assert again.homes
    drive.acknowledge(home=True)
    while time.monotonic() < end and drive.trouble is not None:
        time.sleep(0.01)
    assert drive.trouble is None
    assert drive.posture.insertion < 5e-3  # of its length; references are found to 0.1 mm
    drive.close()
