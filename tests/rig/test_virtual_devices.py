"""Axes, load cell, tracker, clock and injected faults of the virtual bench."""

import time
from dataclasses import asdict, replace
from math import pi

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tendonrod import InvalidInput
from tendonrod.rig.interfaces import Axis, Clock, DeviceError, LoadCell, PoseTracker
from tendonrod.rig.virtual.axes import Drive
from tendonrod.rig.virtual.bench import virtual_bench
from tendonrod.rig.virtual.injection import Injection, InjectionKind
from tendonrod.rig.virtual.sensors import quaternion_of
from tendonrod.rig.virtual.setup import LoadCellModel, TrackerModel, lead_screw, roller_rotation, roller_translation
from virtual_setups import DOWN, PERFECT, QUIET_CELL, QUIET_TRACKER, drive, ideal, pull_to, usual, with_faults


def test_devices_are_what_the_interfaces_ask_for():
    bench = virtual_bench(usual(), 0)
    assert all(isinstance(axis, Axis) for axis in bench.axes)
    assert isinstance(bench.load_cell, LoadCell)
    assert isinstance(bench.tracker, PoseTracker)
    assert isinstance(bench.clock, Clock)
    bench.close()


def test_torsion_is_said():
    assert "torsion homogenized" in virtual_bench(usual(), 0).name


def everything(seed: int, **changes) -> list:
    """All that a program sees, and the truth, over a second of motion."""
    bench, seen = virtual_bench(usual(**changes), seed), []
    for k in range(200):
        for axis, speed in zip(bench.axes, (-0.3e-3, 1e-3 * np.sin(0.1 * k), 0.2), strict=True):
            axis.move(speed)
        bench.clock.wait_until(0.005 * (k + 1))
        assert bench.tracker is not None
        seen.append([axis.read() for axis in bench.axes] + [bench.load_cell.read(), bench.world.truth])
        seen += [asdict(frame) for frame in bench.tracker.read()]
    return seen


def test_same_setup_and_seed_give_the_same_bits():
    assert repr(everything(3)) == repr(everything(3))
    assert repr(everything(3)) != repr(everything(4))


def test_drives_move_alike_however_often_they_are_asked():
    once, often = (Drive(roller_translation(start=0.01), 1.0) for _ in range(2))
    for each in (once, often):
        each.command(3e-3, 0.0)
    once.advance(0.0, 0.5, False, None, False)
    for k in range(100):
        often.advance(5e-3 * k, 5e-3, False, None, False)
    assert often.motor == pytest.approx(once.motor, abs=1e-12)
    ramp = 3e-3 / 50e-3
    assert once.motor - 0.01 == pytest.approx(3e-3 * (0.5 - 0.5 * ramp), abs=1e-12)


def test_speed_acceleration_and_hard_stops_bound_a_drive():
    model = replace(roller_translation(start=0.108), **PERFECT)
    drive_, speeds = Drive(model, 1.0), [0.0]
    drive_.command(1.0, 0.0)
    for k in range(200):
        drive_.advance(1e-3 * k, 1e-3, False, None, False)
        speeds.append(drive_.velocity)
    assert max(speeds) <= model.speed
    assert np.diff(speeds).max() <= 1e-3 * model.acceleration * (1 + 1e-9)
    drive_.command(1.0, 0.2)
    drive_.advance(0.2, 0.9, False, None, False)
    assert (drive_.motor, drive_.velocity, drive_.stop) == (model.high, 0.0, 1)


def test_play_is_lost_at_every_turn_unless_a_taut_tendon_presses():
    for name, model in (("free", roller_rotation()), ("low", roller_translation(start=0.05))):
        lag = []
        for pressed in (False, True):
            motion = Drive(model, 100.0)
            for sign in (1.0, -1.0):
                motion.command(sign * 0.5 * model.speed, motion.told_at)
                motion.advance(0.0, 1.0, False, None, pressed)
                lag.append(motion.motor - motion.load)
        half = 0.5 * model.backlash
        expected = [half, -half, *([half, -half] if name == "free" else [half, half])]
        assert lag == pytest.approx(expected, abs=1e-12)


def test_encoders_count_from_switching_on_until_homed():
    setup = usual(rotation=roller_rotation(start=0.7))
    bench = virtual_bench(setup, 5)
    assert bench.rotation.read().position == 0.0
    assert not bench.rotation.read().homed
    bench.rotation.home()
    assert bench.rotation.read().homed
    assert bench.clock.now() > 0.5
    drive(bench, 1.0, rotation=0.5)
    truth, read = bench.world.drives["rotation"].motor, bench.rotation.read().position
    assert read == pytest.approx(truth, abs=4.0 * setup.rotation.home_error)
    count = setup.rotation.resolution
    assert read / count == pytest.approx(round(read / count), abs=1e-6)


def test_homing_a_stalled_axis_ends_with_an_error():
    faults = Injection(kind=InjectionKind.STALL, time=0.0, where="rotation")
    bench = virtual_bench(with_faults(usual(rotation=roller_rotation(start=0.7)), faults), 5)
    with pytest.raises(DeviceError, match="rotation"):
        bench.rotation.home()


def test_axes_stop_by_themselves_when_commands_stay_away():
    bench = virtual_bench(ideal(0.5), 0)
    drive(bench, 0.2, translation=2e-3)
    bench.clock.wait_until(bench.clock.now() + 0.08)
    assert bench.translation.read().velocity == pytest.approx(2e-3)
    bench.clock.wait_until(bench.clock.now() + 0.05)
    assert bench.translation.read().velocity == 0.0


def test_motion_is_never_begun_by_what_is_no_number():
    bench = virtual_bench(ideal(0.5), 0)
    for speed in (float("nan"), float("inf"), "fast"):
        with pytest.raises(InvalidInput, match="velocity"):
            bench.screw.move(speed)  # pyright: ignore[reportArgumentType]
    bench.clock.wait_until(0.05)
    assert bench.screw.read().velocity == 0.0


def test_noise_zero_and_counts_of_the_load_cell():
    cell = LoadCellModel(noise=5e-3, drift=0.0, zero=0.02, resolution=1e-3)
    bench = virtual_bench(ideal(0.5, load_cell=cell, tracker=None), 11)
    readings = []
    for k in range(4000):
        bench.clock.wait_until(1e-3 * (k + 1))
        readings.append(bench.load_cell.read().tension)
        assert bench.load_cell.read().tension == readings[-1]  # no new reading yet
    noise = np.array(readings) - 0.02 - bench.world.tension
    assert abs(noise.mean()) < 4.0 * 5e-3 / 4000**0.5
    assert noise.std() == pytest.approx(5e-3, rel=0.05)
    assert abs(np.corrcoef(noise[:-1], noise[1:])[0, 1]) < 0.06
    assert np.allclose(np.array(readings) / 1e-3, np.round(np.array(readings) / 1e-3), atol=1e-6)


def test_drift_grows_with_the_square_root_of_time():
    ends = []
    for seed in range(150):
        bench = virtual_bench(ideal(0.5, tracker=None, load_cell=replace(QUIET_CELL, drift=1e-3)), seed)
        for t in (0.01, 0.1, 0.25):
            bench.clock.wait_until(t)
            reading = bench.load_cell.read().tension
        ends.append(reading)
    assert np.std(ends) == pytest.approx(1e-3 * 0.25**0.5, rel=0.2)


def test_the_amplifier_smooths_a_jump():
    breaks = Injection(kind=InjectionKind.TENDON_BREAK, time=3.0)
    bench = virtual_bench(with_faults(ideal(0.6), breaks), 0)
    pull_to(bench, 0.5)
    drive(bench, 3.0 - bench.clock.now())
    before = bench.load_cell.read().tension
    drive(bench, 1.0 / (2.0 * pi * 100.0), period=1e-4)
    assert bench.world.tension == 0.0
    assert bench.load_cell.read().tension == pytest.approx(before * np.exp(-1.0), rel=0.1)
    drive(bench, 0.1)
    assert bench.load_cell.read().tension == pytest.approx(0.0, abs=1e-6)


def frames_of(tracker: TrackerModel, seconds: float, poll: float = 0.01) -> list:
    """(time of arrival, to ``poll``, s; frame) of a robot at rest."""
    bench, found = virtual_bench(ideal(0.8, gravity=DOWN, tracker=tracker), 2), []
    assert bench.tracker is not None
    for k in range(round(seconds / poll)):
        bench.clock.wait_until(poll * (k + 1))
        found += [(bench.clock.now(), frame) for frame in bench.tracker.read()]
    return found


def test_frames_come_at_their_rate_after_their_delay_and_in_order():
    found = frames_of(QUIET_TRACKER, 5.0, 1e-3)
    numbers = [frame.frame for _, frame in found]
    assert numbers == list(range(len(found)))
    assert len(found) == pytest.approx(5.0 * 40.0, abs=3)
    taken = np.array([at for at, _ in found]) - np.arange(len(found)) / 40.0  # phase + delay
    spread = taken - taken.min()
    assert 0.018 < spread.max() <= 0.0265
    stamped = np.array([frame.time for _, frame in found])
    assert np.abs(np.diff(stamped) - 0.025).max() < 0.026
    assert all(0.0 <= at - frame.time - 0.0375 < 1.1e-3 for at, frame in found if frame.time > 0.0)


def test_frames_show_the_sensor_with_its_noise():
    offset, turn = (1e-3, 2e-3, 3e-3), (0.1, 0.2, -0.3)
    noisy = TrackerModel(burst_rate=0.0, offset=offset, turn=turn)
    quiet = replace(noisy, position_noise=0.0, orientation_noise=0.0)
    frame = frames_of(quiet, 0.2)[0][1]
    axis, R = virtual_bench(ideal(0.8, gravity=DOWN, tracker=quiet), 0).world.tip()
    assert frame.position == pytest.approx(axis + R @ offset, abs=1e-12)
    true = Rotation.from_matrix(R) * Rotation.from_rotvec(turn)
    assert (Rotation.from_quat(frame.quaternion, scalar_first=True).inv() * true).magnitude() < 1e-9
    found = [each for _, each in frames_of(noisy, 20.0)]
    off = np.linalg.norm(np.array([each.position for each in found]) - frame.position, axis=1)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(0.5e-3, rel=0.1)
    turned = Rotation.from_quat([each.quaternion for each in found], scalar_first=True).inv() * true
    assert np.degrees(np.sqrt(np.mean(turned.magnitude() ** 2))) == pytest.approx(0.3, rel=0.1)


def test_the_trackers_field_may_stand_elsewhere():
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec([0.3, -0.5, 1.0]).as_matrix(), (0.1, 0.2, -0.3)
    there = frames_of(replace(QUIET_TRACKER, T_world_field=tuple(map(tuple, T.tolist()))), 0.2)[0][1]
    world = frames_of(QUIET_TRACKER, 0.2)[0][1]
    assert T[:3, :3] @ there.position + T[:3, 3] == pytest.approx(world.position, abs=1e-12)


def test_frames_are_lost_in_bursts():
    found = [frame for _, frame in frames_of(replace(QUIET_TRACKER, burst_rate=1.0, burst_length=0.2), 60.0)]
    lost = np.array([frame.is_lost for frame in found])
    assert all((frame.state == "missing") == frame.is_lost for frame in found)
    starts = int((np.diff(lost.astype(int)) == 1).sum())
    assert lost.sum() / starts / 40.0 == pytest.approx(0.2, rel=0.35)  # mean length, s
    assert starts / ((~lost).sum() / 40.0) == pytest.approx(1.0, rel=0.35)  # per second of sight


def test_quaternions_of_any_rotation():
    for R in Rotation.random(200, random_state=1):
        assert Rotation.from_quat(quaternion_of(R.as_matrix()), scalar_first=True).approx_equal(R, 1e-9)
    for axis in np.eye(3):
        half = Rotation.from_rotvec(pi * axis)
        assert Rotation.from_quat(quaternion_of(half.as_matrix()), scalar_first=True).approx_equal(half, 1e-9)


def test_real_time_is_real_and_the_watchdog_runs_without_being_asked():
    bench = virtual_bench(ideal(0.5, tracker=QUIET_TRACKER, screw=lead_screw(start=0.03)), 0, real_time=True)
    bench.translation.move(1e-3)
    start = time.perf_counter()
    bench.clock.wait_until(bench.clock.now() + 0.05)
    assert time.perf_counter() - start >= 0.05
    time.sleep(0.2)
    state = bench.translation.read()
    assert state.velocity == 0.0
    assert state.time >= 0.25
    before = bench.clock.now()
    assert bench.clock.now() >= before
    assert bench.tracker is not None
    assert len(bench.tracker.read()) >= 5
