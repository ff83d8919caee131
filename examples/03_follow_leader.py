"""Plan follow-the-leader motion under gravity: the tension, and then also the rotation, that keep it on its path."""

import numpy as np

import tendonrod

robot = tendonrod.load_robot("exonav-1")
target_tension = 0.7  # N, at the end of the motion
gravity = (-9.81, 0.0, 0.0)  # m/s2

tension_only = tendonrod.plan_follow_leader(robot, target_tension, gravity)
with_rotation = tendonrod.plan_follow_leader(robot, target_tension, gravity, freedom="full")

# N; a short robot sags less than the leader did, so it is pulled less, by a few percent
expected = np.interp(tension_only.progress, [0.2, 0.4, 0.6, 0.8, 1.0], [0.674, 0.684, 0.691, 0.697, 0.700])
assert np.allclose(tension_only.tension[3:], expected[3:], rtol=0.0, atol=1e-3), tension_only.tension
# m; turning the robot by less than a degree beside that takes two thirds of the tip's error away
assert abs(tension_only.tip_rmse - 0.21e-3) < 0.01e-3, tension_only.tip_rmse
assert with_rotation.tip_rmse < 0.4 * tension_only.tip_rmse, with_rotation.tip_rmse


def show() -> None:
    import matplotlib.pyplot as plt

    _, (pull, turn, error) = plt.subplots(3, sharex=True, figsize=(6.0, 6.0), layout="constrained")
    for plan, colour, label in (
        (tension_only, "tab:blue", "tension"),
        (with_rotation, "tab:orange", "tension and rotation"),
    ):
        style = {"color": colour, "marker": "o", "markersize": 3, "label": label}
        pull.plot(plan.progress, plan.tension, **style)
        turn.plot(plan.progress, np.degrees(plan.rotation), **style)
        error.plot(plan.progress, 1e3 * plan.body_rms, **style)
    pull.set(ylabel="tension (N)", title="ExoNav prototype 1 to 0.7 N, gravity along −x")
    turn.set(ylabel="rotation (°)")
    error.set(ylabel="rms distance (mm)", xlabel="progress η", ylim=(0.0, None))
    pull.legend(title="free to choose")
    plt.show()


if __name__ == "__main__":
    show()
