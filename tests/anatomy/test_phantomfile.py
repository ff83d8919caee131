"""Phantom files: patients by a few numbers; the examples; every wrong key by name."""

from pathlib import Path

import pytest

from tendonrod import InvalidInput
from tendonrod.anatomy import load_phantom, write_stl

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(tmp_path, text, **options):
    (tmp_path / "patient.toml").write_text(text)
    return load_phantom(tmp_path / "patient.toml", **options)


def refused(tmp_path, text, **options):
    with pytest.raises(InvalidInput) as error:
        load(tmp_path, text, **options)
    return str(error.value).replace(f"{tmp_path}/", "")


def test_a_patient_s_numbers_reach_the_phantom(tmp_path):
    text = """
    kind = "printed"
    levels = "T11"
    pressure_limit_kpa = 3.0
    [scale]
    canal_width = 1.1
    [numbers]
    cord_width_mm = 8.0
    canal_depth_mm = { T10 = 15.0, T12 = 16.0 }
    [sources]
    "numbers.cord_width_mm" = "MRI"
    """
    phantom, plain = load(tmp_path, text), load_phantom("printed", levels="T11")
    z = phantom.levels[0].middle
    assert phantom.name == "patient"
    assert phantom.plan.at("cord_width", z) == pytest.approx(8e-3)
    assert phantom.plan.at("canal_depth", z) == pytest.approx(15.5e-3)
    assert phantom.plan.at("canal_width", z) == pytest.approx(1.1 * plain.plan.at("canal_width", z))
    assert phantom.clearance([[0.0, 4e-3, z]])["cord"][0] == pytest.approx(0.0, abs=1e-5)
    assert phantom.pressure_limit == 3e3
    assert phantom.sources["cord_width_mm"] == "MRI"
    assert phantom.sources["canal_width_mm"].startswith("1.1 of: ")
    assert phantom.source == str(tmp_path / "patient.toml")


def test_levels_asked_for_go_before_those_of_the_file(tmp_path, without_distances):
    phantom = load(tmp_path, 'kind = "printed"\nlevels = "T8-L2"\n', levels="T11")
    assert phantom.level_range == "T11-T11"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "patient.toml = empty: must be a phantom: name, kind"),
        ("kind = ", "patient.toml = unreadable: must be valid TOML: Invalid value (at end of document)"),
        ('kind = "printed"\nlevel = "T8"', "patient.toml: level = 'T8': must be left out, or under one of the keys"),
        ('kind = "printed"\nlevels = "L2-T8"', "patient.toml: levels = 'L2-T8': must be a level or a range"),
        ('kind = "printed"\nscale = 2', "patient.toml: scale = 2: must be a table, [scale]"),
        ('kind = "printed"\n[scale]\nheight = 9', "patient.toml: scale.height = 9.0: must be from 0.4 to 2.5"),
        ('kind = "printed"\n[numbers]\ncord_width = 9', "patient.toml: numbers.cord_width = 9: must be under a key"),
        ('kind = "printed"\n[numbers]\ncord_width_mm = {}', "numbers.cord_width_mm = empty: must be a number, or"),
        ('kind = "printed"\n[sources]\na = "b"', "patient.toml: sources.a = 'b': must be under a key"),
        ('kind = "printed"\npressure_limit_kpa = 0', "patient.toml: pressure_limit_kpa = 0.0: must be > 0"),
        ('kind = "anatomical"\n[numbers]\ncsf_dorsal_mm = 6.0', "patient.toml: dural sac = "),
    ],
)  # fmt: skip
def test_wrong_files_are_named(tmp_path, text, said):
    assert said in refused(tmp_path, text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"gone.toml: must be an existing TOML file"):
        load_phantom(tmp_path / "gone.toml")


def test_the_example_of_a_patient_loads(without_distances):
    phantom = load_phantom(EXAMPLES / "patient-phantom.toml", levels="T11")
    assert phantom.kind == "anatomical"
    assert phantom.plan.canal([0.01]).middle[0, 1] == pytest.approx(-1e-3)


def test_the_example_of_meshes_loads_once_they_are_exported(tmp_path):
    write_stl(load_phantom("printed", levels="T11"), tmp_path / "stl")
    text = (EXAMPLES / "mesh-phantom.toml").read_text()
    phantom = load(tmp_path, text.replace("105.75", "11.5"))
    own = load_phantom("printed", levels="T11")
    p = [[-4.4e-3, 0.0, 11.5e-3], [0.0, 6e-3, 8e-3]]
    for name in ("cord", "canal"):
        assert phantom.clearance(p)[name] == pytest.approx(own.clearance(p)[name], abs=2e-5)
