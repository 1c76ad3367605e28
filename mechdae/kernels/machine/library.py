"""The compiled machine, where it was built and is wanted; light to import.

It is built with the package where a C compiler is, see `build_machine.py`. Without it casadi's
virtual machine and NumPy do the same work.
"""

from __future__ import annotations

import os
from functools import cache
from importlib import import_module
from typing import Any

from mechdae.errors import InputError

ABI = 2
"""That of `machine.c`: a library of other sources is not used."""
VARIABLE = "MECHDAE_BACKEND"


@cache
def library() -> Any:
    """Return the compiled machine, None where there is none or NumPy is chosen."""
    wanted = os.environ.get(VARIABLE, "").strip().lower()
    if wanted not in ("", "c", "numpy"):
        raise InputError(f"{wanted!r} is no back end", where=VARIABLE, hint="c or numpy")
    if wanted == "numpy":
        return None
    try:
        found = import_module("mechdae.kernels.machine._machine")
    except ImportError:
        found = None
    if found is not None and found.ABI == ABI:
        return found
    if wanted == "c":
        raise InputError(
            "the compiled machine is not in this installation",
            where=VARIABLE,
            hint="install mechdae where a C compiler is, or leave the variable out",
        )
    return None


def backend() -> str:
    """Return in words what evaluates kernels."""
    found = library()
    return f"C, {found.vectors(None)[0]}" if found is not None else "NumPy"
