"""Pull a tendon by its length, as a motor does; part of the pull is its own stretch."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
stiffness = 589.0  # N, E A of 0.1 mm of nitinol
free = 0.3  # m, of tendon between motor and robot
elastic = robot.replace(tendon_axial_stiffness=stiffness, tendon_free_length=free)
gravity = (-9.81, 0.0, 0.0)

lengths = np.linspace(0.0, 2.5e-3, 26)  # m, from slack
tensions, tips = {}, {}
for name, each in (("rigid tendon", robot), ("elastic tendon", elastic)):
    shapes = [tendonrod.solve(each, displacements=d, gravity=gravity) for d in lengths]
    tensions[name] = np.array([shape.tensions[0] for shape in shapes])
    tips[name] = np.array([shape.tip for shape in shapes])

# at the same tension the shapes are the same, and the pulls differ by the stretch
tension = tensions["elastic tendon"][-1]
rigid = np.interp(tension, tensions["rigid tendon"], lengths)
stretch = tension * (free + robot.tendon_lengths[0]) / stiffness
assert abs(lengths[-1] - rigid - stretch) < 1e-6, (lengths[-1] - rigid, stretch)


def show() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(7.0, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, tau in tensions.items():
        left.plot(1e3 * lengths, tau, label=name)
        right.plot(1e3 * lengths, 1e3 * tips[name][:, 1])
    left.set(xlabel="pulled length (mm)", ylabel="tension (N)")
    left.legend()
    right.set(xlabel="pulled length (mm)", ylabel="y of the tip (mm)")
    plt.show()


if __name__ == "__main__":
    whole = 1e3 * lengths[-1]
    print(f"stretch at {tension:.3f} N: {1e3 * stretch:.3f} mm of {whole:.1f} mm")
    show()
