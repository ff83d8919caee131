"""A virtual bench: the paper's tension loop on the way out, then with feed-forward."""

from pathlib import Path
from tempfile import TemporaryDirectory

import tendonrod
from tendonrod.rig.inserted import Inserted, inserted
from tendonrod.rig.profiles import profile
from tendonrod.rig.trials import follow_leader
from tendonrod.rig.virtual.setup import VirtualSetup, lead_screw

GRAVITY = (-9.81, 0.0, 0.0)
robot = tendonrod.load_robot("exonav-1").replace(torsion="homogenized")
quick = lead_screw(speed=3e-3, acceleration=30e-3)  # six times as fast as the default
bench = VirtualSetup(robot=robot, gravity=GRAVITY, screw=quick)
compliance = bench.tendon_length / bench.tendon_stiffness  # m/N, of the tendon itself
plan = profile("plan", robot, target=0.7, gravity=GRAVITY, compliance=compliance)


def trial(feed_forward: bool) -> Inserted:
    how = {"seed": 1, "screw_rate": 2.5e-3, "end": 0.5, "feed_forward": feed_forward}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "trial.rec"
        done = follow_leader(bench, plan, 0.7, path, **how)
    assert done.outcome.is_done, done.outcome
    return inserted(done)


alone, ahead = trial(False), trial(True)
named = (alone, "PI"), (ahead, "PI + feed-forward")

# kP alone holds a screw of 2.5 mm/s at 2.5 / 50 = 0.05 N of error, until kI takes over
assert 0.02 < alone.error_max < 0.08, alone.error_max
assert ahead.error_rms < 0.8 * alone.error_rms, (ahead.error_rms, alone.error_rms)
assert alone.tip_rmse[0] < 1.5e-3, alone.tip_rmse  # m, with the tracker's 0.5 mm


def show() -> None:
    import matplotlib.pyplot as plt

    size = {"figsize": (6.0, 4.6), "layout": "constrained"}
    _, (tension, error) = plt.subplots(2, 1, sharex=True, **size)
    for found, name in named:
        tension.plot(found.insertion, found.tension, lw=0.6, alpha=0.8, label=name)
        error.plot(found.insertion, 1e3 * found.error, lw=0.6, alpha=0.8)
    tension.plot(alone.insertion, alone.target, "k--", lw=1.0, label="target")
    tension.set(ylabel="tension (N)")
    tension.legend()
    error.set(xlabel="insertion", ylabel="error (mN)")
    plt.show()


if __name__ == "__main__":
    for found, name in named:
        rms, largest = 1e3 * found.error_rms, 1e3 * found.error_max
        print(f"{name}: tension error {rms:.1f} mN rms, {largest:.0f} mN at most")
    print(f"tip RMSE (mm): {1e3 * alone.tip_rmse[0]:.2f}")
    show()
