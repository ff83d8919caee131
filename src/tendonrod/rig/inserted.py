"""`inserted`: what a follow-the-leader record says of the robot's way out, without take-up before and release after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .drives import NEAR
from .record import Record
from .states import State

if TYPE_CHECKING:
    from .trials import Followed


@dataclass(frozen=True, kw_only=True, eq=False)
class Inserted:
    """A follow-the-leader trial on its way out; SI, time on the bench's clock. All empty where it never set out.

    time, insertion, tension, target: (n,) of the control periods, tension and target in N. tip_insertion (m,), tip (m,
    3), tip_error (m, 2): of the tracker's used frames, as `Followed.tip` and `Followed.errors` have them. frames, lost:
    how many the tracker gave on the way, and how many of them without a pose.
    """

    time: np.ndarray
    insertion: np.ndarray
    tension: np.ndarray
    target: np.ndarray
    tip_insertion: np.ndarray
    tip: np.ndarray
    tip_error: np.ndarray
    frames: int
    lost: int

    @property
    def error(self) -> np.ndarray:
        """(n,) target - tension, N."""
        return self.target - self.tension

    @property
    def error_rms(self) -> float:
        """Root mean square of the tension error over time, N; NaN where it never set out."""
        known = np.isfinite(self.error)
        if known.sum() < 2:
            return float("nan")
        time = self.time[known]
        return float(np.sqrt(np.trapezoid(self.error[known] ** 2, time) / np.ptp(time)))

    @property
    def error_max(self) -> float:
        """Largest tension error either way, N; NaN where it never set out."""
        return float(np.nanmax(np.abs(self.error))) if np.isfinite(self.error).any() else float("nan")

    @property
    def tip_rmse(self) -> tuple[float, float]:
        """Root mean square of both errors of the tip, m: by projection, at the same insertion; NaN without frames."""
        if not len(self.tip_error):
            return float("nan"), float("nan")
        by_projection, at_insertion = np.sqrt(np.mean(self.tip_error**2, axis=0)).tolist()
        return by_projection, at_insertion


def way_out(record: Record) -> slice:
    """The samples from the translation's leaving its start to its reaching its end, while the bench runs to a target.

    A tension that is still being taken up says nothing of how well it was kept, and a tip whose tendon was let go
    follows nothing.
    """
    z, target = record.samples["translation"]["position"], record.samples["command"]["target"]
    driven = np.flatnonzero((record.states == State.RUNNING) & np.isfinite(target) & np.isfinite(z))
    if driven.size == 0 or z[driven].max() - z[driven[0]] <= 4.0 * NEAR:
        return slice(0, 0)
    there = int(np.argmax(z[driven] >= z[driven].max() - NEAR))
    left = int(np.flatnonzero(z[driven[:there]] <= z[driven[0]] + 2.0 * NEAR)[-1])
    return slice(int(driven[left]), int(driven[there]) + 1)


def inserted(found: Followed) -> Inserted:
    """The way out of a trial. Raises `InvalidInput` where the tracker's poses make no sense."""
    samples, way = found.record.samples, way_out(found.record)
    seen = np.zeros(0, dtype=bool) if way.stop == 0 else _within(found.record.frames["time"], found.record.time[way])
    gone = np.isnan(found.record.frames["position"][:, 0])
    insertion, tip, errors = _tip(found, way)
    return Inserted(
        time=samples["time"][way],
        insertion=samples["translation"]["position"][way] / found.robot.section.L,
        tension=samples["force"]["tension"][way],
        target=samples["command"]["target"][way],
        tip_insertion=insertion,
        tip=tip,
        tip_error=errors,
        frames=int(seen.sum()),
        lost=int((seen & gone[: seen.size]).sum()),
    )


def _tip(found: Followed, way: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """insertion, place and errors of the tip in the tracker's used frames on the way."""
    if way.stop == 0 or not len(found.record.frames):
        return np.empty(0), np.empty((0, 3)), np.empty((0, 2))
    time, insertion, tip = found.tip()
    here = _within(time, found.record.time[way])
    return insertion[here], tip[here], found.errors()[here]


def _within(time: np.ndarray, span: np.ndarray) -> np.ndarray:
    return (time >= span[0]) & (time <= span[-1])
