"""Triangle meshes on file: STL (binary or text) and OBJ are read, binary STL is written. Numbers in the file's unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import Fact, InvalidInput
from ..files import complete, file_name

SUFFIXES = (".stl", ".obj")
HEAD = 80  # bytes before the count in a binary STL
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
MOST_TRIANGLES = 2_000_000


def read_mesh(field: str, path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3), equal corners in one, and faces (m, 3). Raises `InvalidInput` in a sentence."""
    path = file_name(field, path, SUFFIXES)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InvalidInput(field, str(path), "an existing mesh file") from None
    except OSError as error:
        raise InvalidInput(field, str(path), f"readable: {error.strerror}") from None
    if not content.strip():
        raise InvalidInput(field, Fact(f"{path.name}, empty"), "a mesh")
    corners = _obj(field, path, content) if path.suffix.lower() == ".obj" else _stl(field, path, content)
    if not len(corners):
        raise InvalidInput(field, Fact(f"{path.name} without a triangle"), "a mesh of triangles")
    if len(corners) > MOST_TRIANGLES:
        raise InvalidInput(field, Fact(f"{path.name}, {len(corners)} triangles"), f"at most {MOST_TRIANGLES}")
    if not np.isfinite(corners).all():
        bad = int((~np.isfinite(corners)).any(axis=(1, 2)).sum())
        raise InvalidInput(field, Fact(f"{path.name}, {bad} triangles with corners nowhere"), "finite numbers")
    return _joined(corners)


def _joined(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    a, b, c = faces.T
    return vertices, faces[(a != b) & (b != c) & (c != a)]


def _stl(field: str, path: Path, content: bytes) -> np.ndarray:
    """(m, 3, 3) corners. Text files begin with "solid", and so do some binary ones, which their length tells."""
    count = int.from_bytes(content[HEAD : HEAD + 4], "little")
    expected = HEAD + 4 + FACET.itemsize * count
    if len(content) >= HEAD + 4 and len(content) == expected:
        return np.frombuffer(content, FACET, count, HEAD + 4)["corners"].astype(float)
    if content.lstrip()[:5].lower() == b"solid" and b"\0" not in content:
        return _text_stl(field, path, content)
    says = f"{path.name}, {len(content)} bytes"
    asked = f"{expected} bytes, as its head says: {count} triangles" if len(content) > HEAD + 4 else "84 bytes or more"
    raise InvalidInput(field, Fact(says), f"an STL file of {asked}; it is cut short or no STL file")


def _text_stl(field: str, path: Path, content: bytes) -> np.ndarray:
    lines = [line.split()[1:4] for line in content.lower().splitlines() if line.split()[:1] == [b"vertex"]]
    corners = _numbers(field, path, lines)
    if len(corners) % 3:
        raise InvalidInput(field, Fact(f"{path.name}, {len(corners)} corners"), "three to a triangle")
    return corners.reshape(-1, 3, 3)


def _obj(field: str, path: Path, content: bytes) -> np.ndarray:
    """(m, 3, 3) corners; faces of more corners are split into fans."""
    rows = [line.split() for line in content.splitlines()]
    vertices = _numbers(field, path, [row[1:4] for row in rows if row[:1] == [b"v"]])
    triangles = []
    for row in rows:
        if row[:1] == [b"f"]:
            try:
                at = [int(each.split(b"/")[0]) for each in row[1:]]
            except ValueError:
                raise InvalidInput(field, Fact(f"{path.name}: {_said(row)}"), "a face by numbers of corners") from None
            at = [i - 1 if i > 0 else len(vertices) + i for i in at]
            if len(at) < 3 or min(at) < 0 or max(at) >= len(vertices):
                allowed = f"a face of 3 or more corners from 1 to {len(vertices)}"
                raise InvalidInput(field, Fact(f"{path.name}: {_said(row)}"), allowed)
            triangles += [(at[0], at[k], at[k + 1]) for k in range(1, len(at) - 1)]
    return vertices[np.array(triangles, dtype=int).reshape(-1, 3)] if triangles else np.empty((0, 3, 3))


def _numbers(field: str, path: Path, rows: list[list[bytes]]) -> np.ndarray:
    try:
        return np.array([[float(each) for each in (x, y, z)] for x, y, z in rows]).reshape(-1, 3)
    except ValueError:
        raise InvalidInput(
            field, Fact(f"{path.name}, a corner that is no number"), "three numbers to a corner"
        ) from None


def _said(row: list[bytes]) -> str:
    return b" ".join(row)[:60].decode("ascii", "replace")


def stl_bytes(vertices, faces, scale: float = 1.0, title: str = "tendonrod") -> bytes:
    """A binary STL of a mesh, its corners times ``scale``."""
    corners = (scale * np.asarray(vertices, dtype=float))[np.asarray(faces)]
    facets = np.zeros(len(corners), FACET)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets["normal"], facets["corners"] = normal / np.where(length == 0.0, 1.0, length), corners
    return title.encode("ascii", "replace")[:HEAD].ljust(HEAD) + len(corners).to_bytes(4, "little") + facets.tobytes()


def write_stl(path, vertices, faces, scale: float = 1.0, title: str = "tendonrod", field: str = "path") -> None:
    """Write `stl_bytes` to ``path``, which ends in .stl. Raises `InvalidInput`."""
    with complete(field, file_name(field, path, (".stl",))) as draft:
        draft.write_bytes(stl_bytes(vertices, faces, scale, title))
