"""Tasks on a plant of springs and integrators: they finish, keep to limits and profile, and fail by name."""

from itertools import pairwise
from math import inf, nan, pi

import numpy as np
import pytest

from rig.small_plant import SmallPlant
from tendonrod.errors import InvalidInput
from tendonrod.rig.drives import Machine, TaskFailed, full_turn
from tendonrod.rig.interfaces import STILL, AxisLimits, Force
from tendonrod.rig.profiles import EVEN, PAPER, Cubics, Polynomial, Profile
from tendonrod.rig.tasks import FollowLeader, Phase, Progressive, Retract, TensionHold

L = 0.0754566
MACHINE = Machine(
    length=L,
    turns=1.0,
    screw=AxisLimits(low=-20e-3, high=100e-3, speed=3e-3, acceleration=20e-3),
    translation=AxisLimits(low=0.0, high=L, speed=5e-3, acceleration=50e-3),
    rotation=AxisLimits(low=-3 * pi, high=pi, speed=2.0, acceleration=10.0),
)
PLAN = Profile(
    name="plan",
    tension=Cubics([0.05, 0.4, 1.0], [0.669, 0.682, 0.7]),
    rotation=Cubics([0.05, 0.5, 1.0], [0.0, 0.02, 0.0]),
    paid_out=Polynomial((0.974, 0.0)),
)


def inserted(**options) -> tuple[SmallPlant, FollowLeader]:
    task = FollowLeader(PLAN, MACHINE, screw_rate=2e-3, **options)
    return SmallPlant(slack=-1e-3).run(task, 120.0), task


def of_phase(plant: SmallPlant, phase: Phase):
    return [(sample, command) for sample, command, each in plant.trace if each is phase]


@pytest.mark.parametrize("feed_forward", [False, True])
def test_follow_the_leader_comes_to_the_end_on_its_profile(feed_forward):
    plant, task = inserted(controller=MACHINE.controller(feed_forward=feed_forward))
    assert isinstance(task.name, str)
    assert task.is_done
    assert task.progress == 1.0
    assert plant.z == pytest.approx(L, abs=25e-6)
    assert plant.tension == pytest.approx(0.7, abs=0.02)
    assert plant.phi == pytest.approx(0.0, abs=2e-3)
    going = of_phase(plant, Phase.INSERT)
    errors = [command.target - sample.force.tension for sample, command in going]
    assert max(map(abs, errors)) < (0.025 if feed_forward else 2e-3 * 0.974 / 50e-3)
    for sample, command in going:
        assert command.target == PLAN.tension.value(sample.translation.position / L)
    insertion = np.array([sample.translation.position / L for sample, _ in going])
    turned = np.array([sample.rotation.position for sample, _ in going])
    wanted = [MACHINE.turn(eta, PLAN.rotation.value(eta)) for eta in insertion.tolist()]
    assert np.abs(turned - wanted).max() < 0.02


def test_the_screw_pays_out_at_its_steady_rate():
    plant, _ = inserted()
    rates = np.array([command.screw for _, command in of_phase(plant, Phase.INSERT)])
    assert np.median(rates) == 2e-3
    assert 0.0 <= rates.min() <= rates.max() <= 2e-3
    assert np.abs(np.diff(rates)).max() <= 2e-3 * 5e-3 * (1 + 1e-9)  # eased over a second: no jump, from zero


def test_phases_follow_each_other_and_the_tendon_is_taken_up_before_insertion():
    plant, _ = inserted()
    phases = list(dict.fromkeys(phase for *_, phase in plant.trace))
    assert phases == [Phase.START, Phase.TAKE_UP, Phase.INSERT, Phase.SETTLE]
    first = of_phase(plant, Phase.INSERT)[0][0]
    assert first.translation.position == pytest.approx(0.05 * L, abs=25e-6)
    assert first.force.tension == pytest.approx(0.669, abs=0.021)
    assert all(sample.force.tension == 0.0 for sample, _ in of_phase(plant, Phase.START))


def test_no_task_leaves_the_limits():
    plant, _ = inserted()
    retract = Retract(PLAN, MACHINE, screw_rate=2e-3)
    plant.run(retract, 300.0)
    assert retract.is_done
    commands = [command for _, command, _ in plant.trace]
    samples = [sample for sample, _, _ in plant.trace]
    for name in ("screw", "translation", "rotation"):
        limits, speeds = getattr(MACHINE, name), np.array([getattr(command, name) for command in commands])
        positions = np.array([getattr(sample, name).position for sample in samples])
        assert np.abs(speeds).max() <= limits.speed
        assert limits.low - 1e-9 <= positions.min() <= positions.max() <= limits.high + 1e-9


def test_retraction_goes_back_along_the_profile_and_ends_slack():
    plant, _ = inserted()
    count = len(plant.trace)
    task = Retract(PLAN, MACHINE, screw_rate=2e-3)
    plant.run(task, 300.0)
    assert task.is_done
    back = plant.trace[count:]
    assert list(dict.fromkeys(phase for *_, phase in back)) == [Phase.TAKE_UP, Phase.RETRACT, Phase.RELEASE]
    assert plant.z == pytest.approx(0.05 * L, abs=1e-4)
    assert plant.tension <= 0.02
    errors = [command.target - sample.force.tension for sample, command, phase in back if phase is Phase.RETRACT]
    assert max(map(abs, errors)) < 2e-3 / 50e-3
    shares = [sample.translation.position for sample, _, phase in back if phase is Phase.RETRACT]
    assert all(b <= a + 1e-4 for a, b in pairwise(shares))


def test_progress_runs_from_0_to_1():
    task, plant, seen = FollowLeader(PLAN, MACHINE), SmallPlant(), []
    while not task.is_done and plant.time < 200:
        plant.move(task.update(plant.sample(), 5e-3), 5e-3)
        seen.append(task.progress)
    assert seen[0] == 0.0
    assert seen[-1] == 1.0
    assert all(b >= a - 0.01 for a, b in pairwise(seen))
    assert task.update(plant.sample(), 5e-3) is STILL


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_the_rate_of_the_loop_does_not_change_the_motion(rate):
    task = FollowLeader(PLAN, MACHINE, screw_rate=3e-3)
    plant = SmallPlant(z=0.05 * L, x=0.05 * L).run(task, 120.0, rate)
    assert task.is_done
    assert plant.time == pytest.approx(33.3, abs=0.7)


def test_the_papers_profile_is_followed_too():
    profile = Profile(name="paper", tension=Polynomial(PAPER), paid_out=EVEN)
    plant = SmallPlant().run(task := FollowLeader(profile, MACHINE, screw_rate=2e-3), 120.0)
    assert task.is_done
    assert plant.tension == pytest.approx(0.7421, abs=0.02)


def test_a_tendon_that_is_not_there_is_found():
    plant = SmallPlant(is_broken=True)
    with pytest.raises(TaskFailed, match="is the tendon attached"):
        plant.run(FollowLeader(PLAN, MACHINE), 120.0)
    assert abs(plant.x) < 15e-3


def test_a_tendon_that_breaks_ends_the_insertion():
    plant, task = SmallPlant(), FollowLeader(PLAN, MACHINE, screw_rate=2e-3)
    while task.phase is not Phase.INSERT or plant.z < 0.5 * L:
        plant.move(task.update(plant.sample(), 5e-3), 5e-3)
    plant.is_broken, z = True, plant.z
    with pytest.raises(TaskFailed, match="off its target"):
        plant.run(task, plant.time + 10.0)
    assert plant.z - z < 5e-3 * 0.6


@pytest.mark.parametrize("axis", ["screw", "translation"])
def test_a_tension_is_held_for_as_long_as_asked(axis):
    plant = SmallPlant(z=0.02, x=0.02, slack=-5e-4)
    task = TensionHold(0.5, 3.0, MACHINE, axis=axis)
    plant.run(task, 60.0)
    assert task.is_done
    assert plant.tension == pytest.approx(0.5, abs=5e-3)
    held = of_phase(plant, Phase.HOLD)
    assert len(held) == pytest.approx(600, abs=1)
    still = [command.translation if axis == "screw" else command.screw for _, command in held]
    assert max(map(abs, still)) < 1e-9


def test_progressive_motion_passes_its_points_in_time():
    time, eta, phi = [0.0, 20.0, 30.0, 50.0], [0.1, 0.6, 0.6, 0.3], [0.0, 0.0, 0.5, 0.0]
    task = Progressive(eta, [0.2, 0.6, 0.4, 0.3], MACHINE, rotation=phi, time=time)
    plant = SmallPlant().run(task, 200.0)
    assert task.is_done
    follow = of_phase(plant, Phase.FOLLOW)
    start = follow[0][0].time
    for at, insertion, rotation in zip(time, eta, phi, strict=True):
        sample = min(follow, key=lambda each: abs(each[0].time - start - at - 0.125))[0]
        assert sample.translation.position == pytest.approx(insertion * L, abs=2e-4)
        assert sample.rotation.position == pytest.approx(MACHINE.turn(insertion, rotation), abs=0.02)
    assert max(abs(command.target - sample.force.tension) for sample, command in follow) < 0.04
    assert plant.tension == pytest.approx(0.3, abs=0.02)


def test_progressive_motion_without_times_keeps_to_the_speeds(tmp_path):
    file = tmp_path / "motion.csv"
    file.write_text("insertion,tension_N,rotation_deg\n0.1,0.3,0\n0.8,0.6,0\n0.8,0.6,30\n0.2,0.6,30\n")
    plant = SmallPlant().run(task := Progressive.read(file, MACHINE), 600.0)
    assert task.is_done
    speeds = [abs(command.translation) for _, command in of_phase(plant, Phase.FOLLOW)]
    assert 1e-3 < max(speeds) < 3e-3
    assert plant.phi == pytest.approx(MACHINE.turn(0.2, pi / 6), abs=5e-3)


def test_progressive_motion_waits_for_its_tension_but_not_for_ever():
    task = Progressive([0.5, 0.9], [0.5, 0.5], MACHINE, time=[0.0, 10.0])
    plant = SmallPlant()
    while task.phase is not Phase.FOLLOW:
        plant.move(task.update(plant.sample(), 5e-3), 5e-3)
    plant.is_broken, z = True, plant.z
    with pytest.raises(TaskFailed, match="wanted"):
        plant.run(task, 100.0)
    assert plant.z - z < 1e-3


def test_missing_readings_move_nothing_for_long():
    plant, task = SmallPlant(), FollowLeader(PLAN, MACHINE, screw_rate=2e-3)
    while task.phase is not Phase.INSERT or plant.z < 0.5 * L:
        plant.move(task.update(plant.sample(), 5e-3), 5e-3)
    sample = plant.sample()
    blind = type(sample)(
        time=sample.time, screw=sample.screw, translation=sample.translation, rotation=sample.rotation,
        force=Force(time=sample.time, tension=nan),
    )  # fmt: skip
    velocities = [task.update(blind, 5e-3).translation for _ in range(100)]
    assert velocities[-1] == 0.0


def test_a_robot_that_is_out_keeps_the_turn_it_has():
    machine = Machine(length=L, turns=1.0, screw=MACHINE.screw, translation=MACHINE.translation)
    for z, goal in ((0.5 * L, pi), (0.0, -1.9 * pi)):
        task, plant = FollowLeader(PLAN, machine), SmallPlant(z=z, x=z, phi=3.0)
        while task.phase is not Phase.INSERT:
            plant.move(task.update(plant.sample(), 5e-3), 5e-3)
        assert plant.phi == pytest.approx(goal, abs=0.03)


@pytest.mark.parametrize(("angle", "expected"), [(0.0, 0.0), (-4.0, 0.0), (40.0, 0.0), (-40.0, 0.0)])
def test_full_turns_keep_to_the_travel(angle, expected):
    assert full_turn(angle, (-6.0, 0.0), AxisLimits(low=-3 * pi, high=pi)) == expected
    assert abs(full_turn(angle, (-6.0, 0.0), AxisLimits()) - 6.0 - angle) <= pi
    with pytest.raises(TaskFailed, match="its travel is"):
        full_turn(angle, (-6.0, 6.0), AxisLimits(low=-3.0, high=3.0))


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: FollowLeader(PLAN, MACHINE, screw_rate=4e-3), "screw_rate"),
        (lambda: FollowLeader(PLAN, MACHINE, screw_rate=2e-3, controller=MACHINE.controller(limit=1e-3)), "screw_rate"),
        (lambda: FollowLeader(PLAN, MACHINE, start=0.9, end=0.5), "start"),
        (lambda: Retract(PLAN, MACHINE, end=-0.1), "end"),
        (lambda: TensionHold(-0.1, 1.0, MACHINE), "tension"),
        (lambda: TensionHold(0.1, 0.0, MACHINE), "duration"),
        (lambda: TensionHold(0.1, 1.0, MACHINE, axis="rotation"), "axis"),
        (lambda: Progressive([0.1, 1.2], [0.1, 0.1], MACHINE), "row 2: insertion"),
        (lambda: Progressive([0.1, 0.2], [0.1, 0.1], MACHINE, time=[1.0, 1.0]), "time"),
        (lambda: Progressive([0.1, 0.2], [0.1], MACHINE), "insertion, rotation, tension"),
        (lambda: Machine(length=inf), "length"),
    ],
)
def test_bad_tasks_are_refused_by_name(make, field):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.field == field
