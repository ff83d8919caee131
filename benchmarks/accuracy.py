"""How accurate the statics are: literature problems, an independent formulation, convergence order, random problems.

    python benchmarks/accuracy.py [PROBLEMS] [SEED]        # 2000 random problems by default

The random problems: a preset with every dimension times 0.8 to 1.2, psi 60 to 200 degrees, -2 to 2 turns, any torsion
model, tension up to the plateau, gravity in any direction, a tip force up to 0.9 of Euler's load in any direction,
insertion 0.02 to 1. Each is solved at the default accuracy and at 0.1 nm; both must converge and agree.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

import tendonrod
from tendonrod import NotConverged, PlainRod, Robot, Tendon, solve
from tendonrod.statics.limits import PLATEAU_STRAIN, euler_loads, fibre_strain

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import rucker_webster  # the oracle that the tests use: the differential form, integrated by SciPy

GRAVITY = (-9.81, 0.0, 0.0)


def plain_rod(*tendons: Tendon, **body) -> Robot:
    return Robot(name="rod", body=PlainRod(**body), tendons=tendons)


def literature() -> list[tuple[str, np.ndarray, np.ndarray, float]]:
    """(name, computed, published, unit of the last digit printed) of problems with known answers; m."""
    rows = []
    for n, tension, tip in ((1, 0.7, (-1.14080, 21.75197, 66.56249)), (1, 0.2, (-1.69335, 7.17254, 74.33657))):
        shape = solve(tendonrod.load_robot(f"exonav-{n}"), tension, GRAVITY, accuracy=1e-9)
        rows.append((f"exonav-{n}, {tension} N, gravity (mm)", 1e3 * shape.tip, np.array(tip), 1e-5))
    slender = plain_rod(length=1.0, radius=1e-5, youngs_modulus=200e9, shear_modulus=80e9, density=8000.0)
    EI = slender.section.Kbt[0]
    known = {1: (0.3017207738, 0.0564332363), 5: (0.7137915236, 0.3876283607), 10: (0.8106090249, 0.5549955978)}
    for k, (w, shortening) in known.items():
        tip = solve(slender, tip_force=(k * EI, 0.0, 0.0), accuracy=1e-10).tip
        rows.append(
            (f"elastica, PL^2/EI = {k} (L)", np.array([tip[0], 1.0 - tip[2]]), np.array([w, shortening]), 1e-10)
        )
    bend = plain_rod(
        length=25.0 * np.pi, area=1.0, ix=1 / 12, iy=1 / 12, j=1 / 6,
        youngs_modulus=1e7, shear_modulus=0.5e7, density=1.0, precurvature=(0.0, 0.01, 0.0),
    )  # fmt: skip
    for force, tip in ((300.0, (22.24478, 40.19189, 58.77912)), (600.0, (15.68480, 53.47486, 47.15044))):
        got = solve(bend, tip_force=(0.0, force, 0.0)).tip
        rows.append((f"Bathe's 45 degree bend, P = {force:.0f}", got, np.array(tip), 1e-5))
    steel = {"length": 0.5, "radius": 1e-3, "youngs_modulus": 200e9, "shear_modulus": 80e9, "density": 8000.0}
    for turns, tip in ((0.0, (0.182212, 0.0, 0.453229)), (1.0, (0.0122099, 0.0581888, 0.493348))):
        tendons = [Tendon.helical(offset=15.06e-3, angle=0.5 * np.pi * i, turns=turns) for i in range(4)]
        got = solve(plain_rod(*tendons, **steel), (15.0, 0.0, 0.0, 0.0), (9.81, 0.0, 0.0)).tip
        rows.append((f"four tendons, {turns:.0f} turns (m)", got, np.array(tip), 1e-6))
    return rows


def random_problem(rng: np.random.Generator, presets: list[Robot]):
    """(robot, tension, gravity, tip force, insertion) of the distribution in the docstring above."""
    robot = presets[rng.integers(4)]
    size, scale = robot.parameters(), lambda: rng.uniform(0.8, 1.2)
    inner, wall = size["inner_radius"] * scale(), (size["outer_radius"] - size["inner_radius"]) * scale()
    robot = robot.replace(
        inner_radius=inner, outer_radius=inner + wall, length=size["length"] * scale(),
        notch_width=size["notch_width"] * scale(), notch_spacing=size["notch_spacing"] * scale(),
        uncut_angle=np.deg2rad(rng.uniform(60.0, 200.0)), turns=rng.uniform(-2.0, 2.0),
        torsion=str(rng.choice(["published", "open_section", "homogenized"])),
    )  # fmt: skip
    plateau = PLATEAU_STRAIN / fibre_strain(solve(robot, 1.0)).max()  # N; strain is nearly proportional to tension
    down, push = rng.normal(size=(2, 3))
    down *= 9.81 / np.linalg.norm(down)
    push *= rng.uniform(0.0, 0.9) * euler_loads(robot)[0] / np.linalg.norm(push)
    return robot, rng.uniform(0.0, plateau), down, push, rng.uniform(0.02, 1.0)


def campaign(count: int, seed: int) -> None:
    presets = [tendonrod.load_robot(name) for name in tendonrod.preset_names()]
    rng, worst, took, failed, differing = np.random.default_rng(seed), 0.0, [], [], []
    for k in range(count):
        robot, tension, down, push, insertion = random_problem(rng, presets)
        start = time.perf_counter()
        try:
            shape = solve(robot, tension, down, push, insertion=insertion)
            took.append(time.perf_counter() - start)
            exact = solve(robot, tension, down, push, insertion=insertion, accuracy=1e-10)
        except NotConverged as error:
            failed.append(f"problem {k} of seed {seed}: {error}")
            continue
        s = np.linspace(0.0, shape.length, 41)
        error = np.linalg.norm(shape.at(s).position - exact.at(s).position, axis=1).max()
        if error > 1e-4:
            differing.append(f"problem {k} of seed {seed}: {1e3 * error:.3g} mm apart, another equilibrium")
        else:
            worst = max(worst, error)
    print(f"\nrandom problems: {count}, not converged {len(failed)}, on different branches {len(differing)}")
    print(
        f"largest position error at the default accuracy of 1 um: {1e6 * worst:.3f} um; median time of a solve", end=" "
    )
    print(f"{1e6 * np.median(took):.0f} us")
    print("\n".join(failed + differing))


def main() -> None:
    count, seed = (int(value) for value in [*sys.argv[1:], *["2000", "1"][len(sys.argv) - 1 :]])
    print("literature and physics oracles: largest difference from the published digits (unit of the last digit)")
    for name, got, known, digit in literature():
        print(f"  {name:34s} {np.abs(got - known).max():8.1e}   ({digit:.0e})")

    robot = tendonrod.load_robot("exonav-1")
    print("\nagainst Rucker & Webster's differential form, integrated by SciPy at rtol 1e-12: tip distance")
    for tension, insertion, force in ((0.2, 1.0, (0, 0, 0)), (0.7, 1.0, (0, 0, 0)), (0.7, 0.5, (2e-3, 1e-3, -1e-3))):
        loads = {"gravity": GRAVITY, "insertion": insertion, "tip_force": force}
        oracle = rucker_webster.solve(rucker_webster.from_robot(robot, tension, **loads)).tip
        distance = np.linalg.norm(solve(robot, tension, accuracy=1e-10, **loads).tip - oracle)
        print(f"  {tension} N, insertion {insertion}, tip force {force} N: {1e9 * distance:.3f} nm")

    exact = solve(robot, 0.7, GRAVITY, accuracy=1e-12).tip
    errors = [np.linalg.norm(solve(robot, 0.7, GRAVITY, steps=n).tip - exact) for n in (8, 16, 32, 64)]
    print("\ntip error under gravity in 8, 16, 32, 64 steps:", ", ".join(f"{1e9 * e:.3g} nm" for e in errors))
    print("order of convergence:", ", ".join(f"{np.log2(a / b):.2f}" for a, b in pairwise(errors)))
    campaign(count, seed)


if __name__ == "__main__":
    main()
