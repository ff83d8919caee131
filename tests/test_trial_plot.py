"""The figure of a trial: frames that stand alone are found, turning points and stairs are not; no label hides data."""

import numpy as np
import pytest

from measurement.known_bench import along, blank
from measurement.trials import some_trial
from tendonrod.plot.trials import suspect, trial_figure


def recorded(path, noise=0.0, seed=0):
    """A trial of one tracker that moves along x as ``path`` (n,) says, in mm."""
    path = np.asarray(path, dtype=float)
    position = np.random.default_rng(seed).normal(scale=1e-3 * max(noise, 1e-12), size=(path.size, 1, 3))
    position[:, 0, 0] += 1e-3 * path
    return blank(np.full(path.size, 0.3), along([1.0]), position=position)


RISE = np.linspace(0.0, 20.0, 20)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.5])
@pytest.mark.parametrize(
    "path", [RISE, np.r_[RISE, RISE[::-1]], np.repeat([0.0, 5.0, 9.0, 3.0], 8), 5.0 * np.sin(RISE)]
)
def test_what_moves_is_not_suspect(path, noise):
    assert not suspect(recorded(path, noise)).any()


@pytest.mark.parametrize("at", [5, 13, 30])
def test_a_frame_that_stands_alone_is_and_its_neighbours_are_not(at):
    path = np.r_[RISE, RISE[::-1]]
    path[at] += 15.0
    assert np.flatnonzero(suspect(recorded(path, 0.3))[:, 0]).tolist() == [at]


def test_few_frames_say_nothing():
    assert not suspect(recorded([0.0, 50.0, 0.0, 0.0])).any()


def test_no_number_lies_on_another_panel():
    """Labels of a panel keep off the data of the others, and titles off the legend."""
    figure = trial_figure(some_trial())
    figure.canvas.draw()
    boxes = [axes.get_window_extent() for axes in figure.axes]
    legend = next(iter(figure.legends)).get_window_extent()
    for k, axes in enumerate(figure.axes):
        (low, high), numbers = axes.get_ylim(), axes.get_yticklabels()
        shown = [*(each for each in numbers if low <= each.get_position()[1] <= high), *axes.get_xticklabels()]
        for text in [*shown, axes.yaxis.label, axes.xaxis.label, axes.title]:
            if not text.get_visible() or not text.get_text():
                continue
            box = text.get_window_extent()
            assert not any(box.overlaps(other) for i, other in enumerate(boxes) if i != k), text.get_text()
            assert not box.overlaps(legend), text.get_text()
