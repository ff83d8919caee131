"""Chapter: follow-the-leader motion, the paper's Fig. 4 and Fig. 8 for prototype 1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..motion.follow_leader import PLANNING_ACCURACY, plan_follow_leader
from ..motion.plan import Plan
from ..motion.progression import progress
from ..plot import plan_figure
from ..robot import Robot
from . import paper
from .chapter import Chapter, Number, Picture, Table, interval, mm
from .figures import tension_figure
from .results import TOLERANCES, Commanded, Plans

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MIDDLE = TOLERANCES[1]
_MOST = f"{paper.TARGET_TENSIONS[-1]:g} N"
_STILL = (0.0, 0.0, 0.0)


def plans(robot: Robot, steps: int, watch: Callable[[str], None]) -> Plans:
    """Plan everything; ``steps`` per plan."""
    plan = partial(plan_follow_leader, robot, steps=steps)
    watch("plans without and with gravity")
    still = tuple(plan(tension, _STILL) for tension in paper.TARGET_TENSIONS)
    heavy = tuple(plan(tension, paper.GRAVITY) for tension in paper.TARGET_TENSIONS)
    full = plan(paper.TARGET_TENSIONS[-1], paper.GRAVITY, freedom="full")
    watch("the paper's search")
    searches = {
        tolerance: plan(paper.TARGET_TENSIONS[-1], paper.GRAVITY, freedom="paper", tolerance=tolerance)
        for tolerance in TOLERANCES
    }
    soft = robot.replace(torsion="homogenized")
    return Plans(
        still=still,
        heavy=heavy,
        full=full,
        searches=searches,
        homogenized=plan_follow_leader(soft, paper.TARGET_TENSIONS[-1], paper.GRAVITY, steps=steps),
        fitted=commanded(heavy[-1], heavy[-1].polynomial(2)),
        printed=commanded(heavy[-1], np.array(paper.FTL_POLYNOMIAL)),
    )


def commanded(plan: Plan, polynomial: np.ndarray) -> Commanded:
    """Errors against the reference of ``plan`` where the tension follows ``polynomial`` (N, highest power first)."""
    from scipy.integrate import simpson

    tension = np.polyval(polynomial, plan.progress)
    nodes, steps = plan.shapes[0].s.size, plan.shapes[0].steps  # those of the plan, and Simpson's rule as there
    solved = {"gravity": plan.gravity, "accuracy": PLANNING_ACCURACY, "steps": steps}
    motion = progress(plan.robot, plan.progress, 0.0, tension, samples=nodes, **solved)
    distances = np.array([plan.reference.project(shape.position).distance for shape in motion.shapes])
    ahead = plan.reference.at(plan.progress * plan.robot.length_na)
    return Commanded(
        tension=tension,
        tip_error=distances[:, -1],
        tip_error_at_progress=np.linalg.norm(motion.tip - ahead, axis=1),
        body_rms=np.sqrt(simpson(distances**2, dx=1.0 / (nodes - 1))),
    )


def chapter(found: Plans) -> Chapter:
    """Figures and tables of the chapter."""
    best = found.heavy[-1]
    return Chapter(
        name="following",
        title="Follow-the-leader motion",
        tables=(_fit_table(found), _accuracy_table(found)),
        pictures=_pictures(found),
        facts={
            "below": interval((plan.target_tension - plan.tension[0] for plan in found.heavy), 3),
            "largest_error": mm(max(plan.tip_error.max() for plan in found.heavy)),
            "better": Number(paper.FTL_TIP_RMSE_SIMULATED / best.tip_rmse, 1),
            "largest_still_error": Number(1e9 * max(plan.body_max.max() for plan in found.still), 3),
            "sag_share": Number(100 * (1 - best.tension[0] / best.target_tension), 1),
            "rmse": mm(best.tip_rmse, 3),
            "rmse_at_progress": mm(best.tip_rmse_at_progress, 3),
            "rmse_search": mm(found.searches[MIDDLE].tip_rmse),
            "rmse_printed": mm(rms(found.printed.tip_error)),
            "rmse_printed_at_progress": mm(rms(found.printed.tip_error_at_progress)),
            "rmse_paper": mm(paper.FTL_TIP_RMSE_SIMULATED, 4),
            "first": Number(best.tension[0], 3),
            "last": Number(best.tension[-1], 3),
            "rotation": Number(float(np.degrees(np.abs(found.full.rotation).max())), 2),
            "gain": Number(float(best.body_rms.max() / found.full.body_rms.max()), 1),
            "fit": polynomial_text(best.polynomial(2)),
            "printed_fit": polynomial_text(np.array(paper.FTL_POLYNOMIAL)),
            "printed_end": Number(float(np.polyval(paper.FTL_POLYNOMIAL, 1.0)), 3),
            "printed_low": Number(_lowest(), 3),
            "trials": interval((1e3 * trial for trial in paper.FTL_TIP_RMSE_TRIALS), 2),
            "tolerances": ", ".join(f"{1e3 * tolerance:g}" for tolerance in TOLERANCES),
        },
    )


def polynomial_text(coefficients: np.ndarray) -> str:
    """0.6492 η² − 0.5159 η + 0.6088."""
    a, b, c = (Number(float(value), 4) for value in coefficients)
    return f"{a} <i>η</i>² {_signed(b)} <i>η</i> {_signed(c)}"


def rms(errors: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def _signed(number: Number) -> str:
    return f"{'−' if number.value < 0 else '+'} {str(number).lstrip('−')}"


def _lowest() -> float:
    a, b, c = paper.FTL_POLYNOMIAL
    return c - b * b / (4 * a)


def _accuracy_table(found: Plans) -> Table:
    named = [
        *((f"<code>tension</code>, {plan.target_tension:g} N, no gravity", plan) for plan in found.still),
        *((f"<code>tension</code>, {plan.target_tension:g} N, gravity", plan) for plan in found.heavy),
        (f"<code>full</code>, {_MOST}, gravity", found.full),
        *(
            (f"<code>paper</code>, tolerance {1e3 * tolerance:g} mm, {_MOST}, gravity", plan)
            for tolerance, plan in found.searches.items()
        ),
        (f"<code>tension</code>, homogenized torsion, {_MOST}, gravity", found.homogenized),
    ]
    rows: list[list[str | Number]] = [
        [
            name,
            mm(plan.tip_rmse, 3),
            mm(plan.tip_rmse_at_progress, 3),
            mm(plan.body_rms.max(), 3),
            mm(plan.body_max.max(), 3),
        ]
        for name, plan in named
    ]
    for name, run in (
        ("our quadratic fit, commanded", found.fitted),
        ("the paper's polynomial, commanded", found.printed),
    ):
        errors = (mm(rms(run.tip_error), 3), mm(rms(run.tip_error_at_progress), 3), mm(run.body_rms.max(), 3))
        rows.append([f"{name}, {_MOST}, gravity", *errors, "–"])
    trials = interval((1e3 * trial for trial in paper.FTL_TIP_RMSE_TRIALS), 4)
    for name, value in (
        ("simulation", str(mm(paper.FTL_TIP_RMSE_SIMULATED, 4))),
        ("three trials on the bench", trials),
    ):
        rows.append([f"<i>printed, {name} (metric not stated)</i>", f"<i>{value}</i>", "–", "–", "–"])
    return Table(
        name="following-accuracy",
        header=(
            "plan",
            "tip RMSE, projected (mm)",
            "tip RMSE at <i>η</i> (mm)",
            "worst body rms (mm)",
            "worst body point (mm)",
        ),
        rows=rows,
    )


def _fit_table(found: Plans) -> Table:
    rows: list[list[str | Number]] = []
    for plan in (*found.still, *found.heavy):
        load = "with gravity" if np.any(plan.gravity) else "no gravity"
        rows.append([f"<i>τ</i><sub>des</sub> = {plan.target_tension:g} N, {load}", *_coefficients(plan.polynomial(2))])
    rows.append([f"<code>full</code>, {_MOST}, with gravity", *_coefficients(found.full.polynomial(2))])
    search = f"<code>paper</code>, {1e3 * MIDDLE:g} mm, {_MOST}, with gravity"
    rows.append([search, *_coefficients(found.searches[MIDDLE].polynomial(2))])
    rows.append([f"<i>the paper's fit, {_MOST}, with gravity</i>", *_coefficients(np.array(paper.FTL_POLYNOMIAL))])
    return Table(
        name="following-polynomials",
        header=("plan", "<i>a</i> (N)", "<i>b</i> (N)", "<i>c</i> (N)", "<i>τ</i>(0.5) (N)", "<i>τ</i>(1) (N)"),
        rows=rows,
    )


def _coefficients(polynomial: np.ndarray) -> list[Number]:
    ends = (float(np.polyval(polynomial, eta)) for eta in (0.5, 1.0))
    tidy = np.where(np.abs(polynomial) < 5e-5, 0.0, polynomial)  # no minus zero
    return [*(Number(float(value), 4) for value in tidy), *(Number(value, 4) for value in ends)]


def _pictures(found: Plans) -> Sequence[Picture]:

    freedoms = [found.heavy[-1], found.full, found.searches[MIDDLE]]
    names = ["tension only", "tension and rotation (full)", f"the paper's search ({1e3 * MIDDLE:g} mm)"]
    figures: list[tuple[str, Callable[[], Figure]]] = [
        ("following-without-gravity", partial(plan_figure, found.still)),
        ("following-with-gravity", partial(plan_figure, found.heavy)),
        ("following-tension", partial(tension_figure, found)),
        ("following-freedoms", partial(plan_figure, freedoms, names)),
    ]
    return [Picture(name=name, draw=draw) for name, draw in figures]
