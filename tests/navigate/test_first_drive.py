"""A first drive by hand from the default outer tube, as the docs tell it, arrives inside all limits."""

import pytest

from tendonrod import load_robot
from tendonrod.anatomy import load_phantom
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.metrics import metrics
from tendonrod.navigate.scenario import default_tube, largest_radius, load_scenario
from tendonrod.navigate.script import Move, play
from tendonrod.navigate.session import Session

E, W, BOTH = Jog(tension=0.1), Jog(insertion=3e-3), Jog(tension=0.1, insertion=3e-3)  # at the page's first rates
STEP = 0.5  # s


def drive(phantom, entry, *keys):
    """Metrics of holding keys for so many seconds, one after the other."""
    moves = [Move(duration=seconds, jog=jog) for jog, seconds in keys]
    return metrics(play(Session(load_scenario("exonav-1", phantom, entry=entry)), moves, step=STEP))


def assert_arrives(found, *names):
    assert set(names) <= found.targets.keys()
    assert all(each.within_limits for each in found.targets.values())
    assert found.outside_limits == found.blocked == 0.0
    assert min(gap.value for gap in found.clearance.values()) > 0.0


@pytest.mark.parametrize("tension", [0.69, 0.73])
def test_pull_then_insert_goes_round_the_printed_cord(tension):
    """The hand need not be exact."""
    found = drive("printed", None, (E, 10.0 * tension), (W, 18.0))
    assert_arrives(found, "lateral-right@L2", "ventral@L1")
    assert found.clearance["cord"].value > 0.2e-3
    assert found.outside_model == 0.0


def test_pulling_while_inserting_goes_there_too():
    assert_arrives(drive("printed", None, (BOTH, 7.0), (W, 11.0)), "lateral-right@L2", "ventral@L1")


@pytest.mark.parametrize(
    ("entry", "names"),
    [("L1", ("lateral-right@L1", "ventral@T12")), ("T11", ("lateral-right@T11", "ventral@T10"))],
)
def test_so_it_does_from_the_next_windows(entry, names):
    assert_arrives(drive("printed", entry, (E, 7.0), (W, 18.0)), *names)


@pytest.mark.parametrize("tension", [0.46, 0.48])
def test_in_the_anatomical_phantom_it_comes_to_a_ganglion(tension):
    assert_arrives(drive("anatomical", None, (E, 10.0 * tension), (W, 14.0)), "drg-right@L1")


@pytest.mark.parametrize("source", ["printed", "anatomical"])
def test_every_robot_that_fits_has_room_at_every_entry(source):
    phantom = load_phantom(source)
    for robot in map(load_robot, ("exonav-1", "exonav-3") if source == "printed" else ("exonav-1",)):
        for level in phantom.entries:
            at = default_tube(phantom, level, robot).position
            assert phantom.free().distance(at[None])[0][0] > largest_radius(robot), level
