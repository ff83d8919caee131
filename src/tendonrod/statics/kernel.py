"""Compiled statics of one rod: arrays in, arrays out, nothing allocated. Derivation: docs/method.rst.

Order: section, step, walk, shooting, whole solve.

Field symbols throughout. ``p, R`` place and orientation of the section, ``v, u`` its strains (local frame), ``N, M`` total
internal force and moment (world frame), ``n, m`` the same in the local frame, ``r`` tendon, ``t`` its unit tangent.

Arrays shared by every function
    rod      (13,)   Kse[3] Kbt[3] v*[3] u*[3] rho         rho: largest tendon radius, bounds a Newton step
    tendons  (n, 7)  cx cy a phi w s_end tau               r(s_m) = (cx + a cos(phi + w s_m), cy + a sin(phi + w s_m), 0)
    load     (12,)   F_tip[3] M_tip[3] f[3] l[3]           world frame, dead
    span     (2,)    exposed length, material coordinate of the exit
    frame    (12,)   p[3] R[9] (row by row)
    x        (6,)    v[3] u[3]
    scratch  (316,)  C1[36] C2[36] frame1[12] frame2[12] M1[3] M2[3] Y[18] slopes[36] stage[6]
                     ratio strains[12] next frame and moment[15] kept[108] matrices[18]
"""

import math

from .kernel_jit import jit

GAUSS = 0.5 - math.sqrt(3.0) / 6.0  # nodes of the two-point Gauss rule: GAUSS and 1 - GAUSS
A11, A12, A21, A22 = 0.25, GAUSS - 0.25, 0.75 - GAUSS, 0.25  # Gauss collocation: integrals from 0 to each node

C1, C2, FRAME1, FRAME2, MOMENT1, MOMENT2 = 0, 36, 72, 84, 96, 99
VARIED, SLOPE, STAGE, RATIO, STRAINS, NEXT, KEPT, MATRICES = 102, 120, 156, 162, 163, 175, 190, 298
SCRATCH = 316
AT_ONCE = 0.15  # of the length: motion of the tip by the loads that a cold start may find at once
CONVERGED, LOCAL_FAILED, STALLED, TOO_SMALL = 0, 1, 2, 3


@jit
def inverse3(a, b, c, d, e, f):
    """Inverse of the symmetric [[a, b, c], [b, d, e], [c, e, f]], as its six entries."""
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    w = 1.0 / (a * A + b * B + c * C)
    return A * w, B * w, C * w, (a * f - c * c) * w, (b * c - a * e) * w, (a * d - b * b) * w


@jit
def strain_step(rod, tendons, s_m, s_mid, n0, n1, n2, m0, m1, m2, x, at, C, c):
    """One Newton step of the local balance (physics: Kse(v-v*) + sum tau t = n, Kbt(u-u*) + sum r x tau t = m).

    Updates x[at:at+6], leaves the compliance d(v,u)/d(n,m) in C[c:c+36], returns the sizes of the steps in v and u.
    The Hessian is the paper's [[Kse+K11, K12], [K21, Kbt+K22]], inverted by blocks. s_mid tells which tendons reach here.
    """
    v0, v1, v2, u0, u1, u2 = x[at], x[at + 1], x[at + 2], x[at + 3], x[at + 4], x[at + 5]
    a00, a11, a22 = rod[0], rod[1], rod[2]
    d00, d11, d22 = rod[3], rod[4], rod[5]
    g0, g1, g2 = a00 * (v0 - rod[6]) - n0, a11 * (v1 - rod[7]) - n1, a22 * (v2 - rod[8]) - n2
    g3, g4, g5 = d00 * (u0 - rod[9]) - m0, d11 * (u1 - rod[10]) - m1, d22 * (u2 - rod[11]) - m2
    a01 = a02 = a12 = d01 = d02 = d12 = 0.0
    b00 = b01 = b02 = b10 = b11 = b12 = b20 = b21 = b22 = 0.0
    for i in range(tendons.shape[0]):
        tau = tendons[i, 6]
        if s_mid > tendons[i, 5] or tau == 0.0:
            continue
        X, Y, dX, dY = tendons[i, 0], tendons[i, 1], 0.0, 0.0
        if tendons[i, 2] != 0.0:
            w = tendons[i, 4]
            ca = tendons[i, 2] * math.cos(tendons[i, 3] + w * s_m)
            sa = tendons[i, 2] * math.sin(tendons[i, 3] + w * s_m)
            X, Y, dX, dY = X + ca, Y + sa, -w * sa, w * ca
        q0, q1, q2 = v0 - u2 * Y + dX, v1 + u2 * X + dY, v2 + u0 * Y - u1 * X
        q = 1.0 / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2)
        t0, t1, t2 = q0 * q, q1 * q, q2 * q
        g0, g1, g2 = g0 + tau * t0, g1 + tau * t1, g2 + tau * t2
        g3, g4, g5 = g3 + tau * Y * t2, g4 - tau * X * t2, g5 + tau * (X * t1 - Y * t0)
        k = tau * q  # K11 = k (1 - t t')
        k00, k01, k02 = k * (1.0 - t0 * t0), -k * t0 * t1, -k * t0 * t2
        k11, k12, k22 = k * (1.0 - t1 * t1), -k * t1 * t2, k * (1.0 - t2 * t2)
        a00, a01, a02, a11, a12, a22 = a00 + k00, a01 + k01, a02 + k02, a11 + k11, a12 + k12, a22 + k22
        e02, e12, e22 = X * k01 - Y * k00, X * k11 - Y * k01, X * k12 - Y * k02  # third column of K12 = -K11 r^
        b00, b10, b20 = b00 + Y * k02, b10 + Y * k12, b20 + Y * k22
        b01, b11, b21 = b01 - X * k02, b11 - X * k12, b21 - X * k22
        b02, b12, b22 = b02 + e02, b12 + e12, b22 + e22
        d00, d01, d02 = d00 + Y * Y * k22, d01 - X * Y * k22, d02 + Y * e22  # K22 = r^ K12
        d11, d12, d22 = d11 + X * X * k22, d12 - X * e22, d22 + X * e12 - Y * e02
    i00, i01, i02, i11, i12, i22 = inverse3(a00, a01, a02, a11, a12, a22)
    w00, w01, w02 = (
        i00 * b00 + i01 * b10 + i02 * b20,
        i00 * b01 + i01 * b11 + i02 * b21,
        i00 * b02 + i01 * b12 + i02 * b22,
    )
    w10, w11, w12 = (
        i01 * b00 + i11 * b10 + i12 * b20,
        i01 * b01 + i11 * b11 + i12 * b21,
        i01 * b02 + i11 * b12 + i12 * b22,
    )
    w20, w21, w22 = (
        i02 * b00 + i12 * b10 + i22 * b20,
        i02 * b01 + i12 * b11 + i22 * b21,
        i02 * b02 + i12 * b12 + i22 * b22,
    )
    s00, s01, s02, s11, s12, s22 = inverse3(
        d00 - b00 * w00 - b10 * w10 - b20 * w20, d01 - b00 * w01 - b10 * w11 - b20 * w21,
        d02 - b00 * w02 - b10 * w12 - b20 * w22, d11 - b01 * w01 - b11 * w11 - b21 * w21,
        d12 - b01 * w02 - b11 * w12 - b21 * w22, d22 - b02 * w02 - b12 * w12 - b22 * w22,
    )  # fmt: skip
    h00, h01, h02 = (
        w00 * s00 + w01 * s01 + w02 * s02,
        w00 * s01 + w01 * s11 + w02 * s12,
        w00 * s02 + w01 * s12 + w02 * s22,
    )
    h10, h11, h12 = (
        w10 * s00 + w11 * s01 + w12 * s02,
        w10 * s01 + w11 * s11 + w12 * s12,
        w10 * s02 + w11 * s12 + w12 * s22,
    )
    h20, h21, h22 = (
        w20 * s00 + w21 * s01 + w22 * s02,
        w20 * s01 + w21 * s11 + w22 * s12,
        w20 * s02 + w21 * s12 + w22 * s22,
    )
    C[c], C[c + 1], C[c + 2] = (
        i00 + h00 * w00 + h01 * w01 + h02 * w02,
        i01 + h00 * w10 + h01 * w11 + h02 * w12,
        i02 + h00 * w20 + h01 * w21 + h02 * w22,
    )
    C[c + 7], C[c + 8] = i11 + h10 * w10 + h11 * w11 + h12 * w12, i12 + h10 * w20 + h11 * w21 + h12 * w22
    C[c + 14] = i22 + h20 * w20 + h21 * w21 + h22 * w22
    C[c + 6], C[c + 12], C[c + 13] = C[c + 1], C[c + 2], C[c + 8]
    C[c + 3], C[c + 4], C[c + 5] = -h00, -h01, -h02
    C[c + 9], C[c + 10], C[c + 11] = -h10, -h11, -h12
    C[c + 15], C[c + 16], C[c + 17] = -h20, -h21, -h22
    C[c + 18], C[c + 19], C[c + 20] = -h00, -h10, -h20
    C[c + 24], C[c + 25], C[c + 26] = -h01, -h11, -h21
    C[c + 30], C[c + 31], C[c + 32] = -h02, -h12, -h22
    C[c + 21], C[c + 22], C[c + 23] = s00, s01, s02
    C[c + 27], C[c + 28], C[c + 29] = s01, s11, s12
    C[c + 33], C[c + 34], C[c + 35] = s02, s12, s22
    z0 = C[c] * g0 + C[c + 1] * g1 + C[c + 2] * g2 - h00 * g3 - h01 * g4 - h02 * g5
    z1 = C[c + 6] * g0 + C[c + 7] * g1 + C[c + 8] * g2 - h10 * g3 - h11 * g4 - h12 * g5
    z2 = C[c + 12] * g0 + C[c + 13] * g1 + C[c + 14] * g2 - h20 * g3 - h21 * g4 - h22 * g5
    z3 = -h00 * g0 - h10 * g1 - h20 * g2 + s00 * g3 + s01 * g4 + s02 * g5
    z4 = -h01 * g0 - h11 * g1 - h21 * g2 + s01 * g3 + s11 * g4 + s12 * g5
    z5 = -h02 * g0 - h12 * g1 - h22 * g2 + s02 * g3 + s12 * g4 + s22 * g5
    dv, du = math.sqrt(z0 * z0 + z1 * z1 + z2 * z2), math.sqrt(z3 * z3 + z4 * z4 + z5 * z5)
    w = 1.0
    if dv + rod[12] * du > 0.4:  # never turn a tendon over in one step: the convex local problem then always converges
        w = 0.4 / (dv + rod[12] * du)
    x[at], x[at + 1], x[at + 2] = v0 - w * z0, v1 - w * z1, v2 - w * z2
    x[at + 3], x[at + 4], x[at + 5] = u0 - w * z3, u1 - w * z4, u2 - w * z5
    return dv, du


@jit
def move(g, at, a0, a1, a2, b0, b1, b2, out, to):
    """out[to:to+12] = g[at:at+12] * exp(twist): translation a, rotation b, both in the local frame."""
    w2 = b0 * b0 + b1 * b1 + b2 * b2
    if w2 < 1e-4:  # Taylor, exact to rounding
        sa = 1.0 - w2 / 6.0 * (1.0 - w2 / 20.0 * (1.0 - w2 / 42.0))
        sb = 0.5 - w2 / 24.0 * (1.0 - w2 / 30.0)
        sc = 1.0 / 6.0 - w2 / 120.0 * (1.0 - w2 / 42.0)
    else:
        w = math.sqrt(w2)
        sa = math.sin(w) / w
        half = math.sin(0.5 * w) / w
        sb = 2.0 * half * half
        sc = (1.0 - sa) / w2
    bb = sb * b0, sb * b1, sb * b2
    e00, e11, e22 = 1.0 - bb[1] * b1 - bb[2] * b2, 1.0 - bb[0] * b0 - bb[2] * b2, 1.0 - bb[0] * b0 - bb[1] * b1
    e01, e02, e12 = bb[0] * b1, bb[0] * b2, bb[1] * b2
    z0, z1, z2 = sa * b0, sa * b1, sa * b2
    x0, x1, x2 = b1 * a2 - b2 * a1, b2 * a0 - b0 * a2, b0 * a1 - b1 * a0
    y0, y1, y2 = b1 * x2 - b2 * x1, b2 * x0 - b0 * x2, b0 * x1 - b1 * x0
    d0, d1, d2 = a0 + sb * x0 + sc * y0, a1 + sb * x1 + sc * y1, a2 + sb * x2 + sc * y2
    for i in range(3):
        r0, r1, r2 = g[at + 3 + 3 * i], g[at + 4 + 3 * i], g[at + 5 + 3 * i]
        out[to + i] = g[at + i] + r0 * d0 + r1 * d1 + r2 * d2
        out[to + 3 + 3 * i] = r0 * e00 + r1 * (e01 + z2) + r2 * (e02 - z1)
        out[to + 4 + 3 * i] = r0 * (e01 - z2) + r1 * e11 + r2 * (e12 + z0)
        out[to + 5 + 3 * i] = r0 * (e02 + z1) + r1 * (e12 - z0) + r2 * e22


@jit
def magnus(g, at, x, k, T, h, out, to):
    """Fourth-order Magnus move over T <= h, strain linear through its values x[k:k+6], x[k+6:k+12] at the Gauss nodes."""
    w = 1.0 / (h * (1.0 - 2.0 * GAUSS))
    lever = w * (0.5 * T - GAUSS * h)
    a0, a1, a2 = (
        x[k] + lever * (x[k + 6] - x[k]),
        x[k + 1] + lever * (x[k + 7] - x[k + 1]),
        x[k + 2] + lever * (x[k + 8] - x[k + 2]),
    )
    b0, b1, b2 = (
        x[k + 3] + lever * (x[k + 9] - x[k + 3]),
        x[k + 4] + lever * (x[k + 10] - x[k + 4]),
        x[k + 5] + lever * (x[k + 11] - x[k + 5]),
    )
    c = T * T * T * w / 12.0  # half the double integral of [xi(s1), xi(s2)] = [xi1, xi2] (s2 - s1) / (h / sqrt 3)
    v0, v1, v2, u0, u1, u2 = x[k], x[k + 1], x[k + 2], x[k + 3], x[k + 4], x[k + 5]
    y0, y1, y2, z0, z1, z2 = x[k + 6], x[k + 7], x[k + 8], x[k + 9], x[k + 10], x[k + 11]
    move(
        g, at,
        T * a0 + c * (u1 * y2 - u2 * y1 - z1 * v2 + z2 * v1),
        T * a1 + c * (u2 * y0 - u0 * y2 - z2 * v0 + z0 * v2),
        T * a2 + c * (u0 * y1 - u1 * y0 - z0 * v1 + z1 * v0),
        T * b0 + c * (u1 * z2 - u2 * z1),
        T * b1 + c * (u2 * z0 - u0 * z2),
        T * b2 + c * (u0 * z1 - u1 * z0),
        out, to,
    )  # fmt: skip


@jit
def stage(rod, tendons, s_m, s_mid, N0, N1, N2, g, at, M, mat, x, k, C, c):
    """strain_step with the total force and moment turned into the local frame of g[at:at+12]."""
    o = at + 3
    return strain_step(
        rod, tendons, s_m, s_mid,
        g[o] * N0 + g[o + 3] * N1 + g[o + 6] * N2,
        g[o + 1] * N0 + g[o + 4] * N1 + g[o + 7] * N2,
        g[o + 2] * N0 + g[o + 5] * N1 + g[o + 8] * N2,
        g[o] * M[mat] + g[o + 3] * M[mat + 1] + g[o + 6] * M[mat + 2],
        g[o + 1] * M[mat] + g[o + 4] * M[mat + 1] + g[o + 7] * M[mat + 2],
        g[o + 2] * M[mat] + g[o + 5] * M[mat + 1] + g[o + 8] * M[mat + 2],
        x, k, C, c,
    )  # fmt: skip


@jit
def moment_after(load, N0, N1, N2, T, d0, d1, d2, i0, i1, i2, M, at, out, to):
    """M after T: M' = -p' x N - l with N = N(0) - f s; d = p(T) - p(0), i = integral of p - p(0) over 0..T."""
    j0, j1, j2 = T * d0 - i0, T * d1 - i1, T * d2 - i2
    f0, f1, f2 = load[6], load[7], load[8]
    out[to] = M[at] - (d1 * N2 - d2 * N1) + (j1 * f2 - j2 * f1) - load[9] * T
    out[to + 1] = M[at + 1] - (d2 * N0 - d0 * N2) + (j2 * f0 - j0 * f2) - load[10] * T
    out[to + 2] = M[at + 2] - (d0 * N1 - d1 * N0) + (j0 * f1 - j1 * f0) - load[11] * T


@jit
def step(rod, tendons, load, length, s_exit, s, h, g, at, M, mat, x, k, tol, g_out, to, M_out, mto, w):
    """Implicit two-stage Gauss-Magnus step from s to s + h; x[k:k+12] holds guess and result of the stage strains.

    Returns the number of sweeps, or -1 when the stages do not settle. tol: size of the last change of a strain, read as
    a displacement at the end of the rod.
    """
    e, before = length - s, 0.0
    N0, N1, N2 = load[0] + load[6] * e, load[1] + load[7] * e, load[2] + load[8] * e
    s_m, s_mid = s_exit + s, s_exit + s + 0.5 * h
    c1, c2 = GAUSS * h, (1.0 - GAUSS) * h
    for sweep in range(60):
        magnus(g, at, x, k, c1, h, w, FRAME1)
        magnus(g, at, x, k, c2, h, w, FRAME2)
        d0, d1, d2 = w[FRAME1] - g[at], w[FRAME1 + 1] - g[at + 1], w[FRAME1 + 2] - g[at + 2]
        e0, e1, e2 = w[FRAME2] - g[at], w[FRAME2 + 1] - g[at + 1], w[FRAME2 + 2] - g[at + 2]
        moment_after(load, N0, N1, N2, c1, d0, d1, d2, h * (A11 * d0 + A12 * e0), h * (A11 * d1 + A12 * e1),
                     h * (A11 * d2 + A12 * e2), M, mat, w, MOMENT1)  # fmt: skip
        moment_after(load, N0, N1, N2, c2, e0, e1, e2, h * (A21 * d0 + A22 * e0), h * (A21 * d1 + A22 * e1),
                     h * (A21 * d2 + A22 * e2), M, mat, w, MOMENT2)  # fmt: skip
        dv, du = stage(rod, tendons, s_m + c1, s_mid, N0 - load[6] * c1, N1 - load[7] * c1, N2 - load[8] * c1,
                       w, FRAME1, w, MOMENT1, x, k, w, C1)  # fmt: skip
        ev, eu = stage(rod, tendons, s_m + c2, s_mid, N0 - load[6] * c2, N1 - load[7] * c2, N2 - load[8] * c2,
                       w, FRAME2, w, MOMENT2, x, k + 6, w, C2)  # fmt: skip
        change = length * (dv + ev + length * (du + eu))
        if not change < 1e30:
            return -1
        if sweep > 0:  # what remains after a sweep is about change * (ratio of the last two changes)
            w[RATIO] = max(0.05, min(0.9, change / before))
        before = change
        if change * w[RATIO] < tol:
            magnus(g, at, x, k, h, h, g_out, to)
            moment_after(
                load, N0, N1, N2, h, g_out[to] - g[at], g_out[to + 1] - g[at + 1], g_out[to + 2] - g[at + 2],
                0.5 * h * (d0 + e0), 0.5 * h * (d1 + e1), 0.5 * h * (d2 + e2), M, mat, M_out, mto,
            )  # fmt: skip
            return sweep + 1
    return -1


@jit
def vary(w, g, mat, x, k, c, N0, N1, N2, slope):
    """Slope of the variation (Theta, dM) at w[STAGE:], world frame: Theta' = R du, dM' = -(Theta x R v + R dv) x N."""
    R00, R01, R02, R10, R11, R12, R20, R21, R22 = (
        w[g + 3], w[g + 4], w[g + 5], w[g + 6], w[g + 7], w[g + 8], w[g + 9], w[g + 10], w[g + 11]
    )  # fmt: skip
    M0, M1, M2 = w[mat], w[mat + 1], w[mat + 2]
    T0, T1, T2, D0, D1, D2 = w[STAGE], w[STAGE + 1], w[STAGE + 2], w[STAGE + 3], w[STAGE + 4], w[STAGE + 5]
    a0, a1, a2 = N1 * T2 - N2 * T1, N2 * T0 - N0 * T2, N0 * T1 - N1 * T0
    b0, b1, b2 = D0 + M1 * T2 - M2 * T1, D1 + M2 * T0 - M0 * T2, D2 + M0 * T1 - M1 * T0
    n0, n1, n2 = R00 * a0 + R10 * a1 + R20 * a2, R01 * a0 + R11 * a1 + R21 * a2, R02 * a0 + R12 * a1 + R22 * a2
    m0, m1, m2 = R00 * b0 + R10 * b1 + R20 * b2, R01 * b0 + R11 * b1 + R21 * b2, R02 * b0 + R12 * b1 + R22 * b2
    v0 = w[c] * n0 + w[c + 1] * n1 + w[c + 2] * n2 + w[c + 3] * m0 + w[c + 4] * m1 + w[c + 5] * m2
    v1 = w[c + 6] * n0 + w[c + 7] * n1 + w[c + 8] * n2 + w[c + 9] * m0 + w[c + 10] * m1 + w[c + 11] * m2
    v2 = w[c + 12] * n0 + w[c + 13] * n1 + w[c + 14] * n2 + w[c + 15] * m0 + w[c + 16] * m1 + w[c + 17] * m2
    u0 = w[c + 18] * n0 + w[c + 19] * n1 + w[c + 20] * n2 + w[c + 21] * m0 + w[c + 22] * m1 + w[c + 23] * m2
    u1 = w[c + 24] * n0 + w[c + 25] * n1 + w[c + 26] * n2 + w[c + 27] * m0 + w[c + 28] * m1 + w[c + 29] * m2
    u2 = w[c + 30] * n0 + w[c + 31] * n1 + w[c + 32] * n2 + w[c + 33] * m0 + w[c + 34] * m1 + w[c + 35] * m2
    p0 = R00 * x[k] + R01 * x[k + 1] + R02 * x[k + 2]
    p1 = R10 * x[k] + R11 * x[k + 1] + R12 * x[k + 2]
    p2 = R20 * x[k] + R21 * x[k + 1] + R22 * x[k + 2]
    q0 = T1 * p2 - T2 * p1 + R00 * v0 + R01 * v1 + R02 * v2
    q1 = T2 * p0 - T0 * p2 + R10 * v0 + R11 * v1 + R12 * v2
    q2 = T0 * p1 - T1 * p0 + R20 * v0 + R21 * v1 + R22 * v2
    w[slope], w[slope + 1], w[slope + 2] = (
        R00 * u0 + R01 * u1 + R02 * u2, R10 * u0 + R11 * u1 + R12 * u2, R20 * u0 + R21 * u1 + R22 * u2
    )  # fmt: skip
    w[slope + 3], w[slope + 4], w[slope + 5] = -(q1 * N2 - q2 * N1), -(q2 * N0 - q0 * N2), -(q0 * N1 - q1 * N0)


@jit
def start_variations(w):
    """Variations at the base: Theta = 0, dM the three unit vectors; no slopes yet."""
    for i in range(54):
        w[VARIED + i] = 0.0
    w[VARIED + 3] = w[VARIED + 10] = w[VARIED + 17] = 1.0


@jit
def vary_step(load, length, s, h, x, k, sweeps, w):
    """Carry the variations over the step just made, by its own two-stage rule, the slopes of the last step as guess."""
    e1, e2 = length - s - GAUSS * h, length - s - (1.0 - GAUSS) * h
    a0, a1, a2 = load[0] + load[6] * e1, load[1] + load[7] * e1, load[2] + load[8] * e1
    b0, b1, b2 = load[0] + load[6] * e2, load[1] + load[7] * e2, load[2] + load[8] * e2
    for j in range(3):
        y, k1, k2 = VARIED + 6 * j, SLOPE + 12 * j, SLOPE + 12 * j + 6
        for q in range(6):
            w[k1 + q] = w[k2 + q]
        for _ in range(sweeps):
            for q in range(6):
                w[STAGE + q] = w[y + q] + h * (A11 * w[k1 + q] + A12 * w[k2 + q])
            vary(w, FRAME1, MOMENT1, x, k, C1, a0, a1, a2, k1)
            for q in range(6):
                w[STAGE + q] = w[y + q] + h * (A21 * w[k1 + q] + A22 * w[k2 + q])
            vary(w, FRAME2, MOMENT2, x, k + 6, C2, b0, b1, b2, k2)
        for q in range(6):
            w[y + q] += 0.5 * h * (w[k1 + q] + w[k2 + q])


@jit
def integrate(rod, tendons, load, span, grid, n, g, M, x, tol, with_jacobian, J, w):
    """Walk n steps from (g[0], M[0]); J (3,3) receives dM(end)/dM(0) on demand. Returns sweeps, or -1."""
    length, total = span[0], 0
    w[RATIO] = 0.2
    if with_jacobian:
        start_variations(w)
    for i in range(n):
        s, h = grid[i], grid[i + 1] - grid[i]
        sweeps = step(rod, tendons, load, length, span[1], s, h, g, 12 * i, M, 3 * i, x, 12 * i, tol,
                      g, 12 * i + 12, M, 3 * i + 3, w)  # fmt: skip
        if sweeps < 0:
            return -1
        total += sweeps
        if with_jacobian:
            vary_step(load, length, s, h, x, 12 * i, 1, w)
    if with_jacobian:
        for j in range(3):
            for i in range(3):
                J[i, j] = w[VARIED + 6 * j + 3 + i]
    return total


@jit
def conservative(load):
    """Whether the dead loads have a potential: moments that stay fixed in the world have none."""
    return (
        load[3] == 0.0 and load[4] == 0.0 and load[5] == 0.0 and load[9] == 0.0 and load[10] == 0.0 and load[11] == 0.0
    )


@jit
def positive3(a, b, c, d, e, f):
    """Whether the symmetric [[a, b, c], [b, d, e], [c, e, f]] is positive definite, by its leading minors."""
    return a > 0.0 and a * d - b * b > 0.0 and a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d) > 0.0


@jit
def steady(w):
    """Whether Theta' dM at the end of the varied walk is positive definite: with no conjugate point before, stability.

    The variations that start with Theta = 0 span the rod's second variation; the free end adds this form (docs/method).
    """
    y = VARIED
    a = w[y] * w[y + 3] + w[y + 1] * w[y + 4] + w[y + 2] * w[y + 5]
    d = w[y + 6] * w[y + 9] + w[y + 7] * w[y + 10] + w[y + 8] * w[y + 11]
    f = w[y + 12] * w[y + 15] + w[y + 13] * w[y + 16] + w[y + 14] * w[y + 17]
    b = 0.5 * (w[y] * w[y + 9] + w[y + 1] * w[y + 10] + w[y + 2] * w[y + 11]
               + w[y + 6] * w[y + 3] + w[y + 7] * w[y + 4] + w[y + 8] * w[y + 5])  # fmt: skip
    c = 0.5 * (w[y] * w[y + 15] + w[y + 1] * w[y + 16] + w[y + 2] * w[y + 17]
               + w[y + 12] * w[y + 3] + w[y + 13] * w[y + 4] + w[y + 14] * w[y + 5])  # fmt: skip
    e = 0.5 * (w[y + 6] * w[y + 15] + w[y + 7] * w[y + 16] + w[y + 8] * w[y + 17]
               + w[y + 12] * w[y + 9] + w[y + 13] * w[y + 10] + w[y + 14] * w[y + 11])  # fmt: skip
    return positive3(a, b, c, d, e, f)


@jit
def linear_solve3(J, r0, r1, r2):
    """Solution of J y = r by Cramer's rule; not finite when J is singular."""
    a0, a1, a2 = (
        J[1, 1] * J[2, 2] - J[1, 2] * J[2, 1],
        J[0, 2] * J[2, 1] - J[0, 1] * J[2, 2],
        J[0, 1] * J[1, 2] - J[0, 2] * J[1, 1],
    )
    b0, b1, b2 = (
        J[1, 2] * J[2, 0] - J[1, 0] * J[2, 2],
        J[0, 0] * J[2, 2] - J[0, 2] * J[2, 0],
        J[0, 2] * J[1, 0] - J[0, 0] * J[1, 2],
    )
    c0, c1, c2 = (
        J[1, 0] * J[2, 1] - J[1, 1] * J[2, 0],
        J[0, 1] * J[2, 0] - J[0, 0] * J[2, 1],
        J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0],
    )
    w = 1.0 / (J[0, 0] * a0 + J[0, 1] * b0 + J[0, 2] * c0)
    return (a0 * r0 + a1 * r1 + a2 * r2) * w, (b0 * r0 + b1 * r1 + b2 * r2) * w, (c0 * r0 + c1 * r1 + c2 * r2) * w


@jit
def shoot(rod, tendons, load, span, grid, n, g, M, x, J, have_jacobian, tol, softness, limit, stats, w):
    """Find the base moment M[0] that meets the tip moment: Newton, Broyden's update between Jacobians.

    tol: metres; softness = length^2 / EI turns a moment error into a displacement. Stops as STALLED unless the residual
    keeps falling, so that continuation takes over and the branch is followed instead of jumped.
    stats: [0] residual (scaled to EI / length) [1] iterations [2] sweeps.
    """
    before, fresh, scale = 1e300, False, softness / span[0]
    bound = (
        0.25  # the first correction must do this well (Deuflhard's restricted monotonicity), the others half as well
    )
    loose, fine = (
        1e-3 * span[0],
        max(0.3 * tol, 1e-14 * span[0]),
    )  # how well the stages must settle: far from and near the answer
    y0 = y1 = y2 = r0 = r1 = r2 = 0.0
    for iteration in range(limit):
        stats[1] += 1
        want = not have_jacobian
        sweeps = integrate(rod, tendons, load, span, grid, n, g, M, x, max(fine, loose), want, J, w)
        if sweeps < 0:
            return LOCAL_FAILED
        stats[2] += sweeps
        r0, r1, r2 = M[3 * n] - load[3], M[3 * n + 1] - load[4], M[3 * n + 2] - load[5]
        r = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        stats[0] = r * scale
        if not r < 1e300:
            return LOCAL_FAILED
        floor = 1e-15 * softness * (math.sqrt(M[0] * M[0] + M[1] * M[1] + M[2] * M[2]) + stats[3])
        if want:
            fresh = True
            if iteration == 0 and conservative(load) and not steady(w):
                return STALLED  # the loads are past the first critical one: let continuation find the way
        elif before < 1e300:
            if r > (bound if before * softness > 1e-3 * span[0] else 0.6) * before:
                if (
                    r * softness < 1e3 * fine and fine > 1e-14 * span[0]
                ):  # the stages may speak louder than the residual
                    fine, before, loose = max(0.03 * fine, 1e-14 * span[0]), 1e300, 0.0
                    continue
                if fresh:
                    return CONVERGED if r * softness < max(tol, 20 * floor) else STALLED
                have_jacobian, before = (
                    False,
                    1e300,
                )  # an old or updated Jacobian misled: go back and take the exact one
                M[0], M[1], M[2] = M[0] + y0, M[1] + y1, M[2] + y2
                continue
            z = y0 * y0 + y1 * y1 + y2 * y2
            z = 1.0 / z if z > 0.0 else 0.0
            J[0, 0], J[0, 1], J[0, 2] = J[0, 0] - r0 * y0 * z, J[0, 1] - r0 * y1 * z, J[0, 2] - r0 * y2 * z
            J[1, 0], J[1, 1], J[1, 2] = J[1, 0] - r1 * y0 * z, J[1, 1] - r1 * y1 * z, J[1, 2] - r1 * y2 * z
            J[2, 0], J[2, 1], J[2, 2] = J[2, 0] - r2 * y0 * z, J[2, 1] - r2 * y1 * z, J[2, 2] - r2 * y2 * z
            fresh, bound = False, 0.6
        have_jacobian = True
        y0, y1, y2 = linear_solve3(J, r0, r1, r2)
        size = math.sqrt(y0 * y0 + y1 * y1 + y2 * y2)
        if not size < 1e300:
            return STALLED
        if max(r, size) * softness < max(tol, floor) and loose <= tol:
            return CONVERGED
        before = r
        loose = min(loose, 3e-3 * r * softness)
        M[0], M[1], M[2] = M[0] - y0, M[1] - y1, M[2] - y2
    return STALLED


@jit
def lay(tendons, span, n, grid):
    """Nodes 0..length in about n even steps, with a node wherever a tendon ends. Returns the number of steps."""
    left, count, length = 0.0, 0, span[0]
    grid[0] = 0.0
    while True:
        right = length
        for i in range(tendons.shape[0]):
            end = tendons[i, 5] - span[1]
            if left + 1e-9 * length < end < right - 1e-9 * length:
                right = end
        steps = max(1, int(round(n * (right - left) / length)))
        for k in range(1, steps + 1):
            grid[count + k] = left + (right - left) * k / steps
        count += steps
        grid[count] = right
        left = right
        if right == length:
            return count


@jit
def resample(grid, n, x, fine_grid, fine_n, fine_x):
    """Stage strains of one grid as guess on another, linear within each old step."""
    k = 0
    for i in range(fine_n):
        a, h = fine_grid[i], fine_grid[i + 1] - fine_grid[i]
        while k < n - 1 and grid[k + 1] < a + 0.5000001 * h:  # not decided by the last bit where a midpoint is a node
            k += 1
        H = grid[k + 1] - grid[k]
        for part in range(2):
            c = GAUSS if part == 0 else 1.0 - GAUSS
            w = ((a + c * h - grid[k]) / H - GAUSS) / (1.0 - 2.0 * GAUSS)
            for q in range(6):
                z = x[12 * k + q]
                fine_x[12 * i + 6 * part + q] = z + w * (x[12 * k + 6 + q] - z)


@jit
def carry(grid, n, g, M, x, only, grid2, n2, g2, M2, x2, only2):
    """Hand a solution on one grid to another grid, as guess there."""
    resample(grid, n, x, grid2, n2, x2)
    resample(grid, n, only, grid2, n2, only2)
    for i in range(12):
        g2[i] = g[i]
    for i in range(3):
        M2[i] = M[i]
        only2[12 * n2 + i] = only[12 * n + i]


@jit
def unloaded(rod, tendons, span, grid, n, x, w):
    """Stage strains when no load acts: the convex local problem at each stage, the stage before as guess. False if it fails."""
    for i in range(6):
        w[VARIED + i] = rod[6 + i]
    for i in range(n):
        h = grid[i + 1] - grid[i]
        for part in range(2):
            s_m = span[1] + grid[i] + (GAUSS if part == 0 else 1.0 - GAUSS) * h
            left = 1.0
            for _ in range(200):
                dv, du = strain_step(rod, tendons, s_m, span[1] + grid[i] + 0.5 * h,
                                     0.0, 0.0, 0.0, 0.0, 0.0, 0.0, w, VARIED, w, C1)  # fmt: skip
                left = dv + span[0] * du
                if left < 1e-13:
                    break
            if not left < 1e-9:
                return False
            for q in range(6):
                x[12 * i + 6 * part + q] = w[VARIED + q]
    return True


@jit
def unloaded_moment(load, n, grid, g, x, w):
    """Walk the unloaded rod and return the base moment that the dead loads would need there: the cold guess."""
    for j in range(3):
        w[SLOPE + j] = 0.0
    for i in range(n):  # integral of p by the trapezoid rule with end slopes p' = R v, fourth order
        h, a, b = grid[i + 1] - grid[i], 12 * i, 12 * i + 12
        magnus(g, a, x, a, h, h, g, b)
        for j in range(3):
            bend = 0.0
            for q in range(3):
                bend += (g[a + 3 + 3 * j + q] - g[b + 3 + 3 * j + q]) * (x[a + q] + x[a + 6 + q])
            w[SLOPE + j] += 0.5 * h * (g[a + j] + g[b + j] - 2.0 * g[j] + h / 12.0 * bend)
    length, a0, a1, a2 = grid[n], w[SLOPE], w[SLOPE + 1], w[SLOPE + 2]
    b0, b1, b2 = g[12 * n] - g[0], g[12 * n + 1] - g[1], g[12 * n + 2] - g[2]
    return (
        load[3] + length * load[9] + b1 * load[2] - b2 * load[1] + a1 * load[8] - a2 * load[7],
        load[4] + length * load[10] + b2 * load[0] - b0 * load[2] + a2 * load[6] - a0 * load[8],
        load[5] + length * load[11] + b0 * load[1] - b1 * load[0] + a0 * load[7] - a1 * load[6],
    )


@jit
def distance(g, n, other, stride):
    """Largest distance between node k of g and node stride * k of other."""
    far = 0.0
    for k in range(n + 1):
        a, b = 12 * k, 12 * k * stride
        d0, d1, d2 = g[a] - other[b], g[a + 1] - other[b + 1], g[a + 2] - other[b + 2]
        far = max(far, d0 * d0 + d1 * d1 + d2 * d2)
    return math.sqrt(far)


@jit
def parts(state, cap, half):
    """Views of one half of the state: grid (cap+1), g 12(cap+1), M 3(cap+1), x 12 cap, tendon-only start 12 cap + 3."""
    at = half * (40 * cap + 19)
    a, b, c, d = at + cap + 1, at + 13 * (cap + 1), at + 16 * (cap + 1), at + 28 * cap + 16
    return state[at:a], state[a:b], state[b:c], state[c:d], state[d : d + 12 * cap + 3]


@jit
def capacity(state):
    """Most steps for which ``state`` has room, see state_size."""
    return (state.shape[0] // 2 - 19) // 40


@jit
def onward(before, after, w):
    """Whether no variation vanished within the step from ``before`` to ``after``: Theta_k' B^-1 Theta_k+1 > 0.

    B = d(Theta_k+1)/d(dM_k) over the step alone, left in w by the caller. The sign of a determinant would not do: it
    misses an even number of zeros, and a round section has them in pairs.
    """
    B, S = w[MATRICES : MATRICES + 9].reshape(3, 3), w[MATRICES + 9 : MATRICES + 18].reshape(3, 3)
    for j in range(3):
        for i in range(3):
            B[i, j] = w[VARIED + 6 * j + i]
    for j in range(3):
        y0, y1, y2 = linear_solve3(B, after[6 * j], after[6 * j + 1], after[6 * j + 2])
        for i in range(3):
            S[i, j] = before[6 * i] * y0 + before[6 * i + 1] * y1 + before[6 * i + 2] * y2
    a, d, f = S[0, 0], S[1, 1], S[2, 2]
    b, c, e = 0.5 * (S[0, 1] + S[1, 0]), 0.5 * (S[0, 2] + S[2, 0]), 0.5 * (S[1, 2] + S[2, 1])
    return positive3(a, b, c, d, e, f)


@jit
def stability(rod, tendons, problem, state, half, n, w):
    """1 where the second variation of a solved rod is positive, -1 where it is not, 0 where the walk fails."""
    load, span = problem[:12], problem[12:14]
    grid, g, M, x, _ = parts(state, capacity(state), half)
    w[RATIO] = 0.9
    start_variations(w)
    before, after = w[KEPT : KEPT + 54], w[KEPT + 54 : KEPT + 108]
    for i in range(n):
        s, h = grid[i], grid[i + 1] - grid[i]
        for q in range(12):
            w[STRAINS + q] = x[12 * i + q]
        if step(rod, tendons, load, span[0], span[1], s, h, g, 12 * i, M, 3 * i, w, STRAINS, 1e-6 * span[0],
                w, NEXT, w, NEXT + 12, w) < 0:  # fmt: skip
            return 0
        for q in range(54):
            before[q] = w[VARIED + q]
        vary_step(load, span[0], s, h, w, STRAINS, 4, w)
        if i > 0:
            for q in range(54):
                after[q] = w[VARIED + q]
            start_variations(w)
            vary_step(load, span[0], s, h, w, STRAINS, 6, w)
            if not onward(before, after, w):  # Theta became singular within the step: a conjugate point
                return -1
            for q in range(54):
                w[VARIED + q] = after[q]
    return 1 if steady(w) else -1


@jit
def turning(tendons, span, grid, n, x):
    """Angle (rad) through which the section and the fastest tendon in it turn along the rod."""
    most, angle = 0.0, 0.0
    for i in range(tendons.shape[0]):
        if tendons[i, 2] != 0.0 and tendons[i, 6] != 0.0:
            most = max(most, abs(tendons[i, 4]))
    for i in range(n):
        u0, u1, u2 = (x[12 * i + 3] + x[12 * i + 9], x[12 * i + 4] + x[12 * i + 10], x[12 * i + 5] + x[12 * i + 11])
        angle += 0.5 * (grid[i + 1] - grid[i]) * math.sqrt(u0 * u0 + u1 * u1 + u2 * u2)
    return angle + most * span[0]


@jit
def equilibrium(rod, tendons, problem, state, J, stats, w):
    """Solve one rod. problem: load[12] span[2] frame[12] accuracy steps warm_n estimate; state holds two grids.

    steps > 0 fixes the number of steps; else pairs of grids n, 2n are solved until their difference shows that the
    finer one is within accuracy. warm_n > 0: half 0 of state and J come from a neighbouring solution whose estimate of
    the position error is given; as long as that estimate, enlarged by how far the strains moved, stays within accuracy
    it is taken over. stats out: residual, iterations, sweeps, moment scale, steps, half, error estimate.
    Returns CONVERGED, LOCAL_FAILED, STALLED or TOO_SMALL (stats[4] then holds the steps to make room for).
    """
    load, span, accuracy, steps = problem[:12], problem[12:14], problem[26], int(problem[27])
    n, cap = int(problem[28]), capacity(state)
    warm, length, half, status = n > 0, span[0], 0, CONVERGED
    grid, g, M, x, only = parts(state, cap, 0)
    softness = length * length / min(rod[3], min(rod[4], rod[5]))
    F, f = abs(load[0]) + abs(load[1]) + abs(load[2]), abs(load[6]) + abs(load[7]) + abs(load[8])
    stats[3] = length * (F + 0.5 * length * f + abs(load[9]) + abs(load[10]) + abs(load[11]))
    stats[3] += abs(load[3]) + abs(load[4]) + abs(load[5])
    stats[0] = stats[1] = stats[2] = stats[6] = 0.0
    still, tol = stats[3] == 0.0, 0.05 * accuracy
    uniform = True
    for i in range(tendons.shape[0]):
        uniform = uniform and (tendons[i, 2] == 0.0 or tendons[i, 4] == 0.0 or tendons[i, 6] == 0.0)
    for i in range(12):
        g[i] = problem[14 + i]
    longer = max(1.0, length / grid[n]) if warm else 1.0
    if warm and not still and lay(tendons, span, n, grid) == n:
        grid2, g2, M2, x2, only2 = parts(state, cap, 1)
        if not unloaded(rod, tendons, span, grid, n, x2, w):
            return LOCAL_FAILED
        m0, m1, m2 = unloaded_moment(load, n, grid, g, x2, w)
        M[0], M[1], M[2] = M[0] + m0 - only[12 * n], M[1] + m1 - only[12 * n + 1], M[2] + m2 - only[12 * n + 2]
        only[12 * n], only[12 * n + 1], only[12 * n + 2] = m0, m1, m2
        moved, size, own, own_before = 0.0, 0.0, 0.0, 0.0
        for i in range(12 * n):
            weight = 1.0 if i % 6 < 3 else length * length
            moved += weight * (x2[i] - only[i]) ** 2
            size += weight * (x[i] - rod[6 + i % 6]) ** 2
            own_before += weight * (x[i] - only[i]) ** 2
            x[i] += x2[i] - only[i]
            only[i], x2[i] = x2[i], x[i]
        status = shoot(rod, tendons, load, span, grid, n, g, M, x, J, True, tol, softness, 30, stats, w)
        for i in range(12 * n):
            weight = 1.0 if i % 6 < 3 else length * length
            moved += weight * (x[i] - x2[i]) ** 2
            own += weight * (x[i] - only[i]) ** 2
        moved = math.sqrt(moved / size)
        stats[4], stats[5] = n, 0
        stats[6] = (
            problem[29] * (1.0 + 4.0 * moved) * max(1.0, own / own_before) * longer**6 if moved < 0.15 else math.inf
        )
        if status == CONVERGED:
            if stats[6] <= accuracy and steps == 0:
                return status
            if steps > 0:
                stats[6] = math.inf  # nothing is known of the error with so many steps
                m = lay(tendons, span, steps, grid2)
                if m != n:  # came from a grid of other size
                    carry(grid, n, g, M, x, only, grid2, m, g2, M2, x2, only2)
                    stats[4], stats[5] = m, 1
                    return shoot(rod, tendons, load, span, grid2, m, g2, M2, x2, J, True, tol, softness, 30, stats, w)
                return status
            if (
                problem[29] < math.inf
            ):  # verify against half the steps; where nothing was known, against the double below
                m, half = lay(tendons, span, (n + 1) // 2, grid2), 1
                carry(grid, n, g, M, x, only, grid2, m, g2, M2, x2, only2)
                grid, g, M, x, only, n = grid2, g2, M2, x2, only2, m
                status = shoot(rod, tendons, load, span, grid, n, g, M, x, J, True, tol, softness, 30, stats, w)
        else:
            warm = False
    else:
        warm = False
    if not warm:
        if steps > 0:
            n = steps
        else:
            turn = length * math.sqrt(rod[9] ** 2 + rod[10] ** 2 + rod[11] ** 2)
            n = int(math.ceil((3.0 + 0.16 * turn) * max(1.0, (1e-6 * length / 0.075 / accuracy) ** 0.25)))
        n = lay(tendons, span, min(n, cap // 2 if steps == 0 else cap), grid)
        if not unloaded(rod, tendons, span, grid, n, x, w):
            return LOCAL_FAILED
        M[0], M[1], M[2] = unloaded_moment(load, n, grid, g, x, w)
        for i in range(12 * n):
            only[i] = x[i]
        only[12 * n], only[12 * n + 1], only[12 * n + 2] = M[0], M[1], M[2]
        J[0, 0] = J[1, 1] = J[2, 2] = 1.0
        J[0, 1] = J[0, 2] = J[1, 0] = J[1, 2] = J[2, 0] = J[2, 1] = 0.0
        if still and uniform:
            for i in range(3 * (n + 1)):
                M[i] = 0.0
            stats[4], stats[5] = n, 0
            return CONVERGED
        p0, p1, p2 = g[12 * n], g[12 * n + 1], g[12 * n + 2]
        status = shoot(rod, tendons, load, span, grid, n, g, M, x, J, False, tol, softness, 30, stats, w)
        far = (g[12 * n] - p0) ** 2 + (g[12 * n + 1] - p1) ** 2 + (g[12 * n + 2] - p2) ** 2
        critical = stats[3] * length > 0.5 * min(rod[3], min(rod[4], rod[5])) and conservative(load)
        if status == CONVERGED and (
            far > (AT_ONCE * length) ** 2 or (critical and stability(rod, tendons, problem, state, 0, n, w) < 0)
        ):
            return STALLED  # the answer may lie on another branch: let continuation find the way there
    while True:
        stats[4], stats[5] = n, half
        if status != CONVERGED or steps > 0:
            return status
        if 2 * n > cap:
            stats[4] = 2 * n
            return TOO_SMALL
        grid2, g2, M2, x2, only2 = parts(state, cap, 1 - half)
        for k in range(n):
            grid2[2 * k], grid2[2 * k + 1] = grid[k], 0.5 * (grid[k] + grid[k + 1])
        grid2[2 * n] = grid[n]
        carry(grid, n, g, M, x, only, grid2, 2 * n, g2, M2, x2, only2)
        status = shoot(rod, tendons, load, span, grid2, 2 * n, g2, M2, x2, J, True, tol, softness, 30, stats, w)
        stats[4], stats[5], stats[6] = 2 * n, 1 - half, distance(g, n, g2, 2) / 7.0
        enough = int(math.ceil(0.3 * turning(tendons, span, grid, n, x)))
        if status != CONVERGED or (stats[6] <= accuracy and n >= enough):
            return status
        wanted = max(enough, int(math.ceil(1.05 * n * (stats[6] / accuracy) ** 0.25)))
        if wanted >= 1.8 * n:  # go on from the fine grid, or from a new one still finer
            half, grid, g, M, x, only, n = 1 - half, grid2, g2, M2, x2, only2, 2 * n
            if wanted <= 1.1 * n:
                continue
        wanted = min(max(wanted, n + 1), 4 * n)
        if 2 * wanted + 2 * tendons.shape[0] > cap:
            stats[4] = 2 * wanted
            return TOO_SMALL
        grid2, g2, M2, x2, only2 = parts(state, cap, 1 - half)
        m = lay(tendons, span, wanted, grid2)
        while m <= n:  # nodes at tendon ends round the number: it must grow, or this would go on for ever
            wanted += 1
            m = lay(tendons, span, wanted, grid2)
        carry(grid, n, g, M, x, only, grid2, m, g2, M2, x2, only2)
        half, grid, g, M, x, only, n = 1 - half, grid2, g2, M2, x2, only2, m
        status = shoot(rod, tendons, load, span, grid, n, g, M, x, J, True, tol, softness, 30, stats, w)


@jit
def path_left(tendons, i, span, grid, n, x):
    """Integral of |u x r + r' + v| along tendon i: length (m) of its path through the rod with stage strains x."""
    total = 0.0
    for k in range(n):
        h, s = grid[k + 1] - grid[k], span[1] + grid[k]
        if s + 0.5 * h > tendons[i, 5]:
            break
        for part in range(2):
            phase = tendons[i, 3] + tendons[i, 4] * (s + (GAUSS if part == 0 else 1.0 - GAUSS) * h)
            c, d, o = tendons[i, 2] * math.cos(phase), tendons[i, 2] * math.sin(phase), 12 * k + 6 * part
            X, Y, w = tendons[i, 0] + c, tendons[i, 1] + d, tendons[i, 4]
            q0, q1 = x[o] - x[o + 5] * Y - w * d, x[o + 1] + x[o + 5] * X + w * c
            q2 = x[o + 2] + x[o + 3] * Y - x[o + 4] * X
            total += 0.5 * h * math.sqrt(q0 * q0 + q1 * q1 + q2 * q2)
    return total


@jit
def haul(rod, tendons, problem, state, J, stats, w, pull):
    """As `equilibrium`, tendon int(pull[0]) driven by its length: its tension is found such that nothing is missing.

    pull (4,): tendon, pulled length, stretch per tension (m/N), first guess of the rod's own share of it.
    """
    i, accuracy, span = int(pull[0]), problem[26], problem[12:14]
    softness = span[0] * span[0] / min(rod[3], min(rod[4], rod[5]))
    slope, tau, before, last = pull[2] + pull[3], tendons[i, 6], 0.0, 0.0
    if problem[28] == 0.0:
        tau = max(0.0, pull[1] / slope)
    tendons[i, 6] = tau
    code = equilibrium(rod, tendons, problem, state, J, stats, w)
    grid, g, M, x, _ = parts(state, capacity(state), int(stats[5]))
    n = int(stats[4])
    for q in range(12 * n):  # strains at rest, in room that the start has no more use for
        state[state.shape[0] - 12 * n + q] = rod[6 + q % 6]
    rest = path_left(tendons, i, span, grid, n, state[state.shape[0] - 12 * n :])
    for attempt in range(30):
        if code != CONVERGED:
            return code
        missing = pull[1] - rest + path_left(tendons, i, span, grid, n, x) - pull[2] * tau
        if abs(missing) < 2e-5 * accuracy or (tau == 0.0 and missing <= 0.0):
            return code
        if attempt > 0 and tau != last:
            found = (before - missing) / (tau - last)
            slope = found if found > 0.2 * slope else 0.5 * slope
        before, last = missing, tau
        tau = max(0.0, tau + missing / slope)
        tendons[i, 6] = tau
        code = shoot(rod, tendons, problem[:12], span, grid, n, g, M, x, J, True, 0.05 * accuracy, softness, 30,
                     stats, w)  # fmt: skip
    return STALLED


@jit
def sample(rod, tendons, problem, state, half, n, at, tol, out, w):
    """Rows (p[3] R[9] v[3] u[3] N[3] M[3]) at arc lengths ``at``, each by one step from the node before it."""
    load, span = problem[:12], problem[12:14]
    grid, g, M, x, _ = parts(state, capacity(state), half)
    k = 0
    for i in range(at.shape[0]):
        s = at[i]
        while k > 0 and s < grid[k]:
            k -= 1
        while k < n - 1 and s >= grid[k + 1]:
            k += 1
        H, row = grid[k + 1] - grid[k], out[i]
        T, e = s - grid[k], span[0] - s
        y = w[VARIED : VARIED + 12]
        for part in range(2):  # strains at the Gauss nodes of the short step, then at s itself
            for q in range(6):
                c = ((GAUSS if part == 0 else 1.0 - GAUSS) * T / H - GAUSS) / (1.0 - 2.0 * GAUSS)
                y[6 * part + q] = x[12 * k + q] + c * (x[12 * k + 6 + q] - x[12 * k + q])
        m = w[SLOPE : SLOPE + 3]
        if T <= 1e-12 * H or T >= H * (1.0 - 1e-12):
            j = k if T < 0.5 * H else k + 1
            for q in range(12):
                row[q] = g[12 * j + q]
            m[0], m[1], m[2] = M[3 * j], M[3 * j + 1], M[3 * j + 2]
        else:
            w[RATIO] = 0.9
            if (
                step(rod, tendons, load, span[0], span[1], grid[k], T, g, 12 * k, M, 3 * k, y, 0, tol, row, 0, m, 0, w)
                < 0
            ):
                row[:] = math.nan
                continue
        row[18], row[19], row[20] = load[0] + load[6] * e, load[1] + load[7] * e, load[2] + load[8] * e
        row[21], row[22], row[23] = m[0], m[1], m[2]
        for q in range(6):
            y[q] = 0.5 * (y[q] + y[6 + q])
        for _ in range(30):
            dv, du = stage(rod, tendons, span[1] + s, span[1] + grid[k] + 0.5 * H, row[18], row[19], row[20],
                           row, 0, m, 0, y, 0, w, C1)  # fmt: skip
            if dv + span[0] * du < 1e-12:
                break
        for q in range(6):
            row[12 + q] = y[q]


def compile_all() -> None:
    """Compile the functions that Python calls, or load them from the cache on disk."""
    line, table = "float64[::1]", "float64[:,::1]"
    equilibrium.compile(f"({line}, {table}, {line}, {line}, {table}, {line}, {line})")
    haul.compile(f"({line}, {table}, {line}, {line}, {table}, {line}, {line}, {line})")
    stability.compile(f"({line}, {table}, {line}, {line}, int64, int64, {line})")
    sample.compile(f"({line}, {table}, {line}, {line}, int64, int64, {line}, float64, {table}, {line})")
