"""Figures of bench trials: what is drawn is what was recorded, and trials that agree are all to be seen."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendonrod import load_robot
from tendonrod.plot import bench, bench_space
from tendonrod.plot.bench_lines import binned, look, named, not_yet, span_of
from tendonrod.rig.inserted import Inserted
from tendonrod.rig.profiles import Polynomial, Profile
from tendonrod.rig.trials import Followed, reference_of

ROBOT = load_robot("exonav-1").replace(torsion="homogenized")
GRAVITY = (-9.81, 0.0, 0.0)
NAMES = ["trial 1", "trial 2", "trial 3"]
OFF = 1e-3 * np.array([[0.3, -0.2, 0.1], [0.3, -0.2, 0.1], [-0.4, 0.0, 0.2]])  # m, of each trial's tip
REFERENCE = reference_of(ROBOT, 0.7, GRAVITY)


def way(off, end=1.0, error=2e-3):
    """A trial whose tip is the reference's, ``off``, and whose tension is ``error`` below its target."""
    insertion = np.linspace(0.05, end, 2000)
    tip = REFERENCE.at(insertion * REFERENCE.s[-1]) + off
    distance = np.stack([REFERENCE.project(tip).distance, np.linalg.norm(off) + 0 * insertion], axis=1)
    return Inserted(
        time=160 * insertion, insertion=insertion, tension=0.7 - error + 0 * insertion, target=0.7 + 0 * insertion,
        tip_insertion=insertion, tip=tip, tip_error=distance, frames=insertion.size, lost=0,
    )  # fmt: skip


@pytest.fixture
def trials(monkeypatch):
    """Followed trials, and what is made of them where a figure asks for it."""

    def made(ways, robot=ROBOT, target=0.7, profile="even"):
        record: Any = SimpleNamespace(header={"setup": {"tracker": {"position_noise": 0.5e-3}}})
        given: Any = {"robot": robot, "outcome": None, "path": None, "record": record, "reference": REFERENCE}
        tension = Profile(name=profile, tension=Polynomial((0.7,)))
        found = [Followed(target=target, gravity=GRAVITY, profile=tension, **given) for _ in ways]
        by_trial = {id(each): one for each, one in zip(found, ways, strict=True)}
        for module in (bench, bench_space):
            monkeypatch.setattr(module, "inserted", lambda each: by_trial[id(each)])
        return found

    return made


def lines(axes):
    """Those of the trials."""
    return [each for each in axes.lines if each.get_label() in NAMES]


def heights(line):
    return np.asarray(line.get_ydata())


def test_a_band_holds_its_share_of_the_readings():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0.0, 1.0, 20000), rng.normal(size=20000)
    edges = np.linspace(x.min(), x.max(), 11)
    _, _, low, high = binned(x, y, 10, 0.9)
    which = np.clip(np.digitize(x, edges) - 1, 0, 9)
    for k in range(10):
        here = y[which == k]
        assert np.mean(here < low[k]) == pytest.approx(0.05, abs=1e-3)
        assert np.mean(here > high[k]) == pytest.approx(0.05, abs=1e-3)


def test_trials_on_top_of_each_other_are_told_apart_by_width():
    looks = [look(k, NAMES) for k in range(3)]
    widths = [each["lw"] for each in looks]
    assert widths == sorted(widths, reverse=True)
    assert len(set(widths)) == len({each["color"] for each in looks}) == 3
    assert [each["zorder"] for each in looks] == sorted(each["zorder"] for each in looks)  # the widest lowest
    many = [f"trial {k}" for k in range(1, 31)]
    labels = [look(k, many)["label"] for k in range(30)]
    assert labels == ["trial 1 to trial 30", *[None] * 29]
    assert (named(NAMES), named(many)) == (3, 1)


def test_insertions_before_the_start_are_shaded_and_said():
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    not_yet(axes, [way(OFF[0]), way(OFF[1])], label=True)
    (shade,) = axes.patches
    assert shade.get_extents().x1 == pytest.approx(axes.transData.transform((0.05, 0.0))[0])
    assert shade.get_label() == "η < 0.05: before the start"
    assert span_of([way(OFF[0]), way(OFF[1], end=0.4)])[1] > 1.0
    assert 0.4 < span_of([way(OFF[0], end=0.4)])[1] < 0.6


def test_the_tip_is_drawn_and_what_it_is_off_the_reference(trials):
    figure = bench.tip_figure(trials([way(off) for off in OFF]), NAMES, marks=(3.6e-3, 3.7e-3))
    places, off, (distance,) = figure.axes[:3], figure.axes[3:6], figure.axes[6:]
    for i in range(3):
        for k, each in enumerate(lines(places[i])):
            x, y = (np.asarray(data) for data in each.get_data())
            assert y == pytest.approx(1e3 * (REFERENCE.at(x * REFERENCE.s[-1]) + OFF[k])[:, i], abs=2e-3)
        assert [heights(each).mean() for each in lines(off[i])] == pytest.approx(1e3 * OFF[:, i])
        assert np.ptp(heights(lines(off[i])[0])) < 1e-9
    assert len({axes.get_ylim() for axes in off}) == 1  # one scale for all three
    assert any("3.60 to 3.70 mm" in text.get_text() for text in distance.texts)
    assert distance.get_ylim()[1] < 1.0  # what is far above does not press down what is shown
    levels = [heights(each)[0] for each in distance.lines if np.ptp(heights(each)) == 0.0]
    assert pytest.approx(0.5 * np.sqrt(2 / 3)) in levels


def test_the_tension_has_means_and_largest_errors_of_every_trial(trials):
    ways = [way(off, error=error) for off, error in zip(OFF, (2e-3, -1e-3, 0.5e-3), strict=True)]
    top, readings, means = bench.tension_figure(trials(ways), NAMES).axes
    assert [heights(each).mean() for each in lines(means)] == pytest.approx([2.0, -1.0, 0.5])
    dots = [heights(each)[0] for each in readings.lines if each.get_marker() == "o"]
    assert dots == pytest.approx([2.0, -1.0, 0.5])
    assert len(lines(top)) == 3


@pytest.mark.parametrize(
    ("robot", "target", "profile", "is_drawn"),
    [("exonav-1", 0.7, "plan", True), ("exonav-1", 0.5, "plan", False), ("exonav-3", 0.7, "plan", False),
     ("exonav-1", 0.7, "paper", False)],
)  # fmt: skip
def test_the_papers_polynomial_is_beside_its_own_case_alone(trials, robot, target, profile, is_drawn):
    found = trials([way(OFF[0])], load_robot(robot), target, profile)
    names = bench.tension_figure(found, NAMES[:1]).axes[0].get_legend_handles_labels()[1]
    assert ("the paper's polynomial" in names) is is_drawn


def test_paths_have_equal_scales_and_fill_the_width(trials):
    figure = bench_space.path_figure(trials([way(off) for off in OFF]), NAMES)
    _, *views = figure.axes
    for axes in views:
        box = axes.get_position()
        across, up = figure.get_size_inches() * (box.width, box.height)
        scales = across / np.ptp(axes.get_xlim()), up / np.ptp(axes.get_ylim())
        assert scales[0] == pytest.approx(scales[1])
        assert box.width > 0.85
        assert len(lines(axes)) == 3
