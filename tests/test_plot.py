"""Figures: they show what was computed, every axis says its unit, space is drawn to scale, files are written."""

from dataclasses import replace
from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest

from tendonrod import InvalidInput, PlainRod, Robot, Tendon, load_robot, solve
from tendonrod.loads import LumpedMass, PointLoad
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.motion.progression import progress
from tendonrod.plot import motion_figure, plan_figure, save, shape_figure, style
from tendonrod.plot.shapes import strain_curve
from tendonrod.plot.style import new_figure, reading_unit, styled
from tendonrod.plot.surroundings import surroundings
from tendonrod.plot.views import ABOVE, SIDE, TIP
from tendonrod.plot.walls import near_walls, silhouette
from tendonrod.surface import Cavity, Cylinder, Plane, Sphere, Tube, Walls

DOWN = (-9.81, 0.0, 0.0)
UNITS = ("(mm)", "(N)", "(1/m)", "(deg)", "(µm)", "(nm)", "(-)", "η", "step")


EYES = {"seen from the side": (0, 1, 0), "seen from above": (1, 0, 0), "seen from the tip": (0, 0, 1)}


def on_paper(axes) -> np.ndarray:
    """(2, 3) rows: the world directions that point to the right and up in a plane panel, as drawn."""
    names = axes.get_xlabel()[0], axes.get_ylabel()[0]
    running = np.sign(np.diff(axes.transData.transform([(0.0, 0.0), (1.0, 1.0)]), axis=0)[0])
    return np.array([sign * np.eye(3)["xyz".index(name)] for sign, name in zip(running, names, strict=True)])


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("exonav-1")


@pytest.fixture(scope="module")
def plans(robot):
    return [plan_follow_leader(robot, 0.7, DOWN, steps=5, freedom=freedom) for freedom in ("tension", "full")]


@pytest.fixture(scope="module")
def figures(robot, plans):
    motion = progress(robot, np.linspace(0.0, 1.0, 6), 0.1, 0.5, gravity=DOWN)
    return {
        "shape": shape_figure(solve(robot, 0.7)),
        "shapes": shape_figure([solve(robot, 0.7), solve(robot, 0.7, DOWN)], ["free", "heavy"]),
        "motion": motion_figure(motion),
        "plan": plan_figure(plans[0]),
        "plans": plan_figure(plans),
    }


def panels(figure):
    return [axes for axes in figure.axes if not hasattr(axes, "_colorbar")]


@pytest.mark.parametrize("name", ["shape", "shapes", "motion", "plan", "plans"])
def test_every_axis_has_a_label_with_its_unit(figures, name):
    for axes in panels(figures[name]):
        labels = [axes.get_xlabel(), axes.get_ylabel()] + ([axes.get_zlabel()] if hasattr(axes, "get_zlabel") else [])
        assert all(any(unit in label for unit in UNITS) for label in labels), labels


@pytest.mark.parametrize("name", ["shape", "shapes", "motion", "plan", "plans"])
def test_one_millimetre_is_equally_long_in_every_direction_of_space(figures, name):
    space = next(axes for axes in figures[name].axes if hasattr(axes, "get_zlim"))
    across_and_up = space.get_proj()[:2, :3]  # rows of a rotation, but for one scale
    gram = across_and_up @ across_and_up.T
    assert gram == pytest.approx(gram[0, 0] * np.eye(2), abs=1e-9 * gram[0, 0])


@pytest.mark.parametrize("view", [SIDE, ABOVE, TIP], ids=lambda view: view.title)
def test_a_view_is_seen_from_where_its_title_says(view):
    assert view.eye == pytest.approx(EYES[view.title])


@pytest.mark.parametrize("name", ["shape", "shapes"])
def test_no_projection_is_mirrored(figures, name):
    """Screen right x screen up points to the eye that the panel's title names."""
    found = {axes.get_title(loc="left")[4:]: axes for axes in panels(figures[name])}
    for title, eye in EYES.items():
        assert np.cross(*on_paper(found[title])) == pytest.approx(eye)


@pytest.mark.parametrize("name", ["shape", "motion", "plan"])
def test_space_is_seen_from_above_in_front_of_y_and_beyond_the_tip(figures, name):
    space = next(axes for axes in figures[name].axes if hasattr(axes, "get_zlim"))
    right, up = space.get_proj()[:2, :3] / space.get_proj()[3, 3]
    assert np.all(np.cross(right, up) > 0.0)  # a mirrored picture would have it behind


def test_a_right_handed_helix_comes_anticlockwise_towards_an_eye_at_the_tip():
    rod = PlainRod(length=0.1, radius=1e-3, youngs_modulus=70e9, shear_modulus=30e9, density=2700)
    wound = Robot(name="wound", body=rod, tendons=(Tendon.helical(offset=5e-3, angle=0.0, turns=0.5),))
    figure = shape_figure(solve(wound, 0.0))
    axes = next(axes for axes in panels(figure) if axes.get_title(loc="left").endswith("from the tip"))
    middle = axes.transData.transform((0.0, 0.0))
    path = axes.transData.transform(axes.lines[1].get_xydata()) - middle
    assert np.linalg.det(path[[0, 10]]) > 0.0


def test_strain_breaks_where_a_tendon_ends():
    rod = PlainRod(length=0.4, radius=1e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8000)
    robot = Robot(name="rod", body=rod, tendons=(Tendon.constant(x=5e-3, y=0.0, end=0.25),))
    s, u = strain_curve(solve(robot, 3.0, insertion=0.8))
    (gap,) = np.flatnonzero(np.isnan(u[:, 1]))
    assert s[gap] == pytest.approx(0.25 - 0.2 * 0.4)
    assert u[:gap, 1] == pytest.approx(u[0, 1])
    assert u[gap + 1 :] == pytest.approx(0.0, abs=1e-9 * u[0, 1])
    assert np.all(np.diff(s) > 0.0)


@pytest.mark.parametrize("width", [0.02, 2.0, 9.0, 21.0, 33.0])
def test_no_tick_in_space_is_printed_over_its_neighbour(width):
    with styled():
        figure = new_figure(5.4)
        axes = style.space(figure, (0.0, 0.46, 0.93, 0.49), [np.array([[0.0, 0.0, 0.0], [-width, width / 3, 70.0]])])
        figure.draw_without_rendering()
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            boxes = [label.get_window_extent() for label in axis.get_ticklabels() if label.get_text()]
            assert not any(one.overlaps(other) for one, other in pairwise(boxes))


def test_bodies_lie_inside_the_axes_in_true_millimetres(figures, robot):
    space = next(axes for axes in figures["shape"].axes if hasattr(axes, "get_zlim"))
    axis = np.array(space.lines[0].get_data_3d())
    assert axis[:, -1] == pytest.approx(1e3 * solve(robot, 0.7).centerline[-1], abs=1e-3)
    limits = np.array([space.get_xlim(), space.get_ylim(), space.get_zlim()])
    assert np.all((axis > limits[:, :1]) & (axis < limits[:, 1:]))


def test_the_tendon_is_drawn_where_it_runs(figures, robot):
    space = next(axes for axes in figures["shape"].axes if hasattr(axes, "get_zlim"))
    drawn = [np.array(line.get_data_3d()).T for line in space.lines]
    path = 1e3 * solve(robot, 0.7).tendon_path(0)
    assert any(np.allclose(line[[0, -1]], path[[0, -1]], atol=1e-3) for line in drawn)


CORD = Cylinder(point=(0.0, 0.011, 0.0), axis=(0.0, 0.0, 1.0), radius=6.5e-3)


@pytest.fixture(scope="module")
def on_cord(robot):
    loads = [
        LumpedMass(mass=5e-4, offset=(1e-3, 0.0, 0.0)),
        PointLoad(force=(0.0, 0.0, -2e-3), frame="body"),
        PointLoad(force=(0.0, 1e-3, 0.0), at=0.04),
    ]
    return solve(robot, 0.7, DOWN, loads=loads, surface=CORD)


def test_what_pushes_is_drawn_from_where_it_acts_to_one_scale(on_cord):
    around = surroundings([on_cord])
    contact, load = around.forces
    along = contact.end - contact.start
    np.testing.assert_allclose(np.cross(along.sum(axis=0), on_cord.contacts.total), 0.0, atol=1e-3 * abs(along).max())
    assert CORD.distance(1e-3 * contact.start)[0] == pytest.approx(0.0, abs=5e-5)
    assert contact.largest <= np.linalg.norm(on_cord.contacts.total) * (1 + 1e-9)
    tip = on_cord.at([on_cord.length])
    np.testing.assert_allclose(load.start[0], 1e3 * tip.centerline[0], atol=1e-9)
    np.testing.assert_allclose(load.start[1], 1e3 * on_cord.at([0.04]).centerline[0], atol=1e-9)
    arrows = load.end - load.start
    np.testing.assert_allclose(arrows[0] / np.linalg.norm(arrows[0]), -tip.rotation[0, :, 2], atol=1e-12)
    assert np.linalg.norm(arrows[1]) == pytest.approx(0.5 * np.linalg.norm(arrows[0]))
    assert load.largest == pytest.approx(2e-3)
    np.testing.assert_allclose(around.masses[0], 1e3 * (tip.centerline[0] + 1e-3 * tip.rotation[0, :, 0]), atol=1e-9)


def test_loads_inside_the_outer_tube_are_not_drawn(robot):
    around = surroundings([solve(robot, 0.3, insertion=0.4, loads=[LumpedMass(mass=1e-3, at=0.01)])])
    assert not around.forces
    assert not len(around.masses)


@pytest.mark.parametrize(
    "surface",
    [
        Plane(point=(-2e-3, 0.0, 0.0), normal=(1.0, 0.1, 0.0)),
        CORD,
        Tube(point=(0.0, 0.0, 0.0), axis=(0.0, 0.1, 1.0), radius=0.03),
        Sphere(center=(0.0, 0.011, 0.03), radius=6e-3),
        Cavity(center=(0.0, 0.011, 0.03), radius=0.05),
    ],
    ids=lambda surface: type(surface).__name__,
)
def test_walls_are_points_of_the_surface_near_the_body(robot, surface):
    body = solve(robot, 0.7).centerline
    (grid,) = near_walls(surface, body)
    assert surface.distance(grid.reshape(-1, 3))[0] == pytest.approx(0.0, abs=1e-12)
    apart = np.linalg.norm(grid.reshape(-1, 1, 3) - body, axis=2).min(axis=1)
    assert apart.max() < np.ptp(body, axis=0).max()
    assert not near_walls(Plane(point=(-1.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)), body)
    assert len(near_walls(Walls(surfaces=[surface, CORD]), body)) == 2


def test_the_silhouette_of_a_cube_is_its_square():
    cube = np.stack(np.meshgrid([0.0, 1.0], [0.0, 0.5, 1.0], [0.0, 1.0]), axis=-1)
    outline = silhouette(cube[..., :2].reshape(3, -1, 2))
    assert sorted(map(tuple, outline[:-1])) == [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]
    np.testing.assert_array_equal(outline[0], outline[-1])


def test_figures_with_surroundings_say_so_and_lie_inside(on_cord):
    figure = shape_figure(on_cord)
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert said[-4:-2] == ["surface", said[-3]]
    assert said[-3].startswith("contact force, ")
    assert said[-2:] == ["point load, longest 2 mN", "mass"]
    for axes in panels(figure):
        if axes.get_title(loc="left")[4:] in EYES:
            low, high = sorted(axes.get_ylim())
            for patch in axes.patches:
                height = np.asarray(patch.get_path().vertices)[:, 1]
                assert low <= height.min() < height.max() <= high


def test_plan_figure_shows_the_plan(figures, plans):
    tension = next(axes for axes in figures["plan"].axes if "tension" in axes.get_ylabel())
    assert tension.lines[0].get_ydata() == pytest.approx(plans[0].tension)
    fit = tension.lines[1]
    assert fit.get_ydata() == pytest.approx(
        np.polyval(np.polyfit(plans[0].progress, plans[0].tension, 2), fit.get_xdata())
    )
    assert any("rotation (deg)" in axes.get_ylabel() for axes in figures["plans"].axes)
    assert not any("rotation" in axes.get_ylabel() for axes in figures["plan"].axes)


def test_motion_figure_shows_the_commands(figures):
    by_label = {axes.get_ylabel(): axes for axes in panels(figures["motion"])}
    assert by_label["tension (N)"].lines[0].get_ydata() == pytest.approx(np.full(6, 0.5))
    assert by_label["rotation (deg)"].lines[0].get_ydata() == pytest.approx(np.full(6, np.degrees(0.1)))


@pytest.mark.parametrize("insertion", [0.0, 1e-3, 1.0])
def test_any_insertion_can_be_drawn(robot, insertion, tmp_path):
    assert save(shape_figure(solve(robot, 0.2, insertion=insertion)), tmp_path / "shape.png").stat().st_size > 10_000


def test_plain_rods_with_many_tendons_or_none_can_be_drawn(tmp_path):
    rod = PlainRod(length=0.5, radius=1e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8000)
    four = tuple(Tendon.helical(offset=0.015, angle=angle, turns=1) for angle in (0.0, 1.57, 3.14, 4.71))
    for tendons in ((), four):
        figure = shape_figure(solve(Robot(name="rod", body=rod, tendons=tendons), 5.0 if tendons else 0.0, DOWN))
        space = next(axes for axes in figure.axes if hasattr(axes, "get_zlim"))
        assert len(space.lines) >= 1 + len(tendons)
        save(figure, tmp_path / "rod.svg")


@pytest.mark.parametrize(("suffix", "magic"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")])
def test_save_writes_the_format_of_the_suffix_and_closes(robot, tmp_path, suffix, magic):
    figure = shape_figure(solve(robot, 0.2))
    path = save(figure, tmp_path / f"figure{suffix}")
    assert path.read_bytes().startswith(magic)
    assert not figure.axes


def test_the_same_figure_gives_the_same_file(robot, tmp_path):
    first, second = (save(shape_figure(solve(robot, 0.2)), tmp_path / name).read_bytes() for name in ("a.svg", "b.svg"))
    assert first == second


@pytest.mark.parametrize("name", ["figure.bmp", "figure", "nowhere/figure.png"])
def test_save_refuses_by_name(robot, tmp_path, name):
    with pytest.raises(InvalidInput, match=name):
        save(shape_figure(solve(robot, 0.2)), tmp_path / name)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_save_that_fails_leaves_the_older_file_and_nothing_else(robot, tmp_path, monkeypatch, suffix):
    figure, path = shape_figure(solve(robot, 0.2)), tmp_path / f"figure{suffix}"
    path.write_text("older")

    def half_written(draft, **_):
        draft.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", half_written)
    with pytest.raises(InvalidInput, match="No space left"):
        save(figure, path)
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]


def test_a_shape_that_did_not_converge_is_refused(robot):
    crushed = solve(robot, 0.7, tip_force=(1e5, 0.0, -1e6), throw=False)
    motion = progress(robot, 1.0, 0.0, 0.2)
    with pytest.raises(InvalidInput, match=r"shapes\[1\]"):
        shape_figure([solve(robot, 0.2), crushed])
    with pytest.raises(InvalidInput, match=r"shapes\[0\]"):
        motion_figure(replace(motion, shapes=(crushed,)))


def test_bad_input_is_named(robot, plans):
    with pytest.raises(InvalidInput, match="shapes"):
        shape_figure([])
    with pytest.raises(InvalidInput, match="labels"):
        shape_figure(solve(robot, 0.2), ["one", "two"])
    with pytest.raises(InvalidInput, match="plans"):
        plan_figure([])
    with pytest.raises(InvalidInput, match="labels"):
        plan_figure(plans, ["one"])


def test_matplotlibs_settings_are_left_alone(robot):
    before = dict(mpl.rcParams)
    shape_figure(solve(robot, 0.2))
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(("largest", "unit"), [(4e-4, "mm"), (2e-5, "mm"), (5e-6, "µm"), (5e-12, "nm"), (0.0, "nm")])
def test_lengths_read_well(largest, unit):
    assert reading_unit(largest) == (unit, {"mm": 1e3, "µm": 1e6, "nm": 1e9}[unit])
