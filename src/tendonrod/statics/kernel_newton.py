"""Compiled Newton's method in the strains, for every kind of load and robot. Derivation: docs/method.rst.

The discrete equations are those of `kernel` (two Gauss stages a step, Magnus frames); here all stage strains are
unknown at once. Frames follow from strains by walking out, wrenches by walking back, so that a trial is always a
possible shape of the rod; the linear system is solved in one sweep from the tip, whose by-product S is the stiffness
of everything beyond a section.

Twists (v, omega) and wrenches (N, K), K = M + p x N, are taken in the world frame about the origin ``o``, the base: rigid
motion and unloaded stretches then leave them as they are.

Arrays, n steps, stage j of step k is row 2 k + j, T tendons
    grid (n+1,)         arc lengths of the nodes
    station (2n, W)     Kse[3] Kbt[3] v*[3] u*[3] | weight[3] centroid x, y, density | dead f[3] l[3] | body f[3] l[3] |
                        tube axis x, y | per tendon: X Y dX dY tau lumen
    points (b, 12)      node, F[3] M[3] offset[3] follower, unused: wrenches at nodes, 0 in the world, 1 with the body
    joints (q, 4)       node, dx, dy, angle: rigid jump of the section frame before the step that starts there
    x (2n, 6)           strains (v, u) of the stages
    start, end (n, 12)  frames (p - o, R) at both ends of the steps; frame (2n, 12) at the stages
    touch (2n+1, 12)    force on the tube's axis f[3] (N/m; N at the tip, last) and its derivative by position D[9]
    wrench (n+1, 6), inner (2n, 6)   internal wrenches at nodes (on the base's side of a point wrench) and stages
    left (2n, 6)        imbalance of the stages; hessian (2n, 6, 6)
    E (n, 3, 6, 12)     twist of stage 1, stage 2 and end by the stage strains
    Q (n, 12, 12)       factors of the step's matrix; X (n, 12, 6) strains by the twist at the step's start
    K (2n, 6, 6)        stiffness of the loads at the stages; S (n+1, 6, 6) of all beyond the node
"""

import math

from .kernel import A11, A12, A21, A22, GAUSS, magnus
from .kernel_jit import jit

WEIGHT, DENSITY, DEAD, BODY, AXIS, TENDON, TENDON_WIDTH = 12, 17, 18, 24, 30, 32, 6
ENDED = -1e300  # tension beyond a tendon's end


@jit
def cubic(row, at, step, t):
    """Value of the cubic whose four coefficients stand ``step`` apart in ``row`` from ``at``."""
    return row[at] + t * (row[at + step] + t * (row[at + 2 * step] + t * row[at + 3 * step]))


@jit
def fill(sections, tendons, spread, world, axis, s, middle, row):
    """Station ``row`` at material coordinate s, in the stretch that contains ``middle``; tensions are left alone.

    sections (m, 62), tendons (k, 16), spread (a, 15) as Robot and loads give them; axis (m, 2): tube axis by section row.
    world (10,): gravity[3] f[3] l[3] of the uniform dead loads, 1 or 0: weight acts at the mass centroid.
    """
    i = 0
    while i < sections.shape[0] - 1 and middle > sections[i, 1]:
        i += 1
    t = s - sections[i, 0]
    for q in range(12):
        row[q] = cubic(sections[i], 2 + q, 15, t)
    row[DENSITY] = cubic(sections[i], 14, 15, t)
    for q in range(3):
        row[WEIGHT + q] = row[DENSITY] * world[q]
        row[DEAD + q], row[DEAD + 3 + q] = world[3 + q], world[6 + q]
        row[BODY + q] = row[BODY + 3 + q] = 0.0
    for q in range(2):
        row[WEIGHT + 3 + q] = world[9] * cubic(sections[i], 15 + q, 15, t)
        row[AXIS + q] = axis[i, q]
    for i in range(spread.shape[0]):
        a, b = spread[i, 0], spread[i, 1]
        if a < middle < b:
            along, to = (s - a) / (b - a), BODY if spread[i, 14] != 0.0 else DEAD
            for q in range(3):
                row[to + q] += spread[i, 2 + q] + along * (spread[i, 5 + q] - spread[i, 2 + q])
                row[to + 3 + q] += spread[i, 8 + q] + along * (spread[i, 11 + q] - spread[i, 8 + q])
    for i in range(tendons.shape[0]):
        if tendons[i, 1] < middle <= tendons[i, 2]:
            t, a, w, to = s - tendons[i, 1], tendons[i, 12], tendons[i, 14], TENDON + TENDON_WIDTH * int(tendons[i, 0])
            c, d = a * math.cos(tendons[i, 13] + w * s), a * math.sin(tendons[i, 13] + w * s)
            row[to], row[to + 1] = cubic(tendons[i], 4, 1, t) + c, cubic(tendons[i], 8, 1, t) + d
            row[to + 2] = tendons[i, 5] + t * (2.0 * tendons[i, 6] + 3.0 * t * tendons[i, 7]) - w * d
            row[to + 3] = tendons[i, 9] + t * (2.0 * tendons[i, 10] + 3.0 * t * tendons[i, 11]) + w * c
            row[to + 5] = tendons[i, 15]


@jit
def place(sections, tendons, reach, tau, spread, world, axis, s_exit, grid, n, station):
    """Fill ``station`` (2n, W). reach (T,): where each tendon ends; tau (2n, T): its tension at each stage."""
    station[:, TENDON:] = 0.0
    for j in range(2 * n):
        h, at = grid[j // 2 + 1] - grid[j // 2], s_exit + grid[j // 2]
        fill(sections, tendons, spread, world, axis,
             at + (GAUSS if j % 2 == 0 else 1.0 - GAUSS) * h, at + 0.5 * h, station[j])  # fmt: skip
        for i in range(reach.shape[0]):
            station[j, TENDON + TENDON_WIDTH * i + 4] = tau[j, i] if at + 0.5 * h < reach[i] else ENDED


@jit
def solve6(H, g, z):
    """z = H^-1 g by Gauss elimination for a positive definite H (6, 6), which is spent. False where it is not."""
    for i in range(6):
        z[i] = g[i]
    for c in range(6):
        if not H[c, c] > 0.0:
            return False
        for a in range(c + 1, 6):
            w = H[a, c] / H[c, c]
            for b in range(c + 1, 6):
                H[a, b] -= w * H[c, b]
            z[a] -= w * z[c]
    for c in range(5, -1, -1):
        for b in range(c + 1, 6):
            z[c] -= H[c, b] * z[b]
        z[c] /= H[c, c]
    return True


@jit
def balance(row, tendons, length, reach, have, x, work):
    """Strains x (6,) that carry the local wrench ``have`` (6,), by damped Newton. False where there are none.

    length turns strains into displacements; reach is the largest tendon radius; work (4, 12, 12).
    """
    g, z, H = work[0, 0], work[0, 1], work[1]
    dv = du = math.inf
    for _ in range(200):
        local(row, tendons, x, g, H)
        for q in range(6):
            g[q] -= have[q]
        if not solve6(H, g, z):
            return False
        dv = math.sqrt(z[0] * z[0] + z[1] * z[1] + z[2] * z[2])
        du = math.sqrt(z[3] * z[3] + z[4] * z[4] + z[5] * z[5])
        w = min(1.0, 0.4 / max(1e-300, dv + reach * du))
        for q in range(6):
            x[q] -= w * z[q]
        if dv + length * du < 1e-13:
            return True
    return dv + length * du < 1e-9


@jit
def relax(station, tendons, length, reach, x, work):
    """Strains x (2n, 6) of the rod under its tendons alone, each stage from the one before, x[0] from what it holds."""
    have = work[3, 0]
    for q in range(6):
        have[q] = 0.0
    for j in range(x.shape[0]):
        if j > 0:
            for q in range(6):
                x[j, q] = x[j - 1, q]
        if not balance(station[j], tendons, length, reach, have, x[j], work):
            return False
    return True


@jit
def find_step(grid, n, s, k):
    """The step that contains s, searched from step k; at a node the step after it."""
    while k > 0 and s < grid[k]:
        k -= 1
    while k < n - 1 and s >= grid[k + 1]:
        k += 1
    return k


@jit
def station_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, k, s, row):
    """Station ``row`` at arc length s in step k, tensions linear through those of its stages."""
    middle = s_exit + 0.5 * (grid[k] + grid[k + 1])
    row[TENDON:] = 0.0
    fill(sections, tendons, spread, world, axis, s_exit + s, middle, row)
    here = ((s - grid[k]) / (grid[k + 1] - grid[k]) - GAUSS) / (1.0 - 2.0 * GAUSS)
    for j in range(ends.shape[0]):
        if middle < ends[j]:
            row[TENDON + TENDON_WIDTH * j + 4] = tau[2 * k, j] + here * (tau[2 * k + 1, j] - tau[2 * k, j])


@jit
def wrench_at(grid, k, s, station, frame, touch, wrench, phi1, phi2, W):
    """Internal wrench W at arc length s in step k."""
    h, T = grid[k + 1] - grid[k], s - grid[k]
    second = (0.5 * T - GAUSS * h) / (h * (1.0 - 2.0 * GAUSS))
    pressed(station[2 * k], frame[2 * k], touch[2 * k], phi1)
    pressed(station[2 * k + 1], frame[2 * k + 1], touch[2 * k + 1], phi2)
    for q in range(6):
        W[q] = wrench[k + 1, q] + (0.5 * h - T * (1.0 - second)) * phi1[q] + (0.5 * h - T * second) * phi2[q]


@jit
def cubic_weights(t):
    """Weights at t of the cubic through a step's start (0), its two stages and its end (1)."""
    c, d = GAUSS, 1.0 - GAUSS
    return (
        (t - c) * (t - d) * (t - 1.0) / (-c * d),
        t * (t - d) * (t - 1.0) / (c * (c - d) * (c - 1.0)),
        t * (t - c) * (t - 1.0) / (d * (d - c) * (d - 1.0)),
        t * (t - c) * (t - d) / ((1.0 - c) * (1.0 - d)),
    )


@jit
def edges(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, station, x, start, end, frame, touch, wrench,
          length, reach, k, row, values, loads, work):  # fmt: skip
    """Strains ``values`` (4, 6) and load densities ``loads`` (4, 6) at start, stages and end of step k. False if it fails."""
    h, good = grid[k + 1] - grid[k], True
    have, W, press = work[3, 0], work[3, 3], work[3, 4]
    slope = 1.0 / (1.0 - 2.0 * GAUSS)
    for j in range(2):
        pressed(station[2 * k + j], frame[2 * k + j], touch[2 * k + j], loads[1 + j])
        for q in range(6):
            values[1 + j, q] = x[2 * k + j, q]
    for j in range(2):
        g, s, at, c = (start[k], grid[k], 0, -GAUSS) if j == 0 else (end[k], grid[k + 1], 3, 1.0 - GAUSS)
        for q in range(3):
            press[q] = touch[2 * k, q] + c * slope * (touch[2 * k + 1, q] - touch[2 * k, q])
        station_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, k, s, row)
        pressed(row, g, press, loads[at])
        for q in range(6):
            W[q] = wrench[k + 1, q] + (0.5 * h * (loads[1, q] + loads[2, q]) if j == 0 else 0.0)
            values[at, q] = x[2 * k, q] + c * slope * (x[2 * k + 1, q] - x[2 * k, q])
        local_wrench(g, W, have)
        good = balance(row, ends.shape[0], length, reach, have, values[at], work) and good
    return good


@jit
def blend(values, t, out):
    """out (6,) = the cubic through ``values`` (4, 6) at t."""
    a, b, c, d = cubic_weights(t)
    for q in range(6):
        out[q] = a * values[0, q] + b * values[1, q] + c * values[2, q] + d * values[3, q]


@jit
def sample(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, n, station, x, start, frame, touch, wrench,
           end, length, reach, at, row, out, work):  # fmt: skip
    """Rows (p - o, R, v, u, N, M) of ``out`` (m, 24) at arc lengths ``at`` (m,); at a node, those of the step after it.

    Within a step strains and loads are cubic through its ends and stages. row (W,): a station to write to. ends (T,): where
    each tendon ends.
    """
    k, last, good = 0, -1, True
    have, W, phi, pair = work[3, 0], work[3, 3], work[3, 5], work[3, 6]
    values, loads = work[2, :4, :6], work[2, 4:8, :6]
    for i in range(at.shape[0]):
        k = find_step(grid, n, at[i], k)
        h, T = grid[k + 1] - grid[k], at[i] - grid[k]
        if k != last:
            good = edges(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, station, x, start, end, frame,
                         touch, wrench, length, reach, k, row, values, loads, work)  # fmt: skip
            last = k
        blend(values, GAUSS * T / h, pair[:6])
        blend(values, (1.0 - GAUSS) * T / h, pair[6:])
        if T > 0.0:
            magnus(start[k], 0, pair, 0, T, T, out[i], 0)
        else:
            for q in range(12):
                out[i, q] = start[k, q]
        for q in range(6):
            W[q] = wrench[k + 1, q]
        for j in range(2):  # Gauss's rule over what is left of the step
            blend(loads, (T + (GAUSS if j == 0 else 1.0 - GAUSS) * (h - T)) / h, phi[:6])
            for q in range(6):
                W[q] += 0.5 * (h - T) * phi[q]
        station_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, k, at[i], row)
        blend(values, T / h, out[i, 12:18])
        local_wrench(out[i], W, have)
        if not (good and balance(row, ends.shape[0], length, reach, have, out[i, 12:18], work)):
            out[i, 12:18] = math.nan
        p0, p1, p2 = out[i, 0], out[i, 1], out[i, 2]
        out[i, 18], out[i, 19], out[i, 20] = W[0], W[1], W[2]
        out[i, 21], out[i, 22], out[i, 23] = (
            W[3] - p1 * W[2] + p2 * W[1], W[4] - p2 * W[0] + p0 * W[2], W[5] - p0 * W[1] + p1 * W[0]
        )  # fmt: skip


@jit
def unbalanced(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, n, station, x, start, frame, touch,
               wrench, at, strains, row, frames, left, work):  # fmt: skip
    """Frames (m, 12) and imbalance ``left`` (m, 6) at arc lengths ``at`` (m,), whose strains (m, 6) are given."""
    k, flat = 0, x.reshape(-1)
    have, W = work[3, 0], work[3, 3]
    for i in range(at.shape[0]):
        k = find_step(grid, n, at[i], k)
        magnus(start[k], 0, flat, 12 * k, at[i] - grid[k], grid[k + 1] - grid[k], frames[i], 0)
        station_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, k, at[i], row)
        wrench_at(grid, k, at[i], station, frame, touch, wrench, work[3, 1], work[3, 2], W)
        local(row, ends.shape[0], strains[i], left[i], work[0])
        local_wrench(frames[i], W, have)
        for q in range(6):
            left[i, q] -= have[q]


@jit
def arm(row, at, x):
    """(X, Y, 1/|q|, t[3], free) of the tendon at row[at:] for strains x: where it lies and its unit tangent.

    A tendon that is free in the lumen lies where its path is shortest: on the screw axis of the section's motion, or on
    the wall where that axis is out of reach.
    """
    X, Y, free = row[at], row[at + 1], False
    if row[at + 5] > 0.0:
        turn = x[4] * x[4] + x[5] * x[5]
        best = (x[4] * x[2] - x[5] * x[1]) / turn if turn > 0.0 else math.inf
        low, high = row[AXIS] - row[at + 5], row[AXIS] + row[at + 5]
        free = low < best < high
        X = min(max(best, low), high)
    q0, q1, q2 = x[0] - x[5] * Y + row[at + 2], x[1] + x[5] * X + row[at + 3], x[2] + x[3] * Y - x[4] * X
    q = 1.0 / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2)
    return X, Y, q, q0 * q, q1 * q, q2 * q, free


@jit
def strands(station, tendons, grid, x, q, pull):
    """Of each tendon at each stage: q (2n, T, 3), pull (2n, T, 6) = (t, r x t); zero beyond its end. Returns nothing."""
    for j in range(x.shape[0]):
        for i in range(tendons):
            at = TENDON + TENDON_WIDTH * i
            if station[j, at + 4] == ENDED:
                q[j, i, :] = 0.0
                pull[j, i, :] = 0.0
                continue
            X, Y, w, t0, t1, t2, _ = arm(station[j], at, x[j])
            q[j, i, 0], q[j, i, 1], q[j, i, 2] = t0 / w, t1 / w, t2 / w
            pull[j, i, 0], pull[j, i, 1], pull[j, i, 2] = t0, t1, t2
            pull[j, i, 3], pull[j, i, 4], pull[j, i, 5] = Y * t2, -X * t2, X * t1 - Y * t0


@jit
def local(row, tendons, x, g, H):
    """Energy density; its gradient g (6,) and Hessian H (6, 6) in the strains x (6,): rod and tendons."""
    energy = 0.0
    for i in range(6):
        e = x[i] - row[6 + i]
        g[i] = row[i] * e
        energy += 0.5 * row[i] * e * e
        for j in range(6):
            H[i, j] = 0.0
        H[i, i] = row[i]
    for i in range(tendons):
        at = TENDON + TENDON_WIDTH * i
        tau = row[at + 4]
        if not tau > 0.0:
            continue
        X, Y, q, t0, t1, t2, free = arm(row, at, x)
        energy += tau / q
        g[0], g[1], g[2] = g[0] + tau * t0, g[1] + tau * t1, g[2] + tau * t2
        g[3], g[4], g[5] = g[3] + tau * Y * t2, g[4] - tau * X * t2, g[5] + tau * (X * t1 - Y * t0)
        k = tau * q
        k00, k01, k02 = k * (1.0 - t0 * t0), -k * t0 * t1, -k * t0 * t2
        k11, k12, k22 = k * (1.0 - t1 * t1), -k * t1 * t2, k * (1.0 - t2 * t2)
        e02, e12, e22 = X * k01 - Y * k00, X * k11 - Y * k01, X * k12 - Y * k02
        H[0, 0], H[0, 1], H[0, 2] = H[0, 0] + k00, H[0, 1] + k01, H[0, 2] + k02
        H[1, 1], H[1, 2], H[2, 2] = H[1, 1] + k11, H[1, 2] + k12, H[2, 2] + k22
        H[0, 3], H[1, 3], H[2, 3] = H[0, 3] + Y * k02, H[1, 3] + Y * k12, H[2, 3] + Y * k22
        H[0, 4], H[1, 4], H[2, 4] = H[0, 4] - X * k02, H[1, 4] - X * k12, H[2, 4] - X * k22
        H[0, 5], H[1, 5], H[2, 5] = H[0, 5] + e02, H[1, 5] + e12, H[2, 5] + e22
        H[3, 3], H[3, 4], H[3, 5] = H[3, 3] + Y * Y * k22, H[3, 4] - X * Y * k22, H[3, 5] + Y * e22
        H[4, 4], H[4, 5], H[5, 5] = H[4, 4] + X * X * k22, H[4, 5] - X * e22, H[5, 5] + X * e12 - Y * e02
        if free:  # the tendon gives way: minus the coupling with its position, which |q| has at its minimum
            d1, d2 = x[5] * q, -x[4] * q  # dt/dX = (0, d1, d2)
            c1, c2, c3, c4, c5 = d1, d2, Y * d2, -t2 - X * d2, t1 + X * d1
            w = tau / (q * (x[4] * x[4] + x[5] * x[5]))
            c0 = 0.0
            for a, ca in ((0, c0), (1, c1), (2, c2), (3, c3), (4, c4), (5, c5)):
                for b, cb in ((0, c0), (1, c1), (2, c2), (3, c3), (4, c4), (5, c5)):
                    if b >= a:
                        H[a, b] -= w * ca * cb
    for i in range(6):
        for j in range(i):
            H[i, j] = H[j, i]
    return energy


@jit
def walk_out(grid, n, joints, x, start, end, frame):
    """Frames from strains; start[0] is given."""
    joint = 0
    flat = x.reshape(-1)
    for k in range(n):
        h = grid[k + 1] - grid[k]
        if k > 0:
            for q in range(12):
                start[k, q] = end[k - 1, q]
        while joint < joints.shape[0] and joints[joint, 0] < k:
            joint += 1
        if joint < joints.shape[0] and joints[joint, 0] == k:
            c, d = math.cos(joints[joint, 3]), math.sin(joints[joint, 3])
            for i in range(3):
                a, b = start[k, 3 + 3 * i], start[k, 4 + 3 * i]
                start[k, i] += a * joints[joint, 1] + b * joints[joint, 2]
                start[k, 3 + 3 * i], start[k, 4 + 3 * i] = a * c + b * d, b * c - a * d
        magnus(start[k], 0, flat, 12 * k, GAUSS * h, h, frame[2 * k], 0)
        magnus(start[k], 0, flat, 12 * k, (1.0 - GAUSS) * h, h, frame[2 * k + 1], 0)
        magnus(start[k], 0, flat, 12 * k, h, h, end[k], 0)


@jit
def act(f0, f1, f2, c0, c1, c2, out):
    """Add to the wrench ``out`` the force f at the point c."""
    out[0], out[1], out[2] = out[0] + f0, out[1] + f1, out[2] + f2
    out[3], out[4], out[5] = out[3] + c1 * f2 - c2 * f1, out[4] + c2 * f0 - c0 * f2, out[5] + c0 * f1 - c1 * f0


@jit
def turned(R, a0, a1, a2):
    """R a, for a frame (p, R)."""
    return (
        R[3] * a0 + R[4] * a1 + R[5] * a2, R[6] * a0 + R[7] * a1 + R[8] * a2, R[9] * a0 + R[10] * a1 + R[11] * a2
    )  # fmt: skip


@jit
def pressed(row, frame, touch, phi):
    """Wrench density phi (6,) of all loads at a stage. Returns their potential, apart from moments and followers."""
    phi[:] = 0.0
    p0, p1, p2 = frame[0], frame[1], frame[2]
    act(row[DEAD], row[DEAD + 1], row[DEAD + 2], p0, p1, p2, phi)
    a0, a1, a2 = turned(frame, row[WEIGHT + 3], row[WEIGHT + 4], 0.0)
    act(row[WEIGHT], row[WEIGHT + 1], row[WEIGHT + 2], p0 + a0, p1 + a1, p2 + a2, phi)
    potential = -(row[DEAD] * p0 + row[DEAD + 1] * p1 + row[DEAD + 2] * p2)
    potential -= row[WEIGHT] * (p0 + a0) + row[WEIGHT + 1] * (p1 + a1) + row[WEIGHT + 2] * (p2 + a2)
    b0, b1, b2 = turned(frame, row[BODY], row[BODY + 1], row[BODY + 2])
    act(b0, b1, b2, p0, p1, p2, phi)
    c0, c1, c2 = turned(frame, row[AXIS], row[AXIS + 1], 0.0)
    act(touch[0], touch[1], touch[2], p0 + c0, p1 + c1, p2 + c2, phi)
    b0, b1, b2 = turned(frame, row[BODY + 3], row[BODY + 4], row[BODY + 5])
    phi[3] += row[DEAD + 3] + b0
    phi[4] += row[DEAD + 4] + b1
    phi[5] += row[DEAD + 5] + b2
    return potential


@jit
def point_wrench(point, frame, phi):
    """Wrench phi (6,) of a point load at a node's frame. Returns its potential as `pressed` does."""
    phi[:] = 0.0
    c0, c1, c2 = turned(frame, point[7], point[8], point[9])
    c0, c1, c2 = c0 + frame[0], c1 + frame[1], c2 + frame[2]
    if point[10] != 0.0:
        f0, f1, f2 = turned(frame, point[1], point[2], point[3])
        m0, m1, m2 = turned(frame, point[4], point[5], point[6])
        act(f0, f1, f2, c0, c1, c2, phi)
        phi[3], phi[4], phi[5] = phi[3] + m0, phi[4] + m1, phi[5] + m2
        return 0.0
    act(point[1], point[2], point[3], c0, c1, c2, phi)
    phi[3], phi[4], phi[5] = phi[3] + point[4], phi[4] + point[5], phi[5] + point[6]
    return -(point[1] * c0 + point[2] * c1 + point[3] * c2)


@jit
def local_wrench(frame, W, out):
    """(n, m) = Ad' W, the wrench W in the local frame."""
    p0, p1, p2 = frame[0], frame[1], frame[2]
    m0, m1, m2 = W[3] - p1 * W[2] + p2 * W[1], W[4] - p2 * W[0] + p0 * W[2], W[5] - p0 * W[1] + p1 * W[0]
    for i in range(3):
        out[i] = frame[3 + i] * W[0] + frame[6 + i] * W[1] + frame[9 + i] * W[2]
        out[3 + i] = frame[3 + i] * m0 + frame[6 + i] * m1 + frame[9 + i] * m2


@jit
def walk_back(grid, n, station, tendons, points, x, end, frame, touch, wrench, inner, left, hessian, scratch):
    """Wrenches from the tip to the base, the imbalance left over at each stage, and the potential energy.

    ``points`` are sorted by node, at most one walk from last to first; scratch (24,).
    """
    phi1, phi2, have = scratch[0:6], scratch[6:12], scratch[12:18]
    energy, point = 0.0, points.shape[0] - 1
    wrench[n, :] = 0.0
    a0, a1, a2 = turned(end[n - 1], station[2 * n - 1, AXIS], station[2 * n - 1, AXIS + 1], 0.0)
    a0, a1, a2 = a0 + end[n - 1, 0], a1 + end[n - 1, 1], a2 + end[n - 1, 2]
    act(touch[2 * n, 0], touch[2 * n, 1], touch[2 * n, 2], a0, a1, a2, wrench[n])
    for k in range(n - 1, -1, -1):
        h = grid[k + 1] - grid[k]
        while point >= 0 and points[point, 0] == k + 1:
            energy += point_wrench(points[point], end[k], phi1)
            for q in range(6):
                wrench[k + 1, q] += phi1[q]
            point -= 1
        one, two = 2 * k, 2 * k + 1
        energy += 0.5 * h * pressed(station[one], frame[one], touch[one], phi1)
        energy += 0.5 * h * pressed(station[two], frame[two], touch[two], phi2)
        for q in range(6):
            inner[one, q] = wrench[k + 1, q] + h * ((0.5 - A11) * phi1[q] + (0.5 - A12) * phi2[q])
            inner[two, q] = wrench[k + 1, q] + h * ((0.5 - A21) * phi1[q] + (0.5 - A22) * phi2[q])
            wrench[k, q] = wrench[k + 1, q] + 0.5 * h * (phi1[q] + phi2[q])
        for j in range(one, two + 1):
            energy += 0.5 * h * local(station[j], tendons, x[j], left[j], hessian[j])
            local_wrench(frame[j], inner[j], have)
            for q in range(6):
                left[j, q] -= have[q]
    return energy


@jit
def add_push(frame_p0, frame_p1, frame_p2, f, at, D, d, K):
    """Add to K (6, 6) the stiffness of a force f[at:at+3] at the point c, with the derivative D[d:d+9] by position."""
    c0, c1, c2 = frame_p0, frame_p1, frame_p2
    f0, f1, f2 = f[at], f[at + 1], f[at + 2]
    for i in range(6):  # rows of [D; c^ D - f^]
        if i < 3:
            a0, a1, a2 = D[d + 3 * i], D[d + 3 * i + 1], D[d + 3 * i + 2]
        elif i == 3:
            a0, a1, a2 = c1 * D[d + 6] - c2 * D[d + 3], c1 * D[d + 7] - c2 * D[d + 4], c1 * D[d + 8] - c2 * D[d + 5]
            a1, a2 = a1 + f2, a2 - f1
        elif i == 4:
            a0, a1, a2 = c2 * D[d] - c0 * D[d + 6], c2 * D[d + 1] - c0 * D[d + 7], c2 * D[d + 2] - c0 * D[d + 8]
            a0, a2 = a0 - f2, a2 + f0
        else:
            a0, a1, a2 = c0 * D[d + 3] - c1 * D[d], c0 * D[d + 4] - c1 * D[d + 1], c0 * D[d + 5] - c1 * D[d + 2]
            a0, a1 = a0 + f1, a1 - f0
        K[i, 0], K[i, 1], K[i, 2] = K[i, 0] + a0, K[i, 1] + a1, K[i, 2] + a2
        K[i, 3] += c1 * a2 - c2 * a1  # -(row) c^ = c x row
        K[i, 4] += c2 * a0 - c0 * a2
        K[i, 5] += c0 * a1 - c1 * a0


@jit
def add_convected(W, sign, K):
    """Add sign * [[0, N^], [N^, K^]] to K (6, 6): how a wrench at rest changes in the eyes of a moving section."""
    for a in range(0, 4, 3):
        b, o = 3 - a, 0
        K[a, b + 1] -= sign * W[o + 2]
        K[a, b + 2] += sign * W[o + 1]
        K[a + 1, b] += sign * W[o + 2]
        K[a + 1, b + 2] -= sign * W[o]
        K[a + 2, b] -= sign * W[o + 1]
        K[a + 2, b + 1] += sign * W[o]
    K[3, 4] -= sign * W[5]
    K[3, 5] += sign * W[4]
    K[4, 3] += sign * W[5]
    K[4, 5] -= sign * W[3]
    K[5, 3] -= sign * W[4]
    K[5, 4] += sign * W[3]


@jit
def load_stiffness(row, frame, touch, zero, K, phi):
    """K (6, 6): change of a stage's wrench density with the twist of its section."""
    K[:, :] = 0.0
    add_push(frame[0], frame[1], frame[2], row, DEAD, zero, 0, K)
    a0, a1, a2 = turned(frame, row[WEIGHT + 3], row[WEIGHT + 4], 0.0)
    add_push(frame[0] + a0, frame[1] + a1, frame[2] + a2, row, WEIGHT, zero, 0, K)
    a0, a1, a2 = turned(frame, row[AXIS], row[AXIS + 1], 0.0)
    add_push(frame[0] + a0, frame[1] + a1, frame[2] + a2, touch, 0, touch, 3, K)
    phi[:] = 0.0
    f0, f1, f2 = turned(frame, row[BODY], row[BODY + 1], row[BODY + 2])
    act(f0, f1, f2, frame[0], frame[1], frame[2], phi)
    f0, f1, f2 = turned(frame, row[BODY + 3], row[BODY + 4], row[BODY + 5])
    phi[3], phi[4], phi[5] = phi[3] + f0, phi[4] + f1, phi[5] + f2
    add_convected(phi, -1.0, K)


@jit
def spread_twist(start, x, k, T, h, E):
    """E (6, 12): twist at T of the step from ``start``, by its two stage strains x[k], x[k+1]."""
    w = 1.0 / (h * (1.0 - 2.0 * GAUSS))
    second = w * (0.5 * T - GAUSS * h)
    c3 = T * T * T * w / 12.0
    v0, v1, v2, u0, u1, u2 = x[k, 0], x[k, 1], x[k, 2], x[k, 3], x[k, 4], x[k, 5]
    y0, y1, y2, z0, z1, z2 = x[k + 1, 0], x[k + 1, 1], x[k + 1, 2], x[k + 1, 3], x[k + 1, 4], x[k + 1, 5]
    a0 = T * (v0 + second * (y0 - v0)) + c3 * (u1 * y2 - u2 * y1 - z1 * v2 + z2 * v1)
    a1 = T * (v1 + second * (y1 - v1)) + c3 * (u2 * y0 - u0 * y2 - z2 * v0 + z0 * v2)
    a2 = T * (v2 + second * (y2 - v2)) + c3 * (u0 * y1 - u1 * y0 - z0 * v1 + z1 * v0)
    b0 = T * (u0 + second * (z0 - u0)) + c3 * (u1 * z2 - u2 * z1)
    b1 = T * (u1 + second * (z1 - u1)) + c3 * (u2 * z0 - u0 * z2)
    b2 = T * (u2 + second * (z2 - u2)) + c3 * (u0 * z1 - u1 * z0)
    q = b0 * b0 + b1 * b1 + b2 * b2
    if q < 1e-2:
        b = 0.5 - q / 24.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0)))
        c = 1.0 / 6.0 - q / 120.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0)))
        bq = -1.0 / 24.0 + q / 360.0 * (1.0 - 3.0 * q / 112.0 * (1.0 - 4.0 * q / 270.0))
        cq = -1.0 / 120.0 + q / 2520.0 * (1.0 - q / 48.0 * (1.0 - 4.0 * q / 330.0))
    else:
        size = math.sqrt(q)
        half = math.sin(0.5 * size) / size
        b = 2.0 * half * half
        c = (1.0 - math.sin(size) / size) / q
        bq = (math.sin(size) / size - 2.0 * b) / (2.0 * q)
        cq = (b - 3.0 * c) / (2.0 * q)
    dot = 2.0 * (a0 * b0 + a1 * b1 + a2 * b2)
    p0, p1, p2 = start[0], start[1], start[2]
    for i in range(3):
        r0, r1, r2 = start[3 + 3 * i], start[4 + 3 * i], start[5 + 3 * i]
        along, across = r0 * b0 + r1 * b1 + r2 * b2, r0 * a0 + r1 * a1 + r2 * a2
        n0, n1, n2 = r1 * b2 - r2 * b1, r2 * b0 - r0 * b2, r0 * b1 - r1 * b0  # row i of R b^
        m0, m1, m2 = r1 * a2 - r2 * a1, r2 * a0 - r0 * a2, r0 * a1 - r1 * a0
        one = 1.0 - c * q
        A0, A1 = one * r0 + b * n0 + c * along * b0, one * r1 + b * n1 + c * along * b1
        A2 = one * r2 + b * n2 + c * along * b2
        s = -dot * (cq * q + c)
        t = dot * cq * along + c * across
        B0 = s * r0 + dot * bq * n0 + t * b0 + b * m0 + c * along * a0
        B1 = s * r1 + dot * bq * n1 + t * b1 + b * m1 + c * along * a1
        B2 = s * r2 + dot * bq * n2 + t * b2 + b * m2 + c * along * a2
        E[3 + i, 0], E[3 + i, 1], E[3 + i, 2] = A0, A1, A2
        E[i, 3], E[i, 4], E[i, 5] = B0, B1, B2
    for j in range(3):  # B += p^ A
        A0, A1, A2 = E[3, j], E[4, j], E[5, j]
        E[0, 3 + j] += p1 * A2 - p2 * A1
        E[1, 3 + j] += p2 * A0 - p0 * A2
        E[2, 3 + j] += p0 * A1 - p1 * A0
    first = T * (1.0 - second)
    second = T * second
    for i in range(3):
        A0, A1, A2, B0, B1, B2 = E[3 + i, 0], E[3 + i, 1], E[3 + i, 2], E[i, 3], E[i, 4], E[i, 5]
        for j in range(2):  # [A B] [[p, q], [0, p]] with p = f 1 + g ad(u), q = g ad(v)
            if j == 0:
                f, g0, g1, g2, e0, e1, e2 = first, -c3 * z0, -c3 * z1, -c3 * z2, -c3 * y0, -c3 * y1, -c3 * y2
            else:
                f, g0, g1, g2, e0, e1, e2 = second, c3 * u0, c3 * u1, c3 * u2, c3 * v0, c3 * v1, c3 * v2
            o = 6 * j
            C0 = f * A0 + A1 * g2 - A2 * g1
            C1 = f * A1 + A2 * g0 - A0 * g2
            C2 = f * A2 + A0 * g1 - A1 * g0
            E[i, o], E[i, o + 1], E[i, o + 2] = C0, C1, C2
            E[3 + i, o], E[3 + i, o + 1], E[3 + i, o + 2] = 0.0, 0.0, 0.0
            E[3 + i, o + 3], E[3 + i, o + 4], E[3 + i, o + 5] = C0, C1, C2
            E[i, o + 3] = f * B0 + B1 * g2 - B2 * g1 + A1 * e2 - A2 * e1
            E[i, o + 4] = f * B1 + B2 * g0 - B0 * g2 + A2 * e0 - A0 * e2
            E[i, o + 5] = f * B2 + B0 * g1 - B1 * g0 + A0 * e1 - A1 * e0


@jit
def times_spread(A, E, out):
    """out (6, 12) = A (6, 6) E (6, 12), where E's rotations do not depend on v."""
    for a in range(6):
        for o in range(0, 12, 6):
            for b in range(o, o + 3):
                out[a, b] = A[a, 0] * E[0, b] + A[a, 1] * E[1, b] + A[a, 2] * E[2, b]
            for b in range(o + 3, o + 6):
                out[a, b] = (A[a, 0] * E[0, b] + A[a, 1] * E[1, b] + A[a, 2] * E[2, b]
                             + A[a, 3] * E[3, b] + A[a, 4] * E[4, b] + A[a, 5] * E[5, b])  # fmt: skip


@jit
def factor(grid, n, station, points, x, start, end, frame, touch, inner, hessian, E, Q, X, K, S, work):
    """Factors of the linearised rod, and the number of negative pivots: 0 where the energy's Hessian is positive.

    work (4, 12, 12).
    """
    zero, phi, D, F, G = work[0, 0], work[0, 1], work[1, :6], work[1, 6:], work[2:].reshape(4, 6, 12)
    negative, point = 0, points.shape[0] - 1
    zero[:] = 0.0
    S[n, :, :] = 0.0
    a0, a1, a2 = turned(end[n - 1], station[2 * n - 1, AXIS], station[2 * n - 1, AXIS + 1], 0.0)
    add_push(end[n - 1, 0] + a0, end[n - 1, 1] + a1, end[n - 1, 2] + a2, touch[2 * n], 0, touch[2 * n], 3, S[n])
    for k in range(n - 1, -1, -1):
        h = grid[k + 1] - grid[k]
        Z = S[k + 1]
        while point >= 0 and points[point, 0] == k + 1:
            point_wrench(points[point], end[k], phi)
            if points[point, 10] != 0.0:
                add_convected(phi, -1.0, Z)
            else:
                a0, a1, a2 = turned(end[k], points[point, 7], points[point, 8], points[point, 9])
                add_push(end[k, 0] + a0, end[k, 1] + a1, end[k, 2] + a2, points[point], 1, zero, 0, Z)
            point -= 1
        for j in range(2):
            load_stiffness(station[2 * k + j], frame[2 * k + j], touch[2 * k + j], zero, K[2 * k + j], phi)
            spread_twist(start[k], x, 2 * k, (GAUSS if j == 0 else 1.0 - GAUSS) * h, h, E[k, j])
        spread_twist(start[k], x, 2 * k, h, h, E[k, 2])
        times_spread(Z, E[k, 2], G[0])
        times_spread(K[2 * k], E[k, 0], G[1])
        times_spread(K[2 * k + 1], E[k, 1], G[2])
        for j in range(2):  # F (6, 12) and D (6, 6): wrench at the stage by stage strains and by the twist at the start
            w1, w2 = h * (0.5 - (A11 if j == 0 else A21)), h * (0.5 - (A12 if j == 0 else A22))
            for a in range(6):
                for b in range(6):
                    D[a, b] = Z[a, b] + w1 * K[2 * k, a, b] + w2 * K[2 * k + 1, a, b]
                for b in range(12):
                    F[a, b] = G[0, a, b] + w1 * G[1, a, b] + w2 * G[2, a, b]
            W = inner[2 * k + j]
            add_convected(W, 1.0, D)
            for b in range(12):
                e0, e1, e2 = E[k, j, 0, b], E[k, j, 1, b], E[k, j, 2, b]
                e3, e4, e5 = E[k, j, 3, b], E[k, j, 4, b], E[k, j, 5, b]
                F[0, b] += W[1] * e5 - W[2] * e4
                F[1, b] += W[2] * e3 - W[0] * e5
                F[2, b] += W[0] * e4 - W[1] * e3
                F[3, b] += W[1] * e2 - W[2] * e1 + W[4] * e5 - W[5] * e4
                F[4, b] += W[2] * e0 - W[0] * e2 + W[5] * e3 - W[3] * e5
                F[5, b] += W[0] * e1 - W[1] * e0 + W[3] * e4 - W[4] * e3
            f, o = frame[2 * k + j], 6 * j
            for b in range(12):  # rows of the step's matrix: hessian - Ad' F
                N0, N1, N2 = F[0, b], F[1, b], F[2, b]
                m0, m1 = F[3, b] - f[1] * N2 + f[2] * N1, F[4, b] - f[2] * N0 + f[0] * N2
                m2 = F[5, b] - f[0] * N1 + f[1] * N0
                for i in range(3):
                    Q[k, o + i, b] = -(f[3 + i] * N0 + f[6 + i] * N1 + f[9 + i] * N2)
                    Q[k, o + 3 + i, b] = -(f[3 + i] * m0 + f[6 + i] * m1 + f[9 + i] * m2)
            for b in range(6):
                N0, N1, N2 = D[0, b], D[1, b], D[2, b]
                m0, m1 = D[3, b] - f[1] * N2 + f[2] * N1, D[4, b] - f[2] * N0 + f[0] * N2
                m2 = D[5, b] - f[0] * N1 + f[1] * N0
                for i in range(3):
                    X[k, o + i, b] = f[3 + i] * N0 + f[6 + i] * N1 + f[9 + i] * N2
                    X[k, o + 3 + i, b] = f[3 + i] * m0 + f[6 + i] * m1 + f[9 + i] * m2
                for i in range(6):
                    Q[k, o + i, o + b] += hessian[2 * k + j, i, b]
        for c in range(12):  # elimination without exchange: the pivots' signs are the energy's
            pivot = Q[k, c, c]
            if pivot < 0.0:
                negative += 1
            for a in range(c + 1, 12):
                w = Q[k, a, c] / pivot
                Q[k, a, c] = w
                for b in range(c + 1, 12):
                    Q[k, a, b] -= w * Q[k, c, b]
                for b in range(6):
                    X[k, a, b] -= w * X[k, c, b]
        for c in range(11, -1, -1):
            w = 1.0 / Q[k, c, c]
            for b in range(6):
                X[k, c, b] *= w
            for a in range(c):
                q = Q[k, a, c]
                for b in range(6):
                    X[k, a, b] -= q * X[k, c, b]
        for a in range(6):  # S = Z (1 + E X) + h/2 sum K (1 + E X)
            for b in range(6):
                S[k, a, b] = Z[a, b] + 0.5 * h * (K[2 * k, a, b] + K[2 * k + 1, a, b])
            for c in range(12):
                w = G[0, a, c] + 0.5 * h * (G[1, a, c] + G[2, a, c])
                for b in range(6):
                    S[k, a, b] += w * X[k, c, b]
    return negative


@jit
def respond(grid, n, frame, E, Q, X, K, S, inner, stage_left, stage_twist, stage_load, node_load, base, strain, twist,
            push, y, work):  # fmt: skip
    """Answer of the linearised rod to forcing: stage strains ``strain`` (2n, 6) and node twists ``twist`` (n+1, 6).

    push (n+1, 6): the internal wrench at a node answers S twist + push.

    stage_left (2n, 6): imbalance to be removed, gradient minus wrench. stage_twist (n, 3, 6): twist of stages and end at
    fixed strains, relative to the step's start; stage_load (2n, 6): wrench density at fixed frames; node_load (n+1, 6):
    point wrenches at fixed frames; base (6,): twist of the base. y (n, 12), work (4, 12, 12).
    """
    s, t, e, z = work[0, 0], work[0, 1], work[0, 2], work[0, 3]
    for q in range(6):
        s[q] = 0.0
    for k in range(n - 1, -1, -1):
        h = grid[k + 1] - grid[k]
        for q in range(6):
            s[q] += node_load[k + 1, q]
            push[k + 1, q] = s[q]
        for a in range(6):
            z[a] = s[a]
            for b in range(6):
                z[a] += S[k + 1, a, b] * stage_twist[k, 2, b]
        for i in range(2):  # load densities: K e + phi
            for a in range(6):
                w = stage_load[2 * k + i, a]
                for b in range(6):
                    w += K[2 * k + i, a, b] * stage_twist[k, i, b]
                work[1, i, a] = w
        for j in range(2):
            w1, w2 = h * (0.5 - (A11 if j == 0 else A21)), h * (0.5 - (A12 if j == 0 else A22))
            W, e_j = inner[2 * k + j], stage_twist[k, j]
            for a in range(6):
                t[a] = z[a] + w1 * work[1, 0, a] + w2 * work[1, 1, a]
            t[0] += W[1] * e_j[5] - W[2] * e_j[4]
            t[1] += W[2] * e_j[3] - W[0] * e_j[5]
            t[2] += W[0] * e_j[4] - W[1] * e_j[3]
            t[3] += W[1] * e_j[2] - W[2] * e_j[1] + W[4] * e_j[5] - W[5] * e_j[4]
            t[4] += W[2] * e_j[0] - W[0] * e_j[2] + W[5] * e_j[3] - W[3] * e_j[5]
            t[5] += W[0] * e_j[1] - W[1] * e_j[0] + W[3] * e_j[4] - W[4] * e_j[3]
            local_wrench(frame[2 * k + j], t, e)
            for a in range(6):
                y[k, 6 * j + a] = e[a] - stage_left[2 * k + j, a]
        for c in range(12):
            for a in range(c + 1, 12):
                y[k, a] -= Q[k, a, c] * y[k, c]
        for c in range(11, -1, -1):
            y[k, c] /= Q[k, c, c]
            for a in range(c):
                y[k, a] -= Q[k, a, c] * y[k, c]
        for a in range(6):
            e[a] = 0.0
            for c in range(12):
                e[a] += E[k, 2, a, c] * y[k, c]
        for a in range(6):
            for b in range(6):
                z[a] += S[k + 1, a, b] * e[b]
        for i in range(2):
            for a in range(6):
                e[a] = 0.0
                for c in range(12):
                    e[a] += E[k, i, a, c] * y[k, c]
            for a in range(6):
                w = work[1, i, a]
                for b in range(6):
                    w += K[2 * k + i, a, b] * e[b]
                z[a] += 0.5 * h * w
        for a in range(6):
            s[a] = z[a]
    for q in range(6):
        twist[0, q], push[0, q] = base[q], s[q]
    for k in range(n):
        for a in range(12):
            w = y[k, a]
            for b in range(6):
                w += X[k, a, b] * twist[k, b]
            strain[2 * k + a // 6, a % 6] = w
        for a in range(6):
            w = twist[k, a] + stage_twist[k, 2, a]
            for c in range(12):
                w += E[k, 2, a, c] * strain[2 * k + c // 6, c % 6]
            twist[k + 1, a] = w


@jit
def response_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, n, station, x, start, frame, touch,
                wrench, E, K, S, strain, twist, push, stage_load, at, strains, left, row, moved, strained,
                work):  # fmt: skip
    """What `respond` found, at arc lengths ``at`` (m,): twists ``moved`` (m, 6) and strains ``strained`` (m, 6).

    strains (m, 6): those of the solution there; left (m, 6): explicit change of the imbalance there, but for that of the
    stages' loads, which are given as in `respond`.
    """
    k, flat = 0, x.reshape(-1)
    here, W, dW, theta, z, have = work[3, 0], work[3, 3], work[3, 4], work[3, 5], work[3, 6], work[3, 7]
    spread_by = work[2, :6]
    for i in range(at.shape[0]):
        k = find_step(grid, n, at[i], k)
        h, T = grid[k + 1] - grid[k], at[i] - grid[k]
        second = (0.5 * T - GAUSS * h) / (h * (1.0 - 2.0 * GAUSS))
        spread_twist(start[k], x, 2 * k, T, h, spread_by)
        for a in range(6):
            theta[a], dW[a] = twist[k, a], push[k + 1, a]
            for b in range(12):
                theta[a] += spread_by[a, b] * strain[2 * k + b // 6, b % 6]
            for b in range(6):
                dW[a] += S[k + 1, a, b] * twist[k + 1, b]
            moved[i, a] = theta[a]
        for j in range(2):
            w = 0.5 * h - T * ((1.0 - second) if j == 0 else second)
            for a in range(6):
                z[a] = twist[k, a]
                for b in range(12):
                    z[a] += E[k, j, a, b] * strain[2 * k + b // 6, b % 6]
            for a in range(6):
                dW[a] += w * stage_load[2 * k + j, a]
                for b in range(6):
                    dW[a] += w * K[2 * k + j, a, b] * z[b]
        magnus(start[k], 0, flat, 12 * k, T, h, here, 0)
        station_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, k, at[i], row)
        wrench_at(grid, k, at[i], station, frame, touch, wrench, work[3, 1], work[3, 2], W)
        dW[0] += W[1] * theta[5] - W[2] * theta[4]
        dW[1] += W[2] * theta[3] - W[0] * theta[5]
        dW[2] += W[0] * theta[4] - W[1] * theta[3]
        dW[3] += W[1] * theta[2] - W[2] * theta[1] + W[4] * theta[5] - W[5] * theta[4]
        dW[4] += W[2] * theta[0] - W[0] * theta[2] + W[5] * theta[3] - W[3] * theta[5]
        dW[5] += W[0] * theta[1] - W[1] * theta[0] + W[3] * theta[4] - W[4] * theta[3]
        local_wrench(here, dW, have)
        for a in range(6):
            have[a] -= left[i, a]
        local(row, ends.shape[0], strains[i], z, work[0])
        if not solve6(work[0], have, strained[i]):
            strained[i, :] = math.nan


@jit
def columns(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, n, station, x, start, frame, touch, wrench,
            E, Q, X, K, S, inner, end, points, share, changes, at, strains, no_twist, stage_left, stage_load, node_load,
            q, pull, strain, twist, push, y, row, left, moved, strained, out, work):  # fmt: skip
    """Answers ``out`` (c, m, 12), twists and strains at ``at`` (m,), to inputs that the imbalance is linear in.

    changes (c, T + 21): of the tensions[T], gravity[3], f[3] and l[3] of the uniform dead loads, tip force[3] and moment[3]
    on the neutral axis, twist[6] of the base. The arrays from ``no_twist`` (zeros) to ``strained`` are scratch.
    """
    T = ends.shape[0]
    strands(station, T, grid, x, q, pull)
    for c in range(changes.shape[0]):
        change = changes[c]
        g0, g1, g2, f0, f1, f2 = change[T], change[T + 1], change[T + 2], change[T + 3], change[T + 4], change[T + 5]
        for j in range(2 * n):
            for a in range(6):
                stage_left[j, a], stage_load[j, a] = 0.0, 0.0
                for i in range(T):
                    stage_left[j, a] += change[i] * share[j, i] * pull[j, i, a]
            w, F, load = station[j, DENSITY], frame[j], stage_load[j]
            a0, a1, a2 = turned(F, station[j, WEIGHT + 3], station[j, WEIGHT + 4], 0.0)
            act(w * g0, w * g1, w * g2, F[0] + a0, F[1] + a1, F[2] + a2, load)
            act(f0, f1, f2, F[0], F[1], F[2], load)
            for a in range(3):
                load[3 + a] += change[T + 6 + a]
        node_load[:] = 0.0
        for i in range(points.shape[0]):
            k, w = int(points[i, 0]), points[i, 11]
            if w != 0.0:
                a0, a1, a2 = turned(end[k - 1], points[i, 7], points[i, 8], points[i, 9])
                act(w * g0, w * g1, w * g2, end[k - 1, 0] + a0, end[k - 1, 1] + a1, end[k - 1, 2] + a2, node_load[k])
        act(change[T + 9], change[T + 10], change[T + 11], end[n - 1, 0], end[n - 1, 1], end[n - 1, 2], node_load[n])
        for a in range(3):
            node_load[n, 3 + a] += change[T + 12 + a]
        respond(grid, n, frame, E, Q, X, K, S, inner, stage_left, no_twist, stage_load, node_load, change[T + 15 :],
                strain, twist, push, y, work)  # fmt: skip
        k = 0
        for i in range(at.shape[0]):
            left[i, :] = 0.0
            k = find_step(grid, n, at[i], k)
            station_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, k, at[i], row)
            here = ((at[i] - grid[k]) / (grid[k + 1] - grid[k]) - GAUSS) / (1.0 - 2.0 * GAUSS)
            for t in range(T):
                if change[t] != 0.0 and s_exit + 0.5 * (grid[k] + grid[k + 1]) < ends[t]:
                    w = change[t] * (share[2 * k, t] + here * (share[2 * k + 1, t] - share[2 * k, t]))
                    Y, Z, _, t0, t1, t2, _ = arm(row, TENDON + TENDON_WIDTH * t, strains[i])
                    left[i, 0], left[i, 1], left[i, 2] = left[i, 0] + w * t0, left[i, 1] + w * t1, left[i, 2] + w * t2
                    left[i, 3], left[i, 4] = left[i, 3] + w * Z * t2, left[i, 4] - w * Y * t2
                    left[i, 5] += w * (Y * t1 - Z * t0)
        response_at(sections, tendons, ends, tau, spread, world, axis, s_exit, grid, n, station, x, start, frame, touch,
                    wrench, E, K, S, strain, twist, push, stage_load, at, strains, left, row, moved, strained,
                    work)  # fmt: skip
        for i in range(at.shape[0]):
            for a in range(6):
                out[c, i, a], out[c, i, 6 + a] = moved[i, a], strained[i, a]


@jit
def touched(model, held, stiffness, share, pinned, station, frame, end, n, touch):
    """Contact forces ``touch`` by a quadratic model of the gaps; returns their augmented Lagrangian's energy.

    model (2n+1, 16): places c[3], gaps, gradients[3] and Hessians[9] of the gaps there; held (2n+1,) multipliers; share
    (2n+1,): metres of rod that a place stands for; pinned (2n+1,): 1 pressed, 0 free whatever the gap, 2 pressed as held, -1 by the gap.
    """
    energy = 0.0
    for j in range(model.shape[0]):
        g, row = (frame[j], station[j]) if j < 2 * n else (end[n - 1], station[2 * n - 1])
        a0, a1, a2 = turned(g, row[AXIS], row[AXIS + 1], 0.0)
        a0, a1, a2 = a0 + g[0] - model[j, 0], a1 + g[1] - model[j, 1], a2 + g[2] - model[j, 2]
        b0 = model[j, 7] * a0 + model[j, 8] * a1 + model[j, 9] * a2
        b1 = model[j, 10] * a0 + model[j, 11] * a1 + model[j, 12] * a2
        b2 = model[j, 13] * a0 + model[j, 14] * a1 + model[j, 15] * a2
        n0, n1, n2 = model[j, 4], model[j, 5], model[j, 6]
        gap = model[j, 3] + n0 * a0 + n1 * a1 + n2 * a2 + 0.5 * (a0 * b0 + a1 * b1 + a2 * b2)
        k = stiffness if pinned[j] < 2.0 else 0.0
        press = held[j] - k * gap
        touch[j, :] = 0.0
        if pinned[j] == 0.0 or (pinned[j] < 0.0 and press <= 0.0):
            energy -= share[j] * held[j] * held[j] / (2.0 * stiffness)
            continue
        energy += share[j] * (press * press - held[j] * held[j]) / (2.0 * stiffness)
        n0, n1, n2, w = n0 + b0, n1 + b1, n2 + b2, 1.0 if j < 2 * n else share[j]
        touch[j, 0], touch[j, 1], touch[j, 2] = w * press * n0, w * press * n1, w * press * n2
        for a in range(3):
            na = n0 if a == 0 else (n1 if a == 1 else n2)
            for b in range(3):
                nb = n0 if b == 0 else (n1 if b == 1 else n2)
                touch[j, 3 + 3 * a + b] = w * (press * model[j, 7 + 3 * a + b] - k * na * nb)
    return energy


@jit
def walk(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left, hessian,
         work):  # fmt: skip
    """Frames, contact forces, wrenches and imbalance of the strains; returns the potential energy.

    contact: (model, held, stiffness, share, pinned) of `touched`; a model without rows for none.
    """
    walk_out(grid, n, joints, x, start, end, frame)
    energy = 0.0
    if contact[0].shape[0] > 0:
        energy = touched(contact[0], contact[1], contact[2], contact[3], contact[4], station, frame, end, n, touch)
    return energy + walk_back(grid, n, station, tendons, points, x, end, frame, touch, wrench, inner, left, hessian,
                              work[0, :2].reshape(-1))  # fmt: skip


@jit
def size_of(strain, twist, end, n, length):
    """A correction as a displacement, m: motion of the nodes, and a tenth of what its stretch would be over the length."""
    far, stretch = 0.0, 0.0
    for k in range(n):
        v, p = twist[k + 1], end[k]
        a0 = v[0] + v[4] * p[2] - v[5] * p[1]
        a1 = v[1] + v[5] * p[0] - v[3] * p[2]
        a2 = v[2] + v[3] * p[1] - v[4] * p[0]
        far = max(far, a0 * a0 + a1 * a1 + a2 * a2)
    for j in range(2 * n):
        for q in range(3):
            stretch = max(stretch, abs(strain[j, q]))
    return math.sqrt(far) + 0.1 * length * stretch


@jit
def damped(twist, n):
    """Share of a correction that turns no section by more than a radian."""
    most = 0.0
    for k in range(n + 1):
        for q in range(3, 6):
            most = max(most, abs(twist[k, q]))
    return min(1.0, 1.0 / max(most, 1e-300))


@jit
def move_strains(held, damping, step, x):
    """x = held + damping step."""
    for j in range(x.shape[0]):
        for q in range(6):
            x[j, q] = held[j, q] + damping * step[j, q]


@jit
def settle(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left,
           hessian, E, Q, X, K, S, zero, no_twist, no_load, at_rest, strain, twist, push, y, work, step, held, length,
           tolerance, most):  # fmt: skip
    """Newton's method, damped so that every correction is smaller than the one before (Deuflhard's natural test).

    Brings x into balance; tolerance: size of the last correction, m. Returns the number of iterations, negative where
    they lead nowhere, 0 where ``most`` were not enough. step, held (2n, 6): scratch.
    """
    walk(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left,
         hessian, work)  # fmt: skip
    for iteration in range(1, most + 1):
        factor(grid, n, station, points, x, start, end, frame, touch, inner, hessian, E, Q, X, K, S, work)
        respond(grid, n, frame, E, Q, X, K, S, inner, left, no_twist, zero, no_load, at_rest, strain, twist, push, y,
                work)  # fmt: skip
        size = size_of(strain, twist, end, n, length)
        if not size < 1e300:
            return -iteration
        move_strains(x, 0.0, strain, held)
        move_strains(strain, 0.0, strain, step)
        damping = damped(twist, n)
        while True:
            move_strains(held, damping, step, x)
            walk(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left,
                 hessian, work)  # fmt: skip
            if size < tolerance:
                return iteration
            respond(grid, n, frame, E, Q, X, K, S, inner, left, no_twist, zero, no_load, at_rest, strain, twist, push, y,
                    work)  # fmt: skip
            again = size_of(strain, twist, end, n, length)
            if again <= (1.0 - 0.25 * damping) * size or again < tolerance:
                break
            damping *= 0.5
            if damping < 1.0 / 256.0:
                return -iteration
        if damping == 1.0 and again < min(tolerance, 0.1 * size):
            move_strains(x, 1.0, strain, x)
            walk(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left,
                 hessian, work)  # fmt: skip
            return iteration
    return 0


@jit
def descend(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left,
            hessian, E, Q, X, K, S, zero, no_twist, no_load, at_rest, strain, twist, push, y, work, step, held, stiff,
            length, tolerance, most):  # fmt: skip
    """Newton's method that goes down in energy: stiffened while its matrix is not positive, damped by line search.

    For loads with a potential. Arguments and result as `settle`; stiff (2n, 6, 6): scratch.
    """
    energy = walk(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner, left,
                  hessian, work)  # fmt: skip
    stiffer = 0.0
    for iteration in range(1, most + 1):
        while True:
            if stiffer > 0.0:
                for j in range(2 * n):
                    for a in range(6):
                        for b in range(6):
                            stiff[j, a, b] = (1.0 + stiffer) * hessian[j, a, b]
            if factor(grid, n, station, points, x, start, end, frame, touch, inner, stiff if stiffer > 0.0 else hessian,
                      E, Q, X, K, S, work) == 0:  # fmt: skip
                break
            stiffer = max(4.0 * stiffer, 0.01)
            if stiffer > 1e6:
                return -iteration
        respond(grid, n, frame, E, Q, X, K, S, inner, left, no_twist, zero, no_load, at_rest, strain, twist, push, y,
                work)  # fmt: skip
        size = size_of(strain, twist, end, n, length)
        if not size < 1e300:
            return -iteration
        slope = 0.0
        for j in range(2 * n):
            for q in range(6):
                slope += 0.5 * (grid[j // 2 + 1] - grid[j // 2]) * left[j, q] * strain[j, q]
        move_strains(x, 0.0, strain, held)
        move_strains(strain, 0.0, strain, step)
        damping, noise, last = damped(twist, n), 1e-9 * abs(slope) + 1e-14 * abs(energy), size < tolerance
        while True:
            move_strains(held, damping, step, x)
            now = walk(grid, n, station, tendons, points, joints, contact, x, start, end, frame, touch, wrench, inner,
                       left, hessian, work)  # fmt: skip
            if last:
                return iteration
            if now <= energy + 0.01 * damping * slope + noise:
                break
            if stiffer == 0.0 and size < 0.01 * length:
                # near the end: where the balance vanishes is not exactly where the energy's quadrature is least, so ask
                # as `settle` does
                respond(grid, n, frame, E, Q, X, K, S, inner, left, no_twist, zero, no_load, at_rest, strain, twist,
                        push, y, work)  # fmt: skip
                if size_of(strain, twist, end, n, length) <= (1.0 - 0.25 * damping) * size:
                    break
            damping *= 0.4
            if damping < 1.0 / 256.0:
                stiffer = max(10.0 * stiffer, 0.1)
                break
        energy = now
        if damping > 0.2:
            stiffer = stiffer / 10.0 if stiffer > 1e-3 else 0.0
    return 0


def compile_all() -> None:
    """Compile the functions that Python calls, or load them from the cache on disk."""
    line, table, cube, whole = "float64[::1]", "float64[:,::1]", "float64[:,:,::1]", "int64"
    hyper = "float64[:,:,:,::1]"
    rod = f"{table}, {table}, {line}"
    loads = f"{table}, {line}, {table}, float64"
    known = f"{rod}, {table}, {loads}, {line}, {whole}, {table}, {table}, {table}, {table}, {table}, {table}"
    fill.compile(f"({table}, {table}, {table}, {line}, {table}, float64, float64, {line})")
    place.compile(f"({rod}, {table}, {loads}, {line}, {whole}, {table})")
    relax.compile(f"({table}, {whole}, float64, float64, {table}, {cube})")
    strands.compile(f"({table}, {whole}, {line}, {table}, {cube}, {cube})")
    contact = f"Tuple(({table}, {line}, float64, {line}, {line}))"
    trial = f"{line}, {whole}, {table}, {whole}, {table}, {table}, {contact}, {', '.join([table] * 8)}, {cube}"
    linear = f"{hyper}, {', '.join([cube] * 4)}"
    forced = f"{table}, {cube}, {table}, {line}, {table}, {table}, {table}, {table}, {cube}"
    walk.compile(f"({trial}, {cube})")
    # before those that call them: as their callees they would go to the cache under another key, and be lost
    factor.compile(f"({line}, {whole}, {', '.join([table] * 8)}, {cube}, {linear}, {cube})")
    respond.compile(
        f"({line}, {whole}, {table}, {hyper}, {', '.join([cube] * 4)}, {table}, {table}, {cube}, {table}, {table}, {line},"
        f" {table}, {table}, {table}, {table}, {cube})"
    )
    settle.compile(f"({trial}, {linear}, {forced}, {table}, {table}, float64, float64, {whole})")
    descend.compile(f"({trial}, {linear}, {forced}, {table}, {table}, {cube}, float64, float64, {whole})")
    sample.compile(f"({known}, {table}, float64, float64, {line}, {line}, {table}, {cube})")
    unbalanced.compile(f"({known}, {line}, {table}, {line}, {table}, {table}, {cube})")
    response_at.compile(
        f"({known}, {hyper}, {cube}, {cube}, {table}, {table}, {table}, {table}, {line}, {table}, {table}, {line},"
        f" {table}, {table}, {cube})"
    )
    columns.compile(
        f"({known}, {hyper}, {', '.join([cube] * 4)}, {', '.join([table] * 5)}, {line}, {table}, {cube}, {table}, {table},"
        f" {table}, {cube}, {cube}, {', '.join([table] * 4)}, {line}, {table}, {table}, {table}, {cube}, {cube})"
    )
