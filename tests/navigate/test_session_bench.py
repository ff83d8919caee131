"""A session on the virtual bench: it shows what the bench measures, again and again alike; faults stop it."""

import time
from dataclasses import replace

import pytest

from navigate import round_phantom
from navigate.benches import virtual
from tendonrod import InvalidInput, TendonrodError, anatomy
from tendonrod.navigate import bench_drive
from tendonrod.navigate.bench_drive import BenchDrive
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.dead_man import GRACE
from tendonrod.navigate.limits import NavigationLimits
from tendonrod.navigate.record import SessionRecord, digest
from tendonrod.navigate.replay import replay
from tendonrod.navigate.session import Session
from tendonrod.navigate.teleoperate import DEAD_MAN, Teleoperate
from tendonrod.rig.benches import VirtualSource
from tendonrod.rig.drives import Machine
from tendonrod.rig.guarded import GuardedBench
from tendonrod.rig.interfaces import AxisState, Command, Force, Sample
from tendonrod.rig.loop import drive, prepare
from tendonrod.rig.states import State
from tendonrod.rig.trials import limits_of
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.injection import Injection
from tendonrod.rig.virtual.setup import VirtualSetup

STEP = 0.05


def on_bench(scenario, *injections, record=None, **changes):
    return Session(scenario, BenchDrive(scenario, virtual(scenario, *injections), **changes), record)


def steps(session, jog, count):
    for _ in range(count):
        session.step(jog, STEP)
    return session.snapshot


def test_the_session_goes_where_the_bench_goes(scenario):
    session = on_bench(scenario)
    out = steps(session, Jog(insertion=1e-3), 120)
    assert 1e-3 < out.exposed < 6e-3  # the lead screw of the virtual bench is the slow one
    taut = steps(session, Jog(tension=0.1), 60)
    still = steps(session, Jog(), 60)
    assert still.tension == pytest.approx([0.3], abs=0.03)
    assert abs(still.exposed - taut.exposed) < 0.1e-3
    turned = steps(session, Jog(rotation=0.3), 40)
    assert turned.rotation - still.rotation == pytest.approx(0.6, abs=0.1)
    back = steps(session, Jog(insertion=-1e-3, tension=-0.1), 60)
    assert back.exposed < turned.exposed
    session.close()


def test_the_same_seed_gives_the_same_session_and_its_record_replays(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(anatomy, "load_phantom", lambda source, levels=None: round_phantom.round_phantom())
    path, found = tmp_path / "bench.jsonl", []
    for record in (SessionRecord(path), None):
        session = on_bench(scenario, record=record, seed=7)
        found.append(digest(steps(session, Jog(insertion=1e-3, tension=0.05), 40)))
        session.close()
    assert found[0] == found[1]
    assert digest(list(replay(path))[-1]) == found[0]


def test_a_fault_stops_the_session_and_is_told(scenario):
    broken = Injection(kind="load cell gives no number", time=20.0)
    session = on_bench(scenario, broken)
    shown = steps(session, Jog(insertion=1e-3), 10)
    while shown.time < 40.0 and not shown.blocked:
        shown = session.step(Jog(insertion=1e-3), 0.5)
    assert shown.blocked.startswith("the bench stopped: sensor gives no number")
    later = steps(session, Jog(insertion=1e-3), 40)
    assert later.exposed == pytest.approx(shown.exposed, abs=0.2e-3)
    assert later.blocked == shown.blocked
    session.close()


def test_a_bench_is_not_reset_by_a_word(scenario):
    session = on_bench(scenario)
    with pytest.raises(TendonrodError, match=r"^on a bench the robot cannot be retracted at once: drive it back"):
        session.reset()
    assert not session.can_reset
    session.close()
    session.close()


def test_the_benchs_robot_must_be_the_sessions(scenario):
    other = VirtualSetup(robot=scenario.robot.replace(torsion="published"))
    with pytest.raises(InvalidInput, match=r"torsion published: must be one with the scenario's robot, .*homogenized"):
        BenchDrive(scenario, VirtualSource(setup=other))


def test_a_jog_that_is_not_renewed_ends():
    machine = Machine(length=75e-3)
    task, z, period = Teleoperate(machine, NavigationLimits()), 0.0, 5e-3
    axis = AxisState(time=0.0, position=0.0, velocity=0.0)
    sample = Sample(time=0.0, screw=axis, translation=axis, rotation=axis, force=Force(time=0.0, tension=0.0))
    task.steer(Jog(insertion=2e-3))
    sent = Command()
    for _ in range(100):
        sent = task.update(replace(sample, translation=replace(axis, position=z)), period)
        z += sent.translation * period
    assert z == pytest.approx(2e-3 * DEAD_MAN, abs=2e-3 * period)
    assert abs(sent.translation) < 1e-6


def test_an_operator_may_rest_longer_than_a_task_may_be_stuck(scenario):
    limits, strain = limits_of(virtual(scenario))
    guarded = GuardedBench(virtual_bench(VirtualSetup(robot=scenario.robot), 0), replace(limits, patience=1.0), strain)
    prepare(guarded)
    task = Teleoperate(Machine.of(virtual_bench(VirtualSetup(robot=scenario.robot), 0), 75e-3, 1.0), NavigationLimits())
    outcome = drive(guarded, task, watch=lambda moment: task.finish() if moment.sample.time > 10.0 else None)
    assert outcome.is_done
    assert outcome.duration > 3.0
    guarded.close()


def test_with_its_own_thread_the_bench_goes_on_by_itself(scenario):
    source = virtual(scenario, real_time=True)
    session = Session(scenario, steered := BenchDrive(scenario, source, own_thread=True, rate=25.0))
    for _ in range(500):
        session.step(Jog(insertion=2e-3), 0.02)
        time.sleep(0.02)
        if session.snapshot.exposed > 0.2e-3 or steered.fault:
            break
    assert session.snapshot.exposed > 0.0 or "late" in steered.fault  # as on a machine that others use
    time.sleep(3.0 * DEAD_MAN)
    rest = steered.posture.insertion
    time.sleep(3.0 * DEAD_MAN)
    assert steered.posture.insertion == pytest.approx(rest, abs=1e-4)
    session.close()


def test_a_loop_that_breaks_is_told(scenario, monkeypatch):
    def broken(*given, **more):
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr(bench_drive, "drive", broken)
    source = virtual(scenario, real_time=True)
    session = Session(scenario, BenchDrive(scenario, source, own_thread=True))
    time.sleep(0.1)
    assert "broke: ZeroDivisionError: a defect" in session.step(Jog(insertion=2e-3), 0.02).blocked
    session.close()


def own_loop(scenario):
    source = virtual(scenario, real_time=True)
    return BenchDrive(scenario, source, own_thread=True, rate=50.0)


def pause(drive, seconds):
    drive._bench.clock.wait_until(drive._bench.clock.now() + seconds)


def test_a_bench_with_its_own_loop_stands_within_the_watchdogs_time(scenario):
    """The session may be late, or gone: from the end of its last step on the bench has `GRACE`, and its own braking."""
    drive, period = own_loop(scenario), 1.0 / 50.0
    asked, steer = [], drive._task.steer

    def noted(jog: Jog, time: float = DEAD_MAN) -> None:
        asked.append(time)
        steer(jog, time)

    drive._task.steer = noted
    drive.advance(Jog(insertion=1e-3), 1 / 60)
    assert asked[-1] <= 1 / 60 + GRACE + 1e-12
    pause(drive, asked[-1] + 3.0 * period + 0.1)
    rest = drive.posture.insertion
    pause(drive, 0.3)
    assert drive.posture.insertion == pytest.approx(rest, abs=1e-4)
    drive.close()


def test_a_loop_that_breaks_stops_the_axes_and_is_told(scenario):
    drive = own_loop(scenario)
    session = Session(scenario, drive)

    def broken(sample):
        raise KeyError("a defect")

    drive._seen = broken
    drive._thread.join(10.0)
    assert not drive._thread.is_alive()
    shown = session.step(Jog(insertion=1e-3), 0.02)
    assert "KeyError" in shown.blocked
    assert drive._bench.interlock.state is State.FAULT
    assert drive._bench.interlock.is_settled
    session.close()


def test_a_program_that_ends_without_closing_leaves_the_bench_slack(scenario, monkeypatch):
    at_exit = []
    monkeypatch.setattr("tendonrod.navigate.bench_drive.atexit.register", at_exit.append)
    drive = own_loop(scenario)
    for close in at_exit:
        close()
    assert drive._closed
    assert not drive._thread.is_alive()
    assert drive.posture.tension[0] < 0.05
