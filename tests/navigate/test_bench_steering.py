"""A bench goes where it is steered: an insertion alone turns nothing; its own limits are told, and kept clear of."""

from math import degrees

import pytest

from navigate.benches import virtual
from tendonrod.navigate.bench_drive import BenchDrive
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.session import Session
from tendonrod.rig.states import State
from tendonrod.rig.virtual.injection import Injection

STEP = 0.05
IN, OUT, PULL, STAND = Jog(insertion=1e-3), Jog(insertion=-1e-3), Jog(tension=0.1), Jog()
BACKLASH = 1.0  # degree, of the virtual bench's rotation


def steered(scenario, *injections, **limits):
    return BenchDrive(scenario, virtual(scenario, *injections, **limits))


def moved(drive, jog, seconds):
    for _ in range(round(seconds / STEP)):
        drive.advance(jog, STEP)
    return drive.posture


@pytest.mark.parametrize("rate", [0.4e-3, 1e-3, 5e-3])
def test_an_insertion_turns_nothing_however_often_it_begins_and_ends(scenario, rate):
    """The screw's 0.5 mm/s is less than two of these rates: a goal that runs ahead must not turn the robot."""
    drive = steered(scenario)
    before = moved(drive, PULL, 3.0)
    for jog in (Jog(insertion=rate), Jog(insertion=-rate)):
        for _ in range(4):
            moved(drive, jog, 1.5)
            after = moved(drive, STAND, 0.7)
            assert abs(degrees(after.rotation - before.rotation)) < 0.3
    drive.close()


def test_the_last_period_of_a_command_moves_only_for_what_is_left_of_it(scenario):
    drive = steered(scenario)
    drive.coupled = False  # else the goal follows the noise of the translation
    drive.advance(STAND, STEP)
    before = drive._task._phi
    drive.steer(Jog(rotation=0.5), 2.5 * drive._period)
    for _ in range(3):
        drive._due += drive._period
        drive._bench.clock.wait_until(drive._due)
        drive._run_period()
    assert drive._task._phi - before == pytest.approx(0.5 * 2.5 * drive._period)
    drive.close()


def test_uncoupled_the_helix_turns_the_robot_by_what_was_inserted(scenario):
    drive = steered(scenario)
    before = moved(drive, PULL, 3.0)
    drive.coupled = False
    moved(drive, IN, 4.0)
    after = moved(drive, STAND, 1.0)
    turned = degrees(after.rotation - before.rotation)
    assert after.insertion > 0.01
    assert turned == pytest.approx(-360.0 * scenario.robot.turns * (after.insertion - before.insertion), abs=0.3)
    drive.close()


def test_a_rotation_beside_an_insertion_is_what_was_asked_for(scenario):
    drive = steered(scenario)
    before = moved(drive, PULL, 3.0)
    moved(drive, Jog(insertion=1e-3, rotation=0.2), 2.0)
    after = moved(drive, STAND, 1.0)
    assert degrees(after.rotation - before.rotation) == pytest.approx(degrees(0.4), abs=BACKLASH)
    drive.close()


def test_an_insertion_waits_for_a_rotation_that_is_slower_than_the_helix(scenario):
    slow = 0.02  # rad/s; the helix takes 0.04 at the screw's speed
    drive = steered(scenario, rotation={"speed": slow})
    before = moved(drive, PULL, 3.0)
    after = moved(drive, IN, 6.0)
    assert drive.fault == ""
    assert abs(degrees(after.rotation - before.rotation)) < 0.5
    most = slow * scenario.robot.section.L / 6.2832 / abs(scenario.robot.turns)
    assert 0.5 * most < (after.insertion - before.insertion) * scenario.robot.section.L / 6.0 <= 1.01 * most
    drive.close()


def test_the_tension_shown_as_the_limit_is_one_that_the_bench_still_inserts_at(scenario):
    drive = steered(scenario)
    session, bench = Session(scenario, drive), drive._bench.interlock.limits
    soft = bench.soft * bench.tension
    highest = session.scenario.limits.tension
    assert highest < soft < scenario.limits.tension
    assert session.snapshot.limits["tension"].high == pytest.approx(highest)
    pulled = moved(drive, PULL, 15.0)
    assert pulled.tension[0] == pytest.approx(highest, abs=0.02)
    pushed = moved(drive, IN, 4.0)
    assert (pushed.insertion - pulled.insertion) * scenario.robot.section.L > 1.6e-3  # of 2.0 at the screw's speed
    assert pushed.tension[0] == pytest.approx(highest, abs=0.02)
    assert drive.fault == ""
    session.close()


def test_a_bench_that_holds_an_insertion_back_says_so(scenario):
    drive = steered(scenario)
    drive._task.limits = scenario.limits  # as where the load, not the operator, brings it above its soft limit
    pulled = moved(drive, PULL, 15.0)
    assert drive.fault == ""
    assert moved(drive, IN, 2.0).insertion == pytest.approx(pulled.insertion, abs=2e-3)
    assert drive.fault.startswith("the bench inserts no further: at 0.9")
    assert "with 0.94 N as its limit; pull less" in drive.fault
    assert moved(drive, OUT, 1.0).insertion <= pulled.insertion
    assert drive.fault == ""
    drive.close()


def test_a_translation_whose_encoder_jumped_is_home_after_homing(scenario):
    """The jump lasts: an axis that finds its reference counts from there, whatever it counted before."""
    drive = steered(scenario, Injection(kind="encoder jumps", where="translation", value=3e-3, time=4.0))
    moved(drive, Jog(insertion=1e-3, tension=0.1), 2.0)
    moved(drive, Jog(insertion=0.2e-3), 6.0)
    assert drive.trouble is not None
    assert drive.trouble.homes
    drive.acknowledge(home=True)
    home = moved(drive, STAND, 1.0)
    assert drive.trouble is None
    assert drive._bench.interlock.state is State.RUNNING
    assert home.insertion == 0.0
    assert abs(degrees(home.rotation)) < BACKLASH
    truth = getattr(drive._bench, "_GuardedBench__bench").world.truth  # noqa: B009 - it hides its devices
    assert abs(truth.translation) < 0.5e-3
    drive.close()
