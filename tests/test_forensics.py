"""What would be enough for Table I: the polynomials are the solver's own, and the edges of what they admit are real."""

from typing import Any

import numpy as np
import pytest

from tendonrod import LumpedMass, load_robot, solve
from tendonrod.report import paper
from tendonrod.report.causes import Case, Gaps, bracket, gap, leaning, modulus_gap, scaled
from tendonrod.report.forensics import (
    AWAY,
    CARRIED,
    CASES,
    ONE_RUN,
    TOWARDS,
    bound_name,
    chapter,
    common,
    forensics,
    nearest,
    windows,
)
from tendonrod.report.gravity import TENSIONS, bounds, places, self_weight
from tendonrod.report.results import positive

G = np.array(paper.GRAVITY)


@pytest.fixture(scope="module")
def found():
    return {name: forensics(load_robot(name)) for name in ("exonav-2", "exonav-3", "exonav-4")}


def rms(robot, case=None, **cause):
    """(4,) by direct solves."""
    distances = [gap(robot, tension, case or Case(), **cause) for tension in TENSIONS]
    return np.sqrt(np.mean(np.square(distances), axis=0))


@pytest.mark.parametrize("name", paper.PROTOTYPES)
def test_without_a_cause_the_distance_is_self_weight(name):
    robot = load_robot(name)
    for tension in (0.0, 0.7):
        assert gap(robot, tension, Case()) == pytest.approx(self_weight(robot, tension), abs=1e-12)
    assert bracket(name)[0] == pytest.approx(bounds(name))


def test_errors_against_the_same_measurements_bracket_the_distance_of_the_runs():
    """The claim that everything rests on, with runs and measurements drawn by chance."""
    chance = np.random.default_rng(7)
    norm = lambda points: np.sqrt(np.mean(np.sum(points**2, axis=-1)))  # noqa: E731
    for _ in range(200):
        measured, one, other = chance.normal(size=(3, 9, 3)) * chance.uniform(0.1, 3.0, size=(3, 1, 1))
        a, b = norm(one - measured), norm(other - measured)
        assert abs(a - b) <= norm(one - other) <= a + b


@pytest.mark.parametrize(
    ("name", "case"),
    [
        ("exonav-1", Case(modulus=0.6)),
        ("exonav-2", Case(modulus=0.6, at_tip=True)),
        ("exonav-3", Case(torsion="homogenized")),
        ("exonav-4", Case()),
    ],
)
def test_polynomials_agree_with_a_turned_base_solved_in_the_world(name, case):
    robot, chance = load_robot(name), np.random.default_rng(3)
    gaps, body, s = Gaps(robot, case, "mass"), case.heavy(robot), places(robot)
    for tension, share, part in chance.uniform(size=(6, 3)):
        tilt, mass, pose = np.radians(40.0 * (share - 0.5)), part * gaps.end, np.eye(4)
        pose[:3, :3] = leaning(tilt)
        places_of_mass = [None] * 4 if case.at_tip else s
        direct = [
            solve(body, 0.7 * tension, G, s=s, exit_pose=pose, loads=[LumpedMass(mass=mass, at=at)]).position[k]
            for k, at in enumerate(places_of_mass)
        ]
        base = gaps.heavy(*(np.array([x]) for x in (0.7 * tension, tilt, mass)))[0, 0, 0]
        assert base @ pose[:3, :3].T == pytest.approx(np.array(direct), abs=1.5e-6)


def test_sideways_tilt_leads_to_y_and_tilt_to_where_gravity_pulls():
    assert leaning(0.1)[:, 2] @ G > 0.0
    assert leaning(0.0, 0.1)[1, 2] > 0.0
    robot = load_robot("exonav-3")
    found = Gaps(robot, Case(), "sideways")(np.array([-0.1, 0.2]), np.array([0.15]))
    assert found.rms[:, 0] == pytest.approx(
        np.array([rms(robot, tilt=tilt, sideways=0.15) for tilt in (-0.1, 0.2)]), abs=1e-6
    )


def test_scaled_moduli_are_scaled_loads():
    """A body f times as stiff is bent by tension and gravity as the printed one by 1/f of them."""
    robot, share = load_robot("exonav-2"), 0.7
    s = places(robot)
    heavy = solve(robot, 0.5 / share, G / share, s=s).position
    still = solve(robot, 0.5 / share, s=s).position
    assert gap(robot, 0.5, Case(modulus=share)) == pytest.approx(np.linalg.norm(heavy - still, axis=1), abs=1e-7)
    shares = np.array([0.55, 1.0, 1.45])
    for both in (True, False):
        direct = [rms(robot, Case(modulus=value, in_both=both)) for value in shares]
        assert modulus_gap(robot, shares, both).rms == pytest.approx(np.array(direct), abs=1e-6)
    assert scaled(robot, share).section.Kse == pytest.approx(share * robot.section.Kse)


@pytest.mark.parametrize(("name", "cause", "sign"), [("exonav-2", TOWARDS, 1.0), ("exonav-3", AWAY, -1.0)])
def test_a_tilt_at_an_edge_touches_one_bound_and_beyond_it_breaks_it(found, name, cause, sign):
    robot, limits = load_robot(name), bracket(name)
    for end, outwards in zip(found[name].scans[cause].windows()[0], (-1.0, 1.0), strict=True):
        margin = [np.min(np.abs(limits - rms(robot, tilt=sign * np.radians(end))))]
        assert margin[0] < 3e-6
        inside, outside = (rms(robot, tilt=sign * np.radians(end + way * outwards)) for way in (-0.02, 0.02))
        assert np.all((limits[0] <= inside) & (inside <= limits[1]))
        assert not np.all((limits[0] <= outside) & (outside <= limits[1]))


@pytest.mark.parametrize("case", ["as printed", "moduli × 1.4", "mass at the tip"])
def test_the_least_pair_keeps_all_bounds_and_less_of_both_does_not(found, case):
    robot, limits, region = load_robot("exonav-2"), bracket("exonav-2"), found["exonav-2"].regions[case]
    tilt, mass = region.least
    kept, less = (rms(robot, CASES[case], tilt=share * tilt, mass=share * mass) for share in (1.0, 0.93))
    assert np.all((limits[0] - 1e-6 <= kept) & (kept <= limits[1] + 1e-6))
    assert not np.all((limits[0] <= less) & (less <= limits[1]))
    active = np.abs(np.concatenate([kept - limits[0], limits[1] - kept])).argmin()
    assert region.edge == active


def test_more_freedom_admits_more(found):
    for each in found.values():
        for region in [*each.regions.values(), each.sideways]:
            assert np.all(region.margins_at_any_tensions >= region.margins - 1e-15)
        for scan in each.scans.values():
            for low, high in scan.windows():
                for k in range(4):
                    assert any(a - 1e-9 <= low and high <= b + 1e-9 for a, b in scan.windows(k))
                assert any(a - 1e-9 <= low and high <= b + 1e-9 for a, b in scan.windows(any_tensions=True))


def test_at_the_tip_both_masses_are_one(found):
    region = found["exonav-3"].regions
    assert region["as printed"].margins[..., 3] == pytest.approx(region["mass at the tip"].margins[..., 3], abs=1e-6)


def test_what_the_chapter_says_in_words(found):
    """Prototype 3: all places admit about 10 degrees, no mass does; prototype 4: they contradict each other."""
    third, fourth = found["exonav-3"].scans, found["exonav-4"]
    assert windows(third[TOWARDS].windows(), 1) == "9.7–10.0"
    assert all(third[TOWARDS].windows(k) for k in range(4))
    assert not third[CARRIED].windows()
    assert not third[ONE_RUN].windows()
    assert nearest(fourth) < -0.2e-3
    assert not common([fourth.scans[TOWARDS].windows(k) for k in (0, 2)])
    assert all(region.least is None for region in fourth.regions.values())
    facts: Any = chapter(list(found.values())).facts
    assert facts["never"] == ["P4"]
    assert facts["largest"]["of_all"] == "2.0 g"
    assert not facts["enough"]["Prototype\u00a04"]
    assert bound_name(2) == "¾, least"
    assert bound_name(7) == "1, most"
    assert not facts["all_alike"]


def test_intervals_end_where_the_line_crosses_zero():
    x = np.linspace(0.0, 10.0, 2001)
    assert np.ravel(positive(x, np.sin(x)[:, None])) == pytest.approx([0.0, np.pi, 2 * np.pi, 3 * np.pi], abs=1e-5)
    assert positive(x, np.ones((x.size, 2))) == [(0.0, 10.0)]
    assert positive(x, np.array([[1.0, -1.0]] * x.size)) == []
    coarse = np.array([0.0, 1.0, 2.0])
    assert positive(coarse, np.column_stack([coarse - 0.4, 1.7 - coarse])) == [pytest.approx((0.4, 1.7))]
    assert windows([], 1) == "—"
