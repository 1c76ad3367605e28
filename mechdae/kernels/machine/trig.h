/* Sine and cosine of many numbers at once, within 1 ulp.

   The argument is reduced by multiples of pi/2 held in two pieces of 33 bits and a rest
   (Cody and Waite), which leaves a remainder y + z that is exact to 2^-70; the polynomials
   are those of fdlibm (S. Moshier's and Sun's kernels, sin and cos on |y| < pi/4, with the
   tail z taken along).  Numbers that are too large for that, that are not finite, or that
   lie next to a multiple of pi/2, are left to the C library. */

#define FAR_AWAY 524288.0
#define NEXT_TO 0x1p-20
#define TWO_OVER_PI 6.36619772367581382433e-01
#define ROUND_IT 0x1.8p52
#define PI_1 1.57079632673412561417e+00
#define PI_2 6.07710050630396597660e-11
#define PI_2_REST 2.02226624879595063154e-21

typedef union {
    double d;
    uint64_t u;
} Bits;

INLINE void reduced_sine_cosine(double x, double *sine, double *cosine)
{
    Bits turns, s, c, mask, ks, kc;
    turns.d = x * TWO_OVER_PI + ROUND_IT;
    double k = turns.d - ROUND_IT;
    double t = x - k * PI_1, w = k * PI_2;
    double r = t - w;
    w = k * PI_2_REST - ((t - r) - w);
    double y = r - w, z = (r - y) - w;
    double q = y * y, v = q * y;
    double p = 8.33333333332248946124e-03 +
               q * (-1.98412698298579493134e-04 +
                    q * (2.75573137070700676789e-06 +
                         q * (-2.50507602534068634195e-08 + q * 1.58969099521155010221e-10)));
    ks.d = y - ((q * (0.5 * z - v * p) - z) - v * -1.66666666666666324348e-01);
    double g = q * (4.16666666666666019037e-02 +
                    q * (-1.38888888888741095749e-03 + q * 2.48015872894767294178e-05)) +
               q * q * (q * q) *
                   (-2.75573143513906633035e-07 +
                    q * (2.08757232129817482790e-09 + q * -1.13596475577881948265e-11));
    double half = 0.5 * q, one = 1.0 - half;
    kc.d = one + (((1.0 - one) - half) + (q * g - y * z));
    mask.u = 0 - (turns.u & 1);
    s.u = (ks.u & ~mask.u) | (kc.u & mask.u);
    c.u = (kc.u & ~mask.u) | (ks.u & mask.u);
    s.u ^= (turns.u & 2) << 62;
    c.u ^= ((turns.u + 1) & 2) << 62;
    *sine = s.d;
    *cosine = c.d;
}

/* Highest bit: whether sine and cosine of x have to be left to the C library. */
INLINE uint64_t is_left(double x, double sine, double cosine)
{
    const Bits far_away = {FAR_AWAY}, half = {0.5}, next_to = {NEXT_TO};
    const uint64_t size = ~((uint64_t)1 << 63);
    Bits X = {x}, s = {sine}, c = {cosine};
    uint64_t moved = X.u & size; /* bits of positive numbers are in their order, nan is last */
    return (far_away.u - moved) |
           ((half.u - moved) & (((s.u & size) - next_to.u) | ((c.u & size) - next_to.u)));
}

/* Sines and cosines of x; what has to be left to the C library is done again by it. */
INLINE void sines_cosines(const double *x, double *sines, double *cosines, int m)
{
    uint64_t left = 0;
    EVERY reduced_sine_cosine(x[i], sines + i, cosines + i);
    EVERY left |= is_left(x[i], sines[i], cosines[i]);
    if (!(left >> 63))
        return;
    for (int i = 0; i < m; i++) {
        if (is_left(x[i], sines[i], cosines[i]) >> 63) {
            sines[i] = sin(x[i]);
            cosines[i] = cos(x[i]);
        }
    }
}

/* The same, of few poses by the C library. */
INLINE void turned(const double *x, double *sines, double *cosines, int m, int few)
{
    if (!few) {
        sines_cosines(x, sines, cosines, m);
        return;
    }
    for (int i = 0; i < m; i++) {
        sines[i] = sin(x[i]);
        cosines[i] = cos(x[i]);
    }
}
