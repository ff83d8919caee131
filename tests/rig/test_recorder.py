"""The recorder: what goes in comes out bit for bit, quickly, and wrong types end no loop."""

import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.records import COMMAND, FAULT, bits, periods, plain
from tendonrod import InvalidInput
from tendonrod.rig import record_layout as layout
from tendonrod.rig.interfaces import STILL
from tendonrod.rig.record import Message, read_record
from tendonrod.rig.recorder import Recorder
from tendonrod.rig.replay import replay
from tendonrod.rig.states import State


@pytest.fixture
def path(tmp_path):
    return tmp_path / "trial.rec"


def test_struct_and_array_layouts_agree():
    for packer, kind in ((layout._SAMPLE, layout.SAMPLE), (layout._FAULT, layout.FAULT), (layout._FRAME, layout.FRAME)):
        assert packer.size == kind.itemsize


@settings(max_examples=60, deadline=None)
@given(st.lists(periods, max_size=6), st.integers(0, 2**32))
def test_everything_comes_back_bit_for_bit(tmp_path_factory, written, number):
    path = tmp_path_factory.mktemp("records") / f"{number}.rec"
    with Recorder(path, {}, sync=None) as recorder:
        for each in written:
            recorder.write(*each)
    assert recorder.failed == ""
    record = read_record(path)
    assert [tuple(map(bits, each)) for each in replay(record)] == [tuple(map(bits, each)) for each in written]
    assert record.is_complete
    assert record.condition == "complete"


def test_arrays_of_a_record(path):
    with Recorder(path, {"seed": 3, "noise": np.float64(0.1), "limits": np.arange(3)}) as recorder:
        for i in range(100):
            recorder.write(plain(i), COMMAND, State.RUNNING if i < 60 else State.FAULT, FAULT if i >= 60 else None)
        recorder.log(0.06, "übersteuert \ud800\n", "error")
    record = read_record(path)
    assert record.header["seed"] == 3
    assert record.header["noise"] == 0.1
    assert record.header["limits"] == [0, 1, 2]
    assert set(record.header["recorder"]) >= {"tendonrod", "python", "numpy", "started"}
    assert record.time.tolist() == [i / 1000 for i in range(100)]
    assert record.samples["force"]["tension"].tolist() == list(range(100))
    assert record.samples["command"]["target"].tolist() == 100 * [0.7]
    assert record.states.tolist() == 60 * ["running"] + 40 * ["fault"]
    assert record.frame_sample.tolist() == [0, 25, 50, 75]
    assert record.frames["position"][:, 2].tolist() == [0.0, 0.025, 0.05, 0.075]
    assert record.tools.tolist() == 4 * ["tip"]
    assert record.faults == (FAULT,)
    assert record.fault_sample.tolist() == list(range(60, 100))
    assert record.messages == (Message(0.06, "error", "übersteuert \ud800\n"),)
    assert record.end == {"reason": "closed", "failed": "", "lost_bytes": 0, "refused": 0}
    with pytest.raises(ValueError, match="read-only"):
        record.samples["time"][0] = 1.0


def test_reserve_is_given_back(path):
    with Recorder(path, {}):
        assert path.stat().st_size >= 4 << 20
    assert path.stat().st_size < 1000


def test_records_are_never_overwritten(path):
    Recorder(path, {"first": True}).close()
    with pytest.raises(InvalidInput, match="never overwritten"):
        Recorder(path, {})
    assert read_record(path).header["first"]
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"path": "trial.txt"}, "ends in .rec"),
        ({"path": "no such folder/trial.rec"}, "No such file"),
        ({"header": {"robot": object()}}, "JSON"),
        ({"header": {3: "three"}}, "texts"),
        ({"flush": 0.0}, "flush"),
        ({"reserve": 10}, "reserve"),
    ],
)
def test_refused_before_anything_moves(tmp_path, arguments, said):
    given_ = {"path": "trial.rec", "header": {}} | arguments
    with pytest.raises(InvalidInput, match=said) as error:
        Recorder(**(given_ | {"path": tmp_path / given_["path"]}))
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("wrong", [None, 3, "text", plain(0).screw, object()])
@pytest.mark.parametrize("place", range(4))
def test_wrong_types_fail_the_record_not_the_loop(path, place, wrong):
    given_ = [plain(1), STILL, State.RUNNING, None]
    given_[place] = wrong
    harmless = (place == 2 and wrong == "text") or (place == 3 and wrong is None)
    with Recorder(path, {}) as recorder:
        recorder.write(plain(0), STILL, State.RUNNING)
        recorder.write(*given_)
        assert bool(recorder.failed) is not harmless
        recorder.write(plain(2), STILL, State.RUNNING)
    record = read_record(path)
    assert record.time.tolist() == ([0.0, 0.001, 0.002] if place == 3 and wrong is None else [0.0, 0.002])
    if place == 2 and wrong == "text":  # no state that this version knows
        assert record.unreadable == 1
    elif not harmless:
        assert "not recorded" in record.messages[0].text
        assert record.condition == "1 sample of wrong types, told in the messages"


def test_an_exception_ends_the_record_and_is_told(path):
    recorder = Recorder(path, {})

    def interrupted() -> None:
        with recorder:
            recorder.write(plain(0), STILL, State.RUNNING)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    record = read_record(path)
    assert record.is_complete
    assert record.end["reason"].startswith("KeyboardInterrupt")
    recorder.close()
    assert read_record(path).end == record.end
    recorder.write(plain(1), STILL, State.RUNNING)
    assert "after it was closed" in recorder.failed


def test_a_thousand_samples_per_second(path):
    late = []
    with Recorder(path, {}) as recorder:
        start = time.perf_counter()
        for i in range(1000):
            while time.perf_counter() < start + i / 1000:
                time.sleep(2e-4)
            recorder.write(plain(i), COMMAND, State.RUNNING, FAULT)
            late.append(recorder.lag)
    assert recorder.failed == ""
    assert np.median(late) < 0.1
    assert read_record(path).samples["force"]["tension"].tolist() == list(range(1000))


def test_writing_takes_no_control_period(path):
    took = []
    with Recorder(path, {}) as recorder:
        for i in range(5000):
            sample, began = plain(i), time.perf_counter()
            recorder.write(sample, COMMAND, State.RUNNING, FAULT)
            took.append(time.perf_counter() - began)
    assert np.median(took) < 1e-3  # microseconds, on a machine that has nothing else to do
    assert read_record(path).time.size == 5000


def test_messages_of_many_threads_and_samples_keep_together(path):
    with Recorder(path, {}, flush=1e-3) as recorder:
        talk = [
            threading.Thread(target=lambda j=j: [recorder.log(float(i), f"{j}") for i in range(200)]) for j in range(4)
        ]
        for each in talk:
            each.start()
        for i in range(500):
            recorder.write(plain(i), STILL, State.RUNNING)
        for each in talk:
            each.join()
    record = read_record(path)
    assert record.is_complete
    assert record.time.size == 500
    for j in range(4):
        assert [each.time for each in record.messages if each.text == str(j)] == list(range(200))


def test_a_record_may_be_read_while_it_is_written(path):
    with Recorder(path, {}, flush=0.01) as recorder:
        recorder.write(plain(0), STILL, State.RUNNING)
        end = time.monotonic() + 5.0
        while read_record(path).time.size == 0 and time.monotonic() < end:
            time.sleep(0.005)
        assert read_record(path).time.size == 1
        assert read_record(path).condition == "not closed"
