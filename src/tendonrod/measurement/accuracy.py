"""`accuracy`: measured points against the model, place by place, as the paper's Table I; with and without gravity.

Compared are points of the body: the sensor's position less its offset, on the tube's axis or at `Tracker.point`. Where
the offset cannot be taken off, because the orientation or `Tracker.turn` is not known, the sensors themselves are
compared, the model's with its offset.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import Fact, InvalidInput, one_of
from ..robot import Robot
from ..rotation import exp_so3, log_so3
from .errorvectors import Errors
from .prediction import Predictor
from .registration import Registration, registered, registrations, without_offset, world_poses
from .setup import Setup, places
from .trial import Trial

WITH, WITHOUT = "gravity modelled", "gravity not modelled"
ASKED = {"both": (WITHOUT, WITH), "with": (WITH,), "without": (WITHOUT,)}
NO_ORIENTATION = "no orientation to take the offset off with"
SAME_PLACE = 1e-6  # of the robot's length
Watch = Callable[[int, int, str], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """The n samples measured at one place of one robot, over all its trials, in the order of trial, time and tracker.

    at: s_m, m. trial, sample, tracker: (n,) where a sample comes from. tensions, displacements: (n, T) as read; N, m.
    measured: (n, 3) m, world. errors: by `WITH` and `WITHOUT`, those that were asked for.
    """

    robot: Robot
    at: float
    trial: np.ndarray
    sample: np.ndarray
    tracker: np.ndarray
    tensions: np.ndarray
    displacements: np.ndarray
    measured: np.ndarray
    errors: dict[str, Errors]

    @property
    def n(self) -> int:
        """Samples."""
        return len(self.measured)

    @property
    def share(self) -> float:
        """at as a share of the robot's length."""
        return self.at / self.robot.length_na


@dataclass(frozen=True, kw_only=True, eq=False)
class Accuracy:
    """What `accuracy` found. trials: registered. registrations: of each. places: by robot, then along it.

    fates: by trial, then tracker: how many samples were used ("kept"), and why others were not.
    """

    trials: tuple[Trial, ...]
    registrations: tuple[Registration, ...]
    setup: Setup
    runs: tuple[str, ...]
    places: tuple[Place, ...]
    fates: tuple[dict[str, Counter[str]], ...]

    @property
    def best_known(self) -> str:
        """The run that models what is known of gravity: `WITH` where it was asked for."""
        return self.runs[-1]

    @property
    def counts(self) -> tuple[int, int]:
        """Samples of trackers on the robot: those compared, and all."""
        every = sum(each.on_robot.sum() * each.time.size for each in self.trials)
        return sum(each.n for each in self.places), int(every)

    @property
    def robots(self) -> tuple[Robot, ...]:
        """The robots of the places, each once."""
        return tuple(dict.fromkeys(each.robot for each in self.places))

    def of(self, robot: Robot) -> tuple[Place, ...]:
        """The places of one robot."""
        return tuple(each for each in self.places if each.robot == robot)

    def lean(self, robot: Robot, run: str | None = None) -> tuple[np.ndarray, float]:
        """(3,) rotation vector (rad) about the exit that, turning the model as a whole, leaves the least squared error;

        and the share of the squared error that it takes away, 0 to 1. It is no explanation: gravity is not solved anew.
        """
        errors = [each.errors[run or self.best_known] for each in self.of(robot)]
        model, vectors = (np.concatenate([getattr(each, name) for each in errors]) for name in ("model", "vectors"))
        turn = log_so3(_best_turn(model, model + vectors))
        left = vectors + model - model @ exp_so3(turn).T
        total = (vectors**2).sum()
        return turn, float(1.0 - (left**2).sum() / total) if total > 0.0 else 0.0


def accuracy(
    trials: Sequence[Trial], *, robot: Robot | None = None, setup: Setup | None = None, gravity: str = "both",
    watch: Watch | None = None,
) -> Accuracy:  # fmt: skip
    """Compare the used samples of ``trials`` with the model at their readings of tension, insertion and rotation.

    robot: the model's, None for that of ``setup``, and without one for that of each trial; trackers then sit at the
    same share of its length. gravity: "both", "with" or "without"; where no trial has any, there is one run without.
    Trials that are not registered are, by `registered`. watch(done, of, what) is told of samples as they are
    predicted. Raises `InvalidInput` where no sample can be compared, `NotConverged` where the model has no equilibrium.
    """
    trials = _checked(trials)
    runs = ASKED[one_of("gravity", gravity, ASKED)] if any(any(each.gravity) for each in trials) else (WITHOUT,)
    setup = setup or Setup()
    setup = setup if robot is None else replace(setup, robot=robot)
    known = registrations(trials)
    trials = registered(trials)
    views = [_View(trial, setup) for trial in trials]
    if not any(each.compared.any() for each in views):
        lost = Counter(fate for each in views for fate in each.trial.fates[:, each.trial.on_robot].ravel())
        allowed = "of one or more used samples of a tracker on the robot"
        if not any(np.isfinite(each.trial.position).any() for each in views):
            allowed += "; no tracker has a position in them"
        raise InvalidInput("trials", dict(lost) or Fact("none"), allowed)
    for run in runs:
        predictor = Predictor(trials)
        predictor.watch = _part_of(watch, runs, run)
        found = predictor(setup if run == WITH else setup.weightless())
        for i, view in enumerate(views):
            view.compare(run, found.position[i], found.rotation[i])
    return Accuracy(
        trials=trials,
        registrations=known,
        setup=setup,
        runs=runs,
        places=tuple(_grouped(views, runs)),
        fates=tuple(each.counts() for each in views),
    )


def _part_of(watch: Watch | None, runs: Sequence[str], run: str) -> Callable[[float, int], None] | None:
    """Told of the samples of one run, tells of those of all."""
    if watch is None:
        return None
    before = list(runs).index(run)
    return lambda done, of: watch(round(done) + before * of, len(runs) * of, run)


def _checked(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    given = [trials] if isinstance(trials, Trial) else trials
    if not isinstance(given, Sequence) or not given or not all(isinstance(each, Trial) for each in given):
        raise InvalidInput("trials", trials, "a sequence of one or more Trial")
    return tuple(given)


class _View:
    """One trial as it is compared: which samples, and the points of the body, measured and by run."""

    def __init__(self, trial: Trial, setup: Setup) -> None:
        self.trial, self.holder = trial, setup.holder
        self.robot = setup.robot_of(trial)
        self.at = places(trial, self.robot)
        position, self.rotation = world_poses(trial)
        self.usable = trial.kept & trial.on_robot
        self.takes_off = self._where_offsets_come_off()
        self.measured = self._points(position, self.rotation)
        self.compared = self.usable & np.isfinite(self.measured).all(axis=-1)
        self.model: dict[str, np.ndarray] = {}
        self.turns: dict[str, np.ndarray] = {}

    def _where_offsets_come_off(self) -> np.ndarray:
        """(k,) whether a tracker's orientation is known at all, so that its points on the body are."""
        known = (self.usable & np.isfinite(self.rotation).all(axis=(2, 3))).any(axis=0)
        return known & np.array([each.turn is not None for each in self.trial.trackers])

    def _points(self, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        columns = [
            without_offset(position[:, j], rotation[:, j], each, self.holder) if self.takes_off[j] else position[:, j]
            for j, each in enumerate(self.trial.trackers)
        ]
        return np.stack(columns, axis=1)

    def compare(self, run: str, position: np.ndarray, rotation: np.ndarray) -> None:
        self.model[run] = self._points(position, rotation)
        turns = np.full(position.shape, np.nan)
        known = self.compared & np.isfinite(self.rotation).all(axis=(2, 3)) & self.takes_off
        turns[known] = log_so3(self.rotation[known] @ np.swapaxes(rotation[known], -1, -2))
        self.turns[run] = turns

    def counts(self) -> dict[str, Counter[str]]:
        """By tracker: fates as `Trial.counts`, and what could not be compared."""
        found = self.trial.counts()
        for j, tracker in enumerate(self.trial.trackers):
            lost = int((self.usable[:, j] & ~self.compared[:, j]).sum())
            if lost:
                found[tracker.name] += Counter({NO_ORIENTATION: lost})
                found[tracker.name].subtract({"kept": lost})
        return {name: +count for name, count in found.items()}


def _grouped(views: Sequence[_View], runs: Sequence[str]) -> Iterator[Place]:
    """Samples of one robot and place together."""
    for robot in dict.fromkeys(view.robot for view in views):
        same = [(i, view) for i, view in enumerate(views) if view.robot == robot]
        seen = [view.at[np.asarray(view.compared.any(axis=0))] for _, view in same]
        ats = np.unique(np.concatenate(seen)).tolist()
        if not ats:  # its trials have a tracker on the base only
            continue
        first = [at for k, at in enumerate(ats) if k == 0 or at - ats[k - 1] > SAME_PLACE * robot.length_na]
        for low, high in zip(first, [*first[1:], np.inf], strict=True):
            yield _place(robot, low, same, [(view.at >= low) & (view.at < high) for _, view in same], runs)


def _place(robot: Robot, at: float, same: Sequence[tuple[int, _View]], here: Sequence[np.ndarray], runs) -> Place:
    chosen = [(i, view, *np.nonzero(view.compared & column)) for (i, view), column in zip(same, here, strict=True)]

    def gathered(take) -> np.ndarray:
        return np.concatenate([take(view, rows, columns) for _, view, rows, columns in chosen])

    insertion = gathered(lambda view, rows, _: view.trial.insertion[rows])
    measured = gathered(lambda view, rows, columns: view.measured[rows, columns])
    errors = {}
    for run in runs:
        model = gathered(lambda view, rows, columns, run=run: view.model[run][rows, columns])
        turns = gathered(lambda view, rows, columns, run=run: view.turns[run][rows, columns])
        known = {"insertion": insertion, "length": robot.length_na}
        errors[run] = Errors(model=model, vectors=measured - model, turns=turns, **known)
    return Place(
        robot=robot,
        at=float(at),
        trial=np.concatenate([np.full(len(rows), i) for i, _, rows, _ in chosen]),
        sample=gathered(lambda _, rows, columns: rows),
        tracker=gathered(lambda _, rows, columns: columns),
        tensions=gathered(lambda view, rows, _: view.trial.tensions[rows]),
        displacements=gathered(lambda view, rows, _: view.trial.displacements[rows]),
        measured=measured,
        errors=errors,
    )


def _best_turn(points: np.ndarray, goals: np.ndarray) -> np.ndarray:
    """(3, 3) rotation that brings ``points`` nearest to ``goals`` (n, 3): Wahba's problem, by singular values."""
    U, _, Vt = np.linalg.svd(goals.T @ points)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
