"""Groups without a closed formula, followed root by root along the driver.

A `Triad` is a platform on three legs: unknowns X, Y, phi of the platform, one equation a
leg. A `Geared` pair of links has one unknown, the angle of the first: the second turns as a
gear tells. A `Track` follows the root from the sketch in steps that are halved until the
determinant keeps its sign and changes by less than a factor of two, and the tangents at both
ends agree; where it ends, the square of the determinant goes to zero linearly: a fold.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from .elements import CLOSURES, abs2
from .series import CLD, LD, Series

TURN = 2 * np.pi
SUBDIVISIONS = 16
DEPTH = 12
FOLD = "fold"
FAR = 60.0
"""Lengths at which a platform counts as running away to a pole."""


# -- equations -----------------------------------------------------------------------------


class Triad:
    """Platform `body` with pins p0, p1, p2; reference is p0.

    Legs are tuples (kind, m, P, n, c): m is where the leg meets the platform, from p0.
    circle: |Z + e m - P|^2 = c; line: Im(conj(n) (Z + e m - P)) = 0;
    groove: Im(conj(n e) (P - Z)) + c = 0 with n fixed to the platform.
    """

    size = 3
    norm = None
    root_scales = staticmethod(lambda length: (length, length, 1.0))

    def __init__(self, world, element):
        self.world, self.data, self.element = world, element.data, element
        body = self.data["body"]
        self.legs = []
        for leg in self.data["legs"]:
            kind, on = leg["kind"], leg["on"]
            place = world.place(on)
            if kind in ("link", "bar"):
                m = world.gap(body, "p0", leg["pin"])
                c = (
                    abs2(world.gap(leg["body"], "p0", "p1"))
                    if kind == "link"
                    else world.real(leg["length"]) ** 2
                )
                self.legs.append(("circle", m, place, 0j, c))
            elif kind in ("slide", "slot"):
                m = world.gap(body, "p0", leg["pin"])
                own, along = world.guided(on[0], leg)
                if kind == "slide":
                    place = place + own * world.gap(leg["body"], "guided", "p1")
                self.legs.append(("line", m, place, along, 0.0))
            else:
                turn, axis = world.turned(leg["turn"]), world.turned(leg["axis"])
                if leg.get("swap"):
                    turn = np.conj(turn)
                    axis = turn * axis
                offset = -world.gap(body, "p0", leg["pin"])
                if kind == "rail":  # the block's guided point, seen from its pin
                    offset = offset + turn * world.gap(leg["body"], "p1", "guided")
                c = (np.conj(axis) * offset).imag
                self.legs.append(("groove", 0j, place, axis, c))

    def nodes(self):
        """Return for each node the legs as Python numbers, with the rates of P and n."""
        columns = []
        for kind, m, P, n, c in self.legs:
            p, dp = P.c[0].tolist(), P.c[1].tolist()
            if isinstance(n, Series):
                n0, dn = n.c[0].tolist(), n.c[1].tolist()
            else:
                n0, dn = [complex(n)] * len(p), [0j] * len(p)
            m, c = complex(m), float(c)
            columns.append([(kind, m, *rest, c) for rest in zip(p, n0, dp, dn, strict=True)])
        return list(zip(*columns, strict=True))

    @staticmethod
    def scalar(legs, x):
        """Return residuals, Jacobian and driver slopes at one node, Python floats."""
        Z, e = complex(x[0], x[1]), cmath.exp(1j * x[2])
        r, J, push = [], [], []
        for kind, m, P, n, dP, dn, c in legs:
            if kind == "circle":
                arm = e * m
                w = Z + arm - P
                r.append(w.real * w.real + w.imag * w.imag - c)
                J.append((2 * w.real, 2 * w.imag, -2 * (w.conjugate() * arm).imag))
                push.append(-2 * (w.conjugate() * dP).real)
            elif kind == "line":
                arm = e * m
                w = Z + arm - P
                r.append((n.conjugate() * w).imag)
                J.append((-n.imag, n.real, (n.conjugate() * arm).real))
                push.append((dn.conjugate() * w - n.conjugate() * dP).imag)
            else:
                a = n * e
                v = a.conjugate() * (P - Z)
                r.append(v.imag + c)
                J.append((a.imag, -a.real, -v.real))
                push.append((a.conjugate() * dP).imag)
        return r, J, push

    def values(self, x):
        """Return residuals and Jacobian over arrays x (3, n)."""
        Z, e = x[0] + 1j * x[1], np.exp(1j * x[2])
        r, J = [], []
        for kind, m, P, n, c in self.legs:
            P = P.c[0]
            n = n.c[0] if isinstance(n, Series) else n
            arm = e * m
            if kind == "circle":
                w = Z + arm - P
                r.append(abs2(w) - c)
                J.append((2 * w.real, 2 * w.imag, -2 * (np.conj(w) * arm).imag))
            elif kind == "line":
                w = Z + arm - P
                r.append((np.conj(n) * w).imag)
                J.append((-n.imag, n.real, (np.conj(n) * arm).real))
            else:
                a = n * e
                v = np.conj(a) * (P - Z)
                r.append(v.imag + c)
                J.append((a.imag, -a.real, -v.real))
        return r, J

    def series(self, x):
        """Return the residuals as series for unknowns as series."""
        Z, e = x[0] + x[1] * 1j, x[2].unit()
        r = []
        for kind, m, P, n, c in self.legs:
            if kind == "circle":
                r.append((Z + e * m - P).square() - c)
            elif kind == "line":
                w = Z + e * m - P
                n = n if isinstance(n, Series) else n + 0j
                r.append((w * _conj(n)).imag)
            else:
                r.append(((P - Z) * (e * n).conjugate()).imag + c)
        return r

    def put(self, x):
        world, d = self.world, self.data
        e = x[2].unit()
        world.put(d["body"], "p0", x[0] + x[1] * 1j, e)
        for leg in d["legs"]:
            if leg["kind"] == "link":
                place, pin = world.place(leg["on"]), world.place((d["body"], leg["pin"]))
                arm = world.gap(leg["body"], "p0", "p1")
                world.put(leg["body"], "p0", place, (pin - place) / arm)
            elif leg["kind"] == "slide":
                own, _ = world.guided(leg["on"][0], leg)
                place = world.place((d["body"], leg["pin"]))
                world.put(leg["body"], "p1", place, own, after=(leg["on"][0], leg))
            elif leg["kind"] == "rail":
                turn = world.turned(leg["turn"])
                own = e * (np.conj(turn) if leg.get("swap") else turn)
                world.put(leg["body"], "p1", world.place(leg["on"]), own, after=(d["body"], leg))

    def all_roots(self):
        """Return all platform poses at a single driver value, None where two are near.

        Two of the three equations are linear in Z once the circles are subtracted from one
        another; Z(phi) goes into the third, a trigonometric polynomial in phi.
        """
        n = 64
        D, N, g = self._eliminated(np.exp(1j * np.arange(n) * (TURN / n)))
        if not np.all(np.isfinite(g)):
            return []
        c = np.fft.fft(g) / n
        c = np.concatenate([c[-8:], c[:9]])  # exponents -8 .. 8
        kept = np.flatnonzero(np.abs(c) > 1e-12 * np.abs(c).max())
        roots = np.roots(c[kept[0] : kept[-1] + 1][::-1])
        found, length = [], self.world.case.scale
        for w in roots[np.abs(np.abs(roots) - 1) < 1e-3]:
            angle = float(np.angle(w))
            D, N, _ = self._eliminated(np.exp(1j * angle))
            if abs(D) * length < 1e-9 * abs(N):
                return None
            Z = complex(N / D)
            x, good = solve(self, np.array([[Z.real], [Z.imag], [angle]], LD), length, 12)
            if not good[0]:
                continue
            x, y, phi = x[:, 0].astype(float)
            gaps = [
                max(abs(x - a) / length, abs(y - b) / length, abs(math.remainder(phi - c, TURN)))
                for a, b, c in found
            ]
            if any(1e-9 < gap < 1e-3 for gap in gaps):
                return None
            if not any(gap <= 1e-9 for gap in gaps):
                found.append((x, y, math.remainder(phi, TURN)))
        return found

    def _eliminated(self, e):
        """Return D and N with Z = N / D, and the equation left, for platform directions e."""
        rows = []
        for kind, m, P, n, c in self.legs:
            P, m, c = complex(P.c[0][0]), complex(m), float(c)
            n = complex(n.c[0][0]) if isinstance(n, Series) else complex(n)
            w = e * m - P
            if kind == "circle":
                rows.append((1, 2 * w, abs2(w) - c))
            elif kind == "line":
                rows.append((0, 1j * n, (np.conj(n) * w).imag))
            else:
                rows.append((0, -1j * n * e, (np.conj(n * e) * P).imag + c))
        rows.sort(key=lambda row: -row[0])
        k0, B0, A0 = rows[0]
        (B1, A1), (B2, A2) = ((B - k * B0, A - k * A0) for k, B, A in rows[1:])
        D, N = (np.conj(B1) * B2).imag, 1j * (A1 * B2 - A2 * B1)
        rest = (np.conj(B0) * N).real + A0 * D
        return D, N, abs2(N) + rest * D if k0 else rest


class Geared:
    """Link a on place p, link b on a's p1; a gear turns b, and b's p1 is held by a leg.

    theta_b - theta_a = ratio (theta_o - theta_a) + phase, or the other way round.
    """

    size = 1
    root_scales = staticmethod(lambda length: (1.0,))

    def __init__(self, world, element):
        d = element.data
        self.world, self.data, self.element = world, d, element
        ratio, phase = world.real(d["ratio"]), world.real(d["phase"])
        if not d["first"]:  # other - a = ratio (b - a) + phase
            ratio, phase = 1 / ratio, -phase / ratio
        self.share = 1 - ratio
        self.turned = world.angle(d["other"]) * ratio + phase
        self.p, self.q = world.place(d["p"]), world.place(d["q"])
        self.a, self.b = world.gap(d["a"], "p0", "p1"), world.gap(d["b"], "p0", "p1")
        leg = d["leg"]
        self.c = (
            abs2(world.gap(leg["body"], "p0", "p1"))
            if leg["kind"] == "link"
            else world.real(leg["length"]) ** 2
        )

    @property
    def norm(self):
        """What the slope of the one equation is measured by."""
        arms = np.abs(self.a) + np.abs(self.share * self.b)
        return 2 * np.sqrt(self.c) * arms

    def nodes(self):
        constant = (complex(self.a), complex(self.b), float(self.share), float(self.c))
        columns = [self.p - self.q, self.turned]
        parts = [column.c[i].tolist() for column in columns for i in (0, 1)]
        return [(*rest, constant) for rest in zip(*parts, strict=True)]

    @staticmethod
    def scalar(node, x):
        gap, dgap, turned, dturned, (a, b, share, c) = node
        one = cmath.exp(1j * x[0]) * a
        two = cmath.exp(1j * (share * x[0] + turned.real)) * b
        w = (gap + one + two).conjugate()
        r = w.real * w.real + w.imag * w.imag - c
        slope = -2 * (w * (one + share * two)).imag
        push = 2 * (w * (dgap + 1j * dturned.real * two)).real
        return [r], [(slope,)], [push]

    def values(self, x):
        one = np.exp(1j * x[0]) * self.a
        two = np.exp(1j * (self.share * x[0] + self.turned.c[0].real)) * self.b
        w = self.p.c[0] - self.q.c[0] + one + two
        return [abs2(w) - self.c], [(-2 * (np.conj(w) * (one + self.share * two)).imag,)]

    def series(self, x):
        two = (x[0] * self.share + self.turned).unit() * self.b
        return [(self.p - self.q + x[0].unit() * self.a + two).square() - self.c]

    def put(self, x):
        world, d = self.world, self.data
        world.put(d["a"], "p0", self.p, x[0].unit(), x[0])
        angle = x[0] * self.share + self.turned
        world.put(d["b"], "p0", world.place((d["a"], "p1")), angle.unit(), angle)
        leg = d["leg"]
        if leg["kind"] == "link":
            arm = world.gap(leg["body"], "p0", "p1")
            pin = world.place((d["b"], "p1"))
            world.put(leg["body"], "p0", self.q, (pin - self.q) / arm)

    def all_roots(self):
        return None


SYSTEMS = {"triad": Triad, "geared": Geared}


def _conj(n):
    return n.conjugate() if isinstance(n, Series) else np.conj(n)


# -- small linear systems ------------------------------------------------------------------


def determinant(J):
    if len(J) == 1:
        return J[0][0]
    (a, b, c), (d, e, f), (g, h, i) = J
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def cramer(J, r):
    """Return the solution of J x = r and the determinant, for numbers or arrays."""
    det = determinant(J)
    if len(J) == 1:
        return [r[0] / det], det
    (a, b, c), (d, e, f), (g, h, i) = J
    x = (r[0] * (e * i - f * h) - b * (r[1] * i - f * r[2]) + c * (r[1] * h - e * r[2])) / det
    y = (a * (r[1] * i - f * r[2]) - r[0] * (d * i - f * g) + c * (d * r[2] - r[1] * g)) / det
    z = (a * (e * r[2] - r[1] * h) - b * (d * r[2] - r[1] * g) + r[0] * (d * h - e * g)) / det
    return [x, y, z], det


def relative(J, det, scales, norm=None):
    """Return the determinant over `norm` or the product of the rows' lengths: a plain number."""
    if norm is not None:
        return det / norm
    size = 1.0
    for row in J:
        square = sum((v * s) ** 2 for v, s in zip(row, scales, strict=True))
        size = size * (math.sqrt(square) if isinstance(square, float) else np.sqrt(square))
    for s in scales:
        det = det * s
    return det / size


def solve(system, x, length, rounds):
    """Newton's method over arrays x (size, n); return x and where it converged."""
    scales = system.root_scales(length)
    x = np.array(x)
    moved = None
    for _ in range(rounds):
        r, J = system.values(x)
        step, _ = cramer(J, r)
        step = np.array(step)
        x = x - step
        moved = np.max([np.abs(s) / scale for s, scale in zip(step, scales, strict=True)], axis=0)
    tolerance = 1e-11 if x.dtype == LD else 1e-7
    return x, moved < tolerance


def close_tracked(world, element, sign):
    """Close an element on its track; sign FOLD: at the fold nearest to the driver value."""
    system = SYSTEMS[element.kind](world, element)
    scales = system.root_scales(world.case.scale)
    kind = LD if world.wide else float
    if isinstance(sign, str):  # FOLD
        x = element.track.at_fold(world.u)
    else:
        guess = guess_of(world, element, sign)
        x, good = solve(system, np.array(guess, kind), world.case.scale, 6 if world.wide else 4)
        far = np.max([np.abs(a - g) / s for a, g, s in zip(x, guess, scales, strict=True)], axis=0)
        x = np.where(good & (far < 0.5), x, np.nan)
    x = np.array(x, kind)
    _, J = system.values(x)
    det = determinant(J)
    disc = relative(J, det, scales, system.norm)
    if not isinstance(sign, str) and element.track is not None and not isinstance(sign, tuple):
        x = np.where(np.sign(disc) == element.track.sign, x, np.nan)
    unknowns = []
    for value in x:
        c = np.zeros((world.order + 1, len(world.u)), CLD if world.wide else complex)
        c[0] = value
        unknowns.append(Series(c))
    for order in range(1, world.order + 1):
        r = [part.c[order].real for part in system.series(unknowns)]
        if not isinstance(sign, str):
            for unknown, step in zip(unknowns, cramer(J, r)[0], strict=True):
                unknown.c[order] -= step
    system.put(unknowns)
    # its square vanishes linearly in the driver at a fold
    return Series((disc * disc)[None, :] + 0j)


def guess_of(world, element, sign):
    if isinstance(sign, tuple):  # a root of its own, at the sketch
        return np.repeat(np.array(sign, float)[:, None], len(world.u), axis=1)
    if element.track is None:
        return np.repeat(np.array(element.root, float)[:, None], len(world.u), axis=1)
    return element.track.guess(np.asarray(world.u, float), world.case.angular)


for _kind in SYSTEMS:
    CLOSURES[_kind] = close_tracked


# -- following -----------------------------------------------------------------------------


class Track:
    """The path of an element's root from the sketch over [low, high] as far as it goes.

    Ends are (value, word): "limit" at a fold, "pole" where the platform runs away,
    "doubtful" where neither is plain, "parent" at the ends it was given.
    """

    def __init__(self, case, k, low, high, places):
        """`places` are driver values to visit, rising, between the ends low and high."""
        self.case, self.k, self.element = case, k, case.elements[k]
        self.length = case.scale
        self.unit = 1.0 if case.angular else case.scale
        self.cls = SYSTEMS[self.element.kind]
        self.scales = self.cls.root_scales(self.length)
        self.s, self.x, self.v, self.d = [case.s0], [], [], []
        system = self._system(np.array([case.s0]))
        self.norm = None if system.norm is None else float(system.norm)
        x = self._newton(system.nodes()[0], list(self.element.root))
        self._measure(system.nodes()[0], x)
        self.sign = math.copysign(1.0, self.d[0])
        self.folds = {}
        ends = []
        for sense, end in ((-1, low), (1, high)):
            ahead = places[places < case.s0][::-1] if sense < 0 else places[places > case.s0]
            ends.append(self._follow(ahead, sense, end))
        self.low, self.high = ends
        order = np.argsort(self.s)
        self.S = np.array(self.s)[order]
        self.X, self.V = np.array(self.x)[order].T, np.array(self.v)[order].T

    def _system(self, u):
        world = self.case.close(u, order=1, wide=False, upto=self.k)
        return self.cls(world, self.element)

    def _newton(self, node, x):
        for _ in range(8):
            r, J, _ = self.cls.scalar(node, x)
            try:
                step, _ = cramer(J, r)
            except ZeroDivisionError:
                return None
            x = [a - b for a, b in zip(x, step, strict=True)]
            size = max(abs(b) / s for b, s in zip(step, self.scales, strict=True))
            if not size < 10:
                return None
            if size < 1e-13:
                break
        return x if size < 1e-9 else None

    def _measure(self, node, x):
        _, J, push = self.cls.scalar(node, x)
        v, det = cramer(J, [-p for p in push])
        self.x.append(x)
        self.v.append(v)
        self.d.append(relative(J, det, self.scales, self.norm))

    def _step(self, node, s):
        """Go to s; return whether the step is safe."""
        h = s - self.s[-1]
        x0, v0, d0 = self.x[-1], self.v[-1], self.d[-1]
        x = self._newton(node, [a + h * b for a, b in zip(x0, v0, strict=True)])
        if x is None:
            return False
        try:
            self._measure(node, x)
        except ZeroDivisionError:
            return False
        d1, v1 = self.d[-1], self.v[-1]
        scales = self.scales
        miss = max(
            abs(b - a - h * (p + q) / 2) / s
            for a, b, p, q, s in zip(x0, x, v0, v1, scales, strict=True)
        )
        moved = max(abs(h) * (abs(p) + abs(q)) / s for p, q, s in zip(v0, v1, scales, strict=True))
        good = d0 * d1 > 0 and 0.5 < d1 / d0 < 2 and miss <= 0.05 * moved + 1e-9
        if not good or not math.isfinite(miss):
            for table in (self.x, self.v, self.d):
                table.pop()
            return False
        self.s.append(s)
        return True

    def _cover(self, places, depth):
        """Visit places one after the other; return whether the last was reached."""
        while len(places):
            nodes = self._system(places).nodes()
            done = 0
            for s, node in zip(places.tolist(), nodes, strict=True):
                if not self._step(node, s):
                    break
                done += 1
            if done == len(places):
                return True
            here, bad = self.s[-1], float(places[done])
            if depth == DEPTH or abs(bad - here) < 1e-13 * max(self.unit, abs(here)):
                self.blocked = bad
                return False
            finer = here + (bad - here) * (np.arange(1, SUBDIVISIONS + 1) / SUBDIVISIONS)
            if not self._cover(finer, depth + 1):
                return False
            places = places[done + 1 :]
        return True

    def _follow(self, places, sense, end):
        # go on from the sketch each time
        self.s, self.x, self.v, self.d = (
            [*reversed(table)] if sense > 0 else table for table in (self.s, self.x, self.v, self.d)
        )
        start = len(self.s)
        # in chunks: the limit may be near
        for chunk in np.array_split(places, max(1, len(places) // 64)):
            if not self._cover(chunk, 0):
                break
        else:
            return (end[0], "doubtful" if self._hidden(end) else "parent")
        return self._end(sense, start)

    def _hidden(self, end):
        """Return whether the determinant seems to vanish between the last node and a fold there.

        Next to the fold of an element before, everything is smooth in the root of the distance.
        """
        at, kind = end
        if kind != "parent" or len(self.s) < 2:
            return False
        return vanishes(float(at), self.s[-2:], self.d[-2:])

    def _end(self, sense, start):
        here = self.s[-1]
        far = FAR * self.length if self.cls.size == 3 else math.inf
        away = max(abs(self.x[-1][0]), abs(self.x[-1][1] if self.cls.size == 3 else 0)) > far
        end = self._folds(here, sense, start)  # it may as well fold far away
        return (here, "pole") if away and end[1] != "limit" else end

    def _folds(self, here, sense, start):
        if len(self.s) < start + 3 and abs(here - self.case.s0) < 1e-9 * self.unit:
            return (here, "doubtful")
        # the square of the determinant against the driver, its last clear approach
        s, d = np.array(self.s[start - 1 :]), np.array(self.d[start - 1 :]) ** 2
        larger = np.flatnonzero(d > 30 * d[-1])
        if not larger.size:
            return (here, "doubtful")
        i = larger[-1]
        slope = (d[-1] - d[i]) / (s[-1] - s[i])
        if not slope * sense < 0:
            return (here, "doubtful")
        guess = here - d[-1] / slope
        if not abs(guess - here) < 1e-3 * self.unit:
            return (here, "doubtful")
        return self._fold(guess, sense)

    def _fold(self, u, sense):
        """Refine a fold in 80 bits by extrapolating det -> 0 over four places near it.

        The driver is a power series in the determinant that has no linear term: through it goes
        the quotient of two extrapolations, each of a polynomial over the determinant.
        """
        size = self.unit
        for delta in (1e-8, 1e-9, 1e-9):
            places = LD(u) - sense * LD(delta * size) * np.arange(1, 5).astype(LD)
            world = self.case.close(places, upto=self.k)
            system = self.cls(world, self.element)
            x = self._near(places, u, sense)
            x, good = solve(system, x, self.length, 8)
            _, J = system.values(x)
            det = relative(J, determinant(J), self.scales, system.norm)
            if not good.all() or np.any(np.sign(det) != self.sign):
                return (float(u), "doubtful")
            d2 = det * det
            gap = extrapolate(det, (places - LD(u)) / det, LD(0))
            u_new = LD(u) + gap / extrapolate(det, 1 / det, LD(0))
            if abs(float(u_new - u)) > 3 * delta * size:
                u = u_new
                continue
            u = u_new
            at = np.array([extrapolate(det, row, LD(0)) for row in x])
            slope = np.array([(x[j] - at[j])[0] / det[0] for j in range(len(at))])
            linear = d2[3] / d2[0]
            if not 3.9 < linear < 4.1:
                return (float(u), "doubtful")
            self.folds[sense] = (u, at, slope, det[0], d2[0] / abs(places[0] - u))
        if sense not in self.folds:
            return (float(u), "doubtful")
        return (u, "limit")

    def _near(self, places, u, sense):
        """Return guesses before a fold from the last nodes: linear in sqrt(distance)."""
        S, X = np.array(self.s), np.array(self.x)
        gap = (float(u) - S) * sense
        order = np.argsort(gap)
        order = order[gap[order] > 0]
        sigma = np.sqrt(gap[order])
        wanted = np.sqrt(np.abs(places - LD(u)).astype(float))
        result = []
        for column in X[order].T:
            result.append(np.interp(wanted, sigma, column))
        return np.array(result, LD)

    # -- use ------------------------------------------------------------------------------

    def inside(self, u):
        return (u >= float(self.low[0])) & (u <= float(self.high[0]))

    def guess(self, u, angular):
        """Return guesses (size, n); a whole turn away where the track only goes there."""
        s = np.array(u, float)
        turned = np.zeros(len(s))
        if angular:
            outside = ~self.inside(s)
            for turns in (-1, 1, -2, 2, -3, 3, -4, 4):
                other = s + turns * TURN
                take = outside & self.inside(other) & (turned == 0)
                turned[take] = turns
            s = s + turned * TURN
        S, X, V = self.S, self.X, self.V
        if len(S) == 1:
            return np.repeat(X, len(s), axis=1)
        k = np.clip(np.searchsorted(S, s, side="right") - 1, 0, len(S) - 2)
        h = S[k + 1] - S[k]
        t = (s - S[k]) / h
        x0, x1, v0, v1 = X[:, k], X[:, k + 1], V[:, k] * h, V[:, k + 1] * h
        rise = x1 - x0
        result = x0 + t * (v0 + t * (3 * rise - 2 * v0 - v1 + t * (v0 + v1 - 2 * rise)))
        for sense, (u_fold, at, slope, det, rate) in self.folds.items():
            last = S[-1] if sense > 0 else S[0]
            beyond = (s - last) * sense > 0
            if beyond.any():
                gap = np.maximum((float(u_fold) - s[beyond]) * sense, 0)
                sigma = np.sqrt(float(rate) * gap) * np.sign(float(det))
                result[:, beyond] = at.astype(float)[:, None] + slope.astype(float)[:, None] * sigma
        result[:, ~self.inside(s)] = np.nan
        return result

    def at_fold(self, u):
        """Return the unknowns at the fold nearest to each u."""
        columns = []
        for value in u:
            folds = sorted(self.folds.values(), key=lambda f: abs(float(f[0] - value)))
            columns.append(folds[0][1] if folds else np.full(self.cls.size, np.nan))
        return np.array(columns).T


def vanishes(at, places, values):
    """Return whether values at two places change their sign before `at`, linear in the root."""
    far, near = (math.sqrt(abs(at - s)) for s in places)
    return not (values[1] + (values[1] - values[0]) * near / (far - near)) * values[1] > 0


def extrapolate(t, y, to):
    """Return the polynomial through (t, y) at `to`, by Neville's scheme."""
    y = [LD(v) for v in y]
    t = [LD(v) for v in t]
    n = len(y)
    for level in range(1, n):
        for i in range(n - level):
            a, b = t[i], t[i + level]
            y[i] = ((to - b) * y[i] + (a - to) * y[i + 1]) / (a - b)
    return y[0]
