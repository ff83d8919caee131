"""Homing over the host's driver: references are found, a stop comes at once, what fails is told."""

from pathlib import Path
from time import monotonic, sleep

import pytest

from tendonrod.rig import firmware
from tendonrod.rig.board_protocol import BoardState, Flag
from tendonrod.rig.interfaces import DeviceError
from tendonrod.rig.launchpad import LaunchPad

pytest.importorskip("serial")
PATIENCE = ("--watchdog", "3000")  # so that a busy machine, which holds up these tests, is no fault


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    return firmware.build(tmp_path_factory.mktemp("board"))


def test_homing_finds_the_references(program):
    with firmware.running(program, *PATIENCE) as emulator, LaunchPad(emulator.port, timeout=0.5) as board:
        assert not board.screw.read().homed
        with pytest.raises(DeviceError, match="MOVE refused: an axis that is to move is not homed"):
            board.transact(0.0, 0.001, 0.0)
        for axis in (board.screw, board.translation, board.rotation):
            axis.home()
            assert axis.read().homed
        # Zero is where each switch lets go; from there the axis clears it by its back-off.
        found = [axis.read().position for axis in (board.screw, board.translation, board.rotation)]
        assert found == pytest.approx([-0.0003, 0.0003, 0.05], rel=0.1)


def at_rest(board: LaunchPad) -> BoardState:
    """The first state in which nothing moves."""
    deadline = monotonic() + 5.0
    while any((state := board.read("test").state).velocities):
        assert monotonic() < deadline
        sleep(0.005)
    return state


def test_homing_can_be_stopped_at_once(program):
    """Asked every 10 ms or so, in this thread, by something that asks the board itself."""
    with firmware.running(program, *PATIENCE) as emulator, LaunchPad(emulator.port, timeout=0.5) as board:
        asked = []

        def should_stop() -> bool:
            asked.append(board.load_cell.read().tension)
            return len(asked) > 20

        board.translation.home(should_stop=should_stop)
        assert len(asked) == 21
        assert not board.translation.read().homed
        stopped = at_rest(board)
        assert not stopped.has(Flag.HOMING, 1)
        sleep(0.05)
        assert board.read("test").state.positions == stopped.positions
        board.translation.home(should_stop=lambda: False)
        assert board.translation.read().homed


def test_what_is_raised_while_homing_stops_the_axes_and_passes(program):
    with firmware.running(program, *PATIENCE) as emulator, LaunchPad(emulator.port, timeout=0.5) as board:
        asked = iter([False] * 5)
        with pytest.raises(StopIteration):
            board.translation.home(should_stop=lambda: next(asked))
        assert not at_rest(board).has(Flag.HOMING, 1)
