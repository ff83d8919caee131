"""STL files: closed, in millimetres, of the right volume, small enough for the plate, with walls that hold."""

import json

import numpy as np
import pytest

from tendonrod import InvalidInput
from tendonrod.anatomy import load_phantom, write_stl
from tendonrod.anatomy.building import printed_phantom
from tendonrod.anatomy.dimensions import Dimensions
from tendonrod.anatomy.levels import level_range
from tendonrod.anatomy.meshfile import read_mesh
from tendonrod.anatomy.printed import block, block_size
from tendonrod.anatomy.soundness import check_mesh, mesh_volume

pytestmark = pytest.mark.usefixtures("without_distances")


@pytest.fixture
def printed(without_distances):
    return load_phantom("printed", levels="T11")


@pytest.mark.parametrize("kind", ["printed", "anatomical"])
def test_every_file_is_sound_and_as_the_manifest_says(kind, tmp_path):
    parts = write_stl(load_phantom(kind, levels="T11"), tmp_path)
    told = json.loads((tmp_path / "manifest.json").read_text())
    assert {each["file"] for each in told["files"]} == {path.name for path in tmp_path.glob("*.stl")}
    assert ("pins" in told) == any("pinned" in part.what for part in parts)
    for part in parts:
        vertices, faces = read_mesh("part", tmp_path / part.file)
        check_mesh(part.file, 1e-3 * vertices, faces)
        assert part.is_watertight
        assert mesh_volume(vertices, faces) == pytest.approx(part.volume_mm3, rel=1e-5)
        np.testing.assert_allclose(np.ptp(vertices, axis=0), part.size_mm, atol=2e-3)
        assert max(part.size_mm) <= 220.0


def test_a_small_plate_gets_pieces_that_make_up_the_whole(printed, tmp_path):
    whole = {part.file: part for part in write_stl(printed, tmp_path / "whole")}
    pieces = write_stl(printed, tmp_path / "pieces", plate=0.05 + 1e-9)
    assert max(max(part.size_mm) for part in pieces) <= 50.0
    for name, exact in (("print-cord", True), ("print-canal", False)):
        volumes = [part.volume_mm3 for part in pieces if part.file.startswith(name)]
        total = whole.get(f"{name}.stl", whole.get(f"{name}-1.stl")).volume_mm3
        assert sum(volumes) == pytest.approx(total, rel=1e-6 if exact else 0.02)


def test_the_block_s_wall_is_at_least_as_thick_as_its_number(printed):
    column = printed.plan
    z = column.heights(-0.013, column.top)
    canal, (low, high) = column.canal(z), block_size(column)
    wall = column.numbers.of("printed_wall", "T11")
    assert wall >= 2e-3
    assert canal.ventral.min() - low[0] >= wall - 1e-12
    assert high[0] - canal.dorsal.max() >= wall - 1e-12
    assert high[1] - (canal.middle[:, 1] + canal.width).max() >= wall - 1e-12


def test_windows_and_foramina_of_the_block_leave_it_in_one_piece():
    column = load_phantom("printed", levels="T10-T11").plan
    assert len(block(column, -0.013, column.top).decompose()) == 1


def test_the_end_plates_hold_the_cord(printed, tmp_path):
    """The cord, printed longer by the plates, goes through their holes with play and no more."""
    write_stl(printed, tmp_path)
    for name in ("caudal", "cranial"):
        vertices, _ = read_mesh("part", tmp_path / f"print-end-{name}.stl")
        z = 1e-3 * vertices[0, 2]
        cord = printed.plan.cord([z])
        from_axis = np.hypot(1e-3 * vertices[:, 0] / cord.depth[0], 1e-3 * vertices[:, 1] / cord.width[0])
        hole = from_axis[from_axis < 1.2]
        assert hole.min() > 1.0
        assert hole.max() < 1.1


@pytest.mark.parametrize("plate", [0.01, 5.0, "a", np.nan])
def test_no_printer_has_such_a_plate(printed, tmp_path, plate):
    with pytest.raises(InvalidInput, match=r"^plate = "):
        write_stl(printed, tmp_path, plate=plate)


def test_a_folder_that_is_a_file_is_named(printed, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="must be a directory that can be made"):
        write_stl(printed, tmp_path / "file")


def test_a_phantom_s_parts_can_be_built_for_any_patient(tmp_path):
    phantom = printed_phantom(level_range("L1"), Dimensions(scale={"canal_width": 1.2, "height": 0.9}))
    assert all(part.is_watertight for part in write_stl(phantom, tmp_path))
