"""`Plan`: a follow-the-leader plan with its errors, and its files."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..curve import Curve
from ..errors import whole
from ..files import complete, file_name
from ..robot import Robot
from ..statics.shape import Shape
from .plan_origin import Origin

COLUMNS = {
    "progress": "progress",
    "insertion": "insertion",
    "rotation": "rotation_rad",
    "tension": "tension_N",
    "body_rms": "body_rms_m",
    "body_max": "body_max_m",
    "tip_error": "tip_error_m",
    "tip_error_at_progress": "tip_error_at_progress_m",
    "body_rms_percent": "body_rms_percent_of_exposed_length",
    "body_max_percent": "body_max_percent_of_exposed_length",
    "tip_error_percent": "tip_error_percent_of_exposed_length",
    "tip_error_at_progress_percent": "tip_error_at_progress_percent_of_exposed_length",
}

UNITS = {
    "progress": "1",
    "insertion": "1",
    "rotation": "rad",
    "tension": "N",
    **dict.fromkeys(("body_rms", "body_max", "tip_error", "tip_error_at_progress"), "m"),
    **{name: "%" for name in COLUMNS if name.endswith("_percent")},
    "target_tension": "N",
    "gravity": "m/s2",
    "tip_rmse": "m",
    "tip_rmse_at_progress": "m",
    "polynomial": "N",
    "reference": "m",
}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Plan:
    """What to command at each progress eta, and how far the body then is from the reference curve. All (steps,), SI.

    - progress: eta = (k+1)/steps.
    - insertion, rotation (rad), tension (N): as `tendonrod.solve` takes them.
    - body_rms, body_max: distance of the exposed neutral axis, uniform in arc length, from the reference curve, by
      projection (m); tip_error: the same for the tip.
    - tip_error_at_progress: distance of the tip from reference(eta L_na), m.
    - reference: `Curve` of the full robot; shapes: the exposed `Shape` of each step.
    - robot, target_tension, gravity, freedom: as asked for.
    """

    robot: Robot
    target_tension: float
    gravity: np.ndarray
    freedom: str
    reference: Curve
    progress: np.ndarray
    insertion: np.ndarray
    rotation: np.ndarray
    tension: np.ndarray
    body_rms: np.ndarray
    body_max: np.ndarray
    tip_error: np.ndarray
    tip_error_at_progress: np.ndarray
    shapes: tuple[Shape, ...]

    def __repr__(self) -> str:
        worst = f"body within {1e3 * self.body_max.max():.3g} mm of the reference"
        what = f"{self.robot.name}, {self.freedom}, {self.target_tension:g} N, {self.progress.size} steps"
        return f"Plan({what}, {worst})"

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    @property
    def exposed_length(self) -> np.ndarray:
        """(steps,) insertion * L_na, m."""
        return self.insertion * self.robot.length_na

    @property
    def body_rms_percent(self) -> np.ndarray:
        """body_rms in % of the exposed length."""
        return 100.0 * self.body_rms / self.exposed_length

    @property
    def body_max_percent(self) -> np.ndarray:
        """body_max in % of the exposed length."""
        return 100.0 * self.body_max / self.exposed_length

    @property
    def tip_error_percent(self) -> np.ndarray:
        """tip_error in % of the exposed length."""
        return 100.0 * self.tip_error / self.exposed_length

    @property
    def tip_error_at_progress_percent(self) -> np.ndarray:
        """tip_error_at_progress in % of the exposed length."""
        return 100.0 * self.tip_error_at_progress / self.exposed_length

    @property
    def warnings(self) -> tuple[tuple[str, ...], ...]:
        """For each step the warnings of its shape, and whether the tendon reaches the exposed robot at all."""
        reached = self.robot.routing[0, 5] > (1.0 - self.insertion) * self.robot.length_na
        hidden = ("the tendon ends inside the outer tube, where its tension has no effect",)
        return tuple(shape.warnings + (() if out else hidden) for shape, out in zip(self.shapes, reached, strict=True))

    @property
    def tip_rmse(self) -> float:
        """Root mean square of tip_error over the plan, m."""
        return float(np.sqrt(np.mean(self.tip_error**2)))

    @property
    def tip_rmse_at_progress(self) -> float:
        """Root mean square of tip_error_at_progress over the plan, m."""
        return float(np.sqrt(np.mean(self.tip_error_at_progress**2)))

    def polynomial(self, degree: int = 2) -> np.ndarray:
        """(degree + 1,) least-squares polynomial tension(progress), N, highest power first as in the paper."""
        most = self.progress.size - 1
        return np.polyfit(self.progress, self.tension, whole("degree", degree, 0, most))

    def to_dict(self) -> dict:
        """Everything but the shapes as plain numbers and lists, SI, keys as the attributes."""
        numbers = {name: getattr(self, name).tolist() for name in COLUMNS}
        return {
            "robot": self.robot.name,
            "torsion": self.robot.torsion,
            "freedom": self.freedom,
            "units": dict(UNITS),
            "target_tension": self.target_tension,
            "gravity": self.gravity.tolist(),
            **numbers,
            "tip_rmse": self.tip_rmse,
            "tip_rmse_at_progress": self.tip_rmse_at_progress,
            "polynomial": self.polynomial(min(2, self.progress.size - 1)).tolist(),
            "reference": {"s": self.reference.s.tolist(), "position": self.reference.points.tolist()},
        }

    def write(self, path) -> Path:
        """Write as .csv or .json, SI units in the headers; an older file is replaced once the new one is complete.

        A .csv file begins with comment lines, "# robot = ..." and so on, that say what the plan is for.

        Raises `InvalidInput` for another suffix and where the file cannot be written.
        """
        path = file_name("path", path, (".csv", ".json"))
        with complete("path", path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
            self._write_table(file) if path.suffix.lower() == ".csv" else self._write_json(file)
        return path

    @property
    def origin(self) -> Origin:
        """What the plan was made for."""
        gx, gy, gz = self.gravity.tolist()
        return Origin(
            robot=self.robot.name, torsion=self.robot.torsion, gravity=(gx, gy, gz),
            target_tension=self.target_tension, freedom=self.freedom,
        )  # fmt: skip

    def _write_table(self, file) -> None:
        file.writelines(f"{line}\r\n" for line in self.origin.lines())
        table = csv.writer(file)
        table.writerow(COLUMNS.values())
        table.writerows(zip(*(getattr(self, name).tolist() for name in COLUMNS), strict=True))

    def _write_json(self, file) -> None:
        json.dump(self.to_dict(), file, indent=1)
        file.write("\n")
