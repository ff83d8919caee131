"""`metrics`: a session in numbers: time, path, clearance, pressure, deviation from follow-the-leader, targets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field, replace
from math import inf, nan
from typing import Any

import numpy as np

from .snapshot import Snapshot
from .trail import Trail

EVERY = 0.5e-3  # m of insertion between looks at the deviation


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """A smallest or largest value: where on the body (s, m), at which time (s), with which tip (m)."""

    value: float
    s: float
    time: float
    tip: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Arrival:
    """A target reached: at which time (s), how far from its middle the tip came at best (m), and whether no limit was
    exceeded and the model held when it was first reached.
    """

    time: float
    nearest: float
    within_limits: bool


@dataclass(frozen=True, kw_only=True)
class Metrics:
    """A session in numbers; SI.

    - duration s; samples; path m, the way of the tip; insertion, largest exposed length, m.
    - clearance: structure -> smallest distance of the tube's wall (`Nearest`), m. pressure: largest on the body, Pa,
      None without contact; pressed: the structure that it is on, "" without. The limit of pressure is that of soft
      tissue alone. force: largest contact force at one place, N; total_force: of all together, N.
    - follow_the_leader_rms, _max: distance of the body from the tip's path (`Trail`), m; NaN without insertion.
    - outside_model, outside_limits: share of the time outside the model's range, and with a limit exceeded; blocked:
      share of the time in which a command was refused. exceeded: gauge -> share of the time.
    - targets: name -> `Arrival`; nearest: name -> smallest distance of the tip to each target, m.
    """

    duration: float
    samples: int
    path: float
    insertion: float
    clearance: dict[str, Nearest]
    pressure: Nearest | None
    pressed: str
    force: float
    total_force: float
    follow_the_leader_rms: float
    follow_the_leader_max: float
    outside_model: float
    outside_limits: float
    blocked: float
    exceeded: dict[str, float]
    targets: dict[str, Arrival]
    nearest: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """For JSON: NaN becomes None."""
        return _plain(asdict(self))


@dataclass
class Meter:
    """Measures a session snapshot by snapshot, in bounded memory; `metrics` at any time."""

    _first: Snapshot | None = None
    _last: Snapshot | None = None
    _samples: int = 0
    _path: float = 0.0
    _insertion: float = 0.0
    _clearance: dict[str, Nearest] = field(default_factory=dict)
    _pressure: Nearest | None = None
    _pressed: str = ""
    _force: float = 0.0
    _total: float = 0.0
    _outside: float = 0.0
    _beyond: float = 0.0
    _blocked: float = 0.0
    _exceeded: dict[str, float] = field(default_factory=dict)
    _arrived: dict[str, tuple[float, bool]] = field(default_factory=dict)
    _near: dict[str, float] = field(default_factory=dict)
    _trail: Trail = field(default_factory=Trail)
    _looked: float = -inf
    _squares: tuple[float, int, float] = (0.0, 0, 0.0)

    def add(self, snapshot: Snapshot) -> None:
        """Look at the next snapshot."""
        last = self._last
        dt = snapshot.time - last.time if last is not None else 0.0
        if last is not None:
            self._path += float(np.linalg.norm(snapshot.tip - last.tip)) if last.tube == snapshot.tube else 0.0
        if last is None or last.tube != snapshot.tube:
            self._trail, self._looked = Trail(), -inf
        self._samples += 1
        self._first, self._last = self._first or snapshot, snapshot
        self._shares(snapshot, dt)
        if last is None or snapshot.centerline is not last.centerline:
            self._body(snapshot)
        self._targets(snapshot)

    def metrics(self) -> Metrics:
        """What was measured so far."""
        first, last = self._first, self._last
        duration = last.time - first.time if first is not None and last is not None else 0.0
        squares, count, largest = self._squares
        share = {name: _share(time, duration) for name, time in sorted(self._exceeded.items())}
        return Metrics(
            duration=duration, samples=self._samples, path=self._path, insertion=self._insertion,
            clearance=dict(self._clearance), pressure=self._pressure, pressed=self._pressed,
            force=self._force, total_force=self._total,
            follow_the_leader_rms=float(np.sqrt(squares / count)) if count else nan,
            follow_the_leader_max=largest if count else nan,
            outside_model=_share(self._outside, duration), outside_limits=_share(self._beyond, duration),
            blocked=_share(self._blocked, duration), exceeded=share,
            targets={
                name: Arrival(time=time, nearest=self._near[name], within_limits=good)
                for name, (time, good) in self._arrived.items()
            },
            nearest=dict(self._near),
        )  # fmt: skip

    def _shares(self, snapshot: Snapshot, dt: float) -> None:
        exceeded = [name for name, gauge in snapshot.limits.items() if gauge.is_exceeded]
        for name in exceeded:
            self._exceeded[name] = self._exceeded.get(name, 0.0) + dt
        self._outside += 0.0 if snapshot.in_range else dt
        self._beyond += dt if exceeded else 0.0
        self._blocked += dt if snapshot.blocked else 0.0

    def _body(self, snapshot: Snapshot) -> None:
        self._insertion = max(self._insertion, snapshot.exposed)
        for name, gap in snapshot.clearance.items():
            k = int(gap.argmin())
            if name not in self._clearance or gap[k] < self._clearance[name].value:
                self._clearance[name] = _at(snapshot, float(gap[k]), k)
        k = int(snapshot.pressure.argmax())
        if snapshot.pressure[k] > (self._pressure.value if self._pressure is not None else 0.0):
            self._pressure = _at(snapshot, float(snapshot.pressure[k]), k)
            self._pressed = snapshot.contact_structure[int(snapshot.contact_pressure.argmax())]
        forces = snapshot.contact_force
        self._force = max(self._force, float(np.sqrt((forces**2).sum(axis=1)).max(initial=0.0)))
        self._total = max(self._total, float(np.linalg.norm(forces.sum(axis=0))))
        self._follow(snapshot)

    def _follow(self, snapshot: Snapshot) -> None:
        self._trail.add(snapshot)
        if abs(snapshot.exposed - self._looked) < EVERY:
            return
        self._looked = snapshot.exposed
        off = self._trail.deviation(snapshot)
        if off is not None:
            squares, count, largest = self._squares
            self._squares = squares + float(off @ off), count + off.size, max(largest, float(off.max()))

    def _targets(self, snapshot: Snapshot) -> None:
        for name, far in snapshot.target_distance.items():
            self._near[name] = min(far, self._near.get(name, inf))
        for name in snapshot.reached:
            if name not in self._arrived:
                good = snapshot.in_range and not any(gauge.is_exceeded for gauge in snapshot.limits.values())
                self._arrived[name] = snapshot.time, good


def since_start(snapshots: Iterable[Snapshot]) -> Iterator[Snapshot]:
    """The same, their times (s) counted from the first one's: a record may begin in the middle of a session."""
    start = 0.0
    for k, snapshot in enumerate(snapshots):
        start = snapshot.time if k == 0 else start
        yield replace(snapshot, time=snapshot.time - start) if start else snapshot


def metrics(snapshots: Iterable[Snapshot]) -> Metrics:
    """The metrics of a session, as `replay` or `play` give it; times from its first snapshot on (`since_start`)."""
    meter = Meter()
    for snapshot in since_start(snapshots):
        meter.add(snapshot)
    return meter.metrics()


def _at(snapshot: Snapshot, value: float, k: int) -> Nearest:
    x, y, z = snapshot.tip.tolist()
    return Nearest(value=value, s=float(snapshot.s[k]), time=snapshot.time, tip=(x, y, z))


def _share(time: float, duration: float) -> float:
    return time / duration if duration > 0.0 else 0.0


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and value != value else value
