"""Chapter: the paper's misprints and modelling choices, and what each does to the tip of prototype 1 at 0.7 N."""

from __future__ import annotations

from functools import partial
from math import pi

import numpy as np

from ..robot import Robot
from ..statics.equilibrium import solve
from . import misprints, paper
from .chapter import Cell, Chapter, Number, Picture, Table, mm
from .figures import misprint_figure
from .results import Misprints

TENSION = paper.LARGEST_TENSION
SAMPLES = misprints.SAMPLES
_STILL = (0.0, 0.0, 0.0)
_LOADS = (_STILL, paper.GRAVITY)


def misprint_effects(robot: Robot) -> Misprints:
    """Solve all variants for ``robot``."""
    s = np.linspace(0.0, robot.length_na, SAMPLES)
    given = [misprints.equations(robot, TENSION, gravity) for gravity in _LOADS]
    share = robot.section.L / robot.section.L_na
    by_model = {
        model: tuple(solve(robot.replace(torsion=model), TENSION, gravity, s=s) for gravity in _LOADS)
        for model in ("open_section", "homogenized")
    }
    return Misprints(
        robot=robot,
        right=tuple(solve(robot, TENSION, gravity, s=s, accuracy=1e-9) for gravity in _LOADS),
        check=tuple(each.body() for each in given),
        moment_term=tuple(misprints.with_printed_moment_term(each).body() for each in given),
        inertia=tuple(misprints.with_printed_inertia(each, robot).body() for each in given),
        centroid=tuple(misprints.with_weight_at_centroid(each, robot).body() for each in given),
        weight_per_length=tuple(
            solve(robot, TENSION, tuple(share * np.array(gravity)), s=s, accuracy=1e-9) for gravity in _LOADS
        ),
        **by_model,
    )


def chapter(found: Misprints, robots: list[Robot]) -> Chapter:
    """Table of misprints with their effects, and a figure of the two that matter."""
    return Chapter(
        name="corrections",
        title="The paper’s misprints and what each does",
        tables=(_misprint_table(found), _inertia_table(robots)),
        pictures=(
            Picture(
                name="misprints",
                draw=partial(misprint_figure, found),
            ),
        ),
        facts={
            "moved": [mm(value) for value in found.moved("moment_term")],
            "check": Number(1e9 * max(found.moved("check")), 1),
            "wavelength": Number(1e3 * ringing_wavelength(found), 2),
            "inertia": mm(found.moved("inertia")[0], 1),
            "centroid": Number(1e6 * found.moved("centroid")[1], 2),
            "drift": mm(misprints.base_drift(found.robot, 0.5), 1),
        },
    )


def ringing_wavelength(found: Misprints) -> float:
    """Wavelength (m) of the printed equations' fastest mode about the tip's strains, from the rates' eigenvalues."""
    given = misprints.with_printed_moment_term(misprints.equations(found.robot, TENSION))
    v, u = given.tip_strains()
    state = np.concatenate([np.zeros(3), np.eye(3).ravel(), v, u])
    arms = 1e-7 * np.diag(np.maximum(1.0, np.abs(state)))[12:]
    slopes = [(given.rates(0.0, state + arm) - given.rates(0.0, state - arm))[12:] / (2.0 * arm.max()) for arm in arms]
    return float(2.0 * pi / np.abs(np.linalg.eigvals(np.array(slopes).T).imag).max())


_TORSION = "<i>E</i>(<i>I</i><sub>x</sub> + <i>I</i><sub>y</sub>)"
_PLACES = (  # where, printed, right, and which solution of `Misprints` shows the effect
    (
        "eq. (5), third term of <b>b</b>",
        "−<i>û K</i><sub>se</sub>(<i>v</i> − <i>v</i>*)",
        "−<i>v̂ K</i><sub>se</sub>(<i>v</i> − <i>v</i>*)",
        "moment_term",
    ),
    (
        "eqs. (8), (9)",
        "<i>I</i><sub>x</sub>: +sin <i>ψ</i>, <i>I</i><sub>y</sub>: −sin <i>ψ</i>",
        "signs exchanged",
        "inertia",
    ),
    (
        "II-C, <i>p</i>(0) at <i>η</i> = 0.5",
        "<i>p</i>*((1−<i>η</i>) <i>L</i><sub>na</sub>)",
        "shifted by −(1−<i>η</i>)<i>L</i>, turned by <i>φ</i><sub>p</sub>",
        "drift",
    ),
    ("<i>I</i><sub>z</sub> after eq. (9): model", _TORSION, "<i>GJ</i> of the open section", "open_section"),
    ("the same", _TORSION, "finite-element cell, all factors", "homogenized"),
    ("eq. (18), <b>f</b><sub>e</sub>: choice", "at the neutral axis", "at the cell’s mass centroid", "centroid"),
    ("eq. (17), <i>λ</i>: choice", "per length of <i>s</i>", "per length of the tube", "weight_per_length"),
    (
        "after eq. (3)",
        "<i>ṗ</i><sub>t</sub> a “unit tangent”",
        "the path’s rate, normalised in <i>K</i><sub>11</sub>",
        None,
    ),
    ("after eq. (2)", "hat maps to <i>SO</i>(3)", "to its Lie algebra, <i>so</i>(3)", None),
)


def _misprint_table(found: Misprints) -> Table:
    rows = [[place, printed, right, *_effect(found, name)] for place, printed, right, name in _PLACES]
    return Table(
        name="misprints",
        header=("place", "printed", "right", "tip moves, no load (mm)", "tip moves, gravity (mm)"),
        rows=rows,
    )


def _effect(found: Misprints, name: str | None) -> list[Cell]:
    if name is None:
        return ["notation only", "notation only"]
    moved = [misprints.base_drift(found.robot, 0.5)] * 2 if name == "drift" else found.moved(name)
    return [mm(value, 2) if value > 1e-5 else (mm(value, 5) if value > 1e-8 else "0") for value in moved]


def _inertia_table(robots: list[Robot]) -> Table:
    rows: list[list[Cell]] = []
    for name, values in (("printed", misprints.printed_inertia), ("right", _right_inertia)):
        for k, axis in enumerate("xy"):
            rows.append(
                [f"<i>I</i><sub>{axis}</sub> {name} (mm⁴)", *(Number(1e12 * values(robot)[k], 6) for robot in robots)]
            )
    return Table(
        name="second-moments",
        header=("", *(f"P{k + 1}" for k in range(len(robots)))),
        rows=rows,
    )


def _right_inertia(robot: Robot) -> tuple[float, float]:
    return robot.section.I_x, robot.section.I_y
