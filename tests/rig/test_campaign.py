"""A seeded hundredth of the fault campaign of benchmarks/bench_faults.py, and what the campaign taught the bench."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import _fault_trial as trial  # pyright: ignore[reportMissingImports]
import bench_faults  # pyright: ignore[reportMissingImports]
from _fault_cases import CASES  # pyright: ignore[reportMissingImports]
from rig.plain_bench import COMPLIANCE, PERIOD, period, run, taut
from tendonrod.rig.detection import DETECTION, Watch
from tendonrod.rig.interfaces import Command
from tendonrod.rig.states import FaultKind, Reaction, State
from tendonrod.rig.virtual.axes import Drive
from tendonrod.rig.virtual.setup import roller_translation

SEED = 5
PICKED = (
    "cell gives no number", "cell repeats itself", "cell saturated", "cell reads zero, below 0.3 N",
    "cell reads zero from the start", "cell stands still",
    "encoder jumps, screw", "beyond travel", "too fast", "runs away, screw", "commands lost, all", "tracker lost",
    "device silent", "periods late", "pause of the process", "disk full", "controller raises", "controller stuck",
    "emergency stop",
    "process killed",
)  # fmt: skip  # between them every kind of fault
OUT = Command(translation=1e-3, target=0.2)


@pytest.fixture(scope="module")
def results():
    return [trial.run((SEED, list(CASES).index(case))) for case in PICKED]


def test_each_is_found_in_time_bounded_recorded_and_ends_as_it_must(results):
    assert {each.case: each.wrong for each in results if each.wrong} == {}


def test_every_kind_of_fault_is_among_them(results):
    assert {kind for each in results for kind in each.kinds} == {kind.name for kind in FaultKind}


def test_tension_stays_below_its_limit_where_it_shows(results):
    shown = [each for each in results if each.case not in ("cell reads zero from the start", "cell stands still")]
    assert max(each.peak for each in shown) < results[0].limit


def test_the_report_has_a_line_for_each_case(results):
    said = bench_faults.report(results, SEED, 1.0)
    assert all(case in said for case in PICKED)
    assert said.endswith("0 trials in which something is not as it should be")


def test_an_item_is_the_same_whenever_it_is_made():
    item = list(CASES).index("runs away, screw")
    one, two = trial.run((3, item)), trial.run((3, item))
    assert (one.found, one.peak, one.duration, one.kinds) == (two.found, two.peak, two.duration, two.kinds)
    assert trial.asked(3, item) == trial.asked(3, item) != trial.asked(4, item)


def test_the_campaign_fails_where_nothing_is_found(monkeypatch):
    monkeypatch.setattr(Watch, "found", lambda *_: iter(()))
    result = trial.run((SEED, list(CASES).index("encoder jumps, rotation")))
    assert any("found after nan" in each for each in result.wrong)


# What it taught


def weak(tension: float = 0.2):
    """Running under a small tension that is aimed at."""
    bench, guarded = taut(tension)
    for _ in range(2):  # the first tells what is aimed at
        period(guarded, OUT)
    return bench, guarded


@pytest.mark.parametrize("cause", ["a broken tendon", "a dead cell"])
def test_tension_that_stays_away_is_found_within_its_pull(cause):
    bench, guarded = weak()
    start = bench.translation.position
    if cause == "a dead cell":
        bench.load_cell.change = {"tension": 0.0}
    else:
        bench.load_cell.offset = -1.0
    run(guarded, OUT, 2.0)
    limits, fault = guarded.interlock.limits, guarded.interlock.fault
    assert fault.kind is FaultKind.TENSION_LOST
    assert guarded.interlock.reaction is DETECTION[FaultKind.TENSION_LOST].reaction is Reaction.HOLD
    pulled = bench.translation.position - start
    assert limits.lost_pull < pulled < limits.lost_pull + 3 * OUT.translation * PERIOD


@pytest.mark.parametrize(
    "command",
    [
        Command(translation=1e-3, screw=1e-3, target=0.2),  # nothing is pulled
        Command(translation=1e-3),  # nothing is aimed at
        Command(translation=1e-3, target=0.05),  # less is aimed at than shows
        Command(target=0.2),  # nothing moves
    ],
)
def test_a_slack_tendon_that_need_not_be_taut_is_no_fault(command):
    bench, guarded = weak()
    period(guarded, command)
    bench.load_cell.change = {"tension": 0.0}
    run(guarded, command, 0.5)  # less than the take-up, after which it is one whatever is aimed at
    assert guarded.interlock.fault is None


def released(bench, guarded, seconds: float = 5.0) -> float:
    """Release, and how much the screw paid out, m."""
    start = bench.screw.position
    guarded.interlock.shutdown()
    for _ in range(round(seconds / PERIOD)):
        period(guarded)
    assert guarded.interlock.is_settled
    return bench.screw.position - start


@pytest.mark.parametrize("tension", [0.25, 0.8])
def test_a_reading_that_fell_is_not_believed_in_the_release(tension):
    """From 0.8 N it fell too fast, from 0.25 N it did not rise: either way the tendon may hold more than is read."""
    bench, guarded = weak(tension)
    bench.load_cell.change = {"tension": 0.0}
    run(guarded, OUT, 2.0)
    assert guarded.interlock.state is State.FAULT
    assert released(bench, guarded) >= guarded.interlock.limits.release_travel


def test_a_release_goes_on_where_another_axis_pulls_it_taut_again():
    bench, guarded = weak()
    guarded.interlock.trip(FaultKind.DEVICE, where="translation: silent")
    released(bench, guarded, 1.0)
    bench.load_cell.offset += 0.4 * COMPLIANCE
    for _ in range(200):
        period(guarded)
    assert guarded.interlock.is_settled
    assert bench.load_cell.read().tension < guarded.interlock.limits.slack


def test_a_screw_that_winds_in_is_stopped_before_it_pays_out():
    bench, guarded = weak(0.5)
    period(guarded, Command(screw=-2e-3, target=0.5))
    guarded.interlock.trip(FaultKind.TENSION)
    bench.screw.change = {"velocity": -2e-3}
    assert period(guarded)[1].screw == 0.0
    assert not guarded.interlock.is_settled
    bench.screw.change = {}
    assert period(guarded)[1].screw == guarded.interlock.limits.release_rate


def test_a_screw_that_winds_in_against_its_command_is_stopped_for_good():
    """What the campaign found: each command to pay out gave a screw that ran away the power to pull, up to 10 N."""
    bench, guarded = weak(0.5)
    guarded.interlock.trip(FaultKind.TENSION)
    assert period(guarded)[1].screw > 0.0
    bench.screw.obeys, at, periods = False, bench.screw.position, 0
    bench.screw.change = {"velocity": -2e-3}
    while periods == 0 or guarded.interlock.allowed(Command(), period(guarded)[0]).screw > 0.0:
        periods += 1
        bench.screw.position = at - 2e-3 * PERIOD * periods
    assert (periods - 1) * 2e-3 * PERIOD <= guarded.interlock.limits.lag[0] + 2e-3 * PERIOD
    bench.screw.change, bench.screw.velocity = {}, 0.0
    assert all(period(guarded)[1].screw == 0.0 for _ in range(100))
    assert guarded.interlock.is_settled


def test_a_bridge_without_power_stands_until_it_is_told_to_move():
    drive = Drive(roller_translation(), timeout=0.1)

    def seconds(time: float) -> float:
        before = drive.motor
        for _ in range(round(time / 1e-3)):
            drive.advance(0.0, 1e-3, False, 4e-3, False)
        return drive.motor - before

    assert seconds(0.5) > 1e-3
    drive.command(0.0, 0.0, hard=True)
    seconds(0.1)
    assert drive.velocity == 0.0
    drive.command(0.0, 0.0)
    assert seconds(0.5) == 0.0
    drive.command(-1e-3, 0.0)
    assert seconds(0.5) > 1e-3
