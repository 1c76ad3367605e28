"""The drivers' values as a curve u(s), and how far it leaves its tangent over a step.

Corners (abs, sign, min, max) are written with switches that are +1 or -1: between two
places where a switch turns, the curve is smooth and its derivatives are those of the
expression with the switches held.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.balls import HUGE, radii
from mechdae.kernels.bounds.walk import SYMBOLIC, replay
from mechdae.kernels.run.functions import Call
from mechdae.types import Floats, Graph, Integers, Matrix, Sym

SX = ca.SX
FINITE = 1e50
"""What is larger was not bounded: a pole, the end of a domain."""


class DriverCurve:
    """A curve u(s) in the drivers' values.

    Parameters
    ----------
    s : SX
        The symbol of the path's parameter: time, or the value of the one driver that moves.
    u : SX (nd,)
        Expressions of `s`.
    turns
        Whether s is an angle, so that a whole turn leads to the same values.

    Attributes
    ----------
    smooth : SX (nd,)
        u with `switches` in place of its corners.
    switches, gaps : SX (k,)
        Each switch is the sign of its gap; a gap may hold earlier switches.
    """

    smooth: Sym
    switches: Sym
    gaps: Sym

    def __init__(self, s: Sym, u: Sym, turns: bool = False) -> None:
        self.s: Sym = s
        self.u: Sym = u
        self.turns: bool = turns
        self.smooth, self.switches, self.gaps = _without_corners(s, u)
        self._cuts = _cuts(s, u)
        rates = [self.smooth]
        for _ in range(3):
            rates.append(ca.jacobian(rates[-1], s))
        self._rates = [ca.densify(rate) for rate in rates]
        self._reach: Any = None
        self._jet: Call | None = None

    @property
    def text(self) -> str:
        """The curve as text: equal ones have the same kernels."""
        return str(ca.Function("u", [self.s], [ca.densify(self.u)]).serialize())

    @cached_property
    def piece(self) -> Graph:
        """(s, switches) -> u, u', u'', u''' with the switches held."""
        return ca.Function("piece", [self.s, self.switches], self._rates)

    @cached_property
    def gap(self) -> Graph:
        """(s) -> gaps (k,); their signs are the switches."""
        gaps = list(ca.vertsplit(self.gaps)) if self.gaps.numel() else []
        for k in range(len(gaps)):
            known = ca.vertcat(*[ca.sign(gap) for gap in gaps[:k]]) if k else SX(0, 1)
            gaps[k] = ca.substitute(gaps[k], self.switches[:k], known) if k else gaps[k]
        return ca.Function("gap", [self.s], [ca.vertcat(*gaps) if gaps else SX(0, 1)])

    @cached_property
    def values(self) -> Graph:
        """(s) -> u, u', u'', u'''."""
        _, *rates = self.piece(self.s, ca.sign(self.gap(self.s)))
        return ca.Function("course", [self.s], [ca.densify(self.u), *rates])

    def sampled(self, s: Floats | Sequence[float], order: int = 2) -> list[Matrix]:
        """Return u and its first derivatives (n, nd), up to `order` <= 3, at `s` (n,)."""
        parts = self.values(np.asarray(s, float)[None, :])
        return [np.array(part).T for part in parts[: order + 1]]

    def jet(self, s: float) -> list[Floats]:
        """Return u and its first three derivatives (nd,) at one `s`."""
        if self._jet is None:
            self._jet = Call(self.values)
        return self._jet(s)

    def sides(self, s: Floats) -> Any:
        """Return the switches (n, k) at `s` (n,)."""
        return np.sign(np.array(self.gap(np.asarray(s, float)[None, :])).reshape(-1, len(s)).T)

    def cuts(self, s: Floats) -> Integers:
        """Return (n, k) where each atan2 is over its cut, along which it jumps, at `s` (n,).

        The number is the sign of its ordinate where the abscissa is negative, else 0.
        """
        parts = np.array(self._cuts(np.asarray(s, float)[None, :])).reshape(-1, len(s))
        return (np.where(parts[::2] >= 0, 1, -1) * (parts[1::2] < 0)).T

    def one_sided(self, s: float, switches: Floats) -> list[Floats]:
        """Return u and three derivatives (nd,) at `s` with the switches of one side."""
        return [np.array(part).ravel() for part in self.piece(s, switches)]

    def reach(self, s: Floats, ds: Floats) -> Matrix:
        """Return bounds (n, nd) of |u| within `ds` (n,) of `s` (n,); above `FINITE`: none."""
        if self._reach is None:
            at, step = SX.sym("s"), SX.sym("ds")
            u, first, _ = self.at(at)
            size = ca.fabs(u) + step * ca.fabs(first) + self.drift(at, step)
            self._reach = ca.Function("reach", [at, step], [size])
        return np.array(self._reach(s[None, :], ds[None, :])).T

    def at(self, s: Sym) -> tuple[Sym, Sym, Sym]:
        """Return u, u' and u'' at a symbol `s`."""
        u, first, second, _ = self.values(s)
        return u, first, second

    def drift(self, s: Sym, ds: Sym) -> Sym:
        """Return a bound (nd,) of |u(s + t) - u - u' t| for |t| <= ds.

        Where u is smooth, ds^2/2 times the bound of its second derivative; where a switch
        turns, what u and its tangent can move, which does not shrink at a jump.
        """
        _, first, second = self.at(s)
        signs = ca.sign(self.gap(s))
        ball = [(s, ds)]
        turning = self._turning(s, ds)
        events = self.switches

        def moved(expression: Sym) -> Sym:
            function = ca.Function("f", [self.s, events], [expression])
            switches = [(signs[k], 2 * turning[k]) for k in range(events.numel())]
            return radii(function, [ball, switches])

        away = moved(self.smooth)
        bent = ds * ds / 2 * (ca.fabs(second) + moved(self._rates[2]))
        smooth = ca.logic_and(away < FINITE, ca.sum1(turning) == 0)
        return ca.fmin(ca.if_else(smooth, bent, HUGE), away + ds * ca.fabs(first))

    def _turning(self, s: Sym, ds: Sym) -> Sym:
        """Return for each switch 1 where it may turn within the step, else 0."""
        signs, turning = ca.sign(self.gap(s)), SX(0, 1)
        for k in range(self.switches.numel()):
            before = self.switches[:k]
            function = ca.Function("f", [self.s, before], [self.gaps[k]])
            switches = [(signs[j], 2 * turning[j]) for j in range(k)]
            radius = radii(function, [[(s, ds)], switches])
            turning = ca.vertcat(turning, ca.fabs(self.gap(s)[k]) <= radius)
        return turning


def _cuts(s: Sym, u: Sym) -> Graph:
    """Return the function s -> ordinate and abscissa of each atan2 in u."""
    found: list[Any] = []

    def operation(code: int, values: list[Sym]) -> Sym:
        if code == ca.OP_ATAN2:
            found.extend(values)
        return SYMBOLIC[code](*values)

    replay(ca.Function("u", [s], [ca.densify(u)]), [[s]], operation, SX)
    return ca.Function("cuts", [s], [ca.vertcat(SX(0, 1), *found)])


def _without_corners(s: Sym, u: Sym) -> tuple[Sym, Sym, Sym]:
    """Return u with switches in place of its corners, the switches and their gaps."""
    switches: list[Sym] = []
    gaps: list[Sym] = []

    def switch(gap: Sym) -> Sym:
        gaps.append(gap)
        switches.append(SX.sym(f"switch{len(gaps)}"))
        return switches[-1]

    def operation(code: int, values: list[Sym]) -> Sym:
        if code == ca.OP_SIGN:
            return switch(values[0])
        if code == ca.OP_FABS:
            return switch(values[0]) * values[0]
        if code in (ca.OP_FMIN, ca.OP_FMAX):
            a, b = values
            half = switch(a - b) * (a - b) / 2
            return (a + b) / 2 + (half if code == ca.OP_FMAX else -half)
        return SYMBOLIC[code](*values)

    function = ca.Function("u", [s], [ca.densify(u)])
    smooth = replay(function, [[s]], operation, SX)[0]
    return ca.vertcat(*smooth), ca.vertcat(SX(0, 1), *switches), ca.vertcat(SX(0, 1), *gaps)
