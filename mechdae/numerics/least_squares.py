"""Newton steps of square and of overdetermined systems."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.types import Floats, Jacobian


def solve(J: Jacobian, F: Floats) -> Any:
    """Return the step J^-1 F, with more equations than unknowns that of least squares."""
    if J.shape[0] == J.shape[1]:
        return np.linalg.solve(J, F)
    return np.linalg.lstsq(J, F)[0]
