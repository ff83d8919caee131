"""In which terms values at the trackers are smooth functions of the commands, for `interpolation`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .family import Family
from .setup import Setup, places
from .trial import Trial

NUDGES = (0.05, 0.01)  # of rotation, rad, and of a drive, of its range: steps that tell how far they move the body


def kinks(trial: Trial, setup: Setup) -> np.ndarray:
    """(n,) how many of the trackers' places and of the body's breaks are out: values bend where one comes out."""
    robot = setup.robot_of(trial)
    marks = np.concatenate([places(trial, robot), robot.breaks])
    inside = (1.0 - trial.insertion[:, None]) * robot.length_na
    with np.errstate(invalid="ignore"):
        return (marks >= inside * (1.0 - 1e-9)).sum(axis=1)


def reach(family: Family, values: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """(1 + T,) how far a radian of rotation, and 1 N or 1 m of each drive, move the body, in its exposed lengths.

    Found at the sample that is out the furthest and driven the most; 0 for what does not differ. values(command):
    (places, c) of `Family.values`.
    """
    commands = family.commands
    best = commands[np.lexsort((commands[:, 2:].sum(axis=1), commands[:, 0]))[-1]]

    def body(command: np.ndarray) -> np.ndarray:
        return family.unturned(values(command)[None], command[None])[0, :, :3]

    ranges, here, found = np.ptp(commands, axis=0), body(best), np.zeros(commands.shape[1] - 1)
    for d in np.flatnonzero(ranges[1:] > 0.0):
        moved, step = best.copy(), NUDGES[0] if d == 0 else NUDGES[1] * ranges[1 + d]
        moved[1 + d] -= step
        found[d] = np.linalg.norm(body(moved) - here, axis=-1).max() / (step * family.robot.length_na * best[0])
    return found


def features(family: Family, reached: np.ndarray) -> np.ndarray:
    """(q, f) insertion, and what rotation and drive do, in lengths of the body, with the `reach` of each.

    What they do grows with what is exposed; what a pulled length does, does not.
    """
    turn, *drives = reached
    eta, phi = family.commands[:, 0], family.commands[:, 1]
    exposed = np.where(family.pulled, 1.0, eta[:, None])
    turned = eta * turn * np.array([np.cos(phi), np.sin(phi)])
    return np.column_stack([eta, turned.T, exposed * family.commands[:, 2:] * drives])
