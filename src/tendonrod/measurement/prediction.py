"""`predict`: where the model puts the trackers of a trial, with exact derivatives by numbers of robot and bench.

Samples that differ in their tension alone lie on a smooth curve: it is solved at Chebyshev points and interpolated, to
better than `TOLERANCE`. Samples whose insertion, rotation or several tensions differ too are interpolated from some of
them, see `interpolation`. Where values are not smooth enough, or samples few, each is solved. Where tendons rub,
samples are solved in order, each with the last as its history, and derivatives are differences of whole runs.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..robot import Robot
from ..rotation import log_so3
from ..statics.shape import Shape
from .family import Family, family_key
from .interpolation import Spread
from .reach import features, kinks, reach
from .setup import Setup
from .steadied import steadied
from .trial import EXPOSED, LEFT_OUT, Trial

TOLERANCE = np.array([1e-6] * 3 + [1e-4] * 9)  # m, rad, of position and frame between Chebyshev points
COUNTS = (7, 13, 25)  # Chebyshev points; each set holds those before
FEW = 24  # samples in several directions, of which each is solved
KEPT_SHAPES = 1000  # to start from
SMALL = 1e-3  # change of a number, relative to its scale, for differences where tendons rub


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """The sensors of each trial as the model has them, world frame, SI; NaN where a sample is not used.

    position[i] (n, k, 3), rotation[i] (n, k, 3, 3). columns[i] (n, k, 6, m): derivatives of the position, and as
    rotation vectors, by the numbers ``names``. slope[i] (n, k, 6, T): by the reading of each tendon's tension, N; 0
    where it is slack or driven by displacement, and NaN without names. solves: how many equilibria were solved.
    """

    names: tuple[str, ...]
    position: tuple[np.ndarray, ...]
    rotation: tuple[np.ndarray, ...]
    columns: tuple[np.ndarray, ...]
    slope: tuple[np.ndarray, ...]
    solves: int


def predict(trials: Sequence[Trial], setup: Setup | None = None, names: Sequence[str] = ()) -> Prediction:
    """The sensors of all used samples, with derivatives by ``names``: numbers of `Setup` or of its robot.

    Raises `NotConverged` where the model has no equilibrium for a sample, `InvalidInput` for unknown names.
    """
    return Predictor(trials, names)(setup or Setup())


class Predictor:
    """`predict` for setups that differ little: each solve starts from the last of its kind.

    watch(done, of) is told of samples as they are predicted.
    """

    def __init__(self, trials: Sequence[Trial], names: Sequence[str] = ()) -> None:
        self.trials, self.names = tuple(trials), tuple(names)
        self.shapes: dict[Hashable, Shape] = {}
        self.orders: dict[Hashable, tuple[np.ndarray, Spread]] = {}
        self.reaches: dict[Hashable, np.ndarray] = {}
        self.watch: Callable[[float, int], None] | None = None
        self.done, self.samples = 0.0, sum(int(_used(each).sum()) for each in trials)

    @cached_property
    def steady(self) -> tuple[Trial, ...]:
        """The trials with tensions that turn only where they do so beyond their noise."""
        found = []
        for trial in self.trials:
            columns = [steadied(column, trial.tension_noise) for column in trial.tensions.T]
            found.append(replace(trial, tensions=np.array(columns).T.reshape(trial.tensions.shape)))
        return tuple(found)

    def __call__(self, setup: Setup) -> Prediction:
        self.done = 0.0
        for name in self.names:
            setup.value(name, self.trials)  # for its complaints
        rubs = any(setup.robot_of(each).friction.any() for each in self.trials)
        if rubs or any("friction" in name for name in self.names):
            return self._rubbing(setup)
        found, solves = _Sensors(self.trials, len(self.names)), 0
        for key, members in self._families(setup).items():
            family = Family(self.trials, setup, self.names, members)
            found.take(family, self._values(key, family))
            solves += family.solves
        return found.prediction(self.names, solves)

    def _families(self, setup: Setup) -> dict[Hashable, list[tuple[int, np.ndarray]]]:
        """Equilibria that differ in their commands alone -> (trial, samples) of each."""
        found: dict[Hashable, list[tuple[int, np.ndarray]]] = {}
        for i, trial in enumerate(self.trials):
            rows = np.flatnonzero(_used(trial))
            kinds = np.column_stack([kinks(trial, setup), np.isfinite(trial.tensions)])[rows]
            for kind in np.unique(kinds, axis=0):
                same = rows[(kinds == kind).all(axis=1)]
                found.setdefault((family_key(trial, setup, self.names), *kind.tolist()), []).append((i, same))
        return found

    def _values(self, key: Hashable, family: Family) -> np.ndarray:
        """Values of all samples, interpolated where that is good enough."""
        differ = np.ptp(family.commands, axis=0) > 0.0
        if not differ[:2].any() and differ[2:].sum() == 1:
            found = self._curve(key, family)
        else:
            found = self._spread(key, family) if len(family.commands) > FEW else None
        if found is not None:
            self._tell(len(family.commands))
            return found
        distinct, which = np.unique(family.commands, axis=0, return_inverse=True)
        values = []
        for k, command in enumerate(distinct):
            values.append(self._solved((key, k), family, command))
            self._tell(len(family.commands) / len(distinct))
        return np.array(values)[which.ravel()]

    def _tell(self, more: float) -> None:
        self.done += more
        if self.watch is not None:
            self.watch(min(self.done, self.samples), self.samples)

    def _spread(self, key: Hashable, family: Family) -> np.ndarray | None:
        """Values of all samples, from some of them; None where they are not smooth."""
        spread = self._order(key, family)

        def value(n: int, k: int) -> np.ndarray:
            at = family.commands[k]
            return family.unturned(self._solved((key, n), family, at)[None], at[None])[0]

        found = spread.interpolated(value, TOLERANCE)
        return None if found is None else family.turned_back(found, family.commands)

    def _order(self, key: Hashable, family: Family) -> Spread:
        """The order in which samples are solved: that of the last time, where their commands are the same."""
        commands, spread = self.orders.get(key, (np.empty(0), None))
        if spread is None or not np.array_equal(commands, family.commands):
            if key not in self.reaches:
                self.reaches[key] = reach(family, lambda at: self._solved((key, 0), family, at))
            spread = Spread(features(family, self.reaches[key]))
            self.orders[key] = family.commands, spread
        return spread

    def _curve(self, key: Hashable, family: Family) -> np.ndarray | None:
        """Values of all samples, interpolated in the one drive that differs; None where they are few or not smooth."""
        d = 2 + int(np.argmax(np.ptp(family.commands[:, 2:], axis=0)))
        drive = family.commands[:, d]
        if len(np.unique(drive)) <= COUNTS[0]:
            return None
        low, high = float(drive.min()), float(drive.max())
        solved: dict[int, np.ndarray] = {}
        for count in COUNTS:
            nodes = np.cos(np.pi * np.arange(count) / (count - 1))
            stride = (COUNTS[-1] - 1) // (count - 1)
            for k, x in enumerate(nodes):
                if k * stride not in solved:
                    at = family.commands[0].copy()
                    at[d] = 0.5 * (low + high) + 0.5 * (high - low) * x
                    solved[k * stride] = self._solved((key, k * stride), family, at)
            weights = np.polynomial.chebyshev.chebfit(nodes, np.eye(count), count - 1)
            values = np.array([solved[k * stride] for k in range(count)])
            last = np.abs(np.tensordot(weights[-2:], values[..., :12], 1)) / TOLERANCE
            if max(0.1 * last[0].max(), last[1].max()) < 1.0:  # they fall by 5 to 10 from one to the next
                x = (2.0 * drive - low - high) / (high - low)
                return np.tensordot(np.polynomial.chebyshev.chebvander(x, count - 1) @ weights, values, 1)
        return None

    def _solved(self, key: tuple[Hashable, int], family: Family, command: np.ndarray) -> np.ndarray:
        shape = family.solve(command, self.shapes.get(key) or self.shapes.get(key[0]))
        self._keep(key, shape)
        self._keep(key[0], shape)
        return family.values(shape)

    def _keep(self, key: Hashable, shape: Shape) -> None:
        """To start from; only so many, for a shape holds a megabyte with its derivatives."""
        if key in self.shapes or len(self.shapes) < KEPT_SHAPES:
            self.shapes[key] = shape

    def _rubbing(self, setup: Setup) -> Prediction:
        base, solves = self._run(setup)
        columns = [np.full((*each.shape[:2], 6, len(self.names)), np.nan) for each in base.position]
        for j, name in enumerate(self.names):
            value = setup.value(name, self.trials)
            step = SMALL * (abs(value) or 1.0) if name not in _STEPS else _STEPS[name]
            moved, more = self._run(setup.changed({name: value + step}, self.trials))
            solves += more
            for i, each in enumerate(columns):
                each[..., j] = _difference(base, moved, i, step)
        fields = {"names": self.names, "columns": tuple(columns), "slope": self._slopes(setup), "solves": solves}
        return Prediction(position=base.position, rotation=base.rotation, **fields)

    def _slopes(self, setup: Setup) -> tuple[np.ndarray, ...]:
        """By the readings, as if nothing rubbed: good enough to say what their noise does."""
        smooth = [replace(each, robot=_slippery(setup.robot_of(each))) for each in self.trials]
        return Predictor(smooth, ("tension_zero",))(replace(setup, robot=None)).slope

    def _run(self, setup: Setup) -> tuple[Prediction, int]:
        """All samples in the order of time, without derivatives."""
        found, solves = _Sensors(self.trials, 0), 0
        for i, trial in enumerate(self.trials):
            shape = None
            for row in _felt(trial, self.steady[i].tensions):
                family = Family(self.steady, setup, (), [(i, np.array([row]))])
                key = (i, int(row))
                shape = family.solve(family.commands[0], self.shapes.get(key) or shape, history=shape, steps=32)
                self._keep(key, shape)
                found.take(family, family.values(shape)[None])
                solves += 1
                self._tell(1.0)
        return found.prediction((), solves), solves


_STEPS = {
    **dict.fromkeys(("base_x", "base_y", "base_z", "holder_x", "holder_y", "holder_z"), 1e-5),
    **dict.fromkeys(("base_tilt_x", "base_tilt_y", "base_roll"), 1e-4),
    **dict.fromkeys(("gravity_tilt_x", "gravity_tilt_y", "gravity_tilt_z"), 1e-3),
    **dict.fromkeys(("tip_mass", "tracker_mass"), 1e-6),
    "tension_scale": 1e-3,
    "tension_zero": 1e-3,
    "displacement_zero": 1e-6,
    "tendon_friction": 1e-3,
}


def _used(trial: Trial) -> np.ndarray:
    """(n,) whether a tracker on the robot has a pose that is used."""
    return np.asarray((trial.kept & trial.on_robot).any(axis=1))


def _felt(trial: Trial, steady: np.ndarray) -> np.ndarray:
    """Samples that tendons that rub go through; of those that only thinning leaves out, where a tension turns."""
    if not _used(trial).any():
        return np.empty(0, dtype=int)
    driven = (np.isfinite(trial.tensions) | np.isfinite(trial.displacements)).all(axis=1)
    exposed = trial.insertion * trial.robot.length_na >= EXPOSED
    rows = np.flatnonzero(driven & exposed & np.isfinite(trial.rotation))
    thin = (trial.fates == LEFT_OUT).any(axis=1) & ~_used(trial)
    way = np.sign(np.diff(steady[rows], axis=0))
    for k in range(1, len(way)):
        way[k] = np.where(way[k] == 0.0, way[k - 1], way[k])  # a rest is no turn
    turns = np.zeros(rows.size, dtype=bool)
    turns[1:-1] = (way[1:] != way[:-1]).any(axis=1)
    return rows[~thin[rows] | turns]


def _slippery(robot: Robot) -> Robot:
    numbers = robot.parameters()
    return robot.replace(**{name: 0.0 for name in numbers if name.endswith("friction")})


def _difference(base: Prediction, moved: Prediction, i: int, step: float) -> np.ndarray:
    """(n, k, 6) of position and rotation vector, per step."""
    found = np.full((*base.position[i].shape[:2], 6), np.nan)
    found[..., :3] = (moved.position[i] - base.position[i]) / step
    known = np.isfinite(base.rotation[i]).all(axis=(-2, -1))
    R, Q = moved.rotation[i][known], base.rotation[i][known]
    found[known, 3:] = log_so3(R @ Q.transpose(0, 2, 1)) / step
    return found


class _Sensors:
    """Poses of all sensors, with their derivatives, filled family by family."""

    def __init__(self, trials: Sequence[Trial], m: int) -> None:
        self.trials = trials
        shapes = [each.position.shape[:2] for each in trials]
        self.position = [np.full((*shape, 3), np.nan) for shape in shapes]
        self.rotation = [np.full((*shape, 3, 3), np.nan) for shape in shapes]
        self.columns = [np.full((*shape, 6, m), np.nan) for shape in shapes]
        self.slope = [
            np.full((*shape, 6, each.robot.n_tendons), np.nan) for shape, each in zip(shapes, trials, strict=True)
        ]

    def take(self, family: Family, values: np.ndarray) -> None:
        """Values (q, places, …) of the family's samples, member after member."""
        done = 0
        for i, rows in family.members:
            part = values[done : done + len(rows)]
            readings = family.readings[done : done + len(rows)]
            done += len(rows)
            for j in np.flatnonzero(self.trials[i].on_robot):
                used = self.trials[i].kept[rows, j]
                at = rows[used], j
                pose = family.sensor(i, int(j), part[used], readings[used])
                self.position[i][at], self.rotation[i][at], self.columns[i][at], self.slope[i][at] = pose

    def prediction(self, names: tuple[str, ...], solves: int) -> Prediction:
        each = {name: tuple(getattr(self, name)) for name in ("position", "rotation", "columns", "slope")}
        return Prediction(names=names, solves=solves, **each)
