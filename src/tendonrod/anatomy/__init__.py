"""Spinal phantoms: parametric cord, canal, dura and vertebrae or a user's meshes, with signed distances and targets."""

from .levels import Level
from .loading import load_phantom
from .phantom import Entry, Phantom, Structure, Target
from .printing import write_stl

__all__ = ["Entry", "Level", "Phantom", "Structure", "Target", "load_phantom", "write_stl"]
