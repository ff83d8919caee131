"""`tendonrod session`: a page from a record, also from one that was cut off; and what it refuses."""

import json
from html import unescape

import pytest

from recorded_session import SHORT, plain_figures, recorded


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "my session.jsonl"
    recorded(path, SHORT)
    return path


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    plain_figures(monkeypatch)


@pytest.fixture
def altered(record, tmp_path):
    """A copy whose lines went through ``change``."""

    def make(change):
        path = tmp_path / "altered.jsonl"
        path.write_text("".join(change(record.read_text().splitlines(keepends=True))))
        return path

    return make


def text_of(folder):
    return unescape((folder / "index.html").read_text(encoding="utf-8"))


def test_a_page_with_metrics_and_frames(run, record, tmp_path):
    status, out, err = run("session", record, "--output", tmp_path / "page", "--frames", "4")
    assert status == 0, err
    assert "index.html" in out
    names = {each.name for each in (tmp_path / "page").iterdir()}
    assert names >= {"index.html", "metrics.json", "frames.nc", "animation.gif"}
    text = text_of(tmp_path / "page")
    assert "agrees with the record bit for bit" in text
    assert "The record is complete" in text
    assert f"tendonrod session '{record}' --output" in text
    for line in (line for line in text.splitlines() if "To make this page again" in line):
        assert "--frames 4" in line


def test_json_is_the_metrics(result, record, tmp_path):
    found = result("session", record, "--output", tmp_path / "page", "--frames", "0")
    written = json.loads((tmp_path / "page" / "metrics.json").read_text())
    assert {key: found[key] for key in written if key != "units"} == {k: v for k, v in written.items() if k != "units"}
    assert found["complete"] is True
    assert not (tmp_path / "page" / "frames.nc").exists()


def test_a_script_and_the_record_of_it_give_the_same_metrics(result, tmp_path):
    script = tmp_path / "moves.csv"
    script.write_text(
        "duration_s,insertion_mm_per_s,rotation_deg_per_s,tension_n_per_s,tube_tilt_deg\n1,0,0,0.5,20\n1,3,0,0,\n"
    )
    said = result("navigate", "--script", script, "--headless", "--levels", "L2", "--output", tmp_path / "run")
    found = result("session", said["record"], "--output", tmp_path / "page", "--frames", "0")
    assert said["samples"] == 1 + 1 + 60 + 60  # the start, the outer tube placed, the steps of 1/60 s
    assert {key: found[key] for key in said if key in found and key != "record"} == {
        key: value for key, value in said.items() if key not in ("script", "record")
    }


def test_a_record_that_was_cut_off_is_shown_as_far_as_it_goes(run, altered, tmp_path):
    path = altered(lambda lines: [*lines[:-3], lines[-3][:20]])
    status, _, err = run("session", path, "--output", tmp_path / "page", "--frames", "0")
    assert status == 0
    assert "has no end: its session is still open, or its program was stopped" in err
    assert "has no end" in text_of(tmp_path / "page")


def test_a_record_that_says_otherwise_is_told_unless_unchecked(run, refused, altered, tmp_path):
    def other_tip(lines):
        k = next(k for k, line in enumerate(lines) if k > 0 and "digest" in line)
        return [*lines[:k], json.dumps(json.loads(lines[k]) | {"digest": "0" * 16}) + "\n", *lines[k + 1 :]]

    path = altered(other_tip)
    said = refused("session", path, "--output", tmp_path / "page", status=1)
    assert "0000000000000000 in the record" in said
    status, _, _ = run("session", path, "--output", tmp_path / "page", "--frames", "0", "--unchecked")
    assert status == 0
    assert "without comparing" in text_of(tmp_path / "page")


@pytest.mark.parametrize("frames", ["1", "-1", "2001", "many"])
def test_frames_are_0_or_2_to_2000(refused, record, tmp_path, frames):
    assert "--frames" in refused("session", record, "--output", tmp_path / "page", f"--frames={frames}")
    assert not (tmp_path / "page").exists()


def test_what_is_no_record_is_refused_before_anything_is_made(refused, tmp_path):
    missing, other = tmp_path / "none.jsonl", tmp_path / "other.jsonl"
    other.write_text('{"format": "something"}\n')
    for path in (missing, other):
        assert path.name in refused("session", path, "--output", tmp_path / "page")
    assert not (tmp_path / "page").exists()


def test_a_folder_that_cannot_be_made_is_named(refused, record, tmp_path):
    (tmp_path / "page").write_text("a file")
    assert "--output" in refused("session", record, "--output", tmp_path / "page")
