"""Rods without tendons: elastica, bend, circle, Princeton beam, follower force, fold."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.optimize import brentq

import fold_oracles as folds
import follower_oracles as followers
import princeton as bench
import rucker_webster
from tendonrod import PlainRod, Robot, solve
from tendonrod.loads import PointLoad
from tendonrod.statics.branches import Branch, follow_branch

from . import Row, Table


def beam(**more) -> Robot:
    """1 m, EI = 1 N m2, next to no stretch and shear."""
    given = {"length": 1.0, "area": 1.0, "ix": 1e-12, "iy": 1e-12, "j": 2e-12, "youngs_modulus": 1e12}
    return Robot(name="beam", body=PlainRod(**given | {"shear_modulus": 1e12, "density": 0.0} | more))


# ---- elastica: Euler's cantilever

ELASTICA = {  # P L^2 / EI: transverse tip w / L, axial shortening / L
    1: (0.3017207738, 0.0564332363),
    2: (0.4934574804, 0.1606417208),
    5: (0.7137915236, 0.3876283607),
    10: (0.8106090249, 0.5549955978),
}


def elliptic(load: float) -> tuple[float, float]:
    """w / L and shortening / L by elliptic integrals."""
    p = brentq(lambda x: folds.elastica(load, x).alpha + 0.5 * np.pi, np.sqrt(0.5), 1 - 1e-12, xtol=1e-15)
    found = folds.elastica(load, float(p))  # type: ignore[arg-type]
    return found.y, 1.0 - found.x


def elastica() -> Table:
    rows = []
    for load, known in ELASTICA.items():
        tip = solve(beam(), (), tip_force=(load, 0.0, 0.0), accuracy=1e-11).tip
        for name, exact, found in zip(("w / L", "shortening / L"), known, (tip[0], 1.0 - tip[2]), strict=True):
            rows.append(Row(case=f"P L²/EI = {load}", quantity=name, reference=exact, computed=found))
    return Table(rows=tuple(rows), unit="", digits=10, within=6e-11)


def draw_elastica() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.6), layout="constrained")
    side, curve = figure.subplots(1, 2)
    s, loads = np.linspace(0.0, 1.0, 101), np.linspace(0.0, 12.0, 49)
    for load in ELASTICA:
        x, _, z = solve(beam(), (), tip_force=(load, 0.0, 0.0), s=s).position.T
        side.plot(z, x, label=f"{load}")
    side.set(xlabel="z / L", ylabel="x / L", aspect=1.0, xlim=(0, 1.02), ylim=(0, 0.9))
    side.legend(title="P L²/EI", loc="upper left")
    tips = np.array([solve(beam(), (), tip_force=(load, 0.0, 0.0)).tip for load in loads])
    marks = np.arange(1.0, 12.0)
    exact = np.array([elliptic(load) for load in marks])
    curve.plot(loads, tips[:, 0], color="tab:blue", label="w / L")
    curve.plot(loads, 1.0 - tips[:, 2], color="tab:red", label="shortening / L")
    curve.plot(marks, exact[:, 0], "k+", label="elliptic integrals")
    curve.plot(marks, exact[:, 1], "k+")
    curve.set(xlabel="P L²/EI", xlim=(0, 12), ylim=(0, 0.9))
    curve.legend()


# ---- Bathe and Bolourchi's bend

BEND_PRINTED = {300: ("22.5", "59.2", "39.5"), 600: ("15.9", "47.2", "53.4")}


def bent_beam() -> Robot:
    """45 degrees of a circle of radius 100 in the x-z plane, square of side 1, nu = 0; unit by unit in SI."""
    return Robot(
        name="bend",
        body=PlainRod(
            length=25.0 * np.pi, area=1.0, ix=1 / 12, iy=1 / 12, j=1 / 6, youngs_modulus=1e7, shear_modulus=0.5e7,
            density=0.0, precurvature=(0.0, 0.01, 0.0),
        ),
    )  # fmt: skip


def bend() -> Table:
    rows = []
    for force, printed in BEND_PRINTED.items():
        load = {"tip_force": (0.0, float(force), 0.0)}
        tip = solve(bent_beam(), (), **load, accuracy=1e-8).tip
        exact = rucker_webster.solve(rucker_webster.from_robot(bent_beam(), (), **load)).tip
        for name, i, text in zip(("radial, x", "along, z", "across, y"), (0, 2, 1), printed, strict=True):
            rows.append(Row(case=f"P = {force}", quantity=name, reference=exact[i], computed=tip[i], printed=text))
    return Table(rows=tuple(rows), unit="", digits=5, within=1e-6, printed="Bathe & Bolourchi 1979")


def draw_bend() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(6.0, 5.6), layout="constrained")
    top, side = figure.subplots(2, 1, sharex=True, height_ratios=[36, 60])
    s = np.linspace(0.0, 25.0 * np.pi, 81)
    for force in (0, 150, 300, 450, 600):
        x, y, z = solve(bent_beam(), (), tip_force=(0.0, float(force), 0.0), s=s).position.T
        (line,) = top.plot(z, x)
        side.plot(z, y, color=line.get_color(), label=f"{force}")
    top.set(ylabel="x, radial", aspect=1.0, xlim=(-2, 75), ylim=(-2, 34))
    side.set(xlabel="z", ylabel="y, along the force", aspect=1.0, ylim=(-2, 58))
    side.legend(title="P", loc="upper left")


# ---- end moment to a circle

TURNS = (0.5, 1.0, 2.0)


def circle() -> Table:
    rows = []
    for turns in TURNS:
        moment = 2.0 * np.pi * turns
        tip = solve(beam(), (), tip_moment=(0.0, moment, 0.0), accuracy=1e-11).tip
        exact = bench.end_moment(1.0, 1.0, moment, np.array([1.0]))[0]
        for name, i in (("x / L", 0), ("z / L", 2)):
            case = f"M = {turns:g} × 2πEI/L"
            rows.append(Row(case=case, quantity=name, reference=exact[i], computed=tip[i]))
    return Table(rows=tuple(rows), unit="", digits=10, within=1e-10)


def draw_circle() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
    s = np.linspace(0.0, 1.0, 161)
    for turns in (0.125, 0.25, 0.5, 0.75, 1.0, 2.0):
        moment = 2.0 * np.pi * turns
        x, _, z = solve(beam(), (), tip_moment=(0.0, moment, 0.0), s=s).position.T
        (line,) = axes.plot(z, x, label=f"{turns:g}")
        exact = bench.end_moment(1.0, 1.0, moment, s[::20])
        axes.plot(exact[:, 2], exact[:, 0], ".", color=line.get_color())
    axes.set(xlabel="z / L", ylabel="x / L", aspect=1.0)
    axes.legend(title="M L / 2πEI", loc="upper left", bbox_to_anchor=(1.0, 1.0))


# ---- the Princeton beam


def bar() -> Robot:
    given = bench.Bar()
    return Robot(
        name="princeton",
        body=PlainRod(
            length=given.length, area=given.area, ix=given.I_x, iy=given.I_y, j=given.J, youngs_modulus=given.E,
            shear_modulus=given.G, density=0.0,
        ),
    )  # fmt: skip


def hung(weight: float, degrees: float) -> bench.TipMotion:
    shape = solve(bar(), (), tip_force=bench.weight_force(weight, np.radians(degrees)), accuracy=1e-8)
    return bench.tip_motion(shape.tip, shape.at([shape.length]).rotation[0], bench.Bar().length)


def princeton() -> Table:
    rows = []
    for weight in (8.896, 13.345):
        for degrees in (30.0, 60.0):
            found, exact = hung(weight, degrees), bench.princeton(weight, np.radians(degrees))
            at = bench.ANSYS_ANGLES.index(degrees)
            chord, flap = (values[at] for values in bench.ANSYS[weight])
            for name, printed in (("flap", flap), ("chord", chord)):
                rows.append(
                    Row(
                        case=f"{weight} N, {degrees:g}°", quantity=name, reference=1e3 * getattr(exact, name),
                        computed=1e3 * getattr(found, name), printed=f"{printed:.3f}",
                    )
                )  # fmt: skip
    return Table(rows=tuple(rows), unit="mm", digits=5, within=2e-4, printed="ANSYS (mm)")


def draw_princeton() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.6), layout="constrained")
    axes = dict(zip(("flap", "chord"), figure.subplots(1, 2), strict=True))
    degrees = np.linspace(0.0, 90.0, 31)
    for weight in bench.WEIGHTS:
        found = [hung(weight, each) for each in degrees]
        for name, each in axes.items():
            each.plot(degrees, [1e3 * getattr(tip, name) for tip in found], label=f"{weight} N")
    for weight, (chord, flap) in bench.ANSYS.items():
        label = "ANSYS" if weight == 8.896 else None
        axes["flap"].plot(bench.ANSYS_ANGLES, flap, "k+", label=label, clip_on=False)
        axes["chord"].plot(bench.ANSYS_ANGLES, chord, "k+", clip_on=False)
    for name, each in axes.items():
        each.set(xlabel="load angle (degrees)", ylabel=f"{name} displacement (mm)", xlim=(0, 90), ylim=(0, None))
        each.set_xticks(range(0, 91, 15))
    axes["flap"].legend(loc="upper left")


# ---- a force that follows the tip


def follower() -> Table:
    rows = []
    for load in (2.0, 5.0, followers_pi(), 20.0):
        exact = followers.transverse_follower(load)
        shape = solve(beam(), (), loads=[PointLoad(force=(load, 0.0, 0.0), frame="body")], accuracy=1e-9)
        case = f"P L²/EI = {load:.5g}"
        for name, value, found in (("z / L", exact.x, shape.tip[2]), ("x / L", exact.y, shape.tip[0])):
            rows.append(Row(case=case, quantity=name, reference=value, computed=found))
    return Table(rows=tuple(rows), unit="", digits=8, within=4e-8)


def followers_pi() -> float:
    """P L^2 / EI at which the tip has turned by 180 degrees: 4 K(1/2)^2."""
    from scipy.special import ellipk

    return float(4.0 * ellipk(0.5) ** 2)


def draw_follower() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(6.0, 4.2), layout="constrained")
    s = np.linspace(0.0, 1.0, 121)
    for load in (2.0, 5.0, followers_pi(), 20.0):
        shape = solve(beam(), (), loads=[PointLoad(force=(load, 0.0, 0.0), frame="body")], s=s)
        x, _, z = shape.position.T
        (line,) = axes.plot(z, x, label=f"{load:.4g}")
        dead = solve(beam(), (), tip_force=(load, 0.0, 0.0), s=s).position
        axes.plot(dead[:, 2], dead[:, 0], ":", linewidth=1.0, color=line.get_color())
        push = 0.13 * shape.rotation[-1][:, 0]
        arrow = {"arrowstyle": "->", "color": line.get_color(), "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (z[-1] + push[2], x[-1] + push[0]), (z[-1], x[-1]), arrowprops=arrow)
    axes.set(xlabel="z / L", ylabel="x / L", aspect=1.0)
    axes.legend(title="P L²/EI", loc="upper left", bbox_to_anchor=(1.0, 1.0))


# ---- the fold of a buckled strip whose compression turns

FOLD_LOAD = 2.0 * folds.EULER


def strip() -> Robot:
    """EI_y = 1 N m2; a hundred times stiffer out of the plane and in torsion."""
    return beam(ix=1e-8, iy=1e-10, j=1e-8, youngs_modulus=1e10, shear_modulus=1e10)


@cache
def strip_branch() -> Branch:
    """All equilibria from the buckled strip on, through the fold, until the force is axial again."""
    start = solve(strip(), (), tip_force=(0.05, 0.0, -FOLD_LOAD))  # a small push says to which side
    start = solve(strip(), (), tip_force=turned_force(0.0), start=start, accuracy=1e-9)
    return follow_branch(start, lambda alpha: {"tip_force": turned_force(alpha)}, (0.0, 0.7))


def turned_force(alpha: float) -> tuple[float, float, float]:
    return -FOLD_LOAD * np.sin(alpha), 0.0, -FOLD_LOAD * np.cos(alpha)


def exact_at(alpha: float, stable: bool) -> folds.Elastica:
    """The equilibrium at this angle on the stable or the unstable side of the fold."""
    if stable:
        return folds.stable_branch(FOLD_LOAD, alpha)
    end = folds.fold(FOLD_LOAD).modulus
    p = brentq(lambda x: folds.elastica(FOLD_LOAD, x).alpha - alpha, 1e-9, end, xtol=1e-15)
    return folds.elastica(FOLD_LOAD, float(p))  # type: ignore[arg-type]


def fold() -> Table:
    branch, end = strip_branch(), folds.fold(FOLD_LOAD)
    (turn,) = branch.folds
    rows = [Row(case="fold", quantity="α (rad)", reference=end.alpha, computed=float(turn.parameter))]
    for name, value, found in (("z / L", end.x, turn.tip[2]), ("x / L", end.y, turn.tip[0])):
        rows.append(Row(case="fold", quantity=name, reference=value, computed=float(found)))
    for k in (turn.index // 2, (turn.index + len(branch)) // 2):
        side = "stable" if k < turn.index else "unstable"
        exact, tip = exact_at(branch.parameter[k], k < turn.index), branch.tip[k]
        for name, value, found in (("z / L", exact.x, tip[2]), ("x / L", exact.y, tip[0])):
            case = f"{side}, α = {branch.parameter[k]:.4f} rad"
            rows.append(Row(case=case, quantity=name, reference=value, computed=float(found)))
    return Table(rows=tuple(rows), unit="", digits=8, within=2e-7)


def draw_fold() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.6), layout="constrained")
    side, turned = figure.subplots(1, 2)
    branch, end = strip_branch(), folds.fold(FOLD_LOAD)
    (turn,) = branch.folds
    tips = np.degrees([np.arctan2(*branch.shape(k).rotation[-1][[0, 2], 2]) for k in range(len(branch))])
    alpha, before = np.degrees(branch.parameter), np.arange(len(branch)) <= turn.index
    turned.plot(alpha[before], tips[before], color="tab:blue", label="stable")
    turned.plot(alpha[turn.index :], tips[turn.index :], "--", color="tab:blue", label="unstable")
    moduli = np.linspace(0.02, folds.buckled(FOLD_LOAD).modulus, 19)
    exact = [folds.elastica(FOLD_LOAD, p) for p in moduli]
    turned.plot(*np.degrees([[each.alpha, each.tip_angle] for each in exact]).T, "k+", label="elliptic functions")
    turned.plot(np.degrees(end.alpha), np.degrees(end.tip_angle), "o", color="tab:red", label="fold")
    turned.set(xlabel="turning angle α of the force (degrees)", ylabel="tip angle (degrees)")
    turned.legend(loc="lower right")
    after = turn.index + (len(branch) - turn.index) // 2
    for k, colour in ((0, "tab:green"), (turn.index, "tab:red"), (after, "tab:blue")):
        x, _, z = branch.shape(k).at(np.linspace(0.0, 1.0, 81)).position.T
        style = "-" if k <= turn.index else "--"
        side.plot(z, x, style, color=colour, label=f"{alpha[k]:.1f}°")
        start = z[-1] + 0.22 * np.cos(branch.parameter[k]), x[-1] + 0.22 * np.sin(branch.parameter[k])
        arrow = {"arrowstyle": "->", "color": colour, "shrinkA": 0, "shrinkB": 0}
        side.annotate("", (z[-1], x[-1]), start, arrowprops=arrow)
    side.set(xlabel="z / L", ylabel="x / L", aspect=1.0, xlim=(-0.05, 1.0), ylim=(-0.03, 0.95))
    side.legend(title="α", loc="lower right")
