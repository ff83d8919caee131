"""What leans and what hangs there: base tilt and tip mass from trials on file, outliers and all."""

from math import degrees
from pathlib import Path

from tendonrod.measurement import identify, load_trials

trials = load_trials(sorted(Path(__file__).parent.glob("trials/*.csv")))  # virtual, one tracker moved along the robot
fit = identify(trials, ["base_tilt_x", "base_tilt_y", "tip_mass"])

truth = {"base_tilt_x": 0.0, "base_tilt_y": -0.05235987755982988, "tip_mass": 0.15e-3}  # as the files tell
for k, (name, true) in enumerate(truth.items()):
    assert fit.low[k] < true < fit.high[k], (name, fit)
assert fit.rmse < 1e-3 < 5e-3 < fit.rmse_before, fit


def show() -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
    tensions = [fit.trials[i].tensions[row, 0] for i, row, _ in fit.where]
    axes.plot(tensions, 1e3 * fit.distance_before, ".", label="with what the trials say")
    axes.plot(tensions, 1e3 * fit.distance, ".", label="fitted")
    axes.set(xlabel="tension (N)", ylabel="distance from the model (mm)", ylim=(0.0, None))
    axes.legend()
    plt.show()


if __name__ == "__main__":
    tilt, mass = degrees(fit["base_tilt_y"]), 1e3 * fit["tip_mass"]
    print(f"tilt: {tilt:.2f} deg, mass: {mass:.3f} g, RMSE: {1e3 * fit.rmse_before:.2f} -> {1e3 * fit.rmse:.2f} mm")
    print(*fit.sentences, sep="\n")
    show()
