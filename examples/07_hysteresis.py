"""Pull a tendon that rubs, let go, and pull again: what it does depends on its past."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1").replace(tendon_friction=0.1)
gravity = (-9.81, 0.0, 0.0)
up, down = np.linspace(0.1, 0.7, 25), np.linspace(0.7, 0.1, 25)
tensions = np.concatenate([up, down, up])  # N

s = np.linspace(0.0, robot.length_na, 41)
shapes = []
for tension in tensions:
    before = shapes[-1] if shapes else None  # what friction holds on to
    shapes.append(tendonrod.solve(robot, tension, gravity, s=s, history=before))
tips = np.array([shape.tip for shape in shapes])

# the second pull ends where the first did, though it went another way
back = np.linalg.norm(tips[-1] - tips[24])
apart = np.linalg.norm(tips[50:] - tips[25:50][::-1], axis=1).max()
assert back < 1e-6, back
assert 0.5e-3 < apart < 5e-3, apart


def show() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    bending = np.array([shape.u[:, 1].mean() for shape in shapes])
    parts = (
        ("first pull", slice(0, 25), "tab:blue", "-"),
        ("let go", slice(24, 50), "tab:orange", "-"),
        ("second pull", slice(49, 75), "tab:blue", ":"),
    )
    for name, part, colour, line in parts:
        left.plot(tensions[part], bending[part], line, color=colour, label=name)
        right.plot(1e3 * tips[part, 2], 1e3 * tips[part, 1], line, color=colour)
    left.set(xlabel="tension at the exit (N)", ylabel="mean bending $u_y$ (1/m)")
    left.legend()
    right.set(xlabel="z of the tip (mm)", ylabel="y of the tip (mm)")
    plt.show()


if __name__ == "__main__":
    print(f"farthest apart at equal tension: {1e3 * apart:.2f} mm")
    show()
