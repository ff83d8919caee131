"""`Family`: equilibria of a robot that differ in their commands, and the sensors that ride on it.

A command is insertion, rotation, and what the tendons are driven with. Seen from the section at the exit, which the
rotation turns, a rod hardly depends on it: `Family.unturned` takes off all that only turns or shifts the whole.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from ..errors import NotConverged
from ..robot import Robot
from ..rotation import exp_so3, left_jacobian_so3
from ..statics.equilibrium import solve
from ..statics.inputs import MATERIAL
from ..statics.shape import Shape
from .setup import BENCH, Setup, places
from .trial import ROBOT, Trial

_AXES = {"x": 0, "y": 1, "z": 2}
_TURNS = {"base_tilt_x": 0, "base_tilt_y": 1, "base_roll": 2}
_READINGS = ("tension_scale", "tension_zero", "displacement_zero")


def family_key(trial: Trial, setup: Setup, names: Sequence[str]) -> Hashable:
    """What trials must have in common to be one family."""
    heavy = setup.tracker_mass > 0.0 or "tracker_mass" in names
    laden = [each for each in trial.trackers if each.on == ROBOT and (heavy or each.mass > 0.0)]
    return trial.robot, trial.gravity, tuple((each.mass, each.at, each.arm) for each in laden)


class Family:
    """Samples ``members`` (trial, rows) of ``trials`` with one gravity, one set of masses and the same places out.

    commands (q, 2 + T): insertion, rotation, and true tensions, N, or displacements, m, of all samples, member after
    member; readings (q, T) likewise.
    """

    def __init__(
        self, trials: Sequence[Trial], setup: Setup, names: Sequence[str], members: list[tuple[int, np.ndarray]]
    ) -> None:
        first, row = trials[members[0][0]], members[0][1][0]
        self.trials, self.setup, self.names, self.members = trials, setup, names, members
        self.robot, self.loads = setup.robot_of(first), setup.loads(first, names)
        self.gravity, self.pose = setup.gravity_of(first), setup.exit_pose
        self.pulled = ~np.isfinite(first.tensions[row])  # driven by displacement
        readings = [
            np.where(self.pulled, trials[i].displacements[rows], trials[i].tensions[rows]) for i, rows in members
        ]
        self.readings = np.concatenate(readings)
        tensions = np.maximum(0.0, setup.tension_scale * (self.readings - setup.tension_zero))
        drive = np.where(self.pulled, self.readings - setup.displacement_zero, tensions)
        held = [np.column_stack([trials[i].insertion, trials[i].rotation])[rows] for i, rows in members]
        self.commands = np.column_stack([np.concatenate(held), drive])
        found = np.concatenate([places(trials[i], self.robot) for i, _ in members])
        inside = (1.0 - float(self.commands[:, 0].min())) * self.robot.length_na
        self.places = np.unique(found[found >= inside * (1.0 - 1e-9)])
        self.made = {name: self._engine(name) for name in names}
        self.solves = 0

    def solve(self, command: np.ndarray, start: Shape | None, **more) -> Shape:
        """The equilibrium at a (2 + T,) command. Raises `NotConverged` that names the sample nearest to it."""
        self.solves += 1
        insertion, rotation, inputs = float(command[0]), float(command[1]), command[2:]
        pulled = [float(x) if is_pulled else None for x, is_pulled in zip(inputs, self.pulled, strict=True)]
        drive = {"displacements": pulled} if self.pulled.any() else {}
        length = self.robot.length_na
        s = np.clip(self.places - (1.0 - insertion) * length, 0.0, insertion * length)
        try:
            return solve(
                self.robot, np.where(self.pulled, 0.0, inputs), self.gravity, insertion=insertion,
                rotation=rotation, s=s, start=start, loads=self.loads, exit_pose=self.pose, **drive, **more,
            )  # fmt: skip
        except NotConverged as error:
            status = f"{self._nearest(command)}: {str(error).partition('; reached')[0]}"
            facts = {"load_factor": error.load_factor, "residual": error.residual, "advice": error.advice}
            raise NotConverged(status=status, **facts) from None

    def _nearest(self, command: np.ndarray) -> str:
        """The sample whose command is nearest to what was solved with, in words."""
        k = int(np.argmin(np.abs(self.commands - command).sum(axis=1)))
        i, row = [(i, row) for i, rows in self.members for row in rows.tolist()][k]
        told = ", ".join(f"{x:.4g}" for x in self.trials[i].tensions[row])
        return f"{self.trials[i].name}, sample {row + 1} ({told} N)"

    def values(self, shape: Shape) -> np.ndarray:
        """(places, 12 + 6 m + 6 T) p, R, then derivatives of the neutral axis by the names and by the inputs."""
        count, m, T = shape.s.size, len(self.names), self.robot.n_tendons
        found = np.zeros((count, 12 + 6 * (m + T)))
        found[:, :3], found[:, 3:12] = shape.position, shape.rotation.reshape(count, 9)
        inputs = [f"displacements[{i}]" if self.pulled[i] else f"tensions[{i}]" for i in range(T)]
        wanted = list(dict.fromkeys(name for made in self.made.values() for name, _ in made))
        if not m:
            return found
        slopes = shape.jacobian(*wanted, *inputs)
        by = {
            name: np.hstack([slopes.position[:, :, i], slopes.rotation[:, :, i]]) for i, name in enumerate(slopes.names)
        }
        for j, name in enumerate(self.names):
            for engine, factor in self.made[name]:
                found[:, 12 + 6 * j : 18 + 6 * j] += factor * by[engine]
            if name in ("base_x", "base_y", "base_z"):
                found[:, 12 + 6 * j + _AXES[name[-1]]] = 1.0
        for i, name in enumerate(inputs):
            found[:, 12 + 6 * (m + i) : 18 + 6 * (m + i)] = by[name]
        return found

    def unturned(self, values: np.ndarray, commands: np.ndarray) -> np.ndarray:
        """``values`` (q, places, …) at ``commands``, seen from the exit's section; without what moves the whole."""
        found = values.copy()
        found[..., :3] -= self._exit_place
        self._take_whole(found, -1.0)
        return self._turned(found, self._sections(commands).transpose(0, 2, 1))

    def turned_back(self, values: np.ndarray, commands: np.ndarray) -> np.ndarray:
        """The inverse of `unturned`."""
        found = self._turned(values, self._sections(commands))
        self._take_whole(found, 1.0)
        found[..., :3] += self._exit_place
        return found

    @property
    def _exit_place(self) -> np.ndarray:
        return np.zeros(3) if self.pose is None else self.pose[:3, 3]

    def _sections(self, commands: np.ndarray) -> np.ndarray:
        """(q, 3, 3) the section's frame at the exit, in the world."""
        about_z = exp_so3(commands[:, 1, None] * np.array([0.0, 0.0, 1.0]))
        return about_z if self.pose is None else self.pose[:3, :3] @ about_z

    @staticmethod
    def _turned(values: np.ndarray, Q: np.ndarray) -> np.ndarray:
        """A copy with all vectors and the frames turned by (q, 3, 3)."""
        found, q = np.empty_like(values), len(values)
        found[..., 3:12] = (Q[:, None] @ values[..., 3:12].reshape(q, -1, 3, 3)).reshape(q, -1, 9)
        for part in (slice(0, 3), slice(12, None)):
            vectors = values[..., part].reshape(q, -1, 3)
            found[..., part] = (vectors @ Q.transpose(0, 2, 1)).reshape(found[..., part].shape)
        return found

    def _take_whole(self, values: np.ndarray, sign: float) -> None:
        """Add to the columns, ``sign`` times, how numbers of the base move the body as a whole; p from the exit."""
        for j, name in enumerate(self.names):
            column = values[..., 12 + 6 * j : 18 + 6 * j]
            if name in ("base_x", "base_y", "base_z"):
                column[..., _AXES[name[-1]]] += sign
            elif name in _TURNS:
                turn = left_jacobian_so3(self.setup.base_turn)[:, _TURNS[name]]
                column[..., :3] += sign * np.cross(turn, values[..., :3])
                column[..., 3:] += sign * turn

    def _engine(self, name: str) -> list[tuple[str, float]]:
        """What a number is made of in `Shape.jacobian`: (input, factor)."""
        if name in _TURNS:
            turn = left_jacobian_so3(self.setup.base_turn)[:, _TURNS[name]]
            return [(f"exit_rotation[{k}]", turn[k]) for k in range(3)]
        if name.startswith("gravity_tilt"):
            turn = left_jacobian_so3(self.setup.gravity_tilt)[:, _AXES[name[-1]]]
            return [(f"gravity[{k}]", by) for k, by in enumerate(np.cross(turn, self.gravity).tolist())]
        laden = int(self.setup.tip_mass > 0.0 or "tip_mass" in self.names)  # the tip's mass comes first
        if name == "tip_mass":
            return [("loads[0].mass", 1.0)]
        if name == "tracker_mass":
            return [(f"loads[{k}].mass", 1.0) for k in range(laden, len(self.loads))]
        if name.startswith("holder"):
            return [(f"loads[{k}].offset[{_AXES[name[-1]]}]", 1.0) for k in range(laden, len(self.loads))]
        return [] if name in BENCH else [(name, 1.0), *self._moved_along(name)]

    def _moved_along(self, name: str) -> list[tuple[str, float]]:
        """Masses that keep their share of the robot's length where a number changes it."""
        if name.endswith(MATERIAL):
            return []
        longer = sum(sign * each.length_na for sign, each in self._changed(name))
        on = [(k, each.at / self.robot.length_na) for k, each in enumerate(self.loads) if each.at is not None]
        return [(f"loads[{k}].at", share * longer) for k, share in on if longer != 0.0]

    def _changed(self, name: str) -> list[tuple[float, Robot]]:
        """The robot with a number a little higher and lower: (weight in a central difference, robot)."""
        value = self.robot.parameters()[name]
        step = 1e-6 * (abs(value) or 1.0)
        return [(sign / (2.0 * step), self.robot.replace(**{name: value + sign * step})) for sign in (1.0, -1.0)]

    def sensor(
        self, i: int, j: int, values: np.ndarray, readings: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Position (q, 3), rotation (q, 3, 3), columns (q, 6, m) and slope (q, 6, T) of tracker j of trial i."""
        tracker, m, T = self.trials[i].trackers[j], len(self.names), self.robot.n_tendons
        place = float(places(self.trials[i], self.robot)[j])
        at = values[:, int(np.searchsorted(self.places, place * (1.0 - 1e-12)))]
        p, R, more = at[:, :3], at[:, 3:12].reshape(-1, 3, 3), at[:, 12:].reshape(len(at), m + T, 6).transpose(0, 2, 1)
        turn = np.eye(3) if tracker.turn is None else exp_so3(np.array(tracker.turn))
        arm = np.array([*self.robot.axis_offset(np.array([place]))[0], 0.0]) + tracker.arm + self.setup.holder
        lever = R @ arm
        more = more.copy()
        more[:, :3] += np.cross(more[:, 3:], lever[:, :, None], axis=1)
        columns, slope = more[..., :m], more[..., m:]
        for c, name in enumerate(self.names):
            columns[:, :3, c] += R @ self._arm_by(name, place)
            if name in _READINGS:
                columns[..., c] = np.einsum("qit,qt->qi", slope, self._input_by(name, readings))
        taut = np.where(self.pulled, 0.0, self.setup.tension_scale * (readings > self.setup.tension_zero))
        return p + lever, R @ turn, columns, slope * taut[:, None, :] if m else np.full_like(slope, np.nan)

    def _arm_by(self, name: str, place: float) -> np.ndarray:
        """(3,) how a sensor's arm changes with a number."""
        if name.startswith("holder"):
            return np.eye(3)[_AXES[name[-1]]]
        if name in BENCH or name.endswith(MATERIAL):
            return np.zeros(3)
        share = place / self.robot.length_na
        offsets = [sign * each.axis_offset(np.array([share * each.length_na]))[0] for sign, each in self._changed(name)]
        return np.array([*np.sum(offsets, axis=0), 0.0])

    def _input_by(self, name: str, readings: np.ndarray) -> np.ndarray:
        """(q, T) how the inputs change with a number of the load cell's."""
        if name == "displacement_zero":
            return np.broadcast_to(np.where(self.pulled, -1.0, 0.0), readings.shape)
        shifted = readings - self.setup.tension_zero
        by = shifted if name == "tension_scale" else np.full_like(shifted, -self.setup.tension_scale)
        return np.where(self.pulled | (shifted <= 0.0), 0.0, by)
