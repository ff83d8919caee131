"""`tendonrod phantom`: what it says, draws and writes, and every wrong option by name."""

import json
from math import copysign

import pytest

from tendonrod.anatomy import load_phantom, write_stl
from tendonrod.cli import main
from tendonrod.plot.phantom import WORDS, phantom_figure


@pytest.fixture(scope="module", autouse=True)
def _own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TENDONROD_CACHE", str(tmp_path_factory.mktemp("distances")))
        yield


def test_the_page_has_levels_targets_and_sources(capsys):
    assert main(["phantom", "--levels", "T11", "--robot", "exonav-1"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("printed phantom, T11\n")
    for words in ("lateral-left@T11", "Frostell 2016", "canal_depth_mm", "engineering choices", "4.68"):
        assert words in said


def test_json_is_the_phantom_in_si(capsys):
    assert main(["phantom", "--levels", "T11", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    phantom = load_phantom("printed", levels="T11")
    assert [each["name"] for each in told["structures"]] == list(phantom.structures)
    for each in told["targets"]:
        target = phantom.target(each["name"])
        assert each["position"] == list(target.position)
        assert each["room"] == phantom.free().distance([target.position])[0][0]
    assert told["sources"] == dict(phantom.sources)
    assert told["numbers"]["canal_depth_mm"]["T8"] == 14.6


def test_no_number_is_a_negative_zero(result):
    def zeros(node):
        if isinstance(node, dict | list):
            return [found for each in (node.values() if isinstance(node, dict) else node) for found in zeros(each)]
        return [node] if isinstance(node, float) and node == 0.0 else []

    found = zeros(result("phantom", "anatomical", "--levels", "T11"))
    assert found
    assert all(copysign(1.0, each) > 0.0 for each in found)


def test_figure_and_files_are_written(capsys, tmp_path):
    options = ["--view", str(tmp_path / "p.png"), "--export", str(tmp_path / "stl"), "--robot", "exonav-1"]
    assert main(["phantom", "anatomical", "--levels", "C3", *options]) == 0
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    assert {"dura.stl", "print-spine.stl", "manifest.json"} <= {path.name for path in (tmp_path / "stl").iterdir()}
    assert "print-spine.stl: vertebrae, discs and ligaments in one" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["prinetd"], "PHANTOM = 'prinetd': must be one of printed, anatomical"),
        (["--levels", "L2-T8"], "--levels = 'L2-T8': must be a level or a range"),
        (
            ["anatomical", "--levels", "C3", "--robot", "exonav-3"],
            "--robot = exonav-3, a tube of 1.906 mm: must be thinner",
        ),
        (["--view", "p.txt"], "--view = p.txt: must be a file name that ends in .png, .svg or .pdf"),
        (["--plate", "3"], "--plate = 3.0: must be from 50 to 2000"),
    ],
)
def test_wrong_options_are_named(capsys, options, said):
    assert main(["phantom", *options]) == 2
    assert said in capsys.readouterr().err


def test_a_robot_that_fits_is_told_so_with_numbers(capsys):
    assert main(["phantom", "anatomical", "--levels", "L2", "--robot", "exonav-1"]) == 0
    said = capsys.readouterr().out
    gap = load_phantom("anatomical", levels="L2").narrowest
    assert gap is not None
    assert "exonav-1, a tube of 1.144 mm, fits; the smallest gap is" in said
    assert f"{1e3 * gap[0]:.2f} mm, {gap[1]} at L2, which leaves {1e3 * gap[0] - 1.144:.2f} mm" in said
    assert "It has room at 5 of 5 targets." in said
    assert "(m): from memory of the literature" in said


def test_json_says_how_the_robot_fits(result):
    fit = result("phantom", "--levels", "L2", "--robot", "exonav-1")["robot"]
    assert fit["outer_diameter"] == pytest.approx(1.144e-3)
    assert fit["narrowest_gap"]["gap"] == min(load_phantom("printed", levels="L2").gaps["L2"].values())
    assert fit["without_room"] == {}


def test_targets_that_look_misplaced_are_told(capsys, tmp_path):
    write_stl(load_phantom("printed", levels="L2"), tmp_path)
    (tmp_path / "mine.toml").write_text(
        'kind = "meshes"\n[[structure]]\nname = "cord"\nrole = "cord"\nfile = "cord.stl"\n'
        '[[target]]\nname = "off"\nposition_mm = [300.0, 0.0, 10.0]\ntolerance_mm = 1.0\n'
    )
    assert main(["phantom", str(tmp_path / "mine.toml")]) == 0
    assert "warning: target off lies 296.5 mm outside the box around all structures" in capsys.readouterr().err


def test_the_figure_says_what_its_colours_rings_and_discs_are():
    phantom = load_phantom("anatomical", levels="L2")
    (legend,) = phantom_figure(phantom, 0.572e-3).legends
    said = [each.get_text() for each in legend.get_texts()]
    roles = {WORDS.get(each.role, each.role) for each in phantom.structures.values()}
    assert set(said) == {*roles, "target, within 1.5 mm", "robot's tube at a target, 1.14 mm"}
    (plain,) = phantom_figure(load_phantom("printed", levels="L2")).legends
    assert [each.get_text() for each in plain.get_texts()] == ["cord", "wall of the canal", "target, within 1.5 mm"]
