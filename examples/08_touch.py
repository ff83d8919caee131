"""Let ExoNav lean against a wall: where it touches, and with what force."""

import numpy as np

import tendonrod
from tendonrod.surface import Plane

robot = tendonrod.load_robot("exonav-1")
wall = Plane(point=(0.0, 0.015, 0.0), normal=(0.0, -1.0, 0.0))  # free below y = 15 mm
s = np.linspace(0.0, robot.length_na, 101)
load = {"tensions": 0.7, "gravity": (-9.81, 0.0, 0.0), "s": s}
free = tendonrod.solve(robot, **load)
held = tendonrod.solve(robot, **load, surface=wall)
contacts = held.contacts
assert contacts is not None  # a surface was given

# the wall carries what the robot presses with: the clamp feels weight and contact
weight = robot.section.line_density * robot.length_na * np.array([-9.81, 0.0, 0.0])
assert np.abs(contacts.total - (held.force[0] - weight)).max() < 1e-9
assert contacts.gap.min() > -1e-5  # m, the tolerance


def show() -> None:
    assert contacts is not None
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(6.5, 4.0), layout="constrained")
    axes = figure.subplots()
    radius = 1e3 * robot.outer_radius(s)
    for shape, colour, label in (
        (free, "0.7", "without the wall"),
        (held, "tab:blue", "with the wall"),
    ):
        _, y, z = 1e3 * shape.centerline.T
        axes.fill_between(z, y - radius, y + radius, color=colour, label=label)
    axes.axhspan(15.0, 16.5, color="0.85")
    middle = 1e3 * np.average(contacts.point, axis=0, weights=contacts.force)
    end = middle + 1e3 * contacts.total  # 1 mm for each millinewton
    arrow = {"arrowstyle": "->", "color": "tab:red", "linewidth": 1.5}
    tip, foot = (end[2], end[1]), (middle[2], middle[1])
    axes.annotate("", tip, foot, arrowprops=arrow, zorder=5)
    axes.text(*tip, "force of the wall", color="tab:red", ha="center", va="top")
    axes.set(xlabel="z (mm)", ylabel="y (mm)", aspect="equal", ylim=(-3, 25))
    axes.legend(loc="upper left")
    plt.show()


if __name__ == "__main__":
    total = 1e3 * np.linalg.norm(contacts.total)
    print(f"force of the wall: {total:.2f} mN at {contacts.s.size} places")
    show()
