"""Rods that touch a floor and the walls of a channel, against exact planar shooting."""

from __future__ import annotations

from functools import cache

import numpy as np

import contact_oracles as planar
from tendonrod import PlainRod, Robot, Shape, solve
from tendonrod.surface import Plane, Tube

from . import Row, Table

LENGTH, RADIUS, GAP, CLEARANCE = 0.1, 0.25e-3, 0.01, 0.002  # m
FLOOR_LOADS = (5.0, 30.0, 150.0)  # q L^4 / (EI gap)
WALLS = {1: "upper wall", -1: "lower wall"}
PRECURVATURES = (4.0, 12.0, 20.0)  # 1/m


def rod(curvature: float = 0.0) -> Robot:
    body = PlainRod(
        length=LENGTH, radius=RADIUS, youngs_modulus=75e9, shear_modulus=25e9, density=0.0,
        precurvature=(0.0, curvature, 0.0),
    )  # fmt: skip
    return Robot(name="rod", body=body)


def stiffness() -> dict[str, float]:
    section = rod().section
    return {"EI": section.Kbt[1], "GA": section.Kse[0], "EA": section.Kse[2]}


FINE = {"accuracy": 1e-6, "contact_tolerance": 1e-6}


@cache
def on_floor(load: float, exact: bool) -> Shape | planar.PlanarShape:
    q = load * stiffness()["EI"] * GAP / LENGTH**4
    if exact:
        return planar.floor_contact(LENGTH, q=q, gap=GAP, **stiffness())
    below = Plane(point=(GAP + RADIUS, 0.0, 0.0), normal=(-1.0, 0.0, 0.0))
    return solve(rod(), (), distributed_force=(q, 0.0, 0.0), surface=below, **FINE)


@cache
def in_channel(curvature: float, exact: bool) -> Shape | planar.PlanarShape:
    if exact:
        return planar.channel_contact(LENGTH, curvature=curvature, clearance=CLEARANCE, **stiffness())
    tube = Tube(point=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), radius=CLEARANCE + RADIUS)
    return solve(rod(curvature), (), surface=tube, **FINE)


def compared(case: str, exact: planar.PlanarShape, shape: Shape, names: dict[int, str]) -> list[Row]:
    """Tip, base moment and the force of each wall by side and name."""
    at, contacts = exact.at(np.array([LENGTH])), shape.contacts
    assert contacts is not None
    values = [
        ("tip z (mm)", 1e3 * at["z"][0], 1e3 * shape.tip[2]),
        ("base moment (mN m)", 1e3 * exact.base_moment, 1e3 * shape.moment[0, 1]),
    ]
    for side, name in names.items():
        on = contacts.normal[:, 0] * side < 0.0
        carried = float(np.abs(contacts.force[on] * contacts.normal[on, 0]).sum())
        should = sum(each.force for each in exact.touches if each.side == side)
        should += exact.rod.line[0] * exact.contact_length * (side == 1)
        if should > 0.0 or carried > 0.0:
            values.append((f"{name} (mN)", 1e3 * should, 1e3 * carried))
    return [Row(case=case, quantity=name, reference=float(a), computed=float(b)) for name, a, b in values]


def floor() -> Table:
    rows = []
    for load in FLOOR_LOADS:
        rows += compared(f"q L⁴/(EI h) = {load:g}", on_floor(load, True), on_floor(load, False), {1: "floor"})
    return Table(rows=tuple(rows), unit="", digits=3, within=1e-3, relative=True)


def draw_floor() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.5, 3.4), layout="constrained")
    side, bending = figure.subplots(1, 2)
    s = np.linspace(0.0, LENGTH, 121)
    for load in FLOOR_LOADS:
        exact, there = on_floor(load, True).at(s[::8]), on_floor(load, False).at(s)
        (line,) = side.plot(1e3 * there.position[:, 2], 1e3 * there.position[:, 0], label=f"{load:g}")
        side.plot(1e3 * exact["z"], 1e3 * exact["x"], ".", color=line.get_color())
        bending.plot(1e3 * s, 1e3 * there.moment[:, 1], color=line.get_color())
        bending.plot(1e3 * s[::8], 1e3 * exact["moment"], ".", color=line.get_color())
    side.axhspan(1e3 * GAP, 1e3 * GAP + 1.0, color="0.85")
    side.set(xlabel="z (mm)", ylabel="x of the axis (mm)", ylim=(1e3 * GAP + 1.0, -1.0), xlim=(0, 102))
    side.legend(title="q L⁴/(EI h)", loc="lower left")
    bending.set(xlabel="s (mm)", ylabel="moment (mN m)", xlim=(0, 102))


def channel() -> Table:
    rows = []
    for curvature in PRECURVATURES:
        rows += compared(f"u*_y = {curvature:g} 1/m", in_channel(curvature, True), in_channel(curvature, False), WALLS)
    return Table(rows=tuple(rows), unit="", digits=3, within=2e-3, relative=True)


def draw_channel() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    s = np.linspace(0.0, LENGTH, 161)
    for curvature in PRECURVATURES:
        exact, shape = in_channel(curvature, True), in_channel(curvature, False)
        there = shape.at(s).position
        (line,) = axes.plot(1e3 * there[:, 2], 1e3 * there[:, 0], label=f"{curvature:g} 1/m")
        at = exact.at(s[::8])
        axes.plot(1e3 * at["z"], 1e3 * at["x"], ".", color=line.get_color())
        for touch in exact.touches:
            place = exact.at(np.array([touch.s]))
            axes.plot(1e3 * place["z"], 1e3 * place["x"] + 0.14 * touch.side, "v" if touch.side > 0 else "^",
                      color=line.get_color(), markersize=5, clip_on=False)  # fmt: skip
    for side in (-1, 1):
        axes.axhspan(1e3 * side * CLEARANCE, 1e3 * side * (CLEARANCE + 0.4e-3), color="0.85")
    axes.set(xlabel="z (mm)", ylabel="x of the axis (mm)", ylim=(-2.4, 2.4), xlim=(0, 102))
    axes.legend(title="natural curvature", loc="upper left")
