"""What is manufactured: the notch pattern, its drawing read back, the solid, and the figure."""

from itertools import pairwise
from math import pi, sin
from typing import Any

import ezdxf
import numpy as np
import pytest
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from tendonrod.device import notch_pattern, tube_mesh, write_dxf, write_mesh
from tendonrod.device_figure import draw_device
from tendonrod.errors import InvalidInput
from tendonrod.robot import Robot, load_robot, preset_names
from tendonrod.section import NotchedTube, PlainRod
from tendonrod.tendon import Tendon

ROD = Robot(
    name="rod",
    body=PlainRod(length=0.5, radius=1e-3, youngs_modulus=2e11, shear_modulus=8e10, density=8000.0),
    tendons=(Tendon.constant(x=0.015, y=0.0), Tendon.helical(offset=0.015, angle=1.0, turns=1.0, end=0.2)),
)


def tube_of(robot: Robot) -> NotchedTube:
    assert isinstance(robot.body, NotchedTube)
    return robot.body


def short_robot() -> Robot:
    """Ten notches, so that meshing takes no time."""
    return load_robot("exonav-1").replace(length=6.3e-3)


@pytest.mark.parametrize(("name", "count"), [("exonav-1", 125), ("exonav-2", 125), ("exonav-3", 78), ("exonav-4", 78)])
def test_as_many_notches_as_fit_with_equal_solid_ends(name, count):
    robot = load_robot(name)
    tube, notches = tube_of(robot), notch_pattern(robot)
    assert len(notches) == count
    assert notches[0].z_start == pytest.approx(tube.length - notches[-1].z_end, abs=1e-12)
    assert notches[0].z_start >= tube.notch_spacing
    gaps = [after.z_start - before.z_end for before, after in pairwise(notches)]
    np.testing.assert_allclose(gaps, tube.notch_spacing, rtol=1e-9)


@pytest.mark.parametrize("turns", [1.0, -2.0, 0.0])
def test_uncut_arc_follows_the_pattern(turns):
    robot = load_robot("exonav-3").replace(turns=turns)
    for notch in notch_pattern(robot):
        middle = 0.5 * (notch.z_start + notch.z_end)
        assert notch.backbone_angle == pytest.approx(pi + 2 * pi * turns * middle / tube_of(robot).length)


@pytest.mark.parametrize("name", preset_names())
def test_drawing_has_the_area_of_the_notches(tmp_path, name):
    robot, path = load_robot(name), tmp_path / "pattern.dxf"
    write_dxf(robot, path)
    drawing, tube = ezdxf.readfile(path), tube_of(robot)  # pyright: ignore[reportPrivateImportUsage]
    assert drawing.units == 4  # millimetres
    cuts: list[Any] = list(drawing.modelspace().query('LWPOLYLINE[layer=="NOTCHES"]'))
    corners = [np.array([point[:2] for point in cut]) for cut in cuts]
    area = sum(np.prod(np.ptp(rectangle, axis=0)) for rectangle in corners)
    n, around = len(notch_pattern(robot)), 2 * pi * 1e3 * tube.outer_radius
    unrolled = (2 * pi - tube.uncut_angle) * tube.outer_radius * tube.notch_width
    assert area == pytest.approx(1e6 * n * unrolled, rel=1e-9)
    assert all(cut.closed for cut in cuts)
    x = np.concatenate(corners)[:, 0]
    assert x.min() >= -1e-9
    assert x.max() <= around + 1e-9
    assert n < len(cuts) <= 2 * n
    outline: Any = drawing.modelspace().query('LWPOLYLINE[layer=="OUTLINE"]').first
    assert np.ptp([point[:2] for point in outline], axis=0) == pytest.approx([around, 1e3 * tube.length])
    note: Any = drawing.modelspace().query('MTEXT[layer=="NOTE"]').first
    assert name in note.text


@pytest.mark.parametrize("turns", [1.0, 0.0, -0.5])
def test_mesh_is_watertight_and_has_the_right_volume(turns):
    robot, segments = short_robot().replace(turns=turns), 96
    mesh, tube = tube_mesh(robot, segments), tube_of(robot)
    assert mesh.is_watertight
    assert mesh.is_volume
    assert mesh.body_count == 1
    full = pi * (tube.outer_radius**2 - tube.inner_radius**2)
    removed = len(notch_pattern(robot)) * tube.notch_width * full * (1 - tube.uncut_angle / (2 * pi))
    polygon = sin(2 * pi / segments) * segments / (2 * pi)
    assert mesh.volume == pytest.approx((full * tube.length - removed) * polygon, rel=1e-3)
    np.testing.assert_allclose(mesh.bounds[:, 2], [0.0, tube.length], atol=1e-9)


def test_mesh_stands_where_the_model_says():
    """With straight notches the solid's centre of mass lies on the side of the uncut arc, where the rings put it."""
    robot = short_robot().replace(turns=0.0)
    tube, count = tube_of(robot), len(notch_pattern(robot))
    full = pi * (tube.outer_radius**2 - tube.inner_radius**2)
    arcs = count * tube.notch_width * tube.section.A
    rings = full * (tube.length - count * tube.notch_width)
    centre = [-tube.section.r_na * arcs / (arcs + rings), 0.0, 0.5 * tube.length]
    np.testing.assert_allclose(tube_mesh(robot).center_mass, centre, atol=2e-7)


def test_mesh_file_is_in_millimetres(tmp_path):
    write_mesh(short_robot(), tmp_path / "tube.STL", segments=48)
    mesh = trimesh.load_mesh(tmp_path / "tube.STL")
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.extents, [1.144, 1.144, 6.3], rtol=2e-3)


@pytest.mark.parametrize("write", [write_dxf, write_mesh])
def test_bad_targets_are_refused(tmp_path, write):
    suffix = ".dxf" if write is write_dxf else ".stl"
    with pytest.raises(InvalidInput, match=f"path = .*pattern.pdf': must be a file name that ends in {suffix}"):
        write(short_robot(), tmp_path / "pattern.pdf")
    with pytest.raises(InvalidInput, match="must be writable"):
        write(short_robot(), tmp_path / "none" / f"pattern{suffix}")
    with pytest.raises(InvalidInput, match="robot = 'rod': must be a notched tube"):
        write(ROD, tmp_path / f"pattern{suffix}")


def test_a_failing_write_leaves_the_old_file(tmp_path, monkeypatch):
    def halfway(self, file_obj, *_, **__):
        file_obj.write_text("half")
        raise OSError(28, "No space left on device")

    old = tmp_path / "tube.stl"
    old.write_text("old")
    monkeypatch.setattr(trimesh.Trimesh, "export", halfway)
    with pytest.raises(InvalidInput, match=r"path = '.*tube.stl': must be writable: No space left"):
        write_mesh(short_robot(), old, segments=np.int64(24))
    assert old.read_text() == "old"
    assert list(tmp_path.iterdir()) == [old]


@pytest.mark.parametrize(("turns", "said"), [(1.0, "1 turn"), (-0.5, "-0.5 turns"), (2.0, "2 turns")])
def test_note_counts_in_words(tmp_path, turns, said):
    write_dxf(short_robot().replace(turns=turns), tmp_path / "cut.dxf")
    drawing = ezdxf.readfile(tmp_path / "cut.dxf")  # pyright: ignore[reportPrivateImportUsage]
    note: Any = drawing.modelspace().query("MTEXT").first
    assert f", {said}\\P" in note.text


def test_bad_number_of_segments():
    with pytest.raises(InvalidInput, match="segments = 3: must be a whole number from 12 to 10000"):
        tube_mesh(short_robot(), 3)


@pytest.mark.parametrize(
    "robot",
    [
        load_robot("exonav-1"),
        load_robot("exonav-3").replace(uncut_angle=5.0, turns=-2.0, tendons=()),
        load_robot("exonav-1").replace(length=9e-4),
        ROD,
        ROD.replace(tendons=()),
    ],
    ids=["preset", "wide arc", "one notch", "rod", "bare rod"],
)
def test_figure_keeps_every_label_inside_and_apart(robot):
    figure = draw_device(robot)
    FigureCanvasAgg(figure).draw()
    texts = [text for axes in figure.axes for text in axes.texts if text.get_text()]
    boxes = [Text.get_window_extent(text).padded(-2) for text in texts if not text.get_rotation()]
    width, height = figure.canvas.get_width_height()
    for i, box in enumerate(boxes):
        assert 0 <= box.x0 <= box.x1 <= width
        assert 0 <= box.y0 <= box.y1 <= height
        assert not any(box.overlaps(other) for other in boxes[:i])
