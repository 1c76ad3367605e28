"""Quintic Hermite pieces: through value, rate and second rate at both ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mechdae.types import Floats


def upper_coefficients(
    rise: Floats, v0: Floats, v1: Floats, a0: Floats, a1: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return c3, c4, c5 of x0 + v0 t + a0 t^2/2 + c3 t^3 + c4 t^4 + c5 t^5 over 0 <= t <= 1.

    `rise` is x1 - x0; rates are those by t.
    """
    c3 = 10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
    c5 = 6 * rise - 3 * (v0 + v1) + 0.5 * (a1 - a0)
    return c3, c4, c5
