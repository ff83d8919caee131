"""`Trial`: what a bench measured, sample by sample, with where the trackers sit; nothing of it is ever dropped.

Frames: trackers are measured in the frame of the field (the EM field generator or camera); T_world_field, where it is
known, puts them in the world, in which gravity and the outer tube's exit are known. A section's frame is that of the
model: x points from the neutral axis to the tube's axis. Quaternions are (w, x, y, z), as trackers give them.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from types import MappingProxyType

import numpy as np

from ..errors import InvalidInput, nonnegative, numbers, one_of, vector
from ..robot import Robot

KEPT = "kept"
MISSING_POSE = "missing pose"
POOR_QUALITY = "poor quality"
REPEATED_TIME = "time repeated or out of order"
NO_DRIVE = "neither tension nor displacement"
NO_PLACE = "no insertion or rotation"
RETRACTED = "tracker inside the outer tube"
LEFT_OUT = "left out to thin the trial"  # also the state of such a sample
ROBOT, BASE = "robot", "base"
EXPOSED = 1e-6  # m, of the robot, below which all of it counts as inside
UNIT = 1e-3  # by how much the length of a quaternion may be off


def _nothing() -> np.ndarray:
    return np.empty(0)


@dataclass(frozen=True, kw_only=True)
class Tracker:
    """A tracker and the holder that carries it; SI.

    on: "robot", or "base" for one that is fixed at the outer tube's exit, whose frame then stands for the section's.
    at: material arc length s_m (m) along the neutral axis from the robot's base, None for the tip.
    point: (x, y) of the section that it belongs to, from the tube's axis, m.
    offset: of the sensor from that point, in the section's frame, m.
    turn: rotation vector (rad) of the sensor's frame in the section's, None where it is not known; orientations are
    then not compared, and offsets cannot be taken off measured positions.
    mass: of tracker and holder, kg, at the sensor.
    """

    name: str
    on: str = ROBOT
    at: float | None = None
    point: tuple[float, float] = (0.0, 0.0)
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] | None = None
    mass: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput("name", self.name, "a text that is not empty")
        one_of("on", self.on, (ROBOT, BASE))
        if self.at is not None:
            if self.on == BASE:
                raise InvalidInput("at", self.at, "left out for a tracker on the base")
            object.__setattr__(self, "at", nonnegative("at", self.at))
        for name, size in (("point", 2), ("offset", 3), ("turn", 3)):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, tuple(vector(name, getattr(self, name), size).tolist()))
        object.__setattr__(self, "mass", nonnegative("mass", self.mass))

    @property
    def arm(self) -> tuple[float, float, float]:
        """(3,) from the tube's axis to the sensor, in the section's frame, m."""
        x, y, z = self.offset
        return self.point[0] + x, self.point[1] + y, z


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """n samples of k trackers on a robot with T tendons; SI, arrays read-only, NaN where nothing was measured.

    time (n,) s. tensions, displacements (n, T): N at the exit; m, pulled from slack. insertion (n,) exposed share,
    rotation (n,) rad; one number for all samples where it does not change. position (n, k, 3) m, orientation
    (n, k, 4) unit quaternions of the sensors, both in the frame of the field. quality (n, k): the tracker's own error
    indicator, m, smaller is better. state (n, k): what the tracker said of a frame, "" for nothing amiss.
    gravity: (3,) m/s2, world. T_world_field: (4, 4), None where it is not known. quality_limit: m, above which a
    sample is not used. position_noise (m, of each coordinate), orientation_noise (rad, about each axis), tension_noise
    (N): standard deviations, None where not known. origin: what the data are and how they came, free text by key.

    Raises `InvalidInput` by field. No sample is left out here: `fates` tells which are used, and why others are not.
    """

    name: str
    robot: Robot
    trackers: tuple[Tracker, ...]
    time: np.ndarray
    position: np.ndarray
    orientation: np.ndarray = field(default_factory=_nothing)
    quality: np.ndarray = field(default_factory=_nothing)
    state: np.ndarray = field(default_factory=_nothing)
    tensions: np.ndarray = field(default_factory=_nothing)
    displacements: np.ndarray = field(default_factory=_nothing)
    insertion: np.ndarray = field(default_factory=lambda: np.ones(1))
    rotation: np.ndarray = field(default_factory=lambda: np.zeros(1))
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    T_world_field: np.ndarray | None = None
    quality_limit: float | None = None
    position_noise: float | None = None
    orientation_noise: float | None = None
    tension_noise: float | None = None
    notes: str = ""
    origin: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput("name", self.name, "a text that is not empty")
        if not isinstance(self.robot, Robot):
            raise InvalidInput("robot", self.robot, "a Robot, such as load_robot('exonav-1')")
        self._check_trackers()
        self._take_samples()
        self._set("gravity", tuple(vector("gravity", self.gravity, 3).tolist()))
        if self.T_world_field is not None:
            from ..statics.arguments import rigid_motion

            self._set("T_world_field", _frozen(rigid_motion("T_world_field", self.T_world_field)))
        for name in ("quality_limit", "position_noise", "orientation_noise", "tension_noise"):
            if getattr(self, name) is not None:
                self._set(name, nonnegative(name, getattr(self, name)))
        if not isinstance(self.notes, str):
            raise InvalidInput("notes", self.notes, "a text")
        origin = self.origin
        if not isinstance(origin, Mapping) or not all(isinstance(x, str) for each in origin.items() for x in each):
            raise InvalidInput("origin", origin, "a mapping from texts to texts")
        self._set("origin", MappingProxyType(dict(origin)))

    def __reduce__(self):
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return partial(Trial, **values | {"origin": dict(self.origin)}), ()

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _check_trackers(self) -> None:
        trackers = self.trackers
        if (
            not isinstance(trackers, Sequence)
            or not all(isinstance(each, Tracker) for each in trackers)
            or not trackers
        ):
            raise InvalidInput("trackers", trackers, "a sequence of one or more Tracker")
        self._set("trackers", tuple(trackers))
        length = self.robot.length_na
        for i, each in enumerate(trackers):
            if each.at is not None and each.at > length * (1.0 + 1e-9):
                allowed = f"from 0 to the robot's length L_na = {length:.6g} m"
                raise InvalidInput(f"trackers[{i}].at", each.at, allowed)
            if each.at is not None and each.at > length * (1.0 - 1e-9):
                self._set("trackers", (*self.trackers[:i], replace(each, at=None), *self.trackers[i + 1 :]))  # the tip
        names = [each.name for each in trackers]
        if len(set(names)) < len(names):
            raise InvalidInput("trackers", names, "of different names")

    def _take_samples(self) -> None:
        time = numbers("time", self.time, only_finite=False)
        n, k, T = time.size, len(self.trackers), self.robot.n_tendons
        if n == 0:
            raise InvalidInput("time", [], "one or more samples")
        shapes = {
            "position": (n, k, 3),
            "orientation": (n, k, 4),
            "quality": (n, k),
            "tensions": (n, T),
            "displacements": (n, T),
        }
        self._set("time", _frozen(time))
        for name, shape in shapes.items():
            given = getattr(self, name)
            array = np.full(shape, np.nan) if _is_missing(given) else numbers(name, given, (1, 2, 3), only_finite=False)
            if array.shape == (n,) and shape == (n, 1):
                array = array[:, None]
            if array.shape != shape:
                raise InvalidInput(name, f"an array of shape {array.shape}", f"of shape {shape}")
            if np.isinf(array).any():
                raise InvalidInput(f"{name}[{int(np.argwhere(np.isinf(array))[0][0])}]", np.inf, "finite, or NaN")
            self._set(name, _frozen(array))
        for name in ("insertion", "rotation"):
            given = numbers(name, getattr(self, name), (0, 1), only_finite=False)
            if given.ndim and given.size not in (1, n):
                raise InvalidInput(name, f"{given.size} values", f"one number or {n}, as many as there are samples")
            self._set(name, _frozen(np.broadcast_to(given, n).copy()))
        self._check_samples()
        state = np.full((n, k), "", dtype=object) if _is_missing(self.state) else np.array(self.state, dtype=object)
        if state.shape != (n, k) or not all(isinstance(each, str) for each in state.flat):
            raise InvalidInput("state", self.state, f"texts in an array of shape {(n, k)}")
        self._set("state", _frozen(state))

    def _check_samples(self) -> None:
        length = np.linalg.norm(self.orientation, axis=-1)
        known = ~np.isnan(self.orientation).any(axis=-1)
        _check_each("insertion", self.insertion, (self.insertion < 0.0) | (self.insertion > 1.0), "from 0 to 1, or NaN")
        _check_each(
            "orientation", length, known & (np.abs(length - 1.0) > UNIT), "a quaternion (w, x, y, z) of length 1"
        )
        _check_each("quality", self.quality, self.quality < 0.0, ">= 0, or NaN")

    def __repr__(self) -> str:
        used = int(self.kept.any(axis=1).sum())
        return f"Trial({self.name}: {self.robot.name}, {self.time.size} samples of {len(self.trackers)}, {used} used)"

    @cached_property
    def places(self) -> np.ndarray:
        """(k,) s_m of the trackers, m; NaN for those on the base."""
        length = self.robot.length_na
        found = [np.nan if each.on == BASE else length if each.at is None else each.at for each in self.trackers]
        return _frozen(np.array(found))

    @cached_property
    def on_robot(self) -> np.ndarray:
        """(k,) whether a tracker rides on the robot."""
        return _frozen(np.array([each.on == ROBOT for each in self.trackers]))

    @cached_property
    def fates(self) -> np.ndarray:
        """(n, k) texts: "kept", or the first reason why a sample of a tracker is not used."""
        n, k = self.position.shape[:2]
        found = np.full((n, k), KEPT, dtype=object)
        driven = np.isfinite(self.tensions) | np.isfinite(self.displacements)
        length = self.robot.length_na
        with np.errstate(invalid="ignore"):
            hidden = self.places < (1.0 - self.insertion[:, None]) * length * (1.0 - 1e-9)
            hidden |= self.insertion[:, None] * length < EXPOSED
            poor = self.quality > (np.inf if self.quality_limit is None else self.quality_limit)
        reasons = (  # the last stands in the end
            (LEFT_OUT, self.state == LEFT_OUT),
            (RETRACTED, np.logical_and(self.on_robot, hidden)),
            (NO_PLACE, self.on_robot & np.isnan(self.insertion + self.rotation)[:, None]),
            (NO_DRIVE, self.on_robot & (~driven).any(axis=1, keepdims=True)),
            (POOR_QUALITY, poor),
            (REPEATED_TIME, ~_later(self.time)[:, None]),
            (MISSING_POSE, np.isnan(self.position).any(axis=-1)),
        )
        for reason, where in reasons:
            found[np.broadcast_to(where, (n, k))] = reason
        return _frozen(found)

    @cached_property
    def kept(self) -> np.ndarray:
        """(n, k) whether a sample of a tracker is used."""
        return _frozen(self.fates == KEPT)

    def counts(self) -> dict[str, Counter[str]]:
        """Tracker -> how many samples had which fate; missing poses with what the tracker said of them."""
        told = self.fates.copy()
        said = (told == MISSING_POSE) & (self.state != "")
        told[said] = [f"{MISSING_POSE} ({each})" for each in self.state[said]]
        return {each.name: Counter(told[:, j].tolist()) for j, each in enumerate(self.trackers)}

    @cached_property
    def turned(self) -> np.ndarray:
        """(n, k, 3, 3) orientations of the sensors in the frame of the field, NaN where none was measured."""
        from scipy.spatial.transform import Rotation

        given = self.orientation.reshape(-1, 4)
        known, found = ~np.isnan(given).any(axis=1), np.full((len(given), 3, 3), np.nan)
        if known.any():
            found[known] = Rotation.from_quat(given[known], scalar_first=True).as_matrix()
        return _frozen(found.reshape(*self.position.shape[:2], 3, 3))

    def rows(self, which: np.ndarray | Sequence[int] | slice) -> Trial:
        """The same trial with some of its samples."""
        n, each = self.time.size, {name: getattr(self, name) for name in SAMPLED}
        chosen = np.arange(n)[which]
        if chosen.size == 0:
            raise InvalidInput("which", which, f"one or more of the {n} samples")
        return replace(self, **{name: array[chosen] for name, array in each.items()})


SAMPLED = (
    "time", "position", "orientation", "quality", "state", "tensions", "displacements", "insertion", "rotation",
)  # fmt: skip


def _is_missing(given: object) -> bool:
    return given is None or (isinstance(given, np.ndarray) and given.size == 0)


def _later(time: np.ndarray) -> np.ndarray:
    """(n,) the longest run of samples whose times increase, the first of equal ones: a wild stamp costs itself only."""
    ends: list[float] = []  # least last time of a run of each length, and which sample that is
    last: list[int] = []
    before = np.full(time.size, -1)
    for i, at in enumerate(time.tolist()):
        k = bisect_left(ends, at) if at == at else -1
        if k < 0 or (k < len(ends) and ends[k] == at):
            continue
        before[i] = last[k - 1] if k else -1
        ends[k : k + 1], last[k : k + 1] = [at], [i]
    found, i = np.zeros(time.size, dtype=bool), last[-1] if last else -1
    while i >= 0:
        found[i], i = True, int(before[i])
    return found


def _check_each(name: str, values: np.ndarray, wrong: np.ndarray, allowed: str) -> None:
    if wrong.any():
        at = tuple(int(i) for i in np.argwhere(wrong)[0])
        raise InvalidInput(name + "".join(f"[{i}]" for i in at), float(values[at]), allowed)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array
