"""`Experiment`: a bench as it stands in truth, what the lab believes of it, and what is done on it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from ..errors import InvalidInput, finite, nonnegative, numbers, one_of, positive, vector, whole, within
from ..robot import Robot, as_robot
from ..rotation import exp_so3
from .noise import Noise
from .trial import BASE, Tracker

MOVABLE, FIXED = "movable", "fixed"
PROTOCOLS = {
    MOVABLE: "one tracker, first on the base, then at each place in turn, a trial each",
    FIXED: "trackers on the base and at all places at once, in one trial",
}
FIELD_LEVEL, BASE_LEVEL, ORIGIN_LEVEL = "field", "base", "origin"
LEVELS = {
    FIELD_LEVEL: "the pose of the field in the world is known, as of a levelled generator that was surveyed",
    BASE_LEVEL: "nothing is known of the field: the tracker on the base sets origin and axes of the world",
    ORIGIN_LEVEL: "the field's axes are the world's, the position of the tracker on the base sets its origin",
}
BASE_NAME = "base"
Numbers = float | tuple[float, ...] | tuple[tuple[float, ...], ...] | np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiment:
    """A virtual experiment; SI, world frame: gravity is known there, and the exit is believed to be the identity.

    Truth: robot, with the friction of its tendons. base_tilt: rotation vector of the
    exit in the world, two angles about its x and y or all three, rad. base_offset: (3,) place of the exit, m.
    tip_mass: kg at the tip, on the tube's axis. tracker_mass: kg of each tracker on the robot with its holder.
    holder_error: (3,) by which sensors sit beside the holder's offset, m, section frame. turn_error: rotation vector of
    the sensor's true frame in the one believed, rad. The holder is the same on the base.

    Belief: claimed: Robot that the trials name, None for the true one. claimed_tracker_mass: kg, None for the true
    one. holder_offset (3,) m, from the tube's axis, and holder_turn, rotation vector (rad), section frame.

    Programme: tensions rise from least_tension to largest_tension (N; one number, or one per tendon) in ``samples``
    samples and fall again as many times as ``cycles`` says, 0 for rising only; or ``tensions`` (n,) or (n, T) gives
    them one by one. insertion, rotation (rad): one number, or one per sample. One sample each 1 / rate s; poses are
    those ``delay`` (s) before their time.

    protocol, level: names in `PROTOCOLS` and `LEVELS`. places: shares of the robot's length from its base, to 1.
    base_frames: on the base, before the tracker moves on. noise: `Noise` of the instruments.

    Raises `InvalidInput` by field.
    """

    robot: Robot
    claimed: Robot | None = None
    largest_tension: float | tuple[float, ...] = 0.7
    least_tension: float | tuple[float, ...] = 0.05
    samples: int = 30
    cycles: int = 1
    tensions: Numbers | None = None
    insertion: Numbers = 1.0
    rotation: Numbers = 0.0
    gravity: tuple[float, float, float] = (-9.81, 0.0, 0.0)
    protocol: str = MOVABLE
    level: str = FIELD_LEVEL
    places: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0)
    base_frames: int = 40
    rate: float = 40.0
    delay: float = 0.0
    base_tilt: tuple[float, ...] = (0.0, 0.0, 0.0)
    base_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_mass: float = 0.0
    tracker_mass: float = 0.0
    claimed_tracker_mass: float | None = None
    holder_offset: tuple[float, float, float] = (2e-3, 0.0, 0.0)
    holder_turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    holder_error: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_error: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: Noise = field(default_factory=Noise)

    def __post_init__(self) -> None:
        self._check_robots()
        one_of("protocol", self.protocol, PROTOCOLS)
        one_of("level", self.level, LEVELS)
        for name in ("gravity", "base_offset", "holder_offset", "holder_turn", "holder_error", "turn_error"):
            self._set(name, tuple(vector(name, getattr(self, name), 3).tolist()))
        tilt = (*self.base_tilt, 0.0) if np.shape(self.base_tilt) == (2,) else self.base_tilt
        self._set("base_tilt", tuple(vector("base_tilt", tilt, 3).tolist()))
        self._set("rate", positive("rate", self.rate))
        for name in ("tip_mass", "tracker_mass", "delay"):
            self._set(name, nonnegative(name, getattr(self, name)))
        if self.claimed_tracker_mass is not None:
            self._set("claimed_tracker_mass", nonnegative("claimed_tracker_mass", self.claimed_tracker_mass))
        for name, least in (("samples", 2), ("cycles", 0), ("base_frames", 1)):
            self._set(name, whole(name, getattr(self, name), least))
        places = numbers("places", self.places)
        for i, share in enumerate(places.tolist()):
            within(f"places[{i}]", share, 0.0, 1.0)
        if not places.size or len(np.unique(places)) < places.size:
            raise InvalidInput("places", self.places, "one or more shares of the length, all different")
        self._set("places", tuple(places.tolist()))
        if not isinstance(self.noise, Noise):
            raise InvalidInput("noise", self.noise, "a Noise")
        _ = self.program

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _check_robots(self) -> None:
        as_robot(self.robot)
        if not isinstance(self.believed, Robot) or self.believed.n_tendons != self.robot.n_tendons:
            raise InvalidInput("claimed", self.claimed, f"a Robot with {self.robot.n_tendons} tendons, as the true one")

    @property
    def believed(self) -> Robot:
        """The robot that the trials name."""
        return self.robot if self.claimed is None else self.claimed

    @cached_property
    def program(self) -> np.ndarray:
        """(n, T + 2) tensions (N), insertion and rotation (rad) of each sample, read-only."""
        tensions = self._tensions()
        n = len(tensions)
        columns = [_per_sample("insertion", self.insertion, n), _per_sample("rotation", self.rotation, n)]
        for i, eta in enumerate(columns[0].tolist()):
            within(f"insertion[{i}]" if np.ndim(self.insertion) else "insertion", eta, 0.0, 1.0)
        found = np.column_stack([tensions, *columns])
        found.setflags(write=False)
        return found

    def _tensions(self) -> np.ndarray:
        T = self.robot.n_tendons
        if self.tensions is None:
            low, high = (_per_tendon(name, getattr(self, name), T) for name in ("least_tension", "largest_tension"))
            if (low > high).any():
                raise InvalidInput(
                    "least_tension", self.least_tension, f"at most largest_tension = {self.largest_tension}"
                )
            return low + sweeps(self.samples, self.cycles)[:, None] * (high - low)
        given = numbers("tensions", self.tensions, (1, 2))
        given = given[:, None] if given.ndim == 1 and T == 1 else given
        if given.ndim != 2 or given.shape[1] != T or not len(given):
            raise InvalidInput(
                "tensions", f"an array of shape {given.shape}", f"of shape (n, {T}), of one sample or more"
            )
        if (given < 0.0).any():
            i, j = np.argwhere(given < 0.0)[0]
            raise InvalidInput(f"tensions[{i}][{j}]", float(given[i, j]), ">= 0")
        return given

    @property
    def plans(self) -> tuple[tuple[str, tuple[float | None, ...]], ...]:
        """Of each trial its name and where its trackers are: a share of the length, None for the base."""
        name = self.believed.name
        if self.protocol == FIXED:
            return ((f"{name}-all", (None, *self.places)),)
        return tuple((f"{name}-{place_name(share)}", (share,)) for share in (None, *self.places))

    def tracker(self, share: float | None) -> Tracker:
        """The tracker as the trials claim it, at a share of the length, None for the base."""
        name, offset, turn = place_name(share), self.holder_offset, self.holder_turn
        if share is None:
            return Tracker(name=name, on=BASE, offset=offset, turn=None if self.level == ORIGIN_LEVEL else turn)
        at = None if share == 1.0 else share * self.believed.length_na
        mass = self.tracker_mass if self.claimed_tracker_mass is None else self.claimed_tracker_mass
        return Tracker(name=name, at=at, offset=offset, turn=turn, mass=mass)

    @property
    def sensor(self) -> tuple[np.ndarray, np.ndarray]:
        """((3,) m from the tube's axis, (3, 3)) place and frame of a sensor in the section, in truth."""
        arm = np.array(self.holder_offset) + np.array(self.holder_error)
        return arm, exp_so3(np.array(self.holder_turn)) @ exp_so3(np.array(self.turn_error))

    @property
    def exit_pose(self) -> np.ndarray:
        """(4, 4) T_world_exit in truth."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = exp_so3(np.array(self.base_tilt)), self.base_offset
        return pose

    def truth(self) -> dict[str, object]:
        """What the trials do not tell, SI, in plain numbers and texts."""
        bench = ("base_tilt", "base_offset", "tip_mass", "tracker_mass", "holder_error", "turn_error")
        names = (*bench, "delay", "gravity", "protocol", "level")
        robot: dict[str, object] = {"name": self.robot.name, "torsion": self.robot.torsion, **self.robot.parameters()}
        found: dict[str, object] = {name: getattr(self, name) for name in names}
        return found | {"robot": robot, "noise": {each.name: getattr(self.noise, each.name) for each in fields(Noise)}}


def sweeps(samples: int, cycles: int) -> np.ndarray:
    """(n,) 0 to 1 in ``samples`` samples, and down and up again: ``cycles`` rises and falls, one rise for 0 cycles."""
    up = np.arange(samples) / (samples - 1)
    whole_cycle = np.concatenate([up[1:], up[-2::-1]])
    return np.concatenate([up[:1], *(cycles * [whole_cycle] or [up[1:]])])


def place_name(share: float | None) -> str:
    """What a trial or tracker at a share of the length is called: s25; base for None."""
    return BASE_NAME if share is None else f"s{100.0 * share:g}"


def _per_tendon(name: str, given, T: int) -> np.ndarray:
    if np.ndim(given) == 0:
        return np.full(T, nonnegative(name, given))
    return np.array([nonnegative(f"{name}[{i}]", each) for i, each in enumerate(vector(name, given, T).tolist())])


def _per_sample(name: str, given, n: int) -> np.ndarray:
    if np.ndim(given) == 0:
        return np.full(n, finite(name, given))
    found = numbers(name, given)
    if found.size != n:
        raise InvalidInput(name, f"{found.size} values", f"one number or {n}, as many as there are samples")
    return found
