"""Figures of a session: a course tells what its snapshots say, cuts are true, a movie shows what was drawn."""

import io
from dataclasses import replace
from itertools import combinations
from typing import Any, cast

import numpy as np
import pytest
import trimesh

from recorded_session import MOVES, STEP, recorded
from tendonrod import InvalidInput
from tendonrod.plot import navigation_movie
from tendonrod.plot.course import SPARE, Taker, course, tip_angle
from tendonrod.plot.eye import Eye, picture
from tendonrod.plot.navigation import extremes, lines_figure, map_figure, scenes_figure, spans
from tendonrod.plot.navigation_scene import runs
from tendonrod.plot.slices import cut, outlines, part
from tendonrod.surface import Sphere


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("records") / "session.jsonl")


@pytest.fixture(scope="module")
def found(session):
    scenario, snapshots = session
    return course(snapshots, scenario, frames=12)


def area(ring):
    """Signed, by the shoelace formula."""
    return 0.5 * float(np.sum(ring[:-1, 0] * ring[1:, 1] - ring[1:, 0] * ring[:-1, 1]))


def mesh(solid):
    return np.array(solid.vertices), np.array(solid.faces)


def test_a_course_tells_what_its_snapshots_say(session, found):
    _, snapshots = session
    assert np.array_equal(found.time, [each.time for each in snapshots])
    assert np.array_equal(found.tension[:, 0], [each.tension[0] for each in snapshots])
    for name, gap in found.clearance.items():
        assert np.array_equal(gap, [each.clearance[name].min() for each in snapshots])
    assert np.array_equal(found.pressure, [each.limits["pressure"].value for each in snapshots])
    assert np.array_equal(found.blocked, [each.blocked != "" for each in snapshots])
    out = found.exposed > 0.0
    assert np.isnan(found.tip[~out]).all()
    assert np.array_equal(found.tip[out], [each.tip for each in snapshots if each.exposed > 0.0])


def test_snapshots_pass_by_untouched_and_are_not_kept(session):
    scenario, snapshots = session
    taker = Taker(scenario, frames=2)
    assert all(a is b for a, b in zip(taker.passing(iter(snapshots)), snapshots, strict=True))
    kept = taker.course()
    assert [each.index for each in kept.frames] == [snapshots[0].index, snapshots[-1].index]
    with pytest.raises(InvalidInput, match="snapshots = none"):
        course([], scenario)
    with pytest.raises(InvalidInput, match="frames"):
        Taker(scenario, frames=1)


def test_memory_is_bounded_however_long_a_session_is(session):
    scenario, snapshots = session
    taker = Taker(scenario, frames=3)
    for k in range(400):
        far = snapshots[25 + k % 2]
        taker._take(replace(far, index=k, time=0.1 * k))
    assert len(taker._frames) <= SPARE * 3 + 1
    assert len(taker.course().frames) <= 3


def test_frames_are_even_over_the_time_in_which_something_moved(session, found):
    """The rest before the insertion lasts as long as any frames would; none of them shows it."""
    moving = [b for a, b in zip(session[1], session[1][1:], strict=False) if a.posture != b.posture]
    places = [moving.index(each) for each in found.frames[1:]]
    assert len(found.frames) == 12
    assert np.ptp(np.diff(places)) <= 1
    resting = [k for k, each in enumerate(found.frames) if each.time == pytest.approx((MOVES[0][1] + 3) * STEP)]
    assert not resting


def test_the_story_is_told_in_order(session, found):
    assert [each.letter for each in found.moments] == list("abcdef")[: len(found.moments)]
    indices = [each.snapshot.index for each in found.moments]
    assert indices == sorted(set(indices))
    assert found.moments[-1].snapshot is session[1][-1]
    beside = next(each for each in found.moments if "right of the cord" in each.title)
    assert abs(np.degrees(tip_angle(beside.snapshot.tip)) - 90.0) <= 8.0
    for name, time in found.reached:
        first = next(each for each in session[1] if name in each.reached)
        assert first.time == time


def test_the_highest_pressure_is_told_where_it_was(found):
    (peak,) = (each for each in found.moments if "highest pressure" in each.title)
    assert peak.snapshot.limits["pressure"].value > 0.9 * found.pressure.max()


def test_the_map_s_legend_covers_no_label(found):
    figure = map_figure(found)
    figure.canvas.draw()
    (axes,) = figure.axes
    box = axes.get_legend().get_window_extent()
    assert not any(box.overlaps(each.get_window_extent()) for each in axes.texts if each.get_text())


def test_warnings_are_told_once_with_their_time(session, found):
    for code, text, severity, first, seconds in found.warnings:
        said = [each for each in session[1] if code in [w.code for w in each.warnings]]
        assert first == said[0].time
        assert seconds == pytest.approx(STEP * len(said))
        assert (text, severity) in [(w.text, w.severity) for w in said[0].warnings]
    assert {each[0] for each in found.warnings} >= {"pressure"}


def test_outlines_of_a_pipe_enclose_its_cross_section():
    """The hole runs the other way round: signed areas add up. A polygon of n corners has n/2 sin(2 pi/n) r^2."""
    n, inner, outer = 96, 2.0, 5.0
    pipe = trimesh.creation.annulus(inner, outer, height=10.0, sections=n)
    for z in (-4.9, 0.0, 1.234, 5.0):  # the last goes through corners
        rings = outlines(*mesh(pipe), z)
        assert sorted(np.sign([area(ring) for ring in rings])) == [-1.0, 1.0]
        expected = 0.5 * n * np.sin(2.0 * np.pi / n) * (outer**2 - inner**2)
        assert sum(map(area, rings)) == pytest.approx(expected, rel=1e-6)
        assert all(np.array_equal(ring[0], ring[-1]) for ring in rings)
    assert outlines(*mesh(pipe), 5.1) == []


def test_a_cut_is_closed_and_leaves_the_right_share():
    ball = trimesh.creation.icosphere(4, 3.0)
    plane = (np.array([0.0, 2.0, 0.0]), 2.0)  # y >= 1
    left = trimesh.Trimesh(*cut(*mesh(ball), [plane]))
    assert left.is_watertight
    assert left.volume == pytest.approx(np.pi * 2.0**2 * (3.0 - 2.0 / 3.0), rel=0.01)
    cap = trimesh.Trimesh(*part(mesh(left), plane))
    assert cap.area == pytest.approx(np.pi * (3.0**2 - 1.0), rel=0.01)
    assert np.allclose(cap.face_normals, [0.0, -1.0, 0.0])


def test_an_open_mesh_is_shown_uncut():
    ball = trimesh.creation.icosphere(2, 3.0)
    vertices, faces = mesh(ball)
    _, kept = cut(vertices, faces[5:], [(np.array([0.0, 0.0, 1.0]), 0.0)])
    assert len(kept) == len(faces) - 5


@pytest.mark.parametrize("angles", [(0.0, 0.0), (28.0, 9.0), (-40.0, 130.0)])
def test_an_eye_sees_without_distortion(angles):
    eye = Eye(elevation=np.radians(angles[0]), azimuth=np.radians(angles[1]))
    assert np.allclose(eye.axes @ eye.axes.T, np.eye(3))
    assert np.linalg.det(eye.axes) == pytest.approx(1.0)
    assert eye.axes[0] @ [1.0, 0.0, 0.0] == pytest.approx(0.0)  # world x stands upright


def test_a_ball_hides_what_lies_behind_it_and_nothing_else():
    eye, ball = Eye(), Sphere(center=(0.0, 0.0, 0.0), radius=4e-3)
    right, _, towards = eye.axes
    points = np.array([-6e-3 * towards, 6e-3 * towards, -6e-3 * towards + 5e-3 * right, -6e-3 * towards + 3e-3 * right])
    assert eye.seen_through(points, ball, reach=14e-3, step=0.3e-3).tolist() == [False, True, True, False]


def test_a_picture_covers_what_the_eye_sees():
    ball, pixel = trimesh.creation.icosphere(4, 3.0), 0.05
    image = picture(Eye(), *mesh(ball), "#ff0000", (-4.0, 4.0, -4.0, 4.0), pixel)
    assert image.shape == (160, 160, 4)
    assert image[..., 3].sum() / 255.0 * pixel**2 == pytest.approx(np.pi * 9.0, rel=0.03)
    assert (image[80, 80, 1:3] == 0).all()
    assert image[0, 0, 3] == 0


def test_stretches_of_a_body_join_without_gaps():
    assert runs(["a", "a", "b", "b", "a"]) == [(0, 2), (2, 4)]
    assert runs(["a", "a"]) == [(0, 1)]


def test_long_lines_keep_their_extremes():
    time = np.arange(20000.0)
    values = np.sin(0.01 * time)
    values[12345] = 7.0
    at, kept = extremes(time, values, columns=50)
    assert at.size <= 200
    assert (kept.min(), kept.max()) == (values.min(), 7.0)
    assert np.all(np.diff(at) > 0.0)
    assert extremes(time[:10], values[:10])[1] is not None


def test_spans_are_the_steps_that_hold():
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert spans(time, np.array([False, True, True, False, True])) == [(0.0, 2.0), (3.0, 4.0)]
    assert spans(time, np.zeros(5, dtype=bool)) == []


def test_every_moment_has_a_view_and_a_section_with_the_patients_right_on_the_left(found):
    figure = scenes_figure(found)
    assert len(figure.axes) == 2 * len(found.moments)
    titles = [axes.get_title("left") for axes in figure.axes[::2]]
    assert titles == [f"({each.letter}) {each.title}" for each in found.moments]
    for axes in figure.axes[1::2]:
        assert axes.get_xlim()[0] > axes.get_xlim()[1]  # y, which points to the patient's right
        assert axes.get_ylim()[0] < axes.get_ylim()[1]


def test_a_long_title_leaves_the_numbers_of_its_moment_readable(found):
    moment = replace(found.moments[0], title="lateral-right@L2 reached, ventral of the cord")
    figure = scenes_figure(replace(found, moments=(moment,)))
    view, cut = cast(list[Any], figure.axes)
    states = [each for each in view.texts if "mm out" in each.get_text()]
    boxes = [each.get_window_extent() for each in (view._left_title, *states, cut._right_title)]
    assert len(boxes) == 3
    for a, b in combinations(boxes, 2):
        assert not a.overlaps(b)
    assert all(figure.bbox.x0 <= each.x0 and each.x1 <= figure.bbox.x1 + 1.0 for each in boxes)


def test_lines_and_map_show_the_numbers(found):
    *_, pressure = lines_figure(found).axes
    assert np.allclose(np.asarray(pressure.lines[0].get_ydata()), 1e-3 * found.pressure)
    path = np.asarray(map_figure(found).axes[0].lines[0].get_xydata())
    out = np.isfinite(path).all(axis=1)
    assert np.allclose(path[out, 0], 1e3 * found.tip[out, 2])


def test_a_session_that_never_left_the_tube_is_drawn(session):
    scenario, snapshots = session
    still = course(snapshots[:5], scenario, frames=2)
    for draw in (scenes_figure, lines_figure, map_figure):
        assert draw(still).axes


def test_the_movie_shows_what_was_drawn(found):
    """What means something keeps its colour exactly; the rest is off by little."""
    from matplotlib.colors import to_rgb
    from PIL import Image, ImageSequence

    drawn = []

    class Kept(navigation_movie._Stage):
        def draw(self, now):
            drawn.append(super().draw(now))
            return drawn[-1]

    short = replace(found, frames=(found.frames[0], found.frames[6], found.frames[-1]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(navigation_movie, "_Stage", Kept)
        movie = Image.open(io.BytesIO(navigation_movie.animation(short)))
    shown = [np.array(each.convert("RGB")) for each in ImageSequence.Iterator(movie)]
    assert len(shown) == len(drawn) == 3
    for seen, meant in zip(shown, drawn, strict=True):
        off = np.abs(seen.astype(int) - meant).max(axis=2)
        assert (off > 48).mean() < 0.01
        for colour in navigation_movie.MEANING:
            exact = (meant == np.round(255.0 * np.array(to_rgb(colour)))).all(axis=2)
            assert off[exact].max(initial=0) == 0
