"""A page's folder: what an older page left there goes, what is not the program's stays; columns and typesetting."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from measurement.known_bench import along, blank, seen
from tendonrod import InvalidInput
from tendonrod.measurement.crossvalidation import cross_validate
from tendonrod.measurement.fitrecord import write_record
from tendonrod.measurement.identification import identify
from tendonrod.measurement.profiles import profile
from tendonrod.measurement.registration import UNKNOWN
from tendonrod.measurement.setup import Setup
from tendonrod.plot.style import new_figure
from tendonrod.report.chapter import Number, Picture, Table
from tendonrod.report.identification import write_identification
from tendonrod.report.manifest import left_behind, manifest
from tendonrod.report.origin import assumed, virtual
from tendonrod.report.page import _numeric, write_page
from tendonrod.report.typeset import minus, typeset, values

KIND = "page.html.j2"


def write(out, *names, kind=KIND, **more):
    tables = [Table(name=name, header=("a", "b"), rows=[["x", Number(1.0)]]) for name in names]
    pictures = [Picture(name=name, draw=lambda: new_figure(1.0)) for name in names[:1]]
    return write_page(out, kind, "A page", tables, pictures, {}, **more)


def names(folder) -> set[str]:
    return {each.name for each in Path(folder).iterdir()}


def test_what_the_older_page_wrote_and_this_one_does_not_goes(tmp_path):
    write(tmp_path, "first", "both")
    assert names(tmp_path) == {"index.html", "first.csv", "first.png", "first.svg", "both.csv"}
    write(tmp_path, "both")
    assert names(tmp_path) == {"index.html", "both.csv", "both.png", "both.svg"}


def test_what_the_program_did_not_write_stays(tmp_path):
    write(tmp_path, "first", "changed", "linked")
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "changed.csv").write_text("a,b\nmine,2\n")
    (tmp_path / "linked.csv").rename(tmp_path / "elsewhere.csv")
    (tmp_path / "linked.csv").symlink_to(tmp_path / "elsewhere.csv")
    (tmp_path / "first.csv").unlink()
    write(tmp_path, "new")
    mine = {"notes.txt", "changed.csv", "linked.csv", "elsewhere.csv"}
    assert names(tmp_path) == {"index.html", "new.csv", "new.png", "new.svg"} | mine
    assert (tmp_path / "changed.csv").read_text() == "a,b\nmine,2\n"


def test_a_page_of_another_kind_or_hand_is_no_older_page(tmp_path):
    write(tmp_path, "first")
    known = [each.name for each in left_behind(tmp_path / "index.html", KIND, [])]
    assert known == ["first.csv", "first.png", "first.svg"]
    assert left_behind(tmp_path / "index.html", "validation.html.j2", []) == []
    for text in ("old", "<!-- tendonrod-page {broken} -->", '<!-- tendonrod-page {"kind": 1} -->'):
        (tmp_path / "index.html").write_text(text)
        assert left_behind(tmp_path / "index.html", KIND, []) == []


def test_no_file_outside_the_folder_is_named(tmp_path):
    """Also where somebody has written the list."""
    secret = tmp_path / "secret.txt"
    secret.write_text("mine")
    digest = json.loads(manifest(KIND, [secret]).split("page ")[1].removesuffix(" -->\n"))["files"]["secret.txt"]
    (tmp_path / "out").mkdir()
    page = tmp_path / "out" / "index.html"
    for name in ("../secret.txt", str(secret), "", ".", ".."):
        said = json.dumps({"kind": KIND, "files": {name: digest}})
        page.write_text(f"<!-- tendonrod-page {said} -->\n")
        assert left_behind(page, KIND, []) == []


def test_a_full_disk_is_told_of_the_folder_and_leaves_the_older_page(tmp_path, monkeypatch):
    page = write(tmp_path, "first")
    before = page.read_bytes()

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    with pytest.raises(InvalidInput) as caught:
        write(tmp_path, "second")
    assert (caught.value.field, caught.value.value) == ("out", str(tmp_path))
    assert "No space left on device" in str(caught.value)
    assert ".writing" not in str(caught.value)
    assert names(tmp_path) == {"index.html", "first.csv", "first.png", "first.svg"}
    assert page.read_bytes() == before


def test_a_fit_without_profiles_leaves_none_of_an_older_fit(tmp_path):
    trials = seen([blank(np.linspace(0.1, 0.7, 6), along([0.5, 1.0]))], Setup(base_tilt_y=0.05), seed=1)
    fit = identify(trials, ("base_tilt_y", "base_x"))
    profiles = [profile(fit, "base_x")]
    checked = cross_validate(fit, folds=2)
    (tmp_path / "fitted-mine.toml").write_text("mine")
    write_record(fit, tmp_path, None, profiles, checked)
    write_identification(fit, tmp_path, profiles, checked)
    full = names(tmp_path)
    write_record(fit, tmp_path)
    write_identification(fit, tmp_path)
    gone = {"profiles.csv", "profiles.png", "profiles.svg", "held_out.csv", "validation.png", "validation.svg"}
    assert full - names(tmp_path) == gone
    assert "fitted-mine.toml" in names(tmp_path)


def test_a_column_is_aligned_as_one():
    """A word among numbers is aligned with them, a number among words too."""
    header, dash = ("", "unit", "place", "share", "why", "range"), "–"
    rows = [
        ["tip_mass", "g", "base", Number(9.0), "none", "0.1–0.2"],
        ["friction", "1", Number(0.5), dash, "3 left out", "0.2"],
        ["base_x", "mm", Number(1.0), Number(2.0), "none", "notation only"],
    ]
    table = Table(name="t", header=header, rows=rows)
    assert _numeric(table) == [False, False, True, True, False, True]


@pytest.mark.parametrize(
    ("given", "set_"),
    [
        ("base_tilt_y -10.9 deg", "base_tilt_y\u00a0−10.9\u00a0deg"),
        ("uncertain by 1.4e+02 deg", "uncertain by 140\u00a0deg"),
        ("exonav-1-all, sample 16", "exonav-1-all, sample 16"),
        ("1.5e-05 & <b>", "1.5e−05 &amp; &lt;b&gt;"),
    ],
)
def test_values_are_typeset(given, set_):
    assert values(given) == set_


def test_only_a_sign_becomes_a_minus():
    assert minus("-1, (-2), 2026-11-22, s-3, a - b, -x, 1-2") == "−1, (−2), 2026-11-22, s-3, a - b, -x, 1-2"
    assert typeset("left by 0.3 g or 2 mm") == "left by 0.3\u00a0g or 2\u00a0mm"


def test_a_page_tells_which_trials_are_no_measurements_and_what_was_assumed():
    own, made = (blank(np.linspace(0.1, 0.7, 3), name=name) for name in ("own", "made"))
    made = replace(made, origin={"made by": "a program", "registration": f"as it stands; {UNKNOWN}"})
    assert virtual([own, own]) == assumed([own]) == []
    assert virtual([made]) == ["a program"]
    assert virtual([own, made]) == ["a program: made"]
    assert assumed([own, made]) == [f"N{UNKNOWN[1:]}"]
