"""Scripts: read, written, played for as long as they say; what is wrong is told by line and column."""

from math import radians

import pytest

from navigate.round_phantom import scenario
from tendonrod import InvalidInput
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.outer_tube import OuterTube
from tendonrod.navigate.script import Move, play, read_script, write_script
from tendonrod.navigate.session import Session

HEADER = "duration_s,insertion_mm_per_s,rotation_deg_per_s,tension_n_per_s"


@pytest.fixture
def script(tmp_path):
    """Write a script's text and read it."""

    def call(text: str):
        path = tmp_path / "moves.csv"
        path.write_text(text, encoding="utf-8")
        return read_script(path)

    return call


def test_units_are_those_of_the_columns(script):
    moves = script(f"# a comment\n{HEADER},tube_depth_mm,tube_tilt_deg\n1.5,0.3,90,-0.1,,\n\n2,0,0,0,5.1,21\n")
    assert moves[0] == Move(duration=1.5, jog=Jog(insertion=0.3e-3, rotation=radians(90), tension=-0.1))
    assert dict(moves[1].tube) == {"depth": 5.1e-3, "tilt": radians(21)}


def test_what_is_written_is_read_again(tmp_path):
    moves = (
        Move(duration=2.0, jog=Jog(tension=0.05), tube={"tilt": 0.3, "height": 0.0123, "offset": -1e-3}),
        Move(duration=0.1, jog=Jog(insertion=3e-3, rotation=-0.5)),
    )
    path = tmp_path / "moves.csv"
    write_script(path, moves, ["how it was made"])
    for got, given in zip(read_script(path), moves, strict=True):
        assert got.duration == given.duration
        assert got.tube == pytest.approx(dict(given.tube), rel=1e-10)
        for name in ("insertion", "rotation", "tension"):
            assert getattr(got.jog, name) == pytest.approx(getattr(given.jog, name), rel=1e-10)


def test_a_script_lasts_as_long_as_it_says():
    session = Session(scenario())
    moves = [Move(duration=0.33, jog=Jog(tension=0.1)), Move(duration=0.5, jog=Jog(insertion=2e-3))]
    shown = list(play(session, moves, step=0.1))
    assert len(shown) == 1 + 4 + 5
    assert shown[-1].time == pytest.approx(0.83, rel=1e-12)
    assert shown[-1].tension == pytest.approx([0.033], rel=1e-12)
    assert shown[-1].insertion == pytest.approx(1e-3 / session.scenario.robot.section.L, rel=1e-12)


def test_a_script_places_the_outer_tube_and_fails_by_move_where_it_cannot():
    session = Session(scenario())
    there, back = Move(duration=0.1, jog=Jog(), tube={"depth": 5.5e-3}), Jog(insertion=-5e-3)
    assert list(play(session, [there]))[1].tube == OuterTube(depth=5.5e-3, tilt=session.scenario.tube.tilt)
    out = Move(duration=0.1, jog=Jog(insertion=5e-3))
    with pytest.raises(InvalidInput, match=r"move 2: insertion = .* of robot out"):
        list(play(session, [out, there]))
    list(play(session, [Move(duration=0.2, jog=back), there]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty: must be a header with duration_s"),
        ("duration_s,insertion_mm_per_s\n1,2\n", "column rotation_deg_per_s = missing"),
        (f"{HEADER},speed\n1,0,0,0,1\n", "column = 'speed': must be one of duration_s"),
        (f"{HEADER},duration_s\n1,0,0,0,1\n", "column duration_s = given twice"),
        (f"{HEADER}\n1,0,0\n", "line 2 = 3 cells: must be 4 cells"),
        (f"# first\n{HEADER}\n1,0,0,0\n1,fast,0,0\n", "line 4, column insertion_mm_per_s = 'fast'"),
        (f"{HEADER}\n1,nan,0,0\n", "line 2, column insertion_mm_per_s = 'nan': must be a number from -20 to 20"),
        (f"{HEADER}\n1,,0,0\n", "line 2, column insertion_mm_per_s = empty"),
        (f"{HEADER}\n0,1,0,0\n", "line 2, column duration_s = 0.0: must be a number from 0.001 to 3600"),
        (f"{HEADER}\n1,50,0,0\n", "line 2, column insertion_mm_per_s = 50.0: must be a number from -20 to 20"),
        (
            f"{HEADER},tube_tilt_deg\n1,0,0,0,90\n",
            "line 2, column tube_tilt_deg = 90.0: must be a number from -80",
        ),
    ],
)
def test_what_is_wrong_is_told_by_line_and_column(script, text, message):
    with pytest.raises(InvalidInput, match=message):
        script(text)
