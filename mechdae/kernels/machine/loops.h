/* The instructions over blocks of poses; included once for each set of vector instructions.

   p[k] is where slot k of this block is, w[k] the value of a slot that all poses share. */

#define BOTH(code, expression)                                                                  \
    case code: {                                                                                \
        EVERY d[i] = expression;                                                                \
        break;                                                                                  \
    }

static TARGET void RUN(const Step *step, const Step *end, double *const *p, const double *w,
                       int m, int few)
{
    double kept[LARGEST_BLOCK], other[LARGEST_BLOCK];
    for (; step < end; step++) {
        double *d = p[step->d];
        const double *a = p[step->a], *b = p[step->b], *c = p[step->c];
        double s = w[step->a], t = w[step->b], u = w[step->c];
        switch (step->op) {
        BOTH(ADD, a[i] + b[i])
        BOTH(SUB, a[i] - b[i])
        BOTH(MUL, a[i] * b[i])
        BOTH(DIV, a[i] / b[i])
        BOTH(ADD_VS, a[i] + t)
        BOTH(SUB_VS, a[i] - t)
        BOTH(MUL_VS, a[i] * t)
        BOTH(DIV_VS, a[i] / t)
        BOTH(SUB_SV, s - b[i])
        BOTH(DIV_SV, s / b[i])
        BOTH(MUL_ADD, a[i] * b[i] + c[i])
        BOTH(MUL_SUB, a[i] * b[i] - c[i])
        BOTH(SUB_MUL, c[i] - a[i] * b[i])
        BOTH(MULS_ADD, a[i] * t + c[i])
        BOTH(MULS_SUB, a[i] * t - c[i])
        BOTH(SUB_MULS, c[i] - a[i] * t)
        BOTH(MUL_ADDS, a[i] * b[i] + u)
        BOTH(MUL_SUBS, a[i] * b[i] - u)
        BOTH(SUBS_MUL, u - a[i] * b[i])
        BOTH(NEG, -a[i])
        BOTH(SQ, a[i] * a[i])
        BOTH(TWICE, a[i] + a[i])
        BOTH(INV, 1.0 / a[i])
        BOTH(SQRT, sqrt(a[i]))
        BOTH(FABS, fabs(a[i]))
        BOTH(COPY, a[i])
        BOTH(FILL, s)
        BOTH(MIN, (a[i] < b[i] || a[i] != a[i]) ? a[i] : b[i])
        BOTH(MAX, (a[i] > b[i] || a[i] != a[i]) ? a[i] : b[i])
        BOTH(SIGN, a[i] > 0 ? 1.0 : a[i] < 0 ? -1.0 : a[i] == 0 ? 0.0 : a[i])
        BOTH(LT, a[i] < b[i] ? 1.0 : 0.0)
        BOTH(LE, a[i] <= b[i] ? 1.0 : 0.0)
        BOTH(EQ, a[i] == b[i] ? 1.0 : 0.0)
        BOTH(NE, a[i] != b[i] ? 1.0 : 0.0)
        BOTH(NOT, a[i] == 0 ? 1.0 : 0.0)
        BOTH(AND, (a[i] != 0) & (b[i] != 0) ? 1.0 : 0.0)
        BOTH(OR, (a[i] != 0) | (b[i] != 0) ? 1.0 : 0.0)
        BOTH(IF_ELSE_ZERO, a[i] != 0 ? b[i] : 0.0)
        BOTH(REMAINDER, a[i] - b[i] * rint(a[i] / b[i]))
        BOTH(POW, pow(a[i], b[i]))
        BOTH(TAN, tan(a[i]))
        BOTH(ASIN, asin(a[i]))
        BOTH(ACOS, acos(a[i]))
        BOTH(ATAN, atan(a[i]))
        BOTH(ATAN2, atan2(a[i], b[i]))
        BOTH(SINH, sinh(a[i]))
        BOTH(COSH, cosh(a[i]))
        BOTH(TANH, tanh(a[i]))
        BOTH(EXP, exp(a[i]))
        BOTH(LOG, log(a[i]))
        case SIN_COS:
            memcpy(kept, a, m * sizeof(double));
            turned(kept, d, p[step->b], m, few);
            break;
        case SIN:
            memcpy(kept, a, m * sizeof(double));
            turned(kept, d, other, m, few);
            break;
        case COS:
            memcpy(kept, a, m * sizeof(double));
            turned(kept, other, d, m, few);
            break;
        }
    }
}
#undef BOTH
#undef RUN
#undef TARGET
