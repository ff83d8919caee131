"""Bend ExoNav prototype 1 with 0.7 N on its tendon, with and without gravity."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
s = np.linspace(0.0, robot.length_na, 101)
free = tendonrod.solve(robot, 0.7, s=s)
heavy = tendonrod.solve(robot, 0.7, gravity=(-9.81, 0.0, 0.0), s=s)

# m; within the solver's default accuracy, one micrometre
expected_tip = [-1.14080e-3, 21.75197e-3, 66.56249e-3]
assert np.linalg.norm(heavy.tip - expected_tip) < 1e-6, heavy.tip


def show() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.0, 4.2), layout="constrained")
    side, top = figure.subplots(2, sharex=True, height_ratios=[5, 2])
    for shape, colour, label in (
        (free, "tab:blue", "no load"),
        (heavy, "tab:orange", "gravity along −x"),
    ):
        for path, width, part in (
            (shape.centerline, 2.5, "tube's axis"),
            (shape.tendon_path(0), 0.8, "tendon"),
        ):
            x, y, z = 1e3 * path.T
            style = {"color": colour, "linewidth": width, "label": f"{part}, {label}"}
            side.plot(z, y, **style)
            top.plot(z, x, **style)
    side.set(ylabel="y (mm)", aspect="equal", title="ExoNav prototype 1 at 0.7 N")
    top.set(ylabel="x (mm)", aspect="equal", xlabel="z (mm)")
    side.legend()
    plt.show()


if __name__ == "__main__":
    print(f"tip under gravity: {(1e3 * heavy.tip).round(3)} mm")
    show()
