"""Turn a push against a buckled strip until it snaps: a fold, exactly known."""

import numpy as np

import tendonrod
from tendonrod.statics.branches import follow_branch

length, stiffness = 1.0, 1.0  # m, N m^2 (E I in the plane)
euler = 0.25 * np.pi**2 * stiffness / length**2  # N, buckling load, clamped and free
push = 2.0 * euler

# softer in the plane x-z than across it, so that it stays there
strip = tendonrod.PlainRod(
    length=length,
    area=1.0,  # m^2
    ix=1e-9 * stiffness,  # m^4
    iy=1e-12 * stiffness,
    j=2e-9 * stiffness,
    youngs_modulus=1e12,  # Pa
    shear_modulus=1e12,
    density=0.0,
)
robot = tendonrod.Robot(name="strip", body=strip)


def turned(angle: float) -> dict:
    """The push (N), turned from the strip's axis against its bend."""
    return {"tip_force": (-push * np.sin(angle), 0.0, -push * np.cos(angle))}


aside = tendonrod.solve(robot, (), tip_force=(1e-3 * push, 0.0, -push))
buckled = tendonrod.solve(robot, (), **turned(0.0), start=aside)
branch = follow_branch(buckled, turned, (-0.8, 0.8))  # rad

known = 0.5449801186  # rad, where the stable branch of the elastica ends
there, back = branch.folds
off = max(abs(there.parameter - known), abs(back.parameter + known))
assert off < 1e-8, off
assert there.negative == (0, 1)  # unstable directions before and after
assert back.negative == (1, 0)


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(5.5, 4.0), layout="constrained")
    angle, across = np.degrees(branch.parameter), branch.tip[:, 0] / length
    i, j = there.index, back.index
    axes.plot(angle[: i + 1], across[: i + 1], "tab:blue", label="stable")
    axes.plot(angle[i : j + 1], across[i : j + 1], "r--", label="unstable")
    axes.plot(angle[j:], across[j:], "tab:blue")
    axes.plot(angle[[i, j]], across[[i, j]], "ko", label=f"folds, ±{angle[i]:.3f}°")
    axes.set(xlabel="angle of the push (°)", ylabel="tip x / L", title="A turned push")
    axes.legend()
    plt.show()


if __name__ == "__main__":
    print(f"snaps at: {there.parameter:.9f} rad, off the elastica by {off:.1g} rad")
    show()
