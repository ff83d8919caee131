"""A machine that is too busy for a bench: a virtual one waits, a real one says so, and what was not done is told."""

import os
import time
from itertools import pairwise
from types import SimpleNamespace

import httpx
import pytest

from navigate.benches import virtual
from navigate.pretend import PretendSession
from navigate.served import served
from tendonrod.navigate.bench_aside import AHEAD, BenchAside, _patient
from tendonrod.navigate.bench_drive import BenchDrive
from tendonrod.navigate.bench_process import NICER, PRIORITY, precede
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.recovery import Trouble, trouble_of
from tendonrod.rig.benches import DeviceSource, VirtualSource
from tendonrod.rig.board_devices import Calibration
from tendonrod.rig.safety import Interlock
from tendonrod.rig.states import FaultKind
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.injection import Injection
from tendonrod.rig.virtual.setup import VirtualSetup

RATE, HELD_UP = 50.0, 0.15  # per second; s, longer than the command_timeout and sensor_age of any bench here


def devices(scenario):
    return DeviceSource(
        robot=scenario.robot, gravity=(0.0, 0.0, 0.0), launchpad={"port": "nowhere"}, calibration=Calibration()
    )


def test_a_patient_clock_stands_where_nobody_waits_and_waits_in_real_time(scenario):
    ahead = 2e-3
    bench = virtual_bench(VirtualSetup(robot=scenario.robot), 0, real_time=True, ahead=ahead)
    bench.clock.wait_until(0.05)
    time.sleep(HELD_UP)
    assert 0.05 <= bench.clock.now() <= 0.05 + ahead
    assert bench.translation.read().time <= 0.05 + ahead
    began, at = time.perf_counter(), bench.clock.now()
    bench.clock.wait_until(at + 0.1)
    assert time.perf_counter() - began >= 0.1
    assert at + 0.1 <= bench.clock.now() <= at + 0.1 + ahead


@pytest.mark.parametrize("is_patient", [True, False])
def test_a_virtual_bench_under_the_page_has_no_fault_of_a_busy_machine(scenario, is_patient):
    """Every period is held up. The same bench in strict real time finds that out, as one of devices has to."""
    given = _patient(virtual(scenario, real_time=True), RATE) if is_patient else virtual(scenario, real_time=True)
    drive = BenchDrive(scenario, given, own_thread=True, rate=RATE)
    seen, looks = drive._seen, []

    def slow(sample):
        looks.append(sample.time)
        time.sleep(HELD_UP)
        return seen(sample)

    drive._seen = slow
    while len(looks) < 8:
        drive.advance(Jog(insertion=1e-3), HELD_UP)
        time.sleep(0.02)
    trouble = drive.trouble
    drive._seen = seen
    drive.close()
    if is_patient:
        assert trouble is None
        assert max(b - a for a, b in pairwise(looks)) < 1.5 / RATE
    else:
        assert trouble is not None
        assert "too busy" in trouble.remedy


def test_only_a_virtual_bench_waits(scenario):
    patient, real = _patient(virtual(scenario, real_time=True), RATE), devices(scenario)
    assert isinstance(patient, VirtualSource)
    assert patient.ahead == AHEAD / RATE
    assert _patient(real, RATE) is real


@pytest.mark.parametrize(
    ("kind", "is_busy"),
    [
        (FaultKind.COMMAND_TIMEOUT, True), (FaultKind.LATE, True), (FaultKind.STALE_SENSOR, True),
        (FaultKind.NAN_SENSOR, False), (FaultKind.TENSION, False),
    ],
)  # fmt: skip
def test_the_remedy_says_where_the_machine_may_have_been_too_busy(kind, is_busy):
    lock = Interlock()
    lock.trip(kind)
    lock._settled = True
    trouble = trouble_of(lock)
    assert trouble is not None
    assert ("too busy" in trouble.remedy) == is_busy
    assert "acknowledge" in trouble.remedy


def test_the_loop_of_devices_takes_the_precedence_that_it_may(scenario, monkeypatch):
    asked, allowed = [], {"fifo", "nice"}

    def fifo(pid, policy, param):
        asked.append((policy, param.sched_priority))
        if "fifo" not in allowed:
            raise PermissionError

    def nice(by):
        asked.append(by)
        if "nice" not in allowed:
            raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", fifo, raising=False)
    monkeypatch.setattr(os, "sched_param", lambda p: SimpleNamespace(sched_priority=p), raising=False)
    monkeypatch.setattr(os, "SCHED_FIFO", 1, raising=False)
    monkeypatch.setattr(os, "nice", nice, raising=False)
    assert precede(virtual(scenario, real_time=True)) == ""
    assert asked == []
    for has, found in (({"fifo"}, "real time"), ({"nice"}, "nice"), (set(), "")):
        allowed = has
        assert precede(devices(scenario)) == found
    assert asked == [(1, PRIORITY), (1, PRIORITY), NICER, (1, PRIORITY), NICER]


def test_a_step_during_a_fault_ends_at_once_and_says_why(tmp_path):
    session = PretendSession()
    session.trouble = Trouble(text="the bench stopped: late", remedy="acknowledge", ready=True)
    with served(session, tmp_path) as server, httpx.Client(base_url=server.url) as client:
        key = {"X-Key": client.post("/api/take", json={"name": "script"}).json()["key"]}
        done = client.post("/api/step", json={"insertion": 1.0, "duration": 10.0}, headers=key).json()
        assert done["ended_early"] == "the bench stopped: late"
        assert done["seconds_done"] < 5.0


def test_whoever_acknowledges_sees_that_the_fault_is_over(scenario):
    blind = Injection(kind="load cell gives no number", time=0.5, duration=0.3)
    drive, end = BenchAside(scenario, virtual(scenario, blind, real_time=True), rate=RATE), time.monotonic() + 30.0
    while time.monotonic() < end and (drive.trouble is None or not drive.trouble.ready):
        time.sleep(0.02)
    before = drive.trouble
    assert before is not None
    time.sleep(0.5)  # until the cell reads again
    drive.acknowledge()
    assert drive.trouble != before
    drive.close()
