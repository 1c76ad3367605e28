"""One step of Dormand and Prince 8(5,3) with projection, chunks of steps, the dense output.

The state of the integration is one vector, see `Layout`. A step that is not accepted leaves it as
it is but for the next step size. What the controller compares with the tolerance is the
error relative to natural sizes: 1 rad and a length of the mechanism for coordinates, for
rates these times the frequency omega = max(|x'|, sqrt|x''|) over the same sizes, so that neither
unit of length nor of mass matters.

The coefficients are those of DOP853 of Hairer, Norsett and Wanner, Solving Ordinary Differential
Equations I, 1993; rows are {stage: weight}.
"""

from __future__ import annotations

import threading
from typing import Any

import casadi as ca
import numpy as np

from mechdae.equations.structure_cache import StructureCache, structure_property
from mechdae.kernels.graphs.equations_of_motion import Kernel
from mechdae.kernels.run.functions import program, without_repeats
from mechdae.types import Floats, Graph, Matrices, Sym

# fmt: off
NODES = (
    0.0, 0.526001519587677318785587544488e-01, 0.789002279381515978178381316732e-01,
    0.118350341907227396726757197510, 0.281649658092772603273242802490,
    0.333333333333333333333333333333, 0.25, 0.307692307692307692307692307692,
    0.651282051282051282051282051282, 0.6, 0.857142857142857142857142857142, 1.0, 1.0, 0.1,
    0.2, 0.777777777777777777777777777778,
)
STAGES: tuple[dict[int, float], ...] = (
    {},
    {0: 5.26001519587677318785587544488e-2},
    {0: 1.97250569845378994544595329183e-2, 1: 5.91751709536136983633785987549e-2},
    {0: 2.95875854768068491816892993775e-2, 2: 8.87627564304205475450678981324e-2},
    {0: 2.41365134159266685502369798665e-1, 2: -8.84549479328286085344864962717e-1,
     3: 9.24834003261792003115737966543e-1},
    {0: 3.7037037037037037037037037037e-2, 3: 1.70828608729473871279604482173e-1,
     4: 1.25467687566822425016691814123e-1},
    {0: 3.7109375e-2, 3: 1.70252211019544039314978060272e-1,
     4: 6.02165389804559606850219397283e-2, 5: -1.7578125e-2},
    {0: 3.70920001185047927108779319836e-2, 3: 1.70383925712239993810214054705e-1,
     4: 1.07262030446373284651809199168e-1, 5: -1.53194377486244017527936158236e-2,
     6: 8.27378916381402288758473766002e-3},
    {0: 6.24110958716075717114429577812e-1, 3: -3.36089262944694129406857109825,
     4: -8.68219346841726006818189891453e-1, 5: 2.75920996994467083049415600797e1,
     6: 2.01540675504778934086186788979e1, 7: -4.34898841810699588477366255144e1},
    {0: 4.77662536438264365890433908527e-1, 3: -2.48811461997166764192642586468,
     4: -5.90290826836842996371446475743e-1, 5: 2.12300514481811942347288949897e1,
     6: 1.52792336328824235832596922938e1, 7: -3.32882109689848629194453265587e1,
     8: -2.03312017085086261358222928593e-2},
    {0: -9.3714243008598732571704021658e-1, 3: 5.18637242884406370830023853209,
     4: 1.09143734899672957818500254654, 5: -8.14978701074692612513997267357,
     6: -1.85200656599969598641566180701e1, 7: 2.27394870993505042818970056734e1,
     8: 2.49360555267965238987089396762, 9: -3.0467644718982195003823669022},
    {0: 2.27331014751653820792359768449, 3: -1.05344954667372501984066689879e1,
     4: -2.00087205822486249909675718444, 5: -1.79589318631187989172765950534e1,
     6: 2.79488845294199600508499808837e1, 7: -2.85899827713502369474065508674,
     8: -8.87285693353062954433549289258, 9: 1.23605671757943030647266201528e1,
     10: 6.43392746015763530355970484046e-1},
    {0: 5.42937341165687622380535766363e-2, 5: 4.45031289275240888144113950566,
     6: 1.89151789931450038304281599044, 7: -5.8012039600105847814672114227,
     8: 3.1116436695781989440891606237e-1, 9: -1.52160949662516078556178806805e-1,
     10: 2.01365400804030348374776537501e-1, 11: 4.47106157277725905176885569043e-2},
    {0: 5.61675022830479523392909219681e-2, 6: 2.53500210216624811088794765333e-1,
     7: -2.46239037470802489917441475441e-1, 8: -1.24191423263816360469010140626e-1,
     9: 1.5329179827876569731206322685e-1, 10: 8.20105229563468988491666602057e-3,
     11: 7.56789766054569976138603589584e-3, 12: -8.298e-3},
    {0: 3.18346481635021405060768473261e-2, 5: 2.83009096723667755288322961402e-2,
     6: 5.35419883074385676223797384372e-2, 7: -5.49237485713909884646569340306e-2,
     10: -1.08347328697249322858509316994e-4, 11: 3.82571090835658412954920192323e-4,
     12: -3.40465008687404560802977114492e-4, 13: 1.41312443674632500278074618366e-1},
    {0: -4.28896301583791923408573538692e-1, 5: -4.69762141536116384314449447206,
     6: 7.68342119606259904184240953878, 7: 4.06898981839711007970213554331,
     8: 3.56727187455281109270669543021e-1, 12: -1.39902416515901462129418009734e-3,
     13: 2.9475147891527723389556272149, 14: -9.15095847217987001081870187138},
)
"""Stage 12 is the new state; 13 to 15 serve the dense output only."""
WEIGHTS = STAGES[12]
THIRD = {**WEIGHTS}
"""Error estimate of order 3."""
THIRD[0] -= 0.244094488188976377952755905512
THIRD[8] -= 0.733846688281611857341361741547
THIRD[11] -= 0.220588235294117647058823529412e-1
FIFTH: dict[int, float] = (
    {0: 0.1312004499419488073250102996e-1, 5: -0.1225156446376204440720569753e1,
     6: -0.4957589496572501915214079952, 7: 0.1664377182454986536961530415e1,
     8: -0.3503288487499736816886487290, 9: 0.3341791187130174790297318841,
     10: 0.8192320648511571246570742613e-1, 11: -0.2235530786388629525884427845e-1}
)
"""Error estimate of order 5."""
DENSE: tuple[dict[int, float], ...] = (
    {0: -0.84289382761090128651353491142e1, 5: 0.56671495351937776962531783590,
     6: -0.30689499459498916912797304727e1, 7: 0.23846676565120698287728149680e1,
     8: 0.21170345824450282767155149946e1, 9: -0.87139158377797299206789907490,
     10: 0.22404374302607882758541771650e1, 11: 0.63157877876946881815570249290,
     12: -0.88990336451333310820698117400e-1, 13: 0.18148505520854727256656404962e2,
     14: -0.91946323924783554000451984436e1, 15: -0.44360363875948939664310572000e1},
    {0: 0.10427508642579134603413151009e2, 5: 0.24228349177525818288430175319e3,
     6: 0.16520045171727028198505394887e3, 7: -0.37454675472269020279518312152e3,
     8: -0.22113666853125306036270938578e2, 9: 0.77334326684722638389603898808e1,
     10: -0.30674084731089398182061213626e2, 11: -0.93321305264302278729567221706e1,
     12: 0.15697238121770843886131091075e2, 13: -0.31139403219565177677282850411e2,
     14: -0.93529243588444783865713862664e1, 15: 0.35816841486394083752465898540e2},
    {0: 0.19985053242002433820987653617e2, 5: -0.38703730874935176555105901742e3,
     6: -0.18917813819516756882830838328e3, 7: 0.52780815920542364900561016686e3,
     8: -0.11573902539959630126141871134e2, 9: 0.68812326946963000169666922661e1,
     10: -0.10006050966910838403183860980e1, 11: 0.77771377980534432092869265740,
     12: -0.27782057523535084065932004339e1, 13: -0.60196695231264120758267380846e2,
     14: 0.84320405506677161018159903784e2, 15: 0.11992291136182789328035130030e2},
    {0: -0.25693933462703749003312586129e2, 5: -0.15418974869023643374053993627e3,
     6: -0.23152937917604549567536039109e3, 7: 0.35763911791061412378285349910e3,
     8: 0.93405324183624310003907691704e2, 9: -0.37458323136451633156875139351e2,
     10: 0.10409964950896230045147246184e3, 11: 0.29840293426660503123344363579e2,
     12: -0.43533456590011143754432175058e2, 13: 0.96324553959188282948394950600e2,
     14: -0.39177261675615439165231486172e2, 15: -0.14972683625798562581422125276e3},
)
"""Last four coefficients of the interpolant, over the step."""
# fmt: on


SX = ca.SX
CHUNK = 32
GROWTH, SAFE, SHRINK = 2.0, 0.8, 0.2
SLOW = 1e-3
"""Share of the highest frequency so far below which the present one does not count."""
UNROLLED = 4000
"""Instructions of a right-hand side up to which twelve of them are one graph."""
STRICT = 0.25
"""Share of the tolerance that the error of a step may have."""
CLOSED = 0.1
"""Share of the tolerance by which constraints may stay open after a projection, beside the
rounding of the coordinates: that of angles grows with their turns."""
ROUNDING = 4e-15
LARGEST = 1e300
"""Sum of squares of a state from which it counts as infinite."""


class Layout:
    """Places in the vector of state.

    ``t``, ``x``, ``v``, ``a``, sizes of friction ``m``, works ``w``, next step ``h``,
    ``rejected`` (the last trial was), highest frequency ``omega``; then of the last trial:
    ``accepted``, ``error``, ``passed`` (a sliding speed has passed zero), and ``trials`` so far.
    """

    def __init__(self, n: int, works: int, sized: int = 0) -> None:
        self.n: int = n
        self.works: int = works
        place = 0
        self._slices: dict[str, slice] = {}
        for name, size in (
            ("t", 1), ("x", n), ("v", n), ("a", n), ("m", sized), ("w", works), ("h", 1),
            ("rejected", 1), ("omega", 1), ("accepted", 1), ("error", 1), ("passed", 1),
            ("trials", 1),
        ):  # fmt: skip
            self._slices[name] = slice(place, place + size)
            place += size
        self.size = place

    def __getitem__(self, name: str) -> slice:
        return self._slices[name]

    def of(self, state: Floats, name: str) -> Any:
        """Return a part of states (..., size); numbers lose their axis."""
        part = state[..., self[name]]
        return part if name in ("x", "v", "a", "m", "w") else part[..., 0]


class Stepper:
    """Graphs of one step.

    Parameters
    ----------
    kernel
        Right-hand side and projection.
    powers
        SX (k,) over (t, x, v, ``acceleration``, signs, c), integrated along as works.
    acceleration
        Symbols (n,) of the acceleration that powers may hold.
    sizes
        Those of the forces of friction in joints.
    """

    def __init__(
        self, kernel: Kernel, powers: Sym, acceleration: Sym, sizes: Sym | None = None
    ) -> None:
        self.kernel: Kernel = kernel
        self.n: int = kernel.n
        self.works: int = powers.numel()
        self.layout: Layout = Layout(self.n, self.works, kernel.rubs)
        self.sized: int = kernel.rubs
        sizes = sizes if sizes is not None else SX.sym("m", self.sized)
        self.power: Graph = kernel.function("power", [ca.densify(powers)], [acceleration, sizes])
        self.cache: StructureCache = StructureCache()
        self.fixed: int = kernel.signs.numel() + kernel.c.numel()

    @structure_property
    def kind(self) -> Any:
        """Type of the symbols: graphs of large right-hand sides are called, not unrolled."""
        return ca.MX if self.kernel.rhs.n_instructions() > UNROLLED else SX

    def sizes(self, c: Sym) -> Sym:
        """Return the natural sizes of the coordinates among the numbers."""
        return c[self.kernel.places_of["sizes"]] if self.n else ca.DM(0, 1)

    def _stages(
        self, t: Sym, x: Sym, v: Sym, a: Sym, m: Sym, h: Sym, signs: Sym, c: Sym, count: int
    ) -> tuple[list[Sym], list[Sym], list[Sym]]:
        """Return rates of x, v and the works at the stages of a step."""
        rates, slopes = [v], [a]
        powers = [self.power(t, x, v, signs, a, m, c)]
        for i in range(1, count):
            row = STAGES[i]
            place = x + h * _combined(row, rates)
            rate = v + h * _combined(row, slopes)
            at = t + NODES[i] * h
            slope, inner = self.kernel.rhs(at, place, rate, signs, c)
            rates.append(rate)
            slopes.append(slope)
            powers.append(self.power(at, place, rate, signs, slope, self._sizes(inner), c))
        return rates, slopes, powers

    def _sizes(self, inner: Sym) -> Sym:
        """Return the sizes of friction among the second results of a right-hand side."""
        return inner[self.kernel.inner - self.sized :] if self.sized else ca.DM(0, 1)

    def _error(self, h: Sym, rates: list[Sym], slopes: list[Sym], omega: Sym, c: Sym) -> Sym:
        """Return the norm of the error over the natural sizes."""
        sizes = self.sizes(c)
        third: list[Sym] = []
        fifth: list[Sym] = []
        for row, total in ((FIFTH, fifth), (THIRD, third)):
            total.append(_combined(row, rates) / sizes)
            total.append(_combined(row, slopes) / (sizes * omega))
        high, low = (ca.sumsqr(ca.vertcat(*parts)) for parts in (fifth, third))
        below = (high + 0.01 * low) * 2 * max(self.n, 1)
        return ca.if_else(below == 0, 0, ca.fabs(h) * high / ca.sqrt(below))

    @structure_property
    def step(self) -> Graph:
        """(t, x, v, a, m, w, h, signs, omega, c) -> new x, v, a, m, w, error, miss."""
        k, sym = self.kernel, self.kind.sym
        t, h, omega = sym("t"), sym("h"), sym("omega")
        x, v, a = (sym(name, self.n) for name in "xva")
        m, w, signs = sym("m", self.sized), sym("w", self.works), sym("signs", k.signs.numel())
        c = sym("c", k.c.numel())
        rates, slopes, powers = self._stages(t, x, v, a, m, h, signs, c, 12)
        place, rate = (y + h * _combined(STAGES[12], k) for y, k in ((x, rates), (v, slopes)))
        work = w + h * _combined(STAGES[12], powers)
        error = self._error(h, rates, slopes, omega, c)
        place, rate, miss = k.project(t + h, place, rate, signs, c)
        after, inner = k.rhs(t + h, place, rate, signs, c)
        inputs = [t, x, v, a, m, w, h, signs, omega, c]
        results = [place, rate, after, self._sizes(inner), work, error, miss]
        return without_repeats("step", inputs, [ca.densify(r) for r in results])

    def _frequency(self, v: Sym, a: Sym, sizes: Sym) -> Sym:
        if not self.n:
            return ca.DM(0)
        return ca.mmax(ca.fmax(ca.fabs(v) / sizes, ca.sqrt(ca.fabs(a) / sizes)))

    @structure_property
    def trial(self) -> Graph:
        """(state, [t_end, tol, longest step, signs, c]) -> state after one trial step."""
        lay = self.layout
        state = self.kind.sym("state", lay.size)
        numbers = self.kind.sym("numbers", 3 + self.fixed)
        end, tol, longest = numbers[0], numbers[1], numbers[2]
        signs, c = ca.vertsplit(numbers, [0, 3, 3 + self.kernel.signs.numel(), 3 + self.fixed])[1:]
        sizes = self.sizes(c)
        part = {name: state[lay[name]] for name in lay._slices}
        t, x, v, a, m, w = (part[name] for name in ("t", "x", "v", "a", "m", "w"))
        left = end - t
        wanted = ca.fmin(part["h"], longest)
        near = wanted >= left * (1 - 1e-10)
        half = wanted > left / 2
        h = ca.if_else(near, left, ca.if_else(half, left / 2, wanted))
        omega = self._frequency(v, a, sizes)
        top = ca.fmax(part["omega"], omega)
        slowest = ca.fmax(omega, SLOW * top)
        place, rate, after, sized, work, error, miss = self.step(
            t, x, v, a, m, w, h, signs, ca.fmax(slowest, 1e-300), c
        )
        grain = ROUNDING * (1 + ca.mmax(ca.fabs(x) / sizes)) if self.n else ROUNDING
        # fmax leaves nan out, a comparison with nan is false: such a step is not accepted
        whole = ca.sumsqr(ca.vertcat(place, rate, after)) + error + miss
        sound = whole < LARGEST
        error = ca.fmax(
            error / (STRICT * tol),
            miss / (CLOSED * tol + grain + c[self.kernel.places_of["closure"]]),
        )
        good = ca.logic_and(error < 1, sound)
        factor = ca.if_else(sound, SAFE * ca.fmax(error, 1e-16) ** (-1 / 8), SHRINK)
        factor = ca.fmin(GROWTH, ca.fmax(SHRINK, factor))
        factor = ca.if_else(ca.logic_and(good, part["rejected"] > 0), ca.fmin(factor, 1), factor)
        following = h * factor
        clipped = ca.logic_and(good, h < part["h"])
        following = ca.if_else(clipped, ca.fmax(following, part["h"]), following)
        kept = ca.vertcat(t, x, v, a, m, w)
        moved = ca.vertcat(ca.if_else(near, end, t + h), place, rate, after, sized, work)
        chosen = ca.if_else(good, moved, kept)
        passed = ca.logic_and(good, self._turned(t + h, place, rate, signs, c))
        done = ca.vertcat(
            chosen, following, ca.if_else(good, 0, 1), top, good, error, passed, part["trials"] + 1
        )
        return without_repeats("trial", [state, numbers], [done])

    def _turned(self, t: Sym, x: Sym, v: Sym, signs: Sym, c: Sym) -> Sym:
        """Return whether a slip moves against its sign."""
        k = self.kernel
        count = k.released.rubbing.count
        if not count:
            return ca.DM(0)
        speeds = k.function("slips", [ca.densify(k.released.slips)])(t, x, v, signs, c)
        return ca.mmin(speeds * signs[:count]) < 0

    @structure_property
    def advance(self) -> Graph:
        """As `trial`; a state at the end stays, with ``accepted`` 0, and costs nothing.

        So does one behind the reversal of a slip: what follows has another sign.
        """
        lay = self.layout
        state, numbers = ca.MX.sym("state", lay.size), ca.MX.sym("numbers", self.trial.size1_in(1))
        at, parameters = SX.sym("state", lay.size), SX.sym("numbers", numbers.numel())
        still = SX(at)
        still[lay["accepted"]] = 0
        idle = ca.Function("idle", [at, parameters], [still])
        switch = ca.Function.if_else("switch", self.trial, idle)
        going = ca.logic_and(state[lay["t"]] < numbers[0], state[lay["passed"]] == 0)
        after = switch(going, state, numbers)
        return ca.Function("advance", [state, numbers], [after])

    @structure_property
    def dense(self) -> Graph:
        """(t, x, v, a, m, h, signs, c) -> coefficients (2 n + works, 7), by rows."""
        k, sym = self.kernel, self.kind.sym
        t, h = sym("t"), sym("h")
        x, v, a = (sym(name, self.n) for name in "xva")
        signs, c = sym("signs", k.signs.numel()), sym("c", k.c.numel())
        m = sym("m", self.sized)
        stages = self._stages(t, x, v, a, m, h, signs, c, 16)
        change = [h * _combined(STAGES[12], part) for part in stages]
        columns = []
        for part, delta in zip(stages, change, strict=True):
            first, last = part[0], part[12]
            pieces = [delta, h * first - delta, 2 * delta - h * (last + first)]
            pieces += [h * _combined(row, part) for row in DENSE]
            columns.append(ca.horzcat(*pieces))
        whole = ca.densify(ca.vertcat(*columns))
        results = [ca.vec(whole.T)]
        return without_repeats("dense", [t, x, v, a, m, h, signs, c], results)


class Chunk:
    """Many trial steps in one call: of the compiled machine, else `mapaccum` through a buffer.

    Each thread has a buffer of its own.
    """

    def __init__(self, stepper: Stepper, count: int = CHUNK) -> None:
        self.layout, self.count, self.function = stepper.layout, count, stepper.trial
        self._trial = program(stepper.trial)
        if self._trial is None:
            self.function = stepper.advance.mapaccum("chunk", count)
        self._shapes = [(stepper.layout.size,), (count, 3 + stepper.fixed)]
        self._shapes.append((count, stepper.layout.size))
        self._threads = threading.local()

    def __call__(self, state: Floats, numbers: Floats) -> Floats:
        """Return the states (count, .) after each trial step."""
        if self._trial is not None:
            return self._tried(state, numbers)
        try:
            arrays, trigger, _ = self._threads.buffers
        except AttributeError:
            buffer, trigger = self.function.buffer()
            arrays = [np.zeros(shape) for shape in self._shapes]
            for i, array in enumerate(arrays[:2]):
                buffer.set_arg(i, memoryview(array))
            buffer.set_res(0, memoryview(arrays[2]))
            self._threads.buffers = arrays, trigger, buffer
        arrays[0][:] = state
        arrays[1][:] = numbers
        trigger()
        found: Floats = arrays[2].copy()
        return found

    def _tried(self, state: Floats, numbers: Floats) -> Floats:
        """Return the same by single trials, see `Stepper.advance`."""
        t, passed, accepted = (self.layout[name].start for name in ("t", "passed", "accepted"))
        states = np.empty((self.count, self.layout.size))
        for k in range(self.count):
            if not (state[t] < numbers[0] and state[passed] == 0):
                states[k:] = state
                states[k:, accepted] = 0
                break
            states[k] = state = self._trial.one(state, numbers)[0]
        return states


def interpolate(coefficients: Matrices, start: Floats, share: Floats) -> Floats:
    """Return states (n, k) inside steps: `coefficients` (n, k, 7), `start` (n, k), share (n,)."""
    s = np.asarray(share, float)[:, None]
    total = np.zeros_like(start)
    for i in range(7):
        total = (total + coefficients[..., 6 - i]) * (s if i % 2 == 0 else 1 - s)
    return start + total


def _combined(row: dict[int, float], parts: list[Sym]) -> Sym:
    """Return the weighted sum of stages."""
    return sum((weight * parts[j] for j, weight in row.items()), ca.DM.zeros(parts[0].numel()))
