"""How much a tip moves when a number of the robot or of its drive is a little wrong."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
gravity = (-9.81, 0.0, 0.0)
shape = tendonrod.solve(robot, 0.7, gravity=gravity, accuracy=1e-9)

# one column per input, at the tip; by one per cent of each
numbers = robot.parameters()
names = ["inner_radius", "outer_radius", "uncut_angle", "length", "tendon_radius"]
names += ["youngs_modulus", "notch_width", "notch_spacing", "density"]
jacobian = shape.jacobian("tensions", *names, s=[shape.length])
sizes = 0.01 * np.array([0.7, *(numbers[name] for name in names)])
motion = np.linalg.norm(jacobian.position[-1] * sizes, axis=0)

# a force at the tip: the compliance against a second solve
push = np.array([0.0, 2e-5, 0.0])  # N
pushed = tendonrod.solve(robot, 0.7, gravity, tip_force=push, accuracy=1e-9)
expected = shape.tip_compliance[:3, :3] @ push
off = np.linalg.norm(pushed.tip - shape.tip - expected)
assert off < 1e-2 * np.linalg.norm(expected), off


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
    order = np.argsort(motion)
    labels = np.array(["tension", *(name.replace("_", " ") for name in names)])
    axes.barh(labels[order], 1e3 * motion[order])
    axes.set(xlabel="motion of the tip by 1 % (mm)", title="prototype 1, 0.7 N")
    plt.show()


if __name__ == "__main__":
    largest = motion.argmax() - 1
    print(f"most by {names[largest]}: {1e3 * motion.max():.3f} mm per cent")
    softest = np.linalg.eigvalsh(shape.tip_stiffness[:3, :3]).min()
    print(f"softest direction of the tip: {softest:.2f} N/m")
    show()
