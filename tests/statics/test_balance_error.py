"""The balance check: small on every solved shape, falling with the accuracy, and up with every fault put in."""

import dataclasses
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tendonrod import Robot, Shape, Tendon, load_robot, solve
from tendonrod.body import TaperedRod
from tendonrod.loads import DistributedLoad, LumpedMass, PointLoad
from tendonrod.statics import panels
from tendonrod.statics.balance import balance_error, balance_errors
from tendonrod.surface import Plane
from textbook import GRAVITY, helix_rod, prototype, rod

DEFAULT, FINE = 1e-5, 1e-8  # largest error at the default accuracy and at 1e-10
EXAMPLES = Path(__file__).parents[2] / "examples"
TAPERED = Robot(
    name="tapered",
    body=TaperedRod(
        length=0.2, base_radius=1e-3, tip_radius=0.4e-3, youngs_modulus=75e9, shear_modulus=25e9, density=6255.0
    ),
    tendons=(
        Tendon.constant(x=2e-3, y=0.0),
        Tendon.sampled((0.0, 0.05, 0.1, 0.15, 0.2), (0.0, 1e-3, 2e-3, 1e-3, 0.0), (1e-3, 0.0, 0.0, 1e-3, 2e-3)),
    ),
)
TWO = load_robot(EXAMPLES / "two-segment.toml")
L = prototype(1).length_na
TIP = {"tip_force": (2e-3, -3e-3, 1e-3), "tip_moment": (2e-5, 1e-5, -3e-5)}
LINE = {"distributed_force": (0.05, 0.05, -0.1), "distributed_moment": (1e-4, 2e-4, -1e-4)}
PLACED = {"exit_tilt": (0.02, 0.01), "exit_offset": (1e-4, 0.0), "rotation": 0.4}
POINTS = (
    PointLoad(force=(2e-3, 1e-3, 0.0), at=0.4 * L, offset=(1e-3, 0.0, 2e-3)),
    PointLoad(force=(1e-3, 0.0, 1e-3), moment=(1e-5, 2e-5, 0.0), at=0.6 * L, frame="body"),
    LumpedMass(mass=2e-4, at=0.8 * L, offset=(0.0, 1e-3, 0.0)),
    LumpedMass(mass=1e-4),
)
SPREAD = (
    DistributedLoad(
        force=(0.02, 0.0, 0.0), force_end=(0.0, 0.05, 0.0), moment=(1e-4, 0.0, 0.0), start=0.3 * L, end=0.5 * L
    ),
    DistributedLoad(force=(0.02, 0.01, 0.0), moment=(1e-4, 0.0, 0.0), start=0.1 * L, frame="body"),
)

UNIFORM = {
    **{f"exonav-{k}": (prototype(k), 0.7, {"gravity": GRAVITY}) for k in (1, 2, 3, 4)},
    **{f"exonav-{k} open": (prototype(k, "open_section"), 0.9, {"gravity": (3.0, -8.0, 4.0)}) for k in (1, 4)},
    "no load": (prototype(1), 0.7, {}),
    "no tension": (prototype(1), 0.0, {"gravity": GRAVITY}),
    "tip": (prototype(2, "open_section"), 0.5, {"gravity": GRAVITY, **TIP}),
    "line": (prototype(3), 0.9, {"gravity": GRAVITY, **LINE, **PLACED, "insertion": 0.8}),
    "a tenth": (prototype(1), 0.9, {"gravity": GRAVITY, **TIP, "insertion": 0.1}),
    "a micrometre": (prototype(1), 0.9, {"gravity": GRAVITY, **TIP, "insertion": 1e-5}),
    "helical": (helix_rod(), (6.0, 3.0, 1.0), {"gravity": (0.0, -9.81, 0.0), "tip_moment": (2e-3, 0.0, 1e-3)}),
    "helical, no load": (helix_rod(), (6.0, 3.0, 1.0), {}),
    "no tendon": (rod(), (), {"gravity": GRAVITY, "tip_force": (0.1, 0.2, -0.1)}),
}
# Rods whose strains or loads change within a step: their rows between nodes are of third order (docs/method), so that
# the error there is larger: (robot, tensions, arguments, bound at the default accuracy, bound at 1e-10).
GENERAL = {
    "centroid": (prototype(1), 0.7, {"gravity": GRAVITY, "centroid_weight": True}, DEFAULT, FINE),
    "points": (prototype(1), 0.7, {"gravity": GRAVITY, "loads": POINTS}, DEFAULT, FINE),
    "points, inserted": (prototype(1), 0.7, {"gravity": GRAVITY, "loads": POINTS, "insertion": 0.5}, DEFAULT, FINE),
    "segments": (TWO, (0.7, 0.5), {"gravity": GRAVITY, "tip_force": (1e-3, 0.0, 0.0)}, DEFAULT, FINE),
    "segments, lifted": (TWO, (0.07, 0.5), {"gravity": GRAVITY}, DEFAULT, FINE),
    "turned segments": (TWO.replace(segment2_angle=0.6), (0.7, 0.5), {"gravity": GRAVITY, **PLACED}, DEFAULT, FINE),
    "pulled": (prototype(1), 0.0, {"gravity": GRAVITY, "displacements": 2e-3}, DEFAULT, FINE),
    "spread": (prototype(1), 0.7, {"gravity": GRAVITY, "loads": SPREAD}, 1e-4, 1e-6),
    "all": (prototype(1), 0.7, {"gravity": GRAVITY, "loads": POINTS + SPREAD, "insertion": 0.85, **PLACED}, 1e-4, 1e-6),
    "tapered": (TAPERED, (5.0, 3.0), {"gravity": GRAVITY, "tip_force": (0.1, 0.2, 0.1)}, 2e-4, 1e-6),
}
each_uniform = pytest.mark.parametrize("case", UNIFORM.values(), ids=UNIFORM.keys())
each_general = pytest.mark.parametrize("case", GENERAL.values(), ids=GENERAL.keys())


@each_uniform
def test_small_at_the_default_accuracy_and_smaller_at_a_finer_one(case):
    robot, tensions, arguments = case
    assert balance_error(solve(robot, tensions, **arguments)) < DEFAULT
    assert balance_error(solve(robot, tensions, **arguments, accuracy=1e-10)) < FINE


@each_general
def test_small_for_every_kind_of_robot_and_load(case):
    robot, tensions, arguments, coarse, fine = case
    assert balance_error(solve(robot, tensions, **arguments)) < coarse
    assert balance_error(solve(robot, tensions, **arguments, accuracy=1e-10)) < fine


def test_falls_with_the_accuracy():
    errors = [balance_error(solve(prototype(1), 0.7, GRAVITY, accuracy=a)) for a in (1e-6, 1e-8, 1e-10)]
    assert all(fine < 0.1 * coarse for coarse, fine in pairwise(errors))


def test_falls_with_the_steps_at_their_order():
    errors = [balance_error(solve(prototype(1), 0.7, GRAVITY, **TIP, steps=n)) for n in (16, 32, 64)]
    assert 10.0 < errors[0] / errors[1] < 30.0
    assert 10.0 < errors[1] / errors[2] < 30.0


@each_uniform
def test_own_quadrature_is_fine_enough(case, monkeypatch):
    """With panels a third as long the errors of the rows stay what they are."""
    robot, tensions, arguments = case
    shape = solve(robot, tensions, **arguments)
    error = balance_error(shape)
    monkeypatch.setattr(panels, "TURN", 1.0)
    assert balance_error(shape) == pytest.approx(error, rel=0.3, abs=1e-10)


def test_point_load_at_a_joint():
    """At a joint of segments whose neutral axes differ, the load acts where it does just before and just beyond it."""
    joined = TWO.replace(segment2_angle=0.6)
    at = joined.joints[0, 0]
    shapes = [
        solve(joined, (0.7, 0.5), loads=(PointLoad(force=(0.0, 0.05, 0.0), at=s),), accuracy=1e-8)
        for s in (at - 1e-7, at, at + 1e-7)
    ]
    assert max(shape.balance_error() for shape in shapes) < DEFAULT
    assert np.linalg.norm(shapes[1].tip - 0.5 * (shapes[0].tip + shapes[2].tip)) < 1e-6


def test_friction_and_contact_take_part():
    rubbing = prototype(1).replace(tendons=tuple(replace(each, friction=0.15) for each in prototype(1).tendons))
    assert balance_error(solve(rubbing, 0.7, GRAVITY)) < 2e-4
    wall = Plane(point=(0.0, 0.015, 0.0), normal=(0.0, -1.0, 0.0))
    touching = solve(prototype(1), 0.7, GRAVITY, surface=wall)
    assert touching.contacts.force.sum() > 1e-3
    assert balance_error(touching) < 2e-3  # the touch is short, and its force known at the integrator's stages only


def test_a_shape_that_did_not_converge_has_no_error():
    crushed = solve(prototype(1), 1e5, throw=False)
    assert not crushed.converged
    assert np.isnan(balance_error(crushed))
    assert np.isnan(balance_errors(crushed).moment.error)


def test_a_retracted_robot_is_in_balance():
    assert balance_error(solve(prototype(1), 0.7, GRAVITY, insertion=0.0)) == 0.0


class Impostor(Shape):
    """What is asked in one shape, with rows that come from elsewhere."""

    def at(self, s) -> Shape:
        return replace(Shape.at(self, s), _rows=vars(self)["rows_at"](s))


def impostor(asked: Shape, rows_at) -> Shape:
    """``asked`` with the rows (n, 24) that ``rows_at`` gives at arc lengths (n,)."""
    made = Impostor(**{each.name: getattr(asked, each.name) for each in dataclasses.fields(Shape)})
    object.__setattr__(made, "rows_at", rows_at)
    object.__setattr__(made, "_rows", rows_at(asked.s))
    return made


def posing_as(asked: Shape, other: Shape) -> Shape:
    """The rows of ``other`` as an answer to what was asked in ``asked``."""
    return impostor(asked, lambda s: other.at(np.minimum(s, other.length))._rows)


BASE = {"robot": prototype(1), "tensions": 0.7, "gravity": GRAVITY, "accuracy": 1e-9, **TIP, **LINE}
LOADED = {**BASE, "loads": POINTS + SPREAD, "centroid_weight": True}


def more(name: str, base: dict = BASE):
    return lambda d: {name: (1.0 + d) * np.asarray(base[name])}


def other_load(i: int, field: str):
    def change(d: float) -> dict:
        loads = list(LOADED["loads"])
        value = getattr(loads[i], field)
        changed = tuple((1.0 + d) * np.array(value)) if np.ndim(value) else (1.0 + d) * value
        loads[i] = replace(loads[i], **{field: changed})
        return {"loads": tuple(loads)}

    return change


def other_robot(name: str):
    return lambda d: {"robot": prototype(1).replace(**{name: (1.0 + d) * prototype(1).parameters()[name]})}


FAULTS = {  # what is wrong by a share d, in which of the two bases
    "tension": (BASE, more("tensions")),
    **{name: (BASE, more(name)) for name in ("gravity", "tip_force", "tip_moment", *LINE)},
    **{name: (BASE, other_robot(name)) for name in ("youngs_modulus", "shear_modulus", "density")},
    **{name: (BASE, other_robot(name)) for name in ("uncut_angle", "turns")},
    "rotation": (BASE, lambda d: {"rotation": d}),
    "tilt": (BASE, lambda d: {"exit_tilt": (0.0, d)}),
    "position": (BASE, lambda d: {"exit_offset": (d * L, 0.0)}),
    "point force": (LOADED, other_load(0, "force")),
    "point offset": (LOADED, other_load(0, "offset")),
    "follower force": (LOADED, other_load(1, "force")),
    "follower moment": (LOADED, other_load(1, "moment")),
    "mass": (LOADED, other_load(2, "mass")),
    "tip mass": (LOADED, other_load(3, "mass")),
    "end of a line force": (LOADED, other_load(4, "end")),
    "line force": (LOADED, other_load(4, "force_end")),
    "line moment": (LOADED, other_load(4, "moment")),
    "follower line force": (LOADED, other_load(5, "force")),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_the_answer_to_another_question_is_found_out(fault):
    """Rows of a problem that differs by a share d: the error grows as d, far above that of the right answer."""
    base, changed = fault
    asked = solve(**base)
    honest = balance_error(asked)
    small, large = (balance_error(posing_as(asked, solve(**{**base, **changed(d)}))) for d in (2e-3, 2e-2))
    assert 7.0 < large / small < 13.0
    assert small > 20.0 * honest


def test_a_point_load_in_the_wrong_place_is_found_out():
    """Between the two places the force is wrong by all of the load, however near they are."""
    asked = solve(**LOADED)
    moved = solve(**{**LOADED, **other_load(0, "at")(2e-3)})
    errors = balance_errors(posing_as(asked, moved))
    assert errors.force.error > 0.1
    assert errors.force.s == pytest.approx(LOADED["loads"][0].at, rel=2e-3)


@pytest.mark.parametrize("part", ["position", "rotation", "section_force", "section_moment", "force", "moment"])
def test_each_equation_is_checked(part):
    """A fault d in the rows, in the part's own unit and growing along s, shows in that part, and as d."""
    shape = solve(**BASE)
    columns = {"position": 0, "rotation": 3, "section_force": 12, "section_moment": 15, "force": 18, "moment": 21}

    def wrong(d: float):
        def rows_at(s):
            rows = shape.at(s)._rows.copy()
            column = columns[part] + np.arange(9 if part == "rotation" else 3)
            rows[:, column] *= 1.0 + d * (s / shape.length)[:, None]
            return rows

        return balance_errors(impostor(shape, rows_at))

    honest, small, large = (getattr(wrong(d), part).error for d in (0.0, 1e-4, 1e-3))
    assert small > 100.0 * honest
    assert 8.0 < large / small < 12.0


def test_rows_at_shifted_places_are_found_out():
    shape = solve(**BASE)
    shifted = impostor(shape, lambda s: shape.at(np.minimum(np.asarray(s) + 1e-5, shape.length))._rows)
    assert balance_error(shifted) > 1e-4


def test_a_single_jump_is_found_out_and_placed():
    """From s = 0.6 L on the section is turned by 1e-4 rad."""
    shape, d = solve(**BASE), 1e-4
    turn = np.array([[1.0, -d, 0.0], [d, 1.0, 0.0], [0.0, 0.0, 1.0]])

    def rows_at(s):
        rows = shape.at(s)._rows.copy()
        beyond = np.asarray(s) > 0.6 * shape.length
        rows[beyond, 3:12] = (rows[beyond, 3:12].reshape(-1, 3, 3) @ turn).reshape(-1, 9)
        return rows

    found = balance_errors(impostor(shape, rows_at))
    assert found.section_moment.error > 1e-5
    assert found.rotation.s > 0.55 * shape.length
    assert found.rotation.error > 1e-5


def test_rows_that_the_shape_holds_are_checked_too():
    """`Shape.at` gives good rows, but those at ``s`` are damaged."""
    shape = solve(**BASE)
    rows = shape._rows.copy()
    rows[3, 1] += 1e-4 * shape.length
    errors = balance_errors(replace(shape, _rows=rows))
    assert errors.rows.error == pytest.approx(1e-4, rel=1e-6)
    assert errors.rows.s == shape.s[3]
    assert errors.largest == errors.rows.error


def test_what_is_not_a_number_does_not_pass():
    shape = solve(**BASE)

    def rows_at(s):
        rows = shape.at(s)._rows.copy()
        rows[len(rows) // 2, 20] = np.nan
        return rows

    assert not balance_error(impostor(shape, rows_at)) <= 1.0
