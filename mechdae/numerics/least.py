"""Where functions are least in intervals with one minimum each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechdae.types import Floats

PLACES, ROUNDS = 15, 16
"""Places inside an interval, of which the neighbours of the least are kept, and how often."""


def narrowed(look: Callable[[Floats], Floats], a: Floats, b: Floats) -> Floats:
    """Return where functions (n,) are least in intervals [a, b] with one minimum each.

    `look`: from places (n, m), those of each function in its row, to its values there.
    """
    shares = np.arange(PLACES + 2) / (PLACES + 1)
    for _ in range(ROUNDS):
        places = a[:, None] + (b - a)[:, None] * shares
        values = look(places[:, 1:-1])
        k = np.argmin(np.where(np.isfinite(values), values, np.inf), axis=1)
        a, b = (np.take_along_axis(places, (k + off)[:, None], axis=1)[:, 0] for off in (0, 2))
    return (a + b) / 2
