"""Push ExoNav out at constant tension: without load it stays on the path of its tip."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
insertion = np.linspace(0.0, 1.0, 21)  # exposed share of the robot
rotation = 0.0  # rad, of the exit section; the motor turns by 2 pi (insertion - 1)
tension = 0.7  # N

motion = tendonrod.progress(robot, insertion, rotation, tension, samples=60)
leader = tendonrod.solve(robot, tension)

# m; constant tension is exact follow-the-leader motion where nothing else pulls
offsets = [shape.position - leader.at(shape.s).position for shape in motion.shapes]
strayed = max(np.linalg.norm(offset, axis=1).max() for offset in offsets)
assert strayed < 1e-10, strayed


def show() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(6.0, 6.0), layout="constrained")
    follows, swings = figure.subplots(2, sharex=True, sharey=True)
    turned = 2 * np.pi * (1 - insertion)  # rad, where the motor stands still
    held = tendonrod.progress(robot, insertion, turned, tension, samples=60)
    for axes, moved, title in (
        (follows, motion, "Turned as it comes out"),
        (swings, held, "Only pushed"),
    ):
        _, y, z = 1e3 * moved.tip.T
        axes.plot(z, y, "k:", label="path of the tip", zorder=3)
        for shape in moved.shapes[4::4]:
            _, y, z = 1e3 * shape.position.T
            inside = 1 - shape.insertion
            colour = plt.get_cmap("viridis")(1.1 * inside)
            style = {"color": colour, "linewidth": 1 + 4 * inside}
            axes.plot(z, y, **style, label=f"η = {shape.insertion:.1f}")
        axes.set(title=title, ylabel="y (mm)", aspect="equal")
    swings.set(xlabel="z (mm)")
    follows.legend(fontsize="small", ncols=2)
    plt.show()


if __name__ == "__main__":
    print(f"largest distance of the body from the path: {strayed:.1g} m")
    show()
