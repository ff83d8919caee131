"""A phantom whose walls are endless round cylinders, quick and known in closed form, for the tests of sessions."""

from __future__ import annotations

import numpy as np

from tendonrod import load_robot
from tendonrod.anatomy import Phantom, Structure, Target
from tendonrod.navigate.outer_tube import OuterTube
from tendonrod.navigate.scenario import Scenario
from tendonrod.surface import Cylinder, Tube

CORD, CANAL = 4.0e-3, 7.3e-3
VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def round_phantom(cord: float = CORD, canal: float = CANAL) -> Phantom:
    """Cord and canal of these radii (m) about the z axis, with one target on the robot's way, 10 mm up."""
    axis = {"point": (0.0, 0.0, 0.0), "axis": (0.0, 0.0, 1.0)}
    walls = {"cord": Cylinder(radius=cord, **axis), "canal": Tube(radius=canal, **axis)}
    structures = {
        name: Structure(name=name, role=name, vertices=cord * VERTICES, faces=FACES, surface=surface, is_wall=True)
        for name, surface in walls.items()
    }
    near = Target(
        name="near@L2", level="L2", position=(5.2e-3, 0.8e-3, 3e-3), tolerance=1.5e-3, side="middle",
        description="soon reached",
    )  # fmt: skip
    return Phantom(
        name="round", kind="printed", structures=structures, targets={near.name: near}, levels=(), sources={},
        source="round",
    )  # fmt: skip


def scenario(**changes) -> Scenario:
    """ExoNav 1 at the dorsal side, tilted to the right."""
    given = {"phantom": round_phantom(), "tube": OuterTube(tilt=np.radians(21.0).item())} | changes
    return Scenario(robot=load_robot("exonav-1").replace(torsion="homogenized"), **given)
