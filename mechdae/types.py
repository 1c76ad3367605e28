"""What arrays hold, by name: for annotations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Real numbers, one for each pose unless another shape is told."""
Points = NDArray[np.float64]
"""Points or vectors of the plane, (n, 2)."""
Integers = NDArray[np.int_]
"""Places of rows or columns."""
Texts = NDArray[np.str_]
"""Texts, one for each pose."""
Reactions = NDArray[np.float64]
"""Forces and moments of a joint, (n, 3): Fx, Fy [N], M [N m]."""
Sym = Any
"""A casadi expression; casadi tells no types."""
