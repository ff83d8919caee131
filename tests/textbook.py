"""Robots and loads that the statics tests share: presets and the rods of the literature, SI units."""

from functools import cache

import numpy as np

from tendonrod import PlainRod, Robot, Tendon, load_robot

PROTOTYPES = ("exonav-1", "exonav-2", "exonav-3", "exonav-4")
GRAVITY = np.array([-9.81, 0.0, 0.0])


@cache
def prototype(number: int, torsion: str = "published") -> Robot:
    return load_robot(f"exonav-{number}").replace(torsion=torsion)


def rod(
    *tendons: Tendon, length: float = 0.2, radius: float = 0.5e-3, E: float = 75e9, G: float = 25e9, **more
) -> Robot:
    body = PlainRod(length=length, radius=radius, youngs_modulus=E, shear_modulus=G, density=6255.0, **more)
    return Robot(name="rod", body=body, tendons=tendons)


def four_tendon_rod(turns: float) -> Robot:
    """Rucker & Webster's size of robot: steel, radius 1 mm, 0.5 m, four tendons at 15.06 mm, tendon 1 on +x."""
    body = PlainRod(length=0.5, radius=1e-3, youngs_modulus=200e9, shear_modulus=80e9, density=8000.0)
    tendons = [Tendon.helical(offset=15.06e-3, angle=0.5 * np.pi * i, turns=turns) for i in range(4)]
    return Robot(name="four tendons", body=body, tendons=tendons)


def helix_rod() -> Robot:
    """A rod with a helical, a constant and a half-way tendon: every kind of routing at once."""
    return rod(
        Tendon.helical(offset=2e-3, angle=0.3, turns=0.7),
        Tendon.constant(x=-1.5e-3, y=1e-3),
        Tendon.helical(offset=1.8e-3, angle=2.0, turns=-0.4, end=0.11),
    )


def about_z(angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def farthest(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance between points of the same index."""
    return float(np.linalg.norm(np.asarray(a) - np.asarray(b), axis=-1).max())
