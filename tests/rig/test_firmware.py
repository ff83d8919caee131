"""The firmware alone, in simulated time over standard input: motion, limits, watchdog, and what it refuses."""

import random
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest

from rig.boards import GREETING, MOVE, Heard, hear, sanitized, wait
from tendonrod.rig import firmware
from tendonrod.rig.board_protocol import Flag, command, limits, sealed, state
from tendonrod.rig.interfaces import DeviceError


@pytest.fixture(scope="module")
def board(tmp_path_factory) -> Callable[..., Heard]:
    return partial(hear, sanitized(tmp_path_factory.mktemp("board")))


def words(board, data: bytes) -> list[str]:
    """The answers to ``data`` after a greeting, verdict and first word each."""
    return [" ".join((("OK" if each.is_ok else "ERR"), *each.words[:1])) for each in board(GREETING + data).answers[1:]]


# ---------------------------------------------------------------- the firmware as text


@pytest.mark.parametrize("name", firmware.PORTABLE)
def test_the_board_needs_no_heap_no_floating_point_and_no_eight_bit_bytes(name):
    text = re.sub(r"/\*.*?\*/", "", (Path(firmware.__file__).parent / name).read_text(), flags=re.DOTALL)
    assert not re.findall(r"\b(malloc|calloc|realloc|free|float|double|u?int8_t|printf|CHAR_BIT)\b", text)


def test_a_compiler_that_is_missing_is_told_in_one_line(tmp_path):
    with pytest.raises(DeviceError, match="no-such-cc: no such compiler") as told:
        firmware.build(tmp_path, compiler="no-such-cc")
    assert "\n" not in str(told.value)


# ---------------------------------------------------------------- commands


def test_the_board_says_who_it_is_and_what_it_can(board):
    hello, can = board(GREETING + command(2, "LIMITS")).answers
    assert hello.words == ("tendonrod-bench", "1.0.0", "1")
    assert limits(can.words).watchdog == 100_000
    assert [axis[2] for axis in limits(can.words).axes] == [2000, 10_000, 3000]


def test_a_move_goes_at_its_velocity(board):
    sent = b"".join(command(2 + k, "MOVE", *MOVE) + wait(9) for k in range(40))
    heard = board(GREETING + sent)
    assert heard.moves == 40
    assert state(heard.answers[-1].words).velocities == pytest.approx([each * 1000 for each in MOVE], rel=0.02)
    assert heard.travelled == pytest.approx([abs(each) * 1000 * 0.4 for each in MOVE], rel=0.03)


def test_velocity_follows_a_ramp(board):
    """From one READ a millisecond: no change of velocity faster than the acceleration, 0.4 m/s2 of translation."""
    reads = b"".join(command(3 + k, "READ") for k in range(60))
    found = board(GREETING + command(2, "MOVE", 0, 10_000, 0) + reads).answers
    positions = [state(each.words).positions[1] for each in found[1:]]
    speeds = [b - a for a, b in pairwise(positions)]  # nm per ms = um/s
    assert max(b - a for a, b in pairwise(speeds)) <= 400 + 40  # two steps of the encoder
    assert speeds[-1] == pytest.approx(10_000, rel=0.02)


@pytest.mark.parametrize(
    ("axis", "velocity"), [(1, 10_000), (1, -10_000), (0, -2000), (0, 2000), (2, 3000), (2, -3000)]
)
def test_an_axis_brakes_before_the_end_of_its_travel(board, axis, velocity):
    speeds = [velocity if i == axis else 0 for i in range(3)]
    sent = b"".join(command(2 + k, "MOVE", *speeds) + wait(49) for k in range(420))
    found = board(GREETING + sent).answers
    (low, high, *_), states = (
        [(-65000, 0), (0, 65000), (-15000, 15000)][axis],
        [state(each.words) for each in found[1:]],
    )
    positions = [each.positions[axis] / 1000 for each in states]
    assert low - 5 <= min(positions)  # um: what the motor's lag makes of one step of the ramp
    assert max(positions) <= high + 5
    end, flag = (high, Flag.HIGH) if velocity > 0 else (low, Flag.LOW)
    assert positions[-1] == pytest.approx(end, abs=10)
    assert states[-1].has(flag, axis)
    assert not states[-1].has(Flag.STALLED, axis)


def test_without_commands_the_watchdog_stops_the_axes_and_says_so(board):
    sent = command(2, "MOVE", *MOVE) + wait(99) + command(3, "READ") + wait(60) + command(4, "READ") + wait(500)
    heard = board(GREETING + sent)
    before, after = heard.answers[2:]
    assert not state(before.words).has(Flag.WATCHDOG)
    assert state(before.words).velocities[1] == pytest.approx(3e6, rel=0.02)
    assert state(after.words).has(Flag.WATCHDOG)
    assert state(after.words).velocities == (0, 0, 0)
    assert heard.travelled[1] <= 3e6 * 0.111  # 100 ms, two ticks, the ramp


def test_reading_does_not_satisfy_the_watchdog(board):
    sent = command(2, "MOVE", *MOVE) + b"".join(command(3 + k, "READ") + wait(9) for k in range(30))
    found = board(GREETING + sent).answers
    assert state(found[-1].words).has(Flag.WATCHDOG)
    assert state(found[-1].words).velocities == (0, 0, 0)


def test_after_the_watchdog_nothing_moves_until_it_is_acknowledged(board):
    tripped = command(2, "MOVE", *MOVE) + wait(150)
    again = command(3, "MOVE", *MOVE) + command(4, "HOME", 1) + command(5, "STOP") + command(6, "MOVE", *MOVE)
    assert [each.split()[0] for each in words(board, tripped + again)] == ["OK", "ERR", "ERR", "OK", "OK"]
    assert words(board, tripped + again)[1:3] == ["ERR WATCHDOG"] * 2


def test_an_axis_that_does_not_follow_is_told_and_stands_still(board):
    sent = b"".join(command(2 + k, "MOVE", 0, 1000, 0) + wait(49) for k in range(20))
    found = board(GREETING + sent, "--jam", "2").answers
    stalled = [state(each.words).has(Flag.STALLED, 1) for each in found[1:]]
    assert not stalled[3]  # 0.15 mm were commanded
    assert stalled[5]  # 0.25 mm
    assert not any(state(found[-1].words).has(Flag.STALLED, axis) for axis in (0, 2))


@pytest.mark.parametrize(
    ("fault", "axis", "longest"),
    [
        ("--dead", 1, 31.0),  # 31 mm to the end switch, at 2 mm/s
        ("--dead", 2, 9.0),
        ("--dead", 3, 61.0),  # no end switch: after twice its travel
        ("--stuck", 2, 37.0),  # to the other end, at a quarter of 4 mm/s
    ],
)
def test_homing_by_a_broken_reference_switch_fails_where_it_can_go_no_further(board, fault, axis, longest):
    """Against an end switch the axis stands still, so that it never comes to twice its travel."""
    polls = int(10 * longest)
    sent = command(2, "HOME", axis) + b"".join(command(3 + k, "READ") + wait(99) for k in range(polls))
    last = state(board(GREETING + sent, fault, str(axis)).answers[-1].words)
    assert last.has(Flag.HOME_FAILED, axis - 1)
    assert not last.has(Flag.HOMING, axis - 1)
    assert not last.has(Flag.HOMED, axis - 1)
    assert last.velocities == (0, 0, 0)


def _run(board, *options: str) -> list:
    sent = b"".join(command(2 + k, "MOVE", *MOVE) + wait(9) for k in range(30)) + wait(200) + command(40, "READ")
    return [state(each.words) for each in board(GREETING + sent, *options).answers[1:]]


@pytest.mark.parametrize("encoder", [2**31 - 50_000, -(2**31) + 4_000])
def test_encoders_may_run_over_the_end_of_their_count(board, encoder):
    """Modulo 2**32; the sanitizers see that nothing overflows on the way."""
    assert _run(board, "--encoder", str(encoder)) == _run(board)


@pytest.mark.parametrize("left", [1, 5_000, 100_000, 320_000])
def test_the_clock_may_run_over_the_end_of_its_count_in_mid_motion(board, left):
    """After 71.6 minutes: the watchdog bites neither sooner nor later, and nothing else differs but the time itself."""
    found, plain = _run(board, "--clock", str(2**32 - left)), _run(board)
    assert [(each.micros - 2**32 + left) % 2**32 for each in found] == [each.micros for each in plain]
    assert [replace(each, micros=0) for each in found] == [replace(each, micros=0) for each in plain]
    assert found[-1].has(Flag.WATCHDOG)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (command(1, "PING"), "ERR SEQUENCE"),  # used by the greeting
        (command(0, "PING"), "ERR SEQUENCE"),
        (command(40_000, "PING"), "ERR SEQUENCE"),  # more than half a turn ahead is behind
        (command(2, "JUMP"), "ERR COMMAND"),
        (command(2, "MOV", 1, 1, 1), "ERR COMMAND"),
        (command(2, "MOVES", 1, 1, 1), "ERR COMMAND"),
        (command(2, "move", 1, 1, 1), "ERR COMMAND"),
        (command(2, "MOVE", 1, 1), "ERR SYNTAX"),
        (command(2, "MOVE", 1, 1, 1, 1), "ERR SYNTAX"),
        (command(2, "STOP", 1), "ERR SYNTAX"),
        (command(2, "HOME"), "ERR SYNTAX"),
        (command(2, "HOME", 0), "ERR RANGE"),
        (command(2, "HOME", 4), "ERR RANGE"),
        (command(2, "MOVE", 2001, 0, 0), "ERR RANGE"),
        (command(2, "MOVE", 0, -10_001, 0), "ERR RANGE"),
        (command(2, "MOVE", 0, 0, 999_999_999), "ERR RANGE"),
        (command(2, "MOVE", 0, 0, 4_294_967_297), "ERR SYNTAX"),  # 1 modulo 2**32
        (sealed(">2 MOVE 1 1  1"), "ERR SYNTAX"),
        (sealed(">2 MOVE 1 1 1 "), "ERR SYNTAX"),
        (sealed(">2 MOVE 1 1 +1"), "ERR SYNTAX"),
        (sealed(">2 MOVE 1 1 -0"), "ERR SYNTAX"),
        (sealed(">2 MOVE 1 1 01"), "ERR SYNTAX"),
        (sealed(">2 MOVE 1 1 1.5"), "ERR SYNTAX"),
        (sealed(">2 MOVE 1 1 -"), "ERR SYNTAX"),
        (sealed(">2  MOVE 1 1 1"), "ERR COMMAND"),
        (sealed("> 2 MOVE 1 1 1"), "ERR SYNTAX"),
        (sealed(">-2 MOVE 1 1 1"), "ERR SYNTAX"),
        (sealed(">65536 MOVE 1 1 1"), "ERR SYNTAX"),
        (sealed(">2"), "ERR SYNTAX"),
        (sealed(">"), "ERR SYNTAX"),
        (sealed("2 MOVE 1 1 1"), "ERR FRAME"),
        (sealed("<2 MOVE 1 1 1"), "ERR FRAME"),
        (command(2, "MOVE", 1, 1, 1).replace(b"*", b"*0"), "ERR CRC"),
        (command(2, "MOVE", 1, 1, 1).replace(b"*", b""), "ERR CRC"),
        (command(2, "STOP").lower().replace(b"stop", b"STOP"), "ERR CRC"),  # checksum in small letters
        (b">2 MOVE 1 1 1\n", "ERR CRC"),
        (b">*\n", "ERR CRC"),
        (b"\x80\n", "ERR FRAME"),
        (command(2, "MOVE", 1, 1, 1).replace(b"\n", b"\r\n"), "ERR FRAME"),
        (b">" + b"9" * 5000 + b"\n", "ERR LENGTH"),
    ],
    ids=repr,
)
def test_a_line_that_is_wrong_is_refused_and_moves_nothing(board, line, told):
    assert words(board, line) == [told]
    heard = board(GREETING + line + wait(200) + command(3, "PING"))
    assert heard.stood_still
    assert heard.errors == 1
    assert heard.answers[-1].is_ok


def test_before_the_greeting_nothing_is_done(board):
    heard = board(command(1, "MOVE", *MOVE) + command(2, "STOP"))
    assert [each.words for each in heard.answers] == [("HELLO",)] * 2
    assert heard.moves == 0


def test_the_same_line_twice_moves_once(board):
    line = command(2, "MOVE", *MOVE)
    heard = board(GREETING + line * 3)
    assert heard.moves == 1
    assert [each.words[0] for each in heard.answers[2:]] == ["SEQUENCE"] * 2


def test_sequence_numbers_go_round(board):
    sent = command(65_534, "HELLO") + command(65_535, "PING") + command(0, "PING") + command(65_535, "PING")
    found = board(sent).answers
    assert [each.is_ok for each in found] == [True, True, True, False]


def test_a_command_is_heard_after_noise_without_end(board):
    noise = bytes(random.Random(1).choices([b for b in range(256) if b not in b"\n>"], k=3000))
    heard = board(GREETING + noise + command(2, "STOP"))
    assert heard.answers[-1].is_ok
    assert heard.errors == 0  # the line began anew
