"""Signed distance to a closed mesh: exact at the nodes of a grid, splines between them, cached on disk by content."""

from __future__ import annotations

import hashlib
import os
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from ..errors import Fact, InvalidInput
from ..surface import DistanceGrid
from .boxes import tree

SPACING = 0.5e-3  # m between the nodes of a grid
MARGIN = 4  # nodes of a grid beyond the box that is asked for
MOST_NODES = 30_000_000  # 240 MB
ASIDE = np.array([0.0, 0.4142e-3, 0.2718e-3])  # of the spacing: no ray runs along an edge of a mesh with round numbers
SLAB = 4  # layers of nodes that one thread fills at a time
VERSION = 4  # of what a cached file holds
NOTICE = "tendonrod: computing the distances to a mesh of {} triangles, some seconds; they are kept for the next time"
PATIENCE = 1.0  # s of work before it is told


class OpenGrid(DistanceGrid):
    """A `DistanceGrid` that answers outside its box too, with the tangent plane of the nearest point of the box.

    A canal whose box ends inside it goes on beyond as it is there: robots may leave the range of a phantom.
    """

    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) and gradient (n, 3) at ``points`` (n, 3)."""
        return self._spline(points)[:2]

    def curvature(self, points) -> np.ndarray:
        """Hessian (n, 3, 3); outside the box that of its nearest point."""
        return self._spline(points)[2]

    def _spline(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The spline of `DistanceGrid`, compiled: a robot asks for it some hundred times a step."""
        from .kernel import spline

        points = np.ascontiguousarray(points, dtype=float)
        if not np.isfinite(points).all():
            raise InvalidInput("points", points, "finite numbers")
        return spline(points, self.origin, self.spacing, self._coefficients, self.values.shape)


def distance_grid(vertices, faces, low, high, spacing: float = SPACING, caps=None) -> OpenGrid:
    """Signed distance, m, positive outside, of the closed mesh (n, 3) m, (m, 3), over the box ``low`` to ``high`` (3,).

    The node values are exact, to the rounding of single precision; a cached file is read where there is one. With
    ``caps`` (m,), which marks faces that close an opening and are no walls, it is positive inside instead.
    """
    triangles = np.ascontiguousarray(np.asarray(vertices, dtype=float)[np.asarray(faces)])
    low = spacing * np.floor(np.asarray(low, dtype=float) / spacing) - spacing * ASIDE
    shape = tuple(int(n) for n in np.ceil((np.asarray(high) - low) / spacing).astype(int) + MARGIN)
    if np.prod(shape) > MOST_NODES:
        says = f"{np.prod(shape):.3g} nodes {1e3 * spacing:g} mm apart"
        raise InvalidInput("distances", Fact(says), f"at most {MOST_NODES:.3g}: a mesh of a shorter stretch")
    walls = slice(None) if caps is None else ~np.asarray(caps)
    cached = _cache_file(triangles, np.arange(len(triangles))[walls], low, spacing, shape)
    values = _read(cached, shape)
    if values is None:
        with _told(len(triangles)):
            values = _signed(triangles, walls, low, spacing, shape).astype(np.float32)
        if caps is not None:
            values = _prolonged(
                values, (triangles[:, :, 2].min() - low[2]) / spacing, (triangles[:, :, 2].max() - low[2]) / spacing
            )
        _write(cached, values)
    return OpenGrid(origin=low, spacing=spacing, values=(1.0 if caps is None else -1.0) * values.astype(float))


@contextmanager
def _told(triangles: int) -> Iterator[None]:
    """Says on standard error what is worked on, where that takes long."""
    notice = threading.Timer(PATIENCE, print, [NOTICE.format(triangles)], {"file": sys.stderr, "flush": True})
    notice.daemon = True
    notice.start()
    try:
        yield
    finally:
        notice.cancel()


def _signed(triangles: np.ndarray, walls, low: np.ndarray, spacing: float, shape: tuple[int, ...]) -> np.ndarray:
    """Distances to the ``walls`` among the triangles, negative where all of them together enclose a node."""
    from . import kernel

    (asked, boxes), unsigned = tree(triangles[walls]), np.empty(shape)
    slabs = [slice(i, i + SLAB) for i in range(0, shape[0], SLAB)]
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # the compiled loops hold no lock

        def fill(slab: slice) -> None:
            start = np.array([low[0] + spacing * slab.start, low[1], low[2]])
            kernel.distances(asked, boxes, start, spacing, unsigned[slab])

        list(threads.map(fill, slabs))
    return np.where(kernel.winding(triangles, low, spacing, shape) > 0, -unsigned, unsigned)


def _prolonged(values: np.ndarray, first: float, last: float) -> np.ndarray:
    """Nodes below ``first`` and above ``last``, counted along z, as those at these ends: a lining goes on there."""
    inside = np.clip(np.arange(values.shape[2]), int(np.ceil(first)), int(np.floor(last)))
    return values[:, :, inside]


def cache_folder() -> Path:
    """Where distances are kept: TENDONROD_CACHE, else the platform's folder for caches."""
    own = os.environ.get("TENDONROD_CACHE")
    if own:
        return Path(own)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "tendonrod"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "tendonrod" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tendonrod"


def _cache_file(triangles: np.ndarray, walls: np.ndarray, low: np.ndarray, spacing: float, shape) -> Path:
    digest = hashlib.sha256(repr((VERSION, low.tolist(), spacing, shape)).encode())
    digest.update(triangles.tobytes() + walls.tobytes())
    return cache_folder() / f"distance-{digest.hexdigest()[:32]}.npy"


def _read(path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
    """What an earlier run wrote; None where there is none, or a damaged one."""
    try:
        values = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return values if values.shape == shape and values.dtype == np.float32 else None


def _write(path: Path, values: np.ndarray) -> None:
    """Keep ``values``; a folder that cannot be written costs time on the next run and nothing else."""
    draft = path.with_name(f"{path.stem}.{os.getpid()}.npy")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(draft, values)
        os.replace(draft, path)
    except OSError:
        with suppress(OSError):
            draft.unlink()
