"""The linear tension loop: python-control against closed forms and a simulation, suggested gains keep what they say."""

from dataclasses import replace
from math import atan, degrees, inf, pi, sqrt

import numpy as np
import pytest

from tendonrod import load_robot
from tendonrod.errors import InvalidInput
from tendonrod.plot.loop_design import Trace, comparison_figure
from tendonrod.report.loop_design import command, design_page
from tendonrod.rig.control import KI, KP, TensionController
from tendonrod.rig.design import Loop, at_insertions, designed, largest_error, margins, suggested, with_gains

pytest.importorskip("control")

IDEAL = {"lag": 0.0, "delay": 0.0, "filter": 0.0}
ROBOT = load_robot("exonav-1").replace(torsion="homogenized")


@pytest.mark.parametrize("compliance", [0.66e-3, 1.2e-3, 3.3e-3])
@pytest.mark.parametrize("delay", [0.0, 0.0075])
def test_margins_are_those_of_the_formula_by_hand(compliance, delay):
    """|L| = 1 at w^2 = (kp^2 + sqrt(kp^4 + 4 ki^2 c^2)) / 2 c^2; phase margin atan(kp w / ki) - w delay."""
    loop = Loop(compliance=compliance, **IDEAL | {"delay": delay})
    w = sqrt((KP**2 + sqrt(KP**4 + 4 * (KI * compliance) ** 2)) / 2) / compliance
    found = margins(loop)
    assert found.crossover == pytest.approx(w, rel=1e-4)
    assert found.phase == pytest.approx(degrees(atan(KP * w / KI) - w * delay), abs=0.05)
    assert found.delay == pytest.approx(atan(KP * w / KI) / w - delay, rel=1e-3)


def test_the_gain_margin_is_where_the_phase_is_half_a_turn():
    """P control of an integrator with delay T alone: phase -90 deg - w T, so w = pi / 2T, gain margin c w / kp."""
    loop = Loop(compliance=1e-3, ki=0.0, **IDEAL | {"delay": 0.01})
    assert margins(loop).gain == pytest.approx(1e-3 * 0.5 * pi / 0.01 / KP, rel=1e-3)
    assert margins(replace(loop, delay=0.0)).gain == inf


def test_step_responses_are_those_of_the_second_order_loop():
    loop, time = Loop(compliance=3.3e-3, **IDEAL), np.linspace(0.0, 3.0, 301)
    a, b = np.roots([3.3e-3, KP, KI])
    step = 1 + (
        (KI / 3.3e-3 / a + KP / 3.3e-3) * np.exp(a * time) - (KI / 3.3e-3 / b + KP / 3.3e-3) * np.exp(b * time)
    ) / (a - b)
    screw = (np.exp(a * time) - np.exp(b * time)) / (3.3e-3 * (a - b))
    assert loop.step(time) == pytest.approx(step, abs=1e-6)
    assert loop.step(time, "screw") == pytest.approx(screw, abs=1e-6 * screw.max())
    assert np.abs(loop.step(time, "screw", 1.0)).max() < 1e-6 * screw.max()  # nothing is left without lag and delay


@pytest.mark.parametrize("compliance", [0.66e-3, 3.3e-3])
def test_the_linear_loop_is_what_the_controller_does_period_by_period(compliance):
    """Against a simulation of the sampled controller with one period of delay and the hold, lag of the actuator."""
    rate, fine, lag = 200.0, 50, 0.01
    loop = Loop(compliance=compliance, lag=lag, delay=1.5 / rate, filter=0.0)
    controller, tension, velocity, waiting, found = TensionController(limit=1e3), 0.0, 0.0, 0.0, []
    for _ in range(300):
        found.append(tension)
        command, waiting = waiting, controller.update(1.0 - tension, 1 / rate)
        for _ in range(fine):
            velocity += (command - velocity) / (rate * fine * lag)
            tension += velocity / (rate * fine * compliance)
    exact = loop.step(np.arange(600) / (2 * rate))[1::2]  # a target that steps at a sample is seen half a period early
    assert np.abs(found - exact).max() < 0.03 * exact.max()


@pytest.mark.parametrize("compliance", [0.66e-3, 3.3e-3])
def test_the_largest_error_as_the_screw_starts_is_that_of_the_formula(compliance):
    """e = rate (exp(a t) - exp(b t)) / c (a - b), largest at t = ln(b / a) / (a - b); P alone comes up to rate / kp."""
    loop, rate = Loop(compliance=compliance, **IDEAL), 0.45e-3
    a, b = np.roots([compliance, KP, KI])
    peak = np.log(b / a) / (a - b)
    exact = rate * (np.exp(a * peak) - np.exp(b * peak)) / (compliance * (a - b))
    assert largest_error(loop, rate) == pytest.approx(exact, rel=1e-4)
    assert largest_error(loop, rate) < rate / KP
    assert largest_error(replace(loop, ki=0.0), rate) == pytest.approx(rate / KP, rel=1e-4)
    assert largest_error(loop, rate, 1.0) < 1e-6 * exact
    assert largest_error(Loop(compliance=compliance), rate) > exact  # lag and delay cost


def test_damping_and_frequency_of_the_papers_gains():
    loop = Loop(compliance=3.3e-3)
    assert loop.damping == pytest.approx(1.946, abs=1e-3)
    assert loop.natural_frequency == pytest.approx(sqrt(KI / 3.3e-3))
    assert Loop(compliance=1e-3, ki=0.0).damping == inf


def test_suggested_gains_keep_margin_and_damping():
    compliances = [0.66e-3, 1.2e-3, 3.3e-3]
    best = suggested(compliances, 55.0, 1.2)
    loops = with_gains([Loop(compliance=c) for c in compliances], best.kp, best.ki)
    assert margins(loops[0]).phase == pytest.approx(55.0, abs=0.1)
    assert all(margins(loop).phase > 54.9 for loop in loops)
    assert loops[-1].damping == pytest.approx(1.2)
    assert all(loop.damping >= 1.2 - 1e-9 for loop in loops)


def test_the_loop_slows_down_as_the_robot_comes_out():
    loops = at_insertions(ROBOT, (0.05, 0.5, 1.0), 0.7, (-9.81, 0.0, 0.0), 0.51e-3)
    compliances = [loop.compliance for loop in loops]
    assert compliances == sorted(compliances)
    assert compliances[-1] == pytest.approx((2.63e-3 + 0.51e-3) / 0.974, rel=0.03)
    phases = [margins(loop).phase for loop in loops]
    assert phases == sorted(phases)


@pytest.mark.parametrize(
    ("field", "value"), [("compliance", 0.0), ("kp", -1.0), ("ki", -1.0), ("lag", -1.0), ("slope", 2000.0)]
)
def test_bad_loops_are_refused_by_name(field, value):
    with pytest.raises(InvalidInput) as caught:
        Loop(**{"compliance": 1e-3} | {field: value})
    assert caught.value.field == field


def test_errors_of_a_trace_are_means_over_time():
    time = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(1.001, 2.0, 1000)])
    trace = Trace(
        time=time, insertion=time / 2, tension=0.7 - 0.1 * (time <= 1.0), target=0.7 + 0 * time, velocity=time
    )
    assert trace.largest == pytest.approx(0.1)
    assert trace.rms == pytest.approx(0.1 * sqrt(0.5), rel=1e-2)
    assert trace.smoothed(np.ones(time.size)) == pytest.approx(1.0)
    with pytest.raises(InvalidInput, match="arrays of one length"):
        Trace(time=time, insertion=time[1:], tension=time, target=time, velocity=time)


def test_runs_that_agree_are_seen_beside_each_other():
    """Every run has a panel of its own for its readings, and a line of its own in those that all share."""
    time = np.linspace(0.0, 20.0, 2001)
    error = {"PI": 5e-3 * np.exp(-time), "PI + feed-forward": 0.0 * time}
    traces = {
        name: Trace(time=time, insertion=0.05 + time / 25, tension=0.7 - each, target=0.7 + 0 * time, velocity=time)
        for name, each in error.items()
    }
    own, other, means, early, speed = comparison_figure(traces).axes
    assert [text.get_text() for axes in (own, other) for text in axes.texts] == [
        "rms 0.8 mN, largest 5.0 mN",
        "rms 0.0 mN, largest 0.0 mN",
    ]
    for axes in (means, early, speed):
        lines = [each for each in axes.lines if each.get_label() in traces]
        assert [each.get_label() for each in lines] == list(traces)
        assert lines[0].get_linewidth() > lines[1].get_linewidth()  # the first is seen below the second
    x, y = (np.asarray(each) for each in early.lines[0].get_data())
    inside = (x > 0.2) & (x < 5.0)
    assert y[inside] == pytest.approx(5.0 * np.exp(-x[inside]), rel=0.02)
    for wrong in ({}, dict.fromkeys("abcde", traces["PI"])):
        with pytest.raises(InvalidInput, match="traces"):
            comparison_figure(wrong)


def test_the_page_says_what_it_assumes_and_how_its_gains_are_used(tmp_path):
    found = designed(ROBOT, 0.7, (-9.81, 0.0, 0.0), insertions=(1.0, 0.05))
    assert found.insertions == (0.05, 1.0)
    page = design_page(tmp_path / "page", found, 0.45e-3, source="exonav-1")
    text = " ".join(page.read_text().split())
    told = command(found, "exonav-1")
    kp, ki = (float(told.split(name)[1].split()[0]) for name in ("--kp", "--ki"))
    assert (kp, ki) == pytest.approx([1e3 * each for each in found.gains], rel=5e-3)
    for said in ("torsion model homogenized", "10.0 ms", "gravity (−9.81, 0, 0) m/s²", "tendon of 0.51 mm/N", told):
        assert said in text, said
    for name in ("loop", "margins", "steps"):
        assert (page.parent / f"{name}.svg").exists()
        assert (page.parent / f"{name}.png").exists()
    first = (page.parent / "margins-paper.csv").read_text().splitlines()[1].split(",")
    assert float(first[0]) == 0.05
    assert float(first[1]) == pytest.approx(0.657, abs=1e-3)
    worst = 1e3 * max(largest_error(loop, 0.45e-3) for loop in found.paper)
    assert float(first[-1]) == pytest.approx(worst)
    assert f"{worst:.1f} mN with the paper’s" in text
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="out"):
        design_page(tmp_path / "file", found)


def test_the_command_prints_gains_and_margins_as_json(result, tmp_path, monkeypatch):
    monkeypatch.setattr("tendonrod.report.loop_design.design_page", lambda out, *_, **__: out / "index.html")
    told = result("rig", "design", "exonav-3", "--tension", "1", "--torsion", "published", "--output", tmp_path / "o")
    assert (told["robot"], told["torsion"], told["tension"]) == ("exonav-3", "published", 1.0)
    assert (told["paper"]["kp"], told["paper"]["ki"]) == (KP, KI)
    shortest, longest = (told["suggested"]["loops"][k] for k in (0, -1))
    assert (shortest["insertion"], longest["insertion"]) == (0.05, 1.0)
    assert shortest["phase"] == pytest.approx(60.0, abs=0.1)
    assert 0.5 * told["suggested"]["kp"] / sqrt(told["suggested"]["ki"] * longest["compliance"]) == pytest.approx(1.0)
    assert "ftl exonav-3 --torsion published --target 1 --kp" in told["command"]


def test_the_command_takes_no_tension_that_the_bench_refuses(refused, tmp_path):
    design = refused("rig", "design", "exonav-3", "--tension", "5", "--output", tmp_path / "o")
    trial = refused("rig", "ftl", "exonav-3", "--target", "5", "--output", tmp_path / "o")
    assert design.startswith("--tension = 5 N: must be at most ")
    assert design.removeprefix("--tension") == trial.removeprefix("--target")
    assert not (tmp_path / "o").exists()
