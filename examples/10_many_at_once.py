"""Where the tip can go: thousands of shapes at once, on all cores."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
tension, insertion = np.meshgrid(np.linspace(0.0, 1.0, 41), np.linspace(0.2, 1.0, 41))
batch = tendonrod.solve_batch(
    robot,
    tension.ravel(),
    gravity=(-9.81, 0.0, 0.0),
    insertion=insertion.ravel(),
)
assert batch.converged.all(), batch.counts

# an item as a full shape, solved once more
one = batch.shape(700)
assert np.linalg.norm(batch.tip[700] - one.tip) < 1e-7


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(6.0, 4.2), layout="constrained")
    _, y, z = 1e3 * batch.tip.T
    dots = axes.scatter(z, y, c=tension.ravel(), s=6)
    plt.colorbar(dots, label="tension (N)", shrink=0.6)
    axes.set(xlabel="z of the tip (mm)", ylabel="y of the tip (mm)", aspect="equal")
    plt.show()


if __name__ == "__main__":
    reach = 1e3 * batch.tip[:, 1].max()
    print(f"{len(batch)} shapes; the tip reaches y: {reach:.2f} mm")
    show()
