"""`Origin`: for which robot a plan was made, as comments above the header of its CSV file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import Fact, InvalidInput
from ..robot import Robot

LINE = re.compile(r"#\s*(\w+)\s*=\s*(.+?)\s*")
SAME = 1e-6  # m/s2, between two gravities


@dataclass(frozen=True, kw_only=True)
class Origin:
    """robot, torsion: names; gravity: (3,) m/s2; target_tension: N; freedom: see `plan_follow_leader`."""

    robot: str
    torsion: str
    gravity: tuple[float, float, float]
    target_tension: float
    freedom: str

    def lines(self) -> list[str]:
        """Comments for a file, with the units in their keys."""
        values = {
            "robot": self.robot, "torsion": self.torsion, "gravity_m_s2": list(self.gravity),
            "target_tension_N": self.target_tension, "freedom": self.freedom,
        }  # fmt: skip
        return [f"# {key} = {json.dumps(value)}" for key, value in values.items()]

    def check_robot(self, field: str, name: str, robot: Robot) -> None:
        """Raise `InvalidInput` for ``field``, the file ``name``, where it was made for a robot of another name."""
        if self.robot != robot.name:
            raise InvalidInput(field, Fact(f"{name}, made for {self.robot}"), f"a plan for {robot.name}")

    def differences(self, robot: Robot, gravity) -> list[str]:
        """What is not as the plan was made for, as "torsion published, here homogenized"; empty where all is."""
        found = []
        if self.robot != robot.name:
            found.append(f"robot {self.robot}, here {robot.name}")
        if self.torsion != robot.torsion:
            found.append(f"torsion {self.torsion}, here {robot.torsion}")
        if np.abs(np.subtract(self.gravity, gravity)).max() > SAME:
            there, here = (", ".join(f"{x:g}" for x in each) for each in (self.gravity, gravity))
            found.append(f"gravity ({there}) m/s2, here ({here})")
        return found


def read_origin(lines: Iterable[str]) -> Origin | None:
    """The origin that comment lines tell, None where they do not tell all of it, as in files of other hands."""
    said: dict[str, Any] = {}
    for line in lines:
        if found := LINE.fullmatch(line.strip()):
            try:
                said[found[1]] = json.loads(found[2])
            except ValueError:
                continue
    try:
        x, y, z = map(float, said["gravity_m_s2"])
        return Origin(
            robot=str(said["robot"]), torsion=str(said["torsion"]), gravity=(x, y, z),
            target_tension=float(said["target_tension_N"]), freedom=str(said["freedom"]),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError):
        return None
