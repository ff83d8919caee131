"""Records that are cut off, flipped or full of holes open as far as they go, and say what is missing."""

import random
import tracemalloc

import numpy as np
import pytest

from rig.records import COMMAND, FAULT, bits, plain
from tendonrod import InvalidInput
from tendonrod.rig import record_layout as layout
from tendonrod.rig.record import read_record
from tendonrod.rig.record_tables import tables
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.replay import replay
from tendonrod.rig.states import State

N = 3


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Bytes of a small record, and where each of its pieces ends."""
    path = tmp_path_factory.mktemp("whole") / "whole.rec"
    with Recorder(path, {"robot": "none"}) as recorder:
        for i in range(N):
            recorder.write(plain(25 * i), COMMAND, State.RUNNING, FAULT if i == 2 else None)
        recorder.log(0.1, "over")
    data = path.read_bytes()
    return data, [each.stop for each in whole_pieces(data)]


def whole_pieces(data: bytes) -> list[layout.Piece]:
    return [each for each in layout.pieces(data) if isinstance(each, layout.Piece)]


@pytest.fixture
def opened(tmp_path):
    def call(data: bytes):
        path = tmp_path / "some.rec"
        path.write_bytes(data)
        return read_record(path)

    return call


def as_written():
    return [
        tuple(map(bits, (plain(25 * i), COMMAND, State.RUNNING, FAULT if i == 2 else None))) for i in range(N)
    ]  # fmt: skip


def as_read(record):
    return [tuple(map(bits, each)) for each in replay(record)]


@pytest.mark.parametrize("room", [0, 100], ids=["cut", "cut, with room reserved behind"])
def test_cut_off_at_every_byte(whole, opened, room):
    data, ends = whole
    written, found = as_written(), []
    for size in range(len(data)):
        cut = data[:size] + bytes(room)
        record = opened(cut)
        assert not record.end
        assert "not closed" in record.condition
        assert not record.is_complete
        last = max((each for each in [len(layout.LINE), *ends] if cut.startswith(data[:each])), default=0)
        assert record.torn + record.reserved == size + room - last
        assert record.torn <= max(size - last, 0)
        assert (record.lost, record.damage, record.unreadable) == (0, (), 0)
        found = as_read(record)
        assert found == written[: len(found)]
    assert len(found) == N
    assert opened(data).is_complete


def test_samples_are_there_as_soon_as_their_piece_is(whole, opened):
    data, ends = whole
    counts = [opened(data[:each]).time.size for each in ends]
    assert sorted(counts) == counts
    assert set(counts) == set(range(N + 1))


def test_every_flipped_bit_is_found(whole, opened):
    data, _ = whole
    written = as_written()
    for at in range(len(data)):
        wrong = bytearray(data)
        wrong[at] ^= 1 << (at % 8)
        record = opened(bytes(wrong))
        assert not record.is_complete, at
        assert record.damage or record.torn, at
        found = as_read(record)
        assert all(each in written for each in found), at
        if at >= len(layout.LINE) and record.header and not record.unreadable:
            assert len(found) >= N - 1, at


def test_a_hole_of_zeros_costs_what_was_in_it(tmp_path, opened):
    path = tmp_path / "long.rec"
    with Recorder(path, {}) as recorder:
        for i in range(2000):
            recorder.write(plain(i), COMMAND, State.RUNNING)
    data = bytearray(path.read_bytes())
    data[100_000:104_096] = bytes(4096)
    record = opened(bytes(data))
    left = record.samples["force"]["tension"]
    assert 0 < record.lost == 2000 - left.size < 40
    assert np.count_nonzero(np.diff(left) > 1) == 1
    assert len(record.damage) == 1
    assert record.condition.startswith("damaged in 1 place, ")
    assert record.end


def test_samples_whose_words_are_lost_are_counted(whole, opened):
    data, _ = whole
    texts = [each for each in whole_pieces(data) if each.kind == layout.TEXT]
    state = next(each for each in texts if data[each.start + 4 : each.stop] == b"running")
    wrong = bytearray(data)
    wrong[state.start + 5] ^= 4
    record = opened(bytes(wrong))
    assert record.unreadable == N
    assert record.frames.size == record.fault_rows.size == 0
    assert as_read(record) == []


def test_pieces_that_were_taken_out_are_missed(whole, opened):
    data, ends = whole
    record = opened(data[: ends[-3]] + data[ends[-2] :])
    assert record.lost == 1
    assert record.condition == "1 piece missing"


def sealed_anew(data: bytes, k: int, change) -> bytes:
    """The record with kind and content of piece k changed by ``change``, and right checksums all the same."""
    found = [(each.kind, data[each.start : each.stop]) for each in whole_pieces(data)]
    found[k] = change(*found[k])
    return layout.LINE + b"".join(layout.piece(i, *each) for i, each in enumerate(found))


def spoilt(how: str, kind: int, content: bytes, rng: random.Random) -> tuple[int, bytes]:
    if how == "cut":
        return kind, content[: rng.randrange(len(content))]
    if how == "longer":
        return kind, content + rng.randbytes(rng.randrange(1, 9))
    if how == "flipped":
        at = rng.randrange(len(content))
        return kind, content[:at] + bytes([content[at] ^ 1 << rng.randrange(8)]) + content[at + 1 :]
    return rng.choice([each for each in range(8) if each != kind]), content


@pytest.mark.parametrize("how", ["cut", "longer", "flipped", "of another kind"])
def test_nonsense_under_a_right_checksum_is_counted_not_believed(whole, opened, how):
    """No accident gets past the checksum, but another program may: what it wrote ends no reader."""
    data, ends = whole
    rng = random.Random(how)
    for k in range(len(ends)):
        for _ in range(15):
            record = opened(sealed_anew(data, k, lambda kind, content: spoilt(how, kind, content, rng)))
            assert len(as_read(record)) + record.unreadable <= N + 1
            if how in ("cut", "longer") and k not in texts_of(data):
                assert not record.is_complete
                assert record.strange + record.unreadable > 0 or not record.end


def texts_of(data: bytes) -> set[int]:
    """Numbers of the pieces that are texts: a text may be shorter or longer and still be one."""
    return {each.number for each in whole_pieces(data) if each.kind == layout.TEXT}


def test_two_records_in_one_file_are_not_taken_for_one(whole, opened):
    data, _ = whole
    record = opened(data + data)
    assert record.lost == 0
    assert record.strange == 1
    assert not record.is_complete
    assert "1 piece of unknown content or out of place" in record.condition


def test_a_long_record_is_read_in_little_more_room_than_its_samples(tmp_path):
    """The places of all bytes at once would take eight times the room of the bytes."""
    path, n = tmp_path / "long.rec", 60_000
    with Recorder(path, {}, sync=None) as recorder:
        for i in range(n):
            recorder.write(plain(i), COMMAND, State.RUNNING)
    data = path.read_bytes()
    samples = [each for each in whole_pieces(data) if each.kind == layout.SAMPLE_PIECE]
    tracemalloc.start()
    rows = tables(data, samples).samples
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert rows["force"]["tension"].tolist() == list(range(n))
    assert peak < 4 * rows.nbytes


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"time,tension\n0,1\n", "a record, which starts with"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "a record, which starts with"),
        (layout.LINE + layout.piece(0, layout.HEADER, b'{"record_version": 2}'), "a newer tendonrod reads this file"),
    ],
    ids=["csv", "hdf5", "newer"],
)
def test_what_is_no_record_is_refused(opened, data, said):
    with pytest.raises(InvalidInput, match=said) as error:
        opened(data)
    assert "\n" not in str(error.value)


def test_no_file_and_no_readable_file(tmp_path):
    for path, said in ((tmp_path / "none.rec", "existing"), (tmp_path, "readable")):
        with pytest.raises(InvalidInput, match=said):
            read_record(path)
