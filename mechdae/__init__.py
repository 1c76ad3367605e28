"""Mechanisms from symbolic constraints: poses, assembly modes, velocities, accelerations.

Names are imported when they are first used, so that ``import mechdae`` stays light.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.16.0"

_HOMES = {
    "mechdae.errors": "MechdaeError InputError ProblemFileError MechanismError UnknownName "
    "UnavailableError SolveError AssemblyError IndeterminateFrictionError "
    "InconsistentStartError InfeasibleMotionError SingularMassError",
    "mechdae.describe.mechanism": "Mechanism Ground Body",
    "mechdae.describe.joints": "Revolute Prismatic PinInSlot Weld Gear Rack Belt FrictionWheel "
    "Distance Curve",
    "mechdae.describe.vectors.values": "Vector Node",
    "mechdae.describe.vectors.expand": "from_loops",
    "mechdae.describe.spatial_joints": "SpatialRevolute SpatialPrismatic Cylindrical Spherical "
    "Universal PlanarPair Screw SpatialWeld SpatialGear SpatialRack",
    "mechdae.homotopy.platforms": "platform_poses",
    "mechdae.homotopy.six_axes": "arm_poses",
    "mechdae.describe.loads": "Force Torque Resistance Spring TableLoad TimeTable",
    "mechdae.describe.tasks.kinds": "Driver Sweep Modes Reactions Motion Equilibrium Synthesis "
    "Composition CurveGoal Study Sensitivity",
    "mechdae.describe.file.problem": "Problem Expected",
    "mechdae.describe.file.load": "load",
    "mechdae.describe.file.writing": "dump dumps",
    "mechdae.tasks.solve": "solve",
    "mechdae.tasks.solver": "Solver",
    "mechdae.tasks.study": "study screen",
    "mechdae.derivatives.function": "function",
    "mechdae.assembly.open_mechanism": "opened",
    "mechdae.tasks.designing": "synthesize",
    "mechdae.results": "Result SweepResult ModesResult ReactionsResult MotionResult "
    "EquilibriumResult StudyResult SensitivityResult SynthesisResult Status",
    "mechdae.export.folder": "read save StoredResults",
    "mechdae.draw": "plot",
    "mechdae.pages": "Page page",
    "mechdae.certificates": "certify check_certificate",
    "mechdae.explanations": "Explanation explain",
    "mechdae.reports": "Report report",
    "mechdae.assignments": "Assignment Assignments assign",
    "mechdae.exchange": "Exported exported imported",
    "mechdae.composition.chains": "KinematicChain chains count_chains assur_groups",
    "mechdae.composition.mechanisms": "mechanism_of problem_of",
    "mechdae.composition.variants.scheme": "Variant",
    "mechdae.ranking.variants": "variants count_variants",
    "mechdae.ranking.rank": "rank Ranking",
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}
__all__ = ["__version__", *sorted(_HOME)]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'mechdae' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOME[name]), name)


def _shown(how: str, result: Any) -> str:
    """Return a result as "text" or "html": what rooms make of it that results do not know."""
    tables = importlib.import_module("mechdae.tables")
    if how == "text":
        text: str = tables.table(result)
        return text
    picture: str = importlib.import_module("mechdae.draw").data_url(result)
    html: str = tables.html(result, picture)
    return html


def _finer(result: Any, parts: int) -> Any:
    """Return the task of a result at more poses: what solves knows results, not the reverse."""
    return importlib.import_module("mechdae.solver.finer").finer(result, parts)


def _for_picture(*asked: Any) -> Any:
    """Return the result of a task as a picture needs it, for pictures of problems."""
    return importlib.import_module("mechdae.tasks.pictures").for_picture(*asked)


def __dir__() -> list[str]:
    return __all__
