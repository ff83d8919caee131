"""The interlock, asked again about the samples of a record: the same states and faults, or where they differ."""

import os
import signal
from dataclasses import replace

import pytest

from rig.records import bits
from rig.short_trials import short
from tendonrod import InvalidInput
from tendonrod.rig.asked_again import ask_again, limits_of_record
from tendonrod.rig.record import read_record
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.replay import replay
from tendonrod.rig.states import FaultKind, State
from tendonrod.rig.virtual.injection import Injection, InjectionKind


def rewritten(record, path, change=lambda i, *row: row, **header):
    """A record with rows and header changed."""
    with Recorder(path, dict(record.header) | header) as recorder:
        for i, row in enumerate(replay(record)):
            recorder.write(*change(i, *row))
    return read_record(path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return short(tmp_path_factory.mktemp("whole") / "whole.rec").record


def test_a_whole_trial_is_found_as_it_was(whole):
    verdict = ask_again(whole)
    assert verdict.agrees
    assert (verdict.asked, verdict.of, verdict.told) == (len(whole.samples), len(whole.samples), ())


@pytest.mark.parametrize(
    ("kind", "more", "found"),
    [
        (InjectionKind.CELL_NAN, {}, FaultKind.NAN_SENSOR),
        (InjectionKind.CELL_STALE, {}, FaultKind.STALE_SENSOR),
        (InjectionKind.CELL_JUMP, {"value": 0.8}, None),
        (InjectionKind.ENCODER_JUMP, {"where": "screw", "value": 2e-3}, FaultKind.ENCODER_JUMP),
        (InjectionKind.STALL, {"where": "translation"}, FaultKind.STALL),
        (InjectionKind.CLOCK_LATE, {"value": 0.03}, FaultKind.LATE),
        (InjectionKind.TENDON_BREAK, {}, None),
    ],
)
def test_a_fault_that_samples_show_is_found_again_to_the_sample(tmp_path, kind, more, found):
    done = short(tmp_path / "a.rec", Injection(kind=kind, time=4.0, **more))
    assert done.outcome.fault is not None
    assert found in (done.outcome.fault.kind, None)
    verdict = ask_again(done.record)
    assert verdict.agrees, str(verdict)
    assert verdict.told == ()


def test_a_fault_that_no_sample_shows_is_taken_from_the_record(tmp_path):
    done = short(tmp_path / "a.rec", Injection(kind=InjectionKind.DEVICE_ERROR, where="screw", time=4.0))
    verdict = ask_again(done.record)
    assert verdict.agrees, str(verdict)
    assert [each.kind for each in verdict.told] == [FaultKind.DEVICE]
    assert "1 told, not seen in samples" in str(verdict)


def test_a_release_that_a_person_asked_for_is_followed(tmp_path):
    count = []

    def watch(moment):
        count.append(moment)
        if len(count) == 700:
            os.kill(os.getpid(), signal.SIGINT)

    done = short(tmp_path / "a.rec", watch=watch)
    assert done.outcome.fault.kind is FaultKind.EMERGENCY
    assert ask_again(done.record).agrees


def test_a_sample_that_was_changed_is_where_they_differ(whole, tmp_path):
    k = 900

    def pulled(i, sample, *rest):
        return (replace(sample, force=replace(sample.force, tension=5.0)) if i == k else sample), *rest

    verdict = ask_again(rewritten(whole, tmp_path / "b.rec", pulled))
    assert not verdict.agrees
    assert verdict.differences[0][:3] == (k, whole.time[k], "state")
    assert (verdict.differences[0].recorded, verdict.differences[0].found) == ("running", "fault")
    assert FaultKind.TENSION.value in verdict.differences[1].found
    assert verdict.asked == k + 1
    assert f"differs after {k} of {len(whole.samples)} samples" in str(verdict)


def test_a_fault_that_was_taken_out_and_a_command_that_was_made_faster_are_seen(tmp_path, whole):
    done = short(tmp_path / "a.rec", Injection(kind=InjectionKind.CELL_NAN, time=4.0)).record
    quiet = rewritten(
        done, tmp_path / "b.rec", lambda i, sample, sent, state, fault: (sample, sent, State.RUNNING, None)
    )
    first = int((done.states == State.FAULT.value).argmax())
    assert ask_again(quiet).differences[0][:3] == (first, done.time[first], "state")

    def faster(i, sample, sent, *rest):
        return sample, replace(sent, translation=1.0) if i == 900 else sent, *rest

    verdict = ask_again(rewritten(whole, tmp_path / "c.rec", faster))
    assert verdict.differences[0][:3] == (900, whole.time[900], "command")
    assert "1.0" in verdict.differences[0].recorded


def test_a_torn_record_is_asked_as_far_as_it_goes(whole, tmp_path):
    path = tmp_path / "torn.rec"
    with open(whole.name, "rb") as file:
        path.write_bytes(file.read()[:200_000])
    record = read_record(path)
    verdict = ask_again(record)
    assert 500 < len(record.samples) < len(whole.samples)
    assert verdict.agrees
    assert verdict.asked == len(record.samples)


def test_the_limits_of_a_record_are_those_of_its_bench(whole, tmp_path):
    limits = limits_of_record(whole)
    assert limits.screw.speed == 3e-3
    assert bits(limits.tension) == bits(whole.header["limits"]["tension"])
    for wrong in (None, {"tension": 1.0}, dict(whole.header["limits"]) | {"colour": "red"}):
        with pytest.raises(InvalidInput, match="limits"):
            ask_again(rewritten(whole, tmp_path / f"{len(str(wrong))}.rec", limits=wrong))


def test_an_empty_record_asks_nothing(whole, tmp_path):
    Recorder(tmp_path / "none.rec", dict(whole.header)).close()
    verdict = ask_again(read_record(tmp_path / "none.rec"))
    assert verdict.agrees
    assert verdict.asked == 0
