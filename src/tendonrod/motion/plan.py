"""`Plan`: a follow-the-leader plan with its errors, and its files."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..curve import Curve
from ..errors import InvalidInput
from ..robot import Robot
from ..statics.shape import Shape

COLUMNS = {
    "progress": ("progress", 1.0),
    "insertion": ("insertion", 1.0),
    "rotation": ("rotation_rad", 1.0),
    "tension": ("tension_N", 1.0),
    "body_rms": ("body_rms_m", 1.0),
    "body_max": ("body_max_m", 1.0),
    "tip_error": ("tip_error_m", 1.0),
    "tip_error_at_progress": ("tip_error_at_progress_m", 1.0),
    "body_rms_percent": ("body_rms_percent_of_exposed_length", 1.0),
    "body_max_percent": ("body_max_percent_of_exposed_length", 1.0),
    "tip_error_percent": ("tip_error_percent_of_exposed_length", 1.0),
    "tip_error_at_progress_percent": ("tip_error_at_progress_percent_of_exposed_length", 1.0),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """What to command at each progress eta, and how far the body then is from the reference curve. All (steps,), SI.

    progress: eta = (k+1)/steps. insertion, rotation (rad), tension (N): as `tendonrod.solve` takes them. body_rms and
    body_max: distance of the exposed neutral axis, uniform in arc length, from the reference curve, by projection (m).
    tip_error: the same for the tip. tip_error_at_progress: distance of the tip from reference(eta L_na).
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
    def tip_rmse(self) -> float:
        """Root mean square of tip_error over the plan, m."""
        return float(np.sqrt(np.mean(self.tip_error**2)))

    @property
    def tip_rmse_at_progress(self) -> float:
        """Root mean square of tip_error_at_progress over the plan, m."""
        return float(np.sqrt(np.mean(self.tip_error_at_progress**2)))

    def polynomial(self, degree: int = 2) -> np.ndarray:
        """(degree + 1,) least-squares polynomial tension(progress) in N, highest power first, as the paper prints its
        own.
        """
        most = self.progress.size - 1
        if isinstance(degree, bool) or not isinstance(degree, (int, np.integer)) or not 0 <= degree <= most:
            raise InvalidInput("degree", degree, f"a whole number from 0 to {most}, one less than the plan's steps")
        return np.polyfit(self.progress, self.tension, int(degree))

    def to_dict(self) -> dict:
        """Everything but the shapes as plain numbers and lists, SI, keys as the attributes."""
        numbers = {name: getattr(self, name).tolist() for name in COLUMNS}
        return {
            "robot": self.robot.name,
            "torsion": getattr(self.robot.body, "torsion", "GJ"),
            "freedom": self.freedom,
            "target_tension": self.target_tension,
            "gravity": self.gravity.tolist(),
            **numbers,
            "tip_rmse": self.tip_rmse,
            "tip_rmse_at_progress": self.tip_rmse_at_progress,
            "polynomial": self.polynomial(min(2, self.progress.size - 1)).tolist(),
            "reference": {"s": self.reference.s.tolist(), "position": self.reference.points.tolist()},
        }

    def write(self, path) -> Path:
        """Write as .csv or .json (units in the headers or SI keys). Raises `InvalidInput` for another suffix."""
        path = Path(path)
        match path.suffix.lower():
            case ".csv":
                with path.open("w", newline="", encoding="utf-8") as file:
                    table = csv.writer(file)
                    table.writerow(header for header, _ in COLUMNS.values())
                    table.writerows(zip(*(getattr(self, name).tolist() for name in COLUMNS), strict=True))
            case ".json":
                path.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")
            case other:
                raise InvalidInput("output", other or str(path), "a file name that ends in .csv or .json")
        return path
