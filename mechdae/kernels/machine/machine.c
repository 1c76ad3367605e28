/* A register machine for the instruction lists of casadi's scalar functions.

   A list is put into order once: constants and what all poses share are computed once a call,
   a product that is used once joins the sum it goes into (rounded twice, as before), sine and
   cosine of one angle are one instruction, values get places until their last use. It then
   runs for one set of numbers, with the operations of the C library, or for blocks of poses
   that fit into the first caches, one vector loop for each instruction.

   Every operation is rounded as IEEE 754 says, whichever vector instructions there are: no
   contraction, no reordering. The Python interface is the stable one of 3.11. */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030b0000
#include <Python.h>
#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define ABI 2 /* the same number is in library.py */
#define LARGEST_BLOCK 512
#define BLOCK_BYTES 131072 /* of the registers of a block: half of a small second cache */
#define FEW 512 /* poses up to which sine and cosine are the C library's, as in casadi's machine */
#define INLINE static inline __attribute__((always_inline))
#if defined(__clang__)
#define EVERY _Pragma("clang loop vectorize(assume_safety)") for (int i = 0; i < m; i++)
#else
#define EVERY _Pragma("GCC ivdep") for (int i = 0; i < m; i++)
#endif

/* Names in this order are in program.py, up to LOG. */
enum {
    INPUT, OUTPUT, CONST, COPY, ADD, SUB, MUL, DIV, NEG, SQ, TWICE, INV, SQRT, SIN, COS, TAN, ASIN,
    ACOS, ATAN, ATAN2, SINH, COSH, TANH, EXP, LOG, POW, FABS, SIGN, MIN, MAX, LT, LE, EQ, NE, NOT,
    AND, OR, IF_ELSE_ZERO, REMAINDER, KNOWN,
    ADD_VS, SUB_VS, MUL_VS, DIV_VS, SUB_SV, DIV_SV, MUL_ADD, MUL_SUB, SUB_MUL, MULS_ADD, MULS_SUB,
    SUB_MULS, MUL_ADDS, MUL_SUBS, SUBS_MUL, FILL, SIN_COS
};
#define NONE 255

typedef struct {
    int32_t op, d, a, b, c;
} Step;

#include "trig.h"

#define RUN run_plain
#define TARGET
#include "loops.h"
#if defined(__x86_64__)
#define RUN run_avx2
#define TARGET __attribute__((target("avx2")))
#include "loops.h"
#define RUN run_avx512
#if defined(__clang__)
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))
#else
#define TARGET __attribute__((target("avx512f,avx512dq,avx512vl,prefer-vector-width=512")))
#endif
#include "loops.h"
#endif

typedef void Runner(const Step *, const Step *, double *const *, const double *, int, int);
static Runner *runners[3] = {run_plain};
static const char *names[3] = {"baseline"};
static int levels = 1, level = 0;

/* One set of numbers, as casadi's own machine does it. */
static void run_one(const Step *step, const Step *end, double *w)
{
    for (; step < end; step++) {
        double a = w[step->a], b = w[step->b], *d = w + step->d;
        switch (step->op) {
        case ADD: case ADD_VS: *d = a + b; break;
        case SUB: case SUB_VS: case SUB_SV: *d = a - b; break;
        case MUL: case MUL_VS: *d = a * b; break;
        case DIV: case DIV_VS: case DIV_SV: *d = a / b; break;
        case MUL_ADD: case MULS_ADD: case MUL_ADDS: *d = a * b + w[step->c]; break;
        case MUL_SUB: case MULS_SUB: case MUL_SUBS: *d = a * b - w[step->c]; break;
        case SUB_MUL: case SUB_MULS: case SUBS_MUL: *d = w[step->c] - a * b; break;
        case NEG: *d = -a; break;
        case SQ: *d = a * a; break;
        case TWICE: *d = a + a; break;
        case INV: *d = 1.0 / a; break;
        case SQRT: *d = sqrt(a); break;
        case FABS: *d = fabs(a); break;
        case COPY: case FILL: *d = a; break;
        case MIN: *d = fmin(a, b); break;
        case MAX: *d = fmax(a, b); break;
        case SIGN: *d = a < 0 ? -1.0 : a > 0 ? 1.0 : a; break;
        case LT: *d = a < b; break;
        case LE: *d = a <= b; break;
        case EQ: *d = a == b; break;
        case NE: *d = a != b; break;
        case NOT: *d = a == 0; break;
        case AND: *d = a != 0 && b != 0; break;
        case OR: *d = a != 0 || b != 0; break;
        case IF_ELSE_ZERO: *d = a != 0 ? b : 0.0; break;
        case REMAINDER: *d = remainder(a, b); break;
        case POW: *d = pow(a, b); break;
        case SIN: *d = sin(a); break;
        case COS: *d = cos(a); break;
        case SIN_COS: *d = sin(a); w[step->b] = cos(a); break;
        case TAN: *d = tan(a); break;
        case ASIN: *d = asin(a); break;
        case ACOS: *d = acos(a); break;
        case ATAN: *d = atan(a); break;
        case ATAN2: *d = atan2(a, b); break;
        case SINH: *d = sinh(a); break;
        case COSH: *d = cosh(a); break;
        case TANH: *d = tanh(a); break;
        case EXP: *d = exp(a); break;
        case LOG: *d = log(a); break;
        }
    }
}

/* ---- a function in order ------------------------------------------------------------------ */

typedef struct {
    PyObject_HEAD
    int n_in, n_out;
    int32_t *rows_in, *rows_out;   /* how many rows each has */
    int32_t *first_in, *first_out; /* the slot of its first row */
    uint8_t *shared;
    int inputs, outputs;           /* rows of all of them */
    int slots, registers, work;    /* work: the first register, behind it nothing else */
    Step *once, *line;
    int n_once, n_line;
    double *numbers;               /* slots when a call begins: constants, the rest 0 */
    int32_t *places;               /* where each output is, -1: unwanted */
    uint8_t *computed;             /* whether an output is a place of its own */
    int n_computed, lean;          /* lean: each value is written once, `block` only */
    int block;
    double *spare_one, *spare_many;/* memory between two calls, for the thread that takes it */
    atomic_flag one_taken, many_taken;
} Program;

typedef struct {
    int32_t op, i0;
    union {
        int32_t i[2];
        double d;
    } u;
} Raw;

/* A value while a list is put into order; `kind` 0: shared by all poses, else of each pose. */
typedef struct {
    int32_t slot, step, uses, last, needs;
    uint8_t kind, result;
} Value;

typedef struct {
    Step s;        /* with values in place of slots */
    int32_t needs; /* the highest row of the first input that it needs */
    uint8_t kind, gone;
} Draft;

static int arguments(int op)
{
    switch (op) {
    case INPUT: case CONST: return 0;
    case OUTPUT: case COPY: case NEG: case SQ: case TWICE: case INV: case SQRT: case SIN: case COS:
    case TAN: case ASIN: case ACOS: case ATAN: case SINH: case COSH: case TANH: case EXP:
    case LOG: case FABS: case SIGN: case NOT: case FILL: case SIN_COS:
        return 1;
    case MUL_ADD: case MUL_SUB: case SUB_MUL: case MULS_ADD: case MULS_SUB: case SUB_MULS:
    case MUL_ADDS: case MUL_SUBS: case SUBS_MUL:
        return 3;
    default:
        return 2;
    }
}

/* Choose the form of a step whose operands may be shared; -1 where there is none. */
static int form_of(Step *s, const Value *v)
{
    int a = v[s->a].kind, b = v[s->b].kind, x;
    switch (s->op) {
    case ADD: case MUL:
        if (!a) {
            x = s->a, s->a = s->b, s->b = x;
            b = 0;
        }
        return b ? s->op : s->op == ADD ? ADD_VS : MUL_VS;
    case SUB: return !a ? SUB_SV : !b ? SUB_VS : SUB;
    case DIV: return !a ? DIV_SV : !b ? DIV_VS : DIV;
    case MUL_ADD: case MUL_SUB: case SUB_MUL:
        if (!a) {
            x = s->a, s->a = s->b, s->b = x;
            b = 0;
        }
        if (b && v[s->c].kind)
            return s->op;
        if (v[s->c].kind)
            return s->op == MUL_ADD ? MULS_ADD : s->op == MUL_SUB ? MULS_SUB : SUB_MULS;
        return !b ? -1 : s->op == MUL_ADD ? MUL_ADDS : s->op == MUL_SUB ? MUL_SUBS : SUBS_MUL;
    default:
        if (!a || (arguments(s->op) == 2 && !b))
            return -1;
        return s->op;
    }
}

/* What becomes of a list. */
typedef struct {
    Program *P;
    Value *v;
    Draft *draft;
    int values, drafts, highest; /* highest row of the first input that anything needs */
    int32_t *at, *sine, *order, *tally, *spare; /* spare: registers that are free */
    int spares, kept;                           /* kept: steps of each pose */
    double *constants;
    int shared_slots;
} List;

static int value_of(const List *L, int32_t place, int work)
{
    return place < 0 || place >= work ? -1 : L->at[place];
}

/* Read the instructions: values in place of casadi's work vector. 0, or -1: damaged. */
static int read_list(List *L, const Raw *raw, int n, int work, const uint8_t *table)
{
    Program *P = L->P;
    for (int k = 0; k < work; k++)
        L->at[k] = -1;
    for (int i = 0; i < P->n_in; i++)
        for (int k = 0; k < P->rows_in[i]; k++, L->values++)
            L->v[L->values] = (Value){.slot = L->values, .step = -1, .kind = !P->shared[i],
                                      .needs = !P->shared[i] && !i ? k : -1};
    L->shared_slots = P->inputs; /* behind them: constants and what all poses share */
    for (int k = 0; k < n; k++) {
        int op = raw[k].op >= 0 && raw[k].op < 256 ? table[raw[k].op] : NONE, to = raw[k].i0;
        Draft *own = L->draft + L->drafts;
        Value *made = L->v + L->values;
        if (op == OUTPUT) {
            int row = raw[k].u.i[1], x = value_of(L, raw[k].u.i[0], work);
            if (x < 0 || to < 0 || to >= P->n_out || row < 0 || row >= P->rows_out[to])
                return -1;
            if (P->places[P->first_out[to] + row] == -2) /* unwanted */
                continue;
            own->s = (Step){OUTPUT, P->first_out[to] + row, x, x, x};
            own->kind = 1, own->needs = L->v[x].needs;
            L->drafts++;
            continue;
        }
        if (op >= KNOWN || to < 0 || to >= work)
            return -1;
        if (op == INPUT) {
            int which = raw[k].u.i[0], row = raw[k].u.i[1];
            if (which < 0 || which >= P->n_in || row < 0 || row >= P->rows_in[which])
                return -1;
            L->at[to] = P->first_in[which] + row;
        } else if (op == CONST) {
            *made = (Value){.slot = L->shared_slots, .step = -1, .needs = -1};
            L->constants[L->shared_slots++ - P->inputs] = raw[k].u.d;
            L->at[to] = L->values++;
        } else {
            int x = value_of(L, raw[k].u.i[0], work);
            int y = arguments(op) == 2 ? value_of(L, raw[k].u.i[1], work) : x;
            if (x < 0 || y < 0)
                return -1;
            if (op == COPY) {
                L->at[to] = x;
                continue;
            }
            own->s = (Step){op, L->values, x, y, x};
            own->kind = L->v[x].kind | L->v[y].kind;
            own->needs = L->v[x].needs > L->v[y].needs ? L->v[x].needs : L->v[y].needs;
            *made = (Value){.step = L->drafts++, .kind = own->kind, .needs = own->needs};
            if (!own->kind)
                made->slot = L->shared_slots++;
            L->at[to] = L->values++;
        }
    }
    return 0;
}

/* Count how often values are used; what nothing needs goes. */
static void count_uses(List *L)
{
    for (int k = 0; k < L->drafts; k++) {
        Draft *own = L->draft + k;
        L->v[own->s.a].uses++;
        if (arguments(own->s.op) == 2)
            L->v[own->s.b].uses++;
        if (own->needs > L->highest)
            L->highest = own->needs;
    }
    for (int k = L->drafts - 1; k >= 0; k--) {
        Draft *own = L->draft + k;
        if (own->s.op == OUTPUT || L->v[own->s.d].uses)
            continue;
        own->gone = 1;
        L->v[own->s.a].uses--;
        if (arguments(own->s.op) == 2)
            L->v[own->s.b].uses--;
    }
}

/* One instruction for sine and cosine of a value. */
static void join_sine(List *L, int k)
{
    Step *s = &L->draft[k].s;
    int first = L->sine[s->a];
    if (first < 0 || L->draft[first].s.op == SIN_COS || L->draft[first].s.op == s->op) {
        L->sine[s->a] = k;
        return;
    }
    Step *f = &L->draft[first].s;
    int forwards = f->op == SIN;
    *f = (Step){SIN_COS, forwards ? f->d : s->d, f->a, forwards ? s->d : f->d, f->a};
    L->v[s->d].step = first;
    L->v[s->a].uses--;
    L->draft[k].gone = 1;
}

/* One instruction for a sum and a product that only it uses. */
static void join_product(List *L, int k)
{
    Step *s = &L->draft[k].s;
    for (int side = 0; side < 2 && s->a != s->b; side++) {
        const Value *x = L->v + (side ? s->b : s->a);
        if (!x->kind || x->uses != 1 || x->step < 0 || L->draft[x->step].s.op != MUL)
            continue;
        Draft *f = L->draft + x->step;
        int op = s->op == ADD ? MUL_ADD : side ? SUB_MUL : MUL_SUB;
        Step whole = {op, s->d, f->s.a, f->s.b, side ? s->a : s->b}, tried = whole;
        if (form_of(&tried, L->v) < 0)
            continue;
        *s = whole;
        f->gone = 1;
        return;
    }
}

/* What belongs together is computed together: stable order of the highest row needed. */
static void put_in_order(List *L)
{
    for (int k = 0; k < L->drafts; k++)
        if (!L->draft[k].gone && L->draft[k].kind)
            L->tally[L->draft[k].needs + 2]++, L->kept++;
    for (int k = 1; k < L->highest + 3; k++)
        L->tally[k] += L->tally[k - 1];
    for (int k = 0; k < L->drafts; k++)
        if (!L->draft[k].gone && L->draft[k].kind)
            L->order[L->tally[L->draft[k].needs + 1]++] = k;
}

/* What all poses share, and the last use of each value; results are their own places. */
static void find_places(List *L)
{
    Program *P = L->P;
    for (int k = 0; k < L->drafts; k++) {
        const Step *s = &L->draft[k].s;
        if (!L->draft[k].kind && !L->draft[k].gone)
            P->once[P->n_once++] = (Step){s->op, L->v[s->d].slot, L->v[s->a].slot,
                                          L->v[s->b].slot, L->v[s->a].slot};
    }
    for (int k = 0; k < L->kept; k++) {
        const Step *s = &L->draft[L->order[k]].s;
        int many = arguments(s->op);
        L->v[s->a].last = k;
        if (many >= 2)
            L->v[s->b].last = k;
        if (many == 3)
            L->v[s->c].last = k;
    }
    for (int k = L->kept - 1; k >= 0; k--) {
        const Step *s = &L->draft[L->order[k]].s;
        if (s->op == OUTPUT && L->v[s->a].kind && L->v[s->a].step >= 0)
            L->v[s->a].result = 1, L->v[s->a].slot = P->work - P->outputs + s->d;
    }
}

static int a_register(List *L)
{
    return L->spares ? L->spare[--L->spares] : L->P->work + L->P->registers++;
}

/* Append a step of each pose with places in place of values. */
static void place_step(List *L, int k)
{
    Program *P = L->P;
    Step s = L->draft[L->order[k]].s;
    Value *v = L->v, *x = v + s.a;
    if (s.op == OUTPUT) {
        int to = P->work - P->outputs + s.d;
        P->places[s.d] = x->slot;
        P->computed[s.d] = x->result && x->slot == to;
        P->n_computed += P->computed[s.d];
        if (!P->computed[s.d] && !P->lean)
            P->line[P->n_line++] = (Step){x->kind ? COPY : FILL, to, x->slot, 0, 0};
        return;
    }
    int many = arguments(s.op), second = s.op == SIN_COS ? s.b : -1, form = form_of(&s, v);
    int32_t operands[3] = {s.a, s.b, s.c}, slots[3] = {0, 0, 0}, targets[2] = {s.d, second};
    for (int i = 0; i < many; i++) {
        x = v + operands[i];
        slots[i] = x->slot;
        if (form < 0 && !x->kind) { /* there is no form for what all poses share */
            slots[i] = a_register(L);
            P->line[P->n_line++] = (Step){FILL, slots[i], x->slot, 0, 0};
        }
    }
    for (int i = 0; i < many; i++) {
        x = v + operands[i];
        if (form < 0 && !x->kind)
            L->spare[L->spares++] = slots[i];
        else if (x->kind && x->step >= 0 && !x->result && x->last == k) {
            L->spare[L->spares++] = x->slot;
            x->last = -1; /* the same operand twice */
        }
    }
    for (int i = 0; i < 2 && targets[i] >= 0; i++)
        if (!v[targets[i]].result)
            v[targets[i]].slot = a_register(L);
    if (second >= 0)
        slots[1] = v[second].slot;
    P->line[P->n_line++] =
        (Step){form < 0 ? s.op : form, v[s.d].slot, slots[0], slots[1], slots[2]};
    for (int i = 0; i < 2 && targets[i] >= 0; i++) /* what nothing reads */
        if (!v[targets[i]].result && !v[targets[i]].uses)
            L->spare[L->spares++] = v[targets[i]].slot;
}

/* Put `n` instructions into order. 0, or -1: memory ends or the list is damaged. */
static int ordered(Program *P, const Raw *raw, int n, int work, const uint8_t *table)
{
    List L = {.P = P, .highest = -1};
    int result = -1, most = n + P->inputs + 1;
    L.v = calloc(most, sizeof(Value));
    L.draft = calloc(n + 1, sizeof(Draft));
    L.at = malloc((work + 1) * sizeof(int32_t));
    L.sine = malloc(most * sizeof(int32_t));
    L.order = malloc((n + 1) * sizeof(int32_t));
    L.spare = malloc((4 * (size_t)n + 1) * sizeof(int32_t));
    L.constants = calloc(n + 1, sizeof(double));
    P->once = malloc((n + 1) * sizeof(Step));
    P->line = malloc((3 * (size_t)n + 1) * sizeof(Step));
    if (!L.v || !L.draft || !L.at || !L.sine || !L.order || !L.spare || !L.constants || !P->once ||
        !P->line || read_list(&L, raw, n, work, table))
        goto done;
    count_uses(&L);
    L.tally = calloc(L.highest + 3, sizeof(int32_t));
    if (!L.tally)
        goto done;
    for (int k = 0; k < most; k++)
        L.sine[k] = -1;
    for (int k = 0; k < L.drafts; k++) {
        int op = L.draft[k].gone ? NONE : L.draft[k].s.op;
        if (L.draft[k].kind && (op == SIN || op == COS))
            join_sine(&L, k);
        else if (L.draft[k].kind && (op == ADD || op == SUB))
            join_product(&L, k);
    }
    put_in_order(&L);
    P->work = L.shared_slots + P->outputs;
    find_places(&L);
    for (int k = 0; k < L.kept; k++)
        place_step(&L, k);
    P->slots = P->work + P->registers;
    P->numbers = calloc(P->slots + 1, sizeof(double));
    if (!P->numbers)
        goto done;
    memcpy(P->numbers + P->inputs, L.constants, (L.shared_slots - P->inputs) * sizeof(double));
    result = 0;
done:
    free(L.v), free(L.draft), free(L.at), free(L.sine), free(L.order), free(L.tally);
    free(L.spare), free(L.constants);
    return result;
}

/* ---- running ------------------------------------------------------------------------------ */

/* `results`: where each output goes, NULL where it is not computed. */
static void run_many(const Program *P, Py_ssize_t n, const char *const *data,
                     const Py_ssize_t *of_pose, const Py_ssize_t *of_row, double *const *results,
                     double *memory)
{
    /* memory: slots once, registers and staged inputs of a block, places */
    double *w = memory, *blocks = w + P->slots + 8;
    double **p = (double **)(blocks + (size_t)P->block * (P->registers + P->inputs));
    int i, k, m, size = P->block;
    memcpy(w, P->numbers, P->slots * sizeof(double));
    for (i = 0; i < P->n_in; i++)
        if (P->shared[i])
            for (k = 0; k < P->rows_in[i]; k++)
                w[P->first_in[i] + k] = *(const double *)(data[i] + k * of_row[i]);
    run_one(P->once, P->once + P->n_once, w);
    for (k = 0; k < P->slots; k++)
        p[k] = w + k;
    for (k = 0; k < P->registers; k++)
        p[P->work + k] = blocks + (size_t)k * size;
    double *staged = blocks + (size_t)P->registers * size;
    for (Py_ssize_t from = 0; from < n; from += size) {
        m = n - from < size ? (int)(n - from) : size;
        for (i = 0; i < P->n_in; i++) {
            if (P->shared[i])
                continue;
            const char *base = data[i] + from * of_pose[i];
            for (k = 0; k < P->rows_in[i]; k++) {
                int slot = P->first_in[i] + k;
                const char *own = base + k * of_row[i];
                if (of_pose[i] == sizeof(double)) {
                    p[slot] = (double *)own;
                    continue;
                }
                double *to = p[slot] = staged + (size_t)slot * size;
                for (int j = 0; j < m; j++)
                    to[j] = *(const double *)(own + j * of_pose[i]);
            }
        }
        for (k = 0; k < P->outputs; k++)
            if (results[k])
                p[P->work - P->outputs + k] = results[k] + from;
        runners[level](P->line, P->line + P->n_line, p, w, m, n < FEW);
    }
}

static size_t memory_of(const Program *P)
{
    return (P->slots + 8 + (size_t)P->block * (P->registers + P->inputs)) * sizeof(double) +
           (P->slots + 1) * sizeof(double *);
}

static PyObject *empty, *name_T; /* numpy.empty and "T" */

#define MOST 64 /* inputs or outputs of a function */

static void release(Py_buffer *views, int count)
{
    for (int i = 0; i < count; i++)
        PyBuffer_Release(views + i);
}

/* Get float64 arrays; returns how many, -1 with an exception. */
static int views_of(Program *P, PyObject *const *args, Py_buffer *views, int many, int turned)
{
    for (int i = 0; i < P->n_in; i++) {
        Py_buffer *own = views + i;
        int vector = !many || P->shared[i];
        if (PyObject_GetBuffer(args[i], own, PyBUF_STRIDES | PyBUF_FORMAT)) {
            release(views, i);
            return -1;
        }
        if (own->itemsize != 8 || !own->format || strcmp(own->format, "d") ||
            own->ndim != (vector ? 1 : 2) || own->shape[vector ? 0 : !turned] != P->rows_in[i]) {
            PyErr_Format(PyExc_TypeError, "input %d is no float64 array of %d rows", i,
                         P->rows_in[i]);
            release(views, i + 1);
            return -1;
        }
    }
    return P->n_in;
}

/* Inputs of many poses: where they are; returns how many poses, -1 with an exception. */
static Py_ssize_t poses_of(const Program *P, const Py_buffer *views, const char **data,
                           Py_ssize_t *of_pose, Py_ssize_t *of_row, int turned)
{
    Py_ssize_t n = -1;
    for (int i = 0; i < P->n_in; i++) {
        data[i] = views[i].buf;
        if (P->shared[i]) {
            of_pose[i] = 0, of_row[i] = views[i].strides[0];
            continue;
        }
        of_pose[i] = views[i].strides[turned], of_row[i] = views[i].strides[!turned];
        Py_ssize_t own = views[i].shape[turned];
        if (n < 0)
            n = own;
        else if (own == 1)
            of_pose[i] = 0; /* one for all poses */
        else if (n != own) {
            PyErr_Format(PyExc_ValueError, "inputs of %zd and %zd poses", n, own);
            return -1;
        }
    }
    return n < 0 ? 1 : n;
}

/* Run with memory that is kept between two calls. */
static int run_with_memory(Program *P, Py_ssize_t n, const char *const *data,
                           const Py_ssize_t *of_pose, const Py_ssize_t *of_row,
                           double *const *results)
{
    int mine = !atomic_flag_test_and_set(&P->many_taken);
    double *memory = mine ? P->spare_many : NULL;
    if (!memory)
        memory = malloc(memory_of(P));
    if (mine)
        P->spare_many = memory;
    if (memory) {
        Py_BEGIN_ALLOW_THREADS
        run_many(P, n, data, of_pose, of_row, results, memory);
        Py_END_ALLOW_THREADS
    } else
        PyErr_NoMemory();
    if (mine)
        atomic_flag_clear(&P->many_taken);
    else
        free(memory);
    return memory ? 0 : -1;
}

static PyObject *program_many(PyObject *self, PyObject *const *args, Py_ssize_t nargs)
{
    Program *P = (Program *)self;
    Py_buffer views[MOST], outs[MOST];
    const char *data[MOST];
    Py_ssize_t of_pose[MOST], of_row[MOST], n;
    double **results = NULL;
    PyObject *found = NULL;
    int made = 0;
    if (nargs != P->n_in || P->lean)
        return PyErr_Format(PyExc_TypeError, "%zd inputs, not %d", nargs, P->n_in);
    if (views_of(P, args, views, 1, 0) < 0)
        return NULL;
    n = poses_of(P, views, data, of_pose, of_row, 0);
    results = n < 0 ? NULL : malloc((P->outputs + 1) * sizeof(double *));
    found = results ? PyList_New(P->n_out) : NULL;
    if (!found)
        goto done;
    for (; made < P->n_out; made++) {
        PyObject *array = PyObject_CallFunction(empty, "((nn))", (Py_ssize_t)P->rows_out[made], n);
        if (!array)
            goto done;
        if (PyObject_GetBuffer(array, outs + made, PyBUF_CONTIG)) {
            Py_DECREF(array);
            goto done;
        }
        for (int k = 0; k < P->rows_out[made]; k++)
            results[P->first_out[made] + k] = (double *)outs[made].buf + k * n;
        PyObject *turned = PyObject_GetAttr(array, name_T);
        Py_DECREF(array);
        if (!turned || PyList_SetItem(found, made, turned)) {
            made++;
            goto done;
        }
    }
    run_with_memory(P, n, data, of_pose, of_row, results);
done:
    free(results);
    release(views, P->n_in);
    release(outs, made);
    if (PyErr_Occurred())
        Py_CLEAR(found);
    return found;
}

/* block(inputs (rows, n), shared ones (rows,)..., [arrays (n,) of what is computed]). */
static PyObject *program_block(PyObject *self, PyObject *const *args, Py_ssize_t nargs)
{
    Program *P = (Program *)self;
    Py_buffer views[MOST], *outs = NULL;
    const char *data[MOST];
    Py_ssize_t of_pose[MOST], of_row[MOST], n;
    double **results = NULL;
    int made = 0, place = 0;
    if (nargs != P->n_in + 1 || !PyList_Check(args[P->n_in]) ||
        PyList_Size(args[P->n_in]) != P->n_computed)
        return PyErr_Format(PyExc_TypeError, "a block of %d inputs and %d results", P->n_in,
                            P->n_computed);
    if (views_of(P, args, views, 1, 1) < 0)
        return NULL;
    n = poses_of(P, views, data, of_pose, of_row, 1);
    if (n < 0)
        goto done;
    results = calloc(P->outputs + 1, sizeof(double *));
    outs = malloc((P->n_computed + 1) * sizeof(Py_buffer));
    if (!results || !outs) {
        PyErr_NoMemory();
        goto done;
    }
    for (; made < P->n_computed; made++, place++) {
        Py_buffer *own = outs + made;
        while (!P->computed[place])
            place++;
        if (PyObject_GetBuffer(PyList_GetItem(args[P->n_in], made), own,
                               PyBUF_WRITABLE | PyBUF_STRIDES | PyBUF_FORMAT))
            goto done;
        if (strcmp(own->format, "d") || own->ndim != 1 || own->shape[0] != n ||
            (n > 1 && own->strides[0] != sizeof(double))) {
            made++;
            PyErr_Format(PyExc_TypeError, "result %d is no float64 array of %zd poses", made, n);
            goto done;
        }
        results[place] = own->buf;
    }
    run_with_memory(P, n, data, of_pose, of_row, results);
done:
    free(results);
    release(views, P->n_in);
    if (outs)
        release(outs, made);
    free(outs);
    if (PyErr_Occurred())
        return NULL;
    Py_RETURN_NONE;
}

/* Memory of one set of numbers, with constants in it; `mine`: the program's own. */
static double *taken(Program *P, int *mine)
{
    double *w;
    *mine = !atomic_flag_test_and_set(&P->one_taken);
    if (*mine && P->spare_one)
        return P->spare_one;
    w = malloc((P->slots + 1) * sizeof(double));
    if (w)
        memcpy(w, P->numbers, P->slots * sizeof(double));
    if (*mine)
        P->spare_one = w;
    return w;
}

static void given_back(Program *P, double *w, int mine)
{
    if (mine)
        atomic_flag_clear(&P->one_taken);
    else
        free(w);
}

static int put(double *to, PyObject *value, int rows)
{
    if (PyFloat_Check(value) || PyLong_Check(value)) {
        double number = PyFloat_AsDouble(value);
        if (number == -1.0 && PyErr_Occurred())
            return -1;
        for (int k = 0; k < rows; k++)
            to[k] = number;
        return 0;
    }
    Py_buffer own;
    if (PyObject_GetBuffer(value, &own, PyBUF_STRIDES | PyBUF_FORMAT))
        return -1;
    int good = own.itemsize == 8 && own.format && !strcmp(own.format, "d") && own.ndim <= 1;
    if (good && own.ndim == 1 && own.shape[0] == rows)
        for (int k = 0; k < rows; k++)
            to[k] = *(const double *)((const char *)own.buf + k * own.strides[0]);
    else if (good && (own.ndim == 0 || own.shape[0] == 1))
        for (int k = 0; k < rows; k++)
            to[k] = *(const double *)own.buf;
    else {
        PyErr_Format(PyExc_TypeError, "no float64 array of %d rows", rows);
        good = 0;
    }
    PyBuffer_Release(&own);
    return good ? 0 : -1;
}

static PyObject *program_one(PyObject *self, PyObject *const *args, Py_ssize_t nargs)
{
    Program *P = (Program *)self;
    PyObject *found = NULL;
    int mine, results = P->work - P->outputs;
    if (nargs != P->n_in || P->lean)
        return PyErr_Format(PyExc_TypeError, "%zd inputs, not %d", nargs, P->n_in);
    double *w = taken(P, &mine);
    if (!w) {
        if (mine)
            atomic_flag_clear(&P->one_taken);
        return PyErr_NoMemory();
    }
    for (int i = 0; i < P->n_in; i++)
        if (put(w + P->first_in[i], args[i], P->rows_in[i]))
            goto done;
    Py_BEGIN_ALLOW_THREADS
    run_one(P->once, P->once + P->n_once, w);
    run_one(P->line, P->line + P->n_line, w);
    Py_END_ALLOW_THREADS
    found = PyList_New(P->n_out);
    for (int i = 0; found && i < P->n_out; i++) {
        Py_buffer own;
        PyObject *array = PyObject_CallFunction(empty, "n", (Py_ssize_t)P->rows_out[i]);
        if (!array || PyObject_GetBuffer(array, &own, PyBUF_CONTIG)) {
            Py_XDECREF(array);
            Py_CLEAR(found);
            break;
        }
        memcpy(own.buf, w + results + P->first_out[i], P->rows_out[i] * sizeof(double));
        PyBuffer_Release(&own);
        PyList_SetItem(found, i, array);
    }
done:
    given_back(P, w, mine);
    return found;
}

/* What all poses share, for the inputs: constants and results, behind the inputs' places. */
static PyObject *program_common(PyObject *self, PyObject *const *args, Py_ssize_t nargs)
{
    Program *P = (Program *)self;
    int mine, count = P->work - P->outputs - P->inputs;
    if (nargs != P->n_in)
        return PyErr_Format(PyExc_TypeError, "%zd inputs, not %d", nargs, P->n_in);
    double *w = taken(P, &mine);
    if (!w) {
        if (mine)
            atomic_flag_clear(&P->one_taken);
        return PyErr_NoMemory();
    }
    PyObject *found = PyList_New(count);
    for (int i = 0; found && i < P->n_in; i++)
        if (P->shared[i] && put(w + P->first_in[i], args[i], P->rows_in[i]))
            Py_CLEAR(found);
    if (found)
        run_one(P->once, P->once + P->n_once, w);
    for (int k = 0; found && k < count; k++)
        PyList_SetItem(found, k, PyFloat_FromDouble(w[P->inputs + k]));
    given_back(P, w, mine);
    return found;
}

/* chain(count, first, ..., results...): the first input is the first result of the call before;
   the others are C-ordered arrays with one row for all or one for each of `count` calls, the
   results with one for each. */
static PyObject *program_chain(PyObject *self, PyObject *const *args, Py_ssize_t nargs)
{
    Program *P = (Program *)self;
    Py_buffer views[2 * MOST];
    Py_ssize_t stride[2 * MOST];
    int got = 0, mine, good = 1;
    if (nargs != 1 + P->n_in + P->n_out || !P->n_in || !P->n_out || P->lean ||
        P->rows_in[0] != P->rows_out[0])
        return PyErr_Format(PyExc_TypeError, "no chain of %zd arrays", nargs);
    Py_ssize_t count = PyLong_AsSsize_t(args[0]);
    if (count < 0)
        return PyErr_Occurred() ? NULL : PyErr_Format(PyExc_ValueError, "no count");
    for (int i = 0; i < P->n_in + P->n_out; i++, got++) {
        int rows = i < P->n_in ? P->rows_in[i] : P->rows_out[i - P->n_in];
        int flags = PyBUF_ND | PyBUF_FORMAT | (i < P->n_in ? 0 : PyBUF_WRITABLE);
        if (PyObject_GetBuffer(args[1 + i], views + i, flags)) {
            release(views, got);
            return NULL;
        }
        int single = i < P->n_in && views[i].len == rows * 8;
        stride[i] = single ? 0 : rows;
        if ((!single && (!i || views[i].len != count * rows * 8)) || strcmp(views[i].format, "d"))
            good = 0;
    }
    if (!good) {
        release(views, got);
        return PyErr_Format(PyExc_TypeError, "arrays of a chain have other sizes");
    }
    double *w = taken(P, &mine);
    if (!w) {
        if (mine)
            atomic_flag_clear(&P->one_taken);
        release(views, got);
        return PyErr_NoMemory();
    }
    int results = P->work - P->outputs;
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t k = 0; k < count; k++) {
        memcpy(w + P->first_in[0], k ? w + results + P->first_out[0] : (double *)views[0].buf,
               P->rows_in[0] * sizeof(double));
        for (int i = 1; i < P->n_in; i++)
            memcpy(w + P->first_in[i], (double *)views[i].buf + k * stride[i],
                   P->rows_in[i] * sizeof(double));
        run_one(P->once, P->once + P->n_once, w);
        run_one(P->line, P->line + P->n_line, w);
        for (int i = 0; i < P->n_out; i++)
            memcpy((double *)views[P->n_in + i].buf + k * P->rows_out[i],
                   w + results + P->first_out[i], P->rows_out[i] * sizeof(double));
    }
    Py_END_ALLOW_THREADS
    given_back(P, w, mine);
    release(views, got);
    Py_RETURN_NONE;
}

/* ---- Python ------------------------------------------------------------------------------- */

/* NumPy's `empty`, when the first program is made. */
static int with_numpy(void)
{
    if (empty)
        return 0;
    PyObject *numpy = PyImport_ImportModule("numpy");
    if (!numpy)
        return -1;
    name_T = PyUnicode_InternFromString("T");
    empty = PyObject_GetAttrString(numpy, "empty");
    Py_DECREF(numpy);
    return empty && name_T ? 0 : -1;
}

static PyObject *program_new(PyTypeObject *type, PyObject *args, PyObject *keywords)
{
    const char *code, *table;
    Py_ssize_t bytes, known;
    int work;
    PyObject *in, *out, *shared, *wanted = Py_None;
    (void)keywords;
    if (with_numpy() || !PyArg_ParseTuple(args, "y#iO!O!O!y#|O", &code, &bytes, &work, &PyTuple_Type, &in,
                          &PyTuple_Type, &out, &PyTuple_Type, &shared, &table, &known, &wanted))
        return NULL;
    int n_in = (int)PyTuple_Size(in), n_out = (int)PyTuple_Size(out);
    if (n_in > MOST || n_out > MOST || PyTuple_Size(shared) != n_in || known != 256 || bytes % 16 ||
        bytes / 16 > 10000000 || work < 0 || work > 10000000)
        return PyErr_Format(PyExc_ValueError, "no such program");
    allocfunc make = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    Program *P = (Program *)make(type, 0);
    if (!P)
        return NULL;
    P->n_in = n_in, P->n_out = n_out;
    P->rows_in = calloc(2 * (n_in + n_out) + 4, sizeof(int32_t));
    P->shared = calloc(n_in + 1, 1);
    char *copy = malloc(bytes + 16); /* aligned */
    int good = P->rows_in && P->shared && copy;
    if (good) {
        P->rows_out = P->rows_in + n_in;
        P->first_in = P->rows_out + n_out;
        P->first_out = P->first_in + n_in;
        for (int i = 0; i < n_in; i++) {
            P->rows_in[i] = (int)PyLong_AsLong(PyTuple_GetItem(in, i));
            P->shared[i] = PyObject_IsTrue(PyTuple_GetItem(shared, i)) == 1;
            P->first_in[i] = P->inputs;
            P->inputs += P->rows_in[i];
        }
        for (int i = 0; i < n_out; i++) {
            P->rows_out[i] = (int)PyLong_AsLong(PyTuple_GetItem(out, i));
            P->first_out[i] = P->outputs;
            P->outputs += P->rows_out[i];
        }
        P->places = calloc(P->outputs + 1, sizeof(int32_t));
        P->computed = calloc(P->outputs + 1, 1);
        P->lean = wanted != Py_None;
        good = P->places && P->computed && (!P->lean || PyBytes_Check(wanted));
        good = good && (!P->lean || PyBytes_Size(wanted) == P->outputs);
        for (int k = 0; good && k < P->outputs; k++)
            P->places[k] = !P->lean || PyBytes_AsString(wanted)[k] ? -1 : -2;
        memcpy(copy, code, bytes);
        good = good && ordered(P, (const Raw *)copy, (int)(bytes / 16), work, (const uint8_t *)table) == 0;
    }
    free(copy);
    atomic_flag_clear(&P->one_taken);
    atomic_flag_clear(&P->many_taken);
    if (!good) {
        Py_DECREF(P);
        if (!PyErr_Occurred())
            PyErr_SetString(PyExc_ValueError, "the instructions have no program");
        return NULL;
    }
    int fits = BLOCK_BYTES / 8 / (P->registers + P->inputs + 1);
    P->block = fits < 64 ? 64 : fits > LARGEST_BLOCK ? LARGEST_BLOCK : fits / 8 * 8;
    return (PyObject *)P;
}

static void program_dealloc(PyObject *self)
{
    Program *P = (Program *)self;
    PyTypeObject *type = Py_TYPE(self);
    free(P->rows_in), free(P->shared), free(P->once), free(P->line), free(P->numbers);
    free(P->places), free(P->computed);
    free(P->spare_one), free(P->spare_many);
    freefunc leave = (freefunc)PyType_GetSlot(type, Py_tp_free);
    leave(self);
    Py_DECREF(type);
}

static PyObject *program_size(PyObject *self, void *unused)
{
    Program *P = (Program *)self;
    (void)unused;
    return Py_BuildValue("{s:i,s:i,s:i,s:i,s:i}", "once", P->n_once, "line", P->n_line, "registers",
                         P->registers, "slots", P->slots, "block", P->block);
}

/* Of each output: 0 and the output that is computed, 1 and the input, 2 and the place among what
   all poses share, -1 where it is unwanted. */
static PyObject *program_places(PyObject *self, void *unused)
{
    Program *P = (Program *)self;
    PyObject *found = PyList_New(P->outputs);
    int results = P->work - P->outputs;
    (void)unused;
    for (int k = 0; found && k < P->outputs; k++) {
        int at = P->places[k], kind = at < 0 ? -1 : at >= results ? 0 : at < P->inputs ? 1 : 2;
        int first = kind == 0 ? results : kind == 2 ? P->inputs : 0;
        PyList_SetItem(found, k, Py_BuildValue("(ii)", kind, at - first));
    }
    return found;
}

static PyMethodDef methods[] = {
    {"many", (PyCFunction)(void (*)(void))program_many, METH_FASTCALL,
     "Results (n, rows) of inputs (n, rows), shared ones (rows,)."},
    {"block", (PyCFunction)(void (*)(void))program_block, METH_FASTCALL,
     "Write what is computed for inputs (rows, n), shared ones (rows,), into arrays (n,)."},
    {"common", (PyCFunction)(void (*)(void))program_common, METH_FASTCALL,
     "What all poses share, for the inputs."},
    {"one", (PyCFunction)(void (*)(void))program_one, METH_FASTCALL,
     "Results (rows,) of one set of numbers."},
    {"chain", (PyCFunction)(void (*)(void))program_chain, METH_FASTCALL,
     "Calls in a row, each from the first result of the one before."},
    {NULL, NULL, 0, NULL}};
static PyGetSetDef properties[] = {
    {"places", program_places, NULL, "Kind and place of each output.", NULL},
    {"size", program_size, NULL, "Numbers of instructions and of places.", NULL},
    {NULL, NULL, NULL, NULL, NULL}};
static PyType_Slot slots[] = {{Py_tp_new, program_new},
                              {Py_tp_dealloc, program_dealloc},
                              {Py_tp_methods, methods},
                              {Py_tp_getset, properties},
                              {Py_tp_doc, "A function of casadi in order."},
                              {0, NULL}};
static PyType_Spec spec = {"mechdae.kernels.machine._machine.Program", sizeof(Program), 0,
                           Py_TPFLAGS_DEFAULT, slots};

static PyObject *machine_vectors(PyObject *module, PyObject *wanted)
{
    (void)module;
    if (wanted != Py_None) {
        long chosen = PyLong_AsLong(wanted);
        if (PyErr_Occurred())
            return NULL;
        if (chosen < 0 || chosen >= levels)
            return PyErr_Format(PyExc_ValueError, "level %ld of %d", chosen, levels);
        level = (int)chosen;
    }
    return Py_BuildValue("(sii)", names[level], level, levels);
}

static PyMethodDef functions[] = {
    {"vectors", machine_vectors, METH_O,
     "Name, level and number of levels of the vector instructions; a number chooses one."},
    {NULL, NULL, 0, NULL}};

static int start(PyObject *module)
{
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2"))
        names[levels] = "avx2", runners[levels++] = run_avx2;
    if (levels == 2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        names[levels] = "avx512", runners[levels++] = run_avx512;
    level = levels - 1;
#endif
    PyObject *type = PyType_FromSpec(&spec);
    if (!type || PyModule_AddObjectRef(module, "Program", type))
        return -1;
    return PyModule_AddIntConstant(module, "ABI", ABI);
}

static PyModuleDef_Slot module_slots[] = {{Py_mod_exec, start}, {0, NULL}};
static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_machine",
                                        "casadi's instructions over blocks of poses.", 0, functions,
                                        module_slots, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__machine(void)
{
    return PyModuleDef_Init(&definition);
}
