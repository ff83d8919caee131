"""A tree of boxes over triangles, by which the nearest one is found without looking at all of them."""

from __future__ import annotations

import numpy as np

LEAF = 4  # triangles in a box that is not split any more


def tree(triangles: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Boxes over ``triangles`` (m, 3, 3), halved at the median of the triangles' middles along the longest side.

    Returns the triangles in the order of the boxes, and of these low, high (k, 3) corners; first, last (k,), the
    stretch of triangles in each; child (k,), the first of its two halves, which stand side by side, 0 for none.
    """
    middle, order = triangles.mean(axis=1), np.arange(len(triangles))
    first, last = np.array([0]), np.array([len(triangles)])
    levels, count = [], 1
    while len(first):
        low, high = _bounds(triangles, order, first, last)
        splits = last - first > LEAF
        child = np.where(splits, count + 2 * (np.cumsum(splits) - 1), 0)
        levels.append((low, high, first, last, child))
        for f, b, axis in zip(first[splits], last[splits], np.argmax(high - low, axis=1)[splits], strict=True):
            part = order[f:b]
            order[f:b] = part[np.argsort(middle[part, axis], kind="stable")]
        half = (first + last)[splits] // 2
        first, last = np.stack([first[splits], half], 1).ravel(), np.stack([half, last[splits]], 1).ravel()
        count += len(first)
    return np.ascontiguousarray(triangles[order]), tuple(np.concatenate(each) for each in zip(*levels, strict=True))


def _bounds(triangles: np.ndarray, order: np.ndarray, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, ...]:
    """Corners of the boxes of stretches of ``order``, which do not overlap."""
    edges = np.stack([first, last], axis=1).ravel()
    corners = triangles[np.append(order, order[-1:])]  # one more, so that the last stretch may end there
    low = np.minimum.reduceat(corners.min(axis=1), edges, axis=0)[::2]
    return low, np.maximum.reduceat(corners.max(axis=1), edges, axis=0)[::2]
