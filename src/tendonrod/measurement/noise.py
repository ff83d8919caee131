"""`Noise`: what a tracker and a load cell make of the truth. Each kind draws from a stream of its own.

A stream is known by seed, kind, trial and tracker: turning one kind on, or taking more samples, leaves the other draws
as they were. Bit for bit the same wherever NumPy's generators are.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from math import radians

import numpy as np

from ..errors import InvalidInput, finite, nonnegative, positive, within
from ..rotation import exp_so3


class Kind(IntEnum):
    """What a stream is drawn for; the numbers are part of what a seed means."""

    FIELD = 0
    POSITION = 1
    ORIENTATION = 2
    QUALITY = 3
    TENSION = 4
    DROPOUT = 5
    OUTLIER = 6
    OUTLIER_DIRECTION = 7
    REPEAT = 8


def stream(seed: int, kind: Kind, trial: int = 0, channel: int = 0) -> np.random.Generator:
    """Random numbers for one kind of error in one tracker or tendon (``channel``) of one trial."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(kind, trial, channel))))


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Errors of the instruments; SI. `NONE` has none of them.

    position: standard deviation of each coordinate, m. orientation: about each axis, rad. tension: of each reading, N.
    tension_scale, tension_zero (N): true tension = scale * (reading - zero), as in `Setup`.
    quality_correlation: 0 to 1, between a frame's error and the indicator that the tracker gives for it: 1 tells the
    root mean square of the three coordinates' errors, 0 that of three others.
    dropouts: share of frames without a pose, in bursts of ``burst`` frames on average (a chain of two states).
    outliers: share of frames that lie ``outlier_size`` (m) off in a random direction. repeats: share of frames that
    the logger wrote a second time in place of the next, with their time.
    position_step (m), tension_step (N): to which readings are rounded, 0 not at all.

    Raises `InvalidInput` by field.
    """

    position: float = 0.5e-3
    orientation: float = radians(0.3)
    tension: float = 5e-3
    tension_scale: float = 1.0
    tension_zero: float = 0.0
    quality_correlation: float = 0.7
    dropouts: float = 0.0
    burst: float = 4.0
    outliers: float = 0.0
    outlier_size: float = 10e-3
    repeats: float = 0.0
    position_step: float = 0.0
    tension_step: float = 0.0

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _checked(each.name, getattr(self, each.name)))
        longest = 1.0 if self.dropouts == 0.0 else self.dropouts / (1.0 - self.dropouts)
        if self.burst < max(1.0, longest):
            allowed = f"at least {max(1.0, longest):.4g} frames where a share of {self.dropouts:.4g} is missing"
            raise InvalidInput("burst", self.burst, allowed)


_SHARES = {"quality_correlation": 1.0, "dropouts": 0.95, "outliers": 1.0, "repeats": 0.95}


def _checked(name: str, value: object) -> float:
    if name in _SHARES:
        return within(name, value, 0.0, _SHARES[name])
    check = finite if name == "tension_zero" else positive if name in ("tension_scale", "burst") else nonnegative
    return check(name, value)


NONE = Noise(position=0.0, orientation=0.0, tension=0.0)


def read_tensions(noise: Noise, true: np.ndarray, seed: int, trial: int) -> np.ndarray:
    """(n, T) what the load cells say of tensions ``true`` (n, T), N; may be below zero."""
    draws = [stream(seed, Kind.TENSION, trial, i).standard_normal(len(true)) for i in range(true.shape[1])]
    error = noise.tension * np.array(draws).reshape(true.shape[::-1]).T
    return rounded(true / noise.tension_scale + noise.tension_zero + error, noise.tension_step)


@dataclass(frozen=True, kw_only=True, eq=False)
class Frames:
    """n frames of one tracker: position (n, 3) m, turned (n, 3, 3), quality (n,) m, missing (n,) bool."""

    position: np.ndarray
    turned: np.ndarray
    quality: np.ndarray
    missing: np.ndarray


def track(noise: Noise, position: np.ndarray, turned: np.ndarray, seed: int, trial: int, channel: int) -> Frames:
    """What a tracker says of a sensor at ``position`` (n, 3) m, ``turned`` (n, 3, 3), in the frame of the field."""

    def drawn(kind: Kind) -> np.ndarray:
        return stream(seed, kind, trial, channel).standard_normal((len(position), 3))

    error = noise.position * drawn(Kind.POSITION)
    if noise.outliers > 0.0:
        away = drawn(Kind.OUTLIER_DIRECTION)
        out = stream(seed, Kind.OUTLIER, trial, channel).random(len(position)) < noise.outliers
        error += noise.outlier_size * out[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)
    c = noise.quality_correlation
    told = c * error + np.sqrt(1.0 - c * c) * noise.position * drawn(Kind.QUALITY)
    return Frames(
        position=rounded(position + error, noise.position_step),
        turned=turned @ exp_so3(noise.orientation * drawn(Kind.ORIENTATION)),
        quality=np.sqrt(np.mean(told * told, axis=1)),
        missing=dropped(noise, len(position), stream(seed, Kind.DROPOUT, trial, channel)),
    )


def dropped(noise: Noise, n: int, draws: np.random.Generator) -> np.ndarray:
    """(n,) whether a frame is missing: a chain of two states, begun where it is on average."""
    if noise.dropouts == 0.0:
        return np.zeros(n, dtype=bool)
    stays = 1.0 - 1.0 / noise.burst
    begins = noise.dropouts / (1.0 - noise.dropouts) / noise.burst
    found, chance = np.empty(n, dtype=bool), noise.dropouts
    for i, draw in enumerate(draws.random(n).tolist()):
        found[i] = draw < chance
        chance = stays if found[i] else begins
    return found


def written_frames(noise: Noise, n: int, seed: int, trial: int) -> np.ndarray:
    """(n,) number of the frame that the logger wrote at each sample: its own, or that of the sample before again."""
    own = np.arange(n)
    if noise.repeats == 0.0:
        return own
    again = stream(seed, Kind.REPEAT, trial).random(n) < noise.repeats
    again[0] = False
    return np.maximum.accumulate(np.where(again, 0, own))


def random_rotation(draws: np.random.Generator) -> np.ndarray:
    """(3, 3) rotation, uniform over all of them (Shoemake 1992)."""
    q = draws.standard_normal(4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ])  # fmt: skip


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """``values`` to the nearest multiple of ``step``, as they are for a step of 0."""
    return values if step == 0.0 else step * np.round(values / step)
