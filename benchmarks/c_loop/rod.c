/* The cold solve of tendonrod's statics kernel, written by hand in C: the yardstick of benchmarks/c_loop.py.
 *
 * Same algorithm and same decisions as `equilibrium` in src/tendonrod/statics/kernel.py with warm_n = 0, and the same
 * symbols: p, R place and orientation of a section; v, u its strains (local frame); N, M total force and moment (world
 * frame), n, m the same in the local frame; r tendon, t its unit tangent. Nothing is allocated: the caller brings a
 * struct workspace. Order as there: section, step, walk, shooting, whole solve; the clock comes last.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <time.h>

#define MAX_STEPS 1024
#define GAUSS (0.5 - 1.7320508075688772 / 6.0)
#define A11 0.25
#define A12 (GAUSS - 0.25)
#define A21 (0.75 - GAUSS)
#define A22 0.25
#define AT_ONCE 0.15

enum { CONVERGED, LOCAL_FAILED, STALLED, TOO_SMALL };

typedef struct { double x, y, z; } vec;
typedef struct { vec x, y, z; } mat;                  /* three rows */
typedef struct { double xx, xy, xz, yy, yz, zz; } sym; /* symmetric */
typedef struct { vec p; mat R; } frame;
typedef struct { vec v, u; } strain;
typedef struct { sym A; mat B; sym D; } compliance;   /* d(v,u)/d(n,m) = [[A, B], [B', D]] */
typedef struct { vec Kse, Kbt, v_star, u_star; double reach; } rod;
typedef struct { double cx, cy, rho, angle, omega, end, tension; } tendon;
typedef struct { vec F, M, f, l; } loads;
typedef struct { loads load; double length, exit; frame base; double accuracy, steps, warm, estimate; } problem;
typedef struct { frame g; vec M; compliance C; } stage;
typedef struct { vec turn, moment; } variation;
typedef struct { variation y[3], slope[3][2]; } variations;
typedef struct { const rod *rod; const tendon *tendons; int count; const problem *problem; } robot;

typedef struct {
    int steps;
    double s[MAX_STEPS + 1];
    frame g[MAX_STEPS + 1];
    vec M[MAX_STEPS + 1];
    strain x[MAX_STEPS][2], only[MAX_STEPS][2]; /* of the two stages of each step; only: without loads */
    vec only_M;
} mesh;

typedef struct { mesh mesh[2]; stage stage[2]; variations varied; double ratio; } workspace;
typedef struct { int code, iterations, sweeps, steps, half; double residual, estimate, moment_scale; vec tip; } result;

static inline vec add(vec a, vec b) { return (vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline vec sub(vec a, vec b) { return (vec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline vec scale(double k, vec a) { return (vec){k * a.x, k * a.y, k * a.z}; }
static inline vec add_scaled(vec a, double k, vec b) { return (vec){a.x + k * b.x, a.y + k * b.y, a.z + k * b.z}; }
static inline double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double norm(vec a) { return sqrt(dot(a, a)); }
static inline vec times(vec a, vec b) { return (vec){a.x * b.x, a.y * b.y, a.z * b.z}; }
static inline double sum_abs(vec a) { return fabs(a.x) + fabs(a.y) + fabs(a.z); }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline int larger_int(int a, int b) { return a > b ? a : b; }
static inline int smaller_int(int a, int b) { return a < b ? a : b; }

static inline vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline vec mul(const mat *a, vec b) { return (vec){dot(a->x, b), dot(a->y, b), dot(a->z, b)}; }

static inline vec mul_transposed(const mat *a, vec b)
{
    return (vec){
        a->x.x * b.x + a->y.x * b.y + a->z.x * b.z,
        a->x.y * b.x + a->y.y * b.y + a->z.y * b.z,
        a->x.z * b.x + a->y.z * b.y + a->z.z * b.z,
    };
}

static inline vec mul_sym(const sym *a, vec b)
{
    return (vec){
        a->xx * b.x + a->xy * b.y + a->xz * b.z,
        a->xy * b.x + a->yy * b.y + a->yz * b.z,
        a->xz * b.x + a->yz * b.y + a->zz * b.z,
    };
}

static inline sym inverse(sym a)
{
    double A = a.yy * a.zz - a.yz * a.yz, B = a.yz * a.xz - a.xy * a.zz, C = a.xy * a.yz - a.xz * a.yy;
    double w = 1.0 / (a.xx * A + a.xy * B + a.xz * C);
    return (sym){
        A * w, B * w, C * w,
        (a.xx * a.zz - a.xz * a.xz) * w, (a.xy * a.xz - a.xx * a.yz) * w, (a.xx * a.yy - a.xy * a.xy) * w,
    };
}

/* Solution of J y = r by Cramer's rule; not finite when J is singular. */
static inline vec linear_solve(const mat *J, vec r)
{
    vec c0 = {J->x.x, J->y.x, J->z.x}, c1 = {J->x.y, J->y.y, J->z.y}, c2 = {J->x.z, J->y.z, J->z.z};
    vec a = cross(c1, c2), b = cross(c2, c0), c = cross(c0, c1);
    double w = 1.0 / dot(c0, a);
    return (vec){dot(a, r) * w, dot(b, r) * w, dot(c, r) * w};
}

static inline bool positive(const sym *a)
{
    return a->xx > 0.0 && a->xx * a->yy - a->xy * a->xy > 0.0
           && a->xx * (a->yy * a->zz - a->yz * a->yz) - a->xy * (a->xy * a->zz - a->xz * a->yz)
                      + a->xz * (a->xy * a->yz - a->xz * a->yy) > 0.0;
}

/* One Newton step of the local balance Kse(v-v*) + sum tau t = n, Kbt(u-u*) + sum r x tau t = m. Updates x, leaves the
 * compliance in C, and gives the sizes of the steps in v and u. */
static inline void strain_step(const robot *q, double s_m, double s_mid, vec n, vec m, strain *x, compliance *C,
                               double *dv, double *du)
{
    const rod *rod = q->rod;
    const vec v = x->v, u = x->u;
    vec gn = sub(times(rod->Kse, sub(v, rod->v_star)), n), gm = sub(times(rod->Kbt, sub(u, rod->u_star)), m);
    sym A = {rod->Kse.x, 0.0, 0.0, rod->Kse.y, 0.0, rod->Kse.z};
    sym D = {rod->Kbt.x, 0.0, 0.0, rod->Kbt.y, 0.0, rod->Kbt.z};
    mat B = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int i = 0; i < q->count; i++) {
        const tendon *each = &q->tendons[i];
        double tau = each->tension;
        if (s_mid > each->end || tau == 0.0)
            continue;
        double X = each->cx, Y = each->cy, dX = 0.0, dY = 0.0;
        if (each->rho != 0.0) {
            double phase = each->angle + each->omega * s_m;
            double ca = each->rho * cos(phase), sa = each->rho * sin(phase);
            X += ca, Y += sa, dX = -each->omega * sa, dY = each->omega * ca;
        }
        vec tangent = {v.x - u.z * Y + dX, v.y + u.z * X + dY, v.z + u.x * Y - u.y * X};
        double inv = 1.0 / norm(tangent), k = tau * inv;
        vec t = scale(inv, tangent);
        gn = add_scaled(gn, tau, t);
        gm.x += tau * Y * t.z, gm.y -= tau * X * t.z, gm.z += tau * (X * t.y - Y * t.x);
        sym K = {k * (1.0 - t.x * t.x), -k * t.x * t.y, -k * t.x * t.z,
                 k * (1.0 - t.y * t.y), -k * t.y * t.z, k * (1.0 - t.z * t.z)};
        A.xx += K.xx, A.xy += K.xy, A.xz += K.xz, A.yy += K.yy, A.yz += K.yz, A.zz += K.zz;
        vec e = {X * K.xy - Y * K.xx, X * K.yy - Y * K.xy, X * K.yz - Y * K.xz}; /* third column of -K11 r^ */
        B.x.x += Y * K.xz, B.y.x += Y * K.yz, B.z.x += Y * K.zz;
        B.x.y -= X * K.xz, B.y.y -= X * K.yz, B.z.y -= X * K.zz;
        B.x.z += e.x, B.y.z += e.y, B.z.z += e.z;
        D.xx += Y * Y * K.zz, D.xy -= X * Y * K.zz, D.xz += Y * e.z;
        D.yy += X * X * K.zz, D.yz -= X * e.z, D.zz += X * e.y - Y * e.x;
    }
    sym I = inverse(A);
    /* columns of B and of W = A^-1 B */
    vec b0 = {B.x.x, B.y.x, B.z.x}, b1 = {B.x.y, B.y.y, B.z.y}, b2 = {B.x.z, B.y.z, B.z.z};
    vec w0 = mul_sym(&I, b0), w1 = mul_sym(&I, b1), w2 = mul_sym(&I, b2);
    sym S = inverse((sym){D.xx - dot(b0, w0), D.xy - dot(b0, w1), D.xz - dot(b0, w2),
                          D.yy - dot(b1, w1), D.yz - dot(b1, w2), D.zz - dot(b2, w2)});
    mat W = {{w0.x, w1.x, w2.x}, {w0.y, w1.y, w2.y}, {w0.z, w1.z, w2.z}};
    mat H = {mul_sym(&S, W.x), mul_sym(&S, W.y), mul_sym(&S, W.z)};
    C->A = (sym){I.xx + dot(H.x, W.x), I.xy + dot(H.x, W.y), I.xz + dot(H.x, W.z),
                 I.yy + dot(H.y, W.y), I.yz + dot(H.y, W.z), I.zz + dot(H.z, W.z)};
    C->B = (mat){scale(-1.0, H.x), scale(-1.0, H.y), scale(-1.0, H.z)};
    C->D = S;
    vec zv = sub(mul_sym(&C->A, gn), mul(&H, gm)), zu = sub(mul_sym(&S, gm), mul_transposed(&H, gn));
    *dv = norm(zv), *du = norm(zu);
    double size = *dv + rod->reach * *du, w = size > 0.4 ? 0.4 / size : 1.0; /* never turn a tendon over in one step */
    x->v = add_scaled(v, -w, zv);
    x->u = add_scaled(u, -w, zu);
}

/* g * exp(twist): translation a, rotation b, both in the local frame. */
static inline frame move(const frame *g, vec a, vec b)
{
    double w2 = dot(b, b), sa, sb, sc;
    if (w2 < 1e-4) { /* Taylor, exact to rounding */
        sa = 1.0 - w2 / 6.0 * (1.0 - w2 / 20.0 * (1.0 - w2 / 42.0));
        sb = 0.5 - w2 / 24.0 * (1.0 - w2 / 30.0);
        sc = 1.0 / 6.0 - w2 / 120.0 * (1.0 - w2 / 42.0);
    } else {
        double w = sqrt(w2), half = sin(0.5 * w) / w;
        sa = sin(w) / w;
        sb = 2.0 * half * half;
        sc = (1.0 - sa) / w2;
    }
    vec bb = scale(sb, b), z = scale(sa, b), x = cross(b, a), y = cross(b, x);
    vec d = add_scaled(add_scaled(a, sb, x), sc, y);
    double e01 = bb.x * b.y, e02 = bb.x * b.z, e12 = bb.y * b.z;
    mat E = {{1.0 - bb.y * b.y - bb.z * b.z, e01 + z.z, e02 - z.y}, /* columns of exp(b) */
             {e01 - z.z, 1.0 - bb.x * b.x - bb.z * b.z, e12 + z.x},
             {e02 + z.y, e12 - z.x, 1.0 - bb.x * b.x - bb.y * b.y}};
    return (frame){add(g->p, mul(&g->R, d)), {mul(&E, g->R.x), mul(&E, g->R.y), mul(&E, g->R.z)}};
}

/* Fourth-order Magnus move over T <= h, strain linear through its values at the two Gauss nodes. */
static inline frame magnus(const frame *g, const strain x[2], double T, double h)
{
    double w = 1.0 / (h * (1.0 - 2.0 * GAUSS)), lever = w * (0.5 * T - GAUSS * h), c = T * T * T * w / 12.0;
    vec a = add_scaled(x[0].v, lever, sub(x[1].v, x[0].v)), b = add_scaled(x[0].u, lever, sub(x[1].u, x[0].u));
    vec turn = cross(x[0].u, x[1].u), shift = sub(cross(x[0].u, x[1].v), cross(x[1].u, x[0].v));
    return move(g, add_scaled(scale(T, a), c, shift), add_scaled(scale(T, b), c, turn));
}

/* strain_step with the total force and moment turned into the local frame. */
static inline void settle(const robot *q, double s_m, double s_mid, vec N, stage *at, strain *x, double *dv, double *du)
{
    strain_step(q, s_m, s_mid, mul_transposed(&at->g.R, N), mul_transposed(&at->g.R, at->M), x, &at->C, dv, du);
}

/* M after T: M' = -p' x N - l with N = N(0) - f s; d = p(T) - p(0), i = integral of p - p(0) over 0..T. */
static inline vec moment_after(const loads *load, vec N, double T, vec d, vec i, vec M)
{
    vec j = sub(scale(T, d), i);
    return add_scaled(add(sub(M, cross(d, N)), cross(j, load->f)), -T, load->l);
}

/* Implicit two-stage Gauss-Magnus step from s to s + h. Returns the number of sweeps, or -1 when it does not settle. */
static int step(const robot *q, double s, double h, const frame *g, vec M, strain x[2], double tol, frame *g_out,
                vec *M_out, workspace *w)
{
    const loads *load = &q->problem->load;
    const double length = q->problem->length, c1 = GAUSS * h, c2 = (1.0 - GAUSS) * h;
    const double s_m = q->problem->exit + s, s_mid = s_m + 0.5 * h;
    const vec N = add_scaled(load->F, length - s, load->f);
    const vec N1 = add_scaled(N, -c1, load->f), N2 = add_scaled(N, -c2, load->f);
    double before = 0.0;
    stage *one = &w->stage[0], *two = &w->stage[1];
    for (int sweep = 0; sweep < 60; sweep++) {
        double dv, du, ev, eu;
        one->g = magnus(g, x, c1, h);
        two->g = magnus(g, x, c2, h);
        vec d = sub(one->g.p, g->p), e = sub(two->g.p, g->p);
        one->M = moment_after(load, N, c1, d, scale(h, add_scaled(scale(A11, d), A12, e)), M);
        two->M = moment_after(load, N, c2, e, scale(h, add_scaled(scale(A21, d), A22, e)), M);
        settle(q, s_m + c1, s_mid, N1, one, &x[0], &dv, &du);
        settle(q, s_m + c2, s_mid, N2, two, &x[1], &ev, &eu);
        double change = length * (dv + ev + length * (du + eu));
        if (!(change < 1e30))
            return -1;
        if (sweep > 0) /* what remains after a sweep is about change * (ratio of the last two changes) */
            w->ratio = larger(0.05, smaller(0.9, change / before));
        before = change;
        if (change * w->ratio < tol) {
            frame end = magnus(g, x, h, h);
            *M_out = moment_after(load, N, h, sub(end.p, g->p), scale(0.5 * h, add(d, e)), M);
            *g_out = end;
            return sweep + 1;
        }
    }
    return -1;
}

/* Slope of the variation y, world frame: Theta' = R du, dM' = -(Theta x R v + R dv) x N. */
static inline variation vary(const stage *at, const strain *x, vec N, variation y)
{
    const mat *R = &at->g.R;
    vec n = mul_transposed(R, cross(N, y.turn)), m = mul_transposed(R, add(y.moment, cross(at->M, y.turn)));
    vec dv = add(mul_sym(&at->C.A, n), mul(&at->C.B, m)), du = add(mul_transposed(&at->C.B, n), mul_sym(&at->C.D, m));
    vec speed = add(cross(y.turn, mul(R, x->v)), mul(R, dv));
    return (variation){mul(R, du), cross(N, speed)};
}

static inline void start_variations(variations *all)
{
    *all = (variations){0};
    all->y[0].moment.x = all->y[1].moment.y = all->y[2].moment.z = 1.0;
}

static inline variation along(const variation *y, double h, double a, const variation *k1, double b, const variation *k2)
{
    return (variation){add_scaled(y->turn, h, add_scaled(scale(a, k1->turn), b, k2->turn)),
                       add_scaled(y->moment, h, add_scaled(scale(a, k1->moment), b, k2->moment))};
}

/* Carry the variations over the step just made, by its own two-stage rule, the slopes of the last step as guess. */
static void vary_step(const problem *ask, double s, double h, const strain x[2], int sweeps, workspace *w)
{
    const vec N1 = add_scaled(ask->load.F, ask->length - s - GAUSS * h, ask->load.f);
    const vec N2 = add_scaled(ask->load.F, ask->length - s - (1.0 - GAUSS) * h, ask->load.f);
    for (int j = 0; j < 3; j++) {
        variation *y = &w->varied.y[j], *k1 = &w->varied.slope[j][0], *k2 = &w->varied.slope[j][1];
        *k1 = *k2;
        for (int sweep = 0; sweep < sweeps; sweep++) {
            *k1 = vary(&w->stage[0], &x[0], N1, along(y, h, A11, k1, A12, k2));
            *k2 = vary(&w->stage[1], &x[1], N2, along(y, h, A21, k1, A22, k2));
        }
        *y = along(y, h, 0.5, k1, 0.5, k2);
    }
}

/* Walk from (g[0], M[0]); J receives dM(end)/dM(0) on demand. Returns the sweeps, or -1. */
static int integrate(const robot *q, mesh *on, double tol, mat *J, workspace *w)
{
    int total = 0;
    w->ratio = 0.2;
    if (J)
        start_variations(&w->varied);
    for (int i = 0; i < on->steps; i++) {
        double s = on->s[i], h = on->s[i + 1] - s;
        int sweeps = step(q, s, h, &on->g[i], on->M[i], on->x[i], tol, &on->g[i + 1], &on->M[i + 1], w);
        if (sweeps < 0)
            return -1;
        total += sweeps;
        if (J)
            vary_step(q->problem, s, h, on->x[i], 1, w);
    }
    if (J) {
        vec a = w->varied.y[0].moment, b = w->varied.y[1].moment, c = w->varied.y[2].moment;
        *J = (mat){{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}};
    }
    return total;
}

static bool conservative(const loads *load) { return sum_abs(load->M) == 0.0 && sum_abs(load->l) == 0.0; }

/* Whether Theta' dM at the end of the varied walk is positive definite. */
static bool steady(const variations *all)
{
    const variation *y = all->y;
    sym S = {dot(y[0].turn, y[0].moment),
             0.5 * (dot(y[0].turn, y[1].moment) + dot(y[1].turn, y[0].moment)),
             0.5 * (dot(y[0].turn, y[2].moment) + dot(y[2].turn, y[0].moment)),
             dot(y[1].turn, y[1].moment),
             0.5 * (dot(y[1].turn, y[2].moment) + dot(y[2].turn, y[1].moment)),
             dot(y[2].turn, y[2].moment)};
    return positive(&S);
}

/* Find the base moment that meets the tip moment: Newton, Broyden's update between Jacobians. */
static int shoot(const robot *q, mesh *on, mat *J, bool have_jacobian, double tol, double softness, result *out,
                 workspace *w)
{
    const problem *ask = q->problem;
    const double length = ask->length;
    double before = 1e300, bound = 0.25, loose = 1e-3 * length, fine = larger(0.3 * tol, 1e-14 * length);
    bool fresh = false;
    vec y = {0.0, 0.0, 0.0};
    for (int iteration = 0; iteration < 30; iteration++) {
        bool want = !have_jacobian;
        out->iterations++;
        int sweeps = integrate(q, on, larger(fine, loose), want ? J : NULL, w);
        if (sweeps < 0)
            return LOCAL_FAILED;
        out->sweeps += sweeps;
        vec residual = sub(on->M[on->steps], ask->load.M);
        double r = norm(residual);
        out->residual = r * (softness / length);
        if (!(r < 1e300))
            return LOCAL_FAILED;
        double floor = 1e-15 * softness * (norm(on->M[0]) + out->moment_scale);
        if (want) {
            fresh = true;
            if (iteration == 0 && conservative(&ask->load) && !steady(&w->varied))
                return STALLED;
        } else if (before < 1e300) {
            if (r > (before * softness > 1e-3 * length ? bound : 0.6) * before) {
                if (r * softness < 1e3 * fine && fine > 1e-14 * length) {
                    fine = larger(0.03 * fine, 1e-14 * length), before = 1e300, loose = 0.0;
                    continue;
                }
                if (fresh)
                    return r * softness < larger(tol, 20.0 * floor) ? CONVERGED : STALLED;
                have_jacobian = false, before = 1e300;
                on->M[0] = add(on->M[0], y);
                continue;
            }
            double z = dot(y, y);
            z = z > 0.0 ? 1.0 / z : 0.0;
            J->x = add_scaled(J->x, -residual.x * z, y);
            J->y = add_scaled(J->y, -residual.y * z, y);
            J->z = add_scaled(J->z, -residual.z * z, y);
            fresh = false, bound = 0.6;
        }
        have_jacobian = true;
        y = linear_solve(J, residual);
        double size = norm(y);
        if (!(size < 1e300))
            return STALLED;
        if (larger(r, size) * softness < larger(tol, floor) && loose <= tol)
            return CONVERGED;
        before = r;
        loose = smaller(loose, 3e-3 * r * softness);
        on->M[0] = sub(on->M[0], y);
    }
    return STALLED;
}

/* Nodes 0..length in about n even steps, with a node wherever a tendon ends. */
static void lay(const robot *q, int n, mesh *on)
{
    const double length = q->problem->length;
    double left = 0.0;
    int count = 0;
    on->s[0] = 0.0;
    for (;;) {
        double right = length;
        for (int i = 0; i < q->count; i++) {
            double end = q->tendons[i].end - q->problem->exit;
            if (left + 1e-9 * length < end && end < right - 1e-9 * length)
                right = end;
        }
        int steps = larger_int(1, (int)rint(n * (right - left) / length));
        for (int k = 1; k <= steps; k++)
            on->s[count + k] = left + (right - left) * k / steps;
        count += steps;
        on->s[count] = right;
        left = right;
        if (right == length)
            break;
    }
    on->steps = count;
}

static inline strain between(const strain x[2], double w)
{
    return (strain){add_scaled(x[0].v, w, sub(x[1].v, x[0].v)), add_scaled(x[0].u, w, sub(x[1].u, x[0].u))};
}

/* Hand a solution on one mesh to another, as guess there: stage strains linear within each old step. */
static void carry(const mesh *from, mesh *to)
{
    int k = 0;
    for (int i = 0; i < to->steps; i++) {
        double a = to->s[i], h = to->s[i + 1] - a;
        while (k < from->steps - 1 && from->s[k + 1] < a + 0.5000001 * h)
            k++;
        double H = from->s[k + 1] - from->s[k];
        for (int part = 0; part < 2; part++) {
            double c = part == 0 ? GAUSS : 1.0 - GAUSS;
            double w = ((a + c * h - from->s[k]) / H - GAUSS) / (1.0 - 2.0 * GAUSS);
            to->x[i][part] = between(from->x[k], w);
            to->only[i][part] = between(from->only[k], w);
        }
    }
    to->g[0] = from->g[0];
    to->M[0] = from->M[0];
    to->only_M = from->only_M;
}

/* Stage strains when no load acts: the convex local problem at each stage, the stage before as guess. */
static bool unloaded(const robot *q, mesh *on, workspace *w)
{
    const double exit = q->problem->exit;
    const vec none = {0.0, 0.0, 0.0};
    strain x = {q->rod->v_star, q->rod->u_star};
    for (int i = 0; i < on->steps; i++) {
        double h = on->s[i + 1] - on->s[i], s_mid = exit + on->s[i] + 0.5 * h;
        for (int part = 0; part < 2; part++) {
            double s_m = exit + on->s[i] + (part == 0 ? GAUSS : 1.0 - GAUSS) * h, left = 1.0;
            for (int turn = 0; turn < 200; turn++) {
                double dv, du;
                strain_step(q, s_m, s_mid, none, none, &x, &w->stage[0].C, &dv, &du);
                left = dv + q->problem->length * du;
                if (left < 1e-13)
                    break;
            }
            if (!(left < 1e-9))
                return false;
            on->x[i][part] = x;
        }
    }
    return true;
}

/* Walk the unloaded rod; gives the base moment that the dead loads would need there: the cold guess. */
static vec unloaded_moment(const loads *load, mesh *on)
{
    vec area = {0.0, 0.0, 0.0}; /* integral of p by the trapezoid rule with end slopes p' = R v, fourth order */
    for (int i = 0; i < on->steps; i++) {
        double h = on->s[i + 1] - on->s[i];
        frame *a = &on->g[i], *b = &on->g[i + 1];
        *b = magnus(a, on->x[i], h, h);
        vec v = add(on->x[i][0].v, on->x[i][1].v), bend = sub(mul(&a->R, v), mul(&b->R, v));
        vec chord = sub(add(a->p, b->p), scale(2.0, on->g[0].p));
        area = add_scaled(area, 0.5 * h, add_scaled(chord, h / 12.0, bend));
    }
    double length = on->s[on->steps];
    vec b = sub(on->g[on->steps].p, on->g[0].p);
    return add(add_scaled(load->M, length, load->l), add(cross(b, load->F), cross(area, load->f)));
}

/* Largest distance between a node of one mesh and the node at the same place of one with twice the steps. */
static double distance(const mesh *coarse, const mesh *fine)
{
    double far = 0.0;
    for (int k = 0; k <= coarse->steps; k++) {
        vec d = sub(coarse->g[k].p, fine->g[2 * k].p);
        far = larger(far, dot(d, d));
    }
    return sqrt(far);
}

/* Whether no variation vanished within the step: Theta_k' B^-1 Theta_k+1 > 0, B = d(Theta_k+1)/d(dM_k) over the step. */
static bool onward(const variations *before, const variations *across, const variations *after)
{
    vec a = across->y[0].turn, b = across->y[1].turn, c = across->y[2].turn;
    mat B = {{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}};
    double S[3][3];
    for (int j = 0; j < 3; j++) {
        vec y = linear_solve(&B, after->y[j].turn);
        for (int i = 0; i < 3; i++)
            S[i][j] = dot(before->y[i].turn, y);
    }
    sym even = {S[0][0], 0.5 * (S[0][1] + S[1][0]), 0.5 * (S[0][2] + S[2][0]),
                S[1][1], 0.5 * (S[1][2] + S[2][1]), S[2][2]};
    return positive(&even);
}

/* 1 where the second variation of a solved rod is positive, -1 where it is not, 0 where the walk fails. */
static int stability(const robot *q, const mesh *on, workspace *w)
{
    w->ratio = 0.9;
    start_variations(&w->varied);
    for (int i = 0; i < on->steps; i++) {
        double s = on->s[i], h = on->s[i + 1] - s;
        strain x[2] = {on->x[i][0], on->x[i][1]};
        frame g;
        vec M;
        if (step(q, s, h, &on->g[i], on->M[i], x, 1e-6 * q->problem->length, &g, &M, w) < 0)
            return 0;
        variations before = w->varied;
        vary_step(q->problem, s, h, x, 4, w);
        if (i > 0) {
            variations after = w->varied;
            start_variations(&w->varied);
            vary_step(q->problem, s, h, x, 6, w);
            if (!onward(&before, &w->varied, &after))
                return -1;
            w->varied = after;
        }
    }
    return steady(&w->varied) ? 1 : -1;
}

/* Angle (rad) through which the section and the fastest tendon in it turn along the rod. */
static double turning(const robot *q, const mesh *on)
{
    double most = 0.0, angle = 0.0;
    for (int i = 0; i < q->count; i++)
        if (q->tendons[i].rho != 0.0 && q->tendons[i].tension != 0.0)
            most = larger(most, fabs(q->tendons[i].omega));
    for (int i = 0; i < on->steps; i++)
        angle += 0.5 * (on->s[i + 1] - on->s[i]) * norm(add(on->x[i][0].u, on->x[i][1].u));
    return angle + most * q->problem->length;
}

/* The first grid, the unloaded robot on it, and the loaded one from there. */
static int start_cold(const robot *q, int capacity, double tol, double softness, mat *J, result *out, workspace *w,
                      bool *done)
{
    const problem *ask = q->problem;
    const double length = ask->length, stiffness = smaller(q->rod->Kbt.x, smaller(q->rod->Kbt.y, q->rod->Kbt.z));
    mesh *on = &w->mesh[0];
    int n = (int)ask->steps;
    if (n == 0) {
        double turn = length * norm(q->rod->u_star);
        n = (int)ceil((3.0 + 0.16 * turn) * larger(1.0, pow(1e-6 * length / 0.075 / ask->accuracy, 0.25)));
        n = smaller_int(n, capacity / 2);
    } else {
        n = smaller_int(n, capacity);
    }
    lay(q, n, on);
    out->steps = on->steps;
    if (!unloaded(q, on, w))
        return LOCAL_FAILED;
    on->M[0] = on->only_M = unloaded_moment(&ask->load, on);
    for (int i = 0; i < on->steps; i++)
        on->only[i][0] = on->x[i][0], on->only[i][1] = on->x[i][1];
    *J = (mat){{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    bool uniform = true;
    for (int i = 0; i < q->count; i++)
        uniform = uniform && (q->tendons[i].rho == 0.0 || q->tendons[i].omega == 0.0 || q->tendons[i].tension == 0.0);
    if (out->moment_scale == 0.0 && uniform) {
        for (int i = 0; i <= on->steps; i++)
            on->M[i] = (vec){0.0, 0.0, 0.0};
        *done = true;
        return CONVERGED;
    }
    vec p = on->g[on->steps].p;
    int status = shoot(q, on, J, false, tol, softness, out, w);
    if (status != CONVERGED)
        return status;
    vec far = sub(on->g[on->steps].p, p);
    bool critical = out->moment_scale * length > 0.5 * stiffness && conservative(&ask->load);
    bool stray = dot(far, far) > (AT_ONCE * length) * (AT_ONCE * length) || (critical && stability(q, on, w) < 0);
    *done = stray; /* the answer may lie on another branch: that is for continuation */
    return stray ? STALLED : CONVERGED;
}

static int equilibrium(const robot *q, int capacity, result *out, workspace *w)
{
    const problem *ask = q->problem;
    const loads *load = &ask->load;
    const double length = ask->length, accuracy = ask->accuracy, tol = 0.05 * accuracy;
    const double softness = length * length / smaller(q->rod->Kbt.x, smaller(q->rod->Kbt.y, q->rod->Kbt.z));
    *out = (result){0};
    out->moment_scale = length * (sum_abs(load->F) + 0.5 * length * sum_abs(load->f) + sum_abs(load->l))
                        + sum_abs(load->M);
    w->mesh[0].g[0] = ask->base;
    mat J;
    bool done = false;
    int status = start_cold(q, capacity, tol, softness, &J, out, w, &done);
    if (done)
        return status;
    mesh *on = &w->mesh[0], *next = &w->mesh[1];
    for (;;) { /* nested grids n, 2n until their difference shows that the finer one is within accuracy */
        int n = on->steps;
        out->steps = n, out->half = (int)(on - w->mesh);
        if (status != CONVERGED || ask->steps > 0.0)
            return status;
        if (2 * n > capacity) {
            out->steps = 2 * n;
            return TOO_SMALL;
        }
        for (int k = 0; k < n; k++)
            next->s[2 * k] = on->s[k], next->s[2 * k + 1] = 0.5 * (on->s[k] + on->s[k + 1]);
        next->s[2 * n] = on->s[n];
        next->steps = 2 * n;
        carry(on, next);
        status = shoot(q, next, &J, true, tol, softness, out, w);
        out->steps = 2 * n, out->half = (int)(next - w->mesh), out->estimate = distance(on, next) / 7.0;
        int enough = (int)ceil(0.3 * turning(q, on));
        if (status != CONVERGED || (out->estimate <= accuracy && n >= enough))
            return status;
        int wanted = larger_int(enough, (int)ceil(1.05 * n * pow(out->estimate / accuracy, 0.25)));
        if (wanted >= 1.8 * n) { /* go on from the fine grid, or from a new one still finer */
            mesh *fine = next;
            next = on, on = fine, n *= 2;
            if (wanted <= 1.1 * n)
                continue;
        }
        wanted = smaller_int(larger_int(wanted, n + 1), 4 * n);
        if (2 * wanted + 2 * q->count > capacity) {
            out->steps = 2 * wanted;
            return TOO_SMALL;
        }
        lay(q, wanted, next);
        while (next->steps <= n) /* nodes at tendon ends round the number: it must grow */
            lay(q, ++wanted, next);
        carry(on, next);
        mesh *fine = next;
        next = on, on = fine;
        status = shoot(q, on, &J, true, tol, softness, out, w);
    }
}

/* What the benchmark calls. */

size_t workspace_size(void) { return sizeof(workspace); }

int solve(const rod *rod, const tendon *tendons, int count, const problem *ask, int capacity, workspace *w, result *out)
{
    robot q = {rod, tendons, count, ask};
    if (capacity > MAX_STEPS || ask->steps > MAX_STEPS)
        return out->code = TOO_SMALL;
    int code = equilibrium(&q, capacity, out, w);
    out->code = code;
    if (code == CONVERGED)
        out->tip = w->mesh[out->half].g[out->steps].p;
    return code;
}

/* Seconds for one solve, mean of `repeats`. */
double seconds(const rod *rod, const tendon *tendons, int count, const problem *ask, int capacity, workspace *w,
               result *out, int repeats)
{
    struct timespec start, end;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (int i = 0; i < repeats; i++)
        solve(rod, tendons, count, ask, capacity, w, out);
    clock_gettime(CLOCK_MONOTONIC, &end);
    return ((double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec)) / repeats;
}
