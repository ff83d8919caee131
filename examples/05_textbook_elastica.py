"""Bend a slender cantilever by a force across its tip: Euler's elastica, known from elliptic integrals."""

import numpy as np

import tendonrod

length = 1.0  # m
stiffness = 1.0  # N m^2, E I
loads = np.array([1.0, 2.0, 5.0, 10.0])  # P L^2 / E I

# thin as a hair and hard as nothing is, so that it bends but neither stretches nor shears
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
shapes = [tendonrod.solve(robot, (), tip_force=(P, 0.0, 0.0), s=s, accuracy=1e-10) for P in forces]

# of the length: tip across the rod, and its approach to the wall
across = [0.3017207738, 0.4934574804, 0.7137915236, 0.8106090249]
shortening = [0.0564332363, 0.1606417208, 0.3876283607, 0.5549955978]
tips = np.array([shape.tip for shape in shapes]) / length
assert np.allclose(tips[:, 0], across, rtol=0.0, atol=2e-10), tips
assert np.allclose(1.0 - tips[:, 2], shortening, rtol=0.0, atol=2e-10), tips


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(5.5, 4.5), layout="constrained")
    for shape, load in zip(shapes, loads, strict=True):
        x, _, z = shape.position.T / length
        axes.plot(z, x, label=f"{load:g}")
    axes.plot(1.0 - np.array(shortening), across, "k+", markersize=9, label="elliptic integrals")
    axes.set(xlabel="z / L", ylabel="x / L", aspect="equal", title="A cantilever under a force across its tip")
    axes.legend(title="P L² / EI")
    plt.show()


if __name__ == "__main__":
    show()
