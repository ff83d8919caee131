"""A robot of one's own, from a file: a straight rod, 15 N on each tendon in turn."""

from pathlib import Path

import numpy as np

import tendonrod

robot = tendonrod.load_robot(Path(__file__).with_name("four-tendon.toml"))
gravity = (9.81, 0.0, 0.0)  # m/s2
tensions = 15.0 * np.eye(robot.n_tendons)  # N; row i pulls tendon i alone
s = np.linspace(0.0, robot.length_na, 101)
shapes = [tendonrod.solve(robot, row, gravity, s=s) for row in tensions]

# m; a common test case of the field, to the six digits that are printed for it
expected_tip = [0.182212, 0.0, 0.453229]
assert np.allclose(shapes[0].tip, expected_tip, rtol=0.0, atol=1.5e-6), shapes[0].tip


def show() -> None:
    import matplotlib.pyplot as plt

    _, (side, top) = plt.subplots(1, 2, figsize=(7.0, 4.0), layout="constrained")
    for i, shape in enumerate(shapes):
        (x, y, z), path = 1e3 * shape.centerline.T, 1e3 * shape.tendon_path(i)
        colour = f"C{i}"
        side.plot(x, z, color=colour, linewidth=2.5)
        side.plot(path[:, 0], path[:, 2], color=colour, linewidth=0.8)
        top.plot(x, y, color=colour, linewidth=2.5, label=f"tendon {i + 1}")
        top.plot(path[:, 0], path[:, 1], color=colour, linewidth=0.8)
    side.set(xlabel="x (mm)", ylabel="z (mm)", title="Gravity to the right", aspect=1.0)
    top.set(xlabel="x (mm)", ylabel="y (mm)", title="Seen from the tip", aspect=1.0)
    top.legend(title="15 N on", fontsize="small", loc="upper left")
    plt.show()


if __name__ == "__main__":
    print(f"tip under the first tendon: {(1e3 * shapes[0].tip).round(3)} mm")
    show()
