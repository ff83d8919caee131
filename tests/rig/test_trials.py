"""Trials on a virtual bench: the same seed the same record, faults as outcomes, benches closed whatever happens."""

from contextlib import contextmanager
from dataclasses import replace
from math import pi

import numpy as np
import pytest

from rig.short_trials import DOWN, SHORT, TARGET, plan, robot, setup, short
from tendonrod.errors import InvalidInput, TendonrodError
from tendonrod.measurement.trial import Tracker
from tendonrod.rig.benches import VirtualSource, as_source, loads_of
from tendonrod.rig.chain import Chain
from tendonrod.rig.inserted import inserted
from tendonrod.rig.interfaces import STILL, DeviceError
from tendonrod.rig.limits import Limits
from tendonrod.rig.profiles import Polynomial, Profile
from tendonrod.rig.replay import replay
from tendonrod.rig.states import FaultKind, Reaction, State
from tendonrod.rig.tasks import Phase, Retract, TensionHold
from tendonrod.rig.trials import follow_leader, limits_of, perform, run
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.injection import Injection, InjectionKind
from tendonrod.rig.virtual.setup import TrackerModel


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    return short(tmp_path_factory.mktemp("trial") / "trial.rec")


def test_a_trial_follows_the_leader(trial):
    assert trial.outcome.is_done
    assert trial.record.is_complete
    way = inserted(trial)
    assert way.insertion[-1] == pytest.approx(0.1, abs=1e-3)
    assert way.error_rms < 0.02
    assert trial.rmse == way.tip_rmse
    assert trial.rmse[0] < 1.5e-3  # the tracker's noise is 0.5 mm


def test_the_same_seed_gives_the_same_record_bit_for_bit(trial, tmp_path):
    again, other = short(tmp_path / "a.rec"), short(tmp_path / "b.rec", seed=2)
    for name in ("samples", "frames", "frame_sample"):
        assert getattr(again.record, name).tobytes() == getattr(trial.record, name).tobytes()
    assert again.record.messages == trial.record.messages
    assert other.record.samples.tobytes() != trial.record.samples.tobytes()


def test_who_watches_sees_what_is_recorded(tmp_path):
    seen = []
    done = short(tmp_path / "a.rec", watch=seen.append)
    recorded = list(replay(done.record))[: len(seen)]
    assert len(seen) == done.outcome.periods
    assert [str((each.sample, each.command)) for each in seen] == [str(each[:2]) for each in recorded]  # NaN != NaN


def test_the_record_tells_the_phases_and_the_setup(trial):
    texts = [each.text for each in trial.record.messages]
    phases = [Phase.START, Phase.TAKE_UP, Phase.INSERT, Phase.SETTLE, Phase.DONE]
    assert texts == [*map(str, phases), str(trial.outcome)]
    header = trial.record.header
    assert header["setup"]["tendon_friction"] == 0.1
    assert (header["torsion"], header["seed"], header["target"], header["kp"]) == ("homogenized", 1, TARGET, 0.05)
    assert trial.trial().robot == robot()


def test_tension_errors_are_those_of_the_phases(trial):
    going, all_of_it = trial.tension_error(Phase.INSERT), trial.tension_error(*Phase)
    assert 0 < going.size < all_of_it.size
    assert np.abs(going).max() < 0.1 < np.abs(all_of_it).max()  # the tendon begins slack
    assert trial.tension_error(Phase.RETRACT).size == 0


def test_the_robot_is_left_slack(trial):
    last = trial.record.samples[-1]
    assert last["force"]["tension"] < 0.05
    assert last["screw"]["velocity"] == 0.0
    assert trial.record.states[-1] == State.HELD


@pytest.mark.parametrize(
    ("injection", "kind"),
    [
        (Injection(kind=InjectionKind.CELL_NAN, time=3.0), FaultKind.NAN_SENSOR),
        (Injection(kind=InjectionKind.DEVICE_ERROR, time=3.0, where="load_cell"), FaultKind.DEVICE),
        (Injection(kind=InjectionKind.CLOCK_LATE, time=3.0, value=0.02), FaultKind.LATE),
    ],
)
def test_a_fault_is_an_outcome_and_its_record_complete(injection, kind, tmp_path):
    done = short(tmp_path / "a.rec", injection)
    assert not done.outcome.is_done
    assert done.outcome.fault.kind is kind
    assert done.outcome.fault.time == pytest.approx(3.0, abs=0.2)
    assert done.record.is_complete
    assert kind in {each.kind for each in done.record.faults}
    assert str(done.outcome.fault) in done.record.messages[-1].text


@contextmanager
def pressed(interlock):
    """A person who asks for the end before anything has moved."""
    interlock.interrupt("Ctrl-C")
    yield


def test_an_end_that_is_asked_for_while_homing_is_an_outcome(tmp_path):
    done = short(tmp_path / "a.rec", around=pressed)
    assert done.outcome.fault.kind is FaultKind.EMERGENCY
    assert done.outcome.fault.reaction is Reaction.RELEASE
    assert done.outcome.periods == 0
    assert done.record.is_complete


def test_a_record_that_is_there_is_not_overwritten_and_the_bench_is_closed(trial, monkeypatch):
    before, closed = trial.path.read_bytes(), []
    bench = virtual_bench(setup(), 1)
    monkeypatch.setattr(type(bench), "close", lambda self: closed.append(self))
    with pytest.raises(InvalidInput, match="never overwritten"):
        perform(bench, robot(), lambda machine: TensionHold(0.3, 1.0, machine), trial.path)
    assert closed == [bench]
    assert trial.path.read_bytes() == before


def test_a_bench_is_closed_where_its_task_cannot_be_made(tmp_path, monkeypatch):
    closed = []
    bench = virtual_bench(setup(), 1)
    monkeypatch.setattr(type(bench), "close", lambda self: closed.append(self))
    with pytest.raises(InvalidInput, match="duration"):
        perform(bench, robot(), lambda machine: TensionHold(0.3, -1.0, machine), tmp_path / "a.rec")
    assert closed == [bench]
    assert not list(tmp_path.iterdir())


class Unopened(VirtualSource):
    """A source that must not be opened."""

    def open(self, seed):
        raise AssertionError("opened")


def test_a_tension_beyond_the_limit_is_refused_before_anything_is_opened(tmp_path):
    source = Unopened(setup=setup())
    strong = Profile(name="strong", tension=Polynomial((1.4,)))
    with pytest.raises(InvalidInput, match="target"):
        follow_leader(source, strong, 1.4, tmp_path / "a.rec")
    with pytest.raises(InvalidInput, match="target"):
        run(source, lambda machine: TensionHold(1.4, 1.0, machine), tmp_path / "a.rec", highest=1.4)


def test_limits_come_from_the_model_the_load_and_the_source():
    light, _ = limits_of(as_source(setup()))
    hung = setup(tracker=TrackerModel(mass=1e-3, offset=(1e-3, 0.0, 0.0)))
    (load,) = loads_of(as_source(hung))
    assert (load.mass, load.offset) == (1e-3, (1e-3, 0.0, 0.0))
    heavy, _ = limits_of(as_source(hung))
    assert heavy.tension != light.tension
    given = VirtualSource(setup=setup(), limits={"tension": 0.8, "screw": {"high": 0.05}})
    limits, _ = limits_of(given, rate=500.0)
    assert (limits.tension, limits.period, limits.screw.high) == (0.8, 1 / 500, 0.05)
    assert limits.screw.low == Limits().screw.low


def test_a_tracker_on_the_base_weighs_nothing_on_the_robot():
    source = VirtualSource(setup=setup())
    base = type("S", (), {"trackers": (Tracker(name="base", on="base", mass=1.0), *source.trackers)})()
    assert loads_of(base) == ()


def test_in_and_out_again_in_one_record(tmp_path):
    from tendonrod.rig.tasks import FollowLeader

    def make(machine):
        tasks = [FollowLeader(plan(), machine, **SHORT), Retract(plan(), machine, screw_rate=2e-3)]
        return Chain(tasks)

    progress = []
    done = run(setup(), make, tmp_path / "a.rec", watch=lambda moment: progress.append(moment.task.progress))
    assert done.outcome.is_done
    assert done.outcome.task == "follow the leader, then retract"
    z = done.record.samples["translation"]["position"] / robot().section.L
    assert z.max() == pytest.approx(0.1, abs=1e-3)
    assert z[-1] == pytest.approx(0.05, abs=2e-3)
    assert progress[-1] == 1.0
    assert done.tension_error(Phase.RETRACT).size > 100


def test_a_chain_needs_a_task_and_stands_still_in_the_end():
    with pytest.raises(InvalidInput, match="tasks"):
        Chain([])

    class Done:
        name, is_done, progress = "nothing", True, 1.0

        def update(self, sample, dt):
            return STILL

    chain: Chain = Chain([Done(), Done()])
    steps = []
    while not chain.is_done:
        steps.append(chain.progress)
        assert chain.update(None, 0.0) is STILL  # pyright: ignore[reportArgumentType]
    assert (steps, chain.progress, chain.phase) == ([0.5, 1.0], 1.0, "")


def test_axes_that_do_not_know_their_references_must_home(tmp_path):
    with pytest.raises(Exception, match="cannot arm"):
        short(tmp_path / "a.rec", home=False)


def test_an_axis_that_does_not_home_is_told_in_one_line(tmp_path):
    start = replace(setup().translation, start=-5e-3)
    stuck = Injection(kind=InjectionKind.STALL, time=0.0, where="translation")
    with pytest.raises(DeviceError, match="translation does not come to its reference"):
        follow_leader(setup(stuck, translation=start), plan(), TARGET, tmp_path / "a.rec")


def test_the_gains_and_the_feed_forward_reach_the_loop(tmp_path):
    soft = short(tmp_path / "a.rec", kp=5e-3, ki=1e-3)
    ahead = short(tmp_path / "b.rec", kp=5e-3, ki=1e-3, feed_forward=True)
    assert inserted(ahead).error_rms < 0.5 * inserted(soft).error_rms


def test_a_machine_turns_with_the_helix(trial):
    samples, way = trial.record.samples, inserted(trial)
    turned = samples["rotation"]["position"][np.searchsorted(trial.record.time, way.time)]
    np.testing.assert_allclose(turned, 2.0 * pi * robot().turns * (way.insertion - 1.0), atol=0.02)
    assert tuple(trial.gravity) == DOWN


def test_a_tendon_left_taut_is_let_go_without_homing(tmp_path):
    taut = setup(slack=-1e-3)  # pulled by a millimetre when it is switched on
    with pytest.raises(TendonrodError, match="release it first"):
        follow_leader(taut, plan(), TARGET, tmp_path / "a.rec")
    done = run(taut, None, tmp_path / "b.rec")
    assert (done.outcome.is_done, done.outcome.task) == (True, "release the tendon")
    tension = done.record.samples["force"]["tension"]
    assert tension[0] > 0.5
    assert tension[-1] < 0.05
    assert not done.record.samples["screw"]["homed"].any()
    assert np.ptp(done.record.samples["translation"]["position"]) < 1e-4


def test_a_task_that_a_limit_stops_ends_by_a_fault_and_not_never(tmp_path):
    """The screw may pay out 5 mm only, of the 7.3 that the insertion needs: the rest of the trial waits for it."""
    axis = {"screw": {"high": 5e-3}, "patience": 3.0}
    source = VirtualSource(setup=setup(), limits=axis)
    done = follow_leader(source, plan(), TARGET, tmp_path / "stuck.rec", **SHORT)
    assert not done.outcome.is_done
    assert done.outcome.fault.kind is FaultKind.STUCK
    assert done.outcome.fault.where in set(Phase)
    assert 3.0 < done.outcome.fault.value < 3.1
    assert done.record.is_complete
