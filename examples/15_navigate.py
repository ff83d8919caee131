"""A session: ExoNav 1 goes half way round the printed cord, to its ventral side."""

from math import radians

import numpy as np

from tendonrod.navigate.commands import Jog
from tendonrod.navigate.metrics import metrics
from tendonrod.navigate.scenario import load_scenario
from tendonrod.navigate.script import Move, play
from tendonrod.navigate.session import Session

scenario = load_scenario("exonav-1", "printed")  # homogenized torsion, gravity -x
tube = {"height": 83.65e-3, "offset": 0.5e-3, "depth": 5.25e-3}  # m
tube |= {"tilt": radians(20.5), "lean": radians(0.6)}
moves = (
    Move(duration=6.85, jog=Jog(tension=0.1), tube=tube),  # to 0.685 N, still inside
    Move(duration=0.51, jog=Jog(rotation=radians(-30.0))),
    Move(duration=18.4, jog=Jog(insertion=3e-3)),
)
snapshots = list(play(Session(scenario), moves, step=0.1))
found = metrics(snapshots)
arrival, gap = found.targets["ventral@T10"], found.clearance["cord"]

# it must get there without touching anything, and the body must follow the tip
assert arrival.within_limits, found.exceeded
assert min(each.value for each in found.clearance.values()) > 0.1e-3, found.clearance
assert found.follow_the_leader_rms < 0.1e-3, found.follow_the_leader_rms


def show() -> None:
    import matplotlib.pyplot as plt

    from tendonrod.plot.slices import outlines

    _, axes = plt.subplots(1, 2, figsize=(7.0, 3.2), layout="constrained")
    (section, course), tip = axes, snapshots[-1].tip
    for structure in scenario.phantom.structures.values():
        for x, y in (1e3 * line.T for line in outlines(*structure.mesh, tip[2])):
            section.plot(y, x, lw=1.0, color="0.5")
    x, y, _ = 1e3 * snapshots[-1].centerline.T
    section.plot(y, x, lw=3.0)
    section.set(xlabel="y, to the patient's right (mm)", ylabel="x, dorsal (mm)")
    section.set_aspect("equal")
    section.invert_xaxis()  # seen from cranial
    out = [each for each in snapshots if each.exposed > 0.0]
    length = 1e3 * np.array([each.exposed for each in out])
    for name in scenario.phantom.structures:
        least = [1e3 * each.clearance[name].min() for each in out]
        course.plot(length, least, label=f"to the {name}")
    course.set(xlabel="insertion (mm)", ylabel="least clearance (mm)", ylim=(0.0, None))
    course.legend()
    plt.show()


if __name__ == "__main__":
    print(f"from ventral@T10 (mm): {1e3 * arrival.nearest:.2f}")
    print(f"least clearance to the cord (mm): {1e3 * gap.value:.2f}")
    show()
