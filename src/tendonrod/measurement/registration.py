"""Registration: from the frame in which trackers are measured to the world; and measured poses in that world.

The world of the paper's bench: its origin is the centre of the outer tube's exit, on the tube's axis, z points out of
the tube, x as the section's at the exit. A tracker on the base (`Tracker.on`) shows where that is: the paper measures
the base once, in a trial of its own, and then moves its one tracker along the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InvalidInput, numbers
from ..rotation import exp_so3
from .robust_mean import mean_rotation, robust_mean
from .trial import BASE, Tracker, Trial

COLLINEAR = 1e-9  # of the longest extent
AXES_OF_FIELD = "the orientation of the base is not known: the field's axes are taken for the world's"
UNKNOWN = "no base tracker in any trial: the field's frame is taken for the world's"
GIVEN = "T_world_field as the trial gives it"


@dataclass(frozen=True, kw_only=True, eq=False)
class Registration:
    """A rigid motion T (4, 4) that maps measured points to true ones, and how well; SI.

    residuals: (n, 3) m, mapped minus true, of every sample. turns: (n, 3) rad, the same of orientations, as rotation
    vectors; NaN where there is none. used: (n,) whether a sample took part. weights: (n,), of those that did. source:
    where it comes from. note: what had to be assumed, "" for nothing.
    """

    T: np.ndarray
    residuals: np.ndarray
    turns: np.ndarray
    used: np.ndarray
    weights: np.ndarray
    source: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        for name in ("T", "residuals", "turns", "used", "weights"):
            getattr(self, name).setflags(write=False)

    @property
    def count(self) -> int:
        """Samples that took part."""
        return int(self.used.sum())

    @property
    def rms(self) -> float:
        """Root mean square of the residuals' lengths, m; NaN without samples."""
        return _rms(self.residuals[self.used], self.weights[self.used])

    @property
    def angle_rms(self) -> float:
        """Root mean square of the turns' angles, rad; NaN where no orientation was measured."""
        turned = self.used & np.isfinite(self.turns).all(axis=1)
        return _rms(self.turns[turned], self.weights[turned])

    @property
    def standard_error(self) -> tuple[float, float]:
        """Of the mean base: of each coordinate (m) and about each axis (rad), if samples scatter independently."""
        turned = self.used & np.isfinite(self.turns).all(axis=1)
        return _standard_error(self.residuals[self.used]), _standard_error(self.turns[turned])

    def __str__(self) -> str:
        if not self.used.size:
            return self.note or self.source
        angle = "" if np.isnan(self.angle_rms) else f" and {np.degrees(self.angle_rms):.2g} deg"
        left_out = self.used.size - self.count
        of = f"{self.count} samples" + (f" ({left_out} outliers left out)" if left_out else "")
        text = f"{self.source}: {of}, scatter {1e3 * self.rms:.2g} mm{angle} rms"
        return f"{text}; {self.note}" if self.note else text


def rigid_registration(measured, true, weights=None) -> Registration:
    """The rigid motion that maps ``measured`` (n, 3) to ``true`` (n, 3), m, with the least weighted squares.

    weights: (n,) >= 0, None for equal ones. Raises `InvalidInput` for fewer than 3 points that count, for points on one
    line, about which any turn would do, and for arrays that do not match. Source: Arun, Huang, Blostein 1987, with
    Umeyama's sign (1991), so that a mirror image is never taken.
    """
    given, wanted = _points("measured", measured), _points("true", true)
    if given.shape != wanted.shape:
        raise InvalidInput("true", f"an array of shape {wanted.shape}", f"of shape {given.shape}, as measured has")
    share = _weights(weights, len(given))
    centre, aim = share @ given, share @ wanted
    a, b = (np.sqrt(share)[:, None] * each for each in (given - centre, wanted - aim))
    for name, spread in (("measured", a), ("true", b)):
        _check_spread(name, spread)
    U, _, Vt = np.linalg.svd(b.T @ a)
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    T = _motion(R, aim - R @ centre)
    return Registration(
        T=T,
        residuals=given @ R.T + T[:3, 3] - wanted,
        turns=np.full((len(given), 3), np.nan),
        used=share > 0.0,
        weights=share,
        source=f"{int((share > 0.0).sum())} points",
    )


def base_registration(trials: Sequence[Trial]) -> Registration:
    """T_world_field by the used samples of all trackers on the base: T_world_exit T_exit_sensor T_field_sensor^-1.

    T_world_exit is the identity. The trials must share one frame of the field. Orientations are averaged in the chordal
    sense, positions arithmetically, both without outliers; where no orientation or `Tracker.turn` is known, the field's
    axes are taken for the world's and `Registration.note` says so. Raises `InvalidInput` where nothing was measured on
    the base.
    """
    found = [(trial, j) for trial in trials for j in range(len(trial.trackers)) if _shows_base(trial, j)]
    if not found:
        allowed = "one or more with a tracker on the base and a used sample of it"
        raise InvalidInput("trials", [each.name for each in trials], allowed)
    position = np.concatenate([trial.position[trial.kept[:, j], j] for trial, j in found])
    arm = np.concatenate([np.tile(trial.trackers[j].arm, (trial.kept[:, j].sum(), 1)) for trial, j in found])
    turned = np.concatenate([_base_turns(trial, j) for trial, j in found])
    R, sound, turns = mean_rotation(turned)
    start = arm - position @ R.T
    origin, near = robust_mean(start)
    names = ", ".join(dict.fromkeys(trial.trackers[j].name for trial, j in found))
    used = near & sound
    origin = start[used].mean(axis=0) if used.any() else origin
    return Registration(
        T=_motion(R, origin),
        residuals=origin - start,
        turns=turns,
        used=used if used.any() else near,
        weights=np.ones(len(start)),
        source=f"tracker {names} on the base",
        note=AXES_OF_FIELD if np.isnan(turned).all() else "",
    )


def registrations(trials: Sequence[Trial], base: Registration | None = None) -> tuple[Registration, ...]:
    """T_world_field of each trial: the one that it gives, else by its own base tracker, else ``base``.

    base: None for the one that the base trackers of all trials show; where there are none, the identity, with a note.
    """
    if base is None and any(_shows_any(trial) for trial in trials):
        base = base_registration([trial for trial in trials if _shows_any(trial)])
    found = []
    for trial in trials:
        if trial.T_world_field is not None:
            found.append(_without_samples(np.array(trial.T_world_field), trial.origin.get("registration", GIVEN), ""))
        elif _shows_any(trial):
            found.append(base_registration([trial]))
        else:
            found.append(base or _without_samples(np.eye(4), "", UNKNOWN))
    return tuple(found)


def registered(trials: Sequence[Trial], base: Registration | None = None) -> tuple[Trial, ...]:
    """The trials with T_world_field set, by `registrations`; ``origin["registration"]`` says where it comes from."""
    return tuple(
        replace(trial, T_world_field=each.T, origin={"registration": str(each)} | dict(trial.origin))
        for trial, each in zip(trials, registrations(trials, base), strict=True)
    )


def seen_exit(trial: Trial) -> np.ndarray | None:
    """(4, 4) T_world_exit as the trial's base tracker has it, in the world of its T_world_field.

    The identity but for noise where the base stands as it should; None without T_world_field or base tracker, or where
    its orientation is not known.
    """
    if trial.T_world_field is None or not _shows_any(trial):
        return None
    shown = base_registration([trial])
    return None if shown.note else trial.T_world_field @ np.linalg.inv(shown.T)


def world_poses(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Measured position (n, k, 3), m, and rotation (n, k, 3, 3) of the sensors in the world; NaN where missing.

    Raises `InvalidInput` for a trial that is not registered.
    """
    if trial.T_world_field is None:
        raise InvalidInput("T_world_field", None, f"known: {trial.name} must be registered, see registered")
    R, p = trial.T_world_field[:3, :3], trial.T_world_field[:3, 3]
    return trial.position @ R.T + p, R @ trial.turned


def body_positions(trial: Trial) -> np.ndarray:
    """(n, k, 3) measured points on the tube's axis, moved by `Tracker.point`, world frame, m.

    The sensor's position less its offset, which needs the measured orientation and `Tracker.turn`; NaN where these are
    not known and the offset is not zero. Raises `InvalidInput` for a trial that is not registered.
    """
    position, rotation = world_poses(trial)
    return np.stack(
        [without_offset(position[:, j], rotation[:, j], each) for j, each in enumerate(trial.trackers)], axis=1
    )


def without_offset(position: np.ndarray, rotation: np.ndarray, tracker: Tracker, more=(0.0, 0.0, 0.0)) -> np.ndarray:
    """(n, 3) positions (n, 3) of a sensor less its offset and ``more`` (3,) m, by its rotations (n, 3, 3).

    From p_sensor = c + R (point + offset), R_sensor = R exp(turn).
    """
    offset = np.array(tracker.offset) + np.array(more)
    if not offset.any():
        return position
    if tracker.turn is None:
        return np.full_like(position, np.nan)
    return position - rotation @ exp_so3(np.array(tracker.turn)).T @ offset


def _points(field: str, given) -> np.ndarray:
    array = numbers(field, given, 2)
    if array.shape[1] != 3:
        raise InvalidInput(field, f"an array of shape {array.shape}", "of shape (n, 3)")
    return array


def _weights(given, n: int) -> np.ndarray:
    """(n,) shares that sum to 1, three or more of them above zero."""
    weights = np.ones(n) if given is None else numbers("weights", given)
    if weights.shape != (n,):
        raise InvalidInput("weights", f"{weights.size} values", f"{n}, as many as there are points")
    if (weights < 0.0).any():
        at = int(np.argmax(weights < 0.0))
        raise InvalidInput(f"weights[{at}]", float(weights[at]), ">= 0")
    if (weights > 0.0).sum() < 3:
        name, count = ("measured", n) if given is None else ("weights", int((weights > 0.0).sum()))
        raise InvalidInput(
            name, f"{count} points", "3 points or more" + (" of weight > 0" if given is not None else "")
        )
    return weights / weights.sum()


def _check_spread(field: str, points: np.ndarray) -> None:
    extent = np.linalg.svd(points, compute_uv=False)
    if extent[1] <= COLLINEAR * extent[0]:
        raise InvalidInput(field, "points on one line", "points that span a plane or space")


def _without_samples(T: np.ndarray, source: str, note: str) -> Registration:
    none = np.empty((0, 3))
    return Registration(
        T=T, residuals=none, turns=none.copy(), used=np.empty(0, bool), weights=np.empty(0), source=source, note=note
    )


def _shows_base(trial: Trial, j: int) -> bool:
    return trial.trackers[j].on == BASE and bool(trial.kept[:, j].any())


def _shows_any(trial: Trial) -> bool:
    return any(_shows_base(trial, j) for j in range(len(trial.trackers)))


def _base_turns(trial: Trial, j: int) -> np.ndarray:
    """(m, 3, 3) R_world_field by each used sample of tracker j, NaN where its orientation is not known."""
    turn, sensor = trial.trackers[j].turn, trial.turned[trial.kept[:, j], j]
    if turn is None:
        return np.full_like(sensor, np.nan)
    return exp_so3(np.array(turn)) @ np.swapaxes(sensor, -1, -2)


def _motion(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def _rms(vectors: np.ndarray, weights: np.ndarray) -> float:
    if not len(vectors):
        return float("nan")
    return float(np.sqrt(weights @ (vectors**2).sum(axis=1) / weights.sum()))


def _standard_error(vectors: np.ndarray) -> float:
    n = len(vectors)
    return float(np.sqrt((vectors**2).sum() / (3.0 * (n - 1) * n))) if n > 1 else float("nan")
