"""Replies of an NDI tracker taken apart, times of its frames, names of its tools: without any tracker."""

import random

import pytest

from rig.aurora_emulator import Script, Tracker, crc16, pose
from tendonrod.errors import InvalidInput
from tendonrod.rig.aurora_reply import DamagedReply, Plugged, handles, plugged, tracked
from tendonrod.rig.aurora_time import FrameTimes
from tendonrod.rig.aurora_tools import assigned, checked_tools, rom_pages
from tendonrod.rig.interfaces import DeviceError

TWO = "020AMISSING0000007100000A2F\n0B+09848+00000+00000+01736+002345-012345-010000+001230000003100000A2F\n0000"


def test_crc_is_that_of_the_protocol():
    """INIT: and OKAY as ndicapi sends and expects them."""
    assert (crc16(b"INIT:"), crc16(b"OKAY"), crc16(b"RESET")) == (0xE3A5, 0xA896, 0xBE6F)


def test_a_reply_by_hand():
    reply = tracked(TWO)
    lost, seen = reply.tools
    assert (lost.handle, lost.frame, lost.words) == (0x0A, 0xA2F, ("missing", "out of volume"))
    assert lost.position[0] != lost.position[0]
    assert lost.error != lost.error
    assert seen.position == pytest.approx((0.02345, -0.12345, -0.1))
    assert seen.quaternion == pytest.approx((0.9848, 0.0, 0.0, 0.1736))
    assert seen.error == pytest.approx(0.0123e-3)
    assert seen.words == reply.words == ()


def test_no_cut_reply_passes_for_a_whole_one():
    for end in range(len(TWO)):
        with pytest.raises(DamagedReply):
            tracked(TWO[:end])


@pytest.mark.parametrize(
    ("bit", "word"), [(0x40, "out of volume"), (0x100, "sensor broken"), (0x1000, "processing failed")]
)
def test_a_pose_that_is_no_measurement_is_lost(bit, word):
    found = tracked(TWO.replace("00000031", f"{0x31 | bit:08X}")).tools[1]
    assert found.words == ("missing", word)


def test_a_quaternion_that_turns_nothing_is_no_pose():
    """All zero, or twice as long as it can be: the CRC was right, so it is not asked for again."""
    for wrong in ("+00000+00000+00000+00000", "+19696+00000+00000+03472"):
        found = tracked(TWO.replace("+09848+00000+00000+01736", wrong)).tools[1]
        assert found.words == ("missing", "no rotation")
        assert found.frame == tracked(TWO).tools[1].frame


def test_what_the_emulator_says_is_what_is_read():
    tracker = Tracker(Script(tools=[[0x0A, 1, 0], [0x0B, 1, 1], [0x0C, 2, 0]]))
    tracker.do_init("")
    assert handles(tracker.do_phsr("02")) == (0x0A, 0x0C)
    tracker.do_pinit("0A")
    assert handles(tracker.do_phsr("02")) == (0x0B, 0x0C)
    places = [plugged(handle, tracker.do_phinf(f"{handle:02X}0021")).place for handle in (0x0A, 0x0B, 0x0C)]
    assert places == ["port 1", "port 1.2", "port 2"]
    with pytest.raises(DamagedReply):
        handles("020A001")
    with pytest.raises(DamagedReply):
        plugged(10, "UNOCCUPIED")


def test_times_lie_on_the_line_that_the_frames_come_from():
    """Bounds 8 ms apart, each tenth 60 ms late; a tracker 0.1 % slow. Within the bounds, and 1 ms off at most."""
    chance, times = random.Random(1), FrameTimes(40.0)
    errors = []
    for frame in range(1000, 2000):
        true = 5.0 + 0.025025 * (frame - 1000)
        late = 0.06 if chance.random() < 0.1 else 0.0
        before = chance.uniform(0.0, 0.008)
        earliest, latest = true - before, true + 0.008 - before + late
        found = times.time(frame, earliest, latest)
        assert earliest <= found <= latest
        errors.append(found - true)
    assert max(map(abs, errors[100:])) < 1e-3
    assert times.rate == pytest.approx(1.0 / 0.025025, rel=1e-4)


def test_a_counter_that_was_set_back_begins_anew():
    times = FrameTimes(40.0)
    for frame in range(100):
        times.time(frame, 0.025 * frame, 0.025 * frame + 0.004)
    found = [times.time(frame, 9.0 + 0.025 * frame, 9.0 + 0.025 * frame + 0.004) for frame in range(20)]
    assert found == pytest.approx([9.002 + 0.025 * frame for frame in range(20)])


ONE, SECOND, OTHER = (Plugged(handle=10 + i, port=p, channel=c) for i, (p, c) in enumerate([(1, 0), (1, 1), (3, 0)]))


def test_tools_by_handle_by_place_and_in_order():
    found = [OTHER, SECOND, ONE]
    assert assigned("port", found, None) == {"port 1": ONE, "port 1.2": SECOND, "port 3": OTHER}
    assert assigned("port", found, {"tip": None, "middle": None, "base": None}) == {
        "tip": ONE,
        "middle": SECOND,
        "base": OTHER,
    }
    assert assigned("port", found, {"0C": None}) == {"0C": OTHER}
    assert assigned("port", found, {"a": None, "port 1": None, "b": None}) == {"a": SECOND, "port 1": ONE, "b": OTHER}


@pytest.mark.parametrize(
    ("found", "wanted", "says"),
    [
        ([], {"tip": None}, "no tool is plugged"),
        ([ONE, OTHER], {"tip": None}, r"2 tools are plugged in, 0A \(port 1\), 0C \(port 3\): must be 1, tip"),
        ([ONE], {"tip": None, "base": None}, "must be 2, tip, base"),
        ([ONE], {"port 2": None}, r"no tool at port 2; plugged in: 0A \(port 1\)"),
        ([ONE], {"0F": None}, "no tool at 0F"),
    ],
)
def test_no_tool_is_taken_for_another(found, wanted, says):
    with pytest.raises(DeviceError, match=says) as told:
        assigned("port", found, wanted)
    assert "\n" not in str(told.value)


def test_a_tool_definition_goes_out_in_pages_of_64_bytes(tmp_path):
    rom = tmp_path / "tool.rom"
    rom.write_bytes(b"NDI\0" + bytes(range(200)))
    pages = list(rom_pages(str(rom)))
    assert [page[:4] for page in pages[:3]] == ["0000", "0040", "0080"]
    assert bytes.fromhex("".join(page[4:] for page in pages)) == rom.read_bytes().ljust(1024, b"\0")
    assert checked_tools({"tip": rom}) == {"tip": str(rom)}


def test_wrong_tools_are_told_by_name(tmp_path):
    (tmp_path / "no.rom").write_bytes(b"hello")
    for tools in ({}, ["tip"], {3: None}, {"tip": tmp_path / "no.rom"}, {"tip": tmp_path / "missing.rom"}):
        with pytest.raises(InvalidInput, match=r"^tools"):
            checked_tools(tools)


def test_poses_of_the_emulator_are_unit_quaternions():
    quaternion, position, _ = pose(10, 123)
    assert sum(q * q for q in quaternion) == pytest.approx(1.0)
    assert len(position) == 3
