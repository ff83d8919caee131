"""What data can and cannot determine: refusals by name, and plain sentences on what can hardly be told apart."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ..errors import Fact, InvalidInput
from ..rotation import log_so3
from .registration import GIVEN, seen_exit
from .trial import Trial
from .unknowns import Unknown

if TYPE_CHECKING:
    from .identification import Fit

HARDLY = 0.95  # correlation above which two numbers can hardly be told apart
PART = 0.15  # of a direction, below which a number is not named
ALIKE, FEWEST = 0.15, 20  # correlation within samples, and poses from which it can be told
FAR = 1.0  # of what is plausible
UNEXPLAINED = 1.3  # times the stated noise
NOTHING = 1e-9  # slope, relative to the largest
AT_START = 0.1  # share of the information asked of an end: a rod that bends in a plane hides what it shows elsewhere


def check_determined(
    unknowns: Sequence[Unknown], white: np.ndarray, trials: Sequence[Trial], ended: np.ndarray | None = None
) -> None:
    """Refuse what the data cannot determine: ``white`` (q, m), derivatives of whitened errors by the unknowns, SI.

    ended: (m,) where a fit ended, None at its start.

    A number, or a combination of numbers, is not determined where the data leave it more uncertain (one standard
    error) than what is plausible anyway; at the start, ten times as much is let pass. Raises `InvalidInput`.
    """
    enough = AT_START if ended is None else 1.0
    scaled = white * np.array([each.plausible for each in unknowns])
    size = np.linalg.norm(scaled, axis=0)
    for k, (unknown, each) in enumerate(zip(unknowns, size, strict=True)):
        if each <= NOTHING * max(1.0, size.max()):
            allowed = f"left out: the data do not depend on it{_why(unknown, trials)}"
            if ended is not None:
                allowed = f"left out: the fit runs away with it, to {unknown.told(ended[k], 2)}"
            raise InvalidInput("free", Fact(unknown.name), allowed)
        if each < enough:
            allowed = f"left out: the data leave it uncertain by {unknown.told(unknown.plausible / each, 2)}"
            raise InvalidInput("free", Fact(unknown.name), allowed)
    _, values, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"))  # of few data, also what they do not touch
    if len(scaled) < len(unknowns) or values[-1] < enough:
        names = [each.name for each, part in zip(unknowns, directions[-1], strict=True) if abs(part) > PART]
        if len(names) == 1:
            raise InvalidInput("free", Fact(names[0]), "left out: beside the others, the data cannot determine it")
        allowed = "fewer: the data cannot tell these apart, only a combination of them; leave one out, or add trials "
        allowed += "with other tensions, gravity directions or tracked places"
        raise InvalidInput("free", Fact(" and ".join(names)), allowed)


def _why(unknown: Unknown, trials: Sequence[Trial]) -> str:
    weighs = any(any(each.gravity) for each in trials)
    heavy = unknown.name.endswith("mass") or unknown.name.startswith("gravity") or unknown.name == "density"
    if heavy and not weighs:
        return ", the trials' gravity is 0, 0, 0"
    if unknown.name.startswith("displacement") or unknown.name.endswith(("axial_stiffness", "free_length")):
        return ", tensions were measured and drive the model"
    return ""


def sentences(fit: Fit, white: np.ndarray) -> tuple[str, ...]:
    """What a reader of the fit must know; white (q, m): derivatives of whitened errors by the unknowns, SI."""
    return (
        *_worlds(fit),
        *_alike(fit),
        *_at_bounds(fit),
        *_far(fit),
        *_unexplained(fit),
        *_together(fit),
        *_outlying(fit),
    )


def _worlds(fit: Fit) -> list[str]:
    """What the world that trials are measured in means for numbers of the base."""
    known, said = fit.problem.known, list(dict.fromkeys(each.note for each in fit.problem.known if each.note))
    base = [name for name in fit.names if name.startswith("base_")]
    if base and any(each.count for each in known):
        said.append(
            f"the world hangs on the tracker on the base: {', '.join(base)} tell by what that is wrong, and a bench "
            "that leans as a whole shows in gravity_tilt only"
        )
    if base and not fit.problem.prior.per_error.any():
        for trial, each in zip(fit.trials, known, strict=True):
            if each.source == GIVEN and (pose := seen_exit(trial)) is not None:
                turn = ", ".join(f"{x:.2f}" for x in np.degrees(log_so3(pose[:3, :3])))
                said.append(
                    f"{trial.name}: the tracker on the base sees the exit turned by ({turn}) deg; it did not count "
                    "(base_tracker=True, --base-tracker)"
                )
    return said


def _together(fit: Fit) -> list[str]:
    """Whether trackers of one sample err together though no noise of the tension is stated that would do it."""
    if any(each.tension_noise for each in fit.trials):
        return []
    e, where = fit.errors[fit.used], fit.where[fit.used]
    _, which, counts = np.unique(where[:, :2], axis=0, return_inverse=True, return_counts=True)
    several = counts[which.ravel()] > 1
    if several.sum() < FEWEST:
        return []
    e, which = e[several], which.ravel()[several]
    e = e - e.mean(axis=0)
    size = np.bincount(which)[which]
    mean = np.stack([np.bincount(which, weights=column)[which] for column in e.T], axis=1) / size[:, None]
    alike = float(((mean * size[:, None] - e) * e / (size - 1)[:, None]).sum() / (e * e).sum())
    if alike < ALIKE:
        return []
    said = f"errors of trackers in one sample go together (correlation {alike:.2f}), as where the tension is noisy: "
    return [said + "state its noise, tension_noise, without which the intervals are too narrow"]


def _alike(fit: Fit) -> list[str]:
    said, correlation = [], fit.correlation
    for i, j in combinations(range(len(fit.unknowns)), 2):
        rho = correlation[i, j]
        if abs(rho) < HARDLY:
            continue
        a, b = fit.unknowns[i], fit.unknowns[j]
        by, with_it = fit.standard_errors[i], rho * fit.standard_errors[j]
        said.append(
            f"{a.name} and {b.name} can hardly be told apart (correlation {rho:.3f}): {a.name} raised by "
            f"{a.told(by, 2)} with {b.name} {'raised' if with_it > 0 else 'lowered'} by {b.told(abs(with_it), 2)} "
            "would explain the data nearly as well"
        )
    return said


def _at_bounds(fit: Fit) -> list[str]:
    said = []
    for unknown, value in zip(fit.unknowns, fit.values, strict=True):
        for bound, which in ((unknown.low, "smallest"), (unknown.high, "largest")):
            if np.isfinite(bound) and abs(value - bound) < 1e-6 * unknown.plausible:
                said.append(
                    f"{unknown.name} ended at the {which} value there is, {unknown.told(bound)}: the data would have "
                    "it beyond, so that something else is wrong; its interval means nothing"
                )
    return said


def _far(fit: Fit) -> list[str]:
    return [
        f"{unknown.name} ended at {unknown.told(value)}, far from its start, {unknown.told(unknown.start)}: look "
        "whether that can be, or whether something that was not freed hides behind it"
        for unknown, value in zip(fit.unknowns, fit.values, strict=True)
        if abs(value - unknown.start) > FAR * unknown.plausible
    ]


def _unexplained(fit: Fit) -> list[str]:
    if fit.scale < UNEXPLAINED or not any(each.position_noise for each in fit.trials):
        return []
    said = f"the errors left over are {fit.scale:.2g} times the noise that the trials state: what was freed does not "
    return [
        said + "explain everything, and the intervals, widened by that factor, still suppose that the rest is noise"
    ]


def _outlying(fit: Fit) -> list[str]:
    if not len(fit.outliers):
        return []
    k = int(np.argmax(np.where(fit.used, 0.0, fit.distance)))
    i, row, j = fit.where[k]
    trial = fit.trials[i]
    count, place = len(fit.outliers), f"{trial.name}, sample {row + 1}, tracker {trial.trackers[j].name}"
    said = (
        f"{count} of {len(fit.where)} poses {'was' if count == 1 else 'were'} left out as outlier{'s'[: count != 1]}, "
    )
    return [f"{said}the furthest {1e3 * fit.distance[k]:.3g} mm away: {place}"]
