"""Records as trials, tables and benches: what a trial says of a moment is what the bench did then."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from rig.records import COMMAND, bits
from tendonrod import InvalidInput, load_robot
from tendonrod.measurement.trial import Tracker
from tendonrod.measurement.trialfile import read_trial
from tendonrod.rig.export import export, header_of, to_trial
from tendonrod.rig.interfaces import AxisState, Command, DeviceError, Force, LoadCell, PoseFrame, PoseTracker, Sample
from tendonrod.rig.record import read_record
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.replay import replay, replay_bench
from tendonrod.rig.states import Fault, FaultKind, Reaction, State

ROBOT = load_robot("exonav-1").replace(youngs_modulus=75e9 / 0.93)
TRACKERS = (Tracker(name="middle", at=0.04, offset=(2e-3, 0.0, 0.0)), Tracker(name="tip", turn=(0.0, 0.0, 0.1)))
DELAY, RATE, N = 0.035, 200.0, 400
FIELD = np.array([[0.0, -1.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.3], [0.0, 0.0, 0.0, 1.0]])


def tension(t):
    return 0.3 + 0.2 * t


def insertion(t):
    return 0.1 + 0.4 * t


def place(t):
    return np.array([0.01 * t, -0.02, 0.03 + t])


def _frames(i: int, t: float) -> tuple[PoseFrame, ...]:
    """Both tools at 40 Hz, of ``DELAY`` ago; the middle one is lost in every fourth."""
    if i % 5:
        return ()
    number, then, quaternion = i // 5, t - DELAY, (np.cos(t), np.sin(t), 0.0, 0.0)
    shared = {"time": t, "frame": number, "quality": 1e-4}
    tip = PoseFrame(tool="tip", position=tuple(place(then)), quaternion=quaternion, **shared)
    lost = {"position": 3 * (np.nan,), "quaternion": 4 * (np.nan,), "state": "MISSING"}
    seen = {"position": tuple(place(then) - 0.05), "quaternion": quaternion}
    return PoseFrame(tool="middle", **(lost if number % 4 == 3 else seen), **shared), tip


def _sample(i: int) -> Sample:
    """Linear motions; each device was read a little before the period's time, the load cell at half the rate."""
    t = 5.0 + i / RATE
    z, cell = insertion(t - 6.0) * ROBOT.section.L, 5.0 + i // 2 * 2 / RATE - 1e-3
    angle = 0.3 + 2.0 * np.pi * ROBOT.turns * (insertion(t - 6.0 - 5e-4) - 1.0)
    return Sample(
        time=t,
        screw=AxisState(time=t, position=0.9 * z, velocity=0.0),
        translation=AxisState(time=t, position=z, velocity=0.0),
        rotation=AxisState(time=t - 5e-4, position=angle, velocity=0.0),
        force=Force(time=cell, tension=tension(cell)),
        frames=_frames(i, t),
    )


SAMPLES = [_sample(i) for i in range(N)]
FAULT = Fault(kind=FaultKind.STALE_SENSOR, time=6.9, reaction=Reaction.HOLD, value=0.2, limit=0.1, where="load cell")


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    path = tmp_path_factory.mktemp("record") / "first try.rec"
    header = header_of(ROBOT, TRACKERS, DELAY, gravity=(0.0, -9.81, 0.0), T_world_field=FIELD, seed=7, task="ftl")
    with Recorder(path, header) as recorder:
        for i, each in enumerate(SAMPLES):
            recorder.write(each, COMMAND, State.RUNNING, FAULT if i > 380 else None)
    return read_record(path)


@pytest.fixture(scope="module")
def trial(record):
    return to_trial(record)


def test_a_frame_is_a_sample_and_none_is_dropped(trial):
    assert trial.time.size == N // 5
    assert [each.name for each in trial.trackers] == ["middle", "tip"]
    assert trial.trackers == TRACKERS
    assert trial.counts()["middle"]["missing pose (MISSING)"] == N // 20
    assert trial.state[3].tolist() == ["MISSING", ""]
    assert not np.isnan(trial.position[:, 1]).any()


def test_a_trial_says_of_a_moment_what_the_bench_did_then(trial):
    """Poses were DELAY old; tension, insertion and rotation must be those of then, not of the frame's arrival."""
    inner = slice(2, None)  # the first poses are from before the first reading
    t = trial.time[inner]
    assert np.allclose(trial.time, 5.0 + np.arange(0, N, 5) / RATE - DELAY, atol=1e-12)
    assert np.allclose(trial.position[inner, 1], [place(each) for each in t], atol=1e-12)
    assert np.allclose(trial.tensions[inner, 0], tension(t), atol=1e-12)
    assert np.isnan(trial.tensions[0, 0])
    moving = np.clip(insertion(t - 6.0), 0.0, 1.0)
    hidden = insertion(t - 6.0) < -1e-3
    assert np.isnan(trial.insertion[inner][hidden]).all()
    assert np.allclose(trial.insertion[inner][~hidden], moving[~hidden], atol=1e-12)
    assert np.allclose(trial.rotation[inner], 0.3, atol=1e-9)


def test_robot_world_and_origin_come_from_the_header(record, trial):
    assert trial.robot == ROBOT
    assert trial.name == "first try"
    assert trial.gravity == (0.0, -9.81, 0.0)
    assert trial.T_world_field.tolist() == FIELD.tolist()
    assert trial.origin["seed"] == "7"
    assert trial.origin["tracker delay"].startswith("0.035 s")
    assert trial.origin["condition of the record"] == "complete"
    assert str(FAULT) in trial.origin["faults"]
    other = to_trial(record, delay=0.0, name="other", gravity=(0.0, 0.0, 0.0), quality_limit=1e-5)
    assert np.allclose(other.time - trial.time, DELAY)
    assert (other.name, other.gravity, other.quality_limit) == ("other", (0.0, 0.0, 0.0), 1e-5)


def test_displacement_is_translation_less_screw_from_slack(record, trial):
    assert np.isnan(trial.displacements).all()
    pulled = to_trial(record, slack=1e-3).displacements[2:, 0]
    assert np.allclose(pulled, 0.1 * insertion(trial.time[2:] - 6.0) * ROBOT.section.L - 1e-3, atol=1e-12)


def test_the_controllers_view(record):
    seen = to_trial(record, at="samples")
    assert seen.time.size == N // 2  # as often as the load cell had something new
    assert np.allclose(seen.tensions[:, 0], tension(seen.time), atol=1e-12)
    assert np.isnan(seen.position).all()


def test_tensions_beside_a_reading_that_is_none_are_none(tmp_path):
    with Recorder(tmp_path / "nan.rec", header_of(ROBOT, TRACKERS)) as recorder:
        for i, each in enumerate(SAMPLES):
            force = Force(time=each.force.time, tension=np.nan if i // 2 == 100 else each.force.tension)
            same = {name: getattr(each, name) for name in ("time", "screw", "translation", "rotation", "frames")}
            recorder.write(Sample(force=force, **same), COMMAND, State.RUNNING)
    found = to_trial(read_record(tmp_path / "nan.rec"))
    beside = np.abs(found.time - SAMPLES[200].force.time) < 2.0 / RATE - 1e-9
    assert beside.any()
    assert np.isnan(found.tensions[:, 0]).tolist() == beside.tolist()


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"at": "noon"}, "frames, samples"),
        ({"trackers": TRACKERS[1:]}, "one for each tool: middle, tip"),
        ({"delay": np.nan}, "delay"),
        ({"gravity": 3.0}, "gravity"),
    ],
)
def test_refused_by_name(record, fields, said):
    with pytest.raises(InvalidInput, match=said) as error:
        to_trial(record, **fields)
    assert "\n" not in str(error.value)


def test_a_record_that_does_not_tell(tmp_path):
    with Recorder(tmp_path / "bare.rec", {"trackers": [{"name": "tip", "colour": "red"}]}) as recorder:
        recorder.write(SAMPLES[1], COMMAND, State.RUNNING)
    bare = read_record(tmp_path / "bare.rec")
    for fields, said in (({}, "text of a robot file"), ({"robot": ROBOT}, "fields of Tracker")):
        with pytest.raises(InvalidInput, match=said):
            to_trial(bare, **fields)
    with pytest.raises(InvalidInput, match="frames of a tracker"):
        to_trial(bare, robot=ROBOT, trackers=TRACKERS)


def test_what_no_device_can_have_measured_is_nan_and_keeps_nothing_else_from_being_exported(tmp_path):
    """A driver of one's own may hand over anything; the record keeps it, a trial has no place for it."""
    wrong = [{"quaternion": (0.0, 0.0, 0.0, 0.0)}, {"position": (np.inf, 0.0, 0.0)}, {"quality": -1.0}]
    samples = [SAMPLES[5 * i] for i in range(6)]
    for i, each in enumerate(wrong):
        middle, tip = samples[i].frames
        samples[i] = replace(samples[i], frames=(middle, replace(tip, **each)))
    samples[4] = replace(samples[4], force=replace(samples[4].force, tension=np.inf))
    with Recorder(tmp_path / "odd.rec", header_of(ROBOT, TRACKERS)) as recorder:
        for each in samples:
            recorder.write(each, COMMAND, State.RUNNING)
    trial = to_trial(read_record(tmp_path / "odd.rec"))
    assert trial.state[:3, 1].tolist() == ["no orientation", "no position", "no quality"]
    assert np.isnan(trial.orientation[0, 1]).all()
    assert np.isnan(trial.position[1, 1]).all()
    assert np.isnan(trial.quality[2, 1])
    assert np.isfinite(trial.position[[0, 2, 3], 1]).all()
    assert np.isfinite(trial.tensions[:3]).all()
    assert np.isnan(trial.tensions[4]).all()


def test_a_record_without_samples_is_refused_by_name(tmp_path):
    Recorder(tmp_path / "none.rec", header_of(ROBOT)).close()
    for at, said in (("frames", "with frames of a tracker"), ("samples", "with a reading of the load cell")):
        with pytest.raises(InvalidInput, match=f"record = .*none.rec: must be one {said}"):
            to_trial(read_record(tmp_path / "none.rec"), at=at)


def test_netcdf_is_the_trial(record, trial, tmp_path):
    export(record, tmp_path / "trial.nc")
    found = read_trial(tmp_path / "trial.nc")
    for name in ("time", "position", "orientation", "tensions", "insertion", "rotation"):
        assert getattr(found, name).tobytes() == getattr(trial, name).tobytes()
    assert found.origin == trial.origin
    assert found.robot == ROBOT


def test_a_thinner_trial_holds_the_same_samples(record, trial, tmp_path):
    """Every third of those that are used, as they were; those that are not used all stay, and the origin says so."""
    written = export(record, tmp_path / "a.nc", every=3)
    again, used = read_trial(tmp_path / "a.nc"), trial.kept.any(axis=1)
    assert written is not None
    np.testing.assert_array_equal(again.time[again.kept.any(axis=1)], trial.time[used][::3])
    np.testing.assert_array_equal(again.time[~again.kept.any(axis=1)], trial.time[~used])
    left = trial.time.size - again.time.size
    assert again.origin["thinned"] == f"every 3rd used sample; {left} others are not in this file"
    at = np.isin(trial.time, again.time)
    np.testing.assert_array_equal(again.position, trial.position[at])
    with pytest.raises(InvalidInput, match="fields"):
        export(record, tmp_path / "a.csv", seconds=1.0)


def test_csv_is_the_record(record, tmp_path):
    export(record, tmp_path / "all.csv")
    with (tmp_path / "all.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(each["tension_n"]) for each in rows] == [each.force.tension for each in SAMPLES]
    assert [float(each["rotation_position_rad"]) for each in rows] == [each.rotation.position for each in SAMPLES]
    assert rows[-1]["fault"] == str(FAULT)
    assert rows[0]["state"] == "running"
    with (tmp_path / "all.frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    frames = [frame for each in SAMPLES for frame in each.frames]
    assert [each["tool"] for each in rows] == [each.tool for each in frames]
    assert [each["x_m"] for each in rows] == ["" if each.is_lost else repr(float(each.position[0])) for each in frames]
    with pytest.raises(InvalidInput, match=r"\.nc or \.csv"):
        export(record, tmp_path / "all.xlsx")


def test_a_controller_meets_the_same_again(record):
    """The loop as it runs on any bench: what it reads is what was read, what it does is kept."""
    bench, playback = replay_bench(record)
    assert isinstance(bench.load_cell, LoadCell)
    assert isinstance(bench.tracker, PoseTracker)
    assert bench.tracker.rate == pytest.approx(RATE / 5)
    met = []
    while not playback.is_over:
        bench.clock.wait_until(np.nan)
        states = {axis.name: axis.read() for axis in bench.axes}
        met.append(
            Sample(time=bench.clock.now(), force=bench.load_cell.read(), frames=bench.tracker.read(), **states)
        )  # fmt: skip
        assert bench.tracker.read() == ()
        bench.translation.move(met[-1].force.tension)
        assert (playback.command, playback.state) == (COMMAND, State.RUNNING)
    assert list(map(bits, met)) == [bits(sample) for sample, *_ in replay(record)]
    assert [each[1] for each in playback.commands] == [each.force.tension for each in SAMPLES]
    assert np.isnan([each[0] for each in playback.commands]).all()
    with pytest.raises(DeviceError, match="at its end"):
        bench.clock.wait_until(0.0)
    bench.close()


def test_an_empty_record_plays_nothing(tmp_path):
    Recorder(tmp_path / "empty.rec", {}).close()
    with pytest.raises(InvalidInput, match="one or more samples"):
        replay_bench(read_record(tmp_path / "empty.rec"))


def test_commands_come_back_with_their_samples(record):
    assert {bits(command) for _, command, _, _ in replay(record)} == {bits(COMMAND)}
    assert [fault for *_, fault in replay(record)] == [FAULT if i > 380 else None for i in range(N)]
    assert bits(Command()) != bits(COMMAND)
