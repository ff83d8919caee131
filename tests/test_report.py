"""The report: its numbers are the package's own, its printed numbers the paper's, and the page stands by itself."""

import csv
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from tendonrod import InvalidInput, load_robot, solve
from tendonrod.motion.follow_leader import plan_follow_leader
from tendonrod.report import misprints, paper, reproduce
from tendonrod.report.bending import fan, helix_radius
from tendonrod.report.chapter import Number, interval, listed, plain
from tendonrod.report.corrections import misprint_effects
from tendonrod.report.figures import fan_figure, misprint_figure
from tendonrod.report.following import commanded
from tendonrod.report.gravity import bounds, effect, self_weight

STEPS = 5
PICTURES = 12


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """One report, written over a directory that holds an older page and a file of the user's."""
    out = tmp_path_factory.mktemp("report") / "out" / "reproduce"
    out.mkdir(parents=True)
    (out / "index.html").write_text("old")
    (out / "notes.txt").write_text("mine")
    told = []
    page = reproduce(out, steps=STEPS, watch=lambda done, total, what: told.append((done, total, what)))
    return page, told


@pytest.fixture(scope="session")
def page(report):
    return report[0].read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def first():
    return load_robot("exonav-1")


def rows(report, name):
    with (report[0].parent / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


class Page(HTMLParser):
    """Collects what a page refers to, its ids, and its nesting."""

    VOID = ("meta", "img", "br")

    def __init__(self, text):
        super().__init__()
        self.references, self.ids, self.open, self.counts = [], [], [], {}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.references += [value for name, value in attrs if name in ("href", "src")]
        self.ids += [value for name, value in attrs if name == "id"]
        if tag == "img":
            assert dict(attrs)["alt"].strip()
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_well_formed_and_stands_by_itself(report, page):
    parsed = Page(page)
    assert not parsed.open
    assert len(set(parsed.ids)) == len(parsed.ids)
    assert "http" not in re.sub(r'src="data:[^"]*"', "", page)
    for reference in parsed.references:
        inside = reference.startswith("data:image/") or reference.removeprefix("#") in parsed.ids
        assert inside or (report[0].parent / reference).is_file(), reference


def test_every_figure_and_table_is_numbered_in_order_with_a_caption_and_files(report, page):
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", page, re.S)
    assert len(captions) == PICTURES
    assert all(len(plain(caption)) > 120 for caption in captions)
    numbers = [int(number) for number in re.findall(r'<span class="label">Figure (\d+)', page)]
    assert numbers == list(range(1, PICTURES + 1))
    tables = [int(number) for number in re.findall(r'<span class="label">Table (\d+)', page)]
    assert tables == list(range(1, len(tables) + 1))
    folder = report[0].parent
    assert len(list(folder.glob("*.png"))) == len(list(folder.glob("*.svg"))) == PICTURES
    assert len(list(folder.glob("*.csv"))) == len(tables)


def test_no_template_or_number_is_left_open(page):
    text = re.sub(r"<style>.*?</style>|data:image[^\"]*", "", page, flags=re.S)
    for trace in (r"\{\{", r"\}\}", r"\{%", r"\bnan\b", ">None<", r"Number\(", "&lt;i&gt;", "&amp;lt;"):
        assert not re.search(trace, text), trace


def test_running_again_leaves_the_users_files_and_nothing_half_written(report):
    folder = report[0].parent
    assert (folder / "notes.txt").read_text() == "mine"
    assert report[0].read_text(encoding="utf-8").startswith("<!doctype html>")
    assert not [file for file in folder.iterdir() if file.name.startswith(".")]


def test_progress_is_told_from_first_to_last(report):
    done, totals, _ = zip(*report[1], strict=True)
    assert list(done) == list(range(totals[0] + 1))
    assert set(totals) == {done[-1]}


def test_an_unwritable_place_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("tendonrod.report.reproduction.compute", lambda steps, tell: [])
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInput, match="file"):
        reproduce(tmp_path / "file")


@pytest.mark.parametrize(("number", "demanded"), [(1, 2.42), (2, 0.97), (3, 7.42), (4, 4.28)])
def test_the_bounds_of_table_1(number, demanded):
    assert 1e3 * bounds(f"exonav-{number}")[-1] == pytest.approx(demanded, abs=1e-9)


@pytest.mark.parametrize(
    ("number", "low", "high"), [(1, 0.9, 1.31), (2, 0.6, 0.8), (3, 0.2, 0.4), (4, 0.06, 0.18)]
)  # physics.md, section 3
def test_self_weight_moves_the_tip_as_audited_and_not_as_table_1_demands(number, low, high):
    found = effect(load_robot(f"exonav-{number}"))
    tip = 1e3 * found.weight[..., -1]
    assert low <= tip.min() <= tip.max() <= high
    assert 1e3 * found.beyond < 1e3 * found.bound[-1]


def test_half_a_gram_at_the_tip_moves_it_as_audited():
    added = {number: 1e3 * effect(load_robot(f"exonav-{number}")).mass[:, -1] for number in (1, 3, 4)}
    assert 13.5 < added[1].min() < added[1].max() < 18.0
    assert 2.0 < added[3].min() < added[3].max() < 4.0
    assert 0.65 < added[4].min() < added[4].max() < 1.0


def test_tilt_moves_every_point_by_its_distance_from_the_base(first):
    found = effect(first)
    s = np.array(paper.MEASURED_AT) * first.length_na
    base = np.array([-first.section.r_na, 0.0, 0.0])
    arm = solve(first, paper.LARGEST_TENSION, paper.GRAVITY, s=s).position - base
    assert found.tilt == pytest.approx(np.radians(1.0) * np.hypot(arm[:, 0], arm[:, 2]), rel=0.02)


def test_the_reports_table_1_is_the_papers_beside_the_computed_one(report, first):
    table = rows(report, "table-1")
    assert [float(cell) for cell in table[4][2:4]] == [4.18, 1.76]
    assert float(table[4][4]) == pytest.approx(2.42)
    motion = [1e3 * self_weight(first, tension)[-1] for tension in np.linspace(0.0, 0.7, 15)]
    assert table[4][5].replace("–", "-") == interval(motion).replace("–", "-")


def test_the_reports_polynomial_is_the_plans(report, first):
    plan = plan_follow_leader(first, 0.7, paper.GRAVITY, steps=STEPS)
    row = next(row for row in rows(report, "following-polynomials") if "0.7 N, with gravity" in row[0])
    assert [float(cell) for cell in row[1:4]] == pytest.approx(np.polyfit(plan.progress, plan.tension, 2), rel=1e-9)
    printed = rows(report, "following-polynomials")[-1]
    assert [float(cell) for cell in printed[1:4]] == [0.6492, -0.5159, 0.6088]


def test_the_accuracies_are_the_plans_and_beat_the_paper(report, first):
    plan = plan_follow_leader(first, 0.7, paper.GRAVITY, steps=STEPS)
    table = {row[0]: row[1:] for row in rows(report, "following-accuracy")}
    assert float(table["tension, 0.7 N, gravity"][0]) == pytest.approx(1e3 * plan.tip_rmse, rel=1e-9)
    assert float(table["tension, 0.7 N, gravity"][1]) == pytest.approx(1e3 * plan.tip_rmse_at_progress, rel=1e-9)
    assert plan.tip_rmse < paper.FTL_TIP_RMSE_SIMULATED / 4
    assert float(table["full, 0.7 N, gravity"][2]) < 0.5 * float(table["tension, 0.7 N, gravity"][2])
    assert max(float(table[f"tension, {tension} N, no gravity"][0]) for tension in (0.2, 0.45, 0.7)) < 1e-6


def test_a_commanded_fit_is_judged_as_a_plan_is(first):
    """Through three steps the quadratic fit is the plan itself, so its errors must be the plan's own."""
    plan = plan_follow_leader(first, 0.7, paper.GRAVITY, steps=3)
    found = commanded(plan, plan.polynomial(2))
    assert found.tension == pytest.approx(plan.tension)
    assert found.body_rms == pytest.approx(plan.body_rms, abs=1e-9)
    assert found.tip_error == pytest.approx(plan.tip_error, abs=1e-9)
    assert found.tip_error_at_progress == pytest.approx(plan.tip_error_at_progress, abs=1e-9)


def test_no_view_of_the_report_is_mirrored(first):
    """Screen right x screen up points to the eye that the title names: the tip's beyond +z, that above at +x."""
    for figure in (fan_figure([fan(first), fan(first)]), misprint_figure(misprint_effects(first))):
        seen = [axes for axes in figure.axes if "seen from" in axes.get_title(loc="left")]
        assert len(seen) in (2, 4)
        for axes in seen:
            above = axes.get_title(loc="left").endswith("above")
            across, up = np.diff(axes.transData.transform([(0.0, 0.0), (1.0, 1.0)]), axis=0)[0]
            right, upward = ((0, 0, across), (0, up, 0)) if above else ((0, across, 0), (up, 0, 0))
            eye = np.cross(right, upward)
            assert eye / np.linalg.norm(eye) == pytest.approx((1, 0, 0) if above else (0, 0, 1))


def test_the_section_table_holds_the_audited_numbers(report):
    table = {row[0]: [float(cell) for cell in row[1:]] for row in rows(report, "sections")[1:]}
    assert table["I_y (mm⁴)"] == pytest.approx([0.000275489, 0.000531345, 0.00101450, 0.00462400], rel=5e-6)
    assert table["length of the neutral axis L_na (mm)"] == pytest.approx([75.45662, 75.45177, 63.47585, 63.43681])


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), paper.GRAVITY])
@pytest.mark.parametrize("number", [1, 4])
def test_the_papers_equations_corrected_are_this_packages(number, gravity):
    robot = load_robot(f"exonav-{number}")
    body = misprints.equations(robot, 0.7, gravity).body()
    right = solve(robot, 0.7, gravity, s=body.s[:: misprints.SAMPLES // 4], accuracy=1e-9)
    assert np.abs(body.position[:: misprints.SAMPLES // 4] - right.position).max() < 5e-9


def test_the_misprinted_moment_balance_moves_the_tip_by_21_mm(report, first):
    body = misprints.with_printed_moment_term(misprints.equations(first, 0.7)).body()
    moved = 1e3 * np.linalg.norm(body.position[-1] - solve(first, 0.7).tip)
    assert moved == pytest.approx(21.2, abs=0.1)
    assert float(rows(report, "misprints")[1][3]) == pytest.approx(moved, abs=1e-3)


def test_the_printed_second_moment_is_negative_for_every_prototype():
    for number, expected in zip(range(1, 5), (-0.0156, -0.0146, -0.0741, -0.0561), strict=True):
        robot = load_robot(f"exonav-{number}")
        assert 1e12 * misprints.printed_inertia(robot)[1] == pytest.approx(expected, abs=5e-5)
        assert sum(misprints.printed_inertia(robot)) == pytest.approx(robot.section.I_x + robot.section.I_y)


def test_the_printed_base_drifts(first):
    assert misprints.base_drift(first, 1.0) == 0.0
    assert misprints.base_drift(first, 0.5) == pytest.approx(0.5 * first.section.L)


def test_weight_at_the_centroid_is_a_distributed_moment(first):
    """On a straight robot the moment is known; only then may the solver's dead moment stand in for it."""
    given = misprints.with_weight_at_centroid(misprints.equations(first, 0.0, (0.0, 0.0, -9.81)), first)
    state = np.concatenate([np.zeros(3), np.eye(3).ravel(), given.v_star, given.u_star])
    plain_state = misprints.equations(first, 0.0, (0.0, 0.0, -9.81)).rates(0.0, state)
    moment = np.cross(given.r_c, given.force)
    assert given.rates(0.0, state)[15:18] - plain_state[15:18] == pytest.approx(-moment / first.section.Kbt)


def test_the_helix_radius_is_that_of_the_curve(first):
    """On a helix about any axis, the radius is curvature / (curvature^2 + torsion^2) of the tube's axis."""
    shape = solve(first, 0.7)
    r_na = [first.section.r_na, 0.0, 0.0]
    u, v = shape.u[0], shape.v[0] + np.cross(shape.u[0], r_na)
    once, twice = np.cross(u, v), np.cross(u, np.cross(u, v))
    curvature = np.linalg.norm(np.cross(v, once)) / np.linalg.norm(v) ** 3
    torsion = v @ np.cross(once, twice) / np.linalg.norm(np.cross(v, once)) ** 2
    assert helix_radius(shape) == pytest.approx(curvature / (curvature**2 + torsion**2))


def test_numbers_read_well():
    assert str(Number(-0.123456, 2)) == "−0.12"
    assert str(Number(1e-9, 3)) == "< 0.001"
    assert str(Number(0.0, 2)) == "0.00"
    assert interval([1.0, 1.004]) == "1.00"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert plain("<i>L</i><sub>na</sub> &lt; 1\u00a0mm") == "L_na < 1 mm"
