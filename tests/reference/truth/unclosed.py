"""Groups without a closed formula, as equations of their unknowns.

A `Triad` is a platform on three legs: unknowns X, Y, phi of the platform, one equation a
leg. A `Geared` pair of links has one unknown, the angle of the first: the second turns as a
gear tells.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from .elements import abs2
from .series import LD, Series
from .small_systems import solve

TURN = 2 * np.pi


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
