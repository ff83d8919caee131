"""`thinned`: a trial of which only some samples count; the others stay, and their fate says so. `shortened`: gone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import InvalidInput, positive, whole
from .trial import LEFT_OUT, Trial


def thinned(trial: Trial, every: int | None = None, *, seconds: float | None = None) -> Trial:
    """The trial with each ``every``-th used sample, or one per ``seconds``, of the trackers on the robot.

    The first used sample counts. Those left out keep all that was measured, have the fate `LEFT_OUT`, and are still
    what a tendon that rubs has gone through. Trackers on the base keep all samples. Raises `InvalidInput` where not
    exactly one of ``every`` (1 or more) and ``seconds`` (above 0) is given.
    """
    used = np.flatnonzero((trial.kept & trial.on_robot).any(axis=1))
    left = np.setdiff1d(used, used[which(trial.time[used], every, seconds=seconds)])
    state = trial.state.copy()
    state[left] = np.where(trial.kept[left] & trial.on_robot, LEFT_OUT, state[left])
    return replace(trial, state=state)


def shortened(trial: Trial, every: int | None = None, *, seconds: float | None = None) -> Trial:
    """Without the samples that `thinned` leaves out, which the origin tells ("thinned"); all others stay, used or not.

    Where a tendon rubs, what it went through in between is no longer known. Raises as `thinned`.
    """
    found = thinned(trial, every, seconds=seconds)
    left = (found.fates == LEFT_OUT).any(axis=1) & ~found.kept.any(axis=1)
    pace = f"every {ordinal(every)} used sample" if every is not None else f"one used sample in {seconds:g} s"
    said = {"thinned": f"{pace}; {int(left.sum())} others are not in this file"}
    return replace(trial.rows(~left), origin={**trial.origin, **said})


def ordinal(number: int) -> str:
    """Such as 2nd, 7th, 11th."""
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"


def which(time: np.ndarray, every: int | None = None, *, seconds: float | None = None) -> np.ndarray:
    """Indices of the samples at ``time`` (n,), s, increasing, that `thinned` lets count. Raises `InvalidInput`."""
    if (every is None) == (seconds is None):
        raise InvalidInput("every", every, "given, or seconds; not both")
    if every is not None:
        return np.arange(0, time.size, whole("every", every, 1, 10**9))
    apart, found, last = positive("seconds", seconds) * (1.0 - 1e-9), [], -np.inf
    for i, at in enumerate(time.tolist()):
        if at - last >= apart:
            found.append(i)
            last = at
    return np.array(found, dtype=int)
