"""Roots, magnitudes, least and greatest values rounded where they have no derivative.

A solver that goes by second derivatives finds no end at a kink. So a number of the user's that has
kinks is rounded over a share of the size that it is about: sqrt(f) becomes sqrt(f + e^2), |x|
sqrt(x^2 + e^2), and the lesser and the greater of two numbers follow from the magnitude of their
difference. The share is a parameter of the NLP, which is solved with ever smaller ones; designs
are judged by the number itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from mechdae.kernels.bounds.walk import ARRAYS, replay, symbolic
from mechdae.types import Floats, Graph, Sym

SOFT = "soft"
"""Parameter of an NLP: over which share of their sizes kinks are rounded."""
COARSE, FINEST = (1e-2, 1e-4), 1e-6
"""Shares that a start goes through, and the one that it ends with."""
KINKS = (ca.OP_SQRT, ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX)


def kinked(function: Graph) -> bool:
    codes = range(function.n_instructions())
    return any(function.instruction_id(k) in KINKS for k in codes)


def rounded(function: Graph, samples: Sequence[Floats], inputs: Sequence[Sym], soft: Sym) -> Sym:
    """Return the first output of an SX function with its kinks rounded."""
    sizes: list[float] = []

    def measured(code: int, values: list[Floats]) -> Any:
        if code in KINKS:
            size = np.median(np.abs(_about(code, *values)))
            sizes.append(float(size) if np.isfinite(size) and size > 0 else 1.0)
        return ARRAYS[code](*values)

    with np.errstate(all="ignore"):
        replay(function, [list(np.asarray(sample, float).T) for sample in samples], measured, float)
    each = iter(sizes)

    def operation(code: int, values: list[Sym]) -> Sym:
        if code not in KINKS:
            return symbolic(code, *values)
        e2 = (soft * next(each)) ** 2
        if code == ca.OP_SQRT:
            return ca.sqrt(values[0] + e2)
        if code == ca.OP_FABS:
            return ca.sqrt(values[0] ** 2 + e2)
        a, b = values
        apart = ca.sqrt((a - b) ** 2 + e2)
        return (a + b + (apart if code == ca.OP_FMAX else -apart)) / 2

    every = [ca.vertsplit(symbols) if symbols.numel() else [] for symbols in map(ca.SX, inputs)]
    return ca.vertcat(*replay(function, every, operation, ca.SX)[0])


def _about(code: int, *values: Floats) -> Floats:
    """Return what vanishes at a kink."""
    if code == ca.OP_SQRT:
        return np.sqrt(np.abs(values[0]))
    return values[0] if code == ca.OP_FABS else values[0] - values[1]
