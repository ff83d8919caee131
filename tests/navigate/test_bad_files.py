"""Forty bad scenes, scripts and phantoms: each message names file, key and value as in the file, in the file's unit."""

import re

import pytest

from tendonrod import InvalidInput
from tendonrod.anatomy import load_phantom
from tendonrod.navigate.scenario import load_scenario
from tendonrod.navigate.scenariofile import read_scenario
from tendonrod.navigate.script import play, read_script
from tendonrod.navigate.session import Session

SI = re.compile(r"\(SI\)|\b\d*\.\d{6,}|\be-\d\d|\bm/s\b|\brad\b")  # of numbers that were converted, and of SI units

SCENES = {
    "[tube]\ntilt_deg = 120": "tube.tilt_deg = 120.0: must be from -80 to 80",
    "[tube]\nlean_deg = -95": "tube.lean_deg = -95.0: must be from -80 to 80",
    "[tube]\nheight_mm = 5000": "tube.height_mm = 5000.0: must be from -200 to 800",
    "[tube]\ndepth_mm = -90": "tube.depth_mm = -90.0: must be from -30 to 60",
    "[tube]\noffset_mm = nan": "tube.offset_mm = nan: must be from -30 to 30",
    "[tube]\noffset = 1": "tube.offset = unknown: must be one of height_mm",
    "tube = 3": "tube = 3: must be a table, [tube], with height_mm",
    "[[tube]]\nheight_mm = 1": "tube = [{'height_mm': 1}]: must be a table, [tube]",
    "[limits]\npressure_kpa = -1": "limits.pressure_kpa = -1.0: must be > 0",
    "[limits]\ntension_n = 0": "limits.tension_n = 0.0: must be > 0",
    "[limits]\ntension_n = 'much'": "limits.tension_n = 'much': must be a finite number > 0",
    "[limits]\nstrain_percent = true": "limits.strain_percent = True: must be a finite number > 0",
    "[limits]\ninsertion_percent = 150": "limits.insertion_percent = 150.0: must be from 1 to 100",
    "[limits]\nrotation_deg = -10": "limits.rotation_deg = -10.0: must be from 0 to 3600",
    "[limits]\nsnap_mm = 2000": "limits.snap_mm = 2000.0: must be from 0 to 1000",
    "levels = 'T12-T8'": "levels = 'T12-T8': must be a level or a range",
    "levels = 12": "levels = 12: must be a text in quotes",
    "levels = 'L2'\nentry = 'T5'": "entry = 'T5': must be one of L2",
    "levels = 'L2'\ntorsion = 'soft'": "torsion = 'soft': must be one of published",
    "phantom = 'prined'": "phantom = 'prined': must be one of printed, anatomical",
    "robot = 'exonav-9'": "robot = 'exonav-9': must be a preset",
    "gravity_m_per_s2 = [0, 0]": "gravity_m_per_s2 = [0, 0]: must be a vector of 3",
    "coupled = 'yes'": "coupled = 'yes': must be true or false",
    "limit = 3": "limit = unknown: must be one of robot",
    "levels = 'L2'\n[tube]\noffset_mm = 12": "outer tube's exit (mm) = (6.2, 12, -4.25): must be at least the robot's",
}
HEADER = "duration_s,insertion_mm_per_s,rotation_deg_per_s,tension_n_per_s"
SCRIPTS = {
    f"{HEADER}\n-1,0,0,0": ", line 2, column duration_s = -1.0: must be a number from 0.001 to 3600",
    f"{HEADER}\n1,30,0,0": ", line 2, column insertion_mm_per_s = 30.0: must be a number from -20 to 20",
    f"# a\n\n{HEADER}\n1,0,0,0\n1,0,720,0": ", line 5, column rotation_deg_per_s = 720.0: must be a number from -360",
    f"{HEADER}\n1,0,0,x": ", line 2, column tension_n_per_s = 'x': must be a number from -2 to 2",
    f'{HEADER}\n1,0,0,"0\n1,0,0,0"': ", line 3, column tension_n_per_s = '0\"': must be a number from -2 to 2",
    f"{HEADER},tube_tilt_deg\n1,0,0,0,120": ", line 2, column tube_tilt_deg = 120.0: must be a number from -80 to 80",
    f"{HEADER},tube_height_mm\n1,0,0,0,1200": ", line 2, column tube_height_mm = 1200.0: must be a number from -200",
    HEADER.replace(",", ";") + "\n1;0;0;0": " = semicolons between cells: must be commas, and points in numbers",
}
PLAYED = {
    f"{HEADER},tube_depth_mm\n1,5,0,0,2": ", line 2: outer tube's exit (mm) = (2, 1.5, -4.25): must be at least",
    f"{HEADER},tube_height_mm\n1,5,0,0,\n# on\n1,0,0,0,20": ", line 4: insertion = 5.0 mm of robot out: must be 0",
}
PRINTED = 'kind = "printed"\n'
MESHES = 'kind = "meshes"\n[[structure]]\nname = "cord"\nrole = "cord"\nfile = "none.stl"\n'
PHANTOMS = {
    f"{PRINTED}[scale]\nheight = 5": ": scale.height = 5.0: must be from 0.4 to 2.5",
    f"{PRINTED}[numbers]\ncord_width_mm = 90": ": numbers.cord_width_mm = 90.0: must be from 3.32 to 33.25",
    f"{PRINTED}[numbers]\ncord_width_mm = 30": ": canal_width_mm less cord_width_mm = -12.80 mm at T8: must be > 0",
    f"{PRINTED}pressure_limit_kpa = -1": ": pressure_limit_kpa = -1.0: must be > 0",
    f"{MESHES}[[target]]\nname = 'a'\nposition_mm = [9, 0, 5]\ntolerance_mm = -1": ": target[0].tolerance_mm = -1.0",
    f"distance_spacing_mm = 9\n{MESHES}": ": distance_spacing_mm = 9.0: must be from 0.1 to 2",
    f"{MESHES}[[level]]\nname = 'T8'\nz_low_mm = 5\nz_high_mm = 2": ": level[0].z_high_mm = 2: must be > z_low_mm = 5",
    MESHES: ": structure cord = 'none.stl': must be an existing mesh file",
}


def played(path):
    return list(play(Session(load_scenario(levels="L2")), read_script(path), 0.5))


CASES = [
    *((read_scenario, "scene.toml", text, f": {said}") for text, said in SCENES.items()),
    *((read_script, "moves.csv", text, said) for text, said in SCRIPTS.items()),
    *((played, "moves.csv", text, said) for text, said in PLAYED.items()),
    *((load_phantom, "mine.toml", text, said) for text, said in PHANTOMS.items()),
]


@pytest.mark.parametrize(("read", "file", "text", "said"), CASES, ids=[repr(case[2][-40:]) for case in CASES])
def test_what_is_wrong_is_told_in_the_words_of_the_file(tmp_path, monkeypatch, read, file, text, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / file).write_text(f"{text}\n", encoding="utf-8")
    with pytest.raises(InvalidInput) as found:
        read(file)
    message = str(found.value)
    assert message.startswith(f"{file}{said}")
    assert SI.search(message) is None
    assert "\n" not in message


def test_there_are_forty_of_them():
    assert len(CASES) >= 40


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["navigate", "--levels", "L2", "--entry", "T5"], "--entry = 'T5': must be one of L2"),
        (["navigate", "--levels", "L2-T8"], "--levels = 'L2-T8'"),
        (["navigate", "--script", "no.csv", "--headless"], "--script = no.csv: must be an existing CSV file"),
        (["navigate", "--scene", "no.toml"], "--scene = no.toml: must be an existing TOML file"),
        (["navigate", "--scene", "scene.toml", "--entry", "T5"], "scene.toml: levels = 'T1-C3'"),
        (["reach", "nothing"], "PHANTOM = 'nothing'"),
        (["reach", "--torsion", "soft"], "--torsion = 'soft'"),
    ],
)
def test_what_the_command_line_says_is_told_by_option(refused, tmp_path, monkeypatch, options, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text("levels = 'T1-C3'\n", encoding="utf-8")
    assert refused(*options, *(["--port", "0"] if options[0] == "navigate" else [])).startswith(said)
