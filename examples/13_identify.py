"""What leans and what hangs there: base tilt and tip mass from trials on file."""

from math import degrees, radians
from pathlib import Path

from tendonrod.measurement import identify, load_trials

files = Path(__file__).parent.glob("trials/*.csv")  # virtual: one tracker, moved along
trials = load_trials(sorted(files))
fit = identify(trials, ["base_tilt_x", "base_tilt_y", "tip_mass"])

truth = 0.0, radians(-3.0), 0.15e-3  # as the files tell
for low, true, high in zip(fit.low, truth, fit.high, strict=True):
    assert low < true < high, fit
assert fit.rmse < 1e-3 < 5e-3 < fit.rmse_before, fit


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
    tensions = [fit.trials[i].tensions[row, 0] for i, row, _ in fit.where]
    axes.plot(tensions, 1e3 * fit.distance_before, ".", label="as the trials say")
    axes.plot(tensions, 1e3 * fit.distance, ".", label="fitted")
    axes.set(xlabel="tension (N)", ylabel="distance (mm)", ylim=(0.0, None))
    axes.legend()
    plt.show()


if __name__ == "__main__":
    tilt, mass = degrees(fit["base_tilt_y"]), 1e3 * fit["tip_mass"]
    print(f"tilt: {tilt:.2f} deg, mass at the tip: {mass:.3f} g")
    print(f"RMSE: {1e3 * fit.rmse_before:.2f} mm, fitted {1e3 * fit.rmse:.2f} mm")
    print(*fit.sentences, sep="\n")
    show()
