"""Rods and ExoNav with tendons: routings, anchors, friction, the free tendon's arm."""

from __future__ import annotations

import dataclasses
from functools import cache
from itertools import pairwise

import numpy as np

import actuation_oracles as acting
import princeton as bench
import rucker_webster
from tendonrod import PlainRod, Robot, Shape, Tendon, load_robot, solve

from . import Row, Table


def rod(*tendons: Tendon) -> Robot:
    """0.2 m of nitinol, radius 0.5 mm."""
    body = PlainRod(length=0.2, radius=0.5e-3, youngs_modulus=75e9, shear_modulus=25e9, density=6255.0)
    return Robot(name="rod", body=body, tendons=tendons)


# ---- straight and helical routing

PULLED, DOWN = (15.0, 0.0, 0.0, 0.0), (9.81, 0.0, 0.0)


def four_tendons(turns: float) -> Robot:
    """Steel, radius 1 mm, 0.5 m, four tendons 15.06 mm from the axis."""
    body = PlainRod(length=0.5, radius=1e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8000.0)
    tendons = [Tendon.helical(offset=15.06e-3, angle=0.5 * np.pi * i, turns=turns) for i in range(4)]
    return Robot(name="four tendons", body=body, tendons=tuple(tendons))


def routing() -> Table:
    cases = []
    for turns, name in ((0.0, "straight, weight"), (1.0, "helical, weight")):
        robot = four_tendons(turns)
        exact = rucker_webster.solve(rucker_webster.from_robot(robot, PULLED, gravity=DOWN)).tip
        cases.append((name, exact, solve(robot, PULLED, gravity=DOWN, accuracy=1e-9).tip))
    robot = four_tendons(1.0)
    section, tau = robot.section, PULLED[0]
    exact = bench.helical_tendon(0.5, section.Kse, section.Kbt, 15.06e-3, 0.0, 4.0 * np.pi, tau)[0]
    cases.append(("helical, no weight", exact, solve(robot, PULLED, accuracy=1e-10).tip))
    rows = [
        Row(case=name, quantity=axis, reference=1e3 * exact[i], computed=1e3 * tip[i])
        for name, exact, tip in cases
        for i, axis in enumerate("xyz")
    ]
    return Table(rows=tuple(rows), unit="mm", digits=5, within=2e-6)


def draw_routing() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.5), layout="constrained")
    views = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=[255, 120])
    s = np.linspace(0.0, 0.5, 121)
    for column, (turns, title) in enumerate(((0.0, "straight routing"), (1.0, "helical routing, one turn"))):
        shape = solve(four_tendons(turns), PULLED, gravity=DOWN, s=s)
        for row, (i, name) in enumerate(((0, "x (mm)"), (1, "y (mm)"))):
            axes = views[row, column]
            for k in range(4):
                path = 1e3 * shape.tendon_path(k)
                style = {"color": "tab:red", "linewidth": 1.3} if k == 0 else {"color": "0.65", "linewidth": 0.7}
                label = ("tendon 1, 15 N", "slack tendons", None, None)[k]
                axes.plot(path[:, 2], path[:, i], **style, label=label)
            axes.plot(1e3 * shape.position[:, 2], 1e3 * shape.position[:, i], "tab:blue", linewidth=2, label="rod")
            axes.set(aspect="equal", ylim=(-35, 220) if i == 0 else (-35, 85))
            if column == 0:
                axes.set(ylabel=name)
        views[0, column].set(title=title)
        views[1, column].set(xlabel="z (mm)")
    views[0, 1].legend(loc="upper left")


# ---- two tendons in opposition, a tendon that ends half way

OFFSET, END = 1.5e-3, 0.1


def anchors() -> Table:
    rows = []
    section = rod().section
    for tau in (5.0, 20.0):
        robot = rod(Tendon.constant(x=OFFSET, y=0.0), Tendon.constant(x=-OFFSET, y=0.0))
        exact = bench.opposed_tendons(0.2, section.Kse[2], tau)
        tip = solve(robot, tau, accuracy=1e-12).tip
        for name, i in (("x", 0), ("z", 2)):
            case = f"opposed, {tau:g} N"
            rows.append(Row(case=case, quantity=name, reference=1e3 * exact[i], computed=1e3 * tip[i]))
    for tau in (2.0, 6.0):
        exact = bench.half_way_tendon(0.2, section.Kbt[1], section.Kse[2], OFFSET, tau, END)
        tip = solve(rod(Tendon.constant(x=OFFSET, y=0.0, end=END)), tau, accuracy=1e-12).tip
        for name, i in (("x", 0), ("z", 2)):
            case = f"half way, {tau:g} N"
            rows.append(Row(case=case, quantity=name, reference=1e3 * exact[i], computed=1e3 * tip[i]))
    return Table(rows=tuple(rows), unit="mm", digits=7, within=1e-7)


def draw_anchors() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(7.5, 2.4), layout="constrained")
    s = np.linspace(0.0, 0.2, 121)
    half, pair = rod(Tendon.constant(x=OFFSET, y=0.0, end=END)), (OFFSET, -OFFSET)
    for tau in (2.0, 4.0, 6.0, 8.0):
        shape = solve(half, tau, s=s)
        (line,) = axes.plot(1e3 * shape.position[:, 2], 1e3 * shape.position[:, 0], label=f"half way, {tau:g} N")
        end = 1e3 * shape.at([END]).position[0]
        axes.plot(end[2], end[0], "o", markersize=4, color=line.get_color())
    both = solve(rod(*(Tendon.constant(x=x, y=0.0) for x in pair)), 20.0, s=s).position
    axes.plot(1e3 * both[:, 2], 1e3 * both[:, 0], "k", label="opposed, 20 N each")
    axes.set(xlabel="z (mm)", ylabel="x (mm)", aspect=1.0)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.05))


# ---- friction: up, down and up again

CYCLE, MU = (0.5, 0.7, 0.62, 0.4, 0.2, 0.45, 0.7), 0.1


def prototype(**tendon) -> Robot:
    robot = load_robot("exonav-1")
    return robot.replace(tendons=tuple(dataclasses.replace(each, **tendon) for each in robot.tendons))


@cache
def pulled_in_turn(mu: float, tensions: tuple[float, ...]) -> list[Shape]:
    """ExoNav 1 after each of these tensions in a row."""
    robot, shape, found = prototype(friction=mu), None, []
    for tau in tensions:
        shape = solve(robot, tau, history=shape, accuracy=1e-8)
        found.append(shape)
    return found


@cache
def rubbed_in_turn(mu: float, tensions: tuple[float, ...]) -> list[acting.Profile]:
    before, found = None, []
    for tau in tensions:
        before = acting.rubbed(acting.rod_of(prototype()), tau, mu, before)
        found.append(before)
    return found


def hysteresis() -> Table:
    rows, arrows = [], ("", *("↑" if b > a else "↓" for a, b in pairwise(CYCLE)))
    pairs = zip(CYCLE, arrows, rubbed_in_turn(MU, CYCLE), pulled_in_turn(MU, CYCLE), strict=True)
    for tau, arrow, exact, shape in pairs:
        for i, axis in ((1, "y"), (2, "z")):
            values = 1e3 * exact.tip[i], 1e3 * shape.tip[i]
            rows.append(Row(case=f"{tau:g} N {arrow}", quantity=axis, reference=values[0], computed=values[1]))
    return Table(rows=tuple(rows), unit="mm", digits=6, within=1e-6)


def draw_hysteresis() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.8), layout="constrained")
    loop, along = figure.subplots(1, 2)
    exact = rubbed_in_turn(MU, CYCLE)
    top, bottom = (1e3 * exact[CYCLE.index(tau)].displacement() for tau in (max(CYCLE), min(CYCLE)))
    ways = (0.0, top), (top, bottom), (bottom, top)
    lengths = np.concatenate([[0.0], *(np.linspace(a, b, 26)[1:] for a, b in ways)])
    for mu, colour in ((0.0, "0.6"), (0.1, "tab:blue"), (0.2, "tab:orange")):
        loop.plot(lengths, pulled_by_length(mu, tuple((1e-3 * lengths).tolist())), color=colour, label=f"μ = {mu:g}")
    loop.plot([1e3 * each.displacement() for each in exact], CYCLE, "k+", label="exact, μ = 0.1")
    loop.set(xlabel="pulled length (mm)", ylabel="tension at the exit (N)", xlim=(0, None), ylim=(0, None))
    loop.legend(loc="upper left")
    s = np.linspace(0.0, load_robot("exonav-1").length_na, 201)
    styles = (("pulled to 0.70 N", 4.0, "0.8"), ("back to 0.62 N", 1.5, "tab:blue"), ("back to 0.40 N", 1.5, "tab:red"))
    for k, (text, width, colour) in enumerate(styles, start=1):
        along.plot(1e3 * s, tension_along(pulled_in_turn(MU, CYCLE)[k], s), color=colour, linewidth=width, label=text)
        marks = s[5::15]
        along.plot(1e3 * marks, [exact[k].tau(each) for each in marks], "k+")
    along.set(xlabel="s (mm)", ylabel="tension along the tendon (N)", ylim=(0.26, 0.72), title="μ = 0.1")
    along.legend(loc="lower left")


@cache
def pulled_by_length(mu: float, lengths: tuple[float, ...]) -> list[float]:
    """Tension (N) of ExoNav 1 after each of these pulled lengths (m) in a row."""
    robot, shape, found = prototype(friction=mu), None, []
    for length in lengths:
        shape = solve(robot, displacements=length, history=shape)
        found.append(float(shape.tensions[0]))
    return found


def tension_along(shape: Shape, s: np.ndarray) -> np.ndarray:
    """Tension (N) of the one tendon, from the section's balance alone: -Kse (v - v*) . t without external load."""
    there, section = shape.at(s), shape.robot.section
    r = shape.robot.tendon_position(0, there.material_coordinate)
    q = np.cross(there.u, r) + there.v
    t = q / np.linalg.norm(q, axis=1, keepdims=True)
    return -np.einsum("ni,ni->n", section.Kse * (there.v - section.v_star), t)


# ---- the arm of a tendon that is free in the lumen


def lumen() -> tuple[float, float]:
    """x of the tube's axis and the tendon's reach from it, m."""
    robot = load_robot("exonav-1")
    return robot.section.r_na, robot.body.inner_radius - robot.tendons[0].radius  # pyright: ignore


def lift_off() -> float:
    return acting.lift_off_tension(acting.rod_of(prototype()), *lumen())


def screw_axis(shape: Shape) -> float:
    """x (m) where the section's screw axis crosses its x axis: there a tendon's path is shortest."""
    u, v = shape.u[0], shape.v[0]
    return float((u[1] * v[2] - u[2] * v[1]) / (u[1] ** 2 + u[2] ** 2))


def arm() -> Table:
    rows = []
    for share in (0.1, 0.5, 0.9):
        tau = share * lift_off()
        exact = acting.free_arm(acting.rod_of(prototype()), tau, *lumen())
        shape = solve(prototype(wall="free"), tau, accuracy=1e-11)
        case = f"{1e3 * tau:.3f} mN"
        rows.append(Row(case=case, quantity="x (mm)", reference=1e3 * exact.r[0], computed=1e3 * screw_axis(shape)))
        rows.append(Row(case=case, quantity="u_y (1/m)", reference=exact.state.u[1], computed=shape.u[0, 1]))
    return Table(rows=tuple(rows), unit="", digits=8, within=1e-8)


def draw_arm() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.6), layout="constrained")
    bend, place = figure.subplots(1, 2)
    tensions, threshold, (centre, reach) = np.linspace(0.0, 0.1, 61), lift_off(), lumen()
    wall = load_robot("exonav-1").tendon_position(0, [0.0])[0, 0]
    found = {each: [solve(prototype(wall=each), tau) for tau in tensions] for each in ("held", "free")}
    for each, style in (("held", {"color": "0.6"}), ("free", {"color": "tab:blue"})):
        bend.plot(1e3 * tensions, [shape.u[0, 1] for shape in found[each]], **style, label=f"tendon {each}")
    free = np.minimum([screw_axis(shape) for shape in found["free"]], wall)
    place.plot(1e3 * tensions, np.full_like(tensions, 1e3 * wall), color="0.6")
    place.plot(1e3 * tensions, 1e3 * free, color="tab:blue")
    marks = threshold * np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    oracle = [acting.free_arm(acting.rod_of(prototype()), tau, centre, reach) for tau in marks]
    bend.plot(1e3 * marks, [each.state.u[1] for each in oracle], "k+", label="least energy, exact")
    place.plot(1e3 * marks, [1e3 * each.r[0] for each in oracle], "k+")
    place.axhline(1e3 * centre, color="0.8", linewidth=0.8)
    place.annotate("tube's axis", (100, 1e3 * centre), ha="right", va="bottom", color="0.4")
    place.annotate("wall", (3, 1e3 * wall), ha="left", va="top", color="0.4")
    for axes in (bend, place):
        axes.axvline(1e3 * threshold, color="tab:red", linewidth=0.8, label="lift-off")
        axes.set(xlabel="tension (mN)", xlim=(0, 100))
    bend.set(ylabel="bending $u_y$ (1/m)", ylim=(0, None))
    place.set(ylabel="tendon's place x (mm)")
    bend.legend(loc="upper left")
