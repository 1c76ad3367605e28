"""From a problem to results: which room computes a task, what `show` and `check` say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechdae.additions import lazy_names

if TYPE_CHECKING:
    from mechdae.tasks.motion_of import ExportedMotion, reported
    from mechdae.tasks.solver import Solver

__all__ = ["ExportedMotion", "Solver", "reported"]
__getattr__ = lazy_names(
    {
        "mechdae.tasks.motion_of": "ExportedMotion reported",
        "mechdae.tasks.solver": "Solver",
    }
)
