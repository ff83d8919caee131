"""What figures of a session are made of: `Course`, numbers of every step and a few whole snapshots, from one pass.

A session of an hour has hundreds of thousands of snapshots, which no memory holds; a `Course` keeps of each what is
drawn against time, and whole only those of its `frames`, evenly over the time in which something moved, and of its
`moments`, which tell the story.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from string import ascii_lowercase
from types import MappingProxyType

import numpy as np

from ..errors import Fact, InvalidInput, whole
from ..navigate.scenario import Scenario
from ..navigate.snapshot import Snapshot

MOST_FRAMES = 2000
SPARE = 8  # snapshots kept for each frame wanted, from which the frames are chosen
MOST_MOMENTS = 6
ENTERED = 5e-3  # m of robot out of the outer tube, at which it is said to have entered
SECTOR = np.radians(8.0)  # to either side, within which the tip is beside or in front of the cord
SIDES = {"right of the cord": 0.5 * np.pi, "ventral of the cord": np.pi, "left of the cord": -0.5 * np.pi}
NEAR = 0.04  # of the insertion, and in rad of rotation / 5: moments nearer to each other are told as one
PRESSED = 0.1  # of the limit: moments with pressures further apart are two
_ENTRY, _PEAK, _END = "entry", "highest pressure", "end"


@dataclass(frozen=True, kw_only=True, eq=False)
class Moment:
    """A moment of the story: its letter, what happened in words, and the whole snapshot."""

    letter: str
    title: str
    snapshot: Snapshot


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """A session as figures need it. n steps, the start included.

    - scenario: at its end. time (n,) s; insertion (n,) share; exposed (n,) m; rotation (n,) rad;
      tension (n, tendons) N.
    - tip (n, 3) m, NaN while the robot is retracted.
    - clearance: structure -> (n,) m, least along the body; pressure (n,) Pa, highest on soft tissue.
    - in_range (n,), blocked (n,): bools as in `Snapshot`. placings: how often the outer tube was placed anew.
    - reached: (name, time s), in order. warnings: (code, text when first said, severity, first time s, seconds in all).
    - frames: snapshots evenly over the time in which something moved. moments: `Moment`, in order of time.
    """

    scenario: Scenario
    time: np.ndarray
    insertion: np.ndarray
    exposed: np.ndarray
    rotation: np.ndarray
    tension: np.ndarray
    tip: np.ndarray
    clearance: Mapping[str, np.ndarray]
    pressure: np.ndarray
    in_range: np.ndarray
    blocked: np.ndarray
    placings: int
    reached: tuple[tuple[str, float], ...]
    warnings: tuple[tuple[str, str, str, float, float], ...]
    frames: tuple[Snapshot, ...]
    moments: tuple[Moment, ...]

    @property
    def duration(self) -> float:
        """From the first snapshot to the last, s."""
        return float(self.time[-1] - self.time[0])


def course(snapshots: Iterable[Snapshot], scenario: Scenario, frames: int = 120) -> Course:
    """The `Course` of all ``snapshots``, at most so many of them as frames. Raises `InvalidInput` for none."""
    taker = Taker(scenario, frames)
    for _ in taker.passing(snapshots):
        pass
    return taker.course()


def tip_angle(points: np.ndarray) -> np.ndarray:
    """Angle (n,) rad of ``points`` (n, 3) around the cord: 0 dorsal, pi/2 right, pi ventral, -pi/2 left."""
    return np.arctan2(points[..., 1], points[..., 0])


class Taker:
    """Takes a `Course` from snapshots that pass by on their way to somebody else: `passing`, then `course`."""

    def __init__(self, scenario: Scenario, frames: int = 120) -> None:
        self.scenario, self._count = scenario, whole("frames", frames, 2, MOST_FRAMES)
        self._numbers, self._width = array("d"), 0
        self._names: tuple[str, ...] = ()
        self._last: Snapshot | None = None
        self._moving, self._every = 0.0, 0.0
        self._frames: list[tuple[float, Snapshot]] = []
        self._found: dict[str, Snapshot] = {}
        self._reached: dict[str, float] = {}
        self._warned: dict[str, tuple[str, str, float, float]] = {}
        self._placings, self._peak = 0, 0.0

    def passing(self, snapshots: Iterable[Snapshot]) -> Iterator[Snapshot]:
        """The same snapshots."""
        for snapshot in snapshots:
            self._take(snapshot)
            yield snapshot

    def course(self) -> Course:
        """Of what has passed. Raises `InvalidInput` where nothing has."""
        if self._last is None:
            raise InvalidInput("snapshots", Fact("none"), "one or more")
        table = np.array(self._numbers).reshape(-1, self._width)
        table.setflags(write=False)
        k, T = 11, self._last.tension.size
        clearance = {name: table[:, k + i] for i, name in enumerate(self._names)}
        return Course(
            scenario=replace(self.scenario, tube=self._last.tube), time=table[:, 0], insertion=table[:, 1],
            exposed=table[:, 2], rotation=table[:, 3], tip=table[:, 4:7], pressure=table[:, 7],
            in_range=table[:, 8] > 0.0, blocked=table[:, 9] > 0.0, tension=table[:, self._width - T :],
            clearance=MappingProxyType(clearance), placings=self._placings, reached=tuple(self._reached.items()),
            warnings=tuple((code, *said) for code, said in self._warned.items()), frames=self._chosen(),
            moments=_moments(self._found | {_END: self._last}),
        )  # fmt: skip

    def _take(self, now: Snapshot) -> None:
        before, self._last = self._last, now
        self._note(now)
        if before is None:
            self._frames.append((0.0, now))
            return
        self._placings += now.tube != before.tube
        self._warn(now, now.time - before.time)
        if now.posture != before.posture:
            self._moving += now.time - before.time
            self._keep(now)
            self._look(now, before)

    def _note(self, now: Snapshot) -> None:
        """The row of numbers of one step."""
        self._names = self._names or tuple(now.clearance)
        tip = now.tip if now.exposed > 0.0 else np.full(3, np.nan)
        row = [now.time, now.insertion, now.exposed, now.rotation, *tip, now.limits["pressure"].value]
        row += [now.in_range, bool(now.blocked), now.index, *(now.clearance[name].min() for name in self._names)]
        row += now.posture.tension
        self._width = len(row)
        self._numbers.extend(map(float, row))

    def _keep(self, now: Snapshot) -> None:
        """Snapshots at least ``_every`` seconds of movement apart; every other goes when they become too many."""
        if self._moving - self._frames[-1][0] < self._every:
            return
        self._frames.append((self._moving, now))
        if len(self._frames) > SPARE * self._count:
            self._frames = self._frames[::2]
            self._every = 2.0 * max(self._every, self._moving / (SPARE * self._count))

    def _chosen(self) -> tuple[Snapshot, ...]:
        kept = self._frames if self._frames[-1][1] is self._last else [*self._frames, (self._moving, self._last)]
        at = np.array([moving for moving, _ in kept])
        wanted = np.linspace(0.0, at[-1], min(self._count, len(kept)))
        rows = np.unique(np.searchsorted(at, wanted - 1e-9 * max(at[-1], 1.0)))
        return tuple(kept[i][1] for i in rows.tolist())  # pyright: ignore[reportReturnType] - the last is not None

    def _look(self, now: Snapshot, before: Snapshot) -> None:
        """Whether this is a moment of the story."""
        for name in now.reached:
            if name not in self._reached:
                self._reached[name] = now.time
                self._found[f"{name} reached"] = now
        if now.exposed >= ENTERED > before.exposed:
            self._found.setdefault(_ENTRY, now)
        if now.exposed > ENTERED:
            off = {name: abs(np.angle(np.exp(1j * (tip_angle(now.tip) - at)))) for name, at in SIDES.items()}
            for name in (name for name in off if off[name] <= SECTOR):
                self._found.setdefault(name, now)
        pressure = now.limits["pressure"]
        if pressure.is_exceeded and pressure.value > self._peak:
            self._peak, self._found[_PEAK] = pressure.value, now

    def _warn(self, now: Snapshot, dt: float) -> None:
        for each in now.warnings:
            text, severity, first, seconds = self._warned.get(each.code, (each.text, each.severity, now.time, 0.0))
            self._warned[each.code] = (text, severity, first, seconds + dt)


def _moments(found: Mapping[str, Snapshot]) -> tuple[Moment, ...]:
    """In order of time; those that are nearly the same become one, and the least telling go where there are many."""
    told: list[tuple[list[str], Snapshot]] = []
    for title in sorted(found, key=_weight):
        snapshot = found[title]
        same = [titles for titles, other in told if _alike(snapshot, other)]
        if same:
            same[0].append(title)
        elif len(told) < MOST_MOMENTS:
            told.append(([title], snapshot))
    told.sort(key=lambda each: each[1].index)
    return tuple(
        Moment(letter=letter, title=", ".join(titles[:2]), snapshot=snapshot)
        for letter, (titles, snapshot) in zip(ascii_lowercase, told, strict=False)
    )


def _weight(title: str) -> int:
    """Low: must be told."""
    order = (_END, "reached", "ventral of", "right of", "left of", _ENTRY, _PEAK)
    return next(k for k, word in enumerate(order) if word in title)


def _alike(a: Snapshot, b: Snapshot) -> bool:
    pressures = [each.limits["pressure"] for each in (a, b)]
    if abs(pressures[0].value - pressures[1].value) > PRESSED * pressures[0].high:
        return False
    apart = abs(a.insertion - b.insertion) + abs(a.rotation - b.rotation) / 5.0
    return a.tube == b.tube and apart + sum(abs(x - y) for x, y in zip(a.tension, b.tension, strict=True)) < NEAR
