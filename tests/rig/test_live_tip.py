"""How far the tip is from its reference as a trial runs: known distances come out, whatever frame they are seen in."""

from types import SimpleNamespace

import numpy as np
import pytest

from tendonrod.curve import Curve
from tendonrod.measurement.trial import Tracker
from tendonrod.rig.interfaces import PoseFrame
from tendonrod.rig.live_tip import FRAMES, LiveTip
from tendonrod.rig.staged import Phase
from tendonrod.rig.virtual.sensors import quaternion_of
from tendonrod.rotation import exp_so3

ARC = np.linspace(0.0, 0.05, 201)
RADIUS = 0.04
REFERENCE = Curve(
    s=ARC,
    points=RADIUS * np.stack([np.sin(ARC / RADIUS), np.zeros(201), 1.0 - np.cos(ARC / RADIUS)], axis=1),
    slopes=np.stack([np.cos(ARC / RADIUS), np.zeros(201), np.sin(ARC / RADIUS)], axis=1),
)
NAN = (float("nan"),) * 3


def field(seed):
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = exp_so3(rng.normal(size=3)), rng.normal(size=3)
    return T


def seen(tip, R_tip, tracker, T, name="tip"):
    """The frame in which a tracker at T sees the sensor of a tip at ``tip`` that has turned by ``R_tip``."""
    at = T[:3, :3].T @ (tip + R_tip @ np.array(tracker.offset) - T[:3, 3])
    turned = T[:3, :3].T @ R_tip @ exp_so3(np.array(tracker.turn))
    return PoseFrame(time=0.0, frame=1, tool=name, position=tuple(at), quaternion=quaternion_of(turned))


def moment(*frames, phase=Phase.INSERT):
    return SimpleNamespace(sample=SimpleNamespace(frames=frames), task=SimpleNamespace(phase=phase))


@pytest.mark.parametrize("seed", range(5))
def test_a_known_distance_comes_out_in_any_frame(seed):
    rng = np.random.default_rng(100 + seed)
    tracker = Tracker(name="tip", offset=tuple(rng.normal(size=3) * 2e-3), turn=tuple(rng.normal(size=3)))
    T, s, off = field(seed), 0.02, 1.3e-3
    tip = REFERENCE.at(np.array([s]))[0] + off * np.array([0.0, 1.0, 0.0])  # across the plane of the arc
    live = LiveTip(REFERENCE, tracker, T)
    live.watch(moment(seen(tip, exp_so3(rng.normal(size=3)), tracker, T)))
    assert live.error(moment()) == pytest.approx(off, rel=1e-9)


def test_what_is_lost_of_another_tool_or_of_no_following_says_nothing():
    tracker = Tracker(name="tip", turn=(0.0, 0.0, 0.0))
    live = LiveTip(REFERENCE, tracker, np.eye(4))
    assert np.isnan(live.error(moment()))
    lost = PoseFrame(time=0.0, frame=1, tool="tip", position=NAN, quaternion=(*NAN, float("nan")), state="missing")
    live.watch(moment(lost, seen(np.ones(3), np.eye(3), tracker, np.eye(4), "base")))
    assert np.isnan(live.error(moment()))
    live.watch(moment(seen(np.zeros(3), np.eye(3), tracker, np.eye(4))))
    assert live.error(moment()) == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(live.error(moment(phase=Phase.TAKE_UP)))


def test_noise_is_averaged_and_old_frames_are_forgotten():
    tracker = Tracker(name="tip", turn=(0.0, 0.0, 0.0))
    live = LiveTip(REFERENCE, tracker, np.eye(4))
    for sign in (5.0, *(1.0, -1.0) * (FRAMES // 2)):
        live.watch(moment(seen(np.array([0.0, sign * 1e-3, 0.0]), np.eye(3), tracker, np.eye(4))))
    assert live.error(moment()) == pytest.approx(0.0, abs=1e-12)
