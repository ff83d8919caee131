"""Noise at the firmware, in simulated time: no motion but from whole lines, whatever comes in."""

import random
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import pairwise

import pytest

from rig.boards import GREETING, MOVE, Heard, hear, sanitized, wait
from tendonrod.rig.board_protocol import DamagedLine, answer, command, state


@pytest.fixture(scope="module")
def board(tmp_path_factory) -> Callable[..., Heard]:
    return partial(hear, sanitized(tmp_path_factory.mktemp("board")))


def flipped(rng: random.Random, line: bytes) -> bytes:
    """One to three bits of a line flipped, its newline included: the checksum finds every one of these."""
    bits = bytearray(line)
    for at in rng.sample(range(8 * len(line)), rng.randint(1, 3)):
        bits[at // 8] ^= 1 << at % 8
    return bytes(bits)


def truncated(rng: random.Random, line: bytes) -> bytes:
    return line[: rng.randrange(1, len(line) - 1)] + b"\n"


def beheaded(rng: random.Random, line: bytes) -> bytes:
    return line[rng.randrange(1, len(line) - 1) :]


def shuffled(rng: random.Random, line: bytes) -> bytes:
    middle = list(line[1:-1])
    while bytes(middle) == line[1:-1]:
        rng.shuffle(middle)
    return line[:1] + bytes(middle) + b"\n"


def random_bytes(rng: random.Random, _: bytes) -> bytes:
    return rng.randbytes(rng.randrange(1, 200)) + b"\n"


def flood(rng: random.Random, line: bytes) -> bytes:
    return line[:-1] * rng.randrange(3, 60) + b" "  # whole lines but for their newlines


DAMAGES = [flipped, truncated, beheaded, shuffled, random_bytes]


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda each: each.__name__)
def test_no_damaged_line_ever_moves_an_axis(board, damage):
    rng = random.Random(damage.__name__)
    lines = [damage(rng, command(2 + k, "MOVE", *MOVE)) for k in range(2500)]
    heard = board(GREETING + b"".join(lines) + b"\n" + command(20_000, "PING"))
    assert heard.stood_still
    assert heard.errors >= 2000
    assert heard.answers[-1].is_ok


def test_whole_lines_among_damaged_ones_are_carried_out_each_once(board):
    rng, sent, whole = random.Random(5), [GREETING], 0
    for k in range(3000):
        line = command(2 + k, "MOVE", *(rng.randint(-900, 900) for _ in range(3)))
        if rng.random() < 0.5:
            line = rng.choice(DAMAGES)(rng, line) + b"\n"
        else:
            whole += 1
        sent.append(line)
    heard = board(b"".join(sent) + command(10_000, "STOP") + wait(50) + command(10_001, "READ"))
    assert heard.moves == whole
    assert state(heard.answers[-1].words).velocities == (0, 0, 0)
    assert max(heard.travelled) <= 0.9e6 * 3.3  # none was faster than the fastest command


def test_floods_of_any_bytes_leave_a_board_that_answers(board):
    """Half a megabyte with addresses and undefined behaviour watched by the compiler's sanitizers."""
    rng = random.Random(9)
    parts = [flood(rng, command(2, "MOVE", *MOVE)) if rng.random() < 0.1 else rng.randbytes(300) for _ in range(1500)]
    heard = board(GREETING + b"".join(parts) + b"\n" + command(3, "PING"))
    assert heard.stood_still
    assert heard.answers[-1].is_ok


def test_over_a_noisy_line_every_answer_that_passes_is_one(board):
    """One byte in 40 is disturbed on its way in and out."""
    sent = b"".join(b"\n" + command(2 + k, "MOVE", *MOVE) for k in range(3000))
    heard = board(GREETING * 10 + sent, "--noise", "40", "7")
    passed = []
    for line in heard.lines:
        with suppress(DamagedLine):
            passed.append(answer(line))
    done = [state(each.words) for each in passed if each.is_ok and len(each.words) == 10]
    numbers = [each.sequence for each in passed if each.is_ok and len(each.words) == 10]
    assert len(done) > 100
    assert heard.moves < 2500
    assert numbers == sorted(set(numbers)) == [each.done for each in done]  # in order, each its own
    assert all(a.micros < b.micros for a, b in pairwise(done))
