"""Names of what may be identified: what the bench's mean, short names for several, and refusals that list them."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

import numpy as np

from ..errors import Fact, InvalidInput
from .setup import BENCH, Setup, the_robot
from .trial import Trial

MEANINGS = {
    "base_x": "place of the outer tube's exit in the world, along x",
    "base_y": "place of the outer tube's exit in the world, along y",
    "base_z": "place of the outer tube's exit in the world, along z",
    "base_tilt_x": "turn of the exit about the world's x",
    "base_tilt_y": "turn of the exit about the world's y",
    "base_roll": "turn of the exit about the world's z, the tube's axis",
    "gravity_tilt_x": "turn of gravity about the world's x",
    "gravity_tilt_y": "turn of gravity about the world's y",
    "gravity_tilt_z": "turn of gravity about the world's z",
    "tip_mass": "mass at the tip, in every trial",
    "tracker_mass": "mass of each tracker on the robot, beside what the trials say",
    "holder_x": "every sensor's place beside its offset, along the section's x",
    "holder_y": "every sensor's place beside its offset, along the section's y",
    "holder_z": "every sensor's place beside its offset, along the section's z",
    "tension_scale": "true tension = scale * (reading - zero)",
    "tension_zero": "the load cell's reading where the tendon is slack",
    "displacement_zero": "the reading of the pulled length where the tendon is straight",
}
GROUPS = {
    "base_pose": ("base_x", "base_y", "base_z", "base_tilt_x", "base_tilt_y", "base_roll"),
    "base_tilt": ("base_tilt_x", "base_tilt_y"),
    "holder": ("holder_x", "holder_y", "holder_z"),
    "gravity_tilt": ("gravity_tilt_x", "gravity_tilt_y", "gravity_tilt_z"),
}


def expanded(free: Sequence[str], trials: Sequence[Trial], setup: Setup) -> tuple[str, ...]:
    """``free`` with the names of `GROUPS` replaced by what they stand for; the others as they are.

    gravity_tilt leaves out the axis along which all trials' gravity points, if there is one: a turn about it changes
    nothing. Raises `InvalidInput` that lists what there is for a name that is not known, and for a stiffness factor of
    a robot whose torsion model has none.
    """
    found: list[str] = []
    for name in free:
        if name in GROUPS:
            found += across_gravity(trials) if name == "gravity_tilt" else GROUPS[name]
        else:
            check_name("free", name, trials, setup)
            found.append(name)
    return tuple(found)


def check_name(field: str, name: str, trials: Sequence[Trial], setup: Setup) -> None:
    """Raise `InvalidInput` where neither bench nor robot has a number of this name, or it has no effect."""
    if name in BENCH:
        return
    robot = the_robot(setup, trials)
    numbers = robot.parameters()
    if name not in numbers:
        raise InvalidInput(field, Fact(name or "''"), _known(name, list(numbers)))
    if name.endswith("_factor") and robot.torsion != "homogenized":
        allowed = f"left out: the torsion model {robot.torsion} has no stiffness factors, only homogenized has"
        raise InvalidInput(field, Fact(name), allowed)


def _known(name: str, of_robot: list[str]) -> str:
    """All names in two groups, and the one that was meant."""
    near = get_close_matches(name, [*BENCH, *GROUPS, *of_robot], n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    bench = f"{', '.join(BENCH)}; {', '.join(GROUPS)} for several"
    return f"a number of the bench ({bench}) or of the robot ({', '.join(of_robot)}){hint}"


def across_gravity(trials: Sequence[Trial]) -> tuple[str, ...]:
    """Those of gravity_tilt that change something: a turn about the one line of all gravity changes nothing."""
    pulls = np.array([each.gravity for each in trials if any(each.gravity)]).reshape(-1, 3)
    alike = len(pulls) > 0 and np.linalg.matrix_rank(pulls) == 1
    along = int(np.argmax(np.abs(pulls).sum(axis=0))) if alike else None
    return tuple(name for k, name in enumerate(GROUPS["gravity_tilt"]) if k != along)
