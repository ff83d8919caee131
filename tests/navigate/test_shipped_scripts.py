"""The scripts of examples/navigation: each brings ExoNav 1 to its target in the printed phantom, inside all limits."""

from pathlib import Path

import pytest

from tendonrod.navigate.metrics import metrics
from tendonrod.navigate.scenario import load_scenario
from tendonrod.navigate.script import play, read_script
from tendonrod.navigate.session import Session

FOLDER = Path(__file__).parents[2] / "examples" / "navigation"
SCRIPTS = sorted(FOLDER.glob("*.csv"))


def test_they_lead_to_every_kind_of_target():
    kinds = {path.stem.rpartition("-")[0] for path in SCRIPTS}
    assert kinds == {"ventral", "lateral-left", "lateral-right", "drg-left", "drg-right"}


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_reaches_its_target_inside_all_limits(path):
    session = Session(load_scenario("exonav-1", "printed"))
    found = metrics(play(session, read_script(path), step=0.05))
    kind, _, level = path.stem.rpartition("-")
    assert found.targets[f"{kind}@{level}"].within_limits
    assert found.outside_limits == found.outside_model == found.blocked == 0.0
    assert min(gap.value for gap in found.clearance.values()) > 0.0


def test_the_command_line_says_the_same(result, tmp_path):
    path = FOLDER / "lateral-left-T10.csv"
    said = result("navigate", "--script", path, "--headless", "--output", tmp_path / "run")
    assert said["targets"]["lateral-left@T10"]["within_limits"]
    assert said["outside_limits"] == said["outside_model"] == 0.0
    assert list((tmp_path / "run").glob("*.jsonl"))


def test_the_virtual_bench_carries_a_script_out(result, tmp_path):
    """Slowed to what its lead screw can do, with the tension held by its PI: it comes to the same place."""
    path = FOLDER / "lateral-right-T10.csv"
    said = result("navigate", "--script", path, "--headless", "--bench", "virtual", "--output", tmp_path / "run")
    moves = read_script(path)
    assert said["targets"]["lateral-right@T10"]["within_limits"]
    assert said["duration"] > sum(move.duration for move in moves)
    assert said["insertion"] == pytest.approx(sum(each.duration * each.jog.insertion for each in moves), abs=1e-4)
