"""A seeded hundredth of the stress campaign of benchmarks/campaign.py, and whether the campaign can fail at all."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import campaign  # pyright: ignore[reportMissingImports]


def test_a_hundredth_of_the_campaign_passes():
    """No silent failure; what does not converge ends at a fold below its full load, and says at which share of it."""
    *_, tally = campaign.campaign(1000, 1)
    assert not tally.of("silent")
    assert len(tally.of("reported")) <= 2
    assert all("ends at a fold" in each.cause for each in tally.of("reported"))


def test_every_item_passes_the_check_or_gives_a_reason():
    """Whatever the tolerance: nothing is left without an outcome, and what did not converge says why."""
    *_, tally = campaign.campaign(500, 2, tolerance=1e-4)
    assert sorted(each.item for each in tally.outcomes) == list(range(500))
    assert not tally.of("silent")
    assert all("reached" in each.cause for each in tally.of("reported"))


def test_an_item_is_the_same_whenever_it_is_made():
    one, two = campaign.problem(3, 17), campaign.problem(3, 17)
    assert one == two
    assert one != campaign.problem(3, 18)
    assert one != campaign.problem(4, 17)


def test_items_keep_to_the_distribution():
    items = [campaign.problem(5, item) for item in range(200)]
    for item in items:
        preset = next(each for each in campaign.presets() if each.name == item.robot.name)
        ratio = item.robot.parameters()["length"] / preset.parameters()["length"]
        assert 0.8 <= ratio <= 1.2
        assert 60.0 <= np.rad2deg(item.robot.body.uncut_angle) <= 200.0
        assert -2.0 <= item.robot.turns <= 2.0
        assert 0.0 <= item.insertion <= 1.0
        assert np.linalg.norm(item.gravity) == pytest.approx(9.81)
        euler = campaign.euler_loads(item.robot)[0]
        assert np.linalg.norm(item.tip_force) * item.insertion**2 <= 0.9 * euler
    assert {item.robot.torsion for item in items} == {"published", "open_section", "homogenized"}
    assert len({item.robot.name for item in items}) == 4


@pytest.mark.parametrize("torsion", ["published", "open_section"])
def test_plateau_tension_is_that_of_the_limits(torsion):
    from tendonrod.statics.tension_limits import tension_limits

    for preset in campaign.presets():
        robot = preset.replace(torsion=torsion)
        known = next(limit.tension for limit in tension_limits(robot) if limit.name == "plateau")
        assert campaign.plateau_tension(robot) == pytest.approx(known, rel=0.01)


def test_a_tolerance_that_cannot_be_met_fails_the_campaign(capsys):
    assert campaign.main(["100", "1", "--tolerance", "1e-16"]) == 1
    printed = capsys.readouterr().out
    assert "silent failure: item" in printed
    assert "criteria NOT met" in printed


def test_an_exception_is_a_silent_failure(monkeypatch):
    def broken(*_):
        raise RuntimeError("a fault put in on purpose")

    monkeypatch.setattr(campaign, "balance_errors", broken)
    outcome = campaign.examine(1, 0, 1e-5)
    assert outcome.kind == "silent"
    assert "a fault put in on purpose" in outcome.cause


def test_few_that_do_not_converge_are_allowed_but_no_more():
    def tally(reported: int):
        outcomes = [campaign.Outcome(item=i, kind="passed", error=1e-7) for i in range(20000 - reported)]
        outcomes += [campaign.Outcome(item=20000 - 1 - i, kind="reported", cause="why") for i in range(reported)]
        return campaign.Tally(seed=1, count=20000, outcomes=outcomes)

    assert tally(0).is_good
    assert tally(2).is_good
    assert not tally(3).is_good
    unfinished = tally(0)
    unfinished.outcomes.pop()
    assert not unfinished.is_good
