"""Compiled loops over triangles and the nodes of a grid: exact distance to a mesh and which nodes it encloses.

Arrays only. ``triangles`` (m, 3, 3) are corners; `boxes.tree` puts them in order and makes ``boxes`` over them.
"""

import numpy as np
from numba import njit

DEPTH = 64  # of the walk through the tree; a tree of halves over 2^30 triangles needs 31


@njit(cache=True, nogil=True)
def squared_distance(px, py, pz, t, i):
    """Squared distance from p to triangle t[i] (Ericson, Real-Time Collision Detection, 5.1.5)."""
    ax, ay, az = px - t[i, 0, 0], py - t[i, 0, 1], pz - t[i, 0, 2]
    ux, uy, uz = t[i, 1, 0] - t[i, 0, 0], t[i, 1, 1] - t[i, 0, 1], t[i, 1, 2] - t[i, 0, 2]
    vx, vy, vz = t[i, 2, 0] - t[i, 0, 0], t[i, 2, 1] - t[i, 0, 1], t[i, 2, 2] - t[i, 0, 2]
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d1, d2 = ux * ax + uy * ay + uz * az, vx * ax + vy * ay + vz * az
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    inner, outer, other = d3 * d6 - d5 * d4, d1 * d4 - d3 * d2, d5 * d2 - d1 * d6
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif outer <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / uu, 0.0
    elif other <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / vv
    elif inner <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        total = inner + outer + other
        v, w = other / total, outer / total
    x, y, z = ax - v * ux - w * vx, ay - v * uy - w * vy, az - v * uz - w * vz
    return x * x + y * y + z * z


@njit(cache=True, nogil=True)
def _to_box(px, py, pz, low, high, at):
    x = max(low[at, 0] - px, px - high[at, 0], 0.0)
    y = max(low[at, 1] - py, py - high[at, 1], 0.0)
    z = max(low[at, 2] - pz, pz - high[at, 2], 0.0)
    return x * x + y * y + z * z


@njit(cache=True, nogil=True)
def nearest(px, py, pz, triangles, boxes, guess, stack, away):
    """Index of the triangle nearest to p; ``guess`` is one that is near, ``stack`` and ``away`` (DEPTH,) are room."""
    low, high, first, last, child = boxes
    size, found, best = 1, guess, squared_distance(px, py, pz, triangles, guess)
    stack[0], away[0] = 0, 0.0
    while size > 0:
        size -= 1
        if away[size] >= best:
            continue
        at = stack[size]
        if child[at] == 0:
            for i in range(first[at], last[at]):
                d = squared_distance(px, py, pz, triangles, i)
                if d < best:
                    best, found = d, i
            continue
        near, far = child[at], child[at] + 1
        to_near, to_far = _to_box(px, py, pz, low, high, near), _to_box(px, py, pz, low, high, far)
        if to_far < to_near:
            near, far, to_near, to_far = far, near, to_far, to_near
        if to_far < best:
            stack[size], away[size] = far, to_far
            size += 1
        if to_near < best:
            stack[size], away[size] = near, to_near
            size += 1
    return found


@njit(cache=True, nogil=True)
def distances(triangles, boxes, origin, spacing, values):
    """Fills values (i, j, k) with the distance of each node to the mesh, unsigned; that of the node before is near."""
    stack, away, found, shape = np.empty(DEPTH, np.int64), np.empty(DEPTH), 0, values.shape
    for i in range(shape[0]):
        for j in range(shape[1]):
            for back in range(shape[2]):
                k = back if (i * shape[1] + j) % 2 == 0 else shape[2] - 1 - back  # to and fro, never a leap
                x, y, z = origin[0] + spacing * i, origin[1] + spacing * j, origin[2] + spacing * k
                found = nearest(x, y, z, triangles, boxes, found, stack, away)
                values[i, j, k] = np.sqrt(squared_distance(x, y, z, triangles, found))


@njit(cache=True, nogil=True)
def winding(triangles, origin, spacing, shape):
    """(i, j, k) how often the mesh winds around each node: 1 inside a sound mesh, 0 outside.

    Rays run from each node towards +x; every triangle they cross counts by the side from which they do.
    """
    steps = np.zeros((shape[0] + 1, shape[1], shape[2]), np.int32)
    for t in triangles:
        area = (t[1, 1] - t[0, 1]) * (t[2, 2] - t[0, 2]) - (t[1, 2] - t[0, 2]) * (t[2, 1] - t[0, 1])
        if area == 0.0:
            continue
        y, z = (t[:, 1] - origin[1]) / spacing, (t[:, 2] - origin[2]) / spacing
        for j in range(max(0, int(np.ceil(y.min()))), min(shape[1] - 1, int(np.floor(y.max()))) + 1):
            for k in range(max(0, int(np.ceil(z.min()))), min(shape[2] - 1, int(np.floor(z.max()))) + 1):
                a = (y[1] - j) * (z[2] - k) - (z[1] - k) * (y[2] - j)
                b = (y[2] - j) * (z[0] - k) - (z[2] - k) * (y[0] - j)
                c = (y[0] - j) * (z[1] - k) - (z[0] - k) * (y[1] - j)
                if (a >= 0.0 and b >= 0.0 and c >= 0.0) or (a <= 0.0 and b <= 0.0 and c <= 0.0):
                    x = (a * t[0, 0] + b * t[1, 0] + c * t[2, 0]) / (a + b + c)
                    last = min(shape[0], max(0, int(np.ceil((x - origin[0]) / spacing))))
                    steps[last, j, k] += 1 if area > 0.0 else -1
    found = np.zeros(shape, np.int32)
    for j in range(shape[1]):
        for k in range(shape[2]):
            total = 0
            for i in range(shape[0] - 1, -1, -1):
                total += steps[i + 1, j, k]
                found[i, j, k] = total
    return found


@njit(cache=True, nogil=True)
def _weights(t, h, value, slope, bend):
    """Weights of four coefficients of a uniform cubic B-spline at share t of a cell of h, with two derivatives."""
    u = 1.0 - t
    value[0], value[3] = u * u * u / 6.0, t * t * t / 6.0
    value[1], value[2] = (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0
    slope[0], slope[3] = -0.5 * u * u / h, 0.5 * t * t / h
    slope[1], slope[2] = (1.5 * t * t - 2.0 * t) / h, (2.0 * u - 1.5 * u * u) / h
    bend[0], bend[1], bend[2], bend[3] = u / h**2, (3.0 * t - 2.0) / h**2, (3.0 * u - 2.0) / h**2, t / h**2


@njit(cache=True, nogil=True)
def spline(points, origin, spacing, coefficients, shape):
    """Distance (n,), gradient (n, 3) and Hessian (n, 3, 3) at points (n, 3) of a cubic spline on ``shape`` nodes.

    ``coefficients`` are flat, two more along each axis than nodes. Outside the box d goes on along the tangent plane
    of the box's nearest point.
    """
    n, (_, b, c) = points.shape[0], shape
    d, g, H = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    w, cell, out = np.empty((3, 3, 4)), np.empty(3, np.int64), np.empty(3)
    for m in range(n):
        for i in range(3):
            place = (points[m, i] - origin[i]) / spacing[i]
            held = min(max(place, 0.0), shape[i] - 1.0)
            cell[i] = min(int(held), shape[i] - 2)
            out[i] = (place - held) * spacing[i]
            _weights(held - cell[i], spacing[i], w[i, 0], w[i, 1], w[i, 2])
        x, y, z = w[0], w[1], w[2]
        for i in range(4):
            for j in range(4):
                at = ((cell[0] + i) * (b + 2) + cell[1] + j) * (c + 2) + cell[2]
                f = fz = fzz = 0.0
                for k in range(4):
                    f += z[0, k] * coefficients[at + k]
                    fz += z[1, k] * coefficients[at + k]
                    fzz += z[2, k] * coefficients[at + k]
                d[m] += x[0, i] * y[0, j] * f
                g[m, 0] += x[1, i] * y[0, j] * f
                g[m, 1] += x[0, i] * y[1, j] * f
                g[m, 2] += x[0, i] * y[0, j] * fz
                H[m, 0, 0] += x[2, i] * y[0, j] * f
                H[m, 1, 1] += x[0, i] * y[2, j] * f
                H[m, 2, 2] += x[0, i] * y[0, j] * fzz
                H[m, 0, 1] += x[1, i] * y[1, j] * f
                H[m, 0, 2] += x[1, i] * y[0, j] * fz
                H[m, 1, 2] += x[0, i] * y[1, j] * fz
        for i in range(3):
            d[m] += g[m, i] * out[i]
            for j in range(i):
                H[m, i, j] = H[m, j, i]
    return d, g, H
