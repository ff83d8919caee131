"""Whether a mesh can be asked for distances: closed, faces outwards, of a plausible size. Plain sentences where not."""

from __future__ import annotations

import numpy as np

from ..errors import Fact, InvalidInput

SHORTEST, LONGEST = 5e-3, 1.5  # m, longest side of the box around a structure of the spine
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 25.4e-3}


def check_mesh(field: str, vertices: np.ndarray, faces: np.ndarray, unit: str = "m") -> None:
    """Raises `InvalidInput` unless the mesh (n, 3) m, (m, 3) is of a plausible size, watertight and right side out."""
    _check_size(field, vertices[faces.ravel()], unit)
    _check_closed(field, vertices, faces)
    if (volume := mesh_volume(vertices, faces)) <= 0.0:
        says = f"inside out: it encloses {1e9 * volume:.4g} mm3"
        raise InvalidInput(field, Fact(says), "> 0 mm3: faces counter-clockwise seen from outside; flip its normals")


def mesh_volume(vertices, faces) -> float:
    """What a closed mesh encloses, m^3; negative where its faces point inwards."""
    a, b, c = np.moveaxis(np.asarray(vertices)[np.asarray(faces)], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def open_edges(faces: np.ndarray) -> np.ndarray:
    """(k, 2) edges that are not shared by just two faces, once in each direction."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    size = int(faces.max()) + 1
    there, count = np.unique(edges[:, 0] * size + edges[:, 1], return_counts=True)
    back = np.unique(edges[:, 1] * size + edges[:, 0])
    lonely = np.union1d(there[count > 1], np.setdiff1d(there, back))
    return np.stack([lonely // size, lonely % size], axis=1)


def _check_size(field: str, corners: np.ndarray, unit: str) -> None:
    longest = float(np.ptp(corners, axis=0).max())
    if SHORTEST <= longest <= LONGEST:
        return
    raw = longest / UNITS[unit]
    fitting = [name for name, size in UNITS.items() if SHORTEST <= raw * size <= LONGEST and name in ("mm", "m")]
    hint = f'; its numbers look like {fitting[0]}: unit = "{fitting[0]}"' if fitting else ""
    says = f"{1e3 * longest:.4g} mm long, read with unit = {unit}"
    raise InvalidInput(field, Fact(says), f"from {1e3 * SHORTEST:g} to {1e3 * LONGEST:g} mm{hint}")


def _check_closed(field: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    loose = open_edges(faces)
    if len(loose):
        x, y, z = 1e3 * vertices[loose[0]].mean(axis=0)
        says = f"not watertight: {len(loose)} open or doubled edges, the first at {x:.3f}, {y:.3f}, {z:.3f} mm"
        allowed = "closed: each edge shared by two faces that turn the same way; repair the mesh"
        raise InvalidInput(field, Fact(says), allowed)
