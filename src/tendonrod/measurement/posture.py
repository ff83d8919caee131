"""`posture`: the whole body as the model has it at one sample of a trial."""

from __future__ import annotations

import numpy as np

from ..statics.shape import Shape
from .family import Family
from .setup import Setup
from .trial import Trial

SECTIONS = 81


def posture(trial: Trial, sample: int, setup: Setup | None = None) -> Shape:
    """The model's `Shape` at the readings of ``sample``, in the world, with the masses that trial and setup say.

    Friction holds on to nothing from the samples before. Raises `NotConverged` where there is no equilibrium.
    """
    family = Family((trial,), setup or Setup(), (), [(0, np.array([sample]))])
    shape = family.solve(family.commands[0], None)
    return shape.at(np.linspace(0.0, shape.length, SECTIONS)) if shape.length > 0.0 else shape
