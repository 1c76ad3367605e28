/* Robots, an excavator and a platform on six legs in closed form: rows of values in, rows out. */
#include <math.h>

typedef struct { double x, y; } point;

/* Where circles of radii a about A and b about B meet, on the left of the way from A to B. */
static point meeting(point A, double a, point B, double b)
{
    const double dx = B.x - A.x, dy = B.y - A.y, d2 = dx * dx + dy * dy;
    const double t = (a * a - b * b + d2) / (2 * d2), h = sqrt(a * a / d2 - t * t);
    const point P = {A.x + t * dx - h * dy, A.y + t * dy + h * dx};
    return P;
}

static point at(point O, double angle, double x, double y)
{
    const double c = cos(angle), s = sin(angle);
    const point P = {O.x + c * x - s * y, O.y + s * x + c * y};
    return P;
}

static double turn(double a) { return a - 2 * M_PI * floor(a / (2 * M_PI) + 0.5); }

void five_bar_forward(long n, const double *u, double *out)
{
    const point zero = {0, 0}, E = {0.2, 0};
    for (long k = 0; k < n; k++) {
        const point P = meeting(at(zero, u[2 * k], 0.2, 0), 0.3, at(E, u[2 * k + 1], 0.2, 0), 0.3);
        out[2 * k] = P.x;
        out[2 * k + 1] = P.y;
    }
}

void five_bar_inverse(long n, const double *u, double *out)
{
    const point zero = {0, 0}, E = {0.2, 0};
    for (long k = 0; k < n; k++) {
        const point P = {u[2 * k], u[2 * k + 1]};
        const point B = meeting(zero, 0.2, P, 0.3), D = meeting(P, 0.3, E, 0.2);
        out[2 * k] = atan2(B.y, B.x);
        out[2 * k + 1] = atan2(D.y, D.x - 0.2);
    }
}

void delta_forward(long n, const double *u, double *out)
{
    const double c[3] = {1, -0.5, -0.5}, s[3] = {0, sqrt(3) / 2, -sqrt(3) / 2}, l = 0.6;
    for (long k = 0; k < n; k++) {
        double p[3][3], a[3], b[3], m[3], w[3];
        for (int i = 0; i < 3; i++) {
            const double far = 0.2 + 0.25 * cos(u[3 * k + i]) - 0.06;
            p[i][0] = c[i] * far;
            p[i][1] = s[i] * far;
            p[i][2] = -0.25 * sin(u[3 * k + i]);
        }
        for (int i = 0; i < 3; i++) a[i] = p[1][i] - p[0][i], b[i] = p[2][i] - p[0][i];
        const double aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
        const double bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2];
        const double ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2], det = aa * bb - ab * ab;
        const double v = (aa / 2 * bb - bb / 2 * ab) / det, q = (bb / 2 * aa - aa / 2 * ab) / det;
        for (int i = 0; i < 3; i++) m[i] = v * a[i] + q * b[i];
        w[0] = a[1] * b[2] - a[2] * b[1];
        w[1] = a[2] * b[0] - a[0] * b[2];
        w[2] = a[0] * b[1] - a[1] * b[0];
        const double mm = m[0] * m[0] + m[1] * m[1] + m[2] * m[2];
        const double h = -sqrt((l * l - mm) / det) * (w[2] > 0 ? 1 : -1);
        for (int i = 0; i < 3; i++) out[3 * k + i] = p[0][i] + m[i] + h * w[i];
    }
}

void excavator_forward(long n, const double *u, double *out)
{
    const point O = {0, 0}, Cb = {0.6, -0.3};
    for (long k = 0; k < n; k++) {
        const point Kb = meeting(O, hypot(2.2, 0.5), Cb, u[3 * k]);
        const double boom = atan2(Kb.y, Kb.x) - atan2(0.5, 2.2);
        const point A = at(O, boom, 5, 0), Ca = at(O, boom, 2, 0.9);
        const point Ka = meeting(Ca, u[3 * k + 1], A, hypot(0.6, 0.15));
        const double arm = atan2(Ka.y - A.y, Ka.x - A.x) - atan2(0.15, -0.6);
        const point Cq = at(A, arm, 0.3, 0.45), R = at(A, arm, 2.2, 0), Q = at(A, arm, 2.6, 0);
        const point S = meeting(Cq, u[3 * k + 2], R, 0.5);
        const point T = meeting(S, 0.62, Q, hypot(0.1368, 0.3759));
        const double bucket = turn(atan2(T.y - Q.y, T.x - Q.x) - atan2(0.3759, -0.1368));
        const point W = at(Q, bucket, 1.3, 0);
        out[3 * k] = W.x;
        out[3 * k + 1] = W.y;
        out[3 * k + 2] = bucket;
    }
}

void excavator_inverse(long n, const double *u, double *out)
{
    const point O = {0, 0}, Cb = {0.6, -0.3};
    for (long k = 0; k < n; k++) {
        const point W = {u[3 * k], u[3 * k + 1]}, Q = at(W, u[3 * k + 2], -1.3, 0);
        const point A = meeting(O, 5, Q, 2.6);
        const double boom = atan2(A.y, A.x), arm = atan2(Q.y - A.y, Q.x - A.x);
        const point Kb = at(O, boom, 2.2, 0.5), Ca = at(O, boom, 2, 0.9);
        const point Ka = at(A, arm, -0.6, 0.15), Cq = at(A, arm, 0.3, 0.45), R = at(A, arm, 2.2, 0);
        const point S = meeting(R, 0.5, at(Q, u[3 * k + 2], -0.1368, 0.3759), 0.62);
        out[3 * k] = hypot(Kb.x - Cb.x, Kb.y - Cb.y);
        out[3 * k + 1] = hypot(Ka.x - Ca.x, Ka.y - Ca.y);
        out[3 * k + 2] = hypot(S.x - Cq.x, S.y - Cq.y);
    }
}

void hexapod_inverse(long n, const double *u, double *out)
{
    const double feet[6] = {-10, 10, 110, 130, 230, 250}, balls[6] = {-50, 50, 70, 170, 190, 290};
    double f[6][2], b[6][2];
    for (int i = 0; i < 6; i++) {
        f[i][0] = 0.5 * cos(feet[i] * M_PI / 180);
        f[i][1] = 0.5 * sin(feet[i] * M_PI / 180);
        b[i][0] = 0.25 * cos(balls[i] * M_PI / 180);
        b[i][1] = 0.25 * sin(balls[i] * M_PI / 180);
    }
    for (long k = 0; k < n; k++) {
        const double *q = u + 6 * k;
        const double cy = cos(q[3]), sy = sin(q[3]), cp = cos(q[4]), sp = sin(q[4]);
        const double cr = cos(q[5]), sr = sin(q[5]);
        for (int i = 0; i < 6; i++) {
            const double y = cr * b[i][1], z = sr * b[i][1], x = cp * b[i][0] + sp * z;
            const double dx = q[0] + cy * x - sy * y - f[i][0], dy = q[1] + sy * x + cy * y - f[i][1];
            const double dz = q[2] - sp * b[i][0] + cp * z;
            out[6 * k + i] = sqrt(dx * dx + dy * dy + dz * dz);
        }
    }
}
