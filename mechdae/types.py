"""What arrays hold, by name: for annotations.

casadi tells no types: ``Sym`` is one of its expressions, ``Graph`` one of its functions.
"""

from __future__ import annotations

from typing import Any
from typing import Any as Graph
from typing import Any as Sym

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Booleans", "Complexes", "Floats", "Graph", "Integers", "Jacobian", "Jacobians", "Json",
    "Matrices", "Matrix", "Numbers", "Objects", "Points", "Reactions", "Sym", "Texts", "Unknowns",
]  # fmt: skip

Floats = NDArray[np.float64]
"""Real numbers, one for each pose unless another shape is told."""
Points = NDArray[np.float64]
"""Points or vectors of the plane, (n, 2)."""
Unknowns = NDArray[np.float64]
"""Unknowns of one pose, (unknowns,), or of each pose, (n, unknowns)."""
Matrix = NDArray[np.float64]
"""One matrix, (rows, columns)."""
Matrices = NDArray[np.float64]
"""A matrix for each pose, (n, rows, columns)."""
Jacobian = NDArray[np.float64]
"""First derivatives of equations, (equations, unknowns), or their inverse."""
Jacobians = NDArray[np.float64]
"""Those of each pose, (n, equations, unknowns)."""
Complexes = NDArray[np.complex128]
"""Complex numbers: points on paths of homotopies, roots of polynomials."""
Numbers = NDArray[Any]
"""Real or complex numbers, whichever a function is given."""
Integers = NDArray[np.int_]
"""Places of rows or columns."""
Booleans = NDArray[np.bool_]
"""What holds, one for each pose or element."""
Texts = NDArray[np.str_]
"""Texts, one for each pose."""
Objects = NDArray[np.object_]
"""Python values in an array: balls, rationals."""
Reactions = NDArray[np.float64]
"""Forces and moments of a joint, (n, 3): Fx, Fy [N], M [N m]."""
Json = dict[str, Any]
"""What JSON or TOML holds under its keys."""
