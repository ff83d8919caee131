"""What data cannot tell is refused by name, and what they can hardly tell is said in a sentence that is true."""

from dataclasses import replace

import numpy as np
import pytest

from measurement.known_bench import ROBOT, along, blank, seen
from tendonrod import InvalidInput
from tendonrod.measurement.determinacy import HARDLY, check_determined
from tendonrod.measurement.identification import Problem, identify
from tendonrod.measurement.setup import Setup
from tendonrod.measurement.unknowns import unknowns

TRIAL = blank(np.linspace(0.1, 0.7, 7), along([0.4, 0.7, 1.0]))
TILTED = Setup(base_tilt_x=0.2, base_tilt_y=-0.1, tip_mass=3e-4)


@pytest.fixture(scope="module")
def laden():
    return seen([TRIAL], TILTED, seed=1)


@pytest.fixture(scope="module")
def weightless():
    return seen([replace(TRIAL, gravity=(0.0, 0.0, 0.0))], Setup(), seed=1)


def refusal(trials, free, **more) -> str:
    with pytest.raises(InvalidInput) as error:
        identify(trials, free, **more)
    assert error.value.field == "free"
    return str(error.value)


@pytest.mark.parametrize("name", ["tip_mass", "tracker_mass", "gravity_tilt_x", "density"])
def test_without_gravity_no_mass_and_no_direction_of_gravity_is_told(weightless, name):
    said = refusal(weightless, ["base_tilt_x", name])
    assert said == f"free = {name}: must be left out: the data do not depend on it, the trials' gravity is 0, 0, 0"


def test_the_zero_of_a_length_is_not_told_by_tensions(laden):
    said = refusal(laden, ["displacement_zero"])
    assert said.endswith("the data do not depend on it, tensions were measured and drive the model")


def test_gravity_turned_about_itself_changes_nothing(laden):
    assert refusal(laden, ["gravity_tilt_x"]).endswith("must be left out: the data do not depend on it")


def test_without_gravity_stiffness_and_tension_scale_are_one(weightless):
    said = refusal(weightless, ["youngs_modulus", "base_tilt_x", "tension_scale"])
    assert said.startswith("free = youngs_modulus and tension_scale: must be fewer: the data cannot tell these apart")
    assert "other tensions, gravity directions or tracked places" in said


def test_gravity_tells_stiffness_and_tension_scale_apart(laden):
    found = identify(laden, ["youngs_modulus", "tension_scale"], setup=TILTED)
    assert np.abs(found["tension_scale"] - 1.0) < 4.0 * found.standard_errors[1] < 0.5


def test_one_pose_cannot_tell_where_the_base_is_and_how_stiff_the_robot(weightless):
    """A bend in a plane: two numbers are seen, of three that move the tip in that plane."""
    one = replace(weightless[0].rows([4]), trackers=weightless[0].trackers)
    position = one.position.copy()
    position[:, :2] = np.nan
    one = replace(one, position=position)
    said = refusal([one], ["base_y", "youngs_modulus", "base_z"])
    assert said.startswith("free = base_y and youngs_modulus and base_z: must be fewer")
    assert refusal([one], ["base_x", "base_y", "youngs_modulus", "base_z"]).startswith(
        "free = base_y and youngs_modulus and base_z: must be fewer"
    )
    assert identify([one], ["base_y", "youngs_modulus"]).scale >= 0.0


def test_a_number_that_the_data_hardly_feel_is_refused_however_far_it_ran(laden):
    said = refusal(laden, ["shear_modulus"])
    assert said.startswith("free = shear_modulus: must be left out: the ")
    assert "data leave it uncertain by" in said or "fit runs away with it" in said
    assert said.endswith(" GPa")


def test_what_counts_is_what_is_plausible():
    """A column of length one half of a plausible departure's is told too little by an end, not by a start."""
    free = unknowns(["base_x"], [TRIAL], Setup())
    column = np.array([[0.5], [0.0]]) / free[0].plausible
    check_determined(free, column, [TRIAL])
    with pytest.raises(InvalidInput, match="uncertain by 20 mm"):
        check_determined(free, column, [TRIAL], np.zeros(1))
    check_determined(free, 2.1 * column, [TRIAL], np.zeros(1))
    with pytest.raises(InvalidInput, match="the fit runs away with it, to 5 mm"):
        check_determined(free, 0.0 * column, [TRIAL], np.array([5e-3]))


def test_fewer_numbers_than_unknowns_are_never_enough():
    free = unknowns(["base_x", "base_y"], [TRIAL], Setup())
    with pytest.raises(InvalidInput, match="base_x and base_y: must be fewer"):
        check_determined(free, np.array([[1e6, 1e6]]), [TRIAL])


def test_a_start_that_bends_in_a_plane_may_hide_torsion():
    """Where the fit starts, without tilt, torsion is hardly felt; where it ends it is told."""
    trials = seen([blank(np.linspace(0.1, 0.9, 12), TRIAL.trackers)], Setup(base_tilt_x=0.3, base_tilt_y=0.2), seed=2)
    cautious, free = [replace(trials[0], position_noise=1e-3)], ("base_tilt_x", "base_tilt_y", "torsion_factor")
    start = Problem(tuple(cautious), free, Setup(), False)
    X, G = start.misfit.slopes(start.at(start.start))
    white = start.misfit.whitened(X * start.unit, np.full(X.shape[:2], 1e-3), G, np.ones(len(X)))
    assert np.linalg.norm(white[:, 2]) < 1.2  # an error of nearly all that is plausible
    found = identify(cautious, free)
    assert found.standard_errors[2] < 0.6 * start.unit[2]
    assert abs(found["torsion_factor"] - ROBOT.parameters()["torsion_factor"]) < 4.0 * found.standard_errors[2]


def test_numbers_that_can_hardly_be_told_apart_are_named_and_none_else(laden):
    found = identify(laden, ["youngs_modulus", "base_tilt_x", "base_tilt_y", "tip_mass"])
    rho = np.triu(found.correlation, 1)
    alike = [(found.names[i], found.names[j]) for i, j in np.argwhere(np.abs(rho) >= HARDLY)]
    said = [each for each in found.sentences if "told apart" in each]
    assert len(alike) == len(said) >= 1
    for (a, b), each in zip(alike, said, strict=True):
        rho_ab = found.correlation[found.index(a), found.index(b)]
        assert each.startswith(f"{a} and {b} can hardly be told apart (correlation {rho_ab:.3f})")


def test_the_sentence_is_true_the_fit_is_hardly_worse_where_it_says(laden):
    found = identify(laden, ["base_tilt_y", "tip_mass"], setup=replace(TILTED, base_tilt_y=0.0, tip_mass=0.0))
    (said,) = [each for each in found.sentences if "told apart" in each]
    rho, errors = found.correlation[0, 1], found.standard_errors
    assert f"with tip_mass {'raised' if rho > 0.0 else 'lowered'} by" in said
    problem, (sigma, G) = found.problem, found.noise

    def squares(change) -> float:
        e = problem.misfit.errors(problem.at((found.values + change) / problem.unit))
        return float(np.sum(problem.misfit.whitened(e[..., None], sigma, G, found.weights) ** 2))

    best = squares(np.zeros(2))
    both, one = squares(np.array([errors[0], rho * errors[1]])), squares(np.array([errors[0], 0.0]))
    assert both - best == pytest.approx(found.scale**2, rel=0.5)
    assert one - best > 5.0 * (both - best)


def test_what_was_freed_may_not_explain_the_errors(laden):
    found = identify(laden, ["base_tilt_x"])
    (said,) = [each for each in found.sentences if "the noise that the trials state" in each]
    assert said.startswith(f"the errors left over are {found.scale:.2g} times the noise")
    assert found.scale > 1.3
    explained = identify(laden, ["base_tilt_x", "base_tilt_y", "tip_mass"])
    assert not any("noise that the trials state" in each for each in explained.sentences)


def test_stiffness_names_its_robot_where_trials_have_two(laden):
    other = replace(laden[0], name="b", robot=ROBOT.replace(youngs_modulus=60e9))
    with pytest.raises(
        InvalidInput, match=r"of one robot: exonav-1 comes with youngs_modulus 7\.?5\S* and 60000000000\.0"
    ):
        identify([*laden, other], ["youngs_modulus"])
