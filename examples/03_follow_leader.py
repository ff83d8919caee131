"""Plan follow-the-leader motion under gravity, by tension, and by rotation as well."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
target_tension = 0.7  # N, at the end of the motion
gravity = (-9.81, 0.0, 0.0)  # m/s2

task = robot, target_tension, gravity
tension_only = tendonrod.plan_follow_leader(*task)
with_rotation = tendonrod.plan_follow_leader(*task, freedom="full")

# N; a short robot sags less than the leader did, so it is pulled less, by a few percent
known = [0.2, 0.4, 0.6, 0.8, 1.0], [0.674, 0.684, 0.691, 0.697, 0.700]
expected = np.interp(tension_only.progress, *known)
assert np.abs(tension_only.tension - expected)[3:].max() < 1e-3, tension_only.tension
# m; turning by less than a degree beside that takes two thirds of the tip's error away
assert abs(tension_only.tip_rmse - 0.21e-3) < 0.01e-3, tension_only.tip_rmse
assert with_rotation.tip_rmse < 0.4 * tension_only.tip_rmse, with_rotation.tip_rmse


def show() -> None:
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(6.0, 6.0), layout="constrained")
    pull, turn, error = figure.subplots(3, sharex=True)
    for plan, colour, label in (
        (tension_only, "tab:blue", "tension"),
        (with_rotation, "tab:orange", "tension and rotation"),
    ):
        style = {"color": colour, "marker": "o", "markersize": 3, "label": label}
        pull.plot(plan.progress, plan.tension, **style)
        turn.plot(plan.progress, np.degrees(plan.rotation), **style)
        error.plot(plan.progress, 1e3 * plan.body_rms, **style)
    pull.set(ylabel="tension (N)", title="Prototype 1 to 0.7 N, gravity along −x")
    turn.set(ylabel="rotation (°)")
    error.set(ylabel="rms distance (mm)", xlabel="progress η", ylim=(0.0, None))
    pull.legend(title="free to choose")
    plt.show()


if __name__ == "__main__":
    for plan in (tension_only, with_rotation):
        print(f"{plan.freedom}: rms distance of the tip {1e3 * plan.tip_rmse:.3f} mm")
    show()
