"""Bend a cantilever by a force across its tip: Euler's elastica, known exactly."""

import numpy as np

import tendonrod

length = 1.0  # m
stiffness = 1.0  # N m^2, E I
loads = np.array([1.0, 2.0, 5.0, 10.0])  # P L^2 / E I

# thin as a hair and hard as nothing is, so that it bends but hardly stretches or shears
rod = tendonrod.PlainRod(
    length=length,
    area=1.0,  # m^2
    ix=1e-12 * stiffness,  # m^4
    iy=1e-12 * stiffness,
    j=2e-12 * stiffness,
    youngs_modulus=1e12,  # Pa
    shear_modulus=1e12,
    density=0.0,
)
robot = tendonrod.Robot(name="elastica", body=rod)
s = np.linspace(0.0, length, 201)
forces = loads * stiffness / length**2  # N
ends = [(P, 0.0, 0.0) for P in forces]
shapes = [tendonrod.solve(robot, (), tip_force=P, s=s, accuracy=1e-10) for P in ends]

# of the length: tip across the rod, and its approach to the wall
across = [0.3017207738, 0.4934574804, 0.7137915236, 0.8106090249]
shortening = [0.0564332363, 0.1606417208, 0.3876283607, 0.5549955978]
tips = np.array([shape.tip for shape in shapes]) / length
off = np.abs([tips[:, 0] - across, 1.0 - tips[:, 2] - shortening]).max()
assert off < 2e-10, off


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(5.5, 4.5), layout="constrained")
    for shape, load in zip(shapes, loads, strict=True):
        x, _, z = shape.position.T / length
        axes.plot(z, x, label=f"{load:g}")
    known = 1.0 - np.array(shortening), across
    axes.plot(*known, "k+", markersize=9, label="elliptic integrals")
    axes.set(xlabel="z / L", ylabel="x / L", title="Force across the tip", aspect=1.0)
    axes.legend(title="P L² / EI")
    plt.show()


if __name__ == "__main__":
    print(f"largest difference from the elliptic integrals: {off:.1g} of the length")
    show()
