/* The closed-form four-bar: angles of coupler and rocker with two derivatives by the crank's. */
#include <math.h>

void fourbar(long n, const double *t2, const double *lengths, double *out)
{
    const double a = lengths[0], b = lengths[1], c = lengths[2], d = lengths[3];
    double *t3 = out, *t4 = out + n, *v3 = out + 2 * n, *v4 = out + 3 * n;
    double *a3 = out + 4 * n, *a4 = out + 5 * n;
    for (long k = 0; k < n; k++) {
        const double ax = a * cos(t2[k]), ay = a * sin(t2[k]), dx = d - ax, dy = -ay;
        const double e2 = dx * dx + dy * dy, e = sqrt(e2);
        const double t = atan2(dy, dx) + acos((e2 + b * b - c * c) / (2 * b * e));
        const double q = atan2(ay + b * sin(t), ax + b * cos(t) - d);
        const double s = sin(q - t), m = cos(q - t);
        const double v = a * sin(t2[k] - q) / (b * s), w = a * sin(t2[k] - t) / (c * s);
        t3[k] = t;
        t4[k] = q;
        v3[k] = v;
        v4[k] = w;
        a3[k] = (a * cos(t2[k] - q) + b * v * v * m - c * w * w) / (b * s);
        a4[k] = (a * cos(t2[k] - t) + b * v * v - c * w * w * m) / (c * s);
    }
}
