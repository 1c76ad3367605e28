"""Groups without a closed formula, followed root by root along the driver.

A `Track` follows the root of a system from the sketch in steps that are halved until the
determinant keeps its sign and changes by less than a factor of two, and the tangents at both
ends agree; where it ends, the square of the determinant goes to zero linearly: a fold.
"""

from __future__ import annotations

import math

import numpy as np

from .elements import CLOSURES
from .series import CLD, LD, Series
from .small_systems import cramer, determinant, relative, solve
from .unclosed import SYSTEMS

TURN = 2 * np.pi
SUBDIVISIONS = 16
DEPTH = 12
FOLD = "fold"
FAR = 60.0
"""Lengths at which a platform counts as running away to a pole."""


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
