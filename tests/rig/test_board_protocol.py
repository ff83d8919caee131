"""Lines of the motor board: the checksum's published value, round trips, damage found; clocks; velocities in units."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendonrod.errors import InvalidInput
from tendonrod.rig.board_protocol import DamagedLine, Flag, answer, command, limits, sealed, state
from tendonrod.rig.board_time import TURN, BoardTime
from tendonrod.rig.board_velocities import Velocities

STATE = "7 OK 123 -1 2 3 4 -5 6 32768 04000F 65535"
FASTEST = [2000, 10_000, 3000]


def test_checksum_is_the_published_one():
    assert sealed("123456789") == b"123456789*29B1\n"  # CRC-16/CCITT-FALSE


def test_a_command_is_written_as_documented():
    assert command(12, "MOVE", 10, -20, 0).startswith(b">12 MOVE 10 -20 0*")


def test_a_state_is_read_as_documented():
    found = answer(sealed(f"<{STATE}")[:-1])
    read = state(found.words)
    assert (found.sequence, found.is_ok) == (7, True)
    assert (read.micros, read.positions, read.velocities) == (123, (-1, 2, 3), (4, -5, 6))
    assert (read.counts, read.done) == (32768, 65535)
    assert [read.has(Flag.HOMED, axis) for axis in range(3)] == [True] * 3
    assert [read.has(Flag.LOW, axis) for axis in range(3)] == [True, False, False]
    assert read.has(Flag.WATCHDOG)
    assert not read.has(Flag.HOME_FAILED, 2)


def test_an_answer_is_found_behind_noise():
    assert answer(b"\xff<3 OK garb" + sealed("<- ERR CRC")[:-1]).sequence is None


@given(st.binary(max_size=60))
def test_noise_is_no_answer(noise):
    with pytest.raises(DamagedLine):
        answer(noise)


@given(st.integers(1, 8 * (len(STATE) + 6) - 1), st.integers(0, 7))
def test_two_flipped_bits_are_found(first, second):
    line = bytearray(sealed(f"<{STATE}")[:-1])
    for bit in {first, second}:
        line[bit // 8] ^= 1 << bit % 8
    with pytest.raises(DamagedLine):
        answer(bytes(line))


@pytest.mark.parametrize("words", [(), ("1",) * 9, (*"1" * 8, "x", "1"), (*"1" * 4, "1.5", *"1" * 5)])
def test_a_state_of_another_protocol_is_refused(words):
    with pytest.raises(DamagedLine):
        state(words)


@pytest.mark.parametrize("words", [(), ("1",) * 14, ("1",) * 16, ("x",) * 15])
def test_limits_of_another_protocol_are_refused(words):
    with pytest.raises(DamagedLine):
        limits(words)


# ---------------------------------------------------------------- the board's time


@given(
    start=st.integers(0, TURN - 1),
    offset=st.floats(-1e4, 1e4),
    trips=st.lists(st.tuples(st.floats(1e-5, 3e-3), st.floats(1e-5, 3e-3)), min_size=3, max_size=60),
)
def test_times_lie_within_their_exchange_never_go_back_and_run_over_the_turn(start, offset, trips):
    """The board's clock is true; each exchange has a way there and a way back."""
    clock, now, times, best = BoardTime(), 0.0, [], inf
    for there, back in trips:
        asked, at, answered = now, now + there, now + there + back
        found = clock.host((start + round(at * 1e6)) % TURN, offset + asked, offset + answered) - offset
        best = min(best, there + back)
        assert asked - 1e-8 <= found <= answered + 1e-8
        assert abs(found - at) <= 0.5 * best + 3e-6  # half of the quickest exchange
        times.append(found)
        now = answered + 0.005
    assert times == sorted(times)


def test_a_board_whose_crystal_is_off_is_followed():
    clock = BoardTime()
    for k in range(20_000):  # 100 s at 200 Hz, a board that is 200 ppm fast
        asked = 0.005 * k
        found = clock.host(round((asked + 1e-4) * 1e6 * 1.0002), asked, asked + 2e-4)
        assert abs(found - asked - 1e-4) <= 1.01e-4


# ---------------------------------------------------------------- velocities


def test_the_mean_of_rounded_velocities_is_the_commanded_one():
    commands, sent = Velocities(), [0, 0, 0]
    for k in range(1000):
        for axis, velocity in enumerate((0.4321e-6, -973.37e-6, 62.5678e-3)):
            commands.stage(axis, velocity, 0.005 * k)
        sent = [a + b for a, b in zip(sent, commands.take(0.005 * k, FASTEST), strict=True)]
    assert sent == pytest.approx([432.1, -973_370, 62_567.8], abs=1)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1))
def test_no_velocity_beyond_the_limits_goes_out_and_zero_is_zero(velocities):
    commands = Velocities()
    for velocity in velocities:
        commands.stage(1, velocity, 0.0)
        assert abs(commands.take(0.0, FASTEST)[1]) <= FASTEST[1]
    commands.stage(1, 0.0, 0.0)
    assert commands.take(0.0, FASTEST) == [0, 0, 0]


def test_commands_to_one_axis_do_not_keep_another_going():
    commands = Velocities()
    commands.stage(1, 1e-3, 0.0)
    assert commands.take(0.0, FASTEST) == [0, 1000, 0]
    for time, translation in ((0.05, 1000), (0.09, 1000), (0.11, 0), (0.2, 0)):
        commands.stage(0, 1e-3, time)
        assert commands.take(time, FASTEST) == [1000, translation, 0]


@pytest.mark.parametrize("bad", [nan, inf, None, "1", True])
def test_of_a_command_that_is_bad_in_part_nothing_goes_out(bad):
    commands = Velocities()
    commands.stage(0, 1e-3, 0.0)
    with pytest.raises(InvalidInput, match="velocity of translation"):
        commands.stage(1, bad, 0.0)
    assert not commands.any_staged
    assert commands.take(0.0, FASTEST) == [0, 0, 0]
