"""`diagnose`: why model and measurements differ: what each single cause would explain, and which few explain the most.

Mis-registration is easily taken for physics: a tilted base, a mass at the tip and a softer tube all move the tip. Each
cause is fitted alone, on the same poses; then causes are taken together, the most helpful first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isfinite, log

import numpy as np

from ..errors import InvalidInput, TendonrodError
from .identification import Fit, checked, identify
from .names import across_gravity
from .registration import registered
from .setup import Setup, the_robot
from .thinning import ordinal, thinned
from .trial import Trial

WORTH = 0.05  # of the squared error that is left, below which one more cause is not taken
CHANCE = 1e-3  # that noise alone lets a cause seem worth as much
MOST = 3  # causes taken together
ENOUGH_POSES = 3000  # that tell causes apart as well as any more: of more, every k-th sample counts
CAUSES = {  # what it is called -> numbers
    "tilted base": ("base_tilt_x", "base_tilt_y"),
    "turned base": ("base_roll",),
    "shifted base": ("base_x", "base_y", "base_z"),
    "tilted gravity": ("gravity_tilt_x", "gravity_tilt_y", "gravity_tilt_z"),
    "mass at the tip": ("tip_mass",),
    "mass of the trackers": ("tracker_mass",),
    "holder offset": ("holder_x", "holder_y", "holder_z"),
    "stiffness": ("youngs_modulus",),
    "torsion": ("torsion_factor",),
    "tension scale": ("tension_scale",),
    "tension zero": ("tension_zero",),
}
Watch = Callable[[int, int, str], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Cause:
    """A cause, alone or with those before it. explained: share of the squared error that it takes away, 0 to 1.

    rmse: m, what is left. fit: None where the data could not determine it or the fit failed; why then says so.
    """

    name: str
    explained: float
    rmse: float
    fit: Fit | None
    why: str = ""

    @property
    def told(self) -> str:
        """Its numbers with units."""
        if self.fit is None:
            return self.why
        return ", ".join(f"{u.name} {u.told(x, 3)}" for u, x in zip(self.fit.unknowns, self.fit.values, strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """alone: each cause by itself, the most helpful first. together: causes added one after the other.

    rmse: m, of the trials as they are, on ``count`` poses; ``outliers`` more are left out of all comparisons. every:
    of the used samples only so many-th were looked at, 1 for all.
    """

    rmse: float
    count: int
    outliers: int
    alone: tuple[Cause, ...]
    together: tuple[Cause, ...]
    every: int = 1

    @property
    def told_poses(self) -> str:
        """Such as 2907 poses, of every 7th used sample."""
        thin = "" if self.every == 1 else f", of every {ordinal(self.every)} used sample"
        return f"{self.count} poses{thin}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in words."""
        found = [each for each in self.alone if each.fit is not None and each.explained >= _least(each, self.count)]
        said = [f"as the trials stand, the model's RMSE is {1e3 * self.rmse:.3g} mm on {self.told_poses}"]
        said += [f"{each.name} alone ({each.told}) would explain {_share(each)}" for each in found[:3]]
        if not found:
            said.append("no single cause would explain 5 % of the squared error, or more than noise alone lets it")
        elif len(self.together) > 1:
            names, last = " and ".join(each.name for each in self.together), self.together[-1]
            said.append(
                f"{names} together ({last.told}) would explain {_share(last)} and leave {1e3 * last.rmse:.3g} mm"
            )
        said.append("that a cause would explain an error does not show that it is the cause: measure it where you can")
        return tuple(said)


def diagnose(trials: Sequence[Trial], setup: Setup | None = None, watch: Watch | None = None) -> Diagnosis:
    """What would explain the errors of ``trials`` against the model with ``setup``.

    Of more than `ENOUGH_POSES` only every k-th used sample counts. watch(done, of, what) is told of each evaluation.
    Causes that the data cannot tell, or whose fit fails, are listed with the reason. Raises as `identify`.
    """
    setup, trials = setup or Setup(), registered(checked(trials))
    every = -(-sum(int((each.kept & each.on_robot).sum()) for each in trials) // ENOUGH_POSES)
    trials = tuple(thinned(each, every) for each in trials) if every > 1 else trials
    causes = {name: _determinable(numbers, trials, setup) for name, numbers in CAUSES.items()}
    causes = {name: numbers for name, numbers in causes.items() if numbers}
    tell = _Steps(watch, 2 + len(causes) + 3 * (MOST - 1))
    clean, outliers = _without_outliers(trials, setup, tell)
    alone = [_tried(name, numbers, clean, setup, tell) for name, numbers in causes.items()]
    alone.sort(key=lambda each: -each.explained)
    base = next((each.fit for each in alone if each.fit is not None), None)
    rmse = base.rmse_before if base is not None else float("nan")
    count = sum(int((each.kept & each.on_robot).sum()) for each in clean)
    together = _together(alone, causes, clean, setup, tell, count) if base is not None else []
    causes_found = {"alone": tuple(alone), "together": tuple(together)}
    return Diagnosis(rmse=rmse, count=count, outliers=outliers, every=max(1, every), **causes_found)


def _determinable(numbers: tuple[str, ...], trials: Sequence[Trial], setup: Setup) -> tuple[str, ...]:
    """Those numbers of a cause that these trials can have; tilting gravity about itself changes nothing."""
    if numbers[0].startswith("gravity"):
        return across_gravity(trials) if any(any(each.gravity) for each in trials) else ()
    if numbers[0].endswith("mass") and not any(any(each.gravity) for each in trials):
        return ()
    if numbers[0].startswith("tension") and not any(np.isfinite(each.tensions).any() for each in trials):
        return ()
    if numbers[0] in ("torsion_factor", "youngs_modulus"):
        robot = the_robot(setup, trials)
        known = numbers[0] in robot.parameters() and (numbers[0] != "torsion_factor" or robot.torsion == "homogenized")
        return numbers if known else ()
    return numbers


def _without_outliers(trials: Sequence[Trial], setup: Setup, tell: _Steps) -> tuple[tuple[Trial, ...], int]:
    """The trials without poses that even a generous fit finds far off."""
    tell("looking for outliers")
    for generous in (("base_tilt_x", "base_tilt_y", "base_x", "base_y", "base_z", "youngs_modulus"), ("base_tilt_y",)):
        try:
            fit = identify(trials, generous, setup=setup, watch=tell.within)
            break
        except TendonrodError:
            continue
    else:
        return tuple(trials), 0
    cleaned = []
    for i, trial in enumerate(trials):
        position, at = trial.position.copy(), fit.outliers[fit.outliers[:, 0] == i]
        position[at[:, 1], at[:, 2]] = np.nan
        cleaned.append(replace(trial, position=position))
    return tuple(cleaned), len(fit.outliers)


def _tried(name: str, numbers: tuple[str, ...], trials: tuple[Trial, ...], setup: Setup, tell: _Steps) -> Cause:
    tell(name)
    try:
        fit = identify(trials, numbers, setup=setup, loss="squares", watch=tell.within)
    except InvalidInput as error:
        why = f"not to be had: {error.allowed.removeprefix('left out: ').removeprefix('fewer: ')}"
        return Cause(name=name, explained=0.0, rmse=float("nan"), fit=None, why=why)
    except TendonrodError as error:
        return Cause(name=name, explained=0.0, rmse=float("nan"), fit=None, why=str(error))
    before, after = (np.mean(each**2) for each in (fit.distance_before, fit.distance))
    explained = max(0.0, 1.0 - float(after / before)) if before > 0.0 else 0.0  # the noise's shape counts in the fit
    return Cause(name=name, explained=explained, rmse=fit.rmse, fit=fit)


def _least(cause: Cause, count: int, known: int = 0) -> float:
    """Share that a cause must explain of what is left, to be worth it and more than chance: F test, 3 count errors.

    known: numbers that were freed before.
    """
    from scipy.stats import f

    m = max(1, (len(cause.fit.unknowns) if cause.fit is not None else 1) - known)
    rest = max(1, 3 * count - known - m)
    F = float(f.isf(CHANCE, m, rest))
    return max(WORTH, m * F / (m * F + rest))


def _together(
    alone: Sequence[Cause], causes: dict[str, tuple[str, ...]], trials: tuple[Trial, ...], setup: Setup, tell: _Steps,
    count: int,
) -> list[Cause]:  # fmt: skip
    """The best cause, then the best beside it, as long as each is worth it."""
    taken = [alone[0]]
    while len(taken) < MOST and taken[-1].explained < 1.0:
        names = [each.name for each in taken]
        numbers = tuple(number for name in names for number in causes[name])
        others = [each for each in alone if each.name not in names and each.fit is not None]
        likely = sorted(others, key=lambda each: _criterion(each, _by_slope(each, taken[-1]), count))[:3]
        tried = [_tried(each.name, numbers + causes[each.name], trials, setup, tell) for each in likely]
        fitted = [each for each in tried if each.fit is not None]
        best = min(fitted, key=lambda each: _criterion(each, each.explained, count), default=taken[-1])
        left = (1.0 - best.explained) / max(1e-300, 1.0 - taken[-1].explained)
        if not isfinite(best.rmse) or 1.0 - left < _least(best, count, len(numbers)) or best is taken[-1]:
            break
        taken.append(best)
    return taken


def _criterion(cause: Cause, explained: float, count: int) -> float:
    """Schwarz's: what is left, and a price for each number, so that three do not win over one by a hair."""
    assert cause.fit is not None
    return 3 * count * log(max(1e-12, 1.0 - explained)) + len(cause.fit.unknowns) * log(3 * count)


def _by_slope(other: Cause, taken: Cause) -> float:
    """Share of what is left that a cause would explain, were the model linear."""
    assert other.fit is not None
    assert taken.fit is not None
    here, there = taken.fit, other.fit
    X, _ = there.problem.misfit.slopes(there.problem.at(there.problem.start))
    own, _ = here.problem.misfit.slopes(here.problem.at(here.values / here.problem.unit))
    rows = np.concatenate([own, X], axis=2)[:, :3].reshape(here.errors.size, -1)
    size, e = np.linalg.norm(rows, axis=0), here.errors.ravel()
    rows = rows / np.where(size > 0.0, size, 1.0)
    left = e - rows @ np.linalg.lstsq(rows, e, rcond=1e-6)[0]
    return 1.0 - float(left @ left) / max(1e-300, float(e @ e))


def _share(cause: Cause) -> str:
    return f"{100.0 * cause.explained:.1f} % of the squared error"


class _Steps:
    """Counts the fits, and how far each is."""

    def __init__(self, watch: Watch | None, total: int) -> None:
        self.watch, self.total, self.done, self.what = watch, total, -1, ""

    def __call__(self, what: str) -> None:
        self.done, self.what = min(self.done + 1, self.total - 1), what
        self.within(0, 1)

    def within(self, done: int, of: int, what: str = "") -> None:
        """An evaluation in the fit at hand."""
        if self.watch is not None:
            self.watch(self.done * 100 + round(100.0 * done / of), self.total * 100, self.what)
