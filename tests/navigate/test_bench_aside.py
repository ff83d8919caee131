"""A bench in a process of its own: it follows, stands when nothing is said, recovers, and outlives who steers it."""

import json
import signal
import subprocess
import threading
import time
from dataclasses import replace

import pytest

from navigate.benches import start, virtual
from tendonrod import InvalidInput
from tendonrod.errors import TendonrodError
from tendonrod.navigate.bench_aside import PROGRAM, BenchAside
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.session import Session
from tendonrod.rig.virtual.injection import Injection
from tendonrod.rig.virtual.setup import VirtualSetup

PATIENCE, STEP = 30.0, 0.02  # s
RATE = 50.0  # per second: a machine that others use is late less often
BLIND = Injection(kind="load cell gives no number", time=1.0, duration=0.3)


def until(session, jog, reached):
    """Step in real time until ``reached()``; faults, as on a busy machine, are acknowledged."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        session.step(jog, STEP)
        time.sleep(STEP)
        if reached():
            return session.snapshot
        if session.trouble is not None and session.trouble.ready:
            session.acknowledge()
    raise AssertionError(f"not reached: {session.snapshot}, {session.trouble}")


def test_it_is_steered_stands_and_ends_slack(scenario):
    drive = BenchAside(scenario, virtual(scenario, real_time=True), rate=RATE)
    session = Session(scenario, drive)
    assert drive.fastest.insertion > 0.0
    until(session, Jog(insertion=2e-3, tension=0.3), lambda: session.snapshot.exposed > 1e-3)
    time.sleep(0.4)  # nobody says anything
    before = drive.posture.insertion
    time.sleep(0.4)
    assert drive.posture.insertion == pytest.approx(before, abs=1e-3)
    session.close()
    assert drive._process.returncode == 0
    assert "has ended" in drive.fault


def test_a_fault_there_is_told_here_and_acknowledged_and_so_is_its_end(scenario):
    drive = BenchAside(scenario, virtual(scenario, BLIND, real_time=True), rate=RATE)
    with pytest.raises(TendonrodError, match="no fault"):
        drive.acknowledge()
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and (drive.trouble is None or not drive.trouble.ready):
        time.sleep(STEP)
    assert drive.fault.startswith("the bench stopped: ")
    session = Session(scenario, drive)
    until(session, Jog(insertion=2e-3), lambda: session.snapshot.exposed > 1e-3)
    drive._process.kill()
    drive._process.wait()
    assert "process has ended, status -9" in session.step(Jog(insertion=1e-3), STEP).blocked
    session.close()


def test_a_process_that_says_nothing_is_told(scenario):
    drive = BenchAside(scenario, virtual(scenario, real_time=True), rate=RATE)
    drive._process.send_signal(signal.SIGSTOP)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and "says nothing" not in drive.fault:
        time.sleep(STEP)
    trouble = drive.trouble
    steered = threading.Thread(target=lambda: [drive.advance(Jog(insertion=1e-3), STEP) for _ in range(5000)])
    steered.start()  # what it is told fills no pipe, which would hold up the session
    steered.join(PATIENCE)
    assert not steered.is_alive()
    drive._process.send_signal(signal.SIGCONT)
    assert trouble is not None
    assert not trouble.ready
    while time.monotonic() < end and "says nothing" in drive.fault:
        time.sleep(STEP)
    assert "says nothing" not in drive.fault
    drive.close()
    assert drive._process.returncode == 0


def test_a_bench_that_does_not_open_is_one_error_here(scenario):
    wrong = replace(virtual(scenario), setup=VirtualSetup(robot=scenario.robot.replace(torsion="published")))
    with pytest.raises(InvalidInput, match="torsion published"):
        BenchAside(scenario, wrong)
    with pytest.raises(TendonrodError, match="rate"):
        BenchAside(scenario, virtual(scenario, real_time=True), rate=-1.0)


def states(process):
    for line in process.stdout:
        yield json.loads(line)


def test_the_tendon_is_let_go_when_the_session_is_killed(scenario):
    """All that the killed process leaves is the end of standard input."""
    with subprocess.Popen(PROGRAM, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        process.stdin.write(start(scenario, virtual(scenario, real_time=True), RATE))
        taut = {}
        for state in states(process):
            taut = state
            if "at" not in state:
                continue
            if state["at"][2] > 0.15:
                break
            command = {"acknowledge": True} if state["trouble"] else {"steer": [1e-3, 0.0, 0.2, 0.1]}
            process.stdin.write(json.dumps(command).encode() + b"\n")
            process.stdin.flush()
        assert taut["at"][2] > 0.15
        process.stdin.close()
        last = list(states(process))[-1]
    assert process.returncode == 0
    assert last["at"][2] < 0.1
